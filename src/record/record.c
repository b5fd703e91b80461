// record.c: a listener that writes the record of a loop: run.vtkhdf, view.html, frames, orbit.png, run.json,
// report.html.
//
// All files are written under a temporary name, which becomes DIR when the loop has ended: a loop that fails leaves
// nothing, and an older DIR stays until the new one is complete. A loop that is aborted or cancelled keeps its record
// so far. The record shows the truth of a simulated world, and the twin where there is no truth.
#include <stdlib.h>
#include <string.h>

#include "base/base_grow.h"
#include "omentum/match_acquisition.h"
#include "omentum/shape_tet10.h"
#include "record/record_internal.h"

#define RECORD_EVERY 5  // ticks between steps of the recording, and of the page

#define RECORD_COOKIE 0x2ec02de

OmRecorderDef om_recorder_default_def(const char* out_dir, const OmScene* scene, OmWorld* world,
                                      OmBody* twin, OmPlanner* planner) {
    return (OmRecorderDef){.cookie = RECORD_COOKIE,
                           .out_dir = out_dir,
                           .scene = scene,
                           .world = world,
                           .twin = twin,
                           .planner = planner,
                           .frame_every = 1,
                           .has_recording = true};
}

// ---- the recorded mesh ------------------------------------------------------------------------------------

// Vertices above the ROI, ascending. @return their number
static int find_above_roi(const OmSite* site, const OmTetMesh* mesh, const unsigned char* is_used,
                          double radius, int* list) {
    int n = 0;
    OmPose task = om_pose_inverse(site->pose_world_task);
    OmVec3 c = om_pose_apply(task, site->roi_center);
    for (int v = 0; v < mesh->nvert; ++v) {
        if (!is_used[v]) continue;
        OmVec3 p = om_pose_apply(task, om_load3(mesh->x, v));
        if (hypot(p.x - c.x, p.y - c.y) <= radius) list[n++] = v;
    }
    return n;
}

// The recorded mesh: that of the tissue with one more set, the vertices above the ROI.
typedef struct MarkedMesh {
    OmTetMesh mesh;   // borrows the arrays of the tissue's mesh, but for `set`
    OmTet10Mesh ten;  // its quadratic elements, with `set`; empty if they are linear
    int ncell;
    OmMeshSet* set;
    int* above;
} MarkedMesh;

static OmStatus mark_mesh(const OmBody* body, double radius, MarkedMesh* marked) {
    const OmTissueModel* tissue = om_body_tissue(body);
    const OmTetMesh* mesh = om_body_mesh(body);
    *marked = (MarkedMesh){.mesh = *mesh, .ncell = mesh->ntet};
    const int nset = mesh->nset;
    OM_ALLOC(marked->above, (size_t)mesh->nvert);
    OM_ALLOC(marked->set, (size_t)nset + 1);
    for (int i = 0; i < nset; ++i) marked->set[i] = mesh->set[i];
    unsigned char* is_used = om_calloc((size_t)mesh->nvert, 1);  // not by an organ that deforms
    if (!is_used) return OM_NO_MEMORY;
    for (int k = 0; k < 4 * mesh->ntet; ++k) is_used[mesh->tet_vert[k]] = 1;
    for (int v = 0; mesh->ntet == 0 && v < mesh->nvert; ++v) is_used[v] = 1;
    const int nabove = find_above_roi(om_body_site(body), mesh, is_used, radius, marked->above);
    om_free(is_used);
    marked->set[nset] = (OmMeshSet){"roi", nabove, marked->above};
    marked->mesh.set = marked->set;
    marked->mesh.nset = nset + 1;
    if (mesh->nvert == om_tissue_corner_count(tissue)) return OM_OK;
    OmTetMesh more = {.nvert = mesh->nvert};
    OM_TRY(om_tissue_make_tet10(tissue, NULL, &marked->ten));
    marked->ten.nelem = om_body_site(body)->mesh.ntet;  // those of an organ that deforms follow
    marked->ncell = marked->ten.nelem;
    more.nset = marked->ten.nset;
    more.set = marked->ten.set;
    OmStatus status = om_tet_mesh_add_set(&more, "roi", marked->above, nabove);
    marked->ten.nset = more.nset;
    marked->ten.set = more.set;
    return status;
}

