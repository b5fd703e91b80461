// study_trust_internal.h: shared by the files of the study of trust.
#ifndef OMENTUM_STUDY_TRUST_INTERNAL_H
#define OMENTUM_STUDY_TRUST_INTERNAL_H

#include "studies/study_goal.h"
#include "studies/study_trust.h"
#include "studies/study_trust_case.h"

#define TRUST_MAX_NODE 512  // of the twin's underside
// Raise it with every change of the method: results in folders are then made anew.
#define TRUST_METHOD 2
#define TRUST_QUICK_TRUTHS 4

typedef struct TrustUpdate {
    int is_there;  // 0: the case could not be made
    int is_accepted;
    int is_moved;     // a camera was corrected
    int cause;        // OmMatchCause, of the last acquisition
    int is_left_out;  // of two acquisitions: the wrong one
    double dice;      // of the estimated set, accepted or not
    double ms, judge_ms;
    char reason[256];  // of a refusal, else of a correction
    float probability[TRUST_MAX_NODE];
    unsigned char attached[TRUST_MAX_NODE];
} TrustUpdate;

typedef struct TrustResult {  // of one truth; the contents of its file
    int nnode, nlift;         // vertices of the underside; lifts with a picture
    double share;             // of the underside, held
    double height[TRUST_NLIFT];
    unsigned char truth[TRUST_MAX_NODE];
    TrustCase c[TRUST_NLIFT];
    TrustUpdate right[TRUST_NLIFT], wrong[TRUST_NLIFT];
    TrustUpdate two[TRUST_NLIFT - 1];  // lift k right, lift k + 1 of another truth
} TrustResult;

typedef struct Trust {
    const OmStudyTrustDef* def;
    const OmProgress* progress;
    uint64_t seed;
    int ntruth, cells;
    int nneeded, needed[OM_STUDY_TRUST_MAX_TRUTH + 1];  // truths, for missing results
    TrustResult* result;                                // (ntruth)
    OmStudyTrustSummary sum;
} Trust;

// Is the cause the one of this error?
bool om__trust_is_named(TrustError error, int cause);
// Accepted, and more Dice lost than allowed.
bool om__trust_is_bad(const TrustUpdate* update, const TrustUpdate* right);
// The summary of n results, but nnew.
OmStatus om__trust_summarise(int n, const TrustResult* result, OmStudyTrustSummary* summary);
// Add n vertices; sums stand in the fields until om__trust_reliability_end.
void om__trust_reliability_add(OmStudyReliability* r, int n, const float* probability,
                               const unsigned char* attached, const unsigned char* truth);
void om__trust_reliability_end(OmStudyReliability* r);

StudyGoals om__trust_goals(const OmStudyTrustSummary* sum);
OmStatus om__trust_write(const Trust* s);

#endif
