// match_judge.c: does a scan of tissue at rest fit the model, and if not, what is wrong with it?
//
// Samples are the points of the scan and, of pictures, pixels of board and organ. At a pose of the camera each has a
// distance e from the surface it should lie on; sigma joins the stated noise with the error of the model. Samples are
// gathered in patches of the surface, and chi-square is the mean over patches of (mean e)^2 over its variance: errors
// of the model are the same within a patch, so that patches, not samples, are independent.
//
// Of lifted tissue only what the tool has not moved can fit. There each sample counts min(e^2 / sigma^2, LIMIT^2), and
// the pose that fits most samples is looked for.
//
// A small error is corrected: a motion of the camera, or another focal length or scale. Of larger ones match_cause.c
// finds the cause.
#include "match/match_judge.h"

#include <string.h>

#include "match/match_icp.h"

#define MODEL 0.0002       // m, error of the model's surface at rest
#define SAG 0.5            // ... and of what its own weight moves it, this part: modulus, supports
#define PIXEL 0.0005       // m, noise of a single pixel and error of board or organ
#define LIMIT 3.0          // standard deviations: farther samples do not fit
#define MOST_TISSUE 100.0  // of chi-square, that a patch counts at most
#define MOST_OTHER 9.0     // ... of one that is no tissue
#define PATCH 0.015        // m, size of a patch
#define MAX_PATCH 4096     // of a hash table
#define MAX_PIXEL 500      // pixels that are samples
#define REACH 0.05         // m: farther from every surface is the same as this
#define PRIOR_TURN 0.05    // rad, standard deviation of a rigid error before the scan
#define PRIOR_SHIFT 0.01   // m
#define MAX_ITERATION 30
#define MAX_TURN 0.1   // rad, of one iteration
#define CHI2 1.0       // chi-square of a scan that fits
#define CHI2_SURE 0.5  // ... of one that need not be corrected; right ones have 0.2 to 0.4
#define LEAST 0.2  // share of the samples of lifted tissue that must lie where the rest shape is
#define GAIN 0.12  // share of the samples that a motion must explain besides
#define SMALL_TURN 0.018    // rad, of a motion that is corrected
#define SMALL_SHIFT 0.003   // m
#define MORE_UNKNOWNS 0.05  // that a motion must fit better than a focal length
#define SMALL_RATIO 0.06    // of the logarithm of a focal length or a scale that is corrected

OmStatus om__match_judge_begin(OmMatch* m, MatchJudge* j) {
    const double* rest;
    *j = (MatchJudge){.match = m, .max_turn = SMALL_TURN, .max_shift = SMALL_SHIFT};
    OM_TRY(om__match_rest_shape(m, &rest));
    OM_TRY(om_surface_tree_create(&m->surface, &j->tree));
    OM_ALLOC(j->patch, MAX_PATCH);
    OM_ALLOC(j->xs, 3 * (size_t)m->surface.nvert);
    OM_ALLOC(j->use, m->surface.ntri);
    OM_ALLOC(j->normal, 3 * (size_t)m->surface.ntri);
    OM_ALLOC(j->center_of, 3 * (size_t)m->surface.ntri);
    OM_ALLOC(j->sag, m->surface.ntri);
    OmVec3 middle = om_vec3(0, 0, 0);
    const int nvert = m->surface.nvert;
    for (int i = 0; i < nvert; ++i) {
        om_store3(j->xs, i, om_load3(rest, m->surface_vert[i]));
        middle = om_madd(middle, 1.0 / nvert, om_load3(j->xs, i));
    }
    for (int i = 0; i < nvert; ++i) j->size += om_distance(om_load3(j->xs, i), middle) / nvert;
    om_surface_tree_move(j->tree, j->xs);
    for (int t = 0; t < m->surface.ntri; ++t) {
        const int* v = m->surface.tri_vert + 3 * (size_t)t;
        OmVec3 p[3];
        j->sag[t] = 0;
        for (int k = 0; k < 3; ++k) {
            p[k] = om_load3(j->xs, v[k]);
            j->sag[t] += om_distance(p[k], om_load3(m->surface.x, v[k])) / 3;
        }
        OmVec3 n = om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0]));
        om_store3(j->normal, t, om_normalize(n));
        om_store3(j->center_of, t, om_scale(1.0 / 3, om_add(p[0], om_add(p[1], p[2]))));
    }
    return OM_OK;
}

