// study_phantoms_eval.c: attachments of one phantom, estimated at every step of its lifts, and how well they do.
//
// The twin believes in no attachment and follows the measured tip at rest, so a step does not depend on the steps or
// lifts before it, except by the ways that use them. The true attachments are the vertices of the twin's underside that
// the stitches hold; DSC (4.3) and TPR (4.6) are over the vertices of the underside.
//
// AVE: the twin is deformed by the displacement of its grasped vertices with an estimate held still (4.3; no gravity,
// no board, as in the thesis), and every point that the camera saw is compared with its material point. The thesis
// takes these correspondences from its matching. Here the truth is known, so they are exact, and no error of a matching
// is part of the value at rest: it contains the noise, the camera's shift, and how the phantom settles on its board.
// The error at all vertices of the volume (4.5) needs no points and no value at rest.
//
// The twin of the network's correspondence has the attachments of physics alone (OmBanetUpdateDef.is_corrected).
//
// The network sees one step, or the last NFRAME steps of the lift. Physics has one step. All of it together: the last
// NFRAME steps.
//
// A refused estimate attaches nothing; its errors are those of a free twin.
#include "studies/study_phantoms_eval.h"

#include <math.h>
#include <string.h>

#include "omentum/banet_fuse.h"
#include "omentum/match_live.h"
#include "omentum/world_cloud.h"
#include "studies/study_attach_protocol.h"
#include "studies/study_match_case.h"

#define MAX_GRASPED 64
#define NFRAME 3       // as many views as an update in the loop keeps
#define JOINT_LEVEL 4  // 40 mm, as the thesis

typedef struct View {
    const PhantomTruth* truth;
    OmScan scan;
    OmMatchGrasp grasp;
    OmAcquisition acquisition;
    int ngrasped;
    int grasped[MAX_GRASPED];
    double goal[3 * MAX_GRASPED];
    StudyPlaces places;  // in the twin, of the material points of the scan's points
    double* x_twin;      // free, at rest under the grasp                               (nvert x 3)
    double* x_true;      // the truth at the twin's vertices                            (nvert x 3)
} View;

typedef struct Bench {
    const Phantoms* s;
    const PhantomCase* c;
    PhantomResult* r;
    OmScene scene;
    OmSite site;  // of the twin
    // OmMatchView.mesh, with a vertex for each node of the twin's quadratic elements
    const OmTetMesh* mesh;
    OmFemMesh eighth;  // the eight tetrahedra of each element, to find places in the twin
    const OmMeshSet* under;
    OmMatch* match;
    OmBanetUpdater* updater;  // null: no network
    AttachModel* model;
    PhantomTruth truth[PHANTOM_NGRASP];
    View view[PHANTOM_NVIEW];
    double* x;                // scratch             (nvert x 3)
    unsigned char* attached;  // scratch             (nvert)
} Bench;

static void view_done(View* v) {
    om_scan_done(&v->scan);
    om__places_done(&v->places);
    om_free(v->x_twin);
    om_free(v->x_true);
}

static void bench_done(Bench* b) {
    for (int i = 0; i < PHANTOM_NVIEW; ++i) view_done(&b->view[i]);
    for (int g = 0; g < PHANTOM_NGRASP; ++g) om__phantoms_truth_done(&b->truth[g]);
    om__attach_model_destroy(b->model);
    om_banet_updater_destroy(b->updater);
    om_match_destroy(b->match);
    om_fem_mesh_done(&b->eighth);
    om_site_done(&b->site);
    om_free(b->x);
    om_free(b->attached);
}

// ---- the twin -----------------------------------------------------------------------------------------------

