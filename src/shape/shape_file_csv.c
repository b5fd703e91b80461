// shape_file_csv.c: tables of points, as scanners, ParaView and spreadsheets write them.
//
// The first line that is no comment names the columns; the character that separates the names separates the values.
// A decimal comma makes a table ambiguous: it is refused, with the remedy.
#include <string.h>

#include "shape/shape_file_internal.h"

enum { MAX_COLUMN = 256, NUSE = 6 };  // uses: x y z nx ny nz

typedef struct Table {
    OmScan s;
    char separator;
    int ncolumn;
    int column[NUSE];  // of each use, -1: none
} Table;

static const char* const use_name[NUSE] = {"x", "y", "z", "nx", "ny", "nz"};
static const char* const paraview_name[NUSE] = {"Points:0",  "Points:1",  "Points:2",
                                                "Normals:0", "Normals:1", "Normals:2"};

// The next field of a line, without blanks and quotes around it; false at the end of the line.
static bool next_field(const char** p, const char* end, char separator, OmWord* field) {
    if (!*p) return false;
    const char* stop = memchr(*p, separator, (size_t)(end - *p));
    const char *first = *p, *last = stop ? stop : end;
    *p = stop ? stop + 1 : NULL;
    while (first < last && (*first == ' ' || *first == '\t')) ++first;
    while (last > first && (last[-1] == ' ' || last[-1] == '\t')) --last;
    bool is_quoted = last - first >= 2 && *first == '"' && last[-1] == '"';
    *field = is_quoted ? (OmWord){first + 1, (size_t)(last - first) - 2}
                       : (OmWord){first, (size_t)(last - first)};
    return true;
}

static char find_separator(OmWord line) {
    static const char candidate[] = {';', '\t', ','};
    for (size_t i = 0; i < sizeof candidate; ++i)
        if (memchr(line.str, candidate[i], line.len)) return candidate[i];
    return ',';
}

static OmStatus read_names(Table* t, OmWord line) {
    t->separator = find_separator(line);
    for (int k = 0; k < NUSE; ++k) t->column[k] = -1;
    const char* p = line.str;
    OmWord field;
    for (; next_field(&p, line.str + line.len, t->separator, &field); ++t->ncolumn) {
        if (t->ncolumn == MAX_COLUMN)
            return om__scan_error(&t->s, "more than %d columns", MAX_COLUMN);
        for (int k = 0; k < NUSE; ++k)
            if (om__is_word_nocase(field, use_name[k]) || om__is_word(field, paraview_name[k]))
                t->column[k] = t->ncolumn;
    }
    int shown = line.len < 60 ? (int)line.len : 60;
    for (int k = 0; k < 3; ++k)
        OM_CHECK(t->column[k] >= 0, OM_INVALID,
                 "the first line must name the columns x, y and z (and nx, ny, nz for normals), "
                 "separated by comma, semicolon or tab; %s is missing in \"%.*s\"",
                 use_name[k], shown, line.str);
    bool has_any = t->column[3] >= 0 || t->column[4] >= 0 || t->column[5] >= 0;
    bool has_all = t->column[3] >= 0 && t->column[4] >= 0 && t->column[5] >= 0;
    OM_CHECK(!has_any || has_all, OM_INVALID,
             "the columns of a normal are nx, ny and nz; one of them is missing in \"%.*s\"", shown,
             line.str);
    return OM_OK;
}

// A number; an empty field is NaN: a scanner saw nothing there.
static OmStatus read_number(const Table* t, OmWord field, double* value) {
    *value = NAN;
    if (field.len == 0) return OM_OK;
    const char *p = field.str, *end = field.str + field.len;
    bool is_number = om_number_parse(&p, end, value);
    if (is_number && p == end) return OM_OK;
    int shown = field.len < 40 ? (int)field.len : 40;
    if (memchr(field.str, ',', field.len))
        return om__scan_error(&t->s,
                              "\"%.*s\" has a decimal comma: save the table with decimal points",
                              shown, field.str);
    return om__scan_error(&t->s, "\"%.*s\" is no number", shown, field.str);
}

static OmStatus read_row(const Table* t, OmWord line, OmFileMesh* m) {
    double value[NUSE] = {0};
    const char* p = line.str;
    OmWord field;
    int n = 0;
    for (; next_field(&p, line.str + line.len, t->separator, &field); ++n)
        for (int k = 0; k < NUSE; ++k)
            if (t->column[k] == n) OM_TRY(read_number(t, field, &value[k]));
    if (n != t->ncolumn)
        return om__scan_error(&t->s, "%d values under %d column names%s", n, t->ncolumn,
                              t->separator == ',' && n > t->ncolumn
                                  ? ": a decimal comma? Save the table with decimal points"
                                  : "");
    OM_TRY(om__add_vert(m, value));
    return t->column[3] >= 0 ? om__add_normal(m, value + 3) : OM_OK;
}

OmStatus om__parse_csv(const char* data, size_t size, OmFileMesh* m) {
    Table t = {.s = om__scan(data, size)};
    if (size >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0) t.s.p += 3;  // mark of UTF-8
    while (om__scan_left(&t.s)) {
        // om__read_line moves on: errors name the line from a scanner that stays on it.
        OmScan next = t.s;
        OmWord line = {next.p, 0};
        om__skip_line(&next);
        line.len = (size_t)(next.p - line.str);
        while (line.len > 0 && (line.str[line.len - 1] == '\n' || line.str[line.len - 1] == '\r'))
            --line.len;
        bool is_comment = line.len > 0 && line.str[0] == '#';
        if (is_comment)
            om__read_statement(m, line.str, line.len);
        else if (line.len > 0 && t.ncolumn == 0)
            OM_TRY(read_names(&t, line));
        else if (line.len > 0)
            OM_TRY(read_row(&t, line, m));
        t.s.p = next.p;
    }
    OM_CHECK(t.ncolumn > 0, OM_INVALID, "the table is empty: its first line names x, y and z");
    return OM_OK;
}

// ---- writing ------------------------------------------------------------------------------------------------

static int write_vector(char* out, const double* v, double scale, char last) {
    int n = 0;
    for (int c = 0; c < 3; ++c) {
        n += om_number_write(out + n, v[c] * scale);
        out[n++] = c < 2 ? ',' : last;
    }
    return n;
}

OmStatus om__write_cloud_csv(const OmPointCloud* cloud, OmMeshFrame frame, OmText* text) {
    char words[OM_FRAME_WORDS];
    om__frame_words(frame, words);
    OM_TRY(
        om_text_append(text, "# omentum %s\nx,y,z%s\n", words, cloud->normal ? ",nx,ny,nz" : ""));
    for (size_t i = 0; i < (size_t)cloud->npoint; ++i) {
        char line[6 * OM_NUMBER_SIZE + 8];
        char last = cloud->normal ? ',' : '\n';
        int n = write_vector(line, cloud->x + 3 * i, 1 / frame.unit, last);
        if (cloud->normal) n += write_vector(line + n, cloud->normal + 3 * i, 1, '\n');
        OM_TRY(om_text_append_raw(text, line, (size_t)n));
    }
    return OM_OK;
}
