// scene_model_fit.c: a mesh that holds all of the solid, or a report that says what it lost.
//
// A mesh is judged by what it should represent, not by the field it was cut from: the voxels of the cleaned label (of
// a surface or a volume mesh: the nodes of its distance field). Where a place of the solid is missing or one is
// added, or where parts, handles or cavities differ, the next trial has finer edges at the voxels that are wrong, and
// only there. At last the level is moved by at most SHIFT to the volume of the label: vertices lie on the level, so
// flat faces cut off a part of what is round. A place that was lost is not made up for so.
//
// Rejected: a level shifted until the volume is right, which blew up the rest by what a place had lost; finer edges
// everywhere (seven times the elements for one voxel of a stomach's outline).
#include <stdlib.h>
#include <string.h>

#include "omentum/shape_closest.h"
#include "scene/scene_model_internal.h"

#define POLL 256  // points between two polls for a request to stop
#define MAX_TRIAL 12
#define LEAST 8            // nodes: a cube of one edge
#define MAX_HALVING 2      // of the step of a surface's field
#define SHIFT 0.1          // voxels
#define FINER 0.63         // of the edge at wrong voxels, from trial to trial
#define LEFT_OUT 8         // voxels: larger pieces of a sheet that are left out are noted
#define FINEST 0.15        // voxels: the smallest edge
#define TOLERANCE 0.33     // edges: depth from which a wrong voxel counts
#define VOLUME_GOAL 0.001  // relative error at which shifts end
#define MOSTLY 0.2         // of the volume: a larger loss needs finer edges everywhere
#define FREE_TET 60000     // a finer mesh may have this many elements,
#define MAX_GROWTH 3       // or this many times those of the first

typedef struct Trial {  // of one part of the solid
    const OmModelDef* def;
    bool has_field;  // it is meshed from a field of the mask, which can be made without averages
    OmMask mask;     // its voxels, or the nodes of its distance field
    OmSurface solid;
    double voxel;   // m
    double volume;  // of the voxels, m^3
    double* level;  // of a sheet: where its function reads the level
    OmStuffDef stuff;
    OmMaskField* field;
    double *fine, *fine_edge;  // for stuff
} Trial;

static void trial_done(Trial* t) {
    om_mask_done(&t->mask);
    om_surface_done(&t->solid);
    om_mask_field_destroy(t->field);
    om_free(t->fine);
    om_free(t->fine_edge);
}

// The nodes of a distance field as voxels. Nodes on the surface become outside, and so do parts of fewer than
// `smallest` nodes: they come from a surface that crosses itself, or whose corner is a node; 0: all but the largest.
static OmStatus take_nodes(OmSdf* sdf, int smallest, OmMask* mask) {
    const int* dim = sdf->grid.dim;
    OM_TRY(om_mask_init(mask, dim[0], dim[1], dim[2]));
    const double h = sdf->grid.spacing;
    mask->grid.axis = om_mat3_diag(om_vec3(h, h, h));
    mask->grid.origin = sdf->grid.origin;
    const size_t n = om_grid_count(dim);
    const float least = (float)(1e-3 * h);
    for (size_t i = 0; i < n; i++) {
        if (fabsf(sdf->d[i]) < least) sdf->d[i] = least;
        mask->inside[i] = sdf->d[i] < 0;
    }
    const int64_t num = om_mask_count(mask);
    if (num > 0) OM_TRY(om_mask_keep_parts(mask, 6, (double)smallest / (double)num, NULL, NULL));
    for (size_t i = 0; i < n; i++)
        if (sdf->d[i] < 0 && !mask->inside[i]) sdf->d[i] = least;
    return OM_OK;
}

