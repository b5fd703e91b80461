// study_simulated.c: Table 4.1: BA-Net on samples of the generator with seeds of their own.
//
// Samples are independent, and several are made, scored and simulated in parallel; each network has one thread, as
// its bytes depend on their number. Samples, results without the network, and results of the network are one file each:
// other weights repeat the last alone.
//
// Grasped vertices share the force of the truth, and their true displacement drives the simulation of the same mesh and
// law. The equilibrium with the true attachments is then that of the truth, up to tolerances and folds: AVE of Same is
// smaller than in the thesis (0.6 mm), and AVE shows attachments alone.
#include <string.h>

#include "omentum/banet_fuse.h"
#include "omentum/banet_net.h"
#include "studies/study_cases.h"
#include "studies/study_internal.h"
#include "studies/study_match_case.h"
#include "studies/study_simulated_internal.h"

#define COOKIE 0x51b41a7eu
#define NSAMPLE 380
#define QUICK_SEED 40
#define BATCH 4             // samples of a worker
#define SECONDS_SAMPLE 2.2  // processor time, for the estimate

const char* const om__sim_set_name[SIM_NSET] = {"exact", "camera", "board", "two"};
const char* const om__sim_set_title[SIM_NSET] = {"Test (a), exact displacements",
                                                 "Test (b), depth camera",
                                                 "on a board, under gravity", "two regions"};
const char* const om__sim_guess_name[SIM_NGUESS] = {"zero", "all", "same", "net"};
const char* const om__sim_guess_title[SIM_NGUESS] = {"Zero: none", "All: the lowest side",
                                                     "Same: the true ones", "Network"};

OmStudySimulatedDef om_study_simulated_default_def(const char* out_dir) {
    return (OmStudySimulatedDef){
        .out_dir = out_dir, .nsample = NSAMPLE, .nsolve = -1, .cookie = COOKIE};
}

static OmStatus validate(const OmStudySimulatedDef* d) {
    const StudyRange range[] = {{"nsample", d->nsample, 1, 9999}, {"nsolve", d->nsolve, -1, 9999}};
    return STUDY_CHECK("simulated study", d, COOKIE, range);
}

// The test sets of the generator; nothing is chosen on them. A quick study has small bodies and other seeds.
static OmBanetSampleDef define_set(const OmStudySimulatedDef* d, int set) {
    OmBanetSampleDef def = om_banet_data_test_def((OmBanetTest)set, d->out_dir).sample;
    if (d->is_quick) {
        def.seed = QUICK_SEED + (uint64_t)set;
        def.extent[0] = 0.06;
        def.extent[1] = 0.08;
        def.thickness[1] = 0.01;
    }
    return def;
}

// ---- the network ---------------------------------------------------------------------------------------

static OmStatus load_net(Sim* s) {
    OM_TRY(om_banet_net_find(s->def->weights, NULL, &s->net));
    s->sum.has_net = s->net != NULL;
    if (!s->net) return OM_OK;
    s->net_hash = om_banet_net_hash(s->net);
    return OM_OK;
}

OmStatus om__sim_net_estimate(const Sim* s, SimBody* body, double* probability) {
    const OmBanetSample* sample = body->sample;
    OM_TRY(om_banet_estimate(s->net, body->side, &sample->surface, sample->u, sample->seen,
                             probability));
    double threshold;
    OM_TRY(
        om_banet_choose_threshold(sample->surface.nvert, probability, OM_BANET_NEARLY, &threshold));
    for (int i = 0; i < sample->surface.nvert; ++i) body->guess[i] = probability[i] >= threshold;
    return OM_OK;
}

// ---- one sample -----------------------------------------------------------------------------------------

// Hash of everything that a sample depends on.
static uint64_t hash_sample(const Sim* s, const SimCase* c) {
    const int number[2] = {SIM_METHOD, c->index};
    const uint64_t def = om_banet_sample_def_hash(&s->sample_def[c->set]);
    uint64_t hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    hash = om_hash(&def, sizeof def, hash);
    return om_hash(number, sizeof number, hash);
}

static uint64_t hash_base(const Sim* s, const SimCase* c) {
    const int solved = c->index < s->nsolve[c->set];
    return om_hash(&solved, sizeof solved, hash_sample(s, c));
}

static uint64_t hash_net(const Sim* s, const SimCase* c) {
    return om_hash(&s->net_hash, sizeof s->net_hash, hash_base(s, c));
}

typedef char Name[64];
static const char* file_name(const SimCase* c, const char* what, Name name) {
    snprintf(name, sizeof(Name), "%s-%s-%04d.bin", what, om__sim_set_name[c->set], c->index + 1);
    return name;
}

