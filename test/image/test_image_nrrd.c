// NRRD: types, encodings, spaces, axes that are not of space, and headers that lie.
#include "image_common.h"

enum { NX = 3, NY = 4, NZ = 2, COUNT = NX * NY * NZ };

#define GRID                                                                                \
    "dimension: 3\nsizes: 3 4 2\nspace directions: (0.7,0.1,0) (0,0.8,0) (0,0,1.5)\nspace " \
    "origin: (-10,20,30)\n"

// The header, an empty line and the voxels 0, 1, 2 ... as bytes (nbyte of them).
static OmStatus load(const char* header, int nbyte, OmVolume* volume) {
    char file[2048];
    int n = snprintf(file, sizeof file, "NRRD0004\n%s\n", header);
    for (int i = 0; i < nbyte; i++) file[n++] = (char)i;
    return load_bytes("t.nrrd", file, (size_t)n, volume);
}

static void test_spaces_become_ras(void** unused) {
    (void)unused;
    static const struct {
        const char* name;
        double x, y;
    } space[] = {{"left-posterior-superior", -1, -1}, {"LPS", -1, -1}, {"RAS", 1, 1},
                 {"right-anterior-superior", 1, 1},   {"LAS", -1, 1},  {"scanner-xyz", 1, 1}};
    for (size_t i = 0; i < sizeof space / sizeof space[0]; i++) {
        char header[512];
        OmVolume v;
        snprintf(header, sizeof header, "type: uchar\nencoding: raw\nspace: %s\n" GRID,
                 space[i].name);
        assert_ok(load(header, COUNT, &v));
        OmVec3 origin = om_vec3(-0.010 * space[i].x, 0.020 * space[i].y, 0.030);
        OmVec3 cx = om_vec3(0.7e-3 * space[i].x, 0.1e-3 * space[i].y, 0);
        assert_near(om_distance(v.grid.origin, origin), 0, 1e-15);
        assert_near(om_distance(v.grid.axis.cx, cx), 0, 1e-18);
        for (int k = 0; k < COUNT; k++) assert_near(om_volume_value(&v, (size_t)k), k, 0);
        om_volume_done(&v);
    }
}

// The same 24 values in text and in four types and orders of bytes.
static void test_encodings_agree(void** unused) {
    (void)unused;
    char file[4096];
    OmVolume v;
    for (int form = 0; form < 5; form++) {
        static const char* const field[] = {
            "type: float\nencoding: ascii\n", "type: int16\nencoding: raw\nendian: big\n",
            "type: uint\nencoding: raw\nendian: little\n",
            "type: double\nencoding: raw\nendian: little\nbyte skip: -1\n",
            "type: int8\nencoding: raw\nline skip: 2\nbyte skip: 3\n"};
        int n =
            snprintf(file, sizeof file,
                     "NRRD0005\r\n# comment\nkey:=value\n%sspace: RAS\n" GRID "\n%s", field[form],
                     form == 3   ? "rubbish"
                     : form == 4 ? "one\ntwo\nxyz"
                                 : "");
        for (int i = 0; i < COUNT; i++) {
            double real = i;
            if (form == 0) n += snprintf(file + n, sizeof file - (size_t)n, "%d,\n", i);
            if (form == 1) file[n++] = 0;
            if (form == 1 || form == 2 || form == 4) file[n++] = (char)i;
            for (int k = 0; form == 2 && k < 3; k++) file[n++] = 0;
            if (form == 3) memcpy(file + n, &real, 8), n += 8;
        }
        assert_ok(load_bytes("t.nrrd", file, (size_t)n, &v));
        for (int k = 0; k < COUNT; k++) assert_near(om_volume_value(&v, (size_t)k), k, 0);
        om_volume_done(&v);
    }
}

