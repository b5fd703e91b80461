// Patient models as folders: what is written comes back, and what is damaged is named.
#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "omentum/scene.h"
#include "omentum/scene_model.h"
#include "omentum/shape_file.h"
#include "test_alloc.h"
#include "test_common.h"

static char folder[64];  // of this run, emptied at its end

static const char* in_folder(const char* name) {
    static char path[4][512];
    static int next;
    char* p = path[next++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    return p;
}

// Entries of the folder that a killed or failed run may leave.
static int count_hidden(void) {
    int n = 0;
    DIR* dir = opendir(folder);
    assert_non_null(dir);
    for (struct dirent* e; (e = readdir(dir)) != NULL;)
        n += strncmp(e->d_name, ".omentum-", 9) == 0;
    closedir(dir);
    return n;
}

// Fat over a ball of 25 mm, held at its border and at a random patch.
static void ball_patient(double edge, OmPatient* p, OmModelReport* r) {
    enum { N = 28 };
    OmVolume v;
    assert_ok(om_volume_init(&v, N, N, N));
    v.grid.axis = om_mat3_scale(0.0025, om_mat3_identity());
    v.grid.origin = om_vec3(-0.07, -0.035, -0.035);
    for (int n = 0; n < N * N * N; n++) {
        OmVec3 c = om_vec3(n % N - 13.5, n / N % N - 13.5, n / N / N - 13.5);
        ((float*)v.voxel)[n] = om_norm(c) < 10 ? 2 : 0;
    }
    OmModelDef def = om_model_default_def("ball.nrrd", edge);
    def.sheet.thickness = 0.008;
    def.sheet.keep_edge = def.allow_loss = true;  // any mesh will do
    def.sheet.nroi = 50;
    def.sheet.attach[0] = (OmAttachDef){"border", "medial", 0.3, 0};
    def.sheet.attach[1] = (OmAttachDef){"underside", "random", 0.1, 4};
    def.sheet.nattach = 2;
    assert_ok(om_model_build_volume(&def, &v, NULL, p, r));
    om_volume_done(&v);
}

// ---- round trips --------------------------------------------------------------------------------------

static void assert_same_mesh(const OmTetMesh* a, const OmTetMesh* b) {
    assert_int_equal(a->nvert, b->nvert);
    assert_int_equal(a->ntet, b->ntet);
    assert_int_equal(a->nset, b->nset);
    assert_memory_equal(a->x, b->x, sizeof *a->x * 3 * (size_t)a->nvert);
    assert_memory_equal(a->tet_vert, b->tet_vert, sizeof *a->tet_vert * 4 * (size_t)a->ntet);
    assert_memory_equal(a->tet_label, b->tet_label, sizeof *a->tet_label * (size_t)a->ntet);
    for (int s = 0; s < a->nset; s++) {
        const OmMeshSet* set = om_tet_mesh_find_set(b, a->set[s].name);
        assert_non_null(set);
        assert_int_equal(a->set[s].nvert, set->nvert);
        assert_memory_equal(a->set[s].vert, set->vert, sizeof(int) * (size_t)set->nvert);
    }
}

static void test_round_trip(void** unused) {
    (void)unused;
    OmPatient p, q;
    OmModelReport r;
    ball_patient(1e-3 * test_count(8, 6), &p, &r);
    snprintf(p.name, sizeof p.name, "fat \"over\": a \\ ball # \xc3\xa9");
    p.material[1] = (OmPatientMaterial){"gland, soft", 29, 15000, 0.49, 1020};
    p.nmaterial = 2;
    for (int e = 0; e < p.mesh.ntet; e += 3) p.mesh.tet_label[e] = 29;
    assert_ok(om_patient_save(&p, &r, in_folder("round")));
    assert_ok(om_patient_load(in_folder("round/patient.yaml"), &q));
    assert_same_mesh(&p.mesh, &q.mesh);
    assert_string_equal(p.name, q.name);
    assert_int_equal(q.nmaterial, 2);
    for (int i = 0; i < 2; i++) {
        assert_string_equal(p.material[i].name, q.material[i].name);
        assert_int_equal(p.material[i].label, q.material[i].label);
        assert_near(p.material[i].young, q.material[i].young, 0);
        assert_near(p.material[i].poisson, q.material[i].poisson, 1e-9);  // nine digits are written
        assert_near(p.material[i].density, q.material[i].density, 0);
    }
    assert_int_equal(p.organ.nvert, q.organ.nvert);
    assert_int_equal(p.organ.ntri, q.organ.ntri);
    for (int v = 0; v < p.organ.nvert; v++) {
        double d = om_distance(om_load3(p.organ.x, v), om_load3(q.organ.x, v));
        assert_near(d, 0, 1e-8);  // float coordinates in PLY at most
    }
    assert_int_equal(p.nroi, q.nroi);
    for (int i = 0; i < p.nroi; i++) {
        assert_near(om_distance(om_load3(p.roi_point, i), om_load3(q.roi_point, i)), 0, 1e-9);
        assert_near(om_distance(om_load3(p.roi_normal, i), om_load3(q.roi_normal, i)), 0, 1e-8);
    }
    assert_near(om_distance(p.roi_center, q.roi_center), 0, 1e-9);
    assert_near(p.roi_radius, q.roi_radius, 1e-9);
    assert_near(p.organ_spacing, q.organ_spacing, 1e-9);
    assert_near(om_distance(p.up, q.up), 0, 1e-8);
    om_patient_done(&q);
    p.file_space = OM_SPACE_LPS;  // other numbers in the files, which say so: the same patient
    assert_ok(om_patient_save(&p, &r, in_folder("round")));
    OmTetMesh raw;
    const OmMeshFrame as_ras = {OM_UNIT_M, OM_SPACE_RAS};
    assert_ok(om_tet_mesh_load_frame(in_folder("round/tissue.vtu"), as_ras, 0, &raw, NULL));
    assert_near(raw.x[0], -p.mesh.x[0], 0);
    assert_near(raw.x[1], -p.mesh.x[1], 0);
    assert_near(raw.x[2], p.mesh.x[2], 0);
    om_tet_mesh_done(&raw);
    assert_ok(om_patient_load(in_folder("round/patient.yaml"), &q));
    assert_same_mesh(&p.mesh, &q.mesh);
    assert_memory_equal(p.organ.x, q.organ.x, 24 * (size_t)p.organ.nvert);
    om_patient_done(&p);
    om_patient_done(&q);
}

// A mesh from elsewhere, with set names that no other program would choose.
static void test_mesh_without_organ(void** unused) {
    (void)unused;
    OmPatient p = {.name = "box", .up = {0, 0, 1}, .nmaterial = 1}, q;
    p.material[0] = (OmPatientMaterial){"silicone", -1, 27040, 0.4287, 1070};
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.1, 0.1, 0.01), 3, 3, 1, &p.mesh));
    const int vert[] = {0, 3, 5};
    assert_ok(om_tet_mesh_add_set(&p.mesh, "fixed end", vert, 3));
    assert_ok(om_tet_mesh_add_set(&p.mesh, "a \"b\": c", vert, 2));
    assert_ok(om_patient_save(&p, NULL, in_folder("box/")));
    assert_ok(om_patient_load(in_folder("box/patient.yaml"), &q));
    assert_same_mesh(&p.mesh, &q.mesh);
    assert_int_equal(q.organ.nvert, 0);
    assert_int_equal(q.nroi, 0);
    assert_false(om_path_exists(in_folder("box/report.json")));
    om_patient_done(&p);
    om_patient_done(&q);
}

