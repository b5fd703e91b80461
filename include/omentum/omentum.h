/// omentum/omentum.h: all public headers at once.
///
/// Each room also has headers of its own. The studies (study.h, study_methods.h, study_sheet.h) repeat experiments of
/// the thesis; a program that wants one includes its header.
#ifndef OMENTUM_OMENTUM_H
#define OMENTUM_OMENTUM_H

#include "omentum/base.h"
#include "omentum/base_job.h"
#include "omentum/body.h"
#include "omentum/calibrate.h"
#include "omentum/calibrate_problem.h"
#include "omentum/calibrate_tissue.h"
#include "omentum/contact.h"
#include "omentum/contact_tool.h"
#include "omentum/defras.h"
#include "omentum/defras_loop.h"
#include "omentum/defras_recorder.h"
#include "omentum/fem.h"
#include "omentum/heuristic.h"
#include "omentum/image.h"
#include "omentum/math_grid.h"
#include "omentum/nn.h"
#include "omentum/nn_file.h"
#include "omentum/nn_train.h"
#include "omentum/pbd.h"
#include "omentum/plan.h"
#include "omentum/report.h"
#include "omentum/robot.h"
#include "omentum/scene.h"
#include "omentum/scene_model.h"
#include "omentum/scene_yaml.h"
#include "omentum/sense.h"
#include "omentum/shape.h"
#include "omentum/shape_file.h"
#include "omentum/shape_meshing.h"
#include "omentum/shape_points.h"
#include "omentum/shape_sdf.h"
#include "omentum/solve.h"
#include "omentum/tissue.h"
#include "omentum/tissue_engine.h"
#include "omentum/tissue_material.h"
#include "omentum/umesh.h"
#include "omentum/umesh_net.h"
#include "omentum/vec.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"

#endif
