// calibrate_synthetic.c: synthetic observations: those of the scene's world at the positions and
// levels of a problem.
//
// Landmarks get noise in each coordinate. A cloud comes from the scene's depth camera with the camera's noise,
// thinned to about four times as many points as the twin compares with it. The thesis takes equal numbers
// (5.4.1); then the nearest cloud point is 0.4 spacings away on average, however good the model.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_problem_internal.h"
#include "calibrate/calibrate_tissue_internal.h"
#include "omentum/sense.h"

typedef struct Maker {
    const OmCalibrationProblem* p;
    const Body* world;
    OmPose back;            // world to task frame
    OmEmbedding embedding;  // of the landmarks
    OmSurface surface;      // boundary of the tissue
    int* surface_vert;      //
    OmSenseScene* sense;    // null: no cloud is needed
    OmCamera camera;        //
    int surface_id;         //
    float *depth, *normal;  // of each pixel
    int* id;                //
    double *cloud, *x;      // points of all pixels; of the landmarks
    OmRng rng;
    double noise;
    int path;
    uint64_t frame;
    OmText* text;
} Maker;

static OmStatus append_row(const Maker* m, const char* level, const char* landmark, OmVec3 v) {
    return om_text_append(m->text, "%s,%s,%s,%.5f,%.5f,%.5f\n", m->p->file.path[m->path].name,
                          level, landmark, v.x, v.y, v.z);
}

// ---- the camera -----------------------------------------------------------------------------------

static bool wants_cloud(const Sights* s) {
    for (int i = 0; i < s->nseen; ++i)
        if (s->seen[i].landmark == OM_SEEN_CLOUD) return true;
    return false;
}

// On the side of +x, as in the simulated world.
static OmStatus make_camera(Maker* m) {
    const OmSite* site = &m->world->site;
    const OmSceneCamera* c = &m->p->scene.rgbd;
    OmVec3 eye = om_vec3(c->distance * cos(c->elevation), 0, c->distance * sin(c->elevation));
    OmPose at = site->pose_world_task;
    OmPose look =
        om_pose_look_at(om_pose_apply(at, eye), om_pose_apply(at, om_vec3(0, 0, site->half_size.z)),
                        om_quat_rotate(at.q, om_vec3(0, 0, 1)));
    m->camera = om_scene_camera_place(c, look);
    size_t n = (size_t)c->width * (size_t)c->height;
    OM_ALLOC(m->depth, n);
    OM_ALLOC(m->normal, 3 * n);
    OM_ALLOC(m->id, n);
    OM_ALLOC(m->cloud, 3 * n);
    OM_TRY(om_tet_mesh_boundary(&site->mesh, &m->surface, &m->surface_vert));
    OM_TRY(om_sense_scene_create(&m->sense));
    return om_sense_scene_add(m->sense, &m->surface, &(OmSenseLook){.red = 1}, &m->surface_id);
}

static OmStatus append_cloud(Maker* m, const char* level, const double* vert_x) {
    om_sense_scene_update(m->sense, m->surface_id, vert_x, m->surface_vert);
    OM_TRY(om_sense_scene_commit(m->sense));
    OM_TRY(om_sense_depth(m->sense, &m->camera, 1, m->depth, m->id, m->normal));
    OmDepthNoise noise = om_depth_noise_default((uint64_t)m->p->scene.seed);
    if (m->p->scene.world.has_depth_noise)
        om_depth_add_noise(&noise, &m->camera, m->frame++, m->normal, m->depth);
    int n = om_depth_to_cloud(&m->camera, m->depth, m->id, NULL, m->surface_id, m->cloud, NULL);
    OM_CHECK(n > 0, OM_INVALID, "path %s: the camera sees nothing of the tissue",
             m->p->file.path[m->path].name);
    const OmMeshSet* top = om_tet_mesh_find_set(&m->p->twin.site.mesh, "top");
    int max = 4 * (top && top->nvert ? top->nvert : m->surface.nvert), every = (n + max - 1) / max;
    for (int i = every / 2; i < n; i += every)
        OM_TRY(append_row(m, level, "cloud",
                          om_scale(1e3, om_pose_apply(m->back, om_load3(m->cloud, i)))));
    return OM_OK;
}

// ---- levels ---------------------------------------------------------------------------------------

static OmStatus append_landmark(Maker* m, const char* level, int landmark) {
    double e[3];
    for (int k = 0; k < 3; ++k) e[k] = m->noise * om_rng_normal(&m->rng);
    OmVec3 v = om_pose_apply(m->back, om_load3(m->x, landmark));
    return append_row(m, level, m->p->sights.landmark[landmark],
                      om_scale(1e3, om_add(v, om_load3(e, 0))));
}

