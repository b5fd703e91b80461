// study_trust.c: updates from right and from wrong acquisitions of simulated sheets.
//
// 1. Truths that the folder lacks are simulated (study_trust_case.c). TRUST_OTHER shows the truth before, so one truth
//    needs a second one.
// 2. Each truth is judged with an OmMatch of its own: every lift right and with the error of its case, and every lift
//    but the last together with the next one of other tissue.
//
// Truths are independent of each other, and as many run at once as there are workers.
#include "studies/study_trust.h"

#include <string.h>

#include "omentum/match_acquisition.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_cases.h"
#include "studies/study_match_case.h"
#include "studies/study_trust_internal.h"

#define COOKIE 0x57d78057u
#define DEVELOPMENT 1  // seed with which thresholds of om_match_update were chosen
#define QUICK_CELLS 8

OmStudyTrustDef om_study_trust_default_def(const char* out_dir) {
    return (OmStudyTrustDef){
        .out_dir = out_dir, .ntruth = 100, .draw = {.kind = OM_DRAW_DEVELOPMENT}, .cookie = COOKIE};
}

static OmStatus validate(const OmStudyTrustDef* d) {
    const StudyRange range[] = {{"ntruth", d->ntruth, 1, OM_STUDY_TRUST_MAX_TRUTH}};
    OM_TRY(STUDY_CHECK("trust study", d, COOKIE, range));
    OM_CHECK(d->draw.kind != OM_DRAW_PUBLISHED, OM_INVALID,
             "trust study: draw is none of development and judged");
    return OM_OK;
}

// ---- one truth ------------------------------------------------------------------------------------------------------

typedef struct Bench {
    const TrustTruth *truth, *other;
    const OmMeshSet* under;
    OmMatch* match;
    TrustResult* r;
} Bench;

typedef struct Shown {  // an acquisition
    int lift;
    TrustCase c;
} Shown;

static void take_estimate(const Bench* b, int n, const OmMatchEstimate* e, TrustUpdate* u) {
    const OmMatchVerdict* last = &e->verdict[n - 1];
    double tpr;
    u->is_accepted = e->is_accepted;
    for (int k = 0; k < n; ++k) u->is_moved |= e->verdict[k].is_moved;
    u->cause = (int)last->cause;
    u->is_left_out = n > 1 && !last->is_good;
    u->judge_ms = e->judge_ms;
    snprintf(u->reason, sizeof u->reason, "%s", e->reason[0] ? e->reason : last->reason);
    for (int i = 0; i < b->r->nnode; ++i) {
        int v = b->under->vert[i];
        u->probability[i] = (float)e->probability[v];
        u->attached[i] = e->attached[v];
    }
    om__attach_score(b->r->nnode, NULL, u->attached, b->r->truth, &u->dice, &tpr);
}

// An acquisition that is not valid is refused as well: it does not reach the twin.
static OmStatus refuse_invalid(OmStatus status, TrustUpdate* u) {
    if (status != OM_INVALID) return status;
    snprintf(u->reason, sizeof u->reason, "%s", om_error_message());
    return OM_OK;
}

static OmStatus update(const Bench* b, int n, const Shown* shown, TrustUpdate* u) {
    OmAcquisition acquisition[2];
    OmScan rest[2];
    OmMatchEstimate estimate = {0};
    OmStatus status = OM_OK;
    int made = 0;
    for (int k = 0; k < n; ++k)
        if (shown[k].c.error == TRUST_OTHER && shown[k].lift >= b->other->nlift) return OM_OK;
    u->is_there = 1;
    for (; made < n && status == OM_OK; made += status == OM_OK) {
        status = om__trust_acquire(b->truth, shown[made].lift, &shown[made].c, b->other,
                                   &acquisition[made], &rest[made]);
        acquisition[made].rest = &rest[made];
    }
    double begin = om__attach_thread_ms();
    if (status == OM_OK) status = om_match_update(b->match, n, acquisition, NULL, &estimate);
    u->ms = om__attach_thread_ms() - begin;
    if (status == OM_OK) take_estimate(b, n, &estimate, u);
    om_match_estimate_done(&estimate);
    for (int k = 0; k < made; ++k) {
        om_acquisition_done(&acquisition[k]);
        om_scan_done(&rest[k]);
    }
    return refuse_invalid(status, u);
}

