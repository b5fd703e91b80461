/// studies/study_trust.h: may an update of the attachments from depth pictures be trusted?
///
/// Sheets of the simulated world are lifted, and each picture is given to om_match_update twice: unchanged, and with
/// one error of a list, from harmless to gross. A right acquisition should be accepted. A wrong one should be corrected
/// or refused; accepted, its attachments should be as good as those of the right data. Truths, errors and sizes follow
/// from the seed of a draw (study_draw.h).
///
///     OmStudyTrustDef def = om_study_trust_default_def("out/trust");
///     om_study_trust_run(&def, progress, &summary);    // out/trust/report.html, study.json, cases.csv
#ifndef OMENTUM_STUDY_TRUST_H
#define OMENTUM_STUDY_TRUST_H

#include "studies/study_draw.h"

#define OM_STUDY_TRUST_LOSS 0.15     // an accepted wrong acquisition that loses more Dice is bad
#define OM_STUDY_TRUST_BAD 0.004     // goal: 2 of 500 wrong acquisitions are bad
#define OM_STUDY_TRUST_REFUSED 0.01  // goal: share of right acquisitions that is refused
#define OM_STUDY_TRUST_ECE 0.05      // goal: expected calibration error
#define OM_STUDY_TRUST_NBIN 15       // of probability
#define OM_STUDY_TRUST_NKIND 12      // of errors
#define OM_STUDY_TRUST_MAX_TRUTH 999

typedef struct OmStudyTrustDef {  // made by om_study_trust_default_def
    const char* out_dir;
    bool is_quick;      // at most four truths, on a coarse sheet; default false
    int ntruth;         // of five acquisitions each, 1 to 999; default 100
    OmStudyDraw draw;   // default: the seed of development
    const char* draws;  // table to which a judged draw is appended; null: none
    int nworker;        // truths at once; default 0: one a processor. An update has one worker
    OmCookie cookie;
} OmStudyTrustDef;

typedef struct OmStudyTrustKind {  // cases with one kind of error
    const char* name;              // for files
    int n;
    int nclean;      // accepted, nothing corrected
    int ncorrected;  // accepted, with a corrected camera
    int nrefused;
    int nnamed;               // of the refused ones: the verdict names the right cause
    int nbad;                 // accepted with a Dice more than 0.15 below that of the right data
    double dice_right, dice;  // medians of accepted cases: of the right data, and with the error
} OmStudyTrustKind;

typedef struct OmStudyReliability {  // of probabilities of vertices
    int n;
    int count[OM_STUDY_TRUST_NBIN];
    // of a bin: mean probability, and share of the vertices that is attached
    double mean[OM_STUDY_TRUST_NBIN], share[OM_STUDY_TRUST_NBIN];
    double ece;         // expected calibration error: mean of |mean - share| by `count`
    double brier;       // mean squared distance of probability and truth
    double brier_hard;  // the same of `attached` as 0 or 1
} OmStudyReliability;

typedef struct OmStudyTrustSummary {
    int ntruth, nnew;  // truths, and those evaluated now
    int nlost;         // lifts without a picture: the jaw lost the tissue
    int nright, nright_refused;
    // wrong acquisitions; nabsent: not made, because the other tissue has no such lift
    int nwrong, nwrong_refused, nbad, nabsent;
    OmStudyTrustKind kind[OM_STUDY_TRUST_NKIND];
    double dice_right, dice_wrong;  // medians of accepted cases
    OmStudyReliability right;       // accepted right cases
    OmStudyReliability all;         // accepted cases, right and wrong: the goal
    OmStudyReliability every;       // refused ones too
    // A right acquisition with one that shows other tissue. nout: this one was left out or the update refused.
    int ntwo, ntwo_out, ntwo_refused, ntwo_bad;
    // Of an update with right data, medians: processor time; judging, wall time.
    double ms, judge_ms;
    // At most 2 of 500 are bad, at most 1 % of the right ones are refused (both rounded to whole cases), and the
    // expected calibration error is at most 0.05.
    bool is_met;
} OmStudyTrustSummary;

OmStudyTrustDef om_study_trust_default_def(const char* out_dir);
/// Make what is missing of truths and results, then report.html, study.json and cases.csv.
OmStatus om_study_trust_run(const OmStudyTrustDef* def, const OmProgress* progress,
                            OmStudyTrustSummary* summary);

#endif
