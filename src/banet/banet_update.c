// banet_update.c: attachments by network and physics.
//
// 1. For each acquisition: the twin at that time, its correspondence with the scan, the displacement of its surface.
//    With is_corrected the twin is first given the attachments of physics alone: a twin without attachments slides
//    along with the tool, and the correspondence with it.
// 2. The network's probability of each vertex of the surface.
// 3. All views fused. The weight of a view at a vertex falls with the distance to the nearest seen vertex.
// 4. om_match_update_with: evidence of the scans, the fused probability as advice, and its sets to try.
//
// Rejected (doc/notes/banet.md):
// - log-odds of the network added to the evidence of the scans instead of mixed with the prior: mean DSC 0.47 to 0.52
//   instead of 0.55, because errors of the network are smooth and add up over a patch;
// - a grid of 0.3 m: 0.60 from three views instead of 0.66 with 0.15 m.
#include "omentum/banet_update.h"

#include <string.h>

#include "banet/banet_net_internal.h"
#include "omentum/banet_view.h"
#include "omentum/shape_points.h"

#define COOKIE 0xba2e70d1u
#define MAX_TRY 4
#define SEEN 0.1   // a vertex above this counts as seen
#define ODDS 2.5   // of the lower and higher thresholds to that of the network
#define MOST 0.98  // threshold; the odds of 1 are infinite

#define THIN 0.006  // m; a thinner body has a grid of smaller side

struct OmBanetUpdater {
    OmBanetUpdateDef def;
    const OmMatchView* view;
    OmBanetGrid grid;  // with a net
    OmBanetPredictor* predictor;
    int* cell;        // of each surface vertex
    float *in, *out;  // of the predictor
    OmMatchLive* live;
    unsigned char* last;             // attachments that the twin has  (nvert)
    unsigned char* set;              // to try                         (MAX_TRY x nvert)
    double *u, *seen, *probability;  // of surface vertices
    double* seen_x;                  // positions of the seen ones
};

typedef struct Work {  // of one call
    OmBanetUpdater* updater;
    int nacq;
    OmAcquisition* acq;  // with x_twin
    double* x_twin;      // of acquisitions that come without  (nacq x nvert x 3)
    OmBanetView* view;
    double* shown;            // of each view                       (nacq x nvert)
    OmMatchEstimate physics;  // alone, if the correspondence goes through it and it is accepted
    int nview;
    OmBanetAdvice* advice;
} Work;

// ---- definition ------------------------------------------------------------------------------------------------

OmBanetUpdateDef om_banet_update_default_def(OmMatch* match) {
    return (OmBanetUpdateDef){.match = match,
                              .fuse = om_banet_fuse_default_def(),
                              .side = om_banet_default_side(om_match_view(match)->surface),
                              .weight = 0.7,
                              .reach = 0.015,
                              .ntry = 2,
                              .nworker = 1,
                              .cookie = COOKIE};
}

double om_banet_default_side(const OmSurface* surface) {
    double volume = 0, area = 0;
    for (int t = 0; t < surface->ntri; ++t) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(surface->x, v[0]), b = om_load3(surface->x, v[1]);
        OmVec3 c = om_load3(surface->x, v[2]);
        OmVec3 n = om_cross(om_sub(b, a), om_sub(c, a));
        volume += om_dot(n, a) / 6;
        area += 0.5 * om_norm(n);
    }
    return 2 * fabs(volume) < THIN * area ? OM_BANET_NARROW : OM_BANET_WIDE;
}