static OmStatus make_twin(Bench* b) {
    PhantomResult* r = b->r;
    b->scene = om__phantoms_scene(b->c, OM_SITE_TWIN);
    OM_TRY(om__phantoms_site(b->c, OM_SITE_TWIN, b->s->coarse, &b->scene, &b->site));
    OmMatchDef match = om_match_default_def(&b->scene, &b->site);
    OM_TRY(om_match_create(&match, &b->match));
    b->mesh = om_match_view(b->match)->mesh;
    b->under = om_tet_mesh_find_set(&b->site.mesh, "underside");
    r->nnode = b->under->nvert;
    OM_CHECK(r->nnode <= PHANTOM_MAX_NODE, OM_INVALID, "%d vertices in the underside", r->nnode);
    OM_ALLOC(b->x, 3 * (size_t)b->mesh->nvert);
    OM_ALLOC(b->attached, (size_t)b->mesh->nvert);
    om__phantoms_held(b->c, &b->site, b->attached);
    for (int i = 0; i < r->nnode; ++i) {
        int v = b->under->vert[i];
        r->truth[i] = b->attached[v];
        r->node_x[i][0] = b->site.mesh.x[3 * v];
        r->node_x[i][1] = b->site.mesh.x[3 * v + 1];
    }
    OM_TRY(om_fem_mesh_from_tet(b->mesh, OM_TET4, &b->eighth));
    if (b->s->net || b->s->estimate) {
        OmBanetUpdateDef update = om_banet_update_default_def(b->match);
        update.net = b->s->net;
        if (b->s->def->side > 0) update.side = b->s->def->side;
        update.estimate = b->s->estimate;
        update.estimate_ctx = b->s->def->estimate_ctx;
        if (!b->s->net) update.threshold = b->s->threshold;
        update.is_corrected = true;
        OM_TRY(om_banet_updater_create(&update, &b->updater));
    }
    OmMaterial material = {
        .young = b->site.young, .poisson = b->site.poisson, .law = (OmLaw)b->scene.tissue.law};
    return om__attach_model_create_bending(&b->site.mesh, material, &b->model);
}

// ---- views --------------------------------------------------------------------------------------------------

// Points of a picture with their material points in the twin; r: mean distance of the two where nothing moved.
static OmStatus look(Bench* b, const PhantomTruth* t, int level, View* v, double* rest) {
    OmSurface now = {0};
    OmObservation obs = {0};
    double* material = NULL;
    const double* x = t->x + 3 * (size_t)level * (size_t)t->mesh.nvert;
    OmStatus status;
    OM_TRY_DONE(om__phantoms_observe(t, level, &obs));
    OM_TRY_DONE(om__hand_scan(&obs, &b->site, t->head->psm, 0, &v->scan));
    OM_ALLOC_DONE(material, 3 * (size_t)v->scan.npoint + 1);  // a scan may have no point
    OM_TRY_DONE(om__hand_surface(&t->surface, t->vert, x, &now));
    OM_TRY_DONE(
        om__match_find_scanned(&now, t->vert, t->mesh.x, &v->scan, t->head->shift, material));
    OM_TRY_DONE(om__places_find(&b->eighth, v->scan.npoint, material, &v->places));
    *rest = 0;
    for (int i = 0; i < v->scan.npoint; ++i)
        *rest += om_distance(om_load3(v->scan.x, i), om_load3(material, i)) / v->scan.npoint;
done:
    om_observation_done(&obs);
    om_surface_done(&now);
    om_free(material);
    return status;
}

// Vertices of the twin in the jaw, and where they go.
static OmStatus find_grasped(Bench* b, View* v) {
    const OmTetMesh* m = b->mesh;
    OmPose move = om_pose_mul(v->grasp.pose_world_now, om_pose_inverse(v->grasp.pose_world_grasp));
    for (int i = 0; i < m->nvert; ++i) {
        OmVec3 p = om_load3(m->x, i);
        bool is_in = om_distance(p, v->grasp.pose_world_grasp.p) <= b->scene.task.grasp_radius;
        if (!is_in || v->ngrasped == MAX_GRASPED) continue;
        om_store3(v->goal, v->ngrasped, om_pose_apply(move, p));
        v->grasped[v->ngrasped++] = i;
    }
    OM_CHECK(v->ngrasped > 0, OM_INVALID, "no vertex of the twin is in the jaw");
    return OM_OK;
}

