// Repair of surfaces and welding of meshes: each kind of defect alone, what is refused, and the solid that results.
#include "shape_repair_common.h"

#include "shape/shape_internal.h"
#include "shape/shape_winding.h"

static const OmVec3 zero = {0, 0, 0}, one = {1, 1, 1};
static const double PI_ = 3.14159265358979323846;

static void mend(OmSurface* s, OmSurfaceRepair* r) {
    const OmSurfaceRepairDef def = om_surface_repair_default_def();
    assert_ok(om_surface_repair(&def, s, r));
}

// Refused by the mode with these words; the surface is as before.
static void assert_refused(OmSurface* s, OmRepairMode mode, const char* words) {
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.mode = mode;
    const OmSurface before = *s;
    assert_status(om_surface_repair(&def, s, NULL), OM_INVALID);
    if (!strstr(om_error_message(), words))
        fail_msg("\"%s\" lacks \"%s\"", om_error_message(), words);
    assert_memory_equal(s, &before, sizeof before);
}

static void test_intact(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceRepair r;
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.mode = OM_REPAIR_STRICT;
    make_box(zero, one, 3, &s);
    const int ntri = s.ntri;
    assert_ok(om_surface_repair(&def, &s, &r));
    assert_only(&r, OM_NDEFECT, OM_NDEFECT);
    assert_int_equal(s.ntri, ntri);
    assert_int_equal(r.npart, 1);
    assert_near(r.volume, 1, 1e-12);
    def.max_hole = 2;
    assert_status(om_surface_repair(&def, &s, &r), OM_INVALID);
    om_surface_done(&s);
}

static void test_unmerged(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceRepair r;
    OmRng rng = om_rng_init(1, 0);
    make_box(zero, one, 4, &s);
    const int nvert = s.nvert;
    unmerge(&s, 1e-6, &rng);
    assert_refused(&s, OM_REPAIR_STRICT, "vertices beside others on open edges");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_UNMERGED, OM_NDEFECT);
    assert_int_equal(s.nvert, nvert);
    assert_int_equal(count_of(&r, OM_DEFECT_UNMERGED), 3 * s.ntri - nvert);
    assert_near(r.volume, 1, 1e-5);
    om_surface_done(&s);
}

// A triangle again, in either direction, and twice more; one that names a vertex twice; one on a line.
static void test_duplicates_and_flat(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceRepair r;
    make_box(zero, one, 4, &s);
    const int* v = s.tri_vert;
    const int a[3] = {v[0], v[1], v[2]}, b[3] = {v[30], v[31], v[32]};
    add_triangle(&s, a[1], a[2], a[0]);
    add_triangle(&s, b[0], b[2], b[1]);
    add_triangle(&s, b[0], b[2], b[1]);
    assert_refused(&s, OM_REPAIR_STRICT, "3 triangles that occur again");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_DUPLICATE, OM_DEFECT_WINDING);
    assert_int_equal(count_of(&r, OM_DEFECT_DUPLICATE), 3);
    assert_ok(om_surface_require_closed(&s));
    assert_near(r.volume, 1, 1e-12);

    add_triangle(&s, a[0], a[0], a[1]);
    assert_refused(&s, OM_REPAIR_STRICT, "1 triangle that names a vertex twice");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_FLAT, OM_NDEFECT);

    // a vertex in the middle of an edge: two triangles on one side, a triangle on a line closes them
    const int m = s.nvert, t = s.ntri - 1;
    OmSurface point;
    assert_ok(om_surface_init(&point, 1, 0));
    const int c[3] = {s.tri_vert[3 * t], s.tri_vert[3 * t + 1], s.tri_vert[3 * t + 2]};
    om_store3(point.x, 0, om_lerp(om_load3(s.x, c[0]), om_load3(s.x, c[1]), 0.5));
    append(&s, &point);
    remove_triangle(&s, t);
    add_triangle(&s, c[0], m, c[2]);
    add_triangle(&s, m, c[1], c[2]);
    OmSurface gap = s;  // without the triangle on a line: a hole without area
    assert_ok(om_surface_init(&gap, s.nvert, s.ntri));
    memcpy(gap.x, s.x, 3 * (size_t)s.nvert * sizeof *s.x);
    memcpy(gap.tri_vert, s.tri_vert, 3 * (size_t)s.ntri * sizeof(int));
    add_triangle(&s, c[0], c[1], m);
    assert_refused(&s, OM_REPAIR_STRICT, "1 triangle without area");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_NO_AREA, OM_NDEFECT);
    assert_near(r.volume, 1, 1e-12);
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.max_hole = 0.3;  // the edge of a cell is 0.14 of the diagonal
    assert_ok(om_surface_repair(&def, &gap, &r));
    assert_only(&r, OM_DEFECT_HOLE, OM_DEFECT_NO_AREA);
    assert_near(r.volume, 1, 1e-12);
    om_surface_done(&gap);
    om_surface_done(&s);
}

