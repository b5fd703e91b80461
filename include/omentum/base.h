/// omentum/base.h: errors, memory, random numbers, threads, text and files for every room (floor 0).
///
/// Status codes and messages, one allocator, arenas, counter-based random numbers, parallel loops with
/// a fixed order, logging through a sink, progress reports, clocks, text and JSON building, and files
/// that appear whole or not at all. The library never prints and never exits.
///
///     OmText t = {0};
///     OmStatus s = om_text_append(&t, "%d tetrahedra", ntet);
///     if (s == OM_OK) s = om_file_write("summary.txt", t.str, t.len);
///     if (s < 0) fprintf(stderr, "%s\n", om_error_message());
///     om_text_done(&t);
#ifndef OMENTUM_BASE_H
#define OMENTUM_BASE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#if defined(_WIN32)
#define OM_API
#else
#define OM_API __attribute__((visibility("default")))
#endif

#if defined(__GNUC__)
#define OM_PRINTF(fmt, args) __attribute__((format(printf, fmt, args)))
#else
#define OM_PRINTF(fmt, args)
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- version --------------------------------------------------------------------------------

/// Version of these headers, "major.minor.patch". Before 1.0.0 a new minor version may change the interface.
#define OM_VERSION "0.2.0"
/// Version of the library that the program runs with, in the same form. A constant; never null.
OM_API const char* om_version(void);

// ---- status ---------------------------------------------------------------------------------

/// Every status and its text. Negative: an error, nothing was changed. Positive: an honest outcome.
#define OM_STATUS_TABLE(X)                               \
    X(OM_OK, 0, "ok")                                    \
    X(OM_INVALID, -1, "invalid argument or input")       \
    X(OM_NO_MEMORY, -2, "out of memory")                 \
    X(OM_IO, -3, "input or output failed")               \
    X(OM_UNAVAILABLE, -4, "not available in this build") \
    X(OM_CANCELLED, -5, "cancelled")                     \
    X(OM_NOT_CONVERGED, 1, "not converged")              \
    X(OM_NOT_SPD, 2, "matrix not positive definite")     \
    X(OM_UNSAT, 3, "no solution exists")                 \
    X(OM_TIMEOUT, 4, "time limit reached")

typedef enum OmStatus {
#define OM_STATUS_ENUM(name, value, text) name = value,
    OM_STATUS_TABLE(OM_STATUS_ENUM)
#undef OM_STATUS_ENUM
} OmStatus;

/// The fixed text of a status.
OM_API const char* om_status_text(OmStatus status);

/// The last error of this thread as one sentence for people; "" if none. Valid until the next failure.
OM_API const char* om_error_message(void);

/// Set this thread's message and return `status`, for use in a return statement.
/// @return `status`
OM_API OmStatus om_error(OmStatus status, const char* format, ...) OM_PRINTF(2, 3);

/// Put "`prefix`: " before this thread's message (a file, a field) and return `status`.
/// @return `status`
OM_API OmStatus om_error_prefix(OmStatus status, const char* format, ...) OM_PRINTF(2, 3);

#define OM_MAX_ARM 2  // arms that may hold tissue at once; a world says how many it has

/// Mark of a definition, set by its `default_def`: `create` refuses a definition without it.
typedef uint32_t OmCookie;

/// Return an error (a negative status) of `call` to the caller.
#define OM_TRY(call)                      \
    do {                                  \
        OmStatus om_try_status_ = (call); \
        if (om_try_status_ < 0) {         \
            return om_try_status_;        \
        }                                 \
    } while (0)

/// Return `status` with a printf message unless `cond` holds.
#define OM_CHECK(cond, status, ...)                 \
    do {                                            \
        if (!(cond)) {                              \
            return om_error((status), __VA_ARGS__); \
        }                                           \
    } while (0)

/// As OM_TRY, but jumps to `done:` with the error in the local variable `status`.
#define OM_TRY_DONE(call) \
    do {                  \
        status = (call);  \
        if (status < 0) { \
            goto done;    \
        }                 \
    } while (0)

