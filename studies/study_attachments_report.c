// study_attachments_report.c: the study of attachments as report.html, study.json and vertices.csv.
#include <math.h>
#include <string.h>

#include "studies/study_attachments.h"
#include "studies/study_table.h"

// ---- report.html ----------------------------------------------------------------------------------

static void add_outcome(const Att* s, OmReport* report) {
    const OmStudyGuessResult *one = &s->sum.by[OM_STUDY_SINGLE],
                             *three = &s->sum.by[OM_STUDY_THREE];
    om__report_goals(report, "Updates by physics", om__att_goals(&s->sum));
    om__report_say(report,
                   "%d of %d single views and %d of %d updates from three views were refused.",
                   one->nrefused, one->dsc.n, three->nrefused, three->dsc.n);
}

// Table 4.1: median and quartiles, ours and the thesis's.
static void add_table(const Att* s, OmReport* report) {
    static const char* const thesis[OM_STUDY_NGUESS] = {
        "0|0|27.0 (13.4-52.0)",
        "0.42 (0.31-0.55)|93 (84-100)|6.7 (2.5-12.4)",
        "1|100|0.6 (0.2-1.7)",
        "||",
        "||",
        "0.76 (0.63-0.83)|83 (69-90)|1.2 (0.6-2.4)",
        "||",
        "0.76 (0.63-0.83)|83 (69-90)|1.2 (0.6-2.4)",
        "||",
        "||",
        "0.76 (0.63-0.83)|83 (69-90)|1.2 (0.6-2.4)",
        "||"};
    StudyTable table = om__table(
        "attachments|DSC|TPR, %|AVE, mm|MVE, mm|refused|lost views|ms|thesis: DSC|TPR, %|AVE, mm");
    for (int guess = 0; guess < OM_STUDY_NGUESS; ++guess) {
        const OmStudyGuessResult* r = &s->sum.by[guess];
        if (!r->is_there) continue;
        om__table_row(&table, "%s", om__study_guess_title[guess]);
        om__table_quartiles(&table, 1, "%.2f", r->dsc);
        om__table_quartiles(&table, 100, "%.0f", r->tpr);
        om__table_quartiles(&table, 1e3, "%.1f", r->ave);
        om__table_quartiles(&table, 1e3, "%.1f", r->mve);
        if (guess >= OM_STUDY_SINGLE)
            om__table_row(&table, "%d of %d|%d|%.0f", r->nrefused, r->dsc.n, r->nlost, r->ms);
        else
            om__table_row(&table, "||");
        om__table_row(&table, "%s", thesis[guess]);
    }
    om__table_show(
        &table, report, "Table 4.1",
        "Median and quartiles over views. The thesis's columns are its Table 4.1: other tissue, other layouts "
        "and a network in place of the update; beside one view stands its row TestV, less than half of the surface "
        "visible. A refused update counts as no attachment. Lost views have no correspondence, so the network says "
        "nothing of them; with the others alone a fused answer stands. The network's correspondence goes through the "
        "twin that physics has corrected, so its rows are not without physics. Still is no method: it knows the true "
        "motion of the underside and shows what views of these lifts may tell.");
}

static void add_layouts(const Att* s, OmReport* report) {
    StudyTable table = om__table("layout|held, %|view|DSC|TPR, %|AVE, mm|AVE Same, mm|ms|refused");
    for (int row = 0; row < s->nlayout * ATT_NUPDATE; ++row) {
        const AttResult* r = &s->result[row / ATT_NUPDATE];
        const int k = row % ATT_NUPDATE;
        const AttUpdate* u = &r->update[k];
        const bool is_three = k == MATCH_NGRASP;
        double ave = 0, same = 0;
        for (int g = is_three ? 0 : k; g < (is_three ? MATCH_NGRASP : k + 1); ++g) {
            double part = is_three ? 1.0 / MATCH_NGRASP : 1;
            ave += part * r->ave[is_three ? OM_STUDY_THREE : OM_STUDY_SINGLE][g];
            same += part * r->ave[OM_STUDY_SAME][g];
        }
        om__table_row(&table, "%d|%.0f", row / ATT_NUPDATE + 1, 100 * r->share);
        om__table_row(&table, is_three ? "all" : "%d", k + 1);
        om__table_row(&table, "%.2f|%.0f|%.1f|%.1f|%.0f", u->dsc, 100 * u->tpr, 1e3 * ave,
                      1e3 * same, u->ms);
        om__table_cell(&table, u->is_accepted ? "" : u->reason);
    }
    om__table_show(&table, report, "Layouts", NULL);
}

