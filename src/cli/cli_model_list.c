// cli_model_list.c: omentum model --list: the labels or segments of a volume, the labels and sets of a mesh.
#include <math.h>
#include <string.h>

#include "cli_model.h"
#include "omentum/shape_file.h"

// ---- volumes ----------------------------------------------------------------------------------------------

static void print_row(const OmLabelRow* row, bool has_layers) {
    char label[24] = "-";
    const OmVec3 size = om_scale(1e3, om_sub(row->hi, row->lo));
    if (row->label >= 0) snprintf(label, sizeof label, "%d", row->label);
    if (row->value < 0) snprintf(label, sizeof label, "%.0f", row->stored);
    printf("%6s ", label);
    if (has_layers) printf("%5d %5d ", row->layer, row->value);
    printf("%10lld %11.2f %6d %9.1f  %5.0f x %.0f x %.0f%s  %s\n", (long long)row->nvoxel,
           row->volume * 1e6, row->npart, 100 * row->largest / row->volume, size.x, size.y, size.z,
           row->is_cut ? ", cut" : "", row->name);
}

static void print_list(const OmModelDef* def, const OmLabelList* list) {
    printf("%s: %d x %d x %d voxels of %.3g x %.3g x %.3g mm", def->input, list->dim[0],
           list->dim[1], list->dim[2], list->voxel.x * 1e3, list->voxel.y * 1e3,
           list->voxel.z * 1e3);
    if (list->has_layers && def->volume < 0) printf(", %d layers", list->nentry);
    if (def->volume >= 0) printf(", volume %d of 0 to %d", def->volume, list->nentry - 1);
    printf("\n");
    if (list->is_intensity) {
        printf(
            "values from %g to %g: these are intensities, not labels; choose with --window LO,HI\n",
            list->min, list->max);
        return;
    }
    if (list->nrow == 0) printf("no voxel has a value above 0\n");
    if (list->nrow > 0) {
        printf("%6s %s%10s %11s %6s %9s  %s  %s\n", "label", list->has_layers ? "layer value " : "",
               "voxels", "mL", "parts", "largest/%", "R x A x S mm", "name");
    }
    bool is_cut = false;
    for (int r = 0; r < list->nrow; r++) {
        print_row(&list->row[r], list->has_layers);
        is_cut = is_cut || list->row[r].is_cut;
    }
    if (list->between > 0) {
        printf(
            "%.2g %% of the voxels above 0 have values between labels: the map was probably interpolated\n"
            "after it was segmented; mesh with --threshold 0.5, or resample with nearest neighbour\n",
            100 * list->between);
    }
    if (is_cut) printf("cut: the label reaches the border of the volume\n");
    if (list->note[0]) printf("note: %s\n", list->note);
    if (list->nempty > 0) {
        printf("%d more name%s of the file's table ha%s no voxel\n", list->nempty,
               list->nempty == 1 ? "" : "s", list->nempty == 1 ? "s" : "ve");
    }
}

static OmStatus list_volume(const OmModelDef* def, const OmProgress* progress) {
    OmLabelList list;
    OM_TRY(om_label_list_load(def->input, def->volume, progress, &list));
    om_cli_progress_done();
    print_list(def, &list);
    om_label_list_done(&list);
    return OM_OK;
}

// ---- meshes and surfaces ----------------------------------------------------------------------------------

static void print_frame(const OmModelDef* def, OmMeshFrame stated) {
    const OmMeshFrame used = om_mesh_frame_join((OmMeshFrame){def->unit, def->space}, stated);
    printf("unit %g mm (%s), %s (%s)\n", used.unit * 1e3,
           def->unit > 0     ? "as was told"
           : stated.unit > 0 ? "stated by the file"
                             : "assumed: not stated by the file",
           used.space == OM_SPACE_LPS ? "LPS" : "RAS",
           def->space != OM_SPACE_NONE     ? "as was told"
           : stated.space != OM_SPACE_NONE ? "stated by the file"
                                           : "assumed: not stated by the file");
}

static void print_extent(const double* x, int nvert, double volume) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    for (int v = 0; v < nvert; v++) {
        lo = om_min3(lo, om_load3(x, v));
        hi = om_max3(hi, om_load3(x, v));
    }
    OmVec3 size = om_scale(1e3, om_sub(hi, lo));
    printf("%.4g x %.4g x %.4g mm (R x A x S)", size.x, size.y, size.z);
    if (volume > 0) printf(", %.4g mL", volume * 1e6);
    printf("\n");
}

static double tet_volume(const OmTetMesh* m, int e) {
    const int* v = &m->tet_vert[4 * (size_t)e];
    OmVec3 o = om_load3(m->x, v[0]);
    OmVec3 a = om_sub(om_load3(m->x, v[1]), o), b = om_sub(om_load3(m->x, v[2]), o);
    return om_dot(om_cross(a, b), om_sub(om_load3(m->x, v[3]), o)) / 6;
}

