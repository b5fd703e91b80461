// banet_view.c: displacement as a robot measures it: half of all training samples (way (b)).
//
// A twin with the truth's mesh, another stiffness and mostly wrong attachments is moved by the tool, as the robot's
// running twin is (om_body_step). A depth camera sees the truth (banet_picture.c). om_match_find_pairs finds the twin's
// point of each point of the scan, and the displacement follows. The errors are those of a robot: noise, calibration,
// holes, hidden parts, pairs that slide along the surface, folds that the twin has in another place.
//
// A lost result is mostly drawn again by the caller, and sometimes kept: a robot cannot always know.
//
// The twin has the element of the sample. Linear ones have stable neo-Hookean law: with neo-Hookean, elements that are
// crushed beside a grasp cut the steps of the twin, 5 s of processor time instead of 0.2 s in one of six samples.
// Quadratic ones have neo-Hookean law (1.7 s a sample; stable neo-Hookean 1.8 s).
//
// On 24 bodies, processor time and share of lost results: 0.57 s and 0.21 with 25 steps of 50 ms and restarts of lost
// results, 0.32 s and 0.21 with 15 steps of 80 ms and without restarts. The errors are the same. Of 19 lost results,
// restarts found 3, so another view is cheaper.
#include <math.h>
#include <string.h>

#include "banet/banet_view_internal.h"
#include "omentum/banet_sample.h"
#include "omentum/body.h"
#include "omentum/shape_meshing.h"
#include "omentum/tissue.h"

#define SEEN_WEIGHT 0.5  // sum of the weights of pairs at a vertex that is well seen
#define LEAST_POINTS 40  // of a scan
#define MAX_VIEW 6       // views drawn for one body
// Of a twin that follows the tool in 15 steps. Crushed elements cut them: 100 to 1,200 substeps in one view of 15,
// a quarter of the time of all views. Another view is drawn.
#define MAX_SUBSTEP 60
#define DENSITY 1000.0  // kg/m^3
#define GRAVITY 9.81

void om_banet_measure(const OmMatchView* view, const OmMatchPairs* pairs, double* u, double* seen) {
    om_match_pairs_displacement(view, pairs, u, seen);
    for (int i = 0; i < view->surface->nvert; ++i) {
        seen[i] = fmin(1, seen[i] / SEEN_WEIGHT);
        if (!(seen[i] > 0)) om_store3(u, i, om_vec3(0, 0, 0));
    }
}

BanetViewDef om__banet_view_default_def(void) {
    return (BanetViewDef){.chance = {[BELIEF_SAME] = 0.06,
                                     [BELIEF_NONE] = 0.08,
                                     [BELIEF_FEWER] = 0.22,
                                     [BELIEF_MORE] = 0.22,
                                     [BELIEF_ELSEWHERE] = 0.2,
                                     [BELIEF_NEARLY] = 0.22},
                          .stiffness = {0.8, 1.25},
                          .distance = {0.15, 0.35},
                          .width = 320,
                          .height = 240,
                          .fov = 0.9,
                          .min_tissue = 1500,
                          .min_grasp = 30,
                          .max_camera = 6,
                          .has_tool = true,
                          .noise = 1,
                          .max_hole = 5,
                          .tool_shift = 2e-4,
                          .camera_shift = 5e-4,
                          .camera_turn = 0.003,
                          .nstep = 12,
                          .nsettle = 3,
                          .dt = 0.08,
                          .nrestart = 0,
                          .keep_lost = 0.15};
}

// ---- the twin ---------------------------------------------------------------------------------------------------

typedef struct Twin {  // twin_done frees
    OmScene scene;
    OmSite site;
    OmMeshSet set;
    OmTetMesh coarse;  // of quadratic elements: the mesh without the middles of edges; else empty
    OmMeshSet coarse_set;
    unsigned char* attached;  // of vertices of the surface
    int *list, *coarse_list;  // of the sets
    double* x;                // (mesh->nvert x 3)
} Twin;

