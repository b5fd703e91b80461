// sense_stereo_refine.c: disparities below a pixel, from grey values.
//
// The parabola of the sums is biased towards whole pixels. Here the right picture is moved onto the left one by the
// disparities, smoothed over a small window, and each disparity gets the shift that minimises the squared difference of
// the grey values in a window, without their means (B. Lucas, T. Kanade, IJCAI 1981). All pixels move by their own
// disparity, so that slopes and curvature of the surface are followed. The right picture is interpolated by cubics
// (E. Catmull, R. Rom, 1974), since linear interpolation is biased towards whole pixels, too.
//
// Disparities are smoothed before each shift and at the end. Errors fall to a quarter of those of the parabola or less
// (test_sense_stereo); without the last smoothing they are 1.2 times as large, with every second one 1.5 times. Windows
// of 9 and 5 pixels (grey values and disparities) gave 1.2 times the errors of 13 and 7. Tried and rejected: to leave
// out highlights (grey above 225), which changed nothing; a window of its own for each pixel, with a common shift of
// the disparities in it, which gave the same errors in six times the time.
#include "base/base_multiversion.h"
#include "sense/sense_internal.h"
#include "sense/sense_stereo_internal.h"

#define REACH 6         // the window of grey values has 2 REACH + 1 pixels a side
#define SMOOTH 3        // that of disparities, 2 SMOOTH + 1
#define NITERATION 4    //
#define MAX_STEP 1.0f   // pixels: a neighbour that differs by more is another surface
#define MAX_SHIFT 0.5f  // pixels in an iteration
#define FLAT 4.0f       // grey levels^2 a pixel: squared slopes below this give no shift

enum { COUNT, SLOPE, ERROR, SLOPE2, PRODUCT, NSUM };

typedef struct Refine {
    const Rectified* r;
    float* smooth;     // disparities
    float* sum[NSUM];  // of each pixel, then of rows of the window
    float* row[NSUM];
} Refine;

// Mean of the neighbours on the same surface.
static void smooth_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Refine* f = ctx;
    int w = f->r->width, h = f->r->height;
    const float* from = f->r->disparity;
    for (int y = begin; y < end; ++y)
        for (int x = 0; x < w; ++x) {
            float d = from[(size_t)y * (size_t)w + (size_t)x], sum = 0, count = 0;
            for (int j = y - SMOOTH; j <= y + SMOOTH && d >= 0; ++j)
                for (int i = x - SMOOTH; i <= x + SMOOTH; ++i) {
                    if (i < 0 || i >= w || j < 0 || j >= h) continue;
                    float e = from[(size_t)j * (size_t)w + (size_t)i];
                    if (e < 0 || fabsf(e - d) > MAX_STEP) continue;
                    sum += e;
                    count += 1;
                }
            // count >= 1: d itself
            f->smooth[(size_t)y * (size_t)w + (size_t)x] = d < 0 ? -1 : sum / count;
        }
}

// The cubic through four grey values, and its slope; false at the border.
static bool interpolate(const float* row, int width, float x, float* value, float* slope) {
    float base = floorf(x);
    int i = (int)base;
    if (i < 1 || i + 2 >= width) return false;
    float a = row[i - 1], b = row[i], c = row[i + 1], d = row[i + 2], t = x - base;
    if (a < 0 || b < 0 || c < 0 || d < 0) return false;
    float c1 = 0.5f * (c - a), c2 = a - 2.5f * b + 2 * c - 0.5f * d;
    float c3 = 0.5f * (d - a) + 1.5f * (b - c);
    *value = b + t * (c1 + t * (c2 + t * c3));
    *slope = c1 + t * (2 * c2 + 3 * t * c3);
    return true;
}

// Sums of a row over the window's columns.
OM_MULTIVERSION
static void add_columns(const float* restrict term, int width, float* restrict sum) {
    for (int x = 0; x < width; ++x) sum[x] = 0;
    for (int i = -REACH; i <= REACH; ++i) {
        int begin = i < 0 ? -i : 0, end = i > 0 ? width - i : width;
        for (int x = begin; x < end; ++x) sum[x] += term[x + i];
    }
}

