// study_kidney.c: the study of fat over the kidney: its parts, goals and folder.
#include <math.h>
#include <string.h>

#include "omentum/banet_net.h"
#include "studies/study_cases.h"
#include "studies/study_kidney_case.h"

#define COOKIE 0x6b1d4e79u
#define SIDE 0.3  // m, of the thesis's grid: om_banet_default_side of fat of 10 mm, two voxels

OmStudyKidneyDef om_study_kidney_default_def(const char* out_dir, const char* volume) {
    return (OmStudyKidneyDef){
        .out_dir = out_dir, .volume = volume, .nsample = 600, .nrun = 10, .cookie = COOKIE};
}

static OmStatus validate(const OmStudyKidneyDef* d) {
    const StudyRange range[] = {{"nsample", d->nsample, 0, OM_STUDY_KIDNEY_MAX_SAMPLE},
                                {"nrun", d->nrun, 0, OM_STUDY_KIDNEY_MAX_RUN}};
    OM_TRY(STUDY_CHECK("kidney study", d, COOKIE, range));
    OM_CHECK(d->volume, OM_INVALID, "kidney study: no volume");
    OM_CHECK(d->nsample > 0 || d->nrun > 0, OM_INVALID,
             "kidney study: nsample and nrun are 0: nothing to do");
    return OM_OK;
}

KidneyCases om__kidney_make_cases(bool is_quick) {
    KidneyCases c = {.nstate = 1, .state = {1}, .ngrasp = 1, .grasp = {2}, .nlevel = 2};
    if (is_quick) return c;
    c = (KidneyCases){.nstate = KIDNEY_NSTATE, .ngrasp = KIDNEY_NGRASP, .nlevel = KIDNEY_NLEVEL};
    for (int i = 0; i < c.nstate; ++i) c.state[i] = i;
    for (int i = 0; i < c.ngrasp; ++i) c.grasp[i] = i;
    return c;
}

// Without a network nothing is found.
StudyGoals om__kidney_goals(const Kidney* s) {
    const OmStudyKidneySummary* sum = &s->sum;
    const OmStudyKidneyTable* t = &sum->by[OM_STUDY_KIDNEY_ALL];
    const double none = sum->has_network ? 0 : (double)NAN;
    const StudyGoal list[] = {{"samples, network alone: median DSC", "%.2f", sum->dsc.median + none,
                               OM_STUDY_KIDNEY_DSC, false, "0.51"},
                              {"samples, network alone: median AVE", "%.1f mm",
                               1e3 * sum->ave.median + none, 1e3 * OM_STUDY_KIDNEY_AVE, true,
                               "1.4 mm"},
                              {"dissection, all three: mean AVE", "%.1f mm", 1e3 * t->mean + none,
                               1e3 * OM_STUDY_KIDNEY_MEAN, true, "4.0 mm"},
                              {"dissection, all three: AVE of the worst row", "%.1f mm",
                               1e3 * t->worst + none, 1e3 * OM_STUDY_KIDNEY_ROW, true, "8.8 mm"},
                              {"dissection, all three: AVE over that without attachments", "%.2f",
                               t->ratio + none, OM_STUDY_KIDNEY_RATIO, true, "0.22"}};
    StudyGoals goals = {0};
    for (int i = 0; i < 5; ++i)
        if ((i < 2 ? s->def->nsample : s->def->nrun) > 0) goals.goal[goals.n++] = list[i];
    return goals;
}

// ---- the network --------------------------------------------------------------------------------------

static OmStatus estimate(void* ctx, const OmSurface* surface, const double* u, const double* seen,
                         double* probability) {
    return om_banet_estimate(ctx, SIDE, surface, u, seen, probability);
}

static OmStatus load_network(Kidney* s, OmBanetNet** net) {
    OM_TRY(om_banet_net_find(s->def->weights, NULL, net));
    s->sum.has_network = *net != NULL;
    if (!*net) return OM_OK;
    s->estimate = estimate;
    s->estimate_ctx = *net;
    s->net_hash = om_banet_net_hash(*net);
    return OM_OK;
}

// ---- the study ----------------------------------------------------------------------------------------

static OmStatus run(Kidney* s) {
    const OmStudyKidneyDef* d = s->def;
    const bool is_quick = d->is_quick;
    const StudyWork work[] = {{"samples", d->nsample, is_quick ? 1 : 3, true},
                              {"runs", s->cases.nstate * d->nrun, is_quick ? 6 : 40, false}};
    OM_TRY(om__study_estimate_tell(work, 2, d->nworker, s->progress));
    OM_TRY(om__kidney_build_site(&s->scene, OM_SITE_TWIN, -1, &s->twin));
    if (d->nsample > 0) {
        OM_TRY(om__kidney_run_samples(s));
        OM_TRY(om__kidney_summarise_samples(s));
    }
    if (d->nrun > 0) {
        OM_TRY(om__kidney_run_lifts(s));
        OM_TRY(om__kidney_summarise_lifts(s));
    }
    s->sum.is_met = om__goals_met(om__kidney_goals(s));
    return om__kidney_write(s);
}

OmStatus om_study_kidney_run(const OmStudyKidneyDef* def, const OmProgress* progress,
                             OmStudyKidneySummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Kidney s = {.def = def, .progress = progress, .cases = om__kidney_make_cases(def->is_quick)};
    OmFolder folder = {0};
    OmBanetNet* net = NULL;
    OM_TRY(om__kidney_make_scene(def->volume, def->is_quick, &s.scene));
    OM_TRY(load_network(&s, &net));
    s.sample = om_calloc((size_t)def->nsample + KIDNEY_CHUNK, sizeof *s.sample);
    s.result = om_calloc((size_t)(s.cases.nstate * def->nrun) + 1, sizeof *s.result);
    OmStatus status = s.result && s.sample ? OM_OK : OM_NO_MEMORY;
    if (status == OM_OK) status = om_folder_open(def->out_dir, "kidney study", &folder);
    if (status == OM_OK) status = run(&s);
    if (status == OM_OK) *summary = s.sum;
    om_folder_end(&folder);
    om_site_done(&s.twin);
    om_banet_net_destroy(net);
    om_free(s.sample);
    om_free(s.result);
    return status;
}
