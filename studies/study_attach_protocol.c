// study_attach_protocol.c: static finite elements driven by the displacement of the grasp, and the scores of thesis
// 4.3.
//
// Attached and grasped vertices are prescribed degrees of freedom, as in the thesis, and not springs as in
// om_match_find_rest. The material is homogeneous, so its stiffness has no influence without gravity (thesis 4.3).
//
// Without attachments the grasped vertices alone hold the body. If all prescribed vertices lie on a line, the body
// could turn: then springs of SOFT E l (l: mean edge) hold every vertex to its place at rest. Their sum over 3,000
// vertices is below 1e-4 of the force that stretches one element by its own length.
//
// Time of a solve (sheet of 130 x 100 x 12 mm, 2,552 vertices, lifted by 25 mm, one busy core): 0.2 s with multigrid,
// 1.1 s with CHOLMOD; the free body 0.06 s, 0.17 s from the shape at rest. A displacement that the attachments do not
// allow, for example 40 mm beside an attached vertex, fails after 1.5 s with these limits and after 33 s with the
// defaults of om_fem_static.
//
// Straight ways of the grasped vertices fail where the grasp turns much: of 48 random samples with the true attachments
// 4 stopped at a tenth to a half of the way. These are solved again on a way that turns: three of the four then arrive.
#include <math.h>
#include <string.h>
#include <time.h>

#include "studies/study_attach_protocol.h"

#define SOFT 1e-8
#define MAX_NEWTON 8
#define NTURN 8  // stages of a way on which the grasp turns
#define MIN_STEP (1.0 / 16)
#define CG_TOLERANCE 3e-3  // of the residual, in each Newton iteration
#define COLLINEAR \
    0.05  // mean edges; prescribed vertices nearer to a line do not stop a turn about it

struct AttachModel {
    OmFemMesh mesh;
    OmFemSolid* solid;
    OmFemStatics* statics;
    OmFemStatics* turning;  // of one stage of a way that turns; made when needed
    OmFemStatics* loose;    // with CHOLMOD: springs alone are too soft for CG; made when needed
    OmFemStaticDef how;     // of `statics`
    OmVec3 gravity;
    double edge;           // m, mean edge
    double spring;         // N/m
    unsigned char* fixed;  // (nvert x 3)
    double* goal;          // (nvert x 3)
};

AttachModelDef om__attach_model_default_def(const OmTetMesh* mesh, OmMaterial material) {
    return (AttachModelDef){.mesh = mesh,
                            .material = material,
                            .density = 1000,
                            .tolerance = 1e-4,
                            .nstep = 4,
                            .nworker = 1};
}

static double mean_edge(const OmFemMesh* m) {
    double sum = 0;
    for (int e = 0; e < m->nelem; ++e) {
        const int* node = m->elem_node + (size_t)m->nelem_node * (size_t)e;
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < a; ++b)
                sum += om_distance(om_load3(m->x, node[a]), om_load3(m->x, node[b]));
    }
    return sum / (6.0 * m->nelem);  // om_fem_mesh_from_tet refuses an empty mesh
}

OmStatus om__attach_model_create(const AttachModelDef* def, AttachModel** out) {
    *out = NULL;
    OmStatus status = OM_OK;
    AttachModel* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    OM_TRY_DONE(om_fem_mesh_from_nodes(def->mesh, def->node, &m->mesh));
    memset(m->mesh.elem_material, 0, (size_t)m->mesh.nelem * sizeof *m->mesh.elem_material);
    OmFemDef solid = om_fem_default_def(&m->mesh, 1, &def->material);
    solid.density = &def->density;
    solid.nworker = def->nworker;
    OM_TRY_DONE(om_fem_create(&solid, &m->solid));
    m->how = om_fem_static_default_def(m->solid);
    m->how.tolerance = def->tolerance;
    m->how.nstep = def->nstep;
    m->how.min_step = MIN_STEP;
    m->how.max_newton = MAX_NEWTON;
    m->how.solver.preconditioner = OM_MULTIGRID;
    m->how.solver.tolerance = CG_TOLERANCE;
    m->how.solver.nworker = def->nworker;
    OM_TRY_DONE(om_fem_statics_create(m->solid, &m->how, &m->statics));
    m->gravity = def->gravity;
    m->edge = mean_edge(&m->mesh);
    m->spring = SOFT * def->material.young * m->edge;
    OM_ALLOC_DONE(m->fixed, 3 * m->mesh.nnode);
    OM_ALLOC_DONE(m->goal, 3 * m->mesh.nnode);
    *out = m;
done:
    if (status < 0) om__attach_model_destroy(m);
    return status;
}

