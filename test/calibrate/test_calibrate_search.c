// test_calibrate_search.c: searches on models whose answer is known: recovery, norms, journal, honesty.
#include <signal.h>
#include <stdatomic.h>
#include <sys/wait.h>

#include "omentum/calibrate.h"
#include "test_alloc.h"
#include "test_files.h"

// A spring and a disturbance, y(t) = t / stiffness + offset sin(4 t) / 100, seen at levels t with noise.
enum { NLEVEL = 20, NPARAM = 2 };

typedef struct Spring {
    double observed[NLEVEL];
    atomic_int nevaluation;
    int die_at;      // kills the process in this evaluation
    bool is_ratio;   // only weight / k decides
    bool has_floor;  // an error that no parameter can remove
} Spring;

static double spring_y(const Spring* s, const double* p, double t) {
    return s->is_ratio ? t * p[1] / p[0] : 0.01 * sin(4 * t) * p[1] + t / p[0];
}

static OmStatus spring_eval(void* ctx, const double* p, int nworker, double* error) {
    (void)nworker;
    Spring* s = ctx;
    if (atomic_fetch_add(&s->nevaluation, 1) + 1 == s->die_at) raise(SIGKILL);
    for (int i = 0; i < NLEVEL; ++i) {
        error[i] = fabs(spring_y(s, p, 0.1 * (i + 1)) - s->observed[i]);
        if (s->has_floor) error[i] += 0.01;
    }
    return OM_OK;
}

static const double truth[NPARAM] = {3456.0, 0.37};

static void make_spring(Spring* s, double noise, uint64_t seed) {
    OmRng rng = om_rng_init(seed, 0);
    for (int i = 0; i < NLEVEL; ++i)
        s->observed[i] = spring_y(s, truth, 0.1 * (i + 1)) + noise * om_rng_normal(&rng);
}

static OmCalibrationDef spring_def(Spring* s) {
    OmCalibrationDef def = om_calibration_default_def(spring_eval, s, NLEVEL);
    om_calibration_add_param(&def, "stiffness", 100, 100000, 1000, true);
    om_calibration_add_param(&def, "offset", -1, 1, 0, false);
    def.nworker = 1;
    return def;
}

static void test_recovers_exactly(void** state) {
    (void)state;
    // without noise the minimum is a kink where all errors vanish: what is left is the tolerance
    for (int norm = 0; norm < OM_NNORM; ++norm) {
        for (int global = OM_GLOBAL_EVOLUTION; global < OM_NGLOBAL; ++global) {
            for (int local = OM_LOCAL_SUBPLEX; local < OM_NLOCAL; ++local) {
                // a trimmed mean is no quadratic: SBPLX is the search for it
                if (norm == OM_NORM_TRIMMED && local == OM_LOCAL_BOBYQA) continue;
                Spring s = {0};
                make_spring(&s, 0, 1);
                OmCalibrationDef def = spring_def(&s);
                def.norm = (OmCalibrationNorm)norm;
                if (norm == OM_NORM_HUBER) def.norm_size = 1e-3;
                def.global = (OmCalibrationGlobal)global;
                def.local = (OmCalibrationLocal)local;
                def.noise = 1e-5;  // the scale of the sensitivity, where the cost itself vanishes
                def.tolerance = 1e-6;
                def.max_local = 1000;
                OmCalibrationResult r;
                assert_ok(om_calibration_run(&def, NULL, &r));
                // measured: 4e-4 where a stagnant global search made the local one short (ESCH), else
                // 2e-5; quadratic models do not see a kink: 1.1e-3
                assert_near_rel(r.best[0], truth[0], local == OM_LOCAL_BOBYQA ? 3e-3 : 1e-3);
                assert_near(r.best[1], truth[1], 1e-3);
                assert_true(r.profile[0].is_determined && r.profile[1].is_determined);
                assert_int_equal(r.neval, atomic_load(&s.nevaluation));
                assert_int_equal(r.neval, 2 + r.nglobal + r.nlocal + r.nprofile);
                om_calibration_result_done(&r);
            }
        }
    }
}

// ---- the journal ----------------------------------------------------------------------------------

typedef struct Bytes {
    char* data;
    size_t size;
} Bytes;

