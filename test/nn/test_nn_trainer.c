// test_nn_trainer.c: the loop of training: it learns, it keeps the best, and it cannot be made to lose its way:
// stopped, killed, or cut into ranks it goes through the same states.
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>

#include "omentum/nn_train.h"
#include "test_alloc.h"
#include "test_files.h"

enum { NTRAIN = 50, NVALID = 7, NIN = 4, NOUT = 3 };

// A rule to learn: out = sin of a linear map of the input.
typedef struct Task {
    int ncall;         // fills so far
    int kill_at;       // the process ends in this call, as if its power had gone
    int fail_at;       // fill fails in this call
    bool is_infinite;  // targets are
    bool has_cell_weight;
    double metric;  // what the metric says, growing by 1; 0: the largest difference
    int64_t seen[NTRAIN];
    uint64_t draw_hash;
    int nepoch;
} Task;

static void rule(uint64_t sample, float* in, float* target) {
    OmRng rng = om_rng_init(99, sample);
    for (int i = 0; i < NIN; ++i) in[i] = (float)om_rng_normal(&rng);
    for (int k = 0; k < NOUT; ++k)
        target[k] = sinf(0.5F * in[k] - 0.25F * in[(k + 1) % NIN] + 0.1F * (float)k);
}

static OmStatus fill(void* ctx, const OmTrainBatch* b) {
    Task* t = ctx;
    ++t->ncall;
    if (t->ncall == t->kill_at) raise(SIGKILL);
    if (t->ncall == t->fail_at)
        return om_error(OM_IO, "sample %lld is lost", (long long)b->sample[0]);
    for (int i = 0; i < b->count; ++i) {
        uint64_t sample = (uint64_t)b->sample[i] + (b->is_validation ? 1000 : 0);
        rule(sample, b->in + i * NIN, b->target + i * NOUT);
        if (!b->is_validation) ++t->seen[b->sample[i]];
        t->draw_hash = om_hash(&b->draw[i], sizeof b->draw[i], t->draw_hash);
        if (t->is_infinite) b->target[i * NOUT] = INFINITY;
        // A sample without cell weights does not count, whatever its target.
        assert_true((b->cell_weight != NULL) == t->has_cell_weight);
        if (!b->cell_weight) continue;
        b->cell_weight[i] = sample % 3 == 0 ? 0 : 2;
        if (sample % 3 == 0) b->target[i * NOUT] = INFINITY;
    }
    return OM_OK;
}

static double metric(void* ctx, const int64_t* sample, const float* out, const float* target,
                     int count) {
    Task* t = ctx;
    for (int i = 1; i < count; ++i) assert_int_equal(sample[i], sample[0] + i);
    double worst = 0;
    for (int i = 0; i < count * NOUT; ++i)
        worst = fmax(worst, fabs((double)out[i] - (double)target[i]));
    return t->metric > 0 ? (t->metric += 1) * count : worst * count;
}

static void count_epoch(void* ctx, const OmTrainEpoch* row) {
    Task* t = ctx;
    assert_int_equal(row->epoch, ++t->nepoch);
}

static OmNet* make_net(bool has_norm) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){NIN, 1, 1, 1});
    x = om_net_add_dense(net, "first", x, 16);
    if (has_norm) x = om_net_add_batch_norm(net, "norm", x);
    x = om_net_add_activation(net, x, OM_TANH, 0);
    x = om_net_add_dropout(net, x, 0.01F);
    assert_ok(om_net_finish(net, om_net_add_dense(net, "second", x, NOUT)));
    return net;
}

static OmTrainDef make_def(const OmNet* net, Task* task) {
    OmTrainDef def = om_train_default_def(net, fill, task);
    def.ntrain = NTRAIN;
    def.nvalid = NVALID;
    def.nepoch = 12;
    def.optim.average = 0.9;
    def.optim.clip_norm = 1;
    def.schedule = om_schedule_one_cycle(0.02);
    def.nworker = 1;
    return def;
}

// Train from the same start; the hash of the weights.
static uint64_t train(const OmTrainDef* def, OmTrainResult* result) {
    size_t n = om_net_parameter_size(def->net);
    float* param = om_alloc(n, sizeof *param);
    om_net_init_parameters(def->net, 1, param);
    assert_ok(om_train_run(def, NULL, param, result));
    uint64_t hash = om_hash(param, n * sizeof *param, OM_HASH_SEED);
    om_free(param);
    return hash;
}

