// trial_robust.c: the best plans again, in twins that differ a little from what is believed (ours, not in the thesis).
//
// A fold that barely tips over in the twin tips over otherwise in the world: the monitor (6.4.5) finds the tissue more
// than 6 mm from the twin, and the loop stops for a person. So the path of the tip in a plan is repeated, step by step,
// in twins with fewer attachments, with more, of half the modulus, with friction on the ground, and with a grasp beside
// the planned one. During an operation the twin follows measured tips in the same way. Half the modulus stands for
// tissue that bends more easily than the twin.
//
// Every SPREAD_EVERY steps the surface of the changed twin is compared with that of the believed twin at the same step,
// as the monitor compares camera and twin: the median, over vertices of the surface, of the distance to the other
// surface. The largest of these medians, over all twins, is the point's spread. Where the ROI is hidden at the end of
// the path, the last motion continues as in the loop: the plan ended where the believed twin showed the ROI.
//
// The order is: the ROI exposed at last in more twins, the lower warning state, the path alone enough in more twins.
// Rejected (doc/notes/defras.md): the path alone (17 actions instead of 8); the continued motion alone (18 instead of
// 8); the path alone before the warning state (a run held after 63 actions instead of 8).
#include "trial/trial_robust.h"

#include <string.h>

#include "omentum/scene_vary.h"
#include "omentum/shape_closest.h"

#define SPREAD_EVERY 15
#define PATCH_SEED 650301  // of the shape by which attachments shrink and grow; no scene's own

static const struct {
    double ratio;     // of the attachments
    double young;     // of the modulus
    double friction;  // more than believed
    OmVec3 aside;     // m, of tools, task frame; 1.7 mm is the error of tools in the thesis (6.5.3)
} change[] = {
    {0.5, 1, 0, {0, 0, 0}}, {1.5, 1, 0, {0, 0, 0}},         {1, 0.5, 0, {0, 0, 0}},
    {1, 1, 0.2, {0, 0, 0}}, {1, 1, 0, {0.0012, 0.0012, 0}},
};
enum { NCHANGE = sizeof change / sizeof *change };

typedef struct Again {  // a plan that is repeated
    OmPreplanPoint* point;
    const Trace* trace;
    OmVec3 grasp;     // world frame, m
    double* surface;  // of the believed twin at each instant                (ninstant x nvert x 3)
    int ninstant;     //
    uint64_t held;    // hash of the vertices that the believed twin holds
    double plan_force;  // N, of the believed twin
    bool plan_exposes;  //
    double spread;      // m, of the present twin
    double force;       // N
    bool is_held;       //
    bool is_exposing;   //
    bool is_alike;      // at the end of the path
} Again;

typedef struct Robust {
    const OmScene* scene;
    Again* again;
    int n;
    OmSurface surface;  // of the mesh
    int* vert;          // of the mesh, of each vertex of the surface
    int nvert;          // of the mesh
    OmVec3 aside;       // of the present twin, world frame, m
    bool is_reference;  // the present twin is the believed one
    const Kept* kept;
    int stage;  // of the present twin, in kept
} Robust;

// ---- one plan in one twin -------------------------------------------------------------------------------------

static void copy_surface(const Robust* r, const OmBody* body, double* x) {
    for (int i = 0; i < r->surface.nvert; ++i)
        om_store3(x, i, om_load3(om_body_x(body), r->vert[i]));
}

// Median distance of this body's surface from that of the believed twin.
static void compare(const Robust* r, Again* a, int instant, const OmBody* body, OmSurfaceTree* tree,
                    double* distance) {
    const int n = r->surface.nvert;
    om_surface_tree_move(tree, a->surface + 3 * (size_t)instant * (size_t)n);
    for (int i = 0; i < n; ++i) {
        OmSurfacePoint q;
        om_surface_tree_find(tree, om_load3(om_body_x(body), r->vert[i]), NULL, INFINITY, &q);
        distance[i] = q.distance;
    }
    om_sort_doubles(distance, n);
    a->spread = fmax(a->spread, distance[n / 2]);
}

static OmStatus step(const Robust* r, Again* a, Worker* w, OmVec3 tip) {
    double force = 0;
    OM_TRY(om__attempt_step(&w->attempt, a->point->arm, om_add(tip, r->aside), &force));
    a->force = fmax(a->force, force);
    return OM_OK;
}

