// fem_internal.h: shared by the files of the room.
//
// Elements are processed in batches of OM__LANE, struct of arrays, one element a lane (the last batch
// repeats its last element with zero volume). The first pass of a step runs over batches and stores for
// each element the rotated gradients of its shape functions and its stress. The second pass runs over
// vertices and gathers a row of A and an entry of b from their elements. No atomics, no colours, same
// bytes always.
#ifndef OMENTUM_FEM_INTERNAL_H
#define OMENTUM_FEM_INTERNAL_H

#include "base/base_multiversion.h"
#include "fem/fem_principal.h"
#include "tissue/tissue_internal.h"

// Inlined into each clone of a multiversioned function, so that it is compiled for its processor.
#if defined(__GNUC__)
#define OM__INLINE static inline __attribute__((always_inline))
#else
#define OM__INLINE static inline
#endif

#define OM__LANE 16
#define OM__TURNED 28   // floats of an element between the passes
#define OM__BLOCKED 68  // the same where a law is not corotational
#define OM__QUADRATIC \
    436                // the same of a quadratic element: 45 blocks, 10 forces, one float unused
#define OM__SHELL 280  // the same of a shell: 28 blocks, 8 forces, four floats unused

typedef enum OmFemFamily {  // how the first pass computes a batch
    OM__FAMILY_TURNED,      // corotational, for all elements of the model
    OM__FAMILY_NEO,
    OM__FAMILY_STABLE,
    OM__FAMILY_VENANT,
    OM__FAMILY_OTHER  // lane by lane: other laws, or different laws in a batch
} OmFemFamily;

typedef struct OmFemBatch {
    int vert[4][OM__LANE];    // vertices
    float grad[9][OM__LANE];  // shape gradients of vertices 1, 2, 3 at rest, 1/m
    // sqrt(V mu), V the volume of the element or a quarter of it; zero in unused lanes
    float root[OM__LANE];
    float ratio[OM__LANE];  // lambda / mu
    OmFemFamily family;
} OmFemBatch;

typedef struct
    OmFemMids {  // of a batch of quadratic elements: midpoints of edges 01 02 03 12 13 23
    int vert[6][OM__LANE];
    float wide[OM__LANE];  // lambda / mu of the wide part; `ratio` of the batch is the inner law's
} OmFemMids;

typedef struct OmFemShells {  // of a batch of solid-shells, see fem_shell.h
    int vert[8][OM__LANE];
    float grad[24][OM__LANE];    // mean gradients of the shape functions at rest, 1/m
    float hour[32][OM__LANE];    // of the patterns; row 8 i + a
    float stiff[90][OM__LANE];   // k over V mu, 1/m^2: blocks i <= j, by columns
    float strain[72][OM__LANE];  // B, 1/m; row 12 v + n
    float block
        [252]
        [OM__LANE];  // of k and of both points at rest: sum_ij hour_ia k_ij hour_jb over V mu, pairs a < b, by columns
    float turns[OM__LANE];  // 0 where the law is linear: R = I
} OmFemShells;

typedef struct OmFemVisit {  // an element at one of its vertices
    int corner;              // 4 element + local vertex
    // position of its vertices in the row: 0 the diagonal, 1 the first neighbour
    unsigned short slot[4];
} OmFemVisit;

typedef struct OmFemLargeVisit {  // an element of eight or ten nodes at one of them
    int corner;                   // 8 or 10 element + local node
    unsigned short slot[10];      // position of its nodes in the row
} OmFemLargeVisit;

typedef struct OmFem {  // model->data
    int nelem;          // tetrahedra of four or ten nodes, shells of eight
    int npoint;         // quadrature points in each: 1 or 5
    int nbatch;
    OmFemBatch* batch;  //                                                   (nbatch)
    OmFemMids* mids;    // quadratic                                         (nbatch)
    double* grad;       // tetrahedra: gradients of barycentric coordinates 1, 2, 3, 1/m (nelem x 9)
    OmFemShells* shells;       // shells                                            (nbatch)
    struct OmFemShell* shell;  // the same in double                                (nelem)
    float ratio;               // lambda / mu if all elements have the same
    bool is_mixed;             // elements differ in lambda / mu
    bool is_blocked;           // the first pass uses principal stretches: a law is not corotational
    int* visit_adr;            // first visit of each vertex                        (nvert + 1)
    OmFemVisit* visit;         // linear                                            (4 nelem)
    OmFemLargeVisit* large_visit;  // quadratic, shells                      (10 or 8 nelem)
    int max_row;                   // blocks of the longest row
} OmFem;