// ---- learning -----------------------------------------------------------------------------------------------

static void test_it_learns(void** state) {
    (void)state;
    Task task = {0};
    OmNet* net = make_net(false);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.nepoch = 60;
    def.on_epoch = count_epoch;
    (void)train(&def, &r);
    assert_int_equal(task.nepoch, 60);
    assert_int_equal(r.nepoch, 60);
    assert_int_equal(r.nstep, 60 * (NTRAIN / 4));
    assert_int_equal(r.epoch[59].step, r.nstep);
    // From the variance of the targets, about 0.15, to what the average of the last weights reaches.
    assert_below(r.best_value, 0.02);
    assert_below(r.epoch[59].train, r.epoch[0].train / 5);
    assert_true(r.epoch[r.best_epoch - 1].valid == r.best_value);
    for (int i = 0; i < r.nepoch; ++i) {
        assert_true(r.epoch[i].valid >= r.best_value);
        assert_true(r.epoch[i].grad_norm > 0 && r.epoch[i].seconds >= 0);
    }
    // Each epoch leaves out 2 of 50 samples, not always the same ones.
    for (int i = 0; i < NTRAIN; ++i) assert_in_range(task.seen[i], 50, 60);
    om_train_result_done(&r);
    om_net_destroy(net);
}

static void test_cell_weights(void** state) {
    (void)state;
    Task task = {.has_cell_weight = true};
    OmNet* net = make_net(false);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.has_cell_weight = true;
    def.nepoch = 60;
    (void)train(&def, &r);
    assert_below(r.best_value, 0.02);  // as test_it_learns
    om_train_result_done(&r);
    def.loss.weight = (const float[]){1};
    assert_status(om_train_run(&def, NULL, NULL, &r), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "exclude each other"));
    om_net_destroy(net);
}

static void test_without_validation(void** state) {
    (void)state;
    Task task = {0};
    OmNet* net = make_net(true);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.nvalid = 0;
    (void)train(&def, &r);
    assert_int_equal(r.best_epoch, 12);
    assert_true(isnan(r.best_value) && isnan(r.epoch[3].valid));
    om_train_result_done(&r);
    om_net_destroy(net);
}

static void test_best_weights_and_patience(void** state) {
    (void)state;
    Task task = {.metric = 1};  // every validation is worse than the one before
    OmNet* net = make_net(false);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r, first;
    def.metric = metric;
    def.patience = 3;
    uint64_t kept = train(&def, &r);
    assert_true(r.is_early);
    assert_int_equal(r.nepoch, 4);
    assert_int_equal(r.best_epoch, 1);
    // What was kept are the weights after one epoch of the same training: those of a run stopped there.
    task.metric = 1;
    def.patience = 1;
    assert_true(train(&def, &first) == kept);
    assert_int_equal(first.nepoch, 2);
    om_train_result_done(&first);
    om_train_result_done(&r);
    def.patience = 0;
    def.valid_every = 5;
    task.metric = 1;
    (void)train(&def, &r);
    assert_int_equal(r.nepoch, 12);
    assert_true(!isnan(r.epoch[4].valid) && !isnan(r.epoch[9].valid) && !isnan(r.epoch[11].valid));
    assert_true(isnan(r.epoch[0].valid) && isnan(r.epoch[10].valid));
    om_train_result_done(&r);
    om_net_destroy(net);
}

static void test_seeds(void** state) {
    (void)state;
    Task a = {0}, b = {0}, c = {0};
    OmNet* net = make_net(true);
    OmTrainDef def = make_def(net, &a);
    OmTrainResult r;
    uint64_t hash = train(&def, &r);
    om_train_result_done(&r);
    def.ctx = &b;
    assert_true(train(&def, &r) == hash);
    om_train_result_done(&r);
    assert_true(a.draw_hash == b.draw_hash);
    def.ctx = &c;
    def.seed = 2;
    assert_true(train(&def, &r) != hash);
    om_train_result_done(&r);
    assert_true(a.draw_hash != c.draw_hash);
    om_net_destroy(net);
}

// A masked U-Net learns to spread a value over its neighbours, as a tissue does.
enum { SIDE = 8, NCELL = SIDE * SIDE * SIDE };

