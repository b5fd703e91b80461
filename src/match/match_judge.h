// match_judge.h: does a scan of tissue at rest fit the model, and if not, what is wrong with it? (match_judge.c)
#ifndef OM_MATCH_JUDGE_H
#define OM_MATCH_JUDGE_H

#include "match/match_internal.h"
#include "omentum/shape_closest.h"

typedef struct MatchSample {  // a measured place
    OmVec3 p;                 // m, frame of the camera; world frame where the scan has none
    double noise;    // m, standard deviation of its own distance from the surface it lies on
    double model;    // m, ... of that surface, which neighbouring samples share; at the last pose
    bool is_tissue;  // else board or organ, or, of scans without tissue, anything
    int patch;       // of its nearest surface, at the last pose
    double e;        // m, distance from that surface, at the last pose
    OmVec3 n;        // gradient of e in the world frame
} MatchSample;

// Standard deviation of the distance of a sample, m.
static inline double om__sample_sigma(const MatchSample* s) {
    return sqrt(s->noise * s->noise + s->model * s->model);
}

static inline double om__degrees(double angle) { return 180 / OM_PI * angle; }

// What is supposed of the camera.
typedef struct MatchGuess {
    OmPose pose;    // world <- camera
    double focal;   // stated focal length over the true one
    double scale;   // stated depth over the true one
    bool is_range;  // depths are distances along the ray
} MatchGuess;

typedef struct MatchPatch {  // of a surface
    double sum, var,
        model;  // of its samples: distances, variances of noise and of the model; m and m^2
    int n;
    bool is_tissue;
} MatchPatch;

typedef struct MatchJudge {  // om__match_judge_done frees
    OmMatch* match;
    OmSurfaceTree* tree;  // of the surface at rest
    unsigned char* use;   // triangles that face the camera                    (ntri)
    double* normal;       // of triangles                                  (ntri x 3)
    double* center_of;    // of triangles                                  (ntri x 3)
    double* sag;          // m, by which its own weight has moved a triangle   (ntri)
    int nsample, capacity;
    MatchSample* sample;
    MatchPatch* patch;           // by hash                                       (MAX_PATCH)
    OmVec3 center;               // of the samples, frame of the camera
    double radius;               // m, their mean distance from it
    double size;                 // m, mean distance of the model's vertices from their middle
    bool is_any;                 // samples may lie on any surface: their classes are not known
    double max_turn, max_shift;  // rad and m, of a motion that is corrected
    const OmScan* scan;
    double* xs;  // of the surface, scratch                              (nvert x 3)
} MatchJudge;

// ---- for match_cause.c ---------------------------------------------------------------------------------------------

// Do pictures come with the scan?
bool om__judge_has_pixels(const OmScan* scan);
// Pixels of a class with a measured depth, spread over the picture.
OmStatus om__judge_add_pixels(MatchJudge* judge, OmScanPixel class, bool is_tissue);
void om__judge_set_center(MatchJudge* judge);
// The points of the scan as tissue, and the pixels of board and organ.
OmStatus om__judge_take_samples(MatchJudge* judge);
MatchGuess om__judge_as_stated(const OmScan* scan);
// Where a place of the camera's frame is in the world.
OmVec3 om__judge_place_of(const MatchGuess* guess, OmVec3 p);
// Distances of all samples; returns the mean of their squares over sigma, each at most that of a sample that does not
// fit. `explained`: share of the samples that fit; may be null.
double om__judge_measure(MatchJudge* judge, const MatchGuess* guess, double* explained);
// The camera turned about the samples' middle and shifted, from `guess` on, by Gauss and Newton with weights that fall
// beyond `scale` standard deviations (Geman and McClure). `weight` 1: with the prior that it stands at `stated`;
// 0: this prior only damps the iterations, and what the samples leave open stays. `sigma`: rad and m,
// in the least known directions; may be null.
void om__judge_fit_rigid(MatchJudge* judge, MatchGuess* guess, const MatchGuess* stated,
                         double scale, double weight, double sigma[2]);
// The focal length or the scale of depth that fits best.
MatchGuess om__judge_fit_ratio(MatchJudge* judge, const MatchGuess* stated, OmMatchCause cause);
// The motion from the stated pose to that of a guess.
void om__judge_set_motion(const MatchJudge* judge, const MatchGuess* stated,
                          const MatchGuess* guess, OmMatchVerdict* verdict);
OM_PRINTF(2, 3)
void om__judge_say(OmMatchVerdict* verdict, const char* format, ...);
// The cause of samples that do not fit at `stated`.
OmStatus om__judge_find_cause(MatchJudge* judge, const MatchGuess* stated, OmMatchVerdict* verdict);
// Do the colours fit the depths much better if the picture is mirrored? Then the verdict is not good.
OmStatus om__judge_mirrored(MatchJudge* judge, OmMatchVerdict* verdict);
// A scan with too few points of tissue.
OmStatus om__judge_empty(MatchJudge* judge, OmMatchVerdict* verdict);

// ---- for match_update.c --------------------------------------------------------------------------------------------

OmStatus om__match_judge_begin(OmMatch* match, MatchJudge* judge);
void om__match_judge_done(MatchJudge* judge);
// What a picture shows where the twin at x (nvert x 3 of the mesh) is in view: shares of pixels with tissue.
OmStatus om__match_judge_view(MatchJudge* judge, const OmScan* scan, const double* x,
                              OmMatchVerdict* verdict);
// Judge a scan. `is_rest`: all of it shows tissue that no tool has moved; else that part of it which fits best.
// `right`: the camera of a scan that is good, corrected where the verdict says so.
OmStatus om__match_judge(MatchJudge* judge, const OmScan* scan, bool is_rest,
                         OmMatchVerdict* verdict, MatchGuess* right);

#endif
