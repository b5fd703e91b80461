// trial_preplan_report.c: the map of the grid, as text and as a page with pictures.
//
// Rows of a map are the rows of the grid with the highest y first, columns run along x, as one looks at the tissue from
// above with PSM1 at the lower edge.
#include <ctype.h>
#include <math.h>
#include <string.h>

#include "omentum/report.h"
#include "omentum/trial_preplan.h"

enum { VISIBILITY, FORCE, ACTIONS, NMAP };

static const char* const map_title[NMAP] = {"visibility of the ROI, %", "largest pull, N",
                                            "actions"};

static double value_of(const OmPreplanPoint* p, int map) {
    switch (map) {
    case VISIBILITY: return 100 * p->visibility;
    case FORCE: return p->force;
    default: return p->naction;
    }
}

static bool has_value(const OmPreplanPoint* p, int map) {
    return p->is_tried && (map != FORCE || p->force >= 0);
}

static const char* short_word(const OmPreplanPoint* p) {
    switch (p->verdict) {
    case OM_PREPLAN_ATTACHED: return "held";
    case OM_PREPLAN_NO_TISSUE: return "none";
    case OM_PREPLAN_OUT_OF_REACH: return "far";
    default: return "?";
    }
}

// ---- text -----------------------------------------------------------------------------------------------------

static OmStatus print_map(const OmPreplan* plan, int map, OmText* text) {
    OM_TRY(om_text_append(text, "%s\n", map_title[map]));
    for (int iy = plan->n - 1; iy >= 0; --iy) {
        OM_TRY(om_text_append(text, "  y %2d ", iy + 1));
        for (int ix = 0; ix < plan->n; ++ix) {
            const OmPreplanPoint* p = &plan->point[iy * plan->n + ix];
            char cell[24];
            if (!p->is_tried)
                snprintf(cell, sizeof cell, "%s", short_word(p));
            else
                snprintf(cell, sizeof cell, "%.*f", map == FORCE ? 2 : 0, value_of(p, map));
            if (p->is_tried && !has_value(p, map)) snprintf(cell, sizeof cell, "-");
            const char* mark = p->block == plan->chosen ? "<" : p->exposes ? "*" : " ";
            OM_TRY(om_text_append(text, " %5s%s", cell, mark));
        }
        OM_TRY(om_text_append(text, "\n"));
    }
    OM_TRY(om_text_append(text, "     x"));
    for (int ix = 0; ix < plan->n; ++ix) OM_TRY(om_text_append(text, " %5d ", ix + 1));
    return om_text_append(text, "\n");
}

OmStatus om_preplan_print(const OmPreplan* plan, OmText* text) {
    for (int map = 0; map < NMAP; ++map) OM_TRY(print_map(plan, map, text));
    return om_text_append(
        text, "  < chosen, * exposes the ROI; held: above attachments, none: no tissue, "
              "far: out of reach\n");
}

// ---- maps -------------------------------------------------------------------------------------------------

OmStatus om_preplan_add_maps(const OmPreplan* plan, struct OmReport* report) {
    double value[OM_PLAN_MAX_BLOCK];
    const char* word[OM_PLAN_MAX_BLOCK];
    unsigned char mark[OM_PLAN_MAX_BLOCK];
    for (int map = 0; map < NMAP; ++map) {
        char title[160];
        OmReportMap m = {.title = title,
                         .axes = "x to the right, y upwards; PSM1 at the lower edge",
                         .nx = plan->n,
                         .ny = plan->n,
                         .value = value,
                         .word = word,
                         .mark = mark,
                         .most = map == VISIBILITY ? 100 : 0,
                         .digits = map == FORCE ? 2 : 0};
        for (int b = 0; b < plan->n * plan->n; ++b) {
            const OmPreplanPoint* p = &plan->point[b];
            value[b] = has_value(p, map) ? value_of(p, map) : (double)NAN;
            word[b] = p->is_tried ? "-" : short_word(p);
            mark[b] = b == plan->chosen ? 2 : p->exposes;
            if (has_value(p, map)) m.most = fmax(m.most, value[b]);
        }
        snprintf(
            title, sizeof title, "%s%s", map_title[map],
            map == 0
                ? " (one frame: exposes the ROI; two: chosen; held: above an attachment; far: out of reach)"
                : "");
        om_report_map(report, &m);
    }
    return OM_OK;
}

// ---- the page -------------------------------------------------------------------------------------------------

static const char* fold_text(OmPlanVerb fold) {
    return fold == OM_PLAN_MOVE_AWAY ? "away" : fold == OM_PLAN_MOVE_ROI ? "towards the ROI" : "-";
}

static OmStatus add_points(OmReport* report, const OmPreplan* plan) {
    enum { NCOL = 8, LEN = 64 };
    static const char* const heading[NCOL] = {"point",    "arm",  "pulls",   "fold",
                                              "ROI seen", "pull", "actions", "this point"};
    const int n = plan->n * plan->n;
    OmStatus status = OM_OK;
    char* text = NULL;
    const char** cell = NULL;
    OM_ALLOC_DONE(text, (size_t)n * NCOL * LEN);
    OM_ALLOC_DONE(cell, (size_t)n * NCOL);
    for (int b = 0; b < n; ++b) {
        const OmPreplanPoint* p = &plan->point[b];
        char(*c)[LEN] = (char(*)[LEN])(text + (size_t)b * NCOL * LEN);
        for (int k = 0; k < NCOL; ++k)
            cell[b * NCOL + k] = snprintf(c[k], LEN, "-") > 0 ? c[k] : NULL;
        snprintf(c[0], LEN, "(%d,%d)", b % plan->n + 1, b / plan->n + 1);
        if (p->arm >= 0) snprintf(c[1], LEN, "PSM%d", p->arm + 1);
        snprintf(c[7], LEN, "%s", om_preplan_verdict_text(p->verdict));
        if (!p->is_tried) continue;
        snprintf(c[2], LEN, "%d", p->npull);
        snprintf(c[3], LEN, "%s", fold_text(p->fold));
        snprintf(c[4], LEN, "%.0f %%", 100 * p->visibility);
        if (p->force >= 0) snprintf(c[5], LEN, "%.2f N", p->force);
        snprintf(c[6], LEN, "%d", p->naction);
    }
    om_report_table(report, heading, NCOL, cell, n);
done:
    om_free(text);
    om_free(cell);
    return status;
}

OmStatus om_preplan_save_report(const OmPreplan* plan, const char* path) {
    char text[512];
    OmReport report;
    snprintf(text, sizeof text, "scene %s, layout %d", plan->scene, plan->seed);
    om_report_begin(&report, "Plan before the operation", text);
    snprintf(text, sizeof text, "%s", plan->reason);
    text[0] = (char)toupper((unsigned char)text[0]);
    om_report_verdict(&report, text, plan->is_exposing);
    snprintf(
        text, sizeof text,
        "Asked: a grasping point from which at least %.0f %% of the ROI comes into view. Came out: "
        "%d of the %d grasping points were tried in the simulation of the twin, and %d of them do "
        "this. Of the three with the lowest largest pull the one with the fewest actions is chosen.",
        100 * plan->visibility, plan->ntried, plan->n * plan->n, plan->nexposing);
    om_report_paragraph(&report, text);
    om_report_heading(&report,
                      "The grid from above, PSM1 at the lower edge, the camera at the left");
    OmStatus status = om_preplan_add_maps(plan, &report);
    om_report_heading(&report, "Every grasping point");
    if (status == OM_OK) status = add_points(&report, plan);
    if (status == OM_OK) return om_report_save(&report, path);
    om_report_done(&report);
    return status;
}
