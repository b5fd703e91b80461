// rl_retract_view.c: the endoscope of the task "retract", and how much of the tumour it sees.
//
// TE (5.4.3) is measured in a picture: pixels in the HSV range of the tumour's colour inside a circle around q, over
// those in a picture without fat and tools. Reward (b) needs an exposure in every step: points of the tumour are looked
// up in the projected triangles of the fat, which takes 10 us where a ray tracer would build its tree anew each time.
// Both agree within 0.1 (test_rl_retract).
#include <math.h>
#include <string.h>

#include "rl/rl_retract_internal.h"

#define LIFT 0.0002               // m, of the drawn tumour above the kidney
#define BUMP 0.001                // m, height of the tumour
#define RING 8                    // rings of the drawn tumour
#define SECTOR 32                 // corners of a ring
#define CIRCLE 1.25               // radius of the region of interest over that of the tumour
#define ALIGN 8                   // of the window's columns: see OmSenseOptions.window
#define GOLDEN 2.399963229728653  // rad, between neighbours of a sunflower

// ---- surfaces ---------------------------------------------------------------------------------------

// A point of the tumour at polar coordinates (r, a) about q, as a part of its radius; beyond 1 on the kidney around it.
static OmVec3 tumour_point(const OmRlRetract* t, double r, double a) {
    OmVec3 n;
    double R = t->def.tumour_radius * r;
    OmVec3 p =
        om__rl_ground_top(&t->ground, t->true_q.x + R * cos(a), t->true_q.y + R * sin(a), &n);
    return om_madd(p, LIFT + BUMP * fmax(0, 1 - r * r), n);
}

static OmStatus make_tumour(OmRlRetract* t) {
    OM_TRY(om_surface_init(&t->tumour, 1 + RING * SECTOR, SECTOR * (2 * RING - 1)));
    om_store3(t->tumour.x, 0, tumour_point(t, 0, 0));
    int* tri = t->tumour.tri_vert;
    for (int r = 0; r < RING; ++r)
        for (int k = 0; k < SECTOR; ++k) {
            int at = 1 + r * SECTOR + k, next = 1 + r * SECTOR + (k + 1) % SECTOR;
            om_store3(t->tumour.x, at, tumour_point(t, (r + 1.0) / RING, 2 * OM_PI * k / SECTOR));
            if (r == 0) {
                memcpy(tri, (int[3]){0, at, next}, 3 * sizeof *tri);
                tri += 3;
                continue;
            }
            memcpy(tri, (int[6]){at - SECTOR, at, next, at - SECTOR, next, next - SECTOR},
                   6 * sizeof *tri);
            tri += 6;
        }
    return OM_OK;
}

static OmStatus make_quad(OmSurface* s, OmVec3 a, OmVec3 b, OmVec3 c, OmVec3 d) {
    OM_TRY(om_surface_init(s, 4, 2));
    om_store3(s->x, 0, a);
    om_store3(s->x, 1, b);
    om_store3(s->x, 2, c);
    om_store3(s->x, 3, d);
    memcpy(s->tri_vert, (int[6]){0, 1, 2, 0, 2, 3}, 6 * sizeof(int));
    return OM_OK;
}

// The bar that holds the fixed side.
static OmStatus make_rail(OmRlRetract* t) {
    const OmTetMesh* mesh = om_tissue_mesh(t->tissue);
    const OmMeshSet* set = om_tet_mesh_find_set(mesh, "attachment");
    OmVec3 lo = {INFINITY, INFINITY, INFINITY}, hi = {-INFINITY, -INFINITY, -INFINITY};
    for (int n = 0; n < set->nvert; ++n) {
        lo = om_min3(lo, om_load3(mesh->x, set->vert[n]));
        hi = om_max3(hi, om_load3(mesh->x, set->vert[n]));
    }
    OmTetMesh box = {0};
    OmVec3 pad = om_vec3(0.001, 0.003, 0.0025);
    OmStatus status = om_tet_mesh_box(om_sub(lo, pad), om_add(hi, pad), 1, 1, 1, &box);
    if (status == OM_OK) status = om_tet_mesh_boundary(&box, &t->rail, NULL);
    om_tet_mesh_done(&box);
    return status;
}

