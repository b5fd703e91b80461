// study_match_ways.h: ways to find the material points of a scan, for the study of correspondence.
#ifndef OMENTUM_STUDY_MATCH_WAYS_H
#define OMENTUM_STUDY_MATCH_WAYS_H

#include "omentum/match_spectral.h"
#include "omentum/match_track.h"
#include "studies/study_match.h"
#include "studies/study_match_case.h"

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
