// study_calibration.c: cluster parameters of particles: a search on a box of gel, then fine-tuning on a breast.
//
//   DIR/gel, DIR/breast               truth, meshes and finite elements, as in study_contact.c; those of the breast
//                                     may be a contact study's
//   DIR/gel/search-HASH, DIR/breast/search-HASH   journal and report of each search
//   DIR/report.html, study.json, errors.csv
//
// Thesis 3.5.1 and Fig. 3.6: a global search on the gel, then from its result a local one on a single lesion of
// the breast, within 40 % of the range; the other lesions are the test. A model follows the particle that is
// nearest to the lesion's contour point at rest. The distance between them at rest is known and is subtracted:
// an error is a difference of displacements. The thesis compares positions, which adds up to half a cell's
// diagonal that no parameter can remove.
//
// The truth is never computed with particles: it is the contact study's, quadratic tetrahedra with the noise
// of the tracking. The acquisitions of a bead have the same truth and differ in their noise.
#include <math.h>
#include <string.h>

#include "studies/study_cases.h"
#include "studies/study_internal.h"

#define COOKIE 0x57d1ca1bu
#define VERSION 2         // of the model that is compared with the truth
#define NSENSITIVITY 150  // evaluations, for the estimate
#define SECONDS_EVAL 0.7  // processor time of one with a spacing of 8 mm, for the estimate
#define BAR 1.5           // largest error, relative to that of finite elements
#define COUNTS_FROM 1     // index of the first depth that counts: 15 mm
#define GEL_LAST 0.020    // m, deepest indentation of the gel

const char* const om__study_by_name[OM_STUDY_NFIT] = {"particles_gel", "particles_tuned",
                                                      "prescribed", "penalty", "rigid"};
const char* const om__study_by_title[OM_STUDY_NFIT] = {
    "particles, gel's parameters", "particles, fine-tuned", "finite elements, prescribed",
    "finite elements, penalty", "rigid"};

OmStudyCalibrationDef om_study_calibration_default_def(const char* out_dir) {
    OmStudyCalibrationDef def = {.out_dir = out_dir,
                                 .nlesion = 10,
                                 .nacquisition = 5,
                                 .spacing = 0.005,
                                 .speed = 0.05,
                                 .time_step = 0.02,
                                 .settle = 0.06,
                                 .population = 16,
                                 .max_generations = 8,
                                 .max_local = 40,
                                 .has_sensitivity = true,
                                 .truth_ntet = 12000,
                                 .gel_truth_ntet = 12000,
                                 .fe_ntet = 4126,
                                 .contact_ntri = 4000,
                                 .seed = 1,
                                 .cookie = COOKIE};
    return def;
}

static OmStatus validate(const OmStudyCalibrationDef* def) {
    const StudyRange range[] = {{"nlesion", def->nlesion, 2, 20},
                                {"tuned", def->tuned, 0, def->nlesion - 1},
                                {"nacquisition", def->nacquisition, 1, 100},
                                {"spacing", def->spacing, 0.002, 0.02},
                                {"population", def->population, 5, 1e6},
                                {"max_generations", def->max_generations, 1, 1e6},
                                {"max_local", def->max_local, 1, 1e6},
                                {"settle", def->settle, 0, 10}};
    return STUDY_CHECK("calibration study", def, COOKIE, range);
}

// ---- searches -------------------------------------------------------------------------------------

static uint64_t hash_fit(const StudyFit* fit, const StudyPlan* plan) {
    const OmStudyCalibrationDef* d = fit->def;
    const double value[] = {VERSION,
                            d->spacing,
                            d->speed,
                            d->time_step,
                            d->settle,
                            d->population,
                            d->max_local,
                            d->max_generations,
                            d->has_sensitivity,
                            (double)d->seed,
                            plan->first,
                            plan->nseen,
                            fit->contact.probe_noise,
                            fit->contact.pointer_noise};
    uint64_t hash = om_hash(value, sizeof value, OM_HASH_SEED);
    for (int i = 0; i < plan->n; ++i) {
        const StudyTruthResult* t = &fit->study.truth[plan->lesion[i]];
        hash = om_hash(&plan->lesion[i], sizeof plan->lesion[i], hash);
        for (int k = 0; k < t->ndepth; ++k)
            hash = om_hash(&t->at[k].contour, sizeof t->at[k].contour, hash);
    }
    return hash;
}

static void add_params(OmCalibrationDef* search, const double* start) {
    om_calibration_add_param(search, "tissue.cluster_spacing_mm", 0.005, 0.035, start[0], false);
    om_calibration_add_param(search, "tissue.cluster_radius_mm", 0.0025, 0.015, start[1], false);
    om_calibration_add_param(search, "tissue.cluster_stiffness", 0, 1, start[2], false);
    search->param[0].unit = search->param[1].unit = 1e-3;
}

