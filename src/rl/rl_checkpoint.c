// rl_checkpoint.c: the files of a training: checkpoint (nn_store.h), metrics.csv.
//
// The checkpoint is written between two iterations and holds all that changes. It names task and settings by their
// hash; settings that do not change the result (workers, folder, period) are not part of it.
#include <math.h>
#include <string.h>

#include "omentum/nn_store.h"
#include "rl/rl_internal.h"

#define KIND "omentum learning checkpoint"
#define NOT_MEASURED 1e300  // stands for NaN, which files do not hold
enum { FORMAT = 2, NCOLUMN = 17, CHUNK = 65536 };

static uint64_t settings_hash(const OmRlTrainDef* d) {
    const OmRlPolicyDef* p = &d->policy;
    const double value[] = {d->method,
                            (double)d->nstep,
                            d->nenv,
                            p->nlayer,
                            p->width,
                            p->activation,
                            (double)p->seed,
                            d->horizon,
                            d->batch,
                            d->nepoch,
                            d->rate,
                            d->gamma,
                            d->lambda,
                            d->clip,
                            d->clip_value,
                            d->entropy,
                            d->value,
                            d->max_norm,
                            d->normalise_advantage,
                            d->normalise_reward,
                            d->weight_reward,
                            d->weight_gail,
                            d->clone_epoch,
                            d->gail_rate,
                            d->gail_noise,
                            d->gail_epoch,
                            d->gail_actions};
    uint64_t hash = om_hash(value, sizeof value, d->task->hash);
    hash = om_hash(&d->seed, sizeof d->seed, hash);
    if (d->clone_rate > 0) hash = om_hash(&d->clone_rate, sizeof d->clone_rate, hash);
    if (d->start) hash = om_hash(d->start, strlen(d->start), hash);
    if (d->sharpness != 1) hash = om_hash(&d->sharpness, sizeof d->sharpness, hash);
    if (d->eval_period > 0) {
        const uint64_t task = d->eval_task ? d->eval_task->hash : d->task->hash;
        const uint64_t own[] = {(uint64_t)d->eval_period, (uint64_t)d->eval_nepisode, d->eval_seed,
                                (uint64_t)d->eval_stop, task};
        hash = om_hash(own, sizeof own, hash);
    }
    return hash;
}

// Demonstrations are part of the settings by their contents.
static uint64_t session_hash(const RlSession* s) {
    uint64_t hash = settings_hash(s->def);
    const OmRlDemos* d = &s->demos;
    if (d->nstep == 0) return hash;
    hash = om_hash(d->obs, (size_t)d->nstep * (size_t)d->nobservation * sizeof(float), hash);
    return om_hash(d->action, (size_t)d->nstep * (size_t)d->naction * sizeof(int), hash);
}

// ---- rows of metrics ----------------------------------------------------------------------------------

static void put_row(const OmRlTrainRow* r, double v[NCOLUMN]) {
    const double value[NCOLUMN] = {
        (double)r->step, (double)r->nepisode, r->mean_return,  r->mean_length, r->mean_score,
        r->loss_policy,  r->loss_value,       r->entropy,      r->divergence,  r->clip_fraction,
        r->rate,         r->right_demo,       r->right_policy, r->eval_score,  r->eval_return,
        r->eval_least,   r->seconds};
    for (int i = 0; i < NCOLUMN; ++i) v[i] = isfinite(value[i]) ? value[i] : NOT_MEASURED;
}

static void get_row(const double v[NCOLUMN], OmRlTrainRow* r) {
    double x[NCOLUMN];
    for (int i = 0; i < NCOLUMN; ++i) x[i] = v[i] < NOT_MEASURED ? v[i] : (double)NAN;
    *r = (OmRlTrainRow){.step = (int64_t)v[0],
                        .nepisode = (int64_t)v[1],
                        .mean_return = x[2],
                        .mean_length = x[3],
                        .mean_score = x[4],
                        .loss_policy = x[5],
                        .loss_value = x[6],
                        .entropy = x[7],
                        .divergence = x[8],
                        .clip_fraction = x[9],
                        .rate = x[10],
                        .right_demo = x[11],
                        .right_policy = x[12],
                        .eval_score = x[13],
                        .eval_return = x[14],
                        .eval_least = x[15],
                        .seconds = x[16]};
}

