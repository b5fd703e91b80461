// bench_match_update.c: from a depth picture to attachments: the scan, and om_match_update. A sheet of 2,400 tetrahedra
// (882 vertices), seen by the world's depth camera, with one corner lifted by 40 mm; the twin knows of no attachment.
#include <time.h>

#include "bench.h"
#include "omentum/banet_update.h"
#include "omentum/base_job.h"
#include "omentum/body.h"

#define TIME_STEP 0.02
#define LIFT 0.04        // m
#define GOAL_MS 300      // of an update
#define PIPELINE_MS 150  // of everything after the picture
#define BELIEVED_MS 450  // of an update by network and physics with all its trials

typedef struct Lifted {
    OmScene scene;
    OmSite truth, twin;
    OmWorld* world;
    OmObservation obs;
    OmMatch* match;
    OmAcquisition acquisition;
    OmScan scan;
} Lifted;

static OmStatus observe(Lifted* f, unsigned what) {
    om_observation_done(&f->obs);
    return om_world_observe(f->world, what, &f->obs);
}

static OmStatus go_to(Lifted* f, OmVec3 p_task) {
    OmPose goal = f->obs.arm[1].tip;
    goal.p = om_pose_apply(f->truth.pose_world_task, p_task);
    OM_TRY(om_world_move(f->world, 1, goal, 0.1));
    do {
        OM_TRY(om_world_advance(f->world, TIME_STEP));
        OM_TRY(observe(f, 0));
    } while (f->obs.arm[1].is_moving);
    return OM_OK;
}

static OmStatus set_jaw(Lifted* f, double angle) {
    OM_TRY(om_world_set_jaw(f->world, 1, angle));
    for (int i = 0; i < 25; ++i) OM_TRY(om_world_advance(f->world, TIME_STEP));
    return observe(f, 0);
}