static void test_winding(void** unused) {
    (void)unused;
    OmSurface s;
    OmSurfaceRepair r;
    make_box(zero, one, 5, &s);
    for (int t = 0; t < s.ntri; t += 23) turn(&s, t);
    const int num = (s.ntri + 22) / 23;
    assert_refused(&s, OM_REPAIR_STRICT, "triangles wound against their neighbours");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_WINDING, OM_NDEFECT);
    assert_int_equal(count_of(&r, OM_DEFECT_WINDING), num);
    assert_near(r.volume, 1, 1e-12);
    turn_all(&s);
    assert_refused(&s, OM_REPAIR_STRICT, "1 part inside out");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_INSIDE_OUT, OM_NDEFECT);
    assert_near(om_surface_volume(&s), 1, 1e-12);
    // a third of the triangles: above the share
    for (int t = 0; t < s.ntri; t += 3) turn(&s, t);
    assert_refused(&s, OM_REPAIR_MEND, "33 % of the triangles");
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.mode = OM_REPAIR_ALL;
    assert_ok(om_surface_repair(&def, &s, &r));
    assert_near(r.volume, 1, 1e-12);
    om_surface_done(&s);
}

// A Moebius strip has no outside.
static void test_one_sided(void** unused) {
    (void)unused;
    enum { n = 40 };
    OmSurface s;
    assert_ok(om_surface_init(&s, 2 * n, 2 * n));
    for (int i = 0; i < n; i++) {
        double a = 2 * PI_ * i / n, c = 0.3 * cos(a / 2), z = 0.3 * sin(a / 2);
        om_store3(s.x, 2 * i, om_vec3((1 + c) * cos(a), (1 + c) * sin(a), z));
        om_store3(s.x, 2 * i + 1, om_vec3((1 - c) * cos(a), (1 - c) * sin(a), -z));
        int p = 2 * i, q = 2 * i + 1, u = 2 * ((i + 1) % n), w = u + 1;
        if (i == n - 1) u = 1, w = 0;
        const int six[6] = {p, q, u, q, w, u};
        memcpy(s.tri_vert + 6 * i, six, sizeof six);
    }
    const OmSurfaceRepairDef def = om_surface_repair_default_def();
    assert_status(om_surface_repair(&def, &s, NULL), OM_INVALID);
    om_surface_done(&s);
}

