// banet_generate.c: a data set: shards of consecutive samples, computed in parallel and written.
//
// Shard k has the samples k S .. (k + 1) S - 1 (the last shard may have fewer) and is written when all of them are
// complete. Each worker takes the next free index. A sample depends only on definition and index, so the files do not
// depend on the number of workers. Only the calling thread uses HDF5. Several shards are open at a time: with one, all
// workers waited for its slowest sample, a quarter of their time.
#include <stdatomic.h>
#include <string.h>

#include "banet/banet_data_internal.h"
#include "banet/banet_internal.h"
#include "omentum/nn_store.h"

#define COOKIE 0x16da7a5eu

// ---- definitions ------------------------------------------------------------------------------------

OmBanetDataDef om_banet_data_default_def(uint64_t seed, const char* out_dir) {
    OmBanetDataDef def = {.sample = om_banet_sample_default_def(seed),
                          .out_dir = out_dir,
                          .nsample = 5000,
                          .shard = 50,
                          .npicture = 6,
                          .cookie = COOKIE};
    def.sample.two_share = def.sample.board_share = 0.15;
    return def;
}

static const struct {
    const char* name;
    int nsample;
    uint64_t seed;
    OmBanetWay way;
    double board_share, two_share;
} test_table[OM_BANET_NTEST] = {{"test", 380, 4001, OM_BANET_EXACT, 0, 0},
                                {"test-camera", 380, 4002, OM_BANET_CAMERA, 0, 0},
                                {"board", 190, 4003, OM_BANET_MIXED, 1, 0},
                                {"two", 190, 4004, OM_BANET_MIXED, 0, 1}};

const char* om_banet_test_name(OmBanetTest test) {
    return test >= 0 && test < OM_BANET_NTEST ? test_table[test].name : "";
}

OmBanetDataDef om_banet_data_test_def(OmBanetTest test, const char* out_dir) {
    OmBanetDataDef def = om_banet_data_default_def(test_table[test].seed, out_dir);
    def.nsample = test_table[test].nsample;
    def.sample.way = test_table[test].way;
    def.sample.board_share = test_table[test].board_share;
    def.sample.two_share = test_table[test].two_share;
    return def;
}

static OmStatus check_def(const OmBanetDataDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmBanetDataDef was not made by om_banet_data_default_def");
    OM_TRY(om_banet_sample_def_validate(&d->sample));
    OM_CHECK(d->out_dir && *d->out_dir, OM_INVALID, "OmBanetDataDef.out_dir is empty");
    OM_CHECK(d->nsample >= 1 && d->nsample <= 100000000, OM_INVALID, "OmBanetDataDef.nsample = %d",
             d->nsample);
    OM_CHECK(d->shard >= 1 && d->shard <= 10000, OM_INVALID, "OmBanetDataDef.shard = %d", d->shard);
    OM_CHECK(d->first >= 0 && d->first < d->nsample && d->first % d->shard == 0, OM_INVALID,
             "OmBanetDataDef.first = %d; it must be a multiple of %d below %d", d->first, d->shard,
             d->nsample);
    OM_CHECK(d->npart >= 0 && (d->npart == 0 || d->part), OM_INVALID,
             "OmBanetDataDef.npart = %d, part is %s", d->npart, d->part ? "given" : "null");
    OM_CHECK(d->npicture >= 0, OM_INVALID, "OmBanetDataDef.npicture = %d, must be at least 0",
             d->npicture);
    OM_CHECK(d->nworker >= 0, OM_INVALID, "OmBanetDataDef.nworker = %d, must be at least 0",
             d->nworker);
    return OM_OK;
}

// ---- shards that are open ---------------------------------------------------------------------------

#define MOST_OPEN 8

typedef struct Open {
    OmBanetShard shard;
    char path[1024];
    atomic_int ndone;  // samples finished
    bool is_saved;
} Open;

typedef struct Crew {
    const OmBanetDataDef* def;
    const OmProgress* progress;
    Open open[MOST_OPEN];
    int nopen, num;           // shards, and their samples: all of them but the last have def->shard
    int before;               // samples of the set that were there, or finished, before these
    atomic_int next, ndone;   // samples begun and finished
    atomic_int status;        // the first failure
    char message[512];        // of the failure
    atomic_flag is_reported;  // a worker has written the message
} Crew;

static OmStatus make_cells(const OmBanetSampleDef* def, int index, const OmProgress* watch,
                           OmBanetCells* cells) {
    OmBanetSample sample = {0};
    OmStatus status = om__banet_sample_watched(def, index, watch, &sample);
    if (status == OM_NOT_CONVERGED)
        return om_error(status, "sample %d: none of %d draws succeeded", index, def->max_attempt);
    if (status == OM_OK) status = om_banet_cells_make(&sample, def->side, cells);
    om_banet_sample_done(&sample);
    return status;
}

typedef struct Watch {
    Crew* crew;
    bool is_caller;  // this worker runs on the caller's thread
} Watch;

