// pbd_step.c: a step: substeps of prediction, iterations of constraints, velocities from the way made.
//
// A team shares each stage in fixed blocks of particles or clusters and meets at barriers; no member adds to data that
// another wrote, so any number of workers gives the same bytes. All is Jacobi's scheme: clusters read
// positions, then every particle goes alpha of the way to the mean of its goals, to its spring's anchor
// and out of obstacles.
#include <string.h>

#include "pbd/pbd_internal.h"

#define SMALL 200  // elements of a colour, and 20 times as many members of clusters: worth sharing
#define NEWTON_FIRST 3  // of rotations, after a prediction
#define NEWTON_NEXT 1   // between iterations, which turn clusters by little
#define CALM_EVERY 4    // substeps between passes of that friction without contact
#define LOST_STEPS 2    // time of the friction that elements have by default, steps

typedef struct Range {
    int begin, end;
} Range;

static Range share_of(int n, int rank, int size) {
    return (Range){(int)((int64_t)n * rank / size), (int)((int64_t)n * (rank + 1) / size)};
}

static OmVec3 cut_speed(OmVec3 v, double max) {
    double largest = fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
    if (!isfinite(largest) || !om_is_finite3(v)) return om_vec3(0, 0, 0);
    OmVec3 u = om_scale(1 / largest, v);
    return om_scale(max / om_norm(u), u);
}

static inline OmVec3 limit_speed(OmVec3 v, double max) {
    return om_norm2(v) <= max * max ? v : cut_speed(v, max);
}

// ---- prediction -------------------------------------------------------------------------------------

// Where a prescribed vertex is at the end of the substep.
static OmVec3 prescribed_place(const OmPbdStep* s, int i) {
    int arm = om__state_held_by(s->s)[i];
    if (arm >= 0) return om_pose_apply(s->arm[arm], om_load3(om__state_array(s->s, OM__GRIP), i));
    OmVec3 p = om_load3(s->x, i), anchor = om_load3(om__state_array(s->s, OM__ANCHOR), i);
    int left = s->nsub - s->k;
    return left == 1 ? anchor : om_lerp(p, anchor, 1.0 / left);
}

// Returns the kinds of all particles of the range together.
static unsigned predict(OmPbdStep* s, Range r) {
    const OmPbdDef* def = &s->pbd->def;
    const double* f_ext = om__state_array(s->s, OM__F_EXT);
    const unsigned char* attached = om__state_attached(s->s);
    double rayleigh = def->kind != OM_PBD_CLUSTERS ? s->m->def.rayleigh_mass : 0;
    double drag = 1 / (1 + (def->damping + rayleigh) * s->sub);
    unsigned kinds = 0;
    int* prescribed = s->w->prescribed + r.begin;
    for (int i = r.begin; i < r.end; ++i) {
        OmVec3 p = om_load3(s->x, i);
        om_store3(s->w->begin, i, p);
        if (s->k == 0) om_store3(s->w->v_begin, i, om_load3(s->v, i));
        s->w->kind[i] = 0;
        s->w->give[i] = 0;
        if (om__is_prescribed(s->s, i)) {
            s->w->kind[i] = OM__PBD_PRESCRIBED;
            kinds |= OM__PBD_PRESCRIBED;
            *prescribed++ = i;
            om_store3(s->x, i, prescribed_place(s, i));
            continue;
        }
        OmVec3 a = om_madd(s->m->def.gravity, 1 / s->m->mass[i], om_load3(f_ext, i));
        // at rest all of the weight
        OmVec3 v = om_madd(om_scale(drag, om_load3(s->v, i)), s->sub, a);
        v = limit_speed(v, def->max_speed);
        om_store3(s->x, i, om_madd(p, s->sub, v));
        s->w->give[i] = 1 / s->m->mass[i];
        if (attached[i]) {  // by a spring, or it would be prescribed
            s->w->kind[i] |= OM__PBD_SPRING;
            om_store3(s->w->pull, i, om_vec3(0, 0, 0));
        }
        if (s->nobstacle > 0 && om__pbd_find_near(s, i)) s->w->kind[i] |= OM__PBD_NEAR;
        kinds |= s->w->kind[i];
    }
    if (prescribed < s->w->prescribed + r.end) *prescribed = -1;
    return kinds;
}