// What was saved becomes an operating site; the world's mesh is finer and held at the same places.
static void test_site_of_a_saved_model(void** unused) {
    (void)unused;
    static const char text[] =
        "name: ball\ntissue: {source: patient, file: round/patient.yaml, view: [0, 0, -1]}\n"
        "attachments: {kind: set}\n";
    OmScene scene;
    OmSite twin, world;
    OmPatient p;
    assert_ok(om_scene_parse(text, sizeof text - 1, "ball.yaml", &scene));
    snprintf(scene.data_root, sizeof scene.data_root, "%s", folder);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &twin));
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &world));
    assert_ok(om_patient_load(in_folder("round/patient.yaml"), &p));
    for (int e = 0; e < p.mesh.ntet; e++)  // the site's labels are indices of materials
        p.mesh.tet_label[e] = p.mesh.tet_label[e] == 29;
    assert_same_mesh(&p.mesh, &twin.mesh);
    assert_true(twin.has_organ && world.has_organ);
    assert_int_equal(twin.nroi, p.nroi);
    assert_int_equal(world.mesh.nvert, 2 * p.mesh.nvert);
    const OmMeshSet* held = om_tet_mesh_find_set(&world.mesh, "attachment");
    assert_true(held && held->nvert >= om_tet_mesh_find_set(&p.mesh, "attachment")->nvert);
    om_site_done(&twin);
    om_site_done(&world);
    om_patient_done(&p);
}

