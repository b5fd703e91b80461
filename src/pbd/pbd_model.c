// pbd_model.c: validation of definitions, masses of particles, the engine's table of functions.
#include <string.h>

#include "pbd/pbd_internal.h"

#define PBD_COOKIE 0x9bd0001u
#define TABLE_SUBSTEPS 3  // of clusters, Table 3.1
#define ELASTIC_SUBSTEPS 20
#define MOST_SUBSTEPS 100  // chosen from the body
// Strain of the lowest clusters by the body's weight, where substeps are chosen.
#define WEIGHT_STRAIN 0.05
#define SAGGING 0.15      // such a strain is worth a warning
#define COMMON_STEP 0.02  // s, the step that the warning assumes

static const OmTissueEngine engine[OM_PBD_LENGTHS + 1];  // by OmPbdKind
static OmStatus pbd_create(OmTissueModel* m);

OmPbdDef om_pbd_default_def(OmPbdKind kind) {
    bool is_elastic = kind != OM_PBD_CLUSTERS;
    OmPbdDef def = {.kind = kind,
                    .substeps = 0,
                    .iterations = is_elastic ? 1 : 9,
                    .damping = is_elastic ? 0 : 12,
                    .max_speed = 10,
                    .cluster_spacing = 0.0127,
                    .cluster_radius = 0.0095,
                    .cluster_stiffness = 0.361,
                    .internal_friction = -1,
                    .edge_stiffness = 10,
                    .volume_stiffness = 1e4,
                    .collision_distance = 0.003,
                    .recover_speed = 0.5,
                    .friction = 0.35,
                    .particle_friction = 0.25,
                    .has_self_collision = !is_elastic,
                    .cookie = PBD_COOKIE};
    return def;
}

static OmStatus check_clusters(const OmPbdDef* def) {
    OM_CHECK(def->cluster_spacing >= 1e-6 && def->cluster_spacing <= 10, OM_INVALID,
             "pbd: cluster_spacing is %g m; it must be from 1e-6 to 10", def->cluster_spacing);
    OM_CHECK(def->cluster_radius <= 100, OM_INVALID,
             "pbd: cluster_radius is %g m; it must be at most 100", def->cluster_radius);
    OM_CHECK(
        def->cluster_radius >= 0.5 * def->cluster_spacing, OM_INVALID,
        "pbd: cluster_radius is %g mm, less than half of cluster_spacing, %g mm: particles between "
        "clusters would belong to none; set it to %g mm or more",
        1e3 * def->cluster_radius, 1e3 * def->cluster_spacing, 500 * def->cluster_spacing);
    OM_CHECK(def->cluster_stiffness >= 0 && def->cluster_stiffness <= 1, OM_INVALID,
             "pbd: cluster_stiffness is %g; it must be from 0 to 1", def->cluster_stiffness);
    OM_CHECK(def->linear_stretch >= 0 && def->linear_stretch <= 1, OM_INVALID,
             "pbd: linear_stretch is %g; it must be from 0 (rigid clusters) to 1",
             def->linear_stretch);
    return OM_OK;
}

