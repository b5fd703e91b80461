// record_audit.c: a listener that writes audit.jsonl, one line of JSON a decision.
//
// The hash of the twin stands beside each plan and each ended action: two runs with the same lines had the same twin
// to the last bit, not only the same rounded numbers.
#include "omentum/record_audit.h"

#include <errno.h>
#include <string.h>

#include "belief/belief_updater.h"
#include "loop/loop_state.h"
#include "omentum/record_words.h"

#define AUDIT_COOKIE 0x0a0d17e
#define NOTHER 3  // grasping points whose reasons are written

struct OmAudit {
    OmAuditDef def;
    char path[1200];
    uint64_t scene_hash, program_hash;
    FILE* file;     // null: not begun, or without a file
    OmText lines;   // all of them
    OmText json;    // the line that is being written, over several lines
    OmText words;   // a sentence, or reasons
    OmText story;   // all sentences, with their times
    double factor;  // on the twin's forces, of the last line of an action
};

OmAuditDef om_audit_default_def(OmPlanner* planner) {
    return (OmAuditDef){.cookie = AUDIT_COOKIE,
                        .planner = planner,
                        .scene_text = "",
                        .program = om_planner_program()};
}

OmStatus om_audit_create(const OmAuditDef* def, OmAudit** audit) {
    *audit = NULL;
    OM_CHECK(def->cookie == AUDIT_COOKIE, OM_INVALID, "OmAuditDef was not made by default_def");
    OM_CHECK(def->scene_text && def->program, OM_INVALID, "OmAuditDef has a text that is null");
    OM_CHECK(!def->path || strlen(def->path) < sizeof(*audit)->path, OM_INVALID,
             "OmAuditDef.path is too long");
    OmAudit* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    a->def = *def;
    if (def->path) snprintf(a->path, sizeof a->path, "%s", def->path);
    a->scene_hash = om_hash(def->scene_text, strlen(def->scene_text), OM_HASH_SEED);
    a->program_hash = om_hash(def->program, strlen(def->program), OM_HASH_SEED);
    a->def.scene_text = a->def.program = a->def.path = NULL;
    *audit = a;
    return OM_OK;
}

void om_audit_destroy(OmAudit* a) {
    if (!a) return;
    if (a->file) fclose(a->file);
    om_text_done(&a->lines);
    om_text_done(&a->json);
    om_text_done(&a->words);
    om_text_done(&a->story);
    om_free(a);
}

const char* om_audit_text(const OmAudit* a) { return a->lines.str ? a->lines.str : ""; }

const char* om_audit_story(const OmAudit* a) { return a->story.str ? a->story.str : ""; }

// ---- lines ---------------------------------------------------------------------------------------------------

static void put_hash(OmJson* json, const char* key, uint64_t hash) {
    char text[32];
    snprintf(text, sizeof text, "%016llx", (unsigned long long)hash);
    om_json_string(json, key, text);
}

static OmJson begin_line(OmAudit* a, const OmLoop* loop, const char* event) {
    a->json.len = a->words.len = 0;
    if (a->words.str) a->words.str[0] = '\0';
    OmJson json = om_json_begin(&a->json);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "event", event);
    om_json_integer(&json, "tick", loop->act.tick);
    om_json_number(&json, "time_s", loop->act.time);
    return json;
}

// Close the object: its line breaks and indentation go. Strings have none, they are escaped.
static OmStatus end_line(OmAudit* a, OmJson* json) {
    om_json_close(json, '}');
    OM_TRY(om_json_end(json));
    const size_t start = a->lines.len;
    for (size_t i = 0; i < a->json.len;) {
        size_t n = strcspn(a->json.str + i, "\n");
        OM_TRY(om_text_append_raw(&a->lines, a->json.str + i, n));
        i += n + (i + n < a->json.len);
        i += strspn(a->json.str + i, " ");
    }
    OM_TRY(om_text_append_raw(&a->lines, "\n", 1));
    if (!a->path[0]) return OM_OK;
    const size_t size = a->lines.len - start;
    errno = 0;
    bool is_good =
        a->file && fwrite(a->lines.str + start, 1, size, a->file) == size && fflush(a->file) == 0;
    OM_CHECK(is_good, OM_IO, "%s cannot be written: %s", a->path, strerror(errno));
    return OM_OK;
}

// The sentence in `words` ends the line.
static OmStatus end_words(OmAudit* a, OmJson* json) {
    om_json_string(json, "words", a->words.str);
    return end_line(a, json);
}

