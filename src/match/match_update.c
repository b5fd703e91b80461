// match_update.c: attachments that explain scans.
//
// 1. match_evidence.c: a log-likelihood ratio of each candidate, attached against free, from the scans.
// 2. match_prior.c: probable sets of attached vertices, given these and the advice of the caller.
// 3. The twin is brought to rest with the most probable set (match_try.c), and its distance from the scans decides
//    whether the estimate is used. With advice, other sets are tried, too. The distance tells little about parts that
//    no grasp pulls: of nine sets by level of probability, the nearest had a lower DSC than the most probable one
//    (doc/notes/match_update.md). A set therefore replaces the most probable one only if it is clearly nearer, or if
//    the most probable one would be refused.
//
// Where the caller states the attachments that the twin has, these are believed until a scan contradicts them:
// - One more set is tried: they, attached where the twin moved and the tissue stayed, free where the tissue moved.
// - Of that set, if it is chosen, stays what the twin has already and what bears load (drop_idle).
// - An estimate replaces them only if they do not explain the scans, also with another modulus (try_present).
//
// Rejected (doc/notes/match_update.md): to attach only what the twin lifts by more than 2.5 mm along the normal (DSC
// 0.24 instead of 0.40); to change vertices by the slope of the distance, with the adjoint of the equilibrium (0.650
// instead of 0.654 in 1.8 times the time: the distance says nothing of what no pull moves); a level of 0.5 (0.62).
#include <stdlib.h>
#include <string.h>

#include "match/match_judge.h"

// An update that raises the mean distance beyond this part explains the scan no better, and is refused. Of 575 right
// acquisitions four are above it; of 25 that showed other tissue, the least had 1.07.
#define CLOSER 1.03
#define NOISE \
    5.0  // standard deviations of a scan's noise that its distance may have beside the limit
#define EXPLAINS 0.95  // a set that lowers it to this part replaces one that does not
#define CLEARLY 0.9    // ... and a set that replaces a more probable one lowers it to this part
#define FARTHER 1.1    // an acquisition of several is left out if its mean rises to this part
#define IDLE 0.05      // of the largest load of an attachment: what bears less explains nothing
#define ENOUGH 1.5e-4  // m, mean distance that true attachments leave; none replace such ones
#define ALIKE 0.98     // sets with this Dice coefficient, by area, are one

typedef struct Job {
    OmMatch* match;
    int nacq;            // acquisitions that are good
    OmAcquisition* acq;  // their data, with corrected scans                  (nacq)
    int* number;         // among those of the caller                         (nacq)
    double** moved;      // points and normals of corrected scans    (2 x nacq of the caller)
    MatchJudge judge;
    double *mean_before, *mean_after;  // m, of the scan of each, as in OmMatchTrial  (nacq)
    const OmMatchAdvice* advice;
    OmMatchEstimate* out;
    MatchTrier trier;
    MatchEvidence evidence;
    double *belief, *probability;  // of candidates; belief: null without advice
    double* x;  // of a set on trial                              (nacquisition x nnode x 3)
    unsigned char* inferred;  // with advice, by scans alone, corrected, without idle ones
    const unsigned char* set[3 + OM_MATCH_MAX_ADVICE];  // by OmMatchEstimate.choice; null: none
    OmMatchTrial before, after;
    OmMatchTrial present;  // with the twin's own attachments
    double present_young;  // ... and this modulus over the scene's
} Job;

OM_PRINTF(2, 3)
static OmStatus refuse(OmMatchEstimate* out, const char* format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(out->reason, sizeof out->reason, format, args);
    va_end(args);
    return OM_NOT_CONVERGED;
}

// How far the tissue was from where the twin at rest has it when it was grasped, beyond what is allowed; 0: not so far.
static double moved_before(const OmMatch* m, const OmAcquisition* acq) {
    for (int g = 0; g < acq->ngrasp; ++g) {
        const OmMatchGrasp* grasp = &acq->grasp[g];
        double away = HUGE_VAL, radius = grasp->radius;
        if (!(radius > 0)) radius = m->def.scene->task.grasp_radius;
        for (int i = 0; grasp->vert && i < grasp->nvert; ++i)
            away = fmin(away, om_distance(om_load3(m->view.mesh->x, grasp->vert[i]),
                                          grasp->pose_world_grasp.p));
        if (grasp->vert && away > radius + m->def.moved) return away;
    }
    return 0;
}

