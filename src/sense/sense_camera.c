// sense_camera.c: cameras: projection, rays through pixels, the distortion of the lens and its inverse.
//
// Distortion (Brown 1971; Conrady 1919; OpenCV's order k1 k2 p1 p2 k3) maps x = (X / Z, Y / Z) to
//     D(x) = g(s) x + s a + 2 (a . x) x,   s = |x|^2,  g = 1 + k1 s + k2 s^2 + k3 s^3,  a = (p2, p1).
// D is the gradient of the potential G(s) + s (a . x), G' = g / 2, so its Jacobian is symmetric. In a disc where the
// Jacobian is positive definite the potential is strictly convex and D is one to one; Newton's method with steps that
// are cut until the residual falls finds the inverse. That disc is the domain of a lens; outside of it a lens folds.
// With h = 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 the eigenvalues are at least min(g, h) - 6 |a| |x|. Both are polynomials
// in r = |x|; they are positive in [0, r] if their Bernstein coefficients on [0, r] are. That is a proof, not an
// estimate; the disc may be a little smaller than the largest possible.
//
// Tried and rejected: the fixed point of OpenCV's undistortPoints, which converges slowly at the corners of a wide lens
// (more than 40 iterations at 30 % of barrel distortion; Newton needs 3 to 5) and says nothing about folds.
#include "sense/sense_internal.h"

#define MAX_NEWTON 50
#define SIDE_POINTS 64  // of a picture's border that om_camera_check tests

OmLens om_camera_lens(const OmCamera* c) {
    OmLens lens = c->lens;
    if (lens.fx == 0 && lens.fy == 0) {
        lens.fx = 0.5 * c->height / tan(0.5 * c->fov);
        lens.fy = lens.fx;
    }
    if (lens.cx == 0 && lens.cy == 0) {
        lens.cx = 0.5 * c->width;
        lens.cy = 0.5 * c->height;
    }
    return lens;
}

OmWindow om_window_clip(OmWindow w, int width, int height) {
    if (w.width == 0) return (OmWindow){0, 0, width, height};
    int right = w.width > width - w.column ? width : w.column + w.width;
    int bottom = w.height > height - w.row ? height : w.row + w.height;
    w.column = w.column < 0 ? 0 : w.column;
    w.row = w.row < 0 ? 0 : w.row;
    bool is_empty = right <= w.column || bottom <= w.row;
    w.width = is_empty ? 0 : right - w.column;
    w.height = is_empty ? 0 : bottom - w.row;
    return w;
}

static bool has_distortion(const OmLens* l) {
    return l->k1 != 0 || l->k2 != 0 || l->k3 != 0 || l->p1 != 0 || l->p2 != 0;
}

// ---- distortion -------------------------------------------------------------------------------------------------

// Is c0 + c1 r + c2 r^2 + c4 r^4 + c6 r^6 above 0 in [0, r]? By the coefficients of Bernstein, of degree 6.
static bool is_positive_to(double c1, double c2, double c4, double c6, double r) {
    const double b1 = c1 * r, b2 = c2 * r * r, b4 = c4 * r * r * r * r,
                 b6 = c6 * r * r * r * r * r * r;
    // binomial(i, j) / binomial(6, j) for j = 1, 2, 4
    static const double w2[7] = {0, 0, 1.0 / 15, 3.0 / 15, 6.0 / 15, 10.0 / 15, 1};
    static const double w4[7] = {0, 0, 0, 0, 1.0 / 15, 5.0 / 15, 1};
    for (int i = 1; i <= 6; ++i)
        if (!(1 + b1 * i / 6 + b2 * w2[i] + b4 * w4[i] + (i == 6 ? b6 : 0) > 0)) return false;
    return true;
}

static bool is_in_domain(const OmLens* l, double x, double y) {
    double r = sqrt(x * x + y * y), tilt = -6 * hypot(l->p1, l->p2);
    return is_positive_to(tilt, l->k1, l->k2, l->k3, r) &&
           is_positive_to(tilt, 3 * l->k1, 5 * l->k2, 7 * l->k3, r);
}