// The same; the sentence is part of the story, too.
static OmStatus end_told(OmAudit* a, const OmLoop* loop, OmJson* json) {
    OM_TRY(om_text_append(&a->story, "%6.1f s  %s\n", loop->act.time, a->words.str));
    return end_words(a, json);
}

static void put_block(OmJson* json, const char* key, int block, int n) {
    if (block < 0) return;
    om_json_numbers(json, key, (double[2]){block % n + 1, block / n + 1}, 2);
}

static void put_action(OmJson* json, OmPlanVerb verb, int arm, int block, int n) {
    om_json_string(json, "action", om_plan_verb_text(verb));
    om_json_string(json, "arm", om_plan_arm_text(arm));
    put_block(json, "block", block, n);
}

// ---- the head ------------------------------------------------------------------------------------------------

static uint64_t hash_mesh(const OmTetMesh* mesh) {
    uint64_t h = om_hash(mesh->x, 3 * (size_t)mesh->nvert * sizeof *mesh->x, OM_HASH_SEED);
    return om_hash(mesh->tet_vert, 4 * (size_t)mesh->ntet * sizeof *mesh->tet_vert, h);
}

static const char* timing_name(const OmUpdater* u) {
    if (!u || !u->def.estimate) return "none";
    return u->def.timing == OM_UPDATE_AFTER_LATENCY ? "latency" : "ready";
}

static OmStatus on_begin(void* ctx, const OmLoop* loop) {
    OmAudit* a = ctx;
    if (a->path[0]) {
        OM_CHECK(!om_path_exists(a->path), OM_IO, "%s exists already", a->path);
        a->file = fopen(a->path, "wb");
        OM_CHECK(a->file, OM_IO, "%s cannot be written: %s", a->path, strerror(errno));
    }
    a->factor = 1;
    OmJson json = begin_line(a, loop, "head");
    om_json_integer(&json, "format", 1);
    om_json_string(&json, "omentum", om_version());
    put_hash(&json, "scene", a->scene_hash);
    put_hash(&json, "program", a->program_hash);
    if (a->def.network_hash)
        put_hash(&json, "network", a->def.network_hash);
    else
        om_json_string(&json, "network", "none");
    om_json_string(&json, "engine", om_body_engine(loop->twin)->name);
    put_hash(&json, "twin_mesh", hash_mesh(&om_body_site(loop->twin)->mesh));
    put_hash(&json, "twin", om_body_hash(loop->twin));
    om_json_integer(&json, "grid", loop->grid.n);
    om_json_number(&json, "time_step_s", loop->task.time_step);
    om_json_string(&json, "updates", timing_name(loop->belief.updater));
    om_json_bool(&json, "settled", loop->result.is_settled);
    om_json_integer(&json, "attached_to_stay", loop->result.twin.nadded);
    om_json_bool(&json, "attended", loop->is_attended);
    om_json_bool(&json, "approval", loop->needs_approval);
    om_json_bool(&json, "both_arms", om_planner_has_both_arms(loop->planner));
    om_json_number(&json, "max_age_s", loop->belief.max_age);
    om_json_bool(&json, "plan_before", loop->preplan != NULL);
    om_json_bool(&json, "monitor", loop->belief.monitor != NULL);
    return end_line(a, &json);
}

// ---- plans ---------------------------------------------------------------------------------------------------

static void put_blocks(OmJson* json, const char* fact, const OmSituation* s,
                       bool (*holds)(const void* ctx, int block), const void* ctx) {
    bool is_open = false;
    for (int b = 0; b < s->n * s->n; ++b) {
        if (!holds(ctx, b)) continue;
        if (!is_open) om_json_open(json, fact, '[');
        is_open = true;
        put_block(json, NULL, b, s->n);
    }
    if (is_open) om_json_close(json, ']');
}

