// defras_record.c: what a run leaves behind: run.vtkhdf, frames, run.json, report.html.
//
// Everything is written under a temporary name, which becomes DIR when the run is complete: a run that fails leaves
// nothing, and an older DIR stays until the new one is whole. A run that is cancelled keeps its record so far.
#include <stdlib.h>
#include <string.h>

#include "defras/defras_record.h"
#include "omentum/shape_file.h"

#define RECORD_EVERY 5  // ticks between steps of the recording

// ---- the operating site's ROI as a set of the recorded mesh -------------------------------------------------

static OmStatus add_roi_set(OmSite* site, double radius) {
    int *list, n = 0;
    OM_ALLOC(list, (size_t)site->mesh.nvert);
    OmPose task = om_pose_inverse(site->pose_world_task);
    OmVec3 c = om_pose_apply(task, site->roi_center);
    for (int v = 0; v < site->mesh.nvert; ++v) {
        OmVec3 p = om_pose_apply(task, om_load3(site->mesh.x, v));
        if (hypot(p.x - c.x, p.y - c.y) <= radius) list[n++] = v;
    }
    OmStatus status = om_tet_mesh_add_set(&site->mesh, "roi", list, n);
    om_free(list);
    return status;
}

// ---- the recorder -----------------------------------------------------------------------------------------

static OmStatus open_folder(Recorder* rec, const char* out_dir) {
    char frames[1200];
    OM_TRY(om_folder_begin(out_dir, OM__RETRACT_KIND, &rec->folder));
    OM_TRY(om_path_join(rec->folder.path, "frames", frames, sizeof frames));
    return om_path_make_dir(frames);
}

// ---- the recording ----------------------------------------------------------------------------------------

enum { MAX_SURFACE = 2 + OM_MAX_ARM };

// What is seen beside the tissue: organ, region of interest, tools. @return their number
static int find_surfaces(const Loop* loop, OmRecordedSurface surface[MAX_SURFACE]) {
    static const char* const tool[OM_MAX_ARM] = {"psm1", "psm2"};
    const OmSite* site = &loop->world_site;
    int n = 0;
    if (site->has_organ) surface[n++] = (OmRecordedSurface){"organ", &site->organ};
    if (site->roi.ntri > 0) surface[n++] = (OmRecordedSurface){"region of interest", &site->roi};
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        const OmSurface* s = om_world_tool(loop->world, a);
        if (s) surface[n++] = (OmRecordedSurface){tool[a], s};
    }
    return n;
}

// Of all parts, in the order of the recording. (nvert x 3)
static void get_positions(const Loop* loop, double* x) {
    OmRecordedSurface surface[MAX_SURFACE];
    const int n = find_surfaces(loop, surface);
    size_t at = 3 * (size_t)loop->world_site.mesh.nvert;
    memcpy(x, om_body_x(om_world_truth(loop->world)), at * sizeof *x);
    for (int k = 0; k < n; ++k) {
        const size_t size = 3 * (size_t)surface[k].surface->nvert;
        memcpy(x + at, surface[k].surface->x, size * sizeof *x);
        at += size;
    }
}

static OmStatus begin_recording(Recorder* rec, Loop* loop, const char* path) {
    OmBody* truth = om_world_truth(loop->world);
    OmRecordedSurface surface[MAX_SURFACE];
    const int nsurface = find_surfaces(loop, surface);
    rec->nvert = loop->world_site.mesh.nvert;
    rec->ncell = loop->world_site.mesh.ntet;
    for (int k = 0; k < nsurface; ++k) {
        rec->nvert += surface[k].surface->nvert;
        rec->ncell += surface[k].surface->ntri;
    }
    const size_t n = 3 * (size_t)rec->nvert;
    rec->x = om_calloc(n, sizeof *rec->x);
    rec->x_begin = om_calloc(n, sizeof *rec->x_begin);
    rec->displacement = om_calloc(n, sizeof *rec->displacement);
    rec->force = om_calloc(n, sizeof *rec->force);  // 0 on surfaces, as is the stress
    rec->von_mises = om_calloc((size_t)rec->ncell, sizeof *rec->von_mises);
    if (!rec->x || !rec->x_begin || !rec->displacement || !rec->force || !rec->von_mises)
        return OM_NO_MEMORY;
    // engines of particles have no stresses
    OmStatus status = om_body_get_measure(truth, OM_VON_MISES, rec->von_mises);
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
    return om_recording_begin_scene(path, &loop->world_site.mesh, "tissue", surface, nsurface,
                                    &arrays, &rec->recording);
}

