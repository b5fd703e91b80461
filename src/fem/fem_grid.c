// fem_grid.c: active cells of a regular grid as a mesh of hexahedra.
#include "omentum/fem_grid.h"

#include <limits.h>
#include <string.h>

#include "fem/fem_grid_internal.h"

void om_fem_grid_done(OmFemGrid* grid) {
    if (!grid) return;
    om_fem_mesh_done(&grid->mesh);
    om_free(grid->cell_elem);
    om_free(grid->point_node);
    om_free(grid->node_point);
    om_free(grid->fixed);
    *grid = (OmFemGrid){0};
}

const int om__grid_corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

// The last point of a row begins no cell.
static bool is_cell(const int dim[3], int point) {
    int at[3];
    om_grid_unpack(dim, (size_t)point, at);
    return om_grid_has(dim, at[0] + 1, at[1] + 1, at[2] + 1);
}

static OmStatus number_nodes(OmFemGrid* g, const unsigned char* active) {
    size_t point[8];
    OmFemMesh* m = &g->mesh;
    *m = (OmFemMesh){.kind = OM_HEX8, .nelem_node = 8};
    for (int p = 0; p < g->npoint; ++p) g->point_node[p] = g->cell_elem[p] = -1;
    for (int c = 0; c < g->npoint; ++c) {
        if (!active[c]) continue;
        OM_CHECK(is_cell(g->grid.dim, c), OM_INVALID, "grid: cell %d is on the border of the grid",
                 c);
        om_grid_corners(g->grid.dim, (size_t)c, point);
        g->cell_elem[c] = m->nelem++;
        for (int a = 0; a < 8; ++a) g->point_node[point[a]] = 0;
    }
    OM_CHECK(m->nelem > 0, OM_INVALID, "grid: the grid has no active cell");
    for (int p = 0; p < g->npoint; ++p)
        if (g->point_node[p] == 0) g->point_node[p] = m->nnode++;
    return OM_OK;
}

static OmStatus fill_mesh(OmFemGrid* g) {
    OmFemMesh* m = &g->mesh;
    OM_ALLOC(m->x, 3 * (size_t)m->nnode);
    OM_ALLOC(m->elem_node, 8 * (size_t)m->nelem);
    m->elem_material = om_calloc((size_t)m->nelem, sizeof(int));
    if (!m->elem_material) return OM_NO_MEMORY;
    OM_ALLOC(g->node_point, m->nnode);
    for (int p = 0; p < g->npoint; ++p) {
        const int node = g->point_node[p], elem = g->cell_elem[p];
        int at[3];
        size_t point[8];
        if (node >= 0) {
            g->node_point[node] = p;
            om_grid_unpack(g->grid.dim, (size_t)p, at);
            om_store3(m->x, node, om_grid_point(&g->grid, at[0], at[1], at[2]));
        }
        if (elem < 0) continue;
        om_grid_corners(g->grid.dim, (size_t)p, point);
        for (size_t a = 0; a < 8; ++a) m->elem_node[8 * (size_t)elem + a] = g->point_node[point[a]];
    }
    return OM_OK;
}

// An element has 24 unknowns and a grid has fewer cells than points: 24 indices a point fit in an int.
static OmStatus check_points(const OmGrid* points, const unsigned char* active) {
    double num = 1;
    for (int c = 0; c < 3; ++c) {
        OM_CHECK(points->dim[c] >= 1, OM_INVALID, "grid: points.dim[%d] is %d; must be at least 1",
                 c, points->dim[c]);
        num *= points->dim[c];
    }
    OM_CHECK(num <= INT_MAX / 24, OM_INVALID, "grid: points.dim makes %.0f points; at most %d", num,
             INT_MAX / 24);
    OM_CHECK(points->spacing > 0 && isfinite(points->spacing), OM_INVALID,
             "grid: points.spacing is %g m; must be above 0", points->spacing);
    OM_CHECK(active, OM_INVALID, "grid: active is null");
    return OM_OK;
}

OmStatus om_fem_grid_init(const OmGrid* points, const unsigned char* active, OmFemGrid* g) {
    *g = (OmFemGrid){0};
    OM_TRY(check_points(points, active));
    g->grid = *points;
    OmStatus status = OM_OK;
    g->npoint = g->grid.dim[0] * g->grid.dim[1] * g->grid.dim[2];
    OM_ALLOC_DONE(g->cell_elem, g->npoint);
    OM_ALLOC_DONE(g->point_node, g->npoint);
    OM_TRY_DONE(number_nodes(g, active));
    OM_TRY_DONE(fill_mesh(g));
    OM_CALLOC_DONE(g->fixed, g->mesh.nnode);
    OM_TRY_DONE(om_fem_mesh_validate(&g->mesh));
done:
    if (status < 0) om_fem_grid_done(g);
    return status;
}

