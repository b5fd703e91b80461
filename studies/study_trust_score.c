// study_trust_score.c: counts, medians and calibration of the study of trust.
//
// Probabilities are judged vertex by vertex: the goal is about accepted updates, whose estimate a robot uses. A refused
// update has a probability too (the prior, or an estimate that was not adopted); `every` shows what it is worth.
#include <math.h>
#include <string.h>

#include "omentum/match.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_trust_internal.h"

_Static_assert(OM_STUDY_TRUST_NKIND == TRUST_NERROR - 1, "a kind is an error, without TRUST_RIGHT");

// ---- calibration ----------------------------------------------------------------------------------------------------

void om__trust_reliability_add(OmStudyReliability* r, int n, const float* probability,
                               const unsigned char* attached, const unsigned char* truth) {
    for (int i = 0; i < n; ++i) {
        const double p = (double)probability[i], t = truth[i] != 0, hard = attached[i] != 0;
        int b = (int)floor(p * OM_STUDY_TRUST_NBIN);
        if (b >= OM_STUDY_TRUST_NBIN) b = OM_STUDY_TRUST_NBIN - 1;
        ++r->count[b];
        r->mean[b] += p;
        r->share[b] += t;
        r->brier += (p - t) * (p - t);
        r->brier_hard += (hard - t) * (hard - t);
        ++r->n;
    }
}

void om__trust_reliability_end(OmStudyReliability* r) {
    if (r->n == 0) return;
    for (int b = 0; b < OM_STUDY_TRUST_NBIN; ++b) {
        if (r->count[b] == 0) continue;
        r->ece += fabs(r->mean[b] - r->share[b]) / r->n;
        r->mean[b] /= r->count[b];
        r->share[b] /= r->count[b];
    }
    r->brier /= r->n;
    r->brier_hard /= r->n;
}

// ---- cases ----------------------------------------------------------------------------------------------------------

bool om__trust_is_named(TrustError error, int cause) {
    static const OmMatchCause right[TRUST_NERROR] = {
        [TRUST_RIGHT] = OM_MATCH_FITS,        [TRUST_SHIFT] = OM_MATCH_MOVED,
        [TRUST_TILT] = OM_MATCH_MOVED,        [TRUST_AIM] = OM_MATCH_MOVED,
        [TRUST_FOCAL] = OM_MATCH_FOCAL,       [TRUST_SCALE] = OM_MATCH_SCALE,
        [TRUST_RANGE] = OM_MATCH_RANGE,       [TRUST_MISSING] = OM_MATCH_EMPTY,
        [TRUST_MIRRORED] = OM_MATCH_MIRRORED, [TRUST_INVERSE] = OM_MATCH_INVERSE,
        [TRUST_OPENGL] = OM_MATCH_OPENGL,     [TRUST_ORDER] = OM_MATCH_ORDER,
        [TRUST_OTHER] = OM_MATCH_UNKNOWN};
    return (OmMatchCause)cause == right[error];
}

bool om__trust_is_bad(const TrustUpdate* u, const TrustUpdate* right) {
    return u->is_there && u->is_accepted && u->dice < right->dice - OM_STUDY_TRUST_LOSS;
}

static void count_wrong(const TrustResult* r, int k, OmStudyTrustSummary* sum) {
    const TrustUpdate* u = &r->wrong[k];
    OmStudyTrustKind* kind = &sum->kind[r->c[k].error - 1];
    if (!u->is_there) {
        ++sum->nabsent;
        return;
    }
    const bool is_bad = om__trust_is_bad(u, &r->right[k]);
    ++sum->nwrong;
    ++kind->n;
    sum->nbad += is_bad;
    kind->nbad += is_bad;
    if (u->is_accepted) {
        kind->nclean += !u->is_moved;
        kind->ncorrected += u->is_moved != 0;
        return;
    }
    ++sum->nwrong_refused;
    ++kind->nrefused;
    kind->nnamed += om__trust_is_named(r->c[k].error, u->cause);
}

static void count_two(const TrustUpdate* u, const TrustUpdate* right, OmStudyTrustSummary* sum) {
    if (!u->is_there) return;
    ++sum->ntwo;
    sum->ntwo_refused += !u->is_accepted;
    sum->ntwo_out += !u->is_accepted || u->is_left_out;
    sum->ntwo_bad += om__trust_is_bad(u, right);
}

