// study_sheet.c: clusters of particles calibrated on a lifted sheet: problem, clouds, searches, scores.
//
// The study writes its problem as files that `omentum calibrate` also reads. The depth camera observes the
// scene's world (finite elements on another mesh). Each search gets the clouds of four pinch points; its
// parameters are judged on the fifth. The main search leaves out pinch point 1, the only one without a mirror
// image among the others. A further cloud shows the sheet at rest: the distance between model and cloud there
// comes from the cloud's finite density and noise alone.
#include <math.h>
#include <string.h>

#include "studies/study_cases.h"
#include "studies/study_sheet_internal.h"
#include "studies/study_table.h"

#define COOKIE 0x57d15ee7u
#define MAX_FILE ((size_t)64 << 20)
#define MAX_PATH 1024
#define SECONDS_EVAL 0.14  // processor time of an evaluation with 10 cells, for the estimate

const double om__study_sheet_pinch[OM_STUDY_NPINCH][2] = {
    {0.042, 0}, {0.042, 0.038}, {0.042, -0.038}, {0.010, 0.042}, {0.010, -0.042}};
const char* const om__study_sheet_where[OM_STUDY_NPINCH] = {"middle of the free side", "corner",
                                                            "other corner", "flank", "other flank"};
const double om__study_sheet_lift[OM_STUDY_NLIFT] = {0.010, 0.020, 0.030};

OmStudySheetDef om_study_sheet_default_def(const char* out_dir) {
    return (OmStudySheetDef){.out_dir = out_dir,
                             .cells = 20,
                             .world_cells = 30,
                             .population = 16,
                             .generations = 10,
                             .local_evaluations = 180,
                             .rise = 0.1,
                             .seed = 1,
                             .cookie = COOKIE};
}

static OmStatus validate(const OmStudySheetDef* d) {
    const StudyRange range[] = {{"cells", d->cells, 10, 60},
                                {"world_cells", d->world_cells, 10, 80},
                                {"population", d->population, 5, 1000},
                                {"generations", d->generations, 1, 1000},
                                {"local_evaluations", d->local_evaluations, 1, 10000},
                                {"rise", d->rise, 0, 100},
                                {"seed", (double)d->seed, 0, 2147483647}};
    return STUDY_CHECK("sheet study", d, COOKIE, range);
}

// ---- files ----------------------------------------------------------------------------------------

OmStatus om__study_sheet_path(const Sheet* s, const char* name, char* out, size_t size) {
    return om_path_join(s->def->out_dir, name, out, size);
}

// Write a file of the setup, and free the text; an existing file must have the same contents.
static OmStatus put_file(const Sheet* s, const char* name, StudyLines* lines) {
    char path[MAX_PATH], *there = NULL;
    size_t size;
    OmStatus status = lines->status;
    if (status >= 0) status = om__study_sheet_path(s, name, path, sizeof path);
    if (status < 0 || !om_path_exists(path)) return om__lines_save(lines, s->def->out_dir, name);
    OM_TRY_DONE(om_file_read(path, MAX_FILE, &there, &size));
    OM_CHECK_DONE(size == lines->text.len && memcmp(there, lines->text.str, size) == 0, OM_INVALID,
                  "%s is of a study with other settings; choose another folder or remove this one",
                  path);
done:
    om_free(there);
    om_text_done(&lines->text);
    return status;
}

static OmStatus put_scene(const Sheet* s) {
    StudyLines t = {0};
    om__lines_add(
        &t,
        "# The sheet of thesis 5.4.1: 90 x 90 x 3 mm on a board, fixed on one side, seen by a depth camera.\n"
        "name: calibration sheet\n"
        "tissue:\n"
        "  source: sheet\n"
        "  engine: pbd\n"
        "  size_mm: [90, 90, 3]\n"
        "  cells: [%d, %d, 1]\n"
        "  world_cells: [%d, %d, 1]    # the truth: finite elements\n"
        "  element: quadratic\n"
        "  young: 20000\n"
        "  poisson: 0.45\n",
        s->def->cells, s->def->cells, s->def->world_cells, s->def->world_cells);
    om__lines_add(&t,
                  "  cluster_spacing_mm: %.9g\n"
                  "  cluster_radius_mm: %.9g\n"
                  "  cluster_stiffness: %.9g\n"
                  "attachments: {kind: box, lo_mm: [-46, -46, -1], hi_mm: [-38, 46, 4]}\n"
                  "roi: {random: false, center_mm: [0, 0, 1], radius_mm: 2}\n"
                  "world: {young_factor: 1}\n"
                  "task: {watch_force: false}    # positions have no forces in newtons\n",
                  1e3 * s->thesis[0], 1e3 * s->thesis[1], s->thesis[2]);
    return put_file(s, "sheet.yaml", &t);
}

