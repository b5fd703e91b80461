// test_world_bodies.c: many bodies of one model, stepped in parallel with one work a thread.
#include "test_alloc.h"

#include "linear_sheet.h"
#include "omentum/body.h"
#include "omentum/contact_tool.h"
#include "omentum/world.h"

enum { NBODY = 12, NSTEP = 12, MAX_WORK = 4 };

static OmScene sheet(const char* engine) {
    OmScene s = linear_sheet();
    s.tissue.cells = om_vec3(8, 8, 1);
    s.tissue.world_cells = om_vec3(12, 12, 2);
    s.tissue.cluster_spacing = 0.02;
    s.tissue.cluster_radius = 0.02;
    s.roi.is_random = false;
    s.roi.center = om_vec3(-0.03, -0.02, 0);
    s.task.grasp_radius = 0.02;
    snprintf(s.tissue.engine, sizeof s.tissue.engine, "%s", engine);
    return s;
}

// Body k is lifted at the middle in a direction of its own; every third is released and attached elsewhere.
static void command(OmBody* b, int k, int step) {
    const OmSite* site = om_body_site(b);
    OmPose tip = {om_vec3(0.05 * cos(k), 0.05 * sin(k), 0.005), om_quat_identity()};
    tip.p.z += 5e-4 * (step + k % 4);
    tip.p = om_pose_apply(site->pose_world_task, tip.p);
    if (step == 0) assert_ok(om_body_grasp(b, 0, tip, 0.02, NULL));
    assert_ok(om_body_move(b, 0, tip));
    if (step != 6 || k % 3) return;
    int vert = k;
    om_body_release(b, 0);
    assert_ok(om_body_set_attachment(b, 1, &vert, NULL, NULL));
}

static void check_engine(const char* engine) {
    OmScene scene = sheet(engine);
    OmSite site;
    OmBodyModel* model;
    OmBody* body[NBODY];
    OmBodyWork* work[MAX_WORK];
    OmStatus status[NBODY];
    OmBodyReport report;
    uint64_t alone[NBODY];
    const int nbody = test_count(8, NBODY);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    for (int k = 0; k < nbody; ++k) {  // each with a model and a work of its own
        assert_ok(om_body_create(&scene, &site, 1, &body[k]));
        for (int n = 0; n < NSTEP; ++n) {
            command(body[k], k, n);
            assert_true(om_body_step(body[k], 0.02, &report) >= 0);
        }
        alone[k] = om_body_hash(body[k]);
        for (int i = 0; i < k; ++i) assert_true(alone[i] != alone[k]);
        om_body_destroy(body[k]);
    }
    assert_ok(om_body_model_create(&scene, &site, 1, &model));
    for (int w = 0; w < MAX_WORK; ++w) assert_ok(om_body_work_create(model, &work[w]));
    for (int k = 0; k < nbody; ++k) assert_ok(om_body_create_shared(model, NULL, &body[k]));
    assert_status(om_body_step(body[0], 0.02, &report), OM_INVALID);  // it has no work
    assert_status(om_body_settle(body[0], 0.02, 1e-3, 1), OM_INVALID);
    OmBodyModel* other;
    OmBodyWork* foreign;
    assert_ok(om_body_model_create(&scene, &site, 1, &other));
    assert_ok(om_body_work_create(other, &foreign));
    om_body_set_work(body[0], foreign);
    assert_status(om_body_step(body[0], 0.02, &report), OM_INVALID);  // a work of another model
    om_body_set_work(body[0], NULL);
    om_body_work_destroy(foreign);
    om_body_model_destroy(other);
    for (int nwork = 1; nwork <= MAX_WORK; nwork += test_count(MAX_WORK - 1, 1)) {
        om_worker_force(true);  // as many threads as works, whatever the machine has
        for (int k = 0; k < nbody; ++k) om_body_reset(body[k]);
        for (int n = 0; n < NSTEP; ++n) {
            for (int k = 0; k < nbody; ++k) command(body[k], k, n);
            assert_true(om_body_step_many(nbody, body, nwork, work, 0.02, status) >= 0);
        }
        om_worker_force(false);
        for (int k = 0; k < nbody; ++k) assert_true(om_body_hash(body[k]) == alone[k]);
    }
    for (int k = 0; k < nbody; ++k) om_body_destroy(body[k]);
    for (int w = 0; w < MAX_WORK; ++w) om_body_work_destroy(work[w]);
    om_body_model_destroy(model);
    om_site_done(&site);
}

static void test_parallel_is_alone(void** state) {
    (void)state;
    check_engine("fem");
    check_engine("pbd");
    check_engine("xpbd");
}

