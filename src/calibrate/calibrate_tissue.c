// calibrate_tissue.c: errors of a tissue model against landmarks, clouds and forces.
//
// Landmarks and the points compared with clouds are points of the rest shape. Each model embeds them, so
// that parameters may change its mesh while the number of errors stays. Errors of a cloud are distances from
// the model's points to the nearest point of the cloud, in this direction, as in (5.2): a camera sees one
// side only, and unseen points must not count.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_tissue_internal.h"
#include "omentum/pbd.h"
#include "omentum/shape_points.h"
#include "omentum/tissue_engine.h"

#define COOKIE 0x43544953u

struct OmCalibrationTissue {
    OmCalibrationTissueDef def;
    OmCalibrationPath* path;  // (npath), with copies of the levels
    double* level;            // of all paths
    int* level_adr;           // path p has levels level_adr[p] ..             (npath + 1)
    OmCalibrationSeen* seen;  // landmarks and forces
    int nseen;                //
    OmPointTree** cloud;      // of each level, null where there is none
    double* point;   // positions at rest of landmarks, then cloud points            (npoint x 3)
    int npoint;      //
    int* cloud_adr;  // first error of each level's cloud, -1 if none
    int nerror;      //
    OmCalibrationLabel* label;   // (nerror)
    const char** path_name;      // (npath)
    const char** landmark_name;  // (nlandmark + 2)
};

OmCalibrationTissueDef om_calibration_tissue_default_def(OmCalibrationBuildFn build, void* ctx) {
    OmCalibrationTissueDef def = {
        .build = build, .ctx = ctx, .force_scale = 0.01, .cookie = COOKIE};
    return def;
}

// ---- validation -----------------------------------------------------------------------------------

static OmStatus check_seen(const OmCalibrationTissueDef* def, int i) {
    const OmCalibrationSeen* o = &def->observation[i];
    OM_CHECK(o->path >= 0 && o->path < def->npath, OM_INVALID,
             "observation[%d].path is %d: there are %d", i, o->path, def->npath);
    const OmCalibrationPath* p = &def->path[o->path];
    OM_CHECK(o->level >= 0 && o->level < p->nlevel, OM_INVALID,
             "observation[%d].level is %d: path %s has %d", i, o->level, p->name, p->nlevel);
    OM_CHECK(o->landmark >= OM_SEEN_FORCE && o->landmark < def->nlandmark, OM_INVALID,
             "observation[%d].landmark is %d: there are %d", i, o->landmark, def->nlandmark);
    OM_CHECK(om_is_finite3(o->x), OM_INVALID, "observation[%d].x is not finite", i);
    return OM_OK;
}

static OmStatus check(const OmCalibrationTissueDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "the definition was not made by om_calibration_tissue_default_def");
    OM_CHECK(def->build, OM_INVALID, "build is null");
    OM_CHECK(def->npath >= 1 && def->path, OM_INVALID, "there is no path");
    for (int i = 0; i < def->npath; ++i) OM_TRY(om__calibrate_check_path(&def->path[i], i));
    OM_CHECK(def->nlandmark >= 0 && (def->nlandmark == 0 || def->rest), OM_INVALID,
             "rest positions of %d landmarks are missing", def->nlandmark);
    for (int i = 0; i < def->nlandmark; ++i)
        OM_CHECK(om_is_finite3(om_load3(def->rest, i)), OM_INVALID,
                 "rest of landmark %d: not finite", i);
    OM_CHECK(def->nobservation >= 1 && def->observation, OM_INVALID, "there is no observation");
    for (int i = 0; i < def->nobservation; ++i) OM_TRY(check_seen(def, i));
    OM_CHECK(def->force_scale > 0 && isfinite(def->force_scale), OM_INVALID,
             "force_scale is %g: above 0", def->force_scale);
    return OM_OK;
}

// ---- creation -------------------------------------------------------------------------------------

static OmStatus copy_paths(const OmCalibrationTissueDef* def, OmCalibrationTissue* t) {
    int n = 0;
    for (int p = 0; p < def->npath; ++p) n += def->path[p].nlevel;
    OM_ALLOC(t->path, def->npath);
    OM_ALLOC(t->level, n);
    OM_ALLOC(t->level_adr, def->npath + 1);
    OM_ALLOC(t->path_name, def->npath);
    for (int p = 0, adr = 0; p < def->npath; ++p) {
        t->path[p] = def->path[p];
        t->path_name[p] = def->path[p].name;
        t->path[p].level = t->level + adr;
        memcpy(t->level + adr, def->path[p].level, (size_t)def->path[p].nlevel * sizeof(double));
        t->level_adr[p] = adr;
        t->level_adr[p + 1] = adr += def->path[p].nlevel;
    }
    return OM_OK;
}

