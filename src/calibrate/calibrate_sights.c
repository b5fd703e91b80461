// calibrate_sights.c: the CSV file of observations.
#include <math.h>
#include <string.h>

#include "calibrate/calibrate_problem_internal.h"

#define MAX_VALUE 1e6  // mm or N; sums of squares stay finite
#define REST -1.0      // stands for a level: at rest

static const char header[] = "experiment,level_mm,landmark,x_mm,y_mm,z_mm";

typedef struct Row {
    char experiment[PATH_NAME], landmark[LANDMARK_NAME];
    int path;
    double level;  // m, or REST
    double v[3];   // as in the file
} Row;

typedef struct Lines {
    const char *at, *end;
    const char* name;
    int line;
} Lines;

// ---- one row --------------------------------------------------------------------------------------

static OmStatus take_word(Lines* f, const char* end, const char* column, char* out, size_t size) {
    const char* stop = f->at;
    while (stop < end && *stop != ',') ++stop;
    size_t n = (size_t)(stop - f->at);
    OM_CHECK(n > 0 && n < size, OM_INVALID, "%s:%d: %s: a name of %zu letters; 1 to %zu", f->name,
             f->line, column, n, size - 1);
    memcpy(out, f->at, n);
    out[n] = 0;
    OM_CHECK(om_text_is_plain(f->at, n, NULL), OM_INVALID,
             "%s:%d: %s: the name is no UTF-8, or has a control character: save the table as UTF-8",
             f->name, f->line, column);
    f->at = stop < end ? stop + 1 : stop;
    return OM_OK;
}

static OmStatus take_value(Lines* f, const char* end, const char* column, double* v) {
    const char *from = f->at, *stop = from;
    while (stop < end && *stop != ',') ++stop;
    bool is_number = om_number_parse(&f->at, end, v) && isfinite(*v) && f->at == stop;
    OM_CHECK(is_number, OM_INVALID, "%s:%d: %s: \"%.*s\" is not a number", f->name, f->line, column,
             stop - from < 60 ? (int)(stop - from) : 60, from);
    OM_CHECK(fabs(*v) <= MAX_VALUE, OM_INVALID, "%s:%d: %s: %g is too large, at most %g", f->name,
             f->line, column, *v, MAX_VALUE);
    if (f->at < end) ++f->at;
    return OM_OK;
}

static OmStatus find_path(const Lines* f, int npath, const PathItem* path, Row* row) {
    const char* name[OM_CALIBRATION_MAX_PATH];
    for (int p = 0; p < npath; ++p) {
        name[p] = path[p].name;
        if (strcmp(name[p], row->experiment) != 0) continue;
        row->path = p;
        return OM_OK;
    }
    const char* near = om_nearest_word(row->experiment, name, npath);
    return near ? om_error(OM_INVALID, "%s:%d: experiment: no path \"%s\"; did you mean \"%s\"?",
                           f->name, f->line, row->experiment, near)
                : om_error(OM_INVALID, "%s:%d: experiment: the problem has no path \"%s\"", f->name,
                           f->line, row->experiment);
}

static OmStatus read_row(Lines* f, const char* end, Row* row) {
    static const char* const axis[] = {"x_mm", "y_mm", "z_mm"};
    OM_TRY(take_word(f, end, "experiment", row->experiment, sizeof row->experiment));
    if (end - f->at >= 5 && memcmp(f->at, "rest,", 5) == 0) {
        row->level = REST;
        f->at += 5;
    } else {
        OM_TRY(take_value(f, end, "level_mm", &row->level));
        OM_CHECK(row->level >= 0 && row->level <= 1e4, OM_INVALID,
                 "%s:%d: level_mm: %g; 0 to 10000, or \"rest\"", f->name, f->line, row->level);
        row->level *= 1e-3;
    }
    OM_TRY(take_word(f, end, "landmark", row->landmark, sizeof row->landmark));
    for (int k = 0; k < 3; ++k) OM_TRY(take_value(f, end, axis[k], &row->v[k]));
    OM_CHECK(f->at == end && end[-1] != ',', OM_INVALID, "%s:%d: more than six columns", f->name,
             f->line);
    return OM_OK;
}

// The next line that is neither empty nor a comment, without its end.
static bool next_line(Lines* f, const char** end) {
    while (f->at < f->end) {
        const char* stop = memchr(f->at, '\n', (size_t)(f->end - f->at));
        stop = stop ? stop : f->end;
        const char* from = f->at;
        *end = stop > from && stop[-1] == '\r' ? stop - 1 : stop;
        ++f->line;
        if (*end > from && *from != '#') return true;
        f->at = stop < f->end ? stop + 1 : stop;
    }
    return false;
}

static void skip_line(Lines* f, const char* end) {
    f->at = end;
    while (f->at < f->end && *f->at != '\n') ++f->at;
    if (f->at < f->end) ++f->at;
}