static void assert_material(const OmSite* site, int label, double young, double poisson,
                            double density) {
    OmSiteMaterial m = om_site_get_material(site, label);
    assert_near_rel(m.young, young, 1e-12);
    assert_near(m.poisson, poisson, 1e-9);  // nine digits are written
    assert_near_rel(m.density, density, 1e-12);
}

// A scene that says nothing of modulus, ratio and density does not change the patient's materials; what it says
// is the first one's, and the others keep their ratio.
static void test_site_keeps_materials(void** unused) {
    (void)unused;
    static const char own[] =
        "name: ball\ntissue: {source: patient, file: round/patient.yaml, view: [0, 0, -1]}\n"
        "attachments: {kind: set}\nworld: {young_factor: 0.5, density_factor: 1.5}\n";
    static const char given[] =
        "name: ball\ntissue: {source: patient, file: round/patient.yaml, view: [0, 0, -1],\n"
        "  young: 6000, poisson: 0.4, density: 460}\nattachments: {kind: set}\n";
    OmScene scene;
    OmSite site;
    assert_ok(om_scene_parse(own, sizeof own - 1, "ball.yaml", &scene));
    snprintf(scene.data_root, sizeof scene.data_root, "%s", folder);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_int_equal(site.nmaterial, 2);
    assert_string_equal(om_site_get_material(&site, 1).name, "gland, soft");
    assert_material(&site, 0, 3000, 0.45, 920);
    assert_material(&site, 1, 15000, 0.49, 1020);
    om_site_done(&site);
    assert_ok(om_site_build(&scene, OM_SITE_WORLD, NULL, &site));
    assert_material(&site, 0, 1500, 0.45, 1380);
    assert_material(&site, 1, 7500, 0.49, 1530);
    om_site_done(&site);
    assert_ok(om_scene_parse(given, sizeof given - 1, "ball.yaml", &scene));
    snprintf(scene.data_root, sizeof scene.data_root, "%s", folder);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_material(&site, 0, 6000, 0.4, 460);
    assert_material(&site, 1, 30000, 0.4, 510);
    om_site_done(&site);
}

// ---- damage --------------------------------------------------------------------------------------------------

// patient.yaml of `box` or `round` with one text replaced, as other.yaml beside it; loading it must fail so.
static void assert_damage(const char* model, const char* from, const char* to, const char* said) {
    char path[128], *text;
    size_t size;
    OmPatient p;
    OmText t = {0};
    snprintf(path, sizeof path, "%s/patient.yaml", model);
    assert_ok(om_file_read(in_folder(path), 1 << 20, &text, &size));
    char* at = strstr(text, from);
    assert_non_null(at);
    assert_ok(om_text_append_raw(&t, text, (size_t)(at - text)));
    assert_ok(om_text_append(&t, "%s%s", to, at + strlen(from)));
    snprintf(path, sizeof path, "%s/other.yaml", model);
    assert_ok(om_file_write(in_folder(path), t.str, t.len));
    om_free(text);
    om_text_done(&t);
    OmStatus status = om_patient_load(in_folder(path), &p);
    if (status >= 0 || !strstr(om_error_message(), said))
        fail_msg("%s instead of %s: status %d, \"%s\"", to, from, (int)status, om_error_message());
    if (!strstr(om_error_message(), model)) fail_msg("no file in \"%s\"", om_error_message());
    assert_null(p.mesh.x);
    assert_null(p.roi_point);
}

