// rl_retract_vary.c: domain randomisation of the task "retract" (thesis 5.6): bodies drawn at creation, one an episode.
//
// Thickness, stiffness and kidney belong to the constant part of a task: fat at rest, contact and pictures follow from
// them, and take a second to make. So a varied task has `nvariant` tasks of one body each; an episode draws one of them
// from its own random numbers. Body k is a function of k and the ranges. The tip error is not here: it is drawn in each
// episode of any body (rl_retract_state.c).
#include <math.h>
#include <string.h>

#include "rl/rl_retract_internal.h"

#define SEED 0x76617279ull
#define STREAM 0x40000u  // block of random numbers of an episode, apart from those of its body

typedef struct OmRlVaried {
    OmRlTask head;
    int n;
    OmRlTask* body[OM_RL_MAX_VARIANT];
} OmRlVaried;

typedef struct VariedState {
    int now;  // body of the episode
    void* of[OM_RL_MAX_VARIANT];
} VariedState;

static const OmRlVaried* varied_of(const OmRlTask* task) { return (const OmRlVaried*)task; }

static const OmRlTask* body_of(const OmRlTask* task, const void* state, void** of) {
    const VariedState* s = state;
    *of = s->of[s->now];
    return varied_of(task)->body[s->now];
}

static void destroy(OmRlTask* task) {
    OmRlVaried* t = (OmRlVaried*)task;
    if (!t) return;
    for (int k = 0; k < t->n; ++k) om_rl_task_destroy(t->body[k]);
    om_free(t);
}

static void state_destroy(const OmRlTask* task, void* state) {
    const OmRlVaried* t = varied_of(task);
    VariedState* s = state;
    if (!s) return;
    for (int k = 0; k < t->n; ++k) t->body[k]->ops->state_destroy(t->body[k], s->of[k]);
    om_free(s);
}

static OmStatus state_create(const OmRlTask* task, void** state) {
    const OmRlVaried* t = varied_of(task);
    *state = NULL;
    VariedState* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    for (int k = 0; k < t->n; ++k) {
        OmStatus status = t->body[k]->ops->state_create(t->body[k], &s->of[k]);
        if (status < 0) {
            state_destroy(task, s);
            return status;
        }
    }
    *state = s;
    return OM_OK;
}

static OmStatus reset(const OmRlTask* task, void* state, OmRng rng, int start) {
    VariedState* s = state;
    void* of;
    OmRng own = rng;
    own.counter[1] += STREAM;
    own.used = 4;
    s->now = (int)om_rng_below(&own, (uint32_t)varied_of(task)->n);
    const OmRlTask* body = body_of(task, state, &of);
    return body->ops->reset(body, of, rng, start);
}

static OmStatus step(const OmRlTask* task, void* state, const int* action, double* reward,
                     bool* is_terminated) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    return body->ops->step(body, of, action, reward, is_terminated);
}

static void observe(const OmRlTask* task, const void* state, float* obs) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    body->ops->observe(body, of, obs);
}

static OmStatus info(const OmRlTask* task, void* state, double* value) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    return body->ops->info(body, of, value);
}

static OmStatus render(const OmRlTask* task, void* state, OmPicture* picture) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    return body->ops->render(body, of, picture);
}

static void expert(const OmRlTask* task, const void* state, OmRng* rng, int* action) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    body->ops->expert(body, of, rng, action);
}

// All bodies have one mesh, so their states have one size.
static size_t state_size(const OmRlTask* task) {
    const OmRlTask* body = varied_of(task)->body[0];
    return sizeof(int64_t) + body->ops->state_size(body);
}

static void save(const OmRlTask* task, const void* state, void* block) {
    void* of;
    const OmRlTask* body = body_of(task, state, &of);
    int64_t now = ((const VariedState*)state)->now;
    memcpy(block, &now, sizeof now);
    body->ops->save(body, of, (unsigned char*)block + sizeof now);
}

static void restore(const OmRlTask* task, void* state, const void* block) {
    int64_t now;
    void* of;
    memcpy(&now, block, sizeof now);
    ((VariedState*)state)->now = (int)now;
    const OmRlTask* body = body_of(task, state, &of);
    body->ops->restore(body, of, (const unsigned char*)block + sizeof now);
}

static const OmRlTaskOps varied_ops = {.destroy = destroy,
                                       .state_create = state_create,
                                       .state_destroy = state_destroy,
                                       .reset = reset,
                                       .step = step,
                                       .observe = observe,
                                       .info = info,
                                       .render = render,
                                       .expert = expert,
                                       .state_size = state_size,
                                       .save = save,
                                       .restore = restore};

OmRlRetractDef om__rl_draw_body(const OmRlRetractDef* def, int k) {
    OmRlRetractDef d = *def;
    OmRng rng = om_rng_init(SEED, (uint64_t)k);
    double thickness = om_rng_range(&rng, -1, 1), soft = om_rng_uniform(&rng);
    double far = sqrt(om_rng_uniform(&rng)), way = om_rng_range(&rng, 0, 2 * OM_PI);
    d.nvariant = 1;
    d.thickness *= 1 + d.vary_thickness * thickness;
    d.young *= 1 - d.vary_softness * soft;
    d.cluster_stiffness *= 1 - d.vary_softness * soft;
    d.kidney_shift.x += d.vary_kidney * far * cos(way);
    d.kidney_shift.y += d.vary_kidney * far * sin(way);
    return d;
}

OmStatus om__rl_varied_create(const OmRlRetractDef* def, OmRlTask** task) {
    *task = NULL;
    OmRlVaried* t = om_calloc(1, sizeof *t);
    if (!t) return OM_NO_MEMORY;
    uint64_t hash = OM_HASH_SEED;
    for (int k = 0; k < def->nvariant; ++k) {
        OmRlRetractDef one = om__rl_draw_body(def, k);
        OmStatus status = om_rl_retract_create(&one, &t->body[k]);
        if (status < 0) {
            destroy(&t->head);
            return om_error_prefix(status, "variant %d", k);
        }
        ++t->n;
        hash = om_hash(&t->body[k]->hash, sizeof hash, hash);
    }
    t->head = *t->body[0];
    t->head.ops = &varied_ops;
    t->head.hash = hash;
    *task = &t->head;
    return OM_OK;
}
