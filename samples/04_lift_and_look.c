// 04_lift_and_look.c: a sheet lies on a board; a tool lifts its corner, and a camera sees what was under it.
//
// Contact with the ground, a grasp that moves, the force at the tool, a picture, and how much of a region
// is visible. Writes 04_lift_and_look.png.
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

#define TIME_STEP 0.02

typedef struct Field {  // everything that has to be destroyed
    OmTetMesh mesh;
    OmSurface surface;
    int* surface_vert;  // vertex of om_tissue_mesh of each vertex of the surface
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
    OmSenseScene* scene;
    int surface_id;
} Field;

static OmStatus make_tissue(Field* f) {
    int held[2 * 9], nheld = 0;
    OmStatus status =
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.08, 0.08, 0.004), 8, 8, 1, &f->mesh);
    if (status != OM_OK) return status;
    for (int i = 0; i < f->mesh.nvert; ++i)
        if (om_load3(f->mesh.x, i).x < 1e-9) held[nheld++] = i;
    status = om_tet_mesh_add_set(&f->mesh, "attachment", held, nheld);
    if (status != OM_OK) return status;
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &f->mesh);
    def.material_default.law = OM_STABLE_NEO_HOOKEAN;  // it folds
    def.solver.nworker = 1;                            // too small to share among threads
    status = om_tissue_create(&def, &f->model);
    if (status == OM_OK) status = om_tissue_state_create(f->model, &f->state);
    if (status == OM_OK) status = om_tissue_work_create(f->model, &f->work);
    if (status != OM_OK) return status;
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef ground = om_contact_default_def();
    ground.nobstacle = 1, ground.obstacle = &board;
    status = om_contact_create(&ground, f->model, &f->contact);
    return status == OM_OK ? om_contact_work_create(f->contact, &f->contact_work) : status;
}

static OmStatus add_square(OmSenseScene* scene, OmVec3 centre, double half,
                           const OmSenseLook* look) {
    OmSurface square;
    int id;
    OmStatus status = om_surface_init(&square, 4, 2);
    if (status != OM_OK) return status;
    for (int i = 0; i < 4; ++i)
        om_store3(square.x, i, om_madd(centre, half, om_vec3(i % 2 ? 1 : -1, i / 2 ? 1 : -1, 0)));
    memcpy(square.tri_vert, (int[6]){0, 1, 3, 0, 3, 2}, 6 * sizeof(int));
    status = om_sense_scene_add(scene, &square, look, &id);
    om_surface_done(&square);
    return status;
}

static OmStatus make_scene(Field* f) {
    const OmSenseLook fat = om_sense_look(OM_PART_TISSUE);
    const OmSenseLook paint = om_sense_look(OM_PART_BOARD);
    const OmSenseLook magenta = om_sense_look(OM_PART_ROI);
    OmStatus status = om_tet_mesh_boundary(om_tissue_mesh(f->model), &f->surface, &f->surface_vert);
    if (status == OM_OK) status = om_sense_scene_create(&f->scene);
    if (status == OM_OK) status = om_sense_scene_add(f->scene, &f->surface, &fat, &f->surface_id);
    if (status == OM_OK) status = add_square(f->scene, om_vec3(0.04, 0.04, -1e-4), 0.1, &paint);
    if (status == OM_OK) status = add_square(f->scene, om_vec3(0.06, 0.06, 1e-4), 0.005, &magenta);
    return status;
}

// The share of the points at z = 0 around (60, 60) mm that the camera sees past the sheet.
static OmStatus look(Field* f, const OmCamera* camera, double* share) {
    double x[3 * 25], normal[3 * 25];
    for (int i = 0; i < 25; ++i) {
        om_store3(x, i, om_vec3(0.055 + 0.0025 * (i % 5), 0.055 + 0.0025 * (i / 5), 0.0002));
        om_store3(normal, i, om_vec3(0, 0, 1));
    }
    om_sense_scene_update(f->scene, f->surface_id, om_tissue_x(f->state), f->surface_vert);
    OmStatus status = om_sense_scene_commit(f->scene);
    if (status == OM_OK) status = om_sense_visibility(f->scene, camera, x, normal, 25, 0, share);
    return status;
}

static OmStatus lift(Field* f) {
    OmPose tip = {om_vec3(0.08, 0.08, 0.004), om_quat_identity()};
    OmContactReport report;
    int nheld;
    OmStatus status = om_tissue_grasp(f->model, f->state, 0, tip, 0.005, &nheld);
    for (int step = 0; status == OM_OK && step < 200; ++step) {
        double way = step < 150 ? 0.010 * TIME_STEP : 0;  // 10 mm/s up, and back over the sheet
        tip.p = om_add(tip.p, om_vec3(-way, 0, way));
        status = om_tissue_move_grasp(f->state, 0, tip);
        if (status != OM_OK) break;
        status = om_contact_step(f->contact_work, f->model, f->state, f->work, TIME_STEP, &report);
    }
    OmTissueForces force;
    if (status == OM_OK) status = om_tissue_get_forces(f->model, f->state, &force);
    if (status == OM_OK)
        printf("%d vertices held with %.3f N; %d vertices on the board carry %.3f of %.3f N\n",
               nheld, om_norm(force.grasp[0]), report.ncontact, force.contact.z, -force.weight.z);
    return status;
}

static OmStatus take_picture(const Field* f, const OmCamera* camera, const char* path) {
    OmPicture picture;
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;  // smooth outlines
    OmStatus status = om_picture_init(&picture, camera->width, camera->height, 3);
    if (status != OM_OK) return status;
    status = om_sense_render(f->scene, camera, &options, &picture);
    if (status == OM_OK) status = om_picture_save_png(&picture, path);
    om_picture_done(&picture);
    return status;
}

int main(void) {
    Field f = {0};
    // a camera on the side of the free corner: z forward, x right, y down
    OmVec3 eye = om_vec3(0.15, 0.15, 0.09), target = om_vec3(0.05, 0.05, 0);
    OmCamera camera = {om_pose_look_at(eye, target, om_vec3(0, 0, 1)), 320, 240, 0.7, 0.01, 1};
    double before = 0, after = 0;

    OmStatus status = make_tissue(&f);
    if (status == OM_OK) status = make_scene(&f);
    if (status == OM_OK) status = look(&f, &camera, &before);
    if (status == OM_OK) status = lift(&f);
    if (status == OM_OK) status = look(&f, &camera, &after);
    if (status == OM_OK) status = take_picture(&f, &camera, "04_lift_and_look.png");
    if (status == OM_OK)
        printf("visible: %.0f %% before, %.0f %% after\n", 100 * before, 100 * after);
    else
        fprintf(stderr, "%s\n", om_error_message());

    om_sense_scene_destroy(f.scene);
    om_contact_work_destroy(f.contact_work);
    om_contact_destroy(f.contact);
    om_tissue_work_destroy(f.work);
    om_tissue_state_destroy(f.state);
    om_tissue_destroy(f.model);
    om_surface_done(&f.surface);
    om_free(f.surface_vert);
    om_tet_mesh_done(&f.mesh);
    return status == OM_OK && before < 0.05 && after > 0.5 ? 0 : 1;
}
