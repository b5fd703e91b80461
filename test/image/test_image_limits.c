// Large volumes: what they take of memory, and what is refused from the header.
#include "image_common.h"
#include "test_peak.h"

#include <sys/stat.h>
#include <zlib.h>

enum { SIDE = 256, COUNT = SIDE * SIDE * SIDE, HEADER = 352 };

// A NIfTI header of nx x ny x nz voxels with unit axes.
static void nifti_header(int nx, int ny, int nz, int datatype, int bitpix, unsigned char* h) {
    const int16_t dim[8] = {3, (int16_t)nx, (int16_t)ny, (int16_t)nz, 1, 1, 1, 1};
    const int32_t size = 348;
    const int16_t type = (int16_t)datatype, bits = (int16_t)bitpix, one = 1;
    const float offset = HEADER, unit = 1;
    memset(h, 0, HEADER);
    memcpy(h, &size, 4);
    memcpy(h + 40, dim, sizeof dim);
    memcpy(h + 70, &type, 2);
    memcpy(h + 72, &bits, 2);
    memcpy(h + 108, &offset, 4);
    h[123] = 2;
    memcpy(h + 254, &one, 2);
    for (size_t a = 0; a < 3; a++) memcpy(h + 280 + 20 * a, &unit, 4);
    memcpy(h + 344, "n+1", 4);
}

// Head and `size` bytes of noise (or zeros) into a file, by zlib where `is_gzip`; the bytes it takes on the disk.
static double write_volume(const char* path, const void* head, size_t nhead, size_t size,
                           bool is_zero, bool is_gzip) {
    static unsigned char block[1 << 16];
    OmRng rng = om_rng_init(1, 0);
    for (size_t i = 0; i < sizeof block; i++)
        block[i] = is_zero ? 0 : (unsigned char)om_rng_below(&rng, 256);
    FILE* plain = is_gzip ? NULL : fopen(path, "wb");
    // noise: Huffman codes alone
    gzFile packed = is_gzip ? gzopen(path, is_zero ? "wb9" : "wb1h") : NULL;
    assert_true(plain || packed);
    if (plain)
        assert_int_equal(fwrite(head, 1, nhead, plain), nhead);
    else
        assert_int_equal(gzwrite(packed, head, (unsigned)nhead), (int)nhead);
    for (size_t done = 0; done < size; done += sizeof block) {
        size_t n = size - done < sizeof block ? size - done : sizeof block;
        if (plain)
            assert_int_equal(fwrite(block, 1, n, plain), n);
        else
            assert_int_equal(gzwrite(packed, block, (unsigned)n), (int)n);
    }
    if (plain) assert_int_equal(fclose(plain), 0);
    if (packed) assert_int_equal(gzclose(packed), Z_OK);
    struct stat st;
    assert_int_equal(stat(path, &st), 0);
    return (double)st.st_size;
}

static OmStatus load_counted(const char* path, double* peak) {
    OmVolume v;
    test_peak_begin();
    OmStatus status = om_volume_load(path, &v);
    om_volume_done(&v);
    *peak = (double)test_peak_end();
    return status;
}

// Voxels, once, and less than a MB beside them: far below 2.5 times the volume, raw or packed.
static void test_memory_is_that_of_the_voxels(void** unused) {
    (void)unused;
    for (int type = 0; type < 2; type++) {  // bytes, 16-bit integers
        size_t size = (size_t)COUNT * (size_t)(type + 1);
        unsigned char head[HEADER];
        char text[256];
        nifti_header(SIDE, SIDE, SIDE, type ? 4 : 2, type ? 16 : 8, head);
        for (int form = 0; form < 4; form++) {
            bool is_gzip = form % 2 == 1, is_nrrd = form > 1;
            const char* path = temp_path(is_nrrd ? "m.nrrd" : is_gzip ? "m.nii.gz" : "m.nii");
            if (!is_nrrd) write_volume(path, head, HEADER, size, false, is_gzip);
            if (is_nrrd) {  // the header of NRRD is not packed with the voxels
                char packed[512];
                snprintf(packed, sizeof packed, "%s.gz", path);
                write_volume(packed, "", 0, size, false, is_gzip);
                int n = snprintf(text, sizeof text,
                                 "NRRD0004\ntype: %s\nencoding: %s\nendian: little\ndimension: 3\n"
                                 "sizes: %d %d %d\nspace: RAS\nspace directions: (1,0,0) (0,1,0) "
                                 "(0,0,1)\ndata file: %s\n\n",
                                 type ? "short" : "uchar", is_gzip ? "gzip" : "raw", SIDE, SIDE,
                                 SIDE, strrchr(packed, '/') + 1);
                write_bytes(path, text, (size_t)n);
            }
            double peak;
            assert_ok(load_counted(path, &peak));
            assert_below(peak, 1.05 * (double)size);
            char packed[512];
            snprintf(packed, sizeof packed, "%s.gz", path);
            remove(packed);
            remove(path);
        }
    }
}

