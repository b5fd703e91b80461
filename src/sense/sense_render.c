// sense_render.c: cameras and shaded pictures.
//
// The light is that of an endoscope, at the camera, with a second one above it that casts the shadows which tell
// how far the tissue is lifted. Rays are cast and shaded in packets along a row, in single precision, one array a
// coordinate: what depends on the object is gathered a ray at a time, what does not runs side by side. Rows are
// cut into blocks that do not depend on the worker count.
#include <string.h>

#include "sense/sense_internal.h"

#define SHADOW_BIAS 2e-4f  // m off the surface
#define CHECKER 0.01f      // m
#define LIGHT_RIGHT 0.06   // m, where the second light is, from the camera
#define LIGHT_UP 0.12
#define WRAP 0.25f     // cosine behind the terminator that still gets light
#define GRAIN 0.012    // m, wavelength of the variation of shade
#define VIGNETTE 0.3f  // share of light lost in the corners
#define TINY 1e-30f    // under a square root or a line: what has no length stays without

OmSenseOptions om_sense_options_default(void) {
    return (OmSenseOptions){.samples = 1, .has_shadow = true};
}

// ---- cameras --------------------------------------------------------------------------------------------------

static double focal_length(const OmCamera* c) { return 0.5 * c->height / tan(0.5 * c->fov); }

bool om_camera_project(const OmCamera* c, OmVec3 p_world, double* u, double* v) {
    OmVec3 p = om_pose_apply(om_pose_inverse(c->pose_world_camera), p_world);
    if (!(p.z > 0)) return false;
    double f = focal_length(c);
    *u = 0.5 * c->width + f * p.x / p.z;
    *v = 0.5 * c->height + f * p.y / p.z;
    return true;
}

View om__make_view(const OmCamera* c) {
    double f = focal_length(c);
    OmQuat q = c->pose_world_camera.q;
    View view = {.eye = c->pose_world_camera.p,
                 .first = om_quat_rotate(q, om_vec3(-0.5 * c->width / f, -0.5 * c->height / f, 1)),
                 .du = om_quat_rotate(q, om_vec3(1 / f, 0, 0)),
                 .dv = om_quat_rotate(q, om_vec3(0, 1 / f, 0))};
    return view;
}

OmVec3 om_camera_ray(const OmCamera* c, double u, double v) {
    View view = om__make_view(c);
    return om_normalize(om_madd(om_madd(view.first, u, view.du), v, view.dv));
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
}

OmStatus om__check_camera(const OmCamera* c) {
    OM_CHECK(c->width >= 1 && c->width <= 8192 && c->height >= 1 && c->height <= 8192, OM_INVALID,
             "camera: a picture of %d x %d pixels; 1 to 8192 a side", c->width, c->height);
    OM_CHECK(c->fov > 0 && c->fov < OM_PI, OM_INVALID, "camera: fov is %g rad, must be in (0, pi)",
             c->fov);
    OM_CHECK(c->near_m >= 0 && c->far_m > c->near_m, OM_INVALID,
             "camera: near_m %g and far_m %g do not enclose a range", c->near_m, c->far_m);
    return OM_OK;
}

void om__hit_normal(const OmSenseScene* scene, const Packet* p, int i, float n[3]) {
    const Object* o = om__object(scene, p->id[i]);
    n[0] = p->nx[i], n[1] = p->ny[i], n[2] = p->nz[i];
    if (!o->vert_normal) return;
    const int* vert = &o->surface.tri_vert[3 * p->tri[i]];
    const float* a = &o->vert_normal[3 * vert[0]];
    const float* b = &o->vert_normal[3 * vert[1]];
    const float* c = &o->vert_normal[3 * vert[2]];
    float u = p->u[i], v = p->v[i], w = 1 - u - v;
    for (int k = 0; k < 3; ++k) n[k] = w * a[k] + u * b[k] + v * c[k];
}

// ---- pictures -------------------------------------------------------------------------------------------------

