// rl_retract.c: the task "retract": its definition, its settings as text, and its constant part.
//
// Method: thesis 5.2-5.4. The scene was fixed before any policy was trained; doc/notes/rl.md has TE by grasping place.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"
#include "rl/rl_retract_internal.h"

#define COOKIE 0x4e712ac7u
#define ELEMENT_SIDE 10  // cells along a side, of quadratic elements
#define FIXED_ROWS 2     // of particles, at the fixed side
#define FIXED_X 0.018    // m, the fixed side of the flat sheet
#define DROP 0.001       // m, of the fat above the kidney before it falls
#define RADIUS 0.0015    // m, of a particle: half of its diameter of 3 mm (5.4.1)
#define TARGET_CLEAR 0.001
#define STEP_COST 0.002  // of reward (b)
#define FRICTION 0.35    // of fat, Table 3.1
// N, of the weakest grasper of a da Vinci (double fenestrated; Mucksavage et al. 2011, J. Endourology 25, 523-528).
#define GRIP 2.26

OmRlRetractDef om_rl_retract_default_def(void) {
    OmRlRetractDef def = {
        .thickness = 0.003,
        .cluster_spacing = 0.0120,
        .cluster_radius = 0.0149,
        .cluster_stiffness = 1,
        .young = 20000,
        .poisson = 0.45,
        .density = 1000,
        .kidney = {.center = {-0.008, 0, 0.022}, .half = {0.030, 0.055, 0.022}, .bend = 4},
        .kidney_label = 3,
        .tumour_x = -0.020,
        .tumour_radius = 0.008,
        .target = {0.000, 0, 0.095},
        .workspace_lo = {-0.085, -0.055, 0.002},
        .workspace_hi = {0.025, 0.055, 0.110},
        .instrument = OM_LARGE_NEEDLE_DRIVER,
        .picture_width = 84,
        .picture_height = 84,
        .goal_along = 0.075,
        .max_step = 2500,
        .hold = 10,
        .repeat = 1,
        .move = 0.0005,
        .time_step = 0.02,
        .grasp_radius = 0.005,
        .reach = 0.002,
        .start_height = 0.012,
        .reward = OM_RL_REWARD_EXPOSE,
        .step_cost = STEP_COST,
        .nvariant = 1,
        .cookie = COOKIE,
    };
    OmVec3 look = om_vec3(-0.020, 0, 0.040);
    double distance = 0.2, up = 40 * OM_PI / 180;
    OmVec3 eye = om_add(look, om_vec3(-distance * cos(up), 0, distance * sin(up)));
    def.endoscope = (OmCamera){.pose_world_camera = om_pose_look_at(eye, look, om_vec3(0, 0, 1)),
                               .width = 480,
                               .height = 480,
                               .fov = 45 * OM_PI / 180,
                               .near_m = 0.01,
                               .far_m = 2};
    return def;
}

void om__rl_retract_use_reality(OmRlRetractDef* def) {
    def->tissue = OM_RL_ELEMENTS;
    def->young *= 0.8;
    def->thickness *= 0.9;
    def->kidney_shift = om_vec3(0.0016, 0.0012, 0);
    def->tip_error = 0.0017;
    def->camera_noise = 4;
    def->slip_force = FRICTION * GRIP;
}

// ---- the definition ---------------------------------------------------------------------------------

