/// studies/study_methods.h: finite elements, particles, a trained network and nothing, compared.
///
/// Thesis 3.8, Tables 3.5 to 3.7 and Fig. 3.11: the probe is pressed over every lesion of the breast phantom, and
/// each method says where the lesions go. Truth, body, noise and the tracked contour point are those of the
/// calibration study (study.h).
///
///     OmStudyMethodsDef def = om_study_methods_default_def("out/methods", "weights/phantom.safetensors");
///     om_study_methods_run(&def, progress, &summary);       // out/methods/report.html
#ifndef OMENTUM_STUDY_METHODS_H
#define OMENTUM_STUDY_METHODS_H

#include "studies/study.h"

typedef enum OmStudyMethod {
    OM_STUDY_FE,         // prescribed displacement, neo-Hookean linear tetrahedra
    OM_STUDY_PARTICLES,  // position based, calibrated parameters
    OM_STUDY_UMESH,      // a trained network
    OM_STUDY_RIGID,      // the lesion moves as the probe does
    OM_STUDY_NBY
} OmStudyMethod;

typedef struct OmStudyMethodsDef {  // made by om_study_methods_default_def
    const char* out_dir;            // runs of particles and network, the report; borrowed
    const char* weights;            // of omentum umesh train, for the phantom; borrowed
    const char* truth_dir;  // of a contact study whose truth and meshes are used where they fit;
                            // default null: out_dir
    int nlesion;            // 1 to 20; default 10
    double cluster[OM_STUDY_NCLUSTER];  // spacing (m), radius (m), stiffness of particles
    double spacing, speed, settle;      // of particles: as OmStudyCalibrationDef
    int truth_ntet;                     // default 12000
    int fe_ntet;                        // default 4126
    uint64_t seed;                      // of the noise; default 1
    int nworker;                        // default 0: one a processor
    OmCookie cookie;
} OmStudyMethodsDef;

typedef struct OmStudyMethodResult {
    // lesions that count at each depth: truth and all methods came there
    int ndepth[OM_STUDY_NDEPTH];
    double error[OM_STUDY_NDEPTH];  // mean over them, m
    double mean;                    // over all that count, m
    double ms;                      // of a step, median for FE and the network, mean for particles
    double stability;               // mean share of the path, 0 to 1
} OmStudyMethodResult;

typedef struct OmStudyMethodsSummary {
    OmStudyMethodResult by[OM_STUDY_NBY];
    int ncount;                   // deformations that count
    double gap[OM_STUDY_NDEPTH];  // network's error less finite elements', mean over lesions, m
    double worst_gap;             // the largest of them
    int noutside;  // predictions that the network's own test did not trust, of these deformations
    bool is_met;   // worst_gap at most 0.3 mm, and every method all the way
} OmStudyMethodsSummary;

OmStudyMethodsDef om_study_methods_default_def(const char* out_dir, const char* weights);
/// report.html, study.json and errors.csv in out_dir.
OmStatus om_study_methods_run(const OmStudyMethodsDef* def, const OmProgress* progress,
                              OmStudyMethodsSummary* summary);

#endif
