// shape_skin.c: a smooth surface that rides on a coarse one.
//
// A triangle gives the map of its two edges and its unit normal: rotation, and stretch within its plane. A vertex has
// the mean of the triangles around it by their areas at rest; a place, the mean of the corners of its triangle.
// With the map of the nearest triangle alone a place jumps where it passes from triangle to triangle, by its distance
// from the surface times the angle between them: contact on such a skin does not come to rest.
#include <string.h>

#include "omentum/shape_skin.h"

struct OmSkin {
    OmSurface rest;
    double* x;        // now                                                     (nvert x 3)
    OmMat3* inverse;  // of (edge, edge, normal) of each triangle at rest        (ntri)
    double* area;     // m^2, of the triangles at rest                           (ntri)
    double* of_vert;  // m^2, around each vertex                                 (nvert)
    OmMat3* F;        // of each vertex                                          (nvert)
    OmSurfaceTree* tree;
};

// Two edges and the unit normal; a flat triangle has no normal.
static OmMat3 frame_of(const int* v, const double* x, double* area) {
    OmVec3 a = om_load3(x, v[0]), u = om_sub(om_load3(x, v[1]), a),
           w = om_sub(om_load3(x, v[2]), a), n = om_cross(u, w);
    double norm = om_norm(n);
    *area = 0.5 * norm;
    return om_mat3_cols(u, w, norm > 0 ? om_scale(1 / norm, n) : n);
}

void om_skin_destroy(OmSkin* s) {
    if (!s) return;
    om_surface_done(&s->rest);
    om_free(s->x);
    om_free(s->inverse);
    om_free(s->area);
    om_free(s->of_vert);
    om_free(s->F);
    om_surface_tree_destroy(s->tree);
    om_free(s);
}

static OmStatus measure_rest(OmSkin* s) {
    memset(s->of_vert, 0, (size_t)s->rest.nvert * sizeof *s->of_vert);
    for (int t = 0; t < s->rest.ntri; ++t) {
        const int* v = s->rest.tri_vert + 3 * (size_t)t;
        OmMat3 frame = frame_of(v, s->rest.x, &s->area[t]);
        OM_CHECK(s->area[t] > 0 && om_mat3_inverse(frame, &s->inverse[t]) == OM_OK, OM_INVALID,
                 "skin: triangle %d of the surface is flat", t);
        for (int k = 0; k < 3; ++k) s->of_vert[v[k]] += s->area[t];
    }
    return OM_OK;
}

OmStatus om_skin_create(const OmSurface* rest, OmSkin** skin) {
    *skin = NULL;
    OmStatus status = OM_OK;
    OmSkin* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OM_TRY_DONE(om_surface_tree_create(rest, &s->tree));  // checks the surface
    OM_TRY_DONE(om_surface_init(&s->rest, rest->nvert, rest->ntri));
    memcpy(s->rest.x, rest->x, 3 * (size_t)rest->nvert * sizeof *rest->x);
    memcpy(s->rest.tri_vert, rest->tri_vert, 3 * (size_t)rest->ntri * sizeof *rest->tri_vert);
    OM_ALLOC_DONE(s->x, 3 * (size_t)rest->nvert);
    OM_ALLOC_DONE(s->inverse, rest->ntri);
    OM_ALLOC_DONE(s->area, rest->ntri);
    OM_ALLOC_DONE(s->of_vert, rest->nvert);
    OM_ALLOC_DONE(s->F, rest->nvert);
    OM_TRY_DONE(measure_rest(s));
    om_skin_move(s, rest->x);
    *skin = s;
    return OM_OK;
done:
    om_skin_destroy(s);
    return status;
}

void om_skin_move(OmSkin* s, const double* x) {
    memcpy(s->x, x, 3 * (size_t)s->rest.nvert * sizeof *x);
    memset(s->F, 0, (size_t)s->rest.nvert * sizeof *s->F);
    for (int t = 0; t < s->rest.ntri; ++t) {
        const int* v = s->rest.tri_vert + 3 * (size_t)t;
        double area;
        OmMat3 F = om_mat3_mul(frame_of(v, x, &area), s->inverse[t]);
        for (int k = 0; k < 3; ++k)
            s->F[v[k]] = om_mat3_add(s->F[v[k]], om_mat3_scale(s->area[t] / s->of_vert[v[k]], F));
    }
    om_surface_tree_move(s->tree, x);
}

static OmVec3 point_on(const OmSkin* s, const OmSurfacePoint* on, const double* x) {
    const int* v = s->rest.tri_vert + 3 * (size_t)on->tri;
    OmVec3 c = {0, 0, 0};
    for (int k = 0; k < 3; ++k) c = om_madd(c, on->bary[k], om_load3(x, v[k]));
    return c;
}

static OmMat3 map_at(const OmSkin* s, const OmSurfacePoint* on) {
    const int* v = s->rest.tri_vert + 3 * (size_t)on->tri;
    OmMat3 F = om_mat3_scale(on->bary[0], s->F[v[0]]);
    for (int k = 1; k < 3; ++k) F = om_mat3_add(F, om_mat3_scale(on->bary[k], s->F[v[k]]));
    return F;
}

bool om_skin_find(const OmSkin* s, OmVec3 p, double max_distance, OmSkinPlace* place) {
    OmMat3 back;
    if (!om_surface_tree_find(s->tree, p, NULL, max_distance, &place->on)) return false;
    place->F = map_at(s, &place->on);
    if (om_mat3_inverse(place->F, &back) < 0) return false;
    place->rest =
        om_add(point_on(s, &place->on, s->rest.x), om_mat3_apply(back, om_sub(p, place->on.x)));
    return true;
}

void om_skin_bind(const OmSkin* s, OmVec3 rest, OmSkinPlace* place) {
    om_surface_tree_find(s->tree, rest, NULL, INFINITY, &place->on);  // the surface has triangles
    place->rest = rest;
    place->F = om_mat3_identity();
}

OmVec3 om_skin_put(const OmSkin* s, const OmSkinPlace* bound, OmMat3* turn) {
    OmMat3 F = map_at(s, &bound->on);
    OmVec3 off = om_sub(bound->rest, point_on(s, &bound->on, s->rest.x));
    if (turn) *turn = F;
    return om_add(point_on(s, &bound->on, s->x), om_mat3_apply(F, off));
}

double om_skin_eval(const OmSkinPlace* place, const OmSdf* sdf, double ring, OmVec3* normal) {
    OmVec3 at = place->rest;
    double g[3];
    for (int k = 0; k < 3; ++k) {
        OmVec3 step = om_vec3(k == 0 ? ring : 0, k == 1 ? ring : 0, k == 2 ? ring : 0);
        g[k] =
            (om_sdf_eval(sdf, om_add(at, step), NULL) - om_sdf_eval(sdf, om_sub(at, step), NULL)) /
            (2 * ring);
    }
    OmVec3 n = om_normalize(om_load3(g, 0));
    OmMat3 back;
    if (om_mat3_inverse(place->F, &back) == OM_OK) n = om_mat3_apply_transposed(back, n);
    double slope = om_norm(n);  // what is 1 m at rest is 1 / slope now
    *normal = slope > 0 ? om_scale(1 / slope, n) : om_vec3(0, 0, 1);
    return slope > 0 ? om_sdf_eval(sdf, at, NULL) / slope : 0;
}