static OmStatus check_def(const OmRlRetractDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "rl retract: the definition was not made by om_rl_retract_default_def");
    OM_TRY(om__rl_retract_check_numbers(d));
    OM_CHECK(
        d->max_step >= 1 && d->hold >= 1 && d->repeat >= 1 && d->repeat <= 100, OM_INVALID,
        "rl retract: max_step is %d, hold %d, repeat %d; all must be at least 1, repeat at most 100",
        d->max_step, d->hold, d->repeat);
    OM_CHECK(d->npoint >= 0 && d->npoint <= OM_RL_MAX_POINT, OM_INVALID,
             "rl retract: npoint is %d; it must be from 0 to %d", d->npoint, OM_RL_MAX_POINT);
    OM_CHECK(d->picture_width >= 8 && d->picture_width <= 1024 && d->picture_height >= 8 &&
                 d->picture_height <= 1024,
             OM_INVALID, "rl retract: a picture of %d x %d pixels; sides must be from 8 to 1024",
             d->picture_width, d->picture_height);
    OM_CHECK(!d->has_picture || d->npoint == 0, OM_INVALID,
             "rl retract: the observation is a picture, so npoint must be 0, not %d", d->npoint);
    OM_CHECK(d->still >= 0, OM_INVALID, "rl retract: still is %d; it must be 0 or more", d->still);
    OM_CHECK(
        d->slip_force == 0 || d->tissue == OM_RL_ELEMENTS, OM_INVALID,
        "rl retract: slip_force (slip_n) is %g N, but clusters have no forces: set tissue=elements, or 0",
        d->slip_force);
    OM_CHECK(d->nvariant >= 1 && d->nvariant <= OM_RL_MAX_VARIANT, OM_INVALID,
             "rl retract: nvariant is %d; it must be from 1 to %d", d->nvariant, OM_RL_MAX_VARIANT);
    OmVec3 lo = d->workspace_lo, hi = d->workspace_hi, p = d->target;
    OM_CHECK(lo.x < hi.x && lo.y < hi.y && lo.z < hi.z, OM_INVALID,
             "rl retract: the corners of the workspace are in the wrong order");
    OM_CHECK(p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z,
             OM_INVALID, "rl retract: the target (%g, %g, %g) m is outside the workspace", p.x, p.y,
             p.z);
    OmVec3 half = d->kidney.half;
    OM_CHECK(half.x >= 0.01 && half.y >= 0.01 && half.z >= 0.01 && half.x <= 0.1 && half.y <= 0.1 &&
                 half.z <= 0.1 && fabs(d->kidney.bend) <= 10,
             OM_INVALID,
             "rl retract: the kidney's half-axes must be from 0.01 to 0.1 m, and its bend "
             "from -10 to 10 1/m");
    return OM_OK;
}

// ---- tissue -----------------------------------------------------------------------------------------

// Flat, above the kidney, its fixed side at FIXED_X.
static OmStatus make_mesh(const OmRlRetract* t, OmTetMesh* mesh, double* volume) {
    const OmRlRetractDef* d = &t->def;
    double z = d->kidney.center.z + d->kidney.half.z + DROP + 0.5 * d->thickness;
    double r = 0.5 * OM__RL_LENGTH;
    OmVec3 middle = om_vec3(FIXED_X - r, 0, z);
    if (d->tissue == OM_RL_CLUSTERS) {
        OM_TRY(om_pbd_sample_sheet(OM__RL_LENGTH, OM__RL_LENGTH, d->thickness,
                                   OM__RL_LENGTH / OM__RL_SIDE, mesh, volume));
        for (int i = 0; i < mesh->nvert; ++i)
            om_store3(mesh->x, i, om_add(middle, om_load3(mesh->x, i)));
    } else {
        OmVec3 half = om_vec3(r, r, 0.5 * d->thickness);
        OM_TRY(om_tet_mesh_box(om_sub(middle, half), om_add(middle, half), ELEMENT_SIDE,
                               ELEMENT_SIDE, 1, mesh));
    }
    int nfixed = 0, *fixed = om_alloc((size_t)mesh->nvert, sizeof *fixed);
    if (!fixed) return OM_NO_MEMORY;
    double from = FIXED_X - OM__RL_LENGTH * FIXED_ROWS / OM__RL_SIDE - 1e-9;
    for (int i = 0; i < mesh->nvert; ++i)
        if (mesh->x[3 * (size_t)i] >= from) fixed[nfixed++] = i;
    OmStatus status = om_tet_mesh_add_set(mesh, "attachment", fixed, nfixed);
    om_free(fixed);
    return status;
}