static void test_holes(void** unused) {
    (void)unused;
    const Ball ball = {{0.1, 0.2, 0.3}, 0.03};
    const double volume = 4 * PI_ / 3 * 2.7e-5;
    OmSurface s;
    OmSurfaceRepair r;
    for (int size = 0; size < 3; size++) {
        make_balls(&ball, 1, 0.0015, &s);
        const double whole = om_surface_volume(&s), radius[3] = {0.002, 0.0045, 0.02};
        for (int t = s.ntri - 1; t >= 0; t--)
            if (om_distance(om_load3(s.x, s.tri_vert[3 * t]), om_vec3(0.13, 0.2, 0.3)) <
                radius[size])
                remove_triangle(&s, t);
        if (size == 2) {  // 20 mm of 104: refused, with place and remedy
            assert_refused(&s, OM_REPAIR_MEND, "the surface is open: 1 hole larger than 10.");
            assert_non_null(strstr(om_error_message(), "mm; close it where the surface was made"));
            assert_refused(&s, OM_REPAIR_STRICT, "the surface is open");
        } else {
            assert_refused(&s, OM_REPAIR_STRICT, "1 hole, at (");
        }
        OmSurfaceRepairDef def = om_surface_repair_default_def();
        def.mode = size == 2 ? OM_REPAIR_ALL : OM_REPAIR_MEND;
        assert_ok(om_surface_repair(&def, &s, &r));
        assert_only(&r, OM_DEFECT_HOLE, OM_NDEFECT);
        assert_int_equal(count_of(&r, OM_DEFECT_HOLE), 1);
        assert_near(r.defect[OM_DEFECT_HOLE].first.x, 0.13, size == 2 ? 0.01 : 1e-3);
        assert_ok(om_surface_require_closed(&s));
        // a flat cap of radius a lies a^2 / 2R below the ball and cuts off pi a^4 / 4R, with a by one edge larger
        const double a = radius[size] + 0.0015;
        assert_near(r.volume, whole, PI_ * a * a * a * a / (4 * ball.radius) + 1e-4 * volume);
        om_surface_done(&s);
    }
}

static void test_fins_and_walls(void** unused) {
    (void)unused;
    OmSurface s, b;
    OmSurfaceRepair r;
    make_box(zero, one, 4, &s);
    OmSurface point;
    assert_ok(om_surface_init(&point, 1, 0));
    om_store3(point.x, 0, om_vec3(2, 2, 2));
    append(&s, &point);
    add_triangle(&s, s.tri_vert[0], s.tri_vert[1], s.nvert - 1);
    assert_refused(&s, OM_REPAIR_STRICT, "1 triangle of a fin");
    mend(&s, &r);
    assert_only(&r, OM_DEFECT_FIN, OM_NDEFECT);
    assert_near(r.volume, 1, 1e-12);
    om_surface_done(&s);

    // two boxes side by side with the wall between them once: all triangles on it have three at their rim
    make_box(zero, one, 4, &s);
    make_box(om_vec3(1, 0, 0), om_vec3(2, 1, 1), 4, &b);
    for (int t = b.ntri - 1; t >= 0; t--) {
        const int* v = b.tri_vert + 3 * t;
        if (b.x[3 * v[0]] == 1 && b.x[3 * v[1]] == 1 && b.x[3 * v[2]] == 1) remove_triangle(&b, t);
    }
    append(&s, &b);
    assert_ok(om__surface_merge(&s, 1e-9));
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.max_share = 0.2;  // the wall has 32 of 352 triangles
    assert_ok(om_surface_repair(&def, &s, &r));
    assert_only(&r, OM_DEFECT_FIN, OM_NDEFECT);
    assert_int_equal(count_of(&r, OM_DEFECT_FIN), 32);
    assert_near(r.volume, 2, 1e-12);
    om_surface_done(&s);
}