// Entries of an axis of components, fastest or slowest: none is read unless it is chosen.
static void test_axes_that_are_not_of_space(void** unused) {
    (void)unused;
    static const char* const grid[] = {
        "sizes: 2 3 4 2\nspace: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n",
        "sizes: 3 4 2 2\nspace: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"};
    for (int form = 0; form < 4; form++) {
        const bool is_last = form & 1, is_text = form >= 2;
        char file[2048];
        OmVolume v;
        int n =
            snprintf(file, sizeof file, "NRRD0004\ntype: uchar\nencoding: %s\ndimension: 4\n%s\n",
                     is_text ? "ascii" : "raw", grid[is_last]);
        for (int i = 0; i < 2 * COUNT; i++) {
            if (is_text)
                n += snprintf(file + n, sizeof file - (size_t)n, "%d ", i);
            else
                file[n++] = (char)i;
        }
        assert_refused(load_bytes("t.nrrd", file, (size_t)n, &v), &v, "t.nrrd",
                       "holds 2 volumes (times, components or layers of segments)");
        const char* path = temp_path("t.nrrd");
        write_bytes(path, file, (size_t)n);
        for (int entry = 0; entry < 2; entry++) {
            assert_ok(om_volume_load_entry(path, entry, &v));
            for (int k = 0; k < COUNT; k++)
                assert_near(om_volume_value(&v, (size_t)k),
                            is_last ? k + entry * COUNT : 2 * k + entry, 0);
            om_volume_done(&v);
        }
        assert_refused(om_volume_load_entry(path, 2, &v), &v, "t.nrrd", "holds volumes 0 to 1");
        assert_refused(om_volume_load_entry(path, -1, &v), &v, "t.nrrd", "count from 0");
        write_bytes(path, file, (size_t)n - (is_text ? 3 : 1));  // the last voxel is missing
        assert_refused(om_volume_load_entry(path, 1, &v), &v, "t.nrrd",
                       is_text ? "ends after" : "can hold");
        remove(path);
    }
}

// pynrrd writes a row of NaN for an axis that is not of space.
static void test_rows_of_nan_are_no_axes_of_space(void** unused) {
    (void)unused;
    static const char head[] =
        "NRRD0004\ntype: uchar\nencoding: raw\ndimension: 4\nsizes: 2 3 4 2\nspace: RAS\n"
        "space directions: (nan,nan,nan) (1,0,0) (0,2,0) (0,0,3)\n\n";
    char file[sizeof head + 2 * COUNT];
    OmVolume v;
    memcpy(file, head, sizeof head - 1);
    for (int i = 0; i < 2 * COUNT; i++) file[sizeof head - 1 + (size_t)i] = (char)i;
    const char* path = temp_path("nan.nrrd");
    write_bytes(path, file, sizeof head - 1 + 2 * COUNT);
    assert_ok(om_volume_load_entry(path, 1, &v));
    assert_true(v.grid.dim[0] == 3 && v.grid.dim[1] == 4 && v.grid.dim[2] == 2);
    assert_near(v.grid.axis.cz.z, 0.003, 1e-12);
    for (int k = 0; k < COUNT; k++) assert_near(om_volume_value(&v, (size_t)k), 2 * k + 1, 0);
    om_volume_done(&v);
    memcpy(strstr(file, "nan"), "0.1", 3);  // a part of a row
    write_bytes(path, file, sizeof head - 1 + 2 * COUNT);
    assert_refused(om_volume_load_entry(path, 0, &v), &v, "nan.nrrd", "more than three axes");
    remove(path);
}

// ---- segments of 3D Slicer -------------------------------------------------------------------------------

static OmStatus load_info(const char* header, OmVolumeInfo* info) {
    char file[8192];
    const char* path = temp_path("t.seg.nrrd");
    int n = snprintf(file, sizeof file, "NRRD0004\n%s\n", header);
    write_bytes(path, file, (size_t)n);
    OmStatus status = om_volume_load_info(path, info);
    remove(path);
    return status;
}

#define LAYERED                                                                            \
    "type: uchar\nencoding: raw\ndimension: 4\nsizes: 2 3 4 2\nspace: LPS\nkinds: list "   \
    "domain domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: " \
    "(0,0,0)\n"

