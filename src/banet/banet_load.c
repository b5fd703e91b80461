// banet_load.c: attachments, the pull, its static equilibrium, and the visible part (thesis 4.2.1).
//
// Attachments and the visible part are patches by (4.1) (om_surface_random_patch). The attached share is log-uniform.
// In Table 4.1 the whole lowest surface (row All) has DSC 0.42 (0.31-0.55) and TPR 93 %; with the lowest surface at
// 45 % of all vertices, the attached ones are 13 % (9-19 %) of them.
//
// The force acts on the free surface vertices within a radius of a random free vertex, in equal parts; its direction
// is uniform over the half space outward of the surface there, for a gripper pulls. Vertices far from the attachments
// are grasped more often, as a surgeon does: where attached tissue is grasped, only the surroundings of the gripper
// move. With a uniform share and grasp, 63 % of the free surface moved by less than 1 mm (median of 88 samples).
//
// The size of the force is young T sqrt(A) times a uniform number, where T is the mean thickness of the body and A the
// grasped area: T sqrt(A) is about the section through which the force enters, so the strain around the gripper is the
// same for all bodies. A force of random size alone pulled needles ten times their length out of thin rims, and moved
// thick bodies by a millimetre.
//
// A body on a board starts from its equilibrium under gravity and one-sided contact, which is also the shape that a
// scan would show; so the displacement is only that of the pull. Contact is a penalty on surface nodes below the plane.
#include <string.h>

#include "banet/banet_internal.h"

#include "omentum/shape_meshing.h"
#include "omentum/shape_points.h"
#include "omentum/shape_tet10.h"

#define GRAVITY 9.81
#define MIN_ATTACHED 3       // vertices of a region: fewer leave the body free to turn
#define GAP 2                // rings of free vertices around the first of two regions
#define MOST_DIRECT 800      // nodes; beyond, CG with multigrid is faster (doc/notes/banet.md)
#define CG_TOLERANCE 0.03    // of the residual, in each Newton iteration
#define BOARD_STIFFNESS 100  // Pa/m of the contact, times young over the height of the body

static OmPatchDef draw_patch(OmRng* rng, double share) {
    uint64_t seed = om_rng_u32(rng);
    return om_patch_default_def(share, seed | (uint64_t)om_rng_u32(rng) << 32);
}

// ---- attachments ------------------------------------------------------------------------------------

// Mark the neighbours of marked vertices, with `value`.
static void grow(const OmSurface* s, unsigned char* mark, unsigned char value) {
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = &s->tri_vert[3 * (size_t)t];
        bool has = false;
        for (int c = 0; c < 3; ++c) has = has || (mark[v[c]] && mark[v[c]] != value);
        for (int c = 0; c < 3 && has; ++c)
            if (!mark[v[c]]) mark[v[c]] = value;
    }
}

// A second region among the vertices that are not near the first.
static OmStatus attach_second(const OmSurface* s, OmRng* rng, double share, unsigned char* attached,
                              int* nattached) {
    OmStatus status = OM_OK;
    int *candidate = NULL, *vert = NULL, ncandidate = 0, nvert = 0;
    unsigned char* mark = NULL;
    OmPatchDef patch = draw_patch(rng, 0);
    OM_ALLOC_DONE(mark, s->nvert);
    OM_ALLOC_DONE(candidate, s->nvert);
    memcpy(mark, attached, (size_t)s->nvert);
    for (int ring = 0; ring < GAP; ++ring) grow(s, mark, (unsigned char)(2 + ring));
    for (int i = 0; i < s->nvert; ++i)
        if (!mark[i]) candidate[ncandidate++] = i;
    *nattached = 0;
    if (ncandidate == 0) goto done;
    patch.share = fmin(1, share * s->nvert / ncandidate);
    OM_TRY_DONE(om_surface_random_patch(s, candidate, ncandidate, &patch, &vert, &nvert));
    for (int i = 0; i < nvert; ++i) attached[vert[i]] = 1;
    *nattached = nvert;
done:
    om_free(mark);
    om_free(candidate);
    om_free(vert);
    return status;
}