static Bytes read_file(const char* dir, const char* name) {
    Bytes b;
    char path[600];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    assert_ok(om_file_read(path, 1u << 30, &b.data, &b.size));
    return b;
}

static void assert_same_file(const char* dir1, const char* dir2, const char* name) {
    Bytes a = read_file(dir1, name), b = read_file(dir2, name);
    assert_int_equal(a.size, b.size);
    assert_memory_equal(a.data, b.data, a.size);
    om_free(a.data);
    om_free(b.data);
}

static void assert_same_folders(const char* dir1, const char* dir2) {
    static const char* const name[] = {"journal.jsonl", "calibration.json", "calibrated.yaml",
                                       "report.html"};
    for (int i = 0; i < 4; ++i) assert_same_file(dir1, dir2, name[i]);
}

// A calibration of a noisy spring in a folder; `die_at` as in Spring.
static OmStatus run_in(const char* dir, int nworker, int die_at, OmCalibrationResult* r) {
    Spring s = {.die_at = die_at};
    make_spring(&s, 0.001, 7);
    OmCalibrationDef def = spring_def(&s);
    def.noise = 0.001;
    def.out_dir = dir;
    def.nworker = nworker;
    OmStatus status = om_calibration_run(&def, NULL, r);
    if (status >= 0) assert_int_equal(atomic_load(&s.nevaluation), r->nnew);
    return status;
}

static void test_same_bytes_whatever_the_workers(void** state) {
    (void)state;
    char one[512], two[512];
    snprintf(one, sizeof one, "%s", temp_path("one"));
    snprintf(two, sizeof two, "%s", temp_path("two"));
    OmCalibrationResult a, b;
    assert_ok(run_in(one, 1, 0, &a));
    for (int nworker = 2; nworker <= 5; ++nworker) {
        assert_ok(run_in(two, nworker, 0, &b));
        assert_memory_equal(a.best, b.best, sizeof a.best);
        assert_int_equal(a.neval, b.neval);
        assert_same_folders(one, two);
        om_calibration_result_done(&b);
        assert_ok(om_path_remove(two));
    }
    om_calibration_result_done(&a);
    assert_ok(om_path_remove(one));
}

static int count_lines(const char* dir) {
    Bytes b = read_file(dir, "journal.jsonl");
    int n = 0;
    for (size_t i = 0; i < b.size; ++i) n += b.data[i] == '\n';
    om_free(b.data);
    return n;
}

static void test_killed_and_resumed(void** state) {
    (void)state;
    char whole[512], cut[512];
    snprintf(whole, sizeof whole, "%s", temp_path("whole"));
    snprintf(cut, sizeof cut, "%s", temp_path("cut"));
    OmCalibrationResult a, b;
    assert_ok(run_in(whole, 1, 0, &a));
    // in the first generation, in a later one, in the local search, in the profiles: each continues from the last
    const int at[] = {3, 100, a.nglobal - 130, a.nlocal, 20};
    for (int i = 0; i < 5; ++i) {
        pid_t child = fork();
        if (child == 0) {
            run_in(cut, 1, at[i], &b);
            _exit(0);
        }
        int how;
        assert_int_equal(waitpid(child, &how, 0), child);
        assert_true(WIFSIGNALED(how) && WTERMSIG(how) == SIGKILL);
    }
    int kept = count_lines(cut) - 1;
    assert_int_equal(kept, at[0] + at[1] + at[2] + at[3] + at[4] - 5);
    // and a line that was cut off
    char path[600];
    snprintf(path, sizeof path, "%s/journal.jsonl", cut);
    FILE* f = fopen(path, "ab");
    fputs("{\"k\":7", f);
    fclose(f);
    assert_ok(run_in(cut, 2, 0, &b));
    assert_int_equal(b.nnew, a.neval - kept);  // nothing that is on file is evaluated again
    assert_same_folders(whole, cut);
    om_calibration_result_done(&b);
    // finished: nothing is evaluated at all
    assert_ok(run_in(cut, 2, 0, &b));
    assert_int_equal(b.nnew, 0);
    assert_same_folders(whole, cut);
    om_calibration_result_done(&b);
    om_calibration_result_done(&a);
    assert_ok(om_path_remove(whole));
    assert_ok(om_path_remove(cut));
}

