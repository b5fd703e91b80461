// nn_checkpoint.c: the files of a training: its checkpoint (safetensors) and its table of metrics.
//
// Integers of the state are below 2^53 and are stored as doubles. The file identifies network, data and settings by
// their hashes. Settings without effect on the result, or only on its rounding, are excluded: worker count, folder,
// period.
#include <math.h>
#include <string.h>

#include "nn/nn_train_internal.h"
#include "omentum/nn_file.h"

enum { NCOUNTER = 13, NCOLUMN = 8, MAX_TENSOR = 7 };

static OmStatus path_in(const OmTrainDef* def, const char* name, char out[1024]) {
    return om_path_join(def->dir, name, out, 1024);
}

static void hex(uint64_t value, char out[20]) {
    snprintf(out, 20, "%016llx", (unsigned long long)value);
}

static uint64_t settings_hash(const OmTrainDef* d) {
    const OmOptimDef* o = &d->optim;
    const OmSchedule* s = &d->schedule;
    OmNetShape shape = om_net_layer(d->net, om_net_output(d->net))->shape;
    size_t ncell = (size_t)shape.d * (size_t)shape.h * (size_t)shape.w;
    double value[] = {d->ntrain,       d->nvalid,        d->batch,   d->nepoch,
                      d->valid_every,  d->patience,      d->type,    d->group ? d->group->size : 1,
                      o->kind,         o->beta1,         o->beta2,   o->epsilon,
                      o->weight_decay, o->clip_norm,     o->average, s->kind,
                      s->peak,         s->start,         s->end,     s->warmup,
                      d->loss.nterm,   d->metric ? 1 : 0};
    uint64_t hash = om_hash(value, sizeof value, OM_HASH_SEED);
    hash = om_hash(&d->seed, sizeof d->seed, hash);
    for (int i = 0; i < d->loss.nterm; ++i) {
        double term[2] = {d->loss.term[i].kind, d->loss.term[i].scale};
        hash = om_hash(term, sizeof term, hash);
    }
    if (d->loss.weight) hash = om_hash(d->loss.weight, ncell * sizeof(float), hash);
    if (d->has_cell_weight) hash = om_hash("cell_weight", 11, hash);
    return hash;
}

// ---- writing ----------------------------------------------------------------------------------------

static void put_counters(const OmTrainState* s, int64_t step, double v[NCOUNTER]) {
    v[0] = s->nrow;
    v[1] = (double)step;
    v[2] = (double)s->nbatch_done;
    v[3] = s->loss_sum;
    v[4] = s->norm_sum;
    v[5] = s->rate;
    v[6] = s->seconds;
    v[7] = s->best_epoch;
    v[8] = s->best_epoch > 0 && isfinite(s->best_value) ? s->best_value : 0;
    v[9] = s->nworse;
    v[10] = s->is_ended;
    v[11] = s->is_early;
    v[12] = s->best_epoch > 0 && isfinite(s->best_value);
}

// A value that was not measured is 0 with the flag 0; files hold no NaN.
static void put_row(const OmTrainEpoch* e, double v[NCOLUMN]) {
    bool has_valid = isfinite(e->valid);
    v[0] = e->epoch;
    v[1] = (double)e->step;
    v[2] = e->train;
    v[3] = has_valid ? e->valid : 0;
    v[4] = has_valid;
    v[5] = e->rate;
    v[6] = e->grad_norm;
    v[7] = e->seconds;
}

