// test_calibrate_tissue.c: tissue compared with observations: another discretisation's landmarks, its own
// clouds and forces, bad definitions.
#include "calibrate/calibrate_tissue_internal.h"
#include "omentum/fem.h"
#include "omentum/pbd.h"
#include "test_alloc.h"

#define WIDTH 0.04
#define LENGTH 0.08

typedef struct Maker {  // what models are made from
    OmTetMesh mesh;
    OmTissueDef def;
    int nparam;  // young, then density
    double particle_volume;
} Maker;

static OmStatus build(void* ctx, const double* param, int nworker, OmTissueModel** model) {
    const Maker* m = ctx;
    OmTissueDef def = m->def;
    def.mesh = &m->mesh;
    def.material_default.young = param[0];
    if (m->nparam > 1) def.density = param[1];
    def.solver.nworker = nworker;
    OmStatus status = om_tissue_create(&def, model);
    return status == OM_INVALID ? OM_UNSAT : status;
}

// A bar that is held at one end of its length.
static void make_bar(Maker* m, OmVec3 size, int nx, int ny, int nz, int axis, double at) {
    memset(m, 0, sizeof *m);
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), size, nx, ny, nz, &m->mesh));
    int *vert = om_alloc((size_t)m->mesh.nvert, sizeof *vert), n = 0;
    for (int i = 0; i < m->mesh.nvert; ++i)
        if (fabs(m->mesh.x[3 * i + axis] - at) < 1e-9) vert[n++] = i;
    assert_ok(om_tet_mesh_add_set(&m->mesh, "attachment", vert, n));
    om_free(vert);
    m->nparam = 1;
    m->def = om_tissue_default_def(om_fem_engine(), &m->mesh);
    m->def.element = OM_ELEMENT_LINEAR;
    m->def.material_default = (OmMaterial){.young = 3000, .poisson = 0.3, .law = OM_NEO_HOOKEAN};
    m->def.solver.tolerance = 1e-6;
    m->def.solver.max_iterations = 500;
}

// ---- another discretisation -----------------------------------------------------------------------

enum { NMARK = 12 };

static void draw_marks(double* rest) {
    OmRng rng = om_rng_init(5, 0);
    for (int i = 0; i < NMARK; ++i)
        for (int k = 0; k < 3; ++k)
            rest[3 * i + k] = (0.1 + 0.8 * om_rng_uniform(&rng)) * (k == 2 ? LENGTH : WIDTH);
}

// Where the marks of a hanging bar are: quadratic tetrahedra, double precision, static; plus noise.
static void hang_truth(double young, double noise, const double* rest, double* x) {
    OmTetMesh tet;
    OmFemMesh mesh;
    OmFemSolid* solid;
    OmMaterial material = {.young = young, .poisson = 0.3, .law = OM_NEO_HOOKEAN};
    assert_ok(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(WIDTH, WIDTH, LENGTH), 3, 3, 6, &tet));
    assert_ok(om_fem_mesh_from_tet(&tet, OM_TET10, &mesh));
    OmFemDef def = om_fem_default_def(&mesh, 1, &material);
    def.nworker = 1;
    assert_ok(om_fem_create(&def, &solid));
    unsigned char* fixed = om_calloc(3 * (size_t)mesh.nnode, 1);
    for (int i = 0; i < mesh.nnode; ++i)
        for (int k = 0; k < 3; ++k) fixed[3 * i + k] = mesh.x[3 * i + 2] > LENGTH - 1e-9;
    double* node = om_alloc(3 * (size_t)mesh.nnode, sizeof *node);
    memcpy(node, mesh.x, 3 * (size_t)mesh.nnode * sizeof *node);
    OmFemLoad load = {.body = {0, 0, -9.81}, .fixed = fixed};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    assert_ok(om_fem_static_solve(solid, &load, &how, node, NULL, NULL));
    int elem[NMARK];
    double weight[NMARK * OM_MAX_ELEM_NODE];
    assert_ok(om_fem_mesh_embed(&mesh, NMARK, rest, elem, weight));
    OmRng rng = om_rng_init(6, 0);
    for (int i = 0; i < NMARK; ++i) {
        OmVec3 p = om_vec3(0, 0, 0);
        for (int a = 0; a < mesh.nelem_node; ++a)
            p = om_madd(p, weight[i * mesh.nelem_node + a],
                        om_load3(node, mesh.elem_node[elem[i] * mesh.nelem_node + a]));
        for (int k = 0; k < 3; ++k) x[3 * i + k] = noise * om_rng_normal(&rng);
        om_store3(x, i, om_add(p, om_load3(x, i)));
    }
    om_free(fixed);
    om_free(node);
    om_fem_destroy(solid);
    om_fem_mesh_done(&mesh);
    om_tet_mesh_done(&tet);
}

