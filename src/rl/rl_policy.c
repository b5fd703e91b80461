// rl_policy.c: actor and critic: creation, files, actions.
//
// The networks run with one worker each: at batches of 16 to 4096 oneDNN's dense layers of 128 reach 66 to 80 GFlop/s
// on one thread, and 25 to 110 on two. So the bytes of a training do not depend on the number of workers.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rl/rl_internal.h"

#define COOKIE 0x706f6c69u
#define KIND "omentum policy 1"
#define HEAD_SCALE \
    0.01f  // of the actor's last layer at the start: all actions are about equally probable
enum { NNET = 2, MAX_TENSOR = 64, MAX_META = 40 };

struct OmRlPolicy {
    OmRlPolicyDef def;
    OmNet* net[NNET];
    float* param[NNET];
};

struct OmRlActor {
    OmRlPolicy* policy;
    OmNetRun* run;
    int n;
    float* logit;  // (n x nlogit)
};

static int count_logit(const OmRlPolicyDef* d) {
    int sum = 0;
    for (int k = 0; k < d->naction; ++k) sum += d->nchoice[k];
    return sum;
}

OmRlPolicyDef om_rl_policy_default_def(const OmRlTask* task) {
    OmRlPolicyDef def = {.cookie = COOKIE,
                         .nobservation = task->nobservation,
                         .naction = task->naction,
                         .nlayer = 2,
                         .width = 128,
                         .activation = OM_TANH,
                         .seed = 1};
    if (task->picture_width >= OM_RL_MIN_SIDE && task->picture_height >= OM_RL_MIN_SIDE) {
        def.picture_width = task->picture_width;
        def.picture_height = task->picture_height;
        def.activation = OM_RELU;
    }
    memcpy(def.task, task->name, sizeof def.task);
    memcpy(def.nchoice, task->nchoice, sizeof def.nchoice);
    memcpy(def.settings, task->settings, sizeof def.settings);
    memcpy(def.values, task->values, sizeof def.values);
    return def;
}

static OmStatus check_def(const OmRlPolicyDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID, "policy: begin with om_rl_policy_default_def()");
    OM_CHECK(d->nobservation > 0 && d->nobservation <= 1 << 20, OM_INVALID,
             "policy: nobservation is %d", d->nobservation);
    OM_CHECK(d->naction > 0 && d->naction <= OM_RL_MAX_ACTION, OM_INVALID, "policy: naction is %d",
             d->naction);
    for (int k = 0; k < d->naction; ++k)
        OM_CHECK(d->nchoice[k] >= 2 && d->nchoice[k] <= OM_RL_MAX_CHOICE, OM_INVALID,
                 "policy: nchoice[%d] is %d", k, d->nchoice[k]);
    OM_CHECK(count_logit(d) <= OM_RL_MAX_CHOICE, OM_INVALID, "policy: more than %d choices",
             OM_RL_MAX_CHOICE);
    OM_CHECK(d->nlayer >= 1 && d->nlayer <= 8, OM_INVALID, "policy: nlayer is %d, outside 1 to 8",
             d->nlayer);
    OM_CHECK(d->width >= 1 && d->width <= 4096, OM_INVALID,
             "policy: width is %d, outside 1 to 4096", d->width);
    const int w = d->picture_width, h = d->picture_height;
    bool is_picture = w >= OM_RL_MIN_SIDE && h >= OM_RL_MIN_SIDE && w <= 1024 && h <= 1024;
    OM_CHECK((w == 0 && h == 0) || (is_picture && d->nobservation == 3 * w * h), OM_INVALID,
             "policy: a picture of %d x %d pixels for %d observed values; sides are from %d to "
             "1024, 3 values a pixel",
             w, h, d->nobservation, OM_RL_MIN_SIDE);
    OM_CHECK(d->activation >= OM_RELU && d->activation <= OM_SIGMOID, OM_INVALID,
             "policy: no activation %d", (int)d->activation);
    return OM_OK;
}

