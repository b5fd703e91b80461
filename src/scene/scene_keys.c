// scene_keys.c: the keys of a scene file, each with its kind, range, unit, meaning and the sources that use it.
//
// The reader (scene_load.c), the printer of scenes and the page of all keys (scene_print.c) use these
// tables, so a key is described only here. Defaults are those of om_scene_default.
#include "scene/scene_keys.h"
#include "omentum/tissue.h"

#define MM 1e-3
#define DEG (OM_PI / 180.0)
#define AT(type, member) offsetof(type, member)
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

// The sources for which a key has an effect; none given: all.
#define IN(source) OM__SCENE_IN(source)
#define MADE (IN(OM_SOURCE_SHEET) | IN(OM_SOURCE_MESH))  // tissue without anatomical labels
#define READ (IN(OM_SOURCE_MESH) | IN(OM_SOURCE_PATIENT) | IN(OM_SOURCE_VOLUME))

const char* const om__scene_source_name[] = {"sheet", "mesh", "patient", "volume", NULL};
static const char* const attach_name[] = {"random_patch", "box", "set", NULL};

// In the order of OmLaw.
static const char* const law_name[] = {
    "corotational",  "linear", "st-venant-kirchhoff", "neo-hookean", "stable-neo-hookean",
    "mooney-rivlin", "ogden",  "ogden-coupled",       NULL};
_Static_assert(COUNT(law_name) == OM_NLAW + 1, "every law has a name");
static const char* const element_name[] = {"linear", "quadratic", "shell", NULL};
_Static_assert(COUNT(element_name) == OM_NTISSUE_ELEMENT + 1, "every element has a name");

// In the order of OmSceneWhere.
static const char* const where_name[] = {"no", "truth", "both", NULL};

