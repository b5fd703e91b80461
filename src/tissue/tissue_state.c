// tissue_state.c: the block of a state; attachments and grasps.
#include <string.h>

#include "omentum/shape_closest.h"
#include "tissue/tissue_internal.h"

#define GRASP_RADIUS 0.005  // m, thesis 6.4.7

_Static_assert(sizeof(OmTissueState) <= OM__STATE_HEAD, "the head of a state must fit");

// Bytes before the stiffness of attachments.
static size_t size_before_stiffness(const OmTissueModel* m) {
    size_t extra = m->engine->get_state_size ? m->engine->get_state_size(m) : 0;
    return (om__state_size(m->mesh.nvert) + extra + 63) / 64 * 64;
}

size_t om_tissue_state_size(const OmTissueModel* m) {
    size_t stiffness = (size_t)m->mesh.nvert * sizeof(double);
    return (size_before_stiffness(m) + stiffness + 63) / 64 * 64;
}

OmStatus om_tissue_state_create(const OmTissueModel* m, OmTissueState** state) {
    *state = om_calloc(1, om_tissue_state_size(m));
    if (!*state) return OM_NO_MEMORY;
    om_tissue_state_reset(m, *state);
    return OM_OK;
}

void om_tissue_state_destroy(OmTissueState* s) { om_free(s); }

// Of quadratic elements: a midpoint is held still if both ends of its edge are, half-way between their anchors.
static void attach_midpoints(const OmTissueModel* m, OmTissueState* s) {
    double* anchor = om__state_array(s, OM__ANCHOR);
    for (int i = m->ncorner; i < m->mesh.nvert; ++i) {
        const int* end = m->mid_end + 2 * (size_t)(i - m->ncorner);
        if (om__state_attached(s)[i] || om__state_held_by(s)[i] >= 0) continue;
        if (!om__is_held_still(s, end[0]) || !om__is_held_still(s, end[1])) continue;
        om__state_attached(s)[i] = 1;
        om_store3(anchor, i, om_lerp(om_load3(anchor, end[0]), om_load3(anchor, end[1]), 0.5));
    }
}

void om_tissue_state_reset(const OmTissueModel* m, OmTissueState* s) {
    size_t nvert = (size_t)m->mesh.nvert;
    memset((void*)s, 0, om_tissue_state_size(m));
    s->size = size_before_stiffness(m);
    s->nvert = m->mesh.nvert;
    memcpy(om__state_array(s, OM__X), m->mesh.x, nvert * 3 * sizeof(double));
    memcpy(om__state_array(s, OM__ANCHOR), m->mesh.x, nvert * 3 * sizeof(double));
    memset(om__state_held_by(s), -1, nvert);
    for (int k = 0; m->held && k < m->held->nvert; ++k) {
        int i = m->held->vert[k];
        if (i >= m->ncorner) continue;
        om__state_attached(s)[i] = 1;
        om__state_stiffness(s)[i] = m->stiffness[i];
    }
    attach_midpoints(m, s);
    for (int arm = 0; arm < OM_MAX_ARM; ++arm)
        s->arm[arm].pose = s->arm[arm].goal = om_pose_identity();
    if (m->engine->sync_state) m->engine->sync_state(m, s);
}

// If every attachment has the model's stiffness, the array is redundant and is not hashed.
uint64_t om_tissue_state_hash(const OmTissueState* s) {
    uint64_t hash = om_hash(s, s->size, OM_HASH_SEED);
    if (!s->is_own_stiffness) return hash;
    return om_hash(om__state_stiffness(s), (size_t)s->nvert * sizeof(double), hash);
}
const double* om_tissue_x(const OmTissueState* s) { return om__state_array(s, OM__X); }
const double* om_tissue_v(const OmTissueState* s) { return om__state_array(s, OM__V); }
double om_tissue_time(const OmTissueState* s) { return s->time; }
double* om_tissue_external_force(OmTissueState* s) { return om__state_array(s, OM__F_EXT); }
double* om_tissue_contact_force(OmTissueState* s) { return om__state_array(s, OM__F_TOUCH); }
const unsigned char* om_tissue_attached(const OmTissueState* s) { return om__state_attached(s); }
const double* om_tissue_anchor(const OmTissueState* s) { return om__state_array(s, OM__ANCHOR); }
const double* om_tissue_attachment_stiffness(const OmTissueState* s) {
    return om__state_stiffness(s);
}
const signed char* om_tissue_held_by(const OmTissueState* s) { return om__state_held_by(s); }

