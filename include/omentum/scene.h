/// omentum/scene.h: a scene is everything a run needs to know, read from one YAML file (floor 4).
///
/// A scene defines the tissue (a built-in sheet, a mesh file, or a patient model), its material and attachments, the
/// region of interest (ROI) below it, the cameras, the arms and the limits of the task. A *site* is built from it: a
/// mesh, the fixed anatomy around it and the ROI. Scenes use a task frame: origin at the centre of the tissue's
/// underside, z against gravity, the endoscope on the side of -x, PSM1 on the side of -y, PSM2 on the side of +y.
///
///     OmScene scene;
///     om_scene_load("scenes/sheet.yaml", &scene);
///     OmSite site;
///     om_site_build(&scene, OM_SITE_TWIN, NULL, &site);
///     ... om_site_done(&site);
#ifndef OMENTUM_SCENE_H
#define OMENTUM_SCENE_H

#include "omentum/base.h"
#include "omentum/sense.h"
#include "omentum/shape.h"
#include "omentum/shape_sdf.h"
#include "omentum/tissue.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_SCENE_NAME 64
#define OM_SCENE_PATH 512
#define OM_SCENE_MAX_GRID 16  // blocks along one side of the tissue: as OM_PLAN_MAX_GRID

typedef enum OmTissueSource {
    OM_SOURCE_SHEET,    // a box made here, lying on a board unless has_board is false
    OM_SOURCE_MESH,     // a ready tetrahedral mesh, the same
    OM_SOURCE_PATIENT,  // a patient model's YAML file: tissue over an organ
    OM_SOURCE_VOLUME    // the same, built from a segmented CT by the scene's own settings
} OmTissueSource;

typedef enum OmSceneWhere {  // of a part of the physics that twin or truth may leave out
    OM_IN_NONE,
    OM_IN_TRUTH,  // in the simulated truth alone
    OM_IN_BOTH    // in the twin, too
} OmSceneWhere;

typedef struct OmSceneTissue {
    // Engine of the twin, by its name in OmScene.engines; default "fem". The simulated truth has finite elements.
    char engine[OM_SCENE_NAME];
    // file that this engine reads, relative to the data root; "": none
    char weights[OM_SCENE_PATH];
    OmTissueSource source;
    OmVec3 size;         // m, of a sheet; default 120 x 120 x 5 mm
    OmVec3 cells;        // of the twin's sheet, default 16 x 16 x 1
    OmVec3 world_cells;  // of the simulated world's sheet; 0 (default): one and a half of `cells`
                         // along the sides, of linear elements also through the thickness
    char file[OM_SCENE_PATH];  // mesh, patient model, or volume; relative to the data root
    double unit;               // of a ready mesh, m; default 1
    OmVec3 up;    // against gravity, in the mesh's coordinates; default z; a patient has its own
    OmVec3 view;  // from the tissue towards the endoscope; default -x
    OmLaw law;    // default OM_NEO_HOOKEAN
    int element;  // OmTissueElement of bodies of engine "fem", -1 (default): shell of a sheet, else quadratic
    // Coulomb's, on board and organ; default below 0: 0.35 for particles, none for others
    double friction;
    // Where tissue may not pass through itself, of finite elements or another engine with a matrix; OmSceneWhere,
    // default OM_IN_NONE
    int self_contact;
    double self_thickness;  // m, distance that it keeps; default 0: a tenth of the mean edge
    // Coulomb's, tissue on tissue; default below 0: `friction`, none where that is not given
    double self_friction;
    bool has_board;  // under a sheet or a mesh; default true. A patient lies on its organ instead
    double young, poisson;  // Pa and 1; default 3000 and 0.45
    double density;         // kg/m^3; default 1000
    // A patient or a volume has materials of its own, which a scene file does not change (below 0)
    // where it says nothing. A young or density that it gives is the first material's, and the others
    // keep their ratio to it; a poisson is every material's.
    double rayleigh_mass;                    // 1/s; default 0.1
    double rayleigh_stiffness;               // s; default 0.01
    double gravity;                          // m/s^2, downwards; default 9.81
    double cluster_spacing, cluster_radius;  // of engine "pbd", m; default 12.7 and 9.5 mm
    double cluster_stiffness;                // 0 to 1; default 0.361
} OmSceneTissue;