static OmStatus check_def(const OmBanetUpdateDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmBanetUpdateDef was not made by om_banet_update_default_def");
    OM_CHECK(d->match, OM_INVALID, "OmBanetUpdateDef.match is null");
    OM_CHECK(!d->net || !d->estimate, OM_INVALID,
             "OmBanetUpdateDef has both a net and a function in place of it");
    OM_CHECK(d->threshold >= 0 && d->threshold < 1, OM_INVALID,
             "OmBanetUpdateDef.threshold = %g, must be at least 0 and below 1", d->threshold);
    OM_CHECK(d->side > 0 && isfinite(d->side), OM_INVALID,
             "OmBanetUpdateDef.side = %g m, must be above 0", d->side);
    OM_CHECK(d->weight >= 0 && d->weight <= 1, OM_INVALID,
             "OmBanetUpdateDef.weight = %g, must be 0 to 1", d->weight);
    OM_CHECK(d->reach > 0 && isfinite(d->reach), OM_INVALID,
             "OmBanetUpdateDef.reach = %g m, must be above 0", d->reach);
    OM_CHECK(d->ntry >= 0 && d->ntry <= MAX_TRY, OM_INVALID,
             "OmBanetUpdateDef.ntry = %d, must be 0 to %d", d->ntry, MAX_TRY);
    OM_CHECK(d->nworker >= 0, OM_INVALID, "OmBanetUpdateDef.nworker = %d, must be at least 0",
             d->nworker);
    double p;  // validates `fuse`
    return om_banet_fuse(&d->fuse, 0, NULL, 1, &p);
}

// A note for each reason to trust the network less.
static OmStatus check_network(const OmBanetUpdater* u) {
    OmText note = {0};
    const OmStatus status = om_banet_net_check(u->def.net, u->def.side, NULL, &note);
    for (const char* line = note.str; status == OM_OK && line && *line;) {
        const int n = (int)strcspn(line, "\n");
        om_log(OM_LOG_WARNING, "BA-Net: %.*s", n, line);
        line += n + 1;
    }
    om_text_done(&note);
    return status;
}

// The grid of the network around the body, once: its code is made for this size.
static OmStatus make_network(OmBanetUpdater* u) {
    const OmSurface* surface = u->view->surface;
    const int* dim = u->grid.dim;
    OM_TRY(check_network(u));
    OM_TRY(om_banet_grid_fit(surface, u->def.side, &u->grid));
    // One worker: the bytes of oneDNN depend on the number of threads.
    OM_TRY(om_banet_predictor_create(u->def.net, dim, 1, &u->predictor));
    size_t ncell = (size_t)dim[0] * (size_t)dim[1] * (size_t)dim[2];
    OM_ALLOC(u->cell, surface->nvert);
    OM_ALLOC(u->in, OM_BANET_NCHANNEL * ncell);
    OM_ALLOC(u->out, ncell);
    om_banet_find_cells(&u->grid, surface, u->cell);
    return OM_OK;
}

// An OmBanetEstimateFn of the net.
static OmStatus estimate_by_net(void* ctx, const OmSurface* surface, const double* du,
                                const double* seen, double* probability) {
    OmBanetUpdater* u = ctx;
    OM_TRY(om_banet_voxelize(&u->grid, surface, du, seen, u->in));
    OM_TRY(om_banet_predict(u->predictor, u->in, u->out));
    for (int i = 0; i < surface->nvert; ++i)
        probability[i] = u->cell[i] < 0 ? 0 : (double)u->out[u->cell[i]];
    return OM_OK;
}

static OmStatus make(OmBanetUpdater* u) {
    OmMatchLiveDef live = om_match_live_default_def(u->def.match);
    live.nworker = u->def.nworker;
    OM_TRY(om_match_live_create(&live, &u->live));
    size_t nvert = (size_t)u->view->mesh->nvert, n = (size_t)u->view->surface->nvert;
    OM_ALLOC(u->set, MAX_TRY * nvert);
    OM_ALLOC(u->u, 3 * n);
    OM_ALLOC(u->seen, n);
    OM_ALLOC(u->probability, n);
    OM_ALLOC(u->seen_x, 3 * n);
    u->last = om_calloc(nvert, 1);
    if (!u->last) return OM_NO_MEMORY;
    if (u->def.net && !u->def.estimate) {
        OM_TRY(make_network(u));
        u->def.estimate = estimate_by_net;
        u->def.estimate_ctx = u;
    }
    const OmMeshSet* set = om_tet_mesh_find_set(u->view->mesh, "attachment");
    for (int i = 0; set && i < set->nvert; ++i) u->last[set->vert[i]] = 1;
    return OM_OK;
}

OmStatus om_banet_updater_create(const OmBanetUpdateDef* def, OmBanetUpdater** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmBanetUpdater* u = om_calloc(1, sizeof *u);
    if (!u) return OM_NO_MEMORY;
    u->def = *def;
    u->view = om_match_view(def->match);
    OmStatus status = make(u);
    if (status < 0)
        om_banet_updater_destroy(u);
    else
        *out = u;
    return status;
}

