// shape_vtkhdf.c: recordings of runs as VTKHDF, the only file that knows HDF5.
//
// The format (VTK file formats, "VTK HDF", version 2.1): a group VTKHDF of type UnstructuredGrid with flat
// arrays to which every step appends, and a group Steps with the time of each step and the first row of
// its part of every array. Elements, labels and sets do not change, so all steps refer to the first copy.
// Positions and the arrays of a step are stored in single precision: half the bytes, and its error of 6e-8
// relative is not visible in a picture.
#include <errno.h>
#include <hdf5.h>
#include <string.h>

#include "shape/shape_file_internal.h"

#define MAX_ARRAY 16
#define CHUNK_BYTES (256u << 10)
#define VTK_TRIANGLE 5

typedef struct Recorded {
    OmMeshArray array;  // its values are not kept
    char name[64];
    hid_t data;    // dataset of values
    hid_t offset;  // dataset of the first row of each step
} Recorded;

struct OmRecording {
    OmAtomicFile target;
    hid_t file, root, steps, point_data, cell_data, point_offsets, cell_offsets;
    hid_t points, values, parts, part_offsets, point_starts, cell_starts, connectivity_starts;
    Recorded array[MAX_ARRAY];  // arrays that have values at each step
    int narray;
    int nvert, ncell, nstep;  // of all parts
    double last_time;
};

static OmStatus failed(const OmRecording* r, const char* doing) {
    return om_error(OM_IO, "%s: recording: cannot %s%s%s", r->target.path, doing, errno ? ": " : "",
                    errno ? strerror(errno) : "");
}

static hid_t type_of(OmArrayType type) {
    switch (type) {
    case OM_ARRAY_DOUBLE: return H5T_NATIVE_DOUBLE;
    case OM_ARRAY_FLOAT: return H5T_NATIVE_FLOAT;
    case OM_ARRAY_INT: return H5T_NATIVE_INT;
    default: return H5T_NATIVE_UCHAR;
    }
}

// Arrays of double are stored as float; HDF5 converts.
static hid_t step_type_of(OmArrayType type) {
    return type == OM_ARRAY_DOUBLE ? H5T_NATIVE_FLOAT : type_of(type);
}

// A dataset of rows x ncol (ncol 0: one dimension) that can grow by rows.
static hid_t make_growing(hid_t group, const char* name, hid_t type, hsize_t ncol) {
    hsize_t dim[2] = {0, ncol}, max[2] = {H5S_UNLIMITED, ncol};
    size_t row = H5Tget_size(type) * (ncol ? ncol : 1);
    hsize_t chunk[2] = {CHUNK_BYTES / row ? CHUNK_BYTES / row : 1, ncol};
    if (strcmp(name, "Values") == 0 || row <= 8) chunk[0] = 4096;
    int rank = ncol ? 2 : 1;
    hid_t space = H5Screate_simple(rank, dim, max), plist = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(plist, false);  // the same run gives the same bytes
    H5Pset_chunk(plist, rank, chunk);
    bool is_value = H5Tget_class(type) == H5T_FLOAT && strcmp(name, "Values") != 0;
    if (row > 8 || is_value) {
        H5Pset_shuffle(plist);  // group bytes of equal significance: files are a third smaller
        H5Pset_deflate(plist, 1);
    }
    hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    H5Pclose(plist);
    H5Sclose(space);
    return set;
}

// Append `count` rows; `first` receives the index of the first one.
static bool append(hid_t set, hid_t type, hsize_t count, const void* value, hsize_t* first) {
    hid_t space = H5Dget_space(set);
    hsize_t dim[2] = {0, 0};
    int rank = H5Sget_simple_extent_dims(space, dim, NULL);
    H5Sclose(space);
    if (rank < 1) return false;
    if (first) *first = dim[0];
    hsize_t start[2] = {dim[0], 0}, size[2] = {count, dim[1]};
    dim[0] += count;
    if (H5Dset_extent(set, dim) < 0) return false;
    if (count == 0) return true;
    space = H5Dget_space(set);
    hid_t memory = H5Screate_simple(rank, size, NULL);
    bool is_good = H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, size, NULL) >= 0 &&
                   H5Dwrite(set, type, memory, space, H5P_DEFAULT, value) >= 0;
    H5Sclose(memory);
    H5Sclose(space);
    return is_good;
}

static bool append_one(hid_t set, int64_t value) {
    return append(set, H5T_NATIVE_INT64, 1, &value, NULL);
}