// Labels in ascending order, one pass over the elements each.
static void print_labels(const OmTetMesh* m) {
    enum { MAX_ROW = 256 };
    long long last = -(1LL << 40);
    printf("%6s %10s %11s\n", "label", "elements", "mL");
    for (int row = 0; row < MAX_ROW; row++) {
        long long label = 1LL << 40;
        for (int e = 0; e < m->ntet; e++)
            if (m->tet_label[e] > last && m->tet_label[e] < label) label = m->tet_label[e];
        if (label == 1LL << 40) return;
        int count = 0;
        double volume = 0;
        for (int e = 0; e < m->ntet; e++) {
            if (m->tet_label[e] != label) continue;
            count++;
            volume += tet_volume(m, e);
        }
        printf("%6lld %10d %11.2f\n", label, count, volume * 1e6);
        last = label;
    }
    printf("and labels above %lld\n", last);
}

static OmStatus list_mesh(const OmModelDef* def) {
    OmTetMesh mesh;
    OmMeshFrame stated;
    OmModelReport report = {0};
    OM_TRY(om_model_load_mesh(def, &mesh, &stated, &report));
    om_cli_progress_done();
    printf("%s: %d tetrahedra, %d vertices\n", def->input, mesh.ntet, mesh.nvert);
    print_frame(def, stated);
    print_extent(mesh.x, mesh.nvert, om_tet_mesh_volume(&mesh));
    print_labels(&mesh);
    for (int s = 0; s < mesh.nset; s++)
        printf("set %s: %d vertices\n", mesh.set[s].name, mesh.set[s].nvert);
    om_cli_model_notes(&report);
    om_tet_mesh_done(&mesh);
    return OM_OK;
}

static void print_repair(const OmSurfaceRepair* repair) {
    for (int k = 0; k < OM_NDEFECT; k++) {
        char text[320];
        om_surface_repair_words(repair, (OmDefect)k, text, sizeof text);
        if (text[0]) printf("note: %s\n", text);
    }
}

// A surface as the file has it, then what a model would mend, or why it would be refused.
static OmStatus list_surface(const OmModelDef* def) {
    OmSurface surface;
    OmSurfaceCheck check;
    OmSurfaceRepair repair;
    OmMeshFrame stated;
    const OmMeshFrame given = {def->unit, def->space};
    OM_TRY(om_surface_load_frame(def->input, given, OM_MESH_KEEP_DEGENERATE, &surface, &stated));
    om_cli_progress_done();
    OmStatus status = om_surface_check(&surface, &check);
    if (status < 0) {
        om_surface_done(&surface);
        return status;
    }
    const int ntri = surface.ntri, nvert = surface.nvert;
    OmSurfaceRepairDef repair_def = om_surface_repair_default_def();
    repair_def.mode = def->repair;
    status = om_surface_repair(&repair_def, &surface, &repair);
    if (status == OM_OK || status == OM_INVALID) {
        const bool is_open = status < 0 || repair.defect[OM_DEFECT_OPEN].count > 0;
        printf("%s: %d triangles, %d vertices in %d part%s, %s\n", def->input, ntri, nvert,
               check.ncomponent, check.ncomponent == 1 ? "" : "s",
               check.first_tri < 0 ? "closed"
               : is_open           ? "not closed"
                                   : "mended as the notes say");
        print_frame(def, stated);
        print_extent(surface.x, surface.nvert, status == OM_OK ? repair.volume : 0);
        if (status == OM_OK) print_repair(&repair);
        if (status < 0) printf("note: a model of it is refused: %s\n", om_error_message());
        status = OM_OK;
    }
    om_surface_done(&surface);
    return status;
}

static bool is_one_of(const char* word, const char* const* list, int n) {
    for (int i = 0; i < n; i++)
        if (strcmp(word, list[i]) == 0) return true;
    return false;
}

int om_cli_model_list(const OmModelDef* def, bool is_quiet) {
    static const char* const mesh_ext[] = {"msh", "vtk", "vtu"};
    static const char* const surface_ext[] = {"stl", "obj", "ply", "off"};
    char ext[16];
    const OmProgress* progress = om_cli_progress(is_quiet);
    om_path_extension(def->input, ext, sizeof ext);
    OmStatus status = is_one_of(ext, mesh_ext, 3)      ? list_mesh(def)
                      : is_one_of(ext, surface_ext, 4) ? list_surface(def)
                                                       : list_volume(def, progress);
    return status < 0 ? om_cli_fail("model", status) : OM_EXIT_OK;
}