static OmStatus save_checkpoint(const OmTrainDef* def, const OmTrainState* s, const char* path) {
    OmStatus status = OM_OK;
    OmOptimState o = om__optim_state(s->optim);
    int64_t n = (int64_t)om_net_parameter_size(def->net);
    double counter[NCOUNTER], *history = NULL;
    char network[20], data[20], settings[20];
    int count = 0;
    OmTensor t[MAX_TENSOR];
    OM_ALLOC_DONE(history, (size_t)s->nrow * NCOLUMN);
    for (int i = 0; i < s->nrow; ++i) put_row(&s->row[i], history + (ptrdiff_t)i * NCOLUMN);
    put_counters(s, *o.step, counter);
    t[count++] = (OmTensor){"param", OM_TENSOR_F32, 1, {n}, s->param};
    t[count++] = (OmTensor){"moment1", OM_TENSOR_F32, 1, {n}, o.m};
    t[count++] = (OmTensor){"moment2", OM_TENSOR_F32, 1, {n}, o.v};
    if (o.mean) t[count++] = (OmTensor){"average", OM_TENSOR_F32, 1, {n}, o.mean};
    if (s->best_epoch > 0) t[count++] = (OmTensor){"best", OM_TENSOR_F32, 1, {n}, s->best};
    t[count++] = (OmTensor){"counters", OM_TENSOR_F64, 1, {NCOUNTER}, counter};
    t[count++] = (OmTensor){"history", OM_TENSOR_F64, 2, {s->nrow, NCOLUMN}, history};
    hex(om_net_hash(def->net), network);
    hex(def->data_hash, data);
    hex(settings_hash(def), settings);
    OmTextPair meta[] = {{"content", "omentum training checkpoint 1"},
                         {"network", network},
                         {"data", data},
                         {"settings", settings}};
    status = om_tensor_file_save(t, count, meta, 4, path);
done:
    om_free(history);
    return status;
}

OmStatus om__train_save_metrics(const OmTrainDef* def, const OmTrainState* s) {
    OmText text = {0};
    OmStatus status = OM_OK;
    char path[1024], valid[32];
    OM_TRY(path_in(def, "metrics.csv", path));
    OM_TRY_DONE(om_text_append(&text, "epoch,step,train,valid,rate,grad_norm,seconds\n"));
    for (int i = 0; i < s->nrow; ++i) {
        const OmTrainEpoch* e = &s->row[i];
        valid[0] = 0;  // an empty cell if it was not measured
        if (isfinite(e->valid)) snprintf(valid, sizeof valid, "%.9g", e->valid);
        OM_TRY_DONE(om_text_append(&text, "%d,%lld,%.9g,%s,%.6g,%.6g,%.2f\n", e->epoch,
                                   (long long)e->step, e->train, valid, e->rate, e->grad_norm,
                                   e->seconds));
    }
    status = om_file_write(path, text.str, text.len);
done:
    om_text_done(&text);
    return status;
}

OmStatus om__train_save(const OmTrainDef* def, const OmTrainState* s) {
    char path[1024];
    OM_TRY(path_in(def, "checkpoint.safetensors", path));
    OM_TRY(save_checkpoint(def, s, path));
    return om__train_save_metrics(def, s);
}

// ---- reading ----------------------------------------------------------------------------------------

static OmStatus check_owner(const OmTrainDef* def, const OmTensorFile* file, const char* path) {
    const struct {
        const char *key, *what;
        uint64_t hash;
    } owner[] = {{"network", "another network", om_net_hash(def->net)},
                 {"data", "other training data", def->data_hash},
                 {"settings", "other settings", settings_hash(def)}};
    for (size_t i = 0; i < sizeof owner / sizeof *owner; ++i) {
        const char* found = om_tensor_file_meta(file, owner[i].key);
        char want[20];
        hex(owner[i].hash, want);
        OM_CHECK(found, OM_INVALID, "%s: is no checkpoint of a training", path);
        OM_CHECK(strcmp(found, want) == 0, OM_INVALID,
                 "%s: belongs to a training with %s; continue with the same settings, or remove it",
                 path, owner[i].what);
    }
    return OM_OK;
}

