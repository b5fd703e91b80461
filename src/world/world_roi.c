// world_roi.c: the visible fraction of the ROI in a picture, by colour (thesis 6.5.3).
//
// The meter renders the ROI once for each camera, without tissue and tools: its pixels of the ROI's colour are those
// that can be seen at most, and rays to the ROI's points say which fraction they are. A look adds the pixels of the
// ROI's colour over that sum, so that highlights and pixels at the border, which are the same in both pictures, cancel.
// A pixel counts by the area of the ROI that it shows. Without that, the near and the steep parts of a ROI on an organ
// count too much and too little.
//
// Tried and rejected: the colour of the pixel at each point of the ROI, over all points. It has no weights, but a ROI
// that lies 3 mm beside its known place would be seen to 76 % at most, and would never count as exposed.
#include <string.h>

#include "omentum/shape_meshing.h"
#include "omentum/world_cloud.h"
#include "world/world_view.h"

#define GRAZING \
    0.1          // smallest |n . p| / |p|: an area seen more obliquely counts as seen at this one
#define ALIGN 8  // of the window's columns: see OmSenseOptions.window

struct OmRoiMeter {
    const OmSite* site;
    bool has_camera;
    OmCamera camera;  // of the last look; the following are for it
    OmWindow window;  //
    float* weight;    // m^2, area of the ROI that a pixel of the window shows; 0: too far from it
    double whole;     // m^2, area that is seen without tissue and tools
    double most;      // fraction of the ROI's points that is seen without tissue and tools
};

OmStatus om_roi_meter_create(const OmSite* site, OmRoiMeter** meter) {
    *meter = NULL;
    OM_CHECK(site->nroi > 0, OM_INVALID, "the site has no ROI");
    OmRoiMeter* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    m->site = site;
    *meter = m;
    return OM_OK;
}

void om_roi_meter_destroy(OmRoiMeter* m) {
    if (!m) return;
    om_free(m->weight);
    om_free(m);
}

OmWindow om_roi_meter_window(const OmRoiMeter* m) { return m->window; }

static bool is_roi_pixel(const OmPicture* color, ptrdiff_t at) {
    return om_sense_part_of(&color->pixel[color->nchannel * at]) == OM_PART_ROI;
}

// ---- without tissue and tools -------------------------------------------------------------------------------

typedef struct RoiPoint {  // a point of the ROI that faces the camera and lies in front of it
    double u, v;           // pixels
    OmVec3 p;              // m, frame of the camera
    OmVec3 ground;         // normal of the ground there, frame of the camera
    OmVec3 drawn;          // normal of the surface that is drawn
    double near2;          // pixels^2, square of OM_ROI_MARGIN there
} RoiPoint;

// Normals of the surface of the ROI that is drawn. The points of a dome on a board all have the board's normal, but the
// side of the dome towards the camera has up to 14 % more pixels, and the other side less: without this the visibility
// of five layouts was wrong by -0.02 to 0.013 in the mean.
static OmStatus find_normals(const OmSite* site, double* normal) {
    memcpy(normal, site->roi_n, 3 * (size_t)site->nroi * sizeof *normal);
    const OmSurface* roi = &site->roi;
    if (roi->ntri == 0) return OM_OK;
    double* of_vert;
    OM_ALLOC(of_vert, 3 * (size_t)roi->nvert);
    om_surface_normals(roi, of_vert);
    for (int i = 0; i < site->nroi; ++i) {
        OmVec3 x = om_load3(site->roi_x, i);
        double best = INFINITY;
        int nearest = 0;
        for (int v = 0; v < roi->nvert; ++v) {
            double d = om_norm2(om_sub(om_load3(roi->x, v), x));
            if (d >= best) continue;
            best = d;
            nearest = v;
        }
        OmVec3 n = om_load3(of_vert, nearest);
        double side = om_dot(n, om_load3(site->roi_n, i));
        if (side != 0) om_store3(normal, i, side > 0 ? n : om_scale(-1, n));
    }
    om_free(of_vert);
    return OM_OK;
}