/// As OM_CHECK, but jumps to `done:` with the error in the local variable `status`.
#define OM_CHECK_DONE(cond, code, ...)              \
    do {                                            \
        if (!(cond)) {                              \
            status = om_error((code), __VA_ARGS__); \
            goto done;                              \
        }                                           \
    } while (0)

/// An invariant of our own code; never guards input. Compiled out when NDEBUG is defined.
OM_API void om_assert_failed(const char* expr, const char* file, int line);
#ifdef NDEBUG
#define OM_ASSERT(expr) ((void)0)
#else
#define OM_ASSERT(expr) ((expr) ? (void)0 : om_assert_failed(#expr, __FILE__, __LINE__))
#endif

// ---- memory ---------------------------------------------------------------------------------

typedef struct OmAllocator {
    void* (*alloc)(void* ctx, size_t size,
                   size_t align);  // null on failure; align is a power of two
    void (*free)(void* ctx, void* ptr);
    void* ctx;
} OmAllocator;

/// Replace the allocator; to be called before anything is allocated. Null restores the default.
OM_API void om_allocator_set(const OmAllocator* allocator);

/// 64-byte aligned memory, not cleared; null with the message set on failure. Size 0 gives a valid pointer.
OM_API void* om_alloc(size_t count, size_t size);
/// As om_alloc, cleared to zero.
OM_API void* om_calloc(size_t count, size_t size);
/// Grow or shrink a block of om_alloc; on failure null, and the old block stays.
OM_API void* om_realloc(void* ptr, size_t old_count, size_t new_count, size_t size);
OM_API void om_free(void* ptr);
/// Blocks allocated since start, and blocks now alive.
OM_API int64_t om_alloc_count(void);
OM_API int64_t om_alloc_alive(void);

/// `ptr = om_alloc(...)`, returning OM_NO_MEMORY on failure.
#define OM_ALLOC(ptr, count)                              \
    do {                                                  \
        (ptr) = om_alloc((size_t)(count), sizeof *(ptr)); \
        if (!(ptr)) return OM_NO_MEMORY;                  \
    } while (0)
/// `ptr = om_alloc(...)`, jumping to `done:` with `status` = OM_NO_MEMORY on failure.
#define OM_ALLOC_DONE(ptr, count)                         \
    do {                                                  \
        (ptr) = om_alloc((size_t)(count), sizeof *(ptr)); \
        if (!(ptr)) {                                     \
            status = OM_NO_MEMORY;                        \
            goto done;                                    \
        }                                                 \
    } while (0)
/// As OM_ALLOC_DONE, cleared to zero.
#define OM_CALLOC_DONE(ptr, count)                         \
    do {                                                   \
        (ptr) = om_calloc((size_t)(count), sizeof *(ptr)); \
        if (!(ptr)) {                                      \
            status = OM_NO_MEMORY;                         \
            goto done;                                     \
        }                                                  \
    } while (0)

/// Scratch memory: push, mark, release. One block, never grows.
typedef struct OmArena {
    unsigned char* base;
    size_t size;
    size_t used;
    size_t peak;
} OmArena;

/// Allocate a block of `size` bytes.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_arena_create(size_t size, OmArena* arena);
OM_API void om_arena_destroy(OmArena* arena);
/// 64-byte aligned; null with the message set when the arena is full.
OM_API void* om_arena_push(OmArena* arena, size_t count, size_t size);
static inline size_t om_arena_mark(const OmArena* arena) { return arena->used; }
static inline void om_arena_release(OmArena* arena, size_t mark) { arena->used = mark; }

// ---- random numbers: Philox 4x32-10 (Salmon et al. 2011) ---------------------------------------

/// A stream named by (seed, index): sample i can be made alone, on any thread, to the same bytes.
typedef struct OmRng {
    uint32_t key[2];      // seed
    uint32_t counter[4];  // block number (2 words) and index (2 words)
    uint32_t out[4];      // the current block
    int used;             // words of `out` handed out
} OmRng;