static OmStatus repeat(const Robust* r, Again* a, Worker* w, OmSurfaceTree* tree,
                       double* distance) {
    const int last = a->trace->n - 1;
    const size_t size = 3 * (size_t)r->surface.nvert;
    OmBody* body = w->attempt.body;
    OmVisibility v;
    for (int k = 0, instant = 0; k <= last; ++k) {
        OM_TRY(step(r, a, w, a->trace->tip[k]));
        if (k % SPREAD_EVERY && k < last) continue;
        if (r->is_reference)
            copy_surface(r, body, a->surface + (size_t)instant * size);
        else
            compare(r, a, instant, body, tree, distance);
        ++instant;
    }
    OM_TRY(om_view_look(w->attempt.view, om_body_x(body), &v));
    a->is_exposing = a->is_alike = v.nseen >= r->scene->task.visibility * v.npoint;
    if (a->is_exposing || r->is_reference) return OM_OK;
    int nstep = 0;
    return om__attempt_continue(&w->attempt, a->point->fold, a->point->arm, a->trace, r->aside,
                                &a->is_exposing, &nstep);
}

// A grasp beside the planned one that holds the same vertices moves them in the same way.
static bool is_same(const Robust* r, Again* a, uint64_t held) {
    if (r->is_reference || om_norm(r->aside) == 0 || held != a->held) return false;
    a->is_exposing = a->is_alike = a->plan_exposes;
    a->force = a->plan_force;
    return true;
}

// The result of a kept repetition; false: it was not kept.
static bool find_kept(const Robust* r, Again* a) {
    size_t size;
    KeptAgain k;
    const void* data = om__kept_find(r->kept, r->stage, a->point->block, &size);
    if (r->is_reference || !data || size != sizeof k) return false;
    memcpy(&k, data, sizeof k);
    a->spread = k.spread, a->force = k.force;
    a->is_held = k.is_held, a->is_exposing = k.is_exposing, a->is_alike = k.is_alike;
    return true;
}

static OmStatus keep(const Robust* r, const Again* a) {
    const KeptAgain k = {a->spread, a->force, a->is_held, a->is_exposing, a->is_alike, 0};
    return r->is_reference ? OM_OK : om__kept_add(r->kept, r->stage, a->point->block, &k, sizeof k);
}

static OmStatus repeat_in(const Robust* r, Again* a, Worker* w) {
    OmSurfaceTree* tree = NULL;
    double* distance = NULL;
    int nheld;
    OmBody* body = w->attempt.body;
    if (r->is_reference)
        a->grasp = om_load3(om_body_x(body), w->attempt.grid->vert[a->point->block]);
    const OmPose pose = {om_add(a->grasp, r->aside), w->attempt.grid->task.q};
    a->is_held = a->is_exposing = a->is_alike = false;
    a->spread = a->force = 0;
    OmStatus status = om_body_grasp(body, a->point->arm, pose, r->scene->task.grasp_radius, &nheld);
    if (status == OM_INVALID) return OM_OK;  // all tissue in reach is attached
    OM_TRY(status);
    a->is_held = true;
    const uint64_t held = om_hash(om_body_held_by(body), (size_t)r->nvert, OM_HASH_SEED);
    if (is_same(r, a, held)) return OM_OK;
    OM_ALLOC_DONE(distance, (size_t)r->surface.nvert);
    OM_TRY_DONE(om_surface_tree_create(&r->surface, &tree));
    status = repeat(r, a, w, tree, distance);
    if (r->is_reference) {
        a->held = held;
        a->plan_force = a->force;
        a->plan_exposes = a->is_exposing;
    }
done:
    om_surface_tree_destroy(tree);
    om_free(distance);
    return status;
}

static OmStatus repeat_one(void* ctx, Worker* w, int i) {
    const Robust* r = ctx;
    if (find_kept(r, &r->again[i])) return OM_OK;
    OM_TRY(repeat_in(r, &r->again[i], w));
    return keep(r, &r->again[i]);
}

// ---- twins ---------------------------------------------------------------------------------------------------

// The twin of a change. OM_UNSAT: it is the believed one, since nothing is attached, or too little to shrink.
static OmStatus make_twin(const OmPreplanDef* def, int k, OmScene* scene, Crew* crew) {
    OmSite site;
    *scene = *def->scene;
    scene->tissue.friction = fmax(0, scene->tissue.friction) + change[k].friction;
    OM_TRY(om_site_build(scene, OM_SITE_TWIN, NULL, &site));
    site.young *= change[k].young;
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    const int nheld = held ? held->nvert : 0;
    OmStatus status = om_site_scale_attachments(scene, change[k].ratio, PATCH_SEED, &site);
    held = om_tet_mesh_find_set(&site.mesh, "attachment");
    if (status == OM_INVALID || (change[k].ratio != 1 && (held ? held->nvert : 0) == nheld))
        status = OM_UNSAT;
    if (status == OM_OK) status = om__crew_create(crew, scene, &site, def->nworker);
    om_site_done(&site);
    return status;
}