// Refusals before any work: OM_NOT_CONVERGED with the reason. Tissue that had moved is left out later.
static OmStatus check_motion(const OmMatch* m, int nacq, const OmAcquisition* acq,
                             OmMatchEstimate* out) {
    double motion = 0;
    int nmoved = 0;
    for (int a = 0; a < nacq; ++a) {
        if (acq[a].ngrasp == 0) return refuse(out, "nothing is grasped in acquisition %d", a);
        const bool is_moved = moved_before(m, &acq[a]) > 0;
        nmoved += is_moved;
        for (int g = 0; !is_moved && g < acq[a].ngrasp; ++g) {
            const OmMatchGrasp* grasp = &acq[a].grasp[g];
            motion = fmax(motion, om_distance(grasp->pose_world_now.p, grasp->pose_world_grasp.p));
        }
    }
    if (nmoved < nacq && motion < m->def.min_motion)
        return refuse(out, "the grasp moved by %.1f mm only, %.1f mm are needed", 1e3 * motion,
                      1e3 * m->def.min_motion);
    return OM_OK;
}

// ---- acquisitions --------------------------------------------------------------------------------------------------

// A copy of the points of a scan, corrected with its camera.
static OmStatus correct_scan(const MatchGuess* g, OmScan* scan, double* copy[2]) {
    size_t n = 3 * (size_t)scan->npoint;
    const MatchGuess stated = om__judge_as_stated(scan);
    const OmPose to_camera = om_pose_inverse(stated.pose);
    const OmQuat turn = om_quat_mul(g->pose.q, to_camera.q);
    OM_ALLOC(copy[0], n);
    OM_ALLOC(copy[1], n);
    for (int i = 0; i < scan->npoint; ++i) {
        OmVec3 p = om_pose_apply(to_camera, om_load3(scan->x, i));
        om_store3(copy[0], i, om__judge_place_of(g, p));
        om_store3(copy[1], i, om_quat_rotate(turn, om_load3(scan->normal, i)));
    }
    scan->x = copy[0];
    scan->normal = copy[1];
    if (!scan->has_camera) return OM_OK;
    scan->camera.lens = om_camera_lens(&scan->camera);
    scan->camera.lens.fx /= g->focal;
    scan->camera.lens.fy /= g->focal;
    scan->camera.pose_world_camera = g->pose;
    return OM_OK;
}

// The tissue at rest says what is wrong with the camera; the lifted tissue, corrected by that, must fit as well.
static OmStatus judge_one(Job* j, int a, OmAcquisition* acq, OmMatchVerdict* v) {
    MatchGuess right;
    if (acq->rest) OM_TRY(om__match_judge(&j->judge, acq->rest, true, v, &right));
    if (acq->rest && !v->is_good) return OM_OK;
    if (acq->rest && v->is_moved) OM_TRY(correct_scan(&right, &acq->scan, j->moved + 2 * a));
    OmMatchVerdict lifted;
    OM_TRY(om__match_judge(&j->judge, &acq->scan, false, &lifted, &right));
    if (acq->rest && lifted.is_good) return OM_OK;
    *v = lifted;
    if (v->is_good && v->is_moved) return correct_scan(&right, &acq->scan, j->moved + 2 * a);
    return OM_OK;
}