OM_API OmRng om_rng_init(uint64_t seed, uint64_t index);
OM_API uint32_t om_rng_u32(OmRng* rng);
/// Uniform in [0, n), n > 0, without modulo bias.
OM_API uint32_t om_rng_below(OmRng* rng, uint32_t n);
/// Uniform in [0, 1), 53 bits.
OM_API double om_rng_uniform(OmRng* rng);
/// Uniform in [lo, hi).
OM_API double om_rng_range(OmRng* rng, double lo, double hi);
/// Standard normal (Box-Muller).
OM_API double om_rng_normal(OmRng* rng);

// ---- parallel loops ---------------------------------------------------------------------------

/// Worker counts: 0 means one per processor. Never more than OM_MAX_WORKER or than the processors of this process
/// (affinity, quota of its container): om_worker_count returns the number that is used. Loops and teams use fewer
/// while other threads need processors: no result depends on it.
#define OM_MAX_WORKER 64
OM_API int om_worker_count(int requested);
/// As om_worker_count, and no more than processors are free now. For libraries that keep a number of threads and wait
/// for each of them. May take some milliseconds.
OM_API int om_worker_free(int requested);
/// Take numbers of workers above 0 literally, however many processors there are, and wait for every worker. For tests
/// of determinism; call it before anything else.
OM_API void om_worker_force(bool is_on);
/// Whether this thread is running a loop or a team: then a new one has one worker.
OM_API bool om_worker_is_inside(void);

/// One block [begin, end) of a loop; `block` counts from 0 and does not depend on the worker count.
typedef void (*OmRangeFn)(void* ctx, int begin, int end, int block);

/// Run fn over [0, n) in blocks of `grain` (the last may be short). Blocks may run in any order and at
/// once; a reduction stores one partial result per block and adds them in block order.
OM_API void om_parallel_for(int nworker, int n, int grain, OmRangeFn fn, void* ctx);
static inline int om_block_count(int n, int grain) { return (n + grain - 1) / grain; }

/// The same blocks, but where om_stop_poll asks to stop the remaining ones are left out: what fn writes is not whole.
/// @return OM_OK; OM_CANCELLED
OM_API OmStatus om_parallel_for_stop(int nworker, int n, int grain, OmRangeFn fn, void* ctx);

/// A team of workers running one function together, for iterative kernels whose loops are too short to
/// fork for each: split the work by rank into fixed blocks, and meet at om_team_barrier.
typedef struct OmTeam OmTeam;
typedef void (*OmTeamFn)(void* ctx, OmTeam* team, int rank, int size);
OM_API void om_parallel_team(int nworker, OmTeamFn fn, void* ctx);
/// Returns when every member of the team has arrived.
OM_API void om_team_barrier(OmTeam* team);

// ---- log, progress, clock -----------------------------------------------------------------------

typedef enum OmLogLevel { OM_LOG_DEBUG, OM_LOG_INFO, OM_LOG_WARNING } OmLogLevel;
typedef void (*OmLogSink)(void* ctx, OmLogLevel level, const char* line);
/// No sink (the default) drops every line.
OM_API void om_log_set_sink(OmLogSink sink, void* ctx);
OM_API void om_log(OmLogLevel level, const char* format, ...) OM_PRINTF(2, 3);

/// Progress callback of long work; return false to cancel. Null is allowed wherever a function takes one.
typedef struct OmProgress {
    bool (*report)(void* ctx, const char* stage, double done, double total);  // false: cancel
    void* ctx;
} OmProgress;
/// Report progress to the listener; null progress does nothing.
/// @return OM_OK; OM_CANCELLED (the listener requests an end)
OM_API OmStatus om_progress_report(const OmProgress* progress, const char* stage, double done,
                                   double total);

/// A function that says whether this thread should stop what it computes, for Ctrl-C and the like. Long calls ask it,
/// with an OmProgress and without. Each thread has its own; null (the default): none.
/// @param fn  true: stop. It is called on this thread, every OM_STOP_PERIOD at most, and calls nothing of omentum
OM_API void om_stop_set(bool (*fn)(void* ctx), void* ctx);
#define OM_STOP_PERIOD 0.02  // s
/// Whether this thread has such a function.
OM_API bool om_stop_is_set(void);
/// Ask that function. Once it has said true, every call says so, until om_stop_take.
/// @return OM_OK; OM_CANCELLED
OM_API OmStatus om_stop_poll(void);
/// Whether the function has said true since the last call of this one.
OM_API bool om_stop_take(void);