static OmStatus judge(Bench* b, uint64_t seed) {
    TrustResult* r = b->r;
    const TrustTruth* t = b->truth;
    OM_CHECK(b->under && b->under->nvert <= TRUST_MAX_NODE, OM_INVALID,
             "the underside has no vertex or more than %d", TRUST_MAX_NODE);
    r->nnode = b->under->nvert;
    r->nlift = t->nlift;
    r->share = t->share;
    memcpy(r->height, t->height, sizeof r->height);
    for (int i = 0; i < r->nnode; ++i) r->truth[i] = t->attached[b->under->vert[i]];
    for (int k = 0; k < r->nlift; ++k) {
        r->c[k] = om__trust_case(seed, TRUST_NLIFT * t->number + k);
        const Shown right = {.lift = k}, wrong = {k, r->c[k]};
        OM_TRY(update(b, 1, &right, &r->right[k]));
        OM_TRY(update(b, 1, &wrong, &r->wrong[k]));
    }
    for (int k = 0; k + 1 < r->nlift; ++k) {
        const Shown two[] = {{.lift = k}, {k + 1, {.error = TRUST_OTHER}}};
        OM_TRY(update(b, 2, two, &r->two[k]));
    }
    return OM_OK;
}

static int other_of(int number) { return number > 0 ? number - 1 : 1; }

static OmStatus judge_truth(void* ctx, int number, void* result) {
    const Trust* s = ctx;
    TrustTruth truth = {0}, other = {0};
    OmMatchDef def;
    OmStatus status;
    Bench b = {.truth = &truth, .other = &other, .r = result};
    const char* dir = s->def->out_dir;
    OM_TRY_DONE(om__trust_truth_get(s->seed, number, s->cells, dir, 1, &truth));
    OM_TRY_DONE(om__trust_truth_get(s->seed, other_of(number), s->cells, dir, 1, &other));
    b.under = om_tet_mesh_find_set(&truth.twin.mesh, "underside");
    def = om_match_default_def(&truth.scene, &truth.twin);
    OM_TRY_DONE(om_match_create(&def, &b.match));
    status = judge(&b, s->seed);
done:
    om_match_destroy(b.match);
    om__trust_truth_done(&truth);
    om__trust_truth_done(&other);
    return status < 0 ? om_error_prefix(status, "truth %d", number) : OM_OK;
}

// ---- all truths -----------------------------------------------------------------------------------------------------

static OmStatus name_result(const void* ctx, int number, char name[64], uint64_t* hash) {
    const Trust* s = ctx;
    const uint64_t own[] = {TRUST_METHOD, s->seed, (uint64_t)number};
    const int truth[2] = {number, other_of(number)};
    snprintf(name, 64, "trust-%03d.bin", number);
    *hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    *hash = om_hash(own, sizeof own, *hash);
    for (int k = 0; k < 2; ++k) {
        uint64_t scene;
        OM_TRY(om__trust_scene_hash(s->seed, truth[k], s->cells, &scene));
        *hash = om_hash(&scene, sizeof scene, *hash);
    }
    return OM_OK;
}

static OmStatus make_truth(void* ctx, int k) {
    const Trust* s = ctx;
    TrustTruth truth;
    OM_TRY(om__trust_truth_get(s->seed, s->needed[k], s->cells, s->def->out_dir, 1, &truth));
    om__trust_truth_done(&truth);
    return OM_OK;
}

