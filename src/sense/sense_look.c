// sense_look.c: the colours of pictures, in linear light. The region of interest is magenta and what is held dark blue,
// chosen so that they differ from all others for colour-blind eyes, too (test_sense_look).
#include "omentum/sense.h"

OmSenseLook om_sense_look(OmSensePart part) {
    switch (part) {
    case OM_PART_ORGAN:
        return (OmSenseLook){
            .red = 0.62, .green = 0.20, .blue = 0.16, .gloss = 0.5, .is_smooth = true};
    case OM_PART_ROI:
        return (OmSenseLook){
            .red = 0.95, .green = 0, .blue = 0.75, .gloss = 0.4, .is_smooth = true};
    case OM_PART_HELD: return (OmSenseLook){.red = 0, .green = 0.02, .blue = 0.2, .gloss = 0.2};
    case OM_PART_BOARD:
        return (OmSenseLook){.red = 0.42, .green = 0.43, .blue = 0.44, .is_checker = true};
    case OM_PART_TOOL: return (OmSenseLook){.red = 0.55, .green = 0.57, .blue = 0.60, .gloss = 0.9};
    default:
        return (OmSenseLook){.red = 0.93,
                             .green = 0.66,
                             .blue = 0.36,
                             .gloss = 0.5,
                             .is_smooth = true,
                             .grain = 0.08};
    }
}
