// umesh_symmetry.c: planes in which a grid is its own mirror image.
//
// If cells and fixed nodes are symmetric about a plane normal to an axis, the mirror image of an equilibrium is an
// equilibrium, too: one sample gives two, or four with two planes (the phantom). A patient's organ has no such plane.
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

static void get_place(const OmUmeshGrid* g, int point, int place[3]) {
    for (int c = 0; c < 3; ++c) {
        place[c] = point % g->fem.grid.dim[c];
        point /= g->fem.grid.dim[c];
    }
}

static int get_point(const OmUmeshGrid* g, const int place[3]) {
    return place[0] + g->fem.grid.dim[0] * (place[1] + g->fem.grid.dim[1] * place[2]);
}

static void find_range(const OmUmeshGrid* g, int axis, int* lo, int* hi) {
    *lo = g->fem.grid.dim[axis], *hi = -1;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        int place[3];
        get_place(g, g->fem.node_point[i], place);
        *lo = place[axis] < *lo ? place[axis] : *lo;
        *hi = place[axis] > *hi ? place[axis] : *hi;
    }
}

// Write the images of nodes to mirror; false if a cell or a fixed node has no image.
static bool find_images(const OmUmeshGrid* g, int axis, int* mirror) {
    int lo, hi;
    find_range(g, axis, &lo, &hi);
    for (int p = 0; p < g->fem.npoint; ++p) {
        int place[3];
        get_place(g, p, place);
        int at = place[axis], node = g->fem.point_node[p];
        if (g->fem.cell_elem[p] >= 0) {
            place[axis] = lo + hi - 1 - at;
            if (g->fem.cell_elem[get_point(g, place)] < 0) return false;
        }
        if (node < 0) continue;
        place[axis] = lo + hi - at;
        mirror[node] = g->fem.point_node[get_point(g, place)];
        if (mirror[node] < 0 || g->fem.fixed[mirror[node]] != g->fem.fixed[node]) return false;
    }
    return true;
}

OmStatus om__umesh_find_mirrors(const OmUmeshGrid* g, int* mirror[3]) {
    mirror[0] = mirror[1] = mirror[2] = NULL;
    for (int axis = 0; axis < 3; ++axis) {
        OM_ALLOC(mirror[axis], g->fem.mesh.nnode);
        if (find_images(g, axis, mirror[axis])) continue;
        om_free(mirror[axis]);
        mirror[axis] = NULL;
    }
    return OM_OK;
}

void om__umesh_reflect(const OmUmeshGrid* g, int* const mirror[3], const bool is_on[3],
                       const float* from, float* to) {
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        int image = i;
        for (int c = 0; c < 3; ++c)
            if (is_on[c]) image = mirror[c][image];
        for (int c = 0; c < 3; ++c)
            to[3 * image + c] = is_on[c] ? -from[3 * i + c] : from[3 * i + c];
    }
}