// The number of points that face the camera.
// @param surface  normals of the surface that is drawn  (nroi x 3)
static int project_points(const OmSite* site, const double* surface, const OmCamera* camera,
                          RoiPoint* point) {
    OmLens lens = om_camera_lens(camera);
    OmPose to_camera = om_pose_inverse(camera->pose_world_camera);
    int n = 0;
    for (int i = 0; i < site->nroi; ++i) {
        OmVec3 x = om_load3(site->roi_x, i);
        RoiPoint q = {.p = om_pose_apply(to_camera, x),
                      .ground = om_quat_rotate(to_camera.q, om_load3(site->roi_n, i)),
                      .drawn = om_quat_rotate(to_camera.q, om_load3(surface, i))};
        bool is_facing = om_dot(q.ground, q.p) < 0;
        if (!is_facing || !om_camera_project(camera, x, &q.u, &q.v)) continue;
        double margin = OM_ROI_MARGIN * fmax(lens.fx, lens.fy) / q.p.z;  // above 0: it projects
        q.near2 = margin * margin;
        point[n++] = q;
    }
    return n;
}

// The box around all points with the margin.
static OmWindow window_of(const OmCamera* camera, int n, const RoiPoint* point) {
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < n; ++i) {
        double margin = sqrt(point[i].near2);
        lo[0] = fmin(lo[0], point[i].u - margin), hi[0] = fmax(hi[0], point[i].u + margin);
        lo[1] = fmin(lo[1], point[i].v - margin), hi[1] = fmax(hi[1], point[i].v + margin);
    }
    const double size[2] = {camera->width, camera->height};
    for (int k = 0; k < 2; ++k) {
        lo[k] = fmin(fmax(floor(lo[k]), 0), size[k]);
        hi[k] = fmin(fmax(ceil(hi[k]), 0), size[k]);
    }
    int column = (int)lo[0] / ALIGN * ALIGN, row = (int)lo[1];
    OmWindow window = {column, row, (int)hi[0] - column, (int)hi[1] - row};
    return window.width > 0 && window.height > 0 ? window : (OmWindow){0};
}

// m^2, area that a pixel shows of the plane through p: z^3 / |n . p| / (fx fy) where the pixel's ray meets the plane.
// @param ray  of the pixel, frame of the camera
static double area_of(const OmLens* lens, OmVec3 p, OmVec3 normal, OmVec3 ray) {
    double height = -om_dot(normal, p), steep = -om_dot(normal, ray);
    height = fmax(height, GRAZING * om_norm(p));
    double z = ray.z * height / fmax(steep, GRAZING);
    return z * z * z / (height * lens->fx * lens->fy);
}

static const RoiPoint* find_nearest(int n, const RoiPoint* point, double u, double v) {
    const RoiPoint* nearest = point;
    double best = INFINITY;
    for (int i = 0; i < n; ++i) {
        double du = u - point[i].u, dv = v - point[i].v, d = du * du + dv * dv;
        if (d >= best) continue;
        best = d;
        nearest = &point[i];
    }
    return nearest;
}

// Beside the ROI's known place a pixel has the area that it shows of the board, so that a ROI which lies there counts
// by its size. An organ is curved, and its ROI may end on a slope: there a pixel has the mean area of the ROI's pixels.
// With the area at the nearest point a kidney's tumour that lay 0.7 mm aside counted 11 % too much, and was seen to
// 88 % where rays saw 83 %; with the plane at the nearest point to 90 % where rays saw 80 %.
static void fill_weights(OmRoiMeter* m, const OmCamera* camera, int n, const RoiPoint* point,
                         const OmPicture* bare) {
    const OmWindow* w = &m->window;
    const OmLens lens = om_camera_lens(camera);
    const OmQuat to_camera = om_quat_conj(camera->pose_world_camera.q);
    double sum = 0;
    int nroi = 0;
    for (int k = 0; k < w->width * w->height; ++k) {
        double u = w->column + k % w->width + 0.5, v = w->row + k / w->width + 0.5;
        const RoiPoint* q = find_nearest(n, point, u, v);
        OmVec3 ray = om_quat_rotate(to_camera, om_camera_ray(camera, u, v));
        double du = u - q->u, dv = v - q->v;
        bool is_roi = is_roi_pixel(bare, k), is_near = du * du + dv * dv <= q->near2;
        double area = area_of(&lens, q->p, is_roi ? q->drawn : q->ground, ray);
        if (!is_roi && m->site->has_organ) area = -1;  // the mean, below
        m->weight[k] = is_near ? (float)area : 0.0f;
        sum += is_near && is_roi ? area : 0;
        nroi += is_near && is_roi;
    }
    double mean = nroi > 0 ? sum / nroi : 0;
    for (int k = 0; k < w->width * w->height; ++k)
        if (m->weight[k] < 0) m->weight[k] = (float)mean;
}

