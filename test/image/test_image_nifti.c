// NIfTI-1 and 2: every type, both byte orders, both transforms, and headers that lie.
#include "image_common.h"

enum { NX = 3, NY = 4, NZ = 2, COUNT = NX * NY * NZ, HEADER = 352 };

typedef struct File {  // a NIfTI-1 file being made
    unsigned char bytes[HEADER + 8 * 8 * COUNT];
    size_t size;
    bool is_big;
} File;

static void put(File* f, size_t at, const void* value, size_t size) {
    const unsigned char* v = value;
    for (size_t i = 0; i < size; i++) f->bytes[at + i] = v[f->is_big ? size - 1 - i : i];
}
static void put16(File* f, size_t at, int value) {
    int16_t v = (int16_t)value;
    put(f, at, &v, sizeof v);
}
static void put32(File* f, size_t at, int32_t value) { put(f, at, &value, sizeof value); }
static void put_float(File* f, size_t at, double value) {
    float v = (float)value;
    put(f, at, &v, sizeof v);
}

// Millimetres, voxels of 0.7 x 0.8 x 1.5, no transform yet.
static void begin(File* f, bool is_big, int datatype, int bitpix) {
    static const int dim[8] = {3, NX, NY, NZ, 1, 1, 1, 1};
    memset(f, 0, sizeof *f);
    f->is_big = is_big;
    f->size = HEADER;
    put32(f, 0, 348);
    for (size_t i = 0; i < 8; i++) put16(f, 40 + 2 * i, dim[i]);
    put16(f, 70, datatype);
    put16(f, 72, bitpix);
    put_float(f, 76, 1);
    put_float(f, 80, 0.7);
    put_float(f, 84, 0.8);
    put_float(f, 88, 1.5);
    put_float(f, 108, HEADER);
    f->bytes[123] = 2;
    memcpy(f->bytes + 344, "n+1", 4);
}

static void put_sform(File* f, OmMat3 axis, OmVec3 origin) {
    put16(f, 254, 1);
    const OmVec3 col[4] = {axis.cx, axis.cy, axis.cz, origin};
    for (size_t c = 0; c < 4; c++) {
        put_float(f, 280 + 4 * c, col[c].x);
        put_float(f, 296 + 4 * c, col[c].y);
        put_float(f, 312 + 4 * c, col[c].z);
    }
}

static void put_qform(File* f, double b, double c, double d) {
    put16(f, 252, 1);
    put_float(f, 256, b);
    put_float(f, 260, c);
    put_float(f, 264, d);
}

static void put_bytes(File* f) {  // the voxels 0, 1, 2 ...
    for (int i = 0; i < COUNT; i++) f->bytes[f->size++] = (unsigned char)i;
}

static OmStatus load(const File* f, OmVolume* volume) {
    return load_bytes("t.nii", f->bytes, f->size, volume);
}

#define PUT_VOXELS(type)                         \
    for (int i = 0; i < COUNT; i++) {            \
        type stored = (type)(3 * i);             \
        put(&f, f.size, &stored, sizeof stored); \
        f.size += sizeof stored;                 \
    }

static void test_all_types_in_both_orders(void** unused) {
    (void)unused;
    static const int type[][2] = {{2, 8},   {4, 16},   {8, 32},   {16, 32},   {64, 64},
                                  {256, 8}, {512, 16}, {768, 32}, {1024, 64}, {1280, 64}};
    for (size_t t = 0; t < 10; t++) {
        for (int is_big = 0; is_big < 2; is_big++) {
            File f;
            OmVolume v;
            begin(&f, is_big, type[t][0], type[t][1]);
            put_sform(&f, om_mat3_diag(om_vec3(0.7, 0.8, 1.5)), om_vec3(0, 0, 0));
            switch (type[t][0]) {
            case 2: PUT_VOXELS(uint8_t) break;
            case 4: PUT_VOXELS(int16_t) break;
            case 8: PUT_VOXELS(int32_t) break;
            case 16: PUT_VOXELS(float) break;
            case 64: PUT_VOXELS(double) break;
            case 256: PUT_VOXELS(int8_t) break;
            case 512: PUT_VOXELS(uint16_t) break;
            case 768: PUT_VOXELS(uint32_t) break;
            case 1024: PUT_VOXELS(int64_t) break;
            default: PUT_VOXELS(uint64_t) break;
            }
            assert_ok(load(&f, &v));
            assert_int_equal(v.grid.dim[0], NX);
            assert_int_equal(v.grid.dim[1], NY);
            assert_int_equal(v.grid.dim[2], NZ);
            for (int i = 0; i < COUNT; i++) assert_near(om_volume_value(&v, (size_t)i), 3 * i, 0);
            om_volume_done(&v);
        }
    }
}

