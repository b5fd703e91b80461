// match_fit.c: the twin deformed onto a scan with its own mechanics.
//
// Points of the scan are paired with the nearest points of the twin's surface that faces the camera; each pair is a
// spring across the surface and a weaker one along it, and the twin is brought to rest under these springs, weight,
// contact and grasps (om_match_find_rest), a few iterations for each set of pairs. Weights fall with the distance
// (Geman and McClure), whose scale shrinks from set to set.
#include <string.h>

#include "match/match_internal.h"
#include "omentum/shape_closest.h"
#include "omentum/shape_meshing.h"

#define NROUND 4
#define STIFF 1.0     // pulls by area over Young's modulus by edge
#define ALONG 0.02    // of the stiffness across
#define FAR 0.02      // m, scale of weights in the first round
#define NEAR 0.004    // ... and in the last
#define GRAZING 0.05  // cosine between normal and ray below which a triangle counts as hidden

// Positions of the surface's vertices, and the triangles that face the camera.
static void mark_facing(const OmMatch* m, const OmScan* scan, const double* x, double* xs,
                        unsigned char* use) {
    const OmSurface* s = &m->surface;
    for (int i = 0; i < s->nvert; ++i) om_store3(xs, i, om_load3(x, m->surface_vert[i]));
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(xs, v[0]), b = om_load3(xs, v[1]), c = om_load3(xs, v[2]);
        OmVec3 n = om_cross(om_sub(b, a), om_sub(c, a));
        OmVec3 ray = om_sub(scan->camera.pose_world_camera.p, a);
        use[t] = !scan->has_camera || om_dot(n, ray) > GRAZING * om_norm(n) * om_norm(ray);
    }
}

OmStatus om__match_pairs(MatchFit* fit, const OmScan* scan, const double* x) {
    OmMatch* m = fit->match;
    mark_facing(m, scan, x, fit->xs, fit->use);
    if (!fit->tree) {
        OmSurface s = m->surface;
        s.x = fit->xs;
        OM_TRY(om_surface_tree_create(&s, &fit->tree));
    } else {
        om_surface_tree_move(fit->tree, fit->xs);
    }
    for (int i = 0; i < scan->npoint; ++i) {
        OmSurfacePoint q = {.tri = -1};
        om_surface_tree_find(fit->tree, om_load3(scan->x, i), fit->use, INFINITY, &q);
        fit->tri[i] = q.tri;
        fit->distance[i] = q.tri < 0 ? HUGE_VAL : q.distance;
        memcpy(fit->bary + 3 * (size_t)i, q.bary, sizeof q.bary);
    }
    return OM_OK;
}

static OmVec3 triangle_normal(const MatchFit* fit, int t) {
    const int* v = fit->match->surface.tri_vert + 3 * (size_t)t;
    OmVec3 a = om_load3(fit->xs, v[0]), b = om_load3(fit->xs, v[1]), c = om_load3(fit->xs, v[2]);
    return om_normalize(om_cross(om_sub(b, a), om_sub(c, a)));
}

static int make_pulls(MatchFit* fit, const OmScan* scan, double scale, double stiffness,
                      double along) {
    int n = 0;
    for (int i = 0; i < scan->npoint; ++i) {
        if (fit->tri[i] < 0) continue;
        OmVec3 normal = triangle_normal(fit, fit->tri[i]), seen = om_load3(scan->normal, i);
        double d = fit->distance[i] / scale, w = stiffness / ((1 + d * d) * (1 + d * d));
        if (om_norm2(seen) > 0.5 && om_dot(seen, normal) < 0.3) continue;
        OmMatchPull* p = &fit->pull[n++];
        *p = (OmMatchPull){.tri = fit->tri[i],
                           .goal = om_load3(scan->x, i),
                           .normal = normal,
                           .across = w,
                           .along = along * w};
        memcpy(p->bary, fit->bary + 3 * (size_t)i, sizeof p->bary);
    }
    return n;
}

OmStatus om__match_fit_begin(OmMatch* m, int npoint, MatchFit* fit) {
    *fit = (MatchFit){.match = m};
    OM_ALLOC(fit->xs, 3 * m->surface.nvert);
    OM_ALLOC(fit->use, m->surface.ntri);
    OM_ALLOC(fit->normal, 3 * m->surface.nvert);
    om_surface_normals(&m->surface, fit->normal);
    OM_ALLOC(fit->tri, npoint);
    OM_ALLOC(fit->bary, 3 * (size_t)npoint);
    OM_ALLOC(fit->distance, npoint);
    OM_ALLOC(fit->pull, npoint);
    return OM_OK;
}

void om__match_fit_done(MatchFit* fit) {
    om_surface_tree_destroy(fit->tree);
    om_free(fit->xs);
    om_free(fit->use);
    om_free(fit->normal);
    om_free(fit->tri);
    om_free(fit->bary);
    om_free(fit->distance);
    om_free(fit->pull);
}

OmStatus om__match_fit(MatchFit* fit, const OmAcquisition* a, const double* spring, double* x) {
    OmMatch* m = fit->match;
    const OmScan* scan = &a->scan;
    double young = om_site_get_material(m->def.site, 0).young, seen = 0;
    for (int round = 0; round < NROUND; ++round) {
        OM_TRY(om__match_pairs(fit, scan, x));
        if (round == 0) {
            for (int t = 0; t < m->surface.ntri; ++t) {
                const int* v = m->surface.tri_vert + 3 * (size_t)t;
                OmVec3 p[3];
                for (int k = 0; k < 3 && fit->use[t]; ++k) p[k] = om_load3(m->surface.x, v[k]);
                if (fit->use[t])
                    seen += 0.5 * om_norm(om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0])));
            }
        }
        double stiffness = STIFF * young / m->view.edge * seen / scan->npoint;
        double scale = FAR * pow(NEAR / FAR, round / (NROUND - 1.0));
        int n = make_pulls(fit, scan, scale, stiffness, round < 2 ? 0 : ALONG);
        OmMatchLoad load = {.spring = spring,
                            .ngrasp = a->ngrasp,
                            .grasp = a->grasp,
                            .npull = n,
                            .pull = fit->pull,
                            .max_newton = round + 1 < NROUND ? 2 : 4,
                            .tolerance = 2e-4};
        OmMatchRest rest;
        OM_TRY(om_match_find_rest(m, &load, x, &rest));
        fit->nnewton += rest.nnewton;
    }
    return OM_OK;
}
