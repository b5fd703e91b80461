// study_kidney_truth.c: lifts of the fat in the simulated world, kept as snapshots, and what the camera sees of them.
//
// The world has smaller elements, another law and another stiffness than the twin, weight, contact with the
// kidney, and a tool in view. A lift ends at the level before the pull exceeds FORCE_MAX, where fat would tear; the
// surgeon of the thesis stopped there as well. Each run has its own noise of depth and tool, and its own error of
// calibration, by which its camera and scan are shifted.
//
// A snapshot of the world gives the same picture with any noise. A file has the snapshots of one lift.
#include <math.h>
#include <string.h>

#include "omentum/body.h"
#include "studies/study_kidney_case.h"
#include "studies/study_match_case.h"

#define STILL 2e-3           // m/s: a level is at rest below this
#define MAX_WAIT 50          // ticks to come to rest at a level
#define FORCE_MAX 4.0        // N
#define CALIBRATION 0.00058  // m, standard deviation along each axis: 1 mm in all

void om__kidney_truth_close(KidneyTruth* t) {
    if (!t) return;
    om_world_destroy(t->world);
    om_tet_mesh_done(&t->mesh);
    om_free(t->x);
    om_surface_done(&t->surface);
    om_free(t->vert);
    for (int g = 0; g < KIDNEY_NGRASP; ++g) om_free(t->file[g]);
    om_site_done(&t->site);
    memset(t, 0, sizeof *t);
}

OmStatus om__kidney_truth_open(const OmScene* scene, bool is_quick, int state, int nworker,
                               KidneyTruth* t) {
    memset(t, 0, sizeof *t);
    t->scene = *scene;
    t->state = state;
    t->is_quick = is_quick;
    om__kidney_set_truth(&t->scene);
    OmStatus status;
    OM_TRY_DONE(om__kidney_build_site(&t->scene, OM_SITE_WORLD, state, &t->site));
    OM_TRY_DONE(om_world_create_simulated(&t->scene, &t->site, nworker, &t->world));
    OM_TRY_DONE(om_tet_mesh_copy(&t->site.mesh, &t->mesh));
    OM_TRY_DONE(om_tet_mesh_refine(&t->mesh));
    OM_TRY_DONE(om_tet_mesh_boundary(&t->mesh, &t->surface, &t->vert));
    OM_ALLOC_DONE(t->x, 3 * (size_t)t->mesh.nvert);
    t->size = om_world_state_size(t->world);
done:
    if (status < 0) om__kidney_truth_close(t);
    return status;
}

static unsigned char* snapshot(const KidneyTruth* t, int grasp, int moment) {
    return t->file[grasp] + sizeof(KidneyLift) + (size_t)moment * t->size;
}

// ---- a lift -------------------------------------------------------------------------------------------

typedef struct Run {
    KidneyTruth* truth;
    int grasp;
    StudyHand hand;
} Run;

// The vertex of the upper side at a grasping point, in the tissue at rest, world frame.
static OmVec3 find_grasp(const KidneyTruth* t, int grasp) {
    const OmMeshSet* top = om_tet_mesh_find_set(&t->site.mesh, "top");
    const double* x = om_body_x(om_world_truth(t->world));
    OmPose task = om_pose_inverse(t->site.pose_world_task);
    OmVec3 best = om_vec3(0, 0, 0);
    double nearest = HUGE_VAL;
    for (int k = 0; k < top->nvert; ++k) {
        OmVec3 p = om_pose_apply(task, om_load3(t->site.mesh.x, top->vert[k]));
        double d = hypot(p.x - om__kidney_grasp[grasp][0], p.y - om__kidney_grasp[grasp][1]);
        if (d >= nearest) continue;
        nearest = d;
        best = om_load3(x, top->vert[k]);
    }
    return best;
}

// Wait until no vertex moves faster than STILL.
static OmStatus wait(Run* r) {
    OmBody* body = om_world_truth(r->truth->world);
    int nvert = r->truth->site.mesh.nvert;
    double *before, limit = STILL * r->truth->scene.task.time_step;
    OM_ALLOC(before, 3 * (size_t)nvert);
    OmStatus status = OM_OK;
    for (int i = 0; i < MAX_WAIT; ++i) {
        memcpy(before, om_body_x(body), 3 * (size_t)nvert * sizeof *before);
        OM_TRY_DONE(om__hand_wait(&r->hand, 1));
        double most = 0;
        for (int v = 0; v < nvert; ++v)
            most = fmax(most, om_distance(om_load3(before, v), om_load3(om_body_x(body), v)));
        if (most < limit) break;
    }
done:
    om_free(before);
    return status;
}

