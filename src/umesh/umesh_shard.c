// umesh_shard.c: files of samples (nn_store.c) with their grid.
#include <string.h>

#include "omentum/nn_store.h"
#include "umesh/umesh_internal.h"

#define MAX_BYTES ((size_t)4 << 30)
#define KIND "omentum umesh"
#define FORMAT 1
#define GENERATOR "omentum umesh 1"

OmStatus om__umesh_shard_alloc(int nnode, int num, OmUmeshShard* s) {
    OmStatus status = OM_OK;
    s->num = num;
    OM_CALLOC_DONE(s->sample, num);
    OM_ALLOC_DONE(s->mask, (size_t)num * (size_t)nnode);
    OM_ALLOC_DONE(s->u, 3 * (size_t)num * (size_t)nnode);
done:
    if (status < 0) om__umesh_shard_done(s);
    return status;
}

void om__umesh_shard_done(OmUmeshShard* s) {
    om_free(s->sample);
    om_free(s->mask);
    om_free(s->u);
    *s = (OmUmeshShard){0};
}

// ---- writing ----------------------------------------------------------------------------------------

#define REAL(name, unit, member, n) \
    { name, unit, offsetof(OmUmeshSample, member), OM_STORE_F64, n }
#define WHOLE(name) \
    { #name, "1", offsetof(OmUmeshSample, name), OM_STORE_I32, 1 }
static const OmStoreField field_table[] = {
    REAL("center", "m", patch.center, 3),
    REAL("normal", "1", patch.normal, 3),
    REAL("along", "1", patch.along, 3),
    REAL("size", "m", patch.size, 3),
    REAL("force", "N", force, 3),
    REAL("direction", "1", direction, 3),
    REAL("tilt", "rad", tilt, 1),
    REAL("press", "m", press, 1),
    REAL("residual", "1", residual, 1),
    REAL("min_volume", "1", min_volume, 1),
    REAL("max_u", "m", max_u, 1),
    WHOLE(npatch),
    WHOLE(nattempt),
    WHOLE(nfail),
    WHOLE(nnewton),
};
#define NFIELD ((int)(sizeof field_table / sizeof *field_table))

static void put_settings(OmStoreWriter* w, const OmUmeshShard* s, const OmUmeshGrid* g,
                         const OmUmeshDataDef* def) {
    const double where[6] = {g->fem.grid.origin.x,
                             g->fem.grid.origin.y,
                             g->fem.grid.origin.z,
                             g->up.x,
                             g->up.y,
                             g->up.z};
    const struct {
        const char* name;
        double value;
    } number[] = {{"spacing_m", g->fem.grid.spacing}, {"young_Pa", def->material.young},
                  {"poisson", def->material.poisson}, {"max_force_N", def->max_force},
                  {"max_tilt_rad", def->max_tilt},    {"press_share", def->press_share},
                  {"max_press_m", def->max_press},    {"pull_share", def->pull_share},
                  {"tolerance", def->tolerance},      {"min_volume", def->min_volume}};
    int format = FORMAT;
    om_store_text(w, "generator", GENERATOR);
    om_store_text(w, "law", om_law_name(def->material.law));
    om_store_value(w, "format", OM_STORE_I32, 0, &format);
    om_store_value(w, "seed", OM_STORE_U64, 0, &s->seed);
    om_store_value(w, "hash", OM_STORE_U64, 0, &s->hash);
    om_store_value(w, "first", OM_STORE_I32, 0, &s->first);
    om_store_value(w, "num", OM_STORE_I32, 0, &s->num);
    om_store_value(w, "dim", OM_STORE_I32, 3, g->fem.grid.dim);
    om_store_value(w, "origin_m", OM_STORE_F64, 3, where);
    om_store_value(w, "up", OM_STORE_F64, 3, where + 3);
    for (size_t k = 0; k < sizeof number / sizeof *number; ++k)
        om_store_value(w, number[k].name, OM_STORE_F64, 0, &number[k].value);
}

static OmStatus put_all(OmStoreWriter* w, const OmUmeshShard* s, const OmUmeshGrid* g,
                        const OmUmeshDataDef* def) {
    const int nnode = g->fem.mesh.nnode, num = s->num, npoint = g->fem.npoint;
    unsigned char* active = om_alloc((size_t)npoint, 1);
    if (!active) return OM_NO_MEMORY;
    for (int p = 0; p < npoint; ++p) active[p] = g->fem.cell_elem[p] >= 0;
    om_store_group(w, "grid");
    om_store_group(w, "sample");
    put_settings(w, s, g, def);
    om_store_array(w, "grid/active", OM_STORE_U8, (int[3]){npoint}, npoint, NULL, active);
    om_store_array(w, "grid/fixed", OM_STORE_U8, (int[3]){nnode}, nnode, NULL, g->fem.fixed);
    om_store_array(w, "grid/skin_x", OM_STORE_F64, (int[3]){nnode, 3}, nnode, "m", g->surface_x);
    om_store_records(w, "sample", field_table, NFIELD, s->sample, sizeof *s->sample, num);
    om_store_array(w, "sample/mask", OM_STORE_U8, (int[3]){num, nnode}, num, NULL, s->mask);
    om_store_array(w, "sample/u", OM_STORE_F32, (int[3]){num, nnode, 3}, 1, "m", s->u);
    om_free(active);
    return OM_OK;
}

OmStatus om__umesh_shard_save(const OmUmeshShard* s, const OmUmeshGrid* g,
                              const OmUmeshDataDef* def, const char* path) {
    OmStoreWriter* w;
    OM_TRY(om_store_begin(KIND, FORMAT, &w));
    OmStatus status = put_all(w, s, g, def);
    if (status == OM_OK) return om_store_save(w, path);
    om_store_abort(w);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

static OmStatus get_frame(const OmStoreReader* r, const char* file, OmGrid* f, OmVec3* up) {
    double origin[3], direction[3], total = 1;
    OM_TRY(om_store_get_value(r, "dim", OM_STORE_I32, 3, f->dim));
    OM_TRY(om_store_get_value(r, "spacing_m", OM_STORE_F64, 1, &f->spacing));
    OM_TRY(om_store_get_value(r, "origin_m", OM_STORE_F64, 3, origin));
    OM_TRY(om_store_get_value(r, "up", OM_STORE_F64, 3, direction));
    for (int c = 0; c < 3; ++c) {
        OM_CHECK(f->dim[c] >= 2 && f->dim[c] <= OM__UMESH_MAX_POINT, OM_INVALID,
                 "%s: a grid of %d x %d x %d points", file, f->dim[0], f->dim[1], f->dim[2]);
        total *= f->dim[c];
    }
    OM_CHECK(total <= OM__UMESH_MAX_POINT, OM_INVALID,
             "%s: a grid of %d x %d x %d points is too large", file, f->dim[0], f->dim[1],
             f->dim[2]);
    OM_CHECK(f->spacing > 0 && isfinite(f->spacing), OM_INVALID, "%s: spacing %g m", file,
             f->spacing);
    f->origin = om_load3(origin, 0);
    *up = om_load3(direction, 0);
    return OM_OK;
}

static OmStatus get_grid(const OmStoreReader* r, const char* file, OmUmeshGrid* g) {
    OmGrid points = {0};
    OmVec3 up;
    OM_TRY(get_frame(r, file, &points, &up));
    const int npoint = (int)om_grid_count(points.dim);
    unsigned char* active = om_alloc((size_t)npoint, 1);
    if (!active) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_store_get_array(r, "grid/active", OM_STORE_U8, (int[3]){npoint}, active));
    status = om__umesh_grid_init(&points, up, active, g);
    if (status < 0) {
        om_error_prefix(status, "%s", file);
        goto done;
    }
    const int nnode = g->fem.mesh.nnode;
    OM_TRY_DONE(om_store_get_array(r, "grid/fixed", OM_STORE_U8, (int[3]){nnode}, g->fem.fixed));
    OM_TRY_DONE(
        om_store_get_array(r, "grid/skin_x", OM_STORE_F64, (int[3]){nnode, 3}, g->surface_x));
    for (int i = 0; i < nnode; ++i) g->fem.fixed[i] = g->fem.fixed[i] != 0;
    OM_TRY_DONE(om__umesh_grid_find_surface(g));
    g->hash = om__umesh_grid_hash(g);
done:
    om_free(active);
    if (status < 0) om_umesh_grid_done(g);
    return status;
}

static OmStatus get_samples(const OmStoreReader* r, const char* file, int nnode, OmUmeshShard* s) {
    int num = 0;
    OM_TRY(om_store_get_value(r, "seed", OM_STORE_U64, 1, &s->seed));
    OM_TRY(om_store_get_value(r, "hash", OM_STORE_U64, 1, &s->hash));
    OM_TRY(om_store_get_value(r, "first", OM_STORE_I32, 1, &s->first));
    OM_TRY(om_store_get_value(r, "num", OM_STORE_I32, 1, &num));
    OM_CHECK(num >= 1 && num <= 10000 && s->first >= 0, OM_INVALID, "%s: %d samples from %d on",
             file, num, s->first);
    const int extent[3] = {num, nnode, 3};
    OM_TRY(om_store_check_array(r, "sample/u", extent));  // before this much memory is allocated
    OmStatus status = OM_OK;
    OM_TRY(om__umesh_shard_alloc(nnode, num, s));
    OM_TRY_DONE(
        om_store_get_records(r, "sample", field_table, NFIELD, s->sample, sizeof *s->sample, num));
    OM_TRY_DONE(om_store_get_array(r, "sample/mask", OM_STORE_U8, (int[3]){num, nnode}, s->mask));
    OM_TRY_DONE(om_store_get_array(r, "sample/u", OM_STORE_F32, extent, s->u));
    for (size_t i = 0; i < (size_t)num * (size_t)nnode; ++i) s->mask[i] = s->mask[i] != 0;
done:
    if (status < 0) om__umesh_shard_done(s);
    return status;
}

OmStatus om__umesh_shard_parse(const char* data, size_t size, const char* name, OmUmeshGrid* grid,
                               OmUmeshShard* shard) {
    OmStoreReader* r;
    *grid = (OmUmeshGrid){0};
    *shard = (OmUmeshShard){0};
    OM_TRY(om_store_open(data, size, KIND, FORMAT, name, &r));
    OmStatus status = get_grid(r, name, grid);
    if (status == OM_OK) status = get_samples(r, name, grid->fem.mesh.nnode, shard);
    if (status < 0) om_umesh_grid_done(grid);
    om_store_close(r);
    return status;
}

OmStatus om__umesh_shard_load(const char* path, OmUmeshGrid* grid, OmUmeshShard* shard) {
    char* data;
    size_t size;
    *grid = (OmUmeshGrid){0};
    *shard = (OmUmeshShard){0};
    OM_TRY(om_file_read(path, MAX_BYTES, &data, &size));
    OmStatus status = om__umesh_shard_parse(data, size, path, grid, shard);
    om_free(data);
    return status;
}
