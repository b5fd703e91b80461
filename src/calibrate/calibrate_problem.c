// calibrate_problem.c: set up a calibration from a problem's files.
//
// The scene is built once. A parameter vector changes a copy of its numbers, and the tissue is built from the
// copy. Any engine that the scene names can be calibrated.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_problem_internal.h"
#include "calibrate/calibrate_tissue_internal.h"
#include "omentum/world.h"

#define MAX_FILE_SIZE ((size_t)256 << 20)

// ---- models ---------------------------------------------------------------------------------------

static const SceneKey* key_of(const OmCalibrationProblem* p, int i) {
    return &om__calibrate_scene_key[p->file.param[i].name];
}

OmStatus om__calibrate_build(void* ctx, const double* param, int nworker, OmTissueModel** model) {
    const Body* b = ctx;
    const OmCalibrationProblem* p = b->problem;
    OmScene scene = p->scene;
    OmSite site = b->site;  // uses the same mesh and organ
    for (int i = 0; i < p->file.nparam; ++i)
        *(double*)((char*)&scene + key_of(p, i)->offset) = param[i];
    if (b->spring_factor > 0) scene.attach.stiffness *= b->spring_factor;
    om_site_set_numbers(&scene, &site);
    OmBodyParts parts;
    OmTissueDef def;
    OM_TRY(om_body_make_tissue_def(&scene, &site, &parts, &def));
    def.solver.nworker = nworker;
    def.solver.tolerance = 1e-5;  // a coarser tolerance would make the cost a step function
    OmStatus status = om_tissue_create(&def, model);
    // for example, clusters that leave particles out
    return status == OM_INVALID ? OM_UNSAT : status;
}

OmStatus om__calibrate_make_body(const OmCalibrationProblem* p, bool is_world, Body* b) {
    b->problem = p;
    OM_CHECK(p->scene.organ.deforms == OM_IN_NONE, OM_UNAVAILABLE,
             "%s: organ: a calibration knows a rigid organ alone; leave out `deforms`",
             om_scene_label(&p->scene));
    OM_TRY(om_site_build(&p->scene, is_world ? OM_SITE_WORLD : OM_SITE_TWIN, NULL, &b->site));
    b->contact = om_contact_default_def();
    b->contact.friction = p->scene.tissue.friction;
    b->board = (OmContactPlane){b->site.pose_world_task.p,
                                om_quat_rotate(b->site.pose_world_task.q, om_vec3(0, 0, 1))};
    int n = 0;
    if (b->site.has_ground) b->obstacle[n++] = om_plane_obstacle(&b->board);
    if (b->site.has_organ) b->obstacle[n++] = om_sdf_obstacle(&b->site.organ_sdf);
    b->contact.nobstacle = n;
    b->contact.obstacle = b->obstacle;
    return OM_OK;
}

// ---- paths and observations, in the world -----------------------------------------------------------

static OmStatus make_probe(const ProbeItem* item, OmProbe** probe) {
    OmProbeDef def = om_probe_default_def((OmProbeShape)item->shape);
    def.size = item->size;
    def.radius = item->radius;
    def.length = item->length;
    def.rounding = item->rounding;
    return om_probe_create(&def, probe);
}

void om__calibrate_make_paths(const OmCalibrationProblem* p, const Body* body,
                              OmCalibrationPath* path) {
    OmPose pose = body->site.pose_world_task;
    const Sights* s = &p->sights;
    for (int i = 0; i < p->file.npath; ++i) {
        const PathItem* item = &p->file.path[i];
        path[i] = (OmCalibrationPath){.name = item->name,
                                      .kind = (OmCalibrationPathKind)item->kind,
                                      .point = om_pose_apply(pose, item->point),
                                      .direction = om_quat_rotate(pose.q, item->direction),
                                      .along = om_quat_rotate(pose.q, item->along),
                                      .radius = item->radius,
                                      .probe = p->probe[i],
                                      .method = (OmPressMethod)item->method,
                                      .contact_ntri = item->contact_ntri,
                                      .friction = item->friction,
                                      .speed = item->speed,
                                      .time_step = item->time_step,
                                      .settle = item->settle,
                                      .nlevel = s->nlevel[i],
                                      .level = s->level[i]};
    }
}

