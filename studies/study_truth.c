// study_truth.c: the reference displacement of a lesion.
//
// It does not use the tested models: quadratic tetrahedra in double precision, lesions stiffer than the
// tissue around them, static equilibrium by Newton's method, and another contact: an integral over the
// faces instead of a condition on vertices,
//
//     p(g) = p0 exp(-g / e),    g the exact distance to the probe's rounded box,
//
// integrated over the rest shape with 64 points a face. With e = 0.2 mm the gap deviates from 0 by 0.2 mm where
// the pressure varies by a factor of 2.7; p0 is chosen so that the gap's mean, weighted by p, is 0. The pressure
// is smooth. With a linear penalty of the same accuracy Newton's method alternates between states; so it does
// with multipliers at those points, which are more numerous than the nodes.
//
// The first guess at each depth is a run of linear tetrahedra on the same mesh, with penalty contact: it
// has no inverted element, and its error is some tenths of a millimetre. A mesh with an eighth of the
// elements is pressed along the same path: the difference checks the refinement.
//
// An element that a lesion cuts has the volume average of the modulus, so that lesions keep their volume
// on meshes that do not follow their surface.
#include <math.h>
#include <string.h>

#include "omentum/fem.h"
#include "omentum/tissue.h"
#include "studies/study_internal.h"

#define SOFTNESS 2e-4  // m, e
#define SINK 1e-5      // m, tolerance of the mean gap
#define MAX_TURN 3
#define MIN_PRESSURE 0.05  // of p0, in Young's moduli: at light contact
#define FAR 16             // in e: beyond this distance the pressure is neglected
#define LINEAR 4           // from p = p0 exp(LINEAR) on, p grows linearly
#define NSPLIT 8           // a face has NSPLIT^2 points
#define NPOINT (NSPLIT * NSPLIT)
#define COARSER 8         // ratio of the numbers of elements of fine and coarse mesh
#define LEAD_STEP 0.0005  // m per step of the linear tetrahedra, which takes LEAD_TIME
#define LEAD_TIME 0.05
#define STEP 0.0025     // m, of the coarse path
#define MIN_STEP 0.2    // of STEP; at a smaller step the depth is left out
#define TOLERANCE 1e-4  // of equilibrium
#define VERSION 2       // of the contents of a result
#define NFRACTION 8     // steps of the volume fraction of an element inside lesions
#define NSAMPLE 5       // points along an edge to measure that fraction

typedef struct Level {  // the heterogeneous body on one mesh
    OmFemMesh mesh;
    OmFemSolid* solid;
    OmFemFaces face;
    unsigned char* fixed;  // (nnode x 3)
    double *x, *before;    // positions now and at the last depth (nnode x 3)
    OmTissueModel* model;  // linear tetrahedra on the same mesh, for first guesses
    OmTissueState* state;
    OmTissueWork* work;
    OmPress* press;
    // elements of the centres, then contour points of all lesions, and their weights
    int* lesion_elem;
    double* lesion_weight;
} Level;

struct StudyTruth {
    const OmStudyContactDef* def;
    const OmProbe* probe;
    Level coarse, fine;
};

// ---- contact --------------------------------------------------------------------------------------

typedef struct Touch {
    Level* level;
    const OmProbe* probe;
    const OmStudyLesion* lesion;
    double young;     // of the tissue, Pa
    double pressure;  // p0, Pa
    int nturn;        // how often p0 was changed
    double from, to;  // m, depth at loads 0 and 1
    bool has_matrix;  // the last evaluation made one
    OmVec3 force;     // of the last evaluation: N, on the probe
    double sink;      // m, of the last evaluation: mean depth inside the probe
} Touch;

// Shape functions of the quadratic triangle at point i of NPOINT: corners, then edges 01 12 20.
static void face_shape(int i, double N[6]) {
    int row = (int)sqrt((double)i), col = i - row * row;  // row r has 2 r + 1 subtriangles
    double up = col % 2 ? 2.0 / 3 : 1.0 / 3;              // every second one is upside down
    double L1 = (row - col / 2 - (col % 2) + up) / NSPLIT, L2 = (col / 2 + up) / NSPLIT;
    double L0 = 1 - L1 - L2;
    N[0] = L0 * (2 * L0 - 1);
    N[1] = L1 * (2 * L1 - 1);
    N[2] = L2 * (2 * L2 - 1);
    N[3] = 4 * L0 * L1;
    N[4] = 4 * L1 * L2;
    N[5] = 4 * L2 * L0;
}

