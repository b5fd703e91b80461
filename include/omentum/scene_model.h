/// omentum/scene_model.h: patient models, from a medical volume to a mesh ready to simulate
/// (room `scene`, floor 4).
///
/// Volume -> label -> distance field -> mesh. The clinical case is a sheet of fat that covers one side of
/// an organ and hides a tumour on its surface: the sheet is the mesh, the organ a surface that it lies on.
/// Everything is in RAS metres: +x right, +y anterior, +z superior.
///
///     OmModelDef def = om_model_default_def("kidney_left.nii.gz", 0.004);
///     def.label[def.nlabel++] = 1;
///     def.sheet.thickness = 0.008;
///     om_model_build(&def, NULL, &patient, &report);
///     om_patient_save(&patient, &report, "kidney");
#ifndef OMENTUM_SCENE_MODEL_H
#define OMENTUM_SCENE_MODEL_H

#include "omentum/image.h"
#include "omentum/shape_file.h"
#include "omentum/shape_fit.h"
#include "omentum/shape_meshing.h"
#include "omentum/shape_repair.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_MAX_LABEL 64
#define OM_MAX_PART 16
#define OM_MAX_MATERIAL 16
#define OM_MAX_ATTACH 8
#define OM_NAME_LEN 64

// ---- the patient model ------------------------------------------------------------------------------

typedef struct OmPatientMaterial {
    char name[OM_NAME_LEN];
    int label;       // elements whose tet_label is this; -1: every element no other material names
    double young;    // Pa
    double poisson;  // 0 to 0.4999
    double density;  // kg/m^3
} OmPatientMaterial;

typedef struct OmPatient {  // om_patient_done frees
    char name[OM_NAME_LEN];
    // The deformable tissue, with the set "attachment"; a sheet also has "underside", "top",
    // "border".
    OmTetMesh mesh;
    OmPatientMaterial material[OM_MAX_MATERIAL];
    int nmaterial;
    OmSurface organ;       // the organ below the tissue, closed, rigid; nvert is 0 if there is none
    double organ_spacing;  // grid step for the organ's distance field, m
    double* roi_point;     // points of the region of interest, m            (nroi x 3)
    double* roi_normal;    // outward normals there                          (nroi x 3)
    int nroi;
    OmVec3 roi_center;  // centre of the region, m
    double roi_radius;  // m
    OmVec3 up;          // unit direction away from the covered side; an endoscope looks against it
    // Of a model that was built, not loaded; both may be empty. Distance of each vertex on the mesh's boundary from the
    // label's surface, m, 0 inside                                          (mesh.nvert), or null
    double* gap;
    OmSurface missed;    // the part of the label's surface that is far from the mesh
    OmSpace file_space;  // of tissue.vtu and organ.ply when saved; default OM_SPACE_NONE: RAS
} OmPatient;

// ---- building it --------------------------------------------------------------------------------------

/// Where the sheet is held: a part of its "border", "underside" or "top". The part is the farthest one in a
/// direction, or a random patch (thesis eq. 4.1).
typedef struct OmAttachDef {
    char face[16];       // "border", "underside", "top"
    char direction[64];  // om_model_direction's words, "random", or "" for the whole face
    double share;        // part of the face's vertices, 0-1
    uint64_t seed;       // of "random"
    double turn;  // rad, by which the direction is turned about the covered side's; default 0
} OmAttachDef;

typedef struct OmSheetDef {
    double thickness;  // m; default 0: no sheet, the organ itself is the tissue
    // Keep the edge of the mesh though the sheet is hardly thicker: its level is shifted until the mesh has the sheet's
    // volume (OmModelReport.level_shift), and the fit tells what is lost. Default false: finer edges where they are
    // needed, at thicknesses below 1.4 edges 3 times the elements.
    bool keep_edge;
    double bridge;  // hollows of the organ narrower than twice this are bridged, m; default 0.02
    double gap;     // between organ and sheet, m; default 0
    char side[64];  // the covered side, om_model_direction's words; default "anterior"
    // Half of the extent along the organ's longest axis, m; 0 (default): 0.8 of the organ's.
    double half_length;
    double half_width;  // half-extent across it, m; default 0: 0.8 of the organ's
    double corner;  // radius of the outline's corners, m; default 0: half the smaller half-extent
    double wrap;    // m, extent of the sheet below the organ's centre, around its sides; default 0
    OmAttachDef attach[OM_MAX_ATTACH];  // default (nattach 0): "border:medial 25 %"
    int nattach;
    double tumour_radius;    // of the ROI on the organ's surface, m; default 0.012
    double tumour_height;    // how far it bulges out of the organ, m; default 0.003
    double tumour_shift[2];  // of its centre from the middle of the sheet: along, across, m
    int nroi;                // points sampled on it; default 200
} OmSheetDef;

