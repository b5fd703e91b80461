// match_icp.c: trimmed point-to-plane ICP against the visible part of a surface.
//
// Each iteration pairs points with the nearest point on the triangles that face the camera and are not hidden
// (shape_closest), leaves out pairs whose normals differ by more than 60 degrees, chooses how many pairs to keep, and
// makes one damped Gauss-Newton step for the distances to the tangent planes (Chen and Medioni 1992). The tangent plane
// is that of the interpolated vertex normals. The share kept minimises mean squared distance / share^3 (Chetverikov et
// al. 2005; Phillips et al. 2007). Unknowns are a turn about the scan's centre, scaled by the scan's radius, and a
// shift, so that the damping has one unit. Triangles stand for a curved surface, see curve(): with flat ones, kidneys
// of 4.5 mm edges were up to 0.57 degrees off, with curved ones 0.31.
//
// Covariance: errors of the model (its facets, its rounded rims) are the same for neighbouring points, so that s^2 H^-1
// is several times too small. The jackknife over NBLOCK compact parts of the scan has no such assumption: the spread of
// the solutions that leave out one part each (Efron 1982), by one step of the normal equations.
#include <math.h>
#include <string.h>

#include "match/match_icp.h"

#define MIN_NORMAL_COS 0.5   // of a point's normal and its partner's
#define MIN_FACING_COS -0.3  // of a triangle and the camera; the pose is not final
#define MIN_CURVED_COS \
    0.8               // of the normals of a triangle and its vertices; below: an edge, not a curve
#define MAX_TURN 0.2  // rad, of a step
#define START_DAMPING 1e-2
#define MIN_DAMPING 1e-7
#define GATE 5.0       // distances above this many times the median are never kept
#define VIEW_SIZE 128  // pixels of the picture that shows which triangles are hidden
#define STALL 6        // iterations without a better cost end a run
#define NBLOCK 16      // parts of the scan that the jackknife leaves out
#define GRAIN 64

// ---- creation ---------------------------------------------------------------------------------------

static void set_normals(OmIcp* icp) {
    const OmSurface* s = icp->model;
    memset(icp->vert_normal, 0, 3 * (size_t)s->nvert * sizeof(double));
    double sum = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        OmVec3 normal = om_cross(om_sub(b, a), om_sub(c, a));  // as long as twice the area
        om_store3(icp->tri_normal, t, om_normalize(normal));
        om_store3(icp->tri_center, t, om_scale(1.0 / 3, om_add(a, om_add(b, c))));
        for (int k = 0; k < 3; ++k)
            om_store3(icp->vert_normal, v[k], om_add(om_load3(icp->vert_normal, v[k]), normal));
        sum += om_distance(a, b) + om_distance(b, c) + om_distance(c, a);
    }
    for (int i = 0; i < s->nvert; ++i)
        om_store3(icp->vert_normal, i, om_normalize(om_load3(icp->vert_normal, i)));
    icp->edge = sum / (3 * s->ntri);
}

static void set_ball(OmIcp* icp) {
    const OmSurface* s = icp->model;
    OmVec3 lo = om_load3(s->x, s->tri_vert[0]), hi = lo;
    for (size_t k = 0; k < 3 * (size_t)s->ntri; ++k) {
        lo = om_min3(lo, om_load3(s->x, s->tri_vert[k]));
        hi = om_max3(hi, om_load3(s->x, s->tri_vert[k]));
    }
    icp->model_center = om_lerp(lo, hi, 0.5);
    icp->model_radius = 0.5 * om_distance(lo, hi);
}

