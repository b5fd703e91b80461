// report_chart.c: line charts as inline SVG: round ticks, a legend, gaps where a value is not finite.
#include <math.h>
#include <string.h>

#include "omentum/report.h"

#define WIDTH 960.0
#define HEIGHT 280.0
#define LEFT 64.0
#define RIGHT 20.0
#define TOP 56.0
#define BOTTOM 46.0

typedef struct Axis {
    double lo, hi, step;
} Axis;

static void put(OmReport* r, const char* format, ...) OM_PRINTF(2, 3);
static void put(OmReport* r, const char* format, ...) {
    if (r->status < 0) return;
    char line[512];
    va_list args;
    va_start(args, format);
    int n = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    if (n >= 0 && (size_t)n < sizeof line)
        r->status = om_text_append_raw(&r->html, line, (size_t)n);
}

static void put_label(OmReport* r, double x, double y, const char* attributes, const char* text) {
    put(r, "<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, attributes);
    if (r->status == OM_OK) r->status = om_text_append_html(&r->html, text ? text : "");
    put(r, "</text>\n");
}

// 1, 2 or 5 times a power of ten, giving about `count` ticks.
static double round_step(double span, int count) {
    double raw = span / count, power = pow(10, floor(log10(raw)));
    double m = raw / power;
    return power * (m <= 1 ? 1 : m <= 2 ? 2 : m <= 5 ? 5 : 10);
}

static Axis make_axis(double lo, double hi, int nticks, bool is_rounded) {
    if (!(hi > lo)) {
        double pad = lo != 0 ? fabs(lo) * 0.5 : 1;
        lo -= pad, hi += pad;
    }
    Axis a = {lo, hi, round_step(hi - lo, nticks)};
    if (is_rounded) {
        a.lo = floor(lo / a.step + 1e-9) * a.step;
        a.hi = ceil(hi / a.step - 1e-9) * a.step;
    }
    return a;
}

static double to_x(Axis a, double v) {
    return LEFT + (v - a.lo) / (a.hi - a.lo) * (WIDTH - LEFT - RIGHT);
}
static double to_y(Axis a, double v) {
    return HEIGHT - BOTTOM - (v - a.lo) / (a.hi - a.lo) * (HEIGHT - TOP - BOTTOM);
}

static void find_ranges(const OmReportChart* c, Axis* x, Axis* y) {
    double xlo = HUGE_VAL, xhi = -HUGE_VAL;
    double ylo = c->has_range ? c->y_min : HUGE_VAL, yhi = c->has_range ? c->y_max : -HUGE_VAL;
    for (int s = 0; s < c->nseries; ++s) {
        for (int i = 0; i < c->series[s].n; ++i) {
            double px = c->series[s].x[i], py = c->series[s].y[i];
            if (!isfinite(px) || !isfinite(py)) continue;
            xlo = fmin(xlo, px), xhi = fmax(xhi, px);
            ylo = fmin(ylo, py), yhi = fmax(yhi, py);
        }
    }
    if (c->has_limit && isfinite(c->limit))
        ylo = fmin(ylo, c->limit), yhi = fmax(yhi, c->limit * 1.05);
    if (!isfinite(xlo)) xlo = 0, xhi = 1;
    if (!isfinite(ylo)) ylo = 0, yhi = 1;
    *x = make_axis(xlo, xhi, 10, false);
    *y = make_axis(ylo, yhi, 5, true);
}

static void draw_axes(OmReport* r, const OmReportChart* c, Axis x, Axis y) {
    for (double v = y.lo; v <= y.hi + 0.5 * y.step; v += y.step) {
        char number[32];
        snprintf(number, sizeof number, "%.4g", fabs(v) < 1e-9 * y.step ? 0 : v);
        put(r, "<line class=\"axis\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n", LEFT,
            to_y(y, v), WIDTH - RIGHT, to_y(y, v));
        put_label(r, LEFT - 8, to_y(y, v) + 4, "text-anchor=\"end\"", number);
    }
    for (double v = ceil(x.lo / x.step - 1e-9) * x.step; v <= x.hi + 1e-9 * x.step; v += x.step) {
        char number[32];
        snprintf(number, sizeof number, "%.4g", fabs(v) < 1e-9 * x.step ? 0 : v);
        put_label(r, to_x(x, v), HEIGHT - BOTTOM + 18, "text-anchor=\"middle\"", number);
    }
    put_label(r, 0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 8, "text-anchor=\"middle\"", c->x_label);
    put_label(r, 16, 24, "class=\"title\"", c->title);
    put_label(r, 16, 42, "", c->y_label);
}

static void draw_series(OmReport* r, const OmReportSeries* s, int index, Axis x, Axis y) {
    bool is_open = false;
    for (int i = 0; i < s->n; ++i) {
        if (!isfinite(s->x[i]) || !isfinite(s->y[i])) {
            if (is_open) put(r, "\"/>\n");
            is_open = false;
            continue;
        }
        if (!is_open) {
            put(r, "<polyline fill=\"none\" stroke=\"var(--%c)\" stroke-width=\"2\" points=\"",
                'a' + index);
        }
        is_open = true;
        put(r, "%.1f,%.1f ", to_x(x, s->x[i]), to_y(y, s->y[i]));
    }
    if (is_open) put(r, "\"/>\n");
}

static void draw_legend(OmReport* r, const OmReportChart* c) {
    double at =
        WIDTH - RIGHT - 150.0 * (c->nseries > 1 ? c->nseries : 0) - (c->has_limit ? 170 : 0);
    for (int s = 0; s < c->nseries && c->nseries > 1; ++s, at += 150) {
        put(r,
            "<line x1=\"%.1f\" y1=\"20\" x2=\"%.1f\" y2=\"20\" stroke=\"var(--%c)\" stroke-width=\"3\"/>\n",
            at, at + 22, 'a' + s);
        put_label(r, at + 28, 24, "", c->series[s].name);
    }
    if (!c->has_limit) return;
    put(r, "<line class=\"limit\" x1=\"%.1f\" y1=\"20\" x2=\"%.1f\" y2=\"20\"/>\n", at, at + 22);
    put_label(r, at + 28, 24, "", c->limit_name);
}

void om_report_chart(OmReport* r, const OmReportChart* c) {
    if (r->is_in_grid) put(r, "</div>\n");
    r->is_in_grid = false;
    Axis x, y;
    find_ranges(c, &x, &y);
    put(r, "<svg viewBox=\"0 0 %g %g\" role=\"img\">\n", WIDTH, HEIGHT);
    draw_axes(r, c, x, y);
    for (int i = 0; i < c->nevent; ++i) {
        if (!(c->event[i] >= x.lo && c->event[i] <= x.hi)) continue;
        put(r, "<line class=\"event\" x1=\"%.1f\" y1=\"%g\" x2=\"%.1f\" y2=\"%g\"/>\n",
            to_x(x, c->event[i]), TOP, to_x(x, c->event[i]), HEIGHT - BOTTOM);
    }
    if (c->has_limit) {
        put(r, "<line class=\"limit\" x1=\"%g\" y1=\"%.1f\" x2=\"%g\" y2=\"%.1f\"/>\n", LEFT,
            to_y(y, c->limit), WIDTH - RIGHT, to_y(y, c->limit));
    }
    for (int s = 0; s < c->nseries && s < OM_REPORT_MAX_SERIES; ++s)
        draw_series(r, &c->series[s], s, x, y);
    draw_legend(r, c);
    put(r, "</svg>\n");
}
