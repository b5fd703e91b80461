/// omentum/match_spectral.h: correspondence by functional maps (floor 5; thesis 4.2, Ovsjanikov et al. 2012).
///
/// The smallest eigenvectors of a surface's Laplacian are its smooth functions, ordered by frequency. Bending changes
/// them little, so that a function of one shape is a function of the other with nearly the same coefficients: a small
/// matrix C is a map. ZoomOut (Melzi et al. 2019) turns a coarse map into a fine one: C from the map, the map from
/// neighbours in spectral space, with more functions in each round.
///
/// Shape a is the model, b the scan. A point map has an entry for each vertex of b, a vertex of a; -1: none.
/// Triangles may be open, non-manifold, not oriented, or degenerate; vertices without triangles have no partner.
///
///     om_spectral_basis_init(&model, 80, &a);              // once
///     om_spectral_basis_init_scan(&scan, 60, &b);          // every picture
///     om_spectral_map_from_nearest(&a, model.x, &b, scan.x, map);
///     OmSpectralDef def = om_spectral_default_def();
///     om_spectral_zoomout(&def, &a, &b, map, &report);
#ifndef OMENTUM_MATCH_SPECTRAL_H
#define OMENTUM_MATCH_SPECTRAL_H

#include "omentum/scan.h"
#include "omentum/shape.h"
#include "omentum/solve_eigen.h"

