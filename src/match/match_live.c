// match_live.c: correspondence through the twin, while it runs.
//
// Minimise the elastic energy of the twin, its weight, and springs: grasped vertices to the tool, attached vertices to
// their place, and every point y of the scan to its partner q on the twin,
//
//     w k ((1 - a) (n.(y - q))^2 + a |y - q|^2) / 2,   w = 1 / (1 + |y - q|^2 / c^2)^2    (Geman and McClure 1987)
//
// with n the normal of the triangle, a small, and c three times the median distance. Partners are renewed in each
// iteration: the nearest point among triangles that the camera sees and that face like the scan. An iteration is one
// linearisation with the engine of om_fem_engine (om_tissue_begin_step, point forces, CG), without velocities: a step
// of gradient flow with masses as damping, so that a part without support falls. Attachments lose their stiffness
// with their displacement by the same w, so a wrong one yields to the scan. Their springs begin with the force that
// they bear at x_twin; the ground's support ends when a vertex leaves it.
//
// Measured on 24 cases of a sheet of 882 vertices (doc/notes/match_live.md). Rejected: the tangent in double with
// CHOLMOD, 20 ms an iteration instead of 2; weightless tissue, twice the error at folds of 135 degrees (median of moved
// points 2.7 mm, not 1.6); the law's own Poisson's ratio of 0.45, with which linear tetrahedra bend too stiffly;
// constant forces that balance x_twin everywhere, because stresses of another law turn with the fold and the forces do
// not (2.2 mm, not 0.6).
#include "omentum/match_live.h"

#include <string.h>

#include "match/match_internal.h"
#include "omentum/body.h"
#include "omentum/fem.h"
#include "omentum/shape_closest.h"

#define COOKIE 0x11fe7a01u
#define MAX_POISSON 0.3
#define FOLLOW_STEP 0.05  // s, of gradient flow, without the scan
#define FIT_STEP 1.0      // ... with it
#define CG_TOLERANCE 0.03
#define HOLD 10.0   // stiffness of springs over that of a vertex of the surface: grasped vertices
#define GROUND 3.0  // ... board and organ
#define TOUCH 5e-4  // m, a vertex nearer to board or organ rests on it
#define TRACK_EXACT 5e-4  // m, standard deviation at which a track's spring has half its stiffness
#define TRACK_SCALE 3e-3  // m, least distance at which it has a quarter of it
#define MIN_VOLUME 0.2    // of det F; an iteration that goes below is shortened
#define MAX_HALVING 5
#define MIN_PAIRED 20   // points with a partner; fewer place nothing
#define MAX_MOVE 3.0    // edges, of a vertex in an iteration
#define RESTART_HOLD 2  // iterations a step of a restart

typedef struct Force {  // in balance at the start
    // N, of the support of each vertex: minus elastic force and weight  (nvert x 3)
    double* reaction;
    unsigned char* rests;  // on board or organ                                              (nvert)
    double stick;          // springs of resting vertices over those of attached ones
} Force;

struct OmMatchLive {
    OmMatchLiveDef def;
    const OmMatchView* view;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmSurfaceTree* tree;
    int* tri_tet;  // vertices of each triangle, and of the tetrahedron behind it     (ntri x 4)
    unsigned char* attached;  // (nvert)
    MatchHeld held;
    int* held_at;  // index into `held` of each vertex, -1                            (nvert)
    Force force;
    double* x_begin;  // where the springs of attachments pull nothing                   (nvert x 3)
    double *x, *y;    // (nvert x 3)
    double* xs;       // of the surface's vertices
    double* volume;   // (ntet)
    unsigned char* use;  // triangles in view                                               (ntri)
    double stiffness;    // N/m, median of the surface's vertices
    double min_volume;
};

typedef struct Scan {  // one call
    OmMatchLive* live;
    const OmScan* scan;
    int ngrasp;
    const OmMatchGrasp* grasp;
    int ntrack;
    const OmMatchTrack* track;
    MatchBuffer buffer;
    int* tri;
    double *bary, *distance, *sorted;  // distance: HUGE_VAL without partner
    double *off, *off_sorted;          // of tracks, m
    int npaired;
    double median, scale;
    bool has_diverged;  // an iteration had no finite solution
} Scan;

// ---- definition, create, destroy ------------------------------------------------------------------------------

OmMatchLiveDef om_match_live_default_def(const OmMatch* match) {
    return (OmMatchLiveDef){.match = match,
                            .nfollow = 10,
                            .follow_step = 4e-3,
                            .nfit = 5,
                            .fit_stiffness = 1,
                            .along = 0.01,
                            .track_stiffness = 1,
                            .release = 3e-3,
                            .max_distance = 0.03,
                            .min_cosine = 0.3,
                            .max_median = 1e-3,
                            .max_p95 = 3e-3,
                            .min_paired = 0.6,
                            .max_empty = 0.06,
                            .nrestart = 12,
                            .nworker = 1,
                            .cookie = COOKIE};
}