static const OmYamlField tissue_field[] = {
    {"source", OM_YAML_ENUM, AT(OmSceneTissue, source), .name = om__scene_source_name,
     .is_required = true,
     .help = "a box made here, a ready mesh, a model of omentum model, or a segmented volume"},
    {"engine", OM_YAML_STRING, AT(OmSceneTissue, engine), .size = OM_SCENE_NAME,
     .help =
         "of the twin: fem, pbd, xpbd, springs, chainmail, umesh; the simulated truth has finite elements"},
    {"weights", OM_YAML_STRING, AT(OmSceneTissue, weights), .size = OM_SCENE_PATH,
     .help = "file of a trained network, of `engine: umesh`, relative to the data root"},
    {"size_mm", OM_YAML_VEC3, AT(OmSceneTissue, size), .min = 1, .max = 1000, .scale = MM,
     .group = IN(OM_SOURCE_SHEET), .unit = "mm", .help = "length along x and y, thickness"},
    {"cells", OM_YAML_VEC3, AT(OmSceneTissue, cells), .min = 1, .max = 200,
     .group = IN(OM_SOURCE_SHEET),
     .help = "cells of the twin's mesh along x, y and z; each has six tetrahedra"},
    {"world_cells", OM_YAML_VEC3, AT(OmSceneTissue, world_cells), .min = 0, .max = 200,
     .group = IN(OM_SOURCE_SHEET),
     .help =
         "the same of the simulated truth; 0: one and a half of `cells` along the sides, of linear elements also "
         "through the thickness"},
    {"file", OM_YAML_STRING, AT(OmSceneTissue, file), .size = OM_SCENE_PATH, .group = READ,
     .help = "mesh, patient.yaml or volume, relative to the data root"},
    {"unit_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, unit), .min = 1e-3, .max = 1e3, .scale = MM,
     .group = IN(OM_SOURCE_MESH), .unit = "mm", .help = "length of one unit of the mesh file"},
    {"up", OM_YAML_VEC3, AT(OmSceneTissue, up), .min = -1, .max = 1, .group = IN(OM_SOURCE_MESH),
     .help = "direction against gravity, in the mesh's coordinates"},
    {"view", OM_YAML_VEC3, AT(OmSceneTissue, view), .min = -1, .max = 1, .group = READ,
     .help = "direction from the tissue towards the endoscope"},
    {"law", OM_YAML_ENUM, AT(OmSceneTissue, law), .name = law_name, .help = "law of the material"},
    {"board", OM_YAML_BOOL, AT(OmSceneTissue, has_board), .group = MADE,
     .help = "does a board carry the tissue?"},
    {"element", OM_YAML_ENUM, AT(OmSceneTissue, element), .name = element_name,
     .help =
         "tetrahedra of four or ten nodes, or solid-shell cells of a sheet; left out: shell of sheets, quadratic of "
         "other tissue; linear ones bend too stiffly; needs `engine: fem`"},
    {"gravity", OM_YAML_DOUBLE, AT(OmSceneTissue, gravity), .min = 0, .max = 100, .unit = "m/s^2",
     .help = "points against `up`"},
    {"friction", OM_YAML_DOUBLE, AT(OmSceneTissue, friction), .min = 0, .max = 10,
     .help = "Coulomb's, on board and organ; left out: 0.35 for particles, none for the others"},
    {"self_contact", OM_YAML_ENUM, AT(OmSceneTissue, self_contact), .name = where_name,
     .help =
         "may tissue not pass through itself: nowhere, in the simulated truth, or in the twin, too (`engine: fem`)?"},
    {"self_thickness_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, self_thickness), .min = 0, .max = 20,
     .scale = MM, .unit = "mm",
     .help = "distance that surfaces of the tissue keep; 0: a tenth of the mean edge"},
    {"self_friction", OM_YAML_DOUBLE, AT(OmSceneTissue, self_friction), .min = 0, .max = 10,
     .help = "Coulomb's, tissue on tissue; left out: `friction`, none where that is left out"},
    // the numbers that can be calibrated are at the end: see NTISSUE_NUMBER
    {"young", OM_YAML_DOUBLE, AT(OmSceneTissue, young), .min = 1, .max = 1e9, .unit = "Pa",
     .help = "Young's modulus; left out on a patient or a volume: its own materials"},
    {"poisson", OM_YAML_DOUBLE, AT(OmSceneTissue, poisson), .min = 0, .max = OM_MAX_POISSON,
     .help = "Poisson's ratio; left out on a patient or a volume: its own materials"},
    {"density", OM_YAML_DOUBLE, AT(OmSceneTissue, density), .min = 1, .max = 20000,
     .unit = "kg/m^3", .help = "left out on a patient or a volume: its own materials"},
    {"rayleigh_mass", OM_YAML_DOUBLE, AT(OmSceneTissue, rayleigh_mass), .min = 0, .max = 1000,
     .unit = "1/s", .help = "damping in proportion to mass"},
    {"rayleigh_stiffness", OM_YAML_DOUBLE, AT(OmSceneTissue, rayleigh_stiffness), .min = 0,
     .max = 10, .unit = "s", .help = "damping in proportion to stiffness"},
    {"cluster_spacing_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_spacing), .min = 0.1,
     .max = 1000, .scale = MM, .unit = "mm",
     .help = "distance of cluster centres, of `engine: pbd`"},
    {"cluster_radius_mm", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_radius), .min = 0.1,
     .max = 1000, .scale = MM, .unit = "mm", .help = "radius of a cluster, of `engine: pbd`"},
    {"cluster_stiffness", OM_YAML_DOUBLE, AT(OmSceneTissue, cluster_stiffness), .min = 0, .max = 1,
     .help = "share of the way to its goal that a particle goes, of `engine: pbd`"},
};
static const char* const tissue_renamed[] = {"model", "engine", NULL};
#define BENDS "the default `element` bends as the tissue does"
static const char* const tissue_removed[] = {"mesh_factor", BENDS, "averaged", BENDS, NULL};
static const OmYamlSchema tissue_schema = {"tissue", tissue_field,   COUNT(tissue_field),
                                           NULL,     tissue_renamed, .removed = tissue_removed};