void om__match_judge_done(MatchJudge* j) {
    om_surface_tree_destroy(j->tree);
    om_free(j->patch);
    om_free(j->xs);
    om_free(j->use);
    om_free(j->normal);
    om_free(j->center_of);
    om_free(j->sag);
    om_free(j->sample);
}

// ---- samples -----------------------------------------------------------------------------------------------------

static OmStatus add_sample(MatchJudge* j, OmVec3 p, double noise, bool is_tissue) {
    if (j->nsample == j->capacity) {
        int capacity = 2 * j->capacity + 256;
        MatchSample* more =
            om_realloc(j->sample, (size_t)j->capacity, (size_t)capacity, sizeof *more);
        if (!more) return OM_NO_MEMORY;
        j->sample = more;
        j->capacity = capacity;
    }
    j->sample[j->nsample++] = (MatchSample){.p = p, .noise = noise, .is_tissue = is_tissue};
    return OM_OK;
}

OmStatus om__judge_add_pixels(MatchJudge* j, OmScanPixel class, bool is_tissue) {
    const OmScan* scan = j->scan;
    const OmCamera* c = &scan->camera;
    OmPose pose_camera_world = om_pose_inverse(c->pose_world_camera);
    int n = 0, npixel = c->width * c->height;
    for (int pass = 0, step = 1, k = 0; pass < 2; ++pass) {
        for (int i = 0; i < npixel; ++i) {
            int u = i % c->width, v = i / c->width;
            if (scan->pixel[i] != class || !(scan->depth[i] > 0)) continue;
            if (pass == 0) ++n;
            if (pass == 0 || k++ % step != 0) continue;
            OmVec3 ray = om_quat_rotate(pose_camera_world.q, om_camera_ray(c, u + 0.5, v + 0.5));
            OmVec3 p = om_scale((double)scan->depth[i] / ray.z, ray);
            OM_TRY(add_sample(j, p, PIXEL, is_tissue));
        }
        step = n / MAX_PIXEL + 1;
    }
    return OM_OK;
}

bool om__judge_has_pixels(const OmScan* scan) {
    return scan->has_camera && scan->pixel && scan->depth;
}

void om__judge_set_center(MatchJudge* j) {
    j->center = om_vec3(0, 0, 0);
    j->radius = 0;
    for (int i = 0; i < j->nsample; ++i)
        j->center = om_madd(j->center, 1.0 / j->nsample, j->sample[i].p);
    for (int i = 0; i < j->nsample; ++i)
        j->radius += om_distance(j->sample[i].p, j->center) / j->nsample;
    j->radius = fmax(j->radius, 1e-3);
}

OmStatus om__judge_take_samples(MatchJudge* j) {
    const OmScan* scan = j->scan;
    OmPose to_camera =
        scan->has_camera ? om_pose_inverse(scan->camera.pose_world_camera) : om_pose_identity();
    j->nsample = 0;
    for (int i = 0; i < scan->npoint; ++i)
        OM_TRY(add_sample(j, om_pose_apply(to_camera, om_load3(scan->x, i)), scan->noise, true));
    const OmSite* site = j->match->def.site;
    if (om__judge_has_pixels(scan) && (site->has_ground || site->has_organ))
        OM_TRY(om__judge_add_pixels(j, OM_SCAN_OTHER, false));
    om__judge_set_center(j);
    return OM_OK;
}

// ---- distances ----------------------------------------------------------------------------------------------------

MatchGuess om__judge_as_stated(const OmScan* scan) {
    return (MatchGuess){.pose =
                            scan->has_camera ? scan->camera.pose_world_camera : om_pose_identity(),
                        .focal = 1,
                        .scale = 1};
}

