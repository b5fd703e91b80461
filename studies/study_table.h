// study_table.h: what the reports of all studies share: tables by rows, sentences with numbers, files of a folder.
//
//     StudyTable t = om__table("depth, mm|lesions|error, mm");
//     for (...) om__table_row(&t, "%.0f|%d|%.2f", depth, n, error);
//     om__table_end(&t, report);
#ifndef OMENTUM_STUDY_TABLE_H
#define OMENTUM_STUDY_TABLE_H

#include "omentum/report.h"
#include "studies/study_attach_protocol.h"

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
void om__table_quartiles(StudyTable* t, double scale, const char* format, OmStudyQuartiles q);
// One cell in mm with a mark; below 0: empty.
void om__table_error(StudyTable* t, double error, const char* mark);
// A table with a column for each depth of the contact study: "FIRST|D10|...", and what is behind them.
StudyTable om__study_depth_table(const char* first, const double* depth, const char* last);
// Put the table into the report, if it has rows, and free it.
void om__table_end(StudyTable* t, OmReport* report);

// As om_report_paragraph, om_report_heading, om_report_verdict, with numbers.
void om__report_say(OmReport* report, const char* format, ...) OM_PRINTF(2, 3);
void om__report_head(OmReport* report, const char* format, ...) OM_PRINTF(2, 3);
void om__report_judge(OmReport* report, bool is_good, const char* format, ...) OM_PRINTF(3, 4);
// Labels, and as many values, between bars.
void om__report_facts(OmReport* report, const char* label, const char* format, ...) OM_PRINTF(3, 4);
// Write DIR/report.html; after a failure the report is freed and the failure returned.
OmStatus om__report_end(OmReport* report, const char* dir, OmStatus status);

// Write DIR/NAME from the text, unless its making has failed, and free the text.
OmStatus om__study_save_text(const char* dir, const char* name, OmText* text, OmStatus status);
// The same of study.json; the object is closed by the caller.
OmStatus om__study_save_json(const char* dir, OmJson* json, OmStatus status);

#endif
