// A model of a label holds all of it, or says what it lost: the labels of doc/scene.md, each with parts that are
// thinner than an edge, then random ones, and noise.
#include "omentum/scene_model.h"
#include "test_common.h"

#define MM 1e-3

static OmVolume empty(int nx, int ny, int nz) {  // voxels of 1 mm
    OmVolume v;
    assert_ok(om_volume_init(&v, nx, ny, nz));
    v.grid.axis = om_mat3_diag(om_vec3(MM, MM, MM));
    return v;
}

static void fill(OmVolume* v, int x0, int y0, int z0, int x1, int y1, int z1) {
    for (int k = z0; k < z1; k++)
        for (int j = y0; j < y1; j++)
            for (int i = x0; i < x1; i++)
                ((float*)v->voxel)[om_grid_index(v->grid.dim, i, j, k)] = 1;
}

static OmModelDef def_of(double edge) {
    OmModelDef def = om_model_default_def("label", edge * MM);
    def.has_bending_test = false;
    return def;
}

// Build, and hold what every model must: nothing lost, distances within one edge, its volume.
static void check(const char* name, const OmModelDef* def, const OmVolume* v, int npart,
                  int nhandle, double volume_error) {
    OmPatient p;
    OmModelReport r;
    assert_ok(om_model_build_volume(def, v, NULL, &p, &r));
    const OmShapeFit* f = &r.fit;
    const double error = om_tet_mesh_volume(&p.mesh) / r.mask_volume - 1;
    printf(
        "%-20s %6d tets, volume %+.2f %%, 95 %% %.2f, %.2f mm, largest %.2f, %.2f, angle %.1f, shift %.2f\n",
        name, p.mesh.ntet, 100 * error, f->to_mesh.p95 / MM, f->to_solid.p95 / MM,
        f->to_mesh.max / MM, f->to_solid.max / MM, r.quality.dihedral_min * 180 / OM_PI,
        r.level_shift / MM);
    assert_true(r.has_fit && !r.has_loss && f->nloss == 0);
    assert_int_equal(f->solid.npart, npart);
    assert_int_equal(f->mesh.npart, npart);
    assert_int_equal(f->solid.nhandle, nhandle);
    assert_int_equal(f->mesh.nhandle, nhandle);
    assert_int_equal(f->mesh.ncavity, f->solid.ncavity);
    assert_below(f->to_mesh.p95, def->edge / 3);
    assert_below(f->to_solid.p95, def->edge / 3);
    assert_below(f->to_mesh.max, def->edge);
    assert_below(f->to_solid.max, def->edge);
    assert_below(fabs(error), volume_error);
    assert_below(fabs(r.level_shift), 0.1 * MM + 1e-12);
    assert_true(r.quality.dihedral_min * 180 / OM_PI > 10);
    om_patient_done(&p);
}

static OmVolume cube_with_handle(void) {
    OmVolume v = empty(36, 28, 26);
    fill(&v, 5, 5, 5, 21, 21, 21);
    fill(&v, 21, 6, 12, 30, 7, 13);
    fill(&v, 29, 6, 12, 30, 18, 13);
    fill(&v, 21, 17, 12, 30, 18, 13);
    return v;
}

static void test_a_handle_of_one_voxel(void** unused) {
    (void)unused;
    OmVolume v = cube_with_handle();
    OmModelDef def = def_of(4);
    check("handle", &def, &v, 1, 1, 0.01);
    if (test_is_slow()) {
        def = def_of(1);
        check("handle", &def, &v, 1, 1, 0.01);
    }
    om_volume_done(&v);
}

// Without finer edges the loss is an error that names the place, or a report where it is allowed.
static void test_a_loss_is_told(void** unused) {
    (void)unused;
    OmVolume v = cube_with_handle();
    OmModelDef def = def_of(4);
    OmPatient p;
    OmModelReport r;
    char text[1024];
    def.refine = false;
    assert_status(om_model_build_volume(&def, &v, NULL, &p, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "mL missing at (29.0, 1"));
    assert_non_null(strstr(om_error_message(), "handles: 1 of the label, 0 of the mesh"));
    assert_null(p.mesh.x);
    def.allow_loss = true;
    assert_ok(om_model_build_volume(&def, &v, NULL, &p, &r));
    assert_true(r.has_loss);
    assert_near(r.fit.loss[0].volume, 28e-9, 4e-9);  // the handle has 28 voxels
    assert_below(fabs(r.level_shift), 1e-12);        // nothing is blown up
    assert_true(om_tet_mesh_volume(&p.mesh) < 4.096e-6);
    assert_non_null(p.gap);
    assert_true(p.missed.ntri > 20);
    om_model_describe_loss(&r, text, sizeof text);
    assert_non_null(strstr(text, "use an edge below 2.4 mm"));
    char cut[24];
    om_model_describe_loss(&r, cut, sizeof cut);
    assert_memory_equal(cut, text, sizeof cut - 1);
    om_patient_done(&p);
    om_volume_done(&v);
}

