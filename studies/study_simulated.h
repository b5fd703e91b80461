/// studies/study_simulated.h: BA-Net on random bodies that it was not trained on: Table 4.1.
///
/// Thesis 4.3.1 and 4.4. Samples of om_banet_sample_make with seeds of their own are given to the network. Attachments
/// that it finds are compared with the true ones, and a simulation with them, driven by the displacement of the grasp,
/// with the true deformed body. Beside it: no attachment, all of the lowest side, and the true ones.
///
///     OmStudySimulatedDef def = om_study_simulated_default_def("out/simulated");
///     om_study_simulated_run(&def, progress, &summary);    // out/simulated/report.html, study.json, samples.csv
#ifndef OMENTUM_STUDY_SIMULATED_H
#define OMENTUM_STUDY_SIMULATED_H

#include "studies/study_match.h"

typedef enum OmStudySimulatedSet {  // sets of samples; their seeds were fixed before the first training
    OM_STUDY_SIM_EXACT,   // Test, way (a): exact displacements of the visible part; seed 4001
    OM_STUDY_SIM_CAMERA,  // Test, way (b): a depth camera and correspondences; seed 4002
    OM_STUDY_SIM_BOARD,   // on a board under gravity, half of each way; seed 4003
    OM_STUDY_SIM_TWO,     // two separate regions, half of each way; seed 4004
    OM_STUDY_SIM_NSET
} OmStudySimulatedSet;

typedef enum OmStudySimulatedGuess {  // attachments
    OM_STUDY_SIM_ZERO,                // none
    OM_STUDY_SIM_ALL,                 // the lowest side: of the thin axis, away from the pull
    OM_STUDY_SIM_SAME,                // the true ones
    OM_STUDY_SIM_NET,                 // found by the network
    OM_STUDY_SIM_NGUESS
} OmStudySimulatedGuess;

#define OM_STUDY_SIM_NBIN 15  // of equal count, of probability

// Goals of the network: median DSC over cells of each set; median TPR of Test (a); the same of its samples of which
// less than half is visible (TestV); median AVE (m) of both, above that of the true attachments; expected calibration
// error of Test (a).
#define OM_STUDY_SIM_DSC ((const double[OM_STUDY_SIM_NSET]){0.88, 0.75, 0.78, 0.72})
#define OM_STUDY_SIM_TPR 0.92
#define OM_STUDY_SIM_DSC_V 0.82
#define OM_STUDY_SIM_TPR_V 0.88
#define OM_STUDY_SIM_AVE 0.0003
#define OM_STUDY_SIM_ECE 0.05

typedef struct OmStudySimulatedDef {  // made by om_study_simulated_default_def
    const char* out_dir;
    // The network, as for om_banet_net_find: a file, "none", or null (default): the one that comes along, if any.
    // Without a network its rows are empty, and the goals are missed.
    const char* weights;
    bool is_quick;  // two samples of each set, of small bodies and another seed; default false
    // of the Test sets; the others have half as many; default 380, as the thesis has. The report says a smaller number
    int nsample;
    // the first so many samples of each set are simulated, and have AVE and MVE; default -1: all
    int nsolve;
    int nworker;  // default 0: one a processor
    OmCookie cookie;
} OmStudySimulatedDef;

typedef struct OmStudySimulatedRow {
    StudySample dsc, tpr;            // (4.3) and (4.6), 0 to 1, over cells of the network's grid
    StudySample dsc_area, tpr_area;  // over vertices, weighted by their areas
    StudySample ave, mve;            // (4.5) and (4.7) over all vertices, m
    // simulations that did not reach the whole displacement of the grasp; AVE and MVE are of the part that they reached
    int nstopped;
} OmStudySimulatedRow;

typedef struct OmStudySimulatedSummary {
    int nsample[OM_STUDY_SIM_NSET];   // samples
    int nlost[OM_STUDY_SIM_NSET];     // of which no draw could be made; they are in no row
    int nnew;                         // samples evaluated now
    double input[OM_STUDY_SIM_NSET];  // m, median of the largest displacement of a sample
    OmStudySimulatedRow all[OM_STUDY_SIM_NSET][OM_STUDY_SIM_NGUESS];
    OmStudySimulatedRow hidden[OM_STUDY_SIM_NSET]
                              [OM_STUDY_SIM_NGUESS];  // visible below half: TestV
    bool has_net;                   // weights were found; else rows of the network are empty
    double ece[OM_STUDY_SIM_NSET];  // expected calibration error over cells with a surface vertex
    double bin_said[OM_STUDY_SIM_NSET][OM_STUDY_SIM_NBIN];  // mean probability
    double bin_true[OM_STUDY_SIM_NSET][OM_STUDY_SIM_NBIN];  // attached share
    double net_ms, solve_ms;  // median processor times of an estimate and of a simulation
    bool is_met;              // the goals of Test (a) and TestV (a)
} OmStudySimulatedSummary;

OmStudySimulatedDef om_study_simulated_default_def(const char* out_dir);
/// Make what is missing of samples and results, then report.html, study.json and samples.csv.
OmStatus om_study_simulated_run(const OmStudySimulatedDef* def, const OmProgress* progress,
                                OmStudySimulatedSummary* summary);

#endif
