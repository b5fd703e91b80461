// belief_monitor.c: the discrepancy between the depth camera's tissue and the twin (thesis 6.4.5, Alg. 5).
//
// Measured points: pixels of the picture in a fixed order that fills it evenly (the additive recurrence R2 of M.
// Roberts, 2018), until npoint of them are tissue by colour and space. Simulated surface: rays of a pinhole at the
// camera's pose, in the rectangle of the twin, mark the triangles of the twin's surface that are visible behind organ
// and measured tools. The distance of a measured point is that to the closest point on a marked triangle
// (shape_closest.h), in doubles.
//
// Alg. 5 is read as follows: the median over measured points of the closest distance, in this direction only, since the
// measured cloud is partial; the rest is the mean over the frames before a grasp in which it changed by at most
// REST_CHANGE, and fixed while an arm holds tissue, for tissue that was let go may lie elsewhere than in the twin; what
// it has beyond the rest before the first grasp and the third limit counts; the state falls only below its limit less
// the hysteresis, which the thesis does not have.
//
// A part of the tissue (ours): the quantile 1 - part_share of the distances between picture and twin where one of them
// lies still, as in the last frame before the grasp. Right attachments decide where tissue lies still; stiffness,
// Poisson's ratio and friction change the shape of the lifted tissue, which does not count.
//
// Rejected: closest of simulated points, as the thesis has it. Between points 2 mm apart the distance of equal surfaces
// is not 0 but about 1 mm, and it changes when the tissue is lifted and its points move apart. Rejected: the whole
// boundary of the twin: a sheet measured 5 mm too low would lie on the twin's underside, at distance 0.
#include <string.h>

#include "omentum/belief_monitor.h"
#include "omentum/shape_closest.h"

#define COOKIE 0x30a17e4u
#define MAX_TRIES 32  // pixels looked at for each point wanted: tissue may fill 3 % of the picture
#define R2_U 0.7548776662466927  // 1 / p and 1 / p^2 of the root p of p^3 = p + 1
#define R2_V 0.5698402909980532
#define MIN_ANGLE 1e-4      // tangent, half the smallest field of the simulated camera
#define REST_CHANGE 0.0005  // m
#define STILL 0.0025        // m, from the place before the grasp, of a point that lies still
#define TICK_SLACK 1e-6     // frame periods; rounding of a clock that sums its steps

struct OmMonitor {
    OmMonitorDef def;
    OmPsm psm[OM_MAX_ARM];  // of def.space
    // the twin, its organ and the measured tools, as the simulated camera sees them
    OmSenseScene* sense;
    OmSurface tissue;  // boundary of the twin's mesh
    int* tissue_vert;  // its vertices in the mesh
    OmSurfaceTree* tree;
    // the twin in the last good frame before the grasp
    OmSurfaceTree* rest_tree;
    double* rest_x;  // (tissue.nvert x 3)
    OmSurface tool[OM_MAX_ARM];
    int tissue_id, tool_id[OM_MAX_ARM];  // -1: not known
    // of one frame
    float* ray_depth;           // (nray)
    int *ray_id, *ray_tri;      // (nray)
    unsigned char* is_visible;  // (tissue.ntri)
    double* x;                  // measured points, m (npoint x 3)
    double* distance;           // (npoint)
    double* apart;              // distances of points where picture or twin lies still (npoint)
    // between frames
    bool has_begun, has_grasped, was_holding;  // was_holding: since the last frame of the rest
    double first_rest;                         // m, before the first grasp
    double period;                             // of the last frame, counted from time 0
    double good_time;  // s, of the last frame that was neither stale nor blind, or of the first
    double rest_sum;
    OmMonitorFrame last;
};

// ---- creation --------------------------------------------------------------------------------------------------

OmMonitorDef om_monitor_default_def(const OmScene* scene, const OmWorld* world,
                                    const OmSite* site) {
    return (OmMonitorDef){.cookie = COOKIE,
                          .settings = scene->monitor,
                          .space = om_cloud_default_def(world, site),
                          .use_color = true,
                          .tissue = om_sense_range(OM_PART_TISSUE),
                          .nray = 4096,
                          .max_age = 0.2};
}

