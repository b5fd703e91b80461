// bench_stall.c: the worst steps of five scenes, over 2,000 steps of 20 ms (--quick: 200), each with the least of its
// times in --runs replays from a snapshot: worst over median, and the steps that are not OM_OK.
//
//     lift   a beam, fixed at one end; the other goes up by 2 cm in 1 s, stays for 1 s, comes back, stays for 1 s
//     hold   the same beam sags from its rest shape under its weight, and swings
//     drop   a block on a board as after a fall of 0.3 m, 20 times, with another tilt each time
//     press  a sphere goes 12 mm into a block in 1 s, stays for 1 s, comes out, stays out for 1 s (penalty)
//     fold   a slab, fixed at one edge; the other is turned over by 120 degrees in 3 s, held for 1 s, turned back
//
// stall_hard: hold and drop at 3 kPa in place of 30, after a fall of 1 m, a press of 20 mm, a fold of 150 degrees: the
// share of steps that are not OK, and the message of the first. Some laws have no equilibrium there.
//
// By three laws, linear and quadratic elements, with the default solver; linear ones also with 25 iterations of block
// Jacobi. The clock of a shared machine may still disturb the worst step: worst_iterations and worst_substeps do not
// depend on it. A replay must end in the same bytes.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"

#define NSTEP 2000
#define NSTEP_QUICK 200
#define H 0.02
#define PI 3.14159265358979323846

enum { LIFT, HOLD, DROP, PRESS, FOLD, HARD_HOLD, HARD_DROP, HARD_PRESS, HARD_FOLD };

typedef struct Scene {
    const char* name;
    int motion;       // LIFT ... FOLD
    OmVec3 size;      // m
    int cells[2][3];  // of linear and of quadratic elements
    int axis;         // attached where this coordinate is 0; -1: free
    double young;     // Pa
    double far;       // m; degrees of FOLD; height of the fall of DROP
} Scene;

#define BEAM {0.1, 0.03, 0.03}, {{19, 6, 6}, {8, 3, 3}}, 0
#define BLOCK {0.06, 0.04, 0.04}, {{9, 6, 6}, {4, 3, 3}}, -1
#define ORGAN {0.15, 0.1, 0.07}, {{11, 8, 8}, {6, 4, 3}}, 2
#define SLAB {0.12, 0.12, 0.005}, {{16, 16, 1}, {8, 8, 1}}, 0
static const Scene scene_table[] = {
    [LIFT] = {"lift", LIFT, BEAM, 3000, 0.02},
    [HOLD] = {"hold", HOLD, BEAM, 30000, 0},
    [DROP] = {"drop", DROP, BLOCK, 30000, 0.3},
    [PRESS] = {"press", PRESS, ORGAN, 3000, 0.012},
    [FOLD] = {"fold", FOLD, SLAB, 3000, 120},
    [HARD_HOLD] = {"hard hold", HOLD, BEAM, 3000, 0},
    [HARD_DROP] = {"hard drop", DROP, BLOCK, 3000, 1},
    [HARD_PRESS] = {"hard press", PRESS, ORGAN, 3000, 0.02},
    [HARD_FOLD] = {"hard fold", FOLD, SLAB, 3000, 150},
};
static const OmLaw law_table[] = {OM_COROTATIONAL, OM_NEO_HOOKEAN, OM_ST_VENANT_KIRCHHOFF};

typedef struct Row {  // of the table
    int scene;
    OmLaw law;
    OmTissueElement element;
    bool is_plain;  // 25 iterations of block Jacobi
} Row;

typedef struct Body {
    OmTetMesh mesh;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
    OmProbe* probe;
    OmPress* press;
    void* before;  // snapshot
} Body;

static void body_done(Body* b) {
    om_free(b->before);
    om_press_destroy(b->press);
    om_probe_destroy(b->probe);
    om_contact_work_destroy(b->contact_work);
    om_contact_destroy(b->contact);
    om_tissue_work_destroy(b->work);
    om_tissue_state_destroy(b->state);
    om_tissue_destroy(b->model);
    om_tet_mesh_done(&b->mesh);
}

static OmStatus add_probe(Body* b) {
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    OM_TRY(om_probe_create(&shape, &b->probe));
    OmPressDef def = om_press_default_def(b->probe);
    def.method = OM_PRESS_PENALTY;
    return om_press_create(&def, b->model, &b->press);
}

