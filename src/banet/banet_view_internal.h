// banet_view_internal.h: a deformed body as a robot sees and measures it.
#ifndef OM_BANET_VIEW_INTERNAL_H
#define OM_BANET_VIEW_INTERNAL_H

#include "omentum/banet_sample.h"
#include "omentum/banet_view.h"
#include "omentum/scene.h"

typedef struct BanetTruth {    // borrowed
    const OmTetMesh* mesh;     // the rest shape
    const int* node;           // OmBanetSample.node: of quadratic elements; else null
    const OmSurface* surface;  // its boundary
    const int* surface_vert;   // vertex of the mesh of each vertex of `surface`
    const double* x;  // deformed, m                                       (mesh->nvert x 3)
    const unsigned char* attached;  // of vertices of the surface                   (surface->nvert)
    const unsigned char* grasped;   // the same
    double young, poisson, density;  // Pa, 1, kg/m^3
    OmVec3 gravity;                  // m/s^2
    bool has_board;
    OmPose pose_world_board;  // z = 0 is its surface
} BanetTruth;

typedef enum BanetBelief {  // attachments of the twin
    BELIEF_SAME,            // those of the truth
    BELIEF_NONE,
    BELIEF_FEWER,      // a part of them
    BELIEF_MORE,       // a patch anywhere in addition
    BELIEF_ELSEWHERE,  // a patch anywhere instead
    BELIEF_NEARLY,     // a small part less, and a small patch in addition
    BELIEF_COUNT
} BanetBelief;

typedef struct BanetViewDef {     // made by om__banet_view_default_def
    double chance[BELIEF_COUNT];  // weights of the twin's attachments
    double stiffness[2];          // Young's modulus of the twin over the true one
    double distance[2];           // m, of the camera
    int width, height;            // pixels
    double fov;                   // rad, vertical
    int min_tissue;     // pixels of tissue in the picture; with fewer another camera is drawn
    int min_grasp;      // ... near the grasp
    int max_camera;     // cameras drawn
    bool has_tool;      // in the picture
    double noise;       // times that of om_depth_noise_default
    int max_hole;       // discs without depth
    double tool_shift;  // m, standard deviation of the tool's measured position
    // of the calibration of the camera: standard deviations, m along and rad about each axis
    double camera_shift, camera_turn;
    int nstep;         // steps of the twin while the tool moves
    int nsettle;       // ... afterwards
    double dt;         // s
    int nrestart;      // OmMatchLiveDef.nrestart
    double keep_lost;  // share of lost results that is kept
} BanetViewDef;

typedef struct BanetViewReport {
    BanetBelief belief;
    int nright, nwrong;  // vertices that the twin holds: held by the truth, and not
    int npixel;          // of tissue
    int npoint;          // of the scan
    int nsubstep;        // of the twin
    bool is_lost, is_restarted;
    double median, p95, paired, empty;       // as in OmMatchPairs
    double see_s, follow_s, make_s, pair_s;  // wall clock of the stages
} BanetViewReport;

BanetViewDef om__banet_view_default_def(void);
/// See the truth, follow it with a twin, find pairs.
/// @param u       measured displacement of the surface's vertices, m  (surface->nvert x 3)
/// @param seen    how well each was seen, 0 to 1                      (surface->nvert)
/// @param report  may be null
/// @return OM_OK; OM_NOT_CONVERGED (no camera sees the grasp, or the pairs are lost); OM_INVALID; OM_NO_MEMORY;
///         OM_UNAVAILABLE
OmStatus om__banet_view_measure(const BanetViewDef* def, const BanetTruth* truth, OmRng* rng,
                                double* u, double* seen, BanetViewReport* report);

/// View a sample by way (b): u, seen and visible. A view that fails is drawn again a few times.
/// @return as om__banet_view_measure
OmStatus om__banet_view(OmRng* rng, OmBanetSample* sample);

// ---- the picture ------------------------------------------------------------------------------------------------

typedef struct BanetTool {
    OmPose pose_world_grasp, pose_world_now;
    double radius;  // m, of the grasp
    OmVec3 normal;  // of the deformed body at the grasp, unit or zero
    OmVec3 remote;  // m, end of the shaft
} BanetTool;

/// The tool: the rigid motion nearest to that of the grasped vertices, and a shaft that is clear of the body.
/// @return OM_OK; OM_INVALID (no vertex is grasped)
OmStatus om__banet_tool_make(const BanetTruth* truth, OmRng* rng, BanetTool* tool);
/// A depth picture of the truth, and the scan that the robot makes of it with its calibration.
/// @return OM_OK; OM_NOT_CONVERGED (no camera that was drawn sees enough); OM_NO_MEMORY; OM_UNAVAILABLE
OmStatus om__banet_look(const BanetViewDef* def, const BanetTruth* truth, const BanetTool* tool,
                        const OmSite* site, OmRng* rng, OmScan* scan, int* npixel);

#endif
