// study_retraction_run.c: runs and searches of the retraction study, and their files.
//
// A run is a folder runs/CASE-ROW with its own report, and a file CASE-ROW.bin with its figures and a hash of the case
// and the row. A run whose file has the hash of the present case is not made again. Runs are independent of each
// other: as many as there are workers are made at once, of one thread each, and each writes its figures when it ends.
// The caller's thread only waits and reports, so that a cancellation reaches all of them within an action.
//
// The search for the ceiling moves three times as fast as the arms, as the calibration of 6.5.1 does.
#include <math.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>

#include "omentum/base_job.h"
#include "studies/study_cases.h"
#include "studies/study_match_case.h"
#include "studies/study_retraction_internal.h"

#define MAX_PATH 1024
#define FRAME_EVERY 4
#define NABLATED 40  // pairs of the ablations
#define SEARCH_SPEED_UP 3.0
// Change them if runs, runs of FRAS, or searches are made in another way.
#define METHOD 27
#define METHOD_FRAS 10
#define METHOD_SEARCH 7
#define GOOD_MU 0.002  // m
#define CEILING OM_RETRACTION_NROW
#define PREPLAN (OM_RETRACTION_NROW + 1)
#define CEILING_BOTH (OM_RETRACTION_NROW + 2)  // a search with both arms
#define FIRST_GRASPS 5
#define MAX_WORKER 64
// Processor times for the estimate, s; a coarse sheet takes 0.15 of them.
#define SECONDS_PREPLAN 40  // 256 shells: 16,000 steps
#define SECONDS_OPEN 8
#define SECONDS_DEFRAS 60
#define SECONDS_FRAS 8
#define SECONDS_SEARCH 120

const char* const om__retraction_row_name[OM_RETRACTION_NROW] = {
    "defras",   "fras",     "fras-true",  "no-preplan", "no-monitor", "no-learning",
    "no-ahead", "no-check", "no-network", "one-arm",    "open-loop"};
const char* const om__retraction_row_title[OM_RETRACTION_NROW] = {"DEFRAS",
                                                                  "FRAS, believed attachments",
                                                                  "FRAS, true attachments",
                                                                  "no plan before",
                                                                  "no monitoring",
                                                                  "no learning",
                                                                  "no look-ahead",
                                                                  "no physics check",
                                                                  "no network",
                                                                  "one arm",
                                                                  "the plan before, open loop"};

// A run, or with row CEILING or CEILING_BOTH a search, with row PREPLAN a plan before.
typedef struct Task {
    RetractionResult* result;
    int row;
    RetractionCeiling found;  // by a search
    OmScene scene;
    uint64_t hash;
    char name[80];
    bool is_done;
} Task;

typedef struct Crew {
    const Retraction* s;
    const char* stage;  // for the progress
    Task* task;
    int ntask;
    atomic_int next, ndone;   // tasks begun and finished
    atomic_int status;        // the first failure
    char message[512];        // of the failure
    atomic_flag is_reported;  // a worker has written the message
    atomic_int nworking;      // jobs that have not returned
} Crew;

static bool is_search(int row) { return row == CEILING || row == CEILING_BOTH; }

// ---- what a row changes --------------------------------------------------------------------------------------

static bool has_preplan(int row) {
    return !is_search(row) && row != OM_RETRACTION_FRAS && row != OM_RETRACTION_FRAS_TRUE &&
           row != OM_RETRACTION_NO_PREPLAN;
}

// The plan before is of the belief: both cases of a scenario have the same. A plan of another method is not used.
static void preplan_name(const RetractionCase* c, char* name, size_t size) {
    if (c->group == RETRACTION_SCENARIO)
        snprintf(name, size, "preplan-%d-scenario-%d.json", METHOD, c->number);
    else
        snprintf(name, size, "preplan-%d-%s.json", METHOD, c->name);
}

static void set_row(OmRetractionRow row, OmScene* scene) {
    if (row == OM_RETRACTION_FRAS || row == OM_RETRACTION_FRAS_TRUE) return;
    scene->monitor.is_enabled = row != OM_RETRACTION_NO_MONITOR;
    scene->update.is_enabled = row != OM_RETRACTION_NO_LEARNING;
    if (row != OM_RETRACTION_NO_NETWORK)
        snprintf(scene->update.network, sizeof scene->update.network, "installed");
    scene->update.is_checked = row != OM_RETRACTION_NO_CHECK;
    scene->task.ahead = row == OM_RETRACTION_NO_AHEAD ? 0 : 3;
    if (row == OM_RETRACTION_ONE_ARM) scene->world.narm = 1;
}