static bool is_in(double value, double lo, double hi) { return value >= lo && value <= hi; }

static OmStatus check_def(const OmMatchLiveDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmMatchLiveDef was not made by om_match_live_default_def");
    OM_CHECK(d->match, OM_INVALID, "OmMatchLiveDef.match is null");
    OM_CHECK(is_in(d->nfollow, 0, 100) && is_in(d->nfit, 1, 100) && is_in(d->nrestart, 0, 1000),
             OM_INVALID, "OmMatchLiveDef: nfollow %d, nfit %d, nrestart %d are out of range",
             d->nfollow, d->nfit, d->nrestart);
    OM_CHECK(is_in(d->fit_stiffness, 1e-6, 1e6) && is_in(d->along, 0, 1), OM_INVALID,
             "OmMatchLiveDef: fit_stiffness %g must be 1e-6 to 1e6, along %g 0 to 1",
             d->fit_stiffness, d->along);
    OM_CHECK(is_in(d->track_stiffness, 0, 1e6) && is_in(d->follow_step, 0, 1e3), OM_INVALID,
             "OmMatchLiveDef: track_stiffness %g must be 0 to 1e6, follow_step %g m 0 to 1e3",
             d->track_stiffness, d->follow_step);
    OM_CHECK(is_in(d->release, 1e-6, 1e3) && is_in(d->max_distance, 1e-6, 1e3) &&
                 is_in(d->min_cosine, -1, 1) && is_in(d->max_median, 0, 1e3) &&
                 is_in(d->max_p95, 0, 1e3),
             OM_INVALID,
             "OmMatchLiveDef: release %g, max_distance %g, max_median %g or max_p95 %g m, or "
             "min_cosine %g is out of range",
             d->release, d->max_distance, d->max_median, d->max_p95, d->min_cosine);
    OM_CHECK(is_in(d->min_paired, 0, 1) && is_in(d->max_empty, 0, 1) && d->nworker >= 0, OM_INVALID,
             "OmMatchLiveDef: min_paired %g and max_empty %g must be 0 to 1, nworker %d at least 0",
             d->min_paired, d->max_empty, d->nworker);
    return OM_OK;
}

// The site's tissue as finite elements without attachments: these are springs of ours.
static OmStatus make_tissue(OmMatchLive* live) {
    const OmMatchDef* m = &live->def.match->def;
    OmBodyParts parts;
    OmTissueDef def;
    OM_TRY(om_body_make_tissue_def(m->scene, m->site, &parts, &def));
    // Linear elements on all vertices: quadratic ones need 430 ms a scan where these need 40, and the scan, not the
    // elements, says how the tissue bends.
    OmTetMesh mesh = *live->view->mesh;
    mesh.nset = 0;
    def.mesh = &mesh;
    def.nown = 0;
    def.engine = om_fem_engine();
    def.input = NULL;
    def.attachment_springs = NULL;
    def.element = OM_ELEMENT_LINEAR;
    def.rayleigh_mass = def.rayleigh_stiffness = 0;
    def.material_default.poisson = fmin(def.material_default.poisson, MAX_POISSON);
    for (int k = 0; k < def.nmaterial; ++k)
        parts.material[k].poisson = fmin(parts.material[k].poisson, MAX_POISSON);
    def.solver.tolerance = CG_TOLERANCE;
    def.solver.nworker = live->def.nworker;
    OM_TRY(om_tissue_create(&def, &live->model));
    OM_TRY(om_tissue_state_create(live->model, &live->state));
    return om_tissue_work_create(live->model, &live->work);
}

// The tetrahedron behind each triangle: the first with its three vertices among those of the first vertex.
static OmStatus find_tets(OmMatchLive* live) {
    const OmTetMesh* mesh = live->view->mesh;
    const OmSurface* s = live->view->surface;
    OmStatus status = OM_OK;
    int *adr = NULL, *tet = NULL;
    adr = om_calloc((size_t)mesh->nvert + 2, sizeof *adr);
    if (!adr) return OM_NO_MEMORY;
    OM_ALLOC_DONE(tet, 4 * (size_t)mesh->ntet);
    for (int n = 0; n < 4 * mesh->ntet; ++n) ++adr[mesh->tet_vert[n] + 2];
    for (int v = 0; v < mesh->nvert; ++v) adr[v + 2] += adr[v + 1];
    for (int n = 0; n < 4 * mesh->ntet; ++n) tet[adr[mesh->tet_vert[n] + 1]++] = n / 4;
    for (int t = 0; t < s->ntri; ++t) {
        int* out = live->tri_tet + 4 * (size_t)t;
        for (int k = 0; k < 3; ++k) out[k] = live->view->surface_vert[s->tri_vert[3 * t + k]];
        out[3] = out[0];
        for (int n = adr[out[0]]; n < adr[out[0] + 1]; ++n) {
            const int* v = mesh->tet_vert + 4 * (size_t)tet[n];
            int nin = 0, other = -1;
            for (int k = 0; k < 4; ++k) {
                bool is_corner = v[k] == out[0] || v[k] == out[1] || v[k] == out[2];
                nin += is_corner;
                if (!is_corner) other = v[k];
            }
            if (nin == 3) {
                out[3] = other;
                break;
            }
        }
    }
done:
    om_free(adr);
    om_free(tet);
    return status;
}

