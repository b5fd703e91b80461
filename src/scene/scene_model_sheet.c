// scene_model_sheet.c: a sheet of fat over one side of an organ, hiding a tumour on its surface.
//
//            n (up)          The sheet is where these are negative, as their largest, with round rims:
//        ____|____             gap - s                  outside the organ (s: distance to its closing)
//      /  t  |     \           s - gap - t              not thicker than t
//     |  _tumour_   |          outline(u, v)            within a rounded rectangle seen along n
//     | /        \  |          -(x - centroid).n - wrap above a plane: the far side stays free
//     |/  organ   \ |
//
// u is the organ's longest axis normal to n, v = n x u. Outline and plane are evaluated at the foot of a
// point on the organ, so that the rim is normal to it. The sheet ends where the image ends. Fat bridges
// gaps narrower than itself, such as the hilum of a kidney, so the sheet lies on the closing of the organ
// by a ball. The tumour is a low dome on the organ; the organ's distance field is rebuilt with it, so that
// the sheet lies on the tumour too.
#include <math.h>
#include <string.h>

#include "scene/scene_model_internal.h"

#define COARSE 0.7  // edges per thickness, above which a lattice loses much of a sheet

typedef struct Sheet {
    const OmModelDef* def;
    const OmSdf* base;  // base of the sheet: the closing of organ and tumour
    const OmBody* body;
    OmMat3 image_inverse;  // of the axes of the image
    OmVec3 n, u, v;        // normal of the side, long axis, short axis
    OmVec3 center;         // of the outline, any height along n
    OmVec3 centroid;       // of the organ
    double half[2];        // m, along u and v
    double corner;         // m
    double level;          // of the current mesh; it only moves top and rims
} Sheet;

typedef struct Bump {  // union of the organ and a dome on its surface
    const OmSdf* organ;
    OmVec3 center;
    double radius, height;
} Bump;

// ---- the frame of the sheet -----------------------------------------------------------------------------

// Extent of the inside nodes along a direction, relative to the centroid.
static void extent_along(const OmBody* body, OmVec3 direction, double* lo, double* hi) {
    const OmSdf* sdf = &body->sdf;
    size_t n = 0;
    *lo = HUGE_VAL;
    *hi = -HUGE_VAL;
    for (int k = 0; k < sdf->grid.dim[2]; k++) {
        for (int j = 0; j < sdf->grid.dim[1]; j++) {
            for (int i = 0; i < sdf->grid.dim[0]; i++, n++) {
                if (sdf->d[n] >= 0) continue;
                OmVec3 x = om_grid_point(&sdf->grid, i, j, k);
                double d = om_dot(om_sub(x, body->centroid), direction);
                *lo = fmin(*lo, d);
                *hi = fmax(*hi, d);
            }
        }
    }
}

// The longest axis normal to n: the largest principal axis of the inside nodes projected along n.
static OmVec3 longest_axis(const OmBody* body, OmVec3 n) {
    const OmSdf* sdf = &body->sdf;
    OmMat3 sum = om_mat3_scale(0, om_mat3_identity());
    size_t node = 0;
    for (int k = 0; k < sdf->grid.dim[2]; k++) {
        for (int j = 0; j < sdf->grid.dim[1]; j++) {
            for (int i = 0; i < sdf->grid.dim[0]; i++, node++) {
                if (sdf->d[node] >= 0) continue;
                OmVec3 x = om_grid_point(&sdf->grid, i, j, k);
                OmVec3 d = om_sub(x, body->centroid);
                d = om_madd(d, -om_dot(d, n), n);
                sum = om_mat3_add(sum, om_mat3_outer(d, d));
            }
        }
    }
    OmVec3 w;
    OmMat3 axes;
    om_mat3_eigen_symmetric(sum, &w, &axes);
    OmVec3 u = om_madd(axes.cz, -om_dot(axes.cz, n), n);
    if (om_norm(u) < 0.5) u = om_orthogonal(n);  // no extent normal to n
    u = om_normalize(u);
    // choose the sign by a rule that is the same for every organ: up the body, else to the front, else to the right
    double sign = fabs(u.z) > 0.3 ? u.z : fabs(u.y) > 0.3 ? u.y : u.x;
    return sign < 0 ? om_scale(-1, u) : u;
}

