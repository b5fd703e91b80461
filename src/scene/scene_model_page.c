// scene_model_page.c: report.html of a patient model.
#include <string.h>

#include "scene/scene_model_internal.h"

#define MAX_CELL 96
#define MAX_CELL_LEN 96

typedef struct Table {  // rows of three cells: quantity, value, unit; owns the texts
    char text[MAX_CELL][MAX_CELL_LEN];
    const char* cell[MAX_CELL];
    int n;
} Table;

static void add_row(Table* t, const char* what, double value, const char* format,
                    const char* unit) {
    if (t->n + 3 > MAX_CELL) return;  // further sets are left out
    snprintf(t->text[t->n], MAX_CELL_LEN, "%s", what);
    snprintf(t->text[t->n + 1], MAX_CELL_LEN, format, value);
    snprintf(t->text[t->n + 2], MAX_CELL_LEN, "%s", unit);
    for (int i = 0; i < 3; i++, t->n++) t->cell[t->n] = t->text[t->n];
}

static void put_table(Table* t, OmReport* page) {
    static const char* const heading[] = {"", "value", "unit"};
    om_report_table(page, heading, 3, t->cell, t->n / 3);
    t->n = 0;
}

// What was asked, beside what came out.
static void add_question(const OmModelReport* r, OmReport* page) {
    char text[sizeof r->selected + 512] = "";
    int n = 0;
    if (r->selected[0])
        n = snprintf(
            text, sizeof text,
            "Asked: a mesh for simulation of %s%s: %lld voxels of %.3g x %.3g x %.3g mm, %.2f mL. ",
            r->fit_is_of_sheet ? "a sheet on " : "", r->selected, (long long)r->nvoxel,
            r->voxel.x * 1e3, r->voxel.y * 1e3, r->voxel.z * 1e3, r->label_volume * 1e6);
    n += snprintf(text + n, sizeof text - (size_t)n,
                  "Came out: %d tetrahedra with edges of %.2f mm in the mean", r->quality.ntet,
                  r->quality.edge_mean * 1e3);
    if (r->has_fit)
        snprintf(text + n, sizeof text - (size_t)n,
                 "; their surface is %.2f mm from that of the %s in the mean, %.2f mm at most.",
                 r->surface_error_mean * 1e3, om__model_fit_name(r), r->surface_error_max * 1e3);
    else
        snprintf(text + n, sizeof text - (size_t)n, ".");
    om_report_paragraph(page, text);
}

// Qualities of a mesh that matter for a simulation; notes follow below.
static void add_verdict(const OmModelReport* r, OmReport* page) {
    const double angle = r->quality.dihedral_min * 180 / OM_PI;
    const double error = fmax(r->volume_error, fabs(r->label_error));
    bool is_good = error <= 0.02 && angle > 8 && !r->has_loss;
    char text[1280];
    char whole[64] = "";
    if (r->has_fit && !r->has_loss)
        snprintf(whole, sizeof whole, "No part of the %s is lost. ", om__model_fit_name(r));
    snprintf(text, sizeof text, "%sVolume %s 2 %%%s, smallest dihedral angle %s 8 degrees.", whole,
             error <= 0.02 ? "within" : "off by more than",
             r->label_volume > 0 ? " of the whole label" : "", angle > 8 ? "above" : "not above");
    if (r->has_loss) om_model_describe_loss(r, text, sizeof text);
    om_report_verdict(page, text, is_good);
    add_question(r, page);
    for (const char* line = r->note; *line;) {
        size_t len = strcspn(line, "\n");
        char note[sizeof r->note + 8];
        snprintf(note, sizeof note, "Note: %.*s.", (int)len, line);
        om_report_paragraph(page, note);
        line += len + (line[len] != 0);
    }
    if (!r->warning[0]) return;
    char note[sizeof r->warning + 8];
    snprintf(note, sizeof note, "Note: %s.", r->warning);
    om_report_paragraph(page, note);
}

