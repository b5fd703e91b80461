// match_update.c: attachments that explain scans.
//
// 1. Evidence: a candidate whose surface lies in the scan at its rest position gets a soft spring, and the twin is
//    deformed onto the scan (match_fit.c). A candidate that moved is free; it counts less where the scan does not show
//    it. A candidate that stayed is attached with a weak ratio, STAYED for all together. Tissue that slides along the
//    board leaves the place of its border empty: the border is free, and the vertices beside it probably are.
// 2. match_prior.c: probable sets of attached vertices, given these.
// 3. The twin is brought to rest with the most probable set, and its distance from the scan decides whether the
//    estimate is used.
//
// Not taken, with figures in doc/notes/match_update.md: displacement along the board as evidence, a lower threshold of
// motion. Not tried: gradients of the distance by the adjoint of the equilibrium (om_match_solve has the factors).
// They need an equilibrium for each iteration, 0.1 to 0.2 s, where the whole update may take 0.3 s.
#include <stdlib.h>
#include <string.h>

#include "match/match_internal.h"
#include "omentum/shape_points.h"

#define SURE 4.0       // log-likelihood ratio of a vertex whose motion the scan shows
#define LIKELY 1.5     // ... of a vertex that moved where the scan does not show it
#define BESIDE 0.5     // ... of a vertex beside one whose place is empty
#define STAYED 16.0    // ... of all candidates together, by area, that stayed although pulled
#define STILL 0.0015   // m, of the scan from the rest shape, where nothing moved
#define INSIDE 0.0015  // m, from the border: half a pixel, noise, and rounding of the border
#define SPRING 0.2     // of Young's modulus over edge: springs of vertices that seem still
#define SOFT 0.001     // ... of vertices that are not seen
// An update that does not lower the mean distance to this part explains the scan no better, and is refused.
#define CLOSER 0.95
#define MIN_POINTS 20   // of a scan
#define CAP 0.005       // m, that a scan point counts at most in the mean distance
#define MORE_NEWTON 60  // iterations where the first ones find no rest
#define SUPPORT 2.0     // edges: a scan point this near shows a vertex

typedef enum Status { UNKNOWN, RESTING, LEFT } Status;

typedef struct Job {
    OmMatch* match;
    int nacq;
    const OmAcquisition* acq;
    OmMatchEstimate* out;
    MatchFit fit;
    double *x, *spring, *evidence, *probability;
    double* x_before;  // the twin as believed, of each acquisition             (nacq x nvert x 3)
    double* facing_x;  // rest positions of surface vertices that face the camera
    int* nearest;      // surface vertex of each candidate that the camera sees over it
    unsigned char *status, *seen, *moved;  // of candidates; seen and moved: by any acquisition
    double* all_distance;                  // of scan points
    int ndistance;
    double area;  // m^2, of the candidates
} Job;