// The convolutions of Mnih et al. 2015. A row of the picture holds 3 values a pixel: as a volume of one channel,
// height x width x 3, it needs no transposition, and the kernel of the first layer spans the 3 values.
static int add_eyes(OmNet* net, const char* name, int x, OmActivation activation) {
    static const struct {
        int channels, kernel, stride, colours;
    } layer[] = {{32, 8, 4, 3}, {64, 4, 2, 1}, {64, 3, 1, 1}};
    for (int i = 0; i < 3; ++i) {
        char text[OM_NET_NAME];
        int k = layer[i].kernel, s = layer[i].stride;
        OmNetConv conv = {.channels = layer[i].channels,
                          .kernel = {k, k, layer[i].colours},
                          .stride = {s, s, 1},
                          .has_bias = true};
        snprintf(text, sizeof text, "%s.eye%d", name, i);
        x = om_net_add_activation(net, om_net_add_conv(net, text, x, conv), activation, 0.01f);
    }
    return x;
}

// Hidden layers and the head behind layer x.
static OmStatus finish_perceptron(OmNet* net, const char* name, int x, const OmRlPolicyDef* d,
                                  int nout) {
    char text[OM_NET_NAME];
    for (int i = 0; i < d->nlayer; ++i) {
        snprintf(text, sizeof text, "%s.%d", name, i);
        x = om_net_add_dense(net, text, x, d->width);
        x = om_net_add_activation(net, x, d->activation, 0.01f);
    }
    snprintf(text, sizeof text, "%s.head", name);
    return om_net_finish(net, om_net_add_dense(net, text, x, nout));
}

OmStatus om__rl_perceptron(const char* name, int nin, int nlayer, int width,
                           OmActivation activation, int nout, OmNet** net) {
    const OmRlPolicyDef d = {.nlayer = nlayer, .width = width, .activation = activation};
    OM_TRY(om_net_create(net));
    int x = om_net_add_input(*net, "input", (OmNetShape){nin, 1, 1, 1});
    return finish_perceptron(*net, name, x, &d, nout);
}

static OmStatus make_net(const OmRlPolicyDef* d, const char* name, int nout, OmNet** net) {
    if (d->picture_width == 0)
        return om__rl_perceptron(name, d->nobservation, d->nlayer, d->width, d->activation, nout,
                                 net);
    OM_TRY(om_net_create(net));
    OmNetShape shape = {1, d->picture_height, d->picture_width, 3};
    int x = add_eyes(*net, name, om_net_add_input(*net, "input", shape), d->activation);
    return finish_perceptron(*net, name, x, d, nout);
}

static void scale_parameter(OmRlPolicy* p, const char* name, float scale) {
    const OmNetParameter* of = om_net_parameter(p->net[0], om_net_find_parameter(p->net[0], name));
    for (int64_t i = of->adr; i < of->adr + of->num; ++i) p->param[0][i] *= scale;
}

OmStatus om_rl_policy_create(const OmRlPolicyDef* def, OmRlPolicy** policy) {
    static const char* const name[NNET] = {"actor", "critic"};
    OmStatus status = OM_OK;
    *policy = NULL;
    OM_TRY(check_def(def));
    OmRlPolicy* p = om_calloc(1, sizeof *p);
    if (!p) return OM_NO_MEMORY;
    p->def = *def;
    for (int i = 0; i < NNET; ++i) {
        OM_TRY_DONE(make_net(def, name[i], i ? 1 : count_logit(def), &p->net[i]));
        OM_ALLOC_DONE(p->param[i], om_net_parameter_size(p->net[i]));
        om_net_init_parameters(p->net[i], def->seed + (uint64_t)i * 7919, p->param[i]);
    }
    scale_parameter(p, "actor.head.weight", HEAD_SCALE);
    *policy = p;
    p = NULL;
done:
    om_rl_policy_destroy(p);
    return status;
}

void om_rl_policy_destroy(OmRlPolicy* policy) {
    if (!policy) return;
    for (int i = 0; i < NNET; ++i) {
        om_net_destroy(policy->net[i]);
        om_free(policy->param[i]);
    }
    om_free(policy);
}