static OmStatus check_def(const OmPbdDef* def) {
    OM_CHECK(def->cookie == PBD_COOKIE, OM_INVALID,
             "pbd: the definition was not made by om_pbd_default_def");
    OM_CHECK(def->kind >= OM_PBD_CLUSTERS && def->kind <= OM_PBD_LENGTHS, OM_INVALID,
             "pbd: kind %d is none of OmPbdKind", (int)def->kind);
    OM_CHECK(def->substeps >= 0 && def->substeps <= 1000, OM_INVALID,
             "pbd: substeps is %d; it must be from 1 to 1000, or 0 (chosen)", def->substeps);
    OM_CHECK(def->iterations >= 1 && def->iterations <= 1000, OM_INVALID,
             "pbd: iterations is %d; it must be from 1 to 1000", def->iterations);
    OM_CHECK(def->damping >= 0 && def->damping <= 1e6, OM_INVALID,
             "pbd: damping is %g 1/s; it must be from 0 to 1e6", def->damping);
    OM_CHECK(def->internal_friction == -1 ||
                 (def->internal_friction >= 0 && def->internal_friction <= 1e3),
             OM_INVALID,
             "pbd: internal_friction is %g s; it must be from 0 to 1000, or -1 (by the step)",
             def->internal_friction);
    OM_CHECK(def->max_speed > 0 && def->max_speed <= 1e6, OM_INVALID,
             "pbd: max_speed is %g m/s; it must be above 0 and at most 1e6", def->max_speed);
    OM_CHECK(def->collision_distance >= 0 && def->collision_distance <= 1, OM_INVALID,
             "pbd: collision_distance is %g m; it must be from 0 to 1", def->collision_distance);
    OM_CHECK(def->recover_speed > 0 && def->recover_speed <= 100, OM_INVALID,
             "pbd: recover_speed is %g m/s; it must be above 0 and at most 100",
             def->recover_speed);
    OM_CHECK(def->friction >= 0 && def->friction <= 10, OM_INVALID,
             "pbd: friction is %g; it must be from 0 to 10", def->friction);
    OM_CHECK(def->particle_friction >= 0 && def->particle_friction <= 10, OM_INVALID,
             "pbd: particle_friction is %g; it must be from 0 to 10", def->particle_friction);
    OM_CHECK(def->edge_stiffness >= 1e-9 && def->edge_stiffness <= 1e9, OM_INVALID,
             "pbd: edge_stiffness is %g N/m; it must be from 1e-9 to 1e9", def->edge_stiffness);
    OM_CHECK(def->volume_stiffness >= 0 && def->volume_stiffness <= 1e12, OM_INVALID,
             "pbd: volume_stiffness is %g Pa; it must be from 0 to 1e12", def->volume_stiffness);
    return check_clusters(def);
}

static OmStatus pbd_lump_mass(const OmTissueModel* m, double* mass) {
    const OmPbdDef* def = m->options;
    double volume = def ? def->particle_volume : 0;
    OM_CHECK(
        volume > 1e-30 && volume < 1e3, OM_INVALID,
        "pbd: particle_volume is %g m^3; a mesh without elements needs it: om_pbd_sample_* gives it",
        volume);
    for (int i = 0; i < m->mesh.nvert; ++i) mass[i] = m->def.density * volume;
    return OM_OK;
}

static void pbd_destroy(OmTissueModel* m) {
    OmPbd* pbd = m->data;
    if (!pbd) return;
    om__pbd_clusters_done(&pbd->shape);
    om__pbd_elastic_done(&pbd->elastic);
    om_free(pbd);
    m->data = NULL;
}

// Null for a model of another engine.
static const OmPbd* pbd_of(const OmTissueModel* m) {
    return m->engine->create == pbd_create ? m->data : NULL;
}

// ---- stiffness of clusters ----------------------------------------------------------------------------

// In an iteration a particle goes alpha of the way from where it is to the mean of its clusters' goals. Of a
// smooth displacement u the means of clusters and the mean over the clusters of a particle leave
// u + spread2 u'': small clusters pull at curvature alone, as a rod does. What weight adds in a substep, g sub^2,
// is taken back by the iterations where alpha iterations spread2 u'' = -g sub^2: a rod of the modulus
// density iterations alpha spread2 / sub^2 (Poisson's ratio 0). A share linear_stretch of u' is let go.
static double carry_of(const OmTissueModel* m) {
    const OmPbd* pbd = m->data;
    const OmPbdDef* def = &pbd->def;
    return def->iterations * def->cluster_stiffness * (1 - def->linear_stretch) *
           pbd->shape.spread2;
}

int om_pbd_substeps(const OmTissueModel* m, double h) {
    const OmPbd* pbd = pbd_of(m);
    if (!pbd) return 0;
    if (pbd->def.substeps > 0) return pbd->def.substeps;
    if (pbd->def.kind != OM_PBD_CLUSTERS) return ELASTIC_SUBSTEPS;
    double carry = carry_of(m), weight = om_norm(m->def.gravity) * pbd->shape.height;
    if (!(weight > 0)) return TABLE_SUBSTEPS;
    if (!(carry > 0)) return MOST_SUBSTEPS;
    double min = ceil(h * sqrt(weight / (WEIGHT_STRAIN * carry)) * (1 - 1e-9));
    return (int)fmin(fmax(min, TABLE_SUBSTEPS), MOST_SUBSTEPS);
}

