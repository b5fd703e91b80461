// A CT made here, its labels, and the patient model of tissue that lies on an organ.
#include "test_alloc.h"

#include "omentum/scene_ct.h"
#include "omentum/scene_model.h"

// A small one, for speed.
static OmCtDef small_def(uint64_t seed) {
    OmCtDef def = om_ct_default_def(seed);
    def.organ_half = 0.045;
    def.fat_half = 0.03;
    return def;
}

// Height of the organ in small_def: the superellipsoid of the header's page, written again.
static double organ_height(double x, double z) {
    double rest = 1 - pow(x / 0.045, 4) - pow(z / 0.045, 4);
    return rest > 0 ? 0.024 * (sqrt(sqrt(rest)) - 1) : -HUGE_VAL;
}

static OmVec3 tumour_center(const OmCtDef* d) {
    double y = organ_height(d->tumour_shift[0], d->tumour_shift[1]);
    return om_vec3(d->tumour_shift[0], y + d->tumour_height - d->tumour_radius, d->tumour_shift[1]);
}

static void test_densities_and_sizes(void** unused) {
    (void)unused;
    OmVolume ct, truth;
    OmCtDef def = small_def(3);
    assert_ok(om_ct_make(&def, &ct, &truth));
    double count[OM_CT_NLABEL] = {0}, sum = 0, sum2 = 0;
    int n = 0;
    for (size_t v = 0; v < om_volume_count(&ct); v++) {
        int at[3];
        count[(int)om_volume_value(&truth, v)] += pow(def.voxel, 3);
        om_grid_unpack(ct.grid.dim, v, at);
        OmVec3 p = om_voxel_grid_point(&ct.grid, om_vec3(at[0], at[1], at[2]));
        bool is_deep = p.y < organ_height(p.x, p.z) - 8e-3 && fabs(p.x) < 0.03 &&
                       fabs(p.z) < 0.03 && om_distance(p, tumour_center(&def)) > 0.014;
        if (!is_deep) continue;
        sum += om_volume_value(&ct, v);
        sum2 += pow(om_volume_value(&ct, v) - 50, 2);
        n++;
    }
    printf("organ: %.2f HU in %d voxels, deviation %.2f\n", sum / n, n, sqrt(sum2 / n));
    assert_near(sum / n, 50, 5 * def.noise / sqrt(n));  // five standard errors
    assert_near(sqrt(sum2 / n), def.noise, 0.05 * def.noise);
    double ball = 4.0 / 3 * OM_PI * pow(def.tumour_radius, 3);
    assert_near(count[OM_CT_TUMOUR], ball, 0.03 * ball);
    double plate = 4 * def.fat_half * def.fat_half * def.fat_thickness;
    assert_in_range((int)(100 * count[OM_CT_FAT] / plate), 75, 105);
    om_volume_done(&ct);
    om_volume_done(&truth);
}