static void twin_done(Twin* twin) {
    twin->coarse.nset = 0;  // its set is part of the twin
    twin->coarse.set = NULL;
    om_tet_mesh_done(&twin->coarse);
    om_free(twin->coarse_list);
    om_free(twin->attached);
    om_free(twin->list);
    om_free(twin->x);
}

// Mark a random patch of `share` of the vertices of the surface, or of the attached vertices alone.
static OmStatus mark_patch(const BanetTruth* t, bool is_within, double share, OmRng* rng,
                           unsigned char* mark) {
    int ncandidate = 0, n = 0;
    int *candidate = NULL, *vert = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(candidate, t->surface->nvert);
    for (int i = 0; i < t->surface->nvert; ++i)
        if (!is_within || t->attached[i]) candidate[ncandidate++] = i;
    OmPatchDef def = om_patch_default_def(share, om_rng_u32(rng));
    if (ncandidate > 0)
        OM_TRY_DONE(om_surface_random_patch(t->surface, candidate, ncandidate, &def, &vert, &n));
    for (int i = 0; i < n; ++i) mark[vert[i]] = 1;
done:
    om_free(candidate);
    om_free(vert);
    return status;
}

static BanetBelief draw_belief(const BanetViewDef* def, OmRng* rng) {
    double sum = 0;
    for (int k = 0; k < BELIEF_COUNT; ++k) sum += def->chance[k];
    double at = sum * om_rng_uniform(rng);
    for (int k = 0; k < BELIEF_COUNT; ++k) {
        if (at < def->chance[k]) return (BanetBelief)k;
        at -= def->chance[k];
    }
    return BELIEF_NONE;
}

// Shares of a patch: of the truth's attachments that are kept, and of the surface that is added.
static OmStatus draw_attached(const BanetTruth* t, BanetBelief belief, OmRng* rng,
                              unsigned char* attached) {
    size_t n = (size_t)t->surface->nvert;
    memset(attached, 0, n);
    double kept = om_rng_range(rng, 0.2, 0.8), added = om_rng_range(rng, 0.05, 0.4);
    if (belief == BELIEF_NEARLY) kept = om_rng_range(rng, 0.8, 1), added = 0.03;
    if (belief == BELIEF_SAME || belief == BELIEF_MORE) memcpy(attached, t->attached, n);
    if (belief == BELIEF_FEWER || belief == BELIEF_NEARLY)
        OM_TRY(mark_patch(t, true, kept, rng, attached));
    if (belief == BELIEF_MORE || belief == BELIEF_ELSEWHERE || belief == BELIEF_NEARLY)
        OM_TRY(mark_patch(t, false, added, rng, attached));
    // also around it: the middle of an edge between attached vertices is attached
    for (int k = 0; k < t->surface->ntri; ++k) {
        const int* v = t->surface->tri_vert + 3 * (size_t)k;
        if (t->grasped[v[0]] || t->grasped[v[1]] || t->grasped[v[2]])
            attached[v[0]] = attached[v[1]] = attached[v[2]] = 0;
    }
    return OM_OK;
}

// The box of the rest shape in the task frame.
static OmVec3 find_half_size(const BanetTruth* t, OmPose pose_world_task) {
    OmPose pose_task_world = om_pose_inverse(pose_world_task);
    OmVec3 most = om_vec3(0, 0, 0);
    for (int v = 0; v < t->mesh->nvert; ++v) {
        OmVec3 p = om_pose_apply(pose_task_world, om_load3(t->mesh->x, v));
        most = om_max3(most, om_vec3(fabs(p.x), fabs(p.y), fabs(p.z)));
    }
    return most;
}

