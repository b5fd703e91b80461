// match_rest.c: equilibria of the twin under weight, contact, springs, grasps and pulls.
//
// The energy is W(x) - g.M x, plus a spring k |x - goal|^2 / 2 for every attached and grasped vertex, plus
// c a d^2 / 2 for every boundary vertex of area a whose distance d to board or organ is below 0, plus for every pull
// with q = sum bary x and e = q - goal: (across (e.n)^2 + along |e|^2) / 2. Newton's method with the tangent of
// om_fem_eval_tangent; where it is not positive definite, with the tangent projected element by element; where that is
// singular (an element far from equilibrium has no stiffness in the directions that were projected), with a shift of
// its diagonal (Levenberg). Backtracking (Armijo) on the energy. A step is at most an edge long: whole ones, by the
// lift of a tool at once, stalled at the barrier of the neo-Hookean law, or ended in a corner turned inside out.
//
// Grasped vertices are held by stiff springs, not prescribed: one solve then carries the whole body along with the
// tool, where prescribed vertices would stretch the elements around them first.
//
// om_fem_statics_solve serves other purposes: its load steps scale the weight, it cannot stop after a few iterations,
// and it keeps no factors for derivatives of the equilibrium.
#include <string.h>

#include "match/match_internal.h"

#define MAX_NEWTON 60
#define TOLERANCE 1e-5  // m
#define ARMIJO 1e-4
#define MAX_BACKTRACK 12
// Support of tissue without attachments, over the stiffness of an attachment. On a kidney, fat sags by 2 mm then, as
// the settled body does.
#define SUPPORT 0.0002
#define MAX_STEP 1.0  // edges that a vertex moves in an iteration
#define MAX_SHIFT 4   // attempts with a shift
// N/m on the diagonal over Young's modulus times the mean edge; then ten times more each
#define SHIFT 1e-3

// ---- the load -----------------------------------------------------------------------------------------------

static OmStatus check_pose(const OmMatchGrasp* g, int k) {
    const OmPose pose[2] = {g->pose_world_grasp, g->pose_world_now};
    for (int i = 0; i < 2; ++i) {
        OmQuat q = pose[i].q;
        double length = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
        OM_CHECK(om_is_finite3(pose[i].p) && fabs(length - 1) < 1e-3, OM_INVALID,
                 "match: grasp %d: a pose is not finite, or its quaternion has no length 1", k);
    }
    OM_CHECK(isfinite(g->radius) && g->radius >= 0, OM_INVALID,
             "match: grasp %d: radius %g m, must be at least 0", k, g->radius);
    return OM_OK;
}

// A vertex of two grasps follows the first one.
static void hold(const OmMatch* m, OmPose motion, int v, int before, MatchHeld* h) {
    for (int i = 0; i < before; ++i)
        if (h->vert[i] == v) return;
    h->vert[h->nvert] = v;
    om_store3(h->goal, h->nvert, om_pose_apply(motion, om_load3(m->view.mesh->x, v)));
    ++h->nvert;
}

static OmStatus add_grasp(const OmMatch* m, const OmMatchGrasp* g, int k, MatchHeld* held) {
    const OmTetMesh* mesh = m->view.mesh;
    OM_TRY(check_pose(g, k));
    OmPose motion = om_pose_mul(g->pose_world_now, om_pose_inverse(g->pose_world_grasp));
    int before = held->nvert;
    double radius = g->radius > 0 ? g->radius : m->def.scene->task.grasp_radius, nearest = HUGE_VAL;
    OM_CHECK(!g->vert || (g->nvert > 0 && g->nvert <= mesh->nvert - before), OM_INVALID,
             "match: grasp %d has %d vertices: 1 to %d", k, g->nvert, mesh->nvert - before);
    for (int i = 0; g->vert && i < g->nvert; ++i) {
        OM_CHECK(g->vert[i] >= 0 && g->vert[i] < mesh->nvert, OM_INVALID,
                 "match: grasp %d: vertex %d of %d", k, g->vert[i], mesh->nvert);
        hold(m, motion, g->vert[i], before, held);
    }
    for (int v = 0; !g->vert && v < mesh->nvert; ++v) {
        double d = om_distance(om_load3(mesh->x, v), g->pose_world_grasp.p);
        nearest = fmin(nearest, d);
        if (d <= radius && held->nvert < mesh->nvert) hold(m, motion, v, before, held);
    }
    OM_CHECK(held->nvert > before || nearest > radius, OM_INVALID,
             "match: grasp %d: another grasp has all its vertices", k);
    OM_CHECK(
        held->nvert > before, OM_INVALID,
        "match: grasp %d: no vertex of the twin within %.1f mm of the grasp (nearest: %.1f mm)", k,
        1e3 * radius, 1e3 * nearest);
    return OM_OK;
}

