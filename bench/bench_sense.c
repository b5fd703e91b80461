// bench_sense.c: what a camera costs a control cycle: refit after the vertices moved, colour, depth with noise,
// point cloud, the visibility of a region, depth of a stereo pair, and points followed from picture to picture.
//
// The scene is the lift of a sheet over a disc with a gripper: about 5,000 triangles, colour and depth at 320 x 240.
#include "bench.h"
#include "omentum/sense_track.h"

#define WIDTH 320
#define HEIGHT 240
#define NDISC 1000  // points of the region
#define NTRACK 300
#define MAX_RUN 200

typedef struct Field {
    OmTetMesh mesh;
    OmSurface skin, disc, board, tool;
    int* skin_vert;
    double* x;  // of the skin, lifted
    OmSenseScene* scene;
    int skin_id, disc_id, ntri;
    OmCamera camera;
    OmPicture picture, second;  // the second 5 mm to the right
    float* stereo;              // depth
    float *depth, *normal;
    int* id;
    double *point, *point_normal;  // of the cloud
    double region[3 * NDISC];      // points of the disc
    double up[3 * NDISC];          // their normals
    OmTrackPicture last;           // of the frame before
    OmTrack track[NTRACK];
} Field;

static void field_done(Field* f) {
    om_sense_scene_destroy(f->scene);
    om_tet_mesh_done(&f->mesh);
    om_surface_done(&f->skin);
    om_surface_done(&f->disc);
    om_surface_done(&f->board);
    om_surface_done(&f->tool);
    om_picture_done(&f->picture);
    om_picture_done(&f->second);
    om_track_picture_done(&f->last);
    om_free(f->stereo);
    om_free(f->skin_vert);
    om_free(f->x);
    om_free(f->depth);
    om_free(f->normal);
    om_free(f->id);
    om_free(f->point);
    om_free(f->point_normal);
}

// A disc of radius 10 mm at the height z, as a fan; the points of the region fill it evenly.
static OmStatus make_disc(Field* f, double z) {
    enum { N = 64 };
    OM_TRY(om_surface_init(&f->disc, N + 1, N));
    om_store3(f->disc.x, N, om_vec3(-0.03, 0, z));
    for (int i = 0; i < N; ++i) {
        double a = 2 * OM_PI * i / N;
        om_store3(f->disc.x, i, om_vec3(-0.03 + 0.01 * cos(a), 0.01 * sin(a), z));
        int* v = &f->disc.tri_vert[3 * i];
        v[0] = N, v[1] = i, v[2] = (i + 1) % N;
    }
    for (int i = 0; i < NDISC; ++i) {
        double r = 0.01 * sqrt((i + 0.5) / NDISC), a = i * OM_PI * (3 - sqrt(5.0));
        om_store3(f->region, i, om_vec3(-0.03 + r * cos(a), r * sin(a), z));
        om_store3(f->up, i, om_vec3(0, 0, 1));
    }
    return OM_OK;
}

static OmStatus make_board(Field* f) {
    OM_TRY(om_surface_init(&f->board, 4, 2));
    double r = 0.13;
    for (int i = 0; i < 4; ++i)
        om_store3(f->board.x, i, om_vec3(i % 3 ? r : -r, i / 2 ? r : -r, -1e-4));
    for (int k = 0; k < 6; ++k) f->board.tri_vert[k] = (int[6]){0, 1, 2, 0, 2, 3}[k];
    return OM_OK;
}

static OmStatus make_tool(Field* f) {
    OmPose rcm = {om_vec3(0.015, -0.105, 0.125), om_quat_identity()};
    OmPsm psm = om_psm_default(OM_PROGRASP, rcm);
    OmMat3 down = om_mat3_cols(om_vec3(0, 1, 0), om_vec3(1, 0, 0), om_vec3(0, 0, -1));
    double near_zero[OM_PSM_NJOINT] = {0}, q[OM_PSM_NJOINT];
    OM_TRY(om_psm_inverse(&psm, (OmPose){om_vec3(-0.01, 0, 0.038), om_quat_from_mat3(down)},
                          near_zero, q));
    return om_psm_surface(&psm, q, 0.25, &f->tool);
}

// Heights of a sheet lifted by `share` of 35 mm.
static void lift(Field* f, double share) {
    for (int i = 0; i < f->skin.nvert; ++i) {
        OmVec3 p = om_load3(f->skin.x, i);
        double k = share * exp(-((p.x + 0.03) * (p.x + 0.03) + p.y * p.y) / (2 * 0.022 * 0.022));
        om_store3(f->x, i, om_add(p, om_vec3(0.02 * k, 0, 0.035 * k)));
    }
}

