// study_kidney_lifts.c: attachments estimated while the fat is lifted, and the twin that has them.
//
// The twin with a set of attachments is brought to rest under its weight, contact with the kidney and the measured
// displacement of the grasp (4.3): om_match_find_rest, with springs of a full attachment. Without attachments it would
// slide off the kidney, so the twin of Zero has neither weight nor contact and follows the grasp, as in the thesis.
//
// Each way of estimating has a running twin of its own, from which its correspondence and physics start. It has the
// last accepted attachments of the way in this run; in the beginning the whole underside is attached. So each row is
// what it would be without the others.
//
// AVE of a scan: mean distance of its points from the twin at the same material points, less its value at rest: before
// the grasps, with the true attachments. The thesis takes material points from ZoomOut. Here they are those of the
// truth: pairs of om_match_find_pairs come from the twin that is to be judged, slide along it, and gave 0.1 mm where
// the vertices of the volume were 1.1 mm off. With the undeformed shape at rest the value at rest contains the sag of
// the truth (2.0 mm, not 1.0 mm), and differences fell below 0. Beside AVE stands the error of all vertices of the
// volume.
#include <math.h>
#include <string.h>

#include "omentum/banet_update.h"
#include "omentum/body.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_kidney_case.h"
#include "studies/study_match_case.h"

#define MAX_PATH 1024
#define KEEP 3    // views of different grasps in one estimate
#define METHOD 8  // number of the methods: results of another one are computed again

const char* const om__kidney_way_name[OM_STUDY_KIDNEY_NWAY] = {
    "zero", "underside", "same", "network", "fusion", "physics", "all"};
const char* const om__kidney_way_title[OM_STUDY_KIDNEY_NWAY] = {
    "Zero: none", "All: the whole underside", "Same: the true ones", "network", "fusion", "physics",
    "all three"};

typedef struct Belief {           // of a way that estimates
    unsigned char* attached;      // its last accepted set                        (nvert)
    double* x;                    // its running twin in this view, m             (nvert x 3)
    double* kept[KIDNEY_NGRASP];  // the same in the last view of each earlier grasp
} Belief;

typedef struct Operation {  // a state of the tissue, and the robot's side of it
    Kidney* s;
    int state;
    KidneyTruth truth;
    OmMatch* match;           // candidates: the underside
    OmMatch* mover;           // candidates: the whole surface
    OmBanetUpdater* updater;  // of `match`; null: no network
    AttachModel* free;        // without weight and contact
    const OmMeshSet* under;
    unsigned char* is_true;   // attached in truth     (nvert)
    unsigned char* attached;  // by a guess            (nvert)
    double* is_under;         // 1 in the underside, else 0     (nvert)
    double* spring;           // of candidates of `mover`
    int* held;                // scratch: grasped      (nvert)
    double* x;                // the twin, m           (nvert x 3)
    double* x_true;           // the truth at the twin's vertices
    // OmMatchView.mesh: the twin's, with a vertex for each node of its quadratic elements, the nvert of these arrays
    const OmTetMesh* node;
    OmFemMesh mesh;      // the eight tetrahedra of each element
    StudyPlaces places;  // of the scan's points in them
    OmAcquisition acquisition;
    int nkept;
    OmAcquisition kept[KIDNEY_NGRASP];    // the last view of each earlier grasp
    Belief belief[OM_STUDY_KIDNEY_NWAY];  // of ways from FIRST_WAY on; without attached: not run
} Operation;

#define FIRST_WAY OM_STUDY_KIDNEY_NETWORK

static void forget(Operation* o) {
    for (int k = 0; k < o->nkept; ++k) om_scan_done(&o->kept[k].scan);
    for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way)
        for (int k = 0; k < KIDNEY_NGRASP; ++k) {
            om_free(o->belief[way].kept[k]);
            o->belief[way].kept[k] = NULL;
        }
    o->nkept = 0;
}

