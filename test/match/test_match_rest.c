// test_match_rest.c: equilibria of the twin against finite differences, and against the body of the same scene.
#include "match_sheet.h"

#include "omentum/body.h"
#include "omentum/match.h"
#include "test_alloc.h"

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    const OmMatchView* view;
    double *x, *spring;
} Rig;

static void begin_of(Rig* rig, int n, OmTissueElement element) {
    build_sheet(n, &rig->scene, &rig->site);
    rig->scene.tissue.element = element;
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    def.nhypothesis = 0;
    assert_int_equal(om_match_create(&def, &rig->match), OM_OK);
    rig->view = om_match_view(rig->match);
    rig->x = malloc(sizeof(double) * 3 * (size_t)rig->view->mesh->nvert);
    memcpy(rig->x, rig->view->mesh->x, sizeof(double) * 3 * (size_t)rig->view->mesh->nvert);
    rig->spring = calloc((size_t)rig->view->ncandidate, sizeof(double));
    const OmMeshSet* held = om_tet_mesh_find_set(&rig->site.mesh, "attachment");
    for (int i = 0; i < rig->view->ncandidate; ++i)
        for (int k = 0; k < held->nvert; ++k)
            if (held->vert[k] == rig->view->candidate[i])
                rig->spring[i] = rig->view->foundation * rig->view->area[i];
}

static void begin(Rig* rig, int n) { begin_of(rig, n, OM_ELEMENT_LINEAR); }

static void end(Rig* rig) {
    om_match_destroy(rig->match);
    om_site_done(&rig->site);
    free(rig->x);
    free(rig->spring);
}

// The right edge, lifted by `lift`.
static OmMatchGrasp grasp_edge(double lift) {
    return (OmMatchGrasp){.pose_world_grasp = {om_vec3(0.06, 0, 0.005), om_quat_identity()},
                          .pose_world_now = {om_vec3(0.055, 0, 0.005 + lift), om_quat_identity()},
                          .radius = 0.016};
}

static void bend(const Rig* rig, double* x) {
    OmRng rng = om_rng_init(7, 0);
    for (int i = 0; i < 3 * rig->view->mesh->nvert; ++i)
        x[i] = rig->view->mesh->x[i] + om_rng_range(&rng, -5e-4, 5e-4);
    for (int v = 0; v < rig->view->mesh->nvert; ++v) x[3 * v + 2] += 2 * x[3 * v] * x[3 * v];
}

static void test_derivatives(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8);
    int n = 3 * rig.view->mesh->nvert;
    OmMatchGrasp grasp = grasp_edge(0.002);
    OmMatchPull pull[2] = {{10, {0.2, 0.3, 0.5}, {0.01, 0.02, 0.03}, {0, 0.6, 0.8}, 20, 3},
                           {30, {1, 0, 0}, {0, 0.02, 0.01}, {0, 0, 0}, 0, 5}};
    OmMatchLoad load = {rig.spring, 1, &grasp, 2, pull, 0, 0};
    double *g = malloc(sizeof *g * (size_t)n), *ga = malloc(sizeof *g * (size_t)n),
           *gb = malloc(sizeof *g * (size_t)n), *dx = malloc(sizeof *g * (size_t)n);
    bend(&rig, rig.x);
    double e, ea, eb, worst = 0, scale = 0;
    assert_int_equal(om_match_eval(rig.match, &load, rig.x, &e, g), OM_OK);
    for (int i = 0; i < n; ++i) scale = fmax(scale, fabs(g[i]));
    for (int i = 0; i < n; i += 7) {
        double h = 1e-7, at = rig.x[i];
        rig.x[i] = at + h;
        om_match_eval(rig.match, &load, rig.x, &ea, NULL);
        rig.x[i] = at - h;
        om_match_eval(rig.match, &load, rig.x, &eb, NULL);
        rig.x[i] = at;
        worst = fmax(worst, fabs((ea - eb) / (2 * h) - g[i]));
    }
    assert_below(worst / scale, 1e-6);  // rounding of energies over h
    // At an equilibrium: A dx = f, and the difference of gradients along dx is f.
    OmRng rng = om_rng_init(8, 0);
    for (int i = 0; i < n; ++i) g[i] = om_rng_range(&rng, -1e-3, 1e-3);
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_OK);
    assert_int_equal(om_match_factorize(rig.match, &load, rig.x), OM_OK);
    assert_int_equal(om_match_solve(rig.match, 1, g, dx), OM_OK);
    const double h = 1e-5;  // no vertex enters or leaves the board
    for (int i = 0; i < n; ++i) rig.x[i] += h * dx[i];
    om_match_eval(rig.match, &load, rig.x, &ea, ga);
    for (int i = 0; i < n; ++i) rig.x[i] -= 2 * h * dx[i];
    om_match_eval(rig.match, &load, rig.x, &eb, gb);
    worst = 0;
    for (int i = 0; i < n; ++i) worst = fmax(worst, fabs((ga[i] - gb[i]) / (2 * h) - g[i]));
    printf("force along dx: %.3g of 1e-3 N\n", worst);
    assert_below(worst, 1e-5);
    free(g), free(ga), free(gb), free(dx);
    end(&rig);
}

