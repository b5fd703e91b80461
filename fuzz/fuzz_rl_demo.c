// fuzz_rl_demo.c: the reader of demonstrations.
//
// Unchanged bytes seldom pass the checksum, behind which HDF5 reads; its library is not ours to fuzz, so files without
// our head are not tried. The same bytes also change values of good demonstrations before they are written. The reader
// must refuse the file, or return demonstrations whose actions are choices.
#include <math.h>

#include "fuzz_common.h"
#include "omentum/rl_demo.h"

#define CHANGE 9  // bytes of one change

static OmRlDemos good;

static void make_good(void) {
    OmRlTask* task;
    FUZZ_EXPECT(om_rl_task_create("reach", NULL, 0, &task) == OM_OK);
    FUZZ_EXPECT(om_rl_demos_record(task, 2, 1, NULL, &good) == OM_OK);
    om_rl_task_destroy(task);
}

static void check(const OmRlDemos* d) {
    FUZZ_EXPECT(d->ndemo > 0 && d->nobservation > 0 && d->naction > 0);
    FUZZ_EXPECT(d->naction <= OM_RL_MAX_ACTION && strlen(d->task) < OM_RL_NAME);
    FUZZ_EXPECT(d->adr[0] == 0 && d->adr[d->ndemo] == d->nstep);
    for (int k = 0; k < d->ndemo; ++k)
        FUZZ_EXPECT(d->adr[k] < d->adr[k + 1] && isfinite(d->score[k]));
    for (int i = 0; i < d->nstep; ++i) {
        FUZZ_EXPECT(isfinite(d->reward[i]));
        for (int k = 0; k < d->nobservation; ++k)
            FUZZ_EXPECT(isfinite(d->obs[(ptrdiff_t)i * d->nobservation + k]));
        for (int k = 0; k < d->naction; ++k) {
            int a = d->action[(ptrdiff_t)i * d->naction + k];
            FUZZ_EXPECT(a >= 0 && a < d->nchoice[k] && d->nchoice[k] <= OM_RL_MAX_CHOICE);
        }
    }
}

static void parse(const uint8_t* data, size_t size) {
    OmRlDemos demos;
    if (size > 0 && data[0] == 0x89) return;  // HDF5 without our head
    OmStatus status = om_rl_demos_parse((const char*)data, size, "fuzz", &demos);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK)
        check(&demos);
    else
        FUZZ_EXPECT(demos.obs == NULL && om_error_message()[0] != '\0');
    om_rl_demos_done(&demos);
}

// CHANGE bytes: which value, and its bits.
static void change(const uint8_t* at, OmRlDemos* d) {
    int whole;
    float single;
    double real;
    memcpy(&whole, at + 1, sizeof whole);
    memcpy(&single, at + 1, sizeof single);
    memcpy(&real, at + 1, sizeof real);
    const ptrdiff_t place = (at[5] | at[6] << 8) % d->nstep;
    switch (at[0] % 6) {
    case 0: d->obs[place * d->nobservation + at[7] % d->nobservation] = single; break;
    case 1: d->action[place * d->naction + at[7] % d->naction] = whole; break;
    case 2: d->reward[(at[7] | at[8] << 8) % d->nstep] = real; break;
    case 3: d->score[at[8] % d->ndemo] = real; break;
    case 4: d->nchoice[at[5] % OM_RL_MAX_ACTION] = whole; break;
    default: d->task[at[5] % (OM_RL_NAME - 1)] = (char)at[1];
    }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (!good.obs) make_good();
    const size_t num = size / CHANGE < 8 ? size / CHANGE : 8;
    parse(data, size);
    if (fuzz_is_known(data, num, CHANGE)) return 0;
    OmRlDemos d = good;  // a copy to change
    const size_t n = (size_t)d.nstep, nobs = n * (size_t)d.nobservation;
    d.obs = om_alloc(nobs, sizeof *d.obs);
    d.action = om_alloc(n * (size_t)d.naction, sizeof *d.action);
    d.reward = om_alloc(n, sizeof *d.reward);
    d.score = om_alloc((size_t)d.ndemo, sizeof *d.score);
    memcpy(d.obs, good.obs, nobs * sizeof *d.obs);
    memcpy(d.action, good.action, n * (size_t)d.naction * sizeof *d.action);
    memcpy(d.reward, good.reward, n * sizeof *d.reward);
    memcpy(d.score, good.score, (size_t)d.ndemo * sizeof *d.score);
    for (size_t at = 0; at < CHANGE * num; at += CHANGE) change(data + at, &d);
    const char* path = fuzz_file((const uint8_t*)"", 0, ".hdf5");
    FUZZ_EXPECT(om_rl_demos_save(&d, path) == OM_OK);
    fuzz_file_again(path, parse);
    om_free(d.obs);
    om_free(d.action);
    om_free(d.reward);
    om_free(d.score);
    return 0;
}
