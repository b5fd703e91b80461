// test_scene_sheet.c: fat over a ball and over an ellipsoid, compared with their geometry: thickness, gap, rim, tumour.
#include "test_files.h"

#include "omentum/scene.h"
#include "omentum/scene_model.h"

#define MM 1e-3
#define VOXEL 2.5e-3

static double side_of(OmVec3 x) { return hypot(x.x, x.z); }  // from the axis towards the front

// A cap of fat, 25 mm around the front of a ball of 40 mm, with a tumour of a height under its middle.
static void make_cap(double height, double edge, bool keep_edge, OmPatient* p,
                     OmModelReport* report) {
    enum { N = 40 };
    OmVolume v;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(VOXEL, om_mat3_identity());
    v.grid.origin = om_scale(-VOXEL * (N - 1) / 2, om_vec3(1, 1, 1));
    for (int n = 0; n < N * N * N; n++) {
        OmVec3 c =
            om_sub(om_vec3(n % N, n / N % N, n / N / N), om_scale((N - 1) / 2.0, om_vec3(1, 1, 1)));
        ((float*)v.voxel)[n] = VOXEL * om_norm(c) < 40 * MM ? 1 : 0;
    }
    OmModelDef def = om_model_default_def("ball.nrrd", edge);
    def.sheet.thickness = 8 * MM;
    def.sheet.gap = 2 * MM;
    def.sheet.half_length = def.sheet.half_width = def.sheet.corner = 25 * MM;
    def.sheet.tumour_radius = 12 * MM;
    def.sheet.tumour_height = height;
    def.sheet.nroi = 400;
    def.sheet.keep_edge = def.allow_loss = keep_edge;
    def.has_bending_test = false;
    assert_ok(om_model_build_volume(&def, &v, NULL, p, report));
    om_volume_done(&v);
}

// Mean distance from the ball's centre of a set's vertices near the axis.
static double mean_radius(const OmTetMesh* mesh, const char* name) {
    const OmMeshSet* set = om_tet_mesh_find_set(mesh, name);
    double sum = 0;
    int n = 0;
    for (int i = 0; i < set->nvert; ++i) {
        OmVec3 x = om_load3(mesh->x, set->vert[i]);
        if (side_of(x) > 15 * MM) continue;
        sum += om_norm(x);
        ++n;
    }
    assert_true(n > 10);
    return sum / n;
}

// The reference is the ball before the tumour: its back, where no tumour is.
static double ball_radius(const OmSurface* organ) {
    double sum = 0;
    int n = 0;
    for (int i = 0; i < organ->nvert; ++i) {
        OmVec3 x = om_load3(organ->x, i);
        if (x.y > 0) continue;
        sum += om_norm(x);
        ++n;
    }
    assert_near(sum / n, 40 * MM, 0.5 * VOXEL);
    return sum / n;
}

static void test_cap(void** state) {
    (void)state;
    OmPatient p;
    OmModelReport r;
    const double edge = test_is_slow() ? 5 * MM : 7 * MM;
    make_cap(0, edge, false, &p, &r);
    double R = ball_radius(&p.organ), farthest = 0;
    // It is judged by distance, as a body, and its top is moved by a tenth of a voxel at most.
    const OmShapeFit* f = &r.fit;
    assert_true(r.has_fit && r.fit_is_of_sheet && !r.has_loss && p.gap != NULL);
    assert_true(om_topology_is_equal(&f->solid, &f->mesh));
    assert_below(fmax(f->to_mesh.p95, f->to_solid.p95), edge / 3);
    assert_below(fmax(f->to_mesh.max, f->to_solid.max), edge);
    assert_below(r.volume_error, 0.01);
    assert_below(fabs(r.level_shift), 0.1 * VOXEL + 1e-12);
    assert_null(strstr(r.warning, "outside of the sheet"));
    const double thickness = mean_radius(&p.mesh, "top") - mean_radius(&p.mesh, "underside");
    assert_near(thickness - r.level_shift, 8 * MM, 0.3 * MM);
    // The underside stands off by the gap, the top by the thickness more.
    assert_near(mean_radius(&p.mesh, "underside"), R + 2 * MM, 0.3 * VOXEL);
    assert_near(mean_radius(&p.mesh, "top"), R + 10 * MM, 0.3 * VOXEL);
    // The rim stands upright on the ball: it leans out with the radius, up to where its edge is rounded.
    double sine = 25 * MM / R;
    for (int i = 0; i < p.mesh.nvert; ++i)
        farthest = fmax(farthest, side_of(om_load3(p.mesh.x, i)));
    assert_true(farthest > sine * (R + 6 * MM) && farthest < sine * (R + 10 * MM));
    // A sector of the shell, less what the rounded edges of the rim take away, (1 - pi / 4) r^2 each.
    double lo = R + 2 * MM, hi = R + 10 * MM, angle = asin(sine), round = 4 * MM;
    double volume = 2 * OM_PI / 3 * (1 - cos(angle)) * (hi * hi * hi - lo * lo * lo);
    volume -= (1 - OM_PI / 4) * round * round * 2 * OM_PI * sine * (lo + hi);
    assert_near_rel(om_tet_mesh_volume(&p.mesh), volume, 0.03);
    om_patient_done(&p);
}

