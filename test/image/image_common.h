// image_common.h: what the tests of volumes share.
#ifndef OMENTUM_IMAGE_COMMON_H
#define OMENTUM_IMAGE_COMMON_H

#include "test_files.h"

#include "omentum/image.h"
#include <dirent.h>

/// Write the bytes under that name, load them, remove the file.
static inline OmStatus load_bytes(const char* name, const void* data, size_t size,
                                  OmVolume* volume) {
    const char* path = temp_path(name);
    write_bytes(path, data, size);
    OmStatus status = om_volume_load(path, volume);
    remove(path);
    return status;
}

/// A refusal: one line that names the file and holds `expected`, and nothing left behind.
static inline void assert_refused(OmStatus status, const OmVolume* volume, const char* name,
                                  const char* expected) {
    const char* message = om_error_message();
    if (status != OM_INVALID || volume->voxel || strchr(message, '\n') || !strstr(message, name) ||
        !strstr(message, expected))
        fail_msg("status %d, \"%s\" is expected in \"%s\"", (int)status, expected, message);
}

// ---- every seed of a fuzzer, cut and starved ----------------------------------------------------------

static int countdown = -1;
static inline void* failing_alloc(void* ctx, size_t size, size_t align) {
    (void)ctx;
    if (countdown-- == 0) return NULL;
    return aligned_alloc(align, (size + align - 1) / align * align);
}
static inline void failing_free(void* ctx, void* ptr) {
    (void)ctx;
    free(ptr);
}

static inline OmStatus load_and_drop(const char* path) {
    OmVolume volume;
    int64_t alive = om_alloc_alive();
    OmStatus status = om_volume_load_entry(path, 0, &volume);
    if (status == OM_OK) om_volume_done(&volume);
    assert_int_equal(om_alloc_alive(), alive);
    return status;
}

/// Cut the file at every byte: a reader may find enough in what is left, or refuses.
static inline void assert_cuts_are_survived(const char* seed, const char* name) {
    char* data;
    size_t size;
    assert_ok(om_file_read(seed, 1 << 20, &data, &size));
    const char* path = temp_path(name);
    for (size_t cut = 0; cut < size; cut++) {
        write_bytes(path, data, cut);
        OmStatus status = load_and_drop(path);
        if (status == OM_NO_MEMORY || (status != OM_OK && !strstr(om_error_message(), path)))
            fail_msg("%s cut at %zu: %d, %s", seed, cut, (int)status, om_error_message());
    }
    remove(path);
    om_free(data);
}

/// Let the n-th allocation fail, n = 0, 1, ..., until none is needed.
static inline void assert_starving_is_survived(const char* seed) {
    const OmAllocator failing = {failing_alloc, failing_free, NULL};
    OmStatus healthy = load_and_drop(seed), status = OM_NO_MEMORY;
    om_allocator_set(&failing);
    for (int n = 0; status == OM_NO_MEMORY; n++) {
        countdown = n;
        status = load_and_drop(seed);
        assert_true(n < 1000);
    }
    if (countdown < 0) fail_msg("%s: a failed allocation ended as status %d", seed, (int)status);
    countdown = -1;
    om_allocator_set(NULL);
    assert_int_equal(status, healthy);
}

/// Both, for all files of a folder; `name` gives what is cut its extension.
static inline void assert_seeds_are_survived(const char* folder) {
    struct dirent** entry;
    int n = scandir(folder, &entry, NULL, alphasort), nseed = 0;
    for (int i = 0; i < n; i++) {
        char seed[512];
        const char* name = entry[i]->d_name;
        snprintf(seed, sizeof seed, "%s/%s", folder, name);
        if (name[0] != '.') {
            assert_cuts_are_survived(seed, name);
            assert_starving_is_survived(seed);
            nseed++;
        }
        free(entry[i]);
    }
    if (n >= 0) free(entry);
    assert_true(nseed >= 8);
}

#endif