double om_pbd_modulus(const OmTissueModel* m, double h) {
    const OmPbd* pbd = pbd_of(m);
    if (!pbd || pbd->def.kind != OM_PBD_CLUSTERS || !(h > 0)) return 0;
    double sub = h / om_pbd_substeps(m, h);
    return m->def.density * carry_of(m) / (sub * sub);
}

double om_pbd_weight_strain(const OmTissueModel* m, double h) {
    const OmPbd* pbd = pbd_of(m);
    if (!pbd || pbd->def.kind == OM_PBD_ELASTIC) return 0;
    double modulus = om_pbd_modulus(m, h);
    double stress = m->def.density * om_norm(m->def.gravity) * pbd->shape.height;
    return stress > 0 ? stress / fmax(modulus, 1e-300) : 0;
}

static void warn_of_sagging(const OmTissueModel* m) {
    const OmPbd* pbd = m->data;
    double strain = om_pbd_weight_strain(m, COMMON_STEP);
    if (strain < SAGGING) return;
    om_log(OM_LOG_WARNING,
           "pbd: in steps of %g ms, %d substeps of %d iterations give the clusters a modulus of "
           "%.3g Pa: their own weight compresses the lowest by %.0f %%; %s",
           1e3 * COMMON_STEP, om_pbd_substeps(m, COMMON_STEP), pbd->def.iterations,
           om_pbd_modulus(m, COMMON_STEP), 100 * strain,
           pbd->def.substeps > 0 ? "leave substeps at 0 to have them chosen from the body"
                                 : "enlarge cluster_radius, cluster_stiffness or iterations");
}

static OmStatus create_clusters(OmTissueModel* m, OmPbd* pbd) {
    OM_TRY(om__pbd_make_clusters(m, &pbd->def, &pbd->shape));
    warn_of_sagging(m);
    return OM_OK;
}

static OmStatus pbd_create(OmTissueModel* m) {
    OmPbdKind kind = m->engine == &engine[OM_PBD_ELASTIC] ? OM_PBD_ELASTIC : OM_PBD_CLUSTERS;
    OmPbdDef def = m->options ? *(const OmPbdDef*)m->options : om_pbd_default_def(kind);
    OM_TRY(check_def(&def));
    OmPbd* pbd = om_calloc(1, sizeof *pbd);
    if (!pbd) return OM_NO_MEMORY;
    m->data = pbd;  // freed with the model, also after a failure below
    m->engine = &engine[def.kind];
    pbd->def = def;
    pbd->has_pairs = def.has_self_collision && def.collision_distance > 0;
    if (def.kind == OM_PBD_CLUSTERS) return create_clusters(m, pbd);
    OM_TRY(om__pbd_make_elastic(m, &pbd->elastic));
    return def.kind == OM_PBD_LENGTHS ? om__pbd_make_lengths(m, &def, &pbd->elastic) : OM_OK;
}

// ---- the engine's part of a state: rotations of clusters ----------------------------------------------

static size_t pbd_get_state_size(const OmTissueModel* m) {
    const OmPbd* pbd = m->data;
    return 4 * (size_t)(pbd->shape.nbatch * OM__PBD_LANE) * sizeof(double);
}

