// world_view.c: the endoscope's pose, the fixed anatomy in its view, and the largest possible visibility of the ROI.
#include <string.h>

#include "world/world_view.h"

#include "omentum/world.h"

OmCamera om__world_camera(const OmSite* site, const OmSceneCamera* c, double side) {
    OmVec3 eye =
        om_vec3(side * c->distance * cos(c->elevation), 0, c->distance * sin(c->elevation));
    OmVec3 eye_w = om_pose_apply(site->pose_world_field, eye);
    OmVec3 target = om_pose_apply(site->pose_world_field, om_vec3(0, 0, site->half_size.z));
    OmVec3 up = om_quat_rotate(site->pose_world_field.q, om_vec3(0, 0, 1));
    return om_scene_camera_place(c, om_pose_look_at(eye_w, target, up));
}

OmCamera om_world_endoscope(const OmScene* scene, const OmSite* site) {
    return om__world_camera(site, &scene->endoscope, -1);
}

// The board under the tissue, slightly below the ROI that is drawn on it.
static OmStatus add_board(const OmSite* site, OmSenseScene* sense) {
    OmSurface board = {0};
    OM_TRY(om_surface_init(&board, 4, 2));
    double r = 2.2 * fmax(site->half_size.x, site->half_size.y);
    const double corner[4][2] = {{-r, -r}, {r, -r}, {r, r}, {-r, r}};
    for (int i = 0; i < 4; ++i) {
        OmVec3 p = om_vec3(corner[i][0], corner[i][1], -1e-4);
        om_store3(board.x, i, om_pose_apply(site->pose_world_task, p));
    }
    memcpy(board.tri_vert, (int[6]){0, 1, 2, 0, 2, 3}, 6 * sizeof(int));
    OmSenseLook look = om_sense_look(OM_PART_BOARD);
    int id;
    OmStatus status = om_sense_scene_add(sense, &board, &look, &id);
    om_surface_done(&board);
    return status;
}

OmStatus om__world_add_anatomy(const OmSite* site, OmSenseScene* sense, OmAnatomyIds* ids) {
    *ids = (OmAnatomyIds){-1, -1};
    if (site->roi.ntri > 0) {
        OmSenseLook look = om_sense_look(OM_PART_ROI);
        OM_TRY(om_sense_scene_add(sense, &site->roi, &look, &ids->roi));
    }
    if (site->has_ground) OM_TRY(add_board(site, sense));
    if (!site->has_organ) return OM_OK;
    OmSenseLook look = om_sense_look(OM_PART_ORGAN);
    return om_sense_scene_add(sense, &site->organ, &look, &ids->organ);
}

void om__world_move_anatomy(const OmAnatomy* anatomy, OmAnatomyIds ids, OmSenseScene* sense) {
    if (!anatomy->moves) return;
    if (ids.roi >= 0) om_sense_scene_update(sense, ids.roi, anatomy->roi->x, NULL);
    if (ids.organ >= 0) om_sense_scene_update(sense, ids.organ, anatomy->organ->x, NULL);
}

// ---- a view without tools -----------------------------------------------------------------------------------

struct OmView {
    const OmSite* site;
    OmSenseScene* sense;
    OmSurface tissue;  // boundary of the mesh
    int* tissue_vert;  // its vertices in the mesh
    int tissue_id;
    OmAnatomyIds ids;
    OmAnatomy* anatomy;  // of a body; null: as the site has it
    OmCamera camera;
};

OmStatus om_view_create(const OmScene* scene, const OmSite* site, OmView** view) {
    OmCamera camera = om_world_endoscope(scene, site);
    return om__view_create(&camera, site, view);
}

static OmStatus create_view(const OmCamera* camera, const OmSite* site, const OmTetMesh* mesh,
                            OmView** view);

OmStatus om_view_create_of_body(const OmScene* scene, const OmBody* body, OmView** view) {
    const OmSite* site = om_body_site(body);
    OmCamera camera = om_world_endoscope(scene, site);
    OM_TRY(create_view(&camera, site, om_body_mesh(body), view));
    OmStatus status = om_anatomy_create(body, &(*view)->anatomy);
    if (status < 0) {
        om_view_destroy(*view);
        *view = NULL;
    }
    return status;
}

OmStatus om__view_create(const OmCamera* camera, const OmSite* site, OmView** view) {
    return create_view(camera, site, &site->mesh, view);
}

