// bench_match_spectral.c: functional maps at the size of a live scan: the basis of a surface of 1,000 vertices, and
// ZoomOut from 20 to 60 functions between two of them.
#include "bench.h"

#define NPAIR 60
#define MAX_RUN 32

// A slab of 60 x 57 x 5 mm in 20 x 19 x 3 cells, 996 vertices; `bend` (1/m) rolls it up.
static OmStatus make_slab(double bend, OmSurface* surface) {
    OmTetMesh mesh;
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.057, 0.005), 20, 19, 3, &mesh));
    OmStatus status = om_tet_mesh_boundary(&mesh, surface, NULL);
    om_tet_mesh_done(&mesh);
    for (int i = 0; status == OM_OK && i < surface->nvert; ++i) {
        OmVec3 p = om_load3(surface->x, i);
        double angle = bend * p.x, radius = bend > 0 ? 1 / bend - p.z : 0;
        if (bend > 0)
            om_store3(surface->x, i,
                      om_vec3(radius * sin(angle), p.y, 1 / bend - radius * cos(angle)));
    }
    return status;
}

static OmStatus time_basis(int nrun, double* time, const OmSurface* surface,
                           OmSpectralBasis* basis) {
    for (int run = 0; run < nrun; ++run) {
        om_spectral_basis_done(basis);
        double start = bench_now();
        OM_TRY(om_spectral_basis_init(surface, NPAIR, basis));
        time[run] = bench_now() - start;
    }
    return OM_OK;
}

OmStatus bench_match_spectral(const BenchOptions* options) {
    OmStatus status = OM_OK;
    OmSurface a = {0}, b = {0};
    OmSpectralBasis basis_a = {0}, basis_b = {0};
    int* map = NULL;
    double time[MAX_RUN];
    BenchRow row = {
        .bench = "match_spectral", .scene = "slab", .nworker = options->nworker, .steps = 1};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > MAX_RUN ? MAX_RUN : options->nrun;
    OM_TRY_DONE(make_slab(0, &a));
    OM_TRY_DONE(make_slab(20, &b));
    OM_TRY_DONE(time_basis(row.nrun, time, &a, &basis_a));
    row.work = "Laplacian and 60 eigenvectors";
    row.size = basis_a.nrow;
    row.goal_ms = 270;
    row.hash = om_hash(basis_a.phi, sizeof(double) * NPAIR * (size_t)basis_a.nrow, OM_HASH_SEED);
    bench_times(time, row.nrun, &row);
    OM_TRY_DONE(bench_print(&row));
    OM_TRY_DONE(om_spectral_basis_init(&b, NPAIR, &basis_b));
    OM_ALLOC_DONE(map, b.nvert);
    OmSpectralDef def = om_spectral_default_def();
    def.first = 20;
    def.nworker = options->nworker;
    for (int run = 0; run < row.nrun; ++run) {
        for (int i = 0; i < b.nvert; ++i) map[i] = i;
        double start = bench_now();
        OM_TRY_DONE(om_spectral_zoomout(&def, &basis_a, &basis_b, map, NULL));
        time[run] = bench_now() - start;
    }
    row.work = "ZoomOut from 20 to 60 functions by 5";
    row.goal_ms = 0;
    row.hash = om_hash(map, sizeof *map * (size_t)b.nvert, OM_HASH_SEED);
    bench_times(time, row.nrun, &row);
    OM_TRY_DONE(bench_print(&row));
done:
    om_surface_done(&a);
    om_surface_done(&b);
    om_spectral_basis_done(&basis_a);
    om_spectral_basis_done(&basis_b);
    om_free(map);
    return status;
}