// ---- as tetrahedra ----------------------------------------------------------------------------------

const int om__grid_tet[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};

OmStatus om_fem_grid_make_tet_mesh(const OmFemGrid* g, OmTetMesh* mesh) {
    int nfixed = 0;
    OM_TRY(om_tet_mesh_init(mesh, g->mesh.nnode, 6 * g->mesh.nelem));
    memcpy(mesh->x, g->mesh.x, 3 * (size_t)g->mesh.nnode * sizeof *mesh->x);
    for (int e = 0; e < g->mesh.nelem; ++e)
        for (int k = 0; k < 6; ++k)
            for (int a = 0; a < 4; ++a)
                mesh->tet_vert[24 * e + 4 * k + a] = g->mesh.elem_node[8 * e + om__grid_tet[k][a]];
    int* fixed = om_alloc((size_t)g->mesh.nnode, sizeof *fixed);
    OmStatus status = fixed ? OM_OK : OM_NO_MEMORY;
    for (int i = 0; i < g->mesh.nnode && fixed; ++i)
        if (g->fixed[i]) fixed[nfixed++] = i;
    if (status >= 0) status = om_tet_mesh_add_set(mesh, "attachment", fixed, nfixed);
    om_free(fixed);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}

// ---- from a distance field ------------------------------------------------------------------------------

// Does the cube at `corner` touch the inside? Sampled at the field's spacing or finer, faces included.
static bool touches_inside(const OmSdf* sdf, OmVec3 corner, double side) {
    OmVec3 centre = om_add(corner, om_scale(side / 2, om_vec3(1, 1, 1)));
    double at_centre = om_sdf_eval(sdf, centre, NULL);
    if (at_centre < 0) return true;
    if (at_centre > side * 0.5 * sqrt(3.0) + sdf->grid.spacing) return false;
    int num = (int)ceil(side / sdf->grid.spacing);
    for (int k = 0; k <= num; ++k)
        for (int j = 0; j <= num; ++j)
            for (int i = 0; i <= num; ++i) {
                OmVec3 p = om_madd(corner, side / num, om_vec3(i, j, k));
                if (om_sdf_eval(sdf, p, NULL) < 0) return true;
            }
    return false;
}

// Points of a grid around the inside of the field, centred on it.
static OmStatus place_points(const OmSdf* sdf, double side, OmGrid* points) {
    OmVec3 lo = {INFINITY, INFINITY, INFINITY}, hi = {-INFINITY, -INFINITY, -INFINITY};
    for (int k = 0, n = 0; k < sdf->grid.dim[2]; ++k)
        for (int j = 0; j < sdf->grid.dim[1]; ++j)
            for (int i = 0; i < sdf->grid.dim[0]; ++i, ++n) {
                if (!(sdf->d[n] < 0)) continue;
                OmVec3 p = om_grid_point(&sdf->grid, i, j, k);
                lo = om_min3(lo, p), hi = om_max3(hi, p);
            }
    OM_CHECK(lo.x <= hi.x, OM_INVALID, "grid: nothing is inside the distance field");
    // the surface is up to one node spacing beyond
    const double size[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
    double cells = 1, num[3];
    for (int c = 0; c < 3; ++c) {
        num[c] = ceil((size[c] + 2 * sdf->grid.spacing) / side);
        cells *= num[c];
        OM_CHECK(cells < 1e8, OM_INVALID, "grid: spacing %g m makes too many cells", side);
        points->dim[c] = (int)num[c] + 1;
    }
    points->spacing = side;
    OmVec3 extent = om_scale(side, om_vec3(num[0], num[1], num[2]));
    points->origin = om_madd(om_lerp(lo, hi, 0.5), -0.5, extent);
    return OM_OK;
}

OmStatus om_fem_grid_from_sdf(const OmSdf* sdf, double spacing, OmFemGrid* grid) {
    *grid = (OmFemGrid){0};
    OM_CHECK(spacing > 0 && isfinite(spacing), OM_INVALID, "grid: spacing is %g m, must be above 0",
             spacing);
    OmGrid points;
    unsigned char* active;
    OM_TRY(place_points(sdf, spacing, &points));
    active = om_calloc(om_grid_count(points.dim), 1);
    if (!active) return OM_NO_MEMORY;
    for (int k = 0; k < points.dim[2] - 1; ++k)
        for (int j = 0; j < points.dim[1] - 1; ++j)
            for (int i = 0; i < points.dim[0] - 1; ++i)
                active[om_grid_index(points.dim, i, j, k)] =
                    touches_inside(sdf, om_grid_point(&points, i, j, k), spacing);
    OmStatus status = om_fem_grid_init(&points, active, grid);
    om_free(active);
    return status;
}