// The problem of all paths, or of the paths of one search.
static OmStatus put_problem(const Sheet* s, int left_out, const char* name) {
    const OmStudySheetDef* d = s->def;
    StudyLines t = {0};
    om__lines_add(&t,
                  "title: Sheet lifted at %s points\nscene: %ssheet.yaml\n"
                  "observations: %s\nparameters:\n"
                  "  - {name: tissue.cluster_spacing_mm, min: 5, max: 35}\n"
                  "  - {name: tissue.cluster_radius_mm, min: 2.5, max: 15}\n"
                  "  - {name: tissue.cluster_stiffness, min: 0, max: 1}\npaths:\n",
                  left_out < 0 ? "five" : "four", left_out < 0 ? "" : "../",
                  left_out < 0 ? "asked.csv" : "clouds.csv");
    for (int p = 0; p < OM_STUDY_NPINCH; ++p)
        if (p != left_out)
            om__lines_add(
                &t,
                "  - {name: pinch %d, kind: lift, point_mm: [%g, %g, 1.5], direction: [0, 0, 1], "
                "speed_mm_s: 20}\n",
                p + 1, 1e3 * om__study_sheet_pinch[p][0], 1e3 * om__study_sheet_pinch[p][1]);
    if (left_out < 0) om__lines_add(&t, "  - {name: nobody, kind: rest}\n");
    om__lines_add(&t,
                  "search: {noise_mm: 1, population: %d, generations: %d, local_evaluations: %d, "
                  "rise: %.9g, seed: %llu}\n",
                  d->population, d->generations, d->local_evaluations, d->rise,
                  (unsigned long long)d->seed);
    return put_file(s, name, &t);
}

// The levels at which clouds are taken.
static OmStatus put_asked(const Sheet* s) {
    StudyLines t = {0};
    om__lines_add(&t, "experiment,level_mm,landmark,x_mm,y_mm,z_mm\n");
    for (int p = 0; p < OM_STUDY_NPINCH; ++p)
        for (int l = 0; l < OM_STUDY_NLIFT; ++l)
            om__lines_add(&t, "pinch %d,%g,cloud,0,0,0\n", p + 1, 1e3 * om__study_sheet_lift[l]);
    om__lines_add(&t, "nobody,0,cloud,0,0,0\n");
    return put_file(s, "asked.csv", &t);
}

// ---- truth ----------------------------------------------------------------------------------------

// Read the clouds from the folder, or compute them; then build the problem with them.
static OmStatus get_clouds(Sheet* s) {
    char problem[MAX_PATH], clouds[MAX_PATH];
    OM_TRY(om__study_sheet_path(s, "lift.yaml", problem, sizeof problem));
    OM_TRY(om__study_sheet_path(s, "clouds.csv", clouds, sizeof clouds));
    if (!om_path_exists(clouds)) {
        OM_TRY(om_progress_report(s->progress, "truth by finite elements", 0, 1));
        OmCalibrationProblem* asked;
        double begin = om_clock_now();
        OM_TRY(om_calibration_problem_load(problem, NULL, &asked));
        OmStatus status = om_calibration_save_synthetic(asked, om_calibration_problem_start(asked),
                                                        0, s->def->seed, clouds);
        om_calibration_problem_destroy(asked);
        OM_TRY(status);
        s->truth_seconds = om_clock_now() - begin;
        OM_TRY(om_progress_report(s->progress, "truth by finite elements", 1, 1));
    }
    return om_calibration_problem_load(problem, clouds, &s->all);
}

