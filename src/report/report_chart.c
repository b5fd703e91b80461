// report_chart.c: line charts and box plots as SVG.
//
//      spans:   | 1 reach | 2 grasp |  3 pull   |
//      y  +-----------------------------------------+
//         |   -  -  -  limit  -  -  -  -  -  -  name |
//         |         /\      : event                  |
//         +-----------------------------------------+
//                          x label
//
// Numbers are written digit by digit from integers, so that no locale puts commas into coordinates. Series
// with more points than the plot has room for keep the first, smallest, largest and last value of every column.
#include <string.h>

#include "report/report_internal.h"

#define SPAN_HEIGHT 20.0
#define LETTER 6.1     // px, mean width of a letter
#define LARGEST 1e300  // larger values are not drawn: their differences could overflow

// Every chart is drawn twice, for wide screens and for phones; the style sheet shows one of them. Text has 12 px of the
// width of the drawing, so that it is above 11 px on a screen of 360.
typedef struct Layout {
    const char* class;
    double width, left, right, height;  // of the drawing, of the plot, px
    int ntick_x, ntick_y;               // wanted
} Layout;

static const Layout wide = {"wide", 960, 58, 944, 210, 8, 5};
static const Layout narrow = {"narrow", 330, 46, 320, 180, 4, 4};

typedef struct Axis {
    bool is_log;         // then lo, hi, first and step are logarithms to base 10
    double lo, hi;       // of the data
    double from, to;     // px
    double first, step;  // of the ticks
    int ntick, decimals, exponent;
} Axis;

typedef struct Plot {
    OmReport* report;
    const OmReportChart* chart;
    const Layout* layout;
    Axis x, y;
    double top, bottom;  // px
} Plot;

static bool is_drawable(double v) { return fabs(v) < LARGEST; }

static bool is_on(const Axis* a, double v) { return is_drawable(v) && !(a->is_log && v <= 0); }

// ---- numbers ----------------------------------------------------------------------------------------------

static void put_fixed(OmReport* r, double value, int decimals) {
    static const double power[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6};
    long long unit = (long long)power[decimals];
    long long n = llround(value * power[decimals]);
    const char* sign = n < 0 ? "-" : "";
    if (n < 0) n = -n;
    if (decimals)
        PUT(r, "%s%lld.%0*lld", sign, n / unit, decimals, n % unit);
    else
        PUT(r, "%s%lld", sign, n);
}

static void put_px(OmReport* r, double px) { put_fixed(r, fmax(-1e6, fmin(1e6, px)), 1); }

// ` name="px"`
static void put_attribute(OmReport* r, const char* name, double px) {
    PUT(r, " %s=\"", name);
    put_px(r, px);
    PUT(r, "\"");
}

static void put_tick(OmReport* r, const Axis* a, double value) {
    if (a->is_log) {
        int decade = (int)lround(value);
        if (decade < -6 || decade > 9)
            PUT(r, "1e%d", decade);
        else
            put_fixed(r, pow(10, decade), decade < 0 ? -decade : 0);
        return;
    }
    if (!a->exponent || value == 0) {
        put_fixed(r, value, value == 0 && a->exponent ? 0 : a->decimals);
        return;
    }
    put_fixed(r, value / pow(10, a->exponent), a->decimals);
    PUT(r, "e%d", a->exponent);
}

// ---- axes ---------------------------------------------------------------------------------------------------

// Steps of 1, 2 or 5 times a power of ten, about `wanted` of them.
static double tick_step(double range, int wanted) {
    double raw = range / wanted, power = pow(10, floor(log10(raw))), rest = raw / power;
    return power * (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10);
}

static void place_ticks(Axis* a, int wanted, bool is_widened) {
    if (a->is_log) {
        a->lo = floor(a->lo + 1e-9);
        a->hi = fmax(ceil(a->hi - 1e-9), a->lo + 1);
        a->step = ceil((a->hi - a->lo) / (wanted + 1));
        a->first = a->lo;
        a->ntick = (int)floor((a->hi - a->first) / a->step + 1e-9) + 1;
        return;
    }
    a->step = tick_step(a->hi - a->lo, wanted);
    if (is_widened) {
        a->lo = floor(a->lo / a->step + 1e-9) * a->step;
        a->hi = ceil(a->hi / a->step - 1e-9) * a->step;
    }
    a->first = ceil(a->lo / a->step - 1e-9) * a->step;
    a->ntick = (int)floor((a->hi - a->first) / a->step + 1e-9) + 1;
    double largest = fmax(fabs(a->lo), fabs(a->hi));
    int digit = (int)floor(log10(a->step) + 1e-9);
    a->exponent = largest >= 1e6 || largest < 1e-3 ? (int)floor(log10(largest)) : 0;
    int decimals = a->exponent - digit;
    a->decimals = decimals < 0 ? 0 : decimals > 6 ? 6 : decimals;
}