static OmStatus check_def(const OmMonitorDef* d) {
    const OmSceneMonitor* s = &d->settings;
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "OmMonitorDef was not made by default_def");
    OM_CHECK(d->space.site, OM_INVALID, "OmMonitorDef.space has no site");
    OM_CHECK(s->limit[0] > 0 && s->limit[0] < s->limit[1] && s->limit[1] < s->limit[2] &&
                 isfinite(s->limit[2]),
             OM_INVALID, "OmSceneMonitor.limit is %g, %g, %g m; above 0, ascending", s->limit[0],
             s->limit[1], s->limit[2]);
    OM_CHECK(s->hysteresis >= 0 && s->hysteresis < s->limit[0], OM_INVALID,
             "OmSceneMonitor.hysteresis is %g m; 0 to below %g", s->hysteresis, s->limit[0]);
    OM_CHECK(s->rate > 0 && isfinite(s->rate), OM_INVALID, "OmSceneMonitor.rate is %g; above 0",
             s->rate);
    OM_CHECK(s->npoint >= OM_MONITOR_MIN_POINT && s->npoint <= 1000000, OM_INVALID,
             "OmSceneMonitor.npoint is %d; %d to 1,000,000", s->npoint, OM_MONITOR_MIN_POINT);
    OM_CHECK(s->part_limit[0] >= 0 && s->part_limit[0] <= s->part_limit[1] &&
                 isfinite(s->part_limit[1]) &&
                 (s->part_limit[0] < s->part_limit[1] || s->part_limit[1] == 0),
             OM_INVALID, "OmSceneMonitor.part_limit is %g, %g m; ascending, or both 0",
             s->part_limit[0], s->part_limit[1]);
    OM_CHECK(s->part_share > 0 && s->part_share < 1, OM_INVALID,
             "OmSceneMonitor.part_share is %g; above 0 and below 1", s->part_share);
    OM_CHECK(d->nray >= 256 && d->nray <= 1 << 20, OM_INVALID, "OmMonitorDef.nray is %d; 256 to %d",
             d->nray, 1 << 20);
    OM_CHECK(d->max_age > 0, OM_INVALID, "OmMonitorDef.max_age is %g s; above 0", d->max_age);
    return OM_OK;
}

static OmStatus add_tools(OmMonitor* m) {
    OmSenseLook look = om_sense_look(OM_PART_TOOL);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        m->tool_id[a] = -1;
        const OmPsm* psm = m->def.space.psm[a];
        if (!psm) continue;
        const double q[OM_PSM_NJOINT] = {0};
        OM_TRY(om_psm_surface(psm, q, 0, &m->tool[a]));
        OM_TRY(om_sense_scene_add(m->sense, &m->tool[a], &look, &m->tool_id[a]));
    }
    return OM_OK;
}

static void keep_rest(OmMonitor* m) {
    memcpy(m->rest_x, m->tissue.x, 3 * (size_t)m->tissue.nvert * sizeof *m->rest_x);
    om_surface_tree_move(m->rest_tree, m->rest_x);
}

static OmStatus build_scene(OmMonitor* m) {
    const OmSite* site = m->def.space.site;
    OM_TRY(om_sense_scene_create(&m->sense));
    OM_TRY(
        om_tet_mesh_boundary(m->def.mesh ? m->def.mesh : &site->mesh, &m->tissue, &m->tissue_vert));
    OM_TRY(om_surface_tree_create(&m->tissue, &m->tree));
    OM_TRY(om_surface_tree_create(&m->tissue, &m->rest_tree));
    OM_ALLOC(m->rest_x, 3 * (size_t)m->tissue.nvert);
    keep_rest(m);
    OmSenseLook look = {.red = 1};
    OM_TRY(om_sense_scene_add(m->sense, &m->tissue, &look, &m->tissue_id));
    int id;
    if (site->has_organ) OM_TRY(om_sense_scene_add(m->sense, &site->organ, &look, &id));
    return add_tools(m);
}

