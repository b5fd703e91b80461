// study_phantom.c: the breast phantom of the contact study.
//
//              probe | along -normal
//                 __ v __
//              .-'   s   `-.        s = h (sin t cos f, sin t sin f, cos t), t <= 30 degrees
//            .'      | d    `.      lesion at s - d n, d its depth
//           /        o        \     n ~ s / h^2, outward normal at s
//          |___________________|    z = 0, attached
//
// The outline is OM_PHANTOM_HALF. The body is convex, so the probe's flat face has first contact at s, and at
// every lesion more than 60 mm of tissue lie under the probe along its path. Depths and diameters are
// stratified: for any seed, lesions cover 10-35 mm and 5-10 mm.
#include <math.h>
#include <string.h>

#include "studies/study_internal.h"

#define MAX_PHANTOM_LESION 20
#define DEPTH_MIN 0.010
#define DEPTH_MAX 0.035
#define DIAMETER_MIN 0.005
#define DIAMETER_MAX 0.010
#define MAX_TILT (30 * OM_PI / 180)
#define CLEARANCE 0.003  // m between two lesions

// A random order of 0..n-1.
static void shuffle(OmRng* rng, int n, int* order) {
    for (int i = 0; i < n; ++i) order[i] = i;
    for (int i = n - 1; i > 0; --i) {
        int j = (int)om_rng_below(rng, (uint32_t)i + 1), keep = order[i];
        order[i] = order[j];
        order[j] = keep;
    }
}

OmVec3 om__study_across(OmVec3 normal, OmVec3 wish) {
    OmVec3 a = om_madd(wish, -om_dot(wish, normal), normal);
    if (om_norm(a) < 0.1) {
        wish = fabs(normal.x) < 0.9 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0);
        a = om_madd(wish, -om_dot(wish, normal), normal);
    }
    return om_normalize(a);
}

OmVec3 om__study_contour(const OmStudyLesion* l) {
    return om_madd(l->center, l->radius, l->normal);
}

static OmStudyLesion lesion_at(OmVec3 h, double tilt, double turn, double depth, double radius) {
    OmStudyLesion l;
    OmVec3 u = om_vec3(sin(tilt) * cos(turn), sin(tilt) * sin(turn), cos(tilt));
    l.touch = om_vec3(h.x * u.x, h.y * u.y, h.z * u.z);
    l.normal = om_normalize(om_vec3(u.x / h.x, u.y / h.y, u.z / h.z));
    l.center = om_madd(l.touch, -depth, l.normal);
    l.radius = radius;
    l.max = h.z;
    l.along = om__study_across(l.normal, om_vec3(1, 0, 0));
    return l;
}

static bool is_apart(const OmStudyBody* body, const OmStudyLesion* l) {
    for (int i = 0; i < body->nlesion; ++i) {
        const OmStudyLesion* other = &body->lesion[i];
        if (om_distance(other->center, l->center) < other->radius + l->radius + CLEARANCE)
            return false;
    }
    return true;
}

static OmStatus place_lesions(OmStudyBody* body, int nlesion, uint64_t seed) {
    OmRng rng = om_rng_init(seed, 0);
    int depth[MAX_PHANTOM_LESION], size[MAX_PHANTOM_LESION];
    shuffle(&rng, nlesion, depth);
    shuffle(&rng, nlesion, size);
    for (int i = 0; i < nlesion; ++i) {
        double d = DEPTH_MIN + (DEPTH_MAX - DEPTH_MIN) * (depth[i] + 0.5) / nlesion;
        double r = 0.5 * (DIAMETER_MIN + (DIAMETER_MAX - DIAMETER_MIN) * (size[i] + 0.5) / nlesion);
        OmStudyLesion l;
        int ntry = 0;
        do {
            // uniform over the cap of the unit sphere of parameters
            double tilt = acos(om_rng_range(&rng, cos(MAX_TILT), 1));
            double turn = om_rng_range(&rng, 0, 2 * OM_PI);
            l = lesion_at(body->half, tilt, turn, d, r);
            OM_CHECK(++ntry < 1000, OM_INVALID,
                     "phantom: no room for lesion %d of %d with seed %llu; use fewer lesions",
                     i + 1, nlesion, (unsigned long long)seed);
        } while (!is_apart(body, &l));
        body->lesion[body->nlesion++] = l;
    }
    return OM_OK;
}

double om__study_eval_phantom(const OmStudyBody* body, OmVec3 p) {
    return om_half_ellipsoid_eval(body->half, p);
}

OmStatus om_study_body_create_phantom(int nlesion, uint64_t seed, OmStudyBody** out) {
    *out = NULL;
    OM_CHECK(nlesion >= 1 && nlesion <= MAX_PHANTOM_LESION, OM_INVALID,
             "phantom: %d lesions; 1 to %d are possible", nlesion, MAX_PHANTOM_LESION);
    OmStudyBody* body = om_calloc(1, sizeof *body);
    if (!body) return OM_NO_MEMORY;
    snprintf(body->name, sizeof body->name, "phantom");
    OmVec3 half = OM_PHANTOM_HALF;
    body->half = half;
    body->up = om_vec3(0, 0, 1);
    body->lo = om_vec3(-half.x, -half.y, 0);
    body->hi = half;
    OmStatus status = place_lesions(body, nlesion, seed);
    if (status < 0)
        om_study_body_destroy(body);
    else
        *out = body;
    return status;
}
