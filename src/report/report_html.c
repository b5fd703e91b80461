// report_html.c: a report is a string of HTML that grows block by block.
#include <string.h>

#include "omentum/report.h"

static const char style[] =
    ":root{--ink:#1b2430;--soft:#5b6673;--line:#d9dee5;--page:#fbfbfa;--card:#fff;--good:#117a4a;--bad:#b3261e;"
    "--a:#2563a8;--b:#c2571a;--c:#2a8a5c;--d:#7a4fa3;--e:#a83250;--f:#6b7280}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e7ebf0;--soft:#9aa6b2;--line:#333c47;--page:#14181d;"
    "--card:#1c2229;--good:#5fd39b;--bad:#ff8a80;--a:#7cb4f2;--b:#f2a36b;--c:#74d3a6;--d:#c39be8;--e:#f08aa5;"
    "--f:#a3acb8}}"
    "*{box-sizing:border-box}body{margin:0;background:var(--page);color:var(--ink);"
    "font:16px/1.5 system-ui,-apple-system,\"Segoe UI\",Roboto,sans-serif}"
    "main{max-width:1040px;margin:0 auto;padding:40px 24px 80px}"
    "h1{font-size:30px;line-height:1.2;margin:0;letter-spacing:-.01em}"
    ".subtitle{color:var(--soft);margin:6px 0 24px}"
    "h2{font-size:20px;margin:40px 0 12px;padding-top:16px;border-top:1px solid var(--line)}"
    ".verdict{font-size:18px;font-weight:600;padding:12px 16px;border-left:4px solid;background:var(--card);"
    "margin:0 0 20px}.good{color:var(--good)}.bad{color:var(--bad)}"
    ".facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:12px;margin:16px 0}"
    ".fact{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:12px 14px}"
    ".fact b{display:block;font-size:22px;font-variant-numeric:tabular-nums}"
    ".fact span{color:var(--soft);font-size:13px}"
    "table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}"
    "th,td{text-align:left;padding:6px 10px;border-bottom:1px solid var(--line);vertical-align:top}"
    "th{color:var(--soft);font-weight:600}.wide{overflow-x:auto}"
    ".grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:16px}"
    "figure{margin:0}figure img{width:100%;border-radius:6px;display:block}"
    "figcaption{font-size:13px;color:var(--soft);padding:6px 2px}"
    "details{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:8px 14px;margin:12px 0}"
    "summary{cursor:pointer;font-weight:600}pre{overflow-x:auto;font-size:13px;line-height:1.45}"
    "svg{width:100%;height:auto;background:var(--card);border:1px solid var(--line);border-radius:8px;"
    "margin:8px 0;font:12px system-ui,sans-serif}"
    "svg text{fill:var(--soft)}svg .title{fill:var(--ink);font-weight:600;font-size:14px}"
    "svg .axis{stroke:var(--line)}svg .limit{stroke:var(--bad);stroke-dasharray:6 4}"
    "svg .event{stroke:var(--line);stroke-dasharray:2 3}"
    "@media print{body{background:#fff}main{padding:0}details{border:0}h2{break-after:avoid}"
    "figure,svg,.fact{break-inside:avoid}}";

static void put(OmReport* r, const char* html) {
    if (r->status == OM_OK) r->status = om_text_append_raw(&r->html, html, strlen(html));
}
static void put_text(OmReport* r, const char* text) {
    if (r->status == OM_OK) r->status = om_text_append_html(&r->html, text ? text : "");
}

static void close_grid(OmReport* r) {
    if (r->is_in_grid) put(r, "</div>\n");
    r->is_in_grid = false;
}

static void put_element(OmReport* r, const char* open, const char* text, const char* close) {
    close_grid(r);
    put(r, open);
    put_text(r, text);
    put(r, close);
}

void om_report_begin(OmReport* r, const char* title, const char* subtitle) {
    memset(r, 0, sizeof *r);
    put(r, "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>");
    put_text(r, title);
    put(r, "</title>\n<style>");
    put(r, style);
    put(r, "</style>\n</head>\n<body>\n<main>\n<h1>");
    put_text(r, title);
    put(r, "</h1>\n<p class=\"subtitle\">");
    put_text(r, subtitle);
    put(r, "</p>\n");
}

void om_report_heading(OmReport* r, const char* text) { put_element(r, "<h2>", text, "</h2>\n"); }
void om_report_paragraph(OmReport* r, const char* text) { put_element(r, "<p>", text, "</p>\n"); }
void om_report_verdict(OmReport* r, const char* text, bool is_good) {
    put_element(r, is_good ? "<p class=\"verdict good\">" : "<p class=\"verdict bad\">", text,
                "</p>\n");
}

void om_report_facts(OmReport* r, const char* const* value, const char* const* label, int count) {
    close_grid(r);
    put(r, "<div class=\"facts\">\n");
    for (int i = 0; i < count; ++i) {
        put(r, "<div class=\"fact\"><b>");
        put_text(r, value[i]);
        put(r, "</b><span>");
        put_text(r, label[i]);
        put(r, "</span></div>\n");
    }
    put(r, "</div>\n");
}

void om_report_table(OmReport* r, const char* const* heading, int ncol, const char* const* cell,
                     int nrow) {
    close_grid(r);
    put(r, "<div class=\"wide\"><table>\n<tr>");
    for (int c = 0; c < ncol; ++c) {
        put(r, "<th>");
        put_text(r, heading[c]);
        put(r, "</th>");
    }
    put(r, "</tr>\n");
    for (int i = 0; i < nrow; ++i) {
        put(r, "<tr>");
        for (int c = 0; c < ncol; ++c) {
            put(r, "<td>");
            put_text(r, cell[i * ncol + c]);
            put(r, "</td>");
        }
        put(r, "</tr>\n");
    }
    put(r, "</table></div>\n");
}

void om_report_details(OmReport* r, const char* summary, const char* text) {
    close_grid(r);
    put(r, "<details><summary>");
    put_text(r, summary);
    put(r, "</summary><pre>");
    put_text(r, text);
    put(r, "</pre></details>\n");
}

void om_report_picture(OmReport* r, const OmPicture* picture, const char* caption) {
    if (r->status < 0) return;
    OmText png = {0};
    OmStatus status = om_picture_encode_png(picture, &png);
    if (!r->is_in_grid) put(r, "<div class=\"grid\">\n");
    r->is_in_grid = true;
    put(r, "<figure><img alt=\"\" src=\"data:image/png;base64,");
    if (status == OM_OK && r->status == OM_OK) {
        r->status = om_text_append_base64(&r->html, png.str, png.len);
    } else if (r->status == OM_OK) {
        r->status = status;
    }
    put(r, "\"><figcaption>");
    put_text(r, caption);
    put(r, "</figcaption></figure>\n");
    om_text_done(&png);
}

OmStatus om_report_save(OmReport* r, const char* path) {
    close_grid(r);
    put(r, "</main>\n</body>\n</html>\n");
    OmStatus status = r->status;
    if (status == OM_OK) status = om_file_write(path, r->html.str, r->html.len);
    om_report_done(r);
    return status;
}

void om_report_done(OmReport* r) {
    if (!r) return;
    om_text_done(&r->html);
    memset(r, 0, sizeof *r);
}