// Positions set from outside may be rotated by any angle: rotations come from the polar decomposition, one by one.
static void pbd_sync_state(const OmTissueModel* m, OmTissueState* s) {
    const OmPbd* pbd = m->data;
    const OmPbdClusters* shape = &pbd->shape;
    const double* x = om__state_array(s, OM__X);
    double* turn = om__state_engine(s);
    for (int c = 0; c < shape->nbatch * OM__PBD_LANE; ++c) {
        OmMat3 A = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
        for (int n = c < shape->ncluster ? shape->adr[c] : 0;
             c < shape->ncluster && n < shape->adr[c + 1]; ++n)
            A = om_mat3_add(A, om_mat3_outer(om_load3(x, shape->vert[n]),
                                             om_load3(shape->weight + 4 * (size_t)n + 1, 0)));
        double scale = om_mat3_norm(A);
        OmQuat q = om_quat_identity();
        if (scale > 1e-100 && isfinite(scale))
            q = om_quat_from_mat3(om_mat3_polar(om_mat3_scale(1 / scale, A)));
        double* out = turn + 4 * (size_t)(c / OM__PBD_LANE * OM__PBD_LANE) + c % OM__PBD_LANE;
        out[0] = q.x;
        out[OM__PBD_LANE] = q.y;
        out[2 * OM__PBD_LANE] = q.z;
        out[3 * OM__PBD_LANE] = q.w;
    }
}

// ---- work -------------------------------------------------------------------------------------------

static void pbd_destroy_work(OmTissueWork* w) {
    OmPbdWork* pw = w->data;
    if (!pw) return;
    om_free(pw->begin);
    om_free(pw->map);
    om_free(pw->hold);
    om_free(pw->v_begin);
    om_free(pw->pull);
    om_free(pw->normal_sum);
    om_free(pw->friction_sum);
    om__pbd_pairs_done(&pw->pairs);
    om_free(pw->give);
    om_free(pw->lambda);
    om_free(pw->gap_goal);
    om_free(pw->plane);
    om_free(pw->kind);
    om_free(pw->prescribed);
    om_free(pw->way);
    om_free(pw->is_near);
    om_free(pw->push);
    om_free(pw->frame);
    om_free(pw);
    w->data = NULL;
}

static OmStatus pbd_create_work(const OmTissueModel* m, OmTissueWork* w) {
    const OmPbd* pbd = m->data;
    OmPbdWork* pw = om_calloc(1, sizeof *pw);
    if (!pw) return OM_NO_MEMORY;
    w->data = pw;  // freed with the work, also after a failure below
    size_t n = (size_t)m->mesh.nvert, ncluster = (size_t)pbd->shape.ncluster;
    pw->begin = om_calloc(3 * n, sizeof(double));
    pw->map = om_calloc(OM__PBD_MAP * ncluster, sizeof(double));
    pw->hold = om_calloc(3 * n, sizeof(double));
    pw->v_begin = om_calloc(3 * n, sizeof(double));
    pw->pull = om_calloc(3 * n, sizeof(double));
    pw->normal_sum = om_calloc(n, sizeof(double));
    pw->friction_sum = om_calloc(n, sizeof(double));
    pw->kind = om_calloc(n, 1);
    pw->prescribed = om_calloc(n, sizeof *pw->prescribed);
    pw->way = om_calloc(3 * n, sizeof(double));
    pw->give = om_calloc(n, sizeof(double));
    pw->lambda = om_calloc(om__pbd_nlambda(pbd), sizeof(double));
    if (!pw->begin || !pw->give || !pw->lambda || !pw->kind || !pw->prescribed || !pw->way ||
        !pw->map || !pw->hold || !pw->v_begin || !pw->pull || !pw->normal_sum || !pw->friction_sum)
        return OM_NO_MEMORY;
    pw->size = (18 * n + om__pbd_nlambda(pbd) + OM__PBD_MAP * ncluster) * sizeof(double) +
               n * (1 + sizeof *pw->prescribed);
    if (pbd->has_pairs) OM_TRY(om__pbd_make_pairs(m->mesh.nvert, &pw->pairs));
    pw->size += pw->pairs.size;
    return om__pbd_reserve(pw, m->mesh.nvert, 2);
}

