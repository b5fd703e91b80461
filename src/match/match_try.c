// match_try.c: how far scans are from the twin at rest with stated attachments.
//
// The twin is brought to rest for each acquisition, and each point of a scan is paired with the nearest point of the
// surface that faces the camera. The mean takes each distance at most as CAP: points of another organ, and parts of the
// twin that no attachments bring to the scan, would decide otherwise.
#include <string.h>

#include "match/match_internal.h"

#define CAP 0.005  // m, that a scan point counts at most in the mean distance
#define FIRST_NEWTON 12
// Iterations where the first ones find no rest. In a fold of scenes/belief.yaml attachments that brought the twin from
// 5.1 to 0.9 mm were refused after 60; 67 found the rest.
#define MORE_NEWTON 120
#define TOLERANCE 2e-4  // m, of a displacement in an iteration

OmStatus om__match_check_acquisition(OmMatch* m, const OmAcquisition* a, int k) {
    OmStatus status = om_scan_check(&a->scan);
    if (status < 0) return om_error_prefix(status, "acquisition %d", k);
    OM_CHECK(a->ngrasp >= 0 && a->ngrasp <= OM_MAX_ARM, OM_INVALID,
             "acquisition %d: %d grasps, at most %d", k, a->ngrasp, OM_MAX_ARM);
    status = om__match_find_held(m, a->ngrasp, a->grasp, &m->held);
    if (status < 0) return om_error_prefix(status, "acquisition %d", k);
    for (int i = 0; a->x_twin && i < m->view.mesh->nvert; ++i)
        OM_CHECK(om_is_finite3(om_load3(a->x_twin, i)), OM_INVALID,
                 "acquisition %d: position of vertex %d of the twin is not finite", k, i);
    return OM_OK;
}

OmStatus om__match_trier_begin(OmMatch* m, int nacq, const OmAcquisition* acq, MatchTrier* t) {
    int most = 1, all = 1;
    for (int a = 0; a < nacq; ++a) {
        most = acq[a].scan.npoint > most ? acq[a].scan.npoint : most;
        all += acq[a].scan.npoint;
    }
    *t = (MatchTrier){.match = m, .nacq = nacq, .acq = acq};
    OM_TRY(om__match_fit_begin(m, most, &t->fit));
    OM_ALLOC(t->spring, m->view.ncandidate);
    OM_ALLOC(t->distance, all);
    OM_ALLOC(t->mean, nacq);
    return OM_OK;
}

void om__match_trier_done(MatchTrier* t) {
    om__match_fit_done(&t->fit);
    om_free(t->spring);
    om_free(t->distance);
    om_free(t->mean);
}

OmStatus om__match_measure(MatchTrier* t, const double* x, OmMatchTrial* out) {
    size_t n3 = 3 * (size_t)t->match->view.mesh->nvert;
    int n = 0;
    *out = (OmMatchTrial){.is_at_rest = true};
    for (int a = 0; a < t->nacq; ++a) {
        OM_TRY(om__match_pairs(&t->fit, &t->acq[a].scan, x + (size_t)a * n3));
        t->mean[a] = 0;
        for (int i = 0; i < t->acq[a].scan.npoint; ++i) {
            t->distance[n++] = fmin(t->fit.distance[i], 1.0);
            t->mean[a] += fmin(t->fit.distance[i], CAP) / t->acq[a].scan.npoint;
        }
    }
    om_sort_doubles(t->distance, n);
    for (int i = 0; i < n; ++i) out->mean += fmin(t->distance[i], CAP) / n;
    if (n == 0) return OM_OK;
    out->median = t->distance[n / 2];
    out->p90 = t->distance[n * 9 / 10];
    return OM_OK;
}

OmStatus om__match_try(MatchTrier* t, const unsigned char* attached, double* x, OmMatchTrial* out) {
    OmMatch* m = t->match;
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    bool is_at_rest = true;
    for (int i = 0; i < m->view.ncandidate; ++i)
        t->spring[i] = attached[m->candidate[i]] ? m->def.foundation * m->area[i] : 0;
    for (int a = 0; a < t->nacq; ++a) {
        OmMatchLoad load = {.spring = t->spring,
                            .ngrasp = t->acq[a].ngrasp,
                            .grasp = t->acq[a].grasp,
                            .young = t->young,
                            .max_newton = FIRST_NEWTON,
                            .tolerance = TOLERANCE};
        OmStatus status = om_match_find_rest(m, &load, x + (size_t)a * n3, NULL);
        load.max_newton = MORE_NEWTON;
        if (status == OM_NOT_CONVERGED)
            status = om_match_find_rest(m, &load, x + (size_t)a * n3, NULL);
        if (status < 0) return om_error_prefix(status, "acquisition %d", a);
        is_at_rest = is_at_rest && status == OM_OK;
        if (!is_at_rest && t->needs_rest) {
            *out = (OmMatchTrial){.is_at_rest = false};
            return OM_OK;
        }
    }
    OM_TRY(om__match_measure(t, x, out));
    out->is_at_rest = is_at_rest;
    return OM_OK;
}

OmStatus om_match_try(OmMatch* m, int nacq, const OmAcquisition* acq, const unsigned char* attached,
                      double* x, OmMatchTrial* trial) {
    memset(trial, 0, sizeof *trial);
    OM_CHECK(nacq > 0 && acq && attached, OM_INVALID, "match: no acquisition or no attachments");
    for (int a = 0; a < nacq; ++a) OM_TRY(om__match_check_acquisition(m, &acq[a], a));
    MatchTrier t = {0};
    OmStatus status = om__match_trier_begin(m, nacq, acq, &t);
    if (status == OM_OK) status = om__match_try(&t, attached, x, trial);
    om__match_trier_done(&t);
    if (status < 0) return status;
    return trial->is_at_rest ? OM_OK : OM_NOT_CONVERGED;
}