// Every acquisition by itself, before the fit; the good ones go on.
static OmStatus judge_all(Job* j, int nacq, const OmAcquisition* acq) {
    OmMatchEstimate* out = j->out;
    OM_ALLOC(j->acq, nacq);
    OM_ALLOC(j->number, nacq);
    OM_ALLOC(j->mean_before, nacq);
    OM_ALLOC(j->mean_after, nacq);
    j->moved = om_calloc(2 * (size_t)nacq, sizeof *j->moved);
    if (!j->moved) return OM_NO_MEMORY;
    OM_TRY(om__match_judge_begin(j->match, &j->judge));
    for (int a = 0; a < nacq; ++a) {
        OmAcquisition one = acq[a];
        OmMatchVerdict* v = &out->verdict[a];
        *v = (OmMatchVerdict){.is_good = true, .pose_right_scan = om_pose_identity()};
        const double moved = moved_before(j->match, &one);
        if (moved > 0) {  // the twin begins at rest: it says nothing of tissue that lay elsewhere
            v->is_good = false;
            snprintf(v->reason, sizeof v->reason,
                     "the tissue had moved by %.1f mm when it was grasped", 1e3 * moved);
            continue;
        }
        if (!j->match->def.is_unchecked) OM_TRY(judge_one(j, a, &one, v));
        if (!v->is_good) continue;
        j->number[j->nacq] = a;
        j->acq[j->nacq++] = one;
    }
    return j->nacq > 0 ? OM_OK : refuse(out, "scan 0: %.240s", out->verdict[0].reason);
}

// What is known without a scan.
static OmStatus take_prior(Job* j) {
    const OmMatch* m = j->match;
    double *none = om_calloc((size_t)m->view.ncandidate, sizeof *none),
           *p = om_calloc((size_t)m->view.ncandidate, sizeof *p);
    OmStatus status = none && p ? om__match_infer(m, none, NULL, 0, p) : OM_NO_MEMORY;
    for (int i = 0; status == OM_OK && i < m->view.ncandidate; ++i)
        j->out->probability[m->candidate[i]] = p[i];
    om_free(none);
    om_free(p);
    return status;
}

static OmStatus create_estimate(const OmMatch* m, int nacq, OmMatchEstimate* out) {
    int nvert = m->ncorner, nnode = m->view.mesh->nvert;
    *out = (OmMatchEstimate){.nvert = nvert, .nnode = nnode, .nacquisition = nacq};
    out->probability = om_calloc((size_t)nvert, sizeof *out->probability);
    out->uncertainty = om_calloc((size_t)nvert, sizeof *out->uncertainty);
    out->stiffness = om_calloc((size_t)nvert, sizeof *out->stiffness);
    out->attached = om_calloc((size_t)nvert, 1);
    out->verdict = om_calloc((size_t)nacq, sizeof *out->verdict);
    out->x = om_calloc((size_t)nacq * 3 * (size_t)nnode, sizeof *out->x);
    bool is_whole = out->verdict && out->probability && out->uncertainty && out->stiffness &&
                    out->attached && out->x;
    for (int i = 0; is_whole && i < m->view.ncandidate; ++i)
        out->uncertainty[m->candidate[i]] = 1;  // until a scan says more
    return is_whole ? OM_OK : OM_NO_MEMORY;
}

static OmStatus check_advice(const OmMatch* m, const OmMatchAdvice* advice) {
    if (!advice) return OM_OK;
    OM_CHECK(isfinite(advice->weight) && advice->weight >= 0 && advice->weight <= 1, OM_INVALID,
             "OmMatchAdvice.weight = %g, must be 0 to 1", advice->weight);
    for (int i = 0; advice->probability && i < m->view.ncandidate; ++i) {
        double p = advice->probability[m->candidate[i]];
        OM_CHECK(p >= 0 && p <= 1, OM_INVALID,
                 "OmMatchAdvice.probability of vertex %d is %g, must be 0 to 1", m->candidate[i],
                 p);
    }
    OM_CHECK(advice->nset >= 0 && advice->nset <= OM_MATCH_MAX_ADVICE, OM_INVALID,
             "OmMatchAdvice.nset = %d, must be 0 to %d", advice->nset, OM_MATCH_MAX_ADVICE);
    for (int k = 0; k < advice->nset; ++k)
        OM_CHECK(advice->set[k], OM_INVALID, "OmMatchAdvice.set[%d] is null", k);
    return OM_OK;
}

