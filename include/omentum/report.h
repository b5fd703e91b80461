/// omentum/report.h: reports as one self-contained HTML file (floor 2).
///
/// Headings, paragraphs, tables, line charts (SVG) and pictures (PNG, embedded), readable on a screen in
/// light or dark, on a phone and on paper, also by colour-blind eyes. All text is escaped. Blocks appear in the
/// order they are added.
///
///     OmReport report;
///     om_report_begin(&report, "Retraction", "sheet, layout 3");
///     om_report_heading(&report, "Forces");
///     om_report_chart(&report, &chart);
///     om_report_save(&report, "report.html");      // frees it, also on failure
#ifndef OMENTUM_REPORT_H
#define OMENTUM_REPORT_H

#include "omentum/base.h"
#include "omentum/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmReport {  // all fields are private
    OmText html;
    OmStatus status;    // the first failure; later calls do nothing
    char message[256];  // its sentence
    bool is_in_section;
    bool is_in_grid;  // pictures are being added
    bool is_in_fold;
    int nchart;
} OmReport;

OM_API void om_report_begin(OmReport* report, const char* title, const char* subtitle);
OM_API void om_report_heading(OmReport* report, const char* text);
OM_API void om_report_paragraph(OmReport* report, const char* text);
/// A paragraph of n links to other files, after a lead: "Runs: a, b". `href` is relative to the report's folder.
OM_API void om_report_links(OmReport* report, const char* lead, const char* const* text,
                            const char* const* href, int n);
/// The outcome as one emphasised sentence. `is_good` selects its colour.
OM_API void om_report_verdict(OmReport* report, const char* text, bool is_good);
/// Numbers side by side: `count` values and their labels.
OM_API void om_report_facts(OmReport* report, const char* const* value, const char* const* label,
                            int count);
/// A table of nrow x ncol cells, row by row, under ncol headings; null is an empty cell. A column is aligned right if
/// all its cells begin with a digit or a sign.
OM_API void om_report_table(OmReport* report, const char* const* heading, int ncol,
                            const char* const* cell, int nrow);
/// Text with its lines and blanks, in fixed width: a plan.
OM_API void om_report_listing(OmReport* report, const char* text);
/// The same, folded under a summary.
OM_API void om_report_details(OmReport* report, const char* summary, const char* text);
/// Blocks added before om_report_end_fold are folded under a summary. Folds do not nest.
OM_API void om_report_begin_fold(OmReport* report, const char* summary);
OM_API void om_report_end_fold(OmReport* report);
/// A picture with a caption; consecutive pictures share rows. Pictures in a fold are decoded when it is opened, all
/// others when the page is, so that they appear in prints.
OM_API void om_report_picture(OmReport* report, const OmPicture* picture, const char* caption);
/// A picture that is a PNG already, such as an animated one.
/// @param png  `size` bytes of a PNG file; others are an error of the report
OM_API void om_report_png(OmReport* report, const char* png, size_t size, const char* caption);

#define OM_REPORT_MAX_SERIES 6

typedef struct OmReportSeries {
    const char* name;
    const double* x;  // ascending
    const double* y;  // values that are not finite leave a gap
    int n;
    bool is_step;  // a value holds until the next point
} OmReportSeries;

typedef struct OmReportSpan {  // an action from begin to end, named above the chart
    const char* label;
    double begin, end;
    bool is_bad;  // marked: the action failed
} OmReportSpan;

typedef struct OmReportBox {  // of a sample of n values; nothing is drawn where n is 0
    double min, lower, median, upper, max;  // ends of the whiskers, quartiles
    int n;
} OmReportBox;

typedef struct OmReportChart {  // zero-initialise; unused fields stay 0
    const char* title;
    const char *x_label, *y_label;  // with units
    OmReportSeries series[OM_REPORT_MAX_SERIES];
    int nseries;
    bool has_limit;  // a dashed line at `limit`
    double limit;
    const char* limit_name;
    double limit2;  // another line, if it has a name
    const char* limit2_name;
    bool is_log_x, is_log_y;  // decades; values that are not above 0 leave a gap
    bool has_range;           // the y axis runs over [y_min, y_max] at least
    double y_min, y_max;
    const double* event;  // thin vertical lines at these x
    int nevent;
    const OmReportSpan* span;  // numbered from 1; named where there is room
    int nspan;
    // box plots instead of lines: ngroup groups along x, in each a box of every series (only its name is used)
    int ngroup;
    const char* const* group;  // names                     (ngroup)
    const OmReportBox* box;    //                (ngroup x nseries)
} OmReportChart;
/// A chart of lines of any number of points, or of boxes; without a finite value, a sentence replaces it.
OM_API void om_report_chart(OmReport* report, const OmReportChart* chart);

typedef struct OmReportMap {  // a grid of numbers seen from above; zero-initialise
    const char* title;        // with the unit
    const char* axes;         // which way x and y run
    int nx, ny;               // cells, 1 to 64 along a side
    const double* value;  // NAN: none; rows with the lowest y first                     (ny x nx)
    const char* const*
        word;  // in cells without a value, or null                           (ny x nx)
    // frames around a cell: 0, 1, or 2 of them; or null                                     (ny x nx)
    const unsigned char* mark;
    double least, most;  // values of the palest and of the darkest colour
    int digits;          // after the point
} OmReportMap;
/// A map with a number in each cell, and its axes numbered from 1.
OM_API void om_report_map(OmReport* report, const OmReportMap* map);

/// Keep a failure of the caller's own work on a block, with its message (om_error_message): om_report_save
/// returns it, as it returns the first failure of a block. A status >= 0 changes nothing.
OM_API void om_report_fail(OmReport* report, OmStatus status);

/// Write the file whole or not at all, and free the report.
/// @return OM_OK; the first failure of the calls before; OM_IO
OM_API OmStatus om_report_save(OmReport* report, const char* path);
/// Free a report that is not saved.
OM_API void om_report_done(OmReport* report);

#ifdef __cplusplus
}
#endif
#endif
