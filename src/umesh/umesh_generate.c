// umesh_generate.c: the data set: shards of consecutive samples, computed in parallel, written and read.
//
// Shard k has the samples k S .. (k + 1) S - 1 (the last shard may have fewer) and is written when all of them are
// complete. Each worker has a solver and takes the next free index. A sample depends only on its index, so the data do
// not depend on the number of workers. Only the calling thread uses HDF5.
#include <stdatomic.h>
#include <string.h>

#include "omentum/nn_store.h"
#include "umesh/umesh_internal.h"

typedef struct Crew {        // of one shard
    OmUmeshSolver** solver;  // of each worker
    OmUmeshShard* shard;
    int nnode;
    int ndone_before;  // samples of earlier shards
    const OmProgress* progress;
    int nsample;
    double* u;                // displacements in double     (nworker x nnode x 3)
    atomic_int next, ndone;   // samples begun and finished
    atomic_int status;        // the first failure
    char message[512];        // of the failure
    atomic_flag is_reported;  // a worker has written the message
} Crew;

static void work(void* ctx, OmTeam* team, int rank, int size) {
    (void)team;
    (void)size;
    Crew* c = ctx;
    size_t nnode = (size_t)c->nnode;
    double* u = c->u + 3 * nnode * (size_t)rank;
    while (atomic_load(&c->status) == OM_OK) {
        int i = atomic_fetch_add(&c->next, 1);
        if (i >= c->shard->num) return;
        OmStatus status =
            om_umesh_sample_make(c->solver[rank], c->shard->first + i, &c->shard->sample[i],
                                 c->shard->mask + nnode * (size_t)i, u);
        float* to = c->shard->u + 3 * nnode * (size_t)i;
        for (size_t n = 0; n < 3 * nnode && status == OM_OK; ++n) to[n] = (float)u[n];
        int ndone = atomic_fetch_add(&c->ndone, 1) + 1;
        if (status == OM_OK && rank == 0)  // the caller's thread
            status =
                om_progress_report(c->progress, "samples", c->ndone_before + ndone, c->nsample);
        if (status != OM_OK && !atomic_flag_test_and_set(&c->is_reported)) {
            snprintf(c->message, sizeof c->message, "%s", om_error_message());
            atomic_store(&c->status, status);
        }
    }
}

static OmStatus make_shard(Crew* c, int nworker, OmUmeshShard* shard) {
    c->shard = shard;
    atomic_store(&c->next, 0);
    atomic_store(&c->ndone, 0);
    om_parallel_team(nworker, work, c);
    int status = atomic_load(&c->status);
    return status == OM_OK ? OM_OK : om_error((OmStatus)status, "%s", c->message);
}

// ---- shards on disk ---------------------------------------------------------------------------------

// *is_there: the shard exists with at least num samples. A shard of other settings is an error; a damaged shard is
// computed again.
static OmStatus find_shard(const char* path, uint64_t hash, int num, OmUmeshShard* shard,
                           bool* is_there) {
    *is_there = false;
    *shard = (OmUmeshShard){0};
    if (!om_path_exists(path)) return OM_OK;
    OmUmeshGrid grid;
    OmStatus status = om__umesh_shard_load(path, &grid, shard);
    om_umesh_grid_done(&grid);
    if (status == OM_INVALID) {
        om_log(OM_LOG_WARNING, "%s", om_error_message());
        return OM_OK;
    }
    OM_TRY(status);
    if (shard->hash != hash) {
        om__umesh_shard_done(shard);
        return om_error(OM_INVALID,
                        "%s: made with another seed, other settings or of another organ; take an "
                        "empty folder",
                        path);
    }
    *is_there = shard->num >= num;
    if (!*is_there) om__umesh_shard_done(shard);
    return OM_OK;
}

// ---- the set ----------------------------------------------------------------------------------------

static void add_sample(OmUmeshSummary* s, const OmUmeshSample* a) {
    ++s->nsample;
    s->nattempt += a->nattempt;
    s->nfail += a->nfail;
    s->max_u = fmax(s->max_u, a->max_u);
    s->mean_u += a->max_u;
    s->max_force = fmax(s->max_force, om_norm(a->force));
}

static OmStatus generate(const OmUmeshDataDef* def, Crew* c, int nworker, OmUmeshSummary* sum,
                         OmUmeshSample* all) {
    uint64_t hash = om__umesh_hash_def(def);
    for (int first = 0; first < def->nsample; first += def->shard) {
        int num = def->nsample - first < def->shard ? def->nsample - first : def->shard;
        char path[1024];
        OmUmeshShard shard = {0};
        bool is_there;
        OM_TRY(om_store_shard_path(def->out_dir, first, path, sizeof path));
        OM_TRY(find_shard(path, hash, num, &shard, &is_there));
        OmStatus status = OM_OK;
        if (!is_there) {
            OM_TRY(om__umesh_shard_alloc(c->nnode, num, &shard));
            shard.first = first, shard.seed = def->seed, shard.hash = hash;
            c->ndone_before = first;
            status = make_shard(c, nworker, &shard);
            if (status == OM_OK)
                status = om__umesh_shard_save(&shard, om_umesh_organ_grid(def->organ), def, path);
            for (int i = 0; i < num; ++i) sum->solve_seconds += shard.sample[i].seconds;
            sum->nmade += num;
        }
        if (status == OM_OK)
            status = om_progress_report(c->progress, "samples", first + num, def->nsample);
        for (int i = 0; i < num && status == OM_OK; ++i) {
            all[first + i] = shard.sample[i];
            add_sample(sum, &shard.sample[i]);
        }
        om__umesh_shard_done(&shard);
        if (status != OM_OK) return status;
    }
    return OM_OK;
}

