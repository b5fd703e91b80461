// match_basis.c: the smallest eigenvectors of the Laplacian of a surface or a scan.
//
// Vertices without an area have no row. The shift lies a tenth of 4 pi / area below 0: by Weyl's law the eigenvalues of
// a surface lie about 4 pi / area apart, so the smallest one, 0, is as well conditioned as the others.
//
// Every connected piece has an eigenvalue 0 of its own, and a crumb of a few triangles has no other small ones. Crumbs
// of scans would take the functions away from the tissue: 40 of them leave 20 of 60.
#include <math.h>
#include <string.h>

#include "match/match_spectral_internal.h"

#define PI 3.14159265358979323846
#define CRUMB 0.01  // share of the area below which a piece of a scan or of a part is left out

void om_spectral_basis_done(OmSpectralBasis* basis) {
    if (!basis) return;
    om_free(basis->vert);
    om_free(basis->row);
    om_free(basis->area);
    om_free(basis->eigenvalue);
    om_free(basis->phi);
    memset(basis, 0, sizeof *basis);
}

// The piece of each vertex, named by its first vertex: breadth first over the matrix.
static OmStatus find_pieces(const OmCsr* A, int* piece) {
    int* queue;
    OM_ALLOC(queue, A->n);
    for (int i = 0; i < A->n; ++i) piece[i] = -1;
    for (int first = 0; first < A->n; ++first) {
        if (piece[first] >= 0) continue;
        int num = 0;
        piece[first] = first;
        queue[num++] = first;
        for (int head = 0; head < num; ++head)
            for (int k = A->row_adr[queue[head]]; k < A->row_adr[queue[head] + 1]; ++k) {
                int j = A->col[k];
                if (piece[j] >= 0) continue;
                piece[j] = first;
                queue[num++] = j;
            }
    }
    om_free(queue);
    return OM_OK;
}

// Vertices of pieces below `min_share` of the area get the area 0.
static OmStatus drop_crumbs(OmLaplacian* laplacian, double min_share) {
    OmStatus status = OM_OK;
    int n = laplacian->stiffness.n, *piece = NULL;
    double *area = NULL, total = 0;
    OM_ALLOC_DONE(piece, n);
    OM_CALLOC_DONE(area, n);
    OM_TRY_DONE(find_pieces(&laplacian->stiffness, piece));
    for (int i = 0; i < n; ++i) area[piece[i]] += laplacian->area[i];
    for (int i = 0; i < n; ++i) {
        if (area[piece[i]] < min_share * laplacian->total_area) laplacian->area[i] = 0;
        total += laplacian->area[i];
    }
    OM_CHECK_DONE(total > 0, OM_INVALID, "spectral basis: no connected piece has %g %% of the area",
                  100 * min_share);
    laplacian->total_area = total;
done:
    om_free(piece);
    om_free(area);
    return status;
}

static OmStatus number_rows(const OmLaplacian* laplacian, OmSpectralBasis* basis) {
    int n = laplacian->stiffness.n;
    OM_ALLOC(basis->vert, n);
    OM_ALLOC(basis->row, n);
    OM_ALLOC(basis->area, n);
    basis->nvert = n;
    for (int i = 0; i < n; ++i) {
        basis->row[i] = laplacian->area[i] > 0 ? basis->nrow : -1;
        if (basis->row[i] < 0) continue;
        basis->vert[basis->nrow] = i;
        basis->area[basis->nrow++] = laplacian->area[i];
    }
    basis->total_area = laplacian->total_area;
    return OM_OK;
}

// The matrix without vertices that have no area: no triangle uses them, so their rows and columns are zero.
static OmStatus remove_unused(const OmCsr* A, const OmSpectralBasis* basis, OmCsr* out) {
    OmStatus status = OM_OK;
    int nentry = A->row_adr[A->n], num = 0, *row = NULL, *col = NULL;
    double* value = NULL;
    OM_ALLOC_DONE(row, nentry);
    OM_ALLOC_DONE(col, nentry);
    OM_ALLOC_DONE(value, nentry);
    for (int i = 0; i < A->n; ++i)
        for (int k = A->row_adr[i]; k < A->row_adr[i + 1]; ++k) {
            if (basis->row[i] < 0 || basis->row[A->col[k]] < 0) continue;
            row[num] = basis->row[i];
            col[num] = basis->row[A->col[k]];
            value[num++] = A->value[k];
        }
    OM_TRY_DONE(om_csr_init(basis->nrow, num, row, col, value, out));
done:
    om_free(row);
    om_free(col);
    om_free(value);
    return status;
}

