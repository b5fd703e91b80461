// rl_retract_internal.h: shared by the files of the task "retract".
#ifndef OMENTUM_RL_RETRACT_INTERNAL_H
#define OMENTUM_RL_RETRACT_INTERNAL_H

#include "omentum/contact.h"
#include "omentum/fem.h"
#include "omentum/pbd.h"
#include "omentum/rl_retract.h"
#include "omentum/tissue.h"

#define OM__RL_SIDE 30      // particles along a side
#define OM__RL_LENGTH 0.09  // m, of the sheet
#define OM__RL_NROI 96      // points of the tumour

typedef struct OmRlGround {  // kidney and table
    OmRlKidney kidney;       // of a file: its box
    bool is_loaded;          // from a file
    OmSdf sdf;               // of the kidney
    float* table;            // distance and normal at its nodes (nodes x 4)
    OmVec3 lo, hi;           // of the grid
    double shift;            // m, added to every distance
} OmRlGround;

typedef struct OmRlRetract {  // the task; constant
    OmRlTask head;
    OmRlRetractDef def;
    OmRlGround ground;
    OmTissueModel* tissue;
    OmContact* contact;
    unsigned char* rest;  // state of the tissue at rest
    size_t tissue_size;   // bytes of it
    double* rest_x;       // positions in it          (nvert x 3)
    int nvert;            //
    OmSurface sheet;      // triangles of the fat at rest
    int* sheet_vert;      // its vertices in the mesh; null: the same
    OmSurface organ, tumour, board, rail;
    OmPsm psm;
    OmQuat tip_q;                     // orientation of the tip
    OmVec3 q;                         // believed place of the tumour
    OmVec3 true_q;                    //
    OmVec3 goal;                      // grasping place of reward (b), on the fat at rest
    double goal_along;                // the same in the flat sheet, on its middle line, m
    double fixed_x;                   // m, fixed side of the flat sheet
    OmVec3 fat_lo, fat_hi;            // box around the fat at rest
    double rest_exposure;             // of the tumour's points, fat at rest
    int point_vert[OM_RL_MAX_POINT];  // vertices in the observation   (npoint)
    double d_max;                     // m, diagonal of the workspace
    OmWindow window;                  // of the endoscope's picture, around the tumour
    int nwhole;                       // pixels of the tumour in it without fat and tools
    unsigned char* disc;  // 1: pixel of the region of interest (window.height x window.width)
    double roi_uvw[3 * OM__RL_NROI];  // pixels and 1 / depth of the tumour's points
    double roi_lo[2], roi_hi[2];      // box around them, pixels
    double view[12];                  // row-major 3 x 4: pixels times depth, depth
} OmRlRetract;

typedef struct OmRlEpisode {  // plain data of a state
    OmRng rng;
    OmVec3 tip;    // measured
    OmVec3 error;  // of the true tip from it
    double q[OM_PSM_NJOINT];
    double along, across;  // place of the grasp in the flat sheet, m
    double quality;        // of that place, 0 to 1
    double exposure;       // visible share of the tumour's points now
    double potential;      // of reward (b)
    OmVec3 place;          // of the tip, since nplace steps within AT_TARGET
    int step, nhold, nstill, nplace;
    int frame;                              // pictures taken
    int nslip;                              // grasps that slipped
    int ninverted;                          // most elements that a step left inverted
    bool is_holding, is_closed, is_moving;  // is_moving: the fat is not at rest
    bool is_moved;                          // the fat left its rest in this episode
} OmRlEpisode;

typedef struct OmRlTool {  // an instrument in the picture
    const OmPsm* psm;
    const double* q;
    bool is_closed;
    OmSurface surface;  // made by the first picture
    int id;
} OmRlTool;

typedef struct OmRlRetractState {
    OmRlEpisode now;
    OmTissueState* tissue;
    OmTissueWork* work;
    OmContactWork* contact;
    OmSenseScene* scene;  // made by the first picture
    OmRlTool tool[OM_MAX_ARM];
    int ntool, sheet_id;
    OmPicture seen;  // the observation, where it is a picture
    double* pixel;   // of vertices: column, row, 1 / depth (nvert x 3)
} OmRlRetractState;

static inline const OmRlRetract* om__rl_retract(const OmRlTask* task) {
    return (const OmRlRetract*)task;
}

// ---- rl_retract_ground.c

OmStatus om__rl_ground_init(const OmRlKidney* kidney, OmRlGround* ground);
/// Of a kidney from a file: a closed surface and its box.
OmStatus om__rl_ground_init_surface(const OmSurface* surface, const OmRlKidney* box,
                                    OmRlGround* ground);