typedef struct Hang {
    Maker maker;
    double rest[3 * NMARK], x[3 * NMARK], level[1];
    OmCalibrationSeen seen[NMARK];
    OmCalibrationPath path;
    OmCalibrationTissueDef def;
} Hang;

static void make_hang(Hang* h, double noise) {
    make_bar(&h->maker, om_vec3(WIDTH, WIDTH, LENGTH), 4, 4, 8, 2, LENGTH);
    draw_marks(h->rest);
    hang_truth(4000, noise, h->rest, h->x);
    for (int i = 0; i < NMARK; ++i) h->seen[i] = (OmCalibrationSeen){0, 0, i, om_load3(h->x, i)};
    h->level[0] = 0;
    // steps so long that inertia is nothing
    h->path = (OmCalibrationPath){.name = "hang",
                                  .kind = OM_PATH_REST,
                                  .time_step = 5,
                                  .settle = 40,
                                  .nlevel = 1,
                                  .level = h->level};
    h->def = om_calibration_tissue_default_def(build, &h->maker);
    h->def.npath = 1, h->def.path = &h->path;
    h->def.nlandmark = NMARK, h->def.rest = h->rest;
    h->def.nobservation = NMARK, h->def.observation = h->seen;
}

static void test_stiffness_from_weight(void** state) {
    (void)state;
    static Hang h;
    make_hang(&h, 0.0003);
    double start[2] = {1500, 1000};
    OmCalibrationTissue* tissue;
    OmCalibrationResult r;
    assert_ok(om_calibration_tissue_create(&h.def, start, &tissue));
    OmCalibrationDef def = om_calibration_tissue_search(tissue);
    om_calibration_add_param(&def, "young", 1000, 20000, start[0], true);
    def.noise = 0.00048;  // mean length of a vector of 0.3 mm a coordinate
    def.max_generations = 6;
    assert_ok(om_calibration_run(&def, NULL, &r));
    // 0.3 mm over 12 marks that sink 7 mm on average: 1 %; the coarser mesh adds 1 %
    assert_near_rel(r.best[0], 4000, 0.04);
    assert_true(r.profile[0].is_determined);
    assert_true(r.profile[0].lo < 4000 && r.profile[0].hi > 4000);
    assert_near(r.cost, def.noise, 0.3 * def.noise);  // 36 numbers: +- 15 %
    om_calibration_result_done(&r);

    // Weight and stiffness at once: the data know their ratio, and the result says so.
    h.maker.nparam = 2;
    om_calibration_add_param(&def, "density", 200, 5000, start[1], true);
    def.max_local = 60;
    assert_true(om_calibration_run(&def, NULL, &r) >= 0);
    assert_near_rel(r.best[0] / r.best[1], 4, 0.05);
    assert_int_equal(r.profile[0].partner, 1);
    assert_int_equal(r.profile[1].partner, 0);
    assert_false(r.profile[0].is_determined || r.profile[1].is_determined);
    om_calibration_result_done(&r);
    om_calibration_tissue_destroy(tissue);
    om_tet_mesh_done(&h.maker.mesh);
}

// ---- its own clouds and forces --------------------------------------------------------------------

