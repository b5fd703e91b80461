// match_adopt.c: attachments of a body change over a stated time.
//
// A spring to an anchor a has the force k (a - x). At the beginning every listed vertex gets the spring of its new or,
// if it is to be freed, of its present stiffness, with the anchor at which its force stays the same. With
// s = 3 t^2 - 2 t^3 of the time share t, anchors of attached vertices are at a_0 + s (X - a_0), X the rest position,
// and springs of freed vertices have the stiffness (1 - s) k_0. At t = 1 freed vertices leave. A vertex that is to be
// held still has the stiffest spring of the list, which arrives at t = 0.6. Load keeps it from X: it is fixed where it
// is then, and its anchor travels to X until t = 1.
//
// Rejected: to fix it at X when its spring has arrived. A vertex under 0.4 N then moves by 1.25 mm in one step.
// Rejected: fixed anchors that travel for all. The tool and a fixed vertex then prescribe the same element, and forces
// have no bound; a spring gives way.
#include <math.h>
#include <string.h>

#include "omentum/match_adopt.h"

#define STIFF \
    300.0  // N/m, of the springs that lead to fixed vertices, where the estimate has no spring

#define SPRING_SHARE 0.6  // of the time: springs of vertices that are to be held still arrive

typedef struct Head {
    int nvert;       // of the mesh
    int nlist;       // vertices that are attached or being freed
    int is_active;   //
    int has_spring;  // the engine has springs
    double elapsed, seconds;
} Head;

struct OmMatchAdoption {
    size_t size;     // of the block: Head and arrays
    Head* head;      // the block
    double* anchor;  // at the beginning, m                  (nvert x 3)
    double* spring;  // N/m, at the beginning; 0: held still             (nvert)
    double* goal;    // N/m, in the end; 0: held still; below 0: freed  (nvert)
    int* vert;       // vertices                                         (nvert)
    // scratch, no state
    double *now, *now_spring;  // (nvert x 3), (nvert)
    int* now_vert;             // (nvert)
};

OmStatus om_match_adoption_create(int nvert, OmMatchAdoption** out) {
    *out = NULL;
    OM_CHECK(nvert > 0, OM_INVALID, "adoption: a body of %d vertices", nvert);
    OmMatchAdoption* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    size_t n = (size_t)nvert;
    a->size = sizeof(Head) + n * (5 * sizeof(double) + sizeof(int));
    a->head = om_calloc(1, a->size);
    a->now = om_calloc(3 * n, sizeof *a->now);
    a->now_spring = om_calloc(n, sizeof *a->now_spring);
    a->now_vert = om_calloc(n, sizeof *a->now_vert);
    if (!a->head || !a->now || !a->now_spring || !a->now_vert) {
        om_match_adoption_destroy(a);
        return OM_NO_MEMORY;
    }
    a->head->nvert = nvert;
    a->anchor = (double*)(a->head + 1);
    a->spring = a->anchor + 3 * n;
    a->goal = a->spring + n;
    a->vert = (int*)(a->goal + n);
    *out = a;
    return OM_OK;
}

void om_match_adoption_destroy(OmMatchAdoption* a) {
    if (!a) return;
    om_free(a->head);
    om_free(a->now);
    om_free(a->now_spring);
    om_free(a->now_vert);
    om_free(a);
}

bool om_match_adoption_is_active(const OmMatchAdoption* a) { return a->head->is_active; }
void om_match_adoption_cancel(OmMatchAdoption* a) { a->head->is_active = 0; }
void om_match_adoption_get_goal(const OmMatchAdoption* a, unsigned char* attached) {
    if (!a->head->is_active) return;
    memset(attached, 0, (size_t)a->head->nvert);
    for (int i = 0; i < a->head->nlist; ++i) attached[a->vert[i]] = a->goal[i] >= 0;
}
size_t om_match_adoption_state_size(const OmMatchAdoption* a) { return a->size; }
void om_match_adoption_save(const OmMatchAdoption* a, void* block) {
    memcpy(block, a->head, a->size);
}
void om_match_adoption_restore(OmMatchAdoption* a, const void* block) {
    memcpy(a->head, block, a->size);
}
uint64_t om_match_adoption_hash(const OmMatchAdoption* a) {
    return om_hash(a->head, a->size, OM_HASH_SEED);
}

static OmStatus check_begin(const OmMatchAdoption* a, const OmBody* body,
                            const unsigned char* attached, const double* stiffness,
                            double seconds) {
    int nvert = om_body_site(body)->mesh.nvert;
    OM_CHECK(attached && nvert == a->head->nvert, OM_INVALID,
             "adoption: of %d vertices, the body has %d; or `attached` is null", a->head->nvert,
             nvert);
    OM_CHECK(isfinite(seconds) && seconds > 0, OM_INVALID, "adoption: %g s, must be above 0",
             seconds);
    for (int v = 0; stiffness && v < nvert; ++v)
        OM_CHECK(!attached[v] || (isfinite(stiffness[v]) && stiffness[v] >= 0), OM_INVALID,
                 "adoption: stiffness %g N/m of vertex %d, must be at least 0", stiffness[v], v);
    return OM_OK;
}

