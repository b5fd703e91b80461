// test_match_quadratic.c: the static twin with quadratic elements, as the bodies of scenes have.
#include "test_common.h"

#include "omentum/body.h"
#include "omentum/match.h"
#include "test_alloc.h"

typedef struct Rig {
    OmScene scene;
    OmSite site;
    OmMatch* match;
    const OmMatchView* view;
    OmMatchGrasp grasp;
    double *x, *spring;
} Rig;

// A sheet of 80 mm on 6 x 6 cells, held on its left, as the twin believes.
static void make_rig(Rig* rig, OmTissueElement element) {
    memset(rig, 0, sizeof *rig);
    rig->scene = om_scene_default();
    rig->scene.tissue.element = element;
    rig->scene.tissue.size = om_vec3(0.08, 0.08, 0.005);
    rig->scene.tissue.cells = om_vec3(6, 6, 1);
    rig->scene.attach = (OmSceneAttach){
        .kind = OM_ATTACH_BOX, .lo = {-1, -1, -1}, .hi = {-0.015, 1, 1}, .share_max = 0.5};
    rig->scene.roi.is_random = false;
    assert_ok(om_site_build(&rig->scene, OM_SITE_TWIN, NULL, &rig->site));
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    assert_ok(om_match_create(&def, &rig->match));
    rig->view = om_match_view(rig->match);
    size_t n = 3 * (size_t)rig->view->mesh->nvert;
    rig->x = malloc(n * sizeof(double));
    memcpy(rig->x, rig->view->mesh->x, n * sizeof(double));
    rig->spring = calloc((size_t)rig->view->ncandidate, sizeof(double));
    const OmMeshSet* held = om_tet_mesh_find_set(&rig->site.mesh, "attachment");
    for (int i = 0; i < rig->view->ncandidate; ++i)
        for (int k = 0; k < held->nvert; ++k)
            if (held->vert[k] == rig->view->candidate[i])
                rig->spring[i] = rig->view->foundation * rig->view->area[i];
    OmPose from = {om_vec3(0.04, 0, 0.005), om_quat_identity()}, to = from;
    to.p = om_vec3(0.038, 0, 0.015);
    rig->grasp = (OmMatchGrasp){.pose_world_grasp = from, .pose_world_now = to, .radius = 0.011};
}

static void rig_done(Rig* rig) {
    om_match_destroy(rig->match);
    om_site_done(&rig->site);
    free(rig->x);
    free(rig->spring);
}

// The body of the same scene, moved by the same tool.
static OmBody* lift_body(const Rig* rig) {
    OmBody* body;
    OmBodyReport report;
    int nheld;
    OmPose from = rig->grasp.pose_world_grasp, to = rig->grasp.pose_world_now;
    assert_ok(om_body_create(&rig->scene, &rig->site, 1, &body));
    assert_true(om_body_settle(body, 0.02, 1e-4, 3) >= 0);
    assert_ok(om_body_grasp(body, 0, from, rig->grasp.radius, &nheld));
    for (int k = 1; k <= 40; ++k) {
        assert_ok(om_body_move(body, 0, om_pose_lerp(from, to, k / 40.0)));
        assert_true(om_body_step(body, 0.02, &report) >= 0);
    }
    assert_true(om_body_settle(body, 0.02, 1e-4, 3) >= 0);
    return body;
}

// Largest distance of the static twin from the body, m: another engine, another integration of the elements,
// attachments held still instead of by springs.
static double find_distance(OmTissueElement element) {
    Rig rig;
    make_rig(&rig, element);
    OmMatchLoad load = {.spring = rig.spring, .ngrasp = 1, .grasp = &rig.grasp};
    assert_ok(om_match_find_rest(rig.match, &load, rig.x, NULL));
    rig.scene.tissue.element = OM_ELEMENT_QUADRATIC;
    OmBody* body = lift_body(&rig);
    int n = om_body_node_count(body);
    double most = 0, *x = malloc(3 * sizeof(double) * (size_t)n);
    om_body_get_nodes(body, x);
    for (int v = 0; v < rig.view->mesh->nvert; ++v)
        most = fmax(most, om_distance(om_load3(x, v), om_load3(rig.x, v)));
    if (element == OM_ELEMENT_QUADRATIC) {
        assert_int_equal(n, rig.view->mesh->nvert);
        assert_int_equal(rig.view->ncorner, rig.site.mesh.nvert);
        // without an organ the nodes are the body's vertices
        assert_memory_equal(x, om_body_x(body), 3 * sizeof *x * (size_t)n);
        int* held = malloc(sizeof *held * (size_t)n);
        int nheld = om_body_find_held_nodes(body, 0, om_vec3(0, 0, 0), 0, held), k = 0;
        for (int v = 0; v < n; ++v)
            if (om_body_held_by(body)[v] == 0) assert_true(k < nheld && held[k++] == v);
        assert_int_equal(k, nheld);
        free(held);
    }
    free(x);
    om_body_destroy(body);
    rig_done(&rig);
    return most;
}