OmStatus om_tissue_set_x(const OmTissueModel* m, OmTissueState* s, const double* x,
                         const double* v) {
    size_t n = 3 * (size_t)m->mesh.nvert;
    OM_CHECK(x, OM_INVALID, "tissue: positions are null");
    for (size_t i = 0; i < n; ++i) {
        OM_CHECK(isfinite(x[i]), OM_INVALID, "tissue: position of vertex %d is not finite",
                 (int)(i / 3));
        OM_CHECK(!v || isfinite(v[i]), OM_INVALID, "tissue: velocity of vertex %d is not finite",
                 (int)(i / 3));
    }
    memmove(om__state_array(s, OM__X), x, n * sizeof(double));
    if (v)
        memmove(om__state_array(s, OM__V), v, n * sizeof(double));
    else
        memset(om__state_array(s, OM__V), 0, n * sizeof(double));
    if (m->engine->sync_state) m->engine->sync_state(m, s);
    return OM_OK;
}

// ---- attachments ----------------------------------------------------------------------------------

// Stiffness of the k-th vertex to attach.
static double stiffness_of(const OmTissueModel* m, const int* vert, const double* stiffness,
                           int k) {
    return stiffness ? stiffness[k] : m->stiffness[vert[k]];
}

static OmStatus check_attachment(const OmTissueModel* m, const OmTissueState* s, const int* vert,
                                 const double* stiffness, int k) {
    int i = vert[k];
    OM_CHECK(i >= 0 && i < m->mesh.nvert, OM_INVALID,
             "tissue: attached vertex %d is not one of the mesh's %d", i, m->mesh.nvert);
    double of_vertex = stiffness_of(m, vert, stiffness, k);
    OM_CHECK(of_vertex >= 0 && of_vertex <= OM__MAX_STIFFNESS, OM_INVALID,
             "tissue: attachment stiffness of vertex %d is %g N/m; it must be from 0 (held still) "
             "to %g",
             i, of_vertex, OM__MAX_STIFFNESS);
    OM_CHECK(of_vertex <= 0 || m->engine->has_springs, OM_UNAVAILABLE,
             "tissue: vertex %d is attached by a spring of %g N/m, but engine \"%s\" has no "
             "springs; it can only hold vertices still (stiffness 0)",
             i, of_vertex, m->engine->name);
    int arm = om__state_held_by(s)[i];
    OM_CHECK(arm < 0 || of_vertex > 0, OM_INVALID,
             "tissue: vertex %d cannot be held still, arm %d holds it; release it first", i, arm);
    return OM_OK;
}

OmStatus om_tissue_set_attachment(const OmTissueModel* m, OmTissueState* s, int nvert,
                                  const int* vert, const double* anchor, const double* stiffness) {
    OM_CHECK(nvert >= 0 && (nvert == 0 || vert), OM_INVALID,
             "tissue: %d attached vertices, and their list is null", nvert);
    for (int k = 0; k < nvert; ++k) {
        OM_TRY(check_attachment(m, s, vert, stiffness, k));
        OM_CHECK(!anchor || om_is_finite3(om_load3(anchor, k)), OM_INVALID,
                 "tissue: anchor of vertex %d is not finite", vert[k]);
    }
    // The listed vertices first: anchor and stiffness may be the state's own arrays.
    double *a = om__state_array(s, OM__ANCHOR), *of_state = om__state_stiffness(s);
    unsigned char* attached = om__state_attached(s);
    memset(attached, 0, (size_t)m->mesh.nvert);
    s->is_own_stiffness = 0;
    for (int k = 0; k < nvert; ++k) {
        int i = vert[k];
        OmVec3 place = anchor ? om_load3(anchor, k) : om_load3(m->mesh.x, i);
        of_state[i] = stiffness_of(m, vert, stiffness, k);
        attached[i] = 1;
        if (of_state[i] != m->stiffness[i]) s->is_own_stiffness = 1;
        om_store3(a, i, place);
    }
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (attached[i]) continue;
        of_state[i] = 0;
        om_store3(a, i, om_load3(m->mesh.x, i));
    }
    attach_midpoints(m, s);
    return OM_OK;
}

