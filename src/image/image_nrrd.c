// image_nrrd.c: NRRD volumes, attached (.nrrd) and detached (.nhdr), raw, gzip or text.
//
// The header consists of lines "field: value" up to an empty line. Fields that place the voxels in space
// are used, descriptive ones are ignored. An unknown field is an error only if it could change the
// meaning (an encoding, a type). Axes with direction "none" are not spatial: one entry of one such axis
// is read. Positions are turned from LPS or LAS to RAS. Keys ("key:=value") and comments may have any
// length; the keys of 3D Slicer's segmentations give names (image_segment.c).
//
// Reference: teem.sourceforge.net/nrrd/format.html (definition of NRRD0001 to NRRD0005).
#include <limits.h>
#include <string.h>

#include "image/image_internal.h"

#define MAX_AXIS 16
#define LINE_SIZE 1024
#define MAX_LINE 10000
#define MAX_TEXT ((uint64_t)1 << 28)  // bytes of voxels in text form; text is read as a whole

typedef enum Encoding { ENCODING_NONE, ENCODING_RAW, ENCODING_GZIP, ENCODING_TEXT } Encoding;

typedef struct Header {
    int naxis;  // 0: not yet stated
    int64_t size[MAX_AXIS];
    bool has_type, has_endian, has_size, is_big_endian;
    OmVoxelType type;
    Encoding encoding;
    bool has_space;      // a named space or a space dimension
    double flip[3];      // factor of each space coordinate, to RAS
    bool is_patient;     // the space is one of the patient: RAS, LAS, LPS
    bool has_unit;       // "space units" is given
    double unit[3];      // m
    bool has_direction;  // "space directions" is given
    bool is_space[MAX_AXIS];
    OmVec3 direction[MAX_AXIS];
    OmVec3 origin;
    bool has_spacing;
    double spacing[MAX_AXIS];  // NaN: not stated
    int64_t line_skip, byte_skip;
    char file[LINE_SIZE];  // name of detached data, "" if attached
} Header;

// ---- words of a value -------------------------------------------------------------------------------

static const char* skip_blank(const char* p) {
    while (*p == ' ' || *p == '\t') p++;
    return p;
}

static bool read_number(const char** p, double* v) {
    *p = skip_blank(*p);
    return om_number_parse(p, *p + strlen(*p), v);
}

static OmStatus read_integer(const char* field, const char** p, int64_t* v) {
    *p = skip_blank(*p);
    OM_CHECK(om_integer_parse(p, *p + strlen(*p), v), OM_INVALID,
             "field \"%s\": a whole number is wanted at \"%.40s\"", field, *p);
    return OM_OK;
}

// "(x,y,z)"
static OmStatus read_vector(const char* field, const char** p, OmVec3* v) {
    double c[3];
    const char* q = skip_blank(*p);
    bool is_good = *q++ == '(';
    for (int a = 0; is_good && a < 3; a++) {
        is_good = read_number(&q, &c[a]);
        q = skip_blank(q);
        is_good = is_good && *q++ == (a < 2 ? ',' : ')');
    }
    OM_CHECK(is_good, OM_INVALID, "field \"%s\": a vector (x,y,z) is wanted at \"%.40s\"", field,
             *p);
    *p = q;
    *v = om_vec3(c[0], c[1], c[2]);
    return OM_OK;
}

static OmStatus need_dimension(const Header* h, const char* field) {
    OM_CHECK(h->naxis > 0, OM_INVALID, "field \"%s\" stands before \"dimension\"", field);
    return OM_OK;
}

// ---- fields -----------------------------------------------------------------------------------------