static OmStatus fill_field(void* ctx, const OmTrainBatch* b) {
    (void)ctx;
    for (int i = 0; i < b->count; ++i) {
        OmRng rng = om_rng_init(3, (uint64_t)b->sample[i] + (b->is_validation ? 1000 : 0));
        float *in = b->in + i * NCELL, *target = b->target + i * NCELL;
        int at[3];
        for (int k = 0; k < 3; ++k) at[k] = (int)om_rng_below(&rng, SIDE);
        for (int c = 0; c < NCELL; ++c) {
            int x = c % SIDE - at[0], y = c / SIDE % SIDE - at[1], z = c / SIDE / SIDE - at[2];
            in[c] = x == 0 && y == 0 && z == 0;
            target[c] = c % SIDE < 6 ? expf(-(float)(x * x + y * y + z * z) / 4) : 0;
        }
    }
    return OM_OK;
}

static void learn_field(OmNetType type) {
    OmNet* net;
    OmTrainResult r;
    float mask[NCELL];
    OmUnetDef unet = om_unet_default_def((OmNetShape){1, SIDE, SIDE, SIDE}, 1);
    for (int c = 0; c < NCELL; ++c) mask[c] = c % SIDE < 6;
    unet.nlevel = 1;
    unet.mask = mask;
    assert_ok(om_unet_create(&unet, &net));
    OmTrainDef def = om_train_default_def(net, fill_field, NULL);
    def.ntrain = 60;
    def.nvalid = 10;
    def.nepoch = 8;
    def.type = type;
    def.nworker = 1;
    def.loss.weight = mask;
    def.optim.average = 0.9;
    def.schedule = om_schedule_one_cycle(5e-3);
    float* param = om_alloc(om_net_parameter_size(net), sizeof *param);
    om_net_init_parameters(net, 1, param);
    OmStatus status = om_train_run(&def, NULL, param, &r);
    if (status == OM_UNAVAILABLE) {
        print_message("skip: %s\n", om_error_message());
    } else {
        assert_int_equal(status, OM_OK);
        assert_below(r.best_value, 0.1 * r.epoch[0].train);
    }
    om_train_result_done(&r);
    om_free(param);
    om_net_destroy(net);
}

static void test_u_net(void** state) {
    (void)state;
    learn_field(OM_F32);
    learn_field(OM_BF16);
}

// ---- stopping and going on ----------------------------------------------------------------------------------

static void rest_of_training(const char* dir, bool has_norm, uint64_t expected) {
    Task task = {0};
    OmNet* net = make_net(has_norm);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.dir = dir;
    assert_true(train(&def, &r) == expected);
    assert_true(r.is_resumed);
    assert_int_equal(r.nepoch, 12);
    om_train_result_done(&r);
    // Once ended, it gives what it has without a further step.
    int before = task.ncall;
    assert_true(train(&def, &r) == expected);
    assert_int_equal(task.ncall, before);
    om_train_result_done(&r);
    om_net_destroy(net);
}

static uint64_t uninterrupted(bool has_norm) {
    Task task = {0};
    OmNet* net = make_net(has_norm);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    uint64_t hash = train(&def, &r);
    om_train_result_done(&r);
    om_net_destroy(net);
    return hash;
}

static char self[512];  // this program

// The process that is killed: it trains in `dir` until its `kill_at`th batch.
static int train_until_killed(const char* dir, int kill_at, double period) {
    Task task = {.kill_at = kill_at};
    OmNet* net = make_net(true);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.dir = dir;
    def.checkpoint_period = period;
    (void)train(&def, &r);
    return 0;
}

static void test_killed(void** state) {
    (void)state;
    char dir[256], command[1024];
    uint64_t expected = uninterrupted(true);
    snprintf(dir, sizeof dir, "%s", temp_path("killed"));
    // In the first epoch, in a validation (steps 13 and 14 of 14 an epoch), much later; checkpoints at every step.
    const int kill_at[] = {5, 13, 14, 15, 77};
    for (int i = 0; i < 5; ++i) {
        assert_ok(om_path_remove(dir));
        snprintf(command, sizeof command, "exec %s %s %d 0", self, dir, kill_at[i]);
        int code = system(command);
        assert_true(WIFSIGNALED(code) && WTERMSIG(code) == SIGKILL);
        rest_of_training(dir, true, expected);
    }
    // Without a checkpoint yet: from the beginning.
    assert_ok(om_path_remove(dir));
    snprintf(command, sizeof command, "exec %s %s 30 1000", self, dir);
    assert_true(WIFSIGNALED(system(command)));
    Task task = {0};
    OmNet* net = make_net(true);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    def.dir = dir;
    assert_true(train(&def, &r) == expected);
    assert_false(r.is_resumed);
    om_train_result_done(&r);
    om_net_destroy(net);
    assert_ok(om_path_remove(dir));
}

