// fem_assemble.c: second pass of a step: every vertex gathers its row of A and its entry of b.
//
// With b_a = R g_a the stiffness of an element is K_ij = V (lambda b_i b_j^T + mu b_j b_i^T + mu b_i.b_j I):
// four rotated gradients instead of a 12 x 12 matrix. Scaled by sqrt(V mu (h^2 + h b)), a block of A is
// r S + S^T + tr(S) I, with S the sum of b_i b_j^T over the elements at (i, j) and r = lambda / mu; where r
// differs between elements, r S is summed separately. Gradients of an element sum to zero, so the diagonal
// S is minus the sum of the others in its row. Off the diagonal both triangles are exact transposes of
// each other.
#include <string.h>

#include "fem/fem_quadratic.h"
#include "fem/fem_shell.h"

// sum += b p^T, a column at a time.
OM__INLINE void add_outer(float* sum, V4 b, const float* p) {
    store4(sum, load4(sum) + b * splat4(p[0]));
    store4(sum + 4, load4(sum + 4) + b * splat4(p[1]));
    store4(sum + 8, load4(sum + 8) + b * splat4(p[2]));
}

// Sums of a row over the elements of its vertex; the elastic entry of b is returned.
OM__INLINE V4 gather_row(const OmFem* fem, const float* turned, int i, bool is_mixed, float* S,
                         float* rS) {
    V4 f = splat4(0);
    for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at) {
        const OmFemVisit* visit = &fem->visit[at];
        const float* e = turned + OM__TURNED * (size_t)(visit->corner >> 2);
        const float* p = e + 4 * (visit->corner & 3);
        V4 b = load4(p);
        f -= load4(e + 16) * splat4(p[0]) + load4(e + 20) * splat4(p[1]) +
             load4(e + 24) * splat4(p[2]);
        int own = visit->corner & 3;
        for (int n = 1; n < 4; ++n) {  // the other three
            int k = (own + n) & 3;
            add_outer(S + 12 * visit->slot[k], b, e + 4 * k);
            if (is_mixed) add_outer(rS + 12 * visit->slot[k], b * splat4(e[19]), e + 4 * k);
        }
    }
    return f;
}

// The diagonal sums, from the sums of the neighbours.
OM__INLINE void sum_diagonal(float* S, int num) {
    V4 a = splat4(0), b = splat4(0), c = splat4(0);
    for (int k = 1; k < num; ++k) {
        a -= load4(S + 12 * k);
        b -= load4(S + 12 * k + 4);
        c -= load4(S + 12 * k + 8);
    }
    store4(S, a);
    store4(S + 4, b);
    store4(S + 8, c);
}

// r S + S^T + tr(S) I, by columns of three: the last store begins inside the second column.
OM__INLINE void write_block(float* out, const float* S, const float* rS, float r) {
    V4 a = load4(S), b = load4(S + 4), c = load4(S + 8), vr = splat4(r);
    float trace = S[0] + S[5] + S[10];
    V4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
       AB = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    V4 x = {trace, 0, 0, 0}, y = {0, trace, 0, 0}, z = {0, 0, trace, 0};
    x += vr * load4(rS) + __builtin_shufflevector(ab, c, 0, 1, 4, 7);
    y += vr * load4(rS + 4) + __builtin_shufflevector(ab, c, 2, 3, 5, 7);
    z += vr * load4(rS + 8) + __builtin_shufflevector(AB, c, 0, 1, 6, 7);
    store4(out, x);
    store4(out + 3, y);
    store4(out + 5, __builtin_shufflevector(y, z, 2, 4, 5, 6));
}

// ---- blocks of any law ------------------------------------------------------------------------------

// sum += a block of nine floats by columns.
OM__INLINE void add_block(float* sum, const float* block) {
    store4(sum, load4(sum) + load4(block));
    store4(sum + 4, load4(sum + 4) + load4(block + 3));
    store4(sum + 8, load4(sum + 8) + load4(block + 6));
}

// sum += its transpose.
OM__INLINE void add_transposed(float* sum, const float* block) {
    V4 a = load4(block), b = load4(block + 3), c = load4(block + 6);
    V4 ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
       AB = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    store4(sum, load4(sum) + __builtin_shufflevector(ab, c, 0, 1, 4, 7));
    store4(sum + 4, load4(sum + 4) + __builtin_shufflevector(ab, c, 2, 3, 5, 7));
    store4(sum + 8, load4(sum + 8) + __builtin_shufflevector(AB, c, 0, 1, 6, 7));
}