// At the rest shape, once: results must not depend on earlier calls.
static OmStatus find_stiffness(OmMatchLive* live) {
    int n = live->view->surface->nvert;
    OM_TRY(om_tissue_set_x(live->model, live->state, live->view->mesh->x, NULL));
    OM_TRY(om_tissue_begin_step(live->model, live->state, live->work, FOLLOW_STEP));
    double* k = om_alloc((size_t)n, sizeof *k);
    if (!k) return OM_NO_MEMORY;
    for (int i = 0; i < n; ++i)
        k[i] = om_tissue_vertex_stiffness(live->work, live->view->surface_vert[i]);
    om_sort_doubles(k, n);
    live->stiffness = k[n / 2];
    om_free(k);
    return OM_OK;
}

static OmStatus make(OmMatchLive* live) {
    const OmMatchView* view = live->view;
    size_t nvert = (size_t)view->mesh->nvert, ntri = (size_t)view->surface->ntri;
    OM_TRY(make_tissue(live));
    OM_ALLOC(live->tri_tet, 4 * ntri);
    OM_TRY(find_tets(live));
    OM_TRY(om_surface_tree_create(view->surface, &live->tree));
    OM_ALLOC(live->attached, nvert);
    OM_ALLOC(live->held.vert, nvert);
    OM_ALLOC(live->held.goal, 3 * nvert);
    OM_ALLOC(live->held_at, nvert);
    OM_ALLOC(live->force.reaction, 3 * nvert);
    OM_ALLOC(live->force.rests, nvert);
    OM_ALLOC(live->x_begin, 3 * nvert);
    OM_ALLOC(live->x, 3 * nvert);
    OM_ALLOC(live->y, 3 * nvert);
    OM_ALLOC(live->xs, 3 * (size_t)view->surface->nvert);
    OM_ALLOC(live->volume, view->mesh->ntet);
    OM_ALLOC(live->use, ntri);
    memset(live->attached, 0, nvert);
    const OmMeshSet* set = om_tet_mesh_find_set(view->mesh, "attachment");
    for (int i = 0; set && i < set->nvert; ++i) live->attached[set->vert[i]] = 1;
    return find_stiffness(live);
}

OmStatus om_match_live_create(const OmMatchLiveDef* def, OmMatchLive** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmMatchLive* live = om_calloc(1, sizeof *live);
    if (!live) return OM_NO_MEMORY;
    live->def = *def;
    live->view = om_match_view(def->match);
    OmStatus status = make(live);
    if (status < 0)
        om_match_live_destroy(live);
    else
        *out = live;
    return status;
}

void om_match_live_destroy(OmMatchLive* live) {
    if (!live) return;
    om_tissue_work_destroy(live->work);
    om_tissue_state_destroy(live->state);
    om_tissue_destroy(live->model);
    om_surface_tree_destroy(live->tree);
    om_free(live->tri_tet);
    om_free(live->attached);
    om_free(live->held.vert);
    om_free(live->held.goal);
    om_free(live->held_at);
    om_free(live->force.reaction);
    om_free(live->force.rests);
    om_free(live->x_begin);
    om_free(live->x);
    om_free(live->y);
    om_free(live->xs);
    om_free(live->volume);
    om_free(live->use);
    om_free(live);
}

void om_match_live_set_attached(OmMatchLive* live, const unsigned char* attached) {
    const OmMatchView* view = live->view;
    memset(live->attached, 0, (size_t)view->mesh->nvert);
    if (!attached) return;
    memcpy(live->attached, attached, (size_t)view->ncorner);
    for (int i = view->ncorner; i < view->mesh->nvert; ++i) {
        const int* end = view->mid_end + 2 * (i - view->ncorner);
        live->attached[i] = attached[end[0]] && attached[end[1]];
    }
}

// ---- pairs ----------------------------------------------------------------------------------------------------