// Outer and inner shell, each facing outwards or inwards: the same winding is filled, the opposite one a cavity.
static void test_nested(void** unused) {
    (void)unused;
    const OmVec3 lo = {0.3, 0.3, 0.3}, hi = {0.7, 0.7, 0.7};
    for (int k = 0; k < 4; k++) {
        OmSurface s, inner;
        OmSurfaceRepair r;
        make_box(zero, one, 3, &s);
        make_box(lo, hi, 2, &inner);
        if (k & 1) turn_all(&s);
        if (k & 2) turn_all(&inner);
        append(&s, &inner);
        OmSurfaceRepairDef strict = om_surface_repair_default_def();
        strict.mode = k == 2 ? OM_REPAIR_STRICT : OM_REPAIR_MEND;  // a cavity is no defect
        assert_ok(om_surface_repair(&strict, &s, &r));
        const bool is_cavity = k == 1 || k == 2;
        assert_int_equal(r.npart, 2);
        assert_int_equal(r.ncavity, is_cavity);
        assert_int_equal(count_of(&r, OM_DEFECT_NESTED), !is_cavity);
        assert_int_equal(count_of(&r, OM_DEFECT_INSIDE_OUT), k & 1);
        assert_near(r.volume, is_cavity ? 1 - 0.064 : 1, 1e-3);
        assert_near(r.overlap, is_cavity ? 0 : 0.064, 1e-3);
        OmSdf sdf;
        const OmSdfDef def = om_sdf_default_def(0.04);
        assert_ok(om_sdf_from_surface(&s, &def, &sdf));
        const double d = om_sdf_eval(&sdf, om_vec3(0.5, 0.5, 0.5), NULL);
        assert_near(d, is_cavity ? 0.2 : -0.5,
                    0.025);  // half a step: the middle lies between nodes
        // on the inner shell: the surface, or 0.3 deep
        assert_near(om_sdf_eval(&sdf, om_vec3(0.3, 0.5, 0.5), NULL), is_cavity ? 0 : -0.3, 0.02);
        om_sdf_done(&sdf);
        om_surface_done(&s);
    }
    // an island in a cavity is solid, whichever way it faces
    for (int k = 0; k < 2; k++) {
        OmSurface s, cavity, island;
        OmSurfaceRepair r;
        make_box(zero, one, 3, &s);
        make_box(lo, hi, 2, &cavity);
        make_box(om_vec3(0.4, 0.4, 0.4), om_vec3(0.6, 0.6, 0.6), 1, &island);
        turn_all(&cavity);
        if (k) turn_all(&island);
        append(&s, &cavity);
        append(&s, &island);
        OmSurfaceRepairDef def = om_surface_repair_default_def();
        def.mode = OM_REPAIR_ALL;
        assert_ok(om_surface_repair(&def, &s, &r));
        assert_int_equal(count_of(&r, OM_DEFECT_INSIDE_OUT), k);
        assert_near(r.volume, 1 - 0.064 + 0.008, 1e-12);
        om_surface_done(&s);
    }
}

