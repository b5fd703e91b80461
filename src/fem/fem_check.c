// fem_check.c: check of a step: volume ratios and elastic energy at its beginning and its end.
//
// Every step runs this check, so it uses floats, a batch of elements at a time. Energies are in units of V mu:
//
//     corotational            |F|^2 - 2 f + 3 + r/2 (f - 3)^2,    f = tr S, the root of fem_rotation.h
//     neo-Hookean             (I1 - 3)/2 - ln J + r/2 (ln J)^2
//     stable neo-Hookean      (I1 - 3)/2 - (J - 1) + (r + 1)/2 (J - 1)^2
//     St Venant-Kirchhoff     r/2 (tr E)^2 + |E|^2
//
// with r = lambda / mu. The volume ratio of a quadratic element is the smallest of its points, that of a shell the
// smaller one of its two points; a shell is also inverted where its middle or one of eight points of Gauss is. Tried
// and rejected: quadratic elements at their vertices too, which the energy does not see; beside a grasp, where strain
// changes within an element, one to ten of 2,000 elements have such a corner in half of the steps of a lift. Other
// laws are evaluated in double, element by element. The sum over elements is in double. Its error is about 1e-7 of sum
// V mu: where the energies break the rule, the caller calls om__fem_eval_balance.
#include "fem/fem_quadratic.h"
#include "fem/fem_shell.h"

// Parts of the elements, each summed by one worker: the same sum for any number of workers.
#define NBLOCK 64

#define NNEWTON 5
#define MAX_STEP 1e-3F  // of the last step of Newton's method for f: above it, in double
#define MIN_SLOPE 0.05F
#define FLAT 1e-6F  // det F below it counts as inverted: a flat element up to rounding

typedef struct Part {  // of one worker
    int ncrushed, nbarrier, ninverted;
    double begin, end;
} Part;

typedef struct Check {
    const OmTissueModel* m;
    const double *x_begin, *x_end;
    Part* part;  // of each block
    int nblock;
    bool is_solved;
} Check;

// F by columns from edges.
OM__INLINE void gradient(const OmFemBatch* batch, Lanes d[9], V16 F[9]) {
    V16 edge[9];
    for (int n = 0; n < 9; ++n) edge[n] = load16(d[n]);
    for (int c = 0; c < 3; ++c) {
        V16 g0 = load16(batch->grad[c]), g1 = load16(batch->grad[3 + c]),
            g2 = load16(batch->grad[6 + c]);
        for (int r = 0; r < 3; ++r)
            F[3 * c + r] = edge[r] * g0 + edge[3 + r] * g1 + edge[6 + r] * g2;
    }
}

// F of the elements of a batch.
OM__INLINE void gather(const OmFemBatch* batch, const double* x, V16 F[9]) {
    Lanes d[9];
    for (int l = 0; l < OM__LANE; ++l) {
        const double* o = x + 3 * (size_t)batch->vert[0][l];
        for (int k = 0; k < 3; ++k)
            for (int c = 0; c < 3; ++c)
                d[3 * k + c][l] = (float)(x[3 * (size_t)batch->vert[k + 1][l] + (size_t)c] - o[c]);
    }
    gradient(batch, d, F);
}

OM__INLINE V16 norm2(const V16 F[9]) {
    V16 sum = F[0] * F[0];
    for (int k = 1; k < 9; ++k) sum += F[k] * F[k];
    return sum;
}

OM__INLINE void cofactors(const V16 F[9], V16 cof[9]) {
    for (int c = 0; c < 3; ++c) {
        const V16 *p = F + 3 * ((c + 1) % 3), *q = F + 3 * ((c + 2) % 3);
        cof[3 * c] = p[1] * q[2] - p[2] * q[1];
        cof[3 * c + 1] = p[2] * q[0] - p[0] * q[2];
        cof[3 * c + 2] = p[0] * q[1] - p[1] * q[0];
    }
}

