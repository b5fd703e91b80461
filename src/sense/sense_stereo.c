// sense_stereo.c: rectification of a pair of pictures, and depth from disparities.
//
// Rectification (A. Fusiello, E. Trucco, A. Verri, Machine Vision and Applications 12, 2000) by known poses and lenses:
// a common orientation with x along the baseline and z nearest to the mean of both axes. Each pixel of a rectified
// picture is a ray, projected into the camera with its distortion, and interpolated there. The left eye stays where it
// is, so a pixel of the left camera is a ray of the rectified one, and its depth needs no search.
//
// A pair of equal ideal cameras side by side is its own rectification: every pixel is copied.
//
// OpenCV has all of this, with no C interface since its version 4, and as a dependency of 100 MB and more.
#include "sense/sense_internal.h"
#include "sense/sense_stereo_internal.h"

#define STEREO_COOKIE 0x57e2e0u
#define BORDER_POINTS 32  // of each side, to find the extent of a rectified picture
#define MAX_SIDE 8192
#define MAX_BEND 0.5    // sine of the angle between baseline and x axis
#define MIN_FACING 0.5  // cosine between an axis of view and the normal of the rectified pictures
#define GIB (1024.0 * 1024 * 1024)
#define MAX_BYTES (8 * GIB)  // of costs and sums: full HD with all candidates needs 5
#define CANDIDATE_BYTES 5    // one of cost and two sums of two
#define MAX_STEP 1.5f        // pixels: neighbours whose disparities differ by more are two surfaces

OmStereoDef om_stereo_default_def(void) {
    return (OmStereoDef){.cookie = STEREO_COOKIE,
                         .near_m = 0.04,
                         .far_m = 0.4,
                         .penalty_one = 8,
                         .penalty_jump = 96,
                         .min_gain = 0.02,
                         .max_twist = 1,
                         .min_patch = 100,
                         .is_refined = true};
}

// ---- checks -----------------------------------------------------------------------------------------------------

static OmStatus check_def(const OmStereoDef* d) {
    OM_CHECK(d->cookie == STEREO_COOKIE, OM_INVALID,
             "OmStereoDef was not made by om_stereo_default_def");
    OM_CHECK(d->near_m > 0 && d->far_m > d->near_m && isfinite(d->far_m), OM_INVALID,
             "OmStereoDef.near_m %g and far_m %g do not enclose a range", d->near_m, d->far_m);
    OM_CHECK(d->penalty_one >= 1 && d->penalty_one <= 60, OM_INVALID,
             "OmStereoDef.penalty_one is %d; 1 to 60", d->penalty_one);
    OM_CHECK(d->penalty_jump > d->penalty_one && d->penalty_jump <= 120, OM_INVALID,
             "OmStereoDef.penalty_jump is %d; above penalty_one, %d, and to 120", d->penalty_jump,
             d->penalty_one);
    OM_CHECK(d->min_gain >= 0 && d->min_gain < 1, OM_INVALID,
             "OmStereoDef.min_gain is %g; 0 or more, below 1", d->min_gain);
    OM_CHECK(d->max_twist >= 0, OM_INVALID, "OmStereoDef.max_twist is %g; 0 or more", d->max_twist);
    OM_CHECK(d->min_patch >= 0, OM_INVALID, "OmStereoDef.min_patch is %d; 0 or more", d->min_patch);
    return OM_OK;
}

static OmStatus check_picture(const OmPicture* p, const OmCamera* c, const char* side) {
    OM_CHECK(p && p->pixel, OM_INVALID, "the %s picture of the pair is missing", side);
    OM_CHECK(p->width == c->width && p->height == c->height, OM_INVALID,
             "the %s picture has %d x %d pixels, its camera %d x %d", side, p->width, p->height,
             c->width, c->height);
    OM_CHECK(p->nchannel == 1 || p->nchannel == 3 || p->nchannel == 4, OM_INVALID,
             "the %s picture has %d channels; 1, 3 or 4", side, p->nchannel);
    return OM_OK;
}

