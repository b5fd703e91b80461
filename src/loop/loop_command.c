// loop_command.c: the commands of a person or a program (6.3, human supervisor).
//
// A command takes effect between two ticks. Jaws that close or open complete their motion first, so that a new plan
// knows what is held. What a person says of attachments is taken over by the twin as an estimate is, without a jump.
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "loop/loop_state.h"

static const char* const name[OM_LOOP_NCOMMAND] = {
    [OM_LOOP_PAUSE] = "pause",   [OM_LOOP_RESUME] = "go",     [OM_LOOP_ABORT] = "abort",
    [OM_LOOP_CANCEL] = "cancel", [OM_LOOP_SLOW] = "slow",     [OM_LOOP_FORBID] = "forbid",
    [OM_LOOP_ALLOW] = "allow",   [OM_LOOP_ATTACH] = "attach", [OM_LOOP_FREE] = "free",
    [OM_LOOP_REPLAN] = "plan",   [OM_LOOP_APPROVE] = "yes",   [OM_LOOP_REJECT] = "no"};

const char* om_loop_command_text(OmLoopCommandKind kind) {
    return (int)kind >= 0 && kind < OM_LOOP_NCOMMAND ? name[kind] : "";
}

// ---- text ---------------------------------------------------------------------------------------------------

static bool has_block(OmLoopCommandKind kind) {
    return kind == OM_LOOP_FORBID || kind == OM_LOOP_ALLOW || kind == OM_LOOP_ATTACH ||
           kind == OM_LOOP_FREE;
}

// The first command whose name begins with the word; "a" alone could mean four.
static int find_command(const char* word, size_t len) {
    int found = -1;
    for (int k = 0; k < OM_LOOP_NCOMMAND; ++k) {
        if (strncmp(name[k], word, len) != 0) continue;
        if (strlen(name[k]) == len) return k;
        if (found >= 0) return -1;
        found = k;
    }
    return found;
}

OmStatus om_loop_command_parse(const char* text, int n, OmLoopCommand* command) {
    *command = (OmLoopCommand){.block = -1};
    while (isspace((unsigned char)*text)) ++text;
    size_t len = 0;
    while (isalpha((unsigned char)text[len])) ++len;
    const int kind = len > 0 ? find_command(text, len) : -1;
    OM_CHECK(kind >= 0, OM_INVALID,
             "\"%.20s\" is no command; say pause, go, slow 0.5, forbid 3 2, allow 3 2, attach 3 2, "
             "free 3 2, plan, yes, no, abort or cancel",
             text);
    command->kind = (OmLoopCommandKind)kind;
    char* end = (char*)text + len;
    if (has_block(command->kind)) {
        const char* at = end;
        long x = strtol(at, &end, 10), y = end > at ? strtol(at = end, &end, 10) : 0;
        OM_CHECK(end > at && x >= 1 && x <= n && y >= 1 && y <= n, OM_INVALID,
                 "%s needs a block: two numbers from 1 to %d, as in \"%s 2 1\"", name[kind], n,
                 name[kind]);
        command->block = (int)((y - 1) * n + x - 1);
    } else if (kind == OM_LOOP_SLOW) {
        const char* at = end;
        command->value = strtod(at, &end);
        OM_CHECK(end > at && command->value > 0 && command->value <= 1, OM_INVALID,
                 "slow needs a share of the speed, above 0 to 1, as in \"slow 0.5\"");
    }
    while (isspace((unsigned char)*end)) ++end;
    OM_CHECK(!*end, OM_INVALID, "\"%.20s\" after %s is too much", end, name[kind]);
    return OM_OK;
}

// ---- pause, stop --------------------------------------------------------------------------------------------

static OmStatus pause_arms(OmLoop* loop) {
    loop->is_paused = true;
    om__act_stop(&loop->act);
    return OM_OK;
}

static OmStatus resume(OmLoop* loop) {
    const bool was_paused = loop->is_paused;
    loop->is_paused = false;
    if (was_paused || loop->stage == STAGE_HOLD)
        loop->verify_begin = loop->visible_since = loop->belief.look_begin = loop->act.time;
    if (loop->stage == STAGE_HOLD) return om__loop_end_hold(loop);
    bool is_in_motion = loop->stage == STAGE_ACTION && loop->act.action.nwait == 0;
    return was_paused && is_in_motion ? om__motion_resume(&loop->act) : OM_OK;
}

// ---- plans ----------------------------------------------------------------------------------------------------

static OmStatus forbid(OmLoop* loop, int block) {
    loop->belief.is_forbidden[block] = true;
    bool is_grasped = loop->act.arm[0].in_hand == block || loop->act.arm[1].in_hand == block;
    bool is_planned = loop->plan.naction > 0 && loop->plan.grasp_block == block;
    return is_planned && !is_grasped ? om__loop_drop_plan(loop, OM_ACTION_REPLANNED) : OM_OK;
}

static void allow(OmLoop* loop, int block) {
    loop->belief.is_forbidden[block] = false;
    loop->belief.is_exhausted[block] = false;
    loop->belief.tried[block] = 0;
}