// Hash of what the protocol says about a task. Settings of the program that the protocol does not name belong to
// METHOD: a key that a later version adds to scenes does not make every run again.
static uint64_t hash_task(const Task* t) {
    const RetractionCase* c = &t->result->c;
    const OmScene* s = &t->scene;
    const bool is_fras = t->row == OM_RETRACTION_FRAS || t->row == OM_RETRACTION_FRAS_TRUE;
    const double value[] = {is_search(t->row) ? METHOD_SEARCH
                            : is_fras         ? METHOD_FRAS
                                              : METHOD,
                            t->row,
                            c->group,
                            c->kind,
                            c->seed,
                            c->believed_seed,
                            c->share,
                            c->believed,
                            c->ratio,
                            c->roi.x,
                            c->roi.y,
                            s->tissue.cells.x,
                            s->tissue.world_cells.x,
                            om_scene_element(s, OM_SITE_TWIN),
                            s->world.element,
                            s->tissue.friction,
                            s->tissue.young,
                            s->tissue.poisson,
                            s->world.young_factor,
                            s->world.poisson,
                            s->world.friction,
                            s->world.tool_noise,
                            s->task.grid,
                            s->task.force_threshold,
                            is_search(t->row) ? 0 : s->task.force_margin,
                            s->task.speed};
    return om_hash(value, sizeof value, OM_HASH_SEED);
}

static OmStatus open_task(RetractionResult* r, int row, Task* t) {
    *t = (Task){.result = r, .row = row};
    bool knows_truth = row == OM_RETRACTION_FRAS_TRUE || is_search(row);
    OM_TRY(om__retraction_scene(&r->c, knows_truth ? RETRACTION_TRUE : RETRACTION_BELIEVED,
                                &t->scene));
    if (is_search(row))
        t->scene.task.speed *= SEARCH_SPEED_UP;
    else
        set_row((OmRetractionRow)row, &t->scene);
    snprintf(t->name, sizeof t->name, "%s-%s", r->c.name,
             row == CEILING        ? "search"
             : row == CEILING_BOTH ? "search-both"
                                   : om__retraction_row_name[row]);
    t->hash = hash_task(t);
    return OM_OK;
}

// ---- one run ---------------------------------------------------------------------------------------------------

static void keep(const OmScene* scene, const OmRetractResult* r, RetractionRun* run) {
    memset(run, 0, sizeof *run);  // its bytes go to a file
    run->outcome = r->outcome;
    run->is_exposed = r->is_exposed;
    snprintf(run->reason, sizeof run->reason, "%s", r->reason);
    run->visibility_start = r->visibility_start;
    run->visibility = r->truth.visibility;
    run->visibility_seen = r->visibility_end;
    run->force = r->twin.force;
    run->force_world = r->truth.force;
    run->epsilon = scene->task.force_threshold;
    run->nforce = r->twin.nforce;
    run->nforce_world = r->truth.nforce;
    run->naction = r->naction;
    run->nplan = r->nplan;
    run->nacquisition = r->belief.nacquisition;
    run->nupdate = r->belief.nupdate;
    for (int i = 0; i < r->belief.nupdate; ++i) {
        const OmRetractUpdate* u = &r->belief.update[i];
        const bool is_adopted = u->stage == OM_UPDATE_ADOPTED;
        run->nadopted += is_adopted;
        // Every estimate that the monitor triggers counts, a refused one as a failure; not one that the end of the
        // run cancelled, and not one whose tissue was let go before its effect could be measured.
        const bool is_measured = !is_adopted || !isnan(u->mu_after);
        run->ntrigger +=
            scene->monitor.is_enabled && u->stage != OM_UPDATE_CANCELLED && is_measured;
        run->ngood += scene->monitor.is_enabled && is_adopted && u->mu_after <= GOOD_MU;
    }
    for (int k = 0; k < 3; ++k) run->nwarning[k] = r->belief.nwarning[k];
    run->mu_max = r->belief.mu_max;
    run->hold = r->hold;
    run->time = r->time;
    run->wall_time = r->wall_time;
    run->twin_step_ms = r->twin.step_ms;
    run->plan_ms = r->plan_ms_median;
    for (int i = 0; i < r->naction && run->ngrasp < RETRACTION_MAX_GRASP; ++i)
        if (r->action[i].verb == OM_PLAN_GRASP) run->grasp[run->ngrasp++] = r->action[i].block;
    run->is_success = run->visibility >= scene->task.visibility && run->is_exposed &&
                      run->force_world <= RETRACTION_MAX_FORCE * run->epsilon;
}

