// study_phantoms_truth.c: phantoms lifted in the simulated world, and what the depth camera saw at every step.
//
// "Reality" differs from the twin: more than twice the vertices on another mesh, Mooney-Rivlin's law with another
// Poisson's ratio, 0.85 of the stiffness, friction on board and capsule, arms in the view, noise on depth and on
// measured tips, and a camera that stands 1 mm away from where the robot believes it. It is at rest, then grasped, then
// lifted by steps; the camera looks once at rest before the arm comes and once after every step and a wait.
//
// A lift ends early where the pull exceeds FORCE_LIMIT; the level where it does is not kept.
#include <math.h>
#include <string.h>

#include "studies/study_match_case.h"
#include "studies/study_phantoms_case.h"

#define WAIT 25        // ticks after each step
#define FORCE_LIMIT 4  // N: thrice the weight of the heaviest phantom
#define SHIFT 0.001    // m, of the camera
#define SHIFT_STREAM 7

typedef struct Lift {
    const PhantomCase* c;
    int grasp;
    PhantomTruth* t;
    StudyHand hand;
} Lift;

static OmVec3 to_world(const Lift* l, OmVec3 p) {
    return om_pose_apply(l->t->site.pose_world_task, p);
}

static OmStatus keep(Lift* l, int level) {
    PhantomTruth* t = l->t;
    PhantomMoment* at = &t->head->at[level];
    OmBody* body = om_world_truth(l->hand.world);
    OM_TRY(om_world_observe(l->hand.world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &l->hand.obs));
    size_t n = t->npixel, n3 = 3 * (size_t)t->mesh.nvert, k = (size_t)level;
    memcpy(t->depth + k * n, l->hand.obs.rgbd.depth, n * sizeof *t->depth);
    memcpy(t->color + 3 * k * n, l->hand.obs.rgbd.color.pixel, 3 * n);
    om_body_get_nodes(body, t->x + k * n3);
    at->time = l->hand.obs.rgbd.time;
    memcpy(at->arm, l->hand.obs.arm, sizeof at->arm);
    at->nbad = om_body_nbad(body);
    t->head->camera = l->hand.obs.rgbd.camera;
    return OM_OK;
}

static OmStatus lift_all(Lift* l) {
    PhantomHead* h = l->t->head;
    const PhantomCase* c = l->c;
    for (int k = 1; k <= c->nlevel[l->grasp]; ++k) {
        OmVec3 p = om_madd(c->grasp[l->grasp], k * PHANTOM_STEP, c->lift[l->grasp]);
        OM_TRY(om__hand_go(&l->hand, to_world(l, p), HAND_SPEED));
        OM_TRY(om__hand_wait(&l->hand, WAIT));
        double force;
        OM_TRY(om__hand_force(&l->hand, &force));
        bool is_held = om_arm_is_holding(&l->hand.obs.arm[h->arm]);
        if (force > FORCE_LIMIT || !is_held) {
            h->end_force = force;
            return OM_OK;
        }
        OM_TRY(keep(l, k));
        h->at[k].force = force;
        h->nlevel = k;
    }
    return OM_OK;
}

// A camera that the robot believes 1 mm away from its place, in a direction of the configuration.
static void shift_camera(const PhantomCase* c, PhantomHead* h) {
    OmRng rng = om_rng_init(om__phantoms_seed(c, 0), SHIFT_STREAM);
    OmVec3 d = om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng));
    h->shift = om_scale(SHIFT, om_normalize(d));
    h->camera.pose_world_camera.p = om_add(h->camera.pose_world_camera.p, h->shift);
}

static OmStatus simulate(const PhantomCase* c, int grasp, int nworker, PhantomTruth* t) {
    PhantomHead* h = t->head;
    const OmVec3 p = c->grasp[grasp];
    h->arm = p.y > 0;
    Lift l = {.c = c,
              .grasp = grasp,
              .t = t,
              .hand = {.name = t->scene.name, .dt = t->scene.task.time_step, .arm = h->arm}};
    OmStatus status = om_world_create_simulated(&t->scene, &t->site, nworker, &l.hand.world);
    if (status < 0) goto done;
    status = om_world_reset(l.hand.world);  // tissue that is not yet quite at rest may settle on
    if (status < 0) goto done;
    OM_TRY_DONE(om__hand_wait(&l.hand, WAIT));
    OM_TRY_DONE(keep(&l, 0));
    OM_TRY_DONE(om__hand_grasp(&l.hand, to_world(&l, om_add(p, om_vec3(0, 0, HAND_ABOVE))),
                               to_world(&l, p)));
    h->grasp_tip = l.hand.obs.arm[h->arm].tip;
    OM_TRY_DONE(lift_all(&l));
    shift_camera(c, h);
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (om_world_psm(l.hand.world, a)) h->psm[a] = *om_world_psm(l.hand.world, a);
done:
    om_observation_done(&l.hand.obs);
    om_world_destroy(l.hand.world);
    return status;
}

// ---- files --------------------------------------------------------------------------------------------------

static size_t block_size(const PhantomTruth* t) {
    size_t n = 1 + PHANTOM_NLEVEL, nvert = (size_t)t->mesh.nvert;
    return sizeof(PhantomHead) +
           n * (3 * nvert * sizeof *t->x + t->npixel * (sizeof *t->depth + 3));
}

