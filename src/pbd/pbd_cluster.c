// pbd_cluster.c: assignment of particles to clusters.
//
// Centres lie on a lattice with a spacing of at most cluster_spacing that fills the bounding box of the
// particles. A cluster is all particles within cluster_radius of its centre. A lattice leaves some particles out
// (at the corners of its cells, and at irregular borders): each of them, by index, becomes the centre of a
// further cluster until all are covered. Clusters of fewer than four particles have no shape to match; this
// second stage covers their particles. Where overlaps contain no particle the body would fall apart: each
// particle in turn whose ball joins two parts becomes the centre of a further cluster.
#include <string.h>

#include "pbd/pbd_internal.h"

#define LEAST_MEMBER 4
#define MAX_CENTER 4000000
// a body higher than this many standard deviations of a cluster's members is stacked
#define STACKED 2.0
#define FLAT 1e-4  // of the largest spread: directions without extent

typedef struct Grid {  // particles by cells of the bounding box
    OmGrid cell;       // from the lowest corner of the box; dim: cells
    OmVec3 hi;         // highest corner of the box
    int* adr;          //                                             (cells + 1)
    int* vert;         //                                                 (nvert)
} Grid;

typedef struct Builder {
    const OmTetMesh* mesh;
    const OmPbdDef* def;
    OmPbdClusters* shape;
    Grid grid;
    int* found;      // members of a ball                             (nvert)
    int* ncovering;  // clusters of each particle                     (nvert)
    int max_cluster, max_member;
} Builder;

static size_t cell_of(const Grid* g, OmVec3 p) {
    int c[3];
    om_grid_cell(&g->cell, p, c);
    return om_grid_index(g->cell.dim, c[0], c[1], c[2]);
}

static OmStatus make_grid(const OmTetMesh* mesh, double cell, Grid* g) {
    g->cell.origin = g->hi = om_load3(mesh->x, 0);
    for (int i = 1; i < mesh->nvert; ++i) {
        g->cell.origin = om_min3(g->cell.origin, om_load3(mesh->x, i));
        g->hi = om_max3(g->hi, om_load3(mesh->x, i));
    }
    OmVec3 size = om_sub(g->hi, g->cell.origin);
    double longest = fmax(size.x, fmax(size.y, size.z));
    g->cell.spacing = fmax(cell, longest / 128);
    g->cell.dim[0] = 1 + (int)(size.x / g->cell.spacing);
    g->cell.dim[1] = 1 + (int)(size.y / g->cell.spacing);
    g->cell.dim[2] = 1 + (int)(size.z / g->cell.spacing);
    size_t ncell = om_grid_count(g->cell.dim);
    g->adr = om_calloc(ncell + 1, sizeof *g->adr);
    g->vert = om_alloc((size_t)mesh->nvert, sizeof *g->vert);
    if (!g->adr || !g->vert) return OM_NO_MEMORY;
    for (int i = 0; i < mesh->nvert; ++i) {
        ++g->adr[cell_of(g, om_load3(mesh->x, i)) + 1];
    }
    for (size_t k = 0; k < ncell; ++k) g->adr[k + 1] += g->adr[k];
    for (int i = mesh->nvert - 1; i >= 0; --i) {  // backwards, so that cells are ascending
        g->vert[--g->adr[cell_of(g, om_load3(mesh->x, i)) + 1]] = i;
    }
    // each adr[k + 1] now is the start of cell k: shift by one
    for (size_t k = 0; k < ncell; ++k) g->adr[k] = g->adr[k + 1];
    g->adr[ncell] = mesh->nvert;
    return OM_OK;
}

