// test_study_phantoms_case.c: phantoms: outlines, holes, regions, grasps, capsule, sites, a lift in the world.
#include "studies/study_phantoms_case.h"

#include <math.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "test_files.h"

#define NALL (PHANTOM_NSHAPE + PHANTOM_NDEV)

static char dir[] = "/tmp/om_phantoms_XXXXXX";

// ---- outlines -----------------------------------------------------------------------------------------------

// Area of an outline on a grid of 0.5 mm, m^2.
static double area_of(int shape) {
    const double h = 0.0005;
    double area = 0;
    for (double x = -0.0722; x < 0.0722; x += h)
        for (double y = -0.0722; y < 0.0722; y += h)
            area += om__phantoms_outline(shape, x, y) < 0 ? h * h : 0;
    return area;
}

// Areas by formula, thicknesses of the thesis; every outline lies on the board of 144 x 144 mm.
static void test_outlines(void** unused) {
    (void)unused;
    const double r0 = 0.044, r1 = 0.008, length = 0.064, lean = (r0 - r1) / length;
    // two sectors and two trapezoids between the points of tangency
    double drop = r0 * r0 * (OM_PI / 2 + asin(lean)) + r1 * r1 * (OM_PI / 2 - asin(lean)) +
                  (r0 + r1) * length * sqrt(1 - lean * lean);
    // four discs less their four common lenses; the disc of the middle adds nothing but the gap between them
    double d = 0.030 * sqrt(2), r = 0.029;
    double lens = 2 * r * r * acos(d / (2 * r)) - 0.5 * d * sqrt(4 * r * r - d * d);
    double clover = 4 * OM_PI * r * r - 4 * lens;
    const double area[NALL] = {OM_PI * 0.058 * 0.058, clover,
                               0.120 * 0.084,         drop,
                               OM_PI * 0.058 * 0.042, 0.1 * 0.1 - 0.024 * 0.034};
    const double thick[PHANTOM_NSHAPE] = {0.006, 0.006, 0.005, 0.012};
    for (int s = 0; s < NALL; ++s) {
        if (s < PHANTOM_NSHAPE) assert_near(om__phantoms_shape[s].thickness, thick[s], 1e-12);
        assert_near(area_of(s) / area[s], 1, 0.003);
        for (int k = 0; k < 360; ++k) {
            double u = cos(k * OM_PI / 180), v = sin(k * OM_PI / 180);
            double edge = 0.072 / fmax(fabs(u), fabs(v));
            assert_true(om__phantoms_outline(s, edge * u, edge * v) > 0.002);
        }
    }
    assert_near(om__phantoms_hole(0, 6).x, -0.054, 1e-12);
    assert_near(om__phantoms_hole(0, 6).y, 0.054, 1e-12);
}

// Distances to a square, to a bar and to a triangle of holes by hand; a stitch holds 6 mm around.
static void test_regions(void** unused) {
    (void)unused;
    const PhantomSet square = {1, {4}, {{{2, 2}, {4, 2}, {2, 4}, {4, 4}}}};
    const PhantomSet bar = {1, {2}, {{{3, 1}, {3, 5}}}};
    const PhantomSet triangle = {1, {3}, {{{2, 2}, {4, 2}, {2, 4}}}};
    assert_near(om__phantoms_region(&square, 0.001, 0.002), -0.006, 1e-12);
    assert_near(om__phantoms_region(&square, 0.030, 0), 0.006, 1e-12);
    assert_near(om__phantoms_region(&square, 0.022, 0.021), 0.005 - 0.006, 1e-12);
    assert_near(om__phantoms_region(&bar, 0.010, 0.030), 0.004, 1e-12);
    assert_near(om__phantoms_region(&bar, 0, 0.046), 0.004, 1e-12);
    assert_near(om__phantoms_region(&triangle, 0.009, 0.009), 0.009 * sqrt(2) - 0.006, 1e-12);
    assert_near(om__phantoms_region(&triangle, -0.010, -0.010), -0.006, 1e-12);
}

