// dds_frames.c: where a frame of the robot is, from points that it touched (Arun, Huang & Blostein 1987). The rotation
// is the polar factor of the sum of b a^T, which is no mirror also where the points are those of one.
#include "omentum/dds.h"

#define MIN_POINTS 4      // of three the residuals say nothing
#define MIN_SPREAD 0.005  // m, rms distance of the points from the nearest line

static OmVec3 centre_of(const double* x, int n) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < n; ++i) sum = om_add(sum, om_load3(x, i));
    return om_scale(1.0 / n, sum);
}

static OmMat3 outer(OmVec3 a, OmVec3 b) {
    return om_mat3_cols(om_scale(b.x, a), om_scale(b.y, a), om_scale(b.z, a));
}

static OmMat3 add(OmMat3 a, OmMat3 b) {
    return om_mat3_cols(om_add(a.cx, b.cx), om_add(a.cy, b.cy), om_add(a.cz, b.cz));
}

OmStatus om_dds_frame_fit(const double* x_frame, const double* x_world, int n, OmDdsFrame* frame,
                          int* worst) {
    *worst = -1;
    OM_CHECK(n >= MIN_POINTS, OM_INVALID, "%d points; at least %d", n, MIN_POINTS);
    for (int i = 0; i < 3 * n; ++i)
        OM_CHECK(isfinite(x_frame[i]) && isfinite(x_world[i]), OM_INVALID, "point %d is not finite",
                 i / 3 + 1);
    const OmVec3 a0 = centre_of(x_frame, n), b0 = centre_of(x_world, n);
    OmMat3 h = {0}, spread = {0};
    for (int i = 0; i < n; ++i) {
        const OmVec3 a = om_sub(om_load3(x_frame, i), a0), b = om_sub(om_load3(x_world, i), b0);
        h = add(h, outer(b, a));
        spread = add(spread, outer(b, b));
    }
    OmVec3 w;
    OmMat3 v;
    om_mat3_eigen_symmetric(spread, &w, &v);
    const double off_line = sqrt(fmax(0, w.x + w.y) / n);
    OM_CHECK(
        off_line >= MIN_SPREAD, OM_INVALID,
        "the points are within %.1f mm (rms) of one line, which leaves the turn about it open: "
        "touch points in two directions, %.0f mm apart or more",
        1e3 * off_line, 1e3 * MIN_SPREAD);
    const OmQuat q = om_quat_normalize(om_quat_from_mat3(om_mat3_polar(h)));
    frame->pose_world_frame = (OmPose){om_sub(b0, om_quat_rotate(q, a0)), q};
    frame->npoint = n;
    frame->rms = frame->max = 0;
    for (int i = 0; i < n; ++i) {
        const double off = om_distance(om_pose_apply(frame->pose_world_frame, om_load3(x_frame, i)),
                                       om_load3(x_world, i));
        frame->rms += off * off / n;
        if (off >= frame->max) frame->max = off, *worst = i;
    }
    frame->rms = sqrt(frame->rms);
    return OM_OK;
}
