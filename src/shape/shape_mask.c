// shape_mask.c: segmentations on voxels: cropping, connected parts, holes, closing.
//
// Connected parts are found with a union-find over runs of voxels along i, so a label map of 75 million
// voxels takes a second and no recursion. Closing is a distance transform (Felzenszwalb & Huttenlocher
// 2012) in space, axis by axis; it is exact on an oblique grid with orthogonal axes.
#include "shape/shape_internal.h"

#include <stdlib.h>
#include <string.h>

OmStatus om_mask_init(OmMask* mask, int nx, int ny, int nz) {
    memset(mask, 0, sizeof *mask);
    OM_CHECK(nx > 0 && ny > 0 && nz > 0, OM_INVALID, "a mask of %d x %d x %d voxels", nx, ny, nz);
    OM_CHECK((double)nx * ny * nz < 2147483647.0, OM_INVALID, "a mask of %d x %d x %d is too large",
             nx, ny, nz);
    mask->inside = om_calloc((size_t)nx * (size_t)ny * (size_t)nz, 1);
    if (!mask->inside) return OM_NO_MEMORY;
    mask->grid.dim[0] = nx;
    mask->grid.dim[1] = ny;
    mask->grid.dim[2] = nz;
    mask->grid.axis = om_mat3_identity();
    return OM_OK;
}

void om_mask_done(OmMask* mask) {
    if (!mask) return;
    om_free(mask->inside);
    memset(mask, 0, sizeof *mask);
}

int64_t om_mask_count(const OmMask* mask) {
    int64_t count = 0;
    size_t n = om_grid_count(mask->grid.dim);
    for (size_t v = 0; v < n; v++) count += mask->inside[v] != 0;
    return count;
}

double om_mask_volume(const OmMask* mask) {
    return (double)om_mask_count(mask) * fabs(om_mat3_det(mask->grid.axis));
}

// ---- crop -------------------------------------------------------------------------------------------------

static bool row_extent(const unsigned char* row, int n, int* first, int* last) {
    int a = 0, b = n - 1;
    while (a < n && !row[a]) a++;
    if (a == n) return false;
    while (!row[b]) b--;
    if (a < *first) *first = a;
    if (b > *last) *last = b;
    return true;
}

OmStatus om_mask_crop(OmMask* mask, int pad) {
    OM_CHECK(pad >= 0, OM_INVALID, "a mask cannot be padded by %d voxels", pad);
    const int *dim = mask->grid.dim, none = 1 << 30;
    int lo[3] = {none, none, none}, hi[3] = {-1, -1, -1};
    for (int k = 0; k < dim[2]; k++) {
        for (int j = 0; j < dim[1]; j++) {
            const unsigned char* row = &mask->inside[om_grid_index(dim, 0, j, k)];
            if (!row_extent(row, dim[0], &lo[0], &hi[0])) continue;
            if (j < lo[1]) lo[1] = j;
            if (j > hi[1]) hi[1] = j;
            if (k < lo[2]) lo[2] = k;
            hi[2] = k;
        }
    }
    OM_CHECK(hi[0] >= 0, OM_INVALID, "the mask is empty");
    OmMask out;
    OM_TRY(om_mask_init(&out, hi[0] - lo[0] + 1 + 2 * pad, hi[1] - lo[1] + 1 + 2 * pad,
                        hi[2] - lo[2] + 1 + 2 * pad));
    for (int k = lo[2]; k <= hi[2]; k++) {
        for (int j = lo[1]; j <= hi[1]; j++) {
            size_t to = om_grid_index(out.grid.dim, pad, j - lo[1] + pad, k - lo[2] + pad);
            size_t from = om_grid_index(dim, lo[0], j, k);
            memcpy(&out.inside[to], &mask->inside[from], (size_t)(hi[0] - lo[0] + 1));
        }
    }
    OmVec3 shift = om_vec3(lo[0] - pad, lo[1] - pad, lo[2] - pad);
    out.grid.axis = mask->grid.axis;
    out.grid.origin = om_voxel_grid_point(&mask->grid, shift);
    om_mask_done(mask);
    *mask = out;
    return OM_OK;
}

// ---- parts --------------------------------------------------------------------------------------------------

