// fem_grid_untangle.c: move nodes beside a patch until no tetrahedron of the grid is inverted.
//
// Equilibrium uses eight Gauss points in each element. Beside the edge of a deep press a hexahedron can fold at a
// corner while det F is above 0 at all of these points: it is valid for the mechanics, and finite elements with the
// same prescribed displacements fold it, too. But some of its six tetrahedra (om_fem_grid_make_tet_mesh) are then
// inverted. Therefore tetrahedra below PENALIZED of their rest volume get a penalty K/2 (PENALIZED - J)^2, and the
// nodes around them are relaxed one by one together with the elastic energy (vertex block descent, as in
// fem_grid_element.c). J is linear in the position of one node, so the problem of a node is convex, and the bound that
// keeps a valid tetrahedron valid is exact.
//
//     first   start from the given displacements
//     then    if some stay inverted: start from rest and add the displacements in parts, each so small that no
//             tetrahedron inverts, with relaxation after each part
//
// Tried and rejected: other divisions of the hexahedra (a vertex in the middle, all 64 choices of face diagonals).
// Presses of 20 mm and more leave hexahedra for which no division is valid.
#include <math.h>
#include <string.h>

#include "fem/fem_grid_internal.h"

#define PENALIZED 0.1f  // det F below which a tetrahedron has the penalty
#define VALID 0.02f     // det F above which a tetrahedron is valid
#define STIFFNESS 2e4f  // of the penalty, over the shear modulus
#define KEEP 0.2f       // smallest ratio of a valid det F after a step to that before
#define RING 2          // layers of elements around penalized ones whose nodes are relaxed
#define SETTLED 2e-5f   // m, sweeps end when no node moves farther
#define MOVED 1e-5      // m, from which a node counts as moved
#define MAX_PART 0.15   // of the spacing: the largest displacement by one part
#define NHALF 12        // number of times a part is halved before the method gives up

enum { DIRECT_SWEEPS = 500, PART_SWEEPS = 6, LAST_SWEEPS = 100 };

typedef struct Untangle {
    const OmFemGrid* grid;
    const unsigned char* mask;
    const float* given;  //                                                       (nnode x 3)
    GridElements elements;
    float *F, *u, *before;        //                      (nelem x GRID_F), (nnode x 3), (nnode x 3)
    float* old_min;               //                                                      (nelem)
    unsigned char* is_penalized;  // a tetrahedron was below PENALIZED                 (nelem)
    unsigned char* is_near;       // penalized, or in a layer around                   (nelem)
    unsigned char* is_loose;      // nodes of near elements                            (nnode)
    int nsweep;
} Untangle;

typedef struct Tet {
    float J;            // det F
    float slope[4][3];  // its derivatives by the positions of the corners, 1/m
} Tet;

static OmVec3 position_of(const Untangle* o, int node) {
    const float* u = o->u + 3 * (size_t)node;
    return om_add(om_load3(o->grid->mesh.x, node), om_vec3(u[0], u[1], u[2]));
}

