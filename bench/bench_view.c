// bench_view.c: one live frame of a sheet whose surface has 9,900 vertices, all of them in motion, with the stress of
// one frame in six. The goal of issue 39: 30 frames a second in 10 % of a core, 3.3 ms, and below 4 MB/s: the column of
// bytes is of a vertex and frame, and 30 frames of 9,900 vertices with 13 bytes are 4 MB/s.
#include "bench.h"

#include <string.h>

#include "omentum/view.h"

enum { NFRAME = 60, MAX_RUN = 64 };

// `NFRAME` frames of tissue that is pulled up; the time is of the frames alone.
static OmStatus time_frames(OmBody* body, const OmScene* scene, double* time, BenchRow* row) {
    OmView3dDef def = om_view3d_default_def(scene, body);
    OmView3d* view = NULL;
    OmText text = {0};
    OmBodyReport report;
    int nheld;
    const OmPose place = om_body_site(body)->pose_world_task;
    OmPose tip = om_pose_mul(place, (OmPose){om_vec3(-0.055, -0.055, 0.005), om_pose_identity().q});
    def.is_live = true;
    OmStatus status = OM_OK;
    om_body_reset(body);
    OM_TRY_DONE(om_view3d_create(&def, &view));
    OM_TRY_DONE(om_view3d_add_scene(view, &text));
    OM_TRY_DONE(om_body_grasp(body, 0, tip, 0.01, &nheld));
    size_t bytes = 0;
    *time = 0;
    for (int k = 0; k < NFRAME; ++k) {
        const OmViewNow now = {.time = 0.02 * k};
        tip.p = om_add(tip.p, om_quat_rotate(place.q, om_vec3(0, 0, 5e-4)));
        OM_TRY_DONE(om_body_move(body, 0, tip));
        status = om_body_step(body, 0.02, &report);
        if (status < 0) goto done;
        text.len = 0;
        const double start = bench_now();
        OM_TRY_DONE(om_view3d_add_frame(view, &now, &text));
        *time += (bench_now() - start) / NFRAME;
        bytes += text.len;
    }
    row->hash = om_hash(text.str, text.len, OM_HASH_SEED);
    row->bytes_per_element = (double)bytes / NFRAME / (double)row->size;
    status = OM_OK;
done:
    om_view3d_destroy(view);
    om_text_done(&text);
    return status;
}

OmStatus bench_view(const BenchOptions* options) {
    OmScene scene = om_scene_default();
    OmSite site = {0};
    OmBody* body = NULL;
    OmSurface surface = {0};
    double time[MAX_RUN];
    OmStatus status = OM_OK;
    BenchRow row = {.bench = "view",
                    .scene = "sheet",
                    .work = "live frame",
                    .nworker = 1,
                    .steps = NFRAME,
                    .goal_ms = 3.3};
    row.nrun = options->nrun < 1 ? 1 : options->nrun > MAX_RUN ? MAX_RUN : options->nrun;
    scene.tissue.cells = om_vec3(34, 34, 1);
    OM_TRY_DONE(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    OM_TRY_DONE(om_body_create(&scene, &site, options->nworker, &body));
    OM_TRY_DONE(om_tet_mesh_boundary(om_body_mesh(body), &surface, NULL));
    row.size = surface.nvert;
    for (int run = 0; run < row.nrun; ++run)
        OM_TRY_DONE(time_frames(body, &scene, &time[run], &row));
    bench_times(time, row.nrun, &row);
    status = bench_print(&row);
done:
    om_surface_done(&surface);
    om_body_destroy(body);
    om_site_done(&site);
    return status;
}
