// study_kidney_case.h: fat over the left kidney, before and after dissection (thesis 4.3.2 and 4.5).
//
// The sheet of fat is built from a segmented CT and wraps the lateral half of the kidney. State 1 is the tissue as
// found; states 2 and 3 follow two stages of dissection, so their attachments are subsets. The tissue is grasped at A,
// B, C or D and lifted by 10 to 50 mm. Geometry, attachments, grasps, laws and seeds were committed before any method
// was measured on them.
#ifndef OMENTUM_STUDY_KIDNEY_CASE_H
#define OMENTUM_STUDY_KIDNEY_CASE_H

#include "omentum/banet_sample.h"
#include "omentum/banet_update.h"
#include "omentum/match.h"
#include "omentum/world.h"
#include "omentum/world_cloud.h"
#include "studies/study_kidney.h"
#include "studies/study_table.h"

#define KIDNEY_NGRASP 4    // A to D
#define KIDNEY_NSTATE 3    // 1 to 3
#define KIDNEY_NLEVEL 5    // lifts of 10 to 50 mm
#define KIDNEY_STEP 0.010  // m, between levels
#define KIDNEY_SAMPLE_SEED 4005
#define KIDNEY_CHUNK 20         // samples of a file
#define KIDNEY_NOISE_SEED 4106  // of run 0; the next runs follow

// Where the jaw closes, x and y of the task frame, m.
extern const double om__kidney_grasp[KIDNEY_NGRASP][2];

// Is a point of the underside attached in this state (0 to KIDNEY_NSTATE - 1)? Task frame, m.
bool om__kidney_is_attached(int state, OmVec3 p_task);
// The scene of twin and truth: `is_quick`: coarser meshes.
// @return OM_OK; OM_UNAVAILABLE (there is no such file); OM_INVALID (a path that is too long)
OmStatus om__kidney_make_scene(const char* volume, bool is_quick, OmScene* scene);
// The same with the mechanics of the truth: another law, another stiffness.
void om__kidney_set_truth(OmScene* scene);
// A site with the attachments of a state; state below 0: none.
OmStatus om__kidney_build_site(const OmScene* scene, OmSiteRole role, int state, OmSite* site);

// ---- the truth ----------------------------------------------------------------------------------------

typedef enum KidneyMoment {  // of a lift, kept as a snapshot of the world
    KIDNEY_REST,             // before the jaw comes near
    KIDNEY_CLOSED,           // the jaw has closed
    KIDNEY_LIFTED,           // level k: KIDNEY_LIFTED + k
    KIDNEY_NMOMENT = KIDNEY_LIFTED + KIDNEY_NLEVEL
} KidneyMoment;

typedef struct KidneyLift {       // of one grasp in one state
    int nlevel;                   // levels that were reached
    char reason[80];              // why not all of them; "" if all
    double force[KIDNEY_NLEVEL];  // N, pull of the tool at each level
    int nbad;                     // steps of the world that did not converge
} KidneyLift;

// The world of one state and its lifts. om__kidney_truth_close frees; zero-initialise.
typedef struct KidneyTruth {
    OmScene scene;
    OmSite site;  // of the world
    int state;
    bool is_quick;
    OmWorld* world;
    OmTetMesh mesh;     // the site's, with a vertex for each node of the quadratic elements
    OmSurface surface;  // boundary of `mesh`, at the last shown moment
    int* vert;          // vertex of `mesh` of each vertex of the surface
    double* x;          // nodes at the last shown moment, m            (mesh.nvert x 3)
    OmVec3 shift;       // m, error of calibration of the last look
    size_t size;        // of a snapshot, bytes
    KidneyLift lift[KIDNEY_NGRASP];
    // of each lift: KidneyLift, then the snapshots; null: not there yet
    unsigned char* file[KIDNEY_NGRASP];
} KidneyTruth;

// Hash of the truth's scene and motions, of the twin's scene or the truth's; not of the state.
OmStatus om__kidney_hash_truth(const OmScene* scene, uint64_t* hash);
OmStatus om__kidney_truth_open(const OmScene* scene, bool is_quick, int state, int nworker,
                               KidneyTruth* truth);