const OmRlPolicyDef* om_rl_policy_def(const OmRlPolicy* policy) { return &policy->def; }

const OmNet* om_rl_policy_net(const OmRlPolicy* policy, OmRlNet which) {
    return policy->net[which == OM_RL_CRITIC];
}

float* om_rl_policy_parameters(OmRlPolicy* policy, OmRlNet which) {
    return policy->param[which == OM_RL_CRITIC];
}

void om__rl_policy_set_task(OmRlPolicy* policy, const OmRlTask* task) {
    memcpy(policy->def.settings, task->settings, sizeof policy->def.settings);
    memcpy(policy->def.values, task->values, sizeof policy->def.values);
}

OmStatus om_rl_policy_check(const OmRlPolicy* policy, const OmRlTask* task) {
    const OmRlPolicyDef* d = &policy->def;
    OM_CHECK(strcmp(d->task, task->name) == 0, OM_INVALID, "the policy is of task %s, not of %s",
             d->task, task->name);
    bool is_alike = d->nobservation == task->nobservation && d->naction == task->naction;
    for (int k = 0; is_alike && k < d->naction; ++k) is_alike = d->nchoice[k] == task->nchoice[k];
    if (d->picture_width > 0)
        is_alike = is_alike && d->picture_width == task->picture_width &&
                   d->picture_height == task->picture_height;
    OM_CHECK(is_alike, OM_INVALID,
             "the policy was trained with other observations or actions of task %s (%d values, %d "
             "components)",
             d->task, d->nobservation, d->naction);
    return OM_OK;
}

// ---- files --------------------------------------------------------------------------------------------

// The tensors of both networks.
static int list_tensors(const OmRlPolicy* p, OmTensor out[MAX_TENSOR]) {
    int n = 0;
    for (int i = 0; i < NNET; ++i) {
        for (int k = 0; k < om_net_parameter_count(p->net[i]); ++k) {
            const OmNetParameter* q = om_net_parameter(p->net[i], k);
            OmTensor* t = &out[n++];
            *t = (OmTensor){q->name, OM_TENSOR_F32, q->ndim, {0}, p->param[i] + q->adr};
            for (int j = 0; j < q->ndim; ++j) t->dim[j] = q->dim[j];
        }
    }
    return n;
}

// 4 x (3 convolutions, 8 hidden layers and a head) tensors at most, so MAX_TENSOR is enough.
OmStatus om_rl_policy_save(const OmRlPolicy* policy, const OmTextPair* meta, int nmeta,
                           const char* path) {
    const OmRlPolicyDef* d = &policy->def;
    OmTensor tensor[MAX_TENSOR];
    OmTextPair pair[MAX_META];
    char size[4][16], picture[32], choice[OM_RL_MAX_ACTION * 4] = "", checksum[20], activation[16];
    int n = 0, ntensor = list_tensors(policy, tensor), len = 0;
    snprintf(size[0], sizeof size[0], "%d", d->nobservation);
    snprintf(size[1], sizeof size[1], "%d", d->naction);
    snprintf(size[2], sizeof size[2], "%d", d->nlayer);
    snprintf(size[3], sizeof size[3], "%d", d->width);
    snprintf(activation, sizeof activation, "%d", (int)d->activation);
    for (int k = 0; k < d->naction; ++k)
        len += snprintf(choice + len, sizeof choice - (size_t)len, k ? " %d" : "%d", d->nchoice[k]);
    snprintf(picture, sizeof picture, "%d %d", d->picture_width, d->picture_height);
    snprintf(checksum, sizeof checksum, "%016llx",
             (unsigned long long)om_tensor_checksum(tensor, ntensor));
    const OmTextPair own[] = {
        {"content", KIND},       {"task", d->task},          {"observations", size[0]},
        {"components", size[1]}, {"choices", choice},        {"layers", size[2]},
        {"width", size[3]},      {"activation", activation}, {"checksum", checksum}};
    for (size_t i = 0; i < sizeof own / sizeof *own; ++i) pair[n++] = own[i];
    if (d->values[0]) {
        pair[n++] = (OmTextPair){"settings", d->settings};
        pair[n++] = (OmTextPair){"values", d->values};
    }
    if (d->picture_width > 0) pair[n++] = (OmTextPair){"picture", picture};
    OM_CHECK(nmeta >= 0 && nmeta <= MAX_META - n, OM_INVALID, "policy: %d lines of metadata",
             nmeta);
    for (int i = 0; i < nmeta; ++i) pair[n++] = meta[i];
    return om_tensor_file_save(tensor, ntensor, pair, n, path);
}

