// study_correspondence_report.c: the study of correspondence as report.html, study.json and errors.csv.
#include <math.h>
#include <string.h>

#include "studies/study_correspondence.h"
#include "studies/study_table.h"

// One case of a way.
static OmStatus one_case(const Cor* s, int k, OmStudyWay way, OmStudyWayResult* result) {
    unsigned char which[256] = {0};
    which[k] = 1;
    return om__cor_summarise(s, way, which, result);
}

// ---- report.html ----------------------------------------------------------------------------------

static void add_summary(const OmStudyWayResult* result, const char* title, OmReport* report) {
    StudyTable table =
        om__table("way|median, mm|90 %, mm|worst, mm|answered, %|lost cases|processor time, ms");
    for (int way = 0; way < OM_STUDY_NWAY; ++way) {
        const OmStudyWayResult* r = &result[way];
        om__table_row(&table, "%s|%.1f|%.1f|%.1f|%.0f|%d|%.1f", om__study_way_title[way],
                      1e3 * r->median, 1e3 * r->p90, 1e3 * r->worst, 100 * r->answered, r->nlost,
                      r->ms);
    }
    om_report_heading(report, title);
    om__table_end(&table, report);
}

static OmStatus add_cases(const Cor* s, OmReport* report) {
    char heading[600] = "case|points judged";
    OmStatus status = OM_OK;
    for (int way = 0; way < OM_STUDY_NWAY; ++way) {
        size_t n = strlen(heading);
        snprintf(heading + n, sizeof heading - n, "|%s", om__study_way_title[way]);
    }
    StudyTable table = om__table(heading);
    for (int k = 0; status == OM_OK && k < s->ncase; ++k) {
        for (int way = 0; status == OM_OK && way < OM_STUDY_NWAY; ++way) {
            OmStudyWayResult r;
            status = one_case(s, k, way, &r);
            if (way == 0) om__table_row(&table, "%s|%d", s->list[k].name, r.npoint);
            const char* lost = s->result[k].way[way].is_lost ? ", lost" : "";
            if (r.answered > 0.995)
                om__table_row(&table, "%.1f / %.1f / %.1f%s", 1e3 * r.median, 1e3 * r.p90,
                              1e3 * r.worst, lost);
            else if (r.answered > 0)
                om__table_row(&table, "%.1f / %.1f / %.1f, %.0f %%%s", 1e3 * r.median, 1e3 * r.p90,
                              1e3 * r.worst, 100 * r.answered, lost);
            else
                om__table_row(&table, "none%s", lost);
        }
    }
    om_report_heading(report, "Cases");
    om_report_paragraph(
        report,
        "Error in the rest shape in mm: median / 90 % / worst, over points that moved by "
        "5 mm or more; a percentage is the share of them with an answer, where it is not "
        "all. \"fewer\", \"more\", \"elsewhere\", \"none\" are the attachments of the twin.");
    om__table_end(&table, report);
    return status;
}

// Median error by case: a line for each way.
static OmStatus add_chart(const Cor* s, OmReport* report) {
    double* value;
    OM_ALLOC(value, (size_t)(OM_STUDY_NWAY + 1) * (size_t)s->ncase);
    double* x = value + OM_STUDY_NWAY * s->ncase;
    OmReportChart chart = {.title = "Median error by case",
                           .x_label = "case, in the order of the table",
                           .y_label = "median error, mm",
                           .has_limit = true,
                           .limit = 1e3 * OM_STUDY_COR_MEDIAN,
                           .limit_name = "goal"};
    OmStatus status = OM_OK;
    for (int k = 0; k < s->ncase; ++k) x[k] = k + 1;
    // the best ways: the last ones
    for (int way = OM_STUDY_NWAY - OM_REPORT_MAX_SERIES; way < OM_STUDY_NWAY; ++way) {
        double* y = value + way * s->ncase;
        for (int k = 0; k < s->ncase && status == OM_OK; ++k) {
            OmStudyWayResult r;
            status = one_case(s, k, way, &r);
            y[k] = r.answered > 0 ? 1e3 * r.median : HUGE_VAL;  // a gap
        }
        chart.series[chart.nseries++] =
            (OmReportSeries){om__study_way_title[way], x, y, s->ncase, false};
    }
    if (status == OM_OK) om_report_chart(report, &chart);
    om_free(value);
    return status;
}

static OmStatus add_pictures(const Cor* s, OmReport* report) {
    om_report_heading(report, "What the depth camera saw");
    bool is_shown[MATCH_NSETUP] = {false};
    for (int k = 0; k < s->ncase; ++k) {
        const MatchCase* c = &s->list[k];
        if (is_shown[c->setup]) continue;
        is_shown[c->setup] = true;
        MatchTruth truth;
        const MatchSetup* setup = &om__match_setup[c->setup];
        OM_TRY(om__match_truth_get(setup, s->def->out_dir, s->def->nworker, NULL, &truth));
        const OmCamera* camera = &truth.head.camera;
        OmPicture picture = {camera->width, camera->height, 3, truth.color[c->view]};
        om_report_picture(report, &picture, c->name);
        om__match_truth_done(&truth);
    }
    return OM_OK;
}

