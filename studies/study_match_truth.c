// study_match_truth.c: a setup's motion in the simulated world, what its camera saw, and the twin that follows.
//
// The arms of the world move as a robot moves them: above the grasping point, down, the jaw closes, then the motion in
// steps of one tick, then a wait of one second. The result is kept in a file, so that methods are judged on the same
// bytes again and again.
//
// The material point of a seen point is the nearest point of the true surface among the triangles that face the camera,
// carried back to the rest shape. Depth noise is 0.3 mm at 0.3 m and the sheet is 5 mm thick, so upper side and
// underside are not confused. For centres of triangles of a lifted surface the map is exact to 1e-9 m
// (test_study_match_case).
#include <math.h>
#include <string.h>

#include "omentum/shape_closest.h"
#include "studies/study_match_case.h"

#define WAIT 50  // ticks after the motion

// ---- files --------------------------------------------------------------------------------------------

// Hash of everything that the truth of a setup depends on.
static OmStatus hash_setup(const MatchSetup* setup, const OmScene* scene, uint64_t* hash) {
    OmText text = {0};
    *hash = OM_HASH_SEED;
    OmStatus status = om_scene_print(scene, false, &text);
    if (status == OM_OK) {
        *hash = om_hash(text.str, text.len, *hash);
        *hash = om_hash(setup->layout, sizeof setup->layout, *hash);
        *hash = om_hash(&setup->way, sizeof setup->way, *hash);
        for (int k = 0; k < setup->move.narm; ++k) {
            for (int i = 0; i <= 10; ++i) {
                OmVec3 p = om__match_tip(&setup->move, k, i / 10.0);
                *hash = om_hash(&p, sizeof p, *hash);
            }
        }
    }
    om_text_done(&text);
    return status;
}

// ---- the motion ---------------------------------------------------------------------------------------

typedef struct Run {
    const MatchSetup* setup;
    MatchTruth* truth;
    StudyHand hand;
    int nkept;  // pictures on the way
} Run;

// ---- views ----------------------------------------------------------------------------------------------

static size_t count_pixels(const OmCamera* camera) {
    return (size_t)camera->width * (size_t)camera->height;
}

// Depth and colour of a view of the present state.
static OmStatus keep_view(Run* r, MatchView view, float* depth, unsigned char* color) {
    OmScene* scene = &r->truth->scene;  // the world borrows it
    scene->world.has_depth_noise = view != VIEW_EXACT;
    OmStatus status =
        om_world_observe(r->hand.world, OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR, &r->hand.obs);
    scene->world.has_depth_noise = true;
    OM_TRY(status);
    size_t n = count_pixels(&r->hand.obs.rgbd.camera);
    memcpy(depth, r->hand.obs.rgbd.depth, n * sizeof *depth);
    memcpy(color, r->hand.obs.rgbd.color.pixel, 3 * n);
    return OM_OK;
}

// A picture on the way.
static OmStatus keep_way(Run* r, int tick) {
    MatchTruth* t = r->truth;
    size_t k = (size_t)r->nkept++, n = count_pixels(&t->head.camera);
    size_t nx = 3 * (size_t)t->mesh.nvert;
    for (int view = 0; view <= VIEW_EXACT; ++view)
        OM_TRY(keep_view(r, view, t->way_depth[view] + k * n, t->way_color[view] + 3 * k * n));
    t->way[k] = (MatchWay){.tick = tick, .time = r->hand.obs.rgbd.time};
    memcpy(t->way[k].arm, r->hand.obs.arm, sizeof r->hand.obs.arm);
    memcpy(t->way_x + k * nx, om_body_x(om_world_truth(r->hand.world)), nx * sizeof *t->way_x);
    return OM_OK;
}

// ---- arms -----------------------------------------------------------------------------------------------

static OmVec3 to_world(const Run* r, OmVec3 p) {
    return om_pose_apply(r->truth->site.pose_world_task, p);
}

static OmStatus grasp(Run* r, int k) {
    const MatchMove* move = &r->setup->move;
    const OmVec3 p = om__match_tip(move, k, 0);
    r->hand.arm = move->arm[k];
    OM_TRY(om__hand_grasp(&r->hand, to_world(r, om_add(p, om_vec3(0, 0, HAND_ABOVE))),
                          to_world(r, p)));
    r->truth->head.grasp_tip[k] = r->hand.obs.arm[move->arm[k]].tip;
    return OM_OK;
}

