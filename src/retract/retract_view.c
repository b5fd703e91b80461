// retract_view.c: frames at 25 Hz of the operation, attachments when they change, and each line of an audit.
#include "retract/retract_view.h"

#include <math.h>
#include <string.h>

#include "omentum/image.h"
#include "omentum/record_audit.h"
#include "omentum/view.h"
#include "record/record_internal.h"

#define EVERY 2                                // ticks between frames
#define MARK_TIME (OM_MATCH_ADOPT_TIME + 0.1)  // s

struct RunView {
    OmViewServer* server;
    OmView3d* view;
    OmBody* twin;
    OmWorld* world;
    const OmSceneCamera* camera;
    OmAudit* audit;  // in memory
    size_t nsent;    // bytes of its text
    double due;  // s: when a person's mark of an attachment has reached the twin; INFINITY: none
    OmText message;
};

static OmStatus send(RunView* v, OmViewChannel channel) {
    return om_view_server_publish(v->server, channel, v->message.str, v->message.len);
}

static OmStatus send_points(RunView* v, const OmBody* body, const unsigned char* attached,
                            OmViewPoints kind) {
    v->message.len = 0;
    OM_TRY(om_view3d_add_points(body, attached, kind, &v->message));
    return send(v, OM_VIEW_LASTING);
}

OmStatus om__run_view_create(OmViewServer* server, const OmScene* scene, OmWorld* world,
                             OmBody* twin, OmPlanner* planner, RunView** view) {
    OmBody* truth = om_world_truth(world);
    RunView* v = om_calloc(1, sizeof *v);
    *view = v;
    if (!v) return OM_NO_MEMORY;
    v->server = server;
    v->twin = twin;
    v->world = world;
    v->camera = &scene->endoscope;
    v->due = INFINITY;
    OmView3dDef def = om_view3d_default_def(scene, truth ? truth : twin);
    def.world = world;
    def.is_live = true;
    OM_TRY(om_view3d_create(&def, &v->view));
    const OmAuditDef audit = om_audit_default_def(planner);
    OM_TRY(om_audit_create(&audit, &v->audit));
    om_view_server_clear(server);
    OM_TRY(om_view3d_add_scene(v->view, &v->message));
    OM_TRY(send(v, OM_VIEW_LASTING));
    if (truth) OM_TRY(send_points(v, truth, om_body_attached(truth), OM_VIEW_TRUE));
    return send_points(v, twin, om_body_attached(twin), OM_VIEW_BELIEVED);
}

void om__run_view_destroy(RunView* v) {
    if (!v) return;
    om_view3d_destroy(v->view);
    om_audit_destroy(v->audit);
    om_text_done(&v->message);
    om_free(v);
}

// Lines of the audit that no page has.
static OmStatus send_lines(RunView* v) {
    const char* text = om_audit_text(v->audit);
    for (const char* end; (end = strchr(text + v->nsent, '\n'));
         v->nsent = (size_t)(end - text) + 1)
        OM_TRY(om_view_server_publish(v->server, OM_VIEW_LASTING, text + v->nsent,
                                      (size_t)(end - text) - v->nsent));
    return OM_OK;
}

static OmStatus send_frame(RunView* v, const OmRetractSample* now) {
    const OmViewNow n = om__view_now(now);
    v->message.len = 0;
    OM_TRY(om_view3d_add_frame(v->view, &n, &v->message));
    return send(v, OM_VIEW_NEWEST);
}

static OmStatus on_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    RunView* v = ctx;
    OM_TRY(send_lines(v));
    if (now->time > v->due) {
        v->due = INFINITY;
        OM_TRY(send_points(v, v->twin, om_body_attached(v->twin), OM_VIEW_BELIEVED));
    }
    return om_loop_ntick(loop) % EVERY ? OM_OK : send_frame(v, now);
}

// What the depth camera saw: points on the tissue, and its picture.
static OmStatus send_scan(RunView* v, double time, const OmScan* scan) {
    v->message.len = 0;
    OM_TRY(om_view3d_add_cloud(scan->npoint, scan->x, &v->message));
    OM_TRY(send(v, OM_VIEW_LASTING));
    v->message.len = 0;
    OM_TRY(om_view_add_depth(time, scan, &v->message));
    return v->message.len > 0 ? send(v, OM_VIEW_LASTING) : OM_OK;
}

static OmStatus on_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* event) {
    RunView* v = ctx;
    const OmMatchEstimate* e = event->estimate;
    (void)loop;
    if (event->acquisition) OM_TRY(send_scan(v, event->time, &event->acquisition->scan));
    if (e && e->probability) {
        v->message.len = 0;
        OM_TRY(om_view3d_add_chances(v->view, v->twin, e->probability, &v->message));
        OM_TRY(send(v, OM_VIEW_LASTING));
    }
    if (event->stage != OM_UPDATE_ADOPTED && event->stage != OM_UPDATE_DOUBTED) return OM_OK;
    return send_points(v, v->twin, e->attached, OM_VIEW_BELIEVED);
}

static OmStatus on_command(void* ctx, const OmLoop* loop, const OmLoopCommand* command) {
    RunView* v = ctx;
    if (command->kind == OM_LOOP_ATTACH || command->kind == OM_LOOP_FREE)
        v->due = om_loop_sample(loop).time + MARK_TIME;
    return OM_OK;
}

// What the endoscope of a simulated world sees after an action.
static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    RunView* v = ctx;
    OmPicture picture = {0};
    (void)loop;
    OmStatus status = om_world_render(v->world, v->camera->width, v->camera->height, &picture);
    if (status < 0) return status == OM_UNAVAILABLE ? OM_OK : status;
    v->message.len = 0;
    status = om_view_add_picture(action->end, om_action_outcome_text(action->outcome), &picture,
                                 &v->message);
    om_picture_done(&picture);
    return status < 0 ? status : send(v, OM_VIEW_LASTING);
}

static OmStatus on_end(void* ctx, const OmLoop* loop, const OmRetractResult* result) {
    // the last frame stays: pages that are opened later have it alone
    RunView* v = ctx;
    const OmRetractSample now = om_loop_sample(loop);
    (void)result;
    om_view3d_want_stress(v->view);
    OM_TRY(send_frame(v, &now));
    return send_lines(v);
}

int om__run_view_listeners(RunView* v, OmLoopListener listener[2]) {
    listener[0] = om_audit_listener(v->audit);
    listener[1] = (OmLoopListener){.ctx = v,
                                   .on_tick = on_tick,
                                   .on_update = on_update,
                                   .on_command = on_command,
                                   .on_action_end = on_action_end,
                                   .on_end = on_end};
    return 2;
}
