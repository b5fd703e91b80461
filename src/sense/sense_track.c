// sense_track.c: corners of a texture, and pyramidal Lucas-Kanade.
//
// A window of the first picture, with its gradient g, is compared with the second picture at a shift d, both without
// their mean and the second with the contrast of the first: light that changes across a fold shifts no point. Each
// iteration solves H step = sum g e, H = sum g g^T (g without its mean), from the smallest picture to the largest.
//
// Covariance: white noise of variance s^2 in both pictures moves the solution by 2 s^2 H^-1. Interpolation averages
// pixels, which lowers the residual but not this sum, as the gradient varies slowly over a pixel; s^2 is therefore the
// residual's variance over that of the interpolated noise, or the definition's, whichever is larger.
//
// Grey values between pixels are Catmull and Rom's cubic: bilinear ones lose the contrast of fine waves, which moved
// places by up to 0.07 px at a shift of a quarter and a half of a pixel. Gradients, which only steer, are bilinear.
//
// A pyramid level is the binomial filter (1 4 6 4 1)/16 along both axes at every second pixel. Gradients are Scharr's
// 3 x 3 filters. Beyond the border pixels repeat.
#include "omentum/sense_track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COOKIE 0x7ac4ed01u
#define MAX_SIDE (2 * 16 + 1)
#define MAX_GAIN 2.0    // between the contrasts of two windows
#define MIN_EIGEN 0.05  // px^-2, of the mean of g g^T: a level with less tells nothing
#define MAX_MASKED 0.1  // share of a corner's window that the mask may exclude
#define MIN_LEVEL 8     // px, side of the smallest picture

typedef struct Window {
    float value[MAX_SIDE * MAX_SIDE];
    double mean, spread;  // of the values; the spread is the root mean square without the mean
    double smooth;        // variance of interpolated white noise of variance 1
} Window;

OmTrackDef om_track_default_def(void) {
    return (OmTrackDef){.nlevel = 3,
                        .radius = 4,
                        .max_iterations = 15,
                        .tolerance = 0.01,
                        .min_corner = 6,
                        .share = 0.01,
                        .spacing = 5,
                        .max_back = 0.5,
                        .min_correlation = 0.85,
                        .noise = 1,
                        .nworker = 1,
                        .cookie = COOKIE};
}

static bool is_in(double value, double lo, double hi) { return value >= lo && value <= hi; }

OmStatus om_track_check_def(const OmTrackDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "OmTrackDef was not made by om_track_default_def");
    OM_CHECK(is_in(d->nlevel, 1, OM_TRACK_MAX_LEVEL) && is_in(d->radius, 2, 16), OM_INVALID,
             "OmTrackDef: nlevel %d must be 1 to %d, radius %d 2 to 16", d->nlevel,
             OM_TRACK_MAX_LEVEL, d->radius);
    OM_CHECK(is_in(d->max_iterations, 1, 100) && is_in(d->tolerance, 1e-9, 1), OM_INVALID,
             "OmTrackDef: max_iterations %d must be 1 to 100, tolerance %g px 1e-9 to 1",
             d->max_iterations, d->tolerance);
    OM_CHECK(is_in(d->min_corner, 0, 1e9) && is_in(d->share, 0, 1) && is_in(d->spacing, 1, 1e4),
             OM_INVALID, "OmTrackDef: min_corner %g, share %g or spacing %g px is out of range",
             d->min_corner, d->share, d->spacing);
    OM_CHECK(is_in(d->max_back, 1e-9, 1e4) && is_in(d->min_correlation, -1, 1) &&
                 is_in(d->noise, 1e-9, 255),
             OM_INVALID,
             "OmTrackDef: max_back %g px, min_correlation %g or noise %g is out of range",
             d->max_back, d->min_correlation, d->noise);
    OM_CHECK(d->nworker >= 0, OM_INVALID, "OmTrackDef: nworker is %d", d->nworker);
    return OM_OK;
}

// ---- pyramid --------------------------------------------------------------------------------------------------

static int clamp(int i, int n) { return i < 0 ? 0 : i >= n ? n - 1 : i; }