OmStatus om_umesh_generate(const OmUmeshDataDef* def, const OmProgress* progress,
                           OmUmeshSummary* out) {
    OmUmeshSummary sum = {0};
    if (out) *out = sum;
    OM_TRY(om__umesh_check_def(def));
    OM_CHECK(def->out_dir && *def->out_dir, OM_INVALID, "OmUmeshDataDef.out_dir is empty");
    OmFolder folder = {0};
    double begin = om_clock_now();
    int nworker = om_worker_count(def->nworker);
    Crew c = {.nnode = om_umesh_organ_grid(def->organ)->fem.mesh.nnode,
              .progress = progress,
              .nsample = def->nsample,
              .is_reported = ATOMIC_FLAG_INIT};
    OmUmeshSample* all = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_folder_open(def->out_dir, "set of U-Mesh samples", &folder));
    OM_CALLOC_DONE(c.solver, nworker);
    OM_ALLOC_DONE(c.u, 3 * (size_t)c.nnode * (size_t)nworker);
    OM_ALLOC_DONE(all, def->nsample);
    for (int k = 0; k < nworker; ++k) OM_TRY_DONE(om_umesh_solver_create(def, &c.solver[k]));
    status = generate(def, &c, nworker, &sum, all);
    if (status != OM_OK) goto done;
    sum.mean_u /= sum.nsample;
    sum.solve_seconds /= sum.nmade > 0 ? sum.nmade : 1;
    sum.seconds = om_clock_now() - begin;
    OM_TRY_DONE(om__umesh_write_report(def, &sum, all, c.solver[0]));
    if (out) *out = sum;
done:
    for (int k = 0; k < nworker && c.solver; ++k) om_umesh_solver_destroy(c.solver[k]);
    om_free(c.solver);
    om_free(c.u);
    om_free(all);
    om_folder_end(&folder);
    return status;
}

// ---- reading ----------------------------------------------------------------------------------------

// Append the first num samples of a shard.
static OmStatus append(OmUmeshData* data, const OmUmeshShard* s, int num) {
    size_t nnode = (size_t)data->grid.fem.mesh.nnode, had = (size_t)data->nsample, n = (size_t)num;
    OmUmeshSample* sample = om_realloc(data->sample, had, had + n, sizeof *sample);
    if (!sample) return OM_NO_MEMORY;
    data->sample = sample;
    unsigned char* mask = om_realloc(data->mask, had * nnode, (had + n) * nnode, 1);
    if (!mask) return OM_NO_MEMORY;
    data->mask = mask;
    float* u = om_realloc(data->u, 3 * had * nnode, 3 * (had + n) * nnode, sizeof *u);
    if (!u) return OM_NO_MEMORY;
    data->u = u;
    memcpy(sample + had, s->sample, n * sizeof *sample);
    memcpy(mask + had * nnode, s->mask, n * nnode);
    memcpy(u + 3 * had * nnode, s->u, 3 * n * nnode * sizeof *u);
    data->nsample += num;
    return OM_OK;
}

static OmStatus load_all(const char* dir, int max_sample, OmUmeshData* data) {
    int lowest, last;
    om_store_shard_range(dir, &lowest, &last);
    OM_CHECK(last >= 0, OM_INVALID,
             "%s: no file of samples (samples_000000.h5) is there; make some with omentum umesh "
             "generate",
             dir);
    while (data->nsample <= last && (max_sample == 0 || data->nsample < max_sample)) {
        char path[1024];
        OmUmeshGrid grid;
        OmUmeshShard shard;
        OM_TRY(om_store_shard_path(dir, data->nsample, path, sizeof path));
        OM_CHECK(om_path_exists(path), OM_INVALID,
                 "%s is missing; the command that made the set makes it again", path);
        OM_TRY(om__umesh_shard_load(path, &grid, &shard));
        bool is_first = data->nsample == 0;
        OmStatus status = OM_OK;
        if (is_first) {
            data->grid = grid;
            data->seed = shard.seed, data->hash = shard.hash;
        }
        if (data->hash != shard.hash || data->grid.hash != grid.hash ||
            shard.first != data->nsample)
            status = om_error(OM_INVALID, "%s: not of the same set as the files before it", path);
        int num = shard.num;
        if (max_sample > 0 && num > max_sample - data->nsample) num = max_sample - data->nsample;
        if (status == OM_OK) status = append(data, &shard, num);
        if (!is_first) om_umesh_grid_done(&grid);
        om__umesh_shard_done(&shard);
        OM_TRY(status);
    }
    return OM_OK;
}

OmStatus om_umesh_data_load(const char* dir, int max_sample, OmUmeshData* data) {
    *data = (OmUmeshData){0};
    OM_CHECK(max_sample >= 0, OM_INVALID, "om_umesh_data_load: max_sample = %d", max_sample);
    OmStatus status = load_all(dir, max_sample, data);
    if (status < 0) om_umesh_data_done(data);
    return status;
}

void om_umesh_data_done(OmUmeshData* data) {
    if (!data) return;
    om_umesh_grid_done(&data->grid);
    om_free(data->sample);
    om_free(data->mask);
    om_free(data->u);
    *data = (OmUmeshData){0};
}
