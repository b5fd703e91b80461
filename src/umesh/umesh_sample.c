// umesh_sample.c: one sample of the data: a patch, a load on it, and equilibrium (thesis, Algorithm 2).
//
// The points P of the algorithm are nodes of the grid: nodes of the free boundary whose nearest point on the organ's
// surface is under the probe. The alternative is points of the surface inside elements, with forces distributed by
// shape functions; the input would then include nodes that are not under the probe. With nodes as points, a prediction
// prescribes the same nodes as the sample, and all other nodes are free in both: the displacement field is a function
// of the input.
//
// Draw number k of sample i is a function of (seed, i, k) alone. A draw is rejected if too few nodes are under the
// patch, if Newton's method finds no equilibrium, or if an element of the equilibrium is nearly flat.
//
// Tried and rejected: St Venant-Kirchhoff, the law of the thesis, is stable in compression only up to a stretch of
// 0.58; under a press of 10 mm, a layer of elements under the probe inverts. The setting remains available.
#include <string.h>

#include "umesh/umesh_internal.h"

#define COOKIE 0x50f7f502u
#define VERSION 2          // of the samples of a (seed, index); increase it when samples change
#define CG_TOLERANCE 1e-2  // of the linear systems; Newton's method corrects the remaining error
#define PRESS_SHARE 0.6    // largest press, relative to the distance to the nearest fixed node
#define DRAW_SHIFT 40      // bits of the index in the number of a random stream; the draw is above

OmUmeshDataDef om_umesh_data_default_def(const OmUmeshOrgan* organ, const char* out_dir) {
    bool is_known = organ && organ->young > 0;
    OmMaterial material = {.law = OM_NEO_HOOKEAN,
                           .young = is_known ? organ->young : 1800,
                           .poisson = is_known ? organ->poisson : 0.45};
    return (OmUmeshDataDef){
        .organ = organ,
        .out_dir = out_dir,
        .nsample = 1000,
        .seed = 1,
        .material = material,
        .max_force = 0.8,
        .max_tilt = OM_PI / 4,
        .press_share = 0.5,
        .max_press = 0.035,
        .patch_size = {0.050, 0.010, 0.010},
        .min_patch = 4,
        .tolerance = 1e-5,
        .min_volume = 0.05,
        .max_attempt = 64,
        .shard = 100,
        .npicture = 4,
        .cookie = COOKIE,
    };
}

OmStatus om__umesh_check_def(const OmUmeshDataDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmUmeshDataDef was not made by om_umesh_data_default_def");
    OM_CHECK(d->organ, OM_INVALID, "OmUmeshDataDef.organ is null");
    OM_CHECK(d->nsample >= 1 && d->nsample <= 10000000, OM_INVALID,
             "OmUmeshDataDef.nsample = %d, must be in 1 .. 10000000", d->nsample);
    OM_CHECK(d->shard >= 1 && d->shard <= 10000, OM_INVALID,
             "OmUmeshDataDef.shard = %d, must be in 1 .. 10000", d->shard);
    OM_TRY(om_material_validate(&d->material, "OmUmeshDataDef.material"));
    const struct {
        const char* name;
        double value, min, max;
    } field[] = {
        {"max_force", d->max_force, 0, 1e6},
        {"max_tilt", d->max_tilt, 0, OM_PI / 2},
        {"press_share", d->press_share, 0, 1},
        {"max_press", d->max_press, 0, 1},
        {"pull_share", d->pull_share, 0, 1},
        {"patch_size[0]", d->patch_size[0], 1e-6, 10},
        {"patch_size[1]", d->patch_size[1], 1e-6, 10},
        {"patch_size[2]", d->patch_size[2], 1e-6, 10},
        {"min_patch", d->min_patch, 1, 1e6},
        {"tolerance", d->tolerance, 1e-12, 0.01},
        {"min_volume", d->min_volume, 0, 0.99},
        {"max_attempt", d->max_attempt, 1, 1 << 20},
        {"npicture", d->npicture, 0, 100},
        {"nworker", d->nworker, 0, OM_MAX_WORKER},
    };
    for (size_t k = 0; k < sizeof field / sizeof *field; ++k)
        OM_CHECK(field[k].value >= field[k].min && field[k].value <= field[k].max, OM_INVALID,
                 "OmUmeshDataDef.%s = %g, must be in %g .. %g", field[k].name, field[k].value,
                 field[k].min, field[k].max);
    return OM_OK;
}

