// scan_truth.h: what the depth camera of a simulated world truly sees: the object of every pixel, and the true surface.
#ifndef OMENTUM_SCAN_TRUTH_H
#define OMENTUM_SCAN_TRUTH_H

#include "world/test_field.h"
#include "world/world_view.h"

#include "omentum/world_cloud.h"

#include <time.h>

typedef struct Truth {
    OmSurface tissue;  // deformed
    int npixel;
    int* id;  // 0: tissue, -1: nothing in range, others: anatomy and tools (npixel)
    int first_tool;
} Truth;

static inline Truth truth_init(Field* f, const OmCamera* camera) {
    Truth t = {.npixel = camera->width * camera->height};
    int* vert;
    assert_ok(om_tet_mesh_boundary(&f->site.mesh, &t.tissue, &vert));
    const double* x = om_body_x(om_world_truth(f->world));
    for (int i = 0; i < t.tissue.nvert; ++i) om_store3(t.tissue.x, i, om_load3(x, vert[i]));
    om_free(vert);
    OmSenseScene* scene;
    int id;
    assert_ok(om_sense_scene_create(&scene));
    OmSenseLook look = om_sense_look(OM_PART_TISSUE);
    assert_ok(om_sense_scene_add(scene, &t.tissue, &look, &id));
    assert_int_equal(id, 0);
    OmAnatomyIds ids;
    assert_ok(om__world_add_anatomy(&f->site, scene, &ids));
    for (int a = 0; a < om_world_narm(f->world); ++a)
        assert_ok(om_sense_scene_add(scene, om_world_tool(f->world, a), &look, &id));
    t.first_tool = id + 1 - om_world_narm(f->world);
    assert_ok(om_sense_scene_commit(scene));
    float* depth = malloc((size_t)t.npixel * sizeof *depth);
    t.id = malloc((size_t)t.npixel * sizeof *t.id);
    assert_non_null(depth);
    assert_non_null(t.id);
    assert_ok(om_sense_depth(scene, camera, 1, depth, t.id, NULL));
    om_sense_scene_destroy(scene);
    free(depth);
    return t;
}

static inline void truth_done(Truth* t) {
    om_surface_done(&t->tissue);
    free(t->id);
}

// Distance of p to the triangle a, b, c: to its inside, or to one of its sides.
static inline double triangle_distance(OmVec3 p, OmVec3 a, OmVec3 b, OmVec3 c) {
    const OmVec3 corner[4] = {a, b, c, a};
    OmVec3 n = om_normalize(om_cross(om_sub(b, a), om_sub(c, a)));
    double best = 1e9;
    bool is_over = true;
    for (int k = 0; k < 3; ++k) {
        OmVec3 side = om_sub(corner[k + 1], corner[k]), from = om_sub(p, corner[k]);
        double t = fmax(0, fmin(1, om_dot(from, side) / om_norm2(side)));
        best = fmin(best, om_norm(om_madd(from, -t, side)));
        is_over &= om_dot(om_cross(n, side), from) >= 0;
    }
    return is_over ? fabs(om_dot(n, om_sub(p, a))) : best;
}

static inline double surface_distance(const OmSurface* s, OmVec3 p) {
    double best = 1e9;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s->x, v[0]);
        if (om_distance(a, p) - 0.03 > best) continue;  // sides of true triangles are shorter
        best = fmin(best, triangle_distance(p, a, om_load3(s->x, v[1]), om_load3(s->x, v[2])));
    }
    return best;
}

typedef struct ScanQuality {
    double found;                      // share of the tissue's pixels with depth
    double claimed;                    // share of the pixels called tissue that are not
    double tool;                       // share of the tools\' pixels called tool
    double median, p90, worst;         // m, of points to the true surface
    double normal_median, normal_p90;  // rad, of normals to those of the true surface
    double spacing;                    // m, mean side of the scan's triangles
} ScanQuality;

// Angle between the scan's normal and that of the nearest true triangle.
static inline double normal_error(const OmSurface* s, OmVec3 p, OmVec3 n) {
    double best = 1e9, angle = 0;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
        if (om_distance(a, p) - 0.03 > best) continue;
        double d = triangle_distance(p, a, b, c);
        if (d >= best) continue;
        best = d;
        OmVec3 m = om_normalize(om_cross(om_sub(b, a), om_sub(c, a)));
        angle = acos(fmax(-1, fmin(1, om_dot(n, m))));
    }
    return angle;
}

