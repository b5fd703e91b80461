// study_simulated_internal.h: shared by the files of the study of simulated bodies, Table 4.1.
#ifndef OMENTUM_STUDY_SIMULATED_INTERNAL_H
#define OMENTUM_STUDY_SIMULATED_INTERNAL_H

#include "omentum/banet_grid.h"
#include "omentum/banet_sample.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_simulated.h"
#include "studies/study_table.h"

#define SIM_NSET OM_STUDY_SIM_NSET
#define SIM_NGUESS OM_STUDY_SIM_NGUESS
#define SIM_MAX_CELL 8192  // with a surface vertex
// Raise it with every change of the method: results in folders are then made anew.
#define SIM_METHOD 4

typedef struct SimMove {  // the body with a guess, moved
    int is_there, is_stopped;
    double ave, mve;  // m
    double load, ms;
} SimMove;

typedef struct SimScore {
    double dsc, tpr;            // over cells
    double dsc_area, tpr_area;  // over vertices by area
} SimScore;

typedef struct SimBase {  // of one sample, apart from the network; the contents of its file
    int is_made;          // a draw succeeded
    int is_camera, nregion, nvert, ncell;
    double share, visible, input, young, poisson, seconds;
    SimScore score[SIM_NGUESS];  // ZERO, ALL, SAME
    SimMove move[SIM_NGUESS];
} SimBase;

typedef struct SimNet {  // of the network
    SimScore score;
    SimMove move;
    double ms;
    int ncell;
    float probability[SIM_MAX_CELL];  // of cells with a surface vertex, ascending
    unsigned char is_true[SIM_MAX_CELL];
} SimNet;

typedef struct SimCase {  // a sample and its results
    int set, index;
    bool has_base, has_net;  // read from a file
    SimBase base;
    SimNet* net;
} SimCase;

typedef struct Sim {
    const OmStudySimulatedDef* def;
    const OmProgress* progress;
    struct OmBanetNet* net;  // null: no weights
    uint64_t net_hash;
    OmBanetSampleDef sample_def[SIM_NSET];
    int nsample[SIM_NSET], nsolve[SIM_NSET];
    int ncase;
    SimCase* c;  // by set, then index
    int* order;  // of the cases that are to be made
    OmStudySimulatedSummary sum;
} Sim;

extern const char* const om__sim_set_name[SIM_NSET];   // for files
extern const char* const om__sim_set_title[SIM_NSET];  // for people
extern const char* const om__sim_guess_name[SIM_NGUESS];
extern const char* const om__sim_guess_title[SIM_NGUESS];

// ---- study_simulated_sample.c -----------------------------------------------------------------------

// Read a sample from a file, or write one; om_banet_sample_done frees. False: no such file, or of another setup.
bool om__sim_sample_load(const char* dir, const char* name, uint64_t setup, OmBanetSample* sample);
OmStatus om__sim_sample_save(const char* dir, const char* name, uint64_t setup,
                             const OmBanetSample* sample);

typedef struct
    SimBody {  // a sample, ready for scores and simulations; om__sim_body_done frees; zero-initialise
    const OmBanetSample* sample;  // borrowed
    OmBanetGrid grid;
    double side;              // of the thesis's grid, m
    int* cell;                // of each surface vertex                         (surface.nvert)
    double* area;             //                                                (surface.nvert)
    unsigned char* guess;     // surface vertices: scratch                      (surface.nvert)
    unsigned char* attached;  // the same of the mesh                           (mesh.nvert)
    double* x;                // m, the moved body                              (mesh.nvert x 3)
    int ngrasp;
    int* grasp;          // vertices of the mesh
    double* goal;        // m                                                         (ngrasp x 3)
    AttachModel* model;  // made by the first move
} SimBody;

OmStatus om__sim_body_make(const OmBanetSample* sample, double side, SimBody* body);
void om__sim_body_done(SimBody* body);
// Fill body->guess with one of the guesses that need no network.
OmStatus om__sim_body_guess(SimBody* body, OmStudySimulatedGuess guess);
OmStatus om__sim_body_score(const SimBody* body, SimScore* score);
// Move the body with body->guess; the result is in body->x.
OmStatus om__sim_body_move(SimBody* body, SimMove* move);
// Probabilities of vertices into cells that hold one, ascending, and their true labels. OM_INVALID: too many cells.
OmStatus om__sim_body_cells(const SimBody* body, const double* probability, SimNet* net);

// Probabilities of surface vertices; body->guess has the set of greatest expected DSC.
OmStatus om__sim_net_estimate(const Sim* s, SimBody* body, double* probability);

// ---- study_simulated_report.c -----------------------------------------------------------------------

StudyGoals om__sim_goals(const OmStudySimulatedSummary* sum);
OmStatus om__sim_write(const Sim* s);
// A picture at rest, from the side of the attachments: green found and true, blue missed, red wrong (body->guess).
OmStatus om__sim_add_rest(const SimBody* body, int nworker, const char* caption, OmReport* report);
// A picture of the deformed body: the truth green, body->x yellow.
OmStatus om__sim_add_deformed(const SimBody* body, int nworker, const char* caption,
                              OmReport* report);
// The sample of a case, from its file or made anew.
OmStatus om__sim_sample_get(const Sim* s, const SimCase* c, OmBanetSample* sample);

#endif