typedef struct Stop {
    int count, at;
} Stop;

static bool go_on(void* ctx, const char* stage, double done, double total) {
    Stop* s = ctx;
    assert_string_equal(stage, "training");
    assert_true(done >= 0 && done <= total);
    return ++s->count != s->at;
}

static void test_cancelled(void** state) {
    (void)state;
    char dir[256];
    uint64_t expected = uninterrupted(false);
    snprintf(dir, sizeof dir, "%s", temp_path("cancelled"));
    for (int at = 1; at < 100; at += 31) {
        Task task = {0};
        OmNet* net = make_net(false);
        OmTrainDef def = make_def(net, &task);
        OmTrainResult r;
        Stop stop = {0, at};
        OmProgress progress = {go_on, &stop};
        float param[256];
        assert_true(om_net_parameter_size(net) <= 256);
        om_net_init_parameters(net, 1, param);
        def.dir = dir;
        def.checkpoint_period = 1000;
        assert_status(om_train_run(&def, &progress, param, &r), OM_CANCELLED);
        om_train_result_done(&r);
        om_net_destroy(net);
        rest_of_training(dir, false, expected);
        assert_ok(om_path_remove(dir));
    }
}

static void test_metrics_file(void** state) {
    (void)state;
    char dir[256], path[300], *text;
    size_t size;
    Task task = {0};
    OmNet* net = make_net(false);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    snprintf(dir, sizeof dir, "%s", temp_path("metrics"));
    snprintf(path, sizeof path, "%s/metrics.csv", dir);
    def.dir = dir;
    def.valid_every = 2;
    (void)train(&def, &r);
    assert_ok(om_file_read(path, 1 << 20, &text, &size));
    const char* line = text;
    assert_memory_equal(line, "epoch,step,train,valid,rate,grad_norm,seconds\n", 46);
    for (int i = 0; i < r.nepoch; ++i) {
        line = strchr(line, '\n') + 1;
        int epoch;
        long long step;
        double loss;
        assert_int_equal(sscanf(line, "%d,%lld,%lf,", &epoch, &step, &loss), 3);
        assert_int_equal(epoch, i + 1);
        assert_int_equal(step, r.epoch[i].step);
        assert_near_rel(loss, r.epoch[i].train, 1e-8);  // nine digits
    }
    assert_string_equal(strchr(line, '\n'), "\n");
    om_free(text);
    om_train_result_done(&r);
    assert_ok(om_path_remove(dir));
    om_net_destroy(net);
}

static void refused(OmTrainDef def, const char* sentence) {
    OmTrainResult r;
    float param[512] = {0};
    assert_true(om_net_parameter_size(def.net) <= 512);
    assert_status(om_train_run(&def, NULL, param, &r), OM_INVALID);
    if (!strstr(om_error_message(), sentence))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), sentence);
}

static void test_other_checkpoints(void** state) {
    (void)state;
    char dir[256], path[300], *bytes;
    size_t size;
    Task task = {0};
    OmNet *net = make_net(false), *other = make_net(true);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    snprintf(dir, sizeof dir, "%s", temp_path("others"));
    snprintf(path, sizeof path, "%s/checkpoint.safetensors", dir);
    def.dir = dir;
    def.nepoch = 2;
    (void)train(&def, &r);
    om_train_result_done(&r);
    OmTrainDef bad = def;
    bad.nepoch = 3;
    refused(bad, "other settings");
    bad = def;
    bad.optim.beta1 = 0.8;
    refused(bad, "other settings");
    bad = def;
    bad.data_hash = 1;
    refused(bad, "other training data");
    bad = def;
    bad.net = other;
    refused(bad, "another network");
    bad = def;
    bad.nworker = 2;  // changes no result that is promised
    (void)train(&bad, &r);
    om_train_result_done(&r);
    // Truncated anywhere, it is refused; no other state is made of it.
    assert_ok(om_file_read(path, 1 << 24, &bytes, &size));
    for (size_t cut = 0; cut < size; cut += size / 13) {
        write_bytes(path, bytes, cut);
        refused(def, "checkpoint.safetensors");
    }
    om_free(bytes);
    assert_ok(om_path_remove(dir));
    om_net_destroy(net);
    om_net_destroy(other);
}

