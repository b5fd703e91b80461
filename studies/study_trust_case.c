// study_trust_case.c: acquisitions of lifted tissue, right ones and ones with a stated error.
//
// Places of grasps follow a rule: of points 8 mm inside the border, drawn by the truth's seed, the first that is 25 mm
// from the true attachments (nearer to them the pull exceeds the force limit of a retraction); of 64 draws the farthest
// where none is.
#include "studies/study_trust_internal.h"

#include <math.h>
#include <string.h>

#include "studies/study_match_case.h"

#define DEG (OM_PI / 180)
#define FINER 1.6        // cells of the world over those of the twin, along a side
#define INSIDE 0.008     // m, of a grasp from the border
#define AWAY 0.025       // m, of a grasp from the attachments
#define SMALL_ROI 0.002  // m
#define NDRAW 64         // of places of a grasp
#define LOWEST 0.016     // m, the first lift
#define HIGHEST 0.044    // m, the last one
#define WAIT 40          // ticks before a picture
#define NO_DATA 65.535f  // m, of 65535 as millimetres

const char* const om__trust_error_name[TRUST_NERROR] = {
    "right",   "shift",    "tilt",    "aim",    "focal", "scale", "range",
    "missing", "mirrored", "inverse", "opengl", "order", "other"};
const char* const om__trust_error_unit[TRUST_NERROR] = {"",  "mm", "deg", "deg", "", "", "",
                                                        "%", "",   "",    "",    "", ""};

// ---- the scene --------------------------------------------------------------------------------------------------

static OmScene make_scene(uint64_t seed, int number, int cells) {
    OmRng rng = om_rng_init(seed, (uint64_t)number);
    OmScene s = om_scene_default();
    snprintf(s.name, sizeof s.name, "trust %d", number);
    s.seed = (int)(om_rng_u32(&rng) >> 1);
    s.tissue.cells = om_vec3(cells, cells, 1);
    s.tissue.world_cells = om_vec3(floor(FINER * cells), floor(FINER * cells), 1);
    s.world.element = OM_ELEMENT_QUADRATIC;  // not the shells of the twin
    s.attach.share_min = s.attach.share_max = om_rng_range(&rng, 0.1, 0.5);
    s.world.young_factor = om_rng_range(&rng, 0.7, 1.3);
    return s;
}

// Where the jaw closes, task frame.
static OmVec3 choose_grasp(const OmSite* twin, const unsigned char* attached, uint64_t seed,
                           int number) {
    OmRng rng = om_rng_init(seed ^ 0x67726173u, (uint64_t)number);
    OmPose task = om_pose_inverse(twin->pose_world_task);
    OmVec3 half = twin->half_size, best = om_vec3(0, 0, 0);
    double farthest = -1;
    for (int k = 0; k < NDRAW && farthest < AWAY; ++k) {
        double a = om_rng_range(&rng, -1, 1);
        int side = (int)om_rng_below(&rng, 4);
        double u = (half.x - INSIDE) * (side < 2 ? a : side == 2 ? 1 : -1);
        double v = (half.y - INSIDE) * (side >= 2 ? a : side == 0 ? 1 : -1);
        double nearest = HUGE_VAL;
        for (int i = 0; i < twin->mesh.nvert; ++i) {
            OmVec3 p = om_pose_apply(task, om_load3(twin->mesh.x, i));
            if (attached[i]) nearest = fmin(nearest, hypot(p.x - u, p.y - v));
        }
        if (nearest <= farthest) continue;
        farthest = nearest;
        best = om_vec3(u, v, 2 * half.z);
    }
    return best;
}

// The true attachments. A region of interest that has no place beside a large patch is made small: the study has no use
// for it.
static OmStatus mark_attached(OmScene* scene, TrustTruth* t) {
    OmSite site = {0};
    scene->believed.kind = OM_BELIEF_SAME;
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, NULL, &site);
    if (status == OM_INVALID) {
        scene->roi.radius = SMALL_ROI;
        scene->roi.margin = 0;
        status = om_site_build(scene, OM_SITE_TWIN, NULL, &site);
    }
    if (status < 0) return status;
    t->attached = om_calloc((size_t)site.mesh.nvert, 1);
    const OmMeshSet* set = om_tet_mesh_find_set(&site.mesh, "attachment");
    const OmMeshSet* under = om_tet_mesh_find_set(&site.mesh, "underside");
    for (int i = 0; t->attached && set && i < set->nvert; ++i) t->attached[set->vert[i]] = 1;
    if (set && under && under->nvert > 0) t->share = (double)set->nvert / under->nvert;
    om_site_done(&site);
    scene->believed.kind = OM_BELIEF_NONE;
    return t->attached ? OM_OK : OM_NO_MEMORY;
}