static OmStatus set_type(Header* h, const char* value) {
    static const struct {
        const char* name;
        OmVoxelType type;
    } table[] = {
        {"signed char", OM_VOXEL_I8},
        {"int8", OM_VOXEL_I8},
        {"int8_t", OM_VOXEL_I8},
        {"uchar", OM_VOXEL_U8},
        {"unsigned char", OM_VOXEL_U8},
        {"uint8", OM_VOXEL_U8},
        {"uint8_t", OM_VOXEL_U8},
        {"short", OM_VOXEL_I16},
        {"short int", OM_VOXEL_I16},
        {"signed short", OM_VOXEL_I16},
        {"signed short int", OM_VOXEL_I16},
        {"int16", OM_VOXEL_I16},
        {"int16_t", OM_VOXEL_I16},
        {"ushort", OM_VOXEL_U16},
        {"unsigned short", OM_VOXEL_U16},
        {"unsigned short int", OM_VOXEL_U16},
        {"uint16", OM_VOXEL_U16},
        {"uint16_t", OM_VOXEL_U16},
        {"int", OM_VOXEL_I32},
        {"signed int", OM_VOXEL_I32},
        {"int32", OM_VOXEL_I32},
        {"int32_t", OM_VOXEL_I32},
        {"uint", OM_VOXEL_U32},
        {"unsigned int", OM_VOXEL_U32},
        {"uint32", OM_VOXEL_U32},
        {"uint32_t", OM_VOXEL_U32},
        {"longlong", OM_VOXEL_I64},
        {"long long", OM_VOXEL_I64},
        {"long long int", OM_VOXEL_I64},
        {"signed long long", OM_VOXEL_I64},
        {"int64", OM_VOXEL_I64},
        {"int64_t", OM_VOXEL_I64},
        {"ulonglong", OM_VOXEL_U64},
        {"unsigned long long", OM_VOXEL_U64},
        {"unsigned long long int", OM_VOXEL_U64},
        {"uint64", OM_VOXEL_U64},
        {"uint64_t", OM_VOXEL_U64},
        {"float", OM_VOXEL_F32},
        {"double", OM_VOXEL_F64},
        {"signed long long int", OM_VOXEL_I64},
    };
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (strcmp(value, table[i].name) != 0) continue;
        h->type = table[i].type;
        h->has_type = true;
        return OM_OK;
    }
    return om_error(OM_INVALID, "field \"type\": \"%.40s\" is not read", value);
}

static OmStatus set_encoding(Header* h, const char* value) {
    if (strcmp(value, "raw") == 0) {
        h->encoding = ENCODING_RAW;
    } else if (strcmp(value, "gzip") == 0 || strcmp(value, "gz") == 0) {
        h->encoding = ENCODING_GZIP;
    } else if (strcmp(value, "ascii") == 0 || strcmp(value, "txt") == 0 ||
               strcmp(value, "text") == 0) {
        h->encoding = ENCODING_TEXT;
    } else {
        return om_error(OM_INVALID,
                        "field \"encoding\": \"%.40s\" is not read; raw, gzip and ascii are "
                        "(convert with: unu save -f nrrd -e gzip)",
                        value);
    }
    return OM_OK;
}

static OmStatus set_dimension(Header* h, const char* value) {
    int64_t n;
    OM_TRY(read_integer("dimension", &value, &n));
    OM_CHECK(n >= 3 && n <= MAX_AXIS, OM_INVALID,
             "field \"dimension\": %lld axes; a volume has 3 (at most %d are read)", (long long)n,
             MAX_AXIS);
    h->naxis = (int)n;
    return OM_OK;
}

static OmStatus set_sizes(Header* h, const char* value) {
    OM_TRY(need_dimension(h, "sizes"));
    for (int a = 0; a < h->naxis; a++) {
        OM_TRY(read_integer("sizes", &value, &h->size[a]));
        OM_CHECK(h->size[a] > 0 && h->size[a] <= INT_MAX, OM_INVALID,
                 "field \"sizes\": %lld entries along axis %d", (long long)h->size[a], a);
    }
    h->has_size = true;
    return OM_OK;
}