static void operation_done(Operation* o) {
    forget(o);
    om__kidney_truth_close(&o->truth);
    om_banet_updater_destroy(o->updater);
    om_match_destroy(o->match);
    om_match_destroy(o->mover);
    om__attach_model_destroy(o->free);
    for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        om_free(o->belief[way].attached);
        om_free(o->belief[way].x);
    }
    om_free(o->is_true);
    om_free(o->held);
    om_free(o->attached);
    om_free(o->spring);
    om_free(o->is_under);
    om_free(o->x);
    om_free(o->x_true);
    om_fem_mesh_done(&o->mesh);
    om__places_done(&o->places);
    memset(o, 0, sizeof *o);
}

static OmStatus make_matches(Operation* o) {
    const OmSite* twin = &o->s->twin;
    OmMatchDef def = om_match_default_def(&o->s->scene, twin);
    OM_TRY(om_match_create(&def, &o->match));
    if (o->s->estimate) {
        OmBanetUpdateDef update = om_banet_update_default_def(o->match);
        update.estimate = o->s->estimate;
        update.estimate_ctx = o->s->estimate_ctx;
        OM_TRY(om_banet_updater_create(&update, &o->updater));
    }
    OmMaterial material = {.law = o->s->scene.tissue.law,
                           .young = o->s->scene.tissue.young,
                           .poisson = o->s->scene.tissue.poisson};
    OM_TRY(om__attach_model_create_bending(&twin->mesh, material, &o->free));
    const OmMatchView* view = om_match_view(o->match);
    int* corner;
    OM_ALLOC(corner, view->surface->nvert);
    def.ncandidate = 0;
    for (int i = 0; i < view->surface->nvert; ++i)
        if (view->surface_vert[i] < view->ncorner) corner[def.ncandidate++] = view->surface_vert[i];
    def.candidate = corner;
    def.nhypothesis = 0;
    OmStatus status = om_match_create(&def, &o->mover);
    om_free(corner);
    o->node = view->mesh;
    return status;
}

static OmStatus operation_open(Kidney* s, int state, Operation* o) {
    *o = (Operation){.s = s, .state = state};
    const OmTetMesh* mesh = &s->twin.mesh;
    OmPose task = om_pose_inverse(s->twin.pose_world_task);
    OmStatus status;
    OM_TRY_DONE(
        om__kidney_truth_open(&s->scene, s->def->is_quick, state, s->def->nworker, &o->truth));
    OM_TRY_DONE(make_matches(o));
    OM_TRY_DONE(om_fem_mesh_from_tet(o->node, OM_TET4, &o->mesh));
    const size_t n = (size_t)o->node->nvert;
    o->under = om_tet_mesh_find_set(mesh, "underside");
    OM_CALLOC_DONE(o->is_true, n);
    OM_CALLOC_DONE(o->attached, n);
    OM_CALLOC_DONE(o->held, n);
    OM_CALLOC_DONE(o->spring, n);
    OM_CALLOC_DONE(o->is_under, n);
    OM_CALLOC_DONE(o->x, 3 * n);
    OM_CALLOC_DONE(o->x_true, 3 * n);
    for (int way = FIRST_WAY; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        if (way != OM_STUDY_KIDNEY_PHYSICS && !o->updater) continue;
        OM_CALLOC_DONE(o->belief[way].attached, n);
        OM_CALLOC_DONE(o->belief[way].x, 3 * n);
    }
    for (int k = 0; k < o->under->nvert; ++k) {
        int v = o->under->vert[k];
        o->is_under[v] = 1;
        o->is_true[v] = om__kidney_is_attached(state, om_pose_apply(task, om_load3(mesh->x, v)));
    }
done:
    if (status < 0) operation_done(o);
    return status;
}

// ---- the twin with a guess ----------------------------------------------------------------------------

// The twin at rest under the grasp with `attached`, into o->x. False if it did not come to rest.
static OmStatus move_twin(Operation* o, const unsigned char* attached, bool* is_loose) {
    const OmMatchView* view = om_match_view(o->mover);
    for (int i = 0; i < view->ncandidate; ++i)
        o->spring[i] = attached[view->candidate[i]] ? view->foundation * view->area[i] : 0;
    OmMatchLoad load = {
        .spring = o->spring, .ngrasp = o->acquisition.ngrasp, .grasp = o->acquisition.grasp};
    memcpy(o->x, view->mesh->x, 3 * (size_t)view->mesh->nvert * sizeof *o->x);
    OmStatus status = om_match_find_rest(o->mover, &load, o->x, NULL);
    *is_loose = status == OM_NOT_CONVERGED;
    return *is_loose ? OM_OK : status;
}