// *is_bad: lanes where f has not converged.
OM__INLINE V16 corotational(V16 ratio, float shape, V16 I1, V16 cof2, V16 J, I16* is_bad) {
    V16 size2 = I1 + 1e-30F, inv = rsqrt16(size2) * 1.7320508F;  // F scaled to |F|^2 = 3
    V16 inv2 = inv * inv, constant = 9.0F - 4.0F * (cof2 * (inv2 * inv2)),
        j = 8.0F * (J * (inv2 * inv));
    V16 f = splat16(3.0F), step = splat16(0.0F);
    for (int n = 0; n < NNEWTON; ++n) {
        V16 f2 = f * f, slope = 4.0F * (f2 - 3.0F) * f - j;
        step = ((f2 - 6.0F) * f2 - j * f + constant) / max16(slope, splat16(1e-3F));
        f -= step;
    }
    *is_bad = ~((4.0F * (f * f - 3.0F) * f - j >= MIN_SLOPE) & (abs16(step) <= MAX_STEP));
    f /= inv;
    V16 t = f - 3.0F;
    return shape * ((I1 - 3.0F) - 2.0F * t) + 0.5F * ratio * t * t;
}

// Below the floor both logarithms continue as Taylor polynomials, as in fem_law.c.
OM__INLINE V16 neo_hookean(V16 ratio, float shape, V16 I1, V16 J) {
    V16 b = max16(J, splat16((float)OM_LAW_LOG_FLOOR)), t = J - b, l = log16(b), inv = 1.0F / b;
    V16 log = l + t * inv * (1.0F - 0.5F * t * inv);
    V16 square = l * l + t * inv * (2.0F * l + t * inv * (1.0F - l));
    return shape * (0.5F * (I1 - 3.0F) - log) + 0.5F * ratio * square;
}

OM__INLINE V16 stable_neo_hookean(V16 ratio, float shape, V16 I1, V16 J) {
    V16 t = J - 1.0F;
    return shape * (0.5F * (I1 - 3.0F) - t) + 0.5F * (ratio + shape) * t * t;
}

OM__INLINE V16 st_venant(V16 ratio, float shape, const V16 F[9]) {
    V16 trace = splat16(0.0F), sum = splat16(0.0F);
    for (int a = 0; a < 3; ++a)
        for (int b = a; b < 3; ++b) {
            const V16 *p = F + 3 * a, *q = F + 3 * b;
            V16 e = 0.5F * (p[0] * q[0] + p[1] * q[1] + p[2] * q[2] - (a == b ? 1.0F : 0.0F));
            sum += (a == b ? 1.0F : 2.0F) * (e * e);
            if (a == b) trace += e;
        }
    return shape * sum + 0.5F * ratio * trace * trace;
}

// Lanes without a short formula: energy over V mu in double.
// Pointers alone: the clones of a multiversioned function pass vectors by value in other registers than this one.
static void evaluate_lanes(const Check* a, int k, OmLawShare share, const V16 F[9],
                           const I16* which, V16* W) {
    for (int l = 0; l < OM__LANE; ++l) {
        int e = k * OM__LANE + l;
        if (!(*which)[l] || e >= a->m->nelem) continue;
        double lambda, mu;
        om__fem_lame(a->m, e, &lambda, &mu);
        OmMat3 f = om_mat3_cols(om_vec3((double)F[0][l], (double)F[1][l], (double)F[2][l]),
                                om_vec3((double)F[3][l], (double)F[4][l], (double)F[5][l]),
                                om_vec3((double)F[6][l], (double)F[7][l], (double)F[8][l]));
        (*W)[l] = (float)(om__fem_eval_energy(om__fem_material(a->m, e), share, f) / mu);
    }
}