uint64_t om__umesh_hash_def(const OmUmeshDataDef* d) {
    const OmMaterial* m = &d->material;
    double value[32] = {VERSION,          (double)m->law,   (double)m->volumetric,
                        m->young,         m->poisson,       m->bulk,
                        m->c10,           m->c01,           m->nterm,
                        d->max_force,     d->max_tilt,      d->press_share,
                        d->max_press,     d->pull_share,    d->patch_size[0],
                        d->patch_size[1], d->patch_size[2], d->min_patch,
                        d->tolerance,     d->min_volume,    d->max_attempt};
    uint64_t h = om_hash(value, sizeof value, om_umesh_organ_grid(d->organ)->hash);
    h = om_hash(m->ogden_mu, sizeof m->ogden_mu, h);
    h = om_hash(m->ogden_alpha, sizeof m->ogden_alpha, h);
    return om_hash(&d->seed, sizeof d->seed, h);
}

// Load steps by the kind of load: with a force Newton's method mostly converges in one load step; displacements that
// are applied in one step crush the elements around the patch. A sample that does not converge is rejected early.
static const struct {
    int nstep, max_newton;
    double min_step;
} step_table[2] = {{1, 20, 1.0 / 4}, {4, 8, 1.0 / 16}};

// ---- the solver -------------------------------------------------------------------------------------

struct OmUmeshSolver {
    OmUmeshDataDef def;
    OmFemSolid* solid;
    OmFemStatics* statics[2];             // under a force, with displacements
    double *x, *force, *goal, *reaction;  //                                (nnode x 3 each)
    unsigned char *fixed, *mask;          //                           (nnode x 3), (nnode)
};

OmStatus om_umesh_solver_create(const OmUmeshDataDef* def, OmUmeshSolver** out) {
    *out = NULL;
    OM_TRY(om__umesh_check_def(def));
    const OmFemMesh* mesh = &om_umesh_organ_grid(def->organ)->fem.mesh;
    size_t n = 3 * (size_t)mesh->nnode;
    OmStatus status = OM_OK;
    OmUmeshSolver* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    s->def = *def;
    OmFemDef solid = om_fem_default_def(mesh, 1, &def->material);
    solid.nworker = 1;  // samples run in parallel, not their solves
    OM_TRY_DONE(om_fem_create(&solid, &s->solid));
    OmFemStaticDef how = om_fem_static_default_def(s->solid);
    how.tolerance = def->tolerance;
    // five times as fast as a factorisation, at 2,800 nodes
    how.solver.preconditioner = OM_MULTIGRID;
    how.solver.tolerance = CG_TOLERANCE;
    how.solver.nworker = 1;
    for (int k = 0; k < 2; ++k) {
        how.nstep = step_table[k].nstep;
        how.max_newton = step_table[k].max_newton;
        how.min_step = step_table[k].min_step;
        OM_TRY_DONE(om_fem_statics_create(s->solid, &how, &s->statics[k]));
    }
    double** array[] = {&s->x, &s->force, &s->goal, &s->reaction};
    for (int k = 0; k < 4; ++k) OM_CALLOC_DONE(*array[k], n);
    OM_CALLOC_DONE(s->fixed, n);
    OM_CALLOC_DONE(s->mask, mesh->nnode);
done:
    if (status < 0)
        om_umesh_solver_destroy(s);
    else
        *out = s;
    return status < 0 ? status : OM_OK;
}

