// sense_stereo_match.c: semi-global matching of rectified pictures.
//
// H. Hirschmueller, Stereo processing by semiglobal matching and mutual information, PAMI 30(2), 2008. The cost of a
// candidate is the number of different bits of two census transforms (R. Zabih, J. Woodfill, ECCV 1994) in a window of
// 9 x 7 pixels: 62 bits, which do not change with brightness, so that light, vignette and gain of both pictures may
// differ. Along eight paths
//     L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min L(q, .) + P2) - min L(q, .),   q before p on the path.
// As min L(q, .) <= 62 and P2 <= 120, every L is below 183 and one byte holds it. Four paths come with the rows from
// above, four with those from below: two sweeps, which two workers may run at once. Data of a pixel lie together:
//     cost, sum    [row][column][candidate]          bytes, 16 bits
//     path         [column][guard, candidates, guard] of the row before, for each path
// The disparity with the least sum is kept if the next best is clearly worse, if the right picture agrees, and if it
// is not in a small patch of its own.
#include <stdlib.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "sense/sense_internal.h"
#include "sense/sense_stereo_internal.h"

#define CENSUS_X 4  // the window reaches so far on each side
#define CENSUS_Y 3
#define OUTSIDE 40     // cost of a candidate outside of the right picture
#define GUARD 190      // before and behind the candidates of a path: never the least
#define GUARD_SIZE 16  // bytes
#define NPATH 4        // of a sweep
#define MAX_STEP 1.0f  // pixels between neighbours of one patch

typedef unsigned char Byte;

typedef struct Match {
    const OmStereoDef* def;
    Rectified* r;
    uint64_t *left, *right;  // census
    Byte* cost;              // (height x width x ndisparity)
    uint16_t* sum[2];        // of each sweep; later sum[0] has that of both
    Byte* path[2];       // two rows for each of NPATH paths, each with a pixel more at both ends
    Byte* least[2];      // the least of each pixel of `path`
    float* other;        // disparities of the right picture
    int *stack, *patch;  // of the search for patches
} Match;

// ---- costs --------------------------------------------------------------------------------------------------------

static uint64_t census(const Rectified* r, const float* grey, int x, int y) {
    float middle = grey[(size_t)y * (size_t)r->width + (size_t)x];
    uint64_t bits = 0;
    for (int j = -CENSUS_Y; j <= CENSUS_Y; ++j) {
        int yy = y + j < 0 ? 0 : y + j >= r->height ? r->height - 1 : y + j;
        const float* row = &grey[(size_t)yy * (size_t)r->width];
        for (int i = -CENSUS_X; i <= CENSUS_X; ++i) {
            if (i == 0 && j == 0) continue;
            int xx = x + i < 0 ? 0 : x + i >= r->width ? r->width - 1 : x + i;
            bits = bits << 1 | (row[xx] < middle);
        }
    }
    return bits;
}

static void census_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    Match* m = ctx;
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < m->r->width; ++x) {
            size_t k = (size_t)y * (size_t)m->r->width + (size_t)x;
            m->left[k] = census(m->r, m->r->left, x, y);
            m->right[k] = census(m->r, m->r->right, x, y);
        }
}

static int count_bits(uint64_t v) {
    v -= v >> 1 & 0x5555555555555555u;
    v = (v & 0x3333333333333333u) + (v >> 2 & 0x3333333333333333u);
    v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return (int)(v * 0x0101010101010101u >> 56);
}

OM_MULTIVERSION
static void cost_row(Match* m, int y) {
    const Rectified* r = m->r;
    size_t first = (size_t)y * (size_t)r->width;
    for (int x = 0; x < r->width; ++x) {
        Byte* cost = &m->cost[(first + (size_t)x) * (size_t)r->ndisparity];
        uint64_t bits = m->left[first + (size_t)x];
        bool is_in = r->left[first + (size_t)x] >= 0;
        for (int k = 0; k < r->ndisparity; ++k) {
            int other = x - r->min_disparity - k;
            bool is_pair = is_in && other >= 0 && r->right[first + (size_t)other] >= 0;
            cost[k] = is_pair ? (Byte)count_bits(bits ^ m->right[first + (size_t)other]) : OUTSIDE;
        }
    }
}

static void cost_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int y = begin; y < end; ++y) cost_row(ctx, y);
}

// ---- paths --------------------------------------------------------------------------------------------------------

