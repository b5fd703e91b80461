// world_view.h: cameras, and the fixed anatomy in their views; private to room world.
#ifndef OM_WORLD_VIEW_H
#define OM_WORLD_VIEW_H

#include "omentum/world.h"

// A camera of the scene; `side` is the sign of its x in the task frame.
OmCamera om__world_camera(const OmSite* site, const OmSceneCamera* c, double side);
typedef struct OmAnatomyIds {  // objects of a scene of the cameras; -1: there is none
    int roi, organ;
} OmAnatomyIds;

// Add the ROI, board and organ that the site has.
OmStatus om__world_add_anatomy(const OmSite* site, OmSenseScene* sense, OmAnatomyIds* ids);
// Move ROI and organ to where they are.
void om__world_move_anatomy(const OmAnatomy* anatomy, OmAnatomyIds ids, OmSenseScene* sense);
// A view through any camera, as om_view_create. Render the window of its picture without tissue and tools.
OmStatus om__view_create(const OmCamera* camera, const OmSite* site, OmView** view);
OmStatus om__view_render_bare(OmView* view, OmWindow window, OmPicture* picture);
// Objects that do not hide the ROI: the drawn ROI itself.
static inline uint64_t om__world_roi_bit(int roi_id) {
    return roi_id >= 0 ? (uint64_t)1 << roi_id : 0;
}

#endif