static OmStatus copy_seen(const OmCalibrationTissueDef* def, OmCalibrationTissue* t) {
    OM_ALLOC(t->seen, def->nobservation);
    for (int i = 0; i < def->nobservation; ++i)
        if (def->observation[i].landmark != OM_SEEN_CLOUD)
            t->seen[t->nseen++] = def->observation[i];
    return OM_OK;
}

static OmStatus make_clouds(const OmCalibrationTissueDef* def, OmCalibrationTissue* t) {
    int nlevel = t->level_adr[def->npath];
    t->cloud = om_calloc((size_t)nlevel, sizeof *t->cloud);
    double* x = om_alloc(3 * (size_t)def->nobservation, sizeof *x);
    OmStatus status = t->cloud && x ? OM_OK : OM_NO_MEMORY;
    for (int l = 0; l < nlevel && status == OM_OK; ++l) {
        int n = 0;
        for (int i = 0; i < def->nobservation; ++i) {
            const OmCalibrationSeen* o = &def->observation[i];
            if (o->landmark == OM_SEEN_CLOUD && t->level_adr[o->path] + o->level == l)
                om_store3(x, n++, o->x);
        }
        if (n > 0) status = om_point_tree_create(n, x, &t->cloud[l]);
    }
    om_free(x);
    return status;
}

static bool has_cloud(const OmCalibrationTissueDef* def) {
    for (int i = 0; i < def->nobservation; ++i)
        if (def->observation[i].landmark == OM_SEEN_CLOUD) return true;
    return false;
}

// Collect the points to follow: landmarks, then those compared with clouds.
static OmStatus gather_points(const OmCalibrationTissueDef* def, const OmTissueModel* model,
                              OmCalibrationTissue* t) {
    int ncloud = 0;
    const int* vert = NULL;
    const double* x = def->cloud_point;
    if (has_cloud(def)) {
        ncloud = def->ncloud_point;
        if (!ncloud) vert = om_tissue_surface_vert(model, &ncloud);
        if (!ncloud || (!vert && !x))
            return om_error(OM_INVALID, "no points to compare with clouds");
    }
    t->def.ncloud_point = ncloud;
    t->npoint = def->nlandmark + ncloud;
    OM_ALLOC(t->point, 3 * (size_t)(t->npoint + 1));  // may be empty: only forces were observed
    if (def->nlandmark) memcpy(t->point, def->rest, 3 * (size_t)def->nlandmark * sizeof *t->point);
    for (int i = 0; i < ncloud; ++i)
        om_store3(t->point, def->nlandmark + i,
                  vert ? om_load3(om_tissue_mesh(model)->x, vert[i]) : om_load3(x, i));
    return OM_OK;
}

static OmStatus make_labels(const OmCalibrationTissueDef* def, OmCalibrationTissue* t) {
    int nlevel = t->level_adr[def->npath], n = t->nseen;
    OM_ALLOC(t->cloud_adr, nlevel);
    for (int l = 0; l < nlevel; ++l) {
        t->cloud_adr[l] = t->cloud[l] ? n : -1;
        if (t->cloud[l]) n += t->def.ncloud_point;
    }
    t->nerror = n;
    OM_ALLOC(t->label, n);
    for (int i = 0; i < t->nseen; ++i) {
        const OmCalibrationSeen* o = &t->seen[i];
        int landmark = o->landmark == OM_SEEN_FORCE ? def->nlandmark + 1 : o->landmark;
        t->label[i] = (OmCalibrationLabel){o->path, landmark, t->path[o->path].level[o->level]};
    }
    for (int p = 0; p < def->npath; ++p)
        for (int l = t->level_adr[p]; l < t->level_adr[p + 1]; ++l)
            for (int i = 0; t->cloud[l] && i < t->def.ncloud_point; ++i)
                t->label[t->cloud_adr[l] + i] =
                    (OmCalibrationLabel){p, def->nlandmark, t->level[l]};
    OM_ALLOC(t->landmark_name, def->nlandmark + 2);
    for (int i = 0; i < def->nlandmark; ++i)
        t->landmark_name[i] = def->landmark ? def->landmark[i] : "landmark";
    t->landmark_name[def->nlandmark] = "cloud";
    t->landmark_name[def->nlandmark + 1] = "force";
    return OM_OK;
}