static void marked_mesh_done(MarkedMesh* marked) {
    om_tet10_mesh_done(&marked->ten);
    om_free(marked->above);
    om_free(marked->set);
}

// ---- the recording ----------------------------------------------------------------------------------------

enum { MAX_SURFACE = 2 + OM_MAX_ARM };

// Surfaces beside the tissue: organ, region of interest, tools. @return their number
static int find_surfaces(const OmRecorder* rec, OmRecordedSurface surface[MAX_SURFACE]) {
    const OmSite* site = om_body_site(rec->shown);
    int n = 0;
    if (site->has_organ) surface[n++] = (OmRecordedSurface){"organ", rec->anatomy->organ};
    if (site->roi.ntri > 0)
        surface[n++] = (OmRecordedSurface){"region of interest", rec->anatomy->roi};
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const OmSurface* s = om_world_tool(rec->def.world, a);
        if (s) surface[n++] = (OmRecordedSurface){om_plan_arm_text(a), s};
    }
    return n;
}

// Positions of all parts, in the order of the recording. (nvert x 3)
static void get_positions(const OmRecorder* rec, double* x) {
    OmRecordedSurface surface[MAX_SURFACE];
    const int n = find_surfaces(rec, surface);
    size_t at = 3 * (size_t)om_tissue_mesh(om_body_tissue(rec->shown))->nvert;
    memcpy(x, om_body_x(rec->shown), at * sizeof *x);
    om_anatomy_move(rec->anatomy, om_body_x(rec->shown));
    for (int k = 0; k < n; ++k) {
        const size_t size = 3 * (size_t)surface[k].surface->nvert;
        memcpy(x + at, surface[k].surface->x, size * sizeof *x);
        at += size;
    }
}

static OmStatus begin_recording(OmRecorder* rec, const MarkedMesh* marked, const char* path) {
    OmRecordedSurface surface[MAX_SURFACE];
    const int nsurface = find_surfaces(rec, surface);
    rec->nvert = marked->mesh.nvert;
    rec->ncell = marked->ncell;
    for (int k = 0; k < nsurface; ++k) {
        rec->nvert += surface[k].surface->nvert;
        rec->ncell += surface[k].surface->ntri;
    }
    const size_t n = 3 * (size_t)rec->nvert;
    rec->x = om_calloc(n, sizeof *rec->x);
    rec->x_begin = om_calloc(n, sizeof *rec->x_begin);
    rec->displacement = om_calloc(n, sizeof *rec->displacement);
    rec->force = om_calloc(n, sizeof *rec->force);  // 0 on midpoints and on surfaces
    rec->von_mises = om_calloc((size_t)rec->ncell, sizeof *rec->von_mises);
    if (!rec->x || !rec->x_begin || !rec->displacement || !rec->force || !rec->von_mises)
        return OM_NO_MEMORY;
    // engines of particles have no stresses
    OmStatus status = om_body_get_measure(rec->shown, OM_VON_MISES, rec->von_mises);
    if (status == OM_UNAVAILABLE) {
        om_free(rec->von_mises);
        rec->von_mises = NULL;
    } else if (status < 0) {
        return status;
    }
    const OmMeshArray array[] = {{"displacement_m", OM_ARRAY_DOUBLE, 3, false, NULL},
                                 {"force_N", OM_ARRAY_DOUBLE, 3, false, NULL},
                                 {"von_mises_Pa", OM_ARRAY_DOUBLE, 1, true, NULL}};
    const OmRecordingArrays arrays = {array, rec->von_mises ? 3 : 2};
    if (marked->ten.nelem > 0)
        return om_recording_begin_tet10(path, &marked->ten, "tissue", surface, nsurface, &arrays,
                                        &rec->recording);
    return om_recording_begin_scene(path, &marked->mesh, "tissue", surface, nsurface, &arrays,
                                    &rec->recording);
}

