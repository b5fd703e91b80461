// The clinical case on a real CT: fat over the left kidney, and organs that stay where they are however the
// voxels are stored.
#include "omentum/scene_model.h"
#include "omentum/sense.h"
#include "test_common.h"

// The fat of scenes/kidney.yaml, on a finer mesh.
static OmModelDef kidney_def(const char* path) {
    OmModelDef def = om_model_default_def(path, 0.0045);
    def.label[def.nlabel++] = 3;
    def.sheet.thickness = 0.006;
    def.sheet.tumour_radius = 0.008;
    snprintf(def.sheet.side, sizeof def.sheet.side, "lateral");
    assert_ok(om_model_parse_attach("border:posterior 50 %", &def.sheet.attach[0]));
    def.sheet.nattach = 1;
    return def;
}

static int compare(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

// Distances of a set's vertices to a field: median, and the largest of the best 95 %.
static void set_distances(const OmTetMesh* mesh, const char* name, const OmSdf* sdf, double* median,
                          double* max) {
    const OmMeshSet* set = om_tet_mesh_find_set(mesh, name);
    assert_non_null(set);
    double* d = calloc((size_t)set->nvert, sizeof *d);
    for (int i = 0; i < set->nvert; i++)
        d[i] = om_sdf_eval(sdf, om_load3(mesh->x, set->vert[i]), NULL);
    qsort(d, (size_t)set->nvert, sizeof *d, compare);
    *median = d[set->nvert / 2];
    *max = d[(int)(0.95 * set->nvert)];
    printf("%s: %d vertices, %.2f to %.2f mm from the organ, median %.2f, 95 %% below %.2f\n", name,
           set->nvert, d[0] * 1e3, d[set->nvert - 1] * 1e3, *median * 1e3, *max * 1e3);
    assert_true(d[0] > -0.001);  // nothing reaches into the organ by more than its grid resolves
    free(d);
}

// What a camera above the covered side sees of the region, with and without the sheet.
static void assert_hidden(const OmPatient* p) {
    OmSenseScene* scene;
    OmSurface tissue;
    int organ_id, tissue_id;
    double covered, bare;
    const OmSenseLook look = {.red = 1};
    assert_ok(om_tet_mesh_boundary(&p->mesh, &tissue, NULL));
    assert_ok(om_sense_scene_create(&scene));
    assert_ok(om_sense_scene_add(scene, &p->organ, &look, &organ_id));
    assert_ok(om_sense_scene_add(scene, &tissue, &look, &tissue_id));
    OmVec3 eye = om_madd(p->roi_center, 0.15, p->up);
    OmCamera camera = {
        om_pose_look_at(eye, p->roi_center, om_orthogonal(p->up)), 320, 240, 0.8, 0.01, 1};
    const uint64_t ignore = 1ull << organ_id;  // the points lie on it
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_sense_visibility(scene, &camera, p->roi_point, p->roi_normal, p->nroi, ignore,
                                  &covered));
    om_sense_scene_show(scene, tissue_id, false);
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(
        om_sense_visibility(scene, &camera, p->roi_point, p->roi_normal, p->nroi, ignore, &bare));
    printf("region of interest: %.0f %% seen under the sheet, %.0f %% without it\n", 100 * covered,
           100 * bare);
    assert_near(covered, 0, 0);
    assert_near(bare, 1, 0.05);
    om_surface_done(&tissue);
    om_sense_scene_destroy(scene);
}

