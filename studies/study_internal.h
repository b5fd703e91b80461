// study_internal.h: shared by the files of the room.
#ifndef OMENTUM_STUDY_INTERNAL_H
#define OMENTUM_STUDY_INTERNAL_H

#include "omentum/calibrate_tissue.h"
#include "omentum/report.h"
#include "omentum/shape_sdf.h"
#include "omentum/tissue.h"
#include "studies/study.h"
#include "studies/study_methods.h"
#include "studies/study_stats.h"

struct OmStudyBody {
    char name[64];
    OmVec3 lo, hi;  // box around the body
    OmVec3 up;      // unit, towards the probe
    int nlesion;
    int noutside;  // lesions of the file that are not inside the body and therefore left out
    OmStudyLesion lesion[OM_STUDY_MAX_LESION];
    OmVec3 half;  // phantom: half-axes; box: half-sides, m
    bool is_box;
    bool is_file;
    OmSdf sdf;              // file: its distance field
    double low, high;       // file: smallest and largest dot(up, vertex)
    int nattached;          // file: boundary vertices of the set "attachment"
    double* attached;       // (nattached x 3)
    double attached_reach;  // file: points within this distance of one of them are attached too, m
};

double om__study_eval_phantom(const OmStudyBody* body, OmVec3 p);
double om__study_eval_box(const OmStudyBody* body, OmVec3 p);
// Is a point of the surface attached? `edge`: edge length of the mesh.
bool om__study_is_attached(const OmStudyBody* body, OmVec3 p, double edge);
// The body as an OmShapeFn; ctx is the body.
double om__study_shape_fn(void* ctx, OmVec3 p);
// The point of a lesion's contour nearest to the probe, at rest: the clearest point in an image (thesis 3.5.1).
OmVec3 om__study_contour(const OmStudyLesion* lesion);
// The unit vector normal to `normal` that is nearest to `wish`, or to another axis if they are parallel.
OmVec3 om__study_across(OmVec3 normal, OmVec3 wish);

// The probe of the thesis: its face, m.
#define PROBE_LONG 0.050
#define PROBE_WIDE 0.010
#define PROBE_ROUNDING 0.002  // radius of its edges; a sharp edge would have an unbounded pressure

// ---- runs -----------------------------------------------------------------------------------------

typedef struct StudyStep {
    double ms;           // wall clock
    double force;        // N, of the tissue on the probe, along its path
    double penetration;  // m
    double residual;
    int ncontact, substeps;
} StudyStep;

typedef struct StudyReached {  // at one of the depths
    double depth;              // m
    OmVec3 lesion, contour;    // positions of the lesion's centre and contour point in the model, m
} StudyReached;

typedef struct StudyRun {  // one method, mesh and lesion; the contents of its file
    char setup[20];        // hash of everything the result depends on
    int method, resolution, lesion;
    int ntet, nvert;
    int nstep;          // steps of the whole path
    int ndone;          // steps that met all criteria
    char reason[200];   // why it ended early; "" if it was completed
    double volume_min;  // smallest det F of all steps
    int nreached;
    StudyReached reached[OM_STUDY_NDEPTH];
    int nrecord;      // recorded steps: ndone, and the one that failed
    StudyStep* step;  // (OM_STUDY_MAX_STEP)
} StudyRun;

extern const char* const om__study_method_name[OM_STUDY_NMETHOD + 1];  // for files: "penalty"
extern const char* const om__study_method_title[OM_STUDY_NMETHOD];     // for people

OmStatus om__study_save_run(const StudyRun* run, const char* path);
// OM_INVALID also if the file belongs to another setup.
OmStatus om__study_load_run(const char* path, StudyRun* run);

// Data common to the runs on one mesh.
typedef struct StudyStage {
    const OmStudyContactDef* def;
    const OmProbe* probe;
    const OmSurface* surface;  // contact surface
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
} StudyStage;

OmStatus om__study_stage_create(const OmStudyContactDef* def, const OmTetMesh* mesh,
                                StudyStage* stage);
void om__study_stage_done(StudyStage* stage);
// Press over one lesion. `run` has setup, method, resolution and lesion; an instability is a result.
OmStatus om__study_press(StudyStage* stage, StudyRun* run);
// The probe's pose `depth` after first contact.
OmPose om__study_probe_pose(const OmStudyLesion* lesion, double depth);
// Number of steps to the last depth, or to the largest depth of a lesion; lesion < 0: of no particular one.
int om__study_nstep(const OmStudyContactDef* def, int lesion);

