// Volumes of real patients against the facts of their README, skipped where the data are not; and small made ones.
#include <zlib.h>

#include "image_common.h"

typedef struct Region {  // voxels of one label
    int count;
    OmVec3 centroid;  // mm
} Region;

static Region region_of(const OmVolume* v, double lo, double hi) {
    Region r = {0, {0, 0, 0}};
    double si = 0, sj = 0, sk = 0;
    size_t n = 0;
    for (int k = 0; k < v->grid.dim[2]; k++) {
        for (int j = 0; j < v->grid.dim[1]; j++) {
            for (int i = 0; i < v->grid.dim[0]; i++, n++) {
                double value = om_volume_value(v, n);
                if (!(value >= lo && value <= hi)) continue;
                r.count++;
                si += i;
                sj += j;
                sk += k;
            }
        }
    }
    if (r.count == 0) return r;
    OmVec3 mean = om_vec3(si / r.count, sj / r.count, sk / r.count);
    r.centroid = om_scale(1000, om_voxel_grid_point(&v->grid, mean));
    return r;
}

static void load(const char* name, OmVolume* volume) {
    assert_ok(om_volume_load(test_data(name), volume));
}

// TotalSegmentator's files carry a table of names in an extension of the header.
static void test_ct_labels_have_names(void** unused) {
    (void)unused;
    static const struct {
        int value;
        const char* name;
    } known[] = {{1, "spleen"},      {2, "kidney_right"}, {3, "kidney_left"},
                 {4, "gallbladder"}, {5, "liver"},        {6, "stomach"},
                 {7, "pancreas"},    {20, "colon"},       {52, "aorta"}};
    OmVolumeInfo info;
    assert_ok(om_volume_load_info(test_data("ct_abdomen/labels.nii.gz"), &info));
    assert_int_equal(info.nentry, 1);
    assert_int_equal(info.dim[0], 122);
    for (size_t k = 0; k < sizeof known / sizeof known[0]; k++) {
        int found = -1;
        for (int s = 0; s < info.nsegment; s++)
            if (info.segment[s].value == known[k].value) found = s;
        assert_true(found >= 0);
        assert_string_equal(info.segment[found].name, known[k].name);
    }
    om_volume_info_done(&info);
}

static void test_ct_organs_lie_where_they_should(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        int count;
        OmVec3 centroid;
    } organ[] = {{"spleen", 9630, {-113.21, 122.52, 148.71}},
                 {"kidney_right", 3996, {64.46, 125.16, 118.18}},
                 {"kidney_left", 3676, {-76.29, 122.01, 122.35}},
                 {"gallbladder", 1349, {65.30, 211.65, 116.79}},
                 {"liver", 39350, {64.00, 185.53, 149.98}}};
    static const int label[] = {1, 2, 3, 4, 5};
    OmVolume all;
    load("ct_abdomen/labels.nii.gz", &all);
    assert_int_equal(all.grid.dim[0], 122);
    assert_int_equal(all.grid.dim[2], 30);
    for (int o = 0; o < 5; o++) {
        char name[64];
        OmVolume mask;
        snprintf(name, sizeof name, "ct_abdomen/organs/%s.nii.gz", organ[o].name);
        load(name, &mask);
        Region a = region_of(&mask, 1, 1), b = region_of(&all, label[o], label[o]);
        assert_int_equal(a.count, organ[o].count);
        assert_int_equal(b.count, organ[o].count);
        assert_near(om_distance(a.centroid, organ[o].centroid), 0, 0.01);  // the README's digits
        assert_near(om_distance(b.centroid, organ[o].centroid), 0, 0.01);
        om_volume_done(&mask);
    }
    om_volume_done(&all);
}

static void test_mr_axes_are_negative(void** unused) {
    (void)unused;
    OmVolume v;
    load("mr_abdomen/labels.nii.gz", &v);
    assert_int_equal(v.grid.dim[0], 117);
    assert_below(v.grid.axis.cx.x, 0);
    assert_below(v.grid.axis.cy.y, 0);
    assert_near(om_norm(v.grid.axis.cz), 3e-3, 1e-6);
    assert_int_equal(region_of(&v, 5, 5).count, 18480);  // liver
    om_volume_done(&v);
}

