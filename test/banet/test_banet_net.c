// test_banet_net.c: BA-Net on sheets whose attachments are seen by rule (banet_sheets.h): learning, resuming, files,
// calibration.
#include <math.h>

#include "banet/banet_net_internal.h"
#include "banet_sheets.h"
#include "test_alloc.h"
#include "test_files.h"

static OmBanetTrainDef small_def(const OmBanetData* data, const char* dir) {
    OmBanetTrainDef def = om_banet_train_default_def(data, dir);
    memcpy(def.channel, (const int[]){16, 16, 16, 16, 16}, sizeof def.channel);
    def.dim[0] = 16, def.dim[1] = 32;  // sheets are 16 wide, one is larger
    def.batch = 8;
    def.nepoch = test_count(1, 8);
    def.rate = 0.01;
    def.nworker = 1;
    def.nimage = 2;
    return def;
}

static const BanetLayers tiny = {.channel = {16, 16, 16, 16, 16}, .ngroup = 2, .nimage = 8};

static OmBanetNet* make_net(void) {
    OmBanetNet* net;
    assert_ok(om__banet_net_create(&tiny, &net));
    om_net_init_parameters(net->net, 3, net->param);
    net->slope = 0.7;
    net->offset = -0.4;
    net->threshold = 0.35;
    assert_ok(om_facts_add(&net->facts, "seed", "3"));
    return net;
}

static void test_join(void** state) {
    (void)state;
    OmBanetData a = make_data(), b = make_data();
    assert_status(om_banet_data_join(&a, &b), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "begins with sample 0"));
    for (int s = 0; s < NSHEET; ++s) b.sample[s].fact.index = 100 + s;
    b.hash = 78;
    assert_status(om_banet_data_join(&a, &b), OM_INVALID);
    assert_int_equal(b.nsample, NSHEET);
    b.hash = 77;
    assert_ok(om_banet_data_join(&a, &b));
    assert_int_equal(a.nsample, 2 * NSHEET);
    assert_int_equal(a.sample[NSHEET + 3].fact.index, 103);
    assert_int_equal(b.nsample, 0);
    om_banet_data_done(&b);
    om_banet_data_done(&a);
}

// ---- learning ---------------------------------------------------------------------------------------

static void read_all(const char* dir, const char* name, char** bytes, size_t* size) {
    char path[512];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_ok(om_file_read(path, 1 << 24, bytes, size));
}

typedef struct Stop {
    int left;  // steps until the training is cancelled
} Stop;

static bool stop(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return ((Stop*)ctx)->left-- > 0;
}

static void test_it_learns_and_resumes(void** state) {
    (void)state;
    OmBanetData data = make_data();
    OmBanetTrainSummary s[2];
    char dir[2][256], *bytes[2];
    size_t size[2];
    for (int k = 0; k < 2; ++k) {
        snprintf(dir[k], sizeof dir[k], "%s", temp_path(k ? "banet_cut" : "banet_whole"));
        (void)om_path_remove(dir[k]);
        OmBanetTrainDef def = small_def(&data, dir[k]);
        Stop when = {test_count(3, 23)};
        const OmProgress progress = {stop, &when};
        if (k) assert_status(om_banet_train(&def, &progress, &s[k]), OM_CANCELLED);
        assert_ok(om_banet_train(&def, NULL, &s[k]));
        assert_true(s[k].is_resumed == (k == 1));
        read_all(dir[k], "weights.safetensors", &bytes[k], &size[k]);
    }
    // Attachments of half of the sheets' cells at random have a DSC of about 0.2.
    if (test_is_slow()) {
        assert_true(s[0].dsc > 0.7);
        assert_true(s[0].tpr > 0.7);
        assert_below(s[0].ece, 0.05);
    }
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    // The network of the file scores what the training says.
    OmBanetNet* net;
    OmBanetEval e;
    char path[512];
    assert_ok(om_path_join(dir[0], "weights.safetensors", path, sizeof path));
    assert_ok(om_banet_net_load(path, &net));
    assert_ok(om_banet_eval(net, &data, 44, 4, 1, NULL, &e));
    assert_near(e.mean_dsc, s[0].dsc, 1e-12);
    assert_near(om_banet_net_threshold(net), s[0].threshold, 0);
    assert_string_equal(om_banet_net_fact(net, "samples"), "44");
    // what its samples state; their law is not stated
    assert_string_equal(om_banet_net_fact(net, "voxel_m"), "0.005");
    assert_string_equal(om_banet_net_fact(net, "element"), "linear");
    assert_null(om_banet_net_fact(net, "law"));
    assert_near(om_banet_net_side(net), 0.32, 0);
    om_banet_eval_done(&e);
    assert_status(om_banet_eval(net, &data, 45, 4, 1, NULL, &e), OM_INVALID);
    om_banet_net_destroy(net);
    for (int k = 0; k < 2; ++k) {
        om_free(bytes[k]);
        assert_ok(om_path_remove(dir[k]));
    }
    om_banet_data_done(&data);
}

