// study_retraction_replan.c: epsilon over 17 x 25 grasps (6.5.1) and the time of one plan (Table 6.4).
//
// Table 6.4: for every grid of 5 to 10 blocks along a side and 10 to 70 % of them attached, random states: the ROI
// below a random block, the attached blocks around a random centre in the order of a noisy distance (4.1 in the plane),
// never the ROI's own block. A first plan grounds the program for the grid and is not counted; then each state is
// solved once by the same planner, as in a run. Look-ahead and explanations are off; nothing is executed. The time is
// processor time of this thread.
#include <math.h>
#include <string.h>

#include "studies/study_attach_protocol.h"
#include "studies/study_cases.h"
#include "studies/study_match_case.h"
#include "studies/study_retraction_internal.h"

#define STATE_SEED 640425
#define NSTATE 25
#define QUICK_NSTATE 2
#define SIDE 0.12  // m, of the sheet
#define NLAYOUT 17

// ---- epsilon ----------------------------------------------------------------------------------------------------

OmStatus om__retraction_run_threshold(Retraction* s) {
    RetractionThreshold* t = &s->threshold;
    RetractionCase c = om__retraction_lab(2, s->def->is_quick);
    OmScene scene;
    OmText text = {0};
    c.group = RETRACTION_SCENARIO;  // the sheet of the scenarios, with layouts of its own
    c.share = 0.3;
    OM_TRY(om__retraction_scene(&c, RETRACTION_TRUE, &scene));
    scene.attach.share_min = 0.1;
    scene.attach.share_max = 0.5;
    scene.roi.is_random = true;
    snprintf(scene.name, sizeof scene.name, "threshold");
    OM_TRY(om_scene_print(&scene, false, &text));
    uint64_t hash = om_hash(text.str, text.len, OM_HASH_SEED);
    om_text_done(&text);
    s->has_threshold = om__match_load_result(s->def->out_dir, "threshold.bin", hash, t, sizeof *t);
    s->sum.nrun += s->has_threshold || s->def->parts & OM_RETRACTION_THRESHOLD;
    if (s->has_threshold || !(s->def->parts & OM_RETRACTION_THRESHOLD)) return OM_OK;
    memset(t, 0, sizeof *t);
    t->nlayout = s->def->is_quick ? 1 : NLAYOUT;
    ++s->sum.nnew;
    const StudyWork work = {"layouts for the threshold", t->nlayout, s->def->is_quick ? 1 : 12,
                            true};
    OM_TRY(om__study_estimate_tell(&work, 1, s->def->nworker, s->progress));
    OM_TRY(om_retract_calibrate_force(&scene, NULL, t->nlayout, s->def->nworker, s->progress,
                                      &t->force));
    s->has_threshold = true;
    return om__match_save_result(s->def->out_dir, "threshold.bin", hash, t, sizeof *t);
}

// ---- Table 6.4 ------------------------------------------------------------------------------------------------------

typedef struct Ranked {
    double distance;
    int block;
} Ranked;

void om__retraction_random_state(int n, double share, int k, OmSituation* now) {
    OmRng rng = om_rng_init(STATE_SEED, (uint64_t)(10000 * n + 1000 * (int)lround(10 * share) + k));
    Ranked order[OM_PLAN_MAX_BLOCK];
    om_situation_init(now, n, SIDE / n);
    const int nblock = n * n, roi = (int)om_rng_below(&rng, (uint32_t)nblock);
    const int center = (int)om_rng_below(&rng, (uint32_t)nblock);
    int nfixed = (int)lround(share * nblock), norder = 0;
    now->is_above_roi[roi] = true;
    for (int b = 0; b < nblock; ++b) {
        Ranked r = {hypot(b % n - center % n, b / n - center / n) + om_rng_range(&rng, 0, 0.25 * n),
                    b};
        int i = b == roi ? -1 : norder++;
        for (; i > 0 && order[i - 1].distance > r.distance; --i) order[i] = order[i - 1];
        if (i >= 0) order[i] = r;
    }
    for (int i = 0; i < nfixed && i < norder; ++i) now->is_fixed[order[i].block] = true;
}

// Times of one cell of the table.
static OmStatus time_cell(OmPlanner* planner, int g, int f, RetractionReplan* r) {
    static const double share[OM_RETRACTION_NSHARE] = {0.1, 0.3, 0.5, 0.7};
    double sum = 0, sum2 = 0;
    OmSituation now;
    OmPlan plan;
    for (int k = -1; k < r->nstate; ++k) {
        om__retraction_random_state(5 + g, share[f], k < 0 ? 999 : k, &now);
        double begin = 1e-3 * om__attach_thread_ms();
        OmStatus status = om_planner_solve(planner, &now, &plan);
        double t = 1e-3 * om__attach_thread_ms() - begin;
        OM_TRY(status);
        if (k < 0) continue;
        r->nunsat[g][f] += status == OM_UNSAT;
        sum += t;
        sum2 += t * t;
    }
    const int n = r->nstate;  // at least 2
    r->mean[g][f] = sum / n;
    r->sd[g][f] = sqrt(fmax(0, sum2 - sum * sum / n) / (n - 1));
    return OM_OK;
}

OmStatus om__retraction_run_replan(Retraction* s) {
    RetractionReplan* r = &s->replan;
    const int nstate = s->def->is_quick ? QUICK_NSTATE : NSTATE;
    const uint64_t hash =
        om_hash(om_planner_program(), strlen(om_planner_program()), (uint64_t)nstate);
    s->has_replan = om__match_load_result(s->def->out_dir, "replan.bin", hash, r, sizeof *r);
    s->sum.nrun += s->has_replan || s->def->parts & OM_RETRACTION_REPLANNING;
    if (s->has_replan || !(s->def->parts & OM_RETRACTION_REPLANNING)) return OM_OK;
    memset(r, 0, sizeof *r);
    r->nstate = nstate;
    ++s->sum.nnew;
    const StudyWork work = {"plans", nstate * OM_RETRACTION_NGRID * OM_RETRACTION_NSHARE, 0.02,
                            true};
    OM_TRY(om__study_estimate_tell(&work, 1, 1, s->progress));
    for (int g = 0; g < OM_RETRACTION_NGRID; ++g) {
        OM_TRY(om_progress_report(s->progress, "plans", g, OM_RETRACTION_NGRID));
        OmPlannerDef def = om_planner_default_def();
        OmPlanner* planner;
        OM_TRY(om_planner_create(&def, &planner));
        OmStatus status = OM_OK;
        for (int f = 0; f < OM_RETRACTION_NSHARE && status >= 0; ++f)
            status = time_cell(planner, g, f, r);
        om_planner_destroy(planner);
        OM_TRY(status);
    }
    s->has_replan = true;
    return om__match_save_result(s->def->out_dir, "replan.bin", hash, r, sizeof *r);
}
