// study_correspondence.c: ways to find material points, each on the same scans of the same truths.
//
// The error of an answer is its distance from the true material point in the rest shape, point to surface: answers and
// truth are points of triangles, not vertices. Points whose material moved less than 5 mm are left out: every way finds
// them. Times are processor time of one case, the least of three runs of a way.
//
// Twin and truth have the elements of a scene's default, which bend. Live registration has linear ones: those of the
// twin take ten times as long. Tracks come from the pictures on the way. Each picture is registered from the twin at
// that moment, or, where the twin stays behind (70 %), from the result of the picture before it, and the first one from
// the rest shape. The time of a way with tracks includes that of following them to the last picture and of finding new
// ones there.
#include <math.h>
#include <string.h>

#include "studies/study_correspondence.h"

#define COOKIE 0x57d1c0deu
#define NRUN 3

OmStudyCorrespondenceDef om_study_correspondence_default_def(const char* out_dir) {
    return (OmStudyCorrespondenceDef){.out_dir = out_dir, .spacing = 0.0025, .cookie = COOKIE};
}

static OmStatus validate(const OmStudyCorrespondenceDef* d) {
    const StudyRange range[] = {{"spacing", d->spacing, 0.002, 0.02}};
    return STUDY_CHECK("correspondence study", d, COOKIE, range);
}

// ---- one case -------------------------------------------------------------------------------------

typedef struct Stage {  // of one case
    const Cor* s;
    const MatchCase* c;
    const MatchSetup* setup;
    MatchTruth truth;
    MatchTwin twin[2];
    OmScan scan;
    OmPicture color;  // of the same pixels
    OmScene scene;    // of live registration
    OmMatch* match;
    OmMatchLive* live;
    OmMatchTracker* tracker[2];  // of both twins
    OmMatchTracks tracks[2];
    double track_ms[2];
    double* x;  // the twin as registered in the last picture          (nvert x 3)
    OmSpectralBasis basis;
    OmMatchGrasp grasp[OM_MAX_ARM];
    double* rest;  // true material points         (npoint x 3)
    WayAnswer answer;
} Stage;

static void stage_done(Stage* g) {
    for (int k = 0; k < 2; ++k) om_match_tracker_destroy(g->tracker[k]);
    om_match_live_destroy(g->live);
    om_match_destroy(g->match);
    om_spectral_basis_done(&g->basis);
    om_scan_done(&g->scan);
    om__match_truth_done(&g->truth);
    om__match_twin_done(&g->twin[0]);
    om__match_twin_done(&g->twin[1]);
    om_picture_done(&g->color);
    om_free(g->x);
    om_free(g->rest);
    om_free(g->answer.x_rest);
    om_free(g->answer.has);
}

static OmStatus make_scan(Stage* g, CorResult* r) {
    const OmSite* site = &g->twin[0].site;
    OmObservation obs;
    clock_t begin = clock();
    OM_TRY(om__match_scan_way(&g->truth, site, &g->setup->move, g->c, g->s->def->spacing,
                              g->truth.nway, &obs, &g->scan));
    r->scan_ms = om__processor_ms(begin);
    g->color = obs.rgbd.color;
    memset(&obs.rgbd.color, 0, sizeof obs.rgbd.color);
    om_observation_done(&obs);
    r->npoint = g->scan.npoint;
    OM_CHECK(r->npoint > 0 && r->npoint <= COR_MAX_POINT, OM_INVALID, "%s: %d points in the scan",
             g->c->name, r->npoint);
    size_t n = (size_t)r->npoint;
    double* distance;
    OM_ALLOC(g->rest, 3 * n);
    OM_ALLOC(g->answer.x_rest, 3 * n);
    OM_ALLOC(g->answer.has, n);
    OM_ALLOC(distance, n);
    OmStatus status = om__match_find_material(&g->truth, r->npoint, g->scan.x, g->rest, distance);
    for (int i = 0; status == OM_OK && i < r->npoint; ++i) {
        r->off += distance[i] / r->npoint;
        r->moved[i] = (float)om_distance(om_load3(g->rest, i), om_load3(g->scan.x, i));
    }
    om_free(distance);
    return status;
}

// Picture k on the way, for the tracks of twin `which`: follow, register, adopt.
static OmStatus take_picture(Stage* g, int which, int k) {
    OmObservation obs;
    OmScan scan;
    OmMatchGrasp grasp[OM_MAX_ARM];
    OmMatchPairs pairs = {0};
    const MatchMove* move = &g->setup->move;
    size_t n = 3 * (size_t)om_match_view(g->match)->mesh->nvert;
    OM_TRY(om__match_scan_way(&g->truth, &g->twin[0].site, move, g->c, g->s->def->spacing, k, &obs,
                              &scan));
    int ngrasp = om__match_grasps_way(&g->truth, move, k, grasp);
    const double* x = which ? g->twin[1].way_x + (size_t)k * n : g->x;
    OmStatus status;
    OM_TRY_DONE(
        om_match_tracker_follow(g->tracker[which], &scan, &obs.rgbd.color, &g->tracks[which]));
    OM_TRY_DONE(
        om_match_find_pairs_with(g->live, &scan, ngrasp, grasp, x, &g->tracks[which], &pairs));
    if (!pairs.is_lost) memcpy(g->x, pairs.x, n * sizeof *g->x);
    status = om_match_tracker_adopt(g->tracker[which], &pairs);
done:
    om_match_pairs_done(&pairs);
    om_scan_done(&scan);
    om_observation_done(&obs);
    return status;
}