static const OmYamlField model_field[] = {
    {"label", OM_YAML_INT, AT(OmSceneModel, label), .min = 1, .max = 65535,
     .help = "label of the organ in the volume"},
    {"max_volume_gb", OM_YAML_DOUBLE, AT(OmSceneModel, max_volume), .min = 1e-3, .max = 64,
     .scale = 1e9, .unit = "GB", .help = "memory that the volume's voxels may take"},
    {"edge_mm", OM_YAML_DOUBLE, AT(OmSceneModel, edge), .min = 0.5, .max = 50, .scale = MM,
     .unit = "mm", .help = "mean edge of the twin's mesh"},
    {"world_edge_mm", OM_YAML_DOUBLE, AT(OmSceneModel, world_edge), .min = 0, .max = 50,
     .scale = MM, .unit = "mm",
     .help = "mean edge of the simulated truth's mesh; 0: 0.7 of edge_mm, or less where needed"},
    {"thickness_mm", OM_YAML_DOUBLE, AT(OmSceneModel, thickness), .min = 1, .max = 100, .scale = MM,
     .unit = "mm", .help = "thickness of the sheet of fat"},
    {"side", OM_YAML_STRING, AT(OmSceneModel, side), .size = 64,
     .help = "covered side of the organ: left, anterior, superior, lateral, ... or x,y,z"},
    {"half_length_mm", OM_YAML_DOUBLE, AT(OmSceneModel, half_length), .max = 500, .scale = MM,
     .unit = "mm", .help = "half of the sheet's extent along the organ; 0: 0.8 of the organ's"},
    {"half_width_mm", OM_YAML_DOUBLE, AT(OmSceneModel, half_width), .max = 500, .scale = MM,
     .unit = "mm", .help = "half of the sheet's extent across the organ; 0: 0.8 of the organ's"},
    {"attach", OM_YAML_STRING, AT(OmSceneModel, attach), .size = 64,
     .help =
         "where the fat is held: FACE or FACE:DIRECTION SHARE %, FACE one of border, underside, top"},
    {"tumour_radius_mm", OM_YAML_DOUBLE, AT(OmSceneModel, tumour_radius), .min = 1, .max = 100,
     .scale = MM, .unit = "mm", .help = "radius of the region of interest on the organ"},
    {"tumour_shift_mm", OM_YAML_VEC3, AT(OmSceneModel, tumour_shift), .scale = MM, .unit = "mm",
     .help = "of the tumour along and across the sheet; the third number is not used"},
    {"tumour_range_mm", OM_YAML_VEC3, AT(OmSceneModel, tumour_range), .max = 100, .scale = MM,
     .unit = "mm", .help = "shift drawn by a seed above 0, up to this either way"},
    {"attach_turn_deg", OM_YAML_DOUBLE, AT(OmSceneModel, attach_turn), .max = 180, .scale = DEG,
     .unit = "deg",
     .help = "turn of the attachment's direction drawn by a seed above 0, up to this either way"},
};
static const OmYamlSchema model_schema = {"model", model_field, COUNT(model_field), NULL};

static const OmYamlField organ_field[] = {
    {"deforms", OM_YAML_ENUM, AT(OmSceneOrgan, deforms), .name = where_name,
     .help =
         "does the organ under the tissue give way: nowhere, in the simulated truth, or in the twin, too?"},
    {"edge_mm", OM_YAML_DOUBLE, AT(OmSceneOrgan, edge), .min = 1, .max = 50, .scale = MM,
     .unit = "mm", .help = "mean edge of its mesh; its surface stays that of the CT"},
    {"young", OM_YAML_DOUBLE, AT(OmSceneOrgan, young), .min = 1, .max = 1e9, .unit = "Pa",
     .help = "Young's modulus"},
    {"poisson", OM_YAML_DOUBLE, AT(OmSceneOrgan, poisson), .min = 0, .max = OM_MAX_POISSON,
     .help = "Poisson's ratio"},
    {"density", OM_YAML_DOUBLE, AT(OmSceneOrgan, density), .min = 1, .max = 20000, .unit = "kg/m^3",
     .help = "of the organ"},
    {"foundation", OM_YAML_DOUBLE, AT(OmSceneOrgan, foundation), .min = 1, .max = 1e12,
     .unit = "N/m^3",
     .help = "stiffness by area of what the organ lies on, on the side away from the tissue"},
};
static const OmYamlSchema organ_schema = {"organ", organ_field, COUNT(organ_field), NULL};