/// Draws progress with rate and time left: a bar on a terminal, a plain line every few seconds elsewhere.
typedef struct OmProgressBar {
    FILE* out;
    bool is_terminal;
    double start_time, last_time;  // s, of the current stage
    double last_done;              // of the last line
    char stage[64];
    int last_width;  // characters of the last line drawn
} OmProgressBar;
OM_API void om_progress_bar_init(OmProgressBar* bar, FILE* out);
OM_API void om_progress_bar_draw(OmProgressBar* bar, const char* stage, double done, double total);
OM_API void om_progress_bar_done(OmProgressBar* bar);

/// Monotonic time, s.
OM_API double om_clock_now(void);

// ---- hashing --------------------------------------------------------------------------------------

/// FNV-1a over 8-byte words, for hashes of states; chain by passing the last result as `seed`.
OM_API uint64_t om_hash(const void* data, size_t size, uint64_t seed);
#define OM_HASH_SEED 14695981039346656037ull

// ---- sorting ----------------------------------------------------------------------------------------

/// Into ascending order; nothing is said about where a NaN goes.
OM_API void om_sort_ints(int* value, int n);
OM_API void om_sort_doubles(double* value, int n);
/// The value below which `share` (0 to 1) of the sorted values lie, linear between two of them (definition 7 of Hyndman
/// & Fan 1996, as numpy.quantile).
/// @param sorted  ascending  (n > 0)
OM_API double om_quantile(const double* sorted, int n, double share);

// ---- text and JSON ----------------------------------------------------------------------------------

/// A growing string; zero-initialise, om_text_done frees it.
typedef struct OmText {
    char* str;  // always terminated once something was appended
    size_t len;
    size_t cap;
} OmText;
/// Append as printf does.
/// @return OM_OK; OM_INVALID (a format that fails); OM_NO_MEMORY, the text is as before
OM_API OmStatus om_text_append(OmText* text, const char* format, ...) OM_PRINTF(2, 3);
/// Append `len` bytes.
/// @return OM_OK; OM_NO_MEMORY, the text is as before
OM_API OmStatus om_text_append_raw(OmText* text, const char* data, size_t len);
/// Bytes of the UTF-8 character at `str`, of which `len` > 0 bytes may be read; 0 if they are none.
OM_API size_t om_utf8_length(const char* str, size_t len);
/// Append bytes from outside as text that any program can read: bytes that are no UTF-8 and control characters become
/// a backslash, an x and two hexadecimal digits. Names of files may be any bytes.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_text_append_plain(OmText* text, const char* data, size_t len);
/// Whether it is UTF-8 without control characters, but those in `allowed` (null: none): the rule for names.
OM_API bool om_text_is_plain(const char* data, size_t len, const char* allowed);
/// Escape a name in its own place as om_text_append_plain does; a text that does not fit into `size` is cut at a
/// character.
OM_API void om_text_make_plain(char* name, size_t size);
/// Append between double quotes, a string of JSON and of YAML; escaped as om_text_append_plain does.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_text_append_quoted(OmText* text, const char* str);
/// Append with &, <, >, " and ' escaped for HTML, and as om_text_append_plain does.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_text_append_html(OmText* text, const char* str);
/// Append `data` as base64.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_text_append_base64(OmText* text, const void* data, size_t size);
OM_API void om_text_done(OmText* text);

