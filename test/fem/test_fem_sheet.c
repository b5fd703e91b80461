// test_fem_sheet.c: a sheet of 120 x 120 x 8 mm of quadratic elements on a board, one half held: a patch is lifted, a
// corner is folded and released. One layer of 10 mm cells against two layers of 5 mm.
#include "test_sheet.h"

// ---- a patch is lifted --------------------------------------------------------------------------------

// Force on the patch at 20 mm and, if `nhigh` is 2, at 50 mm, N, under weight.
static void lift_from_board(const ElementKind* kind, int n, int layers, int nhigh,
                            double force[2]) {
    const int nmove = 30, nrest = nhigh == 2 ? 100 : 30;
    TestRig r;
    sheet_start(&r, kind, n, layers, OM_STABLE_NEO_HOOKEAN, false);
    size_t nvert = (size_t)element_nodes(&r)->nvert;
    unsigned char* is_patch = om_alloc(nvert, 1);
    double* f = om_alloc(3 * nvert, sizeof *f);
    int nbad = 0, nstep = 0;
    for (int high = 0; high < nhigh; ++high) {
        for (int k = 1; k <= nmove + nrest; ++k, ++nstep) {
            double share = fmin(1, (double)k / nmove);
            raise_patch(&r, high ? 0.02 + 0.03 * share : 0.02 * share, is_patch);
            OmStatus status =
                om_contact_step(r.cw, r.m, r.s, r.w, k > nmove + 10 ? 0.1 : STEP, NULL);
            if (status < 0) fail_msg("step %d: %s", nstep, om_error_message());
            nbad += status != OM_OK;
        }
        assert_ok(om_tissue_get_attachment_force(r.m, r.s, f));
        force[high] = 0;
        for (size_t i = 0; i < nvert; ++i)
            if (is_patch[i]) force[high] += f[3 * i + 2];
    }
    double speed = 0;
    for (size_t i = 0; i < 3 * nvert; ++i) speed = fmax(speed, fabs(om_tissue_v(r.s)[i]));
    printf("on a board, %s %dx%dx%d: %.4f N at %d mm; %d of %d steps not OM_OK, at last %.2g m/s\n",
           kind->name, n, n, layers, force[nhigh - 1], nhigh == 2 ? 50 : 20, nbad, nstep, speed);
    assert_int_equal(nbad, 0);
    assert_below(speed, 1e-3);
    om_free(is_patch), om_free(f);
    rig_done(&r);
}

static void test_lift_from_board(void** context) {
    (void)context;
    double coarse[2], shell[2], fine[2] = {0.8566, 3.6074};  // of 24x24x2 cells, held below
    int nhigh = test_count(1, 2);
    lift_from_board(&quadratic_element, 12, 1, nhigh, coarse);
    lift_from_board(&shell_element, 24, 1, nhigh, shell);
    if (test_is_slow()) {
        double force[2];
        lift_from_board(&quadratic_element, 24, 2, nhigh, force);
        for (int k = 0; k < 2; ++k) assert_near_rel(force[k], fine[k], 1e-3);
    }
    for (int k = 0; k < nhigh; ++k) {
        printf("lift to %d mm: %.4f N, %+.2f %%\n", k ? 50 : 20, coarse[k],
               100 * (coarse[k] / fine[k] - 1));
        assert_near_rel(coarse[k], fine[k], 0.03);
        printf("shells %+.2f %%\n", 100 * (shell[k] / fine[k] - 1));
        assert_near_rel(shell[k], fine[k], k ? 0.045 : 0.03);
    }
}

// ---- a corner is folded --------------------------------------------------------------------------------

static void fold_start(TestRig* r, const ElementKind* kind, int n, int layers, OmLaw law) {
    sheet_start(r, kind, n, layers, law, true);
    const OmTetMesh* mesh = element_nodes(r);
    int num = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    for (int i = 0; i < mesh->nvert; ++i)
        if (FOLD_U(om_load3(mesh->x, i)) < 1e-9) vert[num++] = i;
    assert_ok(om_tissue_set_attachment(r->m, r->s, num, vert, NULL, NULL));
    om_free(vert);
}

typedef struct Fold {
    TestRig r;
    int nstep, nbad, ninverted;
} Fold;

static void fold_step(Fold* f) {
    OmContactReport report;
    OmStatus status = om_contact_step(f->r.cw, f->r.m, f->r.s, f->r.w, STEP, &report);
    if (status < 0) fail_msg("step %d: %s", f->nstep, om_error_message());
    if (status != OM_OK) printf("step %d: %s\n", f->nstep, om_error_message());
    ++f->nstep;
    f->nbad += status != OM_OK;
    f->ninverted += report.tissue.ninverted;
}

static double corner_u(const Fold* f) { return FOLD_U(om_load3(om_tissue_x(f->r.s), 0)); }

// Released at the present state: does the corner come to rest on the held half?
static bool tips_over(Fold* f) {
    om_tissue_release(f->r.s, 0);
    for (int k = 0; k < 80; ++k) {
        fold_step(f);
        if (fabs(corner_u(f)) > 0.7 * FLAP) break;
    }
    return corner_u(f) < 0;
}