// Two balls that overlap: the union, in the volume, in the field, and nothing of the walls within.
static void test_overlap(void** unused) {
    (void)unused;
    const Ball ball[2] = {{{0, 0, 0}, 0.02}, {{0.024, 0.003, -0.002}, 0.02}};
    const double d = om_distance(ball[0].center, ball[1].center), R = 0.02;
    const double lens = PI_ * (4 * R + d) * (2 * R - d) * (2 * R - d) / 12;
    const double exact = 8 * PI_ / 3 * R * R * R - lens;
    for (int k = 0; k < 2; k++) {  // the second one inside out
        OmSurface s, b, contour;
        OmSurfaceRepair r;
        OmSurfaceCheck check;
        make_balls(&ball[0], 1, 0.002, &s);
        make_balls(&ball[1], 1, 0.002, &b);
        if (k) turn_all(&b);
        append(&s, &b);
        assert_refused(&s, OM_REPAIR_STRICT, k ? "inside out" : "pairs of triangles that cross");
        mend(&s, &r);
        assert_only(&r, OM_DEFECT_CROSSING, k ? OM_DEFECT_INSIDE_OUT : OM_NDEFECT);
        assert_in_range(count_of(&r, OM_DEFECT_CROSSING), 50, 1000);
        assert_near_rel(r.volume, exact, 8e-3);  // flat triangles: (h / R)^2 = 0.01
        assert_near_rel(r.overlap, lens, 2e-2);  // the lens is thinner than the balls
        assert_near(r.negative, 0, 1e-12);
        OmSdf sdf;
        const OmSdfDef def = om_sdf_default_def(0.003);
        assert_ok(om_sdf_from_surface(&s, &def, &sdf));
        OmRng rng = om_rng_init(7, 0);
        const Balls both = {ball, 2};
        for (int i = 0; i < 3000; i++) {
            OmVec3 p = om_vec3(om_rng_range(&rng, -0.022, 0.046), om_rng_range(&rng, -0.022, 0.025),
                               om_rng_range(&rng, -0.024, 0.022));
            const double value = balls_fn((void*)&both, p);
            // outside the function is the distance; inside it is a lower bound of the depth
            const double got = om_sdf_eval(&sdf, p, NULL);
            if (value > 0) assert_near(got, value, 1e-3);  // a third of a step
            if (value < 0) assert_true(got < value + 1e-3);
        }
        assert_ok(om_surface_from_sdf(&sdf, 0, &contour));
        assert_ok(om_surface_check(&contour, &check));
        assert_int_equal(check.ncomponent, 1);
        assert_int_equal(check.neuler, 2);
        assert_near_rel(om_surface_volume(&contour), r.volume, 1.5e-2);  // (h / R)^2 = 0.023
        om_surface_done(&contour);
        om_sdf_done(&sdf);
        om_surface_done(&s);
    }
}

// Boxes that share a face, an edge or a corner, as an STL has them: vertices at one place are one.
static void test_touching(void** unused) {
    (void)unused;
    const OmVec3 shift[4] = {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {0.5, 0, 0}};
    for (int k = 0; k < 4; k++) {
        OmSurface s, b;
        OmSurfaceRepair r;
        make_box(zero, one, 2, &s);
        make_box(shift[k], om_add(one, shift[k]), 2, &b);
        append(&s, &b);
        assert_ok(om__surface_merge(&s, 1e-9));
        OmSurfaceRepairDef def = om_surface_repair_default_def();
        def.mode = OM_REPAIR_ALL;  // a box has few triangles: 16 of 96 are the wall
        assert_ok(om_surface_repair(&def, &s, &r));
        assert_near(r.volume, k == 3 ? 1.5 : 2, 5e-3);
        assert_int_equal(count_of(&r, OM_DEFECT_OPEN), 0);
        if (k == 0) assert_only(&r, OM_DEFECT_DUPLICATE, OM_NDEFECT);
        if (k == 0) assert_int_equal(count_of(&r, OM_DEFECT_DUPLICATE), 16);
        assert_int_equal(count_of(&r, OM_DEFECT_TOUCHING), k == 1 ? 2
                                                           : k == 3
                                                               ? count_of(&r, OM_DEFECT_TOUCHING)
                                                               : 0);
        OmSdf sdf;
        const OmSdfDef sdf_def = om_sdf_default_def(0.07);
        assert_ok(om_sdf_from_surface(&s, &sdf_def, &sdf));
        if (k == 0) assert_below(om_sdf_eval(&sdf, om_vec3(1, 0.5, 0.5), NULL), -0.4);
        if (k == 3) assert_below(om_sdf_eval(&sdf, om_vec3(0.75, 0.5, 0.5), NULL), -0.4);
        om_sdf_done(&sdf);
        om_surface_done(&s);
    }
}

// Against the sum over all triangles, and integers inside and outside of a closed surface.
static void test_winding_number(void** unused) {
    (void)unused;
    const Ball ball = {{0, 0, 0}, 0.03};
    OmSurface s;
    OmWinding w;
    make_balls(&ball, 1, 0.002, &s);
    assert_ok(om__winding_init(&s, NULL, 0, &w));
    OmRng rng = om_rng_init(2, 0);
    for (int i = 0; i < 500; i++) {
        OmVec3 p = om_vec3(om_rng_range(&rng, -0.05, 0.05), om_rng_range(&rng, -0.05, 0.05),
                           om_rng_range(&rng, -0.05, 0.05));
        if (fabs(om_norm(p) - 0.03) < 2e-4) continue;
        assert_near(om__winding_at(&w, p), om_norm(p) < 0.03 ? 1 : 0, 0.05);  // of the dipoles
    }
    om__winding_done(&w);
    om_surface_done(&s);
}