static void test_refuses_foreign_journals(void** state) {
    (void)state;
    const char* dir = temp_path("foreign");
    OmCalibrationResult r;
    assert_ok(run_in(dir, 1, 0, &r));
    om_calibration_result_done(&r);
    Spring s = {0};
    make_spring(&s, 0.001, 7);
    OmCalibrationDef def = spring_def(&s);
    def.noise = 0.002;
    def.out_dir = dir;
    assert_status(om_calibration_run(&def, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "journal.jsonl: the journal of another problem"));
    def.noise = 0.001;
    char path[600];
    snprintf(path, sizeof path, "%s/journal.jsonl", dir);
    Bytes b = read_file(dir, "journal.jsonl");
    char* line = strchr(b.data, '\n') + 1;
    strstr(line, "\"cost\":")[7] = 'x';
    write_bytes(path, b.data, b.size);
    assert_status(om_calibration_run(&def, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "journal.jsonl:2: not a line of a journal"));
    om_free(b.data);
    assert_ok(om_path_remove(dir));
}

// ---- norms and honesty ----------------------------------------------------------------------------

static void test_robust_norms_ignore_outliers(void** state) {
    (void)state;
    // two of twenty observations are off by a hundred times the noise
    double miss[OM_NNORM];
    for (int norm = 0; norm < OM_NNORM; ++norm) {
        Spring s = {0};
        make_spring(&s, 1e-5, 3);
        s.observed[17] += 1e-3;
        s.observed[18] += 1e-3;
        OmCalibrationDef def = spring_def(&s);
        def.norm = (OmCalibrationNorm)norm;
        def.noise = 1e-5;
        def.unfit = 1e4;
        OmCalibrationResult r;
        assert_ok(om_calibration_run(&def, NULL, &r));
        miss[norm] = fabs(r.best[0] / truth[0] - 1);
        om_calibration_result_done(&r);
    }
    // measured: mean 0.24 %, trimmed 0.21 %, Huber 0.46 %, squares 29 %
    assert_below(miss[OM_NORM_MEAN], 0.01);
    assert_below(miss[OM_NORM_TRIMMED], 0.01);
    assert_below(miss[OM_NORM_HUBER], 0.02);
    assert_true(miss[OM_NORM_SQUARE] > 0.1);
}

static void test_stops_when_the_model_cannot_fit(void** state) {
    (void)state;
    Spring s = {.has_floor = true};
    make_spring(&s, 0, 1);
    OmCalibrationDef def = spring_def(&s);
    def.max_generations = 1000;
    def.noise = 0.001;
    const char* dir = temp_path("unfit");
    def.out_dir = dir;
    OmCalibrationResult r;
    assert_status(om_calibration_run(&def, NULL, &r), OM_UNSAT);
    assert_int_equal(r.outcome, OM_CALIBRATION_UNFIT);
    assert_near(r.cost, 0.01, 1e-4);
    assert_true(r.neval < 400 && !r.has_profile);  // of 16,120
    Bytes page = read_file(dir, "report.html");
    assert_non_null(strstr(page.data, "This model cannot fit"));
    om_free(page.data);
    om_calibration_result_done(&r);
    assert_ok(om_path_remove(dir));
    // the same model with the noise that it has
    def.noise = 0.01;
    def.out_dir = NULL;
    assert_ok(om_calibration_run(&def, NULL, &r));
    om_calibration_result_done(&r);
}

static void test_says_what_is_not_determined(void** state) {
    (void)state;
    // only weight / stiffness decides: each axis closes, the pair does not
    Spring s = {.is_ratio = true};
    make_spring(&s, 0, 1);
    OmCalibrationDef def = om_calibration_default_def(spring_eval, &s, NLEVEL);
    om_calibration_add_param(&def, "stiffness", 100, 100000, 1000, true);
    om_calibration_add_param(&def, "weight", 0.01, 10, 1, true);
    om_calibration_add_param(&def, "colour", 0, 1, 0.5, false);
    def.noise = 1e-6;
    OmCalibrationResult r;
    // in a valley a search has no end of its own
    assert_true(om_calibration_run(&def, NULL, &r) >= 0);
    assert_near_rel(r.best[1] / r.best[0], truth[1] / truth[0], 1e-2);
    assert_false(r.profile[0].is_open_lo || r.profile[0].is_open_hi);
    assert_int_equal(r.profile[0].partner, 1);
    assert_int_equal(r.profile[1].partner, 0);
    assert_true(r.profile[0].partner_rho < -0.95);  // both up: the ratio stays
    assert_true(r.profile[2].is_open_lo && r.profile[2].is_open_hi);
    assert_int_equal(r.profile[2].partner, -1);
    for (int k = 0; k < 3; ++k) assert_false(r.profile[k].is_determined);
    om_calibration_result_done(&r);
}