static OmStatus check_eye(const OmCamera* c, const char* side) {
    OmStatus status = om_camera_check(c);
    if (status < 0) return om_error_prefix(status, "%s camera of the pair", side);
    OmPose p = c->pose_world_camera;
    double norm = p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z;
    OM_CHECK(isfinite(om_norm2(p.p)) && fabs(norm - 1) < 1e-6, OM_INVALID,
             "%s camera of the pair: its pose is not finite, or its quaternion has not length 1",
             side);
    return OM_OK;
}

// ---- rectification ------------------------------------------------------------------------------------------------

typedef struct Box {
    double u0, v0, u1, v1;
} Box;

// Where the border of a camera's picture lies on the rectified plane, with coordinates focal x tangent.
static OmStatus find_extent(const OmCamera* c, OmQuat q, double focal, Box* box) {
    *box = (Box){INFINITY, INFINITY, -INFINITY, -INFINITY};
    for (int k = 0; k < 4 * BORDER_POINTS; ++k) {
        double t = (double)(k % BORDER_POINTS) / BORDER_POINTS;
        int side = k / BORDER_POINTS;
        double u = c->width * (side == 0 ? t : side == 1 ? 1 : side == 2 ? 1 - t : 0);
        double v = c->height * (side == 0 ? 0 : side == 1 ? t : side == 2 ? 1 : 1 - t);
        OmVec3 d = om_quat_rotate(om_quat_conj(q), om_camera_ray(c, u, v));
        OM_CHECK(d.z > 0.1, OM_INVALID,
                 "a corner of the left picture looks along the baseline; such a pair has no "
                 "rectified picture");
        double x = focal * d.x / d.z, y = focal * d.y / d.z;
        box->u0 = fmin(box->u0, x), box->u1 = fmax(box->u1, x);
        box->v0 = fmin(box->v0, y), box->v1 = fmax(box->v1, y);
    }
    return OM_OK;
}

OmStatus om_stereo_rectify(const OmStereoPair* pair, OmCamera* left, OmCamera* right) {
    OM_TRY(check_eye(&pair->left, "left"));
    OM_TRY(check_eye(&pair->right, "right"));
    OmPose l = pair->left.pose_world_camera, r = pair->right.pose_world_camera;
    OmVec3 base = om_sub(r.p, l.p), x = om_normalize(base);
    OM_CHECK(om_norm(base) > 1e-6, OM_INVALID, "both cameras of the pair stand at one place");
    OmVec3 lx = om_quat_rotate(l.q, om_vec3(1, 0, 0)), lz = om_quat_rotate(l.q, om_vec3(0, 0, 1)),
           rz = om_quat_rotate(r.q, om_vec3(0, 0, 1));
    OM_CHECK(om_norm(om_cross(x, lx)) <= MAX_BEND && om_dot(x, lx) > 0, OM_INVALID,
             "the right camera does not stand to the right of the left camera: the baseline is at "
             "%.0f degrees to its x axis, at most 30; are the pictures exchanged?",
             acos(fmax(-1, fmin(1, om_dot(x, lx)))) * 180 / OM_PI);
    OmVec3 mean = om_add(lz, rz), z = om_normalize(om_sub(mean, om_scale(om_dot(mean, x), x)));
    OM_CHECK(om_dot(z, lz) >= MIN_FACING && om_dot(z, rz) >= MIN_FACING, OM_INVALID,
             "the cameras of the pair look in different directions");
    OmQuat q = om_quat_from_mat3(om_mat3_cols(x, om_cross(z, x), z));
    OmLens lens = om_camera_lens(&pair->left);
    double focal = 0.5 * (lens.fx + lens.fy);
    Box box;
    OM_TRY(find_extent(&pair->left, q, focal, &box));
    double width = ceil(box.u1 - box.u0 - 1e-6), height = ceil(box.v1 - box.v0 - 1e-6);
    OM_CHECK(width <= MAX_SIDE && height <= MAX_SIDE, OM_INVALID,
             "the rectified picture would have %.0f x %.0f pixels, at most %d a side", width,
             height, MAX_SIDE);
    *left = (OmCamera){.pose_world_camera = {l.p, q},
                       .width = (int)width,
                       .height = (int)height,
                       .near_m = pair->left.near_m,
                       .far_m = pair->left.far_m,
                       .lens = {.fx = focal, .fy = focal, .cx = -box.u0, .cy = -box.v0}};
    *right = *left;
    right->pose_world_camera.p = r.p;
    return OM_OK;
}

