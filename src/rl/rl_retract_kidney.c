// rl_retract_kidney.c: a kidney from a file (a label volume or a closed surface) in the place of the kidney made here.
//
// The kidney is turned by its principal axes of inertia: the longest becomes y, the shortest z. Its poles bend towards
// +x, away from the endoscope, so that the hilum is behind; the anterior side is up, where the shortest axis has one.
// Then it is put on the table, the middle of its box where the middle of the kidney made here is. Tumour and p_T keep
// their place with respect to the box: across it as a share of the half-axes, p_T at its height above the top.
#include <math.h>
#include <string.h>

#include "omentum/image.h"
#include "omentum/shape_file.h"
#include "rl/rl_retract_internal.h"

#define SPACING 0.0015     // m, of the distance field of a label
#define LAYERS 6           // voxels outside, around the kidney
#define LEAST_HALF 0.010   // m, of the box of a kidney
#define LARGEST_HALF 0.10  // m

static bool is_volume(const char* path) {
    static const char* const known[] = {"nii", "nii.gz", "hdr", "img", "nrrd", "nhdr"};
    char extension[16];
    om_path_extension(path, extension, sizeof extension);
    for (size_t k = 0; k < sizeof known / sizeof *known; ++k)
        if (strcmp(extension, known[k]) == 0) return true;
    return false;
}

// The largest part of a label. Where the border of the volume cuts it, it is closed by a plane.
static OmStatus mask_of(const OmVolume* volume, const char* path, int label, OmMask* mask) {
    const int* dim = volume->grid.dim;
    OM_TRY(om_mask_init(mask, dim[0], dim[1], dim[2]));
    mask->grid = volume->grid;
    for (size_t n = 0; n < om_volume_count(volume); ++n)
        mask->inside[n] = om_volume_value(volume, n) == label;
    OM_CHECK(om_mask_count(mask) > 0, OM_INVALID,
             "%s has no voxel of label %d; kidney_label chooses another one", path, label);
    OM_TRY(om_mask_keep_parts(mask, 6, 0, NULL, NULL));
    OM_TRY(om_mask_crop(mask, LAYERS));
    return om_mask_fill_holes(mask);
}

static OmStatus load_label(const char* path, int label, OmSurface* surface) {
    OmVolume volume = {0};
    OmMask mask = {0};
    OmSdf sdf = {0};
    OmStatus status;
    OmSdfDef def = om_sdf_default_def(SPACING);
    OM_TRY_DONE(om_volume_load(path, &volume));
    OM_TRY_DONE(mask_of(&volume, path, label, &mask));
    status = om_sdf_from_mask(&mask, &def, &sdf);
    if (status >= 0) status = om_surface_from_sdf(&sdf, 0, surface);
    if (status == OM_INVALID)
        status = om_error_prefix(status, "%s: label %d is no kidney", path, label);
done:
    om_sdf_done(&sdf);
    om_mask_done(&mask);
    om_volume_done(&volume);
    return status;
}

static OmStatus load_surface(const char* path, OmSurface* surface) {
    OM_TRY(om_surface_load_frame(path, (OmMeshFrame){0}, 0, surface, NULL));
    OmStatus status = om_surface_require_closed(surface);
    return status < 0 ? om_error_prefix(status, "%s", path) : status;
}

// ---- the place --------------------------------------------------------------------------------------

static void corners_of(const OmSurface* s, int tri, OmVec3 p[3]) {
    for (int c = 0; c < 3; ++c) p[c] = om_load3(s->x, s->tri_vert[3 * (ptrdiff_t)tri + c]);
}

// Centroid and second moments of the solid: sums over the tetrahedra from the origin to each triangle.
static OmStatus measure(const OmSurface* s, OmVec3* centroid, OmMat3* moment) {
    double volume = 0;
    OmVec3 sum = {0, 0, 0}, origin = om_load3(s->x, 0);
    OmMat3 square = om_mat3_scale(0, om_mat3_identity());
    for (int k = 0; k < s->ntri; ++k) {
        OmVec3 p[3];
        corners_of(s, k, p);
        for (int c = 0; c < 3; ++c) p[c] = om_sub(p[c], origin);
        double v = om_dot(p[0], om_cross(p[1], p[2])) / 6;
        OmVec3 all = om_add(p[0], om_add(p[1], p[2]));
        OmMat3 outer = om_mat3_outer(all, all);
        for (int c = 0; c < 3; ++c) outer = om_mat3_add(outer, om_mat3_outer(p[c], p[c]));
        volume += v;
        sum = om_madd(sum, v / 4, all);
        square = om_mat3_add(square, om_mat3_scale(v / 20, outer));
    }
    OM_CHECK(fabs(volume) > 1e-18, OM_INVALID, "the kidney has no volume");
    OmVec3 mean = om_scale(1 / volume, sum);
    *moment = om_mat3_add(om_mat3_scale(1 / volume, square),
                          om_mat3_scale(-1, om_mat3_outer(mean, mean)));
    *centroid = om_add(origin, mean);
    return OM_OK;
}

