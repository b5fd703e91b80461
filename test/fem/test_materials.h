// test_materials.h: one material of each law and volumetric term.
#ifndef OMENTUM_TEST_MATERIALS_H
#define OMENTUM_TEST_MATERIALS_H

#include "omentum/tissue_material.h"

static const OmMaterial every_law[] = {
    {.young = 3000, .poisson = 0.45, .law = OM_COROTATIONAL},
    {.young = 3000, .poisson = 0.45, .law = OM_LINEAR},
    {.young = 3000, .poisson = 0.45, .law = OM_ST_VENANT_KIRCHHOFF},
    {.young = 3000, .poisson = 0.45, .law = OM_NEO_HOOKEAN},
    {.young = 3000, .poisson = 0.45, .law = OM_STABLE_NEO_HOOKEAN},
    {.young = 3000, .poisson = 0.45, .law = OM_MOONEY_RIVLIN},
    {.young = 3000,
     .poisson = 0.45,
     .law = OM_MOONEY_RIVLIN,
     .volumetric = OM_VOLUME_LOG,
     .c10 = 400,
     .c01 = 117,
     .bulk = 9000},
    {.young = 3000,
     .poisson = 0.45,
     .law = OM_OGDEN,
     .volumetric = OM_VOLUME_MIXED,
     .nterm = 2,
     .ogden_mu = {700, -90},
     .ogden_alpha = {2.3, -4.1}},
    {.young = 3000, .poisson = 0.45, .law = OM_OGDEN, .volumetric = OM_VOLUME_LOG},
    {.young = 3000,
     .poisson = 0.45,
     .law = OM_OGDEN_COUPLED,
     .nterm = 1,
     .ogden_mu = {500},
     .ogden_alpha = {6.83},
     .bulk = 4000},
};
#define NLAW ((int)(sizeof every_law / sizeof *every_law))

#endif
