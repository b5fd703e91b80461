// base_internal.h: shared by the files of room base: progress, temporary names and the lists of output folders.
#ifndef OMENTUM_BASE_INTERNAL_H
#define OMENTUM_BASE_INTERNAL_H

#include "omentum/base.h"

#define OM__PATH 4096        // longest path that the system resolves
#define OM__LIST ".omentum"  // list of what omentum wrote into a folder
#define OM__TEMP_NAME 64     // bytes of a temporary name

// The text of om_progress_bar_draw, of a bar or of a plain line, `elapsed` seconds after the stage began; its length.
int om__progress_line(char* line, size_t size, const OmProgressBar* bar, double elapsed,
                      double done, double total);

// Join a random name to `dir` with "/". The name holds a check number, so that no user's file has such a name by
// chance.
OmStatus om__temp_path(const char* dir, char* out, size_t size);
bool om__temp_is_name(const char* name);
// Create a new file or folder of such a name in `dir`; `fd` holds a lock as long as the writer lives.
OmStatus om__temp_make_file(const char* dir, char* path, size_t size, int* fd);
OmStatus om__temp_make_folder(const char* dir, char* path, size_t size, int* fd);

// A path whose last folder or file need not exist, without links and dots.
OmStatus om__path_resolve(const char* path, char out[OM__PATH]);
// The last part of a path.
const char* om__path_name(const char* path);
// Make renames in the folder of `path` durable.
void om__sync_folder_of(const char* path);

// May the regular file `path` be replaced? In a growing folder: only if omentum wrote it and it is unchanged.
OmStatus om__folder_check_replace(const char* path);
// Before `temp` is renamed to `path`: add its size and hash to the list of the growing folder that contains it, if
// any.
OmStatus om__folder_note(const char* path, const char* temp);
// Are all files of a complete folder in its list, unchanged? The message names the first that is not.
OmStatus om__folder_check_ours(const char* dir, const char* shown);
// The name of a complete folder from its list; false if it has none.
bool om__folder_name(const char* dir, char* out, size_t size);

#endif