static void fill_grey(const OmPicture* p, float* grey) {
    size_t n = (size_t)p->width * (size_t)p->height;
    for (size_t i = 0; i < n; ++i) {
        const unsigned char* c = p->pixel + i * (size_t)p->nchannel;
        grey[i] = p->nchannel == 1 ? (float)c[0] : 0.299F * c[0] + 0.587F * c[1] + 0.114F * c[2];
    }
}

// Each value of `out` is the filtered value of `in` at twice its column and row. `row` has room for a row of `in`.
static void shrink(const OmTrackLevel* in, OmTrackLevel* out, float* row) {
    static const float k[5] = {1.0F / 16, 4.0F / 16, 6.0F / 16, 4.0F / 16, 1.0F / 16};
    for (int y = 0; y < out->height; ++y) {
        for (int x = 0; x < in->width; ++x) row[x] = 0;
        for (int j = -2; j <= 2; ++j) {
            const float* from = in->grey + (size_t)clamp(2 * y + j, in->height) * (size_t)in->width;
            for (int x = 0; x < in->width; ++x) row[x] += k[j + 2] * from[x];
        }
        for (int x = 0; x < out->width; ++x) {
            float sum = 0;
            for (int i = -2; i <= 2; ++i) sum += k[i + 2] * row[clamp(2 * x + i, in->width)];
            out->grey[(size_t)y * (size_t)out->width + (size_t)x] = sum;
        }
    }
}

static void fill_gradient(OmTrackLevel* p) {
    size_t w = (size_t)p->width;
    for (int y = 0; y < p->height; ++y) {
        const float* up = p->grey + (size_t)clamp(y - 1, p->height) * w;
        const float* at = p->grey + (size_t)y * w;
        const float* down = p->grey + (size_t)clamp(y + 1, p->height) * w;
        float *gu = p->gu + (size_t)y * w, *gv = p->gv + (size_t)y * w;
        for (int x = 0; x < p->width; ++x) {
            int l = clamp(x - 1, p->width), r = clamp(x + 1, p->width);
            gu[x] = (3 * (up[r] - up[l]) + 10 * (at[r] - at[l]) + 3 * (down[r] - down[l])) / 32;
            gv[x] = (3 * (down[l] - up[l]) + 10 * (down[x] - up[x]) + 3 * (down[r] - up[r])) / 32;
        }
    }
}