static OmStatus make_tissue(OmRlRetract* t) {
    const OmRlRetractDef* d = &t->def;
    OmTetMesh mesh = {0};
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    OmStatus status = make_mesh(t, &mesh, &pbd.particle_volume);
    bool is_pbd = d->tissue == OM_RL_CLUSTERS;
    if (status == OM_OK) {
        OmTissueDef def = om_tissue_default_def(is_pbd ? om_pbd_engine() : om_fem_engine(), &mesh);
        pbd.cluster_spacing = d->cluster_spacing;
        pbd.cluster_radius = d->cluster_radius;
        pbd.cluster_stiffness = d->cluster_stiffness;
        pbd.has_self_collision = d->has_self_collision;
        if (is_pbd) def.options = &pbd;
        def.material_default =
            (OmMaterial){.young = d->young, .poisson = d->poisson, .law = OM_STABLE_NEO_HOOKEAN};
        def.density = d->density;
        def.rayleigh_stiffness = is_pbd ? 0 : 0.01;
        def.solver.nworker = 1;
        status = om_tissue_create(&def, &t->tissue);
    }
    om_tet_mesh_done(&mesh);
    if (status != OM_OK) return status;
    t->nvert = om_tissue_mesh(t->tissue)->nvert;
    // particles keep the collision distance from the distance that the ground gives
    t->ground.shift = is_pbd ? pbd.collision_distance - 0.5 * d->thickness : 0;
    OmTissueObstacle ground = om_field_obstacle(om__rl_ground_distance, &t->ground);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &ground;
    if (!is_pbd) contact.friction = contact.self_friction = FRICTION;
    contact.self_contact = !is_pbd && d->has_self_collision;
    return om_contact_create(&contact, t->tissue, &t->contact);
}

// ---- the robot, behind the kidney ------------------------------------------------------------------

OmStatus om__rl_place_psm(const OmRlRetractDef* def, double side, OmPsm* psm, OmQuat* tip_q) {
    OmVec3 rcm = om_vec3(0.040, side * 0.050, 0.158), lo = def->workspace_lo,
           hi = def->workspace_hi;
    OmPose base = om_pose_look_at(rcm, om_lerp(lo, hi, 0.5), om_vec3(0, 0, 1));
    // at zero the shaft points along -z of the base
    base.q = om_quat_mul(base.q, om_quat_axis_angle(om_vec3(1, 0, 0), OM_PI));
    *psm = om_psm_default(def->instrument, base);
    if (def->instrument_file) OM_TRY(om_psm_load_instrument(def->instrument_file, psm));
    double q[OM_PSM_NJOINT] = {0, 0, 0.12, 0, 0, 0};
    *tip_q = om_psm_forward(psm, q).q;
    for (int k = 0; k < 8; ++k) {
        OmPose tip = {om_vec3(k & 1 ? hi.x : lo.x, k & 2 ? hi.y : lo.y, k & 4 ? hi.z : lo.z),
                      *tip_q};
        OM_TRY(om_psm_inverse(psm, tip, q, q));
    }
    return OM_OK;
}

// ---- the constant part ------------------------------------------------------------------------------

static int find_vertex(const OmRlRetract* t, double along, double across) {
    const double* x = om_tissue_mesh(t->tissue)->x;
    int best = 0;
    double least = INFINITY;
    for (int i = 0; i < t->nvert; ++i) {
        double d = hypot(t->fixed_x - x[3 * (size_t)i] - along, x[3 * (size_t)i + 1] - across);
        if (d < least) least = d, best = i;
    }
    return best;
}

OmVec3 om__rl_rest_place(const OmRlRetract* t, double along, double across) {
    return om_load3(t->rest_x, find_vertex(t, along, across));
}

