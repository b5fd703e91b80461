// sense_render.c: pictures and depth from rays.
//
// The light is that of an endoscope, at the camera, with a weaker one above it that casts the shadows which
// tell how far the tissue is lifted. Rows are cut into blocks that do not depend on the worker count.
#include <string.h>

#include "sense/sense_internal.h"

#define ROWS 8            // of pixels a block
#define SHADOW_BIAS 2e-4  // m off the surface
#define CHECKER 0.01      // m
#define LIGHT_RIGHT 0.06  // m, where the second light is, from the camera
#define LIGHT_UP 0.12
#define WRAP 0.25     // cosine behind the terminator that still gets light
#define GRAIN 0.012   // m, wavelength of the variation of shade
#define VIGNETTE 0.3  // share of light lost in the corners
#define NTONE 2048
#define MOST_LIGHT 2.0

OmSenseOptions om_sense_default_options(void) {
    return (OmSenseOptions){.samples = 1, .has_shadow = true};
}

// What all rays of a picture share: the direction through (u, v) is first + u du + v dv, not normalised,
// one long along the axis.
typedef struct View {
    OmVec3 eye, first, du, dv;
} View;

static double focal_length(const OmCamera* c) { return 0.5 * c->height / tan(0.5 * c->fov); }

bool om_camera_project(const OmCamera* c, OmVec3 p_world, double* u, double* v) {
    OmVec3 p = om_pose_apply(om_pose_inverse(c->pose_world_camera), p_world);
    if (!(p.z > 0)) return false;
    double f = focal_length(c);
    *u = 0.5 * c->width + f * p.x / p.z;
    *v = 0.5 * c->height + f * p.y / p.z;
    return true;
}

static View make_view(const OmCamera* c) {
    double f = focal_length(c);
    OmQuat q = c->pose_world_camera.q;
    View view = {.eye = c->pose_world_camera.p,
                 .first = om_quat_rotate(q, om_vec3(-0.5 * c->width / f, -0.5 * c->height / f, 1)),
                 .du = om_quat_rotate(q, om_vec3(1 / f, 0, 0)),
                 .dv = om_quat_rotate(q, om_vec3(0, 1 / f, 0))};
    return view;
}

static OmVec3 view_ray(const View* view, double u, double v) {
    return om_normalize(om_madd(om_madd(view->first, u, view->du), v, view->dv));
}

OmVec3 om_camera_ray(const OmCamera* c, double u, double v) {
    View view = make_view(c);
    return view_ray(&view, u, v);
}

static OmStatus check_camera(const OmCamera* c) {
    OM_CHECK(c->width >= 1 && c->width <= 8192 && c->height >= 1 && c->height <= 8192, OM_INVALID,
             "camera: a picture of %d x %d pixels; 1 to 8192 a side", c->width, c->height);
    OM_CHECK(c->fov > 0 && c->fov < OM_PI, OM_INVALID, "camera: fov is %g rad, must be in (0, pi)",
             c->fov);
    OM_CHECK(c->near_m >= 0 && c->far_m > c->near_m, OM_INVALID,
             "camera: near_m %g and far_m %g do not enclose a range", c->near_m, c->far_m);
    return OM_OK;
}

OmVec3 om__hit_normal(const Object* o, int tri, double u, double v) {
    const int* vert = &o->surface.tri_vert[3 * tri];
    if (o->vert_normal) {
        OmVec3 n = om_scale(1 - u - v, om_load3(o->vert_normal, vert[0]));
        n = om_madd(n, u, om_load3(o->vert_normal, vert[1]));
        n = om_madd(n, v, om_load3(o->vert_normal, vert[2]));
        if (om_norm2(n) > 0) return om_normalize(n);
    }
    OmVec3 a = om_load3(o->surface.x, vert[0]);
    return om_normalize(om_cross(om_sub(om_load3(o->surface.x, vert[1]), a),
                                 om_sub(om_load3(o->surface.x, vert[2]), a)));
}

