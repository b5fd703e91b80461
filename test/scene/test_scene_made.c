// test_scene_made.c: volumes that the test writes, where other tests need the data folder: organs of labels in a file,
// fat over one of them, and the site of such a scene.
#include <math.h>

#include "test_files.h"

#include "omentum/scene.h"
#include "omentum/scene_model.h"

#define VOXEL 4e-3

enum { N = 30 };

// Two ellipsoids in LPS, as a scanner has them: label 2 on the patient's right (RAS x below 0), label 3 on the left,
// with their centres in RAS, m.
static const OmVec3 center[2] = {{-0.03, 0.002, 0.001}, {0.03, 0.002, 0.001}};
static const OmVec3 half[2] = {{0.018, 0.020, 0.026}, {0.020, 0.022, 0.028}};

static void write_labels(const char* path) {
    static unsigned char value[N * N * N];
    char head[400];
    int n = snprintf(head, sizeof head,
                     "NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\n"
                     "space: left-posterior-superior\nspace units: \"mm\" \"mm\" \"mm\"\n"
                     "space directions: (4,0,0) (0,4,0) (0,0,4)\nspace origin: (-58,-58,-58)\n"
                     "encoding: raw\n\n",
                     N, N, N);
    for (int i = 0; i < N * N * N; ++i) {
        OmVec3 lps =
            om_scale(1e-3, om_vec3(4 * (i % N) - 58, 4 * (i / N % N) - 58, 4 * (i / N / N) - 58));
        value[i] = 0;
        for (int k = 0; k < 2; ++k) {
            OmVec3 d = om_sub(om_vec3(-lps.x, -lps.y, lps.z), center[k]);
            if (om_norm(om_vec3(d.x / half[k].x, d.y / half[k].y, d.z / half[k].z)) < 1)
                value[i] = (unsigned char)(2 + k);
        }
    }
    FILE* file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(head, 1, (size_t)n, file), n);
    assert_int_equal(fwrite(value, 1, sizeof value, file), sizeof value);
    assert_int_equal(fclose(file), 0);
}

// Each organ has its place and its volume: 4/3 pi a b c.
static void test_organs(void** state) {
    (void)state;
    const char* path = temp_path("labels.nrrd");
    write_labels(path);
    for (int k = 0; k < 2; ++k) {
        OmModelDef def = om_model_default_def(path, 0.008);
        def.label[def.nlabel++] = 2 + k;
        OmPatient p;
        OmModelReport r;
        assert_ok(om_model_build(&def, NULL, &p, &r));
        OmVec3 sum = om_vec3(0, 0, 0);
        double volume = 0;
        for (int e = 0; e < p.mesh.ntet; ++e) {
            OmVec3 x[4], middle = om_vec3(0, 0, 0);
            for (int c = 0; c < 4; ++c) {
                x[c] = om_load3(p.mesh.x, p.mesh.tet_vert[4 * e + c]);
                middle = om_madd(middle, 0.25, x[c]);
            }
            double v =
                om_dot(om_sub(x[1], x[0]), om_cross(om_sub(x[2], x[0]), om_sub(x[3], x[0]))) / 6;
            sum = om_madd(sum, v, middle);
            volume += v;
        }
        assert_near_rel(volume, 4 * OM_PI / 3 * half[k].x * half[k].y * half[k].z, 0.03);
        assert_near(om_distance(om_scale(1 / volume, sum), center[k]), 0, 0.25 * VOXEL);
        assert_near_rel(r.mesh_volume, volume, 1e-9);
        om_patient_done(&p);
    }
    unlink(path);
}

// The scene of fat over the left organ: the tissue lies outside, the ROI under it, and the truth has another mesh.
static void test_site(void** state) {
    (void)state;
    write_labels(temp_path("labels.nrrd"));
    char text[800];
    snprintf(text, sizeof text,
             "name: x\ndata_root: /tmp\ntissue: {source: volume, file: omentum-%ld-labels.nrrd}\n"
             "model: {label: 3, edge_mm: 9, thickness_mm: 8, side: lateral, half_length_mm: 20, "
             "half_width_mm: 16, attach: border:posterior 30 %%, tumour_radius_mm: 7}\n",
             (long)getpid());
    OmScene scene;
    OmSite twin, world;
    assert_ok(om_scene_parse(text, strlen(text), "s.yaml", &scene));
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_true(twin.has_organ && !twin.has_ground && twin.nroi > 100 && twin.roi.ntri > 10);
    for (int i = 0; i < twin.mesh.nvert; ++i)
        assert_true(om_sdf_eval(&twin.organ_sdf, om_load3(twin.mesh.x, i), NULL) > -1e-3);
    OmVec3 roi = om_pose_apply(om_pose_inverse(twin.pose_world_task), twin.roi_center);
    assert_true(fabs(roi.x) < twin.half_size.x && fabs(roi.y) < twin.half_size.y);
    assert_true(twin.roi_center.x < center[1].x + half[1].x + VOXEL);
    // 30 % of the border is held, on the posterior side (-y)
    const OmMeshSet* held = om_tet_mesh_find_set(&twin.mesh, "attachment");
    const OmMeshSet* border = om_tet_mesh_find_set(&twin.mesh, "border");
    assert_near(held->nvert, 0.3 * border->nvert, 1);
    double y_held = 0, y_border = 0;
    for (int i = 0; i < held->nvert; ++i)
        y_held += twin.mesh.x[3 * held->vert[i] + 1] / held->nvert;
    for (int i = 0; i < border->nvert; ++i)
        y_border += twin.mesh.x[3 * border->vert[i] + 1] / border->nvert;
    assert_below(y_held, y_border - 0.005);
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
    assert_true(world.mesh.nvert >= 2 * twin.mesh.nvert && world.mesh.nvert <= 4 * twin.mesh.nvert);
    om_site_done(&twin);
    om_site_done(&world);
    unlink(temp_path("labels.nrrd"));
}

// A plate of one layer, 10 mm wide cells and 5 mm thick, is warned of, with the edge that its error needs (refined and
// computed apart: 12.7 %); one of three layers is not.
static void test_coarse_warning(void** state) {
    (void)state;
    OmTetMesh box;
    OmPatient p;
    OmModelReport r;
    char words[64];
    const char* path = temp_path("box.vtu");
    for (int is_fine = 0; is_fine < 2; ++is_fine) {
        assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.12, 0.02, is_fine ? 0.03 : 0.005), 12,
                                  2, is_fine ? 3 : 1, &box));
        assert_ok(om_tet_mesh_save(&box, path, OM_UNIT_M));
        om_tet_mesh_done(&box);
        OmModelDef def = om_model_default_def(path, 0.01);
        def.material[def.nmaterial++] = (OmPatientMaterial){"fat", -1, 5000, 0.45, 920};
        assert_ok(om_model_build(&def, NULL, &p, &r));
        om_patient_done(&p);
        if (is_fine) break;
        assert_near(r.bending_error, 0.1269, 0.001);
        snprintf(words, sizeof words, "bending error of this mesh: %.0f %%", 12.7);
        if (!strstr(r.warning, words)) fail_msg("%s: no \"%s\"", r.warning, words);
        snprintf(words, sizeof words, "below %.2g mm", 1e3 * r.quality.edge_mean * 0.1 / 0.1269);
        if (!strstr(r.warning, words)) fail_msg("%s: no \"%s\"", r.warning, words);
    }
    assert_true(r.bending_error < 0.1 && !strstr(r.warning, "bending"));
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_organs),
        cmocka_unit_test(test_site),
        cmocka_unit_test(test_coarse_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
