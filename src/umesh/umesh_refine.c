// umesh_refine.c: from the network's answer to equilibrium.
//
// What the network says is near; where it is wrong, forces of the elements say so. A cycle takes most of that away.
// Nodes of strained elements are relaxed among their neighbours (umesh_element.c), which ends what is local and turns
// elements back that came turned over. The forces that stay are smooth, and the organ's compliance at rest on a grid of
// twice the spacing answers them, with the patch where it is (umesh_coarse.c, umesh_linear.c). Near a deep press tissue
// is ten times as stiff as at rest: so the step is the minimum of the energy, to second order, over that answer and
// the step before, in the manner of conjugate gradients; it is cut where it would crush an element or leave a valley.
// Then nodes are relaxed again, backwards.
//
// What is left is estimated from what the last cycle moved, and cycles end when it is below a tolerance: an easy answer
// takes one, a press of 30 mm ten. Held against finite elements by prescribed displacements (the same equations) it
// ends at the same state, unless there are two: 18 of 5000 answers are more than 0.25 mm away, in another equilibrium
// wherever that was looked into; other load steps lead Newton's method there, too.
//
// Tried and rejected: corrections without relaxation (elements that are turned over make steps useless); the whole
// compliance instead of the coarse one (hardly fewer cycles, each several times as long); one direction with a line
// search (three times the cycles); scaling the compliance by nodes' stiffnesses (no fewer cycles with two directions);
// the network's answer in four load steps (half as many answers of another equilibrium, twice the time of hard ones).
//
// One team does it all, with barriers between; sums are over fixed blocks, so that bytes do not depend on workers.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_refine_internal.h"

#define BLOCK 64            // elements or nodes that are summed by one
#define MAX_TRIAL 8         // of the length of a step
#define CRUSH 0.4f          // of det F, by one step at most
#define OVERSHOOT 0.5       // slope at the end of a step, over that at its begin
#define LEAST_CUT 0.1       // of a step, at once
#define LEAST_RATE 0.3      // of convergence, taken for granted at best
#define MOST_RATE 0.9       // and at worst
#define DOUBTFUL_RATE 0.75  // at best, where the first step did not fit
#define STRAINED 0.2f       // an element whose nodes are relaxed: root mean square of |F - I|
// Below this tolerance (m) every node is relaxed, not only those near strained elements: the
// network's local error elsewhere is 0.01 mm.
#define FINE 2e-5
#define SOFTNESS 0.4    // share of the answer of the organ at rest that is taken for an error
#define DEPENDENT 1e-6  // squared sine of the angle between two directions that are one

struct UmeshRefine {
    UmeshElements elements;
    UmeshCoarse* coarse;
};

struct UmeshRefineWork {
    const UmeshRefine* with;
    int nelem_block, nnode_block;
    float *F, *before, *D;                  //                                    (nelem x REFINE_F)
    float* force;                           //                                          (nelem x 24)
    float *drive, *z, *old;                 // forces, direction, u one step ago        (nnode x 3)
    unsigned char *is_strained, *is_still;  //                             (nelem), (nnode)
    float *sum, *answer;                    //                                (coarse nodes x 3)
    double *curve, *slope[2], *dot;         // sums over blocks: (3, 2 and 2 a block)
    double* share;                          // of the patch's columns
    int nshare;
};

OmStatus om__umesh_refine_create(const OmUmeshGrid* g, double poisson, int nworker,
                                 UmeshRefine** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    UmeshRefine* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    OM_TRY_DONE(om__umesh_elements_init(g, poisson, &r->elements));
    OM_TRY_DONE(om__umesh_coarse_create(&r->elements, nworker, &r->coarse));
done:
    if (status < 0)
        om__umesh_refine_destroy(r);
    else
        *out = r;
    return status;
}

void om__umesh_refine_destroy(UmeshRefine* r) {
    if (!r) return;
    om__umesh_elements_done(&r->elements);
    om__umesh_coarse_destroy(r->coarse);
    om_free(r);
}