void om_umesh_solver_destroy(OmUmeshSolver* s) {
    if (!s) return;
    om_fem_statics_destroy(s->statics[0]);
    om_fem_statics_destroy(s->statics[1]);
    om_fem_destroy(s->solid);
    om_free(s->x);
    om_free(s->force);
    om_free(s->goal);
    om_free(s->reaction);
    om_free(s->fixed);
    om_free(s->mask);
    om_free(s);
}

// Equilibrium from rest under s->force, or with the masked nodes moved by s->goal; into s->x.
static OmStatus find_equilibrium(OmUmeshSolver* s, const unsigned char* moved,
                                 OmFemReport* report) {
    const OmUmeshGrid* g = om_umesh_organ_grid(s->def.organ);
    for (size_t i = 0; i < (size_t)g->fem.mesh.nnode; ++i)
        memset(s->fixed + 3 * i, g->fem.fixed[i] || (moved && moved[i]), 3);
    memcpy(s->x, g->fem.mesh.x, 3 * (size_t)g->fem.mesh.nnode * sizeof *s->x);
    OmFemLoad load = {.fixed = s->fixed, .force = s->force, .goal = s->goal};
    return om_fem_statics_solve(s->statics[moved ? 1 : 0], &load, s->x, s->reaction, report);
}

OmStatus om_umesh_solve(OmUmeshSolver* s, const unsigned char* mask, double* u,
                        OmFemReport* report) {
    const OmUmeshGrid* g = om_umesh_organ_grid(s->def.organ);
    OmFemReport own;
    size_t n = 3 * (size_t)g->fem.mesh.nnode;
    memset(s->force, 0, n * sizeof *s->force);
    for (size_t i = 0; i < n; ++i) {
        s->goal[i] = mask[i / 3] && !g->fem.fixed[i / 3] ? u[i] : 0;
        OM_CHECK(isfinite(s->goal[i]), OM_INVALID,
                 "om_umesh_solve: the displacement of node %d is not finite", (int)(i / 3));
    }
    OmStatus status = find_equilibrium(s, mask, report ? report : &own);
    for (size_t i = 0; i < n && status == OM_OK; ++i) u[i] = s->x[i] - g->fem.mesh.x[i];
    return status;
}

// ---- draws ------------------------------------------------------------------------------------------

// The force is divided among the nodes of the patch, or all of them move by the probe's displacement.
static void apply_load(OmUmeshSolver* s, const OmUmeshSample* sample) {
    const OmUmeshGrid* g = om_umesh_organ_grid(s->def.organ);
    OmVec3 none = {0, 0, 0}, share = om_scale(1.0 / sample->npatch, sample->force);
    OmVec3 way = om_scale(sample->press, sample->direction);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        om_store3(s->force, i, s->mask[i] && sample->press == 0 ? share : none);
        om_store3(s->goal, i, s->mask[i] ? way : none);
    }
}

// Largest displacement of the probe: near fixed nodes, a larger one would crush tissue.
static double longest_way(const OmUmeshDataDef* d, OmVec3 p) {
    const OmUmeshGrid* g = om_umesh_organ_grid(d->organ);
    double nearest = INFINITY;
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        if (g->fem.fixed[i]) nearest = fmin(nearest, om_distance(p, om_load3(g->fem.mesh.x, i)));
    return fmin(d->max_press, PRESS_SHARE * nearest);
}