typedef struct Warp {
    const OmCamera *from, *to;
    const OmPicture* picture;
    float* grey;
} Warp;

static float grey_of(const OmPicture* p, int x, int y) {
    const unsigned char* c =
        &p->pixel[(size_t)p->nchannel * ((size_t)y * (size_t)p->width + (size_t)x)];
    if (p->nchannel == 1) return (float)c[0];
    return 0.299f * (float)c[0] + 0.587f * (float)c[1] + 0.114f * (float)c[2];
}

// Bilinear; (u, v) within half a pixel of the border takes the border's value.
static float sample(const OmPicture* p, double u, double v) {
    double x = fmax(0, fmin(p->width - 1, u - 0.5)), y = fmax(0, fmin(p->height - 1, v - 0.5));
    int i = (int)x, j = (int)y;
    int i1 = i + 1 < p->width ? i + 1 : i, j1 = j + 1 < p->height ? j + 1 : j;
    float a = (float)(x - i), b = (float)(y - j);
    return (1 - b) * ((1 - a) * grey_of(p, i, j) + a * grey_of(p, i1, j)) +
           b * ((1 - a) * grey_of(p, i, j1) + a * grey_of(p, i1, j1));
}

static void warp_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Warp* w = ctx;
    OmLens lens = om_camera_lens(w->from);
    // Rays of a view in the frame of the camera that took the picture; both have one eye.
    OmCamera turned = *w->to;
    OmQuat q = om_quat_conj(w->from->pose_world_camera.q);
    turned.pose_world_camera = (OmPose){.q = om_quat_mul(q, w->to->pose_world_camera.q)};
    View view = om__make_view(&turned);
    for (int row = begin; row < end; ++row)
        for (int i = 0; i < w->to->width; ++i) {
            OmVec3 ray = om__view_ray(&view, i + 0.5, row + 0.5);
            double u = 0, v = 0, slack = 1e-6;
            bool is_in = om__lens_project(&lens, ray, &u, &v) && u >= -slack &&
                         u <= w->from->width + slack && v >= -slack && v <= w->from->height + slack;
            w->grey[(size_t)row * (size_t)w->to->width + (size_t)i] =
                is_in ? sample(w->picture, u, v) : -1;
        }
}

// ---- depth --------------------------------------------------------------------------------------------------------

typedef struct Depth {
    const OmStereoDef* def;
    const OmCamera *camera, *plane;  // of the pair's left picture, rectified
    const Rectified* r;
    double scale;  // focal x baseline, m pixels
    float* depth;
} Depth;

// Interpolated between four neighbours of one surface, else that of the nearest pixel; below 0: none.
static float find_disparity(const Rectified* r, double u, double v) {
    double x = u - 0.5, y = v - 0.5;
    int i = (int)floor(x), j = (int)floor(y);
    float value[4], lo = INFINITY, hi = -INFINITY;
    for (int k = 0; k < 4; ++k) {
        int ii = i + k % 2, jj = j + k / 2;
        ii = ii < 0 ? 0 : ii >= r->width ? r->width - 1 : ii;
        jj = jj < 0 ? 0 : jj >= r->height ? r->height - 1 : jj;
        value[k] = r->disparity[(size_t)jj * (size_t)r->width + (size_t)ii];
        lo = fminf(lo, value[k]), hi = fmaxf(hi, value[k]);
    }
    float a = (float)(x - i), b = (float)(y - j);
    if (lo < 0 || hi - lo > MAX_STEP) return value[(a < 0.5f ? 0 : 1) + (b < 0.5f ? 0 : 2)];
    return (1 - b) * ((1 - a) * value[0] + a * value[1]) + b * ((1 - a) * value[2] + a * value[3]);
}

