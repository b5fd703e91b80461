// test_world_attach.c: attachments by area on two meshes, and a twin that believes others than the true ones.
#include "test_common.h"

#include "linear_sheet.h"
#include "omentum/body.h"
#include "omentum/scene_vary.h"
#include "world/world_body.h"

// A sheet of 120 x 120 mm without a board, attached where x > 0.
static OmScene hung_sheet(void) {
    OmScene s = linear_sheet();
    s.tissue.cells = om_vec3(12, 12, 1);
    s.tissue.world_cells = om_vec3(18, 18, 2);
    s.tissue.has_board = false;
    s.tissue.rayleigh_mass = 20;
    s.world.young_factor = 1;
    s.attach.kind = OM_ATTACH_BOX;
    s.attach.lo = om_vec3(-0.001, -1, -1);
    s.attach.hi = om_vec3(1, 1, 1);
    s.roi.is_random = false;
    s.roi.center = om_vec3(-0.03, 0, 0);
    return s;
}

static const OmMeshSet* held_of(const OmSite* site) {
    return om_tet_mesh_find_set(&site->mesh, "attachment");
}

// Mean stretch of the springs, weighted by their stiffness, and the largest, m; at rest the first is W / sum k.
static void hang(const OmScene* scene, const OmSite* site, double* mean, double* largest) {
    OmBody* body;
    OmBodyForces f;
    OmBodyReport report;
    assert_ok(om_body_create(scene, site, 1, &body));
    for (int n = 0; n < 300; ++n) assert_ok(om_body_step(body, 0.02, &report));
    assert_ok(om_body_get_forces(body, &f));
    const double *k = om_body_attachment_stiffness(body), *x = om_body_x(body);
    double sum = 0, force = 0;
    OmVec3 down = om_normalize(site->gravity);
    *largest = 0;
    for (int i = 0; i < site->mesh.nvert; ++i) {
        double sag = om_dot(down, om_sub(om_load3(x, i), om_load3(site->mesh.x, i)));
        if (!om_body_attached(body)[i]) continue;
        sum += k[i];
        force += k[i] * sag;
        *largest = fmax(*largest, sag);
    }
    *mean = force / sum;
    assert_near_rel(force, om_norm(f.weight), 1e-3);
    assert_near_rel(-om_dot(down, f.attachment), om_norm(f.weight), 1e-3);
    om_body_destroy(body);
}

// Stiffness by area: twin and world have one total, and hang alike. By vertex, the finer mesh is twice as stiff.
static void test_foundation(void** state) {
    (void)state;
    OmScene scene = hung_sheet();
    OmSite site[2];
    double mean[2], largest[2], total[2] = {0, 0};
    scene.attach.foundation = 3e4;  // 0.7 N on 72 cm^2 sink by 3.3 mm
    for (int role = 0; role < 2; ++role) {
        assert_ok(om_site_build(&scene, (OmSiteRole)role, NULL, &site[role]));
        for (int k = 0; k < held_of(&site[role])->nvert; ++k)
            total[role] += site[role].attach_spring[k];
        hang(&scene, &site[role], &mean[role], &largest[role]);
    }
    double area = om_site_attached_area(&site[0]);
    printf(
        "attached %.2f cm^2; sag %.4f and %.4f mm, at most %.3f and %.3f mm; %d and %d vertices\n",
        1e4 * area, 1e3 * mean[0], 1e3 * mean[1], 1e3 * largest[0], 1e3 * largest[1],
        held_of(&site[0])->nvert, held_of(&site[1])->nvert);
    // Half of the sheet, and half of the row of cells at its edge, whose vertices at x = 0 are attached.
    assert_near_rel(area, 0.12 * (0.06 + 0.005), 1e-9);
    assert_near_rel(om_site_attached_area(&site[1]), area, 1e-12);
    assert_near_rel(total[0], 3e4 * area, 1e-12);
    assert_near_rel(total[1], total[0], 1e-12);
    assert_near_rel(mean[1], mean[0], 2e-3);
    assert_near_rel(largest[1], largest[0], 0.1);
    double by_area = mean[0];
    if (!test_is_slow()) {
        for (int role = 0; role < 2; ++role) om_site_done(&site[role]);
        return;
    }
    scene.attach.foundation = 0;
    scene.attach.stiffness = total[0] / held_of(&site[0])->nvert;
    for (int role = 0; role < 2; ++role) {
        om_site_set_numbers(&scene, &site[role]);
        hang(&scene, &site[role], &mean[role], &largest[role]);
        om_site_done(&site[role]);
    }
    assert_near_rel(mean[0], by_area, 5e-3);
    assert_true(mean[1] < 0.6 * mean[0]);
}

