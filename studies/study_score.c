// study_score.c: errors, stability and times of the runs, and the acceptance criteria.
//
// As in the thesis (3.7), the error of a deformation counts only if every method completed it on that mesh
// and lesion; otherwise a method that fails early would avoid its largest errors.
#include <math.h>
#include <string.h>

#include "studies/study_internal.h"

#define ERROR_SLACK 0.3  // mm, by which a mesh may be worse than the finest
#define SLACK_NTET 2500  // number of elements from which this is required
#define NMETHOD OM_STUDY_NMETHOD
#define NDEPTH OM_STUDY_NDEPTH

const StudyRun* om__study_run_at(const Study* s, int resolution, int method, int lesion) {
    return &s->run[(resolution * NMETHOD + method) * s->nlesion + lesion];
}

double om__study_error(const Study* s, const StudyRun* run, int depth) {
    if (run->nreached <= depth || s->truth[run->lesion].ndepth <= depth) return -1;
    OmVec3 measured = om__study_measured(s->def, &s->truth[run->lesion], depth);
    return om_distance(run->reached[depth].lesion, measured);
}

double om__study_contour_error(const Study* s, int method, int lesion, int depth) {
    if (s->truth[lesion].ndepth <= depth) return -1;
    const OmVec3 x = om__study_measured_contour(s->def, &s->truth[lesion], depth);
    if (method == NMETHOD) {
        const OmStudyLesion* l = &s->def->body->lesion[lesion];
        return om_distance(om_madd(om__study_contour(l), -s->def->depth[depth], l->normal), x);
    }
    const StudyRun* run = om__study_run_at(s, 0, method, lesion);
    return run->nreached > depth ? om_distance(run->reached[depth].contour, x) : -1;
}

// Did every method of the study complete this deformation?
static bool is_valid(const Study* s, int resolution, int lesion, int depth) {
    if (s->truth[lesion].ndepth <= depth) return false;
    for (int m = 0; m < NMETHOD; ++m)
        if (s->def->has_method[m] && om__study_run_at(s, resolution, m, lesion)->nreached <= depth)
            return false;
    return true;
}

static void score_cell(const Study* s, int k, int m, double* value, StudyCell* cell) {
    int n = 0, finest = s->def->nresolution - 1;
    for (int l = 0; l < s->nlesion; ++l) {
        const StudyRun* run = om__study_run_at(s, k, m, l);
        if (!run->nrecord) continue;
        cell->ntet = run->ntet;
        value[n++] = 100.0 * run->ndone / run->nstep;
    }
    cell->nrun = n;
    cell->stability = om__study_sample(value, n);
    n = 0;
    for (int l = 0; l < s->nlesion; ++l) {
        const StudyRun* run = om__study_run_at(s, k, m, l);
        for (int i = 0; i < run->nrecord; ++i) value[n++] = run->step[i].ms;
    }
    cell->ms = om__study_sample(value, n);
    double sum = 0;
    n = 0;
    int nfinest = 0;
    for (int l = 0; l < s->nlesion && cell->nrun; ++l) {
        for (int d = 0; d < NDEPTH; ++d) {
            if (!is_valid(s, k, l, d)) continue;
            value[n++] = 1e3 * om__study_error(s, om__study_run_at(s, k, m, l), d);
            double best = om__study_error(s, om__study_run_at(s, finest, m, l), d);
            if (best < 0) continue;
            sum += 1e3 * best;
            ++nfinest;
        }
    }
    cell->error = om__study_sample(value, n);
    cell->finest = nfinest ? sum / nfinest : 0;
}

