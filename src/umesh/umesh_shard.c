// umesh_shard.c: files of samples, the only file of the room that knows HDF5.
//
//     0     "omentum umesh 1\nsize N\nhash H\n", zeros
//     512   an HDF5 file of N bytes whose om_hash is H
//
// HDF5 searches for its signature at 0, 512, 1024, .., so its tools open the file directly. The HDF5 part is made and
// read in memory. Size and hash are compared before the HDF5 library reads the bytes: version 1.10 has crashed on
// damaged metadata. The hash also detects damage that HDF5 does not, such as a flipped bit of an attribute. The
// checksums of chunks (fletcher32) are for other readers. Objects have no time stamps: equal samples give equal bytes.
#include <hdf5.h>
#include <inttypes.h>
#include <string.h>

#include "umesh/umesh_internal.h"

#define HEAD 512
#define MAX_BYTES ((size_t)4 << 30)
#define FORMAT 1
#define GENERATOR "omentum umesh 1"
#define BLOCK (1 << 20)  // growth of the image in memory

void om__umesh_shard_name(int first, char name[OM__UMESH_MAX_NAME]) {
    snprintf(name, OM__UMESH_MAX_NAME, "samples_%06d.h5", first);
}

OmStatus om__umesh_shard_alloc(int nnode, int num, OmUmeshShard* s) {
    OmStatus status = OM_OK;
    s->num = num;
    OM_CALLOC_DONE(s->sample, num);
    OM_ALLOC_DONE(s->mask, (size_t)num * (size_t)nnode);
    OM_ALLOC_DONE(s->u, 3 * (size_t)num * (size_t)nnode);
done:
    if (status < 0) om__umesh_shard_done(s);
    return status;
}

void om__umesh_shard_done(OmUmeshShard* s) {
    om_free(s->sample);
    om_free(s->mask);
    om_free(s->u);
    *s = (OmUmeshShard){0};
}

// ---- fields of a sample -----------------------------------------------------------------------------

typedef struct Field {  // a dataset /sample/NAME and where its values are in an OmUmeshSample
    const char *name, *unit;
    size_t offset;
    int ncomp;  // doubles; 0: one int
} Field;

static const Field field_table[] = {
    {"center", "m", offsetof(OmUmeshSample, patch.center), 3},
    {"normal", "1", offsetof(OmUmeshSample, patch.normal), 3},
    {"along", "1", offsetof(OmUmeshSample, patch.along), 3},
    {"size", "m", offsetof(OmUmeshSample, patch.size), 3},
    {"force", "N", offsetof(OmUmeshSample, force), 3},
    {"direction", "1", offsetof(OmUmeshSample, direction), 3},
    {"tilt", "rad", offsetof(OmUmeshSample, tilt), 1},
    {"press", "m", offsetof(OmUmeshSample, press), 1},
    {"residual", "1", offsetof(OmUmeshSample, residual), 1},
    {"min_volume", "1", offsetof(OmUmeshSample, min_volume), 1},
    {"max_u", "m", offsetof(OmUmeshSample, max_u), 1},
    {"npatch", "1", offsetof(OmUmeshSample, npatch), 0},
    {"nattempt", "1", offsetof(OmUmeshSample, nattempt), 0},
    {"nfail", "1", offsetof(OmUmeshSample, nfail), 0},
    {"nnewton", "1", offsetof(OmUmeshSample, nnewton), 0},
};
#define NFIELD ((int)(sizeof field_table / sizeof *field_table))

static hid_t field_type(const Field* f) { return f->ncomp ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT; }
static size_t field_size(const Field* f) {
    return f->ncomp ? (size_t)f->ncomp * sizeof(double) : sizeof(int);
}

// Copy between samples and a flat array of the field.
static void pack_field(const Field* f, OmUmeshSample* sample, int num, char* flat,
                       bool is_packing) {
    for (int i = 0; i < num; ++i) {
        char *at = (char*)&sample[i] + f->offset, *to = flat + (size_t)i * field_size(f);
        memcpy(is_packing ? to : at, is_packing ? at : to, field_size(f));
    }
}

// ---- writing ----------------------------------------------------------------------------------------

typedef struct Writer {
    hid_t file, grid, sample;
    bool is_good;  // no call has failed
} Writer;

static void put_attribute(Writer* w, hid_t at, const char* name, hid_t type, hsize_t n,
                          const void* value) {
    hid_t space = n ? H5Screate_simple(1, &n, NULL) : H5Screate(H5S_SCALAR);
    hid_t a = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    w->is_good = w->is_good && a >= 0 && H5Awrite(a, type, value) >= 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
}