OmStatus om__match_find_held(const OmMatch* m, int ngrasp, const OmMatchGrasp* grasp,
                             MatchHeld* held) {
    OM_CHECK(ngrasp >= 0 && ngrasp <= OM_MAX_ARM, OM_INVALID, "match: %d grasps, at most %d",
             ngrasp, OM_MAX_ARM);
    held->nvert = 0;
    for (int k = 0; k < ngrasp; ++k) OM_TRY(add_grasp(m, &grasp[k], k, held));
    return OM_OK;
}

static OmStatus check_pull(const OmMatch* m, const OmMatchPull* p, int k) {
    OM_CHECK(p->tri >= 0 && p->tri < m->surface.ntri, OM_INVALID,
             "match: pull %d: triangle %d, the surface has %d", k, p->tri, m->surface.ntri);
    bool is_good = om_is_finite3(p->goal) && om_is_finite3(p->normal);
    for (int i = 0; i < 3; ++i) is_good = is_good && isfinite(p->bary[i]);
    OM_CHECK(is_good, OM_INVALID, "match: pull %d is not finite", k);
    OM_CHECK(isfinite(p->across) && p->across >= 0 && isfinite(p->along) && p->along >= 0,
             OM_INVALID, "match: pull %d: stiffness %g and %g N/m, must be at least 0", k,
             p->across, p->along);
    return OM_OK;
}

// Springs of candidates act by area on vertices and midpoints; a midpoint has one where both ends of its edge have.
static void spread_springs(OmMatch* m, const double* spring) {
    memset(m->spring, 0, (size_t)m->mesh.nvert * sizeof *m->spring);
    for (int i = 0; spring && i < m->view.ncandidate; ++i) {
        int v = m->candidate[i];
        m->spring[v] = !m->mid_end ? spring[i] : m->area[i] > 0 ? spring[i] / m->area[i] : 0;
    }
    for (int i = m->ncorner; spring && i < m->mesh.nvert; ++i) {
        double a = m->spring[m->mid_end[2 * (i - m->ncorner)]],
               b = m->spring[m->mid_end[2 * (i - m->ncorner) + 1]];
        if (a > 0 && b > 0) m->spring[i] = 0.5 * (a + b) * m->vert_area[i];
    }
    for (int v = 0; m->mid_end && v < m->ncorner; ++v) m->spring[v] *= m->vert_area[v];
}

OmStatus om__match_set_load(OmMatch* m, const OmMatchLoad* load, const double* x) {
    for (int v = 0; v < m->view.mesh->nvert; ++v)
        OM_CHECK(om_is_finite3(om_load3(x, v)), OM_INVALID,
                 "match: position of vertex %d is not finite", v);
    for (int i = 0; load->spring && i < m->view.ncandidate; ++i)
        OM_CHECK(isfinite(load->spring[i]) && load->spring[i] >= 0, OM_INVALID,
                 "match: spring of candidate %d: %g N/m, must be at least 0", i, load->spring[i]);
    for (int k = 0; k < load->npull; ++k) OM_TRY(check_pull(m, &load->pull[k], k));
    spread_springs(m, load->spring);
    return om__match_find_held(m, load->ngrasp, load->grasp, &m->held);
}

// ---- the energy and its derivatives -------------------------------------------------------------------------

double om__match_gap(const OmMatch* m, OmVec3 p, OmVec3* normal) {
    const OmSite* site = m->def.site;
    double gap = HUGE_VAL;
    if (site->has_ground) {
        *normal = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
        gap = om_dot(om_sub(p, site->pose_world_task.p), *normal);
    }
    if (site->has_organ) {
        OmVec3 n;
        double d = om_sdf_eval(&site->organ_sdf, p, &n);
        if (d < gap) {
            gap = d;
            *normal = n;
        }
    }
    return gap;
}

OmVec3 om__match_pull_point(const OmMatch* m, const OmMatchPull* p, const double* x) {
    const int* v = m->surface.tri_vert + 3 * (size_t)p->tri;
    OmVec3 q = om_vec3(0, 0, 0);
    for (int k = 0; k < 3; ++k) q = om_madd(q, p->bary[k], om_load3(x, m->surface_vert[v[k]]));
    return q;
}

// A spring of isotropic stiffness k at vertex v; each output may be null.
static void add_spring(int v, double k, OmVec3 goal, const double* x, double* energy, double* f,
                       OmBsr* A) {
    OmVec3 e = om_sub(om_load3(x, v), goal);
    *energy += 0.5 * k * om_norm2(e);
    if (f) om_store3(f, v, om_madd(om_load3(f, v), k, e));
    if (A) om_bsr_add(A, A->row_adr[v], om_mat3_scale(k, om_mat3_identity()));
}

