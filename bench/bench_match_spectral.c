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

// The rolled top of the slab as 2,000 points without triangles.
static OmStatus make_scan(OmScan* scan) {
    enum { NX = 50, NY = 40 };
    OM_TRY(om_scan_init(NX * NY, 0, scan));
    for (int i = 0; i < NX * NY; ++i) {
        double angle = 20 * 0.06 * (i % NX + 0.5) / NX, y = 0.057 * (i / NX + 0.5) / NY;
        om_store3(scan->x, i, om_vec3(0.045 * sin(angle), y, 0.05 - 0.045 * cos(angle)));
    }
    return OM_OK;
}

// The thesis's correspondence of one picture: the scan's basis, the first map, ZoomOut and points on triangles.
static OmStatus map_scan(const OmSpectralDef* def, const OmSurface* a,
                         const OmSpectralBasis* basis_a, const OmScan* scan, int* map, int* tri,
                         double* bary) {
    OmSpectralBasis basis;
    OM_TRY(om_spectral_basis_init_scan(scan, def->last, &basis));
    OmStatus status = om_spectral_map_from_nearest(basis_a, a->x, &basis, scan->x, map);
    if (status == OM_OK) status = om_spectral_zoomout(def, basis_a, &basis, map, NULL);
    if (status == OM_OK)
        status = om_spectral_map_to_surface(def, basis_a, a, &basis, map, tri, bary);
    om_spectral_basis_done(&basis);
    return status;
}

static OmStatus bench_seen(BenchRow* row, const OmSurface* a, const OmSpectralBasis* basis_a) {
    OmStatus status = OM_OK;
    OmScan scan;
    int *map = NULL, *tri = NULL;
    double *bary = NULL, time[MAX_RUN];
    OmSpectralDef def = om_spectral_default_def();
    def.nworker = row->nworker;
    OM_TRY_DONE(make_scan(&scan));
    OM_ALLOC_DONE(map, scan.npoint);
    OM_ALLOC_DONE(tri, scan.npoint);
    OM_ALLOC_DONE(bary, 3 * (size_t)scan.npoint);
    for (int run = 0; run < row->nrun; ++run) {
        double start = bench_now();
        OM_TRY_DONE(map_scan(&def, a, basis_a, &scan, map, tri, bary));
        time[run] = bench_now() - start;
    }
    row->work = "a scan of 2,000 points: basis, ZoomOut from 10 to 60, points on triangles";
    row->size = scan.npoint;
    row->hash = om_hash(bary, 3 * sizeof *bary * (size_t)scan.npoint, OM_HASH_SEED);
    bench_times(time, row->nrun, row);
    OM_TRY_DONE(bench_print(row));
done:
    om_scan_done(&scan);
    om_free(map);
    om_free(tri);
    om_free(bary);
    return status;
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
    OM_TRY_DONE(bench_seen(&row, &a, &basis_a));
done:
    om_surface_done(&a);
    om_surface_done(&b);
    om_spectral_basis_done(&basis_a);
    om_spectral_basis_done(&basis_b);
    om_free(map);
    return status;
}