typedef struct Run {  // voxels [begin, end) of one row, all of one kind
    int begin, end;
    int parent;  // union-find; a root names itself
    int64_t size;
} Run;

typedef struct RunTable {
    Run* run;
    int nrun;
    int* row_adr;  // first run of each row, and the end            (nrow + 1)
} RunTable;

static void run_table_done(RunTable* t) {
    om_free(t->run);
    om_free(t->row_adr);
}

// The runs of voxels whose inside == kind.
static OmStatus find_runs(const OmMask* m, unsigned char kind, RunTable* t) {
    memset(t, 0, sizeof *t);
    int nrow = m->grid.dim[1] * m->grid.dim[2], nx = m->grid.dim[0];
    t->row_adr = om_alloc((size_t)nrow + 1, sizeof(int));
    if (!t->row_adr) return OM_NO_MEMORY;
    for (int pass = 0; pass < 2; pass++) {
        int n = 0;
        for (int r = 0; r < nrow; r++) {
            const unsigned char* row = &m->inside[(size_t)r * (size_t)nx];
            t->row_adr[r] = n;
            for (int i = 0; i < nx;) {
                if (row[i] != kind) {
                    i++;
                    continue;
                }
                int begin = i;
                while (i < nx && row[i] == kind) i++;
                if (pass) t->run[n] = (Run){begin, i, n, i - begin};
                n++;
            }
        }
        t->row_adr[nrow] = t->nrun = n;
        if (!pass) {
            t->run = om_alloc((size_t)n, sizeof(Run));
            if (!t->run) {
                om_free(t->row_adr);
                t->row_adr = NULL;
                return OM_NO_MEMORY;
            }
        }
    }
    return OM_OK;
}

static int find_root(Run* run, int r) {
    while (run[r].parent != r) {
        run[r].parent = run[run[r].parent].parent;
        r = run[r].parent;
    }
    return r;
}

// Join runs of two rows whose voxels are adjacent; `reach` is 1 where diagonal neighbours count.
static void join_rows(RunTable* t, int row_a, int row_b, int reach) {
    int a = t->row_adr[row_a], b = t->row_adr[row_b];
    while (a < t->row_adr[row_a + 1] && b < t->row_adr[row_b + 1]) {
        Run *ra = &t->run[a], *rb = &t->run[b];
        if (ra->begin < rb->end + reach && rb->begin < ra->end + reach) {
            int x = find_root(t->run, a), y = find_root(t->run, b);
            if (x != y) {
                int root = x < y ? x : y, child = x < y ? y : x;
                t->run[child].parent = root;
                t->run[root].size += t->run[child].size;
            }
        }
        if (ra->end < rb->end)
            a++;
        else
            b++;
    }
}

static void join_runs(const OmMask* m, RunTable* t, int connectivity) {
    int ny = m->grid.dim[1], nz = m->grid.dim[2], reach = connectivity == 26;
    for (int k = 0; k < nz; k++) {
        for (int j = 0; j < ny; j++) {
            int r = j + ny * k;
            if (j > 0) join_rows(t, r, r - 1, reach);
            if (k > 0) join_rows(t, r, r - ny, reach);
            if (reach && k > 0 && j > 0) join_rows(t, r, r - ny - 1, reach);
            if (reach && k > 0 && j < ny - 1) join_rows(t, r, r - ny + 1, reach);
        }
    }
}

static OmStatus find_parts(const OmMask* mask, int connectivity, RunTable* t) {
    OM_CHECK(connectivity == 6 || connectivity == 26, OM_INVALID,
             "connectivity is %d; it can be 6 or 26", connectivity);
    OM_TRY(find_runs(mask, 1, t));
    join_runs(mask, t, connectivity);
    return OM_OK;
}

typedef struct Part {
    int root;  // the run of its first voxel
    int64_t size;
} Part;

static int compare_parts(const void* a, const void* b) {
    const Part *p = a, *q = b;
    if (p->size != q->size) return p->size < q->size ? 1 : -1;
    return (p->root > q->root) - (p->root < q->root);
}