static OmStatus create_view(const OmCamera* camera, const OmSite* site, const OmTetMesh* mesh,
                            OmView** view) {
    *view = NULL;
    OmView* v = om_calloc(1, sizeof *v);
    if (!v) return OM_NO_MEMORY;
    v->site = site;
    v->camera = *camera;
    OmSenseLook look = {.red = 1};
    OmStatus status = om_sense_scene_create(&v->sense);
    if (status == OM_OK) status = om_tet_mesh_boundary(mesh, &v->tissue, &v->tissue_vert);
    if (status == OM_OK) status = om_sense_scene_add(v->sense, &v->tissue, &look, &v->tissue_id);
    if (status == OM_OK) status = om__world_add_anatomy(site, v->sense, &v->ids);
    if (status < 0)
        om_view_destroy(v);
    else
        *view = v;
    return status;
}

void om_view_destroy(OmView* v) {
    if (!v) return;
    om_anatomy_destroy(v->anatomy);
    om_sense_scene_destroy(v->sense);
    om_surface_done(&v->tissue);
    om_free(v->tissue_vert);
    om_free(v);
}

OmStatus om_view_look(OmView* v, const double* x, OmVisibility* visibility) {
    const double* roi_x = v->anatomy ? v->anatomy->roi_x : v->site->roi_x;
    const double* roi_n = v->anatomy ? v->anatomy->roi_n : v->site->roi_n;
    if (x) om_sense_scene_update(v->sense, v->tissue_id, x, v->tissue_vert);
    if (x && v->anatomy) {
        om_anatomy_move(v->anatomy, x);
        om__world_move_anatomy(v->anatomy, v->ids, v->sense);
    }
    om_sense_scene_show(v->sense, v->tissue_id, x != NULL);
    OM_TRY(om_sense_scene_commit(v->sense));
    return om_sense_count_visible(v->sense, &v->camera, roi_x, roi_n, v->site->nroi,
                                  om__world_roi_bit(v->ids.roi), visibility);
}

OmStatus om__view_render_bare(OmView* v, OmWindow window, OmPicture* picture) {
    OmSenseOptions options = om_sense_options_default();
    options.nworker = 1;
    options.window = window;
    om_sense_scene_show(v->sense, v->tissue_id, false);
    OM_TRY(om_sense_scene_commit(v->sense));
    OM_TRY(om_picture_init(picture, window.width, window.height, 3));
    OmStatus status = om_sense_render(v->sense, &v->camera, &options, picture);
    if (status < 0) om_picture_done(picture);
    return status;
}

#define STEP_DEG 5  // between the elevations that are tried

// In words: the elevation nearest to the scene's from which enough of the ROI is seen, or the best one.
static OmStatus find_elevation(const OmScene* scene, OmView* view, double min, char* out,
                               size_t size) {
    OmSceneCamera c = scene->endoscope;
    const double now = c.elevation * 180 / OM_PI;
    double works = NAN, best = 0, seen = -1;
    for (int deg = STEP_DEG; deg <= 90; deg += STEP_DEG) {
        OmVisibility v = {0};
        c.elevation = deg * OM_PI / 180;
        view->camera = om__world_camera(view->site, &c, -1);
        OM_TRY(om_view_look(view, NULL, &v));
        const double share = (double)v.nseen / v.npoint;
        if (share > seen) {
            seen = share;
            best = deg;
        }
        if (share >= min && !(fabs(deg - now) >= fabs(works - now))) works = deg;
    }
    if (isnan(works))
        snprintf(
            out, size,
            "no elevation_deg of the endoscope shows enough, the best is %g with %.0f %%: move the ROI",
            best, 100 * seen);
    else
        snprintf(out, size, "elevation_deg: %g of the endoscope shows enough", works);
    return OM_OK;
}

OmStatus om_world_check_visible(const OmScene* scene, const OmSite* site) {
    OmVisibility v = {0};
    OmView* view;
    char elevation[160];
    const double min = fmax(OM_WORLD_MIN_VISIBLE, scene->task.visibility);
    OM_TRY(om_view_create(scene, site, &view));
    OmStatus status = om_view_look(view, NULL, &v);
    const bool is_seen = status == OM_OK && v.nseen >= min * v.npoint;
    if (status == OM_OK && !is_seen)
        status = find_elevation(scene, view, min, elevation, sizeof elevation);
    om_view_destroy(view);
    OM_TRY(status);
    if (is_seen) return OM_OK;
    const char* remedy = elevation;
    if (v.noutside >= v.naway && v.noutside >= v.nhidden)
        remedy =
            scene->endoscope.focal[0] > 0
                ? "make the endoscope's focal_px smaller or distance_mm larger, or move the ROI"
                : "make the endoscope's fov_deg or distance_mm larger, or move the ROI";
    return om_error(
        OM_INVALID,
        "%s: endoscope: with the tissue removed it sees %.0f %% of the ROI, and %.0f %% is needed: "
        "of %d points %d face away, %d lie outside the picture, %d lie behind the organ; %s",
        om_scene_label(scene), 100.0 * v.nseen / v.npoint, 100 * min, v.npoint, v.naway, v.noutside,
        v.nhidden, remedy);
}
