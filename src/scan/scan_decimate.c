// scan_decimate.c: from pixels on the tissue to points one spacing apart, with normals and triangles.
//
// Pixels in reading order: a pixel that no point covers becomes one, and covers the pixels around it that are linked to
// it and nearer than a radius. Every pixel belongs to the nearest of the points that cover it: the cells of a Voronoi
// diagram on the surface. The triangles are its dual: one at each triangle of three pixels that are of three cells, and
// they have the neighbourhood and the orientation of the pixels. A triangle that would use an edge twice in the same
// direction is left out, so that the surface is a manifold with border.
//
// The position of a point is the mean of the pixels within a third of the spacing; a plane through the pixels within
// 0.6 spacings gives the normal. The mean is off by r^2 / 4R on a surface of curvature 1/R: 0.1 mm for 7 mm on 15 mm.
//
// Noise moves points along their rays. Distances within a neighbourhood do not count the part along the ray that noise
// explains, and the radius of the plane is four standard deviations at least, but three spacings at most: beyond that
// a scan takes minutes (71 s for 80 mm of noise). On a folded sheet with 2.3 mm of noise (seven times that of the
// default) the points are 0.25 mm (median) from the true surface and their normals off by 4 degrees; with plain
// distances 1.2 mm and 20 degrees.
//
// Not used: means over blocks of pixels (on a surface seen at 70 degrees the points are three spacings apart) and over
// voxels (two layers of a fold in one voxel become one point, and pairs of points appear where a plane crosses).
#include <string.h>

#include "scan/scan_internal.h"

// By how many standard deviations of a depth two points may differ along the ray for nothing: three and one standard
// deviations of a difference. Points covered with more slack are too far apart where the surface is oblique.
#define SLACK 4.0
#define COVER_SLACK 1.4
#define MEAN (1.0 / 3)  // radius of the mean over the spacing
#define FIT 0.6         // radius of the plane over the spacing
#define FIT_NOISE 4.0   // the same over the standard deviation: with less the plane follows the ray
#define MAX_FIT 3.0     // the same over the spacing, at most, and slack over it

typedef struct Cells {
    const ScanPicture* p;
    int npoint;
    int* cell;          // point of each pixel, -1 none             (npixel)
    int* seed;          // pixel of each point                      (npoint of npixel)
    double* distance2;  // to its point, m^2                        (npixel)
    int* queue;         // pixels that the last search met          (npixel)
    int* last;          // number of the last search that met it    (npixel)
    int nsearch;
} Cells;

static OmStatus cells_init(Cells* c, const ScanPicture* p) {
    OmStatus status = OM_OK;
    *c = (Cells){.p = p};
    OM_ALLOC_DONE(c->cell, p->npixel);
    OM_ALLOC_DONE(c->seed, p->npixel);
    OM_ALLOC_DONE(c->distance2, p->npixel);
    OM_ALLOC_DONE(c->queue, p->npixel);
    OM_CALLOC_DONE(c->last, p->npixel);
    for (int i = 0; i < p->npixel; ++i) c->cell[i] = -1;
done:
    return status;
}

static void cells_done(Cells* c) {
    om_free(c->cell);
    om_free(c->seed);
    om_free(c->distance2);
    om_free(c->queue);
    om_free(c->last);
}

typedef struct Center {  // the middle of a neighbourhood
    OmVec3 x, ray;       // of its pixel: place, and unit direction from the eye
    double slack;        // m, by which noise moves two points apart along the ray
} Center;

static Center center_of(const ScanPicture* p, int i, double slack) {
    OmVec3 x = om_load3(p->x, i);
    double noise = om__depth_noise(p, (double)p->depth[i]);
    return (Center){x, om_normalize(om_sub(x, p->eye)), slack * noise};
}

// Squared distance of a pixel's point from a centre, without the part that noise explains.
static double distance2_of(const ScanPicture* p, const Center* c, int i) {
    OmVec3 d = om_sub(om_load3(p->x, i), c->x);
    double along = om_dot(d, c->ray), rest = fmax(0, fabs(along) - c->slack);
    return om_norm2(d) - along * along + rest * rest;
}

// Pixels within `radius` of the point of pixel `seed`, reached by links inside this radius, into c->queue.
static int search(Cells* c, int seed, double radius, double slack) {
    const ScanPicture* p = c->p;
    Center center = center_of(p, seed, slack);
    int n = 0, mark = ++c->nsearch;
    c->queue[n++] = seed;
    c->last[seed] = mark;
    for (int q = 0; q < n; ++q)
        for (int k = 0; k < 4; ++k) {
            int i = c->queue[q], j = om__neighbour(p, i, k);
            if (j < 0 || c->last[j] == mark || !om__is_linked(p, i, j)) continue;
            if (distance2_of(p, &center, j) >= radius * radius) continue;
            c->last[j] = mark;
            c->queue[n++] = j;
        }
    return n;
}

static void choose_points(Cells* c, double spacing) {
    const ScanPicture* p = c->p;
    for (int i = 0; i < p->npixel; ++i) {
        if (p->class[i] != OM_SCAN_TISSUE || c->cell[i] >= 0) continue;
        int n = search(c, i, OM__SCAN_COVER * spacing, COVER_SLACK);
        Center center = center_of(p, i, COVER_SLACK);
        for (int q = 0; q < n; ++q) {
            int j = c->queue[q];
            double d2 = distance2_of(p, &center, j);
            if (c->cell[j] >= 0 && c->distance2[j] <= d2) continue;
            c->cell[j] = c->npoint;
            c->distance2[j] = d2;
        }
        c->seed[c->npoint++] = i;
    }
}