// Length of the way of an arm, m.
static double way_length(const MatchMove* move, int k) {
    OmVec3 arm = om_sub(move->grasp[k], move->line);
    OmVec3 across = om_madd(arm, -om_dot(arm, move->axis), move->axis);
    return move->angle * om_norm(across) + om_norm(move->shift);
}

static double longest_way(const MatchMove* move) {
    double length = 0;
    for (int k = 0; k < move->narm; ++k) length = fmax(length, way_length(move, k));
    return length;
}

static OmStatus move_all(Run* r) {
    const MatchMove* move = &r->setup->move;
    MatchHead* h = &r->truth->head;
    double length = longest_way(move);
    h->nmove = (int)ceil(length / (HAND_SPEED * h->dt));
    h->ntick = h->nmove + WAIT;
    OM_CHECK(h->ntick <= MATCH_MAX_TICK, OM_INVALID, "%s: %d ticks", r->setup->name, h->ntick);
    for (int i = 0; i < h->ntick; ++i) {
        double share = fmin(1, (double)(i + 1) / h->nmove);
        for (int k = 0; k < move->narm && i < h->nmove; ++k) {
            OmPose goal = h->grasp_tip[k];
            goal.p = to_world(r, om__match_tip(move, k, share));
            OM_TRY(om_world_move(r->hand.world, move->arm[k], goal, 4 * HAND_SPEED));
        }
        OM_TRY(om__hand_wait(&r->hand, 1));
        for (int a = 0; a < r->hand.obs.narm; ++a) h->tick[i].tip[a] = r->hand.obs.arm[a].tip;
        OmBodyForces force;
        OM_TRY(om_body_get_forces(om_world_truth(r->hand.world), &force));
        for (int k = 0; k < move->narm; ++k)
            h->force[k] = fmax(h->force[k], om_norm(force.pull[move->arm[k]]));
        bool is_next = r->nkept < r->truth->nway && i + 1 >= r->nkept * h->ntick / r->truth->nway;
        if (is_next) OM_TRY(keep_way(r, i + 1));
    }
    for (int k = 0; k < move->narm; ++k)
        OM_CHECK(om_arm_is_holding(&r->hand.obs.arm[move->arm[k]]), OM_INVALID,
                 "%s: the jaw lost the tissue", r->setup->name);
    return OM_OK;
}

// A square board under the tissue.
static OmStatus add_board(const OmSite* site, OmSenseScene* sense) {
    static const double corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    OmSurface board;
    OmSenseLook look = om_sense_look(OM_PART_BOARD);
    int id;
    OM_TRY(om_surface_init(&board, 4, 2));
    double r = 2.2 * fmax(site->half_size.x, site->half_size.y);
    for (int i = 0; i < 4; ++i)
        om_store3(board.x, i,
                  om_pose_apply(site->pose_world_task,
                                om_vec3(r * corner[i][0], r * corner[i][1], -1e-4)));
    memcpy(board.tri_vert, (int[6]){0, 1, 2, 0, 2, 3}, 6 * sizeof(int));
    OmStatus status = om_sense_scene_add(sense, &board, &look, &id);
    om_surface_done(&board);
    return status;
}

