/// omentum/calibrate_tissue.h: tissue models compared with observations (floor 5).
///
/// Experiments are paths: tissue under its weight, a probe pressed into it, a pinch point lifted. At levels of each
/// path landmarks were located (thesis (3.15)), a depth camera took a point cloud (5.2), or the force on the tool was
/// measured. A function makes an OmTissueModel from the parameters. The model is moved along the same paths; the
/// differences from the observations are the errors of calibrate.h.
///
///     OmCalibrationTissueDef def = om_calibration_tissue_default_def(build, ctx);
///     def.npath = 1, def.path = &press, def.nlandmark = 1, def.rest = rest;
///     def.nobservation = 4, def.observation = seen;
///     om_calibration_tissue_create(&def, start, &tissue);
///     OmCalibrationDef search = om_calibration_tissue_search(tissue);      // then as in calibrate.h
#ifndef OMENTUM_CALIBRATE_TISSUE_H
#define OMENTUM_CALIBRATE_TISSUE_H

#include "omentum/calibrate.h"
#include "omentum/contact.h"
#include "omentum/contact_tool.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Make a model with these parameters; the caller destroys it. It may depend on param and ctx only.
/// @param nworker  threads of its linear solver
/// @return OM_OK; a positive status: there is no such model; a negative status ends the calibration
typedef OmStatus (*OmCalibrationBuildFn)(void* ctx, const double* param, int nworker,
                                         OmTissueModel** model);

typedef enum OmCalibrationPathKind {
    OM_PATH_REST,   // the tissue under its own weight; one level, 0
    OM_PATH_PRESS,  // a probe moves along `direction` from first contact
    OM_PATH_LIFT    // a grasp at `point` moves along `direction`
} OmCalibrationPathKind;

typedef struct OmCalibrationPath {
    const char* name;
    OmCalibrationPathKind kind;
    OmVec3 point;          // press: origin of the probe at first touch; lift: the pinch point; m
    OmVec3 direction;      // of travel, any length but zero
    OmVec3 along;          // press: the probe's x axis, any length; zero: any normal to `direction`
    double radius;         // lift: of the grasp, m; 0: 5 mm
    const OmProbe* probe;  // press: its z axis is -direction; borrowed
    OmPressMethod method;  // press
    int contact_ntri;      // press: triangles of the contact surface; 0: the unchanged boundary
    double friction;       // press
    double speed;          // m/s, > 0
    double time_step;      // s, > 0
    double settle;         // s, steps without travel before the path and at each level
    int nlevel;
    const double* level;  // travel, m, ascending, from 0                                  (nlevel)
} OmCalibrationPath;

#define OM_SEEN_CLOUD -1  // instead of a landmark: a point of the cloud
#define OM_SEEN_FORCE -2  // the force of the tool on the tissue, N

typedef struct OmCalibrationSeen {
    int path, level;  // indices
    int landmark;     // index, or one of the constants above
    OmVec3 x;         // position, m; or the force, N
} OmCalibrationSeen;

typedef struct
    OmCalibrationTissueDef {  // made by om_calibration_tissue_default_def; arrays are copied
    OmCalibrationBuildFn build;
    void* ctx;  // borrowed
    // Obstacles below the tissue; null: none. Borrowed, with everything it points to.
    const OmContactDef* contact;
    int npath;
    const OmCalibrationPath* path;  // names and probes are borrowed                   (npath)
    int nlandmark;
    const char* const* landmark;  // names, borrowed; may be null                  (nlandmark)
    const double* rest;           // in the rest shape, m                      (nlandmark x 3)
    int nobservation;
    const OmCalibrationSeen* observation;  // in any order                      (nobservation)
    double force_scale;                    // m of error for each newton of difference; default 0.01
    int ncloud_point;  // points of the model compared with clouds; default 0: its surface vertices
    const double* cloud_point;  // in the rest shape, m                     (ncloud_point x 3)
    OmCookie cookie;
} OmCalibrationTissueDef;

// constant; may be used by any number of threads
typedef struct OmCalibrationTissue OmCalibrationTissue;

OM_API OmCalibrationTissueDef om_calibration_tissue_default_def(OmCalibrationBuildFn build,
                                                                void* ctx);
/// @param start  parameters of a first model, whose surface gives the points to compare with clouds
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; errors of build
OM_API OmStatus om_calibration_tissue_create(const OmCalibrationTissueDef* def, const double* start,
                                             OmCalibrationTissue** tissue);
OM_API void om_calibration_tissue_destroy(OmCalibrationTissue* tissue);
/// The evaluation for calibrate.h; ctx is the OmCalibrationTissue. Paths run in parallel on `nworker` threads. Errors
/// are: one for each landmark and each force, in the order of the observations; then, for each path and level with a
/// cloud, one for each point of the model.
/// @return OM_OK; OM_INVALID (parameters at which the model or a simulation fails); OM_NO_MEMORY
OM_API OmStatus om_calibration_tissue_eval(void* tissue, const double* param, int nworker,
                                           double* error);
/// A definition with eval, nerror, labels and names; it borrows the tissue. The caller adds parameters.
OM_API OmCalibrationDef om_calibration_tissue_search(const OmCalibrationTissue* tissue);
/// Positions of the landmarks of the model along a path, for pictures or as observations for another model.
/// @param x      m                            (nlevel x nlandmark x 3); may be null
/// @param force  on the tissue, N                         (nlevel x 3); may be null
/// @return OM_OK; OM_NOT_CONVERGED (simulated to the end, with steps that did not converge); OM_INVALID;
///        OM_NO_MEMORY
OM_API OmStatus om_calibration_path_run(const OmCalibrationTissue* tissue, const double* param,
                                        int path, double* x, double* force);

#ifdef __cplusplus
}
#endif
#endif
