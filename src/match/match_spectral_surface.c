// match_spectral_surface.c: a functional map to points on triangles.
//
// The vertices of a are points of spectral space, so its triangles are flat triangles there (Ezuz and Ben-Chen,
// "Deblurring and Denoising of Maps between Shapes", 2017). A row of b goes to the nearest point of the triangles
// around its nearest vertex; triangles elsewhere are not searched. A triangle and the point are laid out in space with
// the same distances, for om_triangle_closest.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"
#include "omentum/shape_closest.h"

typedef struct Search {
    const OmSpectralBasis *a, *b;
    const OmSurface* surface;
    int nb;
    const double* image;    // of a's rows                                   (a->nrow x nb)
    const int* partner;     // row of a for each row of b, or -1
    const int *adr, *list;  // triangles around each vertex of the surface
    int* tri;
    double* bary;
} Search;

static double dot(int n, const double* p, const double* p0, const double* q, const double* q0) {
    double sum = 0;
    for (int k = 0; k < n; ++k) sum += (p[k] - p0[k]) * (q[k] - q0[k]);
    return sum;
}

// Squared distance of q to the triangle of the rows p[0], p[1], p[2].
static double triangle_distance(int n, const double* const p[3], const double* q, double bary[3]) {
    double g11 = dot(n, p[1], p[0], p[1], p[0]), g12 = dot(n, p[1], p[0], p[2], p[0]);
    double g22 = dot(n, p[2], p[0], p[2], p[0]), dd = dot(n, q, p[0], q, p[0]);
    double h1 = dot(n, p[1], p[0], q, p[0]), h2 = dot(n, p[2], p[0], q, p[0]);
    // 0, b on the first axis, c in the plane, q above it; a flat triangle has no second axis
    double bx = sqrt(g11), cx = bx > 0 ? g12 / bx : 0, x = bx > 0 ? h1 / bx : 0;
    double cy = sqrt(fmax(0, g22 - cx * cx)), y = cy > 1e-9 * sqrt(g22) ? (h2 - cx * x) / cy : 0;
    OmVec3 at = om_vec3(x, y, sqrt(fmax(0, dd - x * x - y * y)));
    OmVec3 nearest =
        om_triangle_closest(at, om_vec3(0, 0, 0), om_vec3(bx, 0, 0), om_vec3(cx, cy, 0), bary);
    return om_norm2(om_sub(at, nearest));
}

static void search_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Search* s = ctx;
    for (int j = begin; j < end; ++j) {
        if (s->partner[j] < 0) continue;
        const double* q = s->b->phi + (size_t)j * (size_t)s->b->npair;
        int v = s->a->vert[s->partner[j]], out = s->b->vert[j];
        double smallest = INFINITY;
        for (int k = s->adr[v]; k < s->adr[v + 1]; ++k) {
            const int* corner = s->surface->tri_vert + 3 * (size_t)s->list[k];
            const double* p[3];
            double bary[3];
            for (int c = 0; c < 3; ++c)
                p[c] = s->image + (size_t)s->a->row[corner[c]] * (size_t)s->nb;
            double d2 = triangle_distance(s->nb, p, q, bary);
            if (d2 >= smallest) continue;
            smallest = d2;
            s->tri[out] = s->list[k];
            memcpy(s->bary + 3 * (size_t)out, bary, sizeof bary);
        }
    }
}

static OmStatus check_surface(const OmSpectralBasis* a, const OmSurface* surface) {
    OM_CHECK(surface->nvert == a->nvert, OM_INVALID,
             "spectral map: the surface has %d vertices, its basis %d", surface->nvert, a->nvert);
    for (int k = 0; k < 3 * surface->ntri; ++k)
        OM_CHECK(surface->tri_vert[k] >= 0 && surface->tri_vert[k] < surface->nvert, OM_INVALID,
                 "spectral map: triangle %d has vertex %d of %d", k / 3, surface->tri_vert[k],
                 surface->nvert);
    return OM_OK;
}

// Triangles around each vertex; only those whose corners all have a row.
static void list_triangles(const OmSpectralBasis* a, const OmSurface* surface, int* adr,
                           int* list) {
    for (int pass = 0; pass < 2; ++pass) {
        for (int t = 0; t < surface->ntri; ++t) {
            const int* v = surface->tri_vert + 3 * (size_t)t;
            if (a->row[v[0]] < 0 || a->row[v[1]] < 0 || a->row[v[2]] < 0) continue;
            for (int c = 0; c < 3; ++c) {
                if (pass == 0) ++adr[v[c] + 1];
                if (pass == 1) list[adr[v[c]]++] = t;
            }
        }
        for (int i = 0; i < surface->nvert && pass == 0; ++i) adr[i + 1] += adr[i];
    }
    for (int i = surface->nvert; i > 0; --i) adr[i] = adr[i - 1];
    adr[0] = 0;
}

OmStatus om_spectral_map_to_surface(const OmSpectralDef* def, const OmSpectralBasis* a,
                                    const OmSurface* surface, const OmSpectralBasis* b,
                                    const int* map, int* tri, double* bary) {
    OM_TRY(om__spectral_check(def, a, b));
    OM_TRY(check_surface(a, surface));
    OmStatus status = OM_OK;
    int nknown, *partner = NULL, *adr = NULL, *list = NULL, nb = def->last;
    double *C = NULL, *image = NULL;
    while (nb > def->first && om__spectral_count(def, a, b, nb) > a->npair) --nb;
    int na = om__spectral_count(def, a, b, nb);
    OM_ALLOC_DONE(partner, b->nrow);
    OM_TRY_DONE(om__spectral_rows(a, b, map, partner, &nknown));
    OM_CHECK_DONE(nknown >= def->first, OM_INVALID,
                  "spectral map: %d vertices have a partner; %d functions need as many", nknown,
                  def->first);
    OM_CALLOC_DONE(adr, (size_t)surface->nvert + 1);
    OM_ALLOC_DONE(list, 3 * (size_t)surface->ntri);
    OM_ALLOC_DONE(C, (size_t)na * (size_t)nb);
    OM_ALLOC_DONE(image, (size_t)a->nrow * (size_t)nb);
    list_triangles(a, surface, adr, list);
    OM_TRY_DONE(om__spectral_matrix(a, b, partner, na, nb, C));
    om__spectral_embed(def, a, b, na, nb, C, image);
    for (int i = 0; i < b->nvert; ++i) tri[i] = -1;
    memset(bary, 0, 3 * (size_t)b->nvert * sizeof *bary);
    Search s = {a, b, surface, nb, image, partner, adr, list, tri, bary};
    om_parallel_for(def->nworker, b->nrow, 64, search_rows, &s);
done:
    om_free(partner);
    om_free(adr);
    om_free(list);
    om_free(C);
    om_free(image);
    return status;
}