static OmStatus lift(Run* r, OmVec3 p, OmVec3 up) {
    KidneyTruth* t = r->truth;
    KidneyLift* l = &t->lift[r->grasp];
    for (int k = 0; k < KIDNEY_NLEVEL; ++k) {
        if (om__hand_go(&r->hand, om_madd(p, KIDNEY_STEP * (k + 1), up), HAND_SPEED) < 0) {
            snprintf(l->reason, sizeof l->reason, "%.70s", om_error_message());
            return OM_OK;
        }
        OM_TRY(wait(r));
        OM_TRY(om__hand_force(&r->hand, &l->force[k]));
        if (!om_arm_is_holding(&r->hand.obs.arm[0])) {
            snprintf(l->reason, sizeof l->reason, "the jaw lost the tissue");
            return OM_OK;
        }
        if (l->force[k] > FORCE_MAX) {
            snprintf(l->reason, sizeof l->reason, "%.1f N at %d mm: the tissue would tear",
                     l->force[k], 10 * (k + 1));
            return OM_OK;
        }
        OM_TRY(om_world_save(t->world, snapshot(t, r->grasp, KIDNEY_LIFTED + k)));
        l->nlevel = k + 1;
    }
    return OM_OK;
}

static OmStatus simulate(KidneyTruth* t, int grasp) {
    Run r = {.truth = t, .grasp = grasp, .hand = {"kidney", t->world, t->scene.task.time_step}};
    OmVec3 up = om_quat_rotate(t->site.pose_world_task.q, om_vec3(0, 0, 1));
    OmStatus status = om_world_reset(t->world);
    if (status == OM_NOT_CONVERGED)
        status = OM_OK;  // it creeps: a snapshot is what the camera sees
    if (status < 0) return status;
    int nbad = om_body_nbad(om_world_truth(t->world));
    KidneyLift* l = &t->lift[grasp];
    memset(l, 0, sizeof *l);
    OM_TRY_DONE(om_world_observe(t->world, 0, &r.hand.obs));
    OM_TRY_DONE(om_world_save(t->world, snapshot(t, grasp, KIDNEY_REST)));
    OmVec3 p = find_grasp(t, grasp);
    OM_TRY_DONE(om__hand_grasp(&r.hand, om_madd(p, HAND_ABOVE, up), p));
    OM_TRY_DONE(om_world_save(t->world, snapshot(t, grasp, KIDNEY_CLOSED)));
    OM_TRY_DONE(lift(&r, p, up));
    l->nbad = om_body_nbad(om_world_truth(t->world)) - nbad;
    memcpy(t->file[grasp], l, sizeof *l);
done:
    om_observation_done(&r.hand.obs);
    return status;
}

OmStatus om__kidney_hash_truth(const OmScene* scene, uint64_t* hash) {
    const double number[] = {HAND_SPEED, FORCE_MAX, STILL, KIDNEY_STEP, CALIBRATION};
    OmScene truth = *scene;
    OmText text = {0};
    om__kidney_set_truth(&truth);
    truth.seed = 0;
    OmStatus status = om_scene_print(&truth, false, &text);
    *hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    if (status == OM_OK) *hash = om_hash(text.str, text.len, *hash);
    *hash = om_hash(number, sizeof number, *hash);
    om_text_done(&text);
    return status;
}

// Hash of everything that a lift depends on.
static OmStatus hash_setup(const KidneyTruth* t, int grasp, uint64_t* hash) {
    const OmMeshSet* held = om_tet_mesh_find_set(&t->site.mesh, "attachment");
    OM_TRY(om__kidney_hash_truth(&t->scene, hash));
    *hash = om_hash(t->site.mesh.x, 3 * (size_t)t->site.mesh.nvert * sizeof(double), *hash);
    *hash = om_hash(held->vert, (size_t)held->nvert * sizeof *held->vert, *hash);
    *hash = om_hash(om__kidney_grasp[grasp], sizeof om__kidney_grasp[grasp], *hash);
    return OM_OK;
}

