// banet_data.c: a data set in memory.
#include <string.h>

#include "banet/banet_data_internal.h"
#include "omentum/nn_store.h"

// Move num samples to the end of the set.
static OmStatus append(OmBanetData* data, OmBanetCells* from, int num) {
    const size_t had = (size_t)data->nsample, n = (size_t)num;
    OmBanetCells* sample = om_realloc(data->sample, had, had + n, sizeof *sample);
    if (!sample) return OM_NO_MEMORY;
    data->sample = sample;
    memcpy(sample + had, from, n * sizeof *sample);
    memset(from, 0, n * sizeof *sample);
    data->nsample += num;
    return OM_OK;
}

static void take_head(const OmBanetShard* shard, OmBanetData* data) {
    data->seed = shard->seed;
    data->hash = shard->hash;
    data->side = shard->side;
    memcpy(data->generator, shard->generator, sizeof data->generator);
    memcpy(data->way, shard->way, sizeof data->way);
    memcpy(data->law, shard->law, sizeof data->law);
    memcpy(data->element, shard->element, sizeof data->element);
}

static OmStatus load_all(const char* dir, int max_sample, OmBanetData* data) {
    int first, last;
    om_store_shard_range(dir, &first, &last);
    OM_CHECK(first >= 0, OM_INVALID,
             "%s: no file of samples (samples_000000.h5) is there; make some with omentum banet "
             "generate",
             dir);
    data->first = first;
    for (int next = first; next <= last && (max_sample == 0 || data->nsample < max_sample);) {
        char path[1024];
        OmBanetShard shard;
        OM_TRY(om_store_shard_path(dir, next, path, sizeof path));
        OM_CHECK(om_path_exists(path), OM_INVALID,
                 "%s is missing; the command that made the set makes it again", path);
        OM_TRY(om__banet_shard_load(path, &shard));
        if (next == first) take_head(&shard, data);
        int num = shard.num;
        if (max_sample > 0 && num > max_sample - data->nsample) num = max_sample - data->nsample;
        OmStatus status = OM_OK;
        if (data->hash != shard.hash || data->side != shard.side || shard.first != next)
            status = om_error(OM_INVALID, "%s: not of the same set as the files before it", path);
        if (status == OM_OK) status = append(data, shard.sample, num);
        next += shard.num;
        om__banet_shard_done(&shard);
        OM_TRY(status);
    }
    return OM_OK;
}

OmStatus om_banet_data_load(const char* dir, int max_sample, OmBanetData* data) {
    *data = (OmBanetData){0};
    OM_CHECK(max_sample >= 0, OM_INVALID, "om_banet_data_load: max_sample = %d", max_sample);
    OmStatus status = load_all(dir, max_sample, data);
    if (status < 0) om_banet_data_done(data);
    return status;
}

OmStatus om_banet_data_join(OmBanetData* data, OmBanetData* more) {
    OM_CHECK(data->nsample > 0 && more->nsample > 0, OM_INVALID, "om_banet_data_join: no samples");
    OM_CHECK(data->hash == more->hash && data->side == more->side, OM_INVALID,
             "om_banet_data_join: the two parts are of sets with other seeds or settings");
    const int last = data->sample[data->nsample - 1].fact.index;
    OM_CHECK(
        more->sample[0].fact.index > last, OM_INVALID,
        "om_banet_data_join: the second part begins with sample %d, the first one ends with %d",
        more->sample[0].fact.index, last);
    OM_TRY(append(data, more->sample, more->nsample));
    more->nsample = 0;
    om_banet_data_done(more);
    return OM_OK;
}

void om_banet_data_done(OmBanetData* data) {
    if (!data) return;
    for (int i = 0; i < data->nsample; ++i) om_banet_cells_done(&data->sample[i]);
    om_free(data->sample);
    *data = (OmBanetData){0};
}