static void test_refused_definitions(void** state) {
    (void)state;
    OmBanetData data = make_data();
    OmBanetTrainSummary s;
    const char* dir = temp_path("banet_refused");
    const struct {
        const char* sentence;
        int field;
    } wrong[] = {{"batch", 0},         {"kept for validation", 1}, {"groups", 3},
                 {"mirror images", 4}, {"multiples of 16", 5},     {"dropout", 6}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        OmBanetTrainDef def = small_def(&data, dir);
        if (wrong[k].field == 0) def.batch = 0;
        if (wrong[k].field == 1) def.nvalid = 41;
        if (wrong[k].field == 3) def.ngroup = 3;
        if (wrong[k].field == 4) def.nimage = 9;
        if (wrong[k].field == 5) def.dim[2] = 8;
        if (wrong[k].field == 6) def.dropout = 1;
        assert_status(om_banet_train(&def, NULL, &s), OM_INVALID);
        if (!strstr(om_error_message(), wrong[k].sentence))
            fail_msg("\"%s\" does not say \"%s\"", om_error_message(), wrong[k].sentence);
    }
    (void)om_path_remove(dir);
    om_banet_data_done(&data);
}

// ---- ranks ------------------------------------------------------------------------------------------

typedef struct Ranks {
    int ncall;    // of mean
    bool is_bad;  // another rank says that it failed
} Ranks;

static OmStatus mean_alone(void* ctx, float* value, int64_t count) {
    Ranks* r = ctx;
    if (r->ncall++ == 0 && r->is_bad) value[0] = 0.5f;
    (void)count;
    return OM_OK;
}

// The second of two ranks trains on its half of every batch and writes nothing.
static void test_ranks(void** state) {
    (void)state;
    OmBanetData data = make_data();
    OmBanetTrainSummary s;
    Ranks ranks = {0};
    const OmTrainGroup group = {.rank = 1, .size = 2, .mean = mean_alone, .ctx = &ranks};
    char dir[256];
    snprintf(dir, sizeof dir, "%s", temp_path("banet_rank"));
    (void)om_path_remove(dir);
    OmBanetTrainDef def = small_def(&data, dir);
    def.group = &group;
    def.nepoch = 1;
    assert_ok(om_banet_train(&def, NULL, &s));
    assert_int_equal(s.nstep, 44 / 8);  // steps of 8 samples, 4 on each rank
    assert_true(ranks.ncall > s.nstep);
    static const char* const file[] = {"weights.safetensors", "checkpoint.safetensors",
                                       "metrics.csv", "report.html"};
    for (size_t k = 0; k < sizeof file / sizeof *file; ++k) {
        char path[512];
        assert_ok(om_path_join(dir, file[k], path, sizeof path));
        assert_false(om_path_exists(path));
    }
    ranks = (Ranks){.is_bad = true};
    assert_status(om_banet_train(&def, NULL, &s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "another rank failed"));
    assert_int_equal(ranks.ncall, 1);
    // A rank that failed alone tells the others, and keeps its own status.
    ranks = (Ranks){0};
    assert_ok(om_train_group_agree(&group, OM_OK));
    assert_int_equal(om_train_group_agree(&group, OM_IO), OM_IO);
    assert_int_equal(ranks.ncall, 2);
    assert_int_equal(om_train_group_agree(NULL, OM_IO), OM_IO);
    def.batch = 9;
    assert_status(om_banet_train(&def, NULL, &s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "2 ranks"));
    (void)om_path_remove(dir);
    om_banet_data_done(&data);
}

