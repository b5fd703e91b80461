// nn_safetensors.c: safetensors files. The only file that uses jansson.
//
//     8 bytes   length of the header, little-endian
//     header    {"__metadata__": {"key": "text"},
//                "name": {"dtype": "F32", "shape": [..], "data_offsets": [begin, end]}}
//     data      offsets count from here; every byte belongs to exactly one tensor
//
// The header is kept as jansson's tree, which owns names and texts; the data stay in the block read from the
// file. A file to be written is first checked by the reader. Format: huggingface.co/docs/safetensors.
#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/nn_file_internal.h"

#define MAX_FILE_SIZE ((size_t)1 << 34)
#define META_KEY "__metadata__"

static const struct {
    const char* name;
    size_t size;
    bool is_read;
} type_of[] = {
#define TYPE_ROW(name, size, is_read) {#name, size, is_read},
    OM_TENSOR_TYPE_TABLE(TYPE_ROW)
#undef TYPE_ROW
};

typedef struct Place {  // of a tensor in the data; sorted by begin
    uint64_t begin, end;
    OmTensor tensor;
} Place;

struct OmTensorFile {
    char* name;    // for messages
    char* bytes;   // the whole file; null until the file is complete
    json_t* root;  // the header
    int ntensor;
    Place* place;  // (ntensor)
};

// ---- shapes ---------------------------------------------------------------------------------

const char* om__tensor_shape_text(int rank, const int64_t* dim, char* out, size_t size) {
    size_t used = (size_t)snprintf(out, size, "[");
    for (int i = 0; i < rank && used < size; ++i)
        used +=
            (size_t)snprintf(out + used, size - used, "%s%lld", i ? ", " : "", (long long)dim[i]);
    if (used < size) snprintf(out + used, size - used, "]");
    return out;
}

// An empty tensor's other dimensions may be of any size.
static bool is_empty(const OmTensor* t) {
    for (int i = 0; i < t->rank; ++i)
        if (t->dim[i] == 0) return true;
    return false;
}

int64_t om_tensor_count(const OmTensor* tensor) {
    int64_t count = 1;
    if (is_empty(tensor)) return 0;
    for (int i = 0; i < tensor->rank; ++i) count *= tensor->dim[i];
    return count;
}

// Bytes of a tensor; false if they do not fit into `limit`.
static bool tensor_bytes(const OmTensor* t, uint64_t limit, uint64_t* bytes) {
    *bytes = 0;
    if (is_empty(t)) return true;
    *bytes = type_of[t->type].size;
    for (int i = 0; i < t->rank; ++i) {
        if (*bytes > limit / (uint64_t)t->dim[i]) return false;
        *bytes *= (uint64_t)t->dim[i];
    }
    return *bytes <= limit;
}

// ---- the header -----------------------------------------------------------------------------

// The entry of one tensor: {"dtype": .., "shape": [..], "data_offsets": [begin, end]}.
static OmStatus read_entry(const char* file, const char* name, json_t* entry, uint64_t ndata,
                           Place* place) {
    OmTensor* t = &place->tensor;
    t->name = name;
    OM_CHECK(json_is_object(entry), OM_INVALID, "%s: tensor \"%.80s\": {..} is expected", file,
             name);

    const char* type = json_string_value(json_object_get(entry, "dtype"));
    OM_CHECK(type, OM_INVALID, "%s: tensor \"%.80s\" has no text \"dtype\"", file, name);
    int found = 0;
    while (found < OM_TENSOR_NTYPE && strcmp(type_of[found].name, type) != 0) ++found;
    OM_CHECK(found < OM_TENSOR_NTYPE, OM_INVALID, "%s: tensor \"%.80s\": unknown type \"%.20s\"",
             file, name, type);
    t->type = (OmTensorType)found;

    json_t* shape = json_object_get(entry, "shape");
    OM_CHECK(json_is_array(shape), OM_INVALID, "%s: tensor \"%.80s\" has no list \"shape\"", file,
             name);
    OM_CHECK(json_array_size(shape) <= OM_TENSOR_MAX_RANK, OM_INVALID,
             "%s: tensor \"%.80s\" has %zu dimensions, at most %d are read", file, name,
             json_array_size(shape), OM_TENSOR_MAX_RANK);
    t->rank = (int)json_array_size(shape);
    for (int i = 0; i < t->rank; ++i) {
        json_t* dim = json_array_get(shape, (size_t)i);
        OM_CHECK(json_is_integer(dim) && json_integer_value(dim) >= 0, OM_INVALID,
                 "%s: tensor \"%.80s\": dimension %d of its shape is not a whole number from 0",
                 file, name, i);
        t->dim[i] = json_integer_value(dim);
    }

    json_t* offsets = json_object_get(entry, "data_offsets");
    json_t* begin = json_array_get(offsets, 0);
    json_t* end = json_array_get(offsets, 1);
    OM_CHECK(json_array_size(offsets) == 2 && json_is_integer(begin) && json_is_integer(end),
             OM_INVALID, "%s: tensor \"%.80s\" has no list \"data_offsets\" of two whole numbers",
             file, name);
    long long at[2] = {json_integer_value(begin), json_integer_value(end)};
    OM_CHECK(at[0] >= 0 && at[0] <= at[1] && (uint64_t)at[1] <= ndata, OM_INVALID,
             "%s: tensor \"%.80s\" lies at bytes %lld to %lld of %llu: the file is truncated or "
             "damaged",
             file, name, at[0], at[1], (unsigned long long)ndata);
    place->begin = (uint64_t)at[0];
    place->end = (uint64_t)at[1];
    uint64_t bytes = 0;
    char text[160];
    OM_CHECK(tensor_bytes(t, ndata, &bytes) && bytes == place->end - place->begin, OM_INVALID,
             "%s: tensor \"%.80s\" of shape %s does not fill its %llu bytes", file, name,
             om__tensor_shape_text(t->rank, t->dim, text, sizeof text),
             (unsigned long long)(place->end - place->begin));
    return OM_OK;
}

