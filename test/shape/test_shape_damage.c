// Surfaces of known solids with random damage: holes, turned and doubled triangles, noise, folds, shells that overlap
// or lie in others. The mended solid has the volume and the surface of the undamaged one.
#include "shape_repair_common.h"

#include "omentum/shape_closest.h"

#define STEP 0.0025  // edges of the surfaces, m

enum {
    HOLES = 1,
    TURNED = 2,
    DOUBLED = 4,
    FLAT = 8,
    NOISE = 16,
    UNMERGED = 32,
    INSIDE_OUT = 64,
    OVERLAP = 128,
    NESTED = 256,
    FOLDED = 512,
    NDAMAGE = 10
};

// Remove the triangles around a random vertex.
static void cut_hole(OmSurface* s, OmRng* rng) {
    const OmVec3 p = om_load3(s->x, (int)om_rng_below(rng, (uint32_t)s->nvert));
    const double radius = om_rng_range(rng, 0.7, 1.1) * STEP;
    for (int t = s->ntri - 1; t >= 0; t--) {
        const int* v = s->tri_vert + 3 * t;
        OmVec3 sum =
            om_add(om_load3(s->x, v[0]), om_add(om_load3(s->x, v[1]), om_load3(s->x, v[2])));
        if (om_distance(om_scale(1.0 / 3, sum), p) < radius) remove_triangle(s, t);
    }
}

static void damage(OmSurface* s, unsigned kind, OmRng* rng) {
    const int ntri = s->ntri;
    if (kind & NOISE)
        for (int i = 0; i < 3 * s->nvert; i++) s->x[i] += om_rng_range(rng, -0.1, 0.1) * STEP;
    if (kind & FOLDED) {  // vertices pulled over their neighbours
        for (int i = 0; i < 3; i++) {
            double* x = s->x + 3 * om_rng_below(rng, (uint32_t)s->nvert);
            for (int c = 0; c < 3; c++) x[c] += om_rng_range(rng, -1.5, 1.5) * STEP;
        }
    }
    if (kind & HOLES)
        for (int i = 0; i < 3; i++) cut_hole(s, rng);
    if (kind & TURNED)
        for (int i = 0; i < ntri / 40; i++) turn(s, (int)om_rng_below(rng, (uint32_t)s->ntri));
    if (kind & (DOUBLED | FLAT)) {
        OmSurface more;
        const int num = ntri / 60;
        assert_ok(om_surface_init(&more, 0, num));
        append(s, &more);
        for (int t = s->ntri - num; t < s->ntri; t++) {
            int* v = s->tri_vert + 3 * t;
            memcpy(v, s->tri_vert + 3 * om_rng_below(rng, (uint32_t)(s->ntri - num)),
                   3 * sizeof *v);
            if (!(kind & DOUBLED) || (kind & FLAT && t % 2))
                v[1] = v[0];
            else if (t % 3 == 0)
                turn(s, t);
        }
    }
    if (kind & INSIDE_OUT) turn_all(s);
    if (kind & UNMERGED) unmerge(s, 1e-8, rng);
}

static void random_balls(Ball ball[4], int* nball, OmRng* rng) {
    *nball = 1 + (int)om_rng_below(rng, 4);
    for (int i = 0; i < *nball; i++) {
        OmVec3 d = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
        ball[i].radius = om_rng_range(rng, 0.012, 0.02);
        ball[i].center = om_vec3(0, 0, 0);
        if (i > 0) {
            const double reach = ball[0].radius + om_rng_range(rng, -0.3, 0.6) * ball[i].radius;
            ball[i].center = om_scale(reach, om_normalize(d));
        }
    }
}

