// 19_fold_a_sheet.c: a tool folds a sheet over onto itself and lets go; the fold lies on the sheet.
//
// Tissue does not pass through itself where its contact is made with self_contact. Each place where it touches itself
// is in the report, with its force. Writes 19_fold_a_sheet.png.
#include <math.h>
#include <stdio.h>

#include "omentum/omentum.h"

#define TIME_STEP 0.02

static const double length = 0.1, width = 0.04, thickness = 0.004;  // m

typedef struct Field {  // everything that has to be destroyed
    OmTetMesh mesh;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
} Field;

static void field_done(Field* f) {
    om_contact_work_destroy(f->contact_work);
    om_contact_destroy(f->contact);
    om_tissue_work_destroy(f->work);
    om_tissue_state_destroy(f->state);
    om_tissue_destroy(f->model);
    om_tet_mesh_done(&f->mesh);
}

// A sheet on a board, held at its end.
static OmStatus make_field(Field* f) {
    int held[100], nheld = 0;
    OmStatus status =
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(length, width, thickness), 10, 4, 1, &f->mesh);
    if (status != OM_OK) return status;
    for (int i = 0; i < f->mesh.nvert && nheld < 100; ++i)
        if (om_load3(f->mesh.x, i).x < 0.011) held[nheld++] = i;
    status = om_tet_mesh_add_set(&f->mesh, "attachment", held, nheld);
    if (status != OM_OK) return status;
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &f->mesh);
    def.solver.nworker = 1;  // too small to share among threads
    status = om_tissue_create(&def, &f->model);
    if (status == OM_OK) status = om_tissue_state_create(f->model, &f->state);
    if (status == OM_OK) status = om_tissue_work_create(f->model, &f->work);
    if (status != OM_OK) return status;
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef ground = om_contact_default_def();
    ground.nobstacle = 1, ground.obstacle = &board;
    ground.self_contact = true;
    ground.self_friction = 0.3;
    status = om_contact_create(&ground, f->model, &f->contact);
    return status == OM_OK ? om_contact_work_create(f->contact, &f->contact_work) : status;
}

// The free end goes over in half a circle, turning with the fold, and is let go.
static OmStatus fold(Field* f, OmContactReport* report) {
    OmPose tip = {om_vec3(length, 0.5 * width, thickness), om_quat_identity()};
    double radius = 0.035;
    int nheld;
    OmStatus status = om_tissue_grasp(f->model, f->state, 0, tip, 0.021, &nheld);
    for (int step = 0; status == OM_OK && step < 150; ++step) {
        double angle = 0.93 * OM_PI * (step < 100 ? step / 100.0 : 1);
        tip.p = om_vec3(length - radius + radius * cos(angle), 0.5 * width,
                        thickness + radius * sin(angle));
        tip.q = om_quat_axis_angle(om_vec3(0, -1, 0), angle);
        if (step < 110) status = om_tissue_move_grasp(f->state, 0, tip);
        if (step == 110) om_tissue_release(f->state, 0);
        if (status != OM_OK) break;
        status = om_contact_step(f->contact_work, f->model, f->state, f->work, TIME_STEP, report);
    }
    return status;
}

static OmStatus take_picture(const Field* f, const char* path) {
    OmSurface surface = {0};
    OmSenseScene* scene = NULL;
    OmPicture picture = {0};
    int id, *vert = NULL;
    const OmSenseLook fat = om_sense_look(OM_PART_TISSUE);
    OmCamera camera = {
        om_pose_look_at(om_vec3(0.06, -0.14, 0.06), om_vec3(0.034, 0.02, 0.005), om_vec3(0, 0, 1)),
        560,
        260,
        0.224,
        0.01,
        1};
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;  // smooth outlines
    OmStatus status = om_tet_mesh_boundary(om_tissue_mesh(f->model), &surface, &vert);
    if (status == OM_OK) status = om_sense_scene_create(&scene);
    if (status == OM_OK) status = om_sense_scene_add(scene, &surface, &fat, &id);
    if (status == OM_OK) om_sense_scene_update(scene, id, om_tissue_x(f->state), vert);
    if (status == OM_OK) status = om_sense_scene_commit(scene);
    if (status == OM_OK) status = om_picture_init(&picture, camera.width, camera.height, 3);
    if (status == OM_OK) status = om_sense_render(scene, &camera, &options, &picture);
    if (status == OM_OK) status = om_picture_save_png(&picture, path);
    om_picture_done(&picture);
    om_sense_scene_destroy(scene);
    om_surface_done(&surface);
    om_free(vert);
    return status;
}

int main(void) {
    Field f = {0};
    OmContactReport report;
    int ncrossing = 0;
    double push = 0;
    OmStatus status = make_field(&f);
    if (status == OM_OK) status = fold(&f, &report);
    if (status == OM_OK)
        status = om_contact_find_crossing(f.contact_work, f.state, &ncrossing, NULL);
    if (status == OM_OK) {
        for (int k = 0; k < report.ntouch; ++k) push += fabs(report.touch[k].force.z);
        printf("the fold touches the sheet at %d places and presses with %.3f N; %d edges cross\n",
               report.ntouch, push, ncrossing);
        status = take_picture(&f, "19_fold_a_sheet.png");
    }
    if (status != OM_OK) fprintf(stderr, "%s\n", om_error_message());
    field_done(&f);
    return status == OM_OK && report.ntouch > 0 && ncrossing == 0 ? 0 : 1;
}