static size_t count_pixels(const OmScene* s) {
    return (size_t)s->rgbd.width * (size_t)s->rgbd.height;
}

static OmStatus make_room(TrustTruth* t) {
    size_t n = count_pixels(&t->scene);
    for (int k = 0; k <= TRUST_NLIFT; ++k) {
        TrustShot* shot = k < TRUST_NLIFT ? &t->lift[k] : &t->rest;
        OM_ALLOC(shot->depth, n);
        OM_ALLOC(shot->color, 3 * n);
    }
    return OM_OK;
}

// ---- the motion ---------------------------------------------------------------------------------------------------

typedef struct Run {
    TrustTruth* t;
    StudyHand hand;
} Run;

static OmVec3 to_world(const Run* r, OmVec3 p) {
    return om_pose_apply(r->t->twin.pose_world_task, p);
}

static OmStatus take(Run* r, TrustShot* shot) {
    OM_TRY(om_world_observe(r->hand.world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &r->hand.obs));
    size_t n = count_pixels(&r->t->scene);
    shot->time = r->hand.obs.rgbd.time;
    memcpy(shot->arm, r->hand.obs.arm, sizeof shot->arm);
    memcpy(shot->depth, r->hand.obs.rgbd.depth, n * sizeof *shot->depth);
    memcpy(shot->color, r->hand.obs.rgbd.color.pixel, 3 * n);
    r->t->camera = r->hand.obs.rgbd.camera;
    return OM_OK;
}

static OmStatus lift(Run* r, OmVec3 p) {
    TrustTruth* t = r->t;
    StudyHand* h = &r->hand;
    OM_TRY(take(r, &t->rest));
    OM_TRY(om__hand_close(h, to_world(r, om_add(p, om_vec3(0, 0, HAND_ABOVE))), to_world(r, p)));
    t->grasp = h->obs.arm[h->arm].tip;
    for (int k = 0; k < TRUST_NLIFT && om_arm_is_holding(&h->obs.arm[h->arm]); ++k) {
        t->height[k] = LOWEST + (HIGHEST - LOWEST) * k / (TRUST_NLIFT - 1);
        OM_TRY(om__hand_go(h, to_world(r, om_add(p, om_vec3(0, 0, t->height[k]))), HAND_SPEED));
        OM_TRY(om__hand_wait(h, WAIT));
        if (om_arm_is_holding(&h->obs.arm[h->arm])) OM_TRY(take(r, &t->lift[t->nlift++]));
    }
    return OM_OK;
}

static OmStatus simulate(TrustTruth* t, OmVec3 p, int nworker) {
    Run r = {.t = t, .hand = {.name = t->scene.name, .dt = t->scene.task.time_step, .arm = t->arm}};
    OmScene scene = t->scene;
    OmSite site = {0};
    OmStatus status;
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    OM_TRY_DONE(om_world_create_simulated(&scene, &site, nworker, &r.hand.world));
    OM_TRY_DONE(om_world_reset(r.hand.world));
    OM_TRY_DONE(om_world_observe(r.hand.world, 0, &r.hand.obs));
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (om_world_psm(r.hand.world, a)) t->psm[a] = *om_world_psm(r.hand.world, a);
    status = lift(&r, p);
done:
    om_observation_done(&r.hand.obs);
    om_world_destroy(r.hand.world);
    om_site_done(&site);
    return status;
}

// ---- files ----------------------------------------------------------------------------------------------------------

enum { NPART = 5 + 4 * (TRUST_NLIFT + 1) };

static void list_parts(TrustTruth* t, StudyPart part[NPART]) {
    const size_t n = count_pixels(&t->scene);
    const StudyPart head[5] = {{t->psm, sizeof t->psm},
                               {&t->grasp, sizeof t->grasp},
                               {&t->camera, sizeof t->camera},
                               {t->height, sizeof t->height},
                               {&t->nlift, sizeof t->nlift}};
    memcpy(part, head, sizeof head);
    part += 5;
    for (int k = 0; k <= TRUST_NLIFT; ++k) {
        TrustShot* shot = k < TRUST_NLIFT ? &t->lift[k] : &t->rest;
        *part++ = (StudyPart){&shot->time, sizeof shot->time};
        *part++ = (StudyPart){shot->arm, sizeof shot->arm};
        *part++ = (StudyPart){shot->depth, n * sizeof *shot->depth};
        *part++ = (StudyPart){shot->color, 3 * n};
    }
}