// A strip held at one end, which lies on a board or hangs, is lifted at its other end; the one that hangs is pressed as
// well. What the model of known parameters shows is given back as landmarks, cloud and forces: all errors are then
// zero, and only then.
static void check_paths(bool has_board) {
    Maker maker;
    make_bar(&maker, om_vec3(0.08, 0.04, 0.01), 8, 4, 1, 0, 0);
    maker.def.gravity = om_vec3(0, 0, -1);  // the strip must not sag away from the probe
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &board;
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.01;
    OmProbe* probe;
    assert_ok(om_probe_create(&shape, &probe));
    const double lift[] = {0, 0.01, 0.02}, press[] = {0.004};
    OmCalibrationPath path[] = {
        {.name = "lift",
         .kind = OM_PATH_LIFT,
         .point = {0.08, 0.02, 0.01},
         .direction = {0, 0, 3},
         .radius = 0.012,
         .speed = 0.02,
         .time_step = 0.1,
         .settle = 0.2,
         .nlevel = 3,
         .level = lift},
        {.name = "press",
         .kind = OM_PATH_PRESS,
         .point = {0.02, 0.02, 0.02},
         .direction = {0, 0, -1},
         .probe = probe,
         .contact_ntri = 0,
         .speed = 0.01,
         .time_step = 0.1,
         .nlevel = 1,
         .level = press},
    };
    double rest[] = {0.06, 0.02, 0.005, 0.03, 0.01, 0.008};
    OmCalibrationSeen seen[800] = {
        {0, 0, 0}, {0, 1, 1}, {0, 2, 0}, {0, 2, OM_SEEN_FORCE}, {1, 0, OM_SEEN_FORCE}};
    if (has_board) seen[4] = seen[3];
    OmCalibrationTissueDef def = om_calibration_tissue_default_def(build, &maker);
    def.contact = has_board ? &contact : NULL;
    def.npath = has_board ? 1 : 2, def.path = path;
    def.nlandmark = 2, def.rest = rest;
    def.nobservation = 5, def.observation = seen;
    OmCalibrationTissue* tissue;
    double param[] = {30000}, x[18], force[9], push[3] = {0, 0, -1};
    assert_ok(om_calibration_tissue_create(&def, param, &tissue));
    assert_ok(om_calibration_path_run(tissue, param, 0, x, force));
    if (!has_board) assert_ok(om_calibration_path_run(tissue, param, 1, NULL, push));
    om_calibration_tissue_destroy(tissue);
    assert_true(x[2] < 0.006 && x[3 * 4 + 2] > x[2] + 0.005);  // it lay or hung, then was lifted
    assert_true(!has_board || x[2] > 0.0045);                  // on the board
    assert_true(force[8] > 0.02 && push[2] < -0.01);           // up, down
    seen[0].x = om_load3(x, 0), seen[1].x = om_load3(x, 2 + 1), seen[2].x = om_load3(x, 4);
    seen[3].x = om_load3(force, 2), seen[4].x = has_board ? seen[3].x : om_load3(push, 0);
    // a cloud at the second level: the landmarks there, and points far below that are nearest to no point
    seen[5] = (OmCalibrationSeen){0, 1, OM_SEEN_CLOUD, om_load3(x, 2)};
    seen[6] = (OmCalibrationSeen){0, 1, OM_SEEN_CLOUD, om_load3(x, 3)};
    seen[7] = (OmCalibrationSeen){0, 1, OM_SEEN_CLOUD, {0, 0, -5}};
    def.nobservation = 8;
    def.ncloud_point = 2, def.cloud_point = rest;
    assert_ok(om_calibration_tissue_create(&def, param, &tissue));
    OmCalibrationDef search = om_calibration_tissue_search(tissue);
    assert_int_equal(search.nerror, 5 + 2);
    double error[7], other[7];
    for (int nworker = 1; nworker <= 2; ++nworker) {
        assert_ok(om_calibration_tissue_eval(tissue, param, nworker, error));
        for (int i = 0; i < 7; ++i) assert_near(error[i], 0, 1e-15);
    }
    param[0] = 15000;
    assert_ok(om_calibration_tissue_eval(tissue, param, 1, error));
    assert_ok(om_calibration_tissue_eval(tissue, param, 2, other));
    assert_memory_equal(error, other, sizeof error);
    for (int i = 0; i < 7; ++i) assert_true(error[i] > 1e-6);
    // half the stiffness, and deeper sunk: less than half the push; an error of 0.01 m a newton
    if (!has_board) {
        assert_true(error[4] > 0.01 * 0.5 * fabs(push[2]) && error[4] < 0.01 * fabs(push[2]));
        assert_string_equal(search.experiment[1], "press");
    }
    assert_string_equal(search.landmark[search.label[5].landmark], "cloud");
    assert_near(search.label[5].level, 0.01, 0);
    param[0] = -1;
    assert_status(om_calibration_tissue_eval(tissue, param, 1, error), OM_UNSAT);
    om_calibration_tissue_destroy(tissue);

    // all vertices of the surface where no points are given
    def.ncloud_point = 0;
    param[0] = 30000;
    assert_ok(om_calibration_tissue_create(&def, param, &tissue));
    assert_int_equal(om_calibration_tissue_search(tissue).nerror, 5 + maker.mesh.nvert);
    om_calibration_tissue_destroy(tissue);
    om_probe_destroy(probe);
    om_tet_mesh_done(&maker.mesh);
}

