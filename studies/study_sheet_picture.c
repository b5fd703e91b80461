// study_sheet_picture.c: pictures of the lifted sheet: the model's surface, its points and the camera's points.
//
// The model's points are the vertices of its upper side. Their positions at rest form a grid, whose squares
// are drawn as the surface.
#include <math.h>
#include <string.h>

#include "studies/study_sheet_internal.h"
#include "studies/study_table.h"

#define WIDTH 560
#define HEIGHT 400
#define DOT 0.0007   // m, half-axis of a drawn point
#define SIDE 0.090   // m, of the sheet
#define BAND 0.0025  // m, half width of the strip around the middle line

// ---- shapes ---------------------------------------------------------------------------------------

// An octahedron at each of n points.
static OmStatus make_dots(int n, const double* x, OmSurface* dots) {
    static const int corner[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                     {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    OM_TRY(om_surface_init(dots, 6 * n, 8 * n));
    for (int i = 0; i < n; ++i) {
        for (int c = 0; c < 6; ++c) {
            double v[3] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
            v[c / 2] += c % 2 ? -DOT : DOT;
            memcpy(dots->x + 3 * (6 * i + c), v, sizeof v);
        }
        for (int t = 0; t < 8; ++t)
            for (int c = 0; c < 3; ++c) dots->tri_vert[3 * (8 * i + t) + c] = 6 * i + corner[t][c];
    }
    return OM_OK;
}

// Squares between the points that are neighbours at rest.
static OmStatus make_sheet(const Sheet* s, int n, const double* rest, const double* x,
                           OmSurface* sheet) {
    int side = s->def->cells + 1, ntri = 0;
    int* at;
    OM_ALLOC(at, side * side);
    for (int i = 0; i < side * side; ++i) at[i] = -1;
    for (int i = 0; i < n; ++i) {
        long a = lround((rest[3 * i] / SIDE + 0.5) * s->def->cells);
        long b = lround((rest[3 * i + 1] / SIDE + 0.5) * s->def->cells);
        if (a >= 0 && a < side && b >= 0 && b < side) at[a + side * b] = i;
    }
    OmStatus status = om_surface_init(sheet, n, 2 * (side - 1) * (side - 1));
    for (int b = 0; status == OM_OK && b + 1 < side; ++b)
        for (int a = 0; a + 1 < side; ++a) {
            const int *p = at + a + side * b, *q = p + side;
            if (p[0] < 0 || p[1] < 0 || q[0] < 0 || q[1] < 0) continue;
            const int two[6] = {p[0], p[1], q[1], p[0], q[1], q[0]};
            memcpy(sheet->tri_vert + 3 * ntri, two, sizeof two);
            ntri += 2;
        }
    om_free(at);
    if (status < 0) return status;
    sheet->ntri = ntri;
    memcpy(sheet->x, x, 3 * (size_t)n * sizeof *x);
    return OM_OK;
}

// ---- one picture ----------------------------------------------------------------------------------

static OmStatus add(OmSenseScene* scene, OmSurface* surface, OmSenseLook look) {
    int id;
    OmStatus status = om_sense_scene_add(scene, surface, &look, &id);
    om_surface_done(surface);
    return status;
}

static OmStatus render(const Sheet* s, OmSenseScene* scene, const char* caption, OmReport* report) {
    const OmCamera camera = {
        .pose_world_camera =
            om_pose_look_at(om_vec3(0.14, -0.16, 0.09), om_vec3(0.005, 0, 0.01), om_vec3(0, 0, 1)),
        .width = WIDTH,
        .height = HEIGHT,
        .fov = 25 * OM_PI / 180,
        .near_m = 0.01,
        .far_m = 10};
    return om__report_render(report, scene, &camera, s->def->nworker, caption);
}

typedef struct Shown {
    int npoint, ncloud;
    double *rest, *x, *cloud;  // the model's points at rest and lifted; the camera's
} Shown;

static OmStatus add_picture(const Sheet* s, const Shown* v, const char* caption, OmReport* report) {
    OmSenseScene* scene;
    OmSurface surface;
    OmStatus status;
    OM_TRY(om_sense_scene_create(&scene));
    OM_TRY_DONE(make_sheet(s, v->npoint, v->rest, v->x, &surface));
    OM_TRY_DONE(add(scene, &surface, (OmSenseLook){.red = 0.93, .green = 0.78, .blue = 0.5}));
    OM_TRY_DONE(make_dots(v->npoint, v->x, &surface));
    OM_TRY_DONE(add(scene, &surface, (OmSenseLook){.red = 0.8, .green = 0.35, .blue = 0.1}));
    OM_TRY_DONE(make_dots(v->ncloud, v->cloud, &surface));
    OM_TRY_DONE(add(scene, &surface, (OmSenseLook){.red = 0.1, .green = 0.3, .blue = 0.8}));
    status = render(s, scene, caption, report);
done:
    om_sense_scene_destroy(scene);
    return status;
}

// ---- the middle line ------------------------------------------------------------------------------

typedef struct Line {  // points near y = 0, by x
    int n;
    double *x, *z;  // mm
} Line;

static OmStatus make_line(int n, const double* p, Line* line) {
    OM_ALLOC(line->x, 2 * (size_t)n + 1);
    line->z = line->x + n;
    for (int i = 0; i < n; ++i) {
        if (fabs(p[3 * i + 1]) > BAND) continue;
        double x = 1e3 * p[3 * i], z = 1e3 * p[3 * i + 2];
        int k = line->n++;
        for (; k > 0 && line->x[k - 1] > x; --k)
            line->x[k] = line->x[k - 1], line->z[k] = line->z[k - 1];
        line->x[k] = x, line->z[k] = z;
    }
    return OM_OK;
}

static OmStatus add_lines(const Shown* thesis, const Shown* found, const char* title,
                          OmReport* report) {
    Line line[3] = {{0}};
    OmStatus status;
    OM_TRY_DONE(make_line(found->ncloud, found->cloud, &line[0]));
    OM_TRY_DONE(make_line(thesis->npoint, thesis->x, &line[1]));
    OM_TRY_DONE(make_line(found->npoint, found->x, &line[2]));
    static const char* const name[3] = {"camera", "thesis's parameters", "found"};
    OmReportChart chart = {.title = title,
                           .x_label = "from the fixed side to the free one, mm",
                           .y_label = "height, mm",
                           .nseries = 3};
    for (int k = 0; k < 3; ++k)
        chart.series[k] = (OmReportSeries){name[k], line[k].x, line[k].z, line[k].n, false};
    om_report_chart(report, &chart);
done:
    for (int k = 0; k < 3; ++k) om_free(line[k].x);
    return status;
}

// ---- scenes -------------------------------------------------------------------------------------------

static void shown_done(Shown* v) {
    om_free(v->rest);
    om_free(v->x);
    om_free(v->cloud);
}

// Lift the model with these parameters along a path: the last lift in `x`, and its cloud.
static OmStatus make_shown(const Sheet* s, const double* param, int pinch, Shown* v) {
    int nseen;
    const OmCalibrationSeen* seen = om_calibration_problem_seen(s->all, &nseen);
    v->npoint = om_calibration_problem_npoint(s->all);
    size_t n = 3 * (size_t)v->npoint;
    OM_ALLOC(v->rest, n);
    OM_ALLOC(v->x, n * OM_STUDY_NLIFT);
    OM_ALLOC(v->cloud, 3 * (size_t)nseen);
    OmStatus status = om_calibration_run_points(s->all, param, SHEET_REST, v->rest);
    if (status == OM_OK) status = om_calibration_run_points(s->all, param, pinch, v->x);
    OM_TRY(status);
    OM_CHECK(status == OM_OK, OM_INVALID, "pinch %d cannot be shown", pinch + 1);
    memcpy(v->x, v->x + n * (OM_STUDY_NLIFT - 1), n * sizeof *v->x);
    for (int i = 0; i < nseen; ++i)
        if (seen[i].path == pinch && seen[i].level == OM_STUDY_NLIFT - 1)
            om_store3(v->cloud, v->ncloud++, seen[i].x);
    return OM_OK;
}

static OmStatus add_pinch(const Sheet* s, int pinch, OmReport* report) {
    Shown thesis = {0}, found = {0};
    const SheetFold* f = &s->fold[0];
    char text[200];
    int last = OM_STUDY_NLIFT - 1;
    OmStatus status;
    OM_TRY_DONE(make_shown(s, s->thesis, pinch, &thesis));
    OM_TRY_DONE(make_shown(s, f->result.best, pinch, &found));
    snprintf(text, sizeof text, "pinch %d%s, 30 mm, thesis's parameters: %.2f mm", pinch + 1,
             pinch == f->left_out ? " (unseen)" : "", 1e3 * s->thesis_error.at[pinch][last]);
    OM_TRY_DONE(add_picture(s, &thesis, text, report));
    snprintf(text, sizeof text, "pinch %d%s, 30 mm, found: %.2f mm", pinch + 1,
             pinch == f->left_out ? " (unseen)" : "", 1e3 * f->error.at[pinch][last]);
    OM_TRY_DONE(add_picture(s, &found, text, report));
    if (pinch == 0)
        status = add_lines(&thesis, &found, "Pinch 1 lifted by 30 mm, middle line", report);
done:
    shown_done(&thesis);
    shown_done(&found);
    return status;
}

OmStatus om__study_sheet_add_pictures(const Sheet* s, OmReport* report) {
    om__report_section(
        report, "The sheet lifted",
        "Orange: the points of the model and the surface through them; blue: the points "
        "that the camera saw.");
    OM_TRY(add_pinch(s, 1, report));
    OM_TRY(add_pinch(s, 3, report));
    return add_pinch(s, 0, report);
}
