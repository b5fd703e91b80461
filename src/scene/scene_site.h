// scene_site.h: the pieces a site is built from; private to room scene.
#ifndef OM_SCENE_SITE_H
#define OM_SCENE_SITE_H

#include "omentum/scene.h"

// Mesh, task frame, named faces, gravity and material by role, from whatever the scene names as its
// tissue; a patient brings its own attachments and ROI too.
OmStatus om__site_build_body(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                             OmSite* site);
// The world's mesh where the scene leaves it open: cells of a sheet, edge of a model's mesh, m.
OmVec3 om__scene_world_cells(const OmSceneTissue* tissue);
double om__scene_world_edge(const OmSceneModel* model);
// OM_INVALID if the scene's own numbers cannot give the world twice the twin's vertices: known without meshing.
OmStatus om__scene_check_world(const OmScene* scene, const char* name);
// The ROI under the tissue, a dome on the board: drawn at random or where the scene says.
OmStatus om__site_place_roi(const OmScene* scene, OmSite* site);
// The ROI of a patient, to be drawn: the organ's triangles within `radius` of its centre, a little raised.
OmStatus om__site_draw_roi(double radius, OmSite* site);
OmStatus om__site_copy_roi(const OmSite* from, OmSite* to);

#endif