static void test_segments_have_names_layers_and_values(void** unused) {
    (void)unused;
    OmVolumeInfo info;
    char header[8192], params[3000];
    memset(params, 'x', sizeof params);  // 3D Slicer's own are longer than 1024 letters
    params[sizeof params - 1] = 0;
    snprintf(header, sizeof header,
             LAYERED "Segment0_ID:=Segment_1\nSegment0_Name:=liver\nSegment0_LabelValue:=1\n"
                     "Segment0_Layer:=0\nSegment0_Extent:=0 2 0 3 0 1\nSegment1_ID:=Segment_2\n"
                     "Segment1_Name:=Lebervene \xc3\xa4\x07\xff\nSegment1_LabelValue:=7\n"
                     "Segment1_Layer:=1\nSegment2_Name:=tumour\nSegment2_LabelValue:=2\n"
                     "Segment2_Layer:=1\n# %s\nSegmentation_ConversionParameters:=%s\n",
             params, params);
    assert_ok(load_info(header, &info));
    assert_int_equal(info.nentry, 2);
    assert_int_equal(info.dim[0] * 100 + info.dim[1] * 10 + info.dim[2], 342);
    assert_int_equal(info.nsegment, 3);
    assert_true(info.has_layers && info.has_space);
    assert_near(info.unit, 0, 0);
    static const OmSegment expected[] = {{"liver", "Segment_1", 0, 1},
                                         {"Lebervene \xc3\xa4 ?", "Segment_2", 1, 7},
                                         {"tumour", "", 1, 2}};
    for (int s = 0; s < 3; s++) {
        assert_string_equal(info.segment[s].name, expected[s].name);
        assert_string_equal(info.segment[s].id, expected[s].id);
        assert_int_equal(info.segment[s].layer, expected[s].layer);
        assert_int_equal(info.segment[s].value, expected[s].value);
    }
    om_volume_info_done(&info);
    // before 4.11: a layer a segment, each of ones
    assert_ok(load_info(
        LAYERED "space units: \"cm\" \"cm\" \"cm\"\nSegment0_Name:=a\nSegment1_Name:=b\n", &info));
    assert_near(info.unit, 0.01, 0);
    assert_int_equal(info.segment[1].layer, 1);
    assert_int_equal(info.segment[1].value, 1);
    om_volume_info_done(&info);
}

static void test_segments_that_lie(void** unused) {
    (void)unused;
    static const struct {
        const char *keys, *expected;
    } lie[] = {{"Segment0_Layer:=2\n", "Segment0_Layer: 2; the file has layers 0 to 1"},
               {"Segment0_LabelValue:=x\n", "line 10: key Segment0_LabelValue: \"x\""},
               {"Segment0_Layer:=-1\n", "is no whole number"},
               {"Segment99999_Name:=a\n", "segments 0 to 4095"}};
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        char header[1024];
        OmVolumeInfo info;
        snprintf(header, sizeof header, LAYERED "%s", lie[i].keys);
        assert_status(load_info(header, &info), OM_INVALID);
        if (!strstr(om_error_message(), lie[i].expected))
            fail_msg("\"%s\" is expected in \"%s\"", lie[i].expected, om_error_message());
        assert_null(info.segment);
    }
}

static void test_spacings_and_units(void** unused) {
    (void)unused;
    OmVolume v;
    assert_ok(load("type: uchar\nencoding: raw\ndimension: 3\nsizes: 3 4 2\nspacings: 1 2 nan\n",
                   COUNT, &v));
    assert_near(om_distance(v.grid.axis.cy, om_vec3(0, 2e-3, 0)), 0, 1e-18);
    assert_near(om_distance(v.grid.axis.cz, om_vec3(0, 0, 1e-3)), 0, 1e-18);
    om_volume_done(&v);
    assert_ok(
        load("type: uchar\nencoding: raw\nspace: RAS\nspace units: \"cm\" \"cm\" \"cm\"\n" GRID,
             COUNT, &v));
    assert_near(v.grid.origin.z, 0.3, 1e-15);
    om_volume_done(&v);
}

