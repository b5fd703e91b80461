// study_attachments.c: attachments estimated from one and from three views of twelve layouts of the sheet.
//
// The twin knows of no attachment. The true ones are those of the layout on the twin's mesh. DSC (4.3) and TPR (4.6)
// are taken over the vertices of the twin's underside. AVE (4.5) and MVE (4.7) compare the twin, given the attachments
// and moved by the measured tips, with the truth at the same material points: all vertices. The twin is moved by the
// same body for every guess, so the rows of the table differ by their attachments alone.
#include <math.h>
#include <string.h>

#include "studies/study_attachments.h"

#define COOKIE 0x57d1a77au
#define STILL 0.001        // m
#define SETTLE_SPEED 1e-3  // m/s
#define SETTLE_TIME 3      // s

const char* const om__study_guess_name[OM_STUDY_NGUESS] = {
    "zero",   "all",        "same",    "still",         "still_three",
    "single", "three",      "network", "network_fused", "network_crossing",
    "joint",  "joint_three"};
const char* const om__study_guess_title[OM_STUDY_NGUESS] = {"Zero: none",
                                                            "All: the whole underside",
                                                            "Same: the true ones",
                                                            "Still: true motion below 1 mm",
                                                            "Still in three views",
                                                            "Physics, one view",
                                                            "Physics, three views",
                                                            "Network, one view",
                                                            "Network, three views fused",
                                                            "Network, three views intersected",
                                                            "Network and physics, one view",
                                                            "Network and physics, three views"};

OmStudyAttachmentsDef om_study_attachments_default_def(const char* out_dir) {
    return (OmStudyAttachmentsDef){.out_dir = out_dir, .set = 1, .cookie = COOKIE};
}

static OmStatus validate(const OmStudyAttachmentsDef* d) {
    const StudyRange range[] = {{"set", d->set, 1, MATCH_NSET}};
    return STUDY_CHECK("attachments study", d, COOKIE, range);
}

// ---- one layout -----------------------------------------------------------------------------------

typedef struct View {
    MatchSetup setup;
    MatchTruth truth;
    MatchTwin twin;  // without attachments, moved
    OmScan scan;
    double* x;  // the truth at the twin's vertices, m       (nvert x 3)
} View;

typedef struct Layout {
    const Att* s;
    AttResult* r;
    View view[MATCH_NGRASP];
    OmScene scene;
    OmSite site;  // of the twin, without attachments
    const OmMeshSet* under;
    OmMatch* match;
    OmBanetUpdater* updater;  // null: no network
    double threshold;         // of the network
    OmBody* body;
    OmAcquisition acquisition[MATCH_NGRASP];
    int* vert;          // scratch of guesses             (underside)
    double* anchor;     //                                (underside x 3)
    double* stiffness;  //                                (underside)
} Layout;

static void layout_done(Layout* l) {
    for (int g = 0; g < MATCH_NGRASP; ++g) {
        View* v = &l->view[g];
        om__match_truth_done(&v->truth);
        om__match_twin_done(&v->twin);
        om_scan_done(&v->scan);
        om_free(v->x);
    }
    om_banet_updater_destroy(l->updater);
    om_match_destroy(l->match);
    om_body_destroy(l->body);
    om_site_done(&l->site);
    om_free(l->vert);
    om_free(l->anchor);
    om_free(l->stiffness);
}

static OmStatus make_view(Layout* l, int layout, int g) {
    static const MatchCase whole = {.name = "whole", .view = VIEW_FULL, .seen = 1};
    View* v = &l->view[g];
    const OmStudyAttachmentsDef* def = l->s->def;
    v->setup = om__match_layout_setup(layout, g, l->s->cells);
    OM_TRY(om__match_truth_get(&v->setup, def->out_dir, def->nworker, NULL, &v->truth));
    OM_TRY(om__match_twin_get(&v->setup, BELIEF_NONE, &v->truth, 1, def->nworker, &v->twin));
    clock_t begin = clock();
    OM_TRY(om__match_scan(&v->truth, &v->twin.site, &v->setup.move, &whole, 0, &v->scan));
    l->r->scan_ms[g] = om__processor_ms(begin);
    l->r->npoint[g] = v->scan.npoint;
    l->r->seen[g] = om__hand_share_facing(&v->truth.surface, v->truth.vert, v->truth.x,
                                          v->truth.head.camera.pose_world_camera.p);
    int nvert = v->twin.site.mesh.nvert;
    OM_ALLOC(v->x, 3 * (size_t)nvert);
    OM_TRY(om__match_carry(&v->truth, nvert, v->twin.site.mesh.x, v->x));
    OmAcquisition* a = &l->acquisition[g];
    *a = (OmAcquisition){.scan = v->scan, .time = v->truth.head.time, .x_twin = v->twin.nodes};
    a->ngrasp = om__match_grasps(&v->truth, &v->setup.move, a->grasp);
    return OM_OK;
}

