// study_attachments.h: shared by the files of the study of attachments.
#ifndef OMENTUM_STUDY_ATTACHMENTS_H
#define OMENTUM_STUDY_ATTACHMENTS_H

#include "omentum/banet_update.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_internal.h"
#include "studies/study_match.h"
#include "studies/study_match_case.h"
#include "studies/study_table.h"

#define ATT_MAX_NODE 512                // of the twin's underside
#define ATT_NUPDATE (MATCH_NGRASP + 1)  // single views, then all of them
// Raise it with every change of the method: results in folders are then made anew.
#define ATT_METHOD 5

typedef struct AttUpdate {
    int is_accepted;
    int nlost;  // views without correspondence
    char reason[256];
    double ms, fit_ms, infer_ms, check_ms;  // processor time, and the stages' own
    double seen_share, moved_share, after_median;
    int choice;  // OmMatchEstimate.choice
    double dsc, tpr;
    double own_ave[MATCH_NGRASP];  // m, of the twin positions of the estimate; below 0: none
    float probability[ATT_MAX_NODE], uncertainty[ATT_MAX_NODE];  // of the underside's vertices
    unsigned char attached[ATT_MAX_NODE];
} AttUpdate;

typedef struct AttResult {  // of one layout; the contents of its file
    int nnode;
    double share;                    // of the underside, held
    double node_x[ATT_MAX_NODE][2];  // m, task frame
    unsigned char truth[ATT_MAX_NODE];
    unsigned char still[ATT_NUPDATE][ATT_MAX_NODE];  // truly moved by less than 1 mm
    AttUpdate update[ATT_NUPDATE];                   // by physics
    AttUpdate network[ATT_NUPDATE];                  // by the network; the last: fused
    AttUpdate crossing;                              // the network's views intersected
    AttUpdate joint[ATT_NUPDATE];                    // by network and physics
    // m, of the moved twin; estimates by their own update
    double ave[OM_STUDY_NGUESS][MATCH_NGRASP], mve[OM_STUDY_NGUESS][MATCH_NGRASP];
    double scan_ms[MATCH_NGRASP];
    int npoint[MATCH_NGRASP];
    double seen[MATCH_NGRASP];  // share of the true surface's area that faces the camera
} AttResult;

typedef struct Att {
    const OmStudyAttachmentsDef* def;
    const OmProgress* progress;
    OmBanetNet* net;            // null: none
    uint64_t net_hash;          // om_banet_net_hash; 0: none
    int first, nlayout, cells;  // layouts of the set, in om__match_layout
    AttResult* result;          // (nlayout)
    OmStudyAttachmentsSummary sum;
} Att;

extern const char* const om__study_guess_name[OM_STUDY_NGUESS];   // for files
extern const char* const om__study_guess_title[OM_STUDY_NGUESS];  // for people
StudyGoals om__att_goals(const OmStudyAttachmentsSummary* sum);
OmStatus om__att_write(const Att* s);

#endif