void om__rl_ground_done(OmRlGround* ground);
/// Distance of p to kidney and table; ctx is an OmRlGround.
double om__rl_ground_distance(const void* ctx, OmVec3 p, OmVec3* normal);
/// The point of the kidney's upper side above (x, y), and its normal.
OmVec3 om__rl_ground_top(const OmRlGround* ground, double x, double y, OmVec3* normal);

// ---- rl_retract_kidney.c

/// Load def->kidney_file and put it in the place of def->kidney; the box is that of the surface.
OmStatus om__rl_kidney_load(const OmRlRetractDef* def, OmSurface* surface, OmRlKidney* box);
/// Move tumour and p_T of the definition to where they are with respect to this kidney, and use it.
void om__rl_kidney_use(const OmRlKidney* box, OmRlRetractDef* def);

// ---- rl_retract_view.c

/// What the endoscope sees: surfaces, the pixels of the tumour, its points.
OmStatus om__rl_view_init(OmRlRetract* t);
void om__rl_view_done(OmRlRetract* t);
/// Visible share of the tumour's points behind fat at x (nvert x 3); pixel is scratch (nvert x 3).
double om__rl_exposure(const OmRlRetract* t, const double* x, double* pixel);
/// Draw the endoscope's picture.
OmStatus om__rl_render(const OmRlRetract* t, OmRlRetractState* s, OmPicture* picture);
/// Where the observation is a picture: take it. After it, om__rl_put_picture writes it.
OmStatus om__rl_look(const OmRlRetract* t, OmRlRetractState* s);
void om__rl_put_picture(const OmRlRetractState* s, float* obs);
/// Bytes of that picture; 0: the observation is none.
size_t om__rl_picture_size(const OmRlRetract* t);
/// TE of 5.4.3 from a picture.
OmStatus om__rl_measure(const OmRlRetract* t, OmRlRetractState* s, double* exposure);
void om__rl_view_drop(OmRlRetractState* s);

// ---- rl_retract_state.c

extern const OmRlTaskOps om__rl_retract_ops;
/// Let the fat fall on the kidney and come to rest; fills rest and rest_x.
OmStatus om__rl_settle(OmRlRetract* t);
/// Grasp the fat at the tip, wherever the tip is.
OmStatus om__rl_grasp(const OmRlRetract* t, OmRlRetractState* s);
/// Largest force of the first `narm` tools on the fat, N; NaN: clusters have no forces.
OmStatus om__rl_measure_force(const OmRlRetract* t, const OmRlRetractState* s, int narm,
                              double* force);
#define OM__RL_FAR \
    4.0f  // bound of an observation, in half widths of the workspace, which ends at 1
/// p in -1 to 1 of the workspace, three numbers; returns the place behind them.
float* om__rl_put_point(const OmRlRetract* t, OmVec3 p, float* obs);
/// The tip above the fat at rest, or above the kidney where there is none.
OmVec3 om__rl_start_above(const OmRlRetract* t, double x, double y, double height);
/// 2 forward, 1 backward, 0 stay: towards the end of the way.
static inline int om__rl_choice_towards(double way, double move) {
    return way > 0.5 * move ? 2 : way < -0.5 * move ? 1 : 0;
}
/// A random vector whose mean length is `mean`.
OmVec3 om__rl_draw_error(double mean, OmRng* rng);
/// The vertex of the fat next to the true tip, and its distance.
int om__rl_nearest(const OmRlRetract* t, const OmRlRetractState* s, double* distance);

// ---- rl_retract_settings.c

/// Fill task->values.
void om__rl_retract_print(const OmRlRetractDef* def, OmRlTask* task);

// ---- rl_retract_vary.c

/// Body k of a varied task.
OmRlRetractDef om__rl_draw_body(const OmRlRetractDef* def, int k);
/// A task whose episodes draw one of def->nvariant bodies.
OmStatus om__rl_varied_create(const OmRlRetractDef* def, OmRlTask** task);

// ---- rl_retract.c

/// The arm behind the kidney at the side of -y (-1) or +y (1), and the orientation of its tip: jaws point at the middle
/// of the workspace. Every corner of the workspace is in reach.
OmStatus om__rl_place_psm(const OmRlRetractDef* def, double side, OmPsm* psm, OmQuat* tip_q);
/// The place, in the fat at rest, of a point of the flat sheet.
OmVec3 om__rl_rest_place(const OmRlRetract* t, double along, double across);
/// The errors of "reality" (Fig. 5.10): other tissue, thickness, kidney, tip and camera.
void om__rl_retract_use_reality(OmRlRetractDef* def);
/// The limits of its numbers, those of the settings.
OmStatus om__rl_retract_check_numbers(const OmRlRetractDef* def);
void om__rl_retract_destroy(OmRlTask* task);

#endif