static OmStatus make_scene(Field* f) {
    const OmSenseLook fat = {.red = 0.93,
                             .green = 0.66,
                             .blue = 0.36,
                             .gloss = 0.6,
                             .texture = OM_TEXTURE_FAT,
                             .is_smooth = true};
    const OmSenseLook magenta = {.red = 0.85, .green = 0.08, .blue = 0.55, .gloss = 0.4};
    const OmSenseLook paint = {.red = 0.30, .green = 0.42, .blue = 0.48, .is_checker = true};
    const OmSenseLook steel = {.red = 0.55, .green = 0.57, .blue = 0.60, .gloss = 0.9};
    int id;
    OM_TRY(om_sense_scene_create(&f->scene));
    OM_TRY(om_sense_scene_add(f->scene, &f->skin, &fat, &f->skin_id));
    OM_TRY(om_sense_scene_add(f->scene, &f->disc, &magenta, &f->disc_id));
    OM_TRY(om_sense_scene_add(f->scene, &f->board, &paint, &id));
    OM_TRY(om_sense_scene_add(f->scene, &f->tool, &steel, &id));
    f->ntri = f->skin.ntri + f->disc.ntri + f->board.ntri + f->tool.ntri;
    return om_sense_scene_commit(f->scene);
}

static OmStatus make_field(Field* f) {
    OmStatus status = OM_OK;
    OM_TRY(
        om_tet_mesh_box(om_vec3(-0.06, -0.06, 0), om_vec3(0.06, 0.06, 0.005), 33, 33, 2, &f->mesh));
    OM_TRY(om_tet_mesh_boundary(&f->mesh, &f->skin, &f->skin_vert));
    OM_TRY(make_disc(f, 1e-4));
    OM_TRY(make_board(f));
    OM_TRY(make_tool(f));
    OM_TRY(make_scene(f));
    double tilt = 35 * OM_PI / 180, away = 0.16;
    f->camera = (OmCamera){om_pose_look_at(om_vec3(-away * cos(tilt), 0, away * sin(tilt)),
                                           om_vec3(0, 0, 0.0025), om_vec3(0, 0, 1)),
                           WIDTH,
                           HEIGHT,
                           60 * OM_PI / 180,
                           0.01,
                           1};
    OM_TRY(om_picture_init(&f->picture, WIDTH, HEIGHT, 3));
    OM_TRY(om_picture_init(&f->second, WIDTH, HEIGHT, 3));
    OM_ALLOC_DONE(f->stereo, WIDTH * HEIGHT);
    OM_ALLOC_DONE(f->x, 3 * (size_t)f->skin.nvert);
    OM_ALLOC_DONE(f->depth, WIDTH * HEIGHT);
    OM_ALLOC_DONE(f->normal, 3 * WIDTH * HEIGHT);
    OM_ALLOC_DONE(f->id, WIDTH * HEIGHT);
    OM_ALLOC_DONE(f->point, 3 * WIDTH * HEIGHT);
    OM_ALLOC_DONE(f->point_normal, 3 * WIDTH * HEIGHT);
done:
    return status;
}

enum { REFIT, COLOUR, DEPTH, ALL, CLOUD, VISIBILITY, STEREO, TRACK, NSTAGE };
static const char* const stage_name[NSTAGE] = {"refit after a motion",
                                               "colour",
                                               "depth with noise",
                                               "refit, colour and depth",
                                               "point cloud",
                                               "visibility of 1,000 points",
                                               "depth of a stereo pair",
                                               "300 points followed"};

// The time of stereo matching alone, without that of the second picture.
static OmStatus take_stereo(Field* f, const OmSenseOptions* options, double* time) {
    OmCamera right = f->camera;
    OmPose* p = &right.pose_world_camera;
    p->p = om_madd(p->p, 0.005, om_quat_rotate(p->q, om_vec3(1, 0, 0)));
    OM_TRY(om_sense_render(f->scene, &right, options, &f->second));
    OmStereoDef def = om_stereo_default_def();
    def.nworker = options->nworker;
    OmStereoPair pair = {f->camera, right, &f->picture, &f->second};
    double t0 = bench_now();
    OM_TRY(om_stereo_depth(&def, &pair, f->stereo, NULL));
    *time = bench_now() - t0;
    return OM_OK;
}

