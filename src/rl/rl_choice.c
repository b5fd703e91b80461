// rl_choice.c: multi-discrete categorical distributions.
//
// An action has components k with nchoice[k] choices, independent given the observation. Sums are in double.
#include <math.h>

#include "rl/rl_internal.h"

void om__rl_choice_log(int n, const float* logit, double* log_prob) {
    double top = (double)logit[0], sum = 0;
    for (int j = 1; j < n; ++j)
        if ((double)logit[j] > top) top = (double)logit[j];
    for (int j = 0; j < n; ++j) sum += exp((double)logit[j] - top);
    for (int j = 0; j < n; ++j) log_prob[j] = (double)logit[j] - top - log(sum);  // sum >= 1
}

// The choice of one component.
static int draw(int n, const double* log_prob, OmRng* rng) {
    int best = 0;
    if (!rng) {
        for (int j = 1; j < n; ++j)
            if (log_prob[j] > log_prob[best]) best = j;
        return best;
    }
    double u = om_rng_uniform(rng);
    for (int j = 0; j < n - 1; ++j) {
        u -= exp(log_prob[j]);
        if (u < 0) return j;
    }
    return n - 1;
}

double om__rl_choice_draw(int naction, const int* nchoice, const float* logit, OmRng* rng,
                          int* action) {
    double log_prob[OM_RL_MAX_CHOICE], sum = 0;
    for (int k = 0; k < naction; logit += nchoice[k++]) {
        om__rl_choice_log(nchoice[k], logit, log_prob);
        action[k] = draw(nchoice[k], log_prob, rng);
        sum += log_prob[action[k]];
    }
    return sum;
}
