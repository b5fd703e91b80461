// scan_picture.c: which pixels of a picture show the tissue.
//
// Colour first: a colour in the range of the tissue is tissue, unless its point is out of reach or inside a tool; a
// grey pixel near a tool's capsules is tool; other colours are other things. The remaining grey pixels are highlights
// if the surface around their connected piece is mostly tissue and continuous in depth. Without colour, space alone
// decides (OmScanField). Then pixels between two surfaces (depth cameras interpolate) and small pieces are left out.
#include <string.h>

#include "scan/scan_internal.h"

#define COOKIE 0x5ca9def0u
#define MIN_NEIGHBOURS 3  // of eight at the same depth: fewer are of a pixel between two surfaces
#define MAX_SAMPLE 1024   // pixels that tell the noise
#define MIN_SAMPLE 50
#define NORMAL_MEDIAN 0.6745  // of the size of a normal deviate
#define HIGHLIGHT_BORDER 0.7  // share of a grey piece's border that is tissue at the same depth

enum { PALE = OM_SCAN_OTHER + 1 };  // grey and away from known tools, while classes are found

OmScanDef om_scan_default_def(double spacing) {
    OmDepthNoise noise = om_depth_noise_default(0);
    return (OmScanDef){.cookie = COOKIE,
                       .use_color = true,
                       .tissue = om_sense_range(OM_PART_TISSUE),
                       .tool = om_sense_range(OM_PART_TOOL),
                       .spacing = spacing,
                       .max_jump = 0.004,
                       .min_cosine = 0.1,
                       .min_area = 25e-6,
                       .margin = 1,
                       .noise_a = noise.a,
                       .noise_b = noise.b};
}

static OmStatus check_range(const OmSenseRange* r, const char* name) {
    OM_CHECK(r->hue_min >= 0 && r->hue_min <= 360 && r->hue_max >= 0 && r->hue_max <= 360,
             OM_INVALID, "OmScanDef.%s has hues of %g to %g degrees; 0 to 360", name, r->hue_min,
             r->hue_max);
    OM_CHECK(r->saturation_min <= r->saturation_max && r->value_min <= r->value_max, OM_INVALID,
             "OmScanDef.%s has a saturation of %g to %g and a value of %g to %g; the smaller first",
             name, r->saturation_min, r->saturation_max, r->value_min, r->value_max);
    return OM_OK;
}

static OmStatus check_def(const OmScanDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "OmScanDef was not made by om_scan_default_def");
    OM_TRY(check_range(&d->tissue, "tissue"));
    OM_TRY(check_range(&d->tool, "tool"));
    OM_CHECK(d->spacing > 0 && d->spacing < 1, OM_INVALID,
             "OmScanDef.spacing is %g m; above 0 and below 1", d->spacing);
    OM_CHECK(d->max_jump > 0 && isfinite(d->max_jump), OM_INVALID,
             "OmScanDef.max_jump is %g m; above 0", d->max_jump);
    OM_CHECK(d->min_cosine >= 0 && d->min_cosine < 1, OM_INVALID,
             "OmScanDef.min_cosine is %g; 0 or more and below 1", d->min_cosine);
    OM_CHECK(d->min_area >= 0 && isfinite(d->min_area), OM_INVALID,
             "OmScanDef.min_area is %g m^2; 0 or more", d->min_area);
    OM_CHECK(d->margin >= 0 && d->margin <= 16, OM_INVALID, "OmScanDef.margin is %d; 0 to 16",
             d->margin);
    OM_CHECK(d->noise_a >= 0 && d->noise_b >= 0 && isfinite(d->noise_a) && isfinite(d->noise_b),
             OM_INVALID, "OmScanDef.noise_a and noise_b are %g and %g; 0 or more", d->noise_a,
             d->noise_b);
    return OM_OK;
}

static OmStatus check_picture(const OmDepthPicture* d) {
    OM_CHECK(d->depth, OM_INVALID, "the picture has no depth");
    OM_CHECK(!d->color.pixel || (d->color.width == d->camera.width &&
                                 d->color.height == d->camera.height && d->color.nchannel >= 3),
             OM_INVALID,
             "the colour picture is %d x %d with %d channels, the depth picture %d x %d",
             d->color.width, d->color.height, d->color.nchannel, d->camera.width, d->camera.height);
    return OM_OK;
}

// ---- classes of pixels -------------------------------------------------------------------------------------------

static unsigned char class_of_space(const OmScanField* field, OmVec3 p) {
    static const unsigned char class[] = {[OM_PLACE_FREE] = OM_SCAN_TISSUE,
                                          [OM_PLACE_FIXED] = OM_SCAN_OTHER,
                                          [OM_PLACE_TOOL] = OM_SCAN_TOOL,
                                          [OM_PLACE_FAR] = OM_SCAN_OTHER};
    return class[om_scan_field_eval(field, p)];
}

typedef struct Color {
    const OmScanDef* def;
    OmScanField field;      // grey pixels
    OmScanField bare;       // pixels with a colour of tissue: tools without margin
    unsigned char unknown;  // class of a grey pixel away from known tools
} Color;