static const OmYamlField attach_field[] = {
    {"kind", OM_YAML_ENUM, AT(OmSceneAttach, kind), .name = attach_name, .is_required = true,
     .help =
         "a random patch of the underside, the underside inside a box, or the mesh's own set \"attachment\""},
    {"share_min", OM_YAML_DOUBLE, AT(OmSceneAttach, share_min), .min = 0.01, .max = 0.95,
     .group = MADE, .help = "smallest share of the underside that a random patch covers"},
    {"share_max", OM_YAML_DOUBLE, AT(OmSceneAttach, share_max), .min = 0.01, .max = 0.95,
     .group = MADE, .help = "largest share of the underside that a random patch covers"},
    {"lo_mm", OM_YAML_VEC3, AT(OmSceneAttach, lo), .scale = MM, .group = MADE, .unit = "mm",
     .help = "lower corner of the box, task frame"},
    {"hi_mm", OM_YAML_VEC3, AT(OmSceneAttach, hi), .scale = MM, .group = MADE, .unit = "mm",
     .help = "upper corner of the box, task frame"},
    {"on_organ", OM_YAML_BOOL, AT(OmSceneAttach, on_organ),
     .group = IN(OM_SOURCE_PATIENT) | IN(OM_SOURCE_VOLUME),
     .help =
         "do the truth's springs hold on the organ, as a fascia does? It must deform; needs foundation or stiffness"},
    {"foundation", OM_YAML_DOUBLE, AT(OmSceneAttach, foundation), .min = 0, .max = 1e12,
     .unit = "N/m^3",
     .help = "stiffness by attached area (an elastic foundation), in place of `stiffness`"},
    {"stiffness", OM_YAML_DOUBLE, AT(OmSceneAttach, stiffness), .min = 0, .max = 1e9, .unit = "N/m",
     .help = "of the spring of every attached vertex; 0: held still"},
};
static const OmYamlSchema attach_schema = {"attachments", attach_field, COUNT(attach_field), NULL};

static const char* const belief_name[] = {"same", "none", "box", "random_patch", NULL};

static const OmYamlField belief_field[] = {
    {"kind", OM_YAML_ENUM, AT(OmSceneBelief, kind), .name = belief_name,
     .help = "the truth's, none, the underside inside a box, or another random patch of it"},
    {"shift_mm", OM_YAML_VEC3, AT(OmSceneBelief, shift), .min = -1000, .max = 1000, .scale = MM,
     .unit = "mm",
     .help = "`kind: same`: shift of the region, task frame; the third number is not used"},
    {"grow_mm", OM_YAML_DOUBLE, AT(OmSceneBelief, grow), .min = -1000, .max = 1000, .scale = MM,
     .unit = "mm",
     .help = "`kind: same`: the region extends by this on all sides; below 0 it shrinks"},
    {"ratio", OM_YAML_DOUBLE, AT(OmSceneBelief, ratio), .min = 0.01, .max = 20,
     .help =
         "`kind: same`: attached vertices over those of the truth, in the order of thesis (4.1)"},
    {"seed", OM_YAML_INT, AT(OmSceneBelief, seed), .min = 0, .max = 2000000000,
     .help = "`kind: random_patch`: its place"},
    {"share", OM_YAML_DOUBLE, AT(OmSceneBelief, share), .min = 0.01, .max = 0.95,
     .help = "`kind: random_patch`: of the underside"},
    {"lo_mm", OM_YAML_VEC3, AT(OmSceneBelief, lo), .scale = MM, .unit = "mm",
     .help = "lower corner of the box, task frame"},
    {"hi_mm", OM_YAML_VEC3, AT(OmSceneBelief, hi), .scale = MM, .unit = "mm",
     .help = "upper corner of the box, task frame"},
    {"foundation", OM_YAML_DOUBLE, AT(OmSceneBelief, foundation), .min = 0, .max = 1e12,
     .unit = "N/m^3", .help = "stiffness by attached area; left out: the truth's"},
    {"stiffness", OM_YAML_DOUBLE, AT(OmSceneBelief, stiffness), .min = 0, .max = 1e9, .unit = "N/m",
     .help = "of the spring of every attached vertex, 0: held still; left out: the truth's"},
};
static const OmYamlSchema belief_schema = {"believed_attachments", belief_field,
                                           COUNT(belief_field), NULL};

static const OmYamlField roi_belief_field[] = {
    {"shift_mm", OM_YAML_VEC3, AT(OmSceneRoiBelief, shift), .min = -1000, .max = 1000, .scale = MM,
     .unit = "mm",
     .help = "shift of the region along its ground, task frame; the third number is not used"},
};
static const OmYamlSchema roi_belief_schema = {"believed_roi", roi_belief_field,
                                               COUNT(roi_belief_field), NULL};

