// report_internal.h: functions that the files of this room share.
#ifndef OMENTUM_REPORT_INTERNAL_H
#define OMENTUM_REPORT_INTERNAL_H

#include "omentum/report.h"

// Keep a failure and its message.
void om__report_keep(OmReport* report, OmStatus status);

// Append to the page, unless a call failed before.
#define PUT(report, ...)                                                             \
    do {                                                                             \
        if ((report)->status == OM_OK)                                               \
            om__report_keep((report), om_text_append(&(report)->html, __VA_ARGS__)); \
    } while (0)
// Close an open row of pictures: every block except a picture calls it first.
void om__report_begin_block(OmReport* report);
void om__report_escape(OmReport* report, const char* text);

extern const char* const om__report_style[];  // parts of the style sheet, null at the end

#endif