// ---- the study ------------------------------------------------------------------------------------

int om__study_nlesion(const OmStudyContactDef* def);
uint64_t om__study_hash_body(const OmStudyBody* body);
uint64_t om__study_hash_task(const OmStudyContactDef* def);
// A path in the study's folder.
OmStatus om__study_path(const OmStudyContactDef* def, char* out, size_t size, const char* format,
                        ...) OM_PRINTF(4, 5);
// The mesh of about `ntet` elements, read from the folder if it exists.
OmStatus om__study_get_mesh(const OmStudyContactDef* def, int ntet, OmTetMesh* mesh);
// The contact surface of all meshes.
OmStatus om__study_get_surface(const OmStudyContactDef* def, OmSurface* surface);

// ---- truth ----------------------------------------------------------------------------------------

typedef struct StudyTruthDepth {
    double depth;         // m
    OmVec3 fine, coarse;  // the lesion's centre from the two meshes, m
    OmVec3 contour;       // its contour point from the finer one, m
    double force;         // N, of the tissue on the probe, along its path
    double coarse_force;  // N
    double sink;          // m, mean depth of the tissue in contact inside the probe
    double residual;      // relative residual of equilibrium
    int nnewton;
} StudyTruthDepth;

typedef struct StudyTruthResult {
    char setup[20];
    int lesion, ntet, ntet_coarse;
    double seconds;
    int ndepth;
    StudyTruthDepth at[OM_STUDY_NDEPTH];
} StudyTruthResult;

typedef struct StudyTruth StudyTruth;
// The volume fraction of a tetrahedron inside lesions, 0 to 1.
double om__study_lesion_share(const OmStudyBody* body, const OmVec3 v[4]);
OmStatus om__study_truth_create(const OmStudyContactDef* def, const OmProbe* probe,
                                StudyTruth** truth);
void om__study_truth_destroy(StudyTruth* truth);
OmStatus om__study_truth_solve(StudyTruth* truth, int lesion, const OmProgress* progress,
                               StudyTruthResult* result);
uint64_t om__study_hash_truth(const OmStudyContactDef* def, int lesion);
OmStatus om__study_save_truth(const StudyTruthResult* truth, const char* path);
// OM_INVALID also if the file belongs to another setup.
OmStatus om__study_load_truth(const char* path, StudyTruthResult* truth);
// The position of the lesion at depth k that the tracking would measure: truth and noise.
OmVec3 om__study_measured(const OmStudyContactDef* def, const StudyTruthResult* truth, int k);
// The same for its contour point.
OmVec3 om__study_measured_contour(const OmStudyContactDef* def, const StudyTruthResult* truth,
                                  int k);

// ---- scores and the report ------------------------------------------------------------------------

typedef struct Study {
    const OmStudyContactDef* def;
    const OmProgress* progress;
    int nlesion, nrun, nfound, nmade;
    StudyRun* run;            // [resolution][method][lesion]
    StudyTruthResult* truth;  // [lesion]
    OmProbe* probe;
    OmSurface surface;  // contact surface
} Study;

typedef struct StudyCell {  // a method on a mesh
    int ntet;
    int nrun;               // number of runs
    StudySample stability;  // completed fraction of the path, %, over the lesions
    StudySample ms;         // time of a step, all steps of all lesions
    StudySample error;      // mm, of the deformations that all methods completed
    double finest;          // mm, mean error of the finest mesh over the same deformations
    bool is_met;            // all criteria are met
    char why[320];          // criteria that are missed
} StudyCell;

typedef struct StudyScore {
    StudyCell cell[OM_STUDY_MAX_RESOLUTION][OM_STUDY_NMETHOD];
    // errors by deformation, mm, over all resolutions; [OM_STUDY_NMETHOD] is the rigid model
    StudySample by_depth[OM_STUDY_NMETHOD + 1][OM_STUDY_NDEPTH];
    StudySample refinement;   // mm, of the lesion between the two meshes of the truth
    StudySample force_check;  // %, of the force between them
    StudySample sink;         // mm
    OmStudyContactSummary sum;
} StudyScore;