static void add_contact(const OmMatch* m, const double* x, double* energy, double* f, OmBsr* A) {
    for (int i = 0; i < m->surface.nvert; ++i) {
        int v = m->surface_vert[i];
        OmVec3 n = om_vec3(0, 0, 0);
        double d = om__match_gap(m, om_load3(x, v), &n), k = m->def.contact * m->vert_area[v];
        if (!(d < 0)) continue;
        *energy += 0.5 * k * d * d;
        if (f) om_store3(f, v, om_madd(om_load3(f, v), k * d, n));
        if (A) om_bsr_add(A, A->row_adr[v], om_mat3_scale(k, om_mat3_outer(n, n)));
    }
}

static void add_pull(const OmMatch* m, const OmMatchPull* p, const double* x, double* energy,
                     double* f, OmBsr* A) {
    const int* tri = m->surface.tri_vert + 3 * (size_t)p->tri;
    OmVec3 e = om_sub(om__match_pull_point(m, p, x), p->goal);
    double h = om_dot(e, p->normal);
    *energy += 0.5 * (p->across * h * h + p->along * om_norm2(e));
    OmVec3 g = om_madd(om_scale(p->along, e), p->across * h, p->normal);
    OmMat3 H = om_mat3_add(om_mat3_scale(p->along, om_mat3_identity()),
                           om_mat3_scale(p->across, om_mat3_outer(p->normal, p->normal)));
    for (int a = 0; a < 3; ++a) {
        int v = m->surface_vert[tri[a]];
        if (f) om_store3(f, v, om_madd(om_load3(f, v), p->bary[a], g));
        for (int b = 0; b < 3 && A; ++b)
            om_bsr_add(A, om_bsr_find(A, v, m->surface_vert[tri[b]]),
                       om_mat3_scale(p->bary[a] * p->bary[b], H));
    }
}

// Everything but the elements.
static void add_load(OmMatch* m, const OmMatchLoad* load, const double* x, double* energy,
                     double* f, OmBsr* A) {
    const OmTetMesh* mesh = m->view.mesh;
    const double* mass = om_fem_mass(m->solid);
    // Only the weight does not change with the modulus: energy and forces are those over the factor.
    OmVec3 gravity = om_scale(load->young > 0 ? 1 / load->young : 1, m->def.site->gravity);
    for (int v = 0; v < mesh->nvert && !A; ++v) {
        *energy -= mass[v] * om_dot(gravity, om_load3(x, v));
        if (f) om_store3(f, v, om_madd(om_load3(f, v), -mass[v], gravity));
    }
    for (int v = 0; load->spring && v < mesh->nvert; ++v)
        if (m->spring[v] > 0) add_spring(v, m->spring[v], om_load3(mesh->x, v), x, energy, f, A);
    for (int i = 0; i < m->held.nvert; ++i)
        add_spring(m->held.vert[i], m->hold, om_load3(m->held.goal, i), x, energy, f, A);
    add_contact(m, x, energy, f, A);
    for (int k = 0; k < load->npull; ++k) add_pull(m, &load->pull[k], x, energy, f, A);
}

static OmStatus eval(OmMatch* m, const OmMatchLoad* load, const double* x, double* energy,
                     double* f) {
    if (f)
        OM_TRY(om_fem_eval_force(m->solid, x, f, energy));
    else
        OM_TRY(om_fem_eval_energy(m->solid, x, energy));
    add_load(m, load, x, energy, f, NULL);
    return OM_OK;
}

OmStatus om_match_eval(OmMatch* m, const OmMatchLoad* load, const double* x, double* energy,
                       double* gradient) {
    OM_TRY(om__match_set_load(m, load, x));
    return eval(m, load, x, energy, gradient);
}

// ---- Newton's method ----------------------------------------------------------------------------------------

static OmStatus factorize(OmMatch* m, const OmMatchLoad* load, const double* x) {
    OmStatus status = OM_NOT_SPD;
    double energy = 0, shift = SHIFT * m->hold / OM__MATCH_HOLD;
    m->has_factors = false;
    for (int turn = 0; turn < 2 + MAX_SHIFT && status == OM_NOT_SPD; ++turn) {
        if (turn < 2) {
            OM_TRY(om_fem_eval_tangent(turn == 0 ? m->solid : m->projected, x, &m->A));
            add_load(m, load, x, &energy, NULL, &m->A);
        } else {  // to what is there
            for (int v = 0; v < m->mesh.nvert; ++v)
                om_bsr_add(&m->A, m->A.row_adr[v], om_mat3_scale(shift, om_mat3_identity()));
            shift *= 10;
        }
        status = om_solver_refresh(m->solver, &m->A);
    }
    m->has_factors = status == OM_OK;
    return status;
}

OmStatus om_match_factorize(OmMatch* m, const OmMatchLoad* load, const double* x) {
    OM_TRY(om__match_set_load(m, load, x));
    return factorize(m, load, x);
}

