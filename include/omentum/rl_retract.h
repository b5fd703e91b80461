/// omentum/rl_retract.h: the task "retract": lift fat off a kidney until a tumour is seen (floor 7; thesis 5.2-5.4).
///
/// A sheet of fat of 90 x 90 mm lies on a kidney. One side of it is fixed. A tumour is on the kidney, under the sheet.
/// The tip of one instrument moves by 0.5 mm along each axis in a step, grasps the fat that it touches, and lifts it to
/// p_T. The endoscope looks from -x; z is up; the origin is on the table below the middle of the kidney.
///
///     OmRlRetractDef def = om_rl_retract_default_def();
///     OmRlTask* task;
///     om_rl_retract_create(&def, &task);              // or om_rl_task_create("retract", NULL, 0, &task)
///     om_rl_task_destroy(task);
///
/// doc/rl.md is its data sheet.
#ifndef OMENTUM_RL_RETRACT_H
#define OMENTUM_RL_RETRACT_H

#include "omentum/rl.h"
#include "omentum/robot.h"
#include "omentum/sense.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmRlReward {
    // Thesis 5.4.2: -0.5 d / d_max - 0.5, d the distance to q, while nothing is grasped; -0.5 d / d_max, d the distance
    // to p_T, afterwards. The sign of k is that of doc/errata.
    OM_RL_REWARD_THESIS,
    // Ours: a small cost of each step, the exposure at the end, and differences of a potential of the distance to the
    // grasping place, the place grasped, the exposure and the distance to p_T.
    OM_RL_REWARD_EXPOSE
} OmRlReward;

typedef enum OmRlTissue {
    OM_RL_CLUSTERS,  // engine pbd
    OM_RL_ELEMENTS   // engine fem
} OmRlTissue;

typedef struct OmRlKidney {  // a bent ellipsoid: ((x - bend y^2) / a)^2 + (y / b)^2 + (z / c)^2 = 1
    OmVec3 center;           // m; its height is that of the middle
    OmVec3 half;             // half-axes a, b, c, m
    double bend;             // of the poles away from the endoscope, 1/m
} OmRlKidney;

#define OM_RL_MAX_POINT 64
#define OM_RL_MAX_VARIANT 64

typedef struct OmRlRetractDef {  // made by om_rl_retract_default_def; lengths in m
    // ---- tissue
    OmRlTissue tissue;  // default OM_RL_CLUSTERS
    double thickness;   // default 3 mm
    // of clusters: found by `omentum study sheet-calibration`; thesis: 12.7 mm, 9.5 mm, 0.361
    double cluster_spacing;    // default 12.0 mm
    double cluster_radius;     // default 14.9 mm
    double cluster_stiffness;  // default 1
    bool has_self_collision;   // the fat does not pass through itself; default false
    double young, poisson;     // of elements, Pa; default 20 kPa, the truth of that study, and 0.45
    double density;            // kg/m^3; default 1000
    // ---- scene
    OmRlKidney kidney;
    // File that replaces it: a label volume (.nii, .nii.gz, .nrrd ...) or a closed surface (.stl, .obj, .ply, .off,
    // .vtp), in millimetres and RAS unless the file says otherwise. It is turned by its principal axes and put where
    // `kidney` is; tumour and p_T keep their place with respect to the kidney's box. Borrowed for create; default null.
    const char* kidney_file;
    int kidney_label;  // of a volume; default 3, the left kidney of TotalSegmentator
    // of the true kidney and tumour from where observations believe them; default 0
    OmVec3 kidney_shift;
    double tumour_x, tumour_y;          // q is the point of the kidney above; default -0.020 and 0
    double tumour_radius;               // default 8 mm
    OmVec3 target;                      // p_T
    OmVec3 workspace_lo, workspace_hi;  // the tip stays inside; positions are normalised by it
    OmInstrument instrument;            // default OM_LARGE_NEEDLE_DRIVER
    // file of the dVRK that replaces it (om_psm_load_instrument), borrowed for create; default null
    const char* instrument_file;
    OmCamera endoscope;
    // of render and of the observation, 8 to 1024; default 84 x 84
    int picture_width, picture_height;
    // of the grasping place of reward (b) from the fixed side, on the middle line; default 75 mm
    double goal_along;
    // ---- episodes
    int max_step;            // default 2500
    int hold;                // steps that the tip stays at p_T until an episode ends; default 10
    bool has_fixed_horizon;  // an episode never ends before max_step; default false
    // steps within 2 mm of one place after which an episode ends: the tip stands still; 0 (default): never
    int still;
    int repeat;           // of an action in a step, 1 to 100; default 1
    bool has_gripper;     // the gripper is a fourth action, 0 open and 1 close; default false
    double move;          // of the tip along an axis in a step; default 0.5 mm
    double time_step;     // s of tissue in a step; default 0.02
    double grasp_radius;  // fat within this distance of the tip is held; default 5 mm
    double reach;         // fat within this distance of the tip is grasped; default 2 mm
    double start_height;  // of the tip above the fat at the start; default 12 mm
    OmRlReward reward;    // default OM_RL_REWARD_EXPOSE
    double step_cost;     // of a step in OM_RL_REWARD_EXPOSE; default 0.002
    // width of the kidney around the tumour that OM_RL_REWARD_EXPOSE counts like the tumour; default 0
    double margin;
    int npoint;        // tissue points in the observation, 0 to OM_RL_MAX_POINT; default 0
    bool has_picture;  // the observation is the endoscope's picture, nothing else; default false
    bool is_awake;     // step the tissue also while nothing touches it; default false
    // ---- errors of "reality" and of randomisation
    // mean distance of the true tip from its measured place, drawn in each episode; default 0
    double tip_error;
    double camera_noise;  // standard deviation of a pixel's value, 0 to 255; default 0
    double slip_force;    // N, fat slips out of the jaws beyond it; of elements; default 0: never
    // Bodies, 1 to OM_RL_MAX_VARIANT; each episode draws one. Body k is the same in every task; each takes a second to
    // make. Default 1: the body of this definition.
    int nvariant;
    double vary_thickness;  // thickness of a body is up to this share more or less; default 0
    double vary_softness;   // young and cluster_stiffness are up to this share less; default 0
    double vary_kidney;     // kidney_shift is up to this distance off, in x and y; default 0
    OmCookie cookie;
} OmRlRetractDef;

OM_API OmRlRetractDef om_rl_retract_default_def(void);
/// The task. Infos: exposure (TE of 5.4.3, from a picture), grasped (0 or 1), and the place of the grasp in the flat
/// sheet: along (distance from the fixed side, m) and across (from the middle, m); slips, grasps that slipped;
/// inverted, most elements that a step left inverted (next to the jaws, where fat folds within an element).
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_rl_retract_create(const OmRlRetractDef* def, OmRlTask** task);

// ---- exposure by grasping place -----------------------------------------------------------------------

#define OM_RL_GRID 7  // starts of the evaluation along a side
typedef struct OmRlSurvey {
    double along[OM_RL_GRID];   // of each row from the fixed side, m
    double across[OM_RL_GRID];  // of each column from the middle, m
    // TE after grasping there and moving straight to p_T, rows from the fixed side
    double exposure[OM_RL_GRID][OM_RL_GRID];
} OmRlSurvey;
/// Grasp at each of 7 x 7 places of the sheet and lift straight to p_T.
/// @return OM_OK; OM_INVALID (not a task of om_rl_retract_create); errors of a step
OM_API OmStatus om_rl_retract_survey(const OmRlTask* task, int nworker, OmRlSurvey* survey);

#ifdef __cplusplus
}
#endif
#endif
