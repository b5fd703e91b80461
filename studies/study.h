/// studies/study.h: the thesis's experiments as reproducible commands.
///
/// The contact study (thesis 3.3, 3.4, 3.7): an ultrasound probe is pressed over each lesion of a breast
/// phantom; three ways to model the contact, on nine meshes, say where the lesion goes. Truth is a finer,
/// quadratic, heterogeneous static model plus the noise of the thesis's tracking. Every run is one file
/// that appears whole or not at all: a killed study continues where it was. The calibration study
/// (3.5.1) finds the parameters of particles on a box of gel and tests them on the phantom's lesions.
///
///     OmStudyBody* body;
///     om_study_body_create_phantom(10, 1, &body);
///     OmStudyContactDef def = om_study_contact_default_def(body, "out/contact");
///     om_study_contact_run(&def, progress, &summary);      // out/contact/report.html
///     om_study_body_destroy(body);
///
/// All studies: `out_dir` gets what a study makes and its report; parts that are there are not computed again.
/// om_study_*_run returns OM_OK, whether or not the goal is met; OM_INVALID (the message names the field, or the folder
/// of another study); OM_IO; OM_NO_MEMORY; OM_CANCELLED (what is finished stays, and the same call continues).
#ifndef OMENTUM_STUDY_H
#define OMENTUM_STUDY_H

#include "omentum/contact_tool.h"
#include "omentum/shape.h"
#include "omentum/tissue_material.h"
#include "omentum/vec.h"

// ---- bodies with lesions --------------------------------------------------------------------------

#define OM_STUDY_MAX_LESION 100

typedef struct OmStudyLesion {
    OmVec3 center;  // at rest, m
    double radius;  // m
    OmVec3 touch;   // middle of the probe's face when it first touches, m
    OmVec3 normal;  // unit, out of the body; the probe is pressed along -normal
    OmVec3 along;   // unit, the long side of the probe; perpendicular to normal
    double max;     // the farthest that the probe is pressed, m
} OmStudyLesion;

/// A solid known as a function, its lesions and where it is held: meshed at any resolution.
typedef struct OmStudyBody OmStudyBody;

/// Half an ellipsoid on its flat base z = 0, 150 x 120 mm wide and 72 mm high, the size of a breast
/// biopsy phantom; lesions of 5-10 mm between 10 and 35 mm under the surface, the probe along the normal.
/// @param nlesion  1 to 20
/// @return OM_OK; OM_INVALID (too many lesions, or no room for one); OM_NO_MEMORY
OmStatus om_study_body_create_phantom(int nlesion, uint64_t seed, OmStudyBody** body);
/// The thesis's box of ballistic gel, 155 x 100 x 70 mm on its held base z = 0, with three beads of 18 mm whose tops
/// are at heights of 47, 53 and 63 mm (3.5.1); the probe comes from above and goes down by 20 mm at most.
/// @return OM_OK; OM_NO_MEMORY
OmStatus om_study_body_create_gel(OmStudyBody** body);
/// The solid bounded by a tetrahedral mesh. The probe is pressed to the depths of the study, at most through 0.6 of the
/// tissue under its face. The body is held at the set "attachment" of the mesh, else at its end towards -`up`.
/// @param up      towards the probe, any length; zero: +z
/// @param unit    length of one unit of the mesh, m; lesion_unit: of the lesions
/// @param lesion  text, one a line: x y z [radius]; "#" begins a comment. Radius 3 mm if it is not given.
///                Lesions outside the body are left out; OM_INVALID if all are
/// @return OM_OK; OM_INVALID (the message names file or argument); OM_NO_MEMORY; OM_IO
OmStatus om_study_body_load(const char* mesh, double unit, const char* lesion, double lesion_unit,
                            OmVec3 up, OmStudyBody** body);
/// Number of lesions of its file that were left out.
int om_study_count_outside(const OmStudyBody* body);
void om_study_body_destroy(OmStudyBody* body);
const OmStudyLesion* om_study_lesions(const OmStudyBody* body, int* nlesion);
/// Negative inside; about a distance near the surface, m.
double om_study_body_eval(const OmStudyBody* body, OmVec3 p);
/// A mesh of about `ntet` elements, with the set "attachment".
/// @param ntet  100 to 2,000,000
/// @return OM_OK; OM_INVALID (ntet is not in 100 to 2,000,000, or nothing of the mesh is held); OM_NO_MEMORY
OmStatus om_study_body_mesh(const OmStudyBody* body, int ntet, int nworker, OmTetMesh* mesh);

// ---- the contact study ----------------------------------------------------------------------------

#define OM_STUDY_NMETHOD 3  // of OmPressMethod
#define OM_STUDY_NDEPTH 5   // deformation ranges D10 to D30
#define OM_STUDY_MAX_RESOLUTION 16
#define OM_STUDY_MAX_STEP 2000

