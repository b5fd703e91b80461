// dds_eyes.c: pictures of the simulated robot, and the stream for programs that watch.
#include "dds/dds_robot.h"

// ---- pictures -----------------------------------------------------------------------------------------------------

static LinkMessage picture_message(const OmDdsRobot* r, const char* frame) {
    LinkMessage m = {.time = r->stamp_origin + r->seen.time};
    snprintf(m.frame, sizeof m.frame, "%s", frame);
    return m;
}

static OmStatus send_cloud(OmDdsRobot* r, const OmDepthPicture* p) {
    LinkMessage m = picture_message(r, r->depth.frame);
    m.picture = om__cloud_pack(&r->points, p);
    return om__link_write(r->link, r->depth.cloud, &m);
}

static OmStatus send_image(OmDdsRobot* r, const Eye* eye, int width, int height,
                           const char* encoding, int nbyte, const void* data) {
    LinkMessage m = picture_message(r, eye->frame);
    m.picture = (LinkPicture){.width = width,
                              .height = height,
                              .step = nbyte * width,
                              .data = data,
                              .size = (size_t)nbyte * (size_t)width * (size_t)height};
    snprintf(m.picture.encoding, sizeof m.picture.encoding, "%s", encoding);
    return om__link_write(r->link, eye->image, &m);
}

// Render and send OM_OBSERVE_ flags `what` of a world at rest between two steps. Also called by the job, which shares
// nothing but constants, the link, and the fields of pictures with the other thread.
static OmStatus take_pictures(OmDdsRobot* r, OmWorld* world, unsigned what) {
    const double start = om_clock_now();
    what &= om_world_sources(world) & (OM_OBSERVE_IMAGE | OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR);
    r->taken = 0;
    if (!what) return OM_OK;
    OM_TRY(om_world_observe(world, what, &r->seen));
    const OmPicture* color = &r->seen.endoscope.color;
    const OmDepthPicture* depth = &r->seen.rgbd;
    if (color->pixel)
        OM_TRY(send_image(r, &r->endoscope, color->width, color->height,
                          color->nchannel == 3 ? "rgb8" : "mono8", color->nchannel, color->pixel));
    if (depth->depth && om__link_is_wanted(r->link, r->depth.image))
        OM_TRY(send_image(r, &r->depth, depth->camera.width, depth->camera.height, "32FC1", 4,
                          depth->depth));
    if (depth->depth) OM_TRY(send_cloud(r, depth));
    r->taken = om_clock_now() - start;
    return OM_OK;
}

static void count_pictures(OmDdsRobot* r) {
    r->report.npicture += r->taken > 0;
    r->render += r->taken;
}

OmStatus om__robot_publish_pictures(OmDdsRobot* r, unsigned what) {
    OM_TRY(take_pictures(r, r->def.world, what));
    count_pictures(r);
    return OM_OK;
}

static OmStatus look(void* ctx, const OmProgress* progress) {
    OmDdsRobot* r = ctx;
    (void)progress;
    om__robot_yield(r);
    OM_TRY(om_world_restore(r->def.eyes, r->snapshot));
    OM_TRY(om_world_set_arms(r->def.eyes, r->look_pose));
    return take_pictures(r, r->def.eyes, r->wanted);
}

// The job ends before the next one begins.
OmStatus om__robot_end_look(OmDdsRobot* r) {
    if (!r->job) return OM_OK;
    const OmStatus status = om_job_join(r->job);
    r->job = NULL;
    count_pictures(r);
    return status;
}

OmStatus om__robot_begin_look(OmDdsRobot* r, unsigned what) {
    OM_TRY(om__robot_end_look(r));
    if (!what) return OM_OK;
    OM_TRY(om_world_save(r->arms, r->look_pose));
    if (!r->def.eyes) {
        OM_TRY(om__robot_end_step(r));
        OM_TRY(om_world_set_arms(r->def.world, r->look_pose));
        return om__robot_publish_pictures(r, what);
    }
    if (r->is_fresh) {
        void* last = r->snapshot;
        r->snapshot = r->fresh;
        r->fresh = last;
        r->is_fresh = false;
    }
    r->wanted = what;
    return om_job_start(look, r, &r->job);
}

// What the readers of pictures want.
unsigned om__robot_wanted_pictures(const OmDdsRobot* r) {
    unsigned what = 0;
    if (om__link_is_wanted(r->link, r->endoscope.image)) what |= OM_OBSERVE_IMAGE;
    if (om__link_is_wanted(r->link, r->depth.image)) what |= OM_OBSERVE_DEPTH;
    if (om__link_is_wanted(r->link, r->depth.cloud)) what |= OM_OBSERVE_DEPTH | OM_OBSERVE_COLOR;
    return what;
}

// ---- OpenIGTLink --------------------------------------------------------------------------------------------------

OmStatus om__robot_show(OmDdsRobot* r) {
    OmWatchTool tool[OM_MAX_ARM + 1];
    if (!r->watch || !om_watch_is_due(r->watch)) return OM_OK;
    for (int a = 0; a < r->narm; ++a) tool[a] = (OmWatchTool){r->hand[a].name, r->obs.arm[a].tip};
    tool[r->narm] = (OmWatchTool){r->ecm.name, r->endoscope.camera.pose_world_camera};
    return om_watch_send(r->watch, om__robot_stamp(r), tool, r->narm + 1,
                         r->x ? r->x : om_body_x(om_world_truth(r->def.world)));
}
