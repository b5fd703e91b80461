// scan_file.c: scans from files and into files, and whether a scan can show a model.
#include <string.h>

#include "omentum/scan_file.h"
#include "omentum/shape_meshing.h"
#include "scan/scan_internal.h"

#define COOKIE 0x5ca9f11eu
#define MIN_POINTS 20   // of a scan
#define MAX_RATIO 3.0   // of a scan's size to the model's: tissue is stretched and folded, not more
#define MIN_RATIO 0.02  // a smaller scan shows nothing of the model's shape
#define UNIT_RATIO 100  // from here on another unit is likely

OmScanFileDef om_scan_file_default_def(void) {
    return (OmScanFileDef){
        .cookie = COOKIE, .pose_world_file = om_pose_identity(), .up = om_vec3(0, 0, 1)};
}

static bool is_pose(OmPose p) {
    double length2 = p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z;
    return om_is_finite3(p.p) && fabs(length2 - 1) < 1e-6;
}

static OmStatus check_def(const OmScanFileDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmScanFileDef was not made by om_scan_file_default_def");
    OM_CHECK(d->frame.unit >= 0 && isfinite(d->frame.unit), OM_INVALID,
             "OmScanFileDef.frame has a unit of %g m; above 0, or 0 for that of the file",
             d->frame.unit);
    OM_CHECK(is_pose(d->pose_world_file), OM_INVALID,
             "OmScanFileDef.pose_world_file is no pose: finite, with a unit quaternion");
    OM_CHECK(!d->has_eye || om_is_finite3(d->eye), OM_INVALID, "OmScanFileDef.eye is not finite");
    OM_CHECK(om_is_finite3(d->up) && om_norm2(d->up) > 0, OM_INVALID,
             "OmScanFileDef.up is no direction");
    OM_CHECK(d->spacing >= 0 && isfinite(d->spacing), OM_INVALID,
             "OmScanFileDef.spacing is %g m; 0 or more", d->spacing);
    OM_CHECK(d->noise >= 0 && isfinite(d->noise), OM_INVALID,
             "OmScanFileDef.noise is %g m; 0 or more", d->noise);
    return OM_OK;
}

// ---- normals ------------------------------------------------------------------------------------------------------

static OmVec3 facet_normal(const OmScan* s, const int v[3]) {
    OmVec3 a = om_load3(s->x, v[0]);
    return om_cross(om_sub(om_load3(s->x, v[1]), a), om_sub(om_load3(s->x, v[2]), a));
}

// Triangles and normals turn to the camera.
static void face_camera(OmScan* s, OmVec3 eye) {
    for (int t = 0; t < s->ntri; ++t) {
        int* v = s->tri_vert + 3 * (size_t)t;
        if (om_dot(facet_normal(s, v), om_sub(eye, om_load3(s->x, v[0]))) >= 0) continue;
        int kept = v[1];
        v[1] = v[2];
        v[2] = kept;
    }
    for (int i = 0; i < s->npoint; ++i) {
        OmVec3 n = om_load3(s->normal, i);
        if (om_dot(n, om_sub(eye, om_load3(s->x, i))) < 0) om_store3(s->normal, i, om_scale(-1, n));
    }
}

// Points without a normal take that of their triangles.
static OmStatus take_triangle_normals(OmScan* s, int* ntaken) {
    const OmSurface surface = {s->npoint, s->ntri, s->x, s->tri_vert};
    double* normal = om_alloc(3 * (size_t)s->npoint, sizeof *normal);
    if (!normal) return OM_NO_MEMORY;
    om_surface_normals(&surface, normal);
    for (int i = 0; i < s->npoint; ++i) {
        OmVec3 n = om_load3(normal, i);
        if (om_norm2(om_load3(s->normal, i)) > 0 || !(fabs(om_norm(n) - 1) < 1e-9)) continue;
        om_store3(s->normal, i, n);
        ++*ntaken;
    }
    om_free(normal);
    return OM_OK;
}

static OmStatus complete_normals(const OmScanFileDef* def, OmScan* s, OmScanFileReport* report) {
    int nplane;
    if (s->ntri > 0 && def->has_eye) face_camera(s, def->eye);
    if (s->ntri > 0) OM_TRY(take_triangle_normals(s, &report->nestimated));
    OM_TRY(om__scan_estimate_normals(def->has_eye ? &def->eye : NULL, def->up, s, &nplane));
    report->nestimated += nplane;
    if (def->has_eye) face_camera(s, def->eye);
    return OM_OK;
}

// ---- loading ------------------------------------------------------------------------------------------------------

static OmStatus take_cloud(const OmScanFileDef* def, const OmPointCloud* cloud, OmScan* s) {
    OM_TRY(om_scan_init(cloud->npoint, cloud->ntri, s));
    OmPose pose = def->pose_world_file;
    for (int i = 0; i < cloud->npoint; ++i) {
        om_store3(s->x, i, om_pose_apply(pose, om_load3(cloud->x, i)));
        if (cloud->normal)
            om_store3(s->normal, i, om_quat_rotate(pose.q, om_load3(cloud->normal, i)));
    }
    memcpy(s->tri_vert, cloud->tri_vert, 3 * (size_t)cloud->ntri * sizeof *s->tri_vert);
    s->noise = def->noise;
    return OM_OK;
}