// The field that is meshed: details below half of an edge may be averaged at first.
static OmStatus take_field(Trial* t, double spacing) {
    const OmModelDef* def = t->def;
    om_mask_field_destroy(t->field);
    t->field = NULL;
    OM_TRY(om_mask_field_create(&t->mask, spacing, def->smooth, OM__FIELD_ROUNDS, &t->field));
    t->stuff.fn = om_mask_field_eval;
    t->stuff.ctx = t->field;
    return om_mask_field_bounds(t->field, &t->stuff.lo, &t->stuff.hi);
}

// The part of this rank of a label, 0: all of it; or the solid of the distance field.
static OmStatus trial_init(const OmModelDef* def, OmBody* body, int rank, Trial* t) {
    t->def = def;
    t->stuff = om_stuff_default_def(def->edge, om_sdf_shape_fn, &body->sdf, om_vec3(0, 0, 0),
                                    om_vec3(1, 1, 1));
    t->stuff.nworker = def->nworker;
    t->has_field = body->has_volume;
    if (!t->has_field) {
        t->voxel = body->sdf.grid.spacing;
        t->volume = body->volume_ref;
        om_sdf_bounds(&body->sdf, &t->stuff.lo, &t->stuff.hi);
        OM_TRY(take_nodes(&body->sdf, LEAST, &t->mask));
        return om_surface_from_sdf(&body->sdf, 0, &t->solid);
    }
    const OmMask* m = &body->mask;
    OM_TRY(om_mask_init(&t->mask, m->grid.dim[0], m->grid.dim[1], m->grid.dim[2]));
    t->mask.grid = m->grid;
    memcpy(t->mask.inside, m->inside, om_grid_count(m->grid.dim));
    if (rank > 0) {
        OM_TRY(om_mask_choose_parts(&t->mask, 6, &rank, 1));
        OM_TRY(om_mask_crop(&t->mask, 1));
    }
    t->voxel = body->voxel;
    t->volume = om_mask_volume(&t->mask);
    return om_surface_from_mask(&t->mask, &t->solid);
}

// Ask for finer edges in these voxels: at their centres and at the middles of their sides. Where the topology differs
// though each voxel is right, all earlier places become finer.
static OmStatus add_fine(Trial* t, const OmShapeWrong* wrong, double edge, bool is_everywhere) {
    enum { POINTS = 7 };  // of a voxel
    const size_t old = (size_t)t->stuff.nfine, n = old + POINTS * (size_t)wrong->n;
    const OmMat3* axis = &t->mask.grid.axis;
    const OmVec3 step[3] = {om_scale(0.5, axis->cx), om_scale(0.5, axis->cy),
                            om_scale(0.5, axis->cz)};
    OM_CHECK(n < INT32_MAX / 8, OM_INVALID, "too many voxels are wrong");
    double* fine = om_realloc(t->fine, old, n, 3 * sizeof(double));
    if (!fine) return OM_NO_MEMORY;
    t->fine = fine;
    double* fine_edge = om_realloc(t->fine_edge, old, n, sizeof(double));
    if (!fine_edge) return OM_NO_MEMORY;
    t->fine_edge = fine_edge;
    for (int i = 0, at = (int)old; i < wrong->n; i++) {
        const OmVec3 x = om_load3(wrong->x, i);
        om_store3(fine, at++, x);
        for (int s = 0; s < 6; s++) om_store3(fine, at++, om_madd(x, s % 2 ? 1 : -1, step[s / 2]));
    }
    for (size_t i = is_everywhere ? 0 : old; i < n; i++) fine_edge[i] = edge;
    t->stuff.nfine = (int)n;
    t->stuff.fine = fine;
    t->stuff.fine_edge = fine_edge;
    return OM_OK;
}

static bool is_faithful(const OmShapeFit* fit) {
    return fit->nloss == 0 && om_topology_is_equal(&fit->solid, &fit->mesh);
}

// Later trials may have FREE_TET elements, or MAX_GROWTH times those of the first, or of the volume at this edge.
static void limit_elements(Trial* t, int first) {
    const double e = t->def->edge, expected = OM__TET_DENSITY * t->volume / (e * e * e);
    const double most = MAX_GROWTH * fmax(first, expected);
    t->stuff.max_tet = (int)fmin(fmax(most, FREE_TET), t->stuff.max_tet);
}