typedef struct OmSceneModel {  // how a patient model is built from a volume; see OmModelDef
    int label;                 // of the organ in the volume
    double max_volume;         // bytes that its voxels may take; default OM_VOLUME_MAX_SIZE
    double edge;               // mean edge of the twin's mesh, m
    // Edge of the world's mesh; 0 (default): 0.7 of `edge`, or less where the world would have
    // fewer than twice the vertices of the twin.
    double world_edge;
    double thickness;                // of the sheet of fat, m
    char side[64];                   // of the organ that it covers: "anterior", "lateral", ...
    double half_length, half_width;  // m
    char attach[64];                 // attachment: "border:medial 25 %"
    double tumour_radius;            // m
    OmVec3 tumour_shift;             // along, across the sheet, m; z is not used
    // Layouts of one patient: a seed above 0 shifts the tumour by up to tumour_range either way and turns the
    // direction of `attach` by up to attach_turn either way about the covered side's. Default 0: nothing is drawn.
    OmVec3 tumour_range;  // along, across the sheet, m; z is not used
    double attach_turn;   // rad
} OmSceneModel;

typedef struct OmSceneOrgan {  // the organ under the tissue of a patient or a volume
    int deforms;               // where it does, OmSceneWhere; default OM_IN_NONE: it is rigid
    double edge;  // m, mean edge of its mesh; its surface stays that of the CT; default 10 mm
    // Pa, 1, kg/m^3; default 10000, 0.45 and 1050: a healthy kidney (Ruan et al. 2023, Insights Imaging 14:135)
    double young, poisson, density;
    // N/m^3: the organ lies on other tissue, springs of this stiffness by area hold the side away from the tissue that
    // the robot grasps; default 3e5, a centimetre of fat of 3 kPa
    double foundation;
} OmSceneOrgan;

typedef enum OmAttachKind {
    OM_ATTACH_RANDOM,  // a random patch of the underside (thesis 4.2.1), covering a random share of it
    OM_ATTACH_BOX,     // underside vertices inside a box of the task frame
    OM_ATTACH_SET      // the mesh's own set "attachment"
} OmAttachKind;

typedef struct OmSceneAttach {
    int kind;                     // OmAttachKind
    double share_min, share_max;  // of the underside; default 0.1 to 0.5
    OmVec3 lo, hi;                // m, the box
    double stiffness;             // N/m per vertex; 0 (default) holds the vertices still
    // N/m^3: springs of this stiffness by area, in place of `stiffness`; default 0
    double foundation;
    // The truth's springs hold on an organ that deforms, as a fascia does, not on fixed places; default false
    bool on_organ;
} OmSceneAttach;

typedef enum OmBeliefKind {
    OM_BELIEF_SAME,  // the truth's, shifted and grown
    OM_BELIEF_NONE,  // the twin has no attachment
    OM_BELIEF_BOX,   // underside vertices inside a box of the task frame
    OM_BELIEF_PATCH  // another random patch of the underside
} OmBeliefKind;

typedef struct OmSceneBelief {  // attachments of the twin, where they are not those of the truth
    OmBeliefKind kind;          // default OM_BELIEF_SAME
    OmVec3 shift;               // m, task frame, of OM_BELIEF_SAME; z is not used; default 0
    // m, of OM_BELIEF_SAME: the region extends by this, or shrinks if below 0; default 0
    double grow;
    // Attached vertices of OM_BELIEF_SAME over those of the truth: the region takes or loses vertices in the order of
    // D (4.1) around the vertex farthest inside it; thesis 6.5.2 has 0.2-0.6 and 1.4-1.6. Default 1.
    double ratio;
    int seed;           // of OM_BELIEF_PATCH; default 0
    double share;       // of the underside that OM_BELIEF_PATCH takes; default 0.3
    OmVec3 lo, hi;      // m, the box
    double stiffness;   // N/m per vertex, 0: held still; below 0 (default): the truth's
    double foundation;  // N/m^3, in place of `stiffness`; below 0 (default): the truth's
} OmSceneBelief;

typedef struct OmSceneRoiBelief {  // where the twin believes the ROI, beside its true place
    // m, task frame, along the board or the organ that carries the ROI; z is not used; default 0
    OmVec3 shift;
} OmSceneRoiBelief;

// Error of the registration: the whole site of the twin (mesh, board, organ, ROI, task frame, gravity) is moved against
// the truth. Cameras and arms are calibrated: they stand where they are.
typedef struct OmSceneRegistration {
    OmVec3 shift;  // m, task frame; default 0
    OmVec3 turn;   // rad, rotation vector in the task frame, about its origin; default 0
} OmSceneRegistration;

typedef struct OmSceneRoi {
    bool is_random;  // anywhere free under the tissue; default true
    OmVec3 center;   // m, task frame, if not random
    double radius;   // m; default 8 mm
    double margin;   // m, from the border of the tissue and from attachments; default 5 mm
} OmSceneRoi;