// x_twin: in and out; the twin at the step before is the first guess.
static OmStatus make_view(Bench* b, int g, int level, const double* x_before, View* v,
                          PhantomView* out) {
    const PhantomTruth* t = v->truth = &b->truth[g];
    const PhantomMoment* at = &t->head->at[level];
    size_t n3 = 3 * (size_t)b->mesh->nvert;
    double unused;
    OM_TRY(look(b, t, level, v, &unused));
    v->grasp = (OmMatchGrasp){.arm = t->head->arm,
                              .pose_world_grasp = t->head->grasp_tip,
                              .pose_world_now = at->arm[t->head->arm].tip};
    OM_TRY(find_grasped(b, v));
    OM_ALLOC(v->x_twin, n3);
    OM_ALLOC(v->x_true, n3);
    memcpy(v->x_twin, x_before, n3 * sizeof *x_before);
    OmMatchLoad load = {.ngrasp = 1, .grasp = &v->grasp, .tolerance = 2e-4};
    OmStatus status = om_match_find_rest(b->match, &load, v->x_twin, NULL);
    if (status < 0) return status;
    const double* x = t->x + 3 * (size_t)level * (size_t)t->mesh.nvert;
    OM_TRY(om__match_carry_by(&t->mesh, x, b->mesh->nvert, b->mesh->x, v->x_true));
    v->acquisition = (OmAcquisition){
        .scan = v->scan, .ngrasp = 1, .grasp = {v->grasp}, .time = at->time, .x_twin = v->x_twin};
    out->grasp = g;
    out->level = level;
    out->npoint = v->scan.npoint;
    out->seen = om__hand_share_facing(&t->surface, t->vert, x,
                                      om_sub(t->head->camera.pose_world_camera.p, t->head->shift));
    out->force = at->force;
    return OM_OK;
}

static OmStatus make_views(Bench* b) {
    PhantomResult* r = b->r;
    for (int g = 0; g < b->c->ngrasp; ++g) {
        PhantomTruth* t = &b->truth[g];
        bool is_there;
        View still = {0};
        OM_TRY(om__phantoms_truth_open(b->c, g, b->s->coarse, b->s->def->out_dir, &is_there, t));
        OM_CHECK(is_there, OM_IO, "%s: the lift is not there any more", t->file);
        OmStatus status = look(b, t, 0, &still, &r->rest[g]);
        view_done(&still);
        if (status < 0) return status;
        r->nlevel[g] = t->head->nlevel;
        r->end_force[g] = t->head->end_force;
        const double* before = b->mesh->x;
        for (int k = 1; k <= t->head->nlevel; ++k) {
            View* v = &b->view[r->nview];
            status = make_view(b, g, k, before, v, &r->view[r->nview++]);
            if (status < 0) return om_error_prefix(status, "%s, step %d", t->file, k);
            before = v->x_twin;
        }
    }
    return OM_OK;
}

// ---- errors of a set ----------------------------------------------------------------------------------------

// The twin with these vertices of the underside held still, lifted as in the view.
// ave: m, of the points, less the value at rest, or `volume` if the camera saw none; volume: m, of all vertices.
static OmStatus move_twin(Bench* b, int view, const unsigned char* attached, double* ave,
                          double* volume) {
    const View* v = &b->view[view];
    const OmMatchView* twin = om_match_view(b->match);
    int nvert = b->mesh->nvert;
    AttachSolve solve;
    memset(b->attached, 0, (size_t)nvert);
    for (int i = 0; i < b->r->nnode; ++i) b->attached[b->under->vert[i]] = attached[i];
    for (int i = twin->ncorner; i < nvert; ++i) {  // between two attached ends
        const int* end = twin->mid_end + 2 * (size_t)(i - twin->ncorner);
        b->attached[i] = b->attached[end[0]] && b->attached[end[1]];
    }
    AttachMove move = {v->ngrasped, v->grasped, v->goal, b->attached};
    OM_TRY(om__attach_model_solve(b->model, &move, b->x, &solve));
    b->r->nloose += !solve.is_converged;
    double worst;
    om__attach_error(nvert, b->x, v->x_true, volume, &worst);
    *ave = om__places_distance(&v->places, b->x, v->scan.x) - b->r->rest[b->r->view[view].grasp];
    if (v->scan.npoint == 0) *ave = *volume;
    return OM_OK;
}

