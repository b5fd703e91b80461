// register_cases.h: organs to register. The model is meshed by om_model_build; the scan is rendered from another, finer
// surface of the same organ, half seen from one camera, with the noise of a depth camera.
#ifndef OMENTUM_TEST_REGISTER_CASES_H
#define OMENTUM_TEST_REGISTER_CASES_H

#include "omentum/match_register.h"
#include "omentum/scene_model.h"
#include "omentum/shape_file.h"
#include "omentum/shape_sdf.h"
#include "test_common.h"

#define CASE_WIDTH 160
#define CASE_HEIGHT 120

typedef struct Organ {
    const char* name;
    const char* file;  // of the data folder, or with its whole path
    double unit;       // m, of a surface file; 0: a volume of one label
    double edge;       // m, of the model
} Organ;

static const Organ organ_list[] = {
    {"gallbladder", "ct_abdomen/organs/gallbladder.nii.gz", 0, 0.0030},
    {"kidney left", "ct_abdomen/organs/kidney_left.nii.gz", 0, 0.0045},
    {"kidney right", "ct_abdomen/organs/kidney_right.nii.gz", 0, 0.0045},
    {"liver", "ct_abdomen/organs/liver.nii.gz", 0, 0.0060},
    {"pancreas", "ct_abdomen/organs/pancreas.nii.gz", 0, 0.0020},
    {"spleen", "ct_abdomen/organs/spleen.nii.gz", 0, 0.0045},
    {"stomach", "ct_abdomen/organs/stomach.nii.gz", 0, 0.0045},
    {"liver2.obj", "livers/liver2.obj", 0.1, 0.0060},
    {"liver-smooth.obj", "livers/liver-smooth.obj", OM_UNIT_CM, 0.0025},
};
#define NORGAN ((int)(sizeof organ_list / sizeof *organ_list))

typedef struct OrganCase {
    OmSurface model, truth;
    OmSenseScene* scene;  // of the truth
    OmVec3 center;
    double radius;
} OrganCase;

static inline const char* organ_path(const Organ* organ) {
    return organ->file[0] == '/' ? organ->file : test_data(organ->file);
}

static inline void make_model(const Organ* organ, OmSurface* model) {
    OmModelDef def = om_model_default_def(organ_path(organ), organ->edge);
    def.unit = organ->unit;
    def.remesh = organ->unit > 0;
    def.nworker = 2;
    OmPatient patient;
    assert_ok(om_model_build(&def, NULL, &patient, NULL));
    assert_ok(om_tet_mesh_boundary(&patient.mesh, model, NULL));
    om_patient_done(&patient);
}

// Marching cubes at 1.5 mm on the voxels themselves, or the surface of the file.
static inline void make_truth(const Organ* organ, OmSurface* truth) {
    if (organ->unit > 0) {
        assert_ok(om_surface_load(organ_path(organ), organ->unit, truth));
        return;
    }
    OmVolume v;
    OmMask mask;
    OmSdf sdf;
    assert_ok(om_volume_load(organ_path(organ), &v));
    assert_ok(om_mask_init(&mask, v.grid.dim[0], v.grid.dim[1], v.grid.dim[2]));
    mask.grid = v.grid;
    for (size_t i = 0; i < om_volume_count(&v); ++i) mask.inside[i] = om_volume_value(&v, i) > 0;
    assert_ok(om_mask_keep_parts(&mask, 6, 0, NULL, NULL));
    assert_ok(om_mask_crop(&mask, 4));
    assert_ok(om_mask_fill_holes(&mask));
    OmSdfDef def = om_sdf_default_def(0.0015);
    assert_ok(om_sdf_from_mask(&mask, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, truth));
    om_sdf_done(&sdf);
    om_mask_done(&mask);
    om_volume_done(&v);
}

/// From c->model and c->truth, which the case then owns.
static inline void case_prepare(OrganCase* c) {
    OmSenseLook look = om_sense_look(OM_PART_ORGAN);
    int id;
    assert_ok(om_sense_scene_create(&c->scene));
    assert_ok(om_sense_scene_add(c->scene, &c->truth, &look, &id));
    assert_ok(om_sense_scene_commit(c->scene));
    OmVec3 lo = om_load3(c->truth.x, 0), hi = lo;
    for (int i = 0; i < c->truth.nvert; ++i) {
        lo = om_min3(lo, om_load3(c->truth.x, i));
        hi = om_max3(hi, om_load3(c->truth.x, i));
    }
    c->center = om_lerp(lo, hi, 0.5);
    c->radius = 0.5 * om_distance(lo, hi);
}