// The body of the same scene, settled with its tool at the same place: another solver, contact and equilibrium.
static void check_body(OmTissueElement element, OmMatchGrasp grasp, double bound) {
    Rig rig;
    begin_of(&rig, 12, element);
    OmMatchLoad load = {.spring = rig.spring, .ngrasp = 1, .grasp = &grasp};
    OmMatchRest rest;
    OmBody* body;
    OmBodyReport report;
    assert_int_equal(om_body_create(&rig.scene, &rig.site, 1, &body), OM_OK);
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    int nheld;
    assert_int_equal(om_body_grasp(body, 0, grasp.pose_world_grasp, grasp.radius, &nheld), OM_OK);
    assert_int_equal(om_body_node_count(body), rig.view->mesh->nvert);
    int* held = malloc(sizeof *held * (size_t)rig.view->mesh->nvert);
    int n = om_body_find_held_nodes(body, 0, grasp.pose_world_grasp.p, grasp.radius, held);
    grasp.vert = held;
    grasp.nvert = n;
    om_body_get_nodes(body, rig.x);
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, &rest), OM_OK);
    printf("rest: %d iterations, last motion %.3g mm, residual %.3g N\n", rest.nnewton,
           1e3 * rest.motion, rest.residual);
    for (int k = 1; k <= 100; ++k) {
        OmPose pose = om_pose_lerp(grasp.pose_world_grasp, grasp.pose_world_now, k / 100.0);
        om_body_move(body, 0, pose);
        assert_true(om_body_step(body, 0.02, &report) >= 0);
    }
    om_body_settle(body, 0.02, 2e-4, 10);
    double most = 0, moved = 0;
    for (int v = 0; v < rig.site.mesh.nvert; ++v) {
        OmVec3 b = om_load3(om_body_x(body), v);
        most = fmax(most, om_distance(b, om_load3(rig.x, v)));
        moved = fmax(moved, om_distance(b, om_load3(rig.view->mesh->x, v)));
    }
    printf("%s: %d held, moved %.1f mm, differs by at most %.3f mm\n",
           om_tissue_element_name(element), nheld, 1e3 * moved, 1e3 * most);
    assert_below(most, bound * moved);
    om_body_destroy(body);
    free(held);
    end(&rig);
}

static void test_body(void** state) {
    (void)state;
    check_body(OM_ELEMENT_LINEAR, grasp_edge(0.025), 0.03);
}

// The twin of shells, and the estimate's quadratic elements on the same vertices. In the middle of a face both hold it.
static void test_body_of_shells(void** state) {
    (void)state;
    OmMatchGrasp grasp = grasp_edge(0.025);
    grasp.radius = 0.0073;
    grasp.pose_world_grasp.p = om_vec3(0.055, 0.005, 0.005);
    grasp.pose_world_now.p = om_vec3(0.050, 0.005, 0.030);
    check_body(OM_ELEMENT_SHELL, grasp,
               0.06);  // coarse: quadratic elements on quadratic ones differ by 3 %
}

// The nodes that shells hold, around a tip at a vertex: one of the four faces there is held, on one side of it.
static void test_held_nodes(void** state) {
    (void)state;
    Rig rig;
    OmBody* body;
    int nheld, n = 0;
    begin_of(&rig, 12, OM_ELEMENT_SHELL);
    const OmPose at = {om_vec3(0.02, 0.01, 0.005), om_quat_identity()};
    assert_int_equal(om_body_create(&rig.scene, &rig.site, 1, &body), OM_OK);
    int* held = malloc(sizeof *held * (size_t)om_body_node_count(body));
    assert_int_equal(om_body_find_held_nodes(body, 0, at.p, 0.0055, held), 0);
    assert_int_equal(om_body_grasp(body, 0, at, 0.0055, &nheld), OM_OK);
    const int nnode = om_body_find_held_nodes(body, 0, at.p, 0.0055, held);
    for (int v = 0; v < rig.view->mesh->nvert; ++v)
        if (om_distance(om_load3(rig.view->mesh->x, v), at.p) <= 0.0055)
            assert_true(n < nnode && held[n++] == v);
    assert_int_equal(n, nnode);
    assert_int_equal(om_body_find_held_nodes(body, 1, at.p, 0.0055, held), 0);
    // None within the radius: all that is held.
    const int all = om_body_find_held_nodes(body, 0, om_vec3(1, 0, 0), 0.0055, held);
    assert_true(all > nheld);
    for (int k = 0; k < nheld; ++k) assert_int_equal(om_body_held_by(body)[held[k]], 0);
    om_body_destroy(body);
    free(held);
    end(&rig);
}