static void find_range(void* ctx, int begin, int end, int block) {
    (void)block;
    Scan* s = ctx;
    const OmMatchLiveDef* def = &s->live->def;
    for (int i = begin; i < end; ++i) {
        OmVec3 p = om_load3(s->scan->x, i), n = om_load3(s->scan->normal, i);
        OmSurfacePoint q = {.tri = -1};
        if (om_norm2(n) > 0)
            om_surface_tree_find_facing(s->live->tree, p, n, def->min_cosine, s->live->use,
                                        def->max_distance, &q);
        else
            om_surface_tree_find(s->live->tree, p, s->live->use, def->max_distance, &q);
        s->tri[i] = q.tri;
        s->distance[i] = q.tri < 0 ? HUGE_VAL : q.distance;
        memcpy(s->bary + 3 * (size_t)i, q.bary, sizeof q.bary);
    }
}

static double percentile(const Scan* s, double share) {
    return s->npaired > 0 ? s->sorted[(int)(share * (s->npaired - 1))] : 0;
}

// Partners of all points on the twin at live->x.
static void find_pairs(Scan* s) {
    OmMatchLive* live = s->live;
    const OmSurface* surface = live->view->surface;
    for (int i = 0; i < surface->nvert; ++i)
        om_store3(live->xs, i, om_load3(live->x, live->view->surface_vert[i]));
    om_surface_tree_move(live->tree, live->xs);
    if (s->scan->has_camera)
        om__match_mark_visible(&s->buffer, surface, live->xs, 0.5 * live->view->edge, live->use);
    else
        memset(live->use, 1, (size_t)surface->ntri);
    om_parallel_for(live->def.nworker, s->scan->npoint, 64, find_range, s);
    s->npaired = 0;
    for (int i = 0; i < s->scan->npoint; ++i)
        if (s->tri[i] >= 0) s->sorted[s->npaired++] = s->distance[i];
    om_sort_doubles(s->sorted, s->npaired);
    s->median = percentile(s, 0.5);
    s->scale = fmax(fmax(0.5 * live->view->edge, 3 * s->median), 5 * s->scan->noise);
}

static double weight_of(double distance, double scale) {
    double g = 1 + distance * distance / (scale * scale);  // scale > 0: the edge is
    return 1 / (g * g);
}

static OmVec3 triangle_normal(const OmMatchLive* live, int t) {
    const int* v = live->view->surface->tri_vert + 3 * (size_t)t;
    OmVec3 a = om_load3(live->xs, v[0]);
    return om_normalize(
        om_cross(om_sub(om_load3(live->xs, v[1]), a), om_sub(om_load3(live->xs, v[2]), a)));
}

static OmVec3 point_of(const OmMatchLive* live, const double* x, int t, const double bary[3]) {
    OmVec3 q = om_vec3(0, 0, 0);
    for (int k = 0; k < 3; ++k)
        q = om_madd(q, bary[k], om_load3(x, live->tri_tet[4 * (size_t)t + (size_t)k]));
    return q;
}

// A spring from each point of the scan to its partner.
static OmStatus add_pairs(Scan* s) {
    OmMatchLive* live = s->live;
    int nvisible = 0;
    for (int t = 0; t < live->view->surface->ntri; ++t) nvisible += live->use[t];
    // A vertex in view has about two triangles. Few points are no reason for stiffer springs.
    double share = s->npaired > 0 ? fmin(1, 0.5 * nvisible / s->npaired) : 0;
    double k = live->def.fit_stiffness * live->stiffness * share, along = live->def.along;
    for (int i = 0; i < s->scan->npoint; ++i) {
        int t = s->tri[i];
        if (t < 0) continue;
        const double* b = s->bary + 3 * (size_t)i;
        OmVec3 e = om_sub(om_load3(s->scan->x, i), point_of(live, live->x, t, b));
        OmVec3 n = triangle_normal(live, t);
        double w = k * weight_of(s->distance[i], s->scale);
        OmMat3 K = om_mat3_add(om_mat3_scale(w * (1 - along), om_mat3_outer(n, n)),
                               om_mat3_diag(om_vec3(w * along, w * along, w * along)));
        const double weight[4] = {b[0], b[1], b[2], 0};
        OM_TRY(om_tissue_add_point_force(live->work, live->tri_tet + 4 * (size_t)t, weight,
                                         om_mat3_apply(K, e), K));
    }
    return OM_OK;
}

// Distances of the tracks from their material points at live->x; returns a percentile.
static double measure_tracks(Scan* s, double share) {
    for (int i = 0; i < s->ntrack; ++i) {
        const OmMatchTrack* t = &s->track[i];
        s->off[i] = om_distance(t->x, point_of(s->live, s->live->x, t->tri, t->bary));
        s->off_sorted[i] = s->off[i];
    }
    om_sort_doubles(s->off_sorted, s->ntrack);
    return s->ntrack > 0 ? s->off_sorted[(int)(share * (s->ntrack - 1))] : 0;
}