// ---- the belief ---------------------------------------------------------------------------------------

// The twin's attached vertices that are also the truth's, and its other attached vertices.
static void count(const OmScene* scene, int* nboth, int* nwrong, int* ntruth) {
    OmScene honest = *scene;
    honest.believed = om_scene_default().believed;
    OmSite truth, twin, world[2];
    assert_ok(om_site_build(&honest, OM_SITE_TWIN, NULL, &truth));
    assert_ok(om_site_build(scene, OM_SITE_TWIN, NULL, &twin));
    unsigned char* is_true = om_calloc((size_t)truth.mesh.nvert, 1);
    *nboth = *nwrong = 0;
    *ntruth = held_of(&truth)->nvert;
    for (int k = 0; k < *ntruth; ++k) is_true[held_of(&truth)->vert[k]] = 1;
    for (int k = 0; k < held_of(&twin)->nvert; ++k)
        ++*(is_true[held_of(&twin)->vert[k]] ? nboth : nwrong);
    // The world and the region of interest do not know the belief.
    assert_ok(om_site_build(&honest, OM_SITE_WORLD, NULL, &world[0]));
    assert_ok(om_site_build(scene, OM_SITE_WORLD, NULL, &world[1]));
    const OmMeshSet *a = held_of(&world[0]), *b = held_of(&world[1]);
    assert_int_equal(a->nvert, b->nvert);
    assert_memory_equal(a->vert, b->vert, (size_t)a->nvert * sizeof *a->vert);
    assert_near(om_distance(twin.roi_center, truth.roi_center), 0, 0);
    assert_near(world[0].attach_stiffness, world[1].attach_stiffness, 0);
    om_free(is_true);
    om_site_done(&truth);
    om_site_done(&twin);
    om_site_done(&world[0]);
    om_site_done(&world[1]);
}

// The truth is 7 of 13 rows of 13 vertices; rows are 10 mm apart.
static void test_belief(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    int nboth, nwrong, n;
    count(&s, &nboth, &nwrong, &n);
    assert_true(n == 7 * 13 && nboth == n && nwrong == 0);
    s.believed.grow = 0.021;  // two rows more
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == n && nwrong == 2 * 13);
    s.believed.grow = -0.021;  // two rows fewer: the border of the sheet is no border of the region
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == 5 * 13 && nwrong == 0);
    s.believed.grow = 0;
    s.believed.shift = om_vec3(0.0301, 0, 5);  // three rows to +x
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == 4 * 13 && nwrong == 0);
    s.believed.shift = om_vec3(-0.0301, 0, 0);  // the other side: the part at the border moves on
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == n && nwrong == 3 * 13);
    s.believed.shift = om_vec3(0, 0, 0);
    s.believed.kind = OM_BELIEF_NONE;
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == 0 && nwrong == 0);
    s.believed.kind = OM_BELIEF_BOX;  // elsewhere
    s.believed.lo = om_vec3(-1, -1, -1);
    s.believed.hi = om_vec3(-0.0001, 1, 1);
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == 0 && nwrong == 6 * 13);
}

// Fewer and more by the metric of (4.1): as many as asked, nested, in one piece around the middle; and another patch.
static void test_ratio(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    int nboth, nwrong, n;
    s.believed.ratio = 0.4;
    count(&s, &nboth, &nwrong, &n);
    assert_in_range(nboth, (int)(0.4 * n) - 1, (int)(0.4 * n) + 1);
    assert_int_equal(nwrong, 0);
    s.believed.ratio = 1.5;
    count(&s, &nboth, &nwrong, &n);
    assert_int_equal(nboth, n);
    assert_in_range(nwrong, (int)(0.5 * n) - 1, (int)(0.5 * n) + 1);
    s.believed.ratio = 20;  // no more than there is
    count(&s, &nboth, &nwrong, &n);
    assert_true(nboth == n && nwrong == 13 * 13 - n);
    OmSite small, smaller;
    s.believed.ratio = 0.6;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &small));
    s.believed.ratio = 0.2;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &smaller));
    int ninside = 0;
    OmVec3 middle = om_vec3(0, 0, 0);
    for (int i = 0; i < held_of(&smaller)->nvert; ++i)
        for (int k = 0; k < held_of(&small)->nvert; ++k)
            ninside += held_of(&smaller)->vert[i] == held_of(&small)->vert[k];
    assert_int_equal(ninside, held_of(&smaller)->nvert);
    // The truth's rows are 0 to 60 mm from the middle of the sheet; the farthest inside are at its border.
    for (int i = 0; i < held_of(&smaller)->nvert; ++i)
        middle = om_madd(middle, 1.0 / held_of(&smaller)->nvert,
                         om_load3(smaller.mesh.x, held_of(&smaller)->vert[i]));
    assert_true(fabs(middle.x) > 0.03);
    om_site_done(&small);
    om_site_done(&smaller);
    s.believed.ratio = 0.001;
    assert_status(om_site_build(&s, OM_SITE_TWIN, NULL, &small), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "ratio"));
    s.believed = om_scene_default().believed;
    s.believed.kind = OM_BELIEF_PATCH;
    s.believed.share = 0.25;
    int found[2];
    for (int seed = 0; seed < 2; ++seed) {
        s.believed.seed = 7 + seed;
        count(&s, &nboth, &nwrong, &n);
        assert_in_range(nboth + nwrong, 41, 43);  // a quarter of 169
        found[seed] = nboth;
    }
    assert_true(found[0] != found[1]);
}

