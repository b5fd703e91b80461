// math_rotation.c: quaternions, poses, inverses.
#include "omentum/vec.h"

OmVec3 om_orthogonal(OmVec3 n) {
    // Duff et al., "Building an orthonormal basis, revisited", JCGT 2017: branchless, no singularity.
    double sign = copysign(1.0, n.z);
    double a = -1.0 / (sign + n.z);  // |sign + n.z| >= 1
    return om_vec3(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x);
}

OmStatus om_mat3_inverse(OmMat3 m, OmMat3* inverse) {
    OmVec3 r0 = om_cross(m.cy, m.cz), r1 = om_cross(m.cz, m.cx), r2 = om_cross(m.cx, m.cy);
    double det = om_dot(m.cx, r0);
    OmMat3 adjugate_t = {r0, r1, r2};
    *inverse = (OmMat3){0};
    double scale = 1.0 / det;
    OM_CHECK(det != 0.0 && isfinite(scale), OM_INVALID, "3x3 matrix is singular: determinant %g",
             det);
    *inverse = om_mat3_scale(scale, om_mat3_transpose(adjugate_t));
    return OM_OK;
}

OmQuat om_quat_axis_angle(OmVec3 axis, double angle) {
    OmVec3 v = om_scale(sin(0.5 * angle), om_normalize(axis));
    OmQuat q = {v.x, v.y, v.z, cos(0.5 * angle)};
    return q;
}

OmQuat om_quat_mul(OmQuat a, OmQuat b) {
    OmQuat q = {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
    return q;
}

double om_quat_angle(OmQuat a, OmQuat b) {
    const OmQuat d = om_quat_mul(om_quat_conj(a), b);
    return 2 * atan2(sqrt(d.x * d.x + d.y * d.y + d.z * d.z), fabs(d.w));
}

OmQuat om_quat_normalize(OmQuat q) {
    double n = sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(n > 0.0) || !isfinite(n)) return om_quat_identity();
    OmQuat u = {q.x / n, q.y / n, q.z / n, q.w / n};
    return u;
}

OmVec3 om_quat_rotate(OmQuat q, OmVec3 v) {
    OmVec3 u = om_vec3(q.x, q.y, q.z);
    OmVec3 t = om_scale(2.0, om_cross(u, v));
    return om_add(om_madd(v, q.w, t), om_cross(u, t));
}

OmMat3 om_quat_to_mat3(OmQuat q) {
    OmMat3 m = {om_quat_rotate(q, om_vec3(1, 0, 0)), om_quat_rotate(q, om_vec3(0, 1, 0)),
                om_quat_rotate(q, om_vec3(0, 0, 1))};
    return m;
}

OmQuat om_quat_from_mat3(OmMat3 r) {
    // Divide by the largest of the four components: its square is at least 1/4.
    double xx = r.cx.x, yy = r.cy.y, zz = r.cz.z;
    double t = xx + yy + zz;
    OmQuat q;
    if (t >= xx && t >= yy && t >= zz) {
        double s = 2.0 * sqrt(fmax(1.0 + t, 0.0));
        q = (OmQuat){(r.cy.z - r.cz.y) / s, (r.cz.x - r.cx.z) / s, (r.cx.y - r.cy.x) / s, 0.25 * s};
    } else if (xx >= yy && xx >= zz) {
        double s = 2.0 * sqrt(fmax(1.0 + xx - yy - zz, 0.0));
        q = (OmQuat){0.25 * s, (r.cy.x + r.cx.y) / s, (r.cz.x + r.cx.z) / s, (r.cy.z - r.cz.y) / s};
    } else if (yy >= zz) {
        double s = 2.0 * sqrt(fmax(1.0 - xx + yy - zz, 0.0));
        q = (OmQuat){(r.cy.x + r.cx.y) / s, 0.25 * s, (r.cz.y + r.cy.z) / s, (r.cz.x - r.cx.z) / s};
    } else {
        double s = 2.0 * sqrt(fmax(1.0 - xx - yy + zz, 0.0));
        q = (OmQuat){(r.cz.x + r.cx.z) / s, (r.cz.y + r.cy.z) / s, 0.25 * s, (r.cx.y - r.cy.x) / s};
    }
    return om_quat_normalize(q);
}

OmQuat om_quat_slerp(OmQuat a, OmQuat b, double t) {
    double c = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
    if (c < 0.0) {
        b = (OmQuat){-b.x, -b.y, -b.z, -b.w};
        c = -c;
    }
    double wa = 1.0 - t, wb = t;
    if (c < 0.9999) {  // sin(angle) is not small
        double angle = acos(c), s = sin(angle);
        wa = sin(wa * angle) / s;
        wb = sin(wb * angle) / s;
    }
    OmQuat q = {wa * a.x + wb * b.x, wa * a.y + wb * b.y, wa * a.z + wb * b.z, wa * a.w + wb * b.w};
    return om_quat_normalize(q);
}

OmPose om_pose_look_at(OmVec3 eye, OmVec3 target, OmVec3 up) {
    OmVec3 z = om_normalize(om_sub(target, eye));
    if (om_norm2(z) == 0.0) z = om_vec3(0, 0, 1);
    OmVec3 x = om_cross(z, up);  // right, for y down
    x = om_norm(x) > 1e-12 ? om_normalize(x) : om_orthogonal(z);
    OmVec3 y = om_cross(z, x);
    OmPose pose = {eye, om_quat_from_mat3(om_mat3_cols(x, y, z))};
    return pose;
}
