// banet_data_internal.h: files and reports of data sets.
#ifndef OMENTUM_BANET_DATA_INTERNAL_H
#define OMENTUM_BANET_DATA_INTERNAL_H

#include "omentum/banet_data.h"

// ---- banet_shard.c ----------------------------------------------------------------------------------

typedef struct OmBanetShard {  // samples first .. first + num - 1
    int first, num;
    uint64_t seed, hash;
    double side;
    char generator[OM_BANET_ORIGIN], way[OM_BANET_ORIGIN];  // read from the file; "": not stated
    char law[OM_BANET_ORIGIN], element[OM_BANET_ORIGIN];
    OmBanetCells* sample;  // (num)
} OmBanetShard;

OmStatus om__banet_shard_alloc(int num, OmBanetShard* shard);
void om__banet_shard_done(OmBanetShard* shard);
OmStatus om__banet_shard_save(const OmBanetShard* shard, const OmBanetSampleDef* def,
                              const char* path);
OmStatus om__banet_shard_load(const char* path, OmBanetShard* shard);
// Read a shard from bytes in memory; `name` is for messages.
OmStatus om__banet_shard_parse(const char* data, size_t size, const char* name,
                               OmBanetShard* shard);

// ---- banet_report.c ---------------------------------------------------------------------------------

OmStatus om__banet_write_report(const OmBanetDataDef* def, const OmBanetSummary* summary,
                                const OmBanetFacts* fact);

#endif
