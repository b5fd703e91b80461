// test_fem_equal_error.c: error against the time of a step, linear and quadratic elements and shells on three meshes
// each: a strip that sags, a patch of a sheet that is lifted, a corner of a sheet that is folded over on a board. At
// equal error quadratic elements take less than a tenth of the time on one of their meshes at least (doc/fem.md has
// the table).
//
// A time is processor time of one worker, the mean over the steps of the motion, each with the least of its times in
// three runs in which the meshes take turns. Then the body comes to rest, and its error is measured.
#include <time.h>

#include "test_sheet.h"

#define NMESH 9  // three linear ones, three quadratic ones, three of shells
#define NRUN 3
#define MAX_STEP 100
#define GRID 13                          // points of the sheet of 10 mm cells along a side
#define MAX_VALUE (3 * 2 * GRID * GRID)  // numbers that a case measures

typedef struct Case {
    const char* name;
    int nstep;     // of the motion
    bool is_lift;  // two errors: at 20 mm and at 50 mm
    void (*start)(TestRig* r, const ElementKind* kind, const int n[3]);
    void (*move)(TestRig* r, int step);
    void (*measure)(TestRig* r, double* value);  // at rest
    double (*error)(const double* value, const double* exact);
    double exact;      // the first value; 0: those of quadratic elements on the mesh below
    int reference[3];  //
    int cells[NMESH][3];
} Case;

static double processor_time(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void step(TestRig* r, double h) {
    OmStatus status = r->cw ? om_contact_step(r->cw, r->m, r->s, r->w, h, NULL)
                            : om_tissue_step(r->m, r->s, r->w, h, NULL);
    if (status != OM_OK) printf("a step: %s\n", om_error_message());
    assert_true(status >= 0);
}

static void settle(TestRig* r) {
    for (int k = 0; k < 10; ++k) step(r, 0.02);
    for (int k = 0; k < 50; ++k) step(r, 0.1);
    double speed = 0;
    for (int i = 0; i < 3 * element_nodes(r)->nvert; ++i)
        speed = fmax(speed, fabs(om_tissue_v(r->s)[i]));
    assert_below(speed, 2e-4);
}

static double relative_error(const double* value, const double* exact) {
    return fabs(*value / *exact - 1);
}

// ---- the strip: 60 x 30 x 5 mm, one end held, a small weight ----------------------------------------------

static void strip_start(TestRig* r, const ElementKind* kind, const int n[3]) {
    rig_box(r, element_lo, om_vec3(0.06, 0.03, 0.005), n[0], n[1], n[2]);
    rig_attach_plane(r, 0, 0);
    r->def.gravity = om_vec3(0, 0, -0.05);
    r->def.material_default =
        (OmMaterial){.young = 3000, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN};
    r->def.rayleigh_mass = 4;
    r->def.solver.tolerance = 1e-3;
    element_choose(r, kind);
    rig_start(r);
}

static void strip_move(TestRig* r, int k) { (void)r, (void)k; }

// How far the middle of the end's lower edge sinks, m.
static void strip_measure(TestRig* r, double* value) {
    OmTissueReport report;
    if (om_tissue_find_rest(r->m, r->s, r->w, 1e-5, 60, &report) != OM_OK)
        fail_msg("%s", om_error_message());
    const OmTetMesh* mesh = element_nodes(r);
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        if (p.x < 0.06 - 1e-9 || fabs(p.y - 0.015) > 1e-9 || p.z > 1e-9) continue;
        value[0] = p.z - om_tissue_x(r->s)[3 * i + 2];
        return;
    }
    fail_msg("no vertex at the middle of the end");
}

// ---- the lift: a patch of a sheet without weight, to 50 mm -------------------------------------------------

static void lift_start(TestRig* r, const ElementKind* kind, const int n[3]) {
    rig_box(r, element_lo, om_vec3(SIDE, SIDE, THICK), n[0], n[1], n[2]);
    r->def.material_default =
        (OmMaterial){.young = 20000, .poisson = 0.43, .law = OM_STABLE_NEO_HOOKEAN};
    r->def.gravity = om_vec3(0, 0, 0);
    r->def.rayleigh_mass = 4;
    r->def.solver.tolerance = 1e-3;
    element_choose(r, kind);
    rig_start(r);
}

