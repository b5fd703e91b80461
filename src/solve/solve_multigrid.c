// solve_multigrid.c: the V-cycle: levels, refresh, application.
//
// Smoother: two steps of Chebyshev iteration on D^-1 A (D: diagonal blocks) before and after the coarse
// correction, with the same polynomial, so the cycle is symmetric and can precondition CG. No eigenvalue is
// estimated: for tetrahedra D^-1 A has no eigenvalue above 4 (A is a sum of element matrices, each at most 4
// times its own block diagonal), and for coarse matrices the largest observed one was below 5. An
// overestimate costs an iteration; constants that do not depend on earlier solves keep a solve a function of
// its inputs.
//
// Tried on the lift beams, iterations to 1e-3 x products with A: one step 17 x 3, two steps 10 x 5, three
// steps 8 x 7, additive levels 45 x 1 (with 45 visits to the coarse levels): two steps are quickest.
//
// Rejected: coarse levels refreshed in every eighth step only. The same iterations, and a step 1.16 times (19x6x6
// beam) and 1.18 times (15x15x1 slab) as fast, but a step is then no function of its state: the state would have to
// hold the positions of the last refresh, and every restored snapshot would assemble a second matrix.
#include <math.h>
#include <string.h>

#include "solve/solve_multigrid.h"

#define DENSE_VERTS 40     // a level this small is solved directly
#define COARSE_BOUND 5.0   // largest eigenvalue of D^-1 A that is smoothed on coarse levels
#define SWEEP_ROWS 128     // rows of one piece of a sweep
#define SMOOTH_RATIO 10.0  // smoothed eigenvalues: bound / ratio .. bound

// ---- create -----------------------------------------------------------------------------------------

static void set_chebyshev(OmLevel* L, double bound) {
    double theta = 0.5 * (bound + bound / SMOOTH_RATIO),
           delta = 0.5 * (bound - bound / SMOOTH_RATIO);
    double rho0 = delta / theta, rho1 = 1.0 / (2.0 * theta / delta - rho0);
    L->theta = (float)theta;
    L->c1 = (float)(rho1 * rho0);
    L->c2 = (float)(2.0 * rho1 / delta);
}

// Mean distance of neighbours: the cell size that the first grid doubles.
static double mean_edge(const OmBsr* A, const double* x) {
    double sum = 0;
    int num = 0;
    for (int i = 0; i < A->nvert; ++i)
        for (int k = A->row_adr[i] + 1; k < A->row_adr[i + 1]; ++k, ++num)
            sum += om_distance(om_load3(x, i), om_load3(x, A->col[k]));
    return num > 0 ? sum / num : 0.0;
}

static OmStatus take_level_vectors(OmLevel* L, bool is_fine, int width, size_t* memory) {
    size_t n = (size_t)width * (size_t)L->nvert;
    float** vector[] = {&L->r, &L->d, &L->e, &L->b, &L->x};
    int num = is_fine ? 3 : 5;
    for (int k = 0; k < num; ++k)
        if (!(*vector[k] = om_calloc(n, sizeof(float)))) return OM_NO_MEMORY;
    *memory += (size_t)num * n * sizeof(float);
    if (is_fine) return OM_OK;
    *memory += 9 * (size_t)L->nvert * sizeof(float);
    L->dinv = om_calloc(9 * (size_t)L->nvert + 3, sizeof(float));
    return L->dinv ? OM_OK : OM_NO_MEMORY;
}

OmStatus om__multigrid_create(const OmBsr* A, const double* x_rest, int nworker, int width,
                              double bound, OmMultigrid** out, size_t* memory) {
    *out = NULL;
    OmStatus status = OM_OK;
    double *x = NULL, *node = NULL;
    OmMultigrid* mg = om_calloc(1, sizeof *mg);
    if (!mg) return OM_NO_MEMORY;
    // edges of a box of cubes are 1.26 cells long on average
    double h = mean_edge(A, x_rest) / 1.2;
    mg->level[0].nvert = A->nvert;
    for (mg->nlevel = 1; mg->nlevel < OM_MG_MAX_LEVEL; ++mg->nlevel) {
        OmLevel *fine = &mg->level[mg->nlevel - 1], *coarse = fine + 1;
        if (mg->nlevel > 1 && fine->nvert <= DENSE_VERTS) break;
        h *= 2;
        OM_TRY_DONE(om__grid_interpolate(fine->nvert, x ? x : x_rest, h, &fine->P, &node, memory));
        om_free(x);
        x = node;
        node = NULL;
        coarse->nvert = fine->P.ncoarse;
        OM_TRY_DONE(om__galerkin_create(mg->nlevel == 1 ? A : &fine->A, &fine->P, nworker, &fine->G,
                                        &coarse->A, memory));
        set_chebyshev(fine, mg->nlevel == 1 ? bound : COARSE_BOUND);
        OM_TRY_DONE(take_level_vectors(fine, mg->nlevel == 1, width, memory));
    }
    OmLevel* last = &mg->level[mg->nlevel - 1];
    int max = 0;
    for (int l = 1; l < mg->nlevel; ++l)
        max = mg->level[l].A.nblock > max ? mg->level[l].A.nblock : max;
    OM_ALLOC_DONE(mg->wide, 12 * (size_t)max);
    *memory += 48 * (size_t)max;
    OM_TRY_DONE(take_level_vectors(last, false, width, memory));
    OM_TRY_DONE(om__dense_create(3 * last->nvert, width / 3, &mg->dense, memory));
    *out = mg;
done:
    om_free(x);
    om_free(node);
    if (status < 0) {
        if (mg->nlevel < OM_MG_MAX_LEVEL) ++mg->nlevel;  // the level that failed
        om__multigrid_destroy(mg);
    }
    return status;
}