// The rows of the pinch points that a search uses.
static OmStatus put_seen(const Sheet* s, int left_out, const char* name) {
    char unseen[24], path[MAX_PATH], *all;
    size_t size;
    StudyLines t = {0};
    snprintf(unseen, sizeof unseen, "pinch %d,", left_out + 1);
    OM_TRY(om__study_sheet_path(s, "clouds.csv", path, sizeof path));
    OM_TRY(om_file_read(path, MAX_FILE, &all, &size));
    for (const char *at = all, *end = all + size; at < end;) {
        const char* line = memchr(at, '\n', (size_t)(end - at));
        const size_t n = line ? (size_t)(line + 1 - at) : (size_t)(end - at);
        if (strncmp(at, unseen, strlen(unseen)) != 0 && strncmp(at, "nobody,", 7) != 0)
            om__lines_add(&t, "%.*s", (int)n, at);
        at += n;
    }
    om_free(all);
    return put_file(s, name, &t);
}

// The folder of a search: its problem and its clouds.
static OmStatus put_fold(const Sheet* s, int left_out, char* dir, size_t dir_size) {
    char name[64];
    snprintf(name, sizeof name, "without-%d", left_out + 1);
    OM_TRY(om__study_sheet_path(s, name, dir, dir_size));
    OM_TRY(om_path_make_dir(dir));
    snprintf(name, sizeof name, "without-%d/lift.yaml", left_out + 1);
    OM_TRY(put_problem(s, left_out, name));
    snprintf(name, sizeof name, "without-%d/clouds.csv", left_out + 1);
    return put_seen(s, left_out, name);
}

// ---- errors ---------------------------------------------------------------------------------------

double om__study_sheet_pinch_mean(const SheetErrors* e, int pinch) {
    double sum = 0;
    for (int l = 0; l < OM_STUDY_NLIFT; ++l) sum += e->at[pinch][l];
    return sum / OM_STUDY_NLIFT;
}

double om__study_sheet_mean(const SheetErrors* e, int but) {
    double sum = 0;
    for (int p = 0; p < OM_STUDY_NPINCH; ++p)
        if (p != but) sum += om__study_sheet_pinch_mean(e, p);
    return sum / (OM_STUDY_NPINCH - (but >= 0));
}

// Evaluate the model with these parameters along every path.
static OmStatus eval_all(const Sheet* s, const double* param, SheetErrors* e) {
    OmCalibrationDef def = om_calibration_problem_search(s->all);
    int count[SHEET_NPATH][OM_STUDY_NLIFT] = {{0}};
    memset(e, 0, sizeof *e);
    double* error;
    OM_ALLOC(error, def.nerror);
    OmStatus status = def.eval(def.ctx, param, s->def->nworker, error);
    for (int i = 0; status == OM_OK && i < def.nerror; ++i) {
        const OmCalibrationLabel* label = &def.label[i];
        bool is_rest = label->experiment == SHEET_REST;
        int l = is_rest ? 0 : (int)lround(label->level / om__study_sheet_lift[0]) - 1;
        ++count[label->experiment][l];
        *(is_rest ? &e->rest : &e->at[label->experiment][l]) += error[i];
    }
    om_free(error);
    OM_TRY(status);
    OM_CHECK(status == OM_OK, OM_INVALID, "there is no model with %g mm, %g mm, %g", 1e3 * param[0],
             1e3 * param[1], param[2]);
    e->rest /= count[SHEET_REST][0];  // > 0: a cloud without points cannot be loaded
    for (int p = 0; p < OM_STUDY_NPINCH; ++p)
        for (int l = 0; l < OM_STUDY_NLIFT; ++l) e->at[p][l] /= count[p][l];
    return OM_OK;
}

// ---- searches -------------------------------------------------------------------------------------