static double add_roi_pixels(const OmRoiMeter* m, OmWindow at, const OmPicture* color) {
    double sum = 0;
    for (int row = 0; row < m->window.height; ++row) {
        int from = row + m->window.row - at.row;
        if (from < 0 || from >= at.height) continue;
        for (int column = 0; column < m->window.width; ++column) {
            int to = column + m->window.column - at.column;
            float w = m->weight[(ptrdiff_t)row * m->window.width + column];
            if (to < 0 || to >= at.width || !(w > 0)) continue;
            if (is_roi_pixel(color, (ptrdiff_t)from * at.width + to)) sum += (double)w;
        }
    }
    return sum;
}

static OmStatus look_without_tissue(OmRoiMeter* m, const OmCamera* camera) {
    OmStatus status = OM_OK;
    OmView* view = NULL;
    OmVisibility seen = {0};
    OmPicture bare = {0};
    RoiPoint* point = NULL;
    double* surface = NULL;
    OM_ALLOC_DONE(point, m->site->nroi);
    OM_ALLOC_DONE(surface, 3 * (size_t)m->site->nroi);
    m->has_camera = false;
    om_free(m->weight);
    m->weight = NULL;
    m->whole = m->most = 0;
    OM_TRY_DONE(find_normals(m->site, surface));
    int n = project_points(m->site, surface, camera, point);
    m->window = window_of(camera, n, point);
    if (m->window.width > 0) {
        OM_ALLOC_DONE(m->weight, (size_t)m->window.width * (size_t)m->window.height);
        OM_TRY_DONE(om__view_create(camera, m->site, &view));
        OM_TRY_DONE(om_view_look(view, NULL, &seen));
        OM_TRY_DONE(om__view_render_bare(view, m->window, &bare));
        fill_weights(m, camera, n, point, &bare);
        m->whole = add_roi_pixels(m, m->window, &bare);
        m->most = (double)seen.nseen / seen.npoint;  // the ROI has points
    }
    m->camera = *camera;
    m->has_camera = true;
done:
    om_picture_done(&bare);
    om_view_destroy(view);
    om_free(point);
    om_free(surface);
    return status;
}

// ---- a look -------------------------------------------------------------------------------------------------

static bool is_same_camera(const OmCamera* a, const OmCamera* b) {
    OmLens l = om_camera_lens(a), m = om_camera_lens(b);
    OmPose p = a->pose_world_camera, q = b->pose_world_camera;
    return a->width == b->width && a->height == b->height && l.fx == m.fx && l.fy == m.fy &&
           l.cx == m.cx && l.cy == m.cy && l.k1 == m.k1 && l.k2 == m.k2 && l.k3 == m.k3 &&
           l.p1 == m.p1 && l.p2 == m.p2 && om_distance(p.p, q.p) == 0 && p.q.w == q.q.w &&
           p.q.x == q.q.x && p.q.y == q.q.y && p.q.z == q.q.z;
}

OmStatus om_roi_meter_look(OmRoiMeter* m, const OmWorldPicture* picture, double* visibility) {
    *visibility = 0;
    const OmPicture* color = &picture->color;
    const OmCamera* camera = &picture->camera;
    OM_CHECK(color->pixel && color->nchannel >= 3, OM_INVALID,
             "the endoscope's picture is missing");
    OmWindow at = om_window_clip(picture->window, camera->width, camera->height);
    OM_CHECK(at.width == color->width && at.height == color->height, OM_INVALID,
             "the endoscope's picture has %d x %d pixels, its window %d x %d", color->width,
             color->height, at.width, at.height);
    if (!m->has_camera || !is_same_camera(&m->camera, camera))
        OM_TRY(look_without_tissue(m, camera));
    if (!(m->whole > 0)) return OM_OK;  // no camera sees it
    *visibility = fmin(1, m->most * add_roi_pixels(m, at, color) / m->whole);
    return OM_OK;
}

OmStatus om_roi_visibility(const OmWorldPicture* picture, const OmSite* site, double* visibility) {
    *visibility = 0;
    OmRoiMeter* meter;
    OM_TRY(om_roi_meter_create(site, &meter));
    OmStatus status = om_roi_meter_look(meter, picture, visibility);
    om_roi_meter_destroy(meter);
    return status;
}
