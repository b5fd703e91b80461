// A plan repeated in changed twins: each of them made and compared here in another way.
#include <unistd.h>

#include "easy_scene.h"
#include "omentum/shape_closest.h"
#include "omentum/world.h"
#include "test_alloc.h"
#include "trial/trial_robust.h"

#define SEED 650301  // by which attachments shrink and grow
#define BLOCK 5      // (1,2)
#define NSTEP 111
#define EVERY 15

static const Kept nothing_kept = {.fd = -1};

static Trace trace[OM_PLAN_MAX_BLOCK];

// Up to the height limit, so that no pull is left, then away from the ROI.
static OmScene make_scene(void) {
    OmScene s = easy_scene();
    s.seed = SEED;
    s.task.grasp_radius = 0.016;  // neighbours are 15 mm away: a grasp 1.7 mm beside holds others
    s.monitor.limit[0] = 0.05e-3, s.monitor.limit[1] = 0.1e-3, s.monitor.limit[2] = 0.3e-3;
    return s;
}

static void make_trace(Crew* crew) {
    OmVec3 p = om_load3(om_body_x(crew->worker[0].attempt.body), crew->grid.vert[BLOCK]);
    trace[BLOCK].n = 0;
    for (int k = 0; k < NSTEP; ++k) {
        p = om_add(p, k < 51 ? om_vec3(0, 0, 1e-3) : om_vec3(1e-3, 0, 0));
        assert_ok(om__trace_add(&trace[BLOCK], p, 0));
    }
}

static void make_crew(const OmScene* scene, Crew* crew) {
    OmSite site;
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om__crew_create(crew, scene, &site, 1));
}

// ---- the same without the module -----------------------------------------------------------------------------------

typedef struct Course {  // of the tissue along the trace
    double* x;           // at each step        (NSTEP x nvert x 3)
    int nvert;
    double force;
    bool exposes;
} Course;

static Course follow(const OmScene* scene, OmVec3 grasp, OmVec3 aside) {
    Crew crew;
    int nheld;
    OmVisibility v;
    make_crew(scene, &crew);
    Attempt* a = &crew.worker[0].attempt;
    Course c = {.nvert = crew.site.mesh.nvert};
    c.x = om_alloc(3 * NSTEP * (size_t)c.nvert, sizeof *c.x);
    OmPose pose = {om_add(grasp, aside), crew.grid.task.q};
    assert_ok(om_body_grasp(a->body, 0, pose, scene->task.grasp_radius, &nheld));
    for (int k = 0; k < NSTEP; ++k) {
        OmBodyReport report;
        OmBodyForces forces;
        pose.p = om_add(trace[BLOCK].tip[k], aside);
        assert_ok(om_body_move(a->body, 0, pose));
        assert_true(om_body_step(a->body, scene->task.time_step, &report) >= 0);
        assert_ok(om_body_get_forces(a->body, &forces));
        c.force = fmax(c.force, om_norm(forces.pull[0]));
        memcpy(c.x + 3 * (size_t)k * (size_t)c.nvert, om_body_x(a->body),
               3 * (size_t)c.nvert * sizeof *c.x);
    }
    assert_ok(om_view_look(a->view, om_body_x(a->body), &v));
    c.exposes = v.nseen >= scene->task.visibility * v.npoint;
    om__crew_done(&crew);
    return c;
}

// Every triangle is searched.
static double median_distance(const OmSurface* s, const int* vert, const double* x,
                              const double* other) {
    double* d = om_alloc((size_t)s->nvert, sizeof *d);
    for (int i = 0; i < s->nvert; ++i) {
        const OmVec3 p = om_load3(other, vert[i]);
        d[i] = INFINITY;
        for (int t = 0; t < s->ntri; ++t) {
            const int* v = s->tri_vert + 3 * (size_t)t;
            const OmVec3 q = om_triangle_closest(
                p, om_load3(x, vert[v[0]]), om_load3(x, vert[v[1]]), om_load3(x, vert[v[2]]), NULL);
            d[i] = fmin(d[i], om_distance(p, q));
        }
    }
    om_sort_doubles(d, s->nvert);
    const double median = d[s->nvert / 2];
    om_free(d);
    return median;
}