static OmStatus sheet_frame(const OmModelDef* def, const OmBody* body, Sheet* sheet) {
    const OmSheetDef* s = &def->sheet;
    bool is_left = body->centroid.x < body->center_image.x;
    OmStatus status = om_model_direction(s->side, is_left, &sheet->n);
    if (status < 0) return om_error_prefix(status, "sheet side");
    sheet->def = def;
    sheet->body = body;
    if (body->has_volume) OM_TRY(om_mat3_inverse(body->volume.grid.axis, &sheet->image_inverse));
    sheet->u = longest_axis(body, sheet->n);
    sheet->v = om_cross(sheet->n, sheet->u);
    sheet->centroid = sheet->center = body->centroid;
    const double given[2] = {s->half_length, s->half_width};
    const OmVec3 axis[2] = {sheet->u, sheet->v};
    for (int a = 0; a < 2; a++) {
        double lo, hi;
        extent_along(body, axis[a], &lo, &hi);
        sheet->center = om_madd(sheet->center, 0.5 * (lo + hi), axis[a]);
        sheet->half[a] = given[a] > 0 ? given[a] : 0.8 * 0.5 * (hi - lo);
    }
    double smaller = fmin(sheet->half[0], sheet->half[1]);
    sheet->corner = s->corner > 0 ? fmin(s->corner, smaller) : 0.5 * smaller;
    OM_CHECK(smaller > def->edge, OM_INVALID,
             "sheet: half its width is %.3g mm, less than an edge of %.3g mm", smaller * 1e3,
             def->edge * 1e3);
    return OM_OK;
}

// ---- implicit functions -----------------------------------------------------------------------------------

// Distance to a rounded rectangle in the plane normal to n.
static double outline_distance(const Sheet* sheet, OmVec3 p) {
    OmVec3 d = om_sub(p, sheet->center);
    double x = fabs(om_dot(d, sheet->u)) - (sheet->half[0] - sheet->corner);
    double y = fabs(om_dot(d, sheet->v)) - (sheet->half[1] - sheet->corner);
    double outside = sqrt(fmax(x, 0) * fmax(x, 0) + fmax(y, 0) * fmax(y, 0));
    return outside + fmin(fmax(x, y), 0) - sheet->corner;
}

// Distance of x beyond the border of the image, which is reduced by a voxel: the organ is unknown there.
static double image_distance(const Sheet* sheet, OmVec3 x) {
    const OmVolume* v = &sheet->body->volume;
    if (!sheet->body->has_volume) return -HUGE_VAL;
    OmVec3 q = om_mat3_apply(sheet->image_inverse, om_sub(x, v->grid.origin));
    const double at[3] = {q.x, q.y, q.z};
    const double h[3] = {om_norm(v->grid.axis.cx), om_norm(v->grid.axis.cy),
                         om_norm(v->grid.axis.cz)};
    double beyond = -HUGE_VAL;
    for (int a = 0; a < 3; a++) {
        beyond = fmax(beyond, h[a] * fmax(at[a] - (v->grid.dim[a] - 1.5), 0.5 - at[a]));
    }
    return beyond;
}

// Distance beyond the sheet's rim, along the surface. It is evaluated at the foot of p, so that the rim is
// normal to the organ, and divided by the slope at which the surface crosses the outline.
static double side_distance(const Sheet* sheet, OmVec3 p) {
    OmVec3 g;
    double d = om_sdf_eval(sheet->base, p, &g);
    g = om_normalize(g);
    OmVec3 foot = om_madd(p, -d, g);
    double facing = om_dot(g, sheet->n), steep = sqrt(fmax(0, 1 - facing * facing));
    double below = -om_dot(om_sub(foot, sheet->centroid), sheet->n) - sheet->def->sheet.wrap;
    double side =
        fmax(outline_distance(sheet, foot) / fmax(facing, 0.35), below / fmax(steep, 0.35));
    return fmax(side, image_distance(sheet, foot));
}

// The larger of a and b, with the edge between the two zero levels rounded to a radius.
static double round_max(double a, double b, double radius) {
    double x = a + radius, y = b + radius;
    if (x <= 0 || y <= 0) return fmax(a, b);
    return sqrt(x * x + y * y) - radius;
}

static double sheet_fn(void* ctx, OmVec3 p) {
    const Sheet* sheet = ctx;
    const OmSheetDef* s = &sheet->def->sheet;
    double d = om_sdf_eval(sheet->base, p, NULL);
    double inner = s->gap - d + sheet->level;
    double outer = d - s->gap - s->thickness;
    return round_max(fmax(inner, outer), side_distance(sheet, p), 0.5 * s->thickness);
}

