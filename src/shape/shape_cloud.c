// shape_cloud.c: point clouds from files, and into files.
//
// Points that are not finite are left out: depth cameras write them for pixels without a return. Equal points become
// one, found by a hash of their coordinates.
#include <string.h>

#include "shape/shape_file_internal.h"

#define MIN_NORMAL 1e-6  // a shorter normal of a file is none

void om_point_cloud_done(OmPointCloud* cloud) {
    if (!cloud) return;
    om_free(cloud->x);
    om_free(cloud->normal);
    om_free(cloud->tri_vert);
    memset(cloud, 0, sizeof *cloud);
}

static OmStatus cloud_init(int npoint, int ntri, bool has_normal, OmPointCloud* cloud) {
    OmStatus status = OM_OK;
    memset(cloud, 0, sizeof *cloud);
    OM_ALLOC_DONE(cloud->x, 3 * (size_t)npoint);
    if (has_normal) OM_ALLOC_DONE(cloud->normal, 3 * (size_t)npoint);
    OM_ALLOC_DONE(cloud->tri_vert, 3 * (size_t)ntri);
done:
    if (status < 0) om_point_cloud_done(cloud);
    return status;
}

// The normal of a vertex in the file, of length 1; zero if there is none.
static OmVec3 normal_of(const OmFileMesh* m, int i) {
    if (i >= m->nnormal) return om_vec3(0, 0, 0);
    OmVec3 n = om_load3(m->normal, i);
    double length = om_norm(n);
    bool is_good = isfinite(length) && length > MIN_NORMAL;
    return is_good ? om_scale(1 / length, n) : om_vec3(0, 0, 0);
}

typedef struct Places {  // a hash table of points: head[hash], then next[point], -1 ends
    int *head, *next;
    uint64_t mask;
} Places;

static OmStatus places_init(Places* p, int n) {
    OmStatus status = OM_OK;
    uint64_t size = 16;
    while (size < (uint64_t)n) size *= 2;
    *p = (Places){.mask = size - 1};
    OM_ALLOC_DONE(p->head, size);
    OM_ALLOC_DONE(p->next, n);
    memset(p->head, 0xff, size * sizeof *p->head);  // -1
done:
    return status;
}

static void places_done(Places* p) {
    om_free(p->head);
    om_free(p->next);
}

// The point of the cloud at x, which is added if it is the first there.
static int find_place(Places* p, OmPointCloud* cloud, OmVec3 x) {
    double key[3] = {x.x + 0.0, x.y + 0.0, x.z + 0.0};  // -0 + 0 = 0
    uint64_t hash = om_hash(key, sizeof key, OM_HASH_SEED) & p->mask;
    for (int i = p->head[hash]; i >= 0; i = p->next[i])
        if (memcmp(cloud->x + 3 * (size_t)i, key, sizeof key) == 0) return i;
    int i = cloud->npoint++;
    memcpy(cloud->x + 3 * (size_t)i, key, sizeof key);
    p->next[i] = p->head[hash];
    p->head[hash] = i;
    return i;
}

// map[i]: point of vertex i of the file, -1 if it is not finite.
static void take_points(const OmFileMesh* m, double unit, Places* places, int* map,
                        OmPointCloud* cloud) {
    for (int i = 0; i < m->nvert; ++i) {
        OmVec3 x = om_scale(unit, om_load3(m->x, i));
        map[i] = -1;
        if (!om_is_finite3(x)) {
            ++cloud->ndropped;
            continue;
        }
        int before = cloud->npoint;
        map[i] = find_place(places, cloud, x);
        cloud->nduplicate += map[i] < before && !m->is_soup;
        if (!cloud->normal) continue;
        bool has_none = map[i] == before || om_norm2(om_load3(cloud->normal, map[i])) == 0;
        if (has_none) om_store3(cloud->normal, map[i], normal_of(m, i));
    }
}