// At every iteration of a sample, which may take several seconds: has the caller, or another worker, ended the work?
static bool watch_sample(void* ctx, const char* stage, double done, double total) {
    (void)stage;
    (void)done;
    (void)total;
    const Watch* w = ctx;
    const Crew* c = w->crew;
    if (atomic_load(&c->status) != OM_OK) return false;
    if (!w->is_caller || !c->progress || !c->progress->report) return true;
    return c->progress->report(c->progress->ctx, "samples", c->before + atomic_load(&c->ndone),
                               c->def->nsample - c->def->first);
}

// Write the shards that are complete; on the caller's thread.
static OmStatus save_complete(Crew* c) {
    for (int k = 0; k < c->nopen; ++k) {
        Open* o = &c->open[k];
        if (o->is_saved || atomic_load(&o->ndone) < o->shard.num) continue;
        OM_TRY(om__banet_shard_save(&o->shard, &c->def->sample, o->path));
        o->is_saved = true;
    }
    return OM_OK;
}

static OmStatus make_one(Crew* c, int i, const OmProgress* watch) {
    Open* o = &c->open[i / c->def->shard];
    const int at = i % c->def->shard;
    OM_TRY(make_cells(&c->def->sample, o->shard.first + at, watch, &o->shard.sample[at]));
    atomic_fetch_add(&o->ndone, 1);
    atomic_fetch_add(&c->ndone, 1);
    return OM_OK;
}

static void work(void* ctx, OmTeam* team, int rank, int size) {
    (void)team;
    (void)size;
    Crew* c = ctx;
    Watch w = {c, rank == 0};
    const OmProgress watch = {watch_sample, &w};
    while (atomic_load(&c->status) == OM_OK) {
        const int i = atomic_fetch_add(&c->next, 1);
        if (i >= c->num) return;
        OmStatus status = make_one(c, i, &watch);
        if (status == OM_OK && rank == 0) status = save_complete(c);
        if (status == OM_OK && rank == 0)
            status = om_progress_report(c->progress, "samples", c->before + atomic_load(&c->ndone),
                                        c->def->nsample - c->def->first);
        if (status != OM_OK && !atomic_flag_test_and_set(&c->is_reported)) {
            snprintf(c->message, sizeof c->message, "%s", om_error_message());
            atomic_store(&c->status, status);
        }
    }
}

// Make the samples of the open shards. After a failure complete shards are kept.
static OmStatus make_open(Crew* c, int nworker) {
    atomic_store(&c->next, 0);
    atomic_store(&c->ndone, 0);
    om_parallel_team(nworker, work, c);
    const int status = atomic_load(&c->status);
    OM_TRY(save_complete(c));
    return status == OM_OK ? OM_OK : om_error((OmStatus)status, "%s", c->message);
}

// *is_there: the shard exists with at least num samples. A shard of other settings is an error; a damaged shard is
// computed again.
static OmStatus find_shard(const char* path, uint64_t hash, int first, int num, OmBanetShard* shard,
                           bool* is_there) {
    *is_there = false;
    *shard = (OmBanetShard){0};
    if (!om_path_exists(path)) return OM_OK;
    OmStatus status = om__banet_shard_load(path, shard);
    if (status == OM_INVALID) {
        om_log(OM_LOG_WARNING, "%s", om_error_message());
        return OM_OK;
    }
    OM_TRY(status);
    if (shard->hash != hash) {
        om__banet_shard_done(shard);
        return om_error(OM_INVALID,
                        "%s: made with another seed or other settings; take an empty folder", path);
    }
    if (shard->first != first) {
        int wrong = shard->first;
        om__banet_shard_done(shard);
        return om_error(OM_INVALID, "%s: has the samples from %d on; its name says %d", path, wrong,
                        first);
    }
    *is_there = shard->num >= num;
    if (!*is_there) om__banet_shard_done(shard);
    return OM_OK;
}

// Copy a shard from the parts of the set, if one of them has it.
static OmStatus copy_shard(const OmBanetDataDef* def, uint64_t hash, int first, int num,
                           OmBanetShard* shard, bool* is_there) {
    char from[1024], to[1024];
    *is_there = false;
    for (int k = 0; k < def->npart && !*is_there; ++k) {
        OM_TRY(om_store_shard_path(def->part[k], first, from, sizeof from));
        OM_TRY(find_shard(from, hash, first, num, shard, is_there));
    }
    if (!*is_there) return OM_OK;
    OmStatus status = om_store_shard_path(def->out_dir, first, to, sizeof to);
    if (status == OM_OK) status = om__banet_shard_save(shard, &def->sample, to);
    if (status < 0) om__banet_shard_done(shard);
    return status;
}

// ---- the set ----------------------------------------------------------------------------------------

// Size of a file; 0 if it cannot be opened.
static int64_t file_size(const char* path) {
    FILE* stream;
    uint64_t size = 0;
    if (om_file_open(path, &stream, &size) < 0) return 0;
    fclose(stream);
    return (int64_t)size;
}