static bool write_fixed(hid_t group, const char* name, hid_t type, hsize_t n, hsize_t ncol,
                        const void* value) {
    hid_t set = make_growing(group, name, type, ncol);
    bool is_good = set >= 0 && append(set, type, n, value, NULL);
    if (set >= 0) H5Dclose(set);
    return is_good;
}

static bool write_attribute(hid_t group, const char* name, hid_t type, hsize_t n,
                            const void* value) {
    hid_t space = n ? H5Screate_simple(1, &n, NULL) : H5Screate(H5S_SCALAR);
    hid_t a = H5Acreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    bool is_good = a >= 0 && H5Awrite(a, type, value) >= 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
    return is_good;
}

static bool write_header(OmRecording* r) {
    int64_t version[2] = {2, 1}, nsteps = 0;
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, 16);
    H5Tset_strpad(text, H5T_STR_NULLPAD);
    bool is_good = write_attribute(r->root, "Version", H5T_NATIVE_INT64, 2, version) &&
                   write_attribute(r->root, "Type", text, 0, "UnstructuredGrid") &&
                   write_attribute(r->steps, "NSteps", H5T_NATIVE_INT64, 0, &nsteps);
    H5Tclose(text);
    return is_good;
}

// The recorded parts: a mesh, and surfaces after it.
typedef struct Whole {
    const OmTetMesh* mesh;  // its tet_vert is not used
    const int* cell_node;   // nodes of its tetrahedra (ntet x ncell_node)
    int ncell_node;
    const char* name;
    const OmRecordedSurface* surface;
    int nsurface;
} Whole;

// Elements, written once: connectivity, first corner of each, their type, the part and the label of each.
static OmStatus write_elements(OmRecording* r, const Whole* w) {
    const size_t ntet = (size_t)w->mesh->ntet, n = (size_t)r->ncell, nnode = (size_t)w->ncell_node;
    const size_t nconn = nnode * ntet + 3 * (n - ntet);
    int64_t *index = NULL, *begin = NULL;
    unsigned char* kind = NULL;
    int *part = NULL, *label = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(index, nconn + 1);
    OM_ALLOC_DONE(begin, n + 1);
    OM_ALLOC_DONE(kind, n + 1);
    OM_ALLOC_DONE(part, n + 1);
    OM_ALLOC_DONE(label, n + 1);
    for (size_t i = 0; i < nnode * ntet; ++i) index[i] = w->cell_node[i];
    for (size_t i = 0; i < ntet; ++i) {
        begin[i] = (int64_t)(nnode * i);
        kind[i] = om__vtk_tetra(w->ncell_node);
        part[i] = 0;
        label[i] = w->mesh->tet_label[i];
    }
    size_t cell = ntet, at = nnode * ntet;
    int64_t first = w->mesh->nvert;
    for (int k = 0; k < w->nsurface; ++k) {
        const OmSurface* s = w->surface[k].surface;
        for (int t = 0; t < s->ntri; ++t, ++cell, at += 3) {
            for (int c = 0; c < 3; ++c) index[at + (size_t)c] = first + s->tri_vert[3 * t + c];
            begin[cell] = (int64_t)at;
            kind[cell] = VTK_TRIANGLE;
            part[cell] = k + 1;
            label[cell] = -1;
        }
        first += s->nvert;
    }
    begin[n] = (int64_t)nconn;
    const int64_t nvert = r->nvert, ncell = r->ncell, nindex = (int64_t)nconn;
    bool is_good =
        write_fixed(r->root, "Connectivity", H5T_NATIVE_INT64, nconn, 0, index) &&
        write_fixed(r->root, "Offsets", H5T_NATIVE_INT64, n + 1, 0, begin) &&
        write_fixed(r->root, "Types", H5T_NATIVE_UCHAR, n, 0, kind) &&
        write_fixed(r->root, "NumberOfPoints", H5T_NATIVE_INT64, 1, 0, &nvert) &&
        write_fixed(r->root, "NumberOfCells", H5T_NATIVE_INT64, 1, 0, &ncell) &&
        write_fixed(r->root, "NumberOfConnectivityIds", H5T_NATIVE_INT64, 1, 0, &nindex) &&
        write_fixed(r->cell_data, "tet_label", H5T_NATIVE_INT, n, 0, label);
    if (is_good && w->nsurface > 0)
        is_good = write_fixed(r->cell_data, "part", H5T_NATIVE_INT, n, 0, part);
    OM_CHECK_DONE(is_good, OM_IO, "%s: recording: cannot write the elements", r->target.path);
done:
    om_free(index);
    om_free(begin);
    om_free(kind);
    om_free(part);
    om_free(label);
    return status;
}