static OmStatus take_triangles(const OmFileMesh* m, const int* map, OmPointCloud* cloud) {
    for (int t = 0; t < m->ntri; ++t) {
        int v[3];
        for (int k = 0; k < 3; ++k) {
            int i = m->tri[3 * (size_t)t + (size_t)k];
            OM_CHECK(i >= 0 && i < m->nvert, OM_INVALID,
                     "triangle %d names vertex %d, the file has %d", t + 1, i + 1, m->nvert);
            v[k] = map[i];
        }
        if (v[0] < 0 || v[1] < 0 || v[2] < 0) continue;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        memcpy(cloud->tri_vert + 3 * (size_t)cloud->ntri++, v, sizeof v);
    }
    return OM_OK;
}

static OmStatus finish(const OmFileMesh* m, double unit, OmPointCloud* cloud) {
    OmStatus status = OM_OK;
    Places places = {0};
    int* map = NULL;
    OM_CHECK(isfinite(unit) && unit > 0, OM_INVALID, "unit: %g m is no length", unit);
    OM_CHECK(m->nvert > 0, OM_INVALID, "the file has no points");
    OM_TRY(cloud_init(m->nvert, m->ntri, m->nnormal > 0, cloud));
    OM_TRY_DONE(places_init(&places, m->nvert));
    OM_ALLOC_DONE(map, m->nvert);
    take_points(m, unit, &places, map, cloud);
    OM_CHECK_DONE(cloud->npoint > 0, OM_INVALID, "none of its %d points is finite", m->nvert);
    status = take_triangles(m, map, cloud);
done:
    places_done(&places);
    om_free(map);
    if (status < 0) om_point_cloud_done(cloud);
    return status;
}

OmStatus om_point_cloud_load(const char* path, OmMeshFrame given, OmPointCloud* cloud,
                             OmMeshFrame* stated) {
    OmFileMesh m;
    memset(cloud, 0, sizeof *cloud);
    OmStatus status = om__parse_file(path, OM_FILE_CLOUD, &m);
    if (status == OM_OK) {
        OmMeshFrame frame = om__place_points(&m, given, stated);
        status = finish(&m, frame.unit, cloud);
        om__file_mesh_done(&m);
    }
    return status < 0 && status != OM_IO ? om_error_prefix(status, "%s", path) : status;
}

// ---- saving -----------------------------------------------------------------------------------------------------

// A copy of vectors in LPS; null for null.
static OmStatus turn(const double* x, int n, double** turned) {
    *turned = NULL;
    if (!x) return OM_OK;
    *turned = om__scaled_points(x, n, 1);
    if (!*turned) return OM_NO_MEMORY;
    om__turn_points(*turned, n);
    return OM_OK;
}

OmStatus om_point_cloud_save(const OmPointCloud* cloud, const char* path, OmMeshFrame frame) {
    typedef OmStatus WriteFn(const OmPointCloud*, OmMeshFrame, OmText*);
    static const struct {
        const char* ext;
        WriteFn* write;
    } table[] = {
        {"ply", om__write_cloud_ply}, {"vtp", om__write_cloud_vtp}, {"csv", om__write_cloud_csv}};
    char ext[16];
    WriteFn* write = NULL;
    om_path_extension(path, ext, sizeof ext);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; ++i)
        if (strcmp(ext, table[i].ext) == 0) write = table[i].write;
    OM_CHECK(write, OM_INVALID,
             "%s: \"%s\" is no format of a point cloud; .ply, .vtp and .csv are written", path,
             ext);
    OM_CHECK(isfinite(frame.unit) && frame.unit > 0, OM_INVALID, "%s: unit: %g m is no length",
             path, frame.unit);
    OmStatus status = OM_OK;
    OmText text = {0};
    OmPointCloud turned = *cloud;
    double *x = NULL, *normal = NULL;
    if (frame.space == OM_SPACE_LPS) {
        OM_TRY_DONE(turn(cloud->x, cloud->npoint, &x));
        OM_TRY_DONE(turn(cloud->normal, cloud->npoint, &normal));
        turned.x = x;
        turned.normal = normal;
    }
    OM_TRY_DONE(write(&turned, frame, &text));
    status = om_file_write(path, text.str, text.len);
done:
    om_free(x);
    om_free(normal);
    om_text_done(&text);
    return status;
}
