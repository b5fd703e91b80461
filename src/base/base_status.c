// base_status.c: the version, status texts and the per-thread message.
#include <stdlib.h>
#include <string.h>

#include "omentum/base.h"

#define MESSAGE_SIZE 1024

static _Thread_local char message[MESSAGE_SIZE];

const char* om_version(void) { return OM_VERSION; }

const char* om_status_text(OmStatus status) {
    switch (status) {
#define OM_STATUS_CASE(name, value, text) \
    case name: return text;
        OM_STATUS_TABLE(OM_STATUS_CASE)
#undef OM_STATUS_CASE
    }
    return "unknown status";
}

const char* om_error_message(void) { return message; }

OmStatus om_error(OmStatus status, const char* format, ...) {
    // The arguments may point into the old message, so the new one is formed in a second buffer.
    char next[MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(next, sizeof next, format, args);
    va_end(args);
    om_text_make_plain(next, sizeof next);  // a file name may hold any bytes
    memcpy(message, next, sizeof message);
    return status;
}

OmStatus om_error_prefix(OmStatus status, const char* format, ...) {
    char prefix[MESSAGE_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(prefix, sizeof prefix, format, args);
    va_end(args);
    om_text_make_plain(prefix, sizeof prefix);
    char old[MESSAGE_SIZE];
    memcpy(old, message, sizeof old);
    size_t room = sizeof message - 1;
    size_t np = strlen(prefix), no = strlen(old);
    if (np > room) np = room;
    memcpy(message, prefix, np);
    const char* colon = no > 0 ? ": " : "";
    size_t nc = strlen(colon);
    if (nc > room - np) nc = room - np;
    memcpy(message + np, colon, nc);
    if (no > room - np - nc) no = room - np - nc;
    memcpy(message + np + nc, old, no);
    message[np + nc + no] = 0;
    return status;
}

void om_assert_failed(const char* expr, const char* file, int line) {
    // An invariant of our own code is violated: stop before wrong numbers leave the process.
    fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, expr);
    abort();
}
