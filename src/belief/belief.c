// belief.c: the robot's belief as an object: its begin, its end, and what it tells the loop.
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "belief/belief_state.h"

OmStatus om__belief_begin(Belief* b, const OmExposure* exposure) {
    b->record->force_factor = 1;
    b->attempt_distance = om__grid_length(b->grid, ATTEMPT_DISTANCE);
    b->is_corrected = b->updater != NULL;
    b->clock_last = -HUGE_VAL;
    if (exposure) memcpy(b->exposure, exposure, sizeof b->exposure);
    OM_TRY(om_match_adoption_create(om_body_site(b->twin)->mesh.nvert, &b->adoption));
    OM_TRY(om__doubt_create(b));
    if (!b->monitor) return OM_OK;
    om_monitor_reset(b->monitor);
    b->monitor_settings = *om_monitor_settings(b->monitor);
    return OM_OK;
}

void om__belief_done(Belief* b) {
    om_match_adoption_destroy(b->adoption);
    om_free(b->probability);
    om_free(b->source);
}

void om__belief_forget_exposure(Belief* b) {
    for (int k = 0; k < b->grid->n * b->grid->n; ++k) b->exposure[k].is_known = false;
}

OmStatus om__belief_tell(const Belief* b, const OmUpdateEvent* event) {
    return b->host.on_update ? b->host.on_update(b->host.ctx, event) : OM_OK;
}

void om__belief_alarm(const Belief* b, OmHold hold, const char* format, ...) {
    char text[200];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    if (b->host.on_alarm) b->host.on_alarm(b->host.ctx, hold, text);
}