// ---- creation -----------------------------------------------------------------------------------------------

static OmStatus check_def(const OmRecorderDef* def) {
    OM_CHECK(def->cookie == RECORD_COOKIE, OM_INVALID, "OmRecorderDef was not made by default_def");
    OM_CHECK(def->out_dir, OM_INVALID, "OmRecorderDef.out_dir is null");
    OM_CHECK(def->scene, OM_INVALID, "OmRecorderDef.scene is null");
    OM_CHECK(def->world, OM_INVALID, "OmRecorderDef.world is null");
    OM_CHECK(def->twin, OM_INVALID, "OmRecorderDef.twin is null");
    OM_CHECK(def->planner, OM_INVALID, "OmRecorderDef.planner is null");
    OM_CHECK(def->frame_every >= 0, OM_INVALID, "OmRecorderDef.frame_every is %d",
             def->frame_every);
    OM_CHECK(def->orbit == 0 || (def->orbit >= 2 && def->orbit <= 100), OM_INVALID,
             "OmRecorderDef.orbit is %d: 0, or 2 to 100 pictures", def->orbit);
    return OM_OK;
}

OmStatus om_recorder_create(const OmRecorderDef* def, OmRecorder** recorder) {
    *recorder = NULL;
    OM_TRY(check_def(def));
    OmRecorder* rec = om_calloc(1, sizeof *rec);
    if (!rec) return OM_NO_MEMORY;
    rec->def = *def;
    rec->shown = def->truth ? def->truth : def->twin;
    MarkedMesh marked = {0};
    OmStatus status = om_folder_begin(def->out_dir, OM__RETRACT_KIND, &rec->folder);
    rec->def.out_dir = NULL;  // not needed again
    if (status < 0) goto done;
    OM_TRY_DONE(om_anatomy_create(rec->shown, &rec->anatomy));
    if (def->has_recording) {
        char path[1200];
        OM_TRY_DONE(mark_mesh(rec->shown, def->scene->roi.radius, &marked));
        OM_TRY_DONE(om_path_join(rec->folder.path, "run.vtkhdf", path, sizeof path));
        OM_TRY_DONE(begin_recording(rec, &marked, path));
        OM_TRY_DONE(om__record_view_begin(rec));
    }
    *recorder = rec;
    rec = NULL;
done:
    marked_mesh_done(&marked);
    om_recorder_destroy(rec);
    return status;
}

void om_recorder_destroy(OmRecorder* rec) {
    if (!rec) return;
    om_recording_abort(rec->recording);
    om_anatomy_destroy(rec->anatomy);
    om__record_contact_done(&rec->contact);
    om__record_belief_done(&rec->path);
    om__record_view_done(rec);
    om_folder_end(&rec->folder);
    for (int i = 0; i < rec->nframe; ++i) {
        om_picture_done(&rec->frame[i].picture);
        om_free(rec->frame[i].caption);
    }
    om_free(rec->frame);
    om_text_done(&rec->plans);
    om_picture_done(&rec->before);
    om_picture_done(&rec->after);
    double* array[] = {rec->x, rec->x_begin, rec->displacement, rec->force, rec->von_mises};
    for (size_t i = 0; i < sizeof array / sizeof *array; ++i) om_free(array[i]);
    om_free(rec);
}

const char* om_recorder_place(const OmRecorder* rec) { return rec->folder.place; }

// ---- ticks, plans, pictures ---------------------------------------------------------------------------------