void om_banet_updater_destroy(OmBanetUpdater* u) {
    if (!u) return;
    om_match_live_destroy(u->live);
    om_banet_predictor_destroy(u->predictor);
    om_free(u->cell);
    om_free(u->in);
    om_free(u->out);
    om_free(u->last);
    om_free(u->set);
    om_free(u->u);
    om_free(u->seen);
    om_free(u->probability);
    om_free(u->seen_x);
    om_free(u);
}

void om_banet_updater_set_attached(OmBanetUpdater* u, const unsigned char* attached) {
    memcpy(u->last, attached, (size_t)u->view->ncorner);
    om_match_live_set_attached(u->live, attached);
}

void om_banet_advice_done(OmBanetAdvice* a) {
    if (!a) return;
    om_free(a->view);
    om_free(a->probability);
    memset(a, 0, sizeof *a);
}

OmStatus om_banet_advice_intersect(const OmBanetAdvice* a, double threshold,
                                   unsigned char* attached) {
    OmBanetView* view;
    int nview = 0;
    OM_ALLOC(view, (size_t)a->nacquisition);
    for (int k = 0; k < a->nacquisition; ++k) {
        const double* p = a->view + (size_t)k * (size_t)a->nvert;
        int v = 0;
        while (v < a->nvert && p[v] <= 0) ++v;
        if (v < a->nvert) view[nview++] = (OmBanetView){.probability = p, .grasp = k};
    }
    OmStatus status = om_banet_intersect_grasps(nview, view, threshold, a->nvert, attached);
    om_free(view);
    return status;
}

// ---- one acquisition --------------------------------------------------------------------------------------------

// The twin of acquisition a: given, or at rest with the last attachments.
static OmStatus find_twin(Work* w, int a) {
    OmBanetUpdater* u = w->updater;
    size_t n3 = 3 * (size_t)u->view->mesh->nvert;
    if (w->acq[a].x_twin) return OM_OK;
    double* x = w->x_twin + (size_t)a * n3;
    OmMatchTrial trial;
    memcpy(x, u->view->mesh->x, n3 * sizeof *x);
    OmStatus status = om_match_try(u->def.match, 1, &w->acq[a], u->last, x, &trial);
    if (status < 0) return om_error_prefix(status, "acquisition %d", a);
    w->acq[a].x_twin = x;
    return OM_OK;
}

// How well the view shows the surroundings of each vertex of the surface.
static OmStatus find_shown(OmBanetUpdater* u, double* shown) {
    const OmSurface* s = u->view->surface;
    OmPointTree* tree;
    int n = 0;
    for (int i = 0; i < s->nvert; ++i)
        if (u->seen[i] > SEEN) om_store3(u->seen_x, n++, om_load3(s->x, i));
    if (n > 0) OM_TRY(om_point_tree_create(n, u->seen_x, &tree));
    for (int i = 0; i < s->nvert; ++i) {
        double d = HUGE_VAL;
        if (n > 0) om_point_tree_find(tree, om_load3(s->x, i), &d);
        d /= u->def.reach;  // above 0
        shown[u->view->surface_vert[i]] = 1 / (1 + d * d);
    }
    if (n > 0) om_point_tree_destroy(tree);
    return OM_OK;
}

// The number of the first acquisition with the same grasps.
static int find_grasp(const Work* w, int a) {
    const OmAcquisition* b = &w->acq[a];
    for (int k = 0; k < a; ++k) {
        bool is_same = w->acq[k].ngrasp == b->ngrasp;
        for (int g = 0; g < b->ngrasp && is_same; ++g)
            is_same = om_distance(w->acq[k].grasp[g].pose_world_grasp.p,
                                  b->grasp[g].pose_world_grasp.p) < w->updater->view->edge;
        if (is_same) return k;
    }
    return a;
}

