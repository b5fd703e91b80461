// belief_modulus_shape.c: Young's modulus of the twin from the shape of lifted tissue (ours; thesis 7.1).
//
// Tissue that is pulled up by a tool bends under its weight: how wide a part of it leaves the ground depends on the
// ratio of modulus and density, and the depth camera sees it. The motion since the grasp is repeated in two bodies of
// half and of twice the twin's modulus (belief_modulus.c). With u = log2 of the factor, the mean distance of the
// picture from the twin is a parabola through u = -1, 0 and 1, and its minimum within [-1, 1] is the estimate.
//
// It counts if the distance falls by a share MIN_FALL of what is above the distance before the grasp, so that noise
// does not move the modulus. Only pulls that no fold of the same grasp precedes: folded tissue drags over the ground,
// and friction changes its shape, too. Each pull corrects the estimate of the one before.
//
// A warning does not prevent an estimate: wrong attachments may pass for a wrong modulus, as in belief_modulus.c. What
// remains of the distance then still raises the warnings that lead to new attachments.
//
// The mean, not the median of Alg. 5: most of a sheet lies still, and its distance does not depend on the modulus.
#include "belief/belief_modulus_internal.h"

#define MIN_MEAN 1e-4  // m, mean distance above its rest that is worth an estimate
#define MIN_FALL 0.15  // of it
#define MIN_STEP 0.2   // in log2; a smaller change is not taken over

void om__modulus_note_pull(Belief* belief) {
    OmModulus* m = belief->modulus;
    const double way = om_distance(m->tick[m->n - 1].tip.p, m->shape_tip);
    const bool is_pull = belief->act->action.plan.verb == OM_PLAN_PULL && !belief->warn.has_dragged;
    m->is_shape_due = is_pull && m->nstep == 0 && way >= OM_MODULUS_MIN_WAY;
}

// Minimum in [-1, 1] of the parabola through (-1, low), (0, mid) and (1, high).
static double find_least(double low, double mid, double high, double* least) {
    const double slope = 0.5 * (high - low), bend = 0.5 * (high + low) - mid;
    double u = bend > 0 ? -0.5 * slope / bend : (high < low ? 1 : -1);
    u = fmax(-1, fmin(1, u));
    *least = mid + u * (slope + u * bend);
    return u;
}

OmStatus om__modulus_frame(Belief* belief, const OmObservation* obs) {
    OmModulus* m = belief->modulus;
    OmMonitorFrame f[2];
    if (!m || !m->is_shape_due) return OM_OK;
    m->is_shape_due = false;
    const OmMonitorFrame* now = &belief->frame;
    if (m->is_spent || now->is_stale || now->is_blind || now->mean < MIN_MEAN) return OM_OK;
    OmStatus status = om__modulus_repeat(m, belief->task->time_step);
    if (status != OM_OK) return status < 0 ? status : OM_OK;
    for (int k = 0; k < 2; ++k) {
        OM_TRY(om_monitor_try(belief->monitor, obs, om_body_x(m->other[k]), &f[k]));
        if (f[k].is_blind) return OM_OK;
    }
    double least;
    const double u = find_least(f[0].mean, now->mean, f[1].mean, &least);
    m->shape_tip = m->tick[m->n - 1].tip.p;
    om_log(OM_LOG_INFO,
           "modulus: mean distance %.2f, %.2f and %.2f mm for 0.5, 1 and 2; %.2f for %.2f",
           1e3 * f[0].mean, 1e3 * now->mean, 1e3 * f[1].mean, 1e3 * least, exp2(u));
    if (least > (1 - MIN_FALL) * now->mean || fabs(u) < MIN_STEP) return OM_OK;
    om__modulus_adopt(belief, u, true);
    return OM_OK;
}