// Tissue with vertices at x, ROI and board without tools, with the camera and the noise of the world.
static OmStatus render_bare(MatchTruth* t, const double* x, float* depth, unsigned char* color) {
    OmSenseScene* sense;
    OmPicture picture = {0};
    OmSurface rest = t->surface;  // its texture is that of the rest shape
    rest.x = NULL;
    float* normal = NULL;
    const OmCamera* camera = &t->head.camera;
    OmSenseLook look = om_sense_look(OM_PART_TISSUE), roi = om_sense_look(OM_PART_ROI);
    int id, tissue;
    OM_TRY(om_sense_scene_create(&sense));
    OmStatus status;
    OM_ALLOC_DONE(normal, 3 * count_pixels(camera));
    OM_ALLOC_DONE(rest.x, 3 * (size_t)rest.nvert);
    for (int i = 0; i < rest.nvert; ++i) om_store3(rest.x, i, om_load3(t->mesh.x, t->vert[i]));
    OM_TRY_DONE(om_sense_scene_add(sense, &rest, &look, &tissue));
    om_sense_scene_update(sense, tissue, x, t->vert);
    if (t->site.roi.ntri > 0) OM_TRY_DONE(om_sense_scene_add(sense, &t->site.roi, &roi, &id));
    OM_TRY_DONE(add_board(&t->site, sense));
    OM_TRY_DONE(om_sense_scene_commit(sense));
    OM_TRY_DONE(om_sense_depth(sense, camera, 0, depth, NULL, normal));
    OmDepthNoise noise = om_depth_noise_default((uint64_t)t->scene.seed);
    om_depth_add_noise(&noise, camera, 1, normal, depth);
    OM_TRY_DONE(om_picture_init(&picture, camera->width, camera->height, 3));
    OmSenseOptions options = om_sense_options_default();
    status = om_sense_render(sense, camera, &options, &picture);
    if (status == OM_OK) memcpy(color, picture.pixel, 3 * count_pixels(camera));
done:
    om_free(normal);
    om_free(rest.x);
    om_picture_done(&picture);
    om_sense_scene_destroy(sense);
    return status;
}

static OmStatus keep_state(Run* r) {
    MatchTruth* t = r->truth;
    const double* x = om_body_x(om_world_truth(r->hand.world));
    memcpy(t->x, x, 3 * (size_t)t->mesh.nvert * sizeof *x);
    for (int view = 0; view <= VIEW_EXACT; ++view)
        OM_TRY(keep_view(r, view, t->depth[view], t->color[view]));
    MatchHead* h = &t->head;
    h->time = r->hand.obs.rgbd.time;
    h->camera = r->hand.obs.rgbd.camera;
    h->nbad = om_body_nbad(om_world_truth(r->hand.world));
    memcpy(h->arm, r->hand.obs.arm, sizeof h->arm);
    for (int a = 0; a < OM_MAX_ARM; ++a)
        if (om_world_psm(r->hand.world, a)) h->psm[a] = *om_world_psm(r->hand.world, a);
    return OM_OK;
}

static OmStatus simulate(const MatchSetup* setup, int nworker, MatchTruth* truth) {
    Run r = {.setup = setup, .truth = truth, .hand = {.name = setup->name}};
    const MatchMove* move = &setup->move;
    memset(&truth->head, 0, sizeof truth->head);
    truth->head.dt = r.hand.dt = truth->scene.task.time_step;
    OmStatus status;
    OM_TRY_DONE(om_world_create_simulated(&truth->scene, &truth->site, nworker, &r.hand.world));
    OM_TRY_DONE(om_world_reset(r.hand.world));
    OM_TRY_DONE(om_world_observe(r.hand.world, OM_OBSERVE_DEPTH, &r.hand.obs));
    truth->head.camera = r.hand.obs.rgbd.camera;
    if (truth->nway > 0) OM_TRY_DONE(keep_way(&r, 0));
    for (int k = 0; k < move->narm; ++k) OM_TRY_DONE(grasp(&r, k));
    OM_TRY_DONE(move_all(&r));
    status = keep_state(&r);
done:
    om_observation_done(&r.hand.obs);
    om_world_destroy(r.hand.world);
    return status;
}

// ---- truth --------------------------------------------------------------------------------------------

void om__match_truth_done(MatchTruth* t) {
    if (!t) return;
    om_site_done(&t->site);
    om_tet_mesh_done(&t->mesh);
    om_surface_done(&t->surface);
    om_free(t->vert);
    om_free(t->x);
    for (int v = 0; v < NVIEW; ++v) {
        om_free(t->depth[v]);
        om_free(t->color[v]);
        om_free(t->way_depth[v]);
        om_free(t->way_color[v]);
    }
    om_free(t->way);
    om_free(t->way_x);
    memset(t, 0, sizeof *t);
}

