// belief_modulus.c: Young's modulus of the twin from measured pulls, where they disagree with the twin's (thesis 7.1).
//
// While one arm alone holds tissue, the twin's grasp pose and the measured load are recorded each tick, from a snapshot
// of the twin right after its grasp. After a pull or a fold the record is repeated in two bodies of half and of twice
// the present modulus. With u = log2 of the factor, the load of a tick is a parabola through -1, 0 and 1:
//
//     g(u) = g(0) + u (g(1) - g(-1)) / 2 + u^2 (g(1) - 2 g(0) + g(-1)) / 2
//
// and u is where the mean of |measured - g(u)|^2 over a stretch is least. Gravity and contact are part of the repeated
// motion, so that a pull that is not proportional to the modulus needs no correction.
//
// A stretch is the part of the record since the last estimate. Its estimate counts if
// - the loads disagree beyond noise: by MIN_FORCE and a share of the load, root mean square;
// - the modulus explains it: not more than MAX_LEFT of the disagreement remains;
// - u is inside its range;
// - the monitor, if there is one, has no warning.
// Two successive stretches of the same grasp must agree to SAME. A wrong attachment makes no difference until tissue
// beside it is lifted, and then a growing one: stretches disagree, or much of the disagreement remains.
//
// A twin that changes its attachments, or a second arm that grasps, ends the record until the next grasp.
#include "omentum/belief_modulus.h"

#include "belief/belief_modulus_internal.h"

#define MODULUS_COOKIE 0x0de1a571
#define MIN_TICK 20     // of a stretch
#define MIN_FORCE 0.05  // N, of the disagreement
#define MIN_SHARE 0.1   // the same, over the twin's load
#define MAX_LEFT 0.3    // of the disagreement, root mean square
#define SAME 0.4        // in log2: two estimates within a factor of 1.32
#define RANGE 2.0       // in log2, of one estimate by force
#define MAX_FACTOR 4.0  // of all, and 1 / MAX_FACTOR
#define MIN_STEP 0.05   // in log2; a smaller change is none
#define NSTEP 5         // in which the twin takes over a modulus
#define STEP_TIME 0.1   // s, of each

static const double other_factor[2] = {0.5, 2};

OmModulusDef om_modulus_default_def(const OmScene* scene, const OmSite* site) {
    return (OmModulusDef){.cookie = MODULUS_COOKIE, .scene = scene, .site = site};
}

static OmStatus set_others(OmModulus* m) {
    for (int k = 0; k < 2; ++k)
        OM_TRY(om_body_set_young(m->other[k], m->def.scene, m->factor * other_factor[k]));
    return OM_OK;
}

OmStatus om_modulus_create(const OmModulusDef* def, OmModulus** out) {
    *out = NULL;
    OM_CHECK(def->cookie == MODULUS_COOKIE, OM_INVALID, "OmModulusDef was not made by default_def");
    OM_CHECK(def->scene && def->site, OM_INVALID, "OmModulusDef.scene or site is null");
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(def->scene, OM_SITE_TWIN, &engine));
    const bool has_forces = om_engine_capabilities(engine) & OM_ENGINE_FORCES;
    const bool is_fit = has_forces && om_engine_uses(engine, "young");
    OM_CHECK(is_fit, OM_INVALID,
             "%s: update: modulus: the twin's engine \"%s\" has no forces in newtons or no Young's "
             "modulus; choose fem, or learn no modulus",
             om_scene_label(def->scene), engine->name);
    OmStatus status = OM_OK;
    OmModulus* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    m->def = *def;
    for (int k = 0; k < 2; ++k) OM_TRY_DONE(om_body_create(def->scene, def->site, 1, &m->other[k]));
    m->start = om_alloc(1, om_body_state_size(m->other[0]));
    if (!m->start) status = OM_NO_MEMORY;
    if (status < 0) goto done;
    OM_ALLOC_DONE(m->tick, OM_MODULUS_MAX_TICK);
    for (int k = 0; k < 2; ++k) OM_ALLOC_DONE(m->load[k], OM_MODULUS_MAX_TICK);
    *out = m;
    m = NULL;
