// pbd_self.c: particles keep collision_distance from each other, except pairs that are near at rest.
//
// A hash grid of the predicted positions, built once a substep by counting, gives each particle its neighbours in
// a fixed order. In every iteration each particle computes its own half of all pairs' corrections from the same
// positions (Jacobi's scheme), so no worker writes data that another one reads, and results do not depend on the
// number of workers. A pair's correction is divided by half the larger number of neighbours of the two: both use
// the same number, so momentum is conserved.
#include <string.h>

#include "pbd/pbd_internal.h"

#define NEAR OM__PBD_NEIGHBOR
#define REACH 1.25     // of the kept distance: neighbours within this are examined
#define REST_NEAR 1.5  // of the kept distance: pairs nearer than this at rest are exempt

OmStatus om__pbd_make_pairs(int nvert, OmPbdPairs* p) {
    size_t n = (size_t)nvert, nbucket = 64;
    while (nbucket < 2 * n) nbucket *= 2;
    p->mask = (uint32_t)(nbucket - 1);
    p->adr = om_calloc(nbucket + 1, sizeof *p->adr);
    p->order = om_calloc(n, sizeof *p->order);
    p->cell = om_calloc(n, 3 * sizeof *p->cell);
    p->near_num = om_calloc(n, sizeof *p->near_num);
    p->near = om_calloc(n, NEAR * sizeof *p->near);
    p->shift = om_calloc(n, 3 * sizeof *p->shift);
    if (!p->adr || !p->order || !p->cell || !p->near_num || !p->near || !p->shift)
        return OM_NO_MEMORY;
    p->size = (nbucket + 1 + n * (5 + NEAR)) * sizeof(int) + 3 * n * sizeof(double);
    return OM_OK;
}

void om__pbd_pairs_done(OmPbdPairs* p) {
    om_free(p->adr);
    om_free(p->order);
    om_free(p->cell);
    om_free(p->near_num);
    om_free(p->near);
    om_free(p->shift);
    *p = (OmPbdPairs){0};
}

static int cell_of(double x, double inverse) {
    double c = floor(x * inverse);
    return c > 1e9 ? 1000000000 : c > -1e9 ? (int)c : -1000000000;
}

static uint32_t bucket_of(const OmPbdPairs* p, int i, int j, int k) {
    uint32_t h = (uint32_t)i * 73856093u ^ (uint32_t)j * 19349663u ^ (uint32_t)k * 83492791u;
    return (h ^ h >> 15) & p->mask;  // Teschner et al. 2003
}

void om__pbd_fill_grid(OmPbdStep* s) {
    OmPbdPairs* p = &s->w->pairs;
    int n = s->m->mesh.nvert;
    double inverse = 1 / (REACH * s->pbd->def.collision_distance);
    memset(p->adr, 0, ((size_t)p->mask + 2) * sizeof *p->adr);
    for (int i = 0; i < n; ++i) {
        int* c = p->cell + 3 * (size_t)i;
        for (int a = 0; a < 3; ++a) c[a] = cell_of(s->x[3 * (size_t)i + (size_t)a], inverse);
        ++p->adr[bucket_of(p, c[0], c[1], c[2]) + 1];
    }
    for (uint32_t b = 0; b <= p->mask; ++b) p->adr[b + 1] += p->adr[b];
    for (int i = n - 1; i >= 0; --i) {  // backwards, so that buckets are ascending
        const int* c = p->cell + 3 * (size_t)i;
        p->order[--p->adr[bucket_of(p, c[0], c[1], c[2]) + 1]] = i;
    }
    // each adr[b + 1] now is the start of bucket b: shift by one
    for (uint32_t b = 0; b <= p->mask; ++b) p->adr[b] = p->adr[b + 1];
    p->adr[p->mask + 1] = n;
}

