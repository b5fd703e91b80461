// cli_version.h: what `omentum --version` prints.
#ifndef OM_CLI_VERSION_H
#define OM_CLI_VERSION_H

/// The version on a line of its own, then commit and compiler, licence, processor, libraries.
void om_cli_print_version(void);

#endif
