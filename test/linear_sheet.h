// linear_sheet.h: the scene of tests of logic.
#ifndef OM_TEST_LINEAR_SHEET_H
#define OM_TEST_LINEAR_SHEET_H

#include "omentum/scene.h"
#include "omentum/tissue.h"

/// The default scene on 20 x 20 x 1 cells of linear elements: a step costs a third of that of quadratic ones on 10 x 10
/// x 1. Only for tests that do not ask how tissue bends.
static inline OmScene linear_sheet(void) {
    OmScene s = om_scene_default();
    s.tissue.element = OM_ELEMENT_LINEAR;
    s.tissue.law = OM_STABLE_NEO_HOOKEAN;
    s.tissue.cells = om_vec3(20, 20, 1);
    s.task.force_threshold = 2.55;
    return s;
}

#endif
