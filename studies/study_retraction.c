// study_retraction.c: thesis chapter 6: cases, runs of DEFRAS and FRAS, and their scores.
//
// A success is a run that exposes the ROI by the judge, who counts the ROI's points by rays, with a true force of at
// most 1.2 epsilon. Scores are of all cases, and of the cases that the exhaustive search exposes within that force.
#include <limits.h>
#include <math.h>
#include <string.h>

#include "omentum/banet_net.h"
#include "studies/study_cases.h"
#include "studies/study_retraction_internal.h"
#include "studies/study_stats.h"

#define COOKIE 0x57d17c60u

OmStudyRetractionDef om_study_retraction_default_def(const char* out_dir) {
    return (OmStudyRetractionDef){.out_dir = out_dir,
                                  .parts = OM_RETRACTION_SCENARIOS | OM_RETRACTION_THRESHOLD |
                                           OM_RETRACTION_REPLANNING | OM_RETRACTION_LABORATORY |
                                           OM_RETRACTION_RANDOM | OM_RETRACTION_ABLATIONS |
                                           OM_RETRACTION_ALARMS | OM_RETRACTION_SEARCHES,
                                  .cookie = COOKIE};
}

static OmStatus validate(const OmStudyRetractionDef* d) {
    const StudyRange range[] = {{"parts", d->parts, 1, 511},
                                {"ncase", d->ncase, 0, INT_MAX},
                                {"first", d->first, 0, RETRACTION_NPAIR - 1}};
    OM_TRY(STUDY_CHECK("retraction study", d, COOKIE, range));
    OM_CHECK(
        d->draw.kind == OM_DRAW_PUBLISHED ||
            !(d->parts & ~(OM_RETRACTION_RANDOM | OM_RETRACTION_ABLATIONS | OM_RETRACTION_ALARMS)),
        OM_INVALID,
        "retraction study: only random pairs, their ablations and alarms have other seeds");
    OM_CHECK(!(d->parts & OM_RETRACTION_KIDNEY) || d->data, OM_INVALID,
             "retraction study: the kidney needs data, the folder that holds ct_abdomen");
    return OM_OK;
}

// Runs of most parts learn with the installed network. Without it the study ends here, not after the plans.
static OmStatus check_network(const OmStudyRetractionDef* d) {
    const int without = OM_RETRACTION_THRESHOLD | OM_RETRACTION_REPLANNING | OM_RETRACTION_SEARCHES;
    OmBanetNet* net = NULL;
    if (!(d->parts & ~without)) return OM_OK;
    OM_TRY(om_banet_net_load(NULL, &net));
    om_banet_net_destroy(net);
    return OM_OK;
}

// ---- cases --------------------------------------------------------------------------------------------------------

bool om__retraction_is_wanted(const Retraction* s, const RetractionCase* c, OmRetractionRow row) {
    bool is_scenario = c->group == RETRACTION_SCENARIO;
    bool is_ablated = is_scenario || c->group == RETRACTION_PAIR;
    if (row == OM_RETRACTION_DEFRAS) return true;
    if (c->group == RETRACTION_ALARM) return false;
    if (row == OM_RETRACTION_OPEN_LOOP || row == OM_RETRACTION_FRAS ||
        row == OM_RETRACTION_FRAS_TRUE)
        return is_scenario || (c->group == RETRACTION_PAIR && !s->def->is_quick) ||
               (c->group == RETRACTION_PAIR && row == OM_RETRACTION_OPEN_LOOP);
    if (s->def->is_quick && (is_scenario || row != OM_RETRACTION_NO_LEARNING)) return false;
    return is_ablated;
}

// How many of the cases of these parts the user wants.
static int count_wanted(const OmStudyRetractionDef* d, int parts, int all) {
    const int n = !(d->parts & parts) ? 0 : d->is_quick ? 1 : all;
    return d->ncase > 0 && d->ncase < n ? d->ncase : n;
}

// Is a run of DEFRAS of this case in the folder?
static bool is_there(const Retraction* s, const char* name) {
    char file[96];
    snprintf(file, sizeof file, "%s-defras.bin", name);
    return om__study_has_file(s->def->out_dir, file);
}

