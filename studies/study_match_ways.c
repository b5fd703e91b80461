// study_match_ways.c: the ways that the study of correspondence compares, each from a scan to material points.
//
// The visible part of a twin: the triangles that face the camera and whose centre is not behind the depth picture of
// the twin, rendered by the camera of the scan.
//
// ZoomOut starts from the nearest vertex of the rest shape, as the thesis's matching in functional space does. Its
// answers are vertices of the twin. The basis of the twin is made once and not part of the times.
#include "studies/study_correspondence.h"

#include <math.h>
#include <string.h>

#include "omentum/shape_closest.h"

#define BEHIND 0.002  // m: a centre farther behind the rendered depth is hidden

const char* const om__study_way_name[OM_STUDY_NWAY] = {
    "rest",    "zoomout",     "zoomout_part", "twin_70",   "visible_70",
    "live_70", "visible_100", "live_100",     "tracks_70", "tracks_100"};
const char* const om__study_way_title[OM_STUDY_NWAY] = {
    "nearest, rest shape",   "ZoomOut",           "ZoomOut, partial",       "nearest, twin 70 %",
    "nearest visible, 70 %", "live, twin 70 %",   "nearest visible, 100 %", "live, twin 100 %",
    "live, tracks 70 %",     "live, tracks 100 %"};

// ---- nearest points ------------------------------------------------------------------------------------

static OmStatus find_visible(const OmSurface* s, const OmCamera* camera,
                             unsigned char* is_visible) {
    OmSenseScene* sense;
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    OmVec3 eye = camera->pose_world_camera.p;
    OmPose pose_camera_world = om_pose_inverse(camera->pose_world_camera);
    float* depth = NULL;
    int id;
    OM_TRY(om_sense_scene_create(&sense));
    OmStatus status;
    OM_ALLOC_DONE(depth, (size_t)camera->width * (size_t)camera->height);
    OM_TRY_DONE(om_sense_scene_add(sense, s, &look, &id));
    OM_TRY_DONE(om_sense_scene_commit(sense));
    OM_TRY_DONE(om_sense_depth(sense, camera, 1, depth, NULL, NULL));
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        OmVec3 centre = om_scale(1.0 / 3, om_add(a, om_add(b, c)));
        double u = 0, w = 0;
        bool is_facing = om_dot(om_cross(om_sub(b, a), om_sub(c, a)), om_sub(eye, centre)) > 0;
        bool is_in = is_facing && om_camera_project(camera, centre, &u, &w) && u >= 0 && w >= 0 &&
                     u < camera->width && w < camera->height;
        is_visible[t] = 0;
        if (!is_in) continue;
        double z = om_pose_apply(pose_camera_world, centre).z;
        double front = (double)depth[(size_t)w * (size_t)camera->width + (size_t)u];
        is_visible[t] = front <= 0 || z <= front + BEHIND;
    }
done:
    om_free(depth);
    om_sense_scene_destroy(sense);
    return status;
}

static OmStatus find_nearest(const WayInput* in, const double* x, bool is_visible_only,
                             WayAnswer* out) {
    OmSurface s = {0};
    OmSurfaceTree* tree = NULL;
    unsigned char* use = NULL;
    const OmSurface* rest = in->view->surface;
    OmStatus status;
    OM_TRY_DONE(om__hand_surface(rest, in->view->surface_vert, x, &s));
    if (is_visible_only) {
        OM_ALLOC_DONE(use, (size_t)s.ntri);
        OM_TRY_DONE(find_visible(&s, &in->scan->camera, use));
    }
    OM_TRY_DONE(om_surface_tree_create(&s, &tree));
    for (int i = 0; i < in->scan->npoint; ++i) {
        OmSurfacePoint q;
        out->has[i] = om_surface_tree_find(tree, om_load3(in->scan->x, i), use, INFINITY, &q);
        if (!out->has[i]) continue;
        OmVec3 p = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k)
            p = om_madd(p, q.bary[k], om_load3(rest->x, rest->tri_vert[3 * (size_t)q.tri + k]));
        om_store3(out->x_rest, i, p);
    }