static bool is_fixed(const void* ctx, int b) { return ((const OmSituation*)ctx)->is_fixed[b]; }
static bool is_above(const void* ctx, int b) { return ((const OmSituation*)ctx)->is_above_roi[b]; }
static bool is_near1(const void* ctx, int b) { return ((const OmSituation*)ctx)->reachable[b] & 1; }
static bool is_near2(const void* ctx, int b) { return ((const OmSituation*)ctx)->reachable[b] & 2; }
static bool is_done(const void* ctx, int b) {
    return ((const OmSituation*)ctx)->tried[b] & OM_TRIED_GRASP;
}
static bool is_folded(const void* ctx, int b) {
    return ((const OmSituation*)ctx)->tried[b] & OM_TRIED_MOVE_ROI;
}
static bool is_moved(const void* ctx, int b) {
    return ((const OmSituation*)ctx)->tried[b] & OM_TRIED_MOVE_AWAY;
}
static bool exposes(const void* ctx, int b) {
    const OmExposure* e = &((const OmSituation*)ctx)->exposure[b];
    return e->is_known && e->exposes;
}
static bool hides(const void* ctx, int b) {
    const OmExposure* e = &((const OmSituation*)ctx)->exposure[b];
    return e->is_known && !e->exposes;
}
static bool is_forbidden(const void* ctx, int b) {
    return ((const OmSituation*)ctx)->is_forbidden[b];
}

static bool is_elsewhere(const void* ctx, int b) {
    return ((const OmLoop*)ctx)->act.point[b].source == GRASP_MEASURED;
}
static bool is_bare(const void* ctx, int b) {
    const OmLoop* loop = ctx;
    return loop->grid.vert[b] >= 0 && loop->act.point[b].source == GRASP_NONE;
}
static bool is_filled(const void* ctx, int b) {
    return ((const OmLoop*)ctx)->act.point[b].source == GRASP_FILLED;
}
static bool is_empty(const void* ctx, int b) { return ((const OmLoop*)ctx)->act.nempty[b] > 0; }

static void put_arm(OmJson* json, const char* name, const OmArmSituation* arm, int n) {
    om_json_open(json, name, '{');
    put_block(json, "at", arm->at, n);
    put_block(json, "in_hand", arm->in_hand, n);
    om_json_bool(json, "closed_gripper", arm->is_closed);
    om_json_bool(json, "max_height", arm->is_max_height);
    om_json_integer(json, "pulls", arm->nlift);
    om_json_close(json, '}');
}

// The fluents of the situation, under the source that each of them comes from.
static void put_facts(OmJson* json, const OmLoop* loop, const OmSituation* s) {
    om_json_open(json, "facts", '{');
    om_json_open(json, "camera", '{');
    om_json_bool(json, "visible_roi", s->is_visible);
    om_json_number(json, "visibility", loop->act.visibility);
    put_blocks(json, "tissue_elsewhere", s, is_elsewhere, loop);
    put_blocks(json, "no_tissue", s, is_bare, loop);
    om_json_close(json, '}');
    om_json_open(json, "joints", '{');
    put_arm(json, "psm1", &s->arm[0], s->n);
    if (loop->act.narm > 1) put_arm(json, "psm2", &s->arm[1], s->n);
    om_json_close(json, '}');
    om_json_open(json, "twin", '{');
    put_blocks(json, "fixed", s, is_fixed, s);
    put_blocks(json, "grasping_points", s, is_filled, loop);
    om_json_bool(json, "max_force_psm1", s->arm[0].is_max_force);
    om_json_bool(json, "max_force_psm2", s->arm[1].is_max_force);
    om_json_close(json, '}');
    om_json_open(json, "patient", '{');
    put_blocks(json, "above_roi", s, is_above, s);
    put_blocks(json, "reachable_psm1", s, is_near1, s);
    put_blocks(json, "reachable_psm2", s, is_near2, s);
    om_json_close(json, '}');
    om_json_open(json, "trials", '{');
    put_blocks(json, "exposes", s, exposes, s);
    put_blocks(json, "exposes_not", s, hides, s);
    om_json_close(json, '}');
    om_json_open(json, "memory", '{');
    put_blocks(json, "tried", s, is_done, s);
    put_blocks(json, "closed_on_nothing", s, is_empty, loop);
    put_blocks(json, "folded_to_roi", s, is_folded, s);
    put_blocks(json, "folded_away", s, is_moved, s);
    om_json_close(json, '}');
    om_json_open(json, "person", '{');
    put_blocks(json, "forbidden", s, is_forbidden, s);
    om_json_close(json, '}');
    om_json_close(json, '}');
}