typedef struct OmSceneCamera {
    double distance;    // m from the task frame's origin
    double elevation;   // rad above the horizontal
    double fov;         // rad, vertical; not used where focal is given
    int width, height;  // pixels
    // Of a calibrated camera, as OpenCV and ROS write it: the centre of the first pixel is (0, 0).
    double focal[2];       // fx, fy, pixels; default 0: from fov
    double center[2];      // principal point cx, cy, pixels; default 0: the middle of the picture
    double distortion[5];  // k1, k2, p1, p2, k3; default 0
} OmSceneCamera;

typedef struct OmSceneWorld {  // settings of the simulated world that the twin does not know
    double young_factor;       // true Young's modulus over `young`; default 0.85
    double density_factor;     // default 1
    int law;                   // OmLaw of the true tissue, -1 (default): the twin's
    int element;               // OmTissueElement of the true tissue, -1 (default): the twin's
    double poisson;        // true Poisson's ratio of all materials, below 0 (default): the twin's
    double friction;       // true friction, below 0 (default): the twin's
    double tool_noise;     // m, standard deviation of a measured tool position; default 0.2 mm
    bool has_depth_noise;  // default true
    int narm;              // 1 (PSM1 alone) to OM_MAX_ARM; default 2
    // N, standard deviation of a measured force at the tip along each axis; default below 0: arms measure no force
    double force_noise;
    // A grasp slips where the force on the jaws exceeds grip_friction x grip_force: the tissue is free, and the jaws
    // close on nothing. Coulomb's friction; default below 0: no grasp slips.
    double grip_friction;
    double grip_force;  // N, of jaws sent to 0; more below 0, twice from -5 degrees on; default 8
    // Pa: an attached vertex tears off for good where the force of its attachment exceeds this times its area
    // (OmSite.attach_area); default 0: nothing tears
    double tear_strength;
} OmSceneWorld;

typedef struct OmSceneTask {
    int grid;  // N of the N x N grasping points, 2 to OM_SCENE_MAX_GRID; default 5
    // epsilon of Alg. 4, N; calibrated for each scene. Default 1.59, the sheet's.
    double force_threshold;
    // The arms slow down and stop by the twin's force; default true. False: no force limit, for twins whose engine has
    // no forces in newtons (OM_ENGINE_FORCES).
    bool watch_force;
    // N: by how much the force on the true tissue may exceed the twin's estimate. The arms act at
    // force_threshold less this. Calibrated for each scene; default 0.
    double force_margin;
    double max_height;  // m; default 50 mm
    double pull_step;   // m; default 10 mm
    double visibility;  // share that counts as exposed; default 0.8
    // A motion ends where the ROI is visible by this share more: `visibility` is the least that is
    // wanted, 1 less `visibility` asks for all of it. Default 0.05
    double visibility_margin;
    double speed;         // m/s; default 20 mm/s
    double grasp_radius;  // m; default 5 mm
    double time_step;     // s; default 0.02
    int max_actions;      // default 150
    // m: length of a fold, away from the camera or beyond the ROI. Beyond it a fold continues only
    // while visibility increases. Default 100 mm.
    double retract;
    // rad: by which the wrist may turn, from the orientation of the parked tool, where a joint forbids a motion with
    // it; 0: never, as in the thesis. Default 45 degrees.
    double wrist_turn;
    // Grasping points tried in the twin before a new plan during the operation, 0 to 16: look ahead. Default 0.
    int ahead;
} OmSceneTask;

#define OM_UPDATE_MAX_KEEP 8

typedef struct OmSceneUpdate {  // attachments of the twin corrected during the operation
    bool is_enabled;            // default false
    // s from the start of an estimate to its adoption in a simulated world, whatever time it took; default 0.6, as
    // an estimate of three views takes 0.4 to 0.55 s
    double latency;
    // acquisitions in one estimate, of a grasp one of lifted and one of folded tissue, 1 to OM_UPDATE_MAX_KEEP; default
    // 3
    int keep;
    double min_lift;  // m, tissue lifted less is not looked at; default 10 mm
    double rest;      // s that the arms keep still before the picture; default 0.3
    // weights of BA-Net that an estimate asks: "none" (default), "installed", or a file
    char network[OM_SCENE_PATH];
    // An estimate is adopted only if the updated twin is closer to what the camera sees; default true.
    bool is_checked;
    // Before the operation the model is moved onto the tissue that the depth camera sees at rest; default true.
    bool registers;
} OmSceneUpdate;