static void test_paths_give_back_what_they_showed(void** state) {
    (void)state;
    check_paths(true);
    check_paths(false);
}

typedef struct Seen {
    const OmTissueModel* model;
    OmTissueState* state;
    OmVec3 force[4], balance[4];  // by the walk, and by what the elements say
} Seen;

// At rest the tool bears what stresses and weight leave on the vertices that nothing else holds.
static OmStatus look_at_balance(void* ctx, int level, const double* x, OmVec3 force) {
    Seen* s = ctx;
    int n = om_tissue_mesh(s->model)->nvert;
    double* in = om_alloc(3 * (size_t)n, sizeof *in);
    assert_ok(om_tissue_set_x(s->model, s->state, x, NULL));
    assert_ok(om_tissue_get_internal_force(s->model, s->state, in));
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < n; ++i) {
        if (om_tissue_attached(s->state)[i]) continue;
        sum = om_add(sum, om_load3(in, i));
        sum = om_madd(sum, om_tissue_mass(s->model)[i], om_tissue_gravity(s->model));
    }
    s->force[level] = force;
    s->balance[level] = om_scale(-1, sum);
    om_free(in);
    return OM_OK;
}

static void test_forces_are_those_of_the_tool(void** state) {
    (void)state;
    Maker maker;
    make_bar(&maker, om_vec3(0.08, 0.04, 0.01), 8, 4, 1, 0, 0);
    maker.def.gravity = om_vec3(0, 0, -1);
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.01;
    OmProbe* probe;
    assert_ok(om_probe_create(&shape, &probe));
    const double lift[] = {0, 0.01, 0.02}, press[] = {0.004, 0.006};
    OmCalibrationPath path[] = {{.name = "lift",
                                 .kind = OM_PATH_LIFT,
                                 .point = {0.08, 0.02, 0.01},
                                 .direction = {0, 0, 1},
                                 .radius = 0.012,
                                 .speed = 0.001,
                                 .time_step = 2,
                                 .settle = 40,
                                 .nlevel = 3,
                                 .level = lift},
                                {.name = "press",
                                 .kind = OM_PATH_PRESS,
                                 .point = {0.02, 0.02, 0.02},
                                 .direction = {0, 0, -1},
                                 .probe = probe,
                                 .speed = 0.0005,
                                 .time_step = 1,
                                 .settle = 40,
                                 .nlevel = 2,
                                 .level = press}};
    const double young[2] = {30000};
    Seen s = {0};
    OmTissueModel* model;
    assert_ok(build(&maker, young, 1, &model));
    s.model = model;
    assert_ok(om_tissue_state_create(model, &s.state));
    for (int k = 0; k < 2; ++k) {
        assert_ok(om__calibrate_walk(model, &path[k], NULL, look_at_balance, &s));
        for (int l = k == 0 ? 1 : 0; l < path[k].nlevel; ++l) {
            printf("%s %g mm: %.5f N, stresses say %.5f N\n", path[k].name, 1e3 * path[k].level[l],
                   s.force[l].z, s.balance[l].z);
            assert_true(k == 0 ? s.force[l].z > 0.01 : s.force[l].z < -0.01);
            assert_near(om_distance(s.force[l], s.balance[l]), 0, 0.02 * fabs(s.force[l].z));
        }
    }
    om_tissue_state_destroy(s.state);
    om_tissue_destroy(model);
    om_probe_destroy(probe);
    om_tet_mesh_done(&maker.mesh);
}

