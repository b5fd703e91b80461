// bench_press.c: a sphere of 25 mm pressed 20 mm into a block in 1 s and held for 1 s: 0.15 x 0.1 x 0.07 m, bottom
// fixed, neo-Hookean, E 3 kPa, nu 0.45, no gravity, no damping, h = 0.02 s; by each of the three methods, and by
// multipliers with a Delassus matrix and Gauss-Seidel.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"

#define NPRESS 50
#define NHOLD 50
#define NSTEP (NPRESS + NHOLD)
// Cells of the contact surface, the top of the block: 40 of its points touch at the end, on any
// mesh.
#define NX 20
#define NY 19

static const struct {
    int cells[3];
    bool is_quick;
    double goal_ms[3];  // penalty, multipliers, prescribed
    // SOFA v26.06, one core: penalty with 25 CG iterations, multipliers (median)
    double peer_ms[2];
} scene_table[] = {
    {{11, 8, 8}, true, {1.5, 8, 1}, {4.3, 45}},
    {{21, 15, 14}, false, {7, 60, 5}, {25, 2300}},
    {{42, 28, 25}, false, {60, 1000, 40}, {0, 0}},
};
#define NSCENE ((int)(sizeof scene_table / sizeof *scene_table))

static const struct {
    const char* name;
    OmPressMethod method;
    int reuse;
} way_table[] = {
    {"penalty", OM_PRESS_PENALTY, 0},
    {"multipliers", OM_PRESS_MULTIPLIERS, 0},
    {"prescribed", OM_PRESS_PRESCRIBED, 0},
    {"multipliers, Gauss-Seidel", OM_PRESS_MULTIPLIERS, 1},
    {"multipliers, Gauss-Seidel, matrix kept 5 steps", OM_PRESS_MULTIPLIERS, 5},
};
#define NWAY ((int)(sizeof way_table / sizeof *way_table))

typedef struct Bed {
    OmTetMesh mesh;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmProbe* probe;
    OmPress* press;
    OmSurface top;
} Bed;

static OmStatus make_top(OmSurface* top) {
    OM_TRY(om_surface_init(top, (NX + 1) * (NY + 1), 2 * NX * NY));
    for (int j = 0, n = 0; j <= NY; ++j)
        for (int i = 0; i <= NX; ++i, ++n)
            om_store3(top->x, n, om_vec3(0.15 * i / NX, 0.1 * j / NY, 0.07));
    int* v = top->tri_vert;
    for (int j = 0; j < NY; ++j)
        for (int i = 0; i < NX; ++i, v += 6) {
            int a = j * (NX + 1) + i, b = a + NX + 1;
            const int cell[6] = {a, a + 1, b + 1, a, b + 1, b};
            memcpy(v, cell, sizeof cell);
        }
    return OM_OK;
}

static OmStatus make_bed(int k, int way, const BenchOptions* options, Bed* bed) {
    OM_TRY(bench_box(om_vec3(0.15, 0.1, 0.07), scene_table[k].cells, 2, &bed->mesh));
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &bed->mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.gravity = om_vec3(0, 0, 0);
    def.rayleigh_mass = 0;
    def.material_default.law = OM_NEO_HOOKEAN;
    def.solver.nworker = options->nworker;
    def.solver.max_rhs = way_table[way].reuse > 0 ? 8 : 1;
    OM_TRY(om_tissue_create(&def, &bed->model));
    OM_TRY(om_tissue_state_create(bed->model, &bed->state));
    OM_TRY(om_tissue_work_create(bed->model, &bed->work));
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    OM_TRY(om_probe_create(&shape, &bed->probe));
    OmPressDef press = om_press_default_def(bed->probe);
    press.method = way_table[way].method;
    press.reuse = way_table[way].reuse;
    OM_TRY(make_top(&bed->top));
    press.surface = &bed->top;
    return om_press_create(&press, bed->model, &bed->press);
}

