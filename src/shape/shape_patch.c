// shape_patch.c: fields on surfaces: normals, geodesic distance, noise, uniform samples, random patches.
//
// The random patch is thesis eq. 4.1: D_Q = w_d d_PQ + w_n n_PQ + w_p p_Q, taking the vertices of smallest
// D. The thesis gives no units for its weights; here each term is scaled to 0-1 first (the geodesic distance
// by the largest among the candidates, the angle by pi, the noise from [-1, 1]), and the weights are drawn
// from the ranges of the def. Geodesics run along edges (Dijkstra), which is at most 15 % too long on an
// even triangulation: enough for an outline that is meant to be irregular.
#include "shape/shape_internal.h"

#include <stdlib.h>
#include <string.h>

// ---- normals ----------------------------------------------------------------------------------------------

void om_surface_normals(const OmSurface* surface, double* normal) {
    memset(normal, 0, (size_t)surface->nvert * 3 * sizeof(double));
    for (int t = 0; t < surface->ntri; t++) {
        const int* v = &surface->tri_vert[3 * (size_t)t];
        for (int c = 0; c < 3; c++) {
            OmVec3 o = om_load3(surface->x, v[c]);
            OmVec3 p = om_sub(om_load3(surface->x, v[(c + 1) % 3]), o);
            OmVec3 q = om_sub(om_load3(surface->x, v[(c + 2) % 3]), o);
            OmVec3 n = om_cross(p, q);
            double angle = atan2(om_norm(n), om_dot(p, q));
            om_store3(normal, v[c], om_madd(om_load3(normal, v[c]), angle, om_normalize(n)));
        }
    }
    for (int v = 0; v < surface->nvert; v++)
        om_store3(normal, v, om_normalize(om_load3(normal, v)));
}

// ---- geodesics ----------------------------------------------------------------------------------------------

typedef struct Heap {  // binary heap of vertices by distance
    int* vert;
    int* place;  // position of a vertex in the heap, -1 if it is not in it
    const double* key;
    int n;
} Heap;

static void heap_put(Heap* h, int at, int v) {
    h->vert[at] = v;
    h->place[v] = at;
}