// Search the parameters on the plan's lesions, from `start`; the result of a search that used up
// its budget counts too.
static OmStatus find(StudyFit* fit, const StudyPlan* plan, const double* start, bool is_global,
                     const OmProgress* progress) {
    const OmStudyCalibrationDef* def = fit->def;
    OmCalibrationTissue* tissue;
    char dir[1024], name[32];
    uint64_t problem = hash_fit(fit, plan);
    snprintf(name, sizeof name, "search-%016llx",
             (unsigned long long)om_hash(start, 3 * sizeof *start, problem));
    OM_TRY(om_path_make_dir(fit->dir));
    OM_TRY(om_path_join(fit->dir, name, dir, sizeof dir));
    OM_TRY(om__study_make_tissue(fit, plan, start, &tissue));
    OmCalibrationDef search = om_calibration_tissue_search(tissue);
    add_params(&search, start);
    const OmStudyContactDef* c = &fit->contact;
    search.title = is_global ? "Clusters found on a box of gel" : "Clusters fine-tuned on a lesion";
    search.problem = problem;
    // the mean length of a normal vector is 2 sqrt(2 / (3 pi)) of its standard deviation
    search.noise = 2 * sqrt(2 / (3 * OM_PI)) * hypot(c->probe_noise, c->pointer_noise);
    search.global = is_global ? OM_GLOBAL_EVOLUTION : OM_GLOBAL_NONE;
    search.population = def->population;
    search.max_generations = def->max_generations;
    search.max_local = def->max_local;
    if (is_global || !def->has_sensitivity) search.rise = 0;
    search.seed = def->seed;
    search.nworker = def->nworker;
    search.out_dir = dir;
    OmStatus status = om_calibration_run(&search, progress, &fit->result);
    om_calibration_tissue_destroy(tissue);
    return status > 0 ? OM_OK : status;
}

// ---- errors of the breast's lesions ---------------------------------------------------------------

static void score_others(StudyCalibration* s) {
    static const int method[OM_STUDY_NFIT] = {[OM_FIT_PRESCRIBED] = OM_PRESS_PRESCRIBED,
                                              [OM_FIT_PENALTY] = OM_PRESS_PENALTY,
                                              [OM_FIT_RIGID] = OM_STUDY_NMETHOD};
    for (int by = OM_FIT_PRESCRIBED; by < OM_STUDY_NFIT; ++by)
        for (int l = 0; l < s->def->nlesion; ++l)
            for (int k = 0; k < OM_STUDY_NDEPTH; ++k)
                s->error[by][l][k] = om__study_contour_error(&s->breast.study, method[by], l, k);
}

bool om__study_counts(const StudyCalibration* s, int lesion, int depth) {
    for (int by = 0; by < OM_STUDY_NFIT; ++by)
        if (s->error[by][lesion][depth] < 0) return false;
    return depth >= COUNTS_FROM;
}

static void summarise(StudyCalibration* s) {
    OmStudyCalibrationSummary* sum = &s->sum;
    double total[OM_STUDY_NFIT] = {0};
    for (int i = 0; i < OM_STUDY_NCLUSTER; ++i) {
        sum->gel[i] = s->gel.result.best[i];
        sum->tuned[i] = s->breast.result.best[i];
    }
    sum->gel_start = s->gel.result.cost_start;
    sum->gel_error = s->gel.result.cost;
    sum->tuned_start = s->breast.result.cost_start;
    sum->tuned_error = s->breast.result.cost;
    sum->neval = s->gel.result.neval + s->breast.result.neval;
    sum->nnew = s->gel.result.nnew + s->breast.result.nnew;
    for (int l = 0; l < s->def->nlesion; ++l) {
        for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
            if (l == s->def->tuned || !om__study_counts(s, l, k)) continue;
            for (int by = 0; by < OM_STUDY_NFIT; ++by) total[by] += s->error[by][l][k];
            sum->nunseen++;
        }
    }
    double n = fmax(1, sum->nunseen);
    for (int by = 0; by < OM_STUDY_NFIT; ++by) sum->unseen[by] = total[by] / n;
    sum->is_met = sum->nunseen > 0 &&
                  sum->unseen[OM_FIT_TUNED] <= BAR * sum->unseen[OM_FIT_PRESCRIBED] &&
                  sum->tuned_error < sum->tuned_start;
}

// ---- the study ------------------------------------------------------------------------------------

