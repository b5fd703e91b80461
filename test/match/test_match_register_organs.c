// test_match_register_organs.c: organs half seen, from starts up to 30 degrees and 30 mm off. 95 % must end within
// 0.5 mm and 0.5 degrees, and no result that is_reliable may be farther off. OM_REGISTER_STARTS: number of starts.
#include "match/register_cases.h"

#define FIRST_SEED 7000  // of the starts that are counted; others were used to choose the settings

typedef struct Count {
    int n, nright, nreliable, nsilent;
    double angle[1000], shift[1000], ms;
} Count;

static void count_one(const OrganCase* c, int k, Count* count) {
    OmScan scan;
    OmPose truth;
    OmRegistration r;
    double angle, shift;
    case_look(c, FIRST_SEED + (uint64_t)k, &scan, &truth);
    OmRegisterDef def = om_register_default_def();
    def.has_start = true;
    def.pose_model_scan = case_start(&scan, truth, OM_PI / 6, 0.03, FIRST_SEED + (uint64_t)k);
    def.nworker = 2;
    assert_ok(om_scan_register(&def, &c->model, &scan, &r));
    om_scan_done(&scan);
    case_error(&r, truth, &angle, &shift);
    bool is_right = angle <= 0.5 && shift <= 0.5;
    count->angle[count->n] = angle;
    count->shift[count->n++] = shift;
    count->nright += is_right;
    count->nreliable += r.is_reliable;
    count->nsilent += r.is_reliable && !is_right;
    count->ms += r.ms;
    if (r.is_reliable && !is_right)
        printf("  start %d: %.2f degrees and %.2f mm off, said to be %.2f and %.2f\n", k, angle,
               shift, r.sigma_angle * 180 / OM_PI, 1e3 * r.sigma_shift);
}

static void test_organs(void** state) {
    (void)state;
    const char* text = getenv("OM_REGISTER_STARTS");
    int n = text ? atoi(text) : 20, nright = 0, nall = 0, nsilent = 0;
    n = n < 1 ? 1 : n > 1000 ? 1000 : n;
    static Count count;
    printf("%-17s %7s %9s %9s %12s %12s %7s\n", "organ", "right", "reliable", "silent",
           "degrees 50/95", "mm 50/95", "ms");
    for (int o = 0; o < NORGAN; ++o) {
        OrganCase c;
        case_make(&organ_list[o], &c);
        memset(&count, 0, sizeof count);
        for (int k = 0; k < n; ++k) count_one(&c, k, &count);
        case_done(&c);
        om_sort_doubles(count.angle, n);
        om_sort_doubles(count.shift, n);
        int last = n * 95 / 100 < n ? n * 95 / 100 : n - 1;
        printf("%-17s %3d/%3d %9d %9d   %5.2f %5.2f  %5.2f %5.2f %7.0f\n", organ_list[o].name,
               count.nright, n, count.nreliable, count.nsilent, count.angle[n / 2],
               count.angle[last], count.shift[n / 2], count.shift[last], count.ms / n);
        fflush(stdout);
        nright += count.nright, nall += n, nsilent += count.nsilent;
    }
    assert_true(nright >= 0.95 * nall);
    assert_int_equal(nsilent, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_organs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