// A spring from each track to its material point, with the matrix r^2 (C + r^2 I)^-1 for its covariance C.
static OmStatus add_tracks(Scan* s) {
    OmMatchLive* live = s->live;
    if (s->ntrack == 0) return OM_OK;
    double k = live->def.track_stiffness * live->def.fit_stiffness * live->stiffness;
    double scale = fmax(TRACK_SCALE, 3 * measure_tracks(s, 0.5)), r2 = TRACK_EXACT * TRACK_EXACT;
    for (int i = 0; i < s->ntrack; ++i) {
        const OmMatchTrack* t = &s->track[i];
        OmVec3 e = om_sub(t->x, point_of(live, live->x, t->tri, t->bary));
        OmMat3 K = om_mat3_add(t->covariance, om_mat3_diag(om_vec3(r2, r2, r2)));
        OM_TRY(om_mat3_inverse(K, &K));
        K = om_mat3_scale(k * r2 * weight_of(s->off[i], scale), K);
        const double weight[4] = {t->bary[0], t->bary[1], t->bary[2], 0};
        OM_TRY(om_tissue_add_point_force(live->work, live->tri_tet + 4 * (size_t)t->tri, weight,
                                         om_mat3_apply(K, e), K));
    }
    return OM_OK;
}

// ---- one iteration --------------------------------------------------------------------------------------------

static OmMat3 isotropic(double k) { return om_mat3_diag(om_vec3(k, k, k)); }

// Forces by tools, attachments and ground on vertex v.
static void add_support(OmMatchLive* live, int v) {
    OmVec3 x = om_load3(live->x, v), moved = om_sub(x, om_load3(live->x_begin, v));
    OmVec3 reaction = om_load3(live->force.reaction, v);
    int held = live->held_at[v];
    if (held >= 0) {
        double k = HOLD * live->stiffness;
        OmVec3 e = om_sub(om_load3(live->held.goal, held), x);
        om_tissue_add_force(live->work, v, om_madd(reaction, k, e), isotropic(k));
        return;
    }
    bool is_stuck = live->force.rests[v] && live->force.stick > 0;
    if (live->attached[v] || is_stuck) {
        double w = weight_of(om_norm(moved), live->def.release);
        double k = w * live->stiffness * (is_stuck ? live->force.stick : 1);
        om_tissue_add_force(live->work, v, om_madd(om_scale(w, reaction), -k, moved), isotropic(k));
        return;
    }
    OmVec3 n;
    double gap = om__match_gap(live->def.match, x, &n), k = GROUND * live->stiffness;
    if (gap > 0.05) return;  // far from board and organ
    bool rests = live->force.rests[v];
    double f = rests ? fmax(0, om_dot(reaction, n)) - k * om_dot(n, moved) : -k * gap;
    if (f > 0)
        om_tissue_add_force(live->work, v, om_scale(f, n), om_mat3_scale(k, om_mat3_outer(n, n)));
}

// Move by h dv, or less where a vertex would go far or an element would be crushed.
static OmStatus move(OmMatchLive* live, double h) {
    const double* dv = om_tissue_dv(live->work);
    size_t n = 3 * (size_t)live->view->mesh->nvert;
    double share = h, least = 1, far = 0, limit = MAX_MOVE * live->view->edge;
    for (int v = 0; v < live->view->mesh->nvert; ++v) far = fmax(far, h * om_norm(om_load3(dv, v)));
    if (far > limit) share *= limit / far;
    for (int k = 0; k <= MAX_HALVING; ++k, share *= 0.5) {
        for (size_t i = 0; i < n; ++i) live->y[i] = live->x[i] + share * dv[i];
        OM_TRY(om_tissue_set_x(live->model, live->state, live->y, NULL));
        OM_TRY(om_tissue_get_measure(live->model, live->state, OM_VOLUME_RATIO, live->volume));
        least = 1;
        for (int e = 0; e < live->view->mesh->ntet; ++e) least = fmin(least, live->volume[e]);
        if (least > fmin(MIN_VOLUME, 0.5 * live->min_volume)) break;
    }
    live->min_volume = least;
    memcpy(live->x, live->y, n * sizeof *live->x);
    return OM_OK;
}

// A step of gradient flow of h seconds with the springs of the tracks, and with those of the scan if `fits`.
static OmStatus iterate(Scan* s, bool fits, double h) {
    OmMatchLive* live = s->live;
    OM_TRY(om_tissue_begin_step(live->model, live->state, live->work, h));
    for (int v = 0; v < live->view->mesh->nvert; ++v) add_support(live, v);
    if (fits) {
        find_pairs(s);
        OM_TRY(add_pairs(s));
    }
    OM_TRY(add_tracks(s));
    OM_TRY(om_tissue_solve_step(live->model, live->state, live->work, NULL));
    return move(live, h);
}

// ---- a start --------------------------------------------------------------------------------------------------