// The twin without attachments, weight and contact, into o->x.
static OmStatus move_free(Operation* o, bool* is_loose) {
    const OmTetMesh* mesh = o->node;
    const OmMatchGrasp* g = &o->acquisition.grasp[0];
    OmPose motion = om_pose_mul(g->pose_world_now, om_pose_inverse(g->pose_world_grasp));
    AttachMove move = {.grasp = o->held, .goal = o->x};
    AttachSolve solve = {0};
    double* x = om_alloc(3 * (size_t)mesh->nvert, sizeof *x);
    if (!x) return OM_NO_MEMORY;
    for (int v = 0; v < mesh->nvert; ++v) {
        OmVec3 p = om_load3(mesh->x, v);
        if (om_distance(p, g->pose_world_grasp.p) > o->s->scene.task.grasp_radius) continue;
        om_store3(o->x, move.ngrasp, om_pose_apply(motion, p));
        o->held[move.ngrasp++] = v;
    }
    OmStatus status = om__attach_model_solve(o->free, &move, x, &solve);
    memcpy(o->x, x, 3 * (size_t)mesh->nvert * sizeof *x);
    *is_loose = !solve.is_converged;
    om_free(x);
    return status;
}

// Places of the scan's points in the twin.
static OmStatus find_places(Operation* o) {
    const KidneyTruth* t = &o->truth;
    const OmScan* scan = &o->acquisition.scan;
    double* rest;
    OM_CHECK(scan->npoint > 0, OM_INVALID, "kidney: the camera sees no tissue");
    om__places_done(&o->places);
    OM_ALLOC(rest, 3 * (size_t)scan->npoint);
    OmStatus status = om__match_find_scanned(&t->surface, t->vert, t->mesh.x, scan, t->shift, rest);
    if (status >= 0) status = om__places_find(&o->mesh, scan->npoint, rest, &o->places);
    om_free(rest);
    return status;
}

// Mean distance of the scan's points from the twin, m.
static double measure_scan(const Operation* o) {
    return om__places_distance(&o->places, o->x, o->acquisition.scan.x);
}

// Score the set o->attached, and the twin that has it. Nothing attached: the free twin.
static OmStatus score(Operation* o, KidneyGuess* g) {
    const int nvert = o->node->nvert;
    const bool is_free = !memchr(o->attached, 1, (size_t)nvert);
    om__attach_score(nvert, o->is_under, o->attached, o->is_true, &g->dsc, &g->tpr);
    double mve;
    OM_TRY(is_free ? move_free(o, &g->is_loose) : move_twin(o, o->attached, &g->is_loose));
    g->is_there = true;
    g->ave = measure_scan(o);
    om__attach_error(nvert, o->x, o->x_true, &g->volume, &mve);
    return OM_OK;
}

// ---- estimates ----------------------------------------------------------------------------------------

// Score the set o->attached of a way; it becomes the way's belief.
static OmStatus take(Operation* o, int way, KidneyGuess* g) {
    memcpy(o->belief[way].attached, o->attached, (size_t)o->node->nvert);
    return score(o, g);
}

// After a refused update the twin keeps its attachments.
static OmStatus take_estimate(Operation* o, int way, const OmMatchEstimate* e, KidneyGuess* g) {
    const unsigned char* last = o->belief[way].attached;
    g->is_accepted = e->is_accepted;
    snprintf(g->reason, sizeof g->reason, "%.119s", e->reason);
    for (int v = 0; v < o->node->nvert; ++v)
        o->attached[v] = e->is_accepted ? e->attached[v] : last[v];
    return take(o, way, g);
}