OmStatus om_monitor_create(const OmMonitorDef* def, OmMonitor** monitor) {
    *monitor = NULL;
    OM_TRY(check_def(def));
    OmMonitor* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    m->def = *def;
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        if (!def->space.psm[a]) continue;
        m->psm[a] = *def->space.psm[a];
        m->def.space.psm[a] = &m->psm[a];
    }
    OmStatus status = OM_OK;
    size_t nray = (size_t)def->nray, npoint = (size_t)def->settings.npoint;
    OM_TRY_DONE(build_scene(m));
    OM_ALLOC_DONE(m->ray_depth, nray);
    OM_ALLOC_DONE(m->ray_id, nray);
    OM_ALLOC_DONE(m->ray_tri, nray);
    OM_ALLOC_DONE(m->is_visible, (size_t)m->tissue.ntri);
    OM_ALLOC_DONE(m->x, 3 * npoint);
    OM_ALLOC_DONE(m->distance, npoint);
    OM_ALLOC_DONE(m->apart, npoint);
    *monitor = m;
    m = NULL;
done:
    om_monitor_destroy(m);
    return status;
}

void om_monitor_destroy(OmMonitor* m) {
    if (!m) return;
    om_sense_scene_destroy(m->sense);
    om_surface_tree_destroy(m->tree);
    om_surface_tree_destroy(m->rest_tree);
    om_free(m->rest_x);
    om_surface_done(&m->tissue);
    om_free(m->tissue_vert);
    for (int a = 0; a < OM_MAX_ARM; ++a) om_surface_done(&m->tool[a]);
    om_free(m->ray_depth);
    om_free(m->ray_id);
    om_free(m->ray_tri);
    om_free(m->is_visible);
    om_free(m->x);
    om_free(m->distance);
    om_free(m->apart);
    om_free(m);
}

const OmSceneMonitor* om_monitor_settings(const OmMonitor* m) { return &m->def.settings; }

void om_monitor_reset(OmMonitor* m) {
    m->has_begun = m->has_grasped = m->was_holding = false;
    m->rest_sum = m->first_rest = 0;
    m->last = (OmMonitorFrame){0};
}

// ---- time and states --------------------------------------------------------------------------------------------

static double period_at(const OmMonitor* m, double time) {
    return floor(time * m->def.settings.rate + TICK_SLACK);
}

bool om_monitor_is_due(const OmMonitor* m, double time) {
    return !m->has_begun || period_at(m, time) != m->period;
}

unsigned om_monitor_sources(const OmMonitor* m, const OmWorld* world) {
    unsigned color = m->def.use_color ? OM_OBSERVE_COLOR : 0;
    return (OM_OBSERVE_DEPTH | color) & om_world_sources(world);
}

int om_monitor_next_state(const OmSceneMonitor* settings, int state, double mu) {
    int reached = 0;
    while (reached < 3 && mu > settings->limit[reached]) ++reached;
    while (state > reached && mu <= settings->limit[state - 1] - settings->hysteresis) --state;
    return state > reached ? state : reached;
}

int om_monitor_next_part_state(const OmSceneMonitor* settings, int state, double part) {
    if (settings->part_limit[1] == 0) return 0;
    const OmSceneMonitor limits = {
        .limit = {settings->part_limit[0], settings->part_limit[1], HUGE_VAL},
        .hysteresis = settings->hysteresis};
    return om_monitor_next_state(&limits, state, part);
}

// ---- measured points --------------------------------------------------------------------------------------------

static bool is_tissue(const OmMonitor* m, const OmScanField* field, const OmDepthPicture* d,
                      int pixel, OmVec3 p) {
    OmScanPlace place = om_scan_field_eval(field, p);
    if (!m->def.use_color || !d->color.pixel) return place == OM_PLACE_FREE;
    if (place == OM_PLACE_TOOL || place == OM_PLACE_FAR) return false;
    double hsv[3];
    om_sense_hsv(&d->color.pixel[(size_t)d->color.nchannel * (size_t)pixel], hsv);
    return om_sense_range_has(&m->def.tissue, hsv);
}