static Color make_color(const OmScanDef* def, const OmScanField* field) {
    Color c = {.def = def, .field = *field, .bare = *field, .unknown = OM_SCAN_UNKNOWN};
    c.bare.tool_margin = 0;
    if (!field->has_every_tool) c.unknown = OM_SCAN_TOOL;
    return c;
}

static unsigned char class_of_color(const Color* c, const ScanPicture* p, int i,
                                    const unsigned char rgb[3]) {
    double hsv[3];
    om_sense_hsv(rgb, hsv);
    bool is_tissue = om_sense_range_has(&c->def->tissue, hsv),
         is_grey = om_sense_range_has(&c->def->tool, hsv);
    if (!om__has_depth(p, i)) return OM_SCAN_UNKNOWN;
    if (!is_tissue && !is_grey)
        return hsv[2] < c->def->tissue.value_min ? OM_SCAN_UNKNOWN : OM_SCAN_OTHER;
    OmVec3 x = om_load3(p->x, i);
    OmScanPlace place = om_scan_field_eval(is_tissue ? &c->bare : &c->field, x);
    if (place == OM_PLACE_TOOL) return OM_SCAN_TOOL;
    if (place == OM_PLACE_FAR) return OM_SCAN_OTHER;
    return is_tissue ? OM_SCAN_TISSUE : PALE;
}

// A connected piece of grey pixels is a highlight if most of its border is tissue at the same depth.
static void settle_grey(const ScanPicture* p, int first, unsigned char unknown, int* queue) {
    int n = 0, nborder = 0, ntissue = 0;
    p->class[first] = unknown;
    queue[n++] = first;
    for (int q = 0; q < n; ++q)
        for (int k = 0; k < 4; ++k) {
            int j = om__neighbour(p, queue[q], k);
            if (j < 0) continue;
            bool is_near = om__has_depth(p, j) && om__is_near(p, queue[q], j);
            if (p->class[j] == PALE && is_near) {
                p->class[j] = unknown;
                queue[n++] = j;
            } else if (p->class[j] != unknown || !is_near) {
                ++nborder;
                ntissue += p->class[j] == OM_SCAN_TISSUE && is_near;
            }
        }
    if (nborder == 0 || ntissue < HIGHLIGHT_BORDER * nborder) return;
    for (int q = 0; q < n; ++q) p->class[queue[q]] = OM_SCAN_TISSUE;
}

// Pixels around a tool: their colour is a mixture, and their depth lies between two surfaces.
static void grow_tool(const ScanPicture* p, int margin, int* queue) {
    int begin = 0, n = 0;
    for (int i = 0; i < p->npixel; ++i)
        if (p->class[i] == OM_SCAN_TOOL) queue[n++] = i;
    for (int ring = 0; ring < margin; ++ring)
        for (int end = n; begin < end; ++begin)
            for (int k = 0; k < 8; ++k) {
                int j = om__neighbour(p, queue[begin], k);
                if (j < 0 || p->class[j] != OM_SCAN_TISSUE) continue;
                p->class[j] = OM_SCAN_TOOL;
                queue[n++] = j;
            }
}

// ---- pixels between surfaces, and small pieces ---------------------------------------------------------------

static bool is_between_surfaces(const ScanPicture* p, int i) {
    int nnear = 0;
    for (int k = 0; k < 8; ++k) {
        int j = om__neighbour(p, i, k);
        nnear += j >= 0 && om__has_depth(p, j) && om__is_near(p, i, j);
    }
    return nnear < MIN_NEIGHBOURS;
}

static void drop_between(const ScanPicture* p, int* queue) {
    int n = 0;
    for (int i = 0; i < p->npixel; ++i)
        if (p->class[i] == OM_SCAN_TISSUE && is_between_surfaces(p, i)) queue[n++] = i;
    for (int q = 0; q < n; ++q) p->class[queue[q]] = OM_SCAN_UNKNOWN;
}

static void drop_small(const ScanPicture* p, double min_area, bool* is_seen, int* queue) {
    memset(is_seen, 0, (size_t)p->npixel * sizeof *is_seen);
    for (int i = 0; i < p->npixel; ++i) {
        if (p->class[i] != OM_SCAN_TISSUE || is_seen[i]) continue;
        int n = 0;
        double area = 0;
        queue[n++] = i;
        is_seen[i] = true;
        for (int q = 0; q < n; ++q) {
            double side = p->angle * (double)p->depth[queue[q]];
            area += side * side;
            for (int k = 0; k < 4; ++k) {
                int j = om__neighbour(p, queue[q], k);
                if (j < 0 || is_seen[j] || !om__is_linked(p, queue[q], j)) continue;
                is_seen[j] = true;
                queue[n++] = j;
            }
        }
        for (int q = 0; q < n && area < min_area; ++q) p->class[queue[q]] = OM_SCAN_UNKNOWN;
    }
}

