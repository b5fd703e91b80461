// bench_match_live.c: the material points of a scan through the running twin (om_match_find_pairs). A sheet of 882
// vertices is folded by 135 degrees by two tools; the twin has gone 70 % of the way, a depth camera sees the end.
#include <string.h>

#include "bench.h"

#define NPOINT 2000
#define LINE 0.01  // m, x of the line of the fold

typedef struct Fold {
    OmScene scene;
    OmSite site;
    OmBody* body;
    OmMatch* match;
    OmMatchLive* live;
    OmMatchGrasp grasp[2];
    double* x;  // the twin at 70 %
    OmScan scan;
} Fold;

static OmPose tip_at(const Fold* f, int arm, double share) {
    OmVec3 line = om_vec3(LINE, 0, 0.0025), from = om_vec3(0.052, arm ? 0.03 : -0.03, 0.005);
    OmQuat q = om_quat_axis_angle(om_vec3(0, -1, 0), share * 0.75 * OM_PI);
    OmPose task = {om_add(line, om_quat_rotate(q, om_sub(from, line))), q};
    return om_pose_mul(f->site.pose_world_task, task);
}

static OmStatus drive(Fold* f, double from, double to) {
    OmBodyReport report;
    for (int k = 1; k <= 100; ++k) {
        for (int arm = 0; arm < 2; ++arm)
            OM_TRY(om_body_move(f->body, arm, tip_at(f, arm, from + (to - from) * k / 100)));
        OM_TRY(om_body_step(f->body, 0.02, &report));
    }
    return om_body_settle(f->body, 0.02, 5e-3, 1);
}

// Points of the surface that a camera of 200 x 150 pixels sees, at most NPOINT.
static OmStatus see(Fold* f) {
    const OmMatchView* view = om_match_view(f->match);
    OmSenseScene* sense = NULL;
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    OmSurface s = *view->surface;
    OmStatus status = OM_OK;
    float *depth = NULL, *normal = NULL;
    double *x = NULL, *n = NULL;
    int id, num, npixel = 200 * 150;
    OmPose pose = om_pose_look_at(om_vec3(0.09, 0, 0.23), om_vec3(0, 0, 0), om_vec3(0, 0, 1));
    OmCamera camera = {.pose_world_camera = om_pose_mul(f->site.pose_world_task, pose),
                       .width = 200,
                       .height = 150,
                       .fov = 0.55,
                       .near_m = 0.01,
                       .far_m = 1};
    OM_ALLOC_DONE(depth, npixel);
    OM_ALLOC_DONE(normal, 3 * npixel);
    OM_ALLOC_DONE(x, 3 * npixel);
    OM_ALLOC_DONE(n, 3 * npixel);
    OM_TRY_DONE(om_sense_scene_create(&sense));
    OM_TRY_DONE(om_sense_scene_add(sense, &s, &look, &id));
    om_sense_scene_update(sense, id, om_body_x(f->body), view->surface_vert);
    OM_TRY_DONE(om_sense_scene_commit(sense));
    OM_TRY_DONE(om_sense_depth(sense, &camera, 1, depth, NULL, normal));
    num = om_depth_to_cloud(&camera, depth, NULL, normal, -1, x, n);
    OM_TRY_DONE(om_scan_init(num < NPOINT ? num : NPOINT, 0, &f->scan));
    f->scan.has_camera = true;
    f->scan.camera = camera;
    OM_ALLOC_DONE(f->scan.pixel, npixel);
    for (int i = 0; i < npixel; ++i)
        f->scan.pixel[i] = depth[i] > 0 ? OM_SCAN_TISSUE : OM_SCAN_OTHER;
    for (int i = 0; i < f->scan.npoint; ++i) {
        int from = (int)((int64_t)i * num / f->scan.npoint);
        om_store3(f->scan.x, i, om_load3(x, from));
        om_store3(f->scan.normal, i, om_normalize(om_load3(n, from)));
    }
done:
    om_sense_scene_destroy(sense);
    om_free(depth);
    om_free(normal);
    om_free(x);
    om_free(n);
    return status;
}

static OmStatus make(Fold* f, int nworker) {
    f->scene = bench_sheet();
    f->scene.attach = (OmSceneAttach){.kind = OM_ATTACH_BOX,
                                      .lo = {-0.061, -0.061, -0.001},
                                      .hi = {-0.015, 0.061, 0.001},
                                      .share_max = 0.5};
    f->scene.roi.is_random = false;
    f->scene.roi.center = om_vec3(0.03, 0, 0);
    OM_TRY(om_site_build(&f->scene, OM_SITE_TWIN, NULL, &f->site));
    OmMatchDef def = om_match_default_def(&f->scene, &f->site);
    OM_TRY(om_match_create(&def, &f->match));
    OmMatchLiveDef how = om_match_live_default_def(f->match);
    how.nworker = nworker;
    OM_TRY(om_match_live_create(&how, &f->live));
    OM_TRY(om_body_create(&f->scene, &f->site, nworker, &f->body));
    for (int arm = 0; arm < 2; ++arm) {
        int nheld;
        OM_TRY(om_body_grasp(f->body, arm, tip_at(f, arm, 0), 0.006, &nheld));
        f->grasp[arm] = (OmMatchGrasp){.arm = arm,
                                       .pose_world_grasp = tip_at(f, arm, 0),
                                       .pose_world_now = tip_at(f, arm, 1),
                                       .radius = 0.006};
    }
    size_t n = 3 * (size_t)f->site.mesh.nvert;
    OM_ALLOC(f->x, n);
    OM_TRY(drive(f, 0, 0.7));
    memcpy(f->x, om_body_x(f->body), n * sizeof *f->x);
    OM_TRY(drive(f, 0.7, 1));
    return see(f);
}

OmStatus bench_match_live(const BenchOptions* options) {
    Fold f = {0};
    OmMatchPairs pairs = {0};
    double* time = om_alloc((size_t)options->nrun, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OM_TRY_DONE(make(&f, options->nworker));
    for (int run = 0; run < options->nrun; ++run) {
        om_match_pairs_done(&pairs);
        double start = bench_now();
        OM_TRY_DONE(om_match_find_pairs(f.live, &f.scan, 2, f.grasp, f.x, &pairs));
        time[run] = bench_now() - start;
    }
    OM_CHECK_DONE(!pairs.is_lost, OM_NOT_CONVERGED, "match_live: lost: %s", pairs.reason);
    BenchRow row = {.bench = "match_live",
                    .scene = "sheet 20x20x1 folded by 135 degrees, the twin at 70 %",
                    .work = "material points of a scan",
                    .size = f.scan.npoint,
                    .nworker = options->nworker,
                    .goal_ms = 60,
                    .residual = pairs.p90,
                    .hash = om_hash(pairs.x, 3 * (size_t)pairs.nvert * sizeof *pairs.x, 0)};
    bench_times(time, options->nrun, &row);
    row.nrun = options->nrun;
    status = bench_print(&row);
done:
    om_match_pairs_done(&pairs);
    om_match_live_destroy(f.live);
    om_match_destroy(f.match);
    om_body_destroy(f.body);
    om_scan_done(&f.scan);
    om_site_done(&f.site);
    om_free(f.x);
    om_free(time);
    return status;
}