// Where a mesh fails: it has too many elements, not none.
static bool is_too_fine(const Trial* t) {
    const double e = t->stuff.edge, expected = OM__TET_DENSITY * t->volume / (e * e * e);
    return t->stuff.nfine > 0 || 2 * expected > t->stuff.max_tet;
}

static int topology_difference(const OmShapeFit* fit) {
    const OmTopology *a = &fit->solid, *b = &fit->mesh;
    return abs(a->npart - b->npart) + abs(a->nhandle - b->nhandle) + abs(a->ncavity - b->ncavity);
}

// How much is wrong, as a share of the volume. A handle too many counts as a thousandth.
static double badness(const OmShapeFit* fit, double volume) {
    return (fit->lost + fit->added) / volume + 0.001 * topology_difference(fit);
}

// A mesh and its fit. OM_INVALID: nothing is inside, or it has too many elements.
static OmStatus try_mesh(const Trial* t, OmTetMesh* mesh, OmShapeFit* fit, OmShapeWrong* wrong) {
    if (t->level) *t->level = t->stuff.level;
    OM_TRY(om_tet_mesh_stuff(&t->stuff, mesh));
    OmStatus status = t->level ? om_tet_mesh_keep_parts(mesh, 0, NULL, NULL) : OM_OK;
    if (status == OM_OK)
        status = om_shape_fit_measure(&t->mask, &t->solid, mesh, TOLERANCE * t->def->edge,
                                      t->def->nworker, fit, wrong);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}

typedef struct Best {  // of the trials
    OmTetMesh mesh;
    OmShapeFit fit;
    double edge, level;  // m, of its lattice
} Best;

static void keep_better(const Trial* t, OmTetMesh* trial, const OmShapeFit* fit, Best* best) {
    if (best->mesh.ntet == 0 || badness(fit, t->volume) < badness(&best->fit, t->volume)) {
        om_tet_mesh_done(&best->mesh);
        *best = (Best){*trial, *fit, t->stuff.edge, t->stuff.level};
    } else {
        om_tet_mesh_done(trial);
    }
    memset(trial, 0, sizeof *trial);
}

// Move the level to the volume of the label, by a part of a voxel, and half as far where something is lost so.
static OmStatus shift_level(Trial* t, Best* best) {
    const double most = SHIFT * t->voxel;
    if (best->edge != t->stuff.edge) return OM_OK;  // a later trial was worse
    double share = 1;
    for (int k = 0; k < 3; k++) {
        const double volume = om_tet_mesh_volume(&best->mesh);
        OmTetMesh trial = {0};
        OmShapeWrong wrong = {0};
        OmShapeFit fit;
        double area;
        OM_TRY(om__boundary_area(&best->mesh, &area));
        const double step = share * (t->volume - volume) / area;  // area > 0
        t->stuff.level = fmax(-most, fmin(most, best->level + step));
        if (fabs(volume - t->volume) < VOLUME_GOAL * t->volume || t->stuff.level == best->level)
            return OM_OK;
        const OmStatus status = try_mesh(t, &trial, &fit, &wrong);
        om_shape_wrong_done(&wrong);
        if (status < 0 && status != OM_INVALID) return status;
        if (status == OM_OK && is_faithful(&fit)) {
            om_tet_mesh_done(&best->mesh);
            *best = (Best){trial, fit, t->stuff.edge, t->stuff.level};
        } else {
            om_tet_mesh_done(&trial);
            share *= 0.5;
        }
    }
    return OM_OK;
}