// A site that was built, with fewer or more attachments: as many, nested, with areas of their own.
static void test_scaled(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    OmSite built, fewer, more;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &built));
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &fewer));
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &more));
    assert_ok(om_site_scale_attachments(&s, 0.5, 3, &fewer));
    assert_ok(om_site_scale_attachments(&s, 1.5, 3, &more));
    const int n = held_of(&built)->nvert;
    assert_in_range(held_of(&fewer)->nvert, n / 2, n / 2 + 1);
    assert_in_range(held_of(&more)->nvert, n + n / 2, n + n / 2 + 1);
    int nfewer = 0, nmore = 0;
    for (int i = 0; i < n; ++i) {
        const int v = held_of(&built)->vert[i];
        for (int k = 0; k < held_of(&fewer)->nvert; ++k) nfewer += held_of(&fewer)->vert[k] == v;
        for (int k = 0; k < held_of(&more)->nvert; ++k) nmore += held_of(&more)->vert[k] == v;
    }
    assert_int_equal(nfewer, held_of(&fewer)->nvert);
    assert_int_equal(nmore, n);
    assert_true(om_site_attached_area(&fewer) < om_site_attached_area(&built));
    assert_true(om_site_attached_area(&more) > om_site_attached_area(&built));
    assert_status(om_site_scale_attachments(&s, 0, 3, &built), OM_INVALID);
    om_site_done(&built);
    om_site_done(&fewer);
    om_site_done(&more);
    s.believed.kind = OM_BELIEF_NONE;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &built));
    assert_ok(om_site_scale_attachments(&s, 1.5, 3, &built));
    assert_int_equal(held_of(&built)->nvert, 0);
    om_site_done(&built);
}

// Law, Poisson's ratio and friction of the true tissue reach the world alone; left out they are the twin's.
static void test_true_tissue(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    for (int is_other = 0; is_other < 2; ++is_other) {
        s.tissue.has_board = true, s.tissue.friction = 0.2;
        if (is_other) s.world.law = OM_NEO_HOOKEAN, s.world.poisson = 0.4, s.world.friction = 0.7;
        for (int role = OM_SITE_TWIN; role <= OM_SITE_WORLD; ++role) {
            OmSite site;
            OmBodyParts parts;
            OmTissueDef def;
            char text[256];
            assert_ok(om_site_build(&s, (OmSiteRole)role, NULL, &site));
            assert_ok(om_body_make_tissue_def(&s, &site, &parts, &def));
            om_body_describe(&s, &site, text, sizeof text);
            bool is_own = is_other && role == OM_SITE_WORLD;
            assert_int_equal(def.material_default.law,
                             is_own ? OM_NEO_HOOKEAN : (OmLaw)s.tissue.law);
            assert_near(def.material_default.poisson, is_own ? 0.4 : s.tissue.poisson, 0);
            assert_non_null(strstr(text, om_law_name(def.material_default.law)));
            OmBodyModel* model;
            const OmTissueObstacle* board;
            assert_ok(om_body_model_create(&s, &site, 1, &model));
            assert_int_equal(om_contact_get_obstacles(model->contact, &board), 1);
            assert_near(board->friction, is_own ? 0.7 : 0.2, 0);
            om_body_model_destroy(model);
            om_site_done(&site);
        }
    }
}