// A thousand bodies of 900 particles: memory grows by a state and a small head for each, and by nothing else.
static int64_t bytes_alive;
static void* counting_get(void* ctx, size_t size, size_t align) {
    (void)ctx;
    size_t* p = aligned_alloc(64, (size + 64 + 63) / 64 * 64);
    assert_true(align <= 64);
    if (!p) return NULL;
    *p = size;
    bytes_alive += (int64_t)size;
    return (char*)p + 64;
}
static void counting_free(void* ctx, void* ptr) {
    (void)ctx;
    if (!ptr) return;
    size_t* p = (size_t*)(void*)((char*)ptr - 64);
    bytes_alive -= (int64_t)*p;
    free(p);
}

static void test_memory(void** state) {
    (void)state;
    const OmAllocator counting = {counting_get, counting_free, NULL};
    enum { N = 1000 };
    OmScene scene = sheet("pbd");
    OmSite site;
    OmBodyModel* model;
    OmBodyWork* work[2];
    static OmBody* body[N];
    static OmStatus status[N];
    scene.tissue.cells = om_vec3(29, 14, 1);  // 30 x 15 x 2 vertices
    scene.tissue.world_cells = om_vec3(29, 30, 2);
    om_allocator_set(&counting);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_int_equal(site.mesh.nvert, 900);
    assert_ok(om_body_model_create(&scene, &site, 1, &model));
    for (int w = 0; w < 2; ++w) assert_ok(om_body_work_create(model, &work[w]));
    int64_t before = bytes_alive;
    for (int k = 0; k < N; ++k) assert_ok(om_body_create_shared(model, NULL, &body[k]));
    double each = (double)(bytes_alive - before) / N;
    size_t size = om_body_state_size(body[0]);
    assert_true(om_body_step_many(N, body, 2, work, 0.02, status) >= 0);
    double grown = (double)(bytes_alive - before) / N - each;
    printf(
        "a body of 900 particles: %.0f bytes, its snapshot %zu; a step of all adds %.0f bytes each\n",
        each, size, grown);
    assert_true(each >= (double)size && each < (double)size + 256);
    assert_below(grown, 64);
    uint64_t hash = om_body_hash(body[0]);
    for (int k = 0; k < N; ++k) {
        assert_true(om_body_hash(body[k]) == hash);
        om_body_destroy(body[k]);
    }
    for (int w = 0; w < 2; ++w) om_body_work_destroy(work[w]);
    om_body_model_destroy(model);
    om_site_done(&site);
    om_allocator_set(NULL);
}

static OmStatus live(void* ctx) {
    OmScene* scene = ctx;
    OmSite site = {0};
    OmBodyModel* model = NULL;
    OmBodyWork* work = NULL;
    OmBody* body = NULL;
    OmStatus each;
    OmStatus status = om_site_build(scene, OM_SITE_TWIN, NULL, &site);
    if (status == OM_OK) status = om_body_model_create(scene, &site, 1, &model);
    if (status == OM_OK) status = om_body_work_create(model, &work);
    if (status == OM_OK) status = om_body_create_shared(model, NULL, &body);
    if (status == OM_OK) status = om_body_step_many(1, &body, 1, &work, 0.02, &each);
    om_body_destroy(body);
    om_body_work_destroy(work);
    om_body_model_destroy(model);
    om_site_done(&site);
    return status;
}

static void test_failing_allocations_leak_nothing(void** state) {
    (void)state;
    OmScene scene = sheet("fem");
    scene.tissue.cells = om_vec3(5, 5, 1);
    assert_true(test_failing_allocations(live, &scene, test_stride(9)) > 3);
}

// Quadratic elements: the body speaks of the vertices and tetrahedra of its site alone, and its forces sum to those of
// the whole tissue.
static void test_quadratic_body(void** state) {
    (void)state;
    OmScene scene = sheet("fem");
    scene.tissue.element = OM_ELEMENT_QUADRATIC;
    OmSite site;
    OmBody* body;
    OmBodyReport report;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    for (int n = 0; n < 20; ++n) {
        command(body, 1, n);
        assert_true(om_body_step(body, 0.02, &report) >= 0);
    }
    size_t nvert = (size_t)site.mesh.nvert, ntet = (size_t)site.mesh.ntet;
    double *force = om_alloc(3 * (nvert + 1), sizeof *force),
           *ratio = om_alloc(ntet + 1, sizeof *ratio), volume = 0;
    force[3 * nvert] = ratio[ntet] = 12345;  // behind the end
    OmBodyForces whole;
    assert_ok(om_body_get_forces(body, &whole));
    assert_ok(om_body_get_attachment_force(body, force));
    OmVec3 sum = {0, 0, 0};
    for (size_t v = 0; v < nvert; ++v) sum = om_add(sum, om_load3(force, (int)v));
    assert_true(om_norm(whole.attachment) > 1e-3);
    assert_near(om_distance(sum, whole.attachment), 0, 1e-9);
    assert_ok(om_body_get_vertex_forces(body, force));
    assert_true(force[3 * nvert] == 12345);
    assert_ok(om_body_get_measure(body, OM_VOLUME_RATIO, ratio));
    assert_true(ratio[ntet] == 12345);
    for (size_t e = 0; e < ntet; ++e) volume += ratio[e] / (double)ntet;
    assert_near(volume, 1, 0.02);
    om_free(force);
    om_free(ratio);
    om_body_destroy(body);
    om_site_done(&site);
}

