// bench_contact.c: a step of the sheet of scenes/sheet.yaml on its board, while a tool lifts its middle:
// 120 x 120 x 5 mm, 2,400 tetrahedra, weight, a third of the underside on springs; beside it the same step
// without the board.
#include <stdio.h>
#include <stdlib.h>

#include "bench.h"

#define NSTEP 150
#define SPAN 0.12  // m

// Springs along one third of the underside.
static OmStatus make_sheet(OmTetMesh* mesh) {
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(SPAN, SPAN, 0.005), 20, 20, 1, mesh));
    int vert[21 * 21], count = 0;
    for (int i = 0; i < mesh->nvert; ++i)
        if (mesh->x[3 * i + 2] < 1e-9 && mesh->x[3 * i] < SPAN / 3) vert[count++] = i;
    return om_tet_mesh_add_set(mesh, "attachment", vert, count);
}

typedef struct Sheet {
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
} Sheet;

static OmStatus make_body(const OmTetMesh* mesh, const BenchOptions* options, Sheet* sheet) {
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.attachment_stiffness = 100;
    def.solver.nworker = options->nworker;
    OM_TRY(om_tissue_create(&def, &sheet->model));
    OM_TRY(om_tissue_state_create(sheet->model, &sheet->state));
    OM_TRY(om_tissue_work_create(sheet->model, &sheet->work));
    return bench_board(sheet->model, &sheet->contact, &sheet->contact_work);
}

static OmStatus lift(const Sheet* sheet, bool has_board, double* time, BenchRow* row) {
    OmTissueReport report;
    OmContactReport touch = {0};
    const double h = 0.02;
    OmPose tip = {om_vec3(0.7 * SPAN, SPAN / 2, 0.005), om_quat_identity()};
    om_tissue_state_reset(sheet->model, sheet->state);
    OM_TRY(om_tissue_grasp(sheet->model, sheet->state, 0, tip, 0.007, NULL));
    for (int step = 0; step < NSTEP; ++step) {
        tip.p.z = 0.005 + 0.03 * fmin(1, (step + 1) / 100.0);
        OM_TRY(om_tissue_move_grasp(sheet->state, 0, tip));
        double start = bench_now();
        if (has_board) {
            OM_TRY(om_contact_step(sheet->contact_work, sheet->model, sheet->state, sheet->work, h,
                                   &touch));
            report = touch.tissue;
        } else {
            OM_TRY(om_tissue_step(sheet->model, sheet->state, sheet->work, h, &report));
        }
        time[step] = bench_now() - start;
        row->iterations += (double)report.iterations / NSTEP;
        row->solves += (double)touch.nsolve / NSTEP;
        row->residual = fmax(row->residual, report.residual);
    }
    return OM_OK;
}

static OmStatus measure(const Sheet* sheet, bool has_board, const BenchOptions* options) {
    double* time = om_alloc((size_t)options->nrun, NSTEP * sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    BenchRow row = {.bench = "contact",
                    .scene = "sheet 20x20x1, lifted",
                    .work = has_board ? "step on a board" : "the same step without the board",
                    .size = om_tissue_mesh(sheet->model)->ntet,
                    .nworker = options->nworker,
                    .steps = NSTEP,
                    .goal_ms = has_board ? 1 : 0};
    for (int run = 0; run < options->nrun; ++run) {
        row.iterations = row.solves = 0;
        OM_TRY_DONE(lift(sheet, has_board, time + (size_t)run * NSTEP, &row));
    }
    row.hash = om_tissue_state_hash(sheet->state);
    bench_steps(time, options->nrun, NSTEP, &row);
    status = bench_print(&row);
done:
    om_free(time);
    return status;
}

OmStatus bench_contact(const BenchOptions* options) {
    OmTetMesh mesh;
    Sheet sheet = {0};
    OmStatus status = make_sheet(&mesh);
    if (status == OM_OK) status = make_body(&mesh, options, &sheet);
    for (int board = 0; board <= 1 && status >= 0; ++board)
        status = measure(&sheet, board > 0, options);
    om_contact_work_destroy(sheet.contact_work);
    om_contact_destroy(sheet.contact);
    om_tissue_work_destroy(sheet.work);
    om_tissue_state_destroy(sheet.state);
    om_tissue_destroy(sheet.model);
    om_tet_mesh_done(&mesh);
    return status;
}
