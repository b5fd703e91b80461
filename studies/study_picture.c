// study_picture.c: pictures for the report: the body, cut open, with the probe; its meshes.
#include <math.h>
#include <string.h>

#include "omentum/tissue.h"
#include "studies/study_internal.h"
#include "studies/study_table.h"

#define WIDTH 480
#define HEIGHT 360
#define FOV (40 * OM_PI / 180)  // vertical
#define FILLED 0.94  // share of the picture's width or height that the tissue and the probe fill
#define PROBE_SHOWN 0.6  // of its length, from the face; the rest may end at the edge
#define NRING 12         // of a drawn lesion

// ---- shapes ---------------------------------------------------------------------------------------

// A ball of 2 NRING x NRING quadrilaterals.
static OmStatus make_ball(OmVec3 c, double r, OmSurface* ball) {
    OM_TRY(om_surface_init(ball, 2 * NRING * (NRING + 1), 4 * NRING * NRING));
    for (int i = 0; i <= NRING; ++i)
        for (int j = 0; j < 2 * NRING; ++j) {
            double t = OM_PI * i / NRING, f = OM_PI * j / NRING;
            OmVec3 n = om_vec3(sin(t) * cos(f), sin(t) * sin(f), cos(t));
            om_store3(ball->x, i * 2 * NRING + j, om_madd(c, r, n));
        }
    int* v = ball->tri_vert;
    for (int i = 0; i < NRING; ++i)
        for (int j = 0; j < 2 * NRING; ++j, v += 6) {
            int a = i * 2 * NRING + j, b = i * 2 * NRING + (j + 1) % (2 * NRING);
            int c0 = a + 2 * NRING, d = b + 2 * NRING;
            const int quad[6] = {a, c0, d, a, d, b};
            memcpy(v, quad, sizeof quad);
        }
    return OM_OK;
}

// The boundary of the elements whose rest centre lies behind the plane through p with normal n (n = 0: all),
// at positions x.
static OmStatus make_half(const OmTetMesh* mesh, const double* x, OmVec3 p, OmVec3 n,
                          OmSurface* out) {
    OmTetMesh half;
    int* vert = NULL;
    OM_TRY(om_tet_mesh_copy(mesh, &half));
    int kept = 0;
    for (int e = 0; e < mesh->ntet; ++e) {
        OmVec3 c = om_vec3(0, 0, 0);
        for (int a = 0; a < 4; ++a)
            c = om_madd(c, 0.25, om_load3(mesh->x, mesh->tet_vert[4 * e + a]));
        if (om_dot(om_sub(c, p), n) > 0) continue;
        memcpy(half.tet_vert + 4 * kept, mesh->tet_vert + 4 * e, 4 * sizeof(int));
        ++kept;
    }
    int all = half.ntet;
    half.ntet = kept;
    OmStatus status = om_tet_mesh_boundary(&half, out, &vert);
    for (int i = 0; status == OM_OK && i < out->nvert; ++i)
        om_store3(out->x, i, om_load3(x, vert[i]));
    half.ntet = all;
    om_free(vert);
    om_tet_mesh_done(&half);
    return status;
}

// ---- one picture ----------------------------------------------------------------------------------

typedef struct View {
    const Study* s;
    OmSenseScene* scene;
    OmVec3 axis[3];  // of the camera: right, up, ahead
    double half[2];  // tangents of half the angles across and up, less the margin
    double most[4];  // m: largest +x - half z, -x - half z, and both of y, of the points to show
} View;

// A camera at (tx, ty, -d) sees a point if |x - tx| <= half (z + d), and so for y: four largest sums give the nearest.
static void view_show(View* v, const double* x, int n, OmPose pose) {
    for (int i = 0; i < n; ++i) {
        const OmVec3 p = om_pose_apply(pose, om_load3(x, i));
        const double z = om_dot(p, v->axis[2]);
        for (int k = 0; k < 4; ++k) {
            const double across = (k % 2 ? -1 : 1) * om_dot(p, v->axis[k / 2]);
            v->most[k] = fmax(v->most[k], across - v->half[k / 2] * z);
        }
    }
}

