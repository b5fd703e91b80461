// scan_color.c: bounds of a tissue's colours, learnt from pixels that show it.
//
// Hues are angles: they are measured from their mean direction, weighted by saturation. Quantiles do not see the few
// pixels of another thing at the edge of the region. A pixel whose largest channel is at its limit has another hue than
// the material: it does not count. Two materials are recognised by Otsu's criterion: if the best
// threshold of the hues explains more than 85 % of their variance, they have two clusters (a normal distribution has
// 64 %, a uniform one 75 %).
//
// Reference: N. Otsu, A threshold selection method from gray-level histograms, IEEE Trans. SMC 9 (1979) 62-66.
#include <string.h>

#include "omentum/scan_picture.h"

#define MIN_PIXELS 50
#define MAX_LOST (1.0 / 3)  // share of grey pixels, and of bright ones
#define GREY 0.12           // saturation; less is grey
#define DARK 0.04           // value; less is dark
#define EXTEND 0.5          // of the distance between the quantiles
#define MIN_HUE 6.0         // degrees, at least, by which the hues are extended
#define SHADE 0.12          // lower bound of the value over that of the darkest tenth
#define GLOSS 0.35          // lower bound of the saturation over its median: gloss is white light
#define TWO_VARIANCE 0.85   // share of the hues' variance between two clusters
#define TWO_APART 10.0      // degrees between their means
#define TWO_SHARE 0.05      // of the pixels in the smaller one

typedef struct Sample {
    int n, ngrey, ndark, nbright;
    double *hue, *saturation, *value;  // of the pixels with a colour (n)
} Sample;

static bool is_inside(const OmScanRegion* r, int column, int row) {
    if (!r->is_box) return hypot(column + 0.5 - r->u, row + 0.5 - r->v) <= r->radius;
    return column >= r->column && row >= r->row && column - r->column < r->width &&
           row - r->row < r->height;
}

static void collect(const OmPicture* p, const OmScanRegion* region, Sample* s) {
    for (int row = 0; row < p->height; ++row)
        for (int column = 0; column < p->width; ++column) {
            if (!is_inside(region, column, row)) continue;
            double hsv[3];
            size_t at = (size_t)row * (size_t)p->width + (size_t)column;
            om_sense_hsv(&p->pixel[(size_t)p->nchannel * at], hsv);
            bool is_dark = hsv[2] < DARK, is_grey = !is_dark && hsv[1] < GREY;
            bool is_bright = !is_grey && hsv[2] == 1;
            s->ndark += is_dark, s->ngrey += is_grey, s->nbright += is_bright;
            if (is_dark || is_grey || is_bright) continue;
            s->hue[s->n] = hsv[0];
            s->saturation[s->n] = hsv[1];
            s->value[s->n++] = hsv[2];
        }
}

static OmStatus check_sample(const Sample* s) {
    int all = s->n + s->ngrey + s->ndark + s->nbright;
    OM_CHECK(all > 0, OM_INVALID, "the region has no pixel of the picture");
    OM_CHECK(s->ngrey <= MAX_LOST * all, OM_INVALID,
             "%d of %d pixels of the region are grey, without a hue: choose pixels without tools "
             "and highlights",
             s->ngrey, all);
    OM_CHECK(
        s->nbright <= MAX_LOST * all, OM_INVALID,
        "%d of %d pixels of the region are too bright for the camera, which changes their hue: "
        "reduce the exposure or choose a darker region",
        s->nbright, all);
    OM_CHECK(s->n >= MIN_PIXELS, OM_INVALID,
             "%d pixels of the region have a colour (%d are dark); %d are needed: choose a larger "
             "region",
             s->n, s->ndark, MIN_PIXELS);
    return OM_OK;
}

// Degrees from -180 to 180.
static double turn(double degrees) { return degrees - 360 * floor((degrees + 180) / 360); }

