// scene_ct.c: a CT made here, its labels, and their recovery by thresholds.
//
//        gas                      y (anterior)
//      ______________             |
//     / fat   __     \            |      The organ is a superellipsoid of exponent 4, cut by the lower border of
//    |_______/tu\_____|           |      the volume; lobes narrow its outline between them. The fat has a superelliptic
//   /  organ \__/      \          +-- x  outline, round rims; its outer side has ripples of gradient noise.
//
// Each voxel holds the mean density of 3 x 3 x 3 samples (partial volume), then Gaussian blur, then white noise. The
// true label of a voxel is that of most samples. Thresholds lie half-way between mean densities, after a Gaussian of
// the width of the default blur. Tried without the removal of thin fat: the blurred border of organ and gas passes
// through the density of fat, and the fat then covers the whole organ in a shell of two voxels.
#include "omentum/scene_ct.h"

#include <math.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "omentum/shape_sdf.h"

enum { CT_COOKIE = 0x30dc7, NSUB = 3, MAX_KERNEL = 9 };

#define HU_GAS -1000.0
#define HU_FAT -100.0
#define HU_ORGAN 50.0
#define HU_TUMOUR 130.0    // with contrast agent
#define LABEL_BLUR 0.8     // voxels
#define ORGAN_DEPTH 0.024  // m, half the organ's extent along y
#define POLL 65536         // voxels between two polls for a request to stop
#define BELOW 0.022        // m, of the volume below y = 0, the organ's highest point
#define ABOVE 0.026        // m, above it
#define RIPPLE 0.03        // m, wavelength

static const double density[OM_CT_NLABEL] = {HU_GAS, HU_FAT, HU_ORGAN, HU_TUMOUR};

const char* om_ct_label_text(OmCtLabel label) {
    static const char* const text[OM_CT_NLABEL] = {"gas", "fat", "organ", "tumour"};
    return (int)label >= 0 && label < OM_CT_NLABEL ? text[label] : "unknown";
}

OmCtDef om_ct_default_def(uint64_t seed) {
    return (OmCtDef){.cookie = CT_COOKIE,
                     .seed = seed,
                     .voxel = 1.5e-3,
                     .organ_half = 0.070,
                     .fat_half = 0.048,
                     .fat_exponent = 6,
                     .fat_thickness = 7e-3,
                     .fat_ripple = 0.7e-3,
                     .tumour_shift = {8e-3, -6e-3},
                     .tumour_radius = 9e-3,
                     .tumour_height = 4e-3,
                     .blur = 0.8,
                     .noise = 20};
}

static OmStatus check_def(const OmCtDef* d) {
    OM_CHECK(d->cookie == CT_COOKIE, OM_INVALID, "OmCtDef was not made by om_ct_default_def");
    OM_CHECK(d->voxel >= 5e-4 && d->voxel <= 5e-3, OM_INVALID, "voxel: %g mm is outside 0.5 to 5",
             1e3 * d->voxel);
    OM_CHECK(d->fat_half >= 0.02 && d->fat_half < d->organ_half && d->organ_half <= 0.2, OM_INVALID,
             "fat_half and organ_half: %g and %g mm; they must ascend, from 20 to 200",
             1e3 * d->fat_half, 1e3 * d->organ_half);
    OM_CHECK(d->organ_lobes >= 0 && d->organ_lobes <= 0.2, OM_INVALID,
             "organ_lobes: %g is outside 0 to 0.2", d->organ_lobes);
    OM_CHECK(d->fat_exponent >= 2 && d->fat_exponent <= 10, OM_INVALID,
             "fat_exponent: %g is outside 2 to 10", d->fat_exponent);
    const double corner = d->fat_half * exp2(0.5 - 1 / d->fat_exponent);
    OM_CHECK(corner < d->organ_half * (d->organ_lobes > 0 ? 1 - d->organ_lobes : exp2(0.25)),
             OM_INVALID,
             "organ_lobes: between them the organ is narrower than the fat's corners, %.0f mm",
             1e3 * corner);
    OM_CHECK(d->fat_thickness >= 2e-3 && d->fat_thickness <= 0.015, OM_INVALID,
             "fat_thickness: %g mm is outside 2 to 15", 1e3 * d->fat_thickness);
    OM_CHECK(d->fat_ripple >= 0 && d->fat_ripple < 0.5 * d->fat_thickness, OM_INVALID,
             "fat_ripple: %g mm must be below half the thickness", 1e3 * d->fat_ripple);
    OM_CHECK(d->tumour_radius >= 2e-3 && d->tumour_radius <= 0.02, OM_INVALID,
             "tumour_radius: %g mm is outside 2 to 20", 1e3 * d->tumour_radius);
    OM_CHECK(d->tumour_height > 0 && d->tumour_height <= d->tumour_radius &&
                 d->tumour_height <= 8e-3,
             OM_INVALID, "tumour_height: %g mm must be above 0, at most the radius and 8 mm",
             1e3 * d->tumour_height);
    double reach = fmax(fabs(d->tumour_shift[0]), fabs(d->tumour_shift[1])) + d->tumour_radius;
    OM_CHECK(reach < d->fat_half, OM_INVALID, "tumour_shift: the tumour is not under the fat");
    OM_CHECK(d->blur >= 0 && d->blur <= 2, OM_INVALID, "blur: %g voxels is outside 0 to 2",
             d->blur);
    OM_CHECK(d->noise >= 0 && d->noise <= 200, OM_INVALID, "noise: %g HU is outside 0 to 200",
             d->noise);
    return OM_OK;
}