// ---- points -------------------------------------------------------------------------------------------------------

// Normal of the plane through the first n pixels of the queue, towards the eye; zero if they are few or on a line.
static OmVec3 fit_normal(const Cells* c, int n, OmVec3 eye) {
    OmVec3 mean, normal = om__plane_normal(c->p->x, n, c->queue, &mean);
    return om_dot(normal, om_sub(eye, mean)) < 0 ? om_scale(-1, normal) : normal;
}

// Mean of the first n pixels of the queue, and the standard deviation of its distance from the camera.
static OmVec3 mean_of(const Cells* c, int n, double* noise) {
    OmVec3 mean = om_vec3(0, 0, 0);
    double z = 0;
    for (int q = 0; q < n; ++q) {
        mean = om_madd(mean, 1.0 / n, om_load3(c->p->x, c->queue[q]));
        z += (double)c->p->depth[c->queue[q]] / n;
    }
    *noise = om__depth_noise(c->p, z) / sqrt(n);
    return mean;
}

static void place_points(Cells* c, const OmScanDef* def, OmVec3 eye, OmScan* scan) {
    double sum = 0, noise;
    for (int k = 0; k < c->npoint; ++k) {
        double pixel = c->p->angle * (double)c->p->depth[c->seed[k]];
        double sigma = om__depth_noise(c->p, (double)c->p->depth[c->seed[k]]);
        double radius = fmax(FIT * def->spacing, FIT_NOISE * sigma);
        radius = fmax(3.5 * pixel, fmin(radius, MAX_FIT * def->spacing));
        int n = search(c, c->seed[k], radius, SLACK);
        om_store3(scan->normal, k, fit_normal(c, n, eye));
        n = search(c, c->seed[k], fmax(MEAN * def->spacing, 0.5 * pixel), SLACK);
        om_store3(scan->x, k, mean_of(c, n, &noise));
        sum += noise * noise;
    }
    scan->noise = c->npoint > 0 ? sqrt(sum / c->npoint) : 0;
}

// ---- triangles ----------------------------------------------------------------------------------------------------

static bool is_facing(const OmScan* scan, const int v[3], OmVec3 eye, double min_cosine) {
    OmVec3 a = om_load3(scan->x, v[0]), b = om_load3(scan->x, v[1]), c = om_load3(scan->x, v[2]);
    OmVec3 normal = om_cross(om_sub(b, a), om_sub(c, a));
    OmVec3 ray = om_sub(eye, om_scale(1.0 / 3, om_add(a, om_add(b, c))));
    return om_dot(normal, ray) > min_cosine * om_norm(normal) * om_norm(ray);
}

// Cells of three linked pixels, which follow each other counter-clockwise; false unless they are three.
static bool are_three(const Cells* c, const int i[3], int v[3]) {
    for (int k = 0; k < 3; ++k) {
        if (!om__is_linked(c->p, i[k], i[(k + 1) % 3])) return false;
        v[k] = c->cell[i[k]];
    }
    return v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
}

// scan->tri_vert has room for all triangles: the dual of a planar diagram has at most two for each point, and every
// directed edge is used once.
static void connect(const Cells* c, const OmScanDef* def, OmVec3 eye, int max_tri, ScanEdges* e,
                    OmScan* scan) {
    int w = c->p->width, v[3];
    for (int row = 0; row + 1 < c->p->height; ++row)
        for (int column = 0; column + 1 < w; ++column) {
            int i = row * w + column;  // y is down: i, i + w, i + 1 is counter-clockwise
            const int corner[2][3] = {{i, i + w, i + 1}, {i + 1, i + w, i + w + 1}};
            for (int k = 0; k < 2 && scan->ntri < max_tri; ++k)
                if (are_three(c, corner[k], v) && is_facing(scan, v, eye, def->min_cosine) &&
                    om__edges_take(e, v))
                    memcpy(scan->tri_vert + 3 * (size_t)scan->ntri++, v, sizeof v);
        }
}

// Points whose neighbourhood is too small for a plane take the mean of their triangles; without any, on a narrow strip,
// their normal stays zero.
static void complete_normals(OmScan* scan) {
    for (int t = 0; t < scan->ntri; ++t) {
        const int* v = scan->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(scan->x, v[0]);
        OmVec3 normal =
            om_cross(om_sub(om_load3(scan->x, v[1]), a), om_sub(om_load3(scan->x, v[2]), a));
        for (int k = 0; k < 3; ++k) {
            OmVec3 n = om_load3(scan->normal, v[k]);
            // Sums of areas are far below 1, the length of a normal that is known.
            if (om_norm2(n) < 0.5) om_store3(scan->normal, v[k], om_add(n, normal));
        }
    }
    for (int i = 0; i < scan->npoint; ++i)
        om_store3(scan->normal, i, om_normalize(om_load3(scan->normal, i)));
}

OmStatus om__scan_decimate(const OmScanDef* def, const ScanPicture* picture, OmScan* scan) {
    OmVec3 eye = picture->eye;
    OmStatus status = OM_OK;
    Cells c;
    ScanEdges e = {0};
    OM_TRY_DONE(cells_init(&c, picture));
    choose_points(&c, def->spacing);
    OM_TRY_DONE(om_scan_init(c.npoint, 2 * c.npoint, scan));
    scan->ntri = 0;
    place_points(&c, def, eye, scan);
    OM_TRY_DONE(om__edges_init(&e, c.npoint, 2 * c.npoint));
    connect(&c, def, eye, 2 * c.npoint, &e, scan);
    complete_normals(scan);
done:
    om__edges_done(&e);
    cells_done(&c);
    return status;
}