OmStatus om_track_picture_init(const OmTrackDef* def, const OmPicture* picture,
                               OmTrackPicture* out) {
    memset(out, 0, sizeof *out);
    OM_TRY(om_track_check_def(def));
    int side = 2 * def->radius + 1, width = picture->width, height = picture->height;
    OM_CHECK(picture->pixel &&
                 (picture->nchannel == 1 || picture->nchannel == 3 || picture->nchannel == 4),
             OM_INVALID, "track: a picture of %d channels; 1, 3 or 4", picture->nchannel);
    OM_CHECK(width >= side && height >= side, OM_INVALID,
             "track: a picture of %d x %d pixels is smaller than a window of %d", width, height,
             side);
    size_t total = (size_t)width;  // a row of scratch
    for (int k = 0; k < def->nlevel; ++k) {
        if (k > 0 && (width < MIN_LEVEL || height < MIN_LEVEL)) break;
        out->level[out->nlevel++] = (OmTrackLevel){.width = width, .height = height};
        total += 3 * (size_t)width * (size_t)height;
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    OM_ALLOC(out->block, total);
    float* next = out->block + picture->width;
    for (int k = 0; k < out->nlevel; ++k) {
        OmTrackLevel* p = &out->level[k];
        size_t n = (size_t)p->width * (size_t)p->height;
        p->grey = next, p->gu = next + n, p->gv = next + 2 * n;
        next += 3 * n;
        if (k == 0)
            fill_grey(picture, p->grey);
        else
            shrink(p - 1, p, out->block);
        fill_gradient(p);
    }
    return OM_OK;
}

void om_track_picture_done(OmTrackPicture* picture) {
    if (!picture) return;
    om_free(picture->block);
    memset(picture, 0, sizeof *picture);
}

// ---- windows --------------------------------------------------------------------------------------------------

// Values of `map` in a window around (u, v), by bilinear interpolation.
static void read_window(const OmTrackLevel* p, const float* map, double u, double v, int radius,
                        float* value) {
    double left = u - 0.5 - radius, top = v - 0.5 - radius;
    int x0 = (int)floor(left), y0 = (int)floor(top), side = 2 * radius + 1;
    float fx = (float)(left - x0), fy = (float)(top - y0);
    float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
    bool is_inside = x0 >= 0 && y0 >= 0 && x0 + side + 1 <= p->width && y0 + side + 1 <= p->height;
    for (int y = 0; y < side; ++y) {
        const float* a = map + (size_t)clamp(y0 + y, p->height) * (size_t)p->width;
        const float* b = map + (size_t)clamp(y0 + y + 1, p->height) * (size_t)p->width;
        float* out = value + y * side;
        if (is_inside) {
            a += x0, b += x0;
            for (int x = 0; x < side; ++x)
                out[x] = w00 * a[x] + w10 * a[x + 1] + w01 * b[x] + w11 * b[x + 1];
            continue;
        }
        for (int x = 0; x < side; ++x) {
            int l = clamp(x0 + x, p->width), r = clamp(x0 + x + 1, p->width);
            out[x] = w00 * a[l] + w10 * a[r] + w01 * b[l] + w11 * b[r];
        }
    }
}

// Weights of four pixels for a place at fraction f between the middle two (Catmull and Rom's cubic).
static void cubic(float f, float w[4]) {
    w[0] = 0.5F * f * (-1 + f * (2 - f));
    w[1] = 1 + 0.5F * f * f * (-5 + 3 * f);
    w[2] = 0.5F * f * (1 + f * (4 - 3 * f));
    w[3] = 0.5F * f * f * (-1 + f);
}

static double sum_of_squares(const float w[4]) {
    return (double)(w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3]);
}

static void read_grey(const OmTrackLevel* p, double u, double v, int radius, Window* w) {
    double left = u - 0.5 - radius, top = v - 0.5 - radius, sum = 0, square = 0;
    int x0 = (int)floor(left) - 1, y0 = (int)floor(top) - 1, side = 2 * radius + 1;
    int n = side * side;
    float wx[4], wy[4], row[MAX_SIDE + 3], out[MAX_SIDE + 3][MAX_SIDE];
    cubic((float)(left - floor(left)), wx);
    cubic((float)(top - floor(top)), wy);
    w->smooth = sum_of_squares(wx) * sum_of_squares(wy);
    bool is_inside = x0 >= 0 && x0 + side + 3 <= p->width;
    for (int y = 0; y < side + 3; ++y) {
        const float* a = p->grey + (size_t)clamp(y0 + y, p->height) * (size_t)p->width;
        if (is_inside) a += x0;
        for (int x = 0; x < side + 3 && !is_inside; ++x) row[x] = a[clamp(x0 + x, p->width)];
        if (!is_inside) a = row;
        for (int x = 0; x < side; ++x)
            out[y][x] = wx[0] * a[x] + wx[1] * a[x + 1] + wx[2] * a[x + 2] + wx[3] * a[x + 3];
    }
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            float g = wy[0] * out[y][x] + wy[1] * out[y + 1][x] + wy[2] * out[y + 2][x] +
                      wy[3] * out[y + 3][x];
            w->value[y * side + x] = g;
            sum += (double)g;
        }
    w->mean = sum / n;
    for (int i = 0; i < n; ++i) {
        w->value[i] -= (float)w->mean;
        square += (double)(w->value[i] * w->value[i]);
    }
    w->spread = sqrt(square / n);
}

