// 07_drop_a_block.c: a soft block of particles drops on a ball, and a picture shows how it lies.
//
// Position based dynamics behind the same calls: particles sampled in a closed surface, a definition, and
// from there on a tissue as any other. The ball and the board are obstacles of a step; the skin is carried by
// the particles. Writes 07_drop_a_block.png.
#include <stdio.h>

#include "omentum/omentum.h"

typedef struct Field {  // everything that has to be destroyed
    OmTetMesh box, particles;
    OmSurface skin, ball_skin, board_skin;
    OmEmbedding embedding;  // of the skin in the particles
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
    OmProbe* ball;
    OmSenseScene* scene;
} Field;

static const OmPose ball_pose = {{0, 0, 0.03}, {0, 0, 0, 1}};

// 90 x 90 x 30 mm, 20 mm above the ball; particles every 5 mm.
static OmStatus make_block(Field* f) {
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    OmVec3 lo = {-0.045, -0.045, 0.08}, hi = {0.045, 0.045, 0.11};
    OmStatus status = om_tet_mesh_box(lo, hi, 18, 18, 6, &f->box);
    if (status == OM_OK) status = om_tet_mesh_boundary(&f->box, &f->skin, NULL);
    if (status == OM_OK)
        status = om_pbd_sample_surface(&f->skin, 0.005, &f->particles, &pbd.particle_volume);
    if (status != OM_OK) return status;
    OmTissueDef def = om_tissue_default_def(om_pbd_engine(), &f->particles);
    def.options = &pbd;
    def.solver.nworker = 1;
    status = om_tissue_create(&def, &f->model);
    if (status == OM_OK) status = om_tissue_state_create(f->model, &f->state);
    if (status == OM_OK) status = om_tissue_work_create(f->model, &f->work);
    if (status == OM_OK)
        status = om_tissue_embed(f->model, f->skin.nvert, f->skin.x, &f->embedding);
    return status;
}

static OmStatus make_obstacles(Field* f) {
    OmProbeDef ball = om_probe_default_def(OM_PROBE_SPHERE);
    ball.radius = 0.03;
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle flat = om_plane_obstacle(&plane);
    OmStatus status = om_probe_create(&ball, &f->ball);
    if (status != OM_OK) return status;
    OmTissueObstacle obstacle[2] = {flat, om_probe_obstacle(f->ball, ball_pose, ball_pose, 1)};
    OmContactDef def = om_contact_default_def();
    def.nobstacle = 2;
    def.obstacle = obstacle;
    status = om_contact_create(&def, f->model, &f->contact);
    if (status == OM_OK) status = om_contact_work_create(f->contact, &f->contact_work);
    return status;
}

// Two seconds; the report has the force of each obstacle.
static OmStatus drop(Field* f) {
    OmContactReport report;
    OmStatus status = OM_OK;
    for (int step = 0; status == OM_OK && step < 100; ++step) {
        status = om_contact_step(f->contact_work, f->model, f->state, f->work, 0.02, &report);
        if (status == OM_OK && (step + 1) % 20 == 0)
            printf("%.1f s: ball bears %5.2f N of %.2f N, board %5.2f N\n",
                   om_tissue_time(f->state), report.obstacle[1].force.z,
                   9.81 * 1000 * 0.09 * 0.09 * 0.03, report.obstacle[0].force.z);
    }
    return status;
}

static OmStatus make_scene(Field* f) {
    const OmSenseLook fat = {
        0.93, 0.66, 0.36, .gloss = 0.6, .is_smooth = true, .texture = OM_TEXTURE_FAT};
    const OmSenseLook steel = {0.55, 0.58, 0.62, .gloss = 0.8, .is_smooth = true};
    const OmSenseLook paint = {0.30, 0.42, 0.48, .is_checker = true};
    int id;
    OmStatus status = om_probe_get_surface(f->ball, &f->ball_skin);
    if (status == OM_OK) status = om_surface_init(&f->board_skin, 4, 2);
    if (status != OM_OK) return status;
    for (int i = 0; i < f->ball_skin.nvert; ++i)
        om_store3(f->ball_skin.x, i, om_pose_apply(ball_pose, om_load3(f->ball_skin.x, i)));
    for (int i = 0; i < 4; ++i)
        om_store3(f->board_skin.x, i, om_vec3(i % 2 ? 0.2 : -0.2, i / 2 ? 0.2 : -0.2, 0));
    for (int k = 0; k < 6; ++k) f->board_skin.tri_vert[k] = (int[6]){0, 1, 3, 0, 3, 2}[k];
    om_embedding_eval(&f->embedding, om_tissue_x(f->state), f->skin.x);
    status = om_sense_scene_create(&f->scene);
    if (status == OM_OK) status = om_sense_scene_add(f->scene, &f->skin, &fat, &id);
    if (status == OM_OK) status = om_sense_scene_add(f->scene, &f->ball_skin, &steel, &id);
    if (status == OM_OK) status = om_sense_scene_add(f->scene, &f->board_skin, &paint, &id);
    if (status == OM_OK) status = om_sense_scene_commit(f->scene);
    return status;
}

static OmStatus take_picture(const Field* f, const char* path) {
    OmPose eye = om_pose_look_at(om_vec3(0.26, -0.13, 0.07), om_vec3(0, 0, 0.03), om_vec3(0, 0, 1));
    OmCamera camera = {eye, 480, 360, 0.6, 0.01, 1};
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;
    OmPicture picture;
    OmStatus status = om_picture_init(&picture, camera.width, camera.height, 3);
    if (status != OM_OK) return status;
    status = om_sense_render(f->scene, &camera, &options, &picture);
    if (status == OM_OK) status = om_picture_save_png(&picture, path);
    om_picture_done(&picture);
    return status;
}

int main(void) {
    Field f = {0};
    OmStatus status = make_block(&f);
    if (status == OM_OK) status = make_obstacles(&f);
    if (status == OM_OK) status = drop(&f);
    if (status == OM_OK) status = make_scene(&f);
    if (status == OM_OK) status = take_picture(&f, "07_drop_a_block.png");
    if (status != OM_OK) fprintf(stderr, "%s\n", om_error_message());
    om_sense_scene_destroy(f.scene);
    om_probe_destroy(f.ball);
    om_contact_work_destroy(f.contact_work);
    om_contact_destroy(f.contact);
    om_embedding_done(&f.embedding);
    om_tissue_work_destroy(f.work);
    om_tissue_state_destroy(f.state);
    om_tissue_destroy(f.model);
    om_surface_done(&f.skin);
    om_surface_done(&f.ball_skin);
    om_surface_done(&f.board_skin);
    om_tet_mesh_done(&f.particles);
    om_tet_mesh_done(&f.box);
    return status == OM_OK ? 0 : 1;
}