// A random choice without repeats (Fisher and Yates), always the same.
static OmStatus choose_points(const OmScan* scan, OmIcp* icp) {
    int* order;
    OM_ALLOC(order, scan->npoint);
    for (int i = 0; i < scan->npoint; ++i) order[i] = i;
    OmRng rng = om_rng_init(15, 0);
    for (int i = 0; i < icp->n; ++i) {
        int k = i + (int)om_rng_below(&rng, (uint32_t)(scan->npoint - i));
        int kept = order[k];
        order[k] = order[i];
        order[i] = kept;
        om_store3(icp->x, i, om_load3(scan->x, kept));
        om_store3(icp->normal, i, om_load3(scan->normal, kept));
    }
    om_free(order);
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < icp->n; ++i) sum = om_add(sum, om_load3(icp->x, i));
    icp->center = om_scale(1.0 / icp->n, sum);
    double sum2 = 0;
    for (int i = 0; i < icp->n; ++i) sum2 += om_norm2(om_sub(om_load3(icp->x, i), icp->center));
    icp->radius = fmax(sqrt(sum2 / icp->n), 1e-9);
    return OM_OK;
}

static OmStatus make_view(OmIcp* icp) {
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    int id;
    OM_TRY(om_sense_scene_create(&icp->view));
    OM_TRY(om_sense_scene_add(icp->view, icp->model, &look, &id));
    return om_sense_scene_commit(icp->view);
}

OmStatus om__icp_create(const OmSurface* model, const OmScan* scan, int npoint, OmIcp* icp) {
    OmStatus status = OM_OK;
    *icp = (OmIcp){.model = model, .min_overlap = 0.5, .noise = scan->noise};
    size_t n = (size_t)(npoint < scan->npoint ? npoint : scan->npoint), ntri = (size_t)model->ntri;
    icp->n = (int)n;
    OM_TRY_DONE(om_surface_tree_create(model, &icp->tree));
    OM_ALLOC_DONE(icp->tri_normal, 3 * ntri);
    OM_ALLOC_DONE(icp->tri_center, 3 * ntri);
    OM_ALLOC_DONE(icp->vert_normal, 3 * (size_t)model->nvert);
    OM_CALLOC_DONE(icp->hidden, ntri);
    OM_ALLOC_DONE(icp->use, ntri);
    OM_ALLOC_DONE(icp->x, 3 * n);
    OM_ALLOC_DONE(icp->normal, 3 * n);
    OM_ALLOC_DONE(icp->p, 3 * n);
    OM_ALLOC_DONE(icp->q_normal, 3 * n);
    OM_ALLOC_DONE(icp->distance2, n);
    OM_ALLOC_DONE(icp->residual, n);
    OM_ALLOC_DONE(icp->tri, n);
    OM_ALLOC_DONE(icp->sorted, n);
    set_normals(icp);
    set_ball(icp);
    OM_TRY_DONE(choose_points(scan, icp));
    if (scan->has_camera) {
        icp->eye = scan->camera.pose_world_camera.p;
        OM_TRY_DONE(make_view(icp));
    }
done:
    if (status < 0) om__icp_done(icp);
    return status;
}

void om__icp_done(OmIcp* icp) {
    om_surface_tree_destroy(icp->tree);
    om_sense_scene_destroy(icp->view);
    om_free(icp->tri_normal);
    om_free(icp->tri_center);
    om_free(icp->vert_normal);
    om_free(icp->hidden);
    om_free(icp->use);
    om_free(icp->x);
    om_free(icp->normal);
    om_free(icp->p);
    om_free(icp->q_normal);
    om_free(icp->distance2);
    om_free(icp->residual);
    om_free(icp->tri);
    om_free(icp->sorted);
    memset(icp, 0, sizeof *icp);
}

// ---- what the camera could see ----------------------------------------------------------------------

static void set_use(OmIcp* icp, OmPose pose) {
    if (!icp->view) {
        memset(icp->use, 1, (size_t)icp->model->ntri);
        return;
    }
    OmVec3 eye = om_pose_apply(pose, icp->eye);
    for (int t = 0; t < icp->model->ntri; ++t) {
        OmVec3 to_eye = om_sub(eye, om_load3(icp->tri_center, t));
        bool is_facing =
            om_dot(om_load3(icp->tri_normal, t), to_eye) > MIN_FACING_COS * om_norm(to_eye);
        icp->use[t] = is_facing && !icp->hidden[t];
    }
}

