// sense_render.c: cameras and pictures.
//
// Rays are cast and shaded in packets along a row (sense_shade.c). Rows are cut into blocks that do not depend on the
// worker count.
#include <string.h>

#include "sense/sense_internal.h"

#define LIGHT_RIGHT -0.012  // m, position of the light that casts shadows, from the camera
#define LIGHT_UP 0.035
#define VIGNETTE 0.45f  // fraction of light missing in the corners

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

// ---- pictures -------------------------------------------------------------------------------------------------

typedef struct Render {
    const OmCamera* camera;
    View view;
    Shading shading;
    OmSenseOptions options;
    OmPicture* picture;
} Render;

static void see_packet(const Render* r, Packet* p, Surface* s) {
    Packet shadow;
    om__cast(r->shading.scene, p);
    om__shade_begin(&r->shading, p, s, &shadow);
    if (r->options.has_shadow)
        om__cast_shadow(r->shading.scene, &shadow);
    else
        for (int i = 0; i < PACKET; ++i) shadow.t[i] = 1;
    om__shade(&r->shading, p, &shadow, s);
    for (int i = 0; i < PACKET; ++i) {  // a dark drape far behind
        if (p->id[i] >= 0) continue;
        s->red[i] = 0.0025f;
        s->green[i] = 0.0070f;
        s->blue[i] = 0.0065f;
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
            see_packet(r, &p, &s);
            for (int i = 0; i < PACKET; ++i) {
                sum[0][i] += s.red[i];
                sum[1][i] += s.green[i];
                sum[2][i] += s.blue[i];
            }
        }
        // the light of an endoscope is weaker towards the corners
        float y = 2 * ((float)row + 0.5f) / (float)h - 1;
        for (int i = 0; i < PACKET; ++i) {
            float x = 2 * ((float)(x0 + i) + 0.5f) / (float)w - 1;
            float scale = weight * (1 - 0.5f * VIGNETTE * (x * x + y * y));
            sum[0][i] *= scale;
            sum[1][i] *= scale;
            sum[2][i] *= scale;
        }
        int byte[3][PACKET];
        om__shade_tone(sum, byte);
        unsigned char* out = &r->picture->pixel[3 * ((size_t)row * (size_t)w + (size_t)x0)];
        for (int i = 0; i < p.n; ++i)
            for (int k = 0; k < 3; ++k) out[3 * i + k] = (unsigned char)byte[k][i];
    }
}

static void render_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int row = begin; row < end; ++row) render_row(ctx, row);
}

static Shading make_shading(const OmSenseScene* scene, const OmCamera* camera) {
    OmPose pose = camera->pose_world_camera;
    OmVec3 light = om_pose_apply(pose, om_vec3(LIGHT_RIGHT, -LIGHT_UP, 0));
    OmVec3 up = om_quat_rotate(pose.q, om_vec3(0, -1, 0));
    OmVec3 away = om_sub(om__exposure_point(scene), pose.p);
    Shading shading = {.scene = scene,
                       .light = {(float)light.x, (float)light.y, (float)light.z},
                       .up = {(float)up.x, (float)up.y, (float)up.z},
                       .exposure2 = (float)om_norm2(away),
                       .pixel = (float)(1 / focal_length(camera))};
    return shading;
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
    Render r = {.camera = camera,
                .view = om__make_view(camera),
                .shading = make_shading(scene, camera),
                .options = *options,
                .picture = picture};
    om_parallel_for(options->nworker, camera->height, ROWS, render_rows, &r);
    return OM_OK;
}
