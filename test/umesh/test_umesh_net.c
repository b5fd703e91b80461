// test_umesh_net.c: a small grid, samples of a known field: the network learns it, its file brings it back, inputs
// outside the range of the training are reported, the network as tissue follows a probe, damaged files are refused.
#include "test_alloc.h"

#include "omentum/contact_tool.h"
#include "omentum/umesh_net.h"
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define NSAMPLE 48
#define SPACING 0.01

static char dir[] = "/tmp/om_umesh_net_XXXXXX";
static OmUmeshData data;
static char weights[256];

// A block of 6 x 5 x 3 cells, held below, whose skin is its top and sides.
static void make_grid(OmUmeshGrid* g) {
    unsigned char active[8 * 8 * 8] = {0};
    const OmGrid points = {.dim = {8, 8, 8}, .spacing = SPACING};
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 5; ++j)
            for (int i = 0; i < 6; ++i) active[i + 8 * (j + 8 * k)] = 1;
    assert_ok(om__umesh_grid_init(&points, om_vec3(0, 0, 1), active, g));
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->fem.mesh.x, i);
        om_store3(g->surface_x, i, x);
        g->fem.fixed[i] = x.z < 1e-9;
    }
    assert_ok(om__umesh_grid_find_surface(g));
    g->hash = om__umesh_grid_hash(g);
}

// A patch of the top goes down by `way` and a little aside; the rest follows it, less with the distance.
static void make_sample(int s, double way, double side) {
    const OmUmeshGrid* g = &data.grid;
    size_t nnode = (size_t)g->fem.mesh.nnode;
    OmRng rng = om_rng_init(7, (uint64_t)s);
    OmVec3 c = om_vec3(om_rng_range(&rng, 0.02, 0.04), om_rng_range(&rng, 0.015, 0.035), 0.03);
    OmVec3 move = om_vec3(side * way, 0, -way);
    unsigned char* mask = data.mask + (size_t)s * nnode;
    float* u = data.u + 3 * (size_t)s * nnode;
    data.sample[s] = (OmUmeshSample){.max_u = om_norm(move)};
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->fem.mesh.x, i), r = om_sub(x, c);
        mask[i] = x.z > 0.029 && fabs(r.x) < 0.011 && fabs(r.y) < 0.011;
        double share = mask[i] ? 1 : exp(-om_norm2(r) / 4e-4) * x.z / 0.03;
        u[3 * i] = (float)(share * move.x);
        u[3 * i + 1] = 0;
        u[3 * i + 2] = (float)(share * move.z);
    }
}

static int begin(void** unused) {
    (void)unused;
    if (!mkdtemp(dir)) return -1;
    make_grid(&data.grid);
    size_t nnode = (size_t)data.grid.fem.mesh.nnode;
    data.nsample = NSAMPLE;
    data.hash = 42;
    data.sample = om_calloc(NSAMPLE, sizeof *data.sample);
    data.mask = om_calloc(NSAMPLE * nnode, 1);
    data.u = om_calloc(3 * NSAMPLE * nnode, sizeof *data.u);
    for (int s = 0; s < NSAMPLE; ++s) {
        OmRng rng = om_rng_init(8, (uint64_t)s);
        make_sample(s, om_rng_range(&rng, 0.001, 0.008), om_rng_range(&rng, -0.3, 0.3));
    }
    snprintf(weights, sizeof weights, "%s/weights.safetensors", dir);
    return 0;
}

static int end(void** unused) {
    (void)unused;
    om_umesh_data_done(&data);
    return 0;
}

static OmUmeshTrainDef small_def(void) {
    OmUmeshTrainDef def = om_umesh_train_default_def(&data, dir);
    def.nvalid = 8;
    def.nlevel = 1;
    def.nepoch = test_count(25, 60);
    def.rate = 2e-3;  // few steps: faster than the default
    def.nworker = 1;
    def.command = "test";
    return def;
}

// ---- what drives the correction ---------------------------------------------------------------------