void om__multigrid_destroy(OmMultigrid* mg) {
    if (!mg) return;
    for (int l = 0; l < mg->nlevel; ++l) {
        OmLevel* L = &mg->level[l];
        om_bsr_destroy(&L->A);
        om_ties_destroy(L->ties);
        om__interp_done(&L->P);
        om__galerkin_done(&L->G);
        float* vector[] = {L->dinv, L->b, L->x, L->r, L->d, L->e};
        for (int k = 0; k < 6; ++k) om_free(vector[k]);
    }
    om__dense_done(&mg->dense);
    om_free(mg->wide);
    om_free(mg);
}

void om__multigrid_set_fixed(OmMultigrid* mg, const unsigned char* fixed) {
    om__interp_mask(&mg->level[0].P, fixed);
}

// ---- refresh ----------------------------------------------------------------------------------------

typedef struct MgRefresh {
    OmMultigrid* mg;
    const OmBsr* A;
} MgRefresh;

// Inverse diagonal blocks; directions without stiffness are left out.
static void invert_coarse(OmLevel* L, int begin, int end) {
    for (int i = begin; i < end; ++i) {
        const float* v = L->A.value + 9 * (size_t)L->A.row_adr[i];
        const float* tie = L->A.ties ? om__ties_diagonal(L->A.ties, i) : NULL;
        float both[9];
        for (int c = 0; c < 9 && tie; ++c) both[c] = v[c] + tie[c];
        if (tie) v = both;
        float max = fmaxf(v[0], fmaxf(v[4], v[8]));
        unsigned char loose[3];
        for (int c = 0; c < 3; ++c) loose[c] = !(v[4 * c] > 1e-6f * max);
        float* out = L->dinv + 9 * (size_t)i;
        if (!om__invert_block(v, loose, out)) memset(out, 0, 9 * sizeof(float));
    }
}

static void refresh_member(void* ctx, OmTeam* team, int rank, int size) {
    const MgRefresh* f = ctx;
    OmMultigrid* mg = f->mg;
    for (int l = 0; l + 1 < mg->nlevel; ++l) {
        OmLevel *fine = &mg->level[l], *coarse = fine + 1;
        const OmBsr* A = l == 0 ? f->A : &fine->A;
        float* scratch = fine->G.scratch + (size_t)rank * (size_t)fine->G.max_ap * 12;
        int begin = (int)((int64_t)coarse->A.nblock * rank / size),
            end = (int)((int64_t)coarse->A.nblock * (rank + 1) / size);
        memset(mg->wide + 12 * (size_t)begin, 0, 12 * (size_t)(end - begin) * sizeof(float));
        for (int parity = 0; parity < 2; ++parity) {
            om_team_barrier(team);
            for (int layer = parity + 2 * rank; layer < fine->P.nlayer; layer += 2 * size)
                om__galerkin_layer(A, &fine->P, &fine->G, layer, scratch, &coarse->A, mg->wide);
        }
        om_team_barrier(team);
        om__galerkin_pack(mg->wide, &coarse->A, begin, end);
        om_team_barrier(team);
        invert_coarse(coarse, (int)((int64_t)coarse->nvert * rank / size),
                      (int)((int64_t)coarse->nvert * (rank + 1) / size));
    }
    if (rank == 0) om__dense_refresh(&mg->dense, &mg->level[mg->nlevel - 1].A);
}

