// test_fem_random.c: drops, presses and folds of quadratic elements drawn at random, three laws: a step that says OM_OK
// has inverted no element and gained no energy, and the number of workers does not matter.
#include "test_element.h"

#include "tissue/tissue_internal.h"

#define STEP 0.02  // s
#define NCASE 240
#define NKIND 3
#define NTRY_LAW 3

static const char* const kind_name[NKIND] = {"drop", "press", "fold"};
static const OmLaw law_of[NTRY_LAW] = {OM_COROTATIONAL, OM_STABLE_NEO_HOOKEAN, OM_NEO_HOOKEAN};
static const OmContactPlane floor_plane = {{0, 0, 0}, {0, 0, 1}},
                            lid_plane = {{0, 0, 0}, {0, 0, -1}};

typedef struct Count {
    int nstep, nbad, ncut, ninverted, ngain;
    double worst;  // energy gained over the bound of a step
} Count;

typedef struct Try {
    TestRig r;
    int kind, nstep;
    OmPose lid;     // where the plate of a press begins
    OmVec3 travel;  // of the plate, m a step
    OmPose tip;     // where the tool of a fold begins
    OmVec3 hinge, axis;
    double angle;  // rad a step
} Try;

// A block of 20 to 60 mm a side and 5 to 20 mm thick, turned in a drop.
static void begin(Try* t, int number, int nworker) {
    OmRng rng = om_rng_init(17, (uint64_t)number);
    TestRig* r = &t->r;
    t->kind = number % NKIND;
    t->nstep = 20;
    OmVec3 size = om_vec3(om_rng_range(&rng, 0.02, 0.06), om_rng_range(&rng, 0.02, 0.06),
                          om_rng_range(&rng, 0.005, 0.02));
    int nx = 2 + (int)(3 * om_rng_uniform(&rng)), ny = 2 + (int)(2 * om_rng_uniform(&rng));
    rig_box(r, om_vec3(0, 0, 0), size, nx, ny, 1 + (number / 9) % 2);
    OmQuat turn = om_quat_identity();
    OmVec3 speed = {0, 0, 0}, shift = {0, 0, 0};
    if (t->kind == 0) {
        OmVec3 axis = om_vec3(om_rng_normal(&rng), om_rng_normal(&rng), om_rng_normal(&rng));
        turn = om_quat_axis_angle(axis, om_rng_range(&rng, 0, 3));
        speed = om_vec3(om_rng_range(&rng, -0.5, 0.5), om_rng_range(&rng, -0.5, 0.5),
                        om_rng_range(&rng, -2, 0));
        double lowest = 1;
        for (int i = 0; i < r->mesh.nvert; ++i)
            lowest = fmin(lowest, om_quat_rotate(turn, om_load3(r->mesh.x, i)).z);
        shift.z = om_rng_range(&rng, 0.001, 0.02) - lowest;
    }
    for (int i = 0; i < r->mesh.nvert; ++i)
        om_store3(r->mesh.x, i, om_add(shift, om_quat_rotate(turn, om_load3(r->mesh.x, i))));
    if (t->kind == 2) rig_attach_plane(r, 0, 0);
    r->def.material_default = (OmMaterial){.young = pow(10, om_rng_range(&rng, 3.3, 4.5)),
                                           .poisson = om_rng_range(&rng, 0.2, 0.48),
                                           .law = law_of[number / NKIND % NTRY_LAW]};
    r->def.rayleigh_mass = om_rng_range(&rng, 0, 2);
    r->def.solver.tolerance = 1e-4;
    r->def.solver.nworker = nworker;
    r->def.element = OM_ELEMENT_QUADRATIC;
    rig_start(r);
    const OmTetMesh* mesh = element_nodes(r);
    double* v = om_alloc(3 * (size_t)mesh->nvert, sizeof *v);
    for (int i = 0; i < mesh->nvert; ++i) om_store3(v, i, speed);
    assert_ok(om_tissue_set_x(r->m, r->s, mesh->x, v));
    om_free(v);
    OmTissueObstacle obstacle[2] = {om_plane_obstacle(&floor_plane), om_plane_obstacle(&lid_plane)};
    OmContactDef def = rig_on(obstacle);
    def.nobstacle = t->kind == 1 ? 2 : 1;
    rig_contact(r, &def);
    t->lid = (OmPose){om_vec3(0, 0, size.z), om_quat_identity()};
    t->travel = om_vec3(0, 0, -size.z * om_rng_range(&rng, 0.1, 0.5) / t->nstep);
    if (t->kind == 2) {
        t->tip = (OmPose){om_vec3(size.x, size.y * om_rng_uniform(&rng), 0.5 * size.z),
                          om_quat_identity()};
        t->hinge = om_vec3(0.3 * size.x, 0, size.z);
        t->axis = om_normalize(om_vec3(om_rng_range(&rng, -0.3, 0.3), -1, 0));
        t->angle = om_rng_range(&rng, 0.5, OM_PI) / t->nstep;
        assert_ok(om_tissue_grasp(r->m, r->s, 0, t->tip, 0.51 * fmax(size.z, size.y / ny), NULL));
    }
}

