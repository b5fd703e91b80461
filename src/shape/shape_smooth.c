// shape_smooth.c: a smooth distance field from a segmentation, without loss of volume.
//
// A Gaussian of the mask cut at one half represents a kidney well but loses an artery: a rod one voxel
// thick stays below one half. So the level function w is corrected until its enclosed volume, averaged by
// the Gaussian G, equals that of the mask m everywhere:
//
//     w <- w + G * (m - occupancy(w)),   w = G * m - 1/2 at the start.
//
// Each correction is smoothed too, so w stays smooth, and voxel steps (high frequencies, which G removes)
// do not return. All of it runs in voxel indices: an oblique or anisotropic header only changes where the
// field lies in space. Fine masks are first averaged over blocks of about the grid step.
//
// Without such blocks w then gets the sign of the mask at the centre of each voxel, by at least SIGN. Values between
// centres are interpolated, so a rod or a gap one voxel wide stays; where voxels touch along an edge alone, the
// inside is kept apart, as in shape_contour.c.
//
// Tried and rejected: one level everywhere (loses vessels); mean-curvature flow bounded by the voxel
// centres (Whitaker 2000: each convex piece shrinks by up to half a voxel).
#include "shape/shape_internal.h"

#include <string.h>

#define PAD 5       // voxels of air around the mask
#define MAX_TAP 12  // half-width of the Gaussian at smooth = 3
#define APART \
    4  // times SIGN: where voxels touch along an edge, the outside's; with 2 one middle in 14 was inside
#define SIGN 0.06  // least |w| at the centre of a voxel; w falls by 0.33 a voxel across a plane

typedef struct OmMaskField {  // values on voxel centres
    OmVoxelGrid grid;
    OmMat3 inverse;   // of grid.axis
    double slope;     // slope of w across a plane, per voxel
    double unit;      // m, over which w changes by 1 across a plane
    float* fraction;  // m: fraction of the voxel that is inside
    float* w;         // positive inside
    float* err;       // m - occupancy
    float* scratch;
} Level;

void om_mask_field_destroy(OmMaskField* l) {
    if (!l) return;
    om_free(l->fraction);
    om_free(l->w);
    om_free(l->err);
    om_free(l->scratch);
    om_free(l);
}

// Average the mask over blocks of block[0] x block[1] x block[2] voxels into a padded grid.
static OmStatus level_init(const OmMask* mask, const int block[3], Level* l) {
    for (int a = 0; a < 3; a++)
        l->grid.dim[a] = (mask->grid.dim[a] + block[a] - 1) / block[a] + 2 * PAD;
    size_t n = om_grid_count(l->grid.dim);
    l->fraction = om_calloc(n, sizeof(float));
    l->w = om_alloc(n, sizeof(float));
    l->err = om_alloc(n, sizeof(float));
    l->scratch = om_alloc(n, sizeof(float));
    if (!l->fraction || !l->w || !l->err || !l->scratch) return OM_NO_MEMORY;
    const OmMat3* x = &mask->grid.axis;
    l->grid.axis = om_mat3_cols(om_scale(block[0], x->cx), om_scale(block[1], x->cy),
                                om_scale(block[2], x->cz));
    OmVec3 first =
        om_vec3(0.5 * (block[0] - 1) - PAD * block[0], 0.5 * (block[1] - 1) - PAD * block[1],
                0.5 * (block[2] - 1) - PAD * block[2]);
    l->grid.origin = om_voxel_grid_point(&mask->grid, first);
    OM_TRY(om_mat3_inverse(l->grid.axis, &l->inverse));
    float part = 1.0f / (float)(block[0] * block[1] * block[2]);
    const unsigned char* in = mask->inside;
    for (int k = 0; k < mask->grid.dim[2]; k++) {
        for (int j = 0; j < mask->grid.dim[1]; j++) {
            size_t row = om_grid_index(l->grid.dim, 0, j / block[1] + PAD, k / block[2] + PAD);
            for (int i = 0; i < mask->grid.dim[0]; i++) {
                if (*in++) l->fraction[row + (size_t)(i / block[0] + PAD)] += part;
            }
        }
    }
    return OM_OK;
}

// One axis of the Gaussian; values beyond the grid are zero, since the grid is padded.
static void blur_axis(const float* in, float* out, const int dim[3], int axis, const float* tap,
                      int r) {
    size_t stride[3];
    om_grid_stride(dim, stride);
    const size_t s = stride[axis];
    size_t n = 0;
    for (int k = 0; k < dim[2]; k++) {
        for (int j = 0; j < dim[1]; j++) {
            for (int i = 0; i < dim[0]; i++, n++) {
                int c = axis == 0 ? i : axis == 1 ? j : k;
                float sum = tap[0] * in[n];
                for (int t = 1; t <= r; t++) {
                    if (c >= t) sum += tap[t] * in[n - (size_t)t * s];
                    if (c + t < dim[axis]) sum += tap[t] * in[n + (size_t)t * s];
                }
                out[n] = sum;
            }
        }
    }
}