// The parts of a table, the largest first.
static OmStatus sort_parts(const RunTable* t, Part** part, int* npart) {
    int n = 0;
    for (int r = 0; r < t->nrun; r++) n += t->run[r].parent == r;
    *npart = n;
    OM_ALLOC(*part, n);
    n = 0;
    for (int r = 0; r < t->nrun; r++)
        if (t->run[r].parent == r) (*part)[n++] = (Part){r, t->run[r].size};
    qsort(*part, (size_t)n, sizeof **part, compare_parts);
    return OM_OK;
}

OmStatus om_mask_list_parts(const OmMask* mask, int connectivity, int64_t* size, int max,
                            int* nfound) {
    RunTable t;
    Part* part = NULL;
    OM_TRY(find_parts(mask, connectivity, &t));
    OmStatus status = sort_parts(&t, &part, nfound);
    for (int i = 0; status == OM_OK && i < *nfound && i < max; i++) size[i] = part[i].size;
    om_free(part);
    run_table_done(&t);
    return status;
}

OmStatus om_mask_choose_parts(OmMask* mask, int connectivity, const int* rank, int nrank) {
    RunTable t;
    Part* part = NULL;
    int npart = 0, nx = mask->grid.dim[0], row = 0;
    OM_TRY(find_parts(mask, connectivity, &t));
    OmStatus status = sort_parts(&t, &part, &npart);
    if (status < 0) goto done;
    for (int i = 0; i < nrank; i++) {
        OM_CHECK_DONE(rank[i] >= 1 && rank[i] <= npart, OM_INVALID,
                      "part %d: the mask has parts 1 to %d", rank[i], npart);
    }
    // marks the parts to keep
    for (int i = 0; i < nrank; i++) t.run[part[rank[i] - 1].root].size = -1;
    for (int r = 0; r < t.nrun; r++) {
        while (t.row_adr[row + 1] <= r) row++;
        if (t.run[find_root(t.run, r)].size < 0) continue;
        memset(&mask->inside[(size_t)row * (size_t)nx + (size_t)t.run[r].begin], 0,
               (size_t)(t.run[r].end - t.run[r].begin));
    }
done:
    om_free(part);
    run_table_done(&t);
    return status;
}

OmStatus om_mask_keep_parts(OmMask* mask, int connectivity, double min_share, int* nkept,
                            int* nfound) {
    RunTable t;
    OM_TRY(find_parts(mask, connectivity, &t));
    int nroot = 0, nkeep = 0, largest = -1;
    int64_t total = 0;
    for (int r = 0; r < t.nrun; r++) {
        if (t.run[r].parent != r) continue;
        nroot++;
        total += t.run[r].size;
        if (largest < 0 || t.run[r].size > t.run[largest].size) largest = r;
    }
    double min = min_share > 0 ? min_share * (double)total : 0;
    int nx = mask->grid.dim[0], row = 0;
    for (int r = 0; r < t.nrun; r++) {
        int root = find_root(t.run, r);
        bool keep = root == largest || (min_share > 0 && (double)t.run[root].size >= min);
        while (t.row_adr[row + 1] <= r) row++;
        if (keep)
            nkeep += root == r;
        else
            memset(&mask->inside[(size_t)row * (size_t)nx + (size_t)t.run[r].begin], 0,
                   (size_t)(t.run[r].end - t.run[r].begin));
    }
    run_table_done(&t);
    if (nkept) *nkept = nkeep;
    if (nfound) *nfound = nroot;
    return OM_OK;
}

OmStatus om_mask_fill_holes(OmMask* mask) {
    RunTable t;
    OM_TRY(find_runs(mask, 0, &t));
    join_runs(mask, &t, 6);
    int nx = mask->grid.dim[0], ny = mask->grid.dim[1], nz = mask->grid.dim[2];
    // a part of the outside that reaches the border gets a size of -1
    for (int row = 0; row < ny * nz; row++) {
        int j = row % ny, k = row / ny;
        bool is_edge = j == 0 || k == 0 || j == ny - 1 || k == nz - 1;
        for (int r = t.row_adr[row]; r < t.row_adr[row + 1]; r++) {
            if (is_edge || t.run[r].begin == 0 || t.run[r].end == nx) {
                t.run[find_root(t.run, r)].size = -1;
            }
        }
    }
    for (int row = 0; row < ny * nz; row++) {
        for (int r = t.row_adr[row]; r < t.row_adr[row + 1]; r++) {
            if (t.run[find_root(t.run, r)].size < 0) continue;
            memset(&mask->inside[(size_t)row * (size_t)nx + (size_t)t.run[r].begin], 1,
                   (size_t)(t.run[r].end - t.run[r].begin));
        }
    }
    run_table_done(&t);
    return OM_OK;
}

