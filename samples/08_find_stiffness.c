// 08_find_stiffness.c: a calibration of ten lines: how stiff a hanging bar is, from how far a mark on it sinks.
//
// A calibration needs a function that turns parameters into errors, and bounds. Here the model is a bar that
// hangs from its top; two marks were measured to a tenth of a millimetre. The same with probes, grasps, point
// clouds and files of observations: omentum/calibrate_tissue.h and `omentum calibrate`.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

enum { N = 2, NZ = 6 };

static const double measured[] = {0.01174,
                                  0.00869};  // m, how far the marks sank: 3,000 Pa and noise

// The middle of the lowest layer, and of that at half height.
static const int mark[] = {N / 2 + (N + 1) * (N / 2),
                           N / 2 + (N + 1) * (N / 2 + (N + 1) * (NZ / 2))};

static OmStatus make_bar(OmTetMesh* mesh) {
    OmStatus status = om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.03, 0.03, 0.08), N, N, NZ, mesh);
    int top[(N + 1) * (N + 1)], num = 0;
    for (int i = 0; i < mesh->nvert && status == OM_OK; ++i)
        if (mesh->x[3 * i + 2] > 0.08 - 1e-9) top[num++] = i;
    return status == OM_OK ? om_tet_mesh_add_set(mesh, "attachment", top, num) : status;
}

// Errors, m, of a bar of this stiffness. Several threads call it at once: each call makes its own model.
static OmStatus evaluate(void* ctx, const double* param, int nworker, double* error) {
    OmTissueModel* model = NULL;
    OmTissueState* state = NULL;
    OmTissueWork* work = NULL;
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), ctx);
    def.material_default = (OmMaterial){.young = param[0], .poisson = 0.3, .law = OM_NEO_HOOKEAN};
    def.solver.nworker = nworker;
    OmStatus status = om_tissue_create(&def, &model);
    if (status == OM_OK) status = om_tissue_state_create(model, &state);
    if (status == OM_OK) status = om_tissue_work_create(model, &work);
    if (status == OM_OK) status = om_tissue_find_rest(model, state, work, 1e-4, 50, NULL);
    for (int k = 0; k < 2 && status == OM_OK; ++k) {
        double before = om_tissue_mesh(model)->x[3 * mark[k] + 2];
        error[k] = fabs(before - om_tissue_x(state)[3 * mark[k] + 2] - measured[k]);
    }
    om_tissue_work_destroy(work);
    om_tissue_state_destroy(state);
    om_tissue_destroy(model);
    return status;
}

static OmStatus calibrate(OmTetMesh* mesh) {
    OmCalibrationResult result;
    OmCalibrationDef def = om_calibration_default_def(evaluate, mesh, 2);
    om_calibration_add_param(&def, "young", 500, 50000, 10000, true);
    def.noise = 1e-4;
    OmStatus status = om_calibration_run(&def, NULL, &result);
    if (status != OM_OK) return status;
    const OmCalibrationProfile* p = &result.profile[0];
    printf("%.0f Pa, between %.0f and %.0f: %s\n", result.best[0], p->lo, p->hi,
           p->is_determined ? "determined" : "the data cannot determine it");
    printf("error %.3f mm, after %d evaluations; %.3f mm at the start\n", 1e3 * result.cost,
           result.neval, 1e3 * result.cost_start);
    bool is_right = p->is_determined && fabs(result.best[0] / 3000 - 1) < 0.1;
    om_calibration_result_done(&result);
    return is_right ? OM_OK : OM_NOT_CONVERGED;
}

int main(void) {
    OmTetMesh mesh;
    memset(&mesh, 0, sizeof mesh);
    OmStatus status = make_bar(&mesh);
    if (status == OM_OK) status = calibrate(&mesh);
    if (status != OM_OK) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    om_tet_mesh_done(&mesh);
    return status == OM_OK ? 0 : 1;
}