// Holes on two sides: two of three rays to the middle come through them, and see it outside.
static void test_gaps(void** unused) {
    (void)unused;
    const Ball ball = {{0, 0, 0}, 0.03};
    OmSurface s;
    OmSdf sdf;
    make_balls(&ball, 1, 0.002, &s);
    for (int t = s.ntri - 1; t >= 0; t--) {
        OmVec3 p = om_load3(s.x, s.tri_vert[3 * t]);
        if (om_distance(p, om_vec3(-0.03, 0, 0)) < 0.008 ||
            om_distance(p, om_vec3(0, -0.03, 0)) < 0.008)
            remove_triangle(&s, t);
    }
    const OmSdfDef def = om_sdf_default_def(0.002);
    assert_ok(om_sdf_from_surface(&s, &def, &sdf));
    OmRng rng = om_rng_init(4, 0);
    for (int i = 0; i < 2000; i++) {
        OmVec3 p = om_vec3(om_rng_range(&rng, -0.04, 0.04), om_rng_range(&rng, -0.04, 0.04),
                           om_rng_range(&rng, -0.04, 0.04));
        const double d = om_norm(p) - 0.03;
        // near a hole the surface is a level of the winding number; a cap of radius 8 mm is 1.1 mm high
        if (fabs(d) > 0.006) assert_true((om_sdf_eval(&sdf, p, NULL) < 0) == (d < 0));
    }
    om_sdf_done(&sdf);
    om_surface_done(&s);
}

// ---- tetrahedra -------------------------------------------------------------------------------------------

// The vertices on the plane x = 0.5 twice: elements on its right use the new ones.
static void crack(OmTetMesh* mesh) {
    OmTetMesh out;
    int* twin = malloc((size_t)mesh->nvert * sizeof *twin);
    int n = mesh->nvert;
    for (int v = 0; v < mesh->nvert; v++) twin[v] = mesh->x[3 * v] == 0.5 ? n++ : v;
    assert_ok(om_tet_mesh_init(&out, n, mesh->ntet));
    for (int v = 0; v < mesh->nvert; v++) {
        om_store3(out.x, v, om_load3(mesh->x, v));
        om_store3(out.x, twin[v], om_load3(mesh->x, v));
    }
    for (int e = 0; e < mesh->ntet; e++) {
        double sum = 0;
        for (int c = 0; c < 4; c++) sum += mesh->x[3 * mesh->tet_vert[4 * e + c]];
        for (int c = 0; c < 4; c++) {
            int v = mesh->tet_vert[4 * e + c];
            out.tet_vert[4 * e + c] = sum > 2 ? twin[v] : v;
        }
        out.tet_label[e] = e % 7;
    }
    const int set[2] = {0, n - 1};
    assert_ok(om_tet_mesh_add_set(&out, "ends", set, 2));
    free(twin);
    om_tet_mesh_done(mesh);
    *mesh = out;
}