static OmStatus set_space(Header* h, const char* value) {
    static const struct {
        const char *name, *short_name;
        double flip_x, flip_y;
    } table[] = {{"right-anterior-superior", "RAS", 1, 1},
                 {"left-anterior-superior", "LAS", -1, 1},
                 {"left-posterior-superior", "LPS", -1, -1}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        if (strcmp(value, table[i].name) != 0 && strcmp(value, table[i].short_name) != 0) continue;
        h->flip[0] = table[i].flip_x;
        h->flip[1] = table[i].flip_y;
        h->has_space = h->is_patient = true;
        return OM_OK;
    }
    bool is_free = strcmp(value, "scanner-xyz") == 0 || strcmp(value, "3D-right-handed") == 0 ||
                   strcmp(value, "3D-left-handed") == 0;
    OM_CHECK(is_free, OM_INVALID,
             "field \"space\": \"%.40s\" is not read; RAS, LAS and LPS of three dimensions are",
             value);
    om_log(OM_LOG_WARNING, "space \"%s\" does not refer to the patient: RAS is assumed", value);
    h->has_space = true;
    return OM_OK;
}

static OmStatus set_space_dimension(Header* h, const char* value) {
    int64_t n;
    OM_TRY(read_integer("space dimension", &value, &n));
    OM_CHECK(n == 3, OM_INVALID, "field \"space dimension\": %lld, a volume lives in 3",
             (long long)n);
    h->has_space = true;
    om_log(OM_LOG_WARNING, "the space has no name: taken as right-anterior-superior");
    return OM_OK;
}

static OmStatus set_directions(Header* h, const char* value) {
    OM_TRY(need_dimension(h, "space directions"));
    for (int a = 0; a < h->naxis; a++) {
        value = skip_blank(value);
        h->is_space[a] = strncmp(value, "none", 4) != 0;
        if (!h->is_space[a]) {
            value += 4;
            continue;
        }
        OM_TRY(read_vector("space directions", &value, &h->direction[a]));
        const OmVec3 d = h->direction[a];  // pynrrd writes (nan,nan,nan) for "none"
        if (isnan(d.x) && isnan(d.y) && isnan(d.z)) h->is_space[a] = false;
    }
    h->has_direction = true;
    return OM_OK;
}

static OmStatus set_spacings(Header* h, const char* value) {
    OM_TRY(need_dimension(h, "spacings"));
    for (int a = 0; a < h->naxis; a++) {
        OM_CHECK(read_number(&value, &h->spacing[a]), OM_INVALID,
                 "field \"spacings\": %d numbers are wanted", h->naxis);
    }
    h->has_spacing = true;
    return OM_OK;
}

// Units of the spatial axes: "mm" "mm" "mm".
static OmStatus set_space_units(Header* h, const char* value) {
    static const struct {
        const char* name;
        double unit;
    } table[] = {{"mm", 1e-3}, {"m", 1},      {"cm", 1e-2},         {"um", 1e-6},
                 {"", 1e-3},   {"???", 1e-3}, {"millimeter", 1e-3}, {"millimeters", 1e-3}};
    for (int a = 0; a < 3; a++) {
        value = skip_blank(value);
        const char* close = *value == '"' ? strchr(value + 1, '"') : NULL;
        OM_CHECK(close, OM_INVALID, "field \"space units\": three quoted words are wanted");
        size_t len = (size_t)(close - value) - 1;
        bool is_known = false;
        for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
            if (strlen(table[i].name) != len || strncmp(value + 1, table[i].name, len) != 0)
                continue;
            h->unit[a] = table[i].unit;
            h->has_unit = h->has_unit || (len > 0 && value[1] != '?');
            is_known = true;
        }
        OM_CHECK(is_known, OM_INVALID,
                 "field \"space units\": \"%.*s\" is not read; m, cm, mm and um are",
                 len < 40 ? (int)len : 40, value + 1);
        value = close + 1;
    }
    return OM_OK;
}

static OmStatus set_data_file(Header* h, const char* value) {
    bool is_many = strncmp(value, "LIST", 4) == 0 || strchr(value, '%');
    OM_CHECK(!is_many && value[0], OM_INVALID,
             "field \"data file\": lists and patterns of files are not read (join them with: unu "
             "save -f nrrd)");
    memcpy(h->file, value, strlen(value) + 1);  // a value is shorter than a line
    return OM_OK;
}