static OmStatus check_forces(const OmCalibrationTissue* t, const OmTissueModel* model) {
    const OmTissueEngine* engine = om_tissue_engine(model);
    bool has_forces = om_engine_capabilities(engine) & OM_ENGINE_FORCES;
    for (int i = 0; i < t->nseen; ++i)
        OM_CHECK(t->seen[i].landmark != OM_SEEN_FORCE || has_forces, OM_INVALID,
                 "path %s has an observed force, but engine \"%s\" has no forces in newtons",
                 t->path[t->seen[i].path].name, engine->name);
    return OM_OK;
}

static OmStatus make(const OmCalibrationTissueDef* def, const double* start,
                     OmCalibrationTissue* t) {
    t->def = *def;
    OM_TRY(copy_paths(def, t));
    OM_TRY(copy_seen(def, t));
    OM_TRY(make_clouds(def, t));
    OmTissueModel* model = NULL;
    OmStatus status = def->build(def->ctx, start, 1, &model);
    if (status > 0) {
        char why[256];
        snprintf(why, sizeof why, "%s", om_error_message());
        status = om_error(OM_INVALID, "no model can be built with the start values: %s", why);
    }
    if (status == OM_OK) status = check_forces(t, model);
    if (status == OM_OK) status = gather_points(def, model, t);
    om_tissue_destroy(model);
    return status == OM_OK ? make_labels(def, t) : status;
}

OmStatus om_calibration_tissue_create(const OmCalibrationTissueDef* def, const double* start,
                                      OmCalibrationTissue** tissue) {
    *tissue = NULL;
    OM_TRY(check(def));
    OmCalibrationTissue* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    OmStatus status = make(def, start, t);
    if (status != OM_OK) {
        om_calibration_tissue_destroy(t);
        return status;
    }
    *tissue = t;
    return OM_OK;
}

void om_calibration_tissue_destroy(OmCalibrationTissue* t) {
    if (!t) return;
    for (int l = 0; t->cloud && l < t->level_adr[t->def.npath]; ++l)
        om_point_tree_destroy(t->cloud[l]);
    om_free(t->path);
    om_free(t->level);
    om_free(t->level_adr);
    om_free(t->seen);
    om_free(t->cloud);
    om_free(t->point);
    om_free(t->cloud_adr);
    om_free(t->label);
    om_free(t->path_name);
    om_free(t->landmark_name);
    om_free(t);
}

// ---- evaluating -----------------------------------------------------------------------------------

typedef struct Look {  // evaluation of one path of one model
    const OmCalibrationTissue* t;
    const OmEmbedding* embedding;
    int path;
    double* x;      // of the points           (npoint x 3)
    double* error;  // or null
    double* out_x;  // or null
    double* out_force;
    double* out_cloud;  // of the points compared with clouds, or null
} Look;

static OmStatus look_at_level(void* ctx, int level, const double* vert_x, OmVec3 force) {
    Look* k = ctx;
    const OmCalibrationTissue* t = k->t;
    int nlandmark = t->def.nlandmark, l = t->level_adr[k->path] + level;
    if (t->npoint) om_embedding_eval(k->embedding, vert_x, k->x);
    if (k->out_x)
        memcpy(k->out_x + 3 * level * nlandmark, k->x, 3 * (size_t)nlandmark * sizeof(double));
    if (k->out_force) om_store3(k->out_force, level, force);
    size_t ncloud = 3 * (size_t)t->def.ncloud_point;
    if (k->out_cloud)
        memcpy(k->out_cloud + (size_t)level * ncloud, k->x + 3 * nlandmark,
               ncloud * sizeof(double));
    if (!k->error) return OM_OK;
    for (int i = 0; i < t->nseen; ++i) {
        const OmCalibrationSeen* o = &t->seen[i];
        if (o->path != k->path || o->level != level) continue;
        k->error[i] = o->landmark == OM_SEEN_FORCE ? t->def.force_scale * om_distance(force, o->x)
                                                   : om_distance(om_load3(k->x, o->landmark), o->x);
    }
    for (int i = 0; t->cloud[l] && i < t->def.ncloud_point; ++i) {
        OmVec3 p = om_load3(k->x, nlandmark + i);
        if (!om_is_finite3(p)) return OM_UNSAT;
        om_point_tree_find(t->cloud[l], p, &k->error[t->cloud_adr[l] + i]);
    }
    return OM_OK;
}

