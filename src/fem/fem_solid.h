// fem_solid.h: shared by the files of the general solid.
#ifndef OMENTUM_FEM_SOLID_H
#define OMENTUM_FEM_SOLID_H

#include "fem/fem_law.h"
#include "omentum/fem.h"

#define OM__MAX_POINT 27  // quadrature points of an element, those of mass included

// ---- fem_element.c ----------------------------------------------------------------------------------

typedef struct OmRule {  // quadrature on the reference element
    int npoint;
    double xi[OM__MAX_POINT][3], weight[OM__MAX_POINT];
} OmRule;

int om__element_nnode(OmElement kind);
/// The rule of the energy, or a rule exact for products of two shape functions.
void om__element_rule(OmElement kind, bool is_mass, OmRule* rule);
/// Shape functions N and their derivatives dN[3 a + k] = dN_a / dxi_k at xi; dN may be null.
void om__element_shape(OmElement kind, const double xi[3], double* N, double* dN);
/// The centre of the reference element, and the distance of xi outside it (negative: inside).
void om__element_centre(OmElement kind, double xi[3]);
double om__element_inside(OmElement kind, const double xi[3]);
/// dx/dxi by columns from node positions.
OmMat3 om__element_jacobian(int nnode, const double* dN, const double* x, const int* node);
/// The nodes of face `face` of an element, counter-clockwise from outside; false past the last.
bool om__element_face(OmElement kind, int face, int local[6], int* nlocal);
int om__face_nnode(OmElement kind);
/// Rule and shape functions on a face of nnode nodes: N, dN[2 a + k]; xi[2] is not used.
void om__face_rule(int nnode, OmRule* rule);
void om__face_shape(int nnode, const double* xi, double* N, double* dN);
/// Second derivatives, the same at every point: ddN[3 a + k], k: 00, 11, 01.
void om__face_curvature(int nnode, double* ddN);
/// Both tangents of a face from dN.
void om__face_tangents(int nnode, const double* dN, const int* node, const double* x, OmVec3* a,
                       OmVec3* b);

// ---- fem_solid.c ------------------------------------------------------------------------------------

typedef struct OmColors {  // cells of a colour have no common node
    int num;
    int* adr;   //                                                               (num + 1)
    int* cell;  //                                                               (cells)
} OmColors;

typedef struct
    OmPatches {  // OM_SMOOTHED: the elements around each edge, each with a sixth of its volume
    int num;
    int* adr;       // nodes of each patch                                         (num + 1)
    int* node;      //                                                             (nodes)
    double* grad;   // F = sum x_a g_a^T, the mean over the patch                  (nodes x 3)
    int* part_adr;  // materials of each patch                                     (num + 1)
    int* material;  // and their volumes, m^3
    double* volume;
    OmColors colors;
} OmPatches;
#define OM__MAX_PATCH 32  // nodes

typedef struct OmFacePair {  // two sets of faces that may be in contact
    int nface_node, nface[2], npoint[2], nnode[2];
    int* face_node[2];         //                                              (nface x nface_node)
    int* node[2];              // of the faces, ascending                                   (nnode)
    unsigned char* border[2];  // edges and corners on the border of the set, by bits  (nface)
    double* weight[2];         // half the stiffness times the rest area of points, N/m    (npoint)
    double stiffness;          // Pa/m
    double reach;              // m
} OmFacePair;

struct OmFemSolid {
    OmFemMesh mesh;
    int nmaterial, nworker, npoint;
    OmLocking locking;
    bool is_projected, has_octets;
    OmLawParam* law;    //                                                       (nmaterial)
    double* density;    // kg/m^3                                                (nmaterial)
    double* grad;       // dN_a/dX at the points            (nelem x npoint x nelem_node x 3)
    double* weight;     // rest volume of the points, m^3                   (nelem x npoint)
    double* volume;     // m^3                                                       (nelem)
    double* elem_mass;  // consistent, kg                  (nelem x nelem_node x nelem_node)
    double* mass;       // lumped, kg                                                (nnode)
    int* elem_adr;      // blocks of the matrix            (nelem x nelem_node x nelem_node)
    OmColors colors;    // of elements
    OmPatches patches;
    int* node_adr;   // elements of each node                                 (nnode + 1)
    int* node_elem;  //                                              (nelem x nelem_node)
    int ncontact;
    OmFacePair* contact;  //                                                      (ncontact)
    double* node_volume;  // a quarter of each element around, m^3; OM_NODAL_VOLUME (nnode)
};

/// As om_fem_eval_tangent, whatever the solid's own option.
OmStatus om__fem_tangent(const OmFemSolid* solid, const double* x, bool is_projected, OmBsr* A);
/// F at a quadrature point from node positions x.
void om__fem_gradient(const OmFemSolid* solid, int elem, int point, const double* x, double F[9]);

/// Elements or patches adr[c] .. adr[c + 1] of `node` (null adr: k nodes each) to colours.
OmStatus om__fem_color(int nnode, int ncell, const int* adr, int k, const int* node, OmColors* out);

// ---- fem_octet.c ------------------------------------------------------------------------------------

