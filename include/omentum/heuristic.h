/// omentum/heuristic.h: the other fast models of the thesis, mass-spring networks (2.4.1) and ChainMail
/// (2.4.3), for comparison (floor 2).
///
/// Engine "springs" of tissue.h puts a spring on every edge of the tetrahedra, k = sum E V / l^2 over the
/// elements at the edge (Van Gelder 1998), and takes the implicit Euler steps, contact and statics of every
/// engine with a system matrix. Forces are newtons; Poisson's ratio is 1/4 whatever the material says, and
/// nothing keeps an element from turning inside out.
///
///     OmTissueDef def = om_tissue_default_def(&mesh);
///     def.engine = "springs";
///     om_tissue_create(&def, &model);               // then as in tissue.h
#ifndef OMENTUM_HEURISTIC_H
#define OMENTUM_HEURISTIC_H

#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmSpring {  // from the vertex in whose list it is
    int vert;              // its other end
    double stiffness;      // N/m
    double length;         // at rest, m
} OmSpring;

/// The springs of each vertex, every one listed at both of its ends: those of vertex i are spring[adr[i]] to
/// spring[adr[i + 1] - 1], their other ends ascending. Views, valid as long as the model.
/// @return entries of the list, twice the springs; 0 if the model is another engine's
OM_API int om_heuristic_springs(const OmTissueModel* model, const int** adr,
                                const OmSpring** spring);

#ifdef __cplusplus
}
#endif
#endif