// The surface of the balls; with OVERLAP one shell a ball, with NESTED a shell in the first one.
static void make_shells(const Ball* ball, int nball, unsigned kind, OmSurface* s) {
    OmSurface b;
    make_balls(ball, kind & OVERLAP ? 1 : nball, STEP, s);
    for (int i = 1; i < nball && kind & OVERLAP; i++) {
        make_balls(ball + i, 1, STEP, &b);
        append(s, &b);
    }
    if (!(kind & NESTED)) return;
    const Ball inner = {ball[0].center, 0.5 * ball[0].radius};
    make_balls(&inner, 1, STEP, &b);
    append(s, &b);
}

// The distance to a surface below which 95 % of the vertices of another one are.
static double distance_95(const OmSurface* from, const OmSurface* to) {
    OmSurfaceTree* tree;
    OmSurfacePoint q;
    assert_ok(om_surface_tree_create(to, &tree));
    double* d = malloc((size_t)from->nvert * sizeof *d);
    for (int v = 0; v < from->nvert; v++) {
        assert_true(om_surface_tree_find(tree, om_load3(from->x, v), NULL, INFINITY, &q));
        d[v] = q.distance;
    }
    om_sort_doubles(d, from->nvert);
    double value = om_quantile(d, from->nvert, 0.95);
    free(d);
    om_surface_tree_destroy(tree);
    return value;
}

static void contour_of(const OmSurface* s, OmSurface* contour) {
    OmSdf sdf;
    const OmSdfDef def = om_sdf_default_def((test_is_slow() ? 0.5 : 0.75) * STEP);
    assert_ok(om_sdf_from_surface(s, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, contour));
    om_sdf_done(&sdf);
}

static void test_damaged_surfaces(void** unused) {
    (void)unused;
    double most[3] = {0};
    int nrefused = 0;
    const int nsample = test_count(12, 300);
    for (int k = 0; k < nsample; k++) {
        OmRng rng = om_rng_init(17, (uint64_t)k);
        Ball ball[4];
        OmSurface whole, s, a, b;
        OmSurfaceRepair r;
        int nball;
        random_balls(ball, &nball, &rng);
        // each kind alone, then random sets of kinds
        const unsigned kind = k < NDAMAGE ? 1u << k : om_rng_below(&rng, 1u << NDAMAGE);
        make_balls(ball, nball, STEP, &whole);
        make_shells(ball, nball, kind, &s);
        damage(&s, kind, &rng);
        OmSurfaceRepairDef def = om_surface_repair_default_def();
        if (om_surface_repair(&def, &s, &r) < 0) {  // a large hole, or much at once: --repair
            if (k < NDAMAGE) fail_msg("sample %d, damage %x: %s", k, kind, om_error_message());
            nrefused++;
            def.mode = OM_REPAIR_ALL;
            assert_ok(om_surface_repair(&def, &s, &r));
        }
        contour_of(&whole, &a);
        contour_of(&s, &b);
        const double measure[3] = {fabs(om_surface_volume(&b) / om_surface_volume(&a) - 1),
                                   fabs(r.volume / om_surface_volume(&whole) - 1),
                                   fmax(distance_95(&b, &whole), distance_95(&whole, &b)) / STEP};
        const double bound[3] = {0.01, 0.01, 0.5};
        for (int i = 0; i < 3; i++) {
            if (measure[i] > bound[i])
                fail_msg(
                    "sample %d, %d balls, damage %x: volume off by %.2g, of the repair %.2g, 95 %% of "
                    "distances below %.2g edges",
                    k, nball, kind, measure[0], measure[1], measure[2]);
            most[i] = fmax(most[i], measure[i]);
        }
        om_surface_done(&whole);
        om_surface_done(&s);
        om_surface_done(&a);
        om_surface_done(&b);
    }
    assert_true(nrefused <= nsample / 10);
    printf(
        "%d surfaces, %d of them by --repair: volume off by at most %.2g, of the repair %.2g, 95 %% of "
        "distances below %.2g edges\n",
        nsample, nrefused, most[0], most[1], most[2]);
}

int main(void) {
    const struct CMUnitTest test[] = {cmocka_unit_test(test_damaged_surfaces)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