/// Are all elements hexahedra of neo-Hookean laws, without common volume ratios?
bool om__octet_fits(const OmFemSolid* solid);
/// Forces on the nodes of num <= 8 elements, and their energies.
void om__octet_force(const OmFemSolid* solid, const int* elem, int num, const double* x,
                     double fe[8][24], double energy[8]);
/// Blocks (a, b), a <= b, of num <= 8 elements, by columns.
void om__octet_tangent(const OmFemSolid* solid, const int* elem, int num, const double* x,
                       double block[8][36][9]);

// ---- fem_patch.c ------------------------------------------------------------------------------------

OmStatus om__fem_make_patches(const OmFemSolid* solid, OmPatches* out);
void om__fem_destroy_patches(OmPatches* patches);

// ---- fem_contact.c ----------------------------------------------------------------------------------

/// Call it after om_fem_create has listed the elements of nodes.
OmStatus om__contact_create(OmFemSolid* solid, int ncontact, const OmFemContact* def);
void om__contact_destroy(OmFemSolid* solid);
/// Pairs of nodes that contacts couple, each once per contact, into `pair`; null: only an upper
/// bound of their number.
int64_t om__contact_pairs(const OmFemSolid* solid, int* pair);
/// Energy, forces and tangent at x added; each may be null.
OmStatus om__contact_eval(const OmFemSolid* solid, const double* x, bool is_projected,
                          double* energy, double* f, OmBsr* A);

// ---- fem_load.c -------------------------------------------------------------------------------------

OmStatus om__fem_check_load(const OmFemSolid* solid, const OmFemLoad* load);
/// Add dead forces at full load to f (nnode x 3); gravity on lumped masses, so that all nodes fall equally, or not.
void om__fem_add_dead(const OmFemSolid* solid, const OmFemLoad* load, bool is_lumped, double* f);
/// Is there a load without an energy?
bool om__fem_has_follower(const OmFemLoad* load);
/// Follower forces at x times `share` added to f; their tangent, which need not be symmetric, subtracted from A.
/// Either may be null.
void om__fem_add_follower(const OmFemLoad* load, const double* x, double share, double* f,
                          OmBsr* A);

// ---- fem_newton.c -----------------------------------------------------------------------------------

typedef struct OmFemNewton {  // everything a solve needs, allocated once
    const OmFemSolid* solid;
    const OmFemLoad* load;
    const OmProgress* progress;  // may be null; receives the load at every iteration
    OmSolverDef solver_def;
    OmBsr A;
    OmSolver* solver;
    OmSolver* lu;  // of an unsymmetric A; where `solver` is Cholesky and a pressure follows
    OmBsr B;       // the unsymmetric matrix; where `solver` is iterative and a pressure follows
    int max_newton;
    bool is_plain, is_plain_only;  // whole steps now, and whole steps only
    bool is_explicit;              // no linear systems
    bool has_follower;             // a pressure follows
    bool is_unsymmetric;           // the last step was of an unsymmetric tangent
    // the last tangent was made positive definite, or its determinant was negative
    bool is_repaired;
    double tolerance;
    double inertia;                 // factor of M in the tangent, 1/s^2; 0: statics
    bool is_consistent, is_lumped;  // mass of inertia; gravity on lumped masses
    double* x_hat;                  // position without forces, of the inertia term    (nnode x 3)
    double *dead, *r, *dx, *trial, *work, *scratch, *start;  //         (nnode x 3 each)
    double* own;             // blocks of nodes without `extra`    (nnode x 9)
    unsigned char* fixed;    //                                   (nnode x 3)
    double rounding;         // norm of forces that rounding of positions makes, N
    double energy_rounding;  // of the stored energy, whose terms cancel at rest, J
} OmFemNewton;

/// Choose the solvers that the load needs; after N->load and N->fixed are set.
OmStatus om__newton_prepare(OmFemNewton* newton);
/// dx, its prescribed entries given, from A dx = -r; A made positive definite if it is symmetric and is not.
/// @return OM_OK, OM_NOT_CONVERGED (report->reason), errors
OmStatus om__newton_step(OmFemNewton* newton, const double* x, double share, OmFemReport* report);

/// CHOLMOD for few nodes, else CG with multigrid.
OmSolverDef om__newton_solver_def(const OmFemSolid* solid);
OmStatus om__newton_create(const OmFemSolid* solid, const OmSolverDef* solver, OmFemNewton* newton);
void om__newton_done(OmFemNewton* newton);
/// Prescribed degrees of freedom and dead loads; before the solves.
OmStatus om__newton_set_load(OmFemNewton* newton, const OmFemLoad* load);
/// Find equilibrium at `share` of the loads from x; its prescribed entries move to `target` (nnode x 3).
/// `guess` (may be null) is the start if its residual is not larger than that of x. Adds to the counts of
/// report.
/// @return OM_OK, OM_NOT_CONVERGED (report->reason; x is not usable)
OmStatus om__newton_solve(OmFemNewton* newton, double share, const double* target, double* x,
                          const double* guess, OmFemReport* report);
/// Gradient of all energies at x to r, and the norm of loads and reactions.
OmStatus om__newton_residual(OmFemNewton* newton, const double* x, double share, double* r,
                             double* scale);

#endif