// Displacement of the visible surface; *is_lost: the correspondence is not found.
static OmStatus find_displacement(Work* w, int a, bool* is_lost) {
    OmBanetUpdater* u = w->updater;
    OmAcquisition* acq = &w->acq[a];
    double begin = om_clock_now();
    OmMatchPairs pairs;
    size_t n3 = 3 * (size_t)u->view->mesh->nvert;
    const double* x = w->physics.is_accepted ? w->physics.x + (size_t)a * n3 : acq->x_twin;
    OmStatus status = om_match_find_pairs(u->live, &acq->scan, acq->ngrasp, acq->grasp, x, &pairs);
    if (status < 0) return om_error_prefix(status, "acquisition %d", a);
    *is_lost = pairs.is_lost;
    if (pairs.is_lost && !w->advice->reason[0])
        snprintf(w->advice->reason, sizeof w->advice->reason, "acquisition %d: %.200s", a,
                 pairs.reason);
    om_banet_measure(u->view, &pairs, u->u, u->seen);
    om_match_pairs_done(&pairs);
    w->advice->pairs_ms += 1e3 * (om_clock_now() - begin);
    return OM_OK;
}

static OmStatus add_view(Work* w, int a) {
    OmBanetUpdater* u = w->updater;
    const OmMatchView* view = u->view;
    size_t nvert = (size_t)view->mesh->nvert;
    bool is_lost = true;
    OmMatchVerdict verdict;
    OM_TRY(om_match_judge(u->def.match, &w->acq[a], &verdict));
    if (!verdict.is_good && !w->advice->reason[0])
        snprintf(w->advice->reason, sizeof w->advice->reason, "acquisition %d: %.200s", a,
                 verdict.reason);
    if (!verdict.is_good) return OM_OK;  // the network believes it no more than physics does
    OM_TRY(find_displacement(w, a, &is_lost));
    if (is_lost) return OM_OK;
    double begin = om_clock_now();
    double *p = w->advice->view + (size_t)a * nvert, *shown = w->shown + (size_t)a * nvert;
    OM_TRY(u->def.estimate(u->def.estimate_ctx, view->surface, u->u, u->seen, u->probability));
    for (int i = 0; i < view->surface->nvert; ++i) {
        OM_CHECK(u->probability[i] >= 0 && u->probability[i] <= 1, OM_INVALID,
                 "banet: the network gives %g as probability of vertex %d", u->probability[i], i);
        p[view->surface_vert[i]] = u->probability[i];
    }
    OM_TRY(find_shown(u, shown));
    w->view[w->nview++] = (OmBanetView){
        .probability = p, .shown = shown, .grasp = find_grasp(w, a), .age = -w->acq[a].time};
    w->advice->network_ms += 1e3 * (om_clock_now() - begin);
    return OM_OK;
}

// ---- all of them ------------------------------------------------------------------------------------------------

static OmStatus work_init(Work* w, const OmAcquisition* acq) {
    size_t n = (size_t)w->nacq, nvert = (size_t)w->updater->view->mesh->nvert;
    OM_ALLOC(w->acq, n);
    memcpy(w->acq, acq, n * sizeof *acq);
    OM_ALLOC(w->view, n);
    OM_ALLOC(w->x_twin, 3 * n * nvert);
    w->shown = om_calloc(n * nvert, sizeof *w->shown);
    w->advice->view = om_calloc(n * nvert, sizeof *w->advice->view);
    w->advice->probability = om_calloc(nvert, sizeof *w->advice->probability);
    w->advice->nvert = (int)nvert;
    w->advice->nacquisition = w->nacq;
    return w->shown && w->advice->view && w->advice->probability ? OM_OK : OM_NO_MEMORY;
}

static void work_done(Work* w) {
    om_free(w->acq);
    om_free(w->view);
    om_free(w->x_twin);
    om_free(w->shown);
    om_match_estimate_done(&w->physics);
}

// The twin with the attachments of physics alone, where they are accepted.
static OmStatus correct_twin(Work* w, const OmProgress* progress) {
    OmBanetUpdater* u = w->updater;
    OM_TRY(om_match_update(u->def.match, w->nacq, w->acq, progress, &w->physics));
    if (w->physics.is_accepted) om_match_live_set_attached(u->live, w->physics.attached);
    return OM_OK;
}