static OmStatus read_choices(const char* path, const char* text, OmRlPolicyDef* d) {
    const char *at = text, *end = text ? text + strlen(text) : NULL;
    for (int k = 0; k < d->naction; ++k) {
        int64_t value = 0;
        if (k && at && at < end) ++at;
        OM_CHECK(at && om_integer_parse(&at, end, &value) && value >= 2 &&
                     value <= OM_RL_MAX_CHOICE,
                 OM_INVALID, "%s: choices of %d components are missing", path, d->naction);
        d->nchoice[k] = (int)value;
    }
    OM_CHECK(at == end, OM_INVALID, "%s: choices of more than %d components", path, d->naction);
    return OM_OK;
}

// "84 84"; null: the observation is no picture.
static OmStatus read_picture(const char* path, const char* text, OmRlPolicyDef* d) {
    const char *at = text, *end = text ? text + strlen(text) : NULL;
    int64_t width = 0, height = 0;
    if (!text) return OM_OK;
    bool is_good = om_integer_parse(&at, end, &width) && at < end && *at++ == ' ' &&
                   om_integer_parse(&at, end, &height) && at == end;
    OM_CHECK(is_good && width >= OM_RL_MIN_SIDE && width <= 1024 && height >= OM_RL_MIN_SIDE &&
                 height <= 1024,
             OM_INVALID, "%s: picture is \"%.20s\", must be width and height from %d to 1024", path,
             text, OM_RL_MIN_SIDE);
    d->picture_width = (int)width;
    d->picture_height = (int)height;
    return OM_OK;
}

// Lines KEY=VALUE; "" where the file does not state them.
static OmStatus read_lines(const OmTensorFile* file, const char* path, const char* key,
                           char out[OM_RL_SETTINGS]) {
    const char* text = om_tensor_file_meta(file, key);
    if (!text) return OM_OK;
    OM_CHECK(strlen(text) < OM_RL_SETTINGS, OM_INVALID, "%s: %s has more than %d bytes", path, key,
             OM_RL_SETTINGS - 1);
    strcpy(out, text);
    return OM_OK;
}

static OmStatus read_def(const OmTensorFile* file, const char* path, OmRlPolicyDef* d) {
    const char* kind = om_tensor_file_meta(file, "content");
    const char* task = om_tensor_file_meta(file, "task");
    int activation;
    OM_CHECK(kind && strcmp(kind, KIND) == 0, OM_INVALID, "%s: is not a policy", path);
    OM_CHECK(task && strlen(task) < sizeof d->task, OM_INVALID, "%s: names no task", path);
    *d = (OmRlPolicyDef){.cookie = COOKIE, .seed = 1};
    memcpy(d->task, task, strlen(task) + 1);
    OM_TRY(om_tensor_file_setting(file, path, "observations", 1, 1 << 20, &d->nobservation));
    OM_TRY(om_tensor_file_setting(file, path, "components", 1, OM_RL_MAX_ACTION, &d->naction));
    OM_TRY(om_tensor_file_setting(file, path, "layers", 1, 8, &d->nlayer));
    OM_TRY(om_tensor_file_setting(file, path, "width", 1, 4096, &d->width));
    OM_TRY(om_tensor_file_setting(file, path, "activation", OM_RELU, OM_SIGMOID, &activation));
    d->activation = (OmActivation)activation;
    OM_TRY(read_lines(file, path, "settings", d->settings));
    OM_TRY(read_lines(file, path, "values", d->values));
    OM_TRY(read_picture(path, om_tensor_file_meta(file, "picture"), d));
    return read_choices(path, om_tensor_file_meta(file, "choices"), d);
}