// A depth differs from the mean of its neighbours in the row by curvature, which is small, and by noise, with a
// standard deviation of sqrt(1.5). The median does not see edges. Noise above that of the definition is taken.
static void measure_noise(ScanPicture* p) {
    double sample[MAX_SAMPLE];
    int ntissue = 0, n = 0;
    for (int i = 0; i < p->npixel; ++i) ntissue += p->class[i] == OM_SCAN_TISSUE;
    int stride = ntissue / MAX_SAMPLE + 1;
    for (int i = 1, k = 0; i + 1 < p->npixel && n < MAX_SAMPLE; ++i) {
        if (i % p->width == 0 || i % p->width == p->width - 1)
            continue;  // neighbours of other rows
        if (p->class[i] != OM_SCAN_TISSUE || k++ % stride != 0) continue;
        if (p->class[i - 1] != OM_SCAN_TISSUE || p->class[i + 1] != OM_SCAN_TISSUE) continue;
        double z = (double)p->depth[i], sigma = om__depth_noise(p, z);
        double off = fabs(z - 0.5 * ((double)p->depth[i - 1] + (double)p->depth[i + 1]));
        if (sigma > 0) sample[n++] = off / sigma;
    }
    if (n < MIN_SAMPLE) return;
    om_sort_doubles(sample, n);
    double more = sample[n / 2] / (NORMAL_MEDIAN * sqrt(1.5));
    if (more <= 1) return;
    p->noise_a *= more;
    p->noise_b *= more;
}

static void classify(const OmScanDef* def, const OmPicture* color, const OmScanField* field,
                     ScanPicture* p, int* queue) {
    bool has_color = def->use_color && color->pixel;
    Color c = make_color(def, field);
    for (int i = 0; i < p->npixel; ++i) {
        if (has_color)
            p->class[i] =
                class_of_color(&c, p, i, &color->pixel[(size_t)color->nchannel * (size_t)i]);
        else
            p->class[i] =
                om__has_depth(p, i) ? class_of_space(field, om_load3(p->x, i)) : OM_SCAN_UNKNOWN;
    }
    for (int i = 0; i < p->npixel; ++i)
        if (p->class[i] == PALE) settle_grey(p, i, c.unknown, queue);
    grow_tool(p, def->margin, queue);
    measure_noise(p);
    drop_between(p, queue);
}

// ---- the whole ----------------------------------------------------------------------------------------------------

// om_depth_to_cloud leaves no gaps: move the points to their pixels, from the last one.
static void spread(const ScanPicture* p, int n) {
    for (int i = p->npixel - 1; i >= 0; --i) {
        bool has_depth = om__has_depth(p, i);
        if (has_depth) --n;
        om_store3(p->x, i, has_depth ? om_load3(p->x, n) : om_vec3(0, 0, 0));
    }
}

// A depth out of the camera's range, or at its far end, says nothing: a sensor writes such values where it measured
// nothing.
static float* copy_depth(const OmDepthPicture* d, int npixel) {
    float *depth = om_alloc((size_t)npixel, sizeof *depth), near = (float)d->camera.near_m,
          far = (float)d->camera.far_m;
    for (int i = 0; depth && i < npixel; ++i)
        depth[i] = d->depth[i] >= near && d->depth[i] < far ? d->depth[i] : 0;
    return depth;
}

static double pixel_angle(const OmCamera* c) {
    double u = c->width / 2.0, v = c->height / 2.0;
    return om_norm(om_sub(om_camera_ray(c, u + 0.5, v), om_camera_ray(c, u - 0.5, v)));
}

OmStatus om_scan_from_picture(const OmScanDef* def, const OmScanField* field,
                              const OmDepthPicture* d, OmScan* scan) {
    memset(scan, 0, sizeof *scan);
    OM_TRY(check_def(def));
    OM_TRY(check_picture(d));
    OmStatus status = OM_OK;
    int* queue = NULL;
    bool* is_seen = NULL;
    ScanPicture p = {.width = d->camera.width,
                     .height = d->camera.height,
                     .npixel = d->camera.width * d->camera.height,
                     .angle = pixel_angle(&d->camera),
                     .max_jump = def->max_jump,
                     .eye = d->camera.pose_world_camera.p,
                     .noise_a = def->noise_a,
                     .noise_b = def->noise_b};
    float* depth = copy_depth(d, p.npixel);
    p.depth = depth;
    if (!depth) {
        status = OM_NO_MEMORY;
        goto done;
    }
    OM_ALLOC_DONE(p.x, 3 * (size_t)p.npixel);
    OM_ALLOC_DONE(p.class, p.npixel);
    OM_ALLOC_DONE(queue, p.npixel);
    OM_ALLOC_DONE(is_seen, p.npixel);
    spread(&p, om_depth_to_cloud(&d->camera, depth, NULL, NULL, -1, p.x, NULL));
    classify(def, &d->color, field, &p, queue);
    drop_small(&p, def->min_area, is_seen, queue);
    OM_TRY_DONE(om__scan_decimate(def, &p, scan));
    scan->time = d->time;
    scan->has_camera = true;
    scan->camera = d->camera;
    scan->pixel = p.class;
    scan->depth = depth;
    p.class = NULL;
    depth = NULL;
done:
    om_free(p.x);
    om_free(p.class);
    om_free(depth);
    om_free(queue);
    om_free(is_seen);
    if (status < 0) om_scan_done(scan);
    return status;
}
