// scene_site.h: the pieces a site is built from; private to room scene.
#ifndef OM_SCENE_SITE_H
#define OM_SCENE_SITE_H

#include "omentum/scene.h"

// Mesh, task frame, named faces, gravity and material by role, from whatever the scene names as its
// tissue; a patient brings its own attachments and ROI too.
OmStatus om__site_build_body(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                             OmSite* site);
// The ROI under the tissue, a dome on the board: drawn at random or where the scene says.
OmStatus om__site_place_roi(const OmScene* scene, OmSite* site);
// The ROI of a patient, to be drawn: the organ's triangles within `radius` of its centre, a little raised.
OmStatus om__site_draw_roi(double radius, OmSite* site);
OmStatus om__site_copy_roi(const OmSite* from, OmSite* to);

#endif