// A dome of height h sqrt(1 - (r / radius)^2) over the organ's own surface.
static double bump_fn(void* ctx, OmVec3 p) {
    const Bump* bump = ctx;
    double d = om_sdf_eval(bump->organ, p, NULL);
    if (bump->height <= 0) return d;
    double across = om_distance(p, bump->center) / bump->radius, up = fmax(d, 0) / bump->height;
    return fmin(d, bump->height * (sqrt(across * across + up * up) - 1));
}

// Distance of p to the organ dilated by `radius`; positive outside.
typedef struct Grown {
    const OmSdf* sdf;
    double radius;
} Grown;

static double grown_fn(void* ctx, OmVec3 p) {
    const Grown* grown = ctx;
    return om_sdf_eval(grown->sdf, p, NULL) - grown->radius;
}

// Closing by a ball: dilate, compute the distance to the dilated organ, erode.
static OmStatus close_sdf(const OmSdf* in, double radius, OmSdf* out) {
    OmSdfDef def = om_sdf_default_def(in->grid.spacing);
    Grown grown = {in, radius};
    OmVec3 lo, hi;
    om_sdf_bounds(in, &lo, &hi);
    def.margin = 0;
    OM_TRY(om_sdf_from_function(grown_fn, &grown, lo, hi, &def, out));
    size_t n = om_grid_count(out->grid.dim);
    for (size_t i = 0; i < n; i++) out->d[i] += (float)radius;
    return OM_OK;
}

// ---- the tumour -----------------------------------------------------------------------------------------------

// The point of the organ's surface that faces n, is not in a hollow that the sheet bridges, and is
// nearest to the wanted place as seen along n.
static OmStatus place_tumour(const OmBody* body, const OmSurface* organ, const Sheet* sheet,
                             OmVec3* center, OmVec3* normal) {
    const OmSheetDef* s = &sheet->def->sheet;
    OM_CHECK(s->tumour_radius > 0 && s->tumour_radius < 0.2, OM_INVALID,
             "tumour radius: %g mm is outside 0 to 200 mm", s->tumour_radius * 1e3);
    OM_CHECK(s->tumour_height >= 0 && s->tumour_height <= s->tumour_radius, OM_INVALID,
             "tumour height: %g mm must be between 0 and its radius, %g mm", s->tumour_height * 1e3,
             s->tumour_radius * 1e3);
    OmVec3 over = om_madd(sheet->center, s->tumour_shift[0], sheet->u);
    over = om_madd(over, s->tumour_shift[1], sheet->v);
    OM_CHECK(outline_distance(sheet, over) < 0, OM_INVALID,
             "the tumour, shifted by %g and %g mm, does not lie under the sheet",
             s->tumour_shift[0] * 1e3, s->tumour_shift[1] * 1e3);
    double best = HUGE_VAL;
    for (int v = 0; v < organ->nvert; v++) {
        OmVec3 x = om_load3(organ->x, v), g, d = om_sub(x, over);
        if (side_distance(sheet, x) >= 0) continue;
        if (om_sdf_eval(sheet->base, x, NULL) < -0.5 * body->sdf.grid.spacing) continue;
        om_sdf_eval(&body->sdf, x, &g);
        g = om_normalize(g);
        double across = om_norm2(om_madd(d, -om_dot(d, sheet->n), sheet->n));
        if (om_dot(g, sheet->n) < 0.5 || across >= best) continue;
        best = across;
        *center = x;
        *normal = g;
    }
    OM_CHECK(best < HUGE_VAL, OM_INVALID, "no part of the organ under the sheet faces its side, %s",
             s->side);
    return OM_OK;
}

// Rebuild the organ's distance field with the tumour's dome.
static OmStatus grow_tumour(const OmBody* body, const OmSheetDef* s, OmVec3 center, OmSdf* out) {
    OmSdfDef def = om_sdf_default_def(body->sdf.grid.spacing);
    Bump bump = {&body->sdf, center, s->tumour_radius, s->tumour_height};
    OmVec3 lo, hi;
    om_sdf_bounds(&body->sdf, &lo, &hi);
    def.margin = 0;
    return om_sdf_from_function(bump_fn, &bump, lo, hi, &def, out);
}