OmStatus om__rl_save_metrics(const RlSession* s) {
    static const char head[] =
        "step,episodes,return,length,score,loss_policy,loss_value,entropy,divergence,clip_fraction,"
        "rate,right_demo,right_policy,eval_score,eval_return,eval_least,seconds\n";
    OmText text = {0};
    char path[1024];
    OmStatus status;
    OM_TRY(om_path_join(s->def->out_dir, "metrics.csv", path, sizeof path));
    OM_TRY_DONE(om_text_append(&text, "%s", head));
    for (int i = 0; i < s->nrow; ++i) {
        double v[NCOLUMN];
        put_row(&s->row[i], v);
        for (int k = 0; k < NCOLUMN; ++k) {  // an empty cell where nothing was measured
            if (v[k] < NOT_MEASURED) OM_TRY_DONE(om_text_append(&text, "%.9g", v[k]));
            OM_TRY_DONE(om_text_append(&text, k + 1 < NCOLUMN ? "," : "\n"));
        }
    }
    status = om_file_write(path, text.str, text.len);
done:
    om_text_done(&text);
    return status;
}

// ---- networks -----------------------------------------------------------------------------------------

typedef struct Part {  // a network and its optimiser
    const char* name;
    float* param;
    size_t n;
    OmOptim* optim;
} Part;

static int list_parts(const RlSession* s, Part part[3]) {
    const RlLearner* l = &s->learner;
    const OmNet* actor = om_rl_policy_net(l->policy, OM_RL_ACTOR);
    const OmNet* critic = om_rl_policy_net(l->policy, OM_RL_CRITIC);
    part[0] = (Part){"actor", om_rl_policy_parameters(l->policy, OM_RL_ACTOR),
                     om_net_parameter_size(actor), l->optim[0]};
    part[1] = (Part){"critic", om_rl_policy_parameters(l->policy, OM_RL_CRITIC),
                     om_net_parameter_size(critic), l->optim[1]};
    if (!s->judge.net) return 2;
    part[2] = (Part){"judge", s->judge.param, om_net_parameter_size(s->judge.net), s->judge.optim};
    return 3;
}

// The kept policy: parameters without an optimiser.
static int list_best(const RlSession* s, Part part[2]) {
    if (!(s->c.best_step > 0)) return 0;
    part[0] = (Part){"best_actor", om_rl_policy_parameters(s->best, OM_RL_ACTOR),
                     om_net_parameter_size(om_rl_policy_net(s->best, OM_RL_ACTOR)), NULL};
    part[1] = (Part){"best_critic", om_rl_policy_parameters(s->best, OM_RL_CRITIC),
                     om_net_parameter_size(om_rl_policy_net(s->best, OM_RL_CRITIC)), NULL};
    return 2;
}

static OmStatus put_part(OmStoreWriter* w, const Part* p) {
    char name[64];
    int64_t step;
    float* moment = om_alloc(om_optim_size(p->optim), sizeof *moment);
    if (!moment) return OM_NO_MEMORY;
    om_optim_save(p->optim, &step, moment);
    const uint64_t num = (uint64_t)step;
    om_store_group(w, p->name);
    snprintf(name, sizeof name, "%s/parameters", p->name);
    om_store_array(w, name, OM_STORE_F32, (int[3]){(int)p->n}, CHUNK, NULL, p->param);
    snprintf(name, sizeof name, "%s/moments", p->name);
    om_store_array(w, name, OM_STORE_F32, (int[3]){(int)om_optim_size(p->optim)}, CHUNK, NULL,
                   moment);
    snprintf(name, sizeof name, "%s@step", p->name);
    om_store_value(w, name, OM_STORE_U64, 0, &num);
    om_free(moment);
    return OM_OK;
}

static OmStatus get_part(const OmStoreReader* r, const Part* p) {
    char name[64];
    uint64_t step = 0;
    float* moment = om_alloc(om_optim_size(p->optim), sizeof *moment);
    if (!moment) return OM_NO_MEMORY;
    OmStatus status;
    snprintf(name, sizeof name, "%s@step", p->name);
    OM_TRY_DONE(om_store_get_value(r, name, OM_STORE_U64, 1, &step));
    snprintf(name, sizeof name, "%s/parameters", p->name);
    OM_TRY_DONE(om_store_get_array(r, name, OM_STORE_F32, (int[3]){(int)p->n}, p->param));
    snprintf(name, sizeof name, "%s/moments", p->name);
    OM_TRY_DONE(
        om_store_get_array(r, name, OM_STORE_F32, (int[3]){(int)om_optim_size(p->optim)}, moment));
    status = om_optim_restore(p->optim, (int64_t)step, moment);
done:
    om_free(moment);
    return status;
}

// ---- all of it ----------------------------------------------------------------------------------------

#define NCOUNTER ((int)(sizeof(RlCounters) / sizeof(double)))

