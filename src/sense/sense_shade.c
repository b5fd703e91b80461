// sense_shade.c: shading of a packet of hits, eight pixels at a time.
//
// Two lights, as an endoscope with two fibres: one at the camera, which casts no shadow, and one a little above it,
// whose shadows show the height of lifted tissue. Both fall off with the square of the distance. A surface has
//   - diffuse light beyond the terminator of tissue, red further than blue: light scattered inside tissue is red,
//   - a wet film: highlights with the distribution of Trowbridge and Reitz (GGX), Schlick's Fresnel term and the
//     visibility 1 / (4 (l.h)^2) (C. Kelemen, L. Szirmay-Kalos, Eurographics short presentations 2001),
//   - metal: highlights have the colour of the material, and a bright and a dark half space are reflected,
//   - the texture's bumps: with height h(u, v) over a triangle with edges a, b and normal N = a x b the normal loses
//     (h_u (b x N) + h_v (N x a)) / |N|^2, on the deformed triangle.
// Data of objects are gathered one ray at a time. All other computations are loops over the packet without
// branches, compiled for several processors (OM_MULTIVERSION), and without contraction: the same bits on each.
#include <string.h>

#include "base/base_multiversion.h"
#include "sense/sense_internal.h"

#define SHADOW_BIAS 2e-4f  // m off the surface
#define CHECKER 0.01f      // m
#define WRAP 0.3f          // cosine behind the terminator that still gets red light, on tissue
#define TINY 1e-30f        // added before a root or a division: a zero vector remains zero
#define FALL_MAX 1.7f      // brightness of surfaces close to the light
#define WET_ALPHA 0.14f    // roughness of tissue
#define FILM 4.0f  // brightness of highlights of a wet film; 1 would be as dim as room light
#define METAL_ALPHA 0.32f

// ---- materials ----------------------------------------------------------------------------------------------------

static void corner_normal(const Object* o, int vert, const float face[3], float n[3]) {
    memcpy(n, &o->vert_normal[3 * vert], 3 * sizeof *n);
    float along = n[0] * face[0] + n[1] * face[1] + n[2] * face[2];
    if (along < (float)o->look.crease) memcpy(n, face, 3 * sizeof *n);
}

void om__hit_normal(const OmSenseScene* scene, const Packet* p, int i, float n[3]) {
    const Object* o = om__object(scene, p->id[i]);
    n[0] = p->nx[i], n[1] = p->ny[i], n[2] = p->nz[i];
    if (!o->vert_normal) return;
    const int* vert = &o->surface.tri_vert[3 * p->tri[i]];
    float corner[3][3];
    if (o->look.crease > 0) {
        float scale = 1 / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + TINY);
        const float face[3] = {scale * n[0], scale * n[1], scale * n[2]};
        for (int c = 0; c < 3; ++c) corner_normal(o, vert[c], face, corner[c]);
    } else {
        for (int c = 0; c < 3; ++c)
            memcpy(corner[c], &o->vert_normal[3 * vert[c]], sizeof corner[c]);
    }
    float u = p->u[i], v = p->v[i], w = 1 - u - v;
    for (int k = 0; k < 3; ++k) n[k] = w * corner[0][k] + u * corner[1][k] + v * corner[2][k];
}