typedef struct Evaluation {
    const OmCalibrationTissue* t;
    const OmTissueModel* model;
    OmEmbedding embedding;
    double* x;      // (npath x npoint x 3)
    double* error;  //
    OmStatus* status;
    char (*message)[256];  // (npath)
} Evaluation;

static void run_paths(void* ctx, int begin, int end, int block) {
    (void)block;
    Evaluation* e = ctx;
    for (int p = begin; p < end; ++p) {
        Look look = {.t = e->t,
                     .embedding = &e->embedding,
                     .path = p,
                     .error = e->error,
                     .x = e->x + 3 * (size_t)p * (size_t)e->t->npoint};
        e->status[p] =
            om__calibrate_walk(e->model, &e->t->path[p], e->t->def.contact, look_at_level, &look);
        if (e->status[p] < 0) snprintf(e->message[p], 256, "%s", om_error_message());
    }
}

static OmStatus evaluate(Evaluation* e, int nworker) {
    const OmCalibrationTissue* t = e->t;
    int npath = t->def.npath;
    if (t->npoint) OM_TRY(om_tissue_embed(e->model, t->npoint, t->point, &e->embedding));
    OM_ALLOC(e->x, 3 * (size_t)npath * (size_t)(t->npoint + 1));
    OM_ALLOC(e->status, npath);
    OM_ALLOC(e->message, npath);
    om_parallel_for(nworker, npath, 1, run_paths, e);
    OmStatus worst = OM_OK;
    for (int p = 0; p < npath; ++p) {
        if (e->status[p] < 0) return om_error(e->status[p], "%s", e->message[p]);
        if (e->status[p] > 0) worst = e->status[p];
    }
    return worst;
}

OmStatus om_calibration_tissue_eval(void* tissue, const double* param, int nworker, double* error) {
    const OmCalibrationTissue* t = tissue;
    Evaluation e = {.t = t, .error = error};
    OmTissueModel* model = NULL;
    OmStatus status = t->def.build(t->def.ctx, param, t->def.npath > 1 ? 1 : nworker, &model);
    e.model = model;
    if (status == OM_OK) status = evaluate(&e, nworker);
    if (e.embedding.npoint) om_embedding_done(&e.embedding);
    om_free(e.x);
    om_free(e.status);
    om_free(e.message);
    om_tissue_destroy(model);
    return status;
}

void* om__calibrate_tissue_ctx(const OmCalibrationTissue* t) { return t->def.ctx; }

OmCalibrationDef om_calibration_tissue_search(const OmCalibrationTissue* t) {
    OmCalibrationDef def =
        om_calibration_default_def(om_calibration_tissue_eval, (void*)t, t->nerror);
    def.label = t->label;
    def.nexperiment = t->def.npath;
    def.experiment = t->path_name;
    def.nlandmark = t->def.nlandmark + 2;
    def.landmark = t->landmark_name;
    return def;
}

// `look` contains the path and the outputs.
static OmStatus run_path(const double* param, Look look) {
    const OmCalibrationTissue* t = look.t;
    OM_CHECK(look.path >= 0 && look.path < t->def.npath, OM_INVALID, "path %d: there are %d",
             look.path, t->def.npath);
    OmTissueModel* model = NULL;
    OmEmbedding embedding = {0};
    look.embedding = &embedding;
    look.x = om_alloc(3 * (size_t)(t->npoint + 1), sizeof *look.x);
    OmStatus status = look.x ? t->def.build(t->def.ctx, param, 1, &model) : OM_NO_MEMORY;
    if (status == OM_OK && t->npoint)
        status = om_tissue_embed(model, t->npoint, t->point, &embedding);
    if (status == OM_OK)
        status =
            om__calibrate_walk(model, &t->path[look.path], t->def.contact, look_at_level, &look);
    if (embedding.npoint) om_embedding_done(&embedding);
    om_free(look.x);
    om_tissue_destroy(model);
    return status;
}

OmStatus om_calibration_path_run(const OmCalibrationTissue* t, const double* param, int path,
                                 double* x, double* force) {
    return run_path(param, (Look){.t = t, .path = path, .out_x = x, .out_force = force});
}

OmStatus om__calibrate_run_cloud(const OmCalibrationTissue* t, const double* param, int path,
                                 double* x) {
    return run_path(param, (Look){.t = t, .path = path, .out_cloud = x});
}

int om__calibrate_ncloud(const OmCalibrationTissue* t) { return t->def.ncloud_point; }
