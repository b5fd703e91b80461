// shape_middles.h: new vertices in the middle of edges, for both refinements.
#ifndef OMENTUM_SHAPE_MIDDLES_H
#define OMENTUM_SHAPE_MIDDLES_H

#include "omentum/shape.h"

/// Corners of the edges of a tetrahedron.
extern const int om__tet_edge[6][2];
/// Positions and sets of a finer mesh: those of `mesh`, then the middle of each edge, which joins the sets that have
/// both of its ends.
/// @param end   vertices of each edge                          (nedge x 2)
/// @param fine  has mesh->nvert + nedge vertices
/// @return OM_OK; OM_NO_MEMORY
OmStatus om__mesh_add_middles(const OmTetMesh* mesh, int nedge, const int* end, OmTetMesh* fine);

#endif
