// match_report.c: an update as a page, as figures, and as a mesh with arrays.
//
// A point of a cloud is drawn as an octahedron, because pictures show triangles. Attachments are seen from below: they
// lie on the side of the tissue that no camera sees.
#include <math.h>
#include <string.h>

#include "omentum/match_report.h"
#include "omentum/report.h"
#include "omentum/shape_file.h"

enum { WIDTH = 520, HEIGHT = 400, MAX_SHOWN = 4, MAX_ROW = 10 };

#define MARKER 0.0035     // m, half size of the mark where to look next
#define UNKNOWN 0.5       // uncertainty above which a vertex is drawn as unknown
#define POINT_SHARE 0.12  // size of a point over the mean edge of the surface

// ---- pictures ---------------------------------------------------------------------------------------

static OmSenseLook look_of(OmSensePart part) {
    OmSenseLook look = om_sense_look(part);
    look.gloss = 0.1;
    look.texture = OM_TEXTURE_NONE;
    look.is_checker = false;
    return look;
}

// The triangles of the twin's surface whose flag is `wanted`, at positions x of the mesh's vertices.
static OmStatus add_surface(OmSenseScene* scene, const OmMatchView* view, const double* x,
                            const unsigned char* flag, int wanted, OmSensePart part) {
    const OmSurface* s = view->surface;
    OmSurface shown;
    int n = 0, id;
    for (int t = 0; t < s->ntri; ++t) n += flag[t] == wanted;
    if (n == 0) return OM_OK;
    OM_TRY(om_surface_init(&shown, s->nvert, n));
    for (int i = 0; i < s->nvert; ++i) om_store3(shown.x, i, om_load3(x, view->surface_vert[i]));
    n = 0;
    for (int t = 0; t < s->ntri; ++t)
        if (flag[t] == wanted)
            memcpy(shown.tri_vert + 3 * (size_t)n++, s->tri_vert + 3 * (size_t)t, 3 * sizeof(int));
    OmSenseLook look = look_of(part);
    OmStatus status = om_sense_scene_add(scene, &shown, &look, &id);
    om_surface_done(&shown);
    return status;
}