done:
    om_modulus_destroy(m);
    return status;
}

void om_modulus_destroy(OmModulus* m) {
    if (!m) return;
    for (int k = 0; k < 2; ++k) {
        om_body_destroy(m->other[k]);
        om_free(m->load[k]);
    }
    om_free(m->start);
    om_free(m->tick);
    om_free(m);
}

OmStatus om__modulus_begin(OmModulus* m) {
    m->arm = -1;
    m->is_spent = false;
    m->n = m->begin = m->nstep = 0;
    m->last = NAN;
    m->factor = m->target = 1;
    return set_others(m);
}

// ---- the record ---------------------------------------------------------------------------------------------------

// The arm that alone holds tissue; -1: none, or both.
static int only_arm(const OmBody* twin) {
    const bool first = om_body_is_holding(twin, 0), second = om_body_is_holding(twin, 1);
    return first == second ? -1 : second;
}

static OmStatus take_step(Belief* belief) {
    OmModulus* m = belief->modulus;
    if (m->nstep == 0 || belief->act->time < m->step_due) return OM_OK;
    m->factor *= pow(m->target / m->factor, 1.0 / m->nstep);
    if (--m->nstep == 0) m->factor = m->target;
    m->step_due += STEP_TIME;
    OM_TRY(om_body_set_young(belief->twin, m->def.scene, m->factor));
    if (m->nstep > 0) return OM_OK;
    om__force_reset(belief);
    belief->record->force_factor = 1;
    const BeliefHost* host = &belief->host;
    if (host->on_young) OM_TRY(host->on_young(host->ctx, m->factor));
    return set_others(m);
}

// Begin a record with the twin's present state.
static void begin_record(Belief* belief, int arm) {
    OmModulus* m = belief->modulus;
    m->arm = arm;
    m->n = m->begin = 0;
    m->last = NAN;
    om_body_save(belief->twin, m->start);
}

OmStatus om__modulus_step(Belief* belief, const OmObservation* obs, const OmBodyForces* twin) {
    OmModulus* m = belief->modulus;
    if (!m) return OM_OK;
    OM_TRY(take_step(belief));
    const int arm = only_arm(belief->twin);
    if (!om_body_is_holding(belief->twin, 0) && !om_body_is_holding(belief->twin, 1)) {
        m->is_spent = false;
        m->arm = -1;
        return OM_OK;
    }
    const bool is_adopting = belief->adoption && om_match_adoption_is_active(belief->adoption);
    if (arm < 0 || is_adopting || (m->arm >= 0 && arm != m->arm)) m->is_spent = true;
    if (m->nstep > 0) m->is_spent = true;
    if (m->is_spent || om__cloud_draw_time(belief->act, arm) > 0) return OM_OK;
    if (!obs->arm[arm].has_wrench) return OM_OK;
    OmPose tip = om__twin_pose(belief->act, arm, obs->arm[arm].tip);
    tip.p = om_add(tip.p, belief->act->arm[arm].twin_off);
    if (m->arm < 0) {
        begin_record(belief, arm);
    } else if (m->n == OM_MODULUS_MAX_TICK) {
        m->is_spent = true;
    } else {
        m->tick[m->n++] = (ModulusTick){
            .tip = tip, .measured = om_scale(-1, obs->arm[arm].force), .twin = twin->grasp[arm]};
    }
    return OM_OK;
}

OmStatus om__modulus_tell_match(const Belief* belief) {
    const OmModulus* m = belief->modulus;
    return m && m->def.match ? om_match_set_young(m->def.match, m->target) : OM_OK;
}

void om__modulus_drop(Belief* belief) {
    if (belief->modulus) belief->modulus->is_spent = true;
}

// ---- estimates ----------------------------------------------------------------------------------------------------

