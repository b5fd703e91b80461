// sense_look.c: the looks of the parts of a picture, in linear light, and the ranges of their colours.
//
// Hues: fat 40 degrees, organ 5, ROI 305 (magenta), attachments 230, board 165 (the green of drapes); tools are grey.
// Lights are white, shadows and tone keep hue and saturation, so only highlights leave the ranges. The region of
// interest and attachments differ from all other parts for colour-blind eyes, too (test_sense_look).
#include "omentum/sense.h"

OmSenseLook om_sense_look(OmSensePart part) {
    switch (part) {
    case OM_PART_ORGAN:
        return (OmSenseLook){.red = 0.46,
                             .green = 0.085,
                             .blue = 0.055,
                             .gloss = 0.45,
                             .is_smooth = true,
                             .texture = OM_TEXTURE_ORGAN};
    case OM_PART_ROI:
        return (OmSenseLook){
            .red = 0.95, .green = 0, .blue = 0.75, .gloss = 0.4, .is_smooth = true};
    case OM_PART_HELD: return (OmSenseLook){.red = 0, .green = 0.02, .blue = 0.2, .gloss = 0.2};
    case OM_PART_BOARD:
        return (OmSenseLook){.red = 0.07, .green = 0.24, .blue = 0.17, .is_checker = true};
    case OM_PART_TOOL:
        return (OmSenseLook){.red = 0.56,
                             .green = 0.57,
                             .blue = 0.58,
                             .gloss = 0.8,
                             .metal = 0.85,
                             .crease = 0.8,
                             .is_smooth = true,
                             .texture = OM_TEXTURE_STEEL};
    case OM_PART_SHAFT:
        return (OmSenseLook){.red = 0.060,
                             .green = 0.060,
                             .blue = 0.062,
                             .gloss = 0.3,
                             .crease = 0.8,
                             .is_smooth = true};
    default:
        return (OmSenseLook){.red = 0.92,
                             .green = 0.58,
                             .blue = 0.14,
                             .gloss = 0.6,
                             .is_smooth = true,
                             .texture = OM_TEXTURE_FAT};
    }
}

OmSenseRange om_sense_range(OmSensePart part) {
    static const OmSenseRange range[OM_NPART] = {[OM_PART_TISSUE] = {20, 62, 0.22, 1, 0.10, 1},
                                                 [OM_PART_ORGAN] = {340, 20, 0.22, 1, 0.10, 1},
                                                 [OM_PART_ROI] = {280, 340, 0.22, 1, 0.10, 1},
                                                 [OM_PART_HELD] = {210, 280, 0.22, 1, 0.02, 1},
                                                 [OM_PART_BOARD] = {120, 210, 0.22, 1, 0.10, 1},
                                                 [OM_PART_TOOL] = {0, 360, 0, 0.22, 0.02, 1},
                                                 [OM_PART_SHAFT] = {0, 360, 0, 0.22, 0.02, 1}};
    return range[part];
}

void om_sense_hsv(const unsigned char rgb[3], double hsv[3]) {
    int r = rgb[0], g = rgb[1], b = rgb[2], max = r > g ? r : g, min = r < g ? r : g;
    max = max > b ? max : b;
    min = min < b ? min : b;
    double spread = max - min, hue = 0;
    if (max > min) {
        if (max == r)
            hue = (g - b) / spread;
        else if (max == g)
            hue = 2 + (b - r) / spread;
        else
            hue = 4 + (r - g) / spread;
    }
    hsv[0] = 60 * (hue < 0 ? hue + 6 : hue);
    hsv[1] = max > 0 ? spread / max : 0;
    hsv[2] = max / 255.0;
}

static bool is_between(double x, double min, double max, double end) {
    return x >= min && (x < max || (max == end && x == end));
}

bool om_sense_range_has(const OmSenseRange* r, const double hsv[3]) {
    bool is_hue = r->hue_min < r->hue_max ? hsv[0] >= r->hue_min && hsv[0] < r->hue_max
                                          : hsv[0] >= r->hue_min || hsv[0] < r->hue_max;
    return is_hue && is_between(hsv[1], r->saturation_min, r->saturation_max, 1) &&
           is_between(hsv[2], r->value_min, r->value_max, 1);
}

OmSensePart om_sense_part_of(const unsigned char rgb[3]) {
    double hsv[3];
    om_sense_hsv(rgb, hsv);
    for (int part = 0; part < OM_PART_SHAFT; ++part) {
        OmSenseRange range = om_sense_range(part);
        if (om_sense_range_has(&range, hsv)) return part;
    }
    return OM_NPART;
}