static OmStatus create_job(OmMatch* m, int nacq, const OmAcquisition* acq, Job* j) {
    size_t nnode = (size_t)m->view.mesh->nvert, n = (size_t)m->view.ncandidate;
    OM_TRY(om__match_trier_begin(m, nacq, acq, &j->trier));
    OM_TRY(om__match_evidence_begin(&j->trier, &j->evidence));
    OM_ALLOC(j->probability, n);
    OM_ALLOC(j->x, (size_t)nacq * 3 * nnode);
    OM_ALLOC(j->inferred, 4 * (size_t)m->ncorner);
    if (!j->advice || !j->advice->probability) return OM_OK;
    OM_ALLOC(j->belief, n);
    for (size_t i = 0; i < n; ++i) j->belief[i] = j->advice->probability[m->candidate[i]];
    return OM_OK;
}

// What is of the acquisitions in use.
static void drop_fit(Job* j) {
    om__match_evidence_done(&j->evidence);
    om__match_trier_done(&j->trier);
    om_free(j->belief);
    om_free(j->probability);
    om_free(j->x);
    om_free(j->inferred);
    j->evidence = (MatchEvidence){0};
    j->trier = (MatchTrier){0};
    j->belief = j->probability = j->x = NULL;
    j->inferred = NULL;
    memset(j->set, 0, sizeof j->set);
}

static void job_done(Job* j, int nacq) {
    drop_fit(j);
    for (int k = 0; j->moved && k < 2 * nacq; ++k) om_free(j->moved[k]);
    om_free(j->moved);
    om_free(j->acq);
    om_free(j->number);
    om_free(j->mean_before);
    om_free(j->mean_after);
    om__match_judge_done(&j->judge);
}

// ---- inference ------------------------------------------------------------------------------------------------

// The candidates above the level with the largest expected Dice coefficient.
static OmStatus infer_set(Job* j, int k, const double* belief) {
    OmMatch* m = j->match;
    double weight = belief ? j->advice->weight : 0;
    OM_TRY(om__match_infer(m, j->evidence.ratio, belief, weight, j->probability));
    om__match_calibrate(m->view.ncandidate, j->probability);
    double level = om__match_choose_level(m, j->probability);
    unsigned char* set = j->inferred + (size_t)k * (size_t)m->ncorner;
    memset(set, 0, (size_t)m->ncorner);
    for (int i = 0; i < m->view.ncandidate; ++i) set[m->candidate[i]] = j->probability[i] > level;
    j->set[k] = set;
    return OM_OK;
}

// The attachments of the twin, corrected where twin and scans contradict each other. Tissue that moved once is free.
static void correct_present(Job* j) {
    const OmMatch* m = j->match;
    const size_t nvert = (size_t)m->ncorner;
    unsigned char* set = j->inferred + 2 * nvert;
    if (!j->advice || !j->advice->present) return;
    memcpy(set, j->advice->present, nvert);
    for (int i = 0; i < m->view.ncandidate; ++i) {
        const int v = m->candidate[i];
        set[v] = (set[v] || j->evidence.stayed[i]) && !j->evidence.went[i];
    }
    j->set[2 + j->advice->nset] = set;
}

// The ratio of scans and advice, without the prior.
static double full_ratio(const Job* j, int i) {
    double ratio = j->evidence.ratio[i];
    return j->belief ? ratio + j->advice->weight * om__match_logit(j->belief[i]) : ratio;
}

static OmStatus infer(Job* j) {
    OmMatch* m = j->match;
    OmMatchEstimate* out = j->out;
    if (j->belief) OM_TRY(infer_set(j, 1, NULL));
    OM_TRY(infer_set(j, 0, j->belief));
    for (int k = 0; j->advice && k < j->advice->nset; ++k) j->set[2 + k] = j->advice->set[k];
    correct_present(j);
    double sum = 0;
    OmVec3 centre = om_vec3(0, 0, 0);
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        double p = j->probability[i];
        out->probability[v] = p;
        out->uncertainty[v] = exp(-fabs(full_ratio(j, i)));
        double w = out->uncertainty[v] * p * (1 - p) * m->area[i];
        sum += w;
        centre = om_madd(centre, w, om_load3(m->view.mesh->x, v));
    }
    out->has_look_next = sum > 0;
    if (sum > 0) out->look_next = om_scale(1 / sum, centre);
    return OM_OK;
}

