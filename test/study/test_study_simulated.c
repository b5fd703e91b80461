// test_study_simulated.c: files of samples, guesses and scores of one body; the quick study, resumed, cancelled and
// refused.
#include "studies/study_simulated_internal.h"

#include <math.h>
#include <string.h>

#include "banet/banet_net_internal.h"
#include "test_alloc.h"
#include "test_files.h"
#include "test_folder.h"

static OmStudySimulatedDef quick_def(void) {
    OmStudySimulatedDef def = om_study_simulated_default_def(dir);
    def.is_quick = true;
    def.nworker = 1;
    return def;
}

// ---- one body ---------------------------------------------------------------------------------------------

// A plate of 60 x 50 x 10 mm, its underside attached, one upper corner pulled up by 8 mm.
static void make_plate(OmBanetSample* s) {
    memset(s, 0, sizeof *s);
    s->material = (OmMaterial){.young = 5000, .poisson = 0.4, .law = OM_NEO_HOOKEAN};
    s->visible = 0.25;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.05, 0.01), 12, 10, 4, &s->mesh));
    assert_ok(om_tet_mesh_boundary(&s->mesh, &s->surface, &s->surface_vert));
    size_t n = (size_t)s->surface.nvert, nvert = (size_t)s->mesh.nvert;
    s->attached = om_calloc(n, 1);
    s->grasped = om_calloc(n, 1);
    s->rest = om_calloc(3 * nvert, sizeof(double));
    s->x = om_calloc(3 * nvert, sizeof(double));
    s->u = om_calloc(3 * n, sizeof(double));
    s->seen = om_calloc(n, sizeof(double));
    assert_non_null(s->seen);
    memcpy(s->x, s->mesh.x, 3 * nvert * sizeof(double));
    memcpy(s->rest, s->mesh.x, 3 * nvert * sizeof(double));
    for (int i = 0; i < s->surface.nvert; ++i) {
        OmVec3 p = om_load3(s->surface.x, i);
        s->attached[i] = p.z < 1e-9;
        s->grasped[i] = p.z > 0.01 - 1e-9 && p.x > 0.05 - 1e-9 && p.y > 0.04 - 1e-9;
        s->seen[i] = 0.001 * i;
        if (s->grasped[i]) s->x[3 * s->surface_vert[i] + 2] += 0.008;
    }
}

// has_node: as of quadratic elements.
static void check_sample_file(bool has_node) {
    OmBanetSample s, again;
    make_plate(&s);
    const size_t nnode = 10 * (size_t)(s.mesh.ntet / 8);
    if (has_node) s.node = om_alloc(nnode, sizeof *s.node);
    for (size_t i = 0; has_node && i < nnode; ++i) s.node[i] = (int)(7 * i % 101);
    assert_ok(om__sim_sample_save(dir, "plate.bin", 17, &s));
    assert_false(om__sim_sample_load(dir, "plate.bin", 18, &again));
    assert_false(om__sim_sample_load(dir, "none.bin", 17, &again));
    assert_true(om__sim_sample_load(dir, "plate.bin", 17, &again));
    assert_true(again.visible == 0.25 && again.mesh.nvert == s.mesh.nvert);
    size_t n = 3 * (size_t)s.mesh.nvert * sizeof(double), k = (size_t)s.surface.nvert;
    assert_memory_equal(again.x, s.x, n);
    assert_memory_equal(again.mesh.x, s.mesh.x, n);
    assert_memory_equal(again.mesh.tet_vert, s.mesh.tet_vert,
                        4 * (size_t)s.mesh.ntet * sizeof(int));
    assert_memory_equal(again.surface.tri_vert, s.surface.tri_vert,
                        3 * (size_t)s.surface.ntri * sizeof(int));
    if (has_node) assert_memory_equal(again.node, s.node, nnode * sizeof(int));
    if (!has_node) assert_null(again.node);
    assert_memory_equal(again.attached, s.attached, k);
    assert_memory_equal(again.grasped, s.grasped, k);
    assert_memory_equal(again.seen, s.seen, k * sizeof(double));
    om_banet_sample_done(&again);
    // a changed byte: not the sample
    char path[600], *data;
    size_t size;
    assert_ok(om_path_join(dir, "plate.bin", path, sizeof path));
    assert_ok(om_file_read(path, 1 << 24, &data, &size));
    data[size - 3] ^= 1;
    write_bytes(path, data, size);
    om_free(data);
    assert_false(om__sim_sample_load(dir, "plate.bin", 17, &again));
    assert_ok(om_path_remove(path));
    om_banet_sample_done(&s);
}