static OmStatus on_tick(void* ctx, const OmLoop* loop, const OmRetractSample* now) {
    OmRecorder* rec = ctx;
    if (rec->path.n == 0) OM_TRY(om__record_belief(rec, 0, om_body_attached(rec->def.twin)));
    OM_TRY(om__record_contact(rec, now));
    if (!rec->recording || (om_loop_ntick(loop) - 1) % RECORD_EVERY) return OM_OK;
    OM_TRY(om__record_view_frame(rec, now));
    const size_t n = 3 * (size_t)rec->nvert;
    get_positions(rec, rec->x);
    if (!rec->has_begun) memcpy(rec->x_begin, rec->x, n * sizeof *rec->x);
    rec->has_begun = true;
    for (size_t i = 0; i < n; ++i) rec->displacement[i] = rec->x[i] - rec->x_begin[i];
    OM_TRY(om_body_get_vertex_forces(rec->shown, rec->force));
    if (rec->von_mises) OM_TRY(om_body_get_measure(rec->shown, OM_VON_MISES, rec->von_mises));
    const void* value[3] = {rec->displacement, rec->force, rec->von_mises};
    return om_recording_add_step(rec->recording, now->time, rec->x, value);
}

static OmStatus on_plan(void* ctx, const OmLoop* loop, const OmSituation* situation,
                        const OmPlan* plan) {
    OmRecorder* rec = ctx;
    OM_TRY(om_text_append(&rec->plans, "Plan %d, at %.1f s\n", ++rec->nplan,
                          om_loop_sample(loop).time));
    OM_TRY(om_plan_print(plan, &rec->plans));
    OM_TRY(om_text_append(&rec->plans, "Why:\n"));
    const OmPreplan* before = om_loop_preplan(loop);
    if (before)
        OM_TRY(
            om_text_append(&rec->plans, "It was made before the operation: %s\n", before->reason));
    else
        OM_TRY(om_planner_explain(rec->def.planner, situation, plan, 3, &rec->plans));
    return om_text_append(&rec->plans, "\n");
}

// The endoscope's view: drawn without noise in a simulated world, else as observed.
static OmStatus take_picture(OmRecorder* rec, OmPicture* picture) {
    const OmSceneCamera* cam = &rec->def.scene->endoscope;
    OmStatus status = om_world_render(rec->def.world, cam->width, cam->height, picture);
    if (status != OM_UNAVAILABLE) return status;
    OmObservation seen = {0};
    OM_TRY(om_world_observe(rec->def.world, OM_OBSERVE_IMAGE, &seen));
    *picture = seen.endoscope.color;
    seen.endoscope.color = (OmPicture){0};
    om_observation_done(&seen);
    return OM_OK;
}

static OmStatus save_picture(const OmRecorder* rec, const OmPicture* picture) {
    char name[64], path[1200];
    OM_TRY(om_path_join(rec->folder.path, "frames", path, sizeof path));
    if (rec->nframe == 0) OM_TRY(om_path_make_dir(path));  // a record has no empty folder
    snprintf(name, sizeof name, "frames/%03d.png", rec->nframe);
    OM_TRY(om_path_join(rec->folder.path, name, path, sizeof path));
    return om_picture_save_png(picture, path);
}

// A world without endoscope pictures has a record without frames.
static OmStatus add_frame(OmRecorder* rec, double time, const char* caption) {
    if (!(om_world_sources(rec->def.world) & OM_OBSERVE_IMAGE)) return OM_OK;
    OM_GROW(rec->frame, rec->nframe, rec->frame_capacity, 16);
    Frame f = {.time = time};
    size_t len = strlen(caption) + 1;
    OM_ALLOC(f.caption, len);
    memcpy(f.caption, caption, len);
    OmStatus status = take_picture(rec, &f.picture);
    if (status == OM_OK) status = save_picture(rec, &f.picture);
    if (status < 0) {
        om_picture_done(&f.picture);
        om_free(f.caption);
        return status;
    }
    rec->frame[rec->nframe++] = f;
    return OM_OK;
}