static const OmYamlField registration_field[] = {
    {"shift_mm", OM_YAML_VEC3, AT(OmSceneRegistration, shift), .min = -1000, .max = 1000,
     .scale = MM, .unit = "mm", .help = "of the twin against the truth, task frame"},
    {"turn_deg", OM_YAML_VEC3, AT(OmSceneRegistration, turn), .min = -90, .max = 90, .scale = DEG,
     .unit = "deg", .help = "the same: rotation vector about the task frame's origin"},
};
static const OmYamlSchema registration_schema = {"registration", registration_field,
                                                 COUNT(registration_field), NULL};

static const OmYamlField roi_field[] = {
    {"random", OM_YAML_BOOL, AT(OmSceneRoi, is_random),
     .help = "is the region of interest placed at random, anywhere free under the tissue?"},
    {"center_mm", OM_YAML_VEC3, AT(OmSceneRoi, center), .scale = MM, .unit = "mm",
     .help = "centre of the region, task frame; needs `random: false`"},
    {"radius_mm", OM_YAML_DOUBLE, AT(OmSceneRoi, radius), .min = 0.5, .max = 100, .scale = MM,
     .unit = "mm", .help = "radius of the region"},
    {"margin_mm", OM_YAML_DOUBLE, AT(OmSceneRoi, margin), .min = 0, .max = 100, .scale = MM,
     .unit = "mm", .help = "of a random region from the tissue's border and from attachments"},
};
static const OmYamlSchema roi_schema = {"roi", roi_field, COUNT(roi_field), NULL};

static const OmYamlField camera_field[] = {
    {"distance_mm", OM_YAML_DOUBLE, AT(OmSceneCamera, distance), .min = 10, .max = 2000,
     .scale = MM, .unit = "mm", .help = "from the middle of the tissue"},
    {"elevation_deg", OM_YAML_DOUBLE, AT(OmSceneCamera, elevation), .min = 1, .max = 90,
     .scale = DEG, .unit = "deg", .help = "above the horizontal"},
    {"fov_deg", OM_YAML_DOUBLE, AT(OmSceneCamera, fov), .min = 5, .max = 150, .scale = DEG,
     .unit = "deg", .help = "vertical field of view"},
    {"width", OM_YAML_INT, AT(OmSceneCamera, width), .min = 16, .max = 4096, .unit = "pixels",
     .help = "of the picture"},
    {"height", OM_YAML_INT, AT(OmSceneCamera, height), .min = 16, .max = 4096, .unit = "pixels",
     .help = "of the picture"},
    {"focal_px", OM_YAML_NUMBERS, AT(OmSceneCamera, focal), .capacity = 2, .min = 0, .max = 1e5,
     .unit = "pixels", .help = "focal lengths fx, fy of a calibrated camera; 0: from fov_deg"},
    {"center_px", OM_YAML_NUMBERS, AT(OmSceneCamera, center), .capacity = 2, .min = 0, .max = 4096,
     .unit = "pixels",
     .help =
         "principal point cx, cy as OpenCV and ROS count, the first pixel's centre is 0, 0; left out: the middle"},
    {"distortion", OM_YAML_NUMBERS, AT(OmSceneCamera, distortion), .capacity = 5, .min = -1000,
     .max = 1000,
     .help = "k1, k2, p1, p2, k3 of the lens, as OpenCV and ROS (plumb_bob) write them"},
};
static const OmYamlSchema camera_schema = {"camera", camera_field, COUNT(camera_field), NULL};