// Neighbours of particle i in one cell.
static void look_into(OmPbdStep* s, int i, const int c[3]) {
    OmPbdPairs* p = &s->w->pairs;
    double d = s->pbd->def.collision_distance, reach2 = REACH * d * REACH * d;
    double rest2 = REST_NEAR * d * REST_NEAR * d;
    OmVec3 at = om_load3(s->x, i), rest = om_load3(s->m->mesh.x, i);
    uint32_t b = bucket_of(p, c[0], c[1], c[2]);
    for (int n = p->adr[b]; n < p->adr[b + 1] && p->near_num[i] < NEAR; ++n) {
        int j = p->order[n];
        if (j == i || memcmp(p->cell + 3 * (size_t)j, c, 3 * sizeof *c) != 0) continue;
        if (om_norm2(om_sub(om_load3(s->x, j), at)) >= reach2) continue;
        if (om_norm2(om_sub(om_load3(s->m->mesh.x, j), rest)) < rest2) continue;
        p->near[NEAR * (size_t)i + (size_t)p->near_num[i]++] = j;
    }
}

bool om__pbd_find_pairs(OmPbdStep* s, int begin, int end) {
    OmPbdPairs* p = &s->w->pairs;
    bool is_any = false;
    for (int i = begin; i < end; ++i) {
        const int* c = p->cell + 3 * (size_t)i;
        p->near_num[i] = 0;
        for (int k = -1; k <= 1; ++k)
            for (int j = -1; j <= 1; ++j)
                for (int h = -1; h <= 1; ++h)
                    look_into(s, i, (int[3]){c[0] + h, c[1] + j, c[2] + k});
        is_any |= p->near_num[i] > 0;
    }
    return is_any;
}

// Correction of particle i by the pair.
static OmVec3 part_pair(const OmPbdStep* s, int i, int j) {
    const OmPbdDef* def = &s->pbd->def;
    OmVec3 zero = {0, 0, 0};
    double wi = s->w->give[i], wj = s->w->give[j];
    if (!(wi > 0)) return zero;
    OmVec3 apart = om_sub(om_load3(s->x, i), om_load3(s->x, j));
    OmVec3 was = om_sub(om_load3(s->w->begin, i), om_load3(s->w->begin, j));
    double length = om_norm(apart), before = om_norm(was);
    OmVec3 n = om_scale(1 / (length > 0 ? length : 1), apart);
    if (om_dot(apart, was) < 0) {  // they passed each other: move back to the original side
        n = om_scale(1 / before, was);
        length = om_dot(n, apart);
    }
    // inside at the beginning: moves out slowly
    double goal = before + def->recover_speed * s->sub;
    double depth = (goal < def->collision_distance ? goal : def->collision_distance) - length;
    if (!(depth > 0)) return zero;
    OmVec3 slip = om_sub(apart, was);
    slip = om_madd(slip, -om_dot(slip, n), n);
    double way = om_norm(slip), max = def->particle_friction * depth;
    OmVec3 d = om_madd(om_scale(depth, n), way > max ? -max / way : -1.0, slip);
    int num = s->w->pairs.near_num[i], other = s->w->pairs.near_num[j];
    if (other > num) num = other;
    double relax = num > 2 ? 2.0 / num : 1;
    return om_scale(relax * wi / (wi + wj), d);
}

void om__pbd_find_shifts(OmPbdStep* s, int begin, int end) {
    OmPbdPairs* p = &s->w->pairs;
    for (int i = begin; i < end; ++i) {
        OmVec3 sum = {0, 0, 0};
        for (int n = 0; n < p->near_num[i]; ++n)
            sum = om_add(sum, part_pair(s, i, p->near[NEAR * (size_t)i + (size_t)n]));
        om_store3(p->shift, i, sum);
    }
}

void om__pbd_shift(OmPbdStep* s, int begin, int end) {
    for (int i = begin; i < end; ++i)
        if (s->w->pairs.near_num[i] > 0)
            om_store3(s->x, i, om_add(om_load3(s->x, i), om_load3(s->w->pairs.shift, i)));
}