static int compare(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

// ---- evidence of one acquisition ----------------------------------------------------------------------------

// Whether the picture shows something else at p than tissue or a tool: nothing is there any more.
static bool is_empty(const OmScan* scan, OmVec3 p) {
    double u, v;
    if (!scan->has_camera || !scan->pixel || !om_camera_project(&scan->camera, p, &u, &v))
        return false;
    if (!(u >= 0 && v >= 0 && u < scan->camera.width && v < scan->camera.height)) return false;
    return scan->pixel[(int)v * scan->camera.width + (int)u] == OM_SCAN_OTHER;
}

// What the picture shows at the rest position p of a vertex with normal `rest_n`, and INSIDE from it towards `centre`:
// tissue that slides leaves the place of its border empty.
static Status look_at(const Job* j, const OmScan* scan, const OmPointTree* tree, OmVec3 p,
                      OmVec3 rest_n, OmVec3 centre) {
    double distance, edge = j->match->view.edge;
    OmVec3 inside = om_madd(p, INSIDE, om_normalize(om_sub(centre, p)));
    if (is_empty(scan, inside)) return LEFT;
    int k = om_point_tree_find(tree, p, &distance);
    OmVec3 d = om_sub(p, om_load3(scan->x, k)), n = om_load3(scan->normal, k);
    double across = fabs(om_dot(d, om_norm2(n) > 0.5 ? n : rest_n));
    if (distance < SUPPORT * edge && across < STILL) return RESTING;
    bool is_near = distance < SUPPORT * edge && !scan->pixel;
    return is_near || is_empty(scan, p) ? LEFT : UNKNOWN;
}

static OmStatus find_status(Job* j, const OmScan* scan) {
    OmMatch* m = j->match;
    OmPointTree *scan_tree = NULL, *face_tree = NULL;
    int* face = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(face, m->surface.nvert);
    double* normal = j->fit.normal;
    int nface = 0;
    OmVec3 centre = om_vec3(0, 0, 0);
    for (int i = 0; i < m->surface.nvert; ++i) {
        OmVec3 p = om_load3(m->surface.x, i), n = om_load3(normal, i);
        OmVec3 ray = om_sub(scan->camera.pose_world_camera.p, p);
        if (scan->has_camera && !(om_dot(ray, n) > 0)) continue;
        om_store3(j->facing_x, nface, p);
        centre = om_add(centre, p);
        face[nface++] = i;
    }
    OM_CHECK_DONE(nface > 0, OM_INVALID, "match: no part of the twin's surface faces the camera");
    OM_TRY_DONE(om_point_tree_create(scan->npoint, scan->x, &scan_tree));
    OM_TRY_DONE(om_point_tree_create(nface, j->facing_x, &face_tree));
    for (int i = 0; i < m->view.ncandidate; ++i) {
        OmVec3 p = om_load3(m->view.mesh->x, m->candidate[i]);
        int k = om_point_tree_find(face_tree, p, NULL);
        j->nearest[i] = face[k];
        j->status[i] =
            (unsigned char)look_at(j, scan, scan_tree, om_load3(j->facing_x, k),
                                   om_load3(normal, face[k]), om_scale(1.0 / nface, centre));
    }
done:
    om_point_tree_destroy(scan_tree);
    om_point_tree_destroy(face_tree);
    om_free(face);
    return status;
}

static void set_springs(Job* j) {
    OmMatch* m = j->match;
    double unit = om_site_get_material(m->def.site, 0).young / m->view.edge;
    for (int i = 0; i < m->view.ncandidate; ++i) {
        double k = j->status[i] == RESTING ? SPRING : j->status[i] == UNKNOWN ? SOFT : 0;
        j->spring[i] = k * unit * m->area[i];
    }
}

// Whether a candidate lies beside one whose place is empty.
static bool is_beside_left(const Job* j, int i) {
    const OmMatch* m = j->match;
    OmVec3 p = om_load3(m->view.mesh->x, m->candidate[i]);
    for (int k = 0; k < m->view.ncandidate; ++k) {
        OmVec3 q = om_load3(m->view.mesh->x, m->candidate[k]);
        if (j->status[k] == LEFT && om_distance(p, q) < SUPPORT * m->view.edge) return true;
    }
    return false;
}

// The fit, and what it says about every candidate.
static OmStatus add_evidence(Job* j, int a) {
    OmMatch* m = j->match;
    const OmAcquisition* acq = &j->acq[a];
    const double* rest = m->view.mesh->x;
    OM_TRY(find_status(j, &acq->scan));
    set_springs(j);
    OM_TRY(om__match_fit(&j->fit, acq, j->spring, j->x));
    // Acquisitions of this grasp: several looks at one pull say little more than one.
    int nsame = 0;
    for (int b = 0; b < j->nacq; ++b)
        nsame += om_distance(j->acq[b].grasp[0].pose_world_grasp.p,
                             acq->grasp[0].pose_world_grasp.p) < m->view.edge;
    OmPointTree* tree;
    OM_TRY(om_point_tree_create(acq->scan.npoint, acq->scan.x, &tree));
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        double moved = om_distance(om_load3(j->x, v), om_load3(rest, v)), distance;
        om_point_tree_find(tree, om_load3(j->x, m->surface_vert[j->nearest[i]]), &distance);
        bool is_seen = distance < SUPPORT * m->view.edge;
        bool is_left = j->status[i] == LEFT, has_moved = moved > m->def.moved;
        j->seen[i] |= is_seen;
        if (is_left || has_moved)
            j->evidence[i] = fmin(j->evidence[i], is_seen || is_left ? -SURE : -LIKELY);
        else if (is_beside_left(j, i))
            j->evidence[i] = fmin(j->evidence[i], -BESIDE);
        else if (j->status[i] == RESTING && j->evidence[i] >= 0)
            j->evidence[i] += STAYED / nsame * m->area[i] / j->area;
        j->moved[i] |= has_moved && is_seen;
    }
    om_point_tree_destroy(tree);
    return OM_OK;
}