// The grasp of a rejected plan is forbidden; of a plan that continues with held tissue, its first action is.
static void reject(OmLoop* loop) {
    const OmPlanAction* first = &loop->plan.action[0];
    if (loop->plan.grasp_block >= 0)
        loop->belief.is_forbidden[loop->plan.grasp_block] = true;
    else if (first->verb == OM_PLAN_MOVE_ROI)
        loop->belief.tried[first->block] |= OM_TRIED_MOVE_ROI;
    else if (first->verb == OM_PLAN_MOVE_AWAY)
        loop->belief.tried[first->block] |= OM_TRIED_MOVE_AWAY;
    else if (first->block >= 0)
        loop->belief.tried[first->block] |= OM_TRIED_GRASP;
    om__loop_go(loop, STAGE_PLAN);
}

// ---- attachments ------------------------------------------------------------------------------------------------

static OmStatus check_mark(const OmLoop* loop, int block) {
    const OmSite* site = om_body_site(loop->twin);
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    int num = 0;
    for (int i = 0; under && i < under->nvert; ++i)
        num += om__grid_block_of(&loop->grid, om_load3(site->mesh.x, under->vert[i])) == block;
    OM_CHECK(num > 0, OM_INVALID, "the tissue has no underside in block (%d,%d) to mark",
             block % loop->grid.n + 1, block / loop->grid.n + 1);
    return OM_OK;
}

// Attach or free the underside of a block in the twin. New springs have the stiffness of the site's.
static OmStatus mark(OmLoop* loop, int block, bool is_attached) {
    const OmSite* site = om_body_site(loop->twin);
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    const size_t n = (size_t)site->mesh.nvert;
    unsigned char* attached = NULL;
    double* stiffness = NULL;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(attached, n);
    OM_ALLOC_DONE(stiffness, n);
    memcpy(attached, om_body_attached(loop->twin), n);
    om_match_adoption_get_goal(loop->belief.adoption, attached);
    memcpy(stiffness, om_body_attachment_stiffness(loop->twin), n * sizeof *stiffness);
    for (int i = 0; i < under->nvert; ++i) {
        const int v = under->vert[i];
        if (om__grid_block_of(&loop->grid, om_load3(site->mesh.x, v)) != block) continue;
        if (is_attached && !attached[v]) stiffness[v] = site->attach_stiffness;
        attached[v] = is_attached;
        om__doubt_mark(&loop->belief, v, is_attached);
    }
    loop->belief.is_corrected = true;
    om__belief_forget_exposure(&loop->belief);
    om__force_reset(&loop->belief);
    OM_TRY_DONE(om_match_adoption_begin(loop->belief.adoption, loop->twin, attached, stiffness,
                                        OM_MATCH_ADOPT_TIME));
    status = om__loop_drop_plan(loop, OM_ACTION_REPLANNED);
done:
    om_free(attached);
    om_free(stiffness);
    return status;
}

// ---- all of them ------------------------------------------------------------------------------------------------

OmStatus om__loop_check_command(const OmLoop* loop, const OmLoopCommand* c) {
    OM_CHECK((int)c->kind >= 0 && c->kind < OM_LOOP_NCOMMAND, OM_INVALID,
             "OmLoopCommand.kind is %d", (int)c->kind);
    OM_CHECK(!has_block(c->kind) || (c->block >= 0 && c->block < loop->grid.n * loop->grid.n),
             OM_INVALID, "OmLoopCommand.block is %d; 0 to %d", c->block,
             loop->grid.n * loop->grid.n - 1);
    OM_CHECK(c->kind != OM_LOOP_SLOW || (c->value > 0 && c->value <= 1), OM_INVALID,
             "OmLoopCommand.value is %g; above 0 to 1", c->value);
    OM_CHECK((c->kind != OM_LOOP_APPROVE && c->kind != OM_LOOP_REJECT) ||
                 loop->stage == STAGE_CONSENT,
             OM_INVALID, "no plan waits for consent");
    return c->kind == OM_LOOP_ATTACH || c->kind == OM_LOOP_FREE ? check_mark(loop, c->block)
                                                                : OM_OK;
}

OmStatus om__loop_apply(OmLoop* loop, const OmLoopCommand* c) {
    OM_TRY(om__loop_notify_command(loop, c));
    if (c->kind > OM_LOOP_CANCEL) ++loop->result.ncommand;
    switch (c->kind) {
    case OM_LOOP_PAUSE: return pause_arms(loop);
    case OM_LOOP_RESUME: return resume(loop);
    case OM_LOOP_ABORT: return om__loop_stop(loop, OM_RETRACT_ABORTED);
    case OM_LOOP_CANCEL: return om__loop_stop(loop, OM_RETRACT_CANCELLED);
    case OM_LOOP_SLOW: loop->act.person_rate = c->value; return OM_OK;
    case OM_LOOP_FORBID: return forbid(loop, c->block);
    case OM_LOOP_ALLOW: allow(loop, c->block); return OM_OK;
    case OM_LOOP_ATTACH: return mark(loop, c->block, true);
    case OM_LOOP_FREE: return mark(loop, c->block, false);
    case OM_LOOP_REPLAN: return om__loop_drop_plan(loop, OM_ACTION_REPLANNED);
    case OM_LOOP_APPROVE:
        if (loop->stage == STAGE_CONSENT) om__loop_go(loop, STAGE_NEXT_ACTION);
        return OM_OK;
    case OM_LOOP_REJECT:
        if (loop->stage == STAGE_CONSENT) reject(loop);
        return OM_OK;
    case OM_LOOP_NCOMMAND: break;
    }
    return OM_OK;
}
