// umesh_organ.c: an organ immersed in a grid with a given number of active elements.
//
// A cell is active if the fraction min_fill or more of its sample points are inside. With one half, the steps of the
// boundary lie equally on both sides of the surface, and volume and stiffness have no bias. If every cell that overlaps
// the organ were active, the organ would grow by half a cell on all sides. Along `up` the grid begins at the organ's
// lowest point, so the fixed nodes of a flat base are on the base. The number of elements is roughly proportional to
// spacing^-3, with jumps by whole layers of cells; a bisection keeps the spacing with the nearest number.
#include <string.h>

#include "umesh/umesh_internal.h"

#define COOKIE 0x50f7f501u
#define SDF_NODES 64      // of the distance field along the organ's longest side
#define NSAMPLE 4         // points of a cell along an edge
#define NELEM_SLACK 0.01  // of the number of elements
#define MAX_TRY 40
#define HELD_SHARE 0.1  // fraction of the height; for an organ without a set "attachment"

OmUmeshOrganDef om_umesh_organ_default_def(void) {
    return (OmUmeshOrganDef){.nelem = 2174, .multiple = 4, .min_fill = 0.5, .cookie = COOKIE};
}

static OmStatus check_def(const OmUmeshOrganDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmUmeshOrganDef was not made by om_umesh_organ_default_def");
    OM_CHECK(!def->patient || !def->surface, OM_INVALID,
             "OmUmeshOrganDef has a patient and a surface; give one of them");
    OM_CHECK(def->nelem >= 8 && def->nelem <= 1000000, OM_INVALID,
             "OmUmeshOrganDef.nelem = %d, must be in 8 .. 1000000", def->nelem);
    OM_CHECK(def->spacing >= 0 && isfinite(def->spacing), OM_INVALID,
             "OmUmeshOrganDef.spacing = %g m, must not be negative", def->spacing);
    OM_CHECK(def->multiple >= 1 && def->multiple <= 64, OM_INVALID,
             "OmUmeshOrganDef.multiple = %d, must be in 1 .. 64", def->multiple);
    OM_CHECK(def->min_fill > 0 && def->min_fill < 1, OM_INVALID,
             "OmUmeshOrganDef.min_fill = %g, must be in (0, 1)", def->min_fill);
    OM_CHECK(def->held_height >= 0 && def->held_height < 1, OM_INVALID,
             "OmUmeshOrganDef.held_height = %g, must be in [0, 1)", def->held_height);
    OM_CHECK(om_is_finite3(def->up), OM_INVALID, "OmUmeshOrganDef.up is not finite");
    for (int c = 0; c < 3; ++c)
        OM_CHECK(def->dim[c] >= 0 && def->dim[c] <= 1024, OM_INVALID,
                 "OmUmeshOrganDef.dim[%d] = %d, must be in 0 .. 1024", c, def->dim[c]);
    return OM_OK;
}

// ---- the shape --------------------------------------------------------------------------------------

typedef struct Shape {  // shape and attachment of the organ
    const OmUmeshOrganDef* def;
    OmVec3 lo, hi, up;
    double low, high;    // of dot(up, surface), m
    double held_height;  // fraction of the height
    const OmMeshSet* held;
    const double* held_x;  // attached vertices of the patient's mesh
    double reach;          // of an attached vertex, m
} Shape;

static double phantom_fn(void* ctx, OmVec3 p) {
    (void)ctx;
    return om_half_ellipsoid_eval(OM_PHANTOM_HALF, p);
}

static OmStatus sdf_of_surface(const OmSurface* surface, OmSdf* sdf) {
    OM_CHECK(surface->nvert > 3 && surface->ntri > 3, OM_INVALID, "umesh: the surface is empty");
    OmVec3 lo = om_load3(surface->x, 0), hi = lo;
    for (int i = 1; i < surface->nvert; ++i) {
        lo = om_min3(lo, om_load3(surface->x, i));
        hi = om_max3(hi, om_load3(surface->x, i));
    }
    OmVec3 size = om_sub(hi, lo);
    OmSdfDef def = om_sdf_default_def(fmax(size.x, fmax(size.y, size.z)) / SDF_NODES);
    return om_sdf_from_surface(surface, &def, sdf);
}

