/// omentum/shape_repair.h: mending surfaces and meshes as files bring them (room `shape`, floor 1).
///
/// A surface bounds a solid if it is closed: then the winding number of a point is an integer, and the solid is where
/// it is above 0. Shells that cross or overlap are their union, a shell within a shell that is wound the other way
/// round is a cavity, and one that is wound the same way changes nothing. om_surface_repair closes a surface whose
/// defects have one meaning, counts each kind with the place of the first, and refuses the others:
///
///     OmSurfaceRepair r;
///     OmSurfaceRepairDef def = om_surface_repair_default_def();
///     om_surface_load_flags("liver.stl", OM_UNIT_MM, OM_MESH_KEEP_DEGENERATE, &surface);
///     if (om_surface_repair(&def, &surface, &r) < 0) fprintf(stderr, "%s\n", om_error_message());
#ifndef OMENTUM_SHAPE_REPAIR_H
#define OMENTUM_SHAPE_REPAIR_H

#include "omentum/shape.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmRepairMode {
    OM_REPAIR_MEND,  // mend what has one meaning, up to a share of the triangles
    OM_REPAIR_ALL,  // also above that share; large holes are filled, edges that stay open are tolerated
    OM_REPAIR_STRICT,  // refuse every defect, name the first
} OmRepairMode;

// Kinds of defects, in the order in which they are mended.
typedef enum OmDefect {
    OM_DEFECT_UNMERGED,    // vertices on open edges merged with others
    OM_DEFECT_FLAT,        // triangles that name a vertex twice, dropped
    OM_DEFECT_NO_AREA,     // triangles of three vertices on one line; they bound nothing and stay
    OM_DEFECT_DUPLICATE,   // triangles that occur again, dropped
    OM_DEFECT_FIN,         // triangles of fins and inner walls, dropped
    OM_DEFECT_WINDING,     // triangles wound against their neighbours, turned
    OM_DEFECT_HOLE,        // holes filled
    OM_DEFECT_INSIDE_OUT,  // parts whose triangles faced inwards, turned
    OM_DEFECT_NESTED,      // parts in another one, wound the same way: they count as filled
    OM_DEFECT_TOUCHING,    // edges that join four or more triangles
    OM_DEFECT_CROSSING,    // pairs of triangles that cross
    OM_DEFECT_OPEN,        // edges that stay open or disagree
    OM_NDEFECT
} OmDefect;

typedef struct OmSurfaceRepair {
    struct {
        int count;
        OmVec3 first;  // place of the first, m
    } defect[OM_NDEFECT];
    int npart;            // pieces connected over edges
    int ncavity;          // of these: cavities
    double hole_largest;  // diagonal of the box of the largest hole that was filled, m
    double merged_most;   // tolerance of merging, m
    double share;         // triangles mended / triangles of the input
    double volume;        // where the winding number is above 0, m^3
    double overlap;       // of it, counted once for each further unit, m^3
    double negative;      // where the winding number is below 0: left out, m^3
} OmSurfaceRepair;

typedef struct OmSurfaceRepairDef {
    OmCookie cookie;
    OmRepairMode mode;  // default OM_REPAIR_MEND
    double merge;       // tolerance of merging, of the diagonal of the box; default 1e-5
    double max_hole;    // larger holes are refused, of the diagonal of the box; default 0.1
    double max_share;   // a larger share of mended triangles is refused; default 0.1
} OmSurfaceRepairDef;

OM_API OmSurfaceRepairDef om_surface_repair_default_def(void);
/// Mend a surface, so that om_sdf_from_surface has a solid.
/// @param surface  in/out; as before if refused
/// @param report   also set if refused; may be null
/// @return OM_OK; OM_INVALID (no triangles, a vertex that does not exist or is not finite, or a defect that is not
///         mended: the message has kind, place in RAS mm and remedy); OM_NO_MEMORY
OM_API OmStatus om_surface_repair(const OmSurfaceRepairDef* def, OmSurface* surface,
                                  OmSurfaceRepair* report);
/// What a repair did about a kind of defect: a sentence without a full stop, "" if there was none. Places are RAS mm.
OM_API void om_surface_repair_words(const OmSurfaceRepair* report, OmDefect kind, char* out,
                                    size_t size);

typedef struct OmTetMeshWeld {
    int nvert;     // vertices that became others
    int nface;     // pairs of faces that were joined
    OmVec3 first;  // centre of the first, m
} OmTetMeshWeld;

/// Join faces of the boundary that lie on each other: their vertices are doubled, and the body would come apart there.
/// Vertices that coincide elsewhere stay apart. Sets keep their vertices.
/// @param tolerance  m; 0: 1e-6 of the diagonal of the box. At most a tenth of the shortest edge counts.
/// @return OM_OK; OM_INVALID (a mesh that om_tet_mesh_validate refuses, or a face of three elements); OM_NO_MEMORY, the
///         mesh is as before
OM_API OmStatus om_tet_mesh_weld(OmTetMesh* mesh, double tolerance, OmTetMeshWeld* report);

#ifdef __cplusplus
}
#endif
#endif