typedef struct OmStudyContactDef {  // made by om_study_contact_default_def
    const OmStudyBody* body;        // borrowed
    const char* out_dir;
    int nresolution;                          // default the thesis's nine
    int resolution[OM_STUDY_MAX_RESOLUTION];  // elements, ascending
    bool has_method[OM_STUDY_NMETHOD];        // default all
    int nlesion;                              // the first so many; default 0: all
    double depth[OM_STUDY_NDEPTH];  // m, ascending; default 0.010, 0.015, 0.020, 0.025, 0.030
    double speed;                   // of the probe, m/s; default 0.01
    double time_step;               // s; default 0.02
    OmMaterial material;            // default 3 kPa, 0.45, neo-Hookean
    double density;                 // kg/m^3; default 1000
    double rayleigh_mass;           // 1/s; default 0.1
    int contact_ntri;  // triangles of the contact surface; default 4000 (the thesis's 1,004 have edges as
                       // long as the probe is wide: it slips between vertices)
    double friction;         // Coulomb's coefficient; default 0
    double tolerance;        // relative residual of the linear solver; default 1e-3
    int max_iterations;      // of conjugate gradients; default 400
    double max_penetration;  // m, of a step that counts; default 0.0005
    int truth_ntet;          // elements of the quadratic truth; default 35000
    double lesion_ratio;     // stiffness of a lesion over the tissue's; default 7.5
    double probe_noise;      // m, standard deviation of the probe's calibration; default 0.0007147
    double pointer_noise;    // m, of the registration; default 0.000334
    uint64_t seed;           // of the noise; default 1
    int nworker;             // default 0: one a processor
    OmCookie cookie;
} OmStudyContactDef;

typedef struct OmStudyContactSummary {
    int nrun, nnew;          // runs of the study, and those made now rather than found
    int ncomplete;           // that went the whole way within the bar
    int ncell, ncell_met;    // method x resolution, and the number that meets all criteria
    double worst_stability;  // least share of a path, 0 to 1
} OmStudyContactSummary;

OmStudyContactDef om_study_contact_default_def(const OmStudyBody* body, const char* out_dir);
/// Make what is missing of meshes, truth and runs, then report.html, study.json, runs.csv and errors.csv.
OmStatus om_study_contact_run(const OmStudyContactDef* def, const OmProgress* progress,
                              OmStudyContactSummary* summary);

// ---- the calibration study ------------------------------------------------------------------------

typedef enum OmStudyFit {  // the model that predicts a lesion's position
    OM_FIT_GEL,            // particles with the gel's parameters
    OM_FIT_TUNED,          // particles fine-tuned on one lesion
    OM_FIT_PRESCRIBED,     // finite elements, prescribed displacement
    OM_FIT_PENALTY,
    OM_FIT_RIGID,  // moved rigidly with the probe
    OM_STUDY_NFIT
} OmStudyFit;

#define OM_STUDY_NCLUSTER 3  // parameters: cluster spacing (m), radius (m), stiffness

typedef struct OmStudyCalibrationDef {  // made by om_study_calibration_default_def
    const char* out_dir;
    int nlesion;                      // of the breast phantom, 2 to 20; default 10
    int tuned;                        // the lesion fine-tuned on, from 0; default 0
    int nacquisition;                 // of each bead, 1 to 100; default 5
    double spacing;                   // of particles, m; default 0.005 (Table 3.1)
    double speed;                     // of the probe through particles, m/s; default 0.05
    double time_step;                 // s; default 0.02 (Table 3.1)
    double settle;                    // s, the probe waits at each depth; default 0.06
    int population, max_generations;  // of the gel's global search; default 16 and 8
    int max_local;                    // evaluations of each local search; default 40
    bool has_sensitivity;             // of the fine-tuned parameters too; default true
    // Folder of a contact study whose truth, meshes and runs of the breast are used where they fit;
    // null (default): out_dir/breast.
    const char* truth_dir;
    int truth_ntet, gel_truth_ntet;  // elements of the quadratic truths; default 12000
    int fe_ntet;                     // elements of the finite elements compared; default 4126
    int contact_ntri;                // triangles of the contact surfaces; default 4000
    uint64_t seed;                   // of noise and search; default 1
    int nworker;                     // default 0: one a processor
    OmCookie cookie;
} OmStudyCalibrationDef;

typedef struct OmStudyCalibrationSummary {  // errors in m
    double gel[OM_STUDY_NCLUSTER], tuned[OM_STUDY_NCLUSTER];
    // mean error on the beads, at the thesis's parameters and the best
    double gel_start, gel_error;
    // on the lesion fine-tuned on, at the gel's parameters and the best
    double tuned_start, tuned_error;
    // means over the same deformations of 15 to 30 mm of the other lesions
    int nunseen;
    double unseen[OM_STUDY_NFIT];
    int neval, nnew;  // evaluations of both searches, and those made now
    double seconds;   // of both searches, now
    // unseen of OM_FIT_TUNED at most 1.5 times that of OM_FIT_PRESCRIBED, and fine-tuning improved its lesion
    bool is_met;
} OmStudyCalibrationSummary;

OmStudyCalibrationDef om_study_calibration_default_def(const char* out_dir);
/// Cluster parameters of particles found on the gel, fine-tuned on one lesion of the breast phantom, tested on the
/// others (thesis 3.5.1, Tables 3.2 and 3.6): report.html, study.json and errors.csv in out_dir.
OmStatus om_study_calibration_run(const OmStudyCalibrationDef* def, const OmProgress* progress,
                                  OmStudyCalibrationSummary* summary);

#endif
