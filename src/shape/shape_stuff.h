// shape_stuff.h: the lattice of isosurface stuffing, shared by shape_stuff.c and shape_stuff_grade.c.
#ifndef OM_SHAPE_STUFF_H
#define OM_SHAPE_STUFF_H

#include "shape/shape_edge_table.h"
#include "shape/shape_internal.h"
#include "shape/shape_middles.h"

typedef struct OmCrossing {  // of the level, on an edge of the lattice
    double t;                // place, as a fraction of the edge from its first point
    int vert;                // of the mesh, or -1
} OmCrossing;

typedef struct OmLattice {
    const OmStuffDef* def;
    double a;     // side of the cubes, m
    int n[3];     // cubes
    int ncorner;  // points with smaller index are corners of cubes, then come centres, then midpoints
    int nlattice;    // corners and centres
    int npoint;      // all points
    OmVec3 origin;   // of the first corner, m
    OmVec3* middle;  // positions of the midpoints                            (npoint - nlattice)
    double* f;       // value at each point, 0 once moved onto the surface       (npoint)
    int (*tet)[4];   // tetrahedra that may hold a part of the solid                   (ntet)
    int ntet, cap_tet;
    OmEdgeTable crossed;   // edges that the level crosses
    OmCrossing* crossing;  // of each of them                                 (crossed.nedge)
    int* active;           // index among the points that have a crossing, or -1         (npoint)
    OmVec3* moved;         // position of active points                                 (nactive)
    int* vert;             // mesh vertex of each point, or -1                           (npoint)
    OmTetMesh* mesh;
    int cap_mesh_vert, cap_mesh_tet;
} OmLattice;

#define OM__LATTICE_LONGEST \
    (1 / 0.92344)  // longest edge, a, over the mean one, (3 + 4 sqrt(3) / 2) / 7 a

OmVec3 om__lattice_position(const OmLattice* l, int p);
// The cube of the lattice that holds a fine point, if one does.
bool om__lattice_find_cube(const OmLattice* l, int fine, int at[3]);
double om__lattice_eval(const OmLattice* l, OmVec3 x);
// Squared length of an edge; of the lattice's without rounding, so that equal ones are equal.
double om__lattice_length2(const OmLattice* l, int p, int q);
OmStatus om__lattice_add_tet(OmLattice* l, const int p[4]);
// Halve edges of l->tet until none that holds a fine point of the definition is longer than asked.
OmStatus om__lattice_grade(OmLattice* l);
// How far the dihedral angles of an element are from 0 and 180 degrees, rad; 0: flat or inverted.
double om__tet_flatness(const OmTetMesh* mesh, int e);
// Move vertices of flat elements.
OmStatus om__mesh_improve(OmTetMesh* mesh);

#endif