// Particles are the corners of the drawn sheet, elements have a boundary.
static OmStatus make_sheet(OmRlRetract* t) {
    const OmTetMesh* mesh = om_tissue_mesh(t->tissue);
    if (mesh->ntet > 0) return om_tet_mesh_boundary(mesh, &t->sheet, &t->sheet_vert);
    const int n = OM__RL_SIDE;
    OM_TRY(om_surface_init(&t->sheet, mesh->nvert, 2 * (n - 1) * (n - 1)));
    memcpy(t->sheet.x, mesh->x, 3 * (size_t)mesh->nvert * sizeof *mesh->x);
    int* tri = t->sheet.tri_vert;
    for (int j = 0; j + 1 < n; ++j)
        for (int i = 0; i + 1 < n; ++i, tri += 6) {
            int a = i + n * j, b = a + 1, c = a + n + 1, d = a + n;
            memcpy(tri, (int[6]){a, b, c, a, c, d}, 6 * sizeof *tri);
        }
    return OM_OK;
}

// ---- exposure of points -----------------------------------------------------------------------------

static void make_view(OmRlRetract* t) {
    OmLens lens = om_camera_lens(&t->def.endoscope);
    OmPose world = om_pose_inverse(t->def.endoscope.pose_world_camera);
    for (int c = 0; c < 4; ++c) {
        OmVec3 e = om_vec3(c == 0, c == 1, c == 2);
        OmVec3 p = c < 3 ? om_quat_rotate(world.q, e) : world.p;
        t->view[c] = lens.fx * p.x + lens.cx * p.z;
        t->view[4 + c] = lens.fy * p.y + lens.cy * p.z;
        t->view[8 + c] = p.z;
    }
}

static inline void project(const double view[12], const double* p, double out[3]) {
    double w = view[8] * p[0] + view[9] * p[1] + view[10] * p[2] + view[11];
    double inverse = w > 1e-3 ? 1 / w : 0;  // 0: behind the camera
    out[0] = inverse * (view[0] * p[0] + view[1] * p[1] + view[2] * p[2] + view[3]);
    out[1] = inverse * (view[4] * p[0] + view[5] * p[1] + view[6] * p[2] + view[7]);
    out[2] = inverse;
}

// Is the kidney in front of a point on it?
static bool is_behind_kidney(const OmRlRetract* t, OmVec3 p) {
    OmVec3 eye = t->def.endoscope.pose_world_camera.p, n;
    OmVec3 way = om_normalize(om_sub(eye, p));
    for (double s = 0.003; s < 0.12; s += 0.001)
        if (om__rl_ground_distance(&t->ground, om_madd(p, s, way), &n) < t->ground.shift)
            return true;
    return false;
}

static double roi_radius(int k) { return sqrt((k + 0.5) / OM__RL_NROI); }

static OmStatus make_points(OmRlRetract* t) {
    t->roi_lo[0] = t->roi_lo[1] = INFINITY;
    t->roi_hi[0] = t->roi_hi[1] = -INFINITY;
    double whole = 1 + t->def.margin / t->def.tumour_radius;
    for (int k = 0; k < OM__RL_NROI; ++k) {
        OmVec3 p = tumour_point(t, whole * roi_radius(k), GOLDEN * k);
        double xyz[3], *uvw = t->roi_uvw + 3 * k;
        om_store3(xyz, 0, p);
        project(t->view, xyz, uvw);
        OM_CHECK(uvw[2] > 0 && uvw[0] > 0 && uvw[1] > 0 && uvw[0] < t->def.endoscope.width &&
                     uvw[1] < t->def.endoscope.height,
                 OM_INVALID,
                 "rl retract: the tumour or its margin is not in the endoscope's picture");
        OM_CHECK(
            !is_behind_kidney(t, p), OM_INVALID,
            "rl retract: the kidney hides a part of the tumour or its margin from the endoscope");
        for (int a = 0; a < 2; ++a) {
            t->roi_lo[a] = fmin(t->roi_lo[a], uvw[a]);
            t->roi_hi[a] = fmax(t->roi_hi[a], uvw[a]);
        }
    }
    return OM_OK;
}

