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
    "  say go, plan, forbid 3 2, allow 3 2, attach 3 2, free 3 2, slow 0.5, pause or abort\n"

static void say_changes(OmCliPerson* p, const OmLoop* loop) {
    const OmRetractSample now = om_loop_sample(loop);
    const int warning = om_loop_warning(loop);
    if (warning != p->warning)
        fprintf(stderr,
                "%7.1f s  warning state %d; the tissue is %.1f mm from where the twin expects it\n",
                now.time, warning, 1e3 * now.mu);
    p->warning = warning;
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

// A command that cannot be taken is answered; the loop is unchanged.
static OmStatus obey(OmCliPerson* p, OmLoop* loop) {
    OmLoopCommand command;
    p->line[p->nline] = 0;
    p->nline = 0;
    if (strspn(p->line, " \t\r") == strlen(p->line)) return OM_OK;
    OmStatus status = om_loop_command_parse(p->line, om_loop_grid(loop), &command);
    if (status == OM_OK) status = om_loop_command(loop, &command);
    if (status != OM_INVALID) return status;
    fprintf(stderr, "           %s\n", om_error_message());
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