// The truths of missing results, and the other tissue of each: in s->needed, ascending. Returns how many have no file.
static int find_needed(Trust* s, const StudyCases* c) {
    bool is_needed[OM_STUDY_TRUST_MAX_TRUTH + 1] = {false};
    int nmissing = 0;
    for (int k = 0; k < c->nmissing; ++k)
        is_needed[c->missing[k]] = is_needed[other_of(c->missing[k])] = true;
    for (int i = 0; i <= OM_STUDY_TRUST_MAX_TRUTH; ++i) {
        char name[64];
        if (!is_needed[i]) continue;
        s->needed[s->nneeded++] = i;
        snprintf(name, sizeof name, "truth-%03d.bin", i);
        nmissing += !om__study_has_file(s->def->out_dir, name);
    }
    return nmissing;
}

static OmStatus make(Trust* s) {
    const OmStudyTrustDef* d = s->def;
    const int nworker = om_worker_count(d->nworker);
    StudyCases c = {.dir = d->out_dir,
                    .what = "updates",
                    .n = s->ntruth,
                    .nworker = d->nworker,
                    .size = sizeof *s->result,
                    .result = s->result,
                    .ctx = s,
                    .name = name_result,
                    .make = judge_truth};
    OmStatus status;
    OM_TRY_DONE(om__cases_find(&c));
    s->sum.nnew = c.nmissing;
    const StudyWork work[] = {{"truths", find_needed(s, &c), d->is_quick ? 2.5 : 4, false},
                              {"sets of updates", c.nmissing, d->is_quick ? 4.5 : 9, false}};
    OM_TRY_DONE(om__study_estimate_tell(work, 2, d->nworker, s->progress));
    OM_TRY_DONE(om__study_each(s->nneeded, nworker, nworker, make_truth, s, "truths", s->progress));
    status = om__cases_make(&c, s->progress);
done:
    om__cases_done(&c);
    return status;
}

static OmStatus record_draw(const Trust* s) {
    const OmStudyTrustSummary* sum = &s->sum;
    char cases[48], result[64];
    if (!s->def->draws) return OM_OK;
    snprintf(cases, sizeof cases, "0-%d%s", s->ntruth - 1, s->def->is_quick ? " quick" : "");
    snprintf(result, sizeof result, "%d of %d accepted", sum->nright - sum->nright_refused,
             sum->nright);
    OM_TRY(om_study_draw_append(s->def->draws, &s->def->draw, "trust", "right", cases, result));
    snprintf(result, sizeof result, "%d of %d harmless", sum->nwrong - sum->nbad, sum->nwrong);
    OM_TRY(om_study_draw_append(s->def->draws, &s->def->draw, "trust", "wrong", cases, result));
    snprintf(result, sizeof result, "ECE %.4f Brier %.4f", sum->all.ece, sum->all.brier);
    return om_study_draw_append(s->def->draws, &s->def->draw, "trust", "probability", cases,
                                result);
}

OmStatus om_study_trust_run(const OmStudyTrustDef* def, const OmProgress* progress,
                            OmStudyTrustSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Trust s = {.def = def,
               .progress = progress,
               .seed = def->draw.kind == OM_DRAW_JUDGED ? def->draw.seed : DEVELOPMENT,
               .ntruth = def->ntruth,
               .cells = def->is_quick ? QUICK_CELLS : TRUST_CELLS};
    if (def->is_quick && s.ntruth > TRUST_QUICK_TRUTHS) s.ntruth = TRUST_QUICK_TRUTHS;
    OmFolder folder = {0};
    OmStatus status;
    OM_CALLOC_DONE(s.result, s.ntruth);
    OM_TRY_DONE(om_folder_open(def->out_dir, "trust study", &folder));
    OM_TRY_DONE(make(&s));
    OM_TRY_DONE(om__trust_summarise(s.ntruth, s.result, &s.sum));
    OM_TRY_DONE(om__trust_write(&s));
    OM_TRY_DONE(record_draw(&s));
    *summary = s.sum;
done:
    om_folder_end(&folder);
    om_free(s.result);
    return status;
}