void om__kidney_truth_close(KidneyTruth* truth);
// Lift at a grasp, or read the result from a file of `dir` if it has one of this setup. is_new: may be null.
OmStatus om__kidney_truth_lift(KidneyTruth* truth, const char* dir, int grasp, bool* is_new);
// Show a moment of a lift that is there.
OmStatus om__kidney_truth_show(KidneyTruth* truth, int grasp, KidneyMoment moment);
// What the robot sees at a moment in a run: scan of the tissue and the tool that holds it (none at rest), both with
// the run's noise and error of calibration. `twin` is the robot's own site. om_scan_done frees the scan.
OmStatus om__kidney_truth_look(KidneyTruth* truth, int grasp, KidneyMoment moment, int run,
                               const OmSite* twin, OmAcquisition* acquisition);
// The depth camera's colour picture of a moment, as a PNG file.
OmStatus om__kidney_truth_save_picture(KidneyTruth* truth, int grasp, KidneyMoment moment,
                                       const char* path);

// ---- estimates ----------------------------------------------------------------------------------------

#define KIDNEY_MAX_VIEW (KIDNEY_NGRASP * KIDNEY_NLEVEL)
#define KIDNEY_NROW (KIDNEY_NGRASP * KIDNEY_NSTATE)

typedef struct KidneyGuess {  // attachments of one way from one view
    bool is_there, is_accepted;
    bool is_loose;     // the twin did not come to rest
    double dsc, tpr;   // of the underside
    double ave;        // m, points of the scan against their places on the twin
    double volume;     // m, all vertices of the twin against the truth
    double ms;         // processor time of the estimate
    char reason[120];  // why not accepted; "" if it was
} KidneyGuess;

typedef struct KidneyView {
    int grasp, level;
    int npoint;    // of the scan
    bool is_lost;  // the network found no correspondence
    KidneyGuess by[OM_STUDY_KIDNEY_NWAY];
} KidneyView;

typedef struct KidneyResult {  // of a run in a state
    KidneyLift lift[KIDNEY_NGRASP];
    int ntet;  // of the truth
    // m, points of a scan before the grasps against the twin at rest with the true attachments
    double rest;
    int nview;
    KidneyView view[KIDNEY_MAX_VIEW];
} KidneyResult;

typedef struct KidneyCases {  // of the whole study, or of a quick one
    int nstate, state[KIDNEY_NSTATE];
    int ngrasp, grasp[KIDNEY_NGRASP];
    int nlevel;
} KidneyCases;

typedef struct KidneySample {
    bool is_made;       // a draw succeeded
    double dsc, tpr;    // of the network, over cells
    double ave;         // m, of the network
    double same, zero;  // m, AVE with the true attachments and with none
    int nstopped;       // simulations that did not reach the whole displacement of the grasp
    double input, visible, share;  // largest displacement, m; seen and attached part of the surface
} KidneySample;

typedef struct Kidney {
    const OmStudyKidneyDef* def;
    const OmProgress* progress;
    KidneyCases cases;
    OmScene scene;               // of the twin
    OmSite twin;                 // without attachments
    OmBanetEstimateFn estimate;  // of the network; null: none
    void* estimate_ctx;
    uint64_t net_hash;  // om_banet_net_hash; 0: none
    // [state][run], by index into cases  (nstate x nrun)
    KidneyResult* result;
    KidneySample* sample;  // (nsample, and room to a multiple of KIDNEY_CHUNK)
    OmStudyKidneySummary sum;
} Kidney;

KidneyCases om__kidney_make_cases(bool is_quick);
// Find or make the results of all runs.
OmStatus om__kidney_run_lifts(Kidney* s);
// Compute the tables from the results.
OmStatus om__kidney_summarise_lifts(Kidney* s);
OmStatus om__kidney_run_samples(Kidney* s);
struct SimBody;
OmBanetSampleDef om__kidney_sample_def(const Kidney* s);
// Fill body->guess by the network.
OmStatus om__kidney_sample_guess(const Kidney* s, struct SimBody* body);
OmStatus om__kidney_summarise_samples(Kidney* s);
// The picture of the highest lift of a row: a file of the study's folder.
OmStatus om__kidney_picture_path(const Kidney* s, int grasp, int state, char* path, size_t size);
// The goals of the parts that were run.
StudyGoals om__kidney_goals(const Kidney* s);
OmStatus om__kidney_write(const Kidney* s);
extern const char* const om__kidney_way_name[OM_STUDY_KIDNEY_NWAY];
extern const char* const om__kidney_way_title[OM_STUDY_KIDNEY_NWAY];

#endif
