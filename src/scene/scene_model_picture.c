// scene_model_picture.c: pictures of a patient model for its page.
//
// A model with a sheet is seen along the covered side and obliquely: the organ with the region of interest, the
// tissue over it with its attachments, a side view, and a cut through both that shows the elements. An organ alone is
// seen from the front, from below and from its left. At last a mesh of a label is coloured by its distance from the
// label, with the parts of the label that it does not reach. Each picture has marks of direction and a bar.
#include <string.h>

#include "scene/scene_model_internal.h"
#include "scene/scene_model_marks.h"

enum { WIDTH = 440, HEIGHT = 340 };

// Of the mesh: NEAR to FAR by the distance from the label, below a tenth, a third and one mean edge, and above.
enum { ORGAN, ROI, TISSUE, HELD, CUT_ORGAN, CUT_TISSUE, NEAR, FAIR, OFF, FAR, MISSED, NOBJECT };

typedef struct Stage {
    OmSenseScene* scene;
    int id[NOBJECT];  // -1: not in the scene
    OmVec3 center;
    double radius;            // radius of a ball around the centre that contains all objects, m
    OmVec3 front, top, side;  // unit, orthogonal: towards the viewer, up, sideways
} Stage;

static OmSenseLook look_of(int object) {
    static const OmSensePart part[NOBJECT] = {
        [ORGAN] = OM_PART_ORGAN, [ROI] = OM_PART_ROI,         [TISSUE] = OM_PART_TISSUE,
        [HELD] = OM_PART_HELD,   [CUT_ORGAN] = OM_PART_ORGAN, [CUT_TISSUE] = OM_PART_TISSUE};
    static const double color[NOBJECT][3] = {[NEAR] = {0.75, 0.75, 0.72},
                                             [FAIR] = {0.45, 0.65, 0.80},
                                             [OFF] = {0.95, 0.65, 0.15},
                                             [FAR] = {0.80, 0.15, 0.10},
                                             [MISSED] = {0.60, 0.05, 0.45}};
    OmSenseLook look = om_sense_look(part[object]);
    if (object >= NEAR) {
        look.red = color[object][0];
        look.green = color[object][1];
        look.blue = color[object][2];
    }
    look.gloss = 0.2;
    look.texture = OM_TEXTURE_NONE;
    look.is_smooth = object == ORGAN || object == ROI;
    return look;
}

// ---- objects ------------------------------------------------------------------------------------------------

// Add the triangles of a surface with this flag.
static OmStatus add_part(Stage* stage, int object, const OmSurface* surface,
                         const unsigned char* flag, int wanted) {
    OmSurface part;
    int n = 0;
    for (int t = 0; t < surface->ntri; t++) n += flag[t] == wanted;
    if (n == 0) return OM_OK;
    OM_TRY(om_surface_init(&part, surface->nvert, n));
    memcpy(part.x, surface->x, 3 * sizeof(double) * (size_t)surface->nvert);
    n = 0;
    for (int t = 0; t < surface->ntri; t++) {
        if (flag[t] != wanted) continue;
        memcpy(&part.tri_vert[3 * n++], &surface->tri_vert[3 * t], 3 * sizeof(int));
    }
    const OmSenseLook look = look_of(object);
    OmStatus status = om_sense_scene_add(stage->scene, &part, &look, &stage->id[object]);
    om_surface_done(&part);
    return status;
}

static OmVec3 triangle_center(const OmSurface* s, int t) {
    const int* v = &s->tri_vert[3 * t];
    return om_scale(
        1.0 / 3, om_add(om_load3(s->x, v[0]), om_add(om_load3(s->x, v[1]), om_load3(s->x, v[2]))));
}

static bool is_cut_away(const Stage* stage, OmVec3 p) {
    return om_dot(om_sub(p, stage->center), stage->side) > 0;
}

static OmStatus add_organ(const OmPatient* p, Stage* stage) {
    const OmSurface* organ = &p->organ;
    unsigned char* flag;
    OM_ALLOC(flag, (size_t)organ->ntri);
    for (int t = 0; t < organ->ntri; t++) {
        flag[t] =
            p->nroi > 0 && om_distance(triangle_center(organ, t), p->roi_center) < p->roi_radius;
    }
    OmStatus status = add_part(stage, ORGAN, organ, flag, 0);
    if (status == OM_OK) status = add_part(stage, ROI, organ, flag, 1);
    for (int t = 0; t < organ->ntri; t++) flag[t] = is_cut_away(stage, triangle_center(organ, t));
    if (status == OM_OK) status = add_part(stage, CUT_ORGAN, organ, flag, 0);
    om_free(flag);
    return status;
}

