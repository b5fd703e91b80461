// match_track.c: material points that are followed from picture to picture.
//
// A pixel belongs to a window of a track if it shows tissue and its depth is near that of its neighbours: a window
// across an outline would follow the outline. A place (u, v) becomes a point of space by a plane through the depths of
// 3 x 3 pixels. Its covariance is J C J^T along this plane, for the covariance C of (u, v), which grows from picture
// to picture, and the noise of the depth along the ray; that of the material point is added along the surface.
#include "omentum/match_track.h"

#include <string.h>

#include "match/match_internal.h"
#include "omentum/shape_closest.h"

#define COOKIE 0x7ac4e701u
#define MAX_TRACK 10000
#define AROUND 9  // pixels for a place

struct OmMatchTracker {
    OmMatchTrackerDef def;
    const OmMatchView* view;
    OmSurfaceTree* tree;
    int n;
    double* at;           // px                                                  (max x 2)
    double* next;         // ... of new ones
    double* covariance;   // uu, uv, vv of `at`                                  (max x 3)
    OmTrack* found;       // scratch                                             (max)
    OmMatchTrack* track;  // (max)
    double* off;          // scratch                                             (max)
    double* xs;           // of the surface's vertices
    unsigned char* use;   // triangles that face the camera                      (ntri)
    OmTrackPicture picture, next_picture;  // the last one
    // Of the last picture.
    OmCamera camera;
    double noise;         // of a point of the scan, a mean over a few pixels more than a place
    float* depth;         // (pixels)
    unsigned char* mask;  // nonzero: tissue with a smooth depth               (pixels)
    int npixel;
    bool has_picture;
};

// ---- definition, create, destroy ------------------------------------------------------------------------------

OmMatchTrackerDef om_match_tracker_default_def(const OmMatch* match) {
    return (OmMatchTrackerDef){.match = match,
                               .track = om_track_default_def(),
                               .max = 400,
                               .max_jump = 2.5e-3,
                               .max_distance = 2e-3,
                               .anchor = 5e-4,
                               .max_off = 4e-3,
                               .cookie = COOKIE};
}

static bool is_above(double value, double least) { return value >= least && value <= 1e3; }

static OmStatus check_def(const OmMatchTrackerDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmMatchTrackerDef was not made by om_match_tracker_default_def");
    OM_CHECK(d->match, OM_INVALID, "OmMatchTrackerDef.match is null");
    OM_CHECK(d->max >= 1 && d->max <= MAX_TRACK, OM_INVALID, "OmMatchTrackerDef.max is %d; 1 to %d",
             d->max, MAX_TRACK);
    OM_CHECK(is_above(d->max_jump, 1e-9) && is_above(d->max_distance, 1e-9) &&
                 is_above(d->anchor, 0) && is_above(d->max_off, 1e-9),
             OM_INVALID,
             "OmMatchTrackerDef: max_jump %g, max_distance %g, anchor %g or max_off %g m is out of "
             "range",
             d->max_jump, d->max_distance, d->anchor, d->max_off);
    return om_track_check_def(&d->track);
}

static OmStatus make(OmMatchTracker* t) {
    size_t max = (size_t)t->def.max;
    const OmSurface* s = t->view->surface;
    OM_TRY(om_surface_tree_create(s, &t->tree));
    OM_ALLOC(t->at, 2 * max);
    OM_ALLOC(t->next, 2 * max);
    OM_ALLOC(t->covariance, 3 * max);
    OM_ALLOC(t->found, max);
    OM_ALLOC(t->track, max);
    OM_ALLOC(t->off, max);
    OM_ALLOC(t->xs, 3 * (size_t)s->nvert);
    OM_ALLOC(t->use, s->ntri);
    return OM_OK;
}

OmStatus om_match_tracker_create(const OmMatchTrackerDef* def, OmMatchTracker** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmMatchTracker* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->def = *def;
    t->view = om_match_view(def->match);
    OmStatus status = make(t);
    if (status < 0)
        om_match_tracker_destroy(t);
    else
        *out = t;
    return status;
}

void om_match_tracker_reset(OmMatchTracker* t) {
    om_track_picture_done(&t->picture);
    om_track_picture_done(&t->next_picture);
    t->n = 0;
    t->has_picture = false;
}

void om_match_tracker_destroy(OmMatchTracker* t) {
    if (!t) return;
    om_match_tracker_reset(t);
    om_surface_tree_destroy(t->tree);
    om_free(t->at);
    om_free(t->next);
    om_free(t->covariance);
    om_free(t->found);
    om_free(t->track);
    om_free(t->off);
    om_free(t->xs);
    om_free(t->use);
    om_free(t->depth);
    om_free(t->mask);
    om_free(t);
}

// ---- places in space ------------------------------------------------------------------------------------------

