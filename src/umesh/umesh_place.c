// umesh_place.c: the position of a patch on the surface of a grid.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

// The centre of the elements around a surface point is inwards of it, also where the surface is concave.
static OmVec3 find_inward(const OmUmeshGrid* g, OmVec3 at, double reach) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int e = 0; e < g->fem.mesh.nelem; ++e) {
        OmVec3 c = om_vec3(0, 0, 0);
        for (int a = 0; a < 8; ++a)
            c = om_madd(c, 0.125, om_load3(g->fem.mesh.x, g->fem.mesh.elem_node[8 * e + a]));
        if (om_distance(c, at) < reach) sum = om_add(sum, om_sub(c, at));
    }
    return sum;
}

// The least squares plane through the surface points within `reach` of p: its normal is the direction of smallest
// variance.
OmUmeshPatch om_umesh_find_place(const OmUmeshGrid* g, OmVec3 p) {
    double best = HUGE_VAL, reach = 2.5 * g->fem.grid.spacing;
    OmVec3 at = p, mean = om_vec3(0, 0, 0), w;
    OmMat3 spread = {0}, V;
    int num = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->surface_x, i);
        if (g->is_surface[i] && om_distance(x, p) < best) best = om_distance(x, p), at = x;
    }
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->surface_x, i);
        if (g->is_surface[i] && om_distance(x, at) <= reach) mean = om_add(mean, x), ++num;
    }
    mean = om_scale(1.0 / (num ? num : 1), mean);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->surface_x, i), d = om_sub(x, mean);
        if (g->is_surface[i] && om_distance(x, at) <= reach)
            spread = om_mat3_add(spread, om_mat3_outer(d, d));
    }
    om_mat3_eigen_symmetric(spread, &w, &V);
    OmVec3 normal = V.cx;
    if (om_dot(normal, find_inward(g, at, reach)) > 0) normal = om_scale(-1, normal);
    OmVec3 along = om_cross(normal, fabs(normal.x) < 0.9 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0));
    return om_umesh_patch_default(at, normal, om_normalize(along));
}