static OmPose find_task(const BanetTruth* t) {
    OmPose pose = t->has_board ? t->pose_world_board : om_pose_identity();
    OmVec3 sum = om_vec3(0, 0, 0), up = om_quat_rotate(pose.q, om_vec3(0, 0, 1));
    for (int v = 0; v < t->mesh->nvert; ++v) sum = om_add(sum, om_load3(t->mesh->x, v));
    OmVec3 middle = om_scale(1.0 / t->mesh->nvert, sum);  // a mesh has vertices
    double height = t->has_board ? om_dot(om_sub(middle, pose.p), up) : 0;
    return (OmPose){om_madd(middle, -height, up), pose.q};
}

// The quadratic elements that the mesh of the truth divides by eight: om_tissue_create divides them in the same way.
// Call after `set` is complete.
static OmStatus make_coarse(const BanetTruth* t, Twin* twin) {
    OmTetMesh* mesh = &twin->coarse;
    int ntet = t->mesh->ntet / 8, nvert = 0, nheld = 0;
    for (int e = 0; e < ntet; ++e)
        for (int c = 0; c < 4; ++c)
            if (t->node[10 * e + c] >= nvert) nvert = t->node[10 * e + c] + 1;
    OM_TRY(om_tet_mesh_init(mesh, nvert, ntet));
    OM_ALLOC(twin->coarse_list, twin->set.nvert);
    memcpy(mesh->x, t->mesh->x, 3 * (size_t)nvert * sizeof *mesh->x);
    for (int e = 0; e < ntet; ++e) {
        memcpy(mesh->tet_vert + 4 * (size_t)e, t->node + 10 * (size_t)e, 4 * sizeof *t->node);
        mesh->tet_label[e] = t->mesh->tet_label[8 * e];
    }
    for (int i = 0; i < twin->set.nvert; ++i)
        if (twin->list[i] < nvert) twin->coarse_list[nheld++] = twin->list[i];
    twin->coarse_set = (OmMeshSet){.name = "attachment", .nvert = nheld, .vert = twin->coarse_list};
    mesh->nset = 1;
    mesh->set = &twin->coarse_set;
    // the vertices of an element that has settled on the board may be inverted where the element is not
    return om_tet_mesh_validate(mesh) == OM_OK
               ? OM_OK
               : om_error_prefix(OM_NOT_CONVERGED, "banet: no twin");
}

// The twin knows board and weight, but neither stiffness nor attachments.
static OmStatus twin_init(const BanetViewDef* def, const BanetTruth* t, OmRng* rng,
                          BanetViewReport* report, Twin* twin) {
    OmStatus status = OM_OK;
    int n = 0;
    OM_ALLOC_DONE(twin->attached, t->surface->nvert);
    OM_ALLOC_DONE(twin->list, t->surface->nvert);
    OM_ALLOC_DONE(twin->x, 3 * (size_t)t->mesh->nvert);
    report->belief = draw_belief(def, rng);
    OM_TRY_DONE(draw_attached(t, report->belief, rng, twin->attached));
    for (int i = 0; i < t->surface->nvert; ++i) {
        if (!twin->attached[i]) continue;
        twin->list[n++] = t->surface_vert[i];
        report->nright += t->attached[i];
    }
    report->nwrong = n - report->nright;
    twin->set = (OmMeshSet){.name = "attachment", .nvert = n, .vert = twin->list};
    twin->scene = om_scene_default();
    twin->scene.tissue.law = t->node ? OM_NEO_HOOKEAN : OM_STABLE_NEO_HOOKEAN;
    twin->scene.tissue.element = t->node ? OM_ELEMENT_QUADRATIC : OM_ELEMENT_LINEAR;
    twin->scene.tissue.friction = 0;
    OmSite* site = &twin->site;
    site->role = OM_SITE_TWIN;
    site->mesh = *t->mesh;
    site->mesh.nset = 1;
    site->mesh.set = &twin->set;
    site->pose_world_task = site->pose_world_field = find_task(t);
    site->half_size = find_half_size(t, site->pose_world_task);
    site->has_ground = t->has_board;
    site->young = t->young * exp(om_rng_range(rng, log(def->stiffness[0]), log(def->stiffness[1])));
    site->poisson = t->poisson;
    site->density = t->density;
    site->gravity = t->gravity;
    if (t->node) status = make_coarse(t, twin);
done:
    return status;
}

