// report_page.c: the blocks of a page. The first failure is kept and returned with its message at the end.
#include <string.h>

#include "report/report_internal.h"

void om__report_keep(OmReport* r, OmStatus status) {
    if (status >= 0 || r->status < 0) return;
    r->status = status;
    snprintf(r->message, sizeof r->message, "%s", om_error_message());
}

void om_report_fail(OmReport* r, OmStatus status) { om__report_keep(r, status); }

void om__report_escape(OmReport* r, const char* text) {
    if (r->status == OM_OK) om__report_keep(r, om_text_append_html(&r->html, text ? text : ""));
}

void om__report_begin_block(OmReport* r) {
    if (r->is_in_grid) PUT(r, "</div>\n");
    r->is_in_grid = false;
}

// ---- words ------------------------------------------------------------------------------------------------

void om_report_begin(OmReport* r, const char* title, const char* subtitle) {
    *r = (OmReport){0};
    PUT(r, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<title>");
    om__report_escape(r, title);
    PUT(r, "</title>\n<style>\n");
    for (const char* const* part = om__report_style; *part; ++part) PUT(r, "%s", *part);
    PUT(r, "</style>\n</head>\n<body>\n<main>\n<header><h1>");
    om__report_escape(r, title);
    PUT(r, "</h1>");
    if (subtitle && *subtitle) {
        PUT(r, "<p class=\"sub\">");
        om__report_escape(r, subtitle);
        PUT(r, "</p>");
    }
    PUT(r, "</header>\n");
}

void om_report_links(OmReport* r, const char* lead, const char* const* text,
                     const char* const* href, int n) {
    om__report_begin_block(r);
    PUT(r, "<p>");
    om__report_escape(r, lead);
    for (int i = 0; i < n; ++i) {
        PUT(r, "%s<a href=\"", i ? ", " : "");
        om__report_escape(r, href[i]);
        PUT(r, "\">");
        om__report_escape(r, text[i]);
        PUT(r, "</a>");
    }
    PUT(r, "</p>\n");
}

void om_report_verdict(OmReport* r, const char* text, bool is_good) {
    om__report_begin_block(r);
    PUT(r, "<div class=\"verdict %s\"><span role=\"img\" aria-label=\"%s\">%s</span><span>",
        is_good ? "good" : "bad", is_good ? "good" : "not good", is_good ? "&#10003;" : "&#10007;");
    om__report_escape(r, text);
    PUT(r, "</span></div>\n");
}

void om_report_heading(OmReport* r, const char* text) {
    om__report_begin_block(r);
    PUT(r, r->is_in_section ? "</section>\n<section>\n<h2>" : "<section>\n<h2>");
    r->is_in_section = true;
    om__report_escape(r, text);
    PUT(r, "</h2>\n");
}

void om_report_paragraph(OmReport* r, const char* text) {
    om__report_begin_block(r);
    PUT(r, "<p>");
    om__report_escape(r, text);
    PUT(r, "</p>\n");
}

void om_report_facts(OmReport* r, const char* const* value, const char* const* label, int count) {
    om__report_begin_block(r);
    PUT(r, "<dl class=\"facts\">\n");
    for (int i = 0; i < count; ++i) {
        PUT(r, "<div><dt>");
        om__report_escape(r, label[i]);
        PUT(r, "</dt><dd>");
        om__report_escape(r, value[i]);
        PUT(r, "</dd></div>\n");
    }
    PUT(r, "</dl>\n");
}

void om_report_listing(OmReport* r, const char* text) {
    om__report_begin_block(r);
    PUT(r, "<div class=\"card\"><pre>");
    om__report_escape(r, text);
    PUT(r, "</pre></div>\n");
}

void om_report_details(OmReport* r, const char* summary, const char* text) {
    om__report_begin_block(r);
    PUT(r, "<details><summary>");
    om__report_escape(r, summary);
    PUT(r, "</summary><pre>");
    om__report_escape(r, text);
    PUT(r, "</pre></details>\n");
}

void om_report_begin_fold(OmReport* r, const char* summary) {
    om__report_begin_block(r);
    PUT(r, "<details><summary>");
    om__report_escape(r, summary);
    PUT(r, "</summary>\n");
    r->is_in_fold = true;
}

void om_report_end_fold(OmReport* r) {
    om__report_begin_block(r);
    r->is_in_fold = false;
    PUT(r, "</details>\n");
}

// ---- tables ---------------------------------------------------------------------------------------------

static bool is_number(const char* cell) {
    if (*cell == '-' || *cell == '+') ++cell;
    return *cell >= '0' && *cell <= '9';
}

// True for a column of numbers, which is aligned right: every cell that is not empty begins as a number.
static bool is_number_column(int column, int ncolumn, int nrow, const char* const* cell) {
    bool is_any = false;
    for (int i = 0; i < nrow; ++i) {
        const char* c = cell[(size_t)i * (size_t)ncolumn + (size_t)column];
        if (!c || !*c) continue;
        if (!is_number(c)) return false;
        is_any = true;
    }
    return is_any;
}

void om_report_table(OmReport* r, const char* const* heading, int ncol, const char* const* cell,
                     int nrow) {
    enum { MAX_COLUMN = 32 };
    om__report_begin_block(r);
    if (ncol < 1 || ncol > MAX_COLUMN || nrow < 0) {
        om__report_keep(r, om_error(OM_INVALID, "report: a table of %d x %d; 1 to %d columns", nrow,
                                    ncol, MAX_COLUMN));
        return;
    }
    const char* class[MAX_COLUMN];
    for (int k = 0; k < ncol; ++k)
        class[k] = is_number_column(k, ncol, nrow, cell) ? " class=\"n\"" : "";
    PUT(r, "<div class=\"card scroll\"><table>\n");
    PUT(r, "<thead><tr>");
    for (int k = 0; k < ncol; ++k) {
        PUT(r, "<th scope=\"col\"%s>", class[k]);
        om__report_escape(r, heading[k]);
        PUT(r, "</th>");
    }
    PUT(r, "</tr></thead>\n");
    PUT(r, "<tbody>\n");
    for (int i = 0; i < nrow; ++i) {
        PUT(r, "<tr>");
        for (int k = 0; k < ncol; ++k) {
            PUT(r, "<td%s>", class[k]);
            om__report_escape(r, cell[(size_t)i * (size_t)ncol + (size_t)k]);
            PUT(r, "</td>");
        }
        PUT(r, "</tr>\n");
    }
    PUT(r, "</tbody></table></div>\n");
}

// ---- pictures ---------------------------------------------------------------------------------------------

// A big-endian number at this place of a PNG: bytes 16 and 20 are its width and height.
static int number_at(const char* png, int at) {
    const unsigned char* p = (const unsigned char*)png + at;
    return (p[1] << 16) + (p[2] << 8) + p[3];
}

void om_report_png(OmReport* r, const char* png, size_t size, const char* caption) {
    if (size < 33 || memcmp(png, "\x89PNG\r\n\x1a\n", 8) != 0) {
        om__report_keep(r, om_error(OM_INVALID, "a picture of the report is no PNG"));
        return;
    }
    if (!r->is_in_grid) PUT(r, "<div class=\"pictures\">\n");
    r->is_in_grid = true;
    PUT(r, "<figure><img alt=\"");
    om__report_escape(r, caption);
    // a picture outside of a fold is loaded at once: browsers leave lazy pictures blank in prints and screenshots
    PUT(r, "\" width=\"%d\" height=\"%d\" loading=\"%s\" src=\"data:image/png;base64,",
        number_at(png, 16), number_at(png, 20), r->is_in_fold ? "lazy" : "eager");
    if (r->status == OM_OK) om__report_keep(r, om_text_append_base64(&r->html, png, size));
    PUT(r, "\">");
    if (caption && *caption) {
        PUT(r, "<figcaption>");
        om__report_escape(r, caption);
        PUT(r, "</figcaption>");
    }
    PUT(r, "</figure>\n");
}

void om_report_picture(OmReport* r, const OmPicture* picture, const char* caption) {
    OmText png = {0};
    if (r->status == OM_OK) om__report_keep(r, om_picture_encode_png(picture, &png));
    if (r->status == OM_OK) om_report_png(r, png.str, png.len, caption);
    om_text_done(&png);
}

// ---- the end ----------------------------------------------------------------------------------------------

OmStatus om_report_save(OmReport* r, const char* path) {
    om__report_begin_block(r);
    PUT(r, "%s</main>\n</body>\n</html>\n", r->is_in_section ? "</section>\n" : "");
    OmStatus status = r->status < 0 ? om_error(r->status, "%s", r->message)
                                    : om_file_write(path, r->html.str, r->html.len);
    om_report_done(r);
    return status;
}

void om_report_done(OmReport* r) {
    if (!r) return;
    om_text_done(&r->html);
    *r = (OmReport){0};
}
