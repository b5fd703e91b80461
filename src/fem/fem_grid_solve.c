// fem_grid_solve.c: from a guess to equilibrium of large deformations.
//
// A cycle has two parts:
//
//     relax     the nodes of strained elements, one by one (fem_grid_element.c): removes local errors and restores
//               inverted elements; forwards at the begin of a cycle, backwards at its end
//     correct   the remaining residual is smooth; the compliance at rest on a grid of twice the spacing, with the
//               patch's nodes fixed (fem_grid_coarse.c, fem_grid_linear.c), gives a direction z
//
// Tissue near a deep press is stiffer than at rest, so z is too long. The step is the minimum of the energy, to second
// order, over z and the previous step, as in the method of conjugate gradients. It is shortened where it would crush an
// element or pass the minimum along its direction. The distance to equilibrium is estimated from the displacements of
// the last cycle; cycles end when the estimate is below the tolerance.
//
// Rejected (doc/notes/fem.md): corrections without relaxation (inverted elements make the steps useless); the full
// compliance instead of the coarse one (hardly fewer cycles, each several times as long); one direction with a line
// search (three times the cycles); scaling the compliance by the stiffness of the nodes (no fewer cycles); the guess in
// four load steps (half as many samples with another equilibrium, twice the time of hard ones).
//
// One team of workers computes a whole solve, with barriers between the stages. Sums are over fixed blocks, so the
// result has the same bytes for any number of workers.
#include <math.h>
#include <string.h>

#include "fem/fem_grid_internal.h"

#define BLOCK 64     // elements or nodes in one sum
#define MAX_TRIAL 8  // trial lengths of a step
#define CRUSH 0.4f   // smallest ratio of det F after a step to det F before
#define OVERSHOOT \
    0.5  // largest slope of the energy at the end of a step, over minus that at its begin
#define MIN_CUT 0.1         // smallest factor by which a trial shortens the step
#define MIN_RATE 0.3        // bounds of the estimated convergence rate
#define MAX_RATE 0.9        //
#define DOUBTFUL_RATE 0.75  // lower bound if the first step was far from the coarse correction
#define STRAINED 0.2f  // root mean square of |F - I| from which the nodes of an element are relaxed
// Below this tolerance (m) every node is relaxed, not only those near strained elements: the
// network's local error elsewhere is 0.01 mm.
#define FINE 2e-5
#define SOFTNESS 0.4    // fraction of the coarse correction that counts as error
#define DEPENDENT 1e-6  // squared sine of the angle below which two directions count as one

struct OmFemGridModel {
    GridElements elements;
    GridCoarse* coarse;
};

struct OmFemGridWork {
    const OmFemGridModel* with;
    int nelem_block, nnode_block;
    float *F, *before, *D;      //                                    (nelem x GRID_F)
    float* force;               //                                          (nelem x 24)
    float *residual, *z, *old;  // forces, correction, previous u           (nnode x 3)
    unsigned char *is_strained, *is_skipped;  //                             (nelem), (nnode)
    float *sum, *answer;                      //                                (coarse nodes x 3)
    double *curve, *slope[2], *dot;           // sums over blocks: (3, 2 and 2 a block)
    double* scale;  // of the patch's columns                      (nscale)
    int nscale;
};

OmStatus om_fem_grid_model_create(const OmFemGrid* g, double poisson, int nworker,
                                  OmFemGridModel** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    OmFemGridModel* r = om_calloc(1, sizeof *r);
    if (!r) return OM_NO_MEMORY;
    OM_TRY_DONE(om__grid_elements_init(g, poisson, &r->elements));
    OM_TRY_DONE(om__grid_coarse_create(&r->elements, nworker, &r->coarse));
done:
    if (status < 0)
        om_fem_grid_model_destroy(r);
    else
        *out = r;
    return status;
}

void om_fem_grid_model_destroy(OmFemGridModel* r) {
    if (!r) return;
    om__grid_elements_done(&r->elements);
    om__grid_coarse_destroy(r->coarse);
    om_free(r);
}