// The quaternion and the matrix of one rotation place the voxels alike; a negative pixdim[0] mirrors.
static void test_qform_is_sform(void** unused) {
    (void)unused;
    OmRng rng = om_rng_init(5, 0);
    for (int k = 0; k < 50; k++) {
        OmQuat q = {om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng),
                    fabs(om_rng_normal(&rng))};
        double len = sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
        if (k == 0) q.w = 0, len = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);  // half a turn
        q = (OmQuat){q.x / len, q.y / len, q.z / len, q.w / len};
        double mirror = k % 2 ? -1 : 1;
        OmMat3 r = om_quat_to_mat3(q);
        OmMat3 axis =
            om_mat3_cols(om_scale(0.7, r.cx), om_scale(0.8, r.cy), om_scale(1.5 * mirror, r.cz));
        OmVec3 origin = om_vec3(-10, 20, 30);
        File a, b;
        OmVolume va, vb;
        begin(&a, false, 2, 8);
        put16(&a, 252, 1);
        put_float(&a, 76, mirror);
        const double field[6] = {q.x, q.y, q.z, origin.x, origin.y, origin.z};
        for (size_t i = 0; i < 6; i++) put_float(&a, 256 + 4 * i, field[i]);
        put_bytes(&a);
        begin(&b, false, 2, 8);
        put_sform(&b, axis, origin);
        put_bytes(&b);
        assert_ok(load(&a, &va));
        assert_ok(load(&b, &vb));
        // single precision in the header; w is found from the rest by a root
        double tol = 1e-3 * (k == 0 ? 2e-3 : 2e-5);
        assert_near(om_distance(va.grid.axis.cx, vb.grid.axis.cx), 0, tol);
        assert_near(om_distance(va.grid.axis.cy, vb.grid.axis.cy), 0, tol);
        assert_near(om_distance(va.grid.axis.cz, vb.grid.axis.cz), 0, tol);
        assert_near(om_distance(va.grid.origin, vb.grid.origin), 0, 1e-9);
        assert_near(om_distance(vb.grid.origin, om_scale(1e-3, origin)), 0, 1e-9);
        om_volume_done(&va);
        om_volume_done(&vb);
    }
}

// A file may have both transforms, and they may differ: sform, where it is set, is the one that counts (NIfTI-1.1,
// method 3 before method 2).
static void test_sform_goes_before_qform(void** unused) {
    (void)unused;
    File f;
    OmVolume v;
    begin(&f, false, 2, 8);
    put16(&f, 252, 1);
    put_float(&f, 268, 77);  // x of the qform's origin; its quaternion is that of no turn
    put_sform(&f, om_mat3_diag(om_vec3(-2, 3, 4)), om_vec3(5, 6, 7));
    put_bytes(&f);
    assert_ok(load(&f, &v));
    assert_near(om_distance(v.grid.axis.cx, om_vec3(-0.002, 0, 0)), 0, 1e-12);
    assert_near(om_distance(v.grid.axis.cz, om_vec3(0, 0, 0.004)), 0, 1e-12);
    assert_near(om_distance(v.grid.origin, om_vec3(0.005, 0.006, 0.007)), 0, 1e-12);
    om_volume_done(&v);
}