// Each repetition alone, as the file of finished trials has it.
static void expect_kept(const char* path, const KeptAgain wanted[5]) {
    Kept kept;
    assert_ok(om__kept_open(path, 1, &kept));
    for (int k = 0; k < 5; ++k) {
        size_t size;
        KeptAgain found;
        const void* data = om__kept_find(&kept, KEPT_CHANGES + k, BLOCK, &size);
        assert_non_null(data);
        assert_int_equal(size, sizeof found);
        memcpy(&found, data, sizeof found);
        assert_near(found.spread, wanted[k].spread, 1e-9);
        assert_near(found.force, wanted[k].force, 1e-9);
        assert_int_equal(found.is_held, 1);
        assert_int_equal(found.is_exposing, wanted[k].is_exposing);
        assert_int_equal(found.is_alike, wanted[k].is_exposing);  // no motion is left
    }
    om__kept_done(&kept);
}

static void five_twins_are_compared(void** state) {
    (void)state;
    char path[] = "/tmp/om_robust_XXXXXX";
    KeptAgain wanted[5] = {{0}};
    Kept kept;
    OmScene scene = make_scene(), changed[5];
    OmVec3 aside[5] = {{0, 0, 0}};
    for (int k = 0; k < 5; ++k) changed[k] = scene;
    changed[0].believed.ratio = 0.5;
    changed[1].believed.ratio = 1.5;
    changed[2].tissue.young *= 0.5;
    changed[3].tissue.friction = 0.2;
    aside[4] = om_vec3(0.0012, 0.0012, 0);
    Crew crew;
    make_crew(&scene, &crew);
    make_trace(&crew);
    const OmVec3 grasp = om_load3(om_body_x(crew.worker[0].attempt.body), crew.grid.vert[BLOCK]);
    OmSurface surface;
    int *vert, nexposed = 0, nlarge = 0;
    assert_ok(om_tet_mesh_boundary(&crew.site.mesh, &surface, &vert));
    const Course plan = follow(&scene, grasp, om_vec3(0, 0, 0));
    double spread = 0, force = 0;
    for (int k = 0; k < 5; ++k) {
        Course c = follow(&changed[k], grasp, aside[k]);
        double largest = 0;
        for (int i = 0; i < NSTEP; ++i) {
            if (i % EVERY && i < NSTEP - 1) continue;
            const size_t at = 3 * (size_t)i * (size_t)c.nvert;
            largest = fmax(largest, median_distance(&surface, vert, plan.x + at, c.x + at));
        }
        wanted[k] = (KeptAgain){.spread = largest, .force = c.force, .is_exposing = c.exposes};
        nlarge += largest > 1e-9;
        spread = fmax(spread, largest);
        force = fmax(force, c.force);
        nexposed += c.exposes && largest <= scene.monitor.limit[2];
        om_free(c.x);
    }
    assert_int_equal(nlarge, 5);  // every change moves the tissue
    OmPreplan* result = om_calloc(1, sizeof *result);
    OmPreplanDef def = om_preplan_default_def(&scene);
    result->n = 5;
    result->point[BLOCK] =
        (OmPreplanPoint){.block = BLOCK, .arm = 0, .exposes = true, .fold = OM_PLAN_PULL};
    close(mkstemp(path));
    assert_ok(om__kept_open(path, 1, &kept));
    assert_ok(om__robust_run(&def, &crew, trace, &kept, result, NULL));
    om__kept_done(&kept);
    expect_kept(path, wanted);
    unlink(path);
    const OmPreplanPoint* p = &result->point[BLOCK];
    assert_int_equal(p->ntwin, 5);
    assert_int_equal(p->ntwin_exposed, nexposed);
    assert_int_equal(p->ntwin_alike, nexposed);  // no motion is left
    assert_near(p->spread, spread, 1e-9);
    assert_near(p->force_most, force, 1e-9);
    assert_int_equal(p->warning, 3);  // 1.4 mm with more attachments
    assert_int_equal(nexposed, 3);    // more attachments hide the ROI, fewer move the tissue
    for (int b = 0; b < 25; ++b)
        if (b != BLOCK) assert_int_equal(result->point[b].ntwin, 0);
    om_free(result);
    om_free(plan.x);
    om_free(vert);
    om_surface_done(&surface);
    om__crew_done(&crew);
    om__trace_done(&trace[BLOCK]);
}

