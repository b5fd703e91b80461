// study_phantoms_case.h: phantoms of silicone on the board of thesis 4.3.1: shapes, stitches, grasps, lifts, sites.
//
// Everything here was committed before any method was run on it; development uses the last two shapes.
#ifndef OMENTUM_STUDY_PHANTOMS_CASE_H
#define OMENTUM_STUDY_PHANTOMS_CASE_H

#include "omentum/world.h"

#define PHANTOM_NSHAPE 4   // circle, clover, rectangle, drop
#define PHANTOM_NDEV 2     // ellipse, square with a notch: for development
#define PHANTOM_NSET 3     // sets of holes of a shape
#define PHANTOM_NSTART 2   // flat, over the capsule
#define PHANTOM_NGRASP 4   // of a set, at most
#define PHANTOM_NLEVEL 6   // of a lift, at most
#define PHANTOM_STEP 0.01  // m, between two levels
#define PHANTOM_NHOLE 7    // along a side of the board
#define PHANTOM_MAX_CASE ((PHANTOM_NSHAPE + PHANTOM_NDEV) * PHANTOM_NSET * PHANTOM_NSTART)
#define PHANTOM_MAX_LIFT (PHANTOM_MAX_CASE * PHANTOM_NGRASP)

typedef enum PhantomStart { PHANTOM_FLAT, PHANTOM_CAPSULE } PhantomStart;

typedef struct PhantomShape {
    const char* name;
    double thickness;       // m
    double edge;            // m, of the twin's mesh; its mean edge is 0.9 of it
    double young, density;  // of the silicone, Pa and kg/m^3
} PhantomShape;

typedef struct PhantomSet {  // of stitched holes, in one region or two
    int nregion;
    int nhole[2];
    int hole[2][8]
            [2];  // column and row, 0 to 6, of each hole                   (nregion x nhole x 2)
} PhantomSet;

extern const PhantomShape om__phantoms_shape[PHANTOM_NSHAPE + PHANTOM_NDEV];
extern const PhantomSet om__phantoms_set[PHANTOM_NSHAPE + PHANTOM_NDEV][PHANTOM_NSET];

typedef struct PhantomCase {  // one configuration: a shape, stitched, on the board
    int shape, set;
    PhantomStart start;
    int ngrasp;
    OmVec3 grasp[PHANTOM_NGRASP];  // tip when the jaw closes, m, task frame
    OmVec3 lift[PHANTOM_NGRASP];   // m, from this tip, for a rise of 1 m
    int nlevel[PHANTOM_NGRASP];    // until the free length ends
    OmVec3 capsule;                // centre of its base, m; z = 0
    double reach;                  // m, from there to where the phantom lies on the board again
} PhantomCase;

// Position of a hole on the board, m.
OmVec3 om__phantoms_hole(int column, int row);
// Signed distance of the outline, m, negative inside, from above.
double om__phantoms_outline(int shape, double x, double y);
// Distance from the region that a set of stitches holds, m, below 0 inside.
double om__phantoms_region(const PhantomSet* set, double x, double y);
// Height of the underside over the board where the phantom is not lifted, m.
double om__phantoms_height(const PhantomCase* c, double x, double y);
// Grasps, lifts and the place of the capsule, by the rules at the head of study_phantoms_case.c.
PhantomCase om__phantoms_case(int shape, int set, PhantomStart start);
// A name for files: "circle-1-flat".
void om__phantoms_name(const PhantomCase* c, char* name, size_t size);
// Seed of the noise of a lift: 4100 to 4195, for development 9196 to 9243. The runs of the kidney, another scene, have
// 4106 to 4115.
uint64_t om__phantoms_seed(const PhantomCase* c, int grasp);
// Scene and site of the twin or the world; edges of meshes are `coarse` times as long as usual. The twin's set
// "attachment" is empty; that of the world holds the truth.
OmScene om__phantoms_scene(const PhantomCase* c, OmSiteRole role);
OmStatus om__phantoms_site(const PhantomCase* c, OmSiteRole role, double coarse,
                           const OmScene* scene, OmSite* site);
// Nonzero for vertices of the site's underside that the stitches hold; 0 for all others     (nvert)
void om__phantoms_held(const PhantomCase* c, const OmSite* site, unsigned char* attached);

// ---- what happened in the world ---------------------------------------------------------------------------

typedef struct PhantomMoment {         // of one picture
    double time;                       // s
    OmArmObservation arm[OM_MAX_ARM];  // measured
    double force;                      // N, pull of the grasp
    int nbad;                          // steps of the world so far that did not converge
} PhantomMoment;

typedef struct PhantomHead {
    int nlevel;        // lifted levels that were reached
    int arm;           // that grasps
    OmPose grasp_tip;  // measured, when the jaw closed
    OmCamera camera;   // where the robot believes it
    OmVec3 shift;      // m, from its true place to there
    OmPsm psm[OM_MAX_ARM];
    double end_force;  // N, at the level that was not kept because of the force limit; 0: none
    PhantomMoment at[1 + PHANTOM_NLEVEL];  // at rest, then at each level
} PhantomHead;

typedef struct PhantomTruth {  // of one lift; om__phantoms_truth_done frees; zero-initialise
    OmScene scene;
    OmSite site;
    OmTetMesh mesh;     // the site's, with a vertex for each node of the quadratic elements
    OmSurface surface;  // boundary of `mesh` at rest on the board
    int* vert;          // vertex of `mesh` of each of its vertices
    size_t npixel;
    char file[96];  // its name in the folder
    uint64_t hash;  // of everything it depends on
    // The four are one block, the contents of the file; of 1 + PHANTOM_NLEVEL moments.
    PhantomHead* head;
    double* x;             // positions of `mesh`, m                       (moments x nvert x 3)
    float* depth;          // m                                            (moments x npixel)
    unsigned char* color;  //                                              (moments x npixel x 3)
} PhantomTruth;

// Room for a lift, with the result if a file of `dir` has one of this lift.
OmStatus om__phantoms_truth_open(const PhantomCase* c, int grasp, double coarse, const char* dir,
                                 bool* is_there, PhantomTruth* truth);
// Lift the phantom in the world. Several threads may do this at a time, each with its own truth.
OmStatus om__phantoms_truth_make(const PhantomCase* c, int grasp, int nworker, PhantomTruth* truth);
OmStatus om__phantoms_truth_save(const PhantomTruth* truth, const char* dir);
void om__phantoms_truth_done(PhantomTruth* truth);
// The picture of a level (0: at rest) as an observation; om_observation_done frees.
OmStatus om__phantoms_observe(const PhantomTruth* truth, int level, OmObservation* obs);

#endif