static void widen(Axis* a, double v) {
    if (!is_on(a, v)) return;
    if (a->is_log) v = log10(v);
    a->lo = fmin(a->lo, v);
    a->hi = fmax(a->hi, v);
}

// False if nothing can be drawn.
static bool choose_ranges(Plot* p) {
    const OmReportChart* c = p->chart;
    p->x.lo = p->y.lo = LARGEST;
    p->x.hi = p->y.hi = -LARGEST;
    p->x.is_log = c->is_log_x && !c->ngroup;
    p->y.is_log = c->is_log_y;
    for (int i = 0; i < c->ngroup * c->nseries; ++i) {
        const OmReportBox* b = &c->box[i];
        if (!b->n || !is_on(&p->y, b->min) || !is_on(&p->y, b->max)) continue;
        widen(&p->x, 0);
        widen(&p->x, c->ngroup);
        widen(&p->y, b->min);
        widen(&p->y, b->max);
    }
    for (int s = 0; s < c->nseries; ++s) {
        for (int i = 0; i < c->series[s].n; ++i) {
            if (!is_on(&p->x, c->series[s].x[i]) || !is_on(&p->y, c->series[s].y[i])) continue;
            widen(&p->x, c->series[s].x[i]);
            widen(&p->y, c->series[s].y[i]);
        }
    }
    if (p->x.lo > p->x.hi) return false;
    for (int i = 0; i < c->nspan; ++i) {
        widen(&p->x, c->span[i].begin);
        widen(&p->x, c->span[i].end);
    }
    if (c->has_limit) widen(&p->y, c->limit);
    if (c->limit2_name) widen(&p->y, c->limit2);
    if (c->has_range) {
        widen(&p->y, c->y_min);
        widen(&p->y, c->y_max);
    }
    if (!p->y.is_log && p->y.lo > 0 && p->y.lo < 0.5 * p->y.hi) p->y.lo = 0;
    if (!p->y.is_log && p->y.hi < 0 && p->y.hi > 0.5 * p->y.lo) p->y.hi = 0;
    // A constant gets a range around it; a range at the level of rounding counts as a constant.
    Axis* axis[2] = {&p->x, &p->y};
    for (int k = 0; k < 2; ++k) {
        double size = fmax(fabs(axis[k]->lo), fabs(axis[k]->hi));
        if (axis[k]->is_log || axis[k]->hi - axis[k]->lo > 1e-9 * size) continue;
        double half = size > 0 ? 0.5 * size : 0.5;
        axis[k]->lo -= half;
        axis[k]->hi += half;
    }
    place_ticks(&p->x, p->layout->ntick_x, false);
    place_ticks(&p->y, p->layout->ntick_y, true);
    return true;
}

static double to_px(const Axis* a, double v) {
    if (a->is_log) v = log10(v);
    return a->from + (v - a->lo) / (a->hi - a->lo) * (a->to - a->from);  // hi > lo by choose_ranges
}

// ---- parts --------------------------------------------------------------------------------------------------

static void put_groups(Plot* p) {
    OmReport* r = p->report;
    for (int i = 0; i < p->chart->ngroup; ++i) {
        PUT(r, "<text text-anchor=\"middle\"");
        put_attribute(r, "x", to_px(&p->x, i + 0.5)), put_attribute(r, "y", p->bottom + 19);
        PUT(r, ">");
        om__report_escape(r, p->chart->group[i]);
        PUT(r, "</text>\n");
    }
}