// Vertices that the network attaches; where it says nothing, the twin keeps its attachments.
static OmStatus take_advice(Operation* o, int way, const OmBanetAdvice* advice, KidneyGuess* g) {
    const double* p = way == OM_STUDY_KIDNEY_NETWORK ? advice->view : advice->probability;
    const unsigned char* last = o->belief[way].attached;
    g->is_accepted = advice->nused > 0;
    snprintf(g->reason, sizeof g->reason, "%.119s", g->is_accepted ? "" : advice->reason);
    double *under, threshold = 1;
    OM_ALLOC(under, (size_t)o->under->nvert);
    for (int k = 0; k < o->under->nvert; ++k) under[k] = p[o->under->vert[k]];
    OmStatus status =
        om_banet_choose_threshold(o->under->nvert, under, OM_BANET_NEARLY, &threshold);
    om_free(under);
    if (status < 0) return status;
    for (int v = 0; v < o->node->nvert; ++v)
        o->attached[v] = g->is_accepted ? p[v] >= threshold : last[v];
    return take(o, way, g);
}

// This view and up to `nmost` - 1 last ones of earlier grasps, with the running twin of a way. Returns their number.
static int gather(const Operation* o, int way, int nmost, OmAcquisition* list) {
    int n = 0;
    for (int k = o->nkept < nmost ? 0 : o->nkept - nmost + 1; k < o->nkept; ++k) {
        list[n] = o->kept[k];
        list[n++].x_twin = o->belief[way].kept[k];
    }
    list[n] = o->acquisition;
    list[n++].x_twin = o->belief[way].x;
    return n;
}

static OmStatus guess_physics(Operation* o, KidneyGuess* g) {
    OmMatchEstimate estimate = {0};
    OmAcquisition now;
    gather(o, OM_STUDY_KIDNEY_PHYSICS, 1, &now);
    clock_t begin = clock();
    OmStatus status = om_match_update(o->match, 1, &now, NULL, &estimate);
    g->ms = om__processor_ms(begin);
    if (status >= 0) status = take_estimate(o, OM_STUDY_KIDNEY_PHYSICS, &estimate, g);
    om_match_estimate_done(&estimate);
    return status;
}

// A way of the network: alone from this view, alone from views of several grasps, and with physics from these.
static OmStatus guess_network(Operation* o, int way, KidneyGuess* g) {
    bool is_joint = way == OM_STUDY_KIDNEY_ALL;
    OmAcquisition list[KEEP];
    OmMatchEstimate estimate = {0};
    OmBanetAdvice advice = {0};
    int n = gather(o, way, way == OM_STUDY_KIDNEY_NETWORK ? 1 : KEEP, list);
    om_banet_updater_set_attached(o->updater, o->belief[way].attached);
    clock_t begin = clock();
    OmStatus status =
        om_banet_update(o->updater, n, list, NULL, is_joint ? &estimate : NULL, &advice);
    g->ms = om__processor_ms(begin);
    if (status >= 0)
        status = is_joint ? take_estimate(o, way, &estimate, g) : take_advice(o, way, &advice, g);
    om_banet_advice_done(&advice);
    om_match_estimate_done(&estimate);
    return status;
}

static void attach_underside(const Operation* o, unsigned char* attached) {
    memset(attached, 0, (size_t)o->node->nvert);
    for (int k = 0; k < o->under->nvert; ++k) attached[o->under->vert[k]] = 1;
}

static OmStatus guess_all(Operation* o, KidneyView* view) {
    size_t n = (size_t)o->node->nvert;
    memset(o->attached, 0, n);
    for (int way = OM_STUDY_KIDNEY_ZERO; way <= OM_STUDY_KIDNEY_SAME; ++way)
        view->by[way].is_accepted = true;
    OM_TRY(score(o, &view->by[OM_STUDY_KIDNEY_ZERO]));
    attach_underside(o, o->attached);
    OM_TRY(score(o, &view->by[OM_STUDY_KIDNEY_UNDER]));
    memcpy(o->attached, o->is_true, n);
    OM_TRY(score(o, &view->by[OM_STUDY_KIDNEY_SAME]));
    OM_TRY(guess_physics(o, &view->by[OM_STUDY_KIDNEY_PHYSICS]));
    if (!o->updater) return OM_OK;
    OM_TRY(guess_network(o, OM_STUDY_KIDNEY_NETWORK, &view->by[OM_STUDY_KIDNEY_NETWORK]));
    OM_TRY(guess_network(o, OM_STUDY_KIDNEY_FUSION, &view->by[OM_STUDY_KIDNEY_FUSION]));
    view->is_lost = !view->by[OM_STUDY_KIDNEY_NETWORK].is_accepted;
    return guess_network(o, OM_STUDY_KIDNEY_ALL, &view->by[OM_STUDY_KIDNEY_ALL]);
}