// Values that only the right type holds: the largest of 16 bits without a sign, and -1 with one.
// sform, qform and voxel sizes that contradict each other are named in one sentence; the sform is used.
static void test_contradictions_are_named(void** unused) {
    (void)unused;
    static const struct {
        double side, quatern[3],
            slice;         // sign of the first axis of the sform, qform, size of a slice
        int code;          // of the sform
        const char* said;  // null: nothing
    } row[] = {
        {1, {0, 0, 0}, 1.5, 1, NULL},
        {-1, {0, 0, 0}, 1.5, 1, "mirror each other (left and right)"},
        {-1, {0, 0, 0}, 1.5, 4, "mirror each other (left and right)"},  // also against an atlas
        {1,
         {0, 0, 1},
         1.5,
         1,
         "differ by a turn of 180 degrees, which may exchange left and right"},
        {1, {0, 0, 0.2}, 1.5, 1, "differ by a turn of 23 degrees"},
        {1, {0, 0, 0.2}, 1.5, 4, NULL},  // of the scanner and of an atlas: both may hold
        {1, {0, 0, 0}, 3, 1, "states voxels of 0.7 x 0.8 x 1.5, its sform of 0.7 x 0.8 x 3"},
        {1, {0, 0, 0}, 1.8, 4, NULL},
        {-1, {0, 0, 0}, 3, 1, "check the side of the organ; pixdim of the header states"},
        {1, {NAN, 0, 0}, 1.5, 1, NULL},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        File f;
        OmVolumeInfo info;
        OmVolume v;
        begin(&f, false, 2, 8);
        put_sform(&f, om_mat3_diag(om_vec3(0.7 * row[i].side, 0.8, row[i].slice)),
                  om_vec3(1, 2, 3));
        put16(&f, 254, row[i].code);
        put_qform(&f, row[i].quatern[0], row[i].quatern[1], row[i].quatern[2]);
        put_bytes(&f);
        const char* path = temp_path("t.nii");
        write_bytes(path, f.bytes, f.size);
        assert_ok(om_volume_load_info(path, &info));
        const bool is_right =
            row[i].said ? strstr(info.note, row[i].said) != NULL : info.note[0] == 0;
        if (!is_right) fail_msg("row %zu: \"%s\"", i, info.note);
        om_volume_info_done(&info);
        assert_ok(om_volume_load(path, &v));
        assert_near(v.grid.axis.cx.x, 0.7e-3 * row[i].side, 1e-9);
        om_volume_done(&v);
        remove(path);
    }
}

static void test_signs_of_types(void** unused) {
    (void)unused;
    static const struct {
        int type, bits;
        double wanted;
    } item[] = {{2, 8, 255}, {256, 8, -1},   {512, 16, 65535},       {4, 16, -1},
                {8, 32, -1}, {1024, 64, -1}, {768, 32, 4294967295.0}};
    for (int k = 0; k < 7; k++) {
        File f;
        OmVolume v;
        begin(&f, false, item[k].type, item[k].bits);
        put_sform(&f, om_mat3_identity(), om_vec3(0, 0, 0));
        memset(f.bytes + f.size, 0xff, (size_t)(item[k].bits / 8 * COUNT));
        f.size += (size_t)(item[k].bits / 8 * COUNT);
        assert_ok(load(&f, &v));
        for (int i = 0; i < COUNT; i++)
            assert_near(om_volume_value(&v, (size_t)i), item[k].wanted,
                        1e-7 * fabs(item[k].wanted));  // floats
        om_volume_done(&v);
    }
}

// NIfTI-2: the same image as a header of 540 bytes, fields where nifti2.h has them.
static void test_version_2(void** unused) {
    (void)unused;
    enum { HEADER2 = 544 };
    for (int has_sform = 0; has_sform < 2; has_sform++) {
        unsigned char h[HEADER2 + 2 * COUNT] = {0};
        const int32_t size = 540, form = 1, unit = 2;
        const int64_t dim[8] = {3, NX, NY, NZ, 1, 1, 1, 1}, offset = HEADER2;
        const double pixdim[8] = {-1, 0.5, 0.75, 2}, slope = 2, inter = -3;
        const double quatern[3] = {0, 0, sqrt(0.5)}, origin[3] = {11, -12, 13};
        const double row[12] = {0, -0.5, 0, 21, 0.75, 0, 0, -22, 0, 0, 2, 23};
        const int16_t type = 4, bits = 16;
        memcpy(h, &size, 4);
        memcpy(h + 4, "n+2\0\r\n\032\n", 8);
        memcpy(h + 12, &type, 2);
        memcpy(h + 14, &bits, 2);
        memcpy(h + 16, dim, 64);
        memcpy(h + 104, pixdim, 64);
        memcpy(h + 168, &offset, 8);
        memcpy(h + 176, &slope, 8);
        memcpy(h + 184, &inter, 8);
        memcpy(h + (has_sform ? 348 : 344), &form, 4);
        memcpy(h + 352, quatern, 24);
        memcpy(h + 376, origin, 24);
        memcpy(h + 400, row, 96);
        memcpy(h + 500, &unit, 4);
        for (int i = 0; i < COUNT; i++) {
            int16_t value = (int16_t)(i - 7);
            memcpy(h + HEADER2 + 2 * i, &value, 2);
        }
        OmVolume v;
        assert_ok(load_bytes("t.nii", h, sizeof h, &v));
        assert_int_equal(v.grid.dim[1], NY);
        for (int i = 0; i < COUNT; i++)
            assert_near(om_volume_value(&v, (size_t)i), 2 * (i - 7) - 3, 0);
        if (has_sform) {  // columns of the rows
            assert_near(om_distance(v.grid.axis.cx, om_vec3(0, 0.00075, 0)), 0, 1e-15);
            assert_near(om_distance(v.grid.axis.cy, om_vec3(-0.0005, 0, 0)), 0, 1e-15);
            assert_near(om_distance(v.grid.origin, om_vec3(0.021, -0.022, 0.023)), 0, 1e-15);
        } else {  // a quarter turn about z: x to y, y to -x; the third axis is mirrored
            assert_near(om_distance(v.grid.axis.cx, om_vec3(0, 0.0005, 0)), 0, 1e-12);
            assert_near(om_distance(v.grid.axis.cy, om_vec3(-0.00075, 0, 0)), 0, 1e-12);
            assert_near(om_distance(v.grid.axis.cz, om_vec3(0, 0, -0.002)), 0, 1e-12);
            assert_near(om_distance(v.grid.origin, om_vec3(0.011, -0.012, 0.013)), 0, 1e-12);
        }
        om_volume_done(&v);
    }
}