static OmStatus mesh_part(Trial* t, const OmProgress* progress, Best* best) {
    OmStatus status = OM_OK;
    OmTetMesh trial = {0};
    OmShapeWrong wrong = {0};
    const bool refine = t->def->refine;
    bool is_exact = !t->has_field;  // no detail is averaged
    double edge = t->def->edge, last = HUGE_VAL;
    if (t->has_field) OM_TRY_DONE(take_field(t, 0.5 * edge));
    for (int k = 0; k < MAX_TRIAL; k++) {
        OmShapeFit fit = {0};
        om_shape_wrong_done(&wrong);
        OM_TRY_DONE(om_progress_report(progress, "meshing", k, MAX_TRIAL));
        status = try_mesh(t, &trial, &fit, &wrong);
        if (status < 0 && status != OM_INVALID) goto done;
        const bool is_empty = status == OM_INVALID;
        if (is_empty && (!refine || is_too_fine(t))) break;
        if (!is_empty) {
            if (best->mesh.ntet == 0) limit_elements(t, trial.ntet);
            keep_better(t, &trial, &fit, best);
            if (is_faithful(&fit) || !refine) break;
        }
        if (!is_exact) {  // first with all details of the label
            OM_TRY_DONE(take_field(t, 0));
            is_exact = true;
            continue;
        }
        edge *= FINER;
        if (edge < FINEST * t->voxel) break;
        // finer everywhere: most is lost, or the topology differs and finer places did not help
        const double bad = badness(&fit, t->volume);
        const bool is_most = is_empty || fit.lost + fit.added > MOSTLY * t->volume;
        const bool is_stuck = fit.nloss == 0 && (t->stuff.nfine > 0 ? !(bad < last) : wrong.n == 0);
        if ((is_most && t->stuff.nfine == 0) || is_stuck)
            t->stuff.edge *= FINER;
        else
            OM_TRY_DONE(add_fine(t, &wrong, edge, fit.nloss == 0));
        last = fit.nloss > 0 ? HUGE_VAL : bad;
    }
    if (status == OM_INVALID && best->mesh.ntet > 0) status = OM_OK;
    if (status == OM_OK && is_faithful(&best->fit)) OM_TRY_DONE(shift_level(t, best));
done:
    om_tet_mesh_done(&trial);
    om_shape_wrong_done(&wrong);
    return status;
}

// ---- the parts of a solid --------------------------------------------------------------------------------

static OmStatus append_mesh(OmTetMesh* all, const OmTetMesh* part) {
    OmTetMesh sum;
    OM_TRY(om_tet_mesh_init(&sum, all->nvert + part->nvert, all->ntet + part->ntet));
    const size_t nvert = (size_t)all->nvert, ntet = (size_t)all->ntet;
    if (nvert > 0) memcpy(sum.x, all->x, 3 * nvert * sizeof(double));
    if (ntet > 0) memcpy(sum.tet_vert, all->tet_vert, 4 * ntet * sizeof(int));
    memcpy(sum.x + 3 * nvert, part->x, 3 * (size_t)part->nvert * sizeof(double));
    for (int i = 0; i < 4 * part->ntet; i++)
        sum.tet_vert[4 * ntet + (size_t)i] = part->tet_vert[i] + all->nvert;
    om_tet_mesh_done(all);
    *all = sum;
    return OM_OK;
}

// ---- for pictures ----------------------------------------------------------------------------------------

