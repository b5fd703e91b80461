// report_map.c: a grid of numbers as an SVG drawing: colour, value and axes, so that it reads without a legend.
//
// Cells run from pale to dark blue with their value; the number in a cell is dark on pale and white on dark, in light
// mode and in dark mode. A cell without a value is grey and holds a word. A frame marks a cell, a double one another.
#include <math.h>
#include <string.h>

#include "report/report_internal.h"

// CHAR: width of a letter of the axes, px, on the safe side
enum { CELL_X = 62, CELL_Y = 44, LEFT = 34, TOP = 6, BOTTOM = 40, CHAR = 8, MAX_SIDE = 64 };

// From 0 (pale) to 1.
static void color_of(double s, int rgb[3]) {
    static const int pale[3] = {236, 244, 251}, dark[3] = {8, 64, 129};
    for (int k = 0; k < 3; ++k) rgb[k] = (int)lround(pale[k] + s * (dark[k] - pale[k]));
}

static void put_cell(OmReport* r, const OmReportMap* m, int ix, int iy) {
    const int i = iy * m->nx + ix, x = LEFT + ix * CELL_X, y = TOP + (m->ny - 1 - iy) * CELL_Y;
    const double value = m->value[i];
    int rgb[3] = {150, 158, 166};
    const double s =
        m->most > m->least ? fmax(0, fmin(1, (value - m->least) / (m->most - m->least))) : 0;
    if (isfinite(value)) color_of(s, rgb);
    PUT(r,
        "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" rx=\"3\" style=\"fill:rgb(%d,%d,%d)\"/>",
        x + 1, y + 1, CELL_X - 2, CELL_Y - 2, rgb[0], rgb[1], rgb[2]);
    for (int k = 0; m->mark && k < m->mark[i] && k < 2; ++k)
        PUT(r,
            "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" rx=\"3\" style=\"fill:none;stroke:#e69f00;"
            "stroke-width:3\"/>",
            x + 3 + 6 * k, y + 3 + 6 * k, CELL_X - 6 - 12 * k, CELL_Y - 6 - 12 * k);
    PUT(r, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\" style=\"fill:%s;font-size:13px\">",
        x + CELL_X / 2, y + CELL_Y / 2 + 5, isfinite(value) && s > 0.45 ? "#fff" : "#10202e");
    if (isfinite(value))
        PUT(r, "%.*f", m->digits, value);
    else
        om__report_escape(r, m->word && m->word[i] ? m->word[i] : "");
    PUT(r, "</text>\n");
}

static void put_axes(OmReport* r, const OmReportMap* m) {
    const int bottom = TOP + m->ny * CELL_Y;
    for (int ix = 0; ix < m->nx; ++ix)
        PUT(r, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%d</text>",
            LEFT + ix * CELL_X + CELL_X / 2, bottom + 15, ix + 1);
    for (int iy = 0; iy < m->ny; ++iy)
        PUT(r, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%d</text>", LEFT - 6,
            TOP + (m->ny - 1 - iy) * CELL_Y + CELL_Y / 2 + 4, iy + 1);
    PUT(r, "<text x=\"0\" y=\"%d\">", bottom + 32);
    om__report_escape(r, m->axes ? m->axes : "");
    PUT(r, "</text>\n");
}

// Of the picture: of the cells, or of the words below them where these are wider.
static int width_of(const OmReportMap* m) {
    const int cells = LEFT + m->nx * CELL_X + 4, words = m->axes ? CHAR * (int)strlen(m->axes) : 0;
    return words > cells ? words : cells;
}

void om_report_map(OmReport* r, const OmReportMap* m) {
    om__report_begin_block(r);
    if (m->nx < 1 || m->ny < 1 || m->nx > MAX_SIDE || m->ny > MAX_SIDE) {
        om__report_keep(r, om_error(OM_INVALID, "a map of %d x %d cells: 1 to %d along a side",
                                    m->nx, m->ny, MAX_SIDE));
        return;
    }
    PUT(r, "<figure class=\"chart\"><figcaption><span>");
    om__report_escape(r, m->title);
    PUT(r,
        "</span></figcaption>\n<svg viewBox=\"0 0 %d %d\" style=\"max-width:%dpx\" role=\"img\" aria-label=\"",
        width_of(m), TOP + m->ny * CELL_Y + BOTTOM, width_of(m));
    om__report_escape(r, m->title);
    PUT(r, "\">\n");
    for (int iy = 0; iy < m->ny; ++iy)
        for (int ix = 0; ix < m->nx; ++ix) put_cell(r, m, ix, iy);
    put_axes(r, m);
    PUT(r, "</svg></figure>\n");
}