// ---- all rows -------------------------------------------------------------------------------------

typedef OmStatus (*RowFn)(Sights* s, const Lines* f, const Row* row);

static OmStatus for_rows(const char* text, size_t size, const char* name, int npath,
                         const PathItem* path, RowFn fn, Sights* s) {
    Lines f = {text, text + size, name, 0};
    const char* end;
    OM_CHECK(next_line(&f, &end) && (size_t)(end - f.at) == sizeof header - 1 &&
                 memcmp(f.at, header, sizeof header - 1) == 0,
             OM_INVALID, "%s:%d: the first line must be %s", name, f.line ? f.line : 1, header);
    for (skip_line(&f, end); next_line(&f, &end); skip_line(&f, end)) {
        Row row = {0};
        OM_TRY(read_row(&f, end, &row));
        OM_TRY(find_path(&f, npath, path, &row));
        OM_TRY(fn(s, &f, &row));
    }
    return OM_OK;
}

static int find_landmark(const Sights* s, const char* name) {
    if (strcmp(name, "cloud") == 0) return OM_SEEN_CLOUD;
    if (strcmp(name, "force") == 0) return OM_SEEN_FORCE;
    int i = 0;
    while (i < s->nlandmark && strcmp(s->landmark[i], name) != 0) ++i;
    return i;
}

static OmStatus add_rest(Sights* s, const Lines* f, const Row* row) {
    int i = find_landmark(s, row->landmark);
    OM_CHECK(i >= 0, OM_INVALID, "%s:%d: landmark: a %s has no place at rest", f->name, f->line,
             row->landmark);
    OM_CHECK(i == s->nlandmark, OM_INVALID,
             "%s:%d: landmark: \"%s\" has a place at rest already; landmarks of different "
             "experiments need different names",
             f->name, f->line, row->landmark);
    OM_CHECK(i < OM_CALIBRATION_MAX_LANDMARK, OM_INVALID, "%s:%d: more than %d landmarks", f->name,
             f->line, OM_CALIBRATION_MAX_LANDMARK);
    snprintf(s->landmark[i], sizeof s->landmark[i], "%s", row->landmark);
    for (int k = 0; k < 3; ++k) s->rest[3 * i + k] = 1e-3 * row->v[k];
    ++s->nlandmark;
    return OM_OK;
}

// First pass: positions at rest, and the levels of each path, sorted ascending.
static OmStatus gather(Sights* s, const Lines* f, const Row* row) {
    if (row->level == REST) return add_rest(s, f, row);
    ++s->nseen;
    double* level = s->level[row->path];
    int *n = &s->nlevel[row->path], i = 0;
    while (i < *n && level[i] < row->level) ++i;
    if (i < *n && level[i] == row->level) return OM_OK;
    OM_CHECK(*n < OM_CALIBRATION_MAX_LEVEL, OM_INVALID,
             "%s:%d: level_mm: more than %d levels of \"%s\"", f->name, f->line,
             OM_CALIBRATION_MAX_LEVEL, row->experiment);
    memmove(level + i + 1, level + i, (size_t)(*n - i) * sizeof *level);
    level[i] = row->level;
    ++*n;
    return OM_OK;
}

// Second pass: the observations.
static OmStatus add_seen(Sights* s, const Lines* f, const Row* row) {
    if (row->level == REST) return OM_OK;
    int i = find_landmark(s, row->landmark), level = 0;
    OM_CHECK(
        i < s->nlandmark, OM_INVALID,
        "%s:%d: landmark: the position of \"%s\" at rest is missing; add a line \"%s,rest,%s,..\"",
        f->name, f->line, row->landmark, row->experiment, row->landmark);
    while (s->level[row->path][level] != row->level) ++level;
    double unit = i == OM_SEEN_FORCE ? 1 : 1e-3;
    s->seen[s->nseen++] = (OmCalibrationSeen){
        row->path, level, i, om_scale(unit, om_vec3(row->v[0], row->v[1], row->v[2]))};
    return OM_OK;
}

OmStatus om__calibrate_parse_sights(const char* text, size_t size, const char* name, int npath,
                                    const PathItem* path, Sights* s) {
    memset(s, 0, sizeof *s);
    s->npath = npath;
    OM_TRY(for_rows(text, size, name, npath, path, gather, s));
    for (int p = 0; p < npath; ++p)
        OM_CHECK(s->nlevel[p] > 0, OM_INVALID, "%s: nothing was seen of the path \"%s\"", name,
                 path[p].name);
    OM_ALLOC(s->seen, s->nseen);
    s->nseen = 0;
    OmStatus status = for_rows(text, size, name, npath, path, add_seen, s);
    if (status == OM_OK) return OM_OK;
    om_free(s->seen);
    s->seen = NULL;
    return status;
}
