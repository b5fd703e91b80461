// robot_internal.h: what the files of the room share.
#ifndef OMENTUM_ROBOT_INTERNAL_H
#define OMENTUM_ROBOT_INTERNAL_H

#include "omentum/robot.h"

// The frame behind a row of the table, in the frame before it, at a value of its joint (rad).
OmPose om__psm_row_pose(OmPsmRow row, double q);
// @return OM_INVALID: the message names the first joint that is beyond its limits
OmStatus om__psm_check_limits(const OmPsm* psm, OmVec3 tip_world, const double q[OM_PSM_NJOINT]);
// The inverse of an instrument with rows: of the orientations that it reaches at the point the nearest one.
// @param max_turn  rad, most that this orientation may be off
OmStatus om__psm_inverse_rows(const OmPsm* psm, OmPose pose_world_tip, double max_turn,
                              const double q_near[OM_PSM_NJOINT], double q[OM_PSM_NJOINT]);

#endif