static OmStatus set_endian(Header* h, const char* value) {
    bool is_big = strcmp(value, "big") == 0;
    OM_CHECK(is_big || strcmp(value, "little") == 0, OM_INVALID,
             "field \"endian\": \"%.40s\" is neither little nor big", value);
    h->is_big_endian = is_big;
    h->has_endian = true;
    return OM_OK;
}

static OmStatus set_skip(const char* field, const char* value, int64_t min, int64_t* out) {
    OM_TRY(read_integer(field, &value, out));
    OM_CHECK(*out >= min, OM_INVALID, "field \"%s\": %lld is too small", field, (long long)*out);
    return OM_OK;
}

static OmStatus set_field(Header* h, const char* field, const char* value) {
    if (strcmp(field, "type") == 0) return set_type(h, value);
    if (strcmp(field, "encoding") == 0) return set_encoding(h, value);
    if (strcmp(field, "dimension") == 0) return set_dimension(h, value);
    if (strcmp(field, "sizes") == 0) return set_sizes(h, value);
    if (strcmp(field, "space") == 0) return set_space(h, value);
    if (strcmp(field, "space dimension") == 0) return set_space_dimension(h, value);
    if (strcmp(field, "space directions") == 0) return set_directions(h, value);
    if (strcmp(field, "space origin") == 0) return read_vector(field, &value, &h->origin);
    if (strcmp(field, "space units") == 0) return set_space_units(h, value);
    if (strcmp(field, "spacings") == 0) return set_spacings(h, value);
    if (strcmp(field, "endian") == 0) return set_endian(h, value);
    if (strcmp(field, "data file") == 0 || strcmp(field, "datafile") == 0)
        return set_data_file(h, value);
    if (strcmp(field, "line skip") == 0 || strcmp(field, "lineskip") == 0)
        return set_skip(field, value, 0, &h->line_skip);
    if (strcmp(field, "byte skip") == 0 || strcmp(field, "byteskip") == 0)
        return set_skip(field, value, -1, &h->byte_skip);
    return OM_OK;  // descriptive: content, kinds, centers, labels, measurement frame, old min ...
}

// ---- the header -------------------------------------------------------------------------------------

static OmStatus parse_line(Header* h, char* line) {
    char* p = line;
    while (*p && *p != ':') p++;
    OM_CHECK(p[0] == ':' && p[1] == ' ', OM_INVALID, "\"field: value\" is wanted, not \"%.40s\"",
             line);
    *p = 0;
    char* value = p + 2;
    value += strspn(value, " \t");
    size_t len = strlen(value);
    while (len > 0 && (value[len - 1] == ' ' || value[len - 1] == '\t')) value[--len] = 0;
    return set_field(h, line, value);
}

static bool is_key(const char* line, size_t len) {
    const char* colon = memchr(line, ':', len);
    return colon && colon + 1 < line + len && colon[1] == '=';
}

// Read lines up to an empty one or the end; the voxels follow.
static OmStatus parse_header(OmSource* src, Header* h, OmVolumeInfo* info) {
    char line[LINE_SIZE];
    for (int number = 1;; number++) {
        size_t len;
        bool is_end;
        OM_TRY(om__source_line(src, line, sizeof line - 1, &len, &is_end));
        if (is_end) return OM_OK;
        OM_CHECK(number <= MAX_LINE, OM_INVALID, "the header has more than %d lines", MAX_LINE);
        size_t kept = len < sizeof line ? len : sizeof line - 1;
        if (kept == len && len > 0 && line[len - 1] == '\r') kept = --len;
        line[kept] = 0;
        OM_CHECK(!memchr(line, 0, kept), OM_INVALID, "line %d of the header is no text", number);
        bool has_key = is_key(line, kept);
        if (number > 1 && len > 0 && (has_key || line[0] == '#')) {  // may have any length
            OmStatus status = has_key ? om__segment_read_key(line, kept, info) : OM_OK;
            if (status < 0) return om_error_prefix(status, "line %d", number);
            continue;
        }
        OM_CHECK(len < sizeof line, OM_INVALID,
                 "line %d of the header is no field of at most %d letters", number, LINE_SIZE - 1);
        if (len == 0) return OM_OK;
        if (number == 1) {
            OM_CHECK(strncmp(line, "NRRD000", 7) == 0 && line[7] >= '1' && line[7] <= '5' &&
                         !line[8],
                     OM_INVALID, "not an NRRD file: the first line must be NRRD0001 to NRRD0005");
            continue;
        }
        OmStatus status = parse_line(h, line);
        if (status < 0) return om_error_prefix(status, "line %d", number);
    }
}