// Plan before for the twin of a task, into the study's folder.
static OmStatus make_preplan(const Retraction* s, Task* t, const OmProgress* alive) {
    char name[96], path[MAX_PATH];
    OmPreplanDef def = om_preplan_default_def(&t->scene);
    OmPreplan* plan;
    def.nworker = 1;
    preplan_name(&t->result->c, name, sizeof name);
    OM_TRY(om_path_join(s->def->out_dir, name, path, sizeof path));
    OM_ALLOC(plan, 1);
    OmStatus status = om_preplan_run(&def, alive, plan);
    if (status == OM_OK) status = om_preplan_save(plan, path);
    om_free(plan);
    return status;
}

OmStatus om__retraction_load_preplan(const Retraction* s, const RetractionCase* c,
                                     OmPreplan* plan) {
    char name[96], path[MAX_PATH];
    preplan_name(c, name, sizeof name);
    OM_TRY(om_path_join(s->def->out_dir, name, path, sizeof path));
    return om_preplan_load(path, plan);
}

static OmStatus make_run(const Retraction* s, Task* t, const OmProgress* alive) {
    char name[96], path[MAX_PATH];
    OmRetractResult result;
    OmPreplan* plan = NULL;
    OmRetractDef def = om_retract_default_def(&t->scene);
    snprintf(name, sizeof name, "runs/%s", t->name);
    OM_TRY(om_path_join(s->def->out_dir, name, path, sizeof path));
    def.out_dir = path;
    def.frame_every = FRAME_EVERY;
    def.has_recording = false;  // several threads make runs
    def.nworker = 1;
    OmStatus status = OM_OK;
    if (has_preplan(t->row)) {
        OM_ALLOC_DONE(plan, 1);
        OM_TRY_DONE(om__retraction_load_preplan(s, &t->result->c, plan));
        def.preplan = plan;
    }
    OM_TRY_DONE(om_retract_run(&def, alive, &result));
    keep(&t->scene, &result, &t->result->run[t->row]);
    om_retract_result_done(&result);
done:
    om_free(plan);
    return status;
}

// Without looking: no arms, no pictures, no twin during the operation.
static OmStatus make_open_loop(const Retraction* s, Task* t, const OmProgress* alive) {
    RetractionRun* run = &t->result->run[t->row];
    const OmSceneTask* task = &t->scene.task;
    OmPreplan* plan;
    OmOpenLoop r;
    OM_ALLOC(plan, 1);
    memset(run, 0, sizeof *run);  // its bytes go to a file
    run->epsilon = task->force_threshold;
    run->outcome = OM_RETRACT_NO_PLAN;
    OmStatus status = om__retraction_load_preplan(s, &t->result->c, plan);
    const bool has_plan = status == OM_OK && plan->chosen >= 0;
    if (status == OM_OK) snprintf(run->reason, sizeof run->reason, "%s", plan->reason);
    if (has_plan) status = om_retract_open_loop(&t->scene, plan, 1, alive, &r);
    om_free(plan);
    if (status < 0 || !has_plan) return status;
    run->is_exposed = r.is_exposed;
    run->outcome = r.is_exposed ? OM_RETRACT_EXPOSED : OM_RETRACT_GAVE_UP;
    run->visibility = run->visibility_seen = r.visibility;
    run->force = run->force_world = r.force;
    run->naction = r.naction;
    snprintf(run->reason, sizeof run->reason,
             "carried out without looking, the plan shows %.0f %% of the ROI, with %.2f N",
             100 * r.visibility, r.force);
    run->is_success = r.is_exposed && r.force <= RETRACTION_MAX_FORCE * run->epsilon;
    return OM_OK;
}

static OmStatus make_ceiling(Task* t, const OmProgress* alive) {
    RetractionCeiling* c = &t->found;
    const OmSceneTask* task = &t->scene.task;
    const double limit = RETRACTION_MAX_FORCE * task->force_threshold;
    if (t->row == CEILING)
        OM_TRY(om_retract_search_fewest(&t->scene, limit, 1, alive, &c->best));
    else
        OM_TRY(om_retract_search_both(&t->scene, limit, FIRST_GRASPS, 1, alive, &c->best));
    c->is_possible = c->best.nexposed > 0;
    return OM_OK;
}

// ---- files -------------------------------------------------------------------------------------------------------

