/// omentum/belief_modulus.h: the twin's Young's modulus, learnt from measured forces (floor 6; open in thesis 7.1).
///
/// Where the arms measure force, the load on held tissue is compared with the twin's at the same motion of the tool,
/// and with that of bodies of half and of twice its modulus. Two successive stretches of motion must agree. The effect
/// of wrong attachments on a load is not that of one modulus in both stretches, and is refused (belief_modulus.c).
///
/// The twin takes the modulus over within 0.5 s.
///
///     OmModulusDef def = om_modulus_default_def(&scene, &twin_site);
///     OmModulus* modulus;   om_modulus_create(&def, &modulus);
///     loop_def.modulus = modulus;  ...  om_modulus_destroy(modulus);      // after the loop
#ifndef OMENTUM_BELIEF_MODULUS_H
#define OMENTUM_BELIEF_MODULUS_H

#include "omentum/body.h"
#include "omentum/match.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmModulusDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed until destroy
    const OmSite* site;    // of the twin; borrowed until destroy
    // Computes the loop's estimates of attachments; it is given the learnt modulus before each. Borrowed; null: none.
    OmMatch* match;
} OmModulusDef;

OM_API OmModulusDef om_modulus_default_def(const OmScene* scene, const OmSite* site);

/// The record of a grasp, and two bodies; for one loop at a time. The loop's twin must be of om_body_create.
typedef struct OmModulus OmModulus;

/// @return OM_OK; OM_INVALID (a field, or an engine without forces or without a modulus); OM_NO_MEMORY
OM_API OmStatus om_modulus_create(const OmModulusDef* def, OmModulus** modulus);
OM_API void om_modulus_destroy(OmModulus* modulus);

#ifdef __cplusplus
}
#endif
#endif
