// bench_match_register.c: the pose of half a surface, 160 x 120 pixels with the noise of a depth camera, on a model of
// 3 mm edges; from a start 20 degrees and 20 mm off, and from none.
#include <math.h>

#include "bench.h"

#define MAX_RUN 32
#define WIDTH 160
#define HEIGHT 120

// An egg with a bump on one side and a dent on another.
static double egg(void* ctx, OmVec3 p) {
    (void)ctx;
    OmVec3 q = om_vec3(p.x / 0.050, p.y / 0.036, p.z / 0.028);
    double bump = exp(-om_norm2(om_sub(p, om_vec3(0.025, 0.025, 0.012))) / (0.016 * 0.016));
    double dent = exp(-om_norm2(om_sub(p, om_vec3(-0.025, 0.010, 0.025))) / (0.014 * 0.014));
    return 0.030 * (om_norm(q) - 1) - 0.008 * bump + 0.006 * dent;
}

static OmStatus make_surface(double spacing, OmSurface* surface) {
    OmSdfDef def = om_sdf_default_def(spacing);
    OmVec3 hi = om_vec3(0.060, 0.052, 0.045);
    OmSdf sdf;
    OM_TRY(om_sdf_from_function(egg, NULL, om_scale(-1, hi), hi, &def, &sdf));
    OmStatus status = om_surface_from_sdf(&sdf, 0, surface);
    om_sdf_done(&sdf);
    return status;
}

static OmStatus look(const OmSurface* truth, OmScan* scan) {
    OmStatus status = OM_OK;
    OmSenseScene* scene = NULL;
    float *depth = NULL, *normal = NULL;
    int id;
    OmSenseLook skin = om_sense_look(OM_PART_ORGAN);
    OmDepthNoise noise = om_depth_noise_default(1);
    OmPose pose = om_pose_look_at(om_vec3(0.06, 0.08, 0.18), om_vec3(0, 0, 0), om_vec3(0, 0, 1));
    OM_TRY_DONE(om_scan_init(WIDTH * HEIGHT, 0, scan));
    scan->camera = (OmCamera){pose, WIDTH, HEIGHT, 0.6, 0.02, 1, .lens = {0}};
    scan->has_camera = true;
    scan->noise = noise.a;
    OM_ALLOC_DONE(depth, WIDTH * HEIGHT);
    OM_ALLOC_DONE(normal, 3 * WIDTH * HEIGHT);
    OM_TRY_DONE(om_sense_scene_create(&scene));
    OM_TRY_DONE(om_sense_scene_add(scene, truth, &skin, &id));
    OM_TRY_DONE(om_sense_scene_commit(scene));
    OM_TRY_DONE(om_sense_depth(scene, &scan->camera, 1, depth, NULL, normal));
    om_depth_add_noise(&noise, &scan->camera, 0, normal, depth);
    scan->npoint = om_depth_to_cloud(&scan->camera, depth, NULL, normal, -1, scan->x, scan->normal);
done:
    om_sense_scene_destroy(scene);
    om_free(depth);
    om_free(normal);
    return status;
}

static OmStatus time_registration(const OmRegisterDef* def, const OmSurface* model,
                                  const OmScan* scan, BenchRow* row) {
    double time[MAX_RUN];
    for (int run = 0; run < row->nrun; ++run) {
        OmRegistration r;
        double start = bench_now();
        OM_TRY(om_scan_register(def, model, scan, &r));
        time[run] = bench_now() - start;
        row->hash = om_hash(&r.pose_model_scan, sizeof r.pose_model_scan, OM_HASH_SEED);
        row->iterations = r.niteration;
    }
    bench_times(time, row->nrun, row);
    return bench_print(row);
}

OmStatus bench_match_register(const BenchOptions* options) {
    OmStatus status = OM_OK;
    OmSurface model = {0}, truth = {0};
    OmScan scan = {0};
    BenchRow row = {.bench = "match_register", .scene = "egg", .steps = 1};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > MAX_RUN ? MAX_RUN : options->nrun;
    row.nworker = options->nworker;
    OM_TRY_DONE(make_surface(0.003, &model));
    OM_TRY_DONE(make_surface(0.0016, &truth));
    OM_TRY_DONE(look(&truth, &scan));
    OmRegisterDef def = om_register_default_def();
    def.nworker = options->nworker;
    def.has_start = true;
    def.pose_model_scan.q = om_quat_axis_angle(om_vec3(0.6, 0, 0.8), 0.35);
    def.pose_model_scan.p = om_vec3(0.012, -0.016, 0);
    row.size = scan.npoint;
    row.work = "registration from a start";
    OM_TRY_DONE(time_registration(&def, &model, &scan, &row));
    def.has_start = false;
    row.work = "registration from none";
    status = time_registration(&def, &model, &scan, &row);
done:
    om_scan_done(&scan);
    om_surface_done(&model);
    om_surface_done(&truth);
    return status;
}