// Points of the organ's surface within the tumour's radius, on the side of its normal.
static OmStatus sample_roi(const OmSheetDef* s, OmVec3 center, OmVec3 normal, OmPatient* patient) {
    OmStatus status = OM_OK;
    const OmSurface* organ = &patient->organ;
    OM_CHECK(s->nroi > 0 && s->nroi <= 100000, OM_INVALID, "%d points of the tumour; 1 to 100000",
             s->nroi);
    unsigned char* is_used = om_calloc((size_t)organ->ntri, 1);
    if (!is_used) return OM_NO_MEMORY;
    int nused = 0;
    for (int t = 0; t < organ->ntri; t++) {
        const int* v = &organ->tri_vert[3 * (size_t)t];
        OmVec3 a = om_load3(organ->x, v[0]), b = om_load3(organ->x, v[1]),
               c = om_load3(organ->x, v[2]);
        OmVec3 middle = om_scale(1.0 / 3, om_add(a, om_add(b, c)));
        OmVec3 nt = om_cross(om_sub(b, a), om_sub(c, a));
        if (om_distance(middle, center) > s->tumour_radius || om_dot(nt, normal) <= 0) continue;
        is_used[t] = 1;
        nused++;
    }
    OM_CHECK_DONE(nused > 0, OM_INVALID,
                  "a tumour of radius %g mm is smaller than the surface's triangles",
                  s->tumour_radius * 1e3);
    OM_ALLOC_DONE(patient->roi_point, 3 * (size_t)s->nroi);
    OM_ALLOC_DONE(patient->roi_normal, 3 * (size_t)s->nroi);
    OmRng rng = om_rng_init(1, 0);
    OM_TRY_DONE(
        om_surface_sample(organ, is_used, s->nroi, &rng, patient->roi_point, patient->roi_normal));
    patient->nroi = s->nroi;
    patient->roi_center = center;
    patient->roi_radius = s->tumour_radius;
done:
    om_free(is_used);
    return status;
}

// ---- sets ------------------------------------------------------------------------------------------------------

// Sort boundary vertices by the face of the sheet; those of the rims belong to the border.
static OmStatus add_face_sets(const Sheet* sheet, OmTetMesh* mesh, const int* boundary,
                              int nboundary) {
    const OmSheetDef* s = &sheet->def->sheet;
    static const char* const name[3] = {"underside", "top", "border"};
    int* list = om_alloc((size_t)nboundary, sizeof *list);
    if (!list) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    for (int face = 0; face < 3 && status == OM_OK; face++) {
        int n = 0;
        for (int i = 0; i < nboundary; i++) {
            OmVec3 x = om_load3(mesh->x, boundary[i]);
            double d = om_sdf_eval(sheet->base, x, NULL) - s->gap;
            double inner = -d, outer = d - s->thickness, side = side_distance(sheet, x);
            bool is_in = face == 0   ? inner >= outer && inner >= side
                         : face == 1 ? outer > inner && outer >= side
                                     : side > -0.5 * sheet->def->edge;
            if (is_in) list[n++] = boundary[i];
        }
        status = om_tet_mesh_add_set(mesh, name[face], list, n);
    }
    om_free(list);
    return status;
}

static OmStatus add_attachments(const Sheet* sheet, bool is_left, OmTetMesh* mesh,
                                const OmSurface* surface, const int* surface_vert) {
    static const OmAttachDef usual = {"border", "medial", 0.25, 0, 0};
    const OmSheetDef* s = &sheet->def->sheet;
    const OmAttachTask task = {s->attach, s->nattach, &usual, sheet->n, is_left};
    return om__model_attach(&task, mesh, surface, surface_vert);
}

static OmStatus add_sets(const Sheet* sheet, bool is_left, OmTetMesh* mesh) {
    OmStatus status = OM_OK;
    OmSurface surface = {0};
    int* surface_vert = NULL;
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &surface, &surface_vert));
    OM_TRY_DONE(add_face_sets(sheet, mesh, surface_vert, surface.nvert));
    OM_TRY_DONE(add_attachments(sheet, is_left, mesh, &surface, surface_vert));
done:
    om_surface_done(&surface);
    om_free(surface_vert);
    return status;
}

// ---- the whole sheet ------------------------------------------------------------------------------------------

