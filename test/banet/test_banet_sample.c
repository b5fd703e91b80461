// test_banet_sample.c: random samples: balance of forces, ranges, and the same bytes from (seed, index) alone.
#include "omentum/banet_grid.h"
#include "omentum/banet_sample.h"
#include "omentum/shape_meshing.h"
#include "test_alloc.h"

#define assert_in_range_double(v, lo, hi)                                                 \
    do {                                                                                  \
        double value_ = (v);                                                              \
        if (!(value_ >= (lo) && value_ <= (hi)))                                          \
            fail_msg("%s = %g, not in %g .. %g", #v, value_, (double)(lo), (double)(hi)); \
    } while (0)

// Small bodies that cost tens of milliseconds, way (a).
static OmBanetSampleDef small_def(uint64_t seed) {
    OmBanetSampleDef def = om_banet_sample_default_def(seed);
    def.way = OM_BANET_EXACT;
    def.extent[1] = 0.08;
    def.thickness[1] = 0.01;
    return def;
}

// The smallest bodies, for cases about draws and bytes.
static OmBanetSampleDef tiny_def(uint64_t seed) {
    OmBanetSampleDef def = small_def(seed);
    def.extent[0] = 0.04;
    def.extent[1] = 0.05;
    return def;
}

static void test_def(void** state) {
    (void)state;
    OmBanetSampleDef def = om_banet_sample_default_def(1);
    assert_ok(om_banet_sample_def_validate(&def));
    def.share[0] = 0.6;
    assert_int_equal(om_banet_sample_def_validate(&def), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "share[0]"));
    def = (OmBanetSampleDef){0};
    OmBanetSample sample;
    assert_int_equal(om_banet_sample_make(&def, 0, &sample), OM_INVALID);
}

// Forces of the elements at the equilibrium: the pull on grasped vertices, gravity and an upward push where the body
// touches the board, anything on attached ones.
static void check_balance(const OmBanetSample* s, double tolerance) {
    OmFemMesh mesh;
    OmFemSolid* solid;
    OmVec3 pull = {0, 0, 0}, held = {0, 0, 0};
    int ngrasped = 0;
    double left = 0, scale = om_norm(s->force), weight = 0, push = 0;
    assert_ok(om_fem_mesh_from_nodes(&s->mesh, s->node, &mesh));
    memcpy(mesh.x, s->rest, 3 * (size_t)mesh.nnode * sizeof *mesh.x);
    OmFemDef def = om_fem_default_def(&mesh, 1, &s->material);
    assert_ok(om_fem_create(&def, &solid));
    double* f = om_alloc(3 * (size_t)mesh.nnode, sizeof *f);
    assert_ok(om_fem_eval_force(solid, s->x, f, NULL));
    assert_true(om_fem_eval_volume(solid, s->x, NULL) > 0);
    for (int i = 0; i < mesh.nnode && s->has_board; ++i) {
        f[3 * i + 2] += 9.81 * om_fem_mass(solid)[i];
        weight += 9.81 * om_fem_mass(solid)[i];
    }
    for (int i = 0; i < s->surface.nvert; ++i) ngrasped += s->grasped[i];
    for (int i = 0; i < s->surface.nvert; ++i) {
        int v = s->surface_vert[i];
        OmVec3 here = om_load3(f, v);
        if (s->attached[i]) {
            assert_true(om_distance(om_load3(s->x, v), om_load3(s->mesh.x, v)) == 0);
            assert_true(om_distance(om_load3(s->x, v), om_load3(s->rest, v)) == 0);
            held = om_add(held, here);
            here = om_vec3(0, 0, 0);
        }
        if (s->grasped[i]) {
            assert_false(s->attached[i]);
            pull = om_add(pull, here);
            here = om_sub(here, om_scale(1.0 / ngrasped, s->force));
        }
        if (s->has_board && s->x[3 * v + 2] < s->board && !s->attached[i]) {
            assert_true(here.z >= -tolerance * (scale + weight));
            push += here.z;
            here.z = 0;
        }
        om_store3(f, v, here);
    }
    for (int i = 0; i < 3 * mesh.nnode; ++i) left += f[i] * f[i];
    // reactions and weight are part of the scale of the solve
    scale += weight + om_norm(held);
    assert_true(sqrt(left) <= 2 * tolerance * scale);
    if (!s->has_board) {
        assert_true(om_distance(pull, s->force) <= 2 * sqrt(ngrasped) * tolerance * scale);
        assert_true(om_norm(om_add(held, s->force)) <= 0.05 * scale);
    } else {
        assert_true(fabs(held.z + push + s->force.z - weight) <= 0.05 * scale);
    }
    om_free(f);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
}