// The file of a run or a search, and what it holds.
static StudyPart part_of(Task* t, char name[96]) {
    snprintf(name, 96, "%s.bin", t->name);
    RetractionRun* run = &t->result->run[is_search(t->row) ? 0 : t->row];
    return is_search(t->row) ? (StudyPart){&t->found, sizeof t->found}
                             : (StudyPart){run, sizeof *run};
}

static OmStatus save(const Retraction* s, Task* t) {
    char name[96];
    if (t->row == PREPLAN) return OM_OK;
    const StudyPart part = part_of(t, name);
    return om__study_save_parts(s->def->out_dir, name, t->hash, &part, 1);
}

static bool load(const Retraction* s, Task* t) {
    char name[96];
    const StudyPart part = part_of(t, name);
    return om__study_load_parts(s->def->out_dir, name, t->hash, &part, 1);
}

// What both arms find counts where one arm finds nothing.
static void mark(const Task* t) {
    if (t->row == CEILING || (t->row == CEILING_BOTH && t->found.is_possible))
        t->result->ceiling = t->found;
    if (t->row == CEILING) t->result->ceiling.best.first_block = -1;  // older files have no value
    if (is_search(t->row))
        t->result->has_ceiling = true;
    else if (t->row != PREPLAN)
        t->result->has_run[t->row] = true;
}

static OmStatus make(const Retraction* s, Task* t, const OmProgress* alive) {
    OmStatus status = t->row == PREPLAN                   ? make_preplan(s, t, alive)
                      : is_search(t->row)                 ? make_ceiling(t, alive)
                      : t->row == OM_RETRACTION_OPEN_LOOP ? make_open_loop(s, t, alive)
                                                          : make_run(s, t, alive);
    if (status >= 0) status = save(s, t);
    t->is_done = status >= 0;
    return status;
}

// A run continues as long as no other one has failed and the study is not cancelled.
static bool is_alive(void* ctx, const char* stage, double done, double total) {
    Crew* c = ctx;
    (void)stage, (void)done, (void)total;
    return atomic_load(&c->status) == OM_OK;
}

static void fail(Crew* c, const char* name, OmStatus status) {
    if (atomic_flag_test_and_set(&c->is_reported)) return;
    snprintf(c->message, sizeof c->message, "%s%s%s", name, name[0] ? ": " : "",
             om_error_message());
    atomic_store(&c->status, status);
}

// Take tasks until none is left.
static OmStatus work(void* ctx, const OmProgress* progress) {
    Crew* c = ctx;
    const OmProgress alive = {is_alive, c};
    (void)progress;
    while (atomic_load(&c->status) == OM_OK) {
        const int i = atomic_fetch_add(&c->next, 1);
        if (i >= c->ntask) break;
        OmStatus status = make(c->s, &c->task[i], &alive);
        if (status < 0)
            fail(c, c->task[i].name, status);
        else
            atomic_fetch_add(&c->ndone, 1);
    }
    atomic_fetch_sub(&c->nworking, 1);
    return OM_OK;  // the crew has the status
}

// Jobs of their own, not om_parallel_team: a team that begins on a busy machine has fewer workers to its end, and this
// one lasts for hours. Without a thread to be had, the caller's makes all runs.
static void run_crew(Crew* c, int nworker) {
    const struct timespec pause = {0, 100 * 1000 * 1000};
    OmJob* job[MAX_WORKER];
    int njob = 0;
    if (nworker > c->ntask) nworker = c->ntask;
    if (nworker > MAX_WORKER) nworker = MAX_WORKER;
    atomic_store(&c->nworking, nworker);
    while (njob < nworker && om_job_start(work, c, &job[njob]) == OM_OK) ++njob;
    atomic_fetch_sub(&c->nworking, nworker - njob);
    if (njob == 0) (void)work(c, NULL);
    while (atomic_load(&c->nworking) > 0) {
        OmStatus status =
            om_progress_report(c->s->progress, c->stage, atomic_load(&c->ndone), c->ntask);
        if (status < 0) fail(c, "", status);
        nanosleep(&pause, NULL);
    }
    for (int k = 0; k < njob; ++k) om_job_join(job[k]);
}