static void put_axes(Plot* p) {
    OmReport* r = p->report;
    for (int i = 0; i < p->y.ntick; ++i) {
        double v = p->y.first + i * p->y.step, y = to_px(&p->y, p->y.is_log ? pow(10, v) : v);
        PUT(r, "<line class=\"grid\"");
        put_attribute(r, "x1", p->layout->left), put_attribute(r, "x2", p->layout->right);
        put_attribute(r, "y1", y), put_attribute(r, "y2", y);
        PUT(r, "/><text text-anchor=\"end\"");
        put_attribute(r, "x", p->layout->left - 8), put_attribute(r, "y", y + 4);
        PUT(r, ">");
        put_tick(r, &p->y, v);
        PUT(r, "</text>\n");
    }
    PUT(r, "<line class=\"axis\"");
    put_attribute(r, "x1", p->layout->left), put_attribute(r, "x2", p->layout->right);
    put_attribute(r, "y1", p->bottom), put_attribute(r, "y2", p->bottom);
    PUT(r, "/>\n");
    put_groups(p);
    for (int i = 0; i < p->x.ntick && !p->chart->ngroup; ++i) {
        double v = p->x.first + i * p->x.step, x = to_px(&p->x, p->x.is_log ? pow(10, v) : v);
        PUT(r, "<line class=\"axis\"");
        put_attribute(r, "x1", x), put_attribute(r, "x2", x);
        put_attribute(r, "y1", p->bottom), put_attribute(r, "y2", p->bottom + 5);
        PUT(r, "/><text text-anchor=\"middle\"");
        put_attribute(r, "x", x), put_attribute(r, "y", p->bottom + 19);
        PUT(r, ">");
        put_tick(r, &p->x, v);
        PUT(r, "</text>\n");
    }
    PUT(r, "<text text-anchor=\"middle\"");
    put_attribute(r, "x", 0.5 * (p->layout->left + p->layout->right)),
        put_attribute(r, "y", p->bottom + 38);
    PUT(r, ">");
    om__report_escape(r, p->chart->x_label);
    PUT(r, "</text>\n");
}

static void put_rectangle(OmReport* r, const char* class, double x0, double x1, double y0,
                          double y1) {
    PUT(r, "<rect class=\"%s\"", class);
    put_attribute(r, "x", x0), put_attribute(r, "width", fmax(0, x1 - x0));
    put_attribute(r, "y", y0), put_attribute(r, "height", y1 - y0);
    PUT(r, ">");
}

// Spans of time: a strip above the plot with numbers, with names where there is room, and a faint shade in the plot.
static void put_spans(Plot* p) {
    OmReport* r = p->report;
    for (int i = 0; i < p->chart->nspan; ++i) {
        const OmReportSpan* s = &p->chart->span[i];
        if (!is_drawable(s->begin) || !is_drawable(s->end)) continue;
        double x0 = to_px(&p->x, s->begin), x1 = fmax(x0 + 1, to_px(&p->x, s->end) - 1);
        double y0 = p->top - SPAN_HEIGHT - 4;
        const char* name = s->label ? s->label : "";
        char number[16];
        // shape and text too, not colour alone
        int ndigit = snprintf(number, sizeof number, s->is_bad ? "%d!" : "%d", i + 1);
        if (i % 2 || s->is_bad) {
            put_rectangle(r, s->is_bad ? "under bad" : "under", x0, x1, p->top, p->bottom);
            PUT(r, "</rect>");
        }
        put_rectangle(r,
                      s->is_bad ? "span bad"
                      : i % 2   ? "span odd"
                                : "span",
                      x0, x1, y0, y0 + SPAN_HEIGHT);
        PUT(r, "<title>%d ", i + 1);
        om__report_escape(r, name);
        PUT(r, "%s</title></rect>\n", s->is_bad ? " (did not end as meant)" : "");
        bool is_named = LETTER * (double)(strlen(name) + (size_t)ndigit + 1) + 6 < x1 - x0;
        if (!is_named && LETTER * ndigit + 2 > x1 - x0) continue;
        PUT(r, "<text class=\"span-name\" text-anchor=\"middle\"");
        put_attribute(r, "x", 0.5 * (x0 + x1)), put_attribute(r, "y", y0 + 14);
        PUT(r, ">%s", number);
        if (is_named) {
            PUT(r, " ");
            om__report_escape(r, name);
        }
        PUT(r, "</text>\n");
    }
}

// The name is at the left or the right end of the line.
static void put_limit(Plot* p, double limit, const char* name, bool is_right) {
    OmReport* r = p->report;
    if (!is_on(&p->y, limit)) return;
    double y = to_px(&p->y, limit);
    PUT(r, "<line class=\"limit\"");
    put_attribute(r, "x1", p->layout->left), put_attribute(r, "x2", p->layout->right);
    put_attribute(r, "y1", y), put_attribute(r, "y2", y);
    PUT(r, "/><text class=\"limit-name\"%s", is_right ? " text-anchor=\"end\"" : "");
    bool is_at_top = y - p->top < 16;
    put_attribute(r, "x", is_right ? p->layout->right - 8 : p->layout->left + 8);
    put_attribute(r, "y", is_at_top ? y + 15 : y - 6);
    PUT(r, ">");
    om__report_escape(r, name);
    PUT(r, "</text>\n");
}