// Elastic energy of a share of the law at F, J, for the volume of `root`; and the volume ratio.
OM__INLINE double eval_point(const Check* a, int k, bool is_turned, OmLawShare share,
                             const V16 F[9], V16* J) {
    const OmFem* fem = a->m->data;
    const OmFemBatch* batch = &fem->batch[k];
    V16 cof[9], W, ratio = load16(batch->ratio), root = load16(batch->root);
    float shape = 1.0F;
    if (share == OM_SHARE_WIDE) ratio = load16(fem->mids[k].wide), shape = 0.0F;
    I16 left = (I16)splat16(0.0F);
    cofactors(F, cof);
    *J = F[0] * cof[0] + F[1] * cof[1] + F[2] * cof[2];
    V16 I1 = norm2(F);
    if (is_turned)
        W = corotational(ratio, shape, I1, norm2(cof), *J, &left);
    else if (batch->family == OM__FAMILY_NEO)
        W = neo_hookean(ratio, shape, I1, *J);
    else if (batch->family == OM__FAMILY_STABLE)
        W = stable_neo_hookean(ratio, shape, I1, *J);
    else if (batch->family == OM__FAMILY_VENANT)
        W = st_venant(ratio, shape, F);
    else
        W = splat16(0.0F), left = ~left;
    int nleft = 0;
    for (int l = 0; l < OM__LANE; ++l) nleft -= left[l];
    if (nleft > 0) evaluate_lanes(a, k, share, F, &left, &W);
    W *= root * root;  // V mu
    double sum = 0;
    for (int l = 0; l < OM__LANE && k * OM__LANE + l < a->m->nelem; ++l) sum += (double)W[l];
    return sum;
}

// Energy of a batch of shells: the law at both points, and the patterns; the smallest ratio at both points, and of all.
OM__INLINE double eval_shells(const Check* a, int k, bool is_turned, const double* x, V16* J,
                              V16* least) {
    const OmFem* fem = a->m->data;
    const OmFemShells* s = &fem->shells[k];
    V16 root = load16(fem->batch[k].root), F[9], at[9], q[12], R[9], d[12], p[12], e[6], ratio;
    Lanes node[21];
    Frame f;
    double sum = 0;
    gather_shell(s, x, node);
    split_shell(s, node, F, q);
    decompose(F, &f);
    turn_of(s, f.U, f.V, R);
    push_patterns(s, R, q, d, p, e);
    *least = least_ratio(s, F, q);
    for (int side = -1; side < 2; side += 2) {
        point_of_shell(F, R, e, (float)side, at);
        sum += 0.5 * eval_point(a, k, is_turned, OM_SHARE_WHOLE, at, &ratio);
        *J = side < 0 ? ratio : select16(ratio < *J, ratio, *J);
        *J = select16(ratio == ratio, *J, ratio);  // not a number stays
    }
    V16 W = splat16(0);
    for (int n = 0; n < 12; ++n) W += 0.5F * d[n] * p[n];
    for (int l = 0; l < OM__LANE && k * OM__LANE + l < a->m->nelem; ++l)
        if (!((*least)[l] >= (float)OM__SHELL_CRUSHED))
            W[l] += (float)om__fem_shell_resist(a->m, k * OM__LANE + l, F, q, l, NULL, NULL);
    W *= root * root;
    for (int l = 0; l < OM__LANE && k * OM__LANE + l < a->m->nelem; ++l) sum += (double)W[l];
    *least = select16(*J < *least, *J, *least);
    return sum;
}

