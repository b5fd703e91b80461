// test_umesh_untangle.c: predictions all over the organ become meshes without an inverted tetrahedron.
//
// The project's weights predict presses all over the surface. In some predictions tetrahedra beside the
// probe are inverted at equilibrium; the test asserts this, because without them nothing would be tested.
// The result of om_umesh_untangle is checked with volumes computed here, and with the check of mesh files.
#include "test_common.h"

#include "omentum/umesh_net.h"

#define EVERY 61       // nodes of the skin, from place to place
#define SHALLOW 15     // mm: up to here every prediction must be untangled
#define MEAN_OFF 2e-4  // m off equilibrium in the mean; measured: up to 0.094 mm

typedef struct Case {
    const OmUmeshNet* net;
    const OmUmeshGrid* grid;
    OmUmeshPredictor* predictor;
    unsigned char* mask;
    float *u, *opened;
} Case;

static void begin(Case* c, OmUmeshNet* net) {
    *c = (Case){.net = net, .grid = om_umesh_net_grid(net)};
    size_t nnode = (size_t)c->grid->fem.mesh.nnode;
    assert_ok(om_umesh_predictor_create(net, 1, &c->predictor));
    om_umesh_predictor_set_refinement(c->predictor, OM_UMESH_TOLERANCE, 100);
    c->mask = om_calloc(nnode, 1);
    c->u = om_calloc(3 * nnode, sizeof *c->u);
    c->opened = om_calloc(3 * nnode, sizeof *c->opened);
}

static void end(Case* c) {
    om_umesh_predictor_destroy(c->predictor);
    om_free(c->mask);
    om_free(c->u);
    om_free(c->opened);
}

// @return whether the answer is at equilibrium, and valid at its Gauss points
static bool press(Case* c, OmVec3 at, bool is_turned, double way) {
    OmUmeshPatch patch = om_umesh_find_place(c->grid, at);
    if (is_turned) patch.along = om_cross(patch.normal, patch.along);
    if (om_umesh_patch_select(c->grid, &patch, c->mask) == 0) return false;
    const OmVec3 d = om_scale(-way, patch.normal);
    for (int i = 0; i < c->grid->fem.mesh.nnode; ++i) {
        c->u[3 * i] = c->mask[i] ? (float)d.x : 0;
        c->u[3 * i + 1] = c->mask[i] ? (float)d.y : 0;
        c->u[3 * i + 2] = c->mask[i] ? (float)d.z : 0;
    }
    assert_ok(om_umesh_predict(c->predictor, c->mask, c->u, NULL));
    OmFemGridReport r = om_umesh_predictor_refinement(c->predictor);
    return r.left < OM_UMESH_TOLERANCE && r.min_volume > 0;
}

// Tetrahedra with a volume of 0 or less.
static int count_inverted(const Case* c, const float* u) {
    OmTetMesh mesh;
    int num = 0;
    assert_ok(om_fem_grid_make_tet_mesh(&c->grid->fem, &mesh));
    for (int k = 0; k < 3 * mesh.nvert; ++k) mesh.x[k] += (double)u[k];
    for (int t = 0; t < mesh.ntet; ++t) {
        const int* v = mesh.tet_vert + 4 * t;
        const double *a = mesh.x + 3 * v[0], *b = mesh.x + 3 * v[1], *p = mesh.x + 3 * v[2],
                     *q = mesh.x + 3 * v[3];
        double m[3][3];
        for (int i = 0; i < 3; ++i)
            m[0][i] = b[i] - a[i], m[1][i] = p[i] - a[i], m[2][i] = q[i] - a[i];
        double six = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
        num += !(six > 0);
    }
    if (num == 0) assert_ok(om_tet_mesh_validate(&mesh));
    om_tet_mesh_done(&mesh);
    return num;
}

static void check_opened(const Case* c, const OmFemGridUntangling* o) {
    const int nnode = c->grid->fem.mesh.nnode;
    int nmoved = 0;
    double max = 0;
    for (int i = 0; i < nnode; ++i) {
        const float *a = c->u + 3 * i, *b = c->opened + 3 * i;
        double way = om_distance(om_vec3(a[0], a[1], a[2]), om_vec3(b[0], b[1], b[2]));
        if (c->mask[i] || c->grid->fem.fixed[i]) assert_true(way == 0);
        nmoved += way > 1e-5;
        max = fmax(max, way);
    }
    assert_int_equal(o->nmoved, nmoved);
    assert_near(o->max, max, 1e-12);
    if (o->ninverted == 0) assert_true(max == 0);
    assert_true(o->min_volume > 0);
    assert_int_equal(count_inverted(c, c->opened), 0);
}

// All over the skin: down to 15 mm every answer, and the whole of what is found deeper, is free of inverted tetrahedra.
static void test_grid_of_places(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    Case c;
    int nplace = 0, nfolded = 0, nopened = 0, nrefused = 0;
    assert_ok(om_umesh_net_load("weights/phantom.safetensors", &net));
    begin(&c, net);
    const size_t bytes = 3 * (size_t)c.grid->fem.mesh.nnode * sizeof *c.u;
    for (int i = 0, at = 0; i < c.grid->fem.mesh.nnode; ++i) {
        if (!c.grid->is_surface[i] || at++ % EVERY) continue;
        const OmVec3 place = om_load3(c.grid->surface_x, i);
        for (int mm = 10; mm <= 25; mm += mm < SHALLOW ? 5 : 10) {
            OmFemGridUntangling o;
            if (!press(&c, place, at / EVERY % 2, 1e-3 * mm)) {
                assert_true(mm > SHALLOW);
                continue;
            }
            ++nplace;
            const int ninverted = count_inverted(&c, c.u);
            nfolded += ninverted > 0;
            memcpy(c.opened, c.u, bytes);
            OmStatus status = om_umesh_untangle(net, c.mask, c.opened, &o);
            assert_int_equal(o.ninverted, ninverted);
            if (status == OM_OK) {
                check_opened(&c, &o);
                if (mm <= SHALLOW) assert_below(o.mean, MEAN_OFF);
                nopened += ninverted > 0;
                continue;
            }
            assert_status(status, OM_NOT_CONVERGED);
            assert_true(mm > SHALLOW);
            assert_memory_equal(c.opened, c.u, bytes);
            ++nrefused;
        }
    }
    print_message("%d answers, %d with inverted tetrahedra, of which opened %d, refused %d\n",
                  nplace, nfolded, nopened, nrefused);
    assert_true(nfolded >= 5 && nopened >= 4 * nrefused);
    end(&c);
    om_umesh_net_destroy(net);
}

// An answer without inverted tetrahedra does not change; nor does rest.
static void test_nothing_to_open(void** unused) {
    (void)unused;
    OmUmeshNet* net;
    OmFemGridUntangling o;
    Case c;
    assert_ok(om_umesh_net_load("weights/phantom.safetensors", &net));
    begin(&c, net);
    const size_t bytes = 3 * (size_t)c.grid->fem.mesh.nnode * sizeof *c.u;
    assert_true(press(&c, om_vec3(0, 0, 0.08), false, 0.005));
    memcpy(c.opened, c.u, bytes);
    assert_ok(om_umesh_untangle(net, c.mask, c.opened, &o));
    assert_memory_equal(c.opened, c.u, bytes);
    assert_int_equal(o.ninverted, 0);
    memset(c.opened, 0, bytes);
    assert_ok(om_umesh_untangle(net, c.mask, c.opened, &o));
    assert_near(o.min_volume, 1, 1e-6);
    end(&c);
    om_umesh_net_destroy(net);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid_of_places),
        cmocka_unit_test(test_nothing_to_open),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