// ---- the anatomy ----------------------------------------------------------------------------------------------

typedef struct Column {           // above one point of the plane y = 0; m
    double organ_top;             // -HUGE_VAL: no organ here
    double tumour_lo, tumour_hi;  // lo > hi: none
    double fat_top;               // below the organ's or tumour's top: none
} Column;

// Half the organ's extent in the direction of a point: lobes of three and of five in a turn, in the ratio 3 to 2.
static double organ_half(const OmCtDef* d, double x, double z) {
    const double turn = atan2(z, x), lobe = 0.6 * cos(3 * turn + 1) + 0.4 * cos(5 * turn - 0.5);
    return d->organ_half * (1 - 0.5 * d->organ_lobes * (1 - lobe));
}

// Height of the organ: a superellipsoid of exponent 4 whose highest point is at y = 0.
static double organ_top(const OmCtDef* d, double x, double z) {
    const double half = organ_half(d, x, z);
    double rest = 1 - pow(fabs(x) / half, 4) - pow(fabs(z) / half, 4);
    return rest > 0 ? ORGAN_DEPTH * (pow(rest, 0.25) - 1) : -HUGE_VAL;
}

static Column column_at(const OmCtDef* d, double x, double z) {
    const double sx = d->tumour_shift[0], sz = d->tumour_shift[1], r = d->tumour_radius;
    Column c = {organ_top(d, x, z), 1, -1, -HUGE_VAL};
    double center = organ_top(d, sx, sz) + d->tumour_height - r;
    double left = r * r - (x - sx) * (x - sx) - (z - sz) * (z - sz);
    if (left > 0) {
        c.tumour_lo = center - sqrt(left);
        c.tumour_hi = center + sqrt(left);
    }
    const double e = d->fat_exponent;
    double rim = 1 - pow(fabs(x) / d->fat_half, e) - pow(fabs(z) / d->fat_half, e);
    if (rim <= 0) return c;
    double noise = om_noise_perlin(om_vec3(x / RIPPLE, 0.37, z / RIPPLE), d->seed);
    const double full = 1.3 * sqrt(6 / e * rim);  // the rim is as steep for each exponent
    double thickness = (d->fat_thickness + d->fat_ripple * noise) * fmin(1, full);
    c.fat_top = fmax(c.organ_top, c.tumour_hi > c.tumour_lo ? c.tumour_hi : -HUGE_VAL) + thickness;
    return c;
}

static OmCtLabel label_at(const Column* c, double y) {
    if (y >= c->tumour_lo && y <= c->tumour_hi) return OM_CT_TUMOUR;
    if (y <= c->organ_top) return OM_CT_ORGAN;
    return y <= c->fat_top ? OM_CT_FAT : OM_CT_GAS;
}

// Mean density and most frequent label of the voxels above one square of the plane y = 0.
static void fill_column(const OmCtDef* d, int i, int k, OmVolume* ct, OmVolume* truth) {
    Column column[NSUB * NSUB];
    const double step = d->voxel / NSUB;
    OmVec3 corner = om_voxel_grid_point(&ct->grid, om_vec3(i - 0.5, -0.5, k - 0.5));
    for (int s = 0; s < NSUB * NSUB; ++s)
        column[s] = column_at(d, corner.x + (s % NSUB + 0.5) * step,
                              corner.z + (0.5 + (double)(s / NSUB)) * step);
    for (int j = 0; j < ct->grid.dim[1]; ++j) {
        int count[OM_CT_NLABEL] = {0}, most = 0;
        double sum = 0;
        for (int s = 0; s < NSUB * NSUB * NSUB; ++s) {
            double y = corner.y + (NSUB * j + s / (NSUB * NSUB) + 0.5) * step;
            OmCtLabel label = label_at(&column[s % (NSUB * NSUB)], y);
            sum += density[label];
            count[label]++;
        }
        for (int l = 1; l < OM_CT_NLABEL; ++l)
            if (count[l] > count[most]) most = l;
        size_t n = om_grid_index(ct->grid.dim, i, j, k);
        ((float*)ct->voxel)[n] = (float)(sum / (NSUB * NSUB * NSUB));
        ((float*)truth->voxel)[n] = (float)most;
    }
}