// Hide the points behind the triangle a b c.
static void hide_points(const OmRlRetract* t, const double* a, const double* b, const double* c,
                        unsigned char* hidden) {
    double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (!(fabs(area) > 1e-12)) return;  // seen from its edge
    double inverse = 1 / area;
    for (int k = 0; k < OM__RL_NROI; ++k) {
        const double* p = t->roi_uvw + 3 * k;
        double wb = ((p[0] - a[0]) * (c[1] - a[1]) - (p[1] - a[1]) * (c[0] - a[0])) * inverse;
        double wc = ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) * inverse;
        if (wb < 0 || wc < 0 || wb + wc > 1) continue;
        if (a[2] + wb * (b[2] - a[2]) + wc * (c[2] - a[2]) > p[2]) hidden[k] = 1;
    }
}

double om__rl_exposure(const OmRlRetract* t, const double* x, double* pixel) {
    unsigned char hidden[OM__RL_NROI] = {0};
    for (int i = 0; i < t->sheet.nvert; ++i) {
        int v = t->sheet_vert ? t->sheet_vert[i] : i;
        project(t->view, x + 3 * (size_t)v, pixel + 3 * (size_t)i);
    }
    for (int k = 0; k < t->sheet.ntri; ++k) {
        const int* tri = t->sheet.tri_vert + 3 * (size_t)k;
        const double *a = pixel + 3 * (size_t)tri[0], *b = pixel + 3 * (size_t)tri[1],
                     *c = pixel + 3 * (size_t)tri[2];
        if (a[0] < t->roi_lo[0] && b[0] < t->roi_lo[0] && c[0] < t->roi_lo[0]) continue;
        if (a[0] > t->roi_hi[0] && b[0] > t->roi_hi[0] && c[0] > t->roi_hi[0]) continue;
        if (a[1] < t->roi_lo[1] && b[1] < t->roi_lo[1] && c[1] < t->roi_lo[1]) continue;
        if (a[1] > t->roi_hi[1] && b[1] > t->roi_hi[1] && c[1] > t->roi_hi[1]) continue;
        if (a[2] > 0 && b[2] > 0 && c[2] > 0) hide_points(t, a, b, c, hidden);
    }
    int seen = 0;
    for (int k = 0; k < OM__RL_NROI; ++k) seen += !hidden[k];
    return (double)seen / OM__RL_NROI;
}

// ---- pictures ---------------------------------------------------------------------------------------

static OmStatus add_part(OmSenseScene* scene, const OmSurface* surface, OmSensePart part, int* id) {
    OmSenseLook look = om_sense_look(part);
    int any;
    return om_sense_scene_add(scene, surface, &look, id ? id : &any);
}

static OmStatus make_scene(const OmRlRetract* t, OmSenseScene** scene, int* sheet_id) {
    OM_TRY(om_sense_scene_create(scene));
    OM_TRY(add_part(*scene, &t->organ, OM_PART_ORGAN, NULL));
    OM_TRY(add_part(*scene, &t->tumour, OM_PART_ROI, NULL));
    OM_TRY(add_part(*scene, &t->board, OM_PART_BOARD, NULL));
    OM_TRY(add_part(*scene, &t->sheet, OM_PART_TISSUE, sheet_id));
    return add_part(*scene, &t->rail, OM_PART_HELD, NULL);
}

// The pixels of the tumour inside the circle.
static int count_pixels(const OmRlRetract* t, const OmPicture* picture) {
    OmSenseRange range = om_sense_range(OM_PART_ROI);
    int n = 0;
    for (int i = 0; i < picture->width * picture->height; ++i) {
        double hsv[3];
        if (!t->disc[i]) continue;
        om_sense_hsv(picture->pixel + 3 * (size_t)i, hsv);
        n += om_sense_range_has(&range, hsv);
    }
    return n;
}

static OmSenseOptions window_options(const OmRlRetract* t) {
    OmSenseOptions options = om_sense_options_default();
    options.nworker = 1;
    options.window = t->window;
    return options;
}