static void heap_rise(Heap* h, int at) {
    int v = h->vert[at];
    while (at > 0 && h->key[h->vert[(at - 1) / 2]] > h->key[v]) {
        heap_put(h, at, h->vert[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    heap_put(h, at, v);
}

static int heap_pop(Heap* h) {
    int top = h->vert[0], v = h->vert[--h->n], at = 0;
    h->place[top] = -1;
    for (;;) {
        int child = 2 * at + 1;
        if (child >= h->n) break;
        if (child + 1 < h->n && h->key[h->vert[child + 1]] < h->key[h->vert[child]]) child++;
        if (h->key[h->vert[child]] >= h->key[v]) break;
        heap_put(h, at, h->vert[child]);
        at = child;
    }
    if (h->n > 0) heap_put(h, at, v);
    return top;
}

OmStatus om__surface_corners(const OmSurface* s, int** adr, int** corner) {
    *corner = NULL;
    *adr = om_calloc((size_t)s->nvert + 1, sizeof(int));
    *corner = om_alloc(3 * (size_t)s->ntri, sizeof(int));
    if (!*adr || !*corner) return OM_NO_MEMORY;
    for (int i = 0; i < 3 * s->ntri; i++) (*adr)[s->tri_vert[i]]++;
    for (int v = 0, sum = 0; v <= s->nvert; v++) {
        int count = (*adr)[v];
        (*adr)[v] = sum;
        sum += count;
    }
    for (int i = 0; i < 3 * s->ntri; i++) (*corner)[(*adr)[s->tri_vert[i]]++] = i;
    for (int v = s->nvert; v > 0; v--) (*adr)[v] = (*adr)[v - 1];
    (*adr)[0] = 0;
    return OM_OK;
}

OmStatus om_surface_geodesic(const OmSurface* surface, int from, double* distance) {
    OmStatus status = OM_OK;
    int *adr = NULL, *corner = NULL;
    Heap heap = {.key = distance};
    OM_CHECK(from >= 0 && from < surface->nvert, OM_INVALID,
             "geodesics start at vertex %d of a surface of %d", from, surface->nvert);
    OM_TRY_DONE(om__surface_corners(surface, &adr, &corner));
    OM_ALLOC_DONE(heap.vert, surface->nvert);
    OM_ALLOC_DONE(heap.place, surface->nvert);
    for (int v = 0; v < surface->nvert; v++) {
        distance[v] = HUGE_VAL;
        heap.place[v] = -1;
    }
    distance[from] = 0;
    heap_put(&heap, heap.n++, from);
    while (heap.n > 0) {
        int v = heap_pop(&heap);
        OmVec3 x = om_load3(surface->x, v);
        for (int i = adr[v]; i < adr[v + 1]; i++) {
            int t = corner[i] / 3, c = corner[i] % 3;
            for (int side = 1; side < 3; side++) {
                int w = surface->tri_vert[3 * t + (c + side) % 3];
                double d = distance[v] + om_distance(x, om_load3(surface->x, w));
                if (d >= distance[w]) continue;
                distance[w] = d;
                if (heap.place[w] < 0) heap_put(&heap, heap.n++, w);
                heap_rise(&heap, heap.place[w]);
            }
        }
    }
done:
    om_free(adr);
    om_free(corner);
    om_free(heap.vert);
    om_free(heap.place);
    return status;
}

// ---- noise --------------------------------------------------------------------------------------------------------

// One of Perlin's twelve gradients, chosen by a hash of the lattice point, times the offset.
static double gradient_dot(int64_t i, int64_t j, int64_t k, uint64_t seed, OmVec3 d) {
    const int64_t word[3] = {i, j, k};
    uint64_t h = om_hash(word, sizeof word, OM_HASH_SEED ^ seed * 0x9e3779b97f4a7c15ull);
    h ^= h >> 33;
    h *= 0xff51afd7ed558ccdull;
    h ^= h >> 33;
    switch (h % 12) {
    case 0: return d.x + d.y;
    case 1: return -d.x + d.y;
    case 2: return d.x - d.y;
    case 3: return -d.x - d.y;
    case 4: return d.x + d.z;
    case 5: return -d.x + d.z;
    case 6: return d.x - d.z;
    case 7: return -d.x - d.z;
    case 8: return d.y + d.z;
    case 9: return -d.y + d.z;
    case 10: return d.y - d.z;
    default: return -d.y - d.z;
    }
}

static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

double om_noise_perlin(OmVec3 p, uint64_t seed) {
    double fx = floor(p.x), fy = floor(p.y), fz = floor(p.z);
    if (!om_is_finite3(p) || fabs(fx) > 1e15 || fabs(fy) > 1e15 || fabs(fz) > 1e15) return 0;
    OmVec3 d = om_vec3(p.x - fx, p.y - fy, p.z - fz);
    double u[3] = {fade(d.x), fade(d.y), fade(d.z)}, sum = 0;
    for (int c = 0; c < 8; c++) {
        int a = c & 1, b = c >> 1 & 1, e = c >> 2;
        double w = (a ? u[0] : 1 - u[0]) * (b ? u[1] : 1 - u[1]) * (e ? u[2] : 1 - u[2]);
        sum += w * gradient_dot((int64_t)fx + a, (int64_t)fy + b, (int64_t)fz + e, seed,
                                om_sub(d, om_vec3(a, b, e)));
    }
    return fmax(-1, fmin(1, sum));
}

// ---- samples ------------------------------------------------------------------------------------------------------

static double triangle_area(const OmSurface* s, int t, OmVec3* normal) {
    const int* v = &s->tri_vert[3 * (size_t)t];
    OmVec3 a = om_load3(s->x, v[0]);
    OmVec3 n = om_cross(om_sub(om_load3(s->x, v[1]), a), om_sub(om_load3(s->x, v[2]), a));
    *normal = om_normalize(n);
    return 0.5 * om_norm(n);
}

OmStatus om_surface_sample(const OmSurface* surface, const unsigned char* is_used, int n,
                           OmRng* rng, double* point, double* normal) {
    OmVec3 nt;
    double total = 0;
    for (int t = 0; t < surface->ntri; t++) {
        if (!is_used || is_used[t]) total += triangle_area(surface, t, &nt);
    }
    OM_CHECK(total > 0 && n >= 0, OM_INVALID, "no surface to sample %d points from", n);
    double next = total / n * om_rng_uniform(rng), sum = 0;
    int made = 0;
    for (int t = 0; t < surface->ntri && made < n; t++) {
        if (is_used && !is_used[t]) continue;
        const int* v = &surface->tri_vert[3 * (size_t)t];
        OmVec3 a = om_load3(surface->x, v[0]);
        OmVec3 ab = om_sub(om_load3(surface->x, v[1]), a),
               ac = om_sub(om_load3(surface->x, v[2]), a);
        sum += triangle_area(surface, t, &nt);
        bool is_last = sum >= total * (1 - 1e-12);  // rounding must not lose the last point
        while (made < n && (next < sum || is_last)) {
            double r1 = om_rng_uniform(rng), r2 = om_rng_uniform(rng);
            if (r1 + r2 > 1) {
                r1 = 1 - r1;
                r2 = 1 - r2;
            }
            om_store3(point, made, om_madd(om_madd(a, r1, ab), r2, ac));
            if (normal) om_store3(normal, made, nt);
            next += total / n;
            made++;
        }
    }
    return OM_OK;
}

// ---- random patches -------------------------------------------------------------------------------------------------

OmPatchDef om_patch_default_def(double share, uint64_t seed) {
    OmPatchDef def = {.cookie = OM__PATCH_COOKIE,
                      .share = share,
                      .seed = seed,
                      .center = -1,
                      .w_d = {0.3, 0.7},
                      .w_n = {1.0, 1.5},
                      .w_p = {0.1, 0.4}};
    return def;
}

static OmStatus check_patch(const OmSurface* s, const int* candidate, int n,
                            const OmPatchDef* def) {
    OM_CHECK(def->cookie == OM__PATCH_COOKIE, OM_INVALID,
             "OmPatchDef was not made by om_patch_default_def");
    OM_CHECK(def->share >= 0 && def->share <= 1, OM_INVALID, "patch: share %g must be 0 to 1",
             def->share);
    OM_CHECK(def->center < s->nvert, OM_INVALID, "patch: centre %d of a surface of %d vertices",
             def->center, s->nvert);
    OM_CHECK(n > 0, OM_INVALID, "patch: no vertex to choose from");
    OM_CHECK(def->noise_length >= 0, OM_INVALID, "patch: noise length %g m", def->noise_length);
    for (int i = 0; candidate && i < n; i++) {
        OM_CHECK(candidate[i] >= 0 && candidate[i] < s->nvert, OM_INVALID,
                 "patch: candidate %d of a surface of %d vertices", candidate[i], s->nvert);
    }
    return OM_OK;
}

typedef struct Ranked {
    double d;
    int vert;
} Ranked;

static int compare_ranked(const void* a, const void* b) {
    const Ranked *x = a, *y = b;
    if (x->d != y->d) return x->d < y->d ? -1 : 1;
    return x->vert < y->vert ? -1 : x->vert > y->vert;
}

// D of eq. 4.1 for every candidate.
static void rank_candidates(const OmSurface* s, const int* candidate, int n, const OmPatchDef* def,
                            OmRng* rng, int center, const double* distance, const double* normal,
                            Ranked* ranked) {
    double w_d = om_rng_range(rng, def->w_d[0], def->w_d[1]);
    double w_n = om_rng_range(rng, def->w_n[0], def->w_n[1]);
    double w_p = om_rng_range(rng, def->w_p[0], def->w_p[1]);
    double reach = 0;
    for (int i = 0; i < n; i++) {
        double d = distance[candidate ? candidate[i] : i];
        if (d < HUGE_VAL) reach = fmax(reach, d);
    }
    if (reach == 0) reach = 1;  // a single candidate: its distance is 0
    double size = def->noise_length > 0 ? def->noise_length : 0.25 * reach;
    OmVec3 np = om_load3(normal, center);
    for (int i = 0; i < n; i++) {
        int v = candidate ? candidate[i] : i;
        OmVec3 nq = om_load3(normal, v);
        // unreachable vertices get twice the largest distance
        double d = fmin(distance[v] / reach, 2);
        double angle = atan2(om_norm(om_cross(np, nq)), om_dot(np, nq)) / OM_PI;
        double noise =
            0.5 + 0.5 * om_noise_perlin(om_scale(1 / size, om_load3(s->x, v)), def->seed);
        ranked[i] = (Ranked){w_d * d + w_n * angle + w_p * noise, v};
    }
}

OmStatus om_surface_random_patch(const OmSurface* surface, const int* candidate, int ncandidate,
                                 const OmPatchDef* def, int** vert, int* nvert) {
    OmStatus status = OM_OK;
    double *distance = NULL, *normal = NULL;
    Ranked* ranked = NULL;
    *vert = NULL;
    *nvert = 0;
    int n = candidate ? ncandidate : surface->nvert;
    OM_TRY(check_patch(surface, candidate, n, def));
    OmRng rng = om_rng_init(def->seed, 0);
    int drawn = (int)om_rng_below(&rng, (uint32_t)n);
    int center = def->center >= 0 ? def->center : candidate ? candidate[drawn] : drawn;
    OM_ALLOC_DONE(distance, surface->nvert);
    if (!def->normal) OM_ALLOC_DONE(normal, 3 * (size_t)surface->nvert);
    OM_ALLOC_DONE(ranked, n);
    OM_TRY_DONE(om_surface_geodesic(surface, center, distance));
    if (!def->normal) om_surface_normals(surface, normal);
    rank_candidates(surface, candidate, n, def, &rng, center, distance,
                    def->normal ? def->normal : normal, ranked);
    qsort(ranked, (size_t)n, sizeof *ranked, compare_ranked);
    int take = (int)(def->share * n + 0.5);
    OM_ALLOC_DONE(*vert, take);
    for (int i = 0; i < take; i++) (*vert)[i] = ranked[i].vert;
    om_sort_ints(*vert, take);
    *nvert = take;
done:
    om_free(distance);
    om_free(normal);
    om_free(ranked);
    return status;
}
