// scene_site.h: parts of building a site; private to room scene.
#ifndef OM_SCENE_SITE_H
#define OM_SCENE_SITE_H

#include "omentum/scene.h"

// Load or make the mesh of the scene's tissue source, with task frame, named faces, gravity and the
// material of the role. A patient model brings its own attachments and ROI too.
OmStatus om__site_build_body(const OmScene* scene, OmSiteRole role, const OmProgress* progress,
                             OmSite* site);
// The truth's attachments on the twin's mesh, as its set "attachment"; of a patient they are there already.
OmStatus om__site_attach(const OmScene* scene, OmSite* site);
// The world's attachments: vertices of its underside whose nearest vertex of the twin's is attached.
OmStatus om__site_copy_attachments(const OmSite* twin, OmSite* world);
// Replace the truth's attachments on the twin's mesh by the attachments that the twin believes in by the scene.
OmStatus om__site_believe(const OmScene* scene, OmSite* site);
// Move the ROI along its ground to where the twin believes it.
OmStatus om__site_shift_roi(const OmScene* scene, OmSite* site);
// Move the whole site by the error of the registration, but not the frame of cameras and arms.
OmStatus om__site_register(const OmScene* scene, OmSite* site);
// Area of each attached vertex, m^2, which must not exist yet; total above 0: scaled to this sum.
OmStatus om__site_measure_attachments(double total, OmSite* site);
// The same after the attachments have changed, with their own area.
OmStatus om__site_measure_again(OmSite* site);
// Stiffness of the attachments by the scene's numbers and the site's role.
void om__site_set_stiffness(const OmScene* scene, OmSite* site);
// Material and springs of an organ that deforms by the scene's numbers.
void om__site_set_organ(const OmScene* scene, OmSite* site);
// Size of the world's mesh if the scene does not give it: cells of a sheet, edge of a model's mesh, m.
OmVec3 om__scene_world_cells(const OmScene* scene);
double om__scene_world_edge(const OmSceneModel* model);
// OM_INVALID if the scene's numbers cannot give the world twice the twin's vertices, of a sheet nodes; before meshing.
OmStatus om__scene_check_world(const OmScene* scene, const char* name);
// The ROI under the tissue, a dome on the board: at a random place, or at the place that the scene gives.
OmStatus om__site_place_roi(const OmScene* scene, OmSite* site);
// The ROI of a patient for drawing: the organ's triangles within `radius` of its centre, slightly raised.
OmStatus om__site_draw_roi(double radius, OmSite* site);
OmStatus om__site_copy_roi(const OmSite* from, OmSite* to);

#endif