// The reasons of the planner, or of the plan before the operation; a string for each line.
static OmStatus put_reasons(OmAudit* a, const OmLoop* loop, OmJson* json, const OmSituation* s,
                            const OmPlan* plan) {
    const OmPreplan* before = om_loop_preplan(loop);
    OmStatus status = OM_OK;
    a->words.len = 0;
    if (before)
        status = om_text_append(&a->words, "%s", before->reason);
    else if (a->def.planner)
        status = om_planner_explain(a->def.planner, s, plan, NOTHER, &a->words);
    if (status < 0) return status;
    om_json_open(json, "reasons", '[');
    for (char* line = a->words.str; line && *line;) {
        char* end = line + strcspn(line, "\n");
        const bool is_last = !*end;
        *end = '\0';
        if (line[0]) om_json_string(json, NULL, line);
        line = is_last ? end : end + 1;
    }
    om_json_close(json, ']');
    return OM_OK;
}

void om_audit_plan_name(const OmLoop* loop, char name[OM_AUDIT_NAME]) {
    const OmPlan* plan = om_loop_plan(loop);
    const int number = om_loop_result(loop)->nplan;
    uint64_t hash = om_hash(&number, sizeof number, OM_HASH_SEED);
    for (int i = 0; i < plan->naction; ++i) {
        const OmPlanAction* p = &plan->action[i];
        const int what[3] = {(int)p->verb, p->arm, p->block};
        hash = om_hash(what, sizeof what, hash);
    }
    snprintf(name, OM_AUDIT_NAME, "%016llx", (unsigned long long)hash);
}

static OmStatus on_plan(void* ctx, const OmLoop* loop, const OmSituation* s, const OmPlan* plan) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "plan");
    char name[OM_AUDIT_NAME];
    om_audit_plan_name(loop, name);
    om_json_integer(&json, "plan", loop->result.nplan);
    om_json_string(&json, "name", name);
    om_json_string(&json, "made", om_loop_preplan(loop) ? "before" : "now");
    put_facts(&json, loop, s);
    om_json_string(&json, "outcome", om_status_text(plan->outcome));
    om_json_open(&json, "actions", '[');
    for (int i = 0; i < plan->naction; ++i) {
        const OmPlanAction* p = &plan->action[i];
        om_json_open(&json, NULL, '{');
        put_action(&json, p->verb, p->arm, p->block, plan->n);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    om_json_open(&json, "cost", '[');
    for (int i = 0; i < OM_PLAN_NCOST; ++i) om_json_integer(&json, NULL, plan->cost[i]);
    om_json_close(&json, ']');
    om_json_bool(&json, "optimal", plan->is_optimal);
    OM_TRY(put_reasons(a, loop, &json, s, plan));
    put_hash(&json, "twin", om_body_hash(loop->twin));
    a->words.len = 0;
    OM_TRY(om_words_plan(loop, s, plan, &a->words));
    return end_told(a, loop, &json);
}

// ---- actions -------------------------------------------------------------------------------------------------

static OmStatus on_action_begin(void* ctx, const OmLoop* loop, const OmPlanAction* action) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "begin");
    put_action(&json, action->verb, action->arm, action->block, loop->grid.n);
    OM_TRY(om_plan_print_action(&loop->plan, (int)(action - loop->plan.action), &a->words));
    OM_TRY(om_text_append(&a->words, "."));
    return end_words(a, &json);
}

static OmStatus on_action_end(void* ctx, const OmLoop* loop, const OmRetractAction* action) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "action");
    put_action(&json, action->verb, action->arm, action->block, loop->grid.n);
    om_json_string(&json, "outcome", om_action_outcome_text(action->outcome));
    om_json_number(&json, "visibility", action->visibility);
    om_json_number(&json, "force_n", action->force_max);
    om_json_number(&json, "force_factor", loop->result.belief.force_factor);
    if (action->turn > 0) om_json_number(&json, "wrist_turn_deg", action->turn * 180 / OM_PI);
    put_hash(&json, "twin", om_body_hash(loop->twin));
    OM_TRY(om_words_action(loop, action, &a->words));
    const double factor = loop->result.belief.force_factor;
    if (factor != a->factor) OM_TRY(om_words_force(factor, &a->words));
    a->factor = factor;
    return end_told(a, loop, &json);
}

// ---- updates, persons, the end -------------------------------------------------------------------------------

static void put_estimate(OmJson* json, const OmMatchEstimate* e, const unsigned char* was) {
    int before = 0, after = 0;
    for (int v = 0; v < e->nvert; ++v) {
        before += was && was[v];
        after += e->attached[v] != 0;
    }
    om_json_integer(json, "attached", after);
    if (was) om_json_integer(json, "attached_before", before);
    if (e->nacquisition == 0) return;  // attachments alone
    om_json_number(json, "seen_share", e->seen_share);
    om_json_number(json, "median_before_m", e->before_median);
    om_json_number(json, "median_after_m", e->after_median);
}