// Fine-tuning (thesis 3.5.1): no global stage, never farther than the range allows.
// A cost of 1 mm for each unit away from 3: with noise n it rises by a share r where it is n sqrt(r (2 + r)), so that
// the interval is known. What a bound cuts off is open there, and not determined.
static OmStatus ramp_eval(void* ctx, const double* p, int nworker, double* error) {
    (void)ctx, (void)nworker;
    error[0] = 0.001 * fabs(p[0] - 3);
    return OM_OK;
}

static void test_intervals_by_hand(void** state) {
    (void)state;
    double half = 2 * sqrt(0.1 * 2.1);  // noise of 2 mm, rise of 0.1
    const double bound[3][2] = {{0, 10}, {2.5, 10}, {0, 3.4}};
    for (int k = 0; k < 3; ++k) {
        OmCalibrationDef def = om_calibration_default_def(ramp_eval, NULL, 1);
        om_calibration_add_param(&def, "x", bound[k][0], bound[k][1],
                                 0.5 * (bound[k][0] + bound[k][1]), false);
        def.nworker = 1;
        def.noise = 0.002;
        def.rise = 0.1;
        OmCalibrationResult r;
        assert_ok(om_calibration_run(&def, NULL, &r));
        const OmCalibrationProfile* f = &r.profile[0];
        assert_near(r.best[0], 3, 0.01);
        assert_near(f->lo, fmax(bound[k][0], 3 - half), 0.01);
        assert_near(f->hi, fmin(bound[k][1], 3 + half), 0.01);
        assert_true(f->is_open_lo == (k == 1) && f->is_open_hi == (k == 2));
        assert_true(f->is_determined == (k == 0));
        om_calibration_result_done(&r);
    }
}

static void test_local_stage_stays_within_its_range(void** state) {
    (void)state;
    Spring s = {0};
    make_spring(&s, 0, 1);
    OmCalibrationDef def = spring_def(&s);
    def.global = OM_GLOBAL_NONE;
    def.rise = 0;
    def.param[0].start = 100;  // three decades: 40 % around it end at 400
    OmCalibrationResult r;
    assert_ok(om_calibration_run(&def, NULL, &r));
    assert_near_rel(r.best[0], 100 * pow(1000, 0.2), 1e-3);
    assert_int_equal(r.nglobal, 0);
    om_calibration_result_done(&r);
    def.max_local = 3;
    assert_status(om_calibration_run(&def, NULL, &r), OM_NOT_CONVERGED);
    assert_int_equal(r.outcome, OM_CALIBRATION_BUDGET);
    assert_int_equal(r.nlocal, 3);
    om_calibration_result_done(&r);
}

// ---- what can go wrong ----------------------------------------------------------------------------

static OmStatus picky_eval(void* ctx, const double* p, int nworker, double* error) {
    const double* mode = ctx;
    if (*mode == 1) return om_error(OM_IO, "the probe of %g is lost", p[0]);
    if (*mode == 2 || p[0] < 0.5) return OM_UNSAT;
    (void)nworker;
    *error = fabs(p[0] - 0.6);
    return OM_OK;
}

static void test_models_that_do_not_exist(void** state) {
    (void)state;
    double mode = 0;
    OmCalibrationDef def = om_calibration_default_def(picky_eval, &mode, 1);
    om_calibration_add_param(&def, "x", 0, 1, 0.1, false);
    def.noise = 1e-3;
    OmCalibrationResult r;
    for (int local = OM_LOCAL_SUBPLEX; local < OM_NLOCAL; ++local) {
        def.local = (OmCalibrationLocal)local;
        assert_ok(om_calibration_run(&def, NULL, &r));
        assert_near(r.best[0], 0.6, 1e-3);
        assert_true(isinf(r.cost_start));
        om_calibration_result_done(&r);
    }
    mode = 2;
    assert_status(om_calibration_run(&def, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "no parameters within the bounds gave a model"));
    mode = 1;
    def.nworker = 4;
    assert_status(om_calibration_run(&def, NULL, &r), OM_IO);
    assert_string_equal(om_error_message(), "the probe of 0.1 is lost");
}

