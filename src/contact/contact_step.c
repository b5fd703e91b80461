// contact_step.c: one step of tissue among obstacles and probes.
#include <string.h>

#include "contact/contact_internal.h"
#include "contact/contact_press_internal.h"

#define SHORTEST (1.0 / 32)  // of a step: shortest substep when contact does not converge
#define STILL 3              // steps in a row below the speed: at a turning point one step is slow
#define DAMP_FROM 4          // solves before round obstacles damp the iteration
#define ROUGH 0.1            // of the active pairs: if more switched, the next solve is loose
#define LOOSE 1e-2           // its tolerance; a step never ends with such a solve
#define WILD_AFTER \
    4  // solves; if then more pairs of self-contact switch than are active, the step is cut
#define RENEW 0.2  // of the active pairs: if more switched, coarse matrices are made again

// ---- vertices against obstacles -----------------------------------------------------------------------

static int count_active(const OmContactWork* cw) {
    return cw->nactive + (cw->self ? cw->self->sums.nactive : 0) +
           (cw->ride ? cw->ride->sums.nactive : 0);
}

// While many pairs switch, the active set is only a guess: such solves may be loose. Only the first solve makes coarse
// matrices, with the pairs that it guessed; they are made again when many have switched since.
static OmStatus solve_contact(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                              double h, OmTissueReport* report) {
    OmContactWork* cw = ctx;
    OmStatus status = OM_OK;
    // contact with itself begins with a poorer guess
    int max_iterations = cw->contact->def.max_iterations * (cw->self ? 2 : 1);
    om__contact_begin_substep(cw, om_tissue_time(s), h);
    if (cw->report.is_held_back) om_tissue_stop_tools(m, s, w);
    OM_TRY(om__contact_find_pairs(cw, m, s, w, h));
    om_tissue_set_force_scale(w, om__contact_estimate_force(cw, s, h));
    cw->report.is_settled = false;
    double before = report->residual;
    bool is_loose = false;
    int nstale = 0;
    for (int n = 0; n < max_iterations && !cw->report.is_settled; ++n) {
        if (n >= max_iterations / 2) om__contact_close_set(cw);
        om_tissue_clear_forces(w);
        OM_TRY(om__contact_add_forces(cw, w, h));
        report->residual = before;  // of the last solve alone
        om_tissue_set_tolerance(w, is_loose ? LOOSE : 0);
        if (nstale > RENEW * count_active(cw)) {
            om_tissue_renew_solver(w);
            nstale = 0;
        }
        status = om_tissue_solve_step(m, s, w, report);
        if (status < 0) return status;
        ++cw->report.nsolve;
        int nchange;
        OM_TRY(om__contact_update_pairs(cw, m, s, w, h, n >= DAMP_FROM, &nchange));
        cw->report.is_settled = nchange == 0 && !is_loose;
        int nswitch = cw->nswitch + (cw->self ? cw->self->sums.nswitch : 0) +
                      (cw->ride ? cw->ride->sums.nswitch : 0);
        is_loose = nswitch > ROUGH * count_active(cw) && n + 2 < max_iterations;
        nstale += nswitch;
        // an impact too hard for this step: the set that a solve finds is that of other places
        bool is_wild =
            cw->self && n + 1 >= WILD_AFTER && cw->self->sums.nswitch > cw->self->sums.nactive;
        // so is the set that is about to be closed
        is_wild |= cw->self && n + 1 == max_iterations / 2 && is_loose;
        OM_CHECK(!is_wild || h < 2 * SHORTEST * cw->h || om_tissue_is_spent(m, w), OM_INVALID,
                 "contact: contact has not settled after %d solves", n + 1);
    }
    bool may_cut = h >= 2 * SHORTEST * cw->h && !om_tissue_is_spent(m, w);
    OM_CHECK(cw->report.is_settled || !may_cut, OM_INVALID,
             "contact: contact has not settled after %d solves", max_iterations);
    OM_TRY(om__self_check_paths(cw, m, s, w, h));
    OM_TRY(om__contact_report_pairs(cw, m, s, w, h));
    return status;
}