OmStatus om__umesh_refine_work_create(const UmeshRefine* r, UmeshRefineWork** out) {
    *out = NULL;
    const OmFemMesh* mesh = &r->elements.grid->mesh;
    size_t nelem = (size_t)mesh->nelem, nnode = (size_t)mesh->nnode;
    size_t ncoarse = (size_t)om__umesh_coarse_size(r->coarse);
    OmStatus status = OM_OK;
    UmeshRefineWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->with = r;
    w->nelem_block = om_block_count(mesh->nelem, BLOCK);
    w->nnode_block = om_block_count(mesh->nnode, BLOCK);
    float** gradient[] = {&w->F, &w->before, &w->D};
    float** nodal[] = {&w->drive, &w->z, &w->old};
    for (int k = 0; k < 3; ++k) {
        OM_ALLOC_DONE(*gradient[k], REFINE_F * nelem);
        OM_ALLOC_DONE(*nodal[k], 3 * nnode);
    }
    OM_ALLOC_DONE(w->force, 24 * nelem);
    OM_ALLOC_DONE(w->is_strained, nelem);
    OM_ALLOC_DONE(w->is_still, nnode);
    OM_ALLOC_DONE(w->sum, 3 * ncoarse);
    OM_ALLOC_DONE(w->answer, 3 * ncoarse);
    OM_ALLOC_DONE(w->curve, 3 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->slope[0], 2 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->slope[1], 2 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->dot, 2 * (size_t)w->nnode_block + OM_MAX_WORKER);
done:
    if (status < 0)
        om__umesh_refine_work_destroy(w);
    else
        *out = w;
    return status;
}

void om__umesh_refine_work_destroy(UmeshRefineWork* w) {
    if (!w) return;
    float* array[] = {w->F, w->before, w->D, w->drive, w->z, w->old, w->force, w->sum, w->answer};
    double* sums[] = {w->curve, w->slope[0], w->slope[1], w->dot, w->share};
    for (size_t k = 0; k < sizeof array / sizeof *array; ++k) om_free(array[k]);
    for (size_t k = 0; k < sizeof sums / sizeof *sums; ++k) om_free(sums[k]);
    om_free(w->is_strained);
    om_free(w->is_still);
    om_free(w);
}

size_t om__umesh_refine_work_memory(const UmeshRefineWork* w) {
    const OmFemMesh* mesh = &w->with->elements.grid->mesh;
    size_t ncoarse = (size_t)om__umesh_coarse_size(w->with->coarse);
    return sizeof *w +
           ((3 * REFINE_F + 24) * (size_t)mesh->nelem + 9 * (size_t)mesh->nnode + 6 * ncoarse) *
               sizeof(float) +
           (size_t)mesh->nelem + (size_t)mesh->nnode +
           (7 * (size_t)w->nelem_block + 2 * (size_t)w->nnode_block + OM_MAX_WORKER +
            (size_t)w->nshare) *
               sizeof(double);
}

// ---- the team -----------------------------------------------------------------------------------------

typedef struct Refining {  // what all members know
    UmeshRefineWork* work;
    const UmeshPatchSystem* patch;
    const unsigned char* mask;
    float* u;
    int nfree;  // nodes that can move
    double tolerance;
    int max_cycle;
    OmUmeshRefinement* report;
} Refining;

typedef struct Member {
    const Refining* r;
    const UmeshElements* t;
    UmeshRefineWork* w;
    OmTeam* team;
    int rank, size;
} Member;

// The member's part of n things, whole blocks if they are summed.
static int part(const Member* m, int n, int rank) { return (int)((int64_t)n * rank / m->size); }
#define MINE(m, n) part((m), (n), (m)->rank), part((m), (n), (m)->rank + 1)

static void find_block(int block, int n, int* begin, int* end) {
    *begin = block * BLOCK;
    *end = *begin + BLOCK < n ? *begin + BLOCK : n;
}

static double add_blocks(const double* sum, int nblock, int stride, int at) {
    double total = 0;
    for (int b = 0; b < nblock; ++b) total += sum[stride * b + at];
    return total;
}

static void relax(const Member* m, bool is_forward) {
    for (int k = 0; k < 8; ++k) {
        const int color = is_forward ? k : 7 - k, first = m->t->color_adr[color];
        const int num = m->t->color_adr[color + 1] - first;
        om__umesh_relax(m->t, m->w->is_still, m->w->F, m->r->u, first + part(m, num, m->rank),
                        first + part(m, num, m->rank + 1));
        om_team_barrier(m->team);
    }
}