// Points on the tissue, to m->x; returns how many.
static int measure(OmMonitor* m, const OmScanField* field, const OmDepthPicture* d) {
    const OmCamera* c = &d->camera;
    OmVec3 eye = c->pose_world_camera.p;
    OmVec3 axis = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1));
    int wanted = m->def.settings.npoint, n = 0;
    int64_t npixel = (int64_t)c->width * c->height;
    int64_t most = npixel < (int64_t)MAX_TRIES * wanted ? npixel : (int64_t)MAX_TRIES * wanted;
    for (int64_t k = 0; k < most && n < wanted; ++k) {
        double u = 0.5 + (double)k * R2_U, v = 0.5 + (double)k * R2_V;
        int column = (int)((u - floor(u)) * c->width), row = (int)((v - floor(v)) * c->height);
        int pixel = column + c->width * row;
        double z = (double)d->depth[pixel];
        if (!(z > 0) || !isfinite(z)) continue;
        OmVec3 ray = om_camera_ray(c, column + 0.5, row + 0.5);
        double along = om_dot(ray, axis);  // > 0 for a ray of the picture
        if (!(along > 0)) continue;
        OmVec3 p = om_madd(eye, z / along, ray);
        if (is_tissue(m, field, d, pixel, p)) om_store3(m->x, n++, p);
    }
    return n;
}

// ---- the twin as the camera sees it -------------------------------------------------------------------------------

// Tools at their measured tips: joints are exact, the position of the arm's base is not.
static void place_tools(OmMonitor* m, const OmObservation* obs) {
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        if (m->tool_id[a] < 0) continue;
        om_sense_scene_show(m->sense, m->tool_id[a], a < obs->narm);
        if (a >= obs->narm) continue;
        OmPsm psm = *m->def.space.psm[a];
        const OmArmObservation* arm = &obs->arm[a];
        OmVec3 off = om_sub(arm->tip.p, om_psm_forward(&psm, arm->q).p);
        psm.pose_world_rcm.p = om_add(psm.pose_world_rcm.p, off);
        om_psm_surface_update(&psm, arm->q, arm->jaw, &m->tool[a]);
        om_sense_scene_update(m->sense, m->tool_id[a], m->tool[a].x, NULL);
    }
}

// A pinhole at the pose of `c` whose picture is the rectangle around the tissue within the picture of `c`, with at most
// nray pixels; false if this rectangle is empty. Its lens has no distortion.
static bool aim(const OmMonitor* m, const OmCamera* c, OmCamera* simulated) {
    OmPose pose_camera_world = om_pose_inverse(c->pose_world_camera);
    OmLens lens = om_camera_lens(c);
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < m->tissue.nvert; ++i) {
        OmVec3 p = om_pose_apply(pose_camera_world, om_load3(m->tissue.x, i));
        if (p.z < c->near_m) continue;
        lo[0] = fmin(lo[0], p.x / p.z), hi[0] = fmax(hi[0], p.x / p.z);
        lo[1] = fmin(lo[1], p.y / p.z), hi[1] = fmax(hi[1], p.y / p.z);
    }
    lo[0] = fmax(lo[0], -lens.cx / lens.fx), hi[0] = fmin(hi[0], (c->width - lens.cx) / lens.fx);
    lo[1] = fmax(lo[1], -lens.cy / lens.fy), hi[1] = fmin(hi[1], (c->height - lens.cy) / lens.fy);
    if (!(hi[0] > lo[0]) || !(hi[1] > lo[1])) return false;
    for (int k = 0; k < 2; ++k)  // the principal point lies in the picture, and not on its border
        lo[k] = fmin(lo[k], -MIN_ANGLE), hi[k] = fmax(hi[k], MIN_ANGLE);
    double w = hi[0] - lo[0], h = hi[1] - lo[1];
    int columns = (int)fmax(1, fmin(floor(sqrt(m->def.nray * w / h)), m->def.nray / 4));
    int rows = (int)fmax(1, floor((double)m->def.nray / columns));
    *simulated = *c;
    simulated->width = columns;
    simulated->height = rows;
    double fx = columns / w, fy = rows / h;
    simulated->lens = (OmLens){.fx = fx, .fy = fy, .cx = -lo[0] * fx, .cy = -lo[1] * fy};
    return true;
}