// Edges as long as the sheet is thick are kept: the top lies too far out, and the report tells it.
static void test_edges_are_kept(void** state) {
    (void)state;
    OmPatient p;
    OmModelReport r;
    make_cap(0, 8 * MM, true, &p, &r);
    const double thickness = mean_radius(&p.mesh, "top") - mean_radius(&p.mesh, "underside");
    assert_near(thickness - r.level_shift, 8 * MM, 0.3 * MM);
    assert_true(r.level_shift > 0.1 * VOXEL && r.edge == 8 * MM);
    assert_true(r.has_fit && r.fit_is_of_sheet);
    assert_non_null(strstr(r.warning, "its top and rims lie up to 0.36 mm outside of the sheet"));
    om_patient_done(&p);
}

// A dome of 4 mm on the ball; the ROI is all of it, seen from outside.
static void test_dome(void** state) {
    (void)state;
    OmPatient p;
    OmModelReport r;
    make_cap(4 * MM, 10 * MM, true, &p, &r);
    double R = ball_radius(&p.organ), highest = 0, reach = 0;
    for (int i = 0; i < p.organ.nvert; ++i)
        highest = fmax(highest, om_norm(om_load3(p.organ.x, i)));
    assert_near(highest, R + 4 * MM, 0.6 * MM);  // to a fraction of a voxel
    for (int i = 0; i < p.nroi; ++i) {
        OmVec3 x = om_load3(p.roi_point, i);
        reach = fmax(reach, om_distance(x, p.roi_center));
        assert_true(om_dot(om_load3(p.roi_normal, i), om_normalize(x)) > 0);
    }
    assert_true(reach > 10 * MM && reach < 12 * MM + VOXEL);
    assert_near(side_of(p.roi_center), 0, VOXEL);
    om_patient_done(&p);
}

// An ellipsoid, longest up the body, as a file.
static void write_ellipsoid(const char* path) {
    enum { N = 40 };
    static unsigned char value[N * N * N];
    char head[400];
    int n = snprintf(
        head, sizeof head,
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nspace: right-anterior-superior\n"
        "space units: \"mm\" \"mm\" \"mm\"\nspace directions: (2.5,0,0) (0,2.5,0) (0,0,2.5)\n"
        "space origin: (-48.75,-48.75,-48.75)\nencoding: raw\n\n",
        N, N, N);
    for (int i = 0; i < N * N * N; ++i) {
        double x = 2.5 * (i % N) - 48.75, y = 2.5 * (i / N % N) - 48.75,
               z = 2.5 * (i / N / N) - 48.75;
        value[i] = x * x / (32 * 32) + y * y / (28 * 28) + z * z / (44 * 44) < 1;
    }
    FILE* file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(head, 1, (size_t)n, file), n);
    assert_int_equal(fwrite(value, 1, sizeof value, file), sizeof value);
    assert_int_equal(fclose(file), 0);
}

static OmVec3 roi_of(const char* shift) {
    char text[800];
    snprintf(
        text, sizeof text,
        "name: x\ndata_root: /tmp\ntissue: {source: volume, file: omentum-%ld-ellipsoid.nrrd}\n"
        "model: {label: 1, edge_mm: 12, thickness_mm: 8, side: anterior, half_length_mm: 28, "
        "half_width_mm: 20, attach: border:superior 25 %%, tumour_radius_mm: 8%s}\n",
        (long)getpid(), shift);
    OmScene scene;
    OmSite site;
    assert_ok(om_scene_parse(text, strlen(text), "s.yaml", &scene));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    OmVec3 center = site.roi_center;
    om_site_done(&site);
    return center;
}

// Along is up the body (z), across is front x along: y x z = x.
static void test_shifted_tumour(void** state) {
    (void)state;
    const char* path = temp_path("ellipsoid.nrrd");
    write_ellipsoid(path);
    OmVec3 middle = roi_of("");
    OmVec3 moved = roi_of(", tumour_shift_mm: [9, -6, 0]");
    unlink(path);
    // A centre is a vertex of the organ's surface, half a voxel from where it is wanted.
    assert_near(moved.z - middle.z, 9 * MM, VOXEL);
    assert_near(moved.x - middle.x, -6 * MM, VOXEL);
    assert_true(middle.y > 26 * MM && moved.y > 25 * MM);  // both on the front
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cap),
        cmocka_unit_test(test_edges_are_kept),
        cmocka_unit_test(test_dome),
        cmocka_unit_test(test_shifted_tumour),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
