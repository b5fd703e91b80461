// match_visible.c: the part of the twin's surface that a camera sees, by a depth buffer.
//
// All triangles are drawn into a buffer of about 160 columns; a second pass counts the pixels where a triangle that
// faces the camera is not more than `slack` behind the nearest one. A pixel of the picture that shows a tool hides the
// twin. A triangle that covers no pixel centre is looked up at its own centre.
//
// Rays (om_sense_scene) would need a new scene for each iteration; drawing 1,760 triangles takes 0.6 ms.
#include <string.h>

#include "match/match_internal.h"

#define COLUMNS 160

OmStatus om__match_buffer_init(const OmScan* scan, int nvert, MatchBuffer* b) {
    OmStatus status = OM_OK;
    memset(b, 0, sizeof *b);
    b->scan = scan;
    int w = scan->camera.width, h = scan->camera.height;
    b->step = w > COLUMNS ? (w + COLUMNS / 2) / COLUMNS : 1;
    b->width = w / b->step > 0 ? w / b->step : 1;
    b->height = h / b->step > 0 ? h / b->step : 1;
    OM_ALLOC_DONE(b->depth, (size_t)b->width * (size_t)b->height);
    OM_ALLOC_DONE(b->corner, 3 * (size_t)nvert);
done:
    if (status < 0) om__match_buffer_done(b);
    return status;
}

void om__match_buffer_done(MatchBuffer* b) {
    om_free(b->depth);
    om_free(b->corner);
    memset(b, 0, sizeof *b);
}

// Column, row and inverse depth of each vertex; 0: not in front of the camera.
static void project(MatchBuffer* b, const double* xs, int nvert) {
    const OmCamera* camera = &b->scan->camera;
    OmPose pose_camera_world = om_pose_inverse(camera->pose_world_camera);
    for (int i = 0; i < nvert; ++i) {
        OmVec3 p = om_load3(xs, i);
        double u = 0, v = 0, z = om_pose_apply(pose_camera_world, p).z;
        bool is_before = om_camera_project(camera, p, &u, &v) && z > 0;
        om_store3(b->corner, i, om_vec3(u / b->step, v / b->step, is_before ? 1 / z : 0));
    }
}

typedef struct Drawing {  // of one triangle
    OmVec3 a, b, c;       // column, row, inverse depth
    double area;          // twice that in the buffer, signed
    int x0, x1, y0, y1;   // pixels of its box
} Drawing;

static int clamp(double value, int max) { return value <= 0 ? 0 : value >= max ? max : (int)value; }

// False if the triangle has a corner behind the camera, or no area.
static bool begin(const MatchBuffer* m, const int v[3], Drawing* d) {
    OmVec3 a = om_load3(m->corner, v[0]), b = om_load3(m->corner, v[1]),
           c = om_load3(m->corner, v[2]);
    d->a = a, d->b = b, d->c = c;
    d->area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    d->x0 = clamp(floor(fmin(a.x, fmin(b.x, c.x))), m->width);
    d->x1 = clamp(ceil(fmax(a.x, fmax(b.x, c.x))), m->width);
    d->y0 = clamp(floor(fmin(a.y, fmin(b.y, c.y))), m->height);
    d->y1 = clamp(ceil(fmax(a.y, fmax(b.y, c.y))), m->height);
    return a.z > 0 && b.z > 0 && c.z > 0 && fabs(d->area) > 1e-12;
}

// Depth of the triangle at the centre of a pixel, 0 outside the triangle.
static double depth_at(const Drawing* d, int x, int y) {
    double px = x + 0.5 - d->a.x, py = y + 0.5 - d->a.y;
    double wb = (px * (d->c.y - d->a.y) - py * (d->c.x - d->a.x)) / d->area;
    double wc = ((d->b.x - d->a.x) * py - (d->b.y - d->a.y) * px) / d->area;
    double wa = 1 - wb - wc;
    if (wa < 0 || wb < 0 || wc < 0) return 0;
    return 1 / (wa * d->a.z + wb * d->b.z + wc * d->c.z);  // inverse depths are positive
}

static void draw(MatchBuffer* m, const int v[3]) {
    Drawing d;
    if (!begin(m, v, &d)) return;
    for (int y = d.y0; y < d.y1; ++y)
        for (int x = d.x0; x < d.x1; ++x) {
            float z = (float)depth_at(&d, x, y);
            float* at = m->depth + (size_t)y * (size_t)m->width + (size_t)x;
            if (z > 0 && z < *at) *at = z;
        }
}

