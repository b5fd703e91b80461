// bench_plan.c: re-planning on random situations, beside Table 6.4 of the thesis.
//
// For each grid and share of attached blocks 100 states: a random block above the ROI, a random set of blocks
// attached, both arms free, the reachability of Alg. 4, a horizon of 12, the optimum proven in each. "grounded
// anew" reads, grounds and solves the program in each; "re-solved" is what a running planner does: it senses what
// is new and solves. Both give the same plans (the hash).
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "bench.h"

enum { MAX_STATE = 100 };

// Means of Table 6.4, s, for 10, 30, 50 and 70 % attached.
static const double thesis[6][4] = {{0.25, 0.24, 0.23, 0.24}, {0.68, 0.65, 0.63, 0.62},
                                    {1.50, 1.48, 1.41, 1.42}, {3.06, 2.97, 2.90, 2.88},
                                    {5.88, 5.70, 5.51, 5.51}, {10.75, 10.21, 9.92, 9.87}};

static OmSituation random_state(int n, int percent, int index) {
    OmRng rng = om_rng_init((uint64_t)(100 * n + percent), (uint64_t)index);
    OmSituation s;
    om_situation_init(&s, n, 0.12 / n);
    uint32_t nblock = (uint32_t)(n * n);
    s.is_above_roi[om_rng_below(&rng, nblock)] = true;
    for (int left = (n * n * percent + 50) / 100; left > 0;) {
        uint32_t b = om_rng_below(&rng, nblock);
        left -= !s.is_fixed[b];
        s.is_fixed[b] = true;
    }
    return s;
}

typedef struct Case {
    int n, percent, nstate;
    bool is_fresh;    // read, ground and solve for each state
    bool is_bounded;  // the program in use, else the plain one
    bool is_known;    // every free block was tried in the simulation
} Case;

// Half of the free blocks expose the ROI in the simulation.
static void add_exposures(int index, OmSituation* s) {
    static const OmPlanVerb fold[3] = {OM_PLAN_PULL, OM_PLAN_MOVE_ROI, OM_PLAN_MOVE_AWAY};
    OmRng r = om_rng_init(6, (uint64_t)index);
    for (int b = 0; b < s->n * s->n; b++)
        s->exposure[b] = (OmExposure){!s->is_fixed[b], om_rng_below(&r, 2) == 1,
                                      1 + (int)om_rng_below(&r, 5), fold[om_rng_below(&r, 3)]};
}

static OmStatus create_planner(bool is_bounded, OmPlanner** planner) {
    OmPlannerDef def = om_planner_default_def();
    def.time_limit = 0;
    def.has_all_distances = !is_bounded;
    if (!is_bounded) def.program = "asp/tissue_retraction_plain.lp";
    return om_planner_create(&def, planner);
}

// Does the program in use find a plan of the same cost?
static OmStatus check_cost(const OmSituation* s, const OmPlan* plan) {
    OmPlanner* planner;
    OmPlan bounded;
    OM_TRY(create_planner(true, &planner));
    OmStatus status = om_planner_solve(planner, s, &bounded);
    om_planner_destroy(planner);
    OM_TRY(status);
    OM_CHECK(memcmp(plan->cost, bounded.cost, sizeof plan->cost) == 0, OM_INVALID,
             "the bounded program's plan has another cost than the unbounded one's");
    return OM_OK;
}

static OmStatus measure(const Case* c) {
    OmPlanner* planner = NULL;
    OmStatus status = OM_OK;
    double time[MAX_STATE];
    char scene[64], work[64];
    snprintf(scene, sizeof scene, "grid %dx%d, %d %% attached", c->n, c->n, c->percent);
    snprintf(work, sizeof work, "%s%s%s", c->is_bounded ? "" : "unbounded, ",
             c->is_fresh ? "grounded anew" : "re-solved", c->is_known ? ", exposures known" : "");
    BenchRow row = {.bench = "plan",
                    .scene = scene,
                    .work = work,
                    .size = c->nstate,
                    .nworker = 1,
                    .steps = 1,
                    .is_processor_time = true,
                    .reference = "thesis Table 6.4",
                    .reference_ms = 1e3 * thesis[c->n - 5][c->percent / 20],
                    .hash = OM_HASH_SEED};
    OmPlan plan;
    for (int i = c->is_fresh ? 0 : -1; i < c->nstate; i++) {  // state -1 grounds, untimed
        OmSituation s = random_state(c->n, c->percent, i < 0 ? MAX_STATE : i);
        if (c->is_known) add_exposures(i, &s);
        if (c->is_fresh) {
            om_planner_destroy(planner);
            planner = NULL;
        }
        if (!planner) OM_TRY_DONE(create_planner(c->is_bounded, &planner));
        clock_t start = clock();
        OM_TRY_DONE(om_planner_solve(planner, &s, &plan));
        if (i < 0) continue;
        time[i] = (double)(clock() - start) / CLOCKS_PER_SEC;
        OM_CHECK_DONE(plan.is_optimal, OM_INVALID, "%s: state %d has no proven optimum", scene, i);
        if (!c->is_bounded) OM_TRY_DONE(check_cost(&s, &plan));
        row.hash = om_hash(plan.cost, sizeof plan.cost, row.hash);
    }
    bench_times(time, c->nstate, &row);
    row.compares = BENCH_MEDIAN;
    OM_TRY_DONE(bench_print(&row));
done:
    om_planner_destroy(planner);
    return status;
}

OmStatus bench_plan(const BenchOptions* options) {
    for (int n = 5; n <= 10; n += options->is_quick ? 5 : 1) {
        for (int percent = 10; percent <= 70; percent += 20) {
            int nstate = options->is_quick ? 20 : MAX_STATE;
            OM_TRY(measure(&(Case){n, percent, nstate, true, true, false}));
            OM_TRY(measure(&(Case){n, percent, nstate, false, true, false}));
            OM_TRY(measure(&(Case){n, percent, nstate, false, true, true}));
        }
    }
    for (int n = 5; n <= (options->is_quick ? 5 : 10); n += n == 5 ? 2 : 3) {
        int nstate = n < 10 ? 10 : 5;
        OM_TRY(measure(&(Case){n, 30, nstate, true, false, false}));
        OM_TRY(measure(&(Case){n, 30, nstate, false, false, false}));
    }
    return OM_OK;
}
