// bench_static.c: the hang scenes: a beam held at one end comes to rest under its own weight of 1 m/s^2, the
// whole load at once, from its rest shape, to a residual of 1e-5.
#include <stdio.h>

#include "bench.h"

static const struct {
    int cells[3];
    bool is_quick;
    double peer_ms, goal_ms;  // St Venant-Kirchhoff; the goal of neo-Hookean is twice that
} scene_table[] = {
    {{19, 6, 6}, true, 81, 20},
    {{36, 11, 11}, false, 790, 200},
    {{54, 18, 18}, false, 5100, 1500},
};
#define NSCENE ((int)(sizeof scene_table / sizeof *scene_table))

static OmStatus measure(int k, const OmTetMesh* mesh, const BenchOptions* options, OmLaw law) {
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.gravity = om_vec3(0, 0, -1);
    def.material_default.law = law;
    def.solver.nworker = options->nworker;
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmStatus status = OM_OK;
    OmTissueReport report = {0};
    double* time = om_alloc((size_t)options->nrun, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(om_tissue_create(&def, &m));
    OM_TRY_DONE(om_tissue_state_create(m, &s));
    OM_TRY_DONE(om_tissue_work_create(m, &w));
    for (int run = 0; run < options->nrun; ++run) {
        om_tissue_state_reset(m, s);
        double start = bench_now();
        OM_TRY_DONE(om_tissue_find_rest(m, s, w, 1e-5, 100, &report));
        time[run] = bench_now() - start;
    }
    char scene[64];
    const int* n = scene_table[k].cells;
    bool is_venant = law == OM_ST_VENANT_KIRCHHOFF;
    snprintf(scene, sizeof scene, "hang beam %dx%dx%d, %s", n[0], n[1], n[2], om_law_name(law));
    BenchRow row = {.bench = "static",
                    .scene = scene,
                    .work = "rest to 1e-5, whole load at once",
                    .size = mesh->ntet,
                    .nworker = options->nworker,
                    .steps = report.newton,
                    .reference = is_venant ? "SOFA v26.06, Newton-CG, one core" : NULL,
                    .reference_ms = scene_table[k].peer_ms,
                    .goal_ms = scene_table[k].goal_ms * (is_venant ? 1 : 2),
                    .iterations = report.iterations,
                    .residual = report.newton_residual,
                    .hash = om_tissue_state_hash(s)};
    bench_times(time, options->nrun, &row);
    row.nrun = options->nrun;
    status = bench_print(&row);
done:
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    om_free(time);
    return status;
}

OmStatus bench_static(const BenchOptions* options) {
    for (int k = 0; k < NSCENE; ++k) {
        if (options->is_quick && !scene_table[k].is_quick) continue;
        OmTetMesh mesh;
        OmStatus status = bench_box(om_vec3(0.1, 0.03, 0.03), scene_table[k].cells, 0, &mesh);
        if (status >= 0) status = measure(k, &mesh, options, OM_ST_VENANT_KIRCHHOFF);
        if (status >= 0) status = measure(k, &mesh, options, OM_NEO_HOOKEAN);
        om_tet_mesh_done(&mesh);
        if (status < 0) return status;
    }
    return OM_OK;
}