// Corners of the frame before, followed to this one: the time with the pyramid of this picture, without the corners.
static OmStatus take_track(Field* f, const OmSenseOptions* options, double* time) {
    OmTrackDef def = om_track_default_def();
    OmTrackPicture now;
    double at[2 * NTRACK];
    int n = 0;
    def.nworker = options->nworker;
    if (f->last.nlevel > 0) OM_TRY(om_track_find_corners(&def, &f->last, NULL, NTRACK, at, &n));
    double t0 = bench_now();
    OM_TRY(om_track_picture_init(&def, &f->picture, &now));
    OmStatus status = n > 0 ? om_track_follow(&def, &f->last, &now, n, at, NULL, f->track) : OM_OK;
    *time = bench_now() - t0;
    om_track_picture_done(&f->last);
    f->last = now;
    return status;
}

// Frame 0 or 1: times of its stages in s, and the hash of what it gave.
static OmStatus take_frame(Field* f, int nworker, int frame, double* time, uint64_t* hash) {
    OmSenseOptions options = om_sense_options_default();
    options.nworker = nworker;
    OmDepthNoise noise = om_depth_noise_default(1);
    noise.nworker = nworker;
    lift(f, 0.9 + 0.1 * frame);
    double t0 = bench_now();
    om_sense_scene_update(f->scene, f->skin_id, f->x, NULL);
    OM_TRY(om_sense_scene_commit(f->scene));
    double t1 = bench_now();
    OM_TRY(om_sense_render(f->scene, &f->camera, &options, &f->picture));
    double t2 = bench_now();
    OM_TRY(om_sense_depth(f->scene, &f->camera, nworker, f->depth, f->id, f->normal));
    om_depth_add_noise(&noise, &f->camera, (uint64_t)frame, f->normal, f->depth);
    double t3 = bench_now();
    int n = om_depth_to_cloud(&f->camera, f->depth, f->id, f->normal, f->skin_id, f->point,
                              f->point_normal);
    double t4 = bench_now(), share;
    OM_TRY(om_sense_visibility(f->scene, &f->camera, f->region, f->up, NDISC,
                               (uint64_t)1 << f->disc_id, &share));
    double t5 = bench_now();
    time[REFIT] = t1 - t0, time[COLOUR] = t2 - t1, time[DEPTH] = t3 - t2, time[ALL] = t3 - t0;
    time[CLOUD] = t4 - t3, time[VISIBILITY] = t5 - t4;
    OM_TRY(take_stereo(f, &options, &time[STEREO]));
    OM_TRY(take_track(f, &options, &time[TRACK]));
    uint64_t h = om_hash(f->picture.pixel, 3 * WIDTH * HEIGHT, OM_HASH_SEED);
    h = om_hash(f->depth, WIDTH * HEIGHT * sizeof(float), h);
    h = om_hash(f->point, 3 * (size_t)n * sizeof(double), h);
    h = om_hash(f->stereo, WIDTH * HEIGHT * sizeof(float), h);
    for (int i = 0; i < NTRACK; ++i) h = om_hash(&f->track[i].u, sizeof f->track[i].u, h);
    *hash = om_hash(&share, sizeof share, h);
    return OM_OK;
}

OmStatus bench_sense(const BenchOptions* options) {
    Field f = {0};
    // Runs are short, so ten times the requested number is made.
    int nrun = options->nrun > MAX_RUN / 10 ? MAX_RUN : 10 * options->nrun;
    double time[NSTAGE][MAX_RUN], one[NSTAGE];
    uint64_t hash = OM_HASH_SEED;
    OmStatus status = make_field(&f);
    for (int run = -2; run < nrun && status == OM_OK; ++run) {  // the first two warm up
        status = take_frame(&f, options->nworker, run & 1, one, &hash);
        for (int k = 0; k < NSTAGE && run >= 0; ++k) time[k][run] = one[k];
    }
    for (int k = 0; k < NSTAGE && status == OM_OK; ++k) {
        BenchRow row = {
            .bench = "sense",
            .scene = "lifted sheet, disc, board, gripper; 320x240",
            .work = stage_name[k],
            .size = f.ntri,
            .nworker = k == COLOUR || k == DEPTH || k == ALL || k == STEREO ? options->nworker : 1,
            .steps = 1,
            .hash = hash};
        if (k == ALL) row.reference = "goal of 10 ms", row.reference_ms = 10;
        bench_times(time[k], nrun, &row);
        status = bench_print(&row);
    }
    field_done(&f);
    return status;
}