static OmStatus keep_force(void* ctx, int level, const double* x, OmVec3 force) {
    (void)x;
    ((OmVec3*)ctx)[level] = force;
    return OM_OK;
}

// A free bar that is drawn through a viscous medium (Rayleigh's mass damping a) at speed v pulls by a m v; once it
// stands still, by nothing.
static void test_speed_of_a_path(void** state) {
    (void)state;
    Maker maker;
    make_bar(&maker, om_vec3(0.04, 0.02, 0.02), 4, 2, 2, 0, -1);
    maker.def.gravity = om_vec3(0, 0, 0);
    maker.def.rayleigh_mass = 10;
    const double level[] = {0, 0.05}, young[2] = {50000};
    OmTissueModel* model;
    assert_ok(build(&maker, young, 1, &model));
    for (int k = 0; k < 2; ++k) {
        OmCalibrationPath path = {.name = "draw",
                                  .kind = OM_PATH_LIFT,
                                  .point = {0, 0.01, 0.01},
                                  .direction = {-1, 0, 0},
                                  .radius = 0.012,
                                  .speed = 0.05,
                                  .time_step = 0.01,
                                  .settle = k ? 3 : 0,
                                  .nlevel = 2,
                                  .level = level};
        OmVec3 force[2];
        assert_ok(om__calibrate_walk(model, &path, NULL, keep_force, force));
        double wanted = k ? 0 : 10 * 1000 * 0.04 * 0.02 * 0.02 * 0.05;
        assert_near(-force[1].x, wanted, 0.03 * 0.008);  // what still swings
    }
    om_tissue_destroy(model);
    om_tet_mesh_done(&maker.mesh);
}

// A block that lies on a board is pressed by a ball. Elements and particles keep out of both: no landmark of the
// underside comes out below the board, and the two engines agree on the force.
static void test_presses_on_a_board(void** state) {
    (void)state;
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &board;
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.02;
    OmProbe* probe;
    assert_ok(om_probe_create(&shape, &probe));
    const double level[] = {0.01};
    OmCalibrationPath path = {.name = "press",
                              .kind = OM_PATH_PRESS,
                              .point = {0.02, 0.02, 0.04},
                              .direction = {0, 0, -1},
                              .probe = probe,
                              .speed = 0.05,
                              .time_step = 0.02,
                              .settle = 0.2,
                              .nlevel = 1,
                              .level = level};
    const double rest[] = {0.02, 0.02, 0, 0.01, 0.01, 0, 0.02, 0.02, 0.02};
    const OmCalibrationSeen seen[] = {{0, 0, 0, {0, 0, 0}}};
    double push[2];
    for (int k = 0; k < 2; ++k) {
        Maker maker;
        make_bar(&maker, om_vec3(0.04, 0.04, 0.02), 4, 4, 2, 0, 0);
        OmPbdDef pbd = om_pbd_default_def(OM_PBD_ELASTIC);
        pbd.collision_distance = 0;
        if (k == 1) maker.def.engine = om_pbd_engine(), maker.def.options = &pbd;
        OmCalibrationTissueDef def = om_calibration_tissue_default_def(build, &maker);
        def.contact = &contact;
        def.npath = 1, def.path = &path;
        def.nlandmark = 3, def.rest = rest;
        def.nobservation = 1, def.observation = seen;
        OmCalibrationTissue* tissue;
        double param[] = {5000}, x[9], force[3];
        assert_ok(om_calibration_tissue_create(&def, param, &tissue));
        assert_ok(om_calibration_path_run(tissue, param, 0, x, force));
        assert_true(x[2] > -1e-5 && x[5] > -1e-5);
        assert_true(x[8] < 0.012 && force[2] < -0.1);  // pressed, 10 mm deep
        push[k] = force[2];
        om_calibration_tissue_destroy(tissue);
        om_tet_mesh_done(&maker.mesh);
    }
    printf("press on a board: elements %.4f N, particles %.4f N\n", push[0], push[1]);
    assert_near_rel(push[0], push[1], 0.05);
    om_probe_destroy(probe);
}

