// study_phantoms.c: Table 4.2: lifts of phantoms in the world, estimates at every step, and their rows.
//
// Lifts and configurations are independent of each other, and as many run at once as there are workers. Threads only
// compute; files are written between two batches. A configuration is evaluated again if a lift, the network or the
// method changes.
#include <math.h>
#include <string.h>

#include "omentum/banet_net.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_estimate.h"
#include "studies/study_match_case.h"
#include "studies/study_phantoms_eval.h"

#define COOKIE 0x57d94a42u
#define COARSE 1.6  // times the edges, of a quick study
#define QUICK_GRASPS 2

const char* const om__phantoms_way_name[OM_STUDY_PHANTOM_NWAY] = {"network", "fusion", "physics",
                                                                  "all"};
const char* const om__phantoms_way_title[OM_STUDY_PHANTOM_NWAY] = {"network", "network, fused",
                                                                   "physics", "all three"};
const char* const om__phantoms_row_name[OM_STUDY_PHANTOM_NROW] = {
    "circle",  "clover", "rectangle", "drop",   "lift_20", "lift_40",
    "lift_60", "flat",   "deformed",  "grasps", "total"};
const char* const om__phantoms_row_title[OM_STUDY_PHANTOM_NROW] = {
    "Circle",    "Clover", "Rectangle",    "Drop",  "Lift 2 cm", "Lift 4 cm",
    "Lift 6 cm", "Flat",   "Pre-deformed", "Grasp", "All"};

OmStudyPhantomsDef om_study_phantoms_default_def(const char* out_dir) {
    return (OmStudyPhantomsDef){
        .out_dir = out_dir, .estimate_name = "", .threshold = 0.5, .cookie = COOKIE};
}

static OmStatus validate(const OmStudyPhantomsDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "phantoms study: a definition not made by om_study_phantoms_default_def");
    OM_CHECK(d->out_dir, OM_INVALID, "phantoms study: no folder");
    OM_CHECK(d->nworker >= 0 && d->nworker <= OM_MAX_WORKER, OM_INVALID,
             "phantoms study: nworker is %d: 0 to %d", d->nworker, OM_MAX_WORKER);
    OM_CHECK(d->ncase >= 0, OM_INVALID, "phantoms study: ncase is %d: 0 or more", d->ncase);
    OM_CHECK(d->ngrasp >= 0 && d->ngrasp <= PHANTOM_NGRASP, OM_INVALID,
             "phantoms study: ngrasp is %d: 0 to %d", d->ngrasp, PHANTOM_NGRASP);
    OM_CHECK(d->side >= 0 && isfinite(d->side), OM_INVALID,
             "phantoms study: side is %g m: 0 or more", d->side);
    OM_CHECK(d->estimate_name, OM_INVALID, "phantoms study: estimate_name is null");
    OM_CHECK(d->threshold > 0 && d->threshold < 1, OM_INVALID,
             "phantoms study: threshold is %g: above 0, below 1", d->threshold);
    return OM_OK;
}

// ---- tasks of several threads ---------------------------------------------------------------------------------

typedef struct Task {  // a lift to simulate, or a configuration to evaluate
    int index, grasp;
    PhantomTruth truth;
    OmStatus status;
    char message[512];  // of an error: messages are of their thread
} Task;

typedef struct Batch {
    Phantoms* s;
    Task* task;
} Batch;

static OmStatus make_lift(const Phantoms* s, Task* t) {
    bool is_there;
    const PhantomCase* c = &s->c[t->index];
    OM_TRY(om__phantoms_truth_open(c, t->grasp, s->coarse, s->def->out_dir, &is_there, &t->truth));
    return om__phantoms_truth_make(c, t->grasp, 1, &t->truth);
}

static void run_lifts(void* ctx, int begin, int end, int block) {
    (void)block;
    Batch* b = ctx;
    for (int i = begin; i < end; ++i) {
        Task* t = &b->task[i];
        t->status = make_lift(b->s, t);
        if (t->status < 0) snprintf(t->message, sizeof t->message, "%s", om_error_message());
    }
}

static void run_cases(void* ctx, int begin, int end, int block) {
    (void)block;
    Batch* b = ctx;
    for (int i = begin; i < end; ++i) {
        Task* t = &b->task[i];
        t->status = om__phantoms_eval(b->s, &b->s->c[t->index], &b->s->result[t->index]);
        if (t->status < 0) snprintf(t->message, sizeof t->message, "%s", om_error_message());
    }
}

