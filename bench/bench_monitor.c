// bench_monitor.c: one frame of the monitor, a depth picture of 320 x 240 pixels against a twin that moves, refit
// included; and the world's depth and colour pictures that a frame needs. The goal is issue 17's: 4 ms of processor
// time.
#include "bench.h"

#include <string.h>

enum { NFRAME = 30, MAX_RUN = 64 };

// The tissue lifted at its free side, more in every frame.
static void bend(const OmSite* site, int frame, double* x) {
    for (int i = 0; i < site->mesh.nvert; ++i) {
        OmVec3 p = om_load3(site->mesh.x, i);
        double t = fmax(0, -p.x / site->half_size.x);
        om_store3(x, i, om_add(p, om_vec3(0, 0, 0.001 * frame * t * t)));
    }
}

static OmStatus time_frames(OmMonitor* monitor, const OmObservation* obs, const OmSite* site,
                            double* x, BenchRow* row) {
    double time[MAX_RUN];
    for (int run = 0; run < row->nrun; ++run) {
        OmMonitorFrame frame;
        time[run] = 0;
        om_monitor_reset(monitor);
        row->hash = OM_HASH_SEED;
        for (int k = 0; k < NFRAME; ++k) {
            bend(site, k, x);
            double start = bench_now();
            OM_TRY(om_monitor_frame(monitor, obs, x, k > 0, &frame));
            time[run] += (bench_now() - start) / NFRAME;
            row->hash = om_hash(&frame.distance, sizeof frame.distance, row->hash);
        }
        row->size = frame.npoint;
    }
    bench_times(time, row->nrun, row);
    return bench_print(row);
}

static OmStatus time_pictures(OmWorld* world, unsigned what, BenchRow* row) {
    double time[MAX_RUN];
    OmObservation obs = {0};
    OmStatus status = OM_OK;
    for (int run = 0; run < row->nrun; ++run) {
        double start = bench_now();
        OM_TRY_DONE(om_world_observe(world, what, &obs));
        time[run] = bench_now() - start;
    }
    row->size = (int64_t)obs.rgbd.camera.width * obs.rgbd.camera.height;
    row->hash = om_hash(obs.rgbd.depth, (size_t)row->size * sizeof(float), OM_HASH_SEED);
    bench_times(time, row->nrun, row);
    status = bench_print(row);
done:
    om_observation_done(&obs);
    return status;
}

OmStatus bench_monitor(const BenchOptions* options) {
    OmStatus status = OM_OK;
    OmScene scene = bench_sheet();
    OmSite twin = {0}, truth = {0};
    OmWorld* world = NULL;
    OmMonitor* monitor = NULL;
    OmObservation obs = {0};
    double* x = NULL;
    BenchRow row = {.bench = "monitor", .scene = "sheet", .nworker = 1};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > MAX_RUN ? MAX_RUN : options->nrun;
    scene.seed = 2;
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_WORLD, NULL, &truth));
    OM_TRY_DONE(om_world_create_simulated(&scene, &truth, options->nworker, &world));
    OmMonitorDef def = om_monitor_default_def(&scene, world, &twin);
    OM_TRY_DONE(om_monitor_create(&def, &monitor));
    OM_ALLOC_DONE(x, 3 * (size_t)twin.mesh.nvert);
    OM_TRY_DONE(om_world_observe(world, om_monitor_sources(monitor, world), &obs));
    row.steps = NFRAME;
    row.work = "frame of 1,000 points, with colour";
    row.goal_ms = 4;
    OM_TRY_DONE(time_frames(monitor, &obs, &twin, x, &row));
    om_picture_done(&obs.rgbd.color);
    row.work = "frame of 1,000 points, depth alone";
    OM_TRY_DONE(time_frames(monitor, &obs, &twin, x, &row));
    row.nworker = options->nworker;
    row.steps = 1;
    row.goal_ms = 0;
    row.work = "the simulated world's depth";
    OM_TRY_DONE(time_pictures(world, OM_OBSERVE_DEPTH, &row));
    row.work = "the simulated world's depth and colour";
    status = time_pictures(world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &row);
done:
    om_free(x);
    om_observation_done(&obs);
    om_monitor_destroy(monitor);
    om_world_destroy(world);
    om_site_done(&twin);
    om_site_done(&truth);
    return status;
}