// What follows from the fat at rest.
static OmStatus use_rest(OmRlRetract* t) {
    const OmRlRetractDef* d = &t->def;
    t->goal_along = d->goal_along;
    t->goal = om__rl_rest_place(t, d->goal_along, 0);
    t->fat_lo = om_vec3(INFINITY, INFINITY, INFINITY), t->fat_hi = om_scale(-1, t->fat_lo);
    for (int i = 0; i < t->nvert; ++i) {
        t->fat_lo = om_min3(t->fat_lo, om_load3(t->rest_x, i));
        t->fat_hi = om_max3(t->fat_hi, om_load3(t->rest_x, i));
    }
    for (int k = 0; k < d->npoint; ++k) {  // spread over the sheet
        double u = (k + 0.5) / d->npoint, v = fmod(0.5 + 0.6180339887498949 * k, 1);
        t->point_vert[k] = find_vertex(t, OM__RL_LENGTH * u, OM__RL_LENGTH * (v - 0.5));
    }
    double* pixel;
    OM_ALLOC(pixel, 3 * (size_t)t->nvert);
    t->rest_exposure = om__rl_exposure(t, t->rest_x, pixel);
    om_free(pixel);
    return OM_OK;
}

static const OmRlKey keys[] = {OM__RL_RIGHT_HAND("", 0, 1, 2),
                               OM__RL_LEFT_HAND("", 0, 1, 2),
                               {'g', 3, 1, "close the gripper"},
                               {'b', 3, 0, "open the gripper"}};
enum { NKEY = sizeof keys / sizeof *keys, NGRIPPER_KEY = 2 };

static void fill_head(OmRlRetract* t) {
    static const char* const info[] = {"exposure", "grasped",  "along", "across",
                                       "slips",    "inverted", "force"};
    const OmRlRetractDef* d = &t->def;
    OmRlTask* h = &t->head;
    h->ops = &om__rl_retract_ops;
    strcpy(h->name, "retract");
    h->nobservation = 12 + 3 * d->npoint;
    h->obs_lo = -OM__RL_FAR;
    h->obs_hi = OM__RL_FAR;
    if (d->has_picture) {
        h->obs_lo = 0;
        h->obs_hi = 1;
        h->picture_width = d->picture_width;
        h->picture_height = d->picture_height;
        h->nobservation = (int)om__rl_picture_size(t);
    }
    h->naction = d->has_gripper ? 4 : 3;
    for (int k = 0; k < 3; ++k) h->nchoice[k] = 3;
    h->nchoice[3] = d->has_gripper ? 2 : 0;
    h->max_step = (d->max_step + d->repeat - 1) / d->repeat;
    h->nstart = OM_RL_GRID * OM_RL_GRID;
    h->ninfo = sizeof info / sizeof *info;
    for (int k = 0; k < h->ninfo; ++k) h->info_name[k] = info[k];
    h->score_name = info[0];
    h->target = 0.95;
    h->key = keys;
    h->nkey = NKEY - (d->has_gripper ? 0 : NGRIPPER_KEY);
    h->rest[3] = -1;
    h->period = d->time_step * d->repeat;
    h->move = d->move * d->repeat;
    h->has_jaw = d->has_gripper;
    const OmVec3 lo = om_scale(1e3, d->workspace_lo), hi = om_scale(1e3, d->workspace_hi);
    snprintf(
        h->meaning, sizeof h->meaning,
        "move_mm=%.6g repeat=%d points=%d picture=%dx%d workspace_mm=%.6g:%.6g,%.6g:%.6g,%.6g:%.6g",
        1e3 * d->move, d->repeat, d->npoint, h->picture_width, h->picture_height, lo.x, hi.x, lo.y,
        hi.y, lo.z, hi.z);
    // the rest state depends on every setting of the scene; the others are added
    uint64_t hash = om_hash(t->rest_x, 3 * (size_t)t->nvert * sizeof *t->rest_x, OM_HASH_SEED);
    double own[] = {d->max_step,     d->hold,        d->has_fixed_horizon,
                    d->repeat,       d->has_gripper, d->move,
                    d->time_step,    d->reach,       d->start_height,
                    d->reward,       d->npoint,      d->target.x,
                    d->target.y,     d->target.z,    d->tip_error,
                    d->camera_noise, t->q.x,         t->q.y,
                    t->q.z,          d->goal_along,  d->cluster_stiffness};
    h->hash = om_hash(own, sizeof own, hash);
    if (d->step_cost != STEP_COST) h->hash = om_hash(&d->step_cost, sizeof d->step_cost, h->hash);
    if (d->margin > 0) h->hash = om_hash(&d->margin, sizeof d->margin, h->hash);
    if (d->slip_force > 0) h->hash = om_hash(&d->slip_force, sizeof d->slip_force, h->hash);
    if (d->still > 0) h->hash = om_hash(&d->still, sizeof d->still, h->hash);
    // a state with kinematics alone has the hash that it had before there were pictures
    if (d->has_picture)
        h->hash = om_hash((int[2]){d->picture_width, d->picture_height}, 2 * sizeof(int), h->hash);
}

