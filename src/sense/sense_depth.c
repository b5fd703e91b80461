// sense_depth.c: the depth camera (depth, noise, point clouds) and the visibility of a region.
//
// Rays have length 1 along the axis of the camera, so the distance from the ray caster is the depth. Each pixel has
// its own block of random numbers: one for dropout, two for a normal deviate (Box and Muller).
#include <string.h>

#include "base/base_rng.h"
#include "sense/sense_internal.h"

typedef struct Depth {
    const OmSenseScene* scene;
    const OmCamera* camera;
    View view;
    float* depth;
    int *id, *tri;
    float* normal;
} Depth;

// Unit normal at hit i, towards the camera.
static void unit_normal(const Depth* d, const Packet* p, int i, float* n) {
    om__hit_normal(d->scene, p, i, n);
    float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    bool is_away = n[0] * p->dx[i] + n[1] * p->dy[i] + n[2] * p->dz[i] > 0;
    float scale = length > 0 ? (is_away ? -1 : 1) / length : 0;
    for (int k = 0; k < 3; ++k) n[k] *= scale;
}

static void depth_packet(const Depth* d, const Packet* p, size_t first) {
    float min = (float)d->camera->near_m, max = (float)d->camera->far_m;
    for (int i = 0; i < p->n; ++i) {
        bool is_in_range = p->id[i] >= 0 && p->t[i] >= min && p->t[i] <= max;
        size_t k = first + (size_t)i;
        d->depth[k] = is_in_range ? p->t[i] : 0.0f;
        if (d->id) d->id[k] = is_in_range ? p->id[i] : -1;
        if (d->tri) d->tri[k] = is_in_range ? p->tri[i] : -1;
        if (!d->normal) continue;
        if (is_in_range)
            unit_normal(d, p, i, &d->normal[3 * k]);
        else
            memset(&d->normal[3 * k], 0, 3 * sizeof(float));
    }
}

static void depth_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    const Depth* d = ctx;
    int w = d->camera->width;
    Packet p;
    for (int row = begin; row < end; ++row) {
        for (int x0 = 0; x0 < w; x0 += PACKET) {
            p.n = w - x0 < PACKET ? w - x0 : PACKET;
            om__set_rays(&p, &d->view, 2 * d->camera->far_m, x0 + 0.5, row + 0.5);
            om__cast(d->scene, &p);
            depth_packet(d, &p, (size_t)row * (size_t)w + (size_t)x0);
        }
    }
}

OmStatus om_sense_depth(const OmSenseScene* scene, const OmCamera* camera, int nworker,
                        float* depth, int* id, float* normal) {
    OM_TRY(om_camera_check(camera));
    Depth d = {scene, camera, om__make_view(camera), depth, id, NULL, normal};
    return om_parallel_for_stop(nworker, camera->height, ROWS, depth_rows, &d);
}

OmStatus om_sense_triangles(const OmSenseScene* scene, const OmCamera* camera, int nworker,
                            float* depth, int* id, int* tri) {
    OM_TRY(om_camera_check(camera));
    Depth d = {scene, camera, om__make_view(camera), depth, id, tri, NULL};
    return om_parallel_for_stop(nworker, camera->height, ROWS, depth_rows, &d);
}

// ---- noise --------------------------------------------------------------------------------------------------

OmDepthNoise om_depth_noise_default(uint64_t seed) {
    return (OmDepthNoise){
        .a = 2e-4, .b = 1.5e-3, .min_grazing = 0.15, .dropout = 0.005, .seed = seed};
}

typedef struct Noise {
    const OmDepthNoise* noise;
    const OmCamera* camera;
    View view;
    uint64_t frame;
    const float* normal;
    float* depth;
} Noise;

// Standard normal from two words, up to 6.7 standard deviations.
static float normal_deviate(uint32_t first, uint32_t second) {
    double u = ((double)first + 1) * 0x1p-32;  // in (0, 1]: the logarithm is finite
    double v = (double)second * 0x1p-32;
    return sqrtf(-2 * logf((float)u)) * cosf((float)(2 * OM_PI * v));
}

// Whether the cosine between the normal n and the ray d is below the limit.
static bool is_grazing(const float* n, OmVec3 d, double limit) {
    double along = (double)n[0] * d.x + (double)n[1] * d.y + (double)n[2] * d.z;
    return along * along < limit * limit * om_norm2(d);
}

static void noise_row(const Noise* s, int row) {
    const OmDepthNoise* noise = s->noise;
    int w = s->camera->width;
    float a = (float)noise->a, b = (float)noise->b;
    float min = (float)s->camera->near_m, max = (float)s->camera->far_m;
    double lost_below = noise->dropout * 0x1p32;
    OmVec3 start = om_madd(om_madd(s->view.first, 0.5, s->view.du), row + 0.5, s->view.dv);
    uint32_t random[4][8];
    for (int column = 0; column < w; ++column) {
        int i = row * w + column, lane = column % 8;
        if (lane == 0)  // 2^26 pixels at most
            om__rng_block8(noise->seed, s->frame << 26 | (uint64_t)i, random);
        float z = s->depth[i];
        if (!(z > 0)) continue;
        bool is_lost = (double)random[0][lane] < lost_below;
        if (s->normal)
            is_lost |=
                is_grazing(&s->normal[3 * i],
                           s->view.has_distortion ? om__view_ray(&s->view, column + 0.5, row + 0.5)
                                                  : om_madd(start, column, s->view.du),
                           noise->min_grazing);
        float noisy = z + (a + b * z * z) * normal_deviate(random[1][lane], random[2][lane]);
        s->depth[i] = is_lost || noisy < min || noisy > max ? 0.0f : noisy;
    }
}