// Room for a case that the user wants or the folder has; null: neither.
static RetractionResult* add(Retraction* s, const char* name, bool is_asked) {
    if (!is_asked && !is_there(s, name)) return NULL;
    s->result[s->ncase].is_asked = is_asked;
    return &s->result[s->ncase++];
}

// The cases of the parts that the user wants, and all others that the folder has.
static OmStatus list_cases(Retraction* s) {
    const OmStudyRetractionDef* d = s->def;
    const int searches = OM_RETRACTION_SEARCHES, ablations = OM_RETRACTION_ABLATIONS;
    // Scenarios have published numbers alone: of another draw pairs are ablated.
    const int ablated = d->draw.kind == OM_DRAW_PUBLISHED ? ablations : 0;
    const int nscenario =
        count_wanted(d, OM_RETRACTION_SCENARIOS | ablated | searches, RETRACTION_NSCENARIO);
    const int nlab = count_wanted(d, OM_RETRACTION_LABORATORY | searches, RETRACTION_NLAB);
    const int npair = count_wanted(d, OM_RETRACTION_RANDOM | ablations, RETRACTION_NPAIR);
    const int nalarm = count_wanted(d, OM_RETRACTION_ALARMS, RETRACTION_NALARM);
    const int nkidney = count_wanted(d, OM_RETRACTION_KIDNEY, RETRACTION_NKIDNEY);
    const bool is_developed = d->draw.kind == OM_DRAW_DEVELOPMENT;
    const int first_pair = is_developed ? RETRACTION_DEV_PAIR : RETRACTION_FIRST_PAIR;
    const int first_alarm = is_developed ? RETRACTION_DEV_ALARM : RETRACTION_FIRST_ALARM;
    char name[64];
    RetractionResult* r;
    for (int i = 0; i < 2 * RETRACTION_NSCENARIO; ++i) {
        const RetractionKind kind = i % 2 ? RETRACTION_MORE : RETRACTION_FEWER;
        const int number = i / 2 + 1;
        snprintf(name, sizeof name, "scenario-%d-%s", number, om__retraction_kind_name[kind]);
        r = add(s, name, number <= nscenario);
        if (r) OM_TRY(om__retraction_scenario(number, kind, d->is_quick, &r->c));
    }
    for (int i = 0; i < RETRACTION_NLAB; ++i) {
        const RetractionCase c = om__retraction_lab(i, d->is_quick);
        if ((r = add(s, c.name, i < nlab)) != NULL) r->c = c;
    }
    for (int i = 0; i < RETRACTION_NPAIR; ++i) {
        om__retraction_pair_name(first_pair + i, &d->draw, name, sizeof name);
        r = add(s, name, i >= d->first && i < d->first + npair);
        if (!r) continue;
        // a search asks for what is possible where DEFRAS failed
        r->is_asked = r->is_asked || d->parts & searches;
        OM_TRY(om__retraction_pair(first_pair + i, &d->draw, d->is_quick, &r->c));
    }
    for (int i = 0; i < RETRACTION_NALARM; ++i) {
        om__retraction_alarm_name(first_alarm + i, &d->draw, name, sizeof name);
        r = add(s, name, i >= d->first && i < d->first + nalarm);
        if (r) OM_TRY(om__retraction_alarm(first_alarm + i, &d->draw, d->is_quick, &r->c));
    }
    for (int i = 0; i < RETRACTION_NKIDNEY && d->data; ++i) {
        const RetractionCase c = om__retraction_kidney(i, d->data, d->is_quick);
        if ((r = add(s, c.name, i < nkidney)) != NULL) r->c = c;
    }
    return OM_OK;
}

// ---- scores -------------------------------------------------------------------------------------------------------

// Not measured: NaN.
static double median(StudySample s) { return s.n ? s.median : (double)NAN; }

static bool is_exposed(const RetractionResult* r) {
    for (int row = 0; row < OM_RETRACTION_NROW; ++row)
        if (r->has_run[row] && r->run[row].is_success) return true;
    return false;
}

bool om__retraction_is_searched(const RetractionResult* r) {
    const RetractionGroup g = r->c.group;
    const bool has_failed =
        r->has_run[OM_RETRACTION_OPEN_LOOP] && !r->run[OM_RETRACTION_OPEN_LOOP].is_success;
    return g == RETRACTION_SCENARIO || g == RETRACTION_LAB || (g == RETRACTION_PAIR && has_failed);
}

