// match_evidence.c: what scans say about each candidate.
//
// A candidate whose surface lies in the scan at its rest position gets a soft spring, and the twin is deformed onto the
// scan (match_fit.c). A candidate that moved is free; it counts less where the scan does not show it. A candidate that
// stayed is attached with a weak ratio, STAYED for all together. Tissue that slides along the board leaves the place of
// its border empty: the border is free, and the vertices beside it probably are.
//
// Not taken, with figures in doc/notes/match_update.md: displacement along the board as evidence, a lower threshold of
// motion.
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
#define SUPPORT 2.0    // edges: a scan point this near shows a vertex

typedef enum Status { UNKNOWN, RESTING, LEFT } Status;

// ---- evidence of one acquisition ----------------------------------------------------------------------------

// Whether the picture shows something else at p than tissue or a tool, and not before p: nothing is there any more.
static bool is_empty(const OmScan* scan, OmVec3 p) {
    double u, v;
    if (!scan->has_camera || !scan->pixel || !om_camera_project(&scan->camera, p, &u, &v))
        return false;
    if (!(u >= 0 && v >= 0 && u < scan->camera.width && v < scan->camera.height)) return false;
    int i = (int)v * scan->camera.width + (int)u;
    if (scan->pixel[i] != OM_SCAN_OTHER) return false;
    double z = om_pose_apply(om_pose_inverse(scan->camera.pose_world_camera), p).z;
    return !scan->depth || (double)scan->depth[i] > z - OM__MATCH_BEFORE;
}