static void test_sample_file(void** unused) {
    (void)unused;
    check_sample_file(false);
    check_sample_file(true);
}

static void test_body(void** unused) {
    (void)unused;
    OmBanetSample s;
    SimBody b = {0};
    SimScore score;
    make_plate(&s);
    assert_ok(om__sim_body_make(&s, 0.3, &b));
    assert_int_equal(b.ngrasp, 9);
    // the pull is upwards, so the lowest side is the underside; its border has other normals
    assert_ok(om__sim_body_guess(&b, OM_STUDY_SIM_ALL));
    for (int i = 0; i < s.surface.nvert; ++i) {
        OmVec3 p = om_load3(s.surface.x, i);
        bool is_inner = p.x > 1e-9 && p.x < 0.06 - 1e-9 && p.y > 1e-9 && p.y < 0.05 - 1e-9;
        if (p.z > 1e-9) assert_false(b.guess[i]);
        if (p.z < 1e-9 && is_inner) assert_true(b.guess[i]);
    }
    assert_ok(om__sim_body_score(&b, &score));
    assert_true(score.dsc > 0.85 && score.dsc_area > 0.85 && score.tpr > 0.75);
    // the true ones
    assert_ok(om__sim_body_guess(&b, OM_STUDY_SIM_SAME));
    assert_ok(om__sim_body_score(&b, &score));
    assert_true(score.dsc == 1 && score.tpr == 1 && score.dsc_area == 1 && score.tpr_area == 1);
    SimMove same = {0}, zero = {0};
    assert_ok(om__sim_body_move(&b, &same));
    assert_true(same.is_there && !same.is_stopped && same.load == 1);
    for (int i = 0; i < s.surface.nvert; ++i) {
        OmVec3 x = om_load3(b.x, s.surface_vert[i]);
        if (s.attached[i]) assert_true(om_distance(x, om_load3(s.surface.x, i)) == 0);
        if (s.grasped[i]) assert_near(x.z - 0.01, 0.008, 1e-12);
    }
    // none: the whole plate goes up with the grasp
    assert_ok(om__sim_body_guess(&b, OM_STUDY_SIM_ZERO));
    assert_ok(om__sim_body_score(&b, &score));
    assert_true(score.dsc == 0 && score.tpr == 0);
    assert_ok(om__sim_body_move(&b, &zero));
    assert_true(!zero.is_stopped);
    for (int i = 0; i < s.mesh.nvert; ++i)
        assert_near(b.x[3 * i + 2] - s.mesh.x[3 * i + 2], 0.008, 1e-5);
    // 9 of all vertices are where the truth has them
    assert_near(zero.ave, 0.008 * (s.mesh.nvert - 9) / s.mesh.nvert, 1e-5);
    assert_near(zero.mve, 0.008, 1e-5);
    om__sim_body_done(&b);
    om_banet_sample_done(&s);
}

// Each cell with a vertex appears once, in ascending order, with the probability of its vertices and the true label.
static void test_cells(void** unused) {
    (void)unused;
    OmBanetSample s;
    SimBody b = {0};
    make_plate(&s);
    assert_ok(om__sim_body_make(&s, 0.6, &b));  // several vertices a cell
    double* p = om_alloc((size_t)s.surface.nvert, sizeof *p);
    SimNet* net = om_calloc(1, sizeof *net);
    assert_true(p && net);
    for (int i = 0; i < s.surface.nvert; ++i) p[i] = b.cell[i] / 65536.0;
    assert_ok(om__sim_body_cells(&b, p, net));
    int ntrue = 0;
    for (int k = 0; k < net->ncell; ++k) {
        int cell = (int)lround(65536 * (double)net->probability[k]), truth = 0, there = 0;
        if (k > 0) assert_true(net->probability[k] > net->probability[k - 1]);
        for (int i = 0; i < s.surface.nvert; ++i) {
            there |= b.cell[i] == cell;
            truth |= b.cell[i] == cell && s.attached[i];
        }
        assert_true(there && truth == net->is_true[k]);
        ntrue += truth;
    }
    assert_true(ntrue > 20 && ntrue < net->ncell);
    om_free(net);
    om_free(p);
    om__sim_body_done(&b);
    om_banet_sample_done(&s);
}