OmStatus om_match_solve(OmMatch* m, int nrhs, const double* force, double* dx) {
    OM_CHECK(m->has_factors, OM_INVALID, "match: no factors; call om_match_factorize first");
    memset(dx, 0, (size_t)nrhs * 3 * (size_t)m->view.mesh->nvert * sizeof *dx);
    return om_solver_solve(m->solver, &m->A, nrhs, force, dx, NULL);
}

OmStatus om__match_rest_shape(OmMatch* m, const double** x) {
    const size_t n = 3 * (size_t)m->mesh.nvert;
    *x = m->x_rest;
    if (m->x_rest) return OM_OK;
    OmStatus status = OM_OK;
    double *now = NULL, *spring = NULL;
    OM_ALLOC_DONE(now, n);
    OM_CALLOC_DONE(spring, m->view.ncandidate);
    const OmMeshSet* held = om_tet_mesh_find_set(&m->mesh, "attachment");
    for (int i = 0; i < m->view.ncandidate; ++i)
        spring[i] = SUPPORT * m->def.foundation * m->area[i];
    for (int k = 0; held && k < held->nvert; ++k) {
        int i = held->vert[k] < m->ncorner ? m->candidate_of[held->vert[k]] : -1;
        if (i >= 0) spring[i] = m->def.foundation * m->area[i];
    }
    memcpy(now, m->mesh.x, n * sizeof *now);
    OmMatchLoad load = {.spring = spring, .tolerance = 5e-5};
    status = om_match_find_rest(m, &load, now, NULL);
    if (status != OM_OK && status != OM_NO_MEMORY) {
        memcpy(now, m->mesh.x, n * sizeof *now);
        status = OM_OK;
    }
    if (status == OM_OK) *x = m->x_rest = now, now = NULL;
done:
    om_free(now);
    om_free(spring);
    return status;
}

static double largest(const double* a, int n) {
    double most = 0;
    for (int i = 0; i < n; ++i) most = fmax(most, om_norm2(om_load3(a, i)));
    return sqrt(most);
}

// Backtracking along dx from x; *energy and r are those of the new x. *share: of dx; 0: no step lowers the energy.
static OmStatus search_line(OmMatch* m, const OmMatchLoad* load, double* x, double* energy,
                            double* share) {
    size_t n = 3 * (size_t)m->view.mesh->nvert;
    double slope = 0, e = 0;
    for (size_t i = 0; i < n; ++i) slope += m->r[i] * m->dx[i];
    const double far = largest(m->dx, m->view.mesh->nvert), most = MAX_STEP * m->view.edge;
    *share = far > most ? most / far : 1;
    for (int turn = 0; turn < MAX_BACKTRACK; ++turn, *share *= 0.5) {
        for (size_t i = 0; i < n; ++i) m->y[i] = x[i] + *share * m->dx[i];
        OM_TRY(eval(m, load, m->y, &e, m->r));
        if (e <= *energy + ARMIJO * *share * slope + 1e-13 * fabs(*energy)) {
            memcpy(x, m->y, n * sizeof *x);
            *energy = e;
            return OM_OK;
        }
    }
    *share = 0;
    return eval(m, load, x, energy, m->r);
}

OmStatus om_match_find_rest(OmMatch* m, const OmMatchLoad* load, double* x, OmMatchRest* out) {
    int nvert = m->view.mesh->nvert;
    int most = load->max_newton > 0 ? load->max_newton : MAX_NEWTON;
    double tolerance = load->tolerance > 0 ? load->tolerance : TOLERANCE;
    OmMatchRest rest = {.motion = HUGE_VAL};
    OM_TRY(om__match_set_load(m, load, x));
    OM_TRY(eval(m, load, x, &rest.energy, m->r));
    OmStatus status = OM_OK;
    while (rest.nnewton < most && rest.motion > tolerance) {
        status = factorize(m, load, x);
        if (status != OM_OK) break;
        for (int i = 0; i < 3 * nvert; ++i) m->y[i] = -m->r[i];
        status = om_match_solve(m, 1, m->y, m->dx);
        if (status != OM_OK) break;
        double share;
        status = search_line(m, load, x, &rest.energy, &share);
        if (status != OM_OK) break;
        ++rest.nnewton;
        // Without a step that lowers the energy, x is at rest only if the whole step is within the tolerance.
        rest.motion = (share > 0 ? share : 1) * largest(m->dx, nvert);
        if (share == 0) break;
    }
    rest.residual = largest(m->r, nvert);
    if (out) *out = rest;
    if (status < 0) return status;
    bool is_done = status == OM_OK && rest.motion <= tolerance && rest.nnewton > 0;
    return is_done ? OM_OK : OM_NOT_CONVERGED;
}