static void add_result(const Robust* r) {
    for (int i = 0; i < r->n; ++i) {
        const Again* a = &r->again[i];
        OmPreplanPoint* p = a->point;
        ++p->ntwin;
        const bool is_stopped = a->spread > r->scene->monitor.limit[2];  // for a person
        p->ntwin_exposed += a->is_held && a->is_exposing && !is_stopped;
        p->ntwin_alike += a->is_held && a->is_alike && !is_stopped;
        p->spread = fmax(p->spread, a->spread);
        if (p->force >= 0) p->force_most = fmax(p->force_most, a->force);
        for (int k = 0; k < 3; ++k)
            if (p->spread > r->scene->monitor.limit[k]) p->warning = k + 1;
    }
}

static OmStatus run_change(const OmPreplanDef* def, int k, Robust* r, Crew* believed,
                           const OmProgress* progress) {
    static const char stage[] = "trying the best again in changed twins";
    Crew crew = {.scene = NULL};
    OmScene* scene = NULL;
    r->aside = om_quat_rotate(believed->grid.task.q, change[k].aside);
    r->stage = KEPT_CHANGES + k;
    OmStatus status = OM_OK;
    int nkept = 0;
    for (int i = 0; i < r->n; ++i) nkept += find_kept(r, &r->again[i]);
    if (nkept == r->n) {
        add_result(r);
        return OM_OK;
    }
    if (om_norm(r->aside) > 0) {
        status = om__crew_run(believed, r->n, repeat_one, r, progress, stage);
    } else {
        OM_ALLOC_DONE(scene, 1);
        OM_TRY_DONE(make_twin(def, k, scene, &crew));
        if (status == OM_OK) status = om__crew_run(&crew, r->n, repeat_one, r, progress, stage);
    }
    if (status == OM_OK) add_result(r);
done:
    om__crew_done(&crew);
    om_free(scene);
    return status;
}

// ---- public ----------------------------------------------------------------------------------------------------

// The exposing points of lowest force, at most `most`.
static void list_best(OmPreplan* plan, const Trace* trace, int most, Robust* r) {
    for (int b = 0; b < plan->n * plan->n; ++b) {
        OmPreplanPoint* p = &plan->point[b];
        int at = r->n;
        if (!p->exposes || trace[b].n == 0) continue;
        while (at > 0 && om__preplan_is_gentler(p, r->again[at - 1].point)) --at;
        if (at >= most) continue;
        if (r->n < most) ++r->n;
        for (int k = r->n - 1; k > at; --k) r->again[k] = r->again[k - 1];
        r->again[at] = (Again){.point = p, .trace = &trace[b]};
    }
}

OmStatus om__robust_run(const OmPreplanDef* def, Crew* crew, const Trace trace[OM_PLAN_MAX_BLOCK],
                        const Kept* kept, OmPreplan* plan, const OmProgress* progress) {
    Robust r = {.scene = def->scene, .is_reference = true, .kept = kept};
    if (def->nagain == 0) return OM_OK;
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(r.again, (size_t)def->nagain);
    list_best(plan, trace, def->nagain, &r);
    if (r.n == 0) goto done;
    r.nvert = crew->site.mesh.nvert;
    OM_TRY_DONE(om_tet_mesh_boundary(&crew->site.mesh, &r.surface, &r.vert));
    for (int i = 0; i < r.n; ++i) {
        Again* a = &r.again[i];
        a->ninstant = (a->trace->n - 1) / SPREAD_EVERY + 2;
        OM_ALLOC_DONE(a->surface, 3 * (size_t)a->ninstant * (size_t)r.surface.nvert);
    }
    OM_TRY_DONE(om__crew_run(crew, r.n, repeat_one, &r, progress, "repeating the best plans"));
    r.is_reference = false;
    for (int k = 0; k < NCHANGE; ++k) {
        OM_TRY_DONE(run_change(def, k, &r, crew, progress));
    }
    status = OM_OK;  // a change that cannot be made is left out
done:
    for (int i = 0; r.again && i < r.n; ++i) om_free(r.again[i].surface);
    om_free(r.again);
    om_free(r.vert);
    om_surface_done(&r.surface);
    return status;
}