// Energy of a batch, and the volume ratio of each element: of quadratic ones the smallest of their points.
OM__INLINE double eval_batch(const Check* a, int k, bool is_turned, const double* x, V16* J,
                             V16* least) {
    const OmFem* fem = a->m->data;
    V16 F[9];
    if (fem->shells)
        return eval_shells(a, k, fem->batch[k].family == OM__FAMILY_TURNED, x, J, least);
    if (!fem->mids) {
        gather(&fem->batch[k], x, F);
        double energy = eval_point(a, k, is_turned, OM_SHARE_WHOLE, F, J);
        *least = *J;
        return energy;
    }
    Lanes node[27], d[9];
    double sum = 0;
    gather_nodes(&fem->batch[k], &fem->mids[k], x, node);
    for (int q = 0; q < OM__POINTS; ++q) {
        V16 ratio;
        point_edges(node, q, d);
        gradient(&fem->batch[k], d, F);
        sum += 4 * om__point_volume(q) * eval_point(a, k, is_turned, om__point_share(q), F, &ratio);
        *J = q == 0 ? ratio : select16(ratio < *J, ratio, *J);
        *J = select16(ratio == ratio, *J, ratio);  // not a number stays
    }
    *least = *J;
    return sum;
}

// Limits of a step: det F may fall to a tenth, in already flat elements to half of its value. After Newton's method
// any positive value is accepted. An inverted element may stay inverted, and its det F may fall to twice its value
// minus a half.
OM__INLINE float least_allowed(float begin, bool is_solved) {
    float half = 0.5F * begin;
    if (begin <= 0) return 2.0F * begin - 0.5F;
    if (is_solved) return FLAT;
    return half < 0.1F ? half : 0.1F;
}

// Does the energy rise steeply as J goes to 0? Then shorter steps keep elements from inverting.
static bool has_barrier(const OmMaterial* m) {
    return m->law == OM_NEO_HOOKEAN || m->law == OM_MOONEY_RIVLIN || m->law == OM_OGDEN ||
           m->law == OM_OGDEN_COUPLED;
}

OM_MULTIVERSION
static void check_batches(const Check* a, int begin, int end, Part* part) {
    const OmFem* fem = a->m->data;
    for (int k = begin; k < end; ++k) {
        V16 was, J, least;
        part->begin += eval_batch(a, k, !fem->is_blocked, a->x_begin, &was, &least);
        part->end += eval_batch(a, k, !fem->is_blocked, a->x_end, &J, &least);
        I16 low = ~(least >= 0.1F);
        int nlow = 0;
        for (int l = 0; l < OM__LANE; ++l) nlow -= low[l];
        if (nlow == 0) continue;
        for (int l = 0; l < OM__LANE && k * OM__LANE + l < fem->nelem; ++l) {
            bool is_crushed = !(J[l] >= 0.1F) && !(J[l] >= least_allowed(was[l], a->is_solved));
            part->ncrushed += is_crushed;
            part->nbarrier += is_crushed && has_barrier(om__fem_material(a->m, k * OM__LANE + l));
            part->ninverted += !(least[l] > FLAT);
        }
    }
}

static void check_team(void* ctx, OmTeam* team, int rank, int size) {
    (void)team;
    const Check* a = ctx;
    int64_t nbatch = ((const OmFem*)a->m->data)->nbatch;
    for (int k = a->nblock * rank / size; k < a->nblock * (rank + 1) / size; ++k) {
        Part part = {0};
        check_batches(a, (int)(nbatch * k / a->nblock), (int)(nbatch * (k + 1) / a->nblock), &part);
        a->part[k] = part;
    }
}

void om__fem_check(const OmTissueModel* m, const OmTissueWork* w, const double* x_begin,
                   const double* x_end, bool is_solved, OmTissueCheck* check) {
    const OmFemWork* fw = w->data;
    Part part[NBLOCK];
    Check a = {.m = m,
               .x_begin = x_begin,
               .x_end = x_end,
               .part = part,
               .nblock = NBLOCK,
               .is_solved = is_solved};
    om_parallel_team(fw->nworker, check_team, &a);
    *check = (OmTissueCheck){0};
    for (int k = 0; k < NBLOCK; ++k) {
        check->ncrushed += part[k].ncrushed;
        check->nbarrier += part[k].nbarrier;
        check->ninverted += part[k].ninverted;
        check->elastic_begin += part[k].begin;
        check->elastic_end += part[k].end;
    }
}
