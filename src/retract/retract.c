// retract.c: a run of the loop on a scene: builds world and twin, ticks to the end, writes the record.
#include <string.h>

#include "loop/loop_state.h"
#include "omentum/record.h"
#include "omentum/retract.h"
#include "omentum/trial_ahead.h"
#include "omentum/world_log.h"
#include "retract/retract_belief.h"
#include "retract/retract_journal.h"
#include "retract/retract_register.h"
#include "retract/retract_view.h"
#include "retract/retract_watch.h"

#define RETRACT_COOKIE 0x0de78a5
enum { MAX_LISTENER = 6 };  // audit, log, recorder, of a view two, and of a watch

OmRetractDef om_retract_default_def(const OmScene* scene) {
    return (OmRetractDef){
        .cookie = RETRACT_COOKIE, .scene = scene, .frame_every = 1, .has_recording = true};
}

void om_retract_use_all(OmScene* scene) {
    scene->monitor.is_enabled = scene->update.is_enabled = true;
    if (scene->task.ahead == 0) scene->task.ahead = OM_AHEAD_POINTS;
    if (strcmp(scene->update.network, "none") == 0) strcpy(scene->update.network, "installed");
}

// ---- beginning ------------------------------------------------------------------------------------------

// Objects of a loop on a scene.
typedef struct Setup {
    OmSite twin_site, world_site;
    OmBody* twin;
    OmWorld* world;
    OmPlanner* planner;
    OmRecorder* recorder;  // null: nothing is written
    Journal* journal;      // null: neither written nor replayed
    RunView* view;         // null: no page watches
    RunWatch* watch;       // null: no program does by OpenIGTLink
    OmMatch* match;        // of the job of the updater; null: nothing is estimated
    OmBanetNet* net;       // null: the scene names none
    OmBanetUpdater* banet;
    OmUpdater* updater;  // null: the scene has no updates
    OmMonitor* monitor;  // null: the scene has none
    OmAhead* ahead;      // null: the scene does not look ahead
    OmLoop* loop;
    int nadded;                   // attachments that hold a twin that slid off
    OmMatchVerdict registration;  // on the tissue at rest
} Setup;

static void setup_done(Setup* s) {
    om_loop_destroy(s->loop);
    om_ahead_destroy(s->ahead);
    om_updater_destroy(s->updater);
    om_monitor_destroy(s->monitor);
    om_banet_updater_destroy(s->banet);
    om_banet_net_destroy(s->net);
    om_match_destroy(s->match);
    om__journal_destroy(s->journal);
    om__run_view_destroy(s->view);
    om__run_watch_destroy(s->watch);
    om_recorder_destroy(s->recorder);
    om_world_destroy(s->world);
    om_body_destroy(s->twin);
    om_planner_destroy(s->planner);
    om_site_done(&s->twin_site);
    om_site_done(&s->world_site);
}

static OmStatus check_def(const OmRetractDef* def) {
    OM_CHECK(def->cookie == RETRACT_COOKIE, OM_INVALID, "OmRetractDef was not made by default_def");
    OM_CHECK(def->scene, OM_INVALID, "OmRetractDef.scene is null");
    const OmSceneTask* task = &def->scene->task;
    const char* label = om_scene_label(def->scene);
    OM_CHECK(task->force_margin >= 0 && om__force_limit(task) > 0, OM_INVALID,
             "%s: task: force_margin %g N leaves nothing of force_threshold %g N", label,
             task->force_margin, task->force_threshold);
    OM_CHECK(!def->law.next || !def->records_observations, OM_INVALID,
             "OmRetractDef.law: observations recorded with a motion law cannot be replayed; record "
             "without it");
    OM_CHECK(def->igtl_port >= 0 && def->igtl_port <= 65535, OM_INVALID,
             "OmRetractDef.igtl_port is %d; 0 to 65535", def->igtl_port);
    OM_CHECK(def->frame_every >= 0, OM_INVALID, "OmRetractDef.frame_every is %d", def->frame_every);
    OM_CHECK(def->orbit == 0 || (def->orbit >= 2 && def->orbit <= 100), OM_INVALID,
             "OmRetractDef.orbit is %d: 0, or 2 to 100 pictures", def->orbit);
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(def->scene, OM_SITE_TWIN, &engine));
    OmStatus status = om__check_watch(task, engine);
    if (status < 0) return om_error_prefix(status, "%s", label);
    OM_CHECK(!def->scene->update.is_enabled || engine->has_springs, OM_INVALID,
             "%s: update: the twin's engine \"%s\" has no springs, which hold the tissue where an "
             "update finds it attached; choose an engine with springs (fem)",
             label, engine->name);
    return def->out_dir ? om_folder_check(def->out_dir, OM__RETRACT_KIND) : OM_OK;
}

