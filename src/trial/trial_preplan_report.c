// trial_preplan_report.c: the map of the grid, as text and as a page with pictures.
//
// Rows of a map are the rows of the grid with the highest y first, columns run along x, as one looks at the tissue from
// above with PSM1 at the lower edge.
#include <string.h>

#include "omentum/image.h"
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

// ---- pictures ---------------------------------------------------------------------------------------------

#define CELL 48  // pixels

static void fill(OmPicture* picture, int x, int y, int size, const unsigned char rgb[3]) {
    for (int j = y; j < y + size; ++j)
        for (int i = x; i < x + size; ++i)
            memcpy(&picture->pixel[3 * ((size_t)j * (size_t)picture->width + (size_t)i)], rgb, 3);
}

// From pale to blue with the value; grey: not tried.
static void color_of(const OmPreplan* plan, const OmPreplanPoint* p, int map, double most,
                     unsigned char rgb[3]) {
    (void)plan;
    memset(rgb, 215, 3);
    if (!has_value(p, map)) return;
    double s = most > 0 ? fmax(0, fmin(1, value_of(p, map) / most)) : 0;
    rgb[0] = (unsigned char)(247 - 214 * s);
    rgb[1] = (unsigned char)(251 - 138 * s);
    rgb[2] = (unsigned char)(255 - 74 * s);
}

static OmStatus draw_map(const OmPreplan* plan, int map, OmPicture* picture) {
    static const unsigned char red[3] = {200, 30, 30}, green[3] = {40, 140, 60},
                               white[3] = {255, 255, 255};
    double most = map == VISIBILITY ? 100 : 0;
    for (int b = 0; b < plan->n * plan->n; ++b)
        if (has_value(&plan->point[b], map)) most = fmax(most, value_of(&plan->point[b], map));
    OM_TRY(om_picture_init(picture, plan->n * CELL, plan->n * CELL, 3));
    for (int b = 0; b < plan->n * plan->n; ++b) {
        const OmPreplanPoint* p = &plan->point[b];
        int x = b % plan->n * CELL, y = (plan->n - 1 - b / plan->n) * CELL;
        unsigned char rgb[3];
        color_of(plan, p, map, most, rgb);
        fill(picture, x, y, CELL, b == plan->chosen ? red : p->exposes ? green : white);
        fill(picture, x + 3, y + 3, CELL - 6, rgb);
    }
    return OM_OK;
}

OmStatus om_preplan_add_maps(const OmPreplan* plan, struct OmReport* report) {
    for (int map = 0; map < NMAP; ++map) {
        OmPicture picture;
        char caption[160];
        snprintf(caption, sizeof caption,
                 "%s: darker is more. Red frame: chosen; green: exposes the ROI; grey: not tried",
                 map_title[map]);
        OM_TRY(draw_map(plan, map, &picture));
        om_report_picture(report, &picture, caption);
        om_picture_done(&picture);
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
    om_report_verdict(&report, plan->reason, plan->is_exposing);
    snprintf(
        text, sizeof text,
        "%d of %d grasping points were tried in the simulation of the twin; %d of them expose "
        "%.0f %% of the ROI. Of the three with the lowest largest pull the one with the fewest "
        "actions is chosen.",
        plan->ntried, plan->n * plan->n, plan->nexposing, 100 * plan->visibility);
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