// ---- residuals ----------------------------------------------------------------------------------------------

// Distances of the scans from the twin: median, 90 %, and the mean with each distance at most CAP.
static OmStatus measure(Job* j, bool is_after, double* median, double* p90, double* mean) {
    OmMatch* m = j->match;
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    j->ndistance = 0;
    for (int a = 0; a < j->nacq; ++a) {
        const double* x = (is_after ? j->out->x : j->x_before) + (size_t)a * n3;
        OM_TRY(om__match_pairs(&j->fit, &j->acq[a].scan, x));
        for (int i = 0; i < j->acq[a].scan.npoint; ++i)
            j->all_distance[j->ndistance++] = fmin(j->fit.distance[i], 1.0);
    }
    qsort(j->all_distance, (size_t)j->ndistance, sizeof *j->all_distance, compare);
    *mean = 0;
    for (int i = 0; i < j->ndistance; ++i) *mean += fmin(j->all_distance[i], CAP) / j->ndistance;
    *median = j->all_distance[j->ndistance / 2];
    *p90 = j->all_distance[j->ndistance * 9 / 10];
    return OM_OK;
}

// ---- stages -------------------------------------------------------------------------------------------------

static OmStatus check_acquisition(OmMatch* m, const OmAcquisition* a, int k) {
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

OM_PRINTF(2, 3)
static OmStatus refuse(OmMatchEstimate* out, const char* format, ...) {
    va_list args;
    va_start(args, format);
    vsnprintf(out->reason, sizeof out->reason, format, args);
    va_end(args);
    return OM_NOT_CONVERGED;
}

// Refusals before any work: OM_NOT_CONVERGED with the reason.
static OmStatus check_motion(const OmMatch* m, int nacq, const OmAcquisition* acq,
                             OmMatchEstimate* out) {
    double motion = 0;
    for (int a = 0; a < nacq; ++a) {
        if (acq[a].scan.npoint == 0) return refuse(out, "scan %d shows no tissue", a);
        if (acq[a].scan.npoint < MIN_POINTS)
            return refuse(out, "scan %d has %d points, %d are needed", a, acq[a].scan.npoint,
                          MIN_POINTS);
        if (acq[a].ngrasp == 0) return refuse(out, "nothing is grasped in acquisition %d", a);
        for (int g = 0; g < acq[a].ngrasp; ++g) {
            const OmMatchGrasp* grasp = &acq[a].grasp[g];
            motion = fmax(motion, om_distance(grasp->pose_world_now.p, grasp->pose_world_grasp.p));
            double away = HUGE_VAL, radius = grasp->radius;
            if (!(radius > 0)) radius = m->def.scene->task.grasp_radius;
            for (int i = 0; grasp->vert && i < grasp->nvert; ++i)
                away = fmin(away, om_distance(om_load3(m->view.mesh->x, grasp->vert[i]),
                                              grasp->pose_world_grasp.p));
            if (grasp->vert && away > radius + m->def.moved)
                return refuse(out,
                              "acquisition %d: the tissue had moved by %.1f mm when it was grasped",
                              a, 1e3 * away);
        }
    }
    if (motion < m->def.min_motion)
        return refuse(out, "the grasp moved by %.1f mm only, %.1f mm are needed", 1e3 * motion,
                      1e3 * m->def.min_motion);
    return OM_OK;
}

static OmStatus create_estimate(const OmMatch* m, int nacq, OmMatchEstimate* out) {
    int nvert = m->view.mesh->nvert;
    *out = (OmMatchEstimate){.nvert = nvert, .nacquisition = nacq};
    out->probability = om_calloc((size_t)nvert, sizeof *out->probability);
    out->uncertainty = om_calloc((size_t)nvert, sizeof *out->uncertainty);
    out->stiffness = om_calloc((size_t)nvert, sizeof *out->stiffness);
    out->attached = om_calloc((size_t)nvert, 1);
    out->x = om_calloc((size_t)nacq * 3 * (size_t)nvert, sizeof *out->x);
    bool is_whole =
        out->probability && out->uncertainty && out->stiffness && out->attached && out->x;
    for (int i = 0; is_whole && i < m->view.ncandidate; ++i)
        out->uncertainty[m->candidate[i]] = 1;  // until a scan says more
    return is_whole ? OM_OK : OM_NO_MEMORY;
}

static OmStatus create_job(OmMatch* m, int nacq, const OmAcquisition* acq, OmMatchEstimate* out,
                           Job* j) {
    *j = (Job){.match = m, .nacq = nacq, .acq = acq, .out = out};
    int most = 1, all = 1, n = m->view.ncandidate;
    for (int i = 0; i < n; ++i) j->area += m->area[i];  // above 0: faces have area
    for (int a = 0; a < nacq; ++a) {
        most = acq[a].scan.npoint > most ? acq[a].scan.npoint : most;
        all += acq[a].scan.npoint;
    }
    OM_TRY(om__match_fit_begin(m, most, &j->fit));
    OM_ALLOC(j->x, 3 * m->view.mesh->nvert);
    OM_ALLOC(j->x_before, (size_t)nacq * 3 * (size_t)m->view.mesh->nvert);
    OM_ALLOC(j->spring, n);
    OM_ALLOC(j->probability, n);
    OM_ALLOC(j->facing_x, 3 * m->surface.nvert);
    OM_ALLOC(j->nearest, n);
    OM_ALLOC(j->status, n);
    OM_ALLOC(j->all_distance, all);
    j->evidence = om_calloc((size_t)n, sizeof *j->evidence);
    j->seen = om_calloc((size_t)n, 1);
    j->moved = om_calloc((size_t)n, 1);
    return j->evidence && j->seen && j->moved ? OM_OK : OM_NO_MEMORY;
}

static void job_done(Job* j) {
    om__match_fit_done(&j->fit);
    om_free(j->x);
    om_free(j->x_before);
    om_free(j->spring);
    om_free(j->probability);
    om_free(j->facing_x);
    om_free(j->nearest);
    om_free(j->status);
    om_free(j->all_distance);
    om_free(j->evidence);
    om_free(j->seen);
    om_free(j->moved);
}

// The twin of an acquisition as believed: where the caller does not give it, at rest with the attachments of the site.
static OmStatus find_before(Job* j, int a) {
    OmMatch* m = j->match;
    const OmAcquisition* acq = &j->acq[a];
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    double* x = j->x_before + (size_t)a * n3;
    memcpy(x, acq->x_twin ? acq->x_twin : m->view.mesh->x, n3 * sizeof *x);
    if (acq->x_twin) return OM_OK;
    const OmMeshSet* set = om_tet_mesh_find_set(m->view.mesh, "attachment");
    for (int i = 0, k = 0; i < m->view.ncandidate; ++i) {  // both ascend
        while (set && k < set->nvert && set->vert[k] < m->candidate[i]) ++k;
        bool is_attached = set && k < set->nvert && set->vert[k] == m->candidate[i];
        j->spring[i] = is_attached ? m->def.foundation * m->area[i] : 0;
    }
    OmMatchLoad load = {
        .spring = j->spring, .ngrasp = acq->ngrasp, .grasp = acq->grasp, .tolerance = 2e-4};
    OmStatus status = om_match_find_rest(m, &load, x, NULL);
    return status < 0 ? om_error_prefix(status, "acquisition %d", a) : OM_OK;
}

static OmStatus fit_all(Job* j, const OmProgress* progress) {
    OmMatch* m = j->match;
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    for (int a = 0; a < j->nacq; ++a) {
        OM_TRY(find_before(j, a));
        memcpy(j->x, j->x_before + (size_t)a * n3, n3 * sizeof *j->x);
        OmStatus status = add_evidence(j, a);
        if (status < 0) return om_error_prefix(status, "acquisition %d", a);
        memcpy(j->out->x + (size_t)a * n3, j->x, n3 * sizeof *j->x);
        OM_TRY(om_progress_report(progress, "fit", a + 1, j->nacq));
    }
    double seen = 0, moved = 0;
    for (int i = 0; i < m->view.ncandidate; ++i) {
        seen += j->seen[i] ? m->area[i] : 0;
        moved += j->moved[i] ? m->area[i] : 0;
    }
    j->out->seen_share = seen / j->area;
    j->out->moved_share = moved / j->area;
    return OM_OK;
}

static OmStatus infer(Job* j) {
    OmMatch* m = j->match;
    OmMatchEstimate* out = j->out;
    OM_TRY(om__match_infer(m, j->evidence, j->probability));
    double level = om__match_choose_level(m, j->probability), sum = 0;
    OmVec3 centre = om_vec3(0, 0, 0);
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        double p = j->probability[i];
        out->probability[v] = p;
        out->uncertainty[v] = exp(-fabs(j->evidence[i]));
        out->attached[v] = p > level;
        out->stiffness[v] = out->attached[v] ? m->def.foundation * m->area[i] : 0;
        j->spring[i] = out->stiffness[v];
        double w = out->uncertainty[v] * p * (1 - p) * m->area[i];
        sum += w;
        centre = om_madd(centre, w, om_load3(m->view.mesh->x, v));
    }
    out->has_look_next = sum > 0;
    if (sum > 0) out->look_next = om_scale(1 / sum, centre);
    return OM_OK;
}

