// shape_stuff_improve.c: larger angles between edges of different lengths.
//
// Vertices of flat elements move where the smallest angle of the elements around them grows: inner ones anywhere, those
// on the boundary in the plane of the triangles around them, by at most SLIDE of the shortest edge there. No element
// gets a smaller angle than the flattest one had.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_stuff.h"

#define FLAT 0.26   // rad, 15 degrees: vertices of elements with a smaller angle move
#define PASSES 5    //
#define SLIDE 0.15  // of the shortest edge at a vertex

typedef struct Star {
    const OmTetMesh* mesh;
    int *adr, *list;          // elements at each vertex
    OmVec3* normal;           // sum of the normals of boundary triangles, 0 of an inner vertex
    unsigned char* is_sharp;  // at an edge or a corner of the boundary: it stays
} Star;

double om__tet_flatness(const OmTetMesh* m, int e) {
    const int* v = m->tet_vert + 4 * (size_t)e;
    const OmVec3 a = om_load3(m->x, v[0]);
    const OmVec3 b = om_sub(om_load3(m->x, v[1]), a), c = om_sub(om_load3(m->x, v[2]), a);
    const OmVec3 d = om_sub(om_load3(m->x, v[3]), a);
    double smallest, largest;
    if (!(om_dot(om_cross(b, c), d) > 0)) return 0;
    om_tet_dihedral(m, e, &smallest, &largest);
    return fmin(smallest, OM_PI - largest);
}

static double worst_around(const Star* s, int v) {
    double worst = HUGE_VAL;
    for (int i = s->adr[v]; i < s->adr[v + 1]; i++)
        worst = fmin(worst, om__tet_flatness(s->mesh, s->list[i]));
    return worst;
}

static OmStatus star_init(const OmTetMesh* m, Star* s) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    int* vert = NULL;
    s->mesh = m;
    OM_CALLOC_DONE(s->adr, (size_t)m->nvert + 1);
    OM_ALLOC_DONE(s->list, 4 * (size_t)m->ntet);
    OM_CALLOC_DONE(s->normal, (size_t)m->nvert);
    OM_CALLOC_DONE(s->is_sharp, (size_t)m->nvert);
    for (int i = 0; i < 4 * m->ntet; i++) s->adr[m->tet_vert[i]]++;
    for (int v = 0; v < m->nvert; v++) s->adr[v + 1] += s->adr[v];
    for (int i = 4 * m->ntet; i-- > 0;) s->list[--s->adr[m->tet_vert[i]]] = i / 4;
    OM_TRY_DONE(om_tet_mesh_boundary(m, &boundary, &vert));
    for (int pass = 0; pass < 2; pass++) {
        for (int t = 0; t < boundary.ntri; t++) {
            const int* v = boundary.tri_vert + 3 * (size_t)t;
            const OmVec3 a = om_load3(boundary.x, v[0]);
            const OmVec3 n = om_normalize(om_cross(om_sub(om_load3(boundary.x, v[1]), a),
                                                   om_sub(om_load3(boundary.x, v[2]), a)));
            for (int c = 0; c < 3; c++) {
                OmVec3* sum = &s->normal[vert[v[c]]];
                if (pass == 0)
                    *sum = om_add(*sum, n);
                else if (om_dot(om_normalize(*sum), n) < 0.8)
                    s->is_sharp[vert[v[c]]] = 1;
            }
        }
    }
done:
    om_surface_done(&boundary);
    om_free(vert);
    return status;
}

// Try places around a vertex: towards the middle of its neighbours, then along six directions.
static void move_vertex(const Star* s, OmTetMesh* m, int v) {
    static const double part[2] = {1, 0.4};
    const OmVec3 x = om_load3(m->x, v), n = s->normal[v];
    const bool is_inner = om_norm2(n) == 0;
    OmVec3 sum = om_vec3(0, 0, 0), best = x;
    double shortest = HUGE_VAL, count = 0;
    for (int i = s->adr[v]; i < s->adr[v + 1]; i++) {
        for (int c = 0; c < 4; c++) {
            const int w = m->tet_vert[4 * (size_t)s->list[i] + (size_t)c];
            if (w == v) continue;
            sum = om_add(sum, om_load3(m->x, w));
            shortest = fmin(shortest, om_distance(x, om_load3(m->x, w)));
            count++;
        }
    }
    double quality = worst_around(s, v);
    const double reach = (is_inner ? 0.5 : SLIDE) * shortest;
    OmVec3 step[8] = {om_sub(om_scale(1 / count, sum), x)};  // count > 0
    int nstep = 1;
    if (is_inner) {
        for (int a = 0; a < 3; a++)
            for (int side = -1; side <= 1; side += 2)
                step[nstep++] = om_scale(side * reach, om_vec3(a == 0, a == 1, a == 2));
    } else {
        const OmVec3 up = om_normalize(n), u = om_orthogonal(up), w = om_cross(up, u);
        step[0] = om_madd(step[0], -om_dot(step[0], up), up);
        for (int side = -1; side <= 1; side += 2) {
            step[nstep++] = om_scale(side * reach, u);
            step[nstep++] = om_scale(side * reach, w);
        }
    }
    if (om_norm(step[0]) > reach) step[0] = om_scale(reach / om_norm(step[0]), step[0]);
    for (int k = 0; k < 2 * nstep; k++) {
        om_store3(m->x, v, om_madd(x, part[k % 2], step[k / 2]));
        const double q = worst_around(s, v);
        if (q > quality) quality = q, best = om_load3(m->x, v);
    }
    om_store3(m->x, v, best);
}

OmStatus om__mesh_improve(OmTetMesh* mesh) {
    OmStatus status = OM_OK;
    Star star = {0};
    unsigned char* is_flat = NULL;
    OM_TRY_DONE(star_init(mesh, &star));
    OM_ALLOC_DONE(is_flat, mesh->nvert);
    for (int pass = 0; pass < PASSES; pass++) {
        memset(is_flat, 0, (size_t)mesh->nvert);
        for (int e = 0; e < mesh->ntet; e++) {
            if (om__tet_flatness(mesh, e) >= FLAT) continue;
            for (int c = 0; c < 4; c++) is_flat[mesh->tet_vert[4 * (size_t)e + (size_t)c]] = 1;
        }
        for (int v = 0; v < mesh->nvert; v++)
            if (is_flat[v] && !star.is_sharp[v]) move_vertex(&star, mesh, v);
    }
done:
    om_free(star.adr);
    om_free(star.list);
    om_free(star.normal);
    om_free(star.is_sharp);
    om_free(is_flat);
    return status;
}