OmStatus om__kidney_truth_lift(KidneyTruth* t, const char* dir, int grasp, bool* is_new) {
    char name[64];
    uint64_t hash;
    size_t size = sizeof(KidneyLift) + KIDNEY_NMOMENT * t->size;
    if (!t->file[grasp]) t->file[grasp] = om_calloc(size, 1);
    unsigned char* file = t->file[grasp];
    if (!file) return OM_NO_MEMORY;
    OM_TRY(hash_setup(t, grasp, &hash));
    snprintf(name, sizeof name, "truth-%c%d%s.bin", 'A' + grasp, t->state + 1,
             t->is_quick ? "-quick" : "");
    const bool is_there = om__match_load_result(dir, name, hash, file, size);
    if (is_new) *is_new = !is_there;
    if (is_there) {
        memcpy(&t->lift[grasp], file, sizeof(KidneyLift));
        return OM_OK;
    }
    memset(file, 0, size);
    OmStatus status = simulate(t, grasp);
    if (status < 0) return om_error_prefix(status, "grasp %c, state %d", 'A' + grasp, t->state + 1);
    return om__match_save_result(dir, name, hash, file, size);
}

// ---- what is seen of it -------------------------------------------------------------------------------

OmStatus om__kidney_truth_show(KidneyTruth* t, int grasp, KidneyMoment moment) {
    int nlevel = t->lift[grasp].nlevel, level = (int)moment - KIDNEY_LIFTED + 1;
    OM_CHECK(t->file[grasp] && level <= nlevel, OM_INVALID, "kidney: level %d of %d", level,
             nlevel);
    OM_TRY(om_world_restore(t->world, snapshot(t, grasp, moment)));
    om_body_get_nodes(om_world_truth(t->world), t->x);
    for (int i = 0; i < t->surface.nvert; ++i)
        om_store3(t->surface.x, i, om_load3(t->x, t->vert[i]));
    return OM_OK;
}

// Measured tip at a moment.
static OmStatus find_tip(KidneyTruth* t, int grasp, KidneyMoment moment, OmPose* tip) {
    OmObservation obs = {0};
    OM_TRY(om_world_restore(t->world, snapshot(t, grasp, moment)));
    OmStatus status = om_world_observe(t->world, 0, &obs);
    *tip = obs.arm[0].tip;
    om_observation_done(&obs);
    return status;
}

static void shift_scan(OmVec3 shift, OmScan* scan) {
    for (int i = 0; i < scan->npoint; ++i)
        om_store3(scan->x, i, om_add(om_load3(scan->x, i), shift));
    scan->camera.pose_world_camera.p = om_add(scan->camera.pose_world_camera.p, shift);
}

OmStatus om__kidney_truth_look(KidneyTruth* t, int grasp, KidneyMoment moment, int run,
                               const OmSite* twin, OmAcquisition* a) {
    memset(a, 0, sizeof *a);
    OmMatchGrasp held = {.arm = 0};
    OmObservation obs = {0};
    OmRng rng = om_rng_init(KIDNEY_NOISE_SEED + (uint64_t)run, 1);
    double shift[3];
    for (int i = 0; i < 3; ++i) shift[i] = CALIBRATION * om_rng_normal(&rng);
    t->scene.seed = KIDNEY_NOISE_SEED + run;  // of the world's noise
    OmStatus status;
    if (moment >= KIDNEY_LIFTED) {
        OM_TRY_DONE(find_tip(t, grasp, KIDNEY_CLOSED, &held.pose_world_grasp));
        OM_TRY_DONE(find_tip(t, grasp, moment, &held.pose_world_now));
        a->ngrasp = 1;
        a->grasp[0] = held;
    }
    OM_TRY_DONE(om__kidney_truth_show(t, grasp, moment));
    OM_TRY_DONE(om_world_observe(t->world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs));
    OM_TRY_DONE(om__hand_scan(&obs, twin, om_world_psm(t->world, 0), 0, &a->scan));
    t->shift = om_load3(shift, 0);
    shift_scan(t->shift, &a->scan);
    a->time = obs.rgbd.time;
done:
    t->scene.seed = 0;
    om_observation_done(&obs);
    return status;
}

OmStatus om__kidney_truth_save_picture(KidneyTruth* t, int grasp, KidneyMoment moment,
                                       const char* path) {
    OmObservation obs = {0};
    OM_TRY(om__kidney_truth_show(t, grasp, moment));
    OmStatus status = om_world_observe(t->world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs);
    if (status == OM_OK) status = om_picture_save_png(&obs.rgbd.color, path);
    om_observation_done(&obs);
    return status;
}
