// study_estimate.c: how long a study takes, before it starts.
//
// Processor times of one piece of work are constants of each study, measured on the 2-core reference machine. Pieces
// that one thread makes run side by side; the last round is full, whatever is left for it.
#include "studies/study_estimate.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

double om__study_estimate(const StudyWork* work, int nwork, int nworker) {
    const int ncore = om_worker_count(nworker);
    double seconds = 0;
    for (int k = 0; k < nwork; ++k)
        seconds += work[k].seconds * (work[k].is_shared ? (double)work[k].n / ncore
                                                        : ceil((double)work[k].n / ncore));
    return seconds;
}

static void print_time(double seconds, char* out, size_t size) {
    if (seconds < 90)
        snprintf(out, size, "%.0f s", fmax(1, seconds));
    else if (seconds < 90 * 60)
        snprintf(out, size, "%.0f min", seconds / 60);
    else
        snprintf(out, size, "%.1f h", seconds / 3600);
}

void om__study_estimate_print(const StudyWork* work, int nwork, int nworker, char* out,
                              size_t size) {
    char time[32];
    size_t at = 0;
    out[0] = 0;
    for (int k = 0; k < nwork; ++k)
        if (work[k].n > 0 && at < size)
            at += (size_t)snprintf(out + at, size - at, "%s%d %s", at ? ", " : "", work[k].n,
                                   work[k].what);
    print_time(om__study_estimate(work, nwork, nworker), time, sizeof time);
    const int ncore = om_worker_count(nworker);
    if (at > 0 && at < size)
        snprintf(out + at, size - at, ": about %s on %d core%s", time, ncore,
                 ncore == 1 ? "" : "s");
}

OmStatus om__study_estimate_tell(const StudyWork* work, int nwork, int nworker,
                                 const OmProgress* progress) {
    char text[200];
    om__study_estimate_print(work, nwork, nworker, text, sizeof text);
    return text[0] ? om_progress_report(progress, text, 0, -1) : OM_OK;
}

bool om__study_has_file(const char* dir, const char* name) {
    char path[1024];
    return om_path_join(dir, name, path, sizeof path) == OM_OK && om_path_exists(path);
}
