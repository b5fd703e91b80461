// bench_solve.c: raw linear solves on the beams of the lift scene: M + h^2 K of the rest shape, the end
// pulled sideways. 25 block-Jacobi iterations, and multigrid to 1e-3 with its refresh.
#include <stdio.h>
#include <string.h>

#include "bench.h"
#include "solve/solve_common.h"

static const struct {
    int cells[3];
    double plain_ms;  // 25 CG iterations on a plain float block matrix, two threads
} beam_table[] = {{{19, 6, 6}, 0.24}, {{36, 11, 11}, 1.32}, {{67, 21, 21}, 9.1}};

#define NRHS 8

typedef struct Beam {
    OmTetMesh mesh;
    OmBsr A;
    unsigned char* fixed;
    double *b, *x;  // NRHS right-hand sides and solutions
    char name[64];
} Beam;

static OmStatus beam_init(Beam* beam, const int cells[3]) {
    *beam = (Beam){0};
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.1, 0.03, 0.03), cells[0], cells[1], cells[2],
                           &beam->mesh));
    OmTetMesh* mesh = &beam->mesh;
    snprintf(beam->name, sizeof beam->name, "beam %dx%dx%d", cells[0], cells[1], cells[2]);
    OM_TRY(om_bsr_create(mesh->nvert, mesh->ntet, 4, mesh->tet_vert, &beam->A));
    Elastic tissue = elastic_tissue();
    assemble_elastic(mesh, &tissue, &beam->A);
    size_t n = 3 * (size_t)mesh->nvert;
    beam->fixed = om_calloc(n, 1);
    beam->b = om_calloc(NRHS * n, sizeof(double));
    beam->x = om_calloc(NRHS * n, sizeof(double));
    if (!beam->fixed || !beam->b || !beam->x) return OM_NO_MEMORY;
    for (int i = 0; i < mesh->nvert; ++i) {
        double x = mesh->x[3 * i];
        for (int c = 0; c < 3; ++c) beam->fixed[3 * i + c] = x < 1e-9;
        for (int q = 0; q < NRHS; ++q)  // the end pulled sideways, then lengthwise, ...
            if (x > 0.1 - 1e-9)
                beam->b[(size_t)q * n + (size_t)(3 * i + (q + 2) % 3)] = 1e-3 * (q + 1);
    }
    return OM_OK;
}

static void beam_done(Beam* beam) {
    om_tet_mesh_done(&beam->mesh);
    om_bsr_destroy(&beam->A);
    om_free(beam->fixed);
    om_free(beam->b);
    om_free(beam->x);
}

// Times of refresh and of solve, each repeated until about 50 ms have passed.
static OmStatus measure(const Beam* beam, const OmSolverDef* def, const BenchOptions* options,
                        const char* work, double plain_ms) {
    int nrhs = def->max_rhs;
    enum { MAX_TIME = 1000 };
    double refresh[MAX_TIME], solve[MAX_TIME];
    int n = 0;
    OmSolver* S = NULL;
    OmSolveInfo info = {0};
    OmStatus status = om_solver_create(def, &beam->A, beam->mesh.x, &S);
    if (status < 0) return status;
    om_solver_set_fixed(S, beam->fixed);
    size_t size = (size_t)nrhs * 3 * (size_t)beam->mesh.nvert * sizeof(double);
    double start = bench_now();
    while (n < MAX_TIME && (n < 4 * options->nrun || bench_now() - start < 0.05 * options->nrun)) {
        double t0 = bench_now();
        OM_TRY_DONE(om_solver_refresh(S, &beam->A));
        double t1 = bench_now();
        memset(beam->x, 0, size);
        OM_TRY_DONE(om_solver_solve(S, &beam->A, nrhs, beam->b, beam->x, &info));
        refresh[n] = t1 - t0;
        solve[n++] = bench_now() - t1;
    }
    BenchRow row = {.bench = "solve",
                    .scene = beam->name,
                    .work = work,
                    .size = beam->mesh.ntet,
                    .nworker = options->nworker,
                    .steps = 1,
                    .reference = plain_ms > 0 ? "25 iterations on a plain block matrix" : NULL,
                    .reference_ms = plain_ms,
                    .iterations = info.iterations,
                    .residual = info.residual,
                    .bytes_per_element = (double)om_solver_memory(S) / beam->mesh.ntet,
                    .hash = om_hash(beam->x, size, OM_HASH_SEED)};
    bench_times(solve, n, &row);
    OM_TRY_DONE(bench_print(&row));
    char name[96];
    snprintf(name, sizeof name, "%s: refresh", work);
    BenchRow fresh = {.bench = "solve",
                      .scene = beam->name,
                      .work = name,
                      .size = beam->mesh.ntet,
                      .nworker = options->nworker,
                      .steps = 1};
    bench_times(refresh, n, &fresh);
    OM_TRY_DONE(bench_print(&fresh));
done:
    om_solver_destroy(S);
    return status < 0 ? status : OM_OK;
}

OmStatus bench_solve(const BenchOptions* options) {
    OmStatus status = OM_OK;
    for (int k = 0; k < (options->is_quick ? 1 : 3) && status == OM_OK; ++k) {
        Beam beam;
        status = beam_init(&beam, beam_table[k].cells);
        OmSolverDef def = om_solver_default_def();
        def.nworker = options->nworker;
        def.preconditioner = OM_BLOCK_JACOBI;
        def.max_iterations = 25;
        def.tolerance = 0;
        if (status == OM_OK)
            status =
                measure(&beam, &def, options, "25 block-Jacobi iterations", beam_table[k].plain_ms);
        def.max_iterations = 1000;
        def.tolerance = 1e-3;
        if (status == OM_OK) status = measure(&beam, &def, options, "block Jacobi to 1e-3", 0);
        def.preconditioner = OM_MULTIGRID;
        if (status == OM_OK) status = measure(&beam, &def, options, "multigrid to 1e-3", 0);
        def.max_rhs = NRHS;
        if (status == OM_OK)
            status = measure(&beam, &def, options, "multigrid to 1e-3, 8 right-hand sides", 0);
        beam_done(&beam);
    }
    return status;
}
