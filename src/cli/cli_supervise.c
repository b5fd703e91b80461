// cli_supervise.c: the terminal of a person who watches a loop.
#include "cli_supervise.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "cli_common.h"

#define ASK \
    "  say go, plan, forbid 3 2, allow 3 2, attach 3 2, free 3 2, slow 0.5, abort, or help\n"

// First letters are enough; points are as in the plans, counted from 1.
static const char help[] =
    "           pause          the arms stop; the tissue and the twin continue\n"
    "           go             the arms continue, also after they stopped for you\n"
    "           slow 0.5       all motions at this share of their speed\n"
    "           plan           the action stops, and a new plan is made\n"
    "           forbid 3 2     point (3,2) is not grasped any more\n"
    "           allow 3 2      it may be grasped again\n"
    "           attach 3 2     the tissue under it is attached: the robot believes you\n"
    "           free 3 2       it is not attached\n"
    "           yes, no        the plan that waits may begin, or not\n"
    "           abort, cancel  the arms stop and stay, no jaw opens; the record is complete\n"
    "           help           this list\n";

// The actions that have ended.
static void say_actions(OmCliPerson* p, const OmLoop* loop) {
    static const char* const verb[OM_PLAN_NVERB] = {
        [OM_PLAN_REACH] = "reaches", [OM_PLAN_GRASP] = "grasps",   [OM_PLAN_RELEASE] = "opens",
        [OM_PLAN_PULL] = "pulls",    [OM_PLAN_MOVE_ROI] = "folds", [OM_PLAN_MOVE_AWAY] = "folds"};
    const OmRetractResult* r = om_loop_result(loop);
    const int n = om_loop_grid(loop);
    for (; p->naction < r->naction; ++p->naction) {
        const OmRetractAction* a = &r->action[p->naction];
        fprintf(stderr, "%7.1f s  PSM%d %s", a->end, a->arm + 1, verb[a->verb]);
        if (a->block >= 0) fprintf(stderr, " (%d,%d)", a->block % n + 1, a->block / n + 1);
        fprintf(stderr, ": %s; %.0f %% of the region of interest seen",
                om_action_outcome_text(a->outcome), 100 * a->visibility);
        if (a->force_max > 0) fprintf(stderr, ", %.2f N", a->force_max);
        fprintf(stderr, "\n");
    }
}

static void say_changes(OmCliPerson* p, const OmLoop* loop) {
    const OmRetractSample now = om_loop_sample(loop);
    const int warning = om_loop_warning(loop);
    if (warning != p->warning)
        fprintf(stderr,
                "%7.1f s  warning state %d; the tissue is %.1f mm from where the twin expects it\n",
                now.time, warning, 1e3 * now.mu);
    p->warning = warning;
    say_actions(p, loop);
    const int nplan = om_loop_result(loop)->nplan;
    OmText text = {0};
    if (nplan != p->nplan && om_plan_print(om_loop_plan(loop), &text) == OM_OK)
        fprintf(stderr, "%7.1f s  plan %d\n%s", now.time, nplan, text.str ? text.str : "");
    om_text_done(&text);
    p->nplan = nplan;
    const OmLoopPhase phase = om_loop_phase(loop);
    if (phase != p->phase && phase == OM_LOOP_CONSENT)
        fprintf(stderr, "%7.1f s  may this plan begin? yes or no\n", now.time);
    if (phase != p->phase && phase == OM_LOOP_HOLD)
        fprintf(stderr, "%7.1f s  the arms stopped for you: %s\n" ASK, now.time,
                om_loop_hold_reason(loop));
    p->phase = phase;
}

