// cli_terminal.h: single keys from standard input, a terminal or a pipe.
#ifndef OMENTUM_CLI_TERMINAL_H
#define OMENTUM_CLI_TERMINAL_H

#include "cli_common.h"

enum { OM_CLI_KEY_END = -1, OM_CLI_KEY_NONE = -2 };

typedef struct OmCliKeys {  // zero at first
    bool is_terminal;
    bool has_ended;  // of the input
    unsigned char byte[64];
    int nbyte, at;
    int nread;  // keys
} OmCliKeys;

// If standard input is a terminal: keys arrive at once and are not echoed. The terminal is restored by om_cli_keys_end,
// at exit, and by every signal that ends or stops the program.
void om_cli_keys_begin(OmCliKeys* keys);
void om_cli_keys_end(void);
// The next key: a byte, OM_RL_KEY_UP and the following ones, OM_CLI_KEY_END at the end of the input, or
// OM_CLI_KEY_NONE after `timeout` (s; below 0: none) or Ctrl-C. Unknown sequences of escape are dropped.
int om_cli_keys_read(OmCliKeys* keys, double timeout);
// Whether a key waits to be read.
bool om_cli_keys_waiting(const OmCliKeys* keys);

#endif
