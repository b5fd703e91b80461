// test_world_organ.c: fat on a ball that gives way, as the truth of a scene: meshes, forces, what the cameras see, ROI
// and attachments on the organ, snapshots.
#include "omentum/body.h"
#include "omentum/scene_model.h"
#include "omentum/world.h"
#include "test_alloc.h"

static char folder[64];  // of the patient, for all tests

// Fat of 8 mm over a ball of 25 mm, held at its border.
static int make_patient(void** unused) {
    (void)unused;
    enum { N = 28 };
    OmVolume v;
    OmPatient p;
    char path[128];
    snprintf(folder, sizeof folder, "/tmp/omentum_organ_XXXXXX");
    if (!mkdtemp(folder)) return 1;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(0.0025, om_mat3_identity());
    v.grid.origin = om_vec3(-0.07, -0.035, -0.035);
    for (int n = 0; n < N * N * N; n++) {
        OmVec3 c = om_vec3(n % N - 13.5, n / N % N - 13.5, n / N / N - 13.5);
        ((float*)v.voxel)[n] = om_norm(c) < 10 ? 2 : 0;
    }
    OmModelDef def = om_model_default_def("ball.nrrd", 0.01);
    def.sheet.thickness = 0.008;
    def.sheet.keep_edge = def.allow_loss = true;  // any mesh will do
    def.sheet.nroi = 50;
    def.sheet.attach[def.sheet.nattach++] = (OmAttachDef){"border", "medial", 0.5, 0};
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, NULL));
    snprintf(path, sizeof path, "%s/ball", folder);
    assert_ok(om_patient_save(&p, NULL, path));
    om_patient_done(&p);
    om_volume_done(&v);
    return 0;
}

static int remove_patient(void** unused) {
    (void)unused;
    return om_path_remove(folder) == OM_OK ? 0 : 1;
}

static OmScene ball_scene(OmSceneWhere deforms) {
    OmScene s = om_scene_default();
    snprintf(s.name, sizeof s.name, "ball");
    s.tissue.source = OM_SOURCE_PATIENT;
    snprintf(s.data_root, sizeof s.data_root, "%s", folder);
    snprintf(s.tissue.file, sizeof s.tissue.file, "ball/patient.yaml");
    s.tissue.view = om_vec3(0, 0, -1);
    s.tissue.friction = 0.3;
    s.attach.kind = OM_ATTACH_SET;
    s.organ.deforms = deforms;
    s.organ.edge = 0.012;
    s.organ.young = 5000;
    s.endoscope.elevation = 1.3;
    s.endoscope.width = s.rgbd.width = 160, s.endoscope.height = s.rgbd.height = 120;
    return s;
}

static OmVec3 mean_of(int n, const double* x) {
    OmVec3 sum = {0, 0, 0};
    for (int i = 0; i < n; ++i) sum = om_madd(sum, 1.0 / n, om_load3(x, i));
    return sum;
}

// Who gets an organ that deforms, and how it is held.
static void test_sites(void** state) {
    (void)state;
    static const bool has[3][2] = {{false, false}, {false, true}, {true, true}};
    for (int kind = 0; kind < 3; ++kind)
        for (int role = 0; role < 2; ++role) {
            OmScene s = ball_scene((OmSceneWhere)kind);
            OmSite site;
            assert_ok(om_site_build(&s, role ? OM_SITE_WORLD : OM_SITE_TWIN, NULL, &site));
            assert_int_equal(site.soft.nvert > 0, has[kind][role]);
            if (site.soft.nvert == 0) assert_null(site.soft_spring);
            if (site.soft.nvert > 0) {
                const OmMeshSet* held = om_tet_mesh_find_set(&site.soft, "attachment");
                assert_near_rel(om_tet_mesh_volume(&site.soft), om_surface_volume(&site.organ),
                                0.15);  // edges of half the radius
                double sum = 0, highest = -INFINITY, r = 0.025;
                OmVec3 up = om_quat_rotate(site.pose_world_task.q, om_vec3(0, 0, 1)),
                       middle = mean_of(site.soft.nvert, site.soft.x);
                for (int k = 0; k < held->nvert; ++k) {
                    OmVec3 p = om_load3(site.soft.x, held->vert[k]);
                    highest = fmax(highest, om_dot(up, om_sub(p, middle)));
                    sum += site.soft_spring[k];
                }
                // springs by the area of the cap that looks down by more than 0.3: 2 pi r^2 (1 - 0.3)
                assert_near_rel(sum, s.organ.foundation * 2 * OM_PI * r * r * 0.7, 0.2);
                assert_below(highest, 0.2 * r);
            }
            om_site_done(&site);
        }
}