OmStatus om__recorder_create(Loop* loop, Recorder** recorder) {
    *recorder = NULL;
    Recorder* rec = om_calloc(1, sizeof *rec);
    if (!rec) return OM_NO_MEMORY;
    OmStatus status = open_folder(rec, loop->def->out_dir);
    if (status < 0) goto done;
    OM_TRY_DONE(add_roi_set(&loop->world_site, loop->scene->roi.radius));
    char path[1200];
    OM_TRY_DONE(om_path_join(rec->folder.path, "run.vtkhdf", path, sizeof path));
    OM_TRY_DONE(begin_recording(rec, loop, path));
    *recorder = rec;
    rec = NULL;
done:
    om__recorder_destroy(rec);
    return status;
}

void om__recorder_destroy(Recorder* rec) {
    if (!rec) return;
    om_recording_abort(rec->recording);
    om_folder_end(&rec->folder);
    for (int i = 0; i < rec->nframe; ++i) {
        om_picture_done(&rec->frame[i].picture);
        om_free(rec->frame[i].caption);
    }
    om_free(rec->frame);
    om_text_done(&rec->plans);
    double* array[] = {rec->x, rec->x_begin, rec->displacement, rec->force, rec->von_mises};
    for (size_t i = 0; i < sizeof array / sizeof *array; ++i) om_free(array[i]);
    om_free(rec);
}

OmStatus om__recorder_tick(Recorder* rec, Loop* loop) {
    if (loop->tick % RECORD_EVERY) return OM_OK;
    OmBody* truth = om_world_truth(loop->world);
    const size_t n = 3 * (size_t)rec->nvert;
    get_positions(loop, rec->x);
    if (!rec->has_begun) memcpy(rec->x_begin, rec->x, n * sizeof *rec->x);
    rec->has_begun = true;
    for (size_t i = 0; i < n; ++i) rec->displacement[i] = rec->x[i] - rec->x_begin[i];
    OM_TRY(om_body_get_vertex_forces(truth, rec->force));
    if (rec->von_mises) OM_TRY(om_body_get_measure(truth, OM_VON_MISES, rec->von_mises));
    const void* value[3] = {rec->displacement, rec->force, rec->von_mises};
    return om_recording_add_step(rec->recording, loop->time, rec->x, value);
}

OmStatus om__recorder_frame(Recorder* rec, Loop* loop, const char* caption) {
    if (rec->nframe == rec->frame_capacity) {
        int capacity = rec->frame_capacity ? 2 * rec->frame_capacity : 16;
        Frame* grown = om_realloc(rec->frame, (size_t)rec->nframe, (size_t)capacity, sizeof *grown);
        if (!grown) return OM_NO_MEMORY;
        rec->frame = grown;
        rec->frame_capacity = capacity;
    }
    Frame f = {.time = loop->time};
    size_t len = strlen(caption) + 1;
    OM_ALLOC(f.caption, len);
    memcpy(f.caption, caption, len);
    const OmSceneCamera* cam = &loop->scene->endoscope;
    OmStatus status = om_world_render(loop->world, cam->width, cam->height, &f.picture);
    char name[64], path[1200];
    snprintf(name, sizeof name, "frames/%03d.png", rec->nframe);
    if (status == OM_OK) status = om_path_join(rec->folder.path, name, path, sizeof path);
    if (status == OM_OK) status = om_picture_save_png(&f.picture, path);
    if (status < 0) {
        om_picture_done(&f.picture);
        om_free(f.caption);
        return status;
    }
    rec->frame[rec->nframe++] = f;
    return OM_OK;
}

OmStatus om__recorder_plan(Recorder* rec, Loop* loop) {
    OM_TRY(om_text_append(&rec->plans, "Plan %d, at %.1f s\n", loop->result->nplan, loop->time));
    OM_TRY(om_plan_print(&loop->plan, &rec->plans));
    OM_TRY(om_text_append(&rec->plans, "Why:\n"));
    OM_TRY(om_planner_explain(loop->planner, &loop->situation, &loop->plan, 3, &rec->plans));
    return om_text_append(&rec->plans, "\n");
}

