// test_retract_register.c: the model is moved onto the tissue that the depth camera sees at rest.
#include <string.h>

#include "test_alloc.h"

#include "easy_scene.h"

#include "omentum/world.h"
#include "retract/retract_register.h"

typedef struct Rig {
    OmScene scene;
    OmSite twin, truth;
    OmWorld* world;
    OmMatchVerdict verdict;
} Rig;

static void begin(Rig* r, OmVec3 turn, OmVec3 shift) {
    memset(r, 0, sizeof *r);
    r->scene = easy_scene();
    r->scene.update.is_enabled = true;
    r->scene.registration.turn = turn;
    r->scene.registration.shift = shift;
    r->scene.rgbd.width = 160, r->scene.rgbd.height = 120;
    assert_ok(om_site_build(&r->scene, OM_SITE_TWIN, NULL, &r->twin));
    assert_ok(om_site_build(&r->scene, OM_SITE_WORLD, NULL, &r->truth));
    assert_ok(om_world_create_simulated(&r->scene, &r->truth, 1, &r->world));
    assert_true(om_world_reset(r->world) >= 0);
}

static void end(Rig* r) {
    om_world_destroy(r->world);
    om_site_done(&r->twin);
    om_site_done(&r->truth);
}

// Largest height of the twin's corners over or under the true board, m.
static double find_gap(const Rig* r) {
    const OmPose pose_truth_world = om_pose_inverse(r->truth.pose_world_task);
    double most = 0;
    for (int k = 0; k < 4; ++k) {
        const OmVec3 corner = om_vec3((k & 1 ? 1 : -1) * r->twin.half_size.x,
                                      (k & 2 ? 1 : -1) * r->twin.half_size.y, 0);
        const OmVec3 p = om_pose_apply(r->twin.pose_world_task, corner);
        most = fmax(most, fabs(om_pose_apply(pose_truth_world, p).z));
    }
    return most;
}

static uint64_t hash_of(const OmSite* site) {
    return om_hash(site->mesh.x, 3 * (size_t)site->mesh.nvert * sizeof(double), OM_HASH_SEED);
}

// A board that is tilted by 1.7 degrees and lifted by 1 mm: afterwards the twin's corners lie on the true one. All of
// the site has moved with it.
static void test_a_tilted_model_is_moved(void** state) {
    (void)state;
    Rig r;
    begin(&r, om_vec3(0.025, -0.016, 0), om_vec3(0, 0, 0.001));
    const double before = find_gap(&r);
    const OmPose inverse = om_pose_inverse(r.twin.pose_world_task);
    const OmVec3 roi = om_pose_apply(inverse, r.twin.roi_center),
                 down = om_quat_rotate(inverse.q, r.twin.gravity),
                 vert = om_pose_apply(inverse, om_load3(r.twin.mesh.x, 7));
    assert_ok(om__retract_register(&r.scene, r.world, &r.twin, &r.verdict));
    const double after = find_gap(&r);
    printf("corners of the twin's board: %.2f mm from the true one, then %.2f mm; turned by %.2f "
           "degrees: %s\n",
           1e3 * before, 1e3 * after, 180 / OM_PI * r.verdict.turn, r.verdict.reason);
    assert_true(r.verdict.is_moved && before > 1.5e-3);
    assert_below(after, 0.25e-3);
    assert_near(180 / OM_PI * r.verdict.turn, 180 / OM_PI * sqrt(0.025 * 0.025 + 0.016 * 0.016),
                0.2);
    const OmPose now = om_pose_inverse(r.twin.pose_world_task);
    assert_below(om_distance(om_pose_apply(now, r.twin.roi_center), roi), 1e-12);
    assert_below(om_distance(om_quat_rotate(now.q, r.twin.gravity), down), 1e-12);
    assert_below(om_distance(om_pose_apply(now, om_load3(r.twin.mesh.x, 7)), vert), 1e-12);
    end(&r);
}

// A model that is right stays, and so does one that is far off, one that does not learn, and one of which the scene
// says so.
static void test_what_stays(void** state) {
    (void)state;
    for (int k = 0; k < 4; ++k) {
        Rig r;
        begin(&r, om_vec3(k == 0 ? 0 : k == 1 ? 0.2 : 0.025, 0, 0), om_vec3(0, 0, 0));
        if (k == 2) r.scene.update.is_enabled = false;
        if (k == 3) r.scene.update.registers = false;
        const uint64_t was = hash_of(&r.twin);
        assert_ok(om__retract_register(&r.scene, r.world, &r.twin, &r.verdict));
        assert_true(hash_of(&r.twin) == was && !r.verdict.is_moved);
        assert_true(k > 1 || r.verdict.is_good == (k == 0));
        assert_true((k == 1) == (r.verdict.reason[0] != '\0'));
        end(&r);
    }
}

static OmStatus again(void* ctx) {
    Rig* r = ctx;
    return om__retract_register(&r->scene, r->world, &r->twin, &r->verdict);
}

static void test_memory(void** state) {
    (void)state;
    Rig r;
    begin(&r, om_vec3(0.025, 0, 0), om_vec3(0, 0, 0));
    assert_true(test_failing_allocations(again, &r, test_stride(10)) >= 3);
    end(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_tilted_model_is_moved),
        cmocka_unit_test(test_what_stays),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
