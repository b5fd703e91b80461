// match_cause.c: what is wrong with a scan that does not fit the model.
//
// Causes are tried one by one: a rigid motion of the camera, another focal length, another scale of depth or unit,
// distances along the ray, mirrored colours, the inverse pose, OpenGL's axes, another order of the quaternion. The one
// that leaves least is named, if it explains most samples and leaves clearly less than the stated camera. A cause with
// fewer unknowns is preferred where it leaves nearly as little.
#include "match/match_judge.h"

#include <string.h>

#define EXPLAINED 0.6    // share of the samples that a cause explains
#define CLEARLY 0.7      // ... and it leaves at most this part
#define ONE_UNKNOWN 0.1  // handicap of a cause with one unknown, or with other samples
#define SIX_UNKNOWNS 0.15
#define STEP 3       // every so many pixels of a picture are looked at
#define BARE 0.0012  // m: what lies nearer to board or organ is no tissue
#define THICK 0.003  // m: what lies farther from them, over the tissue's place, is tissue or a tool
#define ABOVE 0.06   // m: and no farther
#define CONTRADICTION 0.02  // share of the pixels whose colour contradicts their place
#define IN_PLACE 0.5    // share of the pixels that lie on some surface where only colours are wrong
#define LEAST_SIZE 0.2  // of the samples over the model
#define MIRRORED 0.3    // mirrored, at most this part of it is left

typedef struct Found {  // the best cause so far
    OmMatchCause cause;
    double cost, explained;
    MatchGuess guess;
} Found;

static void offer(MatchJudge* j, OmMatchCause cause, const MatchGuess* g, double handicap,
                  Found* best) {
    if (j->radius < LEAST_SIZE * g->scale * j->size) return;  // a point fits everywhere
    double explained, cost = om__judge_measure(j, g, &explained) + handicap;
    if (cost >= best->cost) return;
    *best = (Found){cause, cost, explained, *g};
}

// One unknown: tried in steps, then refined.
MatchGuess om__judge_fit_ratio(MatchJudge* j, const MatchGuess* stated, OmMatchCause cause) {
    double at = 0, step = 0.02, least = HUGE_VAL;
    MatchGuess g = *stated;
    double* value = cause == OM_MATCH_FOCAL ? &g.focal : &g.scale;
    for (int k = -30; k <= 30; ++k) {
        *value = exp(k * step);
        double cost = om__judge_measure(j, &g, NULL);
        if (cost < least) least = cost, at = k * step;
    }
    for (step *= 0.5; step > 2e-4; step *= 0.5)
        for (int side = -1; side <= 1; side += 2) {
            *value = exp(at + side * step);
            double cost = om__judge_measure(j, &g, NULL);
            if (cost < least) least = cost, at += side * step;
        }
    *value = exp(at);
    return g;
}

static void try_ratio(MatchJudge* j, const MatchGuess* stated, OmMatchCause cause, Found* best) {
    MatchGuess g = om__judge_fit_ratio(j, stated, cause);
    offer(j, cause, &g, ONE_UNKNOWN, best);
}

static void try_poses(MatchJudge* j, const MatchGuess* stated, Found* best) {
    const OmQuat q = stated->pose.q;
    MatchGuess g = *stated;
    g.pose = om_pose_inverse(stated->pose);
    offer(j, OM_MATCH_INVERSE, &g, 0, best);
    g.pose = stated->pose;
    g.pose.q = om_quat_mul(q, om_quat_axis_angle(om_vec3(1, 0, 0), OM_PI));
    offer(j, OM_MATCH_OPENGL, &g, 0, best);
    g.pose.q = (OmQuat){.x = q.y, .y = q.z, .z = q.w, .w = q.x};
    offer(j, OM_MATCH_ORDER, &g, 0, best);
    g.pose.q = (OmQuat){.x = q.w, .y = q.x, .z = q.y, .w = q.z};
    offer(j, OM_MATCH_ORDER, &g, 0, best);
}

static void try_units(MatchJudge* j, const MatchGuess* stated, Found* best) {
    static const double unit[] = {1e-3, 1e-2, 1e-1, 10, 100, 1000};
    MatchGuess g = *stated;
    for (size_t k = 0; k < sizeof unit / sizeof *unit; ++k) {
        g.scale = unit[k];
        offer(j, OM_MATCH_SCALE, &g, 0, best);
    }
}

