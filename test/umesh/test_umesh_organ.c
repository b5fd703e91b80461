// test_umesh_organ.c: organs immersed in grids: counts, volume, nodes and points, what is held.
#include "test_alloc.h"
#include "test_files.h"
#include "umesh/test_umesh.h"

static void test_phantom(void** state) {
    (void)state;
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    OmUmeshOrgan* organ;
    assert_ok(om_umesh_organ_create(&def, &organ));
    const OmUmeshGrid* g = om_umesh_organ_grid(organ);
    assert_in_range(g->fem.mesh.nelem, 2153, 2195);  // the thesis's 2,174, within a percent
    assert_int_equal(g->fem.grid.dim[0], 24);
    assert_int_equal(g->fem.grid.dim[1], 20);
    assert_int_equal(g->fem.grid.dim[2], 12);
    // half of the cells that the surface cuts are in: the volume is right to what the staircase leaves
    OmVec3 half = OM_PHANTOM_HALF;
    double volume = g->fem.mesh.nelem * pow(g->fem.grid.spacing, 3);
    assert_near_rel(volume, 2.0 / 3 * OM_PI * half.x * half.y * half.z, 0.01);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 p = om_load3(g->fem.mesh.x, i), skin = om_load3(g->surface_x, i);
        assert_int_equal(g->fem.fixed[i], fabs(p.z) < 1e-9);  // the flat base is where it is held
        if (!g->is_surface[i]) continue;
        assert_false(g->fem.fixed[i]);
        assert_below(om_distance(p, skin), 1.2 * g->fem.grid.spacing);
        // third of a field's cell, 2.3 mm, at the rim, where its edge is rounded
        assert_near(om_half_ellipsoid_eval(half, skin), 0, 0.8e-3);
    }
    om_umesh_organ_destroy(organ);
}

// Whatever the spacing, three levels of a U-Net have an axis to halve.
static void test_halving(void** state) {
    (void)state;
    for (int nelem = 300; nelem <= test_count(300, 2100); nelem += 600) {
        OmUmeshOrganDef def = om_umesh_organ_default_def();
        OmUmeshOrgan* organ;
        int max = 0;
        def.nelem = nelem;
        assert_ok(om_umesh_organ_create(&def, &organ));
        const OmUmeshGrid* g = om_umesh_organ_grid(organ);
        for (int c = 0; c < 3; ++c) {
            assert_int_equal(g->fem.grid.dim[c] % 4, 0);
            max = g->fem.grid.dim[c] > max ? g->fem.grid.dim[c] : max;
        }
        assert_int_equal(max % 8, 0);
        om_umesh_organ_destroy(organ);
    }
}

// More points than needed, as the thesis has them: the same cells with more around them.
static void test_padding(void** state) {
    (void)state;
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    OmUmeshOrgan *tight, *wide;
    assert_ok(om_umesh_organ_create(&def, &tight));
    memcpy(def.dim, (const int[]){32, 24, 16}, sizeof def.dim);
    assert_ok(om_umesh_organ_create(&def, &wide));
    const OmUmeshGrid *g = om_umesh_organ_grid(tight), *w = om_umesh_organ_grid(wide);
    assert_int_equal(w->fem.npoint, 32 * 24 * 16);
    assert_int_equal(w->fem.mesh.nelem, g->fem.mesh.nelem);
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        assert_below(om_distance(om_load3(w->fem.mesh.x, i), om_load3(g->fem.mesh.x, i)), 1e-12);
    om_umesh_organ_destroy(tight);
    om_umesh_organ_destroy(wide);
}

static void test_maps(void** state) {
    (void)state;
    OmUmeshOrgan* organ = make_organ(400);
    const OmUmeshGrid* g = om_umesh_organ_grid(organ);
    int nnode = 0, nelem = 0;
    for (int p = 0; p < g->fem.npoint; ++p) {
        if (g->fem.point_node[p] >= 0) {
            assert_int_equal(g->fem.point_node[p], nnode);
            assert_int_equal(g->fem.node_point[nnode++], p);
        }
        if (g->fem.cell_elem[p] < 0) continue;
        assert_int_equal(g->fem.cell_elem[p], nelem++);
        const int* node = g->fem.mesh.elem_node + 8 * g->fem.cell_elem[p];
        assert_int_equal(g->fem.node_point[node[0]], p);
        assert_int_equal(g->fem.node_point[node[6]],
                         p + 1 + g->fem.grid.dim[0] * (1 + g->fem.grid.dim[1]));
    }
    assert_int_equal(nnode, g->fem.mesh.nnode);
    assert_int_equal(nelem, g->fem.mesh.nelem);
    // scatter puts each component where its point is, and gather finds it again
    size_t n = (size_t)nnode, npoint = (size_t)g->fem.npoint;
    float *u = om_alloc(3 * n, sizeof *u), *back = om_alloc(3 * n, sizeof *u);
    float* all = om_alloc(3 * npoint, sizeof *all);
    unsigned char* mask = om_calloc(n, 1);
    for (size_t i = 0; i < 3 * n; ++i) u[i] = (float)(i + 1);
    om_umesh_scatter(g, u, NULL, all);
    om_umesh_gather(g, all, back);
    assert_memory_equal(u, back, 3 * n * sizeof *u);
    double sum = 0;
    for (size_t i = 0; i < 3 * npoint; ++i) sum += (double)all[i];
    assert_near_rel(sum, 1.5 * (double)n * (3 * (double)n + 1), 1e-12);  // nothing elsewhere
    mask[7] = 1;
    om_umesh_scatter(g, u, mask, all);
    for (size_t i = 0; i < 3 * npoint; ++i) sum -= (double)all[i];
    assert_near(sum, 1.5 * (double)n * (3 * (double)n + 1) - (22 + 23 + 24), 1e-3);
    assert_true(all[npoint + (size_t)g->fem.node_point[7]] == 23.0f);
    om_free(u);
    om_free(back);
    om_free(all);
    om_free(mask);
    om_umesh_organ_destroy(organ);
}