// Distances of the mesh's boundary from the solid's surface, and the part of this surface that is far from the mesh.
static OmStatus find_gaps(const OmSurface* solid, double far, OmPatient* patient) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    OmSurfaceTree *of_solid = NULL, *of_mesh = NULL;
    int *vert = NULL, nmissed = 0;
    OM_TRY_DONE(om_tet_mesh_boundary(&patient->mesh, &boundary, &vert));
    OM_TRY_DONE(om_stop_poll());
    OM_TRY_DONE(om_surface_tree_create(solid, &of_solid));
    OM_TRY_DONE(om_surface_tree_create(&boundary, &of_mesh));
    OM_CALLOC_DONE(patient->gap, (size_t)patient->mesh.nvert);
    OmSurfacePoint q;
    for (int i = 0; i < boundary.nvert; i++) {
        if (i % POLL == 0) OM_TRY_DONE(om_stop_poll());
        om_surface_tree_find(of_solid, om_load3(boundary.x, i), NULL, INFINITY, &q);
        patient->gap[vert[i]] = q.distance;
    }
    OM_TRY_DONE(om_surface_init(&patient->missed, solid->nvert, solid->ntri));
    memcpy(patient->missed.x, solid->x, 3 * (size_t)solid->nvert * sizeof(double));
    for (int t = 0; t < solid->ntri; t++) {
        const int* v = solid->tri_vert + 3 * (size_t)t;
        bool is_far = false;
        if (t % POLL == 0) OM_TRY_DONE(om_stop_poll());
        for (int c = 0; c < 3 && !is_far; c++)
            is_far = !om_surface_tree_find(of_mesh, om_load3(solid->x, v[c]), NULL, far, NULL);
        if (is_far) memcpy(patient->missed.tri_vert + 3 * (size_t)nmissed++, v, 3 * sizeof *v);
    }
    patient->missed.ntri = nmissed;
    if (nmissed == 0) om_surface_done(&patient->missed);
done:
    om_surface_done(&boundary);
    om_surface_tree_destroy(of_solid);
    om_surface_tree_destroy(of_mesh);
    om_free(vert);
    return status;
}

// ---- all of it -------------------------------------------------------------------------------------------

// All parts together: their fit, if they are several, and what pictures need.
static OmStatus measure_all(const OmModelDef* def, OmBody* body, int npart, OmPatient* patient,
                            OmModelReport* report) {
    Trial all = {0};
    OmStatus status = trial_init(def, body, 0, &all);
    if (status == OM_OK && npart > 1)
        status = om_shape_fit_measure(&all.mask, &all.solid, &patient->mesh, TOLERANCE * def->edge,
                                      def->nworker, &report->fit, NULL);
    if (status == OM_OK) status = find_gaps(&all.solid, TOLERANCE * def->edge, patient);
    if (status == OM_OK) {
        report->mesh_volume = om_tet_mesh_volume(&patient->mesh);
        report->volume_error = fabs(report->mesh_volume / all.volume - 1);
    }
    trial_done(&all);
    return status;
}

static OmStatus mesh_parts(const OmModelDef* def, OmBody* body, const OmProgress* progress,
                           OmPatient* patient, OmModelReport* report) {
    OmStatus status = OM_OK;
    OmTetMesh* mesh = &patient->mesh;
    int npart = 1, nmeshed = 0;
    if (body->has_volume) OM_TRY(om_mask_list_parts(&body->mask, 6, NULL, 0, &npart));
    report->edge = def->edge;
    for (int p = 1; p <= npart && status == OM_OK; p++) {
        Trial t = {0};
        Best best = {0};
        status = trial_init(def, body, npart > 1 ? p : 0, &t);
        if (status == OM_OK) status = mesh_part(&t, progress, &best);
        if (status == OM_OK) status = append_mesh(mesh, &best.mesh);
        if (status == OM_OK) {
            nmeshed++;
            report->edge = fmin(report->edge, best.edge);
            if (fabs(best.level) > fabs(report->level_shift)) report->level_shift = best.level;
            report->fit = best.fit;
        }
        // of several parts one may be lost: the fit tells it
        if (status == OM_INVALID && npart > 1) status = OM_OK;
        trial_done(&t);
        om_tet_mesh_done(&best.mesh);
    }
    if (status == OM_OK && nmeshed == 0)
        status =
            om_error(OM_INVALID, "all parts are thinner than an edge of %.3g mm", def->edge * 1e3);
    return status == OM_OK ? measure_all(def, body, npart, patient, report) : status;
}