// "0 tissue, 1 organ, ...": the names of the parts, for people and other programs.
static OmStatus write_names(OmRecording* r, const Whole* w) {
    OmText names = {0};
    OmStatus status = om_text_append(&names, "0 %s", w->name);
    for (int k = 0; status == OM_OK && k < w->nsurface; ++k)
        status = om_text_append(&names, ", %d %s", k + 1, w->surface[k].name);
    if (status == OM_OK) {
        hid_t text = H5Tcopy(H5T_C_S1);
        H5Tset_size(text, names.len + 1);
        bool is_good = write_attribute(r->root, "part_names", text, 0, names.str);
        H5Tclose(text);
        if (!is_good) status = failed(r, "write the names of the parts");
    }
    om_text_done(&names);
    return status;
}

// Named sets as constant arrays of 0 and 1.
static OmStatus write_sets(OmRecording* r, const OmTetMesh* mesh) {
    unsigned char* flag = om_alloc((size_t)r->nvert, 1);
    if (!flag) return OM_NO_MEMORY;
    bool is_good = true;
    for (int s = 0; is_good && s < mesh->nset; ++s) {
        memset(flag, 0, (size_t)r->nvert);
        for (int i = 0; i < mesh->set[s].nvert; ++i) flag[mesh->set[s].vert[i]] = 1;
        is_good = write_fixed(r->point_data, mesh->set[s].name, H5T_NATIVE_UCHAR, (hsize_t)r->nvert,
                              0, flag);
    }
    om_free(flag);
    return is_good ? OM_OK : failed(r, "write the sets");
}

static OmStatus add_array(OmRecording* r, const OmMeshArray* a) {
    OM_CHECK(a->name && a->name[0] && strlen(a->name) < 64 && !strchr(a->name, '/'), OM_INVALID,
             "recording: an array has no usable name");
    OM_CHECK(a->ncomp >= 1 && a->ncomp <= 9, OM_INVALID,
             "recording: array %s has %d components; 1 to 9", a->name, a->ncomp);
    hid_t group = a->is_cell ? r->cell_data : r->point_data;
    hsize_t ncol = a->ncomp > 1 ? (hsize_t)a->ncomp : 0;
    hsize_t n = (hsize_t)(a->is_cell ? r->ncell : r->nvert);
    if (a->value) {
        return write_fixed(group, a->name, type_of(a->type), n, ncol, a->value)
                   ? OM_OK
                   : failed(r, "write an array");
    }
    OM_CHECK(r->narray < MAX_ARRAY, OM_INVALID, "recording: more than %d arrays a step", MAX_ARRAY);
    Recorded* rec = &r->array[r->narray];
    rec->array = *a;
    snprintf(rec->name, sizeof rec->name, "%s", a->name);
    rec->data = make_growing(group, a->name, step_type_of(a->type), ncol);
    rec->offset =
        make_growing(a->is_cell ? r->cell_offsets : r->point_offsets, a->name, H5T_NATIVE_INT64, 0);
    ++r->narray;
    return rec->data >= 0 && rec->offset >= 0 ? OM_OK : failed(r, "make an array");
}