OmStatus om__sim_sample_get(const Sim* s, const SimCase* c, OmBanetSample* sample) {
    Name name;
    const uint64_t hash = hash_sample(s, c);
    file_name(c, "sample", name);
    if (om__sim_sample_load(s->def->out_dir, name, hash, sample)) return OM_OK;
    OmStatus status = om_banet_sample_make(&s->sample_def[c->set], c->index, sample);
    return status == OM_OK ? om__sim_sample_save(s->def->out_dir, name, hash, sample) : status;
}

// Scores and simulations that need no network.
static OmStatus make_base(const Sim* s, SimCase* c, SimBody* body) {
    SimBase* base = &c->base;
    const OmBanetSample* sample = body->sample;
    base->is_made = 1;
    base->is_camera = sample->is_camera;
    base->nregion = sample->nregion;
    base->nvert = sample->mesh.nvert;
    base->share = sample->share;
    base->visible = sample->visible;
    base->input = sample->max_u;
    base->young = sample->material.young;
    base->poisson = sample->material.poisson;
    base->seconds = sample->seconds;
    for (int guess = 0; guess < OM_STUDY_SIM_NET; ++guess) {
        OM_TRY(om__sim_body_guess(body, (OmStudySimulatedGuess)guess));
        OM_TRY(om__sim_body_score(body, &base->score[guess]));
        if (c->index < s->nsolve[c->set]) OM_TRY(om__sim_body_move(body, &base->move[guess]));
    }
    return OM_OK;
}

static OmStatus estimate(const Sim* s, SimCase* c, SimBody* body) {
    double* probability;
    OM_ALLOC(probability, (size_t)body->sample->surface.nvert);
    double begin = om__attach_thread_ms();
    OmStatus status;
    OM_TRY_DONE(om__sim_net_estimate(s, body, probability));
    c->net->ms = om__attach_thread_ms() - begin;
    OM_TRY_DONE(om__sim_body_cells(body, probability, c->net));
    OM_TRY_DONE(om__sim_body_score(body, &c->net->score));
    if (c->index < s->nsolve[c->set]) status = om__sim_body_move(body, &c->net->move);
done:
    om_free(probability);
    return status;
}

static OmStatus eval_sample(const Sim* s, SimCase* c, const OmBanetSample* sample, SimBody* body) {
    Name name;
    const char* dir = s->def->out_dir;
    if (sample) OM_TRY(om__sim_body_make(sample, s->sample_def[c->set].side, body));
    if (!c->has_base) {
        memset(&c->base, 0, sizeof c->base);
        if (sample) OM_TRY(make_base(s, c, body));
        OM_TRY(om__match_save_result(dir, file_name(c, "base", name), hash_base(s, c), &c->base,
                                     sizeof c->base));
        c->has_base = true;
    }
    if (!s->net || !sample) return OM_OK;
    OM_TRY(estimate(s, c, body));
    c->has_net = true;
    return om__match_save_result(dir, file_name(c, "net", name), hash_net(s, c), c->net,
                                 sizeof *c->net);
}

// Without a draw base.is_made is 0.
static OmStatus run_case(void* ctx, int k) {
    const Sim* s = ctx;
    SimCase* c = &s->c[s->order[k]];
    OmBanetSample sample = {0};
    SimBody body = {0};
    OmStatus status = om__sim_sample_get(s, c, &sample);
    if (status >= 0) status = eval_sample(s, c, status == OM_OK ? &sample : NULL, &body);
    om__sim_body_done(&body);
    om_banet_sample_done(&sample);
    if (status >= 0) return OM_OK;
    return om_error_prefix(status, "sample %d of the set \"%s\"", c->index + 1,
                           om__sim_set_name[c->set]);
}

// ---- all samples ------------------------------------------------------------------------------------------

static OmStatus make_cases(Sim* s) {
    for (int set = 0; set < SIM_NSET; ++set) {
        int n = set <= OM_STUDY_SIM_CAMERA ? s->def->nsample : (s->def->nsample + 1) / 2;
        s->sample_def[set] = define_set(s->def, set);
        s->nsample[set] = s->def->is_quick ? 2 : n;
        s->nsolve[set] = s->def->nsolve < 0 ? s->nsample[set] : s->def->nsolve;
        s->ncase += s->nsample[set];
    }
    s->c = om_calloc((size_t)s->ncase, sizeof *s->c);
    if (!s->c) return OM_NO_MEMORY;
    SimCase* c = s->c;
    for (int set = 0; set < SIM_NSET; ++set)
        for (int i = 0; i < s->nsample[set]; ++i, ++c) {
            Name name;
            c->set = set;
            c->index = i;
            c->net = om_calloc(1, sizeof *c->net);
            if (!c->net) return OM_NO_MEMORY;
            c->has_base = om__match_load_result(s->def->out_dir, file_name(c, "base", name),
                                                hash_base(s, c), &c->base, sizeof c->base);
            if (s->net)
                c->has_net =
                    c->has_base && om__match_load_result(s->def->out_dir, file_name(c, "net", name),
                                                         hash_net(s, c), c->net, sizeof *c->net);
        }
    return OM_OK;
}

