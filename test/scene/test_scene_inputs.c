// The ways into a model: attachments in words, one organ under several headers and in every mesh format.
#include "omentum/scene_model.h"
#include "omentum/shape_file.h"
#include "test_common.h"

// ---- attachments in words -----------------------------------------------------------------------------

static void test_attachments_in_words(void** unused) {
    (void)unused;
    static const struct {
        const char *text, *face, *direction;
        double share;
        uint64_t seed;
    } good[] = {{"border", "border", "", 1, 1},
                {"top:medial", "top", "medial", 1, 1},
                {"border:medial 25 %", "border", "medial", 0.25, 1},
                {"border:medial 25%", "border", "medial", 0.25, 1},
                {"underside:random 10% seed 3", "underside", "random", 0.1, 3},
                {"underside: random seed 7 12.5", "underside", "random", 0.125, 7},
                {"border:0/-1/0.5 100%", "border", "0,-1,0.5", 1, 1}};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        OmAttachDef a;
        assert_ok(om_model_parse_attach(good[i].text, &a));
        assert_string_equal(a.face, good[i].face);
        assert_string_equal(a.direction, good[i].direction);
        assert_near(a.share, good[i].share, 1e-15);
        assert_int_equal(a.seed, good[i].seed);
    }
    static const struct {
        const char *text, *said;
    } bad[] = {{"", "is no face"},
               {"boarder:medial", "did you mean \"border\""},
               {"border:", "nothing follows the colon"},
               {"border:medial 0%", "share 0 %"},
               {"border:medial 120 %", "share 120 %"},
               {"border:medial nan", "is not a number"},
               {"border:medial half", "\"half\" is not a number"},
               {"border:random 10% seed", "seed needs a number"},
               {"border:random 10% seed 1.5", "seed 1.5"},
               {"border:random 10% seed -1", "seed -1"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        OmAttachDef a;
        assert_status(om_model_parse_attach(bad[i].text, &a), OM_INVALID);
        if (!strstr(om_error_message(), bad[i].said))
            fail_msg("\"%s\" is told \"%s\"", bad[i].text, om_error_message());
    }
    char text[300] = "border:";
    memset(text + 7, 'm', 200);
    OmAttachDef a;
    assert_status(om_model_parse_attach(text, &a), OM_INVALID);
    text[100] = 0;  // fits the words, not the direction
    assert_status(om_model_parse_attach(text, &a), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "too long"));
}

// ---- one organ, many files ----------------------------------------------------------------------------

static char folder[64];

static const char* in_folder(const char* name) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

// A bean of 60 mm, which no symmetry maps to itself.
static bool bean_holds(OmVec3 p) {
    double y = p.y - 8 * p.x * p.x, z = p.z + 0.2 * p.x;
    return p.x * p.x / 9e-4 + y * y / 2.2e-4 + z * z / 3.2e-4 < 1 - 6 * p.x;
}

static void bean_volume(OmMat3 axis, int nx, int ny, int nz, OmVolume* v) {
    assert_ok(om_volume_init(v, nx, ny, nz));
    v->grid.axis = axis;
    OmVec3 half = om_vec3(-0.5 * (nx - 1), -0.5 * (ny - 1), -0.5 * (nz - 1));
    v->grid.origin = om_mat3_apply(axis, half);
    for (int k = 0, n = 0; k < nz; k++) {
        for (int j = 0; j < ny; j++) {
            for (int i = 0; i < nx; i++, n++) {
                OmVec3 p = om_add(v->grid.origin, om_mat3_apply(axis, om_vec3(i, j, k)));
                ((float*)v->voxel)[n] = bean_holds(p) ? 1.0f : 0.0f;
            }
        }
    }
}

static void bean_model(const OmVolume* v, double edge, OmPatient* p) {
    OmModelDef def = om_model_default_def("bean", edge);
    def.has_bending_test = false;
    OmModelReport r;
    assert_ok(om_model_build_volume(&def, v, NULL, p, &r));
    assert_below(r.volume_error, 0.002);
}

static OmVec3 centroid(const OmTetMesh* mesh) {
    OmVec3 sum = om_vec3(0, 0, 0);
    double volume = 0;
    for (int e = 0; e < mesh->ntet; e++) {
        OmVec3 x[4];
        for (int c = 0; c < 4; c++) x[c] = om_load3(mesh->x, mesh->tet_vert[4 * e + c]);
        double w = om_dot(om_cross(om_sub(x[1], x[0]), om_sub(x[2], x[0])), om_sub(x[3], x[0])) / 6;
        OmVec3 mid = om_scale(0.25, om_add(om_add(x[0], x[1]), om_add(x[2], x[3])));
        sum = om_madd(sum, w, mid);
        volume += w;
    }
    return om_scale(1 / volume, sum);
}

// Mean distance of the boundary of one mesh to that of another.
static double apart(const OmTetMesh* a, const OmTetMesh* b) {
    OmSurface sa, sb;
    OmSdf sdf;
    OmSdfDef def = om_sdf_default_def(0.001);
    def.margin = 0.01;
    assert_ok(om_tet_mesh_boundary(a, &sa, NULL));
    assert_ok(om_tet_mesh_boundary(b, &sb, NULL));
    assert_ok(om_sdf_from_surface(&sb, &def, &sdf));
    double sum = 0;
    for (int v = 0; v < sa.nvert; v++) sum += fabs(om_sdf_eval(&sdf, om_load3(sa.x, v), NULL));
    sum /= sa.nvert;
    om_sdf_done(&sdf);
    om_surface_done(&sa);
    om_surface_done(&sb);
    return sum;
}