static OmStatus save_lift(Phantoms* s, Task* t) {
    OmStatus status = t->status < 0 ? om_error(t->status, "%s", t->message)
                                    : om__phantoms_truth_save(&t->truth, s->def->out_dir);
    om__phantoms_truth_done(&t->truth);
    return status;
}

static void result_name(const PhantomCase* c, char* name, size_t size) {
    char text[64];
    om__phantoms_name(c, text, sizeof text);
    snprintf(name, size, "case-%s.bin", text);
}

static OmStatus save_case(Phantoms* s, Task* t, const uint64_t* hash) {
    char name[96];
    if (t->status < 0) return om_error(t->status, "%s", t->message);
    result_name(&s->c[t->index], name, sizeof name);
    return om__match_save_result(s->def->out_dir, name, hash[t->index], &s->result[t->index],
                                 sizeof *s->result);
}

// Run n tasks, as many at once as there are workers. hash: of configurations; null: the tasks are lifts.
static OmStatus run_tasks(Phantoms* s, Task* task, int n, const uint64_t* hash) {
    int nworker = om_worker_count(s->def->nworker);
    for (int i = 0; i < n; i += nworker) {
        int m = n - i < nworker ? n - i : nworker;
        OM_TRY(om_progress_report(s->progress, hash ? "estimates" : "lifts", i, n));
        Batch b = {s, task + i};
        om_parallel_for(nworker, m, 1, hash ? run_cases : run_lifts, &b);
        OmStatus status = OM_OK;
        for (int k = 0; k < m; ++k) {  // all of them, so that none is lost or leaked
            OmStatus one = hash ? save_case(s, &b.task[k], hash) : save_lift(s, &b.task[k]);
            if (status == OM_OK) status = one;
        }
        OM_TRY(status);
    }
    return OM_OK;
}

// ---- what there is ----------------------------------------------------------------------------------------------

static void list_cases(Phantoms* s) {
    const OmStudyPhantomsDef* d = s->def;
    int first = d->is_development ? PHANTOM_NSHAPE : 0;
    int nshape = d->is_development ? PHANTOM_NDEV : PHANTOM_NSHAPE;
    int most = d->is_quick ? 1 : nshape * PHANTOM_NSET * PHANTOM_NSTART;
    int ngrasp = d->ngrasp > 0 ? d->ngrasp : PHANTOM_NGRASP;
    if (d->is_quick && ngrasp > QUICK_GRASPS) ngrasp = QUICK_GRASPS;
    if (d->ncase > 0 && d->ncase < most) most = d->ncase;
    for (s->ncase = 0; s->ncase < most; ++s->ncase) {
        int k = s->ncase, shape = k % nshape, rest = k / nshape;
        PhantomCase c = om__phantoms_case(first + shape, rest / PHANTOM_NSTART,
                                          (PhantomStart)(rest % PHANTOM_NSTART));
        if (c.ngrasp > ngrasp) c.ngrasp = ngrasp;
        s->c[s->ncase] = c;
    }
}

// Simulate the lifts that the folder does not have. hash: of each configuration's lifts, network and method.
static int count_missing(const Phantoms* s) {
    int n = 0;
    for (int i = 0; i < s->ncase; ++i) {
        char name[96];
        result_name(&s->c[i], name, sizeof name);
        n += !om__study_has_file(s->def->out_dir, name);
    }
    return n;
}

static OmStatus make_lifts(Phantoms* s, uint64_t* hash) {
    Task* task = om_calloc(PHANTOM_MAX_LIFT, sizeof *task);
    if (!task) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    int n = 0;
    for (int i = 0; i < s->ncase && status == OM_OK; ++i) {
        const PhantomShape* shape = &om__phantoms_shape[s->c[i].shape];
        const double twin[] = {PHANTOM_METHOD, s->coarse, shape->edge, shape->young,
                               shape->density};
        hash[i] = om_hash(twin, sizeof twin, s->network);
        for (int g = 0; g < s->c[i].ngrasp && status == OM_OK; ++g) {
            PhantomTruth t;
            bool is_there;
            status =
                om__phantoms_truth_open(&s->c[i], g, s->coarse, s->def->out_dir, &is_there, &t);
            hash[i] = om_hash(&t.hash, sizeof t.hash, hash[i]);
            if (status == OM_OK && !is_there) task[n++] = (Task){.index = i, .grasp = g};
            om__phantoms_truth_done(&t);
            ++s->sum.nlift;
        }
    }
    s->sum.nnew_truth = n;
    const StudyWork work[] = {{"lifts", n, s->coarse > 1 ? 3 : 20, false},
                              {"estimates", count_missing(s), s->coarse > 1 ? 12 : 60, false}};
    if (status == OM_OK) status = om__study_estimate_tell(work, 2, s->def->nworker, s->progress);
    if (status == OM_OK) status = run_tasks(s, task, n, NULL);
    om_free(task);
    return status;
}