static OmStatus append_level(void* ctx, int l, const double* vert_x, OmVec3 force) {
    Maker* m = ctx;
    const Sights* s = &m->p->sights;
    char level[32];
    snprintf(level, sizeof level, "%.9g", 1e3 * s->level[m->path][l]);
    if (s->nlandmark) om_embedding_eval(&m->embedding, vert_x, m->x);
    bool has_cloud = false;
    for (int i = 0; i < s->nseen; ++i) {
        const OmCalibrationSeen* o = &s->seen[i];
        if (o->path != m->path || o->level != l) continue;
        if (o->landmark >= 0) OM_TRY(append_landmark(m, level, o->landmark));
        if (o->landmark == OM_SEEN_FORCE)
            OM_TRY(append_row(m, level, "force", om_quat_rotate(m->back.q, force)));
        if (o->landmark == OM_SEEN_CLOUD && !has_cloud) OM_TRY(append_cloud(m, level, vert_x));
        has_cloud = has_cloud || o->landmark == OM_SEEN_CLOUD;
    }
    return OM_OK;
}

static OmStatus append_all(Maker* m, const OmTissueModel* model) {
    const Sights* s = &m->p->sights;
    OmCalibrationPath path[OM_CALIBRATION_MAX_PATH];
    om__calibrate_make_paths(m->p, m->world, path);
    OM_TRY(om_text_append(m->text, "experiment,level_mm,landmark,x_mm,y_mm,z_mm\n"));
    for (int i = 0; i < s->nlandmark; ++i)
        OM_TRY(append_row(m, "rest", s->landmark[i], om_scale(1e3, om_load3(s->rest, i))));
    const OmContactDef* contact = &m->world->contact;
    bool has_contact = contact->nobstacle > 0;
    for (m->path = 0; m->path < m->p->file.npath; ++m->path) {
        OmStatus status = om__calibrate_walk(model, &path[m->path], has_contact ? contact : NULL,
                                             append_level, m);
        OM_TRY(status);
        OM_CHECK(status == OM_OK, OM_INVALID,
                 "path %s: the world's tissue cannot be carried along it", path[m->path].name);
    }
    return OM_OK;
}

static OmStatus make(Maker* m, const double* param) {
    const Sights* s = &m->p->sights;
    OmTissueModel* model = NULL;
    OmStatus status;
    double rest[3 * OM_CALIBRATION_MAX_LANDMARK];
    OmPose at = m->world->site.pose_world_task;
    m->back = om_pose_inverse(at);
    for (int i = 0; i < s->nlandmark; ++i)
        om_store3(rest, i, om_pose_apply(at, om_load3(s->rest, i)));
    OM_ALLOC_DONE(m->x, 3 * (size_t)(s->nlandmark + 1));
    if (wants_cloud(s)) OM_TRY_DONE(make_camera(m));
    OM_TRY_DONE(om__calibrate_build((void*)m->world, param, 0, &model));
    OM_CHECK_DONE(status == OM_OK, OM_INVALID,
                  "the scene's world cannot be built with these parameters");
    if (s->nlandmark) OM_TRY_DONE(om_tissue_embed(model, s->nlandmark, rest, &m->embedding));
    OM_TRY_DONE(append_all(m, model));
done:
    om_tissue_destroy(model);
    return status;
}

OmStatus om_calibration_save_synthetic(const OmCalibrationProblem* p, const double* param,
                                       double noise, uint64_t seed, const char* path) {
    OM_CHECK(noise >= 0 && isfinite(noise), OM_INVALID, "noise is %g: at least 0", noise);
    for (int i = 0; i < 4; ++i)
        if (p->input[i][0]) OM_TRY(om_path_check_apart(p->input[i], path));
    OmText text = {0};
    Body* world = om_calloc(1, sizeof *world);
    if (!world) return OM_NO_MEMORY;
    Maker m = {.p = p, .world = world, .noise = noise, .rng = om_rng_init(seed, 0), .text = &text};
    OmStatus status = om__calibrate_make_body(p, true, world);
    if (status == OM_OK) status = make(&m, param);
    if (status == OM_OK) status = om_text_seal(&text);
    if (status == OM_OK) status = om_file_write(path, text.str, text.len);
    if (m.embedding.npoint) om_embedding_done(&m.embedding);
    om_sense_scene_destroy(m.sense);
    om_surface_done(&m.surface);
    om_free(m.surface_vert);
    om_free(m.depth);
    om_free(m.normal);
    om_free(m.id);
    om_free(m.cloud);
    om_free(m.x);
    om_text_done(&text);
    om_site_done(&world->site);
    om_free(world);
    return status;
}