OmVec3 om__judge_place_of(const MatchGuess* g, OmVec3 p) {
    if (g->is_range) p = om_scale(p.z / fmax(om_norm(p), 1e-9), p);
    p = om_vec3(p.x * g->focal / g->scale, p.y * g->focal / g->scale, p.z / g->scale);
    return om_pose_apply(g->pose, p);
}

static int patch_at(OmVec3 x, int kind) {
    int a = (int)floor(x.x / PATCH), b = (int)floor(x.y / PATCH), c = (int)floor(x.z / PATCH);
    unsigned h = (unsigned)a * 73856093u ^ (unsigned)b * 19349663u ^ (unsigned)c * 83492791u;
    return (int)((h ^ (unsigned)kind * 2654435761u) % MAX_PATCH);
}

// Distance of x from the tissue's surface; beside its border the distance from the border.
static double find_tissue(const MatchJudge* j, OmVec3 x, OmVec3* n, int* patch, double* model) {
    OmSurfacePoint q = {.tri = -1};
    *patch = -1;
    *model = MODEL;
    if (!om_surface_tree_find(j->tree, x, j->use, REACH, &q)) return REACH;
    *model = hypot(MODEL, SAG * j->sag[q.tri]);
    OmVec3 d = om_sub(x, q.x), normal = om_load3(j->normal, q.tri);
    double e = om_dot(d, normal);
    *n = normal;
    if (fabs(e) < 0.7 * q.distance) {
        e = q.distance;
        *n = om_scale(1 / q.distance, d);
    }
    *patch = patch_at(q.x, 0);
    return e;
}

static double find_fixed(const MatchJudge* j, OmVec3 x, OmVec3* n, int* patch) {
    double gap = om__match_gap(j->match, x, n);
    *patch = patch_at(om_madd(x, -gap, *n), 1);
    return fmin(fmax(gap, -REACH), REACH);
}

// Triangles that face the camera, or without one up, away from board and organ.
static void mark_facing(MatchJudge* j, const MatchGuess* g) {
    const OmVec3 up = om_quat_rotate(j->match->def.site->pose_world_task.q, om_vec3(0, 0, 1));
    for (int t = 0; t < j->match->surface.ntri; ++t) {
        OmVec3 ray = j->scan->has_camera ? om_sub(g->pose.p, om_load3(j->center_of, t)) : up;
        j->use[t] = om_dot(ray, om_load3(j->normal, t)) > 0;
    }
}

double om__judge_measure(MatchJudge* j, const MatchGuess* g, double* explained) {
    double sum = 0;
    int nfit = 0;
    mark_facing(j, g);
    for (int i = 0; i < j->nsample; ++i) {
        MatchSample* s = &j->sample[i];
        OmVec3 x = om__judge_place_of(g, s->p), n = om_vec3(0, 0, 0);
        const OmSite* site = j->match->def.site;
        bool has_fixed = site->has_ground || site->has_organ;
        s->n = n;
        s->e = REACH;
        s->patch = -1;
        s->model = MODEL;
        if (s->is_tissue || j->is_any) s->e = find_tissue(j, x, &s->n, &s->patch, &s->model);
        if (!s->is_tissue && has_fixed) {
            int patch;
            double e = find_fixed(j, x, &n, &patch);
            if (!j->is_any || fabs(e) < fabs(s->e)) {
                s->e = e;
                s->n = n;
                s->patch = patch;
                s->model = MODEL;
            }
        }
        double r = s->e / om__sample_sigma(s);
        sum += fmin(r * r, LIMIT * LIMIT);
        nfit += fabs(r) < LIMIT;
    }
    if (explained) *explained = j->nsample > 0 ? (double)nfit / j->nsample : 0;
    return j->nsample > 0 ? sum / j->nsample : LIMIT * LIMIT;
}