// The grasp is all free vertices within a radius of its centre, and pulls outward.
static void check_grasp(const OmBanetSampleDef* def, const OmBanetSample* s) {
    double* normal = om_alloc(3 * (size_t)s->surface.nvert, sizeof *normal);
    OmSurface rest = s->surface;
    double farthest = 0, nearest = INFINITY;
    rest.x = om_alloc(3 * (size_t)rest.nvert, sizeof *rest.x);
    for (int i = 0; i < rest.nvert; ++i)
        om_store3(rest.x, i, om_load3(s->rest, s->surface_vert[i]));
    om_surface_normals(&rest, normal);
    for (int i = 0; i < rest.nvert; ++i) {
        double d = om_distance(om_load3(rest.x, i), om_load3(rest.x, s->center));
        if (s->grasped[i]) farthest = fmax(farthest, d);
        if (!s->grasped[i] && !s->attached[i]) nearest = fmin(nearest, d);
    }
    assert_true(s->grasped[s->center]);
    assert_true(farthest <= def->radius[1] && nearest >= def->radius[0] && farthest < nearest);
    assert_true(om_dot(s->force, om_load3(normal, s->center)) >= 0);
    om_free(normal);
    om_free(rest.x);
}

static void check_ranges(const OmBanetSampleDef* def, const OmBanetSample* s) {
    double half = 0.5 / s->surface.nvert, largest = 0;
    int nseen = 0;
    assert_in_range_double(s->share, def->share[0] - half, def->share[1] + half);
    assert_in_range_double(s->visible, def->visible[0] - half, def->visible[1] + half);
    assert_in_range_double(s->material.young, def->young[0], def->young[1]);
    assert_in_range_double(s->material.poisson, def->poisson[0], def->poisson[1]);
    for (int i = 0; i < s->surface.nvert; ++i) {
        OmVec3 a = om_load3(s->mesh.x, s->surface_vert[i]), b = om_load3(s->x, s->surface_vert[i]);
        OmVec3 u = s->seen[i] > 0 ? om_sub(b, a) : om_vec3(0, 0, 0);
        assert_true(om_distance(u, om_load3(s->u, i)) == 0);
        assert_true(om_distance(a, om_load3(s->surface.x, i)) == 0);
        assert_true(s->seen[i] == 0 || s->seen[i] == 1);
        largest = fmax(largest, om_distance(a, b));
        nseen += s->seen[i] > 0;
    }
    assert_true(fabs(s->visible * s->surface.nvert - nseen) < 1e-6);
    // a vertex inside the body moves at most a little more than the surface
    assert_in_range_double(s->max_u, largest, 1.1 * largest);
    assert_true(s->max_u <= def->max_u && s->min_volume >= def->min_volume);
}

static void check_mesh(const OmBanetSampleDef* def, const OmBanetSample* s) {
    OmMeshQuality q;
    OmBanetGrid grid;
    double voxel = def->side / OM_BANET_SIDE_CELL;
    assert_ok(om_tet_mesh_validate(&s->mesh));
    assert_ok(om_tet_mesh_quality(&s->mesh, &q));
    assert_int_equal(q.npart, 1);
    assert_in_range_double(q.edge_mean, 0.85 * voxel, 1.1 * voxel);
    assert_ok(om_banet_grid_fit(&s->surface, def->side, &grid));
    for (int c = 0; c < 3; ++c) assert_true(grid.dim[c] <= def->max_dim[c]);
}

