/// omentum/scene_ct.h: a CT made here, for demonstrations and tests (room `scene`, floor 4).
///
/// Fat over a flat organ in gas, with a tumour on the organ under the fat: densities in Hounsfield units, blurred as by
/// a scanner, with noise. The labels are known. Everything is in RAS metres; the fat lies on the anterior side.
///
///     OmCtDef def = om_ct_default_def(1);
///     OmVolume ct, truth, labels;
///     om_ct_make(&def, &ct, &truth);
///     om_ct_label(&ct, &labels);                             // by thresholds
///     om_ct_get_dice(&labels, &truth, OM_CT_FAT);            // 1: the same voxels
#ifndef OMENTUM_SCENE_CT_H
#define OMENTUM_SCENE_CT_H

#include "omentum/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmCtLabel { OM_CT_GAS, OM_CT_FAT, OM_CT_ORGAN, OM_CT_TUMOUR, OM_CT_NLABEL } OmCtLabel;
/// "gas", "fat", "organ", "tumour".
OM_API const char* om_ct_label_text(OmCtLabel label);

typedef struct OmCtDef {
    OmCookie cookie;
    uint64_t seed;         // of noise and of the shape of the fat's surface
    double voxel;          // side of a voxel, m; default 1.5 mm
    double organ_half;     // half the organ's extent to the right and up the body, m; default 70 mm
    double organ_lobes;    // share of it by which lobes stand out; default 0, at most 0.2
    double fat_half;       // half the fat's, m; default 48 mm
    double fat_exponent;   // of its outline, a superellipse: 2 (a circle) to 10; default 6
    double fat_thickness;  // m, mean; default 7 mm
    double fat_ripple;     // m, amplitude of the thickness; default 0.7 mm
    // m, of the tumour's centre from the organ's middle: to the right, up the body; default 8 and -6 mm
    double tumour_shift[2];
    double tumour_radius;  // m; default 9 mm
    double tumour_height;  // m, by which it rises out of the organ; default 4 mm
    double blur;           // standard deviation of the scanner's blur, voxels; default 0.8
    double noise;          // standard deviation, HU; default 20
} OmCtDef;

OM_API OmCtDef om_ct_default_def(uint64_t seed);

/// Make a volume in Hounsfield units, and the labels (OmCtLabel) that it was made from; om_volume_done frees both.
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_ct_make(const OmCtDef* def, OmVolume* ct, OmVolume* truth);

/// Label a volume in Hounsfield units: smoothing, thresholds half-way between gas, fat, organ and tumour, removal of
/// fat thinner than three voxels (the blurred border of organ and gas has the density of fat) and of parts other than
/// the largest.
/// @return OM_OK; OM_INVALID (no voxel of fat, organ or tumour is found); OM_NO_MEMORY
OM_API OmStatus om_ct_label(const OmVolume* ct, OmVolume* labels);

/// Dice coefficient of a label in two volumes of the same size: 2 |A and B| / (|A| + |B|); 1 if neither has it.
OM_API double om_ct_get_dice(const OmVolume* a, const OmVolume* b, int label);

#ifdef __cplusplus
}
#endif
#endif