static OmStatus check_header(const Header* h) {
    OM_CHECK(h->naxis > 0, OM_INVALID, "the field \"dimension\" is missing");
    OM_CHECK(h->has_size, OM_INVALID, "the field \"sizes\" is missing");
    OM_CHECK(h->has_type, OM_INVALID, "the field \"type\" is missing");
    OM_CHECK(h->encoding != ENCODING_NONE, OM_INVALID, "the field \"encoding\" is missing");
    OM_CHECK(h->has_endian || h->encoding == ENCODING_TEXT || om_voxel_size(h->type) == 1,
             OM_INVALID, "the field \"endian\" is missing: add \"endian: little\" or \"big\"");
    OM_CHECK(!h->has_direction || h->has_space, OM_INVALID,
             "\"space directions\" without \"space\": add \"space: right-anterior-superior\" or "
             "what it is");
    return OM_OK;
}

// ---- axes ---------------------------------------------------------------------------------------------

// Find the three spatial axes, and the number of entries of the one other axis with more than one.
static OmStatus find_axes(const Header* h, int axis[3], OmVoxelLayout* layout) {
    int nspace = 0, other = -1;
    for (int a = 0; a < h->naxis; a++) {
        bool is_space = h->has_direction ? h->is_space[a]
                        : h->has_spacing ? isfinite(h->spacing[a])
                                         : a < 3;
        if (!h->has_direction && h->naxis == 3) is_space = true;
        if (is_space) {
            OM_CHECK(nspace < 3, OM_INVALID, "more than three axes are of space");
            axis[nspace++] = a;
        } else if (h->size[a] > 1) {
            OM_CHECK(other < 0, OM_INVALID,
                     "axes %d and %d are both not spatial: at most one is read", other, a);
            other = a;
        }
    }
    OM_CHECK(nspace == 3, OM_INVALID, "%d axes are of space, a volume has three", nspace);
    layout->nentry = other < 0 ? 1 : (uint64_t)h->size[other];
    layout->nbefore = 1;
    for (int a = 0; a < other; a++) layout->nbefore *= (uint64_t)h->size[a];
    return OM_OK;
}

static void set_transform(const Header* h, const int axis[3], OmVolume* volume) {
    OmVec3 to_ras =
        om_vec3(h->flip[0] * h->unit[0], h->flip[1] * h->unit[1], h->flip[2] * h->unit[2]);
    OmVec3 step[3];
    for (int a = 0; a < 3; a++) {
        double spacing = h->has_spacing && isfinite(h->spacing[axis[a]]) ? h->spacing[axis[a]] : 1;
        step[a] = h->has_direction
                      ? h->direction[axis[a]]
                      : om_vec3(a == 0 ? spacing : 0, a == 1 ? spacing : 0, a == 2 ? spacing : 0);
        step[a] = om_vec3(step[a].x * to_ras.x, step[a].y * to_ras.y, step[a].z * to_ras.z);
    }
    if (!h->has_direction) {
        om_log(OM_LOG_WARNING,
               "no \"space directions\": orientation and position are unknown, the %s used",
               h->has_spacing ? "spacings alone are" : "voxel size of 1 mm is");
    }
    volume->grid.axis = om_mat3_cols(step[0], step[1], step[2]);
    volume->grid.origin =
        om_vec3(h->origin.x * to_ras.x, h->origin.y * to_ras.y, h->origin.z * to_ras.z);
}

// ---- the voxels ---------------------------------------------------------------------------------------