typedef struct OmSceneMonitor {  // the twin compared with the depth camera during the operation
    bool is_enabled;             // default false
    // m, discrepancy above which the warning state is 1, 2 and 3; above 0, ascending; default 2, 4 and 6 mm
    double limit[3];
    double hysteresis;  // m, by which it must fall below a limit; below limit[0]; default 0.5 mm
    double rate;        // frames a second; default 30
    int npoint;         // measured points in a frame, at most; default 1000
    // m, of OmMonitorFrame.part, above which the state is 1 and 2 in a pull; ascending, or both 0: parts of the tissue
    // are not watched. Default 4 and 8 mm. Ours, not in the thesis.
    double part_limit[2];
    double part_share;  // of the measured points, that make a part; default 0.02
} OmSceneMonitor;

typedef struct OmScene {
    // Engines that `tissue: engine` may name, borrowed; null (default): om_engine_set_default of body.h.
    const struct OmEngineSet* engines;
    char name[OM_SCENE_NAME];
    char path[OM_SCENE_PATH];       // the file it came from
    char data_root[OM_SCENE_PATH];  // files are relative to it; default: the scene's folder
    // values that replace the scene's own, as `omentum calibrate` leaves
    char calibrated[OM_SCENE_PATH];
    // them; relative to the scene's folder; "": none
    int seed;  // of attachments, ROI and noise; --layout sets it
    OmSceneTissue tissue;
    OmSceneModel model;
    OmSceneOrgan organ;
    OmSceneAttach attach;              // the truth
    OmSceneBelief believed;            // by the twin
    OmSceneRoiBelief believed_roi;     //
    OmSceneRegistration registration;  //
    OmSceneRoi roi;
    OmSceneCamera endoscope, rgbd;
    OmSceneWorld world;
    OmSceneTask task;
    OmSceneUpdate update;
    OmSceneMonitor monitor;
} OmScene;

/// The defaults above: the thesis's sheet.
OM_API OmScene om_scene_default(void);
/// Read a scene file; OM_INVALID names file, line, key and remedy.
/// @return OM_OK; OM_INVALID (the message names line, key and remedy); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_scene_load(const char* path, OmScene* scene);
/// The same from memory; `name` is the file's in messages.
/// @return OM_OK; OM_INVALID (the message names line, key and remedy); OM_NO_MEMORY
OM_API OmStatus om_scene_parse(const char* text, size_t size, const char* name, OmScene* scene);

/// The scene's file, or its name if it has none: the beginning of messages about it.
static inline const char* om_scene_label(const OmScene* scene) {
    return scene->path[0] ? scene->path : scene->name;
}

/// The camera at a pose: with its lens and a range of depth from 10 mm to 2 m.
OM_API OmCamera om_scene_camera_place(const OmSceneCamera* camera, OmPose pose_world_camera);

/// Append the scene as a file, with every default filled in: read again it gives the same run. Values without effect
/// become defaults. Paths are those of the scene, so `data_root` should be absolute if the file is to lie elsewhere.
/// @param is_commented  with unit, range and meaning of every key
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_scene_print(const OmScene* scene, bool is_commented, OmText* text);
/// Append a complete scene that runs, with every key and its meaning.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_scene_print_example(OmText* text);
/// Append the page of all keys, as Markdown: doc/scene_keys.md.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_scene_print_keys(OmText* text);

typedef enum OmSiteRole {
    OM_SITE_TWIN,  // the belief of the robot: coarse enough for real time
    OM_SITE_WORLD  // the simulated truth: at least twice the nodes, another mesh
} OmSiteRole;

/// True if a part of the physics (OmSceneWhere) belongs to the site of this role.
static inline bool om_scene_has(int where, OmSiteRole role) {
    return where == OM_IN_BOTH || (where == OM_IN_TRUTH && role == OM_SITE_WORLD);
}

/// The elements of bodies of engine "fem" at the site of this role.
static inline OmTissueElement om_scene_element(const OmScene* scene, OmSiteRole role) {
    if (role == OM_SITE_WORLD && scene->world.element >= 0)
        return (OmTissueElement)scene->world.element;
    if (scene->tissue.element >= 0) return (OmTissueElement)scene->tissue.element;
    return scene->tissue.source == OM_SOURCE_SHEET ? OM_ELEMENT_SHELL : OM_ELEMENT_QUADRATIC;
}

typedef struct OmSiteMaterial {  // a patient's own, by the mesh's tet_label
    char name[64];
    double young, poisson, density;  // Pa, 1, kg/m^3
} OmSiteMaterial;

#define OM_SITE_MATERIALS 16