// A triangle is hidden if the picture of the model shows a surface before its centre, by more than an edge.
OmStatus om__icp_hide(OmIcp* icp, OmPose pose) {
    memset(icp->hidden, 0, (size_t)icp->model->ntri);
    if (!icp->view) return OM_OK;
    OmVec3 eye = om_pose_apply(pose, icp->eye);
    double distance = om_distance(eye, icp->model_center);
    if (distance < 1.05 * icp->model_radius) return OM_OK;  // too near to see the whole model
    OmVec3 up = om_orthogonal(om_normalize(om_sub(icp->model_center, eye)));
    OmCamera camera = {.pose_world_camera = om_pose_look_at(eye, icp->model_center, up),
                       .width = VIEW_SIZE,
                       .height = VIEW_SIZE,
                       .fov = 2 * asin(icp->model_radius / distance),
                       .near_m = 0.01 * distance,
                       .far_m = 3 * distance};
    float* depth;
    OM_ALLOC(depth, VIEW_SIZE * VIEW_SIZE);
    OmStatus status = om_sense_depth(icp->view, &camera, icp->nworker, depth, NULL, NULL);
    OmPose pose_camera_model = om_pose_inverse(camera.pose_world_camera);
    for (int t = 0; t < icp->model->ntri && status == OM_OK; ++t) {
        OmVec3 p = om_load3(icp->tri_center, t);
        double u, v;
        if (!om_camera_project(&camera, p, &u, &v)) continue;
        if (!(u >= 0 && u < VIEW_SIZE && v >= 0 && v < VIEW_SIZE)) continue;
        double seen = (double)depth[(int)v * VIEW_SIZE + (int)u];
        double z = om_pose_apply(pose_camera_model, p).z;
        icp->hidden[t] = seen > 0 && z > seen + icp->edge;
    }
    om_free(depth);
    return status;
}

// ---- pairs ------------------------------------------------------------------------------------------

typedef struct Pairing {
    OmIcp* icp;
    OmPose pose;
} Pairing;

// The surface that the triangles stand for, near their point q: half of the sum of the tangent planes of the vertices.
// Exact for a quadratic surface with vertices and normals on it: chords are as far inside as tangents are outside.
static OmVec3 curve(const OmIcp* icp, const OmSurfacePoint* q) {
    const int* v = icp->model->tri_vert + 3 * (size_t)q->tri;
    OmVec3 flat = om_load3(icp->tri_normal, q->tri), sum = om_vec3(0, 0, 0);
    for (int k = 0; k < 3; ++k) {
        OmVec3 n = om_load3(icp->vert_normal, v[k]);
        if (om_dot(n, flat) < MIN_CURVED_COS) return q->x;
        double height = om_dot(om_sub(q->x, om_load3(icp->model->x, v[k])), n);
        sum = om_madd(sum, -0.5 * q->bary[k] * height, n);
    }
    return om_add(q->x, sum);
}

static void find_pair(OmIcp* icp, OmPose pose, int i) {
    OmVec3 p = om_pose_apply(pose, om_load3(icp->x, i));
    om_store3(icp->p, i, p);
    icp->distance2[i] = HUGE_VAL;
    icp->residual[i] = 0;
    icp->tri[i] = -1;
    OmSurfacePoint q;
    if (!om_surface_tree_find(icp->tree, p, icp->use, HUGE_VAL, &q)) return;
    const int* v = icp->model->tri_vert + 3 * (size_t)q.tri;
    OmVec3 n = om_scale(q.bary[0], om_load3(icp->vert_normal, v[0]));
    n = om_madd(n, q.bary[1], om_load3(icp->vert_normal, v[1]));
    n = om_normalize(om_madd(n, q.bary[2], om_load3(icp->vert_normal, v[2])));
    if (om_norm2(n) == 0) n = om_load3(icp->tri_normal, q.tri);
    OmVec3 own = om_quat_rotate(pose.q, om_load3(icp->normal, i));
    if (om_norm2(own) > 0 && om_dot(own, n) < MIN_NORMAL_COS) return;
    om_store3(icp->q_normal, i, n);
    OmVec3 gap = om_sub(p, curve(icp, &q));
    icp->distance2[i] = om_norm2(gap);
    icp->residual[i] = om_dot(n, gap);
    icp->tri[i] = q.tri;
}

