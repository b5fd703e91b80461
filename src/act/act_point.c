// act_point.c: the grasping points from what the depth camera sees, S_B = discretize(PC_t) of Alg. 4.
//
// Before each plan, and before each reach, the depth camera's pixels are classified (scan_picture.h): tissue,
// tool, anything else. A block's grasping point is then, in this order:
// 1. agreed: the twin's point, since tissue was measured within OM_CLOUD_AGREE of it, or one and a half pixels;
// 2. filled: the twin's point, where a tool or an organ hides it from the camera, or the picture ends;
// 3. measured: the tissue nearest to the twin's point, seen from above, within the block: the picture corrects the
//    twin;
// 4. none: the camera sees what lies behind the twin's point, and no tissue in the block: not reachable.
//
// In 2 to 4 a point of the twin that has left its block counts as where the patient model has it. A world without a
// depth camera has the twin's points alone. An arm on its way does not stop: a jaw that closed on nothing opens, and a
// new look follows. The block is tried again if the look shows its tissue elsewhere, OM_ACT_MAX_EMPTY times in all.
//
// The twin's grasp (om__cloud_grasp_twin): free tissue of the twin within the grasp radius of the measured tip is
// grasped there, and an error of registration remains an offset. Else the block's vertex, if the patient model has it
// near the tip; else the vertex nearest to the tip. The twin's tissue is then drawn to the tip at DRAW_SPEED.
//
// Rejected (doc/notes/defras.md): the measured point in case 1, too (noise of 0.2 mm; three tests of force stops had
// none); the live correspondence (match_live.h) for the material point (a twin that slid off is reported as lost).
#include <string.h>

#include "act/act_state.h"

#define MIN_PIXEL 4  // of tissue near a grasping point: fewer are noise
#define PATCH_RADIUS \
    0.002  // m, around the nearest pixel, of which the mean is taken; two pixels or more
#define DRAW_SPEED 0.02  // m/s
#define TWIN_REACH 0.04  // m, from the tip to the twin's tissue at most

// ---- the picture ----------------------------------------------------------------------------------------------

typedef struct Cloud {
    OmObservation obs;
    OmScan scan;   // its classes of pixels are used
    double pitch;  // m, of the pixels at the middle of the tissue
    int n;
    double* x;  // pixels of tissue, task frame, m  (n x 3)
} Cloud;

static void cloud_done(Cloud* c) {
    om_scan_done(&c->scan);
    om_observation_done(&c->obs);
    om_free(c->x);
}

static OmStatus take_cloud(const Act* act, Cloud* c) {
    const unsigned color = om_world_sources(act->world) & OM_OBSERVE_COLOR;
    OM_TRY(om_world_observe(act->world, OM_OBSERVE_DEPTH | color, &c->obs));
    OM_TRY(om_scan_from_observation(&act->scan, &act->space, &c->obs, &c->scan));
    const OmCamera* camera = &c->scan.camera;
    const OmVec3 eye = camera->pose_world_camera.p;
    const OmVec3 axis = om_quat_rotate(camera->pose_world_camera.q, om_vec3(0, 0, 1));
    const OmPose to_task = om_pose_inverse(act->grid->task);
    const int npixel = camera->width * camera->height;
    c->pitch = om_distance(eye, act->grid->task.p) / om_camera_lens(camera).fy;
    OM_ALLOC(c->x, 3 * (size_t)npixel);
    for (int i = 0; i < npixel; ++i) {
        if (c->scan.pixel[i] != OM_SCAN_TISSUE) continue;
        const double z = (double)c->obs.rgbd.depth[i];
        const OmVec3 ray = om_camera_ray(camera, i % camera->width + 0.5, i / camera->width + 0.5);
        const double along = om_dot(ray, axis);
        if (!(z > 0) || !isfinite(z) || !(along > 0)) continue;
        om_store3(c->x, c->n++, om_pose_apply(to_task, om_madd(eye, z / along, ray)));
    }
    return OM_OK;
}