// Chi-square of patches, over their number, at the distances of the last om__judge_measure(). A patch counts within
// bounds: pixels that are no tissue may show anything, a tool or a cloth. `only_fitting`: patches whose mean lies
// within LIMIT.
static double chi_square(const MatchJudge* j, bool only_fitting, int* npatch) {
    MatchPatch* patch = j->patch;
    memset(patch, 0, MAX_PATCH * sizeof *patch);
    for (int i = 0; i < j->nsample; ++i) {
        const MatchSample* s = &j->sample[i];
        if (s->patch < 0 && only_fitting) continue;
        int k = s->patch < 0 ? 0 : s->patch;
        patch[k].sum += s->e;
        patch[k].var += s->noise * s->noise;
        patch[k].model += s->model * s->model;
        ++patch[k].n;
        patch[k].is_tissue = s->is_tissue;
    }
    double sum = 0;
    *npatch = 0;
    for (int k = 0; k < MAX_PATCH; ++k) {
        if (patch[k].n == 0) continue;
        double mean = patch[k].sum / patch[k].n, n = patch[k].n,
               var = patch[k].var / (n * n) + patch[k].model / n;
        double chi2 = fmin(mean * mean / var, patch[k].is_tissue ? MOST_TISSUE : MOST_OTHER);
        if (only_fitting && chi2 > LIMIT * LIMIT) continue;
        sum += chi2;
        ++*npatch;
    }
    return *npatch > 0 ? sum / *npatch : 0;
}

// ---- rigid motions --------------------------------------------------------------------------------------------------

void om__judge_fit_rigid(MatchJudge* j, MatchGuess* g, const MatchGuess* stated, double scale,
                         double weight, double sigma[2]) {
    double H[6][6];
    for (int round = 0; round < MAX_ITERATION; ++round) {
        double b[6] = {0}, u[6];
        memset(H, 0, sizeof H);
        OmVec3 c = om__judge_place_of(g, j->center);
        om__judge_measure(j, g, NULL);
        for (int i = 0; i < j->nsample; ++i) {
            const MatchSample* s = &j->sample[i];
            if (s->patch < 0) continue;
            OmVec3 arm = om_cross(om_sub(om__judge_place_of(g, s->p), c), s->n);
            double sigma_s = om__sample_sigma(s), r = s->e / sigma_s / scale;
            double w = 1 / ((1 + r * r) * (1 + r * r)) / (sigma_s * sigma_s);
            const double row[6] = {arm.x, arm.y, arm.z, s->n.x, s->n.y, s->n.z};
            for (int a = 0; a < 6; ++a) {
                b[a] -= w * row[a] * s->e;
                for (int k = 0; k < 6; ++k) H[a][k] += w * row[a] * row[k];
            }
        }
        // neighbouring samples share the errors of the model: their number counts less
        double share = 1.0 / fmax(1, j->nsample / 60.0);
        for (int a = 0; a < 6; ++a) {
            b[a] *= share;
            for (int k = 0; k < 6; ++k) H[a][k] *= share;
        }
        OmQuat turned = om_quat_mul(stated->pose.q, om_quat_conj(g->pose.q));
        OmVec3 back = om_scale(turned.w < 0 ? -2 : 2, om_vec3(turned.x, turned.y, turned.z));
        OmVec3 shift = om_sub(om__judge_place_of(stated, j->center), c);
        const double to[6] = {back.x, back.y, back.z, shift.x, shift.y, shift.z};
        for (int a = 0; a < 6; ++a) {
            double s = a < 3 ? PRIOR_TURN : PRIOR_SHIFT, w = 1 / (s * s);
            H[a][a] += w;
            b[a] += weight * w * to[a];
        }
        om__solve6(H, 0, b, u);
        OmVec3 turn = om_vec3(u[0], u[1], u[2]);
        double angle = om_norm(turn), cut = angle > MAX_TURN ? MAX_TURN / angle : 1;
        if (angle > 0) {
            OmQuat q = om_quat_axis_angle(om_scale(1 / angle, turn), cut * angle);
            g->pose.q = om_quat_normalize(om_quat_mul(q, g->pose.q));
        }
        OmVec3 at = om_madd(c, cut, om_vec3(u[3], u[4], u[5]));
        MatchGuess here = *g;
        here.pose.p = om_vec3(0, 0, 0);
        g->pose.p = om_sub(at, om__judge_place_of(&here, j->center));
        if (angle * j->radius + om_norm(om_vec3(u[3], u[4], u[5])) < 1e-6) break;
    }
    if (!sigma) return;
    sigma[0] = sigma[1] = 0;
    for (int a = 0; a < 6; ++a) {  // the diagonal of the inverse
        double e[6] = {0}, u[6];
        e[a] = 1;
        om__solve6(H, 0, e, u);
        sigma[a / 3] = fmax(sigma[a / 3], sqrt(u[a]));
    }
}