// The circle around the tumour in the picture.
static OmStatus make_window(OmRlRetract* t) {
    double center[3], xyz[3], far = 0;
    om_store3(xyz, 0, tumour_point(t, 0, 0));
    project(t->view, xyz, center);
    for (int k = 0; k < OM__RL_NROI; ++k) {
        double uvw[3];
        om_store3(xyz, 0, tumour_point(t, roi_radius(k), GOLDEN * k));
        project(t->view, xyz, uvw);
        far = fmax(far, hypot(uvw[0] - center[0], uvw[1] - center[1]));
    }
    double r = CIRCLE * far;
    int column = (int)(center[0] - r) / ALIGN * ALIGN;
    OmWindow window = {column, (int)(center[1] - r), (int)(center[0] + r) + 2 - column,
                       (int)(2 * r) + 2};
    t->window = om_window_clip(window, t->def.endoscope.width, t->def.endoscope.height);
    OM_CHECK(t->window.width > 0 && t->window.height > 0, OM_INVALID,
             "rl retract: the tumour is not in the endoscope's picture");
    t->disc = om_calloc((size_t)t->window.width * (size_t)t->window.height, 1);
    if (!t->disc) return OM_NO_MEMORY;
    for (int j = 0; j < t->window.height; ++j)
        for (int i = 0; i < t->window.width; ++i) {
            double u = t->window.column + i + 0.5, v = t->window.row + j + 0.5;
            t->disc[j * t->window.width + i] = hypot(u - center[0], v - center[1]) <= r;
        }
    return OM_OK;
}

// Count the tumour's pixels without fat and tools.
static OmStatus count_whole(OmRlRetract* t) {
    OmSenseScene* scene = NULL;
    OmPicture picture = {0};
    int sheet_id;
    OmStatus status = make_scene(t, &scene, &sheet_id);
    if (status == OM_OK) {
        om_sense_scene_show(scene, sheet_id, false);
        status = om_sense_scene_commit(scene);
    }
    if (status == OM_OK) status = om_picture_init(&picture, t->window.width, t->window.height, 3);
    if (status == OM_OK) {
        OmSenseOptions options = window_options(t);
        status = om_sense_render(scene, &t->def.endoscope, &options, &picture);
    }
    if (status == OM_OK) t->nwhole = count_pixels(t, &picture);
    om_picture_done(&picture);
    om_sense_scene_destroy(scene);
    OM_CHECK(status != OM_OK || t->nwhole > 50, OM_INVALID,
             "rl retract: the endoscope shows %d pixels of the tumour, at least 50 are needed",
             t->nwhole);
    return status;
}

OmStatus om__rl_view_init(OmRlRetract* t) {
    OM_TRY(om_camera_check(&t->def.endoscope));
    make_view(t);
    OM_TRY(make_points(t));
    OM_TRY(om_surface_from_sdf(&t->ground.sdf, 0, &t->organ));
    OM_TRY(make_tumour(t));
    OM_TRY(make_quad(&t->board, om_vec3(-0.3, -0.3, 0), om_vec3(0.3, -0.3, 0), om_vec3(0.3, 0.3, 0),
                     om_vec3(-0.3, 0.3, 0)));
    OM_TRY(make_rail(t));
    OM_TRY(make_sheet(t));
    OM_TRY(make_window(t));
    return count_whole(t);
}

void om__rl_view_done(OmRlRetract* t) {
    om_surface_done(&t->organ);
    om_surface_done(&t->tumour);
    om_surface_done(&t->board);
    om_surface_done(&t->rail);
    om_surface_done(&t->sheet);
    om_free(t->sheet_vert);
    om_free(t->disc);
}

// The texture of a tool belongs to the pose in which the tool is added: the same one in every environment, so that a
// picture does not depend on the episodes before.
static OmStatus add_tools(OmRlRetractState* s, OmSenseScene* scene) {
    static const double pose[OM_PSM_NJOINT] = {0, 0, 0.12, 0, 0, 0};
    for (int k = 0; k < s->ntool; ++k) {
        OmRlTool* tool = &s->tool[k];
        om_surface_done(&tool->surface);
        OM_TRY(om_psm_surface(tool->psm, pose, 0, &tool->surface));
        OM_TRY(add_part(scene, &tool->surface, OM_PART_TOOL, &tool->id));
    }
    return OM_OK;
}

