// heuristic_spring.c: a spring on every edge of the mesh, as an engine with a system matrix.
//
// Stiffness after Van Gelder (1998), k = sum E V / l^2 over the elements at the edge. An element's six springs
// resist a small strain e with V/2 e : C : e, C = sum (k l^2 / V) n n n n: at small strain the network is linear
// finite elements of that tensor, which depends on the element's shape. Averaged over directions C is isotropic
// with lambda = mu = S / 15, S = sum k l^2 / V = 6 E (Cauchy's relations), so Poisson's ratio is 1/4 and Young's
// modulus 5/2 mu = E: with this k, and no other factor, a mesh without preferred directions has the modulus E.
// Lloyd, Szekely and Harders (2007) fit a regular tetrahedron and get 0.96 E.
//
// The tangent of a spring is k (u u^T + t (I - u u^T)), t = 1 - l0 / l. In a compressed spring t < 0 is replaced by
// 0, so that A is positive definite for any step and shape (Baraff and Witkin 1998). Every vertex gathers its row
// from its own springs. Each spring is evaluated from both ends: this gives exact transposes, needs no scratch,
// atomics or colours, and the same bytes for any number of workers.
#include <string.h>

#include "omentum/heuristic.h"
#include "tissue/tissue_internal.h"

#define COLLAPSED 1e-9  // of the rest length: the spring has no direction of its own
#define NPART 64        // parts of the vertices, each summed by one worker

typedef struct Springs {  // model->data
    int* adr;             // first spring of each vertex, in the order of its row of A  (nvert + 1)
    OmSpring* spring;     // both ends of each                                          (2 edges)
} Springs;

// ---- model --------------------------------------------------------------------------------------------

static double young_of(const OmTissueModel* m, int e) {
    double lambda, mu, bulk;
    om_material_lame(&m->def.material[m->def.nmaterial > 0 ? m->mesh.tet_label[e] : 0], &lambda,
                     &mu, &bulk);
    return mu * (3 * lambda + 2 * mu) / (lambda + mu);  // lambda + 2/3 mu and mu are positive
}

static OmStatus add_element(const OmTissueModel* m, const OmBsr* A, int e, Springs* net) {
    const int* v = m->mesh.tet_vert + 4 * (size_t)e;
    double EV = young_of(m, e) * m->volume[e];
    for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
            if (a == b) continue;
            int i = v[a], j = v[b];
            // i + 1 diagonal blocks before it
            OmSpring* s = &net->spring[om_bsr_find(A, i, j) - i - 1];
            s->vert = j;
            s->length = om_distance(om_load3(m->mesh.x, i), om_load3(m->mesh.x, j));
            s->stiffness += EV / (s->length * s->length);
            OM_CHECK(s->length > 0 && isfinite(s->stiffness), OM_INVALID,
                     "springs: element %d has an edge of %g m, too short to compute with", e,
                     s->length);
        }
    }
    return OM_OK;
}

static void springs_destroy(OmTissueModel* m) {
    Springs* net = m->data;
    if (!net) return;
    om_free(net->adr);
    om_free(net->spring);
    om_free(net);
    m->data = NULL;
}

static OmStatus springs_create(OmTissueModel* m) {
    OmBsr A = {0};
    OmStatus status = OM_OK;
    Springs* net = om_calloc(1, sizeof *net);
    if (!net) return OM_NO_MEMORY;
    m->data = net;  // freed with the model, also after a failure below
    OM_TRY_DONE(om_bsr_create(m->mesh.nvert, m->mesh.ntet, 4, m->mesh.tet_vert, &A));
    OM_ALLOC_DONE(net->adr, m->mesh.nvert + 1);
    for (int i = 0; i <= m->mesh.nvert; ++i) net->adr[i] = A.row_adr[i] - i;
    OM_CALLOC_DONE(net->spring, 2 * (size_t)A.nedge);
    for (int e = 0; e < m->mesh.ntet; ++e) OM_TRY_DONE(add_element(m, &A, e, net));
done:
    om_bsr_destroy(&A);
    return status;
}