static OmStatus make_room(const MatchSetup* setup, MatchTruth* t) {
    OM_TRY(om__match_build_site(setup, BELIEF_RIGHT, OM_SITE_WORLD, &t->scene, &t->site));
    OM_TRY(om_tet_mesh_copy(&t->site.mesh, &t->mesh));
    if (setup->element == OM_ELEMENT_QUADRATIC) OM_TRY(om_tet_mesh_refine(&t->mesh));
    OM_TRY(om_tet_mesh_boundary(&t->mesh, &t->surface, &t->vert));
    size_t n = (size_t)t->scene.rgbd.width * (size_t)t->scene.rgbd.height;
    double length = longest_way(&setup->move) + WAIT * t->scene.task.time_step * HAND_SPEED;
    t->nway = setup->way > 0 ? (int)ceil(length / setup->way) : 0;
    OM_CHECK(t->nway <= MATCH_MAX_WAY, OM_INVALID, "%s: %d pictures on the way", setup->name,
             t->nway);
    size_t nway = (size_t)t->nway;
    OM_ALLOC(t->x, 3 * (size_t)t->mesh.nvert);
    OM_ALLOC(t->way_x, 3 * (size_t)t->mesh.nvert * nway);
    OM_ALLOC(t->way, nway);
    for (int v = 0; v < NVIEW; ++v) {
        OM_ALLOC(t->depth[v], n);
        OM_ALLOC(t->color[v], 3 * n);
        OM_ALLOC(t->way_depth[v], nway * n);
        OM_ALLOC(t->way_color[v], 3 * nway * n);
    }
    return OM_OK;
}

OmStatus om__match_truth_get(const MatchSetup* setup, const char* dir, int nworker, bool* is_new,
                             MatchTruth* t) {
    memset(t, 0, sizeof *t);
    char name[64];
    uint64_t hash = 0;
    OmStatus status;
    OM_TRY_DONE(make_room(setup, t));
    OM_TRY_DONE(hash_setup(setup, &t->scene, &hash));
    snprintf(name, sizeof name, "truth-%s.bin", setup->name);
    size_t n = (size_t)t->scene.rgbd.width * (size_t)t->scene.rgbd.height;
    size_t nway = (size_t)t->nway, nx = 3 * (size_t)t->mesh.nvert;
    StudyPart part[4 + 4 * NVIEW] = {{&t->head, sizeof t->head},
                                     {t->x, nx * sizeof *t->x},
                                     {t->way, nway * sizeof *t->way},
                                     {t->way_x, nway * nx * sizeof *t->way_x}};
    int npart = 4;
    for (int v = 0; v < NVIEW; ++v) {
        part[npart++] = (StudyPart){t->depth[v], n * sizeof *t->depth[v]};
        part[npart++] = (StudyPart){t->color[v], 3 * n};
        part[npart++] = (StudyPart){t->way_depth[v], nway * n * sizeof *t->depth[v]};
        part[npart++] = (StudyPart){t->way_color[v], 3 * nway * n};
    }
    bool is_there = om__study_load_parts(dir, name, hash, part, npart);
    if (is_new) *is_new = !is_there;
    if (!is_there) OM_TRY_DONE(simulate(setup, nworker, t));
    for (int i = 0; i < t->surface.nvert; ++i)
        om_store3(t->surface.x, i, om_load3(t->x, t->vert[i]));
    if (!is_there) {
        OM_TRY_DONE(render_bare(t, t->x, t->depth[VIEW_BARE], t->color[VIEW_BARE]));
        for (size_t k = 0; k < nway; ++k)
            OM_TRY_DONE(render_bare(t, t->way_x + k * nx, t->way_depth[VIEW_BARE] + k * n,
                                    t->way_color[VIEW_BARE] + 3 * k * n));
        status = om__study_save_parts(dir, name, hash, part, npart);
    }
done:
    if (status < 0) om__match_truth_done(t);
    return status;
}

// ---- observations -----------------------------------------------------------------------------------

// Direction across the cut: from the middle of the sheet, or from the line of the fold, to the grasp before the motion.
static OmVec3 cut_direction(const MatchMove* move) {
    OmVec3 across = move->angle != 0 ? om_cross(om_vec3(0, 0, 1), move->axis) : move->grasp[0];
    return om_normalize(om_vec3(across.x, across.y, 0));
}

