// umesh_untangle.c: move nodes beside the probe until no tetrahedron of the grid is inverted.
//
// Equilibrium uses eight Gauss points in each element. Beside the edge of a deep press a hexahedron can fold at a
// corner while det F is above 0 at all of these points: it is valid for the mechanics, and finite elements with the
// same prescribed displacements fold it, too. But some of its six tetrahedra (om_umesh_make_tet_mesh) are then
// inverted. Therefore tetrahedra below LEAST of their rest volume get a penalty K/2 (LEAST - J)^2, and the nodes
// around them are relaxed one by one together with the elastic energy (vertex block descent, as in umesh_element.c).
// J is linear in the position of one node, so the problem of a node is convex, and the bound that keeps a valid
// tetrahedron valid is exact.
//
//     first   start from the prediction
//     then    if some stay inverted: start from rest and add the prediction in parts, each so small that no
//             tetrahedron inverts, with relaxation after each part
//
// Tried and rejected: other divisions of the hexahedra (a vertex in the middle, all 64 choices of face diagonals).
// Presses of 20 mm and more leave hexahedra for which no division is valid.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"
#include "umesh/umesh_refine_internal.h"

#define LEAST 0.1f      // of the volume at rest: the penalty begins below it
#define OPEN 0.02f      // of the volume at rest: a tetrahedron above it is open
#define STIFFNESS 2e4f  // of the penalty, over the shear modulus
#define KEEP 0.2f       // of the volume of an open tetrahedron, by one step at least
#define RING 2          // layers of elements around closed ones whose nodes are relaxed
#define SETTLED 2e-5f   // m, the largest move of a node by the last sweep
#define MOVED 1e-5      // m: a node counts as moved
#define SHARE_WAY 0.15  // of the spacing: the largest move of a node by one share of the answer
#define NHALF 12        // times a share is halved before the way counts as blocked

enum { DIRECT_SWEEPS = 500, SHARE_SWEEPS = 6, LAST_SWEEPS = 100 };

typedef struct Opening {
    const OmUmeshGrid* grid;
    const unsigned char* mask;
    const float* answer;  //                                                       (nnode x 3)
    UmeshElements elements;
    float *F, *u, *before;     //                      (nelem x REFINE_F), (nnode x 3), (nnode x 3)
    float* old_min;            //                                                      (nelem)
    unsigned char* is_closed;  // once below LEAST                                     (nelem)
    unsigned char* is_near;    // closed, or in a layer around                         (nelem)
    unsigned char* is_loose;   // nodes of elements that are near                      (nnode)
    int nsweep;
} Opening;

typedef struct Tet {
    float J;            // det F
    float slope[4][3];  // its derivatives by the places of the corners, 1/m
} Tet;

static OmVec3 place_of(const Opening* o, int node) {
    const float* u = o->u + 3 * (size_t)node;
    return om_add(om_load3(o->grid->mesh.x, node), om_vec3(u[0], u[1], u[2]));
}

// det F = a . (b x c) / h^3, by the edges from corner 0.
static Tet look_at_tet(const Opening* o, int element, int which) {
    const int* tet = om__umesh_tet[which];
    const int* node = o->grid->mesh.elem_node + 8 * (size_t)element;
    const double over = 1 / (o->grid->spacing * o->grid->spacing * o->grid->spacing);
    const OmVec3 x = place_of(o, node[tet[0]]);
    const OmVec3 a = om_sub(place_of(o, node[tet[1]]), x);
    const OmVec3 b = om_sub(place_of(o, node[tet[2]]), x);
    const OmVec3 c = om_sub(place_of(o, node[tet[3]]), x);
    OmVec3 slope[4];
    slope[1] = om_scale(over, om_cross(b, c));
    slope[2] = om_scale(over, om_cross(c, a));
    slope[3] = om_scale(over, om_cross(a, b));
    slope[0] = om_scale(-1, om_add(slope[1], om_add(slope[2], slope[3])));
    Tet t = {.J = (float)om_dot(a, slope[1])};
    for (int k = 0; k < 4; ++k) {
        t.slope[k][0] = (float)slope[k].x;
        t.slope[k][1] = (float)slope[k].y;
        t.slope[k][2] = (float)slope[k].z;
    }
    return t;
}

static float least_of(const Opening* o, int element) {
    float min = INFINITY;
    for (int k = 0; k < 6; ++k) min = fminf(min, look_at_tet(o, element, k).J);
    return min;
}

static int count_inverted(const Opening* o) {
    int num = 0;
    for (int e = 0; e < o->grid->mesh.nelem; ++e)
        for (int k = 0; k < 6; ++k) num += !(look_at_tet(o, e, k).J > 0);
    return num;
}