// How far a surface is from the mesh, at its vertices, inner walls left out: what its field has lost does not show in
// the fit, which compares the mesh with this field.
static OmStatus find_missed(const OmBody* body, const OmTetMesh* mesh, double tolerance,
                            double* depth, OmVec3* where) {
    OmStatus status = OM_OK;
    OmSurface boundary = {0};
    OmSurfaceTree* tree = NULL;
    OmSurfacePoint q;
    *depth = 0;
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &boundary, NULL));
    OM_TRY_DONE(om_surface_tree_create(&boundary, &tree));
    for (int v = 0; v < body->surface.nvert; v++) {
        const OmVec3 x = om_load3(body->surface.x, v);
        if (v % POLL == 0) OM_TRY_DONE(om_stop_poll());
        if (om_sdf_eval(&body->sdf, x, NULL) < -0.5 * tolerance) continue;
        om_surface_tree_find(tree, x, NULL, INFINITY, &q);
        if (q.distance > *depth) *depth = q.distance, *where = x;
    }
done:
    om_surface_done(&boundary);
    om_surface_tree_destroy(tree);
    return status;
}

// The field of a surface again, with half the step.
static OmStatus halve_field(OmBody* body) {
    OmSdfDef def = om_sdf_default_def(0.5 * body->sdf.grid.spacing);
    OmSdf finer;
    OM_TRY(om_sdf_from_surface(&body->surface, &def, &finer));
    om_sdf_done(&body->sdf);
    body->sdf = finer;
    return OM_OK;
}

// What the fit of a report says.
static void judge(OmModelReport* report) {
    const OmShapeFit* fit = &report->fit;
    report->has_fit = true;
    report->has_loss = fit->nloss > 0 || !om_topology_is_equal(&fit->solid, &fit->mesh);
}

static int64_t count_inside(const OmSdf* sdf) {
    const size_t n = om_grid_count(sdf->grid.dim);
    int64_t count = 0;
    for (size_t i = 0; i < n; i++) count += sdf->d[i] < 0;
    return count;
}

OmStatus om__mesh_sheet(const OmModelDef* def, const OmMeshTask* task, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report) {
    OmStatus status = OM_OK;
    Trial t = {.def = def, .level = task->level, .voxel = task->voxel};
    Best best = {0};
    report->fit_is_of_sheet = true;
    t.stuff = om_stuff_default_def(def->edge, task->fn, task->ctx, task->lo, task->hi);
    t.stuff.nworker = def->nworker;
    const int64_t nall = count_inside(task->field);
    OM_TRY_DONE(take_nodes(task->field, 0, &t.mask));
    const double h = task->field->grid.spacing;
    const double left = h * h * h * (double)(nall - om_mask_count(&t.mask));
    if (left > LEFT_OUT * t.voxel * t.voxel * t.voxel)
        om__model_note(report, "%.3g mL of the sheet do not hang together with it and are left out",
                       left * 1e6);
    OM_TRY_DONE(om_surface_from_sdf(task->field, 0, &t.solid));
    t.volume = om_surface_volume(&t.solid);
    OM_CHECK_DONE(t.volume > 0, OM_INVALID,
                  "the sheet is thinner than a third of an edge of %.3g mm", def->edge * 1e3);
    OM_TRY_DONE(om__model_check_size(t.volume, def->edge));
    if (def->sheet.keep_edge) {
        OM_TRY_DONE(om__mesh_with_volume(task, t.volume, progress, &patient->mesh, report));
        OM_TRY_DONE(om_shape_fit_measure(&t.mask, &t.solid, &patient->mesh, TOLERANCE * def->edge,
                                         def->nworker, &report->fit, NULL));
    } else {
        OM_TRY_DONE(mesh_part(&t, progress, &best));
        patient->mesh = best.mesh;
        memset(&best.mesh, 0, sizeof best.mesh);
        report->edge = best.edge;
        report->level_shift = best.level;
        report->fit = best.fit;
    }
    judge(report);
    report->mesh_volume = om_tet_mesh_volume(&patient->mesh);
    report->volume_error = fabs(report->mesh_volume / t.volume - 1);
    OM_TRY_DONE(find_gaps(&t.solid, TOLERANCE * def->edge, patient));
done:
    trial_done(&t);
    om_tet_mesh_done(&best.mesh);
    return status;
}