// det F = a . (b x c) / h^3, by the edges from corner 0.
static Tet eval_tet(const Untangle* o, int element, int which) {
    const int* tet = om__grid_tet[which];
    const int* node = o->grid->mesh.elem_node + 8 * (size_t)element;
    const double over = 1 / (o->grid->grid.spacing * o->grid->grid.spacing * o->grid->grid.spacing);
    const OmVec3 x = position_of(o, node[tet[0]]);
    const OmVec3 a = om_sub(position_of(o, node[tet[1]]), x);
    const OmVec3 b = om_sub(position_of(o, node[tet[2]]), x);
    const OmVec3 c = om_sub(position_of(o, node[tet[3]]), x);
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

static float min_volume_of(const Untangle* o, int element) {
    float min = INFINITY;
    for (int k = 0; k < 6; ++k) min = fminf(min, eval_tet(o, element, k).J);
    return min;
}

static int count_inverted(const Untangle* o) {
    int num = 0;
    for (int e = 0; e < o->grid->mesh.nelem; ++e)
        for (int k = 0; k < 6; ++k) num += !(eval_tet(o, e, k).J > 0);
    return num;
}

static void clear_marks(Untangle* o) {
    memset(o->is_penalized, 0, (size_t)o->grid->mesh.nelem);
    memset(o->is_loose, 0, (size_t)o->grid->mesh.nnode);
}

static void mark_nodes(Untangle* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    memset(o->is_loose, 0, (size_t)mesh->nnode);
    for (int k = 0; k < 8 * mesh->nelem; ++k)
        if (o->is_near[k / 8]) o->is_loose[mesh->elem_node[k]] = 1;
}

// Marks stay: the nodes of these elements have left the given displacements. @return the smallest det F of all
// tetrahedra
static float mark_penalized(Untangle* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    float all_min = INFINITY;
    bool is_new = false;
    for (int e = 0; e < mesh->nelem; ++e) {
        float min = min_volume_of(o, e);
        all_min = fminf(all_min, min);
        if (min > PENALIZED || o->is_penalized[e]) continue;
        o->is_penalized[e] = 1;
        is_new = true;
    }
    if (!is_new) return all_min;
    memcpy(o->is_near, o->is_penalized, (size_t)mesh->nelem);
    for (int ring = 0; ring < RING; ++ring) {
        mark_nodes(o);
        for (int k = 0; k < 8 * mesh->nelem; ++k)
            if (o->is_loose[mesh->elem_node[k]]) o->is_near[k / 8] = 1;
    }
    mark_nodes(o);
    return all_min;
}

// ---- one node -----------------------------------------------------------------------------------------

typedef struct NodeTet {  // a tetrahedron as a function of the position of one corner
    float J, slope[3];
} NodeTet;

static int find_node_tets(const Untangle* o, int node, NodeTet tet[48]) {
    const GridElements* t = &o->elements;
    int num = 0;
    for (int k = t->use_adr[node]; k < t->use_adr[node + 1]; ++k) {
        for (int s = 0; s < 6; ++s) {
            int a = 0;
            while (a < 4 && om__grid_tet[s][a] != t->use[k] % 8) ++a;
            if (a == 4) continue;
            Tet all = eval_tet(o, t->use[k] / 8, s);
            tet[num].J = all.J;
            memcpy(tet[num++].slope, all.slope[a], sizeof all.slope[a]);
        }
    }
    return num;
}

// One Newton step of one node. @return its length, m
static float relax_node(Untangle* o, int node) {
    const GridElements* t = &o->elements;
    NodeTet tet[48];
    float gradient[3], H[6], step[3];
    const int ntet = find_node_tets(o, node, tet);
    om__grid_node_eval(t, node, o->F, gradient, H);
    for (int k = 0; k < ntet; ++k) {
        const float *s = tet[k].slope, lack = PENALIZED - tet[k].J;
        if (!(lack > 0)) continue;
        for (int i = 0; i < 3; ++i) {
            gradient[i] -= STIFFNESS * lack * s[i];
            H[i] += STIFFNESS * s[i] * s[i];
        }
        H[3] += STIFFNESS * s[0] * s[1];
        H[4] += STIFFNESS * s[0] * s[2];
        H[5] += STIFFNESS * s[1] * s[2];
    }
    float fraction = om__grid_node_step(t, node, o->F, gradient, H, step);
    for (int k = 0; k < ntet; ++k) {
        const float* s = tet[k].slope;
        const float loss = -(s[0] * step[0] + s[1] * step[1] + s[2] * step[2]);
        const float max = (1 - KEEP) * tet[k].J;
        if (max > 0 && fraction * loss > max) fraction = max / loss;
    }
    for (int i = 0; i < 3; ++i) step[i] *= fraction;
    om__grid_node_move(t, node, step, o->F, o->u);
    return sqrtf(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
}

// ---- all nodes ----------------------------------------------------------------------------------------

// Sweeps forwards and backwards in turn, until all tetrahedra are valid and nodes are at rest. @return whether all are
// valid
static bool relax(Untangle* o, int nsweep) {
    const GridElements* t = &o->elements;
    const int nfree = t->color_adr[8];
    float min = mark_penalized(o);
    for (int sweep = 0; sweep < nsweep; ++sweep) {
        float max = 0;
        for (int at = 0; at < nfree; ++at) {
            const int node = t->color_node[sweep % 2 ? nfree - 1 - at : at];
            if (!o->mask[node] && o->is_loose[node]) max = fmaxf(max, relax_node(o, node));
        }
        ++o->nsweep;
        min = mark_penalized(o);
        if (min > VALID && max < SETTLED) break;
    }
    return min > VALID;
}

static bool untangle_directly(Untangle* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    memcpy(o->u, o->given, 3 * (size_t)mesh->nnode * sizeof *o->u);
    om__grid_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    clear_marks(o);
    return relax(o, DIRECT_SWEEPS);
}

// u = before + part * given.
// @return whether no tetrahedron was inverted by it; then F belongs to u
static bool add_part(Untangle* o, float part) {
    const OmFemMesh* mesh = &o->grid->mesh;
    for (int i = 0; i < 3 * mesh->nnode; ++i) o->u[i] = o->before[i] + part * o->given[i];
    for (int e = 0; e < mesh->nelem; ++e) {
        float J = min_volume_of(o, e);
        if (!(J > PENALIZED) && !(J > KEEP * o->old_min[e])) return false;
    }
    om__grid_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    return om__grid_min_volume(o->F, 0, mesh->nelem) > 0;
}

static bool untangle_by_parts(Untangle* o) {
    const OmFemMesh* mesh = &o->grid->mesh;
    const size_t size = 3 * (size_t)mesh->nnode * sizeof *o->u;
    float farthest = 0;
    for (int i = 0; i < 3 * mesh->nnode; ++i) farthest = fmaxf(farthest, fabsf(o->given[i]));
    // the displacements are not 0: at rest nothing is inverted
    const int npart = (int)ceil((double)farthest / (MAX_PART * o->grid->grid.spacing));
    int64_t unit = (int64_t)1 << NHALF, all = npart * unit, done = 0, step = unit;
    memset(o->u, 0, size);
    clear_marks(o);
    while (done < all) {
        memcpy(o->before, o->u, size);
        for (int e = 0; e < mesh->nelem; ++e) o->old_min[e] = min_volume_of(o, e);
        if (step > all - done) step = all - done;
        while (!add_part(o, (float)step / (float)all)) {
            step /= 2;
            if (step == 0) return false;
        }
        done += step;
        step = 2 * step < unit ? 2 * step : unit;
        relax(o, PART_SWEEPS);
    }
    for (int i = 0; i < mesh->nnode; ++i)  // the sum of the parts is rounded
        if (o->mask[i]) memcpy(o->u + 3 * (size_t)i, o->given + 3 * (size_t)i, 3 * sizeof *o->u);
    om__grid_gradients(&o->elements, o->u, 1, o->F, 0, mesh->nelem);
    return relax(o, LAST_SWEEPS);
}

static void measure(const Untangle* o, OmFemGridUntangling* report) {
    const OmFemMesh* mesh = &o->grid->mesh;
    report->min_volume = INFINITY;
    for (int e = 0; e < mesh->nelem; ++e)
        report->min_volume = fmin(report->min_volume, (double)min_volume_of(o, e));
    for (int i = 0; i < mesh->nnode; ++i) {
        const float *u = o->u + 3 * (size_t)i, *from = o->given + 3 * (size_t)i;
        double moved = om_distance(om_vec3(u[0], u[1], u[2]), om_vec3(from[0], from[1], from[2]));
        report->nmoved += moved > MOVED;
        report->max = fmax(report->max, moved);
        report->mean += moved / mesh->nnode;
    }
}

OmStatus om_fem_grid_untangle(const OmFemGrid* g, double poisson, const unsigned char* mask,
                              float* u, OmFemGridUntangling* report) {
    const size_t nnode = (size_t)g->mesh.nnode, nelem = (size_t)g->mesh.nelem;
    Untangle o = {.grid = g, .mask = mask, .given = u};
    OmStatus status = OM_OK;
    *report = (OmFemGridUntangling){0};
    OM_TRY_DONE(om__grid_elements_init(g, poisson, &o.elements));
    OM_ALLOC_DONE(o.F, GRID_F * nelem);
    OM_ALLOC_DONE(o.u, 3 * nnode);
    OM_ALLOC_DONE(o.before, 3 * nnode);
    OM_ALLOC_DONE(o.old_min, nelem);
    OM_ALLOC_DONE(o.is_penalized, nelem);
    OM_ALLOC_DONE(o.is_near, nelem);
    OM_ALLOC_DONE(o.is_loose, nnode);
    memcpy(o.u, u, 3 * nnode * sizeof *u);
    report->ninverted = count_inverted(&o);
    if (report->ninverted > 0 && !untangle_directly(&o) && !untangle_by_parts(&o)) {
        status = OM_NOT_CONVERGED;
        goto done;
    }
    measure(&o, report);
    memcpy(u, o.u, 3 * nnode * sizeof *u);
done:
    om__grid_elements_done(&o.elements);
    om_free(o.F);
    om_free(o.u);
    om_free(o.before);
    om_free(o.old_min);
    om_free(o.is_penalized);
    om_free(o.is_near);
    om_free(o.is_loose);
    return status;
}
