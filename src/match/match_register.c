// match_register.c: many starts, coarse to fine, and a verdict on the result.
//
// Starts: turns of the given pose about the scan's centre, spread over a ball of rotation vectors, each with the given
// position of the scan and with the scan's centre on the centre of the model's surface that faces the camera. Without
// a given pose: the 24 ways to put principal axes of the scan on those of the model, and rotations spread over all
// (Alexa 2022). Each start gets a few iterations with few points, the best and distinct ones more of both.
//
// Verdict: the result is also compared with other poses. Runs from poses that are turned about the least known axis
// must come back, and no distinct candidate may fit as well. On a sphere, normals of facets make the covariance
// finite; such runs do not come back and show that the turn is not known.
#include <math.h>
#include <string.h>

#include "match/match_icp.h"
#include "omentum/match_register.h"

enum { OM__REGISTER_COOKIE = 0x2e615e };

#define NCONE 32    // turns around a given pose
#define NSPREAD 96  // rotations without a given pose
#define NAXES 24    // ways to put axes on axes
#define MAX_START (NSPREAD + NAXES)
#define NMIDDLE 8  // candidates after the coarse stage
#define NFINE 3    // candidates after the middle stage
#define NRETURN 4  // runs that must come back
#define COARSE_POINT 200
#define MIDDLE_POINT 500
#define SAME_ANGLE (4 * OM_PI / 180)    // candidates nearer than this, and
#define SAME_SHIFT 0.003                // m, than this are one
#define RETURN_ANGLE (6 * OM_PI / 180)  // turn of a run that must come back
#define MIN_SIZE 0.05                   // of the scan's radius over the model's
#define MAX_SIZE 3.0
#define AS_GOOD \
    1.25  // a cost below this many times the best is as good: errors of the model are not known better
#define DEGREE (OM_PI / 180)

OmRegisterDef om_register_default_def(void) {
    return (OmRegisterDef){.cookie = OM__REGISTER_COOKIE,
                           .pose_model_scan = om_pose_identity(),
                           .start_angle = 30 * DEGREE,
                           .start_shift = 0.03,
                           .npoint = 2000,
                           .min_overlap = 0.6,
                           .max_residual = 0.002,
                           .max_sigma_angle = 0.2 * DEGREE,
                           .max_sigma_shift = 0.0002};
}

static OmStatus check_def(const OmRegisterDef* def) {
    OM_CHECK(def->cookie == OM__REGISTER_COOKIE, OM_INVALID,
             "OmRegisterDef was not made by om_register_default_def");
    double norm = def->pose_model_scan.q.x * def->pose_model_scan.q.x +
                  def->pose_model_scan.q.y * def->pose_model_scan.q.y +
                  def->pose_model_scan.q.z * def->pose_model_scan.q.z +
                  def->pose_model_scan.q.w * def->pose_model_scan.q.w;
    OM_CHECK(om_is_finite3(def->pose_model_scan.p) && fabs(norm - 1) < 1e-6, OM_INVALID,
             "registration: pose_model_scan is no pose");
    OM_CHECK(def->start_angle >= 0 && def->start_angle <= OM_PI, OM_INVALID,
             "registration: start_angle %g must be 0 to pi", def->start_angle);
    OM_CHECK(def->start_shift >= 0 && isfinite(def->start_shift), OM_INVALID,
             "registration: start_shift %g m must not be negative", def->start_shift);
    OM_CHECK(def->npoint >= 100 && def->npoint <= 100000, OM_INVALID,
             "registration: npoint %d must be 100 to 100000", def->npoint);
    OM_CHECK(def->min_overlap >= 0.2 && def->min_overlap <= 1, OM_INVALID,
             "registration: min_overlap %g must be 0.2 to 1", def->min_overlap);
    OM_CHECK(def->max_residual > 0 && def->max_sigma_angle > 0 && def->max_sigma_shift > 0,
             OM_INVALID, "registration: max_residual, max_sigma_angle, max_sigma_shift above 0");
    return OM_OK;
}

// ---- starts -----------------------------------------------------------------------------------------