static void lift_to(TestRig* r, double z) {
    unsigned char* is_patch = om_alloc((size_t)element_nodes(r)->nvert, 1);
    raise_patch(r, z, is_patch);
    om_free(is_patch);
}

static void lift_move(TestRig* r, int k) { lift_to(r, 0.05 * fmin(1, (k + 1) / 50.0)); }

// Force on the patch at 20 and at 50 mm, N.
static void lift_measure(TestRig* r, double* value) {
    size_t n = (size_t)element_nodes(r)->nvert;
    double* force = om_alloc(3 * n, sizeof *force);
    for (int high = 1; high >= 0; --high) {
        lift_to(r, high ? 0.05 : 0.02);
        settle(r);
        assert_ok(om_tissue_get_attachment_force(r->m, r->s, force));
        value[high] = 0;
        for (size_t i = 0; i < n; ++i)
            if (element_nodes(r)->x[3 * i] > 0.1 - 1e-9) value[high] += force[3 * i + 2];
    }
    om_free(force);
}

// ---- the fold: a corner of a sheet on a board, turned by 135 degrees about the fold ------------------------

static void fold_to(TestRig* r, double angle) {
    const OmTetMesh* mesh = element_nodes(r);
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    double* anchor = om_alloc(3 * (size_t)mesh->nvert, sizeof *anchor);
    OmVec3 middle = om_vec3(0, 0, THICK / 2);
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        bool is_corner = p.x + p.y < 0.02 + 1e-9;
        if (!is_corner && FOLD_U(p) > 1e-9) continue;
        if (is_corner) p = om_pose_apply(fold_pose(angle), om_sub(p, middle));
        vert[num] = i;
        om_store3(anchor, num++, p);
    }
    assert_ok(om_tissue_set_attachment(r->m, r->s, num, vert, anchor, NULL));
    om_free(vert), om_free(anchor);
}

static void fold_start(TestRig* r, const ElementKind* kind, const int n[3]) {
    sheet_start(r, kind, n[0], n[2], OM_STABLE_NEO_HOOKEAN, true);
}

static void fold_move(TestRig* r, int k) { fold_to(r, 0.75 * OM_PI * fmin(1, (k + 1) / 90.0)); }

// Positions of the points of a grid of 10 mm on both sides, which every mesh has.
static void fold_measure(TestRig* r, double* value) {
    settle(r);
    const OmTetMesh* mesh = element_nodes(r);
    int num = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        int x = (int)lround(100 * p.x), y = (int)lround(100 * p.y), z = p.z > THICK / 2;
        OmVec3 q = om_vec3(x / 100.0, y / 100.0, z * THICK);
        if (om_distance(p, q) > 1e-9) continue;
        om_store3(value, x + GRID * (y + GRID * z), om_load3(om_tissue_x(r->s), i));
        ++num;
    }
    assert_int_equal(3 * num, MAX_VALUE);
}

// Root of the mean square of the distance from the exact position, of the half that moves, m.
static double fold_error(const double* value, const double* exact) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < 2 * GRID * GRID; ++i) {
        if (i % GRID + i / GRID % GRID >= GRID - 1) continue;
        sum += om_norm2(om_sub(om_load3(value, i), om_load3(exact, i)));
        ++num;
    }
    return sqrt(sum / num);
}

// ---- the table ---------------------------------------------------------------------------------------------

// Time of a step of linear elements with this error, between two of their meshes by powers of the error; that of the
// finest mesh, which is less, where the error is smaller than all of theirs.
static double linear_time(double error, const double* errors, const double* times, bool* is_more) {
    *is_more = error < errors[2];
    if (*is_more) return times[2];
    int k = error < errors[1];
    double share = log(error / errors[k]) / log(errors[k + 1] / errors[k]);
    return times[k] * pow(times[k + 1] / times[k], fmax(0, share));
}

static const ElementKind* const kind[3] = {&linear_element, &quadratic_element, &shell_element};

