// belief_force.c: the twin's forces corrected by measured ones, where the arms measure force (open in thesis 7.1).
//
// Tools move the twin by position, and its pull grows with its stiffness. Where the arms measure force, the factor
// between the measured pull and the twin's is found by least squares over all ticks with enough force, and the twin's
// pull is multiplied by it wherever the loop uses a force. New attachments begin it anew: most of a difference may
// have been theirs.
//
// The measured pull itself, without its noise, counts where it is larger: tissue that is attached beside the grasp, and
// free in the belief, can look the same and pull 20 times as much, at less force in the twin than a factor needs.
//
// It is a factor of the force, not of the modulus: a lifted sheet bends under its weight, so that its pull is not
// proportional to the modulus. With a truth of 0.4 times the twin's modulus the small sheet of test_belief_force pulls
// with 0.84 of the twin's force. A factor that forgets with a time constant of 2 s was noisier and no faster.
#include "belief/belief_state.h"

#define MIN_FORCE 0.1    // N, measured and in the twin: below it noise of the sensor decides
#define MIN_TIME 1.0     // s of such force before the factor counts
#define MAX_FACTOR 4.0   // and 1 / MAX_FACTOR
#define TOLERANCE 0.1    // a factor nearer to 1 than this changes nothing
#define FILTER_TIME 0.3  // s, of a measured pull: of 0.5 N of noise 0.16 N are left

void om__force_reset(Belief* belief) { belief->force_sum = (ForceSum){0}; }

void om__force_add(Belief* belief, const OmObservation* obs, const OmBodyForces* twin) {
    ForceSum* s = &belief->force_sum;
    const double share = 1 - exp(-belief->task->time_step / FILTER_TIME);
    for (int a = 0; a < belief->act->narm; ++a) {
        if (!obs->arm[a].has_wrench || !om_body_is_holding(belief->twin, a)) {
            belief->felt[a] = om_vec3(0, 0, 0);
            continue;
        }
        // the load on the tip is the reaction to its grasp; the weight carried is the twin's
        OmVec3 weight = om_sub(twin->grasp[a], twin->pull[a]);
        OmVec3 pull = om_sub(om_scale(-1, obs->arm[a].force), weight);
        belief->felt[a] = om_madd(belief->felt[a], share, om_sub(pull, belief->felt[a]));
        if (om__cloud_draw_time(belief->act, a) > 0)
            continue;  // the twin's tissue is not at the tip yet
        if (om_norm(twin->pull[a]) < MIN_FORCE || om_norm(pull) < MIN_FORCE) continue;
        s->measured += om_dot(pull, twin->pull[a]);
        s->twin += om_dot(twin->pull[a], twin->pull[a]);
        s->time += belief->task->time_step;
    }
    if (s->time < MIN_TIME) return;
    const double factor = fmax(1 / MAX_FACTOR, fmin(MAX_FACTOR, s->measured / s->twin));
    belief->record->force_factor = fabs(factor - 1) > TOLERANCE ? factor : 1;
}