// Tissue of twice the modulus, by the load and by the scene.
static void test_modulus_of_the_load(void** state) {
    (void)state;
    Rig a, b;
    double moved = 0;
    begin(&a, 8);
    begin(&b, 8);
    om_match_destroy(b.match);
    b.site.young *= 2;
    OmMatchDef def = om_match_default_def(&b.scene, &b.site);
    assert_int_equal(om_match_create(&def, &b.match), OM_OK);
    OmMatchGrasp grasp = grasp_edge(0.02);
    OmMatchLoad load = {.ngrasp = 1, .grasp = &grasp, .young = 2};
    memcpy(a.x, a.view->mesh->x, 3 * sizeof *a.x * (size_t)a.view->mesh->nvert);
    memcpy(b.x, a.x, 3 * sizeof *a.x * (size_t)a.view->mesh->nvert);
    assert_int_equal(om_match_find_rest(a.match, &load, a.x, NULL), OM_OK);
    load.young = 0;
    assert_int_equal(om_match_find_rest(b.match, &load, b.x, NULL), OM_OK);
    for (int i = 0; i < 3 * a.view->mesh->nvert; ++i) assert_near(a.x[i], b.x[i], 1e-7);
    load.young = 1;
    assert_int_equal(om_match_find_rest(b.match, &load, b.x, NULL), OM_OK);  // the same
    for (int i = 0; i < 3 * a.view->mesh->nvert; ++i) assert_near(a.x[i], b.x[i], 1e-7);
    assert_int_equal(om_match_find_rest(a.match, &load, a.x, NULL), OM_OK);
    for (int i = 0; i < 3 * a.view->mesh->nvert; ++i) moved = fmax(moved, fabs(a.x[i] - b.x[i]));
    printf("twice the modulus: up to %.2f mm\n", 1e3 * moved);
    assert_true(moved > 5e-4);
    end(&a);
    end(&b);
}

static void test_refusals(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8);
    OmMatchGrasp grasp = grasp_edge(0.01);
    OmMatchLoad load = {.spring = rig.spring, .ngrasp = 1, .grasp = &grasp};
    grasp.pose_world_grasp.p.z = 0.2;
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no vertex of the twin within 16.0 mm"));
    grasp = grasp_edge(0.01);
    rig.spring[3] = -1;
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "candidate 3"));
    rig.spring[3] = 0;
    OmMatchPull pull = {.tri = rig.view->surface->ntri};
    load.npull = 1, load.pull = &pull;
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "pull 0"));
    load.npull = 0;
    rig.x[5] = (double)NAN;
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "vertex 1"));
    rig.x[5] = rig.view->mesh->x[5];
    load.max_newton = 2;
    assert_int_equal(om_match_find_rest(rig.match, &load, rig.x, NULL), OM_NOT_CONVERGED);
    assert_int_equal(om_match_solve(rig.match, 1, rig.x, rig.x), OM_OK);  // factors are kept
    OmMatch* match;
    OmMatchDef def = om_match_default_def(&rig.scene, &rig.site);
    rig.site.role = OM_SITE_WORLD;
    assert_int_equal(om_match_create(&def, &match), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "truth"));
    rig.site.role = OM_SITE_TWIN;
    def.moved = 0;
    assert_int_equal(om_match_create(&def, &match), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "moved"));
    def = om_match_default_def(&rig.scene, &rig.site);
    def = (OmMatchDef){0};
    assert_int_equal(om_match_create(&def, &match), OM_INVALID);
    assert_null(match);
    om_match_destroy(NULL);
    end(&rig);
}

static OmStatus make_and_free(void* ctx) {
    Rig* rig = ctx;
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    def.nhypothesis = 6;  // one of them is two patches
    OmMatch* match;
    OM_TRY(om_match_create(&def, &match));
    om_match_destroy(match);
    return OM_OK;
}

static void test_memory(void** state) {
    (void)state;
    Rig rig;
    begin(&rig, 8);
    assert_true(test_failing_allocations(make_and_free, &rig, 1) > 10);
    end(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_derivatives),
                                       cmocka_unit_test(test_body),
                                       cmocka_unit_test(test_body_of_shells),
                                       cmocka_unit_test(test_held_nodes),
                                       cmocka_unit_test(test_modulus_of_the_load),
                                       cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