bool om__retraction_counts(const Retraction* s, const RetractionResult* r) {
    if (r->c.group != RETRACTION_PAIR || s->def->is_quick) return true;
    return om__retraction_is_searched(r) && r->has_ceiling && r->ceiling.is_possible;
}

static OmRetractionPairs count_pairs(const Retraction* s) {
    OmRetractionPairs p = {0};
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionResult* r = &s->result[i];
        if (r->c.group != RETRACTION_PAIR || !r->has_run[OM_RETRACTION_OPEN_LOOP]) continue;
        ++p.ndrawn;
        if (r->run[OM_RETRACTION_OPEN_LOOP].is_success)
            ++p.nharmless;
        else if (r->has_ceiling)
            ++*(r->ceiling.is_possible ? &p.ncounting : &p.nimpossible);
    }
    return p;
}

bool om__retraction_is_possible(const RetractionResult* r) {
    return (r->has_ceiling && r->ceiling.is_possible) || is_exposed(r);
}

static void add_run(const RetractionResult* r, const RetractionRun* run, StudyColumns* c,
                    OmRetractionScore* score) {
    const bool is_possible = om__retraction_is_possible(r);
    ++score->nrun;
    score->nunknown += !is_possible && !r->has_ceiling;
    om__columns_add(c, 5,
                    (double[]){run->visibility, run->naction, run->nforce,
                               run->force / run->epsilon, run->force_world / run->epsilon});
    score->visibility_mean += run->visibility;
    score->npossible += is_possible;
    score->nsuccess += run->is_success;
    score->nsuccess_possible += run->is_success && is_possible;
    if (run->is_success && r->has_ceiling && r->ceiling.is_possible)
        om__column_add(c, 5, run->naction - r->ceiling.best.naction);
    score->nforce += run->force_world > RETRACTION_MAX_FORCE * run->epsilon;
    score->nheld += run->outcome == OM_RETRACT_HELD;
    score->nheld_alone +=
        run->outcome == OM_RETRACT_HELD && r->has_ceiling && r->ceiling.is_possible;
    score->ntrigger += run->ntrigger;
    score->ngood += run->ngood;
    score->nfalse +=
        r->c.kind == RETRACTION_SAME && run->nwarning[0] + run->nwarning[1] + run->nwarning[2] > 0;
}

static OmStatus score_row(const Retraction* s, RetractionGroup group, OmRetractionRow row,
                          OmRetractionScore* score) {
    StudyColumns c = {0};
    StudySample q[6];
    *score = (OmRetractionScore){0};
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionResult* r = &s->result[i];
        const bool counts = row == OM_RETRACTION_OPEN_LOOP || om__retraction_counts(s, r);
        if (r->c.group == group && r->has_run[row] && counts) add_run(r, &r->run[row], &c, score);
    }
    OM_TRY(om__columns_end(&c, 6, (StudySample*[]){&q[0], &q[1], &q[2], &q[3], &q[4], &q[5]}));
    score->visibility_mean = score->nrun ? score->visibility_mean / score->nrun : (double)NAN;
    score->visibility = median(q[0]);
    score->actions = median(q[1]);
    score->more_actions = median(q[5]);
    score->events = median(q[2]);
    score->force = median(q[3]);
    score->force_world = median(q[4]);
    return OM_OK;
}

// A row against DEFRAS on the pairs that count.
static OmStatus compare_row(const Retraction* s, int row, OmRetractionDifference* d) {
    StudyColumns c = {0};
    StudySample more;
    *d = (OmRetractionDifference){.npair = 0};
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionResult* r = &s->result[i];
        const RetractionRun *defras = &r->run[OM_RETRACTION_DEFRAS], *other = &r->run[row];
        if (r->c.group != RETRACTION_PAIR || !om__retraction_counts(s, r) || !r->has_run[row] ||
            !r->has_run[OM_RETRACTION_DEFRAS])
            continue;
        ++d->npair;
        d->defras_only += defras->is_success && !other->is_success;
        d->other_only += other->is_success && !defras->is_success;
        if (defras->is_success && other->is_success)
            om__column_add(&c, 0, other->naction - defras->naction);
    }
    OM_TRY(om__columns_end(&c, 1, (StudySample*[]){&more}));
    d->actions = median(more);
    return OM_OK;
}