// Run n tasks. After a failure no other one is begun; the tasks that were finished count.
static OmStatus run_tasks(Retraction* s, const char* stage, Task* task, int n) {
    if (n == 0) return OM_OK;
    Crew c = {.s = s,
              .stage = stage,
              .task = task,
              .ntask = n,
              .status = OM_OK,
              .is_reported = ATOMIC_FLAG_INIT};
    OM_TRY(om_progress_report(s->progress, stage, 0, n));
    run_crew(&c, om_worker_count(s->def->nworker));
    for (int k = 0; k < n; ++k)
        if (task[k].is_done) mark(&task[k]);
    const int status = atomic_load(&c.status);
    if (status == OM_OK) return om_progress_report(s->progress, stage, n, n);
    return om_error((OmStatus)status, "%s", c.message);
}

// Does the user want this task, a run or a search, if it is not in the folder?
static bool is_asked(const Retraction* s, const RetractionResult* r, int row) {
    static const int part[RETRACTION_NGROUP] = {[RETRACTION_SCENARIO] = OM_RETRACTION_SCENARIOS,
                                                [RETRACTION_PAIR] = OM_RETRACTION_RANDOM,
                                                [RETRACTION_LAB] = OM_RETRACTION_LABORATORY,
                                                [RETRACTION_KIDNEY] = OM_RETRACTION_KIDNEY,
                                                [RETRACTION_ALARM] = OM_RETRACTION_ALARMS};
    int wanted = part[r->c.group];
    if (is_search(row) && r->c.group == RETRACTION_PAIR)  // it tells whether the pair counts
        wanted |= OM_RETRACTION_SEARCHES | OM_RETRACTION_ABLATIONS;
    else if (is_search(row))
        wanted = OM_RETRACTION_SEARCHES;
    else if (row == OM_RETRACTION_OPEN_LOOP)
        wanted |= OM_RETRACTION_ABLATIONS;
    else if (row > OM_RETRACTION_FRAS_TRUE)
        wanted = OM_RETRACTION_ABLATIONS;
    else if (row == OM_RETRACTION_DEFRAS)
        wanted |= OM_RETRACTION_ABLATIONS;  // to compare with
    return r->is_asked && s->def->parts & wanted;
}

// Mark the task of a case if the folder has it; else append it if the user wants it.
static OmStatus list_task(Retraction* s, RetractionResult* r, int row, Task* task, int* n) {
    OM_TRY(open_task(r, row, &task[*n]));
    const bool is_there = load(s, &task[*n]), is_made = !is_there && is_asked(s, r, row);
    s->sum.nrun += is_there || is_made;
    s->sum.nnew += is_made;
    if (is_there) mark(&task[*n]);
    *n += is_made;
    return OM_OK;
}

// Plans carried out open loop: they tell which pairs count.
static OmStatus list_open_loops(Retraction* s, Task* task, int* n) {
    for (int i = 0; i < s->ncase; ++i)
        if (om__retraction_is_wanted(s, &s->result[i].c, OM_RETRACTION_OPEN_LOOP))
            OM_TRY(list_task(s, &s->result[i], OM_RETRACTION_OPEN_LOOP, task, n));
    return OM_OK;
}

// The other runs that are not in the folder yet: DEFRAS of all cases first. Of pairs the first NABLATED are ablated.
static OmStatus list_runs(Retraction* s, Task* task, int* n) {
    for (int row = 0; row < OM_RETRACTION_OPEN_LOOP; ++row)
        for (int i = 0, npair = 0; i < s->ncase; ++i) {
            const RetractionCase* c = &s->result[i].c;
            if (!om__retraction_is_wanted(s, c, (OmRetractionRow)row) ||
                !om__retraction_counts(s, &s->result[i]))
                continue;
            npair += c->group == RETRACTION_PAIR;
            if (row > OM_RETRACTION_FRAS_TRUE && c->group == RETRACTION_PAIR && npair > NABLATED)
                continue;
            OM_TRY(list_task(s, &s->result[i], row, task, n));
        }
    return OM_OK;
}

// Of pairs first: they tell which count.
static OmStatus list_searches(Retraction* s, bool is_of_pairs, Task* task, int* n) {
    for (int i = 0; i < s->ncase; ++i)
        if (om__retraction_is_searched(&s->result[i]) &&
            (s->result[i].c.group == RETRACTION_PAIR) == is_of_pairs)
            OM_TRY(list_task(s, &s->result[i], CEILING, task, n));
    return OM_OK;
}

// Where a search with one arm was made and failed, and so did all runs; a pair of that kind does not count.
static OmStatus list_searches_both(Retraction* s, Task* task, int* n) {
    for (int i = 0; i < s->ncase; ++i)
        if (s->result[i].has_ceiling && !om__retraction_is_possible(&s->result[i]) &&
            s->result[i].c.group != RETRACTION_PAIR)
            OM_TRY(list_task(s, &s->result[i], CEILING_BOTH, task, n));
    return OM_OK;
}