static OmStatus hash_scene(const OmScene* scene, uint64_t* hash) {
    OmText text = {0};
    OmStatus status = om_scene_print(scene, false, &text);
    if (status == OM_OK) *hash = om_hash(text.str, text.len, OM_HASH_SEED);
    om_text_done(&text);
    return status;
}

OmStatus om__trust_scene_hash(uint64_t seed, int number, int cells, uint64_t* hash) {
    OmScene scene = make_scene(seed, number, cells);
    return hash_scene(&scene, hash);
}

void om__trust_truth_done(TrustTruth* t) {
    if (!t) return;
    om_site_done(&t->twin);
    om_free(t->attached);
    for (int k = 0; k <= TRUST_NLIFT; ++k) {
        TrustShot* shot = k < TRUST_NLIFT ? &t->lift[k] : &t->rest;
        om_free(shot->depth);
        om_free(shot->color);
    }
    memset(t, 0, sizeof *t);
}

OmStatus om__trust_truth_get(uint64_t seed, int number, int cells, const char* dir, int nworker,
                             TrustTruth* t) {
    memset(t, 0, sizeof *t);
    StudyPart part[NPART];
    char name[64];
    OmStatus status;
    snprintf(name, sizeof name, "truth-%03d.bin", number);
    t->number = number;
    t->scene = make_scene(seed, number, cells);
    OM_TRY_DONE(mark_attached(&t->scene, t));
    OM_TRY_DONE(om_site_build(&t->scene, OM_SITE_TWIN, NULL, &t->twin));
    OmVec3 p = choose_grasp(&t->twin, t->attached, seed, number);
    t->arm = p.y > 0;
    OM_TRY_DONE(make_room(t));
    OM_TRY_DONE(hash_scene(&t->scene, &t->hash));
    t->hash = om_hash(&p, sizeof p, t->hash);
    list_parts(t, part);
    if (om__study_load_parts(dir, name, t->hash, part, NPART)) goto done;
    OM_TRY_DONE(simulate(t, p, nworker));
    status = om__study_save_parts(dir, name, t->hash, part, NPART);
done:
    if (status < 0) om__trust_truth_done(t);
    return status < 0 ? om_error_prefix(status, "truth %d", number) : OM_OK;
}

// ---- errors ---------------------------------------------------------------------------------------------------------

static OmVec3 random_axis(OmRng* rng) {
    OmVec3 v;
    do {
        v = om_vec3(om_rng_range(rng, -1, 1), om_rng_range(rng, -1, 1), om_rng_range(rng, -1, 1));
    } while (om_norm2(v) > 1 || om_norm2(v) < 1e-4);
    return om_normalize(v);
}

// A size from `lo` to `hi`, evenly in its logarithm.
static double random_size(OmRng* rng, double lo, double hi) {
    return lo * pow(hi / lo, om_rng_range(rng, 0, 1));
}

TrustCase om__trust_case(uint64_t seed, int number) {
    OmRng rng = om_rng_init(seed ^ 0x6572726fu, (uint64_t)number);
    TrustCase c = {.error = (TrustError)(1 + (int)om_rng_below(&rng, TRUST_NERROR - 1))};
    c.axis = random_axis(&rng);
    double sign = om_rng_below(&rng, 2) ? 1 : -1;
    c.variant = (int)om_rng_below(&rng, 6);
    switch (c.error) {
    case TRUST_SHIFT: c.size = random_size(&rng, 0.0001, 0.03); break;
    case TRUST_TILT: c.size = random_size(&rng, 0.05 * DEG, 20 * DEG); break;
    case TRUST_AIM: c.size = random_size(&rng, 0.02 * DEG, 10 * DEG); break;
    case TRUST_FOCAL: c.size = exp(sign * random_size(&rng, 0.001, 0.4)); break;
    case TRUST_SCALE: c.size = exp(sign * random_size(&rng, 0.0005, 0.5)); break;
    case TRUST_MISSING: c.size = om_rng_range(&rng, 0.05, 0.7); break;
    default: break;
    }
    return c;
}

static OmPose turned_about(OmPose pose, OmVec3 at, OmQuat turn) {
    OmPose t = {.p = om_add(at, om_quat_rotate(turn, om_sub(pose.p, at))),
                .q = om_quat_normalize(om_quat_mul(turn, pose.q))};
    return t;
}