typedef struct Render {
    const OmSenseScene* scene;
    const OmCamera* camera;
    View view;
    OmSenseOptions options;
    OmPicture* picture;
    float light[3], up[3];  // where the second light is; towards it from the picture
} Render;

typedef struct Surface {  // at the hits of a packet
    float x[PACKET], y[PACKET], z[PACKET];
    float nx[PACKET], ny[PACKET], nz[PACKET];        // unit normal, towards the camera
    float red[PACKET], green[PACKET], blue[PACKET];  // of the material, then what is seen
    float gloss[PACKET], wrap[PACKET];
} Surface;

// Shades of the material: a smooth sum of waves, so that a finer mesh only shows it better.
void om__choose_shades(Object* o) {
    if (!o->vert_shade) return;
    for (int i = 0; i < o->surface.nvert; ++i) {
        OmVec3 p = om_scale(2 * OM_PI / GRAIN, om_load3(o->surface.x, i));
        double wave =
            sin(p.x + 2.1 * sin(0.7 * p.y + 0.3)) * sin(1.1 * p.y + 1.7 * sin(0.6 * p.x)) +
            0.5 * sin(2.3 * p.x + 1.3 * p.z) * sin(2.1 * p.y - 0.9 * p.z + 1);
        o->vert_shade[i] = (float)(1 + o->look.grain * fmax(-1, fmin(1, wave)));
    }
}

static float object_shade(const Object* o, const Packet* p, int i) {
    float shade = 1;
    if (o->vert_shade) {
        const int* vert = &o->surface.tri_vert[3 * p->tri[i]];
        const float* f = o->vert_shade;
        float u = p->u[i], v = p->v[i];
        shade = (1 - u - v) * f[vert[0]] + u * f[vert[1]] + v * f[vert[2]];
    }
    if (o->look.is_checker) {
        float x = p->ox[i] + p->t[i] * p->dx[i], y = p->oy[i] + p->t[i] * p->dy[i],
              z = p->oz[i] + p->t[i] * p->dz[i];
        int cell = (int)floorf(x / CHECKER) + (int)floorf(y / CHECKER) + (int)floorf(z / CHECKER);
        if (cell & 1) shade *= 0.86f;
    }
    return shade;
}

// What the objects say of their hits: normals and materials.
static void gather(const Render* r, const Packet* p, Surface* s) {
    for (int i = 0; i < PACKET; ++i) {
        if (p->id[i] < 0) {
            s->nx[i] = s->ny[i] = s->nz[i] = 0;
            s->red[i] = s->green[i] = s->blue[i] = s->gloss[i] = s->wrap[i] = 0;
            continue;
        }
        const Object* o = om__object(r->scene, p->id[i]);
        float n[3], shade = object_shade(o, p, i);
        om__hit_normal(r->scene, p, i, n);
        s->nx[i] = n[0], s->ny[i] = n[1], s->nz[i] = n[2];
        s->red[i] = shade * (float)o->look.red;
        s->green[i] = shade * (float)o->look.green;
        s->blue[i] = shade * (float)o->look.blue;
        s->gloss[i] = (float)o->look.gloss;
        s->wrap[i] = o->look.is_smooth ? WRAP : 0;
    }
}

