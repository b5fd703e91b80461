// sense_internal.h: rays, independent of the library that casts them.
#ifndef OMENTUM_SENSE_INTERNAL_H
#define OMENTUM_SENSE_INTERNAL_H

#include "omentum/sense.h"

#define PACKET 8  // rays cast together

typedef struct Object {
    OmSurface surface;  // current positions
    OmSenseLook look;
    double* vert_normal;  // of the vertices (nvert x 3); null if not smooth
    float* vert_shade;    // factors on the colour (nvert); null without grain
    float* buffer;        // positions shared with the ray caster (nvert x 3 and padding)
    void* geometry;
    bool is_shown, is_changed;
} Object;

typedef struct Packet {  // rays in, hits out
    int n;
    OmVec3 origin[PACKET], direction[PACKET];
    double far_t[PACKET];
    double t[PACKET];  // distance of the hit, HUGE_VAL none
    int id[PACKET];    // object, -1 none
    int tri[PACKET];
    float u[PACKET], v[PACKET];  // barycentric coordinates of corners 1 and 2
} Packet;

void om__cast(const OmSenseScene* scene, Packet* packet);
// t[i] becomes 0 where something is in the way before far_t[i], and stays HUGE_VAL otherwise.
void om__cast_shadow(const OmSenseScene* scene, Packet* packet);
int om__object_count(const OmSenseScene* scene);
const Object* om__object(const OmSenseScene* scene, int id);
// Factors on the colour from the positions now, for objects with grain.
void om__choose_shades(Object* object);
// Unit normal of a hit: of the vertices interpolated, or of the triangle.
OmVec3 om__hit_normal(const Object* object, int tri, double u, double v);

#endif