// Compute missing meshes, truth and runs; om__study_close frees, also on failure.
OmStatus om__study_open(const OmStudyContactDef* def, const OmProgress* progress, Study* s);
void om__study_close(Study* s);
const StudyRun* om__study_run_at(const Study* s, int resolution, int method, int lesion);
// Distance from the model's lesion to the measured one, m; negative if the run did not reach this depth.
double om__study_error(const Study* s, const StudyRun* run, int depth);
// The same of its contour point on the first mesh, by OmPressMethod; OM_STUDY_NMETHOD: moved rigidly with the probe.
double om__study_contour_error(const Study* s, int method, int lesion, int depth);
OmStatus om__study_score(const Study* s, StudyScore* score);
OmStatus om__study_write_files(const Study* s, const StudyScore* score);
// "measured": the contour point of each lesion as the tracking measures it, at each depth that the truth reached and
// at rest. Errors are distances to these points.
void om__study_put_contours(OmJson* json, const Study* s);
OmStatus om__study_write_report(const Study* s, const StudyScore* score);
OmStatus om__study_add_pictures(const Study* s, OmReport* report);

// ---- the calibration study ------------------------------------------------------------------------

typedef struct StudyFit {  // particles compared with the truth of one body
    const OmStudyCalibrationDef* def;
    // folder of its searches, and of truth and runs unless those of another study are used
    char dir[1024];
    OmStudyBody* body;
    OmStudyContactDef contact;
    Study study;
    OmTetMesh particles;
    double volume;  // m^3, of each particle
    char name[OM_STUDY_MAX_LESION][24];
    OmCalibrationResult result;
} StudyFit;

// Paths over `n` lesions from depth `first` on, each observed `nseen` times, with the tracking's measurements.
// Errors are ordered by lesion, depth and acquisition.
typedef struct StudyPlan {
    int n, first, nseen;
    const int* lesion;
} StudyPlan;

// The lattice of particles inside the body; its lowest layer is fixed.
OmStatus om__study_make_particles(StudyFit* fit);
int om__study_plan_depths(const StudyFit* fit, const StudyPlan* plan, int i);
OmStatus om__study_make_tissue(StudyFit* fit, const StudyPlan* plan, const double* start,
                               OmCalibrationTissue** tissue);
// Errors of lesions `first` to `end` - 1 at all depths of the truth, m. Other entries do not change; none of them
// changes if a status above OM_OK says that a path failed.
OmStatus om__study_score_particles(StudyFit* fit, int first, int end, const double* param,
                                   double error[][OM_STUDY_NDEPTH]);

typedef struct StudyCalibration {
    const OmStudyCalibrationDef* def;
    StudyFit gel, breast;
    // of the breast's lesions, m; negative where truth or model did not reach the depth
    double error[OM_STUDY_NFIT][OM_STUDY_MAX_LESION][OM_STUDY_NDEPTH];
    OmStudyCalibrationSummary sum;
} StudyCalibration;

extern const char* const om__study_by_name[OM_STUDY_NFIT];  // for files
extern const char* const om__study_by_title[OM_STUDY_NFIT];
// Does this deformation count? It does from 15 mm on, if every method reached it.
bool om__study_counts(const StudyCalibration* s, int lesion, int depth);
OmStatus om__study_report_calibration(const StudyCalibration* s);

// ---- the comparison of methods --------------------------------------------------------------------

typedef struct StudyMethods {
    const OmStudyMethodsDef* def;
    OmStudyCalibrationDef particles;  // settings of the particles' runs
    StudyFit fit;
    // m; negative where truth or method did not reach the depth
    double error[OM_STUDY_NBY][OM_STUDY_MAX_LESION][OM_STUDY_NDEPTH];
    // outside the range that the network was trained on, by its own test
    bool is_outside[OM_STUDY_MAX_LESION][OM_STUDY_NDEPTH];
    double stability[OM_STUDY_NBY][OM_STUDY_MAX_LESION];
    double ms[OM_STUDY_NBY];
    char training[512];  // description of the training in the file of weights
    OmStudyMethodsSummary sum;
} StudyMethods;

extern const char* const om__study_method_by_name[OM_STUDY_NBY];  // for files
extern const char* const om__study_method_by_title[OM_STUDY_NBY];
bool om__study_methods_count(const StudyMethods* s, int lesion, int depth);
// Compute s->sum, zero before, from errors, stability and times.
void om__study_summarise_methods(StudyMethods* s);
OmStatus om__study_report_methods(const StudyMethods* s);

#endif