// What the camera sees where a point of the task frame is.
typedef enum Sight {
    SIGHT_HIDDEN,   // a tool, an organ or the end of the picture hides it
    SIGHT_THROUGH,  // what lies behind, or tissue before it
} Sight;

static Sight look_at(const Act* act, const Cloud* c, OmVec3 p_task) {
    const OmCamera* camera = &c->scan.camera;
    const OmVec3 p = om_pose_apply(act->grid->task, p_task);
    double u, v;
    if (!om_camera_project(camera, p, &u, &v)) return SIGHT_HIDDEN;
    if (!(u >= 0 && v >= 0 && u < camera->width && v < camera->height)) return SIGHT_HIDDEN;
    const int i = (int)u + camera->width * (int)v;
    const int class = c->scan.pixel[i];
    if (class == OM_SCAN_TISSUE) return SIGHT_THROUGH;
    if (class == OM_SCAN_TOOL || class == OM_SCAN_UNKNOWN) return SIGHT_HIDDEN;
    const double z = (double)c->obs.rgbd.depth[i];
    const double at = om_pose_apply(om_pose_inverse(camera->pose_world_camera), p).z;
    return z > 0 && z < at - OM_CLOUD_AGREE ? SIGHT_HIDDEN : SIGHT_THROUGH;
}

// ---- the points of the blocks ---------------------------------------------------------------------------------

// Mean of the tissue around a pixel; false if it is too little.
static bool mean_around(const Cloud* c, OmVec3 q, OmVec3* mean) {
    const double radius = fmax(PATCH_RADIUS, 2 * c->pitch);
    OmVec3 sum = om_vec3(0, 0, 0);
    int n = 0;
    for (int i = 0; i < c->n; ++i) {
        const OmVec3 p = om_load3(c->x, i);
        if (om_norm2(om_sub(p, q)) > radius * radius) continue;
        sum = om_add(sum, p);
        ++n;
    }
    if (n >= MIN_PIXEL) *mean = om_scale(1.0 / n, sum);
    return n >= MIN_PIXEL;
}

// The measured point nearest to p in space; index or -1.
static int nearest_in_space(const Cloud* c, OmVec3 p, double limit) {
    int best = -1;
    double least = limit * limit;
    for (int i = 0; i < c->n; ++i) {
        const double d = om_norm2(om_sub(om_load3(c->x, i), p));
        if (d <= least) least = d, best = i;
    }
    return best;
}

// The measured point of a block that is nearest to p seen from above; index or -1.
static int nearest_in_block(const Grid* g, const Cloud* c, int block, OmVec3 p) {
    int best = -1;
    double least = INFINITY;
    for (int i = 0; i < c->n; ++i) {
        const OmVec3 q = om_load3(c->x, i);
        const double d = (q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y);
        if (d < least && om__grid_has(g, block, q)) least = d, best = i;
    }
    return best;
}

static GraspPoint find_point(const Act* act, const Cloud* c, int block) {
    const Grid* g = act->grid;
    GraspPoint point = {.source = GRASP_NONE};
    if (g->vert[block] < 0) return point;
    const OmVec3 twin = om__to_task(g, om__grid_point(g, om_body_x(act->twin), block));
    point.tip = twin;
    point.source = GRASP_FILLED;
    if (!c) return point;
    const OmVec3 middle = om__grid_has(g, block, twin) ? twin : g->tip[block];
    const int same = nearest_in_space(c, twin, fmax(OM_CLOUD_AGREE, 1.5 * c->pitch));
    OmVec3 mean;
    if (same >= 0 && mean_around(c, om_load3(c->x, same), &mean)) {
        point.source = GRASP_AGREED;
        point.off = om_distance(mean, twin);
        return point;
    }
    if (look_at(act, c, middle) == SIGHT_THROUGH) {
        const int other = nearest_in_block(g, c, block, middle);
        const bool is_there = other >= 0 && mean_around(c, om_load3(c->x, other), &point.tip);
        point.source = is_there ? GRASP_MEASURED : GRASP_NONE;
    }
    point.off = om_distance(point.tip, twin);
    return point;
}