static OmStatus hold(Scan* s, double share) {
    OmMatchLive* live = s->live;
    OmMatchGrasp grasp[OM_MAX_ARM];
    for (int k = 0; k < s->ngrasp; ++k) {
        grasp[k] = s->grasp[k];
        grasp[k].pose_world_now =
            om_pose_lerp(s->grasp[k].pose_world_grasp, s->grasp[k].pose_world_now, share);
    }
    OM_TRY(om__match_find_held(live->def.match, s->ngrasp, grasp, &live->held));
    for (int v = 0; v < live->view->mesh->nvert; ++v) live->held_at[v] = -1;
    for (int i = 0; i < live->held.nvert; ++i) live->held_at[live->held.vert[i]] = i;
    return OM_OK;
}

// Begin at x.
static OmStatus begin(Scan* s, const double* x) {
    OmMatchLive* live = s->live;
    Force* force = &live->force;
    size_t n = 3 * (size_t)live->view->mesh->nvert;
    memmove(live->x, x, n * sizeof *x);
    memcpy(live->x_begin, x, n * sizeof *x);
    live->min_volume = 1;
    OM_TRY(om_tissue_set_x(live->model, live->state, x, NULL));
    OM_TRY(om_tissue_get_internal_force(live->model, live->state, force->reaction));
    const double* mass = om_tissue_mass(live->model);
    for (int v = 0; v < live->view->mesh->nvert; ++v) {
        OmVec3 weight = om_scale(mass[v], om_tissue_gravity(live->model)), normal;
        OmVec3 r = om_scale(-1, om_add(om_load3(force->reaction, v), weight));
        om_store3(force->reaction, v, r);
        bool is_ours = live->attached[v] || live->held_at[v] >= 0;
        force->rests[v] =
            !is_ours && om__match_gap(live->def.match, om_load3(x, v), &normal) < TOUCH;
    }
    return OM_OK;
}

static OmStatus fit(Scan* s) {
    for (int k = 0; k < s->live->def.nfit; ++k) OM_TRY(iterate(s, true, FIT_STEP));
    find_pairs(s);
    return OM_OK;
}

// Iterations towards the tool's pose: as many as the grasped vertices have steps to go.
static int count_follow(const OmMatchLive* live) {
    double far = 0;
    for (int i = 0; i < live->held.nvert; ++i)
        far = fmax(far, om_distance(om_load3(live->held.goal, i),
                                    om_load3(live->x_begin, live->held.vert[i])));
    double step = live->def.follow_step;
    return step > 0 ? (int)fmin(live->def.nfollow, ceil(far / step - 0.5)) : live->def.nfollow;
}

static OmStatus start_from_twin(Scan* s, const double* x_twin) {
    OM_TRY(hold(s, 1));
    s->live->force.stick = 0;
    OM_TRY(begin(s, x_twin));
    int nfollow = count_follow(s->live);
    for (int k = 0; k < nfollow; ++k) OM_TRY(iterate(s, false, FOLLOW_STEP));
    return fit(s);
}

// The twin's own motion, from rest along a straight way of the tool. Every vertex that rests on board or organ may be
// attached: a weak spring holds it until tool or scan pull it away. Vertices that then still rest stay, the others are
// free, and the twin starts once more from there.
static OmStatus start_from_rest(Scan* s, double stick) {
    OmMatchLive* live = s->live;
    int n = live->def.nrestart;
    OM_TRY(hold(s, 0));
    live->force.stick = stick;
    OM_TRY(begin(s, live->view->mesh->x));
    for (int k = 1; k <= n; ++k) {
        OM_TRY(hold(s, (double)k / n));
        for (int i = 0; i < RESTART_HOLD; ++i) OM_TRY(iterate(s, false, FOLLOW_STEP));
    }
    OM_TRY(fit(s));
    OM_TRY(begin(s, live->x));
    for (int k = 0; k < live->def.nfollow; ++k) OM_TRY(iterate(s, false, FOLLOW_STEP));
    return fit(s);
}

// A start; without a finite solution it has no pairs, and the twin is back at x.
static OmStatus run_start(Scan* s, const double* x, double stick, bool is_first) {
    OmStatus status = is_first ? start_from_twin(s, x) : start_from_rest(s, stick);
    s->has_diverged = status == OM_INVALID;
    if (!s->has_diverged) return status;
    memcpy(s->live->x, x, 3 * (size_t)s->live->view->mesh->nvert * sizeof *x);
    for (int i = 0; i < s->scan->npoint; ++i) s->tri[i] = -1;
    s->npaired = s->buffer.ntissue = s->buffer.nother = 0;
    s->median = 0;
    return OM_OK;
}

// ---- the result -----------------------------------------------------------------------------------------------

