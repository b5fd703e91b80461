// cli_model_list.c: omentum model --list: the labels or segments of a volume.
#include "cli_model.h"

static void print_row(const OmLabelRow* row, bool has_layers) {
    char label[16] = "-";
    const OmVec3 size = om_scale(1e3, om_sub(row->hi, row->lo));
    if (row->label >= 0) snprintf(label, sizeof label, "%d", row->label);
    printf("%6s ", label);
    if (has_layers) printf("%5d %5d ", row->layer, row->value);
    printf("%10lld %11.2f %5d %9.1f  %5.0f x %.0f x %.0f%s  %s\n", (long long)row->nvoxel,
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
            "values from %g to %g: these are intensities, no labels; choose with --window LO,HI\n",
            list->min, list->max);
        return;
    }
    if (list->nrow == 0) printf("no voxel has a value above 0\n");
    if (list->nrow > 0) {
        printf("%6s %s%10s %11s %5s %9s  %s  %s\n", "label", list->has_layers ? "layer value " : "",
               "voxels", "mL", "parts", "largest/%", "R x A x S mm", "name");
    }
    bool is_cut = false;
    for (int r = 0; r < list->nrow; r++) {
        print_row(&list->row[r], list->has_layers);
        is_cut = is_cut || list->row[r].is_cut;
    }
    if (is_cut) printf("cut: the label reaches the border of the volume\n");
    if (list->nempty > 0)
        printf("%d more name%s of the file's table ha%s no voxel\n", list->nempty,
               list->nempty == 1 ? "" : "s", list->nempty == 1 ? "s" : "ve");
}

int om_cli_model_list(const OmModelDef* def, bool is_quiet) {
    OmLabelList list;
    OmStatus status =
        om_model_list_labels(def->input, def->volume, om_cli_progress(is_quiet), &list);
    if (status < 0) return om_cli_fail("model", status);
    om_cli_progress_done();
    print_list(def, &list);
    om_label_list_done(&list);
    return OM_EXIT_OK;
}