// What the picture shows at a pixel; beyond its border as at the border.
static int picture_at(const MatchBuffer* m, int column, int row) {
    const OmCamera* c = &m->scan->camera;
    column = column < 0 ? 0 : column >= c->width ? c->width - 1 : column;
    row = row < 0 ? 0 : row >= c->height ? c->height - 1 : row;
    return m->scan->pixel[(size_t)row * (size_t)c->width + (size_t)column];
}

// Whether the picture shows another thing before depth z at a pixel of the buffer: it hides the twin, as a tool does.
static bool is_hidden(const MatchBuffer* m, int x, int y, double z) {
    const OmCamera* c = &m->scan->camera;
    if (!m->scan->pixel || !m->scan->depth) return false;
    int column = x * m->step + m->step / 2, row = y * m->step + m->step / 2;
    if (column >= c->width || row >= c->height) return false;
    size_t i = (size_t)row * (size_t)c->width + (size_t)column;
    double shown = (double)m->scan->depth[i];
    return m->scan->pixel[i] == OM_SCAN_OTHER && shown > 0 && shown < z;
}

// What the picture shows at a pixel of the buffer. Other things count only with other things around: outlines of twin
// and tissue differ by a pixel.
static int class_at(const MatchBuffer* m, int x, int y) {
    if (!m->scan->pixel) return OM_SCAN_UNKNOWN;
    int column = x * m->step + m->step / 2, row = y * m->step + m->step / 2, around = 2 * m->step;
    int shown = picture_at(m, column, row);
    if (shown != OM_SCAN_OTHER) return shown;
    bool is_sure = picture_at(m, column - around, row) == OM_SCAN_OTHER &&
                   picture_at(m, column + around, row) == OM_SCAN_OTHER &&
                   picture_at(m, column, row - around) == OM_SCAN_OTHER &&
                   picture_at(m, column, row + around) == OM_SCAN_OTHER;
    return is_sure ? OM_SCAN_OTHER : OM_SCAN_UNKNOWN;
}

static bool is_without_depth(const MatchBuffer* m, int x, int y) {
    const OmCamera* c = &m->scan->camera;
    int column = x * m->step + m->step / 2, row = y * m->step + m->step / 2;
    if (!m->scan->pixel || !m->scan->depth || column >= c->width || row >= c->height) return false;
    size_t i = (size_t)row * (size_t)c->width + (size_t)column;
    return m->scan->pixel[i] == OM_SCAN_UNKNOWN && !(m->scan->depth[i] > 0);
}

// Whether the point of the twin at this pixel and depth is in view; counts the class of the pixel.
static bool look(MatchBuffer* m, int x, int y, double z, double slack) {
    if (x < 0 || y < 0 || x >= m->width || y >= m->height) return false;
    if (z > (double)m->depth[(size_t)y * (size_t)m->width + (size_t)x] + slack) return false;
    if (is_hidden(m, x, y, z - OM__MATCH_BEFORE)) return false;
    int shown = class_at(m, x, y);
    m->ntissue += shown == OM_SCAN_TISSUE;
    m->nother += shown == OM_SCAN_OTHER;
    m->nempty += is_without_depth(m, x, y);
    return shown != OM_SCAN_TOOL;
}

static bool is_seen(MatchBuffer* m, const int v[3], double slack) {
    Drawing d;
    if (!begin(m, v, &d)) return false;
    int nin = 0, nseen = 0;
    for (int y = d.y0; y < d.y1; ++y)
        for (int x = d.x0; x < d.x1; ++x) {
            double z = depth_at(&d, x, y);
            if (z <= 0) continue;
            ++nin;
            nseen += look(m, x, y, z, slack);
        }
    if (nin > 0) return nseen > 0;
    OmVec3 q = om_scale(1.0 / 3, om_add(d.a, om_add(d.b, d.c)));
    return look(m, (int)floor(q.x), (int)floor(q.y), 1 / q.z, slack);
}

void om__match_mark_visible(MatchBuffer* m, const OmSurface* surface, const double* xs,
                            double slack, unsigned char* use) {
    size_t n = (size_t)m->width * (size_t)m->height;
    for (size_t i = 0; i < n; ++i) m->depth[i] = HUGE_VALF;
    m->ntissue = m->nother = m->nempty = 0;
    project(m, xs, surface->nvert);
    for (int t = 0; t < surface->ntri; ++t) draw(m, surface->tri_vert + 3 * (size_t)t);
    for (int t = 0; t < surface->ntri; ++t) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(xs, v[0]);
        OmVec3 n3 = om_cross(om_sub(om_load3(xs, v[1]), a), om_sub(om_load3(xs, v[2]), a));
        OmVec3 eye = m->scan->camera.pose_world_camera.p;
        use[t] = om_dot(n3, om_sub(eye, a)) > 0 && is_seen(m, v, slack);
    }
}