// Repeat the record in a body; `load`: of the tool at each tick, N.
static OmStatus repeat_in(const OmModulus* m, OmBody* body, double dt, OmVec3* load) {
    OmBodyReport report;
    OmBodyForces forces;
    om_body_restore(body, m->start);
    for (int i = 0; i < m->n; ++i) {
        OM_TRY(om_body_move(body, m->arm, m->tick[i].tip));
        OM_TRY(om_body_step(body, dt, &report));
        OM_TRY(om_body_get_forces(body, &forces));
        load[i] = forces.grasp[m->arm];
    }
    return OM_OK;
}

// Mean square of measured less computed load over the stretch, N^2.
static double misfit(const OmModulus* m, double u) {
    double sum = 0;
    for (int i = m->begin; i < m->n; ++i) {
        const OmVec3 at = m->tick[i].twin, low = m->load[0][i], high = m->load[1][i];
        OmVec3 g = om_madd(at, 0.5 * u, om_sub(high, low));
        const OmVec3 bend = om_sub(om_add(high, low), om_scale(2, at));
        g = om_madd(g, 0.5 * u * u, bend);
        sum += om_norm2(om_sub(m->tick[i].measured, g));
    }
    return sum / (m->n - m->begin);
}

// Of the sensor, N^2: from differences of neighbouring ticks, between which a load changes little.
static double noise_of(const OmModulus* m) {
    double sum = 0;
    for (int i = m->begin + 1; i < m->n; ++i)
        sum += 0.5 * om_norm2(om_sub(m->tick[i].measured, m->tick[i - 1].measured));
    return sum / (m->n - m->begin - 1);
}

static double load_of(const OmModulus* m) {
    double sum = 0;
    for (int i = m->begin; i < m->n; ++i) sum += om_norm2(m->tick[i].twin);
    return sqrt(sum / (m->n - m->begin));
}

// u of the stretch; NAN: refused.
static double estimate(const OmModulus* m) {
    const double noise = noise_of(m), before = sqrt(fmax(0, misfit(m, 0) - noise));
    if (before < MIN_FORCE || before < MIN_SHARE * load_of(m)) return NAN;
    double best = 0, least = INFINITY;
    for (double u = -RANGE; u <= RANGE + 1e-9; u += 0.02) {
        const double e = misfit(m, u);
        if (e < least) least = e, best = u;
    }
    const double left = sqrt(fmax(0, least - noise));
    om_log(OM_LOG_INFO, "modulus: loads disagree by %.3f N; by a factor of %.2f: %.3f N", before,
           exp2(best), left);
    return left > MAX_LEFT * before || fabs(best) > RANGE - 0.03 ? (double)NAN : best;
}

static void adopt(Belief* belief, double u) {
    OmModulus* m = belief->modulus;
    const double target = fmax(1 / MAX_FACTOR, fmin(MAX_FACTOR, m->factor * exp2(u)));
    if (fabs(log2(target / m->factor)) < MIN_STEP) return;  // it is at its bound
    m->target = target;
    m->nstep = NSTEP;
    m->step_due = belief->act->time;
    m->is_spent = true;  // the record has loads of the modulus before
    ++belief->record->nmodulus;
    belief->record->young_factor = m->target;
    om__belief_forget_exposure(belief);
}

OmStatus om__modulus_learn(Belief* belief) {
    OmModulus* m = belief->modulus;
    if (!m || m->arm < 0 || m->is_spent || m->n - m->begin < MIN_TICK) return OM_OK;
    const double way = om_distance(m->tick[m->n - 1].tip.p, m->tick[m->begin].tip.p);
    if (way < OM_MODULUS_MIN_WAY) return OM_OK;
    for (int k = 0; k < 2; ++k)
        OM_TRY(repeat_in(m, m->other[k], belief->task->time_step, m->load[k]));
    if (belief->host.on_pause) belief->host.on_pause(belief->host.ctx);
    const double u = belief->warn.state > 0 ? (double)NAN : estimate(m), last = m->last;
    m->last = u;
    m->begin = m->n;
    if (fabs(u - last) < SAME) adopt(belief, 0.5 * (u + last));
    return OM_OK;
}
