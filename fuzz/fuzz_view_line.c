// fuzz_view_line.c: lines of a page: of a hand in the simulation, and of a person who supervises a run.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/loop.h"
#include "omentum/view_hand.h"
#include "omentum/view_server.h"

static void parse(const char* text) {
    enum { GRID = 5 };
    OmHandLine line;
    OmLoopCommand command;
    const OmStatus hand = om_hand_line_parse(text, &line);
    FUZZ_EXPECT(hand == OM_OK || (hand == OM_INVALID && om_error_message()[0]));
    if (hand == OM_OK) {
        FUZZ_EXPECT(om_hand_verb_text(line.verb) && isfinite(line.value));
        FUZZ_EXPECT(om_norm(line.at) < OM_HAND_REACH && strlen(line.name) < OM_HAND_NAME);
        FUZZ_EXPECT(strstr(text, om_hand_verb_text(line.verb)));
    }
    const OmStatus person = om_loop_command_parse(text, GRID, &command);
    FUZZ_EXPECT(person == OM_OK || (person == OM_INVALID && om_error_message()[0]));
    if (person != OM_OK) return;
    FUZZ_EXPECT(om_loop_command_text(command.kind));
    if (command.kind >= OM_LOOP_FORBID && command.kind <= OM_LOOP_FREE)
        FUZZ_EXPECT(command.block >= 0 && command.block < GRID * GRID);
    if (command.kind == OM_LOOP_SLOW) FUZZ_EXPECT(command.value > 0 && command.value <= 1);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    for (size_t begin = 0; begin < size;) {
        const uint8_t* end = memchr(data + begin, '\n', size - begin);
        const size_t n = end ? (size_t)(end - data) - begin : size - begin;
        if (n <= OM_VIEW_MAX_LINE) {  // a copy of its size: a sanitizer sees one byte too far
            char* text = malloc(n + 1);
            FUZZ_EXPECT(text);
            memcpy(text, data + begin, n);
            text[n] = 0;
            parse(text);
            free(text);
        }
        begin += n + 1;
    }
    return 0;
}
