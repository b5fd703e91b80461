// study_retraction_protocol.h: cases of the retraction study: attachments, beliefs, regions of interest.
//
// Everything here was committed before the study was run. Tables 6.2 and 6.3 are of the scenarios.
#ifndef OMENTUM_STUDY_RETRACTION_PROTOCOL_H
#define OMENTUM_STUDY_RETRACTION_PROTOCOL_H

#include "omentum/scene.h"
#include "studies/study_draw.h"

#define RETRACTION_NSCENARIO 8
#define RETRACTION_FIRST_PAIR 1001  // seeds of random pairs: 1001 to 1100
#define RETRACTION_NPAIR 100
#define RETRACTION_FIRST_ALARM 3001
#define RETRACTION_NALARM 100
#define RETRACTION_DEV_PAIR 2501  // the same for development
#define RETRACTION_DEV_ALARM 3501
#define RETRACTION_NLAB 9         // A, B, C x fewer, more, same
#define RETRACTION_NKIDNEY 4      // wrong beliefs on the kidney scene
#define RETRACTION_MAX_FORCE 1.2  // epsilon: true force of a success at most

typedef enum RetractionKind {  // of a case
    RETRACTION_FEWER,          // the tissue has fewer attachments than believed
    RETRACTION_MORE,           // it has more
    RETRACTION_SAME,           // it has those believed
    RETRACTION_OTHER,          // it has others: another patch is believed
    RETRACTION_NONE,           // no attachment is believed
    RETRACTION_NKIND
} RetractionKind;

extern const char* const om__retraction_kind_name[RETRACTION_NKIND];  // for files: "fewer"

typedef enum RetractionKnowledge {  // attachments of the twin when the operation begins
    RETRACTION_BELIEVED,
    RETRACTION_TRUE
} RetractionKnowledge;

typedef enum RetractionGroup {
    RETRACTION_SCENARIO,
    RETRACTION_PAIR,
    RETRACTION_LAB,
    RETRACTION_KIDNEY,
    RETRACTION_ALARM,
    RETRACTION_NGROUP
} RetractionGroup;

typedef struct RetractionCase {  // tissue with true and believed attachments
    char name[64];  // for files: "scenario-1-fewer", "pair-1001-fewer-0123456789abcdef-1"
    RetractionGroup group;
    int number;  // scenario 1 to 8, seed of a pair or of an alarm, laboratory scenario 0 to 2
    RetractionKind kind;
    int seed;                // of the true patch, and of the noise
    int believed_seed;       // of the believed patch
    double share, believed;  // of the underside: true and believed
    OmVec3 roi;              // m, task frame
    int attempt;             // draws before this one, which were refused
    uint64_t draw_seed;      // of a judged draw; 0: the published cases
    double ratio;            // laboratory and kidney: believed attachments over the true ones
    const char* data;        // kidney: folder of the CT, borrowed
    bool is_quick;           // a coarser sheet and a grid of 3 x 3
} RetractionCase;

// A scenario (1 to 8) whose tissue has fewer or more attachments than believed, or those believed.
OmStatus om__retraction_scenario(int scenario, RetractionKind kind, bool is_quick,
                                 RetractionCase* c);
// A pair of a layout and a belief, number RETRACTION_FIRST_PAIR or RETRACTION_DEV_PAIR and above.
OmStatus om__retraction_pair(int number, const OmStudyDraw* draw, bool is_quick, RetractionCase* c);
// A sheet with right attachments and every other error, number RETRACTION_FIRST_ALARM or RETRACTION_DEV_ALARM and
// above.
OmStatus om__retraction_alarm(int number, const OmStudyDraw* draw, bool is_quick,
                              RetractionCase* c);
// Their names, without drawing them.
void om__retraction_pair_name(int number, const OmStudyDraw* draw, char* name, size_t size);
void om__retraction_alarm_name(int number, const OmStudyDraw* draw, char* name, size_t size);
// A case of the laboratory (0 to 8: A, B, C x belief fewer, more, same) and of the kidney (0 to 3).
RetractionCase om__retraction_lab(int i, bool is_quick);
RetractionCase om__retraction_kidney(int i, const char* data, bool is_quick);
OmStatus om__retraction_scene(const RetractionCase* c, RetractionKnowledge knowledge,
                              OmScene* scene);
double om__retraction_epsilon(void);  // N, of scenarios and pairs

#endif
