// pbd_shape.c: region-based shape matching, thesis (3.13)-(3.14), robust for flat and collapsed clusters.
//
// Each cluster seeks the rotation R that brings its rest shape q_i nearest to its particles x_i: it maximises
// tr(R^T A), A = sum w_i x_i q_i^T (Mueller et al. 2005). Weights are m_i over the number of i's clusters, so that
// the mean of goals keeps linear and angular momentum (Rivers and James 2007). A polar decomposition of A would
// be free to flip where A has rank two, as that of every single layer; instead R continues from the last step's by
// Newton's method on the rotation group: with S = R^T A, g = axial(S), H = tr(S) I - sym(S), turn by H^-1 g.
// H is positive definite about the maximum, for rank two as well; elsewhere a multiple of I is added. What A does
// not determine (rank one, or zero: a cluster collapsed to a point) has no gradient, so R does not change.
// Eight clusters are turned at once; only + - * / and sqrt are used, in a fixed order.
//
// Tried and rejected: 512-bit sums of the maps in om__pbd_follow (5 % slower than 256-bit), and particles sorted by
// their number of clusters so that inner loops keep their length (no difference).
#include <math.h>
#include <string.h>

#include "base/base_multiversion.h"
#include "pbd/pbd_internal.h"

// Everything is inlined into the clones of two functions (base_multiversion.h).
#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

typedef double V4 __attribute__((vector_size(32)));
#define LANE OM__PBD_LANE
#define LEAST_TURN 1e-6  // of |A|, added to H: along what A does not determine
#define SADDLE 0.5       // tr S / |S| is at least 0.57 at a maximum
#define KICK 1e-3        // away from a saddle

// x -> R for each lane, columns first: r[3 c + k] is row k of column c.
INLINE void rotation_of(const double* restrict q, double r[9][LANE]) {
    for (int l = 0; l < LANE; ++l) {
        double x = q[l], y = q[LANE + l], z = q[2 * LANE + l], w = q[3 * LANE + l];
        r[0][l] = 1 - 2 * (y * y + z * z);
        r[1][l] = 2 * (x * y + w * z);
        r[2][l] = 2 * (x * z - w * y);
        r[3][l] = 2 * (x * y - w * z);
        r[4][l] = 1 - 2 * (x * x + z * z);
        r[5][l] = 2 * (y * z + w * x);
        r[6][l] = 2 * (x * z + w * y);
        r[7][l] = 2 * (y * z - w * x);
        r[8][l] = 1 - 2 * (x * x + y * y);
    }
}