typedef struct OmSite {
    OmSiteRole role;          //
    OmTissueElement element;  // of its body
    // world frame; sets "underside", "top", "attachment" (of the twin: as believed)
    OmTetMesh mesh;
    double attach_stiffness;   // N/m, of the spring of each attached vertex; 0: held still
    double attach_foundation;  // N/m^3; above 0: attach_spring holds instead
    double* attach_area;       // m^2, share of each vertex of the set "attachment", in its order
    double* attach_spring;     // N/m, of each of them
    OmPose pose_world_task;    // task frame
    // Frame by which the scene places cameras and arms: the task frame, but without the error of registration.
    OmPose pose_world_field;
    OmVec3 half_size;  // m, half the extent of the tissue in the task frame
    bool has_ground;   // a board at the task frame's z = 0
    bool has_organ;    // anatomy under the tissue, at rest; see `soft`
    OmSurface organ;   //
    OmSdf organ_sdf;   //
    // The organ as a body that deforms, with its set "attachment", and the springs of that set, N/m; no vertices:
    // it is rigid
    OmTetMesh soft;
    double* soft_spring;
    double soft_foundation;  // N/m^3, of these springs
    OmSiteMaterial soft_material;
    int nroi;           // sample points of the ROI's surface
    double* roi_x;      // world frame, m      (nroi x 3)
    double* roi_n;      // outward normals     (nroi x 3)
    OmSurface roi;      // to be drawn
    OmVec3 roi_center;  // world frame, m
    int nmaterial;      // of a patient; 0: all of the tissue is of one
    OmSiteMaterial material[OM_SITE_MATERIALS];
    double young, density;  // of this site's tissue, or its first material, Pa and kg/m^3
    double poisson;         // of all of it; below 0: each material's own
    OmVec3 gravity;         // world frame, m/s^2
} OmSite;

/// Build the twin's or the world's site. Both have the same anatomy and ROI, and the same attachments, unless
/// OmSceneBelief, OmSceneRoiBelief and OmSceneRegistration give the twin others; the world has another mesh and, by
/// OmSceneWorld, another stiffness. Nothing of OmSceneWorld reaches the twin's site.
/// @return OM_OK; OM_INVALID (nothing holds the tissue, a set is missing, the mesh of the truth is too coarse);
///        OM_NO_MEMORY; OM_IO; OM_CANCELLED
OM_API OmStatus om_site_build(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                              OmSite* site);
/// The tissue of a mesh or a patient model alone, as the twin's: it has no ROI but the patient's own, if there is one.
/// Where its file has no set "attachment", its lowest layer is held, on a board: all vertices within half a mean edge
/// of the lowest, and at least three.
/// @param holds_lowest  out: the lowest layer is held; may be null
/// @return OM_OK; OM_INVALID (a file's error, or the scene has no file); OM_NO_MEMORY; OM_IO; OM_CANCELLED
OM_API OmStatus om_site_build_tissue(const OmScene* scene, const OmProgress* progress, OmSite* site,
                                     bool* holds_lowest);
OM_API void om_site_done(OmSite* site);
/// Move all of a site but the frame of cameras and arms: mesh, board, organ, ROI, task frame, gravity. `soft` is made
/// anew from the moved organ, as for a site that was read. Bodies of the site are made afterwards.
/// @param scene   of the site
/// @param motion  world frame
/// @return OM_OK; OM_NO_MEMORY; errors of om_site_mesh_organ. Call om_site_done after an error.
OM_API OmStatus om_site_move(const OmScene* scene, OmSite* site, OmPose motion);
/// Make OmSite.soft where the scene wants an organ that deforms at the site's role: the last part of om_site_build, and
/// for sites that were read, whose `soft` is empty. Call om_site_done after an error.
/// @return OM_OK; OM_INVALID (no organ lies under the tissue, no part of it looks away from the tissue, errors of
///         om_tet_mesh_stuff); OM_NO_MEMORY
OM_API OmStatus om_site_mesh_organ(const OmScene* scene, OmSite* site);
/// Young's modulus, Poisson's ratio, density and the stiffness of attachments of a site by a scene's numbers, which
/// may have changed since the site was built.
OM_API void om_site_set_numbers(const OmScene* scene, OmSite* site);
/// m^2, attached area of the site. Twin and world have the same, unless the twin believes otherwise.
OM_API double om_site_attached_area(const OmSite* site);
/// m, mean edge of the site's mesh: the spacing of a scan that is matched with it.
OM_API double om_site_spacing(const OmSite* site);
/// The material of elements of this tet_label, at this site.
OM_API OmSiteMaterial om_site_get_material(const OmSite* site, int label);

#ifdef __cplusplus
}
#endif
#endif