static void test_breast_nrrd(void** unused) {
    (void)unused;
    static const char* const name[] = {"breast_victre/p_1.nhdr", "breast_victre/pc_1.nhdr"};
    static const double volume_mm3[] = {257618, 256225};
    static const OmVec3 nipple[] = {{60.85, 0.09, -16.76}, {66.54, -1.61, -0.94}};
    for (int f = 0; f < test_count(1, 2); f++) {
        OmVolume v;
        double start = om_clock_now();
        load(name[f], &v);
        printf("%s: %d x %d x %d in %.2f s\n", name[f], v.grid.dim[0], v.grid.dim[1], v.grid.dim[2],
               om_clock_now() - start);
        Region tissue = region_of(&v, 1, 255), paddle = region_of(&v, 50, 50);
        assert_near((tissue.count - paddle.count) * 0.008, volume_mm3[f], 1);
        // the README takes the origin for a corner of the first voxel, NRRD for its centre
        OmVec3 half = om_vec3(0.1, 0.1, 0.1);
        OmVec3 centroid = om_add(region_of(&v, 33, 33).centroid, half);
        assert_near(om_distance(centroid, nipple[f]), 0, 0.02);
        om_volume_done(&v);
    }
}

// Values of nibabel 5.4 for the same files.
static void test_corner_cases(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        int nentry, dim[3];
        double sum, mean_voxel[3];  // of the first volume; centre of the grid, mm
    } file[] = {
        {"anatomical.nii", 1, {33, 41, 25}, 284166082, {0, 0, 8}},
        {"example4d.nii.gz", 2, {128, 96, 24}, 50994397, {-9.144897, 53.93978, 33.071}},
        {"example_nifti2.nii.gz", 2, {32, 20, 12}, 3461748, {86.8551, -18.92809, 7.762624}},
        {"functional.nii", 20, {17, 21, 3}, 3883746.552, {0, 0, 8}},
        {"reoriented_anat_moved.nii", 1, {21, 26, 22}, 32739769.45, {4.702103, 2.022415, 14.40059}},
        {"resampled_anat_moved.nii", 1, {17, 21, 3}, 7749957.099, {0, 0, 8}},
    };
    for (size_t f = 0; f < sizeof file / sizeof file[0]; f++) {
        char name[128];
        OmVolume v;
        snprintf(name, sizeof name, "nifti_corner_cases/%s", file[f].name);
        OmVolumeInfo info;
        assert_ok(om_volume_load_info(test_data(name), &info));
        assert_int_equal(info.nentry, file[f].nentry);
        om_volume_info_done(&info);
        if (file[f].nentry > 1) {
            assert_status(om_volume_load(test_data(name), &v), OM_INVALID);
            assert_non_null(strstr(om_error_message(), "choose one of 0 to"));
        }
        assert_ok(om_volume_load_entry(test_data(name), 0, &v));
        size_t count = 1;
        for (int a = 0; a < 3; a++) {
            assert_int_equal(v.grid.dim[a], file[f].dim[a]);
            count *= (size_t)v.grid.dim[a];
        }
        double sum = 0;
        for (size_t i = 0; i < count; i++) sum += om_volume_value(&v, (size_t)i);
        assert_near_rel(sum, file[f].sum, 1e-6);  // voxels are rounded to float
        OmVec3 mid = om_vec3(0.5 * (v.grid.dim[0] - 1), 0.5 * (v.grid.dim[1] - 1),
                             0.5 * (v.grid.dim[2] - 1));
        OmVec3 centre = om_scale(1000, om_voxel_grid_point(&v.grid, mid));
        const double* c = file[f].mean_voxel;
        assert_near(om_distance(centre, om_vec3(c[0], c[1], c[2])), 0, 1e-3);  // float headers
        om_volume_done(&v);
    }
}

// ---- made volumes: counts and centroids by hand --------------------------------------------------------

typedef struct Block {  // of voxels with one value, ends included
    int value, lo[3], hi[3];
} Block;

static void fill(const Block* block, int nblock, const int dim[3], unsigned char* voxel) {
    memset(voxel, 0, (size_t)dim[0] * (size_t)dim[1] * (size_t)dim[2]);
    for (const Block* b = block; b < block + nblock; b++)
        for (int k = b->lo[2]; k <= b->hi[2]; k++)
            for (int j = b->lo[1]; j <= b->hi[1]; j++)
                for (int i = b->lo[0]; i <= b->hi[0]; i++)
                    voxel[i + dim[0] * (j + dim[1] * k)] = (unsigned char)b->value;
}

static void write_gz(const char* path, const void* data, size_t size) {
    gzFile file = gzopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(gzwrite(file, data, (unsigned)size), (int)size);
    assert_int_equal(gzclose(file), Z_OK);
}