OmStatus om_rl_policy_load(const char* path, OmRlPolicy** policy) {
    OmTensorFile* file = NULL;
    OmRlPolicy* p = NULL;
    OmRlPolicyDef def;
    OmStatus status;
    *policy = NULL;
    OM_TRY(om_tensor_file_load(path, &file));
    OM_TRY_DONE(om_tensor_file_check(file, path));
    OM_TRY_DONE(read_def(file, path, &def));
    OM_TRY_DONE(om_rl_policy_create(&def, &p));
    for (int i = 0; i < NNET; ++i) {
        for (int k = 0; k < om_net_parameter_count(p->net[i]); ++k) {
            const OmNetParameter* q = om_net_parameter(p->net[i], k);
            int64_t dim[5];
            for (int j = 0; j < q->ndim; ++j) dim[j] = q->dim[j];
            status = om_tensor_file_read(file, q->name, q->ndim, dim, p->param[i] + q->adr);
            if (status < 0) {
                status = om_error_prefix(status, "%s", path);
                goto done;
            }
        }
    }
    *policy = p;
    p = NULL;
done:
    om_rl_policy_destroy(p);
    om_tensor_file_destroy(file);
    return status;
}

OmStatus om_rl_policy_save_onnx(const OmRlPolicy* policy, const char* path) {
    OmTextPair meta[] = {{"task", policy->def.task}};
    return om_net_save_onnx(policy->net[0], policy->param[0], meta, 1, path);
}

// ---- acting -------------------------------------------------------------------------------------------

OmStatus om__rl_run_create(const OmNet* net, int n, bool is_training, OmNetRun** run) {
    OmNetRunDef def = om_net_run_default_def(n);
    def.nworker = 1;
    def.is_training = is_training;
    return om_net_run_create(net, &def, run);
}

OmStatus om_rl_actor_create(OmRlPolicy* policy, int n, OmRlActor** actor) {
    OmStatus status = OM_OK;
    *actor = NULL;
    OM_CHECK(n > 0, OM_INVALID, "actor: %d observations", n);
    OmRlActor* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    a->policy = policy;
    a->n = n;
    OM_ALLOC_DONE(a->logit, (size_t)n * (size_t)count_logit(&policy->def));
    OM_TRY_DONE(om__rl_run_create(policy->net[0], n, false, &a->run));
    OM_TRY_DONE(om_rl_actor_update(a));
    *actor = a;
    a = NULL;
done:
    om_rl_actor_destroy(a);
    return status;
}

void om_rl_actor_destroy(OmRlActor* actor) {
    if (!actor) return;
    om_net_run_destroy(actor->run);
    om_free(actor->logit);
    om_free(actor);
}

OmStatus om_rl_actor_update(OmRlActor* actor) {
    return om_net_run_set_parameters(actor->run, actor->policy->param[0]);
}

OmStatus om_rl_actor_act(OmRlActor* actor, const float* obs, OmRng* rng, int* action,
                         float* log_prob) {
    const OmRlPolicyDef* d = &actor->policy->def;
    int nlogit = count_logit(d);
    OM_TRY(om_net_run_forward(actor->run, obs, actor->logit));
    for (int i = 0; i < actor->n; ++i) {
        double value =
            om__rl_choice_draw(d->naction, d->nchoice, actor->logit + (ptrdiff_t)i * nlogit,
                               rng ? &rng[i] : NULL, action + (ptrdiff_t)i * d->naction);
        OM_CHECK(isfinite(value), OM_INVALID, "the policy gives a value that is not finite");
        if (log_prob) log_prob[i] = (float)value;
    }
    return OM_OK;
}

void om__rl_policy_sharpen(OmRlPolicy* p, double sharpness) {
    scale_parameter(p, "actor.head.weight", (float)sharpness);
    scale_parameter(p, "actor.head.bias", (float)sharpness);
}