// Points that are compared with clouds: the upper side of a sheet, which a camera sees, or the whole surface.
static OmStatus choose_cloud_points(const OmTetMesh* mesh, double** point, int* n) {
    const OmMeshSet* top = om_tet_mesh_find_set(mesh, "top");
    *n = top ? top->nvert : 0;
    if (*n == 0) return OM_OK;
    *point = om_alloc(3 * (size_t)*n, sizeof **point);
    if (!*point) return OM_NO_MEMORY;
    for (int i = 0; i < *n; ++i) om_store3(*point, i, om_load3(mesh->x, top->vert[i]));
    return OM_OK;
}

// @param seen_world  observations in the world that replace those of the problem (nseen); may be null
static OmStatus make_tissue(const OmCalibrationProblem* p, Body* body,
                            const OmCalibrationSeen* seen_world, OmCalibrationTissue** tissue) {
    OmPose pose = body->site.pose_world_task;
    OmCalibrationPath path[OM_CALIBRATION_MAX_PATH];
    const Sights* s = &p->sights;
    om__calibrate_make_paths(p, body, path);
    OmStatus status = OM_OK;
    OmCalibrationSeen* seen = NULL;
    double* cloud_point = NULL;
    double rest[3 * OM_CALIBRATION_MAX_LANDMARK];
    const char* name[OM_CALIBRATION_MAX_LANDMARK];
    for (int i = 0; i < s->nlandmark; ++i) {
        om_store3(rest, i, om_pose_apply(pose, om_load3(s->rest, i)));
        name[i] = s->landmark[i];
    }
    OM_ALLOC_DONE(seen, s->nseen);
    if (seen_world) memcpy(seen, seen_world, (size_t)s->nseen * sizeof *seen);
    for (int i = 0; !seen_world && i < s->nseen; ++i) {
        seen[i] = s->seen[i];
        seen[i].x = seen[i].landmark == OM_SEEN_FORCE ? om_quat_rotate(pose.q, seen[i].x)
                                                      : om_pose_apply(pose, seen[i].x);
    }
    OmCalibrationTissueDef def = om_calibration_tissue_default_def(om__calibrate_build, body);
    OM_TRY_DONE(choose_cloud_points(&p->twin.site.mesh, &cloud_point, &def.ncloud_point));
    def.cloud_point = cloud_point;
    def.contact = body->contact.nobstacle > 0 ? &body->contact : NULL;
    def.npath = p->file.npath, def.path = path;
    def.nlandmark = s->nlandmark, def.landmark = name, def.rest = rest;
    def.nobservation = s->nseen, def.observation = seen;
    def.force_scale = p->file.search.force_scale;
    status = om_calibration_tissue_create(&def, p->start, tissue);
done:
    om_free(seen);
    om_free(cloud_point);
    return status;
}

// ---- loading --------------------------------------------------------------------------------------

static OmStatus read_hashed(const char* path, uint64_t* hash, char** text, size_t* size) {
    OM_TRY(om_file_read(path, MAX_FILE_SIZE, text, size));
    *hash = om_hash(*text, *size, *hash);
    return OM_OK;
}

static OmStatus read_sights(const char* path, OmCalibrationProblem* p) {
    char* text;
    size_t size;
    OM_TRY(read_hashed(path, &p->hash, &text, &size));
    OmStatus status =
        om__calibrate_parse_sights(text, size, path, p->file.npath, p->file.path, &p->sights);
    om_free(text);
    return status;
}

static OmStatus hash_file(const char* path, uint64_t* hash) {
    char* text;
    size_t size;
    OM_TRY(read_hashed(path, hash, &text, &size));
    om_free(text);
    return OM_OK;
}

static OmStatus set_start(const char* path, OmCalibrationProblem* p) {
    for (int i = 0; i < p->file.nparam; ++i) {
        const ParamItem* item = &p->file.param[i];
        const SceneKey* key = key_of(p, i);
        bool is_given = !isnan(item->start);
        p->start[i] =
            is_given ? item->start * key->unit : *(double*)((char*)&p->scene + key->offset);
        double v = p->start[i] / key->unit;
        OM_CHECK(is_given || v >= 0, OM_INVALID,
                 "%s: parameters: %s: the scene takes it from the patient model; give its start",
                 path, key->name);
        OM_CHECK(v >= item->min && v <= item->max, OM_INVALID,
                 "%s: parameters: %s: %s %g is outside of min %g to max %g", path, key->name,
                 is_given ? "start" : "the scene's value", v, item->min, item->max);
    }
    return OM_OK;
}