// All random numbers of a draw, in this order.
static void draw(OmUmeshSolver* s, int64_t index, int attempt, OmUmeshSample* out) {
    const OmUmeshDataDef* d = &s->def;
    uint64_t stream = (uint64_t)index + ((uint64_t)attempt << DRAW_SHIFT);
    OmRng rng = om_rng_init(d->seed, stream);
    OmUmeshPatch* p = &out->patch;
    memcpy(p->size, d->patch_size, sizeof p->size);
    om__umesh_pick_point(d->organ, &rng, &p->center, &p->normal);
    OmVec3 wish = fabs(p->normal.x) < 0.9 ? om_vec3(1, 0, 0) : om_vec3(0, 1, 0);
    OmVec3 a = om_normalize(om_cross(p->normal, wish)), b = om_cross(p->normal, a);
    double turn = om_rng_range(&rng, 0, 2 * OM_PI), about = om_rng_range(&rng, 0, 2 * OM_PI);
    p->along = om_add(om_scale(cos(turn), a), om_scale(sin(turn), b));
    out->tilt = om_rng_range(&rng, -d->max_tilt, d->max_tilt);
    bool is_press = om_rng_uniform(&rng) < d->press_share;
    bool is_pull = om_rng_uniform(&rng) < d->pull_share;
    double size = om_rng_uniform(&rng);
    // the normal rotated about the tangent that is perpendicular to `to`
    OmVec3 to = om_add(om_scale(cos(about), a), om_scale(sin(about), b));
    OmVec3 tilted = om_add(om_scale(cos(out->tilt), p->normal), om_scale(sin(out->tilt), to));
    out->direction = om_scale(is_pull ? 1 : -1, tilted);
    out->press = is_press ? size * longest_way(d, p->center) : 0;
    out->force = om_scale(is_press ? 0 : size * d->max_force, out->direction);
}

static void measure(OmUmeshSolver* s, const OmFemReport* report, OmUmeshSample* out, double* u) {
    const OmUmeshGrid* g = om_umesh_organ_grid(s->def.organ);
    OmVec3 sum = {0, 0, 0};
    out->nnewton = report->nnewton;
    out->residual = report->residual;
    out->min_volume = report->min_volume;
    out->max_u = 0;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 way = om_sub(om_load3(s->x, i), om_load3(g->fem.mesh.x, i));
        om_store3(u, i, way);
        out->max_u = fmax(out->max_u, om_norm(way));
        if (s->mask[i]) sum = om_add(sum, om_load3(s->reaction, i));
    }
    if (out->press > 0) out->force = sum;
}

OmStatus om_umesh_sample_make(OmUmeshSolver* s, int64_t index, OmUmeshSample* out,
                              unsigned char* mask, double* u) {
    const OmUmeshGrid* g = om_umesh_organ_grid(s->def.organ);
    OM_CHECK(index >= 0 && index < (int64_t)1 << DRAW_SHIFT, OM_INVALID,
             "om_umesh_sample_make: index %lld is out of range", (long long)index);
    double begin = om_clock_now();
    int nfail = 0;
    for (int attempt = 0; attempt < s->def.max_attempt; ++attempt) {
        OmFemReport report;
        *out = (OmUmeshSample){.nattempt = attempt + 1, .nfail = nfail};
        draw(s, index, attempt, out);
        out->npatch = om_umesh_patch_select(g, &out->patch, s->mask);
        if (out->npatch < s->def.min_patch) continue;
        apply_load(s, out);
        OmStatus status = find_equilibrium(s, out->press > 0 ? s->mask : NULL, &report);
        if (status < 0) return status;
        if (status == OM_OK && report.min_volume >= s->def.min_volume) {
            measure(s, &report, out, u);
            memcpy(mask, s->mask, (size_t)g->fem.mesh.nnode);
            out->seconds = om_clock_now() - begin;
            return OM_OK;
        }
        ++nfail;
    }
    OM_CHECK(
        nfail > 0, OM_NOT_CONVERGED,
        "umesh: none of %d patches drawn for sample %lld has %d nodes under it; make the patch "
        "larger or min_patch smaller",
        s->def.max_attempt, (long long)index, s->def.min_patch);
    return om_error(OM_NOT_CONVERGED,
                    "umesh: none of %d draws of sample %lld has an equilibrium; make max_force or "
                    "max_press smaller",
                    s->def.max_attempt, (long long)index);
}