// The ties of the coarse levels from those of A.
static OmStatus coarsen_ties(OmMultigrid* mg, const OmBsr* A) {
    const OmTies* fine = A->ties;
    for (int l = 1; l < mg->nlevel; ++l) {
        OmLevel* L = &mg->level[l];
        L->A.ties = NULL;
        if (!fine) continue;
        if (!L->ties) OM_TRY(om_ties_create(L->nvert, &L->ties));
        OM_TRY(om__ties_coarsen(fine, &mg->level[l - 1].P, L->ties));
        OM_TRY(om__ties_sum(L->ties, COARSE_BOUND));
        fine = L->A.ties = L->ties;
    }
    return OM_OK;
}

OmStatus om__multigrid_refresh(OmMultigrid* mg, const OmBsr* A, int nworker) {
    OM_TRY(coarsen_ties(mg, A));
    MgRefresh f = {mg, A};
    om_parallel_team(nworker, refresh_member, &f);
    return OM_OK;
}

// ---- V-cycle ----------------------------------------------------------------------------------------

typedef struct Rows {  // the rows of a member on one level
    const OmBsr* A;
    const float* dinv;
    const float* b;
    float* x;
    int begin, end;
} Rows;

static Rows rows_of(const OmSolver* S, const OmBsr* A, const OmRank* who, int l) {
    const OmLevel* L = &S->multigrid->level[l];
    if (l == 0) return (Rows){A, S->dinv, S->r, S->u, who->begin, who->end};
    return (Rows){&L->A,
                  L->dinv,
                  L->b,
                  L->x,
                  (int)((int64_t)L->nvert * who->rank / who->size),
                  (int)((int64_t)L->nvert * (who->rank + 1) / who->size)};
}

// One smoothing step over the rows of a member, forward and backward in turn: rows that the last sweep left
// in the caches are used first (fine matrices do not fit).
static void sweep(const OmKernels* K, const Rows* w, const OmSmooth* s, OmRank* who) {
    int num = om_block_count(w->end - w->begin, SWEEP_ROWS);
    for (int k = 0; k < num; ++k) {
        int begin = w->begin + SWEEP_ROWS * (who->is_backward ? num - 1 - k : k);
        int end = begin + SWEEP_ROWS < w->end ? begin + SWEEP_ROWS : w->end;
        K->smooth(w->A, w->dinv, s, begin, end);
        if (w->A->ties) om__ties_smooth(w->A->ties, K, w->dinv, s, begin, end);
    }
    who->is_backward = !who->is_backward;
}

// Two Chebyshev steps from zero and the residual after them.
static void smooth_down(const OmKernels* K, const OmLevel* L, const Rows* w, OmRank* who) {
    OmSmooth s = {.r = w->b, .r_out = L->r, .d_out = L->d, .x = w->x, .c2 = 1.0f / L->theta};
    K->smooth_first(w->dinv, &s, w->begin, w->end);
    om_team_barrier(who->team);
    s.d = L->d;
    s.d_out = L->e;
    s.c1 = L->c1;
    s.c2 = L->c2;
    sweep(K, w, &s, who);
    om_team_barrier(who->team);
    s.r = L->r;
    s.d = L->e;
    s.d_out = NULL;
    sweep(K, w, &s, who);
    om_team_barrier(who->team);
}

// Two Chebyshev steps after a correction d, which is already in x but not in the residual.
static void smooth_up(const OmKernels* K, const OmLevel* L, const Rows* w, OmRank* who) {
    OmSmooth s = {
        .r = L->r, .r_out = L->r, .d = L->d, .d_out = L->e, .x = w->x, .c2 = 1.0f / L->theta};
    om_team_barrier(who->team);
    sweep(K, w, &s, who);
    om_team_barrier(who->team);
    s.d = L->e;
    s.d_out = L->d;
    s.c1 = L->c1;
    s.c2 = L->c2;
    sweep(K, w, &s, who);
}

void om__multigrid_apply(const OmKernels* K, const OmSolver* S, const OmBsr* A, OmRank* who) {
    OmMultigrid* mg = S->multigrid;
    int last = mg->nlevel - 1;
    Rows fine = rows_of(S, A, who, 0);
    for (int l = 0; l < last; ++l) {
        smooth_down(K, &mg->level[l], &fine, who);
        fine = rows_of(S, A, who, l + 1);
        K->restrict_rows(&mg->level[l].P, mg->level[l].r, mg->level[l + 1].b, fine.begin, fine.end);
    }
    om_team_barrier(who->team);
    if (who->rank == 0) K->dense_solve(&mg->dense, mg->level[last].b, mg->level[last].x);
    for (int l = last - 1; l >= 0; --l) {
        om_team_barrier(who->team);
        fine = rows_of(S, A, who, l);
        K->prolong_rows(&mg->level[l].P, mg->level[l + 1].x, mg->level[l].d, fine.x, fine.begin,
                        fine.end);
        smooth_up(K, &mg->level[l], &fine, who);
    }
}