// The pose of the camera that a robot gets.
static OmPose wrong_pose(const TrustTruth* t, const TrustCase* c) {
    OmPose pose = t->camera.pose_world_camera;
    OmVec3 axis = om_quat_rotate(pose.q, c->axis);
    const OmQuat q = pose.q;
    switch (c->error) {
    case TRUST_SHIFT: pose.p = om_madd(pose.p, c->size, axis); return pose;
    case TRUST_AIM: return turned_about(pose, pose.p, om_quat_axis_angle(axis, c->size));
    case TRUST_TILT:
        return turned_about(pose, t->twin.pose_world_task.p, om_quat_axis_angle(axis, c->size));
    case TRUST_INVERSE: return om_pose_inverse(pose);
    case TRUST_OPENGL:
        pose.q = om_quat_mul(q, om_quat_axis_angle(om_vec3(1, 0, 0), OM_PI));
        return pose;
    case TRUST_ORDER: pose.q = (OmQuat){.x = q.w, .y = q.x, .z = q.y, .w = q.z}; return pose;
    default: return pose;
    }
}

static void spoil_depth(const TrustTruth* t, const TrustCase* c, float* depth) {
    const OmCamera* cam = &t->camera;
    OmVec3 forward = om_quat_rotate(cam->pose_world_camera.q, om_vec3(0, 0, 1));
    const float none[3] = {0, NO_DATA, (float)cam->far_m};
    for (int v = 0; v < cam->height; ++v)
        for (int u = 0; u < cam->width; ++u) {
            float* z = &depth[(size_t)v * (size_t)cam->width + (size_t)u];
            double along = c->axis.x > 0 ? (u + 0.5) / cam->width : (v + 0.5) / cam->height;
            if (c->axis.y > 0) along = 1 - along;
            if (c->error == TRUST_SCALE) *z *= (float)c->size;
            if (c->error == TRUST_RANGE)
                *z /= (float)om_dot(om_camera_ray(cam, u + 0.5, v + 0.5), forward);
            if (c->error == TRUST_MISSING && along < c->size) *z = none[c->variant % 3];
        }
}

static void mirror_color(const TrustCase* c, OmPicture* color) {
    const bool is_across = c->variant % 2 == 0;
    for (int v = 0; v < (is_across ? color->height : color->height / 2); ++v)
        for (int u = 0; u < (is_across ? color->width / 2 : color->width); ++u) {
            int x = is_across ? color->width - 1 - u : u, y = is_across ? v : color->height - 1 - v;
            unsigned char* a = color->pixel + 3 * ((size_t)v * (size_t)color->width + (size_t)u);
            unsigned char* b = color->pixel + 3 * ((size_t)y * (size_t)color->width + (size_t)x);
            for (int k = 0; k < 3; ++k) {
                unsigned char kept = a[k];
                a[k] = b[k];
                b[k] = kept;
            }
        }
}

// The scan of a picture, as a robot gets it.
static OmStatus make_scan(const TrustTruth* t, const TrustShot* shot, const TrustCase* c,
                          OmScan* scan) {
    OmObservation obs;
    OM_TRY(om__hand_show(shot->time, shot->arm, t->scene.world.narm, &t->camera, shot->depth,
                         shot->color, &obs));
    spoil_depth(t, c, obs.rgbd.depth);
    obs.rgbd.camera.pose_world_camera = wrong_pose(t, c);
    if (c->error == TRUST_FOCAL) {
        obs.rgbd.camera.lens = om_camera_lens(&t->camera);
        obs.rgbd.camera.lens.fx *= c->size;
        obs.rgbd.camera.lens.fy *= c->size;
    }
    if (c->error == TRUST_MIRRORED) mirror_color(c, &obs.rgbd.color);
    OmStatus status = om__hand_scan(&obs, &t->twin, t->psm, 0, scan);
    om_observation_done(&obs);
    return status;
}

OmStatus om__trust_acquire(const TrustTruth* t, int k, const TrustCase* c, const TrustTruth* other,
                           OmAcquisition* a, OmScan* rest) {
    const TrustTruth* shown = c->error == TRUST_OTHER ? other : t;
    if (k >= shown->nlift) return om_error(OM_INVALID, "no lift %d", k);
    memset(a, 0, sizeof *a);
    memset(rest, 0, sizeof *rest);
    *a = (OmAcquisition){.time = t->lift[k].time, .ngrasp = 1};
    a->grasp[0] = (OmMatchGrasp){
        .arm = t->arm, .pose_world_grasp = t->grasp, .pose_world_now = t->lift[k].arm[t->arm].tip};
    OM_TRY(make_scan(shown, &shown->lift[k], c, &a->scan));
    OmStatus status = make_scan(shown, &shown->rest, c, rest);
    if (status < 0) om_scan_done(&a->scan);
    return status;
}
