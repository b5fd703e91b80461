// bench_fem.c: the lift scenes: one end of a beam or a slab is fixed, the other goes up 2 cm in 1 s and
// stays. 20 steps of warm-up, 200 timed, each with the least of its times in all runs. 25 CG iterations a step, and
// multigrid to 1e-3, from a zero guess; with linear elements and, on small meshes to 1e-3, quadratic elements.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"

#define NWARM 20
#define NSTEP 200
#define MAX_QUADRATIC 5000  // elements; each weighs as much as eight linear ones

typedef enum Kind { LINEAR, QUADRATIC, NKIND } Kind;
static const char* const kind_name[] = {"", ", quadratic"};

static const struct {
    const char* name;
    OmVec3 size;  // m
    int cells[3];
    bool is_quick;
    // by law: SOFA v26.06, 25 CG iterations, one core; corotational: its fastest element
    double peer_ms[3];
    double goal_ms[2];  // corotational, to be reached: with multigrid to 1e-3; with 25 iterations
} scene_table[] = {
    {"beam", {0.1, 0.03, 0.03}, {15, 4, 4}, true, {0.68, 1.33, 0.70}, {0, 0}},
    {"beam", {0.1, 0.03, 0.03}, {19, 6, 6}, true, {1.77, 3.64, 1.78}, {1, 0.45}},
    {"beam", {0.1, 0.03, 0.03}, {36, 11, 11}, false, {11.8, 22.8, 10.9}, {7, 3}},
    {"beam", {0.1, 0.03, 0.03}, {67, 21, 21}, false, {80.5, 157, 78.1}, {60, 20}},
    {"slab", {0.12, 0.12, 0.005}, {15, 15, 1}, true, {0, 0, 0}, {0, 0}},
    {"slab", {0.12, 0.12, 0.005}, {26, 26, 1}, false, {0, 0, 0}, {0, 0}},
    {"slab", {0.12, 0.12, 0.005}, {38, 38, 3}, false, {0, 0, 0}, {0, 0}},
};
static const OmLaw law_table[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_ST_VENANT_KIRCHHOFF};
#define NSCENE ((int)(sizeof scene_table / sizeof *scene_table))

// A tool that holds the whole end face: a sphere so large that it is flat there.
static OmPose end_tool(int k, double lift, double* radius) {
    OmVec3 L = scene_table[k].size;
    *radius = 1000;
    OmPose pose = {om_vec3(L.x + *radius - 1e-5, L.y / 2, L.z / 2 + lift), om_quat_identity()};
    return pose;
}

static OmStatus measure(int k, const OmTetMesh* mesh, const BenchOptions* options, int law,
                        bool is_plain, Kind kind) {
    char scene[64];
    const int* n = scene_table[k].cells;
    snprintf(scene, sizeof scene, "lift %s %dx%dx%d, %s%s", scene_table[k].name, n[0], n[1], n[2],
             om_law_name(law_table[law]), kind_name[kind]);
    const char* work = is_plain ? "step, 25 block-Jacobi iterations" : "step, multigrid to 1e-3";
    if (!bench_is_wanted(options, scene, work)) return OM_OK;
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), mesh);
    def.gravity = om_vec3(0, 0, 0);
    def.rayleigh_mass = 0;
    def.material_default.law = law_table[law];
    def.element = kind == QUADRATIC ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR;
    def.solver.nworker = options->nworker;
    def.solver.preconditioner = is_plain ? OM_BLOCK_JACOBI : OM_MULTIGRID;
    def.solver.max_iterations = is_plain ? 25 : 200;
    def.solver.tolerance = is_plain ? 0 : 1e-3;
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmStatus status = OM_OK;
    double* time = om_alloc((size_t)options->nrun, NSTEP * sizeof *time);
    double iterations = 0, residual = 0, radius;
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(om_tissue_create(&def, &m));
    OM_TRY_DONE(om_tissue_state_create(m, &s));
    OM_TRY_DONE(om_tissue_work_create(m, &w));
    const double h = 0.02;
    int ntime = 0;
    for (int run = 0; run < options->nrun; ++run) {
        om_tissue_state_reset(m, s);
        OM_TRY_DONE(om_tissue_grasp(m, s, 0, end_tool(k, 0, &radius), 1000, NULL));
        for (int step = 0; step < NWARM + NSTEP; ++step) {
            double lift = 0.02 * fmin(1, fmax(0, (step + 1 - NWARM) * h));
            OM_TRY_DONE(om_tissue_move_grasp(s, 0, end_tool(k, lift, &radius)));
            OmTissueReport report;
            double start = bench_now();
            OM_TRY_DONE(om_tissue_step(m, s, w, h, &report));
            if (step < NWARM) continue;
            time[ntime++] = bench_now() - start;
            iterations += report.iterations;
            residual = fmax(residual, report.residual);
        }
    }
    BenchRow row = {
        .bench = "fem",
        .scene = scene,
        .work = work,
        .size = mesh->ntet,
        .nworker = options->nworker,
        .steps = NSTEP,
        .reference =
            is_plain && scene_table[k].peer_ms[law] > 0
                ? "SOFA v26.06, same law (fastest corotational), 25 CG iterations, one core"
                : NULL,
        .reference_ms = scene_table[k].peer_ms[law],
        .goal_ms = law == 0 && kind == LINEAR ? scene_table[k].goal_ms[is_plain] : 0,
        .iterations = iterations / ntime,
        .residual = residual,
        .bytes_per_element = (double)om_tissue_memory(m, w) / mesh->ntet,
        .hash = om_tissue_state_hash(s)};
    bench_steps(time, options->nrun, NSTEP, &row);
    status = bench_print(&row);
done:
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    om_free(time);
    return status;
}

OmStatus bench_fem(const BenchOptions* options) {
    for (int k = 0; k < NSCENE; ++k) {
        if (options->is_quick && !scene_table[k].is_quick) continue;
        OmTetMesh mesh;
        OmStatus status = bench_box(scene_table[k].size, scene_table[k].cells, 0, &mesh);
        for (int law = 0; law < 3; ++law)
            for (int plain = 1; plain >= 0 && status >= 0; --plain)
                for (int kind = 0; kind < NKIND && status >= 0; ++kind) {
                    bool is_asked = scene_table[k].peer_ms[law] > 0 || (law == 0 && kind == LINEAR);
                    if (kind == QUADRATIC) is_asked = !plain && mesh.ntet < MAX_QUADRATIC;
                    if (is_asked) status = measure(k, &mesh, options, law, plain, (Kind)kind);
                }
        om_tet_mesh_done(&mesh);
        if (status < 0) return status;
    }
    return OM_OK;
}