// The criteria that a cell misses, in words.
static void judge_cell(const Study* s, int k, int m, StudyCell* cell) {
    const StudyRun* worst = NULL;
    int nshort = 0;
    for (int l = 0; l < s->nlesion; ++l) {
        const StudyRun* run = om__study_run_at(s, k, m, l);
        if (!run->nrecord || run->ndone == run->nstep) continue;
        ++nshort;
        if (!worst || run->ndone < worst->ndone) worst = run;
    }
    int used = 0;
    if (nshort)
        used = snprintf(cell->why, sizeof cell->why,
                        "paths that end early: %d of %d; lesion %d at %.1f mm: %.120s", nshort,
                        cell->nrun, worst->lesion + 1,
                        1e3 * worst->ndone * s->def->speed * s->def->time_step, worst->reason);
    if (cell->ntet >= SLACK_NTET && cell->error.n && cell->error.mean > cell->finest + ERROR_SLACK)
        used += snprintf(cell->why + used, sizeof cell->why - (size_t)used,
                         "%serror %.2f mm worse than on the finest mesh", used ? "; " : "",
                         cell->error.mean - cell->finest);
    if (!cell->nrun) snprintf(cell->why, sizeof cell->why, "not run");
    cell->is_met = !cell->why[0];
}

static void score_depths(const Study* s, double* value, StudyScore* score) {
    for (int d = 0; d < NDEPTH; ++d) {
        for (int m = 0; m <= NMETHOD; ++m) {
            int n = 0;
            for (int k = 0; k < s->def->nresolution; ++k) {
                for (int l = 0; l < s->nlesion; ++l) {
                    if (m < NMETHOD && (!is_valid(s, k, l, d) || !s->def->has_method[m])) continue;
                    if (m < NMETHOD) {
                        double e = om__study_error(s, om__study_run_at(s, k, m, l), d);
                        if (e >= 0) value[n++] = 1e3 * e;
                    } else if (k == 0 && s->truth[l].ndepth > d) {
                        const OmStudyLesion* lesion = &s->def->body->lesion[l];
                        OmVec3 rigid = om_madd(lesion->center, -s->def->depth[d], lesion->normal);
                        value[n++] =
                            1e3 * om_distance(rigid, om__study_measured(s->def, &s->truth[l], d));
                    }
                }
            }
            score->by_depth[m][d] = om__study_sample(value, n);
        }
    }
}

// One of three measures of the truth at every depth that it reached: 0 difference of the meshes, mm; 1 of
// their forces, %; 2 the mean gap, mm.
static StudySample sample_truth(const Study* s, int what, double* value) {
    int n = 0;
    for (int l = 0; l < s->nlesion; ++l) {
        for (int d = 0; d < s->truth[l].ndepth; ++d) {
            const StudyTruthDepth* t = &s->truth[l].at[d];
            value[n++] = what == 0   ? 1e3 * om_distance(t->fine, t->coarse)
                         : what == 1 ? 100 * fabs(t->coarse_force / t->force - 1)
                                     : 1e3 * fabs(t->sink);
        }
    }
    return om__study_sample(value, n);
}

static void summarise(const Study* s, StudyScore* score) {
    OmStudyContactSummary* out = &score->sum;
    out->nnew = s->nmade;
    out->worst_stability = 1;
    for (int i = 0; i < s->nrun; ++i) {
        const StudyRun* run = &s->run[i];
        if (!run->nrecord) continue;
        out->nrun++;
        out->ncomplete += run->ndone == run->nstep;
        out->worst_stability = fmin(out->worst_stability, (double)run->ndone / run->nstep);
    }
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < OM_STUDY_NMETHOD; ++m) {
            out->ncell += s->def->has_method[m];
            out->ncell_met += score->cell[k][m].is_met;
        }
    }
}

OmStatus om__study_score(const Study* s, StudyScore* score) {
    memset(score, 0, sizeof *score);
    size_t room = (size_t)s->nlesion * OM_STUDY_MAX_STEP;
    size_t by_depth = (size_t)s->def->nresolution * (size_t)s->nlesion * NDEPTH;
    double* value = om_alloc(room > by_depth ? room : by_depth, sizeof *value);
    if (!value) return OM_NO_MEMORY;
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < NMETHOD; ++m) {
            if (!s->def->has_method[m]) continue;
            score_cell(s, k, m, value, &score->cell[k][m]);
            judge_cell(s, k, m, &score->cell[k][m]);
        }
    }
    score_depths(s, value, score);
    score->refinement = sample_truth(s, 0, value);
    score->force_check = sample_truth(s, 1, value);
    score->sink = sample_truth(s, 2, value);
    summarise(s, score);
    om_free(value);
    return OM_OK;
}