static void test_samples(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(11);
    for (int k = test_count(4, 0); k < 6; ++k) {
        def.element = k % 2 ? OM_TET10 : OM_TET4;
        def.law = k == 5 ? OM_ST_VENANT_KIRCHHOFF : OM_NEO_HOOKEAN;
        def.two_share = k % 2;
        OmBanetSample s;
        assert_ok(om_banet_sample_make(&def, k, &s));
        assert_int_equal(s.nregion, 1 + k % 2);
        check_mesh(&def, &s);
        check_ranges(&def, &s);
        check_grasp(&def, &s);
        check_balance(&s, def.tolerance);
        om_banet_sample_done(&s);
    }
}

// A ball of 30 mm on a body of 50 mm reaches attached vertices: these are not grasped.
static void test_wide_grasp(void** state) {
    (void)state;
    OmBanetSampleDef def = tiny_def(21);
    def.radius[0] = 0.03;
    def.radius[1] = 0.035;
    OmBanetSample s;
    int nshared = 0, nnear = 0;
    assert_ok(om_banet_sample_make(&def, 0, &s));
    for (int i = 0; i < s.surface.nvert; ++i) {
        nshared += s.attached[i] && s.grasped[i];
        nnear += s.attached[i] && om_distance(om_load3(s.rest, s.surface_vert[i]),
                                              om_load3(s.rest, s.surface_vert[s.center])) < 0.03;
    }
    assert_int_equal(nshared, 0);
    assert_true(nnear > 0);
    om_banet_sample_done(&s);
}

// Number of connected parts of the attached vertices of a surface that have at least three vertices.
static int count_regions(const OmBanetSample* s) {
    const OmSurface* f = &s->surface;
    int* root = om_alloc((size_t)f->nvert, sizeof *root);
    int *size = om_calloc((size_t)f->nvert, sizeof *size), num = 0;
    for (int i = 0; i < f->nvert; ++i) root[i] = i;
    for (bool is_changed = true; is_changed;) {
        is_changed = false;
        for (int t = 0; t < 3 * f->ntri; ++t) {
            int a = f->tri_vert[t], b = f->tri_vert[t % 3 == 2 ? t - 2 : t + 1];
            if (!s->attached[a] || !s->attached[b] || root[a] == root[b]) continue;
            root[a] = root[b] = root[a] < root[b] ? root[a] : root[b];
            is_changed = true;
        }
    }
    for (int i = 0; i < f->nvert; ++i) size[root[i]] += s->attached[i];
    for (int i = 0; i < f->nvert; ++i) num += size[i] >= 3;
    om_free(root);
    om_free(size);
    return num;
}

// Bodies that need a larger box are drawn again.
static void test_box(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(20);
    def.extent[0] = 0.04;
    def.max_dim[0] = def.max_dim[1] = 16;
    int nattempt = 0;
    for (int k = 0; k < test_count(1, 2); ++k) {
        OmBanetSample s;
        assert_ok(om_banet_sample_make(&def, k, &s));
        check_mesh(&def, &s);
        nattempt += s.nattempt - 1 - s.nfail;
        om_banet_sample_done(&s);
    }
    assert_true(nattempt > 0);
}

static void test_two_regions(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(12);
    def.two_share = 1;
    for (int k = test_count(3, 0); k < 4; ++k) {
        OmBanetSample s;
        assert_ok(om_banet_sample_make(&def, k, &s));
        assert_true(count_regions(&s) >= 2);
        om_banet_sample_done(&s);
    }
}

// On a board: the settled body does not go through it, and the board carries what the attachments do not.
static void test_board(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(13);
    def.board_share = 1;
    for (int k = 0; k < test_count(1, 3); ++k) {
        OmBanetSample s;
        assert_ok(om_banet_sample_make(&def, k, &s));
        assert_true(s.has_board);
        double below = 0, pressed = 0, moved = 0;
        for (int i = 0; i < s.mesh.nvert; ++i) {
            below = fmax(below, s.board - s.mesh.x[3 * i + 2]);
            pressed = fmax(pressed, s.board - s.x[3 * i + 2]);
            moved = fmax(moved, om_distance(om_load3(s.rest, i), om_load3(s.mesh.x, i)));
        }
        assert_true(below < 0.0005 && pressed < 0.002);
        assert_true(moved > 1e-6);
        check_ranges(&def, &s);
        check_grasp(&def, &s);
        check_balance(&s, def.tolerance);
        om_banet_sample_done(&s);
    }
}