static OmStatus lift(Lifted* f) {
    const OmVec3 corner = om_vec3(0.05, 0.05, 0.005);
    OM_TRY(om_world_reset(f->world));
    OM_TRY(set_jaw(f, 0.7));
    OM_TRY(go_to(f, om_add(corner, om_vec3(0, 0, 0.02))));
    OM_TRY(go_to(f, corner));
    OM_TRY(set_jaw(f, 0));
    OmMatchGrasp* grasp = &f->acquisition.grasp[0];
    *grasp = (OmMatchGrasp){.arm = 1, .pose_world_grasp = f->obs.arm[1].tip};
    OM_TRY(go_to(f, om_add(corner, om_vec3(0, 0, LIFT))));
    grasp->pose_world_now = f->obs.arm[1].tip;
    f->acquisition.ngrasp = 1;
    return observe(f, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
}

static OmStatus make(Lifted* f) {
    f->scene = bench_sheet();
    f->scene.attach = (OmSceneAttach){.kind = OM_ATTACH_BOX,
                                      .lo = {-0.061, -0.061, -0.001},
                                      .hi = {0.001, 0.001, 0.001},
                                      .share_max = 0.5};
    f->scene.tissue.world_cells = om_vec3(30, 30, 2);
    f->scene.believed.kind = OM_BELIEF_NONE;
    OM_TRY(om_site_build(&f->scene, OM_SITE_TWIN, NULL, &f->twin));
    OM_TRY(om_site_build(&f->scene, OM_SITE_WORLD, NULL, &f->truth));
    OM_TRY(om_world_create_simulated(&f->scene, &f->truth, 1, &f->world));
    return lift(f);
}

static OmStatus time_scan(Lifted* f, const BenchOptions* options, double* time, double* least) {
    OmScanDef def = om_scan_default_def(om_site_spacing(&f->twin));
    OmCloudDef space = om_cloud_default_def(f->world, &f->twin);
    for (int run = 0; run < options->nrun; ++run) {
        om_scan_done(&f->scan);
        double start = bench_now();
        OM_TRY(om_scan_from_observation(&def, &space, &f->obs, &f->scan));
        time[run] = bench_now() - start;
    }
    BenchRow row = {.bench = "match_update",
                    .scene = "sheet 20x20x1, a corner lifted by 40 mm",
                    .work = "scan of a depth picture",
                    .size = f->scan.npoint,
                    .nworker = 1,
                    .steps = 1,
                    .nrun = options->nrun,
                    .hash = om_hash(f->scan.x, 3 * (size_t)f->scan.npoint * sizeof(double), 0)};
    bench_times(time, options->nrun, &row);
    *least = row.min_ms;
    return bench_print(&row);
}

// A row of updates, with the last estimate.
static BenchRow update_row(const Lifted* f, const BenchOptions* options,
                           const OmMatchEstimate* estimate, const char* work, double goal_ms) {
    size_t size = (size_t)estimate->nvert * sizeof *estimate->probability;
    return (BenchRow){.bench = "match_update",
                      .scene = "sheet 20x20x1, a corner lifted by 40 mm",
                      .work = work,
                      .size = f->twin.mesh.ntet,
                      .nworker = options->nworker,
                      .steps = 1,
                      .nrun = options->nrun,
                      .goal_ms = goal_ms,
                      .residual = estimate->after_median,
                      .hash = om_hash(estimate->probability, size, 0)};
}

// The whole way from a picture, beside the thesis.
static void set_whole_way(BenchRow* row, const char* work) {
    row->work = work;
    row->goal_ms = PIPELINE_MS;
    row->reference = "thesis 4.5, with a GPU";
    row->reference_ms = 1440;
}

// A twin that runs in real time, as beside an operation.
static OmStatus run_twin(void* ctx, const OmProgress* progress) {
    const Lifted* f = ctx;
    OmBody* body;
    OM_TRY(om_body_create(&f->scene, &f->twin, 1, &body));
    OmStatus status = OM_OK;
    const double begin = om_clock_now();
    for (int k = 1; status >= 0; ++k) {
        OmBodyReport report;
        status = om_body_step(body, TIME_STEP, &report);
        if (status >= 0) status = om_progress_report(progress, "twin", 0, 1);
        double early = begin + k * TIME_STEP - om_clock_now();
        if (early > 0) nanosleep(&(struct timespec){0, (long)(1e9 * early)}, NULL);
    }
    om_body_destroy(body);
    return status;
}

// Updates by network and physics; `first`: correspondence and network alone, of each run.
static OmStatus time_runs(Lifted* f, const BenchOptions* options, OmBanetUpdater* updater,
                          double* time, double* first, OmMatchEstimate* estimate) {
    OmStatus status = OM_OK;
    for (int run = 0; run < options->nrun && status == OM_OK; ++run) {
        OmBanetAdvice advice;
        om_match_estimate_done(estimate);
        double start = bench_now();
        status = om_banet_update(updater, 1, &f->acquisition, NULL, estimate, &advice);
        time[run] = bench_now() - start;
        first[run] = time[run] * (advice.pairs_ms + advice.network_ms) / advice.total_ms;
        om_banet_advice_done(&advice);
    }
    return status;
}

// The same beside a twin, whose own errors count.
static OmStatus time_runs_beside_twin(Lifted* f, const BenchOptions* options,
                                      OmBanetUpdater* updater, double* time, double* first,
                                      OmMatchEstimate* estimate) {
    OmJob* job;
    OM_TRY(om_job_start(run_twin, f, &job));
    OmStatus status = time_runs(f, options, updater, time, first, estimate);
    om_job_cancel(job);
    OmStatus twin = om_job_join(job);
    return status < 0 || twin == OM_CANCELLED ? status : twin;
}

// The same by network and physics, with the weights that come along; nothing is printed without them.
static OmStatus time_joint(Lifted* f, const BenchOptions* options, double* time, double scan_ms) {
    OmBanetUpdateDef def = om_banet_update_default_def(f->match);
    OmBanetNet* net = NULL;
    OmBanetUpdater* updater = NULL;
    OmMatchEstimate estimate = {0};
    double* first = NULL;
    OmStatus status = om_banet_net_find(NULL, NULL, &net);
    if (status < 0 || !net) return status;
    OM_ALLOC_DONE(first, (size_t)options->nrun);
    def.net = net;
    def.nworker = options->nworker;
    OM_TRY_DONE(om_banet_updater_create(&def, &updater));
    OM_TRY_DONE(time_runs(f, options, updater, time, first, &estimate));
    BenchRow row = update_row(f, options, &estimate,
                              "attachments by network and physics, from one view", BELIEVED_MS);
    bench_times(time, options->nrun, &row);
    OM_TRY_DONE(bench_print(&row));
    set_whole_way(&row, "the picture, correspondence and network alone");
    bench_times(first, options->nrun, &row);
    bench_add(&row, scan_ms);
    OM_TRY_DONE(bench_print(&row));
    OM_TRY_DONE(time_runs_beside_twin(f, options, updater, time, first, &estimate));
    row = update_row(f, options, &estimate,
                     "attachments by network and physics, beside a twin in real time", 0);
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
done:
    om_free(first);
    om_match_estimate_done(&estimate);
    om_banet_updater_destroy(updater);
    om_banet_net_destroy(net);
    return status;
}

static OmStatus time_update(Lifted* f, const BenchOptions* options, double* time, double scan_ms) {
    OmMatchDef def = om_match_default_def(&f->scene, &f->twin);
    OmMatchEstimate estimate = {0};
    def.nworker = options->nworker;
    OmStatus status = om_match_create(&def, &f->match);
    f->acquisition.scan = f->scan;
    for (int run = 0; run < options->nrun && status == OM_OK; ++run) {
        om_match_estimate_done(&estimate);
        double start = bench_now();
        status = om_match_update(f->match, 1, &f->acquisition, NULL, &estimate);
        time[run] = bench_now() - start;
    }
    if (status < 0) return status;
    BenchRow row = update_row(f, options, &estimate, "attachments from one view", GOAL_MS);
    bench_times(time, options->nrun, &row);
    status = bench_print(&row);
    set_whole_way(&row, "from the picture to attachments: the sum of both");
    bench_add(&row, scan_ms);
    if (status == OM_OK) status = bench_print(&row);
    om_match_estimate_done(&estimate);
    return status;
}

OmStatus bench_match_update(const BenchOptions* options) {
    Lifted f = {0};
    double *time, scan_ms = 0;
    OM_ALLOC(time, (size_t)options->nrun);
    OmStatus status = make(&f);
    if (status == OM_OK) status = time_scan(&f, options, time, &scan_ms);
    if (status == OM_OK) status = time_update(&f, options, time, scan_ms);
    if (status == OM_OK) status = time_joint(&f, options, time, scan_ms);
    om_match_destroy(f.match);
    om_observation_done(&f.obs);
    om_world_destroy(f.world);
    om_scan_done(&f.scan);
    om_site_done(&f.twin);
    om_site_done(&f.truth);
    om_free(time);
    return status;
}