// What a command has done.
static void acknowledge(const OmLoop* loop, const OmLoopCommand* c) {
    const int n = om_loop_grid(loop), x = c->block % n + 1, y = c->block / n + 1;
    fprintf(stderr, "%7.1f s  ", om_loop_sample(loop).time);
    switch (c->kind) {
    case OM_LOOP_PAUSE:
        fprintf(stderr, "paused: the arms stand still; say go to continue\n");
        break;
    case OM_LOOP_RESUME: fprintf(stderr, "the operation continues\n"); break;
    case OM_LOOP_SLOW:
        fprintf(stderr, "motions at %.0f %% of their speed\n", 100 * c->value);
        break;
    case OM_LOOP_FORBID: fprintf(stderr, "point (%d,%d) is not grasped any more\n", x, y); break;
    case OM_LOOP_ALLOW: fprintf(stderr, "point (%d,%d) may be grasped again\n", x, y); break;
    case OM_LOOP_ATTACH: fprintf(stderr, "the tissue under (%d,%d) is attached\n", x, y); break;
    case OM_LOOP_FREE: fprintf(stderr, "the tissue under (%d,%d) is free\n", x, y); break;
    case OM_LOOP_REPLAN: fprintf(stderr, "a new plan follows\n"); break;
    case OM_LOOP_APPROVE: fprintf(stderr, "the plan begins\n"); break;
    case OM_LOOP_REJECT: fprintf(stderr, "another plan follows\n"); break;
    case OM_LOOP_ABORT:
    case OM_LOOP_CANCEL:
    case OM_LOOP_NCOMMAND: fprintf(stderr, "the operation ends\n"); break;
    }
}

static bool asks_for_help(const char* line) {
    char word[8];
    if (sscanf(line, " %7s", word) != 1) return false;
    return word[0] == '?' || strncmp("help", word, strlen(word)) == 0;
}

// A command that cannot be taken is answered; the loop is unchanged.
static OmStatus obey(OmCliPerson* p, OmLoop* loop) {
    OmLoopCommand command;
    p->line[p->nline] = 0;
    p->nline = 0;
    if (strspn(p->line, " \t\r") == strlen(p->line)) return OM_OK;
    if (asks_for_help(p->line)) {
        fprintf(stderr, "%s", help);
        return OM_OK;
    }
    OmStatus status = om_loop_command_parse(p->line, om_loop_grid(loop), &command);
    if (status == OM_OK) status = om_loop_command(loop, &command);
    if (status == OM_OK) acknowledge(loop, &command);
    if (status != OM_INVALID) return status;
    fprintf(stderr, "           %s; or help\n", om_error_message());
    return OM_OK;
}

// Read what there is, at most one line. @return true if a line was complete
static bool read_line(OmCliPerson* p, int timeout_ms) {
    struct pollfd fd = {.fd = STDIN_FILENO, .events = POLLIN};
    char c;
    while (!p->has_ended && poll(&fd, 1, timeout_ms) > 0) {
        ssize_t n = read(STDIN_FILENO, &c, 1);
        if (n < 0 && errno == EINTR) return false;
        if (n <= 0) {
            p->has_ended = true;
            return p->nline > 0;
        }
        if (c == '\n') return true;
        if (p->nline < (int)sizeof p->line - 1) p->line[p->nline++] = c;
    }
    return false;
}

static bool waits(const OmLoop* loop) {
    const OmLoopPhase phase = om_loop_phase(loop);
    return phase == OM_LOOP_CONSENT || phase == OM_LOOP_HOLD ||
           (om_loop_is_paused(loop) && phase != OM_LOOP_ENDED);
}

static void keep_pace(OmCliPerson* p, const OmLoop* loop) {
    const double now = om_clock_now(), time = om_loop_sample(loop).time;
    if (!p->has_begun) p->origin = now - time;
    p->has_begun = true;
    const double ahead = time - (now - p->origin);
    if (ahead <= 0) return;
    struct timespec t = {(time_t)ahead, (long)(1e9 * (ahead - (double)(time_t)ahead))};
    nanosleep(&t, NULL);
}

OmStatus om_cli_supervise(void* person, OmLoop* loop) {
    OmCliPerson* p = person;
    if (p->is_paced) keep_pace(p, loop);
    if (!p->reads) return OM_OK;
    say_changes(p, loop);
    if (om_loop_phase(loop) == OM_LOOP_ENDED) return OM_OK;
    if (read_line(p, 0)) return obey(p, loop);
    if (p->is_paced || !waits(loop)) return OM_OK;
    // a signal ends the wait, too: the progress report after it cancels the run
    while (waits(loop) && !p->has_ended && !om_cli_is_interrupted())
        if (read_line(p, 100)) return obey(p, loop);
    if (om_cli_is_interrupted() || !p->has_ended || !waits(loop)) return OM_OK;
    fprintf(stderr, "           nobody answers: the operation ends\n");
    return om_loop_command(loop, &(OmLoopCommand){OM_LOOP_ABORT});
}