// Sums of a row over the elements of its vertex, from their blocks; the elastic entry of b is returned.
OM__INLINE V4 gather_blocks(const OmFem* fem, const float* left, int i, float* S) {
    static const signed char pair[4][4] = {
        {-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};
    V4 f = splat4(0);
    for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at) {
        const OmFemVisit* visit = &fem->visit[at];
        const float* e = left + OM__BLOCKED * (size_t)(visit->corner >> 2);
        int own = visit->corner & 3;
        f += load4(e + 54 + 3 * own);
        for (int n = 0; n < own; ++n) add_transposed(S + 12 * visit->slot[n], e + 9 * pair[own][n]);
        for (int n = own + 1; n < 4; ++n) add_block(S + 12 * visit->slot[n], e + 9 * pair[own][n]);
    }
    return f;
}

// The same of elements of more nodes, which leave the blocks of the pairs n < m of their nodes and then the forces.
OM__INLINE V4 gather_large(const OmFem* fem, const float* left, int nnode, int size, int i,
                           float* S) {
    V4 f = splat4(0);
    for (int at = fem->visit_adr[i]; at < fem->visit_adr[i + 1]; ++at) {
        const OmFemLargeVisit* visit = &fem->large_visit[at];
        int own = visit->corner % nnode, pair = own - 1;  // of (0, own)
        const float* e = left + size * (size_t)(visit->corner / nnode);
        f += load4(e + 9 * (nnode * (nnode - 1) / 2) + 3 * own);
        for (int n = 0; n < own; ++n, pair += nnode - 1 - n)
            add_transposed(S + 12 * visit->slot[n], e + 9 * pair);
        ++pair;  // of (own, own + 1)
        for (int n = own + 1; n < nnode; ++n, ++pair)
            add_block(S + 12 * visit->slot[n], e + 9 * pair);
    }
    return f;
}

// A sum by columns; the last store begins inside the second column.
OM__INLINE void pack_block(float* out, const float* S) {
    V4 b = load4(S + 4), c = load4(S + 8);
    store4(out, load4(S));
    store4(out + 3, b);
    store4(out + 5, __builtin_shufflevector(b, c, 2, 4, 5, 6));
}

// The diagonal block; rounding makes it slightly asymmetric.
OM__INLINE void pack_diagonal(float* out, const float* S) {
    for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) out[3 * c + r] = 0.5F * (S[4 * c + r] + S[4 * r + c]);
}

// ---- rows ---------------------------------------------------------------------------------------------

typedef struct Rows {
    const OmTissueModel* m;
    const OmTissueState* s;
    const OmFem* fem;
    OmTissueWork* w;
    OmFemTurn turn;
    const OmAssembly* at;
} Rows;

// Mass, its damping, weight, external forces and the spring of an attachment.
OM__INLINE void add_vertex_terms(const Rows* rows, int i, V4 f, float* diagonal) {
    const OmTissueModel* m = rows->m;
    const OmTissueState* s = rows->s;
    const OmAssembly* at = rows->at;
    double mass = m->mass[i], inertia = mass * at->mass;
    OmVec3 b = {(double)f[0], (double)f[1], (double)f[2]}, v = om_load3(at->v, i);
    OmVec3 push = om_madd(om_load3(om__state_array(s, OM__F_EXT), i), mass,
                          om_madd(m->def.gravity, -m->def.rayleigh_mass, v));
    double k = om__state_stiffness(s)[i];
    if (k > 0) {
        OmVec3 stretch = om_sub(om_load3(om__state_array(s, OM__ANCHOR), i),
                                om_madd(om_load3(at->x, i), at->spring_lag, v));
        push = om_madd(push, k, stretch);
        inertia += at->spring * k;
    }
    for (int c = 0; c < 3; ++c) diagonal[4 * c] += (float)inertia;
    om_store3(rows->w->b, i, om_madd(b, at->force, push));
}

