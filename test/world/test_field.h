// test_field.h: a small simulated operating field, shared by the tests of room world.
#ifndef OMENTUM_TEST_FIELD_H
#define OMENTUM_TEST_FIELD_H

#include "test_common.h"

#include "linear_sheet.h"
#include "omentum/world.h"

static inline OmScene small_scene(void) {
    OmScene s = linear_sheet();
    s.tissue.cells = om_vec3(12, 12, 1);
    s.tissue.world_cells = om_vec3(18, 18, 2);
    s.endoscope.width = 160, s.endoscope.height = 120;
    s.rgbd.width = 160, s.rgbd.height = 120;
    return s;
}

// Held on the far half: the near corners are free.
static inline OmScene half_held(void) {
    OmScene s = small_scene();
    s.attach.kind = OM_ATTACH_BOX;
    s.attach.lo = om_vec3(0.0, -1, -1);
    s.attach.hi = om_vec3(1, 1, 1);
    s.roi.is_random = false;
    s.roi.center = om_vec3(-0.03, -0.02, 0);
    s.world.tool_noise = 0;
    return s;
}

typedef struct Field {
    OmScene scene;
    OmSite site;
    OmWorld* world;
} Field;

static inline void setup(Field* f, OmScene scene) {
    f->scene = scene;
    assert_ok(om_site_build(&f->scene, OM_SITE_WORLD, NULL, &f->site));
    assert_ok(om_world_create_simulated(&f->scene, &f->site, 1, &f->world));
}
static inline void teardown(Field* f) {
    om_world_destroy(f->world);
    om_site_done(&f->site);
}
static inline OmObservation observe(Field* f, unsigned what) {
    OmObservation obs = {0};
    assert_ok(om_world_observe(f->world, what, &obs));
    return obs;
}
static inline bool is_holding(Field* f, int arm) {
    OmObservation obs = observe(f, 0);
    return om_arm_is_holding(&obs.arm[arm]);
}
// A goal that keeps the arm's orientation.
static inline OmPose goal_of(Field* f, int arm, OmVec3 p_world) {
    return (OmPose){p_world, observe(f, 0).arm[arm].tip.q};
}
static inline OmPose to_world(Field* f, int arm, OmVec3 p_task) {
    return goal_of(f, arm, om_pose_apply(f->site.pose_world_task, p_task));
}

static inline void grasp_at(Field* f, int arm, OmVec3 p_task) {
    assert_ok(om_world_move(f->world, arm, to_world(f, arm, p_task), 0.1));
    for (int i = 0; i < 200 && observe(f, 0).arm[arm].is_moving; ++i)
        assert_ok(om_world_advance(f->world, 0.02));
    assert_ok(om_world_set_jaw(f->world, arm, 0));
    for (int i = 0; i < 15; ++i) assert_ok(om_world_advance(f->world, 0.02));
}

static inline uint64_t hash_color(const OmPicture* p, uint64_t h) {
    size_t n = (size_t)p->width * (size_t)p->height * (size_t)p->nchannel;
    return n ? om_hash(p->pixel, n, h) : h;
}
/// Hash of all that cameras gave.
static inline uint64_t hash_pictures(const OmObservation* obs, uint64_t h) {
    const OmDepthPicture* d = &obs->rgbd;
    size_t n = (size_t)d->camera.width * (size_t)d->camera.height;
    h = om_hash(&obs->visibility, sizeof obs->visibility, h);
    h = hash_color(&obs->endoscope.color, h);
    h = hash_color(&d->color, h);
    return d->depth ? om_hash(d->depth, n * sizeof *d->depth, h) : h;
}

#endif
