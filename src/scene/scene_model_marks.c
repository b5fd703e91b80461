// scene_model_marks.c: marks of direction and a bar of length in pictures of a patient.
//
// The letters at the four borders name the side of the patient there: Right, Left, Anterior, Posterior,
// Superior, Inferior. As in DICOM, an oblique direction has several letters, the nearest first. Letters are
// drawn as pixels, in cells of 5 x 7.
#include <string.h>

#include "scene/scene_model_marks.h"

enum { CELL_WIDTH = 5, CELL_HEIGHT = 7, SCALE = 3, MARGIN = 8 };

// A direction gets a letter if it is within 67.5 degrees of it; within 22.5 degrees of an axis only
// one letter remains.
#define LEAST_COSINE 0.383

// ---- letters and length of the bar ------------------------------------------------------------------------------

static void name_direction(OmVec3 d, char out[4]) {
    static const char letter[3][2] = {{'L', 'R'}, {'P', 'A'}, {'I', 'S'}};
    const double c[3] = {d.x, d.y, d.z};
    bool is_used[3] = {false, false, false};
    int n = 0;
    for (int i = 0; i < 3; i++) {
        int best = -1;
        for (int a = 0; a < 3; a++)
            if (!is_used[a] && (best < 0 || fabs(c[a]) > fabs(c[best]))) best = a;
        if (n > 0 && fabs(c[best]) < LEAST_COSINE) break;
        is_used[best] = true;
        out[n++] = letter[best][c[best] > 0];
    }
    out[n] = 0;
}

OmViewMarks om__view_marks(const OmCamera* camera, double distance) {
    OmViewMarks m;
    const OmVec3 right = om_quat_rotate(camera->pose_world_camera.q, om_vec3(1, 0, 0));
    const OmVec3 down = om_quat_rotate(camera->pose_world_camera.q, om_vec3(0, 1, 0));
    name_direction(right, m.right);
    name_direction(om_scale(-1, right), m.left);
    name_direction(down, m.bottom);
    name_direction(om_scale(-1, down), m.top);
    const double pixel = 2 * distance * tan(0.5 * camera->fov) / camera->height;  // m
    const double longest = 0.3 * camera->width * pixel;
    double bar = pow(10, floor(log10(longest)));  // 1, 2 or 5 times a power of ten
    bar *= longest >= 5 * bar ? 5 : longest >= 2 * bar ? 2 : 1;
    m.bar = bar;
    m.bar_pixels = bar / pixel;
    return m;
}

// ---- drawing --------------------------------------------------------------------------------------------------

static const unsigned char* find_glyph(char c) {
    static const struct {
        char c;
        unsigned char row[CELL_HEIGHT];  // the highest of the five bits is the left column
    } font[] = {
        {'R', {0x1e, 0x11, 0x11, 0x1e, 0x14, 0x12, 0x11}},
        {'L', {0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1f}},
        {'A', {0x0e, 0x11, 0x11, 0x1f, 0x11, 0x11, 0x11}},
        {'P', {0x1e, 0x11, 0x11, 0x1e, 0x10, 0x10, 0x10}},
        {'S', {0x0f, 0x10, 0x10, 0x0e, 0x01, 0x01, 0x1e}},
        {'I', {0x0e, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e}},
        {'m', {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15}},
        {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c}},
        {'0', {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e}},
        {'1', {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e}},
        {'2', {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f}},
        {'5', {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e}},
    };
    for (size_t i = 0; i < sizeof font / sizeof *font; i++)
        if (font[i].c == c) return font[i].row;
    return NULL;  // a blank
}

static void fill(OmPicture* p, int x, int y, int w, int h, unsigned char shade) {
    for (int j = y < 0 ? 0 : y; j < y + h && j < p->height; j++) {
        for (int i = x < 0 ? 0 : x; i < x + w && i < p->width; i++)
            memset(&p->pixel[3 * ((size_t)j * (size_t)p->width + (size_t)i)], shade, 3);
    }
}

static int text_width(const char* text, int scale) {
    return (int)strlen(text) * (CELL_WIDTH + 1) * scale - scale;
}

// White with a black rim of one pixel, legible on any background.
static void draw_text(OmPicture* p, int x, int y, const char* text, int scale) {
    for (int is_white = 0; is_white < 2; is_white++) {
        for (int c = 0; text[c]; c++) {
            const unsigned char* row = find_glyph(text[c]);
            for (int j = 0; row && j < CELL_HEIGHT; j++) {
                for (int i = 0; i < CELL_WIDTH; i++) {
                    if (!(row[j] >> (CELL_WIDTH - 1 - i) & 1)) continue;
                    const int px = x + (c * (CELL_WIDTH + 1) + i) * scale, py = y + j * scale;
                    if (is_white)
                        fill(p, px, py, scale, scale, 255);
                    else
                        fill(p, px - 1, py - 1, scale + 2, scale + 2, 0);
                }
            }
        }
    }
}

void om__draw_marks(OmPicture* p, const OmViewMarks* m) {
    const int high = CELL_HEIGHT * SCALE, mid = (p->height - high) / 2;
    draw_text(p, MARGIN, mid, m->left, SCALE);
    draw_text(p, p->width - MARGIN - text_width(m->right, SCALE), mid, m->right, SCALE);
    draw_text(p, (p->width - text_width(m->top, SCALE)) / 2, MARGIN, m->top, SCALE);
    draw_text(p, (p->width - text_width(m->bottom, SCALE)) / 2, p->height - MARGIN - high,
              m->bottom, SCALE);
    char length[32];
    snprintf(length, sizeof length, "%g mm", m->bar * 1e3);
    const int n = (int)(m->bar_pixels + 0.5), y = p->height - MARGIN - 3;
    fill(p, MARGIN - 1, y - 1, n + 2, 5, 0);
    fill(p, MARGIN, y, n, 3, 255);
    draw_text(p, MARGIN, y - 4 - CELL_HEIGHT * 2, length, 2);
}