static void set_ray(Packet* p, int i, const View* view, double far_t, double u, double v) {
    p->origin[i] = view->eye;
    p->direction[i] = view_ray(view, u, v);
    p->far_t[i] = far_t;
}

// ---- pictures -------------------------------------------------------------------------------------------------

typedef struct Render {
    const OmSenseScene* scene;
    const OmCamera* camera;
    View view;
    OmSenseOptions options;
    OmPicture* picture;
    OmVec3 light, up;               // where the second light is; towards it from the picture
    unsigned char tone[NTONE + 1];  // bytes of the square roots of light
} Render;

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

static OmVec3 surface_color(const Object* o, int tri, double u, double v, OmVec3 p) {
    OmVec3 c = om_vec3(o->look.red, o->look.green, o->look.blue);
    if (o->vert_shade) {
        const int* vert = &o->surface.tri_vert[3 * tri];
        const float* f = o->vert_shade;
        c = om_scale(
            (1 - u - v) * (double)f[vert[0]] + u * (double)f[vert[1]] + v * (double)f[vert[2]], c);
    }
    if (!o->look.is_checker) return c;
    int cell = (int)floor(p.x / CHECKER) + (int)floor(p.y / CHECKER);
    return om_scale(cell & 1 ? 0.86 : 1.0, c);
}

static double square(double x) { return x * x; }

// x^48: the width of a highlight on a wet surface.
static double gleam_power(double x) {
    double x16 = square(square(square(square(x))));
    return x16 * x16 * x16;
}

// Diffuse light wraps a little round tissue, which it enters; the sky is brighter than the ground.
static OmVec3 shade(const Render* r, const Object* o, OmVec3 color, OmVec3 p, OmVec3 n, OmVec3 view,
                    bool is_lit) {
    if (om_dot(n, view) < 0) n = om_scale(-1, n);
    OmVec3 to_light = om_normalize(om_sub(r->light, p));
    double wrap = o->look.is_smooth ? WRAP : 0;
    double head = om_dot(n, view);
    double key = fmax(0, (om_dot(n, to_light) + wrap) / (1 + wrap));
    double gleam = 0.3 * gleam_power(head) + 0.12 * square(square(1 - head));
    if (is_lit)
        gleam += 0.6 * gleam_power(fmax(0, om_dot(n, om_normalize(om_add(to_light, view)))));
    else
        key *= 0.12;
    gleam *= o->look.gloss;
    double sky = 0.15 + 0.07 * om_dot(n, r->up);
    OmVec3 c = om_scale(sky + 0.34 * head + 0.56 * key, color);
    return om_add(c, om_vec3(gleam, gleam, gleam));
}

static OmVec3 background(double v_share) {
    return om_vec3(0.10 - 0.05 * v_share, 0.11 - 0.05 * v_share, 0.13 - 0.05 * v_share);
}

static void shade_packet(const Render* r, Packet* p, const double* v_share, OmVec3* color) {
    Packet shadow = *p;
    OmVec3 point[PACKET], normal[PACKET], base[PACKET];
    for (int i = 0; i < p->n; ++i) {
        shadow.t[i] = HUGE_VAL;
        if (p->id[i] < 0) {
            shadow.far_t[i] = -1;
            continue;
        }
        const Object* o = om__object(r->scene, p->id[i]);
        point[i] = om_madd(p->origin[i], p->t[i], p->direction[i]);
        normal[i] = om__hit_normal(o, p->tri[i], (double)p->u[i], (double)p->v[i]);
        base[i] = surface_color(o, p->tri[i], (double)p->u[i], (double)p->v[i], point[i]);
        OmVec3 out = om_dot(normal[i], p->direction[i]) > 0 ? om_scale(-1, normal[i]) : normal[i];
        shadow.origin[i] = om_madd(point[i], SHADOW_BIAS, out);
        OmVec3 to_light = om_sub(r->light, shadow.origin[i]);
        shadow.far_t[i] = om_norm(to_light);
        shadow.direction[i] = om_normalize(to_light);
    }
    if (r->options.has_shadow) om__cast_shadow(r->scene, &shadow);
    for (int i = 0; i < p->n; ++i) {
        color[i] = p->id[i] < 0 ? background(v_share[i])
                                : shade(r, om__object(r->scene, p->id[i]), base[i], point[i],
                                        normal[i], om_scale(-1, p->direction[i]), shadow.t[i] != 0);
    }
}

