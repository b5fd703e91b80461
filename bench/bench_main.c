// bench_main.c: omentum_bench [--workers N] [--runs N] [--quick] [--processor] [--table] [--list] [NAME ...]
//
// Runs the benchmarks whose names begin with one of NAMEs (all without any) and prints one JSON object a
// line: scene, workers, steps, minimum, median, mean, 99 % and worst of N runs in ms, ratio to its reference, state
// hash. --table prints a table of these times instead.
//
// --processor counts processor time of all threads in place of time on the wall: for machines that others use. Take
// one worker with it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bench.h"
#include "cli/cli_common.h"

static const struct {
    const char* name;
    BenchFn fn;
} bench_table[] = {
    {"solve", bench_solve},
    {"fem", bench_fem},
    {"static", bench_static},
    {"contact", bench_contact},
    {"self", bench_self},
    {"press", bench_press},
    {"stall_lift", bench_stall_lift},
    {"stall_hold", bench_stall_hold},
    {"stall_drop", bench_stall_drop},
    {"stall_press", bench_stall_press},
    {"stall_fold", bench_stall_fold},
    {"stall_hard", bench_stall_hard},
    {"shape", bench_shape},
    {"plan", bench_plan},
    {"sense", bench_sense},
    {"pbd", bench_pbd},
    {"heuristic", bench_heuristic},
    {"nn", bench_nn},
    {"umesh", bench_umesh},
    {"crowd", bench_crowd},
    {"match_spectral", bench_match_spectral},
    {"match_update", bench_match_update},
    {"scan", bench_scan},
    {"match_register", bench_match_register},
    {"match_live", bench_match_live},
    {"monitor", bench_monitor},
    {"view", bench_view},
    {"rl", bench_rl},
};
#define NBENCH ((int)(sizeof bench_table / sizeof *bench_table))

static bool is_processor_time, is_table;

double bench_now(void) {
    return is_processor_time ? (double)clock() / CLOCKS_PER_SEC : om_clock_now();
}

OmStatus bench_board(const OmTissueModel* model, OmContact** contact, OmContactWork** work) {
    OmContactDef def = om_contact_default_def();
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    def.nobstacle = 1, def.obstacle = &board;
    OM_TRY(om_contact_create(&def, model, contact));
    return om_contact_work_create(*contact, work);
}

OmScene bench_sheet(void) {
    OmScene s = om_scene_default();
    s.tissue.element = OM_ELEMENT_LINEAR;
    s.tissue.law = OM_STABLE_NEO_HOOKEAN;
    s.tissue.cells = om_vec3(20, 20, 1);
    return s;
}

OmStatus bench_box(OmVec3 size, const int cells[3], int axis, OmTetMesh* mesh) {
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), size, cells[0], cells[1], cells[2], mesh));
    int count = 0, *vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    if (!vert) return OM_NO_MEMORY;
    for (int i = 0; i < mesh->nvert; ++i)
        if (mesh->x[3 * i + axis] < 1e-9) vert[count++] = i;
    OmStatus status = om_tet_mesh_add_set(mesh, "attachment", vert, count);
    om_free(vert);
    return status;
}

static OmStatus print_table_row(const BenchRow* row) {
    static bool has_head;
    if (!has_head)
        printf("%9s %9s %9s %9s %9s  %s\n", "min ms", "median", "mean", "99 %", "worst",
               "what, size, workers");
    has_head = true;
    printf("%9.4g %9.4g %9.4g %9.4g %9.4g  %s: %s: %s, %lld, %d", row->min_ms, row->median_ms,
           row->mean_ms, row->p99_ms, row->worst_ms, row->bench, row->scene, row->work,
           (long long)row->size, row->nworker);
    if (row->is_stall)
        printf("; worst / median %.3g, %.3g %% not OK, at most %.0f iterations, %.0f substeps",
               row->worst_ms / row->median_ms, row->not_ok, row->worst_iterations,
               row->worst_substeps);
    if (row->why[0]) printf("; %s", row->why);
    putchar('\n');
    fflush(stdout);
    return OM_OK;
}