static void find_drive(const Member* m) {
    const OmFemMesh* mesh = &m->t->grid->mesh;
    om__umesh_element_forces(m->t, m->w->F, m->w->force, MINE(m, mesh->nelem));
    om_team_barrier(m->team);
    om__umesh_node_forces(m->t, m->r->mask, m->w->force, m->w->drive, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
}

// z: what the organ at rest answers to the forces that drive it, while the patch stays; D its gradients.
static void find_answer(const Member* m) {
    UmeshRefineWork* w = m->w;
    const UmeshCoarse* c = w->with->coarse;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    const int ncoarse = om__umesh_coarse_size(c);
    om__umesh_coarse_restrict(c, w->drive, w->sum, MINE(m, ncoarse));
    om_team_barrier(m->team);
    om__umesh_coarse_multiply(c, w->sum, w->answer, MINE(m, ncoarse));
    om_team_barrier(m->team);
    om__umesh_coarse_prolong(c, w->answer, w->z, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
    if (m->rank == 0) om__umesh_patch_solve(m->r->patch, w->z, w->share);
    om_team_barrier(m->team);
    const int begin = part(m, mesh->nnode, m->rank), end = part(m, mesh->nnode, m->rank + 1);
    om__umesh_patch_add(m->r->patch, w->share, -1, w->z, 3 * begin, 3 * end);
    for (int i = begin; i < end; ++i)
        if (m->r->mask[i] || m->t->grid->fixed[i])
            memset(w->z + 3 * (size_t)i, 0, 3 * sizeof *w->z);
    om_team_barrier(m->team);
    om__umesh_gradients(m->t, w->z, 0, w->D, MINE(m, mesh->nelem));
    om_team_barrier(m->team);
}

// Shares of z and of the step before that take the energy to its minimum over both, to second order.
// @return what drives along the direction that comes of it, above 0; 0: no way down
static double choose_shares(const Member* m, bool has_before, double share[2]) {
    UmeshRefineWork* w = m->w;
    const UmeshWay way = {w->F, w->before, w->D, {0}};
    const OmFemMesh* mesh = &m->t->grid->mesh;
    int begin, end;
    for (int b = part(m, w->nelem_block, m->rank); b < part(m, w->nelem_block, m->rank + 1); ++b) {
        find_block(b, mesh->nelem, &begin, &end);
        om__umesh_curvature(&way, m->t->lambda, begin, end, w->curve + 3 * b);
    }
    for (int b = part(m, w->nnode_block, m->rank); b < part(m, w->nnode_block, m->rank + 1); ++b) {
        double by_z = 0, by_old = 0;
        find_block(b, mesh->nnode, &begin, &end);
        for (size_t i = 3 * (size_t)begin; i < 3 * (size_t)end; ++i) {
            by_z += (double)w->drive[i] * (double)w->z[i];
            by_old += (double)w->drive[i] * (double)(m->r->u[i] - w->old[i]);
        }
        w->dot[2 * b] = by_z, w->dot[2 * b + 1] = by_old;
    }
    om_team_barrier(m->team);
    double zz = add_blocks(w->curve, w->nelem_block, 3, 0);
    double zs = add_blocks(w->curve, w->nelem_block, 3, 1);
    double ss = add_blocks(w->curve, w->nelem_block, 3, 2);
    double z = add_blocks(w->dot, w->nnode_block, 2, 0);
    double s = add_blocks(w->dot, w->nnode_block, 2, 1);
    double det = zz * ss - zs * zs;
    share[0] = zz > 0 ? fmin(z / zz, 2) : 1;
    share[1] = 0;
    if (has_before && zz > 0 && ss > 0 && det > DEPENDENT * zz * ss) {
        double first = (z * ss - s * zs) / det, second = (s * zz - z * zs) / det;
        if (first * z + second * s > 0) share[0] = first, share[1] = second;
    }
    double drive = share[0] * z + share[1] * s;
    return isfinite(drive) && drive > 0 ? drive : 0;
}

// How much of the way can be gone.
static double choose_length(const Member* m, const UmeshWay* along, double drive) {
    UmeshRefineWork* w = m->w;
    const int nelem = m->t->grid->mesh.nelem;
    double length = 1;
    bool is_closed = false;
    for (int trial = 0; trial < MAX_TRIAL; ++trial) {
        double* slope = w->slope[trial % 2];  // two, for those that are still at the last sum
        for (int b = part(m, w->nelem_block, m->rank); b < part(m, w->nelem_block, m->rank + 1);
             ++b) {
            int begin, end;
            bool is_open;
            find_block(b, nelem, &begin, &end);
            slope[2 * b] =
                om__umesh_slope(along, m->t->lambda, (float)length, CRUSH, begin, end, &is_open);
            slope[2 * b + 1] = is_open ? 0 : 1;
        }
        om_team_barrier(m->team);
        double end_slope = add_blocks(slope, w->nelem_block, 2, 0);
        is_closed = add_blocks(slope, w->nelem_block, 2, 1) > 0;
        if (is_closed) {
            length *= 0.5;
            continue;
        }
        if (end_slope <= OVERSHOOT * drive) return length;
        length *= fmax(LEAST_CUT, drive / (drive + end_slope));
    }
    return is_closed ? 0 : length;
}

typedef struct Step {
    double length, answer;  // means over free nodes: of it, of what the organ at rest answered, m
    double fit;             // share of that answer that it took
    double way;             // share of what was wanted
} Step;

static Step make_step(const Member* m, bool has_before) {
    UmeshRefineWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    double share[2];
    const double drive = choose_shares(m, has_before, share);
    const UmeshWay along = {w->F, w->before, w->D, {(float)share[0], (float)share[1]}};
    const double way = drive > 0 ? choose_length(m, &along, drive) : 0;
    om_team_barrier(m->team);
    om__umesh_advance(&along, (float)way, MINE(m, mesh->nelem));
    for (int b = part(m, w->nnode_block, m->rank); b < part(m, w->nnode_block, m->rank + 1); ++b) {
        int begin, end;
        double length = 0, answer = 0;
        find_block(b, mesh->nnode, &begin, &end);
        for (int i = begin; i < end; ++i) {
            double square = 0, answer_square = 0;
            for (size_t k = 3 * (size_t)i; k < 3 * (size_t)i + 3; ++k) {
                float s = (float)way *
                          (along.share[0] * w->z[k] + along.share[1] * (m->r->u[k] - w->old[k]));
                w->old[k] = m->r->u[k];
                m->r->u[k] += s;
                square += (double)s * (double)s;
                answer_square += (double)w->z[k] * (double)w->z[k];
            }
            length += sqrt(square);
            answer += sqrt(answer_square);
        }
        w->dot[2 * b] = length, w->dot[2 * b + 1] = answer;
    }
    om_team_barrier(m->team);
    return (Step){add_blocks(w->dot, w->nnode_block, 2, 0) / m->r->nfree,
                  add_blocks(w->dot, w->nnode_block, 2, 1) / m->r->nfree, way * share[0], way};
}

// What the cycles to come will move: a geometric series, and what a step that was cut did not go. Where tissue is stiff
// steps are short while much is left; there the answer of the organ at rest, which is too long, tells.
static double estimate(Step step, Step last, bool is_first, double* floor_rate) {
    if (is_first) *floor_rate = step.fit > 1 - DOUBTFUL_RATE ? LEAST_RATE : DOUBTFUL_RATE;
    double rate = is_first ? 1 - step.fit : last.length > 0 ? step.length / last.length : 1;
    rate = fmin(fmax(rate, *floor_rate), MOST_RATE);
    double series = step.length * rate / (1 - rate);
    double cut = step.way > 0 ? step.length * (1 - step.way) / step.way : step.answer;
    return fmax(series + cut, SOFTNESS * step.answer);
}

static void begin(const Member* m) {
    UmeshRefineWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    const size_t first = (size_t)part(m, mesh->nelem, m->rank);
    const size_t num = (size_t)part(m, mesh->nelem, m->rank + 1) - first;
    om__umesh_gradients(m->t, m->r->u, 1, w->F, MINE(m, mesh->nelem));
    memcpy(w->before + REFINE_F * first, w->F + REFINE_F * first, REFINE_F * num * sizeof *w->F);
    if (m->rank == 0) memcpy(w->old, m->r->u, 3 * (size_t)mesh->nnode * sizeof *w->old);
    om_team_barrier(m->team);
}

// Which nodes are relaxed.
static void find_still(const Member* m) {
    UmeshRefineWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    om__umesh_find_strained(w->F, m->r->tolerance < FINE ? 0 : STRAINED, w->is_strained,
                            MINE(m, mesh->nelem));
    om_team_barrier(m->team);
    om__umesh_find_still(m->t, m->r->mask, w->is_strained, w->is_still, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
}

static void refine(void* ctx, OmTeam* team, int rank, int size) {
    const Refining* r = ctx;
    const Member member = {r, &r->work->with->elements, r->work, team, rank, size}, *m = &member;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    double left = 0, floor_rate = LEAST_RATE;
    Step last = {0};
    int cycle = 0;
    begin(m);
    while (cycle < r->max_cycle) {
        find_still(m);
        relax(m, true);
        find_drive(m);
        find_answer(m);
        Step step = make_step(m, cycle > 0);
        left = estimate(step, last, cycle == 0, &floor_rate);
        ++cycle;
        if (!(left >= r->tolerance)) break;
        last = step;
        relax(m, false);
    }
    om_team_barrier(team);
    m->w->dot[rank] = (double)om__umesh_least_volume(m->w->F, MINE(m, mesh->nelem));
    om_team_barrier(team);
    if (rank > 0) return;
    *r->report = (OmUmeshRefinement){cycle, left, INFINITY};
    for (int k = 0; k < size; ++k)
        r->report->min_volume = fmin(r->report->min_volume, m->w->dot[k]);
}

OmStatus om__umesh_refine(UmeshRefineWork* w, const UmeshPatchSystem* patch,
                          const unsigned char* mask, double tolerance, int max_cycle, int nworker,
                          float* u, OmUmeshRefinement* report) {
    const OmUmeshGrid* g = w->with->elements.grid;
    *report = (OmUmeshRefinement){0};
    if (patch->num > w->nshare || !w->share) {
        om_free(w->share);
        w->nshare = 0;
        OM_ALLOC(w->share, patch->num ? patch->num : 1);
        w->nshare = patch->num;
    }
    Refining r = {.work = w,
                  .patch = patch,
                  .mask = mask,
                  .u = u,
                  .tolerance = tolerance,
                  .max_cycle = max_cycle,
                  .report = report};
    for (int i = 0; i < g->mesh.nnode; ++i) r.nfree += !g->fixed[i];
    if (r.nfree > 0 && max_cycle > 0) om_parallel_team(nworker, refine, &r);
    return OM_OK;
}

// ---- is it the samples' law? -------------------------------------------------------------------------

static double force_norm(const UmeshElements* t, const unsigned char* mask, const float* u,
                         float* F, float* force, float* drive) {
    const OmFemMesh* mesh = &t->grid->mesh;
    double sum = 0;
    om__umesh_gradients(t, u, 1, F, 0, mesh->nelem);
    om__umesh_element_forces(t, F, force, 0, mesh->nelem);
    om__umesh_node_forces(t, mask, force, drive, 0, mesh->nnode);
    for (size_t i = 0; i < 3 * (size_t)mesh->nnode; ++i) sum += (double)drive[i] * (double)drive[i];
    return sqrt(sum);
}

OmStatus om__umesh_measure_balance(const OmUmeshData* data, double poisson, const float* linear,
                                   int first, int n, double* balance) {
    const OmFemMesh* mesh = &data->grid.mesh;
    size_t nnode = (size_t)mesh->nnode;
    UmeshElements t = {0};
    float *F = NULL, *force = NULL, *drive = NULL;
    double* ratio = NULL;
    int num = 0;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om__umesh_elements_init(&data->grid, poisson, &t));
    OM_ALLOC_DONE(F, REFINE_F * (size_t)mesh->nelem);
    OM_ALLOC_DONE(force, 24 * (size_t)mesh->nelem);
    OM_ALLOC_DONE(drive, 3 * nnode);
    OM_ALLOC_DONE(ratio, n);
    for (int s = first; s < first + n; ++s) {
        const unsigned char* mask = data->mask + (size_t)s * nnode;
        const size_t at = 3 * (size_t)s * nnode;
        double left = force_norm(&t, mask, data->u + at, F, force, drive);
        double all = force_norm(&t, mask, linear + at, F, force, drive);
        if (all > 0) ratio[num++] = left / all;
    }
    om_sort_doubles(ratio, num);
    *balance = num > 0 ? ratio[num / 2] : 0;
done:
    om__umesh_elements_done(&t);
    om_free(F);
    om_free(force);
    om_free(drive);
    om_free(ratio);
    return status;
}