static OmStatus make_field(const OmUmeshOrganDef* def, OmSdf* sdf) {
    if (def->surface) return sdf_of_surface(def->surface, sdf);
    if (def->patient) {
        OmSurface surface;
        OM_TRY(om_tet_mesh_boundary(&def->patient->mesh, &surface, NULL));
        OmStatus status = sdf_of_surface(&surface, sdf);
        om_surface_done(&surface);
        return status;
    }
    OmVec3 half = OM_PHANTOM_HALF, pad = om_vec3(0.005, 0.005, 0.005);
    OmSdfDef field = om_sdf_default_def(2 * half.x / SDF_NODES);
    return om_sdf_from_function(phantom_fn, NULL, om_sub(om_vec3(-half.x, -half.y, 0), pad),
                                om_add(half, pad), &field, sdf);
}

static double mean_edge(const OmTetMesh* mesh) {
    double sum = 0;
    for (int t = 0; t < mesh->ntet; ++t)
        sum += om_distance(om_load3(mesh->x, mesh->tet_vert[4 * (size_t)t]),
                           om_load3(mesh->x, mesh->tet_vert[4 * (size_t)t + 1]));
    return sum / mesh->ntet;
}

static void measure_shape(const OmUmeshOrganDef* def, const OmSurface* surface, Shape* s) {
    *s = (Shape){.def = def, .lo = om_load3(surface->x, 0), .low = INFINITY, .high = -INFINITY};
    bool is_phantom = !def->patient && !def->surface;
    s->up = om_norm(def->up) > 0 ? def->up : def->patient ? def->patient->up : om_vec3(0, 0, 1);
    if (!(om_norm(s->up) > 0)) s->up = om_vec3(0, 0, 1);
    s->up = om_normalize(s->up);
    s->hi = s->lo;
    for (int i = 0; i < surface->nvert; ++i) {
        OmVec3 p = om_load3(surface->x, i);
        s->lo = om_min3(s->lo, p), s->hi = om_max3(s->hi, p);
        s->low = fmin(s->low, om_dot(s->up, p)), s->high = fmax(s->high, om_dot(s->up, p));
    }
    if (is_phantom) {  // exact, unlike its sampled distance field
        OmVec3 half = OM_PHANTOM_HALF;
        s->lo = om_vec3(-half.x, -half.y, 0), s->hi = half;
    }
    s->held_height = def->held_height > 0 || is_phantom ? def->held_height : HELD_SHARE;
    if (def->patient && def->held_height == 0)
        s->held = om_tet_mesh_find_set(&def->patient->mesh, "attachment");
    if (s->held) {
        s->held_x = def->patient->mesh.x;
        s->reach = 0.75 * mean_edge(&def->patient->mesh);
    }
}

// True if p is fixed, or nearer than `more` to the fixed region. `low`: lowest height of the organ or of its grid.
static bool is_held(const Shape* s, OmVec3 p, double low, double more) {
    if (!s->held) return om_dot(s->up, p) <= low + s->held_height * (s->high - s->low) + more;
    for (int i = 0; i < s->held->nvert; ++i)
        if (om_distance(p, om_load3(s->held_x, s->held->vert[i])) <= s->reach + more) return true;
    return false;
}

// ---- cells ------------------------------------------------------------------------------------------

// True if the fraction of the cell at `corner` that is inside is at least min_fill.
static bool is_filled(const OmSdf* sdf, OmVec3 corner, double side, double min_fill) {
    OmVec3 half = om_vec3(0.5, 0.5, 0.5);
    double middle = om_sdf_eval(sdf, om_madd(corner, side, half), NULL);
    if (fabs(middle) > side * 0.5 * sqrt(3.0) + sdf->grid.spacing) return middle < 0;
    int num = 0;
    for (int n = 0; n < NSAMPLE * NSAMPLE * NSAMPLE; ++n) {
        OmVec3 at = om_vec3(n % NSAMPLE, n / NSAMPLE % NSAMPLE, n / (NSAMPLE * NSAMPLE));
        OmVec3 p = om_madd(corner, side / NSAMPLE, om_add(at, half));
        num += om_sdf_eval(sdf, p, NULL) < 0;
    }
    return num >= min_fill * NSAMPLE * NSAMPLE * NSAMPLE;
}