OmStatus om_scan_load(const char* path, const OmScanFileDef* def, OmScan* scan,
                      OmScanFileReport* report) {
    OmScanFileReport unused;
    if (!report) report = &unused;
    memset(scan, 0, sizeof *scan);
    *report = (OmScanFileReport){0};
    OM_TRY(check_def(def));
    OmPointCloud cloud;
    OM_TRY(om_point_cloud_load(path, def->frame, &cloud, NULL));
    report->nduplicate = cloud.nduplicate;
    report->ndropped = cloud.ndropped;
    report->npoint = cloud.npoint + cloud.nduplicate + cloud.ndropped;
    OmStatus status = take_cloud(def, &cloud, scan);
    om_point_cloud_done(&cloud);
    if (status == OM_OK && def->spacing > 0)
        status = om__scan_thin(def->spacing, scan, &report->nthinned);
    if (status == OM_OK) status = complete_normals(def, scan, report);
    if (status == OM_OK) status = om_scan_check(scan);
    if (status < 0) om_scan_done(scan);
    return status;
}

OmStatus om_scan_save(const OmScan* scan, const char* path, OmMeshFrame frame) {
    OM_TRY(om_scan_check(scan));
    const OmPointCloud cloud = {.npoint = scan->npoint,
                                .ntri = scan->ntri,
                                .x = scan->x,
                                .normal = scan->normal,
                                .tri_vert = scan->tri_vert};
    return om_point_cloud_save(&cloud, path, frame);
}

// ---- against a model ----------------------------------------------------------------------------------------------

typedef struct Box {
    OmVec3 lo, hi;
} Box;

static Box box_of(const double* x, int n) {
    Box b = {om_load3(x, 0), om_load3(x, 0)};
    for (int i = 1; i < n; ++i) {
        b.lo = om_min3(b.lo, om_load3(x, i));
        b.hi = om_max3(b.hi, om_load3(x, i));
    }
    return b;
}

static double diagonal(Box b) { return om_norm(om_sub(b.hi, b.lo)); }

static double gap_of(Box a, Box b) {
    OmVec3 zero = om_vec3(0, 0, 0);
    OmVec3 d = om_max3(om_max3(om_sub(a.lo, b.hi), om_sub(b.lo, a.hi)), zero);
    return om_norm(d);
}

static OmStatus check_size(double ratio, double scan, double model) {
    const char* what = ratio > 1 ? "larger" : "smaller";
    double factor = ratio > 1 ? ratio : 1 / ratio;
    OM_CHECK((ratio <= MAX_RATIO && ratio >= MIN_RATIO) || factor < UNIT_RATIO, OM_INVALID,
             "the scan is %.3g times %s than the model (%.3g and %.3g mm): its unit is probably "
             "another one; state the unit of the file",
             factor, what, 1e3 * scan, 1e3 * model);
    OM_CHECK(ratio <= MAX_RATIO && ratio >= MIN_RATIO, OM_INVALID,
             "the scan is %.3g times %s than the model (%.3g and %.3g mm): it shows another organ, "
             "or its background is not cut away",
             factor, what, 1e3 * scan, 1e3 * model);
    return OM_OK;
}

OmStatus om_scan_check_model(const OmScan* scan, const OmSurface* model, double reach,
                             OmScanFit* fit) {
    OmScanFit unused;
    if (!fit) fit = &unused;
    *fit = (OmScanFit){0};
    OM_CHECK(reach >= 0, OM_INVALID, "reach is %g m; 0 or more", reach);
    OM_CHECK(model->nvert > 0 && model->ntri > 0, OM_INVALID, "the model has no surface");
    OM_CHECK(scan->npoint >= MIN_POINTS, OM_INVALID,
             "the scan has %d points, and %d are needed: is the tissue in view, and are the bounds "
             "of its colours right?",
             scan->npoint, MIN_POINTS);
    Box a = box_of(scan->x, scan->npoint), b = box_of(model->x, model->nvert);
    double size = diagonal(b);
    OM_CHECK(size > 0 && isfinite(size), OM_INVALID, "the model has no extent");
    fit->ratio = diagonal(a) / size;
    fit->gap = gap_of(a, b);
    OM_TRY(check_size(fit->ratio, diagonal(a), size));
    OmVec3 p = om_lerp(a.lo, a.hi, 0.5), q = om_lerp(b.lo, b.hi, 0.5);
    OM_CHECK(fit->gap <= reach, OM_INVALID,
             "the scan lies %.1f mm away from the model, and %.1f mm are expected at most (middles "
             "at (%.0f, %.0f, %.0f) and (%.0f, %.0f, %.0f) mm): its unit, its pose or its space "
             "(RAS, LPS) is another one; state it, or register the scan",
             1e3 * fit->gap, 1e3 * reach, 1e3 * p.x, 1e3 * p.y, 1e3 * p.z, 1e3 * q.x, 1e3 * q.y,
             1e3 * q.z);
    return OM_OK;
}
