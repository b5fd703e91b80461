// test_tissue_crowd.c: many small bodies of quadratic elements, stepped in parallel, each with a state and a work of
// its own: the same bytes with one worker and with several, and with a model that all share or one model each.
#include "test_rig.h"

#define NSTEP 8

static const OmContactPlane board = {{0, 0, -0.001}, {0, 0, 1}};

typedef struct Crowd {
    TestRig r;        // the mesh, and the model and the contact that bodies share
    TestRig* own;     // models, contacts, states and works                           (nbody)
    OmStatus* worst;  // of the steps of each body                                    (nbody)
} Crowd;

static void make_model(TestRig* r, const TestRig* from) {
    *r = *from;
    assert_ok(om_tissue_create(&r->def, &r->m));
    OmTissueObstacle obstacle = om_plane_obstacle(&board);
    OmContactDef def = rig_on(&obstacle);
    assert_ok(om_contact_create(&def, r->m, &r->c));
}

// Body k is thrown in a direction of its own and meets the board; every third is held at one vertex and pulled.
static void step_bodies(void* ctx, int begin, int end, int block) {
    (void)block;
    Crowd* c = ctx;
    for (int k = begin; k < end; ++k) {
        TestRig* b = &c->own[k];
        for (int n = 0; n < NSTEP && c->worst[k] >= 0; ++n) {
            int vert = k % b->mesh.nvert;
            double at[3] = {b->mesh.x[3 * vert], b->mesh.x[3 * vert + 1],
                            b->mesh.x[3 * vert + 2] + 1e-4 * (n + 1)};
            OmStatus status = OM_OK;
            if (k % 3 == 0) status = om_tissue_set_attachment(b->m, b->s, 1, &vert, at, NULL);
            if (status >= 0) status = om_contact_step(b->cw, b->m, b->s, b->w, 0.01, NULL);
            if (status != OM_OK) c->worst[k] = status;
        }
    }
}

// Hashes of the bodies after NSTEP steps.
static void run(Crowd* c, int nbody, int nworker, bool is_shared, uint64_t* hash) {
    for (int k = 0; k < nbody; ++k) {
        TestRig* b = &c->own[k];
        if (is_shared)
            *b = c->r;
        else
            make_model(b, &c->r);
        assert_ok(om_tissue_state_create(b->m, &b->s));
        assert_ok(om_tissue_work_create(b->m, &b->w));
        assert_ok(om_contact_work_create(b->c, &b->cw));
        OmVec3 way = om_vec3(0.3 * cos(k), 0.3 * sin(k), -0.2 - 1e-3 * k);
        const OmTetMesh* mesh = om_tissue_mesh(b->m);
        double* v = om_alloc(3 * (size_t)mesh->nvert, sizeof *v);
        assert_non_null(v);
        for (int i = 0; i < mesh->nvert; ++i) om_store3(v, i, way);
        assert_ok(om_tissue_set_x(b->m, b->s, mesh->x, v));
        om_free(v);
        c->worst[k] = OM_OK;
    }
    om_worker_force(true);  // as many threads, whatever the machine has
    om_parallel_for(nworker, nbody, 1, step_bodies, c);
    om_worker_force(false);
    for (int k = 0; k < nbody; ++k) {
        TestRig* b = &c->own[k];
        assert_int_equal(c->worst[k], OM_OK);
        hash[k] = om_tissue_state_hash(b->s);
        om_contact_work_destroy(b->cw);
        om_tissue_work_destroy(b->w);
        om_tissue_state_destroy(b->s);
        if (is_shared) continue;
        om_contact_destroy(b->c);
        om_tissue_destroy(b->m);
    }
}

static void test_same_bytes(void** context) {
    (void)context;
    const int nbody = test_count(24, 1000), nworker[] = {1, 2, 8};
    Crowd c;
    rig_box(&c.r, om_vec3(0, 0, 0), om_vec3(0.02, 0.01, 0.01), 2, 1, 1);
    c.r.def.element = OM_ELEMENT_QUADRATIC;
    c.r.def.mesh = &c.r.mesh;
    TestRig plain = c.r;
    make_model(&c.r, &plain);
    c.own = om_calloc((size_t)nbody, sizeof *c.own);
    c.worst = om_calloc((size_t)nbody, sizeof *c.worst);
    uint64_t *alone = om_alloc((size_t)nbody, sizeof *alone),
             *hash = om_alloc((size_t)nbody, sizeof *hash);
    for (int k = 0; k < 6; ++k) {
        run(&c, nbody, nworker[k % 3], k < 3, k == 0 ? alone : hash);
        for (int i = 0; i < nbody && k > 0; ++i) assert_true(hash[i] == alone[i]);
    }
    // no body is a copy of another
    for (int i = 0; i < nbody; ++i)
        for (int j = 0; j < i; ++j) assert_true(alone[i] != alone[j]);
    printf("%d bodies: the same bytes with 1, 2 and 8 workers, with one model and with %d\n", nbody,
           nbody);
    om_free(alone), om_free(hash), om_free(c.worst), om_free(c.own);
    c.r.s = NULL, c.r.w = NULL, c.r.cw = NULL;
    rig_done(&c.r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bytes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