// ---- the twin follows the tool ----------------------------------------------------------------------------------

static OmStatus follow(const BanetViewDef* def, const BanetTool* tool, Twin* twin, int* nsubstep) {
    OmBody* body = NULL;
    OmSite site = twin->site;
    OmStatus status;
    int nheld = 0;
    if (twin->coarse.ntet > 0) site.mesh = twin->coarse;
    OM_TRY_DONE(om_body_create(&twin->scene, &site, 1, &body));
    OM_TRY_DONE(om_body_grasp(body, 0, tool->pose_world_grasp, tool->radius, &nheld));
    for (int k = 1; k <= def->nstep + def->nsettle; ++k) {
        double share = fmin(1, (double)k / def->nstep);
        OmBodyReport report;
        OmPose goal = om_pose_lerp(tool->pose_world_grasp, tool->pose_world_now, share);
        OM_TRY_DONE(om_body_move(body, 0, goal));
        OM_TRY_DONE(om_body_step(body, def->dt, &report));
        *nsubstep += report.substeps;
        OM_CHECK_DONE(*nsubstep <= MAX_SUBSTEP, OM_NOT_CONVERGED,
                      "banet: the twin needs more than %d substeps", MAX_SUBSTEP);
    }
    memcpy(twin->x, om_body_x(body), 3 * (size_t)twin->site.mesh.nvert * sizeof *twin->x);
    status = OM_OK;  // a step that did not converge is part of a running twin
done:
    om_body_destroy(body);
    return status;
}

// ---- pairs ------------------------------------------------------------------------------------------------------

// From the twin's surface to that of the truth: the same vertices of the mesh, perhaps in another order.
static OmStatus write(const BanetTruth* t, const OmMatchView* view, const OmMatchPairs* pairs,
                      double* u, double* seen) {
    double *all = NULL, *weight = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(all, 3 * (size_t)view->surface->nvert);
    OM_ALLOC_DONE(weight, view->surface->nvert);
    om_banet_measure(view, pairs, all, weight);
    for (int i = 0; i < t->surface->nvert; ++i) {
        int at = view->surface_of[t->surface_vert[i]];
        OM_CHECK_DONE(at >= 0, OM_INVALID, "banet: vertex %d of the surface is inside the mesh", i);
        om_store3(u, i, om_load3(all, at));
        seen[i] = weight[at];
    }
done:
    om_free(all);
    om_free(weight);
    return status;
}

static OmStatus measure(const BanetViewDef* view, const BanetTruth* t, const BanetTool* tool,
                        const Twin* twin, const OmScan* scan, OmPose pose_world_now, double* u,
                        double* seen, BanetViewReport* report) {
    OmMatch* match = NULL;
    OmMatchLive* live = NULL;
    OmMatchPairs pairs = {0};
    OmStatus status;
    double begin = om_clock_now();
    // linear elements of all vertices follow the scan; with neo-Hookean law that takes twice the time
    OmScene scene = twin->scene;
    scene.tissue.law = OM_STABLE_NEO_HOOKEAN;
    scene.tissue.element = OM_ELEMENT_LINEAR;
    OmMatchDef def = om_match_default_def(&scene, &twin->site);
    def.nhypothesis = 0;
    OM_TRY_DONE(om_match_create(&def, &match));
    OmMatchLiveDef how = om_match_live_default_def(match);
    how.nrestart = view->nrestart;
    OM_TRY_DONE(om_match_live_create(&how, &live));
    double end = om_clock_now();
    report->make_s = end - begin;
    OmMatchGrasp grasp = {.pose_world_grasp = tool->pose_world_grasp,
                          .pose_world_now = pose_world_now,
                          .radius = tool->radius};
    OM_TRY_DONE(om_match_find_pairs(live, scan, 1, &grasp, twin->x, &pairs));
    report->pair_s = om_clock_now() - end;
    report->is_lost = pairs.is_lost;
    report->is_restarted = pairs.is_restarted;
    report->median = pairs.median, report->p95 = pairs.p95;
    report->paired = pairs.paired, report->empty = pairs.empty;
    OM_TRY_DONE(write(t, om_match_view(match), &pairs, u, seen));
    status = OM_OK;
done:
    om_match_pairs_done(&pairs);
    om_match_live_destroy(live);
    om_match_destroy(match);
    return status;
}