// Place of each pixel on the tissue along a direction of the task frame; -HUGE_VAL: not on the tissue.
static void measure_pixels(const MatchTruth* t, OmVec3 across, const float* depth,
                           const unsigned char* color, double* place) {
    OmPose task = om_pose_inverse(t->site.pose_world_task);
    const OmCamera* c = &t->head.camera;
    OmPose pose = c->pose_world_camera;
    OmVec3 z = om_quat_rotate(pose.q, om_vec3(0, 0, 1));
    for (int i = 0; i < (int)count_pixels(c); ++i) {
        place[i] = -HUGE_VAL;
        bool is_seen = depth[i] > 0 && isfinite(depth[i]);
        if (!is_seen || om_sense_part_of(color + 3 * (size_t)i) != OM_PART_TISSUE) continue;
        OmVec3 ray = om_camera_ray(c, i % c->width + 0.5, i / c->width + 0.5);
        OmVec3 p = om_madd(pose.p, (double)depth[i] / om_dot(ray, z), ray);
        place[i] = om_dot(om_pose_apply(task, p), across);
    }
}

static OmStatus cut_view(const MatchTruth* t, const MatchMove* move, double seen, bool keeps_far,
                         OmDepthPicture* picture) {
    size_t n = count_pixels(&picture->camera), m = 0;
    double *place, *sorted = NULL;
    OmVec3 across = om_scale(keeps_far ? -1 : 1, cut_direction(move));
    OmStatus status = OM_OK;
    OM_ALLOC(place, n);
    OM_ALLOC_DONE(sorted, n);
    measure_pixels(t, across, picture->depth, picture->color.pixel, place);
    for (size_t i = 0; i < n; ++i)
        if (place[i] > -HUGE_VAL) sorted[m++] = place[i];
    OM_CHECK_DONE(m > 0, OM_INVALID, "no pixel is on the tissue");
    om_sort_doubles(sorted, (int)m);
    double limit = sorted[(size_t)((1 - seen) * (double)(m - 1))];
    for (size_t i = 0; i < n; ++i) {
        if (place[i] == -HUGE_VAL || place[i] >= limit) continue;
        picture->depth[i] = 0;
        memset(picture->color.pixel + 3 * i, 0, 3);
    }
done:
    om_free(place);
    om_free(sorted);
    return status;
}

OmStatus om__match_observe_way(const MatchTruth* t, const MatchMove* move, MatchView view,
                               double seen, bool keeps_far, int k, OmObservation* obs) {
    const bool is_end = k >= t->nway;
    const size_t at = is_end ? 0 : (size_t)k * count_pixels(&t->head.camera);
    OM_TRY(om__hand_show(is_end ? t->head.time : t->way[k].time,
                         is_end ? t->head.arm : t->way[k].arm, t->scene.world.narm, &t->head.camera,
                         (is_end ? t->depth : t->way_depth)[view] + at,
                         (is_end ? t->color : t->way_color)[view] + 3 * at, obs));
    OmStatus status = seen < 1 ? cut_view(t, move, seen, keeps_far, &obs->rgbd) : OM_OK;
    if (status < 0) om_observation_done(obs);
    return status;
}

OmStatus om__match_scan_way(const MatchTruth* truth, const OmSite* twin, const MatchMove* move,
                            const MatchCase* c, double spacing, int k, OmObservation* obs,
                            OmScan* scan) {
    memset(scan, 0, sizeof *scan);
    OM_TRY(om__match_observe_way(truth, move, c->view, c->seen, c->keeps_far, k, obs));
    OmStatus status =
        om__hand_scan(obs, twin, c->view == VIEW_BARE ? NULL : truth->head.psm, spacing, scan);
    if (status < 0) om_observation_done(obs);
    return status;
}

OmStatus om__match_scan(const MatchTruth* truth, const OmSite* twin, const MatchMove* move,
                        const MatchCase* c, double spacing, OmScan* scan) {
    OmObservation obs;
    OM_TRY(om__match_scan_way(truth, twin, move, c, spacing, truth->nway, &obs, scan));
    om_observation_done(&obs);
    return OM_OK;
}

int om__match_grasps_way(const MatchTruth* truth, const MatchMove* move, int k,
                         OmMatchGrasp* grasp) {
    bool is_end = k >= truth->nway;
    if (!is_end && truth->way[k].tick == 0) return 0;
    const OmArmObservation* arm = is_end ? truth->head.arm : truth->way[k].arm;
    for (int i = 0; i < move->narm; ++i)
        grasp[i] = (OmMatchGrasp){.arm = move->arm[i],
                                  .pose_world_grasp = truth->head.grasp_tip[i],
                                  .pose_world_now = arm[move->arm[i]].tip};
    return move->narm;
}

