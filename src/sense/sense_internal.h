// sense_internal.h: rays, independent of the library that casts them.
#ifndef OMENTUM_SENSE_INTERNAL_H
#define OMENTUM_SENSE_INTERNAL_H

#include "omentum/sense.h"

#define PACKET 8  // rays cast together
#define ROWS 8    // of pixels a block

typedef struct Object {
    OmSurface surface;  // current positions
    OmSenseLook look;
    float* vert_normal;  // unit normals of the vertices (nvert x 3); null if not smooth
    float* vert_shade;   // factors on the colour (nvert); null without grain
    float* buffer;       // positions shared with the ray caster (nvert x 3 and padding)
    void* geometry;
    bool is_shown, is_changed;
} Object;

// Rays in, hits out, one array a coordinate so that loops over the packet run side by side. Directions have
// any length; distances count in it.
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
// t[i] becomes 0 where something is in the way before far_t[i], and 1 otherwise; nothing else is written.
void om__cast_shadow(const OmSenseScene* scene, Packet* packet);
const Object* om__object(const OmSenseScene* scene, int id);
// Factors on the colour from the positions now, for objects with grain.
void om__choose_shades(Object* object);

// What all rays of a picture share: the direction through (u, v) is first + u du + v dv, one long along the
// axis of the camera, so that distances along it are depths.
typedef struct View {
    OmVec3 eye, first, du, dv;
} View;

View om__make_view(const OmCamera* camera);
// Rays through (u + i, v) for the n lanes of a packet; the others repeat the last and are not cast.
void om__set_rays(Packet* packet, const View* view, double far_t, double u, double v);
OmStatus om__check_camera(const OmCamera* camera);
// The normal shown at hit i: of the vertices, interpolated, or of the triangle; not of unit length.
void om__hit_normal(const OmSenseScene* scene, const Packet* packet, int i, float n[3]);

#endif