// Tracks at the picture of the scan, from all pictures before it.
static OmStatus make_tracks(Stage* g, int which) {
    const OmTetMesh* mesh = om_match_view(g->match)->mesh;
    OmMatchTrackerDef def = om_match_tracker_default_def(g->match);
    OM_TRY(om_match_tracker_create(&def, &g->tracker[which]));
    memcpy(g->x, mesh->x, 3 * (size_t)mesh->nvert * sizeof *g->x);
    for (int k = 0; k < g->truth.nway; ++k) OM_TRY(take_picture(g, which, k));
    clock_t begin = clock();
    OM_TRY(om_match_tracker_follow(g->tracker[which], &g->scan, &g->color, &g->tracks[which]));
    g->track_ms[which] = om__processor_ms(begin);
    return OM_OK;
}

static OmStatus add_track_time(Stage* g, int which, CorWay* way) {
    OmMatchPairs pairs = {.nvert = om_match_view(g->match)->mesh->nvert, .x = g->x};
    clock_t begin = clock();
    OM_TRY(om_match_tracker_adopt(g->tracker[which], &pairs));
    way->ms += g->track_ms[which] + om__processor_ms(begin);
    return OM_OK;
}

static OmStatus try_way(Stage* g, OmStudyWay way, const WayInput* in, CorResult* r) {
    CorWay* w = &r->way[way];
    for (int run = 0; run < NRUN; ++run) {
        clock_t begin = clock();
        OM_TRY(om__study_way_find(way, in, &g->answer));
        double ms = om__processor_ms(begin);
        w->ms = run ? fmin(w->ms, ms) : ms;
    }
    w->is_lost = g->answer.is_lost;
    snprintf(w->reason, sizeof w->reason, "%s", g->answer.reason);
    for (int i = 0; i < r->npoint; ++i) {
        double error = om_distance(om_load3(g->answer.x_rest, i), om_load3(g->rest, i));
        w->error[i] = g->answer.has[i] ? (float)error : -1;
    }
    return OM_OK;
}

static OmStatus run_case(void* ctx, int index, void* result) {
    static const double share[2] = {0.7, 1};
    const Cor* s = ctx;
    const MatchCase* c = &s->list[index];
    CorResult* r = result;
    Stage g = {.s = s, .c = c, .setup = &om__match_setup[c->setup]};
    OmMatchDef def;
    OmStatus status;
    OM_TRY_DONE(om__match_truth_get(g.setup, s->def->out_dir, s->def->nworker, NULL, &g.truth));
    for (int k = 0; k < 2; ++k)
        OM_TRY_DONE(om__match_twin_get(g.setup, c->belief, &g.truth, share[k], s->def->nworker,
                                       &g.twin[k]));
    OM_TRY_DONE(make_scan(&g, r));
    g.scene = g.twin[0].scene;
    g.scene.tissue.element = OM_ELEMENT_LINEAR;
    def = om_match_default_def(&g.scene, &g.twin[0].site);
    OM_TRY_DONE(om_match_create(&def, &g.match));
    OmMatchLiveDef live = om_match_live_default_def(g.match);
    OM_TRY_DONE(om_match_live_create(&live, &g.live));
    OM_ALLOC_DONE(g.x, 3 * (size_t)om_match_view(g.match)->mesh->nvert);
    for (int k = 0; k < 2; ++k) OM_TRY_DONE(make_tracks(&g, k));
    OM_TRY_DONE(om_spectral_basis_init(om_match_view(g.match)->surface, WAY_NPAIR, &g.basis));
    WayInput in = {.live = g.live,
                   .view = om_match_view(g.match),
                   .basis = &g.basis,
                   .scan = &g.scan,
                   .ngrasp = om__match_grasps(&g.truth, &g.setup->move, g.grasp),
                   .grasp = g.grasp,
                   .tracks = {&g.tracks[0], &g.tracks[1]},
                   .x_twin = {g.twin[0].x, g.twin[1].x}};
    r->nmodel = in.view->surface->nvert;
    for (int way = 0; way < OM_STUDY_NWAY; ++way) OM_TRY_DONE(try_way(&g, way, &in, r));
    OM_TRY_DONE(add_track_time(&g, 0, &r->way[OM_STUDY_TRACKS]));
    status = add_track_time(&g, 1, &r->way[OM_STUDY_TRACKS_END]);
done:
    stage_done(&g);
    if (status < 0) return om_error_prefix(status, "%s", c->name);
    return status;
}