// Zeros that deflate packs 1 : 1000 cost their bytes.
static void test_zeros_cost_their_bytes(void** unused) {
    (void)unused;
    const char* path = temp_path("zeros.nii.gz");
    unsigned char head[HEADER];
    nifti_header(512, 512, 256, 2, 8, head);
    size_t size = (size_t)512 * 512 * 256;
    double stored = write_volume(path, head, HEADER, size, true, true), peak;
    assert_below(stored * 900, (double)size);
    assert_ok(load_counted(path, &peak));
    assert_below(peak, 1.01 * (double)size);
    remove(path);
}

// Two thousand million voxels, which the few MB that follow could hold by the ratio: refused from the header.
static void test_too_many_voxels_are_not_inflated(void** unused) {
    (void)unused;
    const char* path = temp_path("bomb.nii.gz");
    unsigned char head[HEADER];
    nifti_header(1290, 1290, 1290, 2, 8, head);
    double stored = write_volume(path, head, HEADER, (size_t)4 << 20, false, true), peak;
    assert_below(1290.0 * 1290 * 1290, stored * 1032);
    assert_status(load_counted(path, &peak), OM_INVALID);
    assert_below(peak, 1e6);
    assert_non_null(strstr(om_error_message(), "at most 1.07 GB"));
    assert_non_null(strstr(om_error_message(), "--max-volume"));
    remove(path);
}

static void test_the_limit_can_be_set(void** unused) {
    (void)unused;
    OmVolume v;
    const char* seed = "fuzz/corpus/nifti/u8_sform.nii";
    assert_ok(om_volume_load_within(seed, -1, 24, &v));
    assert_int_equal(om_volume_count(&v), 24);
    om_volume_done(&v);
    assert_status(om_volume_load_within(seed, -1, 23, &v), OM_INVALID);
    assert_null(v.voxel);
}

// Scales that no image has. Within the range no stored value becomes infinite, however large.
static void test_absurd_scales(void** unused) {
    (void)unused;
    static const struct {
        float slope, inter;
        const char* expected;  // null: it is read
    } scale[] = {{1e38f, 0, "field scl_slope"},
                 {-1e38f, 0, "field scl_slope"},
                 {INFINITY, 0, "field scl_slope"},
                 {1e-38f, 0, "field scl_slope"},
                 {2, 3e38f, "field scl_inter"},
                 {2, -INFINITY, "field scl_inter"},
                 {1e12f, 1e11f, NULL},
                 {1e-12f, 0, NULL}};
    for (size_t i = 0; i < sizeof scale / sizeof *scale; i++) {
        unsigned char file[HEADER + 24];
        OmVolume v;
        nifti_header(2, 3, 4, 2, 8, file);
        memcpy(file + 112, &scale[i].slope, 4);
        memcpy(file + 116, &scale[i].inter, 4);
        memset(file + HEADER, 255, 24);
        OmStatus status = load_bytes("t.nii", file, sizeof file, &v);
        if (scale[i].expected) {
            assert_refused(status, &v, "t.nii", scale[i].expected);
        } else {
            assert_ok(status);
            assert_near_rel(om_volume_value(&v, 23),
                            255 * (double)scale[i].slope + (double)scale[i].inter, 1e-12);
            om_volume_done(&v);
        }
    }
}

// Floats of which none is finite, as a damaged order of bytes may give.
static void test_no_finite_voxel(void** unused) {
    (void)unused;
    unsigned char file[HEADER + 96];
    OmVolume v;
    nifti_header(2, 3, 4, 16, 32, file);
    memset(file + HEADER, 255, 96);
    assert_refused(load_bytes("t.nii", file, sizeof file, &v), &v, "t.nii",
                   "none of the 24 voxels is a finite number");
}

// A pipe as volume, as its other half and as detached voxels: refused, not waited for.
static void test_pipes_are_refused(void** unused) {
    (void)unused;
    OmVolume v;
    static const char header[] =
        "NRRD0004\ntype: uchar\nencoding: raw\ndimension: 3\nsizes: 2 3 4\nspace: RAS\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\ndata file: %s\n\n";
    char pipe[512], text[512];
    snprintf(pipe, sizeof pipe, "%s", temp_path("pipe.nii"));
    assert_int_equal(mkfifo(pipe, 0600), 0);
    assert_status(om_volume_load(pipe, &v), OM_IO);
    assert_non_null(strstr(om_error_message(), "is a pipe, a file is wanted"));
    const char* path = temp_path("pipe.nhdr");
    int n = snprintf(text, sizeof text, header, strrchr(pipe, '/') + 1);
    write_bytes(path, text, (size_t)n);
    assert_status(om_volume_load(path, &v), OM_IO);
    assert_non_null(strstr(om_error_message(), "is a pipe, a file is wanted"));
    remove(path);
    remove(pipe);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_memory_is_that_of_the_voxels),
        cmocka_unit_test(test_zeros_cost_their_bytes),
        cmocka_unit_test(test_too_many_voxels_are_not_inflated),
        cmocka_unit_test(test_the_limit_can_be_set),
        cmocka_unit_test(test_absurd_scales),
        cmocka_unit_test(test_no_finite_voxel),
        cmocka_unit_test(test_pipes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