static void put_text(Writer* w, hid_t at, const char* name, const char* value) {
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, strlen(value) + 1);
    put_attribute(w, at, name, text, 0, value);
    H5Tclose(text);
}

// Make a dataset of rows x ncol x ncomp (0: no such dimension), in chunks of `chunk` rows.
static void put_array(Writer* w, hid_t group, const char* name, hid_t type, const hsize_t dim[3],
                      hsize_t chunk, const char* unit, const void* value) {
    hsize_t block[3] = {chunk < dim[0] ? chunk : dim[0], dim[1], dim[2]};
    int rank = dim[1] == 0 ? 1 : dim[2] == 0 ? 2 : 3;
    hid_t space = H5Screate_simple(rank, dim, NULL), how = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(how, false);
    H5Pset_chunk(how, rank, block);
    H5Pset_shuffle(how);
    H5Pset_deflate(how, 4);
    H5Pset_fletcher32(how);
    hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT);
    w->is_good =
        w->is_good && set >= 0 && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    if (set >= 0 && unit) put_text(w, set, "unit", unit);
    if (set >= 0) H5Dclose(set);
    H5Pclose(how);
    H5Sclose(space);
}

static hid_t put_group(hid_t file, const char* name) {
    hid_t how = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(how, false);
    hid_t group = H5Gcreate2(file, name, H5P_DEFAULT, how, H5P_DEFAULT);
    H5Pclose(how);
    return group;
}

static void put_settings(Writer* w, const OmUmeshShard* s, const OmUmeshGrid* g,
                         const OmUmeshDataDef* def) {
    const double where[6] = {g->fem.grid.origin.x,
                             g->fem.grid.origin.y,
                             g->fem.grid.origin.z,
                             g->up.x,
                             g->up.y,
                             g->up.z};
    const struct {
        const char* name;
        double value;
    } number[] = {{"spacing_m", g->fem.grid.spacing}, {"young_Pa", def->material.young},
                  {"poisson", def->material.poisson}, {"max_force_N", def->max_force},
                  {"max_tilt_rad", def->max_tilt},    {"press_share", def->press_share},
                  {"max_press_m", def->max_press},    {"pull_share", def->pull_share},
                  {"tolerance", def->tolerance},      {"min_volume", def->min_volume}};
    int format = FORMAT;
    put_text(w, w->file, "generator", GENERATOR);
    put_text(w, w->file, "law", om_law_name(def->material.law));
    put_attribute(w, w->file, "format", H5T_NATIVE_INT, 0, &format);
    put_attribute(w, w->file, "seed", H5T_NATIVE_UINT64, 0, &s->seed);
    put_attribute(w, w->file, "hash", H5T_NATIVE_UINT64, 0, &s->hash);
    put_attribute(w, w->file, "first", H5T_NATIVE_INT, 0, &s->first);
    put_attribute(w, w->file, "num", H5T_NATIVE_INT, 0, &s->num);
    put_attribute(w, w->file, "dim", H5T_NATIVE_INT, 3, g->fem.grid.dim);
    put_attribute(w, w->file, "origin_m", H5T_NATIVE_DOUBLE, 3, where);
    put_attribute(w, w->file, "up", H5T_NATIVE_DOUBLE, 3, where + 3);
    for (size_t k = 0; k < sizeof number / sizeof *number; ++k)
        put_attribute(w, w->file, number[k].name, H5T_NATIVE_DOUBLE, 0, &number[k].value);
}

static OmStatus put_all(Writer* w, const OmUmeshShard* s, const OmUmeshGrid* g,
                        const OmUmeshDataDef* def) {
    hsize_t nnode = (hsize_t)g->fem.mesh.nnode, num = (hsize_t)s->num,
            npoint = (hsize_t)g->fem.npoint;
    OmStatus status = OM_OK;
    unsigned char* active = NULL;
    char* flat = NULL;
    OM_ALLOC_DONE(active, g->fem.npoint);
    OM_ALLOC_DONE(flat, 3 * sizeof(double) * (size_t)s->num);
    for (int p = 0; p < g->fem.npoint; ++p) active[p] = g->fem.cell_elem[p] >= 0;
    put_settings(w, s, g, def);
    put_array(w, w->grid, "active", H5T_NATIVE_UCHAR, (hsize_t[3]){npoint}, npoint, NULL, active);
    put_array(w, w->grid, "fixed", H5T_NATIVE_UCHAR, (hsize_t[3]){nnode}, nnode, NULL,
              g->fem.fixed);
    put_array(w, w->grid, "skin_x", H5T_NATIVE_DOUBLE, (hsize_t[3]){nnode, 3}, nnode, "m",
              g->surface_x);
    for (int k = 0; k < NFIELD; ++k) {
        const Field* f = &field_table[k];
        pack_field(f, s->sample, s->num, flat, true);
        hsize_t ncomp = f->ncomp > 1 ? (hsize_t)f->ncomp : 0;
        put_array(w, w->sample, f->name, field_type(f), (hsize_t[3]){num, ncomp}, num, f->unit,
                  flat);
    }
    put_array(w, w->sample, "mask", H5T_NATIVE_UCHAR, (hsize_t[3]){num, nnode}, num, NULL, s->mask);
    put_array(w, w->sample, "u", H5T_NATIVE_FLOAT, (hsize_t[3]){num, nnode, 3}, 1, "m", s->u);
done:
    om_free(active);
    om_free(flat);
    return status;
}