// Gradient without its mean, and H = sum g g^T as uu, uv, vv.
static void read_gradient(const OmTrackLevel* p, double u, double v, int radius, float* gu,
                          float* gv, double H[3]) {
    int n = (2 * radius + 1) * (2 * radius + 1);
    double mu = 0, mv = 0;
    read_window(p, p->gu, u, v, radius, gu);
    read_window(p, p->gv, u, v, radius, gv);
    for (int i = 0; i < n; ++i) mu += (double)gu[i], mv += (double)gv[i];
    float au = (float)(mu / n), av = (float)(mv / n);
    H[0] = H[1] = H[2] = 0;
    for (int i = 0; i < n; ++i) {
        gu[i] -= au, gv[i] -= av;
        H[0] += (double)(gu[i] * gu[i]);
        H[1] += (double)(gu[i] * gv[i]);
        H[2] += (double)(gv[i] * gv[i]);
    }
}

static double smallest_eigenvalue(const double H[3]) {
    double half = 0.5 * (H[0] - H[2]);
    return 0.5 * (H[0] + H[2]) - sqrt(half * half + H[1] * H[1]);
}

// ---- corners --------------------------------------------------------------------------------------------------

typedef struct Corner {
    float strength;
    int pixel;
} Corner;

static int stronger_first(const void* a, const void* b) {
    const Corner *p = a, *q = b;
    if (p->strength != q->strength) return p->strength < q->strength ? 1 : -1;
    return p->pixel - q->pixel;
}

// Smallest eigenvalue of the mean of g g^T at each pixel whose window is in the picture, by sums along rows, then
// columns; elsewhere 0.
static void fill_strength(const OmTrackLevel* p, int radius, double* sum, float* strength) {
    int w = p->width, h = p->height, side = 2 * radius + 1;
    double n = (double)side * side, *row = sum, *column = sum + 3 * (size_t)w * (size_t)h;
    for (int y = 0; y < h; ++y) {
        double s[3] = {0, 0, 0};
        const float *gu = p->gu + (size_t)y * (size_t)w, *gv = p->gv + (size_t)y * (size_t)w;
        for (int x = 0; x < w; ++x) {
            double a = (double)gu[x], b = (double)gv[x];
            double* out = row + 3 * ((size_t)y * (size_t)w + (size_t)x);
            s[0] += a * a, s[1] += a * b, s[2] += b * b;
            memcpy(out, s, sizeof s);
        }
    }
    memset(column, 0, 3 * (size_t)w * sizeof *column);
    memset(strength, 0, (size_t)w * (size_t)h * sizeof *strength);
    for (int y = 0; y < h; ++y) {
        for (int x = radius; x < w - radius; ++x) {
            const double* end = row + 3 * ((size_t)y * (size_t)w + (size_t)(x + radius));
            double* c = column + 3 * (size_t)x;
            for (int k = 0; k < 3; ++k) {
                double in = end[k] - (x > radius ? end[k - 3 * side] : 0);
                double out = 0;
                if (y >= side) {
                    const double* old = end - 3 * (size_t)w * (size_t)side;
                    out = old[k] - (x > radius ? old[k - 3 * side] : 0);
                }
                c[k] += in - out;
            }
            if (y < side - 1) continue;
            const double H[3] = {c[0] / n, c[1] / n, c[2] / n};
            strength[(size_t)(y - radius) * (size_t)w + (size_t)x] =
                (float)fmax(0, smallest_eigenvalue(H));
        }
    }
}

static bool is_allowed(const OmTrackWhere* where, int w, int x, int y, int radius) {
    if (!where || !where->mask) return true;
    if (!where->mask[(size_t)y * (size_t)w + (size_t)x]) return false;
    int nbad = 0, max = (int)(MAX_MASKED * (2 * radius + 1) * (2 * radius + 1));
    for (int j = -radius; j <= radius; ++j)
        for (int i = -radius; i <= radius; ++i)
            nbad += !where->mask[(size_t)(y + j) * (size_t)w + (size_t)(x + i)];
    return nbad <= max;
}

static bool is_apart(const double* at, int n, double u, double v, double spacing) {
    for (int i = 0; i < n; ++i) {
        double du = at[2 * i] - u, dv = at[2 * i + 1] - v;
        if (du * du + dv * dv < spacing * spacing) return false;
    }
    return true;
}

