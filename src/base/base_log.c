// base_log.c: log lines, progress, requests to stop, the clock, hashes.
#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/base_internal.h"
#include "omentum/base.h"

#define PLAIN_PERIOD 5.0  // s between progress lines where the output is no terminal
#define SAME_PERIOD 60.0  // s between two lines of a log with the same count
#define BAR_PERIOD 0.1    // s between redraws on a terminal
#define BAR_WIDTH 24
#define LEAST_ELAPSED 3.0  // s, before which a time left would be a guess
#define LEAST_STAGE 10.0   // s, a stage that takes less has no time left

static OmLogSink log_sink;
static void* log_ctx;

void om_log_set_sink(OmLogSink sink, void* ctx) {
    log_sink = sink;
    log_ctx = ctx;
}

void om_log(OmLogLevel level, const char* format, ...) {
    if (!log_sink) return;
    char line[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof line, format, args);
    va_end(args);
    om_text_make_plain(line, sizeof line);
    log_sink(log_ctx, level, line);
}

OmStatus om_progress_report(const OmProgress* progress, const char* stage, double done,
                            double total) {
    OM_TRY(om_stop_poll());
    if (!progress || !progress->report || progress->report(progress->ctx, stage, done, total)) {
        return OM_OK;
    }
    return om_error(OM_CANCELLED, "cancelled during %s", stage);
}

// ---- a request to stop ----------------------------------------------------------------------------------

typedef struct Stop {
    bool (*fn)(void* ctx);
    void* ctx;
    double last;  // s, of the clock, when it was asked
    bool is_on;
} Stop;

static _Thread_local Stop stop;

void om_stop_set(bool (*fn)(void* ctx), void* ctx) { stop = (Stop){.fn = fn, .ctx = ctx}; }

bool om_stop_is_set(void) { return stop.fn != NULL; }

OmStatus om_stop_poll(void) {
    if (!stop.fn) return OM_OK;
    if (!stop.is_on) {
        const double now = om_clock_now();
        if (now - stop.last < OM_STOP_PERIOD) return OM_OK;
        stop.last = now;
        stop.is_on = stop.fn(stop.ctx);
    }
    return stop.is_on ? om_error(OM_CANCELLED, "stopped by a request") : OM_OK;
}

bool om_stop_take(void) {
    const bool was_on = stop.is_on;
    stop.is_on = false;
    return was_on;
}

double om_clock_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// ---- progress bar ---------------------------------------------------------------------------------------

void om_progress_bar_init(OmProgressBar* bar, FILE* out) {
    memset(bar, 0, sizeof *bar);
    bar->out = out;
    bar->is_terminal = isatty(fileno(out)) == 1;
}

static void end_line(OmProgressBar* bar) {
    if (bar->last_width > 0) fputc('\n', bar->out);
    bar->last_width = 0;
}

// Nothing where the whole stage takes seconds, or where too little is done for an estimate; rounded up.
static void print_time_left(char* out, size_t size, double elapsed, double left) {
    out[0] = 0;
    if (elapsed < LEAST_ELAPSED || !isfinite(left) || elapsed + left < LEAST_STAGE) return;
    left = ceil(left);
    if (left >= 3600)
        snprintf(out, size, ", %d:%02d h left", (int)(left / 3600), (int)fmod(left / 60, 60));
    else
        snprintf(out, size, ", %02d:%02d left", (int)(left / 60), (int)fmod(left, 60));
}

int om__progress_line(char* line, size_t size, const OmProgressBar* bar, double elapsed,
                      double done, double total) {
    const double share = total > 0 ? fmax(0, fmin(1, done / total)) : 0;
    char rate[32] = "";  // nothing before the first is done
    if (elapsed > 0 && done > 0) snprintf(rate, sizeof rate, ", %.3g/s", done / elapsed);
    if (!(total > 0))
        return snprintf(line, size, bar->is_terminal ? "%-24s %.0f so far%s" : "%s: %.0f so far%s",
                        bar->stage, done, rate);
    // 100 at the end alone; 29 of 100 are 29 in spite of rounding
    const int percent = (int)floor(100 * share + 1e-9);
    char left[40];
    print_time_left(left, sizeof left, elapsed, share > 0 ? elapsed * (1 / share - 1) : HUGE_VAL);
    if (share >= 1) left[0] = 0;
    if (!bar->is_terminal)
        return snprintf(line, size, "%s: %.0f of %.0f (%d %%)%s%s", bar->stage, done, total,
                        percent, rate, left);
    char cells[BAR_WIDTH + 1];
    for (int i = 0; i < BAR_WIDTH; ++i) cells[i] = i < (int)(share * BAR_WIDTH) ? '#' : '.';
    cells[BAR_WIDTH] = 0;
    return snprintf(line, size, "%-24s [%s] %3d %%%s%s", bar->stage, cells, percent, rate, left);
}

void om_progress_bar_draw(OmProgressBar* bar, const char* stage, double done, double total) {
    double now = om_clock_now();
    bool is_new = strncmp(stage, bar->stage, sizeof bar->stage - 1) != 0;
    bool is_last = total > 0 && done >= total;
    if (is_new) {
        end_line(bar);
        snprintf(bar->stage, sizeof bar->stage, "%s", stage);
        bar->start_time = now;
        bar->last_time = now;
        bar->last_done = -1;
        if (!is_last) return;
    }
    if (!is_last && now - bar->last_time < (bar->is_terminal ? BAR_PERIOD : PLAIN_PERIOD)) return;
    if (is_last && !bar->is_terminal && now - bar->start_time < PLAIN_PERIOD) return;
    if (!bar->is_terminal && done == bar->last_done && now - bar->last_time < SAME_PERIOD) return;
    bar->last_time = now;
    bar->last_done = done;
    char line[200];
    int n = om__progress_line(line, sizeof line, bar, now - bar->start_time, done, total);
    if (bar->is_terminal) {
        fprintf(bar->out, "\r%-*s", bar->last_width > n ? bar->last_width : n, line);
        bar->last_width = n;
        if (is_last) end_line(bar);
    } else {
        fprintf(bar->out, "%s\n", line);
    }
    fflush(bar->out);
}

void om_progress_bar_done(OmProgressBar* bar) {
    end_line(bar);
    bar->stage[0] = 0;
    fflush(bar->out);
}

uint64_t om_hash(const void* data, size_t size, uint64_t seed) {
    const unsigned char* p = data;
    uint64_t h = seed;
    for (; size >= 8; size -= 8, p += 8) {
        uint64_t word;
        memcpy(&word, p, 8);
        h = (h ^ word) * 1099511628211ull;
        h ^= h >> 29;
    }
    for (; size > 0; --size, ++p) h = (h ^ *p) * 1099511628211ull;
    return h;
}