static void judge(Scan* s, OmMatchPairs* p) {
    const OmMatchLiveDef* def = &s->live->def;
    int nview = s->buffer.ntissue + s->buffer.nother;
    p->median = s->median;
    p->p90 = percentile(s, 0.9);
    p->p95 = percentile(s, 0.95);
    p->paired = s->scan->npoint > 0 ? (double)s->npaired / s->scan->npoint : 0;
    p->empty = nview > 0 ? (double)s->buffer.nother / nview : 0;
    p->track_median = measure_tracks(s, 0.5);
    p->track_p90 = measure_tracks(s, 0.9);
    double noise = 3 * s->scan->noise, median = fmax(def->max_median, noise);
    double p95 = fmax(def->max_p95, noise);
    char* reason = p->reason;
    size_t size = sizeof p->reason;
    reason[0] = 0;
    if (s->has_diverged)
        snprintf(reason, size, "the deformation of the twin diverged");
    else if (s->npaired == 0)
        snprintf(reason, size, "no point of the scan has a partner on the twin");
    else if (s->npaired < MIN_PAIRED)
        snprintf(reason, size, "%d points of the scan have a partner on the twin; %d are needed",
                 s->npaired, MIN_PAIRED);
    else if (p->paired < def->min_paired)
        snprintf(reason, size,
                 "%.0f %% of the scan's points have a partner on the twin; %.0f %% are needed",
                 100 * p->paired, 100 * def->min_paired);
    else if (p->median > median)
        snprintf(reason, size,
                 "the scan is %.1f mm from the deformed twin in the median; at most %.1f mm",
                 1e3 * p->median, 1e3 * median);
    else if (p->p95 > p95)
        snprintf(reason, size,
                 "5 %% of the scan are %.1f mm or more from the deformed twin; at most %.1f mm",
                 1e3 * p->p95, 1e3 * p95);
    else if (p->empty > def->max_empty)
        snprintf(reason, size,
                 "the camera sees no tissue in %.0f %% of the twin's view; at most %.0f %%",
                 100 * p->empty, 100 * def->max_empty);
    p->is_lost = reason[0] != 0;
}

// A large value is a bad result.
static double badness(const OmMatchPairs* p, const OmMatchLiveDef* def) {
    return p->p95 / fmax(def->max_p95, 1e-6) + (1 - p->paired) + p->empty;
}

static void write(const Scan* s, OmMatchPairs* p) {
    const OmMatchLive* live = s->live;
    for (int i = 0; i < s->scan->npoint; ++i) {
        double* b = p->bary + 3 * (size_t)i;
        p->tri[i] = s->tri[i];
        p->weight[i] = 0;
        memset(b, 0, 3 * sizeof *b);
        om_store3(p->x_rest, i, om_vec3((double)NAN, (double)NAN, (double)NAN));
        if (s->tri[i] < 0) continue;
        memcpy(b, s->bary + 3 * (size_t)i, 3 * sizeof *b);
        p->weight[i] = weight_of(s->distance[i], s->scale);
        om_store3(p->x_rest, i, point_of(live, live->view->mesh->x, s->tri[i], b));
    }
    memcpy(p->x, live->x, 3 * (size_t)p->nvert * sizeof *p->x);
}

static OmStatus search(Scan* s, const double* x_twin, OmMatchPairs* p) {
    // Springs of resting vertices over those of attached ones; 0.1 peels off by the weight of a fold, 1 by the scan.
    static const double stick[] = {0.1, 1};
    const OmMatchLiveDef* def = &s->live->def;
    OM_TRY(hold(s, 1));  // refuses grasps that are not valid
    OM_TRY(run_start(s, x_twin, 0, true));
    judge(s, p);
    write(s, p);
    bool may_restart = def->nrestart > 0 && s->ngrasp > 0 && s->scan->npoint > 0;
    for (size_t k = 0; k < sizeof stick / sizeof *stick && may_restart && p->is_lost; ++k) {
        OmMatchPairs other = {0};
        OM_TRY(run_start(s, s->live->view->mesh->x, stick[k], false));
        judge(s, &other);
        if (other.is_lost && badness(&other, def) >= badness(p, def)) continue;
        p->median = other.median, p->p90 = other.p90, p->p95 = other.p95;
        p->paired = other.paired, p->empty = other.empty;
        p->track_median = other.track_median, p->track_p90 = other.track_p90;
        p->is_lost = other.is_lost, p->is_restarted = true;
        memcpy(p->reason, other.reason, sizeof p->reason);
        write(s, p);
    }
    return OM_OK;
}

// ---- interface ------------------------------------------------------------------------------------------------

static OmStatus pairs_init(int npoint, int nvert, OmMatchPairs* p) {
    OmStatus status = OM_OK;
    memset(p, 0, sizeof *p);
    OM_ALLOC_DONE(p->tri, npoint);
    OM_ALLOC_DONE(p->bary, 3 * (size_t)npoint);
    OM_ALLOC_DONE(p->weight, npoint);
    OM_ALLOC_DONE(p->x_rest, 3 * (size_t)npoint);
    OM_ALLOC_DONE(p->x, 3 * (size_t)nvert);
    p->npoint = npoint;
    p->nvert = nvert;
done:
    if (status < 0) om_match_pairs_done(p);
    return status;
}

