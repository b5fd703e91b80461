// umesh_trust.c: is an input like those of training?
//
// A network gives an output for any input. Its training data are patches of the surface that a probe moves almost
// rigidly. The measures of an input are therefore:
//
//   - displacements of nodes, relative to the largest displacement in training of the node or its neighbours (a node
//     that training never moved has no limit, and its score is UNTOUCHED),
//   - deviation of the displacements from their mean, and differences between neighbouring nodes,
//   - number of nodes, and direction.
//
// Each measure is relative to its largest value in training. New samples sometimes exceed the maximum of a finite set,
// so one margin widens the limits: the 99 % quantile of the validation samples. The limit of differences between
// neighbours is not widened: in training it is already near the whole displacement.
#include <math.h>
#include <string.h>

#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define INSIDE_SHARE 0.99
#define UNTOUCHED HUGE_VAL  // score of a node that no sample moved
#define LEAST_WAY 1e-4      // m: below it directions and ratios are not meaningful
#define NDILATE 1  // rounds of dilation: a node gets the largest displacement of its neighbours

typedef struct Measure {
    double way, stretch, rough, angle;  // m / m, m, m / m, rad
    int count;
} Measure;

OmStatus om__umesh_region_alloc(OmUmeshNet* net) {
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(net->region.way, net->grid.fem.mesh.nnode);
    OM_CALLOC_DONE(net->region.inward, 3 * (size_t)net->grid.fem.mesh.nnode);
done:
    return status;
}

// Largest difference of displacement between neighbouring masked nodes, m.
static double find_jump(const OmUmeshGrid* g, const unsigned char* mask, const float* u) {
    const int step[3] = {1, g->fem.grid.dim[0], g->fem.grid.dim[0] * g->fem.grid.dim[1]};
    double max = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (!mask[i]) continue;
        for (int c = 0; c < 3; ++c) {
            int point = g->fem.node_point[i] + step[c];
            int next = point < g->fem.npoint ? g->fem.point_node[point] : -1;
            if (next < 0 || !mask[next]) continue;
            const float *a = u + 3 * (size_t)i, *b = u + 3 * (size_t)next;
            max = fmax(max, om_distance(om_vec3(a[0], a[1], a[2]), om_vec3(b[0], b[1], b[2])));
        }
    }
    return max;
}

static Measure measure(const OmUmeshNet* net, const unsigned char* mask, const float* u) {
    const UmeshRegion* r = &net->region;
    Measure m = {0};
    double farthest = 0;
    OmVec3 mean = om_vec3(0, 0, 0), inward = mean;
    for (int i = 0; i < net->grid.fem.mesh.nnode; ++i) {
        if (!mask[i]) continue;
        const float *ui = u + 3 * (size_t)i, *ni = r->inward + 3 * (size_t)i;
        OmVec3 d = om_vec3(ui[0], ui[1], ui[2]);
        double way = om_norm(d);
        if (!isfinite(way)) m.stretch = m.way = HUGE_VAL;
        farthest = fmax(farthest, way);
        if (way > LEAST_WAY)
            m.way = fmax(m.way, r->way[i] > 0 ? way / (double)r->way[i] : UNTOUCHED);
        mean = om_add(mean, d);
        inward = om_add(inward, om_vec3(ni[0], ni[1], ni[2]));
        ++m.count;
    }
    if (!m.count) return m;
    mean = om_scale(1.0 / m.count, mean);
    for (int i = 0; i < net->grid.fem.mesh.nnode; ++i) {
        if (!mask[i]) continue;
        const float* ui = u + 3 * (size_t)i;
        double off = om_distance(mean, om_vec3(ui[0], ui[1], ui[2]));
        m.stretch = isfinite(off) ? fmax(m.stretch, off) : HUGE_VAL;
    }
    if (farthest > LEAST_WAY && isfinite(farthest))
        m.rough = find_jump(&net->grid, mask, u) / farthest;
    double length = om_norm(mean) * om_norm(inward);
    if (om_norm(mean) > LEAST_WAY && length > 0)
        m.angle = acos(fmin(1, fmax(-1, om_dot(mean, inward) / length)));
    return m;
}

static double over(double value, double limit) {
    return limit > 0 ? value / limit : value > 0 ? UNTOUCHED : 0;
}

void om_umesh_judge(const OmUmeshNet* net, const unsigned char* mask, const float* u,
                    OmUmeshTrust* trust) {
    const UmeshRegion* r = &net->region;
    Measure m = measure(net, mask, u);
    *trust = (OmUmeshTrust){.way = m.way / r->margin,
                            .stretch = over(m.stretch, r->stretch * r->margin),
                            .rough = over(m.rough, r->rough),
                            .angle = over(m.angle, r->angle * r->margin)};
    trust->size = fmax(m.count / r->max, m.count ? r->min / m.count : UNTOUCHED) / r->margin;
    trust->score =
        fmax(fmax(fmax(trust->way, trust->stretch), fmax(trust->angle, trust->size)), trust->rough);
    trust->is_inside = trust->score <= 1;
    if (trust->is_inside) return;
    if (trust->way == trust->score)
        snprintf(trust->why, sizeof trust->why,
                 isinf(m.way) ? "no training sample touched this place"
                              : "a displacement is %.2g times the largest trained there",
                 trust->way);
    else if (trust->rough == trust->score)
        snprintf(trust->why, sizeof trust->why,
                 "neighbours differ by %.2g of the largest displacement, in training at most %.2g",
                 m.rough, r->rough);
    else if (trust->stretch == trust->score)
        snprintf(trust->why, sizeof trust->why,
                 "displacements differ by %.2g times as much as in any training sample",
                 trust->stretch);
    else if (trust->angle == trust->score)
        snprintf(trust->why, sizeof trust->why,
                 "the direction is %.0f degrees off the inward normal, in training at most %.0f",
                 m.angle * 180 / OM_PI, r->angle * 180 / OM_PI);
    else
        snprintf(trust->why, sizeof trust->why, "%d nodes are moved, in training %.0f to %.0f",
                 m.count, r->min, r->max);
}