// In the order of samples, sets in turn: a study that was stopped has the first samples of each set.
static int next_case(const Sim* s, int from, int* order) {
    int n = 0;
    for (int index = from;; ++index) {
        int first = 0, left = 0;
        for (int set = 0; set < SIM_NSET; first += s->nsample[set++]) {
            if (index >= s->nsample[set]) continue;
            ++left;
            order[n++] = first + index;
        }
        if (!left) return n;
    }
}

static bool is_done(const Sim* s, const SimCase* c) {
    return c->has_base && (!s->net || c->has_net || !c->base.is_made);
}

static OmStatus run_cases(Sim* s) {
    const int nworker = om_worker_count(s->def->nworker);
    int n = 0;
    OM_ALLOC(s->order, (size_t)s->ncase);
    const int nall = next_case(s, 0, s->order);
    for (int k = 0; k < nall; ++k)
        if (!is_done(s, &s->c[s->order[k]])) s->order[n++] = s->order[k];
    s->sum.nnew = n;
    const StudyWork work = {"samples", n, SECONDS_SAMPLE, true};
    OM_TRY(om__study_estimate_tell(&work, 1, nworker, s->progress));
    return om__study_each(n, BATCH * nworker, nworker, run_case, s, "samples", s->progress);
}

// ---- summary ----------------------------------------------------------------------------------------------

static const SimScore* score_of(const SimCase* c, int guess) {
    return guess == OM_STUDY_SIM_NET ? &c->net->score : &c->base.score[guess];
}
static const SimMove* move_of(const SimCase* c, int guess) {
    return guess == OM_STUDY_SIM_NET ? &c->net->move : &c->base.move[guess];
}

static OmStatus summarise_row(const Sim* s, int set, bool is_hidden, int guess,
                              OmStudySimulatedRow* row) {
    StudyColumns v = {0};
    for (int i = 0; i < s->ncase; ++i) {
        const SimCase* c = &s->c[i];
        if (c->set != set || !c->base.is_made || (is_hidden && c->base.visible >= 0.5)) continue;
        if (guess == OM_STUDY_SIM_NET && !c->has_net) continue;
        const SimScore* score = score_of(c, guess);
        const SimMove* move = move_of(c, guess);
        om__columns_add(&v, 4,
                        (double[]){score->dsc, score->tpr, score->dsc_area, score->tpr_area});
        if (!move->is_there) continue;
        om__column_add(&v, 4, move->ave);
        om__column_add(&v, 5, move->mve);
        row->nstopped += move->is_stopped;
    }
    return om__columns_end(&v, 6,
                           (StudySample*[]){&row->dsc, &row->tpr, &row->dsc_area, &row->tpr_area,
                                            &row->ave, &row->mve});
}

// Reliability over the cells of a set.
static OmStatus calibrate(Sim* s, int set) {
    _Static_assert(OM_STUDY_SIM_NBIN == OM_BANET_NBIN, "bins of the network's own evaluation");
    int64_t n = 0, at = 0;
    for (int i = 0; i < s->ncase; ++i)
        if (s->c[i].set == set && s->c[i].has_net) n += s->c[i].net->ncell;
    if (n == 0) return OM_OK;
    double* said = om_alloc((size_t)n, sizeof *said);
    unsigned char* is_true = om_alloc((size_t)n, 1);
    OmStatus status = said && is_true ? OM_OK : OM_NO_MEMORY;
    for (int i = 0; i < s->ncase && status == OM_OK; ++i) {
        const SimNet* net = s->c[i].net;
        for (int k = 0; s->c[i].set == set && s->c[i].has_net && k < net->ncell; ++k) {
            said[at] = (double)net->probability[k];
            is_true[at++] = net->is_true[k];
        }
    }
    if (status == OM_OK)
        status = om_banet_reliability(n, said, is_true, s->sum.bin_said[set], s->sum.bin_true[set],
                                      &s->sum.ece[set]);
    om_free(said);
    om_free(is_true);
    return status;
}

