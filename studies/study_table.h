// study_table.h: what the reports of all studies share: tables by rows, sentences with numbers, files of a folder.
//
//     StudyTable t = om__table("depth, mm|lesions|error, mm");
//     for (...) om__table_row(&t, "%.0f|%d|%.2f", depth, n, error);
//     om__table_end(&t, report);
//
//     OmText text = {0};
//     OmJson json = om__json(&text);
//     om__put(&json, "lesions %d|error_mm %f|is_met? %d", n, error, is_met);
//     return om__study_save_json(dir, &json, OM_OK);
#ifndef OMENTUM_STUDY_TABLE_H
#define OMENTUM_STUDY_TABLE_H

#include "omentum/report.h"
#include "omentum/sense.h"
#include "studies/study.h"
#include "studies/study_stats.h"

typedef struct StudyTable {
    OmText text;  // headings and cells, each with its zero byte
    int ncol, ncell;
    OmStatus status;  // the first failure; the report then has it
} StudyTable;

// Headings between bars; the first one may be empty.
StudyTable om__table(const char* heading);
// Append cells: a whole row or a part of it. A bar divides cells, in the format and in its arguments.
void om__table_row(StudyTable* t, const char* format, ...) OM_PRINTF(2, 3);
// One cell, bars and all; null: empty.
void om__table_cell(StudyTable* t, const char* text);
// One cell: median and quartiles.
void om__table_quartiles(StudyTable* t, double scale, const char* format, StudySample q);
// One cell in mm with a mark; below 0: empty.
void om__table_error(StudyTable* t, double error, const char* mark);
// A table with a column for each depth of the contact study: "FIRST|D10|...", and what is behind them.
StudyTable om__study_depth_table(const char* first, const double* depth, const char* last);
// A line for each of n models: errors in mm at the depths (m) of the contact study, NaN: none.
void om__report_depths(OmReport* report, const char* title, int n, const char* const* name,
                       const double* depth, double error[][OM_STUDY_NDEPTH]);
// Put the table into the report, if it has rows, and free it.
void om__table_end(StudyTable* t, OmReport* report);
// The same under a heading, with a paragraph below; null: none.
void om__table_show(StudyTable* t, OmReport* report, const char* heading, const char* text);

// As om_report_paragraph, om_report_heading, om_report_verdict, with numbers.
void om__report_say(OmReport* report, const char* format, ...) OM_PRINTF(2, 3);
void om__report_head(OmReport* report, const char* format, ...) OM_PRINTF(2, 3);
// A heading, and a paragraph with numbers.
void om__report_section(OmReport* report, const char* heading, const char* format, ...)
    OM_PRINTF(3, 4);
void om__report_judge(OmReport* report, bool is_good, const char* format, ...) OM_PRINTF(3, 4);
// Labels, and as many values, between bars.
void om__report_facts(OmReport* report, const char* label, const char* format, ...) OM_PRINTF(3, 4);
// A picture of a scene, which is committed before, seen by a camera.
OmStatus om__report_render(OmReport* report, OmSenseScene* scene, const OmCamera* camera,
                           int nworker, const char* caption);
// Write DIR/report.html; after a failure the report is freed and the failure returned.
OmStatus om__report_end(OmReport* report, const char* dir, OmStatus status);

// Begin study.json: the object that om__study_save_json closes.
OmJson om__json(OmText* text);
// Keys with their values, between bars: "KEY TYPE", where TYPE is %d, %lld, %f or %s. "KEY? %d": true or false.
void om__put(OmJson* json, const char* format, ...) OM_PRINTF(2, 3);
// An object of them; key: null inside an array.
void om__put_object(OmJson* json, const char* key, const char* format, ...) OM_PRINTF(3, 4);
// Three numbers; the largest one stands for infinity and NaN, which JSON has not.
void om__put_vec3(OmJson* json, const char* key, OmVec3 v);
double om__finite(double value);
// Write DIR/study.json, unless its making has failed, and free the text.
OmStatus om__study_save_json(const char* dir, OmJson* json, OmStatus status);

typedef struct StudyLines {  // text for a file or a fold; zero-initialise
    OmText text;
    OmStatus status;  // the first failure: later lines are left out, and the end returns it
} StudyLines;
// Append as printf does; the format has the line end.
void om__lines_add(StudyLines* lines, const char* format, ...) OM_PRINTF(2, 3);
// Write DIR/NAME, and free the text.
OmStatus om__lines_save(StudyLines* lines, const char* dir, const char* name);
// Put the text into the report, folded under a summary, if there is any, and free it.
void om__lines_fold(StudyLines* lines, OmReport* report, const char* summary);

// ---- goals: one list judges them and shows them, beside the thesis's values -------------------------

// A value that was not measured is NaN: its goal is missed.
typedef struct StudyGoal {
    const char* what;     // "median DSC of single views"
    const char* format;   // of both numbers: "%.2f", "%.0f %%"
    double found, bound;  // in the unit of the format
    bool is_most;         // `found` is at most `bound`; else at least
    const char* thesis;   // its value; null: none
} StudyGoal;

typedef struct StudyGoals {
    int n;
    StudyGoal goal[10];
} StudyGoals;

bool om__goals_met(StudyGoals goals);
// A verdict on `subject`, and a row for each goal.
void om__report_goals(OmReport* report, const char* subject, StudyGoals goals);

#endif