#ifdef __cplusplus
extern "C" {
#endif

// ---- the Laplacian --------------------------------------------------------------------------------

typedef struct OmLaplacian {  // om_laplacian_done frees
    // Integrals of grad f_i . grad f_j: positive semidefinite, rows sum to 0; no unit.
    OmCsr stiffness;
    double* area;  // of the vertices, m^2; 0: no triangle uses the vertex             (stiffness.n)
    double total_area;  // m^2
    int nflip;          // edges flipped until every edge was intrinsic Delaunay
    double added;       // m, added to every edge so that no triangle is degenerate
} OmLaplacian;

/// The cotangent Laplacian of any set of triangles (Sharp and Crane 2020): off the diagonal no entry is positive,
/// whatever the triangles look like. Open edges are free (Neumann). Triangles of equal vertices are left out.
/// @return OM_OK; OM_INVALID (no triangle with an area, an index out of range, a position that is not
///         finite); OM_NO_MEMORY
OM_API OmStatus om_laplacian_init(int nvert, const double* x, int ntri, const int* tri_vert,
                                  OmLaplacian* laplacian);
/// The same for points without triangles: the Delaunay triangles of each point's neighbourhood in its tangent plane.
/// @param normal  unit (npoint x 3), or null: from the neighbourhoods; a zero normal too
/// @return OM_OK; OM_INVALID (fewer than 3 points, one that is not finite); OM_NO_MEMORY
OM_API OmStatus om_laplacian_init_cloud(int npoint, const double* x, const double* normal,
                                        OmLaplacian* laplacian);
OM_API void om_laplacian_done(OmLaplacian* laplacian);

// ---- the basis ------------------------------------------------------------------------------------

typedef struct OmSpectralBasis {  // constant once made; om_spectral_basis_done frees
    int nvert;                    // vertices of the shape
    int nrow;                     // vertices with an area: they have a row below
    int npair;                    // eigenpairs
    int* vert;                    // vertex of each row, ascending                (nrow)
    int* row;                     // row of each vertex, or -1                    (nvert)
    double* area;                 // of each row, m^2                             (nrow)
    double total_area;            // m^2
    double* eigenvalue;           // ascending, from about 0, 1/m^2               (npair)
    // Eigenvectors, by rows of vertices; the mean of phi_i phi_j over the area is 1 if i = j, else 0.
    double* phi;     // (nrow x npair)
    double seconds;  // that it took
} OmSpectralBasis;

/// Eigenvectors of the Laplacian of a surface. Not inside a parallel loop (om_eigen_smallest).
/// @param npair  1 or more, below the number of vertices in use
/// @return OM_OK; OM_INVALID (npair, see om_laplacian_init); OM_NO_MEMORY; OM_NOT_CONVERGED (nothing is kept)
OM_API OmStatus om_spectral_basis_init(const OmSurface* surface, int npair, OmSpectralBasis* basis);
/// The basis of the part whose vertices are used: the part of a model that a camera is predicted to see. Connected
/// pieces below 1 % of the area have no rows.
/// @param is_used  nonzero: the vertex belongs to the part (nvert); triangles with three such vertices count
/// @return as om_spectral_basis_init
OM_API OmStatus om_spectral_basis_init_part(const OmSurface* surface, const unsigned char* is_used,
                                            int npair, OmSpectralBasis* basis);
/// The basis of a scan: of its triangles, or of its points if it has no triangles. Connected pieces below 1 % of the
/// area have no rows.
/// @return as om_spectral_basis_init
OM_API OmStatus om_spectral_basis_init_scan(const OmScan* scan, int npair, OmSpectralBasis* basis);
OM_API void om_spectral_basis_done(OmSpectralBasis* basis);

// ---- maps -----------------------------------------------------------------------------------------

typedef struct OmSpectralDef {  // made by om_spectral_default_def
    int first, last, step;      // functions of b in the rounds, >= 1; default 10, 60, 5
    // b is a part of a: a has more functions below the same frequency, and as many of them are used (the slanted
    // matrix of Rodola et al. 2017). Needs a basis of a with about last x area of a / area of b functions; if it
    // has fewer, b uses fewer. Default false: as many of a as of b.
    bool is_partial;
    int nworker;  // threads, 0 is one per processor; the result does not depend on it; default 0
    OmCookie cookie;
} OmSpectralDef;

typedef struct OmSpectralReport {
    int nround;
    int npair_a, npair_b;  // functions of the last round
    // |C^T C - 1| / sqrt(columns) of the last round; 0: the map keeps areas.
    double orthogonality;
    double seconds;
} OmSpectralReport;

OM_API OmSpectralDef om_spectral_default_def(void);

/// Refine a point map in place.
/// @param map     in/out: a vertex of a for each vertex of b (b->nvert). At entry -1: unknown; out: -1 where b or its
///                vertex has no row
/// @param report  may be null
/// @return OM_OK; OM_INVALID (def, more functions than a basis has, a vertex of `map` that does not exist, fewer known
///         vertices than functions of the first round; the map is unchanged); OM_NO_MEMORY
OM_API OmStatus om_spectral_zoomout(const OmSpectralDef* def, const OmSpectralBasis* a,
                                    const OmSpectralBasis* b, int* map, OmSpectralReport* report);

/// The matrix of a point map: functions of a, taken at the partners of b's vertices, in the functions of b.
/// @param C  (nb x na), by rows
/// @return OM_OK; OM_INVALID (counts, a vertex that does not exist, no known vertex); OM_NO_MEMORY
OM_API OmStatus om_spectral_get_matrix(const OmSpectralBasis* a, const OmSpectralBasis* b,
                                       const int* map, int na, int nb, double* C);
/// The point map of a matrix: for each vertex of b the vertex of a whose row of phi times C^T is nearest to b's row.
/// @param def  is_partial and nworker are used
/// @return OM_OK; OM_INVALID (counts, a value of C that is not finite); OM_NO_MEMORY
OM_API OmStatus om_spectral_map_from_matrix(const OmSpectralDef* def, const OmSpectralBasis* a,
                                            const OmSpectralBasis* b, int na, int nb,
                                            const double* C, int* map);

/// From vertices to points on the triangles of a, after ZoomOut: of the triangles around map[i] the point that is
/// nearest to vertex i of b in spectral space (Ezuz and Ben-Chen 2017).
/// @param def      as for om_spectral_zoomout: the functions of its last round are used
/// @param surface  the surface of which a is the basis, or of a part of which
/// @param map      (b->nvert)
/// @param tri      out: triangle of the surface; -1 where map is -1 or the part has no triangle there  (b->nvert)
/// @param bary     out: weights of its vertices, >= 0, sum 1              (b->nvert x 3)
/// @return as om_spectral_zoomout; OM_INVALID also for a surface that does not fit the basis
OM_API OmStatus om_spectral_map_to_surface(const OmSpectralDef* def, const OmSpectralBasis* a,
                                           const OmSurface* surface, const OmSpectralBasis* b,
                                           const int* map, int* tri, double* bary);

// ---- first maps -----------------------------------------------------------------------------------

/// The nearest vertex of a in space, for shapes that lie on each other.
/// @param x_a, x_b  positions, m, one for each vertex of the shapes
/// @return OM_OK; OM_INVALID (a position that is not finite); OM_NO_MEMORY
OM_API OmStatus om_spectral_map_from_nearest(const OmSpectralBasis* a, const double* x_a,
                                             const OmSpectralBasis* b, const double* x_b, int* map);
/// A map from vertices that are known to belong together: their wave kernels (Aubry et al. 2011) are carried over,
/// C with the least squares error that commutes with the Laplacians (Ovsjanikov et al. 2012), then the point map.
/// @param npair  functions of both, e.g. 20
/// @param landmark_a, landmark_b  vertices (nlandmark each); without landmarks: wave kernels of the whole, which cannot
///                                tell the sides of a symmetric shape
/// @return OM_OK; OM_INVALID (counts, a landmark without a row); OM_NO_MEMORY
OM_API OmStatus om_spectral_map_from_landmarks(const OmSpectralBasis* a, const OmSpectralBasis* b,
                                               int npair, int nlandmark, const int* landmark_a,
                                               const int* landmark_b, int* map);

#ifdef __cplusplus
}
#endif
#endif