static size_t springs_get_memory(const OmTissueModel* m, const OmTissueWork* w) {
    const Springs* net = m->data;
    (void)w;
    return sizeof *net + ((size_t)m->mesh.nvert + 1) * sizeof(int) +
           (size_t)net->adr[m->mesh.nvert] * sizeof(OmSpring);
}

int om_heuristic_springs(const OmTissueModel* m, const int** adr, const OmSpring** spring) {
    *adr = NULL;
    *spring = NULL;
    if (m->engine != om_spring_engine()) return 0;
    const Springs* net = m->data;
    *adr = net->adr;
    *spring = net->spring;
    return net->adr[m->mesh.nvert];
}

// ---- one spring ---------------------------------------------------------------------------------------

typedef struct Pull {
    OmVec3 u;     // unit direction to the other end
    double gain;  // length minus rest length, m
    double t;     // of the tangent, k (t I + (1 - t) u u^T)
} Pull;

// Coinciding ends are pushed apart along the rest direction, because they define no other.
static Pull look_at(const OmTissueModel* m, const double* x, int i, const OmSpring* s) {
    OmVec3 d = om_sub(om_load3(x, s->vert), om_load3(x, i));
    double l = om_norm(d);
    if (l > COLLAPSED * s->length)
        return (Pull){om_scale(1 / l, d), l - s->length, 1 - s->length / l};
    OmVec3 rest = om_sub(om_load3(m->mesh.x, s->vert), om_load3(m->mesh.x, i));
    return (Pull){om_scale(1 / s->length, rest), l - s->length, 0};
}

static OmVec3 force_at(const OmTissueModel* m, const double* x, int i) {
    const Springs* net = m->data;
    OmVec3 f = {0, 0, 0};
    for (int k = net->adr[i]; k < net->adr[i + 1]; ++k) {
        Pull p = look_at(m, x, i, &net->spring[k]);
        f = om_madd(f, net->spring[k].stiffness * p.gain, p.u);
    }
    return f;
}

// Half of the energy of the springs at vertex i.
static double energy_at(const OmTissueModel* m, const double* x, int i) {
    const Springs* net = m->data;
    double sum = 0;
    for (int k = net->adr[i]; k < net->adr[i + 1]; ++k) {
        double gain = look_at(m, x, i, &net->spring[k]).gain;
        sum += 0.25 * net->spring[k].stiffness * gain * gain;
    }
    return sum;
}

// ---- the system of a step -----------------------------------------------------------------------------

typedef struct Rows {
    const OmTissueModel* m;
    const OmTissueState* s;
    OmTissueWork* w;
    const OmAssembly* at;
} Rows;

static void write_block(float* out, OmMat3 K) {
    const OmVec3 col[3] = {K.cx, K.cy, K.cz};
    for (int c = 0; c < 3; ++c) {
        out[3 * c] = (float)col[c].x;
        out[3 * c + 1] = (float)col[c].y;
        out[3 * c + 2] = (float)col[c].z;
    }
}

// Mass, its damping, weight, external forces and the spring of an attachment; elastic: force and diagonal block.
static void write_vertex(const Rows* rows, int i, OmVec3 elastic, OmMat3 diagonal) {
    const OmTissueModel* m = rows->m;
    const OmAssembly* at = rows->at;
    double mass = m->mass[i], inertia = mass * at->mass;
    OmVec3 v = om_load3(at->v, i);
    OmVec3 f = om_add(elastic, om_load3(om__state_array(rows->s, OM__F_EXT), i));
    f = om_madd(f, mass, om_madd(m->def.gravity, -m->def.rayleigh_mass, v));
    double k = om__state_stiffness(rows->s)[i];
    if (k > 0) {
        OmVec3 place = om_madd(om_load3(at->x, i), at->spring_lag, v);
        f = om_madd(f, k, om_sub(om_load3(om__state_array(rows->s, OM__ANCHOR), i), place));
        inertia += at->spring * k;
    }
    diagonal = om_mat3_add(diagonal, om_mat3_diag(om_vec3(inertia, inertia, inertia)));
    write_block(rows->w->A.value + 9 * (size_t)rows->w->A.row_adr[i], diagonal);
    om_store3(rows->w->b, i, om_scale(at->force, f));
}