// ---- prediction -------------------------------------------------------------------------------------

// The mean over all mirror images does not know left from right.
static void test_mirror_images(void** state) {
    (void)state;
    OmBanetNet* net = make_net();
    OmBanetPredictor* p;
    OmBanetCells cells;
    const int dim[3] = {32, 32, 16};
    const size_t n = om_grid_count(dim);
    float* in = om_alloc(OM_BANET_NCHANNEL * n, sizeof *in);
    float* out = om_alloc(2 * n, sizeof *out);
    make_sheet(1, &cells);
    assert_ok(om_banet_predictor_create(net, dim, 1, &p));
    for (int symmetry = 0; symmetry < 2; ++symmetry) {
        // 4: mirrored in x
        assert_ok(om_banet_cells_expand(&cells, dim, NULL, 4 * symmetry, in, NULL, NULL));
        assert_ok(om_banet_predict(p, in, out + (size_t)symmetry * n));
    }
    double largest = 0;
    for (size_t i = 0; i < n; ++i) {
        int at[3];
        om_grid_unpack(dim, i, at);
        double a = (double)out[i],
               b = (double)out[n + om_grid_index(dim, 31 - at[0], at[1], at[2])];
        assert_near(a, b, 0.02);  // bfloat16 between layers
        largest = fmax(largest, fabs(a - (double)out[n + i]));
        assert_true(a > 0 && a < 1);
    }
    assert_true(largest > 0.02);  // the two predictions differ in place
    in[7] = NAN;
    assert_status(om_banet_predict(p, in, out), OM_INVALID);
    om_banet_predictor_destroy(p);
    assert_status(om_banet_predictor_create(net, (const int[]){32, 40, 16}, 1, &p), OM_INVALID);
    assert_null(p);
    om_free(in);
    om_free(out);
    om_banet_cells_done(&cells);
    om_banet_net_destroy(net);
}

// Channels vanish beside the body, and a multiple of a displacement has the same relative ones.
static void test_features(void** state) {
    (void)state;
    OmBanetCells cells;
    make_sheet(2, &cells);
    const int dim[3] = {32, 32, 16};
    const size_t n = om_grid_count(dim);
    float* in = om_alloc(OM_BANET_NCHANNEL * n, sizeof *in);
    float* a = om_alloc(BANET_NINPUT * n, sizeof *a);
    float* b = om_alloc(BANET_NINPUT * n, sizeof *b);
    assert_ok(om_banet_cells_expand(&cells, dim, NULL, 0, in, NULL, NULL));
    om__banet_features(dim, in, a);
    for (size_t i = OM_BANET_UX * n; i < (OM_BANET_UZ + 1) * n; ++i) in[i] *= 2;
    om__banet_features(dim, in, b);
    double largest = 0;
    for (size_t i = 0; i < n; ++i) {
        bool is_near = (double)in[i] < OM_BANET_CLIP;
        for (size_t c = 0; c < BANET_NINPUT; ++c) assert_true(is_near || a[c * n + i] == 0);
        largest = fmax(largest, (double)a[9 * n + i]);
        assert_near((double)b[9 * n + i], (double)a[9 * n + i], 1e-6);
        for (size_t c = 3; c < 6; ++c)
            assert_near((double)b[c * n + i], 2 * (double)a[c * n + i], 1e-6);
        for (size_t c = 13; c < 16; ++c)
            assert_near((double)b[c * n + i], (double)a[c * n + i], 1e-6);
    }
    assert_near(largest, 1, 1e-6);
    om_free(in);
    om_free(a);
    om_free(b);
    om_banet_cells_done(&cells);
}