// ---- closing ----------------------------------------------------------------------------------------------------

#define FAR 1e15  // m^2; beyond any distance, and its square still finite

// Lower envelope of parabolas of one line of squared distances; spacing h; v, z, out are scratch of n + 1.
static void envelope(double* f, int n, double h, int* v, double* z, double* out) {
    int top = 0;
    v[0] = 0;
    z[0] = -FAR;
    z[1] = FAR;
    for (int q = 1; q < n; q++) {
        double s;
        for (;;) {  // ends at top == 0 if not before, because z[0] is below every s
            double xq = q * h, xp = v[top] * h;
            s = ((f[q] + xq * xq) - (f[v[top]] + xp * xp)) / (2 * (xq - xp));  // q > v: not zero
            if (s > z[top] || top == 0) break;
            top--;
        }
        if (s <= z[top]) s = z[top];
        v[++top] = q;
        z[top] = s;
        z[top + 1] = FAR;
    }
    int p = 0;
    for (int q = 0; q < n; q++) {
        while (z[p + 1] < q * h) p++;
        double e = (q - v[p]) * h;
        out[q] = fmin(e * e + f[v[p]], FAR);
    }
    memcpy(f, out, (size_t)n * sizeof *f);
}

// Squared distance to the voxels of one kind.
static OmStatus distance2(const OmMask* m, unsigned char kind, double* d2) {
    OmStatus status = OM_OK;
    const double h[3] = {om_norm(m->grid.axis.cx), om_norm(m->grid.axis.cy),
                         om_norm(m->grid.axis.cz)};
    size_t stride[3];
    om_grid_stride(m->grid.dim, stride);
    int longest = m->grid.dim[0] > m->grid.dim[1] ? m->grid.dim[0] : m->grid.dim[1];
    if (m->grid.dim[2] > longest) longest = m->grid.dim[2];
    double *line = NULL, *z = NULL, *out = NULL;
    int* v = NULL;
    OM_ALLOC_DONE(line, longest);
    OM_ALLOC_DONE(z, longest + 2);
    OM_ALLOC_DONE(out, longest);
    OM_ALLOC_DONE(v, longest + 1);
    size_t n = om_grid_count(m->grid.dim);
    for (size_t i = 0; i < n; i++) d2[i] = m->inside[i] == kind ? 0 : FAR;
    for (int a = 0; a < 3; a++) {
        int b = (a + 1) % 3, c = (a + 2) % 3;
        for (int y = 0; y < m->grid.dim[c]; y++) {
            for (int x = 0; x < m->grid.dim[b]; x++) {
                double* start = &d2[(size_t)x * stride[b] + (size_t)y * stride[c]];
                for (int i = 0; i < m->grid.dim[a]; i++) line[i] = start[(size_t)i * stride[a]];
                envelope(line, m->grid.dim[a], h[a], v, z, out);
                for (int i = 0; i < m->grid.dim[a]; i++) start[(size_t)i * stride[a]] = line[i];
            }
        }
    }
done:
    om_free(line);
    om_free(z);
    om_free(out);
    om_free(v);
    return status;
}

OmStatus om_mask_close(OmMask* mask, double radius) {
    OM_CHECK(radius >= 0 && isfinite(radius), OM_INVALID, "closing radius %g m", radius);
    if (radius == 0) return OM_OK;
    size_t n = om_grid_count(mask->grid.dim);
    double* d2 = om_alloc(n, sizeof *d2);
    if (!d2) return OM_NO_MEMORY;
    double r2 = radius * radius * (1 + 1e-9);  // a voxel at exactly the radius belongs to the ball
    OmStatus status = distance2(mask, 1, d2);
    if (status == OM_OK) {
        for (size_t i = 0; i < n; i++) mask->inside[i] = d2[i] <= r2;
        status = distance2(mask, 0, d2);
        for (size_t i = 0; i < n && status == OM_OK; i++) mask->inside[i] = d2[i] > r2;
    }
    om_free(d2);
    return status;
}