// An octahedron at each point.
static OmStatus add_points(OmSenseScene* scene, int npoint, const double* x, double size,
                           OmSensePart part) {
    static const int face[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    static const double corner[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                        {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    OmSurface shown;
    int id;
    if (npoint == 0) return OM_OK;
    OM_CHECK(npoint < 10000000, OM_INVALID, "%d points are too many for a picture", npoint);
    OM_TRY(om_surface_init(&shown, 6 * npoint, 8 * npoint));
    for (int i = 0; i < npoint; ++i) {
        for (int k = 0; k < 6; ++k)
            om_store3(shown.x, 6 * i + k, om_madd(om_load3(x, i), size, om_load3(corner[k], 0)));
        for (int f = 0; f < 8; ++f)
            for (int k = 0; k < 3; ++k) shown.tri_vert[24 * i + 3 * f + k] = 6 * i + face[f][k];
    }
    OmSenseLook look = look_of(part);
    OmStatus status = om_sense_scene_add(scene, &shown, &look, &id);
    om_surface_done(&shown);
    return status;
}

// Around the twin and the points, seen along `from`.
static OmCamera frame_all(const OmMatchView* view, const double* x, int npoint, const double* point,
                          OmVec3 from, OmVec3 up) {
    OmVec3 lo = om_load3(x, view->surface_vert[0]), hi = lo;
    for (int i = 0; i < view->surface->nvert; ++i) {
        lo = om_min3(lo, om_load3(x, view->surface_vert[i]));
        hi = om_max3(hi, om_load3(x, view->surface_vert[i]));
    }
    for (int i = 0; i < npoint; ++i) {
        lo = om_min3(lo, om_load3(point, i));
        hi = om_max3(hi, om_load3(point, i));
    }
    OmVec3 center = om_lerp(lo, hi, 0.5);
    double fov = 0.45, distance = 0.85 * fmax(0.5 * om_distance(lo, hi), 1e-6) / sin(0.5 * fov);
    OmVec3 eye = om_madd(center, distance, om_normalize(from));
    return (OmCamera){.pose_world_camera = om_pose_look_at(eye, center, up),
                      .width = WIDTH,
                      .height = HEIGHT,
                      .fov = fov,
                      .near_m = 0.05 * distance,
                      .far_m = 5 * distance};
}

static OmStatus take_picture(OmSenseScene* scene, const OmCamera* camera, const char* caption,
                             OmReport* page) {
    OmPicture picture;
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;
    options.has_shadow = false;
    OM_TRY(om_sense_scene_commit(scene));
    OM_TRY(om_picture_init(&picture, WIDTH, HEIGHT, 3));
    OmStatus status = om_sense_render(scene, camera, &options, &picture);
    if (status == OM_OK) om_report_picture(page, &picture, caption);
    om_picture_done(&picture);
    return status;
}

static OmVec3 up_of(const OmSite* site) {
    return om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
}

// From beside the camera, such that displacements along its axis are seen too; or obliquely from above.
static OmVec3 side_of(const OmMatchReport* r, const OmScan* scan) {
    OmVec3 oblique = om_quat_rotate(r->site->pose_world_task.q, om_vec3(-0.8, -0.5, 0.8));
    if (!scan->has_camera || scan->npoint == 0) return oblique;
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < scan->npoint; ++i) sum = om_add(sum, om_load3(scan->x, i));
    OmVec3 from = om_sub(scan->camera.pose_world_camera.p, om_scale(1.0 / scan->npoint, sum));
    if (!(om_norm(from) > 0)) return oblique;
    from = om_normalize(from);
    OmVec3 beside = om_cross(up_of(r->site), from);
    return om_norm(beside) > 0.05 ? om_madd(from, 0.9, om_normalize(beside))
                                  : om_madd(from, 0.9, om_orthogonal(from));
}

// Has the estimate the twin at rest? Not if it was refused before.
static bool has_shape(const OmMatchEstimate* e) {
    for (size_t i = 0; e && i < 3 * (size_t)e->nnode * (size_t)e->nacquisition; ++i)
        if (e->x[i] != 0) return true;
    return false;
}

// The cloud over the twin at x.
static OmStatus add_cloud_picture(const OmMatchReport* r, int k, const double* x,
                                  const char* caption, OmReport* page) {
    const OmMatchView* view = om_match_view(r->match);
    const OmAcquisition* a = &r->acquisition[k];
    OmVec3 from = side_of(r, &a->scan), up = up_of(r->site);
    if (fabs(om_dot(om_normalize(from), up)) > 0.95) up = om_orthogonal(up);
    OmSenseScene* scene;
    unsigned char* flag = om_calloc(view->surface->ntri, 1);
    if (!flag) return OM_NO_MEMORY;
    OmStatus status = om_sense_scene_create(&scene);
    if (status == OM_OK) status = add_surface(scene, view, x, flag, 0, OM_PART_TISSUE);
    double size = POINT_SHARE * view->edge;
    if (status == OM_OK) status = add_points(scene, a->scan.npoint, a->scan.x, size, OM_PART_HELD);
    for (int g = 0; g < a->ngrasp && status == OM_OK; ++g) {
        OmVec3 tip = a->grasp[g].pose_world_now.p;
        status = add_points(scene, 1, &tip.x, 8 * size, OM_PART_TOOL);
    }
    OmCamera camera = frame_all(view, x, a->scan.npoint, a->scan.x, from, up);
    if (status == OM_OK) status = take_picture(scene, &camera, caption, page);
    om_sense_scene_destroy(scene);
    om_free(flag);
    return status;
}

// Triangles: 0 free, 1 attached, 2 unknown. All corners attached, or the mean uncertainty high. A midpoint is attached
// if both ends of its edge are, with the mean of their uncertainties.
static void flag_triangles(const OmMatchView* view, const unsigned char* attached,
                           const double* uncertainty, unsigned char* flag) {
    for (int t = 0; t < view->surface->ntri; ++t) {
        const int* s = view->surface->tri_vert + 3 * (size_t)t;
        int nheld = 0, ncandidate = 0;
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            int v = view->surface_vert[s[k]], w = v;
            if (v >= view->ncorner) {
                w = view->mid_end[2 * (v - view->ncorner) + 1];
                v = view->mid_end[2 * (v - view->ncorner)];
            }
            nheld += attached[v] && attached[w];
            sum += uncertainty ? 0.5 * (uncertainty[v] + uncertainty[w]) : 0;
            ncandidate += uncertainty && uncertainty[v] > 0 && uncertainty[w] > 0;
        }
        flag[t] = nheld == 3 ? 1 : ncandidate == 3 && sum / 3 > UNKNOWN ? 2 : 0;
    }
}

// The attached part, from below, in the rest shape.
static OmStatus add_attached_picture(const OmMatchReport* r, const unsigned char* attached,
                                     const double* uncertainty, const char* caption,
                                     OmReport* page) {
    const OmMatchView* view = om_match_view(r->match);
    const OmMatchEstimate* e = r->estimate;
    OmQuat q = r->site->pose_world_task.q;
    OmVec3 from = om_quat_rotate(q, om_vec3(-0.35, 0, -1)),
           up = om_quat_rotate(q, om_vec3(1, 0, 0));
    OmSenseScene* scene;
    unsigned char* flag;
    OM_ALLOC(flag, view->surface->ntri);
    flag_triangles(view, attached, uncertainty, flag);
    static const OmSensePart part[3] = {OM_PART_TISSUE, OM_PART_HELD, OM_PART_BOARD};
    const double* x = view->mesh->x;
    OmStatus status = om_sense_scene_create(&scene);
    for (int k = 0; k < 3 && status == OM_OK; ++k)
        status = add_surface(scene, view, x, flag, k, part[k]);
    if (status == OM_OK && uncertainty && e->has_look_next)
        status = add_points(scene, 1, &e->look_next.x, MARKER, OM_PART_ROI);
    OmCamera camera = frame_all(view, x, 0, NULL, from, up);
    if (status == OM_OK) status = take_picture(scene, &camera, caption, page);
    om_sense_scene_destroy(scene);
    om_free(flag);
    return status;
}

static OmStatus set_believed(const OmMatchReport* r, unsigned char** believed) {
    const OmTetMesh* mesh = &r->site->mesh;
    *believed = om_calloc((size_t)mesh->nvert, 1);
    if (!*believed) return OM_NO_MEMORY;
    const OmMeshSet* set = om_tet_mesh_find_set(mesh, "attachment");
    for (int i = 0; set && i < set->nvert; ++i) (*believed)[set->vert[i]] = 1;
    return OM_OK;
}

static void add_cut(int nshown, int n, OmReport* page) {
    char text[96];
    if (n <= nshown) return;
    snprintf(text, sizeof text, "Shown: the first %d of %d acquisitions.", nshown, n);
    om_report_paragraph(page, text);
}

static OmStatus add_pictures(const OmMatchReport* r, OmReport* page) {
    const OmMatchEstimate* e = r->estimate;
    const OmMatchView* view = om_match_view(r->match);
    int nshown = r->nacquisition < MAX_SHOWN ? r->nacquisition : MAX_SHOWN;
    om_report_heading(page, "The clouds over the model");
    om_report_paragraph(page, "Blue: points of the cloud. Grey: tips of the tools now.");
    add_cut(MAX_SHOWN, r->nacquisition, page);
    for (int k = 0; k < nshown; ++k) {
        char caption[256];
        snprintf(caption, sizeof caption, "%s: over the model at rest", r->name[k]);
        OM_TRY(add_cloud_picture(r, k, view->mesh->x, caption, page));
        if (!has_shape(e)) continue;
        snprintf(caption, sizeof caption, "%s: over the twin with the new attachments", r->name[k]);
        OM_TRY(add_cloud_picture(r, k, e->x + 3 * (size_t)k * (size_t)e->nnode, caption, page));
    }
    if (!has_shape(e)) return OM_OK;
    om_report_heading(page, "Attachments, seen from below");
    om_report_paragraph(page, "Dark blue: attached. Green: the clouds say little about it. Magenta "
                              "mark: where a view or a grasp would tell most.");
    unsigned char* believed;
    OM_TRY(set_believed(r, &believed));
    OmStatus status = add_attached_picture(r, believed, NULL, "Before: as believed", page);
    om_free(believed);
    if (status < 0) return status;
    return add_attached_picture(r, e->attached, e->uncertainty, "After: as estimated", page);
}

// ---- the page ---------------------------------------------------------------------------------------

typedef struct Cells {
    char text[64][96];
    const char* cell[64];
    int n;
} Cells;

static void add_cell(Cells* c, const char* format, ...) OM_PRINTF(2, 3);
static void add_cell(Cells* c, const char* format, ...) {
    if (c->n == 64) return;
    va_list args;
    va_start(args, format);
    vsnprintf(c->text[c->n], sizeof *c->text, format, args);
    va_end(args);
    c->cell[c->n] = c->text[c->n];
    ++c->n;
}

static void add_verdict(const OmMatchReport* r, OmReport* page) {
    char text[400];
    bool is_good = om_match_report_is_accepted(r);
    snprintf(text, sizeof text, "%s%s",
             is_good ? "The twin takes the new attachments." : "The twin keeps its attachments: ",
             is_good ? "" : om_match_report_reason(r));
    om_report_verdict(page, text, is_good);
    const OmMatchEstimate* e = r->estimate;
    const bool has_result = e && e->before_median > 0;
    snprintf(
        text, sizeof text,
        "Asked: which vertices of the twin are attached, so that it lies where %s measured. Came out: ",
        r->nacquisition == 1 ? "the depth camera" : "all looks of the depth camera");
    size_t n = strlen(text);
    if (has_result)
        snprintf(
            text + n, sizeof text - n,
            "half of the measured points are within %.2f mm of the twin, %.2f mm before; 90 %% within %.1f mm, "
            "%.1f mm before.",
            1e3 * e->after_median, 1e3 * e->before_median, 1e3 * e->after_p90, 1e3 * e->before_p90);
    else
        snprintf(text + n, sizeof text - n, "no estimate.");
    om_report_paragraph(page, text);
    if (!has_result) return;
    char fact[4][32];
    snprintf(fact[0], sizeof *fact, "%.2f mm", 1e3 * e->before_p90);
    snprintf(fact[1], sizeof *fact, "%.2f mm", 1e3 * e->after_p90);
    snprintf(fact[2], sizeof *fact, "%.0f %%", 100 * e->seen_share);
    int nused = 0;
    for (int k = 0; k < r->nacquisition; ++k) nused += !e->verdict || e->verdict[k].is_good;
    snprintf(fact[3], sizeof *fact, "%d of %d", nused, r->nacquisition);
    const char* const value[] = {fact[0], fact[1], fact[2], fact[3]};
    static const char* const label[] = {
        "cloud to twin before, 90 % of the points", "cloud to twin after, 90 % of the points",
        "of what may be attached is below a surface that the clouds show", "acquisitions used"};
    om_report_facts(page, value, label, 4);
}

static void add_figures(const OmMatchEstimate* e, OmReport* page) {
    static const char* const heading[] = {"", "before", "after"};
    Cells c = {.n = 0};
    add_cell(&c, "cloud to twin, median, mm");
    add_cell(&c, "%.2f", 1e3 * e->before_median);
    add_cell(&c, "%.2f", 1e3 * e->after_median);
    add_cell(&c, "cloud to twin, 90 %%, mm");
    add_cell(&c, "%.2f", 1e3 * e->before_p90);
    add_cell(&c, "%.2f", 1e3 * e->after_p90);
    om_report_heading(page, "How well the twin explains the clouds");
    om_report_table(page, heading, 3, c.cell, c.n / 3);
    char text[256];
    snprintf(text, sizeof text,
             "The clouds show the surface above %.0f %% of the area that may be attached; %.0f %% "
             "moved and is free.",
             100 * e->seen_share, 100 * e->moved_share);
    om_report_paragraph(page, text);
    if (!e->has_look_next) return;
    snprintf(
        text, sizeof text,
        "Where to look or grasp next: around (%.0f, %.0f, %.0f) mm, about which the clouds say "
        "least.",
        1e3 * e->look_next.x, 1e3 * e->look_next.y, 1e3 * e->look_next.z);
    om_report_paragraph(page, text);
}

static void add_acquisitions(const OmMatchReport* r, OmReport* page) {
    static const char* const heading[] = {"acquisition",          "points",   "tools",
                                          "registered, residual", "turn, +-", "shift, +-"};
    Cells c = {.n = 0};
    for (int k = 0; k < r->nacquisition && k < MAX_ROW; ++k) {
        const OmRegistration* g = r->registration ? &r->registration[k] : NULL;
        bool is_here = g && g->nstart > 0;
        add_cell(&c, "%s", r->name[k]);
        add_cell(&c, "%d", r->acquisition[k].scan.npoint);
        add_cell(&c, "%d", r->acquisition[k].ngrasp);
        if (is_here) {
            add_cell(&c, "%.2f mm, %.0f %% of the points", 1e3 * g->residual, 100 * g->overlap);
            add_cell(&c, "%.2f degrees", g->sigma_angle * 180 / OM_PI);
            add_cell(&c, "%.2f mm", 1e3 * g->sigma_shift);
        } else {
            add_cell(&c, "as given");
            add_cell(&c, "-");
            add_cell(&c, "-");
        }
    }
    om_report_heading(page, "Acquisitions");
    om_report_table(page, heading, 6, c.cell, c.n / 6);
    add_cut(MAX_ROW, r->nacquisition, page);
}

// What was found out about each acquisition.
static void add_verdicts(const OmMatchReport* r, OmReport* page) {
    static const char* const heading[] = {"acquisition", "used", "at rest, chi-square", "mean, mm",
                                          "remark"};
    const OmMatchEstimate* e = r->estimate;
    if (!e || !e->verdict) return;
    om_report_heading(page, "Whether each acquisition can be trusted");
    for (int k = 0; k < r->nacquisition && k < MAX_ROW; ++k) {
        const OmMatchVerdict* v = &e->verdict[k];
        char text[400];
        if (v->reason[0]) {
            snprintf(text, sizeof text, "%s: %s.", r->name[k], v->reason);
            om_report_paragraph(page, text);
        }
    }
    Cells c = {.n = 0};
    for (int k = 0; k < r->nacquisition && k < MAX_ROW; ++k) {
        const OmMatchVerdict* v = &e->verdict[k];
        add_cell(&c, "%s", r->name[k]);
        add_cell(&c, "%s", !v->is_good ? "left out" : v->is_moved ? "corrected" : "as it is");
        if (v->npatch > 0)
            add_cell(&c, "%.2f of %d patches", v->chi2, v->npatch);
        else
            add_cell(&c, "-");
        if (v->before > 0)
            add_cell(&c, "%.2f before, %.2f after", 1e3 * v->before, 1e3 * v->after);
        else
            add_cell(&c, "-");
        add_cell(&c, "%s", v->is_good && !v->is_moved ? "-" : om_match_cause_name(v->cause));
    }
    om_report_table(page, heading, 5, c.cell, c.n / 5);
    add_cut(MAX_ROW, r->nacquisition, page);
}

static void add_times(const OmMatchReport* r, OmReport* page) {
    static const char* const heading[] = {"stage", "ms"};
    const OmMatchEstimate* e = r->estimate;
    const char* const stage[] = {
        "read files",       "build the twin",    "register",        "judge the acquisitions",
        "fit to the cloud", "infer attachments", "check the result"};
    const double ms[] = {r->load_ms,          r->build_ms,       r->register_ms,
                         e ? e->judge_ms : 0, e ? e->fit_ms : 0, e ? e->infer_ms : 0,
                         e ? e->check_ms : 0};
    Cells c = {.n = 0};
    for (int i = 0; i < 7; ++i) {
        add_cell(&c, "%s", stage[i]);
        add_cell(&c, "%.1f", ms[i]);
    }
    om_report_heading(page, "Times");
    om_report_table(page, heading, 2, c.cell, c.n / 2);
}

OmStatus om_match_report_save(const OmMatchReport* report, const char* path) {
    OmReport page;
    om_report_begin(&page, "Update of the twin", report->title);
    add_verdict(report, &page);
    OmStatus status = add_pictures(report, &page);
    if (status < 0) {
        om_report_done(&page);
        return status;
    }
    if (has_shape(report->estimate)) add_figures(report->estimate, &page);
    add_acquisitions(report, &page);
    add_verdicts(report, &page);
    add_times(report, &page);
    return om_report_save(&page, path);
}

// ---- figures and mesh -------------------------------------------------------------------------------

static void put_registration(OmJson* j, const OmRegistration* g) {
    const OmPose p = g->pose_model_scan;
    const double pose[7] = {p.p.x, p.p.y, p.p.z, p.q.x, p.q.y, p.q.z, p.q.w};
    om_json_open(j, "registration", '{');
    om_json_bool(j, "is_reliable", g->is_reliable);
    om_json_string(j, "reason", g->reason);
    om_json_numbers(j, "pose_model_scan", pose, 7);
    om_json_number(j, "residual_mm", 1e3 * g->residual);
    om_json_number(j, "overlap", g->overlap);
    om_json_number(j, "sigma_angle_deg", g->sigma_angle * 180 / OM_PI);
    om_json_number(j, "sigma_shift_mm", 1e3 * g->sigma_shift);
    om_json_number(j, "ms", g->ms);
    om_json_close(j, '}');
}

static void put_verdict(OmJson* j, const OmMatchVerdict* v) {
    om_json_open(j, "verdict", '{');
    om_json_bool(j, "is_used", v->is_good);
    om_json_bool(j, "is_corrected", v->is_moved);
    om_json_string(j, "cause", om_match_cause_name(v->cause));
    om_json_string(j, "reason", v->reason);
    om_json_number(j, "chi2", v->chi2);
    om_json_number(j, "chi2_corrected", v->chi2_moved);
    om_json_integer(j, "patches", v->npatch);
    om_json_number(j, "turn_deg", v->turn * 180 / OM_PI);
    om_json_number(j, "shift_mm", 1e3 * v->shift);
    om_json_number(j, "sigma_turn_deg", v->sigma_turn * 180 / OM_PI);
    om_json_number(j, "sigma_shift_mm", 1e3 * v->sigma_shift);
    om_json_number(j, "before_mean_mm", 1e3 * v->before);
    om_json_number(j, "after_mean_mm", 1e3 * v->after);
    om_json_number(j, "share_without_depth", v->empty);
    om_json_number(j, "share_of_other_things", v->other);
    om_json_close(j, '}');
}

static void put_estimate(OmJson* j, const OmMatchEstimate* e) {
    int nattached = 0;
    for (int i = 0; i < e->nvert; ++i) nattached += e->attached[i] != 0;
    om_json_integer(j, "attached_vertices", nattached);
    om_json_number(j, "seen_share", e->seen_share);
    om_json_number(j, "moved_share", e->moved_share);
    om_json_number(j, "before_median_mm", 1e3 * e->before_median);
    om_json_number(j, "before_p90_mm", 1e3 * e->before_p90);
    om_json_number(j, "after_median_mm", 1e3 * e->after_median);
    om_json_number(j, "after_p90_mm", 1e3 * e->after_p90);
    if (e->has_look_next) {
        const double at[3] = {1e3 * e->look_next.x, 1e3 * e->look_next.y, 1e3 * e->look_next.z};
        om_json_numbers(j, "look_next_mm", at, 3);
    }
}

OmStatus om_match_report_save_json(const OmMatchReport* r, const char* path) {
    OmText text = {0};
    OmJson j = om_json_begin(&text);
    const OmMatchEstimate* e = r->estimate;
    om_json_open(&j, NULL, '{');
    om_json_string(&j, "patient", r->title);
    om_json_bool(&j, "is_accepted", om_match_report_is_accepted(r));
    om_json_string(&j, "reason", om_match_report_reason(r));
    if (has_shape(e)) put_estimate(&j, e);
    om_json_open(&j, "acquisition", '[');
    for (int k = 0; k < r->nacquisition; ++k) {
        om_json_open(&j, NULL, '{');
        om_json_string(&j, "name", r->name[k]);
        om_json_integer(&j, "points", r->acquisition[k].scan.npoint);
        om_json_integer(&j, "tools", r->acquisition[k].ngrasp);
        if (r->registration && r->registration[k].nstart > 0)
            put_registration(&j, &r->registration[k]);
        if (e && e->verdict) put_verdict(&j, &e->verdict[k]);
        om_json_close(&j, '}');
    }
    om_json_close(&j, ']');
    om_json_open(&j, "ms", '{');
    om_json_number(&j, "load", r->load_ms);
    om_json_number(&j, "build", r->build_ms);
    om_json_number(&j, "register", r->register_ms);
    om_json_number(&j, "fit", e ? e->fit_ms : 0);
    om_json_number(&j, "infer", e ? e->infer_ms : 0);
    om_json_number(&j, "check", e ? e->check_ms : 0);
    om_json_number(&j, "update", e ? e->total_ms : 0);
    om_json_close(&j, '}');
    om_json_close(&j, '}');
    return om_json_save(&j, path);
}

OmStatus om_match_report_save_mesh(const OmMatchReport* r, const char* path) {
    enum { NFIXED = 5 };
    const OmMatchEstimate* e = r->estimate;
    OM_CHECK(e, OM_INVALID, "there is no estimate to write");
    const OmTetMesh* mesh = &r->site->mesh;
    size_t n = 3 * (size_t)mesh->nvert, nacq = has_shape(e) ? (size_t)e->nacquisition : 0;
    OmStatus status = OM_OK;
    unsigned char* believed = NULL;
    double* u = NULL;
    char(*name)[32] = NULL;
    OmMeshArray* array = NULL;
    OM_TRY_DONE(set_believed(r, &believed));
    OM_ALLOC_DONE(u, n * nacq);
    OM_ALLOC_DONE(name, nacq);
    OM_ALLOC_DONE(array, NFIXED + nacq);
    array[0] = (OmMeshArray){"probability", OM_ARRAY_DOUBLE, 1, false, e->probability};
    array[1] = (OmMeshArray){"uncertainty", OM_ARRAY_DOUBLE, 1, false, e->uncertainty};
    array[2] = (OmMeshArray){"stiffness", OM_ARRAY_DOUBLE, 1, false, e->stiffness};
    array[3] = (OmMeshArray){"attached", OM_ARRAY_BYTE, 1, false, e->attached};
    array[4] = (OmMeshArray){"believed", OM_ARRAY_BYTE, 1, false, believed};
    for (size_t k = 0; k < nacq; ++k) {
        for (size_t i = 0; i < n; ++i)
            u[k * n + i] = e->x[k * 3 * (size_t)e->nnode + i] - mesh->x[i];
        snprintf(name[k], sizeof name[k], nacq == 1 ? "displacement" : "displacement_%d",
                 (int)k + 1);
        array[NFIXED + k] = (OmMeshArray){name[k], OM_ARRAY_DOUBLE, 3, false, u + k * n};
    }
    status = om_tet_mesh_save_format(mesh, path, OM_UNIT_M, OM_MESH_VTU, array, NFIXED + (int)nacq);
done:
    om_free(believed);
    om_free(u);
    om_free(name);
    om_free(array);
    return status;
}