// Particles within the cluster radius of p, ascending, into b->found.
static int find_ball(Builder* b, OmVec3 p) {
    const Grid* g = &b->grid;
    double r = b->def->cluster_radius * (1 + 1e-9);
    OmVec3 reach = {r, r, r};
    int lo[3], hi[3], num = 0;
    om_grid_cell(&g->cell, om_sub(p, reach), lo);
    om_grid_cell(&g->cell, om_add(p, reach), hi);
    for (int k = lo[2]; k <= hi[2]; ++k)
        for (int j = lo[1]; j <= hi[1]; ++j)
            for (int i = lo[0]; i <= hi[0]; ++i) {
                size_t cell = om_grid_index(g->cell.dim, i, j, k);
                for (int n = g->adr[cell]; n < g->adr[cell + 1]; ++n)
                    if (om_distance(om_load3(b->mesh->x, g->vert[n]), p) <= r)
                        b->found[num++] = g->vert[n];
            }
    om_sort_ints(b->found, num);
    return num;
}

// Make a cluster of the found particles.
static OmStatus add_cluster(Builder* b, int num) {
    OmPbdClusters* s = b->shape;
    int nmember = s->adr ? s->adr[s->ncluster] : 0;
    if (s->ncluster + 2 > b->max_cluster) {
        int room = 2 * b->max_cluster + 64;
        int* adr = om_realloc(s->adr, (size_t)b->max_cluster, (size_t)room, sizeof *adr);
        if (!adr) return OM_NO_MEMORY;
        s->adr = adr;
        b->max_cluster = room;
        if (s->ncluster == 0) adr[0] = 0;
    }
    if (nmember + num > b->max_member) {
        OM_CHECK(nmember <= 500000000 - num, OM_INVALID,
                 "pbd: clusters of radius %g mm every %g mm have more than 500 million members; "
                 "enlarge cluster_spacing or reduce cluster_radius",
                 1e3 * b->def->cluster_radius, 1e3 * b->def->cluster_spacing);
        int room = 2 * b->max_member + num + 256;
        int* vert = om_realloc(s->vert, (size_t)b->max_member, (size_t)room, sizeof *vert);
        if (!vert) return OM_NO_MEMORY;
        s->vert = vert;
        b->max_member = room;
    }
    memcpy(s->vert + nmember, b->found, (size_t)num * sizeof(int));
    for (int n = 0; n < num; ++n) ++b->ncovering[b->found[n]];
    s->adr[++s->ncluster] = nmember + num;
    return OM_OK;
}

static OmStatus place_clusters(Builder* b) {
    const Grid* g = &b->grid;
    OmVec3 size = om_sub(g->hi, g->cell.origin);
    double length[3] = {size.x, size.y, size.z}, count = 1;
    int num[3];
    for (int a = 0; a < 3; ++a) {
        double n = fmax(1, ceil(length[a] / b->def->cluster_spacing - 1e-6));
        count *= n;
        num[a] = (int)fmin(n, MAX_CENTER);
    }
    OM_CHECK(count <= MAX_CENTER, OM_INVALID,
             "pbd: cluster_spacing of %g mm makes %.3g clusters; the most is %d",
             1e3 * b->def->cluster_spacing, count, MAX_CENTER);
    for (int k = 0; k < num[2]; ++k)
        for (int j = 0; j < num[1]; ++j)
            for (int i = 0; i < num[0]; ++i) {
                OmVec3 at = {(i + 0.5) / num[0] * size.x, (j + 0.5) / num[1] * size.y,
                             (k + 0.5) / num[2] * size.z};
                int found = find_ball(b, om_add(g->cell.origin, at));
                if (found >= LEAST_MEMBER) OM_TRY(add_cluster(b, found));
            }
    for (int i = 0; i < b->mesh->nvert; ++i)
        if (b->ncovering[i] == 0) OM_TRY(add_cluster(b, find_ball(b, om_load3(b->mesh->x, i))));
    return OM_OK;
}

// ---- one body ---------------------------------------------------------------------------------------

// The representative of the part that contains i.
static int find_part(int* part, int i) {
    while (part[i] != i) i = part[i] = part[part[i]];
    return i;
}

// Join all found particles to one part; returns the number of joined parts.
static int join_found(int* part, const int* vert, int num) {
    int njoin = 0, root = num > 0 ? find_part(part, vert[0]) : 0;
    for (int n = 1; n < num; ++n) {
        int other = find_part(part, vert[n]);
        if (other == root) continue;
        part[other] = root;
        ++njoin;
    }
    return njoin;
}

