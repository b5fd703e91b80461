// study_match_case.h: cases with a known truth, for correspondence and for attachments.
//
// A setup is a sheet of the simulated world: another mesh and another stiffness than the twin's, held somewhere, and
// moved by the world's arms. A case is a setup with a view of it and with a belief of the twin. The tables of
// study_match_case.c were committed before any method was measured on them.
#ifndef OMENTUM_STUDY_MATCH_CASE_H
#define OMENTUM_STUDY_MATCH_CASE_H

#include "omentum/fem.h"
#include "omentum/match.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"
#include "studies/study_cases.h"
#include "studies/study_hand.h"

#define MATCH_MAX_TICK 700  // of a motion and the wait after it
#define MATCH_MAX_WAY 40    // pictures kept on the way
#define MATCH_NGRASP 3      // views of an attachment case

typedef enum MatchView {  // of the depth camera
    VIEW_FULL,            // depth noise, tools in view
    VIEW_EXACT,           // no depth noise
    VIEW_BARE,            // no tool in view
    NVIEW
} MatchView;

typedef enum MatchBelief {  // attachments of the twin
    BELIEF_RIGHT,           // those of the truth
    BELIEF_FEWER,           // 15 mm less all around
    BELIEF_MORE,            // 15 mm more all around
    BELIEF_ELSEWHERE,       // a box of the setup
    BELIEF_NONE,
    NBELIEF
} MatchBelief;

// A motion of one or two tips in the task frame (m): turned about a line by `angle`, then shifted.
typedef struct MatchMove {
    int narm;                  // that hold tissue
    int arm[OM_MAX_ARM];       // of the world
    OmVec3 grasp[OM_MAX_ARM];  // tip when the jaw closes
    OmVec3 line, axis;         // a point of the line and its direction, a unit vector
    double angle;              // rad
    OmVec3 shift;
} MatchMove;

typedef struct MatchSetup {
    char name[48];            // of its files
    int cells;                // of the twin along a side; the world has one and a half as many
    OmTissueElement element;  // of twin and world; linear ones of the world lie in two layers
    int layout[2];            // seeds of random attached patches; 0: none. Both 0: the box
    double share;             // of the underside, of each patch
    OmVec3 lo, hi;            // m, task frame: the attached box
    OmVec3 else_lo, else_hi;  // m: the box of BELIEF_ELSEWHERE
    double elevation;         // rad, of the depth camera
    // Pictures are kept each time the tips have gone so far, m, and as often in the wait; 0: none is kept.
    double way;
    MatchMove move;
} MatchSetup;

typedef struct MatchCase {  // of the study of correspondence
    char name[48];
    int setup;  // index into om__match_setup
    MatchView view;
    double seen;     // share of the seen points that is kept, cut by a plane
    bool keeps_far;  // the part away from the grasp is kept, not the part around it
    MatchBelief belief;
} MatchCase;

typedef struct MatchLayout {  // of the study of attachments
    int layout[2];
    double share;                   // of the underside, of each patch
    double lift;                    // m
    double grasp[MATCH_NGRASP][2];  // m, task frame
} MatchLayout;

#define MATCH_NSETUP 9
#define MATCH_NLAYOUT 12  // of a set
#define MATCH_NSET 3
extern const MatchSetup om__match_setup[MATCH_NSETUP];
extern const MatchCase om__match_case[];
extern const int om__match_ncase;
extern const MatchCase om__match_quick_case[];
extern const int om__match_nquick;
extern const MatchLayout om__match_layout[MATCH_NSET * MATCH_NLAYOUT];
extern const char* const om__match_belief_name[NBELIEF];
extern const char* const om__match_view_name[NVIEW];

// The setup of one view of an attachment case; layouts of all sets count on.
MatchSetup om__match_layout_setup(int layout, int grasp, int cells);
// The scene of a setup with a belief of the twin.
OmScene om__match_make_scene(const MatchSetup* setup, MatchBelief belief);
// The twin's or the world's site, with both patches where the setup has two.
OmStatus om__match_build_site(const MatchSetup* setup, MatchBelief belief, OmSiteRole role,
                              OmScene* scene, OmSite* site);
// The tip of an arm of the move at `share` of the way, task frame, m.
OmVec3 om__match_tip(const MatchMove* move, int k, double share);

// ---- what happened in the world ---------------------------------------------------------------------

typedef struct MatchTick {
    OmPose tip[OM_MAX_ARM];  // measured pose_world_tip of each arm of the world
} MatchTick;

typedef struct MatchHead {
    int nmove, ntick;                  // ticks of the motion, and with the wait after it
    double dt;                         // s, of a tick
    double time;                       // s, of the picture
    OmPose grasp_tip[OM_MAX_ARM];      // measured, when the jaw closed      (of the move)
    OmArmObservation arm[OM_MAX_ARM];  // at the picture                     (of the world)
    OmPsm psm[OM_MAX_ARM];             // of the world
    OmCamera camera;                   // the depth camera
    int nbad;                          // steps of the world that did not converge
    double force[OM_MAX_ARM];          // N, largest pull of each arm of the move
    MatchTick tick[MATCH_MAX_TICK];    // (ntick)
} MatchHead;

// A picture on the way: the first before the grasp, the tissue at rest.
typedef struct MatchWay {
    int tick;     // of the motion after which it was taken; 0: before the grasp
    double time;  // s
    OmArmObservation arm[OM_MAX_ARM];
} MatchWay;