static OmStatus make_body(const Row* r, const BenchOptions* options, Body* b) {
    const Scene* scene = &scene_table[r->scene];
    const int* n = scene->cells[r->element == OM_ELEMENT_QUADRATIC];
    if (scene->axis < 0)
        OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), scene->size, n[0], n[1], n[2], &b->mesh));
    else
        OM_TRY(bench_box(scene->size, n, scene->axis, &b->mesh));
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &b->mesh);
    def.element = r->element;
    def.material_default.law = r->law;
    def.material_default.young = scene->young;
    if (scene->motion == LIFT || scene->motion == PRESS) def.gravity = om_vec3(0, 0, 0);
    def.solver.nworker = options->nworker;
    if (r->is_plain) {
        def.solver.preconditioner = OM_BLOCK_JACOBI;
        def.solver.max_iterations = 25;
        def.solver.tolerance = 0;
    }
    OM_TRY(om_tissue_create(&def, &b->model));
    OM_TRY(om_tissue_state_create(b->model, &b->state));
    OM_TRY(om_tissue_work_create(b->model, &b->work));
    b->before = om_alloc(1, om_tissue_state_size(b->model));
    if (!b->before) return OM_NO_MEMORY;
    if (scene->motion == DROP) return bench_board(b->model, &b->contact, &b->contact_work);
    return scene->motion == PRESS ? add_probe(b) : OM_OK;
}

// 0 before t = 0, 1 after t = rise until t = rise + stay, 0 after 2 rise + stay; then again, after another `stay`.
static double there_and_back(double t, double rise, double stay) {
    t = fmod(t, 2 * (rise + stay));
    return t < rise + stay ? fmin(1, t / rise) : fmax(0, 1 - (t - rise - stay) / rise);
}

// Of the tool at time t; *radius: m, of the grasp.
static OmPose tool_at(const Scene* scene, double t, double* radius) {
    OmVec3 L = scene->size;
    double far = scene->far;
    if (scene->motion == PRESS)
        return (OmPose){om_vec3(L.x / 2, L.y / 2, L.z + 0.025 - far * there_and_back(t, 1, 1)),
                        om_quat_identity()};
    double angle = scene->motion == FOLD ? -PI * far / 180 * there_and_back(t, 3, 1) : 0;
    double lift = scene->motion == LIFT ? far * there_and_back(t, 1, 1) : 0;
    *radius = 1000;  // a sphere so large that it is flat at the end face
    OmQuat q = om_quat_axis_angle(om_vec3(0, 1, 0), angle);
    OmVec3 hinge = om_vec3(0.6 * L.x, L.y / 2, L.z / 2 + lift);
    OmVec3 arm = om_vec3(0.4 * L.x + *radius - 1e-5, 0, 0);
    return (OmPose){om_add(hinge, om_quat_rotate(q, arm)), q};
}

// As after a fall of `height` m, 1 mm above the board.
static OmStatus start_fall(Body* b, double height, int k) {
    int nvert = om_tissue_mesh(b->model)->nvert;
    const double* rest = om_tissue_mesh(b->model)->x;
    double *x = om_alloc(6 * (size_t)nvert, sizeof *x), *v = x + 3 * (size_t)nvert, low = INFINITY;
    if (!x) return OM_NO_MEMORY;
    OmVec3 axis = om_normalize(om_vec3(1, 0.3, 0.2));
    OmQuat q = om_quat_axis_angle(axis, 0.1 * k);
    for (int i = 0; i < nvert; ++i) {
        OmVec3 p = om_quat_rotate(q, om_load3(rest, i));
        om_store3(x, i, p);
        om_store3(v, i, om_vec3(0, 0, -sqrt(2 * 9.81 * height)));
        low = fmin(low, p.z);
    }
    for (int i = 0; i < nvert; ++i) x[3 * (size_t)i + 2] += 0.001 - low;
    om_tissue_state_reset(b->model, b->state);
    OmStatus status = om_tissue_set_x(b->model, b->state, x, v);
    om_free(x);
    return status;
}

static OmStatus begin_step(const Row* r, Body* b, int step) {
    double radius = 0;
    const Scene* scene = &scene_table[r->scene];
    OmPose tool = tool_at(scene, step > 0 ? (step + 1) * H : 0, &radius);
    bool is_held = scene->motion == LIFT || scene->motion == FOLD;
    if (scene->motion == DROP && step % 100 == 0) OM_TRY(start_fall(b, scene->far, step / 100));
    if (step == 0 && is_held) OM_TRY(om_tissue_grasp(b->model, b->state, 0, tool, radius, NULL));
    if (is_held) OM_TRY(om_tissue_move_grasp(b->state, 0, tool_at(scene, (step + 1) * H, &radius)));
    memcpy(b->before, b->state, om_tissue_state_size(b->model));
    return OM_OK;
}