// The scene of a state at this step.
static OmStatus update_scene(const OmRlRetract* t, OmRlRetractState* s) {
    if (!s->scene) {
        OmSenseScene* scene = NULL;
        OmStatus status = make_scene(t, &scene, &s->sheet_id);
        if (status == OM_OK) status = add_tools(s, scene);
        if (status != OM_OK) {
            om_sense_scene_destroy(scene);
            return status;
        }
        s->scene = scene;
    }
    for (int k = 0; k < s->ntool; ++k) {
        OmRlTool* tool = &s->tool[k];
        om_psm_surface_update(tool->psm, tool->q, tool->is_closed ? 0.05 : 0.5, &tool->surface);
        om_sense_scene_update(s->scene, tool->id, tool->surface.x, NULL);
    }
    om_sense_scene_update(s->scene, s->sheet_id, om_tissue_x(s->tissue), t->sheet_vert);
    return om_sense_scene_commit(s->scene);
}

static void add_noise(const OmRlRetract* t, OmRlRetractState* s, OmPicture* picture) {
    if (!(t->def.camera_noise > 0)) return;
    OmRng rng = s->now.rng;
    rng.counter[1] += 0x10000u + (uint32_t)s->now.step;  // blocks that the episode does not draw
    rng.used = 4;
    int n = picture->width * picture->height * picture->nchannel;
    for (int i = 0; i < n; ++i) {
        double v = picture->pixel[i] + t->def.camera_noise * om_rng_normal(&rng);
        picture->pixel[i] = (unsigned char)(v < 0 ? 0 : v > 255 ? 255 : v + 0.5);
    }
}

// Into a picture of any size.
static OmStatus draw(const OmRlRetract* t, OmRlRetractState* s, OmPicture* picture) {
    OM_TRY(update_scene(t, s));
    OmCamera camera = om_camera_resize(&t->def.endoscope, picture->width, picture->height);
    OmSenseOptions options = om_sense_options_default();
    options.nworker = 1;
    OM_TRY(om_sense_render(s->scene, &camera, &options, picture));
    add_noise(t, s, picture);
    return OM_OK;
}

OmStatus om__rl_render(const OmRlRetract* t, OmRlRetractState* s, OmPicture* picture) {
    OmPicture made = {0};
    bool is_sized = picture->width > 0 && picture->height > 0;
    OM_TRY(om_picture_init(&made, is_sized ? picture->width : t->def.picture_width,
                           is_sized ? picture->height : t->def.picture_height, 3));
    OmStatus status = draw(t, s, &made);
    if (status == OM_OK)
        *picture = made;
    else
        om_picture_done(&made);
    return status;
}

size_t om__rl_picture_size(const OmRlRetract* t) {
    if (!t->def.has_picture) return 0;
    return 3 * (size_t)t->def.picture_width * (size_t)t->def.picture_height;
}

OmStatus om__rl_look(const OmRlRetract* t, OmRlRetractState* s) {
    return t->def.has_picture ? draw(t, s, &s->seen) : OM_OK;
}

void om__rl_put_picture(const OmRlRetractState* s, float* obs) {
    int n = 3 * s->seen.width * s->seen.height;
    for (int i = 0; i < n; ++i) obs[i] = (float)s->seen.pixel[i] / 255;
}

OmStatus om__rl_measure(const OmRlRetract* t, OmRlRetractState* s, double* exposure) {
    OM_TRY(update_scene(t, s));
    OmPicture picture = {0};
    OM_TRY(om_picture_init(&picture, t->window.width, t->window.height, 3));
    OmSenseOptions options = window_options(t);
    OmStatus status = om_sense_render(s->scene, &t->def.endoscope, &options, &picture);
    if (status == OM_OK) {
        add_noise(t, s, &picture);
        *exposure = fmin(1, (double)count_pixels(t, &picture) / t->nwhole);
    }
    om_picture_done(&picture);
    return status;
}

void om__rl_view_drop(OmRlRetractState* s) {
    om_sense_scene_destroy(s->scene);
    for (int k = 0; k < s->ntool; ++k) om_surface_done(&s->tool[k].surface);
}