// ---- trials ---------------------------------------------------------------------------------------------------

// Dice coefficient of two sets by area; 1 for two empty ones.
static double likeness(const OmMatch* m, const unsigned char* a, const unsigned char* b) {
    double both = 0, sum = 0;
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        both += a[v] && b[v] ? 2 * m->area[i] : 0;
        sum += (a[v] ? m->area[i] : 0) + (b[v] ? m->area[i] : 0);
    }
    return sum > 0 ? both / sum : 1;
}

// Whether a set before k is nearly set k.
static bool is_known(const Job* j, int k) {
    for (int i = 0; i < k; ++i)
        if (j->set[i] && likeness(j->match, j->set[i], j->set[k]) > ALIKE) return true;
    return false;
}

static OmStatus try_sets(Job* j, const OmProgress* progress) {
    OmMatchEstimate* out = j->out;
    const OmMatch* m = j->match;
    const int n = 3 + (j->advice ? j->advice->nset : 0);
    size_t size = (size_t)j->trier.nacq * 3 * (size_t)m->view.mesh->nvert * sizeof *out->x;
    OM_TRY(om__match_measure(&j->trier, j->evidence.x_before, &j->before));
    memcpy(j->mean_before, j->trier.mean, (size_t)j->nacq * sizeof *j->mean_before);
    for (int k = 0; k < n; ++k) {
        OM_TRY(om_progress_report(progress, "check", k, n));
        if (!j->set[k] || is_known(j, k)) continue;
        OmMatchTrial trial;
        memcpy(j->x, k == 0 ? j->evidence.x : out->x, size);
        j->trier.needs_rest = k > 0;  // what another set needs to replace the first
        OM_TRY(om__match_try(&j->trier, j->set[k], j->x, &trial));
        // Where the set so far explains nothing, a set that explains something is enough.
        const double good = EXPLAINS * j->before.mean;
        const bool is_idle = j->after.mean > good || !j->after.is_at_rest;
        const double limit = fmax(CLEARLY * j->after.mean, is_idle ? good : 0);
        bool is_nearer = trial.is_at_rest && trial.mean < limit;
        if (k > 0 && !is_nearer) continue;
        j->after = trial;
        memcpy(j->mean_after, j->trier.mean, (size_t)j->nacq * sizeof *j->mean_after);
        out->choice = k;
        memcpy(out->x, j->x, size);
    }
    j->trier.needs_rest = false;
    OM_TRY(om_progress_report(progress, "check", n, n));
    return OM_OK;
}

// What of the corrected present set the twin has already or bears load, if that explains nearly as much. A twin that
// slides as a whole moves wherever the tissue stayed: of 243 vertices, 0.85 of the underside, in place of 56 true ones,
// 12 bear load. The other sets have the prior's measure.
static OmStatus drop_idle(Job* j) {
    const OmMatch* m = j->match;
    OmMatchEstimate* out = j->out;
    const size_t nvert = (size_t)m->ncorner, n3 = 3 * (size_t)m->view.mesh->nvert;
    const size_t size = (size_t)j->trier.nacq * n3 * sizeof *out->x;
    const unsigned char* chosen = j->set[out->choice];
    unsigned char* set = j->inferred + 3 * nvert;
    double most = 0, *load = j->probability;  // was read by `infer`
    memcpy(set, chosen, nvert);
    for (int i = 0; i < m->view.ncandidate; ++i) {
        const int v = m->candidate[i];
        const OmVec3 rest = om_load3(m->view.mesh->x, v);
        load[i] = 0;
        for (int a = 0; chosen[v] && a < j->trier.nacq; ++a)
            load[i] =
                fmax(load[i], m->area[i] * om_distance(om_load3(out->x + (size_t)a * n3, v), rest));
        most = fmax(most, load[i]);
    }
    for (int i = 0; i < m->view.ncandidate; ++i) {
        const int v = m->candidate[i];
        set[v] = chosen[v] && (j->advice->present[v] || load[i] > IDLE * most);
    }
    OmMatchTrial trial;
    memcpy(j->x, out->x, size);
    j->trier.needs_rest = true;
    OM_TRY(om__match_try(&j->trier, set, j->x, &trial));
    j->trier.needs_rest = false;
    if (!trial.is_at_rest || CLEARLY * trial.mean > j->after.mean) return OM_OK;
    j->after = trial;
    memcpy(j->mean_after, j->trier.mean, (size_t)j->nacq * sizeof *j->mean_after);
    memcpy(out->x, j->x, size);
    j->set[out->choice] = set;
    return OM_OK;
}