OM__INLINE void write_rows(const Rows* rows, bool is_mixed, float* S, int begin, int end) {
    const OmFem* fem = rows->fem;
    const OmBsr* A = &rows->w->A;
    float* rS = is_mixed ? S + 12 * (size_t)fem->max_row : S;
    float r = is_mixed ? 1.0F : fem->ratio;
    for (int i = begin; i < end; ++i) {
        int adr = A->row_adr[i], num = A->row_adr[i + 1] - adr;
        memset(S, 0, 12 * (size_t)num * sizeof(float));
        if (is_mixed) memset(rS, 0, 12 * (size_t)num * sizeof(float));
        V4 f = gather_row(fem, rows->turn.turned, i, is_mixed, S, rS);
        sum_diagonal(S, num);
        if (is_mixed) sum_diagonal(rS, num);
        float* out = A->value + 9 * (size_t)adr;
        for (int k = 0; k < num; ++k)
            write_block(out + 9 * (size_t)k, S + 12 * (size_t)k, rS + 12 * (size_t)k, r);
        add_vertex_terms(rows, i, f, out);
    }
}

OM_MULTIVERSION
static void write_uniform_rows(const Rows* rows, float* S, int begin, int end) {
    write_rows(rows, false, S, begin, end);
}

OM_MULTIVERSION
static void write_mixed_rows(const Rows* rows, float* S, int begin, int end) {
    write_rows(rows, true, S, begin, end);
}

OM_MULTIVERSION
static void write_blocked_rows(const Rows* rows, float* S, int begin, int end) {
    const OmFem* fem = rows->fem;
    const OmBsr* A = &rows->w->A;
    for (int i = begin; i < end; ++i) {
        int adr = A->row_adr[i], num = A->row_adr[i + 1] - adr;
        memset(S, 0, 12 * (size_t)num * sizeof(float));
        const float* left = rows->turn.turned;
        V4 f = fem->mids     ? gather_large(fem, left, 10, OM__QUADRATIC, i, S)
               : fem->shells ? gather_large(fem, left, OM__SHELL_NODE, OM__SHELL, i, S)
                             : gather_blocks(fem, left, i, S);
        sum_diagonal(S, num);
        float* out = A->value + 9 * (size_t)adr;
        for (int k = 1; k < num; ++k) pack_block(out + 9 * (size_t)k, S + 12 * (size_t)k);
        pack_diagonal(out, S);
        add_vertex_terms(rows, i, f, out);
    }
}

static void assemble_team(void* ctx, OmTeam* team, int rank, int size) {
    const Rows* rows = ctx;
    const OmFem* fem = rows->fem;
    const OmFemWork* fw = rows->w->data;
    int64_t nbatch = fem->nbatch, nvert = rows->m->mesh.nvert;
    int first = (int)(nbatch * rank / size), last = (int)(nbatch * (rank + 1) / size);
    bool is_blocked = fem->is_blocked && !rows->at->is_turned;
    if (fem->shells)
        om__fem_stretch_shell(&rows->turn, first, last);
    else if (fem->mids)
        (is_blocked ? om__fem_stretch_quadratic : om__fem_turn_quadratic)(&rows->turn, first, last);
    else
        (is_blocked ? om__fem_stretch : om__fem_turn)(&rows->turn, first, last);
    om_team_barrier(team);
    float* S = fw->row + (size_t)rank * fw->row_size;
    int begin = (int)(nvert * rank / size), end = (int)(nvert * (rank + 1) / size);
    if (is_blocked || fem->mids || fem->shells)
        write_blocked_rows(rows, S, begin, end);
    else if (fem->is_mixed)
        write_mixed_rows(rows, S, begin, end);
    else
        write_uniform_rows(rows, S, begin, end);
}

OmStatus om__fem_assemble(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                          const OmAssembly* at) {
    const OmFemWork* fw = w->data;
    double scale = sqrt(at->stiffness);
    Rows rows = {.m = m,
                 .s = s,
                 .fem = m->data,
                 .w = w,
                 .turn = {.batch = ((const OmFem*)m->data)->batch,
                          .mids = ((const OmFem*)m->data)->mids,
                          .shells = ((const OmFem*)m->data)->shells,
                          .x = at->x,
                          .v = at->v,
                          .lag = (float)at->lag,
                          .scale = (float)scale,
                          .stress = (float)(at->force / scale),
                          .turned = fw->turned,
                          .model = m,
                          .is_exact = at->is_exact,
                          .is_turned = at->is_turned},
                 .at = at};
    om_parallel_team(fw->nworker, assemble_team, &rows);
    return OM_OK;
}