// A simulated world, a robot, or the observations of a replay.
static OmStatus build_world(const OmRetractDef* def, const Replay* replay,
                            const OmProgress* progress, Setup* s) {
    if (replay) return om_world_create_replayed(replay->log, &s->world);
    if (def->robot) {
        OmDdsWorldDef robot = *def->robot;
        robot.site = &s->twin_site;
        return om_world_create_dds(&robot, &s->world);
    }
    OM_TRY(om_site_build(def->scene, OM_SITE_WORLD, progress, &s->world_site));
    OM_TRY(om_world_check_visible(def->scene, &s->world_site));
    return om_world_create_simulated(def->scene, &s->world_site, def->nworker, &s->world);
}

// The twin's body, at rest.
// @return OM_OK; OM_NOT_CONVERGED (it still moves); errors of om_body_create
static OmStatus build_twin(const OmRetractDef* def, Setup* s) {
    OM_TRY(om_body_create(def->scene, &s->twin_site, def->nworker, &s->twin));
    return om__rest_settle(def->scene, s->twin, &s->nadded);
}

// Create sites, bodies, world and planner; let world and twin come to rest. From its reset on a robot's arms are
// powered. So the twin settles before it, for seconds; not so a twin that is moved onto what the depth camera sees: its
// scan must know where the arms are, which they say when they are homed.
static OmStatus build(const OmRetractDef* def, const Replay* replay, const OmProgress* progress,
                      Setup* s, bool* is_settled) {
    const OmScene* scene = def->scene;
    if (replay) {
        OM_TRY(om__belief_load(replay->site, &s->twin_site));
        OM_TRY(om_site_mesh_organ(scene, &s->twin_site));
    } else {
        OM_TRY(om_site_build(scene, OM_SITE_TWIN, progress, &s->twin_site));
    }
    OM_TRY(build_world(def, replay, progress, s));
    const bool registers = !replay && om__retract_registers(scene, s->world);
    OmStatus twin = OM_OK, world = OM_OK;
    if (!registers) OM_TRY(twin = build_twin(def, s));
    OmPlannerDef planner = om_planner_default_def();
    planner.program = def->program;
    planner.has_both_arms = replay ? replay->has_both_arms : def->has_both_arms;
    planner.max_lift = (int)ceil(scene->task.max_height / scene->task.pull_step - 1e-9);
    OM_TRY(om_planner_create(&planner, &s->planner));
    if (!replay)
        OM_TRY(world = om_world_reset(s->world));
    else if (!replay->is_settled)
        world = OM_NOT_CONVERGED;
    if (registers) {
        OM_TRY(om__retract_register(scene, s->world, &s->twin_site, &s->registration));
        OM_TRY(twin = build_twin(def, s));
    }
    *is_settled = twin == OM_OK && world == OM_OK;
    return OM_OK;
}

// An updater, if the scene corrects the twin's attachments or acquisitions are recorded.
static OmStatus build_updater(const OmRetractDef* def, const Replay* replay, Setup* s) {
    const bool is_enabled = def->scene->update.is_enabled;
    if (!is_enabled && !(def->records_acquisitions && def->out_dir)) return OM_OK;
    OmUpdateDef update = om_update_default_def(def->scene, s->world, &s->twin_site);
    if (is_enabled) {
        OmMatchDef match = om_match_default_def(def->scene, &s->twin_site);
        match.is_unchecked = !def->scene->update.is_checked;
        OM_TRY(om_match_create(&match, &s->match));
        update.estimate = om_update_estimate_by_match;
        update.estimate_ctx = s->match;
        OM_TRY(om_banet_net_find(def->scene->update.network, def->scene->data_root, &s->net));
    }
    if (s->net) {
        OmBanetUpdateDef banet = om_banet_update_default_def(s->match);
        banet.net = s->net;
        banet.tries_last_corrected = true;
        OM_TRY(om_banet_updater_create(&banet, &s->banet));
        update.estimate = om_update_estimate_by_banet;
        update.estimate_ctx = s->banet;
    }
    if (replay) {
        update.timing = replay->is_ready_timed ? OM_UPDATE_REPLAYED : OM_UPDATE_AFTER_LATENCY;
        update.replay_tick = replay->end_tick;
        update.nreplay = replay->nestimate;
    }
    return om_updater_create(&update, &s->updater);
}

static OmStatus build_view(const OmRetractDef* def, Setup* s, OmLoopDef* loop,
                           OmLoopListener* listener) {
    loop->listener = listener;
    if (def->igtl_port > 0) {
        OM_TRY(om__run_watch_create(def->igtl_port, def->scene, s->world, s->twin, &s->watch));
        listener[loop->nlistener++] = om__run_watch_listener(s->watch);
    }
    if (!def->server) return OM_OK;
    OM_TRY(om__run_view_create(def->server, def->scene, s->world, s->twin, s->planner, &s->view));
    loop->nlistener += om__run_view_listeners(s->view, listener + loop->nlistener);
    return OM_OK;
}