// D(x) and the entries of its Jacobian [j0 j1; j1 j2]; `jacobian` may be null.
static void distort(const OmLens* l, double x, double y, double out[2], double jacobian[3]) {
    double s = x * x + y * y, along = l->p2 * x + l->p1 * y;
    double g = 1 + s * (l->k1 + s * (l->k2 + s * l->k3));
    out[0] = g * x + s * l->p2 + 2 * along * x;
    out[1] = g * y + s * l->p1 + 2 * along * y;
    if (!jacobian) return;
    double dg = 2 * (l->k1 + s * (2 * l->k2 + s * 3 * l->k3));
    jacobian[0] = g + dg * x * x + 4 * l->p2 * x + 2 * along;
    jacobian[1] = dg * x * y + 2 * l->p2 * y + 2 * l->p1 * x;
    jacobian[2] = g + dg * y * y + 4 * l->p1 * y + 2 * along;
}

// The point of the domain that D maps to (u, v); false if there is none. The length of the residual falls in every
// step: along a Newton step its derivative is minus its length.
static bool undistort(const OmLens* l, double u, double v, double* x, double* y) {
    *x = 0, *y = 0;
    double at[2], j[3], tolerance = 4e-16 * (1 + fabs(u) + fabs(v));
    distort(l, *x, *y, at, j);
    double ru = u - at[0], rv = v - at[1], residual = hypot(ru, rv);
    for (int k = 0; k < MAX_NEWTON && residual > tolerance; ++k) {
        double det = j[0] * j[2] - j[1] * j[1];  // > 0 in the domain
        double dx = (j[2] * ru - j[1] * rv) / det, dy = (j[0] * rv - j[1] * ru) / det;
        double t = 1, nx, ny, next = residual;
        for (; t > 1e-6; t *= 0.5) {
            nx = *x + t * dx, ny = *y + t * dy;
            if (!is_in_domain(l, nx, ny)) continue;
            distort(l, nx, ny, at, j);
            next = hypot(u - at[0], v - at[1]);
            if (next < residual) break;
        }
        // No step descends: rounding, or (u, v) lies outside.
        if (!(next < residual)) return residual < 1e-13 * (1 + fabs(u) + fabs(v));
        *x = nx, *y = ny;
        ru = u - at[0], rv = v - at[1], residual = next;
    }
    return residual < 1e-13 * (1 + fabs(u) + fabs(v));
}

// ---- projection and rays ------------------------------------------------------------------------------------------

bool om__lens_project(const OmLens* lens, OmVec3 p, double* u, double* v) {
    if (!(p.z > 0)) return false;
    if (!has_distortion(lens)) {
        *u = lens->cx + lens->fx * p.x / p.z;
        *v = lens->cy + lens->fy * p.y / p.z;
        return true;
    }
    double at[2], x = p.x / p.z, y = p.y / p.z;
    if (!is_in_domain(lens, x, y)) return false;
    distort(lens, x, y, at, NULL);
    *u = lens->cx + lens->fx * at[0];
    *v = lens->cy + lens->fy * at[1];
    return true;
}

bool om_camera_project(const OmCamera* c, OmVec3 p_world, double* u, double* v) {
    OmLens lens = om_camera_lens(c);
    return om__lens_project(&lens, om_pose_apply(om_pose_inverse(c->pose_world_camera), p_world), u,
                            v);
}

View om__make_view(const OmCamera* c) {
    OmLens l = om_camera_lens(c);
    OmQuat q = c->pose_world_camera.q;
    View view = {.eye = c->pose_world_camera.p,
                 .first = om_quat_rotate(q, om_vec3(-l.cx / l.fx, -l.cy / l.fy, 1)),
                 .du = om_quat_rotate(q, om_vec3(1 / l.fx, 0, 0)),
                 .dv = om_quat_rotate(q, om_vec3(0, 1 / l.fy, 0)),
                 .has_distortion = has_distortion(&l),
                 .lens = l,
                 .pose = c->pose_world_camera};
    return view;
}

OmVec3 om__view_ray(const View* view, double u, double v) {
    if (!view->has_distortion) return om_madd(om_madd(view->first, u, view->du), v, view->dv);
    const OmLens* l = &view->lens;
    double x, y;
    if (!undistort(l, (u - l->cx) / l->fx, (v - l->cy) / l->fy, &x, &y)) return om_vec3(0, 0, 0);
    return om_quat_rotate(view->pose.q, om_vec3(x, y, 1));
}

OmVec3 om_camera_ray(const OmCamera* c, double u, double v) {
    View view = om__make_view(c);
    return om_normalize(om__view_ray(&view, u, v));
}

static void set_bent_rays(Packet* p, const View* view, double u, double v) {
    for (int i = 0; i < PACKET; ++i) {
        OmVec3 d = om__view_ray(view, u + (i < p->n ? i : p->n - 1), v);
        p->dx[i] = (float)d.x;
        p->dy[i] = (float)d.y;
        p->dz[i] = (float)d.z;
    }
}

