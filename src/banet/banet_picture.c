// banet_picture.c: a depth picture of a deformed body with its tool, and the scan of it.
//
// The camera stands 0.15 to 0.35 m from a point between the body's middle and the grasp, mostly on the side of the
// normal of the grasped surface, above the board if there is one. A camera that sees too little tissue, or too little
// near the grasp, is drawn again. The picture has the noise of a depth camera, no depth at grazing angles and in a few
// discs (highlights, smoke), and a shaft before the tissue. Colours are those of segmentation without errors.
//
// The scan is made with the camera's calibration, which is off by a small motion about the grasp, as the pose of a
// camera with respect to a robot is.
#include <math.h>
#include <string.h>

#include "banet/banet_view_internal.h"
#include "omentum/world_cloud.h"

#define FRONT_SHARE 0.8   // of cameras on the side of the grasp's normal
#define BOARD_RISE 0.25   // sine of the least angle of a camera above the board
#define NEAR_GRASP 0.025  // m, from the grasp to pixels that show it
#define NTOOL 6           // directions of the shaft drawn
#define SHAFT_RADIUS 0.004
#define JAW_RADIUS 0.0025
#define JAW_LENGTH 0.015
#define NSIDE 10          // of the shaft's polygon
#define CLEARANCE 0.006   // m, from the shaft's axis; nearer vertices are counted
#define BOARD_SIZE 1.0    // m, half of the board's side
#define BOARD_BELOW 2e-4  // m, the board's picture is lower: no tissue lies in it
#define REACH 0.3         // m, of the tissue from its place at rest

// ---- the tool ---------------------------------------------------------------------------------------------------

static OmVec3 draw_direction(OmRng* rng) {
    OmVec3 d = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
    return om_norm(d) > 0 ? om_normalize(d) : om_vec3(0, 0, 1);
}

// Sum of the normals of the deformed triangles that have a grasped vertex.
static OmVec3 find_normal(const BanetTruth* t) {
    OmVec3 sum = om_vec3(0, 0, 0);
    double area = 0;
    for (int k = 0; k < t->surface->ntri; ++k) {
        const int* v = t->surface->tri_vert + 3 * (size_t)k;
        if (!t->grasped[v[0]] && !t->grasped[v[1]] && !t->grasped[v[2]]) continue;
        OmVec3 a = om_load3(t->x, t->surface_vert[v[0]]);
        OmVec3 n = om_cross(om_sub(om_load3(t->x, t->surface_vert[v[1]]), a),
                            om_sub(om_load3(t->x, t->surface_vert[v[2]]), a));
        sum = om_add(sum, n);
        area += om_norm(n);
    }
    return om_norm(sum) > 0.2 * area ? om_normalize(sum) : om_vec3(0, 0, 0);
}

// Vertices of the deformed body near the shaft's axis, beyond the jaws.
static int count_near(const BanetTruth* t, OmVec3 tip, OmVec3 direction) {
    int n = 0;
    for (int i = 0; i < t->surface->nvert; ++i) {
        OmVec3 e = om_sub(om_load3(t->x, t->surface_vert[i]), tip);
        double along = om_dot(e, direction);
        n += along > JAW_LENGTH && om_norm(om_madd(e, -along, direction)) < CLEARANCE;
    }
    return n;
}

// Of the directions drawn, the one with the fewest vertices near the shaft.
static OmVec3 draw_remote(const BanetTruth* t, const BanetTool* tool, OmRng* rng) {
    OmVec3 up = om_quat_rotate(t->pose_world_board.q, om_vec3(0, 0, 1)), best = up;
    int fewest = 0;
    for (int k = 0; k < NTOOL; ++k) {
        OmVec3 d = draw_direction(rng);
        if (om_dot(d, tool->normal) < 0) d = om_scale(-1, d);
        if (t->has_board && om_dot(d, up) < BOARD_RISE) d = om_normalize(om_madd(d, 1.5, up));
        int n = count_near(t, tool->pose_world_now.p, d);
        if (k > 0 && n >= fewest) continue;
        best = d;
        fewest = n;
    }
    return om_madd(tool->pose_world_now.p, om_rng_range(rng, 0.12, 0.2), best);
}

