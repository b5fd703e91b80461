// fuzz_banet_shard.c: the reader of BA-Net samples.
//
// Unchanged bytes seldom pass the checksum, behind which HDF5 reads; its library is not ours to fuzz. So the same
// bytes also change values of a good shard before it is written. The reader must refuse the file, or return samples
// that fit into their grids.
#include "banet/banet_data_internal.h"
#include "fuzz_common.h"

#define NSAMPLE 2
#define CHANGE 9  // bytes of one change
#define SIDE 0.3

static OmBanetShard good;

static void make_cells(int index, OmBanetCells* cells) {
    OmBanetSample s = {.index = index, .nregion = 1};
    FUZZ_EXPECT(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.02, 0.015, 0.005), 4, 3, 1, &s.mesh) ==
                OM_OK);
    FUZZ_EXPECT(om_tet_mesh_boundary(&s.mesh, &s.surface, &s.surface_vert) == OM_OK);
    const size_t n = (size_t)s.surface.nvert;
    s.attached = om_calloc(n, 1);
    s.grasped = om_calloc(n, 1);
    s.u = om_calloc(3 * n, sizeof *s.u);
    s.seen = om_calloc(n, sizeof *s.seen);
    for (size_t i = 0; i < n; ++i) {
        s.attached[i] = i % 3 == 0;
        s.seen[i] = 0.25 * (double)(i % 5);
        s.u[3 * i] = 0.001 * (double)(i % 7);
    }
    FUZZ_EXPECT(om_banet_cells_make(&s, SIDE, cells) == OM_OK);
    om_banet_sample_done(&s);
}

static void make_good(OmBanetShard* s) {
    FUZZ_EXPECT(om__banet_shard_alloc(NSAMPLE, s) == OM_OK);
    s->seed = 1, s->side = SIDE;
    for (int i = 0; i < NSAMPLE; ++i) make_cells(i, &s->sample[i]);
}

static void check(const OmBanetShard* s) {
    static float in[OM_BANET_NCHANNEL << 14];
    FUZZ_EXPECT(s->num >= 1 && s->first >= 0 && s->side > 0);
    for (int i = 0; i < s->num; ++i) {
        const OmBanetCells* c = &s->sample[i];
        const size_t n = om_grid_count(c->grid.dim);
        FUZZ_EXPECT(c->ncell > 0 && (size_t)c->ncell <= n && c->fact.index == s->first + i);
        FUZZ_EXPECT(isfinite(c->fact.young) && isfinite(c->grid.pose_world_grid.p.x));
        for (int k = 0; k < c->ncell; ++k)
            FUZZ_EXPECT(c->cell[k] >= 0 && (size_t)c->cell[k] < n && c->kind[k] <= 7);
        if (n > (size_t)1 << 14) continue;
        FUZZ_EXPECT(om_banet_cells_expand(c, c->grid.dim, NULL, 0, in, NULL, NULL) == OM_OK);
        for (size_t k = 0; k < OM_BANET_NCHANNEL * n; ++k) FUZZ_EXPECT(isfinite(in[k]));
    }
}

static void parse(const uint8_t* data, size_t size) {
    OmBanetShard shard;
    OmStatus status = om__banet_shard_parse((const char*)data, size, "fuzz", &shard);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK)
        check(&shard);
    else
        FUZZ_EXPECT(shard.sample == NULL && om_error_message()[0] != '\0');
    om__banet_shard_done(&shard);
}

// CHANGE bytes: which value, and its bits.
static void change(const uint8_t* at, OmBanetShard* s) {
    int whole;
    double real;
    memcpy(&whole, at + 1, sizeof whole);
    memcpy(&real, at + 1, sizeof real);
    OmBanetCells* c = &s->sample[at[8] % NSAMPLE];
    const size_t place = (size_t)(at[5] | at[6] << 8) % (size_t)c->ncell;
    switch (at[0] % 11) {
    case 0: c->grid.voxel = real; break;
    case 1: c->grid.dim[at[5] % 3] = whole; break;
    case 2: c->grid.pose_world_grid.q.y = real; break;
    case 3: c->grid.pose_world_grid.p.z = real; break;
    case 4: c->cell[place] = whole; break;
    case 5: c->kind[place] = at[1]; break;
    case 6:
        c->value[(at[7] % OM_BANET_NCHANNEL) * (size_t)c->ncell + place] = (int16_t)whole;
        break;
    case 7: s->first = whole; break;
    case 8: c->fact.index = whole; break;
    case 9: c->fact.young = real; break;
    default: s->side = real;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmBanetShard s;
    OmBanetSampleDef def = om_banet_sample_default_def(1);
    if (!good.sample) make_good(&good);
    const size_t num = size / CHANGE < 8 ? size / CHANGE : 8;
    parse(data, size);
    if (fuzz_is_known(data, num, CHANGE)) return 0;
    // a copy to change
    FUZZ_EXPECT(om__banet_shard_alloc(NSAMPLE, &s) == OM_OK);
    s.first = good.first, s.seed = good.seed, s.hash = good.hash, s.side = good.side;
    for (int i = 0; i < NSAMPLE; ++i) {
        const OmBanetCells* from = &good.sample[i];
        const size_t n = (size_t)from->ncell;
        OmBanetCells* to = &s.sample[i];
        *to = *from;
        to->cell = om_alloc(n, sizeof *to->cell);
        to->kind = om_alloc(n, 1);
        to->value = om_alloc(OM_BANET_NCHANNEL * n, sizeof *to->value);
        memcpy(to->cell, from->cell, n * sizeof *to->cell);
        memcpy(to->kind, from->kind, n);
        memcpy(to->value, from->value, OM_BANET_NCHANNEL * n * sizeof *to->value);
    }
    for (size_t at = 0; at < CHANGE * num; at += CHANGE) change(data + at, &s);
    const char* path = fuzz_file((const uint8_t*)"", 0, ".h5");
    FUZZ_EXPECT(om__banet_shard_save(&s, &def, path) == OM_OK);
    fuzz_file_again(path, parse);
    om__banet_shard_done(&s);
    return 0;
}
