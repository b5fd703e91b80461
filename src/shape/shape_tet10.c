// shape_tet10.c: meshes of quadratic tetrahedra: from linear ones, checks, files.
#include <string.h>

#include "shape/shape_file_internal.h"

void om_tet10_mesh_done(OmTet10Mesh* mesh) {
    if (!mesh) return;
    for (int s = 0; s < mesh->nset; s++) om_free(mesh->set[s].vert);
    om_free(mesh->set);
    om_free(mesh->x);
    om_free(mesh->elem_node);
    om_free(mesh->elem_label);
    *mesh = (OmTet10Mesh){0};
}

OmStatus om_tet10_mesh_init(OmTet10Mesh* mesh, int nnode, int nelem) {
    *mesh = (OmTet10Mesh){0};
    OM_CHECK(nnode >= 0 && nelem >= 0, OM_INVALID, "mesh: %d nodes, %d elements", nnode, nelem);
    *mesh = (OmTet10Mesh){.nnode = nnode, .nelem = nelem};
    mesh->x = om_calloc(3 * (size_t)nnode, sizeof(double));
    mesh->elem_node = om_calloc(10 * (size_t)nelem, sizeof(int));
    mesh->elem_label = om_calloc((size_t)nelem, sizeof(int));
    if (mesh->x && mesh->elem_node && mesh->elem_label) return OM_OK;
    om_tet10_mesh_done(mesh);
    return OM_NO_MEMORY;
}

OmTetMesh om__tet10_view(const OmTet10Mesh* mesh) {
    return (OmTetMesh){.nvert = mesh->nnode,
                       .ntet = mesh->nelem,
                       .nset = mesh->nset,
                       .x = mesh->x,
                       .tet_label = mesh->elem_label,
                       .set = mesh->set};
}

OmStatus om_tet10_mesh_from_nodes(const OmTetMesh* fine, const int* node, OmTet10Mesh* mesh) {
    // edges 01 02 03 12 13 23 of om_tet_mesh_refine_nodes in VTK's order
    static const int from[10] = {0, 1, 2, 3, 4, 7, 5, 6, 8, 9};
    OmTetMesh sets = {.nvert = fine->nvert};
    OM_TRY(om_tet10_mesh_init(mesh, fine->nvert, fine->ntet / 8));
    memcpy(mesh->x, fine->x, 3 * (size_t)fine->nvert * sizeof *mesh->x);
    for (int e = 0; e < mesh->nelem; e++) {
        mesh->elem_label[e] = fine->tet_label[8 * e];
        for (int k = 0; k < 10; k++) mesh->elem_node[10 * e + k] = node[10 * e + from[k]];
    }
    OmStatus status = OM_OK;
    for (int s = 0; s < fine->nset && status == OM_OK; s++)
        status =
            om_tet_mesh_add_set(&sets, fine->set[s].name, fine->set[s].vert, fine->set[s].nvert);
    mesh->nset = sets.nset;
    mesh->set = sets.set;
    if (status < 0) om_tet10_mesh_done(mesh);
    return status;
}

OmStatus om_tet10_mesh_from_tet(const OmTetMesh* tet, OmTet10Mesh* mesh) {
    OmTetMesh fine;
    int* node = NULL;
    *mesh = (OmTet10Mesh){0};
    OM_TRY(om_tet_mesh_copy(tet, &fine));
    OmStatus status = om_tet_mesh_refine_nodes(&fine, &node);
    if (status == OM_OK) status = om_tet10_mesh_from_nodes(&fine, node, mesh);
    om_tet_mesh_done(&fine);
    om_free(node);
    return status;
}

static double volume6(const double* x, const int v[4]) {
    OmVec3 a = om_load3(x, v[0]);
    OmVec3 ab = om_sub(om_load3(x, v[1]), a), ac = om_sub(om_load3(x, v[2]), a);
    return om_dot(om_cross(ab, ac), om_sub(om_load3(x, v[3]), a));
}

OmStatus om_tet10_mesh_validate(const OmTet10Mesh* mesh) {
    OM_CHECK(mesh->nnode >= 0 && mesh->nelem >= 0 && mesh->nelem <= INT32_MAX / 11, OM_INVALID,
             "mesh: %d nodes, %d elements", mesh->nnode, mesh->nelem);
    for (int i = 0; i < mesh->nnode; i++)
        OM_CHECK(om_is_finite3(om_load3(mesh->x, i)), OM_INVALID,
                 "mesh: the position of node %d is not finite", i);
    for (int e = 0; e < mesh->nelem; e++) {
        const int* node = mesh->elem_node + 10 * (size_t)e;
        for (int k = 0; k < 10; k++)
            OM_CHECK(node[k] >= 0 && node[k] < mesh->nnode, OM_INVALID,
                     "mesh: element %d names node %d of %d", e, node[k], mesh->nnode);
        OM_CHECK(volume6(mesh->x, node) > 0, OM_INVALID,
                 "mesh: the vertices of element %d have a volume of %g m^3; it must be positive", e,
                 volume6(mesh->x, node) / 6);
    }
    for (int s = 0; s < mesh->nset; s++)
        for (int i = 0; i < mesh->set[s].nvert; i++)
            OM_CHECK(mesh->set[s].vert[i] >= 0 && mesh->set[s].vert[i] < mesh->nnode, OM_INVALID,
                     "mesh: set %s names node %d of %d", mesh->set[s].name, mesh->set[s].vert[i],
                     mesh->nnode);
    return OM_OK;
}

// ---- files ------------------------------------------------------------------------------------------

OmStatus om_tet10_mesh_load(const char* path, OmMeshFrame given, unsigned flags,
                            OmTet10Mesh* mesh) {
    OmFileMesh m;
    *mesh = (OmTet10Mesh){0};
    OM_CHECK(given.unit >= 0 && isfinite(given.unit), OM_INVALID, "%s: unit: %g m is no length",
             path, given.unit);
    OmStatus status = om__parse_file(path, OM_FILE_TETS, &m);
    if (status == OM_OK) {
        OmMeshFrame frame = om__place_points(&m, given, NULL);
        status = om__finish_tet10_mesh(&m, frame.unit, flags, mesh);
        om__file_mesh_done(&m);
    }
    return status < 0 && status != OM_IO ? om_error_prefix(status, "%s", path) : status;
}

OmStatus om_tet10_mesh_save_format(const OmTet10Mesh* mesh, const char* path, double unit,
                                   OmMeshFormat format, const OmMeshArray* array, int narray) {
    OM_TRY(om__check_unit(path, unit));
    OM_TRY(om_tet10_mesh_validate(mesh));
    const OmTetMesh nodes = om__tet10_view(mesh);
    const OmMeshOutput out = {&nodes,   mesh->elem_node, 10,    {unit, OM_SPACE_RAS},
                              1 / unit, array,           narray};
    return om__save_mesh(&out, path, format);
}

OmStatus om_tet10_mesh_save(const OmTet10Mesh* mesh, const char* path, double unit) {
    OmMeshFormat format = OM_MESH_VTU;
    OM_TRY(om__find_format(path, &format));
    return om_tet10_mesh_save_format(mesh, path, unit, format, NULL, 0);
}
