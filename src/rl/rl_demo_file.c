// rl_demo_file.c: demonstrations as HDF5 in the layout of robomimic.
//
//     data                    attributes total, env_args (JSON), task, nchoice, meaning (rl.h), seed (if partial)
//     data/demo_0             attributes num_samples, score
//     data/demo_0/obs/state   (n x nobservation) float
//     data/demo_0/actions     (n x naction) float, the number of the choice
//     data/demo_0/rewards     (n) double
//     data/demo_0/dones       (n) integer, 1 at the last step
//
// A file of ours has the head and hash of nn_store.h in front, which HDF5's tools skip. Files of other tools have none.
// Where they lack `task` and `meaning`, these are not compared with a task, and choices are counted from the actions.
#include <math.h>
#include <string.h>

#include "omentum/nn_store.h"
#include "rl/rl_internal.h"

#define KIND "omentum demonstrations"
#define MAX_FILE ((size_t)1 << 32)
enum { FORMAT = 1, NAME = 96, MAX_DEMO = 100000, CHUNK = 1024, MAX_NUMBER = 1000000 };

// ---- writing ------------------------------------------------------------------------------------------

static OmStatus put_demo(OmStoreWriter* w, const OmRlDemos* d, int k) {
    const int n = d->adr[k + 1] - d->adr[k];
    const ptrdiff_t at = d->adr[k];
    char name[NAME];
    OmStatus status = OM_OK;
    float* action = NULL;
    int* dones = NULL;
    OM_ALLOC_DONE(action, (size_t)n * (size_t)d->naction);
    OM_CALLOC_DONE(dones, n);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)n * d->naction; ++i)
        action[i] = (float)d->action[at * d->naction + i];
    dones[n - 1] = 1;
    snprintf(name, sizeof name, "data/demo_%d", k);
    om_store_group(w, name);
    snprintf(name, sizeof name, "data/demo_%d/obs", k);
    om_store_group(w, name);
    snprintf(name, sizeof name, "data/demo_%d@num_samples", k);
    om_store_value(w, name, OM_STORE_I32, 0, &n);
    snprintf(name, sizeof name, "data/demo_%d@score", k);
    om_store_value(w, name, OM_STORE_F64, 0, &d->score[k]);
    snprintf(name, sizeof name, "data/demo_%d/obs/state", k);
    om_store_array(w, name, OM_STORE_F32, (int[3]){n, d->nobservation}, CHUNK, NULL,
                   d->obs + at * d->nobservation);
    snprintf(name, sizeof name, "data/demo_%d/actions", k);
    om_store_array(w, name, OM_STORE_F32, (int[3]){n, d->naction}, CHUNK, NULL, action);
    snprintf(name, sizeof name, "data/demo_%d/rewards", k);
    om_store_array(w, name, OM_STORE_F64, (int[3]){n}, CHUNK, NULL, d->reward + at);
    snprintf(name, sizeof name, "data/demo_%d/dones", k);
    om_store_array(w, name, OM_STORE_I32, (int[3]){n}, CHUNK, NULL, dones);
done:
    om_free(action);
    om_free(dones);
    return status;
}

OmStatus om_rl_demos_save(const OmRlDemos* d, const char* path) {
    OmStoreWriter* w = NULL;
    OmText text = {0};
    unsigned char name[OM_RL_NAME] = {0}, meaning[OM_RL_MEANING] = {0};
    OmStatus status;
    memcpy(name, d->task, sizeof name);
    memcpy(meaning, d->meaning, sizeof meaning);
    OM_TRY(om_store_begin(KIND, FORMAT, &w));
    OM_TRY_DONE(
        om_text_append(&text, "{\"env_name\": \"%s\", \"type\": 2, \"env_kwargs\": {}}", d->task));
    om_store_group(w, "data");
    om_store_value(w, "data@total", OM_STORE_I32, 0, &d->nstep);
    om_store_text(w, "data@env_args", text.str);
    om_store_value(w, "data@task", OM_STORE_U8, OM_RL_NAME, name);
    om_store_value(w, "data@meaning", OM_STORE_U8, OM_RL_MEANING, meaning);
    om_store_value(w, "data@nchoice", OM_STORE_I32, OM_RL_MAX_ACTION, d->nchoice);
    om_store_value(w, "data@ndemo", OM_STORE_I32, 0, &d->ndemo);
    if (d->is_partial) om_store_value(w, "data@seed", OM_STORE_U64, 0, &d->seed);
    for (int k = 0; k < d->ndemo; ++k) OM_TRY_DONE(put_demo(w, d, k));
    status = om_store_save(w, path);
    w = NULL;
done:
    om_store_abort(w);
    om_text_done(&text);
    return status;
}