// Turn the axes of the grid in the file and its header with them: every value stays where it was.
static void test_turned_header_gives_the_same_organ(void** unused) {
    (void)unused;
    OmMat3 axis = om_mat3_cols(om_vec3(0.7, 0.1, 0), om_vec3(-0.1, 0.8, 0), om_vec3(0, 0.2, 1.5));
    OmVec3 origin = om_vec3(-10, 20, 30);
    File a, b;
    OmVolume va, vb;
    begin(&a, false, 2, 8);
    put_sform(&a, axis, origin);
    put_bytes(&a);
    begin(&b, false, 2, 8);  // the first axis backwards
    put_sform(&b, om_mat3_cols(om_scale(-1, axis.cx), axis.cy, axis.cz),
              om_add(origin, om_scale(NX - 1, axis.cx)));
    for (int i = 0; i < COUNT; i++)
        b.bytes[b.size++] = (unsigned char)(i / NX * NX + NX - 1 - i % NX);
    assert_ok(load(&a, &va));
    assert_ok(load(&b, &vb));
    for (int n = 0; n < COUNT; n++) {
        int mirrored = n / NX * NX + NX - 1 - n % NX;
        OmVec3 i = om_vec3(n % NX, n / NX % NY, n / NX / NY);
        OmVec3 j = om_vec3(NX - 1 - n % NX, i.y, i.z);
        OmVec3 p = om_voxel_grid_point(&va.grid, i);
        OmVec3 q = om_voxel_grid_point(&vb.grid, j);
        assert_near(om_distance(p, q), 0, 1e-8);  // floats of the header, m
        assert_near(om_volume_value(&va, (size_t)n), om_volume_value(&vb, (size_t)(mirrored)), 0);
    }
    om_volume_done(&va);
    om_volume_done(&vb);
}

static void test_units_and_scaling(void** unused) {
    (void)unused;
    static const double slope[] = {2, 0, NAN}, first[] = {-5, 0, 0}, second[] = {-3, 1, 1};
    static const double metre[] = {1e-3, 1, 1e-3, 1e-6};  // unset, m, mm, um
    for (int k = 0; k < 4; k++) {
        File f;
        OmVolume v;
        begin(&f, false, 2, 8);
        put_sform(&f, om_mat3_identity(), om_vec3(1, 2, 3));
        f.bytes[123] = (unsigned char)k;
        put_float(&f, 112, slope[k % 3]);
        put_float(&f, 116, -5);
        put_bytes(&f);
        assert_ok(load(&f, &v));
        assert_near_rel(v.grid.axis.cx.x, metre[k], 1e-12);
        assert_near_rel(v.grid.origin.z, 3 * metre[k], 1e-12);
        assert_near(om_volume_value(&v, (size_t)0), first[k % 3], 0);
        assert_near(om_volume_value(&v, (size_t)1), second[k % 3], 0);
        om_volume_done(&v);
    }
}