static OmStatus join_parts(Builder* b, int* part) {
    const OmPbdClusters* s = b->shape;
    int nvert = b->mesh->nvert, nparts = nvert;
    for (int i = 0; i < nvert; ++i) part[i] = i;
    for (int c = 0; c < s->ncluster; ++c)
        nparts -= join_found(part, s->vert + s->adr[c], s->adr[c + 1] - s->adr[c]);
    for (int i = 0; i < nvert && nparts > 1; ++i) {
        int num = find_ball(b, om_load3(b->mesh->x, i)), njoin = join_found(part, b->found, num);
        nparts -= njoin;
        if (njoin > 0) OM_TRY(add_cluster(b, num));
    }
    if (nparts > 1)
        om_log(
            OM_LOG_WARNING,
            "pbd: particles farther apart than cluster_radius, %g mm, leave the body in %d parts",
            1e3 * b->def->cluster_radius, nparts);
    return OM_OK;
}

// ---- weights ----------------------------------------------------------------------------------------

// Clusters of each particle, and its weight in each.
static OmStatus make_incidence(const OmTetMesh* mesh, OmPbdClusters* s) {
    int nmember = s->adr[s->ncluster];
    OM_ALLOC(s->part_share, mesh->nvert);
    s->part_adr = om_calloc((size_t)mesh->nvert + 1, sizeof *s->part_adr);
    s->part_cluster = om_alloc((size_t)nmember, sizeof *s->part_cluster);
    if (!s->part_adr || !s->part_cluster) return OM_NO_MEMORY;
    for (int n = 0; n < nmember; ++n) ++s->part_adr[s->vert[n] + 1];
    for (int i = 0; i < mesh->nvert; ++i) {
        s->part_share[i] = 1.0 / s->part_adr[i + 1];  // every particle is covered
        s->part_adr[i + 1] += s->part_adr[i];
    }
    for (int c = s->ncluster - 1; c >= 0; --c)
        for (int n = s->adr[c]; n < s->adr[c + 1]; ++n)
            s->part_cluster[--s->part_adr[s->vert[n] + 1]] = c;
    for (int i = 0; i < mesh->nvert; ++i) s->part_adr[i] = s->part_adr[i + 1];
    s->part_adr[mesh->nvert] = nmember;
    return OM_OK;
}

// Rest centre, weights and spread of cluster c.
static void weigh_cluster(const OmTetMesh* mesh, const double* mass, OmPbdClusters* s, int c) {
    double total = 0;
    OmVec3 center = {0, 0, 0};
    for (int n = s->adr[c]; n < s->adr[c + 1]; ++n) {
        int i = s->vert[n];
        double w = mass[i] * s->part_share[i];
        total += w;
        center = om_madd(center, w, om_load3(mesh->x, i));
    }
    center = om_scale(1 / total, center);  // masses are above 0
    om_store3(s->center, c, center);
    OmMat3 spread = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, V;
    for (int n = s->adr[c]; n < s->adr[c + 1]; ++n) {
        int i = s->vert[n];
        double w = mass[i] * s->part_share[i] / total;
        OmVec3 q = om_sub(om_load3(mesh->x, i), center);
        double* out = s->weight + 4 * (size_t)n;
        out[0] = w, out[1] = w * q.x, out[2] = w * q.y, out[3] = w * q.z;
        spread = om_mat3_add(spread, om_mat3_outer(om_scale(w, q), q));
    }
    OmVec3 e;
    om_mat3_eigen_symmetric(spread, &e, &V);
    double value[3] = {e.x, e.y, e.z};
    OmVec3 axis[3] = {V.cx, V.cy, V.cz};
    OmMat3 inverse = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, flat = inverse;
    for (int k = 0; k < 3; ++k) {
        OmMat3 aa = om_mat3_outer(axis[k], axis[k]);
        if (value[k] > FLAT * e.z && value[k] > 1e-30)
            inverse = om_mat3_add(inverse, om_mat3_scale(1 / value[k], aa));
        else
            flat = om_mat3_add(flat, aa);
    }
    double *si = s->spread_inverse + 9 * (size_t)c, *fl = s->flat + 9 * (size_t)c;
    om_store3(si, 0, inverse.cx), om_store3(si, 1, inverse.cy), om_store3(si, 2, inverse.cz);
    om_store3(fl, 0, flat.cx), om_store3(fl, 1, flat.cy), om_store3(fl, 2, flat.cz);
}