// One pixel of a path; returns the least value.
OM_INLINE Byte step_path(const Byte* restrict cost, const Byte* restrict before, Byte least, int n,
                         Byte one, Byte jump, Byte* restrict out) {
    Byte low = 255, top = (Byte)(least + jump);
    for (int k = 0; k < n; ++k) {
        Byte a = before[k], b = (Byte)(before[k - 1] + one), c = (Byte)(before[k + 1] + one);
        Byte v = a < b ? a : b;
        v = v < c ? v : c;
        v = v < top ? v : top;
        v = (Byte)(v - least + cost[k]);
        out[k] = v;
        low = v < low ? v : low;
    }
    return low;
}

// Sweep 0 goes down and right, sweep 1 up and left.
OM_MULTIVERSION
static void sweep_row(const Match* m, int sweep, int y, int row) {
    const Rectified* r = m->r;
    int n = r->ndisparity, sign = sweep ? -1 : 1;
    size_t stride = (size_t)n + 2 * GUARD_SIZE, slots = (size_t)r->width + 2;
    Byte one = (Byte)m->def->penalty_one, jump = (Byte)m->def->penalty_jump;
    for (int i = 0; i < r->width; ++i) {
        int x = sweep ? r->width - 1 - i : i;
        size_t pixel = (size_t)y * (size_t)r->width + (size_t)x;
        const Byte* cost = &m->cost[pixel * (size_t)n];
        uint16_t* restrict sum = &m->sum[sweep][pixel * (size_t)n];
        const Byte* value[NPATH];
        for (int p = 0; p < NPATH; ++p) {  // p = 0, 1, 2: from the row before; 3: along the row
            int from = p < 3 ? x + p - 1 : x - sign, from_row = p < 3 ? 1 - row : row;
            size_t a = ((size_t)(2 * p + from_row)) * slots + (size_t)(from + 1);
            size_t b = ((size_t)(2 * p + row)) * slots + (size_t)(x + 1);
            Byte* out = &m->path[sweep][b * stride + GUARD_SIZE];
            m->least[sweep][b] = step_path(cost, &m->path[sweep][a * stride + GUARD_SIZE],
                                           m->least[sweep][a], n, one, jump, out);
            value[p] = out;
        }
        for (int k = 0; k < n; ++k)
            sum[k] = (uint16_t)(value[0][k] + value[1][k] + value[2][k] + value[3][k]);
    }
}

static void sweep_all(void* ctx, int begin, int end, int block) {
    (void)block;
    Match* m = ctx;
    for (int sweep = begin; sweep < end; ++sweep)
        for (int i = 0; i < m->r->height; ++i)
            sweep_row(m, sweep, sweep ? m->r->height - 1 - i : i, i % 2);
}

// Zeros, and guards before and behind the candidates. Pixels beyond the ends stay zero: a path begins with the cost.
static void set_guards(Match* m) {
    size_t n = (size_t)m->r->ndisparity, stride = n + 2 * GUARD_SIZE;
    size_t count = 2 * NPATH * ((size_t)m->r->width + 2);
    for (int sweep = 0; sweep < 2; ++sweep) {
        memset(m->path[sweep], 0, count * stride);
        memset(m->least[sweep], 0, count);
        for (size_t k = 0; k < count; ++k) {
            memset(&m->path[sweep][k * stride], GUARD, GUARD_SIZE);
            memset(&m->path[sweep][k * stride + GUARD_SIZE + n], GUARD, GUARD_SIZE);
        }
    }
}

// ---- the best candidate -------------------------------------------------------------------------------------------

// The least of a parabola through three sums, in -0.5 to 0.5 around the middle.
static float parabola(int before, int middle, int after) {
    int bend = before + after - 2 * middle;
    return bend > 0 ? 0.5f * (float)(before - after) / (float)bend : 0;
}

// Candidate with the least sum, -1 if another one is nearly as good.
static int find_best(const Match* m, const uint16_t* sum) {
    int n = m->r->ndisparity, best = 0, next = 1 << 20;
    for (int k = 1; k < n; ++k)
        if (sum[k] < sum[best]) best = k;
    for (int k = 0; k < n; ++k)
        if (abs(k - best) > 1 && sum[k] < next) next = sum[k];
    return next * (1 - m->def->min_gain) <= sum[best] ? -1 : best;
}

