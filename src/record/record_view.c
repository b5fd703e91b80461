// record_view.c: view.html of a run: the recording as a page that a browser plays, with the decisions beside it.
//
// Ten frames a second of the operation. Where a run is so long that its frames take more than MANY bytes, every second
// one is left out from there on, and so on: a page stays small enough for a browser.
#include "omentum/record_audit.h"
#include "record/record_internal.h"

#define MANY 24000000  // bytes of frames

OmStatus om__record_view_begin(OmRecorder* rec) {
    OmView3dDef def = om_view3d_default_def(rec->def.scene, rec->shown);
    def.world = rec->def.world;
    OM_TRY(om_view3d_create(&def, &rec->view));
    rec->view_every = 1;
    OM_TRY(om_view3d_add_scene(rec->view, &rec->page.messages));
    if (rec->def.truth)
        OM_TRY(om_view3d_add_points(rec->shown, om_body_attached(rec->shown), OM_VIEW_TRUE,
                                    &rec->page.messages));
    return om_view3d_add_points(rec->def.twin, om_body_attached(rec->def.twin), OM_VIEW_BELIEVED,
                                &rec->page.messages);
}

OmStatus om__record_view_frame(OmRecorder* rec, const OmRetractSample* now) {
    const OmViewNow n = om__view_now(now);
    if (!rec->view || rec->nview++ % rec->view_every) return OM_OK;
    while (rec->page.messages.len > (size_t)rec->view_every * MANY) rec->view_every *= 2;
    return om_view3d_add_frame(rec->view, &n, &rec->page.messages);
}

OmStatus om__record_view_belief(OmRecorder* rec, const unsigned char* attached) {
    if (!rec->view) return OM_OK;
    return om_view3d_add_points(rec->def.twin, attached, OM_VIEW_BELIEVED, &rec->page.messages);
}

// What the depth camera saw, and how likely each vertex is attached by the estimate from it.
OmStatus om__record_view_update(OmRecorder* rec, const OmUpdateEvent* event) {
    const OmMatchEstimate* e = event->estimate;
    if (!rec->view) return OM_OK;
    if (event->acquisition) {
        const OmScan* scan = &event->acquisition->scan;
        OM_TRY(om_view3d_add_cloud(scan->npoint, scan->x, &rec->page.messages));
        OM_TRY(om_view_page_add_depth(&rec->page, event->time, scan));
    }
    if (!e || !e->probability) return OM_OK;
    return om_view3d_add_chances(rec->view, rec->def.twin, e->probability, &rec->page.messages);
}

OmStatus om__record_view_end(OmRecorder* rec) {
    char path[1200];
    if (!rec->view) return OM_OK;
    for (int i = 0; i < rec->nframe; ++i)
        OM_TRY(om_view_page_add_picture(&rec->page, rec->frame[i].time, rec->frame[i].caption,
                                        &rec->frame[i].picture));
    rec->page.title = rec->def.scene->name;
    rec->page.story = rec->audit ? om_audit_text(rec->audit) : NULL;
    rec->page.back = "report.html";
    OM_TRY(om_path_join(rec->folder.path, "view.html", path, sizeof path));
    return om_view_page_save(&rec->page, path);
}

void om__record_view_done(OmRecorder* rec) {
    om_view3d_destroy(rec->view);
    om_view_page_done(&rec->page);
}