static OmStatus use_body(void* ctx) {
    SimBody b = {0};
    SimMove move;
    OmStatus status = om__sim_body_make(ctx, 0.3, &b);
    if (status >= 0) status = om__sim_body_guess(&b, OM_STUDY_SIM_ALL);
    if (status >= 0) status = om__sim_body_move(&b, &move);
    om__sim_body_done(&b);
    return status;
}

static void test_memory(void** unused) {
    (void)unused;
    OmBanetSample s;
    make_plate(&s);
    assert_true(test_failing_allocations(use_body, &s, 3) > 8);
    om_banet_sample_done(&s);
}

// ---- the study --------------------------------------------------------------------------------------------

static void assert_same(StudySample a, StudySample b) {
    assert_int_equal(a.n, b.n);
    assert_true(a.lower == b.lower && a.median == b.median && a.upper == b.upper);
}

static void remove_file(const char* name) {
    char path[600];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    assert_true(om_path_exists(path));
    assert_ok(om_path_remove(path));
}

static void test_study(void** unused) {
    (void)unused;
    OmStudySimulatedDef def = quick_def();
    OmStudySimulatedSummary first, again;
    assert_ok(om_study_simulated_run(&def, NULL, &first));
    assert_int_equal(first.nnew, 2 * OM_STUDY_SIM_NSET);
    for (int set = 0; set < OM_STUDY_SIM_NSET; ++set) {
        const OmStudySimulatedRow* by = first.all[set];
        assert_int_equal(first.nsample[set], 2);
        assert_int_equal(by[OM_STUDY_SIM_SAME].dsc.n + first.nlost[set], 2);
        assert_int_equal(by[OM_STUDY_SIM_SAME].ave.n, by[OM_STUDY_SIM_SAME].dsc.n);
        if (!by[OM_STUDY_SIM_SAME].dsc.n) continue;
        assert_true(by[OM_STUDY_SIM_ZERO].dsc.median == 0 && by[OM_STUDY_SIM_SAME].dsc.median == 1);
        // the true attachments give the true shape; without board and weight only about
        double most = set == OM_STUDY_SIM_BOARD ? 0.5 : 0.05;
        assert_true(by[OM_STUDY_SIM_SAME].ave.median < most * by[OM_STUDY_SIM_ZERO].ave.median);
    }
    // some files are made again, by two workers: the same numbers
    remove_file("sample-exact-0002.bin");
    remove_file("base-exact-0002.bin");
    remove_file("base-two-0001.bin");
    def.nworker = 2;
    assert_ok(om_study_simulated_run(&def, NULL, &again));
    assert_int_equal(again.nnew, 2);
    for (int set = 0; set < OM_STUDY_SIM_NSET; ++set)
        for (int g = 0; g < OM_STUDY_SIM_NGUESS; ++g) {
            assert_same(first.all[set][g].dsc, again.all[set][g].dsc);
            assert_same(first.all[set][g].tpr_area, again.all[set][g].tpr_area);
            assert_same(first.all[set][g].ave, again.all[set][g].ave);
            assert_same(first.hidden[set][g].mve, again.hidden[set][g].mve);
        }
    def.nsolve = 1;  // the second sample of each set has no AVE
    assert_ok(om_study_simulated_run(&def, NULL, &again));
    assert_int_equal(again.all[OM_STUDY_SIM_EXACT][OM_STUDY_SIM_SAME].ave.n, 1);
    assert_int_equal(again.all[OM_STUDY_SIM_EXACT][OM_STUDY_SIM_SAME].dsc.n, 2);
}

