// trial_calibrate.c: the force threshold of a scene, from the forces of its retractions (6.5.1).
//
// The twin tries every block of every layout from rest, without a force limit: a lift to the height limit; then, if
// the ROI is still hidden, a fold away from the camera; then, from the height limit again, a fold towards the ROI. As
// in a run, a motion ends where the ROI is seen, and none follows. The largest pull is a sample; the threshold is twice
// the median of the samples of free tissue. Grasps above an attachment, which the planner does not choose, are counted
// apart. Motions are SPEED_UP times as fast as those of the task. A motion ends at CAP times the scene's threshold:
// larger forces do not change a median below this value, and a median above it is an error.
//
// The margin bounds the excess of the truth over the twin. Of the grasps that the planner may choose (not above an
// attachment) every TRUTH_EVERYth is repeated, step by step, on the simulated truth, until the twin's pull is above the
// threshold. The arms act at a limit L: they slow down from three quarters of L on, stand still above it, and feel the
// twin's pull. A motion on the truth ends at CAP times the threshold, and the rest of its instants bear that pull. L is
// the largest for which the truth stays below the threshold in 95 % of the instants at which the twin's pull is between
// 3/4 L and L, and the truth's step is right; the margin is the threshold less L.
// The modulus of real tissue is not known: the truths may have those of a range, even in their logarithm over layouts.
// The twin's layouts run in parallel, one thread each, then the truth's grasps, of which one takes a minute; results
// are sorted by layout and block.
//
// Rejected: the 95 % quantile of truth less twin while the twin is between half the threshold and the threshold, where
// the arms never pull; to repeat motions on the truth beyond the threshold: crumpled, it took 20 minutes for a layout;
// lifts to the height limit and folds though the ROI is seen: pulls twice as large as a run's.
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/base_grow.h"
#include "omentum/trial_search.h"
#include "trial/trial_lift.h"

#define SPEED_UP 3.0
#define CAP 2.0
#define TRUTH_EVERY 4
#define MARGIN_QUANTILE 0.95
#define NLIMIT 100       // limits that are tried, hundredths of the threshold
#define MIN_INSTANTS 10  // that tell of a limit

typedef struct Pairs {  // twin's and truth's pull at the same instants, N
    int n, capacity;
    double *twin, *truth;
} Pairs;

typedef struct Sample {  // a block of a layout
    double largest;      // N, -1 where nothing was held
    bool is_fixed;       // the block is above an attachment
    Trace trace[3];      // the motions that the truth repeats; empty: none
} Sample;

typedef struct Grasp {  // that the truth repeats
    int layout, block;
    Pairs pairs;
} Grasp;

typedef struct Calibration {
    const OmScene* scene;
    const double* young;    // the truth's modulus over the twin's, from, to; null: the scene's
    Sample* sample;         // (nlayout x nblock)
    Grasp* grasp;           // (ngrasp)
    TrialOutcome* outcome;  // of each item of a stage
    int nblock, nlayout, ngrasp;
    double threshold;  // N
    const char* stage;
    const OmProgress* progress;
    OmStatus (*run)(struct Calibration* c, int item);
    int nitem;         // of this stage: layouts, or grasps
    atomic_int ndone;  // of these
    atomic_flag is_reporting;
    atomic_bool is_cancelled;
} Calibration;

// Before each step: an item takes minutes. One worker at a time reports.
static OmStatus tick(void* ctx) {
    Calibration* c = ctx;
    if (atomic_load(&c->is_cancelled)) return om_error(OM_CANCELLED, "cancelled");
    if (atomic_flag_test_and_set(&c->is_reporting)) return OM_OK;
    const OmStatus status =
        om_progress_report(c->progress, c->stage, atomic_load(&c->ndone), c->nitem);
    atomic_flag_clear(&c->is_reporting);
    if (status < 0) atomic_store(&c->is_cancelled, true);
    return status;
}

static OmStatus add_pairs(Pairs* p, const Trace* trace, int n, const double* truth) {
    for (int i = 0; i < n; ++i) {
        if (isnan(truth[i])) continue;  // of a step that is not right
        int capacity = p->capacity;     // that of both, once both have grown
        OM_GROW(p->twin, p->n, capacity, 256);
        OM_GROW(p->truth, p->n, p->capacity, 256);
        p->twin[p->n] = trace->force[i];
        p->truth[p->n++] = truth[i];
    }
    return OM_OK;
}