static void test_weld(void** unused) {
    (void)unused;
    OmTetMesh mesh, whole;
    OmTetMeshWeld w;
    assert_ok(om_tet_mesh_box(zero, one, 4, 3, 2, &mesh));
    assert_ok(om_tet_mesh_copy(&mesh, &whole));
    assert_ok(om_tet_mesh_weld(&mesh, 0, &w));
    assert_int_equal(w.nface + w.nvert, 0);
    crack(&mesh);
    assert_int_equal(mesh.nvert, whole.nvert + 12);
    assert_ok(om_tet_mesh_weld(&mesh, 0, &w));
    assert_int_equal(w.nface, 12);
    assert_int_equal(w.nvert, 12);
    assert_near(w.first.x, 0.5, 1e-15);
    assert_int_equal(mesh.nvert, whole.nvert);
    assert_memory_equal(mesh.x, whole.x, 3 * (size_t)whole.nvert * sizeof *mesh.x);
    assert_memory_equal(mesh.tet_vert, whole.tet_vert, 4 * (size_t)whole.ntet * sizeof(int));
    assert_int_equal(mesh.tet_label[8], 1);
    const OmMeshSet* set = om_tet_mesh_find_set(&mesh, "ends");
    assert_true(set && set->nvert == 2 && set->vert[0] == 0 && whole.x[3 * set->vert[1]] == 0.5);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&whole);
    // boxes that meet at an edge alone stay apart
    OmTetMesh b;
    assert_ok(om_tet_mesh_box(zero, one, 1, 1, 1, &mesh));
    assert_ok(om_tet_mesh_box(om_vec3(1, 1, 0), om_vec3(2, 2, 1), 1, 1, 1, &b));
    assert_ok(om_tet_mesh_init(&whole, 16, 12));
    memcpy(whole.x, mesh.x, 24 * sizeof(double));
    memcpy(whole.x + 24, b.x, 24 * sizeof(double));
    for (int i = 0; i < 24; i++) {
        whole.tet_vert[i] = mesh.tet_vert[i];
        whole.tet_vert[24 + i] = b.tet_vert[i] + 8;
    }
    for (int e = 0; e < 12; e++) whole.tet_label[e] = 0;
    assert_ok(om_tet_mesh_weld(&whole, 0, &w));
    assert_int_equal(w.nface, 0);
    assert_int_equal(whole.nvert, 16);
    om_tet_mesh_done(&whole);
    om_tet_mesh_done(&mesh);
    om_tet_mesh_done(&b);
}

// ---- hostile and failing ------------------------------------------------------------------------------------

// Each edge is used as often from a to b as from b to a.
static void assert_is_cycle(const OmSurface* s) {
    for (int i = 0; i < 3 * s->ntri; i++) {
        const int a = s->tri_vert[i], b = s->tri_vert[i % 3 == 2 ? i - 2 : i + 1];
        int sum = 0;
        for (int k = 0; k < 3 * s->ntri; k++) {
            const int c = s->tri_vert[k], d = s->tri_vert[k % 3 == 2 ? k - 2 : k + 1];
            sum += (a == c && b == d) - (a == d && b == c);
        }
        assert_int_equal(sum, 0);
    }
}