static size_t pbd_get_memory(const OmTissueModel* m, const OmTissueWork* w) {
    const OmPbd* pbd = m->data;
    const OmPbdWork* pw = w->data;
    size_t ncluster = (size_t)pbd->shape.ncluster;
    size_t nmember = ncluster > 0 ? (size_t)pbd->shape.adr[ncluster] : 0;
    if (pbd->elastic.ntet > 0)
        return sizeof *pbd +
               (size_t)pbd->elastic.ntet *
                   (sizeof *pbd->elastic.tet +
                    (pbd->elastic.length ? sizeof *pbd->elastic.length : 0)) +
               sizeof *pw + pw->size;
    return sizeof *pbd + nmember * (2 * sizeof(int) + 4 * sizeof(double)) +
           ncluster * (sizeof(int) + 21 * sizeof(double)) +
           (size_t)m->mesh.nvert * (sizeof(int) + sizeof(double)) + sizeof *pw + pw->size;
}

// ---- views ------------------------------------------------------------------------------------------

int om_pbd_clusters(const OmTissueModel* m, const int** adr, const int** vert) {
    *adr = *vert = NULL;
    const OmPbd* pbd = pbd_of(m);
    if (!pbd || pbd->def.kind == OM_PBD_ELASTIC) return 0;
    *adr = pbd->shape.adr;
    *vert = pbd->shape.vert;
    return pbd->shape.ncluster;
}

// ---- the engines ------------------------------------------------------------------------------------

static OmStatus make_options(OmPbdDef def, void** options) {
    OmPbdDef* copy = om_alloc(1, sizeof *copy);
    if (!copy) return OM_NO_MEMORY;
    *copy = def;
    *options = copy;
    return OM_OK;
}

// Particles of scenes are vertices of a mesh: they lie on its surface.
static OmStatus pbd_load(const OmEngineInput* input, void** options) {
    OmPbdDef def = om_pbd_default_def(OM_PBD_CLUSTERS);
    def.cluster_spacing = om_engine_get_number(input, "cluster_spacing", def.cluster_spacing);
    def.cluster_radius = om_engine_get_number(input, "cluster_radius", def.cluster_radius);
    def.cluster_stiffness = om_engine_get_number(input, "cluster_stiffness", def.cluster_stiffness);
    def.collision_distance = 0;
    return make_options(def, options);
}

static OmStatus xpbd_load(const OmEngineInput* input, void** options) {
    (void)input;
    OmPbdDef def = om_pbd_default_def(OM_PBD_ELASTIC);
    def.collision_distance = 0;
    return make_options(def, options);
}

static const char* const cluster_number[] = {"cluster_spacing", "cluster_radius",
                                             "cluster_stiffness", NULL};
static const char* const elastic_number[] = {"young", "poisson", "rayleigh_mass",
                                             "rayleigh_stiffness", NULL};

#define COMMON_ROW                                                                              \
    .version = OM_ENGINE_VERSION, .has_springs = true, .unload = om_free, .create = pbd_create, \
    .destroy = pbd_destroy, .create_work = pbd_create_work, .destroy_work = pbd_destroy_work,   \
    .step = om__pbd_step, .lump_mass = pbd_lump_mass, .get_state_size = pbd_get_state_size,     \
    .sync_state = pbd_sync_state, .get_memory = pbd_get_memory

static const OmTissueEngine engine[OM_PBD_LENGTHS + 1] = {
    [OM_PBD_CLUSTERS] = {COMMON_ROW, .name = "pbd",
                         .summary = "particles in clusters, without law or modulus",
                         .number = cluster_number, .load = pbd_load},
    [OM_PBD_ELASTIC] = {COMMON_ROW, .name = "xpbd", .summary = "XPBD, stable-neo-hookean",
                        .number = elastic_number, .load = xpbd_load, .has_forces = true,
                        .add_internal_force = om__pbd_add_internal_force,
                        .get_energy = om__pbd_get_energy},
    [OM_PBD_LENGTHS] = {COMMON_ROW, .name = "pbd", .summary = "XPBD, lengths and volumes",
                        .load = pbd_load, .has_forces = true},
};

const OmTissueEngine* om_pbd_engine(void) { return &engine[OM_PBD_CLUSTERS]; }
const OmTissueEngine* om_xpbd_engine(void) { return &engine[OM_PBD_ELASTIC]; }
