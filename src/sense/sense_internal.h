// sense_internal.h: rays, independent of the library that casts them.
#ifndef OMENTUM_SENSE_INTERNAL_H
#define OMENTUM_SENSE_INTERNAL_H

#include "omentum/sense.h"

#define PACKET 8  // rays cast together
#define ROWS 8    // of pixels a block, at most

typedef struct Object {
    OmSurface surface;  // current positions
    OmSenseLook look;
    float* vert_normal;  // unit normals of the vertices (nvert x 3); null if not smooth
    float* rest;         // texture coordinates of the vertices (nvert x 3); null without texture
    float* buffer;       // positions shared with the ray caster (nvert x 3 and padding)
    void* geometry;
    bool is_shown, is_changed;
} Object;

// Rays (input) and hits (output), one array for each coordinate, so that loops over the packet use SIMD. Directions
// have any length; distances are multiples of it.
typedef struct Packet {
    int n;
    float ox[PACKET], oy[PACKET], oz[PACKET];  // origin
    float dx[PACKET], dy[PACKET], dz[PACKET];  // direction
    float far_t[PACKET];                       // negative: no ray
    float t[PACKET];                           // of the hit
    float nx[PACKET], ny[PACKET], nz[PACKET];  // normal of the triangle, of any length and side
    float u[PACKET], v[PACKET];                // barycentric coordinates of corners 1 and 2
    int id[PACKET];                            // object, -1 none
    int tri[PACKET];
} Packet;

void om__cast(const OmSenseScene* scene, Packet* packet);
// t[i] becomes 0 where a triangle is hit before far_t[i], and 1 otherwise; no other field is written.
void om__cast_shadow(const OmSenseScene* scene, Packet* packet);
const Object* om__object(const OmSenseScene* scene, int id);
// The voxels of a texture; null if no object has it.
const float* om__texture(const OmSenseScene* scene, OmSenseTexture texture);
// Middle of the first object when it was added: exposure is set for this point.
OmVec3 om__exposure_point(const OmSenseScene* scene);

// ---- textures: periodic volumes of TEXTURE_SIZE^3 voxels with four channels ------------------------------------

#define TEXTURE_SIZE 48       // voxels a side
#define TEXTURE_PERIOD 0.042  // m

enum { CHANNEL_SHADE, CHANNEL_TINT, CHANNEL_HEIGHT, CHANNEL_WET, NCHANNEL };

typedef struct Texel {
    // factor on the colour; fraction of the second colour, 0 to 1; m; factor on gloss
    float value[NCHANNEL];
    float slope[3];  // gradient of the height in texture coordinates, m
} Texel;

// Voxels of a texture (TEXTURE_SIZE^3 x NCHANNEL), a constant of this library. `texture` is not OM_TEXTURE_NONE.
OmStatus om__texture_bake(OmSenseTexture texture, float** voxel);
// Texture coordinates, in periods, of a point in m.
OmVec3 om__texture_coordinates(OmSenseTexture texture, OmVec3 p);
// Interpolated at texture coordinates t.
void om__texture_sample(const float* voxel, const float t[3], Texel* texel);
// Factors from an object's colour to its second colour, the colour of septa and vessels.
void om__texture_tint(OmSenseTexture texture, float factor[3]);

// The rays of a picture: without distortion the direction through (u, v) is first + u du + v dv. Directions have length
// 1 along the axis of the camera, so that distances along a ray are depths.
typedef struct View {
    OmVec3 eye, first, du, dv;
    bool has_distortion;
    OmLens lens;  // with fx, fy, cx, cy
    OmPose pose;
} View;

View om__make_view(const OmCamera* camera);
// Pixel coordinates of a point in the frame of the camera, of a lens with fx, fy, cx, cy; as om_camera_project.
bool om__lens_project(const OmLens* lens, OmVec3 p, double* u, double* v);
// Direction through (u, v), of length 1 along the axis; zero where the lens has no ray.
OmVec3 om__view_ray(const View* view, double u, double v);
// Rays through (u + i, v) for the n lanes of a packet; the other lanes repeat the last ray and are not cast.
void om__set_rays(Packet* packet, const View* view, double far_t, double u, double v);
// The normal at hit i: interpolated from the vertices, or the triangle's; any length.
void om__hit_normal(const OmSenseScene* scene, const Packet* packet, int i, float n[3]);

// ---- shading of a packet ------------------------------------------------------------------------------------------

typedef struct Shading {  // constants of a picture
    const OmSenseScene* scene;
    float light[3];   // position of the light that casts shadows, m
    float up[3];      // unit, up in the picture
    float exposure2;  // squared distance from the camera of a surface of full brightness, m^2
    float pixel;      // size of a pixel at 1 m, m
} Shading;

typedef struct Surface {  // at the hits of a packet
    float x[PACKET], y[PACKET], z[PACKET];
    float nx[PACKET], ny[PACKET], nz[PACKET];  // unit normal, towards the camera
    float red[PACKET], green[PACKET],
        blue[PACKET];  // of the material; after om__shade the light seen
    float gloss[PACKET], metal[PACKET], wrap[PACKET], alpha2[PACKET];
} Surface;

// Normals and materials at the hits, and rays towards the light.
void om__shade_begin(const Shading* shading, const Packet* packet, Surface* surface,
                     Packet* shadow);
// Light that reaches the camera; shadow->t is 1 where the point sees the light source, else 0.
void om__shade(const Shading* shading, const Packet* packet, const Packet* shadow,
               Surface* surface);
// Convert light to sRGB, 0 to 255.
void om__shade_tone(float light[3][PACKET], int byte[3][PACKET]);

#endif