// Voxels of 1 mm, of 1 x 1.5 x 3 mm, turned by an oblique header, and left-handed: one organ in space.
static void test_one_organ_under_four_headers(void** unused) {
    (void)unused;
    OmMat3 turn = om_quat_to_mat3(om_quat_axis_angle(om_normalize(om_vec3(1, 2, 3)), 0.7));
    OmMat3 thick = om_mat3_diag(om_vec3(0.001, 0.0015, 0.003));
    const OmMat3 axis[] = {om_mat3_scale(0.001, om_mat3_identity()), thick,
                           om_mat3_mul(turn, thick), om_mat3_diag(om_vec3(-0.001, -0.0015, 0.003))};
    OmPatient straight = {0}, p;
    for (int h = 0; h < 4; h++) {
        OmVolume v;
        bean_volume(axis[h], h ? 100 : 90, h ? 66 : 80, h ? 34 : 60, &v);
        bean_model(&v, 0.004, h ? &p : &straight);
        om_volume_done(&v);
        if (h == 0) continue;
        double shift = om_distance(centroid(&p.mesh), centroid(&straight.mesh));
        double mean = apart(&p.mesh, &straight.mesh);
        printf("header %d: centroid %.3f mm, boundary %.3f mm from the first, volume %+.2f %%\n", h,
               shift * 1e3, mean * 1e3,
               100 * (om_tet_mesh_volume(&p.mesh) / om_tet_mesh_volume(&straight.mesh) - 1));
        assert_below(shift, 0.0003);  // a tenth of the thickest slice
        assert_below(mean, 0.0006);   // a fifth of it: what its voxels leave open
        om_patient_done(&p);
    }
    om_patient_done(&straight);
}

// Volume meshes are used without remeshing; all surfaces hold the same triangles, so they give the same mesh.
static void test_one_organ_in_every_format(void** unused) {
    (void)unused;
    static const struct {
        const char* file;
        OmMeshFormat format;
    } solid[] = {{"a.msh", OM_MESH_MSH41},     {"b.msh", OM_MESH_MSH22},
                 {"a.vtk", OM_MESH_VTK},       {"a.vtu", OM_MESH_VTU},
                 {"b.vtk", OM_MESH_VTK_ASCII}, {"b.vtu", OM_MESH_VTU_ASCII}};
    static const char* const skin[] = {"a.ply", "a.obj", "a.off", "a.stl"};
    OmVolume v;
    OmPatient p, q;
    OmSurface s;
    bean_volume(om_mat3_scale(0.0015, om_mat3_identity()), 60, 54, 40, &v);
    bean_model(&v, 0.005, &p);
    om_volume_done(&v);
    for (size_t i = 0; i < sizeof solid / sizeof *solid; i++) {
        const char* path = in_folder(solid[i].file);
        OmModelDef def = om_model_default_def(path, 0.005);
        def.has_bending_test = false;
        assert_ok(om_tet_mesh_save_format(&p.mesh, path, OM_UNIT_MM, solid[i].format, NULL, 0));
        assert_ok(om_model_build(&def, NULL, &q, NULL));
        assert_int_equal(q.mesh.nvert, p.mesh.nvert);
        assert_int_equal(q.mesh.ntet, p.mesh.ntet);
        assert_memory_equal(q.mesh.tet_vert, p.mesh.tet_vert,
                            sizeof(int) * 4 * (size_t)p.mesh.ntet);
        for (int n = 0; n < 3 * p.mesh.nvert; n++)
            assert_near(q.mesh.x[n], p.mesh.x[n], 1e-15);  // m to mm and back: one rounding each
        om_patient_done(&q);
    }
    assert_ok(om_tet_mesh_boundary(&p.mesh, &s, NULL));
    for (size_t i = 0; i < sizeof skin / sizeof *skin; i++) {
        const char* path = in_folder(skin[i]);
        OmModelDef def = om_model_default_def(path, 0.005);
        def.has_bending_test = false;
        assert_ok(om_surface_save(&s, path, OM_UNIT_MM));
        assert_ok(om_model_build(&def, NULL, &q, NULL));
        double mean = apart(&q.mesh, &p.mesh);
        printf("%s: volume %+.3f %%, %.3f mm apart\n", skin[i],
               100 * (om_tet_mesh_volume(&q.mesh) / om_tet_mesh_volume(&p.mesh) - 1), mean * 1e3);
        assert_near_rel(om_tet_mesh_volume(&q.mesh), om_tet_mesh_volume(&p.mesh), 0.005);
        assert_below(mean, 0.0003);  // flat triangles through a field of 2.5 mm
        om_patient_done(&q);
    }
    om_surface_done(&s);
    om_patient_done(&p);
}

static int make_folder(void** unused) {
    (void)unused;
    snprintf(folder, sizeof folder, "/tmp/omentum_inputs_XXXXXX");
    return mkdtemp(folder) ? 0 : 1;
}
static int remove_folder(void** unused) {
    (void)unused;
    return om_path_remove(folder) == OM_OK ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_attachments_in_words),
        cmocka_unit_test(test_one_organ_under_four_headers),
        cmocka_unit_test(test_one_organ_in_every_format),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