static void clear_marks(Opening* o) {
    memset(o->is_closed, 0, (size_t)o->grid->mesh.nelem);
    memset(o->is_loose, 0, (size_t)o->grid->mesh.nnode);
}

static void mark_nodes(Opening* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    memset(o->is_loose, 0, (size_t)mesh->nnode);
    for (int k = 0; k < 8 * mesh->nelem; ++k)
        if (o->is_near[k / 8]) o->is_loose[mesh->elem_node[k]] = 1;
}

// Elements stay marked: their nodes are off the answer and must follow. @return the least det F of all tetrahedra
static float mark_closed(Opening* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    float all_min = INFINITY;
    bool is_new = false;
    for (int e = 0; e < mesh->nelem; ++e) {
        float min = least_of(o, e);
        all_min = fminf(all_min, min);
        if (min > LEAST || o->is_closed[e]) continue;
        o->is_closed[e] = 1;
        is_new = true;
    }
    if (!is_new) return all_min;
    memcpy(o->is_near, o->is_closed, (size_t)mesh->nelem);
    for (int ring = 0; ring < RING; ++ring) {
        mark_nodes(o);
        for (int k = 0; k < 8 * mesh->nelem; ++k)
            if (o->is_loose[mesh->elem_node[k]]) o->is_near[k / 8] = 1;
    }
    mark_nodes(o);
    return all_min;
}

// ---- one node -----------------------------------------------------------------------------------------

typedef struct NodeTet {  // a tetrahedron by the place of one of its corners
    float J, slope[3];
} NodeTet;

static int find_node_tets(const Opening* o, int node, NodeTet tet[48]) {
    const UmeshElements* t = &o->elements;
    int num = 0;
    for (int k = t->use_adr[node]; k < t->use_adr[node + 1]; ++k) {
        for (int s = 0; s < 6; ++s) {
            int a = 0;
            while (a < 4 && om__umesh_tet[s][a] != t->use[k] % 8) ++a;
            if (a == 4) continue;
            Tet all = look_at_tet(o, t->use[k] / 8, s);
            tet[num].J = all.J;
            memcpy(tet[num++].slope, all.slope[a], sizeof all.slope[a]);
        }
    }
    return num;
}