static const OmYamlField world_field[] = {
    {"young_factor", OM_YAML_DOUBLE, AT(OmSceneWorld, young_factor), .min = 0.1, .max = 10,
     .help = "true Young's modulus over the twin's"},
    {"density_factor", OM_YAML_DOUBLE, AT(OmSceneWorld, density_factor), .min = 0.1, .max = 10,
     .help = "true density over the twin's"},
    {"law", OM_YAML_ENUM, AT(OmSceneWorld, law), .name = law_name,
     .help = "true law of the material; left out: the twin's"},
    {"element", OM_YAML_ENUM, AT(OmSceneWorld, element), .name = element_name,
     .help = "elements of the truth; left out: the twin's"},
    {"poisson", OM_YAML_DOUBLE, AT(OmSceneWorld, poisson), .min = 0, .max = OM_MAX_POISSON,
     .help = "true Poisson's ratio, of all materials; left out: the twin's"},
    {"friction", OM_YAML_DOUBLE, AT(OmSceneWorld, friction), .min = 0, .max = 10,
     .help = "true friction on board and organ; left out: the twin's"},
    {"tool_noise_mm", OM_YAML_DOUBLE, AT(OmSceneWorld, tool_noise), .min = 0, .max = 10,
     .scale = MM, .unit = "mm", .help = "standard deviation of a measured tool position"},
    {"depth_noise", OM_YAML_BOOL, AT(OmSceneWorld, has_depth_noise),
     .help = "does the depth camera have noise?"},
    {"arms", OM_YAML_INT, AT(OmSceneWorld, narm), .min = 1, .max = OM_MAX_ARM,
     .help = "of the robot; 1: PSM1 alone"},
    {"force_noise", OM_YAML_DOUBLE, AT(OmSceneWorld, force_noise), .min = -1, .max = 100,
     .unit = "N", .help = "standard deviation of a measured tool force; below 0: none is measured"},
    {"grip_friction", OM_YAML_DOUBLE, AT(OmSceneWorld, grip_friction), .min = -1, .max = 10,
     .help = "a grasp slips beyond this times grip_force; below 0: no grasp slips"},
    {"grip_force", OM_YAML_DOUBLE, AT(OmSceneWorld, grip_force), .min = 0, .max = 1000, .unit = "N",
     .help = "of the jaws on the tissue"},
    {"tear_strength", OM_YAML_DOUBLE, AT(OmSceneWorld, tear_strength), .min = 0, .max = 1e12,
     .unit = "Pa", .help = "force by area beyond which an attachment tears off; 0: nothing tears"},
};
static const OmYamlSchema world_schema = {"world", world_field, COUNT(world_field), NULL};

static const OmYamlField task_field[] = {
    {"grid", OM_YAML_INT, AT(OmSceneTask, grid), .min = 2, .max = OM_SCENE_MAX_GRID,
     .help = "grasping points along a side: grid x grid blocks"},
    {"force_threshold", OM_YAML_DOUBLE, AT(OmSceneTask, force_threshold), .min = 1e-3, .max = 1000,
     .unit = "N",
     .help = "epsilon: the pull that the tissue may bear; omentum calibrate-force measures it"},
    {"force_margin", OM_YAML_DOUBLE, AT(OmSceneTask, force_margin), .min = 0, .max = 1000,
     .unit = "N",
     .help = "by which the truth may exceed the twin: the arms act at force_threshold less this"},
    {"watch_force", OM_YAML_BOOL, AT(OmSceneTask, watch_force),
     .help =
         "do the arms stop at the force limit? must be false for engines without forces (pbd, chainmail, umesh)"},
    {"max_height_mm", OM_YAML_DOUBLE, AT(OmSceneTask, max_height), .min = 1, .max = 500,
     .scale = MM, .unit = "mm",
     .help = "to which tissue is lifted over the point where it was grasped"},
    {"pull_step_mm", OM_YAML_DOUBLE, AT(OmSceneTask, pull_step), .min = 1, .max = 100, .scale = MM,
     .unit = "mm", .help = "height of one pull"},
    {"visibility", OM_YAML_DOUBLE, AT(OmSceneTask, visibility), .min = 0.01, .max = 1,
     .help = "share of the region's points that counts as exposed"},
    {"visibility_margin", OM_YAML_DOUBLE, AT(OmSceneTask, visibility_margin), .min = 0.01, .max = 1,
     .help = "a motion ends where this share more than `visibility` is seen"},
    {"speed_mm_s", OM_YAML_DOUBLE, AT(OmSceneTask, speed), .min = 0.1, .max = 500, .scale = MM,
     .unit = "mm/s", .help = "of the tips"},
    {"grasp_radius_mm", OM_YAML_DOUBLE, AT(OmSceneTask, grasp_radius), .min = 0.5, .max = 50,
     .scale = MM, .unit = "mm", .help = "tissue within this of the tip is held"},
    {"time_step_ms", OM_YAML_DOUBLE, AT(OmSceneTask, time_step), .min = 1, .max = 100,
     .scale = 1e-3, .unit = "ms", .help = "of twin and truth"},
    {"max_actions", OM_YAML_INT, AT(OmSceneTask, max_actions), .min = 1, .max = 1000,
     .help = "after which the arms give up"},
    {"retract_mm", OM_YAML_DOUBLE, AT(OmSceneTask, retract), .min = 1, .max = 500, .scale = MM,
     .unit = "mm", .help = "way of a fold, away from the camera or beyond the region"},
    {"wrist_turn_deg", OM_YAML_DOUBLE, AT(OmSceneTask, wrist_turn), .min = 0, .max = 90,
     .scale = DEG, .unit = "deg",
     .help = "by which the wrist may turn where a joint forbids a motion; 0: it never turns"},
    {"ahead", OM_YAML_INT, AT(OmSceneTask, ahead), .min = 0, .max = 16,
     .help = "grasping points tried in the twin before a new plan; 0: none"},
};
static const OmYamlSchema task_schema = {"task", task_field, COUNT(task_field), NULL};