// ---- iterations -------------------------------------------------------------------------------------

// A spring to the anchor by its multiplier (Macklin et al. 2016): compliance 1 / k.
static void pull_to_anchor(OmPbdStep* s, int i) {
    // the stiffness is above 0: om__is_held_still is false
    double* pull = s->w->pull;
    double compliance = 1 / (om__state_stiffness(s->s)[i] * s->sub * s->sub);
    double give = 1 / s->m->mass[i];
    OmVec3 p = om_load3(s->x, i), anchor = om_load3(om__state_array(s->s, OM__ANCHOR), i);
    OmVec3 rest = om_madd(om_sub(anchor, p), -compliance, om_load3(pull, i));
    OmVec3 more = om_scale(1 / (give + compliance), rest);
    om_store3(pull, i, om_add(om_load3(pull, i), more));
    om_store3(s->x, i, om_madd(p, give, more));
}

// What acts on one particle alone.
static void act_alone(OmPbdStep* s, Range r, bool is_last) {
    const OmPbdWork* w = s->w;
    for (int i = r.begin; i < r.end; ++i) {
        if (w->kind[i] & OM__PBD_SPRING) pull_to_anchor(s, i);
        if (w->kind[i] & OM__PBD_NEAR) om__pbd_push_out(s, i, is_last);
    }
}

static void follow_clusters(OmPbdStep* s, Range r) {
    OmPbdWork* w = s->w;
    om__pbd_follow(&s->pbd->shape, w->map, s->m->mesh.x, s->pbd->def.cluster_stiffness, w->kind,
                   r.begin, r.end, s->x, w->way);
    double per_force = 1 / (s->sub * s->h);
    for (int n = r.begin; n < r.end && w->prescribed[n] >= 0; ++n) {
        int i = w->prescribed[n];
        OmVec3 hold = om_load3(w->hold, i);
        om_store3(w->hold, i, om_madd(hold, -s->m->mass[i] * per_force, om_load3(w->way, i)));
    }
}

static void match_shapes(OmPbdStep* s, OmTeam* team, int rank, int size, int n) {
    const OmPbd* pbd = s->pbd;
    Range batch = share_of(pbd->shape.nbatch, rank, size);
    om__pbd_match(&pbd->shape, pbd->def.linear_stretch, s->x, batch.begin, batch.end,
                  n == 0 ? NEWTON_FIRST : NEWTON_NEXT, s->turn, s->w->map);
    om_team_barrier(team);
    follow_clusters(s, share_of(s->m->mesh.nvert, rank, size));
}

typedef void (*ElementFn)(const OmPbdStep* s, int begin, int end);

static void visit_elements(OmPbdStep* s, OmTeam* team, int rank, int size, const int* color_adr,
                           ElementFn fn) {
    const OmPbdElastic* el = &s->pbd->elastic;
    for (int c = 0; c < el->ncolor; ++c) {
        Range r = share_of(color_adr[c + 1] - color_adr[c], rank, size);
        fn(s, color_adr[c] + r.begin, color_adr[c] + r.end);
        om_team_barrier(team);
    }
}

static void find_velocities(OmPbdStep* s, Range r) {
    double inverse = 1 / s->sub;
    for (int i = r.begin; i < r.end; ++i) {
        OmVec3 begin = om_load3(s->w->begin, i), way = om_sub(om_load3(s->x, i), begin);
        OmVec3 u = om_scale(inverse, way), v = limit_speed(u, s->pbd->def.max_speed);
        om_store3(s->v, i, v);
        if (om_norm2(v) != om_norm2(u) && !(s->w->kind[i] & OM__PBD_PRESCRIBED))
            om_store3(s->x, i, om_madd(begin, s->sub, v));
    }
}