// DSC and TPR, and the mean errors over these views.
static OmStatus judge(Bench* b, int n, const int* view, PhantomEstimate* e) {
    if (!e->is_there) return OM_OK;
    if (!e->is_accepted) memset(e->attached, 0, sizeof e->attached);
    om__attach_score(b->r->nnode, NULL, e->attached, b->r->truth, &e->dsc, &e->tpr);
    e->ave = e->volume = 0;
    for (int i = 0; i < n; ++i) {
        double ave, volume;
        OM_TRY(move_twin(b, view[i], e->attached, &ave, &volume));
        e->ave += ave / n;
        e->volume += volume / n;
    }
    return OM_OK;
}

// ---- ways ---------------------------------------------------------------------------------------------------

static void set_reason(PhantomEstimate* e, const char* reason) {
    snprintf(e->reason, sizeof e->reason, "%.150s", reason);
}

static void take(Bench* b, const OmMatchEstimate* in, PhantomEstimate* out) {
    out->is_there = 1;
    out->is_accepted = in->is_accepted;
    set_reason(out, in->reason);
    for (int i = 0; i < b->r->nnode && in->probability; ++i) {
        int v = b->under->vert[i];
        out->probability[i] = (float)in->probability[v];
        out->attached[i] = in->attached[v];
    }
}

static OmStatus run_physics(Bench* b, int n, const OmAcquisition* acquisition,
                            PhantomEstimate* out) {
    OmMatchEstimate estimate = {0};
    OmStatus status = om_match_update(b->match, n, acquisition, NULL, &estimate);
    if (status >= 0) take(b, &estimate, out);
    om_match_estimate_done(&estimate);
    return status < 0 ? status : OM_OK;
}

// Probabilities of the network from n views, of which nlost have no correspondence.
static OmStatus take_network(Bench* b, const double* probability, int n, int nlost,
                             const char* reason, PhantomEstimate* out) {
    out->is_there = 1;
    out->is_accepted = nlost < n;
    out->nlost = nlost;
    if (!out->is_accepted) set_reason(out, reason);
    double p[PHANTOM_MAX_NODE], threshold = b->s->threshold;
    for (int i = 0; i < b->r->nnode; ++i) p[i] = probability[b->under->vert[i]];
    if (b->s->net) OM_TRY(om_banet_choose_threshold(b->r->nnode, p, OM_BANET_NEARLY, &threshold));
    for (int i = 0; i < b->r->nnode; ++i) {
        out->probability[i] = (float)p[i];
        out->attached[i] = p[i] >= threshold;
    }
    return OM_OK;
}

// The network of each acquisition, of all of them, and with physics. The caller frees the advice.
static OmStatus run_network(Bench* b, int n, const OmAcquisition* acquisition,
                            PhantomEstimate by[OM_STUDY_PHANTOM_NWAY], OmBanetAdvice* advice) {
    OmMatchEstimate estimate = {0};
    memset(b->attached, 0, (size_t)b->mesh->nvert);
    om_banet_updater_set_attached(b->updater, b->attached);
    OmStatus status = om_banet_update(b->updater, n, acquisition, NULL, &estimate, advice);
    if (status >= 0) {
        take(b, &estimate, &by[OM_STUDY_PHANTOM_ALL]);
        status = take_network(b, advice->probability, n, n - advice->nused, advice->reason,
                              &by[OM_STUDY_PHANTOM_FUSION]);
    }
    om_match_estimate_done(&estimate);
    return status < 0 ? status : OM_OK;
}

// The last NFRAME steps of the lift up to step i; the views of a lift follow each other.
static OmStatus eval_network(Bench* b, int i) {
    PhantomView* out = &b->r->view[i];
    int n = out->level < NFRAME ? out->level : NFRAME;
    OmAcquisition acquisition[NFRAME];
    OmBanetAdvice advice = {0};
    for (int k = 0; k < n; ++k) acquisition[k] = b->view[i - n + 1 + k].acquisition;
    OM_TRY(run_network(b, n, acquisition, out->by, &advice));
    const double* last = advice.view + (size_t)(n - 1) * (size_t)b->mesh->nvert;
    bool is_lost = true;
    for (int v = 0; v < b->mesh->nvert; ++v) is_lost = is_lost && last[v] <= 0;
    OmStatus status =
        take_network(b, last, 1, is_lost, advice.reason, &out->by[OM_STUDY_PHANTOM_NETWORK]);
    om_banet_advice_done(&advice);
    return status;
}

