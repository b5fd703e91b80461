/// omentum/heuristic.h: the other fast models of the thesis, mass-spring networks (2.4.1) and ChainMail
/// (2.4.3), for comparison (floor 2).
///
/// om_spring_engine, the engine "springs" of tissue.h, puts a spring on every edge of the tetrahedra, k = sum E V /
/// l^2 over the elements at the edge (Van Gelder 1998), and takes the implicit Euler steps, contact and statics of
/// every engine with a system matrix. Forces are in newtons. Poisson's ratio is 1/4 for any material, and elements may
/// invert.
///
/// om_chain_engine, the engine "chainmail", moves a vertex only if a link (an edge of the mesh) violates its limits:
/// the largest elongation, shortening and sideways displacement, as fractions of the rest length. Then all links are
/// relaxed. It has no mass, weight or force and no rotation; a step is a fixed number of operations.
///
///     OmTissueDef def = om_tissue_default_def(om_spring_engine(), &mesh);
///     om_tissue_create(&def, &model);               // then as in tissue.h
///
///     OmChainDef chain = om_chain_default_def();
///     def = om_tissue_default_def(om_chain_engine(), &mesh);
///     def.options = &chain;
#ifndef OMENTUM_HEURISTIC_H
#define OMENTUM_HEURISTIC_H

#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The engine "springs" of tissue.h. It has no options.
OM_API const struct OmTissueEngine* om_spring_engine(void);
/// The engine "chainmail". Options: OmChainDef, copied.
OM_API const struct OmTissueEngine* om_chain_engine(void);

typedef struct OmSpring {  // from the vertex in whose list it is
    int vert;              // its other end
    double stiffness;      // N/m
    double length;         // at rest, m
} OmSpring;

/// The springs of each vertex; a spring is listed at both of its ends. Vertex i has spring[adr[i]] to
/// spring[adr[i + 1] - 1], in ascending order of their other ends. Views, valid until the model is destroyed.
/// @return number of entries, twice the number of springs; 0 for a model of another engine
OM_API int om_heuristic_springs(const OmTissueModel* model, const int** adr,
                                const OmSpring** spring);

typedef struct OmChainDef {  // made by om_chain_default_def; copied by om_tissue_create
    double stretch;   // largest elongation of a link over its rest length, 0 to 10; default 0.1
    double compress;  // largest shortening over its rest length, from 0 to below 1; default 0.1
    double shear;     // largest sideways displacement over its rest length, 0 to 10; default 0.1
    // How far a vertex moves towards the mean of its neighbours in an iteration: 0 (not at all) to
    // 1 (default).
    double relaxation;
    int sweeps;       // of relaxation in a step, 0 to 1000; default 10
    OmCookie cookie;  // set by om_chain_default_def
} OmChainDef;

/// The limits hold along the axes of space. An oblique link gets a combination of them: the largest displacement that a
/// uniform stretch and shear within the limits would give it.
OM_API OmChainDef om_chain_default_def(void);
/// Largest violation of a link's limits along one axis at positions x (nvert x 3), m. 0 if no link violates its limits,
/// or for models of other engines. After a step it is 0 unless tools and attachments are farther apart than the links
/// between them allow.
OM_API double om_heuristic_eval_excess(const OmTissueModel* model, const double* x);

#ifdef __cplusplus
}
#endif
#endif