// All motions of one grasp by the twin, recorded where `trace` is not null.
static OmStatus try_grasp(Trial* twin, int block, double* largest, Trace* trace) {
    static const OmPlanVerb fold[2] = {OM_PLAN_MOVE_AWAY, OM_PLAN_MOVE_ROI};
    TrialResult course = {.trace = trace};
    void* lifted = NULL;
    double cap = CAP * twin->scene.task.force_threshold;
    int nheld;
    OM_TRY(om__trial_grasp(twin, block, &course, &nheld));
    if (nheld == 0) return OM_OK;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om__trial_lift(twin, cap, &course));
    *largest = course.force;
    if (course.is_stopped || course.is_enough) goto done;
    lifted = om_alloc(1, om_body_state_size(twin->body));
    OM_CHECK_DONE(lifted, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(twin->body, lifted);
    for (int k = 0; k < 2; ++k) {
        if (k) om_body_restore(twin->body, lifted);
        TrialResult c = {.tip = course.tip, .trace = trace ? &trace[1 + k] : NULL};
        OM_TRY_DONE(om__trial_fold(twin, fold[k], cap, &c));
        *largest = fmax(*largest, c.force);
        if (c.is_enough) break;
    }
done:
    om_free(lifted);
    return status;
}

static OmStatus run_twin(Calibration* c, int layout) {
    Trial* twin;
    OM_TRY(om__trial_create(c->scene, layout + 1, OM_SITE_TWIN, 1, &twin));
    OmStatus status = OM_OK;
    twin->tick = tick;
    twin->tick_ctx = c;
    twin->speed = SPEED_UP * c->scene->task.speed;
    twin->enough = c->scene->task.visibility + c->scene->task.visibility_margin;
    for (int b = 0, nfree = layout; status >= 0 && b < c->nblock; ++b) {
        Sample* s = &c->sample[layout * c->nblock + b];
        s->largest = -1;
        if (twin->grid.vert[b] < 0) continue;
        s->is_fixed = om__grid_is_fixed(&twin->grid, twin->body, b);
        const bool has_truth = !s->is_fixed && nfree++ % TRUTH_EVERY == 0;
        status = try_grasp(twin, b, &s->largest, has_truth ? s->trace : NULL);
    }
    om__trial_destroy(twin);
    return status;
}

// The instants of a motion before the twin's pull is above the threshold.
static int count_below(const Trace* trace, double threshold) {
    int n = 0;
    while (n < trace->n && trace->force[n] <= threshold) ++n;
    return n;
}

// The same motions on the truth: the lift, then each fold from the lifted state.
static OmStatus replay_grasp(Calibration* c, Trial* truth, int block, const Trace trace[3],
                             Pairs* pairs) {
    OmStatus status = OM_OK;
    TrialResult course = {0};
    int nheld, longest = 0;
    double* force = NULL;
    void* lifted = NULL;
    OM_TRY(om__trial_grasp(truth, block, &course, &nheld));
    if (nheld == 0) return OM_OK;
    for (int k = 0; k < 3; ++k) longest = trace[k].n > longest ? trace[k].n : longest;
    OM_ALLOC_DONE(force, longest);
    lifted = om_alloc(1, om_body_state_size(truth->body));
    OM_CHECK_DONE(lifted, OM_NO_MEMORY, "out of memory for a snapshot");
    for (int k = 0; k < 3; ++k) {
        const int n = count_below(&trace[k], c->threshold);
        if (k > 1) om_body_restore(truth->body, lifted);
        bool is_over;
        OM_TRY_DONE(om__trial_replay(truth, n, trace[k].tip, CAP * c->threshold, force, &is_over));
        OM_TRY_DONE(add_pairs(pairs, &trace[k], n, force));
        if (k == 0 && (is_over || n < trace[k].n)) break;  // no fold follows
        if (k == 0) om_body_save(truth->body, lifted);
    }
done:
    om_free(force);
    om_free(lifted);
    return status;
}

// Golden shares: even in the range for any number of layouts.
static double golden(int layout) { return fmod((layout + 0.5) * 0.6180339887498949, 1); }

static OmStatus run_truth(Calibration* c, int item) {
    Grasp* g = &c->grasp[item];
    const Sample* s = &c->sample[g->layout * c->nblock + g->block];
    Trial* truth;
    OmScene scene = *c->scene;
    if (c->young)
        scene.world.young_factor = c->young[0] * pow(c->young[1] / c->young[0], golden(g->layout));
    OM_TRY(om__trial_create(&scene, g->layout + 1, OM_SITE_WORLD, 1, &truth));
    truth->tick = tick;
    truth->tick_ctx = c;
    const OmStatus status = replay_grasp(c, truth, g->block, s->trace, &g->pairs);
    om__trial_destroy(truth);
    return status;
}

