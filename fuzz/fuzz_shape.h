// fuzz_shape.h: what must hold of every mesh and surface that a reader accepts.
#ifndef OMENTUM_FUZZ_SHAPE_H
#define OMENTUM_FUZZ_SHAPE_H

#include "fuzz_common.h"
#include "omentum/shape_repair.h"
#include "omentum/shape_tet10.h"

/// What was read is written and read again: the same mesh. (Only the bytes of positions count: a set may
/// have a name that a format cannot hold, and then saving refuses.)
static inline void fuzz_save_tet_mesh(const OmTetMesh* mesh, const char* suffix) {
    const char* path = fuzz_file((const uint8_t*)"", 0, suffix);
    OmTetMesh back;
    OmStatus status = om_tet_mesh_save(mesh, path, OM_UNIT_M);
    if (status == OM_OK) {
        status = om_tet_mesh_load_flags(path, OM_UNIT_M, OM_MESH_KEEP_UNUSED, &back);
        FUZZ_EXPECT(status == OM_OK);
        FUZZ_EXPECT(back.nvert == mesh->nvert && back.ntet == mesh->ntet);
        FUZZ_EXPECT(memcmp(back.x, mesh->x, 3 * (size_t)mesh->nvert * sizeof(double)) == 0);
        FUZZ_EXPECT(memcmp(back.tet_vert, mesh->tet_vert, 4 * (size_t)mesh->ntet * sizeof(int)) ==
                    0);
        FUZZ_EXPECT(memcmp(back.tet_label, mesh->tet_label, (size_t)mesh->ntet * sizeof(int)) == 0);
        om_tet_mesh_done(&back);
    }
    fuzz_file_done(path);
}

/// The same for a surface; STL keeps floats only, so there it must just be written.
static inline void fuzz_save_surface(const OmSurface* surface, const char* suffix) {
    const char* path = fuzz_file((const uint8_t*)"", 0, suffix);
    OmSurface back;
    FUZZ_EXPECT(om_surface_save(surface, path, OM_UNIT_M) == OM_OK);
    OmStatus status = om_surface_load_flags(path, OM_UNIT_M, OM_MESH_KEEP_UNUSED, &back);
    if (strcmp(suffix, ".stl") != 0) {
        FUZZ_EXPECT(status == OM_OK);
        FUZZ_EXPECT(back.nvert == surface->nvert && back.ntri == surface->ntri);
        FUZZ_EXPECT(memcmp(back.x, surface->x, 3 * (size_t)back.nvert * sizeof(double)) == 0);
        FUZZ_EXPECT(memcmp(back.tri_vert, surface->tri_vert, 3 * (size_t)back.ntri * sizeof(int)) ==
                    0);
    }
    if (status == OM_OK) om_surface_done(&back);
    fuzz_file_done(path);
}

static inline void fuzz_tet_mesh(const uint8_t* data, size_t size, const char* suffix) {
    const char* path = fuzz_file(data, size, suffix);
    OmTetMesh mesh;
    // odd inputs also take the forgiving ways through the reader
    unsigned flags =
        size % 2 ? OM_MESH_FLIP | OM_MESH_DROP_FLAT | OM_MESH_KEEP_UNUSED | OM_MESH_STRAIGHTEN : 0;
    OmStatus status = om_tet_mesh_load_flags(path, OM_UNIT_MM, flags, &mesh);
    fuzz_file_done(path);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(mesh.x == NULL && om_error_message()[0] != '\0');
        return;
    }
    FUZZ_EXPECT(mesh.nvert >= 4 && mesh.ntet >= 1);
    FUZZ_EXPECT(om_tet_mesh_validate(&mesh) == OM_OK);
    fuzz_save_tet_mesh(&mesh, suffix);
    FUZZ_EXPECT(om_tet_mesh_weld(&mesh, 0, NULL) <= 0);
    FUZZ_EXPECT(om_tet_mesh_validate(&mesh) == OM_OK);
    om_tet_mesh_done(&mesh);
}

/// All nodes of quadratic tetrahedra; what was read is written and read again.
static inline void fuzz_tet10_mesh(const uint8_t* data, size_t size, const char* suffix) {
    const char* path = fuzz_file(data, size, suffix);
    const OmMeshFrame frame = {OM_UNIT_M, OM_SPACE_RAS};
    OmTet10Mesh mesh, back;
    unsigned flags = size % 2 ? OM_MESH_FLIP | OM_MESH_DROP_FLAT : 0;
    OmStatus status = om_tet10_mesh_load(path, frame, flags, &mesh);
    fuzz_file_done(path);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(mesh.x == NULL && om_error_message()[0] != '\0');
        return;
    }
    FUZZ_EXPECT(mesh.nnode >= 4 && mesh.nelem >= 1 && om_tet10_mesh_validate(&mesh) == OM_OK);
    path = fuzz_file((const uint8_t*)"", 0, suffix);
    if (om_tet10_mesh_save(&mesh, path, OM_UNIT_M) == OM_OK) {
        FUZZ_EXPECT(om_tet10_mesh_load(path, frame, 0, &back) == OM_OK);
        FUZZ_EXPECT(back.nnode == mesh.nnode && back.nelem == mesh.nelem);
        FUZZ_EXPECT(memcmp(back.x, mesh.x, 3 * (size_t)mesh.nnode * sizeof(double)) == 0);
        FUZZ_EXPECT(memcmp(back.elem_node, mesh.elem_node, 10 * (size_t)mesh.nelem * sizeof(int)) ==
                    0);
        om_tet10_mesh_done(&back);
    }
    fuzz_file_done(path);
    om_tet10_mesh_done(&mesh);
}

static inline void fuzz_surface(const uint8_t* data, size_t size, const char* suffix) {
    const char* path = fuzz_file(data, size, suffix);
    OmSurface surface;
    OmStatus status = om_surface_load(path, OM_UNIT_MM, &surface);
    fuzz_file_done(path);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(surface.x == NULL && om_error_message()[0] != '\0');
        return;
    }
    FUZZ_EXPECT(surface.nvert >= 3 && surface.ntri >= 1);
    for (int i = 0; i < surface.nvert; ++i) FUZZ_EXPECT(om_is_finite3(om_load3(surface.x, i)));
    for (int i = 0; i < 3 * surface.ntri; ++i)
        FUZZ_EXPECT(surface.tri_vert[i] >= 0 && surface.tri_vert[i] < surface.nvert);
    OmSurfaceCheck check;
    FUZZ_EXPECT(om_surface_check(&surface, &check) == OM_OK);
    bool is_volume = strcmp(suffix, ".msh") == 0 || strcmp(suffix, ".vtu") == 0;
    fuzz_save_surface(&surface, is_volume ? ".ply" : suffix);
    // whatever the triangles are, the repair ends, and what it accepts has edges that exist
    OmSurfaceRepairDef def = om_surface_repair_default_def();
    def.mode = size % 2 ? OM_REPAIR_ALL : OM_REPAIR_MEND;
    FUZZ_EXPECT(om_surface_repair(&def, &surface, NULL) <= 0);
    FUZZ_EXPECT(om_surface_check(&surface, &check) == OM_OK);
    om_surface_done(&surface);
}

#endif