static bool stop_at_40(void* ctx, const char* stage, double done, double total) {
    (void)stage, (void)done, (void)total;
    return ++*(int*)ctx < 40;
}

static void test_cancelled(void** state) {
    (void)state;
    Spring s = {0};
    make_spring(&s, 0, 1);
    OmCalibrationDef def = spring_def(&s);
    int count = 0;
    OmProgress progress = {stop_at_40, &count};
    OmCalibrationResult r;
    assert_status(om_calibration_run(&def, &progress, &r), OM_CANCELLED);
    assert_int_equal(atomic_load(&s.nevaluation), 40);
}

static void test_bad_definitions(void** state) {
    (void)state;
    Spring s = {0};
    make_spring(&s, 0, 1);
    const OmCalibrationDef good = spring_def(&s);
    OmCalibrationDef def;
    OmCalibrationResult r;
#define REFUSED(change, word)                                          \
    do {                                                               \
        def = good;                                                    \
        change;                                                        \
        assert_status(om_calibration_run(&def, NULL, &r), OM_INVALID); \
        assert_non_null(strstr(om_error_message(), word));             \
    } while (0)
    REFUSED(def.cookie = 0, "om_calibration_default_def");
    REFUSED(def.nparam = 0, "nparam");
    REFUSED(def.nparam = 9, "nparam");
    REFUSED(def.nerror = 0, "nerror");
    REFUSED(def.param[1].lo = 2, "param[1] (offset): bounds");
    REFUSED(def.param[1].start = NAN, "param[1] (offset): start");
    REFUSED(def.param[1].is_log = true, "logarithm");
    REFUSED(strcpy(def.param[1].name, "stiffness"), "two parameters are called \"stiffness\"");
    REFUSED(def.noise = -1, "noise");
    REFUSED(def.norm = OM_NORM_HUBER, "Huber");
    REFUSED(def.population = 4, "population");
    REFUSED(def.local_range = 0, "local_range");
    REFUSED(def.tolerance = 0, "tolerance");
    REFUSED((def.global = OM_GLOBAL_NONE, def.local = OM_LOCAL_NONE), "nothing to do");
#undef REFUSED
}

static OmStatus run_small(void* ctx) {
    Spring s = {0};
    make_spring(&s, 0.001, 7);
    OmCalibrationDef def = spring_def(&s);
    static const char* const name[] = {"only"};
    OmCalibrationLabel label[NLEVEL] = {0};
    def.label = label;
    def.nexperiment = def.nlandmark = 1;
    def.experiment = def.landmark = name;
    def.norm = OM_NORM_TRIMMED;
    def.max_generations = 2;
    def.out_dir = ctx;
    OmCalibrationResult r;
    OmStatus status = om_calibration_run(&def, NULL, &r);
    if (status >= 0) om_calibration_result_done(&r);
    if (status >= 0) om_path_remove(ctx);
    return status;
}

static void test_allocations_fail(void** state) {
    (void)state;
    char dir[512];
    snprintf(dir, sizeof dir, "%s", temp_path("alloc"));
    // the journal of one attempt serves the next: all that is read back fails in turn as well
    assert_true(test_failing_allocations(run_small, dir, 7) > 20);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_recovers_exactly),
        cmocka_unit_test(test_same_bytes_whatever_the_workers),
        cmocka_unit_test(test_killed_and_resumed),
        cmocka_unit_test(test_refuses_foreign_journals),
        cmocka_unit_test(test_robust_norms_ignore_outliers),
        cmocka_unit_test(test_stops_when_the_model_cannot_fit),
        cmocka_unit_test(test_says_what_is_not_determined),
        cmocka_unit_test(test_intervals_by_hand),
        cmocka_unit_test(test_local_stage_stays_within_its_range),
        cmocka_unit_test(test_models_that_do_not_exist),
        cmocka_unit_test(test_cancelled),
        cmocka_unit_test(test_bad_definitions),
        cmocka_unit_test(test_allocations_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
