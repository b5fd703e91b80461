// tissue_embed.c: points carried by elements.
//
// A point goes to the element that holds it in the rest shape, or the one nearest to it; outside, its
// barycentric coordinates extrapolate, so that a point just off the surface moves with it. All elements
// are tried, spheres around them first: done once a scene.
#include "tissue/tissue_engine.h"

typedef struct Search {
    const OmTissueModel* m;
    const double* point;
    double* sphere;  // centre and radius of each element                          (ntet x 4)
    OmEmbedding* out;
} Search;

static OmVec3 closest_on_segment(OmVec3 p, OmVec3 a, OmVec3 b) {
    OmVec3 ab = om_sub(b, a);
    double t = om_dot(om_sub(p, a), ab) / om_norm2(ab);  // edges of valid elements have length
    return om_madd(a, fmin(1, fmax(0, t)), ab);
}

static double distance_to_triangle(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c) {
    OmVec3 n = om_cross(om_sub(b, a), om_sub(c, a));
    double ua = om_dot(n, om_cross(om_sub(b, p), om_sub(c, p)));
    double ub = om_dot(n, om_cross(om_sub(c, p), om_sub(a, p)));
    double uc = om_dot(n, om_cross(om_sub(a, p), om_sub(b, p)));
    if (ua >= 0 && ub >= 0 && uc >= 0) return fabs(om_dot(n, om_sub(p, a))) / om_norm(n);
    double d = om_norm(om_sub(p, closest_on_segment(p, a, b)));
    d = fmin(d, om_norm(om_sub(p, closest_on_segment(p, b, c))));
    return fmin(d, om_norm(om_sub(p, closest_on_segment(p, c, a))));
}

static void barycentric(const double* x, const int* v, OmVec3 p, double bary[4]) {
    OmVec3 o = om_load3(x, v[0]), a = om_sub(om_load3(x, v[1]), o),
           b = om_sub(om_load3(x, v[2]), o), c = om_sub(om_load3(x, v[3]), o), d = om_sub(p, o);
    double volume = om_dot(om_cross(a, b), c);  // checked positive when the model was made
    bary[1] = om_dot(om_cross(d, b), c) / volume;
    bary[2] = om_dot(om_cross(a, d), c) / volume;
    bary[3] = om_dot(om_cross(a, b), d) / volume;
    bary[0] = 1 - bary[1] - bary[2] - bary[3];
}

static double distance_to_tet(const double* x, const int* v, OmVec3 p) {
    double bary[4];
    barycentric(x, v, p, bary);
    if (fmin(fmin(bary[0], bary[1]), fmin(bary[2], bary[3])) >= 0) return 0;
    OmVec3 a = om_load3(x, v[0]), b = om_load3(x, v[1]), c = om_load3(x, v[2]),
           d = om_load3(x, v[3]);
    double near = fmin(distance_to_triangle(p, a, b, c), distance_to_triangle(p, a, b, d));
    return fmin(near, fmin(distance_to_triangle(p, a, c, d), distance_to_triangle(p, b, c, d)));
}

static void search_points(void* ctx, int begin, int end, int block) {
    (void)block;
    const Search* s = ctx;
    const OmTetMesh* mesh = &s->m->mesh;
    for (int k = begin; k < end; ++k) {
        OmVec3 p = om_load3(s->point, k);
        double best = INFINITY;
        int found = 0;
        for (int e = 0; e < mesh->ntet && best > 0; ++e) {
            const double* c = s->sphere + 4 * (size_t)e;
            double reach = best + c[3];
            if (om_norm2(om_sub(p, om_vec3(c[0], c[1], c[2]))) >= reach * reach) continue;
            double d = distance_to_tet(mesh->x, mesh->tet_vert + 4 * (size_t)e, p);
            if (d >= best) continue;
            best = d;
            found = e;
        }
        s->out->tet[k] = found;
        barycentric(mesh->x, mesh->tet_vert + 4 * (size_t)found, p, s->out->bary + 4 * (size_t)k);
        for (int a = 0; a < 4; ++a)
            s->out->tet_vert[4 * (size_t)k + (size_t)a] =
                mesh->tet_vert[4 * (size_t)found + (size_t)a];
    }
}

static void bound_elements(const OmTetMesh* mesh, double* sphere) {
    for (int e = 0; e < mesh->ntet; ++e) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        OmVec3 c = {0, 0, 0};
        for (int a = 0; a < 4; ++a) c = om_madd(c, 0.25, om_load3(mesh->x, v[a]));
        double r2 = 0;
        for (int a = 0; a < 4; ++a) r2 = fmax(r2, om_norm2(om_sub(om_load3(mesh->x, v[a]), c)));
        double* s = sphere + 4 * (size_t)e;
        s[0] = c.x, s[1] = c.y, s[2] = c.z;
        s[3] = sqrt(r2);
    }
}

OmStatus om_tissue_embed(const OmTissueModel* m, int npoint, const double* point,
                         OmEmbedding* embedding) {
    *embedding = (OmEmbedding){0};
    OM_CHECK(npoint >= 0 && (npoint == 0 || point), OM_INVALID,
             "tissue: %d points to embed, and their list is null", npoint);
    for (int k = 0; k < npoint; ++k)
        OM_CHECK(om_is_finite3(om_load3(point, k)), OM_INVALID,
                 "tissue: point %d to embed is not finite", k);
    OmStatus status = OM_OK;
    Search s = {m, point, om_alloc((size_t)m->mesh.ntet, 4 * sizeof(double)), embedding};
    if (!s.sphere) return OM_NO_MEMORY;
    OM_ALLOC_DONE(embedding->tet, npoint);
    OM_ALLOC_DONE(embedding->bary, 4 * (size_t)npoint);
    OM_ALLOC_DONE(embedding->tet_vert, 4 * (size_t)npoint);
    embedding->npoint = npoint;
    bound_elements(&m->mesh, s.sphere);
    om_parallel_for(m->def.solver.nworker, npoint, 16, search_points, &s);
done:
    om_free(s.sphere);
    if (status < 0) om_embedding_done(embedding);
    return status;
}

void om_embedding_done(OmEmbedding* e) {
    om_free(e->tet);
    om_free(e->bary);
    om_free(e->tet_vert);
    *e = (OmEmbedding){0};
}

void om_embedding_eval(const OmEmbedding* e, const double* x, double* point) {
    for (int k = 0; k < e->npoint; ++k) {
        OmVec3 p = {0, 0, 0};
        for (int a = 0; a < 4; ++a)
            p = om_madd(p, e->bary[4 * k + a], om_load3(x, e->tet_vert[4 * k + a]));
        om_store3(point, k, p);
    }
}
