// bench_pbd.c: particles in clusters, 3 substeps of 9 iterations, h = 0.02 s: a sheet in a single layer, held on
// one side and lifted at the other, with the optimum of 5.4.1, and a block every 5 mm that lies on a board, which at
// 3 substeps it is too soft for; the last row has the substeps that the engine chooses.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"

#define NWARM 20
#define NSTEP 100

static const struct {
    const char* name;
    double size[3];  // m; thickness 0: a sheet
    double spacing;  // m
    bool has_board;  // that it lies on
    bool has_self_collision;
    double goal_ms;  // one core for the sheet, two for the block
    int substeps;    // 0: chosen from the body
} scene_table[] = {
    {"sheet", {0.09, 0.09, 0.003}, 0.003, false, false, 0.4, 3},
    {"sheet on a board", {0.09, 0.09, 0.003}, 0.003, true, false, 0, 3},
    {"sheet touching itself", {0.09, 0.09, 0.003}, 0.003, true, true, 0, 3},
    {"block", {0.125, 0.1, 0.1}, 0.005, true, false, 20, 3},
    {"block that carries itself", {0.125, 0.1, 0.1}, 0.005, true, false, 20, 0},
};
#define NSCENE ((int)(sizeof scene_table / sizeof *scene_table))

static OmStatus make_particles(int k, OmTetMesh* particles, double* volume) {
    const double* L = scene_table[k].size;
    if (L[2] < 0.01)
        return om_pbd_sample_sheet(L[0], L[1], L[2], scene_table[k].spacing, particles, volume);
    OmTetMesh box = {0};
    OmSurface skin = {0};
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(L[0], L[1], L[2]), 2, 2, 2, &box));
    OM_TRY_DONE(om_tet_mesh_boundary(&box, &skin, NULL));
    OM_TRY_DONE(om_pbd_sample_surface(&skin, scene_table[k].spacing, particles, volume));
done:
    om_surface_done(&skin);
    om_tet_mesh_done(&box);
    return status;
}

// Particles at least x, held from the start.
static OmStatus attach_side(OmTetMesh* particles) {
    int* vert = om_alloc((size_t)particles->nvert, sizeof *vert);
    if (!vert) return OM_NO_MEMORY;
    double lo = INFINITY;
    for (int i = 0; i < particles->nvert; ++i) lo = fmin(lo, particles->x[3 * i]);
    int num = 0;
    for (int i = 0; i < particles->nvert; ++i)
        if (particles->x[3 * i] < lo + 1e-6) vert[num++] = i;
    OmStatus status = om_tet_mesh_add_set(particles, "attachment", vert, num);
    om_free(vert);
    return status;
}

static OmStatus run_steps(OmTissueModel* m, OmTissueState* s, OmTissueWork* w, OmContactWork* board,
                          OmVec3 tip, double* time) {
    const double h = 0.02;
    om_tissue_state_reset(m, s);
    OM_TRY(om_tissue_grasp(m, s, 0, (OmPose){tip, om_quat_identity()}, 0.006, NULL));
    for (int step = 0; step < NWARM + NSTEP; ++step) {
        OmPose pose = {om_madd(tip, 0.0003 * step, om_vec3(0, 0, 1)), om_quat_identity()};
        OM_TRY(om_tissue_move_grasp(s, 0, pose));
        double begin = bench_now();
        OM_TRY(om_contact_step(board, m, s, w, h, NULL));
        if (step >= NWARM) *time += (bench_now() - begin) / NSTEP;
    }
    return OM_OK;
}

static OmStatus measure(int k, const BenchOptions* options) {
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    pbd.has_self_collision = scene_table[k].has_self_collision;
    pbd.substeps = scene_table[k].substeps;
    OmTetMesh particles = {0};
    OmTissueModel* m = NULL;
    OmTissueState* s = NULL;
    OmTissueWork* w = NULL;
    OmContact* board = NULL;
    OmContactWork* board_work = NULL;
    OmStatus status = OM_OK;
    double* time = om_calloc((size_t)options->nrun, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OM_TRY_DONE(make_particles(k, &particles, &pbd.particle_volume));
    OM_TRY_DONE(attach_side(&particles));
    OmTissueDef def = om_tissue_default_def(om_pbd_engine(), &particles);
    def.options = &pbd;
    def.solver.nworker = options->nworker;
    OM_TRY_DONE(om_tissue_create(&def, &m));
    OM_TRY_DONE(om_tissue_state_create(m, &s));
    OM_TRY_DONE(om_tissue_work_create(m, &w));
    OmContactPlane plane = {om_vec3(0, 0, -0.003), om_vec3(0, 0, 1)};
    OmTissueObstacle flat = om_plane_obstacle(&plane);
    OmContactDef ground = om_contact_default_def();
    ground.nobstacle = scene_table[k].has_board, ground.obstacle = &flat;
    OM_TRY_DONE(om_contact_create(&ground, m, &board));
    OM_TRY_DONE(om_contact_work_create(board, &board_work));
    OmVec3 tip = om_load3(particles.x, particles.nvert - 1);
    for (int run = 0; run < options->nrun; ++run)
        OM_TRY_DONE(run_steps(m, s, w, board_work, tip, &time[run]));
    char work[64];
    snprintf(work, sizeof work, "step, %d substeps of %d iterations", om_pbd_substeps(m, 0.02),
             pbd.iterations);
    BenchRow row = {.bench = "pbd",
                    .scene = scene_table[k].name,
                    .work = work,
                    .size = particles.nvert,
                    .nworker = options->nworker,
                    .steps = NSTEP,
                    .nrun = options->nrun,
                    .goal_ms = scene_table[k].goal_ms,
                    .hash = om_tissue_state_hash(s)};
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
done:
    om_contact_work_destroy(board_work);
    om_contact_destroy(board);
    om_tissue_work_destroy(w);
    om_tissue_state_destroy(s);
    om_tissue_destroy(m);
    om_tet_mesh_done(&particles);
    om_free(time);
    return status;
}

OmStatus bench_pbd(const BenchOptions* options) {
    for (int k = 0; k < NSCENE; ++k)
        if (!options->is_quick || scene_table[k].size[2] < 0.01) OM_TRY(measure(k, options));
    return OM_OK;
}