// A step of an engine that resolves obstacles itself; writes the report.
static OmStatus step_among(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, OmTissueReport* tissue) {
    OmContactReport* r = &cw->report;
    int nobstacle = cw->contact->def.nobstacle;
    OM_CHECK(cw->npress == 0, OM_UNAVAILABLE,
             "contact: this engine keeps out of obstacles itself and has no contact surface; add "
             "the probe to the contact as an obstacle (om_probe_obstacle), and move that");
    OmStatus status = om_tissue_step_among(m, s, w, h, nobstacle, cw->obstacle, tissue);
    if (status < 0) return status;
    r->nsolve = tissue->substeps;
    r->is_settled = true;
    for (int k = 0; k < nobstacle; ++k) {
        const OmTissueObstacle* o = &cw->obstacle[k];
        r->ncontact += o->ncontact;
        r->force = om_add(r->force, o->force);
        r->penetration = fmax(r->penetration, o->penetration);
    }
    return status;
}

// ---- probes, with or without obstacles ------------------------------------------------------------------

static OmStatus solve_group(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                            double h, OmTissueReport* report) {
    const OmContactGroup* g = ctx;
    bool has_multipliers = false;
    if (g->contact) om__contact_begin_substep(g->contact, om_tissue_time(s), h);
    if (g->contact && g->contact->report.is_held_back) om_tissue_stop_tools(m, s, w);
    for (int k = 0; k < g->npress; ++k) {
        om__press_path(g->press[k], s, h);
        has_multipliers |= g->press[k]->def.method == OM_PRESS_MULTIPLIERS;
    }
    OmStatus status = has_multipliers ? om__contact_multipliers(g, m, s, w, h, report)
                                      : om__contact_penalty(g, m, s, w, h, report);
    if (status < 0 || !g->contact) return status;
    OM_TRY(om__self_check_paths(g->contact, m, s, w, h));
    OM_TRY(om__contact_report_pairs(g->contact, m, s, w, h));
    for (int k = 0; k < g->npress; ++k) om__press_write_forces(g->press[k], s);
    return status;
}

// Check the probes of a group and set their paths.
static OmStatus begin_paths(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                            OmTissueWork* w, double h) {
    int npoint = 0;
    for (int k = 0; k < g->npress; ++k) {
        OmPress* p = g->press[k];
        OM_CHECK(m == p->model, OM_INVALID, "press: it was made for another model");
        OM_CHECK(p->is_placed || p->has_goal, OM_INVALID,
                 "press: it has no pose; om_press_place or om_press_move must come first");
        npoint += p->npoint;
    }
    OM_TRY(om_tissue_reserve_points(w, npoint));
    for (int k = 0; k < g->npress; ++k) {
        OmPress* p = g->press[k];
        if (!p->is_placed) OM_TRY(om_press_place(p, m, s, p->goal));
        p->report = (OmPressReport){0};
        p->begin = p->pose;
        p->end = p->goal;
        p->time = p->substep_time = om_tissue_time(s);
        p->h = h;
        p->detect_h = 0;
        p->has_settled = true;
    }
    return OM_OK;
}

static OmStatus step_group(const OmContactGroup* g, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, OmTissueReport* tissue) {
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "press: time step is %g s; it must be in (0, 10]", h);
    OM_TRY(begin_paths(g, m, s, w, h));
    OmContactGroup group = *g;
    OmStatus status = om_tissue_step_with(m, s, w, h, solve_group, &group, tissue);
    if (status < 0) return status;
    if (!g->contact)
        memset(om_tissue_contact_force(s), 0,
               3 * (size_t)om_tissue_mesh(m)->nvert * sizeof(double));
    for (int k = 0; k < g->npress; ++k) {
        OmPress* p = g->press[k];
        p->report.tissue = *tissue;
        p->report.is_settled &= p->has_settled;
        p->pose = p->end;
        if (!g->contact) om__press_write_forces(p, s);
        om__press_report_points(p, s);
    }
    return status;
}