// Of a field whose gradient is the same everywhere, where Gauss points and the element's centre agree: half the second
// difference of the neo-Hookean law's own forces.
static void test_second_order(void** unused) {
    (void)unused;
    const OmUmeshGrid* g = &data.grid;
    size_t n = 3 * (size_t)g->fem.mesh.nnode;
    const double H[3][3] = {{0.3, -0.2, 0.1}, {0.5, -0.4, 0.2}, {-0.1, 0.6, 0.25}}, size = 0.02;
    OmMaterial material = {.law = OM_NEO_HOOKEAN, .young = 2 * 1.4, .poisson = 0.4};  // mu = 1
    OmFemDef def = om_fem_default_def(&g->fem.mesh, 1, &material);
    OmFemSolid* solid;
    double *x = om_alloc(n, sizeof *x), *f[2];
    float *u = om_alloc(n, sizeof *u), *force = om_alloc(n, sizeof *force);
    assert_ok(om_fem_create(&def, &solid));
    const double step[2] = {1e-3, -1e-3};
    for (int k = 0; k < 2; ++k) {
        f[k] = om_alloc(n, sizeof **f);
        for (size_t i = 0; i < n; ++i) {
            const double *h = H[i % 3], *X = g->fem.mesh.x + i / 3 * 3;
            double value = h[0] * X[0] + h[1] * X[1] + h[2] * X[2];
            x[i] = g->fem.mesh.x[i] + step[k] * value;
            u[i] = (float)value;
        }
        assert_ok(om_fem_eval_force(solid, x, f[k], NULL));
    }
    om_fem_grid_second_order(&g->fem, material.poisson, size, u, force);
    double max = 0;
    for (size_t i = 0; i < n; ++i) max = fmax(max, fabs((double)force[i]));
    for (size_t i = 0; i < n; ++i) {
        double second = (f[0][i] + f[1][i]) / (2 * step[0] * step[0]);
        // dW/dx is the reaction
        double expected = -second / (SPACING * SPACING) * SPACING / size;
        assert_near((double)force[i], expected, 1e-5 * max);  // fourth order, and floats
    }
    assert_true(max > 0.01);
    for (int k = 0; k < 2; ++k) om_free(f[k]);
    om_free(x);
    om_free(u);
    om_free(force);
    om_fem_destroy(solid);
}

// ---- symmetry ---------------------------------------------------------------------------------------

// The block has planes across x and y; held below, it has none across z. The answer to a reflected input is the
// reflected answer.
static void test_symmetry(void** unused) {
    (void)unused;
    const OmUmeshGrid* g = &data.grid;
    size_t nnode = (size_t)g->fem.mesh.nnode;
    const bool is_on[3] = {true, true, false};
    int* mirror[3];
    OmFemGridLinear* linear;
    float* u = om_alloc(4 * 3 * nnode, sizeof *u);
    float *reflected = u + 3 * nnode, *answer = u + 6 * nnode, *image = u + 9 * nnode;
    unsigned char* mask = om_calloc(nnode, 1);
    assert_ok(om__umesh_find_mirrors(g, mirror));
    assert_true(mirror[0] && mirror[1] && !mirror[2]);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        int twice = mirror[0][mirror[1][i]];
        OmVec3 x = om_load3(g->fem.mesh.x, i), y = om_load3(g->fem.mesh.x, twice);
        assert_near(x.x + y.x, 6 * SPACING, 1e-12);
        assert_near(x.y + y.y, 5 * SPACING, 1e-12);
        assert_near(x.z, y.z, 1e-12);
        mask[twice] = data.mask[i];
    }
    assert_ok(om_fem_grid_linear_create(&g->fem, g->is_surface, 0.4, 1, &linear));
    assert_ok(om_fem_grid_linear_solve(linear, data.mask, data.u, 1, answer));
    om__umesh_reflect(g, mirror, is_on, answer, image);
    om__umesh_reflect(g, mirror, is_on, data.u, reflected);
    assert_ok(om_fem_grid_linear_solve(linear, mask, reflected, 1, answer));
    double max = 0;
    for (size_t i = 0; i < 3 * nnode; ++i) {
        max = fmax(max, fabs((double)image[i]));
        assert_near((double)answer[i], (double)image[i], 1e-6);  // m; responses are floats
    }
    assert_true(max > 1e-3);
    // One cell more, and the plane across x is gone; the one across y stays.
    OmUmeshGrid other;
    unsigned char active[8 * 8 * 8] = {0};
    const OmGrid points = {.dim = {8, 8, 8}, .spacing = SPACING};
    for (int j = 0; j < 3; ++j) active[8 * j] = 1;
    active[1 + 8] = 1;
    assert_ok(om__umesh_grid_init(&points, om_vec3(0, 0, 1), active, &other));
    for (int c = 0; c < 3; ++c) om_free(mirror[c]);
    assert_ok(om__umesh_find_mirrors(&other, mirror));
    assert_true(!mirror[0] && mirror[1] && mirror[2]);
    for (int c = 0; c < 3; ++c) om_free(mirror[c]);
    om_umesh_grid_done(&other);
    om_fem_grid_linear_destroy(linear);
    om_free(mask);
    om_free(u);
}

