// 05_patient_model.c: the clinical case: fat over one side of an organ, hiding a tumour on its surface.
//
//     05_patient_model [labels.nii.gz label]      without arguments, over an ellipsoid made here
//
// What `omentum model --sheet` does, in a few lines. Writes the folder 05_patient_model and reads it back.
#include <stdio.h>
#include <stdlib.h>

#include "omentum/omentum.h"

#define LABEL 3

// An organ of 80 x 50 x 40 mm at the patient's left, in voxels of 2.5 mm.
static OmStatus make_volume(OmVolume* volume) {
    OmStatus status = om_volume_init(volume, 40, 32, 44);
    if (status != OM_OK) return status;
    volume->grid.axis = om_mat3_scale(0.0025, om_mat3_identity());
    volume->grid.origin = om_vec3(-0.12, -0.04, -0.055);
    for (int k = 0, n = 0; k < 44; ++k)
        for (int j = 0; j < 32; ++j)
            for (int i = 0; i < 40; ++i, ++n) {
                OmVec3 q =
                    om_vec3((i - 19.5) * 2.5 / 20, (j - 15.5) * 2.5 / 25, (k - 21.5) * 2.5 / 40);
                ((float*)volume->voxel)[n] = om_dot(q, q) < 1 ? (float)LABEL : 0.0f;
            }
    return OM_OK;
}

static OmStatus describe_case(OmModelDef* def) {
    def->sheet.thickness = 0.006;
    snprintf(def->sheet.side, sizeof def->sheet.side, "anterior");
    def->sheet.tumour_radius = 0.010;
    def->sheet.tumour_height = 0.002;
    def->sheet.nattach = 2;
    OmStatus status = om_model_parse_attach("border:superior 25 %", &def->sheet.attach[0]);
    if (status != OM_OK) return status;
    return om_model_parse_attach("underside:random 10 % seed 7", &def->sheet.attach[1]);
}

static void print_patient(const OmPatient* patient, const OmModelReport* report) {
    printf("fat         %d tetrahedra, %.1f ml, dihedral angles above %.1f degrees\n",
           report->quality.ntet, 1e6 * report->quality.volume,
           report->quality.dihedral_min * 180 / 3.14159265358979323846);
    for (int s = 0; s < patient->mesh.nset; ++s)
        printf("%-11s %d vertices\n", patient->mesh.set[s].name, patient->mesh.set[s].nvert);
    printf("tumour      %d points within %.0f mm of (%.0f, %.0f, %.0f) mm\n", patient->nroi,
           1e3 * patient->roi_radius, 1e3 * patient->roi_center.x, 1e3 * patient->roi_center.y,
           1e3 * patient->roi_center.z);
    if (report->warning[0]) printf("note        %s\n", report->warning);
}

int main(int argc, char** argv) {
    OmVolume volume = {0};
    OmPatient patient = {0}, again = {0};
    OmModelReport report;
    OmStatus status = argc > 2 ? om_volume_load(argv[1], &volume) : make_volume(&volume);
    OmModelDef def = om_model_default_def("organ", 0.004);
    def.label[def.nlabel++] = argc > 2 ? atoi(argv[2]) : LABEL;
    if (status == OM_OK) status = describe_case(&def);
    if (status == OM_OK) status = om_model_build_volume(&def, &volume, NULL, &patient, &report);
    if (status == OM_OK) status = om_patient_save(&patient, &report, "05_patient_model");
    if (status == OM_OK) status = om_patient_load("05_patient_model/patient.yaml", &again);
    if (status == OM_OK)
        print_patient(&again, &report);
    else
        fprintf(stderr, "%s\n", om_error_message());
    om_patient_done(&again);
    om_patient_done(&patient);
    om_volume_done(&volume);
    return status == OM_OK ? 0 : 1;
}