// Hues from their mean direction, which is returned, in ascending order.
static double center_hues(Sample* s) {
    double x = 0, y = 0;
    for (int i = 0; i < s->n; ++i) {
        x += s->saturation[i] * cos(s->hue[i] * OM_PI / 180);
        y += s->saturation[i] * sin(s->hue[i] * OM_PI / 180);
    }
    double mean = atan2(y, x) * 180 / OM_PI;
    for (int i = 0; i < s->n; ++i) s->hue[i] = turn(s->hue[i] - mean);
    om_sort_doubles(s->hue, s->n);
    return mean;
}

static OmStatus check_one_material(const Sample* s) {
    double sum = 0, square = 0, left = 0, best = 0, low = 0, high = 0;
    for (int i = 0; i < s->n; ++i) sum += s->hue[i], square += s->hue[i] * s->hue[i];
    double mean = sum / s->n, variance = square / s->n - mean * mean;
    for (int i = 1; i < s->n; ++i) {
        left += s->hue[i - 1];
        double share = (double)i / s->n;
        if (fmin(share, 1 - share) < TWO_SHARE) continue;
        double a = left / i, b = (sum - left) / (s->n - i);
        double between = share * (1 - share) * (b - a) * (b - a);
        if (between <= best) continue;
        best = between, low = a, high = b;
    }
    OM_CHECK(best <= TWO_VARIANCE * variance || high - low < TWO_APART, OM_INVALID,
             "the region shows two materials, whose hues are %.0f degrees apart: choose a region "
             "inside the tissue",
             high - low);
    return OM_OK;
}

static double quantile(const double* sorted, int n, double share) {
    return sorted[(int)(share * (n - 1) + 0.5)];
}

static void extend_hue(const double* sorted, int n, double bound[2]) {
    double low = quantile(sorted, n, 0.05), high = quantile(sorted, n, 0.95);
    double more = fmax(MIN_HUE, EXTEND * (high - low));
    bound[0] = low - more;
    bound[1] = high + more;
}

static OmStatus find_range(Sample* s, OmSenseRange* range) {
    double hue[2];
    double mean = center_hues(s);
    OM_TRY(check_one_material(s));
    om_sort_doubles(s->saturation, s->n);
    om_sort_doubles(s->value, s->n);
    extend_hue(s->hue, s->n, hue);
    OM_CHECK(hue[1] - hue[0] < 180, OM_INVALID,
             "the hues of the region are spread over %.0f degrees: choose a region inside the "
             "tissue",
             hue[1] - hue[0]);
    *range =
        (OmSenseRange){.hue_min = fmod(mean + hue[0] + 720, 360),
                       .hue_max = fmod(mean + hue[1] + 720, 360),
                       .saturation_min = fmax(GREY, GLOSS * quantile(s->saturation, s->n, 0.5)),
                       .saturation_max = 1,
                       .value_min = fmax(DARK, SHADE * quantile(s->value, s->n, 0.1)),
                       .value_max = 1};
    return OM_OK;
}

OmStatus om_scan_learn_range(const OmPicture* picture, const OmScanRegion* region,
                             OmSenseRange* range) {
    *range = (OmSenseRange){0};
    OM_CHECK(picture->pixel && picture->nchannel >= 3, OM_INVALID,
             "the picture is empty or has no colour");
    OM_CHECK(region->is_box || (isfinite(region->u) && isfinite(region->v) && region->radius >= 0),
             OM_INVALID, "the region is a disc of radius %g around (%g, %g)", region->radius,
             region->u, region->v);
    OM_CHECK(!region->is_box || (region->column >= 0 && region->row >= 0 && region->width >= 0 &&
                                 region->height >= 0),
             OM_INVALID, "the region is a box of %d x %d pixels at (%d, %d); 0 or more",
             region->width, region->height, region->column, region->row);
    OmStatus status = OM_OK;
    Sample s = {0};
    size_t npixel = (size_t)picture->width * (size_t)picture->height;
    OM_ALLOC_DONE(s.hue, npixel);
    OM_ALLOC_DONE(s.saturation, npixel);
    OM_ALLOC_DONE(s.value, npixel);
    collect(picture, region, &s);
    OM_TRY_DONE(check_sample(&s));
    status = find_range(&s, range);
done:
    om_free(s.hue);
    om_free(s.saturation);
    om_free(s.value);
    return status;
}
