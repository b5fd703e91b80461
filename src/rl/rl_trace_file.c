// rl_trace_file.c: tables of tip positions of a recorded robot, CSV.
#include <math.h>
#include <string.h>

#include "omentum/rl_trace.h"
#include "rl/rl_internal.h"

#define MAX_FILE ((size_t)1 << 30)
#define MAX_PLACE 10.0  // m
#define MAX_JAW 4.0     // rad
#define MAX_TIME 1e12   // s
#define HEAD "the first line must name the columns time,x,y,z (and jaw for a gripper), with commas"
enum { TIME, X, Y, Z, JAW, NUSE, MAX_COLUMN = 256, SHOWN = 40 };

static const char* const use_name[NUSE] = {"time", "x", "y", "z", "jaw"};
static const double use_limit[NUSE] = {MAX_TIME, MAX_PLACE, MAX_PLACE, MAX_PLACE, MAX_JAW};
static const char* const use_unit[NUSE] = {"s", "m", "m", "m", "rad"};

typedef struct Table {
    const char* name;
    int line;
    int ncolumn;
    int use[MAX_COLUMN];  // of each column, NUSE: not used
    OmRlTrace* trace;
} Table;

typedef struct Field {
    const char *str, *end;
} Field;

// The next field without blanks and quotes around it; false behind the last one.
static bool next_field(const char** at, const char* end, Field* field) {
    if (!*at) return false;
    const char* comma = memchr(*at, ',', (size_t)(end - *at));
    const char *first = *at, *last = comma ? comma : end;
    *at = comma ? comma + 1 : NULL;
    while (first < last && (*first == ' ' || *first == '\t')) ++first;
    while (last > first && (last[-1] == ' ' || last[-1] == '\t')) --last;
    if (last - first >= 2 && *first == '"' && last[-1] == '"') ++first, --last;
    *field = (Field){first, last};
    return true;
}

static int shown(Field f) { return f.end - f.str < SHOWN ? (int)(f.end - f.str) : SHOWN; }

static OmStatus read_names(Table* t, const char* at, const char* end) {
    Field f;
    int column[NUSE] = {-1, -1, -1, -1, -1};
    for (; next_field(&at, end, &f); ++t->ncolumn) {
        OM_CHECK(t->ncolumn < MAX_COLUMN, OM_INVALID, "%s:%d: more than %d columns", t->name,
                 t->line, MAX_COLUMN);
        t->use[t->ncolumn] = NUSE;
        for (int k = 0; k < NUSE; ++k) {
            size_t n = strlen(use_name[k]);
            if ((size_t)(f.end - f.str) != n || memcmp(f.str, use_name[k], n) != 0) continue;
            OM_CHECK(column[k] < 0, OM_INVALID, "%s:%d: two columns are named %s", t->name, t->line,
                     use_name[k]);
            column[k] = t->ncolumn;
            t->use[t->ncolumn] = k;
        }
    }
    for (int k = 0; k < JAW; ++k)
        OM_CHECK(column[k] >= 0, OM_INVALID, "%s:%d: no column %s: " HEAD, t->name, t->line,
                 use_name[k]);
    t->trace->has_jaw = column[JAW] >= 0;
    return OM_OK;
}

static OmStatus read_value(const Table* t, int use, Field f, double* value) {
    const char* at = f.str;
    bool is_number = om_number_parse(&at, f.end, value) && at == f.end && isfinite(*value);
    OM_CHECK(is_number, OM_INVALID, "%s:%d: %s: \"%.*s\" is no number", t->name, t->line,
             use_name[use], shown(f), f.str);
    OM_CHECK(fabs(*value) <= use_limit[use], OM_INVALID,
             "%s:%d: %s is %g, at most %g: times are in s, positions in m, the jaw in rad", t->name,
             t->line, use_name[use], *value, use_limit[use]);
    return OM_OK;
}