// Compute truth, finite elements if `has_fe`, and particles of a body.
static OmStatus open_fit(const OmStudyCalibrationDef* def, const char* word, bool has_fe,
                         const OmProgress* progress, StudyFit* fit) {
    const char* dir = has_fe && def->truth_dir ? def->truth_dir : fit->dir;
    fit->def = def;
    fit->contact = om_study_contact_default_def(fit->body, dir);
    OmStudyContactDef* c = &fit->contact;
    c->nresolution = 1;
    c->resolution[0] = def->fe_ntet;
    c->truth_ntet = has_fe ? def->truth_ntet : def->gel_truth_ntet;
    c->contact_ntri = def->contact_ntri;
    c->seed = def->seed;
    c->nworker = def->nworker;
    for (int m = 0; m < OM_STUDY_NMETHOD; ++m)
        c->has_method[m] = has_fe && m != OM_PRESS_MULTIPLIERS;
    if (!has_fe)  // the gel is pressed to 20 mm
        for (int k = 0; k < OM_STUDY_NDEPTH; ++k) c->depth[k] = GEL_LAST / 4 * (k + 1);
    for (int i = 0; i < fit->body->nlesion; ++i)
        snprintf(fit->name[i], sizeof fit->name[i], "%s %d", word, i + 1);
    OM_TRY(om__study_open(c, progress, &fit->study));
    return om__study_make_particles(fit);
}

static void close_fit(StudyFit* fit) {
    om__study_close(&fit->study);
    om_tet_mesh_done(&fit->particles);
    om_calibration_result_done(&fit->result);
    om_study_body_destroy(fit->body);
}

// Of the searches; those of an older report are there. Truths and runs have an estimate of their own.
static OmStatus tell(const OmStudyCalibrationDef* d, const OmProgress* progress) {
    const int n = d->population * (d->max_generations + 1) + 2 * d->max_local +
                  (d->has_sensitivity ? NSENSITIVITY : 0);
    const bool is_there = om__study_has_file(d->out_dir, "study.json");
    const StudyWork work = {"evaluations of two searches", is_there ? 0 : n,
                            SECONDS_EVAL * pow(0.008 / d->spacing, 3), true};
    return om__study_estimate_tell(&work, 1, d->nworker, progress);
}

static OmStatus do_gel(StudyCalibration* s, const double* start, const OmProgress* progress) {
    static const int bead[] = {0, 1, 2};
    StudyPlan plan = {3, 0, s->def->nacquisition, bead};
    for (int i = 0; i < 3; ++i)
        OM_CHECK(om__study_plan_depths(&s->gel, &plan, i) > 0, OM_INVALID,
                 "calibration study: bead %d has no truth; ask for a finer one (truth_ntet = %d)",
                 i + 1, s->def->truth_ntet);
    return find(&s->gel, &plan, start, true, progress);
}

static OmStatus do_breast(StudyCalibration* s, const OmProgress* progress) {
    StudyPlan plan = {1, COUNTS_FROM, 1, &s->def->tuned};
    OM_CHECK(om__study_plan_depths(&s->breast, &plan, 0) > 0, OM_INVALID,
             "calibration study: lesion %d has no truth at 15 mm; tune on another", s->def->tuned);
    return find(&s->breast, &plan, s->gel.result.best, false, progress);
}

OmStatus om_study_calibration_run(const OmStudyCalibrationDef* def, const OmProgress* progress,
                                  OmStudyCalibrationSummary* summary) {
    static const double start[OM_STUDY_NCLUSTER] = {0.0096001, 0.0091674, 0.4524};  // Table 3.2
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    StudyCalibration* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OmStatus status;
    OmFolder folder = {0};
    s->def = def;
    for (int by = 0; by < OM_STUDY_NFIT; ++by)
        for (int l = 0; l < OM_STUDY_MAX_LESION; ++l)
            for (int k = 0; k < OM_STUDY_NDEPTH; ++k) s->error[by][l][k] = -1;
    OM_TRY_DONE(om_path_join(def->out_dir, "gel", s->gel.dir, sizeof s->gel.dir));
    OM_TRY_DONE(om_path_join(def->out_dir, "breast", s->breast.dir, sizeof s->breast.dir));
    OM_TRY_DONE(om_folder_open(def->out_dir, "calibration study", &folder));
    OM_TRY_DONE(om_study_body_create_gel(&s->gel.body));
    OM_TRY_DONE(om_study_body_create_phantom(def->nlesion, 1, &s->breast.body));
    OM_TRY_DONE(tell(def, progress));
    OM_TRY_DONE(open_fit(def, "bead", false, progress, &s->gel));
    double begin = om_clock_now();
    OM_TRY_DONE(do_gel(s, start, progress));
    s->sum.seconds = om_clock_now() - begin;
    OM_TRY_DONE(open_fit(def, "lesion", true, progress, &s->breast));
    begin = om_clock_now();
    OM_TRY_DONE(do_breast(s, progress));
    s->sum.seconds += om_clock_now() - begin;
    OM_TRY_DONE(om__study_score_particles(&s->breast, 0, def->nlesion, s->gel.result.best,
                                          s->error[OM_FIT_GEL]));
    OM_TRY_DONE(om__study_score_particles(&s->breast, 0, def->nlesion, s->breast.result.best,
                                          s->error[OM_FIT_TUNED]));
    score_others(s);
    summarise(s);
    OM_TRY_DONE(om__study_report_calibration(s));
    *summary = s->sum;
done:
    close_fit(&s->gel);
    close_fit(&s->breast);
    om_folder_end(&folder);
    om_free(s);
    return status;
}