OmStatus om__banet_attach(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample,
                          bool* is_good) {
    OmStatus status = OM_OK;
    int *vert = NULL, nvert = 0, nsecond = MIN_ATTACHED;
    const OmSurface* s = &sample->surface;
    double share = exp(om_rng_range(rng, log(def->share[0]), log(def->share[1])));
    double first = sample->nregion == 2 ? om_rng_range(rng, 0.3, 0.7) * share : share;
    OmPatchDef patch = draw_patch(rng, first);
    OM_CALLOC_DONE(sample->attached, s->nvert);
    OM_TRY_DONE(om_surface_random_patch(s, NULL, 0, &patch, &vert, &nvert));
    for (int i = 0; i < nvert; ++i) sample->attached[vert[i]] = 1;
    if (sample->nregion == 2)
        OM_TRY_DONE(attach_second(s, rng, share - first, sample->attached, &nsecond));
    *is_good = nvert >= MIN_ATTACHED && nsecond >= MIN_ATTACHED;
    for (int i = 0; i < s->nvert; ++i) sample->share += sample->attached[i];
    sample->share /= s->nvert;
done:
    om_free(vert);
    return status;
}

// ---- the pull ---------------------------------------------------------------------------------------

static void vertex_areas(const OmSurface* s, double* area) {
    memset(area, 0, (size_t)s->nvert * sizeof *area);
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = &s->tri_vert[3 * (size_t)t];
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        double third = om_norm(om_cross(om_sub(b, a), om_sub(c, a))) / 6;
        for (int k = 0; k < 3; ++k) area[v[k]] += third;
    }
}

// Root of the grasped area times the mean thickness of the body, twice its volume over its surface, m^2.
static double grasped_section(const OmBanetSample* s, const double* area) {
    double whole = 0, held = 0;
    for (int i = 0; i < s->surface.nvert; ++i) {
        whole += area[i];
        held += s->grasped[i] ? area[i] : 0;
    }
    return 2 * om_tet_mesh_volume(&s->mesh) / whole * sqrt(held);  // a closed surface has an area
}

// A free vertex, with a probability in proportion to the square of its distance from the attachments; -1: none is free.
static OmStatus draw_center(const OmSurface* s, const unsigned char* attached, OmRng* rng,
                            int* center) {
    OmStatus status = OM_OK;
    OmPointTree* tree = NULL;
    double *held = NULL, *sum = NULL, all = 0;
    int nheld = 0;
    *center = -1;
    OM_ALLOC_DONE(held, 3 * (size_t)s->nvert);
    OM_ALLOC_DONE(sum, s->nvert);
    for (int i = 0; i < s->nvert; ++i)
        if (attached[i]) om_store3(held, nheld++, om_load3(s->x, i));
    OM_TRY_DONE(om_point_tree_create(nheld, held, &tree));
    for (int i = 0; i < s->nvert; ++i) {
        double distance = 0;
        if (!attached[i]) om_point_tree_find(tree, om_load3(s->x, i), &distance);
        sum[i] = all += distance * distance;
    }
    double draw = om_rng_range(rng, 0, all);
    for (int i = 0; i < s->nvert && *center < 0; ++i)
        if (!attached[i] && sum[i] > draw) *center = i;
done:
    om_point_tree_destroy(tree);
    om_free(held);
    om_free(sum);
    return status;
}

OmStatus om__banet_grasp(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample,
                         bool* is_good) {
    OmStatus status = OM_OK;
    const OmSurface* s = &sample->surface;
    double *normal = NULL, *area = NULL;
    double radius = om_rng_range(rng, def->radius[0], def->radius[1]);
    OM_CALLOC_DONE(sample->grasped, s->nvert);
    OM_ALLOC_DONE(normal, 3 * (size_t)s->nvert);
    OM_ALLOC_DONE(area, s->nvert);
    om_surface_normals(s, normal);
    vertex_areas(s, area);
    OM_TRY_DONE(draw_center(s, sample->attached, rng, &sample->center));
    *is_good = sample->center >= 0;
    if (!*is_good) goto done;
    OmVec3 center = om_load3(s->x, sample->center);
    for (int i = 0; i < s->nvert; ++i) {
        bool is_near = om_distance(om_load3(s->x, i), center) <= radius;
        sample->grasped[i] = is_near && !sample->attached[i];
    }
    double z = om_rng_range(rng, -1, 1), turn = om_rng_range(rng, 0, 2 * OM_PI);
    OmVec3 way = om_vec3(sqrt(1 - z * z) * cos(turn), sqrt(1 - z * z) * sin(turn), z);
    if (om_dot(way, om_load3(normal, sample->center)) < 0) way = om_scale(-1, way);
    double pull = om_rng_range(rng, def->pull[0], def->pull[1]) * sample->material.young;
    sample->force = om_scale(pull * grasped_section(sample, area), way);
done:
    om_free(normal);
    om_free(area);
    return status;
}

