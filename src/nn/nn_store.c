// nn_store.c: files of samples, in HDF5.
//
// The HDF5 part is made and read in memory. Size and hash are compared before the HDF5 library reads the bytes:
// version 1.10 has crashed on damaged metadata. The hash also detects damage that HDF5 does not, such as a flipped bit
// of an attribute. The checksums of chunks (fletcher32) are for other readers. Objects have no time stamps: equal
// samples give equal bytes.
#include <dirent.h>
#include <hdf5.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "omentum/nn_store.h"

// Name of a file in memory. HDF5 refuses it where a file of that name exists; none can exist below /dev/null.
#define NOWHERE "/dev/null/omentum"
#define HEAD 512
#define MAX_KIND 64
#define MAX_NAME 128
#define BLOCK (1 << 20)  // growth of the image in memory

static hid_t type_of(OmStoreType type) {
    switch (type) {
    case OM_STORE_U8: return H5T_NATIVE_UCHAR;
    case OM_STORE_I16: return H5T_NATIVE_INT16;
    case OM_STORE_I32: return H5T_NATIVE_INT;
    case OM_STORE_U64: return H5T_NATIVE_UINT64;
    case OM_STORE_F32: return H5T_NATIVE_FLOAT;
    default: return H5T_NATIVE_DOUBLE;
    }
}

// Number of extents; 0: there is none, or one is negative.
static int extents(const int dim[3], hsize_t out[3]) {
    int rank = 0;
    memset(out, 0, 3 * sizeof *out);
    while (rank < 3 && dim[rank] > 0) {
        out[rank] = (hsize_t)dim[rank];
        ++rank;
    }
    return rank;
}

static const size_t type_size[OM_NSTORE] = {1, 2, 4, 8, 4, 8};

// Copy field f between records and a flat array.
static void copy_field(const OmStoreField* f, char* record, size_t size, int num, char* flat,
                       bool is_packing) {
    const size_t n = (size_t)f->n * type_size[f->type];
    for (size_t i = 0; i < (size_t)num; ++i) {
        char *at = record + i * size + f->offset, *to = flat + i * n;
        memcpy(is_packing ? to : at, is_packing ? at : to, n);
    }
}

static hid_t memory_access(void) {
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // HDF5 prints no errors: this file reports them
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, BLOCK, false);
    return access;
}

// ---- writing ----------------------------------------------------------------------------------------

struct OmStoreWriter {
    hid_t file;
    bool is_good;     // no call of HDF5 has failed
    bool has_memory;  // no allocation has failed
    int format;
    char kind[MAX_KIND + 1];
};

OmStatus om_store_begin(const char* kind, int format, OmStoreWriter** writer) {
    *writer = NULL;
    OmStoreWriter* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    hid_t access = memory_access();
    w->file = H5Fcreate(NOWHERE, H5F_ACC_TRUNC, H5P_DEFAULT, access);
    H5Pclose(access);
    if (w->file < 0) {
        om_free(w);
        return om_error(OM_NO_MEMORY, "HDF5 cannot begin a file in memory");
    }
    w->is_good = w->has_memory = true;
    w->format = format;
    snprintf(w->kind, sizeof w->kind, "%s", kind);
    *writer = w;
    return OM_OK;
}

void om_store_abort(OmStoreWriter* w) {
    if (!w) return;
    H5Fclose(w->file);
    om_free(w);
}

void om_store_group(OmStoreWriter* w, const char* name) {
    hid_t how = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(how, false);
    hid_t group = H5Gcreate2(w->file, name, H5P_DEFAULT, how, H5P_DEFAULT);
    H5Pclose(how);
    w->is_good = w->is_good && group >= 0;
    if (group >= 0) H5Gclose(group);
}

static void put_attribute(OmStoreWriter* w, hid_t at, const char* name, hid_t type, int num,
                          const void* value) {
    hsize_t n = num > 0 ? (hsize_t)num : 0;
    hid_t space = n ? H5Screate_simple(1, &n, NULL) : H5Screate(H5S_SCALAR);
    hid_t a = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    w->is_good = w->is_good && a >= 0 && H5Awrite(a, type, value) >= 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
}

static void put_text(OmStoreWriter* w, hid_t at, const char* name, const char* value) {
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, strlen(value) + 1);
    put_attribute(w, at, name, text, 0, value);
    H5Tclose(text);
}

