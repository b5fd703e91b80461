/// omentum/heuristic.h: the other fast models of the thesis, mass-spring networks (2.4.1) and ChainMail
/// (2.4.3), for comparison (floor 2).
///
/// Engine "springs" of tissue.h puts a spring on every edge of the tetrahedra, k = sum E V / l^2 over the
/// elements at the edge (Van Gelder 1998), and takes the implicit Euler steps, contact and statics of every
/// engine with a system matrix. Forces are newtons; Poisson's ratio is 1/4 whatever the material says, and
/// nothing keeps an element from turning inside out.
///
/// Engine "chainmail" moves vertices no farther than the links between them, the edges, ask for: each end may be
/// nearer to the other than at rest, farther from it or beside it by fractions of the link. Then links are
/// relaxed. It has no mass, weight or force, knows no rotation, and ends a step in a fixed number of operations.
///
///     OmTissueDef def = om_tissue_default_def(&mesh);
///     def.engine = "springs";
///     om_tissue_create(&def, &model);               // then as in tissue.h
///
///     OmChainDef chain = om_heuristic_default_chain();
///     def.engine = "chainmail", def.chain = &chain;
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

typedef struct OmChainDef {  // made by om_heuristic_default_chain; copied by om_tissue_create
    double stretch;   // of a link, by which an end may be farther along it, 0 to 10; default 0.1
    double compress;  // the same nearer, from 0 to below 1; default 0.1
    double shear;     // the same aside, 0 to 10; default 0.1
    // How far a vertex moves towards the mean of its neighbours in an iteration: 0 (not at all) to
    // 1 (default).
    double relaxation;
    int sweeps;       // of relaxation in a step, 0 to 1000; default 10
    uint32_t cookie;  // set by om_heuristic_default_chain
} OmChainDef;

/// Axes are those of space, so a link that is neither along nor across has a share of each limit: what a uniform
/// stretch and shear within the limits would do to it.
OM_API OmChainDef om_heuristic_default_chain(void);
/// By how much the link that is worst is beyond its limits at positions x (nvert x 3), along one axis, m; 0: all
/// links are kept, as after any step in which holds do not ask for more than the links between them have, or the
/// model is another engine's.
OM_API double om_heuristic_eval_excess(const OmTissueModel* model, const double* x);

#ifdef __cplusplus
}
#endif
#endif