// Look from that side at tissue at rest and the probe at first contact: pictures of one lesion have one camera.
static OmStatus view_begin(View* v, OmVec3 from, const OmSurface* rest,
                           const OmStudyLesion* lesion) {
    OmSurface probe;
    v->axis[2] = om_scale(-1, om_normalize(from));
    v->axis[0] = om_normalize(om_cross(v->axis[2], v->s->def->body->up));
    v->axis[1] = om_cross(v->axis[0], v->axis[2]);
    v->half[1] = FILLED * tan(0.5 * FOV);
    v->half[0] = v->half[1] * WIDTH / HEIGHT;
    for (int k = 0; k < 4; ++k) v->most[k] = -INFINITY;
    view_show(v, rest->x, rest->nvert, om_pose_identity());
    OM_TRY(om_probe_get_surface(v->s->probe, &probe));
    for (int i = 0; i < probe.nvert; ++i) probe.x[3 * i + 2] *= PROBE_SHOWN;
    view_show(v, probe.x, probe.nvert, om__study_probe_pose(lesion, 0));
    om_surface_done(&probe);
    return om_sense_scene_create(&v->scene);
}

static OmStatus view_add(View* v, OmSurface* surface, double red, double green, double blue,
                         bool is_smooth) {
    OmSenseLook look = {
        .red = red, .green = green, .blue = blue, .gloss = 0.15, .is_smooth = is_smooth};
    int id;
    OmStatus status = om_sense_scene_add(v->scene, surface, &look, &id);
    om_surface_done(surface);
    return status;
}

static OmStatus view_add_probe(View* v, OmPose pose) {
    OmSurface probe;
    OM_TRY(om_probe_get_surface(v->s->probe, &probe));
    for (int i = 0; i < probe.nvert; ++i)
        om_store3(probe.x, i, om_pose_apply(pose, om_load3(probe.x, i)));
    return view_add(v, &probe, 0.35, 0.45, 0.6, false);
}

static OmStatus view_end(View* v, OmReport* report, const char* caption) {
    const double* m = v->most;
    const double far = fmax((m[0] + m[1]) / (2 * v->half[0]), (m[2] + m[3]) / (2 * v->half[1]));
    OmVec3 eye = om_scale(-far, v->axis[2]);
    eye = om_madd(eye, 0.5 * (m[0] - m[1]), v->axis[0]);
    eye = om_madd(eye, 0.5 * (m[2] - m[3]), v->axis[1]);
    const OmCamera camera = {.pose_world_camera =
                                 om_pose_look_at(eye, om_add(eye, v->axis[2]), v->axis[1]),
                             .width = WIDTH,
                             .height = HEIGHT,
                             .fov = FOV,
                             .near_m = 0.001,
                             .far_m = 100};
    return om__report_render(report, v->scene, &camera, v->s->def->nworker, caption);
}

// ---- scenes -----------------------------------------------------------------------------------------