// Largest distance of points from those of the other, moved.
static double gap_of(OmPose motion, int n, const double* was, const double* x) {
    double most = 0;
    for (int i = 0; i < n; ++i)
        most = fmax(most, om_distance(om_pose_apply(motion, om_load3(was, i)), om_load3(x, i)));
    return most;
}

// A site that is moved: points and normals go along, the field of distances is that of the moved organ, and the organ
// that gives way is the one that a site read from a file would have.
static void test_a_site_is_moved(void** state) {
    (void)state;
    const OmScene s = ball_scene(OM_IN_BOTH);
    const OmPose motion = {{0.004, -0.002, 0.003}, om_quat_axis_angle(om_vec3(0.6, 0, 0.8), 0.06)};
    OmSite was, site;
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &was));
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_site_move(&s, &site, motion));
    assert_below(gap_of(motion, site.mesh.nvert, was.mesh.x, site.mesh.x), 1e-12);
    assert_below(gap_of(motion, site.organ.nvert, was.organ.x, site.organ.x), 1e-12);
    assert_below(gap_of(motion, site.roi.nvert, was.roi.x, site.roi.x), 1e-12);
    assert_below(gap_of(motion, site.nroi, was.roi_x, site.roi_x), 1e-12);
    assert_below(gap_of((OmPose){.q = motion.q}, site.nroi, was.roi_n, site.roi_n), 1e-12);
    assert_below(om_distance(site.pose_world_field.p, was.pose_world_field.p), 1e-15);
    for (int i = 0; i < site.nroi; ++i) {  // the ROI lies where it lay to the organ
        const double before = om_sdf_eval(&was.organ_sdf, om_load3(was.roi_x, i), NULL);
        assert_near(om_sdf_eval(&site.organ_sdf, om_load3(site.roi_x, i), NULL), before, 3e-4);
    }
    OmSite read = site;
    memset(&read.soft, 0, sizeof read.soft);
    read.soft_spring = NULL;
    assert_ok(om_site_mesh_organ(&s, &read));
    assert_int_equal(read.soft.nvert, site.soft.nvert);
    assert_memory_equal(read.soft.x, site.soft.x, 3 * (size_t)site.soft.nvert * sizeof(double));
    const OmVec3 middle = om_pose_apply(motion, mean_of(was.soft.nvert, was.soft.x));
    assert_below(om_distance(mean_of(site.soft.nvert, site.soft.x), middle), 2e-3);
    om_tet_mesh_done(&read.soft);
    om_free(read.soft_spring);
    om_site_done(&site);
    om_site_done(&was);
}

typedef struct Field {
    OmScene scene;
    OmSite site;
    OmBody* body;
} Field;

static void setup(Field* f, OmScene scene) {
    f->scene = scene;
    assert_ok(om_site_build(&f->scene, OM_SITE_WORLD, NULL, &f->site));
    assert_ok(om_body_create(&f->scene, &f->site, 1, &f->body));
}

static void teardown(Field* f) {
    om_body_destroy(f->body);
    om_site_done(&f->site);
}

static OmBodyReport step(OmBody* body, int n) {
    OmBodyReport report = {0};
    for (int k = 0; k < n; ++k) assert_ok(om_body_step(body, 0.02, &report));
    return report;
}

