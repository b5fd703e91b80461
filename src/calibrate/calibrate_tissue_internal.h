// calibrate_tissue_internal.h: a tissue model carried along paths.
#ifndef OMENTUM_CALIBRATE_TISSUE_INTERNAL_H
#define OMENTUM_CALIBRATE_TISSUE_INTERNAL_H

#include "omentum/calibrate_tissue.h"

/// Called at each level of a path, in order.
typedef OmStatus (*OmWalkFn)(void* ctx, int level, const double* vert_x, OmVec3 force);

/// Carry a new state of the model along the path. `force` is that of the tool on the tissue, N.
/// @return OM_OK; OM_UNSAT (a step could not be made: no model for these parameters); OM_INVALID (no tissue in
///         reach of the tool); OM_NO_MEMORY; what fn says
OmStatus om__calibrate_walk(const OmTissueModel* model, const OmCalibrationPath* path,
                            const OmContactDef* contact, OmWalkFn fn, void* ctx);
OmStatus om__calibrate_check_path(const OmCalibrationPath* path, int index);

/// What the definition's build is called with.
void* om__calibrate_tissue_ctx(const OmCalibrationTissue* tissue);

// Points of the model held against clouds, and where they are at each level of a path: (nlevel x ncloud x 3).
int om__calibrate_ncloud(const OmCalibrationTissue* tissue);
OmStatus om__calibrate_run_cloud(const OmCalibrationTissue* tissue, const double* param, int path,
                                 double* x);

#endif