static double energy_of(const TestRig* r) {
    OmTissueEnergy e;
    assert_ok(om_tissue_get_energy(r->m, r->s, &e));
    return e.elastic + e.kinetic + e.gravity + e.spring;
}

// What moves in step k: the plate goes down and up again, the tool along an arc and lets go.
static void drive(Try* t, int k) {
    TestRig* r = &t->r;
    if (t->kind == 1) {
        double from = k < t->nstep ? k : 2 * t->nstep - k,
               to = k < t->nstep ? k + 1 : 2 * t->nstep - k - 1;
        OmPose a = t->lid, b = t->lid;
        a.p = om_madd(a.p, from, t->travel), b.p = om_madd(b.p, to, t->travel);
        assert_ok(om_contact_work_move(r->cw, 1, a, b));
    }
    if (t->kind == 2 && k < t->nstep) {
        OmQuat turn = om_quat_axis_angle(t->axis, (k + 1) * t->angle);
        OmVec3 arm = om_sub(t->tip.p, t->hinge);
        OmPose to = {om_add(t->hinge, om_quat_rotate(turn, arm)), turn};
        assert_ok(om_tissue_move_grasp(r->s, 0, to));
    }
    if (t->kind == 2 && k == t->nstep) om_tissue_release(r->s, 0);
}

static uint64_t run_try(int number, int nworker, Count* count) {
    Try t = {0};
    begin(&t, number, nworker);
    TestRig* r = &t.r;
    size_t n = 3 * (size_t)element_nodes(r)->nvert;
    double *x = om_alloc(n, sizeof *x), *f = om_alloc(n, sizeof *f);
    for (int k = 0; k < 2 * t.nstep; ++k) {
        drive(&t, k);
        memcpy(x, om_tissue_x(r->s), n * sizeof *x);
        OmTissueEnergy begin_energy;
        assert_ok(om_tissue_get_energy(r->m, r->s, &begin_energy));
        double before = energy_of(r);
        OmContactReport report;
        OmStatus status = om_contact_step(r->cw, r->m, r->s, r->w, STEP, &report);
        if (status < 0) fail_msg("%d, step %d: %s", number, k, om_error_message());
        ++count->nstep;
        count->ncut += report.tissue.substeps > 1;
        if (status != OM_OK) {
            printf("%s %d, step %d: %s\n", kind_name[t.kind], number, k, om_error_message());
            ++count->nbad;
            continue;
        }
        count->ninverted += report.tissue.ninverted;
        if (report.tissue.substeps > 1) continue;  // the forces of other substeps are gone
        assert_ok(om_tissue_get_holding_force(r->m, r->s, f));
        double work = 0, effort = 0;
        for (size_t i = 0; i < n; ++i) work += f[i] * (om_tissue_x(r->s)[i] - x[i]);
        for (size_t i = 0; i < n; i += 3) {
            double own = 0;
            for (size_t c = i; c < i + 3; ++c) own += f[c] * (om_tissue_x(r->s)[c] - x[c]);
            effort += fabs(own);
        }
        double gain = energy_of(r) - before - work,
               bound = 0.01 * (begin_energy.elastic + begin_energy.kinetic + effort) +
                       1e-6 * r->m->total_mu;
        count->worst = fmax(count->worst, gain / bound);
        if (gain > bound) {
            printf("%s %d, step %d: %.3g J gained, the bound is %.3g J\n", kind_name[t.kind],
                   number, k, gain, bound);
            ++count->ngain;
        }
    }
    uint64_t hash = om_tissue_state_hash(r->s);
    om_free(x), om_free(f);
    rig_done(r);
    return hash;
}

static void test_random(void** context) {
    (void)context;
    Count count[NKIND] = {0};
    int stride = test_count(12, 1) | 1;  // odd and not of three: all kinds and laws
    for (int number = 0; number < NCASE; number += stride)
        run_try(number, 1, &count[number % NKIND]);
    for (int k = 0; k < NKIND; ++k)
        printf("%s: %d of %d steps not OM_OK, %d cut; under OM_OK %d inverted, %d with energy "
               "gained, at most %.2g of the bound\n",
               kind_name[k], count[k].nbad, count[k].nstep, count[k].ncut, count[k].ninverted,
               count[k].ngain, count[k].worst);
    for (int k = 0; k < NKIND; ++k) {
        assert_int_equal(count[k].ninverted, 0);
        assert_int_equal(count[k].ngain, 0);
    }
}

// The same bytes with one worker and with four.
static void test_random_workers(void** context) {
    (void)context;
    Count count = {0};
    for (int number = 1; number < NCASE; number += test_count(120, 10) | 1)
        assert_true(run_try(number, 1, &count) == run_try(number, 4, &count));
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random),
                                       cmocka_unit_test(test_random_workers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