typedef struct Search {
    const OmRegisterDef* def;
    OmIcp icp;
    int nfit;
    OmIcpFit fit[2 * MAX_START];
    int nstart, niteration;
    OmIcpFit result;
    double other_angle, other_shift;  // the farthest pose that fits as well, from the result
} Search;

static double shift_between(const Search* s, OmPose a, OmPose b) {
    return om_distance(om_pose_apply(a, s->icp.center), om_pose_apply(b, s->icp.center));
}

// The pose of this rotation with the scan's centre at `at` in the model.
static OmPose pose_at(const Search* s, OmQuat q, OmVec3 at) {
    OmPose pose = {.q = om_quat_normalize(q)};
    pose.p = om_sub(at, om_quat_rotate(pose.q, s->icp.center));
    return pose;
}

static void add_start(Search* s, OmPose pose) { s->fit[s->nfit++] = (OmIcpFit){.pose = pose}; }

// Where the scan's centre goes if the camera sees the whole side of the model that faces it.
static OmVec3 facing_center(const Search* s, OmQuat q, OmVec3 to_eye_scan) {
    const OmSurface* m = s->icp.model;
    OmVec3 to_eye = om_quat_rotate(q, to_eye_scan), sum = om_vec3(0, 0, 0);
    double total = 0;
    for (int t = 0; t < m->ntri; ++t) {
        const int* v = m->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(m->x, v[0]);
        OmVec3 area = om_cross(om_sub(om_load3(m->x, v[1]), a), om_sub(om_load3(m->x, v[2]), a));
        double w = om_dot(area, to_eye);  // as the picture shows it
        if (w <= 0) continue;
        sum = om_madd(sum, w, om_load3(s->icp.tri_center, t));
        total += w;
    }
    return total > 0 ? om_scale(1 / total, sum) : s->icp.model_center;
}

// Direction from the scan to its camera, or the mean normal, or zero.
static OmVec3 eye_direction(const Search* s) {
    if (s->icp.view) return om_normalize(om_sub(s->icp.eye, s->icp.center));
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < s->icp.n; ++i) sum = om_add(sum, om_load3(s->icp.normal, i));
    return om_normalize(sum);
}

// Turns around the start: direction by the golden angle, angle such that the ball is filled evenly.
static void add_cone(Search* s) {
    OmPose start = s->def->pose_model_scan;
    OmVec3 to_eye = eye_direction(s), given = om_pose_apply(start, s->icp.center);
    add_start(s, start);
    if (s->def->start_angle == 0 && s->def->start_shift == 0) return;
    for (int k = 0; k < NCONE; ++k) {
        double z = 1 - (2 * k + 1.0) / NCONE, a = k * OM_PI * (3 - sqrt(5.0));
        double r = sqrt(fmax(0, 1 - z * z));
        double angle = s->def->start_angle * cbrt(((k * 13) % NCONE + 0.5) / NCONE);
        OmQuat turn = om_quat_axis_angle(om_vec3(r * cos(a), r * sin(a), z), angle);
        OmQuat q = om_quat_mul(turn, start.q);
        add_start(s, pose_at(s, q, given));
        OmVec3 facing = facing_center(s, q, to_eye);
        if (om_distance(facing, given) <= 2 * s->def->start_shift)
            add_start(s, pose_at(s, q, facing));
    }
}

// Axes of largest to least extent of points, as columns.
static OmMat3 principal_axes(int n, const double* x) {
    OmVec3 center = om_vec3(0, 0, 0), w;
    for (int i = 0; i < n; ++i) center = om_madd(center, 1.0 / n, om_load3(x, i));
    OmMat3 sum = om_mat3_diag(center), axes;
    sum = om_mat3_scale(0, sum);
    for (int i = 0; i < n; ++i) {
        OmVec3 d = om_sub(om_load3(x, i), center);
        sum = om_mat3_add(sum, om_mat3_outer(d, d));
    }
    om_mat3_eigen_symmetric(sum, &w, &axes);
    return axes;
}