// Stitches lie inside the outline, two regions apart from each other, and no two sets are equal.
static void test_sets(void** unused) {
    (void)unused;
    int ntwo[NALL] = {0};
    for (int s = 0; s < NALL; ++s)
        for (int k = 0; k < PHANTOM_NSET; ++k) {
            const PhantomSet* set = &om__phantoms_set[s][k];
            assert_true(set->nregion == 1 || set->nregion == 2);
            for (int r = 0; r < set->nregion; ++r) {
                assert_true(set->nhole[r] >= 1 && set->nhole[r] <= 8);
                PhantomSet other = *set;
                memcpy(other.hole[0], set->hole[1 - r], sizeof other.hole[0]);
                other.nhole[0] = set->nhole[1 - r];
                other.nregion = 1;
                for (int i = 0; i < set->nhole[r]; ++i) {
                    const int* h = set->hole[r][i];
                    assert_true(h[0] >= 0 && h[0] < PHANTOM_NHOLE && h[1] >= 0);
                    OmVec3 p = om__phantoms_hole(h[0], h[1]);
                    assert_true(om__phantoms_outline(s, p.x, p.y) < 0);
                    if (set->nregion == 2)
                        assert_true(om__phantoms_region(&other, p.x, p.y) > 0.012);
                }
            }
            ntwo[s] += set->nregion == 2;
            for (int j = 0; j < k; ++j)
                assert_true(memcmp(set, &om__phantoms_set[s][j], sizeof *set) != 0);
        }
    assert_int_equal(ntwo[0], 1);  // circle
    assert_int_equal(ntwo[1], 1);  // clover
    assert_int_equal(ntwo[2] + ntwo[3], 0);
}

// ---- cases --------------------------------------------------------------------------------------------------

static void check_grasps(const PhantomCase* c, int* nacquisition) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    for (int g = 0; g < c->ngrasp; ++g) {
        OmVec3 p = c->grasp[g], up = c->lift[g];
        double height = om__phantoms_height(c, p.x, p.y);
        assert_near(p.z, om__phantoms_shape[c->shape].thickness + height, 1e-12);
        assert_true(om__phantoms_outline(c->shape, p.x, p.y) < -0.004);
        assert_true(om__phantoms_region(set, p.x, p.y) >= 0.026);
        for (int k = 0; k < g; ++k)
            assert_true(hypot(p.x - c->grasp[k].x, p.y - c->grasp[k].y) >= 0.025);
        // Up, and towards the stitches: a step of the lift comes nearer to them.
        assert_near(up.z, 1, 1e-12);
        assert_near(atan(hypot(up.x, up.y)) * 180 / OM_PI, 30, 1e-9);
        double near = om__phantoms_region(set, p.x, p.y);
        double nearer = om__phantoms_region(set, p.x + 0.01 * up.x, p.y + 0.01 * up.y);
        assert_near(near - nearer, 0.01 * tan(OM_PI / 6), 1e-9);
        // One step more would stretch the free length by more than a tenth, or exceed 60 mm.
        double free_length = near + 0.006, h = 0.01 * (c->nlevel[g] + 1);
        double next = hypot(h, free_length - h * tan(OM_PI / 6));
        assert_true(c->nlevel[g] >= 2 && c->nlevel[g] <= PHANTOM_NLEVEL);
        assert_true(c->nlevel[g] == PHANTOM_NLEVEL || next > 1.1 * free_length);
        if (c->shape < PHANTOM_NSHAPE) *nacquisition += c->nlevel[g];
    }
}

// The capsule is under the phantom, not under a region, and the phantom does not enter it.
static void check_capsule(const PhantomCase* c) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    assert_true(om__phantoms_outline(c->shape, c->capsule.x, c->capsule.y) <= -0.015);
    assert_true(om__phantoms_region(set, c->capsule.x, c->capsule.y) >= c->reach - 1e-12);
    assert_true(c->reach > 0.018);
    for (double x = -0.06; x <= 0.06; x += 0.0013)
        for (double y = -0.06; y <= 0.06; y += 0.0013) {
            double q = hypot(x - c->capsule.x, y - c->capsule.y) / 0.014;
            double capsule = q < 1 ? 0.010 * sqrt(1 - q * q) : 0;
            double h = om__phantoms_height(c, x, y);
            if (om__phantoms_region(set, x, y) <= 0) assert_near(h, 0, 1e-12);
            // The steepest bump cuts the capsule's foot by less than a millimetre; contact then lifts it.
            assert_true(h >= capsule - (c->reach < 0.029 ? 0.0042 : 0.001));
        }
}

