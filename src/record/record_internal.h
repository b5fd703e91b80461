// record_internal.h: the recorder of a loop, shared with its report.
#ifndef OMENTUM_RECORD_INTERNAL_H
#define OMENTUM_RECORD_INTERNAL_H

#include "loop/loop_state.h"
#include "omentum/image.h"
#include "omentum/record.h"
#include "omentum/report.h"
#include "omentum/shape_tet10.h"
#include "omentum/view.h"

typedef struct Frame {
    OmPicture picture;
    char* caption;
    double time;  // s
} Frame;

typedef struct ContactRecord {  // when the pull in the truth was largest
    double pull, time;          // N, s
    double *x, *force;  // m, N: of the contact on the tissue; null: no pull yet     (nvert x 3)
} ContactRecord;

#define OM__RETRACT_KIND "retraction run"  // of the recorder's folder

typedef struct BeliefPoint {
    double time;   // s
    double share;  // of the vertices of the twin's underside that it holds
    double dice;   // to the truth; NAN: not known
} BeliefPoint;

typedef struct BeliefPath {
    int n, capacity;
    BeliefPoint* point;
    unsigned char* is_true;  // of the twin's underside; null: there is no truth
    double true_share;
} BeliefPath;

struct OmRecorder {
    OmRecorderDef def;
    OmBody* shown;       // the truth, or the twin without one
    OmAnatomy* anatomy;  // of `shown`
    OmFolder folder;     // written under a temporary name until the loop has ended
    OmRecording* recording;
    // of all parts: the tissue, organ, region of interest, tools
    int nvert, ncell;
    bool has_begun;                              // x_begin is of the first step
    double *x, *x_begin, *displacement, *force;  // m, m, m, N                      (nvert x 3)
    double* von_mises;                           // Pa; null: the engine has none     (ncell)
    Frame* frame;
    int nframe, frame_capacity;
    int nacquisition;         // written
    OmPicture before, after;  // attachments of the twin, at the begin and after the last adoption
    ContactRecord contact;
    BeliefPath path;
    OmView3d* view;  // null: no page is written
    OmViewPage page;
    int nview, view_every;  // frames so far, of which one in view_every is kept
    int nplan;
    OmText plans;                 // every plan and its reasons, as text
    const struct OmAudit* audit;  // its sentences go into the report; null: none
};

/// The tissue of a body from below, attached vertices marked. @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE
OmStatus om__draw_attached(const OmSite* site, const unsigned char* attached, OmPicture* picture);
/// What was updated: a table, and pictures of the attachments. Nothing without updates.
OmStatus om__report_add_updates(OmReport* report, const OmRecorder* rec,
                                const OmRetractResult* result);
OmStatus om__report_add_monitor(OmReport* report, const OmRecorder* rec,
                                const OmRetractResult* result);
/// Add the twin's attachments (nvert) to the path of the belief, where they changed.
OmStatus om__record_belief(OmRecorder* rec, double time, const unsigned char* attached);
void om__record_belief_done(BeliefPath* path);
void om__record_belief_json(const OmRecorder* rec, OmJson* json);
/// Its chart; nothing where nothing was learnt.
OmStatus om__report_add_belief(OmReport* report, const OmRecorder* rec,
                               const OmRetractResult* result);
/// The numbers of a frame.
static inline OmViewNow om__view_now(const OmRetractSample* s) {
    return (OmViewNow){s->time, s->visibility, s->force,  s->force_world,
                       s->mu,   s->height,     s->warning};
}
/// The page that plays the run: its scene, a frame of ten in a second, a change of the twin's attachments (nvert), an
/// acquisition or an estimate, the file. Without om__record_view_begin the others do nothing.
OmStatus om__record_view_begin(OmRecorder* rec);
OmStatus om__record_view_frame(OmRecorder* rec, const OmRetractSample* now);
OmStatus om__record_view_belief(OmRecorder* rec, const unsigned char* attached);
OmStatus om__record_view_update(OmRecorder* rec, const OmUpdateEvent* event);
OmStatus om__record_view_end(OmRecorder* rec);
void om__record_view_done(OmRecorder* rec);
/// orbit.png: the world at this moment, from a camera that goes round the endoscope. Nothing without
/// OmRecorderDef.orbit, and in a world that is not simulated.
OmStatus om__record_orbit(const OmRecorder* rec);
/// Keep contact of the truth's tissue with an organ if the pull is the largest so far.
OmStatus om__record_contact(OmRecorder* rec, const OmRetractSample* now);
void om__record_contact_done(ContactRecord* contact);
/// A picture of the pressure on the organ; nothing without an organ or a pull.
OmStatus om__report_add_contact(OmReport* report, const OmRecorder* rec);
OmStatus om__report_write(const OmRecorder* rec, const OmRetractResult* result);

#endif
