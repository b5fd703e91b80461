// study_retraction_picture.c: the tissue from above, as Fig. 6.3: attachments, ROI and grasping points.
//
// A pixel has the attachments of the nearest vertex of the underside. True attachments are blue where the tissue has
// fewer than believed, green elsewhere; a red line surrounds the believed ones; the ROI is a magenta disc; grey lines
// are the blocks; a ring marks the block that was grasped first, a dot the last one.
#include <math.h>
#include <string.h>

#include "omentum/vec.h"
#include "studies/study_retraction_internal.h"

#define SIZE 300    // pixels along each side
#define OUTLINE 2   // pixels
#define GRASP_PX 9  // radius of a mark

typedef struct Map {
    unsigned char *truth, *believed;  // nonzero where attached       (SIZE x SIZE)
    double half_x, half_y;            // m
} Map;

// Attached pixels of a scene's twin.
static OmStatus find_attached(const OmScene* scene, unsigned char* out, Map* map) {
    OmSite site = {0};
    double *x = NULL, *y = NULL;
    unsigned char* is_held = NULL;
    OM_TRY(om_site_build(scene, OM_SITE_TWIN, NULL, &site));
    OmStatus status = OM_OK;
    const OmMeshSet *under = om_tet_mesh_find_set(&site.mesh, "underside"),
                    *held = om_tet_mesh_find_set(&site.mesh, "attachment");
    const OmPose task = om_pose_inverse(site.pose_world_task);
    map->half_x = site.half_size.x;
    map->half_y = site.half_size.y;
    OM_CALLOC_DONE(is_held, (size_t)site.mesh.nvert);
    OM_ALLOC_DONE(x, (size_t)under->nvert);
    OM_ALLOC_DONE(y, (size_t)under->nvert);
    for (int i = 0; held && i < held->nvert; ++i) is_held[held->vert[i]] = 1;
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_pose_apply(task, om_load3(site.mesh.x, under->vert[i]));
        x[i] = p.x;
        y[i] = p.y;
    }
    for (int k = 0; k < SIZE * SIZE; ++k) {
        const double px = ((k % SIZE + 0.5) / SIZE * 2 - 1) * map->half_x;
        const double py = (1 - (k / SIZE + 0.5) / SIZE * 2) * map->half_y;
        int nearest = 0;
        double best = HUGE_VAL;
        for (int i = 0; i < under->nvert; ++i) {
            const double d = (x[i] - px) * (x[i] - px) + (y[i] - py) * (y[i] - py);
            if (d >= best) continue;
            best = d;
            nearest = i;
        }
        out[k] = is_held[under->vert[nearest]];
    }
done:
    om_free(x);
    om_free(y);
    om_free(is_held);
    om_site_done(&site);
    return status;
}

static bool is_outline(const unsigned char* mask, int px, int py) {
    for (int dy = -OUTLINE; dy <= OUTLINE; ++dy)
        for (int dx = -OUTLINE; dx <= OUTLINE; ++dx) {
            const int x = px + dx, y = py + dy;
            const bool is_in = x >= 0 && y >= 0 && x < SIZE && y < SIZE && mask[y * SIZE + x];
            if (mask[py * SIZE + px] && !is_in) return true;
        }
    return false;
}

// Distance from a block's centre, pixels.
static double from_block(int block, int grid, int px, int py) {
    const double cell = (double)SIZE / grid;
    return hypot(px + 0.5 - (block % grid + 0.5) * cell,
                 SIZE - py - 0.5 - (block / grid + 0.5) * cell);
}

static bool is_grasp(const RetractionRun* run, int grid, int px, int py) {
    if (!run || run->ngrasp == 0) return false;
    const double first = from_block(run->grasp[0], grid, px, py);
    return fabs(first - GRASP_PX) < 1.5 ||
           from_block(run->grasp[run->ngrasp - 1], grid, px, py) < 0.5 * GRASP_PX;
}

OmStatus om__retraction_draw(const RetractionCase* c, const RetractionRun* run,
                             OmPicture* picture) {
    static const unsigned char tissue[3] = {240, 222, 196}, fewer[3] = {86, 140, 214},
                               other[3] = {96, 178, 110}, red[3] = {205, 38, 38},
                               magenta[3] = {214, 51, 190}, grid[3] = {190, 176, 158},
                               black[3] = {20, 20, 20};
    Map map = {0};
    OmScene scene;
    OmStatus status;
    *picture = (OmPicture){0};
    OM_ALLOC_DONE(map.truth, SIZE * SIZE);
    OM_ALLOC_DONE(map.believed, SIZE * SIZE);
    OM_TRY_DONE(om__retraction_scene(c, RETRACTION_BELIEVED, &scene));
    OM_TRY_DONE(find_attached(&scene, map.believed, &map));
    const int n = scene.task.grid;
    OM_TRY_DONE(om__retraction_scene(c, RETRACTION_TRUE, &scene));
    OM_TRY_DONE(find_attached(&scene, map.truth, &map));
    OM_TRY_DONE(om_picture_init(picture, SIZE, SIZE, 3));
    for (int k = 0; k < SIZE * SIZE; ++k) {
        const int px = k % SIZE, py = k / SIZE;
        const double x = ((px + 0.5) / SIZE * 2 - 1) * map.half_x - scene.roi.center.x;
        const double y = (1 - (py + 0.5) / SIZE * 2) * map.half_y - scene.roi.center.y;
        const unsigned char* color = tissue;
        if (px * n % SIZE < n || py * n % SIZE < n) color = grid;
        if (map.truth[k]) color = c->kind == RETRACTION_FEWER ? fewer : other;
        if (is_outline(map.believed, px, py)) color = red;
        if (c->group != RETRACTION_KIDNEY && hypot(x, y) < scene.roi.radius) color = magenta;
        if (is_grasp(run, n, px, py)) color = black;
        memcpy(picture->pixel + 3 * (size_t)k, color, 3);
    }
done:
    om_free(map.truth);
    om_free(map.believed);
    if (status < 0) om_picture_done(picture);
    return status;
}
