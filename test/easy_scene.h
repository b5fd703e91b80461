// easy_scene.h: a scene that small tests of the loop share.
#ifndef OMENTUM_TEST_EASY_SCENE_H
#define OMENTUM_TEST_EASY_SCENE_H

#include "linear_sheet.h"
#include "omentum/scene.h"

// A coarse sheet, held on the far half, its ROI near the free corner of PSM1.
static inline OmScene easy_scene(void) {
    OmScene s = linear_sheet();
    s.tissue.cells = om_vec3(8, 8, 1);
    s.tissue.world_cells = om_vec3(12, 12, 1);
    s.endoscope.width = 80, s.endoscope.height = 60;
    s.attach.kind = OM_ATTACH_BOX;
    s.attach.lo = om_vec3(0.01, -1, -1);
    s.attach.hi = om_vec3(1, 1, 1);
    s.roi.is_random = false;
    s.roi.center = om_vec3(-0.04, -0.03, 0);
    s.task.force_threshold = 3;
    s.task.grasp_radius = 0.011;
    s.task.speed = 0.05;
    return s;
}

#endif