// ---- equilibrium ------------------------------------------------------------------------------------

typedef struct
    Board {  // gravity, and one-sided contact of the surface nodes with the plane z = height
    const OmFemSolid* solid;
    const int* node;     // of the surface                                       (nnode)
    const double* area;  // of each, m^2                                         (nnode)
    int nnode;
    double height, stiffness;  // m; Pa/m
} Board;

static OmStatus eval_board(void* ctx, const double* x, double load, double* energy, double* f,
                           OmBsr* A) {
    (void)load;  // gravity and contact do not grow with the pull
    const Board* b = ctx;
    const double* mass = om_fem_mass(b->solid);
    for (int i = 0; i < om_fem_mesh(b->solid)->nnode; ++i) {
        if (energy) *energy += mass[i] * GRAVITY * x[3 * (size_t)i + 2];
        if (f) f[3 * (size_t)i + 2] += mass[i] * GRAVITY;
    }
    for (int i = 0; i < b->nnode; ++i) {
        double depth = b->height - x[3 * (size_t)b->node[i] + 2], k = b->stiffness * b->area[i];
        if (depth <= 0) continue;
        if (energy) *energy += 0.5 * k * depth * depth;
        if (f) f[3 * (size_t)b->node[i] + 2] -= k * depth;
        if (A) om_bsr_add(A, A->row_adr[b->node[i]], om_mat3_diag(om_vec3(0, 0, k)));
    }
    return OM_OK;
}

typedef struct Solve {  // memory of one equilibrium
    OmFemMesh mesh;
    OmFemSolid* solid;
    OmFemStatics* statics;
    double *force, *area;
    unsigned char* fixed;
    Board board;
    OmFemExtra extra;
} Solve;

static void solve_done(Solve* s) {
    om_fem_statics_destroy(s->statics);
    om_fem_destroy(s->solid);
    om_fem_mesh_done(&s->mesh);
    om_free(s->force);
    om_free(s->area);
    om_free(s->fixed);
}

static OmStatus solve_init(const OmBanetSampleDef* def, const OmProgress* watch,
                           const OmBanetSample* sample, Solve* s) {
    OmStatus status = OM_OK;
    size_t n = 3 * (size_t)sample->mesh.nvert;
    OM_TRY_DONE(om_fem_mesh_from_nodes(&sample->mesh, sample->node, &s->mesh));
    memset(s->mesh.elem_material, 0, (size_t)s->mesh.nelem * sizeof *s->mesh.elem_material);
    OmFemDef solid = om_fem_default_def(&s->mesh, 1, &sample->material);
    solid.nworker = 1;  // samples run in parallel, not their solves
    OM_TRY_DONE(om_fem_create(&solid, &s->solid));
    OmFemStaticDef how = om_fem_static_default_def(s->solid);
    how.progress = watch;
    how.tolerance = def->tolerance;
    how.min_step = 1;  // a draw that needs load steps costs more than another one
    how.max_newton = 30;
    const bool is_large = s->mesh.nnode > MOST_DIRECT;
    how.solver.preconditioner = is_large ? OM_MULTIGRID : OM_CHOLESKY;
    if (is_large) how.solver.tolerance = CG_TOLERANCE;
    how.solver.nworker = 1;
    OM_TRY_DONE(om_fem_statics_create(s->solid, &how, &s->statics));
    OM_CALLOC_DONE(s->force, n);
    OM_CALLOC_DONE(s->fixed, n);
    for (int i = 0; i < sample->surface.nvert; ++i)
        if (sample->attached[i]) memset(s->fixed + 3 * (size_t)sample->surface_vert[i], 1, 3);
    if (!sample->has_board) goto done;
    OM_ALLOC_DONE(s->area, sample->surface.nvert);
    vertex_areas(&sample->surface, s->area);
    double lo = INFINITY, hi = -INFINITY;
    for (int i = 0; i < sample->mesh.nvert; ++i) {
        lo = fmin(lo, sample->mesh.x[3 * (size_t)i + 2]);
        hi = fmax(hi, sample->mesh.x[3 * (size_t)i + 2]);
    }
    s->board = (Board){.solid = s->solid,
                       .node = sample->surface_vert,
                       .area = s->area,
                       .nnode = sample->surface.nvert,
                       .height = lo,
                       .stiffness = BOARD_STIFFNESS * sample->material.young / (hi - lo)};
    s->extra = (OmFemExtra){.eval = eval_board, .ctx = &s->board};
done:
    return status;
}

