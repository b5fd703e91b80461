// shape_file_common.h: what the tests of mesh files share.
#ifndef OMENTUM_SHAPE_FILE_COMMON_H
#define OMENTUM_SHAPE_FILE_COMMON_H

#include "test_files.h"

#include "omentum/shape_file.h"

/// A box of odd numbers, with labels and sets whose names try the escapes of the formats.
static inline void make_mesh(OmTetMesh* mesh) {
    assert_ok(
        om_tet_mesh_box(om_vec3(-1.0 / 3, 0.1, 1e-7), om_vec3(2.0 / 7, 1.0, 3), 3, 4, 5, mesh));
    OmRng rng = om_rng_init(3, 0);
    for (int i = 0; i < 3 * mesh->nvert; i++) mesh->x[i] += om_rng_range(&rng, -0.01, 0.01);
    for (int e = 0; e < mesh->ntet; e++) mesh->tet_label[e] = e % 5 - 1;
    const int few[] = {3, 77, 12};
    assert_ok(om_tet_mesh_add_set(mesh, "attachment", few, 3));
    const int one[] = {mesh->nvert - 1};
    assert_ok(om_tet_mesh_add_set(mesh, "a <b> & \"c\" 100%", one, 1));
}

// Every format of volume meshes, and a name of its kind.
static const struct {
    const char* name;
    OmMeshFormat format;
} mesh_format[] = {{"a.vtu", OM_MESH_VTU},   {"b.vtu", OM_MESH_VTU_ASCII},
                   {"a.vtk", OM_MESH_VTK},   {"b.vtk", OM_MESH_VTK_ASCII},
                   {"a.msh", OM_MESH_MSH41}, {"b.msh", OM_MESH_MSH22}};
#define NMESH_FORMAT (sizeof mesh_format / sizeof *mesh_format)

#endif
