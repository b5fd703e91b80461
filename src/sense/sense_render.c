// sense_render.c: pictures.
//
// Rays are cast and shaded in packets along a row (sense_shade.c). Rows are cut into blocks that do not depend on the
// worker count.
#include <string.h>

#include "sense/sense_internal.h"

#define LIGHT_RIGHT -0.012  // m, position of the light that casts shadows, from the camera
#define LIGHT_UP 0.035
#define VIGNETTE 0.45f           // fraction of light missing in the corners
#define RAYS_OF_BLOCK (1 << 14)  // of the camera, about

OmSenseOptions om_sense_options_default(void) {
    return (OmSenseOptions){.samples = 1, .has_shadow = true};
}

// ---- pictures -------------------------------------------------------------------------------------------------

typedef struct Render {
    const OmCamera* camera;
    View view;
    Shading shading;
    OmSenseOptions options;
    OmWindow window;
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

// `line` counts the rows of the window.
static void render_row(const Render* r, int line) {
    int w = r->camera->width, h = r->camera->height, samples = r->options.samples;
    int row = r->window.row + line, end = r->window.column + r->window.width;
    float weight = 1.0f / (float)(samples * samples);
    Packet p;
    Surface s;
    for (int x0 = r->window.column; x0 < end; x0 += PACKET) {
        float sum[3][PACKET] = {{0}};
        p.n = end - x0 < PACKET ? end - x0 : PACKET;
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
        size_t at = (size_t)line * (size_t)r->window.width + (size_t)(x0 - r->window.column);
        unsigned char* out = &r->picture->pixel[3 * at];
        for (int i = 0; i < p.n; ++i)
            for (int k = 0; k < 3; ++k) out[3 * i + k] = (unsigned char)byte[k][i];
    }
}

static void render_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int row = begin; row < end; ++row) render_row(ctx, row);
}

// So few that a block of a large picture takes milliseconds: Ctrl-C waits for the blocks that run.
static int rows_of_block(int width, int samples) {
    const int64_t rows = RAYS_OF_BLOCK / ((int64_t)width * samples * samples);
    return rows >= ROWS ? ROWS : rows > 1 ? (int)rows : 1;
}

static Shading make_shading(const OmSenseScene* scene, const OmCamera* camera) {
    OmPose pose = camera->pose_world_camera;
    OmVec3 light = om_pose_apply(pose, om_vec3(LIGHT_RIGHT, -LIGHT_UP, 0));
    OmVec3 up = om_quat_rotate(pose.q, om_vec3(0, -1, 0));
    OmVec3 away = om_sub(om__exposure_point(scene), pose.p);
    OmLens lens = om_camera_lens(camera);
    Shading shading = {.scene = scene,
                       .light = {(float)light.x, (float)light.y, (float)light.z},
                       .up = {(float)up.x, (float)up.y, (float)up.z},
                       .exposure2 = (float)om_norm2(away),
                       .pixel = (float)(1 / (0.5 * (lens.fx + lens.fy)))};
    return shading;
}

OmStatus om_sense_render(const OmSenseScene* scene, const OmCamera* camera,
                         const OmSenseOptions* options, OmPicture* picture) {
    OM_TRY(om_camera_check(camera));
    OM_CHECK(options->samples >= 1 && options->samples <= 4, OM_INVALID, "samples is %d; 1 to 4",
             options->samples);
    OmWindow window = om_window_clip(options->window, camera->width, camera->height);
    OM_CHECK(options->window.width == 0 || memcmp(&window, &options->window, sizeof window) == 0,
             OM_INVALID, "a window of %d x %d pixels at (%d, %d) is not in a picture of %d x %d",
             options->window.width, options->window.height, options->window.column,
             options->window.row, camera->width, camera->height);
    OM_CHECK(picture->width == window.width && picture->height == window.height &&
                 picture->nchannel == 3,
             OM_INVALID, "picture of %d x %d x %d does not fit the camera's %d x %d x 3",
             picture->width, picture->height, picture->nchannel, window.width, window.height);
    Render r = {.camera = camera,
                .view = om__make_view(camera),
                .shading = make_shading(scene, camera),
                .options = *options,
                .window = window,
                .picture = picture};
    return om_parallel_for_stop(options->nworker, window.height,
                                rows_of_block(window.width, options->samples), render_rows, &r);
}