void om__set_rays(Packet* p, const View* view, double far_t, double u, double v) {
    OmVec3 start = om_madd(om_madd(view->first, u, view->du), v, view->dv);
    float sx = (float)start.x, sy = (float)start.y, sz = (float)start.z;
    float ux = (float)view->du.x, uy = (float)view->du.y, uz = (float)view->du.z;
    for (int i = 0; i < PACKET; ++i) {
        float k = (float)(i < p->n ? i : p->n - 1);
        p->ox[i] = (float)view->eye.x;
        p->oy[i] = (float)view->eye.y;
        p->oz[i] = (float)view->eye.z;
        p->dx[i] = sx + k * ux;
        p->dy[i] = sy + k * uy;
        p->dz[i] = sz + k * uz;
        p->far_t[i] = (float)far_t;
    }
    if (view->has_distortion) set_bent_rays(p, view, u, v);
}

OmCamera om_camera_resize(const OmCamera* camera, int width, int height) {
    OmCamera c = *camera;
    double scale = (double)height / camera->height;  // height >= 1
    if (c.lens.cx != 0 || c.lens.cy != 0) {
        c.lens.cx = 0.5 * width + scale * (c.lens.cx - 0.5 * camera->width);
        c.lens.cy *= scale;
    }
    c.lens.fx *= scale;
    c.lens.fy *= scale;
    c.width = width;
    c.height = height;
    return c;
}

// ---- checks -----------------------------------------------------------------------------------------------------

static OmStatus check_intrinsics(const OmCamera* c) {
    const OmLens *l = &c->lens, lens = om_camera_lens(c);
    const double value[] = {l->fx, l->fy, l->cx, l->cy, l->k1, l->k2, l->p1, l->p2, l->k3};
    static const char* const name[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
    for (int i = 0; i < 9; ++i)
        OM_CHECK(isfinite(value[i]), OM_INVALID, "camera: lens.%s is %g; a finite number", name[i],
                 value[i]);
    OM_CHECK(
        lens.fx > 0 && lens.fy > 0, OM_INVALID,
        "camera: focal lengths lens.fx %g and lens.fy %g; both above 0, or both 0 for those of fov",
        l->fx, l->fy);
    OM_CHECK(
        lens.cx >= 0 && lens.cx <= c->width && lens.cy >= 0 && lens.cy <= c->height, OM_INVALID,
        "camera: the principal point lens.cx %g, lens.cy %g lies outside of the picture of %d x %d",
        lens.cx, lens.cy, c->width, c->height);
    return OM_OK;
}

// The picture's border lies in the image of the domain, a disc without holes; then all of the picture does.
static OmStatus check_folds(const OmCamera* c) {
    OmLens l = om_camera_lens(c);
    if (!has_distortion(&l)) return OM_OK;
    for (int side = 0; side < 4; ++side)
        for (int i = 0; i < SIDE_POINTS; ++i) {
            double t = (double)i / SIDE_POINTS, x, y;
            double u = c->width * (side == 0 ? t : side == 1 ? 1 : side == 2 ? 1 - t : 0);
            double v = c->height * (side == 0 ? 0 : side == 1 ? t : side == 2 ? 1 : 1 - t);
            OM_CHECK(
                undistort(&l, (u - l.cx) / l.fx, (v - l.cy) / l.fy, &x, &y), OM_INVALID,
                "camera: distortion k1 %g, k2 %g, p1 %g, p2 %g, k3 %g folds the picture: no ray "
                "goes to (%.0f, %.0f); use the calibration of this size of picture",
                l.k1, l.k2, l.p1, l.p2, l.k3, u, v);
        }
    return OM_OK;
}

OmStatus om_camera_check(const OmCamera* c) {
    OM_CHECK(c->width >= 1 && c->width <= 8192 && c->height >= 1 && c->height <= 8192, OM_INVALID,
             "camera: a picture of %d x %d pixels; 1 to 8192 a side", c->width, c->height);
    OM_CHECK((c->lens.fx != 0 || c->lens.fy != 0) || (c->fov > 0 && c->fov < OM_PI), OM_INVALID,
             "camera: fov is %g rad, must be in (0, pi)", c->fov);
    OM_CHECK(c->near_m >= 0 && c->far_m > c->near_m, OM_INVALID,
             "camera: near_m %g and far_m %g do not enclose a range", c->near_m, c->far_m);
    OM_TRY(check_intrinsics(c));
    return check_folds(c);
}
