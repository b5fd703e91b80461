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
    436  // the same of a quadratic element: 45 blocks, 10 forces, one float unused

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

typedef struct OmFemVisit {  // an element at one of its vertices
    int corner;              // 4 element + local vertex
    // position of its vertices in the row: 0 the diagonal, 1 the first neighbour
    unsigned short slot[4];
} OmFemVisit;

typedef struct OmFemQuadVisit {  // a quadratic element at one of its nodes
    int corner;                  // 10 element + local node
    unsigned short slot[10];     // position of its nodes in the row
} OmFemQuadVisit;

typedef struct OmFemEntry {  // of a sparse operator: to a vertex or a cell
    int index;
    float g[3];  // gradient, 1/m
} OmFemEntry;

// Averaged strains: a cell is a vertex and a material, with a quarter of each element around it. See fem_cell.c.
typedef struct OmFemCells {
    int ncell;
    bool has_wide;        // some material has a part of lambda that is averaged further
    int* vert;            //                                                       (ncell)
    int* material;        // index to the model's                                  (ncell)
    double* volume;       // m^3                                                   (ncell)
    float* stiffness;     // volume times mu, N m                                  (ncell)
    float* ratio;         // lambda of the inner law / mu                          (ncell)
    OmFemFamily* family;  // of OM__LANE cells
    int* adr;             // F = I + sum u_j g_j^T: first entry of each cell       (ncell + 1)
    OmFemEntry* entry;    // by vertex
    double* grad;         // the same gradients in double                          (entries x 3)
    int* t_adr;           // the transpose: first entry of each vertex             (nvert + 1)
    OmFemEntry* t_entry;  // by cell
    int* t_from;          // its entry above
    int* tet_cell;        // cells of each element's vertices                      (ntet x 4)
    int* tet_adr;         // first element of each cell                            (ncell + 1)
    int* tet;             //                                                       (4 ntet)
    int* near_adr;        // first neighbour of each cell, itself among them       (ncell + 1)
    int* near;            // cells of the same elements
    double* weight;       // m^3, symmetric; a row sums to the cell's volume
    float* share;         // the same by the row's volume, for a step
    OmMaterial* inner;    // the law of cells: lambda at most INNER mu             (nmaterial)
    OmLawParam* wide;     // the rest of the volumetric term: see om__cell_wide (nmaterial)
} OmFemCells;

typedef struct OmFem {  // model->data
    int nelem;          // tetrahedra of four or ten nodes
    int npoint;         // quadrature points in each: 1 or 5
    int nbatch;
    OmFemBatch* batch;  //                                                   (nbatch)
    OmFemMids* mids;    // quadratic                                         (nbatch)
    double* grad;       // gradients of barycentric coordinates 1, 2, 3, 1/m     (nelem x 9)
    float ratio;        // lambda / mu if all elements have the same
    bool is_mixed;      // elements differ in lambda / mu
    bool is_blocked;    // the first pass uses principal stretches: a law is not corotational
    int* visit_adr;     // first visit of each vertex                        (nvert + 1)
    OmFemVisit* visit;  // linear                                            (4 nelem)
    OmFemQuadVisit* quad_visit;  // quadratic                                (10 nelem)
    int max_row;                 // blocks of the longest row
    OmFemCells* cells;           // null unless strains are averaged
} OmFem;

typedef struct OmFemWork {  // work->data
    int nworker;
    size_t row_size;  // floats of one worker's row
    float* turned;    // results of the first pass: OM__TURNED or OM__BLOCKED floats an element
    double* corner;   // forces on the nodes of elements, null until needed (nelem x 4 or 10 x 3)
    float* row;       // the row that a worker gathers                   (nworker x row_size)
    float* cell;      // OM__CELLED floats a cell, where strains are averaged; then 6 scalars a cell
    float* hinge;     // 12 floats an element: its difference from its cells
    double* scratch;  // of om__cell_balance, null until needed
} OmFemWork;

typedef struct OmFemTurn {  // arguments of the first pass
    const OmFemBatch* batch;
    const OmFemMids* mids;
    const double *x, *v;
    float lag;     // s, h + Rayleigh's b: strain is taken at x + lag v
    float scale;   // of the gradients, sqrt(h^2 + h b)
    float stress;  // of the stress, h / scale
    float* turned;
    const OmTissueModel* model;
    bool is_exact;            // tangents are not projected
    bool is_turned;           // treat every law as corotational, for a predictor
    const OmFemCells* cells;  // or null
    float *cell, *hinge;      // of the work
} OmFemTurn;