typedef struct OmFemWork {  // work->data
    int nworker;
    size_t row_size;  // floats of one worker's row
    float* turned;    // results of the first pass: OM__TURNED or OM__BLOCKED floats an element
    double* corner;   // forces on the nodes of elements              (nelem x nelem_node x 3)
    float* row;       // the row that a worker gathers                   (nworker x row_size)
} OmFemWork;

typedef struct OmFemTurn {  // arguments of the first pass
    const OmFemBatch* batch;
    const OmFemMids* mids;
    const OmFemShells* shells;
    const double *x, *v;
    float lag;     // s, h + Rayleigh's b: strain is taken at x + lag v
    float scale;   // of the gradients, sqrt(h^2 + h b)
    float stress;  // of the stress, h / scale
    float* turned;
    const OmTissueModel* model;
    bool is_exact;   // tangents are not projected
    bool is_turned;  // shells: every law as the corotational one
} OmFemTurn;

/// The rotation nearest to F, in double: from its invariants, or by SVD where these do not determine it.
OmMat3 om__fem_rotation(OmMat3 F);
/// Lame's constants of element e, Pa.
void om__fem_lame(const OmTissueModel* model, int e, double* lambda, double* mu);
/// First pass over batches [begin, end): rotated gradients and stresses of corotational elements.
void om__fem_turn(const OmFemTurn* turn, int begin, int end);
/// First pass for any law: blocks K_ab of the pairs (0,1) (0,2) (0,3) (1,2) (1,3) (2,3) by columns, then the
/// entries of b of the four vertices.
void om__fem_stretch(const OmFemTurn* turn, int begin, int end);
/// The same for quadratic elements: OM__QUADRATIC floats each, see fem_quadratic.h.
void om__fem_turn_quadratic(const OmFemTurn* turn, int begin, int end);
void om__fem_stretch_quadratic(const OmFemTurn* turn, int begin, int end);
/// The same for shells, every law: OM__SHELL floats each, see fem_shell.h.
void om__fem_stretch_shell(const OmFemTurn* turn, int begin, int end);
/// How a law is computed in batches.
OmFemFamily om__fem_family(const OmMaterial* material);
/// Rest volume of element e, m^3.
double om__fem_volume(const OmTissueModel* model, int e);
/// The material of element e.
const OmMaterial* om__fem_material(const OmTissueModel* model, int e);
/// A and b; see OmTissueEngine.assemble.
OmStatus om__fem_assemble(const OmTissueModel* model, const OmTissueState* state,
                          OmTissueWork* work, const OmAssembly* at);
OmStatus om__fem_add_internal_force(const OmTissueModel* model, const double* x,
                                    const unsigned char* mask, double* force, OmVec3* sum);
OmStatus om__fem_get_measure(const OmTissueModel* model, const double* x, OmTissueMeasure measure,
                             double* value);
/// See OmTissueEngine.check.
void om__fem_check(const OmTissueModel* model, const OmTissueWork* work, const double* x_begin,
                   const double* x_end, bool is_solved, OmTissueCheck* check);
/// First Piola-Kirchhoff stress, Pa, and energy density, J/m^3, at F, every law.
OmMat3 om__fem_eval_stress(const OmMaterial* material, OmLawShare share, OmMat3 F, double* energy);
/// Energy density at F, J/m^3, every law.
double om__fem_eval_energy(const OmMaterial* material, OmLawShare share, OmMat3 F);
OmStatus om__fem_eval_balance(const OmTissueModel* model, OmTissueWork* work, const double* x,
                              double* force, double* energy);
OmStatus om__fem_get_energy(const OmTissueModel* model, const double* x, double* energy);

#endif