// ---- from data --------------------------------------------------------------------------------------

// Inward normals of the grid's free faces, summed at nodes and then smoothed over neighbours: the faces of a grid have
// only six directions.
static OmStatus find_inward(OmUmeshNet* net) {
    const OmUmeshGrid* g = &net->grid;
    OmFemFaces faces = {0};
    OmStatus status = OM_OK;
    double* sum = NULL;
    OM_TRY_DONE(om_fem_mesh_boundary(&g->fem.mesh, &faces));
    OM_CALLOC_DONE(sum, 3 * (size_t)g->fem.mesh.nnode);
    for (int round = 0; round < 3; ++round) {
        for (int f = 0; f < faces.nface; ++f) {
            const int* v = faces.face_node + 4 * (size_t)f;
            OmVec3 x[4], n = om_vec3(0, 0, 0);
            bool is_free = true;
            for (int a = 0; a < 4; ++a) {
                x[a] = om_load3(g->fem.mesh.x, v[a]);
                is_free = is_free && g->is_surface[v[a]];
                const float* old = net->region.inward + 3 * (size_t)v[a];
                n = om_add(n, om_vec3(old[0], old[1], old[2]));
            }
            if (!is_free) continue;
            if (round == 0) n = om_cross(om_sub(x[3], x[1]), om_sub(x[2], x[0]));
            for (int a = 0; a < 4; ++a) om_store3(sum, v[a], om_add(om_load3(sum, v[a]), n));
        }
        for (int i = 0; i < g->fem.mesh.nnode; ++i) {
            OmVec3 n = om_load3(sum, i);
            if (om_norm(n) > 0) n = om_normalize(n);
            const double value[3] = {n.x, n.y, n.z};
            for (size_t c = 0; c < 3; ++c) net->region.inward[3 * (size_t)i + c] = (float)value[c];
            om_store3(sum, i, om_vec3(0, 0, 0));
        }
    }
done:
    om_free(sum);
    om_fem_faces_done(&faces);
    return status;
}

// A node gets the largest displacement of the surface nodes with which it shares an element.
static OmStatus dilate(const OmUmeshGrid* g, float* way) {
    float* wide;
    OM_ALLOC(wide, g->fem.mesh.nnode);
    for (int round = 0; round < NDILATE; ++round) {
        memcpy(wide, way, (size_t)g->fem.mesh.nnode * sizeof *way);
        for (int e = 0; e < g->fem.mesh.nelem; ++e) {
            const int* v = g->fem.mesh.elem_node + 8 * (size_t)e;
            float max = 0;
            for (int a = 0; a < 8; ++a) max = fmaxf(max, way[v[a]]);
            for (int a = 0; a < 8; ++a)
                if (g->is_surface[v[a]]) wide[v[a]] = fmaxf(wide[v[a]], max);
        }
        memcpy(way, wide, (size_t)g->fem.mesh.nnode * sizeof *way);
    }
    om_free(wide);
    return OM_OK;
}

OmStatus om__umesh_region_make(OmUmeshNet* net, const OmUmeshData* data, int ntrain) {
    UmeshRegion* r = &net->region;
    size_t nnode = (size_t)net->grid.fem.mesh.nnode;
    int nvalid = data->nsample - ntrain;
    OM_TRY(find_inward(net));
    for (int s = 0; s < ntrain; ++s) {
        const unsigned char* mask = data->mask + (size_t)s * nnode;
        const float* u = data->u + 3 * (size_t)s * nnode;
        for (size_t i = 0; i < nnode; ++i)
            if (mask[i])
                r->way[i] =
                    fmaxf(r->way[i], sqrtf(u[3 * i] * u[3 * i] + u[3 * i + 1] * u[3 * i + 1] +
                                           u[3 * i + 2] * u[3 * i + 2]));
    }
    OM_TRY(dilate(&net->grid, r->way));
    r->margin = 1;
    r->min = HUGE_VAL;
    for (int s = 0; s < ntrain; ++s) {
        Measure m = measure(net, data->mask + (size_t)s * nnode, data->u + 3 * (size_t)s * nnode);
        r->stretch = fmax(r->stretch, m.stretch);
        r->rough = fmax(r->rough, m.rough);
        r->angle = fmax(r->angle, m.angle);
        if (!m.count) continue;
        r->max = fmax(r->max, m.count);
        r->min = fmin(r->min, m.count);
    }
    if (nvalid < 1) return OM_OK;
    double* score;
    OM_ALLOC(score, nvalid);
    for (int s = 0; s < nvalid; ++s) {
        OmUmeshTrust trust;
        size_t at = (size_t)(ntrain + s) * nnode;
        om_umesh_judge(net, data->mask + at, data->u + 3 * at, &trust);
        score[s] = trust.score;
    }
    om_sort_doubles(score, nvalid);
    int last = (int)ceil(INSIDE_SHARE * nvalid) - 1;
    r->margin = fmax(1, fmin(score[last < 0 ? 0 : last], 2));
    om_free(score);
    return OM_OK;
}
