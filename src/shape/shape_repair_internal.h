// shape_repair_internal.h: shared by the steps of om_surface_repair.
#ifndef OM_SHAPE_REPAIR_INTERNAL_H
#define OM_SHAPE_REPAIR_INTERNAL_H

#include "omentum/shape_repair.h"
#include "shape/shape_internal.h"

typedef struct OmMend {  // the surface at work
    const OmSurfaceRepairDef* def;
    OmSurfaceRepair* report;
    int nvert, vertcap, ntri, tricap;
    double* x;        // (nvert x 3)
    int* tri;         // (ntri x 3)
    double diagonal;  // of the box, m
    int nmended;      // triangles dropped, turned or added
} OmMend;

typedef struct OmHalf {  // an edge of one triangle
    int lo, hi;          // vertices
    int corner;          // 3 t + c: from corner c of triangle t to the next
    bool is_forward;     // from lo to hi
} OmHalf;

typedef struct OmMendEdges {
    int nedge;
    OmHalf* half;  // sorted by edge                               (3 ntri)
    int* adr;      // half edges of edge e: adr[e] .. adr[e + 1]   (nedge + 1)
    int* edge;     // of each corner                               (3 ntri)
} OmMendEdges;

OmStatus om__mend_edges_init(const OmMend* m, OmMendEdges* e);
void om__mend_edges_done(OmMendEdges* e);
static inline int om__edge_count(const OmMendEdges* e, int i) { return e->adr[i + 1] - e->adr[i]; }
// How many half edges more run forward than back.
int om__edge_excess(const OmMendEdges* e, int i);

void om__mend_found(OmMend* m, OmDefect kind, int count, OmVec3 place);
OmVec3 om__mend_center(const OmMend* m, int tri);
// Keep the triangles with keep[t] nonzero.
void om__mend_keep(OmMend* m, const unsigned char* keep);
static inline void om__mend_turn(OmMend* m, int t) {
    int* v = m->tri + 3 * (size_t)t;
    int swap = v[1];
    v[1] = v[2];
    v[2] = swap;
}

// Number the triangles of each piece connected over edges of two triangles; flip[t]: whether triangle t must be turned
// to agree with the first of its piece (null: not wanted).
OmStatus om__mend_pieces(const OmMend* m, const OmMendEdges* e, int* piece, unsigned char* flip,
                         int* npiece);
// Steps: edges of fewer than two triangles and of more, winding, holes.
OmStatus om__mend_edges(OmMend* m);
// Steps: parts inside out, nested parts, edges that touch or stay open.
OmStatus om__mend_parts(OmMend* m);
// Count the pairs of triangles that cross.
OmStatus om__mend_crossings(OmMend* m);

#endif