// ---- all cases ------------------------------------------------------------------------------------

OmStatus om__cor_summarise(const Cor* s, OmStudyWay way, const unsigned char* which,
                           OmStudyWayResult* result) {
    *result = (OmStudyWayResult){0};
    double *error, ms[256];
    int n = 0, nms = 0;
    OM_ALLOC(error, (size_t)s->ncase * COR_MAX_POINT + 1);
    for (int k = 0; k < s->ncase; ++k) {
        const CorResult* r = &s->result[k];
        const CorWay* w = &r->way[way];
        if (which && !which[k]) continue;
        result->nlost += w->is_lost != 0;
        if (nms < 256) ms[nms++] = w->ms;
        for (int i = 0; i < r->npoint; ++i) {
            if ((double)r->moved[i] < COR_MOVED) continue;
            ++result->npoint;
            if (w->error[i] >= 0) error[n++] = (double)w->error[i];
        }
    }
    if (n > 0) {
        om_sort_doubles(error, n);
        result->answered = (double)n / result->npoint;
        result->median = error[n / 2];
        result->p90 = error[(int)(0.9 * (n - 1))];
        result->worst = error[n - 1];
    }
    if (nms > 0) {
        om_sort_doubles(ms, nms);
        result->ms = ms[nms / 2];
    }
    om_free(error);
    return OM_OK;
}

StudyGoals om__cor_goals(const OmStudyCorrespondenceSummary* sum) {
    const OmStudyWayResult* r = &sum->fold[OM_STUDY_TRACKS];
    const double none = r->answered > 0 ? 0 : (double)NAN;
    return (StudyGoals){
        4,
        {{"median error", "%.1f mm", 1e3 * r->median + none, 1e3 * OM_STUDY_COR_MEDIAN, true},
         {"90 % of the errors", "%.1f mm", 1e3 * r->p90 + none, 1e3 * OM_STUDY_COR_P90, true},
         {"points with an answer", "%.0f %%", 100 * r->answered, 100 * OM_STUDY_COR_ANSWERED},
         {"processor time of a case", "%.0f ms", r->ms + none, OM_STUDY_COR_MS, true}}};
}

static OmStatus summarise(Cor* s) {
    unsigned char which[256] = {0};
    for (int k = 0; k < s->ncase && k < 256; ++k) {
        const MatchCase* c = &s->list[k];
        which[k] = strncmp(c->name, "fold 135", 8) == 0 && c->belief == BELIEF_RIGHT;
    }
    for (int way = 0; way < OM_STUDY_NWAY; ++way) {
        OM_TRY(om__cor_summarise(s, way, NULL, &s->sum.all[way]));
        OM_TRY(om__cor_summarise(s, way, which, &s->sum.fold[way]));
    }
    s->sum.ncase = s->ncase;
    s->sum.is_met = om__goals_met(om__cor_goals(&s->sum));
    return OM_OK;
}

// The hash is of everything that the result of a case depends on, but the truth's file.
static OmStatus name_case(const void* ctx, int k, char name[64], uint64_t* hash) {
    const Cor* s = ctx;
    const MatchCase* c = &s->list[k];
    const double number[] = {c->setup, c->view, c->seen, c->keeps_far, c->belief, s->def->spacing};
    snprintf(name, 64, "case-%s%02d.bin", s->def->is_quick ? "quick-" : "", k + 1);
    *hash = om__study_hash_method(COR_METHOD);
    *hash = om_hash(c->name, strlen(c->name), *hash);
    *hash = om_hash(number, sizeof number, *hash);
    return OM_OK;
}

static OmStatus run(Cor* s) {
    StudyCases c = {.dir = s->def->out_dir,
                    .what = "cases",
                    .n = s->ncase,
                    .nworker = 1,
                    .seconds = s->def->is_quick ? 8 : 12,
                    .size = sizeof *s->result,
                    .result = s->result,
                    .ctx = s,
                    .name = name_case,
                    .make = run_case};
    OM_TRY(om__cases_run(&c, s->progress));
    s->sum.nnew = c.nmissing;
    return summarise(s);
}

OmStatus om_study_correspondence_run(const OmStudyCorrespondenceDef* def,
                                     const OmProgress* progress,
                                     OmStudyCorrespondenceSummary* summary) {
    memset(summary, 0, sizeof *summary);
    OM_TRY(validate(def));
    Cor s = {.def = def,
             .progress = progress,
             .ncase = def->is_quick ? om__match_nquick : om__match_ncase,
             .list = def->is_quick ? om__match_quick_case : om__match_case};
    OmFolder folder = {0};
    s.result = om_calloc((size_t)s.ncase, sizeof *s.result);
    if (!s.result) return OM_NO_MEMORY;
    OmStatus status = om_folder_open(def->out_dir, "correspondence study", &folder);
    if (status == OM_OK) status = run(&s);
    if (status == OM_OK) status = om__cor_write(&s);
    if (status == OM_OK) *summary = s.sum;
    om_folder_end(&folder);
    om_free(s.result);
    return status;
}