// Outlines: lobes of three and of five in a turn, 5 mm below the organ's highest point; fat covers the area of a
// superellipse of exponent 4.
static void test_outlines(void** unused) {
    (void)unused;
    OmVolume ct, truth;
    OmCtDef def = small_def(3);
    def.organ_half = 0.058;
    def.organ_lobes = 0.2;
    def.fat_exponent = 4;
    assert_ok(om_ct_make(&def, &ct, &truth));
    const double edge = pow(1 - pow(19.0 / 24, 4), 0.25);  // of the half axes, 5 mm below the top
    double least = 1, most = 0;
    for (int k = 0; k < 24; ++k) {
        const double turn = k * OM_PI / 12, c = cos(turn), s = sin(turn);
        const double lobe = 0.6 * cos(3 * turn + 1) + 0.4 * cos(5 * turn - 0.5);
        const double want =
            0.058 * (1 - 0.1 * (1 - lobe)) * edge / pow(pow(c, 4) + pow(s, 4), 0.25);
        double got = 0;
        for (double r = 0; r < 0.08; r += 2e-4) {
            OmVec3 at = om_sub(om_vec3(r * c, -0.005, r * s), ct.grid.origin);
            at = om_scale(1 / def.voxel, at);
            const int i = (int)lround(at.x), j = (int)lround(at.y), h = (int)lround(at.z);
            if (i < 0 || h < 0 || i >= ct.grid.dim[0] || h >= ct.grid.dim[2]) break;
            const size_t v = om_grid_index(ct.grid.dim, i, j, h);
            if (om_volume_value(&truth, v) >= OM_CT_ORGAN) got = r;
        }
        assert_near(got, want, 1.5 * def.voxel);
        least = fmin(least, got), most = fmax(most, got);
    }
    assert_true(most > 1.2 * least);
    int ncolumn = 0;
    for (int k = 0; k < ct.grid.dim[2]; ++k)
        for (int i = 0; i < ct.grid.dim[0]; ++i) {
            bool has_fat = false;
            for (int j = 0; j < ct.grid.dim[1]; ++j)
                has_fat |=
                    om_volume_value(&truth, om_grid_index(ct.grid.dim, i, j, k)) == OM_CT_FAT;
            ncolumn += has_fat;
        }
    const double area = 4 * pow(def.fat_half * tgamma(1.25), 2) / tgamma(1.5);
    assert_near(ncolumn * def.voxel * def.voxel, area, 0.05 * area);
    def.organ_lobes = 0.1, def.organ_half = 0.04;
    def.fat_half = 0.035;
    OmVolume none[2];
    assert_status(om_ct_make(&def, &none[0], &none[1]),
                  OM_INVALID);  // corners of the fat in the air
    om_volume_done(&ct);
    om_volume_done(&truth);
}

static void test_labels_are_found(void** unused) {
    (void)unused;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        OmVolume ct, truth, labels, again;
        OmCtDef def = small_def(seed);
        def.noise = seed < 4 ? 20 : 35;
        assert_ok(om_ct_make(&def, &ct, &truth));
        assert_ok(om_ct_label(&ct, &labels));
        assert_ok(om_ct_label(&ct, &again));
        assert_near(om_ct_get_dice(&labels, &again, OM_CT_FAT), 1, 0);
        double fat = om_ct_get_dice(&labels, &truth, OM_CT_FAT),
               organ = om_ct_get_dice(&labels, &truth, OM_CT_ORGAN),
               tumour = om_ct_get_dice(&labels, &truth, OM_CT_TUMOUR);
        printf("seed %d: fat %.3f, organ %.3f, tumour %.3f\n", (int)seed, fat, organ, tumour);
        // fat of 4.7 voxels: a third of its voxels are on its surface
        assert_true(fat > 0.9 && organ > 0.98 && tumour > 0.8);
        om_volume_done(&ct);
        om_volume_done(&truth);
        om_volume_done(&labels);
        om_volume_done(&again);
    }
}

static OmModelDef model_def(void) {
    OmModelDef def = om_model_default_def("labels", 6e-3);
    def.label[def.nlabel++] = OM_CT_FAT;
    def.over.label[def.over.nlabel++] = OM_CT_ORGAN;
    def.over.label[def.over.nlabel++] = OM_CT_TUMOUR;
    def.over.roi = OM_CT_TUMOUR;
    def.refine = false;
    def.allow_loss = true;
    assert_ok(om_model_parse_attach("underside:left 30 %", &def.over.attach[def.over.nattach++]));
    return def;
}

static void assert_face(const OmPatient* p, const OmCtDef* d, const char* name) {
    const OmMeshSet* face = om_tet_mesh_find_set(&p->mesh, name);
    assert_non_null(face);
    for (int i = 0; i < face->nvert; i++) {
        OmVec3 x = om_load3(p->mesh.x, face->vert[i]);
        double above =
            fmin(x.y - organ_height(x.x, x.z), om_distance(x, tumour_center(d)) - d->tumour_radius);
        bool is_low = above < 2.5 * d->voxel;
        if (is_low != (strcmp(name, "top") != 0))
            fail_msg("%s: vertex %d is %.2f mm above the organ", name, face->vert[i], 1e3 * above);
    }
}

