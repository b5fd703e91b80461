// scene_site_roi.c: the region of interest of a site: a dome on the board, under the tissue.
#include <string.h>

#include "omentum/shape_meshing.h"
#include "scene/scene_site.h"

#define ROI_POINTS 200
#define ROI_HEIGHT 0.0002  // m: height of the ROI's rim above the board, larger than rounding
#define ROI_BULGE 0.0006   // m: height of its top above its rim
#define ROI_RINGS 8
#define ROI_SECTORS 32

// A flat dome on the board: points on a sunflower spiral, and triangles for drawing.
static OmStatus make_dome_roi(OmSite* site, OmVec3 center_task, double radius) {
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(site->roi_x, 3 * ROI_POINTS);
    OM_ALLOC_DONE(site->roi_n, 3 * ROI_POINTS);
    site->nroi = ROI_POINTS;
    OmPose task = site->pose_world_task;
    OmVec3 up = om_quat_rotate(task.q, om_vec3(0, 0, 1));
    for (int i = 0; i < ROI_POINTS; ++i) {
        double r = sqrt((i + 0.5) / ROI_POINTS), a = i * OM_PI * (3.0 - sqrt(5.0));
        OmVec3 p =
            om_vec3(radius * r * cos(a), radius * r * sin(a), ROI_HEIGHT + ROI_BULGE * (1 - r * r));
        om_store3(site->roi_x, i, om_pose_apply(task, om_add(center_task, p)));
        om_store3(site->roi_n, i, up);
    }
    OM_TRY_DONE(om_surface_init(&site->roi, 1 + ROI_RINGS * ROI_SECTORS,
                                ROI_SECTORS * (2 * ROI_RINGS - 1)));
    OmSurface* s = &site->roi;
    om_store3(s->x, 0,
              om_pose_apply(task, om_add(center_task, om_vec3(0, 0, ROI_HEIGHT + ROI_BULGE))));
    int t = 0;
    for (int ring = 0; ring < ROI_RINGS; ++ring) {
        double r = (ring + 1.0) / ROI_RINGS;
        for (int k = 0; k < ROI_SECTORS; ++k) {
            double a = 2 * OM_PI * k / ROI_SECTORS;
            OmVec3 p = om_vec3(radius * r * cos(a), radius * r * sin(a),
                               ROI_HEIGHT + ROI_BULGE * (1 - r * r));
            int v = 1 + ring * ROI_SECTORS + k,
                next = 1 + ring * ROI_SECTORS + (k + 1) % ROI_SECTORS;
            om_store3(s->x, v, om_pose_apply(task, om_add(center_task, p)));
            int inner = ring ? v - ROI_SECTORS : 0, inner_next = ring ? next - ROI_SECTORS : 0;
            memcpy(&s->tri_vert[3 * t++], (int[3]){inner, v, next}, 3 * sizeof(int));
            if (ring)
                memcpy(&s->tri_vert[3 * t++], (int[3]){inner, next, inner_next}, 3 * sizeof(int));
        }
    }
    site->roi_center = om_pose_apply(task, om_add(center_task, om_vec3(0, 0, ROI_HEIGHT)));
done:
    return status;
}

// A random free vertex of the underside, far enough from the border and the attachments.
static OmStatus draw_roi_center(const OmScene* scene, const OmSite* site, OmVec3* center_task) {
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    const OmMeshSet* held = om_tet_mesh_find_set(&site->mesh, "attachment");
    OmPose task = om_pose_inverse(site->pose_world_task);
    double clear = scene->roi.radius + scene->roi.margin;
    int *list, n = 0;
    OM_ALLOC(list, (size_t)under->nvert);
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_pose_apply(task, om_load3(site->mesh.x, under->vert[i]));
        if (fabs(p.x) > site->half_size.x - clear || fabs(p.y) > site->half_size.y - clear)
            continue;
        double nearest = INFINITY;
        for (int k = 0; k < held->nvert; ++k) {
            nearest = fmin(nearest, om_distance(om_load3(site->mesh.x, held->vert[k]),
                                                om_load3(site->mesh.x, under->vert[i])));
        }
        if (nearest >= clear) list[n++] = under->vert[i];
    }
    OmRng rng = om_rng_init((uint64_t)scene->seed, 2);
    OmStatus status = OM_OK;
    if (n > 0) {
        int v = list[om_rng_below(&rng, (uint32_t)n)];
        *center_task = om_pose_apply(task, om_load3(site->mesh.x, v));
        center_task->z = 0;
    } else {
        status = om_error(OM_INVALID,
                          "%s: roi: no place under the tissue is %g mm away from its border and "
                          "from every attachment; make radius_mm, margin_mm or share_max smaller",
                          om_scene_label(scene), 1e3 * clear);
    }
    om_free(list);
    return status;
}