StudyGoals om__sim_goals(const OmStudySimulatedSummary* sum) {
    static const char* const what[2][3] = {
        {"Test (a): median DSC", "Test (a): median TPR", "Test (a): median AVE"},
        {"TestV (a): median DSC", "TestV (a): median TPR", "TestV (a): median AVE"}};
    static const char* const thesis[2][3] = {{"0.82", "86 %", "1.1 mm"},
                                             {"0.76", "83 %", "1.2 mm"}};
    const double dsc[2] = {OM_STUDY_SIM_DSC[OM_STUDY_SIM_EXACT], OM_STUDY_SIM_DSC_V};
    const double tpr[2] = {OM_STUDY_SIM_TPR, OM_STUDY_SIM_TPR_V};
    StudyGoals goals = {0};
    StudyGoal* g = goals.goal;
    for (int k = 0; k < 2; ++k) {  // all samples, and those of which less than half is visible
        const OmStudySimulatedRow* row =
            k ? sum->hidden[OM_STUDY_SIM_EXACT] : sum->all[OM_STUDY_SIM_EXACT];
        const OmStudySimulatedRow* net = &row[OM_STUDY_SIM_NET];
        const double none = net->dsc.n && net->ave.n ? 0 : (double)NAN;
        const double most = 1e3 * (row[OM_STUDY_SIM_SAME].ave.median + OM_STUDY_SIM_AVE);
        *g++ = (StudyGoal){what[k][0], "%.2f", net->dsc.median + none, dsc[k], false, thesis[k][0]};
        *g++ = (StudyGoal){what[k][1],   "%.0f %%", 100 * net->tpr.median + none,
                           100 * tpr[k], false,     thesis[k][1]};
        *g++ = (StudyGoal){what[k][2], "%.2f mm", 1e3 * net->ave.median + none,
                           most,       true,      thesis[k][2]};
    }
    const double* ece = &sum->ece[OM_STUDY_SIM_EXACT];
    *g++ =
        (StudyGoal){"Test (a): expected calibration error", "%.3f", *ece, OM_STUDY_SIM_ECE, true};
    static const char* const other[] = {"Test (b): median DSC", "on a board: median DSC",
                                        "two regions: median DSC"};
    for (int set = OM_STUDY_SIM_CAMERA; set < SIM_NSET; ++set)
        *g++ = (StudyGoal){other[set - 1], "%.2f", sum->all[set][OM_STUDY_SIM_NET].dsc.median,
                           OM_STUDY_SIM_DSC[set]};
    goals.n = (int)(g - goals.goal);
    return goals;
}

static OmStatus summarise_set(Sim* s, int set) {
    OmStudySimulatedSummary* sum = &s->sum;
    StudyColumns v = {0};
    StudySample input;
    sum->nsample[set] = s->nsample[set];
    for (int i = 0; i < s->ncase; ++i) {
        if (s->c[i].set != set) continue;
        sum->nlost[set] += !s->c[i].base.is_made;
        if (s->c[i].base.is_made) om__column_add(&v, 0, s->c[i].base.input);
    }
    OM_TRY(om__columns_end(&v, 1, (StudySample*[]){&input}));
    sum->input[set] = input.median;
    for (int guess = 0; guess < SIM_NGUESS; ++guess) {
        OM_TRY(summarise_row(s, set, false, guess, &sum->all[set][guess]));
        OM_TRY(summarise_row(s, set, true, guess, &sum->hidden[set][guess]));
    }
    return calibrate(s, set);
}

static OmStatus summarise(Sim* s) {
    StudyColumns v = {0};
    StudySample net, solve;
    for (int set = 0; set < SIM_NSET; ++set) OM_TRY(summarise_set(s, set));
    for (int i = 0; i < s->ncase; ++i) {
        if (s->c[i].has_net && s->c[i].base.is_made) om__column_add(&v, 0, s->c[i].net->ms);
        for (int g = 0; g < SIM_NGUESS; ++g)
            if (move_of(&s->c[i], g)->is_there) om__column_add(&v, 1, move_of(&s->c[i], g)->ms);
    }
    OM_TRY(om__columns_end(&v, 2, (StudySample*[]){&net, &solve}));
    s->sum.net_ms = net.median;
    s->sum.solve_ms = solve.median;
    s->sum.is_met = om__goals_met(om__sim_goals(&s->sum));
    return OM_OK;
}

static void sim_done(Sim* s) {
    om_banet_net_destroy(s->net);
    for (int i = 0; s->c && i < s->ncase; ++i) om_free(s->c[i].net);
    om_free(s->c);
    om_free(s->order);
}

OmStatus om_study_simulated_run(const OmStudySimulatedDef* def, const OmProgress* progress,
                                OmStudySimulatedSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    OmFolder folder = {0};
    Sim s = {.def = def, .progress = progress};
    OmStatus status = om_folder_open(def->out_dir, "simulated study", &folder);
    if (status >= 0) status = load_net(&s);
    if (status >= 0) status = make_cases(&s);
    if (status >= 0) status = run_cases(&s);
    if (status >= 0) status = summarise(&s);
    if (status >= 0) status = om__sim_write(&s);
    if (status >= 0) *summary = s.sum;
    om_folder_end(&folder);
    sim_done(&s);
    return status;
}