OmStatus om__attach_model_create_bending(const OmTetMesh* mesh, OmMaterial material,
                                         AttachModel** out) {
    OmTetMesh fine;
    int* node = NULL;
    *out = NULL;
    OM_TRY(om_tet_mesh_copy(mesh, &fine));
    OmStatus status = om_tet_mesh_refine_nodes(&fine, &node);
    AttachModelDef def = om__attach_model_default_def(&fine, material);
    def.node = node;
    if (status == OM_OK) status = om__attach_model_create(&def, out);
    om_free(node);
    om_tet_mesh_done(&fine);
    return status;
}

void om__attach_model_destroy(AttachModel* m) {
    if (!m) return;
    om_fem_statics_destroy(m->statics);
    om_fem_statics_destroy(m->turning);
    om_fem_statics_destroy(m->loose);
    om_fem_destroy(m->solid);
    om_fem_mesh_done(&m->mesh);
    om_free(m->fixed);
    om_free(m->goal);
    om_free(m);
}

static OmStatus check_move(const AttachModel* m, const AttachMove* move) {
    OM_CHECK(move->ngrasp > 0, OM_INVALID, "the body is not grasped");
    for (int i = 0; i < move->ngrasp; ++i) {
        OM_CHECK(move->grasp[i] >= 0 && move->grasp[i] < m->mesh.nnode, OM_INVALID,
                 "grasp[%d] is %d: the mesh has %d vertices", i, move->grasp[i], m->mesh.nnode);
        OM_CHECK(isfinite(om_norm(om_load3(move->goal, i))), OM_INVALID,
                 "the goal of grasped vertex %d is not finite", i);
    }
    return OM_OK;
}

// Are the prescribed vertices on a line, or fewer than that?
static bool is_loose(const AttachModel* m) {
    OmVec3 mean = om_vec3(0, 0, 0), w;
    OmMat3 sum = {0}, axes;
    int n = 0;
    for (int i = 0; i < m->mesh.nnode; ++i) {
        if (!m->fixed[3 * i]) continue;
        mean = om_add(mean, om_load3(m->mesh.x, i));
        ++n;
    }
    if (n < 3) return true;
    mean = om_scale(1.0 / n, mean);
    for (int i = 0; i < m->mesh.nnode; ++i) {
        if (!m->fixed[3 * i]) continue;
        OmVec3 d = om_sub(om_load3(m->mesh.x, i), mean);
        sum = om_mat3_add(sum, (OmMat3){om_scale(d.x, d), om_scale(d.y, d), om_scale(d.z, d)});
    }
    om_mat3_eigen_symmetric(sum, &w, &axes);  // ascending
    return w.y < COLLINEAR * COLLINEAR * m->edge * m->edge;
}

// Springs of every vertex to its place at rest: an OmFemExtra.
static OmStatus eval_springs(void* ctx, const double* x, double load, double* energy, double* f,
                             OmBsr* A) {
    (void)load;
    const AttachModel* m = ctx;
    const double k = m->spring;
    const OmMat3 K = {om_vec3(k, 0, 0), om_vec3(0, k, 0), om_vec3(0, 0, k)};
    for (int i = 0; i < m->mesh.nnode; ++i) {
        OmVec3 d = om_sub(om_load3(x, i), om_load3(m->mesh.x, i));
        if (energy) *energy += 0.5 * k * om_norm2(d);
        if (f) om_store3(f, i, om_madd(om_load3(f, i), k, d));
        if (A) om_bsr_add(A, A->row_adr[i], K);
    }
    return OM_OK;
}