static void test_detached_voxels(void** unused) {
    (void)unused;
    char header[512], path[2][512], voxel[COUNT];
    OmVolume v;
    snprintf(path[0], sizeof path[0], "%s", temp_path("t.nhdr"));
    snprintf(path[1], sizeof path[1], "%s", temp_path("t.raw"));
    int n = snprintf(header, sizeof header,
                     "NRRD0004\ntype: uchar\nencoding: raw\nspace: RAS\n" GRID "data file: %s\n\n",
                     strrchr(path[1], '/') + 1);
    write_bytes(path[0], header, (size_t)n);
    assert_status(om_volume_load(path[0], &v), OM_IO);
    for (int i = 0; i < COUNT; i++) voxel[i] = (char)i;
    write_bytes(path[1], voxel, COUNT);
    assert_ok(om_volume_load(path[0], &v));
    assert_near(om_volume_value(&v, COUNT - 1), COUNT - 1, 0);
    om_volume_done(&v);
    write_bytes(path[1], voxel, COUNT - 1);
    assert_refused(om_volume_load(path[0], &v), &v, path[1], "file");
    remove(path[0]);
    remove(path[1]);
}

static void test_headers_that_lie(void** unused) {
    (void)unused;
    static const struct {
        const char *header, *expected;
    } lie[] = {
        {"", "\"dimension\" is missing"},
        {"type uchar\n", "line 2: \"field: value\" is wanted"},
        {"type: half\n", "\"half\" is not read"},
        {"encoding: bzip2\n", "\"bzip2\" is not read"},
        {"dimension: 2\n", "2 axes"},
        {"dimension: three\n", "a whole number is wanted at \"three\""},
        {"sizes: 3 4 2\n", "stands before \"dimension\""},
        {"dimension: 3\nsizes: 3 4\n", "field \"sizes\""},
        {"dimension: 3\nsizes: 3 -4 2\n", "-4 entries along axis 1"},
        {"dimension: 3\nsizes: 3 4 2\n", "\"type\" is missing"},
        {"type: uchar\n" GRID, "\"encoding\" is missing"},
        {"type: short\nencoding: raw\nspace: RAS\n" GRID, "\"endian\" is missing"},
        {"type: uchar\nencoding: raw\n" GRID, "without \"space\""},
        {"endian: middle\n", "neither little nor big"},
        {"space: XYZ\n", "\"XYZ\" is not read"},
        {"space dimension: 2\n", "lives in 3"},
        {"dimension: 3\nspace directions: (1,0,0) (0,1,0) 1\n", "a vector (x,y,z) is wanted"},
        {"space units: mm mm mm\n", "quoted"},
        {"space units: \"in\" \"in\" \"in\"\n", "\"in\" is not read"},
        {"data file: LIST\n", "lists and patterns"},
        {"line skip: -2\n", "-2 is too small"},
        {"type: uchar\nencoding: raw\nspace: RAS\nline skip: 9\n" GRID, "line skip"},
        {"type: uchar\nencoding: raw\nspace: RAS\nbyte skip: 99999\n" GRID, "too early"},
        {"type: uchar\nencoding: raw\nspace: RAS\ndimension: 3\nsizes: 300 400 2\n"
         "space directions: (1,0,0) (0,1,0) (0,0,1)\n",
         "can hold at most"},
        {"type: uchar\nencoding: raw\nspace: RAS\ndimension: 3\nsizes: 2000000 2000000 2000000\n"
         "space directions: (1,0,0) (0,1,0) (0,0,1)\n",
         "more than"},
        {"type: uchar\nencoding: raw\nspace: RAS\ndimension: 3\nsizes: 3 4 2\n"
         "space directions: (1,0,0) (1,0,0) (0,0,1)\n",
         "singular"},
        {"type: float\nencoding: ascii\nspace: RAS\n" GRID, "voxel 0 is no number"},
        {"type: uchar\nencoding: gzip\nspace: RAS\n" GRID, "gzip"},
        {"type: uchar\nencoding: raw\nspace: RAS\ndimension: 4\nsizes: 3 4 2 1\n"
         "space directions: (1,0,0) (0,1,0) none none\n",
         "2 axes are of space"},
    };
    for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
        OmVolume v;
        OmStatus status = load(lie[i].header, COUNT, &v);
        assert_refused(status, &v, "t.nrrd", lie[i].expected);
    }
    OmVolume v;
    assert_refused(load_bytes("t.nrrd", "NRRD0009\n\n", 10, &v), &v, "t.nrrd", "NRRD0001");
    assert_refused(load_bytes("t.nhdr", "x\n", 2, &v), &v, "t.nhdr", "NRRD0001");
}