static void assemble_team(void* ctx, OmTeam* team, int rank, int size) {
    (void)team;
    const Rows* rows = ctx;
    const OmTissueModel* m = rows->m;
    const OmAssembly* at = rows->at;
    const Springs* net = m->data;
    int64_t nvert = m->mesh.nvert;
    for (int i = (int)(nvert * rank / size); i < (int)(nvert * (rank + 1) / size); ++i) {
        OmVec3 v = om_load3(at->v, i), f = {0, 0, 0};
        OmMat3 diagonal = om_mat3_diag(f);
        float* block = rows->w->A.value + 9 * (size_t)rows->w->A.row_adr[i];
        for (int k = net->adr[i]; k < net->adr[i + 1]; ++k) {
            const OmSpring* s = &net->spring[k];
            Pull p = look_at(m, at->x, i, s);
            double t = at->is_exact ? p.t : fmax(p.t, 0);
            OmMat3 K = om_mat3_scale(s->stiffness * (1 - t), om_mat3_outer(p.u, p.u));
            K = om_mat3_add(K, om_mat3_scale(s->stiffness * t, om_mat3_identity()));
            f = om_madd(f, s->stiffness * p.gain, p.u);
            f = om_madd(f, at->lag, om_mat3_apply(K, om_sub(om_load3(at->v, s->vert), v)));
            K = om_mat3_scale(at->stiffness, K);
            diagonal = om_mat3_add(diagonal, K);
            write_block(block += 9, om_mat3_scale(-1, K));
        }
        write_vertex(rows, i, f, diagonal);
    }
}

static OmStatus springs_assemble(const OmTissueModel* m, const OmTissueState* s, OmTissueWork* w,
                                 const OmAssembly* at) {
    Rows rows = {m, s, w, at};
    om_parallel_team(m->def.solver.nworker, assemble_team, &rows);
    return OM_OK;
}

// ---- forces and energy --------------------------------------------------------------------------------

static OmStatus springs_add_internal_force(const OmTissueModel* m, const double* x,
                                           const unsigned char* mask, double* force, OmVec3* sum) {
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (mask && !mask[i]) continue;
        OmVec3 f = force_at(m, x, i);
        *sum = om_add(*sum, f);
        if (force) om_store3(force, i, om_add(om_load3(force, i), f));
    }
    return OM_OK;
}

static OmStatus springs_get_energy(const OmTissueModel* m, const double* x, double* energy) {
    *energy = 0;
    for (int i = 0; i < m->mesh.nvert; ++i) *energy += energy_at(m, x, i);
    return OM_OK;
}

typedef struct Balance {
    const OmTissueModel* m;
    const double* x;
    double* force;
    double part[NPART];
} Balance;

static void balance_range(void* ctx, int begin, int end, int block) {
    Balance* a = ctx;
    int64_t nvert = a->m->mesh.nvert;
    a->part[block] = 0;
    for (int i = (int)(nvert * begin / NPART); i < (int)(nvert * end / NPART); ++i) {
        om_store3(a->force, i, force_at(a->m, a->x, i));
        a->part[block] += energy_at(a->m, a->x, i);
    }
}

static OmStatus springs_eval_balance(const OmTissueModel* m, OmTissueWork* w, const double* x,
                                     double* force, double* energy) {
    (void)w;
    Balance a = {.m = m, .x = x, .force = force};
    om_parallel_for(m->def.solver.nworker, NPART, 1, balance_range, &a);
    *energy = 0;
    for (int k = 0; k < NPART; ++k) *energy += a.part[k];
    return OM_OK;
}

static const char* const number[] = {"young", "poisson", "rayleigh_mass", "rayleigh_stiffness",
                                     NULL};
static const OmTissueEngine engine = {
    .version = OM_ENGINE_VERSION,
    .name = "springs",
    .summary = "springs on edges, no law",
    .number = number,
    .has_springs = true,
    .create = springs_create,
    .destroy = springs_destroy,
    .assemble = springs_assemble,
    .add_internal_force = springs_add_internal_force,
    .get_energy = springs_get_energy,
    .eval_balance = springs_eval_balance,
    .get_memory = springs_get_memory,
};

const OmTissueEngine* om_spring_engine(void) { return &engine; }