static void test_cases(void** unused) {
    (void)unused;
    int nacquisition = 0;
    uint64_t last = 0;
    for (int s = 0; s < NALL; ++s)
        for (int k = 0; k < PHANTOM_NSET; ++k)
            for (int start = 0; start < PHANTOM_NSTART; ++start) {
                PhantomCase c = om__phantoms_case(s, k, (PhantomStart)start);
                assert_true(c.ngrasp >= (s < PHANTOM_NSHAPE ? 3 : 2) && c.ngrasp <= 4);
                check_grasps(&c, &nacquisition);
                if (c.start == PHANTOM_CAPSULE) check_capsule(&c);
                for (int g = 0; g < PHANTOM_NGRASP; ++g) {
                    uint64_t seed = om__phantoms_seed(&c, g);
                    assert_true(seed > last);
                    last = seed;
                }
            }
    assert_true(nacquisition >= 345);
}

// ---- sites --------------------------------------------------------------------------------------------------

static double held_share(const PhantomCase* c, const OmSite* site) {
    unsigned char* held = malloc((size_t)site->mesh.nvert);
    om__phantoms_held(c, site, held);
    int n = 0;
    for (int i = 0; i < site->mesh.nvert; ++i) n += held[i];
    free(held);
    return n / (double)om_tet_mesh_find_set(&site->mesh, "underside")->nvert;
}

// Volume of the shape; world with twice the vertices; the truth covers the same share of both undersides.
static void check_site(const PhantomCase* c) {
    OmScene scene[2] = {om__phantoms_scene(c, OM_SITE_TWIN), om__phantoms_scene(c, OM_SITE_WORLD)};
    OmSite twin, world;
    assert_ok(om__phantoms_site(c, OM_SITE_TWIN, 1, &scene[0], &twin));
    assert_ok(om__phantoms_site(c, OM_SITE_WORLD, 1, &scene[1], &world));
    assert_true(scene[0].tissue.law != scene[1].tissue.law);
    assert_near(world.young / twin.young, 0.85, 1e-12);
    assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert);
    double volume = area_of(c->shape) * om__phantoms_shape[c->shape].thickness;
    assert_true(om_tet_mesh_volume(&twin.mesh) > 0.94 * volume);
    assert_true(om_tet_mesh_volume(&world.mesh) > 0.96 * volume);
    assert_true(om_tet_mesh_volume(&world.mesh) < 1.001 * volume);
    assert_int_equal(om_tet_mesh_find_set(&twin.mesh, "attachment")->nvert, 0);
    const OmMeshSet* held = om_tet_mesh_find_set(&world.mesh, "attachment");
    double share = held_share(c, &world);
    assert_near(held->nvert / (double)om_tet_mesh_find_set(&world.mesh, "underside")->nvert, share,
                1e-12);
    assert_near(held_share(c, &twin), share, 0.04);
    assert_true(share > 0.08 && share < 0.40);
    // All vertices are on one side of board and capsule, the held ones on the board.
    for (int i = 0; i < world.mesh.nvert; ++i) {
        OmVec3 p = om_load3(world.mesh.x, i);
        assert_true(p.z > -1e-4);  // cuts of the mesher
        if (c->start == PHANTOM_CAPSULE)
            assert_true(om_sdf_eval(&world.organ_sdf, p, NULL) > -0.0035);
    }
    for (int i = 0; i < held->nvert; ++i) assert_near(world.mesh.x[3 * held->vert[i] + 2], 0, 1e-4);
    om_site_done(&twin);
    om_site_done(&world);
}

static void test_sites(void** unused) {
    (void)unused;
    for (int s = 0; s < NALL; ++s) {
        PhantomCase flat = om__phantoms_case(s, s % PHANTOM_NSET, PHANTOM_FLAT);
        PhantomCase raised = om__phantoms_case(s, s % PHANTOM_NSET, PHANTOM_CAPSULE);
        check_site(&flat);
        check_site(&raised);
    }
}

// ---- a lift ---------------------------------------------------------------------------------------------------