static void count(int n, const TrustResult* result, OmStudyTrustSummary* sum) {
    sum->ntruth = n;
    for (int i = 0; i < OM_STUDY_TRUST_NKIND; ++i) sum->kind[i].name = om__trust_error_name[1 + i];
    for (int i = 0; i < n; ++i) {
        const TrustResult* r = &result[i];
        sum->nlost += TRUST_NLIFT - r->nlift;
        for (int k = 0; k < r->nlift; ++k) {
            ++sum->nright;
            sum->nright_refused += !r->right[k].is_accepted;
            count_wrong(r, k, sum);
        }
        for (int k = 0; k + 1 < r->nlift; ++k) count_two(&r->two[k], &r->right[k], sum);
    }
}

// ---- medians --------------------------------------------------------------------------------------------------------

// Median over accepted cases of an error (0: of every error) of their Dice, or of that of the right data.
static double median_wrong(int n, const TrustResult* result, int error, bool of_right,
                           double* value) {
    int m = 0;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < result[i].nlift; ++k) {
            const TrustUpdate* u = &result[i].wrong[k];
            if (!u->is_there || !u->is_accepted) continue;
            if (error && (int)result[i].c[k].error != error) continue;
            value[m++] = of_right ? result[i].right[k].dice : u->dice;
        }
    return om__study_sample(value, m).median;
}

static void find_medians(int n, const TrustResult* result, double* value,
                         OmStudyTrustSummary* sum) {
    int m = 0;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < result[i].nlift; ++k)
            if (result[i].right[k].is_accepted) value[m++] = result[i].right[k].dice;
    sum->dice_right = om__study_sample(value, m).median;
    sum->dice_wrong = median_wrong(n, result, 0, false, value);
    for (int e = 1; e < TRUST_NERROR; ++e) {
        sum->kind[e - 1].dice_right = median_wrong(n, result, e, true, value);
        sum->kind[e - 1].dice = median_wrong(n, result, e, false, value);
    }
    m = 0;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < result[i].nlift; ++k) value[m++] = result[i].right[k].ms;
    sum->ms = om__study_sample(value, m).median;
    m = 0;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < result[i].nlift; ++k) value[m++] = result[i].right[k].judge_ms;
    sum->judge_ms = om__study_sample(value, m).median;
}

static void calibrate(int n, const TrustResult* result, OmStudyTrustSummary* sum) {
    for (int i = 0; i < n; ++i) {
        const TrustResult* r = &result[i];
        for (int k = 0; k < 2 * r->nlift; ++k) {
            const bool is_right = k < r->nlift;
            const TrustUpdate* u = is_right ? &r->right[k] : &r->wrong[k - r->nlift];
            if (!u->is_there) continue;
            OmStudyReliability* part[] = {&sum->every, u->is_accepted ? &sum->all : NULL,
                                          u->is_accepted && is_right ? &sum->right : NULL};
            for (int j = 0; j < 3; ++j)
                if (part[j])
                    om__trust_reliability_add(part[j], r->nnode, u->probability, u->attached,
                                              r->truth);
        }
    }
    om__trust_reliability_end(&sum->right);
    om__trust_reliability_end(&sum->all);
    om__trust_reliability_end(&sum->every);
}

// Shares in whole cases.
StudyGoals om__trust_goals(const OmStudyTrustSummary* sum) {
    const double none = sum->all.n > 0 ? 0 : (double)NAN;
    return (StudyGoals){
        3,
        {{"wrong acquisitions accepted with a Dice more than 0.15 below that of the right data",
          "%.0f", sum->nbad, floor(OM_STUDY_TRUST_BAD * sum->nwrong + 0.5), true},
         {"right acquisitions refused", "%.0f", sum->nright_refused,
          floor(OM_STUDY_TRUST_REFUSED * sum->nright + 0.5), true},
         {"expected calibration error", "%.3f", sum->all.ece + none, OM_STUDY_TRUST_ECE, true}}};
}

OmStatus om__trust_summarise(int n, const TrustResult* result, OmStudyTrustSummary* sum) {
    double* value;
    OM_ALLOC(value, TRUST_NLIFT * (size_t)n);
    count(n, result, sum);
    find_medians(n, result, value, sum);
    calibrate(n, result, sum);
    sum->is_met = om__goals_met(om__trust_goals(sum));
    om_free(value);
    return OM_OK;
}
