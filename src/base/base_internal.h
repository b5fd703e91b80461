// base_internal.h: what the files of room base share: temporary names, and the lists of output folders.
#ifndef OMENTUM_BASE_INTERNAL_H
#define OMENTUM_BASE_INTERNAL_H

#include "omentum/base.h"

#define OM__PATH 4096        // longest path the system resolves
#define OM__LIST ".omentum"  // list of what omentum wrote into a folder
#define OM__TEMP_NAME 64     // bytes of a temporary name

// A name nobody can guess, "/", joined to `dir`. The name holds a check number: a user's file never has it by chance.
OmStatus om__temp_path(const char* dir, char* out, size_t size);
bool om__temp_is_name(const char* name);
// Make a file or a folder of such a name in `dir` that was not there; `fd` holds a lock while the writer lives.
OmStatus om__temp_make_file(const char* dir, char* path, size_t size, int* fd);
OmStatus om__temp_make_folder(const char* dir, char* path, size_t size, int* fd);

// A path whose last folder or file need not exist, without links and dots.
OmStatus om__path_resolve(const char* path, char out[OM__PATH]);
// The last part of a path.
const char* om__path_name(const char* path);
// Make what was renamed in the folder of `path` durable.
void om__sync_folder_of(const char* path);

// Is the regular file `path` to be replaced? In a folder that grows: only if omentum wrote it, and it is unchanged.
OmStatus om__folder_check_replace(const char* path);
// Before `temp` takes the name `path`: note its size and hash in the list of the folder that grows, if it is in one.
OmStatus om__folder_note(const char* path, const char* temp);
// Do all files of a finished folder stand in its list, unchanged? The message names the first that does not.
OmStatus om__folder_check_ours(const char* dir, const char* shown);
// The name of a finished folder from its list; false if it has none.
bool om__folder_name(const char* dir, char* out, size_t size);

#endif