OmStatus bench_print(const BenchRow* row) {
    if (is_table) return print_table_row(row);
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "bench", row->bench);
    om_json_string(&json, "scene", row->scene);
    om_json_string(&json, "work", row->work);
    if (row->size) om_json_integer(&json, "size", row->size);
    om_json_integer(&json, "workers", row->nworker);
    if (is_processor_time || row->is_processor_time) om_json_string(&json, "clock", "processor");
    om_json_integer(&json, "steps", row->steps);
    om_json_integer(&json, "runs", row->nrun);
    om_json_number(&json, "min_ms", row->min_ms);
    om_json_number(&json, "median_ms", row->median_ms);
    om_json_number(&json, "mean_ms", row->mean_ms);
    om_json_number(&json, "p99_ms", row->p99_ms);
    om_json_number(&json, "worst_ms", row->worst_ms);
    double compared_ms = row->compares == BENCH_MEDIAN ? row->median_ms
                         : row->compares == BENCH_MEAN ? row->mean_ms
                                                       : row->min_ms;
    if (row->reference) {
        om_json_string(&json, "reference", row->reference);
        om_json_number(&json, "reference_ms", row->reference_ms);
        om_json_number(&json, "ratio", compared_ms > 0 ? row->reference_ms / compared_ms : 0);
    }
    if (row->goal_ms > 0) {
        om_json_number(&json, "goal_ms", row->goal_ms);
        om_json_number(&json, "goal_ratio", compared_ms > 0 ? row->goal_ms / compared_ms : 0);
    }
    if (row->iterations > 0) om_json_number(&json, "iterations", row->iterations);
    if (row->solves > 0) om_json_number(&json, "solves", row->solves);
    if (row->residual > 0) om_json_number(&json, "residual", row->residual);
    if (row->bytes_per_element > 0)
        om_json_number(&json, "bytes_per_element", row->bytes_per_element);
    if (row->is_stall) {
        om_json_number(&json, "worst_over_median", row->worst_ms / row->median_ms);
        om_json_number(&json, "not_ok_percent", row->not_ok);
        om_json_number(&json, "worst_iterations", row->worst_iterations);
        om_json_number(&json, "worst_substeps", row->worst_substeps);
        if (row->why[0]) om_json_string(&json, "first_not_ok", row->why);
    }
    char hash[32];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)row->hash);
    if (row->hash) om_json_string(&json, "hash", hash);
    om_json_close(&json, '}');
    OmStatus status = om_json_end(&json);
    if (status == OM_OK) {
        for (const char* c = text.str; *c; ++c) {  // without line breaks and indentation
            if (*c != '\n')
                putchar(*c);
            else
                while (c[1] == ' ') ++c;
        }
        putchar('\n');
        fflush(stdout);
    }
    om_text_done(&text);
    return status;
}

bool bench_is_wanted(const BenchOptions* options, const char* scene, const char* work) {
    char text[256];
    snprintf(text, sizeof text, "%s: %s", scene, work);
    return !options->only || strstr(text, options->only);
}

static int compare_doubles(const void* a, const void* b) {
    double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

void bench_times(double* time, int n, BenchRow* row) {
    qsort(time, (size_t)n, sizeof *time, compare_doubles);
    row->nrun = n;
    row->min_ms = 1e3 * time[0];
    row->median_ms = 1e3 * (n % 2 ? time[n / 2] : 0.5 * (time[n / 2 - 1] + time[n / 2]));
    row->mean_ms = 0;
    for (int k = 0; k < n; ++k) row->mean_ms += 1e3 * time[k] / n;
    row->p99_ms = 1e3 * time[(99 * (int64_t)n + 99) / 100 - 1];
    row->worst_ms = 1e3 * time[n - 1];
}

void bench_steps(double* time, int nrun, int nstep, BenchRow* row) {
    for (int run = 1; run < nrun; ++run)
        for (int step = 0; step < nstep; ++step)
            time[step] = fmin(time[step], time[(size_t)run * (size_t)nstep + (size_t)step]);
    bench_times(time, nstep, row);
    row->nrun = nrun;
}

void bench_add(BenchRow* row, double ms) {
    row->min_ms += ms;
    row->median_ms += ms;
    row->mean_ms += ms;
    row->p99_ms += ms;
    row->worst_ms += ms;
}

static bool is_wanted(const char* name, int nname, char** names) {
    for (int k = 0; k < nname; ++k)
        if (strncmp(name, names[k], strlen(names[k])) == 0) return true;
    return nname == 0;
}

static int say_usage(void) {
    fprintf(
        stderr,
        "usage: omentum_bench [--workers N] [--runs N] [--quick] [--processor] [--table] [--list] "
        "[--only TEXT] [NAME ...]\n"
        "names begin with one of those that --list prints\n");
    return 2;
}

// Does it name a bench?
static bool is_known(const char* name) {
    for (int k = 0; k < NBENCH; ++k)
        if (strncmp(bench_table[k].name, name, strlen(name)) == 0) return true;
    return false;
}

int main(int argc, char** argv) {
    om_cli_set_environment(argv);
    BenchOptions options = {.nworker = om_worker_count(0), .nrun = 5};
    int nname = 0;  // names are moved to the front of argv
    for (int arg = 1; arg < argc; ++arg) {
        if (strcmp(argv[arg], "--quick") == 0) {
            options.is_quick = true;
        } else if (strcmp(argv[arg], "--workers") == 0 && arg + 1 < argc) {
            options.nworker = om_worker_count(atoi(argv[++arg]));
        } else if (strcmp(argv[arg], "--runs") == 0 && arg + 1 < argc) {
            options.nrun = atoi(argv[++arg]);
        } else if (strcmp(argv[arg], "--only") == 0 && arg + 1 < argc) {
            options.only = argv[++arg];
        } else if (strcmp(argv[arg], "--processor") == 0) {
            is_processor_time = true;
        } else if (strcmp(argv[arg], "--table") == 0) {
            is_table = true;
        } else if (strcmp(argv[arg], "--list") == 0) {
            for (int k = 0; k < NBENCH; ++k) puts(bench_table[k].name);
            return 0;
        } else if (is_known(argv[arg])) {
            argv[nname++] = argv[arg];
        } else {
            return say_usage();
        }
    }
    if (options.nrun < 1) options.nrun = 1;
    int failed = 0;
    for (int k = 0; k < NBENCH; ++k) {
        if (!is_wanted(bench_table[k].name, nname, argv)) continue;
        OmStatus status = bench_table[k].fn(&options);
        if (status >= 0) continue;
        fprintf(stderr, "%s: %s\n", bench_table[k].name, om_error_message());
        failed = 1;
    }
    return failed;
}