// ---- learning ---------------------------------------------------------------------------------------

// Far better than to say that nothing but the patch moves; and the same call again finds all done.
static void test_train(void** unused) {
    (void)unused;
    OmUmeshTrainDef def = small_def();
    OmUmeshTrainSummary sum, again;
    assert_ok(om_umesh_train(&def, NULL, &sum));
    size_t nnode = (size_t)data.grid.fem.mesh.nnode;
    double still = 0;
    for (int s = NSAMPLE - 8; s < NSAMPLE; ++s) {
        float* u = om_calloc(3 * nnode, sizeof *u);
        for (size_t n = 0; n < 3 * nnode; ++n)
            if (data.mask[(size_t)s * nnode + n / 3]) u[n] = data.u[3 * (size_t)s * nnode + n];
        still += om__umesh_mean_error(&data.grid, u, data.u + 3 * (size_t)s * nnode) / 8;
        om_free(u);
    }
    printf("validation error %.4f mm, of %.4f if the rest stayed; %d epochs\n",
           1e3 * sum.valid_error, 1e3 * still, sum.nepoch);
    assert_below(sum.valid_error, (test_is_slow() ? 0.25 : 0.5) * still);
    assert_ok(om_umesh_train(&def, NULL, &again));
    assert_true(again.is_resumed && again.nstep == sum.nstep);
    assert_near(again.valid_error, sum.valid_error, 0);
}

// What is loaded predicts what was trained: the validation error of the report, from the file.
static void test_file(void** unused) {
    (void)unused;
    OmUmeshNet *net, *copy;
    OmUmeshEval eval, second;
    char path[300];
    assert_ok(om_umesh_net_load(weights, &net));
    assert_true(om_umesh_net_grid(net)->hash == data.grid.hash);
    assert_string_equal(om_umesh_net_fact(net, "command"), "test");
    assert_null(om_umesh_net_fact(net, "nothing"));
    assert_ok(om_umesh_eval(net, &data, NSAMPLE - 8, 8, OM_UMESH_TOLERANCE, 1, &eval));
    // less than the loop measured: nodes of the patch are put at their prescribed places
    double loop = 1e-3 * atof(om_umesh_net_fact(net, "validation_error_mm"));
    assert_true(eval.mean <= loop && eval.mean > 0.7 * loop);
    snprintf(path, sizeof path, "%s/copy.safetensors", dir);
    assert_ok(om__umesh_net_save(net, path));
    assert_ok(om_umesh_net_load(path, &copy));
    assert_ok(om_umesh_eval(copy, &data, NSAMPLE - 8, 8, OM_UMESH_TOLERANCE, 1, &second));
    assert_memory_equal(eval.error, second.error, 8 * sizeof(double));
    om_umesh_net_destroy(copy);
    assert_ok(om_umesh_record_test(net, &data, &eval, path));
    assert_ok(om_umesh_net_load(path, &copy));
    assert_string_equal(om_umesh_net_fact(copy, "test_samples"), "8");
    assert_near(atof(om_umesh_net_fact(copy, "test_error_mm")), 1e3 * eval.mean, 1e-5);
    om_umesh_net_destroy(copy);
    om_umesh_eval_done(&eval);
    om_umesh_eval_done(&second);
    snprintf(path, sizeof path, "%s/net.onnx", dir);
    assert_ok(om_umesh_net_save_onnx(net, path));
    om_umesh_net_destroy(net);
}

