// match_spectral.c: functional maps and ZoomOut.
//
// Functions have mean square 1, so a map that keeps areas has an orthogonal C = mean over b of phi_b^T phi_a(map), and
// the rows of phi_a C^T lie on those of phi_b (Melzi, Ren, Rodola, Sharma, Wonka and Ovsjanikov, "ZoomOut: Spectral
// Upsampling for Efficient Shape Correspondence", 2019, eq. 5 and 6). If b is a part of a (Rodola, Cosmo, Bronstein,
// Torsello and Cremers, "Partial Functional Correspondence", 2017), a has about area_a / area_b times as many functions
// below the same frequency: C is slanted, its rows are orthogonal, and the rows of phi_a C^T are too
// long by the ratio of the areas.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"
#include "omentum/shape_points.h"

#define SPECTRAL_COOKIE 0x4f6d5370u

OmSpectralDef om_spectral_default_def(void) {
    return (OmSpectralDef){.first = 10, .last = 60, .step = 5, .cookie = SPECTRAL_COOKIE};
}

static OmStatus check_counts(const OmSpectralBasis* a, const OmSpectralBasis* b, int na, int nb) {
    OM_CHECK(na >= 1 && na <= a->npair && nb >= 1 && nb <= b->npair, OM_INVALID,
             "spectral map: %d functions of a and %d of b; the bases have %d and %d", na, nb,
             a->npair, b->npair);
    return OM_OK;
}

OmStatus om__spectral_rows(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* map,
                           int* partner, int* nknown) {
    *nknown = 0;
    for (int j = 0; j < b->nrow; ++j) {
        int v = map[b->vert[j]];
        OM_CHECK(v >= -1 && v < a->nvert, OM_INVALID,
                 "spectral map: vertex %d belongs to vertex %d of %d", b->vert[j], v, a->nvert);
        partner[j] = v < 0 ? -1 : a->row[v];
        *nknown += partner[j] >= 0;
    }
    return OM_OK;
}

static void vertices_of_rows(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* partner,
                             int* map) {
    for (int i = 0; i < b->nvert; ++i) map[i] = b->row[i] < 0 ? -1 : a->vert[partner[b->row[i]]];
}

// ---- matrix and map ---------------------------------------------------------------------------------

OmStatus om__spectral_matrix(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* partner,
                             int na, int nb, double* C) {
    OmStatus status = OM_OK;
    bool is_whole = true;
    size_t n = (size_t)b->nrow, ka = (size_t)na, kb = (size_t)nb;
    double *image = NULL, *weighted = NULL, *M = NULL, *r = NULL;
    OM_CALLOC_DONE(image, n * ka);
    for (size_t j = 0; j < n; ++j) {
        is_whole = is_whole && partner[j] >= 0;
        if (partner[j] < 0) continue;
        const double* row = a->phi + (size_t)partner[j] * (size_t)a->npair;
        double w = b->area[j] / b->total_area;
        for (size_t c = 0; c < ka; ++c) image[j * ka + c] = w * row[c];
    }
    om__product_tn(b->nrow, nb, na, b->phi, b->npair, image, C);
    if (is_whole) goto done;
    OM_CALLOC_DONE(weighted, n * kb);
    OM_ALLOC_DONE(M, kb * kb);
    OM_ALLOC_DONE(r, kb * ka);
    for (size_t j = 0; j < n; ++j)
        for (size_t c = 0; c < kb && partner[j] >= 0; ++c)
            weighted[j * kb + c] = b->area[j] / b->total_area * b->phi[j * (size_t)b->npair + c];
    om__product_tn(b->nrow, nb, nb, b->phi, b->npair, weighted, M);
    for (size_t c = 0; c < kb; ++c) M[c * kb + c] += 1e-6;  // functions that live on unknown rows
    for (size_t i = 0; i < kb; ++i)
        for (size_t c = 0; c < ka; ++c) r[c * kb + i] = C[i * ka + c];
    OM_CHECK_DONE(om__dense_solve(nb, M, na, r), OM_INVALID,
                  "spectral map: the known vertices do not determine %d functions", nb);
    for (size_t i = 0; i < kb; ++i)
        for (size_t c = 0; c < ka; ++c) C[i * ka + c] = r[c * kb + i];
done:
    om_free(image);
    om_free(weighted);
    om_free(M);
    om_free(r);
    return status;
}