// The tissue's boundary; triangles between three attached vertices are an object of their own.
static OmStatus add_tissue(const OmPatient* p, Stage* stage) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    int* vert = NULL;
    unsigned char *is_held = NULL, *flag = NULL;
    OM_TRY_DONE(om_tet_mesh_boundary(&p->mesh, &boundary, &vert));
    OM_CALLOC_DONE(is_held, (size_t)p->mesh.nvert);
    OM_ALLOC_DONE(flag, (size_t)boundary.ntri);
    const OmMeshSet* held = om_tet_mesh_find_set(&p->mesh, "attachment");
    for (int i = 0; held && i < held->nvert; i++) is_held[held->vert[i]] = 1;
    for (int t = 0; t < boundary.ntri; t++) {
        const int* v = &boundary.tri_vert[3 * t];
        flag[t] = is_held[vert[v[0]]] && is_held[vert[v[1]]] && is_held[vert[v[2]]];
    }
    OM_TRY_DONE(add_part(stage, TISSUE, &boundary, flag, 0));
    OM_TRY_DONE(add_part(stage, HELD, &boundary, flag, 1));
done:
    om_surface_done(&boundary);
    om_free(vert);
    om_free(is_held);
    om_free(flag);
    return status;
}

// The elements behind the plane of the cut, uncut.
static OmStatus add_cut_tissue(const OmPatient* p, Stage* stage) {
    OmTetMesh half;
    OmSurface boundary = {0};
    OM_TRY(om_tet_mesh_init(&half, p->mesh.nvert, p->mesh.ntet));
    memcpy(half.x, p->mesh.x, 3 * sizeof(double) * (size_t)p->mesh.nvert);
    half.ntet = 0;
    for (int e = 0; e < p->mesh.ntet; e++) {
        const int* v = &p->mesh.tet_vert[4 * (size_t)e];
        OmVec3 sum = om_vec3(0, 0, 0);
        for (int c = 0; c < 4; c++) sum = om_add(sum, om_load3(p->mesh.x, v[c]));
        if (is_cut_away(stage, om_scale(0.25, sum))) continue;
        memcpy(&half.tet_vert[4 * (size_t)half.ntet++], v, 4 * sizeof(int));
    }
    OmStatus status = half.ntet ? om_tet_mesh_boundary(&half, &boundary, NULL) : OM_OK;
    if (status == OM_OK && boundary.ntri > 0) {
        const OmSenseLook look = look_of(CUT_TISSUE);
        status = om_sense_scene_add(stage->scene, &boundary, &look, &stage->id[CUT_TISSUE]);
    }
    om_surface_done(&boundary);
    om_tet_mesh_done(&half);
    return status;
}

// The mesh's boundary by its distance from the label, and what of the label is far from it.
static OmStatus add_distance(const OmPatient* p, Stage* stage) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    OmMeshQuality quality;
    int* vert = NULL;
    unsigned char* kind = NULL;
    OM_TRY_DONE(om_tet_mesh_quality(&p->mesh, &quality));
    OM_TRY_DONE(om_tet_mesh_boundary(&p->mesh, &boundary, &vert));
    const int ntri = boundary.ntri > p->missed.ntri ? boundary.ntri : p->missed.ntri;
    OM_CALLOC_DONE(kind, (size_t)ntri);
    for (int t = 0; t < boundary.ntri; t++) {
        const int* v = &boundary.tri_vert[3 * t];
        double gap = 0;
        for (int c = 0; c < 3; c++) gap = fmax(gap, p->gap[vert[v[c]]] / quality.edge_mean);
        kind[t] = (unsigned char)((gap >= 0.1) + (gap >= 1.0 / 3) + (gap >= 1));
    }
    for (int k = 0; k < 4; k++) OM_TRY_DONE(add_part(stage, NEAR + k, &boundary, kind, k));
    memset(kind, 0, (size_t)ntri);
    OM_TRY_DONE(add_part(stage, MISSED, &p->missed, kind, 0));
done:
    om_surface_done(&boundary);
    om_free(vert);
    om_free(kind);
    return status;
}

// ---- views ---------------------------------------------------------------------------------------------------

static void place_stage(const OmPatient* p, Stage* stage) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    const double* x[3] = {p->mesh.x, p->organ.x, p->missed.x};
    const int nvert[3] = {p->mesh.nvert, p->organ.nvert, p->missed.nvert};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < nvert[k]; i++) {
            lo = om_min3(lo, om_load3(x[k], i));
            hi = om_max3(hi, om_load3(x[k], i));
        }
    }
    stage->center = om_scale(0.5, om_add(lo, hi));
    stage->radius = fmax(1e-6, 0.5 * om_distance(lo, hi));
    stage->front = p->up;
    OmVec3 up = fabs(p->up.z) < 0.8 ? om_vec3(0, 0, 1) : om_vec3(0, 1, 0);
    stage->top = om_normalize(om_madd(up, -om_dot(up, stage->front), stage->front));
    stage->side = om_cross(stage->top, stage->front);
}

static OmModelView make_view(const Stage* stage, OmVec3 from, OmVec3 up, unsigned shown,
                             const char* caption) {
    const double fov = 0.45, distance = 0.8 * stage->radius / sin(0.5 * fov);
    OmVec3 eye = om_madd(stage->center, distance, om_normalize(from));
    OmModelView view = {
        {om_pose_look_at(eye, stage->center, up), WIDTH, HEIGHT, fov, 0.1 * distance, 3 * distance},
        distance,
        shown,
        caption};
    return view;
}

