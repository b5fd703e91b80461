// match_update.c: attachments that explain scans.
#include "match/match_internal.h"

OmStatus om_match_update(OmMatch* match, int nacquisition, const OmAcquisition* acquisition,
                         const OmProgress* progress, OmMatchEstimate* estimate) {
    (void)match, (void)nacquisition, (void)acquisition, (void)progress, (void)estimate;
    return om_error(OM_UNAVAILABLE, "match: no update yet");
}
void om_match_estimate_done(OmMatchEstimate* estimate) { (void)estimate; }