// The list in scratch: vertices, and the springs with which they begin. Goals go to `goal`.
static int make_list(OmMatchAdoption* a, const OmBody* body, const unsigned char* attached,
                     const double* stiffness, double* goal) {
    const unsigned char* is_held = om_body_attached(body);
    const double* present = om_body_attachment_stiffness(body);
    double most = 0;
    int n = 0;
    for (int v = 0; v < a->head->nvert; ++v)
        if (attached[v] && stiffness) most = fmax(most, stiffness[v]);
    if (most == 0) most = STIFF;
    for (int v = 0; v < a->head->nvert; ++v) {
        if (!attached[v] && !is_held[v]) continue;
        double wanted = attached[v] ? (stiffness ? stiffness[v] : 0) : -1;
        double begin = wanted > 0 ? wanted : wanted == 0 || present[v] == 0 ? most : present[v];
        a->now_vert[n] = v;
        a->now_spring[n] = begin;
        goal[n++] = wanted;
    }
    return n;
}

OmStatus om_match_adoption_begin(OmMatchAdoption* a, OmBody* body, const unsigned char* attached,
                                 const double* stiffness, double seconds) {
    OM_TRY(check_begin(a, body, attached, stiffness, seconds));
    double* goal;
    OM_ALLOC(goal, a->head->nvert);
    int n = make_list(a, body, attached, stiffness, goal);
    bool has_spring = om_body_engine(body)->has_springs;
    int k = 0;
    for (int i = 0; i < n && !has_spring; ++i) {  // held still or free at once
        if (goal[i] < 0) continue;
        a->now_vert[k] = a->now_vert[i];
        a->now_spring[k] = goal[k] = 0;
        ++k;
    }
    if (!has_spring) n = k;
    OmStatus status = om_body_eval_anchor(body, n, a->now_vert, a->now_spring, a->now);
    if (status == OM_OK)
        status = om_body_set_attachment(body, n, a->now_vert, a->now, a->now_spring);
    if (status == OM_OK) {
        size_t m = (size_t)n;
        *a->head = (Head){.nvert = a->head->nvert,
                          .nlist = n,
                          .is_active = 1,
                          .has_spring = has_spring,
                          .seconds = seconds};
        memcpy(a->anchor, a->now, 3 * m * sizeof *a->anchor);
        memcpy(a->spring, a->now_spring, m * sizeof *a->spring);
        memcpy(a->goal, goal, m * sizeof *goal);
        memcpy(a->vert, a->now_vert, m * sizeof *a->vert);
    }
    om_free(goal);
    return status;
}

static double smooth(double t) {
    t = fmin(1, fmax(0, t));
    return t * t * (3 - 2 * t);
}

// Vertices that are to be held still become fixed where they are, unless an arm grasps them.
static void fix(OmMatchAdoption* a, const OmBody* body) {
    const signed char* held_by = om_body_held_by(body);
    for (int i = 0; i < a->head->nlist; ++i) {
        if (a->goal[i] != 0 || held_by[a->vert[i]] >= 0) continue;
        a->spring[i] = 0;
        om_store3(a->anchor, i, om_load3(om_body_x(body), a->vert[i]));
    }
}

// Attachments at the time share t.
static OmStatus apply(OmMatchAdoption* a, OmBody* body, double t) {
    const double* rest = om_body_site(body)->mesh.x;
    const bool has_spring = a->head->has_spring;
    int n = 0;
    for (int i = 0; i < a->head->nlist; ++i) {
        bool is_freed = a->goal[i] < 0;
        if (is_freed && t >= 1) continue;
        double s = smooth(t);
        if (a->goal[i] == 0 && has_spring)
            s = smooth(a->spring[i] > 0 ? t / SPRING_SHARE
                                        : (t - SPRING_SHARE) / (1 - SPRING_SHARE));
        int v = a->vert[i];
        OmVec3 from = om_load3(a->anchor, i), to = om_load3(rest, v);
        om_store3(a->now, n, is_freed ? from : s >= 1 ? to : om_lerp(from, to, s));
        a->now_spring[n] = is_freed ? (1 - s) * a->spring[i] : a->spring[i];
        a->now_vert[n++] = v;
    }
    return om_body_set_attachment(body, n, a->now_vert, a->now, a->now_spring);
}

// ---- a step ---------------------------------------------------------------------------------------------------

OmStatus om_match_adoption_step(OmMatchAdoption* a, OmBody* body, double dt) {
    OM_CHECK(isfinite(dt) && dt >= 0, OM_INVALID, "adoption: a step of %g s", dt);
    Head* h = a->head;
    if (!h->is_active) return OM_OK;
    OM_CHECK(om_body_site(body)->mesh.nvert == h->nvert, OM_INVALID, "adoption: of another body");
    double t = fmin(1, (h->elapsed + dt) / h->seconds);  // seconds > 0
    if (t > 1 - 1e-9) t = 1;
    if (h->has_spring && h->elapsed / h->seconds <= SPRING_SHARE && t > SPRING_SHARE) fix(a, body);
    OM_TRY(apply(a, body, t));
    h->elapsed += dt;
    h->is_active = t < 1;
    return OM_OK;
}