static void put_events(Plot* p) {
    OmReport* r = p->report;
    for (int i = 0; i < p->chart->nevent; ++i) {
        double at = p->chart->event[i];
        if (!is_drawable(at) || at < p->x.lo || at > p->x.hi) continue;
        double x = to_px(&p->x, at);
        PUT(r, "<line class=\"event\"");
        put_attribute(r, "x1", x), put_attribute(r, "x2", x);
        put_attribute(r, "y1", p->top), put_attribute(r, "y2", p->bottom);
        PUT(r, "/>\n");
    }
}

// ---- lines --------------------------------------------------------------------------------------------------

typedef struct Pen {
    OmReport* report;
    bool is_down, is_step;
} Pen;

static void draw_to(Pen* pen, double x, double y) {
    OmReport* r = pen->report;
    if (pen->is_down && pen->is_step) {
        PUT(r, "H");
        put_px(r, x);
        PUT(r, "V");
        put_px(r, y);
    } else {
        PUT(r, pen->is_down ? "L" : "M");
        put_px(r, x);
        PUT(r, " ");
        put_px(r, y);
    }
    if (!pen->is_down) PUT(r, "h0");  // a single point is drawn as a dot
    pen->is_down = true;
}

// The first, smallest, largest and last point of each column of the plot.
static int draw_column(Pen* pen, const Plot* p, const OmReportSeries* s, int begin) {
    double column = floor(to_px(&p->x, s->x[begin]));
    int end = begin, min = begin, largest = begin;
    for (; end < s->n && is_on(&p->x, s->x[end]) && is_on(&p->y, s->y[end]); ++end) {
        if (floor(to_px(&p->x, s->x[end])) != column) break;
        if (s->y[end] < s->y[min]) min = end;
        if (s->y[end] > s->y[largest]) largest = end;
    }
    int early = min < largest ? min : largest, late = min < largest ? largest : min;
    const int keep[4] = {begin, early, late, end - 1};
    for (int k = 0; k < 4; ++k) {
        if (k > 0 && keep[k] == keep[k - 1]) continue;
        draw_to(pen, to_px(&p->x, s->x[keep[k]]), to_px(&p->y, s->y[keep[k]]));
    }
    return end;
}

static void put_series(Plot* p, int index) {
    const OmReportSeries* s = &p->chart->series[index];
    OmReport* r = p->report;
    Pen pen = {.report = r, .is_step = s->is_step};
    bool is_dense = s->n > 2 * (p->layout->right - p->layout->left);
    PUT(r, "<path class=\"data c%d\" d=\"", index);
    for (int i = 0; i < s->n;) {
        if (!is_on(&p->x, s->x[i]) || !is_on(&p->y, s->y[i])) {
            pen.is_down = false;
            ++i;
        } else if (is_dense) {
            i = draw_column(&pen, p, s, i);
        } else {
            draw_to(&pen, to_px(&p->x, s->x[i]), to_px(&p->y, s->y[i]));
            ++i;
        }
    }
    PUT(r, "\">");
    if (s->name) {
        PUT(r, "<title>");
        om__report_escape(r, s->name);
        PUT(r, "</title>");
    }
    PUT(r, "</path>\n");
}

// ---- boxes --------------------------------------------------------------------------------------------------

// Whiskers from the smallest to the largest value, a box between the quartiles, a line at the median.
static void put_box(Plot* p, int group, int series) {
    OmReport* r = p->report;
    const OmReportChart* c = p->chart;
    const OmReportBox* b = &c->box[group * c->nseries + series];
    if (!b->n || !is_on(&p->y, b->min) || !is_on(&p->y, b->max)) return;
    double share = 0.8 / c->nseries, x = group + 0.1 + (series + 0.5) * share;
    double left = to_px(&p->x, x - 0.36 * share), right = to_px(&p->x, x + 0.36 * share);
    double middle = to_px(&p->x, x), upper = to_px(&p->y, b->upper), lower = to_px(&p->y, b->lower);
    const double line[3][4] = {{middle, middle, to_px(&p->y, b->max), upper},
                               {middle, middle, lower, to_px(&p->y, b->min)},
                               {left, right, to_px(&p->y, b->median), to_px(&p->y, b->median)}};
    for (int i = 0; i < 3; ++i) {
        PUT(r, "<line class=\"data c%d\"", series);
        put_attribute(r, "x1", line[i][0]), put_attribute(r, "x2", line[i][1]);
        put_attribute(r, "y1", line[i][2]), put_attribute(r, "y2", line[i][3]);
        PUT(r, "/>\n");
    }
    char class[24];
    snprintf(class, sizeof class, "data c%d", series);
    put_rectangle(r, class, left, right, upper, lower);
    PUT(r, "<title>");
    om__report_escape(r, c->series[series].name);
    PUT(r, ", ");
    om__report_escape(r, c->group[group]);
    PUT(r, ", %d values</title></rect>\n", b->n);
}