// ---- a run --------------------------------------------------------------------------------------------

// What the robot sees.
static OmStatus look(Operation* o, int grasp, KidneyMoment moment, int run) {
    OM_TRY(om__kidney_truth_look(&o->truth, grasp, moment, run, &o->s->twin, &o->acquisition));
    OM_TRY(find_places(o));
    return om__match_carry_by(&o->truth.mesh, o->truth.x, o->node->nvert, o->node->x, o->x_true);
}

// The running twins follow the grasp. Those of equal attachments are equal.
static OmStatus follow(Operation* o) {
    size_t n = (size_t)o->node->nvert;
    for (int way = FIRST_WAY; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        Belief* b = &o->belief[way];
        const double* x = NULL;
        bool is_loose;
        if (!b->attached) continue;
        for (int k = FIRST_WAY; k < way && !x; ++k)
            if (o->belief[k].attached && memcmp(o->belief[k].attached, b->attached, n) == 0)
                x = o->belief[k].x;
        if (!x) OM_TRY(move_twin(o, b->attached, &is_loose));
        memcpy(b->x, x ? x : o->x, 3 * n * sizeof *b->x);
    }
    return OM_OK;
}

static void look_done(Operation* o) {
    om_scan_done(&o->acquisition.scan);
    memset(&o->acquisition, 0, sizeof o->acquisition);
}

// Keep the view, with the running twins at this time, for later grasps.
static OmStatus keep(Operation* o) {
    size_t n = 3 * (size_t)o->node->nvert;
    for (int way = FIRST_WAY; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        Belief* b = &o->belief[way];
        if (!b->attached) continue;
        OM_ALLOC(b->kept[o->nkept], n);
        memcpy(b->kept[o->nkept], b->x, n * sizeof *b->x);
    }
    o->kept[o->nkept++] = o->acquisition;
    memset(&o->acquisition, 0, sizeof o->acquisition);
    return OM_OK;
}

static OmStatus run_view(Operation* o, int run, int grasp, int level, bool is_last,
                         KidneyView* view) {
    memset(view, 0, sizeof *view);
    view->grasp = grasp;
    view->level = level;
    OmStatus status = look(o, grasp, (KidneyMoment)(KIDNEY_LIFTED + level), run);
    view->npoint = o->acquisition.scan.npoint;
    if (status >= 0) status = follow(o);
    if (status >= 0) status = guess_all(o, view);
    if (status >= 0 && is_last) status = keep(o);
    look_done(o);
    return status;
}

OmStatus om__kidney_picture_path(const Kidney* s, int grasp, int state, char* path, size_t size) {
    char name[64];
    snprintf(name, sizeof name, "lift-%c%d%s.png", 'A' + grasp, state + 1,
             s->def->is_quick ? "-quick" : "");
    return om_path_join(s->def->out_dir, name, path, size);
}

static OmStatus save_picture(Operation* o, int grasp, int nlevel) {
    char path[MAX_PATH];
    OM_TRY(om__kidney_picture_path(o->s, grasp, o->state, path, sizeof path));
    KidneyMoment last = (KidneyMoment)(KIDNEY_LIFTED + nlevel - 1);
    return nlevel ? om__kidney_truth_save_picture(&o->truth, grasp, last, path) : OM_OK;
}

static OmStatus run_operation(Operation* o, int run, KidneyResult* r) {
    bool is_loose;
    const KidneyCases* c = &o->s->cases;
    r->ntet = o->truth.site.mesh.ntet;
    for (int i = 0; i < c->ngrasp; ++i) {
        OM_TRY(om__kidney_truth_lift(&o->truth, o->s->def->out_dir, c->grasp[i], NULL));
        r->lift[c->grasp[i]] = o->truth.lift[c->grasp[i]];
    }
    for (int way = FIRST_WAY; way < OM_STUDY_KIDNEY_NWAY; ++way)
        if (o->belief[way].attached) attach_underside(o, o->belief[way].attached);
    OmStatus status = look(o, c->grasp[0], KIDNEY_REST, run);
    if (status >= 0) status = move_twin(o, o->is_true, &is_loose);
    r->rest = status >= 0 ? measure_scan(o) : 0;
    look_done(o);
    if (status < 0) return status;
    for (int i = 0; i < c->ngrasp; ++i) {
        int nlevel = r->lift[c->grasp[i]].nlevel;
        if (nlevel > c->nlevel) nlevel = c->nlevel;
        if (run == 0) OM_TRY(save_picture(o, c->grasp[i], nlevel));
        for (int k = 0; k < nlevel; ++k)
            OM_TRY(run_view(o, run, c->grasp[i], k, k == nlevel - 1, &r->view[r->nview++]));
    }
    return OM_OK;
}