// From light to the numbers of a screen: gamma 2.2 with a soft shoulder, by the square root of light, where
// the curve is smooth.
static void make_tone(unsigned char* tone) {
    for (int i = 0; i <= NTONE; ++i) {
        double x = MOST_LIGHT * square((double)i / NTONE);
        x = x / (1 + 0.25 * square(x));
        tone[i] = (unsigned char)(255 * pow(fmin(1, x), 1 / 2.2) + 0.5);
    }
}

static unsigned char to_byte(const Render* r, double light) {
    double x = fmax(0, fmin(1, light / MOST_LIGHT));
    return r->tone[(int)(sqrt(x) * NTONE + 0.5)];
}

// An endoscope's picture darkens towards its corners.
static double vignette(const OmCamera* c, double u, double v) {
    double x = 2 * u / c->width - 1, y = 2 * v / c->height - 1;
    return 1 - 0.5 * VIGNETTE * (x * x + y * y);
}

static void render_row(const Render* r, int row) {
    int w = r->camera->width, s = r->options.samples;
    for (int x0 = 0; x0 < w; x0 += PACKET) {
        int n = w - x0 < PACKET ? w - x0 : PACKET;
        OmVec3 sum[PACKET] = {{0, 0, 0}};
        for (int k = 0; k < s * s; ++k) {
            Packet p = {.n = n};
            double v = row + (k / s + 0.5) / s, v_share[PACKET];
            for (int i = 0; i < n; ++i) {
                set_ray(&p, i, &r->view, 4 * r->camera->far_m, x0 + i + (k % s + 0.5) / s, v);
                v_share[i] = v / r->camera->height;
            }
            om__cast(r->scene, &p);
            OmVec3 color[PACKET];
            shade_packet(r, &p, v_share, color);
            for (int i = 0; i < n; ++i) sum[i] = om_add(sum[i], color[i]);
        }
        for (int i = 0; i < n; ++i) {
            OmVec3 c = om_scale(vignette(r->camera, x0 + i + 0.5, row + 0.5) / (s * s), sum[i]);
            unsigned char* out =
                &r->picture->pixel[3 * ((size_t)row * (size_t)w + (size_t)(x0 + i))];
            out[0] = to_byte(r, c.x), out[1] = to_byte(r, c.y), out[2] = to_byte(r, c.z);
        }
    }
}

static void render_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int row = begin; row < end; ++row) render_row(ctx, row);
}

OmStatus om_sense_render(const OmSenseScene* scene, const OmCamera* camera,
                         const OmSenseOptions* options, OmPicture* picture) {
    OM_TRY(check_camera(camera));
    OM_CHECK(options->samples >= 1 && options->samples <= 4, OM_INVALID, "samples is %d; 1 to 4",
             options->samples);
    OM_CHECK(picture->width == camera->width && picture->height == camera->height &&
                 picture->nchannel == 3,
             OM_INVALID, "picture of %d x %d x %d does not fit the camera's %d x %d x 3",
             picture->width, picture->height, picture->nchannel, camera->width, camera->height);
    OmPose pose = camera->pose_world_camera;
    Render r = {.scene = scene,
                .camera = camera,
                .view = make_view(camera),
                .options = *options,
                .picture = picture,
                .light = om_pose_apply(pose, om_vec3(LIGHT_RIGHT, -LIGHT_UP, 0)),
                .up = om_quat_rotate(pose.q, om_vec3(0, -1, 0))};
    make_tone(r.tone);
    om_parallel_for(options->nworker, camera->height, ROWS, render_rows, &r);
    return OM_OK;
}