static OmStatus take_counters(const OmTrainDef* def, const double v[NCOUNTER], const char* path,
                              OmTrainState* s) {
    const double limit[NCOUNTER] = {
        def->nepoch, 9e15, def->ntrain, [7] = def->nepoch, [9] = 2e9, [10] = 1, 1, 1};
    for (int i = 0; i < NCOUNTER; ++i) {
        bool is_count = limit[i] > 0;
        OM_CHECK(!is_count || (v[i] >= 0 && v[i] <= limit[i] && v[i] == floor(v[i])), OM_INVALID,
                 "%s: counter %d is %g, outside 0 to %g", path, i, v[i], limit[i]);
    }
    OM_CHECK(v[10] > 0 ? v[0] > 0 : v[0] < def->nepoch, OM_INVALID,
             "%s: its epochs do not agree with its end", path);
    s->nrow = (int)v[0];
    *om__optim_state(s->optim).step = (int64_t)v[1];
    s->nbatch_done = (int64_t)v[2];
    s->loss_sum = v[3];
    s->norm_sum = v[4];
    s->rate = v[5];
    s->seconds = v[6];
    s->best_epoch = (int)v[7];
    s->nworse = (int)v[9];
    s->is_ended = v[10] > 0;
    s->is_early = v[11] > 0;
    s->best_value = v[12] > 0 ? v[8] : (double)NAN;
    return OM_OK;
}

static OmStatus take_history(const OmTensorFile* file, const char* path, OmTrainState* s) {
    double* history = NULL;
    OmStatus status = OM_OK;
    int64_t dim[2] = {s->nrow, NCOLUMN};
    OM_ALLOC_DONE(history, (size_t)s->nrow * NCOLUMN);
    OM_TRY_DONE(om_tensor_file_read_double(file, "history", 2, dim, history));
    for (int i = 0; i < s->nrow; ++i) {
        const double* v = history + (ptrdiff_t)i * NCOLUMN;
        OM_CHECK_DONE(v[0] == i + 1 && v[1] >= 0 && v[1] < 9e15, OM_INVALID,
                      "%s: row %d of its history is damaged", path, i);
        s->row[i] = (OmTrainEpoch){.epoch = i + 1,
                                   .step = (int64_t)v[1],
                                   .train = v[2],
                                   .valid = v[4] > 0 ? v[3] : (double)NAN,
                                   .rate = v[5],
                                   .grad_norm = v[6],
                                   .seconds = v[7]};
    }
done:
    om_free(history);
    return status;
}

OmStatus om__train_load(const OmTrainDef* def, OmTrainState* s, bool* is_found) {
    OmTensorFile* file = NULL;
    OmStatus status = OM_OK;
    OmOptimState o = om__optim_state(s->optim);
    char path[1024];
    double counter[NCOUNTER];
    const int64_t n = (int64_t)om_net_parameter_size(def->net), ncounter = NCOUNTER;
    *is_found = false;
    OM_TRY(path_in(def, "checkpoint.safetensors", path));
    if (!om_path_exists(path)) return OM_OK;
    OM_TRY(om_tensor_file_load(path, &file));
    OM_TRY_DONE(check_owner(def, file, path));
    OM_TRY_DONE(om_tensor_file_read_double(file, "counters", 1, &ncounter, counter));
    OM_TRY_DONE(take_counters(def, counter, path, s));
    OM_TRY_DONE(take_history(file, path, s));
    OM_TRY_DONE(om_tensor_file_read(file, "param", 1, &n, s->param));
    OM_TRY_DONE(om_tensor_file_read(file, "moment1", 1, &n, o.m));
    OM_TRY_DONE(om_tensor_file_read(file, "moment2", 1, &n, o.v));
    if (o.mean) OM_TRY_DONE(om_tensor_file_read(file, "average", 1, &n, o.mean));
    if (s->best_epoch > 0) OM_TRY_DONE(om_tensor_file_read(file, "best", 1, &n, s->best));
    *is_found = true;
done:
    om_tensor_file_destroy(file);
    return status;
}