typedef struct Estimate {  // of several threads
    const OmBanetNet* net;
    const OmSurface* surface;
    const double *u, *seen;
    double* probability;  // (4 x nvert)
    OmStatus status[4];
} Estimate;

static void estimate(void* ctx, int begin, int end, int block) {
    Estimate* e = ctx;
    (void)block;
    for (int k = begin; k < end; ++k)
        e->status[k] = om_banet_estimate(e->net, 0.3, e->surface, e->u, e->seen,
                                         e->probability + (size_t)k * (size_t)e->surface->nvert);
}

// Within a parallel loop: the same bytes as alone.
static void check_threads(const OmBanetNet* net, const OmSurface* surface, const double* u,
                          const double* seen, const double* want) {
    const size_t nvert = (size_t)surface->nvert;
    Estimate e = {net, surface, u, seen, om_alloc(4 * nvert, sizeof(double)), {0}};
    om_parallel_for(2, 4, 1, estimate, &e);
    for (size_t k = 0; k < 4; ++k) {
        assert_ok(e.status[k]);
        assert_memory_equal(e.probability + k * nvert, want, nvert * sizeof *want);
    }
    om_free(e.probability);
}

// Of the vertices of a surface: the values of their cells.
static void test_estimate(void** state) {
    (void)state;
    OmBanetNet* net = make_net();
    OmTetMesh mesh;
    OmSurface surface;
    int* vert;
    OmBanetGrid grid;
    OmBanetPredictor* p;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.07, 0.05, 0.01), 15, 11, 3, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, &surface, &vert));
    const size_t nvert = (size_t)surface.nvert;
    double* u = om_calloc(3 * nvert, sizeof *u);
    double* seen = om_alloc(nvert, sizeof *seen);
    double* probability = om_alloc(nvert, sizeof *probability);
    int* cell = om_alloc(nvert, sizeof *cell);
    for (size_t i = 0; i < nvert; ++i) {
        seen[i] = 1;
        u[3 * i + 2] = 0.1 * surface.x[3 * i];
    }
    assert_ok(om_banet_estimate(net, 0.3, &surface, u, seen, probability));
    assert_ok(om_banet_grid_fit(&surface, 0.3, &grid));
    float* in = om_alloc(OM_BANET_NCHANNEL * om_grid_count(grid.dim), sizeof *in);
    float* out = om_alloc(om_grid_count(grid.dim), sizeof *out);
    assert_ok(om_banet_voxelize(&grid, &surface, u, seen, in));
    assert_ok(om_banet_predictor_create(net, grid.dim, 1, &p));
    assert_ok(om_banet_predict(p, in, out));
    om_banet_find_cells(&grid, &surface, cell);
    double spread = 0;
    for (size_t i = 0; i < nvert; ++i) {
        assert_near(probability[i], (double)out[cell[i]], 1e-6);
        spread = fmax(spread, fabs(probability[i] - probability[0]));
    }
    assert_true(spread > 1e-3);
    check_threads(net, &surface, u, seen, probability);
    u[5] = NAN;
    assert_status(om_banet_estimate(net, 0.3, &surface, u, seen, probability), OM_INVALID);
    om_banet_predictor_destroy(p);
    om_free(in);
    om_free(out);
    om_free(u);
    om_free(seen);
    om_free(probability);
    om_free(cell);
    om_free(vert);
    om_surface_done(&surface);
    om_tet_mesh_done(&mesh);
    om_banet_net_destroy(net);
}