// ---- the scanner ----------------------------------------------------------------------------------------------

// Gaussian blur along the three axes; values continue beyond the border.
static OmStatus blur(OmVolume* v, double sigma) {
    double kernel[MAX_KERNEL], sum = 0;
    const int* dim = v->grid.dim;
    size_t stride[3];
    float* line;
    OmStatus status = OM_OK;
    if (!(sigma > 0)) return OM_OK;
    for (int m = 0; m < MAX_KERNEL; ++m) {
        double x = m - MAX_KERNEL / 2;
        sum += kernel[m] = exp(-0.5 * x * x / (sigma * sigma));
    }
    int longest = dim[0] > dim[1] ? dim[0] : dim[1];
    if (dim[2] > longest) longest = dim[2];
    OM_ALLOC(line, (size_t)longest);
    om_grid_stride(dim, stride);
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        for (int ib = 0; ib < dim[b]; ++ib) {
            OM_TRY_DONE(om_stop_poll());
            for (int ic = 0; ic < dim[c]; ++ic) {
                float* first = (float*)v->voxel + (size_t)ib * stride[b] + (size_t)ic * stride[c];
                for (int n = 0; n < dim[a]; ++n) line[n] = first[(size_t)n * stride[a]];
                for (int n = 0; n < dim[a]; ++n) {
                    double mean = 0;
                    for (int m = 0; m < MAX_KERNEL; ++m) {
                        int at = n + m - MAX_KERNEL / 2;
                        at = at < 0 ? 0 : at >= dim[a] ? dim[a] - 1 : at;
                        mean += kernel[m] * (double)line[at];
                    }
                    first[(size_t)n * stride[a]] = (float)(mean / sum);
                }
            }
        }
    }
done:
    om_free(line);
    return status;
}

static OmStatus make_empty(const OmCtDef* d, OmVolume* v) {
    int side = 2 * (int)ceil((d->organ_half + 8e-3) / d->voxel) + 1;
    int high = (int)ceil((BELOW + ABOVE) / d->voxel) + 1;
    OM_TRY(om_volume_init(v, side, high, side));
    v->grid.axis = om_mat3_scale(d->voxel, om_mat3_identity());
    double half = 0.5 * (side - 1) * d->voxel;
    v->grid.origin = om_vec3(-half, -BELOW, -half);
    return OM_OK;
}

OmStatus om_ct_make(const OmCtDef* def, OmVolume* ct, OmVolume* truth) {
    OmStatus status = OM_OK;
    memset(ct, 0, sizeof *ct);
    memset(truth, 0, sizeof *truth);
    OM_TRY(check_def(def));
    OM_TRY_DONE(make_empty(def, ct));
    OM_TRY_DONE(make_empty(def, truth));
    for (int k = 0; k < ct->grid.dim[2]; ++k) {
        OM_TRY_DONE(om_stop_poll());
        for (int i = 0; i < ct->grid.dim[0]; ++i) fill_column(def, i, k, ct, truth);
    }
    OM_TRY_DONE(blur(ct, def->blur));
    OmRng rng = om_rng_init(def->seed, 0);
    float* value = ct->voxel;
    for (size_t n = 0; n < om_volume_count(ct); ++n) {
        value[n] += (float)(def->noise * om_rng_normal(&rng));
        if (n % POLL == 0) OM_TRY_DONE(om_stop_poll());
    }
done:
    if (status < 0) {
        om_volume_done(ct);
        om_volume_done(truth);
    }
    return status;
}

// ---- labels -----------------------------------------------------------------------------------------------------

static OmStatus mask_of(const OmVolume* labels, OmCtLabel label, OmMask* mask) {
    const int* dim = labels->grid.dim;
    OM_TRY(om_mask_init(mask, dim[0], dim[1], dim[2]));
    mask->grid = labels->grid;
    const float* value = labels->voxel;
    for (size_t n = 0; n < om_volume_count(labels); ++n) mask->inside[n] = value[n] == (float)label;
    return OM_OK;
}