static inline void case_make(const Organ* organ, OrganCase* c) {
    make_model(organ, &c->model);
    make_truth(organ, &c->truth);
    case_prepare(c);
}

static inline void case_done(OrganCase* c) {
    om_sense_scene_destroy(c->scene);
    om_surface_done(&c->model);
    om_surface_done(&c->truth);
}

static inline OmVec3 random_direction(OmRng* rng) {
    double x = om_rng_normal(rng), y = om_rng_normal(rng);
    return om_normalize(om_vec3(x, y, om_rng_normal(rng)));
}

/// What a camera in a random direction sees, moved to a world at random; `pose_model_world` is the truth.
static inline void case_look(const OrganCase* c, uint64_t seed, OmScan* scan,
                             OmPose* pose_model_world) {
    OmRng rng = om_rng_init(seed, 1);
    static float depth[CASE_WIDTH * CASE_HEIGHT], normal[3 * CASE_WIDTH * CASE_HEIGHT];
    OmVec3 way = random_direction(&rng);
    double distance = 1.3 * c->radius + 0.12;
    OmVec3 eye = om_madd(c->center, distance, way);
    OmCamera camera = {.pose_world_camera = om_pose_look_at(eye, c->center, random_direction(&rng)),
                       .width = CASE_WIDTH,
                       .height = CASE_HEIGHT,
                       .fov = 2 * asin(c->radius / distance),
                       .near_m = 0.02,
                       .far_m = 1};
    assert_ok(om_sense_depth(c->scene, &camera, 2, depth, NULL, normal));
    OmDepthNoise noise = om_depth_noise_default(seed);
    om_depth_add_noise(&noise, &camera, 0, normal, depth);
    assert_ok(om_scan_init(CASE_WIDTH * CASE_HEIGHT, 0, scan));
    scan->npoint = om_depth_to_cloud(&camera, depth, NULL, normal, -1, scan->x, scan->normal);
    scan->has_camera = true;
    scan->camera = camera;
    scan->noise = noise.a + noise.b * distance * distance;
    OmQuat q = om_quat_axis_angle(random_direction(&rng), om_rng_range(&rng, 0, OM_PI));
    OmPose pose_world_model = {om_scale(0.3, random_direction(&rng)), q};
    for (int i = 0; i < scan->npoint; ++i) {
        om_store3(scan->x, i, om_pose_apply(pose_world_model, om_load3(scan->x, i)));
        om_store3(scan->normal, i, om_quat_rotate(q, om_load3(scan->normal, i)));
    }
    scan->camera.pose_world_camera = om_pose_mul(pose_world_model, camera.pose_world_camera);
    *pose_model_world = om_pose_inverse(pose_world_model);
}

/// A pose off by up to `angle` about the scan's centre, and up to `shift`.
static inline OmPose case_start(const OmScan* scan, OmPose truth, double angle, double shift,
                                uint64_t seed) {
    OmRng rng = om_rng_init(seed, 2);
    OmVec3 center = om_vec3(0, 0, 0);
    for (int i = 0; i < scan->npoint; ++i)
        center = om_madd(center, 1.0 / scan->npoint, om_load3(scan->x, i));
    OmQuat turn = om_quat_axis_angle(random_direction(&rng), om_rng_range(&rng, 0, angle));
    OmVec3 way = om_scale(om_rng_range(&rng, 0, shift), random_direction(&rng));
    OmPose start = {.q = om_quat_mul(turn, truth.q)};
    OmVec3 at = om_add(om_pose_apply(truth, center), way);
    start.p = om_sub(at, om_quat_rotate(start.q, center));
    return start;
}

/// Turn (degrees) and shift of the scan's centre (mm) between a result and the truth.
static inline void case_error(const OmRegistration* r, OmPose truth, double* angle_deg,
                              double* shift_mm) {
    OmQuat d = om_quat_mul(om_quat_conj(truth.q), r->pose_model_scan.q);
    double s = sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    *angle_deg = 2 * atan2(s, fabs(d.w)) * 180 / OM_PI;
    *shift_mm = 1e3 * om_distance(om_pose_apply(truth, r->center),
                                  om_pose_apply(r->pose_model_scan, r->center));
}

#endif