// Forces are those on the fat alone, the organ carries it and gives way, and shown is the fat alone.
static void test_the_organ_carries_the_fat(void** state) {
    (void)state;
    Field f;
    setup(&f, ball_scene(OM_IN_TRUTH));
    OmBodyReport report = step(f.body, 40);
    assert_true(report.ncontact > 20 && report.penetration < 1e-5);
    const OmTissueModel* tissue = om_body_tissue(f.body);
    const OmTetMesh *all = om_tissue_mesh(tissue), *shown = om_body_mesh(f.body);
    const int n = f.site.mesh.nvert;
    assert_int_equal(om_tissue_corner_count(tissue), n + f.site.soft.nvert);
    assert_int_equal(all->ntet, 8 * (f.site.mesh.ntet + f.site.soft.ntet));
    assert_int_equal(shown->ntet, 8 * f.site.mesh.ntet);
    // no element that is shown is the organ's
    for (int e = 0; e < shown->ntet; ++e) assert_int_equal(shown->tet_label[e], 0);
    for (int e = shown->ntet; e < all->ntet; ++e) assert_int_equal(all->tet_label[e], 1);
    OmBodyForces forces;
    assert_ok(om_body_get_forces(f.body, &forces));
    double weight = 9.81 * f.site.density * om_tet_mesh_volume(&f.site.mesh);
    assert_near_rel(om_norm(forces.weight), weight, 1e-9);
    OmVec3 sum = om_add(om_add(forces.weight, forces.contact), forces.attachment);
    assert_below(om_norm(sum), 0.03 * weight);
    assert_true(om_dot(forces.contact, forces.weight) < -0.3 * weight * weight);
    // the organ sinks into what it lies on: its weight and a part of the fat's over the springs
    OmVec3 moved = om_sub(mean_of(f.site.soft.nvert, om_body_x(f.body) + 3 * n),
                          mean_of(f.site.soft.nvert, f.site.soft.x));
    double load = 9.81 * 1050 * om_tet_mesh_volume(&f.site.soft), springs = 0;
    const OmMeshSet* held = om_tet_mesh_find_set(&f.site.soft, "attachment");
    for (int k = 0; k < held->nvert; ++k) springs += f.site.soft_spring[k];
    double down = om_dot(moved, om_normalize(forces.weight));
    assert_true(down > load / springs && down < 3 * (load + weight) / springs);
    // forces and stresses of the site's own vertices and elements
    double* value = om_alloc(3 * (size_t)n, sizeof *value);
    assert_ok(om_body_get_attachment_force(f.body, value));
    OmVec3 held_by = {0, 0, 0};
    for (int i = 0; i < n; ++i) held_by = om_add(held_by, om_load3(value, i));
    assert_below(om_distance(held_by, forces.attachment), 1e-6 * weight);
    om_free(value);
    value = om_alloc((size_t)f.site.mesh.ntet, sizeof *value);
    assert_ok(om_body_get_measure(f.body, OM_VOLUME_RATIO, value));
    for (int e = 0; e < f.site.mesh.ntet; ++e) assert_true(value[e] > 0.7 && value[e] < 1.3);
    om_free(value);
    teardown(&f);
}

