// study_phantoms.c: Table 4.2: lifts of phantoms in the world, estimates at every step, and their rows.
//
// Lifts and configurations are independent of each other, and as many run at once as there are workers. A configuration
// is evaluated again if a lift, the network or the method changes.
#include <float.h>
#include <math.h>
#include <string.h>

#include "omentum/banet_net.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_cases.h"
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
    const StudyRange range[] = {{"ncase", d->ncase, 0, PHANTOM_MAX_CASE},
                                {"ngrasp", d->ngrasp, 0, PHANTOM_NGRASP},
                                {"side", d->side, 0, 10},
                                {"threshold", d->threshold, DBL_MIN, 1 - DBL_EPSILON}};
    OM_TRY(STUDY_CHECK("phantoms study", d, COOKIE, range));
    OM_CHECK(d->estimate_name, OM_INVALID, "phantoms study: estimate_name is null");
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

// ---- lifts and estimates ----------------------------------------------------------------------------------------

// List the lifts that the folder does not have. s->hash: of each configuration's lifts, network and method.
static OmStatus find_lifts(Phantoms* s) {
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomShape* shape = &om__phantoms_shape[s->c[i].shape];
        const double twin[] = {PHANTOM_METHOD, s->coarse, shape->edge, shape->young,
                               shape->density};
        s->hash[i] = om_hash(twin, sizeof twin, s->network);
        for (int g = 0; g < s->c[i].ngrasp; ++g) {
            PhantomTruth t;
            bool is_there;
            OM_TRY(om__phantoms_truth_open(&s->c[i], g, s->coarse, s->def->out_dir, &is_there, &t));
            s->hash[i] = om_hash(&t.hash, sizeof t.hash, s->hash[i]);
            if (!is_there) s->lift[s->nlift++] = PHANTOM_NGRASP * i + g;
            om__phantoms_truth_done(&t);
            ++s->sum.nlift;
        }
    }
    s->sum.nnew_truth = s->nlift;
    return OM_OK;
}

static OmStatus make_lift(void* ctx, int k) {
    const Phantoms* s = ctx;
    const PhantomCase* c = &s->c[s->lift[k] / PHANTOM_NGRASP];
    const int grasp = s->lift[k] % PHANTOM_NGRASP;
    PhantomTruth t;
    bool is_there;
    OM_TRY(om__phantoms_truth_open(c, grasp, s->coarse, s->def->out_dir, &is_there, &t));
    OmStatus status = om__phantoms_truth_make(c, grasp, 1, &t);
    if (status == OM_OK) status = om__phantoms_truth_save(&t, s->def->out_dir);
    om__phantoms_truth_done(&t);
    return status;
}

static OmStatus name_case(const void* ctx, int i, char name[64], uint64_t* hash) {
    const Phantoms* s = ctx;
    char text[48];
    om__phantoms_name(&s->c[i], text, sizeof text);
    snprintf(name, 64, "case-%s.bin", text);
    *hash = s->hash[i];
    return OM_OK;
}

static OmStatus eval_case(void* ctx, int i, void* result) {
    const Phantoms* s = ctx;
    return om__phantoms_eval(s, &s->c[i], result);
}

static OmStatus make_cases(Phantoms* s) {
    const int nworker = om_worker_count(s->def->nworker);
    StudyCases c = {.dir = s->def->out_dir,
                    .what = "estimates",
                    .n = s->ncase,
                    .nworker = s->def->nworker,
                    .size = sizeof *s->result,
                    .result = s->result,
                    .ctx = s,
                    .name = name_case,
                    .make = eval_case};
    OmStatus status;
    OM_TRY_DONE(find_lifts(s));
    OM_TRY_DONE(om__cases_find(&c));
    s->sum.nnew = c.nmissing;
    const StudyWork work[] = {{"lifts", s->nlift, s->coarse > 1 ? 3 : 20, false},
                              {"estimates", c.nmissing, s->coarse > 1 ? 12 : 60, false}};
    OM_TRY_DONE(om__study_estimate_tell(work, 2, s->def->nworker, s->progress));
    OM_TRY_DONE(om__study_each(s->nlift, nworker, nworker, make_lift, s, "lifts", s->progress));
    status = om__cases_make(&c, s->progress);
done:
    om__cases_done(&c);
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

// Way w of a row, or with w = OM_STUDY_PHANTOM_NWAY the true attachments; n: views of the row.
static OmStatus summarise_way(const Phantoms* s, OmStudyPhantomRow row, int w, int* n,
                              OmStudyPhantomScore* score) {
    const bool is_joint = row == OM_STUDY_PHANTOM_GRASPS, is_same = w == OM_STUDY_PHANTOM_NWAY;
    StudyColumns c = {0};
    *n = 0;
    *score = (OmStudyPhantomScore){.is_there = is_same};
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        for (int k = 0; k < (is_joint ? r->joint_level > 0 : r->nview); ++k) {
            const PhantomView* v = &r->view[k];
            if (!is_joint && !om__phantoms_is_in_row(&s->c[i], v, row)) continue;
            ++*n;
            if (is_same) {
                om__columns_add(&c, 4,
                                (double[]){1, 1, is_joint ? r->joint_same_ave : v->same_ave,
                                           is_joint ? r->joint_same_volume : v->same_volume});
                continue;
            }
            const PhantomEstimate* e = is_joint ? &r->joint[w] : &v->by[w];
            if (e->is_there) om__columns_add(&c, 4, (double[]){e->dsc, e->tpr, e->ave, e->volume});
            score->is_there = score->is_there || e->is_there;
            score->nrefused += !e->is_accepted;
        }
    }
    return om__columns_end(&c, 4,
                           (StudySample*[]){&score->dsc, &score->tpr, &score->ave, &score->volume});
}

