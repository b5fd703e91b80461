// pbd_length.c: XPBD on the lengths of edges and the volumes of elements (Macklin et al. 2016).
//
// C = |a - b| - rest length with the compliance 1 / k, and C = V - V0 with V0 / K. Elements process their edges and
// their volume in the colours of pbd_elastic.c; an edge of n elements is n springs of k / n. Springs and a bulk
// modulus are not an elastic law: they have no Poisson's ratio of their own, and their resistance depends on the
// mesh.
#include "base/base_multiversion.h"
#include "pbd/pbd_internal.h"

static const int edge_corner[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

// Number of elements at each of the element's edges: elements around one end that also have the other.
static int count_sharing(const OmTetMesh* mesh, const int* adr, const int* elem, int a, int b) {
    int count = 0;
    for (int n = adr[a]; n < adr[a + 1]; ++n) {
        const int* v = mesh->tet_vert + 4 * (size_t)elem[n];
        count += v[0] == b || v[1] == b || v[2] == b || v[3] == b;
    }
    return count;
}

OmStatus om__pbd_make_lengths(const OmTissueModel* m, const OmPbdDef* def, OmPbdElastic* el) {
    const OmTetMesh* mesh = &m->mesh;
    OmStatus status = OM_OK;
    int *adr = NULL, *elem = NULL;
    OM_CALLOC_DONE(adr, (size_t)mesh->nvert + 1);
    OM_ALLOC_DONE(elem, 4 * (size_t)mesh->ntet);
    OM_ALLOC_DONE(el->length, el->ntet);
    for (int n = 0; n < 4 * mesh->ntet; ++n) ++adr[mesh->tet_vert[n] + 1];
    for (int i = 0; i < mesh->nvert; ++i) adr[i + 1] += adr[i];
    for (int n = 4 * mesh->ntet - 1; n >= 0; --n) elem[--adr[mesh->tet_vert[n] + 1]] = n / 4;
    for (int i = 0; i < mesh->nvert; ++i) adr[i] = adr[i + 1];
    adr[mesh->nvert] = 4 * mesh->ntet;
    for (int e = 0; e < el->ntet; ++e) {
        const OmPbdTet* t = &el->tet[e];
        OmPbdLength* l = &el->length[e];
        for (int k = 0; k < 6; ++k) {
            int a = t->vert[edge_corner[k][0]], b = t->vert[edge_corner[k][1]];
            l->rest[k] = om_distance(om_load3(mesh->x, a), om_load3(mesh->x, b));
            l->compliance[k] = count_sharing(mesh, adr, elem, a, b) / def->edge_stiffness;
        }
        OmVec3 o = om_load3(mesh->x, t->vert[0]), a = om_sub(om_load3(mesh->x, t->vert[1]), o),
               b = om_sub(om_load3(mesh->x, t->vert[2]), o),
               c = om_sub(om_load3(mesh->x, t->vert[3]), o);
        l->volume = om_dot(om_cross(a, b), c) / 6;
        l->volume_compliance = def->volume_stiffness > 0 ? l->volume / def->volume_stiffness : -1;
    }
done:
    om_free(adr);
    om_free(elem);
    return status;
}

// Vertex i moves by its part of d; for a prescribed vertex it is a reaction.
static inline void give_way(const OmPbdStep* s, int i, OmVec3 d) {
    double give = s->w->give[i];
    if (give > 0)
        om_store3(s->x, i, om_madd(om_load3(s->x, i), give, d));
    else
        om_store3(s->w->hold, i, om_madd(om_load3(s->w->hold, i), -1 / (s->sub * s->h), d));
}

static inline void solve_edge(const OmPbdStep* s, int a, int b, double rest, double compliance,
                              double* lambda) {
    OmVec3 d = om_sub(om_load3(s->x, a), om_load3(s->x, b));
    double length = om_norm(d), soft = compliance / (s->sub * s->sub);
    if (!(length > 1e-12)) return;  // no direction to separate them
    double more = (rest - length - soft * *lambda) / (s->w->give[a] + s->w->give[b] + soft);
    *lambda += more;
    d = om_scale(more / length, d);
    give_way(s, a, d);
    give_way(s, b, om_scale(-1, d));
}

static inline void solve_volume(const OmPbdStep* s, const OmPbdTet* t, const OmPbdLength* l,
                                double* lambda) {
    OmVec3 x[4], g[4];
    for (int a = 0; a < 4; ++a) x[a] = om_load3(s->x, t->vert[a]);
    OmVec3 a = om_sub(x[1], x[0]), b = om_sub(x[2], x[0]), c = om_sub(x[3], x[0]);
    g[1] = om_scale(1.0 / 6, om_cross(b, c));
    g[2] = om_scale(1.0 / 6, om_cross(c, a));
    g[3] = om_scale(1.0 / 6, om_cross(a, b));
    g[0] = om_scale(-1, om_add(g[1], om_add(g[2], g[3])));
    double soft = l->volume_compliance / (s->sub * s->sub), sum = soft;
    for (int k = 0; k < 4; ++k) sum += s->w->give[t->vert[k]] * om_norm2(g[k]);
    double more = (l->volume - om_dot(a, g[1]) - soft * *lambda) / sum;
    if (!isfinite(more)) return;
    *lambda += more;
    for (int k = 0; k < 4; ++k) give_way(s, t->vert[k], om_scale(more, g[k]));
}

OM_MULTIVERSION void om__pbd_solve_lengths(const OmPbdStep* s, int begin, int end) {
    const OmPbdElastic* el = &s->pbd->elastic;
    for (int e = begin; e < end; ++e) {
        const OmPbdTet* t = &el->tet[e];
        const OmPbdLength* l = &el->length[e];
        double* lambda = s->w->lambda + 7 * (size_t)e;
        for (int k = 0; k < 6; ++k)
            solve_edge(s, t->vert[edge_corner[k][0]], t->vert[edge_corner[k][1]], l->rest[k],
                       l->compliance[k], &lambda[k]);
        if (l->volume_compliance > 0) solve_volume(s, t, l, &lambda[6]);
    }
}
