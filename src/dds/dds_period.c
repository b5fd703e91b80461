// dds_period.c: periods between the messages of an arm, as a histogram.
#include "dds/dds_period.h"

#include <math.h>

#define BIN 1e-4  // s

void om__periods_count(Periods* p, double now, double wanted) {
    const double period = now - p->last, bin = period / BIN;
    if (p->last > 0) {
        ++p->bin[bin < PERIOD_NBIN - 1 ? (int)bin : PERIOD_NBIN - 1];
        ++p->n;
        p->nlate += period > 1.5 * wanted;
        p->longest = fmax(p->longest, period);
    }
    p->last = now;
}

double om__periods_quantile(const Periods* p, double share) {
    int64_t sum = 0;
    if (p->n == 0) return NAN;
    for (int k = 0; k < PERIOD_NBIN; ++k) {
        sum += p->bin[k];
        if ((double)sum >= share * (double)p->n) return BIN * (k + 0.5);
    }
    return BIN * PERIOD_NBIN;
}