// A coarse lift of a development shape: each step raises the grasped tissue by 10 mm, the stitches hold, the file gives
// the same bytes, and the camera is 1 mm away from where the robot believes it.
static void test_lift(void** unused) {
    (void)unused;
    PhantomCase c = om__phantoms_case(4, 2, PHANTOM_FLAT);
    PhantomTruth a, b;
    bool is_there;
    assert_ok(om__phantoms_truth_open(&c, 1, 2, dir, &is_there, &a));
    assert_false(is_there);
    assert_ok(om__phantoms_truth_make(&c, 1, 1, &a));
    assert_ok(om__phantoms_truth_save(&a, dir));
    assert_int_equal(a.head->nlevel, c.nlevel[1]);
    const OmMeshSet* held = om_tet_mesh_find_set(&a.site.mesh, "attachment");
    size_t n3 = 3 * (size_t)a.mesh.nvert;
    for (int k = 0; k <= a.head->nlevel; ++k) {
        const double* x = a.x + (size_t)k * n3;
        double top = 0;
        for (int i = 0; i < a.mesh.nvert; ++i) top = fmax(top, x[3 * i + 2]);
        double rise = a.head->at[k].arm[a.head->arm].tip.p.z - a.head->grasp_tip.p.z;
        if (k > 0) assert_near(rise, 0.01 * k, 2e-4);
        assert_near(top, 0.006 + 0.01 * k, 0.003);
        for (int i = 0; i < held->nvert; ++i)
            assert_near(
                om_distance(om_load3(x, held->vert[i]), om_load3(a.site.mesh.x, held->vert[i])), 0,
                1e-9);
    }
    assert_true(a.head->at[a.head->nlevel].force > 0.2 && a.head->at[a.head->nlevel].force < 4);
    OmVec3 eye = om_vec3(a.scene.rgbd.distance * cos(a.scene.rgbd.elevation), 0,
                         a.scene.rgbd.distance * sin(a.scene.rgbd.elevation));
    assert_near(om_distance(a.head->camera.pose_world_camera.p, eye), 0.001, 1e-9);
    assert_near(om_norm(a.head->shift), 0.001, 1e-12);
    assert_ok(om__phantoms_truth_open(&c, 1, 2, dir, &is_there, &b));
    assert_true(is_there);
    assert_memory_equal(a.x, b.x, (1 + PHANTOM_NLEVEL) * n3 * sizeof *a.x);
    om__phantoms_truth_done(&b);
    // The same bytes once more. Another grasp, another seed or another mesh is not in the folder.
    if (test_is_slow()) {
        char other[] = "/tmp/om_phantoms_other_XXXXXX";
        assert_non_null(mkdtemp(other));
        assert_ok(om__phantoms_truth_open(&c, 1, 2, other, &is_there, &b));
        assert_false(is_there);
        assert_ok(om__phantoms_truth_make(&c, 1, 1, &b));
        assert_memory_equal(a.x, b.x, (1 + PHANTOM_NLEVEL) * n3 * sizeof *a.x);
        assert_memory_equal(a.depth, b.depth, (1 + PHANTOM_NLEVEL) * a.npixel * sizeof *a.depth);
        om__phantoms_truth_done(&b);
        assert_ok(om_path_remove(other));
    }
    assert_ok(om__phantoms_truth_open(&c, 0, 2, dir, &is_there, &b));
    assert_false(is_there);
    om__phantoms_truth_done(&b);
    assert_ok(om__phantoms_truth_open(&c, 1, 1.9, dir, &is_there, &b));
    assert_false(is_there);
    om__phantoms_truth_done(&b);
    OmObservation obs;
    assert_ok(om__phantoms_observe(&a, 1, &obs));
    assert_memory_equal(obs.rgbd.depth, a.depth + a.npixel, a.npixel * sizeof *a.depth);
    assert_near(obs.time, a.head->at[1].time, 0);
    om_observation_done(&obs);
    om__phantoms_truth_done(&a);
}

static int begin(void** unused) {
    (void)unused;
    return mkdtemp(dir) ? 0 : 1;
}

static int end(void** unused) {
    (void)unused;
    return om_path_remove(dir) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_outlines), cmocka_unit_test(test_regions),
        cmocka_unit_test(test_sets),     cmocka_unit_test(test_cases),
        cmocka_unit_test(test_sites),    cmocka_unit_test(test_lift),
    };
    return cmocka_run_group_tests(test, begin, end);
}
