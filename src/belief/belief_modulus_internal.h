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
};

#endif