static void add_everywhere(Search* s) {
    OmVec3 to_eye = eye_direction(s);
    OmMat3 of_scan = principal_axes(s->icp.n, s->icp.x);
    OmMat3 of_model = principal_axes(s->icp.model->nvert, s->icp.model->x);
    const OmVec3 axis[3] = {of_model.cx, of_model.cy, of_model.cz};
    for (int k = 0; k < NAXES; ++k) {  // column 0 on one of six half axes, column 1 on one of four
        int i = k % 3, j = (i + 1 + k / 3 % 2) % 3;
        OmVec3 a = om_scale(k / 6 % 2 ? 1 : -1, axis[i]), b = om_scale(k / 12 ? 1 : -1, axis[j]);
        OmMat3 r = om_mat3_mul(om_mat3_cols(a, b, om_cross(a, b)), om_mat3_transpose(of_scan));
        OmQuat q = om_quat_from_mat3(r);
        add_start(s, pose_at(s, q, facing_center(s, q, to_eye)));
    }
    for (int k = 0; k < NSPREAD; ++k) {
        double t = k + 0.5, r = sqrt(t / NSPREAD), R = sqrt(1 - t / NSPREAD);
        double a = 2 * OM_PI * t / sqrt(2.0), b = 2 * OM_PI * t / 1.533751168755204288;
        OmQuat q = {r * sin(a), r * cos(a), R * sin(b), R * cos(b)};
        add_start(s, pose_at(s, q, facing_center(s, q, to_eye)));
    }
}

// ---- coarse to fine -----------------------------------------------------------------------------------

static bool is_same(const Search* s, OmPose a, OmPose b) {
    return om_quat_angle(a.q, b.q) < SAME_ANGLE && shift_between(s, a, b) < SAME_SHIFT;
}

// Keep the best `most` distinct fits, in order of cost.
static void keep_best(Search* s, int most) {
    for (int i = 1; i < s->nfit; ++i) {
        OmIcpFit fit = s->fit[i];
        int k = i;
        for (; k > 0 && s->fit[k - 1].cost > fit.cost; --k) s->fit[k] = s->fit[k - 1];
        s->fit[k] = fit;
    }
    int nkept = 0;
    for (int i = 0; i < s->nfit && nkept < most; ++i) {
        bool is_new = true;
        for (int k = 0; k < nkept; ++k) is_new &= !is_same(s, s->fit[i].pose, s->fit[k].pose);
        if (is_new) s->fit[nkept++] = s->fit[i];
    }
    s->nfit = nkept;
}

static void run(Search* s, int npoint, int max_iteration, double tolerance, OmIcpFit* fit) {
    fit->niteration = 0;
    om__icp_run(&s->icp, npoint, max_iteration, tolerance, fit);
    s->niteration += fit->niteration;
}

// To convergence, without the triangles that are hidden at this pose.
static OmStatus run_fine(Search* s, int npoint, OmIcpFit* fit) {
    for (int round = 0; round < 3; ++round) {
        OM_TRY(om__icp_hide(&s->icp, fit->pose));
        OmPose before = fit->pose;
        run(s, npoint, 30, 1e-6, fit);
        if (shift_between(s, before, fit->pose) < 1e-5 &&
            om_quat_angle(before.q, fit->pose.q) < 1e-4)
            break;
    }
    return OM_OK;
}

static OmStatus search(Search* s) {
    if (s->def->has_start)
        add_cone(s);
    else
        add_everywhere(s);
    s->nstart = s->nfit;
    for (int i = 0; i < s->nfit; ++i) run(s, COARSE_POINT, 12, 1e-4, &s->fit[i]);
    keep_best(s, NMIDDLE);
    for (int i = 0; i < s->nfit; ++i) run(s, MIDDLE_POINT, 25, 2e-5, &s->fit[i]);
    keep_best(s, NFINE);
    for (int i = 0; i < s->nfit; ++i) OM_TRY(run_fine(s, s->icp.n, &s->fit[i]));
    keep_best(s, NFINE);
    s->result = s->fit[0];
    return OM_OK;
}

// ---- verdict ----------------------------------------------------------------------------------------