static void take_chosen(Job* j) {
    const OmMatch* m = j->match;
    OmMatchEstimate* out = j->out;
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        out->attached[v] = j->set[out->choice][v] != 0;
        out->stiffness[v] = out->attached[v] ? m->def.foundation * m->area[i] : 0;
    }
}

// Tissue of another modulus hangs in another shape, and other attachments imitate it: at 0.85 times the modulus, 54
// right vertices leave 0.57 mm, 149 wrong ones 0.35 mm; the right ones at 0.7 times the modulus 0.33 mm. So before
// others replace the twin's own, these are tried with other moduli: downwards or upwards, as long as it gets nearer.
static OmStatus try_present(Job* j) {
    static const double young[2][2] = {{0.7, 0.5}, {1.4, 2}};
    const size_t size = (size_t)j->trier.nacq * 3 * (size_t)j->match->view.mesh->nvert;
    j->present = j->before;
    j->present_young = 1;
    if (!j->advice || !j->advice->present || j->after.mean >= CLEARLY * j->before.mean)
        return OM_OK;
    j->trier.needs_rest = true;
    for (int way = 0; way < 2 && j->present_young == 1; ++way)
        for (int k = 0; k < 2; ++k) {
            OmMatchTrial trial;
            j->trier.young = young[way][k];
            if (k == 0) memcpy(j->x, j->evidence.x_before, size * sizeof *j->x);
            OM_TRY(om__match_try(&j->trier, j->advice->present, j->x, &trial));
            if (!(trial.is_at_rest && trial.mean < j->present.mean)) break;
            j->present = trial;
            j->present_young = young[way][k];
        }
    j->trier.young = 0;
    j->trier.needs_rest = false;
    return OM_OK;
}

// From the acquisitions that were used to those of the caller; the others have the twin as believed.
static void spread_shapes(Job* j, int nacq, const OmAcquisition* acq) {
    OmMatchEstimate* out = j->out;
    size_t n3 = 3 * (size_t)out->nnode;
    int k = j->nacq - 1;
    for (int a = nacq - 1; a >= 0; --a) {
        bool is_used = k >= 0 && j->number[k] == a;
        const double* from = is_used         ? out->x + (size_t)k * n3
                             : acq[a].x_twin ? acq[a].x_twin
                                             : j->match->view.mesh->x;
        if (is_used) --k;
        memmove(out->x + (size_t)a * n3, from, n3 * sizeof *from);
    }
}

// Whether the chosen set is nearly the one that the twin has.
static OmStatus find_known(const Job* j, const OmAcquisition* newest, bool* is_known) {
    const OmMatch* m = j->match;
    const OmMeshSet* set = om_tet_mesh_find_set(m->view.mesh, "attachment");
    unsigned char* has = om_calloc((size_t)m->view.mesh->nvert, 1);
    if (!has) return OM_NO_MEMORY;
    for (int i = 0; set && i < set->nvert; ++i) has[set->vert[i]] = 1;
    *is_known = likeness(m, j->out->attached, newest->attached ? newest->attached : has) > ALIKE;
    om_free(has);
    return OM_OK;
}