static void make_views(const OmPatient* p, const Stage* stage, OmModelView view[OM_MODEL_VIEWS]) {
    const OmVec3 f = stage->front, t = stage->top, s = stage->side;
    const OmVec3 oblique = om_madd(om_madd(f, 0.35, t), 0.55, s);
    const unsigned organ = 1u << ORGAN | 1u << ROI, tissue = 1u << TISSUE | 1u << HELD;
    const unsigned cut = 1u << CUT_ORGAN | 1u << CUT_TISSUE;
    if (p->organ.ntri > 0) {
        view[0] =
            make_view(stage, oblique, t, organ, "The organ, the region of interest in magenta");
        view[1] = make_view(stage, oblique, t, organ | tissue,
                            "The tissue over it, held where it is dark blue");
        view[2] = make_view(stage, om_madd(s, 0.1, f), f, organ | tissue,
                            "From the side, the covered side up");
        view[3] = make_view(stage, om_madd(s, 0.1, f), f, cut,
                            "Cut open: elements of the tissue and the hollow surface of the organ");
        return;
    }
    const OmVec3 front = om_vec3(0, 1, 0), below = om_vec3(0, 0, -1), left = om_vec3(-1, 0, 0);
    const OmVec3 above = om_vec3(0, 0, 1);
    view[0] = make_view(stage, front, above, tissue, "From the front");
    view[1] = make_view(stage, below, front, tissue, "From below, as an axial slice is seen");
    view[2] = make_view(stage, left, above, tissue, "From the patient's left");
    view[3] = make_view(stage, om_madd(s, 0.2, f), t, cut, "Cut open");
}

void om__model_views(const OmPatient* patient, OmModelView view[OM_MODEL_VIEWS]) {
    Stage stage;
    place_stage(patient, &stage);
    make_views(patient, &stage, view);
}

// ---- pictures ------------------------------------------------------------------------------------------------

static OmStatus take_picture(Stage* stage, const OmModelView* view, OmReport* page) {
    for (int i = 0; i < NOBJECT; i++) {
        if (stage->id[i] >= 0)
            om_sense_scene_show(stage->scene, stage->id[i], view->shown >> i & 1);
    }
    OM_TRY(om_sense_scene_commit(stage->scene));
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;
    options.has_shadow = false;  // shapes are clearer without shadows
    OmPicture picture;
    OM_TRY(om_picture_init(&picture, WIDTH, HEIGHT, 3));
    OmStatus status = om_sense_render(stage->scene, &view->camera, &options, &picture);
    if (status == OM_OK) {
        const OmViewMarks marks = om__view_marks(&view->camera, view->distance);
        om__draw_marks(&picture, &marks);
        om_report_picture(page, &picture, view->caption);
    }
    om_picture_done(&picture);
    return status;
}

// Where the mesh leaves the label, from two sides.
static OmStatus take_distance(const OmPatient* p, Stage* stage, OmReport* page) {
    const unsigned shown = 1u << NEAR | 1u << FAIR | 1u << OFF | 1u << FAR | 1u << MISSED;
    const OmVec3 f = stage->front, t = stage->top, s = stage->side;
    if (!p->gap) return OM_OK;
    for (int side = 1; side >= -1; side -= 2) {
        const OmVec3 from = om_scale(side, om_madd(om_madd(f, 0.35, t), 0.55, s));
        const OmModelView view = make_view(
            stage, from, t, shown,
            side > 0
                ? "Distance of the mesh from the label, in mean edges: grey below 0.1, blue below a "
                  "third, orange below 1, red above; violet: the label where the mesh is far"
                : "The same from the other side");
        OM_TRY(take_picture(stage, &view, page));
    }
    return OM_OK;
}

static OmStatus take_pictures(const OmPatient* p, Stage* stage, OmReport* page) {
    OmModelView view[OM_MODEL_VIEWS];
    make_views(p, stage, view);
    for (int i = 0; i < OM_MODEL_VIEWS; i++) OM_TRY(take_picture(stage, &view[i], page));
    OM_TRY(take_distance(p, stage, page));
    om_report_paragraph(
        page, "Letters at the borders: right, left, anterior, posterior, superior, inferior of "
              "the patient, the nearest first. Bars hold in the plane through the middle.");
    return OM_OK;
}

OmStatus om_patient_add_pictures(const OmPatient* patient, struct OmReport* page) {
    Stage stage;
    for (int i = 0; i < NOBJECT; i++) stage.id[i] = -1;
    place_stage(patient, &stage);
    OM_TRY(om_sense_scene_create(&stage.scene));
    OmStatus status = add_organ(patient, &stage);
    if (status == OM_OK) status = add_tissue(patient, &stage);
    if (status == OM_OK) status = add_cut_tissue(patient, &stage);
    if (status == OM_OK && patient->gap) status = add_distance(patient, &stage);
    if (status == OM_OK) status = take_pictures(patient, &stage, page);
    om_sense_scene_destroy(stage.scene);
    return status;
}