// ---- ranks --------------------------------------------------------------------------------------------------

typedef struct Meeting {  // of two threads that play two ranks
    pthread_barrier_t barrier;
    float* value[2];
} Meeting;

typedef struct Rank {
    Meeting* meeting;
    OmTrainGroup group;
    OmTrainDef def;
    Task task;
    OmProgress progress;
    Stop stop;
    float param[512];
    OmStatus status;
    char message[256];
    OmTrainResult result;
} Rank;

static OmStatus mean_of_two(void* ctx, float* value, int64_t count) {
    Rank* r = ctx;
    Meeting* m = r->meeting;
    m->value[r->group.rank] = value;
    pthread_barrier_wait(&m->barrier);
    if (r->group.rank == 0)
        for (int64_t i = 0; i < count; ++i)
            m->value[0][i] = m->value[1][i] = (m->value[0][i] + m->value[1][i]) / 2;
    pthread_barrier_wait(&m->barrier);
    return OM_OK;
}

static void* run_rank(void* ctx) {
    Rank* r = ctx;
    om_net_init_parameters(r->def.net, 1, r->param);
    r->status = om_train_run(&r->def, &r->progress, r->param, &r->result);
    snprintf(r->message, sizeof r->message, "%s", om_error_message());
    return NULL;
}

static void run_two(const OmNet* net, Rank rank[2], const char* dir) {
    Meeting meeting;
    pthread_t thread[2];
    pthread_barrier_init(&meeting.barrier, NULL, 2);
    for (int i = 0; i < 2; ++i) {
        rank[i].meeting = &meeting;
        rank[i].group = (OmTrainGroup){i, 2, mean_of_two, &rank[i]};
        rank[i].def = make_def(net, &rank[i].task);
        rank[i].def.group = &rank[i].group;
        rank[i].def.batch = 3;
        rank[i].def.dir = dir;
        rank[i].progress = (OmProgress){go_on, &rank[i].stop};
    }
    for (int i = 0; i < 2; ++i) pthread_create(&thread[i], NULL, run_rank, &rank[i]);
    for (int i = 0; i < 2; ++i) pthread_join(thread[i], NULL);
    pthread_barrier_destroy(&meeting.barrier);
}

static void test_two_ranks(void** state) {
    (void)state;
    static Rank rank[2];
    OmNet* net = make_net(false);
    memset(rank, 0, sizeof rank);
    run_two(net, rank, NULL);
    assert_int_equal(rank[0].status, OM_OK);
    assert_int_equal(rank[1].status, OM_OK);
    size_t n = om_net_parameter_size(net);
    assert_memory_equal(rank[0].param, rank[1].param, n * sizeof(float));

    Task task = {0};
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    float param[512];
    def.batch = 6;
    om_net_init_parameters(net, 1, param);
    assert_ok(om_train_run(&def, NULL, param, &r));
    // Sums of three and three against sums of six, 96 steps, in float; Adam divides small gradients by their size.
    for (size_t i = 0; i < n; ++i) assert_near((double)param[i], (double)rank[0].param[i], 2e-4);
    for (int i = 0; i < r.nepoch; ++i) {
        assert_near_rel(r.epoch[i].train, rank[0].result.epoch[i].train, 1e-4);
        assert_near_rel(r.epoch[i].valid, rank[0].result.epoch[i].valid, 1e-3);
    }
    om_train_result_done(&r);
    om_train_result_done(&rank[0].result);
    om_train_result_done(&rank[1].result);
    om_net_destroy(net);
}

