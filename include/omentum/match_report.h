/// omentum/match_report.h: the page and the files of an update (room `match`, floor 5).
///
///     OmMatchReport report = {.title = "patient", .site = &site, .match = match, .nacquisition = 1, ...};
///     om_match_report_save(&report, "out/report.html");
#ifndef OMENTUM_MATCH_REPORT_H
#define OMENTUM_MATCH_REPORT_H

#include "omentum/match.h"
#include "omentum/match_register.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmMatchReport {  // all borrowed
    const char* title;
    const OmSite* site;
    const OmMatch* match;
    int nacquisition;
    const OmAcquisition* acquisition;
    const char* const* name;  // of the acquisitions
    // of the acquisitions; nstart 0: not registered here; null: none is
    const OmRegistration* registration;
    const OmMatchEstimate* estimate;  // null: there is none, `reason` says why
    const char* reason;
    double load_ms, build_ms, register_ms;  // times of the stages before the update
} OmMatchReport;

/// Whether the twin takes the new attachments.
static inline bool om_match_report_is_accepted(const OmMatchReport* report) {
    return report->estimate && report->estimate->is_accepted;
}
/// Why not; "" if it does.
static inline const char* om_match_report_reason(const OmMatchReport* report) {
    return report->estimate ? report->estimate->reason : report->reason;
}

/// Write a page: the verdict, the clouds over the model, attachments before and after, where to look next, times.
/// @return OM_OK; OM_INVALID; OM_NO_MEMORY; OM_IO; OM_UNAVAILABLE (no pictures can be made)
OM_API OmStatus om_match_report_save(const OmMatchReport* report, const char* path);
/// Write the figures as JSON.
/// @return OM_OK; OM_INVALID (a path that is too long); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_match_report_save_json(const OmMatchReport* report, const char* path);
/// Write the mesh of the twin with arrays of its vertices: probability, uncertainty, stiffness (N/m), attached,
/// believed (attached before), and displacement (m) or, of several acquisitions, displacement_1, ... An estimate that
/// was refused before the twin came to rest has no displacement.
/// @return OM_OK; OM_INVALID (there is no estimate); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_match_report_save_mesh(const OmMatchReport* report, const char* path);

#ifdef __cplusplus
}
#endif
#endif