int om__match_grasps(const MatchTruth* truth, const MatchMove* move, OmMatchGrasp* grasp) {
    return om__match_grasps_way(truth, move, truth->nway, grasp);
}

// ---- material points ----------------------------------------------------------------------------------

OmStatus om__match_find_on_surface(const OmSurface* s, const int* vert, const double* x_rest,
                                   OmVec3 eye, int n, const double* x, double* rest,
                                   double* distance) {
    OmSurfaceTree* tree = NULL;
    unsigned char* is_facing = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(is_facing, (size_t)s->ntri);
    for (int k = 0; k < s->ntri; ++k) {
        const int* v = s->tri_vert + 3 * (size_t)k;
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        OmVec3 normal = om_cross(om_sub(b, a), om_sub(c, a));
        is_facing[k] = om_dot(normal, om_sub(eye, a)) > 0;
    }
    OM_TRY_DONE(om_surface_tree_create(s, &tree));
    for (int i = 0; i < n; ++i) {
        OmSurfacePoint q;
        OM_CHECK_DONE(om_surface_tree_find(tree, om_load3(x, i), is_facing, INFINITY, &q),
                      OM_INVALID, "no triangle of the truth faces the camera");
        OmVec3 p = om_vec3(0, 0, 0);
        for (int k = 0; k < 3; ++k) {
            int v = vert[s->tri_vert[3 * (size_t)q.tri + k]];
            p = om_madd(p, q.bary[k], om_load3(x_rest, v));
        }
        om_store3(rest, i, p);
        if (distance) distance[i] = q.distance;
    }
done:
    om_free(is_facing);
    om_surface_tree_destroy(tree);
    return status;
}

OmStatus om__match_find_material(const MatchTruth* t, int n, const double* x, double* rest,
                                 double* distance) {
    return om__match_find_on_surface(&t->surface, t->vert, t->mesh.x,
                                     t->head.camera.pose_world_camera.p, n, x, rest, distance);
}

OmStatus om__match_find_scanned(const OmSurface* surface, const int* vert, const double* x_rest,
                                const OmScan* scan, OmVec3 shift, double* rest) {
    double* x;
    OM_ALLOC(x, 3 * (size_t)scan->npoint + 1);
    for (int i = 0; i < scan->npoint; ++i) om_store3(x, i, om_sub(om_load3(scan->x, i), shift));
    const OmVec3 eye = om_sub(scan->camera.pose_world_camera.p, shift);
    OmStatus status =
        om__match_find_on_surface(surface, vert, x_rest, eye, scan->npoint, x, rest, NULL);
    om_free(x);
    return status;
}

// ---- places in a mesh -----------------------------------------------------------------------------------

void om__places_done(StudyPlaces* p) {
    om_free(p->elem);
    om_free(p->weight);
    memset(p, 0, sizeof *p);
}

OmStatus om__places_find(const OmFemMesh* mesh, int n, const double* rest, StudyPlaces* p) {
    *p = (StudyPlaces){.mesh = mesh, .n = n};
    OmStatus status;
    OM_ALLOC_DONE(p->elem, (size_t)n + 1);
    OM_ALLOC_DONE(p->weight, 4 * (size_t)n + 1);
    status = om_fem_mesh_embed(mesh, n, rest, p->elem, p->weight);
done:
    if (status < 0) om__places_done(p);
    return status;
}

OmVec3 om__places_at(const StudyPlaces* p, const double* x, int i) {
    const int* node = p->mesh->elem_node + 4 * (size_t)p->elem[i];
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int k = 0; k < 4; ++k) sum = om_madd(sum, p->weight[4 * i + k], om_load3(x, node[k]));
    return sum;
}

double om__places_distance(const StudyPlaces* p, const double* x, const double* points) {
    double sum = 0;
    for (int i = 0; i < p->n; ++i) sum += om_distance(om__places_at(p, x, i), om_load3(points, i));
    return p->n ? sum / p->n : 0;
}