/// Writes JSON into a text; the first failure is kept and returned by om_json_end.
typedef struct OmJson {
    OmText* text;
    OmStatus status;
    int depth;
    bool is_first[32];  // nothing written yet at this depth
} OmJson;
OM_API OmJson om_json_begin(OmText* text);
/// `key` is null inside arrays and at the root. Doubles that are not finite are written as null.
OM_API void om_json_open(OmJson* json, const char* key, char bracket);  // '{' or '['
OM_API void om_json_close(OmJson* json, char bracket);                  // '}' or ']'
OM_API void om_json_string(OmJson* json, const char* key, const char* value);
OM_API void om_json_number(OmJson* json, const char* key, double value);
OM_API void om_json_integer(OmJson* json, const char* key, int64_t value);
OM_API void om_json_bool(OmJson* json, const char* key, bool value);
OM_API void om_json_numbers(OmJson* json, const char* key, const double* value, int count);
/// Close the text with a line end.
/// @return OM_OK; the first failure of the calls before
OM_API OmStatus om_json_end(OmJson* json);
/// The end as well: the text goes into a file, whole or not at all, and is freed, also on failure.
/// @return OM_OK; the first failure of the calls before; OM_INVALID (a path that is too long); OM_IO
OM_API OmStatus om_json_save(OmJson* json, const char* path);

/// Numbers of files, read and written alike under every locale. Reading starts at *str without skipping
/// blanks, never looks at `end` or behind it, and moves *str behind the number; false if there is none
/// (or an integer does not fit). "nan" and "inf" are read; 19 digits count.
OM_API bool om_number_parse(const char** str, const char* end, double* value);
OM_API bool om_integer_parse(const char** str, const char* end, int64_t* value);
#define OM_NUMBER_SIZE 32
/// Write with 17 significant digits, which any reader turns back into the same double; the length.
OM_API int om_number_write(char* out, double value);

/// The candidate nearest to `word` by edit distance, or null if none is near; for "did you mean".
OM_API const char* om_nearest_word(const char* word, const char* const* candidate, int count);

// ---- files ------------------------------------------------------------------------------------------

/// Open a regular file for reading and say how many bytes it has (`size` may be null). A folder, a pipe, a
/// socket or a device is OM_IO at once: a reader never waits for a writer.
/// @return OM_OK; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_file_open(const char* path, FILE** stream, uint64_t* size);
/// A whole file in memory, with a zero byte after its end; the caller frees with om_free. As om_file_open.
/// @return OM_OK; OM_INVALID (longer than max_size); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_file_read(const char* path, size_t max_size, char** data, size_t* size);
/// Write a file that appears whole or not at all (temporary name, fsync, rename). A link is followed; a device, a pipe
/// and a name of /dev/fd are written directly; a folder, a socket and a disk are refused. A regular file that
/// is there is replaced, but in a folder that grows (om_folder_open) only if omentum wrote it and it is unchanged.
/// @return OM_OK; OM_INVALID (a path that is too long); OM_IO, the old file stays
OM_API OmStatus om_file_write(const char* path, const void* data, size_t size);

/// The same for files written piece by piece or by a library that wants a name.
typedef struct OmAtomicFile {
    char path[1024];  // links followed
    char temp[1100];  // "": a device or a pipe, written to through `stream` alone
    FILE* stream;
    int lock;  // a descriptor; while it is open, no other run takes the temporary file for left behind
} OmAtomicFile;
/// Open a temporary file in the folder of `path`.
/// @return OM_OK; OM_INVALID (a path that is too long); OM_IO
OM_API OmStatus om_file_begin(const char* path, OmAtomicFile* file);
/// Flush, fsync, close, rename. A failure (full disk) removes the temporary file and says so.
/// @return OM_OK; OM_IO, the old file stays
OM_API OmStatus om_file_commit(OmAtomicFile* file);
/// Close and remove the temporary file; harmless after commit.
OM_API void om_file_abort(OmAtomicFile* file);

/// May a file that a user named be replaced? OM_INVALID if a regular file is there that does not hold `mark`, which
/// only omentum writes. `mark` null: its last line must be the seal of all before it.
/// @return OM_OK; OM_INVALID (the file of somebody else); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_file_check_ours(const char* path, const char* mark);
/// Append a comment line with a hash of all before it, by which om_file_check_ours knows a text file again.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_text_seal(OmText* text);