// Written volumes are read again: grid and values; a value that does not fit is refused, and no file is left.
static void test_written_volumes_are_read(void** unused) {
    (void)unused;
    static const OmVoxelType type[] = {OM_VOXEL_U8, OM_VOXEL_I16, OM_VOXEL_F32};
    static const double last[] = {255, -32768, 1e6}, too_much[] = {256, -32769, 0};
    for (int t = 0; t < 3; t++) {
        OmVolume v, back;
        const char* path = temp_path("w.nrrd");
        assert_ok(om_volume_init(&v, NX, NY, NZ));
        v.grid.axis =
            om_mat3_cols(om_vec3(7e-4, 1e-4, 0), om_vec3(0, -8e-4, 0), om_vec3(0, 0, 2e-3));
        v.grid.origin = om_vec3(-0.01, 0.02, 0.03);
        for (int k = 0; k < COUNT; k++) ((float*)v.voxel)[k] = (float)k + (t < 2 ? 0.4f : 0.25f);
        ((float*)v.voxel)[COUNT - 1] = (float)last[t];
        assert_ok(om_volume_save(&v, type[t], path));
        assert_ok(om_volume_load(path, &back));
        assert_int_equal(back.type, type[t]);
        assert_near(om_distance(back.grid.origin, v.grid.origin), 0, 1e-12);
        assert_near(om_distance(back.grid.axis.cx, v.grid.axis.cx), 0, 1e-12);
        assert_near(om_distance(back.grid.axis.cy, v.grid.axis.cy), 0, 1e-12);
        assert_near(om_distance(back.grid.axis.cz, v.grid.axis.cz), 0, 1e-12);
        for (int k = 0; k < COUNT - 1; k++)
            assert_near(om_volume_value(&back, (size_t)k), k + (t < 2 ? 0 : 0.25), 0);
        assert_near(om_volume_value(&back, COUNT - 1), last[t], 0);
        om_volume_done(&back);
        remove(path);
        ((float*)v.voxel)[COUNT - 1] = (float)too_much[t];
        if (t < 2) {
            assert_int_equal(om_volume_save(&v, type[t], path), OM_INVALID);
            assert_false(om_path_exists(path));
        }
        om_volume_done(&v);
    }
}

static void test_seeds_cut_and_starved(void** unused) {
    (void)unused;
    assert_seeds_are_survived("fuzz/corpus/nrrd");
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_spaces_become_ras),
        cmocka_unit_test(test_encodings_agree),
        cmocka_unit_test(test_axes_that_are_not_of_space),
        cmocka_unit_test(test_rows_of_nan_are_no_axes_of_space),
        cmocka_unit_test(test_segments_have_names_layers_and_values),
        cmocka_unit_test(test_segments_that_lie),
        cmocka_unit_test(test_spacings_and_units),
        cmocka_unit_test(test_detached_voxels),
        cmocka_unit_test(test_headers_that_lie),
        cmocka_unit_test(test_written_volumes_are_read),
        cmocka_unit_test(test_seeds_cut_and_starved),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
