// study_correspondence.h: shared by the files of the study of correspondence.
#ifndef OMENTUM_STUDY_CORRESPONDENCE_H
#define OMENTUM_STUDY_CORRESPONDENCE_H

#include "omentum/match_spectral.h"
#include "omentum/match_track.h"
#include "studies/study_internal.h"
#include "studies/study_match.h"
#include "studies/study_match_case.h"
#include "studies/study_table.h"

#define COR_MAX_POINT 4096
#define COR_MOVED 0.005  // m: points that moved less are not judged
// Raise it with every change of the method: results in folders are then made anew.
#define COR_METHOD 3

typedef struct CorWay {
    int is_lost;
    double ms;                   // processor time
    char reason[256];            // why it is lost
    float error[COR_MAX_POINT];  // m, in the rest shape; below 0: no answer
} CorWay;

typedef struct CorResult {  // of one case; the contents of its file
    int npoint, nmodel;     // points of the scan, vertices of the twin's surface
    double scan_ms;
    double off;                  // m, mean distance of the scan from the true surface
    float moved[COR_MAX_POINT];  // m, how far the material point went
    CorWay way[OM_STUDY_NWAY];
} CorResult;

typedef struct Cor {
    const OmStudyCorrespondenceDef* def;
    const OmProgress* progress;
    int ncase;
    const MatchCase* list;  // (ncase)
    CorResult* result;      // (ncase)
    OmStudyCorrespondenceSummary sum;
} Cor;

// A way over all cases for which `which` is nonzero (null: all).
OmStatus om__cor_summarise(const Cor* s, OmStudyWay way, const unsigned char* which,
                           OmStudyWayResult* result);
StudyGoals om__cor_goals(const OmStudyCorrespondenceSummary* sum);
OmStatus om__cor_write(const Cor* s);

// ---- ways: from a scan to its material points -------------------------------------------------------

typedef struct WayInput {  // all that a robot knows
    OmMatchLive* live;
    const OmMatchView* view;
    const OmSpectralBasis* basis;  // of the twin's surface at rest, made once
    const OmScan* scan;
    int ngrasp;
    const OmMatchGrasp* grasp;
    const OmMatchTracks* tracks[2];  // at the picture of the scan
    const double* x_twin[2];         // after 70 % of the way, and at its end      (nvert x 3)
} WayInput;

typedef struct WayAnswer {
    double* x_rest;      // material points in the rest shape, m        (npoint x 3)
    unsigned char* has;  // nonzero: there is an answer                 (npoint)
    bool is_lost;        // the way says that it has lost the tissue
    char reason[256];    // why
} WayAnswer;

#define WAY_NPAIR 200  // functions of `basis`

extern const char* const om__study_way_name[OM_STUDY_NWAY];   // for files
extern const char* const om__study_way_title[OM_STUDY_NWAY];  // for people
// Answers for every point of the scan.
OmStatus om__study_way_find(OmStudyWay way, const WayInput* in, WayAnswer* out);

#endif