static void test_the_body_of_the_scene(void** state) {
    (void)state;
    double quadratic = find_distance(OM_ELEMENT_QUADRATIC),
           linear = find_distance(OM_ELEMENT_LINEAR);
    printf("    from the body: %.2f mm, with linear elements %.2f mm\n", 1e3 * quadratic,
           1e3 * linear);
    assert_below(quadratic,
                 0.75e-3);  // 0.60 mm, beside the grasp: another integration of strong strains
    assert_true(linear > 5 * quadratic);
}

// Forces are derivatives of the energy, at vertices and at midpoints, with springs on both.
static void test_derivatives(void** state) {
    (void)state;
    Rig rig;
    make_rig(&rig, OM_ELEMENT_QUADRATIC);
    int n = 3 * rig.view->mesh->nvert;
    double *g = malloc(sizeof(double) * (size_t)n), h = 1e-7, ea, eb;
    OmRng rng = om_rng_init(5, 0);
    for (int i = 0; i < n; ++i) rig.x[i] += om_rng_range(&rng, -2e-4, 2e-4);
    OmMatchPull pull = {.tri = 3,
                        .bary = {0.2, 0.3, 0.5},
                        .goal = {0.01, 0, 0.02},
                        .normal = {0, 0, 1},
                        .across = 3,
                        .along = 0.5};
    OmMatchLoad load = {
        .spring = rig.spring, .ngrasp = 1, .grasp = &rig.grasp, .npull = 1, .pull = &pull};
    assert_ok(om_match_eval(rig.match, &load, rig.x, &ea, g));
    for (int k = 0; k < 60; ++k) {
        int i = (int)om_rng_below(&rng, (uint32_t)n);
        double kept = rig.x[i];
        rig.x[i] = kept + h;
        assert_ok(om_match_eval(rig.match, &load, rig.x, &eb, NULL));
        rig.x[i] = kept - h;
        assert_ok(om_match_eval(rig.match, &load, rig.x, &ea, NULL));
        rig.x[i] = kept;
        assert_near((eb - ea) / (2 * h), g[i], 1e-5 * (1 + fabs(g[i])));
    }
    free(g);
    rig_done(&rig);
}

// A spring by area holds the sheet down: a uniform pull of all candidates by d costs k A d^2 / 2, of midpoints too.
static void test_springs_by_area(void** state) {
    (void)state;
    Rig rig;
    make_rig(&rig, OM_ELEMENT_QUADRATIC);
    double area = 0, with, without, d = 1e-3;
    for (int i = 0; i < rig.view->ncandidate; ++i) {
        area += rig.view->area[i];
        rig.spring[i] = 5e5 * rig.view->area[i];
    }
    const OmMeshSet* under = om_tet_mesh_find_set(&rig.site.mesh, "underside");
    assert_int_equal(rig.view->ncandidate, under->nvert);  // midpoints are none
    for (int v = 0; v < rig.view->mesh->nvert; ++v) rig.x[3 * v + 2] += d;
    OmMatchLoad load = {.spring = rig.spring};
    assert_ok(om_match_eval(rig.match, &load, rig.x, &with, NULL));
    load.spring = NULL;
    assert_ok(om_match_eval(rig.match, &load, rig.x, &without, NULL));
    // The area of vertices on the border is partly that of the sides; what the midpoints there have is spread evenly.
    double below = 0.08 * 0.08;
    printf("    %.3g J of springs; k A d^2 / 2 of the underside is %.3g J\n", with - without,
           0.5 * 5e5 * below * d * d);
    assert_true(with - without > 0.5 * 5e5 * below * d * d);
    assert_true(with - without <= 0.5 * 5e5 * area * d * d * (1 + 1e-12));
    rig_done(&rig);
}

static OmStatus create(void* ctx) {
    Rig* rig = ctx;
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->site);
    def.nhypothesis = 3;
    OmMatch* match;
    OM_TRY(om_match_create(&def, &match));
    om_match_destroy(match);
    return OM_OK;
}

static void test_memory(void** state) {
    (void)state;
    Rig rig;
    make_rig(&rig, OM_ELEMENT_QUADRATIC);
    assert_true(test_failing_allocations(create, &rig, 1) > 10);
    rig_done(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_body_of_the_scene),
        cmocka_unit_test(test_derivatives),
        cmocka_unit_test(test_springs_by_area),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