// The view of a body has the surface of its own mesh: midpoints alone, left over the ROI where the vertices are a metre
// away, hide a part of it from this view and nothing from the view of the site.
static void test_view_of_midpoints(void** state) {
    (void)state;
    OmScene scene = sheet("fem");
    scene.tissue.element = OM_ELEMENT_QUADRATIC;
    OmSite site;
    OmBody* body;
    OmView* view[2];
    OmVisibility v[2], bare;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    assert_ok(om_view_create(&scene, &site, &view[0]));
    assert_ok(om_view_create_of_body(&scene, body, &view[1]));
    const OmTetMesh* mesh = om_tissue_mesh(om_body_tissue(body));
    assert_true(mesh->nvert > site.mesh.nvert);
    double* x = om_alloc(3 * (size_t)mesh->nvert, sizeof *x);
    memcpy(x, mesh->x, 3 * (size_t)mesh->nvert * sizeof *x);
    for (int k = 0; k < 2; ++k) {  // at rest both hide the same
        assert_ok(om_view_look(view[k], NULL, &bare));
        assert_ok(om_view_look(view[k], x, &v[k]));
        assert_true(v[k].nseen < bare.nseen);
    }
    assert_int_equal(v[0].nseen, v[1].nseen);
    for (int i = 0; i < site.mesh.nvert; ++i) x[3 * i + 2] -= 1;  // below the board
    for (int k = 0; k < 2; ++k) assert_ok(om_view_look(view[k], x, &v[k]));
    assert_int_equal(v[0].nseen, bare.nseen);
    assert_true(v[1].nseen < bare.nseen);
    om_free(x);
    for (int k = 0; k < 2; ++k) om_view_destroy(view[k]);
    om_body_destroy(body);
    om_site_done(&site);
}

// A ball pressed on the middle of a sheet on its board: at rest the forces from outside add up to nothing, and the
// report of the press has what the vertices of the upper side feel.
static void test_a_probe_presses_a_body(void** unused) {
    (void)unused;
    OmScene scene = sheet("fem");
    OmSite site;
    OmBody* body;
    OmProbe* probe;
    OmPress* press;
    OmBodyReport report;
    OmBodyForces now;
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &body));
    (void)om_body_settle(body, 0.02, 1e-3, 2);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.02;
    assert_ok(om_probe_create(&shape, &probe));
    OmPressDef def = om_press_default_def(probe);
    def.has_face_contact = true;
    assert_ok(om_press_create(&def, om_body_tissue(body), &press));
    const double top = 2 * site.half_size.z + shape.radius;
    OmPose pose = site.pose_world_task;
    pose.p = om_pose_apply(site.pose_world_task, om_vec3(0, 0, top));
    assert_ok(om_press_move(press, pose));
    assert_ok(om_body_set_press(body, press));
    for (int n = 1; n <= 30; ++n) {
        pose.p = om_pose_apply(site.pose_world_task, om_vec3(0, 0, top - fmin(n, 10) * 1e-4));
        assert_ok(om_press_move(press, pose));
        assert_true(om_body_step(body, 0.02, &report) >= 0);
    }
    const double force = om_press_report(press)->force.z;  // on the ball, upwards
    assert_true(force > 0.05);
    assert_ok(om_body_get_forces(body, &now));
    assert_near(now.contact.z + now.attachment.z + now.weight.z, 0, 0.02 * force);
    // the board touches the vertices below, the ball those above
    double above = 0;
    const OmMeshSet* set = om_tet_mesh_find_set(&site.mesh, "top");
    for (int k = 0; k < set->nvert; ++k) above += om_body_contact_force(body)[3 * set->vert[k] + 2];
    assert_near(above, -force, 1e-6 * force);
    assert_ok(om_body_set_press(body, NULL));
    assert_true(om_body_step(body, 0.02, &report) >= 0);
    assert_true(om_body_x(body)[2] == om_body_x(body)[2]);
    om_press_destroy(press);
    om_body_destroy(body);
    snprintf(scene.tissue.engine, sizeof scene.tissue.engine, "pbd");
    assert_ok(om_body_create(&scene, &site, 1, &body));
    assert_ok(om_press_create(&def, om_body_tissue(body), &press));
    assert_status(om_body_set_press(body, press), OM_UNAVAILABLE);
    assert_ok(om_body_set_press(body, NULL));
    om_press_destroy(press);
    om_probe_destroy(probe);
    om_body_destroy(body);
    om_site_done(&site);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_parallel_is_alone),
                                       cmocka_unit_test(test_quadratic_body),
                                       cmocka_unit_test(test_view_of_midpoints),
                                       cmocka_unit_test(test_a_probe_presses_a_body),
                                       cmocka_unit_test(test_memory),
                                       cmocka_unit_test(test_failing_allocations_leak_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
