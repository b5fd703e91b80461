// shape_file_vtu_write.c: writing VTK's XML files of unstructured grids (.vtu) and of clouds (.vtp).
//
// Arrays are written in place: as text, or compressed by zlib in blocks and encoded as base64, the table
// of the blocks first. Labels are a cell array, sets point arrays of bytes.
#include <string.h>

#include "shape/shape_file_internal.h"

#define BLOCK ((size_t)1 << 18)

static OmStatus write_compressed(OmText* text, const unsigned char* data, size_t size) {
    size_t nblock = (size + BLOCK - 1) / BLOCK;
    uint32_t* head = om_alloc(3 + nblock, sizeof *head);
    if (!head) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OmText packed = {0};
    head[0] = (uint32_t)nblock;
    head[1] = (uint32_t)BLOCK;
    head[2] = (uint32_t)(size % BLOCK);
    for (size_t i = 0; i < nblock; i++) {
        unsigned char* bytes;
        size_t len, n = size - i * BLOCK < BLOCK ? size - i * BLOCK : BLOCK;
        OM_TRY_DONE(om__deflate(data + i * BLOCK, n, &bytes, &len));
        status = om_text_append_raw(&packed, (const char*)bytes, len);
        om_free(bytes);
        OM_TRY_DONE(status);
        head[3 + i] = (uint32_t)len;
    }
    OM_TRY_DONE(om_text_append_base64(text, head, (3 + nblock) * sizeof *head));
    OM_TRY_DONE(om_text_append_base64(text, packed.str, packed.len));
done:
    om_text_done(&packed);
    om_free(head);
    return status;
}

static OmStatus write_array(OmText* text, bool is_text, const OmMeshArray* a, int nitem) {
    static const char* const type[] = {"Float64", "Float32", "Int32", "UInt8"};
    size_t count = (size_t)nitem * (size_t)a->ncomp;
    OM_TRY(om_text_append(text, "<DataArray type=\"%s\" Name=\"", type[a->type]));
    OM_TRY(om_text_append_html(text, a->name));
    OM_TRY(om_text_append(text, "\" NumberOfComponents=\"%d\" format=\"%s\">\n", a->ncomp,
                          is_text ? "ascii" : "binary"));
    if (is_text)
        OM_TRY(om__write_values(text, a->type, a->value, count, a->ncomp));
    else
        OM_TRY(write_compressed(text, a->value, count * om__array_size(a->type)));
    return om_text_append(text, "%s</DataArray>\n", is_text ? "" : "\n");
}

static OmStatus write_cells(OmText* text, bool is_text, const OmMeshOutput* out) {
    const int n = out->mesh->ntet, nnode = out->ncell_node;
    OmStatus status = OM_OK;
    unsigned char* type = NULL;
    int* offset = NULL;
    OM_ALLOC_DONE(type, n);
    OM_ALLOC_DONE(offset, n);
    memset(type, om__vtk_tetra(nnode), (size_t)n);
    for (int e = 0; e < n; e++) offset[e] = nnode * (e + 1);
    const OmMeshArray array[] = {{"connectivity", OM_ARRAY_INT, nnode, true, out->cell_node},
                                 {"offsets", OM_ARRAY_INT, 1, true, offset},
                                 {"types", OM_ARRAY_BYTE, 1, true, type}};
    OM_TRY_DONE(om_text_append(text, "<Cells>\n"));
    for (int i = 0; i < 3; i++) {
        OmMeshArray a = array[i];
        if (i == 0) a.ncomp = 1;  // VTK expects a flat list
        OM_TRY_DONE(write_array(text, is_text, &a, i == 0 ? nnode * n : n));
    }
    OM_TRY_DONE(om_text_append(text, "</Cells>\n"));
done:
    om_free(type);
    om_free(offset);
    return status;
}

static OmStatus write_points(OmText* text, bool is_text, const OmMeshOutput* out) {
    double* x = om__scaled_points(out->mesh->x, out->mesh->nvert, out->scale);
    if (!x) return OM_NO_MEMORY;
    const OmMeshArray a = {"Points", OM_ARRAY_DOUBLE, 3, false, x};
    OmStatus status = om_text_append(text, "<Points>\n");
    if (status == OM_OK) status = write_array(text, is_text, &a, out->mesh->nvert);
    if (status == OM_OK) status = om_text_append(text, "</Points>\n");
    om_free(x);
    return status;
}

static OmStatus write_data(OmText* text, bool is_text, const OmMeshOutput* out) {
    const OmTetMesh* mesh = out->mesh;
    OmStatus status = OM_OK;
    unsigned char* flag = NULL;
    const OmMeshArray label = {"tet_label", OM_ARRAY_INT, 1, true, mesh->tet_label};
    OM_ALLOC_DONE(flag, mesh->nvert);
    OM_TRY_DONE(om_text_append(text, "<PointData>\n"));
    for (int s = 0; s < mesh->nset; s++) {
        const OmMeshArray a = {mesh->set[s].name, OM_ARRAY_BYTE, 1, false, flag};
        om__set_flags(&mesh->set[s], mesh->nvert, flag);
        OM_TRY_DONE(write_array(text, is_text, &a, mesh->nvert));
    }
    for (int i = 0; i < out->narray; i++)
        if (!out->array[i].is_cell)
            OM_TRY_DONE(write_array(text, is_text, &out->array[i], mesh->nvert));
    OM_TRY_DONE(om_text_append(text, "</PointData>\n<CellData>\n"));
    OM_TRY_DONE(write_array(text, is_text, &label, mesh->ntet));
    for (int i = 0; i < out->narray; i++)
        if (out->array[i].is_cell)
            OM_TRY_DONE(write_array(text, is_text, &out->array[i], mesh->ntet));
    OM_TRY_DONE(om_text_append(text, "</CellData>\n"));
done:
    om_free(flag);
    return status;
}