static double face_area(const OmFemMesh* mesh, const int* node) {
    OmVec3 a = om_load3(mesh->x, node[0]);
    return 0.5 * om_norm(om_cross(om_sub(om_load3(mesh->x, node[1]), a),
                                  om_sub(om_load3(mesh->x, node[2]), a)));
}

// Second derivative of the distance in the probe's frame, by central differences of its normal.
static OmMat3 curvature(const OmProbe* probe, OmVec3 q) {
    const double d = 1e-7;
    OmVec3 col[3];
    for (int i = 0; i < 3; ++i) {
        OmVec3 e = om_vec3(i == 0 ? d : 0, i == 1 ? d : 0, i == 2 ? d : 0), n1, n0;
        om_probe_eval_distance(probe, om_add(q, e), &n1);
        om_probe_eval_distance(probe, om_sub(q, e), &n0);
        col[i] = om_scale(0.5 / d, om_sub(n1, n0));
    }
    return om_mat3_cols(col[0], col[1], col[2]);
}

// K += the blocks of one point whose second derivative is s nn.
static void add_point_block(double s, const double N[6], OmMat3 nn, OmMat3 K[6][6]) {
    for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b)
            K[a][b] = om_mat3_add(K[a][b], om_mat3_scale(s * N[a] * N[b], nn));
}

typedef struct Push {
    double energy;     // J/m^2
    double p;          // Pa
    double stiffness;  // -dp/dg, N/m^3
} Push;

static Push push_at(double p0, double g) {
    double s = -g / SOFTNESS, over = fmax(0, s - LINEAR);
    double p = p0 * exp(fmin(s, LINEAR));
    Push push = {p * SOFTNESS * (1 + over + 0.5 * over * over), p * (1 + over), p / SOFTNESS};
    return push;
}

static OmStatus eval_touch(void* ctx, const double* x, double load, double* energy, double* f,
                           OmBsr* A) {
    Touch* t = ctx;
    const OmFemFaces* face = &t->level->face;
    OmPose pose = om__study_probe_pose(t->lesion, t->from + load * (t->to - t->from));
    OmPose inverse = om_pose_inverse(pose);
    OmMat3 R = om_quat_to_mat3(pose.q);
    bool is_again = A && t->has_matrix;  // the previous matrix was not positive definite
    t->has_matrix = A != NULL;
    t->force = om_vec3(0, 0, 0);
    double sink = 0, sum = 0;
    for (int k = 0; k < face->nface; ++k) {
        const int* node = face->face_node + (size_t)k * 6;
        OmVec3 p[6];
        OmMat3 K[6][6];
        bool has_block = false;
        for (int a = 0; a < 6; ++a) p[a] = om_pose_apply(inverse, om_load3(x, node[a]));
        double w = face_area(&t->level->mesh, node) / NPOINT;
        for (int i = 0; i < NPOINT; ++i) {
            double N[6];
            OmVec3 q = om_vec3(0, 0, 0), n;
            face_shape(i, N);
            for (int a = 0; a < 6; ++a) q = om_madd(q, N[a], p[a]);
            double g = om_probe_eval_distance(t->probe, q, &n);
            if (g > FAR * SOFTNESS) continue;
            Push push = push_at(t->pressure, g);
            sink -= w * push.p * g;
            sum += w * push.p;
            if (energy) *energy += w * push.energy;
            OmMat3 H = om_mat3_scale(push.stiffness, om_mat3_outer(n, n));
            if (A && !is_again) H = om_mat3_add(H, om_mat3_scale(-push.p, curvature(t->probe, q)));
            n = om_quat_rotate(pose.q, n);
            t->force = om_madd(t->force, -w * push.p, n);
            for (int a = 0; a < 6 && f; ++a)
                om_store3(f, node[a], om_madd(om_load3(f, node[a]), -w * push.p * N[a], n));
            if (!A) continue;
            if (!has_block) memset(K, 0, sizeof K);
            has_block = true;
            add_point_block(w, N, om_mat3_mul(om_mat3_mul(R, H), om_mat3_transpose(R)), K);
        }
        for (int a = 0; a < 6 && has_block; ++a)
            for (int b = 0; b < 6; ++b) om_bsr_add(A, om_bsr_find(A, node[a], node[b]), K[a][b]);
    }
    t->sink = sum > 0 ? sink / sum : 0;
    return OM_OK;
}