// ---- calibration ------------------------------------------------------------------------------------

static BanetOutputs make_outputs(int n, int ncell) {
    BanetOutputs o = {.n = n};
    const size_t num = (size_t)n * (size_t)ncell;
    o.begin = om_alloc((size_t)n + 1, sizeof *o.begin);
    o.ms = om_calloc((size_t)n, sizeof *o.ms);
    o.logit = om_alloc(num, sizeof *o.logit);
    o.truth = om_alloc(num, 1);
    for (int s = 0; s <= n; ++s) o.begin[s] = (int64_t)s * ncell;
    return o;
}

// Truths drawn with known probabilities: calibration finds them.
// Mean DSC of the sets above one threshold.
static double fixed_dsc(const BanetOutputs* o, const OmBanetNet* net, double threshold) {
    double sum = 0;
    for (int s = 0; s < o->n; ++s) {
        double both = 0, either = 0;
        for (int64_t i = o->begin[s]; i < o->begin[s + 1]; ++i) {
            const double logit = net->slope * (double)o->logit[i] + net->offset;
            const bool is_in = logit >= log(threshold / (1 - threshold));
            both += is_in && o->truth[i];
            either += is_in + o->truth[i];
        }
        sum += 2 * both / either / o->n;
    }
    return sum;
}

static void test_calibration(void** state) {
    (void)state;
    OmBanetNet* net = make_net();
    OmBanetEval e;
    BanetOutputs o = make_outputs(20, 2000);
    OmRng rng = om_rng_init(5, 0);
    for (int i = 0; i < 40000; ++i) {
        double y = 4 * om_rng_normal(&rng);
        o.logit[i] = (float)y;
        o.truth[i] = om_rng_uniform(&rng) < 1 / (1 + exp(-(0.5 * y - 1)));
    }
    assert_ok(om__banet_calibrate(net, &o));
    assert_near(net->slope, 0.5, 0.02);  // the standard errors are 0.006 and 0.016
    assert_near(net->offset, -1, 0.05);
    assert_ok(om__banet_eval_outputs(net, &o, &e));
    assert_int_equal(e.ncell, 40000);
    assert_below(e.ece, 0.01);  // noise of a bin: 0.5 / sqrt(2,667)
    for (int b = 1; b < OM_BANET_NBIN; ++b)
        assert_true(e.bin_predicted[b] >= e.bin_predicted[b - 1]);
    // No threshold is much better than that of the file, and none than the sets that are scored.
    const double best = fixed_dsc(&o, net, net->threshold);
    assert_true(net->threshold > 0.2 && net->threshold < 0.5);
    for (int k = 1; k < 20; ++k) {
        assert_true(fixed_dsc(&o, net, 0.05 * k) <= best + 0.0021);
        assert_true(fixed_dsc(&o, net, 0.05 * k) <= e.mean_dsc + 0.01);
    }
    om_banet_eval_done(&e);
    // A slope that is wrong by a factor shows.
    net->slope *= 3;
    assert_ok(om__banet_eval_outputs(net, &o, &e));
    assert_true(e.ece > 0.05);
    om_banet_eval_done(&e);
    om__banet_outputs_done(&o);
    om_banet_net_destroy(net);
}

static void test_scores(void** state) {
    (void)state;
    OmBanetNet* net = make_net();
    OmBanetEval e;
    BanetOutputs o = make_outputs(3, 4);
    net->slope = 1, net->offset = 0, net->threshold = 0.5;
    const float logit[12] = {1, 1, -1, -1, 1, -1, -1, -1, -1, -1, -1, -1};
    const unsigned char truth[12] = {1, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0};
    memcpy(o.logit, logit, sizeof logit);
    memcpy(o.truth, truth, sizeof truth);
    assert_ok(om__banet_eval_outputs(net, &o, &e));
    const double dsc[3] = {0.5, 1, 0}, tpr[3] = {0.5, 1, 1};  // nothing attached, everything found
    for (int s = 0; s < 3; ++s) {
        assert_near(e.dsc[s], dsc[s], 0);
        assert_near(e.tpr[s], tpr[s], 0);
    }
    assert_near(e.mean_dsc, 0.5, 1e-15);
    assert_near(e.dsc_quartile[0], 0.25, 1e-15);
    assert_near(e.dsc_quartile[1], 0.5, 0);
    om_banet_eval_done(&e);
    om__banet_outputs_done(&o);
    om_banet_net_destroy(net);
}