/// Tissue over an organ, both labelled: the label of OmModelDef is the tissue, these are below it. The tissue's mesh
/// gets the sets "underside" (where it meets the organ), "top" and "border".
typedef struct OmOverDef {
    int label
        [OM_MAX_LABEL];  // of the organ, the ROI's among them; default (nlabel 0): nothing is below
    int nlabel;
    int roi;        // label on the organ's surface that is to be exposed; default -1: no ROI
    char side[64];  // on which the tissue lies, om_model_direction's words; default "anterior"
    // m: vertices of the tissue this close to the organ meet it, and the organ's surface this close to the label of the
    // ROI belongs to the ROI; default 0: a voxel and a half
    double reach;
    OmAttachDef attach[OM_MAX_ATTACH];  // default (nattach 0): "underside:random 30 %", seed 1
    int nattach;
    int nroi;  // points sampled on the ROI; default 200
} OmOverDef;

typedef struct OmModelDef {
    OmCookie cookie;
    char input[1024];  // volume (NIfTI, NRRD), volume mesh (.msh .vtk .vtu), surface (STL OBJ PLY)
    char name[OM_NAME_LEN];  // of the model; default: the input's file name
    int volume;  // of a file of several volumes, from 0; default -1: such a file is refused
    // What is meshed is the union of labels by number and by name. Default: the one label above 0; a file
    // of several labels is refused.
    int label[OM_MAX_LABEL];
    int nlabel;
    char label_name[OM_MAX_LABEL][OM_SEGMENT_NAME];  // as the file names them; case does not count
    int nlabel_name;
    bool all_labels;  // every value above 0
    // of a label map that was interpolated: a voxel with a value between two labels, one of which is
    // chosen, belongs to it from this share on, 0-1; default 0: such voxels are left out, and noted
    double threshold;
    // bytes that the voxels of a volume may take; default OM_VOLUME_MAX_SIZE
    uint64_t max_volume_size;
    bool has_window;  // intensities in [window_lo, window_hi] instead of labels
    double window_lo, window_hi;
    int part[OM_MAX_PART];  // the connected parts kept, 1 being the largest; npart 0: see keep_all
    int npart;
    bool keep_all;        // all parts of at least min_share; default false: the largest
    double min_share;     // smallest part kept, share of the voxels; default 0.01
    int connectivity;     // of voxels, 6 or 26; default 6
    bool keep_holes;      // default false: holes are filled
    double close_radius;  // m; default 0: no closing
    double smooth;        // voxels; default 1.2
    double edge;          // mean edge of the mesh, m
    double unit;          // m per unit of the file; default 0: as the file says, else a millimetre
    OmSpace space;        // of a mesh or surface file; default OM_SPACE_NONE: as it says, else RAS
    OmRepairMode repair;  // of a mesh or surface file; default OM_REPAIR_MEND
    // Leave vertices that coincide along faces of a volume mesh apart; default false: they are welded.
    bool keep_cracks;
    bool remesh;  // remesh a volume mesh from its distance field; default false: use its elements
    // measure the error in bending (OmModelReport.bending_error), 0.5 to 1 s; default true
    bool has_bending_test;
    bool refine;      // finer edges where parts are thinner than an edge; default true
    bool allow_loss;  // a mesh that does not hold all of the label is no error; default false
    OmPatientMaterial material[OM_MAX_MATERIAL];  // default: fat for a sheet, else soft tissue
    int nmaterial;
    OmSheetDef sheet;
    OmOverDef over;  // not together with a sheet
    int nworker;     // default 0: one a processor
} OmModelDef;