// The true label of each vertex of the underside: the layout on the twin's own mesh.
static OmStatus make_truth(Layout* l, int layout) {
    MatchSetup setup = om__match_layout_setup(layout, 0, l->s->cells);
    AttResult* r = l->r;
    OmScene scene;
    OmSite site = {0};
    OM_TRY(om__match_build_site(&setup, BELIEF_NONE, OM_SITE_TWIN, &l->scene, &l->site));
    l->under = om_tet_mesh_find_set(&l->site.mesh, "underside");
    r->nnode = l->under->nvert;
    OM_CHECK(r->nnode <= ATT_MAX_NODE, OM_INVALID, "%d vertices in the underside", r->nnode);
    OM_TRY(om__match_build_site(&setup, BELIEF_RIGHT, OM_SITE_TWIN, &scene, &site));
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    OmPose task = om_pose_inverse(site.pose_world_task);
    for (int i = 0, k = 0; i < r->nnode; ++i) {
        int vert = l->under->vert[i];  // both sets ascend
        while (k < held->nvert && held->vert[k] < vert) ++k;
        r->truth[i] = k < held->nvert && held->vert[k] == vert;
        r->share += (double)r->truth[i] / r->nnode;
        OmVec3 p = om_pose_apply(task, om_load3(site.mesh.x, vert));
        r->node_x[i][0] = p.x;
        r->node_x[i][1] = p.y;
    }
    om_site_done(&site);
    OM_ALLOC(l->vert, (size_t)r->nnode);
    OM_ALLOC(l->anchor, 3 * (size_t)r->nnode);
    OM_ALLOC(l->stiffness, (size_t)r->nnode);
    return OM_OK;
}

// ---- the twin with a guess --------------------------------------------------------------------------

// The body with these attachments of the underside, at rest, then moved as view g was.
// spring: N/m, of each vertex of the underside; null: held still
static OmStatus move_twin(Layout* l, const unsigned char* attached, const double* spring, int g,
                          OmStudyGuess guess) {
    View* v = &l->view[g];
    const MatchHead* head = &v->truth.head;
    int n = 0, nheld;
    for (int i = 0; i < l->r->nnode; ++i) {
        if (!attached[i]) continue;
        l->vert[n] = l->under->vert[i];
        om_store3(l->anchor, n, om_load3(l->site.mesh.x, l->vert[n]));
        l->stiffness[n++] = spring ? spring[i] : 0;
    }
    om_body_reset(l->body);
    OM_TRY(om_body_set_attachment(l->body, n, l->vert, l->anchor, l->stiffness));
    OmStatus status = om_body_settle(l->body, head->dt, SETTLE_SPEED, SETTLE_TIME);
    if (status < 0) return status;
    OM_TRY(om_body_grasp(l->body, 0, head->grasp_tip[0], l->scene.task.grasp_radius, &nheld));
    OM_TRY(om__match_follow(l->body, &v->setup.move, head, head->ntick));
    om_body_release(l->body, 0);
    om__attach_error(v->twin.site.mesh.nvert, om_body_x(l->body), v->x, &l->r->ave[guess][g],
                     &l->r->mve[guess][g]);
    return OM_OK;
}

// Vertices of the underside that the truth moves by less than STILL in these views.
static void find_still(const Layout* l, int first, int nview, unsigned char* still) {
    for (int i = 0; i < l->r->nnode; ++i) {
        int vert = l->under->vert[i];
        still[i] = 1;
        for (int g = first; g < first + nview; ++g)
            if (om_distance(om_load3(l->view[g].x, vert), om_load3(l->site.mesh.x, vert)) >= STILL)
                still[i] = 0;
    }
}