// A grid of this spacing around the organ, centred; along `up` its border is at the organ's lowest point.
static OmStatus place_grid(const Shape* s, double spacing, OmGrid* f) {
    *f = (OmGrid){.spacing = spacing};
    const double lo[3] = {s->lo.x, s->lo.y, s->lo.z}, hi[3] = {s->hi.x, s->hi.y, s->hi.z};
    const double up[3] = {s->up.x, s->up.y, s->up.z};
    double origin[3], total = 1;
    int ncells[3], longest = 0;
    for (int c = 0; c < 3; ++c) {
        double num = ceil((hi[c] - lo[c]) / spacing - 1e-6);
        OM_CHECK(num < 1000, OM_INVALID, "umesh: spacing %g m makes too many cells", spacing);
        int ncell = (int)num, max = ncell + 1 > s->def->dim[c] ? ncell + 1 : s->def->dim[c];
        ncells[c] = ncell;
        f->dim[c] = max;
        if (f->dim[c] > f->dim[longest]) longest = c;
    }
    for (int c = 0; c < 3; ++c) {
        int multiple = (c == longest ? 2 : 1) * s->def->multiple, ncell = ncells[c];
        f->dim[c] = (f->dim[c] + multiple - 1) / multiple * multiple;
        total *= f->dim[c];
        double begin = 0.5 * (lo[c] + hi[c]) - 0.5 * ncell * spacing;
        if (up[c] > 0.9) begin = lo[c];
        if (up[c] < -0.9) begin = hi[c] - ncell * spacing;
        origin[c] = begin - (f->dim[c] - ncell - 1) / 2 * spacing;
    }
    OM_CHECK(total <= OM__UMESH_MAX_POINT, OM_INVALID,
             "umesh: a grid of %d x %d x %d points is too large", f->dim[0], f->dim[1], f->dim[2]);
    f->origin = om_vec3(origin[0], origin[1], origin[2]);
    return OM_OK;
}

// Keep only the largest part that is connected over faces; returns its number of cells.
static int keep_largest(const int dim[3], unsigned char* active, int* part, int* queue) {
    const int step[3] = {1, dim[0], dim[0] * dim[1]};
    int npoint = dim[0] * dim[1] * dim[2], best = 0, best_part = 0, npart = 0;
    memset(part, 0, (size_t)npoint * sizeof *part);
    for (int first = 0; first < npoint; ++first) {
        if (!active[first] || part[first]) continue;
        int begin = 0, end = 0;
        part[first] = ++npart;
        queue[end++] = first;
        for (; begin < end; ++begin)
            for (int d = 0; d < 6; ++d) {  // active cells are never on the last layer of points
                int next = queue[begin] + (d < 3 ? step[d] : -step[d - 3]);
                if (next < 0 || next >= npoint || !active[next] || part[next]) continue;
                part[next] = npart;
                queue[end++] = next;
            }
        if (end > best) best = end, best_part = npart;
    }
    for (int p = 0; p < npoint; ++p) active[p] = active[p] && part[p] == best_part;
    return best;
}

typedef struct Cells {  // grown as needed
    unsigned char* active;
    int *part, *queue;
} Cells;

static void cells_done(Cells* cells) {
    om_free(cells->active);
    om_free(cells->part);
    om_free(cells->queue);
    *cells = (Cells){0};
}

static OmStatus mark_cells(const Shape* s, const OmSdf* sdf, double spacing, OmGrid* f,
                           Cells* cells, int* nelem) {
    cells_done(cells);
    OM_TRY(place_grid(s, spacing, f));
    size_t npoint = om_grid_count(f->dim);
    OM_ALLOC(cells->active, npoint);
    OM_ALLOC(cells->part, npoint);
    OM_ALLOC(cells->queue, npoint);
    size_t n = 0;
    for (int k = 0; k < f->dim[2]; ++k)
        for (int j = 0; j < f->dim[1]; ++j)
            for (int i = 0; i < f->dim[0]; ++i, ++n) {
                bool is_cell = om_grid_has(f->dim, i + 1, j + 1, k + 1);
                OmVec3 corner = om_grid_point(f, i, j, k);
                cells->active[n] = is_cell && is_filled(sdf, corner, spacing, s->def->min_fill);
            }
    *nelem = keep_largest(f->dim, cells->active, cells->part, cells->queue);
    return OM_OK;
}