#define OM_BENDING_LIMIT 0.1  // a mesh with a larger bending error is warned of

typedef struct OmModelReport {
    OmMeshQuality quality;
    double bending_error;  // of om_patient_find_bending_error; NaN: not measured
    char selected[256];    // the labels that were meshed, in words; "" if the input is no volume
    int64_t nvoxel;        // with these labels
    OmVec3 voxel;          // sides of a voxel, m
    double label_volume;   // of the voxels with these labels, m^3; 0 if the input is no volume
    double label_error;    // volume of the organ's mesh (under a sheet: surface) / label_volume - 1
    double part_volume[OM_MAX_PART];  // of the largest parts found, m^3
    bool part_is_kept[OM_MAX_PART];   //
    double left_out;                  // m^3, of all parts that were not kept
    double filled;                    // m^3, of holes that were filled
    double mask_volume;               // of the cleaned mask, m^3; 0 if the input is no volume
    double mesh_volume;               // of the organ's tetrahedral mesh, m^3
    // How the mesh represents the cleaned label, the surface of the file, or the sheet. has_loss: a place deeper than a
    // third of an edge is missing or added, or parts, handles or cavities differ. Not of a mesh whose elements are
    // used.
    OmShapeFit fit;
    bool has_fit, has_loss, fit_is_of_sheet;
    double surface_volume;  // of the organ's marching-cubes surface, m^3
    double volume_error;    // |mesh - mask| / mask
    // distance of the mesh's boundary to the level set, m; with a fit, those of fit.to_solid
    double surface_error_mean, surface_error_max;
    // Mean distance of the level set to the faces of the voxels, in voxels.
    double surface_error_voxel;
    // of the level set towards the right volume, m; at most a tenth of a voxel, but with OmSheetDef.keep_edge. Of a
    // sheet it moves top and rims.
    double level_shift;
    double edge;  // mean edge asked of the mesher in the end, m
    int npart_mask, npart_kept;
    int ncapped;        // inside voxels on the border of the volume: the organ was cut there
    double seconds;     // wall clock of the whole build
    char note[2048];    // assumptions, omissions, conversions: empty, or one sentence a line
    char warning[512];  // empty, or sentences
} OmModelReport;

OM_API OmModelDef om_model_default_def(const char* input, double edge);
/// Build a patient model. `report` may be null. On failure `patient` is empty.
/// @return OM_OK; OM_INVALID (the message names field or file, or the places that the mesh loses: see allow_loss);
///         OM_NO_MEMORY; OM_IO; OM_CANCELLED
OM_API OmStatus om_model_build(const OmModelDef* def, const OmProgress* progress,
                               OmPatient* patient, OmModelReport* report);
/// The same from a volume in memory (borrowed during the call; null: read def->input).
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_CANCELLED
OM_API OmStatus om_model_build_volume(const OmModelDef* def, const OmVolume* volume,
                                      const OmProgress* progress, OmPatient* patient,
                                      OmModelReport* report);
/// What the mesh of a report loses, in words: places with volume and position, parts, handles and cavities, and the
/// edge to try; "" if it loses nothing.
OM_API void om_model_describe_loss(const OmModelReport* report, char* text, size_t size);

/// Read the volume mesh of def->input, and mend it as om_model_build does before it is used.
/// @param report  its notes have what was mended
/// @return OM_OK; OM_INVALID (the message names file, line or field, or a defect that is not mended); OM_NO_MEMORY;
///         OM_IO
OM_API OmStatus om_model_load_mesh(const OmModelDef* def, OmTetMesh* mesh, OmMeshFrame* stated,
                                   OmModelReport* report);

/// What a file of labels holds, to choose from.
typedef struct OmLabelRow {
    char name[OM_SEGMENT_NAME];  // "" if the file gives none
    int label;         // what OmModelDef.label takes; -1: only its volume and value choose it
    int value, layer;  // of its voxels (-1 above 2^31), and the volume of the file they are in
    double stored;     // value of its voxels
    int64_t nvoxel;    //
    double volume;     // m^3
    int npart;         // connected over faces
    double largest;    // volume of the largest part, m^3
    bool is_cut;       // a voxel lies on the border of the volume
    OmVec3 lo, hi;     // box around its voxels, RAS m
    OmVec3 centroid;   // RAS m
} OmLabelRow;