static void bed_done(Bed* bed) {
    om_press_destroy(bed->press);
    om_probe_destroy(bed->probe);
    om_tissue_work_destroy(bed->work);
    om_tissue_state_destroy(bed->state);
    om_tissue_destroy(bed->model);
    om_tet_mesh_done(&bed->mesh);
    om_surface_done(&bed->top);
}

typedef struct Outcome {
    double worst_penetration, force, area;
    int ncontact, substeps, newton;
} Outcome;

static OmStatus press_once(Bed* bed, double* time, BenchRow* row, Outcome* out) {
    OmPose pose = {om_vec3(0.075, 0.05, 0.07 + 0.025), om_quat_identity()};
    *out = (Outcome){0};
    om_tissue_state_reset(bed->model, bed->state);
    OM_TRY(om_press_place(bed->press, bed->model, bed->state, pose));
    for (int step = 0; step < NSTEP; ++step) {
        OmPressReport report;
        pose.p.z = 0.07 + 0.025 - 0.02 * fmin(1, (step + 1.0) / NPRESS);
        double start = bench_now();
        OM_TRY(om_press_step(bed->press, bed->model, bed->state, bed->work, pose, 0.02, &report));
        time[step] = bench_now() - start;
        row->iterations += (double)report.tissue.iterations / NSTEP;
        row->solves += (double)report.nsolve / NSTEP;
        row->residual = fmax(row->residual, report.tissue.residual);
        out->worst_penetration = fmax(out->worst_penetration, report.penetration);
        out->substeps += report.tissue.substeps;
        out->newton += report.tissue.newton;
        out->ncontact = report.ncontact;
        out->force = report.force.z;
        out->area = report.area;
    }
    return OM_OK;
}

static OmStatus measure(int k, int way, const BenchOptions* options) {
    OmPressMethod method = way_table[way].method;
    const int* n = scene_table[k].cells;
    Bed bed = {0};
    OmStatus status = OM_OK;
    Outcome out = {0};
    char scene[64], work[128];
    snprintf(scene, sizeof scene, "press block %dx%dx%d", n[0], n[1], n[2]);
    BenchRow row = {.bench = "press",
                    .scene = scene,
                    .work = work,
                    .nworker = options->nworker,
                    .steps = NSTEP,
                    .goal_ms = scene_table[k].goal_ms[method],
                    .reference_ms = method < 2 ? scene_table[k].peer_ms[method] : 0};
    double* time = om_alloc((size_t)options->nrun, NSTEP * sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(make_bed(k, way, options, &bed));
    if (row.reference_ms > 0)
        row.reference = method == OM_PRESS_PENALTY
                            ? "SOFA v26.06, penalty, 25 CG iterations, one core"
                            : "SOFA v26.06, multipliers on an analytic sphere, one core";
    row.size = bed.mesh.ntet;
    for (int run = 0; run < options->nrun; ++run) {
        row.iterations = row.solves = 0;
        OM_TRY_DONE(press_once(&bed, time + (size_t)run * NSTEP, &row, &out));
    }
    snprintf(work, sizeof work, "%s, %d contacts, %.3f N, %.0f mm2, in by %.2g mm",
             way_table[way].name, out.ncontact, out.force, 1e6 * out.area,
             1e3 * out.worst_penetration);
    row.hash = om_tissue_state_hash(bed.state);
    row.bytes_per_element = (double)om_tissue_memory(bed.model, bed.work) / bed.mesh.ntet;
    bench_steps(time, options->nrun, NSTEP, &row);
    row.compares = BENCH_MEAN;  // steps differ, from one contact to all
    status = bench_print(&row);
done:
    bed_done(&bed);
    om_free(time);
    return status;
}

OmStatus bench_press(const BenchOptions* options) {
    for (int k = 0; k < NSCENE; ++k) {
        if (options->is_quick && !scene_table[k].is_quick) continue;
        for (int way = 0; way < NWAY; ++way) OM_TRY(measure(k, way, options));
    }
    return OM_OK;
}
