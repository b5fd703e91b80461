// contact_step.c: one step of tissue among obstacles.
#include "contact/contact_internal.h"
#include "contact/contact_press_internal.h"

#define SHORTEST (1.0 / 32)  // of a step, to which it is cut for the sake of contacts
#define STILL 3              // steps in a row below a speed: tissue that turns back is slow in one
#define DAMP_FROM 4          // solves before round obstacles damp the iteration

// An accepted substep is followed by one that begins later.
static void note_settled(OmContactWork* cw, double time) {
    if (time > cw->seen_time) cw->has_settled &= cw->report.is_settled;
    cw->seen_time = time;
}

static OmStatus solve_contact(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                              double h, OmTissueReport* report) {
    OmContactWork* cw = ctx;
    OmStatus status = OM_OK;
    note_settled(cw, om_tissue_time(s));
    om__contact_find_pairs(cw, m, s, w, h);
    cw->report.is_settled = false;
    for (int n = 0; n < cw->contact->def.max_iterations && !cw->report.is_settled; ++n) {
        if (n >= cw->contact->def.max_iterations / 2) om__contact_close_set(cw);
        om__contact_add_forces(cw, w, h);
        status = om_tissue_solve_step(m, s, w, report);
        if (status < 0) return status;
        ++cw->report.nsolve;
        int nchange = om__contact_update_pairs(cw, s, w, h, n >= DAMP_FROM);
        cw->report.is_settled = nchange == 0;
    }
    OM_CHECK(cw->report.is_settled || h < 2 * SHORTEST * cw->h, OM_INVALID,
             "contact: contact has not settled after %d solves", cw->contact->def.max_iterations);
    om__contact_report_pairs(cw, m, s, w, h);
    return status;
}

// A step of an engine that keeps out of obstacles itself, into the report.
static OmStatus step_among(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           OmTissueWork* w, double h, OmTissueReport* tissue) {
    OmContactReport* r = &cw->report;
    int nobstacle = cw->contact->def.nobstacle;
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

OmStatus om_contact_step(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                         OmTissueWork* w, double h, OmContactReport* report) {
    cw->report = (OmContactReport){0};
    cw->h = h;
    cw->seen_time = om_tissue_time(s);
    cw->has_settled = true;
    OmTissueReport tissue = {0};
    OmStatus status = om_tissue_moves_itself(m)
                          ? step_among(cw, m, s, w, h, &tissue)
                          : om_tissue_step_with(m, s, w, h, solve_contact, cw, &tissue);
    cw->report.is_settled &= cw->has_settled;
    cw->report.tissue = tissue;
    if (report) *report = cw->report;
    if (status != OM_OK || cw->report.is_settled) return status;
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

// ---- the step -------------------------------------------------------------------------------------

OmStatus om_press_step(OmPress* p, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                       OmPose pose_end, double h, OmPressReport* report) {
    static const OmTissueStepFn method_table[] = {om__press_penalty, om__press_multipliers,
                                                  om__press_penalty};
    p->report = (OmPressReport){0};
    if (report) *report = p->report;
    OM_CHECK(m == p->model, OM_INVALID, "press: it was made for another model");
    OM_CHECK(h > 0 && h <= 10, OM_INVALID, "press: time step is %g s; it must be in (0, 10]", h);
    OM_TRY(om__press_check_pose(pose_end));
    OM_TRY(om_tissue_reserve_points(w, p->surface.nvert));
    if (!p->is_placed) OM_TRY(om_press_place(p, m, s, pose_end));
    p->begin = p->pose;
    p->end = pose_end;
    p->time = om_tissue_time(s);
    p->h = h;
    p->detect_h = 0;
    p->substep_time = p->time;
    p->has_settled = true;
    OmTissueReport tissue;
    OmStatus status = om_tissue_step_with(m, s, w, h, method_table[p->def.method], p, &tissue);
    if (status < 0) return status;
    p->report.tissue = tissue;
    p->report.is_settled &= p->has_settled;
    p->pose = pose_end;
    om__press_report_points(p, s);
    if (report) *report = p->report;
    if (status != OM_OK || p->report.is_settled) return status;
    return om_error(OM_NOT_CONVERGED, "press: contact has not settled in a step of %g s", h);
}