// All but a motion.
static void try_settings(MatchJudge* j, const MatchGuess* stated, Found* best) {
    MatchGuess g = *stated;
    g.is_range = true;
    offer(j, OM_MATCH_RANGE, &g, 0, best);
    try_ratio(j, stated, OM_MATCH_FOCAL, best);
    try_ratio(j, stated, OM_MATCH_SCALE, best);
    try_units(j, stated, best);
    try_poses(j, stated, best);
}

// ---- words ----------------------------------------------------------------------------------------------------------

const char* om_match_cause_name(OmMatchCause cause) {
    static const char* const name[] = {"fits",    "moved",  "focal", "scale", "range",  "mirrored",
                                       "inverse", "opengl", "order", "empty", "unknown"};
    return (unsigned)cause < sizeof name / sizeof *name ? name[cause] : NULL;
}

void om__judge_say(OmMatchVerdict* v, const char* format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(v->reason, sizeof v->reason, format, args);
    va_end(args);
}

static void say_mirrored(OmMatchVerdict* v) {
    om__judge_say(
        v,
        "it fits if the colour picture is mirrored: colour and depth have different orders of pixels");
}

static void name_cause(const MatchJudge* j, const MatchGuess* stated, const Found* f,
                       OmMatchVerdict* v) {
    const MatchGuess* g = &f->guess;
    v->cause = f->cause;
    switch (f->cause) {
    case OM_MATCH_MOVED:
        om__judge_set_motion(j, stated, g, v);
        v->size = v->turn;
        om__judge_say(
            v,
            "it fits if the camera is turned by %.1f degrees and the scan is shifted by %.1f mm: "
            "calibrate the camera again",
            om__degrees(v->turn), 1e3 * v->shift);
        return;
    case OM_MATCH_FOCAL:
        v->size = g->focal;
        om__judge_say(
            v,
            "it fits if the focal length is divided by %.3f: give the focal length of this size of picture",
            g->focal);
        return;
    case OM_MATCH_SCALE:
        v->size = g->scale;
        om__judge_say(
            v,
            "it fits if depth is divided by %.4g: is its unit right, and is the sensor calibrated?",
            g->scale);
        return;
    case OM_MATCH_RANGE:
        om__judge_say(
            v,
            "it fits if depth is the distance along the ray: store the distance along the camera's z");
        return;
    case OM_MATCH_INVERSE:
        om__judge_say(
            v,
            "it fits with the inverse of the camera's pose: give the pose of the camera in the world");
        return;
    case OM_MATCH_OPENGL:
        om__judge_say(
            v,
            "it fits if the camera's y points up and its z backwards, as in OpenGL: turn the pose by 180 "
            "degrees about its x");
        return;
    case OM_MATCH_ORDER:
        om__judge_say(
            v,
            "it fits with another order of the quaternion: w is the first number of some programs and the last "
            "of others");
        return;
    default: return;
    }
}

// Where cloud and model are.
static void say_places(const MatchJudge* j, const MatchGuess* stated, OmMatchVerdict* v) {
    OmVec3 at = om__judge_place_of(stated, j->center), model = om_vec3(0, 0, 0);
    const OmSurface* s = &j->match->surface;
    for (int i = 0; i < s->nvert; ++i) model = om_madd(model, 1.0 / s->nvert, om_load3(s->x, i));
    v->cause = OM_MATCH_UNKNOWN;
    om__judge_say(
        v,
        "it does not fit the model: its middle is at (%.0f, %.0f, %.0f) mm, that of the model at (%.0f, %.0f, %.0f) "
        "mm; unit, pose or axes of the camera are wrong, or it shows other tissue",
        1e3 * at.x, 1e3 * at.y, 1e3 * at.z, 1e3 * model.x, 1e3 * model.y, 1e3 * model.z);
}

// Share of the pixels whose colour contradicts their place: tissue on the bare board or organ, and other things above
// it, where tissue may be.
static double find_contradiction(const MatchJudge* j, bool is_across, bool is_down) {
    const OmScan* scan = j->scan;
    const OmCamera* c = &scan->camera;
    const OmSite* site = j->match->def.site;
    OmPose pose_task_world = om_pose_inverse(site->pose_world_task);
    OmVec3 forward = om_quat_rotate(c->pose_world_camera.q, om_vec3(0, 0, 1)), n;
    int npixel = 0, nwrong = 0;
    for (int v = STEP / 2; v < c->height; v += STEP)
        for (int u = STEP / 2; u < c->width; u += STEP) {
            double z = (double)scan->depth[u + v * c->width];
            int class = scan->pixel[(is_across ? c->width - 1 - u : u) +
                                    (is_down ? c->height - 1 - v : v) * c->width];
            if (!(z > 0) || (class != OM_SCAN_TISSUE && class != OM_SCAN_OTHER)) continue;
            OmVec3 ray = om_camera_ray(c, u + 0.5, v + 0.5);
            OmVec3 x = om_madd(c->pose_world_camera.p, z / om_dot(ray, forward), ray);
            OmVec3 at = om_pose_apply(pose_task_world, x);
            double gap = om__match_gap(j->match, x, &n);
            bool is_within =
                fabs(at.x) < site->half_size.x && fabs(at.y) < site->half_size.y && gap < ABOVE;
            npixel += class == OM_SCAN_TISSUE || is_within;
            nwrong += class == OM_SCAN_TISSUE ? gap < BARE : is_within && gap > THICK;
        }
    return npixel > 0 ? (double)nwrong / npixel : 0;
}