void om__spectral_embed(const OmSpectralDef* def, const OmSpectralBasis* a,
                        const OmSpectralBasis* b, int na, int nb, const double* C, double* image) {
    double scale = def->is_partial ? b->total_area / a->total_area : 1;
    om__product_nt(a->nrow, na, nb, scale, a->phi, a->npair, C, image);
}

static OmStatus make_map(const OmSpectralDef* def, const OmSpectralBasis* a,
                         const OmSpectralBasis* b, int na, int nb, const double* C, int* partner) {
    OmStatus status = OM_OK;
    double* image = NULL;
    OM_ALLOC_DONE(image, (size_t)a->nrow * (size_t)nb);
    om__spectral_embed(def, a, b, na, nb, C, image);
    OM_TRY_DONE(
        om__nearest_rows(a->nrow, image, b->nrow, b->phi, b->npair, nb, def->nworker, partner));
done:
    om_free(image);
    return status;
}

OmStatus om_spectral_get_matrix(const OmSpectralBasis* a, const OmSpectralBasis* b, const int* map,
                                int na, int nb, double* C) {
    OM_TRY(check_counts(a, b, na, nb));
    OmStatus status = OM_OK;
    int nknown, *partner = NULL;
    OM_ALLOC_DONE(partner, b->nrow);
    OM_TRY_DONE(om__spectral_rows(a, b, map, partner, &nknown));
    OM_CHECK_DONE(nknown > 0, OM_INVALID, "spectral map: no vertex has a partner");
    OM_TRY_DONE(om__spectral_matrix(a, b, partner, na, nb, C));
done:
    om_free(partner);
    return status;
}

OmStatus om_spectral_map_from_matrix(const OmSpectralDef* def, const OmSpectralBasis* a,
                                     const OmSpectralBasis* b, int na, int nb, const double* C,
                                     int* map) {
    OM_CHECK(def->cookie == SPECTRAL_COOKIE, OM_INVALID,
             "OmSpectralDef was not made by om_spectral_default_def");
    OM_TRY(check_counts(a, b, na, nb));
    for (int k = 0; k < na * nb; ++k)
        OM_CHECK(isfinite(C[k]), OM_INVALID, "spectral map: entry %d of the matrix is %g", k, C[k]);
    OmStatus status = OM_OK;
    int* partner = NULL;
    OM_ALLOC_DONE(partner, b->nrow);
    OM_TRY_DONE(make_map(def, a, b, na, nb, C, partner));
    vertices_of_rows(a, b, partner, map);
done:
    om_free(partner);
    return status;
}

// ---- ZoomOut ----------------------------------------------------------------------------------------

int om__spectral_count(const OmSpectralDef* def, const OmSpectralBasis* a, const OmSpectralBasis* b,
                       int nb) {
    if (!def->is_partial) return nb;
    double top = b->eigenvalue[nb - 1];
    if (a->eigenvalue[a->npair - 1] < top) return INT32_MAX;
    int na = 0;
    while (na < a->npair && a->eigenvalue[na] <= top) ++na;
    return na > nb ? na : nb;
}

static double orthogonality(const double* C, int na, int nb, double scale) {
    double sum = 0;
    int n = na < nb ? na : nb;  // of rows or columns, whichever are fewer
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            double dot = 0;
            if (nb <= na)
                for (int c = 0; c < na; ++c) dot += C[i * na + c] * C[j * na + c];
            else
                for (int c = 0; c < nb; ++c) dot += C[c * na + i] * C[c * na + j];
            double error = scale * dot - (i == j);
            sum += error * error;
        }
    return sqrt(sum / n);
}