OmStatus om_track_find_corners(const OmTrackDef* def, const OmTrackPicture* picture,
                               const OmTrackWhere* where, int max, double* at, int* n) {
    *n = 0;
    OM_TRY(om_track_check_def(def));
    OM_CHECK(picture->nlevel > 0 && max >= 0, OM_INVALID,
             "track: no picture, or room for %d corners", max);
    const OmTrackLevel* p = &picture->level[0];
    int w = p->width, h = p->height, nfound = 0;
    size_t npixel = (size_t)w * (size_t)h;
    double* sum = NULL;
    float* strength = NULL;
    Corner* corner = NULL;
    OmStatus status = OM_OK;
    float best = 0, least;
    OM_ALLOC_DONE(sum, 3 * (npixel + (size_t)w));
    OM_ALLOC_DONE(strength, npixel);
    OM_ALLOC_DONE(corner, npixel);
    fill_strength(p, def->radius, sum, strength);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            float s = strength[(size_t)y * (size_t)w + (size_t)x];
            if (!(s > 0) || (double)s < def->min_corner) continue;
            if (!is_allowed(where, w, x, y, def->radius)) continue;
            corner[nfound++] = (Corner){s, y * w + x};
            best = fmaxf(best, s);
        }
    least = (float)def->share * best;
    qsort(corner, (size_t)nfound, sizeof *corner, stronger_first);
    for (int i = 0; i < nfound && *n < max && corner[i].strength >= least; ++i) {
        double u = corner[i].pixel % w + 0.5, v = corner[i].pixel / w + 0.5;
        if (where && !is_apart(where->old, where->nold, u, v, def->spacing)) continue;
        if (!is_apart(at, *n, u, v, def->spacing)) continue;
        at[2 * *n] = u, at[2 * *n + 1] = v;
        ++*n;
    }
done:
    om_free(sum);
    om_free(strength);
    om_free(corner);
    return status;
}

// ---- Lucas-Kanade ---------------------------------------------------------------------------------------------

typedef struct Fit {     // of one window on one level
    double H[3];         // 0 where the level tells nothing
    double residual;     // root mean square, grey values
    double correlation;  // of the two windows
    double noise;        // variance of a pixel's noise that explains it
} Fit;

// Improve the place (u, v) in `to` of the window at (from_u, from_v).
static void improve(const OmTrackDef* def, const OmTrackLevel* from, const OmTrackLevel* to,
                    const double at[2], double place[2], Fit* fit) {
    Window a, b;
    float gu[MAX_SIDE * MAX_SIDE], gv[MAX_SIDE * MAX_SIDE];
    int r = def->radius, n = (2 * r + 1) * (2 * r + 1);
    read_gradient(from, at[0], at[1], r, gu, gv, fit->H);
    fit->residual = fit->noise = HUGE_VAL;
    fit->correlation = -1;
    if (smallest_eigenvalue(fit->H) < MIN_EIGEN * n) {
        fit->H[0] = fit->H[1] = fit->H[2] = 0;
        return;
    }
    double det = fit->H[0] * fit->H[2] - fit->H[1] * fit->H[1];  // > 0: both eigenvalues are
    read_grey(from, at[0], at[1], r, &a);
    for (int k = 0; k <= def->max_iterations; ++k) {
        read_grey(to, place[0], place[1], r, &b);
        double gain = b.spread > 0 ? a.spread / b.spread : 1;
        gain = fmax(1 / MAX_GAIN, fmin(MAX_GAIN, gain));
        double bu = 0, bv = 0, square = 0, product = 0;
        for (int i = 0; i < n; ++i) {
            float e = a.value[i] - (float)gain * b.value[i];
            bu += (double)(gu[i] * e), bv += (double)(gv[i] * e), square += (double)(e * e);
            product += (double)(a.value[i] * b.value[i]);
        }
        fit->residual = sqrt(square / n);
        fit->correlation = b.spread > 0 ? product / (n * a.spread * b.spread) : -1;
        fit->noise = square / (n - 4) / (a.smooth + gain * gain * b.smooth);
        double du = (fit->H[2] * bu - fit->H[1] * bv) / det;
        double dv = (fit->H[0] * bv - fit->H[1] * bu) / det;
        double far = fmax(1, fmax(fabs(du), fabs(dv)) / r);
        if (k == def->max_iterations || fmax(fabs(du), fabs(dv)) < def->tolerance) break;
        place[0] += du / far, place[1] += dv / far;
    }
}

