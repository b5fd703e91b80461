// fuzz_umesh_shard.c: the reader of U-Mesh samples.
//
// Unchanged bytes seldom pass the checksum, behind which HDF5 reads; its library is not ours to fuzz, and dies
// of forged files. So the same bytes also say which values of a good set become what, before it is written: what
// HDF5 then reads faithfully must be refused, or be a set that holds together.
#include "fuzz_common.h"
#include "umesh/umesh_internal.h"

#define NSAMPLE 2
#define CHANGE 9  // bytes of one change

static OmUmeshOrgan* organ;
static OmUmeshShard good;

static void make_good(void) {
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    def.spacing = 0.03;
    def.multiple = 1;
    def.dim[0] = def.dim[1] = def.dim[2] = 0;
    FUZZ_EXPECT(om_umesh_organ_create(&def, &organ) == OM_OK);
    size_t nnode = (size_t)om_umesh_organ_grid(organ)->fem.mesh.nnode;
    FUZZ_EXPECT(om__umesh_shard_alloc((int)nnode, NSAMPLE, &good) == OM_OK);
    memset(good.mask, 0, NSAMPLE * nnode);
    for (size_t i = 0; i < 3 * NSAMPLE * nnode; ++i) good.u[i] = 0.001f * (float)(i % 7);
}

static void check(const OmUmeshGrid* g, const OmUmeshShard* s) {
    FUZZ_EXPECT(g->fem.grid.spacing > 0 && om_is_finite3(g->fem.grid.origin) &&
                om_is_finite3(g->up));
    FUZZ_EXPECT(om_fem_mesh_validate(&g->fem.mesh) == OM_OK);
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        FUZZ_EXPECT(g->fem.point_node[g->fem.node_point[i]] == i);
    FUZZ_EXPECT(s->num >= 1 && s->first >= 0);
    for (int i = 0; i < 3 * s->num * g->fem.mesh.nnode; ++i) FUZZ_EXPECT(isfinite(s->u[i]));
    for (int i = 0; i < s->num * g->fem.mesh.nnode; ++i) FUZZ_EXPECT(s->mask[i] <= 1);
}

static void parse(const uint8_t* data, size_t size) {
    OmUmeshGrid grid;
    OmUmeshShard shard;
    OmStatus status = om__umesh_shard_parse((const char*)data, size, "fuzz", &grid, &shard);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK)
        check(&grid, &shard);
    else
        FUZZ_EXPECT(grid.fem.mesh.x == NULL && shard.u == NULL && om_error_message()[0] != '\0');
    om_umesh_grid_done(&grid);
    om__umesh_shard_done(&shard);
}

// CHANGE bytes: which value, and its bits.
static void change(const uint8_t* at, OmUmeshGrid* g, OmUmeshShard* s) {
    int whole;
    double real;
    memcpy(&whole, at + 1, sizeof whole);
    memcpy(&real, at + 1, sizeof real);
    size_t place = (size_t)whole;
    switch (at[0] % 12) {
    case 0: g->fem.grid.spacing = real; break;
    case 1: g->fem.grid.origin.x = real; break;
    case 2: g->up.y = real; break;
    case 3: g->fem.grid.dim[at[5] % 3] = whole; break;
    case 4: g->fem.cell_elem[place % (size_t)g->fem.npoint] = at[6] % 2 ? 0 : -1; break;
    case 5: g->fem.fixed[place % (size_t)g->fem.mesh.nnode] = at[6]; break;
    case 6: g->surface_x[at[1] % (3 * g->fem.mesh.nnode)] = real; break;
    case 7: s->first = whole; break;
    case 8: s->sample[at[5] % NSAMPLE].patch.center.z = real; break;
    case 9: s->sample[at[5] % NSAMPLE].npatch = whole; break;
    case 10: memcpy(&s->u[at[5] % (3 * g->fem.mesh.nnode)], at + 1, sizeof(float)); break;
    default: s->mask[at[5] % g->fem.mesh.nnode] = at[6];
    }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (!organ) make_good();
    const size_t num = size / CHANGE < 8 ? size / CHANGE : 8;
    parse(data, size);
    if (fuzz_is_known(data, num, CHANGE)) return 0;
    // a copy to change
    const OmUmeshGrid* from = om_umesh_organ_grid(organ);
    OmUmeshGrid g = *from;
    size_t nnode = (size_t)g.fem.mesh.nnode, npoint = (size_t)g.fem.npoint;
    OmUmeshShard s = {.num = NSAMPLE, .seed = 1};
    g.fem.cell_elem = malloc(npoint * sizeof(int));
    g.fem.fixed = malloc(nnode);
    g.surface_x = malloc(3 * nnode * sizeof(double));
    s.sample = malloc(NSAMPLE * sizeof *s.sample);
    s.mask = malloc(NSAMPLE * nnode);
    s.u = malloc(3 * NSAMPLE * nnode * sizeof(float));
    memcpy(g.fem.cell_elem, from->fem.cell_elem, npoint * sizeof(int));
    memcpy(g.fem.fixed, from->fem.fixed, nnode);
    memcpy(g.surface_x, from->surface_x, 3 * nnode * sizeof(double));
    memcpy(s.sample, good.sample, NSAMPLE * sizeof *s.sample);
    memcpy(s.mask, good.mask, NSAMPLE * nnode);
    memcpy(s.u, good.u, 3 * NSAMPLE * nnode * sizeof(float));
    for (size_t at = 0; at < CHANGE * num; at += CHANGE) change(data + at, &g, &s);
    OmUmeshDataDef def = om_umesh_data_default_def(organ, "");
    const char* path = fuzz_file((const uint8_t*)"", 0, ".h5");
    FUZZ_EXPECT(om__umesh_shard_save(&s, &g, &def, path) == OM_OK);
    fuzz_file_again(path, parse);
    free(g.fem.cell_elem);
    free(g.fem.fixed);
    free(g.surface_x);
    free(s.sample);
    free(s.mask);
    free(s.u);
    return 0;
}
