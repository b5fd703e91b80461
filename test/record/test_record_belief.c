// test_record_belief.c: the path of the belief: shares and Dice against sets made by hand, and their JSON.
#include <string.h>

#include "loop_rig.h"
#include "record/record_internal.h"

static Rig rig;

static int open_rig(void** state) {
    (void)state;
    rig_create(&rig, object_scene());  // held from x = 10 mm on, in both
    return 0;
}

static int close_rig(void** state) {
    (void)state;
    rig_destroy(&rig);
    return 0;
}

// Attach the underside of the twin from x on.
static int attach(unsigned char* attached, double x) {
    const OmTetMesh* mesh = &rig.twin_site.mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    const OmPose to_task = om_pose_inverse(rig.twin_site.pose_world_task);
    int n = 0;
    memset(attached, 0, (size_t)mesh->nvert);
    for (int i = 0; i < under->nvert; ++i) {
        const int v = under->vert[i];
        attached[v] = om_pose_apply(to_task, om_load3(mesh->x, v)).x > x;
        n += attached[v];
    }
    return n;
}

static void points_are_shares_and_dice(void** state) {
    (void)state;
    OmRecorder* rec = om_calloc(1, sizeof *rec);
    unsigned char* attached = om_calloc((size_t)rig.twin_site.mesh.nvert, 1);
    const double nunder = om_tet_mesh_find_set(&rig.twin_site.mesh, "underside")->nvert;
    rec->def.twin = rig.twin;
    rec->def.truth = om_world_truth(rig.world);
    const int none = attach(attached, 1);
    assert_ok(om__record_belief(rec, 0, attached));
    // columns of 7 vertices, 20 mm apart: those at 20, 40 and 60 mm are held in truth
    const int truth = attach(attached, 0.01);
    assert_int_equal(truth, 21);
    assert_ok(om__record_belief(rec, 1, attached));
    assert_ok(om__record_belief(rec, 2, attached));  // the same: no point
    const int more = attach(attached, -0.03);
    assert_ok(om__record_belief(rec, 3, attached));
    const BeliefPath* p = &rec->path;
    assert_int_equal(p->n, 3);
    assert_near(p->true_share, truth / nunder, 1e-12);
    const int held[3] = {none, truth, more};
    const double time[3] = {0, 1, 3};
    for (int k = 0; k < 3; ++k) {
        const int both = held[k] < truth ? held[k] : truth;
        assert_near(p->point[k].time, time[k], 0);
        assert_near(p->point[k].share, held[k] / nunder, 1e-12);
        assert_near(p->point[k].dice, 2.0 * both / (held[k] + truth), 1e-12);
    }
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om__record_belief_json(rec, &json);
    om_json_close(&json, '}');
    assert_non_null(strstr(text.str, "\"dice\": 1"));
    assert_non_null(strstr(text.str, "true_attached_share"));
    om_text_done(&text);
    om__record_belief_done(&rec->path);
    // without a truth there is no Dice
    rec->def.truth = NULL;
    assert_ok(om__record_belief(rec, 0, attached));
    assert_true(rec->path.n == 1 && isnan(rec->path.point[0].dice));
    om__record_belief_done(&rec->path);
    om_free(attached);
    om_free(rec);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(points_are_shares_and_dice)};
    return cmocka_run_group_tests(tests, open_rig, close_rig);
}