// Organ and ROI go with the organ's mesh, and the ROI stays where it is with a rigid one.
static void test_anatomy_rides(void** state) {
    (void)state;
    for (int kind = 0; kind < 2; ++kind) {
        Field f;
        OmAnatomy* a;
        OmVisibility before, after;
        OmView* view;
        setup(&f, ball_scene(kind ? OM_IN_TRUTH : OM_IN_NONE));
        assert_ok(om_anatomy_create(f.body, &a));
        assert_int_equal(a->moves, kind);
        assert_ok(om_view_create_of_body(&f.scene, f.body, &view));
        const size_t size = 3 * (size_t)om_tissue_mesh(om_body_tissue(f.body))->nvert;
        double* x = om_alloc(size, sizeof *x);
        memcpy(x, om_body_x(f.body), size * sizeof *x);
        for (int i = 0; i < f.site.nroi; ++i)
            assert_near(om_distance(om_load3(a->roi_x, i), om_load3(f.site.roi_x, i)), 0, 1e-12);
        assert_ok(om_view_look(view, x, &before));
        OmPose turn = {om_vec3(0.2, 0.3, -0.03), om_quat_axis_angle(om_vec3(0, 0, 1), 0.4)};
        for (size_t i = 0; i < size / 3; ++i)
            om_store3(x, (int)i, om_pose_apply(turn, om_load3(x, (int)i)));
        om_anatomy_move(a, x);
        if (!kind) turn = om_pose_identity();
        for (int i = 0; i < f.site.nroi; ++i) {
            OmVec3 p = om_pose_apply(turn, om_load3(f.site.roi_x, i)),
                   n = om_quat_rotate(turn.q, om_load3(f.site.roi_n, i));
            assert_near(om_distance(om_load3(a->roi_x, i), p), 0, 1e-12);
            assert_near(om_distance(om_load3(a->roi_n, i), n), 0, 1e-12);
        }
        for (int i = 0; i < a->organ->nvert; i += 50)
            assert_near(om_distance(om_load3(a->organ->x, i),
                                    om_pose_apply(turn, om_load3(f.site.organ.x, i))),
                        0, 1e-12);
        // far aside, the ROI is outside of the picture, or still where it was
        assert_ok(om_view_look(view, x, &after));
        assert_int_equal(before.noutside, 0);
        if (kind) {
            assert_true(after.noutside > 0);
            assert_ok(om_view_look(view, NULL, &after));  // where the last x put it
            assert_true(after.noutside > 0);
        } else {
            assert_int_equal(after.noutside, 0);
        }
        om_free(x);
        om_view_destroy(view);
        om_anatomy_destroy(a);
        teardown(&f);
    }
}

// Springs on the organ, as a fascia: nothing of the fat is held still, forces balance, and the vertices count as
// attached. Replaced attachments leave the organ held.
static void test_attachments(void** state) {
    (void)state;
    Field f;
    OmScene s = ball_scene(OM_IN_TRUTH);
    s.attach.on_organ = true;
    s.attach.foundation = 1e7;
    setup(&f, s);
    const OmMeshSet* held = om_tet_mesh_find_set(&f.site.mesh, "attachment");
    const unsigned char* attached = om_body_attached(f.body);
    int n = 0;
    for (int i = 0; i < f.site.mesh.nvert; ++i) n += attached[i];
    assert_int_equal(n, held->nvert);
    for (int k = 0; k < held->nvert; ++k) assert_true(attached[held->vert[k]]);
    step(f.body, 40);
    OmBodyForces forces;
    assert_ok(om_body_get_forces(f.body, &forces));
    OmVec3 sum = om_add(om_add(forces.weight, forces.contact), forces.attachment);
    assert_below(om_norm(sum), 0.03 * om_norm(forces.weight));
    // the fat is lifted, and lifts the organ
    const OmVec3 up = om_quat_rotate(f.site.pose_world_task.q, om_vec3(0, 0, 1));
    const int ntissue = f.site.mesh.nvert, nsoft = f.site.soft.nvert;
    OmVec3 before = mean_of(nsoft, om_body_x(f.body) + 3 * ntissue);
    OmPose tip = {om_load3(om_body_x(f.body), held->vert[0]), om_quat_identity()};
    assert_ok(om_body_grasp(f.body, 0, tip, 0.008, NULL));
    for (int k = 0; k < 25; ++k) {
        tip.p = om_madd(tip.p, 4e-4, up);
        assert_ok(om_body_move(f.body, 0, tip));
        step(f.body, 1);
    }
    assert_ok(om_body_get_forces(f.body, &forces));
    assert_true(om_dot(forces.attachment, up) < -0.1 * om_norm(forces.weight));
    OmVec3 moved = om_sub(mean_of(nsoft, om_body_x(f.body) + 3 * ntissue), before);
    assert_true(om_dot(moved, up) > 1e-4);
    teardown(&f);

    setup(&f, ball_scene(OM_IN_TRUTH));
    int one = 0;
    assert_ok(om_body_set_attachment(f.body, 1, &one, NULL, NULL));
    attached = om_body_attached(f.body);
    held = om_tet_mesh_find_set(&f.site.soft, "attachment");
    n = 0;
    for (int i = 0; i < om_tissue_corner_count(om_body_tissue(f.body)); ++i) n += attached[i];
    assert_int_equal(n, 1 + held->nvert);
    for (int k = 0; k < held->nvert; ++k) {
        const int i = f.site.mesh.nvert + held->vert[k];
        assert_true(attached[i]);
        assert_true(om_body_attachment_stiffness(f.body)[i] == f.site.soft_spring[k]);
    }
    one = f.site.mesh.nvert;  // the organ's
    assert_status(om_body_set_attachment(f.body, 1, &one, NULL, NULL), OM_INVALID);
    assert_status(om_body_set_attachment(f.body, -1, &one, NULL, NULL), OM_INVALID);
    assert_status(om_body_set_attachment(f.body, 1, NULL, NULL, NULL), OM_INVALID);
    teardown(&f);
}

