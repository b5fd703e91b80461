/// omentum/defras_modulus.h: the twin's Young's modulus, learnt from measured pulls (floor 7; open in thesis 7.1).
///
/// Where the arms measure force, the load on held tissue is compared with the twin's at the same motion of the tool.
/// Where they disagree, the motion since the grasp is repeated in two bodies of half and of twice the twin's modulus,
/// and the modulus that explains the measured load is found between them. Two successive stretches of motion must
/// agree. The twin then takes it over within 0.5 s. The effect of wrong attachments on a load is not that of one
/// modulus in both stretches, and is refused (defras_modulus.c).
///
///     OmModulusDef def = om_modulus_default_def(&scene, &twin_site);
///     OmModulus* modulus;   om_modulus_create(&def, &modulus);
///     loop_def.modulus = modulus;  ...  om_modulus_destroy(modulus);      // after the loop
#ifndef OMENTUM_DEFRAS_MODULUS_H
#define OMENTUM_DEFRAS_MODULUS_H

#include "omentum/body.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmModulusDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed until destroy
    const OmSite* site;    // of the twin; borrowed until destroy
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