// A light vertex of an element may have gained speed from heavy ones.
static void limit_velocities(OmPbdStep* s, Range r) {
    for (int i = r.begin; i < r.end; ++i)
        if (!(s->w->kind[i] & OM__PBD_PRESCRIBED))
            om_store3(s->v, i, limit_speed(om_load3(s->v, i), s->pbd->def.max_speed));
}

// ---- the step ---------------------------------------------------------------------------------------

static void begin_substep(OmPbdStep* s, int k) {
    s->k = k;
    double t = (k + 1.0) / s->nsub;
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const OmTissueArm* arm = &s->s->arm[a];
        s->arm[a] = om_pose_lerp(arm->pose, arm->goal, t);
    }
    om__pbd_move_obstacles(s);
}

static bool is_touching(const OmPbdStep* s, Range r) {
    for (int i = r.begin; i < r.end; ++i)
        if ((s->w->kind[i] & OM__PBD_NEAR) && s->w->normal_sum[i] > 0) return true;
    return false;
}

// Internal friction: in every substep with contact, where a blow is to be calmed; else in every fourth for all four.
static void calm_down(OmPbdStep* s, OmTeam* team, Range part, int rank, int size) {
    if (!(s->calm > 0)) return;
    int k = s->k;  // before others may go on to the next
    s->w->has_contact[rank] = is_touching(s, part);
    om_team_barrier(team);
    bool is_any = false;
    for (int r = 0; r < size; ++r) is_any |= s->w->has_contact[r];
    int left = k % CALM_EVERY + 1;
    if (!is_any && left < CALM_EVERY && k + 1 < s->nsub) return;
    OmPbdStep mine = *s;
    if (!is_any) mine.calm *= left;
    visit_elements(&mine, team, rank, size, s->pbd->elastic.batch_adr, om__pbd_calm_elements);
    limit_velocities(s, part);
    om_team_barrier(team);
}

// Who is near whom in this substep; the same answer for every member of the team: is there anyone?
static bool find_all_pairs(OmPbdStep* s, OmTeam* team, Range part, int rank, int size) {
    om_team_barrier(team);
    if (rank == 0) om__pbd_fill_grid(s);
    om_team_barrier(team);
    s->w->has_pairs[rank] = om__pbd_find_pairs(s, part.begin, part.end);
    om_team_barrier(team);
    bool is_any = false;
    for (int r = 0; r < size; ++r) is_any |= s->w->has_pairs[r];
    return is_any;
}

static void keep_apart(OmPbdStep* s, OmTeam* team, Range part) {
    om_team_barrier(team);
    om__pbd_find_shifts(s, part.begin, part.end);
    om_team_barrier(team);
    om__pbd_shift(s, part.begin, part.end);
}

static void run_step(void* ctx, OmTeam* team, int rank, int size) {
    OmPbdStep* s = ctx;
    const OmPbdDef* def = &s->pbd->def;
    Range part = share_of(s->m->mesh.nvert, rank, size);
    const OmPbdElastic* el = &s->pbd->elastic;
    Range element = share_of(el->ntet, rank, size);
    for (int k = 0; k < s->nsub; ++k) {
        if (rank == 0) begin_substep(s, k);
        om_team_barrier(team);
        bool has_alone = predict(s, part) & (OM__PBD_SPRING | OM__PBD_NEAR);
        bool has_pairs = s->pbd->has_pairs && find_all_pairs(s, team, part, rank, size);
        if (def->kind == OM_PBD_ELASTIC) {
            om_team_barrier(team);
            visit_elements(s, team, rank, size, el->batch_adr, om__pbd_start_elements);
            // so that a vertex in contact at rest is where its elements want it
            if (has_alone) act_alone(s, part, false);
        }
        if (def->kind == OM_PBD_LENGTHS)
            memset(s->w->lambda + 7 * (size_t)element.begin, 0,
                   7 * (size_t)(element.end - element.begin) * sizeof(double));
        for (int n = 0; n < def->iterations; ++n) {
            om_team_barrier(team);
            if (def->kind == OM_PBD_ELASTIC)
                visit_elements(s, team, rank, size, el->batch_adr, om__pbd_solve_elements);
            else if (def->kind == OM_PBD_LENGTHS)
                visit_elements(s, team, rank, size, el->color_adr, om__pbd_solve_lengths);
            else
                match_shapes(s, team, rank, size, n);
            if (has_pairs) keep_apart(s, team, part);
            if (has_alone) act_alone(s, part, n + 1 == def->iterations);
        }
        find_velocities(s, part);
        om_team_barrier(team);
        calm_down(s, team, part, rank, size);
    }
}