OmStatus om__match_carry_by(const OmTetMesh* tet, const double* x_now, int n, const double* rest,
                            double* x) {
    OmFemMesh mesh = {0};
    StudyPlaces places = {0};
    OmStatus status;
    OM_TRY_DONE(om_fem_mesh_from_tet(tet, OM_TET4, &mesh));
    OM_TRY_DONE(om__places_find(&mesh, n, rest, &places));
    for (int i = 0; i < n; ++i) om_store3(x, i, om__places_at(&places, x_now, i));
done:
    om__places_done(&places);
    om_fem_mesh_done(&mesh);
    return status;
}

OmStatus om__match_carry(const MatchTruth* t, int n, const double* rest, double* x) {
    return om__match_carry_by(&t->mesh, t->x, n, rest, x);
}

// ---- the twin -----------------------------------------------------------------------------------------

// A step that did not converge has advanced; the next one starts from there.
static OmStatus step_body(OmBody* body, double dt) {
    OmBodyReport report;
    OmStatus status = om_body_step(body, dt, &report);
    return status == OM_NOT_CONVERGED ? OM_OK : status;
}

static OmStatus follow_tick(OmBody* body, const MatchMove* move, const MatchHead* head, int i) {
    for (int k = 0; k < move->narm; ++k)
        if (om_body_is_holding(body, k))
            OM_TRY(om_body_move(body, k, head->tick[i].tip[move->arm[k]]));
    return step_body(body, head->dt);
}

OmStatus om__match_follow(OmBody* body, const MatchMove* move, const MatchHead* head, int ntick) {
    for (int i = 0; i < ntick; ++i) OM_TRY(follow_tick(body, move, head, i));
    return OM_OK;
}

// The whole way, with the positions at each picture on it.
static OmStatus follow_way(OmBody* body, const MatchMove* move, const MatchTruth* t, MatchTwin* w) {
    size_t n = 3 * (size_t)w->site.mesh.nvert;
    OM_ALLOC(w->way_x, (size_t)t->nway * n);
    int k = 0;
    for (int i = 0; i <= t->head.ntick; ++i) {
        for (; k < t->nway && t->way[k].tick == i; ++k)
            memcpy(w->way_x + (size_t)k * n, om_body_x(body), n * sizeof *w->way_x);
        if (i < t->head.ntick) OM_TRY(follow_tick(body, move, &t->head, i));
    }
    return OM_OK;
}

void om__match_twin_done(MatchTwin* twin) {
    if (!twin) return;
    om_site_done(&twin->site);
    om_free(twin->x);
    om_free(twin->nodes);
    om_free(twin->way_x);
    memset(twin, 0, sizeof *twin);
}

OmStatus om__match_twin_get(const MatchSetup* setup, MatchBelief belief, const MatchTruth* truth,
                            double share, int nworker, MatchTwin* twin) {
    memset(twin, 0, sizeof *twin);
    const MatchHead* head = &truth->head;
    OmBody* body = NULL;
    OmStatus status;
    int nheld;
    OM_TRY_DONE(om__match_build_site(setup, belief, OM_SITE_TWIN, &twin->scene, &twin->site));
    size_t n = 3 * (size_t)twin->site.mesh.nvert;
    OM_ALLOC_DONE(twin->x, n);
    OM_TRY_DONE(om_body_create(&twin->scene, &twin->site, nworker, &body));
    status = om_body_settle(body, head->dt, 1e-3, 3);
    if (status < 0) goto done;
    for (int k = 0; k < setup->move.narm; ++k)
        OM_TRY_DONE(
            om_body_grasp(body, k, head->grasp_tip[k], twin->scene.task.grasp_radius, &nheld));
    if (share < 1)
        status = om__match_follow(body, &setup->move, head, (int)lround(share * head->nmove));
    else
        status = follow_way(body, &setup->move, truth, twin);
    if (status < 0) goto done;
    memcpy(twin->x, om_body_x(body), n * sizeof *twin->x);
    OM_ALLOC_DONE(twin->nodes, 3 * (size_t)om_body_node_count(body));
    om_body_get_nodes(body, twin->nodes);
done:
    om_body_destroy(body);
    if (status < 0) om__match_twin_done(twin);
    return status;
}