static void test_snapshot(void** state) {
    (void)state;
    Field f;
    setup(&f, ball_scene(OM_IN_TRUTH));
    step(f.body, 3);
    void* block = om_alloc(om_body_state_size(f.body), 1);
    om_body_save(f.body, block);
    step(f.body, 2);
    uint64_t hash = om_body_hash(f.body);
    om_body_restore(f.body, block);
    step(f.body, 2);
    assert_true(om_body_hash(f.body) == hash);
    om_free(block);
    teardown(&f);
}

static void test_what_is_refused(void** state) {
    (void)state;
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"attachments: {kind: set, on_organ: yes, foundation: 1e6}", "organ: deforms: truth"},
        {"organ: {deforms: truth}\nattachments: {kind: set, on_organ: yes}", "give foundation"},
        {"organ: {deforms: truth}\nattachments: {kind: set, on_organ: yes, foundation: 1e6}\n"
         "world: {tear_strength: 100}",
         "do not tear"},
        {"organ: {deforms: perhaps}", "deforms"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        char text[512];
        OmScene scene;
        snprintf(text, sizeof text,
                 "name: a\ntissue: {source: patient, file: ball/patient.yaml}\n%s\n", bad[k].text);
        OmStatus status = om_scene_parse(text, strlen(text), "a.yaml", &scene);
        assert_true(status < 0);
        assert_non_null(strstr(om_error_message(), bad[k].says));
    }
    // particles have no organ that deforms
    OmScene s = ball_scene(OM_IN_BOTH);
    OmSite site;
    OmBody* body;
    snprintf(s.tissue.engine, sizeof s.tissue.engine, "pbd");
    assert_ok(om_site_build(&s, OM_SITE_TWIN, NULL, &site));
    assert_status(om_body_create(&s, &site, 1, &body), OM_UNAVAILABLE);
    om_site_done(&site);
}

typedef struct Task {
    const OmScene* scene;
    const OmSite* site;
} Task;

static OmStatus create_all(void* ctx) {
    const Task* t = ctx;
    OmBody* body = NULL;
    OmAnatomy* anatomy = NULL;
    OmStatus status = om_body_create(t->scene, t->site, 1, &body);
    if (status == OM_OK) status = om_anatomy_create(body, &anatomy);
    om_anatomy_destroy(anatomy);
    om_body_destroy(body);
    return status;
}

static void test_allocations(void** state) {
    (void)state;
    OmScene s = ball_scene(OM_IN_TRUTH);
    OmSite site;
    s.attach.on_organ = true;
    s.attach.foundation = 1e7;
    assert_ok(om_site_build(&s, OM_SITE_WORLD, NULL, &site));
    Task task = {&s, &site};
    assert_true(test_failing_allocations(create_all, &task, test_stride(17)) > 3);
    om_site_done(&site);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sites),
        cmocka_unit_test(test_a_site_is_moved),
        cmocka_unit_test(test_the_organ_carries_the_fat),
        cmocka_unit_test(test_anatomy_rides),
        cmocka_unit_test(test_attachments),
        cmocka_unit_test(test_snapshot),
        cmocka_unit_test(test_what_is_refused),
        cmocka_unit_test(test_allocations),
    };
    return cmocka_run_group_tests(tests, make_patient, remove_patient);
}