// ---- reading ------------------------------------------------------------------------------------------

// Numbers of demonstrations and steps, and sizes of all arrays, before memory is allocated.
static OmStatus measure(const OmStoreReader* r, const char* file, OmRlDemos* d) {
    int64_t total = 0;
    char name[NAME];
    int dim[3], act[3], ndemo = 0, num = 0;
    for (;; ++ndemo) {
        snprintf(name, sizeof name, "data/demo_%d@num_samples", ndemo);
        if (om_store_get_value(r, name, OM_STORE_I32, 1, &num) < 0) break;
        OM_CHECK(ndemo < MAX_DEMO, OM_INVALID, "%s: more than %d demonstrations", file, MAX_DEMO);
        snprintf(name, sizeof name, "data/demo_%d/obs/state", ndemo);
        OM_TRY(om_store_get_shape(r, name, dim));
        OM_CHECK(dim[0] == num && dim[1] > 0 && dim[2] == 0 && dim[1] <= 1 << 20, OM_INVALID,
                 "%s: %s must have %d rows", file, name, num);
        snprintf(name, sizeof name, "data/demo_%d/actions", ndemo);
        OM_TRY(om_store_get_shape(r, name, act));
        OM_CHECK(act[0] == num && act[1] > 0 && act[1] <= OM_RL_MAX_ACTION && act[2] == 0,
                 OM_INVALID, "%s: %s must have %d rows of 1 to %d components", file, name, num,
                 OM_RL_MAX_ACTION);
        bool is_first = ndemo == 0;
        if (is_first) d->nobservation = dim[1], d->naction = act[1];
        OM_CHECK(dim[1] == d->nobservation && act[1] == d->naction, OM_INVALID,
                 "%s: demo_%d has other sizes than demo_0", file, ndemo);
        total += num;
        OM_CHECK(total * dim[1] < INT32_MAX, OM_INVALID, "%s: too many steps", file);
    }
    OM_CHECK(ndemo > 0, OM_INVALID, "%s: holds no data/demo_0 with an attribute num_samples", file);
    return om__rl_demos_alloc(ndemo, (int)total, d->nobservation, d->naction, d);
}

static OmStatus get_demo(const OmStoreReader* r, const char* file, int k, int at, int n,
                         float* action, OmRlDemos* d) {
    char name[NAME];
    int dim[3];
    snprintf(name, sizeof name, "data/demo_%d/obs/state", k);
    OM_TRY(om_store_get_array(r, name, OM_STORE_F32, (int[3]){n, d->nobservation},
                              d->obs + (ptrdiff_t)at * d->nobservation));
    snprintf(name, sizeof name, "data/demo_%d/actions", k);
    OM_TRY(om_store_get_array(r, name, OM_STORE_F32, (int[3]){n, d->naction}, action));
    for (int i = 0; i < n * d->naction; ++i) {
        bool is_choice =
            action[i] >= 0 && action[i] < OM_RL_MAX_CHOICE && action[i] == floorf(action[i]);
        OM_CHECK(is_choice, OM_INVALID, "%s: %s holds %g, which is no number of a choice", file,
                 name, (double)action[i]);
        d->action[(ptrdiff_t)at * d->naction + i] = (int)action[i];
    }
    snprintf(name, sizeof name, "data/demo_%d/rewards", k);
    if (om_store_get_shape(r, name, dim) >= 0)
        OM_TRY(om_store_get_array(r, name, OM_STORE_F64, (int[3]){n}, d->reward + at));
    else
        memset(d->reward + at, 0, (size_t)n * sizeof *d->reward);
    snprintf(name, sizeof name, "data/demo_%d@score", k);
    if (om_store_get_value(r, name, OM_STORE_F64, 1, &d->score[k]) < 0) {
        d->score[k] = 0;
        for (int i = 0; i < n; ++i) d->score[k] += d->reward[at + i];
    }
    return OM_OK;
}