static void depth_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Depth* d = ctx;
    View view = om__make_view(d->camera);
    OmVec3 axis = om_quat_rotate(d->plane->pose_world_camera.q, om_vec3(0, 0, 1));
    double lo = fmax(d->def->near_m, d->camera->near_m), hi = fmin(d->def->far_m, d->camera->far_m);
    for (int row = begin; row < end; ++row)
        for (int i = 0; i < d->camera->width; ++i) {
            float* out = &d->depth[(size_t)row * (size_t)d->camera->width + (size_t)i];
            *out = 0;
            OmVec3 ray = om__view_ray(&view, i + 0.5, row + 0.5);  // length 1 along z of the camera
            double u, v, along = om_dot(ray, axis);
            if (!om_camera_project(d->plane, om_add(view.eye, ray), &u, &v)) continue;
            float disparity = find_disparity(d->r, u, v);
            if (!(disparity > 0)) continue;
            double z = d->scale / (double)disparity / along;  // along > 0: it is in front
            if (z >= lo && z <= hi) *out = (float)z;
        }
}

static OmStatus set_range(const OmStereoDef* def, double scale, Rectified* r) {
    double first = floor(scale / def->far_m), last = ceil(scale / def->near_m) + 1;
    double n = 16 * ceil((last - first + 1) / 16);
    OM_CHECK(n <= OM_STEREO_MAX_DISPARITY, OM_INVALID,
             "depth from %g to %g m has disparities of %.0f to %.0f pixels, %d candidates at most; "
             "raise OmStereoDef.near_m or use smaller pictures",
             def->near_m, def->far_m, first, last, OM_STEREO_MAX_DISPARITY);
    r->min_disparity = (int)first;
    r->ndisparity = (int)n;
    return OM_OK;
}

static double share_of(const float* depth, size_t n) {
    size_t count = 0;
    for (size_t i = 0; i < n; ++i) count += depth[i] > 0;
    return (double)count / (double)n;  // a picture has a pixel
}

OmStatus om_stereo_depth(const OmStereoDef* def, const OmStereoPair* pair, float* depth,
                         OmStereoReport* report) {
    OmStatus status = OM_OK;
    OmCamera left, right;
    Rectified r = {0};
    double t0 = om_clock_now();
    OM_TRY(check_def(def));
    OM_TRY(om_stereo_rectify(pair, &left, &right));
    OM_TRY(check_picture(pair->left_picture, &pair->left, "left"));
    OM_TRY(check_picture(pair->right_picture, &pair->right, "right"));
    double base = om_distance(left.pose_world_camera.p, right.pose_world_camera.p);
    OM_TRY(set_range(def, left.lens.fx * base, &r));
    r.width = left.width, r.height = left.height;
    size_t n = (size_t)r.width * (size_t)r.height;
    OM_CHECK((double)n * r.ndisparity * CANDIDATE_BYTES <= MAX_BYTES, OM_INVALID,
             "%d x %d pixels with %d candidates need %.1f GiB, the most is %.0f; raise "
             "OmStereoDef.near_m or use smaller pictures",
             r.width, r.height, r.ndisparity, (double)n * r.ndisparity * CANDIDATE_BYTES / GIB,
             MAX_BYTES / GIB);
    OM_ALLOC_DONE(r.left, n);
    OM_ALLOC_DONE(r.right, n);
    OM_ALLOC_DONE(r.disparity, n);
    Warp warp[2] = {{&pair->left, &left, pair->left_picture, r.left},
                    {&pair->right, &right, pair->right_picture, r.right}};
    for (int k = 0; k < 2; ++k) om_parallel_for(def->nworker, r.height, ROWS, warp_rows, &warp[k]);
    double t1 = om_clock_now();
    OM_TRY_DONE(om__stereo_match(def, &r));
    double t2 = om_clock_now();
    if (def->is_refined) OM_TRY_DONE(om__stereo_refine(def, &r));
    double t3 = om_clock_now();
    Depth d = {def, &pair->left, &left, &r, left.lens.fx * base, depth};
    om_parallel_for(def->nworker, pair->left.height, ROWS, depth_rows, &d);
    if (report)
        *report = (OmStereoReport){
            .share = share_of(depth, (size_t)pair->left.width * (size_t)pair->left.height),
            .ndisparity = r.ndisparity,
            .baseline = base,
            .focal = left.lens.fx,
            .ms_rectify = 1e3 * (t1 - t0),
            .ms_match = 1e3 * (t2 - t1),
            .ms_refine = 1e3 * (t3 - t2),
            .ms_total = 1e3 * (om_clock_now() - t0)};
done:
    om_free(r.left);
    om_free(r.right);
    om_free(r.disparity);
    return status;
}