static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    OmRecorder* rec = ctx;
    const int every = rec->def.frame_every;
    if (!om_match_adoption_is_active(loop->belief.adoption))
        OM_TRY(om__record_belief(rec, action->end, om_body_attached(rec->def.twin)));
    if (every < 1 || om_loop_result(loop)->naction % every) return OM_OK;
    OmText caption = {0};
    const OmPlan* plan = om_loop_plan(loop);
    OmStatus status =
        om_plan_print_action(plan, (int)(om_loop_action(loop) - plan->action), &caption);
    if (status == OM_OK) {
        status = om_text_append(&caption, ": %s; %.0f %% of the ROI seen",
                                om_action_outcome_text(action->outcome), 100 * action->visibility);
    }
    if (status == OM_OK) status = add_frame(rec, action->end, caption.str);
    om_text_done(&caption);
    return status;
}

// ---- updates ------------------------------------------------------------------------------------------------

static OmStatus save_acquisition(OmRecorder* rec, const OmAcquisition* acquisition) {
    char name[64], path[1200];
    OM_TRY(om_path_join(rec->folder.path, "acquisitions", path, sizeof path));
    if (rec->nacquisition == 0) OM_TRY(om_path_make_dir(path));
    snprintf(name, sizeof name, "acquisitions/%03d.yaml", rec->nacquisition++);
    OM_TRY(om_path_join(rec->folder.path, name, path, sizeof path));
    return om_acquisition_save(acquisition, path);
}

static OmStatus draw_twin(const OmRecorder* rec, const unsigned char* attached,
                          OmPicture* picture) {
    om_picture_done(picture);
    *picture = (OmPicture){0};
    return om__draw_attached(om_body_site(rec->def.twin), attached, picture);
}

static OmStatus on_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* event) {
    (void)loop;
    OmRecorder* rec = ctx;
    OM_TRY(om__record_view_update(rec, event));
    if (event->stage == OM_UPDATE_TAKEN && rec->def.records_acquisitions)
        return save_acquisition(rec, event->acquisition);
    if (event->stage != OM_UPDATE_ADOPTED && event->stage != OM_UPDATE_DOUBTED) return OM_OK;
    OM_TRY(om__record_belief(rec, event->time, event->estimate->attached));
    if (!rec->before.pixel) OM_TRY(draw_twin(rec, event->was_attached, &rec->before));
    return draw_twin(rec, event->estimate->attached, &rec->after);
}

// ---- run.json ---------------------------------------------------------------------------------------------