OmStatus om__cloud_look(Act* act, int block) {
    Cloud c = {.n = 0};
    if (block >= 0 && act->point_tick == act->tick) return OM_OK;
    if (block < 0) act->point_tick = act->tick;
    const int n = act->grid->n * act->grid->n;
    const bool has_cloud = act->has_cloud;
    OmStatus status = has_cloud ? take_cloud(act, &c) : OM_OK;
    for (int b = 0; status >= 0 && b < n; ++b) {
        if (block >= 0 && b != block) continue;
        const GraspPoint p = find_point(act, has_cloud ? &c : NULL, b);
        if (block < 0 || p.source != GRASP_NONE) act->point[b] = p;
    }
    if (status >= 0 && has_cloud && act->host.on_scan) act->host.on_scan(act->host.ctx, &c.scan);
    cloud_done(&c);
    return status < 0 ? om_error_prefix(status, "grasping points at %.2f s", act->time) : OM_OK;
}

// ---- the grasp of the twin ------------------------------------------------------------------------------------

// The twin's vertex that a tip at `tip` holds, -1: none. `block` is where the arm was sent.
static int find_material(const Act* act, OmVec3 tip, int block) {
    const OmBody* twin = act->twin;
    const OmTetMesh* mesh = &om_body_site(twin)->mesh;
    const unsigned char* attached = om_body_attached(twin);
    const signed char* held = om_body_held_by(twin);
    const int own = act->grid->vert[block];
    if (own >= 0 && !attached[own] && held[own] < 0 &&
        om_distance(om_load3(mesh->x, own), tip) <= act->task->grasp_radius)
        return own;
    int best = -1;
    double least = TWIN_REACH;
    for (int v = 0; v < mesh->nvert; ++v) {
        if (attached[v] || held[v] >= 0) continue;
        const double d = om_distance(om_load3(om_body_x(twin), v), tip);
        if (d < least) least = d, best = v;
    }
    return best;
}

OmStatus om__cloud_grasp_twin(Act* act, int arm, int block, OmPose tip) {
    const double radius = act->task->grasp_radius;
    int nheld;
    act->arm[arm].twin_off = om_vec3(0, 0, 0);
    OmStatus status = om_body_grasp(act->twin, arm, tip, radius, &nheld);
    if (status != OM_INVALID || !act->has_cloud) return status;
    const int v = find_material(act, tip.p, block);
    if (v < 0) return status;
    const OmVec3 at = om_load3(om_body_x(act->twin), v);
    OM_TRY(om_body_grasp(act->twin, arm, (OmPose){at, tip.q}, radius, &nheld));
    act->arm[arm].twin_off = om_sub(at, tip.p);
    ++act->effort->ndrawn;
    return OM_OK;
}

double om__cloud_draw_time(const Act* act, int arm) {
    return om_norm(act->arm[arm].twin_off) / DRAW_SPEED;
}

void om__cloud_draw(Act* act, int arm) {
    OmVec3* off = &act->arm[arm].twin_off;
    const double length = om_norm(*off), step = DRAW_SPEED * act->task->time_step;
    *off = length <= step ? om_vec3(0, 0, 0) : om_scale(1 - step / length, *off);
}

// ---- jaws that closed on nothing --------------------------------------------------------------------------------

// The same place would be empty again; another one, seen in a new look, is tried.
void om__cloud_note_empty(Act* act, int arm, int block) {
    ++act->effort->nempty;
    ++act->nempty[block];
    act->empty_tip[block] = act->arm[arm].tip;
}

bool om__cloud_is_spent(const Act* act, int block) {
    if (act->nempty[block] == 0) return false;
    if (act->nempty[block] >= OM_ACT_MAX_EMPTY) return true;
    const GraspPoint* p = &act->point[block];
    return om_distance(p->tip, act->empty_tip[block]) <= OM_CLOUD_AGREE;
}
