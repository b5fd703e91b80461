// retract_register.h: the model and what the depth camera sees at rest (retract_register.c).
#ifndef OM_RETRACT_REGISTER_H
#define OM_RETRACT_REGISTER_H

#include "omentum/match.h"
#include "omentum/world.h"

// Whether the scene asks for that, and the world has a depth camera.
bool om__retract_registers(const OmScene* scene, const OmWorld* world);

// Move the twin's site, of which no body was made yet, by the rigid motion between the model and the depth camera's
// picture at rest, if om__retract_registers. A picture that fits, or that no small motion explains, leaves
// the site: the verdict says so.
// @return OM_OK; errors of om_world_observe, om_match_create and om_site_move
OmStatus om__retract_register(const OmScene* scene, OmWorld* world, OmSite* site,
                              OmMatchVerdict* verdict);

#endif
