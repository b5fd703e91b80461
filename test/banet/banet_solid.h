// banet_solid.h: the elements of a sample, for tests of room banet.
#ifndef OMENTUM_BANET_SOLID_H
#define OMENTUM_BANET_SOLID_H

#include "test_common.h"

#include "omentum/fem.h"
#include "omentum/shape_tet10.h"

// Of linear elements (node is null), or of the quadratic ones that the mesh divides by eight.
static inline void make_solid_mesh(const OmTetMesh* mesh, const int* node, OmFemMesh* out) {
    OmTet10Mesh tet10;
    if (!node) {
        assert_ok(om_fem_mesh_from_tet(mesh, OM_TET4, out));
        return;
    }
    assert_ok(om_tet10_mesh_from_nodes(mesh, node, &tet10));
    assert_ok(om_fem_mesh_from_tet10(&tet10, out));
    om_tet10_mesh_done(&tet10);
}

#endif