static OmStatus check_effects(const char* path, const OmCalibrationProblem* p) {
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(&p->scene, OM_SITE_TWIN, &engine));
    for (int i = 0; i < p->file.nparam; ++i) {
        const SceneKey* key = key_of(p, i);
        OM_CHECK(!key->number || om_engine_uses(engine, key->number), OM_INVALID,
                 "%s: parameters: %s has no effect on the scene's tissue: engine %s; remove it",
                 path, key->name, engine->name);
    }
    return OM_OK;
}

static OmStatus load(const char* path, const char* observations, OmCalibrationProblem* p) {
    char dir[OM_SCENE_PATH], file[2 * OM_SCENE_PATH];
    p->hash = OM_HASH_SEED;
    OM_TRY(om__calibrate_read_problem(path, &p->file));
    OM_TRY(hash_file(path, &p->hash));
    OM_TRY(om_path_dir(path, dir, sizeof dir));
    OM_TRY(om_path_join(dir, p->file.scene, file, sizeof file));
    OM_TRY(om_scene_load(file, &p->scene));
    OM_TRY(hash_file(file, &p->hash));
    snprintf(p->input[0], sizeof p->input[0], "%s", path);
    snprintf(p->input[1], sizeof p->input[1], "%s", file);
    if (p->scene.calibrated[0]) {
        char beside[2 * OM_SCENE_PATH];
        OM_TRY(om_path_dir(file, beside, sizeof beside));
        OM_TRY(om_path_join(beside, p->scene.calibrated, p->input[3], sizeof p->input[3]));
    }
    OM_TRY(set_start(path, p));
    OM_TRY(om_path_join(dir, p->file.observations, file, sizeof file));
    if (observations)
        OM_CHECK(snprintf(file, sizeof file, "%s", observations) < (int)sizeof file, OM_INVALID,
                 "%s: path too long", observations);
    OM_TRY(read_sights(file, p));
    snprintf(p->input[2], sizeof p->input[2], "%s", file);
    OM_TRY(om__calibrate_make_body(p, false, &p->twin));
    p->hash =
        om_hash(p->twin.site.mesh.x, 3 * (size_t)p->twin.site.mesh.nvert * sizeof(double), p->hash);
    for (int i = 0; i < p->file.npath; ++i)
        if (p->file.path[i].kind == OM_PATH_PRESS)
            OM_TRY(make_probe(&p->file.path[i].probe, &p->probe[i]));
    OmStatus status = make_tissue(p, &p->twin, NULL, &p->tissue);
    if (status < 0) return om_error_prefix(status, "%s", path);
    return check_effects(path, p);
}

OmStatus om_calibration_problem_load(const char* path, const char* observations,
                                     OmCalibrationProblem** problem) {
    *problem = NULL;
    OmCalibrationProblem* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    OmStatus status = load(path, observations, p);
    if (status < 0) {
        om_calibration_problem_destroy(p);
        return status;
    }
    *problem = p;
    return OM_OK;
}

void om_calibration_problem_destroy(OmCalibrationProblem* p) {
    if (!p) return;
    om_calibration_tissue_destroy(p->tissue);
    for (int i = 0; i < OM_CALIBRATION_MAX_PATH; ++i) om_probe_destroy(p->probe[i]);
    om_site_done(&p->twin.site);
    om_free(p->sights.seen);
    om_free(p);
}

const char* om_calibration_problem_input(const OmCalibrationProblem* p, int index) {
    return index >= 0 && index < 4 && p->input[index][0] ? p->input[index] : NULL;
}

const double* om_calibration_problem_start(const OmCalibrationProblem* p) { return p->start; }

const OmCalibrationSeen* om_calibration_problem_seen(const OmCalibrationProblem* p, int* n) {
    *n = p->sights.nseen;
    return p->sights.seen;
}

int om_calibration_problem_npoint(const OmCalibrationProblem* p) {
    return om__calibrate_ncloud(p->tissue);
}

OmStatus om_calibration_run_points(const OmCalibrationProblem* p, const double* param, int path,
                                   double* x) {
    OmStatus status = om__calibrate_run_cloud(p->tissue, param, path, x);
    if (status != OM_OK) return status;
    OmPose back = om_pose_inverse(p->twin.site.pose_world_task);
    int n = p->sights.nlevel[path] * om_calibration_problem_npoint(p);
    for (int i = 0; i < n; ++i) om_store3(x, i, om_pose_apply(back, om_load3(x, i)));
    return OM_OK;
}

// ---- a finer mesh ---------------------------------------------------------------------------------

static int nattached(const OmSite* site) {
    const OmMeshSet* attached = om_tet_mesh_find_set(&site->mesh, "attachment");
    return attached ? attached->nvert : 0;
}

