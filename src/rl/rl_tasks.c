// rl_tasks.c: the list of tasks, and their settings as a user writes them.
#include <math.h>
#include <string.h>

#include "rl/rl_internal.h"

static const OmRlTaskKind kinds[] = {
    {"approach", "come down on tissue, or pull it, for `omentum retract` (3 x 3 x 3 choices)",
     om__rl_approach_create},
    {"cart-pole", "balance a pole on a cart (2 choices)", om__rl_cart_pole_create},
    {"expose", "lift fat off a kidney with two arms (3^6 choices)", om__rl_expose_create},
    {"press", "find a lesion by pressing (3 x 3 x 3 x 2 choices)", om__rl_press_create},
    {"reach", "move a tip to a goal in a box (3 x 3 choices)", om__rl_reach_create},
    {"retract", "lift fat off a kidney until a tumour is seen (3 x 3 x 3 choices)",
     om__rl_retract_create},
};
enum { NKIND = sizeof kinds / sizeof kinds[0] };

const OmRlTaskKind* om_rl_task_kind(int i) { return i >= 0 && i < NKIND ? &kinds[i] : NULL; }

void om__rl_plain_destroy(OmRlTask* task) { om_free(task); }

OmStatus om__rl_plain_state_create(const OmRlTask* task, void** state) {
    *state = om_calloc(1, task->ops->state_size(task));
    return *state ? OM_OK : OM_NO_MEMORY;
}

void om__rl_plain_state_destroy(const OmRlTask* task, void* state) {
    (void)task;
    om_free(state);
}

void om__rl_observe(const OmRlTask* task, const void* state, float* obs) {
    task->ops->observe(task, state, obs);
    for (int i = 0; i < task->nobservation; ++i)
        obs[i] = fminf(fmaxf(obs[i], task->obs_lo), task->obs_hi);
}

OmStatus om__rl_check_bounds(const OmRlTask* t) {
    OM_CHECK(isfinite(t->obs_lo) && isfinite(t->obs_hi) && t->obs_lo < t->obs_hi, OM_INVALID,
             "task %s: values of an observation are between %g and %g: set obs_lo below obs_hi",
             t->name, (double)t->obs_lo, (double)t->obs_hi);
    return OM_OK;
}

static OmStatus check_task(const OmRlTask* t) {
    OM_CHECK(t->nobservation > 0 && t->max_step > 0, OM_INVALID, "task %s: nothing to observe",
             t->name);
    OM_TRY(om__rl_check_bounds(t));
    OM_CHECK(t->naction > 0 && t->naction <= OM_RL_MAX_ACTION, OM_INVALID,
             "task %s: an action of %d components", t->name, t->naction);
    for (int k = 0; k < t->naction; ++k)
        OM_CHECK(t->nchoice[k] >= 2, OM_INVALID, "task %s: component %d has %d choices", t->name, k,
                 t->nchoice[k]);
    OM_CHECK(om_rl_task_nlogit(t) <= OM_RL_MAX_CHOICE, OM_INVALID,
             "task %s: more than %d choices together", t->name, OM_RL_MAX_CHOICE);
    for (int k = 0; k < t->nkey; ++k)
        OM_CHECK(t->key[k].component >= 0 && t->key[k].component < t->naction &&
                     t->key[k].choice >= 0 && t->key[k].choice < t->nchoice[t->key[k].component],
                 OM_INVALID, "task %s: key %d has no such choice", t->name, k);
    OM_CHECK(t->ninfo >= 0 && t->ninfo <= OM_RL_MAX_INFO, OM_INVALID, "task %s: %d infos", t->name,
             t->ninfo);
    return OM_OK;
}

OmStatus om_rl_task_create(const char* name, const OmRlSetting* setting, int nsetting,
                           OmRlTask** task) {
    const char* names[NKIND];
    *task = NULL;
    for (int i = 0; i < NKIND; ++i) {
        names[i] = kinds[i].name;
        if (strcmp(kinds[i].name, name) != 0) continue;
        OmRlTask* made;
        OM_TRY(kinds[i].create(setting, nsetting, &made));
        OmStatus status = check_task(made);
        if (status >= 0) status = om__rl_settings_fill(made, setting, nsetting);
        if (status < 0)
            om_rl_task_destroy(made);
        else
            *task = made;
        return status;
    }
    const char* near = om_nearest_word(name, names, NKIND);
    return om_error(OM_INVALID, "no task \"%s\"%s%s%s", name, near ? "; did you mean " : "",
                    near ? near : "", near ? "?" : "");
}

void om_rl_task_destroy(OmRlTask* task) {
    if (task) task->ops->destroy(task);
}

int om_rl_task_nlogit(const OmRlTask* task) {
    int sum = 0;
    for (int k = 0; k < task->naction; ++k) sum += task->nchoice[k];
    return sum;
}

void om_rl_task_rest(const OmRlTask* task, int* action) {
    for (int k = 0; k < task->naction; ++k)
        if (task->rest[k] >= 0) action[k] = task->rest[k];
}

bool om_rl_task_press(const OmRlTask* task, int key, int* action) {
    for (int i = 0; i < task->nkey; ++i) {
        if (task->key[i].key != key) continue;
        action[task->key[i].component] = task->key[i].choice;
        return true;
    }
    return false;
}

OmStatus om__rl_setting_number(const char* task, const OmRlSetting* setting, double lo, double hi,
                               double* value) {
    const char* at = setting->value;
    const char* end = at + strlen(at);
    double v;
    OM_CHECK(om_number_parse(&at, end, &v) && at == end, OM_INVALID,
             "task %s: %s is \"%s\", must be a number", task, setting->key, setting->value);
    OM_CHECK(v >= lo && v <= hi, OM_INVALID, "task %s: %s is %s, outside %g to %g", task,
             setting->key, setting->value, lo, hi);
    *value = v;
    return OM_OK;
}

OmStatus om__rl_setting_unknown(const char* task, const OmRlSetting* setting,
                                const char* const* known) {
    int n = 0;
    while (known[n]) ++n;
    const char* near = om_nearest_word(setting->key, known, n);
    return om_error(OM_INVALID, "task %s has no setting \"%s\"%s%s%s", task, setting->key,
                    near ? "; did you mean " : "", near ? near : "", near ? "?" : "");
}