// Every byte of the header's length, cuts, and flipped bytes of grid and weights: a sentence or the same network.
static void test_damage(void** unused) {
    (void)unused;
    char *bytes, path[300];
    size_t size;
    OmUmeshNet* net;
    snprintf(path, sizeof path, "%s/bad.safetensors", dir);
    assert_ok(om_file_read(weights, 1 << 28, &bytes, &size));
    const size_t cut[] = {0, 7, 8, 100, size / 2, size - 1};
    for (size_t k = 0; k < sizeof cut / sizeof *cut; ++k) {
        assert_ok(om_file_write(path, bytes, cut[k]));
        assert_true(om_umesh_net_load(path, &net) < 0);
        assert_non_null(strstr(om_error_message(), "bad.safetensors"));
    }
    int nrefused = 0;
    for (int k = 0; k < 200; k += test_count(4, 1)) {
        OmRng rng = om_rng_init(3, (uint64_t)k);
        size_t at = om_rng_below(&rng, k < 100 ? 6000 : (uint32_t)size);
        char old = bytes[at];
        bytes[at] = (char)(old ^ (1 << om_rng_below(&rng, 8)));
        assert_ok(om_file_write(path, bytes, size));
        OmStatus status = om_umesh_net_load(path, &net);
        bytes[at] = old;
        nrefused += status < 0;
        om_umesh_net_destroy(net);
    }
    printf("%d flipped bits refused\n", nrefused);
    assert_true(nrefused > test_count(5, 20));
    om_free(bytes);
    assert_true(om_umesh_net_load("/nonexistent/weights", &net) < 0);
}

// ---- trust --------------------------------------------------------------------------------------------

// One bit anywhere in the values or the names, found before anything is built from them.
static void test_one_bit(void** unused) {
    (void)unused;
    char *bytes, path[300];
    size_t size;
    OmUmeshNet* net;
    assert_ok(om_file_read(weights, 1 << 28, &bytes, &size));
    snprintf(path, sizeof path, "%s/bit.safetensors", dir);
    uint64_t nheader = 0;
    memcpy(&nheader, bytes, 8);
    OmRng rng = om_rng_init(7, 0);
    for (int k = 0; k < 20; ++k) {
        size_t at = 8 + (size_t)nheader + om_rng_below(&rng, (uint32_t)(size - 8 - nheader));
        char bit = (char)(1 << om_rng_below(&rng, 8));
        bytes[at] ^= bit;
        assert_ok(om_file_write(path, bytes, size));
        assert_status(om_umesh_net_load(path, &net), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "the file is damaged: the checksum"));
        bytes[at] ^= bit;
    }
    assert_ok(om_file_write(path, bytes, size));
    assert_ok(om_umesh_net_load(path, &net));
    om_umesh_net_destroy(net);
    om_free(bytes);
}