// Whether what the picture shows, whatever its colour, lies where tissue at rest, board or organ are.
static OmStatus is_in_place(MatchJudge* j, bool* answer) {
    double explained = 0;
    const MatchGuess stated = om__judge_as_stated(j->scan);
    j->nsample = 0;
    OM_TRY(om__judge_add_pixels(j, OM_SCAN_TISSUE, false));
    OM_TRY(om__judge_add_pixels(j, OM_SCAN_OTHER, false));
    j->is_any = true;
    om__judge_measure(j, &stated, &explained);
    j->is_any = false;
    *answer = explained >= IN_PLACE;
    return OM_OK;
}

OmStatus om__judge_mirrored(MatchJudge* j, OmMatchVerdict* v) {
    const OmSite* site = j->match->def.site;
    if (!om__judge_has_pixels(j->scan) || !(site->has_ground || site->has_organ)) return OM_OK;
    double stated = find_contradiction(j, false, false);
    bool is_right = false;
    if (stated < CONTRADICTION) return OM_OK;
    OM_TRY(is_in_place(j, &is_right));
    for (int k = 1; k < 4 && is_right; ++k) {
        if (find_contradiction(j, k & 1, k & 2) > MIRRORED * stated) continue;
        v->is_good = false;
        v->cause = OM_MATCH_MIRRORED;
        say_mirrored(v);
        return OM_OK;
    }
    return OM_OK;
}

OmStatus om__judge_find_cause(MatchJudge* j, const MatchGuess* stated, OmMatchVerdict* v) {
    Found best = {.cause = OM_MATCH_UNKNOWN, .cost = HUGE_VAL};
    double explained, now = om__judge_measure(j, stated, &explained);
    best.cost = CLEARLY * now;
    try_settings(j, stated, &best);
    MatchGuess g = *stated;
    for (double scale = 80; scale > 1; scale /= 2)
        om__judge_fit_rigid(j, &g, stated, scale, 0, NULL);
    offer(j, OM_MATCH_MOVED, &g, SIX_UNKNOWNS, &best);
    v->is_good = false;
    if (best.cause == OM_MATCH_UNKNOWN || best.explained < EXPLAINED)
        say_places(j, stated, v);
    else
        name_cause(j, stated, &best, v);
    return OM_OK;
}

// A scan without tissue: every pixel with depth may show tissue, board or organ.
OmStatus om__judge_empty(MatchJudge* j, OmMatchVerdict* v) {
    const OmScan* scan = j->scan;
    v->is_good = false;
    v->cause = OM_MATCH_EMPTY;
    om__judge_say(
        v,
        "%d points show the tissue, %d are needed: is it in view, and are the bounds of its colours right?",
        scan->npoint, OM__MATCH_MIN_POINTS);
    if (!om__judge_has_pixels(scan)) return OM_OK;
    MatchGuess stated = om__judge_as_stated(scan);
    j->nsample = 0;
    OM_TRY(om__judge_add_pixels(j, OM_SCAN_TISSUE, false));
    OM_TRY(om__judge_add_pixels(j, OM_SCAN_OTHER, false));
    if (j->nsample < OM__MATCH_MIN_POINTS) return OM_OK;
    om__judge_set_center(j);
    j->is_any = true;
    double explained;
    Found best = {.cause = OM_MATCH_UNKNOWN,
                  .cost = CLEARLY * om__judge_measure(j, &stated, &explained)};
    try_settings(j, &stated, &best);
    if (best.cause != OM_MATCH_UNKNOWN && best.explained >= EXPLAINED)
        name_cause(j, &stated, &best, v);
    else if (explained < EXPLAINED)
        say_places(j, &stated, v);
    j->is_any = false;
    return OM_OK;
}
