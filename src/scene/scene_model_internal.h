// scene_model_internal.h: shared by the files of the model pipeline.
#ifndef OM_SCENE_MODEL_INTERNAL_H
#define OM_SCENE_MODEL_INTERNAL_H

#include "omentum/image.h"
#include "omentum/report.h"
#include "omentum/scene_model.h"
#include "omentum/shape_file.h"

enum { OM__MODEL_COOKIE = 0x30de1 };

typedef struct OmBody {  // the organ after reading and cleaning; om__body_done frees
    bool has_volume;     // from a label map or intensities
    bool is_volume_borrowed;
    // as read, or labels joined from several layers; kept for the labels of elements
    OmVolume volume;
    double unit_stated;  // unit in the header of the volume, m; 0: none
    bool has_window;
    int label[OM_MAX_LABEL];  // values of `volume` to mesh; nlabel 0: all values above 0
    int nlabel;
    char label_name[OM_MAX_LABEL][OM_SEGMENT_NAME];  // "" if the file has no name
    int shift[3];   // of voxel (0, 0, 0) of the mask in the volume, until the mask is cropped
    OmMask mask;    // cleaned
    bool has_mesh;  // from a volume mesh
    OmTetMesh mesh;
    OmSurface surface;  // of a surface file, mended
    bool is_folded;     // a part of it bounds nothing: it is open or folded inside out there
    OmSdf sdf;
    double volume_ref;  // volume that the distance field should enclose, m^3
    double voxel;       // mean voxel side, m; 0 without voxels
    OmVec3 centroid;    // of the body, m
    // of the whole image, m: determines the side of the patient on which the body lies
    OmVec3 center_image;
} OmBody;

void om__body_done(OmBody* body);
// Read the input of a definition (or use the given volume), clean it and build its distance field,
// with `margin` around it.
OmStatus om__body_load(const OmModelDef* def, double margin, const OmProgress* progress,
                       const OmVolume* given, OmBody* body, OmModelReport* report);
// Label each element by the selected voxel nearest to its centroid.
void om__body_label_elements(const OmModelDef* def, const OmBody* body, OmTetMesh* mesh);

// A sheet to mesh: where fn is negative, about the distance from its surface.
typedef struct OmMeshTask {
    OmShapeFn fn;  // called from several threads
    void* ctx;
    OmVec3 lo, hi;
    // fn on the nodes of a grid finer than the edge; nodes on its surface become outside
    OmSdf* field;
    double voxel;   // of the image that fn comes from, m
    double* level;  // the level that is meshed, which fn may read; set between calls of fn
    double edge;    // m
    bool refine;    // edges may become shorter
    int nworker;
} OmMeshTask;
// Mesh it with the level shifted until the mesh has a volume, m^3.
OmStatus om__mesh_with_volume(const OmMeshTask* task, double volume, const OmProgress* progress,
                              OmTetMesh* mesh, OmModelReport* report);
// Mesh it as the solid of a body, or with its edge kept, and judge it by its field. Sets what om__mesh_solid sets.
OmStatus om__mesh_sheet(const OmModelDef* def, const OmMeshTask* task, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report);
// "label", "surface" or "sheet": what the fit of a report compares the mesh with.
const char* om__model_fit_name(const OmModelReport* report);
// Mesh the solid of a body, finer where its parts are thinner than an edge, into patient->mesh, gap and missed; sets
// fit, has_loss, edge, level_shift and volumes of the report.
OmStatus om__mesh_solid(const OmModelDef* def, OmBody* body, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report);
// Refuse, or log, how many tetrahedra a volume of m^3 would have.
OmStatus om__model_check_size(double volume, double edge);
OmStatus om__boundary_area(const OmTetMesh* mesh, double* area);  // m^2
#define OM__TET_DENSITY 10.5  // elements in a cube of one edge, measured on organs
#define OM__FIELD_ROUNDS 8    // of volume correction, as of a distance field

// Refuse lengths of the sheet that cannot be, before the organ is meshed with a margin for it.
OmStatus om__sheet_check(const OmModelDef* def, OmModelReport* report);

// Build the sheet over the organ, its sets, and the region of interest, into `patient`.
OmStatus om__sheet_build(const OmModelDef* def, const OmBody* body, const OmProgress* progress,
                         OmPatient* patient, OmModelReport* report);

// Add the set "attachment" to a tissue with its faces as sets: those of `attach`, or `usual` if there are none.
// `n` is the unit direction of the covered side, about which attachments turn.
typedef struct OmAttachTask {
    const OmAttachDef* attach;
    int nattach;
    const OmAttachDef* usual;
    OmVec3 n;
    bool is_left;
} OmAttachTask;
OmStatus om__model_attach(const OmAttachTask* task, OmTetMesh* mesh, const OmSurface* surface,
                          const int* surface_vert);

// Below the tissue in `patient->mesh`: the organ's surface, sets, attachments and the region of interest.
OmStatus om__over_build(const OmModelDef* def, const OmVolume* given, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report);

// Check that every element has a material; the message names a label without one.
OmStatus om__patient_check_materials(const OmPatient* patient);

// Write report.html: verdict, pictures, tables, dihedral angles.
OmStatus om__model_save_page(const OmPatient* patient, const OmModelReport* report,
                             const char* path);

// Append a sentence to the report's warnings or notes.
// Append to a text of `size` bytes.
void om__model_append(char* text, size_t size, const char* format, ...) OM_PRINTF(3, 4);
void om__model_warn(OmModelReport* report, const char* format, ...) OM_PRINTF(2, 3);
void om__model_note(OmModelReport* report, const char* format, ...) OM_PRINTF(2, 3);

// ---- labels of a file (scene_model_labels.c) --------------------------------------------------------------

typedef struct OmLabelScan {  // the values of one volume
    // negative values, numbers that a double does not hold, too many, or more fractions than labels have
    bool is_intensity;
    int64_t nabove, nfraction;  // voxels above 0; voxels whose value is not whole
    double min, max;
    int nrow;
    OmLabelRow* row;  // values above 0, ascending; npart and largest are not set          (nrow)
    int (*box)[6];    // first and last voxel of each along i, j, k                        (nrow)
} OmLabelScan;
OmStatus om__label_scan(const OmVolume* volume, OmLabelScan* scan);
void om__label_scan_done(OmLabelScan* scan);
// The whole number within 1e-3 of a value, else the value: labels that were stored as 7014.9996.
static inline double om__label_value(double v) {
    const double whole = floor(v + 0.5);
    return fabs(v - whole) <= 1e-3 ? whole : v;
}
// Note voxels with values between labels, or give them to labels by def->threshold (scene_model_between.c).
OmStatus om__body_resolve_between(const OmModelDef* def, OmBody* body, OmModelReport* report);
// Read the volume or the layers with the labels of the definition into `body` (volume, label), and
// describe them in words.
OmStatus om__body_load_labels(const OmModelDef* def, const OmVolume* given, OmBody* body,
                              OmModelReport* report);

#endif
