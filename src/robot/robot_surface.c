// robot_surface.c: the surface of a tool for pictures: a shaft, a wrist, and two jaws that open.
#include <string.h>

#include "omentum/robot.h"

#define NSECTOR 12
#define SHAFT_RADIUS 0.0042  // m
#define SHAFT_LENGTH 0.25    // m, drawn length above the wrist
#define WRIST_RADIUS (0.8 * SHAFT_RADIUS)
#define JAW_LENGTH 0.011      // m
#define JAW_WIDTH 0.0022      // m, half width at the root
#define JAW_THICKNESS 0.0017  // m, of each jaw at the root
#define TUBE_NTRI (2 * NSECTOR + 2 * (NSECTOR - 2))
#define NVERT (4 * NSECTOR + 2 * 8)
#define NTRI (2 * TUBE_NTRI + 2 * 12)

_Static_assert(OM_PSM_SHAFT_NVERT == 2 * NSECTOR, "the shaft is the first tube");
_Static_assert(OM_PSM_SHAFT_NTRI == TUBE_NTRI, "the shaft is the first tube");

// A capped cylinder or cone from a to b.
static int write_tube(double* x, int v, OmVec3 a, OmVec3 b, double ra, double rb) {
    OmVec3 axis = om_normalize(om_sub(b, a));
    OmVec3 u = om_orthogonal(axis), w = om_cross(axis, u);
    for (int i = 0; i < NSECTOR; ++i) {
        double t = 2 * OM_PI * i / NSECTOR;
        OmVec3 r = om_add(om_scale(cos(t), u), om_scale(sin(t), w));
        om_store3(x, v + i, om_madd(a, ra, r));
        om_store3(x, v + NSECTOR + i, om_madd(b, rb, r));
    }
    return v + 2 * NSECTOR;
}

static int write_tube_triangles(int* tri, int t, int v) {
    for (int i = 0; i < NSECTOR; ++i) {
        int j = (i + 1) % NSECTOR, a = v + i, b = v + j, c = a + NSECTOR, d = b + NSECTOR;
        memcpy(&tri[3 * t++], (int[3]){a, b, d}, 3 * sizeof(int));
        memcpy(&tri[3 * t++], (int[3]){a, d, c}, 3 * sizeof(int));
    }
    for (int i = 1; i + 1 < NSECTOR; ++i) {
        memcpy(&tri[3 * t++], (int[3]){v, v + i + 1, v + i}, 3 * sizeof(int));
        int c = v + NSECTOR;
        memcpy(&tri[3 * t++], (int[3]){c, c + i, c + i + 1}, 3 * sizeof(int));
    }
    return t;
}

// A jaw: a tapered box from the wrist yaw axis, turned by half the opening. The tips meet at the tool tip.
static int write_jaw(double* x, int v, OmPose tip, double angle, double side) {
    OmQuat open = om_quat_axis_angle(om_vec3(0, 1, 0), side * 0.5 * angle);
    for (int i = 0; i < 8; ++i) {
        bool is_tip = i & 4;
        double half = is_tip ? 0.4 * JAW_WIDTH : JAW_WIDTH;
        double thick = (i & 2 ? 1.0 : 0.0) * (is_tip ? 0.0007 : JAW_THICKNESS);
        OmVec3 p = om_vec3(side * thick, i & 1 ? half : -half, is_tip ? JAW_LENGTH : 0.0);
        OmVec3 local = om_add(om_quat_rotate(open, p), om_vec3(0, 0, -JAW_LENGTH));
        om_store3(x, v + i, om_pose_apply(tip, local));
    }
    return v + 8;
}

static int write_jaw_triangles(int* tri, int t, int v, bool is_mirrored) {
    static const int quad[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                   {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    for (int f = 0; f < 6; ++f) {
        const int* k = quad[f];
        int a[3] = {v + k[0], v + k[2], v + k[1]}, b[3] = {v + k[0], v + k[3], v + k[2]};
        if (is_mirrored) {
            a[1] = v + k[1], a[2] = v + k[2];
            b[1] = v + k[2], b[2] = v + k[3];
        }
        memcpy(&tri[3 * t++], a, sizeof a);
        memcpy(&tri[3 * t++], b, sizeof b);
    }
    return t;
}

// Where the parts of the tool meet, world frame.
typedef struct Parts {
    OmPose tip;
    OmVec3 top, wrist, root;  // ends of shaft and wrist as drawn; the root is the wrist yaw axis
} Parts;

static Parts find_parts(const OmPsm* psm, const double q[6]) {
    Parts p = {.tip = om_psm_forward(psm, q)};
    OmVec3 forward = om_quat_rotate(p.tip.q, om_vec3(0, 0, 1));
    p.root = om_madd(p.tip.p, -JAW_LENGTH, forward);
    OmVec3 shaft = om_normalize(om_sub(psm->pose_world_rcm.p, p.root));
    p.wrist = om_madd(p.root, psm->wrist, shaft);
    p.top = om_madd(p.wrist, SHAFT_LENGTH, shaft);
    return p;
}

void om_psm_surface_update(const OmPsm* psm, const double q[6], double jaw, OmSurface* surface) {
    Parts p = find_parts(psm, q);
    double* x = surface->x;
    int v = write_tube(x, 0, p.top, p.wrist, SHAFT_RADIUS, SHAFT_RADIUS);
    v = write_tube(x, v, p.wrist, p.root, WRIST_RADIUS, 0.55 * SHAFT_RADIUS);
    v = write_jaw(x, v, p.tip, jaw, 1.0);
    v = write_jaw(x, v, p.tip, jaw, -1.0);
    OM_ASSERT(v == NVERT);
}

void om_psm_capsules(const OmPsm* psm, const double q[6], double jaw,
                     OmPsmCapsule capsule[OM_PSM_NCAPSULE]) {
    Parts p = find_parts(psm, q);
    capsule[0] = (OmPsmCapsule){p.top, p.wrist, SHAFT_RADIUS};
    capsule[1] = (OmPsmCapsule){p.wrist, p.root, WRIST_RADIUS};
    double radius = hypot(JAW_WIDTH, JAW_THICKNESS);
    for (int k = 0; k < 2; ++k) {
        OmQuat open = om_quat_axis_angle(om_vec3(0, 1, 0), (k == 0 ? 0.5 : -0.5) * jaw);
        OmVec3 along = om_quat_rotate(open, om_vec3(0, 0, JAW_LENGTH));
        OmVec3 end = om_add(p.root, om_quat_rotate(p.tip.q, along));
        capsule[2 + k] = (OmPsmCapsule){p.root, end, radius};
    }
}

OmStatus om_psm_surface(const OmPsm* psm, const double q[6], double jaw, OmSurface* surface) {
    OM_TRY(om_surface_init(surface, NVERT, NTRI));
    int t = write_tube_triangles(surface->tri_vert, 0, 0);
    t = write_tube_triangles(surface->tri_vert, t, 2 * NSECTOR);
    t = write_jaw_triangles(surface->tri_vert, t, 4 * NSECTOR, false);
    t = write_jaw_triangles(surface->tri_vert, t, 4 * NSECTOR + 8, true);
    OM_ASSERT(t == NTRI);
    om_psm_surface_update(psm, q, jaw, surface);
    return OM_OK;
}