// The twin's predictions at these parameters, as observations in the world. Clouds have no corresponding points.
static OmStatus predict(const OmCalibrationProblem* p, const double* param,
                        OmCalibrationSeen* seen) {
    const Sights* s = &p->sights;
    for (int i = 0; i < s->nseen; ++i)
        if (s->seen[i].landmark == OM_SEEN_CLOUD) return OM_UNSAT;
    double *x, force[3 * OM_CALIBRATION_MAX_LEVEL];
    OM_ALLOC(x, 3 * (size_t)OM_CALIBRATION_MAX_LEVEL * (size_t)(s->nlandmark + 1));
    OmStatus status = OM_OK;
    for (int path = 0; status == OM_OK && path < p->file.npath; ++path) {
        if (s->nlevel[path] == 0) continue;
        status = om_calibration_path_run(p->tissue, param, path, x, force);
        for (int i = 0; status == OM_OK && i < s->nseen; ++i) {
            OmCalibrationSeen* o = &seen[i];
            if (s->seen[i].path != path) continue;
            *o = s->seen[i];
            o->x = o->landmark == OM_SEEN_FORCE
                       ? om_load3(force, o->level)
                       : om_load3(x, o->level * s->nlandmark + o->landmark);
        }
    }
    om_free(x);
    return status;
}

// Difference between predictions on the twin's mesh and on the mesh of the scene's world with the twin's stiffness:
// an OmCalibrationFinerFn, whose ctx is the calibrated tissue. The finer mesh is made for this one evaluation.
static OmStatus eval_finer(void* ctx, const double* param, int nworker, double* error,
                           double* ratio) {
    const OmCalibrationProblem* p = ((const Body*)om__calibrate_tissue_ctx(ctx))->problem;
    OmCalibrationTissue* tissue = NULL;
    Body* fine = om_calloc(1, sizeof *fine);
    if (!fine) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OmCalibrationSeen* seen = NULL;
    OM_ALLOC_DONE(seen, p->sights.nseen);
    status = predict(p, param, seen);
    if (status != OM_OK) goto done;
    OM_TRY_DONE(om__calibrate_make_body(p, true, fine));
    fine->site.role = OM_SITE_TWIN;  // no hidden factors
    int n = nattached(&fine->site), coarse = nattached(&p->twin.site);
    if (n > 0 && coarse > 0) fine->spring_factor = (double)coarse / n;
    *ratio = cbrt((double)fine->site.mesh.nvert / p->twin.site.mesh.nvert);
    OM_TRY_DONE(make_tissue(p, fine, seen, &tissue));
    status = om_calibration_tissue_eval(tissue, param, nworker, error);
done:
    om_calibration_tissue_destroy(tissue);
    om_free(seen);
    om_site_done(&fine->site);
    om_free(fine);
    return status == OM_INVALID ? OM_UNSAT
                                // the scene has no finer mesh on which the path can be computed
                                : status;
}

OmCalibrationDef om_calibration_problem_search(const OmCalibrationProblem* p) {
    OmCalibrationDef def = om_calibration_tissue_search(p->tissue);
    const OmTissueEngine* engine;
    bool is_known = om_body_find_engine(&p->scene, OM_SITE_TWIN, &engine) == OM_OK;
    if (is_known && engine->has_law) def.eval_finer = eval_finer;
    const SearchItem* s = &p->file.search;
    for (int i = 0; i < p->file.nparam; ++i) {
        const ParamItem* item = &p->file.param[i];
        const SceneKey* key = key_of(p, i);
        om_calibration_add_param(&def, key->name, item->min * key->unit, item->max * key->unit,
                                 p->start[i], item->is_log);
        def.param[i].unit = key->unit;
    }
    def.title = p->file.title;
    def.problem = p->hash;
    def.norm = (OmCalibrationNorm)s->norm;
    def.norm_size = s->norm == OM_NORM_TRIMMED ? s->trim : s->huber;
    def.noise = s->noise;
    def.global = (OmCalibrationGlobal)s->global;
    def.local = (OmCalibrationLocal)s->local;
    def.population = s->population;
    def.max_generations = s->generations;
    def.max_local = s->local_evaluations;
    def.local_range = s->local_range;
    def.tolerance = s->tolerance;
    def.patience = s->patience;
    def.unfit = s->unfit;
    def.rise = s->rise;
    def.seed = (uint64_t)s->seed;
    return def;
}