OmStatus om_fem_grid_work_create(const OmFemGridModel* r, OmFemGridWork** out) {
    *out = NULL;
    const OmFemMesh* mesh = &r->elements.grid->mesh;
    size_t nelem = (size_t)mesh->nelem, nnode = (size_t)mesh->nnode;
    size_t ncoarse = (size_t)om__grid_coarse_size(r->coarse);
    OmStatus status = OM_OK;
    OmFemGridWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    w->with = r;
    w->nelem_block = om_block_count(mesh->nelem, BLOCK);
    w->nnode_block = om_block_count(mesh->nnode, BLOCK);
    float** gradient[] = {&w->F, &w->before, &w->D};
    float** nodal[] = {&w->residual, &w->z, &w->old};
    for (int k = 0; k < 3; ++k) {
        OM_ALLOC_DONE(*gradient[k], GRID_F * nelem);
        OM_ALLOC_DONE(*nodal[k], 3 * nnode);
    }
    OM_ALLOC_DONE(w->force, 24 * nelem);
    OM_ALLOC_DONE(w->is_strained, nelem);
    OM_ALLOC_DONE(w->is_skipped, nnode);
    OM_ALLOC_DONE(w->sum, 3 * ncoarse);
    OM_ALLOC_DONE(w->answer, 3 * ncoarse);
    OM_ALLOC_DONE(w->curve, 3 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->slope[0], 2 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->slope[1], 2 * (size_t)w->nelem_block);
    OM_ALLOC_DONE(w->dot, 2 * (size_t)w->nnode_block + OM_MAX_WORKER);
done:
    if (status < 0)
        om_fem_grid_work_destroy(w);
    else
        *out = w;
    return status;
}

void om_fem_grid_work_destroy(OmFemGridWork* w) {
    if (!w) return;
    float* array[] = {w->F,   w->before, w->D,   w->residual, w->z,
                      w->old, w->force,  w->sum, w->answer};
    double* sums[] = {w->curve, w->slope[0], w->slope[1], w->dot, w->scale};
    for (size_t k = 0; k < sizeof array / sizeof *array; ++k) om_free(array[k]);
    for (size_t k = 0; k < sizeof sums / sizeof *sums; ++k) om_free(sums[k]);
    om_free(w->is_strained);
    om_free(w->is_skipped);
    om_free(w);
}

size_t om_fem_grid_work_memory(const OmFemGridWork* w) {
    const OmFemMesh* mesh = &w->with->elements.grid->mesh;
    size_t ncoarse = (size_t)om__grid_coarse_size(w->with->coarse);
    return sizeof *w +
           ((3 * GRID_F + 24) * (size_t)mesh->nelem + 9 * (size_t)mesh->nnode + 6 * ncoarse) *
               sizeof(float) +
           (size_t)mesh->nelem + (size_t)mesh->nnode +
           (7 * (size_t)w->nelem_block + 2 * (size_t)w->nnode_block + OM_MAX_WORKER +
            (size_t)w->nscale) *
               sizeof(double);
}

// ---- the team -----------------------------------------------------------------------------------------

typedef struct Solve {  // shared by all members of the team
    OmFemGridWork* work;
    const OmFemGridPatch* patch;
    const unsigned char* mask;
    float* u;
    int nfree;  // nodes that are not fixed
    double tolerance;
    int max_cycle;
    OmFemGridReport* report;
} Solve;

typedef struct Member {
    const Solve* r;
    const GridElements* t;
    OmFemGridWork* w;
    OmTeam* team;
    int rank, size;
} Member;

// The first of n items of a member. Sums are divided by blocks.
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
        om__grid_relax(m->t, m->w->is_skipped, m->w->F, m->r->u, first + part(m, num, m->rank),
                       first + part(m, num, m->rank + 1));
        om_team_barrier(m->team);
    }
}