done:
    om_surface_tree_destroy(tree);
    om_surface_done(&s);
    om_free(use);
    return status;
}

// ---- ZoomOut -------------------------------------------------------------------------------------------

// A shape that the method refuses is an answer, too: it has lost the tissue.
static OmStatus give_up(OmStatus status, WayAnswer* out) {
    if (status == OM_OK || (status < 0 && status != OM_INVALID)) return status;
    out->is_lost = true;
    snprintf(out->reason, sizeof out->reason, "%s",
             status < 0 ? om_error_message() : om_status_text(status));
    return OM_OK;
}

static OmStatus find_by_zoomout(const WayInput* in, bool is_partial, WayAnswer* out) {
    OmSpectralDef def = om_spectral_default_def();
    OmSpectralBasis basis = {0};
    const OmScan* scan = in->scan;
    const OmSurface* rest = in->view->surface;
    int* map = NULL;
    OmStatus status;
    def.is_partial = is_partial;
    def.nworker = 1;
    OM_ALLOC_DONE(map, (size_t)scan->npoint);
    OM_TRY_DONE(om_spectral_basis_init_scan(scan, def.last, &basis));
    OM_TRY_DONE(om_spectral_map_from_nearest(in->basis, rest->x, &basis, scan->x, map));
    OM_TRY_DONE(om_spectral_zoomout(&def, in->basis, &basis, map, NULL));
    for (int i = 0; i < scan->npoint; ++i) {
        out->has[i] = map[i] >= 0;
        if (map[i] >= 0) om_store3(out->x_rest, i, om_load3(rest->x, map[i]));
    }
done:
    om_spectral_basis_done(&basis);
    om_free(map);
    return give_up(status, out);
}

// ---- live ----------------------------------------------------------------------------------------------

// Pairs of a lost result are not used.
static OmStatus find_live(const WayInput* in, const double* x_twin, const OmMatchTracks* tracks,
                          WayAnswer* out) {
    OmMatchPairs pairs = {0};
    OmStatus status =
        om_match_find_pairs_with(in->live, in->scan, in->ngrasp, in->grasp, x_twin, tracks, &pairs);
    if (status == OM_OK) {
        out->is_lost = pairs.is_lost;
        snprintf(out->reason, sizeof out->reason, "%s", pairs.reason);
        for (int i = 0; i < in->scan->npoint && !pairs.is_lost; ++i) {
            out->has[i] = pairs.tri[i] >= 0;
            if (pairs.tri[i] >= 0) om_store3(out->x_rest, i, om_load3(pairs.x_rest, i));
        }
    }
    om_match_pairs_done(&pairs);
    return status;
}

OmStatus om__study_way_find(OmStudyWay way, const WayInput* in, WayAnswer* out) {
    out->is_lost = false;
    out->reason[0] = 0;
    memset(out->has, 0, (size_t)in->scan->npoint);
    switch (way) {
    case OM_STUDY_REST: return find_nearest(in, in->view->mesh->x, false, out);
    case OM_STUDY_ZOOMOUT: return find_by_zoomout(in, false, out);
    case OM_STUDY_ZOOMOUT_PART: return find_by_zoomout(in, true, out);
    case OM_STUDY_TWIN: return find_nearest(in, in->x_twin[0], false, out);
    case OM_STUDY_VISIBLE: return find_nearest(in, in->x_twin[0], true, out);
    case OM_STUDY_TWIN_END: return find_nearest(in, in->x_twin[1], true, out);
    case OM_STUDY_LIVE: return find_live(in, in->x_twin[0], NULL, out);
    case OM_STUDY_LIVE_END: return find_live(in, in->x_twin[1], NULL, out);
    case OM_STUDY_TRACKS: return find_live(in, in->x_twin[0], in->tracks[0], out);
    default: return find_live(in, in->x_twin[1], in->tracks[1], out);
    }
}