static void test_a_rank_that_ends(void** state) {
    (void)state;
    static Rank rank[2];
    char dir[256];
    snprintf(dir, sizeof dir, "%s", temp_path("ranks"));
    OmNet* net = make_net(true);
    // One fails: the other hears of it.
    memset(rank, 0, sizeof rank);
    rank[1].task.fail_at = 20;
    run_two(net, rank, NULL);
    assert_int_equal(rank[1].status, OM_IO);
    assert_int_equal(rank[0].status, OM_INVALID);
    assert_non_null(strstr(rank[0].message, "another rank failed"));
    assert_non_null(strstr(rank[1].message, "is lost"));
    // One is stopped: both stop at the same step, and go on to what they would have reached.
    static Rank whole[2], again[2];
    memset(rank, 0, sizeof rank);
    memset(whole, 0, sizeof whole);
    memset(again, 0, sizeof again);
    run_two(net, whole, NULL);
    rank[1].stop.at = 33;
    run_two(net, rank, dir);
    assert_int_equal(rank[0].status, OM_CANCELLED);
    assert_int_equal(rank[1].status, OM_CANCELLED);
    run_two(net, again, dir);
    assert_int_equal(again[0].status, OM_OK);
    assert_true(again[1].result.is_resumed);
    assert_memory_equal(again[1].param, whole[0].param, om_net_parameter_size(net) * sizeof(float));
    for (int i = 0; i < 2; ++i) {
        om_train_result_done(&whole[i].result);
        om_train_result_done(&again[i].result);
    }
    assert_ok(om_path_remove(dir));
    om_net_destroy(net);
}

// ---- failures -----------------------------------------------------------------------------------------------

static void test_failures(void** state) {
    (void)state;
    Task task = {.fail_at = 9}, infinite = {.is_infinite = true};
    OmNet* net = make_net(false);
    OmTrainDef def = make_def(net, &task);
    OmTrainResult r;
    float param[512] = {0};
    assert_status(om_train_run(&def, NULL, param, &r), OM_IO);
    assert_non_null(strstr(om_error_message(), "is lost"));
    def = make_def(net, &infinite);
    refused(def, "epoch 1, batch 0: the loss is inf");

    OmTrainDef bad[9];
    const char* name[9] = {"batch is 0", "nepoch", "valid_every", "patience", "ntrain",
                           "peak",       "beta2",  "terms",       "_def"};
    for (int i = 0; i < 9; ++i) bad[i] = make_def(net, &infinite);
    bad[0].batch = 0;
    bad[1].nepoch = 0;
    bad[2].valid_every = 0;
    bad[3].patience = -1;
    bad[4].ntrain = 3;
    name[4] = "3 samples do not fill";
    bad[5].schedule.peak = 0;
    bad[6].optim.beta2 = 2;
    bad[7].loss.nterm = 0;
    bad[8].cookie = 1;
    for (int i = 0; i < 9; ++i) refused(bad[i], name[i]);
    bad[0] = make_def(net, &infinite);
    bad[0].nvalid = 0;
    bad[0].patience = 1;
    refused(bad[0], "patience needs validation");
    om_net_destroy(net);
}

static OmStatus train_a_little(void* ctx) {
    const OmTrainDef* def = ctx;
    OmTrainResult r;
    float param[512];
    om_net_init_parameters(def->net, 1, param);
    OmStatus status = om_train_run(def, NULL, param, &r);
    om_train_result_done(&r);
    if (def->dir && status == OM_OK) status = om_path_remove(def->dir);
    return status;
}

static void test_no_memory(void** state) {
    (void)state;
    Task task = {0};
    char dir[256];
    OmNet* net = make_net(true);
    OmTrainDef def = make_def(net, &task);
    snprintf(dir, sizeof dir, "%s", temp_path("memory"));
    def.nepoch = 1;
    def.dir = dir;
    assert_true(test_failing_allocations(train_a_little, &def, 1) > 10);
    (void)om_path_remove(dir);
    om_net_destroy(net);
}

int main(void) {
    if (test_argc == 5)
        return train_until_killed(test_argv[2], atoi(test_argv[3]), atof(test_argv[4]));
    snprintf(self, sizeof self, "%s %s", test_argv[0], test_argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_it_learns),
        cmocka_unit_test(test_cell_weights),
        cmocka_unit_test(test_u_net),
        cmocka_unit_test(test_without_validation),
        cmocka_unit_test(test_best_weights_and_patience),
        cmocka_unit_test(test_seeds),
        cmocka_unit_test(test_killed),
        cmocka_unit_test(test_cancelled),
        cmocka_unit_test(test_metrics_file),
        cmocka_unit_test(test_other_checkpoints),
        cmocka_unit_test(test_two_ranks),
        cmocka_unit_test(test_a_rank_that_ends),
        cmocka_unit_test(test_failures),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