// The recorder, the audit and the log; a replay has the audit alone.
static OmStatus build_listeners(const OmRetractDef* def, const Replay* replay, Setup* s,
                                OmLoopDef* loop, OmLoopListener listener[MAX_LISTENER]) {
    if (!def->out_dir && !replay) return build_view(def, s, loop, listener);
    if (!replay) {
        OmRecorderDef rec =
            om_recorder_default_def(def->out_dir, def->scene, s->world, s->twin, s->planner);
        rec.truth = loop->truth;
        rec.frame_every = def->frame_every;
        rec.orbit = def->orbit;
        rec.records_acquisitions = def->records_acquisitions;
        rec.has_recording = def->has_recording;
        OM_TRY(om_recorder_create(&rec, &s->recorder));
    }
    const JournalTwin twin = {&s->twin_site, s->net ? om_banet_net_hash(s->net) : 0};
    OM_TRY(om__journal_create(def, s->recorder, replay, s->world, s->planner, &twin, &s->journal));
    loop->world = om__journal_world(s->journal);
    loop->nlistener = om__journal_listeners(s->journal, listener);
    if (s->recorder) listener[loop->nlistener++] = om_recorder_listener(s->recorder);
    loop->listener = listener;
    return build_view(def, s, loop, listener);
}

static OmStatus begin(const OmRetractDef* def, const Replay* replay, const OmProgress* progress,
                      Setup* s) {
    double wall_begin = om_clock_now();
    bool is_settled = false;
    OM_TRY(build(def, replay, progress, s, &is_settled));
    OmLoopDef loop = om_loop_default_def(&def->scene->task, s->world, s->twin, s->planner);
    OmLoopListener listener[MAX_LISTENER];
    loop.truth = om_world_truth(s->world);
    loop.is_settled = is_settled;
    loop.nadded = s->nadded;
    const OmMatchVerdict* v = &s->registration;
    loop.turned = v->is_moved ? v->turn : 0;
    loop.shifted = v->is_moved ? v->shift : 0;
    loop.unregistered = v->is_good ? NULL : v->reason;
    loop.wall_begin = wall_begin;
    OM_TRY(build_updater(def, replay, s));
    loop.updater = s->updater;
    loop.preplan = def->preplan;
    if (def->scene->task.ahead > 0) {
        OmAheadDef ahead = om_ahead_default_def(def->scene, &s->twin_site);
        OM_TRY(om_ahead_create(&ahead, s->twin, &s->ahead));
        loop.ahead = s->ahead;
    }
    loop.law = def->law;
    loop.is_attended = def->supervise != NULL;
    loop.needs_approval = def->needs_approval;
    if (def->scene->monitor.is_enabled) {
        OmMonitorDef monitor = om_monitor_default_def(def->scene, s->world, &s->twin_site);
        monitor.mesh = om_body_mesh(s->twin);
        OM_TRY(om_monitor_create(&monitor, &s->monitor));
        loop.monitor = s->monitor;
    }
    OM_TRY(build_listeners(def, replay, s, &loop, listener));
    if (replay) {
        loop.is_attended = replay->is_attended;
        loop.needs_approval = replay->needs_approval;
        loop.max_age = replay->max_age;
    }
    return om_loop_create(&loop, &s->loop);
}

// ---- the run --------------------------------------------------------------------------------------------

// Commands that the recorded run got after this tick.
static OmStatus give_commands(const Setup* s, const Replay* replay, int* next) {
    while (replay && *next < replay->ncommand && om_loop_phase(s->loop) != OM_LOOP_ENDED &&
           replay->command[*next].tick <= om_loop_ntick(s->loop))
        OM_TRY(om_loop_command(s->loop, &replay->command[(*next)++].command));
    return OM_OK;
}

// Tick to the end. Progress may cancel the run: the record so far is kept. How many actions there will be is not
// known: a plan may end early, and another one may follow.
static OmStatus run(const OmRetractDef* def, const Replay* replay, const Setup* s,
                    const OmProgress* progress) {
    int ncommand = 0;
    OM_TRY(give_commands(s, replay, &ncommand));
    while (om_loop_phase(s->loop) != OM_LOOP_ENDED) {
        OM_TRY(om_loop_tick(s->loop));
        OM_TRY(give_commands(s, replay, &ncommand));
        if (def->supervise) OM_TRY(def->supervise(def->supervise_ctx, s->loop));
        const int naction = om_loop_result(s->loop)->naction;
        OmStatus status = om_progress_report(progress, "retracting", naction, 0);
        if (status >= 0 || om_loop_phase(s->loop) == OM_LOOP_ENDED) continue;
        OM_TRY(om_loop_command(s->loop, &(OmLoopCommand){OM_LOOP_CANCEL}));
        if (!s->recorder) return om_error(OM_CANCELLED, "%s", om_loop_result(s->loop)->reason);
        return om_error(OM_CANCELLED, "cancelled; the record so far is in %s",
                        om_recorder_place(s->recorder));
    }
    return OM_OK;
}

