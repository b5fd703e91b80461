// rl_sketch.h: pictures of small scenes of boxes and balls.
#ifndef OMENTUM_RL_SKETCH_H
#define OMENTUM_RL_SKETCH_H

#include "omentum/sense.h"

typedef struct OmRlSketch {  // a scene that is made for one picture
    OmSenseScene* scene;
    OmCamera camera;
    OmStatus status;  // the first failure of the calls between begin and end
} OmRlSketch;

// An empty scene. `eye` looks at `at`, z is up; fov in degrees.
OmStatus om__rl_sketch_begin(OmVec3 eye, OmVec3 at, double fov_deg, OmRlSketch* p);
// A box from lo to hi in the frame of the pose.
void om__rl_sketch_box(OmRlSketch* p, OmPose pose_world_box, OmVec3 lo, OmVec3 hi,
                       OmSensePart part);
void om__rl_sketch_ball(OmRlSketch* p, OmVec3 center, double radius, OmSensePart part);
// A thin vertical box between the heights end.z and z.
void om__rl_sketch_rod(OmRlSketch* p, OmVec3 end, double z, double half, OmSensePart part);
// The boundary of a mesh whose vertices are at x.
void om__rl_sketch_mesh(OmRlSketch* p, const OmTetMesh* mesh, const double* x, OmSensePart part);
// Draw, and free the scene in any case. picture: empty; its width and height, if set, are the size.
OmStatus om__rl_sketch_end(OmRlSketch* p, OmPicture* picture);

#endif