// Positions, unit normals on the side of the triangle that the camera sees, and rays to the second light.
static void prepare(const Render* r, const Packet* p, Surface* s, Packet* shadow) {
    for (int i = 0; i < PACKET; ++i) {
        float t = p->id[i] < 0 ? 0 : p->t[i];
        s->x[i] = p->ox[i] + t * p->dx[i];
        s->y[i] = p->oy[i] + t * p->dy[i];
        s->z[i] = p->oz[i] + t * p->dz[i];
        float nx = s->nx[i], ny = s->ny[i], nz = s->nz[i];
        float along = p->nx[i] * p->dx[i] + p->ny[i] * p->dy[i] + p->nz[i] * p->dz[i];
        float same = p->nx[i] * nx + p->ny[i] * ny + p->nz[i] * nz;
        float scale = 1 / sqrtf(nx * nx + ny * ny + nz * nz + TINY);
        scale = along * same > 0 ? -scale : scale;
        s->nx[i] = scale * nx;
        s->ny[i] = scale * ny;
        s->nz[i] = scale * nz;
        shadow->ox[i] = s->x[i] + SHADOW_BIAS * s->nx[i];
        shadow->oy[i] = s->y[i] + SHADOW_BIAS * s->ny[i];
        shadow->oz[i] = s->z[i] + SHADOW_BIAS * s->nz[i];
        shadow->dx[i] = r->light[0] - shadow->ox[i];
        shadow->dy[i] = r->light[1] - shadow->oy[i];
        shadow->dz[i] = r->light[2] - shadow->oz[i];
        float facing =
            s->nx[i] * shadow->dx[i] + s->ny[i] * shadow->dy[i] + s->nz[i] * shadow->dz[i];
        // what lies far behind the terminator is dark without being asked
        bool is_asked = p->id[i] >= 0 && facing > -WRAP;
        shadow->far_t[i] = is_asked ? 1.0f : -1.0f;
    }
    shadow->n = p->n;
}

// x^48: the width of a highlight on a wet surface.
static inline float gleam_power(float x) {
    float x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8;
    return x16 * x16 * x16;
}

// Diffuse light wraps a little round tissue, which it enters; the sky is brighter than the ground.
static void shade(const Render* r, const Packet* p, const Packet* shadow, Surface* s) {
    for (int i = 0; i < PACKET; ++i) {
        float dx = p->dx[i], dy = p->dy[i], dz = p->dz[i];
        float back = -1 / sqrtf(dx * dx + dy * dy + dz * dz);
        float vx = back * dx, vy = back * dy, vz = back * dz;  // towards the camera
        float lx = shadow->dx[i], ly = shadow->dy[i], lz = shadow->dz[i];
        float near_light = 1 / sqrtf(lx * lx + ly * ly + lz * lz + TINY);
        lx *= near_light, ly *= near_light, lz *= near_light;
        float hx = lx + vx, hy = ly + vy, hz = lz + vz;  // bisector of the two
        float half = 1 / sqrtf(hx * hx + hy * hy + hz * hz + TINY);
        float nx = s->nx[i], ny = s->ny[i], nz = s->nz[i];
        float along = nx * vx + ny * vy + nz * vz;
        float head = along > 0 ? along : 0, edge = 1 - fabsf(along), edge2 = edge * edge;
        float key = (nx * lx + ny * ly + nz * lz + s->wrap[i]) / (1 + s->wrap[i]);
        key = key > 0 ? key : 0;
        float mirror = half * (nx * hx + ny * hy + nz * hz);
        mirror = mirror > 0 ? mirror : 0;
        float lit = shadow->t[i];  // 0 or 1
        float gleam = s->gloss[i] * (0.3f * gleam_power(head) + 0.12f * edge2 * edge2 +
                                     0.6f * lit * gleam_power(mirror));
        float sky = 0.15f + 0.07f * (nx * r->up[0] + ny * r->up[1] + nz * r->up[2]);
        float light = sky + 0.34f * head + (0.12f + 0.88f * lit) * 0.56f * key;
        s->red[i] = light * s->red[i] + gleam;
        s->green[i] = light * s->green[i] + gleam;
        s->blue[i] = light * s->blue[i] + gleam;
    }
}

static void see_packet(const Render* r, Packet* p, float v_share, Surface* s) {
    Packet shadow;
    om__cast(r->scene, p);
    gather(r, p, s);
    prepare(r, p, s, &shadow);
    if (r->options.has_shadow)
        om__cast_shadow(r->scene, &shadow);
    else
        for (int i = 0; i < PACKET; ++i) shadow.t[i] = 1;
    shade(r, p, &shadow, s);
    for (int i = 0; i < PACKET; ++i) {
        if (p->id[i] >= 0) continue;
        s->red[i] = 0.10f - 0.05f * v_share;
        s->green[i] = 0.11f - 0.05f * v_share;
        s->blue[i] = 0.13f - 0.05f * v_share;
    }
}