// ---- depth ------------------------------------------------------------------------------------------------------

typedef struct Depth {
    const OmSenseScene* scene;
    const OmCamera* camera;
    View view;
    float* depth;
    int* id;
    float* normal;
} Depth;

static void depth_packet(const Depth* d, Packet* p, size_t first) {
    OmVec3 forward = om_quat_rotate(d->camera->pose_world_camera.q, om_vec3(0, 0, 1));
    for (int i = 0; i < p->n; ++i) {
        double z = p->id[i] >= 0 ? p->t[i] * om_dot(p->direction[i], forward) : 0;
        bool is_in_range = p->id[i] >= 0 && z >= d->camera->near_m && z <= d->camera->far_m;
        size_t k = first + (size_t)i;
        d->depth[k] = is_in_range ? (float)z : 0.0f;
        if (d->id) d->id[k] = is_in_range ? p->id[i] : -1;
        if (!d->normal) continue;
        OmVec3 n = om_vec3(0, 0, 0);
        if (is_in_range) {
            n = om__hit_normal(om__object(d->scene, p->id[i]), p->tri[i], (double)p->u[i],
                               (double)p->v[i]);
            if (om_dot(n, p->direction[i]) > 0) n = om_scale(-1, n);
        }
        d->normal[3 * k] = (float)n.x, d->normal[3 * k + 1] = (float)n.y,
                      d->normal[3 * k + 2] = (float)n.z;
    }
}

static void depth_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Depth* d = ctx;
    int w = d->camera->width;
    for (int row = begin; row < end; ++row) {
        for (int x0 = 0; x0 < w; x0 += PACKET) {
            Packet p = {.n = w - x0 < PACKET ? w - x0 : PACKET};
            for (int i = 0; i < p.n; ++i)
                set_ray(&p, i, &d->view, 4 * d->camera->far_m, x0 + i + 0.5, row + 0.5);
            om__cast(d->scene, &p);
            depth_packet(d, &p, (size_t)row * (size_t)w + (size_t)x0);
        }
    }
}

OmStatus om_sense_depth(const OmSenseScene* scene, const OmCamera* camera, int nworker,
                        float* depth, int* id, float* normal) {
    OM_TRY(check_camera(camera));
    Depth d = {scene, camera, make_view(camera), depth, id, normal};
    om_parallel_for(nworker, camera->height, ROWS, depth_rows, &d);
    return OM_OK;
}

OmDepthNoise om_depth_noise_default(uint64_t seed) {
    return (OmDepthNoise){
        .a = 2e-4, .b = 1.5e-3, .min_grazing = 0.15, .dropout = 0.005, .seed = seed};
}

void om_depth_add_noise(const OmDepthNoise* noise, const OmCamera* c, uint64_t frame,
                        const float* normal, float* depth) {
    View view = make_view(c);
    for (int i = 0; i < c->width * c->height; ++i) {
        double z = (double)depth[i];
        if (z <= 0) continue;
        OmRng rng = om_rng_init(noise->seed, frame << 26 | (uint64_t)i);  // 2^26 pixels at most
        double grazing = 1;
        if (normal) {
            OmVec3 n = om_vec3((double)normal[3 * i], (double)normal[3 * i + 1],
                               (double)normal[3 * i + 2]);
            grazing = fabs(om_dot(n, view_ray(&view, i % c->width + 0.5, i / c->width + 0.5)));
        }
        bool is_lost = om_rng_uniform(&rng) < noise->dropout || grazing < noise->min_grazing;
        double noisy = z + (noise->a + noise->b * z * z) * om_rng_normal(&rng);
        depth[i] = is_lost || noisy < c->near_m || noisy > c->far_m ? 0.0f : (float)noisy;
    }
}