OmStatus om__rl_checkpoint_save(const RlSession* s) {
    OmStoreWriter* w = NULL;
    Part part[3];
    char path[1024];
    const size_t size = om_rl_vec_size(s->vec);
    const uint64_t hash = session_hash(s);
    double* row = NULL;
    unsigned char* block = NULL;
    OmStatus status;
    OM_TRY(om_path_join(s->def->out_dir, "checkpoint.h5", path, sizeof path));
    OM_CHECK(size < INT32_MAX, OM_INVALID, "checkpoint: environments of %zu bytes", size);
    OM_ALLOC_DONE(row, (size_t)s->nrow * NCOLUMN + 1);
    OM_ALLOC_DONE(block, size);
    OM_TRY_DONE(om_store_begin(KIND, FORMAT, &w));
    for (int i = 0; i < s->nrow; ++i) put_row(&s->row[i], row + (ptrdiff_t)i * NCOLUMN);
    om_rl_vec_save(s->vec, block);
    om_store_value(w, "settings", OM_STORE_U64, 0, &hash);
    om_store_value(w, "rows", OM_STORE_I32, 0, &s->nrow);
    om_store_array(w, "counters", OM_STORE_F64, (int[3]){NCOUNTER}, CHUNK, NULL, &s->c);
    om_store_array(w, "running", OM_STORE_F64, (int[3]){s->def->nenv}, CHUNK, NULL, s->running);
    om_store_array(w, "environments", OM_STORE_U8, (int[3]){(int)size}, CHUNK, NULL, block);
    if (s->nrow > 0)
        om_store_array(w, "metrics", OM_STORE_F64, (int[3]){s->nrow, NCOLUMN}, CHUNK, NULL, row);
    const int npart = list_parts(s, part);
    for (int i = 0; i < npart; ++i) OM_TRY_DONE(put_part(w, &part[i]));
    const int nbest = list_best(s, part);
    for (int i = 0; i < nbest; ++i)
        om_store_array(w, part[i].name, OM_STORE_F32, (int[3]){(int)part[i].n}, CHUNK, NULL,
                       part[i].param);
    status = om_store_save(w, path);
    w = NULL;
    if (status >= 0) status = om__rl_save_metrics(s);
done:
    om_store_abort(w);
    om_free(row);
    om_free(block);
    return status;
}

static OmStatus read_checkpoint(const OmStoreReader* r, const char* path, RlSession* s) {
    Part part[3];
    const size_t size = om_rl_vec_size(s->vec);
    uint64_t hash = 0;
    int nrow = 0;
    double* row = NULL;
    unsigned char* block = NULL;
    OmStatus status;
    OM_TRY(om_store_get_value(r, "settings", OM_STORE_U64, 1, &hash));
    OM_CHECK(hash == session_hash(s), OM_INVALID,
             "%s: is of a training with other settings; give the same settings or another folder",
             path);
    OM_TRY(om_store_get_value(r, "rows", OM_STORE_I32, 1, &nrow));
    OM_CHECK(nrow >= 0 && nrow <= s->max_row, OM_INVALID, "%s: %d rows of metrics", path, nrow);
    OM_ALLOC_DONE(row, (size_t)nrow * NCOLUMN + 1);
    OM_ALLOC_DONE(block, size);
    OM_TRY_DONE(om_store_get_array(r, "counters", OM_STORE_F64, (int[3]){NCOUNTER}, &s->c));
    OM_TRY_DONE(om_store_get_array(r, "running", OM_STORE_F64, (int[3]){s->def->nenv}, s->running));
    OM_TRY_DONE(om_store_get_array(r, "environments", OM_STORE_U8, (int[3]){(int)size}, block));
    if (nrow > 0)
        OM_TRY_DONE(om_store_get_array(r, "metrics", OM_STORE_F64, (int[3]){nrow, NCOLUMN}, row));
    OM_TRY_DONE(om_rl_vec_restore(s->vec, block));
    const int npart = list_parts(s, part);
    for (int i = 0; i < npart; ++i) OM_TRY_DONE(get_part(r, &part[i]));
    OM_CHECK_DONE(s->best || !(s->c.best_step > 0), OM_INVALID, "%s: holds a policy of evaluations",
                  path);
    const int nbest = list_best(s, part);
    for (int i = 0; i < nbest; ++i)
        OM_TRY_DONE(om_store_get_array(r, part[i].name, OM_STORE_F32, (int[3]){(int)part[i].n},
                                       part[i].param));
    for (int i = 0; i < nrow; ++i) get_row(row + (ptrdiff_t)i * NCOLUMN, &s->row[i]);
    s->nrow = nrow;
    s->is_resumed = true;
done:
    om_free(row);
    om_free(block);
    return status;
}

OmStatus om__rl_checkpoint_load(RlSession* s) {
    char path[1024], *data;
    size_t size;
    OmStoreReader* reader;
    OM_TRY(om_path_join(s->def->out_dir, "checkpoint.h5", path, sizeof path));
    if (!om_path_exists(path)) return OM_OK;
    OM_TRY(om_file_read(path, (size_t)1 << 32, &data, &size));
    OmStatus status = om_store_open(data, size, KIND, FORMAT, path, &reader);
    if (status == OM_OK) {
        status = read_checkpoint(reader, path, s);
        om_store_close(reader);
    }
    om_free(data);
    return status;
}