// One Newton step of the rotations q towards those of a.
INLINE void turn_once(double a[9][LANE], double* restrict q) {
    double r[9][LANE];
    rotation_of(q, r);
    for (int l = 0; l < LANE; ++l) {
        double s[9], norm2 = 0;  // S = R^T A, columns first
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) {
                double d = r[3 * k][l] * a[3 * c][l] + r[3 * k + 1][l] * a[3 * c + 1][l] +
                           r[3 * k + 2][l] * a[3 * c + 2][l];
                s[3 * c + k] = d;
                norm2 += d * d;
            }
        double scale = norm2 > 1e-280 ? 1 / sqrt(norm2) : 0;
        for (int k = 0; k < 9; ++k) s[k] *= scale;
        double trace = s[0] + s[4] + s[8];
        double gx = s[5] - s[7], gy = s[6] - s[2], gz = s[1] - s[3];
        double g2 = gx * gx + gy * gy + gz * gz;
        double kick = scale > 0 && trace < SADDLE && g2 < 1e-12 ? KICK : 0;
        gx += kick, gy += 2 * kick, gz += 3 * kick;
        // H = (trace + damp) I - sym(S); damp makes it positive definite, for the eigenvalues of sym(S) <= 1
        double top = trace + (trace < 1 ? 1 - trace : 0) + LEAST_TURN;
        double hxx = top - s[0], hyy = top - s[4], hzz = top - s[8];
        double hxy = -0.5 * (s[1] + s[3]), hxz = -0.5 * (s[2] + s[6]), hyz = -0.5 * (s[5] + s[7]);
        double cxx = hyy * hzz - hyz * hyz, cxy = hxz * hyz - hxy * hzz,
               cxz = hxy * hyz - hxz * hyy;
        double cyy = hxx * hzz - hxz * hxz, cyz = hxy * hxz - hxx * hyz,
               czz = hxx * hyy - hxy * hxy;
        double det = hxx * cxx + hxy * cxy + hxz * cxz;  // at least LEAST_TURN^3, but for rounding
        double half = det > 1e-30 ? 0.5 / det : 0;
        double wx = half * (cxx * gx + cxy * gy + cxz * gz);
        double wy = half * (cxy * gx + cyy * gy + cyz * gz);
        double wz = half * (cxz * gx + cyz * gy + czz * gz);
        // q (w, 1), at most a half turn's half at once
        double w2 = wx * wx + wy * wy + wz * wz;
        double limit = w2 > 0.25 ? 0.5 / sqrt(w2) : 1;
        wx *= limit, wy *= limit, wz *= limit;
        double x = q[l], y = q[LANE + l], z = q[2 * LANE + l], w = q[3 * LANE + l];
        double nx = x + w * wx + y * wz - z * wy, ny = y + w * wy + z * wx - x * wz;
        double nz = z + w * wz + x * wy - y * wx, nw = w - x * wx - y * wy - z * wz;
        double inv = 1 / sqrt(nx * nx + ny * ny + nz * nz + nw * nw);  // |q|^2 (1 + |w|^2) >= 1
        q[l] = nx * inv, q[LANE + l] = ny * inv, q[2 * LANE + l] = nz * inv,
        q[3 * LANE + l] = nw * inv;
    }
}

// Rows of sum x (w, w q)^T: the centre and A. Two clusters at once: each sum alone waits for its additions.
INLINE void add_member(const OmPbdClusters* shape, const double* restrict x, int n, V4 row[3]) {
    const double* p = x + 3 * (size_t)shape->vert[n];
    V4 w = *(const V4*)(shape->weight + 4 * (size_t)n);
    row[0] += p[0] * w;
    row[1] += p[1] * w;
    row[2] += p[2] * w;
}

INLINE void sum_clusters(const OmPbdClusters* shape, const double* restrict x, int c, bool is_pair,
                         double sum[2][12]) {
    V4 one[3] = {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}};
    V4 two[3] = {{0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}};
    int n = shape->adr[c], end = shape->adr[c + 1], m = end;
    int last = is_pair ? shape->adr[c + 2] : m;
    for (; n < end && m < last; ++n, ++m) {
        add_member(shape, x, n, one);
        add_member(shape, x, m, two);
    }
    for (; n < end; ++n) add_member(shape, x, n, one);
    for (; m < last; ++m) add_member(shape, x, m, two);
    memcpy(sum[0], one, sizeof one);
    memcpy(sum[1], two, sizeof two);
}

// (1 - beta) R + beta L, L the best linear map with the volume of the rest shape; flat directions turn with R.
static OmMat3 stretch(const OmPbdClusters* shape, int c, double beta, OmMat3 A, OmMat3 R) {
    const double *si = shape->spread_inverse + 9 * (size_t)c, *fl = shape->flat + 9 * (size_t)c;
    OmMat3 inverse = {om_load3(si, 0), om_load3(si, 1), om_load3(si, 2)};
    OmMat3 flat = {om_load3(fl, 0), om_load3(fl, 1), om_load3(fl, 2)};
    OmMat3 L = om_mat3_add(om_mat3_mul(A, inverse), om_mat3_mul(R, flat));
    double det = om_mat3_det(L);
    if (om_mat3_norm(flat) < 0.5 && det > 0.2 && det < 5) L = om_mat3_scale(1 / cbrt(det), L);
    return om_mat3_add(om_mat3_scale(1 - beta, R), om_mat3_scale(beta, L));
}