// Choose p0 so that the mean gap, weighted by the pressure, is 0.
static OmStatus centre_gap(void* ctx, const double* x, double load) {
    Touch* t = ctx;
    OM_TRY(eval_touch(t, x, load, NULL, NULL, NULL));
    if (fabs(t->sink) < SINK || t->nturn++ >= MAX_TURN) return OM_OK;
    double min = MIN_PRESSURE * t->young, last = t->pressure;
    t->pressure = fmax(min, last * exp(t->sink / SOFTNESS));
    if (t->pressure == last) return OM_OK;
    return OM_NOT_CONVERGED;
}

// ---- the body on a mesh ---------------------------------------------------------------------------

// On a lattice of points.
double om__study_lesion_share(const OmStudyBody* body, const OmVec3 v[4]) {
    int nin = 0, n = 0;
    OmVec3 lo = om_min3(om_min3(v[0], v[1]), om_min3(v[2], v[3]));
    OmVec3 hi = om_max3(om_max3(v[0], v[1]), om_max3(v[2], v[3]));
    for (int l = 0; l < body->nlesion; ++l) {
        const OmStudyLesion* s = &body->lesion[l];
        OmVec3 near = om_max3(lo, om_min3(hi, s->center));
        if (om_distance(near, s->center) > s->radius) continue;
        n = 0;
        for (int i = 0; i < NSAMPLE; ++i)
            for (int j = 0; i + j < NSAMPLE; ++j)
                for (int k = 0; i + j + k < NSAMPLE; ++k) {
                    double a = (i + 0.25) / NSAMPLE, b = (j + 0.25) / NSAMPLE,
                           c = (k + 0.25) / NSAMPLE;
                    OmVec3 p = om_madd(om_scale(1 - a - b - c, v[0]), a, v[1]);
                    p = om_madd(om_madd(p, b, v[2]), c, v[3]);
                    nin += om_distance(p, s->center) < s->radius;
                    ++n;
                }
    }
    return n ? fmin(1, (double)nin / n) : 0;
}

static void label_lesions(const OmStudyBody* body, OmTetMesh* tet) {
    for (int e = 0; e < tet->ntet; ++e) {
        OmVec3 v[4];
        for (int a = 0; a < 4; ++a) v[a] = om_load3(tet->x, tet->tet_vert[4 * e + a]);
        tet->tet_label[e] = (int)lround(NFRACTION * om__study_lesion_share(body, v));
    }
}

static OmStatus create_solid(const OmStudyContactDef* def, const OmTetMesh* tet,
                             const OmProbe* probe, Level* level) {
    OmMaterial material[NFRACTION + 1];
    for (int i = 0; i <= NFRACTION; ++i) {
        material[i] = def->material;
        material[i].young *= 1 + (def->lesion_ratio - 1) * i / NFRACTION;
    }
    OmFemDef fem = om_fem_default_def(&level->mesh, NFRACTION + 1, material);
    fem.nworker = def->nworker;
    OM_TRY(om_fem_create(&fem, &level->solid));
    OmTissueDef tissue = om_tissue_default_def(om_fem_engine(), tet);
    tissue.element = OM_ELEMENT_LINEAR;  // a solid; its statics have quadratic elements
    tissue.nmaterial = NFRACTION + 1;
    tissue.material = material;
    tissue.gravity = om_vec3(0, 0, 0);
    tissue.density = def->density;
    tissue.solver.nworker = def->nworker;
    OM_TRY(om_tissue_create(&tissue, &level->model));
    OM_TRY(om_tissue_state_create(level->model, &level->state));
    OM_TRY(om_tissue_work_create(level->model, &level->work));
    OmPressDef press = om_press_default_def(probe);
    OmSurface surface;
    OM_TRY(om__study_get_surface(def, &surface));
    press.surface = &surface;
    OmStatus status = om_press_create(&press, level->model, &level->press);
    om_surface_done(&surface);
    return status;
}