static OmStatus check_meta(const char* file, json_t* meta) {
    OM_CHECK(json_is_object(meta), OM_INVALID, "%s: \"" META_KEY "\" is not {..}", file);
    const char* key;
    json_t* value;
    json_object_foreach(meta, key, value) {
        OM_CHECK(json_is_string(value), OM_INVALID, "%s: \"%.80s\" of the metadata is not a text",
                 file, key);
    }
    return OM_OK;
}

static int compare_places(const void* a, const void* b) {
    const Place *p = a, *q = b;
    if (p->begin != q->begin) return p->begin < q->begin ? -1 : 1;
    return p->end < q->end ? -1 : p->end > q->end;
}

// Tensors must follow each other without overlap or gap, from the first byte of the data to the last.
static OmStatus check_cover(const OmTensorFile* f, uint64_t ndata) {
    uint64_t at = 0;
    for (int i = 0; i < f->ntensor; ++i) {
        const Place* p = &f->place[i];
        OM_CHECK(p->begin == at, OM_INVALID, "%s: tensor \"%.80s\" %s", f->name, p->tensor.name,
                 p->begin < at ? "overlaps another" : "lies after a gap in the data");
        at = p->end;
    }
    OM_CHECK(at == ndata, OM_INVALID, "%s: %llu bytes at its end belong to no tensor", f->name,
             (unsigned long long)(ndata - at));
    return OM_OK;
}

// Read and check the header; f has a name, and on success root, place and ntensor.
static OmStatus read_header(OmTensorFile* f, const char* header, size_t nheader, uint64_t ndata) {
    json_error_t error;
    OM_CHECK(nheader >= 2 && header[0] == '{', OM_INVALID,
             "%s: its header does not begin with {: not a safetensors file", f->name);
    f->root = json_loadb(header, nheader, JSON_REJECT_DUPLICATES, &error);
    if (!f->root) {
        OmStatus why =
            json_error_code(&error) == json_error_out_of_memory ? OM_NO_MEMORY : OM_INVALID;
        return om_error(why, "%s: header, byte %d: %.120s", f->name, error.position, error.text);
    }
    size_t nentry = json_object_size(f->root);
    f->place = om_calloc(nentry, sizeof *f->place);
    if (!f->place) return OM_NO_MEMORY;
    const char* key;
    json_t* value;
    json_object_foreach(f->root, key, value) {
        if (strcmp(key, META_KEY) == 0)
            OM_TRY(check_meta(f->name, value));
        else
            OM_TRY(read_entry(f->name, key, value, ndata, &f->place[f->ntensor++]));
    }
    if (f->ntensor > 0) qsort(f->place, (size_t)f->ntensor, sizeof *f->place, compare_places);
    return check_cover(f, ndata);
}

// ---- reading --------------------------------------------------------------------------------

