// rl_settings.c: the settings of a task as text, and those of a policy's training beside those of its use.
//
// Two texts, a line KEY=VALUE each. `settings` has the words that the task was created with: the same words make the
// same task. `values` has every value that follows from them, defaults too, and says where two tasks differ.
#include <string.h>

#include "rl/rl_internal.h"

enum { MAX_SETTING = 128 };

OmStatus om__rl_settings_add(char* text, size_t size, const char* key, const char* value) {
    const size_t len = strlen(text);
    OM_CHECK(!strpbrk(key, "=\n") && !strchr(value, '\n'), OM_INVALID,
             "setting %s: a line break cannot be stored with a policy", key);
    const int n = snprintf(text + len, size - len, "%s=%s\n", key, value);
    if (n < 0 || (size_t)n >= size - len) text[len] = '\0';
    OM_CHECK(n >= 0 && (size_t)n < size - len, OM_INVALID,
             "the settings of the task have more than %zu bytes", size - 1);
    return OM_OK;
}

OmStatus om__rl_settings_fill(OmRlTask* task, const OmRlSetting* setting, int nsetting) {
    task->settings[0] = '\0';
    for (int k = 0; k < nsetting; ++k)
        OM_TRY(om__rl_settings_add(task->settings, sizeof task->settings, setting[k].key,
                                   setting[k].value));
    if (task->values[0]) return OM_OK;
    // of a task without a list of its own: what steps mean, and their number
    char step[24];
    snprintf(task->values, sizeof task->values, "%s%s", task->meaning,
             task->meaning[0] ? "\n" : "");
    for (char* at = task->values; *at; ++at)
        if (*at == ' ') *at = '\n';
    snprintf(step, sizeof step, "%d", task->max_step);
    return om__rl_settings_add(task->values, sizeof task->values, "max_step", step);
}

// The next line of `text` into key and value; null behind the last one.
static const char* next_line(const char* text, char key[OM_RL_SETTINGS],
                             char value[OM_RL_SETTINGS]) {
    const size_t len = strcspn(text, "\n");
    const char* equal = memchr(text, '=', len);
    if (!text[0] || !equal) return NULL;
    snprintf(key, OM_RL_SETTINGS, "%.*s", (int)(equal - text), text);
    snprintf(value, OM_RL_SETTINGS, "%.*s", (int)(text + len - equal - 1), equal + 1);
    return text + len + (text[len] == '\n');
}

static bool has_key(const OmRlSetting* setting, int n, const char* key) {
    for (int k = 0; k < n; ++k)
        if (strcmp(setting[k].key, key) == 0) return true;
    return false;
}

typedef struct Words {
    OmRlSetting setting[MAX_SETTING];
    char text[2 * OM_RL_SETTINGS];  // of the policy's lines, each part ended
    int n;
} Words;

static bool has_line(const char* lines, const OmRlSetting* setting) {
    char key[OM_RL_SETTINGS], value[OM_RL_SETTINGS];
    while ((lines = next_line(lines, key, value)) != NULL)
        if (strcmp(key, setting->key) == 0 && strcmp(value, setting->value) == 0) return true;
    return false;
}

// The policy's lines whose keys are not given, then the given settings. The order counts, as "world" changes values of
// other settings: settings that only repeat the policy's lines stay in their place.
static OmStatus join(const OmRlPolicyDef* policy, const OmRlSetting* setting, int nsetting,
                     Words* w) {
    char key[OM_RL_SETTINGS], value[OM_RL_SETTINGS];
    size_t used = 0;
    for (; nsetting > 0 && has_line(policy->settings, setting); --nsetting) ++setting;
    for (const char* at = policy->settings; (at = next_line(at, key, value)) != NULL;) {
        if (has_key(setting, nsetting, key)) continue;
        OM_CHECK(w->n < MAX_SETTING, OM_INVALID, "more than %d settings", MAX_SETTING);
        w->setting[w->n++] = (OmRlSetting){strcpy(w->text + used, key),
                                           strcpy(w->text + used + strlen(key) + 1, value)};
        used += strlen(key) + strlen(value) + 2;
    }
    OM_CHECK(w->n + nsetting <= MAX_SETTING, OM_INVALID, "more than %d settings", MAX_SETTING);
    for (int k = 0; k < nsetting; ++k) w->setting[w->n++] = setting[k];
    return OM_OK;
}

OmStatus om_rl_policy_task(const OmRlPolicy* policy, const OmRlSetting* setting, int nsetting,
                           OmRlTask** task) {
    const OmRlPolicyDef* def = om_rl_policy_def(policy);
    *task = NULL;
    Words* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    OmStatus status = join(def, setting, nsetting, w);
    if (status >= 0) status = om_rl_task_create(def->task, w->setting, w->n, task);
    om_free(w);
    return status;
}

bool om_rl_policy_is_stated(const OmRlPolicy* policy) {
    return om_rl_policy_def(policy)->values[0] != '\0';
}

OmStatus om_rl_policy_differ(const OmRlPolicy* policy, const OmRlTask* task, OmText* text) {
    char key[OM_RL_SETTINGS], was[OM_RL_SETTINGS], other[OM_RL_SETTINGS], now[OM_RL_SETTINGS];
    const char* comma = "";
    for (const char* at = om_rl_policy_def(policy)->values;
         (at = next_line(at, key, was)) != NULL;) {
        for (const char* to = task->values; (to = next_line(to, other, now)) != NULL;) {
            if (strcmp(key, other) != 0 || strcmp(was, now) == 0) continue;
            OM_TRY(om_text_append(text, "%s%s %s (here %s)", comma, key, was, now));
            comma = ", ";
        }
    }
    return OM_OK;
}
