// calibrate_problem_internal.h: the contents of a problem's files.
#ifndef OMENTUM_CALIBRATE_PROBLEM_INTERNAL_H
#define OMENTUM_CALIBRATE_PROBLEM_INTERNAL_H

#include "omentum/calibrate_problem.h"
#include "omentum/world.h"

#define PATH_NAME 64
#define LANDMARK_NAME 48

typedef struct ParamItem {
    int name;         // index into om__calibrate_scene_key
    double min, max;  // in the unit of the key
    double start;     // NAN: the scene's value
    bool is_log;
} ParamItem;

typedef struct ProbeItem {
    int shape;  // OmProbeShape
    OmVec3 size;
    double radius, length, rounding;
} ProbeItem;

typedef struct PathItem {
    char name[PATH_NAME];
    int kind;  // OmCalibrationPathKind
    OmVec3 point, direction, along;
    double radius;
    ProbeItem probe;
    int method, contact_ntri;
    double friction, speed, time_step, settle;
} PathItem;

typedef struct SearchItem {
    int norm, global, local;
    double huber, trim, noise, force_scale;
    int population, generations, local_evaluations, patience, seed;
    double local_range, tolerance, unfit, rise;
} SearchItem;

typedef struct ProblemFile {
    char title[128], scene[OM_SCENE_PATH], observations[OM_SCENE_PATH];
    int nparam, npath;
    ParamItem param[OM_CALIBRATION_MAX_PARAM];
    PathItem path[OM_CALIBRATION_MAX_PATH];
    SearchItem search;
} ProblemFile;

typedef struct SceneKey {  // a number of a scene that can be calibrated
    const char* name;
    size_t offset;  // in OmScene
    double unit;
    const char* number;  // for om_engine_uses; null: it has an effect on every engine
} SceneKey;
extern const SceneKey om__calibrate_scene_key[];

OmStatus om__calibrate_read_problem(const char* path, ProblemFile* file);

typedef struct Sights {  // the rows of the CSV file of observations
    int npath;
    int nlevel[OM_CALIBRATION_MAX_PATH];
    double level[OM_CALIBRATION_MAX_PATH][OM_CALIBRATION_MAX_LEVEL];  // m, ascending
    int nlandmark;
    char landmark[OM_CALIBRATION_MAX_LANDMARK][LANDMARK_NAME];
    double rest[3 * OM_CALIBRATION_MAX_LANDMARK];  // m
    int nseen;
    OmCalibrationSeen* seen;  // level is an index
} Sights;

/// @param name  of the file, for messages
OmStatus om__calibrate_parse_sights(const char* text, size_t size, const char* name, int npath,
                                    const PathItem* path, Sights* sights);

typedef struct Body {  // one site of the scene and the tissue on it: input of a model
    const OmCalibrationProblem* problem;
    OmSite site;
    OmContactPlane board;
    OmTissueObstacle obstacle[2];  // board and organ, if present
    OmContactDef contact;
    double
        // factor of the spring stiffness at the attachments: equal stiffness per area on meshes of different density
        spring_factor;
} Body;

struct OmCalibrationProblem {
    // paths of problem, scene, observations, and the files that the scene includes
    char input[4][2 * OM_SCENE_PATH];
    ProblemFile file;
    OmScene scene;
    Sights sights;
    Body twin;
    OmProbe* probe[OM_CALIBRATION_MAX_PATH];
    double start[OM_CALIBRATION_MAX_PARAM];
    uint64_t hash;
    OmCalibrationTissue* tissue;
};

OmStatus om__calibrate_make_body(const OmCalibrationProblem* p, bool is_world, Body* b);
// An OmCalibrationBuildFn; ctx is a Body.
OmStatus om__calibrate_build(void* ctx, const double* param, int nworker, OmTissueModel** model);
// The paths in the world frame of that site (npath).
void om__calibrate_make_paths(const OmCalibrationProblem* p, const Body* body,
                              OmCalibrationPath* path);

#endif
