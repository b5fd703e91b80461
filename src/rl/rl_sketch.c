// rl_sketch.c: pictures of small scenes. The scene is made anew for each picture (some ms), so that states of tasks
// stay blocks of plain memory.
#include "rl/rl_sketch.h"

#include "omentum/contact_tool.h"

#define SIDE 84  // pixels, without a wanted size

OmStatus om__rl_sketch_begin(OmVec3 eye, OmVec3 at, double fov_deg, OmRlSketch* p) {
    *p = (OmRlSketch){.status = OM_OK};
    p->camera = (OmCamera){.pose_world_camera = om_pose_look_at(eye, at, om_vec3(0, 0, 1)),
                           .width = SIDE,
                           .height = SIDE,
                           .fov = fov_deg * OM_PI / 180,
                           .near_m = 0.01,
                           .far_m = 100};
    return om_sense_scene_create(&p->scene);
}

// Add a surface and free it.
static void add(OmRlSketch* p, OmStatus status, OmSurface* surface, OmSensePart part) {
    OmSenseLook look = om_sense_look(part);
    int id;
    if (status >= 0 && p->status >= 0) status = om_sense_scene_add(p->scene, surface, &look, &id);
    if (status < 0 && p->status >= 0) p->status = status;
    om_surface_done(surface);
}

void om__rl_sketch_box(OmRlSketch* p, OmPose pose_world_box, OmVec3 lo, OmVec3 hi,
                       OmSensePart part) {
    OmTetMesh box = {0};
    OmSurface surface = {0};
    OmStatus status = om_tet_mesh_box(lo, hi, 1, 1, 1, &box);
    if (status >= 0) status = om_tet_mesh_boundary(&box, &surface, NULL);
    om_tet_mesh_done(&box);
    for (int i = 0; i < surface.nvert; ++i)
        om_store3(surface.x, i, om_pose_apply(pose_world_box, om_load3(surface.x, i)));
    add(p, status, &surface, part);
}

void om__rl_sketch_ball(OmRlSketch* p, OmVec3 center, double radius, OmSensePart part) {
    OmProbeDef def = om_probe_default_def(OM_PROBE_SPHERE);
    OmProbe* ball = NULL;
    OmSurface surface = {0};
    def.radius = radius;
    OmStatus status = om_probe_create(&def, &ball);
    if (status >= 0) status = om_probe_get_surface(ball, &surface);
    om_probe_destroy(ball);
    for (int i = 0; i < surface.nvert; ++i)
        om_store3(surface.x, i, om_add(center, om_load3(surface.x, i)));
    add(p, status, &surface, part);
}

void om__rl_sketch_rod(OmRlSketch* p, OmVec3 end, double z, double half, OmSensePart part) {
    if (end.z == z) return;
    OmVec3 side = om_vec3(half, half, 0), other = om_vec3(end.x, end.y, z);
    OmVec3 lo = om_sub(end.z < z ? end : other, side), hi = om_add(end.z < z ? other : end, side);
    om__rl_sketch_box(p, om_pose_identity(), lo, hi, part);
}

void om__rl_sketch_mesh(OmRlSketch* p, const OmTetMesh* mesh, const double* x, OmSensePart part) {
    OmSurface surface = {0};
    int* vert = NULL;
    OmStatus status = om_tet_mesh_boundary(mesh, &surface, &vert);
    for (int i = 0; status >= 0 && i < surface.nvert; ++i)
        om_store3(surface.x, i, om_load3(x, vert[i]));
    om_free(vert);
    add(p, status, &surface, part);
}

OmStatus om__rl_sketch_end(OmRlSketch* p, OmPicture* picture) {
    OmStatus status = p->status;
    OmPicture made = {0};
    OmSenseOptions options = om_sense_options_default();
    options.nworker = 1;
    if (picture->width > 0 && picture->height > 0)
        p->camera = om_camera_resize(&p->camera, picture->width, picture->height);
    if (status >= 0) status = om_sense_scene_commit(p->scene);
    if (status >= 0) status = om_picture_init(&made, p->camera.width, p->camera.height, 3);
    if (status >= 0) status = om_sense_render(p->scene, &p->camera, &options, &made);
    om_sense_scene_destroy(p->scene);
    if (status < 0)
        om_picture_done(&made);
    else
        *picture = made;
    return status;
}