OmStatus om__site_place_roi(const OmScene* scene, OmSite* site) {
    OmVec3 c = scene->roi.center;
    if (scene->roi.is_random) OM_TRY(draw_roi_center(scene, site, &c));
    OM_CHECK(fabs(c.x) <= site->half_size.x && fabs(c.y) <= site->half_size.y, OM_INVALID,
             "%s: roi: center_mm (%g, %g) is not under the tissue, which reaches %g and %g mm",
             om_scene_label(scene), 1e3 * c.x, 1e3 * c.y, 1e3 * site->half_size.x,
             1e3 * site->half_size.y);
    return make_dome_roi(site, c, scene->roi.radius);
}

// The triangles from which a patient model draws the points of its ROI, by their middle. Drawn by all their corners
// the ROI lacked a rim, which tissue hides last: a picture of the kidney showed 86 % of it, and the points 80 %.
static bool is_roi_triangle(const OmSite* site, double radius, int t) {
    OmVec3 middle = {0, 0, 0};
    for (int k = 0; k < 3; ++k)
        middle = om_madd(middle, 1.0 / 3, om_load3(site->organ.x, site->organ.tri_vert[3 * t + k]));
    return om_distance(middle, site->roi_center) <= radius;
}

OmStatus om__site_draw_roi(double radius, OmSite* site) {
    const OmSurface* organ = &site->organ;
    int ntri = 0;
    for (int t = 0; t < organ->ntri; ++t) ntri += is_roi_triangle(site, radius, t);
    if (ntri == 0) return OM_OK;
    double* normal;
    OM_ALLOC(normal, 3 * (size_t)organ->nvert);
    om_surface_normals(organ, normal);
    OmStatus status = om_surface_init(&site->roi, 3 * ntri, ntri);
    for (int t = 0, n = 0; status == OM_OK && t < organ->ntri; ++t) {
        if (!is_roi_triangle(site, radius, t)) continue;
        for (int k = 0; k < 3; ++k, ++n) {
            int v = organ->tri_vert[3 * t + k];
            om_store3(site->roi.x, n,
                      om_madd(om_load3(organ->x, v), ROI_HEIGHT, om_load3(normal, v)));
            site->roi.tri_vert[n] = n;
        }
    }
    om_free(normal);
    return status;
}

static OmStatus copy_doubles(const double* from, size_t n, double** to) {
    OM_ALLOC(*to, n);
    memcpy(*to, from, n * sizeof(double));
    return OM_OK;
}

OmStatus om__site_copy_roi(const OmSite* from, OmSite* to) {
    OM_TRY(copy_doubles(from->roi_x, 3 * (size_t)from->nroi, &to->roi_x));
    OM_TRY(copy_doubles(from->roi_n, 3 * (size_t)from->nroi, &to->roi_n));
    to->nroi = from->nroi;
    to->roi_center = from->roi_center;
    OM_TRY(om_surface_init(&to->roi, from->roi.nvert, from->roi.ntri));
    memcpy(to->roi.x, from->roi.x, 3 * (size_t)from->roi.nvert * sizeof(double));
    memcpy(to->roi.tri_vert, from->roi.tri_vert, 3 * (size_t)from->roi.ntri * sizeof(int));
    return OM_OK;
}