// Two cubes that touch nowhere: the larger part is the organ.
static void test_parts(void** state) {
    (void)state;
    OmTetMesh a, b;
    OmSurface s, t, both;
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.04, 0.04, 0.04), 2, 2, 2, &a));
    assert_ok(om_tet_mesh_box(om_vec3(0.08, 0, 0), om_vec3(0.10, 0.02, 0.02), 2, 2, 2, &b));
    assert_ok(om_tet_mesh_boundary(&a, &s, NULL));
    assert_ok(om_tet_mesh_boundary(&b, &t, NULL));
    assert_ok(om_surface_init(&both, s.nvert + t.nvert, s.ntri + t.ntri));
    memcpy(both.x, s.x, 3 * (size_t)s.nvert * sizeof(double));
    memcpy(both.x + 3 * s.nvert, t.x, 3 * (size_t)t.nvert * sizeof(double));
    memcpy(both.tri_vert, s.tri_vert, 3 * (size_t)s.ntri * sizeof(int));
    for (int i = 0; i < 3 * t.ntri; ++i) both.tri_vert[3 * s.ntri + i] = s.nvert + t.tri_vert[i];
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    def.surface = &both;
    def.spacing = 0.005;
    OmUmeshOrgan* organ;
    assert_ok(om_umesh_organ_create(&def, &organ));
    assert_int_equal(om_umesh_organ_grid(organ)->fem.mesh.nelem, 8 * 8 * 8);
    om_umesh_organ_destroy(organ);
    om_surface_done(&s);
    om_surface_done(&t);
    om_surface_done(&both);
    om_tet_mesh_done(&a);
    om_tet_mesh_done(&b);
}

// A patient with a set "attachment" is held there, from above.
static void test_patient(void** state) {
    (void)state;
    OmPatient patient = {.up = {0, -1, 0}, .nmaterial = 1};
    patient.material[0] = (OmPatientMaterial){.young = 5000, .poisson = 0.4};
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.04, 0.05), 6, 4, 5, &patient.mesh));
    int vert[7 * 6], n = 0;
    for (int i = 0; i < patient.mesh.nvert; ++i)
        if (patient.mesh.x[3 * i + 1] > 0.0399) vert[n++] = i;
    assert_ok(om_tet_mesh_add_set(&patient.mesh, "attachment", vert, n));
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    def.patient = &patient;
    def.nelem = 960;
    OmUmeshOrgan* organ;
    assert_ok(om_umesh_organ_create(&def, &organ));
    const OmUmeshGrid* g = om_umesh_organ_grid(organ);
    assert_near(g->up.y, -1, 0);
    OmUmeshDataDef data = om_umesh_data_default_def(organ, "");
    assert_near(data.material.young, 5000, 0);
    assert_near(data.material.poisson, 0.4, 0);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (g->fem.mesh.x[3 * i + 1] > 0.0399) assert_true(g->fem.fixed[i]);
        if (g->fem.mesh.x[3 * i + 1] < 0.025) assert_false(g->fem.fixed[i]);
    }
    // a network knows one material: the one that elements have, and no second
    om_umesh_organ_destroy(organ);
    patient.nmaterial = 3;
    patient.material[1] =
        (OmPatientMaterial){.name = "gland", .label = 7, .young = 9000, .poisson = 0.4};
    patient.material[2] =
        (OmPatientMaterial){.name = "skin", .label = -1, .young = 9000, .poisson = 0.4};
    for (int e = 0; e < patient.mesh.ntet; ++e) patient.mesh.tet_label[e] = 7 + e % 2;
    assert_ok(om_umesh_organ_create(&def, &organ));
    assert_near(om_umesh_data_default_def(organ, "").material.young, 9000, 0);
    om_umesh_organ_destroy(organ);
    patient.material[2].young = 8000;
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "gland: 9000 Pa, 0.4; skin: 8000 Pa, 0.4"));
    om_tet_mesh_done(&patient.mesh);
}

static void test_refusals(void** state) {
    (void)state;
    OmUmeshOrgan* organ;
    OmUmeshOrganDef def = {0};
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
    assert_null(organ);
    def = om_umesh_organ_default_def();
    def.min_fill = 1;
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "min_fill"));
    def = om_umesh_organ_default_def();
    def.spacing = 1e-6;
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "too many cells"));
    def.spacing = 0.1;  // larger than half the body
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
    OmSurface empty = {0};
    def = om_umesh_organ_default_def();
    def.surface = &empty;
    assert_status(om_umesh_organ_create(&def, &organ), OM_INVALID);
}

static OmStatus create_work(void* ctx) {
    (void)ctx;
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    def.spacing = 0.02;
    OmUmeshOrgan* organ;
    OmStatus status = om_umesh_organ_create(&def, &organ);
    om_umesh_organ_destroy(organ);
    return status;
}

static void test_memory(void** state) {
    (void)state;
    assert_true(test_failing_allocations(create_work, NULL, test_stride(13)) > 2);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_phantom),  cmocka_unit_test(test_padding),
        cmocka_unit_test(test_halving),  cmocka_unit_test(test_maps),
        cmocka_unit_test(test_parts),    cmocka_unit_test(test_patient),
        cmocka_unit_test(test_refusals), cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
