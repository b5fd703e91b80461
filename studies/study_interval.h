// study_interval.h: 95 % confidence intervals of shares, and of differences between two ways on the same cases.
#ifndef OMENTUM_STUDY_INTERVAL_H
#define OMENTUM_STUDY_INTERVAL_H

typedef struct StudyInterval {
    double value, lo, hi;
} StudyInterval;

// k of n, 0 <= k <= n, n > 0: Wilson's score interval (Wilson 1927).
StudyInterval om__interval_share(int k, int n);
// The share of the first way less that of the second on n > 0 cases that both were tried on; `first_only` and
// `second_only` count the cases where one alone succeeded. Agresti and Min 2005: Wald's interval with half a case more
// in each of the four cells.
StudyInterval om__interval_paired(int first_only, int second_only, int n);

#endif
