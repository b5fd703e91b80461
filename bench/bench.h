// bench.h: how a room adds benchmarks: a function here, a row in the table of bench_main.c.
#ifndef OMENTUM_BENCH_H
#define OMENTUM_BENCH_H

#include "omentum/omentum.h"

typedef struct BenchOptions {
    int nworker;       // threads, from --workers
    int nrun;          // repetitions of each measurement, from --runs
    bool is_quick;     // small sizes only, from --quick
    const char* only;  // from --only; null: every row
} BenchOptions;

typedef enum BenchCompare { BENCH_MIN, BENCH_MEDIAN, BENCH_MEAN } BenchCompare;

typedef struct BenchRow {  // one line of output; zero and null fields are left out
    const char* bench;     // name of the table's row
    const char* scene;     // what was computed on
    const char* work;      // what was computed
    int64_t size;          // elements, frames, states ...
    int nworker, steps, nrun;
    double min_ms, median_ms, mean_ms, p99_ms,
        worst_ms;            // of one step; p99_ms: 99 % take no longer
    BenchCompare compares;   // the time that is compared with the reference and the goal
    bool is_processor_time;  // without --processor, too
    const char* reference;   // what the ratio compares with
    double reference_ms;     // its time; ratio = reference_ms / the compared time
    double goal_ms;  // to be reached on the reference machine; goal_ratio = goal_ms / the same
    double iterations, residual;  // means over the steps, worst over the steps
    double solves;                // linear solves a step
    double bytes_per_element;
    bool is_stall;  // print worst over median and the next three, also where they are zero
    double not_ok;  // % of the steps whose status is not OM_OK
    double worst_iterations, worst_substeps;  // of a step
    char why[256];                            // of the first step that is not OK
    uint64_t hash;                            // of the final state
} BenchRow;

typedef OmStatus (*BenchFn)(const BenchOptions* options);

/// Seconds of the clock on the wall, or of processor time of all threads with --processor.
double bench_now(void);
/// True if --only allows a row: fem and stall compute only rows whose "scene: work" contains its text.
bool bench_is_wanted(const BenchOptions* options, const char* scene, const char* work);
/// Print the row as one JSON object a line; with --table as a line of a table.
OmStatus bench_print(const BenchRow* row);
/// Contact with the board z = 0, which the caller destroys, also on an error.
OmStatus bench_board(const OmTissueModel* model, OmContact** contact, OmContactWork** work);
/// The default scene on 20 x 20 x 1 cells of linear elements.
OmScene bench_sheet(void);
/// Box [0, size] of tetrahedra, cells[0] x cells[1] x cells[2] cubes, attached where coordinate `axis` is 0.
OmStatus bench_box(OmVec3 size, const int cells[3], int axis, OmTetMesh* mesh);
/// Minimum, median, mean, 99 % and worst of n times in s, as ms; sorts them.
void bench_times(double* time, int n, BenchRow* row);
/// The same of steps, each with the least of its times in all runs. `time` is overwritten.    (nrun x nstep)
void bench_steps(double* time, int nrun, int nstep, BenchRow* row);
/// Add ms to every time of the row.
void bench_add(BenchRow* row, double ms);

OmStatus bench_solve(const BenchOptions* options);       // bench_solve.c
OmStatus bench_fem(const BenchOptions* options);         // bench_fem.c
OmStatus bench_static(const BenchOptions* options);      // bench_static.c
OmStatus bench_contact(const BenchOptions* options);     // bench_contact.c
OmStatus bench_self(const BenchOptions* options);        // bench_self.c
OmStatus bench_press(const BenchOptions* options);       // bench_press.c
OmStatus bench_stall_lift(const BenchOptions* options);  // bench_stall.c
OmStatus bench_stall_hold(const BenchOptions* options);
OmStatus bench_stall_drop(const BenchOptions* options);
OmStatus bench_stall_press(const BenchOptions* options);
OmStatus bench_stall_fold(const BenchOptions* options);
OmStatus bench_stall_hard(const BenchOptions* options);
OmStatus bench_pbd(const BenchOptions* options);             // bench_pbd.c
OmStatus bench_heuristic(const BenchOptions* options);       // bench_heuristic.c
OmStatus bench_shape(const BenchOptions* options);           // bench_shape.c
OmStatus bench_plan(const BenchOptions* options);            // bench_plan.c
OmStatus bench_sense(const BenchOptions* options);           // bench_sense.c
OmStatus bench_nn(const BenchOptions* options);              // bench_nn.c
OmStatus bench_umesh(const BenchOptions* options);           // bench_umesh.c
OmStatus bench_crowd(const BenchOptions* options);           // bench_crowd.c
OmStatus bench_scan(const BenchOptions* options);            // bench_scan.c
OmStatus bench_match_register(const BenchOptions* options);  // bench_match_register.c
OmStatus bench_match_update(const BenchOptions* options);    // bench_match_update.c
OmStatus bench_match_spectral(const BenchOptions* options);  // bench_match_spectral.c
OmStatus bench_match_live(const BenchOptions* options);      // bench_match_live.c
OmStatus bench_monitor(const BenchOptions* options);         // bench_monitor.c
OmStatus bench_view(const BenchOptions* options);            // bench_view.c
OmStatus bench_rl(const BenchOptions* options);              // bench_rl.c

#endif