static OmStatus move_baselines(Layout* l) {
    unsigned char guess[ATT_MAX_NODE];
    for (int g = 0; g < MATCH_NGRASP; ++g) {
        memset(guess, 0, sizeof guess);
        OM_TRY(move_twin(l, guess, NULL, g, OM_STUDY_ZERO));
        memset(guess, 1, sizeof guess);
        OM_TRY(move_twin(l, guess, NULL, g, OM_STUDY_ALL));
        OM_TRY(move_twin(l, l->r->truth, NULL, g, OM_STUDY_SAME));
        OM_TRY(move_twin(l, l->r->still[g], NULL, g, OM_STUDY_STILL));
        OM_TRY(move_twin(l, l->r->still[MATCH_NGRASP], NULL, g, OM_STUDY_STILL_THREE));
    }
    return OM_OK;
}

// ---- updates ----------------------------------------------------------------------------------------

typedef struct Views {  // of an update: one, or all
    int first, n;
    OmStudyGuess guess;
} Views;

static Views views_of(int k, OmStudyGuess single, OmStudyGuess three) {
    bool is_single = k < MATCH_NGRASP;
    return (Views){is_single ? k : 0, is_single ? 1 : MATCH_NGRASP, is_single ? single : three};
}

// The twin with the attachments of u, moved as each of the views.
static OmStatus move_all(Layout* l, AttUpdate* u, const double* spring, Views v) {
    om__attach_score(l->r->nnode, NULL, u->attached, l->r->truth, &u->dsc, &u->tpr);
    for (int g = v.first; g < v.first + v.n; ++g)
        OM_TRY(move_twin(l, u->attached, spring, g, v.guess));
    return OM_OK;
}

static OmStatus take_estimate(Layout* l, const OmMatchEstimate* e, Views v, AttUpdate* u) {
    double spring[ATT_MAX_NODE], mve;
    u->is_accepted = e->is_accepted;
    snprintf(u->reason, sizeof u->reason, "%s", e->reason);
    u->fit_ms = e->fit_ms;
    u->infer_ms = e->infer_ms;
    u->check_ms = e->check_ms;
    u->seen_share = e->seen_share;
    u->moved_share = e->moved_share;
    u->after_median = e->after_median;
    u->choice = e->choice;
    for (int i = 0; i < l->r->nnode && e->probability; ++i) {
        int vert = l->under->vert[i];
        u->probability[i] = (float)e->probability[vert];
        u->uncertainty[i] = (float)e->uncertainty[vert];
        u->attached[i] = u->is_accepted && e->attached[vert];
        spring[i] = e->stiffness[vert];
    }
    for (int k = 0; k < v.n; ++k) {
        u->own_ave[v.first + k] = -1;
        if (e->x && u->is_accepted)
            om__attach_error(e->nvert, e->x + 3 * (size_t)k * (size_t)e->nnode,
                             l->view[v.first + k].x, &u->own_ave[v.first + k], &mve);
    }
    return move_all(l, u, spring, v);
}

static OmStatus run_update(Layout* l, int k) {
    AttUpdate* u = &l->r->update[k];
    Views v = views_of(k, OM_STUDY_SINGLE, OM_STUDY_THREE);
    OmMatchEstimate estimate = {0};
    clock_t begin = clock();
    OmStatus status = om_match_update(l->match, v.n, l->acquisition + v.first, NULL, &estimate);
    u->ms = om__processor_ms(begin);
    if (status >= 0) status = take_estimate(l, &estimate, v, u);
    om_match_estimate_done(&estimate);
    return status;
}

// The network's own attachments, without physics; probability: of the mesh's vertices.
static OmStatus take_network(Layout* l, const double* probability, int nused, Views v,
                             AttUpdate* u) {
    u->is_accepted = nused > 0;
    u->nlost = v.n - nused;
    if (nused == 0) snprintf(u->reason, sizeof u->reason, "no correspondence");
    double *p, threshold = 1;
    OM_ALLOC(p, (size_t)l->r->nnode);
    for (int i = 0; i < l->r->nnode; ++i) p[i] = probability[l->under->vert[i]];
    OmStatus status = om_banet_choose_threshold(l->r->nnode, p, OM_BANET_NEARLY, &threshold);
    for (int i = 0; i < l->r->nnode; ++i) {
        u->probability[i] = (float)p[i];
        u->attached[i] = p[i] >= threshold;
    }
    om_free(p);
    return status < 0 ? status : move_all(l, u, NULL, v);
}