static const OmYamlField update_field[] = {
    {"enabled", OM_YAML_BOOL, AT(OmSceneUpdate, is_enabled),
     .help = "are the twin's attachments corrected during the operation?"},
    {"latency_s", OM_YAML_DOUBLE, AT(OmSceneUpdate, latency), .min = 0, .max = 60, .unit = "s",
     .help = "from the start of an estimate to its adoption, in a simulated world"},
    {"keep", OM_YAML_INT, AT(OmSceneUpdate, keep), .min = 1, .max = OM_UPDATE_MAX_KEEP,
     .help = "acquisitions that one estimate is made from: of a grasp one lifted, one folded"},
    {"min_lift_mm", OM_YAML_DOUBLE, AT(OmSceneUpdate, min_lift), .min = 0, .max = 500, .scale = MM,
     .unit = "mm", .help = "tissue lifted less is not looked at"},
    {"rest_s", OM_YAML_DOUBLE, AT(OmSceneUpdate, rest), .min = 0, .max = 10, .unit = "s",
     .help = "for which the arms keep still before the picture of an acquisition"},
    {"network", OM_YAML_STRING, AT(OmSceneUpdate, network), .size = OM_SCENE_PATH,
     .help = "weights of BA-Net that an estimate asks: none, installed, or a file"},
    {"check", OM_YAML_BOOL, AT(OmSceneUpdate, is_checked),
     .help = "is an estimate adopted only if the updated twin is closer to what the camera sees?"},
    {"register", OM_YAML_BOOL, AT(OmSceneUpdate, registers),
     .help = "is the model moved, before the operation, onto the tissue seen at rest?"},
};
static const OmYamlSchema update_schema = {"update", update_field, COUNT(update_field), NULL};

static const OmYamlField monitor_field[] = {
    {"enabled", OM_YAML_BOOL, AT(OmSceneMonitor, is_enabled),
     .help = "is the twin compared with the depth camera during the operation?"},
    {"limits_mm", OM_YAML_NUMBERS, AT(OmSceneMonitor, limit), .min = 0.1, .max = 100, .scale = MM,
     .capacity = 3, .unit = "mm",
     .help = "discrepancy above which the warning state is 1, 2 and 3; ascending"},
    {"hysteresis_mm", OM_YAML_DOUBLE, AT(OmSceneMonitor, hysteresis), .min = 0, .max = 50,
     .scale = MM, .unit = "mm",
     .help = "the state falls where the discrepancy is below its limit by this"},
    {"rate_hz", OM_YAML_DOUBLE, AT(OmSceneMonitor, rate), .min = 0.1, .max = 1000, .unit = "1/s",
     .help = "frames a second"},
    {"points", OM_YAML_INT, AT(OmSceneMonitor, npoint), .min = 100, .max = 100000,
     .help = "measured points on the tissue in a frame, at most"},
    {"part_limits_mm", OM_YAML_NUMBERS, AT(OmSceneMonitor, part_limit), .min = 0, .max = 100,
     .scale = MM, .capacity = 2, .unit = "mm",
     .help =
         "lift of a part of the tissue that twin or picture does not have, above which the state in "
         "a pull is 1 and 2; ascending; [0, 0]: parts are not watched"},
    {"part_share", OM_YAML_DOUBLE, AT(OmSceneMonitor, part_share), .min = 0.001, .max = 0.5,
     .help = "share of the measured points that makes a part"},
};
static const OmYamlSchema monitor_schema = {"monitor", monitor_field, COUNT(monitor_field), NULL};

