// match_icp.h: one run of trimmed ICP, for match_register.c.
#ifndef OM_MATCH_ICP_H
#define OM_MATCH_ICP_H

#include "omentum/scan.h"
#include "omentum/shape_closest.h"

typedef struct OmIcp {
    const OmSurface* model;
    OmSurfaceTree* tree;
    OmSenseScene* view;     // the model, to find hidden triangles; null: the scan has no camera
    double* tri_normal;     // unit                                       (ntri x 3)
    double* tri_center;     //                                            (ntri x 3)
    double* vert_normal;    // unit                                       (nvert x 3)
    unsigned char* hidden;  // triangles hidden by others                 (ntri)
    unsigned char* use;     // triangles that may be partners             (ntri)
    double edge;            // mean length of an edge, m
    OmVec3 model_center;    // of the model's box, m
    double model_radius;    // of a ball around the model, m

    int n;           // points, in random order: the first k are a fair choice of k
    double* x;       // world                                             (n x 3)
    double* normal;  // world, zero: not known                            (n x 3)
    OmVec3 center;   // of the points
    double radius;   // root mean square distance from it, m
    OmVec3 eye;      // of the camera, world
    double noise;    // m
    double min_overlap;
    int nworker;

    // computed by om__icp_run, of the last iteration
    double* p;          // points in the frame of the model               (n x 3)
    double* q_normal;   // of the partners                                (n x 3)
    double* distance2;  // to the partner; HUGE_VAL: none                 (n)
    double* residual;   // to the tangent plane                           (n)
    int* tri;           // of the partner                                 (n)
    double* sorted;     //                                                (n)
} OmIcp;

typedef struct OmIcpFit {
    OmPose pose;    // model <- world
    double cost;    // mean squared distance of the kept points / overlap^3, m^2
    double limit2;  // points up to this squared distance are kept, m^2
    int nkept, npoint;
    int niteration;
} OmIcpFit;

// Borrow the model; copy npoint points of the scan, or all if there are fewer.
OmStatus om__icp_create(const OmSurface* model, const OmScan* scan, int npoint, OmIcp* icp);
void om__icp_done(OmIcp* icp);
// Find the triangles that others hide from the camera at this pose.
OmStatus om__icp_hide(OmIcp* icp, OmPose pose_model_scan);
// Iterate from fit->pose with the first npoint points until the step is below `tolerance` m.
void om__icp_run(OmIcp* icp, int npoint, int max_iteration, double tolerance, OmIcpFit* fit);
// Solve (H + damping 1) u = b by Cholesky. Damping above 0 makes every pivot positive; 0: H is positive definite.
void om__solve6(double H[6][6], double damping, const double b[6], double u[6]);
// Covariances at a fit, for the points of the last run: of a turn (rad^2) and a shift (m^2) at the scan's centre, in
// the frame of the model.
OmStatus om__icp_covariance(const OmIcp* icp, const OmIcpFit* fit, OmMat3* turn, OmMat3* shift);

#endif