static void find_pairs(void* ctx, int begin, int end, int block) {
    (void)block;
    Pairing* pairing = ctx;
    for (int i = begin; i < end; ++i) find_pair(pairing->icp, pairing->pose, i);
}

// m^2: least squared distance, so that exact data have a scale, too.
static double least_of(const OmIcp* icp) {
    return icp->noise * icp->noise + 1e-10 * icp->radius * icp->radius;
}

// Choose how many of the nearest pairs to keep; sets cost, limit2 and nkept.
static void trim(OmIcp* icp, int n, OmIcpFit* fit) {
    int npair = 0;
    for (int i = 0; i < n; ++i)
        if (icp->distance2[i] < HUGE_VAL) icp->sorted[npair++] = icp->distance2[i];
    om_sort_doubles(icp->sorted, npair);
    double least = least_of(icp);
    int min_kept = (int)(icp->min_overlap * n), most = npair;
    double gate = npair > 0 ? GATE * GATE * (icp->sorted[npair / 2] + least) : 0;
    while (most > min_kept && icp->sorted[most - 1] > gate) --most;
    fit->cost = HUGE_VAL;
    fit->nkept = 0;
    fit->limit2 = 0;
    fit->npoint = n;
    double sum = 0;
    for (int k = 1; k <= most; ++k) {
        sum += icp->sorted[k - 1];
        if (k < min_kept && k < most) continue;
        double share = (double)k / n, cost = (sum / k + least) / (share * share * share);
        if (cost > fit->cost) continue;
        fit->cost = cost;
        fit->nkept = k;
        fit->limit2 = icp->sorted[k - 1];
    }
}

static void pair_at(OmIcp* icp, int n, OmIcpFit* fit) {
    set_use(icp, fit->pose);
    Pairing pairing = {icp, fit->pose};
    om_parallel_for(icp->nworker, n, GRAIN, find_pairs, &pairing);
    trim(icp, n, fit);
}

// ---- the step ---------------------------------------------------------------------------------------

// Row of a residual: a turn about the centre, in units of the scan's radius, and a shift.
static void set_row(const OmIcp* icp, OmVec3 center, int i, double row[6]) {
    OmVec3 n = om_load3(icp->q_normal, i);
    OmVec3 arm = om_scale(1 / icp->radius, om_sub(om_load3(icp->p, i), center));
    OmVec3 turn = om_cross(arm, n);
    row[0] = turn.x, row[1] = turn.y, row[2] = turn.z;
    row[3] = n.x, row[4] = n.y, row[5] = n.z;
}

static bool is_kept(const OmIcp* icp, const OmIcpFit* fit, int i) {
    return icp->distance2[i] <= fit->limit2;
}

// Normal equations of the kept pairs, divided by their number: mean squared residual, gradient, matrix.
static double sum_pairs(const OmIcp* icp, const OmIcpFit* fit, double g[6], double H[6][6]) {
    OmVec3 center = om_pose_apply(fit->pose, icp->center);
    memset(g, 0, 6 * sizeof *g);
    memset(H, 0, 36 * sizeof **H);
    double sum = 0;
    int count = 0;
    for (int i = 0; i < fit->npoint; ++i) {
        if (!is_kept(icp, fit, i)) continue;
        double row[6], r = icp->residual[i];
        set_row(icp, center, i, row);
        for (int a = 0; a < 6; ++a) {
            g[a] += row[a] * r;
            for (int b = 0; b <= a; ++b) H[a][b] += row[a] * row[b];
        }
        sum += r * r;
        ++count;
    }
    double scale = 1.0 / (count > 0 ? count : 1);
    for (int a = 0; a < 6; ++a) {
        g[a] *= scale;
        for (int b = 0; b <= a; ++b) H[b][a] = H[a][b] *= scale;
    }
    return sum * scale;
}