static hid_t make_group(hid_t parent, const char* name) {
    // Readers of VTKHDF expect that creation order is tracked.
    hid_t plist = H5Pcreate(H5P_GROUP_CREATE);
    H5Pset_obj_track_times(plist, false);
    H5Pset_link_creation_order(plist, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    hid_t group = H5Gcreate2(parent, name, H5P_DEFAULT, plist, H5P_DEFAULT);
    H5Pclose(plist);
    return group;
}

static OmStatus open_file(OmRecording* r, const char* path) {
    errno = 0;
    (void)H5dont_atexit();                  // its last flush, at exit, crashes on a full disk
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);  // omentum reports the errors
    OM_TRY(om_file_begin(path, &r->target));
    OM_CHECK(r->target.temp[0], OM_IO, "%s: is no file; a recording needs one", path);
    hid_t access = H5Pcreate(H5P_FILE_ACCESS), how = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_file_locking(access, false, true);  // the lock is om_file_begin's
    H5Pset_obj_track_times(how, false);        // of the root group
    r->file = H5Fcreate(r->target.temp, H5F_ACC_TRUNC, how, access);
    H5Pclose(how);
    H5Pclose(access);
    if (r->file < 0) return failed(r, "create the file");
    r->root = make_group(r->file, "VTKHDF");
    r->steps = make_group(r->root, "Steps");
    r->point_data = make_group(r->root, "PointData");
    r->cell_data = make_group(r->root, "CellData");
    r->point_offsets = make_group(r->steps, "PointDataOffsets");
    r->cell_offsets = make_group(r->steps, "CellDataOffsets");
    r->points = make_growing(r->root, "Points", H5T_NATIVE_FLOAT, 3);
    r->values = make_growing(r->steps, "Values", H5T_NATIVE_DOUBLE, 0);
    r->parts = make_growing(r->steps, "NumberOfParts", H5T_NATIVE_INT64, 0);
    r->part_offsets = make_growing(r->steps, "PartOffsets", H5T_NATIVE_INT64, 0);
    r->point_starts = make_growing(r->steps, "PointOffsets", H5T_NATIVE_INT64, 0);
    r->cell_starts = make_growing(r->steps, "CellOffsets", H5T_NATIVE_INT64, 1);
    r->connectivity_starts = make_growing(r->steps, "ConnectivityIdOffsets", H5T_NATIVE_INT64, 1);
    bool is_good = r->connectivity_starts >= 0 && r->points >= 0 && write_header(r);
    return is_good ? OM_OK : failed(r, "write the head");
}

static OmStatus check_surfaces(OmRecording* r, const Whole* w) {
    OM_CHECK(w->nsurface >= 0 && w->nsurface <= OM_RECORDING_MAX_SURFACE, OM_INVALID,
             "recording: %d surfaces; up to %d", w->nsurface, OM_RECORDING_MAX_SURFACE);
    int64_t nvert = w->mesh->nvert, ncell = w->mesh->ntet;
    for (int k = 0; k < w->nsurface; ++k) {
        OM_CHECK(w->surface[k].name && w->surface[k].name[0], OM_INVALID,
                 "recording: surface %d has no name", k + 1);
        nvert += w->surface[k].surface->nvert;
        ncell += w->surface[k].surface->ntri;
    }
    OM_CHECK(nvert <= INT32_MAX && ncell <= INT32_MAX / w->ncell_node, OM_INVALID,
             "recording: %lld vertices and %lld cells are too many", (long long)nvert,
             (long long)ncell);
    r->nvert = (int)nvert;
    r->ncell = (int)ncell;
    return OM_OK;
}

static OmStatus begin(const char* path, const Whole* whole, const OmRecordingArrays* arrays,
                      OmRecording** recording) {
    *recording = NULL;
    OmRecording* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    r->file = -1;
    OmStatus status = check_surfaces(r, whole);
    if (status == OM_OK) status = open_file(r, path);
    if (status == OM_OK) status = write_elements(r, whole);
    if (status == OM_OK && whole->nsurface > 0) status = write_names(r, whole);
    if (status == OM_OK) status = write_sets(r, whole->mesh);
    for (int i = 0; status == OM_OK && i < arrays->narray; ++i)
        status = add_array(r, &arrays->array[i]);
    if (status < 0)
        om_recording_abort(r);
    else
        *recording = r;
    return status;
}

OmStatus om_recording_begin_scene(const char* path, const OmTetMesh* mesh, const char* mesh_name,
                                  const OmRecordedSurface* surface, int nsurface,
                                  const OmRecordingArrays* arrays, OmRecording** recording) {
    const Whole whole = {mesh, mesh->tet_vert, 4, mesh_name, surface, nsurface};
    return begin(path, &whole, arrays, recording);
}

OmStatus om_recording_begin_tet10(const char* path, const OmTet10Mesh* mesh, const char* mesh_name,
                                  const OmRecordedSurface* surface, int nsurface,
                                  const OmRecordingArrays* arrays, OmRecording** recording) {
    const OmTetMesh nodes = om__tet10_view(mesh);
    const Whole whole = {&nodes, mesh->elem_node, 10, mesh_name, surface, nsurface};
    *recording = NULL;
    OM_TRY(om_tet10_mesh_validate(mesh));
    return begin(path, &whole, arrays, recording);
}

OmStatus om_recording_begin(const char* path, const OmTetMesh* mesh, const OmMeshArray* array,
                            int narray, OmRecording** recording) {
    const OmRecordingArrays arrays = {array, narray};
    return om_recording_begin_scene(path, mesh, "mesh", NULL, 0, &arrays, recording);
}