OmStatus om__banet_view_measure(const BanetViewDef* def, const BanetTruth* t, OmRng* rng, double* u,
                                double* seen, BanetViewReport* out) {
    BanetViewReport report = {0};
    BanetTool tool;
    Twin twin = {0};
    OmScan scan = {0};
    OmStatus status;
    bool keeps_lost = om_rng_uniform(rng) < def->keep_lost;
    OM_TRY_DONE(om__banet_tool_make(t, rng, &tool));
    status = twin_init(def, t, rng, &report, &twin);
    if (status != OM_OK) goto done;
    double begin = om_clock_now();
    status = om__banet_look(def, t, &tool, &twin.site, rng, &scan, &report.npixel);
    if (status != OM_OK) goto done;
    report.npoint = scan.npoint;
    double end = om_clock_now();
    report.see_s = end - begin;
    OM_CHECK_DONE(scan.npoint >= LEAST_POINTS, OM_NOT_CONVERGED,
                  "banet: the scan has %d points; %d are needed", scan.npoint, LEAST_POINTS);
    OmPose now = tool.pose_world_now;
    OmVec3 shift = om_vec3(om_rng_normal(rng), om_rng_normal(rng), om_rng_normal(rng));
    now.p = om_madd(now.p, def->tool_shift, shift);
    status = follow(def, &tool, &twin, &report.nsubstep);
    if (status != OM_OK) goto done;
    report.follow_s = om_clock_now() - end;
    OM_TRY_DONE(measure(def, t, &tool, &twin, &scan, now, u, seen, &report));
    OM_CHECK_DONE(!report.is_lost || keeps_lost, OM_NOT_CONVERGED, "banet: the pairs are lost");
    status = OM_OK;
done:
    om_scan_done(&scan);
    twin_done(&twin);
    if (out) *out = report;
    return status;
}

// ---- of a sample ------------------------------------------------------------------------------------------------

OmStatus om__banet_view(OmRng* rng, OmBanetSample* s) {
    BanetViewDef def = om__banet_view_default_def();
    BanetTruth truth = {.mesh = &s->mesh,
                        .node = s->node,
                        .surface = &s->surface,
                        .surface_vert = s->surface_vert,
                        .x = s->x,
                        .attached = s->attached,
                        .grasped = s->grasped,
                        .young = s->material.young,
                        .poisson = s->material.poisson,
                        .density = DENSITY,
                        .has_board = s->has_board,
                        .pose_world_board = {om_vec3(0, 0, s->board), om_quat_identity()}};
    if (s->has_board) truth.gravity = om_vec3(0, 0, -GRAVITY);
    OmStatus status = OM_NOT_CONVERGED;
    for (int k = 0; k < MAX_VIEW && status == OM_NOT_CONVERGED; ++k)
        status = om__banet_view_measure(&def, &truth, rng, s->u, s->seen, NULL);
    int nseen = 0;
    for (int i = 0; i < s->surface.nvert; ++i) nseen += s->seen[i] > 0;
    s->visible = (double)nseen / s->surface.nvert;
    return status;
}