// Keep what a picture says of tissue and depth.
static OmStatus keep_depth(OmMatchTracker* t, const OmScan* scan) {
    const OmCamera* c = &scan->camera;
    int w = c->width, h = c->height;
    if (t->npixel != w * h) {
        om_free(t->depth);
        om_free(t->mask);
        t->depth = NULL, t->mask = NULL, t->npixel = 0;
        OM_ALLOC(t->depth, w * h);
        OM_ALLOC(t->mask, w * h);
        t->npixel = w * h;
    }
    t->camera = *c;
    t->noise = scan->noise;
    memcpy(t->depth, scan->depth, (size_t)(w * h) * sizeof *t->depth);
    for (int i = 0; i < w * h; ++i)
        t->mask[i] = scan->pixel[i] == OM_SCAN_TISSUE && scan->depth[i] > 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            int i = y * w + x;
            double z = (double)t->depth[i], max = t->def.max_jump;
            if (!t->mask[i]) continue;
            if (x + 1 < w && scan->depth[i + 1] > 0 && fabs((double)t->depth[i + 1] - z) > max)
                t->mask[i] = 0;
            if (y + 1 < h && scan->depth[i + w] > 0 && fabs((double)t->depth[i + w] - z) > max)
                t->mask[i] = 0;
        }
    return OM_OK;
}

static OmVec3 point_at(const OmCamera* c, double u, double v, double z) {
    OmVec3 ray = om_camera_ray(c, u, v),
           axis = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1));
    return om_madd(c->pose_world_camera.p, z / om_dot(ray, axis),
                   ray);  // a ray in the picture is before the camera
}

// The point of space of a place, and its covariance; false where the tissue's depth is not known all around.
static bool locate(const OmMatchTracker* t, double u, double v, const double cov[3], OmVec3* x,
                   OmMat3* covariance) {
    int w = t->camera.width, h = t->camera.height, column = (int)floor(u), row = (int)floor(v);
    if (column < 1 || row < 1 || column >= w - 1 || row >= h - 1) return false;
    double z[AROUND], mean = 0;
    for (int k = 0; k < AROUND; ++k) {
        int i = (row + k / 3 - 1) * w + column + k % 3 - 1;
        if (!t->mask[i]) return false;
        z[k] = (double)t->depth[i];
        mean += z[k] / AROUND;
    }
    double gu = (z[2] + z[5] + z[8] - z[0] - z[3] - z[6]) / 6;
    double gv = (z[6] + z[7] + z[8] - z[0] - z[1] - z[2]) / 6;
    double depth = mean + gu * (u - column - 0.5) + gv * (v - row - 0.5);
    *x = point_at(&t->camera, u, v, depth);
    OmVec3 du = om_sub(point_at(&t->camera, u + 1, v, depth + gu), *x);
    OmVec3 dv = om_sub(point_at(&t->camera, u, v + 1, depth + gv), *x);
    OmVec3 ray = om_camera_ray(&t->camera, u, v), n = om_normalize(om_cross(du, dv));
    OmMat3 C = om_mat3_add(om_mat3_scale(cov[0], om_mat3_outer(du, du)),
                           om_mat3_scale(cov[2], om_mat3_outer(dv, dv)));
    OmMat3 both = om_mat3_add(om_mat3_outer(du, dv), om_mat3_outer(dv, du));
    C = om_mat3_add(C, om_mat3_scale(cov[1], both));
    C = om_mat3_add(C, om_mat3_scale(2 * t->noise * t->noise, om_mat3_outer(ray, ray)));
    // The material point is uncertain along the surface, not across it.
    OmMat3 along = om_mat3_add(om_mat3_identity(), om_mat3_scale(-1, om_mat3_outer(n, n)));
    *covariance = om_mat3_add(C, om_mat3_scale(t->def.anchor * t->def.anchor, along));
    return om_is_finite3(*x) && isfinite(om_mat3_norm(*covariance));
}

// ---- follow ---------------------------------------------------------------------------------------------------

static void keep_track(OmMatchTracker* t, int from, int to) {
    memmove(t->at + 2 * to, t->at + 2 * from, 2 * sizeof *t->at);
    memmove(t->covariance + 3 * to, t->covariance + 3 * from, 3 * sizeof *t->covariance);
    t->track[to] = t->track[from];
}