static OmStatus find_pairs(const OmLaplacian* laplacian, int npair, OmSpectralBasis* basis) {
    OmStatus status = OM_OK;
    OmCsr A = {0}, B = {0};
    double* vector = NULL;
    OM_TRY_DONE(number_rows(laplacian, basis));
    size_t n = (size_t)basis->nrow, k = (size_t)npair;
    OM_CHECK_DONE(
        npair >= 1 && npair < basis->nrow, OM_INVALID,
        "spectral basis: %d functions of %d vertices in use; 1 or more, fewer than vertices", npair,
        basis->nrow);
    basis->npair = npair;
    OM_TRY_DONE(remove_unused(&laplacian->stiffness, basis, &A));
    OM_TRY_DONE(om_csr_init_diagonal(basis->nrow, basis->area, &B));
    OM_ALLOC_DONE(vector, n * k);
    OM_ALLOC_DONE(basis->phi, n * k);
    OM_ALLOC_DONE(basis->eigenvalue, k);
    OmEigenDef def = om_eigen_default_def(npair, -0.4 * PI / basis->total_area);
    status = om_eigen_smallest(&def, &A, &B, basis->eigenvalue, vector, NULL);
    if (status != OM_OK) goto done;
    double scale = sqrt(basis->total_area);  // mean square 1
    for (size_t i = 0; i < n; ++i)
        for (size_t p = 0; p < k; ++p) basis->phi[i * k + p] = scale * vector[p * n + i];
done:
    om_csr_done(&A);
    om_csr_done(&B);
    om_free(vector);
    return status;
}

static OmStatus finish(OmStatus status, OmLaplacian* laplacian, double start,
                       OmSpectralBasis* basis) {
    om_laplacian_done(laplacian);
    if (status == OM_OK)
        basis->seconds = om_clock_now() - start;
    else
        om_spectral_basis_done(basis);
    return status;
}

OmStatus om_spectral_basis_init(const OmSurface* surface, int npair, OmSpectralBasis* basis) {
    memset(basis, 0, sizeof *basis);
    double start = om_clock_now();
    OmLaplacian L;
    OM_TRY(om_laplacian_init(surface->nvert, surface->x, surface->ntri, surface->tri_vert, &L));
    return finish(find_pairs(&L, npair, basis), &L, start, basis);
}

OmStatus om_spectral_basis_init_part(const OmSurface* surface, const unsigned char* is_used,
                                     int npair, OmSpectralBasis* basis) {
    memset(basis, 0, sizeof *basis);
    double start = om_clock_now();
    OmLaplacian L = {0};
    OmStatus status = OM_OK;
    int ntri = 0, *tri_vert = NULL;
    OM_ALLOC_DONE(tri_vert, 3 * (size_t)surface->ntri);
    for (int t = 0; t < surface->ntri; ++t) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        if (is_used[v[0]] && is_used[v[1]] && is_used[v[2]])
            memcpy(tri_vert + 3 * (size_t)ntri++, v, 3 * sizeof *v);
    }
    OM_TRY_DONE(om_laplacian_init(surface->nvert, surface->x, ntri, tri_vert, &L));
    OM_TRY_DONE(drop_crumbs(&L, CRUMB));
    status = find_pairs(&L, npair, basis);
done:
    om_free(tri_vert);
    return finish(status, &L, start, basis);
}

OmStatus om_spectral_basis_init_scan(const OmScan* scan, int npair, OmSpectralBasis* basis) {
    memset(basis, 0, sizeof *basis);
    double start = om_clock_now();
    OmLaplacian L;
    if (scan->ntri > 0)
        OM_TRY(om_laplacian_init(scan->npoint, scan->x, scan->ntri, scan->tri_vert, &L));
    else
        OM_TRY(om_laplacian_init_cloud(scan->npoint, scan->x, scan->normal, &L));
    OmStatus status = drop_crumbs(&L, CRUMB);
    if (status == OM_OK) status = find_pairs(&L, npair, basis);
    return finish(status, &L, start, basis);
}