OM_API bool om_path_exists(const char* path);
/// Make a directory and its parents.
/// @return OM_OK, also where it exists; OM_INVALID (a path that is too long); OM_IO
OM_API OmStatus om_path_make_dir(const char* path);
/// Remove a file or a directory with all it holds, links not followed; for files of the caller alone.
/// @return OM_OK; OM_INVALID (a path that is too long); OM_IO
OM_API OmStatus om_path_remove(const char* path);
/// Remove what killed runs left in `dir` under temporary names, in folders below it too if `is_deep`; never what
/// belongs to a run that lives. A finished result that a kill kept from its name gets it, if the name is free.
OM_API void om_path_clean(const char* dir, bool is_deep);
/// OM_INVALID if writing `output` would lose `input`: they are one file or folder, or `input` lies in `output`.
/// @return OM_OK, also if `input` is not there; OM_INVALID; OM_IO (a path that cannot be followed)
OM_API OmStatus om_path_check_apart(const char* input, const char* output);
/// `dir`/`name` into out, unless `name` is absolute; OM_INVALID if it does not fit.
/// @return OM_OK; OM_INVALID (longer than `size`)
OM_API OmStatus om_path_join(const char* dir, const char* name, char* out, size_t size);
/// The folder part of `path` into out, "." if none.
/// @return OM_OK; OM_INVALID (longer than `size`)
OM_API OmStatus om_path_dir(const char* path, char* out, size_t size);
/// A file that comes along ("weights/phantom.safetensors"): in ../share/omentum beside program or library, in ../share
/// beside the library (the Python package), in the sources around the build folder, beside the program. Linux only.
/// @return OM_OK; OM_IO (not there); OM_INVALID (longer than `size`)
OM_API OmStatus om_path_share(const char* name, char* out, size_t size);
/// The extension of `path` in lower case without the dot into out ("nii.gz" counts as one), "" if none.
OM_API void om_path_extension(const char* path, char* out, size_t size);

// ---- output folders ---------------------------------------------------------------------------------

/// A folder of results. It holds a list, .omentum, of what omentum wrote (sizes and hashes); nothing else is ever
/// removed or replaced. `kind` says what the folder holds, "retraction run"; one kind does not replace another.
typedef struct OmFolder {
    char place[1024];  // where the folder is, or will be; after om_folder_commit, where it is
    char path[1100];   // where its files are written; "" once it is done with
    char kind[48];
    int lock;         // a descriptor that keeps other runs out
    bool is_growing;  // opened, not begun
    bool has_list;    // of its own, when it grows
} OmFolder;

/// Begin a folder that appears whole: its files are written into `path`, and om_folder_commit puts it into its place.
/// OM_INVALID if `dir` holds a file that does not stand in the folder's list, or not with this size and hash, has no
/// list, is the current folder, or where a disk is mounted. An empty folder is replaced.
/// @return OM_OK; OM_INVALID, OM_IO (nothing can be written there), OM_NO_MEMORY, with nothing made
OM_API OmStatus om_folder_begin(const char* dir, const char* kind, OmFolder* folder);
/// The checks of om_folder_begin alone, before hours of work.
/// @return as om_folder_begin
OM_API OmStatus om_folder_check(const char* dir, const char* kind);
/// Write the list and take the place. If the old folder was written into meanwhile, or the place cannot be taken, the
/// result is put beside it, under the name in `place`, and the message says so. Ends the folder in any case.
/// @return OM_OK; OM_INVALID (the old folder was written into); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_folder_commit(OmFolder* folder);
/// The same for a part of a result: if something stands in the place, it stays, and `place` names the new folder.
/// @return OM_OK; OM_IO; OM_NO_MEMORY
OM_API OmStatus om_folder_commit_beside(OmFolder* folder);
/// Open a folder that is written in place and may be continued later: made if it is missing. OM_INVALID if it is not
/// empty and has no list of this kind, if a listed file was changed, or if another run writes into it.
/// @return OM_OK; OM_INVALID; OM_IO; OM_NO_MEMORY
OM_API OmStatus om_folder_open(const char* dir, const char* kind, OmFolder* folder);
/// Close a folder that grows; remove one that was begun and not committed. Harmless after commit.
OM_API void om_folder_end(OmFolder* folder);

#ifdef __cplusplus
}
#endif
#endif