// The underside from above, x to the right, y up: found and true, missed, wrong.
static void add_map(const Att* s, int layout, OmReport* report) {
    const AttResult* r = &s->result[layout];
    int side = s->cells + 1;
    char head[64];
    StudyLines map = {0};
    for (int y = side - 1; y >= 0; --y) {
        for (int k = 0; k < ATT_NUPDATE; ++k) {
            for (int x = 0; x < side; ++x) {
                int i = x + side * y;  // the underside of om_tet_mesh_box, row by row
                bool is_found = r->update[k].attached[i], is_true = r->truth[i];
                om__lines_add(&map, is_found ? (is_true ? "#" : "+") : is_true ? "o" : ".");
            }
            om__lines_add(&map, k + 1 < ATT_NUPDATE ? "   " : "   \n");
        }
    }
    snprintf(head, sizeof head, "Layout %d", layout + 1);
    om__lines_fold(&map, report, head);
}

static void add_maps(const Att* s, OmReport* report) {
    om__report_section(
        report, "Attachments found",
        "The underside from above: # found and true, o missed, + found and not true, . free. From "
        "left to right: views 1, 2, 3, and all three.");
    for (int i = 0; i < s->nlayout; ++i) add_map(s, i, report);
}

static void add_calibration(const Att* s, OmReport* report) {
    const OmStudyAttachmentsSummary* sum = &s->sum;
    double x[OM_STUDY_NBIN], share[OM_STUDY_NBIN], wrong[OM_STUDY_NBIN];
    const double diagonal[2] = {0, 1};
    for (int b = 0; b < OM_STUDY_NBIN; ++b) {
        x[b] = (b + 0.5) / OM_STUDY_NBIN;
        share[b] = sum->bin_count[b] ? sum->bin_share[b] : HUGE_VAL;  // a gap
        wrong[b] = sum->doubt_count[b] ? sum->doubt_wrong[b] : HUGE_VAL;
    }
    OmReportChart chart = {.title = "Are probabilities what they say?",
                           .x_label = "estimated probability, bins of 0.1",
                           .y_label = "share of vertices that is attached",
                           .series = {{"single views", x, share, OM_STUDY_NBIN, false},
                                      {"perfect", diagonal, diagonal, 2, false}},
                           .nseries = 2};
    om_report_heading(report, "Probability and uncertainty");
    om_report_chart(report, &chart);
    OmReportChart doubt = {.title = "Does uncertainty show errors?",
                           .x_label = "uncertainty, bins of 0.1",
                           .y_label = "share of vertices that is wrong",
                           .series = {{"single views", x, wrong, OM_STUDY_NBIN, false}},
                           .nseries = 1};
    om_report_chart(report, &doubt);
}

static OmStatus add_pictures(const Att* s, OmReport* report) {
    om_report_heading(report, "What the depth camera saw");
    for (int i = 0; i < s->nlayout; ++i) {
        MatchSetup setup = om__match_layout_setup(s->first + i, 0, s->cells);
        MatchTruth truth;
        char text[64];
        OM_TRY(om__match_truth_get(&setup, s->def->out_dir, s->def->nworker, NULL, &truth));
        const OmCamera* camera = &truth.head.camera;
        OmPicture picture = {camera->width, camera->height, 3, truth.color[VIEW_FULL]};
        snprintf(text, sizeof text, "layout %d, view 1, %.0f %% facing the camera", i + 1,
                 100 * s->result[i].seen[0]);
        om_report_picture(report, &picture, text);
        om__match_truth_done(&truth);
    }
    return OM_OK;
}