// The network's three views, intersected; views without correspondence are left out.
static OmStatus cross(Layout* l, const OmBanetAdvice* advice) {
    unsigned char* attached;
    Views v = {0, MATCH_NGRASP, OM_STUDY_CROSSING};
    OM_ALLOC(attached, advice->nvert);
    OmStatus status = om_banet_advice_intersect(advice, l->threshold, attached);
    AttUpdate* u = &l->r->crossing;
    u->is_accepted = advice->nused > 0;
    u->nlost = MATCH_NGRASP - advice->nused;
    if (!u->is_accepted) snprintf(u->reason, sizeof u->reason, "no correspondence");
    for (int i = 0; i < l->r->nnode && status >= 0; ++i)
        u->attached[i] = attached[l->under->vert[i]];
    om_free(attached);
    if (status >= 0) status = move_all(l, u, NULL, v);
    return status;
}

static OmStatus run_joint(Layout* l, int k) {
    AttUpdate* u = &l->r->joint[k];
    Views v = views_of(k, OM_STUDY_JOINT, OM_STUDY_JOINT_THREE);
    Views alone = views_of(k, OM_STUDY_NETWORK, OM_STUDY_FUSION);
    OmMatchEstimate estimate = {0};
    OmBanetAdvice advice = {0};
    OmStatus status = OM_OK;
    unsigned char* none = om_calloc((size_t)l->site.mesh.nvert, 1);
    if (!none) return OM_NO_MEMORY;
    om_banet_updater_set_attached(l->updater, none);  // each update is the first one
    clock_t begin = clock();
    OM_TRY_DONE(
        om_banet_update(l->updater, v.n, l->acquisition + v.first, NULL, &estimate, &advice));
    u->ms = om__processor_ms(begin);
    OM_TRY_DONE(take_estimate(l, &estimate, v, u));
    OM_TRY_DONE(take_network(l, advice.probability, advice.nused, alone, &l->r->network[k]));
    // All but the second estimate of physics: its share of the wall clock, of the processor time.
    l->r->network[k].ms = u->ms * (1 - (u->fit_ms + u->infer_ms + u->check_ms) / advice.total_ms);
    if (k == MATCH_NGRASP) {
        OM_TRY_DONE(cross(l, &advice));
        l->r->crossing.ms = l->r->network[k].ms;
    }
done:
    om_banet_advice_done(&advice);
    om_match_estimate_done(&estimate);
    om_free(none);
    return status;
}

static OmStatus create_updater(Layout* l) {
    OmBanetUpdateDef def = om_banet_update_default_def(l->match);
    def.net = l->s->net;
    def.is_corrected = true;
    l->threshold = om_banet_net_threshold(l->s->net);
    return om_banet_updater_create(&def, &l->updater);
}

static OmStatus run_layout(void* ctx, int index, void* result) {
    const Att* s = ctx;
    AttResult* r = result;
    const int layout = s->first + index;
    Layout l = {.s = s, .r = r};
    OmMatchDef def;
    OmStatus status;
    OM_TRY_DONE(make_truth(&l, layout));
    for (int g = 0; g < MATCH_NGRASP; ++g) OM_TRY_DONE(make_view(&l, layout, g));
    for (int k = 0; k < ATT_NUPDATE; ++k) {
        bool is_single = k < MATCH_NGRASP;
        find_still(&l, is_single ? k : 0, is_single ? 1 : MATCH_NGRASP, r->still[k]);
    }
    OM_TRY_DONE(om_body_create(&l.scene, &l.site, s->def->nworker, &l.body));
    OM_TRY_DONE(move_baselines(&l));
    def = om_match_default_def(&l.scene, &l.site);
    OM_TRY_DONE(om_match_create(&def, &l.match));
    for (int k = 0; k < ATT_NUPDATE; ++k) OM_TRY_DONE(run_update(&l, k));
    if (!s->net) goto done;
    OM_TRY_DONE(create_updater(&l));
    for (int k = 0; k < ATT_NUPDATE; ++k) OM_TRY_DONE(run_joint(&l, k));
done:
    layout_done(&l);
    if (status < 0) return om_error_prefix(status, "layout %d", layout + 1);
    return OM_OK;
}

