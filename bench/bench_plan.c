// bench_plan.c: re-planning on random situations, beside Table 6.4 of the thesis.
//
// For each grid and share of attached blocks 100 states: a random block above the ROI, a random set of blocks
// attached, both arms free, the reachability of Alg. 4, a horizon of 12, the optimum proven in each. "grounded
// anew" reads, grounds and solves the program in each; "re-solved" is what a running planner does: it senses what
// is new and solves. Both give the same plans (the hash).
#include <stdio.h>
#include <string.h>

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

static OmStatus measure(int n, int percent, bool is_fresh, int nstate) {
    OmPlannerDef def = om_planner_default_def();
    OmPlanner* planner = NULL;
    OmStatus status = OM_OK;
    double time[MAX_STATE];
    char scene[64];
    snprintf(scene, sizeof scene, "grid %dx%d, %d %% attached", n, n, percent);
    BenchRow row = {.bench = "plan",
                    .scene = scene,
                    .work = is_fresh ? "grounded anew" : "re-solved",
                    .size = nstate,
                    .nworker = 1,
                    .steps = 1,
                    .reference = "thesis Table 6.4",
                    .reference_ms = 1e3 * thesis[n - 5][percent / 20],
                    .hash = OM_HASH_SEED};
    OmPlan plan;
    for (int i = is_fresh ? 0 : -1; i < nstate; i++) {  // state -1 grounds the program, untimed
        OmSituation s = random_state(n, percent, i < 0 ? MAX_STATE : i);
        if (is_fresh) {
            om_planner_destroy(planner);
            planner = NULL;
        }
        if (!planner) OM_TRY_DONE(om_planner_create(&def, &planner));
        double start = om_clock_now();
        OM_TRY_DONE(om_planner_solve(planner, &s, &plan));
        if (i >= 0) time[i] = om_clock_now() - start;
        OM_CHECK_DONE(plan.is_optimal, OM_INVALID, "%s: state %d has no proven optimum", scene, i);
        if (i >= 0) row.hash = om_hash(plan.cost, sizeof plan.cost, row.hash);
    }
    bench_times(time, nstate, &row);
    row.worst_ms = 1e3 * time[nstate - 1];
    OM_TRY_DONE(bench_print(&row));
done:
    om_planner_destroy(planner);
    return status;
}

OmStatus bench_plan(const BenchOptions* options) {
    for (int n = 5; n <= 10; n += options->is_quick ? 5 : 1) {
        for (int percent = 10; percent <= 70; percent += 20) {
            int nstate = options->is_quick ? 20 : MAX_STATE;
            OM_TRY(measure(n, percent, true, nstate));
            OM_TRY(measure(n, percent, false, nstate));
        }
    }
    return OM_OK;
}