static inline void cross(const float a[3], const float b[3], float out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Tilt the normal n at hit i by the slope of the texture.
static void add_bumps(const Object* o, const int* vert, float edge_rest[2][3], const Texel* texel,
                      float strength, float n[3]) {
    float edge[2][3], N[3], bN[3], Na[3];
    for (int k = 0; k < 3; ++k) {
        float x0 = o->buffer[3 * vert[0] + k];
        edge[0][k] = o->buffer[3 * vert[1] + k] - x0;
        edge[1][k] = o->buffer[3 * vert[2] + k] - x0;
    }
    cross(edge[0], edge[1], N);
    cross(edge[1], N, bN);
    cross(N, edge[0], Na);
    float scale = strength / (dot(N, N) + TINY), length = sqrtf(dot(n, n) + TINY);
    float du = scale * dot(texel->slope, edge_rest[0]),
          dv = scale * dot(texel->slope, edge_rest[1]);
    for (int k = 0; k < 3; ++k) n[k] = n[k] / length - du * bN[k] - dv * Na[k];
}

// Colour, gloss and bumps of the texture at hit i.
static void apply_texture(const Shading* sh, const Object* o, const Packet* p, int i, float n[3],
                          Surface* s) {
    const int* vert = &o->surface.tri_vert[3 * p->tri[i]];
    const float *t0 = &o->rest[3 * vert[0]], *t1 = &o->rest[3 * vert[1]],
                *t2 = &o->rest[3 * vert[2]];
    float edge_rest[2][3], t[3], tint[3];
    for (int k = 0; k < 3; ++k) {
        edge_rest[0][k] = t1[k] - t0[k];
        edge_rest[1][k] = t2[k] - t0[k];
        t[k] = t0[k] + p->u[i] * edge_rest[0][k] + p->v[i] * edge_rest[1][k];
    }
    Texel texel;
    om__texture_sample(om__texture(sh->scene, o->look.texture), t, &texel);
    om__texture_tint(o->look.texture, tint);
    float shade = texel.value[CHANNEL_SHADE], share = texel.value[CHANNEL_TINT];
    s->red[i] *= shade * (1 + share * (tint[0] - 1));
    s->green[i] *= shade * (1 + share * (tint[1] - 1));
    s->blue[i] *= shade * (1 + share * (tint[2] - 1));
    s->gloss[i] *= texel.value[CHANNEL_WET];
    // bumps smaller than a pixel would glitter from frame to frame
    const float voxel = (float)(TEXTURE_PERIOD / TEXTURE_SIZE);
    float pixel = sh->pixel * p->t[i], strength = voxel / (voxel + 0.5f * pixel);
    if (o->look.texture != OM_TEXTURE_STEEL) add_bumps(o, vert, edge_rest, &texel, strength, n);
}

static float checker_shade(const Packet* p, int i) {
    float x = p->ox[i] + p->t[i] * p->dx[i], y = p->oy[i] + p->t[i] * p->dy[i],
          z = p->oz[i] + p->t[i] * p->dz[i];
    int cell = (int)floorf(x / CHECKER) + (int)floorf(y / CHECKER) + (int)floorf(z / CHECKER);
    return cell & 1 ? 0.80f : 1.0f;
}

// Normals, of any length and side, and materials.
static void gather(const Shading* sh, const Packet* p, Surface* s) {
    for (int i = 0; i < PACKET; ++i) {
        if (p->id[i] < 0) {
            s->nx[i] = s->ny[i] = s->nz[i] = 0;
            s->red[i] = s->green[i] = s->blue[i] = 0;
            s->gloss[i] = s->wrap[i] = s->metal[i] = s->alpha2[i] = 0;
            continue;
        }
        const Object* o = om__object(sh->scene, p->id[i]);
        float n[3], shade = o->look.is_checker ? checker_shade(p, i) : 1;
        om__hit_normal(sh->scene, p, i, n);
        s->red[i] = shade * (float)o->look.red;
        s->green[i] = shade * (float)o->look.green;
        s->blue[i] = shade * (float)o->look.blue;
        s->gloss[i] = (float)o->look.gloss;
        s->metal[i] = (float)o->look.metal;
        s->wrap[i] = o->look.is_smooth && !(o->look.metal > 0) ? WRAP : 0;
        s->alpha2[i] = o->look.metal > 0 ? METAL_ALPHA * METAL_ALPHA : WET_ALPHA * WET_ALPHA;
        if (o->rest) apply_texture(sh, o, p, i, n, s);
        s->nx[i] = n[0], s->ny[i] = n[1], s->nz[i] = n[2];
    }
}

// ---- side by side -------------------------------------------------------------------------------------------------

// Positions, unit normals on the side of the triangle that the camera sees, and rays to the light.
OM_MULTIVERSION static void prepare(const Shading* sh, const Packet* p, Surface* s,
                                    Packet* shadow) {
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
        shadow->dx[i] = sh->light[0] - shadow->ox[i];
        shadow->dy[i] = sh->light[1] - shadow->oy[i];
        shadow->dz[i] = sh->light[2] - shadow->oz[i];
        float facing =
            s->nx[i] * shadow->dx[i] + s->ny[i] * shadow->dy[i] + s->nz[i] * shadow->dz[i];
        // no ray from surfaces that no light of this source reaches
        bool is_cast = p->id[i] >= 0 && facing > -WRAP;
        shadow->far_t[i] = is_cast ? 1.0f : -1.0f;
    }
    shadow->n = p->n;
}

OM_INLINE float positive(float x) { return x > 0 ? x : 0; }

OM_INLINE float power5(float x) {
    float x2 = x * x;
    return x2 * x2 * x;
}

// Distribution of Trowbridge and Reitz times pi, for the cosine between normal and half vector.
OM_INLINE float distribution(float cosine, float alpha2) {
    float k = cosine * cosine * (alpha2 - 1) + 1;
    return alpha2 / (k * k + TINY);
}

// Diffuse light of cosine c, wrapped by w.
OM_INLINE float wrapped(float c, float w) { return positive((c + w) / (1 + w)); }

