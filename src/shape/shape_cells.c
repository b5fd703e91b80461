// shape_cells.c: the hexahedral cells of a mesh whose tetrahedra are cut as those of om_tet_mesh_box.
//
// The six of a cell share its main diagonal. The first three have all eight corners: the corner with bits (x, y, z), x
// the lowest bit, is in tetrahedron and place of `corner_at`. The other three must then be what Kuhn's division says.
#include "shape/shape_internal.h"

// Tetrahedron of the cell and place in it, of each corner: 000 100 010 110 001 101 011 111.
static const int corner_at[8][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 2}, {2, 1}, {2, 2}, {1, 2}, {0, 3}};
// Corners of the six tetrahedra.
static const int cell_tet[6][4] = {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7},
                                   {0, 5, 1, 7}, {0, 6, 4, 7}, {0, 3, 2, 7}};

// Corners of each cell by bits.
static OmStatus find_corners(const OmTetMesh* mesh, int* corner) {
    OM_CHECK(mesh->ntet > 0 && mesh->ntet % 6 == 0, OM_INVALID,
             "mesh: %d tetrahedra are not cells of six, as those of a box", mesh->ntet);
    for (int c = 0; c < mesh->ntet / 6; c++) {
        const int* tet = &mesh->tet_vert[24 * (size_t)c];
        int* v = &corner[8 * (size_t)c];
        for (int b = 0; b < 8; b++) v[b] = tet[4 * corner_at[b][0] + corner_at[b][1]];
        for (int k = 0; k < 24; k++)
            OM_CHECK(tet[k] == v[cell_tet[k / 4][k % 4]], OM_INVALID,
                     "mesh: tetrahedra %d to %d are not a cell as those of a box", 6 * c,
                     6 * c + 5);
        for (int a = 0; a < 8; a++)
            for (int b = 0; b < a; b++)
                OM_CHECK(v[a] != v[b], OM_INVALID, "mesh: cell %d has vertex %d twice", c, v[a]);
    }
    return OM_OK;
}

// The axis of the cells with most faces on the boundary: that through a sheet. Equal: the last one.
static OmStatus find_thin_axis(const OmTetMesh* mesh, int* axis) {
    int count[3] = {0, 0, 0}, *neighbor;
    OM_ALLOC(neighbor, 4 * (size_t)mesh->ntet);
    OmStatus status = om__tet_neighbors(mesh, neighbor);
    for (int f = 0; status == OM_OK && f < 4 * mesh->ntet; f++) {
        if (neighbor[f] >= 0) continue;
        int all = 7, none = 7;  // bits that are set, and not set, in the three corners
        for (int k = 0; k < 3; k++) {
            int bits = cell_tet[f / 4 % 6][om__face_corner[f % 4][k]];
            all &= bits;
            none &= ~bits;
        }
        for (int a = 0; a < 3; a++) count[a] += ((all | none) >> a) & 1;
    }
    om_free(neighbor);
    *axis = 2;
    for (int a = 0; a < 2; a++)
        if (count[a] > count[*axis]) *axis = a;
    return status;
}

OmStatus om_tet_mesh_find_cells(const OmTetMesh* mesh, int** node) {
    static const int around[4] = {0, 1, 3, 2};  // counter-clockwise in the plane of two bits
    OmStatus status = OM_OK;
    int *corner = NULL, *out = NULL, axis = 2;
    *node = NULL;
    OM_ALLOC_DONE(corner, 8 * ((size_t)mesh->ntet / 6 + 1));
    OM_ALLOC_DONE(out, 8 * ((size_t)mesh->ntet / 6 + 1));
    OM_TRY_DONE(find_corners(mesh, corner));
    OM_TRY_DONE(find_thin_axis(mesh, &axis));
    int p = (axis + 1) % 3, q = (axis + 2) % 3;
    for (int c = 0; c < mesh->ntet / 6; c++)
        for (int a = 0; a < 8; a++) {
            int in = around[a % 4];
            int bits = (in & 1) << p | (in >> 1) << q | (a >= 4) << axis;
            out[8 * (size_t)c + (size_t)a] = corner[8 * (size_t)c + (size_t)bits];
        }
    *node = out;
    out = NULL;
done:
    om_free(corner);
    om_free(out);
    return status;
}
