// fem_internal.h: what the files of the room share.
//
// Elements are worked on in batches of OM__LANE, struct of arrays, one element a lane (the last batch
// repeats its last element with zero volume). A step's first pass goes over batches and leaves, an
// element, the gradients of its shape functions turned with it and its stress; the second goes over
// vertices and gathers from their elements a row of A and of b. No atomics, no colours, same bytes always.
#ifndef OMENTUM_FEM_INTERNAL_H
#define OMENTUM_FEM_INTERNAL_H

#include "base/base_multiversion.h"
#include "fem/fem_principal.h"
#include "tissue/tissue_engine.h"

// Inlined into each clone of a multiversioned function, so that it is compiled for its processor.
#if defined(__GNUC__)
#define OM__INLINE static inline __attribute__((always_inline))
#else
#define OM__INLINE static inline
#endif

#define OM__LANE 16
#define OM__TURNED 28   // floats an element leaves for the second pass
#define OM__BLOCKED 68  // the same where a law is not corotational

typedef enum OmFemFamily {  // how the first pass computes a batch
    OM__FAMILY_TURNED,      // corotational, as is every element of the model
    OM__FAMILY_NEO,
    OM__FAMILY_STABLE,
    OM__FAMILY_VENANT,
    OM__FAMILY_OTHER  // lane by lane: other laws, or not all the same
} OmFemFamily;

typedef struct OmFemBatch {
    int vert[4][OM__LANE];       // vertices
    float grad[9][OM__LANE];     // shape gradients of vertices 1, 2, 3 at rest, 1/m
    float root[OM__LANE];        // sqrt(V mu); zero in lanes that only fill up
    float ratio[OM__LANE];       // lambda / mu
    float per_volume[OM__LANE];  // 1 / (6 V): with the product of three edges, det F
    OmFemFamily family;
} OmFemBatch;

typedef struct OmFemVisit {  // an element at one of its vertices
    int corner;              // 4 element + local vertex
    unsigned short
        slot[4];  // place of its vertices in the row: 0 the diagonal, 1 the first neighbour
} OmFemVisit;

typedef struct OmFem {  // model->data
    int nbatch;
    OmFemBatch* batch;  //                                                   (nbatch)
    double* grad;       // shape gradients of vertices 1, 2, 3, 1/m          (ntet x 9)
    float ratio;        // lambda / mu where all elements have the same
    bool is_mixed;      // they have not
    bool is_blocked;    // first pass by stretches, not by rotations: a law is not corotational
    int* visit_adr;     // first visit of each vertex                        (nvert + 1)
    OmFemVisit* visit;  //                                                   (4 ntet)
    int max_row;        // blocks of the longest row
} OmFem;

typedef struct OmFemWork {  // work->data
    int ntet, nworker;      // sizes of the arrays
    size_t row_size;        // floats of one worker's row
    float* turned;   // what the first pass leaves: OM__TURNED or OM__BLOCKED floats an element
    double* corner;  // forces on the corners of elements, null until needed (ntet x 4 x 3)
    float* row;      // the row a worker gathers                       (nworker x row_size)
} OmFemWork;

typedef struct OmFemTurn {  // arguments of the first pass
    const OmFemBatch* batch;
    const double *x, *v;
    float lag;     // s, h + Rayleigh's b: strain is taken at x + lag v
    float scale;   // of the gradients, sqrt(h^2 + h b)
    float stress;  // of the stress, h / scale
    float* turned;
    const OmTissueModel* model;
    bool is_exact;  // tangents are not projected
} OmFemTurn;

/// The rotation nearest to F, in double: from its invariants, or by SVD where these do not determine it.
OmMat3 om__fem_rotation(OmMat3 F);
/// Lame's constants of element e, Pa.
void om__fem_lame(const OmTissueModel* model, int e, double* lambda, double* mu);
/// First pass over batches [begin, end): turned gradients and stresses of corotational elements.
void om__fem_turn(const OmFemTurn* turn, int begin, int end);
/// First pass for any law: blocks K_ab of the pairs (0,1) (0,2) (0,3) (1,2) (1,3) (2,3) by columns, then the
/// entries of b of the four vertices.
void om__fem_stretch(const OmFemTurn* turn, int begin, int end);
/// The material of element e.
const OmMaterial* om__fem_material(const OmTissueModel* model, int e);
/// A and b; see OmTissueEngine.assemble.
OmStatus om__fem_assemble(const OmTissueModel* model, const OmTissueState* state,
                          OmTissueWork* work, const OmAssembly* at);
void om__fem_add_internal_force(const OmTissueModel* model, const double* x,
                                const unsigned char* mask, double* force, OmVec3* sum);
void om__fem_get_measure(const OmTissueModel* model, const double* x, OmTissueMeasure measure,
                         double* value);
double om__fem_get_least_ratio(const OmTissueModel* model, const OmTissueWork* work,
                               const double* x);
OmStatus om__fem_eval_balance(const OmTissueModel* model, OmTissueWork* work, const double* x,
                              double* force, double* energy);
double om__fem_get_energy(const OmTissueModel* model, const double* x);

#endif