static void add_sample(OmBanetSummary* s, const OmBanetFacts* f) {
    ++s->nsample;
    s->nattempt += f->nattempt;
    s->nfail += f->nfail;
    s->ncamera += f->is_camera;
    s->nboard += f->has_board;
    s->ntwo += f->nregion == 2;
    s->max_u = fmax(s->max_u, f->max_u);
}

static void add_shard(const OmBanetDataDef* def, const OmBanetShard* shard, const char* path,
                      OmBanetSummary* sum, OmBanetFacts* all) {
    for (int i = 0; i < shard->num; ++i) {
        all[shard->first - def->first + i] = shard->sample[i].fact;
        add_sample(sum, &shard->sample[i].fact);
        sum->ncell += shard->sample[i].ncell;
    }
    sum->nbyte += file_size(path);
}

// Make, write and count the open shards; none is open then.
static OmStatus finish_open(Crew* c, int nworker, OmBanetSummary* sum, OmBanetFacts* all) {
    OmStatus status = c->nopen > 0 ? make_open(c, nworker) : OM_OK;
    for (int k = 0; k < c->nopen; ++k) {
        const OmBanetShard* shard = &c->open[k].shard;
        for (int i = 0; i < shard->num && status == OM_OK; ++i)
            sum->sample_seconds += shard->sample[i].fact.seconds;
        if (status == OM_OK) add_shard(c->def, shard, c->open[k].path, sum, all);
        om__banet_shard_done(&c->open[k].shard);
    }
    if (status == OM_OK) sum->nmade += c->num;
    c->before += c->num;
    c->nopen = c->num = 0;
    return status;
}

static OmStatus generate(Crew* c, int nworker, OmBanetSummary* sum, OmBanetFacts* all) {
    const OmBanetDataDef* def = c->def;
    const uint64_t hash = om_banet_sample_def_hash(&def->sample);
    OmStatus status = OM_OK;
    for (int first = def->first; first < def->nsample; first += def->shard) {
        const int num = def->nsample - first < def->shard ? def->nsample - first : def->shard;
        Open* o = &c->open[c->nopen];
        OmBanetShard* shard = &o->shard;
        bool is_there;
        *o = (Open){0};
        OM_TRY_DONE(om_store_shard_path(def->out_dir, first, o->path, sizeof o->path));
        OM_TRY_DONE(find_shard(o->path, hash, first, num, shard, &is_there));
        if (!is_there) OM_TRY_DONE(copy_shard(def, hash, first, num, shard, &is_there));
        if (is_there) {
            add_shard(def, shard, o->path, sum, all);
            om__banet_shard_done(shard);
            c->before += num;
            status =
                om_progress_report(c->progress, "samples", c->before, def->nsample - def->first);
        } else {
            OM_TRY_DONE(om__banet_shard_alloc(num, shard));
            shard->first = first, shard->seed = def->sample.seed, shard->hash = hash;
            shard->side = def->sample.side;
            c->num += num;
            if (++c->nopen == MOST_OPEN) status = finish_open(c, nworker, sum, all);
        }
        if (status != OM_OK) break;
    }
    if (status == OM_OK) return finish_open(c, nworker, sum, all);
done:
    for (int k = 0; k < c->nopen; ++k) om__banet_shard_done(&c->open[k].shard);
    c->nopen = 0;
    return status;
}

static OmStatus find_medians(const OmBanetFacts* fact, OmBanetSummary* sum) {
    double* value = om_alloc((size_t)sum->nsample, sizeof *value);
    if (!value) return OM_NO_MEMORY;
    const int middle = sum->nsample / 2;
    for (int i = 0; i < sum->nsample; ++i) value[i] = fact[i].max_u;
    om_sort_doubles(value, sum->nsample);
    sum->median_u = value[middle];
    for (int i = 0; i < sum->nsample; ++i) value[i] = fact[i].visible;
    om_sort_doubles(value, sum->nsample);
    sum->median_visible = value[middle];
    om_free(value);
    return OM_OK;
}

OmStatus om_banet_generate(const OmBanetDataDef* def, const OmProgress* progress,
                           OmBanetSummary* out) {
    OmBanetSummary sum = {0};
    if (out) *out = sum;
    OM_TRY(check_def(def));
    OmFolder folder = {0};
    const double begin = om_clock_now();
    Crew* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    *c = (Crew){.def = def, .progress = progress, .is_reported = ATOMIC_FLAG_INIT};
    OmBanetFacts* all = NULL;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_folder_open(def->out_dir, "set of BA-Net samples", &folder));
    OM_ALLOC_DONE(all, def->nsample - def->first);
    status = generate(c, om_worker_count(def->nworker), &sum, all);
    if (status != OM_OK) goto done;
    OM_TRY_DONE(find_medians(all, &sum));
    sum.sample_seconds /= sum.nmade > 0 ? sum.nmade : 1;
    sum.seconds = om_clock_now() - begin;
    OM_TRY_DONE(om__banet_write_report(def, &sum, all));
    if (out) *out = sum;
done:
    om_free(all);
    om_free(c);
    om_folder_end(&folder);
    return status;
}