void om__judge_set_motion(const MatchJudge* j, const MatchGuess* stated, const MatchGuess* g,
                          OmMatchVerdict* v) {
    v->pose_right_scan = om_pose_mul(g->pose, om_pose_inverse(stated->pose));
    OmQuat q = v->pose_right_scan.q;
    v->turn = 2 * atan2(sqrt(q.x * q.x + q.y * q.y + q.z * q.z), fabs(q.w));
    v->shift = om_distance(om__judge_place_of(stated, j->center), om__judge_place_of(g, j->center));
}

// ---- the verdict --------------------------------------------------------------------------------------------------

typedef struct Fit {  // of a guess
    double chi2, explained, cost;
    int npatch;
} Fit;

static Fit find_fit(MatchJudge* j, const MatchGuess* g, bool is_rest) {
    Fit fit;
    fit.cost = om__judge_measure(j, g, &fit.explained);
    fit.chi2 = chi_square(j, !is_rest, &fit.npatch);
    return fit;
}

// Lifted tissue has no chi-square: the part that fits always does.
static bool is_fit(const Fit* fit, bool is_rest) {
    return is_rest ? fit->chi2 <= CHI2 : fit->explained >= LEAST;
}

static bool is_small(const MatchJudge* j, const OmMatchVerdict* v, const MatchGuess* g) {
    return v->turn <= j->max_turn && v->shift <= j->max_shift &&
           fabs(log(g->focal)) <= SMALL_RATIO && fabs(log(g->scale)) <= SMALL_RATIO;
}

// The pose that fits best, and its uncertainty. What the samples leave open stays as stated, if a scan at rest fits
// then; else all samples count at first, also samples beside the border.
static MatchGuess fit_motion(MatchJudge* j, const MatchGuess* stated, bool is_rest,
                             double sigma[2]) {
    MatchGuess g = *stated;
    for (double scale = is_rest ? 10 : 3; scale > 0.9; scale *= 0.5)
        om__judge_fit_rigid(j, &g, stated, scale, 1, sigma);
    if (!is_rest || find_fit(j, &g, is_rest).chi2 <= CHI2_SURE) return g;
    for (double scale = 40; scale > 0.9; scale *= 0.5)
        om__judge_fit_rigid(j, &g, stated, scale, 0, sigma);
    return g;
}

static void say_corrected(const MatchGuess* g, OmMatchVerdict* v) {
    if (v->cause == OM_MATCH_MOVED)
        om__judge_say(
            v,
            "corrected: the scan is turned by %.2f degrees and shifted by %.2f mm (known to "
            "%.2f degrees and %.2f mm in the least known directions)",
            om__degrees(v->turn), 1e3 * v->shift, om__degrees(v->sigma_turn), 1e3 * v->sigma_shift);
    else
        om__judge_say(v, "corrected: the focal length is divided by %.4f, depth by %.4f", g->focal,
                      g->scale);
}