// Fix the attached vertices and the edges between them.
static OmStatus hold(const OmTetMesh* tet, Level* level) {
    const OmFemMesh* m = &level->mesh;
    const OmMeshSet* set = om_tet_mesh_find_set(tet, "attachment");
    level->fixed = om_calloc(3 * (size_t)m->nnode, 1);
    if (!level->fixed) return OM_NO_MEMORY;
    for (int i = 0; set && i < set->nvert; ++i) memset(level->fixed + 3 * set->vert[i], 1, 3);
    for (int k = 0; k < level->face.nface; ++k) {
        const int* node = level->face.face_node + (size_t)k * 6;
        for (int a = 0; a < 3; ++a)
            if (level->fixed[3 * node[a]] && level->fixed[3 * node[(a + 1) % 3]])
                memset(level->fixed + 3 * node[3 + a], 1, 3);
    }
    return OM_OK;
}

static OmStatus level_create(const OmStudyContactDef* def, const OmProbe* probe, int ntet,
                             Level* level) {
    const OmStudyBody* body = def->body;
    OmTetMesh tet;
    double* point = NULL;
    int npoint = 2 * body->nlesion;
    OmStatus status;
    OM_TRY(om__study_get_mesh(def, ntet, &tet));
    label_lesions(body, &tet);
    OM_TRY_DONE(om_fem_mesh_from_tet(&tet, OM_TET10, &level->mesh));
    OM_TRY_DONE(om_fem_mesh_boundary(&level->mesh, &level->face));
    OM_TRY_DONE(create_solid(def, &tet, probe, level));
    OM_TRY_DONE(hold(&tet, level));
    OM_ALLOC_DONE(level->x, 3 * level->mesh.nnode);
    OM_ALLOC_DONE(level->before, 3 * level->mesh.nnode);
    OM_ALLOC_DONE(level->lesion_elem, npoint);
    OM_ALLOC_DONE(level->lesion_weight, 10 * npoint);
    OM_ALLOC_DONE(point, 3 * npoint);
    for (int i = 0; i < body->nlesion; ++i) {
        om_store3(point, i, body->lesion[i].center);
        om_store3(point, body->nlesion + i, om__study_contour(&body->lesion[i]));
    }
    OM_TRY_DONE(
        om_fem_mesh_embed(&level->mesh, npoint, point, level->lesion_elem, level->lesion_weight));
done:
    om_free(point);
    om_tet_mesh_done(&tet);
    return status;
}

static void level_done(Level* level) {
    om_fem_destroy(level->solid);
    om_fem_faces_done(&level->face);
    om_fem_mesh_done(&level->mesh);
    om_free(level->fixed);
    om_free(level->x);
    om_free(level->before);
    om_press_destroy(level->press);
    om_tissue_work_destroy(level->work);
    om_tissue_state_destroy(level->state);
    om_tissue_destroy(level->model);
    om_free(level->lesion_elem);
    om_free(level->lesion_weight);
}

static OmVec3 blend(const OmFemMesh* mesh, int elem, const double* weight, const double* value) {
    OmVec3 p = om_vec3(0, 0, 0);
    for (int a = 0; a < 10; ++a)
        p = om_madd(p, weight[a], om_load3(value, mesh->elem_node[10 * (size_t)elem + (size_t)a]));
    return p;
}

static OmVec3 point_now(const Level* level, int point) {
    return blend(&level->mesh, level->lesion_elem[point], level->lesion_weight + 10 * point,
                 level->x);
}

// ---- truth ----------------------------------------------------------------------------------------

OmStatus om__study_truth_create(const OmStudyContactDef* def, const OmProbe* probe,
                                StudyTruth** out) {
    *out = NULL;
    StudyTruth* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    t->def = def;
    t->probe = probe;
    OmStatus status;
    OM_TRY_DONE(level_create(def, probe, def->truth_ntet / COARSER, &t->coarse));
    OM_TRY_DONE(level_create(def, probe, def->truth_ntet, &t->fine));
    *out = t;
    t = NULL;
done:
    om__study_truth_destroy(t);
    return status;
}