int om_depth_to_cloud(const OmCamera* c, const float* depth, const int* id, const float* normal,
                      int only, double* x, double* normal_out) {
    double f = focal_length(c);
    int n = 0;
    for (int i = 0; i < c->width * c->height; ++i) {
        double z = (double)depth[i];
        if (z <= 0 || (only >= 0 && id && id[i] != only)) continue;
        double u = i % c->width + 0.5, v = i / c->width + 0.5;
        OmVec3 p = om_vec3((u - 0.5 * c->width) / f * z, (v - 0.5 * c->height) / f * z, z);
        om_store3(x, n, om_pose_apply(c->pose_world_camera, p));
        if (normal && normal_out) {
            OmVec3 m = om_vec3((double)normal[3 * i], (double)normal[3 * i + 1],
                               (double)normal[3 * i + 2]);
            om_store3(normal_out, n, m);
        }
        ++n;
    }
    return n;
}

// ---- visibility ---------------------------------------------------------------------------------------------------

#define VISIBILITY_SLACK 5e-5  // m before the point: the rounding of float rays at arm's length
#define MAX_THROUGH 16         // ignored surfaces a ray may pass

// Cast towards each point; hits on ignored objects are passed through.
static void mark_visible(const OmSenseScene* scene, Packet* p, uint64_t ignore, bool* is_seen) {
    double total[PACKET], start[PACKET];
    OmVec3 eye[PACKET];
    bool is_open[PACKET];
    int nopen = p->n;
    for (int i = 0; i < p->n; ++i) {
        total[i] = p->far_t[i];
        start[i] = 0;
        eye[i] = p->origin[i];
        is_open[i] = true;
        is_seen[i] = true;
    }
    for (int pass = 0; pass < MAX_THROUGH && nopen > 0; ++pass) {
        om__cast(scene, p);
        for (int i = 0; i < p->n; ++i) {
            if (!is_open[i]) continue;
            bool is_through = p->id[i] >= 0 && p->id[i] < 64 && (ignore >> p->id[i] & 1);
            if (!is_through) {
                is_seen[i] = p->id[i] < 0;
                is_open[i] = false;
                --nopen;
                continue;
            }
            start[i] += p->t[i] + VISIBILITY_SLACK;
            p->origin[i] = om_madd(eye[i], start[i], p->direction[i]);
            p->far_t[i] = fmax(0, total[i] - start[i]);
        }
    }
}

OmStatus om_sense_visibility(const OmSenseScene* scene, const OmCamera* camera, const double* x,
                             const double* normal, int npoint, uint64_t ignore, double* share) {
    OM_TRY(check_camera(camera));
    int nfacing = 0, nseen = 0;
    Packet p = {0};
    bool is_seen[PACKET];
    OmVec3 eye = camera->pose_world_camera.p;
    for (int i = 0; i <= npoint; ++i) {
        if (i < npoint) {
            OmVec3 q = om_load3(x, i), d = om_sub(q, eye);
            double u, v;
            bool is_facing = !normal || om_dot(om_load3(normal, i), d) < 0;
            if (is_facing && om_camera_project(camera, q, &u, &v) && u >= 0 && u < camera->width &&
                v >= 0 && v < camera->height) {
                p.origin[p.n] = eye;
                p.direction[p.n] = om_normalize(d);
                p.far_t[p.n] = om_norm(d) - VISIBILITY_SLACK;
                ++p.n;
            }
        }
        if (p.n == PACKET || (i == npoint && p.n > 0)) {
            nfacing += p.n;
            mark_visible(scene, &p, ignore, is_seen);
            for (int k = 0; k < p.n; ++k) nseen += is_seen[k];
            p.n = 0;
        }
    }
    *share = nfacing > 0 ? (double)nseen / nfacing : 0;
    return OM_OK;
}