// Two times by three components: none is read unless it is chosen, and the fourth axis counts fastest.
static void test_one_of_a_series_is_read(void** unused) {
    (void)unused;
    enum { NENTRY = 6 };
    File f;
    OmVolume v;
    begin(&f, false, 2, 8);
    put_sform(&f, om_mat3_identity(), om_vec3(0, 0, 0));
    put16(&f, 40, 5);
    put16(&f, 48, 2);
    put16(&f, 50, 3);
    for (int e = 0; e < NENTRY; e++)
        for (int i = 0; i < COUNT; i++) f.bytes[f.size++] = (unsigned char)(i + 30 * e);
    assert_refused(load(&f, &v), &v, "t.nii", "holds 6 volumes");
    const char* path = temp_path("t.nii");
    write_bytes(path, f.bytes, f.size);
    for (int e = 0; e < NENTRY; e++) {
        assert_ok(om_volume_load_entry(path, e, &v));
        assert_int_equal(v.grid.dim[2], NZ);
        for (int i = 0; i < COUNT; i++) assert_near(om_volume_value(&v, (size_t)i), i + 30 * e, 0);
        om_volume_done(&v);
    }
    assert_refused(om_volume_load_entry(path, NENTRY, &v), &v, "t.nii", "holds volumes 0 to 5");
    write_bytes(path, f.bytes, f.size - 1);
    assert_refused(om_volume_load_entry(path, NENTRY - 1, &v), &v, "t.nii", "too early");
    put16(&f, 40, 7);  // more volumes than an int counts
    for (size_t a = 0; a < 4; a++) put16(&f, 48 + 2 * a, 32000);
    assert_refused(load(&f, &v), &v, "t.nii", "more than 2147483647 volumes");
    remove(path);
}

// A table of labels between header and voxels; what is damaged there costs no more than names.
static void test_names_in_an_extension(void** unused) {
    (void)unused;
    static const char table[] =
        "<?xml?><CaretExtension><LabelTable>\n<Label Key=\"0\"><![CDATA[???]]></Label>"
        "<Label Key=\"5\" Red=\"1\"><![CDATA[liver]]></Label><Label Key=\"6\">left \x01 one</Label>"
        "<Label Key=\"x\">none</Label><Label Key=\"9\"><![CDATA[cut";
    for (int damage = 0; damage < 3; damage++) {
        File f;
        OmVolume v;
        OmVolumeInfo info;
        unsigned char file[2048] = {0};
        begin(&f, damage == 1, 2, 8);
        put_sform(&f, om_mat3_identity(), om_vec3(0, 0, 0));
        size_t n = 8 + sizeof table - 1;
        f.bytes[348] = 1;
        put32(&f, HEADER, damage == 2 ? 1 << 30 : (int32_t)n);
        put_float(&f, 108, (double)(HEADER + n));
        memcpy(file, f.bytes, HEADER + 8);
        memcpy(file + HEADER + 8, table, sizeof table - 1);
        size_t size = HEADER + n;
        for (int i = 0; i < COUNT; i++) file[size++] = (unsigned char)i;
        const char* path = temp_path("t.nii");
        write_bytes(path, file, size);
        assert_ok(om_volume_load_info(path, &info));
        assert_int_equal(info.nsegment, damage == 2 ? 0 : 2);
        if (info.nsegment) {
            assert_string_equal(info.segment[0].name, "liver");
            assert_int_equal(info.segment[0].value, 5);
            assert_string_equal(info.segment[1].name, "left   one");
            assert_int_equal(info.segment[1].value, 6);
            assert_int_equal(info.segment[1].layer, 0);
        }
        om_volume_info_done(&info);
        assert_ok(om_volume_load(path, &v));
        assert_near(om_volume_value(&v, COUNT - 1), COUNT - 1, 0);
        om_volume_done(&v);
        remove(path);
    }
}

static void test_compressed_and_paired_files(void** unused) {
    (void)unused;
    OmVolume plain, other;
    assert_ok(om_volume_load("fuzz/corpus/nifti/u8_sform.nii", &plain));
    assert_ok(om_volume_load("fuzz/corpus/nifti/u8_sform.nii.gz", &other));
    assert_memory_equal(plain.voxel, other.voxel, COUNT);
    om_volume_done(&other);

    char *hdr, path[2][512];
    size_t size;
    unsigned char voxel[COUNT];
    for (int i = 0; i < COUNT; i++) voxel[i] = (unsigned char)i;
    assert_ok(om_file_read("fuzz/corpus/nifti/pair.hdr", 4096, &hdr, &size));
    memset(hdr + 108, 0, 4);  // the voxels begin their file
    snprintf(path[0], sizeof path[0], "%s", temp_path("pair.hdr"));
    snprintf(path[1], sizeof path[1], "%s", temp_path("pair.img"));
    write_bytes(path[0], hdr, size);
    assert_status(om_volume_load(path[0], &other), OM_IO);
    assert_non_null(strstr(om_error_message(), "pair.img"));
    write_bytes(path[1], voxel, sizeof voxel);
    for (int half = 0; half < 2; half++) {
        assert_ok(om_volume_load(path[half], &other));
        assert_memory_equal(plain.voxel, other.voxel, COUNT);
        om_volume_done(&other);
    }
    remove(path[0]);
    remove(path[1]);
    om_free(hdr);
    om_volume_done(&plain);
}