static OmStatus summarise(Retraction* s) {
    OmStudyRetractionSummary* sum = &s->sum;
    OmRetractionScore* score[RETRACTION_NGROUP] = {sum->scenario, sum->random, sum->laboratory,
                                                   sum->kidney, sum->alarm};
    for (int g = 0; g < RETRACTION_NGROUP; ++g)
        for (int row = 0; row < OM_RETRACTION_NROW; ++row)
            OM_TRY(score_row(s, (RetractionGroup)g, (OmRetractionRow)row, &score[g][row]));
    for (int row = 0; row < OM_RETRACTION_NROW; ++row)
        OM_TRY(compare_row(s, row, &sum->difference[row]));
    for (int g = 0; g < OM_RETRACTION_NGRID; ++g)
        for (int f = 0; f < OM_RETRACTION_NSHARE; ++f) {
            sum->replan[g][f] = s->has_replan ? s->replan.mean[g][f] : (double)NAN;
            sum->replan_sd[g][f] = s->has_replan ? s->replan.sd[g][f] : (double)NAN;
        }
    if (s->has_threshold) sum->force = s->threshold.force;
    sum->epsilon = om__retraction_epsilon();
    sum->pairs = count_pairs(s);
    return OM_OK;
}

// ---- draws ---------------------------------------------------------------------------------------------------------

// Append what DEFRAS did in the cases of a group that the user wants.
static OmStatus record_part(const Retraction* s, RetractionGroup group, const char* part) {
    int n = 0, ngood = 0, first = 0, last = 0;
    for (int i = 0; i < s->ncase; ++i) {
        const RetractionResult* r = &s->result[i];
        const RetractionRun* run = &r->run[OM_RETRACTION_DEFRAS];
        if (r->c.group != group || !r->is_asked || !r->has_run[OM_RETRACTION_DEFRAS]) continue;
        const int nwarning = run->nwarning[0] + run->nwarning[1] + run->nwarning[2];
        ngood += group == RETRACTION_PAIR ? run->is_success : nwarning > 0;
        last = r->c.number;
        if (n++ == 0) first = last;
    }
    char cases[48], result[64];
    snprintf(cases, sizeof cases, "%d-%d%s", first, last, s->def->is_quick ? " quick" : "");
    snprintf(result, sizeof result, "%d of %d %s", ngood, n,
             group == RETRACTION_PAIR ? "exposed" : "warned");
    if (n == 0) return OM_OK;
    return om_study_draw_append(s->def->draws, &s->def->draw, "retraction", part, cases, result);
}

static OmStatus record_draw(const Retraction* s) {
    if (s->def->draw.kind != OM_DRAW_JUDGED || !s->def->draws) return OM_OK;
    OM_TRY(record_part(s, RETRACTION_PAIR, "random"));
    return record_part(s, RETRACTION_ALARM, "alarms");
}

// ---- run ----------------------------------------------------------------------------------------------------------

static OmStatus run(Retraction* s) {
    char path[1024];
    OM_TRY(list_cases(s));
    OM_TRY(om_path_join(s->def->out_dir, "runs", path, sizeof path));
    if (s->ncase > 0) OM_TRY(om_path_make_dir(path));
    OM_TRY(om__retraction_run_replan(s));  // first: it is timed
    OM_TRY(om__retraction_run_threshold(s));
    OM_TRY(om__retraction_run_cases(s));
    OM_TRY(summarise(s));
    OM_TRY(om__retraction_write_json(s));
    OM_TRY(om__retraction_write_report(s));
    return record_draw(s);
}

OmStatus om_study_retraction_run(const OmStudyRetractionDef* def, const OmProgress* progress,
                                 OmStudyRetractionSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    OM_TRY(check_network(def));
    Retraction s = {.def = def, .progress = progress};
    OmFolder folder = {0};
    OmStatus status;
    OM_CALLOC_DONE(s.result, RETRACTION_MAX_CASE);
    OM_TRY_DONE(om_folder_open(def->out_dir, "retraction study", &folder));
    status = run(&s);
    if (status == OM_OK) *summary = s.sum;
done:
    om_folder_end(&folder);
    om_free(s.result);
    return status;
}