static void test_trust(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    OmUmeshTrust trust;
    size_t nnode = (size_t)data.grid.fem.mesh.nnode;
    assert_ok(om_umesh_net_load(weights, &net));
    float* u = om_calloc(3 * nnode, sizeof *u);
    unsigned char* mask = om_calloc(nnode, 1);
    int ninside = 0;
    for (int s = 0; s < NSAMPLE; ++s) {
        om_umesh_judge(net, data.mask + (size_t)s * nnode, data.u + 3 * (size_t)s * nnode, &trust);
        ninside += trust.is_inside;
    }
    assert_true(ninside >= NSAMPLE - 1);
    // A sample that is scaled up leaves the limits where its score passes 1, and has a reason from there on.
    int nbetween = 0;
    for (double factor = 1; factor < 8; factor *= 1.05) {
        for (size_t n = 0; n < 3 * nnode; ++n) u[n] = (float)factor * data.u[n];
        om_umesh_judge(net, data.mask, u, &trust);
        assert_int_equal(trust.is_inside, trust.score <= 1);
        assert_int_equal(trust.is_inside, trust.why[0] == 0);
        nbetween += trust.score > 1 && trust.score < 2;
    }
    assert_true(nbetween > 3);
    // four times as far, outwards, every second node left behind, an untouched place, all of the skin, nothing
    for (size_t n = 0; n < 3 * nnode; ++n) u[n] = 8 * data.u[n];
    om_umesh_judge(net, data.mask, u, &trust);
    assert_true(!trust.is_inside && strstr(trust.why, "times the largest"));
    for (size_t n = 0; n < 3 * nnode; ++n) u[n] = -data.u[n];
    om_umesh_judge(net, data.mask, u, &trust);
    assert_true(!trust.is_inside && strstr(trust.why, "degrees"));
    for (size_t n = 0, num = 0; n < nnode; ++n)
        for (size_t c = 0; c < 3; ++c)
            u[3 * n + c] = data.mask[n] && (c ? num : ++num) % 2 ? data.u[3 * n + c] : 0;
    om_umesh_judge(net, data.mask, u, &trust);
    assert_true(!trust.is_inside && strstr(trust.why, "neighbours differ"));
    memset(u, 0, 3 * nnode * sizeof *u);
    for (size_t i = 0; i < nnode; ++i) {
        OmVec3 x = om_load3(data.grid.fem.mesh.x, (int)i);
        mask[i] = x.x < 1e-9 && x.z > 0.005 && x.z < 0.015;
        if (mask[i]) u[3 * i] = 0.002f;
    }
    om_umesh_judge(net, mask, u, &trust);
    assert_true(!trust.is_inside && strstr(trust.why, "touched this place"));
    for (size_t i = 0; i < nnode; ++i) {
        mask[i] = data.grid.is_surface[i];
        u[3 * i] = 0;
    }
    om_umesh_judge(net, mask, u, &trust);
    assert_true(!trust.is_inside && strstr(trust.why, "nodes are moved"));
    u[3 * nnode - 1] = NAN;
    mask[nnode - 1] = 1;
    om_umesh_judge(net, mask, u, &trust);
    assert_false(trust.is_inside);
    om_free(u);
    om_free(mask);
    om_umesh_net_destroy(net);
}

// On top, on a side and in a hollow: the normal points out of the organ.
static void test_place(void** unused) {
    (void)unused;
    const OmUmeshGrid* g = &data.grid;
    OmUmeshPatch top = om_umesh_find_place(g, om_vec3(0.03, 0.025, 0.05));
    OmUmeshPatch side = om_umesh_find_place(g, om_vec3(-0.02, 0.025, 0.015));
    assert_near(top.normal.z, 1, 0.02);  // edges of the block are within reach
    assert_near(top.center.z, 0.03, 1e-12);
    assert_near(side.normal.x, -1, 0.2);
    assert_near(om_dot(top.along, top.normal), 0, 1e-12);
}

static void test_predict(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    OmUmeshPredictor* p;
    size_t nnode = (size_t)data.grid.fem.mesh.nnode;
    assert_ok(om_umesh_net_load(weights, &net));
    assert_ok(om_umesh_predictor_create(net, 1, &p));
    float* u = om_calloc(3 * nnode, sizeof *u);
    unsigned char* none = om_calloc(nnode, 1);
    memcpy(u, data.u, 3 * nnode * sizeof *u);
    assert_ok(om_umesh_predict(p, data.mask, u, NULL));
    for (size_t i = 0; i < nnode; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            if (data.mask[i]) assert_true(u[3 * i + c] == data.u[3 * i + c]);
            if (data.grid.fem.fixed[i]) assert_true(u[3 * i + c] == 0);
        }
    }
    assert_int_equal(om_umesh_predictor_refinement(p).ncycle, 0);  // the samples follow no law
    float* answer = om_calloc(3 * nnode, sizeof *answer);
    memcpy(u, data.u, 3 * nnode * sizeof *u);
    assert_ok(om_fem_grid_linear_solve(net->linear, data.mask, u, 1, answer));
    om_umesh_predictor_set_linear(p, true);
    assert_ok(om_umesh_predict(p, data.mask, u, NULL));
    for (size_t i = 0; i < nnode; ++i)
        if (!data.mask[i] && !data.grid.fem.fixed[i]) assert_true(u[3 * i] == answer[3 * i]);
    om_free(answer);
    assert_status(om_umesh_predict(p, none, u, NULL), OM_INVALID);
    for (size_t i = 0; i < 3 * nnode; ++i) u[i] = NAN;
    assert_status(om_umesh_predict(p, data.mask, u, NULL), OM_INVALID);
    om_free(u);
    om_free(none);
    om_umesh_predictor_destroy(p);
    om_umesh_net_destroy(net);
}

