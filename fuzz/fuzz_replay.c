// fuzz_replay.c: the fuzz targets without a fuzzer. `replay fuzz_image_png FOLDER...` gives one target every file of
// the corpus folders, each of them cut short at many places, and each with bytes changed at random (counter-based,
// so every run is the same). A file of few bytes is cut once at each byte, and is damaged less often.
#include <dirent.h>
#include <sys/stat.h>

#include "fuzz_common.h"

#define TARGET(name) int name(const uint8_t* data, size_t size);
#include OM_TARGET_LIST
#undef TARGET

static const struct ReplayTarget {
    const char* name;
    int (*run)(const uint8_t* data, size_t size);
} targets[] = {
#define TARGET(name) {#name, name},
#include OM_TARGET_LIST
};

enum { NCUT = 40, MIN_DAMAGE = 20, MAX_DAMAGE = 100, MAX_FILE = 1 << 20 };

static int ncut, ndamage;  // that were run

static int replay_file(const struct ReplayTarget* target, const char* path, uint64_t index) {
    static uint8_t data[MAX_FILE];
    FILE* file = fopen(path, "rb");
    if (!file) return 1;
    size_t size = fread(data, 1, sizeof data, file);
    fclose(file);

    // Copies of the exact size, so that a sanitizer sees one byte too far.
    uint8_t* copy = malloc(size ? size : 1);
    if (!copy) return 1;
    memcpy(copy, data, size);
    target->run(copy, size);
    free(copy);
    const size_t num = size < NCUT ? size : NCUT;
    for (size_t i = 0; i < num; ++i) {
        const size_t cut = size * i / num;
        copy = malloc(cut ? cut : 1);
        if (!copy) return 1;
        memcpy(copy, data, cut);
        target->run(copy, cut);
        free(copy);
        ++ncut;
    }
    size_t most = size < MIN_DAMAGE ? MIN_DAMAGE : size < MAX_DAMAGE ? size : MAX_DAMAGE;
    for (size_t i = 0; i < most && size; ++i) {
        OmRng rng = om_rng_init(index, (uint64_t)i);
        copy = malloc(size);
        if (!copy) return 1;
        memcpy(copy, data, size);
        for (uint32_t k = 0; k <= om_rng_below(&rng, 4); ++k)
            copy[om_rng_below(&rng, (uint32_t)size)] = (uint8_t)om_rng_u32(&rng);
        target->run(copy, size);
        free(copy);
        ++ndamage;
    }
    return 0;
}

static int compare_names(const struct dirent** a, const struct dirent** b) {
    return strcmp((*a)->d_name, (*b)->d_name);
}

static const struct ReplayTarget* find_target(const char* name) {
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i)
        if (strcmp(targets[i].name, name) == 0) return &targets[i];
    return NULL;
}

int main(int argc, char** argv) {
    const struct ReplayTarget* target = argc > 2 ? find_target(argv[1]) : NULL;
    if (!target) {
        fprintf(stderr, "usage: %s TARGET FOLDER...; the targets are\n", argv[0]);
        for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i)
            fprintf(stderr, "    %s\n", targets[i].name);
        return 2;
    }
    int nfile = 0;
    for (int i = 2; i < argc; ++i) {
        struct dirent** entry = NULL;
        int n = scandir(argv[i], &entry, NULL, compare_names);
        for (int k = 0; k < n; ++k) {
            char path[4096];
            struct stat st;
            snprintf(path, sizeof path, "%s/%s", argv[i], entry[k]->d_name);
            free(entry[k]);
            if (stat(path, &st) != 0 || !S_ISREG(st.st_mode)) continue;
            if (replay_file(target, path, (uint64_t)nfile) != 0) {
                fprintf(stderr, "%s cannot be read\n", path);
                return 1;
            }
            ++nfile;
        }
        free(entry);
    }
    printf("%d files whole, %d cut short, %d damaged\n", nfile, ncut, ndamage);
    return nfile > 0 ? 0 : 1;
}