static void test_fat_over_the_kidney(void** unused) {
    (void)unused;
    const char* path = test_data("ct_abdomen/labels.nii.gz");
    OmModelDef def = kidney_def(path);
    OmPatient p;
    OmModelReport r;
    OmSdf organ;
    double median, max;
    assert_ok(om_model_build(&def, NULL, &p, &r));
    printf("fat: %d tets, dihedral %.1f, volume error %.2f %%, %.2f s\n", r.quality.ntet,
           r.quality.dihedral_min * 180 / OM_PI, 100 * r.volume_error, r.seconds);
    assert_true(r.quality.dihedral_min * 180 / OM_PI > 8);
    assert_below(r.volume_error, 0.02);
    assert_int_equal(r.quality.npart, 1);
    assert_int_equal(r.quality.euler, 2);  // no hole in it
    assert_true(p.up.x < -0.99);           // the left kidney's lateral face is to the left
    OmSdfDef sdf_def = om_sdf_default_def(0.001);
    sdf_def.margin = 0.02;
    assert_ok(om_sdf_from_surface(&p.organ, &sdf_def, &organ));
    set_distances(&p.mesh, "underside", &organ, &median, &max);
    assert_near(median, 0, 0.0006);  // half of what the organ's field of 2.25 mm resolves
    set_distances(&p.mesh, "top", &organ, &median, &max);
    assert_near(median, 0.006, 0.0006);
    const OmMeshSet* border = om_tet_mesh_find_set(&p.mesh, "border");
    const OmMeshSet* held = om_tet_mesh_find_set(&p.mesh, "attachment");
    assert_near(held->nvert, 0.5 * border->nvert, 1);
    double y_held = 0, y_border = 0;  // posterior is -y
    for (int i = 0; i < held->nvert; i++) y_held += p.mesh.x[3 * held->vert[i] + 1] / held->nvert;
    for (int i = 0; i < border->nvert; i++)
        y_border += p.mesh.x[3 * border->vert[i] + 1] / border->nvert;
    assert_below(y_held, y_border - 0.01);
    for (int i = 0; i < p.nroi; i++) {
        double d = om_sdf_eval(&organ, om_load3(p.roi_point, i), NULL);
        assert_near(d, 0, 0.0005);
        double nearest = HUGE_VAL;
        for (int v = 0; v < p.mesh.nvert; v++) {
            nearest = fmin(nearest, om_distance(om_load3(p.mesh.x, v), om_load3(p.roi_point, i)));
        }
        assert_below(nearest, 0.005);  // an edge: the sheet lies on it
    }
    assert_hidden(&p);
    om_sdf_done(&organ);
    om_patient_done(&p);
}

// ---- one organ, stored in several ways ----------------------------------------------------------------------

static OmVec3 mesh_centroid(const OmTetMesh* m) {
    OmVec3 sum = om_vec3(0, 0, 0);
    double total = 0;
    for (int e = 0; e < m->ntet; e++) {
        OmVec3 x[4], c = om_vec3(0, 0, 0);
        for (int k = 0; k < 4; k++) {
            x[k] = om_load3(m->x, m->tet_vert[4 * e + k]);
            c = om_madd(c, 0.25, x[k]);
        }
        double v = om_dot(om_sub(x[1], x[0]), om_cross(om_sub(x[2], x[0]), om_sub(x[3], x[0])));
        sum = om_madd(sum, v, c);
        total += v;
    }
    return om_scale(1 / total, sum);
}

// Known centroids of whole organs, from the voxels and the header alone.
static void test_organs_are_where_the_header_says(void** unused) {
    (void)unused;
    static const struct {
        int label;
        OmVec3 center;  // mm
    } organ[] = {{1, {-113.21, 122.52, 148.71}},
                 {2, {64.46, 125.16, 118.18}},
                 {3, {-76.29, 122.01, 122.35}},
                 {4, {65.30, 211.65, 116.79}},
                 {5, {64.00, 185.53, 149.98}}};
    const char* path = test_data("ct_abdomen/labels.nii.gz");
    for (int i = 0; i < 5; i++) {
        OmPatient p;
        OmModelDef def = om_model_default_def(path, 0.0045);
        def.label[def.nlabel++] = organ[i].label;
        assert_ok(om_model_build(&def, NULL, &p, NULL));
        OmVec3 c = mesh_centroid(&p.mesh);
        double d = om_distance(c, om_scale(1e-3, organ[i].center));
        printf("label %d: %.2f mm from its centroid\n", organ[i].label, d * 1e3);
        assert_below(d, 0.0005);  // a sixth of a voxel: parts left out, holes filled
        om_patient_done(&p);
    }
}