static void write_actions(OmJson* json, const OmRetractResult* r, int n) {
    om_json_open(json, "actions", '[');
    for (int i = 0; i < r->naction; ++i) {
        const OmRetractAction* a = &r->action[i];
        om_json_open(json, NULL, '{');
        om_json_string(json, "action", om_plan_verb_text(a->verb));
        om_json_string(json, "arm", om_plan_arm_text(a->arm));
        if (a->block >= 0) {
            om_json_integer(json, "block_x", a->block % n + 1);
            om_json_integer(json, "block_y", a->block / n + 1);
        }
        om_json_number(json, "begin_s", a->begin);
        om_json_number(json, "end_s", a->end);
        om_json_string(json, "outcome", om_action_outcome_text(a->outcome));
        om_json_number(json, "visibility", a->visibility);
        om_json_number(json, "force_max_n", a->force_max);
        om_json_number(json, "force_world_max_n", a->force_world_max);
        om_json_integer(json, "plan", a->plan + 1);
        if (a->turn > 0) om_json_number(json, "wrist_turn_deg", a->turn * 180 / OM_PI);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

static void write_samples(OmJson* json, const OmRetractResult* r) {
    om_json_open(json, "samples", '[');
    for (int i = 0; i < r->nsample; ++i) {
        const OmRetractSample* s = &r->sample[i];
        om_json_open(json, NULL, '{');
        om_json_number(json, "time_s", s->time);
        om_json_number(json, "visibility", s->visibility);
        om_json_number(json, "visibility_world", s->visibility_world);
        om_json_number(json, "force_n", s->force);
        om_json_number(json, "force_world_n", s->force_world);
        om_json_number(json, "height_m", s->height);
        om_json_number(json, "speed_rate", s->speed_rate);
        if (r->belief.nmonitor > 0) {
            om_json_number(json, "mu_m", s->mu);
            om_json_integer(json, "warning", s->warning);
        }
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

static void write_updates(OmJson* json, const OmRetractResult* r) {
    om_json_integer(json, "acquisitions", r->belief.nacquisition);
    om_json_open(json, "updates", '[');
    for (int i = 0; i < r->belief.nupdate; ++i) {
        const OmRetractUpdate* u = &r->belief.update[i];
        om_json_open(json, NULL, '{');
        om_json_string(json, "outcome", om_update_stage_text(u->stage));
        om_json_string(json, "reason", u->reason);
        om_json_integer(json, "acquisitions", u->nacquisition);
        om_json_number(json, "begin_s", u->start);
        om_json_number(json, "end_s", u->end);
        om_json_integer(json, "begin_tick", u->start_tick);
        om_json_integer(json, "end_tick", u->end_tick);
        om_json_integer(json, "attached_before", u->nattached_before);
        om_json_integer(json, "attached_after", u->nattached_after);
        om_json_number(json, "seen_share", u->seen_share);
        om_json_number(json, "median_before_m", u->before_median);
        om_json_number(json, "median_after_m", u->after_median);
        om_json_number(json, "estimate_ms", u->estimate_ms);
        om_json_number(json, "mu_before_m", u->mu_before);
        om_json_number(json, "mu_after_m", u->mu_after);
        om_json_number(json, "part_before_m", u->part_before);
        om_json_number(json, "part_after_m", u->part_after);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

static void write_monitor(OmJson* json, const OmRetractResult* r) {
    om_json_open(json, "monitor", '{');
    om_json_integer(json, "frames", r->belief.nmonitor);
    om_json_number(json, "mu_max_m", r->belief.mu_max);
    om_json_integer(json, "times_state_1", r->belief.nwarning[0]);
    om_json_integer(json, "times_state_2", r->belief.nwarning[1]);
    om_json_integer(json, "times_state_3", r->belief.nwarning[2]);
    om_json_close(json, '}');
}

static OmStatus write_json(const OmRecorder* rec, const OmRetractResult* r) {
    const OmScene* scene = rec->def.scene;
    char path[1200];
    OM_TRY(om_path_join(rec->folder.path, "run.json", path, sizeof path));
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "scene", scene->name);
    om_json_integer(&json, "seed", scene->seed);
    om_json_bool(&json, "exposed", r->is_exposed);
    om_json_string(&json, "status", om_retract_outcome_text(r->outcome));
    om_json_string(&json, "outcome", r->reason);
    om_json_number(&json, "visibility_start", r->visibility_start);
    om_json_number(&json, "visibility_end", r->visibility_end);
    om_json_number(&json, "visibility_world_end", r->truth.visibility);
    om_json_number(&json, "force_max_n", r->twin.force);
    om_json_number(&json, "force_world_max_n", r->truth.force);
    om_json_number(&json, "force_world_above_twin_max_n", r->truth.more);
    om_json_number(&json, "force_world_below_twin_max_n", r->truth.less);
    om_json_number(&json, "force_threshold_n", scene->task.force_threshold);
    om_json_number(&json, "force_margin_n", scene->task.force_margin);
    om_json_bool(&json, "force_watched", scene->task.watch_force);
    om_json_integer(&json, "times_above_force_limit", r->twin.nforce);
    om_json_number(&json, "force_factor", r->belief.force_factor);
    om_json_integer(&json, "grasps_slipped", r->effort.nslip);
    om_json_integer(&json, "grasps_empty", r->effort.nempty);
    om_json_integer(&json, "reaches_by_cloud", r->effort.nmeasured);
    om_json_number(&json, "cloud_from_twin_max_m", r->effort.measured_off);
    om_json_integer(&json, "grasps_drawn_in_twin", r->effort.ndrawn);
    om_json_integer(&json, "world_vertices_torn", r->truth.ntorn);
    om_json_integer(&json, "times_world_above_force_threshold", r->truth.nforce);
    om_json_number(&json, "time_s", r->time);
    om_json_number(&json, "wall_time_s", r->wall_time);
    om_json_number(&json, "twin_step_ms", r->twin.step_ms);
    om_json_integer(&json, "plans", r->nplan);
    om_json_integer(&json, "points_tried_ahead", r->twin.nahead);
    om_json_integer(&json, "steps_ahead", r->twin.nahead_step);
    om_json_number(&json, "plan_ms_median", r->plan_ms_median);
    om_json_number(&json, "plan_ms_max", r->plan_ms_max);
    om_json_bool(&json, "settled_at_start", r->is_settled);
    om_json_bool(&json, "slid_at_start", r->has_slid);
    om_json_integer(&json, "twin_attached_to_stay", r->twin.nadded);
    om_json_number(&json, "registration_turn_rad", r->twin.turned);
    om_json_number(&json, "registration_shift_m", r->twin.shifted);
    om_json_string(&json, "registration_failed", r->twin.unregistered);
    om_json_number(&json, "twin_shift_at_start_m", r->twin.shift);
    om_json_number(&json, "world_shift_at_start_m", r->truth.shift);
    om_json_integer(&json, "twin_bad_steps", r->twin.nbad);
    om_json_integer(&json, "world_bad_steps", r->truth.nbad);
    om_json_integer(&json, "twin_vertices", r->twin.nvert);
    om_json_integer(&json, "twin_tetrahedra", r->twin.ntet);
    om_json_integer(&json, "world_vertices", r->truth.nvert);
    om_json_integer(&json, "world_tetrahedra", r->truth.ntet);
    char hash[32];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)r->hash);
    om_json_string(&json, "state_hash", hash);
    write_actions(&json, r, scene->task.grid);
    write_samples(&json, r);
    om__record_belief_json(rec, &json);
    if (r->belief.nmonitor > 0) write_monitor(&json, r);
    if (r->belief.nacquisition > 0) write_updates(&json, r);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

// ---- the end ------------------------------------------------------------------------------------------------

static OmStatus on_end(void* ctx, const OmLoop* loop, const OmRetractResult* result) {
    (void)loop;
    OmRecorder* rec = ctx;
    OM_TRY(add_frame(rec, result->time, result->reason));
    OM_TRY(om__record_orbit(rec));
    OmRecording* recording = rec->recording;
    rec->recording = NULL;
    if (recording) {  // its name is that of a temporary folder
        const OmStatus status = om_recording_end(recording);
        if (status < 0) return om_error_prefix(status, "%s", rec->folder.place);
    }
    OM_TRY(write_json(rec, result));
    OM_TRY(om__record_view_end(rec));
    OM_TRY(om__report_write(rec, result));
    bool is_part = result->outcome == OM_RETRACT_CANCELLED || result->outcome == OM_RETRACT_ABORTED;
    return is_part ? om_folder_commit_beside(&rec->folder) : om_folder_commit(&rec->folder);
}

OmLoopListener om_recorder_listener(OmRecorder* recorder) {
    return (OmLoopListener){.ctx = recorder,
                            .on_tick = on_tick,
                            .on_plan = on_plan,
                            .on_action_end = on_action_end,
                            .on_end = on_end,
                            .on_update = on_update};
}