// Mark the triangles of the twin that the camera sees; *nvisible says how many.
static OmStatus look(OmMonitor* m, const OmObservation* obs, const double* x_twin, int* nvisible) {
    *nvisible = 0;
    for (int i = 0; i < m->tissue.nvert; ++i)
        om_store3(m->tissue.x, i, om_load3(x_twin, m->tissue_vert[i]));
    om_surface_tree_move(m->tree, m->tissue.x);
    om_sense_scene_update(m->sense, m->tissue_id, m->tissue.x, NULL);
    place_tools(m, obs);
    OM_TRY(om_sense_scene_commit(m->sense));
    OmCamera camera;
    if (!aim(m, &obs->rgbd.camera, &camera)) return OM_OK;
    OM_TRY(om_sense_triangles(m->sense, &camera, 1, m->ray_depth, m->ray_id, m->ray_tri));
    memset(m->is_visible, 0, (size_t)m->tissue.ntri);
    for (int i = 0; i < camera.width * camera.height; ++i) {
        if (m->ray_id[i] != m->tissue_id) continue;
        *nvisible += !m->is_visible[m->ray_tri[i]];
        m->is_visible[m->ray_tri[i]] = 1;
    }
    return OM_OK;
}

// Where a point of the twin's surface is in the positions x.
static OmVec3 place_in(const OmMonitor* m, const OmSurfacePoint* q, const double* x) {
    const int* v = &m->tissue.tri_vert[3 * q->tri];
    OmVec3 p = om_vec3(0, 0, 0);
    for (int k = 0; k < 3; ++k) p = om_madd(p, q->bary[k], om_load3(x, v[k]));
    return p;
}

// How far picture and twin are apart where one of them lies still, otherwise 0: the lift of the twin's material above
// the measured point p where p lies still, or the distance of a moved p from its closest point q of the twin if q
// lies still.
static double find_apart(const OmMonitor* m, OmVec3 p, const OmSurfacePoint* q) {
    OmSurfacePoint still;
    if (!om_surface_tree_find(m->rest_tree, p, NULL, STILL, &still))
        return om_distance(place_in(m, q, m->rest_x), q->x) < STILL ? q->distance : 0;
    const int* v = &m->tissue.tri_vert[3 * still.tri];
    OmVec3 a = om_load3(m->rest_x, v[0]);
    OmVec3 ab = om_sub(om_load3(m->rest_x, v[1]), a), ac = om_sub(om_load3(m->rest_x, v[2]), a);
    OmVec3 lift = om_sub(place_in(m, &still, m->tissue.x), p);
    return fmax(0, om_dot(lift, om_normalize(om_cross(ab, ac))));
}

// The distances of all points, sorted. *part: see OmMonitorFrame.
static void find_distances(OmMonitor* m, int npoint, double* part) {
    for (int i = 0; i < npoint; ++i) {
        OmSurfacePoint q = {0};
        OmVec3 p = om_load3(m->x, i);
        om_surface_tree_find(m->tree, p, m->is_visible, INFINITY, &q);
        m->apart[i] = find_apart(m, p, &q);
        m->distance[i] = q.distance;
    }
    om_sort_doubles(m->apart, npoint);
    *part = om_quantile(m->apart, npoint, 1 - m->def.settings.part_share);
    om_sort_doubles(m->distance, npoint);
}

// ---- a frame ----------------------------------------------------------------------------------------------------