// Plans before that are not in the folder, each once.
static void list_preplans(const Retraction* s, const Task* task, int n, Task* plan, int* nplan) {
    *nplan = 0;
    for (int i = 0; i < n; ++i) {
        char name[96], other[96];
        bool is_listed = false;
        if (!has_preplan(task[i].row)) continue;
        preplan_name(&task[i].result->c, name, sizeof name);
        for (int k = 0; k < *nplan; ++k) {
            preplan_name(&plan[k].result->c, other, sizeof other);
            is_listed = is_listed || strcmp(name, other) == 0;
        }
        if (is_listed || om__study_has_file(s->def->out_dir, name)) continue;
        plan[*nplan] = task[i];
        plan[(*nplan)++].row = PREPLAN;
    }
}

// Runs and plans before that are missing; searches that do not wait for their outcome.
static OmStatus tell(const Retraction* s, const Task* task, int n, int nplan) {
    int nfras = 0, nsearch = 0;
    for (int i = 0; i < n; ++i)
        nfras += task[i].row == OM_RETRACTION_FRAS || task[i].row == OM_RETRACTION_FRAS_TRUE;
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionResult* r = &s->result[i];
        char name[96];
        snprintf(name, sizeof name, "%s-search.bin", r->c.name);
        nsearch += is_asked(s, r, CEILING) && om__retraction_is_searched(r) &&
                   !om__study_has_file(s->def->out_dir, name);
    }
    const double quick = s->def->is_quick ? 0.15 : 1;
    const StudyWork work[] = {{"plans before", nplan, SECONDS_PREPLAN * quick, false},
                              {"runs of DEFRAS", n - nfras, SECONDS_DEFRAS * quick, false},
                              {"runs of FRAS", nfras, SECONDS_FRAS * quick, false},
                              {"searches", nsearch, SECONDS_SEARCH * quick, false}};
    return om__study_estimate_tell(work, 4, s->def->nworker, s->progress);
}

// Of plans and open loops that tell which pairs count; at most so many searches follow.
static OmStatus tell_pairs(const Retraction* s, int n, int nplan) {
    const double quick = s->def->is_quick ? 0.15 : 1;
    const StudyWork work[] = {{"plans before", nplan, SECONDS_PREPLAN * quick, false},
                              {"plans carried out open loop", n, SECONDS_OPEN * quick, false},
                              {"searches at most", n, SECONDS_SEARCH * quick, false}};
    return om__study_estimate_tell(work, 3, s->def->nworker, s->progress);
}

// Which pairs count: their plans, these open loop, and searches where they fail.
static OmStatus find_pairs(Retraction* s, Task* task, Task* plan) {
    int n = 0, nplan = 0;
    OM_TRY(list_open_loops(s, task, &n));
    list_preplans(s, task, n, plan, &nplan);
    if (n > 0) OM_TRY(tell_pairs(s, n, nplan));
    OM_TRY(run_tasks(s, "plans before", plan, nplan));
    OM_TRY(run_tasks(s, "plans carried out open loop", task, n));
    n = 0;
    OM_TRY(list_searches(s, true, task, &n));
    return run_tasks(s, "searches", task, n);
}

OmStatus om__retraction_run_cases(Retraction* s) {
    const size_t most = (size_t)s->ncase * OM_RETRACTION_NROW + 1;
    int n = 0, nplan = 0;
    OmStatus status;
    Task *task = NULL, *plan = NULL;
    OM_CALLOC_DONE(task, most);
    OM_CALLOC_DONE(plan, most);
    OM_TRY_DONE(find_pairs(s, task, plan));
    OM_TRY_DONE(list_runs(s, task, &n));
    list_preplans(s, task, n, plan, &nplan);
    OM_TRY_DONE(tell(s, task, n, nplan));
    OM_TRY_DONE(run_tasks(s, "plans before", plan, nplan));
    OM_TRY_DONE(run_tasks(s, "runs", task, n));
    n = 0;
    OM_TRY_DONE(list_searches(s, false, task, &n));
    OM_TRY_DONE(run_tasks(s, "searches", task, n));
    n = 0;
    OM_TRY_DONE(list_searches_both(s, task, &n));
    status = run_tasks(s, "searches with two arms", task, n);
done:
    om_free(task);
    om_free(plan);
    return status;
}