static void test_damaged_yaml(void** unused) {
    (void)unused;
    assert_damage("box", "young:", "yuong:", "young");
    assert_damage("box", "27040", "soft", "young");
    assert_damage("box", "27040", "-3", "young");
    assert_damage("box", "0.4287", "0.5", "poisson");
    assert_damage("box", "27040", ".nan", "young");
    assert_damage("box", "mesh: tissue.vtu", "mesh: nothing.vtu", "nothing.vtu");
    assert_damage("box", "mesh: tissue.vtu", "# no mesh", "mesh");
    assert_damage("box", "mesh: tissue.vtu", "mesh: patient.yaml", "patient.yaml");
    assert_damage("box", "up: [0, 0, 1]", "up: [0, 0, 0]", "up");
    assert_damage("box", "up: [0, 0, 1]", "up: [0, 0]", "up");
    assert_damage("box", "up: [0, 0, 1]", "up: [0, 0, 1", "not valid YAML");
    assert_damage("box", "label: -1", "label: 4", "no material for label 0");
    assert_damage("box", "fixed end", "free end", "tissue.vtu has no set \"free end\"");
    assert_damage("box", "vertices: 3", "vertices: 4", "\"fixed end\" has 3 vertices");
    assert_damage("round", "organ: organ.ply", "organ: patient.yaml", "patient.yaml");
    assert_damage("round", "point_mm: [-", "point_mm: [", "from the organ");
    assert_damage("round", "normal: [", "normal: [0, 0, 0]} #", "normal");
    OmPatient p;
    assert_status(om_patient_load(in_folder("none/patient.yaml"), &p), OM_IO);
    assert_status(om_patient_load(folder, &p), OM_IO);
}

static void test_damaged_files(void** unused) {
    (void)unused;
    static const char* const name[] = {"round/tissue.vtu", "round/organ.ply"};
    for (int f = 0; f < 2; f++) {
        char* data;
        size_t size;
        OmPatient p;
        assert_ok(om_file_read(in_folder(name[f]), 1 << 24, &data, &size));
        for (size_t cut = 0; cut + 40 < size; cut += size / 23) {
            assert_ok(om_file_write(in_folder(name[f]), data, cut));
            OmStatus status = om_patient_load(in_folder("round/patient.yaml"), &p);
            if (status >= 0 || !strstr(om_error_message(), name[f]))
                fail_msg("%s cut at %zu: status %d, \"%s\"", name[f], cut, (int)status,
                         om_error_message());
            assert_null(p.mesh.x);
        }
        assert_ok(om_file_write(in_folder(name[f]), data, size));
        assert_ok(om_patient_load(in_folder("round/patient.yaml"), &p));
        if (f == 1) {  // a hole in the organ
            p.organ.ntri--;
            assert_ok(om_surface_save(&p.organ, in_folder(name[f]), 1));
            p.organ.ntri++;
            om_patient_done(&p);
            assert_status(om_patient_load(in_folder("round/patient.yaml"), &p), OM_INVALID);
            assert_non_null(strstr(om_error_message(), "organ"));
            assert_ok(om_file_write(in_folder(name[f]), data, size));
        } else {
            om_patient_done(&p);
        }
        om_free(data);
    }
}

// ---- whole or not at all -----------------------------------------------------------------------------------

// No file may grow beyond `limit` bytes, as on a full disk: the older model does not change.
static void test_full_disk(void** unused) {
    (void)unused;
    OmPatient p, q;
    OmModelReport r;
    assert_ok(om_patient_load(in_folder("round/patient.yaml"), &q));
    assert_ok(om_patient_save(&q, NULL, in_folder("older")));
    om_patient_done(&q);
    ball_patient(0.007, &p, &r);
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit whole, less;
    getrlimit(RLIMIT_FSIZE, &whole);
    for (rlim_t limit = 0; limit < 8000; limit += 1000) {
        less = (struct rlimit){limit, whole.rlim_max};
        setrlimit(RLIMIT_FSIZE, &less);
        OmStatus fresh = om_patient_save(&p, &r, in_folder("full"));
        char message[512];
        snprintf(message, sizeof message, "%s", om_error_message());
        OmStatus over = om_patient_save(&p, &r, in_folder("older"));
        setrlimit(RLIMIT_FSIZE, &whole);
        if (fresh != OM_IO || !strstr(message, "/full/") || !strstr(message, "File too large"))
            fail_msg("at %d bytes: status %d, \"%s\"", (int)limit, (int)fresh, message);
        assert_int_equal(over, OM_IO);
        assert_false(om_path_exists(in_folder("full")));
        assert_int_equal(count_hidden(), 0);
        assert_ok(om_patient_load(in_folder("older/patient.yaml"), &q));
        assert_true(q.mesh.nvert != p.mesh.nvert);
        om_patient_done(&q);
    }
    om_patient_done(&p);
}