static OmStatus new_file(const char* name, OmTensorFile** out) {
    *out = NULL;
    OmTensorFile* f = om_calloc(1, sizeof *f);
    size_t len = strlen(name) + 1;
    char* copy = om_alloc(len, 1);
    if (!f || !copy) {
        om_free(f);
        om_free(copy);
        return OM_NO_MEMORY;
    }
    memcpy(copy, name, len);
    f->name = copy;
    *out = f;
    return OM_OK;
}

void om_tensor_file_destroy(OmTensorFile* file) {
    if (!file) return;
    json_decref(file->root);
    om_free(file->place);
    om_free(file->bytes);
    om_free(file->name);
    om_free(file);
}

static uint64_t load_bits(const unsigned char* p, size_t size) {
    uint64_t bits = 0;
    for (size_t i = size; i-- > 0;) bits = bits << 8 | p[i];
    return bits;
}

OmStatus om__tensor_file_parse(const char* name, char* bytes, size_t size, OmTensorFile** out) {
    OmTensorFile* f;
    OmStatus status = OM_OK;
    *out = NULL;
    OM_TRY(new_file(name, &f));
    OM_CHECK_DONE(size >= 8, OM_INVALID, "%s: %zu bytes are no safetensors file", name, size);
    uint64_t nheader = load_bits((unsigned char*)bytes, 8);
    OM_CHECK_DONE(nheader <= OM_TENSOR_MAX_HEADER, OM_INVALID,
                  "%s: a header of %llu bytes, at most %u are read: not a safetensors file", name,
                  (unsigned long long)nheader, OM_TENSOR_MAX_HEADER);
    OM_CHECK_DONE(nheader <= size - 8, OM_INVALID,
                  "%s: a header of %llu bytes in a file of %zu: it is truncated", name,
                  (unsigned long long)nheader, size);
    OM_TRY_DONE(read_header(f, bytes + 8, (size_t)nheader, size - 8 - nheader));
    for (int i = 0; i < f->ntensor; ++i)
        f->place[i].tensor.data = bytes + 8 + nheader + f->place[i].begin;
    f->bytes = bytes;
    *out = f;
    f = NULL;
done:
    om_tensor_file_destroy(f);
    return status;
}

OmStatus om_tensor_file_load(const char* path, OmTensorFile** file) {
    char* bytes;
    size_t size;
    *file = NULL;
    OM_TRY(om_file_read(path, MAX_FILE_SIZE, &bytes, &size));
    OmStatus status = om__tensor_file_parse(path, bytes, size, file);
    if (status < 0) om_free(bytes);
    return status;
}

int om_tensor_file_count(const OmTensorFile* file) { return file->ntensor; }

const OmTensor* om_tensor_file_get(const OmTensorFile* file, int i) {
    OM_ASSERT(i >= 0 && i < file->ntensor);
    return &file->place[i].tensor;
}

int om_tensor_file_find(const OmTensorFile* file, const char* name) {
    for (int i = 0; i < file->ntensor; ++i)
        if (strcmp(file->place[i].tensor.name, name) == 0) return i;
    return -1;
}

const char* om_tensor_file_meta(const OmTensorFile* file, const char* key) {
    return json_string_value(json_object_get(json_object_get(file->root, META_KEY), key));
}

// ---- values ---------------------------------------------------------------------------------