// Bisection in the logarithm of the spacing; keeps the spacing with the best number of elements.
static OmStatus find_cells(const Shape* s, const OmSdf* sdf, OmGrid* f, Cells* cells) {
    const OmUmeshOrganDef* def = s->def;
    int nelem = 0;
    if (def->spacing > 0) {
        OM_TRY(mark_cells(s, sdf, def->spacing, f, cells, &nelem));
        OM_CHECK(nelem >= 8, OM_INVALID, "umesh: %d active elements at a spacing of %g mm", nelem,
                 1e3 * def->spacing);
        return OM_OK;
    }
    OmVec3 size = om_sub(s->hi, s->lo);
    double guess = log(cbrt(size.x * size.y * size.z / def->nelem));
    double fine = guess - 1.2, coarse = guess + 0.2, best = 0, min = INFINITY;
    for (int turn = 0; turn < MAX_TRY; ++turn) {
        double middle = 0.5 * (fine + coarse), spacing = exp(middle);
        OM_TRY(mark_cells(s, sdf, spacing, f, cells, &nelem));
        double miss = fabs((double)nelem / def->nelem - 1);
        if (miss < min) min = miss, best = spacing;
        if (nelem == def->nelem) break;
        if (nelem > def->nelem)
            fine = middle;
        else
            coarse = middle;
    }
    OM_CHECK(min <= NELEM_SLACK || def->nelem < 200, OM_INVALID,
             "umesh: no spacing gives %d elements, the nearest misses by %.1f %%; give the spacing",
             def->nelem, 100 * min);
    return mark_cells(s, sdf, best, f, cells, &nelem);
}

// ---- nodes and surface ------------------------------------------------------------------------------

static OmStatus hold_nodes(const Shape* s, OmUmeshGrid* g) {
    double low = INFINITY;
    int num = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        low = fmin(low, om_dot(s->up, om_load3(g->fem.mesh.x, i)));
    double more = s->held ? 0.75 * g->fem.grid.spacing : 1e-6 * g->fem.grid.spacing;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        g->fem.fixed[i] = is_held(s, om_load3(g->fem.mesh.x, i), low, more);
        num += g->fem.fixed[i];
    }
    OM_CHECK(num >= 3 && num < g->fem.mesh.nnode, OM_INVALID,
             "umesh: %d of %d nodes are held; give the patient another attachment, or another up",
             num, g->fem.mesh.nnode);
    return OM_OK;
}

static void place_skin(const OmSdf* sdf, OmUmeshGrid* g) {
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 p = om_load3(g->fem.mesh.x, i), slope;
        for (int turn = 0; turn < 3 && g->is_surface[i]; ++turn) {
            double d = om_sdf_eval(sdf, p, &slope), steep = om_norm2(slope);
            if (steep > 0.01)
                p = om_madd(p, -d / steep, slope);  // if flat, on a ridge inside, p is not moved
        }
        om_store3(g->surface_x, i, p);
    }
}

// Cumulative areas of the triangles on which the centre of a patch may be.
static OmStatus sum_areas(const Shape* s, OmUmeshOrgan* o) {
    double sum = 0;
    OM_ALLOC(o->area, o->surface.ntri);
    for (int t = 0; t < o->surface.ntri; ++t) {
        const int* v = o->surface.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(o->surface.x, v[0]), b = om_load3(o->surface.x, v[1]);
        OmVec3 c = om_load3(o->surface.x, v[2]);
        OmVec3 middle = om_scale(1.0 / 3, om_add(a, om_add(b, c)));
        if (!is_held(s, middle, s->low, o->grid.fem.grid.spacing))
            sum += 0.5 * om_norm(om_cross(om_sub(b, a), om_sub(c, a)));
        o->area[t] = sum;
    }
    OM_CHECK(sum > 0, OM_INVALID, "umesh: the whole surface is held");
    return OM_OK;
}

