// dds_period.h: periods between the messages of an arm, as a histogram.
#ifndef OMENTUM_DDS_PERIOD_H
#define OMENTUM_DDS_PERIOD_H

#include <stdint.h>

enum { PERIOD_NBIN = 2000 };

typedef struct Periods {
    double last;     // s, of the last message; 0: none yet
    double longest;  // s
    int64_t n, nlate;
    int bin[PERIOD_NBIN];  // of 0.1 ms; the last one has all above
} Periods;

// A message at `now` (s, above 0); late: longer than one and a half times `wanted` (s).
void om__periods_count(Periods* periods, double now, double wanted);
// The period (s) below which a share of all lies, to one bin; NAN: fewer than two messages.
double om__periods_quantile(const Periods* periods, double share);

#endif