OmStatus om_tissue_eval_anchor(const OmTissueModel* m, const OmTissueState* s, int nvert,
                               const int* vert, const double* stiffness, double* anchor) {
    OM_CHECK(nvert >= 0 && (nvert == 0 || (vert && anchor)), OM_INVALID,
             "tissue: %d attached vertices, and their list or their anchors are null", nvert);
    for (int k = 0; k < nvert; ++k) OM_TRY(check_attachment(m, s, vert, stiffness, k));
    double* force = om_alloc(3 * (size_t)m->mesh.nvert, sizeof *force);
    if (!force) return OM_NO_MEMORY;
    OmStatus status = om_tissue_get_attachment_force(m, s, force);
    for (int k = 0; status == OM_OK && k < nvert; ++k) {
        double k_new = stiffness_of(m, vert, stiffness, k);
        OmVec3 p = om_load3(om__state_array(s, OM__X), vert[k]);
        if (k_new > 0) p = om_madd(p, 1 / k_new, om_load3(force, vert[k]));
        om_store3(anchor, k, p);
    }
    om_free(force);
    return status;
}

bool om_tissue_is_prescribed(const OmTissueModel* m, const OmTissueState* s, int i) {
    (void)m;
    return om__is_prescribed(s, i);
}

// ---- grasping -------------------------------------------------------------------------------------

static OmStatus check_arm(int arm, OmPose pose) {
    OM_CHECK(arm >= 0 && arm < OM_MAX_ARM, OM_INVALID, "tissue: arm %d is not 0 or 1", arm);
    double n =
        pose.q.x * pose.q.x + pose.q.y * pose.q.y + pose.q.z * pose.q.z + pose.q.w * pose.q.w;
    OM_CHECK(om_is_finite3(pose.p) && fabs(n - 1) < 1e-6, OM_INVALID,
             "tissue: the pose of arm %d is not finite, or its quaternion not of unit length", arm);
    return OM_OK;
}

// A midpoint of an edge with an end that is held still. Held by the tool as well, it would leave the edge no free node:
// as the tissue is stretched the element turns inside out between tool and attachment, and the tool feels the barrier
// of the law instead of the tissue (15 N in place of 1 N, folding a sheet beside an attachment).
static bool is_between(const OmTissueModel* m, const OmTissueState* s, int i) {
    if (i < m->ncorner) return false;
    const int* end = m->mid_end + 2 * (size_t)(i - m->ncorner);
    return om__is_held_still(s, end[0]) || om__is_held_still(s, end[1]);
}

static double quad_distance(const double* x, const int v[4], OmVec3 p) {
    OmVec3 a = om_load3(x, v[0]), b = om_load3(x, v[1]), c = om_load3(x, v[2]),
           d = om_load3(x, v[3]);
    return fmin(om_distance(p, om_triangle_closest(p, a, b, c, NULL)),
                om_distance(p, om_triangle_closest(p, a, c, d, NULL)));
}

// The corners of the shells' face that is nearest to the tip; null: none is within reach. Jaws hold an area;
// held at one vertex the sheet hangs on it, and turns freely.
static const int* nearest_face(const OmTissueModel* m, const double* x, OmVec3 tip, double reach) {
    const int* best = NULL;
    double least = reach;
    for (int f = 0; m->def.element == OM_ELEMENT_SHELL && f < 2 * m->nelem; ++f) {  // below, above
        const int* v = m->elem_node + 4 * (size_t)f;
        if (m->own && !m->own[v[0]]) continue;
        double d = quad_distance(x, v, tip);
        if (d <= least) least = d, best = v;
    }
    return best;
}