// The task's name, meaning and choices: of our attributes, or nothing and the largest number seen.
static OmStatus get_task(const OmStoreReader* r, const char* file, OmRlDemos* d) {
    unsigned char name[OM_RL_NAME], meaning[OM_RL_MEANING];
    if (om_store_get_value(r, "data@meaning", OM_STORE_U8, OM_RL_MEANING, meaning) >= 0) {
        memcpy(d->meaning, meaning, sizeof meaning);
        d->meaning[OM_RL_MEANING - 1] = 0;
        OM_CHECK(om_text_is_plain(d->meaning, strlen(d->meaning), NULL), OM_INVALID,
                 "%s: the meaning of steps is no text", file);
    }
    if (om_store_get_value(r, "data@task", OM_STORE_U8, OM_RL_NAME, name) >= 0) {
        memcpy(d->task, name, sizeof name);
        d->task[OM_RL_NAME - 1] = 0;
        OM_CHECK(om_text_is_plain(d->task, strlen(d->task), NULL), OM_INVALID,
                 "%s: the name of the task is no text", file);
        OM_TRY(om_store_get_value(r, "data@nchoice", OM_STORE_I32, OM_RL_MAX_ACTION, d->nchoice));
    }
    for (int k = 0; k < d->naction; ++k) {
        int most = 1;
        for (int i = 0; i < d->nstep; ++i) {
            int a = d->action[(ptrdiff_t)i * d->naction + k];
            if (a > most) most = a;
        }
        if (!d->task[0]) d->nchoice[k] = most + 1;
        OM_CHECK(d->nchoice[k] > most && d->nchoice[k] <= OM_RL_MAX_CHOICE, OM_INVALID,
                 "%s: component %d has %d choices, and an action with number %d", file, k,
                 d->nchoice[k], most);
    }
    for (int k = d->naction; k < OM_RL_MAX_ACTION; ++k) d->nchoice[k] = 0;
    return OM_OK;
}

static OmStatus read_demos(const OmStoreReader* r, const char* name, OmRlDemos* d) {
    OmStatus status;
    float* action = NULL;
    char text[NAME];
    OM_TRY(measure(r, name, d));
    OM_ALLOC_DONE(action, (size_t)d->nstep * (size_t)d->naction);
    int at = 0;
    for (int k = 0; k < d->ndemo; ++k) {
        int num = 0;
        snprintf(text, sizeof text, "data/demo_%d@num_samples", k);
        OM_TRY_DONE(om_store_get_value(r, text, OM_STORE_I32, 1, &num));
        d->adr[k] = at;
        OM_TRY_DONE(get_demo(r, name, k, at, num, action, d));
        at += num;
    }
    d->adr[d->ndemo] = at;
    status = get_task(r, name, d);
    d->is_partial = om_store_get_value(r, "data@seed", OM_STORE_U64, 1, &d->seed) >= 0;
done:
    om_free(action);
    return status;
}

OmStatus om_rl_demos_parse(const char* data, size_t size, const char* name, OmRlDemos* demos) {
    static const char hdf5[] = "\x89HDF\r\n\x1a\n";
    OmStoreReader* reader;
    *demos = (OmRlDemos){0};
    bool is_plain = size >= 8 && memcmp(data, hdf5, 8) == 0;  // without our head
    OM_TRY(om_store_open(data, size, is_plain ? NULL : KIND, FORMAT, name, &reader));
    OmStatus status = read_demos(reader, name, demos);
    om_store_close(reader);
    if (status < 0) om_rl_demos_done(demos);
    return status;
}

OmStatus om_rl_demos_load(const char* path, OmRlDemos* demos) {
    char* data;
    size_t size;
    *demos = (OmRlDemos){0};
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    OmStatus status = om_rl_demos_parse(data, size, path, demos);
    om_free(data);
    return status;
}
