// study_kidney_case.c: the fat over the kidney: scene, attachments before and after dissection, grasping points.
//
// The fat is 10 mm thick and 80 x 100 mm along the surface, so that it wraps the lateral half of the organ: in the
// task frame it is a cap of 62 x 86 mm, 47 mm high, with steep sides, the sharp edges that the network of the thesis
// finds hard (4.5).
//
// Attachments of state 1 are the part of the underside inside an ellipse that lies off the middle. The first stage of
// dissection frees the part beyond y = 6 mm (below grasp A), the second one the part beyond x = 2 mm (below grasps C
// and D).
#include <string.h>

#include "omentum/tissue.h"

#include "studies/study_kidney_case.h"

#define MM 0.001

#define CENTER_X (-2 * MM)
#define CENTER_Y 0.0
#define HALF_X (17 * MM)
#define HALF_Y (23 * MM)
#define FIRST_CUT (6 * MM)
#define SECOND_CUT (2 * MM)

const double om__kidney_grasp[KIDNEY_NGRASP][2] = {
    {-4 * MM, 34 * MM}, {-21 * MM, -20 * MM}, {20 * MM, 20 * MM}, {18 * MM, -24 * MM}};

bool om__kidney_is_attached(int state, OmVec3 p) {
    double u = (p.x - CENTER_X) / HALF_X, v = (p.y - CENTER_Y) / HALF_Y;
    if (u * u + v * v > 1) return false;
    if (state >= 1 && p.y > FIRST_CUT) return false;
    return state < 2 || p.x <= SECOND_CUT;
}

OmStatus om__kidney_make_scene(const char* volume, bool is_quick, OmScene* scene) {
    OmScene s = om_scene_default();
    OM_CHECK(om_path_exists(volume), OM_UNAVAILABLE, "%s: no such file", volume);
    OM_CHECK(strlen(volume) < sizeof s.tissue.file, OM_INVALID, "%s: the path is too long", volume);
    s.tissue.law = OM_STABLE_NEO_HOOKEAN;
    snprintf(s.name, sizeof s.name, "kidney");
    s.seed = 0;
    s.tissue.source = OM_SOURCE_VOLUME;
    snprintf(s.data_root, sizeof s.data_root, ".");
    snprintf(s.tissue.file, sizeof s.tissue.file, "%s", volume);
    s.tissue.view = om_vec3(0, 0, -1);
    s.tissue.young = 8000;
    s.tissue.density = 950;
    s.model.label = 3;  // left kidney
    s.model.edge = (is_quick ? 8 : 6) * MM;
    s.model.world_edge = (is_quick ? 6 : 4.2) * MM;
    s.model.thickness = 10 * MM;
    s.model.half_length = 50 * MM;
    s.model.half_width = 40 * MM;
    s.model.tumour_radius = 8 * MM;
    snprintf(s.model.side, sizeof s.model.side, "lateral");
    snprintf(s.model.attach, sizeof s.model.attach, "border:posterior 30 %%");
    s.attach.kind = OM_ATTACH_SET;
    s.rgbd.distance = 0.25;
    s.rgbd.elevation = 60 * OM_PI / 180;
    s.rgbd.fov = 36 * OM_PI / 180;
    s.world.narm = 1;
    *scene = s;
    return OM_OK;
}

void om__kidney_set_truth(OmScene* scene) {
    scene->tissue.law = OM_NEO_HOOKEAN;
    scene->tissue.poisson = 0.42;
    scene->world.young_factor = 0.8;
}

OmStatus om__kidney_build_site(const OmScene* scene, OmSiteRole role, int state, OmSite* site) {
    OM_TRY(om_site_build(scene, role, NULL, site));
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    OmPose task = om_pose_inverse(site->pose_world_task);
    int *list = NULL, n = 0;
    OmStatus status = OM_OK;
    OM_CHECK_DONE(under, OM_INVALID, "%s: no underside", scene->name);
    OM_ALLOC_DONE(list, (size_t)under->nvert);
    for (int k = 0; k < under->nvert && state >= 0; ++k) {
        OmVec3 p = om_pose_apply(task, om_load3(site->mesh.x, under->vert[k]));
        if (om__kidney_is_attached(state, p)) list[n++] = under->vert[k];
    }
    status = om_tet_mesh_add_set(&site->mesh, "attachment", list, n);
    // Areas and springs are those of an elastic foundation, which this scene has not.
    om_free(site->attach_area);
    om_free(site->attach_spring);
    site->attach_area = site->attach_spring = NULL;
done:
    om_free(list);
    if (status < 0) om_site_done(site);
    return status;
}