static void test_tissue_over_an_organ(void** unused) {
    (void)unused;
    OmCtDef ct_def = small_def(2);
    OmVolume ct, truth;
    OmPatient p;
    OmModelReport r;
    assert_ok(om_ct_make(&ct_def, &ct, &truth));
    OmModelDef def = model_def();
    assert_ok(om_model_build_volume(&def, &truth, NULL, &p, &r));
    assert_face(&p, &ct_def, "underside");
    assert_face(&p, &ct_def, "top");
    // held: the leftmost vertices of the underside
    const OmMeshSet* under = om_tet_mesh_find_set(&p.mesh, "underside");
    const OmMeshSet* held = om_tet_mesh_find_set(&p.mesh, "attachment");
    assert_near(held->nvert, 0.3 * under->nvert, 1);
    double right_most = -1;
    for (int i = 0; i < held->nvert; i++)
        right_most = fmax(right_most, om_load3(p.mesh.x, held->vert[i]).x);
    int nleft = 0;
    for (int i = 0; i < under->nvert; i++)
        nleft += om_load3(p.mesh.x, under->vert[i]).x < right_most;
    assert_true(nleft < held->nvert);
    // the ROI is the part of the tumour's ball that rises out of the organ
    for (int i = 0; i < p.nroi; i++) {
        OmVec3 x = om_load3(p.roi_point, i);
        // a voxel and a half from the label, and half a triangle
        assert_below(fabs(om_distance(x, tumour_center(&ct_def)) - ct_def.tumour_radius), 3.2e-3);
        assert_true(p.roi_normal[3 * i + 1] > 0);
    }
    assert_near(p.up.y, 1, 0);
    // messages for what cannot be
    OmPatient bad;
    def.over.roi = 9;
    assert_int_equal(om_model_build_volume(&def, &truth, NULL, &bad, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no voxel has label 9"));
    def = model_def();
    snprintf(def.over.side, sizeof def.over.side, "posterior");
    assert_int_equal(om_model_build_volume(&def, &truth, NULL, &bad, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "over: "));
    def = model_def();
    def.sheet.thickness = 0.005;
    assert_int_equal(om_model_build_volume(&def, &truth, NULL, &bad, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "exclude each other"));
    om_patient_done(&p);
    om_volume_done(&ct);
    om_volume_done(&truth);
}

static void test_bad_definitions(void** unused) {
    (void)unused;
    OmVolume ct, truth;
    OmCtDef def = om_ct_default_def(1);
    def.fat_half = def.organ_half;
    assert_int_equal(om_ct_make(&def, &ct, &truth), OM_INVALID);
    assert_null(ct.voxel);
    def = om_ct_default_def(1);
    def.tumour_shift[0] = 0.045;
    assert_int_equal(om_ct_make(&def, &ct, &truth), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "not under the fat"));
    assert_ok(om_volume_init(&ct, 8, 8, 8));  // water alone
    assert_int_equal(om_ct_label(&ct, &truth), OM_INVALID);
    assert_null(truth.voxel);
    om_volume_done(&ct);
}

static OmStatus build_all(void* ctx) {
    OmVolume ct = {0}, truth = {0}, labels = {0};
    OmPatient p = {0};
    OmCtDef ct_def = small_def(2);
    (void)ctx;
    ct_def.voxel = 2e-3;
    OmModelDef def = om_model_default_def("labels", 7e-3);
    def.label[def.nlabel++] = OM_CT_FAT;
    def.over.label[def.over.nlabel++] = OM_CT_ORGAN;
    def.over.label[def.over.nlabel++] = OM_CT_TUMOUR;
    def.over.roi = OM_CT_TUMOUR;
    def.refine = false;
    def.allow_loss = true;
    def.nworker = 1;
    OmStatus status = om_ct_make(&ct_def, &ct, &truth);
    if (status == OM_OK) status = om_ct_label(&ct, &labels);
    if (status == OM_OK) status = om_model_build_volume(&def, &labels, NULL, &p, NULL);
    om_volume_done(&ct);
    om_volume_done(&truth);
    om_volume_done(&labels);
    om_patient_done(&p);
    return status;
}

static void test_memory_runs_out(void** unused) {
    (void)unused;
    assert_true(test_failing_allocations(build_all, NULL, test_is_slow() ? 29 : 113) > 2);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_densities_and_sizes), cmocka_unit_test(test_outlines),
        cmocka_unit_test(test_labels_are_found),    cmocka_unit_test(test_tissue_over_an_organ),
        cmocka_unit_test(test_bad_definitions),     cmocka_unit_test(test_memory_runs_out),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