// Unit and space of the file. Of a grid the space is a number, because meshio refuses files with strings; of a cloud,
// which meshio does not read, it is the string of 3D Slicer: the codes of its letters and a zero.
static OmStatus write_fields(OmText* text, OmMeshFrame frame, bool is_cloud) {
    const bool is_lps = frame.space == OM_SPACE_LPS;
    char unit[OM_NUMBER_SIZE + 1];
    unit[om_number_write(unit, frame.unit)] = 0;
    OM_TRY(om_text_append(text, "<FieldData>\n"));
    OM_TRY(is_cloud
               ? om_text_append(text,
                                "<DataArray type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" "
                                "format=\"ascii\">\n%s 83 0\n</DataArray>\n",
                                is_lps ? "76 80" : "82 65")
               : om_text_append(text,
                                "<DataArray type=\"Int32\" Name=\"is_lps\" NumberOfTuples=\"1\" "
                                "format=\"ascii\">\n%d\n</DataArray>\n",
                                is_lps));
    return om_text_append(
        text,
        "<DataArray type=\"Float64\" Name=\"metres_per_unit\" NumberOfTuples=\"1\" "
        "format=\"ascii\">\n%s\n</DataArray>\n</FieldData>\n",
        unit);
}

static OmStatus write_head(OmText* text, const char* type, bool is_text) {
    return om_text_append(text,
                          "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" "
                          "version=\"1.0\" byte_order=\"%s\" header_type=\"UInt32\"%s>\n"
                          "<%s>\n",
                          type, om__is_little() ? "LittleEndian" : "BigEndian",
                          is_text ? "" : " compressor=\"vtkZLibDataCompressor\"", type);
}

OmStatus om__write_vtu(const OmMeshOutput* out, bool is_text, OmText* text) {
    OM_TRY(write_head(text, "UnstructuredGrid", is_text));
    OM_TRY(write_fields(text, out->frame, false));
    OM_TRY(om_text_append(text, "<Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\">\n",
                          out->mesh->nvert, out->mesh->ntet));
    OM_TRY(write_data(text, is_text, out));
    OM_TRY(write_points(text, is_text, out));
    OM_TRY(write_cells(text, is_text, out));
    return om_text_append(text, "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
}

// ---- clouds: every point is a vertex cell, so that ParaView shows it -------------------------------------------

static OmStatus write_cells_of(OmText* text, const char* section, const int* vert, int n,
                               int per_cell) {
    int* offset = om_alloc((size_t)n, sizeof *offset);
    if (!offset) return OM_NO_MEMORY;
    for (int i = 0; i < n; i++) offset[i] = per_cell * (i + 1);
    const OmMeshArray connectivity = {"connectivity", OM_ARRAY_INT, 1, true, vert};
    const OmMeshArray offsets = {"offsets", OM_ARRAY_INT, 1, true, offset};
    OmStatus status = om_text_append(text, "<%s>\n", section);
    if (status == OM_OK) status = write_array(text, false, &connectivity, per_cell * n);
    if (status == OM_OK) status = write_array(text, false, &offsets, n);
    if (status == OM_OK) status = om_text_append(text, "</%s>\n", section);
    om_free(offset);
    return status;
}

OmStatus om__write_cloud_vtp(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text) {
    OmStatus status = OM_OK;
    int* point = NULL;
    double* x = om__scaled_points(cloud->x, cloud->npoint, 1 / frame.unit);
    if (!x) return OM_NO_MEMORY;
    OM_ALLOC_DONE(point, cloud->npoint);
    for (int i = 0; i < cloud->npoint; i++) point[i] = i;
    const OmMeshArray points = {"Points", OM_ARRAY_DOUBLE, 3, false, x};
    const OmMeshArray normals = {"Normals", OM_ARRAY_DOUBLE, 3, false, cloud->normal};
    OM_TRY_DONE(write_head(text, "PolyData", false));
    OM_TRY_DONE(write_fields(text, frame, true));
    OM_TRY_DONE(om_text_append(text,
                               "<Piece NumberOfPoints=\"%d\" NumberOfVerts=\"%d\" "
                               "NumberOfPolys=\"%d\">\n<PointData>\n",
                               cloud->npoint, cloud->npoint, cloud->ntri));
    if (cloud->normal) OM_TRY_DONE(write_array(text, false, &normals, cloud->npoint));
    OM_TRY_DONE(om_text_append(text, "</PointData>\n<Points>\n"));
    OM_TRY_DONE(write_array(text, false, &points, cloud->npoint));
    OM_TRY_DONE(om_text_append(text, "</Points>\n"));
    OM_TRY_DONE(write_cells_of(text, "Verts", point, cloud->npoint, 1));
    OM_TRY_DONE(write_cells_of(text, "Polys", cloud->tri_vert, cloud->ntri, 3));
    OM_TRY_DONE(om_text_append(text, "</Piece>\n</PolyData>\n</VTKFile>\n"));
done:
    om_free(x);
    om_free(point);
    return status;
}
