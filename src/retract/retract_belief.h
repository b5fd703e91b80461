// retract_belief.h: all that a robot knows of its patient, in two files: a scene without a truth, and the twin's site.
#ifndef OMENTUM_RETRACT_BELIEF_H
#define OMENTUM_RETRACT_BELIEF_H

#include "omentum/scene.h"

// Append the scene as a file, complete, with paths that do not depend on the current folder; data in the folder that
// holds `out_dir` (may be null) are "..". Without its truth:
// attachments, ROI, world, seed and errors of the belief are those of om_scene_default.
OmStatus om__scene_print_whole(const OmScene* scene, bool has_truth, const char* out_dir,
                               OmText* text);
// The site of the twin, from which its body is made.
OmStatus om__belief_save(const OmSite* site, const char* path);
// @return OM_OK; OM_INVALID (damaged, or an index out of range); OM_NO_MEMORY; OM_IO. `site` is empty after an error
OmStatus om__belief_load(const char* path, OmSite* site);

#endif