// The twin at rest with the new attachments, and whether it explains the scans.
static OmStatus check(Job* j, const OmProgress* progress) {
    OmMatch* m = j->match;
    OmMatchEstimate* out = j->out;
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    bool is_at_rest = true;
    double before, after;
    OM_TRY(measure(j, false, &out->before_median, &out->before_p90, &before));
    for (int a = 0; a < j->nacq; ++a) {
        OmMatchLoad load = {.spring = j->spring,
                            .ngrasp = j->acq[a].ngrasp,
                            .grasp = j->acq[a].grasp,
                            .max_newton = 12,
                            .tolerance = 2e-4};
        OmStatus status = om_match_find_rest(m, &load, out->x + (size_t)a * n3, NULL);
        load.max_newton = MORE_NEWTON;
        if (status == OM_NOT_CONVERGED)
            status = om_match_find_rest(m, &load, out->x + (size_t)a * n3, NULL);
        if (status < 0) return status;
        is_at_rest = is_at_rest && status == OM_OK;
        OM_TRY(om_progress_report(progress, "check", a + 1, j->nacq));
    }
    OM_TRY(measure(j, true, &out->after_median, &out->after_p90, &after));
    if (out->after_median > m->def.max_residual)
        return refuse(out,
                      "the scan is %.1f mm from the updated twin (median), %.1f mm are allowed",
                      1e3 * out->after_median, 1e3 * m->def.max_residual);
    if (out->seen_share < m->def.min_seen)
        return refuse(
            out, "the scan shows %.0f %% of the surface over the candidates, %.0f %% are needed",
            100 * out->seen_share, 100 * m->def.min_seen);
    if (after > CLOSER * before)
        return refuse(
            out, "the updated twin is no closer to the scan (mean %.2f mm) than before (%.2f mm)",
            1e3 * after, 1e3 * before);
    return is_at_rest ? OM_OK : refuse(out, "the twin found no rest with the new attachments");
}