// The same voxels counted from the other ends and in another order, with the header that says so.
static void restore_volume(const OmVolume* v, OmVolume* out) {
    const int* n = v->grid.dim;
    assert_ok(om_volume_init(out, n[2], n[0], n[1]));  // k, then i backwards, then j backwards
    out->grid.axis =
        om_mat3_cols(v->grid.axis.cz, om_scale(-1, v->grid.axis.cx), om_scale(-1, v->grid.axis.cy));
    out->grid.origin =
        om_madd(om_madd(v->grid.origin, n[0] - 1, v->grid.axis.cx), n[1] - 1, v->grid.axis.cy);
    for (int k = 0; k < n[2]; k++) {
        for (int j = 0; j < n[1]; j++) {
            for (int i = 0; i < n[0]; i++) {
                size_t from = (size_t)i + (size_t)n[0] * ((size_t)j + (size_t)n[1] * (size_t)k);
                size_t to = (size_t)k + (size_t)n[2] * ((size_t)(n[0] - 1 - i) +
                                                        (size_t)n[0] * (size_t)(n[1] - 1 - j));
                ((float*)out->voxel)[to] = (float)om_volume_value(v, from);
            }
        }
    }
}

// Largest distance of a's boundary vertices, moved by a rotation about the origin, to b's field.
static double boundary_distance(const OmTetMesh* a, OmMat3 turn, const OmTetMesh* b, double* mean) {
    OmSurface from, to;
    OmSdf field;
    assert_ok(om_tet_mesh_boundary(a, &from, NULL));
    assert_ok(om_tet_mesh_boundary(b, &to, NULL));
    OmSdfDef def = om_sdf_default_def(0.001);
    assert_ok(om_sdf_from_surface(&to, &def, &field));
    double max = 0;
    *mean = 0;
    for (int v = 0; v < from.nvert; v++) {
        double d = fabs(om_sdf_eval(&field, om_mat3_apply(turn, om_load3(from.x, v)), NULL));
        max = fmax(max, d);
        *mean += d / from.nvert;
    }
    om_sdf_done(&field);
    om_surface_done(&from);
    om_surface_done(&to);
    return max;
}

// Build one label of the CT in three forms: original, stored otherwise, and turned; compare boundaries and volumes.
static void compare_storage(int label, double mean_max, double most_max) {
    const OmMat3 turn =
        om_quat_to_mat3(om_quat_axis_angle(om_normalize(om_vec3(0.3, -0.5, 0.8)), 0.6));
    const char* path = test_data("ct_abdomen/labels.nii.gz");
    OmVolume v, other;
    OmPatient p, q;
    OmModelDef def = om_model_default_def(path, 0.0045);
    def.label[def.nlabel++] = label;
    assert_ok(om_volume_load(path, &v));
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    restore_volume(&v, &other);
    for (int is_turned = 0; is_turned < 2; is_turned++) {
        double mean, max;
        if (is_turned) {
            v.grid.axis = om_mat3_mul(turn, v.grid.axis);
            v.grid.origin = om_mat3_apply(turn, v.grid.origin);
        }
        assert_ok(om_model_build_volume(&def, is_turned ? &v : &other, NULL, &q, NULL));
        OmMat3 move = is_turned ? turn : om_mat3_identity();
        max = boundary_distance(&p.mesh, move, &q.mesh, &mean);
        double share = om_tet_mesh_volume(&q.mesh) / om_tet_mesh_volume(&p.mesh) - 1;
        printf(
            "label %d %s: %d and %d tets, volumes %.2g %%, boundaries %.2g mm apart, at most %.2g\n",
            label, is_turned ? "turned by 34 degrees" : "stored otherwise", p.mesh.ntet,
            q.mesh.ntet, share * 100, mean * 1e3, max * 1e3);
        assert_below(mean, mean_max);
        assert_below(max, most_max);
        assert_near(share, 0, 0.002);  // both are within 0.1 % of the voxels
        om_patient_done(&q);
    }
    om_patient_done(&p);
    om_volume_done(&v);
    om_volume_done(&other);
}

static void test_storage_and_rotation(void** unused) {
    (void)unused;
    compare_storage(4, 0.0003, 0.0015);  // a tenth and half of a voxel: the lattice is not turned
    compare_storage(3, 0.0003,
                    0.0045);  // cut by the volume: a lattice cuts off the sharp edges there
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fat_over_the_kidney),
        cmocka_unit_test(test_organs_are_where_the_header_says),
        cmocka_unit_test(test_storage_and_rotation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
