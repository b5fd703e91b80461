// test_scene_labels.c: labels that are not plain whole numbers: noise of storage, values between labels, numbers above
// 2^31.
#include "test_files.h"

#include "omentum/scene_model.h"

#define VOXEL 0.002

// ---- maps of labels -------------------------------------------------------------------------------------

enum { N = 24, FINE = 36 };

// Half-axes 9, 8 and 7 voxels; label 3 is its lower half where there are two.
static double coarse_at(int i, int j, int k, double low, double high) {
    const double c = 0.5 * (N - 1), x = (i - c) / 9, y = (j - c) / 8, z = (k - c) / 7;
    if (i < 0 || j < 0 || k < 0 || i >= N || j >= N || k >= N) return 0;
    return x * x + y * y + z * z < 1 ? (k < N / 2 ? low : high) : 0;
}

static double linear_at(double x, double y, double z, double low, double high) {
    const int i = (int)floor(x), j = (int)floor(y), k = (int)floor(z);
    double sum = 0;
    for (int c = 0; c < 8; c++) {
        double w =
            (c & 1 ? x - i : 1 - x + i) * (c & 2 ? y - j : 1 - y + j) * (c & 4 ? z - k : 1 - z + k);
        sum += w * coarse_at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2), low, high);
    }
    return sum;
}

// The coarse map on voxels of two thirds of its own, by linear interpolation.
static void make_fine(double low, double high, bool is_rounded, OmVolume* v) {
    assert_ok(om_volume_init(v, FINE, FINE, FINE));
    v->grid.axis = om_mat3_scale(VOXEL * N / FINE, om_mat3_identity());
    const double step = (double)N / FINE;
    for (int n = 0; n < FINE * FINE * FINE; n++) {
        double x[3];
        for (int a = 0; a < 3; a++)
            x[a] = ((a == 0   ? n % FINE
                     : a == 1 ? n / FINE % FINE
                              : n / FINE / FINE) +
                    0.5) *
                       step -
                   0.5;
        double f = linear_at(x[0], x[1], x[2], low, high);
        ((float*)v->voxel)[n] = (float)(is_rounded ? floor(f + 0.5) : f);
    }
}

static double coarse_volume(double low, double high, double label) {
    int count = 0;
    for (int n = 0; n < N * N * N; n++)
        count += coarse_at(n % N, n / N % N, n / N / N, low, high) == label;
    return count * VOXEL * VOXEL * VOXEL;
}

static OmModelReport build(const OmVolume* v, int label, double threshold) {
    OmModelDef def = om_model_default_def("map", 0.008);
    OmPatient p;
    OmModelReport r;
    def.has_bending_test = false;
    def.label[def.nlabel++] = label;
    def.threshold = threshold;
    assert_ok(om_model_build_volume(&def, v, NULL, &p, &r));
    for (int e = 0; e < p.mesh.ntet; e++) assert_int_equal(p.mesh.tet_label[e], label);
    om_patient_done(&p);
    return r;
}

// ---- the cases --------------------------------------------------------------------------------------------

static void test_labels_that_were_stored_with_noise(void** unused) {
    (void)unused;
    OmVolume v;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(VOXEL, om_mat3_identity());
    for (int n = 0; n < N * N * N; n++) {
        double f = coarse_at(n % N, n / N % N, n / N / N, 7015, 7015);
        ((float*)v.voxel)[n] = (float)(f > 0 ? f + (n % 2 ? -4e-4 : 4e-4) : f);
    }
    OmModelReport r = build(&v, 7015, 0);
    assert_near_rel(r.label_volume, coarse_volume(7015, 7015, 7015), 1e-9);
    assert_null(strstr(r.note, "between"));
    om_volume_done(&v);
}

// Of floats and of rounded integers. Without a threshold the rim is missing, and a note says so.
static void test_an_interpolated_label(void** unused) {
    (void)unused;
    const double truth = coarse_volume(7015, 7015, 7015);
    for (int is_rounded = 0; is_rounded < 2; is_rounded++) {
        OmVolume v;
        make_fine(7015, 7015, is_rounded, &v);
        OmModelReport rimless = build(&v, 7015, 0), whole = build(&v, 7015, 0.5);
        printf("of %.2f mL: %.2f without a threshold, %.2f with 0.5\n", truth * 1e6,
               rimless.label_volume * 1e6, whole.label_volume * 1e6);
        assert_below(rimless.label_volume, 0.85 * truth);
        assert_non_null(strstr(rimless.note, "have values between labels and are left out"));
        assert_near_rel(whole.label_volume, truth, 0.02);
        assert_non_null(strstr(whole.note, "had values between labels"));
        // a larger share takes fewer voxels
        assert_below(build(&v, 7015, 0.8).label_volume, 0.95 * whole.label_volume);
        om_volume_done(&v);
    }
}

// Two labels that touch: between 3 and 7 and between 0 and 7 lie the same values.
static void test_two_interpolated_labels(void** unused) {
    (void)unused;
    OmVolume v;
    make_fine(3, 7, false, &v);
    for (int label = 3; label <= 7; label += 4) {
        OmModelReport r = build(&v, label, 0.5);
        const double truth = coarse_volume(3, 7, label);
        printf("label %d: %.3f of %.3f mL\n", label, r.label_volume * 1e6, truth * 1e6);
        assert_near_rel(r.label_volume, truth, 0.02);
    }
    om_volume_done(&v);
}