typedef struct OmLabelList {  // om_label_list_done frees
    int dim[3];
    OmVec3 voxel;       // sides of a voxel, m
    int nentry;         // volumes of the file
    bool has_layers;    // they are layers of segments, and all were read
    bool is_intensity;  // the values are no labels: they have fractions, are negative or too many
    // share of the voxels above 0 that have values between labels: the map was interpolated
    double between;
    double min, max;            // of the values
    char note[OM_VOLUME_NOTE];  // contradictions of the header, as OmVolumeInfo.note
    int nempty;                 // segments of a table of names that have no voxel; no row
    int nrow;
    OmLabelRow* row;  // in the order of layer and value                 (nrow)
} OmLabelList;

/// List the labels of a volume.
/// @param volume  as OmModelDef.volume
/// @return OM_OK, OM_IO, OM_NO_MEMORY, OM_CANCELLED, OM_INVALID: no volume that is read, or of several and none chosen
OM_API OmStatus om_label_list_load(const char* path, int volume, const OmProgress* progress,
                                   OmLabelList* list);
OM_API void om_label_list_done(OmLabelList* list);

/// A unit vector from "left", "right", "anterior", "posterior", "superior", "inferior", or "x,y,z".
/// "lateral" and "medial" need the side of the body: `is_left` says which.
/// @return OM_OK; OM_INVALID (words that name no direction)
OM_API OmStatus om_model_direction(const char* words, bool is_left, OmVec3* direction);

/// An attachment in words: "FACE" or "FACE:WHERE [SHARE%] [seed N]", as in "border:medial 25 %" or
/// "underside:random 10% seed 3"; vectors are written x/y/z. OM_INVALID says which word is wrong.
/// @return OM_OK; OM_INVALID (the message shows the grammar)
OM_API OmStatus om_model_parse_attach(const char* text, OmAttachDef* attach);

/// How much of a bending deflection the mesh lacks with quadratic elements. One half of a strip of the mesh is held,
/// the other half bends by its weight: the error is the share of the energy that is missing, against the same strip
/// refined once. A strip is three edges wide and as long and as thick as the tissue; of a larger one the 800 elements
/// nearest to its middle are taken, which mostly gives more than the error of the whole (doc/notes/scene.md compares
/// them). It takes up to about a second.
/// @param error  0 to 1; 1 where the mesh is too small to bend
/// @return OM_OK; OM_INVALID (a label without a material, a mesh that om_tet_mesh_validate refuses); OM_NO_MEMORY
OM_API OmStatus om_patient_find_bending_error(const OmPatient* patient, double* error);

OM_API void om_patient_done(OmPatient* patient);
/// Index of the material of elements with this label: the first one with this label, else the first one for all other
/// labels; -1: none.
OM_API int om_patient_find_material(const OmPatient* patient, int label);
#define OM_PATIENT_KIND "patient model"  // what its folder holds
/// Write `dir` whole or not at all: patient.yaml, tissue.vtu, organ.ply (if there is an organ), and with a
/// report report.json and report.html. The folder must not exist, be empty, or hold an older model and nothing else;
/// that is replaced (om_folder_begin; om_folder_check with OM_PATIENT_KIND says so beforehand).
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO, nothing is written
OM_API OmStatus om_patient_save(const OmPatient* patient, const OmModelReport* report,
                                const char* dir);
struct OmReport;
/// Add pictures of a model to a page: the organ with the region of interest, the tissue with its attachments, a cut.
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_patient_add_pictures(const OmPatient* patient, struct OmReport* page);
/// Read a patient.yaml and the files it names, relative to its folder. OM_INVALID also for an element
/// without material and for a region of interest off the organ.
/// @return OM_OK; OM_INVALID (the message names file and field); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_patient_load(const char* path, OmPatient* patient);

#ifdef __cplusplus
}
#endif
#endif