static void pick_row(Match* m, int y) {
    const Rectified* r = m->r;
    int n = r->ndisparity;
    size_t first = (size_t)y * (size_t)r->width;
    const uint16_t* sum = &m->sum[0][first * (size_t)n];
    for (int x = 0; x < r->width; ++x) {
        const uint16_t* s = &sum[(size_t)x * (size_t)n];
        float* out = &r->disparity[first + (size_t)x];
        int k = r->left[first + (size_t)x] >= 0 ? find_best(m, s) : -1;
        *out = -1;
        if (k < 0) continue;
        float part = k > 0 && k + 1 < n ? parabola(s[k - 1], s[k], s[k + 1]) : 0;
        *out = (float)(r->min_disparity + k) + part;
    }
    // Pixels of the right picture: one candidate of each pixel to their right.
    for (int x = 0; x < r->width; ++x) {
        int best = -1, least = 1 << 20;
        for (int k = 0; k < n; ++k) {
            int from = x + r->min_disparity + k;
            if (from >= r->width) break;
            int s = sum[(size_t)from * (size_t)n + (size_t)k];
            if (s < least) least = s, best = k;
        }
        m->other[first + (size_t)x] = best < 0 ? -1 : (float)(r->min_disparity + best);
    }
    for (int x = 0; x < r->width; ++x) {
        float* d = &r->disparity[first + (size_t)x];
        int to = x - (int)lrintf(*d);
        if (*d < 0) continue;
        float other = to >= 0 ? m->other[first + (size_t)to] : -1;
        if (other < 0 || fabs((double)(other - *d)) > m->def->max_twist) *d = -1;
    }
}

OM_MULTIVERSION
static void add_sums(const Match* m, size_t begin, size_t end) {
    uint16_t* restrict a = m->sum[0];
    const uint16_t* restrict b = m->sum[1];
    for (size_t k = begin; k < end; ++k) a[k] = (uint16_t)(a[k] + b[k]);
}

static void pick_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    Match* m = ctx;
    size_t row = (size_t)m->r->width * (size_t)m->r->ndisparity;
    add_sums(m, (size_t)begin * row, (size_t)end * row);
    for (int y = begin; y < end; ++y) pick_row(m, y);
}

// ---- patches ------------------------------------------------------------------------------------------------------

// Pixels connected with `seed` by steps of at most MAX_STEP; they are marked in `patch`.
static int fill_patch(const Match* m, int seed) {
    const Rectified* r = m->r;
    int n = 0, done = 0;
    m->stack[n++] = seed;
    m->patch[seed] = 1;
    while (done < n) {
        int k = m->stack[done++], x = k % r->width, y = k / r->width;
        const int next[4] = {x > 0 ? k - 1 : -1, x + 1 < r->width ? k + 1 : -1,
                             y > 0 ? k - r->width : -1, y + 1 < r->height ? k + r->width : -1};
        for (int i = 0; i < 4; ++i) {
            int q = next[i];
            if (q < 0 || m->patch[q] || r->disparity[q] < 0) continue;
            if (fabsf(r->disparity[q] - r->disparity[k]) > MAX_STEP) continue;
            m->patch[q] = 1;
            m->stack[n++] = q;
        }
    }
    return n;
}

static void remove_patches(Match* m) {
    int npixel = m->r->width * m->r->height;
    for (int k = 0; k < npixel; ++k) {
        if (m->patch[k] || m->r->disparity[k] < 0) continue;
        int n = fill_patch(m, k);
        for (int i = 0; i < n && n < m->def->min_patch; ++i) m->r->disparity[m->stack[i]] = -1;
    }
}

OmStatus om__stereo_match(const OmStereoDef* def, Rectified* r) {
    OmStatus status = OM_OK;
    Match m = {.def = def, .r = r};
    size_t npixel = (size_t)r->width * (size_t)r->height, n = (size_t)r->ndisparity;
    size_t slots = 2 * NPATH * ((size_t)r->width + 2);
    OM_ALLOC_DONE(m.left, npixel);
    OM_ALLOC_DONE(m.right, npixel);
    OM_ALLOC_DONE(m.cost, npixel * n);
    for (int k = 0; k < 2; ++k) {
        OM_ALLOC_DONE(m.sum[k], npixel * n);
        OM_ALLOC_DONE(m.path[k], slots * (n + 2 * GUARD_SIZE));
        OM_ALLOC_DONE(m.least[k], slots);
    }
    OM_ALLOC_DONE(m.other, npixel);
    OM_ALLOC_DONE(m.stack, npixel);
    OM_ALLOC_DONE(m.patch, npixel);
    set_guards(&m);
    memset(m.patch, 0, npixel * sizeof *m.patch);
    om_parallel_for(def->nworker, r->height, ROWS, census_rows, &m);
    om_parallel_for(def->nworker, r->height, ROWS, cost_rows, &m);
    om_parallel_for(def->nworker, 2, 1, sweep_all, &m);
    om_parallel_for(def->nworker, r->height, ROWS, pick_rows, &m);
    remove_patches(&m);
done:
    om_free(m.left);
    om_free(m.right);
    om_free(m.cost);
    for (int k = 0; k < 2; ++k) {
        om_free(m.sum[k]);
        om_free(m.path[k]);
        om_free(m.least[k]);
    }
    om_free(m.other);
    om_free(m.stack);
    om_free(m.patch);
    return status;
}
