// bench_shape.c: from voxels to a tetrahedral mesh of 50,000 elements, which may take five seconds.
#include "bench.h"

#include "omentum/shape_meshing.h"

// A kidney-like bean of voxels of 2 x 2 x 3 mm.
static OmStatus make_mask(OmMask* mask) {
    OM_TRY(om_mask_init(mask, 64, 64, 64));
    mask->grid.axis = om_mat3_diag(om_vec3(0.002, 0.002, 0.003));
    mask->grid.origin = om_vec3(-0.063, -0.063, -0.0945);
    for (int k = 0, n = 0; k < 64; ++k) {
        for (int j = 0; j < 64; ++j) {
            for (int i = 0; i < 64; ++i, ++n) {
                OmVec3 p = om_voxel_grid_point(&mask->grid, om_vec3(i, j, k));
                OmVec3 q = om_vec3(p.x / 0.04, p.y / 0.035, p.z / 0.07);
                OmVec3 hollow = om_sub(p, om_vec3(0.05, 0, 0));
                mask->inside[n] = om_norm(q) < 1 && om_norm(hollow) > 0.025;
            }
        }
    }
    return OM_OK;
}

// The time of the distance field, and of both together.
static OmStatus mesh_once(const OmMask* mask, double edge, int nworker, double* sdf_time,
                          double* time, OmTetMesh* mesh) {
    OmSdf sdf;
    OmSdfDef sdf_def = om_sdf_default_def(0.5 * edge);
    OmVec3 lo, hi;
    double start = bench_now();
    OM_TRY(om_sdf_from_mask(mask, &sdf_def, &sdf));
    *sdf_time = bench_now() - start;
    om_sdf_bounds(&sdf, &lo, &hi);
    OmStuffDef def = om_stuff_default_def(edge, om_sdf_shape_fn, &sdf, lo, hi);
    def.nworker = nworker;
    OmStatus status = om_tet_mesh_stuff(&def, mesh);
    *time = bench_now() - start;
    om_sdf_done(&sdf);
    return status;
}

OmStatus bench_shape(const BenchOptions* options) {
    OmStatus status = OM_OK;
    OmMask mask = {0};
    double sdf_time[32], time[32];
    BenchRow row = {
        .bench = "shape", .scene = "bean of 2 x 2 x 3 mm voxels", .nworker = options->nworker};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > 32 ? 32 : options->nrun;
    row.steps = 1;
    double edge = options->is_quick ? 0.006 : 0.0043;
    OM_TRY_DONE(make_mask(&mask));
    for (int run = 0; run < row.nrun; ++run) {
        OmTetMesh mesh;
        OM_TRY_DONE(mesh_once(&mask, edge, options->nworker, &sdf_time[run], &time[run], &mesh));
        row.size = mesh.ntet;
        row.hash = om_hash(mesh.x, (size_t)mesh.nvert * 24, OM_HASH_SEED);
        row.hash = om_hash(mesh.tet_vert, (size_t)mesh.ntet * 16, row.hash);
        om_tet_mesh_done(&mesh);
    }
    row.work = "distance field of the mask";
    bench_times(sdf_time, row.nrun, &row);
    OM_TRY_DONE(bench_print(&row));
    row.work = "mask to tetrahedra, distance field included";
    row.reference = "5 s for 50,000 elements";
    row.reference_ms = 5000.0 * (double)row.size / 50000;
    bench_times(time, row.nrun, &row);
    OM_TRY_DONE(bench_print(&row));
done:
    om_mask_done(&mask);
    return status;
}