// ---- all layouts ------------------------------------------------------------------------------------

static bool is_of_three(OmStudyGuess guess) {
    return guess == OM_STUDY_STILL_THREE || guess == OM_STUDY_THREE || guess == OM_STUDY_FUSION ||
           guess == OM_STUDY_CROSSING || guess == OM_STUDY_JOINT_THREE;
}

static const AttUpdate* update_of(const AttResult* r, OmStudyGuess guess, int g) {
    switch (guess) {
    case OM_STUDY_SINGLE: return &r->update[g];
    case OM_STUDY_THREE: return &r->update[MATCH_NGRASP];
    case OM_STUDY_NETWORK: return &r->network[g];
    case OM_STUDY_FUSION: return &r->network[MATCH_NGRASP];
    case OM_STUDY_CROSSING: return &r->crossing;
    case OM_STUDY_JOINT: return &r->joint[g];
    case OM_STUDY_JOINT_THREE: return &r->joint[MATCH_NGRASP];
    default: return NULL;
    }
}

static void summarise_guess(const Att* s, OmStudyGuess guess, OmStudyGuessResult* out) {
    enum { MAX = MATCH_NLAYOUT * MATCH_NGRASP };
    double dsc[MAX], tpr[MAX], ave[MAX], mve[MAX], ms[MAX];
    int nscore = 0, nmove = 0;
    unsigned char every[ATT_MAX_NODE], none[ATT_MAX_NODE] = {0};
    memset(every, 1, sizeof every);
    const bool is_update = guess >= OM_STUDY_SINGLE, is_three = is_of_three(guess);
    out->is_there = guess < OM_STUDY_NETWORK || s->net;
    if (!out->is_there) return;
    for (int i = 0; i < s->nlayout; ++i) {
        const AttResult* r = &s->result[i];
        for (int g = 0; g < MATCH_NGRASP; ++g) {
            ave[nmove] = r->ave[guess][g];
            mve[nmove++] = r->mve[guess][g];
            if (is_three && g > 0) continue;
            ms[nscore] = 0;
            if (is_update) {
                const AttUpdate* u = update_of(r, guess, g);
                dsc[nscore] = u->dsc;
                tpr[nscore] = u->tpr;
                ms[nscore] = u->ms;
                out->nrefused += !u->is_accepted;
                out->nlost += u->nlost;
            } else {
                const unsigned char* const list[] = {none, every, r->truth, r->still[g],
                                                     r->still[MATCH_NGRASP]};
                const unsigned char* found = list[guess];
                om__attach_score(r->nnode, NULL, found, r->truth, &dsc[nscore], &tpr[nscore]);
            }
            ++nscore;
        }
    }
    out->dsc = om__study_sample(dsc, nscore);
    out->tpr = om__study_sample(tpr, nscore);
    out->ave = om__study_sample(ave, nmove);
    out->mve = om__study_sample(mve, nmove);
    out->ms = om__study_sample(ms, nscore).median;
}

static int bin_of(double value) {
    int k = (int)floor(value * OM_STUDY_NBIN);
    return k < 0 ? 0 : k >= OM_STUDY_NBIN ? OM_STUDY_NBIN - 1 : k;
}

// Are probabilities and uncertainties what they say?
static void calibrate(const Att* s, OmStudyAttachmentsSummary* sum) {
    for (int i = 0; i < s->nlayout; ++i) {
        const AttResult* r = &s->result[i];
        for (int g = 0; g < MATCH_NGRASP; ++g) {
            const AttUpdate* u = &r->update[g];
            for (int k = 0; k < r->nnode && u->is_accepted; ++k) {
                int p = bin_of((double)u->probability[k]), d = bin_of((double)u->uncertainty[k]);
                ++sum->bin_count[p];
                sum->bin_share[p] += r->truth[k];
                ++sum->doubt_count[d];
                sum->doubt_wrong[d] += u->attached[k] != r->truth[k];
            }
        }
    }
    for (int b = 0; b < OM_STUDY_NBIN; ++b) {
        if (sum->bin_count[b]) sum->bin_share[b] /= sum->bin_count[b];
        if (sum->doubt_count[b]) sum->doubt_wrong[b] /= sum->doubt_count[b];
    }
}

