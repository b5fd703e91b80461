// report_internal.h: what the files of the room share.
#ifndef OMENTUM_REPORT_INTERNAL_H
#define OMENTUM_REPORT_INTERNAL_H

#include "omentum/report.h"

// Keep a failure and its message.
void om__report_keep(OmReport* report, OmStatus status);

// Append to the page unless something failed before.
#define PUT(report, ...)                                                             \
    do {                                                                             \
        if ((report)->status == OM_OK)                                               \
            om__report_keep((report), om_text_append(&(report)->html, __VA_ARGS__)); \
    } while (0)
// Close what is open of pictures: every block but a picture calls it first.
void om__report_begin_block(OmReport* report);
void om__report_escape(OmReport* report, const char* text);

extern const char* const om__report_style[];  // parts of the style sheet, null at the end

#endif