// ---- as tissue ------------------------------------------------------------------------------------------

// A probe goes down on the block: what is under it follows it to the rounding of floats, it sticks, and separates when
// the probe leaves; a snapshot brings it all back.
static void test_engine(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    OmTetMesh mesh;
    OmTissueModel* model;
    OmTissueState *state, *snapshot;
    OmTissueWork* work;
    OmProbe* probe;
    OmTissueReport report;
    assert_ok(om_umesh_net_load(weights, &net));
    assert_ok(om_fem_grid_make_tet_mesh(&om_umesh_net_grid(net)->fem, &mesh));
    OmTissueDef def = om_tissue_default_def(om_umesh_engine(), &mesh);
    assert_status(om_tissue_create(&def, &model), OM_INVALID);
    def.options = net;
    def.gravity = om_vec3(0, 0, 0);
    assert_ok(om_tissue_create(&def, &model));
    assert_ok(om_tissue_state_create(model, &state));
    assert_ok(om_tissue_state_create(model, &snapshot));
    assert_ok(om_tissue_work_create(model, &work));
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
    shape.size = om_vec3(0.018, 0.018, 0.05);
    shape.rounding = 0;
    assert_ok(om_probe_create(&shape, &probe));
    OmPose pose = {om_vec3(0.03, 0.02, 0.0305), om_quat_identity()}, next = pose;
    int top = -1;
    for (int i = 0; i < mesh.nvert; ++i)
        if (om_distance(om_load3(mesh.x, i), om_vec3(0.03, 0.02, 0.03)) < 1e-9) top = i;
    assert_true(top >= 0);
    for (int k = 0; k < 10; ++k, pose = next) {
        next.p.z -= 0.0005;
        OmTissueObstacle o = om_probe_obstacle(probe, pose, next, -1);
        OmStatus status = om_tissue_step_among(model, state, work, 0.02, 1, &o, &report);
        assert_true(status == OM_OK || status == OM_NOT_CONVERGED);
        if (k == 4) memcpy((void*)snapshot, state, om_tissue_state_size(model));
        if (k > 0) assert_true(o.ncontact > 0);
        double goal = fmin(0.03, next.p.z);
        assert_near(om_load3(om_tissue_x(state), top).z, goal, 2e-6);
    }
    uint64_t hash = om_tissue_state_hash(state);
    memcpy((void*)state, snapshot, om_tissue_state_size(model));
    pose.p.z = next.p.z = 0.0305 - 5 * 0.0005;
    for (int k = 5; k < 10; ++k, pose = next) {
        next.p.z -= 0.0005;
        OmTissueObstacle o = om_probe_obstacle(probe, pose, next, -1);
        assert_true(om_tissue_step_among(model, state, work, 0.02, 1, &o, &report) >= 0 ||
                    report.residual > 1);
    }
    assert_true(om_tissue_state_hash(state) == hash);
    next.p.z = 0.05;
    OmTissueObstacle o = om_probe_obstacle(probe, pose, next, -1);
    assert_ok(om_tissue_step_among(model, state, work, 0.02, 1, &o, &report));
    assert_int_equal(o.ncontact, 0);
    assert_near(om_load3(om_tissue_x(state), top).z, 0.03, 1e-12);
    om_probe_destroy(probe);
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(snapshot);
    om_tissue_state_destroy(state);
    om_tissue_destroy(model);
    om_tet_mesh_done(&mesh);
    om_umesh_net_destroy(net);
}