static OmStatus write_report(const Att* s) {
    char text[96];
    OmReport report;
    snprintf(text, sizeof text, "estimated from views of a lifted sheet; layouts of set %d%s",
             s->def->set, s->def->is_quick ? ", quick" : "");
    om_report_begin(&report, "Attachments", text);
    add_outcome(s, &report);
    add_table(s, &report);
    add_layouts(s, &report);
    add_calibration(s, &report);
    add_maps(s, &report);
    OmStatus status = add_pictures(s, &report);
    om__report_section(
        &report, "How",
        "The truth is a sheet of 120 x 120 x 5 mm on a board in the simulated world: one and a half times the "
        "twin's cells along a side, two layers, 0.85 of its stiffness. Each layout is grasped at three places "
        "and lifted by 30, 40 or 50 mm by one arm; the depth camera sees it with the noise of a D435 and the tool "
        "in view. The twin believes in no attachment. AVE and MVE are the mean and largest distance between the "
        "moved twin and the truth at all vertices of the twin.");
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json, vertices.csv ---------------------------------------------------------------------

static void put_guesses(OmJson* json, const Att* s) {
    om_json_open(json, "by", '{');
    for (int guess = 0; guess < OM_STUDY_NGUESS; ++guess) {
        const OmStudyGuessResult* r = &s->sum.by[guess];
        if (!r->is_there) continue;
        om_json_open(json, om__study_guess_name[guess], '{');
        om_json_integer(json, "n", r->dsc.n);
        om__put_quartiles(json, "dsc", 1, r->dsc);
        om__put_quartiles(json, "tpr", 1, r->tpr);
        om__put_quartiles(json, "ave_mm", 1e3, r->ave);
        om__put_quartiles(json, "mve_mm", 1e3, r->mve);
        om__put(json, "refused %d|lost_views %d|processor_ms %f", r->nrefused, r->nlost, r->ms);
        om_json_close(json, '}');
    }
    om_json_close(json, '}');
}

static void put_calibration(OmJson* json, const OmStudyAttachmentsSummary* sum) {
    om_json_open(json, "calibration", '[');
    for (int b = 0; b < OM_STUDY_NBIN; ++b) {
        om__put_object(json, NULL, "from %f|vertices %d|attached %f|uncertain_vertices %d|wrong %f",
                       b / (double)OM_STUDY_NBIN, sum->bin_count[b], sum->bin_share[b],
                       sum->doubt_count[b], sum->doubt_wrong[b]);
    }
    om_json_close(json, ']');
}

static void put_update(OmJson* json, const AttUpdate* u) {
    om__put_object(json, NULL,
                   "is_accepted? %d|reason %s|dsc %f|tpr %f|seen_share %f|moved_share %f|choice %d|"
                   "after_median_mm %f|processor_ms %f|fit_ms %f|infer_ms %f|check_ms %f",
                   u->is_accepted, u->reason, u->dsc, u->tpr, u->seen_share, u->moved_share,
                   u->choice, 1e3 * u->after_median, u->ms, u->fit_ms, u->infer_ms, u->check_ms);
}

static void put_updates(OmJson* json, const char* key, const AttUpdate* update) {
    om_json_open(json, key, '[');
    for (int k = 0; k < ATT_NUPDATE; ++k) put_update(json, &update[k]);
    om_json_close(json, ']');
}

static OmStatus write_json(const Att* s) {
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "set %d|is_met? %d", s->def->set, s->sum.is_met);
    put_guesses(&json, s);
    put_calibration(&json, &s->sum);
    om_json_open(&json, "layouts", '[');
    for (int i = 0; i < s->nlayout; ++i) {
        const AttResult* r = &s->result[i];
        om_json_open(&json, NULL, '{');
        om_json_number(&json, "share", r->share);
        om_json_numbers(&json, "facing", r->seen, MATCH_NGRASP);
        for (int guess = 0; guess < OM_STUDY_NGUESS; ++guess) {
            char key[32];
            if (!s->sum.by[guess].is_there) continue;
            snprintf(key, sizeof key, "ave_%s", om__study_guess_name[guess]);
            om_json_numbers(&json, key, r->ave[guess], MATCH_NGRASP);
            snprintf(key, sizeof key, "mve_%s", om__study_guess_name[guess]);
            om_json_numbers(&json, key, r->mve[guess], MATCH_NGRASP);
        }
        put_updates(&json, "updates", r->update);
        if (s->sum.has_network) {
            put_updates(&json, "network", r->network);
            put_updates(&json, "joint", r->joint);
        }
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static OmStatus write_csv(const Att* s) {
    static const char* const name[ATT_NUPDATE] = {"1", "2", "3", "all"};
    StudyLines t = {0};
    om__lines_add(&t, "layout,views,x_mm,y_mm,true,attached,probability,uncertainty\n");
    for (int i = 0; i < s->nlayout; ++i) {
        const AttResult* r = &s->result[i];
        for (int k = 0; k < ATT_NUPDATE; ++k) {
            const AttUpdate* u = &r->update[k];
            for (int v = 0; v < r->nnode; ++v)
                om__lines_add(&t, "%d,%s,%.1f,%.1f,%d,%d,%.6f,%.6f\n", i + 1, name[k],
                              1e3 * r->node_x[v][0], 1e3 * r->node_x[v][1], r->truth[v],
                              u->attached[v], (double)u->probability[v], (double)u->uncertainty[v]);
        }
    }
    return om__lines_save(&t, s->def->out_dir, "vertices.csv");
}

OmStatus om__att_write(const Att* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_csv(s));
    return write_report(s);
}