// Whether the twin at rest with the chosen set explains the scans.
static OmStatus check(Job* j, const OmAcquisition* newest) {
    const OmMatchDef* def = &j->match->def;
    OmMatchEstimate* out = j->out;
    out->before_median = j->before.median;
    out->before_p90 = j->before.p90;
    out->after_median = j->after.median;
    out->after_p90 = j->after.p90;
    out->before_mean = j->before.mean;
    out->after_mean = j->after.mean;
    if (!j->after.is_at_rest) return refuse(out, "the twin found no rest with the new attachments");
    if (def->is_unchecked) return OM_OK;
    double noise = 0;
    for (int k = 0; k < j->nacq; ++k) noise = fmax(noise, j->acq[k].scan.noise);
    const double most = def->max_residual + NOISE * noise;
    if (out->after_median > most)
        return refuse(out,
                      "the scan is %.1f mm from the updated twin (median), %.1f mm are allowed",
                      1e3 * out->after_median, 1e3 * most);
    if (out->seen_share < def->min_seen)
        return refuse(
            out, "the scan shows %.0f %% of the surface over the candidates, %.0f %% are needed",
            100 * out->seen_share, 100 * def->min_seen);
    bool is_same;
    OM_TRY(find_known(j, newest, &is_same));
    if (is_same)
        return refuse(out, "the attachments that explain the scan best are those of the twin");
    if (j->advice && j->advice->present &&
        (j->present.mean < ENOUGH || j->present.mean * CLEARLY <= j->after.mean))
        return refuse(
            out,
            "the twin's own attachments explain the scan nearly as well: mean %.2f mm with %g times "
            "the modulus, %.2f mm with the others",
            1e3 * j->present.mean, j->present_young, 1e3 * j->after.mean);
    if (j->after.mean > CLOSER * j->before.mean)
        return refuse(
            out, "the updated twin is no closer to the scan (mean %.2f mm) than before (%.2f mm)",
            1e3 * j->after.mean, 1e3 * j->before.mean);
    return OM_OK;
}

// After the fit: whether the picture shows tissue where the twin is, and whether the twin is nearer to the scan or not
// much farther. Returns how many acquisitions are not good.
static OmStatus judge_fit(Job* j, int* nbad) {
    const OmMatchDef* def = &j->match->def;
    const size_t n3 = 3 * (size_t)j->match->view.mesh->nvert;
    *nbad = 0;
    for (int k = 0; k < j->nacq && !def->is_unchecked; ++k) {
        OmMatchVerdict* v = &j->out->verdict[j->number[k]];
        OM_TRY(om__match_judge_view(&j->judge, &j->acq[k].scan, j->out->x + (size_t)k * n3, v));
        v->before = j->mean_before[k];
        v->after = j->mean_after[k];
        char* reason = v->reason;
        const size_t size = sizeof v->reason;
        v->is_good = false;
        if (v->other > def->max_other)
            snprintf(
                reason, size,
                "its picture shows something else on %.1f %% of the twin's tissue, %.1f %% are "
                "allowed: are colour and depth of the same moment, and is the tool's pose?",
                100 * v->other, 100 * def->max_other);
        else if (v->empty > def->max_empty)
            snprintf(reason, size,
                     "its picture has no depth on %.0f %% of the tissue, %.0f %% are allowed",
                     100 * v->empty, 100 * def->max_empty);
        else if (j->nacq > 1 && v->after > FARTHER * v->before)
            snprintf(reason, size,
                     "the updated twin is farther from it (mean %.2f mm) than before (%.2f mm)",
                     1e3 * v->after, 1e3 * v->before);
        else
            v->is_good = true;
        v->cause = v->is_good                  ? v->cause
                   : v->empty > def->max_empty ? OM_MATCH_EMPTY
                                               : OM_MATCH_UNKNOWN;
        *nbad += !v->is_good;
    }
    return OM_OK;
}

static void drop_bad(Job* j) {
    int n = 0;
    for (int k = 0; k < j->nacq; ++k)
        if (j->out->verdict[j->number[k]].is_good) {
            j->acq[n] = j->acq[k];
            j->number[n++] = j->number[k];
        }
    j->nacq = n;
}

// ---- interface ------------------------------------------------------------------------------------------------