// Terms of each pixel, and their sums over the window's columns.
static void gather_row(const Refine* f, int y) {
    const Rectified* r = f->r;
    int w = r->width;
    size_t first = (size_t)y * (size_t)w;
    for (int x = 0; x < w; ++x) {
        float d = f->smooth[first + (size_t)x], grey = r->left[first + (size_t)x], value, slope;
        bool is_in =
            d >= 0 && grey >= 0 && interpolate(&r->right[first], w, (float)x - d, &value, &slope);
        float e = is_in ? grey - value : 0;
        if (!is_in) slope = 0;
        const float term[NSUM] = {is_in, slope, e, slope * slope, e * slope};
        for (int k = 0; k < NSUM; ++k) f->sum[k][first + (size_t)x] = term[k];
    }
    for (int k = 0; k < NSUM; ++k) add_columns(&f->sum[k][first], w, &f->row[k][first]);
}

static void gather_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int y = begin; y < end; ++y) gather_row(ctx, y);
}

// Gauss and Newton with e = (L - mean) - (R - mean); R moves by -slope as the disparity grows.
OM_MULTIVERSION
static void shift_row(const Refine* f, int y) {
    const Rectified* r = f->r;
    int w = r->width, lo = y > REACH ? y - REACH : 0,
        hi = y + REACH < r->height ? y + REACH : r->height - 1;
    float* d = &f->smooth[(size_t)y * (size_t)w];
    for (int k = 0; k < NSUM; ++k) {  // the terms of this row are not needed any more
        float* restrict sum = &f->sum[k][(size_t)y * (size_t)w];
        for (int x = 0; x < w; ++x) sum[x] = 0;
        for (int j = lo; j <= hi; ++j) {
            const float* restrict row = &f->row[k][(size_t)j * (size_t)w];
            for (int x = 0; x < w; ++x) sum[x] += row[x];
        }
    }
    for (int x = 0; x < w; ++x) {
        float s[NSUM];
        for (int k = 0; k < NSUM; ++k) s[k] = f->sum[k][(size_t)y * (size_t)w + (size_t)x];
        float n = fmaxf(1, s[COUNT]);
        float slope2 = s[SLOPE2] - s[SLOPE] * s[SLOPE] / n + FLAT * n;  // above 0 by FLAT
        float shift = -(s[PRODUCT] - s[ERROR] * s[SLOPE] / n) / slope2;
        shift = fminf(MAX_SHIFT, fmaxf(-MAX_SHIFT, shift));
        d[x] = d[x] < 0 ? -1 : fmaxf(0, d[x] + shift);
    }
}

static void shift_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int y = begin; y < end; ++y) shift_row(ctx, y);
}

static void adopt_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Refine* f = ctx;
    size_t w = (size_t)f->r->width;
    for (size_t k = (size_t)begin * w; k < (size_t)end * w; ++k) f->r->disparity[k] = f->smooth[k];
}

OmStatus om__stereo_refine(const OmStereoDef* def, Rectified* r) {
    OmStatus status = OM_OK;
    size_t n = (size_t)r->width * (size_t)r->height;
    Refine f = {.r = r};
    OM_ALLOC_DONE(f.smooth, n);
    for (int k = 0; k < NSUM; ++k) {
        OM_ALLOC_DONE(f.sum[k], n);
        OM_ALLOC_DONE(f.row[k], n);
    }
    for (int i = 0; i < NITERATION; ++i) {
        om_parallel_for(def->nworker, r->height, ROWS, smooth_rows, &f);
        om_parallel_for(def->nworker, r->height, ROWS, gather_rows, &f);
        om_parallel_for(def->nworker, r->height, ROWS, shift_rows, &f);
        om_parallel_for(def->nworker, r->height, ROWS, adopt_rows, &f);
    }
    om_parallel_for(def->nworker, r->height, ROWS, smooth_rows, &f);
    om_parallel_for(def->nworker, r->height, ROWS, adopt_rows, &f);
done:
    om_free(f.smooth);
    for (int k = 0; k < NSUM; ++k) {
        om_free(f.sum[k]);
        om_free(f.row[k]);
    }
    return status;
}