OmStatus om_press_step(OmPress* p, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                       OmPose pose_end, double h, OmPressReport* report) {
    p->report = (OmPressReport){0};
    if (report) *report = p->report;
    OmPose goal = p->goal;
    bool has_goal = p->has_goal;
    OmContactGroup group = {NULL, 1, &p};
    OmTissueReport tissue;
    OM_TRY(om_press_move(p, pose_end));
    OmStatus status = step_group(&group, m, s, w, h, &tissue);
    if (status < 0) {
        p->goal = goal;
        p->has_goal = has_goal;
        return status;
    }
    if (report) *report = p->report;
    if (status != OM_OK || p->report.is_settled) return status;
    return om_error(OM_NOT_CONVERGED, "press: contact has not settled in a step of %g s", h);
}

// ---- the step -----------------------------------------------------------------------------------------

void om_contact_work_set_presses(OmContactWork* cw, int npress, OmPress* const* press) {
    cw->npress = npress;
    cw->press = press;
}

// Obstacles and probes in one step.
static OmStatus step_all(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         OmTissueWork* w, double h, OmTissueReport* tissue) {
    OmContactReport* r = &cw->report;
    OmContactGroup group = {cw, cw->npress, cw->press};
    OmStatus status = step_group(&group, m, s, w, h, tissue);
    if (status < 0) return status;
    for (int k = 0; k < cw->npress; ++k) {
        const OmPressReport* p = &cw->press[k]->report;
        r->ncontact += p->ncontact;
        r->force = om_sub(r->force, p->force);
        r->penetration = fmax(r->penetration, p->penetration);
    }
    return status;
}

OmStatus om_contact_step(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         OmTissueWork* w, double h, OmContactReport* report) {
    OM_CHECK(om_tissue_mesh(m)->nvert == cw->contact->nvert, OM_INVALID,
             "contact: made for a model of %d vertices, used with one of %d", cw->contact->nvert,
             om_tissue_mesh(m)->nvert);
    cw->report = (OmContactReport){0};
    if (report) *report = cw->report;
    OM_TRY(om__self_check_start(cw, s));
    cw->h = h;
    cw->time = cw->substep_time = om_tissue_time(s);
    cw->has_settled = true;
    OmTissueReport tissue = {0};
    OmStatus status = om_tissue_moves_itself(m) ? step_among(cw, m, s, w, h, &tissue)
                      : cw->npress > 0
                          ? step_all(cw, m, s, w, h, &tissue)
                          : om_tissue_step_with(m, s, w, h, solve_contact, cw, &tissue);
    if (status >= 0) om__self_end_step(cw, s);
    cw->report.is_settled &= cw->has_settled && !cw->report.is_held_back;
    cw->report.tissue = tissue;
    cw->report.nobstacle = cw->contact->def.nobstacle;
    cw->report.obstacle = cw->obstacle;
    if (report) *report = cw->report;
    if (status != OM_OK || cw->report.is_settled) return status;
    OM_CHECK(!cw->report.is_held_back, OM_NOT_CONVERGED,
             "contact: a tool is held back: the tissue would pass through itself");
    return om_error(OM_NOT_CONVERGED, "contact: contact has not settled in a step of %g s", h);
}

OmStatus om_contact_settle(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, double speed, double seconds) {
    OM_CHECK(speed > 0 && seconds > 0 && h > 0 && seconds / h <= 1e9, OM_INVALID,
             "contact: speed (%g m/s), seconds (%g) and the time step (%g s) must be above 0",
             speed, seconds, h);
    int nvert = om_tissue_mesh(m)->nvert, nstill = 0;
    for (int n = 0; n < (int)ceil(seconds / h); ++n) {
        OM_TRY(om_contact_step(cw, m, s, w, h, NULL));
        double fastest = 0;
        for (int i = 0; i < nvert; ++i)
            fastest = fmax(fastest, om_norm2(om_load3(om_tissue_v(s), i)));
        nstill = cw->report.is_settled && fastest < speed * speed ? nstill + 1 : 0;
        if (nstill < STILL) continue;
        int ninverted = cw->report.tissue.ninverted;
        if (ninverted == 0) return OM_OK;
        return om_error(OM_NOT_CONVERGED, "the tissue is at rest with %d inverted elements",
                        ninverted);
    }
    return om_error(OM_NOT_CONVERGED, "the tissue still moves faster than %g m/s after %g s", speed,
                    seconds);
}
