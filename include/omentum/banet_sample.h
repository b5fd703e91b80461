/// omentum/banet_sample.h: random bodies, loads and views from which BA-Net learns attachments (room `banet`, floor 6).
///
/// Thesis 4.2.1. A sample is a random sheet of fat with random attachments, pulled at one place to its static
/// equilibrium, and what a camera knows of it: the displacement of the visible part of the surface. Sample `index` is a
/// function of the definition alone.
///
///     OmBanetSampleDef def = om_banet_sample_default_def(1);
///     om_banet_sample_make(&def, 17, &sample);   // sample.u, sample.seen: the input; sample.attached: the truth
///     om_banet_sample_done(&sample);
#ifndef OMENTUM_BANET_SAMPLE_H
#define OMENTUM_BANET_SAMPLE_H

#include "omentum/fem.h"
#include "omentum/shape.h"
#include "omentum/tissue_material.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmBanetWay {  // how the displacement of the visible part is measured
    OM_BANET_EXACT,        // (a) part of the surface by (4.1), its exact displacement
    OM_BANET_CAMERA,  // (b) a depth camera, and correspondences through a twin with wrong attachments
    OM_BANET_MIXED,  // half of the samples each
    OM_BANET_NWAY
} OmBanetWay;
/// "exact", "camera" or "mixed".
OM_API const char* om_banet_way_name(OmBanetWay way);

/// The ranges are uniform unless said otherwise. Vertices are side / 64 apart, the voxel of the network. Linear
/// elements have these edges; quadratic ones have edges twice as long, and vertices at their middles.
typedef struct OmBanetSampleDef {  // made by om_banet_sample_default_def
    uint64_t seed;                 // no default
    OmBanetWay way;                // default OM_BANET_MIXED
    double side;                   // of the cube of 64^3 voxels, m; default 0.3
    double extent[2];     // length and width of the flat body, log-uniform, m; default 0.06-0.2
    double thickness[2];  // between the planes that clip it, log-uniform, m; default 0.007-0.02
    int max_dim[3];       // a body whose box has more cells is drawn again; default 48, 48, 16
    double share[2];      // attached part of the surface's vertices, log-uniform; default 0.05-0.5
    double visible[2];    // visible part of the surface's vertices, way (a); default 0.1-1
    double two_share;     // fraction of samples with two separate attached regions; default 0
    double board_share;   // fraction of samples that lie on a board under gravity; default 0
    // OM_TET10 (default) or OM_TET4, which bends too stiffly.
    OmElement element;
    OmLaw law;          // default OM_NEO_HOOKEAN
    double young[2];    // Pa; default 3000-30000
    double poisson[2];  // default 0.4-0.45
    double radius[2];   // of the grasped part of the surface, m; default 0.004-0.01
    // Strain around the gripper: force over young T sqrt(A), with the mean thickness T of the body and the grasped
    // area A; default 0.3-2.5.
    double pull[2];
    // Samples whose largest displacement is outside of this range are drawn again, m; default 0.005-0.15: an update of
    // a twin is refused below 5 mm.
    double min_u, max_u;
    double tolerance;   // of the residual, relative to the loads; default 1e-4
    double min_volume;  // smallest det F allowed in a sample; default 0.05
    int max_attempt;    // largest number of draws for one sample; default 64
    // Elements of all samples, borrowed; null (default): random bodies. Of OM_TET10 its vertices come first, the
    // middles of its edges follow.
    const OmTetMesh* body;
    OmCookie cookie;
} OmBanetSampleDef;

OM_API OmBanetSampleDef om_banet_sample_default_def(uint64_t seed);
/// @return OM_OK; OM_INVALID (the message names the field)
OM_API OmStatus om_banet_sample_def_validate(const OmBanetSampleDef* def);
/// Hash of everything that samples depend on: settings, and positions and tetrahedra of `body`.
OM_API uint64_t om_banet_sample_def_hash(const OmBanetSampleDef* def);

typedef struct OmBanetSample {  // om_banet_sample_done frees
    int64_t index;
    bool is_camera, has_board;
    int nregion;          // of attachments, 1 or 2
    OmMaterial material;  // young, poisson, law
    double board;  // with has_board: the body is above the plane z = board, m; gravity is along -z
    // Before the pull, as a scan would show it. On a board this is the equilibrium under gravity.
    // Of OM_TET10 its vertices are the nodes; each element is eight tetrahedra, as in om_tet_mesh_refine_nodes.
    OmTetMesh mesh;
    int* node;                // of OM_TET10: nodes of each element; else null (mesh.ntet / 8 x 10)
    OmSurface surface;        // boundary of mesh
    int* surface_vert;        // mesh vertex of each surface vertex       (surface.nvert)
    unsigned char* attached;  // surface vertices that do not move     (surface.nvert)
    unsigned char* grasped;   // surface vertices that share the force (surface.nvert)
    int center;               // surface vertex in the middle of the grasped ones
    OmVec3 force;             // resultant on the grasped vertices, N
    double* rest;           // stress-free positions, m; mesh.x unless has_board   (mesh.nvert x 3)
    double* x;              // equilibrium, m                                      (mesh.nvert x 3)
    double share, visible;  // attached and seen part of the surface's vertices
    double* u;     // displacement from mesh.x as measured, m; 0 where not seen (surface.nvert x 3)
    double* seen;  // how well each vertex was seen, 0-1       (surface.nvert)
    double max_u;  // input displacement: the largest of any vertex, exact, m
    double min_volume, residual;  // smallest det F; relative to the loads
    int nattempt, nfail;          // draws; draws whose solve failed
    int nnewton;                  // Newton iterations of the last draw
    double seconds;               // wall clock; differs between runs
} OmBanetSample;

OM_API void om_banet_sample_done(OmBanetSample* sample);
/// Make sample `index` of the definition.
/// @param index  0 .. 2^40 - 1
/// @return OM_OK; OM_NOT_CONVERGED (no draw succeeded; the sample is empty); OM_INVALID (the message names the field);
///         OM_NO_MEMORY
OM_API OmStatus om_banet_sample_make(const OmBanetSampleDef* def, int64_t index,
                                     OmBanetSample* sample);

#ifdef __cplusplus
}
#endif
#endif
