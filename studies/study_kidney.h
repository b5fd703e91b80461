/// studies/study_kidney.h: fat over the left kidney, in simulated samples and during dissection.
///
/// Thesis 4.5. Samples: random attachments and loads on one geometry, the network alone (Fig. 4.10). Dissection: the
/// tissue is grasped at A to D in three states and lifted by 10 to 50 mm before a depth camera (Table 4.3). In place of
/// an ex-vivo kidney stands a world with another mesh, another law and another stiffness than the twin. The geometry
/// comes from a segmented CT that is not part of omentum.
///
///     OmStudyKidneyDef def = om_study_kidney_default_def("out/kidney", "data/ct_abdomen/labels.nii.gz");
///     om_study_kidney_run(&def, progress, &summary);       // out/kidney/report.html, study.json
#ifndef OMENTUM_STUDY_KIDNEY_H
#define OMENTUM_STUDY_KIDNEY_H

#include "studies/study_match.h"

// Goals. Samples: medians. Dissection: mean of the rows and their worst (m), and the mean over rows of AVE over that
// without attachments.
#define OM_STUDY_KIDNEY_DSC 0.65
#define OM_STUDY_KIDNEY_AVE 0.0010
#define OM_STUDY_KIDNEY_MEAN 0.0018
#define OM_STUDY_KIDNEY_ROW 0.0040
#define OM_STUDY_KIDNEY_RATIO 0.15

#define OM_STUDY_KIDNEY_MAX_SAMPLE 100000
#define OM_STUDY_KIDNEY_MAX_RUN 100

typedef enum OmStudyKidneyWay {  // where the twin's attachments come from
    OM_STUDY_KIDNEY_ZERO,        // none
    OM_STUDY_KIDNEY_UNDER,       // the whole underside, from which the running twin starts
    OM_STUDY_KIDNEY_SAME,        // those of the truth
    OM_STUDY_KIDNEY_NETWORK,     // the network, one frame
    OM_STUDY_KIDNEY_FUSION,      // the network, this frame and the last ones of two earlier grasps
    OM_STUDY_KIDNEY_PHYSICS,     // om_match_update, one frame
    OM_STUDY_KIDNEY_ALL,         // om_banet_update from these frames: network, fusion and physics
    OM_STUDY_KIDNEY_NWAY
} OmStudyKidneyWay;

typedef struct OmStudyKidneyDef {  // made by om_study_kidney_default_def
    const char* out_dir;
    const char* volume;  // labels of the CT, the left kidney is 3; borrowed
    // The network, as for om_banet_net_find: a file, "none", or null (default): the one that comes along, if any.
    const char* weights;
    int nsample;  // 0: leave this part out; default 600
    int nrun;     // of the dissection, each with other noise; 0: leave it out; default 10
    // Coarser meshes, and one grasp in one state with two levels; default false. It does not change nsample and nrun.
    bool is_quick;
    int nworker;  // default 0: one a processor
    OmCookie cookie;
} OmStudyKidneyDef;

typedef struct OmStudyKidneyRow {  // of Table 4.3: a grasp in a state
    int grasp, state;              // 0 to 3: A to D; 0 to 2: states 1 to 3
    int nlevel;                    // levels that the lift reached: of `ave`
    double ave[5];                 // m, mean over the runs, less the error at rest
    double mean, sd;               // over the levels
} OmStudyKidneyRow;

typedef struct OmStudyKidneyTable {  // of one way
    bool is_there;                   // the ways of the network: a network was given
    OmStudyKidneyRow row[12];
    double mean;    // of the rows' means, m
    double worst;   // of the rows' means, m
    double ratio;   // mean over rows of mean AVE over that of OM_STUDY_KIDNEY_ZERO
    double volume;  // m, the same as `mean` over all vertices of the volume by their true positions
    // of the attached part of the underside; median of all views
    double dsc, tpr;
    int nrefused;  // views whose update was refused: the twin keeps its attachments
    int nloose;    // views whose twin did not come to rest
    double ms;     // processor time of an estimate, median
} OmStudyKidneyTable;

typedef struct OmStudyKidneySummary {
    bool has_network;
    // Samples: the network alone; without it dsc, tpr and ave are empty.
    int nsample;  // made
    int nfailed;  // of which no draw succeeded: in no row
    int nnew;     // samples and runs that were computed now
    StudySample dsc, tpr,
        ave;                 // over cells of the network's grid; ave in m, over all vertices
    StudySample same, zero;  // AVE with the true attachments and with none, m
    double input;            // m, median of the largest displacement
    // simulations that did not reach the whole displacement of the grasp; AVE is of the part that they reached
    int nstopped;
    // Dissection.
    int ntet;         // of the truth
    int nview, nrow;  // views of a run; rows of the tables
    int nmissing;     // levels that the truth did not reach
    double rest;      // m, mean error at rest
    OmStudyKidneyTable by[OM_STUDY_KIDNEY_NWAY];
    int nlost;    // views of all runs without correspondence for the network's row
    int nshort;   // lifts of the truth that ended early
    bool is_met;  // every goal of the parts that were run, by OM_STUDY_KIDNEY_ALL
} OmStudyKidneySummary;

OmStudyKidneyDef om_study_kidney_default_def(const char* out_dir, const char* volume);
/// Make what is missing of truths and results, then report.html, study.json, views.csv and samples.csv. Without a
/// network its rows are left out and is_met is false.
/// OM_UNAVAILABLE: no such volume; the message names it.
OmStatus om_study_kidney_run(const OmStudyKidneyDef* def, const OmProgress* progress,
                             OmStudyKidneySummary* summary);

#endif