// From the smallest picture to the largest; false if the window leaves the picture.
static bool search(const OmTrackDef* def, const OmTrackPicture* from, const OmTrackPicture* to,
                   const double at[2], double place[2], Fit* fit) {
    for (int k = from->nlevel - 1; k >= 0; --k) {
        // Pixel i of level k is centred on pixel i 2^k of the picture.
        double scale = 1.0 / (1 << k);
        double a[2] = {(at[0] - 0.5) * scale + 0.5, (at[1] - 0.5) * scale + 0.5};
        double b[2] = {(place[0] - 0.5) * scale + 0.5, (place[1] - 0.5) * scale + 0.5};
        improve(def, &from->level[k], &to->level[k], a, b, fit);
        place[0] = (b[0] - 0.5) / scale + 0.5, place[1] = (b[1] - 0.5) / scale + 0.5;
        if (!isfinite(place[0]) || !isfinite(place[1])) return false;
        place[0] = fmax(-1e4, fmin(1e5, place[0]));
        place[1] = fmax(-1e4, fmin(1e5, place[1]));
    }
    double r = def->radius + 0.5;
    return place[0] >= r && place[1] >= r && place[0] <= to->level[0].width - r &&
           place[1] <= to->level[0].height - r && fit->H[0] > 0;
}

typedef struct Follow {
    const OmTrackDef* def;
    const OmTrackPicture *from, *to;
    const double *at, *guess;
    OmTrack* track;
} Follow;

static void follow_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const Follow* f = ctx;
    for (int i = begin; i < end; ++i) {
        const double *at = f->at + 2 * (size_t)i, *guess = f->guess ? f->guess + 2 * (size_t)i : at;
        OmTrack* t = &f->track[i];
        double place[2] = {guess[0], guess[1]}, back[2];
        Fit fit, unused;
        *t = (OmTrack){.is_lost = true};
        if (!isfinite(at[0]) || !isfinite(at[1]) || !isfinite(place[0]) || !isfinite(place[1]))
            continue;
        if (!search(f->def, f->from, f->to, at, place, &fit)) continue;
        if (!(fit.correlation >= f->def->min_correlation)) continue;
        back[0] = place[0] + at[0] - guess[0], back[1] = place[1] + at[1] - guess[1];
        if (!search(f->def, f->to, f->from, place, back, &unused)) continue;
        double twist = hypot(back[0] - at[0], back[1] - at[1]);
        if (!(twist <= f->def->max_back)) continue;
        double det = fit.H[0] * fit.H[2] - fit.H[1] * fit.H[1];
        double s2 = 2 * fmax(fit.noise, f->def->noise * f->def->noise) / det;
        *t = (OmTrack){.u = place[0],
                       .v = place[1],
                       .covariance = {s2 * fit.H[2], -s2 * fit.H[1], s2 * fit.H[0]},
                       .back = twist,
                       .residual = fit.residual,
                       .correlation = fit.correlation};
    }
}

OmStatus om_track_follow(const OmTrackDef* def, const OmTrackPicture* from,
                         const OmTrackPicture* to, int n, const double* at, const double* guess,
                         OmTrack* track) {
    OM_TRY(om_track_check_def(def));
    OM_CHECK(from->nlevel > 0 && to->nlevel > 0 && from->level[0].width == to->level[0].width &&
                 from->level[0].height == to->level[0].height,
             OM_INVALID, "track: pictures of %d x %d and %d x %d pixels", from->level[0].width,
             from->level[0].height, to->level[0].width, to->level[0].height);
    OM_CHECK(from->nlevel == to->nlevel && from->level[0].width > 2 * def->radius &&
                 from->level[0].height > 2 * def->radius,
             OM_INVALID, "track: pictures were made with another definition");
    Follow f = {def, from, to, at, guess, track};
    om_parallel_for(def->nworker, n, 16, follow_range, &f);
    return OM_OK;
}
