// test_match_prior.c: what evidence and patches say about each candidate, against the formulas written out.
#include "test_common.h"

#include "match/match_internal.h"

enum { NCANDIDATE = 12, NHYPOTHESIS = 200 };

// (sum w)^2 / sum w^2 of w = exp(l / temperature).
static double effective_number(const double* l, double temperature) {
    double sum = 0, square = 0;
    for (int h = 0; h < NHYPOTHESIS; ++h) {
        double w = exp(l[h] / temperature);
        sum += w;
        square += w * w;
    }
    return sum * sum / square;
}

static double log_odds(double p) { return log(p) - log(1 - p); }

// Log-odds of the weighted share of patches that have the candidate, mixed with those of a belief, and the evidence.
// Temperature rises by quarters until 40 patches share the weight.
static void test_probability(void** state) {
    (void)state;
    unsigned char in[NHYPOTHESIS * NCANDIDATE];
    double evidence[NCANDIDATE], belief[NCANDIDATE], l[NHYPOTHESIS] = {0}, got[NCANDIDATE];
    OmRng rng = om_rng_init(4, 0);
    for (int k = 0; k < NHYPOTHESIS * NCANDIDATE; ++k) in[k] = om_rng_uniform(&rng) < 0.4;
    for (int i = 0; i < NCANDIDATE; ++i) {
        evidence[i] = om_rng_range(&rng, -4, 4);
        belief[i] = om_rng_range(&rng, 0.1, 0.9);
    }
    for (int h = 0; h < NHYPOTHESIS; ++h)
        for (int i = 0; i < NCANDIDATE; ++i) l[h] += in[h * NCANDIDATE + i] ? evidence[i] : 0;
    const OmMatch match = {
        .def.nhypothesis = NHYPOTHESIS, .view.ncandidate = NCANDIDATE, .hypothesis = in};
    double temperature = 1, all = 0;
    assert_true(effective_number(l, 1) < 20);
    while (effective_number(l, temperature) < 40) temperature *= 1.25;
    for (int h = 0; h < NHYPOTHESIS; ++h) all += exp(l[h] / temperature);
    for (int with_belief = 0; with_belief < 2; ++with_belief) {
        assert_ok(om__match_infer(&match, evidence, with_belief ? belief : NULL, 0.3, got));
        for (int i = 0; i < NCANDIDATE; ++i) {
            double p = 0;
            for (int h = 0; h < NHYPOTHESIS; ++h)
                p += in[h * NCANDIDATE + i] ? exp(l[h] / temperature) / all : 0;
            assert_in_range((int)(100 * p), 2, 97);  // within the bounds of the bank
            double odds = log_odds(p);
            if (with_belief) odds = 0.7 * odds + 0.3 * log_odds(belief[i]);
            assert_near(log_odds(got[i]), odds + evidence[i], 1e-9);
        }
    }
}

static void test_log_odds(void** state) {
    (void)state;
    assert_near(om__match_logit(0.5), 0, 1e-15);
    assert_near(om__match_logit(0.75), log(3), 1e-15);
    assert_near(om__match_logit(0.25), -log(3), 1e-15);
    assert_near(om__match_logit(0), -log(49), 1e-14);  // bounded at 0.02
    assert_near(om__match_logit(1), log(49), 1e-14);
}

// Of the sets above a level, the one with the largest expected Dice coefficient. Areas 1, 1, 2 with 0.9, 0.5, 0.3 and a
// sum of p of 2: the first alone has 2 x 0.9 / (1 + 2) = 0.6, the first two 0.7, all three 0.667.
static void test_level(void** state) {
    (void)state;
    double area[3] = {1, 1, 2}, p[3] = {0.9, 0.5, 0.3};
    const OmMatch match = {.view.ncandidate = 3, .area = area};
    double level = om__match_choose_level(&match, p);
    assert_true(level >= 0.3 && level < 0.5);
    p[1] = 0.25;  // now 0.706, and 0.648 or less with more
    p[2] = 0.2;
    level = om__match_choose_level(&match, p);
    assert_true(level >= 0.25 && level < 0.9);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_probability),
                                       cmocka_unit_test(test_log_odds),
                                       cmocka_unit_test(test_level)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