static void find_residual(const Member* m) {
    const OmFemMesh* mesh = &m->t->grid->mesh;
    om__grid_element_forces(m->t, m->w->F, m->w->force, MINE(m, mesh->nelem));
    om_team_barrier(m->team);
    om__grid_node_forces(m->t, m->r->mask, m->w->force, m->w->residual, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
}

// z: the displacement of the body at rest under the residual forces, with the patch fixed; D its gradients.
static void find_correction(const Member* m) {
    OmFemGridWork* w = m->w;
    const GridCoarse* c = w->with->coarse;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    const int ncoarse = om__grid_coarse_size(c);
    om__grid_coarse_restrict(c, w->residual, w->sum, MINE(m, ncoarse));
    om_team_barrier(m->team);
    om__grid_coarse_multiply(c, w->sum, w->answer, MINE(m, ncoarse));
    om_team_barrier(m->team);
    om__grid_coarse_prolong(c, w->answer, w->z, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
    if (m->rank == 0) om__grid_patch_solve(m->r->patch, w->z, w->scale);
    om_team_barrier(m->team);
    const int begin = part(m, mesh->nnode, m->rank), end = part(m, mesh->nnode, m->rank + 1);
    om__grid_patch_add(m->r->patch, w->scale, -1, w->z, 3 * begin, 3 * end);
    for (int i = begin; i < end; ++i)
        if (m->r->mask[i] || m->t->grid->fixed[i])
            memset(w->z + 3 * (size_t)i, 0, 3 * sizeof *w->z);
    om_team_barrier(m->team);
    om__grid_gradients(m->t, w->z, 0, w->D, MINE(m, mesh->nelem));
    om_team_barrier(m->team);
}

// Scales of z and of the previous step at the minimum of the energy over both, to second order.
// @return minus the slope of the energy along the resulting direction, above 0; 0: it is not a descent direction
static double choose_scales(const Member* m, bool has_before, double scale[2]) {
    OmFemGridWork* w = m->w;
    const GridDirection direction = {w->F, w->before, w->D, {0}};
    const OmFemMesh* mesh = &m->t->grid->mesh;
    int begin, end;
    for (int b = part(m, w->nelem_block, m->rank); b < part(m, w->nelem_block, m->rank + 1); ++b) {
        find_block(b, mesh->nelem, &begin, &end);
        om__grid_curvature(&direction, m->t->lambda, begin, end, w->curve + 3 * b);
    }
    for (int b = part(m, w->nnode_block, m->rank); b < part(m, w->nnode_block, m->rank + 1); ++b) {
        double by_z = 0, by_old = 0;
        find_block(b, mesh->nnode, &begin, &end);
        for (size_t i = 3 * (size_t)begin; i < 3 * (size_t)end; ++i) {
            by_z += (double)w->residual[i] * (double)w->z[i];
            by_old += (double)w->residual[i] * (double)(m->r->u[i] - w->old[i]);
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
    scale[0] = zz > 0 ? fmin(z / zz, 2) : 1;
    scale[1] = 0;
    if (has_before && zz > 0 && ss > 0 && det > DEPENDENT * zz * ss) {
        double first = (z * ss - s * zs) / det, second = (s * zz - z * zs) / det;
        if (first * z + second * s > 0) scale[0] = first, scale[1] = second;
    }
    double descent = scale[0] * z + scale[1] * s;
    return isfinite(descent) && descent > 0 ? descent : 0;
}

// The fraction of the step that neither crushes an element nor passes the minimum; 0: none was found.
static double choose_length(const Member* m, const GridDirection* along, double descent) {
    OmFemGridWork* w = m->w;
    const int nelem = m->t->grid->mesh.nelem;
    double length = 1;
    bool is_crushed = false;
    for (int trial = 0; trial < MAX_TRIAL; ++trial) {
        double* slope = w->slope[trial % 2];  // two: other members may still read the last sum
        for (int b = part(m, w->nelem_block, m->rank); b < part(m, w->nelem_block, m->rank + 1);
             ++b) {
            int begin, end;
            bool is_valid;
            find_block(b, nelem, &begin, &end);
            slope[2 * b] =
                om__grid_slope(along, m->t->lambda, (float)length, CRUSH, begin, end, &is_valid);
            slope[2 * b + 1] = is_valid ? 0 : 1;
        }
        om_team_barrier(m->team);
        double end_slope = add_blocks(slope, w->nelem_block, 2, 0);
        is_crushed = add_blocks(slope, w->nelem_block, 2, 1) > 0;
        if (is_crushed) {
            length *= 0.5;
            continue;
        }
        if (end_slope <= OVERSHOOT * descent) return length;
        length *= fmax(MIN_CUT, descent / (descent + end_slope));
    }
    return is_crushed ? 0 : length;
}

typedef struct Step {
    double length, correction;  // means over free nodes: of the step, of z, m
    double fit;                 // scale of z in the step
    double fraction;            // length of the step over that of the minimum
} Step;

static Step make_step(const Member* m, bool has_before) {
    OmFemGridWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    double scale[2];
    const double descent = choose_scales(m, has_before, scale);
    const GridDirection along = {w->F, w->before, w->D, {(float)scale[0], (float)scale[1]}};
    const double fraction = descent > 0 ? choose_length(m, &along, descent) : 0;
    om_team_barrier(m->team);
    om__grid_advance(&along, (float)fraction, MINE(m, mesh->nelem));
    for (int b = part(m, w->nnode_block, m->rank); b < part(m, w->nnode_block, m->rank + 1); ++b) {
        int begin, end;
        double length = 0, correction = 0;
        find_block(b, mesh->nnode, &begin, &end);
        for (int i = begin; i < end; ++i) {
            double square = 0, correction_square = 0;
            for (size_t k = 3 * (size_t)i; k < 3 * (size_t)i + 3; ++k) {
                float s = (float)fraction *
                          (along.scale[0] * w->z[k] + along.scale[1] * (m->r->u[k] - w->old[k]));
                w->old[k] = m->r->u[k];
                m->r->u[k] += s;
                square += (double)s * (double)s;
                correction_square += (double)w->z[k] * (double)w->z[k];
            }
            length += sqrt(square);
            correction += sqrt(correction_square);
        }
        w->dot[2 * b] = length, w->dot[2 * b + 1] = correction;
    }
    om_team_barrier(m->team);
    return (Step){add_blocks(w->dot, w->nnode_block, 2, 0) / m->r->nfree,
                  add_blocks(w->dot, w->nnode_block, 2, 1) / m->r->nfree, fraction * scale[0],
                  fraction};
}

// Estimated distance to equilibrium: the sum of a geometric series of further steps, and the rest of a shortened step.
// Steps in stiff tissue are short although equilibrium is far; a fraction of the coarse correction is a lower bound
// there.
static double estimate(Step step, Step last, bool is_first, double* floor_rate) {
    if (is_first) *floor_rate = step.fit > 1 - DOUBTFUL_RATE ? MIN_RATE : DOUBTFUL_RATE;
    double rate = is_first ? 1 - step.fit : last.length > 0 ? step.length / last.length : 1;
    rate = fmin(fmax(rate, *floor_rate), MAX_RATE);
    double series = step.length * rate / (1 - rate);
    double cut =
        step.fraction > 0 ? step.length * (1 - step.fraction) / step.fraction : step.correction;
    return fmax(series + cut, SOFTNESS * step.correction);
}

static void begin(const Member* m) {
    OmFemGridWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    const size_t first = (size_t)part(m, mesh->nelem, m->rank);
    const size_t num = (size_t)part(m, mesh->nelem, m->rank + 1) - first;
    om__grid_gradients(m->t, m->r->u, 1, w->F, MINE(m, mesh->nelem));
    memcpy(w->before + GRID_F * first, w->F + GRID_F * first, GRID_F * num * sizeof *w->F);
    if (m->rank == 0) memcpy(w->old, m->r->u, 3 * (size_t)mesh->nnode * sizeof *w->old);
    om_team_barrier(m->team);
}

// Choose the nodes to relax.
static void find_skipped(const Member* m) {
    OmFemGridWork* w = m->w;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    om__grid_find_strained(w->F, m->r->tolerance < FINE ? 0 : STRAINED, w->is_strained,
                           MINE(m, mesh->nelem));
    om_team_barrier(m->team);
    om__grid_find_skipped(m->t, m->r->mask, w->is_strained, w->is_skipped, MINE(m, mesh->nnode));
    om_team_barrier(m->team);
}

static void solve(void* ctx, OmTeam* team, int rank, int size) {
    const Solve* r = ctx;
    const Member member = {r, &r->work->with->elements, r->work, team, rank, size}, *m = &member;
    const OmFemMesh* mesh = &m->t->grid->mesh;
    double left = 0, floor_rate = MIN_RATE;
    Step last = {0};
    int cycle = 0;
    begin(m);
    while (cycle < r->max_cycle) {
        find_skipped(m);
        relax(m, true);
        find_residual(m);
        find_correction(m);
        Step step = make_step(m, cycle > 0);
        left = estimate(step, last, cycle == 0, &floor_rate);
        ++cycle;
        if (!(left >= r->tolerance)) break;
        last = step;
        relax(m, false);
    }
    om_team_barrier(team);
    m->w->dot[rank] = (double)om__grid_min_volume(m->w->F, MINE(m, mesh->nelem));
    om_team_barrier(team);
    if (rank > 0) return;
    *r->report = (OmFemGridReport){cycle, left, INFINITY};
    for (int k = 0; k < size; ++k)
        r->report->min_volume = fmin(r->report->min_volume, m->w->dot[k]);
}

OmStatus om_fem_grid_solve(OmFemGridWork* w, const OmFemGridPatch* patch, const unsigned char* mask,
                           const OmFemGridStop* stop, float* u, OmFemGridReport* report) {
    const OmFemGrid* g = w->with->elements.grid;
    *report = (OmFemGridReport){0};
    if (patch->num > w->nscale || !w->scale) {
        om_free(w->scale);
        w->nscale = 0;
        OM_ALLOC(w->scale, patch->num ? patch->num : 1);
        w->nscale = patch->num;
    }
    Solve r = {.work = w,
               .patch = patch,
               .mask = mask,
               .u = u,
               .tolerance = stop->tolerance,
               .max_cycle = stop->max_cycle,
               .report = report};
    for (int i = 0; i < g->mesh.nnode; ++i) r.nfree += !g->fixed[i];
    if (r.nfree > 0 && stop->max_cycle > 0) om_parallel_team(stop->nworker, solve, &r);
    return OM_OK;
}

// ---- the residual of given displacements ---------------------------------------------------------------

static double force_norm(const GridElements* t, const unsigned char* mask, const float* u, float* F,
                         float* force, float* residual) {
    const OmFemMesh* mesh = &t->grid->mesh;
    double sum = 0;
    om__grid_gradients(t, u, 1, F, 0, mesh->nelem);
    om__grid_element_forces(t, F, force, 0, mesh->nelem);
    om__grid_node_forces(t, mask, force, residual, 0, mesh->nnode);
    for (size_t i = 0; i < 3 * (size_t)mesh->nnode; ++i)
        sum += (double)residual[i] * (double)residual[i];
    return sqrt(sum);
}

OmStatus om_fem_grid_eval_residual(const OmFemGrid* grid, double poisson, int n,
                                   const unsigned char* mask, const float* u, double* norm) {
    const size_t nnode = (size_t)grid->mesh.nnode;
    GridElements t = {0};
    float *F = NULL, *force = NULL, *residual = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om__grid_elements_init(grid, poisson, &t));
    OM_ALLOC_DONE(F, GRID_F * (size_t)grid->mesh.nelem);
    OM_ALLOC_DONE(force, 24 * (size_t)grid->mesh.nelem);
    OM_ALLOC_DONE(residual, 3 * nnode);
    for (size_t s = 0; s < (size_t)n; ++s)
        norm[s] = force_norm(&t, mask + s * nnode, u + 3 * s * nnode, F, force, residual);
done:
    om__grid_elements_done(&t);
    om_free(F);
    om_free(force);
    om_free(residual);
    return status;
}