static uint64_t hash_sample(const OmBanetSampleDef* def, int64_t index) {
    OmBanetSample s;
    assert_ok(om_banet_sample_make(def, index, &s));
    size_t n = (size_t)s.surface.nvert;
    uint64_t h = om_hash(s.x, 3 * (size_t)s.mesh.nvert * sizeof *s.x, OM_HASH_SEED);
    h = om_hash(s.attached, n, h);
    h = om_hash(s.u, 3 * n * sizeof *s.u, h);
    h = om_hash(s.seen, n * sizeof *s.seen, h);
    om_banet_sample_done(&s);
    return h;
}

static void test_same_bytes(void** state) {
    (void)state;
    OmBanetSampleDef def = tiny_def(14);
    uint64_t alone = hash_sample(&def, 3);
    assert_true(hash_sample(&def, 2) != alone);
    assert_true(hash_sample(&def, 3) == alone);
    def.seed = 15;
    assert_true(hash_sample(&def, 3) != alone);
}

// Both ways come from the same bodies: only what is known of the sample differs.
static void test_camera(void** state) {
    (void)state;
    OmBanetSampleDef def = tiny_def(16);
    int ncamera = 0;
    const int num = test_count(1, 2);
    for (int k = 0; k < num; ++k) {
        OmBanetSample a, b;
        def.way = OM_BANET_EXACT;
        assert_ok(om_banet_sample_make(&def, k, &a));
        def.way = OM_BANET_CAMERA;
        assert_ok(om_banet_sample_make(&def, k, &b));
        ncamera += b.is_camera - a.is_camera;
        if (a.nattempt == b.nattempt) {
            assert_int_equal(a.mesh.nvert, b.mesh.nvert);
            assert_memory_equal(a.x, b.x, 3 * (size_t)a.mesh.nvert * sizeof *a.x);
        }
        assert_true(b.visible > 0);
        om_banet_sample_done(&a);
        om_banet_sample_done(&b);
    }
    assert_int_equal(ncamera, num);
}

// All samples of one body have its mesh.
static void test_one_body(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(18);
    OmTetMesh boxes[2];
    OmVec3 lo = om_vec3(0, 0, 0), hi = om_vec3(0.06, 0.05, 0.01);
    assert_ok(om_tet_mesh_box(lo, hi, 12, 10, 2, &boxes[0]));
    assert_ok(om_tet_mesh_box(lo, hi, 6, 5, 1, &boxes[1]));  // of quadratic elements
    for (int k = 0; k < 3; ++k) {
        OmBanetSample s;
        const OmTetMesh box = boxes[k == 1];
        def.body = &boxes[k == 1];
        def.element = k == 1 ? OM_TET10 : OM_TET4;
        assert_ok(om_banet_sample_make(&def, k, &s));
        assert_int_equal(s.mesh.ntet, k == 1 ? 8 * box.ntet : box.ntet);
        assert_memory_equal(s.mesh.x, box.x, 3 * (size_t)box.nvert * sizeof *box.x);
        assert_true(s.mesh.x != box.x);
        check_ranges(&def, &s);
        check_balance(&s, def.tolerance);
        om_banet_sample_done(&s);
    }
    om_tet_mesh_done(&boxes[0]);
    om_tet_mesh_done(&boxes[1]);
}

static OmStatus make_one(void* ctx) {
    OmBanetSample s;
    OmStatus status = om_banet_sample_make(ctx, 1, &s);
    om_banet_sample_done(&s);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    OmBanetSampleDef def = small_def(17);
    def.side = 0.6;  // few nodes
    def.two_share = def.board_share = 1;
    assert_true(test_failing_allocations(make_one, &def, test_stride(211)) > 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_def),        cmocka_unit_test(test_samples),
        cmocka_unit_test(test_box),        cmocka_unit_test(test_two_regions),
        cmocka_unit_test(test_board),      cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_camera),     cmocka_unit_test(test_one_body),
        cmocka_unit_test(test_wide_grasp), cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