static OmStatus run_fold(Sheet* s, SheetFold* f) {
    char dir[MAX_PATH], path[MAX_PATH];
    OM_TRY(put_fold(s, f->left_out, dir, sizeof dir));
    OM_TRY(om_path_join(dir, "lift.yaml", path, sizeof path));
    OM_TRY(om_calibration_problem_load(path, NULL, &f->problem));
    f->search = om_calibration_problem_search(f->problem);
    f->search.out_dir = dir;
    f->search.nworker = s->def->nworker;
    double begin = om_clock_now();
    OM_TRY(om_calibration_run(&f->search, s->progress, &f->result));
    f->seconds = om_clock_now() - begin;
    f->search.out_dir = NULL;  // the study writes the folder itself
    return eval_all(s, f->result.best, &f->error);
}

// Of searches that have no report yet.
static OmStatus tell(const Sheet* s) {
    const OmStudySheetDef* d = s->def;
    StudyWork work = {"evaluations", 0, SECONDS_EVAL * pow(d->cells / 10.0, 2), true};
    for (int k = 0; k < (d->has_all_folds ? OM_STUDY_NPINCH : 1); ++k) {
        char name[64];
        snprintf(name, sizeof name, "without-%d/report.html", k + 1);
        if (!om__study_has_file(d->out_dir, name))
            work.n += d->population * (d->generations + 1) + d->local_evaluations;
    }
    return om__study_estimate_tell(&work, 1, d->nworker, s->progress);
}

static OmStatus run(Sheet* s) {
    OM_TRY(tell(s));
    OM_TRY(put_scene(s));
    OM_TRY(put_problem(s, -1, "lift.yaml"));
    OM_TRY(put_asked(s));
    OM_TRY(get_clouds(s));
    double begin = om_clock_now();
    OM_TRY(eval_all(s, s->thesis, &s->thesis_error));
    s->eval_seconds = om_clock_now() - begin;
    int nfold = s->def->has_all_folds ? OM_STUDY_NPINCH : 1;
    for (int k = 0; k < nfold; ++k) {
        s->nfold = k + 1;
        s->fold[k].left_out = k;
        OM_TRY(run_fold(s, &s->fold[k]));
    }
    return OM_OK;
}

static void summarise(const Sheet* s, OmStudySheetSummary* sum) {
    memset(sum, 0, sizeof *sum);
    sum->nfold = s->nfold;
    sum->floor = s->thesis_error.rest;
    sum->thesis = om__study_sheet_mean(&s->thesis_error, -1);
    sum->found = om__study_sheet_mean(&s->fold[0].error, -1);
    memcpy(sum->best, s->fold[0].result.best, sizeof sum->best);
    for (int k = 0; k < s->nfold; ++k) {
        const SheetFold* f = &s->fold[k];
        sum->neval += f->result.neval;
        sum->nnew += f->result.nnew;
        sum->unseen_thesis += om__study_sheet_pinch_mean(&s->thesis_error, f->left_out) / s->nfold;
        sum->unseen_found += om__study_sheet_pinch_mean(&f->error, f->left_out) / s->nfold;
    }
    sum->is_met = sum->found <= SHEET_GOAL && sum->unseen_found <= SHEET_GOAL;
}

OmStatus om_study_sheet_run(const OmStudySheetDef* def, const OmProgress* progress,
                            OmStudySheetSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Sheet* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    s->def = def;
    s->progress = progress;
    const double thesis[OM_STUDY_NCLUSTER] = {0.0127, 0.0095, 0.361};  // errata: no unit in 5.4.1
    memcpy(s->thesis, thesis, sizeof thesis);
    OmFolder folder = {0};
    OmStatus status = om_folder_open(def->out_dir, "sheet study", &folder);
    if (status == OM_OK) status = run(s);
    if (status == OM_OK) {
        summarise(s, summary);
        status = om__study_sheet_write_json(s, summary);
    }
    if (status == OM_OK) status = om__study_sheet_write_report(s, summary);
    for (int k = 0; k < s->nfold; ++k) {
        om_calibration_result_done(&s->fold[k].result);
        om_calibration_problem_destroy(s->fold[k].problem);
    }
    om_calibration_problem_destroy(s->all);
    om_folder_end(&folder);
    om_free(s);
    return status;
}