static bool is_in_reach(const double* x, const int* face, int i, OmVec3 tip, double reach) {
    for (int k = 0; face && k < 4; ++k)
        if (face[k] == i) return true;
    return om_distance(om_load3(x, i), tip) <= reach;
}

OmStatus om_tissue_grasp(const OmTissueModel* m, OmTissueState* s, int arm, OmPose pose,
                         double radius, int* nheld) {
    if (nheld) *nheld = 0;
    OM_TRY(check_arm(arm, pose));
    OM_CHECK(radius >= 0 && isfinite(radius), OM_INVALID,
             "tissue: grasp radius is %g m; it must be at least 0 (0: %g m)", radius, GRASP_RADIUS);
    double reach = radius > 0 ? radius : GRASP_RADIUS;
    const double* x = om__state_array(s, OM__X);
    const signed char* by = om__state_held_by(s);
    int count = 0, nbusy = 0, nbetween = 0;
    double nearest = INFINITY;
    const int* face = nearest_face(m, x, pose.p, reach);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (m->own && !m->own[i]) continue;
        bool is_busy = (by[i] >= 0 && by[i] != arm) || om__is_held_still(s, i);
        nearest = fmin(nearest, om_distance(om_load3(x, i), pose.p));
        if (!is_in_reach(x, face, i, pose.p, reach)) continue;
        nbusy += is_busy;
        count += !is_busy;
        nbetween += !is_busy && is_between(m, s, i);
    }
    OM_CHECK(count > 0 || nbusy == 0, OM_INVALID,
             "arm %d cannot grasp: the %d vertices within %.1f mm of its tip are attached or held "
             "by the other arm",
             arm, nbusy, 1e3 * reach);
    OM_CHECK(
        count > 0, OM_INVALID,
        "arm %d cannot grasp: no tissue within %.1f mm of its tip, the nearest is %.1f mm away",
        arm, 1e3 * reach, 1e3 * nearest);
    const bool takes_between = count == nbetween;  // nothing else is in reach
    if (!takes_between) count -= nbetween;
    om_tissue_release(s, arm);
    OmPose pose_tip_world = om_pose_inverse(pose);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 p = om_load3(x, i);
        if (!is_in_reach(x, face, i, pose.p, reach) || by[i] >= 0 || (m->own && !m->own[i]))
            continue;
        if (om__is_held_still(s, i) || (!takes_between && is_between(m, s, i))) continue;
        om__state_held_by(s)[i] = (signed char)arm;
        om_store3(om__state_array(s, OM__GRIP), i, om_pose_apply(pose_tip_world, p));
    }
    s->arm[arm] = (OmTissueArm){.nheld = count, .pose = pose, .goal = pose};
    if (nheld) *nheld = count;
    return OM_OK;
}

OmStatus om_tissue_move_grasp(OmTissueState* s, int arm, OmPose pose) {
    OM_TRY(check_arm(arm, pose));
    if (s->arm[arm].nheld > 0) s->arm[arm].goal = pose;
    return OM_OK;
}

void om_tissue_release(OmTissueState* s, int arm) {
    if (arm < 0 || arm >= OM_MAX_ARM || s->arm[arm].nheld == 0) return;
    signed char* by = om__state_held_by(s);
    OmVec3 zero = {0, 0, 0};
    for (int i = 0; i < s->nvert; ++i) {
        if (by[i] != arm) continue;
        by[i] = -1;
        om_store3(om__state_array(s, OM__F_TOOL), i, zero);
        om_store3(om__state_array(s, OM__GRIP), i, zero);
    }
    s->arm[arm].nheld = 0;
}

int om_tissue_nheld(const OmTissueState* s, int arm) {
    return arm >= 0 && arm < OM_MAX_ARM ? s->arm[arm].nheld : 0;
}