// What the picture shows at the rest position p of a vertex with normal `rest_n`, and INSIDE from it towards `centre`:
// tissue that slides leaves the place of its border empty.
static Status look_at(const MatchEvidence* j, const OmScan* scan, const OmPointTree* tree, OmVec3 p,
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

static OmStatus find_status(MatchEvidence* j, const OmScan* scan) {
    OmMatch* m = j->match;
    OmPointTree *scan_tree = NULL, *face_tree = NULL;
    int* face = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(face, m->surface.nvert);
    double* normal = j->trier->fit.normal;
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

static void set_springs(MatchEvidence* j) {
    OmMatch* m = j->match;
    double unit = om_site_get_material(m->def.site, 0).young / m->view.edge;
    for (int i = 0; i < m->view.ncandidate; ++i) {
        double k = j->status[i] == RESTING ? SPRING : j->status[i] == UNKNOWN ? SOFT : 0;
        j->spring[i] = k * unit * m->area[i];
    }
}

// Whether a candidate lies beside one whose place is empty.
static bool is_beside_left(const MatchEvidence* j, int i) {
    const OmMatch* m = j->match;
    OmVec3 p = om_load3(m->view.mesh->x, m->candidate[i]);
    for (int k = 0; k < m->view.ncandidate; ++k) {
        OmVec3 q = om_load3(m->view.mesh->x, m->candidate[k]);
        if (j->status[k] == LEFT && om_distance(p, q) < SUPPORT * m->view.edge) return true;
    }
    return false;
}

// The fit, and the evidence that it gives for every candidate.
static OmStatus add_evidence(MatchEvidence* j, int a) {
    double* x = j->x + (size_t)a * 3 * (size_t)j->match->view.mesh->nvert;
    OmMatch* m = j->match;
    const OmAcquisition* acq = &j->acq[a];
    const double *rest = m->view.mesh->x, *before = j->x_before + (x - j->x);
    OM_TRY(find_status(j, &acq->scan));
    set_springs(j);
    OM_TRY(om__match_fit(&j->trier->fit, acq, j->spring, x));
    // Acquisitions of this grasp: several looks at one pull say little more than one.
    int nsame = 0;
    for (int b = 0; b < j->nacq; ++b)
        nsame += om_distance(j->acq[b].grasp[0].pose_world_grasp.p,
                             acq->grasp[0].pose_world_grasp.p) < m->view.edge;
    OmPointTree* tree;
    OM_TRY(om_point_tree_create(acq->scan.npoint, acq->scan.x, &tree));
    for (int i = 0; i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        double moved = om_distance(om_load3(x, v), om_load3(rest, v)), distance;
        om_point_tree_find(tree, om_load3(x, m->surface_vert[j->nearest[i]]), &distance);
        bool is_seen = distance < SUPPORT * m->view.edge;
        bool is_left = j->status[i] == LEFT, has_moved = moved > m->def.moved;
        j->seen[i] |= is_seen;
        if (is_left || has_moved)
            j->ratio[i] = fmin(j->ratio[i], is_seen || is_left ? -SURE : -LIKELY);
        else if (is_beside_left(j, i))
            j->ratio[i] = fmin(j->ratio[i], -BESIDE);
        else if (j->status[i] == RESTING && j->ratio[i] >= 0)
            j->ratio[i] += STAYED / nsame * m->area[i] / j->area;
        j->moved[i] |= has_moved && is_seen;
        j->went[i] |= is_left || has_moved;
        double believed = om_distance(om_load3(before, v), om_load3(rest, v));
        j->stayed[i] |= j->status[i] == RESTING && believed > m->def.moved;
    }
    om_point_tree_destroy(tree);
    return OM_OK;
}

// ---- all acquisitions ----------------------------------------------------------------------------------------

OmStatus om__match_evidence_begin(MatchTrier* trier, MatchEvidence* j) {
    OmMatch* m = trier->match;
    size_t n = (size_t)m->view.ncandidate, n3 = 3 * (size_t)m->view.mesh->nvert;
    *j = (MatchEvidence){.match = m,
                         .trier = trier,
                         .nacq = trier->nacq,
                         .acq = trier->acq,
                         .spring = trier->spring};
    for (size_t i = 0; i < n; ++i) j->area += m->area[i];  // above 0: faces have area
    OM_ALLOC(j->x_before, (size_t)j->nacq * n3);
    OM_ALLOC(j->x, (size_t)j->nacq * n3);
    OM_ALLOC(j->facing_x, 3 * m->surface.nvert);
    OM_ALLOC(j->nearest, n);
    OM_ALLOC(j->status, n);
    j->ratio = om_calloc(n, sizeof *j->ratio);
    j->seen = om_calloc(n, 1);
    j->moved = om_calloc(n, 1);
    j->stayed = om_calloc(n, 1);
    j->went = om_calloc(n, 1);
    const bool is_whole = j->ratio && j->seen && j->moved && j->stayed && j->went;
    return is_whole ? OM_OK : OM_NO_MEMORY;
}

void om__match_evidence_done(MatchEvidence* j) {
    om_free(j->x_before);
    om_free(j->x);
    om_free(j->facing_x);
    om_free(j->nearest);
    om_free(j->status);
    om_free(j->ratio);
    om_free(j->seen);
    om_free(j->moved);
    om_free(j->stayed);
    om_free(j->went);
}

// Springs of the attachments that the twin has: those of the newest acquisition, else of the site.
static void set_believed(MatchEvidence* j) {
    OmMatch* m = j->match;
    const OmAcquisition* newest = &j->acq[j->nacq - 1];
    const OmMeshSet* set = om_tet_mesh_find_set(m->view.mesh, "attachment");
    for (int i = 0, k = 0; i < m->view.ncandidate; ++i) {  // both ascend
        while (set && k < set->nvert && set->vert[k] < m->candidate[i]) ++k;
        bool is_attached = set && k < set->nvert && set->vert[k] == m->candidate[i];
        if (newest->attached) is_attached = newest->attached[m->candidate[i]];
        j->spring[i] = is_attached ? m->def.foundation * m->area[i] : 0;
    }
}

// The twin of an acquisition as believed, at rest as the sets on trial are: in the shape of its body, of other elements
// and with another hold, a right belief looked wrong. The body's shape where no attachments are stated with it, or no
// rest is found.
static OmStatus find_before(MatchEvidence* j, int a) {
    OmMatch* m = j->match;
    const OmAcquisition* acq = &j->acq[a];
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    double* x = j->x_before + (size_t)a * n3;
    memcpy(x, acq->x_twin ? acq->x_twin : m->view.mesh->x, n3 * sizeof *x);
    if (acq->x_twin && !j->acq[j->nacq - 1].attached) return OM_OK;
    set_believed(j);
    OmMatchLoad load = {
        .spring = j->spring, .ngrasp = acq->ngrasp, .grasp = acq->grasp, .tolerance = 2e-4};
    OmStatus status = om_match_find_rest(m, &load, x, NULL);
    if (status == OM_NOT_CONVERGED && acq->x_twin) memcpy(x, acq->x_twin, n3 * sizeof *x);
    return status < 0 ? om_error_prefix(status, "acquisition %d", a) : OM_OK;
}

OmStatus om__match_find_evidence(MatchEvidence* j, const OmProgress* progress) {
    OmMatch* m = j->match;
    size_t n3 = 3 * (size_t)m->view.mesh->nvert;
    for (int a = 0; a < j->nacq; ++a) {
        OM_TRY(find_before(j, a));
        memcpy(j->x + (size_t)a * n3, j->x_before + (size_t)a * n3, n3 * sizeof *j->x);
        OmStatus status = add_evidence(j, a);
        if (status < 0) return om_error_prefix(status, "acquisition %d", a);
        OM_TRY(om_progress_report(progress, "fit", a + 1, j->nacq));
    }
    for (int i = 0; i < m->view.ncandidate; ++i) {
        j->seen_share += j->seen[i] ? m->area[i] / j->area : 0;
        j->moved_share += j->moved[i] ? m->area[i] / j->area : 0;
    }
    return OM_OK;
}