OM_MULTIVERSION void om__shade(const Shading* sh, const Packet* p, const Packet* shadow,
                               Surface* s) {
    for (int i = 0; i < PACKET; ++i) {
        float nx = s->nx[i], ny = s->ny[i], nz = s->nz[i];
        float t = p->id[i] < 0 ? 1 : p->t[i];
        float dx = p->dx[i], dy = p->dy[i], dz = p->dz[i], d2 = dx * dx + dy * dy + dz * dz;
        float back = -1 / sqrtf(d2), vx = back * dx, vy = back * dy, vz = back * dz;
        float lx = shadow->dx[i], ly = shadow->dy[i], lz = shadow->dz[i];
        float l2 = lx * lx + ly * ly + lz * lz + TINY, near_light = 1 / sqrtf(l2);
        lx *= near_light, ly *= near_light, lz *= near_light;
        float fall_v = sh->exposure2 / (t * t * d2 + TINY), fall_l = sh->exposure2 / l2;
        fall_v = fall_v < FALL_MAX ? fall_v : FALL_MAX;
        fall_l = fall_l < FALL_MAX ? fall_l : FALL_MAX;
        float hx = lx + vx, hy = ly + vy, hz = lz + vz;  // towards the half vector
        float h2 = hx * hx + hy * hy + hz * hz + TINY, half = 1 / sqrtf(h2);
        float nv = nx * vx + ny * vy + nz * vz, nl = nx * lx + ny * ly + nz * lz;
        float head = positive(nv), key = positive(nl), nh = half * (nx * hx + ny * hy + nz * hz);
        float lit = 0.06f + 0.94f * shadow->t[i];
        float w = s->wrap[i], m = s->metal[i], a2 = s->alpha2[i];
        // highlights of the two lights; l.h of unit vectors is |l + v| / 2
        float lh = 0.5f * h2 * half, film = 0.04f + 0.96f * power5(1 - lh);
        float spot_l =
            0.62f * lit * key * fall_l * distribution(positive(nh), a2) * 0.25f / (lh * lh + 1e-3f);
        float spot_v = 0.50f * head * fall_v * distribution(head, a2) * 0.25f;
        float white = FILM * s->gloss[i] * (1 - m) * (film * spot_l + 0.04f * spot_v);
        float up = nx * sh->up[0] + ny * sh->up[1] + nz * sh->up[2];
        white += s->gloss[i] * (1 - m) * 0.05f * power5(1 - head) * fall_v;
        // metal reflects the bright half space above, at r.up = 2 (n.v) (n.up) - v.up, and the dark one below
        float sky = 2 * nv * up - (vx * sh->up[0] + vy * sh->up[1] + vz * sh->up[2]);
        float mirror = m * s->gloss[i] *
                       (spot_l + spot_v + fall_v * (0.16f + 0.14f * sky + 0.25f * head * head));
        float wall = (0.075f + 0.035f * up) * (0.5f + 0.5f * fall_v);
        float soft_l = 0.62f * lit * fall_l * (1 - m), soft_v = 0.36f * fall_v * (1 - m);
        float r = soft_l * wrapped(nl, w) + soft_v * wrapped(nv, w);
        float g = soft_l * wrapped(nl, 0.6f * w) + soft_v * wrapped(nv, 0.6f * w);
        float b = soft_l * wrapped(nl, 0.4f * w) + soft_v * wrapped(nv, 0.4f * w);
        s->red[i] = s->red[i] * (wall + r + mirror) + white;
        s->green[i] = s->green[i] * (wall + g + mirror) + white;
        s->blue[i] = s->blue[i] * (wall + b + mirror) + white;
    }
}

void om__shade_begin(const Shading* sh, const Packet* p, Surface* s, Packet* shadow) {
    gather(sh, p, s);
    prepare(sh, p, s, shadow);
}

// The curve of sRGB (IEC 61966-2-1) as a sum of roots: within 0.02 of 255 above 0.0031, where sRGB turns into a line,
// and darker below.
OM_INLINE float srgb(float x) {
    float root2 = sqrtf(x), root4 = sqrtf(root2), root8 = sqrtf(root4);
    return 0.64231652f * root2 + 0.71216999f * root4 - 0.33689561f * root8 - 0.01754741f * x;
}

// A soft shoulder on the brightest channel; the others keep their ratio to it, so hue and saturation stay.
OM_MULTIVERSION void om__shade_tone(float light[3][PACKET], int byte[3][PACKET]) {
    for (int i = 0; i < PACKET; ++i) {
        float r = light[0][i], g = light[1][i], b = light[2][i];  // not negative
        float max = r > g ? r : g;
        max = max > b ? max : b;
        float scale = 1 / sqrtf(sqrtf(1 + max * max * max * max));
        byte[0][i] = (int)(255 * positive(srgb(scale * r)) + 0.5f);  // at most 255
        byte[1][i] = (int)(255 * positive(srgb(scale * g)) + 0.5f);
        byte[2][i] = (int)(255 * positive(srgb(scale * b)) + 0.5f);
    }
}