void om__umesh_pick_point(const OmUmeshOrgan* o, OmRng* rng, OmVec3* p, OmVec3* normal) {
    int lo = 0, hi = o->surface.ntri - 1;
    double at = om_rng_uniform(rng) * o->area[hi];
    while (lo < hi) {  // the first triangle whose sum is above `at`
        int middle = (lo + hi) / 2;
        if (o->area[middle] > at)
            hi = middle;
        else
            lo = middle + 1;
    }
    double s = sqrt(om_rng_uniform(rng)), t = om_rng_uniform(rng);
    const int* v = o->surface.tri_vert + 3 * (size_t)lo;
    OmVec3 a = om_load3(o->surface.x, v[0]), b = om_load3(o->surface.x, v[1]);
    OmVec3 c = om_load3(o->surface.x, v[2]), slope;
    *p = om_add(om_scale(1 - s, a), om_add(om_scale(s * (1 - t), b), om_scale(s * t, c)));
    om_sdf_eval(&o->sdf, *p, &slope);
    if (om_norm(slope) < 0.1) slope = om_cross(om_sub(b, a), om_sub(c, a));
    *normal = om_normalize(slope);
}

// ---- create -----------------------------------------------------------------------------------------

// The network and its refinement allow one modulus and one Poisson's ratio.
static OmStatus take_material(const OmPatient* p, OmUmeshOrgan* o) {
    const OmPatientMaterial* first = p->nmaterial > 0 ? &p->material[0] : NULL;
    for (int e = 0; e < p->mesh.ntet && p->nmaterial > 0; ++e) {
        int k = om_patient_find_material(p, p->mesh.tet_label[e]);
        OM_CHECK(k >= 0, OM_INVALID, "umesh: the patient %s has no material for label %d", p->name,
                 p->mesh.tet_label[e]);
        const OmPatientMaterial* m = &p->material[k];
        if (e == 0) first = m;
        OM_CHECK(
            m->young == first->young && m->poisson == first->poisson, OM_INVALID,
            "umesh: the patient %s is of several materials (%s: %g Pa, %g; %s: %g Pa, %g), and "
            "a network knows one; give all its elements the same modulus and ratio",
            p->name, first->name, first->young, first->poisson, m->name, m->young, m->poisson);
    }
    if (first) o->young = first->young, o->poisson = first->poisson;
    return OM_OK;
}

OmStatus om_umesh_organ_create(const OmUmeshOrganDef* def, OmUmeshOrgan** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    Shape shape;
    OmGrid frame;
    Cells cells = {0};
    OmStatus status = OM_OK;
    OmUmeshOrgan* o = om_calloc(1, sizeof *o);
    if (!o) return OM_NO_MEMORY;
    if (def->patient) OM_TRY_DONE(take_material(def->patient, o));
    OM_TRY_DONE(make_field(def, &o->sdf));
    OM_TRY_DONE(om_surface_from_sdf(&o->sdf, 0, &o->surface));
    measure_shape(def, &o->surface, &shape);
    OM_TRY_DONE(find_cells(&shape, &o->sdf, &frame, &cells));
    OM_TRY_DONE(om__umesh_grid_init(&frame, shape.up, cells.active, &o->grid));
    OM_TRY_DONE(hold_nodes(&shape, &o->grid));
    OM_TRY_DONE(om__umesh_grid_find_surface(&o->grid));
    place_skin(&o->sdf, &o->grid);
    o->grid.hash = om__umesh_grid_hash(&o->grid);
    OM_TRY_DONE(sum_areas(&shape, o));
done:
    cells_done(&cells);
    if (status < 0)
        om_umesh_organ_destroy(o);
    else
        *out = o;
    return status;
}

void om_umesh_organ_destroy(OmUmeshOrgan* o) {
    if (!o) return;
    om_umesh_grid_done(&o->grid);
    om_surface_done(&o->surface);
    om_sdf_done(&o->sdf);
    om_free(o->area);
    om_free(o);
}

const OmUmeshGrid* om_umesh_organ_grid(const OmUmeshOrgan* organ) { return &organ->grid; }
const OmSurface* om_umesh_organ_surface(const OmUmeshOrgan* organ) { return &organ->surface; }