// One Newton step of one node. @return its length, m
static float relax_node(Opening* o, int node) {
    const UmeshElements* t = &o->elements;
    NodeTet tet[48];
    float gradient[3], H[6], step[3];
    const int ntet = find_node_tets(o, node, tet);
    om__umesh_node_look(t, node, o->F, gradient, H);
    for (int k = 0; k < ntet; ++k) {
        const float *s = tet[k].slope, lack = LEAST - tet[k].J;
        if (!(lack > 0)) continue;
        for (int i = 0; i < 3; ++i) {
            gradient[i] -= STIFFNESS * lack * s[i];
            H[i] += STIFFNESS * s[i] * s[i];
        }
        H[3] += STIFFNESS * s[0] * s[1];
        H[4] += STIFFNESS * s[0] * s[2];
        H[5] += STIFFNESS * s[1] * s[2];
    }
    float share = om__umesh_node_step(t, node, o->F, gradient, H, step);
    for (int k = 0; k < ntet; ++k) {
        const float* s = tet[k].slope;
        const float loss = -(s[0] * step[0] + s[1] * step[1] + s[2] * step[2]);
        const float max = (1 - KEEP) * tet[k].J;
        if (max > 0 && share * loss > max) share = max / loss;
    }
    for (int i = 0; i < 3; ++i) step[i] *= share;
    om__umesh_node_move(t, node, step, o->F, o->u);
    return sqrtf(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
}

// ---- all nodes ----------------------------------------------------------------------------------------

// Forwards and backwards in turn, until all is open and little moves. @return whether all is open
static bool relax(Opening* o, int nsweep) {
    const UmeshElements* t = &o->elements;
    const int nfree = t->color_adr[8];
    float min = mark_closed(o);
    for (int sweep = 0; sweep < nsweep; ++sweep) {
        float max = 0;
        for (int at = 0; at < nfree; ++at) {
            const int node = t->color_node[sweep % 2 ? nfree - 1 - at : at];
            if (!o->mask[node] && o->is_loose[node]) max = fmaxf(max, relax_node(o, node));
        }
        ++o->nsweep;
        min = mark_closed(o);
        if (min > OPEN && max < SETTLED) break;
    }
    return min > OPEN;
}

static bool open_directly(Opening* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    memcpy(o->u, o->answer, 3 * (size_t)mesh->nnode * sizeof *o->u);
    om__umesh_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    clear_marks(o);
    return relax(o, DIRECT_SWEEPS);
}

// u + share of the answer: whether nothing is inverted by it. If so, F is of it.
static bool add_share(Opening* o, float share) {
    const OmFemMesh* mesh = &o->grid->mesh;
    for (int i = 0; i < 3 * mesh->nnode; ++i) o->u[i] = o->before[i] + share * o->answer[i];
    for (int e = 0; e < mesh->nelem; ++e) {
        float J = least_of(o, e);
        if (!(J > LEAST) && !(J > KEEP * o->old_min[e])) return false;
    }
    om__umesh_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    return om__umesh_least_volume(o->F, 0, mesh->nelem) > 0;
}

static bool open_by_shares(Opening* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    const size_t size = 3 * (size_t)mesh->nnode * sizeof *o->u;
    float farthest = 0;
    for (int i = 0; i < 3 * mesh->nnode; ++i) farthest = fmaxf(farthest, fabsf(o->answer[i]));
    // the answer is not 0: rest has nothing to be opened
    const int nshare = (int)ceil((double)farthest / (SHARE_WAY * o->grid->spacing));
    int64_t unit = (int64_t)1 << NHALF, all = nshare * unit, done = 0, step = unit;
    memset(o->u, 0, size);
    clear_marks(o);
    while (done < all) {
        memcpy(o->before, o->u, size);
        for (int e = 0; e < mesh->nelem; ++e) o->old_min[e] = least_of(o, e);
        if (step > all - done) step = all - done;
        while (!add_share(o, (float)step / (float)all)) {
            step /= 2;
            if (step == 0) return false;
        }
        done += step;
        step = 2 * step < unit ? 2 * step : unit;
        relax(o, SHARE_SWEEPS);
    }
    for (int i = 0; i < mesh->nnode; ++i)  // the sum of the shares is rounded
        if (o->mask[i]) memcpy(o->u + 3 * (size_t)i, o->answer + 3 * (size_t)i, 3 * sizeof *o->u);
    om__umesh_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    return relax(o, LAST_SWEEPS);
}

static void measure(const Opening* o, OmUmeshUntangling* report) {
    const OmFemMesh* mesh = &o->grid->mesh;
    report->min_volume = INFINITY;
    for (int e = 0; e < mesh->nelem; ++e)
        report->min_volume = fmin(report->min_volume, (double)least_of(o, e));
    for (int i = 0; i < mesh->nnode; ++i) {
        const float *u = o->u + 3 * (size_t)i, *from = o->answer + 3 * (size_t)i;
        double way = om_distance(om_vec3(u[0], u[1], u[2]), om_vec3(from[0], from[1], from[2]));
        report->nmoved += way > MOVED;
        report->max = fmax(report->max, way);
        report->mean += way / mesh->nnode;
    }
}

OmStatus om_umesh_untangle(const OmUmeshNet* net, const unsigned char* mask, float* u,
                           OmUmeshUntangling* report) {
    const OmUmeshGrid* g = &net->grid;
    const size_t nnode = (size_t)g->mesh.nnode, nelem = (size_t)g->mesh.nelem;
    Opening o = {.grid = g, .mask = mask, .answer = u};
    OmStatus status = OM_OK;
    *report = (OmUmeshUntangling){0};
    OM_TRY_DONE(om__umesh_elements_init(g, net->poisson, &o.elements));
    OM_ALLOC_DONE(o.F, REFINE_F * nelem);
    OM_ALLOC_DONE(o.u, 3 * nnode);
    OM_ALLOC_DONE(o.before, 3 * nnode);
    OM_ALLOC_DONE(o.old_min, nelem);
    OM_ALLOC_DONE(o.is_closed, nelem);
    OM_ALLOC_DONE(o.is_near, nelem);
    OM_ALLOC_DONE(o.is_loose, nnode);
    memcpy(o.u, u, 3 * nnode * sizeof *u);
    report->ninverted = count_inverted(&o);
    if (report->ninverted > 0 && !open_directly(&o) && !open_by_shares(&o)) {
        status = OM_NOT_CONVERGED;
        goto done;
    }
    measure(&o, report);
    memcpy(u, o.u, 3 * nnode * sizeof *u);
done:
    om__umesh_elements_done(&o.elements);
    om_free(o.F);
    om_free(o.u);
    om_free(o.before);
    om_free(o.old_min);
    om_free(o.is_closed);
    om_free(o.is_near);
    om_free(o.is_loose);
    return status;
}