// A hole and a cavity of one voxel, no deeper than a third of an edge: a mesh without them is a loss, too.
static void test_another_topology_is_a_loss(void** unused) {
    (void)unused;
    static const char* const said[2] = {
        "the mesh is not the label; handles: 1 of the label, 0 of the mesh, near (10.0, 11.0, ",
        "the mesh is not the label; cavities: 1 of the label, 0 of the mesh, near (10.0, 11.0, 18.0) mm"};
    for (int kind = 0; kind < 2; kind++) {
        OmVolume v = empty(24, 24, 24);
        fill(&v, 4, 4, 10, 20, 20, 14);
        if (kind == 1) fill(&v, 4, 4, 4, 20, 20, 20);
        float* voxel = v.voxel;
        for (int k = kind == 0 ? 0 : 18; k < (kind == 0 ? 24 : 19); k++)
            voxel[om_grid_index(v.grid.dim, 10, 11, k)] = 0;
        OmModelDef def = def_of(5);
        def.keep_holes = true;
        if (kind == 0) check("hole", &def, &v, 1, 1, 0.01);
        OmPatient p;
        OmModelReport r;
        def.refine = false;
        assert_status(om_model_build_volume(&def, &v, NULL, &p, &r), OM_INVALID);
        if (!strstr(om_error_message(), said[kind])) fail_msg("%s", om_error_message());
        def.allow_loss = true;
        assert_ok(om_model_build_volume(&def, &v, NULL, &p, &r));
        assert_true(r.has_loss && r.fit.nloss == 0 && r.fit.has_change);
        om_patient_done(&p);
        om_volume_done(&v);
    }
}

static void test_thin_plates_and_stumps(void** unused) {
    (void)unused;
    for (int thick = test_is_slow() ? 1 : 2; thick <= 3; thick++) {
        for (int edge = test_is_slow() ? 2 : 4; edge <= 4; edge += 2) {
            const int side = test_is_slow() ? 60 : 30;
            OmVolume v = empty(side + 6, side + 6, thick + 6);
            fill(&v, 3, 3, 3, side + 3, side + 3, thick + 3);
            OmModelDef def = def_of(edge);
            check("plate", &def, &v, 1, 0, 0.01 + 0.02 * (thick == 3));
            om_volume_done(&v);
        }
    }
    OmVolume v = empty(36, 26, 26);
    fill(&v, 3, 3, 3, 19, 19, 19);
    fill(&v, 19, 10, 10, 31, 13, 13);
    OmModelDef def = def_of(4);
    check("stump", &def, &v, 1, 0, 0.01);
    om_volume_done(&v);
}

static void test_half_shells(void** unused) {
    (void)unused;
    const int radius = test_is_slow() ? 25 : 14, n = 2 * radius + 8;
    OmVolume v = empty(n, n, radius + 10);
    for (int k = 5; k < radius + 10; k++)
        for (int j = 0; j < n; j++)
            for (int i = 0; i < n; i++) {
                const double q = om_norm(om_vec3(i - 0.5 * n, j - 0.5 * n, k - 5));
                if (q <= radius && q > radius - 3) fill(&v, i, j, k, i + 1, j + 1, k + 1);
            }
    OmModelDef def = def_of(4);
    check("half shell", &def, &v, 1, 0, 0.01);
    om_volume_done(&v);
}

// One empty voxel apart, and touching along an edge: apart in the mesh, as voxels are connected over faces.
static void test_parts_stay_apart(void** unused) {
    (void)unused;
    OmVolume v = empty(34, 34, 14);
    fill(&v, 3, 3, 3, 31, 31, 6);
    fill(&v, 3, 3, 7, 31, 31, 10);
    OmModelDef def = def_of(4);
    def.keep_all = true;
    check("two plates", &def, &v, 2, 0, 0.01);
    om_volume_done(&v);
    v = empty(30, 30, 18);
    fill(&v, 4, 4, 4, 14, 14, 14);
    fill(&v, 14, 14, 4, 24, 24, 14);
    def = def_of(4);
    def.connectivity = 26;
    check("two cubes", &def, &v, 2, 0, 0.03);
    om_volume_done(&v);
}