// Opening by a voxel: erosion over faces, then dilation within the old voxels.
static OmStatus open_mask(OmMask* mask) {
    const int* dim = mask->grid.dim;
    const size_t count = om_grid_count(dim);
    size_t stride[3];
    unsigned char* core;
    core = om_calloc(count, 1);
    if (!core) return OM_NO_MEMORY;
    om_grid_stride(dim, stride);
    for (int pass = 0; pass < 2; ++pass) {  // 0: core = erosion of the mask; 1: mask = its dilation
        for (size_t n = 0; n < count; ++n) {
            int at[3];
            om_grid_unpack(dim, n, at);
            bool all = true, any = core[n] != 0;
            for (int a = 0; a < 3; ++a) {
                bool has_lo = at[a] > 0, has_hi = at[a] + 1 < dim[a];
                if (pass == 0) {
                    all = all && (!has_lo || mask->inside[n - stride[a]]) &&
                          (!has_hi || mask->inside[n + stride[a]]);
                } else {
                    any = any || (has_lo && core[n - stride[a]]) || (has_hi && core[n + stride[a]]);
                }
            }
            if (pass == 0)
                core[n] = mask->inside[n] && all;
            else
                mask->inside[n] = mask->inside[n] && any;
        }
    }
    om_free(core);
    return OM_OK;
}

// Voxels of a label outside of `mask` get the label of the next density.
static void relabel(const OmVolume* smooth, const OmMask* mask, OmCtLabel label, OmVolume* labels) {
    const float* hu = smooth->voxel;
    float* value = labels->voxel;
    for (size_t n = 0; n < om_volume_count(labels); ++n) {
        if (value[n] != (float)label || mask->inside[n]) continue;
        bool is_gas = label == OM_CT_FAT && (double)hu[n] < 0.5 * (HU_GAS + HU_ORGAN);
        OmCtLabel other = is_gas ? OM_CT_GAS : label == OM_CT_ORGAN ? OM_CT_FAT : OM_CT_ORGAN;
        value[n] = (float)other;
    }
}

static OmStatus clean_label(const OmVolume* smooth, OmCtLabel label, OmVolume* labels) {
    OmMask mask = {0};
    OM_TRY(mask_of(labels, label, &mask));
    OmStatus status = label == OM_CT_FAT ? open_mask(&mask) : OM_OK;
    if (status == OM_OK && om_mask_count(&mask) == 0)
        status = om_error(OM_INVALID, "the volume has no %s: no voxel has its density",
                          om_ct_label_text(label));
    if (status == OM_OK) status = om_mask_keep_parts(&mask, 6, 0, NULL, NULL);
    if (status == OM_OK) relabel(smooth, &mask, label, labels);
    om_mask_done(&mask);
    return status;
}

OmStatus om_ct_label(const OmVolume* ct, OmVolume* labels) {
    OmStatus status = OM_OK;
    OmVolume smooth = {0};
    const int* dim = ct->grid.dim;
    memset(labels, 0, sizeof *labels);
    OM_CHECK(ct->voxel, OM_INVALID, "the volume has no voxels");
    OM_TRY_DONE(om_volume_init(&smooth, dim[0], dim[1], dim[2]));
    OM_TRY_DONE(om_volume_init(labels, dim[0], dim[1], dim[2]));
    smooth.grid = labels->grid = ct->grid;
    float *hu = smooth.voxel, *value = labels->voxel;
    for (size_t n = 0; n < om_volume_count(ct); ++n) hu[n] = (float)om_volume_value(ct, n);
    OM_TRY_DONE(blur(&smooth, LABEL_BLUR));
    for (size_t n = 0; n < om_volume_count(ct); ++n) {
        int label = 0;
        while (label + 1 < OM_CT_NLABEL &&
               (double)hu[n] > 0.5 * (density[label] + density[label + 1]))
            ++label;
        value[n] = (float)label;
    }
    OM_TRY_DONE(clean_label(&smooth, OM_CT_FAT, labels));
    OM_TRY_DONE(clean_label(&smooth, OM_CT_TUMOUR, labels));
    OM_TRY_DONE(clean_label(&smooth, OM_CT_ORGAN, labels));
done:
    om_volume_done(&smooth);
    if (status < 0) om_volume_done(labels);
    return status;
}

double om_ct_get_dice(const OmVolume* a, const OmVolume* b, int label) {
    size_t both = 0, sum = 0, count = om_volume_count(a);
    if (om_volume_count(b) < count) count = om_volume_count(b);
    for (size_t n = 0; n < count; ++n) {
        bool in_a = om_volume_value(a, n) == label, in_b = om_volume_value(b, n) == label;
        both += in_a && in_b;
        sum += (size_t)in_a + (size_t)in_b;
    }
    return sum ? 2.0 * (double)both / (double)sum : 1;
}