// Height of the stack of clusters of one part of the body along the weight: from the lowest centre to the highest.
// A body no higher than a cluster (a sheet that lies flat) is not stacked.
static OmStatus measure_height(const OmTissueModel* m, double radius, int* part, OmPbdClusters* s) {
    OmStatus status = OM_OK;
    double *lo = NULL, *hi = NULL, g = om_norm(m->def.gravity);
    if (!(g > 0)) return OM_OK;
    OmVec3 axis = om_scale(1 / g, m->def.gravity);
    OM_ALLOC_DONE(lo, m->mesh.nvert);
    OM_ALLOC_DONE(hi, m->mesh.nvert);
    for (int i = 0; i < m->mesh.nvert; ++i) lo[i] = INFINITY, hi[i] = -INFINITY;
    for (int c = 0; c < s->ncluster; ++c) {
        double at = om_dot(axis, om_load3(s->center, c));
        int root = find_part(part, s->vert[s->adr[c]]);
        lo[root] = fmin(lo[root], at);
        hi[root] = fmax(hi[root], at);
        for (int n = s->adr[c]; n < s->adr[c + 1]; ++n) {
            int i = s->vert[n];
            double q = om_dot(axis, om_load3(m->mesh.x, i)) - at;
            s->spread2 += m->mass[i] * s->part_share[i] * q * q / m->total_mass;
        }
    }
    for (int i = 0; i < m->mesh.nvert; ++i) s->height = fmax(s->height, hi[i] - lo[i]);
    if (s->height < STACKED * sqrt(s->spread2) + 1e-3 * radius) s->height = 0;
done:
    om_free(lo);
    om_free(hi);
    return status;
}

OmStatus om__pbd_make_clusters(const OmTissueModel* m, const OmPbdDef* def, OmPbdClusters* s) {
    OmStatus status = OM_OK;
    Builder b = {.mesh = &m->mesh, .def = def, .shape = s};
    int* part = NULL;
    OM_TRY_DONE(make_grid(&m->mesh, def->cluster_radius, &b.grid));
    OM_ALLOC_DONE(b.found, m->mesh.nvert);
    OM_CALLOC_DONE(b.ncovering, m->mesh.nvert);
    OM_ALLOC_DONE(part, m->mesh.nvert);
    OM_TRY_DONE(place_clusters(&b));
    OM_TRY_DONE(join_parts(&b, part));
    s->nbatch = (s->ncluster + OM__PBD_LANE - 1) / OM__PBD_LANE;
    OM_TRY_DONE(make_incidence(&m->mesh, s));
    OM_ALLOC_DONE(s->weight, 4 * (size_t)s->adr[s->ncluster]);
    OM_ALLOC_DONE(s->center, 3 * (size_t)s->ncluster);
    OM_ALLOC_DONE(s->spread_inverse, 9 * (size_t)s->ncluster);
    OM_ALLOC_DONE(s->flat, 9 * (size_t)s->ncluster);
    for (int c = 0; c < s->ncluster; ++c) weigh_cluster(&m->mesh, m->mass, s, c);
    OM_TRY_DONE(measure_height(m, def->cluster_radius, part, s));
done:
    om_free(b.grid.adr);
    om_free(b.grid.vert);
    om_free(b.found);
    om_free(b.ncovering);
    om_free(part);
    return status;
}

void om__pbd_clusters_done(OmPbdClusters* s) {
    om_free(s->adr);
    om_free(s->vert);
    om_free(s->weight);
    om_free(s->center);
    om_free(s->spread_inverse);
    om_free(s->flat);
    om_free(s->part_share);
    om_free(s->part_adr);
    om_free(s->part_cluster);
    *s = (OmPbdClusters){0};
}