static OmStatus read_row(Table* t, const char* at, const char* end) {
    OmRlTrace* r = t->trace;
    double value[NUSE] = {0};
    Field f;
    int n = 0;
    for (; next_field(&at, end, &f); ++n)
        if (n < t->ncolumn && t->use[n] < NUSE)
            OM_TRY(read_value(t, t->use[n], f, &value[t->use[n]]));
    OM_CHECK(n == t->ncolumn, OM_INVALID, "%s:%d: %d values under %d column names", t->name,
             t->line, n, t->ncolumn);
    OM_CHECK(
        r->n == 0 || value[TIME] > r->time[r->n - 1], OM_INVALID,
        "%s:%d: time is %g %s, not after that of the row before; sort the rows, and drop copies",
        t->name, t->line, value[TIME], use_unit[TIME]);
    r->time[r->n] = value[TIME];
    memcpy(r->tip + 3 * (size_t)r->n, value + X, 3 * sizeof *value);
    r->jaw[r->n] = value[JAW];
    r->line[r->n] = t->line;
    ++r->n;
    return OM_OK;
}

static OmStatus read_lines(Table* t, const char* data, const char* end) {
    if (end - data >= 3 && memcmp(data, "\xef\xbb\xbf", 3) == 0) data += 3;  // mark of UTF-8
    while (data < end) {
        const char* stop = memchr(data, '\n', (size_t)(end - data));
        const char* last = stop ? stop : end;
        ++t->line;
        if (last > data && last[-1] == '\r') --last;
        if (last > data && *data != '#')
            OM_TRY(t->ncolumn > 0 ? read_row(t, data, last) : read_names(t, data, last));
        data = stop ? stop + 1 : end;
    }
    OM_CHECK(t->ncolumn > 0, OM_INVALID, "%s: the table is empty: " HEAD, t->name);
    OM_CHECK(t->trace->n >= 2, OM_INVALID, "%s: a path needs at least two rows, the table has %d",
             t->name, t->trace->n);
    return OM_OK;
}

void om_rl_trace_done(OmRlTrace* trace) {
    om_free(trace->time);
    om_free(trace->tip);
    om_free(trace->jaw);
    om_free(trace->line);
    *trace = (OmRlTrace){0};
}

OmStatus om_rl_trace_cut(OmRlTrace* trace, double begin, double end) {
    OmRlTrace* t = trace;
    const double last = t->time[t->n - 1] - t->time[0];
    int from = 0, n = 0;
    while (from < t->n && t->time[from] - t->time[0] < begin) ++from;
    while (from + n < t->n && t->time[from + n] - t->time[0] <= end) ++n;
    OM_CHECK(n >= 2, OM_INVALID,
             "%s: %d poses from %g s to %g s, a path needs at least two; it has %d in %.3f s",
             t->name, n, begin, end, t->n, last);
    const size_t num = (size_t)n, at = (size_t)from;
    memmove(t->time, t->time + at, num * sizeof *t->time);
    memmove(t->tip, t->tip + 3 * at, 3 * num * sizeof *t->tip);
    memmove(t->jaw, t->jaw + at, num * sizeof *t->jaw);
    memmove(t->line, t->line + at, num * sizeof *t->line);
    t->n = n;
    return OM_OK;
}

OmStatus om_rl_trace_parse(const char* data, size_t size, const char* name, OmRlTrace* trace) {
    Table table = {.name = trace->name, .trace = trace};
    OmStatus status;
    size_t num = 1;
    *trace = (OmRlTrace){0};
    snprintf(trace->name, sizeof trace->name, "%s", name);
    om_text_make_plain(trace->name, sizeof trace->name);
    OM_CHECK(size <= MAX_FILE, OM_INVALID, "%s: too large a table", trace->name);
    for (size_t i = 0; i < size; ++i) num += data[i] == '\n';
    OM_ALLOC_DONE(trace->time, num);
    OM_ALLOC_DONE(trace->tip, 3 * num);
    OM_ALLOC_DONE(trace->jaw, num);
    OM_ALLOC_DONE(trace->line, num);
    status = read_lines(&table, data, data + size);
done:
    if (status < 0) om_rl_trace_done(trace);
    return status;
}

OmStatus om_rl_trace_load(const char* path, OmRlTrace* trace) {
    char* data;
    size_t size;
    *trace = (OmRlTrace){0};
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    OmStatus status = om_rl_trace_parse(data, size, path, trace);
    om_free(data);
    return status;
}
