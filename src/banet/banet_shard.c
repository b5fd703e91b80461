// banet_shard.c: files of samples (nn_store.c).
//
//     sample/*    facts and grid of each sample, and the number of its cells
//     cell/step   cells of all samples, one after the other: difference of the index to the cell before
//     cell/kind   bits
//     cell/value  OM_BANET_NCHANNEL rows in 1 / OM_BANET_UNIT: difference to the cell before
//
// Differences compress better than values: neighbouring cells are alike.
#include <stdlib.h>
#include <string.h>

#include "banet/banet_data_internal.h"
#include "banet/banet_net_internal.h"
#include "omentum/nn_store.h"

#define KIND "omentum banet"
#define FORMAT 1
#define MAX_BYTES ((size_t)4 << 30)
#define MAX_CELL (1 << 28)  // of a shard
#define MAX_DIM 512

// What the file has of a sample besides its cells.
typedef struct Record {
    OmBanetFacts fact;
    OmBanetGrid grid;
    int ncell;
} Record;

#define REAL(name, unit) \
    { #name, unit, offsetof(Record, fact.name), OM_STORE_F64, 1 }
#define WHOLE(name) \
    { #name, NULL, offsetof(Record, fact.name), OM_STORE_I32, 1 }
static const OmStoreField field[] = {
    WHOLE(index),
    WHOLE(is_camera),
    WHOLE(has_board),
    WHOLE(nregion),
    WHOLE(nvert),
    WHOLE(ntet),
    WHOLE(nsurface),
    WHOLE(nattached),
    WHOLE(nattempt),
    WHOLE(nfail),
    REAL(young, "Pa"),
    REAL(poisson, "1"),
    REAL(force, "N"),
    REAL(share, "1"),
    REAL(visible, "1"),
    REAL(max_u, "m"),
    REAL(min_volume, "1"),
    REAL(residual, "1"),
    {"origin", "m", offsetof(Record, grid.pose_world_grid.p), OM_STORE_F64, 3},
    {"rotation", "quaternion x y z w", offsetof(Record, grid.pose_world_grid.q), OM_STORE_F64, 4},
    {"voxel", "m", offsetof(Record, grid.voxel), OM_STORE_F64, 1},
    {"dim", NULL, offsetof(Record, grid.dim), OM_STORE_I32, 3},
    {"ncell", NULL, offsetof(Record, ncell), OM_STORE_I32, 1},
};
#define NFIELD ((int)(sizeof field / sizeof *field))

OmStatus om__banet_shard_alloc(int num, OmBanetShard* s) {
    *s = (OmBanetShard){0};
    s->sample = om_calloc((size_t)num, sizeof *s->sample);
    if (!s->sample) return OM_NO_MEMORY;
    s->num = num;
    return OM_OK;
}

void om__banet_shard_done(OmBanetShard* s) {
    for (int i = 0; i < s->num; ++i) om_banet_cells_done(&s->sample[i]);
    om_free(s->sample);
    *s = (OmBanetShard){0};
}

// ---- cells of all samples, one after the other ------------------------------------------------------

typedef struct Cells {
    int ncell;
    int* step;            // (ncell)
    unsigned char* kind;  // (ncell)
    int16_t* value;       // (OM_BANET_NCHANNEL x ncell)
} Cells;

static void cells_done(Cells* c) {
    om_free(c->step);
    om_free(c->kind);
    om_free(c->value);
    *c = (Cells){0};
}

static OmStatus cells_alloc(int ncell, Cells* c) {
    OmStatus status = OM_OK;
    *c = (Cells){.ncell = ncell};
    OM_ALLOC_DONE(c->step, ncell);
    OM_ALLOC_DONE(c->kind, ncell);
    OM_ALLOC_DONE(c->value, OM_BANET_NCHANNEL * (size_t)ncell);
done:
    if (status < 0) cells_done(c);
    return status;
}

// Differences, modulo 2^16 for values.
static void join(const OmBanetShard* s, Cells* all) {
    size_t at = 0, n = (size_t)all->ncell;
    for (int i = 0; i < s->num; ++i) {
        const OmBanetCells* c = &s->sample[i];
        const size_t num = (size_t)c->ncell;
        for (size_t k = 0; k < num; ++k) {
            all->step[at + k] =
                (int)((unsigned)c->cell[k] - (unsigned)(k > 0 ? c->cell[k - 1] : 0));
            all->kind[at + k] = c->kind[k];
        }
        for (size_t m = 0; m < OM_BANET_NCHANNEL; ++m) {
            const int16_t* from = c->value + m * num;
            int16_t* to = all->value + m * n + at;
            for (size_t k = 0; k < num; ++k)
                to[k] =
                    (int16_t)(uint16_t)((unsigned)from[k] - (unsigned)(k > 0 ? from[k - 1] : 0));
        }
        at += num;
    }
}

// Cells at .. at + ncell of all into a sample.
static OmStatus split(const Cells* all, size_t at, const char* name, OmBanetCells* c) {
    const size_t num = (size_t)c->ncell, n = (size_t)all->ncell;
    const int64_t end = (int64_t)om_grid_count(c->grid.dim);
    OM_ALLOC(c->cell, num);
    OM_ALLOC(c->kind, num);
    OM_ALLOC(c->value, OM_BANET_NCHANNEL * num);
    int64_t cell = 0;
    for (size_t k = 0; k < num; ++k) {
        const int step = all->step[at + k];
        cell += step;
        OM_CHECK(step >= (k > 0) && cell < end && all->kind[at + k] <= 7, OM_INVALID,
                 "%s: cell %zu of sample %d is out of order, out of its grid or of no kind", name,
                 k, c->fact.index);
        c->cell[k] = (int)cell;
        c->kind[k] = all->kind[at + k];
    }
    for (size_t m = 0; m < OM_BANET_NCHANNEL; ++m) {
        uint16_t value = 0;
        const int limit = m == OM_BANET_DISTANCE ? (int)OM_BANET_CLIP * OM_BANET_UNIT
                          : m == OM_BANET_SEEN   ? OM_BANET_UNIT
                                                 : INT16_MAX;
        for (size_t k = 0; k < num; ++k) {
            value = (uint16_t)(value + (uint16_t)all->value[m * n + at + k]);
            const int v = (int16_t)value;
            OM_CHECK(abs(v) <= limit && (m != OM_BANET_SEEN || v >= 0), OM_INVALID,
                     "%s: channel %zu of sample %d has the value %d", name, m, c->fact.index, v);
            c->value[m * num + k] = (int16_t)v;
        }
    }
    return OM_OK;
}

// ---- writing ----------------------------------------------------------------------------------------

static void put_settings(OmStoreWriter* w, const OmBanetShard* s, const OmBanetSampleDef* d) {
    const struct {
        const char* name;
        const double* value;
        int n;
    } number[] = {{"extent_m", d->extent, 2},      {"thickness_m", d->thickness, 2},
                  {"share", d->share, 2},          {"visible", d->visible, 2},
                  {"two_share", &d->two_share, 1}, {"board_share", &d->board_share, 1},
                  {"young_Pa", d->young, 2},       {"poisson", d->poisson, 2},
                  {"radius_m", d->radius, 2}};
    char generator[OM_BANET_ORIGIN];
    om__banet_generator_name(generator);
    // a copy of a part states the generator that made it
    om_store_text(w, "generator", s->generator[0] ? s->generator : generator);
    om_store_text(w, "way", om_banet_way_name(d->way));
    om_store_text(w, "law", om_law_name(d->law));
    om_store_text(w, "element", om_element_name(d->element));
    om_store_value(w, "seed", OM_STORE_U64, 0, &s->seed);
    om_store_value(w, "hash", OM_STORE_U64, 0, &s->hash);
    om_store_value(w, "first", OM_STORE_I32, 0, &s->first);
    om_store_value(w, "num", OM_STORE_I32, 0, &s->num);
    om_store_value(w, "side_m", OM_STORE_F64, 0, &s->side);
    for (size_t k = 0; k < sizeof number / sizeof *number; ++k)
        om_store_value(w, number[k].name, OM_STORE_F64, number[k].n, number[k].value);
}

OmStatus om__banet_shard_save(const OmBanetShard* s, const OmBanetSampleDef* def,
                              const char* path) {
    OmStatus status = OM_OK;
    OmStoreWriter* w = NULL;
    Record* record = NULL;
    Cells all = {0};
    int64_t ncell = 0;
    for (int i = 0; i < s->num; ++i) ncell += s->sample[i].ncell;
    OM_CHECK(ncell <= MAX_CELL, OM_INVALID, "%s: too many cells; take fewer samples a file", path);
    OM_CALLOC_DONE(record, s->num);
    OM_TRY_DONE(cells_alloc((int)ncell, &all));
    join(s, &all);
    for (int i = 0; i < s->num; ++i)
        record[i] = (Record){s->sample[i].fact, s->sample[i].grid, s->sample[i].ncell};
    OM_TRY_DONE(om_store_begin(KIND, FORMAT, &w));
    put_settings(w, s, def);
    om_store_group(w, "sample");
    om_store_group(w, "cell");
    om_store_records(w, "sample", field, NFIELD, record, sizeof *record, s->num);
    const int n = all.ncell;
    om_store_array(w, "cell/step", OM_STORE_I32, (int[3]){n}, n, NULL, all.step);
    om_store_array(w, "cell/kind", OM_STORE_U8, (int[3]){n}, n, NULL, all.kind);
    om_store_array(w, "cell/value", OM_STORE_I16, (int[3]){OM_BANET_NCHANNEL, n}, 1, "voxel/256",
                   all.value);
    status = om_store_save(w, path);
done:
    cells_done(&all);
    om_free(record);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

// Into the sample, if grid and facts can be true.
static OmStatus take_record(const Record* r, int index, double side, const char* name,
                            OmBanetCells* c) {
    const OmBanetGrid* g = &r->grid;
    const OmQuat q = g->pose_world_grid.q;
    double n = 1;
    bool is_good = r->fact.index == index && r->ncell > 0;
    for (int k = 0; k < 3; ++k) {
        is_good = is_good && g->dim[k] >= OM_BANET_MULTIPLE && g->dim[k] <= MAX_DIM &&
                  g->dim[k] % OM_BANET_MULTIPLE == 0;
        n *= g->dim[k];
    }
    is_good =
        is_good && r->ncell <= n && fabs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 1e-6;
    is_good = is_good && fabs(g->voxel * OM_BANET_SIDE_CELL - side) <= 1e-9 * side;
    OM_CHECK(is_good, OM_INVALID, "%s: the record of sample %d cannot be right", name, index);
    c->fact = r->fact;
    c->grid = r->grid;
    c->ncell = r->ncell;
    return OM_OK;
}

static OmStatus get_head(const OmStoreReader* r, const char* name, OmBanetShard* s) {
    int num;
    int first;
    OM_TRY(om_store_get_value(r, "num", OM_STORE_I32, 1, &num));
    OM_TRY(om_store_get_value(r, "first", OM_STORE_I32, 1, &first));
    OM_CHECK(num >= 1 && num <= 10000 && first >= 0 && first <= INT32_MAX - num, OM_INVALID,
             "%s: %d samples from %d on", name, num, first);
    OM_TRY(om__banet_shard_alloc(num, s));
    s->first = first;
    OM_TRY(om_store_get_value(r, "seed", OM_STORE_U64, 1, &s->seed));
    OM_TRY(om_store_get_value(r, "hash", OM_STORE_U64, 1, &s->hash));
    OM_TRY(om_store_get_value(r, "side_m", OM_STORE_F64, 1, &s->side));
    OM_CHECK(s->side > 0, OM_INVALID, "%s: a grid with a side of %g m", name, s->side);
    OM_TRY(om_store_get_text(r, "generator", s->generator, sizeof s->generator));
    OM_TRY(om_store_get_text(r, "way", s->way, sizeof s->way));
    OM_TRY(om_store_get_text(r, "law", s->law, sizeof s->law));
    OM_TRY(om_store_get_text(r, "element", s->element, sizeof s->element));
    // in words; there were only linear ones when it was not stated
    const bool is_quadratic = strcmp(s->element, om_element_name(OM_TET10)) == 0;
    snprintf(s->element, sizeof s->element, "%s", is_quadratic ? "quadratic" : "linear");
    return OM_OK;
}

static OmStatus get_samples(const OmStoreReader* r, const char* name, OmBanetShard* s) {
    OmStatus status = OM_OK;
    Record* record = NULL;
    Cells all = {0};
    int64_t ncell = 0;
    size_t at = 0;
    OM_TRY(get_head(r, name, s));
    OM_CALLOC_DONE(record, s->num);
    OM_TRY_DONE(om_store_get_records(r, "sample", field, NFIELD, record, sizeof *record, s->num));
    for (int i = 0; i < s->num; ++i) {
        OM_TRY_DONE(take_record(&record[i], s->first + i, s->side, name, &s->sample[i]));
        ncell += record[i].ncell;
    }
    OM_CHECK_DONE(ncell <= MAX_CELL, OM_INVALID, "%s: too many cells", name);
    const int n = (int)ncell, extent[3] = {OM_BANET_NCHANNEL, n};
    OM_TRY_DONE(om_store_check_array(r, "cell/value", extent));  // before memory is allocated
    OM_TRY_DONE(cells_alloc(n, &all));
    OM_TRY_DONE(om_store_get_array(r, "cell/step", OM_STORE_I32, (int[3]){n}, all.step));
    OM_TRY_DONE(om_store_get_array(r, "cell/kind", OM_STORE_U8, (int[3]){n}, all.kind));
    OM_TRY_DONE(om_store_get_array(r, "cell/value", OM_STORE_I16, extent, all.value));
    for (int i = 0; i < s->num; ++i) {
        OM_TRY_DONE(split(&all, at, name, &s->sample[i]));
        at += (size_t)s->sample[i].ncell;
    }
done:
    cells_done(&all);
    om_free(record);
    return status;
}

OmStatus om__banet_shard_parse(const char* data, size_t size, const char* name, OmBanetShard* s) {
    OmStoreReader* r;
    *s = (OmBanetShard){0};
    OM_TRY(om_store_open(data, size, KIND, FORMAT, name, &r));
    OmStatus status = get_samples(r, name, s);
    if (status < 0) om__banet_shard_done(s);
    om_store_close(r);
    return status;
}

OmStatus om__banet_shard_load(const char* path, OmBanetShard* s) {
    char* data;
    size_t size;
    *s = (OmBanetShard){0};
    OM_TRY(om_file_read(path, MAX_BYTES, &data, &size));
    OmStatus status = om__banet_shard_parse(data, size, path, s);
    om_free(data);
    return status;
}