typedef struct Runs {
    Kidney* s;
    Operation o;
    bool is_open;
} Runs;

// The hash is of everything that a run depends on: method, network, twin, and the truth with its attachments.
static OmStatus name_run(const void* ctx, int i, char name[64], uint64_t* hash) {
    const Kidney* s = ((const Runs*)ctx)->s;
    const int state = s->cases.state[i / s->def->nrun], run = i % s->def->nrun;
    const int number[] = {METHOD, state, run, KIDNEY_NOISE_SEED, s->def->is_quick};
    const OmTetMesh* mesh = &s->twin.mesh;
    OmPose task = om_pose_inverse(s->twin.pose_world_task);
    OmText text = {0};
    snprintf(name, 64, "run-%d-%02d%s.bin", state + 1, run + 1, s->def->is_quick ? "-quick" : "");
    OmStatus status = om__kidney_hash_truth(&s->scene, hash);
    if (status == OM_OK) status = om_scene_print(&s->scene, false, &text);
    if (status == OM_OK) *hash = om_hash(text.str, text.len, *hash);
    *hash = om_hash(mesh->x, 3 * (size_t)mesh->nvert * sizeof(double), *hash);
    for (int v = 0; v < mesh->nvert; ++v) {
        OmVec3 p = om_pose_apply(task, om_load3(mesh->x, v));
        const unsigned char is_in = om__kidney_is_attached(state, p);
        *hash = om_hash(&is_in, 1, *hash);
    }
    *hash = om_hash(number, sizeof number, *hash);
    *hash = om_hash(om__kidney_grasp, sizeof om__kidney_grasp, *hash);
    *hash = om_hash(&s->net_hash, sizeof s->net_hash, *hash);
    om_text_done(&text);
    return status;
}

// Runs of a state follow each other and share the truth.
static OmStatus make_run(void* ctx, int i, void* result) {
    Runs* r = ctx;
    const int state = r->s->cases.state[i / r->s->def->nrun];
    if (r->is_open && r->o.state != state) {
        operation_done(&r->o);
        r->is_open = false;
    }
    if (!r->is_open) OM_TRY(operation_open(r->s, state, &r->o));
    r->is_open = true;
    ++r->s->sum.nnew;
    OmStatus status = run_operation(&r->o, i % r->s->def->nrun, result);
    forget(&r->o);
    return status;
}

OmStatus om__kidney_run_lifts(Kidney* s) {
    Runs r = {.s = s};
    StudyCases c = {.dir = s->def->out_dir,
                    .what = "runs",
                    .n = s->cases.nstate * s->def->nrun,
                    .nworker = 1,
                    .size = sizeof *s->result,
                    .result = s->result,
                    .ctx = &r,
                    .name = name_run,
                    .make = make_run};
    OmStatus status = om__cases_run(&c, s->progress);
    operation_done(&r.o);
    return status;
}

// ---- the tables ---------------------------------------------------------------------------------------

// Mean over the runs at one level, less the error at rest; volume: of the error of all vertices.
static double mean_of_runs(const Kidney* s, int state, int grasp, int level, int way, bool volume) {
    double sum = 0;
    int n = 0;
    for (int run = 0; run < s->def->nrun; ++run) {
        const KidneyResult* r = &s->result[state * s->def->nrun + run];
        for (int k = 0; k < r->nview; ++k) {
            const KidneyView* v = &r->view[k];
            if (v->grasp != grasp || v->level != level) continue;
            sum += volume ? v->by[way].volume : v->by[way].ave - r->rest;
            ++n;
        }
    }
    return n ? sum / n : 0;
}