// A small error of the camera, estimated where it is worth it. `right`: in: as stated; out: corrected.
static bool is_corrected(MatchJudge* j, const Fit* fit, bool is_rest, OmMatchVerdict* v,
                         MatchGuess* right) {
    if (is_rest && fit->chi2 <= CHI2_SURE) return false;
    const MatchGuess stated = *right;
    double sigma[2];
    MatchGuess best = fit_motion(j, &stated, is_rest, sigma);
    Fit least = find_fit(j, &best, is_rest);
    v->cause = OM_MATCH_MOVED;
    for (int k = 0; k < 2 && is_rest && j->scan->has_camera; ++k) {
        const OmMatchCause cause = k ? OM_MATCH_SCALE : OM_MATCH_FOCAL;
        MatchGuess g = om__judge_fit_ratio(j, &stated, cause);
        Fit one = find_fit(j, &g, is_rest);
        if (one.cost > least.cost + (k == 0 ? MORE_UNKNOWNS : 0)) continue;
        best = g;
        least = one;
        v->cause = cause;
        v->size = k ? g.scale : g.focal;
    }
    const bool is_better =
        is_rest ? least.chi2 < 0.8 * fit->chi2 : least.explained >= fit->explained + GAIN;
    om__judge_set_motion(j, &stated, &best, v);
    v->chi2_moved = least.chi2;
    if (v->cause == OM_MATCH_MOVED) {
        v->sigma_turn = sigma[0];
        v->sigma_shift = sigma[1];
        v->size = v->turn;
    } else {
        v->turn = v->shift = 0;
    }
    if (is_fit(&least, is_rest) && is_better && is_small(j, v, &best)) {
        *right = best;
        say_corrected(&best, v);
        return true;
    }
    v->pose_right_scan = om_pose_identity();
    v->turn = v->shift = v->size = v->sigma_turn = v->sigma_shift = 0;
    v->cause = OM_MATCH_FITS;
    v->is_good = !is_better || is_rest;  // lifted tissue fits much better elsewhere
    return false;
}

OmStatus om__match_judge(MatchJudge* j, const OmScan* scan, bool is_rest, OmMatchVerdict* v,
                         MatchGuess* right) {
    *v = (OmMatchVerdict){.is_good = true, .pose_right_scan = om_pose_identity()};
    j->scan = scan;
    *right = om__judge_as_stated(scan);
    if (scan->npoint < OM__MATCH_MIN_POINTS) return om__judge_empty(j, v);
    OM_TRY(om__judge_mirrored(j, v));
    if (!v->is_good) return OM_OK;
    OM_TRY(om__judge_take_samples(j));
    const MatchGuess stated = *right;
    const Fit fit = find_fit(j, &stated, is_rest);
    v->chi2 = v->chi2_moved = fit.chi2;
    v->npatch = fit.npatch;
    v->is_moved = is_corrected(j, &fit, is_rest, v, right);
    if (v->is_moved || (v->is_good && is_fit(&fit, is_rest))) return OM_OK;
    return om__judge_find_cause(j, &stated, v);
}

OmStatus om_match_register(OmMatch* m, const OmScan* rest, double max_turn, double max_shift,
                           OmMatchVerdict* v) {
    MatchJudge j;
    MatchGuess right;
    OmStatus status = om__match_judge_begin(m, &j);
    j.max_turn = max_turn, j.max_shift = max_shift;
    if (status == OM_OK) status = om__match_judge(&j, rest, true, v, &right);
    om__match_judge_done(&j);
    return status;
}

OmStatus om__match_judge_view(MatchJudge* j, const OmScan* scan, const double* x,
                              OmMatchVerdict* v) {
    const OmMatch* m = j->match;
    MatchBuffer buffer;
    v->empty = v->other = 0;
    if (!om__judge_has_pixels(scan)) return OM_OK;
    OM_TRY(om__match_buffer_init(scan, m->surface.nvert, &buffer));
    for (int i = 0; i < m->surface.nvert; ++i) om_store3(j->xs, i, om_load3(x, m->surface_vert[i]));
    om__match_mark_visible(&buffer, &m->surface, j->xs, 0.5 * m->view.edge, j->use);
    double all = buffer.ntissue + buffer.nother + buffer.nempty;
    if (all > 0) {
        v->empty = buffer.nempty / all;
        v->other = buffer.nother / all;
    }
    om__match_buffer_done(&buffer);
    return OM_OK;
}