static void test_voxels_that_are_not_finite_become_zero(void** unused) {
    (void)unused;
    File f;
    OmVolume v;
    begin(&f, false, 16, 32);
    put_sform(&f, om_mat3_identity(), om_vec3(0, 0, 0));
    for (int i = 0; i < COUNT; i++, f.size += 4)
        put_float(&f, f.size, i == 3 ? NAN : i == 4 ? INFINITY : i);
    assert_ok(load(&f, &v));
    assert_near(om_volume_value(&v, (size_t)3), 0, 0);
    assert_near(om_volume_value(&v, (size_t)4), 0, 0);
    assert_near(om_volume_value(&v, (size_t)5), 5, 0);
    om_volume_done(&v);
}

static void test_headers_that_lie(void** unused) {
    (void)unused;
    static const struct {
        int at, size;  // 2: an integer of 16 bits, 4: a float, 1: a byte
        double value;
        const char* expected;
    } lie[] = {{0, 2, 349, "neither 348 nor 540"},
               {344, 1, 'x', "no NIfTI mark"},
               {40, 2, 0, "field dim: 0 axes"},
               {40, 2, 9, "field dim: 9 axes"},
               {42, 2, -3, "-3 voxels along axis 0"},
               {42, 2, 0, "0 voxels along axis 0"},
               {46, 2, 30000, "30000 voxels"},
               {70, 2, 128, "field datatype: 128"},
               {72, 2, 16, "datatype (2) and bitpix (16) disagree"},
               {108, 4, NAN, "vox_offset"},
               {108, 4, -1, "vox_offset"},
               {108, 4, 100, "inside the header"},
               {108, 4, 1e9, "behind the end"},
               {112, 4, INFINITY, "scl_slope"},
               {123, 1, 5, "xyzt_units"},
               {280, 4, NAN, "not finite"},
               {280, 4, 0, "singular"}};
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        File f;
        OmVolume v;
        begin(&f, false, 2, 8);
        put_sform(&f, om_mat3_diag(om_vec3(0.7, 0.8, 1.5)), om_vec3(0, 0, 0));
        put_bytes(&f);
        size_t at = (size_t)lie[i].at;
        if (lie[i].size == 1) f.bytes[at] = (unsigned char)lie[i].value;
        if (lie[i].size == 2) put16(&f, at, (int)lie[i].value);
        if (lie[i].size == 4) put_float(&f, at, lie[i].value);
        assert_refused(load(&f, &v), &v, "t.nii", lie[i].expected);
    }
    OmVolume v;
    assert_refused(load_bytes("t.nii", "", 0, &v), &v, "t.nii", "empty");
    assert_refused(load_bytes("t.dcm", "x", 1, &v), &v, "t.dcm", "dcm2niix");
    assert_refused(load_bytes("t.nii.gz", "\x1f\x8bxyz", 5, &v), &v, "t.nii.gz", "gzip");
    assert_status(om_volume_load("/nowhere/a.nii", &v), OM_IO);
    assert_non_null(strstr(om_error_message(), "/nowhere/a.nii"));
}

static void test_seeds_cut_and_starved(void** unused) {
    (void)unused;
    assert_seeds_are_survived("fuzz/corpus/nifti");
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_all_types_in_both_orders),
        cmocka_unit_test(test_qform_is_sform),
        cmocka_unit_test(test_sform_goes_before_qform),
        cmocka_unit_test(test_contradictions_are_named),
        cmocka_unit_test(test_signs_of_types),
        cmocka_unit_test(test_version_2),
        cmocka_unit_test(test_turned_header_gives_the_same_organ),
        cmocka_unit_test(test_units_and_scaling),
        cmocka_unit_test(test_one_of_a_series_is_read),
        cmocka_unit_test(test_names_in_an_extension),
        cmocka_unit_test(test_compressed_and_paired_files),
        cmocka_unit_test(test_voxels_that_are_not_finite_become_zero),
        cmocka_unit_test(test_headers_that_lie),
        cmocka_unit_test(test_seeds_cut_and_starved),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