static OmStatus write_report(const Cor* s) {
    OmReport report;
    om_report_begin(&report, "Correspondence",
                    "material points of a folded and pulled sheet, by several ways");
    om__report_goals(&report, "Folds of 135 degrees, tracks, a twin that has gone 70 % of the way",
                     om__cor_goals(&s->sum));
    add_summary(s->sum.all, "All cases", &report);
    add_summary(s->sum.fold, "Folds of 135 degrees, right attachments", &report);
    OmStatus status = add_chart(s, &report);
    if (status == OM_OK) status = add_cases(s, &report);
    if (status == OM_OK) status = add_pictures(s, &report);
    om__report_section(
        &report, "How",
        "The truth is a sheet of 120 x 120 x 5 mm on a board in the simulated world: one and a half times "
        "the twin's cells along a side, 0.85 of its stiffness, moved by the world's arms and seen "
        "by its depth camera. A scan has points %.1f mm apart; the scans have %d to %d points, the twin's "
        "surface %d vertices. The true material point is the nearest point of the true surface that faces the "
        "camera (the scans are %.2f mm from it on average). The twin is moved by the measured tips. A part of "
        "the view is cut off by a plane. Tracks are of pictures at every 5 mm of a tip's way and as often in "
        "the wait of one second after it.",
        1e3 * s->def->spacing, s->result[0].npoint, s->result[s->ncase - 1].npoint,
        s->result[0].nmodel, 1e3 * s->result[0].off);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json, errors.csv -----------------------------------------------------------------------

static void put_way(OmJson* json, OmStudyWay way, const OmStudyWayResult* r) {
    om_json_open(json, om__study_way_name[way], '{');
    om__put(json, "points %d|lost %d|answered %f", r->npoint, r->nlost, r->answered);
    if (r->answered > 0)
        om__put(json, "median_mm %f|p90_mm %f|worst_mm %f", 1e3 * r->median, 1e3 * r->p90,
                1e3 * r->worst);
    om_json_number(json, "processor_ms", r->ms);
    om_json_close(json, '}');
}

static OmStatus put_cases(OmJson* json, const Cor* s) {
    om_json_open(json, "cases", '[');
    for (int k = 0; k < s->ncase; ++k) {
        const MatchCase* c = &s->list[k];
        const CorResult* r = &s->result[k];
        om_json_open(json, NULL, '{');
        om__put(json,
                "case %s|motion %s|view %s|seen %f|attachments %s|scan_points %d|model_vertices %d|"
                "scan_ms %f|scan_off_mm %f",
                c->name, om__match_setup[c->setup].name, om__match_view_name[c->view], c->seen,
                om__match_belief_name[c->belief], r->npoint, r->nmodel, r->scan_ms, 1e3 * r->off);
        om_json_open(json, "ways", '{');
        for (int way = 0; way < OM_STUDY_NWAY; ++way) {
            OmStudyWayResult result;
            OM_TRY(one_case(s, k, way, &result));
            put_way(json, way, &result);
        }
        om_json_close(json, '}');
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
    return OM_OK;
}

static OmStatus write_json(const Cor* s) {
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "spacing_mm %f|is_met? %d", 1e3 * s->def->spacing, s->sum.is_met);
    om_json_open(&json, "all", '{');
    for (int way = 0; way < OM_STUDY_NWAY; ++way) put_way(&json, way, &s->sum.all[way]);
    om_json_close(&json, '}');
    om_json_open(&json, "fold_135_right", '{');
    for (int way = 0; way < OM_STUDY_NWAY; ++way) put_way(&json, way, &s->sum.fold[way]);
    om_json_close(&json, '}');
    OmStatus status = put_cases(&json, s);
    return om__study_save_json(s->def->out_dir, &json, status);
}

static OmStatus write_csv(const Cor* s) {
    StudyLines t = {0};
    om__lines_add(&t, "case,moved_mm");
    for (int way = 0; way < OM_STUDY_NWAY; ++way)
        om__lines_add(&t, ",%s_mm", om__study_way_name[way]);
    for (int k = 0; k < s->ncase; ++k) {
        const CorResult* r = &s->result[k];
        for (int i = 0; i < r->npoint; ++i) {
            om__lines_add(&t, "\n%d,%.2f", k + 1, 1e3 * (double)r->moved[i]);
            for (int way = 0; way < OM_STUDY_NWAY; ++way) {
                const double e = 1e3 * (double)r->way[way].error[i];
                om__lines_add(&t, e >= 0 ? ",%.2f" : ",", e);
            }
        }
    }
    om__lines_add(&t, "\n");
    return om__lines_save(&t, s->def->out_dir, "errors.csv");
}

OmStatus om__cor_write(const Cor* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_csv(s));
    return write_report(s);
}
