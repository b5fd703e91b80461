// test_scene_attach.c: attachments of a sheet of 12 x 12 squares of 10 mm, counted by hand.
#include "test_common.h"

#include "linear_sheet.h"
#include "omentum/scene.h"

// Held where x is below -5 mm: the columns at -60, -50, ..., -10 mm, of 13 vertices each.
static OmScene half_sheet(void) {
    OmScene scene = linear_sheet();
    scene.tissue.cells = om_vec3(12, 12, 1);
    scene.attach = (OmSceneAttach){
        .kind = OM_ATTACH_BOX, .lo = {-1, -1, -1}, .hi = {-0.005, 1, 1}, .share_max = 0.6};
    scene.roi.is_random = false;
    scene.roi.center = om_vec3(0.03, 0, 0);
    return scene;
}

static int count_held(const OmScene* scene, double* area) {
    OmSite site;
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, &site));
    assert_near(site.half_size.x, 0.06, 1e-9);
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    int n = held ? held->nvert : 0;
    for (int i = 0; held && i < n; ++i) assert_near(site.mesh.x[3 * held->vert[i] + 2], 0, 1e-9);
    if (area) *area = om_site_attached_area(&site);
    om_site_done(&site);
    return n;
}

// A column has half a square on each side: 55 mm x 120 mm in all.
static void test_area(void** state) {
    (void)state;
    double area;
    OmScene scene = half_sheet();
    assert_int_equal(count_held(&scene, &area), 6 * 13);
    assert_near_rel(area, 0.055 * 0.12, 1e-9);
}

// 15 mm are one column more, or less; a shift of a column along x moves the border by one column.
static void test_believed_region(void** state) {
    (void)state;
    double area;
    OmScene scene = half_sheet();
    scene.believed.grow = 0.015;
    assert_int_equal(count_held(&scene, &area), 7 * 13);
    assert_near_rel(area, 0.065 * 0.12, 1e-9);
    scene.believed.grow = -0.015;
    assert_int_equal(count_held(&scene, &area), 5 * 13);
    assert_near_rel(area, 0.045 * 0.12, 1e-9);
    scene.believed.grow = 0;
    scene.believed.shift.x = 0.01;
    assert_int_equal(count_held(&scene, NULL), 7 * 13);
    scene.believed.shift.x = -0.01;
    assert_int_equal(count_held(&scene, NULL), 5 * 13);
}

// Shares of the attached vertices, and of the same number of free ones.
static void test_ratio(void** state) {
    (void)state;
    OmScene scene = half_sheet();
    scene.believed.ratio = 0.5;
    assert_near(count_held(&scene, NULL), 39, 1);
    scene.believed.ratio = 1.5;
    assert_near(count_held(&scene, NULL), 117, 1);
}

// A spring has the foundation times its area: an inner vertex 10 mm x 10 mm.
static void test_springs(void** state) {
    (void)state;
    OmScene scene = half_sheet();
    scene.attach.stiffness = 0;
    scene.attach.foundation = 4e5;
    OmSite site;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    const OmMeshSet* held = om_tet_mesh_find_set(&site.mesh, "attachment");
    double sum = 0, inner = 0;
    for (int i = 0; i < held->nvert; ++i) {
        OmVec3 p = om_load3(site.mesh.x, held->vert[i]);
        sum += site.attach_spring[i];
        if (fabs(p.x + 0.03) < 1e-6 && fabs(p.y) < 1e-6) inner = site.attach_spring[i];
    }
    assert_near_rel(sum, 4e5 * 0.055 * 0.12, 1e-9);
    assert_near_rel(inner, 4e5 * 0.01 * 0.01, 1e-9);
    assert_near(om_site_spacing(&site), (4 * 0.01 + 2 * sqrt(2e-4)) / 6, 0.004);
    om_site_done(&site);
    // A believed foundation alone takes the place of the truth's.
    scene.believed.foundation = 1e5;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    sum = 0;
    for (int i = 0; i < om_tet_mesh_find_set(&site.mesh, "attachment")->nvert; ++i)
        sum += site.attach_spring[i];
    assert_near_rel(sum, 1e5 * 0.055 * 0.12, 1e-9);
    om_site_done(&site);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_area),
        cmocka_unit_test(test_believed_region),
        cmocka_unit_test(test_ratio),
        cmocka_unit_test(test_springs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
