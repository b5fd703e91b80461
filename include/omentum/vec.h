/// omentum/vec.h: vectors, matrices, rotations (room `math`, floor 0).
///
/// Small things are structs passed by value; matrices hold columns. Everything here is pure. The three
/// decompositions at the end accept any finite matrix, singular, inverted or zero.
///
///     OmPose pose_world_tool = {om_vec3(0, 0, 0.1), om_quat_axis_angle(om_vec3(0, 0, 1), 0.5)};
///     OmVec3 p_world = om_pose_apply(pose_world_tool, p_tool);
#ifndef OMENTUM_VEC_H
#define OMENTUM_VEC_H

#include <math.h>

#include "omentum/base.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_PI 3.14159265358979323846

typedef struct OmVec3 {
    double x, y, z;
} OmVec3;

typedef struct OmMat3 {
    OmVec3 cx, cy, cz;  // columns
} OmMat3;

typedef struct OmQuat {
    double x, y, z, w;  // unit length for rotations
} OmQuat;

typedef struct OmPose {
    OmVec3 p;  // m
    OmQuat q;  // frame in the name: pose_world_tool maps tool coordinates to world
} OmPose;

// ---- vectors ----------------------------------------------------------------------------------

static inline OmVec3 om_vec3(double x, double y, double z) {
    OmVec3 v = {x, y, z};
    return v;
}
static inline OmVec3 om_load3(const double* x, int i) {
    return om_vec3(x[3 * (size_t)i], x[3 * (size_t)i + 1], x[3 * (size_t)i + 2]);
}
static inline void om_store3(double* x, int i, OmVec3 v) {
    x[3 * (size_t)i] = v.x;
    x[3 * (size_t)i + 1] = v.y;
    x[3 * (size_t)i + 2] = v.z;
}
static inline OmVec3 om_add(OmVec3 a, OmVec3 b) { return om_vec3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline OmVec3 om_sub(OmVec3 a, OmVec3 b) { return om_vec3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline OmVec3 om_scale(double s, OmVec3 a) { return om_vec3(s * a.x, s * a.y, s * a.z); }
/// a + s b
static inline OmVec3 om_madd(OmVec3 a, double s, OmVec3 b) {
    return om_vec3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}
static inline double om_dot(OmVec3 a, OmVec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline OmVec3 om_cross(OmVec3 a, OmVec3 b) {
    return om_vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline double om_norm2(OmVec3 a) { return om_dot(a, a); }
static inline double om_norm(OmVec3 a) { return sqrt(om_dot(a, a)); }
static inline double om_distance(OmVec3 a, OmVec3 b) { return om_norm(om_sub(a, b)); }
/// a / |a|, or zero if a is zero.
static inline OmVec3 om_normalize(OmVec3 a) {
    double n = om_norm(a);
    return n > 0.0 ? om_scale(1.0 / n, a) : om_vec3(0, 0, 0);
}
/// (1 - t) a + t b
static inline OmVec3 om_lerp(OmVec3 a, OmVec3 b, double t) { return om_madd(a, t, om_sub(b, a)); }
static inline OmVec3 om_min3(OmVec3 a, OmVec3 b) {
    return om_vec3(fmin(a.x, b.x), fmin(a.y, b.y), fmin(a.z, b.z));
}
static inline OmVec3 om_max3(OmVec3 a, OmVec3 b) {
    return om_vec3(fmax(a.x, b.x), fmax(a.y, b.y), fmax(a.z, b.z));
}
static inline bool om_is_finite3(OmVec3 a) {
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}
/// Some unit vector orthogonal to the unit vector n (Duff et al. 2017).
OM_API OmVec3 om_orthogonal(OmVec3 n);

// ---- matrices -----------------------------------------------------------------------------------

static inline OmMat3 om_mat3_identity(void) {
    OmMat3 m = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    return m;
}
static inline OmMat3 om_mat3_cols(OmVec3 cx, OmVec3 cy, OmVec3 cz) {
    OmMat3 m = {cx, cy, cz};
    return m;
}
static inline OmMat3 om_mat3_diag(OmVec3 d) {
    OmMat3 m = {{d.x, 0, 0}, {0, d.y, 0}, {0, 0, d.z}};
    return m;
}
static inline OmVec3 om_mat3_apply(OmMat3 m, OmVec3 v) {
    return om_vec3(m.cx.x * v.x + m.cy.x * v.y + m.cz.x * v.z,
                   m.cx.y * v.x + m.cy.y * v.y + m.cz.y * v.z,
                   m.cx.z * v.x + m.cy.z * v.y + m.cz.z * v.z);
}
/// m^T v
static inline OmVec3 om_mat3_apply_transposed(OmMat3 m, OmVec3 v) {
    return om_vec3(om_dot(m.cx, v), om_dot(m.cy, v), om_dot(m.cz, v));
}
static inline OmMat3 om_mat3_mul(OmMat3 a, OmMat3 b) {
    return om_mat3_cols(om_mat3_apply(a, b.cx), om_mat3_apply(a, b.cy), om_mat3_apply(a, b.cz));
}
static inline OmMat3 om_mat3_transpose(OmMat3 m) {
    OmMat3 t = {{m.cx.x, m.cy.x, m.cz.x}, {m.cx.y, m.cy.y, m.cz.y}, {m.cx.z, m.cy.z, m.cz.z}};
    return t;
}
static inline OmMat3 om_mat3_add(OmMat3 a, OmMat3 b) {
    return om_mat3_cols(om_add(a.cx, b.cx), om_add(a.cy, b.cy), om_add(a.cz, b.cz));
}
static inline OmMat3 om_mat3_scale(double s, OmMat3 a) {
    return om_mat3_cols(om_scale(s, a.cx), om_scale(s, a.cy), om_scale(s, a.cz));
}
/// a b^T
static inline OmMat3 om_mat3_outer(OmVec3 a, OmVec3 b) {
    return om_mat3_cols(om_scale(b.x, a), om_scale(b.y, a), om_scale(b.z, a));
}
static inline double om_mat3_det(OmMat3 m) { return om_dot(m.cx, om_cross(m.cy, m.cz)); }
static inline double om_mat3_trace(OmMat3 m) { return m.cx.x + m.cy.y + m.cz.z; }
/// Frobenius norm.
static inline double om_mat3_norm(OmMat3 m) {
    return sqrt(om_norm2(m.cx) + om_norm2(m.cy) + om_norm2(m.cz));
}
/// Inverse; OM_INVALID (and zero) if the determinant is zero or not finite.
/// @return OM_OK; OM_INVALID (singular)
OM_API OmStatus om_mat3_inverse(OmMat3 m, OmMat3* inverse);

// ---- rotations ------------------------------------------------------------------------------------

static inline OmQuat om_quat_identity(void) {
    OmQuat q = {0, 0, 0, 1};
    return q;
}
OM_API OmQuat om_quat_axis_angle(OmVec3 axis, double angle);
OM_API OmQuat om_quat_mul(OmQuat a, OmQuat b);
static inline OmQuat om_quat_conj(OmQuat q) {
    OmQuat c = {-q.x, -q.y, -q.z, q.w};
    return c;
}
OM_API OmQuat om_quat_normalize(OmQuat q);
/// Angle of the rotation between two orientations, 0 to pi; accurate for small ones, too.
OM_API double om_quat_angle(OmQuat a, OmQuat b);
OM_API OmVec3 om_quat_rotate(OmQuat q, OmVec3 v);
OM_API OmMat3 om_quat_to_mat3(OmQuat q);
/// From a rotation matrix.
OM_API OmQuat om_quat_from_mat3(OmMat3 r);
/// Shortest-arc spherical interpolation.
OM_API OmQuat om_quat_slerp(OmQuat a, OmQuat b, double t);

static inline OmPose om_pose_identity(void) {
    OmPose p = {{0, 0, 0}, {0, 0, 0, 1}};
    return p;
}
static inline OmVec3 om_pose_apply(OmPose p, OmVec3 v) {
    return om_add(p.p, om_quat_rotate(p.q, v));
}
/// pose_ab * pose_bc = pose_ac
static inline OmPose om_pose_mul(OmPose a, OmPose b) {
    OmPose p = {om_pose_apply(a, b.p), om_quat_mul(a.q, b.q)};
    return p;
}
static inline OmPose om_pose_inverse(OmPose p) {
    OmQuat c = om_quat_conj(p.q);
    OmPose inv = {om_quat_rotate(c, om_scale(-1, p.p)), c};
    return inv;
}
static inline bool om_pose_is_identity(OmPose p) {
    return om_norm2(p.p) == 0 && p.q.x == 0 && p.q.y == 0 && p.q.z == 0 && p.q.w == 1;
}
/// The pose at fraction t of the motion from a to b: position linear in t, orientation by om_quat_slerp.
/// Exactly a for t <= 0 and exactly b for t >= 1.
static inline OmPose om_pose_lerp(OmPose a, OmPose b, double t) {
    if (t <= 0) return a;
    if (t >= 1) return b;
    OmPose p = {om_lerp(a.p, b.p, t), om_quat_slerp(a.q, b.q, t)};
    return p;
}
/// A camera-like frame: z from `eye` to `target`, y as near to -`up` as possible (x right, y down).
OM_API OmPose om_pose_look_at(OmVec3 eye, OmVec3 target, OmVec3 up);

// ---- decompositions ---------------------------------------------------------------------------------

/// Symmetric eigenproblem by cyclic Jacobi: a = V diag(w) V^T, w ascending, V a rotation.
OM_API void om_mat3_eigen_symmetric(OmMat3 a, OmVec3* w, OmMat3* v);

/// a = U diag(s) V^T with U and V rotations; s.x >= s.y >= |s.z|, and s.z carries the sign of det a.
OM_API void om_mat3_svd(OmMat3 a, OmMat3* u, OmVec3* s, OmMat3* v);

/// The rotation nearest to f (Frobenius norm); well defined, if not unique, for singular and inverted f.
OM_API OmMat3 om_mat3_polar(OmMat3 f);

#ifdef __cplusplus
}
#endif
#endif