OmStatus om__retract_run(const OmRetractDef* def, Replay* replay, const OmProgress* progress,
                         OmRetractResult* result) {
    memset(result, 0, sizeof *result);
    OM_TRY(check_def(def));
    Setup setup = {0};
    OmStatus status = begin(def, replay, progress, &setup);
    if (status >= 0) status = run(def, replay, &setup, progress);
    if (replay && setup.journal) {
        if (status < 0) snprintf(replay->failure, sizeof replay->failure, "%s", om_error_message());
        OmStatus kept = om_text_append(&replay->audit, "%s", om__journal_text(setup.journal));
        if (kept < 0) status = kept;
    }
    if (status >= 0) status = om_loop_take_result(setup.loop, result);
    // a job that is cancelled below has a message of its own
    char message[1000];
    snprintf(message, sizeof message, "%s", om_error_message());
    setup_done(&setup);
    return status < 0 ? om_error(status, "%s", message) : status;
}

OmStatus om_retract_run(const OmRetractDef* def, const OmProgress* progress,
                        OmRetractResult* result) {
    return om__retract_run(def, NULL, progress, result);
}

// ---- before a run -------------------------------------------------------------------------------------------

static void fill_estimate(const OmRetractDef* def, const Setup* s, OmRetractEstimate* e) {
    const OmLoop* loop = s->loop;
    const OmRetractResult* r = om_loop_result(loop);
    const OmSceneCamera* camera = &def->scene->endoscope;
    e->twin_nvert = r->twin.nvert, e->twin_ntet = r->twin.ntet;
    e->world_nvert = r->truth.nvert, e->world_ntet = r->truth.ntet;
    e->twin_norgan = s->twin_site.soft.nvert, e->world_norgan = s->world_site.soft.nvert;
    e->nadded = r->twin.nadded;
    e->registration = s->registration;
    e->twin_nattached = om__count_attached(s->twin) - r->twin.nadded;
    e->world_nattached = om__count_attached(om_world_truth(s->world));
    e->nblock = loop->grid.n * loop->grid.n;
    for (int b = 0; b < e->nblock; ++b)
        e->ngrasp += loop->grid.vert[b] >= 0 && !om__grid_is_fixed(&loop->grid, s->twin, b);
    e->visibility = om_loop_sample(loop).visibility;
    e->is_settled = r->is_settled;
    e->has_slid = r->has_slid;
    int every = def->frame_every, max = def->scene->task.max_actions;
    double nframe = 1 + (every > 0 ? max / every : 0);
    e->picture_bytes = nframe * 3.0 * camera->width * camera->height;
}

// A first look and a first plan, then ticks with the arms paused.
static OmStatus estimate_loop(const OmRetractDef* def, const Setup* s, OmRetractEstimate* e) {
    double start = om_clock_now();
    OM_TRY(om_loop_command(s->loop, &(OmLoopCommand){OM_LOOP_PAUSE}));
    OM_TRY(om_loop_tick(s->loop));
    fill_estimate(def, s, e);
    OmStatus status = om__loop_plan(s->loop);
    OM_TRY(status);
    e->nplanned = status == OM_OK ? s->loop->plan.naction : 0;
    e->begin_time += om_clock_now() - start;
    const double tick_start = om_clock_now(), time = s->loop->act.time;
    int ntick = (int)ceil(OM_RETRACT_CHECK_TIME / def->scene->task.time_step);
    for (int i = 0; i < ntick; ++i) OM_TRY(om_loop_tick(s->loop));
    e->time_rate = (om_clock_now() - tick_start) / fmax(1e-3, s->loop->act.time - time);
    return OM_OK;
}

OmStatus om_retract_check(const OmRetractDef* def, const OmProgress* progress,
                          OmRetractEstimate* estimate) {
    memset(estimate, 0, sizeof *estimate);
    OM_TRY(check_def(def));
    const double start = om_clock_now();
    OmRetractDef unwritten = *def;
    unwritten.out_dir = NULL;
    unwritten.robot = NULL;  // no arm moves for a check
    Setup setup = {0};
    OmStatus status = begin(&unwritten, NULL, progress, &setup);
    estimate->begin_time = om_clock_now() - start;
    if (status >= 0) status = estimate_loop(def, &setup, estimate);
    setup_done(&setup);
    return status;
}