// The grasps that the twin recorded.
static OmStatus list_grasps(Calibration* c) {
    const int n = c->nlayout * c->nblock;
    int ngrasp = 0;
    for (int i = 0; i < n; ++i) ngrasp += c->sample[i].trace[0].n > 0;
    c->grasp = om_calloc((size_t)ngrasp, sizeof *c->grasp);
    if (!c->grasp) return OM_NO_MEMORY;
    for (int i = 0; i < n; ++i)
        if (c->sample[i].trace[0].n > 0)
            c->grasp[c->ngrasp++] = (Grasp){.layout = i / c->nblock, .block = i % c->nblock};
    return OM_OK;
}

static void run_items(void* ctx, int begin, int end, int block) {
    (void)block;
    Calibration* c = ctx;
    for (int i = begin; i < end; ++i) {
        TrialOutcome* o = &c->outcome[i];
        o->status = c->run(c, i);
        atomic_fetch_add(&c->ndone, 1);
        if (o->status >= 0) continue;
        snprintf(o->message, sizeof o->message, "%s", om_error_message());
        atomic_store(&c->is_cancelled, true);  // the others end
    }
}

static OmStatus run_stage(Calibration* c, const char* name,
                          OmStatus (*run)(Calibration* c, int item), int nitem, int nworker) {
    c->stage = name;
    c->run = run;
    c->nitem = nitem;
    atomic_store(&c->ndone, 0);
    OM_TRY(om_progress_report(c->progress, name, 0, nitem));
    om_parallel_for(nworker, nitem, 1, run_items, c);
    // An error of an item cancels the others: it comes first.
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < nitem; ++i) {
            const OmStatus s = c->outcome[i].status;
            OM_CHECK(s >= 0 || (pass == 0 && s == OM_CANCELLED), s, "layout %d: %s",
                     (run == run_truth ? c->grasp[i].layout : i) + 1, c->outcome[i].message);
        }
    }
    return OM_OK;
}

static double quantile(const double* sorted, int n, double share) {
    int i = (int)(share * n);
    return sorted[i < n ? i : n - 1];
}

// What the truth bears, or bears more than the twin, while the twin's pull is between SLOW_FROM and all of a limit,
// sorted; returns how many.
static int take_truth(int n, const double* twin, const double* truth, double limit, bool is_more,
                      double* taken) {
    int num = 0;
    for (int i = 0; i < n; ++i)
        if (twin[i] >= SLOW_FROM * limit && twin[i] <= limit)
            taken[num++] = truth[i] - (is_more ? twin[i] : 0);
    om_sort_doubles(taken, num);
    return num;
}

double om__trial_limit(int n, const double* twin, const double* truth, double threshold,
                       double* scratch) {
    for (int k = NLIMIT; k >= NLIMIT / 10; --k) {
        const double limit = threshold * k / NLIMIT;
        const int num = take_truth(n, twin, truth, limit, false, scratch);
        if (num >= MIN_INSTANTS && quantile(scratch, num, MARGIN_QUANTILE) <= threshold)
            return limit;
    }
    return 0;
}

static OmStatus find_margin(const Calibration* c, OmForceCalibration* out) {
    int n = 0;
    OmStatus status = OM_OK;
    double *twin = NULL, *truth = NULL, *scratch = NULL;
    for (int k = 0; k < c->ngrasp; ++k) n += c->grasp[k].pairs.n;
    OM_ALLOC_DONE(twin, n);
    OM_ALLOC_DONE(truth, n);
    OM_ALLOC_DONE(scratch, n);
    n = 0;
    for (int k = 0; k < c->ngrasp; ++k) {
        const Pairs* p = &c->grasp[k].pairs;
        for (int i = 0; i < p->n; ++i) {
            twin[n] = p->twin[i];
            truth[n++] = p->truth[i];
        }
    }
    const double limit = om__trial_limit(n, twin, truth, out->threshold, scratch);
    OM_CHECK_DONE(limit > 0, OM_INVALID,
                  "%s: the truth bears more than %.3g N, twice the median of the twin's pulls, "
                  "even where the twin bears a tenth of it; or there are fewer than %d instants: "
                  "take more layouts",
                  om_scene_label(c->scene), out->threshold, MIN_INSTANTS);
    out->margin = fmax(0, out->threshold - limit);  // all of it: no rounding below 0
    out->npair = take_truth(n, twin, truth, limit, true, scratch);
    out->more_median = quantile(scratch, out->npair, 0.5);
done:
    om_free(twin);
    om_free(truth);
    om_free(scratch);
    return status;
}