// A path that ends too early on the body of the plan: the last motion continues until the ROI is exposed.
static void a_path_that_is_cut_is_continued(void** state) {
    (void)state;
    OmScene scene = easy_scene();
    Crew crew;
    int ncut = 0, nfold = 0;
    make_crew(&scene, &crew);
    Attempt* a = &crew.worker[0].attempt;
    for (int b = 0; b < 15; ++b) {
        Trace path[2] = {{0}, {0}};
        AttemptResult r;
        double force;
        bool exposes;
        int nheld, nstep = 0;
        if (b % 5 > 2) continue;
        om_body_restore(a->body, crew.rest);
        a->trace = path;
        assert_ok(om__attempt_run(a, 0, b, &r));
        a->trace = NULL;
        const bool has_fold = r.fold != OM_PLAN_PULL;
        path[0].n =
            has_fold ? path[0].fold_step + (path[0].n - path[0].fold_step) / 3 : path[0].n / 2;
        om_body_restore(a->body, crew.rest);
        OmPose pose = {om_load3(om_body_x(a->body), crew.grid.vert[b]), crew.grid.task.q};
        assert_ok(om_body_grasp(a->body, 0, pose, scene.task.grasp_radius, &nheld));
        for (int k = 0; k < path[0].n; ++k)
            assert_ok(om__attempt_step(a, 0, path[0].tip[k], &force));
        OmVisibility v;
        assert_ok(om_view_look(a->view, om_body_x(a->body), &v));
        if (r.exposes && v.nseen < 0.5 * v.npoint) {
            assert_ok(
                om__attempt_continue(a, r.fold, 0, &path[0], om_vec3(0, 0, 0), &exposes, &nstep));
            assert_true(exposes && nstep > 0);
            ++ncut;
            nfold += has_fold;
        }
        for (int k = 0; k < 2; ++k) om__trace_done(&path[k]);
    }
    assert_true(ncut > nfold && nfold > 0);
    om__crew_done(&crew);
}

// A fold away from the camera that was left after some steps of 1 mm ends where the whole fold ends: its length from
// where it began. The ROI lies under attached tissue, so that nothing is gained beyond this length.
static void a_fold_that_is_continued_has_its_length(void** state) {
    (void)state;
    enum { UP = 20 };
    OmScene scene = easy_scene();
    scene.roi.center = om_vec3(0.045, 0, 0);
    Crew crew;
    make_crew(&scene, &crew);
    Attempt* a = &crew.worker[0].attempt;
    a->force_limit = INFINITY;
    for (int nfold = 0; nfold <= 30; nfold += 15) {
        Trace path = {.fold_step = UP};
        double force;
        bool exposes;
        int nheld, nstep = 0;
        om_body_restore(a->body, crew.rest);
        OmPose pose = {om_load3(om_body_x(a->body), crew.grid.vert[BLOCK]), crew.grid.task.q};
        assert_ok(om_body_grasp(a->body, 0, pose, scene.task.grasp_radius, &nheld));
        for (int k = 0; k < UP + nfold; ++k) {
            pose.p = om_add(pose.p, k < UP ? om_vec3(0, 0, 1e-3) : om_vec3(1e-3, 0, 0));
            assert_ok(om__attempt_step(a, 0, pose.p, &force));
            assert_ok(om__trace_add(&path, pose.p, force));
        }
        assert_ok(om__attempt_continue(a, OM_PLAN_MOVE_AWAY, 0, &path, om_vec3(0, 0, 0), &exposes,
                                       &nstep));
        printf("%d mm of %.0f mm folded: %d steps\n", nfold, 1e3 * scene.task.retract, nstep);
        assert_false(exposes);
        assert_near(nstep, 1e3 * scene.task.retract - nfold, 1);  // a motion may end by rounding
        om__trace_done(&path);
    }
    om__crew_done(&crew);
}

// Nothing attached: no twin with fewer or more attachments.
static void a_twin_that_cannot_be_made_is_left_out(void** state) {
    (void)state;
    OmScene scene = make_scene();
    scene.believed.kind = OM_BELIEF_NONE;
    Crew crew;
    make_crew(&scene, &crew);
    make_trace(&crew);
    OmPreplan* result = om_calloc(1, sizeof *result);
    OmPreplanDef def = om_preplan_default_def(&scene);
    result->n = 5;
    result->point[BLOCK] = (OmPreplanPoint){.block = BLOCK, .arm = 0, .exposes = true};
    assert_ok(om__robust_run(&def, &crew, trace, &nothing_kept, result, NULL));
    assert_int_equal(result->point[BLOCK].ntwin, 3);
    om_free(result);
    om__crew_done(&crew);
    om__trace_done(&trace[BLOCK]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(five_twins_are_compared),
        cmocka_unit_test(a_path_that_is_cut_is_continued),
        cmocka_unit_test(a_twin_that_cannot_be_made_is_left_out),
        cmocka_unit_test(a_fold_that_is_continued_has_its_length),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