void om__study_truth_destroy(StudyTruth* t) {
    if (!t) return;
    level_done(&t->coarse);
    level_done(&t->fine);
    om_free(t);
}

// Equilibrium while the probe moves from touch->from to touch->to.
static OmStatus solve_level(const StudyTruth* t, Level* level, Touch* touch, OmFemReport* report) {
    OmFemExtra extra = {.eval = eval_touch, .finish = centre_gap, .ctx = touch};
    OmFemLoad load = {.fixed = level->fixed, .extra = &extra};
    OmFemStaticDef how = om_fem_static_default_def(level->solid);
    how.tolerance = TOLERANCE;
    how.max_newton = 30;
    how.solver.nworker = t->def->nworker;
    how.solver.preconditioner = OM_MULTIGRID;
    // at a fixed depth the guess is accepted or not
    how.min_step = touch->from == touch->to ? 1 : MIN_STEP;
    touch->level = level;
    touch->nturn = 0;
    touch->has_matrix = false;
    OM_TRY(om_fem_static_solve(level->solid, &load, &how, level->x, NULL, report));
    if (report->load < 1) return OM_NOT_CONVERGED;
    return eval_touch(touch, level->x, 1, NULL, NULL, NULL);  // force and penetration
}

// Start at the last equilibrium, in `before`, and move the probe in steps.
static OmStatus follow_probe(const StudyTruth* t, Level* level, Touch* touch, double from,
                             double to, OmFemReport* report) {
    int nstep = (int)ceil((to - from) / STEP - 1e-9);
    memcpy(level->x, level->before, 3 * (size_t)level->mesh.nnode * sizeof *level->x);
    for (int k = 0; k < nstep; ++k) {
        touch->from = from + (to - from) * k / nstep;
        touch->to = from + (to - from) * (k + 1) / nstep;
        OmStatus status = solve_level(t, level, touch, report);
        if (status != OM_OK) return status;
    }
    return OM_OK;
}

// Press the linear tetrahedra from one depth to the next; their shape is the first guess.
static OmStatus guess_shape(Level* level, const OmStudyLesion* lesion, double from, double to) {
    static const int edge[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    if (from == 0) {
        om_tissue_state_reset(level->model, level->state);
        OM_TRY(om_press_place(level->press, level->model, level->state,
                              om__study_probe_pose(lesion, 0)));
    }
    int nstep = (int)ceil((to - from) / LEAD_STEP - 1e-9);
    for (int k = 1; k <= nstep; ++k) {
        OmPressReport report;
        OmPose pose = om__study_probe_pose(lesion, from + (to - from) * k / nstep);
        OM_TRY(om_press_step(level->press, level->model, level->state, level->work, pose, LEAD_TIME,
                             &report));
    }
    const double* x = om_tissue_x(level->state);
    memcpy(level->x, x, 3 * (size_t)om_tissue_mesh(level->model)->nvert * sizeof *x);
    for (int e = 0; e < level->mesh.nelem; ++e) {
        const int* node = level->mesh.elem_node + 10 * (size_t)e;
        for (int i = 0; i < 6; ++i)
            om_store3(level->x, node[4 + i],
                      om_lerp(om_load3(x, node[edge[i][0]]), om_load3(x, node[edge[i][1]]), 0.5));
    }
    return OM_OK;
}

// Equilibrium at a depth, from a guess; if that fails, from the last depth with the probe moving.
static OmStatus press_level(const StudyTruth* t, Level* level, Touch* touch, double from, double to,
                            OmFemReport* report) {
    size_t size = 3 * (size_t)level->mesh.nnode * sizeof *level->x;
    memcpy(level->before, from == 0 ? level->mesh.x : level->x, size);
    OM_TRY(guess_shape(level, touch->lesion, from, to));
    touch->from = touch->to = to;
    OmStatus status = solve_level(t, level, touch, report);
    return status == OM_NOT_CONVERGED ? follow_probe(t, level, touch, from, to, report) : status;
}

OmStatus om__study_truth_solve(StudyTruth* t, int lesion, const OmProgress* progress,
                               StudyTruthResult* result) {
    const OmStudyContactDef* def = t->def;
    Level *fine = &t->fine, *coarse = &t->coarse;
    double begin = om_clock_now();
    Touch touch = {.probe = t->probe,
                   .lesion = &def->body->lesion[lesion],
                   .young = def->material.young,
                   .pressure = 0.3 * def->material.young};
    result->lesion = lesion;
    result->ntet = fine->mesh.nelem;
    result->ntet_coarse = coarse->mesh.nelem;
    for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
        StudyTruthDepth* d = &result->at[k];
        OmFemReport report = {0};
        double last = k ? def->depth[k - 1] : 0;
        d->depth = def->depth[k];
        if (d->depth > touch.lesion->max) break;
        OmStatus status = press_level(t, coarse, &touch, last, d->depth, &report);
        if (status < 0) return status;
        if (status == OM_NOT_CONVERGED) break;
        d->coarse = point_now(coarse, lesion);
        d->coarse_force = om_dot(touch.force, touch.lesion->normal);
        status = press_level(t, fine, &touch, last, d->depth, &report);
        if (status < 0) return status;
        if (status == OM_NOT_CONVERGED) break;
        d->fine = point_now(fine, lesion);
        d->contour = point_now(fine, def->body->nlesion + lesion);
        d->force = om_dot(touch.force, touch.lesion->normal);
        d->sink = touch.sink;
        d->residual = report.residual;
        d->nnewton = report.nnewton;
        result->ndepth = k + 1;
        OM_TRY(om_progress_report(progress, "truth", lesion + (k + 1.0) / OM_STUDY_NDEPTH,
                                  om__study_nlesion(def)));
    }
    result->seconds = om_clock_now() - begin;
    return OM_OK;
}