// Read a value of the voxels' type.
static OmStatus store(OmVolume* volume, size_t n, double v) {
    static const double min[] = {0, -128, 0, -32768, 0, -2147483648.0, 0, -9223372036854775808.0};
    static const double bound[] = {256,
                                   128,
                                   65536,
                                   32768,
                                   4294967296,
                                   2147483648.0,
                                   18446744073709551616.0,
                                   9223372036854775808.0};
    bool is_real = volume->type == OM_VOXEL_F32 || volume->type == OM_VOXEL_F64;
    OM_CHECK(is_real || (v == floor(v) && v >= min[volume->type] && v < bound[volume->type]),
             OM_INVALID, "voxel %zu: %g does not fit the field \"type\"", n, v);
    bool fits = fabs(v) <= (double)3.4028234e38f;
    switch (volume->type) {
    case OM_VOXEL_U8: ((uint8_t*)volume->voxel)[n] = (uint8_t)v; break;
    case OM_VOXEL_I8: ((int8_t*)volume->voxel)[n] = (int8_t)v; break;
    case OM_VOXEL_U16: ((uint16_t*)volume->voxel)[n] = (uint16_t)v; break;
    case OM_VOXEL_I16: ((int16_t*)volume->voxel)[n] = (int16_t)v; break;
    case OM_VOXEL_U32: ((uint32_t*)volume->voxel)[n] = (uint32_t)v; break;
    case OM_VOXEL_I32: ((int32_t*)volume->voxel)[n] = (int32_t)v; break;
    case OM_VOXEL_U64: ((uint64_t*)volume->voxel)[n] = (uint64_t)v; break;
    case OM_VOXEL_I64: ((int64_t*)volume->voxel)[n] = (int64_t)v; break;
    case OM_VOXEL_F32: ((float*)volume->voxel)[n] = fits ? (float)v : HUGE_VALF; break;
    case OM_VOXEL_F64: ((double*)volume->voxel)[n] = v; break;
    }
    return OM_OK;
}

static OmStatus parse_text(OmVolume* volume, const char* p, const char* end,
                           const OmVoxelLayout* layout) {
    size_t count = om_volume_count(volume);
    size_t run = layout->nentry > 1 ? (size_t)layout->nbefore : count;
    uint64_t skip = layout->entry * run;
    for (size_t n = 0, in_run = 0; n < count;) {
        while (p < end && (*p == ' ' || *p == '\n' || *p == '\r' || *p == '\t' || *p == ',')) p++;
        double v;
        OM_CHECK(p < end, OM_INVALID, "the text ends after %zu of %zu voxels", n, count);
        OM_CHECK(om_number_parse(&p, end, &v), OM_INVALID, "voxel %zu is no number", n);
        if (skip > 0) {
            skip--;
            continue;
        }
        OM_TRY(store(volume, n++, v));
        if (++in_run == run) {
            in_run = 0;
            skip = (layout->nentry - 1) * run;
        }
    }
    return OM_OK;
}

static OmStatus read_text(OmVolume* volume, OmSource* src, const OmVoxelLayout* layout) {
    uint64_t size = om__source_bound(src);
    OM_CHECK(size <= MAX_TEXT, OM_INVALID,
             "%llu bytes of text, at most %llu are read: store the voxels raw or gzip (unu save -f "
             "nrrd -e gzip)",
             (unsigned long long)size, (unsigned long long)MAX_TEXT);
    char* text = om_alloc((size_t)size, 1);
    if (!text) return OM_NO_MEMORY;
    OmStatus status = om__source_read(src, text, (size_t)size);
    if (status == OM_OK) status = parse_text(volume, text, text + size, layout);
    om_free(text);
    return status;
}

static OmStatus skip_lines(OmSource* src, int64_t nline) {
    for (int64_t i = 0; i < nline; i++) {
        char line[1];
        size_t len;
        bool is_end;
        OM_TRY(om__source_line(src, line, sizeof line, &len, &is_end));
        OM_CHECK(!is_end, OM_INVALID, "field \"line skip\": the data have only %lld lines",
                 (long long)i);
    }
    return OM_OK;
}