OmStatus om__banet_tool_make(const BanetTruth* t, OmRng* rng, BanetTool* tool) {
    memset(tool, 0, sizeof *tool);
    const OmTetMesh* mesh = t->mesh;
    OmVec3 a = om_vec3(0, 0, 0), b = a;
    int n = 0;
    for (int i = 0; i < t->surface->nvert; ++i) {
        if (!t->grasped[i]) continue;
        a = om_add(a, om_load3(mesh->x, t->surface_vert[i]));
        b = om_add(b, om_load3(t->x, t->surface_vert[i]));
        ++n;
    }
    OM_CHECK(n > 0, OM_INVALID, "banet: no vertex of the body is grasped");
    a = om_scale(1.0 / n, a);
    b = om_scale(1.0 / n, b);
    OmMat3 covariance = om_mat3_diag(om_vec3(0, 0, 0));
    for (int i = 0; i < t->surface->nvert; ++i) {
        if (!t->grasped[i]) continue;
        OmVec3 p = om_sub(om_load3(mesh->x, t->surface_vert[i]), a);
        covariance = om_mat3_add(covariance,
                                 om_mat3_outer(om_sub(om_load3(t->x, t->surface_vert[i]), b), p));
        tool->radius = fmax(tool->radius, om_norm(p));
    }
    tool->radius = fmax(1.001 * tool->radius, 1e-3);
    OmQuat q = n >= 3 ? om_quat_from_mat3(om_mat3_polar(covariance)) : om_quat_identity();
    tool->pose_world_grasp = (OmPose){a, om_quat_identity()};
    tool->pose_world_now = (OmPose){b, q};
    tool->normal = find_normal(t);
    tool->remote = draw_remote(t, tool, rng);
    return OM_OK;
}

// A prism around the axis from the tip to the remote end: jaws, then the shaft; open at its ends.
static OmStatus make_shaft(const BanetTool* tool, OmSurface* s) {
    OM_TRY(om_surface_init(s, 4 * NSIDE, 6 * NSIDE));
    OmVec3 tip = tool->pose_world_now.p, axis = om_normalize(om_sub(tool->remote, tip));
    OmVec3 x = fabs(axis.x) < 0.7 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0);
    x = om_normalize(om_madd(x, -om_dot(x, axis), axis));
    OmVec3 y = om_cross(axis, x);
    const double at[4] = {0, JAW_LENGTH, JAW_LENGTH, om_distance(tool->remote, tip)};
    const double radius[4] = {JAW_RADIUS, JAW_RADIUS, SHAFT_RADIUS, SHAFT_RADIUS};
    for (int ring = 0; ring < 4; ++ring)
        for (int k = 0; k < NSIDE; ++k) {
            double angle = 2 * OM_PI * k / NSIDE;
            OmVec3 out = om_add(om_scale(cos(angle), x), om_scale(sin(angle), y));
            om_store3(s->x, NSIDE * ring + k,
                      om_madd(om_madd(tip, at[ring], axis), radius[ring], out));
        }
    for (int ring = 0, t = 0; ring < 3; ++ring)
        for (int k = 0; k < NSIDE; ++k, t += 2) {
            int a = NSIDE * ring + k, b = NSIDE * ring + (k + 1) % NSIDE;
            const int v[6] = {a, b, a + NSIDE, b, b + NSIDE, a + NSIDE};
            memcpy(s->tri_vert + 3 * (size_t)t, v, sizeof v);
        }
    return OM_OK;
}

static OmStatus make_board(const BanetTruth* t, OmSurface* s) {
    static const int tri[6] = {0, 1, 2, 0, 2, 3};
    static const double side[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    OM_TRY(om_surface_init(s, 4, 2));
    for (int k = 0; k < 4; ++k)
        om_store3(
            s->x, k,
            om_pose_apply(t->pose_world_board,
                          om_vec3(BOARD_SIZE * side[k][0], BOARD_SIZE * side[k][1], -BOARD_BELOW)));
    memcpy(s->tri_vert, tri, sizeof tri);
    return OM_OK;
}

// ---- the camera -------------------------------------------------------------------------------------------------

enum { TISSUE, TOOL, BOARD };  // objects of the picture, in this order

// Objects of the picture; without a tool the shaft is behind the camera's range.
static OmStatus make_sense(const BanetViewDef* def, const BanetTruth* t, const BanetTool* tool,
                           OmSenseScene** out) {
    OmSurface tissue = {0}, shaft = {0}, board = {0};
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    look.texture = OM_TEXTURE_NONE;  // the colours are those of the parts
    OmStatus status = OM_OK;
    int id;
    OM_TRY_DONE(om_sense_scene_create(out));
    OM_TRY_DONE(om_surface_init(&tissue, t->surface->nvert, t->surface->ntri));
    for (int i = 0; i < tissue.nvert; ++i)
        om_store3(tissue.x, i, om_load3(t->x, t->surface_vert[i]));
    memcpy(tissue.tri_vert, t->surface->tri_vert, 3 * (size_t)tissue.ntri * sizeof(int));
    OM_TRY_DONE(om_sense_scene_add(*out, &tissue, &look, &id));
    OM_TRY_DONE(make_shaft(tool, &shaft));
    OM_TRY_DONE(om_sense_scene_add(*out, &shaft, &look, &id));
    om_sense_scene_show(*out, id, def->has_tool);
    if (t->has_board) {
        OM_TRY_DONE(make_board(t, &board));
        OM_TRY_DONE(om_sense_scene_add(*out, &board, &look, &id));
    }
    OM_TRY_DONE(om_sense_scene_commit(*out));
done:
    om_surface_done(&tissue);
    om_surface_done(&shaft);
    om_surface_done(&board);
    return status;
}

static OmVec3 find_middle(const BanetTruth* t) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < t->surface->nvert; ++i)
        sum = om_add(sum, om_load3(t->x, t->surface_vert[i]));
    return om_scale(1.0 / t->surface->nvert, sum);  // a surface has vertices
}