static double f32_value(uint32_t bits) {
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

// IEEE 754 binary16: 1 sign, 5 exponent, 10 fraction.
static double f16_value(uint32_t bits) {
    int exponent = (int)(bits >> 10 & 31);
    double fraction = (double)(bits & 1023);
    double size = exponent == 31 ? (fraction > 0 ? (double)NAN : (double)INFINITY)
                  : exponent > 0 ? ldexp(1024 + fraction, exponent - 25)
                                 : ldexp(fraction, -24);
    return bits >> 15 ? -size : size;
}

static double load_value(const unsigned char* p, OmTensorType type) {
    uint64_t bits = load_bits(p, type_of[type].size);
    double value;
    switch (type) {
    case OM_TENSOR_F64: memcpy(&value, &bits, sizeof value); return value;
    case OM_TENSOR_F32: return f32_value((uint32_t)bits);
    case OM_TENSOR_F16: return f16_value((uint32_t)bits);
    case OM_TENSOR_BF16: return f32_value((uint32_t)bits << 16);
    default: return (double)NAN;
    }
}

// The tensor `name` of exactly this shape, with a type that is read.
static OmStatus find_shape(const OmTensorFile* file, const char* name, int rank, const int64_t* dim,
                           const OmTensor** tensor) {
    char want[160], have[160];
    int at = om_tensor_file_find(file, name);
    OM_CHECK(at >= 0, OM_INVALID, "%s: has no tensor \"%.80s\" of shape %s", file->name, name,
             om__tensor_shape_text(rank, dim, want, sizeof want));
    const OmTensor* t = &file->place[at].tensor;
    bool is_same = t->rank == rank;
    for (int i = 0; i < rank && is_same; ++i) is_same = t->dim[i] == dim[i];
    OM_CHECK(is_same, OM_INVALID, "%s: tensor \"%.80s\" has the shape %s, %s is expected",
             file->name, name, om__tensor_shape_text(t->rank, t->dim, have, sizeof have),
             om__tensor_shape_text(rank, dim, want, sizeof want));
    OM_CHECK(type_of[t->type].is_read, OM_INVALID,
             "%s: tensor \"%.80s\" is of type %s; F64, F32, F16 and BF16 are read", file->name,
             name, type_of[t->type].name);
    *tensor = t;
    return OM_OK;
}

static OmStatus not_finite(const OmTensorFile* file, const char* name, int64_t i, double value) {
    return om_error(OM_INVALID, "%s: tensor \"%.80s\": value %lld is %g; the weights are unusable",
                    file->name, name, (long long)i, value);
}

OmStatus om_tensor_file_read(const OmTensorFile* file, const char* name, int rank,
                             const int64_t* dim, float* value) {
    const OmTensor* t;
    OM_TRY(find_shape(file, name, rank, dim, &t));
    const unsigned char* p = t->data;
    int64_t count = om_tensor_count(t);
    for (int64_t i = 0; i < count; ++i, p += type_of[t->type].size) {
        double v = load_value(p, t->type);
        value[i] = (float)v;
        if (!isfinite(value[i])) return not_finite(file, name, i, v);
    }
    return OM_OK;
}

OmStatus om_tensor_file_read_double(const OmTensorFile* file, const char* name, int rank,
                                    const int64_t* dim, double* value) {
    const OmTensor* t;
    OM_TRY(find_shape(file, name, rank, dim, &t));
    const unsigned char* p = t->data;
    int64_t count = om_tensor_count(t);
    for (int64_t i = 0; i < count; ++i, p += type_of[t->type].size) {
        value[i] = load_value(p, t->type);
        if (!isfinite(value[i])) return not_finite(file, name, i, value[i]);
    }
    return OM_OK;
}

// ---- writing --------------------------------------------------------------------------------

static bool is_double(const OmTensor* t) { return t->type == OM_TENSOR_F64; }

static double value_of(const OmTensor* t, int64_t i) {
    return is_double(t) ? ((const double*)t->data)[i] : (double)((const float*)t->data)[i];
}

static OmStatus check_tensor(const OmTensor* t, const char* path) {
    OM_CHECK(is_double(t) || t->type == OM_TENSOR_F32, OM_INVALID,
             "%s: tensor \"%.80s\" is neither F32 nor F64; only these are written", path, t->name);
    OM_CHECK(t->rank >= 0 && t->rank <= OM_TENSOR_MAX_RANK, OM_INVALID,
             "%s: tensor \"%.80s\" has %d dimensions, at most %d", path, t->name, t->rank,
             OM_TENSOR_MAX_RANK);
    for (int i = 0; i < t->rank; ++i)
        OM_CHECK(t->dim[i] >= 0, OM_INVALID, "%s: tensor \"%.80s\": dimension %d is negative", path,
                 t->name, i);
    uint64_t bytes;
    OM_CHECK(tensor_bytes(t, MAX_FILE_SIZE, &bytes), OM_INVALID,
             "%s: tensor \"%.80s\" is larger than a file may be", path, t->name);
    int64_t count = om_tensor_count(t);
    for (int64_t i = 0; i < count; ++i)
        OM_CHECK(isfinite(value_of(t, i)), OM_INVALID,
                 "%s: tensor \"%.80s\": value %lld is %g; nothing was written", path, t->name,
                 (long long)i, value_of(t, i));
    return OM_OK;
}

static void put_entry(OmJson* json, const OmTensor* t, uint64_t* at) {
    uint64_t bytes = 0;
    (void)tensor_bytes(t, UINT64_MAX, &bytes);
    om_json_open(json, t->name, '{');
    om_json_string(json, "dtype", type_of[t->type].name);
    om_json_open(json, "shape", '[');
    for (int i = 0; i < t->rank; ++i) om_json_integer(json, NULL, t->dim[i]);
    om_json_close(json, ']');
    om_json_open(json, "data_offsets", '[');
    om_json_integer(json, NULL, (int64_t)*at);
    om_json_integer(json, NULL, (int64_t)(*at + bytes));
    om_json_close(json, ']');
    om_json_close(json, '}');
    *at += bytes;
}

static bool is_utf8(const char* str) {
    size_t len = strlen(str), n = 1;
    for (size_t i = 0; i < len && n > 0; i += n) n = om_utf8_length(str + i, len - i);
    return n > 0;
}

// The header, padded to 8 bytes so that every value is aligned: doubles come first in the data. The reader's own
// checks validate it and find names that occur twice.
static OmStatus make_header(const OmTensor* tensor, int ntensor, const OmTextPair* meta, int nmeta,
                            const char* path, OmText* text) {
    uint64_t ndata = 0;
    for (int i = 0; i < nmeta; ++i)
        OM_CHECK(is_utf8(meta[i].key) && is_utf8(meta[i].value), OM_INVALID,
                 "%s: \"%.80s\" of the metadata is no UTF-8", path, meta[i].key);
    for (int i = 0; i < ntensor; ++i)
        OM_CHECK(is_utf8(tensor[i].name), OM_INVALID, "%s: the name of tensor %d is no UTF-8", path,
                 i);
    OmJson json = om_json_begin(text);
    om_json_open(&json, NULL, '{');
    if (nmeta > 0) {
        om_json_open(&json, META_KEY, '{');
        for (int i = 0; i < nmeta; ++i) om_json_string(&json, meta[i].key, meta[i].value);
        om_json_close(&json, '}');
    }
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < ntensor; ++i)
            if (is_double(&tensor[i]) == (pass == 0)) put_entry(&json, &tensor[i], &ndata);
    om_json_close(&json, '}');
    OM_TRY(om_json_end(&json));
    text->str[text->len - 1] = ' ';  // the line's end
    while (text->len % 8 != 0) OM_TRY(om_text_append_raw(text, " ", 1));
    OM_CHECK(text->len <= OM_TENSOR_MAX_HEADER, OM_INVALID, "%s: a header of %zu bytes, at most %u",
             path, text->len, OM_TENSOR_MAX_HEADER);
    OmTensorFile* check;
    OM_TRY(new_file(path, &check));
    OmStatus status = read_header(check, text->str, text->len, ndata);
    om_tensor_file_destroy(check);
    return status;
}