// A tool takes hold of the top's middle and draws it in: what it holds is where the tool is, the rest comes along less,
// the base stays; released, all is at rest again.
static void test_grasp(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    OmTetMesh mesh;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmTissueReport report;
    int nheld;
    assert_ok(om_umesh_net_load(weights, &net));
    assert_ok(om_fem_grid_make_tet_mesh(&om_umesh_net_grid(net)->fem, &mesh));
    OmTissueDef def = om_tissue_default_def(om_umesh_engine(), &mesh);
    def.options = net;
    def.gravity = om_vec3(0, 0, 0);
    assert_ok(om_tissue_create(&def, &model));
    assert_ok(om_tissue_state_create(model, &state));
    assert_ok(om_tissue_work_create(model, &work));
    OmPose tip = {om_vec3(0.03, 0.02, 0.03), om_quat_identity()};
    assert_ok(om_tissue_grasp(model, state, 0, tip, 0.011, &nheld));
    assert_int_equal(nheld, 6);  // the node, its four neighbours on top, the one below
    tip.p.z -= 0.002;
    assert_ok(om_tissue_move_grasp(state, 0, tip));
    OmStatus status = om_tissue_step(model, state, work, 0.02, &report);
    assert_true(status == OM_OK || status == OM_NOT_CONVERGED);
    double aside = 0;
    for (int i = 0; i < mesh.nvert; ++i) {
        OmVec3 rest = om_load3(mesh.x, i), x = om_load3(om_tissue_x(state), i);
        if (om_distance(rest, om_vec3(0.03, 0.02, 0.03)) < 0.0105)
            assert_near(x.z, rest.z - 0.002, 1e-9);
        else
            aside = fmax(aside, om_distance(x, rest));
        if (rest.z < 1e-9) assert_near(om_distance(x, rest), 0, 1e-12);
    }
    assert_true(aside > 1e-4 && aside < 0.002);
    om_tissue_release(state, 0);
    assert_ok(om_tissue_step(model, state, work, 0.02, &report));
    for (int i = 0; i < mesh.nvert; ++i)
        assert_near(om_distance(om_load3(om_tissue_x(state), i), om_load3(mesh.x, i)), 0, 1e-12);
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(state);
    om_tissue_destroy(model);
    om_tet_mesh_done(&mesh);
    om_umesh_net_destroy(net);
}

// ---- memory ---------------------------------------------------------------------------------------------

static OmStatus load_and_predict(void* ctx) {
    (void)ctx;
    OmUmeshNet* net;
    OmUmeshEval eval;
    OM_TRY(om_umesh_net_load(weights, &net));
    OmStatus status = om_umesh_eval(net, &data, 0, 2, OM_UMESH_TOLERANCE, 1, &eval);
    if (status >= 0) om_umesh_eval_done(&eval);
    om_umesh_net_destroy(net);
    return status;
}

static void test_memory(void** unused) {
    (void)unused;
    if (!om_path_exists(weights)) {  // alone: test_train was left out
        OmUmeshTrainSummary sum;
        OmUmeshTrainDef def = small_def();
        def.nepoch = 1;
        assert_ok(om_umesh_train(&def, NULL, &sum));
    }
    int nfail = test_failing_allocations(load_and_predict, NULL, test_stride(7));
    printf("%d allocations failed\n", nfail);
    assert_true(nfail > 5);
}

static void test_bad(void** unused) {
    (void)unused;
    OmUmeshTrainSummary sum;
    OmUmeshTrainDef def = {0};
    assert_status(om_umesh_train(&def, NULL, &sum), OM_INVALID);
    def = small_def();
    def.nvalid = NSAMPLE;
    assert_status(om_umesh_train(&def, NULL, &sum), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "kept for validation"));
    def = small_def();
    def.base_channels = 0;
    assert_status(om_umesh_train(&def, NULL, &sum), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_second_order), cmocka_unit_test(test_symmetry),
        cmocka_unit_test(test_train),        cmocka_unit_test(test_file),
        cmocka_unit_test(test_damage),       cmocka_unit_test(test_one_bit),
        cmocka_unit_test(test_trust),        cmocka_unit_test(test_place),
        cmocka_unit_test(test_predict),      cmocka_unit_test(test_engine),
        cmocka_unit_test(test_grasp),        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_bad),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