// The sheet is meshed where the organ's field is, and judged on a grid of a third of an edge.
static OmStatus mesh_sheet(Sheet* sheet, const OmSdf* organ, const OmProgress* progress,
                           OmPatient* patient, OmModelReport* report) {
    const OmBody* body = sheet->body;
    OmSdf fine;
    OmSdfDef def = om_sdf_default_def(sheet->def->edge / 3);
    def.is_raw = true;
    OmMeshTask task = {.fn = sheet_fn,
                       .ctx = sheet,
                       .field = &fine,
                       .voxel = body->has_volume ? body->voxel : body->sdf.grid.spacing,
                       .level = &sheet->level,
                       .edge = sheet->def->edge,
                       .refine = sheet->def->refine,
                       .nworker = sheet->def->nworker};
    om_sdf_bounds(organ, &task.lo, &task.hi);
    OM_TRY(om_sdf_from_function(sheet_fn, sheet, task.lo, task.hi, &def, &fine));
    const OmStatus status = om__mesh_sheet(sheet->def, &task, progress, patient, report);
    om_sdf_done(&fine);
    return status;
}

OmStatus om__sheet_check(const OmModelDef* def, OmModelReport* report) {
    const OmSheetDef* s = &def->sheet;
    OM_CHECK(s->thickness > 0 && s->thickness < 0.2, OM_INVALID,
             "sheet thickness: %g mm is outside 0 to 200 mm", s->thickness * 1e3);
    OM_CHECK(s->gap >= 0 && s->gap < 0.05, OM_INVALID, "sheet gap: %g mm is outside 0 to 50 mm",
             s->gap * 1e3);
    OM_CHECK(s->bridge >= 0 && s->bridge <= 0.1, OM_INVALID,
             "sheet bridge: %g mm is outside 0 to 100 mm", s->bridge * 1e3);
    OM_CHECK(s->nattach >= 0 && s->nattach <= OM_MAX_ATTACH, OM_INVALID,
             "%d attachments; at most %d", s->nattach, OM_MAX_ATTACH);
    OM_CHECK(isfinite(s->wrap) && isfinite(s->half_length) && isfinite(s->half_width) &&
                 isfinite(s->corner) && isfinite(s->tumour_shift[0]) &&
                 isfinite(s->tumour_shift[1]),
             OM_INVALID, "sheet: a length is not finite");
    if (def->edge > COARSE * s->thickness) {
        om__model_warn(report,
                       "the sheet is %.3g mm thick, hardly more than an edge of %.3g mm: use edges "
                       "below %.2g mm",
                       s->thickness * 1e3, def->edge * 1e3, COARSE * s->thickness * 1e3);
    }
    return OM_OK;
}

OmStatus om__sheet_build(const OmModelDef* def, const OmBody* body, const OmProgress* progress,
                         OmPatient* patient, OmModelReport* report) {
    OmStatus status = OM_OK;
    OmSdf base = {0}, organ = {0};
    Sheet sheet = {.base = &base};
    OmVec3 center = sheet.n, normal = sheet.n;
    OM_TRY(sheet_frame(def, body, &sheet));
    OM_TRY_DONE(om_progress_report(progress, "tumour", 0, 1));
    OM_TRY_DONE(close_sdf(&body->sdf, def->sheet.bridge, &base));
    OM_TRY_DONE(place_tumour(body, &patient->organ, &sheet, &center, &normal));
    OM_TRY_DONE(grow_tumour(body, &def->sheet, center, &organ));
    om_sdf_done(&base);
    OM_TRY_DONE(close_sdf(&organ, def->sheet.bridge, &base));
    om_surface_done(&patient->organ);
    OM_TRY_DONE(om_surface_from_sdf(&organ, 0, &patient->organ));
    OM_TRY_DONE(sample_roi(&def->sheet, om_madd(center, def->sheet.tumour_height, normal), normal,
                           patient));
    patient->up = sheet.n;
    if (outline_distance(&sheet, center) > -def->sheet.tumour_radius) {
        om__model_warn(report, "the tumour reaches beyond the sheet's outline");
    }

    OM_TRY_DONE(mesh_sheet(&sheet, &organ, progress, patient, report));
    bool is_left = body->centroid.x < body->center_image.x;
    OM_TRY_DONE(add_sets(&sheet, is_left, &patient->mesh));
done:
    om_sdf_done(&base);
    om_sdf_done(&organ);
    return status;
}