// ---- particles ------------------------------------------------------------------------------------

// A sheet of one layer of particles in clusters (thesis 5.4.1), held on one side, lifted at the other, and pressed.
static OmStatus build_sheet(void* ctx, const double* param, int nworker, OmTissueModel** model) {
    const Maker* m = ctx;
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    pbd.cluster_stiffness = param[0];
    pbd.cluster_radius = param[1];
    pbd.particle_volume = m->particle_volume;
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &m->mesh);
    def.element = OM_ELEMENT_LINEAR;
    def.engine = om_pbd_engine();
    def.options = &pbd;
    def.solver.nworker = nworker;
    OmStatus status = om_tissue_create(&def, model);
    return status == OM_INVALID ? OM_UNSAT : status;
}

static OmStatus keep_surface(void* ctx, int level, const double* x, OmVec3 force) {
    (void)level, (void)force;
    Maker* m = ctx;
    memcpy(m->mesh.x, x, 3 * (size_t)m->mesh.nvert * sizeof *x);
    return OM_OK;
}

static void test_particles(void** state) {
    (void)state;
    Maker maker = {0}, shown = {0};
    assert_ok(om_pbd_sample_sheet(0.06, 0.06, 0.003, 0.004, &maker.mesh, &maker.particle_volume));
    int n = maker.mesh.nvert, nheld = 0, held[400];
    assert_true(n <= 400);
    for (int i = 0; i < n; ++i)
        if (maker.mesh.x[3 * i] < -0.025) held[nheld++] = i;
    assert_ok(om_tet_mesh_add_set(&maker.mesh, "attachment", held, nheld));
    assert_ok(om_tet_mesh_copy(&maker.mesh, &shown.mesh));
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = 0.01;
    OmProbe* probe;
    assert_ok(om_probe_create(&shape, &probe));
    const double level[] = {0.02};
    OmCalibrationPath path[] = {
        {.name = "lift",
         .kind = OM_PATH_LIFT,
         .point = {0.028, 0, 0},
         .direction = {0, 0, 1},
         .radius = 0.006,
         .speed = 0.05,
         .time_step = 0.02,
         .nlevel = 1,
         .level = level},
        {.name = "press",
         .kind = OM_PATH_PRESS,
         .point = {-0.01, 0, 0.011},
         .direction = {0, 0, -1},
         .probe = probe,
         .speed = 0.05,
         .time_step = 0.02,
         .nlevel = 1,
         .level = level},
    };
    // the cloud is where the particles of known parameters were
    double param[] = {0.5, 0.01};
    static OmCalibrationSeen seen[800];
    for (int p = 0; p < 2; ++p) {
        OmTissueModel* model;
        assert_ok(build_sheet(&maker, param, 1, &model));
        assert_ok(om__calibrate_walk(model, &path[p], NULL, keep_surface, &shown));
        for (int i = 0; i < n; ++i)
            seen[p * n + i] = (OmCalibrationSeen){p, 0, OM_SEEN_CLOUD, om_load3(shown.mesh.x, i)};
        om_tissue_destroy(model);
    }
    OmCalibrationTissueDef def = om_calibration_tissue_default_def(build_sheet, &maker);
    def.npath = 2, def.path = path;
    def.nobservation = 2 * n, def.observation = seen;
    OmCalibrationTissue* tissue;
    assert_ok(om_calibration_tissue_create(&def, param, &tissue));
    OmCalibrationDef search = om_calibration_tissue_search(tissue);
    assert_int_equal(search.nerror, 2 * n);
    double* error = om_alloc(2 * (size_t)n, sizeof *error);
    assert_ok(om_calibration_tissue_eval(tissue, param, 2, error));
    for (int i = 0; i < 2 * n; ++i) assert_near(error[i], 0, 1e-15);
    assert_near(om_calibration_norm_eval(&search, n, error + n, NULL), 0, 1e-15);
    param[0] = 0.1;
    assert_ok(om_calibration_tissue_eval(tissue, param, 2, error));
    assert_true(om_calibration_norm_eval(&search, n, error, NULL) > 1e-4);
    param[1] = 0.001;  // less than half the spacing: no such model
    assert_status(om_calibration_tissue_eval(tissue, param, 2, error), OM_UNSAT);
    om_free(error);
    om_calibration_tissue_destroy(tissue);
    om_probe_destroy(probe);
    om_tet_mesh_done(&maker.mesh);
    om_tet_mesh_done(&shown.mesh);
}