static inline ScanQuality scan_quality(const Truth* t, const OmObservation* obs,
                                       const OmScan* scan) {
    int ntrue = 0, nfound = 0, nclaimed = 0, nfalse = 0, ntool = 0, ntool_found = 0;
    for (int i = 0; i < t->npixel; ++i) {
        bool is_true = t->id[i] == 0, is_said = scan->pixel[i] == OM_SCAN_TISSUE;
        if (!(obs->rgbd.depth[i] > 0)) continue;
        ntrue += is_true, nfound += is_true && is_said;
        nclaimed += is_said, nfalse += is_said && !is_true;
        bool is_tool = t->id[i] >= t->first_tool;
        ntool += is_tool, ntool_found += is_tool && scan->pixel[i] == OM_SCAN_TOOL;
    }
    ScanQuality q = {.found = (double)nfound / ntrue,
                     .claimed = (double)nfalse / fmax(1, nclaimed),
                     .tool = ntool_found / fmax(1, ntool)};
    double* d = malloc((size_t)scan->npoint * sizeof *d);
    double* a = malloc((size_t)scan->npoint * sizeof *a);
    assert_true(d && a && scan->npoint > 0);
    for (int i = 0; i < scan->npoint; ++i) {
        OmVec3 p = om_load3(scan->x, i), n = om_load3(scan->normal, i);
        d[i] = surface_distance(&t->tissue, p);
        a[i] = normal_error(&t->tissue, p, n);
    }
    om_sort_doubles(d, scan->npoint);
    om_sort_doubles(a, scan->npoint);
    q.median = d[scan->npoint / 2], q.p90 = d[scan->npoint * 9 / 10], q.worst = d[scan->npoint - 1];
    q.normal_median = a[scan->npoint / 2], q.normal_p90 = a[scan->npoint * 9 / 10];
    for (int k = 0; k < 3 * scan->ntri; ++k) {
        int other = k % 3 == 2 ? k - 2 : k + 1;
        q.spacing += om_distance(om_load3(scan->x, scan->tri_vert[k]),
                                 om_load3(scan->x, scan->tri_vert[other])) /
                     (3 * scan->ntri);
    }
    free(d);
    free(a);
    return q;
}

static inline double cpu_ms(void) { return 1e3 * (double)clock() / CLOCKS_PER_SEC; }

/// Make a scan of a view, print its quality and time, and hold it to bounds that are the same for every view.
static inline ScanQuality check_view(Field* f, const OmScanDef* def, const OmSite* site,
                                     unsigned what, const char* name) {
    const OmCloudDef space = om_cloud_default_def(f->world, site);
    OmObservation obs = observe(f, what);
    OmScan scan;
    double best = 1e9;
    for (int k = 0; k < 5; ++k) {
        double start = cpu_ms();
        assert_ok(om_scan_from_observation(def, &space, &obs, &scan));
        best = fmin(best, cpu_ms() - start);
        if (k < 4) om_scan_done(&scan);
    }
    assert_ok(om_scan_check(&scan));
    Truth truth = truth_init(f, &obs.rgbd.camera);
    ScanQuality q = scan_quality(&truth, &obs, &scan);
    print_message(
        "%s: %d x %d pixels, found %.4f, false %.5f, tools %.4f, %d points %.2f mm apart (%.2f mm wanted), %d "
        "triangles; to the surface %.3f / %.3f / %.3f mm (median, 90 %%, worst; noise %.3f); normals %.1f "
        "/ %.1f degrees; %.2f ms\n",
        name, obs.rgbd.camera.width, obs.rgbd.camera.height, q.found, q.claimed, q.tool,
        scan.npoint, 1e3 * q.spacing, 1e3 * def->spacing, scan.ntri, 1e3 * q.median, 1e3 * q.p90,
        1e3 * q.worst, 1e3 * scan.noise, q.normal_median * 180 / OM_PI, q.normal_p90 * 180 / OM_PI,
        best);
    // Bounds for every view: 0.34 mm of noise along a ray, averaged; at the border of the tissue pixels are lost.
    assert_true(q.found > 0.95);
    assert_below(q.claimed, 0.005);
    assert_true(q.tool > 0.97);  // also where the tool is outside the reach of the tissue
    assert_below(q.median, 1.2e-4);
    assert_below(q.p90, 3e-4);
    assert_below(q.worst, 0.002);
    assert_below(q.normal_median, 4 * OM_PI / 180);  // true triangles are flat
    assert_near_rel(q.spacing, def->spacing, 0.05);
    assert_true(scan.noise > 0.5 * q.median && scan.noise < 4 * q.median);
    // Two triangles a point, less those of the border: none is missing inside.
    assert_true(scan.ntri > 1.5 * scan.npoint);
    truth_done(&truth);
    om_scan_done(&scan);
    om_observation_done(&obs);
    return q;
}

#endif