StudyGoals om__att_goals(const OmStudyAttachmentsSummary* sum) {
    const OmStudyGuessResult *one = &sum->by[OM_STUDY_SINGLE], *three = &sum->by[OM_STUDY_THREE];
    return (StudyGoals){
        5,
        {{"median DSC of single views", "%.2f", one->dsc.median, OM_STUDY_ATT_DSC},
         {"median TPR of single views", "%.0f %%", 100 * one->tpr.median, 100 * OM_STUDY_ATT_TPR},
         {"median DSC of three views", "%.2f", three->dsc.median, OM_STUDY_ATT_DSC3},
         {"median TPR of three views", "%.0f %%", 100 * three->tpr.median, 100 * OM_STUDY_ATT_TPR3},
         {"processor time of a view", "%.0f ms", one->ms, OM_STUDY_ATT_MS, true}}};
}

static void summarise(Att* s) {
    OmStudyAttachmentsSummary* sum = &s->sum;
    sum->nlayout = s->nlayout;
    for (int guess = 0; guess < OM_STUDY_NGUESS; ++guess)
        summarise_guess(s, guess, &sum->by[guess]);
    calibrate(s, sum);
    sum->is_met = om__goals_met(om__att_goals(sum));
}

static OmStatus name_layout(const void* ctx, int i, char name[64], uint64_t* hash) {
    const Att* s = ctx;
    const MatchLayout* l = &om__match_layout[s->first + i];
    double number[5 + 2 * MATCH_NGRASP] = {l->layout[0], l->layout[1], l->share, l->lift, s->cells};
    memcpy(number + 5, l->grasp, sizeof l->grasp);
    snprintf(name, 64, "layout-%02d-%d.bin", s->first + i + 1, s->cells);
    *hash = om__study_hash_method(ATT_METHOD);
    *hash = om_hash(&s->net_hash, sizeof s->net_hash, *hash);
    *hash = om_hash(number, sizeof number, *hash);
    return OM_OK;
}

static OmStatus run(Att* s) {
    StudyCases c = {.dir = s->def->out_dir,
                    .what = "layouts",
                    .n = s->nlayout,
                    .nworker = 1,
                    .seconds = s->def->is_quick ? 6 : 20,
                    .size = sizeof *s->result,
                    .result = s->result,
                    .ctx = s,
                    .name = name_layout,
                    .make = run_layout};
    OM_TRY(om__cases_run(&c, s->progress));
    s->sum.nnew = c.nmissing;
    summarise(s);
    return OM_OK;
}

static OmStatus load_network(Att* s) {
    OM_TRY(om_banet_net_find(s->def->network, NULL, &s->net));
    s->net_hash = s->net ? om_banet_net_hash(s->net) : 0;
    s->sum.has_network = s->net != NULL;
    return OM_OK;
}

OmStatus om_study_attachments_run(const OmStudyAttachmentsDef* def, const OmProgress* progress,
                                  OmStudyAttachmentsSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Att s = {.def = def,
             .progress = progress,
             .first = (def->set - 1) * MATCH_NLAYOUT,
             .nlayout = def->is_quick ? 3 : MATCH_NLAYOUT,
             .cells = def->is_quick ? 12 : 20};
    OmFolder folder = {0};
    s.result = om_calloc((size_t)s.nlayout, sizeof *s.result);
    if (!s.result) return OM_NO_MEMORY;
    OmStatus status = load_network(&s);
    if (status == OM_OK) status = om_folder_open(def->out_dir, "attachments study", &folder);
    if (status == OM_OK) status = run(&s);
    if (status == OM_OK) status = om__att_write(&s);
    if (status == OM_OK) *summary = s.sum;
    om_folder_end(&folder);
    om_banet_net_destroy(s.net);
    om_free(s.result);
    return status;
}