static OmStatus use_network(Work* w, const OmProgress* progress) {
    OmBanetUpdater* u = w->updater;
    const OmMatchView* view = u->view;
    for (int a = 0; a < w->nacq; ++a) {
        OM_TRY(add_view(w, a));
        OM_TRY(om_progress_report(progress, "network", a + 1, w->nacq));
    }
    double newest = -HUGE_VAL;
    for (int k = 0; k < w->nview; ++k) newest = fmax(newest, -w->view[k].age);
    for (int k = 0; k < w->nview; ++k) w->view[k].age += newest;
    w->advice->nused = w->nview;
    if (w->nview == 0) return OM_OK;
    OM_TRY(
        om_banet_fuse(&u->def.fuse, w->nview, w->view, view->mesh->nvert, w->advice->probability));
    for (int v = 0; v < view->mesh->nvert; ++v)
        if (view->surface_of[v] < 0) w->advice->probability[v] = 0;
    return OM_OK;
}

// Where the network's set ends.
static OmStatus find_threshold(const OmBanetUpdater* u, const double* probability,
                               double* threshold) {
    const OmMatchView* view = u->view;
    double* p;
    *threshold = u->def.threshold;
    if (*threshold > 0) return OM_OK;
    OM_ALLOC(p, view->ncandidate);
    for (int i = 0; i < view->ncandidate; ++i) p[i] = probability[view->candidate[i]];
    OmStatus status = om_banet_choose_threshold(view->ncandidate, p, 0, threshold);
    *threshold = fmin(*threshold, MOST);
    om_free(p);
    return status;
}

static void add_level(OmBanetUpdater* u, const double* probability, double threshold, double odds,
                      OmMatchAdvice* advice) {
    double level = odds * threshold / (1 - threshold);
    level /= 1 + level;
    unsigned char* set = u->set + (size_t)advice->nset * (size_t)u->view->mesh->nvert;
    for (int v = 0; v < u->view->mesh->nvert; ++v) set[v] = probability[v] >= level;
    if (advice->nset < u->def.ntry) advice->set[advice->nset++] = set;
}

static OmStatus estimate_with(Work* w, const OmProgress* progress, OmMatchEstimate* estimate) {
    OmBanetUpdater* u = w->updater;
    OmMatchAdvice advice = {.weight = u->def.weight};
    if (u->def.tries_last_corrected) advice.present = u->last;
    if (w->nview > 0) {
        const double* p = w->advice->probability;
        double threshold;
        advice.probability = p;
        OM_TRY(find_threshold(u, p, &threshold));
        // the twin's own first: another set replaces it only if it is clearly nearer to the scans
        if (advice.nset < u->def.ntry) advice.set[advice.nset++] = u->last;
        if (advice.nset < u->def.ntry) add_level(u, p, threshold, 1, &advice);
        if (advice.nset < u->def.ntry) add_level(u, p, threshold, 1 / ODDS, &advice);
        if (advice.nset < u->def.ntry) add_level(u, p, threshold, ODDS, &advice);
    }
    return om_match_update_with(u->def.match, w->nacq, w->acq, &advice, progress, estimate);
}

OmStatus om_banet_update(OmBanetUpdater* u, int nacq, const OmAcquisition* acq,
                         const OmProgress* progress, OmMatchEstimate* estimate,
                         OmBanetAdvice* advice) {
    double begin = om_clock_now();
    OmBanetAdvice own = {0};
    if (estimate) memset(estimate, 0, sizeof *estimate);
    if (advice) *advice = own;
    OM_CHECK(nacq > 0 && acq, OM_INVALID, "banet: no acquisition");
    Work w = {.updater = u, .nacq = nacq, .advice = &own};
    if (acq[nacq - 1].attached) om_banet_updater_set_attached(u, acq[nacq - 1].attached);
    OmStatus status = work_init(&w, acq);
    for (int a = 0; a < nacq && status == OM_OK; ++a) status = find_twin(&w, a);
    const bool has_network = u->def.estimate != NULL;
    if (status == OM_OK && has_network && u->def.is_corrected) status = correct_twin(&w, progress);
    if (status == OM_OK && has_network) status = use_network(&w, progress);
    if (has_network && u->def.is_corrected) om_match_live_set_attached(u->live, u->last);
    if (status == OM_OK && estimate) status = estimate_with(&w, progress, estimate);
    work_done(&w);
    own.total_ms = 1e3 * (om_clock_now() - begin);
    if (status >= 0 && estimate && estimate->is_accepted)
        om_banet_updater_set_attached(u, estimate->attached);
    if (status >= 0 && advice)
        *advice = own;
    else
        om_banet_advice_done(&own);
    return status;
}