// From light to the numbers of a screen, 0 to 255: a soft shoulder, then the curve of sRGB (IEC 61966-2-1), here a
// sum of roots fitted to it: within 0.02 of 255 above the 0.0031 where it turns into a line, darker below.
static void tone(const float* light, int* byte) {
    for (int i = 0; i < PACKET; ++i) {
        float x = light[i], x2 = x * x;  // not negative, as no light or colour is
        x = x / sqrtf(sqrtf(1 + x2 * x2));
        float root2 = sqrtf(x), root4 = sqrtf(root2), root8 = sqrtf(root4);
        float y = 0.64231652f * root2 + 0.71216999f * root4 - 0.33689561f * root8 - 0.01754741f * x;
        y = y > 0 ? y : 0;  // at most 1.0003
        byte[i] = (int)(255 * y + 0.5f);
    }
}

static void render_row(const Render* r, int row) {
    int w = r->camera->width, h = r->camera->height, samples = r->options.samples;
    float weight = 1.0f / (float)(samples * samples);
    Packet p;
    Surface s;
    for (int x0 = 0; x0 < w; x0 += PACKET) {
        float sum[3][PACKET] = {{0}};
        p.n = w - x0 < PACKET ? w - x0 : PACKET;
        for (int k = 0; k < samples * samples; ++k) {
            double u = x0 + (k % samples + 0.5) / samples, v = row + (k / samples + 0.5) / samples;
            om__set_rays(&p, &r->view, 4 * r->camera->far_m, u, v);
            see_packet(r, &p, (float)(v / h), &s);
            for (int i = 0; i < PACKET; ++i) {
                sum[0][i] += s.red[i];
                sum[1][i] += s.green[i];
                sum[2][i] += s.blue[i];
            }
        }
        // an endoscope's picture darkens towards its corners
        float y = 2 * ((float)row + 0.5f) / (float)h - 1;
        for (int i = 0; i < PACKET; ++i) {
            float x = 2 * ((float)(x0 + i) + 0.5f) / (float)w - 1;
            float scale = weight * (1 - 0.5f * VIGNETTE * (x * x + y * y));
            sum[0][i] *= scale;
            sum[1][i] *= scale;
            sum[2][i] *= scale;
        }
        int byte[3][PACKET];
        for (int k = 0; k < 3; ++k) tone(sum[k], byte[k]);
        unsigned char* out = &r->picture->pixel[3 * ((size_t)row * (size_t)w + (size_t)x0)];
        for (int i = 0; i < p.n; ++i)
            for (int k = 0; k < 3; ++k) out[3 * i + k] = (unsigned char)byte[k][i];
    }
}

static void render_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int row = begin; row < end; ++row) render_row(ctx, row);
}

OmStatus om_sense_render(const OmSenseScene* scene, const OmCamera* camera,
                         const OmSenseOptions* options, OmPicture* picture) {
    OM_TRY(om__check_camera(camera));
    OM_CHECK(options->samples >= 1 && options->samples <= 4, OM_INVALID, "samples is %d; 1 to 4",
             options->samples);
    OM_CHECK(picture->width == camera->width && picture->height == camera->height &&
                 picture->nchannel == 3,
             OM_INVALID, "picture of %d x %d x %d does not fit the camera's %d x %d x 3",
             picture->width, picture->height, picture->nchannel, camera->width, camera->height);
    OmPose pose = camera->pose_world_camera;
    OmVec3 light = om_pose_apply(pose, om_vec3(LIGHT_RIGHT, -LIGHT_UP, 0));
    OmVec3 up = om_quat_rotate(pose.q, om_vec3(0, -1, 0));
    Render r = {.scene = scene,
                .camera = camera,
                .view = om__make_view(camera),
                .options = *options,
                .picture = picture,
                .light = {(float)light.x, (float)light.y, (float)light.z},
                .up = {(float)up.x, (float)up.y, (float)up.z}};
    om_parallel_for(options->nworker, camera->height, ROWS, render_rows, &r);
    return OM_OK;
}