void om__solve6(double H[6][6], double damping, const double b[6], double u[6]) {
    double L[6][6];
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j) {
            double s = H[i][j] + (i == j ? damping : 0);
            for (int k = 0; k < j; ++k) s -= L[i][k] * L[j][k];
            L[i][j] = i == j ? sqrt(fmax(s, 0.5 * damping)) : s / L[j][j];
        }
    for (int i = 0; i < 6; ++i) {
        u[i] = b[i];
        for (int k = 0; k < i; ++k) u[i] -= L[i][k] * u[k];
        u[i] /= L[i][i];
    }
    for (int i = 5; i >= 0; --i) {
        for (int k = i + 1; k < 6; ++k) u[i] -= L[k][i] * u[k];
        u[i] /= L[i][i];
    }
}

// Turn and shift the pose by -u; returns the length of the step, m.
static double move_pose(const OmIcp* icp, const double u[6], OmPose* pose) {
    OmVec3 turn = om_scale(-1 / icp->radius, om_vec3(u[0], u[1], u[2]));
    OmVec3 shift = om_vec3(-u[3], -u[4], -u[5]);
    double angle = om_norm(turn), length = om_norm(shift) + angle * icp->radius;
    double scale = angle > MAX_TURN ? MAX_TURN / angle : 1;
    OmVec3 center = om_pose_apply(*pose, icp->center);
    if (angle > 0)
        pose->q = om_quat_normalize(
            om_quat_mul(om_quat_axis_angle(om_scale(1 / angle, turn), scale * angle), pose->q));
    OmVec3 moved = om_madd(center, scale, shift);
    pose->p = om_sub(moved, om_quat_rotate(pose->q, icp->center));
    return length;
}

void om__icp_run(OmIcp* icp, int npoint, int max_iteration, double tolerance, OmIcpFit* fit) {
    int n = npoint < icp->n ? npoint : icp->n, nstall = 0;
    double damping = START_DAMPING, last = HUGE_VAL;
    OmIcpFit best = {.cost = HUGE_VAL, .pose = fit->pose}, now = {.pose = fit->pose};
    for (int k = 0; k < max_iteration; ++k) {
        pair_at(icp, n, &now);
        ++fit->niteration;
        nstall = now.cost < best.cost * (1 - 1e-4) ? 0 : nstall + 1;
        if (now.cost < best.cost) best = now;
        if (now.nkept < 6 || nstall >= STALL) break;
        damping = now.cost < last ? fmax(MIN_DAMPING, 0.2 * damping) : fmin(1, 4 * damping);
        last = now.cost;
        double g[6], H[6][6], u[6];
        sum_pairs(icp, &now, g, H);
        om__solve6(H, damping, g, u);
        if (move_pose(icp, u, &now.pose) < tolerance) break;
    }
    best.niteration = fit->niteration;
    *fit = best;
    pair_at(icp, n, fit);  // pairs, cost and limit belong to the pose
}

// ---- covariance -------------------------------------------------------------------------------------