// NIfTI: x = 40 - 2 i, y = 30 - 1.5 j + 0.5 k, z = 3 k - 10 (mm), as scanners turn their axes.
static void test_made_organs(void** unused) {
    (void)unused;
    enum { HEAD = 352, NX = 20, NY = 16, NZ = 12, COUNT = NX * NY * NZ };
    static const float sform[12] = {-2, 0, 0, 40, 0, -1.5f, 0.5f, 30, 0, 0, 3, -10};
    static const int dim[3] = {NX, NY, NZ};
    static const Block block[] = {{5, {4, 2, 3}, {9, 6, 6}},  // 120 voxels, middle (6.5, 4, 4.5)
                                  {2, {12, 10, 1}, {13, 13, 2}},  // 16, and 8 more: an L
                                  {2, {14, 10, 1}, {15, 11, 2}}};
    static unsigned char file[HEAD + COUNT];
    const int16_t head[8] = {3, NX, NY, NZ, 1, 1, 1, 1}, type[2] = {2, 8}, has_sform = 1;
    const int32_t size = 348;
    const float offset = HEAD;
    memcpy(file, &size, sizeof size);
    memcpy(file + 40, head, sizeof head);
    memcpy(file + 70, type, sizeof type);
    memcpy(file + 108, &offset, sizeof offset);
    file[123] = 2;  // mm
    memcpy(file + 254, &has_sform, sizeof has_sform);
    memcpy(file + 280, sform, sizeof sform);
    memcpy(file + 344, "n+1", 4);
    fill(block, 3, dim, file + HEAD);
    const char* path = temp_path("made_labels.nii.gz");
    write_gz(path, file, sizeof file);
    OmVolume v;
    assert_ok(om_volume_load(path, &v));
    for (int a = 0; a < 3; a++) assert_int_equal(v.grid.dim[a], dim[a]);
    assert_below(v.grid.axis.cx.x, 0);
    assert_near(om_norm(v.grid.axis.cz), 1e-3 * sqrt(9.25), 1e-9);
    Region box = region_of(&v, 5, 5), bent = region_of(&v, 2, 2);
    assert_int_equal(box.count, 120);
    assert_int_equal(bent.count, 24);
    // rounding of sums of 120 numbers in mm
    assert_near(om_distance(box.centroid, om_vec3(27, 26.25, 3.5)), 0, 1e-9);
    assert_near(om_distance(bent.centroid, om_vec3(41.0 / 3, 14, -5.5)), 0, 1e-9);
    om_volume_done(&v);
    remove(path);
}

// NRRD with detached, compressed voxels in LPS; the origin is the centre of the first voxel.
static void test_made_breast(void** unused) {
    (void)unused;
    static const int dim[3] = {10, 8, 6};
    static const Block block[] = {{29, {3, 2, 1}, {7, 5, 4}},   // fat, 80 voxels
                                  {33, {8, 3, 2}, {8, 3, 3}},   // nipple, 2 voxels
                                  {50, {0, 0, 0}, {9, 0, 5}}};  // paddle, 60 voxels
    unsigned char voxel[10 * 8 * 6];
    char header[512], path[2][512];
    OmVolume v;
    snprintf(path[0], sizeof path[0], "%s", temp_path("made.nhdr"));
    snprintf(path[1], sizeof path[1], "%s", temp_path("made.raw.gz"));
    int n = snprintf(header, sizeof header,
                     "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\n"
                     "sizes: 10 8 6\nspace directions: (0.2,0,0) (0,0.2,0) (0,0,0.2)\n"
                     "space origin: (-10,5,2)\nencoding: gzip\ndata file: %s\n",
                     strrchr(path[1], '/') + 1);
    fill(block, 3, dim, voxel);
    write_bytes(path[0], header, (size_t)n);
    write_gz(path[1], voxel, sizeof voxel);
    assert_ok(om_volume_load(path[0], &v));
    Region tissue = region_of(&v, 1, 255), paddle = region_of(&v, 50, 50);
    assert_int_equal(tissue.count, 142);
    assert_int_equal(paddle.count, 60);
    OmVec3 nipple = region_of(&v, 33, 33).centroid;  // x and y change sign from LPS to RAS
    assert_near(om_distance(nipple, om_vec3(8.4, -5.6, 2.5)), 0, 1e-9);
    om_volume_done(&v);
    for (int k = 0; k < 2; k++) remove(path[k]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ct_organs_lie_where_they_should),
        cmocka_unit_test(test_ct_labels_have_names),
        cmocka_unit_test(test_mr_axes_are_negative),
        cmocka_unit_test(test_breast_nrrd),
        cmocka_unit_test(test_corner_cases),
        cmocka_unit_test(test_made_organs),
        cmocka_unit_test(test_made_breast),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