static OmStatus eval_cases(Phantoms* s, const uint64_t* hash) {
    Task* task = om_calloc((size_t)s->ncase, sizeof *task);
    if (!task) return OM_NO_MEMORY;
    int n = 0;
    for (int i = 0; i < s->ncase; ++i) {
        char name[96];
        result_name(&s->c[i], name, sizeof name);
        if (!om__match_load_result(s->def->out_dir, name, hash[i], &s->result[i],
                                   sizeof *s->result))
            task[n++] = (Task){.index = i};
    }
    s->sum.nnew = n;
    OmStatus status = run_tasks(s, task, n, hash);
    om_free(task);
    return status;
}

// ---- rows ---------------------------------------------------------------------------------------------------------

bool om__phantoms_is_in_row(const PhantomCase* c, const PhantomView* v, OmStudyPhantomRow row) {
    switch (row) {
    case OM_STUDY_PHANTOM_LIFT_20: return v->level == 2;
    case OM_STUDY_PHANTOM_LIFT_40: return v->level == 4;
    case OM_STUDY_PHANTOM_LIFT_60: return v->level == 6;
    case OM_STUDY_PHANTOM_FLAT: return c->start == PHANTOM_FLAT;
    case OM_STUDY_PHANTOM_DEFORMED: return c->start == PHANTOM_CAPSULE;
    case OM_STUDY_PHANTOM_GRASPS: return false;
    case OM_STUDY_PHANTOM_TOTAL: return true;
    default: return c->shape == (int)row;
    }
}

typedef struct Column {
    int n;
    double *dsc, *tpr, *ave, *volume;  // (all views)
} Column;

static OmStudyPhantomScore finish(Column* c, bool is_there, int nrefused) {
    OmStudyPhantomScore score = {.is_there = is_there, .nrefused = nrefused};
    if (!is_there) return score;
    score.dsc = om__attach_quartiles(c->dsc, c->n);
    score.tpr = om__attach_quartiles(c->tpr, c->n);
    score.ave = om__attach_quartiles(c->ave, c->n);
    score.volume = om__attach_quartiles(c->volume, c->n);
    return score;
}

static void put(Column* c, double dsc, double tpr, double ave, double volume) {
    c->dsc[c->n] = dsc;
    c->tpr[c->n] = tpr;
    c->ave[c->n] = ave;
    c->volume[c->n++] = volume;
}

// Way w of a row, or with w = OM_STUDY_PHANTOM_NWAY the true attachments.
static OmStudyPhantomScore summarise_way(const Phantoms* s, OmStudyPhantomRow row, int w,
                                         Column* c) {
    bool is_joint = row == OM_STUDY_PHANTOM_GRASPS, is_same = w == OM_STUDY_PHANTOM_NWAY;
    bool is_there = is_same;
    int nrefused = 0;
    c->n = 0;
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        for (int k = 0; k < (is_joint ? r->joint_level > 0 : r->nview); ++k) {
            const PhantomView* v = &r->view[k];
            if (!is_joint && !om__phantoms_is_in_row(&s->c[i], v, row)) continue;
            if (is_same) {
                put(c, 1, 1, is_joint ? r->joint_same_ave : v->same_ave,
                    is_joint ? r->joint_same_volume : v->same_volume);
                continue;
            }
            const PhantomEstimate* e = is_joint ? &r->joint[w] : &v->by[w];
            put(c, e->dsc, e->tpr, e->ave, e->volume);
            is_there = is_there || e->is_there;
            nrefused += !e->is_accepted;
        }
    }
    return finish(c, is_there, nrefused);
}

static void count_all(Phantoms* s, double* rest) {
    OmStudyPhantomsSummary* sum = &s->sum;
    int n = 0;
    sum->ncase = s->ncase;
    sum->has_network = s->net || s->estimate;
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        sum->nview += r->nview;
        sum->nloose += r->nloose;
        for (int g = 0; g < s->c[i].ngrasp; ++g) {
            rest[n++] = r->rest[g];
            sum->nshort += r->nlevel[g] < s->c[i].nlevel[g];
        }
        for (int k = 0; k < r->nview; ++k) {
            const PhantomEstimate* e = &r->view[k].by[OM_STUDY_PHANTOM_NETWORK];
            sum->nlost += e->is_there && e->nlost > 0;
        }
    }
    sum->rest = om__attach_quartiles(rest, n);
}