// Reaction of prescribed vertices: against clusters, weight, other forces, and for their acceleration.
static void report_holding(OmPbdStep* s) {
    double* f_tool = om__state_array(s->s, OM__F_TOOL);
    const double* f_ext = om__state_array(s->s, OM__F_EXT);
    for (int i = 0; i < s->m->mesh.nvert; ++i) {
        OmVec3 f = {0, 0, 0};
        if (om__is_prescribed(s->s, i)) {
            OmVec3 gain = om_sub(om_load3(s->v, i), om_load3(s->w->v_begin, i));
            OmVec3 a = om_sub(om_scale(1 / s->h, gain), s->m->def.gravity);
            f = om_madd(om_load3(s->w->hold, i), s->m->mass[i], a);
            f = om_sub(f, om_load3(f_ext, i));
        }
        om_store3(f_tool, i, f);
    }
}

static OmStatus check_input(const OmTissueState* s) {
    const double* f_ext = om__state_array(s, OM__F_EXT);
    for (int i = 0; i < s->nvert; ++i)
        OM_CHECK(om_is_finite3(om_load3(f_ext, i)), OM_INVALID,
                 "pbd: the external force on vertex %d is not finite", i);
    return OM_OK;
}

// Meeting at barriers would take longer than sharing the work saves; the bytes are the same.
static bool is_small(const OmPbd* pbd) {
    if (pbd->elastic.ntet > 0) return pbd->elastic.ntet < SMALL * pbd->elastic.ncolor;
    return pbd->shape.adr[pbd->shape.ncluster] < SMALL * 20;
}

static void set_friction(OmPbdStep* s) {
    double own = s->pbd->def.internal_friction, time = fmax(s->m->def.rayleigh_stiffness, own);
    s->is_viscous = own >= 0 || time > 0;
    if (!s->is_viscous) time = LOST_STEPS * s->h;
    s->calm = s->pbd->def.kind == OM_PBD_ELASTIC ? time * s->sub : 0;
}

OmStatus om__pbd_step(const OmTissueModel* m, OmTissueState* state, OmTissueWork* work, double h,
                      int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    const OmPbd* pbd = m->data;
    OmPbdWork* w = work->data;
    OM_TRY(check_input(state));
    OM_TRY(om__pbd_reserve(w, m->mesh.nvert, nobstacle));
    int nsub = om_pbd_substeps(m, h);
    OmPbdStep s = {.m = m,
                   .pbd = pbd,
                   .s = state,
                   .w = w,
                   .x = om__state_array(state, OM__X),
                   .v = om__state_array(state, OM__V),
                   .turn = om__state_engine(state),
                   .nobstacle = nobstacle,
                   .obstacle = obstacle,
                   .h = h,
                   .sub = h / nsub,
                   .nsub = nsub};
    set_friction(&s);
    size_t n3 = 3 * (size_t)m->mesh.nvert * sizeof(double);
    memset(w->hold, 0, n3);
    if (nobstacle > 0) memset(w->push, 0, n3 * (size_t)nobstacle);
    om_parallel_team(is_small(pbd) ? 1 : m->def.solver.nworker, run_step, &s);
    report_holding(&s);
    om__pbd_report_contacts(&s);
    for (int a = 0; a < OM_MAX_ARM; ++a) state->arm[a].pose = state->arm[a].goal;
    state->time += h;
    report->substeps = 1;
    return OM_OK;
}
