// test_contact_face.c: contact of faces: a box with sharp edges slides over faces larger than its edges.
#include "test_slide.h"

// An edge sharper than the faces: points alone snap past it, faces do not. 14 % of the force up with points 2 mm apart.
static void test_edge(void** test) {
    (void)test;
    const Slide coarse = {.name = "box, edges of 1 mm, 3 mm deep, faces of 12 mm",
                          .shape = OM_PROBE_BOX,
                          .method = OM_PRESS_PENALTY,
                          .depth = 0.003,
                          .h = 0.02,
                          .max_newton = 1,
                          .has_faces = true,
                          .cells = {10, 8, 4}};
    Slide table[3] = {coarse, coarse, coarse};
    table[1].name = "the same, faces of 7.5 mm";
    table[1].cells[0] = 0;
    table[2] = table[1];
    table[2].name = "the same, steps of 0.5 s";
    table[2].h = 0.5;
    for (int k = 0; k < test_count(1, 3); ++k) {
        Slid out = run(&table[k]);
        assert_below(fabs(out.aside[0] - out.aside[1]), 0.01);
        assert_below(fabs(out.held[0] - out.held[1]), 0.01);
        assert_below(out.nsolve, 30);
        assert_below(out.nsubstep, 3);
    }
}

// Contact of faces keeps nothing between steps but the state: another press continues a restored state with the same
// bytes. Quadratic elements: each face is four triangles.
static void test_restored(void** test) {
    (void)test;
    PressRig p;
    make_block(&p, 6, 5, 3);
    p.r.def.element = OM_ELEMENT_QUADRATIC;
    rig_start(&p.r);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_BOX);
    assert_ok(om_probe_create(&shape, &p.probe));
    OmPressDef def = om_press_default_def(p.probe);
    def.has_face_contact = true;
    size_t size = om_tissue_state_size(p.r.m);
    void* before = om_alloc(size, 1);
    OmPose pose = {om_vec3(0.0525, 0.05, 0.05), om_quat_identity()};
    assert_ok(om_press_create(&def, p.r.m, &p.press));
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    OmPressReport r = {0};
    for (int k = 0; k < 4; ++k) r = go(&p, pose.p.x, pose.p.z -= 0.0005, 0.02);
    int nsliding = 0;
    for (int k = 0; k < r.ncontact; ++k) nsliding += r.vert[k] == -1;
    assert_true(nsliding > 4);
    assert_below(r.penetration, 5e-5);
    memcpy(before, p.r.s, size);
    uint64_t hash[2];
    for (int again = 0; again < 2; ++again) {
        for (int k = 1; k <= 3; ++k) go(&p, pose.p.x + 0.001 * k, pose.p.z, 0.02);
        hash[again] = om_tissue_state_hash(p.r.s);
        if (again) break;
        om_press_destroy(p.press);
        assert_ok(om_press_create(&def, p.r.m, &p.press));
        memcpy(p.r.s, before, size);
        assert_ok(om_press_place(p.press, p.r.m, p.r.s, pose));
    }
    assert_true(hash[0] == hash[1]);
    om_free(before);
    done(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_edge),
                                       cmocka_unit_test(test_restored)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