OmStatus om__spectral_check(const OmSpectralDef* def, const OmSpectralBasis* a,
                            const OmSpectralBasis* b) {
    OM_CHECK(def->cookie == SPECTRAL_COOKIE, OM_INVALID,
             "OmSpectralDef was not made by om_spectral_default_def");
    OM_CHECK(def->first >= 1 && def->last >= def->first, OM_INVALID,
             "OmSpectralDef: rounds from %d to %d functions; 1 <= first <= last", def->first,
             def->last);
    OM_CHECK(def->step >= 1, OM_INVALID, "OmSpectralDef.step is %d; 1 or more", def->step);
    OM_CHECK(def->last <= b->npair && (def->is_partial || def->last <= a->npair), OM_INVALID,
             "OmSpectralDef.last is %d; the bases have %d and %d functions", def->last, a->npair,
             b->npair);
    int first = om__spectral_count(def, a, b, def->first);
    OM_CHECK(first <= a->npair, OM_INVALID,
             "spectral map: the basis of a has %d functions, too few for %d of its part b",
             a->npair, def->first);
    return OM_OK;
}

OmStatus om_spectral_zoomout(const OmSpectralDef* def, const OmSpectralBasis* a,
                             const OmSpectralBasis* b, int* map, OmSpectralReport* report) {
    OmSpectralReport own = {0};
    if (!report) report = &own;
    *report = own;
    double start = om_clock_now();
    OM_TRY(om__spectral_check(def, a, b));
    OmStatus status = OM_OK;
    int nknown, *partner = NULL;
    double *C = NULL, scale = def->is_partial ? b->total_area / a->total_area : 1;
    OM_ALLOC_DONE(partner, b->nrow);
    OM_ALLOC_DONE(C, (size_t)a->npair * (size_t)b->npair);
    OM_TRY_DONE(om__spectral_rows(a, b, map, partner, &nknown));
    OM_CHECK_DONE(nknown >= def->first, OM_INVALID,
                  "spectral map: %d vertices have a partner; %d functions need as many", nknown,
                  def->first);
    for (int nb = def->first;;) {
        int na = om__spectral_count(def, a, b, nb);
        if (na > a->npair) break;
        OM_TRY_DONE(om__spectral_matrix(a, b, partner, na, nb, C));
        OM_TRY_DONE(make_map(def, a, b, na, nb, C, partner));
        report->npair_a = na;
        report->npair_b = nb;
        ++report->nround;
        if (nb == def->last) break;
        nb = def->step < def->last - nb ? nb + def->step : def->last;
    }
    report->orthogonality = orthogonality(C, report->npair_a, report->npair_b, scale);
    vertices_of_rows(a, b, partner, map);
    report->seconds = om_clock_now() - start;
done:
    om_free(partner);
    om_free(C);
    return status;
}

// ---- first maps -------------------------------------------------------------------------------------

OmStatus om_spectral_map_from_nearest(const OmSpectralBasis* a, const double* x_a,
                                      const OmSpectralBasis* b, const double* x_b, int* map) {
    OmStatus status = OM_OK;
    OmPointTree* tree = NULL;
    double* x = NULL;
    OM_ALLOC_DONE(x, 3 * (size_t)a->nrow);
    for (int i = 0; i < a->nrow; ++i) om_store3(x, i, om_load3(x_a, a->vert[i]));
    for (int i = 0; i < b->nrow; ++i)
        OM_CHECK_DONE(om_is_finite3(om_load3(x_b, b->vert[i])), OM_INVALID,
                      "spectral map: vertex %d is not finite", b->vert[i]);
    OM_TRY_DONE(om_point_tree_create(a->nrow, x, &tree));
    for (int i = 0; i < b->nvert; ++i)
        map[i] = b->row[i] < 0 ? -1 : a->vert[om_point_tree_find(tree, om_load3(x_b, i), NULL)];
done:
    om_point_tree_destroy(tree);
    om_free(x);
    return status;
}
