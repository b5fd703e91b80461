// study_phantoms_eval.h: shared by the files of the study of phantoms.
#ifndef OMENTUM_STUDY_PHANTOMS_EVAL_H
#define OMENTUM_STUDY_PHANTOMS_EVAL_H

#include "studies/study_phantoms.h"
#include "studies/study_phantoms_case.h"
#include "studies/study_table.h"

#define PHANTOM_MAX_NODE 640  // of the twin's underside
#define PHANTOM_NVIEW (PHANTOM_NGRASP * PHANTOM_NLEVEL)
// Raise it with every change of the method: results in folders are then made anew.
#define PHANTOM_METHOD 3

typedef struct PhantomEstimate {
    int is_there, is_accepted;
    int nlost;         // of its views the network had no correspondence
    char reason[160];  // why not accepted
    double dsc, tpr;
    double ave, volume;  // m; of several grasps the mean
    float probability[PHANTOM_MAX_NODE];
    unsigned char attached[PHANTOM_MAX_NODE];
} PhantomEstimate;

typedef struct PhantomView {  // one step of a lift
    int grasp, level;         // level 1: lifted by 10 mm
    int npoint;               // of the scan
    double seen;              // share of the true surface's area that faces the camera
    double force;             // N
    double same_ave, same_volume, zero_ave, zero_volume;  // m
    PhantomEstimate by[OM_STUDY_PHANTOM_NWAY];
} PhantomView;

typedef struct PhantomResult {  // of one configuration; the contents of its file
    int nnode;
    double node_x[PHANTOM_MAX_NODE][2];  // m, of the twin's underside
    unsigned char truth[PHANTOM_MAX_NODE];
    double rest[PHANTOM_NGRASP];       // m, of the points at rest
    int nlevel[PHANTOM_NGRASP];        // that the lift of each grasp reached
    double end_force[PHANTOM_NGRASP];  // N, at the level that a lift did not keep; 0: none
    int nview;
    int nloose;  // solves of the protocol that stopped before the whole lift
    PhantomView view[PHANTOM_NVIEW];
    int joint_level;  // of all grasps together; 0: none
    double joint_same_ave, joint_same_volume;
    PhantomEstimate joint[OM_STUDY_PHANTOM_NWAY];
} PhantomResult;

typedef struct Phantoms {
    const OmStudyPhantomsDef* def;
    const OmProgress* progress;
    double coarse;
    OmBanetNet* net;             // null: none
    OmBanetEstimateFn estimate;  // in its place; null: none
    double threshold;
    uint64_t network;  // hash of what it is
    int ncase;
    PhantomCase c[PHANTOM_MAX_CASE];
    uint64_t hash[PHANTOM_MAX_CASE];  // of all that a result depends on
    // lifts that the folder does not have: PHANTOM_NGRASP x configuration + grasp  (nlift)
    int nlift, lift[PHANTOM_MAX_LIFT];
    PhantomResult* result;  // (ncase)
    OmStudyPhantomsSummary sum;
} Phantoms;

extern const char* const om__phantoms_way_name[OM_STUDY_PHANTOM_NWAY];   // for files
extern const char* const om__phantoms_way_title[OM_STUDY_PHANTOM_NWAY];  // for people
extern const char* const om__phantoms_row_name[OM_STUDY_PHANTOM_NROW];
extern const char* const om__phantoms_row_title[OM_STUDY_PHANTOM_NROW];

// All estimates of a configuration. Its lifts are in files of the folder.
OmStatus om__phantoms_eval(const Phantoms* s, const PhantomCase* c, PhantomResult* result);
// Which row of the table a step belongs to.
bool om__phantoms_is_in_row(const PhantomCase* c, const PhantomView* view, OmStudyPhantomRow row);
StudyGoals om__phantoms_goals(const OmStudyPhantomsSummary* sum);
OmStatus om__phantoms_write(const Phantoms* s);

#endif