static OmStatus check_input(const OmMonitor* m, const OmObservation* obs, const double* x_twin) {
    const OmDepthPicture* d = &obs->rgbd;
    OM_CHECK(d->depth, OM_INVALID, "the observation has no depth picture");
    OM_TRY(om_camera_check(&d->camera));
    OM_CHECK(!d->color.pixel || (d->color.width == d->camera.width &&
                                 d->color.height == d->camera.height && d->color.nchannel >= 3),
             OM_INVALID,
             "the colour picture is %d x %d with %d channels, the depth picture %d x %d",
             d->color.width, d->color.height, d->color.nchannel, d->camera.width, d->camera.height);
    OM_CHECK(isfinite(obs->time) && isfinite(d->time), OM_INVALID,
             "the observation has no finite time");
    OM_CHECK(obs->narm >= 0 && obs->narm <= OM_MAX_ARM, OM_INVALID, "the observation has %d arms",
             obs->narm);
    for (int i = 0; i < m->tissue.nvert; ++i)
        OM_CHECK(isfinite(om_norm2(om_load3(x_twin, m->tissue_vert[i]))), OM_INVALID,
                 "vertex %d of the twin is not finite", m->tissue_vert[i]);
    return OM_OK;
}

static bool are_tools_measured(const OmObservation* obs) {
    double sum = 0;
    for (int a = 0; a < obs->narm; ++a) {
        sum += om_norm2(obs->arm[a].tip.p) + obs->arm[a].jaw;
        for (int j = 0; j < OM_PSM_NJOINT; ++j) sum += obs->arm[a].q[j];
    }
    return isfinite(sum);
}

// Measured points and visible triangles; none of either while a tool's pose is not a number.
static OmStatus compare(OmMonitor* m, const OmObservation* obs, const double* x_twin, int* npoint,
                        int* nvisible) {
    *npoint = *nvisible = 0;
    if (!are_tools_measured(obs)) return OM_OK;
    OmScanField field;
    OM_TRY(om_cloud_field_init(&m->def.space, obs, &field));
    *npoint = measure(m, &field, &obs->rgbd);
    return look(m, obs, x_twin, nvisible);
}

// Alg. 5, lines 5 to 17.
static void judge(OmMonitor* m, bool is_holding, OmMonitorFrame* f) {
    const OmSceneMonitor* settings = &m->def.settings;
    find_distances(m, f->npoint, &f->part);
    f->distance = om_quantile(m->distance, f->npoint, 0.5);
    if (!is_holding) {
        const bool has_changed = f->nrest > 0 && fabs(f->distance - f->rest) > REST_CHANGE;
        if (m->was_holding || has_changed) m->rest_sum = f->nrest = 0;
        m->rest_sum += f->distance;
        f->rest = m->rest_sum / ++f->nrest;
        if (!m->has_grasped) m->first_rest = f->rest;
        keep_rest(m);
        m->was_holding = false;
    }
    f->mu = f->distance - fmin(f->rest, m->first_rest + settings->limit[2]);
    f->state = is_holding ? om_monitor_next_state(settings, f->state, f->mu) : 0;
}

OmStatus om_monitor_frame(OmMonitor* m, const OmObservation* obs, const double* x_twin,
                          bool is_holding, OmMonitorFrame* frame) {
    *frame = (OmMonitorFrame){0};
    OM_TRY(check_input(m, obs, x_twin));
    int npoint, nvisible;
    OM_TRY(compare(m, obs, x_twin, &npoint, &nvisible));
    OmMonitorFrame f = m->last;
    bool is_first = !m->has_begun;
    m->has_begun = true;
    m->period = period_at(m, obs->time);
    f.time = obs->time;
    f.age = fmax(0, obs->time - obs->rgbd.time);
    f.npoint = npoint;
    f.is_stale = f.age > m->def.max_age;
    f.is_blind = npoint < OM_MONITOR_MIN_POINT || nvisible == 0;
    f.nstale += f.is_stale;
    f.nblind += f.is_blind;
    bool is_good = !f.is_stale && !f.is_blind;
    if (is_good || is_first) m->good_time = obs->time;
    f.unseen = fmax(0, obs->time - m->good_time);
    m->was_holding |= is_holding;
    m->has_grasped |= is_holding;
    if (!is_holding) f.state = 0;
    if (is_good) judge(m, is_holding, &f);
    m->last = *frame = f;
    return OM_OK;
}