OmStatus om__mesh_solid(const OmModelDef* def, OmBody* body, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report) {
    OmStatus status = OM_OK;
    double depth = 0;
    OmVec3 where = om_vec3(0, 0, 0);
    OM_TRY(om__model_check_size(body->volume_ref, def->edge));
    for (int k = 0;; k++) {
        memset(&patient->mesh, 0, sizeof patient->mesh);
        OM_TRY(mesh_parts(def, body, progress, patient, report));
        if (body->surface.ntri == 0) break;
        OM_TRY(find_missed(body, &patient->mesh, def->edge, &depth, &where));
        if (depth <= def->edge || !def->refine || k == MAX_HALVING) break;
        status = halve_field(body);
        if (status == OM_INVALID) break;  // too many nodes
        OM_TRY(status);
        om_tet_mesh_done(&patient->mesh);
        om_free(patient->gap);
        patient->gap = NULL;
        om_surface_done(&patient->missed);
    }
    status = OM_OK;
    if (depth > def->edge && body->is_folded)
        om__model_note(
            report,
            "the surface is up to %.3g mm from the mesh, at (%.4g, %.4g, %.4g) mm: it bounds nothing there, or "
            "something thin",
            depth * 1e3, where.x * 1e3, where.y * 1e3, where.z * 1e3);
    else if (depth > def->edge && report->fit.nloss == 0)  // its volume is not known
        report->fit.loss[report->fit.nloss++] = (OmShapeLoss){.where = where, .depth = depth};
    judge(report);
    return status;
}

// ---- in words --------------------------------------------------------------------------------------------

const char* om__model_fit_name(const OmModelReport* report) {
    return report->fit_is_of_sheet ? "sheet" : report->nvoxel > 0 ? "label" : "surface";
}

static void add_count(char* text, size_t size, const char* of, const char* what, int solid,
                      int mesh) {
    if (solid != mesh)
        om__model_append(text, size, "; %s: %d of the %s, %d of the mesh", what, solid, of, mesh);
}

void om_model_describe_loss(const OmModelReport* report, char* text, size_t size) {
    const OmShapeFit* f = &report->fit;
    if (size > 0) text[0] = 0;
    if (size == 0 || !report->has_loss) return;
    const char* what = om__model_fit_name(report);
    om__model_append(text, size, "the mesh is not the %s", what);
    for (int i = 0; i < f->nloss && i < 3; i++) {
        const OmShapeLoss* l = &f->loss[i];
        const OmVec3 at = om_scale(1e3, l->where);
        if (l->volume > 0)
            om__model_append(text, size, "; %.3g mL %s", l->volume * 1e6,
                             l->is_added ? "too much" : "missing");
        else
            om__model_append(text, size, "; a thin part missing");
        om__model_append(text, size,
                         " at (%.1f, %.1f, %.1f) mm, up to %.2g mm from the mesh's surface", at.x,
                         at.y, at.z, l->depth * 1e3);
    }
    if (f->nloss > 3) om__model_append(text, size, "; and %d more places", f->nloss - 3);
    add_count(text, size, what, "parts", f->solid.npart, f->mesh.npart);
    add_count(text, size, what, "handles", f->solid.nhandle, f->mesh.nhandle);
    add_count(text, size, what, "cavities", f->solid.ncavity, f->mesh.ncavity);
    const OmVec3 at = om_scale(1e3, f->change);
    if (f->has_change && f->nloss == 0)
        om__model_append(text, size, ", near (%.1f, %.1f, %.1f) mm", at.x, at.y, at.z);
    om__model_append(text, size, "; use an edge below %.2g mm", 0.6 * report->edge * 1e3);
}