// No label is chosen: the message names the way.
static void test_intensities_and_interpolated_labels_are_refused(void** unused) {
    (void)unused;
    OmVolume v;
    OmPatient p;
    make_fine(7, 7, false, &v);
    OmModelDef def = om_model_default_def("map", 0.008);
    def.has_bending_test = false;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "--label 7 --threshold 0.5"));
    def.threshold = 0.5;  // then one label is left
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    om_patient_done(&p);
    def.threshold = 1.5;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "threshold: 1.5"));
    for (int n = 0; n < FINE * FINE * FINE; n++) ((float*)v.voxel)[n] = 0.37f * (float)(n % 991);
    def.threshold = 0;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, NULL), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "holds intensities"));
    om_volume_done(&v);
}

// Many thin labels side by side are no interpolation.
static void test_many_labels_are_no_ramp(void** unused) {
    (void)unused;
    OmVolume v;
    make_fine(1, 1, true, &v);
    for (int n = 0; n < FINE * FINE * FINE; n++) {
        const int k = n / FINE / FINE, i = n % FINE;
        if (((float*)v.voxel)[n] > 0) ((float*)v.voxel)[n] = (float)(1 + i / 12 + 3 * (k / 12));
        if (i == 1 && k % 2) ((float*)v.voxel)[n] = (float)(20 + k);  // specks, apart
    }
    OmModelReport r = build(&v, 5, 0);
    assert_null(strstr(r.note, "between"));
    om_volume_done(&v);
}

// ---- numbers above 2^31 ---------------------------------------------------------------------------------

static void write_wide(const char* path, uint64_t a, uint64_t b) {
    static const char head[] =
        "NRRD0004\ntype: uint64\ndimension: 3\nsizes: 24 24 24\nspace: right-anterior-superior\n"
        "space units: \"mm\" \"mm\" \"mm\"\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nendian: little\n"
        "space origin: (0,0,0)\nencoding: raw\n\n";
    const size_t size = sizeof head - 1 + 8 * N * N * N;
    char* file = malloc(size);
    assert_non_null(file);
    memcpy(file, head, sizeof head - 1);
    for (int n = 0; n < N * N * N; n++) {
        const double f = coarse_at(n % N, n / N % N, n / N / N, 1, 2);
        const uint64_t value = f == 1 ? a : f == 2 ? b : 0;
        memcpy(file + sizeof head - 1 + 8 * (size_t)n, &value, 8);
    }
    write_bytes(path, file, size);
    free(file);
}

static void test_labels_above_32_bits(void** unused) {
    (void)unused;
    const char* path = temp_path("wide.nrrd");
    OmPatient p;
    OmModelReport r;
    OmLabelList list;
    write_wide(path, 1, 5000000000u);
    assert_ok(om_label_list_load(path, -1, NULL, &list));
    assert_int_equal(list.nrow, 2);
    assert_true(list.row[0].label == 1 && list.row[1].value == -1 && list.row[1].label == -1);
    assert_near(list.row[1].stored, 5e9, 0);
    assert_int_equal(list.row[1].npart, 1);
    om_label_list_done(&list);
    OmModelDef def = om_model_default_def(path, 0.008);
    def.has_bending_test = false;
    snprintf(def.label_name[0], sizeof def.label_name[0], "5000000000");
    def.nlabel_name = 1;
    assert_ok(om_model_build(&def, NULL, &p, &r));
    assert_near_rel(r.label_volume, coarse_volume(1, 2, 2), 1e-9);
    assert_non_null(strstr(r.note, "label 5000000000 has the number 1 in the model"));
    for (int e = 0; e < p.mesh.ntet; e++) assert_int_equal(p.mesh.tet_label[e], 1);
    om_patient_done(&p);
    def.label[def.nlabel++] = 1;  // beside a small label the large one gets the next number
    assert_ok(om_model_build(&def, NULL, &p, &r));
    assert_near_rel(r.label_volume, coarse_volume(1, 1, 1), 1e-9);
    assert_non_null(strstr(r.note, "label 5000000000 has the number 2 in the model"));
    om_patient_done(&p);
    static const struct {
        const char *name, *said;
    } bad[] = {{"5000000001", "no voxel has label 5000000001"},
               {"99999999999999999999", "numbers from 0 to 2^53"},
               {"-5000000000", "numbers from 0 to 2^53"},
               {"liver", "the file names no labels; choose by number"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        def.nlabel = 0;
        snprintf(def.label_name[0], sizeof def.label_name[0], "%s", bad[i].name);
        assert_status(om_model_build(&def, NULL, &p, &r), OM_INVALID);
        if (!strstr(om_error_message(), bad[i].said))
            fail_msg("label \"%s\": \"%s\"", bad[i].name, om_error_message());
    }
    write_wide(path, 6000000000u, 5000000000u);  // ascending in the list, whatever comes first
    assert_ok(om_label_list_load(path, -1, NULL, &list));
    assert_true(list.nrow == 2 && list.row[0].stored == 5e9 && list.row[1].stored == 6e9);
    om_label_list_done(&list);
    remove(path);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_labels_that_were_stored_with_noise),
        cmocka_unit_test(test_an_interpolated_label),
        cmocka_unit_test(test_two_interpolated_labels),
        cmocka_unit_test(test_intensities_and_interpolated_labels_are_refused),
        cmocka_unit_test(test_many_labels_are_no_ramp),
        cmocka_unit_test(test_labels_above_32_bits),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