OmStatus om_match_tracker_follow(OmMatchTracker* t, const OmScan* scan, const OmPicture* color,
                                 OmMatchTracks* tracks) {
    memset(tracks, 0, sizeof *tracks);
    OM_CHECK(scan->has_camera && scan->pixel && scan->depth, OM_INVALID,
             "match: tracks need a scan with camera, classes of pixels and depth");
    OM_CHECK(color->width == scan->camera.width && color->height == scan->camera.height, OM_INVALID,
             "match: a colour picture of %d x %d pixels for a camera of %d x %d", color->width,
             color->height, scan->camera.width, scan->camera.height);
    om_track_picture_done(&t->next_picture);
    OM_TRY(om_track_picture_init(&t->def.track, color, &t->next_picture));
    bool is_other = t->has_picture && t->npixel != color->width * color->height;
    if (is_other) om_match_tracker_reset(t);
    OM_TRY(keep_depth(t, scan));
    if (t->has_picture)
        OM_TRY(om_track_follow(&t->def.track, &t->picture, &t->next_picture, t->n, t->at, NULL,
                               t->found));
    int kept = 0;
    for (int i = 0; i < t->n; ++i) {
        const OmTrack* f = &t->found[i];
        if (f->is_lost) continue;
        double cov[3];
        for (int k = 0; k < 3; ++k) cov[k] = t->covariance[3 * i + k] + f->covariance[k];
        OmMatchTrack* m = &t->track[i];
        if (!locate(t, f->u, f->v, cov, &m->x, &m->covariance)) continue;
        t->at[2 * i] = f->u, t->at[2 * i + 1] = f->v;
        memcpy(t->covariance + 3 * (size_t)i, cov, sizeof cov);
        keep_track(t, i, kept++);
    }
    t->n = kept;
    om_track_picture_done(&t->picture);
    t->picture = t->next_picture;
    memset(&t->next_picture, 0, sizeof t->next_picture);
    t->has_picture = true;
    *tracks = (OmMatchTracks){t->n, t->track};
    return OM_OK;
}

// ---- adopt ----------------------------------------------------------------------------------------------------

static void place_surface(OmMatchTracker* t, const double* x) {
    const OmSurface* s = t->view->surface;
    for (int i = 0; i < s->nvert; ++i) om_store3(t->xs, i, om_load3(x, t->view->surface_vert[i]));
    om_surface_tree_move(t->tree, t->xs);
    OmVec3 eye = t->camera.pose_world_camera.p;
    for (int k = 0; k < s->ntri; ++k) {
        const int* v = s->tri_vert + 3 * (size_t)k;
        OmVec3 a = om_load3(t->xs, v[0]), b = om_load3(t->xs, v[1]), c = om_load3(t->xs, v[2]);
        t->use[k] = om_dot(om_cross(om_sub(b, a), om_sub(c, a)), om_sub(eye, a)) > 0;
    }
}

// Tracks whose material point is elsewhere end.
static void drop_far(OmMatchTracker* t) {
    for (int i = 0; i < t->n; ++i) {
        const OmMatchTrack* m = &t->track[i];
        const int* v = t->view->surface->tri_vert + 3 * (size_t)m->tri;
        OmVec3 q = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k) q = om_madd(q, m->bary[k], om_load3(t->xs, v[k]));
        t->off[i] = om_distance(m->x, q);
    }
    double* sorted = t->next;  // room for max x 2
    for (int i = 0; i < t->n; ++i) sorted[i] = t->off[i];
    om_sort_doubles(sorted, t->n);
    double limit = t->n > 0 ? fmax(t->def.max_off, 3 * sorted[t->n / 2]) : 0;
    int kept = 0;
    for (int i = 0; i < t->n; ++i)
        if (t->off[i] <= limit) keep_track(t, i, kept++);
    t->n = kept;
}

OmStatus om_match_tracker_adopt(OmMatchTracker* t, const OmMatchPairs* pairs) {
    OM_CHECK(t->has_picture, OM_INVALID, "match: no picture was followed");
    OM_CHECK(pairs->nvert == t->view->mesh->nvert, OM_INVALID,
             "match: pairs of a twin of %d vertices; the tracker's has %d", pairs->nvert,
             t->view->mesh->nvert);
    if (pairs->is_lost) return OM_OK;
    place_surface(t, pairs->x);
    drop_far(t);
    OmTrackWhere where = {.mask = t->mask, .nold = t->n, .old = t->at};
    int nnew = 0;
    OM_TRY(om_track_find_corners(&t->def.track, &t->picture, &where, t->def.max - t->n, t->next,
                                 &nnew));
    for (int i = 0; i < nnew; ++i) {
        static const double exact[3] = {0, 0, 0};
        OmMatchTrack* m = &t->track[t->n];
        OmSurfacePoint q;
        if (!locate(t, t->next[2 * i], t->next[2 * i + 1], exact, &m->x, &m->covariance)) continue;
        if (!om_surface_tree_find(t->tree, m->x, t->use, t->def.max_distance, &q)) continue;
        m->tri = q.tri;
        memcpy(m->bary, q.bary, sizeof q.bary);
        memcpy(t->at + 2 * (size_t)t->n, t->next + 2 * (size_t)i, 2 * sizeof *t->at);
        memset(t->covariance + 3 * (size_t)t->n, 0, 3 * sizeof *t->covariance);
        ++t->n;
    }
    return OM_OK;
}