// Note a pose that fits as well as the result, as far as the noise tells.
static void compare(Search* s, const OmIcpFit* fit) {
    if (!(fit->cost <= AS_GOOD * s->result.cost)) return;
    s->other_angle = fmax(s->other_angle, om_quat_angle(fit->pose.q, s->result.pose.q));
    s->other_shift = fmax(s->other_shift, shift_between(s, fit->pose, s->result.pose));
}

// Runs from turned and shifted poses: where they end is known no better than they differ.
static OmStatus run_returns(Search* s, OmVec3 turn_axis, OmVec3 shift_axis) {
    for (int k = 0; k < NRETURN; ++k) {
        double sign = k % 2 ? 1 : -1;
        OmIcpFit fit = s->result;
        OmVec3 at = om_pose_apply(fit.pose, s->icp.center);
        OmQuat turn = om_quat_identity();
        if (k < 2)
            turn = om_quat_axis_angle(turn_axis, sign * RETURN_ANGLE);
        else
            at = om_madd(at, sign * sin(RETURN_ANGLE) * s->icp.radius, shift_axis);
        fit.pose = pose_at(s, om_quat_mul(turn, fit.pose.q), at);
        OM_TRY(run_fine(s, s->icp.n, &fit));
        compare(s, &fit);
        if (fit.cost < s->result.cost) s->result = fit;
    }
    return OM_OK;
}

static void set_residual(const Search* s, OmRegistration* out) {
    int n = 0;
    for (int i = 0; i < s->icp.n; ++i)
        if (s->icp.distance2[i] <= s->result.limit2) s->icp.sorted[n++] = fabs(s->icp.residual[i]);
    om_sort_doubles(s->icp.sorted, n);
    out->residual = n > 0 ? s->icp.sorted[n / 2] : HUGE_VAL;
}

// Largest standard deviation of a covariance and its axis; an entry that is not finite is not known.
static double find_sigma(OmMat3 covariance, OmVec3* axis) {
    OmMat3 axes;
    OmVec3 w;
    om_mat3_eigen_symmetric(covariance, &w, &axes);
    bool is_finite = om_is_finite3(w) && om_is_finite3(axes.cz);
    *axis = is_finite ? axes.cz : om_vec3(0, 0, 1);
    return is_finite ? sqrt(fmax(w.z, 0)) : HUGE_VAL;
}

static OmStatus judge(Search* s, OmRegistration* out) {
    OmMat3 turn, shift;
    OM_TRY(run_fine(s, s->icp.n, &s->result));
    OM_TRY(om__icp_covariance(&s->icp, &s->result, &turn, &shift));
    out->sigma_angle = find_sigma(turn, &out->axis_angle);
    out->sigma_shift = find_sigma(shift, &out->axis_shift);
    for (int i = 1; i < s->nfit; ++i) compare(s, &s->fit[i]);
    OM_TRY(run_returns(s, out->axis_angle, out->axis_shift));
    OM_TRY(run_fine(s, s->icp.n, &s->result));  // the pairs of the result, for the figures
    out->sigma_angle = fmax(out->sigma_angle, 0.5 * s->other_angle);
    out->sigma_shift = fmax(out->sigma_shift, 0.5 * s->other_shift);
    set_residual(s, out);
    out->pose_model_scan = s->result.pose;
    out->overlap = (double)s->result.nkept / s->icp.n;
    return OM_OK;
}

static void say(OmRegistration* out, const char* format, ...) OM_PRINTF(2, 3);
static void say(OmRegistration* out, const char* format, ...) {
    if (out->reason[0]) return;  // the first reason
    va_list args;
    va_start(args, format);
    vsnprintf(out->reason, sizeof out->reason, format, args);
    va_end(args);
    out->is_reliable = false;
}