// The block of each kept point: that of the nearest of NBLOCK points, each the farthest from those before it.
static void set_blocks(const OmIcp* icp, const OmIcpFit* fit, int* block) {
    double* nearest2 = icp->sorted;
    int next = -1;
    for (int i = 0; i < fit->npoint; ++i) {
        nearest2[i] = HUGE_VAL;
        if (next < 0 && is_kept(icp, fit, i)) next = i;
    }
    for (int b = 0; b < NBLOCK && next >= 0; ++b) {
        OmVec3 seed = om_load3(icp->x, next);
        double most = -1;
        for (int i = 0; i < fit->npoint; ++i) {
            if (!is_kept(icp, fit, i)) continue;
            double d2 = om_norm2(om_sub(om_load3(icp->x, i), seed));
            if (d2 < nearest2[i]) nearest2[i] = d2, block[i] = b;
            if (nearest2[i] > most) most = nearest2[i], next = i;
        }
    }
}

// Sums of the normal equations of each block, and of all in the last place.
typedef struct BlockSums {
    double H[NBLOCK + 1][6][6], g[NBLOCK + 1][6], r2;
    int n[NBLOCK + 1];
} BlockSums;

static void sum_blocks(const OmIcp* icp, const OmIcpFit* fit, const int* block, BlockSums* s) {
    OmVec3 center = om_pose_apply(fit->pose, icp->center);
    memset(s, 0, sizeof *s);
    for (int i = 0; i < fit->npoint; ++i) {
        if (!is_kept(icp, fit, i)) continue;
        double row[6], r = icp->residual[i];
        set_row(icp, center, i, row);
        const int to[2] = {block[i], NBLOCK};
        for (int k = 0; k < 2; ++k) {
            ++s->n[to[k]];
            for (int a = 0; a < 6; ++a) {
                s->g[to[k]][a] += row[a] * r;
                for (int b = 0; b < 6; ++b) s->H[to[k]][a][b] += row[a] * row[b];
            }
        }
        s->r2 += r * r;
    }
}

// How the solution changes without block b.
static void leave_out(const BlockSums* s, int b, double u[6]) {
    double H[6][6], g[6], trace = 0;
    for (int i = 0; i < 6; ++i) {
        g[i] = s->g[NBLOCK][i] - s->g[b][i];
        for (int j = 0; j < 6; ++j) H[i][j] = s->H[NBLOCK][i][j] - s->H[b][i][j];
        trace += H[i][i];
    }
    om__solve6(H, fmax(1e-9 * trace, 1e-12 * fmax(s->n[NBLOCK], 1)), g, u);  // H may be zero
}

static OmMat3 block_of(double C[6][6], int at, double scale) {
    OmVec3 c[3];
    for (int k = 0; k < 3; ++k) c[k] = om_vec3(C[at + k][at], C[at + k][at + 1], C[at + k][at + 2]);
    return om_mat3_scale(scale, om_mat3_cols(c[0], c[1], c[2]));
}

OmStatus om__icp_covariance(const OmIcp* icp, const OmIcpFit* fit, OmMat3* turn, OmMat3* shift) {
    int* block;
    OM_ALLOC(block, fit->npoint);
    BlockSums s;
    set_blocks(icp, fit, block);
    sum_blocks(icp, fit, block, &s);
    om_free(block);
    double C[6][6] = {{0}}, u[NBLOCK][6], mean[6] = {0};
    double s2 = (s.r2 + least_of(icp)) / fmax(s.n[NBLOCK], 1);  // > 0 also without noise
    for (int k = 0; k < 6; ++k) {                               // independent errors of variance s2
        double e[6] = {0};
        e[k] = s2;
        om__solve6(s.H[NBLOCK], 1e-12 * fmax(s.n[NBLOCK], 1), e, C[k]);
    }
    for (int b = 0; b < NBLOCK; ++b) {
        leave_out(&s, b, u[b]);
        for (int k = 0; k < 6; ++k) mean[k] += u[b][k] / NBLOCK;
    }
    for (int b = 0; b < NBLOCK; ++b)
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j)
                C[i][j] += (NBLOCK - 1.0) / NBLOCK * (u[b][i] - mean[i]) * (u[b][j] - mean[j]);
    *turn = block_of(C, 0, 1 / (icp->radius * icp->radius));
    *shift = block_of(C, 3, 1);
    return OM_OK;
}