static OmCamera draw_camera(const BanetViewDef* def, const BanetTruth* t, const BanetTool* tool,
                            OmVec3 middle, OmRng* rng) {
    OmVec3 up = om_quat_rotate(t->pose_world_board.q, om_vec3(0, 0, 1)), d = draw_direction(rng);
    bool is_front = om_rng_uniform(rng) < FRONT_SHARE;
    if (is_front && om_dot(d, tool->normal) < 0) d = om_scale(-1, d);
    if (t->has_board) {
        if (om_dot(d, up) < 0) d = om_madd(d, -2 * om_dot(d, up), up);
        if (om_dot(d, up) < BOARD_RISE) d = om_normalize(om_madd(d, 1, up));
    }
    OmVec3 target = om_lerp(middle, tool->pose_world_now.p, om_rng_range(rng, 0, 0.7));
    target = om_madd(target, 0.01, draw_direction(rng));
    OmVec3 eye = om_madd(target, om_rng_range(rng, def->distance[0], def->distance[1]), d);
    return (OmCamera){.pose_world_camera = om_pose_look_at(eye, target, draw_direction(rng)),
                      .width = def->width,
                      .height = def->height,
                      .fov = def->fov,
                      .near_m = 0.01,
                      .far_m = 2};
}

typedef struct Picture {  // picture_done frees
    OmCamera camera;
    size_t npixel;
    float* depth;
    int* id;
    float* normal;
    unsigned char* rgb;
} Picture;

static void picture_done(Picture* p) {
    om_free(p->depth);
    om_free(p->id);
    om_free(p->normal);
    om_free(p->rgb);
}

static bool sees_enough(const BanetViewDef* def, const Picture* p, OmVec3 grasp, int* ntissue) {
    int ngrasp = 0;
    *ntissue = 0;
    OmPose pose_camera_world = om_pose_inverse(p->camera.pose_world_camera);
    double z = om_pose_apply(pose_camera_world, grasp).z, u = 0, v = 0;
    if (!om_camera_project(&p->camera, grasp, &u, &v) || !(z > 0)) return false;
    double reach = NEAR_GRASP / z * om_camera_lens(&p->camera).fy;
    for (int i = 0; i < (int)p->npixel; ++i) {
        if (p->id[i] != TISSUE) continue;
        ++*ntissue;
        double du = i % p->camera.width + 0.5 - u, dv = i / p->camera.width + 0.5 - v;
        ngrasp += du * du + dv * dv < reach * reach && fabs((double)p->depth[i] - z) < NEAR_GRASP;
    }
    return *ntissue >= def->min_tissue && ngrasp >= def->min_grasp;
}

// ---- errors of the picture --------------------------------------------------------------------------------------

static void punch_holes(const BanetViewDef* def, Picture* p, OmRng* rng) {
    int n = (int)om_rng_below(rng, (uint32_t)def->max_hole + 1);
    for (int k = 0; k < n; ++k) {
        double u = om_rng_range(rng, 0, p->camera.width),
               v = om_rng_range(rng, 0, p->camera.height);
        double r = om_rng_range(rng, 0.01, 0.06) * p->camera.width;
        for (int i = 0; i < (int)p->npixel; ++i) {
            double du = i % p->camera.width + 0.5 - u, dv = i / p->camera.width + 0.5 - v;
            if (du * du + dv * dv < r * r) p->depth[i] = 0;
        }
    }
}