static void measure_case(const Case* c) {
    static double value[NMESH + 1][MAX_VALUE], time[NMESH][MAX_STEP];
    TestRig body[NMESH] = {0}, reference;
    double mean[NMESH] = {0}, *exact = value[NMESH];
    exact[0] = c->exact;
    if (c->exact == 0) {
        c->start(&reference, &quadratic_element, c->reference);
        for (int k = 0; k < c->nstep; ++k) c->move(&reference, k), step(&reference, STEP);
        c->measure(&reference, exact);
        rig_done(&reference);
    }
    for (int m = 0; m < NMESH; ++m) c->start(&body[m], kind[m / 3], c->cells[m]);
    for (int run = 0; run < NRUN; ++run)
        for (int m = 0; m < NMESH; ++m) {
            om_tissue_state_reset(body[m].m, body[m].s);
            for (int k = 0; k < c->nstep; ++k) {
                c->move(&body[m], k);
                double begin = processor_time();
                step(&body[m], STEP);
                double now = processor_time() - begin;
                time[m][k] = run == 0 ? now : fmin(now, time[m][k]);
            }
        }
    for (int m = 0; m < NMESH; ++m) {
        for (int k = 0; k < c->nstep; ++k) mean[m] += time[m][k] / c->nstep;
        c->measure(&body[m], value[m]);
        printf("%s, %s %dx%dx%d: %.2f ms\n", c->name, kind[m / 3]->name, c->cells[m][0],
               c->cells[m][1], c->cells[m][2], 1e3 * mean[m]);
    }
    for (int what = 0; what <= c->is_lift; ++what) {
        double error[NMESH], best = 0;
        for (int m = 0; m < NMESH; ++m) error[m] = c->error(value[m] + what, exact + what);
        printf("%s%s: errors", c->name, c->is_lift ? what ? " to 50 mm" : " to 20 mm" : "");
        for (int m = 0; m < NMESH; ++m) printf(" %.4g", 1e3 * error[m]);
        printf(" thousandths; linear over quadratic time at equal error");
        for (int m = 3; m < NMESH; ++m) {
            bool is_more;
            double ratio = linear_time(error[m], error, mean, &is_more) / mean[m];
            printf(" %s%.3g", is_more ? "> " : "", ratio);
            best = fmax(best, ratio);
        }
        printf("\n");
        assert_true(best > 10);
    }
    for (int m = 0; m < NMESH; ++m) rig_done(&body[m]);
}

static void test_strip(void** context) {
    (void)context;
    measure_case(&(Case){"strip",
                         50,
                         false,
                         strip_start,
                         strip_move,
                         strip_measure,
                         relative_error,
                         0.01140,  //
                         {0},
                         {{12, 6, 2},
                          {24, 12, 4},
                          {48, 24, 8},
                          {6, 3, 1},
                          {12, 6, 1},
                          {24, 12, 2},
                          {12, 6, 1},
                          {24, 12, 1},
                          {48, 24, 1}}});
}

static void test_lift(void** context) {
    (void)context;
    measure_case(&(Case){"lift",
                         60,
                         true,
                         lift_start,
                         lift_move,
                         lift_measure,
                         relative_error,
                         0,  //
                         {36, 36, 3},
                         {{24, 24, 2},
                          {48, 48, 4},
                          {72, 72, 6},
                          {6, 6, 1},
                          {12, 12, 1},
                          {24, 24, 2},
                          {12, 12, 1},
                          {24, 24, 1},
                          {24, 24, 2}}});
}

static void test_fold(void** context) {
    (void)context;
    measure_case(&(Case){"fold",
                         100,
                         false,
                         fold_start,
                         fold_move,
                         fold_measure,
                         fold_error,
                         0,  //
                         {36, 36, 3},
                         {{24, 24, 2},
                          {48, 48, 4},
                          {72, 72, 6},
                          {12, 12, 1},
                          {18, 18, 1},
                          {24, 24, 2},
                          {12, 12, 1},
                          {24, 24, 1},
                          {24, 24, 2}}});
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strip),
        cmocka_unit_test(test_lift),
        cmocka_unit_test(test_fold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