static OmStatus fit(Job* j, const OmProgress* progress) {
    OmMatchEstimate* out = j->out;
    double now = om_clock_now();
    OM_TRY(create_job(j->match, j->nacq, j->acq, j));
    OM_TRY(om__match_find_evidence(&j->evidence, progress));
    out->seen_share = j->evidence.seen_share;
    out->moved_share = j->evidence.moved_share;
    out->fit_ms += 1e3 * (om_clock_now() - now);
    now = om_clock_now();
    OM_TRY(infer(j));
    out->infer_ms += 1e3 * (om_clock_now() - now);
    now = om_clock_now();
    OM_TRY(try_sets(j, progress));
    if (j->advice && out->choice == 2 + j->advice->nset) OM_TRY(drop_idle(j));
    take_chosen(j);
    OM_TRY(try_present(j));
    out->check_ms += 1e3 * (om_clock_now() - now);
    return OM_OK;
}

// Acquisitions that do not fit are left out as long as others are there.
static OmStatus run(Job* j, int nacq, const OmAcquisition* acq, const OmProgress* progress) {
    double begin = om_clock_now();
    OM_TRY(take_prior(j));
    OmStatus status = check_motion(j->match, nacq, acq, j->out);
    if (status == OM_OK) status = judge_all(j, nacq, acq);
    j->out->judge_ms = 1e3 * (om_clock_now() - begin);
    int nbad = 1;
    while (status == OM_OK && nbad > 0) {
        OM_TRY(fit(j, progress));
        OM_TRY(judge_fit(j, &nbad));
        if (nbad == 0 || nbad == j->nacq) break;
        drop_fit(j);
        drop_bad(j);
    }
    if (status == OM_OK) {
        status = check(j, &acq[nacq - 1]);
        if (status == OM_OK && nbad > 0)
            status = refuse(j->out, "scan %d: %.240s", j->number[0],
                            j->out->verdict[j->number[0]].reason);
        spread_shapes(j, nacq, acq);
    }
    j->out->total_ms = 1e3 * (om_clock_now() - begin);
    return status;
}

OmStatus om_match_update_with(OmMatch* m, int nacq, const OmAcquisition* acq,
                              const OmMatchAdvice* advice, const OmProgress* progress,
                              OmMatchEstimate* out) {
    memset(out, 0, sizeof *out);
    OM_CHECK(nacq > 0 && acq, OM_INVALID, "match: no acquisition");
    for (int a = 0; a < nacq; ++a) OM_TRY(om__match_check_acquisition(m, &acq[a], a));
    OM_TRY(check_advice(m, advice));
    Job j = {.match = m, .advice = advice, .out = out};
    OmStatus status = create_estimate(m, nacq, out);
    if (status == OM_OK) status = run(&j, nacq, acq, progress);
    job_done(&j, nacq);
    if (status < 0) {
        om_match_estimate_done(out);
        return status;
    }
    out->is_accepted = status == OM_OK;
    return OM_OK;
}

OmStatus om_match_judge(OmMatch* m, const OmAcquisition* a, OmMatchVerdict* verdict) {
    double* moved[2] = {NULL, NULL};
    Job j = {.match = m, .moved = moved};
    OmAcquisition one = *a;
    *verdict = (OmMatchVerdict){.is_good = true, .pose_right_scan = om_pose_identity()};
    OM_TRY(om__match_check_acquisition(m, a, 0));
    if (m->def.is_unchecked) return OM_OK;
    OmStatus status = om__match_judge_begin(m, &j.judge);
    if (status == OM_OK) status = judge_one(&j, 0, &one, verdict);
    om__match_judge_done(&j.judge);
    om_free(moved[0]);
    om_free(moved[1]);
    return status;
}

OmStatus om_match_update(OmMatch* m, int nacq, const OmAcquisition* acq, const OmProgress* progress,
                         OmMatchEstimate* out) {
    return om_match_update_with(m, nacq, acq, NULL, progress, out);
}

void om_match_estimate_done(OmMatchEstimate* e) {
    if (!e) return;
    om_free(e->probability);
    om_free(e->uncertainty);
    om_free(e->stiffness);
    om_free(e->attached);
    om_free(e->verdict);
    om_free(e->x);
    memset(e, 0, sizeof *e);
}
