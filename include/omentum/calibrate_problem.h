/// omentum/calibrate_problem.h: calibrations described by files (floor 5).
///
/// A problem is a YAML file and a CSV file. The YAML file has the scene whose twin is the model, the parameters
/// (named by keys of the scene), the paths of the experiments, and the search. The CSV file has the observations in
/// the scene's task frame:
///
///     experiment,level_mm,landmark,x_mm,y_mm,z_mm
///     bead 1,rest,tip,0,0,47            place of the landmark in the rest shape
///     bead 1,10,tip,0.1,0,41.2          its place after 10 mm of travel
///     pinch 2,20,cloud,12,40,18.5       a point of the cloud at 20 mm (any number)
///     bead 1,10,force,0,0,-1.9          the force of the tool on the tissue, N
///
///     om_calibration_problem_load("gel.yaml", NULL, &problem);
///     OmCalibrationDef def = om_calibration_problem_search(problem);
///     om_calibration_run(&def, progress, &result);
///     om_calibration_problem_destroy(problem);
#ifndef OMENTUM_CALIBRATE_PROBLEM_H
#define OMENTUM_CALIBRATE_PROBLEM_H

#include "omentum/calibrate_tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_CALIBRATION_MAX_PATH 32
#define OM_CALIBRATION_MAX_LEVEL 32
#define OM_CALIBRATION_MAX_LANDMARK 256
#define OM_CALIBRATION_MAX_TRIANGLE 200000  // of the surface that a probe meets

typedef struct OmCalibrationProblem OmCalibrationProblem;  // constant

/// Read a problem, its scene and its observations. File names in the problem are relative to its folder.
/// @param observations  a file that replaces the one named in the problem; may be null
/// @return OM_OK; OM_INVALID (the message names file, line, key or column, and the remedy); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_calibration_problem_load(const char* path, const char* observations,
                                            OmCalibrationProblem** problem);
OM_API void om_calibration_problem_destroy(OmCalibrationProblem* problem);
/// The search that the file describes; it borrows the problem. The caller adds out_dir and nworker.
OM_API OmCalibrationDef om_calibration_problem_search(const OmCalibrationProblem* problem);
/// The files that were read: the problem, its scene, its observations, the values that the scene takes over (index 0
/// to 3); null if there is none.
OM_API const char* om_calibration_problem_input(const OmCalibrationProblem* problem, int index);
/// Start values of the parameters: those of the file, or else those of the scene (nparam).
OM_API const double* om_calibration_problem_start(const OmCalibrationProblem* problem);
/// All observations, in the scene's task frame; a view (n).
OM_API const OmCalibrationSeen* om_calibration_problem_seen(const OmCalibrationProblem* problem,
                                                            int* n);
/// Number of points of the model that are compared with a cloud.
OM_API int om_calibration_problem_npoint(const OmCalibrationProblem* problem);
/// Positions of these points of the model at each level of a path, in the scene's task frame: for pictures.
/// @param param  (nparam)
/// @param x      m                                   (nlevel x npoint x 3)
/// @return OM_OK; OM_UNSAT: there is no such model; OM_INVALID (no such path); OM_NO_MEMORY
OM_API OmStatus om_calibration_run_points(const OmCalibrationProblem* problem, const double* param,
                                          int path, double* x);
/// Write synthetic observations: the scene's *world* (another mesh than the twin's, and another stiffness by
/// OmSceneWorld) is moved along the paths with these parameters, and noise is added. They show before an experiment
/// which parameters it can determine.
/// @param param  (nparam) of the twin; the factors of OmSceneWorld apply in addition
/// @param noise  m, standard deviation of each coordinate; forces have none
/// @param path   of the CSV file; none of the problem's own files. Its last line is a seal (om_text_seal)
/// @return OM_OK; OM_INVALID (parameters at which a simulation fails); OM_NO_MEMORY; OM_IO, nothing is written
OM_API OmStatus om_calibration_save_synthetic(const OmCalibrationProblem* problem,
                                              const double* param, double noise, uint64_t seed,
                                              const char* path);

#ifdef __cplusplus
}
#endif
#endif