// The object of "OBJECT@NAME", to be closed, and the name behind the @; the root without one. Negative: there is none.
static hid_t open_object(hid_t file, const char* name, const char** attribute) {
    const char* at = strchr(name, '@');
    char path[MAX_NAME];
    *attribute = at ? at + 1 : name;
    snprintf(path, sizeof path, "%.*s", at ? (int)(at - name) : 1, at ? name : "/");
    bool is_there = !at || H5Lexists(file, path, H5P_DEFAULT) > 0;
    return is_there ? H5Oopen(file, path, H5P_DEFAULT) : -1;
}

void om_store_text(OmStoreWriter* w, const char* name, const char* value) {
    hid_t object = open_object(w->file, name, &name);
    if (object >= 0) put_text(w, object, name, value);
    w->is_good = w->is_good && object >= 0 && H5Oclose(object) >= 0;
}

void om_store_value(OmStoreWriter* w, const char* name, OmStoreType type, int n,
                    const void* value) {
    hid_t object = open_object(w->file, name, &name);
    if (object >= 0) put_attribute(w, object, name, type_of(type), n, value);
    w->is_good = w->is_good && object >= 0 && H5Oclose(object) >= 0;
}

void om_store_array(OmStoreWriter* w, const char* name, OmStoreType type, const int dim[3],
                    int chunk, const char* unit, const void* value) {
    hsize_t size[3], block[3];
    int rank = extents(dim, size);
    memcpy(block, size, sizeof block);
    if (chunk < dim[0]) block[0] = (hsize_t)chunk;
    hid_t space = H5Screate_simple(rank, size, NULL), how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(how, false);
    H5Pset_chunk(how, rank, block);
    H5Pset_shuffle(how);
    H5Pset_deflate(how, 4);
    H5Pset_fletcher32(how);
    hid_t set = H5Dcreate2(w->file, name, type_of(type), space, H5P_DEFAULT, how, H5P_DEFAULT);
    w->is_good = w->is_good && set >= 0 &&
                 H5Dwrite(set, type_of(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    if (set >= 0 && unit) put_text(w, set, "unit", unit);
    if (set >= 0) H5Dclose(set);
    H5Pclose(how);
    H5Sclose(space);
}

void om_store_records(OmStoreWriter* w, const char* group, const OmStoreField* field, int nfield,
                      const void* record, size_t size, int num) {
    for (int k = 0; k < nfield && w->is_good; ++k) {
        const OmStoreField* f = &field[k];
        char name[MAX_NAME];
        char* flat = om_alloc((size_t)num * (size_t)f->n, type_size[f->type]);
        w->has_memory = w->has_memory && flat;
        if (!flat) return;
        copy_field(f, (char*)(uintptr_t)record, size, num, flat, true);
        snprintf(name, sizeof name, "%s/%s", group, f->name);
        om_store_array(w, name, f->type, (int[3]){num, f->n > 1 ? f->n : 0}, num, f->unit, flat);
        om_free(flat);
    }
}

// The head and the image into one file.
static OmStatus save_image(const OmStoreWriter* w, const char* path) {
    ssize_t size = H5Fget_file_image(w->file, NULL, 0);
    OM_CHECK(size > 0, OM_IO, "%s: HDF5 has no image of the file", path);
    char* data = om_calloc(HEAD + (size_t)size, 1);
    if (!data) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OM_CHECK_DONE(H5Fget_file_image(w->file, data + HEAD, (size_t)size) == size, OM_IO,
                  "%s: HDF5 has no image of the file", path);
    snprintf(data, HEAD, "%s %d\nsize %zu\nhash %016" PRIx64 "\n", w->kind, w->format, (size_t)size,
             om_hash(data + HEAD, (size_t)size, OM_HASH_SEED));
    status = om_file_write(path, data, HEAD + (size_t)size);
done:
    om_free(data);
    return status;
}

OmStatus om_store_save(OmStoreWriter* w, const char* path) {
    OmStatus status = w->has_memory ? OM_OK : OM_NO_MEMORY;
    if (!(w->is_good && H5Fflush(w->file, H5F_SCOPE_GLOBAL) >= 0))
        status = om_error(OM_IO, "%s: HDF5 cannot write the samples", path);
    if (status == OM_OK) status = save_image(w, path);
    om_store_abort(w);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

struct OmStoreReader {
    hid_t file;
    const char* name;  // of the file, for messages
};

// Check the head: size and hash of the HDF5 part must be correct.
static OmStatus check_head(const char* data, size_t size, const char* kind, int wanted,
                           const char* name) {
    int format = 0;
    size_t length = 0, nkind = strlen(kind);
    uint64_t hash = 0;
    char head[HEAD + 1] = "";
    memcpy(head, data, size < HEAD ? size : HEAD);
    const char* rest = strncmp(head, kind, nkind) == 0 ? head + nkind : "";
    OM_CHECK(sscanf(rest, " %d", &format) == 1, OM_INVALID, "%s: not a file of samples", name);
    OM_CHECK(format == wanted, OM_UNAVAILABLE, "%s: format %d; this program reads %d", name, format,
             wanted);
    bool is_whole =
        size > HEAD && sscanf(rest, " %*d\nsize %zu\nhash %" SCNx64, &length, &hash) == 2;
    OM_CHECK(is_whole && length == size - HEAD, OM_INVALID,
             "%s: the file is truncated; make it again", name);
    OM_CHECK(hash == om_hash(data + HEAD, length, OM_HASH_SEED), OM_INVALID,
             "%s: the file is corrupted, its checksum is wrong; make it again", name);
    return OM_OK;
}

OmStatus om_store_open(const char* data, size_t size, const char* kind, int format,
                       const char* name, OmStoreReader** reader) {
    const size_t skip = kind ? HEAD : 0;
    *reader = NULL;
    if (kind) OM_TRY(check_head(data, size, kind, format, name));
    OmStoreReader* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    hid_t access = memory_access();
    bool is_good = H5Pset_file_image(access, (void*)(uintptr_t)(data + skip), size - skip) >= 0;
    r->file = is_good ? H5Fopen(NOWHERE, H5F_ACC_RDONLY, access) : -1;
    r->name = name;
    H5Pclose(access);
    if (r->file < 0) {
        om_free(r);
        return om_error(OM_INVALID, "%s: HDF5 cannot open what is in the file", name);
    }
    *reader = r;
    return OM_OK;
}

void om_store_close(OmStoreReader* r) {
    if (!r) return;
    H5Fclose(r->file);
    om_free(r);
}

static OmStatus check_finite(const OmStoreReader* r, const char* name, OmStoreType type, size_t n,
                             const void* value) {
    for (size_t i = 0; i < n; ++i) {
        bool is_finite = type == OM_STORE_F64   ? isfinite(((const double*)value)[i])
                         : type == OM_STORE_F32 ? isfinite(((const float*)value)[i])
                                                : true;
        OM_CHECK(is_finite, OM_INVALID, "%s: value %zu of %s is not finite", r->name, i, name);
    }
    return OM_OK;
}

OmStatus om_store_get_value(const OmStoreReader* r, const char* name, OmStoreType type, int n,
                            void* value) {
    const char* short_name;
    hid_t object = open_object(r->file, name, &short_name);
    bool is_good = object >= 0 && H5Aexists(object, short_name) > 0;
    hid_t a = is_good ? H5Aopen(object, short_name, H5P_DEFAULT) : -1, space = -1;
    if (a >= 0) space = H5Aget_space(a);
    is_good = space >= 0 && H5Sget_simple_extent_npoints(space) == n &&
              H5Aread(a, type_of(type), value) >= 0;
    if (space >= 0) H5Sclose(space);
    if (a >= 0) H5Aclose(a);
    if (object >= 0) H5Oclose(object);
    OM_CHECK(is_good, OM_INVALID, "%s: attribute %s is missing or has the wrong shape", r->name,
             name);
    return check_finite(r, name, type, (size_t)n, value);
}

OmStatus om_store_get_text(const OmStoreReader* r, const char* name, char* text, size_t size) {
    const char* short_name;
    text[0] = '\0';
    hid_t object = open_object(r->file, name, &short_name);
    const bool is_there = object >= 0 && H5Aexists(object, short_name) > 0;
    hid_t a = is_there ? H5Aopen(object, short_name, H5P_DEFAULT) : -1;
    hid_t type = a >= 0 ? H5Aget_type(a) : -1, space = a >= 0 ? H5Aget_space(a) : -1;
    bool is_good = type >= 0 && space >= 0 && H5Tget_class(type) == H5T_STRING &&
                   H5Tis_variable_str(type) == 0 && H5Tget_size(type) <= size &&
                   H5Sget_simple_extent_npoints(space) == 1 && H5Aread(a, type, text) >= 0;
    if (is_good) text[H5Tget_size(type) - 1] = '\0';
    if (space >= 0) H5Sclose(space);
    if (type >= 0) H5Tclose(type);
    if (a >= 0) H5Aclose(a);
    if (object >= 0) H5Oclose(object);
    OM_CHECK(is_good || !is_there, OM_INVALID, "%s: attribute %s is no text of less than %zu bytes",
             r->name, name, size);
    return OM_OK;
}

// Open an array of the given shape.
static OmStatus open_array(const OmStoreReader* r, const char* name, const int dim[3], hid_t* set) {
    hsize_t have[3] = {0, 0, 0}, want[3];
    extents(dim, want);
    *set = H5Dopen2(r->file, name, H5P_DEFAULT);
    hid_t space = *set >= 0 ? H5Dget_space(*set) : -1;
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : 0;
    if (rank >= 1 && rank <= 3) H5Sget_simple_extent_dims(space, have, NULL);
    if (space >= 0) H5Sclose(space);
    if (rank >= 1 && rank <= 3 && memcmp(have, want, sizeof have) == 0) return OM_OK;
    if (*set >= 0) H5Dclose(*set);
    return om_error(OM_INVALID, "%s: array %s is missing or has the wrong shape", r->name, name);
}

OmStatus om_store_get_shape(const OmStoreReader* r, const char* name, int dim[3]) {
    hsize_t have[3] = {0, 0, 0};
    hid_t set = H5Dopen2(r->file, name, H5P_DEFAULT), space = set >= 0 ? H5Dget_space(set) : -1;
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : 0;
    if (rank >= 1 && rank <= 3) H5Sget_simple_extent_dims(space, have, NULL);
    if (space >= 0) H5Sclose(space);
    if (set >= 0) H5Dclose(set);
    OM_CHECK(rank >= 1 && rank <= 3, OM_INVALID, "%s: array %s is missing or has no extents",
             r->name, name);
    for (int c = 0; c < 3; ++c) {
        bool is_good = have[c] <= INT_MAX && (c >= rank || have[c] > 0);
        OM_CHECK(is_good, OM_INVALID, "%s: array %s is empty or too large", r->name, name);
        dim[c] = (int)have[c];
    }
    return OM_OK;
}

OmStatus om_store_check_array(const OmStoreReader* r, const char* name, const int dim[3]) {
    hid_t set;
    OM_TRY(open_array(r, name, dim, &set));
    H5Dclose(set);
    return OM_OK;
}

OmStatus om_store_get_array(const OmStoreReader* r, const char* name, OmStoreType type,
                            const int dim[3], void* value) {
    hid_t set;
    OM_TRY(open_array(r, name, dim, &set));
    bool is_read = H5Dread(set, type_of(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    H5Dclose(set);
    OM_CHECK(is_read, OM_INVALID, "%s: array %s cannot be read; make the file again", r->name,
             name);
    size_t n = 1;
    for (int c = 0; c < 3 && dim[c] > 0; ++c) n *= (size_t)dim[c];
    return check_finite(r, name, type, n, value);
}

OmStatus om_store_get_records(const OmStoreReader* r, const char* group, const OmStoreField* field,
                              int nfield, void* record, size_t size, int num) {
    for (int k = 0; k < nfield; ++k) {
        const OmStoreField* f = &field[k];
        const int dim[3] = {num, f->n > 1 ? f->n : 0};
        char name[MAX_NAME];
        snprintf(name, sizeof name, "%s/%s", group, f->name);
        OM_TRY(om_store_check_array(r, name, dim));
        char* flat = om_alloc((size_t)num * (size_t)f->n, type_size[f->type]);
        if (!flat) return OM_NO_MEMORY;
        OmStatus status = om_store_get_array(r, name, f->type, dim, flat);
        if (status == OM_OK) copy_field(f, record, size, num, flat, false);
        om_free(flat);
        OM_TRY(status);
    }
    return OM_OK;
}

// ---- folders of such files --------------------------------------------------------------------------

static void shard_name(int first, char name[32]) { snprintf(name, 32, "samples_%06d.h5", first); }

OmStatus om_store_shard_path(const char* dir, int first, char* path, size_t size) {
    char name[32];
    shard_name(first, name);
    return om_path_join(dir, name, path, size);
}

void om_store_shard_range(const char* dir, int* lowest, int* highest) {
    int first;
    *lowest = *highest = -1;
    DIR* folder = opendir(dir);
    if (!folder) return;
    for (struct dirent* entry = readdir(folder); entry; entry = readdir(folder)) {
        char name[32];
        if (sscanf(entry->d_name, "samples_%d.h5", &first) != 1 || first < 0) continue;
        shard_name(first, name);
        if (strcmp(name, entry->d_name) != 0) continue;
        if (*lowest < 0 || first < *lowest) *lowest = first;
        if (first > *highest) *highest = first;
    }
    closedir(folder);
}