// ---- files ------------------------------------------------------------------------------------------

static void test_round_trip(void** state) {
    (void)state;
    OmBanetNet *net = make_net(), *back;
    const char* path = temp_path("banet_net.safetensors");
    assert_ok(om__banet_net_save(net, path));
    assert_ok(om_banet_net_load(path, &back));
    assert_memory_equal(back->channel, net->channel, sizeof net->channel);
    assert_int_equal(back->ngroup, net->ngroup);
    assert_int_equal(back->nimage, net->nimage);
    assert_true(back->slope == net->slope && back->offset == net->offset);
    assert_true(back->threshold == net->threshold);
    assert_int_equal(om_banet_net_size(back), om_banet_net_size(net));
    assert_memory_equal(back->param, net->param, om_banet_net_size(net) * sizeof *net->param);
    assert_string_equal(om_banet_net_fact(back, "seed"), "3");
    assert_null(om_banet_net_fact(back, "command"));
    om_banet_net_destroy(back);
    // Values that no training gives.
    const struct {
        double slope, offset, threshold;
        const char* sentence;
    } wrong[] = {{-1, 0, 0.5, "slope"},
                 {1, 1e9, 0.5, "offset"},
                 {1, 0, 0, "threshold"},
                 {1, 0, 1, "threshold"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        net->slope = wrong[k].slope, net->offset = wrong[k].offset;
        net->threshold = wrong[k].threshold;
        assert_ok(om__banet_net_save(net, path));
        assert_status(om_banet_net_load(path, &back), OM_INVALID);
        assert_null(back);
        if (!strstr(om_error_message(), wrong[k].sentence))
            fail_msg("\"%s\" does not say \"%s\"", om_error_message(), wrong[k].sentence);
    }
    // Any byte of a weight.
    char* bytes;
    size_t size;
    net->slope = 1, net->offset = 0, net->threshold = 0.5;
    assert_ok(om__banet_net_save(net, path));
    assert_ok(om_file_read(path, 1 << 24, &bytes, &size));
    bytes[size - 100] ^= 1;
    assert_ok(om_file_write(path, bytes, size));
    assert_status(om_banet_net_load(path, &back), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "damaged"));
    assert_status(om_banet_net_load("no/such/file", &back), OM_IO);
    om_free(bytes);
    om_banet_net_destroy(net);
    remove(path);
}

// The note of a use; null: the use is refused.
static const char* note_of(const OmBanetNet* net, double side, const OmBanetData* data) {
    static char note[1024];
    OmText text = {0};
    const OmStatus status = om_banet_net_check(net, side, data, &text);
    snprintf(note, sizeof note, "%s", text.str ? text.str : "");
    om_text_done(&text);
    if (status < 0) assert_int_equal(status, OM_INVALID);
    return status < 0 ? NULL : note;
}