static void noise_rows(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int row = begin; row < end; ++row) noise_row(ctx, row);
}

void om_depth_add_noise(const OmDepthNoise* noise, const OmCamera* camera, uint64_t frame,
                        const float* normal, float* depth) {
    Noise s = {noise, camera, om__make_view(camera), frame, normal, depth};
    om_parallel_for(noise->nworker, camera->height, ROWS, noise_rows, &s);
}

// ---- point clouds -------------------------------------------------------------------------------------------

int om_depth_to_cloud(const OmCamera* c, const float* depth, const int* id, const float* normal,
                      int only, double* x, double* normal_out) {
    View view = om__make_view(c);
    int n = 0;
    for (int i = 0, row = 0; row < c->height; ++row) {
        OmVec3 start = om_madd(view.first, row + 0.5, view.dv);
        for (int column = 0; column < c->width; ++column, ++i) {
            double z = (double)depth[i];
            if (!(z > 0) || !isfinite(z) || (only >= 0 && id && id[i] != only)) continue;
            OmVec3 ray = view.has_distortion ? om__view_ray(&view, column + 0.5, row + 0.5)
                                             : om_madd(start, column + 0.5, view.du);
            om_store3(x, n, om_madd(view.eye, z, ray));
            for (int k = 0; k < 3 && normal && normal_out; ++k)
                normal_out[3 * n + k] = (double)normal[3 * i + k];
            ++n;
        }
    }
    return n;
}

// ---- visibility ---------------------------------------------------------------------------------------------------

#define VISIBILITY_SLACK 5e-5f  // m before the point: the rounding of float rays at arm's length
#define MAX_THROUGH 16          // ignored surfaces that a ray passes at most

// Cast a ray to each point; a hit on an ignored object does not end the ray.
static void mark_visible(const OmSenseScene* scene, Packet* p, uint64_t ignore, bool* is_seen) {
    float total[PACKET], start[PACKET] = {0};
    bool is_open[PACKET];
    Packet eye = *p;
    int nopen = p->n;
    for (int i = 0; i < p->n; ++i) {
        total[i] = p->far_t[i];
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
                p->far_t[i] = -1;  // this ray has ended
                --nopen;
                continue;
            }
            start[i] += p->t[i] + VISIBILITY_SLACK;
            p->ox[i] = eye.ox[i] + start[i] * eye.dx[i];
            p->oy[i] = eye.oy[i] + start[i] * eye.dy[i];
            p->oz[i] = eye.oz[i] + start[i] * eye.dz[i];
            p->far_t[i] = fmaxf(0, total[i] - start[i]);
        }
    }
}

// Append the ray from the eye to a point.
static void aim(Packet* p, OmVec3 eye, OmVec3 ray) {
    OmVec3 d = om_normalize(ray);
    int i = p->n++;
    p->ox[i] = (float)eye.x, p->oy[i] = (float)eye.y, p->oz[i] = (float)eye.z;
    p->dx[i] = (float)d.x, p->dy[i] = (float)d.y, p->dz[i] = (float)d.z;
    p->far_t[i] = (float)om_norm(ray) - VISIBILITY_SLACK;
}

OmStatus om_sense_count_visible(const OmSenseScene* scene, const OmCamera* camera, const double* x,
                                const double* normal, int npoint, uint64_t ignore,
                                OmVisibility* visibility) {
    *visibility = (OmVisibility){.npoint = npoint};
    OM_TRY(om_camera_check(camera));
    Packet p = {0};
    bool is_seen[PACKET];
    OmVec3 eye = camera->pose_world_camera.p;
    for (int i = 0; i <= npoint; ++i) {
        if (i < npoint) {
            OmVec3 q = om_load3(x, i), d = om_sub(q, eye);
            double u, v;
            bool is_facing = !normal || om_dot(om_load3(normal, i), d) < 0;
            bool is_inside = om_camera_project(camera, q, &u, &v) && u >= 0 && u < camera->width &&
                             v >= 0 && v < camera->height;
            if (!is_facing)
                ++visibility->naway;
            else if (!is_inside)
                ++visibility->noutside;
            else
                aim(&p, eye, d);
        }
        if (p.n == PACKET || (i == npoint && p.n > 0)) {
            mark_visible(scene, &p, ignore, is_seen);
            for (int k = 0; k < p.n; ++k) {
                visibility->nseen += is_seen[k];
                visibility->nhidden += !is_seen[k];
            }
            p.n = 0;
        }
    }
    return OM_OK;
}

OmStatus om_sense_visibility(const OmSenseScene* scene, const OmCamera* camera, const double* x,
                             const double* normal, int npoint, uint64_t ignore, double* share) {
    OmVisibility v;
    *share = 0;
    OM_TRY(om_sense_count_visible(scene, camera, x, normal, npoint, ignore, &v));
    if (npoint > 0) *share = (double)v.nseen / npoint;
    return OM_OK;
}
