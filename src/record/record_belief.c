// record_belief.c: the path of the belief over time: how much of the underside the twin holds, and how well that agrees
// with the truth.
//
// A point is added when the twin begins, when it takes an estimate over or frees what is doubted, and after an action
// where a person has marked attachments. The vertices of the twin's underside are compared with the nearest ones of the
// truth's at rest; Dice is twice the common ones over the sum of both.
#include <math.h>
#include <string.h>

#include "base/base_grow.h"
#include "record/record_internal.h"

static const OmMeshSet* underside(const OmBody* body) {
    return om_tet_mesh_find_set(&om_body_site(body)->mesh, "underside");
}

// Is the vertex of the truth attached that is nearest to a place, at rest?
static bool is_held(const OmBody* truth, const OmMeshSet* under, OmVec3 p) {
    const double* x = om_body_site(truth)->mesh.x;
    double least = INFINITY;
    int best = -1;
    for (int i = 0; i < under->nvert; ++i) {
        const double d = om_norm2(om_sub(om_load3(x, under->vert[i]), p));
        if (d < least) least = d, best = under->vert[i];
    }
    return best >= 0 && om_body_attached(truth)[best];
}

static OmStatus find_truth(OmRecorder* rec) {
    const OmMeshSet* under = underside(rec->def.twin);
    const OmMeshSet* other = underside(rec->def.truth);
    const double* x = om_body_site(rec->def.twin)->mesh.x;
    OM_ALLOC(rec->path.is_true, (size_t)under->nvert);
    for (int i = 0; i < under->nvert; ++i) {
        rec->path.is_true[i] = is_held(rec->def.truth, other, om_load3(x, under->vert[i]));
        rec->path.true_share += (double)rec->path.is_true[i] / under->nvert;
    }
    return OM_OK;
}

OmStatus om__record_belief(OmRecorder* rec, double time, const unsigned char* attached) {
    BeliefPath* b = &rec->path;
    const OmMeshSet* under = underside(rec->def.twin);
    if (!under || under->nvert == 0) return OM_OK;
    if (!b->is_true && rec->def.truth && underside(rec->def.truth)) OM_TRY(find_truth(rec));
    int n = 0, nboth = 0;
    for (int i = 0; i < under->nvert; ++i) {
        const bool is = attached[under->vert[i]] != 0;
        n += is;
        nboth += is && b->is_true && b->is_true[i];
    }
    const double ntrue = b->true_share * under->nvert;
    BeliefPoint p = {time, (double)n / under->nvert, NAN};
    if (b->is_true) p.dice = n + ntrue > 0 ? 2 * nboth / (n + ntrue) : 1;
    const BeliefPoint* last = b->n > 0 ? &b->point[b->n - 1] : NULL;
    const bool is_same = last && last->share == p.share && (last->dice == p.dice || !b->is_true);
    if (is_same) return OM_OK;
    if (last) OM_TRY(om__record_view_belief(rec, attached));
    OM_GROW(b->point, b->n, b->capacity, 16);
    b->point[b->n++] = p;
    return OM_OK;
}

void om__record_belief_done(BeliefPath* path) {
    om_free(path->point);
    om_free(path->is_true);
    *path = (BeliefPath){0};
}

void om__record_belief_json(const OmRecorder* rec, OmJson* json) {
    const BeliefPath* b = &rec->path;
    om_json_open(json, "belief", '[');
    for (int i = 0; i < b->n; ++i) {
        om_json_open(json, NULL, '{');
        om_json_number(json, "time_s", b->point[i].time);
        om_json_number(json, "attached_share", b->point[i].share);
        if (b->is_true) om_json_number(json, "dice", b->point[i].dice);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
    if (b->is_true) om_json_number(json, "true_attached_share", b->true_share);
}

OmStatus om__report_add_belief(OmReport* report, const OmRecorder* rec, const OmRetractResult* r) {
    const BeliefPath* b = &rec->path;
    const int n = b->n + 1;  // the last point holds until the end
    OmStatus status = OM_OK;
    double *t = NULL, *share = NULL, *dice = NULL, *learnt = NULL;
    if (b->n < 2) return OM_OK;  // nothing was learnt
    OM_ALLOC_DONE(t, n);
    OM_ALLOC_DONE(share, n);
    OM_ALLOC_DONE(dice, n);
    OM_ALLOC_DONE(learnt, r->belief.nupdate + 1);
    for (int i = 0; i < n; ++i) {
        const BeliefPoint* p = &b->point[i < b->n ? i : b->n - 1];
        t[i] = i < b->n ? p->time : fmax(p->time, r->time);
        share[i] = 100 * p->share;
        dice[i] = 100 * p->dice;
    }
    for (int i = 0; i < r->belief.nupdate; ++i) learnt[i] = r->belief.update[i].start;
    const OmReportChart chart = {
        .title = "What the twin believes is attached, and how well it agrees with the truth; "
                 "vertical lines: an estimate began",
        .x_label = "time, s",
        .y_label = "% of the underside, and Dice",
        .nseries = b->is_true ? 2 : 1,
        .series = {{"believed, % of the underside", t, share, n, .is_step = true},
                   {"Dice to the truth, %", t, dice, n, .is_step = true}},
        .has_limit = b->is_true,
        .limit = 100 * b->true_share,
        .limit_name = "attached in truth",
        .has_range = true,
        .y_max = 100,
        .event = learnt,
        .nevent = r->belief.nupdate};
    om_report_heading(report, "What the twin believes");
    om_report_chart(report, &chart);
done:
    om_free(t);
    om_free(share);
    om_free(dice);
    om_free(learnt);
    return status;
}
