// world_damage.h: grasps that slip and attachments that tear; private to room world.
#ifndef OM_WORLD_DAMAGE_H
#define OM_WORLD_DAMAGE_H

#include "omentum/body.h"

typedef struct OmWorldDamage {  // om__world_damage_done frees
    double grip;                // N, largest force on jaws at goal 0; below 0: no grasp slips
    double* strength;           // N, of each vertex's attachment; null: nothing tears      (nvert)
    double* force;              // scratch                                              (nvert x 3)
    double* stiffness;          //                                                          (nvert)
    int* vert;                  //                                                          (nvert)
} OmWorldDamage;

OmStatus om__world_damage_init(const OmScene* scene, const OmSite* site, OmWorldDamage* damage);
void om__world_damage_done(OmWorldDamage* damage);
// After a step of the body: release grasps that slip, remove attachments that tear. All that changes is in the body's
// state. `closing`: of each arm, the factor by which its jaw closes harder than at goal 0.
OmStatus om__world_damage_step(const OmWorldDamage* damage, const double closing[OM_MAX_ARM],
                               OmBody* body);

#endif