typedef struct MatchTruth {  // om__match_truth_done frees; zero-initialise
    OmScene scene;
    OmSite site;        // of the world
    OmTetMesh mesh;     // its tissue; of quadratic elements, as om_tissue_mesh
    OmSurface surface;  // boundary of this mesh, in the final state
    int* vert;          // mesh vertex of each vertex of the surface
    MatchHead head;
    double* x;                        // final positions of the world's mesh, m         (nvert x 3)
    float* depth[NVIEW];              //                                                (pixels)
    unsigned char* color[NVIEW];      //                                         (pixels x 3)
    int nway;                         // pictures on the way
    MatchWay* way;                    // (nway)
    double* way_x;                    // (nway x nvert x 3), m
    float* way_depth[NVIEW];          // (nway x pixels)
    unsigned char* way_color[NVIEW];  // (nway x pixels x 3)
} MatchTruth;

// Move the world as the setup says, or read the result from a file of `dir` if it has one of this setup. is_new: may be
// null.
OmStatus om__match_truth_get(const MatchSetup* setup, const char* dir, int nworker, bool* is_new,
                             MatchTruth* truth);
void om__match_truth_done(MatchTruth* truth);
// Picture k on the way as an observation, the end if k is nway; om_observation_done frees. With `seen` below 1 the
// tissue's pixels on one side of a plane have neither depth nor colour, so that a share `seen` of them stays.
OmStatus om__match_observe_way(const MatchTruth* truth, const MatchMove* move, MatchView view,
                               double seen, bool keeps_far, int k, OmObservation* obs);
// The scan of a view, with points `spacing` apart; 0: om_site_spacing.
OmStatus om__match_scan(const MatchTruth* truth, const OmSite* twin, const MatchMove* move,
                        const MatchCase* c, double spacing, OmScan* scan);
// The same of picture k on the way.
OmStatus om__match_scan_way(const MatchTruth* truth, const OmSite* twin, const MatchMove* move,
                            const MatchCase* c, double spacing, int k, OmObservation* obs,
                            OmScan* scan);
// What a robot knows of its grasps at picture k on the way; 0 before the grasp.
int om__match_grasps_way(const MatchTruth* truth, const MatchMove* move, int k,
                         OmMatchGrasp* grasp);
// What a robot knows of its grasps at the picture. Returns their number.
int om__match_grasps(const MatchTruth* truth, const MatchMove* move, OmMatchGrasp* grasp);
// The material point, in the rest shape, of each of n points that the camera sees: the nearest point of the true
// surface that faces the camera. `distance` (n) to it may be null.
OmStatus om__match_find_material(const MatchTruth* truth, int n, const double* x, double* rest,
                                 double* distance);
// The same of any surface, whose vertices are vertices `vert` of a mesh with rest positions x_rest, seen from `eye`.
OmStatus om__match_find_on_surface(const OmSurface* surface, const int* vert, const double* x_rest,
                                   OmVec3 eye, int n, const double* x, double* rest,
                                   double* distance);
// The same of the points of a scan that is shifted, as its camera: by a wrong calibration.     (npoint x 3)
OmStatus om__match_find_scanned(const OmSurface* surface, const int* vert, const double* x_rest,
                                const OmScan* scan, OmVec3 shift, double* rest);

typedef struct StudyPlaces {  // points in linear tetrahedra; om__places_done frees; zero-initialise
    const OmFemMesh* mesh;    // borrowed
    int n;
    int* elem;       // that contains each point, or the nearest one   (n)
    double* weight;  // of its vertices                             (n x 4)
} StudyPlaces;
// Where n points of the rest shape are in a mesh.
OmStatus om__places_find(const OmFemMesh* mesh, int n, const double* rest, StudyPlaces* places);
void om__places_done(StudyPlaces* places);
// Point i, with the vertices of the mesh at x.
OmVec3 om__places_at(const StudyPlaces* places, const double* x, int i);
// Mean distance of all of them from n other points, m; 0 without points.
double om__places_distance(const StudyPlaces* places, const double* x, const double* points);
// Positions of n points of the rest shape of a mesh whose vertices are now at x_now.
OmStatus om__match_carry_by(const OmTetMesh* mesh, const double* x_now, int n, const double* rest,
                            double* x);
// Positions in the truth of points of the rest shape.
OmStatus om__match_carry(const MatchTruth* truth, int n, const double* rest, double* x);

typedef struct MatchTwin {  // om__match_twin_done frees; zero-initialise
    OmScene scene;
    OmSite site;
    double* x;      // positions at a share of the way, m          (nvert x 3)
    double* nodes;  // the same, as om_body_get_nodes gives them   (nodes of its body x 3)
    double* way_x;  // with share 1: positions at the pictures on the way, m   (nway x nvert x 3)
} MatchTwin;
// A twin with a belief, at rest, then moved as the measured tips moved, `share` of the way; 1: the wait after it too.
OmStatus om__match_twin_get(const MatchSetup* setup, MatchBelief belief, const MatchTruth* truth,
                            double share, int nworker, MatchTwin* twin);
void om__match_twin_done(MatchTwin* twin);
// Move a body from its present state by the measured tips.
OmStatus om__match_follow(OmBody* body, const MatchMove* move, const MatchHead* head, int ntick);

#endif