// The angle in (lo, hi], degrees, from which the corner tips over; the shape at rest after a release at 135 degrees.
static int fold(Fold* f, const ElementKind* kind, int n, int layers, int lo, int hi,
                double** shape) {
    fold_start(&f->r, kind, n, layers, OM_STABLE_NEO_HOOKEAN);
    size_t size = om_tissue_state_size(f->r.m);
    char* at = om_alloc(136 * size, 1);
    assert_ok(om_tissue_grasp(f->r.m, f->r.s, 0, fold_pose(0), 0.011, NULL));
    for (int k = 0; k <= 135; ++k) {
        if (k > 0) assert_ok(om_tissue_move_grasp(f->r.s, 0, fold_pose(k * OM_PI / 180)));
        fold_step(f);
        memcpy(at + (size_t)k * size, f->r.s, size);
    }
    // to the shape at rest
    for (int k = 0; k < 25; ++k) fold_step(f);
    om_tissue_release(f->r.s, 0);
    for (int k = 0; k < 120; ++k) fold_step(f);
    assert_true(corner_u(f) < 0);
    double speed = 0;
    size_t nvert = (size_t)element_nodes(&f->r)->nvert;
    for (size_t i = 0; i < 3 * nvert; ++i) speed = fmax(speed, fabs(om_tissue_v(f->r.s)[i]));
    *shape = om_alloc(3 * nvert, sizeof **shape);
    memcpy(*shape, om_tissue_x(f->r.s), 3 * nvert * sizeof **shape);
    for (int k = 0; k < 2; ++k) {
        memcpy(f->r.s, at + (size_t)(k ? hi : lo) * size, size);
        assert_int_equal(tips_over(f), k);
    }
    while (hi - lo > 1) {
        int mid = (lo + hi) / 2;
        memcpy(f->r.s, at + (size_t)mid * size, size);
        if (tips_over(f))
            hi = mid;
        else
            lo = mid;
    }
    printf(
        "fold, %s %dx%dx%d: tips over from %d degrees on; %d of %d steps not OM_OK, %d inverted; at "
        "rest %.2g m/s\n",
        kind->name, n, n, layers, hi, f->nbad, f->nstep, f->ninverted, speed);
    om_free(at);
    return hi;
}

static void test_fold(void** context) {
    (void)context;
    Fold f[3] = {0};
    double *shape[3], worst = 0, apart = 0;
    int angle[3];
    angle[0] = fold(&f[0], &quadratic_element, 12, 1, 0, 135, &shape[0]);
    angle[1] = fold(&f[1], &quadratic_element, 24, 2, angle[0] - 6, angle[0] + 5, &shape[1]);
    angle[2] = fold(&f[2], &shell_element, 24, 1, angle[0] - 10, angle[0] + 10, &shape[2]);
    // every node of the coarse mesh and of the shells is one of the fine mesh
    const OmTetMesh *coarse = element_nodes(&f[0].r), *fine = element_nodes(&f[1].r);
    for (int i = 0; i < coarse->nvert; ++i) {
        int j = 0;
        while (om_distance(om_load3(fine->x, j), om_load3(coarse->x, i)) > 1e-9) ++j;
        worst = fmax(worst, om_distance(om_load3(shape[0], i), om_load3(shape[1], j)));
    }
    const OmTetMesh* shells = element_nodes(&f[2].r);
    for (int i = 0; i < shells->nvert; ++i) {
        int j = 0;
        while (om_distance(om_load3(fine->x, j), om_load3(shells->x, i)) > 1e-9) ++j;
        apart = fmax(apart, om_distance(om_load3(shape[2], i), om_load3(shape[1], j)));
    }
    printf("fold: angles %d, %d, shells %d degrees, shapes at rest apart by %.2f, shells %.2f mm\n",
           angle[0], angle[1], angle[2], 1e3 * worst, 1e3 * apart);
    assert_near(angle[2], angle[1], 5);
    assert_below(apart, 0.002);
    assert_near(angle[0], angle[1], 5);
    // the goal of 2 mm is missed: cells of 10 mm are as long as the fold's radius (doc/notes/fem.md)
    assert_below(worst, 0.012);
    for (int k = 0; k < 3; ++k) {
        assert_int_equal(f[k].nbad, 0);
        om_free(shape[k]);
        rig_done(&f[k].r);
    }
}

// Folded over by 180 degrees in steps of 20 ms, neo-Hookean, whose energy is infinite at det F = 0.
static void fold_over(const ElementKind* kind, int n) {
    int nstep = test_count(45, 90);
    Fold f = {0};
    fold_start(&f.r, kind, n, 1, OM_NEO_HOOKEAN);
    assert_ok(om_tissue_grasp(f.r.m, f.r.s, 0, fold_pose(0), 0.011, NULL));
    for (int k = 1; k <= nstep + 10; ++k) {
        double share = fmin(1, (double)k / nstep);
        assert_ok(om_tissue_move_grasp(f.r.s, 0, fold_pose(share * OM_PI)));
        fold_step(&f);
    }
    printf("folded over, %s %dx%dx1: %d of %d steps not OM_OK, %d inverted\n", kind->name, n, n,
           f.nbad, f.nstep, f.ninverted);
    assert_below(corner_u(&f), -0.9 * FLAP);
    assert_int_equal(f.nbad, 0);
    assert_int_equal(f.ninverted, 0);
    rig_done(&f.r);
}

static void test_fold_over(void** context) {
    (void)context;
    fold_over(&quadratic_element, test_count(6, 12));
    fold_over(&shell_element, test_count(12, 24));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fold_over),
        cmocka_slow_test(test_fold),
        cmocka_unit_test(test_lift_from_board),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
