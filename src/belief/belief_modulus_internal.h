// belief_modulus_internal.h: the record of a grasp, and the bodies in which it is repeated.
#ifndef OMENTUM_BELIEF_MODULUS_INTERNAL_H
#define OMENTUM_BELIEF_MODULUS_INTERNAL_H

#include "belief/belief_state.h"
#include "omentum/belief_modulus.h"

#define OM_MODULUS_MAX_TICK 1000  // of a record
#define OM_MODULUS_MIN_WAY 0.008  // m that the tip moves between two estimates

typedef struct ModulusTick {
    OmPose tip;             // of the twin's grasp
    OmVec3 measured, twin;  // N, force of the tool on the tissue
    bool has_force;         // measured
} ModulusTick;

struct OmModulus {
    OmModulusDef def;
    OmBody* other[2];   // of half and of twice the modulus
    void* start;        // of the twin, after the grasp
    ModulusTick* tick;  // (OM_MODULUS_MAX_TICK)
    OmVec3* load[2];    // N, of the other bodies, at each tick  (OM_MODULUS_MAX_TICK)
    int arm;            // of the record; -1: none
    bool is_spent;      // no record until all arms have released
    int n, begin;       // ticks; the stretch begins at the second
    double last;        // u of the stretch before; NAN: none
    double factor, target;
    int nstep;        // left until the target
    double step_due;  // s of the operation
    // by shape
    bool is_shape_due;  // a pull has ended: the next picture
    OmVec3 shape_tip;   // m, where the last estimate was made, or the grasp
};

/// Repeat the record in the bodies of half and of twice the modulus, from the twin's state after the grasp.
/// @return OM_OK; OM_NOT_CONVERGED (the last step of one did not: do not use the shapes); the errors of a step
OmStatus om__modulus_repeat(OmModulus* modulus, double time_step);
/// The twin takes over its present modulus times 2^u, in steps.
void om__modulus_adopt(Belief* belief, double u, bool by_shape);
/// After a pull: the next picture is compared.
void om__modulus_note_pull(Belief* belief);

#endif
