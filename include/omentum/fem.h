/// omentum/fem.h: the finite element engine (floor 2).
///
/// Linear tetrahedra with corotational linear elasticity (Mueller and Gross 2004; thesis 6.4.7): the rotation
/// of each element by a proper polar decomposition, also where it is flat or inverted; lumped masses.
/// Behind the interface of tissue.h:
///
///     OmTissueDef def = om_tissue_default_def(om_fem_engine(), &mesh);
#ifndef OMENTUM_FEM_H
#define OMENTUM_FEM_H

#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

OM_API const OmTissueEngine* om_fem_engine(void);

#ifdef __cplusplus
}
#endif
#endif