typedef struct Turn {  // rigid motion of the grasp: x -> to + turn (x - from)
    OmVec3 from, to;
    OmQuat turn;
} Turn;

// The nearest rigid motion (Kabsch 1976).
static Turn fit_grasp(const AttachModel* m, const AttachMove* move) {
    Turn t = {0};
    OmMat3 sum = {{0}};
    for (int i = 0; i < move->ngrasp; ++i) {
        t.from = om_madd(t.from, 1.0 / move->ngrasp, om_load3(m->mesh.x, move->grasp[i]));
        t.to = om_madd(t.to, 1.0 / move->ngrasp, om_load3(move->goal, i));
    }
    for (int i = 0; i < move->ngrasp; ++i) {
        OmVec3 a = om_sub(om_load3(m->mesh.x, move->grasp[i]), t.from);
        OmVec3 b = om_sub(om_load3(move->goal, i), t.to);
        sum = om_mat3_add(sum, (OmMat3){om_scale(a.x, b), om_scale(a.y, b), om_scale(a.z, b)});
    }
    t.turn = om_quat_from_mat3(om_mat3_polar(sum));
    return t;
}

static OmVec3 turn_point(const Turn* t, OmVec3 x) {
    return om_add(t->to, om_quat_rotate(t->turn, om_sub(x, t->from)));
}

// Displacements of the grasped vertices at a share of a way on which the grasp turns and strains gradually.
static void set_goals(const AttachModel* m, const AttachMove* move, const Turn* t, double share) {
    OmQuat back = om_quat_conj(t->turn), turn = om_quat_slerp(om_quat_identity(), t->turn, share);
    for (int i = 0; i < move->ngrasp; ++i) {
        int v = move->grasp[i];
        OmVec3 rest = om_load3(m->mesh.x, v), goal = om_load3(move->goal, i);
        if (share < 1) {
            OmVec3 a = om_sub(rest, t->from), b = om_quat_rotate(back, om_sub(goal, t->to));
            goal =
                om_add(om_lerp(t->from, t->to, share), om_quat_rotate(turn, om_lerp(a, b, share)));
        }
        om_store3(m->goal, v, om_sub(goal, rest));
    }
}

// Straight ways of a grasp that turns much cross each other and crush the tissue between them.
static OmStatus solve_turning(AttachModel* m, const AttachMove* move, const Turn* turn,
                              const OmFemLoad* load, double* x, AttachSolve* solve) {
    OmFemReport report = {0};
    OmStatus status = OM_OK;
    double reached = 0;
    memcpy(x, m->mesh.x, 3 * (size_t)m->mesh.nnode * sizeof *x);
    for (int k = 1; k <= NTURN && status == OM_OK; ++k) {
        set_goals(m, move, turn, k / (double)NTURN);
        status = om_fem_statics_solve(m->turning, load, x, NULL, &report);
        reached = (k - 1 + report.load) / NTURN;
        solve->nnewton += report.nnewton;
    }
    if (status < 0) return status;
    solve->is_converged = status == OM_OK;
    solve->load = status == OM_OK ? 1 : reached;
    solve->min_volume = report.min_volume;
    snprintf(solve->reason, sizeof solve->reason, "%s", report.reason);
    return OM_OK;
}

static OmStatus prepare(AttachModel* m, bool is_loose) {
    OmFemStaticDef how = m->how;
    if (is_loose && !m->loose) {
        how.solver.preconditioner = OM_CHOLESKY;
        OM_TRY(om_fem_statics_create(m->solid, &how, &m->loose));
    }
    if (!is_loose && !m->turning) {
        how.nstep = 1;
        how.max_newton = 3 * MAX_NEWTON;
        OM_TRY(om_fem_statics_create(m->solid, &how, &m->turning));
    }
    return OM_OK;
}

