// cli_terminal.c: single keys from standard input.
#include "cli_terminal.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "omentum/rl.h"

#define PART 0.1  // s, of a wait

enum { ESCAPE = 27, ESCAPE_MS = 50 };  // bytes of one sequence arrive within this time

// ---- the terminal -------------------------------------------------------------------------------------

static struct termios before, single;
static volatile sig_atomic_t is_single;

// Only calls that a signal handler may make.
static void restore(void) {
    if (is_single) (void)tcsetattr(STDIN_FILENO, TCSANOW, &before);
    is_single = 0;
}

static void on_end(int number) {
    restore();
    raise(number);  // SA_RESETHAND: the default action
}

// Ctrl-Z, and what follows when the program continues.
static void on_stop(int number) {
    int error = errno;
    bool was_single = is_single != 0;
    (void)number;
    restore();
    raise(SIGSTOP);
    if (was_single) is_single = tcsetattr(STDIN_FILENO, TCSANOW, &single) == 0;
    errno = error;
}

void om_cli_keys_begin(OmCliKeys* keys) {
    static const int end[] = {SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
    struct sigaction action = {.sa_handler = on_end, .sa_flags = SA_RESETHAND | (int)SA_NODEFER};
    *keys = (OmCliKeys){.is_terminal = isatty(STDIN_FILENO) != 0};
    if (!keys->is_terminal || tcgetattr(STDIN_FILENO, &before) != 0) return;
    single = before;
    single.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
    single.c_cc[VMIN] = 1;
    single.c_cc[VTIME] = 0;
    (void)atexit(restore);
    om_cli_set_restore(restore);
    for (size_t i = 0; i < sizeof end / sizeof *end; ++i) sigaction(end[i], &action, NULL);
    action = (struct sigaction){.sa_handler = on_stop};
    sigaction(SIGTSTP, &action, NULL);
    is_single = 1;  // first: a signal between the two lines restores what is there
    if (tcsetattr(STDIN_FILENO, TCSANOW, &single) != 0) is_single = 0;
}

void om_cli_keys_end(void) { restore(); }

// ---- keys ---------------------------------------------------------------------------------------------

// Whether input is there within the time; below 0: wait until there is some. Ctrl-C ends the wait, also one that comes
// just before poll: the wait has short parts.
static bool wait_input(double timeout) {
    const double end = om_clock_now() + timeout;
    struct pollfd fd = {.fd = STDIN_FILENO, .events = POLLIN};
    for (;;) {
        double left = timeout < 0 ? PART : end - om_clock_now();
        double part = left < 0 ? 0 : left < PART ? left : PART;
        if (poll(&fd, 1, (int)(1e3 * part + 0.999)) > 0) return true;
        if (om_cli_is_interrupted() || (timeout >= 0 && left <= PART)) return false;
    }
}

bool om_cli_keys_waiting(const OmCliKeys* k) {
    return k->at < k->nbyte || (!k->has_ended && wait_input(0));
}

// The next byte, or OM_CLI_KEY_END, OM_CLI_KEY_NONE.
static int next_byte(OmCliKeys* k, double timeout) {
    if (k->at < k->nbyte) return k->byte[k->at++];
    if (k->has_ended) return OM_CLI_KEY_END;
    if (om_cli_is_interrupted() || !wait_input(timeout)) return OM_CLI_KEY_NONE;
    ssize_t n = read(STDIN_FILENO, k->byte, sizeof k->byte);
    if (n < 0 && (errno == EINTR || errno == EAGAIN)) return OM_CLI_KEY_NONE;
    k->has_ended = n <= 0;
    k->at = 0;
    k->nbyte = n > 0 ? (int)n : 0;
    return n > 0 ? k->byte[k->at++] : OM_CLI_KEY_END;
}

// What follows an escape: [ or O, numbers, a final character.
static int read_sequence(OmCliKeys* k) {
    static const char arrow[] = "ABDC";  // in the order of OM_RL_KEY_UP
    int c = next_byte(k, 1e-3 * ESCAPE_MS), number = 0;
    if (c != '[' && c != 'O') return OM_CLI_KEY_NONE;
    while ((c = next_byte(k, 1e-3 * ESCAPE_MS)) >= '0' && c <= ';')
        if (c <= '9' && number < 100) number = 10 * number + c - '0';
    const char* at = c > 0 ? strchr(arrow, c) : NULL;
    if (at) return OM_RL_KEY_UP + (int)(at - arrow);
    if (c == '~' && (number == 5 || number == 6)) return OM_RL_KEY_PAGE_UP + number - 5;
    return OM_CLI_KEY_NONE;
}

int om_cli_keys_read(OmCliKeys* k, double timeout) {
    const double end = timeout < 0 ? 0 : om_clock_now() + timeout;
    for (;;) {
        double left = timeout < 0 ? -1 : end - om_clock_now();
        int key = next_byte(k, timeout < 0 || left > 0 ? left : 0);
        if (key < 0) return key;
        ++k->nread;
        if (key == ESCAPE) key = read_sequence(k);
        if (key >= 0) return key;
    }
}