static double median_of(const double* sorted, int n) {
    return n > 0 ? 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]) : 0;
}

// The samples of one kind, sorted.
static int take_samples(const Calibration* c, bool is_fixed, double* sample) {
    int n = 0;
    for (int i = 0; i < c->nlayout * c->nblock; ++i)
        if (c->sample[i].largest >= 0 && c->sample[i].is_fixed == is_fixed)
            sample[n++] = c->sample[i].largest;
    om_sort_doubles(sample, n);
    return n;
}

// The threshold.
static OmStatus summarise(Calibration* c, OmForceCalibration* out) {
    OmStatus status = OM_OK;
    double* sample = NULL;
    OM_ALLOC(sample, (size_t)c->nlayout * (size_t)c->nblock);
    int n = take_samples(c, true, sample);
    *out = (OmForceCalibration){.nheld = n, .held_median = median_of(sample, n)};
    n = take_samples(c, false, sample);
    OM_CHECK_DONE(n > 0, OM_INVALID,
                  "%s: no grasping point of free tissue can be grasped in any layout",
                  om_scene_label(c->scene));
    out->nrun = n;
    out->median = median_of(sample, n);
    out->lower_quartile = quantile(sample, n, 0.25);
    out->upper_quartile = quantile(sample, n, 0.75);
    out->max = sample[n - 1];
    out->threshold = 2 * out->median;
    OM_CHECK_DONE(
        out->median < CAP * c->scene->task.force_threshold, OM_INVALID,
        "%s: half of the grasps take more than %g N, where the calibration ends a motion; make "
        "force_threshold larger and calibrate again",
        om_scene_label(c->scene), CAP * c->scene->task.force_threshold);
done:
    om_free(sample);
    return status;
}

OmStatus om_retract_calibrate_force(const OmScene* scene, const double young[2], int nlayout,
                                    int nworker, const OmProgress* progress,
                                    OmForceCalibration* calibration) {
    memset(calibration, 0, sizeof *calibration);
    OM_CHECK(!young || (young[0] > 0 && young[0] <= young[1] && young[1] < 1e6), OM_INVALID,
             "moduli of the truth from %g to %g times the twin's; above 0 and ascending", young[0],
             young[1]);
    OM_CHECK(nlayout >= 1 && nlayout <= 10000, OM_INVALID, "%d layouts; 1 to 10000", nlayout);
    const OmTissueEngine* engine;
    OM_TRY(om_body_find_engine(scene, OM_SITE_TWIN, &engine));
    OM_CHECK(om_engine_capabilities(engine) & OM_ENGINE_FORCES, OM_INVALID,
             "the twin's engine \"%s\" has no forces in newtons to calibrate", engine->name);
    Calibration c = {.scene = scene,
                     .young = young,
                     .nlayout = nlayout,
                     .nblock = scene->task.grid * scene->task.grid,
                     .progress = progress,
                     .is_reporting = ATOMIC_FLAG_INIT};
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(c.sample, (size_t)nlayout * (size_t)c.nblock);
    OM_CALLOC_DONE(c.outcome, (size_t)nlayout * (size_t)c.nblock);
    const int worker = om_worker_count(nworker);
    OM_TRY_DONE(run_stage(&c, "pulls of the twin", run_twin, nlayout, worker));
    OM_TRY_DONE(summarise(&c, calibration));
    c.threshold = calibration->threshold;
    OM_TRY_DONE(list_grasps(&c));
    OM_TRY_DONE(run_stage(&c, "pulls of the truth", run_truth, c.ngrasp, worker));
    status = find_margin(&c, calibration);
done:
    for (int k = 0; k < c.ngrasp; ++k) {
        om_free(c.grasp[k].pairs.twin);
        om_free(c.grasp[k].pairs.truth);
    }
    for (int k = 0; c.sample && k < 3 * nlayout * c.nblock; ++k)
        om__trace_done(&c.sample[k / 3].trace[k % 3]);
    om_free(c.grasp);
    om_free(c.sample);
    om_free(c.outcome);
    return status;
}
