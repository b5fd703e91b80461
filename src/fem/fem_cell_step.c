// fem_cell_step.c: averaged strains in a step, in float: the work between the pass over cells and the rows.
//
// A step's force is that at x + lag v to first order, so the averaged measure of volume is needed at F and at F';
// fem_cell.c has the method, fem_cell_force.c the same in double.
#include "fem/fem_simd.h"

// A pair of scalars averaged: (M in)_k.
OM__INLINE void average_pair(const OmFemCells* c, const float* in, int k, float* out) {
    float a = 0, b = 0;
    for (int at = c->near_adr[k]; at < c->near_adr[k + 1]; ++at) {
        const float* other = in + 2 * (size_t)c->near[at];
        a += c->share[at] * other[0];
        b += c->share[at] * other[1];
    }
    out[0] = a;
    out[1] = b;
}

OM__INLINE float average(const OmFemCells* c, const float* in, int k) {
    float sum = 0;
    for (int at = c->near_adr[k]; at < c->near_adr[k + 1]; ++at)
        sum += c->share[at] * in[c->near[at]];
    return sum;
}

// U' of the averaged measure: at F, and on to F' to first order.
static float wide_stress(const OmFemTurn* t, int k, const float* at) {
    const OmFemCells* c = t->cells;
    if (t->is_turned) return (float)c->wide[c->material[k]].lambda * at[1];
    OmJet U = om__cell_wide(c, c->material[k], (double)at[0]);
    return (float)(U.d + U.dd * ((double)at[1] - (double)at[0]));
}

void om__cells_average(const OmFemTurn* t, OmTeam* team, int rank, int size) {
    const OmFemCells* c = t->cells;
    int n = c->ncell, begin = (int)((int64_t)n * rank / size),
        end = (int)((int64_t)n * (rank + 1) / size);
    size_t padded = OM__LANE * (size_t)om__cell_batches(c);
    float *first = om__cell_scalars(c, t->cell), *second = first + 2 * padded,
          *third = second + 2 * padded;
    for (int k = begin; k < end; ++k) average_pair(c, first, k, second + 2 * k);
    om_team_barrier(team);
    for (int k = begin; k < end; ++k) {
        float at[2];
        average_pair(c, second, k, at);
        third[k] = wide_stress(t, k, at);
    }
    om_team_barrier(team);
    for (int k = begin; k < end; ++k) third[padded + (size_t)k] = average(c, third, k);
}

OM_MULTIVERSION
void om__cells_finish(const OmFemTurn* t, int begin, int end) {
    const OmFemCells* c = t->cells;
    size_t padded = OM__LANE * (size_t)om__cell_batches(c);
    const float* last = om__cell_scalars(c, t->cell) + 5 * padded;
    for (int k = begin; k < end; ++k) {
        float* own = t->cell + (size_t)OM__CELLED * (size_t)k;
        V4 q[3] = {splat4(0), splat4(0), splat4(0)};
        for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at) {
            const float* Q = t->hinge + 12 * (size_t)c->tet[at];
            for (int col = 0; col < 3; ++col) q[col] += load4(Q + 4 * col);
        }
        float p = c->has_wide ? (float)c->volume[k] * average(c, last, k) : 0;
        for (int col = 0; col < 3; ++col)
            store4(own + OM__CELL_P + 4 * col, load4(own + OM__CELL_P + 4 * col) +
                                                   load4(own + OM__CELL_D + 4 * col) * splat4(p) -
                                                   q[col] * splat4(0.25F));
    }
}