void om_match_pairs_done(OmMatchPairs* p) {
    if (!p) return;
    om_free(p->tri);
    om_free(p->bary);
    om_free(p->weight);
    om_free(p->x_rest);
    om_free(p->x);
    memset(p, 0, sizeof *p);
}

static OmStatus scan_init(Scan* s) {
    size_t n = (size_t)s->scan->npoint;
    OM_ALLOC(s->tri, n);
    OM_ALLOC(s->bary, 3 * n);
    OM_ALLOC(s->distance, n);
    OM_ALLOC(s->sorted, n);
    if (s->ntrack > 0) OM_ALLOC(s->off, 2 * (size_t)s->ntrack);
    s->off_sorted = s->off ? s->off + s->ntrack : NULL;
    if (s->scan->has_camera)
        OM_TRY(om__match_buffer_init(s->scan, s->live->view->surface->nvert, &s->buffer));
    return om_tissue_reserve_points(s->live->work, s->scan->npoint + s->ntrack);
}

static void scan_done(Scan* s) {
    om_free(s->tri);
    om_free(s->bary);
    om_free(s->distance);
    om_free(s->sorted);
    om_free(s->off);
    om__match_buffer_done(&s->buffer);
}

static OmStatus check_tracks(const OmMatchLive* live, const OmMatchTracks* tracks) {
    for (int i = 0; i < tracks->n; ++i) {
        const OmMatchTrack* t = &tracks->track[i];
        OM_CHECK(t->tri >= 0 && t->tri < live->view->surface->ntri, OM_INVALID,
                 "match: track %d is on triangle %d; the surface has %d", i, t->tri,
                 live->view->surface->ntri);
        bool is_good = om_is_finite3(t->x) && isfinite(om_mat3_norm(t->covariance));
        for (int k = 0; k < 3; ++k) is_good = is_good && is_in(t->bary[k], -1e-6, 1 + 1e-6);
        OM_CHECK(is_good, OM_INVALID,
                 "match: track %d has a value that is not finite or a weight "
                 "outside 0 to 1",
                 i);
    }
    return OM_OK;
}

OmStatus om_match_find_pairs_with(OmMatchLive* live, const OmScan* scan, int ngrasp,
                                  const OmMatchGrasp* grasp, const double* x_twin,
                                  const OmMatchTracks* tracks, OmMatchPairs* pairs) {
    double start = om_clock_now();
    memset(pairs, 0, sizeof *pairs);
    OM_TRY(om_scan_check(scan));
    for (int v = 0; v < live->view->mesh->nvert; ++v)
        OM_CHECK(om_is_finite3(om_load3(x_twin, v)), OM_INVALID,
                 "match: position of vertex %d of the twin is not finite", v);
    Scan s = {.live = live, .scan = scan, .ngrasp = ngrasp, .grasp = grasp};
    if (tracks) {
        OM_TRY(check_tracks(live, tracks));
        s.ntrack = tracks->n, s.track = tracks->track;
    }
    OmStatus status = OM_OK;
    OM_TRY_DONE(scan_init(&s));
    OM_TRY_DONE(pairs_init(scan->npoint, live->view->mesh->nvert, pairs));
    OM_TRY_DONE(search(&s, x_twin, pairs));
    pairs->ms = 1e3 * (om_clock_now() - start);
    status = OM_OK;
done:
    scan_done(&s);
    if (status < 0) om_match_pairs_done(pairs);
    return status;
}

OmStatus om_match_find_pairs(OmMatchLive* live, const OmScan* scan, int ngrasp,
                             const OmMatchGrasp* grasp, const double* x_twin, OmMatchPairs* pairs) {
    return om_match_find_pairs_with(live, scan, ngrasp, grasp, x_twin, NULL, pairs);
}

void om_match_pairs_displacement(const OmMatchView* view, const OmMatchPairs* pairs, double* u,
                                 double* seen) {
    for (int i = 0; i < view->surface->nvert; ++i) {
        int v = view->surface_vert[i];
        om_store3(u, i, om_sub(om_load3(pairs->x, v), om_load3(view->mesh->x, v)));
        if (seen) seen[i] = 0;
    }
    for (int i = 0; seen && i < pairs->npoint; ++i) {
        if (pairs->tri[i] < 0) continue;
        const int* v = view->surface->tri_vert + 3 * (size_t)pairs->tri[i];
        for (int k = 0; k < 3; ++k) seen[v[k]] += pairs->weight[i] * pairs->bary[3 * i + k];
    }
}