static void store_bits(unsigned char* p, uint64_t bits, size_t size) {
    for (size_t i = 0; i < size; ++i) p[i] = (unsigned char)(bits >> 8 * i);
}

static OmStatus put_values(const OmTensor* t, OmAtomicFile* file) {
    unsigned char buffer[4096];
    size_t size = type_of[t->type].size, used = 0;
    int64_t count = om_tensor_count(t);
    for (int64_t i = 0; i < count; ++i) {
        uint64_t bits = 0;
        if (is_double(t)) {
            memcpy(&bits, (const double*)t->data + i, sizeof(double));
        } else {
            uint32_t word;
            memcpy(&word, (const float*)t->data + i, sizeof word);
            bits = word;
        }
        store_bits(buffer + used, bits, size);
        used += size;
        if (used == sizeof buffer || i == count - 1) {
            OM_CHECK(fwrite(buffer, 1, used, file->stream) == used, OM_IO, "%s: cannot write: %s",
                     file->path, strerror(errno));
            used = 0;
        }
    }
    return OM_OK;
}

OmStatus om_tensor_file_save(const OmTensor* tensor, int ntensor, const OmTextPair* meta, int nmeta,
                             const char* path) {
    OmText header = {0};
    OmAtomicFile file = {0};
    OmStatus status = OM_OK;
    unsigned char length[8];
    for (int i = 0; i < ntensor; ++i) OM_TRY(check_tensor(&tensor[i], path));
    OM_TRY_DONE(make_header(tensor, ntensor, meta, nmeta, path, &header));
    OM_TRY_DONE(om_file_begin(path, &file));
    store_bits(length, header.len, sizeof length);
    OM_CHECK_DONE(fwrite(length, 1, sizeof length, file.stream) == sizeof length &&
                      fwrite(header.str, 1, header.len, file.stream) == header.len,
                  OM_IO, "%s: cannot write: %s", path, strerror(errno));
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < ntensor; ++i)
            if (is_double(&tensor[i]) == (pass == 0)) OM_TRY_DONE(put_values(&tensor[i], &file));
    status = om_file_commit(&file);
done:
    om_file_abort(&file);
    om_text_done(&header);
    return status;
}
