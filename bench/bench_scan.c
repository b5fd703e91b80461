// bench_scan.c: from the depth and colour pictures of the sheet to a scan, 320 x 240 pixels. The goal is the
// pre-processing of the thesis (4.6), which has registration, too.
#include "bench.h"

#define MAX_RUN 32

static OmStatus time_scans(const OmScanDef* def, const OmCloudDef* space, const OmObservation* obs,
                           BenchRow* row) {
    double time[MAX_RUN];
    for (int run = 0; run < row->nrun; ++run) {
        OmScan scan;
        double start = bench_now();
        OM_TRY(om_scan_from_observation(def, space, obs, &scan));
        time[run] = bench_now() - start;
        row->size = scan.npoint;
        row->hash = om_hash(scan.x, 3 * (size_t)scan.npoint * sizeof *scan.x, OM_HASH_SEED);
        om_scan_done(&scan);
    }
    bench_times(time, row->nrun, row);
    return bench_print(row);
}

OmStatus bench_scan(const BenchOptions* options) {
    OmStatus status = OM_OK;
    OmScene scene = bench_sheet();
    OmSite site = {0};
    OmWorld* world = NULL;
    OmObservation obs = {0};
    BenchRow row = {.bench = "scan", .scene = "sheet", .nworker = 1, .steps = 1};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > MAX_RUN ? MAX_RUN : options->nrun;
    scene.seed = 2;
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    OM_TRY_DONE(om_world_create_simulated(&scene, &site, options->nworker, &world));
    OM_TRY_DONE(om_world_observe(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &obs));
    OmScanDef def = om_scan_default_def(om_site_spacing(&site));
    OmCloudDef space = om_cloud_default_def(world, &site);
    row.work = "scan of depth and colour";
    row.goal_ms = 39;
    OM_TRY_DONE(time_scans(&def, &space, &obs, &row));
    def.use_color = false;
    row.work = "scan of depth alone";
    status = time_scans(&def, &space, &obs, &row);
done:
    om_observation_done(&obs);
    om_world_destroy(world);
    om_site_done(&site);
    return status;
}