// The head and the image into one file.
static OmStatus save_image(hid_t file, const char* path) {
    ssize_t size = H5Fget_file_image(file, NULL, 0);
    OM_CHECK(size > 0, OM_IO, "%s: HDF5 has no image of the file", path);
    char* data = om_calloc(HEAD + (size_t)size, 1);
    if (!data) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OM_CHECK_DONE(H5Fget_file_image(file, data + HEAD, (size_t)size) == size, OM_IO,
                  "%s: HDF5 has no image of the file", path);
    snprintf(data, HEAD, "omentum umesh %d\nsize %zu\nhash %016" PRIx64 "\n", FORMAT, (size_t)size,
             om_hash(data + HEAD, (size_t)size, OM_HASH_SEED));
    status = om_file_write(path, data, HEAD + (size_t)size);
done:
    om_free(data);
    return status;
}

static hid_t memory_access(void) {
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // HDF5 prints no errors: this file reports them
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    H5Pset_fapl_core(access, BLOCK, false);
    return access;
}

OmStatus om__umesh_shard_save(const OmUmeshShard* s, const OmUmeshGrid* g,
                              const OmUmeshDataDef* def, const char* path) {
    hid_t access = memory_access();
    Writer w = {.file = H5Fcreate("umesh", H5F_ACC_TRUNC, H5P_DEFAULT, access), .is_good = true};
    H5Pclose(access);
    OM_CHECK(w.file >= 0, OM_NO_MEMORY, "%s: HDF5 cannot begin a file in memory", path);
    w.grid = put_group(w.file, "grid");
    w.sample = put_group(w.file, "sample");
    OmStatus status = put_all(&w, s, g, def);
    if (w.grid >= 0) H5Gclose(w.grid);
    if (w.sample >= 0) H5Gclose(w.sample);
    if (status == OM_OK && !(w.is_good && H5Fflush(w.file, H5F_SCOPE_GLOBAL) >= 0))
        status = om_error(OM_IO, "%s: HDF5 cannot write the samples", path);
    if (status == OM_OK) status = save_image(w.file, path);
    H5Fclose(w.file);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

typedef struct Reader {
    hid_t file;
    const char* name;  // of the file, for messages
} Reader;

static OmStatus get_attribute(const Reader* r, const char* name, hid_t type, int n, void* value) {
    bool is_good = H5Aexists(r->file, name) > 0;
    hid_t a = is_good ? H5Aopen(r->file, name, H5P_DEFAULT) : -1, space = -1;
    if (a >= 0) space = H5Aget_space(a);
    is_good =
        space >= 0 && H5Sget_simple_extent_npoints(space) == n && H5Aread(a, type, value) >= 0;
    if (space >= 0) H5Sclose(space);
    if (a >= 0) H5Aclose(a);
    OM_CHECK(is_good, OM_INVALID, "%s: attribute %s is missing or has the wrong shape", r->name,
             name);
    return OM_OK;
}

// Open a dataset of the given shape; 0 ends the extents.
static OmStatus open_array(const Reader* r, const char* name, const hsize_t dim[3], hid_t* set) {
    hsize_t have[3] = {0, 0, 0};
    *set = H5Dopen2(r->file, name, H5P_DEFAULT);
    hid_t space = *set >= 0 ? H5Dget_space(*set) : -1;
    int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : 0;
    if (rank >= 1 && rank <= 3) H5Sget_simple_extent_dims(space, have, NULL);
    if (space >= 0) H5Sclose(space);
    if (rank >= 1 && rank <= 3 && memcmp(have, dim, sizeof have) == 0) return OM_OK;
    if (*set >= 0) H5Dclose(*set);
    return om_error(OM_INVALID, "%s: array %s is missing or has the wrong shape", r->name, name);
}

static OmStatus get_array(const Reader* r, const char* name, hid_t type, const hsize_t dim[3],
                          void* value) {
    hid_t set;
    OM_TRY(open_array(r, name, dim, &set));
    bool is_read = H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0;
    H5Dclose(set);
    OM_CHECK(is_read, OM_INVALID, "%s: array %s cannot be read; make the file again", r->name,
             name);
    return OM_OK;
}

static OmStatus check_finite(const Reader* r, const char* name, const double* v, size_t n) {
    for (size_t i = 0; i < n; ++i)
        OM_CHECK(isfinite(v[i]), OM_INVALID, "%s: value %zu of %s is not finite", r->name, i, name);
    return OM_OK;
}

static OmStatus get_frame(const Reader* r, OmGrid* f, OmVec3* up) {
    double origin[3], direction[3], total = 1;
    int format;
    OM_TRY(get_attribute(r, "format", H5T_NATIVE_INT, 1, &format));
    OM_CHECK(format == FORMAT, OM_UNAVAILABLE, "%s: format %d; this program reads %d", r->name,
             format, FORMAT);
    OM_TRY(get_attribute(r, "dim", H5T_NATIVE_INT, 3, f->dim));
    OM_TRY(get_attribute(r, "spacing_m", H5T_NATIVE_DOUBLE, 1, &f->spacing));
    OM_TRY(get_attribute(r, "origin_m", H5T_NATIVE_DOUBLE, 3, origin));
    OM_TRY(get_attribute(r, "up", H5T_NATIVE_DOUBLE, 3, direction));
    for (int c = 0; c < 3; ++c) {
        OM_CHECK(f->dim[c] >= 2 && f->dim[c] <= OM__UMESH_MAX_POINT, OM_INVALID,
                 "%s: a grid of %d x %d x %d points", r->name, f->dim[0], f->dim[1], f->dim[2]);
        total *= f->dim[c];
    }
    OM_CHECK(total <= OM__UMESH_MAX_POINT, OM_INVALID,
             "%s: a grid of %d x %d x %d points is too large", r->name, f->dim[0], f->dim[1],
             f->dim[2]);
    OM_CHECK(f->spacing > 0 && isfinite(f->spacing), OM_INVALID, "%s: spacing %g m", r->name,
             f->spacing);
    OM_TRY(check_finite(r, "origin_m", origin, 3));
    OM_TRY(check_finite(r, "up", direction, 3));
    f->origin = om_load3(origin, 0);
    *up = om_load3(direction, 0);
    return OM_OK;
}

static OmStatus get_grid(const Reader* r, OmUmeshGrid* g) {
    OmGrid points = {0};
    OmVec3 up;
    OM_TRY(get_frame(r, &points, &up));
    hsize_t npoint = (hsize_t)om_grid_count(points.dim);
    unsigned char* active = om_alloc((size_t)npoint, 1);
    if (!active) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OM_TRY_DONE(get_array(r, "grid/active", H5T_NATIVE_UCHAR, (hsize_t[3]){npoint}, active));
    status = om__umesh_grid_init(&points, up, active, g);
    if (status < 0) {
        om_error_prefix(status, "%s", r->name);
        goto done;
    }
    hsize_t nnode = (hsize_t)g->fem.mesh.nnode;
    OM_TRY_DONE(get_array(r, "grid/fixed", H5T_NATIVE_UCHAR, (hsize_t[3]){nnode}, g->fem.fixed));
    OM_TRY_DONE(
        get_array(r, "grid/skin_x", H5T_NATIVE_DOUBLE, (hsize_t[3]){nnode, 3}, g->surface_x));
    OM_TRY_DONE(check_finite(r, "grid/skin_x", g->surface_x, 3 * (size_t)nnode));
    for (hsize_t i = 0; i < nnode; ++i) g->fem.fixed[i] = g->fem.fixed[i] != 0;
    OM_TRY_DONE(om__umesh_grid_find_surface(g));
    g->hash = om__umesh_grid_hash(g);
done:
    om_free(active);
    if (status < 0) om_umesh_grid_done(g);
    return status;
}

static OmStatus get_samples(const Reader* r, int nnode, OmUmeshShard* s) {
    int num = 0;
    char* flat = NULL;
    hsize_t n = (hsize_t)nnode;
    OM_TRY(get_attribute(r, "seed", H5T_NATIVE_UINT64, 1, &s->seed));
    OM_TRY(get_attribute(r, "hash", H5T_NATIVE_UINT64, 1, &s->hash));
    OM_TRY(get_attribute(r, "first", H5T_NATIVE_INT, 1, &s->first));
    OM_TRY(get_attribute(r, "num", H5T_NATIVE_INT, 1, &num));
    OM_CHECK(num >= 1 && num <= 10000 && s->first >= 0, OM_INVALID, "%s: %d samples from %d on",
             r->name, num, s->first);
    const hsize_t extent[3] = {(hsize_t)num, n, 3};
    hid_t set;
    OM_TRY(open_array(r, "sample/u", extent, &set));  // before this much memory is allocated
    H5Dclose(set);
    OmStatus status = OM_OK;
    OM_TRY(om__umesh_shard_alloc(nnode, num, s));
    OM_ALLOC_DONE(flat, 3 * sizeof(double) * (size_t)num);
    for (int k = 0; k < NFIELD; ++k) {
        const Field* f = &field_table[k];
        char name[64];
        snprintf(name, sizeof name, "sample/%s", f->name);
        hsize_t ncomp = f->ncomp > 1 ? (hsize_t)f->ncomp : 0;
        OM_TRY_DONE(get_array(r, name, field_type(f), (hsize_t[3]){(hsize_t)num, ncomp}, flat));
        if (f->ncomp)
            OM_TRY_DONE(check_finite(r, name, (double*)(void*)flat, (size_t)(num * f->ncomp)));
        pack_field(f, s->sample, num, flat, false);
    }
    OM_TRY_DONE(
        get_array(r, "sample/mask", H5T_NATIVE_UCHAR, (hsize_t[3]){(hsize_t)num, n}, s->mask));
    OM_TRY_DONE(get_array(r, "sample/u", H5T_NATIVE_FLOAT, extent, s->u));
    for (size_t i = 0; i < (size_t)num * (size_t)nnode; ++i) s->mask[i] = s->mask[i] != 0;
    for (size_t i = 0; i < 3 * (size_t)num * (size_t)nnode; ++i)
        OM_CHECK_DONE(isfinite(s->u[i]), OM_INVALID, "%s: displacement %zu is not finite", r->name,
                      i);
done:
    om_free(flat);
    if (status < 0) om__umesh_shard_done(s);
    return status;
}

// Check the header: size and hash of the HDF5 part must be correct.
static OmStatus check_head(const char* data, size_t size, const char* name) {
    int format = 0;
    size_t length = 0;
    uint64_t hash = 0;
    char head[HEAD + 1] = "";
    memcpy(head, data, size < HEAD ? size : HEAD);
    OM_CHECK(sscanf(head, "omentum umesh %d", &format) == 1, OM_INVALID,
             "%s: not a file of samples", name);
    OM_CHECK(format == FORMAT, OM_UNAVAILABLE, "%s: format %d; this program reads %d", name, format,
             FORMAT);
    bool is_whole = size > HEAD &&
                    sscanf(head, "omentum umesh %*d\nsize %zu\nhash %" SCNx64, &length, &hash) == 2;
    OM_CHECK(is_whole && length == size - HEAD, OM_INVALID,
             "%s: the file is truncated; make it again", name);
    OM_CHECK(hash == om_hash(data + HEAD, length, OM_HASH_SEED), OM_INVALID,
             "%s: the file is corrupted, its checksum is wrong; make it again", name);
    return OM_OK;
}

OmStatus om__umesh_shard_parse(const char* data, size_t size, const char* name, OmUmeshGrid* grid,
                               OmUmeshShard* shard) {
    *grid = (OmUmeshGrid){0};
    *shard = (OmUmeshShard){0};
    OM_TRY(check_head(data, size, name));
    hid_t access = memory_access();
    bool is_good = H5Pset_file_image(access, (void*)(data + HEAD), size - HEAD) >= 0;
    Reader r = {.file = is_good ? H5Fopen("umesh", H5F_ACC_RDONLY, access) : -1, .name = name};
    H5Pclose(access);
    OM_CHECK(r.file >= 0, OM_INVALID, "%s: HDF5 cannot open what is in the file", name);
    OmStatus status = get_grid(&r, grid);
    if (status == OM_OK) status = get_samples(&r, grid->fem.mesh.nnode, shard);
    if (status < 0) om_umesh_grid_done(grid);
    H5Fclose(r.file);
    return status;
}

OmStatus om__umesh_shard_load(const char* path, OmUmeshGrid* grid, OmUmeshShard* shard) {
    char* data;
    size_t size;
    *grid = (OmUmeshGrid){0};
    *shard = (OmUmeshShard){0};
    OM_TRY(om_file_read(path, MAX_BYTES, &data, &size));
    OmStatus status = om__umesh_shard_parse(data, size, path, grid, shard);
    om_free(data);
    return status;
}