static OmStatus eval_view(Bench* b, int i) {
    PhantomView* out = &b->r->view[i];
    const unsigned char none[PHANTOM_MAX_NODE] = {0};
    OM_TRY(move_twin(b, i, b->r->truth, &out->same_ave, &out->same_volume));
    OM_TRY(move_twin(b, i, none, &out->zero_ave, &out->zero_volume));
    OM_TRY(run_physics(b, 1, &b->view[i].acquisition, &out->by[OM_STUDY_PHANTOM_PHYSICS]));
    if (b->updater) OM_TRY(eval_network(b, i));
    for (int w = 0; w < OM_STUDY_PHANTOM_NWAY; ++w) OM_TRY(judge(b, 1, &i, &out->by[w]));
    return OM_OK;
}

// ---- several grasps -------------------------------------------------------------------------------------------

// The view of each grasp at the highest step up to JOINT_LEVEL that all of them reach. Returns their number.
static int find_joint(Bench* b, int view[PHANTOM_NGRASP]) {
    int level = JOINT_LEVEL, n = 0;
    for (int g = 0; g < b->c->ngrasp; ++g)
        if (b->truth[g].head->nlevel < level) level = b->truth[g].head->nlevel;
    for (int i = 0; i < b->r->nview; ++i)
        if (b->r->view[i].level == level) view[n++] = i;
    b->r->joint_level = n > 0 ? level : 0;
    return n;
}

// The vertices that the network finds from every grasp (thesis 4.4), of the grasps with a correspondence.
static OmStatus intersect(Bench* b, const OmBanetAdvice* advice, PhantomEstimate* out) {
    out->is_there = 1;
    out->is_accepted = advice->nused > 0;
    out->nlost = advice->nacquisition - advice->nused;
    if (!out->is_accepted) set_reason(out, advice->reason);
    OM_TRY(om_banet_advice_intersect(advice, b->s->threshold, b->attached));
    for (int i = 0; i < b->r->nnode; ++i) out->attached[i] = b->attached[b->under->vert[i]];
    return OM_OK;
}

static OmStatus eval_joint_network(Bench* b, int n, const OmAcquisition* acquisition) {
    OmBanetAdvice advice = {0};
    PhantomEstimate* by = b->r->joint;
    OM_TRY(run_network(b, n, acquisition, by, &advice));
    OmStatus status = intersect(b, &advice, &by[OM_STUDY_PHANTOM_NETWORK]);
    om_banet_advice_done(&advice);
    return status;
}

static OmStatus eval_joint(Bench* b) {
    PhantomResult* r = b->r;
    int view[PHANTOM_NGRASP], n = find_joint(b, view);
    if (n == 0) return OM_OK;
    OmAcquisition acquisition[PHANTOM_NGRASP];
    for (int i = 0; i < n; ++i) {
        acquisition[i] = b->view[view[i]].acquisition;
        r->joint_same_ave += r->view[view[i]].same_ave / n;
        r->joint_same_volume += r->view[view[i]].same_volume / n;
    }
    OM_TRY(run_physics(b, n, acquisition, &r->joint[OM_STUDY_PHANTOM_PHYSICS]));
    if (b->updater) OM_TRY(eval_joint_network(b, n, acquisition));
    for (int w = 0; w < OM_STUDY_PHANTOM_NWAY; ++w) OM_TRY(judge(b, n, view, &r->joint[w]));
    return OM_OK;
}

OmStatus om__phantoms_eval(const Phantoms* s, const PhantomCase* c, PhantomResult* r) {
    memset(r, 0, sizeof *r);
    Bench* b = om_calloc(1, sizeof *b);
    if (!b) return OM_NO_MEMORY;
    b->s = s;
    b->c = c;
    b->r = r;
    OmStatus status;
    char name[64];
    om__phantoms_name(c, name, sizeof name);
    OM_TRY_DONE(make_twin(b));
    OM_TRY_DONE(make_views(b));
    for (int i = 0; i < r->nview; ++i) OM_TRY_DONE(eval_view(b, i));
    status = eval_joint(b);
done:
    bench_done(b);
    om_free(b);
    return status < 0 ? om_error_prefix(status, "%s", name) : OM_OK;
}