static void add_facts(const OmModelReport* r, OmReport* page) {
    const OmMeshQuality* q = &r->quality;
    char text[4][64];
    const char* value[4] = {text[0], text[1], text[2], text[3]};
    const char* const label[] = {"tetrahedra", "smallest dihedral angle", "volume",
                                 r->label_volume > 0 ? "volume against the whole label"
                                                     : "volume error"};
    snprintf(text[0], sizeof text[0], "%d", q->ntet);
    snprintf(text[1], sizeof text[1], "%.1f\xc2\xb0", q->dihedral_min * 180 / OM_PI);
    snprintf(text[2], sizeof text[2], "%.4g mL", q->volume * 1e6);
    if (r->label_volume > 0)
        snprintf(text[3], sizeof text[3], "%+.2f %%", r->label_error * 100);
    else
        snprintf(text[3], sizeof text[3], "%.2f %%", r->volume_error * 100);
    om_report_facts(page, value, label, 4);
}

static void add_gap(Table* t, const char* name[3], const OmSurfaceGap* gap) {
    add_row(t, name[0], gap->mean * 1e3, "%.3f", "mm");
    add_row(t, name[1], gap->p95 * 1e3, "%.3f", "mm");
    add_row(t, name[2], gap->max * 1e3, "%.3f", "mm");
}

static void add_fit(Table* t, const OmModelReport* r) {
    const OmShapeFit* fit = &r->fit;
    char name[4][64];
    const char* const format[4] = {"%s's surface to the mesh, mean",
                                   "mesh's surface to the %s, mean", "handles of the %s",
                                   "cavities of the %s"};
    for (int i = 0; i < 4; i++) snprintf(name[i], sizeof name[i], format[i], om__model_fit_name(r));
    const char* to_mesh[3] = {name[0], "95 % are below", "largest"};
    const char* to_solid[3] = {name[1], "95 % are below", "largest"};
    add_gap(t, to_mesh, &fit->to_mesh);
    add_gap(t, to_solid, &fit->to_solid);
    add_row(t, name[2], fit->solid.nhandle, "%.0f", "");
    add_row(t, "handles of the mesh", fit->mesh.nhandle, "%.0f", "");
    add_row(t, name[3], fit->solid.ncavity, "%.0f", "");
    add_row(t, "cavities of the mesh", fit->mesh.ncavity, "%.0f", "");
    add_row(t, "missing in the mesh", fit->lost * 1e6, "%.3f", "mL");
    add_row(t, "too much in the mesh", fit->added * 1e6, "%.3f", "mL");
}

static void add_mesh_table(Table* t, const OmModelReport* r, OmReport* page) {
    const OmMeshQuality* q = &r->quality;
    const double deg = 180 / OM_PI;
    add_row(t, "vertices", q->nvert, "%.0f", "");
    add_row(t, "parts", q->npart, "%.0f", "");
    add_row(t, "elements through the thickness", q->nlayer, "%.0f", "");
    if (!isnan(r->bending_error))
        add_row(t, "bending error of this mesh, quadratic elements", r->bending_error * 100, "%.1f",
                "%");
    add_row(t, "smallest dihedral angle", q->dihedral_min * deg, "%.2f", "degrees");
    add_row(t, "largest dihedral angle", q->dihedral_max * deg, "%.2f", "degrees");
    add_row(t, "shortest edge", q->edge_min * 1e3, "%.2f", "mm");
    add_row(t, "mean edge", q->edge_mean * 1e3, "%.2f", "mm");
    add_row(t, "longest edge", q->edge_max * 1e3, "%.2f", "mm");
    if (r->has_fit) {
        add_fit(t, r);
    } else {
        add_row(t, "boundary to level set, mean", r->surface_error_mean * 1e3, "%.3f", "mm");
        add_row(t, "boundary to level set, largest", r->surface_error_max * 1e3, "%.3f", "mm");
    }
    add_row(t, "shift of the level set for the right volume", r->level_shift * 1e3, "%.3f", "mm");
    if (r->mask_volume > 0) {
        add_row(t, "volume of the whole label", r->label_volume * 1e6, "%.3f", "mL");
        add_row(t, "of it left out", r->left_out * 1e6, "%.3f", "mL");
        add_row(t, "holes filled", r->filled * 1e6, "%.3f", "mL");
        add_row(t, "volume of the cleaned label map", r->mask_volume * 1e6, "%.3f", "mL");
        add_row(t, "volume inside the organ's surface", r->surface_volume * 1e6, "%.3f", "mL");
        add_row(t, "level set to faces of voxels, mean", r->surface_error_voxel, "%.3f", "voxels");
        add_row(t, "parts found in the label map", r->npart_mask, "%.0f", "");
        add_row(t, "parts kept", r->npart_kept, "%.0f", "");
        add_row(t, "voxels capped at the border of the volume", r->ncapped, "%.0f", "");
    }
    add_row(t, "time", r->seconds, "%.2f", "s");
    put_table(t, page);
}