// An untrained network: its rows are there and fit its reliability. Another calibration repeats them alone.
static void test_network(void** unused) {
    (void)unused;
    static const BanetLayers layers = {.channel = {16, 16, 16, 16, 16}, .ngroup = 2, .nimage = 1};
    const char* path = temp_path("simulated.safetensors");
    OmStudySimulatedDef def = quick_def();
    OmStudySimulatedSummary sum, again;
    OmBanetNet* net;
    assert_ok(om__banet_net_create(&layers, &net));
    om_net_init_parameters(net->net, 3, net->param);
    net->slope = 1e-3;  // nearly one probability: every cell is attached
    assert_ok(om__banet_net_save(net, path));
    def.weights = path;
    assert_ok(om_study_simulated_run(&def, NULL, &sum));
    assert_true(sum.has_net);
    for (int set = 0; set < OM_STUDY_SIM_NSET; ++set) {
        const OmStudySimulatedRow* r = &sum.all[set][OM_STUDY_SIM_NET];
        assert_int_equal(r->dsc.n + sum.nlost[set], 2);
        if (!r->dsc.n) continue;
        assert_true(r->tpr.median == 1 && r->dsc.median > 0.1 && r->dsc.median < 0.7);
        double gap = 0;  // bins of equal count: the error is their mean gap
        for (int b = 0; b < OM_STUDY_SIM_NBIN; ++b)
            gap += fabs(sum.bin_said[set][b] - sum.bin_true[set][b]) / OM_STUDY_SIM_NBIN;
        assert_near(sum.ece[set], gap, 0.02);
    }
    net->offset = -990;  // probability 0: none is
    assert_ok(om__banet_net_save(net, path));
    assert_ok(om_study_simulated_run(&def, NULL, &again));
    const OmStudySimulatedRow *a = again.all[OM_STUDY_SIM_EXACT], *b = sum.all[OM_STUDY_SIM_EXACT];
    assert_true(a[OM_STUDY_SIM_NET].dsc.median == 0);
    assert_same(a[OM_STUDY_SIM_NET].ave, a[OM_STUDY_SIM_ZERO].ave);
    assert_same(a[OM_STUDY_SIM_ALL].ave, b[OM_STUDY_SIM_ALL].ave);
    assert_true(again.ece[OM_STUDY_SIM_EXACT] != sum.ece[OM_STUDY_SIM_EXACT]);
    // Other weights, with the metadata and the calibration of the first: other answers.
    net->offset = 0;
    om_net_init_parameters(net->net, 4, net->param);
    assert_ok(om__banet_net_save(net, path));
    assert_ok(om_study_simulated_run(&def, NULL, &again));
    assert_true(again.ece[OM_STUDY_SIM_EXACT] != sum.ece[OM_STUDY_SIM_EXACT]);
    om_banet_net_destroy(net);
    assert_ok(om_path_remove(path));
}

static bool say_stop(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)done, (void)total;
    return false;
}

static void assert_refused(OmStudySimulatedDef def, const char* message) {
    OmStudySimulatedSummary sum;
    assert_status(om_study_simulated_run(&def, NULL, &sum), OM_INVALID);
    if (!strstr(om_error_message(), message))
        fail_msg("\"%s\" and not \"%s\"", om_error_message(), message);
}

static void test_nonsense(void** unused) {
    (void)unused;
    OmStudySimulatedDef def = quick_def();
    OmStudySimulatedSummary sum;
    OmProgress stop = {say_stop, NULL};
    remove_file("base-two-0002.bin");
    assert_status(om_study_simulated_run(&def, &stop, &sum), OM_CANCELLED);
    def.nworker = -1;
    assert_refused(def, "nworker is -1");
    def = quick_def();
    def.nsample = 0;
    assert_refused(def, "nsample is 0");
    def = quick_def();
    def.nsolve = -2;
    assert_refused(def, "nsolve is -2");
    assert_refused((OmStudySimulatedDef){.out_dir = dir}, "not made by its default_def");
    assert_refused(om_study_simulated_default_def(NULL), "no folder");
    def = quick_def();
    def.weights = "/none/there.safetensors";
    assert_true(om_study_simulated_run(&def, NULL, &sum) < 0);
    // the folder of another study
    OmStudyAttachmentsDef other = om_study_attachments_default_def(dir);
    OmStudyAttachmentsSummary layouts;
    other.is_quick = true;
    assert_status(om_study_attachments_run(&other, NULL, &layouts), OM_INVALID);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_body),     cmocka_unit_test(test_cells),
        cmocka_unit_test(test_memory),   cmocka_unit_test(test_study),
        cmocka_unit_test(test_network),  cmocka_unit_test(test_sample_file),
        cmocka_unit_test(test_nonsense),
    };
    return cmocka_run_group_tests(test, make_dir, remove_dir);
}