static const OmYamlField scene_field[] = {
    {"name", OM_YAML_STRING, AT(OmScene, name), .size = OM_SCENE_NAME, .is_required = true,
     .help = "of the scene, for reports"},
    {"data_root", OM_YAML_STRING, AT(OmScene, data_root), .size = OM_SCENE_PATH,
     .help = "folder that files are relative to; left out: the scene's folder; --data replaces it"},
    {"calibrated", OM_YAML_STRING, AT(OmScene, calibrated), .size = OM_SCENE_PATH,
     .help =
         "values of omentum calibrate that replace the scene's own, relative to the scene's folder"},
    {"seed", OM_YAML_INT, AT(OmScene, seed), .min = 0, .max = 2147483647,
     .help = "of attachments, region and noise; --layout replaces it"},
    {"tissue", OM_YAML_STRUCT, AT(OmScene, tissue), .sub = &tissue_schema, .is_required = true,
     .help = "the tissue"},
    {"model", OM_YAML_STRUCT, AT(OmScene, model), .sub = &model_schema,
     .group = IN(OM_SOURCE_VOLUME), .help = "how a patient model is built from a volume"},
    {"organ", OM_YAML_STRUCT, AT(OmScene, organ), .sub = &organ_schema,
     .group = IN(OM_SOURCE_PATIENT) | IN(OM_SOURCE_VOLUME),
     .help = "the organ under the tissue, as a body that deforms"},
    {"attachments", OM_YAML_STRUCT, AT(OmScene, attach), .sub = &attach_schema,
     .help = "where the tissue is attached, in truth"},
    {"believed_attachments", OM_YAML_STRUCT, AT(OmScene, believed), .sub = &belief_schema,
     .help = "where the twin believes it to be attached; left out: the truth"},
    {"believed_roi", OM_YAML_STRUCT, AT(OmScene, believed_roi), .sub = &roi_belief_schema,
     .help = "where the twin believes the region of interest; left out: at its true place"},
    {"registration", OM_YAML_STRUCT, AT(OmScene, registration), .sub = &registration_schema,
     .help = "error of the registration: the twin's whole site is moved against the truth"},
    {"roi", OM_YAML_STRUCT, AT(OmScene, roi), .sub = &roi_schema, .group = MADE,
     .help = "the region of interest that the tissue hides"},
    {"endoscope", OM_YAML_STRUCT, AT(OmScene, endoscope), .sub = &camera_schema,
     .help = "the camera that must see the region, on the side of `view`"},
    {"rgbd", OM_YAML_STRUCT, AT(OmScene, rgbd), .sub = &camera_schema,
     .help = "the depth camera, on the other side"},
    {"world", OM_YAML_STRUCT, AT(OmScene, world), .sub = &world_schema,
     .help = "what the simulated truth hides from the twin"},
    {"task", OM_YAML_STRUCT, AT(OmScene, task), .sub = &task_schema,
     .help = "what the arms may do"},
    {"update", OM_YAML_STRUCT, AT(OmScene, update), .sub = &update_schema,
     .help = "how the twin's attachments are corrected by the depth camera"},
    {"monitor", OM_YAML_STRUCT, AT(OmScene, monitor), .sub = &monitor_schema,
     .help = "how the twin is compared with the tissue that the depth camera sees"},
};
const OmYamlSchema om__scene_schema = {"scene", scene_field, COUNT(scene_field), NULL};

// Results of a calibration: the numbers at the end of two of the tables, none of them required.
enum { NTISSUE_NUMBER = 8 };
static const OmYamlSchema calibrated_tissue_schema = {
    "tissue", tissue_field + COUNT(tissue_field) - NTISSUE_NUMBER, NTISSUE_NUMBER, NULL};
static const OmYamlSchema calibrated_attach_schema = {
    "attachments", attach_field + COUNT(attach_field) - 1, 1, NULL};
static const OmYamlField calibrated_field[] = {
    {"tissue", OM_YAML_STRUCT, AT(OmScene, tissue), .sub = &calibrated_tissue_schema},
    {"attachments", OM_YAML_STRUCT, AT(OmScene, attach), .sub = &calibrated_attach_schema},
};
const OmYamlSchema om__scene_calibrated_schema = {"calibration", calibrated_field,
                                                  COUNT(calibrated_field), NULL};