static void judge_goals(OmStudyPhantomsSummary* sum) {
    const OmStudyPhantomResult *all = &sum->row[OM_STUDY_PHANTOM_TOTAL],
                               *grasps = &sum->row[OM_STUDY_PHANTOM_GRASPS];
    const OmStudyPhantomScore *one = &all->by[OM_STUDY_PHANTOM_ALL],
                              *many = &grasps->by[OM_STUDY_PHANTOM_ALL];
    sum->is_met = one->is_there && many->is_there && one->dsc.median >= OM_STUDY_PHANTOM_DSC &&
                  one->tpr.median >= OM_STUDY_PHANTOM_TPR &&
                  one->ave.median <= all->same.ave.median + OM_STUDY_PHANTOM_AVE &&
                  many->dsc.median >= OM_STUDY_PHANTOM_DSC_GRASPS &&
                  many->tpr.median >= OM_STUDY_PHANTOM_TPR_GRASPS;
}

static OmStatus summarise(Phantoms* s) {
    size_t n = (size_t)s->ncase * PHANTOM_NVIEW;
    double* scratch;
    OM_ALLOC(scratch, 4 * n);
    Column c = {0, scratch, scratch + n, scratch + 2 * n, scratch + 3 * n};
    for (int row = 0; row < OM_STUDY_PHANTOM_NROW; ++row) {
        OmStudyPhantomResult* out = &s->sum.row[row];
        for (int w = 0; w <= OM_STUDY_PHANTOM_NWAY; ++w) {
            OmStudyPhantomScore score = summarise_way(s, (OmStudyPhantomRow)row, w, &c);
            if (w < OM_STUDY_PHANTOM_NWAY) out->by[w] = score;
            if (w == OM_STUDY_PHANTOM_NWAY) out->same = score;
        }
        out->n = c.n;
    }
    count_all(s, scratch);
    judge_goals(&s->sum);
    om_free(scratch);
    return OM_OK;
}

// ---- run ----------------------------------------------------------------------------------------------------------

// The definition's own network, or a file of weights.
static OmStatus open_network(Phantoms* s) {
    const OmStudyPhantomsDef* d = s->def;
    s->network = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    s->estimate = d->estimate;
    s->threshold = d->threshold;
    if (s->estimate) {
        s->network = om_hash(d->estimate_name, strlen(d->estimate_name), s->network);
    } else {
        OM_TRY(om_banet_net_find(d->weights, NULL, &s->net));
        if (!s->net) return OM_OK;
        uint64_t hash = om_banet_net_hash(s->net);
        s->network = om_hash(&hash, sizeof hash, s->network);
        s->network = om_hash(&d->side, sizeof d->side, s->network);
        s->threshold = om_banet_net_threshold(s->net);
    }
    s->network = om_hash(&s->threshold, sizeof s->threshold, s->network);
    return OM_OK;
}

static OmStatus run(Phantoms* s) {
    uint64_t* hash = NULL;
    OmStatus status;
    list_cases(s);
    OM_CALLOC_DONE(s->result, (size_t)s->ncase);
    OM_ALLOC_DONE(hash, (size_t)s->ncase);
    OM_TRY_DONE(make_lifts(s, hash));
    OM_TRY_DONE(eval_cases(s, hash));
    OM_TRY_DONE(summarise(s));
    status = om__phantoms_write(s);
done:
    om_free(hash);
    return status;
}

OmStatus om_study_phantoms_run(const OmStudyPhantomsDef* def, const OmProgress* progress,
                               OmStudyPhantomsSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Phantoms s = {.def = def, .progress = progress, .coarse = def->is_quick ? COARSE : 1};
    OmFolder folder = {0};
    OmStatus status;
    OM_CALLOC_DONE(s.c, PHANTOM_MAX_LIFT);
    OM_TRY_DONE(open_network(&s));
    OM_TRY_DONE(om_folder_open(def->out_dir, "phantoms study", &folder));
    status = run(&s);
    if (status == OM_OK) *summary = s.sum;
done:
    om_folder_end(&folder);
    om_banet_net_destroy(s.net);
    om_free(s.c);
    om_free(s.result);
    return status;
}