static void give_reasons(const Search* s, OmRegistration* out) {
    const OmRegisterDef* def = s->def;
    out->is_reliable = true;
    if (out->overlap < def->min_overlap)
        say(out, "%.0f %% of the scan lie on the model; the least is %.0f %%", 100 * out->overlap,
            100 * def->min_overlap);
    if (!(out->residual <= def->max_residual))
        say(out, "the scan is %.2f mm (median) from the model; the most is %.2f mm",
            1e3 * out->residual, 1e3 * def->max_residual);
    if (s->other_angle > SAME_ANGLE || s->other_shift > SAME_SHIFT)
        say(out, "another pose, turned by %.1f degrees and shifted by %.1f mm, fits as well",
            s->other_angle / DEGREE, 1e3 * s->other_shift);
    OmVec3 a = out->axis_angle, b = out->axis_shift;
    if (!(out->sigma_angle <= def->max_sigma_angle))
        say(out, "the turn about the axis (%.2f, %.2f, %.2f) of the model is known to %.2f degrees",
            a.x, a.y, a.z, out->sigma_angle / DEGREE);
    if (!(out->sigma_shift <= def->max_sigma_shift))
        say(out, "the shift along (%.2f, %.2f, %.2f) of the model is known to %.2f mm", b.x, b.y,
            b.z, 1e3 * out->sigma_shift);
    if (!def->has_start) return;
    double angle = om_quat_angle(def->pose_model_scan.q, s->result.pose.q);
    double shift = shift_between(s, def->pose_model_scan, s->result.pose);
    if (angle > 1.2 * def->start_angle + 3 * DEGREE || shift > 1.2 * def->start_shift + 0.003)
        say(out,
            "the pose found is %.0f degrees and %.0f mm from the start; it is known to %.0f "
            "degrees and %.0f mm",
            angle / DEGREE, 1e3 * shift, def->start_angle / DEGREE, 1e3 * def->start_shift);
}

// Unit and place of the scan are checked before the search.
static bool is_plausible(const Search* s, OmRegistration* out) {
    double ratio = s->icp.radius / s->icp.model_radius;
    if (ratio > MAX_SIZE || ratio < MIN_SIZE)
        say(out, "the scan is %.3g times as large as the model; its unit may be wrong", ratio);
    double gap =
        om_distance(om_pose_apply(s->def->pose_model_scan, s->icp.center), s->icp.model_center) -
        s->icp.model_radius;
    if (s->def->has_start && gap > s->def->start_shift)
        say(out, "the scan lies %.0f mm outside the model at the start; it is known to %.0f mm",
            1e3 * gap, 1e3 * s->def->start_shift);
    return !out->reason[0];
}

static OmStatus check_input(const OmRegisterDef* def, const OmSurface* model, const OmScan* scan) {
    OM_TRY(check_def(def));
    OM_CHECK(model->ntri > 0, OM_INVALID, "registration: the model has no surface");
    OM_TRY(om_scan_check(scan));
    OM_CHECK(scan->npoint >= OM_REGISTER_MIN_POINT, OM_INVALID,
             "registration: the scan has %d points; %d are the least", scan->npoint,
             OM_REGISTER_MIN_POINT);
    return OM_OK;
}

OmStatus om_scan_register(const OmRegisterDef* def, const OmSurface* model, const OmScan* scan,
                          OmRegistration* out) {
    memset(out, 0, sizeof *out);
    double begin = om_clock_now();
    OM_TRY(check_input(def, model, scan));
    OmStatus status = OM_OK;
    Search* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    s->def = def;
    OM_TRY_DONE(om__icp_create(model, scan, def->npoint, &s->icp));
    s->icp.min_overlap = 0.8 * def->min_overlap;  // such that the overlap can fall below the limit
    s->icp.nworker = def->nworker;
    out->center = s->icp.center;
    out->pose_model_scan = def->pose_model_scan;
    out->residual = out->sigma_angle = out->sigma_shift = HUGE_VAL;
    if (is_plausible(s, out)) {
        OM_TRY_DONE(search(s));
        OM_TRY_DONE(judge(s, out));
        give_reasons(s, out);
    }
    out->nstart = s->nstart;
    out->niteration = s->niteration;
    out->ms = 1e3 * (om_clock_now() - begin);
done:
    om__icp_done(&s->icp);
    om_free(s);
    return status;
}