OmStatus om__attach_model_solve(AttachModel* m, const AttachMove* move, double* x,
                                AttachSolve* solve) {
    memset(solve, 0, sizeof *solve);
    OM_TRY(check_move(m, move));
    double begin = om__attach_thread_ms();
    bool is_free = true;
    for (int i = 0; i < m->mesh.nnode; ++i) {
        bool is_attached = move->attached && move->attached[i];
        memset(m->fixed + 3 * i, is_attached, 3);
        is_free = is_free && !is_attached;
    }
    memset(m->goal, 0, 3 * (size_t)m->mesh.nnode * sizeof *m->goal);
    for (int i = 0; i < move->ngrasp; ++i) memset(m->fixed + 3 * move->grasp[i], 1, 3);
    Turn turn = fit_grasp(m, move);
    set_goals(m, move, &turn, 1);
    solve->is_loose = is_loose(m);
    OmFemExtra springs = {.eval = eval_springs, .ctx = m};
    OmFemLoad load = {.body = m->gravity,
                      .fixed = m->fixed,
                      .goal = m->goal,
                      .extra = solve->is_loose ? &springs : NULL};
    OmFemReport report = {0};
    for (int i = 0; i < m->mesh.nnode; ++i) {
        OmVec3 rest = om_load3(m->mesh.x, i);
        om_store3(x, i, is_free && !solve->is_loose ? turn_point(&turn, rest) : rest);
    }
    if (solve->is_loose) OM_TRY(prepare(m, true));
    OmStatus status =
        om_fem_statics_solve(solve->is_loose ? m->loose : m->statics, &load, x, NULL, &report);
    if (status < 0) return status;
    solve->is_converged = status == OM_OK;
    solve->load = report.load;
    solve->min_volume = report.min_volume;
    solve->nnewton = report.nnewton;
    snprintf(solve->reason, sizeof solve->reason, "%s", report.reason);
    if (!solve->is_converged && !solve->is_loose && om_norm2(m->gravity) == 0) {
        OM_TRY(prepare(m, false));
        OM_TRY(solve_turning(m, move, &turn, &load, x, solve));
    }
    if (solve->is_converged) solve->reason[0] = 0;
    solve->ms = om__attach_thread_ms() - begin;
    return OM_OK;
}

double om__attach_thread_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

// ---- scores -----------------------------------------------------------------------------------------

void om__attach_score(int n, const double* weight, const unsigned char* found,
                      const unsigned char* truth, double* dsc, double* tpr) {
    double all_found = 0, all_true = 0, both = 0;
    for (int i = 0; i < n; ++i) {
        double w = weight ? weight[i] : 1;
        if (found[i]) all_found += w;
        if (truth[i]) all_true += w;
        if (found[i] && truth[i]) both += w;
    }
    *dsc = all_true > 0 ? 2 * both / (all_found + all_true) : 0;
    *tpr = all_true > 0 ? both / all_true : 0;
}

OmStatus om__attach_score_cells(int n, const int* cell, const unsigned char* found,
                                const unsigned char* truth, double* dsc, double* tpr) {
    int ncell = 0;
    *dsc = *tpr = 0;
    for (int i = 0; i < n; ++i)
        if (cell[i] >= ncell) ncell = cell[i] + 1;
    unsigned char* mark = om_calloc(2 * (size_t)ncell, 1);
    if (!mark) return OM_NO_MEMORY;
    for (int i = 0; i < n; ++i) {
        if (cell[i] < 0) continue;
        if (found[i]) mark[cell[i]] = 1;
        if (truth[i]) mark[ncell + cell[i]] = 1;
    }
    om__attach_score(ncell, NULL, mark, mark + ncell, dsc, tpr);
    om_free(mark);
    return OM_OK;
}

void om__attach_error(int n, const double* x, const double* truth, double* ave, double* mve) {
    *ave = *mve = 0;
    for (int i = 0; i < n; ++i) {
        double d = om_distance(om_load3(x, i), om_load3(truth, i));
        *ave += d / n;
        *mve = fmax(*mve, d);
    }
}

void om__attach_areas(const OmSurface* s, double* area) {
    memset(area, 0, (size_t)s->nvert * sizeof *area);
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(s->x, v[0]);
        OmVec3 b = om_sub(om_load3(s->x, v[1]), a), c = om_sub(om_load3(s->x, v[2]), a);
        for (int k = 0; k < 3; ++k) area[v[k]] += om_norm(om_cross(b, c)) / 6;
    }
}