static OmStatus count_all(Phantoms* s) {
    OmStudyPhantomsSummary* sum = &s->sum;
    StudyColumns rest = {0};
    sum->ncase = s->ncase;
    sum->has_network = s->net || s->estimate;
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        sum->nview += r->nview;
        sum->nloose += r->nloose;
        for (int g = 0; g < s->c[i].ngrasp; ++g) {
            om__column_add(&rest, 0, r->rest[g]);
            sum->nshort += r->nlevel[g] < s->c[i].nlevel[g];
        }
        for (int k = 0; k < r->nview; ++k) {
            const PhantomEstimate* e = &r->view[k].by[OM_STUDY_PHANTOM_NETWORK];
            sum->nlost += e->is_there && e->nlost > 0;
        }
    }
    return om__columns_end(&rest, 1, (StudySample*[]){&sum->rest});
}

StudyGoals om__phantoms_goals(const OmStudyPhantomsSummary* sum) {
    const OmStudyPhantomResult* all = &sum->row[OM_STUDY_PHANTOM_TOTAL];
    const OmStudyPhantomScore *one = &all->by[OM_STUDY_PHANTOM_ALL],
                              *many = &sum->row[OM_STUDY_PHANTOM_GRASPS].by[OM_STUDY_PHANTOM_ALL];
    const double none = one->is_there && many->is_there ? 0 : (double)NAN;
    return (StudyGoals){5,
                        {{"every step: median DSC", "%.2f", one->dsc.median + none,
                          OM_STUDY_PHANTOM_DSC, false, "0.41"},
                         {"every step: median TPR", "%.0f %%", 100 * one->tpr.median + none,
                          100 * OM_STUDY_PHANTOM_TPR, false, "72 %"},
                         {"every step: median AVE", "%.1f mm", 1e3 * one->ave.median + none,
                          1e3 * (all->same.ave.median + OM_STUDY_PHANTOM_AVE), true},
                         {"several grasps: median DSC", "%.2f", many->dsc.median + none,
                          OM_STUDY_PHANTOM_DSC_GRASPS, false, "0.50"},
                         {"several grasps: median TPR", "%.0f %%", 100 * many->tpr.median + none,
                          100 * OM_STUDY_PHANTOM_TPR_GRASPS, false, "52 %"}}};
}

static OmStatus summarise(Phantoms* s) {
    for (int row = 0; row < OM_STUDY_PHANTOM_NROW; ++row) {
        OmStudyPhantomResult* out = &s->sum.row[row];
        for (int w = 0; w <= OM_STUDY_PHANTOM_NWAY; ++w)
            OM_TRY(summarise_way(s, (OmStudyPhantomRow)row, w, &out->n,
                                 w < OM_STUDY_PHANTOM_NWAY ? &out->by[w] : &out->same));
    }
    OM_TRY(count_all(s));
    s->sum.is_met = om__goals_met(om__phantoms_goals(&s->sum));
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

OmStatus om_study_phantoms_run(const OmStudyPhantomsDef* def, const OmProgress* progress,
                               OmStudyPhantomsSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Phantoms s = {.def = def, .progress = progress, .coarse = def->is_quick ? COARSE : 1};
    OmFolder folder = {0};
    OmStatus status;
    OM_TRY_DONE(open_network(&s));
    OM_TRY_DONE(om_folder_open(def->out_dir, "phantoms study", &folder));
    list_cases(&s);
    OM_CALLOC_DONE(s.result, (size_t)s.ncase);
    OM_TRY_DONE(make_cases(&s));
    OM_TRY_DONE(summarise(&s));
    OM_TRY_DONE(om__phantoms_write(&s));
    *summary = s.sum;
done:
    om_folder_end(&folder);
    om_banet_net_destroy(s.net);
    om_free(s.result);
    return status;
}
