/// omentum/pbd.h: position based dynamics, the tissue model made for speed (floor 2; thesis 2.4.2, 3.5).
///
/// Symplectic Euler predicts the particles; then constraints project them: rigid shapes of overlapping clusters,
/// (3.13)-(3.14), or the elastic energy of tetrahedra with its physical constants (XPBD). The method cannot
/// become unstable. om_pbd_engine makes it an engine of tissue.h. Shape matching has no
/// interaction forces: for it om_tissue_get_forces gives the balance of momentum, and stretch has no modulus.
///
///     OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
///     om_pbd_sample_surface(&skin, 0.005, &particles, &pbd.particle_volume);
///     OmTissueDef def = om_tissue_default_def(om_pbd_engine(), &particles);
///     def.options = &pbd;
///     om_tissue_create(&def, &model);               // then as in tissue.h
#ifndef OMENTUM_PBD_H
#define OMENTUM_PBD_H

#include "omentum/shape_sdf.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmPbdKind {
    OM_PBD_CLUSTERS,  // region-based shape matching; the material of OmTissueDef is not used
    OM_PBD_ELASTIC,  // XPBD: stable neo-Hookean tetrahedra with Lame's constants of the materials of
                     // OmTissueDef, whatever their law; forces in newtons
    OM_PBD_LENGTHS   // XPBD: lengths of edges and volumes of tetrahedra; springs, not a material
} OmPbdKind;

typedef struct OmPbdDef {    // made by om_pbd_default_def; lengths in m; copied by om_tissue_create
    OmPbdKind kind;          // default OM_PBD_CLUSTERS
    int substeps;            // of a step, 1 to 1000; default 0: chosen, see om_pbd_substeps
    int iterations;          // of a substep, 1 to 1000; default 9, else 1
    double damping;          // viscous drag on velocities, 1/s, >= 0; default 12, else 0
    double max_speed;        // of a particle, m/s, > 0; default 10
    double particle_volume;  // m^3, of each, where the mesh has no elements; default 0: not known
    // clusters
    double cluster_spacing;    // between centres, > 0; default 12.7 mm (5.4.1)
    double cluster_radius;     // at least half the spacing; default 9.5 mm
    double cluster_stiffness;  // alpha of (3.14), 0 to 1; default 0.361
    double linear_stretch;     // 0 to 1: goals follow the cluster's best linear map of the same
                               // volume by that share (Mueller et al. 2005); default 0: rigid
    // elements
    // Of OM_PBD_ELASTIC, s: ratio of the shear stress of the strain rate to that of the strain;
    // rayleigh_stiffness of OmTissueDef where that is larger. 0: none. Default -1: only energy
    // gained within a step is damped, with the time of two steps; steady motions are not damped.
    // Used without rayleigh_stiffness.
    double internal_friction;
    // lengths
    double edge_stiffness;    // of each edge, N/m, > 0; default 10
    double volume_stiffness;  // K of K/2 (V - V0)^2 / V0, Pa; 0: volumes are free; default 1e4
    // contact
    double collision_distance;  // kept from obstacles and, with self_collision, between particles;
                                // 0 for particles that lie on the surface, as mesh vertices do;
                                // default 3 mm
    double recover_speed;       // m/s, at which particles that start inside come out; default 0.5
    double friction;            // Coulomb's, against obstacles without their own; default 0.35
    double particle_friction;   // Coulomb's, between particles; default 0.25
    bool has_self_collision;    // default true for OM_PBD_CLUSTERS
    OmCookie cookie;            // set by om_pbd_default_def
} OmPbdDef;

/// The engine "pbd" of tissue.h. Options: OmPbdDef, copied; without options it has clusters. In a scene it reads
/// cluster_spacing, cluster_radius and cluster_stiffness.
OM_API const struct OmTissueEngine* om_pbd_engine(void);
/// The engine "xpbd": the same with OM_PBD_ELASTIC where no options are given.
OM_API const struct OmTissueEngine* om_xpbd_engine(void);

/// Table 3.1 and the optimum of 5.4.1 for clusters; substeps rather than iterations for elasticity.
OM_API OmPbdDef om_pbd_default_def(OmPbdKind kind);

// ---- particles ------------------------------------------------------------------------------------

// Particles are the vertices of a mesh without elements (om_tet_mesh_done frees), or the vertices of a mesh with
// elements, which then define their masses.

/// A cubic lattice inside a closed surface, centred in its bounding box.
/// @param spacing          m; the thesis's is 5 mm
/// @param particle_volume  m^3, the solid's over the number of particles
/// @return OM_OK; OM_INVALID (spacing; nothing inside; more than 10 million); OM_NO_MEMORY
OM_API OmStatus om_pbd_sample_surface(const OmSurface* surface, double spacing,
                                      OmTetMesh* particles, double* particle_volume);
/// The same where the field is negative.
/// @return OM_OK; OM_INVALID (no particle, or too many, at this spacing); OM_NO_MEMORY
OM_API OmStatus om_pbd_sample_sdf(const OmSdf* sdf, double spacing, OmTetMesh* particles,
                                  double* particle_volume);
/// A single layer: the sheet's middle plane is z = 0, its centre the origin, particles at cell centres.
/// @param size_x,size_y,thickness  m; the thickness gives particles their volume
/// @return OM_OK; OM_INVALID (sizes or spacing out of range); OM_NO_MEMORY
OM_API OmStatus om_pbd_sample_sheet(double size_x, double size_y, double thickness, double spacing,
                                    OmTetMesh* particles, double* particle_volume);

// ---- parts of a model --------------------------------------------------------------------------------

/// Members of the clusters: vertices vert[adr[c]] to vert[adr[c + 1] - 1] belong to cluster c.
/// @return number of clusters; 0 for a model of another engine
OM_API int om_pbd_clusters(const OmTissueModel* model, const int** adr, const int** vert);
/// Number of substeps in a step of h seconds. If the definition has 0: for elements 20; for clusters the number that
/// keeps om_pbd_weight_strain at 5 %, at least 3 (Table 3.1) and at most 100; for a flat sheet 3.
/// @return 0 for a model of another engine
OM_API int om_pbd_substeps(const OmTissueModel* model, double h);
/// Effective Young's modulus of a body of clusters, Pa, if the body is much larger than a cluster; its Poisson's
/// ratio is 0: density iterations cluster_stiffness (1 - linear_stretch) s^2 (substeps / h)^2, where s^2 is the mean
/// square distance of members from the centre of their cluster along gravity.
/// @return 0 if the model has no clusters
OM_API double om_pbd_modulus(const OmTissueModel* model, double h);
/// Compression of the lowest clusters by the weight of the whole body at rest on a board, or the stretch
/// of the highest of a body that hangs: density g height / modulus; height is between clusters' centres.
/// A value of 0.15 or more at h = 20 ms is worth a warning in the log when the model is made.
OM_API double om_pbd_weight_strain(const OmTissueModel* model, double h);

#ifdef __cplusplus
}
#endif
#endif