// ---- run.json ---------------------------------------------------------------------------------------------

static void write_actions(OmJson* json, const OmRetractResult* r, int n) {
    static const char* const verb[] = {
#define VERB_TEXT(name, text) text,
        OM_PLAN_VERB_TABLE(VERB_TEXT)
#undef VERB_TEXT
    };
    om_json_open(json, "actions", '[');
    for (int i = 0; i < r->naction; ++i) {
        const OmRetractAction* a = &r->action[i];
        om_json_open(json, NULL, '{');
        om_json_string(json, "action", verb[a->verb]);
        om_json_string(json, "arm", a->arm ? "psm2" : "psm1");
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
        om_json_number(json, "force_n", s->force);
        om_json_number(json, "force_world_n", s->force_world);
        om_json_number(json, "height_m", s->height);
        om_json_number(json, "speed_rate", s->speed_rate);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

static OmStatus write_json(const Recorder* rec, const Loop* loop) {
    const OmRetractResult* r = loop->result;
    char path[1200];
    OM_TRY(om_path_join(rec->folder.path, "run.json", path, sizeof path));
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "scene", loop->scene->name);
    om_json_integer(&json, "seed", loop->scene->seed);
    om_json_bool(&json, "exposed", r->is_exposed);
    om_json_string(&json, "status", om_retract_outcome_text(r->outcome));
    om_json_string(&json, "outcome", r->reason);
    om_json_number(&json, "visibility_start", r->visibility_start);
    om_json_number(&json, "visibility_end", r->visibility_end);
    om_json_number(&json, "force_max_n", r->force_max);
    om_json_number(&json, "force_world_max_n", r->force_world_max);
    om_json_number(&json, "force_world_above_twin_max_n", r->force_more);
    om_json_number(&json, "force_world_below_twin_max_n", r->force_less);
    om_json_number(&json, "force_threshold_n", loop->scene->task.force_threshold);
    om_json_number(&json, "force_margin_n", loop->scene->task.force_margin);
    om_json_integer(&json, "times_above_force_limit", r->nforce);
    om_json_integer(&json, "times_world_above_force_threshold", r->nforce_world);
    om_json_number(&json, "time_s", r->time);
    om_json_number(&json, "wall_time_s", r->wall_time);
    om_json_number(&json, "twin_step_ms", r->twin_step_ms);
    om_json_integer(&json, "plans", r->nplan);
    om_json_number(&json, "plan_ms_median", r->plan_ms_median);
    om_json_number(&json, "plan_ms_max", r->plan_ms_max);
    om_json_bool(&json, "settled_at_start", r->is_settled);
    om_json_bool(&json, "slid_at_start", r->has_slid);
    om_json_number(&json, "twin_shift_at_start_m", r->twin_shift);
    om_json_number(&json, "world_shift_at_start_m", r->world_shift);
    om_json_integer(&json, "twin_bad_steps", r->twin_nbad);
    om_json_integer(&json, "world_bad_steps", r->world_nbad);
    om_json_integer(&json, "twin_vertices", r->twin_nvert);
    om_json_integer(&json, "twin_tetrahedra", r->twin_ntet);
    om_json_integer(&json, "world_vertices", r->world_nvert);
    om_json_integer(&json, "world_tetrahedra", r->world_ntet);
    char hash[32];
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)r->hash);
    om_json_string(&json, "state_hash", hash);
    write_actions(&json, r, loop->grid.n);
    write_samples(&json, r);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

// ---- the end ------------------------------------------------------------------------------------------------

OmStatus om__recorder_commit(Recorder* rec, Loop* loop, bool is_partial) {
    OM_TRY(om__recorder_frame(rec, loop, loop->result->reason));
    OmRecording* recording = rec->recording;
    rec->recording = NULL;
    OM_TRY(om_recording_end(recording));
    OM_TRY(write_json(rec, loop));
    OM_TRY(om__report_write(rec, loop));
    return is_partial ? om_folder_commit_beside(&rec->folder) : om_folder_commit(&rec->folder);
}

const char* om__recorder_place(const Recorder* rec) { return rec->folder.place; }
