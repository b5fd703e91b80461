// belief_rest.c: the twin at rest, before the operation.
//
// The patient's images show the tissue at rest where the model has it. A twin that slides off its board or organ while
// it settles therefore contradicts the images: it believes in too few attachments, whatever else it believes. Its
// attachments are extended over the underside, by rings of GROW_STEP around those it has, until it stays. A twin
// without any begins with the part of the underside from which the tissue slid away, its upper end: tissue that hangs
// on its upper end stays.
//
// The added attachments are a belief as any other: updates free them where the camera shows otherwise.
//
// Rejected (doc/notes/defras.md): one point of the upper end as the beginning: on a tilted board that is a corner, and
// 13 vertices around it left a sheet hanging by 41 mm.
#include "belief/belief_state.h"
#include "omentum/world.h"

#define MAX_SHIFT 0.010  // m, mean; a twin that moved further slid off
#define GROW_STEP 0.006  // m
#define MAX_GROW 8       // steps
#define BRIEF 0.5        // s, in which most of a slide shows

double om__rest_shift(const OmBody* body) {
    const OmTetMesh* mesh = &om_body_site(body)->mesh;
    double sum = 0;
    for (int v = 0; v < mesh->nvert; ++v)
        sum += om_distance(om_load3(om_body_x(body), v), om_load3(mesh->x, v));
    return sum / mesh->nvert;
}

static OmStatus settle(const OmScene* scene, OmBody* twin, double seconds) {
    return om_body_settle(twin, scene->task.time_step, OM_WORLD_SETTLE_SPEED, seconds);
}

// The vertices of the underside that lie most against the way that the tissue slid, to `vert`; returns how many.
static int find_upper_end(const OmBody* twin, const OmMeshSet* under, int* vert) {
    const OmTetMesh* mesh = &om_body_site(twin)->mesh;
    OmVec3 way = om_vec3(0, 0, 0);
    double least = INFINITY;
    int n = 0;
    for (int v = 0; v < mesh->nvert; ++v)
        way = om_add(way, om_sub(om_load3(om_body_x(twin), v), om_load3(mesh->x, v)));
    for (int k = 0; k < under->nvert; ++k)
        least = fmin(least, om_dot(om_load3(mesh->x, under->vert[k]), way));
    for (int k = 0; k < under->nvert; ++k)
        if (om_dot(om_load3(mesh->x, under->vert[k]), way) <= least + GROW_STEP * om_norm(way))
            vert[n++] = under->vert[k];
    return n;
}

static double distance_to(const OmTetMesh* mesh, const int* vert, int n, OmVec3 p) {
    double least = INFINITY;
    for (int i = 0; i < n; ++i) least = fmin(least, om_distance(om_load3(mesh->x, vert[i]), p));
    return least;
}

// Settle once more, with all of the underside attached that is nearer than `reach` to the n attached vertices.
static OmStatus settle_with(const OmScene* scene, OmBody* twin, const OmMeshSet* under, int* vert,
                            int n, double reach, int* nadded) {
    const OmTetMesh* mesh = &om_body_site(twin)->mesh;
    int nall = n;
    for (int k = 0; k < under->nvert; ++k) {
        const int v = under->vert[k];
        const double d = distance_to(mesh, vert, n, om_load3(mesh->x, v));
        if (d > 0 && d <= reach) vert[nall++] = v;
    }
    *nadded = nall - n;
    om_body_reset(twin);
    OM_TRY(om_body_set_attachment(twin, nall, vert, NULL, NULL));
    const OmStatus status = settle(scene, twin, BRIEF);
    if (status < 0 || om__rest_shift(twin) > MAX_SHIFT) return status;
    return settle(scene, twin, OM_WORLD_SETTLE_TIME - BRIEF);
}

OmStatus om__rest_settle(const OmScene* scene, OmBody* twin, int* nadded) {
    *nadded = 0;
    OmStatus status = settle(scene, twin, OM_WORLD_SETTLE_TIME);
    const OmTetMesh* mesh = &om_body_site(twin)->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    const double first = om__rest_shift(twin);
    om_log(OM_LOG_INFO, "twin at rest: moved by %.1f mm", 1e3 * first);
    const OmSite* site = om_body_site(twin);
    const bool has_ground = site->has_ground || site->has_organ;
    if (status < 0 || !under || !has_ground || first <= MAX_SHIFT) return status;
    int *vert, n = 0;
    OM_ALLOC(vert, (size_t)mesh->nvert + 1);
    const unsigned char* attached = om_body_attached(twin);
    for (int v = 0; v < mesh->nvert; ++v)
        if (attached[v]) vert[n++] = v;
    const bool is_free = n == 0;
    if (is_free) n = find_upper_end(twin, under, vert);
    for (int k = 1; n > 0 && k <= MAX_GROW && status >= 0; ++k) {
        status = settle_with(scene, twin, under, vert, n, k * GROW_STEP, nadded);
        if (is_free) *nadded += n;
        om_log(OM_LOG_INFO, "twin at rest with %d attachments more: moved by %.1f mm", *nadded,
               1e3 * om__rest_shift(twin));
        if (om__rest_shift(twin) <= MAX_SHIFT) break;
    }
    om_free(vert);
    return status;
}