// Random balls, rods of one to three voxels, holes and gaps: the fit of each model is right, or its message tells the
// loss.
static void random_parts(uint64_t index, OmVolume* v) {
    OmRng rng = om_rng_init(353, index);
    *v = empty(34, 34, 34);
    const int nball = 1 + (int)om_rng_below(&rng, 3), nrod = 1 + (int)om_rng_below(&rng, 4);
    float* voxel = v->voxel;
    for (int b = 0; b < nball; b++) {
        const double r = om_rng_range(&rng, 4, 8);
        const OmVec3 c = om_vec3(om_rng_range(&rng, 11, 23), om_rng_range(&rng, 11, 23),
                                 om_rng_range(&rng, 11, 23));
        const bool has_cavity = om_rng_below(&rng, 4) == 0;
        for (int k = 0; k < 34; k++)
            for (int j = 0; j < 34; j++)
                for (int i = 0; i < 34; i++) {
                    const double q = om_distance(om_vec3(i, j, k), c);
                    if (q < r && !(has_cavity && q < 0.4 * r))
                        voxel[om_grid_index(v->grid.dim, i, j, k)] = 1;
                }
    }
    for (int s = 0; s < nrod; s++) {
        const int axis = (int)om_rng_below(&rng, 3), width = 1 + (int)om_rng_below(&rng, 3);
        const int a = 8 + (int)om_rng_below(&rng, 18), b = 8 + (int)om_rng_below(&rng, 18);
        const bool is_hole = om_rng_below(&rng, 3) == 0;
        const int from = 3 + (int)om_rng_below(&rng, 6), to = 24 + (int)om_rng_below(&rng, 7);
        for (int t = from; t < to; t++)
            for (int y = 0; y < width; y++)
                for (int x = 0; x < width; x++) {
                    int at[3];
                    at[axis] = t, at[(axis + 1) % 3] = a + x, at[(axis + 2) % 3] = b + y;
                    voxel[om_grid_index(v->grid.dim, at[0], at[1], at[2])] = is_hole ? 0 : 1;
                }
    }
}

static void test_random_parts(void** unused) {
    (void)unused;
    int nloss = 0, nother = 0;
    const int count = test_count(3, 500);
    for (int index = 0; index < count; index++) {
        OmVolume v;
        OmPatient p;
        OmModelReport r;
        random_parts((uint64_t)index, &v);
        OmModelDef def = def_of(3);
        def.keep_holes = index % 2;
        def.keep_all = true;
        def.allow_loss = true;
        assert_ok(om_model_build_volume(&def, &v, NULL, &p, &r));
        char text[1024];
        om_model_describe_loss(&r, text, sizeof text);
        assert_true(r.has_loss == (text[0] != 0));
        const bool is_equal = om_topology_is_equal(&r.fit.solid, &r.fit.mesh);
        assert_true(r.has_loss || is_equal);
        nother += !is_equal;
        if (!r.has_loss) assert_below(r.fit.to_mesh.max, 3 * MM);
        assert_ok(om_tet_mesh_validate(&p.mesh));
        nloss += r.fit.nloss > 0 || r.fit.solid.npart != r.fit.mesh.npart;
        om_patient_done(&p);
        om_volume_done(&v);
    }
    printf("%d of %d lose something, %d have another topology, and tell it\n", nloss, count,
           nother);
    assert_true(nloss <= count / 10 && nother <= count / 10);
}

// Noise of all densities: a mesh or a message, never a failure of another kind.
static void test_noise(void** unused) {
    (void)unused;
    for (int index = 0; index < test_count(2, 500); index++) {
        OmRng rng = om_rng_init(354, (uint64_t)index);
        OmVolume v = empty(14, 14, 14);
        const double share = om_rng_range(&rng, 0.02, 0.98);
        for (int n = 0; n < 14 * 14 * 14; n++) ((float*)v.voxel)[n] = om_rng_uniform(&rng) < share;
        OmModelDef def = def_of(om_rng_range(&rng, 1.5, 4));
        def.keep_all = index % 2;
        def.allow_loss = true;
        OmPatient p;
        OmModelReport r;
        const OmStatus status = om_model_build_volume(&def, &v, NULL, &p, &r);
        assert_true(status == OM_OK || status == OM_INVALID);
        if (status == OM_OK) assert_ok(om_tet_mesh_validate(&p.mesh));
        if (status == OM_OK) om_patient_done(&p);
        om_volume_done(&v);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_handle_of_one_voxel),
        cmocka_unit_test(test_a_loss_is_told),
        cmocka_unit_test(test_another_topology_is_a_loss),
        cmocka_unit_test(test_thin_plates_and_stumps),
        cmocka_unit_test(test_half_shells),
        cmocka_unit_test(test_parts_stay_apart),
        cmocka_unit_test(test_random_parts),
        cmocka_unit_test(test_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