static OmStatus on_update(void* ctx, const OmLoop* loop, const OmUpdateEvent* e) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "update");
    om_json_string(&json, "stage", om_update_stage_text(e->stage));
    om_json_integer(&json, "index", e->index);
    if (e->acquisition) om_json_integer(&json, "points", e->acquisition->scan.npoint);
    if (e->nacquisition) om_json_integer(&json, "views", e->nacquisition);
    if (e->estimate && e->estimate->attached) put_estimate(&json, e->estimate, e->was_attached);
    if (e->reason[0]) om_json_string(&json, "reason", e->reason);
    OM_TRY(om_words_update(loop, e, &a->words));
    return end_told(a, loop, &json);
}

static OmStatus on_command(void* ctx, const OmLoop* loop, const OmLoopCommand* c) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "command");
    om_json_string(&json, "command", om_loop_command_text(c->kind));
    const bool has_block = c->kind == OM_LOOP_FORBID || c->kind == OM_LOOP_ALLOW ||
                           c->kind == OM_LOOP_ATTACH || c->kind == OM_LOOP_FREE;
    if (has_block) put_block(&json, "block", c->block, loop->grid.n);
    char value[OM_NUMBER_SIZE];
    om_number_write(value, c->value);  // to the last digit: a replay gives it again
    if (c->kind == OM_LOOP_SLOW) om_json_string(&json, "value", value);
    char name[OM_AUDIT_NAME];
    om_audit_plan_name(loop, name);
    const bool is_consent = c->kind == OM_LOOP_APPROVE || c->kind == OM_LOOP_REJECT;
    if (is_consent) om_json_string(&json, "plan", name);
    OM_TRY(om_words_command(loop, c, &a->words));
    return end_told(a, loop, &json);
}

static OmStatus on_warning(void* ctx, const OmLoop* loop, int was, const OmMonitorFrame* frame) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "warning");
    om_json_integer(&json, "state", om_loop_warning(loop));
    om_json_integer(&json, "before", was);
    om_json_number(&json, "mu_m", frame->mu);
    om_json_number(&json, "part_m", om__warn_part(&loop->belief));
    om_json_number(&json, "rest_m", frame->rest);
    om_json_integer(&json, "points", frame->npoint);
    OM_TRY(om_words_warning(loop, was, frame, &a->words));
    return end_told(a, loop, &json);
}

static OmStatus on_hold(void* ctx, const OmLoop* loop, OmHold hold, const char* reason) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "hold");
    om_json_string(&json, "hold", om_hold_text(hold));
    om_json_string(&json, "reason", reason);
    OM_TRY(om_words_hold(hold, reason, &a->words));
    return end_told(a, loop, &json);
}

// The reason of a scene that hides nothing tells of the truth, too: the words stand for it.
static OmStatus on_end(void* ctx, const OmLoop* loop, const OmRetractResult* r) {
    OmAudit* a = ctx;
    OmJson json = begin_line(a, loop, "end");
    OM_TRY(om_words_end(r, &a->words));
    om_json_string(&json, "outcome", om_retract_outcome_text(r->outcome));
    om_json_string(&json, "reason", r->outcome == OM_RETRACT_IN_VIEW ? a->words.str : r->reason);
    om_json_number(&json, "visibility", r->visibility_end);
    om_json_number(&json, "force_max_n", r->twin.force);
    om_json_integer(&json, "actions", r->naction);
    om_json_integer(&json, "plans", r->nplan);
    om_json_integer(&json, "updates", r->belief.nupdate);
    put_hash(&json, "twin", om_body_hash(loop->twin));
    OM_TRY(end_told(a, loop, &json));
    if (!a->file) return OM_OK;
    FILE* file = a->file;
    a->file = NULL;
    OM_CHECK(fclose(file) == 0, OM_IO, "%s cannot be written: %s", a->path, strerror(errno));
    return OM_OK;
}

OmLoopListener om_audit_listener(OmAudit* audit) {
    return (OmLoopListener){.ctx = audit,
                            .on_begin = on_begin,
                            .on_plan = on_plan,
                            .on_action_begin = on_action_begin,
                            .on_action_end = on_action_end,
                            .on_update = on_update,
                            .on_command = on_command,
                            .on_hold = on_hold,
                            .on_warning = on_warning,
                            .on_end = on_end};
}
