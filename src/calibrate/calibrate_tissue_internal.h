// calibrate_tissue_internal.h: move a tissue model along paths.
#ifndef OMENTUM_CALIBRATE_TISSUE_INTERNAL_H
#define OMENTUM_CALIBRATE_TISSUE_INTERNAL_H

#include "omentum/calibrate_tissue.h"

/// Called at each level of a path, in order.
typedef OmStatus (*OmWalkFn)(void* ctx, int level, const double* vert_x, OmVec3 force);

/// Move a new state of the model along the path. `force` is the force of the tool on the tissue, N.
/// @return OM_OK; OM_UNSAT (a step failed: no model for these parameters); OM_INVALID (no tissue in
///         reach of the tool); OM_NO_MEMORY; the status of fn
OmStatus om__calibrate_walk(const OmTissueModel* model, const OmCalibrationPath* path,
                            const OmContactDef* contact, OmWalkFn fn, void* ctx);
OmStatus om__calibrate_check_path(const OmCalibrationPath* path, int index);

/// The context of the definition's build.
void* om__calibrate_tissue_ctx(const OmCalibrationTissue* tissue);

// Points of the model that are compared with clouds, at each level of a path: (nlevel x ncloud x 3).
int om__calibrate_ncloud(const OmCalibrationTissue* tissue);
OmStatus om__calibrate_run_cloud(const OmCalibrationTissue* tissue, const double* param, int path,
                                 double* x);

#endif
