// study_internal.h: what the files of the room share.
#ifndef OMENTUM_STUDY_INTERNAL_H
#define OMENTUM_STUDY_INTERNAL_H

#include "omentum/shape_sdf.h"
#include "omentum/study.h"

struct OmStudyBody {
    char name[64];
    OmVec3 lo, hi;  // box around the body
    OmVec3 up;      // unit, towards the probe
    int nlesion;
    OmStudyLesion lesion[OM_STUDY_MAX_LESION];
    OmVec3 half;  // phantom: half-axes, m
    bool is_file;
    OmSdf sdf;          // file: its distance field
    double low, high;   // file: the least and largest dot(up, vertex)
    int nheld;          // file: boundary vertices of the set "attachment"
    double* held;       // (nheld x 3)
    double held_reach;  // file: as far as this from one of them is held too, m
};

double om__study_eval_phantom(const OmStudyBody* body, OmVec3 p);
// Is a point of the surface held? `edge`: of the mesh that asks.
bool om__study_is_held(const OmStudyBody* body, OmVec3 p, double edge);
// The body as an OmShapeFn; ctx is the body.
double om__study_shape_fn(void* ctx, OmVec3 p);
// The unit vector across `normal` that is nearest to `wish`, or to another axis if they are parallel.
OmVec3 om__study_across(OmVec3 normal, OmVec3 wish);

// The probe of the thesis: its face, m.
#define PROBE_LONG 0.050
#define PROBE_WIDE 0.010

#endif