// Covariance over the surface of x and the square of y, along two axes: positive where the poles bend towards +x.
static double bend_of(const OmSurface* s, OmVec3 centroid, OmVec3 ex, OmVec3 ey) {
    double area = 0, x_sum = 0, y_sum = 0, both = 0;
    for (int k = 0; k < s->ntri; ++k) {
        OmVec3 p[3];
        corners_of(s, k, p);
        double a = om_norm(om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0])));
        OmVec3 middle = om_scale(1.0 / 3, om_add(p[0], om_add(p[1], p[2])));
        double x = om_dot(om_sub(middle, centroid), ex), y = om_dot(om_sub(middle, centroid), ey);
        area += a, x_sum += a * x, y_sum += a * y * y, both += a * x * y * y;
    }
    return both / area - x_sum / area * (y_sum / area);  // a solid with a volume has an area
}

static void find_axes(const OmSurface* s, OmVec3 centroid, OmMat3 moment, OmMat3* axes) {
    OmVec3 w;
    OmMat3 v;
    om_mat3_eigen_symmetric(moment, &w, &v);  // ascending: short, middle, long
    OmVec3 up = v.cx, ex = v.cy, ey = v.cz;
    if (up.y < 0) up = om_scale(-1, up);  // RAS: +y is anterior
    if (bend_of(s, centroid, ex, ey) < 0) ex = om_scale(-1, ex);
    *axes = om_mat3_cols(ex, om_cross(up, ex), up);
}

static OmStatus place(OmSurface* s, OmVec3 middle, OmRlKidney* box) {
    OmVec3 centroid = {0, 0, 0}, lo = {INFINITY, INFINITY, INFINITY}, hi = om_scale(-1, lo);
    OmMat3 moment, axes;
    OM_TRY(measure(s, &centroid, &moment));
    find_axes(s, centroid, moment, &axes);
    for (int i = 0; i < s->nvert; ++i) {
        OmVec3 p = om_mat3_apply_transposed(axes, om_sub(om_load3(s->x, i), centroid));
        om_store3(s->x, i, p);
        lo = om_min3(lo, p), hi = om_max3(hi, p);
    }
    box->half = om_scale(0.5, om_sub(hi, lo));
    box->center = om_vec3(middle.x, middle.y, box->half.z);
    OmVec3 shift = om_sub(box->center, om_lerp(lo, hi, 0.5));
    for (int i = 0; i < s->nvert; ++i) om_store3(s->x, i, om_add(om_load3(s->x, i), shift));
    double least = fmin(box->half.x, fmin(box->half.y, box->half.z));
    double most = fmax(box->half.x, fmax(box->half.y, box->half.z));
    OM_CHECK(
        least >= LEAST_HALF && most <= LARGEST_HALF, OM_INVALID,
        "the kidney measures %.3g x %.3g x %.3g mm; each must be from %g to %g mm. Is the file "
        "in millimetres?",
        2e3 * box->half.x, 2e3 * box->half.y, 2e3 * box->half.z, 2e3 * LEAST_HALF,
        2e3 * LARGEST_HALF);
    return OM_OK;
}

OmStatus om__rl_kidney_load(const OmRlRetractDef* def, OmSurface* surface, OmRlKidney* box) {
    const char* path = def->kidney_file;
    OmSurface made = {0};
    OM_CHECK(om_path_exists(path), OM_IO, "task retract: kidney: %s: no such file", path);
    OmStatus status =
        is_volume(path) ? load_label(path, def->kidney_label, &made) : load_surface(path, &made);
    if (status >= 0) {
        status = place(&made, def->kidney.center, box);
        if (status < 0) status = om_error_prefix(status, "%s", path);
    }
    if (status >= 0)
        *surface = made;
    else
        om_surface_done(&made);
    return status;
}

void om__rl_kidney_use(const OmRlKidney* box, OmRlRetractDef* def) {
    const OmRlKidney* k = &def->kidney;
    double x = (def->tumour_x - k->center.x) / k->half.x;  // half-axes are at least 10 mm
    double y = (def->tumour_y - k->center.y) / k->half.y;
    double above = def->target.z - (k->center.z + k->half.z);
    def->tumour_x = box->center.x + x * box->half.x;
    def->tumour_y = box->center.y + y * box->half.y;
    def->target.z = fmin(2 * box->half.z + above, def->workspace_hi.z);
    def->kidney = (OmRlKidney){.center = box->center, .half = box->half};
}