// A stiffness that is believed reaches the twin alone, in both units; calibrated numbers of the truth stay.
static void test_believed_stiffness(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    const double truth[2][2] = {{40, 0}, {0, 3e4}};
    const double believed[4][2] = {{-1, -1}, {7, -1}, {-1, 5e4}, {0, -1}};
    for (int t = 0; t < 2; ++t)
        for (int b = 0; b < 4; ++b) {
            s.attach.stiffness = truth[t][0], s.attach.foundation = truth[t][1];
            s.believed.stiffness = believed[b][0], s.believed.foundation = believed[b][1];
            for (int role = 0; role < 2; ++role) {
                OmSite site;
                OmBody* body;
                assert_ok(om_site_build(&s, (OmSiteRole)role, NULL, &site));
                assert_ok(om_body_create(&s, &site, 1, &body));
                bool is_own = role == OM_SITE_TWIN && b > 0;
                const double* want = is_own ? believed[b] : truth[t];
                for (int k = 0; k < held_of(&site)->nvert; ++k) {
                    int i = held_of(&site)->vert[k];
                    double by = fmax(want[1], 0) * site.attach_area[k];
                    double spring = want[1] > 0 ? by : fmax(want[0], 0);
                    assert_near_rel(om_body_attachment_stiffness(body)[i] + 1, spring + 1, 1e-12);
                    assert_true(om_body_attached(body)[i]);
                }
                om_body_destroy(body);
                om_site_done(&site);
            }
        }
}

// A twin without attachments still settles, on the board; its weight is borne there.
static void test_nothing_believed(void** state) {
    (void)state;
    OmScene s = hung_sheet();
    OmSite site;
    OmBody* body;
    OmBodyForces f;
    s.tissue.has_board = true;
    s.believed.kind = OM_BELIEF_NONE;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &site));
    assert_near(om_site_attached_area(&site), 0, 0);
    assert_ok(om_body_create(&s, &site, 1, &body));
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    assert_ok(om_body_get_forces(body, &f));
    assert_near(om_norm(f.attachment), 0, 0);
    assert_near_rel(om_norm(f.contact), om_norm(f.weight), 1e-2);
    om_body_destroy(body);
    om_site_done(&site);
}

// ---- the file -------------------------------------------------------------------------------------------

static const char head[] = "name: x\ntissue: {source: sheet}\nattachments: {kind: random_patch";

static void expect(const char* rest, const char* words) {
    OmScene scene;
    char text[1000];
    snprintf(text, sizeof text, "%s%s\n", head, rest);
    assert_status(om_scene_parse(text, strlen(text), "s.yaml", &scene), OM_INVALID);
    if (!strstr(om_error_message(), words))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), words);
}

static void test_keys(void** state) {
    (void)state;
    OmScene s, again;
    OmText text = {0};
    char yaml[1000];
    snprintf(yaml, sizeof yaml, "%s, foundation: 3e4}\n%s\n", head,
             "believed_attachments: {shift_mm: [4, -5, 0], grow_mm: -6, stiffness: 12}");
    assert_ok(om_scene_parse(yaml, strlen(yaml), "s.yaml", &s));
    assert_near(s.attach.foundation, 3e4, 0);
    assert_near(om_distance(s.believed.shift, om_vec3(0.004, -0.005, 0)), 0, 1e-15);
    assert_near(s.believed.grow, -0.006, 1e-15);
    assert_near(s.believed.stiffness, 12, 0);
    assert_true(s.believed.foundation < 0 && s.believed.kind == OM_BELIEF_SAME);
    assert_ok(om_scene_print(&s, true, &text));
    assert_ok(om_scene_parse(text.str, text.len, "again.yaml", &again));
    assert_memory_equal(&again.believed, &s.believed, sizeof s.believed);
    assert_memory_equal(&again.attach, &s.attach, sizeof s.attach);
    assert_true(s.world.law == -1 && again.world.law == -1);
    assert_true(again.world.poisson < 0 && again.world.friction < 0);
    om_text_done(&text);
    expect(", stiffness: 5, foundation: 3e4}", "exclude each other");
    expect("}\nbelieved_attachments: {stiffness: 5, foundation: 3e4}", "exclude each other");
    expect("}\nbelieved_attachments: {lo_mm: [1, 2, 3]}", "kind: box");
    expect("}\nbelieved_attachments: {kind: none, grow_mm: 3}", "kind: same");
    expect("}\nbelieved_attachments: {kind: box, ratio: 0.5}", "kind: same");
    expect("}\nbelieved_attachments: {seed: 3}", "kind: random_patch");
    expect("}\nbelieved_attachment: {kind: none}", "believed_attachments");
    OmSite site;
    OmScene shrunk = hung_sheet();
    shrunk.believed.grow = -0.5;
    assert_status(om_site_build(&shrunk, OM_SITE_TWIN, NULL, &site), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "kind: none"));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_foundation),
                                       cmocka_unit_test(test_belief),
                                       cmocka_unit_test(test_ratio),
                                       cmocka_unit_test(test_scaled),
                                       cmocka_unit_test(test_true_tissue),
                                       cmocka_unit_test(test_believed_stiffness),
                                       cmocka_unit_test(test_nothing_believed),
                                       cmocka_unit_test(test_keys)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
