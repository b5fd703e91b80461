// tissue_embed.c: points carried by elements.
//
// A point is bound to the element that contains it in the rest shape, or else to the nearest element. Barycentric
// coordinates extrapolate outside of the element, so a point slightly off the surface moves with the surface. The
// search tests all elements, first their bounding spheres; it runs once for each scene.
//
// A mesh without elements has particles. A point is then bound to the nearest particle and to three more particles
// near it that span a tetrahedron with the first. In a single layer of particles, three of them span a triangle, and
// the projection of the point on its plane is bound.
#include <string.h>

#include "tissue/tissue_internal.h"

typedef struct Search {
    const OmTissueModel* m;
    const double* point;
    double* sphere;  // centre and radius of each element                          (ntet x 4)
    OmEmbedding* out;
} Search;

static OmVec3 closest_on_segment(OmVec3 p, OmVec3 a, OmVec3 b) {
    OmVec3 ab = om_sub(b, a);
    double t = om_dot(om_sub(p, a), ab) / om_norm2(ab);  // edges of valid elements are not 0
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

double om__barycentric(const double* x, const int* v, OmVec3 p, double bary[4]) {
    OmVec3 o = om_load3(x, v[0]), a = om_sub(om_load3(x, v[1]), o),
           b = om_sub(om_load3(x, v[2]), o), c = om_sub(om_load3(x, v[3]), o), d = om_sub(p, o);
    double volume = om_dot(om_cross(a, b), c);
    bary[1] = om_dot(om_cross(d, b), c) / volume;
    bary[2] = om_dot(om_cross(a, d), c) / volume;
    bary[3] = om_dot(om_cross(a, b), d) / volume;
    bary[0] = 1 - bary[1] - bary[2] - bary[3];
    return fmin(fmin(bary[0], bary[1]), fmin(bary[2], bary[3]));
}

static double distance_to_tet(const double* x, const int* v, OmVec3 p) {
    double bary[4];
    if (om__barycentric(x, v, p, bary) >= 0) return 0;
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
        om__barycentric(mesh->x, mesh->tet_vert + 4 * (size_t)found, p,
                        s->out->bary + 4 * (size_t)k);
        for (int a = 0; a < 4; ++a)
            s->out->tet_vert[4 * (size_t)k + (size_t)a] =
                mesh->tet_vert[4 * (size_t)found + (size_t)a];
    }
}

// ---- particles without elements -----------------------------------------------------------------------

#define NEAR 24    // number of candidate particles
#define WIDE 0.25  // smallest sine of the angle of an edge to the edge or plane before

// The NEAR particles nearest to p, nearest first; returns how many there are.
static int find_nearest(const OmTetMesh* mesh, OmVec3 p, int vert[NEAR]) {
    double d2[NEAR];
    int num = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        double d = om_norm2(om_sub(om_load3(mesh->x, i), p));
        if (num == NEAR && d >= d2[NEAR - 1]) continue;
        int k = num < NEAR ? num++ : NEAR - 1;
        for (; k > 0 && d2[k - 1] > d; --k) d2[k] = d2[k - 1], vert[k] = vert[k - 1];
        d2[k] = d, vert[k] = i;
    }
    return num;
}

// Barycentric weights of p at the corners o, o + e[0], ... of a point, line, triangle or tetrahedron (n edges).
static void weigh_point(OmVec3 d, int n, const OmVec3 e[3], double bary[4]) {
    memset(bary, 0, 4 * sizeof *bary);
    if (n == 1) bary[1] = om_dot(d, e[0]) / om_norm2(e[0]);
    if (n == 2) {
        OmVec3 normal = om_cross(e[0], e[1]);
        double area2 = om_norm2(normal);  // > 0: the corners passed the test with WIDE
        bary[1] = om_dot(om_cross(d, e[1]), normal) / area2;
        bary[2] = om_dot(om_cross(e[0], d), normal) / area2;
    }
    if (n == 3) {
        double volume = om_dot(om_cross(e[0], e[1]), e[2]);
        bary[1] = om_dot(om_cross(d, e[1]), e[2]) / volume;
        bary[2] = om_dot(om_cross(e[0], d), e[2]) / volume;
        bary[3] = om_dot(om_cross(e[0], e[1]), d) / volume;
    }
    bary[0] = 1 - bary[1] - bary[2] - bary[3];
}

static void embed_in_particles(const OmTetMesh* mesh, OmVec3 p, int vert[4], double bary[4]) {
    int near[NEAR], num = find_nearest(mesh, p, near), n = 0;
    OmVec3 o = om_load3(mesh->x, near[0]), e[3];
    for (int a = 0; a < 4; ++a) vert[a] = near[0];
    for (int k = 1; k < num && n < 3; ++k) {
        OmVec3 d = om_sub(om_load3(mesh->x, near[k]), o);
        double length = om_norm(d);
        bool is_wide = length > 0;
        if (n == 1) is_wide = om_norm(om_cross(e[0], d)) > WIDE * om_norm(e[0]) * length;
        if (n == 2) {
            OmVec3 normal = om_cross(e[0], e[1]);
            is_wide = fabs(om_dot(normal, d)) > WIDE * om_norm(normal) * length;
        }
        if (!is_wide) continue;
        e[n++] = d;
        vert[n] = near[k];
    }
    weigh_point(om_sub(p, o), n, e, bary);
}

static void search_particles(void* ctx, int begin, int end, int block) {
    (void)block;
    const Search* s = ctx;
    for (int k = begin; k < end; ++k) {
        s->out->tet[k] = -1;
        embed_in_particles(&s->m->mesh, om_load3(s->point, k), s->out->tet_vert + 4 * (size_t)k,
                           s->out->bary + 4 * (size_t)k);
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
    om_parallel_for(m->def.solver.nworker, npoint, 16,
                    m->mesh.ntet > 0 ? search_points : search_particles, &s);
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