// Results of a pass over cells: for each cell F, F', stress times volume and dt/dF, in columns of four floats.
// Scalars follow after all cells: t at F and F', their averages (2 each a cell), then two more for the transposed
// averaging.
enum { OM__CELL_P = 0, OM__CELL_D = 12, OM__CELL_F = 24, OM__CELL_G = 36, OM__CELLED = 48 };

static inline int om__cell_batches(const OmFemCells* c) {
    return (c->ncell + OM__LANE - 1) / OM__LANE;
}
static inline float* om__cell_scalars(const OmFemCells* c, float* cell) {
    return cell + (size_t)OM__CELLED * OM__LANE * (size_t)om__cell_batches(c);
}

/// The same for quadratic elements: OM__QUADRATIC floats each, see fem_quadratic.h.
void om__fem_turn_quadratic(const OmFemTurn* turn, int begin, int end);
void om__fem_stretch_quadratic(const OmFemTurn* turn, int begin, int end);
/// The rotation nearest to F, in double: from its invariants, or by SVD where these do not determine it.
OmMat3 om__fem_rotation(OmMat3 F);
/// Lame's constants of element e, Pa.
void om__fem_lame(const OmTissueModel* model, int e, double* lambda, double* mu);
/// First pass over batches [begin, end): rotated gradients and stresses of corotational elements.
void om__fem_turn(const OmFemTurn* turn, int begin, int end);
/// First pass for any law: blocks K_ab of the pairs (0,1) (0,2) (0,3) (1,2) (1,3) (2,3) by columns, then the
/// entries of b of the four vertices.
void om__fem_stretch(const OmFemTurn* turn, int begin, int end);
/// The first pass over cells [begin, end): F' = F + lag dF/dt, the inner law's stress times volume, the measure of
/// volume t (det F - 1, or the trace of the strain) at F and F', and the direction dt/dF.
void om__fem_turn_cells(const OmFemTurn* turn, int begin, int end);
void om__fem_stretch_cells(const OmFemTurn* turn, int begin, int end);
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
/// Energy density at F, J/m^3, every law.
double om__fem_eval_energy(const OmMaterial* material, OmLawShare share, OmMat3 F);
OmStatus om__fem_eval_balance(const OmTissueModel* model, OmTissueWork* work, const double* x,
                              double* force, double* energy);
OmStatus om__fem_get_energy(const OmTissueModel* model, const double* x, double* energy);

// ---- averaged strains: fem_cell.c, fem_cell_force.c -------------------------------------------------

#define OM__HINGE 0.2  // of mu: stiffness of the difference between an element and its cells
#define OM__INNER 1.0  // of mu: largest lambda in the law of a cell

OmStatus om__cells_create(const OmTissueModel* model, OmFemCells** cells);
void om__cells_destroy(OmFemCells* cells);
size_t om__cells_memory(const OmTissueModel* model, const OmFemCells* cells);
/// Is the measure of volume of the law det F - 1? Else the trace of its strain.
bool om__cell_is_volume(const OmMaterial* material);
/// The remaining volumetric term, as a function of the averaged measure.
OmJet om__cell_wide(const OmFemCells* cells, int material, double t);
/// After the pass over cells, by all members of the team: average the volumetric term, from t to the
/// input of om__cells_finish. Ends without a barrier.
void om__cells_average(const OmFemTurn* turn, OmTeam* team, int rank, int size);
/// After the pass over elements: OM__CELL_P becomes the whole stress of cells [begin, end).
void om__cells_finish(const OmFemTurn* turn, int begin, int end);
/// Forces (nvert x 3, overwritten) and energy in double.
/// @param scratch  om__cell_scratch_size doubles
size_t om__cell_scratch_size(const OmTissueModel* model);
void om__cell_balance(const OmTissueModel* model, int nworker, const double* x, double* scratch,
                      double* force, double* energy);
/// Mean F of an element's cells and the element's energy per volume; after om__cell_balance.
OmMat3 om__cell_mean(const OmTissueModel* model, const double* scratch, int e, double* energy);

#endif