static void add_angles(const OmMeshQuality* q, OmReport* page) {
    double x[OM_DIHEDRAL_BIN + 1], y[OM_DIHEDRAL_BIN + 1];
    for (int i = 0; i <= OM_DIHEDRAL_BIN; i++) {
        x[i] = 10 * i;
        y[i] = i < OM_DIHEDRAL_BIN ? (double)q->dihedral_bin[i] : 0;
    }
    OmReportChart chart = {.title = "Dihedral angles",
                           .x_label = "dihedral angle, degrees",
                           .y_label = "edges of elements"};
    chart.series[chart.nseries++] = (OmReportSeries){"", x, y, OM_DIHEDRAL_BIN + 1, true};
    om_report_chart(page, &chart);
}

static void add_sets(Table* t, const OmPatient* p, OmReport* page) {
    for (int s = 0; s < p->mesh.nset; s++) {
        add_row(t, p->mesh.set[s].name, p->mesh.set[s].nvert, "%.0f", "vertices");
    }
    if (p->nroi > 0) {
        add_row(t, "region of interest", p->nroi, "%.0f", "points");
        add_row(t, "its radius", p->roi_radius * 1e3, "%.1f", "mm");
    }
    if (t->n == 0) return;
    om_report_heading(page, "Sets");
    put_table(t, page);
}

static void add_materials(Table* t, const OmPatient* p, OmReport* page) {
    om_report_heading(page, "Materials");
    for (int i = 0; i < p->nmaterial; i++) {
        const OmPatientMaterial* m = &p->material[i];
        char name[OM_NAME_LEN + 16];
        if (m->label < 0)
            snprintf(name, sizeof name, "%s", m->name);
        else
            snprintf(name, sizeof name, "%s (label %d)", m->name, m->label);
        add_row(t, name, m->young, "%.4g", "Pa, Young's modulus");
        add_row(t, "", m->poisson, "%.4g", "Poisson's ratio");
        add_row(t, "", m->density, "%.4g", "kg/m\xc2\xb3");
    }
    put_table(t, page);
}

OmStatus om__model_save_page(const OmPatient* patient, const OmModelReport* report,
                             const char* path) {
    OmReport page;
    Table* table = om_calloc(1, sizeof *table);
    if (!table) return OM_NO_MEMORY;
    om_report_begin(&page, "Patient model", patient->name);
    add_verdict(report, &page);
    add_facts(report, &page);
    OmStatus status = om_patient_add_pictures(patient, &page);
    om_report_heading(&page, "Mesh");
    add_mesh_table(table, report, &page);
    add_angles(&report->quality, &page);
    add_sets(table, patient, &page);
    add_materials(table, patient, &page);
    om_free(table);
    if (status < 0)
        om_report_done(&page);
    else
        status = om_report_save(&page, path);
    return status;
}