uint64_t om__study_hash_truth(const OmStudyContactDef* def, int lesion) {
    uint64_t hash = om__study_hash_task(def);
    // every lesion is in the body, not only the pressed one
    const OmStudyBody* body = def->body;
    for (int i = 0; i < body->nlesion; ++i) {
        const OmStudyLesion* l = &body->lesion[i];
        const double v[] = {l->center.x, l->center.y, l->center.z, l->radius};
        hash = om_hash(v, sizeof v, hash);
    }
    const OmStudyLesion* l = &body->lesion[lesion];
    const double value[] = {l->touch.x,  l->touch.y,      l->touch.z,        l->normal.x,
                            l->normal.y, l->normal.z,     l->along.x,        l->along.y,
                            l->along.z,  def->truth_ntet, def->lesion_ratio, SOFTNESS,
                            LINEAR,      PROBE_ROUNDING,  TOLERANCE,         VERSION};
    return om_hash(value, sizeof value, hash);
}

// Normal noise of the given length (standard deviation of the whole vector), a random stream for each.
static OmVec3 noise(uint64_t seed, uint64_t index, double length) {
    OmRng rng = om_rng_init(seed, index);
    double s = length / sqrt(3);
    double x = om_rng_normal(&rng), y = om_rng_normal(&rng), z = om_rng_normal(&rng);
    return om_vec3(s * x, s * y, s * z);
}

static OmVec3 tracking_noise(const OmStudyContactDef* def, int lesion, int k) {
    // registration is done once per lesion, the probe's calibration has a new error at each depth
    uint64_t i = (uint64_t)lesion * (OM_STUDY_NDEPTH + 1);
    return om_add(noise(def->seed, i, def->pointer_noise),
                  noise(def->seed, i + 1 + (uint64_t)k, def->probe_noise));
}

OmVec3 om__study_measured(const OmStudyContactDef* def, const StudyTruthResult* truth, int k) {
    return om_add(truth->at[k].fine, tracking_noise(def, truth->lesion, k));
}

OmVec3 om__study_measured_contour(const OmStudyContactDef* def, const StudyTruthResult* truth,
                                  int k) {
    return om_add(truth->at[k].contour, tracking_noise(def, truth->lesion, k));
}
