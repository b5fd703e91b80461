// report_check.h: a small checker of HTML as reports write it: every tag closed in order, no stray brackets.
#ifndef OMENTUM_REPORT_CHECK_H
#define OMENTUM_REPORT_CHECK_H

#include <ctype.h>
#include <unistd.h>

#include "omentum/report.h"
#include "test_common.h"

static inline bool is_void_tag(const char* name) {
    return strcmp(name, "meta") == 0 || strcmp(name, "img") == 0;
}

// The number of elements; fails the test where the page is not well formed.
static inline int check_html(const char* html) {
    enum { MAX_DEPTH = 64, MAX_NAME = 24 };
    char stack[MAX_DEPTH][MAX_NAME];
    int depth = 0, count = 0;
    const char* p = html;
    assert_int_equal(strncmp(p, "<!DOCTYPE html>", 15), 0);
    p += 15;
    while (*p) {
        if (*p == '>') fail_msg("a stray > before: %.60s", p);
        if (*p == '&') assert_non_null(strpbrk(p, ";<"));
        if (*p != '<') {
            ++p;
            continue;
        }
        bool is_end = p[1] == '/';
        p += is_end ? 2 : 1;
        char name[MAX_NAME];
        int n = 0;
        while (isalnum((unsigned char)*p) && n + 1 < MAX_NAME) name[n++] = *p++;
        name[n] = 0;
        if (n == 0) fail_msg("a stray < before: %.60s", p);
        bool is_quoted = false;
        while (*p && (is_quoted || *p != '>')) {
            if (*p == '"') is_quoted = !is_quoted;
            if (*p == '<') fail_msg("< inside tag <%s", name);
            ++p;
        }
        if (*p != '>') fail_msg("tag <%s is not ended", name);
        bool is_empty = p[-1] == '/' || is_void_tag(name);
        ++p;
        if (is_end) {
            if (depth == 0 || strcmp(stack[depth - 1], name) != 0)
                fail_msg("</%s> closes <%s>", name, depth ? stack[depth - 1] : "nothing");
            --depth;
            continue;
        }
        ++count;
        if (is_empty) continue;
        assert_true(depth < MAX_DEPTH);
        strcpy(stack[depth++], name);
    }
    if (depth) fail_msg("<%s> is not closed", stack[depth - 1]);
    return count;
}

// Save a report, read it back, check it; the caller frees the text.
static inline char* checked_page(OmReport* report) {
    char path[] = "/tmp/omentum-report-XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    assert_ok(om_report_save(report, path));
    char* html;
    size_t size;
    assert_ok(om_file_read(path, 1 << 24, &html, &size));
    close(file);
    remove(path);
    check_html(html);
    return html;
}

static inline int count_text(const char* where, const char* what) {
    int n = 0;
    for (; (where = strstr(where, what)); where += strlen(what)) ++n;
    return n;
}

#endif