// G * field, in place.
static void blur(Level* l, float* field, const float* tap, int r) {
    blur_axis(field, l->scratch, l->grid.dim, 0, tap, r);
    blur_axis(l->scratch, field, l->grid.dim, 1, tap, r);
    blur_axis(field, l->scratch, l->grid.dim, 2, tap, r);
    memcpy(field, l->scratch, om_grid_count(l->grid.dim) * sizeof(float));
}

static int gaussian_taps(double sigma, float* tap) {
    int r = (int)ceil(3.5 * sigma);
    if (r > MAX_TAP) r = MAX_TAP;
    double value[MAX_TAP + 1], sum = 0;
    for (int t = 0; t <= r; t++) {
        value[t] = exp(-0.5 * t * t / (sigma * sigma));
        sum += (t ? 2 : 1) * value[t];
    }
    for (int t = 0; t <= r; t++) tap[t] = (float)(value[t] / sum);
    return r;
}

// Fraction of each voxel that w encloses, from its eight octants, each cut by a plane of the usual slope.
static void compute_error(Level* l) {
    const ptrdiff_t sy = l->grid.dim[0], sz = sy * l->grid.dim[1];
    const float scale = (float)(2.0 / l->slope);
    memset(l->err, 0, om_grid_count(l->grid.dim) * sizeof(float));
    for (int k = 1; k < l->grid.dim[2] - 1; k++) {
        for (int j = 1; j < l->grid.dim[1] - 1; j++) {
            for (int i = 1; i < l->grid.dim[0] - 1; i++) {
                ptrdiff_t n = i + sy * j + sz * k;
                float sum = 0;
                for (int o = 0; o < 8; o++) {
                    ptrdiff_t x = o & 1 ? 1 : -1, y = o & 2 ? sy : -sy, z = o & 4 ? sz : -sz;
                    const float* w = &l->w[n];
                    float near = 27 * w[0] + 9 * (w[x] + w[y] + w[z]);
                    float far = 3 * (w[x + y] + w[y + z] + w[x + z]) + w[x + y + z];
                    float fraction = 0.5f + scale * (near + far) * (1.0f / 64);
                    sum += fraction < 0 ? 0 : fraction > 1 ? 1 : fraction;
                }
                l->err[n] = l->fraction[n] - 0.125f * sum;
            }
        }
    }
}

static OmStatus smooth_level(Level* l, double sigma, int iterations) {
    float tap[MAX_TAP + 1];
    int r = gaussian_taps(sigma, tap);
    l->slope = 1 / (sqrt(2 * OM_PI) * sigma);  // sigma >= 0.5
    size_t n = om_grid_count(l->grid.dim);
    memcpy(l->w, l->fraction, n * sizeof(float));
    blur(l, l->w, tap, r);
    for (size_t i = 0; i < n; i++) l->w[i] -= 0.5f;
    for (int it = 0; it < iterations; it++) {
        OM_TRY(om_stop_poll());
        compute_error(l);
        blur(l, l->err, tap, r);
        for (size_t i = 0; i < n; i++) l->w[i] += l->err[i];
    }
    return OM_OK;
}

// Give w the sign of the mask.
static void keep_signs(Level* l) {
    const size_t n = om_grid_count(l->grid.dim);
    const float least = (float)SIGN;
    for (size_t i = 0; i < n; i++)
        l->w[i] = l->fraction[i] > 0.5f ? fmaxf(l->w[i], least) : fminf(l->w[i], -least);
    // in a square with two inside voxels that touch along an edge, the middle is outside
    size_t stride[3];
    om_grid_stride(l->grid.dim, stride);
    for (int a = 0; a < 3; a++) {
        const size_t s = stride[a], t = stride[(a + 1) % 3];
        for (size_t i = 0; i + s + t < n; i++) {
            float* w = l->w + i;
            const bool is_in = w[0] > 0;
            if (is_in != (w[s + t] > 0) || is_in == (w[s] > 0) || is_in == (w[t] > 0)) continue;
            float* in[2] = {is_in ? w : w + s, is_in ? w + s + t : w + t};
            float* out[2] = {is_in ? w + s : w, is_in ? w + t : w + s + t};
            for (int c = 0; c < 2; c++) {
                *in[c] = least;
                *out[c] = fminf(*out[c], -(float)APART * least);
            }
        }
    }
}

// ---- the field in space ---------------------------------------------------------------------------------

static void cubic_weights(double u, double w[4]) {  // Catmull-Rom
    w[0] = 0.5 * u * (-1 + u * (2 - u));
    w[1] = 1 + 0.5 * u * u * (3 * u - 5);
    w[2] = 0.5 * u * (1 + u * (4 - 3 * u));
    w[3] = 0.5 * u * u * (u - 1);
}