static OmStatus make_ground(OmRlRetract* t) {
    OmSurface surface = {0};
    OmRlKidney kidney;
    OmVec3 shift = t->def.kidney_shift;
    if (!t->def.kidney_file) {
        kidney = t->def.kidney;
        kidney.center = om_add(kidney.center, shift);
        return om__rl_ground_init(&kidney, &t->ground);
    }
    OM_TRY(om__rl_kidney_load(&t->def, &surface, &kidney));
    om__rl_kidney_use(&kidney, &t->def);
    t->def.kidney_file = NULL;
    kidney.center = om_add(kidney.center, shift);
    for (int i = 0; i < surface.nvert; ++i)
        om_store3(surface.x, i, om_add(om_load3(surface.x, i), shift));
    OmStatus status = om__rl_ground_init_surface(&surface, &kidney, &t->ground);
    om_surface_done(&surface);
    return status;
}

static OmStatus fill(OmRlRetract* t) {
    const OmRlRetractDef* d = &t->def;
    t->fixed_x = FIXED_X;
    t->d_max = om_distance(d->workspace_lo, d->workspace_hi);
    OM_TRY(make_ground(t));
    OM_TRY(make_tissue(t));
    OmVec3 n;
    t->true_q = om__rl_ground_top(&t->ground, d->tumour_x + d->kidney_shift.x,
                                  d->tumour_y + d->kidney_shift.y, &n);
    t->q = om_sub(t->true_q, d->kidney_shift);
    OM_TRY(om__rl_place_psm(d, -1, &t->psm, &t->tip_q));
    t->def.instrument_file = NULL;
    OM_TRY(om__rl_settle(t));
    OM_TRY(om__rl_view_init(t));
    OM_TRY(use_rest(t));
    fill_head(t);
    return OM_OK;
}

void om__rl_retract_destroy(OmRlTask* task) {
    OmRlRetract* t = (OmRlRetract*)task;
    if (!t) return;
    om__rl_view_done(t);
    om_contact_destroy(t->contact);
    om_tissue_destroy(t->tissue);
    om__rl_ground_done(&t->ground);
    om_free(t->rest);
    om_free(t->rest_x);
    om_free(t);
}

OmStatus om_rl_retract_create(const OmRlRetractDef* def, OmRlTask** task) {
    *task = NULL;
    OM_CHECK(def, OM_INVALID, "rl retract: the definition is null");
    OM_TRY(check_def(def));
    if (def->nvariant > 1) {
        OM_TRY(om__rl_varied_create(def, task));
        om__rl_retract_print(def, *task);
        return OM_OK;
    }
    OmRlRetract* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->def = *def;
    OmStatus status = fill(t);
    if (status < 0) {
        om__rl_retract_destroy(&t->head);
        return status;
    }
    *task = &t->head;
    om__rl_retract_print(def, *task);
    return OM_OK;
}