// The body at the end of a run, cut along the probe's long side, with the lesions at the model's positions.
static OmStatus add_cut(const Study* s, const StudyStage* stage, const OmStudyLesion* lesion,
                        double depth, OmReport* report) {
    View v = {.s = s};
    OmVec3 side = om_cross(lesion->normal, lesion->along);
    const OmTetMesh* mesh = om_tissue_mesh(stage->model);
    const double* x = om_tissue_x(stage->state);
    OmEmbedding e = {0};
    OmSurface surface;
    double center[3 * OM_STUDY_MAX_LESION];
    char caption[200];
    OmStatus status;
    for (int i = 0; i < s->def->body->nlesion; ++i)
        om_store3(center, i, s->def->body->lesion[i].center);
    OM_TRY(om_tissue_embed(stage->model, s->def->body->nlesion, center, &e));
    om_embedding_eval(&e, x, center);
    om_embedding_done(&e);
    OM_TRY_DONE(make_half(mesh, mesh->x, lesion->center, side, &surface));
    status = view_begin(&v, om_add(side, om_scale(0.35, s->def->body->up)), &surface, lesion);
    om_surface_done(&surface);
    OM_TRY_DONE(status);
    OM_TRY_DONE(make_half(mesh, x, lesion->center, side, &surface));
    OM_TRY_DONE(view_add(&v, &surface, 0.93, 0.74, 0.66, false));
    for (int i = 0; i < s->def->body->nlesion; ++i) {
        OM_TRY_DONE(make_ball(om_load3(center, i), s->def->body->lesion[i].radius, &surface));
        OM_TRY_DONE(view_add(&v, &surface, 0.55, 0.2, 0.45, true));
    }
    OM_TRY_DONE(view_add_probe(&v, om__study_probe_pose(lesion, depth)));
    snprintf(
        caption, sizeof caption,
        "%.0f mm over a lesion of %.1f mm, %d elements, cut along the probe; the lesions that the cut "
        "lays bare",
        1e3 * depth, 2e3 * lesion->radius, mesh->ntet);
    status = view_end(&v, report, caption);
done:
    om_sense_scene_destroy(v.scene);
    return status;
}

static OmStatus add_mesh(const Study* s, int ntet, OmReport* report) {
    View v = {.s = s};
    OmTetMesh mesh;
    OmSurface surface;
    char caption[96];
    OmStatus status;
    OM_TRY(om__study_get_mesh(s->def, ntet, &mesh));
    OM_TRY_DONE(make_half(&mesh, mesh.x, om_vec3(0, 0, 0), om_vec3(0, 0, 0), &surface));
    status = view_begin(&v, om_vec3(0.3, -1, 0.6), &surface, &s->def->body->lesion[0]);
    if (status < 0) om_surface_done(&surface);
    OM_TRY_DONE(status);
    OM_TRY_DONE(view_add(&v, &surface, 0.93, 0.74, 0.66, false));
    OM_TRY_DONE(view_add_probe(&v, om__study_probe_pose(&s->def->body->lesion[0], 0)));
    snprintf(caption, sizeof caption, "%d elements, %d vertices, the probe at first contact",
             mesh.ntet, mesh.nvert);
    status = view_end(&v, report, caption);
done:
    om_sense_scene_destroy(v.scene);
    om_tet_mesh_done(&mesh);
    return status;
}

// Repeat the run of the first lesion, on a mesh that takes about a second.
static OmStatus add_pressed(const Study* s, OmReport* report) {
    const OmStudyContactDef* def = s->def;
    StudyStage stage = {.probe = s->probe, .surface = &s->surface};
    StudyRun run = {.method = OM_PRESS_PENALTY};
    OmTetMesh mesh = {0};
    OmStatus status;
    int k = 0;
    while (k + 1 < def->nresolution && def->resolution[k + 1] < 8000) ++k;
    OM_ALLOC_DONE(run.step, OM_STUDY_MAX_STEP);
    OM_TRY_DONE(om__study_get_mesh(def, def->resolution[k], &mesh));
    OM_TRY_DONE(om__study_stage_create(def, &mesh, &stage));
    OM_TRY_DONE(add_cut(s, &stage, &def->body->lesion[0], 0, report));
    OM_TRY_DONE(om__study_press(&stage, &run));
    status =
        add_cut(s, &stage, &def->body->lesion[0], run.ndone * def->speed * def->time_step, report);
done:
    om__study_stage_done(&stage);
    om_tet_mesh_done(&mesh);
    om_free(run.step);
    return status;
}

OmStatus om__study_add_pictures(const Study* s, OmReport* report) {
    const OmStudyContactDef* def = s->def;
    om_report_heading(report, "The experiment");
    OM_TRY(add_pressed(s, report));
    OM_TRY(add_mesh(s, def->resolution[0], report));
    if (def->nresolution > 2) OM_TRY(add_mesh(s, def->resolution[def->nresolution / 2], report));
    if (def->nresolution > 1) OM_TRY(add_mesh(s, def->resolution[def->nresolution - 1], report));
    return OM_OK;
}