// Voxels are side / 64: 300 mm has 4.69 mm, 250 mm 3.91 mm.
static void test_another_use_than_training(void** state) {
    (void)state;
    OmBanetNet *net = make_net(), *back;
    OmBanetData data = make_data();
    OmText text = {0};
    const char* path = temp_path("banet_origin.safetensors");
    // an old file
    assert_non_null(
        strstr(note_of(net, 0.3, NULL), "side of the grid and voxel of its training: not stated"));
    assert_non_null(strstr(note_of(net, 7, NULL), "generator of its samples: not stated"));
    assert_ok(om_banet_net_describe(net, &text));
    assert_non_null(strstr(text.str, "voxel and side not stated, generator not stated"));
    om_text_done(&text);
    data.side = 0.3;
    assert_ok(om__banet_origin_add(&data, &net->facts));
    assert_ok(om__banet_net_save(net, path));
    assert_ok(om_banet_net_load(path, &back));
    assert_near(om_banet_net_side(back), 0.3, 0);
    assert_ok(om_banet_net_describe(back, &text));
    assert_non_null(
        strstr(text.str, "voxel 4.688 mm, side 300 mm, generator omentum banet 3, way exact"));
    om_text_done(&text);
    // its own use; that of thin sheets; others
    assert_string_equal(note_of(back, 0.3, &data), "");
    assert_string_equal(note_of(back, 0.2, NULL), "");
    assert_non_null(strstr(note_of(back, 0.25, NULL),
                           "4.69 mm (a grid of 300 mm), used with 3.91 mm (250 mm)"));
    assert_non_null(strstr(note_of(back, 0.6, NULL), "less sure"));
    assert_non_null(strstr(note_of(back, 0.15, NULL), "less sure"));
    assert_null(note_of(back, 0.61, NULL));
    assert_non_null(strstr(om_error_message(), "voxels of 4.69 mm"));
    assert_non_null(strstr(om_error_message(), "generate --side 610"));
    assert_null(note_of(back, 0.149, NULL));
    // other samples
    snprintf(data.element, sizeof data.element, "quadratic");
    assert_non_null(
        strstr(note_of(back, 0.3, &data), "trained on linear elements, used with quadratic"));
    snprintf(data.element, sizeof data.element, "linear");
    snprintf(data.generator, sizeof data.generator, "omentum banet 4");
    assert_non_null(
        strstr(note_of(back, 0.3, &data), "used with those of the newer \"omentum banet 4\""));
    data.side = 0.7;
    OmBanetEval e;
    assert_status(om_banet_eval(back, &data, 0, 1, 1, NULL, &e), OM_INVALID);
    om_banet_net_destroy(back);
    om_banet_net_destroy(net);
    // a newer program trained it
    net = make_net();
    assert_ok(om__banet_origin_add(&data, &net->facts));
    assert_non_null(
        strstr(note_of(net, 0, NULL), "generator \"omentum banet 4\"; this program knows"));
    om_banet_net_destroy(net);
    // a side that no grid has
    net = make_net();
    assert_ok(om_facts_add(&net->facts, "side_m", "0.3x"));
    assert_ok(om__banet_net_save(net, path));
    assert_status(om_banet_net_load(path, &back), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "side_m is \"0.3x\""));
    om_banet_net_destroy(net);
    om_banet_data_done(&data);
    remove(path);
}

static OmStatus predict(void* ctx) {
    OmBanetNet* net;
    OmBanetPredictor* p = NULL;
    OM_TRY(om_banet_net_load(ctx, &net));
    OmStatus status = om_banet_predictor_create(net, (const int[]){16, 16, 16}, 1, &p);
    om_banet_predictor_destroy(p);
    om_banet_net_destroy(net);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    char path[256];
    OmBanetNet* net = make_net();
    snprintf(path, sizeof path, "%s", temp_path("banet_memory.safetensors"));
    assert_ok(om__banet_net_save(net, path));
    om_banet_net_destroy(net);
    assert_true(test_failing_allocations(predict, path, test_stride(7)) > 5);
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ranks),
        cmocka_unit_test(test_estimate),
        cmocka_unit_test(test_it_learns_and_resumes),
        cmocka_unit_test(test_mirror_images),
        cmocka_unit_test(test_calibration),
        cmocka_unit_test(test_refused_definitions),
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_another_use_than_training),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_join),
        cmocka_unit_test(test_scores),
        cmocka_unit_test(test_features),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