// The body settles on the board; the pull begins there.
static OmStatus settle(Solve* s, OmBanetSample* sample, bool* is_good) {
    OmFemReport report;
    OmFemLoad load = {.fixed = s->fixed, .extra = &s->extra};
    OmStatus status = om_fem_statics_solve(s->statics, &load, sample->x, NULL, &report);
    *is_good = status == OM_OK && report.min_volume > 0;
    sample->board = s->board.height;
    sample->nnewton += report.nnewton;
    memcpy(sample->mesh.x, sample->x, 3 * (size_t)sample->mesh.nvert * sizeof *sample->x);
    for (int i = 0; i < sample->surface.nvert; ++i)
        om_store3(sample->surface.x, i, om_load3(sample->x, sample->surface_vert[i]));
    // the twin of a camera begins with this mesh; elements may be valid where a part of one is not
    if (status == OM_OK && sample->node && om_tet_mesh_validate(&sample->mesh) != OM_OK)
        *is_good = false;
    return status < 0 ? status : OM_OK;
}

OmStatus om__banet_solve(const OmBanetSampleDef* def, const OmProgress* watch,
                         OmBanetSample* sample, bool* is_good) {
    OmStatus status = OM_OK;
    OmFemReport report = {0};
    Solve s = {0};
    size_t n = 3 * (size_t)sample->mesh.nvert;
    *is_good = true;
    OM_ALLOC_DONE(sample->rest, n);
    OM_ALLOC_DONE(sample->x, n);
    memcpy(sample->rest, sample->mesh.x, n * sizeof(double));
    memcpy(sample->x, sample->mesh.x, n * sizeof(double));
    OM_TRY_DONE(solve_init(def, watch, sample, &s));
    if (sample->has_board) OM_TRY_DONE(settle(&s, sample, is_good));
    if (!*is_good) goto done;
    int ngrasped = 0;
    for (int i = 0; i < sample->surface.nvert; ++i) ngrasped += sample->grasped[i];
    OmVec3 each = om_scale(1.0 / ngrasped, sample->force);  // the centre is grasped
    for (int i = 0; i < sample->surface.nvert; ++i)
        if (sample->grasped[i]) om_store3(s.force, sample->surface_vert[i], each);
    OmFemLoad load = {
        .fixed = s.fixed, .force = s.force, .extra = sample->has_board ? &s.extra : NULL};
    OM_TRY_DONE(om_fem_statics_solve(s.statics, &load, sample->x, NULL, &report));
    for (int i = 0; i < sample->mesh.nvert; ++i)
        sample->max_u =
            fmax(sample->max_u, om_distance(om_load3(sample->x, i), om_load3(sample->mesh.x, i)));
    sample->nnewton += report.nnewton;
    sample->min_volume = report.min_volume;
    sample->residual = report.residual;
    *is_good = status == OM_OK && report.min_volume >= def->min_volume &&
               sample->max_u >= def->min_u && sample->max_u <= def->max_u;
done:
    solve_done(&s);
    return status < 0 ? status : OM_OK;
}

// ---- the visible part -------------------------------------------------------------------------------

OmStatus om__banet_see(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample) {
    OmStatus status = OM_OK;
    int *vert = NULL, nvert = 0;
    OmPatchDef patch = draw_patch(rng, om_rng_range(rng, def->visible[0], def->visible[1]));
    OmSurface deformed = sample->surface;
    deformed.x = NULL;
    OM_ALLOC_DONE(deformed.x, 3 * (size_t)deformed.nvert);
    for (int i = 0; i < deformed.nvert; ++i)
        om_store3(deformed.x, i, om_load3(sample->x, sample->surface_vert[i]));
    OM_TRY_DONE(om_surface_random_patch(&deformed, NULL, 0, &patch, &vert, &nvert));
    for (int k = 0; k < nvert; ++k) {
        int i = vert[k];
        OmVec3 u = om_sub(om_load3(deformed.x, i), om_load3(sample->surface.x, i));
        om_store3(sample->u, i, u);
        sample->seen[i] = 1;
    }
    sample->visible = (double)nvert / deformed.nvert;
done:
    om_free(deformed.x);
    om_free(vert);
    return status;
}