// ---- the whole ----------------------------------------------------------------------------------------------

static void put_caption(OmReport* r, const OmReportChart* c) {
    PUT(r, "<figcaption><span>");
    om__report_escape(r, c->title);
    PUT(r, "</span>");
    if (c->y_label && *c->y_label) {
        PUT(r, "<span class=\"unit\">");
        om__report_escape(r, c->y_label);
        PUT(r, "</span>");
    }
    if (c->nseries > 1) {
        PUT(r, "<span class=\"legend\">");
        for (int s = 0; s < c->nseries; ++s) {
            PUT(r, "<span><i class=\"c%d\"></i>", s);
            om__report_escape(r, c->series[s].name);
            PUT(r, "</span>");
        }
        PUT(r, "</span>");
    }
    PUT(r, "</figcaption>\n");
}

static void put_plot(Plot* p, bool has_narrow) {
    OmReport* r = p->report;
    const OmReportChart* c = p->chart;
    p->top = c->nspan > 0 ? SPAN_HEIGHT + 8 : 8;
    p->bottom = p->top + p->layout->height;
    p->x.from = p->layout->left;
    p->x.to = p->layout->right;
    p->y.from = p->bottom;
    p->y.to = p->top;
    int id = ++r->nchart;
    PUT(r, "<svg class=\"%s%s\" viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"", p->layout->class,
        has_narrow ? " has-narrow" : "", (int)p->layout->width, (int)(p->bottom + 46));
    om__report_escape(r, c->title);
    PUT(r, "\">\n<clipPath id=\"plot%d\"><rect", id);
    put_attribute(r, "x", p->layout->left),
        put_attribute(r, "width", p->layout->right - p->layout->left);
    put_attribute(r, "y", p->top - 2), put_attribute(r, "height", p->layout->height + 4);
    PUT(r, "/></clipPath>\n");
    put_spans(p);
    put_axes(p);
    put_events(p);
    PUT(r, "<g clip-path=\"url(#plot%d)\">\n", id);
    for (int s = 0; s < c->nseries && !c->ngroup; ++s) put_series(p, s);
    for (int i = 0; i < c->ngroup * c->nseries; ++i) put_box(p, i / c->nseries, i % c->nseries);
    PUT(r, "</g>\n");
    if (c->has_limit) put_limit(p, c->limit, c->limit_name, false);
    if (c->limit2_name) put_limit(p, c->limit2, c->limit2_name, true);
    PUT(r, "</svg>\n");
}

// Names of groups, side by side.
static bool is_fitting(const OmReportChart* c, const Layout* layout) {
    for (int i = 0; i < c->ngroup; ++i)
        if (LETTER * (double)strlen(c->group[i]) > (layout->right - layout->left) / c->ngroup)
            return false;
    return true;
}

static OmStatus check_chart(const OmReportChart* c) {
    const char* title = c->title ? c->title : "";
    OM_CHECK(c->nseries >= 0 && c->nseries <= OM_REPORT_MAX_SERIES, OM_INVALID,
             "report: chart \"%s\" of %d series; up to %d", title, c->nseries,
             OM_REPORT_MAX_SERIES);
    return OM_OK;
}

void om_report_chart(OmReport* r, const OmReportChart* chart) {
    om__report_begin_block(r);
    om__report_keep(r, check_chart(chart));
    if (r->status < 0) return;
    Plot plot = {.report = r, .chart = chart, .layout = &wide};
    Plot phone = {.report = r, .chart = chart, .layout = &narrow};
    PUT(r, "<figure class=\"chart\">");
    put_caption(r, chart);
    if (choose_ranges(&plot) && choose_ranges(&phone)) {
        const bool has_narrow = is_fitting(chart, &narrow);
        PUT(r, "<div class=\"plot\">\n");
        put_plot(&plot, has_narrow);
        if (has_narrow) put_plot(&phone, false);
        PUT(r, "</div>\n");
    } else {
        PUT(r, "<p>No values were recorded.</p>\n");
    }
    PUT(r, "</figure>\n");
}