// ---- what can go wrong ----------------------------------------------------------------------------

static OmStatus make_and_run(void* ctx) {
    Hang* h = ctx;
    double param = 3000, error[NMARK];
    OmCalibrationTissue* tissue;
    OM_TRY(om_calibration_tissue_create(&h->def, &param, &tissue));
    OmStatus status = om_calibration_tissue_eval(tissue, &param, 1, error);
    om_calibration_tissue_destroy(tissue);
    return status;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    static Hang h;
    make_hang(&h, 0);
    h.path.settle = 5;  // one step
    assert_true(test_failing_allocations(make_and_run, &h, 5) > 5);
    OmCalibrationTissue* tissue;
    double start = 3000;
    const OmCalibrationTissueDef good = h.def;
    const OmCalibrationPath path = h.path;
#define REFUSED(change, word)                                                             \
    do {                                                                                  \
        change;                                                                           \
        assert_status(om_calibration_tissue_create(&h.def, &start, &tissue), OM_INVALID); \
        assert_null(tissue);                                                              \
        if (!strstr(om_error_message(), word)) fail_msg("\"%s\"", om_error_message());    \
        h.def = good, h.path = path;                                                      \
    } while (0)
    REFUSED(h.def.cookie = 1, "om_calibration_tissue_default_def");
    REFUSED(h.def.npath = 0, "no path");
    REFUSED(h.path.level = NULL, "path hang: nothing was seen");
    REFUSED(h.path.time_step = 0, "path hang: time_step");
    REFUSED(h.path.settle = NAN, "path hang: settle");
    REFUSED(h.path.kind = OM_PATH_PRESS, "path hang: speed");
    REFUSED((h.path.kind = OM_PATH_LIFT, h.path.speed = 1), "path hang: point and direction");
    REFUSED((h.path.kind = OM_PATH_PRESS, h.path.speed = 1, h.path.direction.z = 1),
            "probe is null");
    REFUSED(h.def.nobservation = 0, "no observation");
    REFUSED(h.seen[3].landmark = 99, "observation[3].landmark");
    h.seen[3].landmark = 3;
    REFUSED(h.def.force_scale = 0, "force_scale");
    REFUSED(start = -3, "no model can be built with the start values: ");
    start = 3000;
    // a grasp that reaches nothing is a mistake of the problem, not of the parameters
    double level = 0.01, error[NMARK];
    h.path.kind = OM_PATH_LIFT, h.path.speed = 1, h.path.direction.z = 1, h.path.point.x = 5;
    h.path.level = &level;
    assert_ok(om_calibration_tissue_create(&h.def, &start, &tissue));
    assert_status(om_calibration_tissue_eval(tissue, &start, 1, error), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "path hang: "));
    om_calibration_tissue_destroy(tissue);
    om_tet_mesh_done(&h.maker.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stiffness_from_weight),
        cmocka_unit_test(test_paths_give_back_what_they_showed),
        cmocka_unit_test(test_presses_on_a_board),
        cmocka_unit_test(test_forces_are_those_of_the_tool),
        cmocka_unit_test(test_speed_of_a_path),
        cmocka_unit_test(test_particles),
        cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