OmStatus om_recording_add_step(OmRecording* r, double time, const double* x,
                               const void* const* value) {
    OM_CHECK(isfinite(time) && (r->nstep == 0 || time > r->last_time), OM_INVALID,
             "recording: time %g s does not follow %g s", time, r->last_time);
    hsize_t first;
    errno = 0;  // HDF5 keeps the errno of the failed write
    bool is_good = append(r->points, H5T_NATIVE_DOUBLE, (hsize_t)r->nvert, x, &first) &&
                   append_one(r->point_starts, (int64_t)first) && append_one(r->parts, 1) &&
                   append_one(r->part_offsets, 0) && append_one(r->cell_starts, 0) &&
                   append_one(r->connectivity_starts, 0) &&
                   append(r->values, H5T_NATIVE_DOUBLE, 1, &time, NULL);
    for (int i = 0; is_good && i < r->narray; ++i) {
        Recorded* a = &r->array[i];
        hsize_t n = (hsize_t)(a->array.is_cell ? r->ncell : r->nvert);
        is_good = append(a->data, type_of(a->array.type), n, value[i], &first) &&
                  append_one(a->offset, (int64_t)first);
    }
    if (!is_good) return failed(r, "write a step");
    r->last_time = time;
    ++r->nstep;
    return OM_OK;
}

static bool write_step_count(OmRecording* r) {
    int64_t n = r->nstep;
    hid_t a = H5Aopen(r->steps, "NSteps", H5P_DEFAULT);
    bool is_good = a >= 0 && H5Awrite(a, H5T_NATIVE_INT64, &n) >= 0;
    if (a >= 0) H5Aclose(a);
    return is_good;
}

// Arrays that do not change begin at row 0 in every step.
static bool write_constant_offsets(const OmRecording* r, hid_t data, hid_t offsets,
                                   const int64_t* zero) {
    H5G_info_t info;
    bool is_good = H5Gget_info(data, &info) >= 0;
    for (hsize_t i = 0; is_good && i < info.nlinks; ++i) {
        char name[256];
        is_good = H5Lget_name_by_idx(data, ".", H5_INDEX_NAME, H5_ITER_INC, i, name, sizeof name,
                                     H5P_DEFAULT) >= 0;
        if (is_good && H5Lexists(offsets, name, H5P_DEFAULT) == 0) {
            is_good = write_fixed(offsets, name, H5T_NATIVE_INT64, (hsize_t)r->nstep, 0, zero);
        }
    }
    return is_good;
}

// Close all objects; their order does not matter, but the file is last.
static bool close_all(OmRecording* r) {
    if (r->file < 0) return true;
    hid_t set[] = {r->points,
                   r->values,
                   r->parts,
                   r->part_offsets,
                   r->point_starts,
                   r->cell_starts,
                   r->connectivity_starts};
    hid_t group[] = {r->point_offsets, r->cell_offsets, r->point_data,
                     r->cell_data,     r->steps,        r->root};
    for (size_t i = 0; i < sizeof set / sizeof *set; ++i) {
        if (set[i] > 0) H5Dclose(set[i]);
    }
    for (int i = 0; i < r->narray; ++i) {
        if (r->array[i].data > 0) H5Dclose(r->array[i].data);
        if (r->array[i].offset > 0) H5Dclose(r->array[i].offset);
    }
    for (size_t i = 0; i < sizeof group / sizeof *group; ++i) {
        if (group[i] > 0) H5Gclose(group[i]);
    }
    bool is_good = H5Fflush(r->file, H5F_SCOPE_GLOBAL) >= 0;
    is_good = H5Fclose(r->file) >= 0 && is_good;
    r->file = -1;
    return is_good;
}

OmStatus om_recording_end(OmRecording* r) {
    if (!r) return OM_OK;
    int64_t* zero = om_calloc((size_t)r->nstep + 1, sizeof *zero);
    if (!zero) {
        om_recording_abort(r);
        return OM_NO_MEMORY;
    }
    errno = 0;
    bool is_good = write_step_count(r) &&
                   write_constant_offsets(r, r->point_data, r->point_offsets, zero) &&
                   write_constant_offsets(r, r->cell_data, r->cell_offsets, zero);
    om_free(zero);
    is_good = close_all(r) && is_good;
    // HDF5 wrote the temporary file with its own descriptor; om_file syncs and renames it.
    OmStatus status = is_good ? om_file_commit(&r->target) : failed(r, "finish the file");
    om_recording_abort(r);
    return status;
}

void om_recording_abort(OmRecording* r) {
    if (!r) return;
    (void)close_all(r);
    om_file_abort(&r->target);
    om_free(r);
}