static OmStatus read_stored(const Header* h, const OmVoxelLayout* layout, uint64_t total,
                            OmSource* src, OmVolume* volume) {
    uint64_t size = om__source_bound(src), skip = h->byte_skip > 0 ? (uint64_t)h->byte_skip : 0;
    if (h->byte_skip < 0) {  // the voxels are the last bytes of the file
        OM_CHECK(!src->stream && total <= size, OM_INVALID,
                 "field \"byte skip\": -1 wants raw data of %llu bytes, there are %llu",
                 (unsigned long long)total, (unsigned long long)size);
        skip = size - total;
    }
    OM_TRY(om__source_skip(src, skip));
    return om__volume_read_binary(volume, src, layout);
}

// Read the voxels at the source's position.
static OmStatus read_voxels(const Header* h, OmSource* src, const OmVolumeTask* task) {
    OmVolume* volume = task->volume;
    OmVoxelLayout layout = {0};
    layout.is_swapped = h->has_endian && h->is_big_endian == om__is_little_endian();
    int axis[3] = {0, 1, 2};
    OM_TRY(find_axes(h, axis, &layout));
    OM_TRY(om__choose_entry(task, layout.nentry, &layout));
    OM_TRY(skip_lines(src, h->line_skip));
    if (h->encoding == ENCODING_GZIP) OM_TRY(om__source_inflate(src));
    // number of values in the whole file, skipped entries included
    uint64_t per_voxel = h->encoding == ENCODING_TEXT ? 1 : om_voxel_size(h->type);
    uint64_t bound = om__source_bound(src);
    int64_t dim[3] = {h->size[axis[0]], h->size[axis[1]], h->size[axis[2]]};
    OM_TRY(om__volume_alloc(volume, dim, h->type, per_voxel, bound, task->max_size));
    set_transform(h, axis, volume);
    uint64_t total = om_volume_count(volume) * per_voxel;
    OM_CHECK(layout.nentry <= bound / total, OM_INVALID,
             "the header states %llu volumes of %llu bytes, the file can hold at most %llu bytes",
             (unsigned long long)layout.nentry, (unsigned long long)total,
             (unsigned long long)bound);
    total *= layout.nentry;
    if (h->encoding == ENCODING_TEXT)
        OM_TRY(read_text(volume, src, &layout));
    else
        OM_TRY(read_stored(h, &layout, total, src, volume));
    return om__volume_finish(volume);
}

static OmStatus read_detached(const Header* h, const OmVolumeTask* task) {
    OM_CHECK(task->path, OM_INVALID,
             "field \"data file\": the header refers to voxels in another file");
    char dir[1024], file[2048];
    OmSource src;
    OM_TRY(om_path_dir(task->path, dir, sizeof dir));
    OM_TRY(om_path_join(dir, h->file, file, sizeof file));
    OM_TRY(om__source_open_file(&src, file));
    OmStatus status = read_voxels(h, &src, task);
    om__source_done(&src);
    return status < 0 ? om_error_prefix(status, "%s", file) : status;
}

// Store the header's contents for the whole file.
static OmStatus fill_info(const Header* h, OmVolumeInfo* info) {
    OmVoxelLayout layout = {0};
    int axis[3] = {0, 1, 2};
    OM_TRY(find_axes(h, axis, &layout));
    for (int a = 0; a < 3; a++) info->dim[a] = (int)h->size[axis[a]];
    info->nentry = (int)layout.nentry;
    info->unit = h->has_unit ? h->unit[0] : 0;
    info->has_space = h->has_direction && h->is_patient;
    return om__segment_finish(info);
}

OmStatus om__nrrd_parse(OmSource* src, const OmVolumeTask* task) {
    Header h = {.flip = {1, 1, 1}, .unit = {1e-3, 1e-3, 1e-3}};
    OM_TRY(parse_header(src, &h, task->info));
    OM_TRY(check_header(&h));
    OM_TRY(fill_info(&h, task->info));
    if (!task->volume) return OM_OK;
    OmStatus status = h.file[0] ? read_detached(&h, task) : read_voxels(&h, src, task);
    if (status < 0) om_volume_done(task->volume);
    return status;
}