static void test_hostile(void** unused) {
    (void)unused;
    OmSurface s;
    const OmSurfaceRepairDef def = om_surface_repair_default_def();
    assert_ok(om_surface_init(&s, 4, 2));
    const int bad[6] = {0, 1, 2, 0, 1, 4};
    memcpy(s.tri_vert, bad, sizeof bad);
    for (int v = 0; v < 4; v++) om_store3(s.x, v, om_vec3(v == 1, v == 2, v == 3));
    assert_refused(&s, OM_REPAIR_ALL, "names vertex 4 of a surface of 4");
    s.tri_vert[5] = 3;
    s.x[10] = NAN;
    assert_refused(&s, OM_REPAIR_ALL,
                   "vertex 3 of the surface has a coordinate that is not finite");
    s.x[10] = 0;
    for (int i = 0; i < 12; i++) s.x[i] = 1;
    assert_refused(&s, OM_REPAIR_ALL, "one point");
    s.ntri = 0;
    assert_refused(&s, OM_REPAIR_ALL, "no triangles");
    om_surface_done(&s);
    // random triangles on few vertices, at few places: whatever comes of it, it ends, and what is accepted is closed
    for (int k = 0; k < test_count(25, 4000); k++) {
        OmRng rng = om_rng_init(5, (uint64_t)k);
        const int nvert = 4 + (int)om_rng_below(&rng, 12), ntri = 1 + (int)om_rng_below(&rng, 60);
        assert_ok(om_surface_init(&s, nvert, ntri));
        for (int i = 0; i < 3 * nvert; i++) s.x[i] = (double)om_rng_below(&rng, k % 2 ? 3 : 1000);
        for (int i = 0; i < 3 * ntri; i++) s.tri_vert[i] = (int)om_rng_below(&rng, (uint32_t)nvert);
        OmSurfaceRepairDef any = def;
        any.mode = (OmRepairMode)(k % 3);
        OmSurfaceRepair r;
        OmStatus status = om_surface_repair(&any, &s, &r);
        assert_true(status == OM_OK || status == OM_INVALID);
        if (status == OM_OK) {
            OmSdf sdf;
            OmSdfDef field = om_sdf_default_def(k % 2 ? 0.2 : 70);
            status = om_sdf_from_surface(&s, &field, &sdf);
            assert_true(status == OM_OK || status == OM_INVALID);
            om_sdf_done(&sdf);
            if (count_of(&r, OM_DEFECT_OPEN) == 0) assert_is_cycle(&s);
        }
        om_surface_done(&s);
    }
}

static OmStatus repair_work(void* ctx) {
    const OmSurface* input = ctx;
    OmSurface s = {0};
    OmSdf sdf = {0};
    OmStatus status = OM_OK;
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.mode = OM_REPAIR_ALL;
    const OmSdfDef field = om_sdf_default_def(0.2);
    OM_TRY_DONE(om_surface_init(&s, input->nvert, input->ntri));
    memcpy(s.x, input->x, 3 * (size_t)input->nvert * sizeof *s.x);
    memcpy(s.tri_vert, input->tri_vert, 3 * (size_t)input->ntri * sizeof(int));
    OM_TRY_DONE(om_surface_repair(&def, &s, NULL));
    OM_TRY_DONE(om_sdf_from_surface(&s, &field, &sdf));
done:
    om_sdf_done(&sdf);
    om_surface_done(&s);
    return status;
}

static OmStatus weld_work(void* ctx) {
    OmTetMesh mesh;
    OM_TRY(om_tet_mesh_copy(ctx, &mesh));
    OmStatus status = om_tet_mesh_weld(&mesh, 0, NULL);
    om_tet_mesh_done(&mesh);
    return status;
}

static void test_memory(void** unused) {
    (void)unused;
    OmSurface s, b;
    OmRng rng = om_rng_init(1, 0);
    make_box(zero, one, 2, &s);
    make_box(om_vec3(0.5, 0.2, 0.3), om_vec3(1.5, 1.2, 1.3), 2, &b);
    append(&s, &b);
    unmerge(&s, 1e-7, &rng);
    remove_triangle(&s, 5);
    turn(&s, 20);
    assert_true(test_failing_allocations(repair_work, &s, test_stride(5)) > 10);
    om_surface_done(&s);
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(zero, one, 4, 3, 2, &mesh));
    crack(&mesh);
    assert_true(test_failing_allocations(weld_work, &mesh, test_stride(5)) > 4);
    om_tet_mesh_done(&mesh);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_intact),
        cmocka_unit_test(test_unmerged),
        cmocka_unit_test(test_duplicates_and_flat),
        cmocka_unit_test(test_winding),
        cmocka_unit_test(test_one_sided),
        cmocka_unit_test(test_holes),
        cmocka_unit_test(test_fins_and_walls),
        cmocka_unit_test(test_nested),
        cmocka_unit_test(test_overlap),
        cmocka_unit_test(test_touching),
        cmocka_unit_test(test_winding_number),
        cmocka_unit_test(test_gaps),
        cmocka_unit_test(test_weld),
        cmocka_unit_test(test_hostile),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