// -w at a point of space, tricubic: its zero level has no kinks at the faces of the voxels.
static double level_eval(void* ctx, OmVec3 p) {
    const Level* l = ctx;
    OmVec3 q = om_mat3_apply(l->inverse, om_sub(p, l->grid.origin));
    const double x[3] = {q.x, q.y, q.z};
    double w[3][4];
    int c[3];
    for (int a = 0; a < 3; a++) {
        if (!(x[a] >= 1 && x[a] < l->grid.dim[a] - 2)) return 0.5;
        c[a] = (int)x[a];
        cubic_weights(x[a] - c[a], w[a]);
    }
    const size_t sy = (size_t)l->grid.dim[0], sz = sy * (size_t)l->grid.dim[1];
    const float* base =
        &l->w[(size_t)(c[0] - 1) + sy * (size_t)(c[1] - 1) + sz * (size_t)(c[2] - 1)];
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        double plane = 0;
        for (int j = 0; j < 4; j++) {
            const float* f = base + sy * (size_t)j + sz * (size_t)k;
            plane += w[1][j] * (w[0][0] * (double)f[0] + w[0][1] * (double)f[1] +
                                w[0][2] * (double)f[2] + w[0][3] * (double)f[3]);
        }
        sum += w[2][k] * plane;
    }
    return -sum;
}

// The bounding box in space of the voxels with w > 0.
static OmStatus level_bounds(const Level* l, OmVec3* lo, OmVec3* hi) {
    bool is_empty = true;
    size_t n = 0;
    for (int k = 0; k < l->grid.dim[2]; k++) {
        for (int j = 0; j < l->grid.dim[1]; j++) {
            for (int i = 0; i < l->grid.dim[0]; i++, n++) {
                if (l->w[n] <= 0) continue;
                OmVec3 c = om_voxel_grid_point(&l->grid, om_vec3(i, j, k));
                *lo = is_empty ? c : om_min3(*lo, c);
                *hi = is_empty ? c : om_max3(*hi, c);
                is_empty = false;
            }
        }
    }
    OM_CHECK(!is_empty, OM_INVALID,
             "the mask is too thin for a grid of this spacing: use a smaller edge");
    OmVec3 reach =
        om_vec3(fabs(l->grid.axis.cx.x) + fabs(l->grid.axis.cy.x) + fabs(l->grid.axis.cz.x),
                fabs(l->grid.axis.cx.y) + fabs(l->grid.axis.cy.y) + fabs(l->grid.axis.cz.y),
                fabs(l->grid.axis.cx.z) + fabs(l->grid.axis.cy.z) + fabs(l->grid.axis.cz.z));
    *lo = om_sub(*lo, reach);
    *hi = om_add(*hi, reach);
    return OM_OK;
}

OmStatus om_mask_field_create(const OmMask* mask, double spacing, double smooth, int iterations,
                              OmMaskField** field) {
    OmStatus status = OM_OK;
    int block[3];
    *field = NULL;
    OM_CHECK(om_mask_count(mask) > 0, OM_INVALID, "the mask is empty");
    OM_CHECK(smooth >= 0.5 && smooth <= 3 && iterations >= 0 && iterations <= 100, OM_INVALID,
             "field of a mask: smooth %g must be 0.5 to 3 voxels, iterations %d 0 to 100", smooth,
             iterations);
    const double h[3] = {om_norm(mask->grid.axis.cx), om_norm(mask->grid.axis.cy),
                         om_norm(mask->grid.axis.cz)};
    for (int a = 0; a < 3; a++) {
        double fit = spacing / h[a] + 1e-6;
        block[a] = fit < 1 ? 1 : fit > 64 ? 64 : (int)fit;
    }
    Level* l = om_calloc(1, sizeof *l);
    if (!l) return OM_NO_MEMORY;
    OM_TRY_DONE(level_init(mask, block, l));
    OM_TRY_DONE(smooth_level(l, smooth, iterations));
    if (block[0] * block[1] * block[2] == 1) keep_signs(l);
    l->unit = cbrt(fabs(om_mat3_det(l->grid.axis))) / l->slope;  // slope > 0
    *field = l;
done:
    if (status < 0) om_mask_field_destroy(l);
    return status;
}

double om_mask_field_eval(void* field, OmVec3 p) {
    return ((const OmMaskField*)field)->unit * level_eval(field, p);
}

OmStatus om_mask_field_bounds(const OmMaskField* field, OmVec3* lo, OmVec3* hi) {
    return level_bounds(field, lo, hi);
}

OmStatus om_sdf_from_mask(const OmMask* mask, const OmSdfDef* def, OmSdf* sdf) {
    OmStatus status = OM_OK;
    OmMaskField* field = NULL;
    OmVec3 lo, hi;
    memset(sdf, 0, sizeof *sdf);
    OM_TRY(om__sdf_check_def(def));
    double volume = om_mask_volume(mask);
    OM_CHECK(volume > 0 && isfinite(volume), OM_INVALID, "the mask is empty");
    OM_TRY_DONE(om_mask_field_create(mask, def->spacing, def->smooth, def->iterations, &field));
    OM_TRY_DONE(level_bounds(field, &lo, &hi));
    OM_TRY_DONE(om__sdf_grid(def, lo, hi, sdf));
    OM_TRY_DONE(om__sdf_sample(sdf, level_eval, field));
    OM_TRY_DONE(om__sdf_redistance(sdf, volume));
done:
    om_mask_field_destroy(field);
    if (status < 0) om_sdf_done(sdf);
    return status;
}