static void test_folders(void** unused) {
    (void)unused;
    OmPatient p, q;
    assert_ok(om_patient_load(in_folder("box/patient.yaml"), &p));
    // folders of these names are the user's
    assert_ok(om_path_make_dir(in_folder("again.partial")));
    assert_ok(om_path_make_dir(in_folder("again.old")));
    assert_ok(om_file_write(in_folder("again.partial/tissue.vtu"), "<", 1));
    assert_ok(om_patient_save(&p, NULL, in_folder("again")));
    assert_ok(om_patient_save(&p, NULL, in_folder("again")));
    assert_true(om_path_exists(in_folder("again.partial/tissue.vtu")));
    assert_true(om_path_exists(in_folder("again.old")));
    assert_int_equal(count_hidden(), 0);
    assert_ok(om_patient_load(in_folder("again/patient.yaml"), &q));
    om_patient_done(&q);
    // a folder of something else is not touched
    assert_ok(om_path_make_dir(in_folder("mine")));
    assert_ok(om_file_write(in_folder("mine/notes.txt"), "x", 1));
    assert_status(om_patient_save(&p, NULL, in_folder("mine")), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "holds notes.txt and no list"));
    assert_true(om_path_exists(in_folder("mine/notes.txt")));
    assert_status(om_patient_save(&p, NULL, in_folder("mine/notes.txt")), OM_IO);
    assert_status(om_patient_save(&p, NULL, in_folder("mine/notes.txt/model")), OM_IO);
    assert_status(om_patient_save(&p, NULL, ""), OM_INVALID);
    om_patient_done(&p);
}

// ---- every allocation failing in turn --------------------------------------------------------------------

static OmStatus load_box(void* ctx) {
    OmPatient p;
    OmStatus status = om_patient_load(ctx, &p);
    if (status == OM_OK) om_patient_done(&p);
    return status;
}

typedef struct SaveTask {
    OmPatient patient;
    OmModelReport report;
    bool has_report;
} SaveTask;

static OmStatus save_task(void* ctx) {
    SaveTask* task = ctx;
    OmStatus status = om_patient_save(&task->patient, task->has_report ? &task->report : NULL,
                                      in_folder("scarce"));
    assert_true(status == OM_OK || !om_path_exists(in_folder("scarce")));
    assert_false(om_path_exists(in_folder("scarce.partial")));
    return status;
}

static void test_scarce_memory(void** unused) {
    (void)unused;
    SaveTask task;
    char path[512];
    ball_patient(0.01, &task.patient, &task.report);
    assert_ok(om_patient_save(&task.patient, NULL, in_folder("ball")));
    snprintf(path, sizeof path, "%s", in_folder("ball/patient.yaml"));
    int nload = test_failing_allocations(load_box, path, test_stride(9));
    task.has_report = false;
    int nsave = test_failing_allocations(save_task, &task, test_stride(5));
    assert_ok(om_path_remove(in_folder("scarce")));
    task.has_report = true;  // pictures take a while: not every allocation
    (void)test_failing_allocations(save_task, &task, test_is_slow() ? 9 : 1000);
    om_patient_done(&task.patient);
    assert_true(nload > 2 && nsave > 2);
}

static int make_folder(void** unused) {
    (void)unused;
    snprintf(folder, sizeof folder, "/tmp/omentum_patient_XXXXXX");
    return mkdtemp(folder) ? 0 : 1;
}
static int remove_folder(void** unused) {
    (void)unused;
    return om_path_remove(folder) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        // in this order: the first two write what the others damage
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_mesh_without_organ),
        cmocka_unit_test(test_site_of_a_saved_model),
        cmocka_unit_test(test_site_keeps_materials),
        cmocka_unit_test(test_damaged_yaml),
        cmocka_unit_test(test_damaged_files),
        cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_folders),
        cmocka_unit_test(test_scarce_memory),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