static OmStatus make_room(const PhantomCase* c, int grasp, double coarse, PhantomTruth* t) {
    t->scene = om__phantoms_scene(c, OM_SITE_WORLD);
    t->scene.seed = (int)om__phantoms_seed(c, grasp);
    OM_TRY(om__phantoms_site(c, OM_SITE_WORLD, coarse, &t->scene, &t->site));
    OM_TRY(om_tet_mesh_copy(&t->site.mesh, &t->mesh));
    OM_TRY(om_tet_mesh_refine(&t->mesh));
    OM_TRY(om_tet_mesh_boundary(&t->mesh, &t->surface, &t->vert));
    t->npixel = (size_t)t->scene.rgbd.width * (size_t)t->scene.rgbd.height;
    size_t n = 1 + PHANTOM_NLEVEL, n3 = 3 * (size_t)t->mesh.nvert;
    t->head = om_calloc(block_size(t), 1);
    if (!t->head) return OM_NO_MEMORY;
    t->x = (double*)(t->head + 1);
    t->depth = (float*)(t->x + n * n3);
    t->color = (unsigned char*)(t->depth + n * t->npixel);
    return OM_OK;
}

// Hash of everything that the truth depends on; not of the printed scene, which has keys of other parts, too.
static uint64_t hash_lift(const PhantomCase* c, int grasp, const PhantomTruth* t) {
    const OmScene* s = &t->scene;
    const OmTetMesh* m = &t->site.mesh;
    const OmMeshSet* held = om_tet_mesh_find_set(m, "attachment");
    const double number[] = {grasp, c->nlevel[grasp], HAND_SPEED,   HAND_FAST, WAIT, FORCE_LIMIT,
                             SHIFT, c->capsule.x,     c->capsule.y, c->reach};
    const double scene[] = {s->seed,
                            s->tissue.law,
                            om_scene_element(s, OM_SITE_TWIN),
                            t->site.young,
                            t->site.density,
                            t->site.poisson,
                            s->tissue.friction,
                            s->tissue.rayleigh_mass,
                            s->tissue.rayleigh_stiffness,
                            s->tissue.gravity,
                            s->world.tool_noise,
                            s->world.narm,
                            s->rgbd.distance,
                            s->rgbd.elevation,
                            s->rgbd.fov,
                            s->rgbd.width,
                            s->rgbd.height,
                            s->task.grasp_radius,
                            s->task.time_step};
    uint64_t hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    hash = om_hash(number, sizeof number, hash);
    hash = om_hash(scene, sizeof scene, hash);
    hash = om_hash(&c->grasp[grasp], sizeof c->grasp[grasp], hash);
    hash = om_hash(&c->lift[grasp], sizeof c->lift[grasp], hash);
    hash = om_hash(m->x, 3 * (size_t)m->nvert * sizeof *m->x, hash);
    return om_hash(held->vert, (size_t)held->nvert * sizeof *held->vert, hash);
}

void om__phantoms_truth_done(PhantomTruth* t) {
    if (!t) return;
    om_site_done(&t->site);
    om_tet_mesh_done(&t->mesh);
    om_surface_done(&t->surface);
    om_free(t->vert);
    om_free(t->head);
    memset(t, 0, sizeof *t);
}

static void place_surface(PhantomTruth* t) {
    for (int i = 0; i < t->surface.nvert; ++i)
        om_store3(t->surface.x, i, om_load3(t->x, t->vert[i]));
}

OmStatus om__phantoms_truth_open(const PhantomCase* c, int grasp, double coarse, const char* dir,
                                 bool* is_there, PhantomTruth* t) {
    memset(t, 0, sizeof *t);
    *is_there = false;
    char name[64];
    OmStatus status;
    OM_TRY_DONE(make_room(c, grasp, coarse, t));
    t->hash = hash_lift(c, grasp, t);
    om__phantoms_name(c, name, sizeof name);
    snprintf(t->file, sizeof t->file, "truth-%s-%d.bin", name, grasp + 1);
    *is_there = om__match_load_result(dir, t->file, t->hash, t->head, block_size(t));
    if (!*is_there) memset(t->head, 0, block_size(t));
    place_surface(t);
done:
    if (status < 0) om__phantoms_truth_done(t);
    return status;
}

OmStatus om__phantoms_truth_make(const PhantomCase* c, int grasp, int nworker, PhantomTruth* t) {
    OmStatus status = simulate(c, grasp, nworker, t);
    place_surface(t);
    return status < 0 ? om_error_prefix(status, "lift %d", grasp + 1) : OM_OK;
}

OmStatus om__phantoms_truth_save(const PhantomTruth* t, const char* dir) {
    return om__match_save_result(dir, t->file, t->hash, t->head, block_size(t));
}

OmStatus om__phantoms_observe(const PhantomTruth* t, int level, OmObservation* obs) {
    const PhantomMoment* at = &t->head->at[level];
    const size_t first = (size_t)level * t->npixel;
    return om__hand_show(at->time, at->arm, t->scene.world.narm, &t->head->camera, t->depth + first,
                         t->color + 3 * first, obs);
}