static void make_row(const Kidney* s, int state, int grasp, int way, OmStudyKidneyRow* row,
                     double* volume) {
    int reached = s->result[state * s->def->nrun].lift[grasp].nlevel;
    *row = (OmStudyKidneyRow){.grasp = grasp, .state = s->cases.state[state]};
    row->nlevel = reached < s->cases.nlevel ? reached : s->cases.nlevel;
    *volume = 0;
    for (int k = 0; k < row->nlevel; ++k) {
        row->ave[k] = mean_of_runs(s, state, grasp, k, way, false);
        row->mean += row->ave[k] / row->nlevel;
        *volume += mean_of_runs(s, state, grasp, k, way, true) / row->nlevel;
    }
    for (int k = 0; k < row->nlevel && row->nlevel > 1; ++k)
        row->sd += (row->ave[k] - row->mean) * (row->ave[k] - row->mean) / (row->nlevel - 1);
    row->sd = sqrt(row->sd);
}

// Scores of all views of a way.
static OmStatus score_table(const Kidney* s, int way, OmStudyKidneyTable* t) {
    StudyColumns c = {0};
    StudySample sample[3];
    for (int i = 0; i < s->cases.nstate * s->def->nrun; ++i)
        for (int k = 0; k < s->result[i].nview; ++k) {
            const KidneyGuess* g = &s->result[i].view[k].by[way];
            if (!g->is_there) continue;
            om__columns_add(&c, 3, (double[]){g->dsc, g->tpr, g->ms});
            t->nrefused += !g->is_accepted;
            t->nloose += g->is_loose;
        }
    OM_TRY(om__columns_end(&c, 3, (StudySample*[]){&sample[0], &sample[1], &sample[2]}));
    t->is_there = sample[0].n > 0;
    t->dsc = sample[0].median;
    t->tpr = sample[1].median;
    t->ms = sample[2].median;
    return OM_OK;
}

static void make_table(const Kidney* s, int way, OmStudyKidneyTable* t) {
    const OmStudyKidneyTable* zero = &s->sum.by[OM_STUDY_KIDNEY_ZERO];
    int n = 0, nratio = 0;
    for (int i = 0; i < s->cases.nstate; ++i) {
        for (int g = 0; g < s->cases.ngrasp; ++g) {
            double volume;
            OmStudyKidneyRow* row = &t->row[n];
            make_row(s, i, s->cases.grasp[g], way, row, &volume);
            if (row->nlevel == 0) continue;
            t->mean += row->mean;
            t->volume += volume;
            t->worst = n > 0 ? fmax(t->worst, row->mean) : row->mean;
            if (zero->row[n].mean > 0) {
                t->ratio += row->mean / zero->row[n].mean;
                ++nratio;
            }
            ++n;
        }
    }
    t->mean /= n ? n : 1;
    t->volume /= n ? n : 1;
    t->ratio /= nratio ? nratio : 1;
}

OmStatus om__kidney_summarise_lifts(Kidney* s) {
    OmStudyKidneySummary* sum = &s->sum;
    int nrun = s->def->nrun;
    for (int i = 0; i < s->cases.nstate; ++i) {
        const KidneyResult* first = &s->result[i * nrun];
        sum->ntet = first->ntet;
        sum->nview += first->nview;
        for (int g = 0; g < s->cases.ngrasp; ++g) {
            int nlevel = first->lift[s->cases.grasp[g]].nlevel;
            if (nlevel < s->cases.nlevel) sum->nmissing += s->cases.nlevel - nlevel;
            sum->nshort += nlevel < s->cases.nlevel;
            sum->nrow += nlevel > 0;
        }
        for (int run = 0; run < nrun; ++run) {
            const KidneyResult* r = &s->result[i * nrun + run];
            sum->rest += r->rest / (s->cases.nstate * nrun);
            for (int k = 0; k < r->nview; ++k) sum->nlost += r->view[k].is_lost;
        }
    }
    for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        OM_TRY(score_table(s, way, &sum->by[way]));
        if (sum->by[way].is_there) make_table(s, way, &sum->by[way]);
    }
    return OM_OK;
}