static OmStatus take_step(const Row* r, Body* b, int step, double* time, OmTissueReport* report) {
    double radius, start;
    OmStatus status;
    const Scene* scene = &scene_table[r->scene];
    if (scene->motion == PRESS) {
        OmPressReport press;
        OM_TRY(om_press_place(b->press, b->model, b->state, tool_at(scene, step * H, &radius)));
        OmPose goal = tool_at(scene, (step + 1) * H, &radius);
        start = bench_now();
        status = om_press_step(b->press, b->model, b->state, b->work, goal, H, &press);
        *report = press.tissue;
    } else if (scene->motion == DROP) {
        OmContactReport touch;
        start = bench_now();
        status = om_contact_step(b->contact_work, b->model, b->state, b->work, H, &touch);
        *report = touch.tissue;
    } else {
        start = bench_now();
        status = om_tissue_step(b->model, b->state, b->work, H, report);
    }
    *time = bench_now() - start;
    return status;
}

static OmStatus time_steps(const Row* r, Body* b, const BenchOptions* options, double* time,
                           BenchRow* row) {
    for (int step = 0; step < row->steps; ++step) {
        OM_TRY(begin_step(r, b, step));
        uint64_t hash = 0;
        for (int run = 0; run < options->nrun; ++run) {
            OmTissueReport report;
            double one = 0;
            memcpy((void*)b->state, b->before, om_tissue_state_size(b->model));
            OmStatus status = take_step(r, b, step, &one, &report);
            if (status == OM_NO_MEMORY) return status;
            time[step] = run == 0 ? one : fmin(time[step], one);
            uint64_t now = om_tissue_state_hash(b->state);
            OM_CHECK(run == 0 || now == hash, OM_INVALID, "step %d: a replay ends elsewhere", step);
            hash = now;
            if (run > 0) continue;
            if (status != OM_OK && !row->why[0])
                snprintf(row->why, sizeof row->why, "step %d: %s", step, om_error_message());
            row->not_ok += 100.0 * (status != OM_OK) / row->steps;
            row->iterations += (double)report.iterations / row->steps;
            row->worst_iterations = fmax(row->worst_iterations, report.iterations);
            row->worst_substeps = fmax(row->worst_substeps, report.substeps);
            row->residual = fmax(row->residual, report.residual);
        }
    }
    return OM_OK;
}

static OmStatus measure(const Row* r, const BenchOptions* options) {
    Body b = {0};
    double time[NSTEP];
    char scene[96];
    OmStatus status = OM_OK;
    snprintf(scene, sizeof scene, "%s, %s, %s", scene_table[r->scene].name, om_law_name(r->law),
             om_tissue_element_name(r->element));
    const char* work = r->is_plain ? "step, 25 block-Jacobi iterations" : "step";
    if (!bench_is_wanted(options, scene, work)) return OM_OK;
    OM_TRY_DONE(make_body(r, options, &b));
    BenchRow row = {.bench = "stall",
                    .scene = scene,
                    .work = work,
                    .size = b.mesh.ntet,
                    .nworker = options->nworker,
                    .steps = options->is_quick ? NSTEP_QUICK : NSTEP,
                    .is_stall = true};
    OM_TRY_DONE(time_steps(r, &b, options, time, &row));
    row.hash = om_tissue_state_hash(b.state);
    bench_times(time, row.steps, &row);
    row.nrun = options->nrun;
    status = bench_print(&row);
done:
    body_done(&b);
    return status;
}

static OmStatus measure_scene(int scene, const BenchOptions* options) {
    for (int k = 0; k < 3; ++k) {
        OM_TRY(measure(&(Row){scene, law_table[k], OM_ELEMENT_LINEAR, true}, options));
        OM_TRY(measure(&(Row){scene, law_table[k], OM_ELEMENT_LINEAR, false}, options));
        OM_TRY(measure(&(Row){scene, law_table[k], OM_ELEMENT_QUADRATIC, false}, options));
    }
    return OM_OK;
}

OmStatus bench_stall_lift(const BenchOptions* options) { return measure_scene(LIFT, options); }
OmStatus bench_stall_hold(const BenchOptions* options) { return measure_scene(HOLD, options); }
OmStatus bench_stall_drop(const BenchOptions* options) { return measure_scene(DROP, options); }
OmStatus bench_stall_press(const BenchOptions* options) { return measure_scene(PRESS, options); }
OmStatus bench_stall_fold(const BenchOptions* options) { return measure_scene(FOLD, options); }

OmStatus bench_stall_hard(const BenchOptions* options) {
    for (int scene = HARD_HOLD; scene <= HARD_FOLD; ++scene) OM_TRY(measure_scene(scene, options));
    return OM_OK;
}