OmStatus om_match_update(OmMatch* m, int nacq, const OmAcquisition* acq, const OmProgress* progress,
                         OmMatchEstimate* out) {
    memset(out, 0, sizeof *out);
    OM_CHECK(nacq > 0 && acq, OM_INVALID, "match: no acquisition");
    for (int a = 0; a < nacq; ++a) OM_TRY(check_acquisition(m, &acq[a], a));
    Job j = {0};
    double t[4] = {om_clock_now()};
    OmStatus status = create_estimate(m, nacq, out);
    if (status == OM_OK) status = check_motion(m, nacq, acq, out);
    if (status == OM_OK) status = create_job(m, nacq, acq, out, &j);
    if (status == OM_OK) status = fit_all(&j, progress);
    t[1] = om_clock_now();
    if (status == OM_OK) status = infer(&j);
    t[2] = om_clock_now();
    if (status == OM_OK) status = check(&j, progress);
    t[3] = om_clock_now();
    job_done(&j);
    if (status < 0) {
        om_match_estimate_done(out);
        return status;
    }
    out->is_accepted = status == OM_OK;
    out->fit_ms = 1e3 * (t[1] - t[0]);
    out->infer_ms = 1e3 * (t[2] - t[1]);
    out->check_ms = 1e3 * (t[3] - t[2]);
    out->total_ms = 1e3 * (t[3] - t[0]);
    return OM_OK;
}

void om_match_estimate_done(OmMatchEstimate* e) {
    if (!e) return;
    om_free(e->probability);
    om_free(e->uncertainty);
    om_free(e->stiffness);
    om_free(e->attached);
    om_free(e->x);
    memset(e, 0, sizeof *e);
}