INLINE void write_map(const OmPbdClusters* shape, int c, double beta, const double sum[12],
                      double r[9][LANE], int l, double* restrict map) {
    OmMat3 R = {
        {r[0][l], r[1][l], r[2][l]}, {r[3][l], r[4][l], r[5][l]}, {r[6][l], r[7][l], r[8][l]}};
    if (beta > 0) {
        OmMat3 A = {{sum[1], sum[5], sum[9]}, {sum[2], sum[6], sum[10]}, {sum[3], sum[7], sum[11]}};
        R = stretch(shape, c, beta, A, R);
    }
    OmVec3 t =
        om_sub(om_vec3(sum[0], sum[4], sum[8]), om_mat3_apply(R, om_load3(shape->center, c)));
    double* m = map + OM__PBD_MAP * (size_t)c;
    m[0] = R.cx.x, m[1] = R.cx.y, m[2] = R.cx.z, m[3] = 0;
    m[4] = R.cy.x, m[5] = R.cy.y, m[6] = R.cy.z, m[7] = 0;
    m[8] = R.cz.x, m[9] = R.cz.y, m[10] = R.cz.z, m[11] = 0;
    m[12] = t.x, m[13] = t.y, m[14] = t.z, m[15] = 0;
}

OM_MULTIVERSION void om__pbd_match(const OmPbdClusters* shape, double linear_stretch,
                                   const double* x, int begin, int end, int nnewton, double* turn,
                                   double* map) {
    for (int b = begin; b < end; ++b) {
        double sum[LANE][12], a[9][LANE], r[9][LANE];
        int num = shape->ncluster - b * LANE < LANE ? shape->ncluster - b * LANE : LANE;
        if (num < LANE) memset(sum, 0, sizeof sum);
        for (int l = 0; l < num; l += 2) sum_clusters(shape, x, b * LANE + l, l + 1 < num, sum + l);
        for (int l = 0; l < LANE; ++l)
            for (int k = 0; k < 3; ++k)
                for (int c = 0; c < 3; ++c) a[3 * c + k][l] = sum[l][4 * k + 1 + c];
        double* q = turn + 4 * (size_t)(b * LANE);
        for (int n = 0; n < nnewton; ++n) turn_once(a, q);
        rotation_of(q, r);
        for (int l = 0; l < LANE && b * LANE + l < shape->ncluster; ++l)
            write_map(shape, b * LANE + l, linear_stretch, sum[l], r, l, map);
    }
}

OM_MULTIVERSION void om__pbd_follow(const OmPbdClusters* shape, const double* restrict map,
                                    const double* restrict rest, double alpha,
                                    const unsigned char* restrict kind, int begin, int end,
                                    double* restrict x, double* restrict way) {
    for (int i = begin; i < end; ++i) {
        V4 cx = {0, 0, 0, 0}, cy = cx, cz = cx, t = cx;
        for (int n = shape->part_adr[i]; n < shape->part_adr[i + 1]; ++n) {
            const V4* m = (const V4*)(map + OM__PBD_MAP * (size_t)shape->part_cluster[n]);
            cx += m[0], cy += m[1], cz += m[2], t += m[3];
        }
        const double* q = rest + 3 * (size_t)i;
        V4 goal = shape->part_share[i] * (q[0] * cx + q[1] * cy + q[2] * cz + t);  // (3.13)
        double* p = x + 3 * (size_t)i;
        // scalars: an array would go through memory, and wait for it
        double dx = alpha * (goal[0] - p[0]), dy = alpha * (goal[1] - p[1]),
               dz = alpha * (goal[2] - p[2]);
        if (kind[i] != 0) {
            double* to = way + 3 * (size_t)i;
            to[0] = dx, to[1] = dy, to[2] = dz;
            if (kind[i] & OM__PBD_PRESCRIBED) continue;
        }
        p[0] += dx, p[1] += dy, p[2] += dz;
    }
}