static void add_noise(const BanetViewDef* def, Picture* p, OmRng* rng) {
    OmDepthNoise noise = om_depth_noise_default(om_rng_u32(rng));
    noise.a *= def->noise;
    noise.b *= def->noise;
    noise.nworker = 1;
    if (def->noise > 0) om_depth_add_noise(&noise, &p->camera, 0, p->normal, p->depth);
    punch_holes(def, p, rng);
}

// Colours in the ranges of om_sense_range, also where there is no depth; other anatomy or drapes behind everything. A
// robot knows where its tool is: its pixels are black, which no part is, and make_scan marks them.
static void paint(Picture* p) {
    static const unsigned char color[3][3] = {
        [TISSUE] = {210, 170, 90}, [TOOL] = {0, 0, 0}, [BOARD] = {60, 160, 120}};
    for (size_t i = 0; i < p->npixel; ++i)
        memcpy(p->rgb + 3 * i, color[p->id[i] < 0 ? BOARD : p->id[i]], 3);
}

// The pose of the camera as calibrated: off by a small motion about the grasp.
static OmPose miscalibrate(const BanetViewDef* def, OmPose pose_world_camera, OmVec3 about,
                           OmRng* rng) {
    double e[6];
    for (int k = 0; k < 6; ++k) e[k] = om_rng_normal(rng);
    OmVec3 turn = om_scale(def->camera_turn, om_vec3(e[0], e[1], e[2]));
    double angle = om_norm(turn);
    OmQuat q =
        angle > 0 ? om_quat_axis_angle(om_scale(1 / angle, turn), angle) : om_quat_identity();
    OmVec3 from = om_sub(pose_world_camera.p, about);
    OmVec3 p = om_add(about, om_quat_rotate(q, from));
    p = om_madd(p, def->camera_shift, om_vec3(e[3], e[4], e[5]));
    return (OmPose){p, om_quat_mul(q, pose_world_camera.q)};
}

static OmStatus make_scan(const Picture* p, const OmCamera* camera, const OmSite* site,
                          OmScan* scan) {
    const OmScanDef how = om_scan_default_def(om_site_spacing(site));
    OmCloudDef space = om_cloud_default_def(NULL, site);
    space.reach = REACH;
    OmObservation obs = {0};
    obs.rgbd.camera = *camera;
    obs.rgbd.depth = p->depth;
    obs.rgbd.color = (OmPicture){
        .width = camera->width, .height = camera->height, .nchannel = 3, .pixel = p->rgb};
    OM_TRY(om_scan_from_observation(&how, &space, &obs, scan));
    for (size_t i = 0; i < p->npixel; ++i)
        if (p->id[i] == TOOL) scan->pixel[i] = OM_SCAN_TOOL;
    return OM_OK;
}

OmStatus om__banet_look(const BanetViewDef* def, const BanetTruth* truth, const BanetTool* tool,
                        const OmSite* site, OmRng* rng, OmScan* scan, int* npixel) {
    memset(scan, 0, sizeof *scan);
    *npixel = 0;
    OmSenseScene* sense = NULL;
    Picture p = {.npixel = (size_t)def->width * (size_t)def->height};
    OmVec3 middle = find_middle(truth), grasp = tool->pose_world_now.p;
    OmStatus status = OM_OK;
    bool is_good = false;
    OM_ALLOC_DONE(p.depth, p.npixel);
    OM_ALLOC_DONE(p.id, p.npixel);
    OM_ALLOC_DONE(p.normal, 3 * p.npixel);
    OM_ALLOC_DONE(p.rgb, 3 * p.npixel);
    OM_TRY_DONE(make_sense(def, truth, tool, &sense));
    for (int k = 0; k < def->max_camera && !is_good; ++k) {
        p.camera = draw_camera(def, truth, tool, middle, rng);
        OM_TRY_DONE(om_sense_depth(sense, &p.camera, 1, p.depth, p.id, p.normal));
        is_good = sees_enough(def, &p, grasp, npixel);
    }
    OM_CHECK_DONE(is_good, OM_NOT_CONVERGED, "banet: no camera of %d sees enough of the body",
                  def->max_camera);
    add_noise(def, &p, rng);
    paint(&p);
    OmCamera known = p.camera;
    known.pose_world_camera = miscalibrate(def, p.camera.pose_world_camera, grasp, rng);
    OM_TRY_DONE(make_scan(&p, &known, site, scan));
done:
    om_sense_scene_destroy(sense);
    picture_done(&p);
    return status;
}
