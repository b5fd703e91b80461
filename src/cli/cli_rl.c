// cli_rl.c: tasks of omentum rl from the command line.
#include "cli_rl.h"

#include <stddef.h>
#include <string.h>

#include "omentum/scene_yaml.h"

enum { MAX_SETTING = 64, KEY = 64 };

static const OmYamlField setting_field[] = {
    {"key", OM_YAML_STRING, 0, .size = 64, .is_required = true},
    {"value", OM_YAML_STRING, 64, .size = OM_CLI_RL_TEXT, .is_required = true},
};
static const OmYamlSchema setting_schema = {"setting", setting_field, 2};

// A text for each option of the table, and the list of settings.
static OmStatus read_file(const OmCliArgs* args, const char* path, OmCliRlWords* w) {
    OmYamlField field[OM_CLI_RL_OPTION + 2];
    int n = 0;
    OM_CHECK(args->noption <= OM_CLI_RL_OPTION, OM_INVALID, "too many options");
    for (int i = 0; i < args->noption; ++i) {
        const char* name = args->option[i].name + 2;
        if (strcmp(name, "config") == 0 || strcmp(name, "set") == 0) continue;
        if (strcmp(name, "eval-set") == 0) {
            field[n++] = (OmYamlField){.key = "eval-set",
                                       .kind = OM_YAML_LIST,
                                       .offset = offsetof(OmCliRlWords, eval_setting),
                                       .size = sizeof w->eval_setting[0],
                                       .sub = &setting_schema,
                                       .count_offset = offsetof(OmCliRlWords, neval_setting),
                                       .capacity = OM_CLI_RL_SETTING};
            continue;
        }
        field[n++] =
            (OmYamlField){.key = name,
                          .kind = OM_YAML_STRING,
                          .offset = offsetof(OmCliRlWords, text) + (size_t)i * OM_CLI_RL_TEXT,
                          .size = OM_CLI_RL_TEXT};
    }
    field[n++] = (OmYamlField){.key = "set",
                               .kind = OM_YAML_LIST,
                               .offset = offsetof(OmCliRlWords, setting),
                               .size = sizeof w->setting[0],
                               .sub = &setting_schema,
                               .count_offset = offsetof(OmCliRlWords, nsetting),
                               .capacity = OM_CLI_RL_SETTING};
    const OmYamlSchema schema = {"options", field, n};
    return om_yaml_load(path, &schema, w);
}

static void put_settings(OmCliRlWords* w, const char* option, const OmCliRlSetting* setting,
                         int nsetting, int* nword, int* n) {
    for (int i = 0; i < nsetting; ++i) {
        char* word = w->word[(*nword)++];
        snprintf(word, sizeof w->word[0], "%s=%.63s=%.*s", option, setting[i].key,
                 OM_CLI_RL_TEXT - 1, setting[i].value);
        w->argv[(*n)++] = word;
    }
}

OmStatus om_cli_rl_config(OmCliArgs* args, OmCliRlWords* w) {
    const char* path = om_cli_get(args, "--config");
    int n = 0, nword = 0;
    if (!path) return OM_OK;
    memset(w, 0, sizeof *w);
    OM_TRY(read_file(args, path, w));
    OM_CHECK(args->argc < 256, OM_INVALID, "too many words");
    w->argv[n++] = args->argv[0];
    for (int i = 0; i < args->noption; ++i) {
        const OmCliOption* o = &args->option[i];
        if (!w->text[i][0]) continue;
        bool is_flag = o->arg == NULL, is_off = is_flag && strcmp(w->text[i], "false") == 0;
        OM_CHECK(!is_flag || is_off || strcmp(w->text[i], "true") == 0, OM_INVALID,
                 "%s: %s is \"%s\", must be true or false", path, o->name + 2, w->text[i]);
        if (is_off) continue;
        snprintf(w->word[nword], sizeof w->word[0], is_flag ? "%s" : "%s=%s", o->name, w->text[i]);
        w->argv[n++] = w->word[nword++];
    }
    put_settings(w, "--set", w->setting, w->nsetting, &nword, &n);
    put_settings(w, "--eval-set", w->eval_setting, w->neval_setting, &nword, &n);
    for (int i = 1; i < args->argc; ++i) w->argv[n++] = args->argv[i];
    args->argc = n;
    args->argv = w->argv;
    return OM_OK;
}

typedef struct Settings {
    OmRlSetting setting[MAX_SETTING];
    char key[MAX_SETTING][KEY];
    int n;
} Settings;

// Append all settings of an option.
static OmStatus read_settings(const OmCliArgs* args, const char* option, Settings* s) {
    const char* word;
    for (int i = 0; (word = om_cli_get_nth(args, option, i)) != NULL; ++i, ++s->n) {
        const char* equal = strchr(word, '=');
        OM_CHECK(s->n < MAX_SETTING, OM_INVALID, "more than %d settings", MAX_SETTING);
        OM_CHECK(equal && equal > word && equal - word < KEY, OM_INVALID, "%s %s: write KEY=VALUE",
                 option, word);
        snprintf(s->key[s->n], KEY, "%.*s", (int)(equal - word), word);
        s->setting[s->n] = (OmRlSetting){s->key[s->n], equal + 1};
    }
    return OM_OK;
}

OmStatus om_cli_rl_task(const OmCliArgs* args, OmRlTask** task) {
    const char* name = om_cli_get(args, "--task");
    Settings s = {.n = 0};
    *task = NULL;
    OM_CHECK(name, OM_INVALID, "name the task (-t NAME); -t list prints the names");
    OM_TRY(read_settings(args, "--set", &s));
    return om_rl_task_create(name, s.setting, s.n, task);
}

// Which settings differ from training.
static OmStatus tell_settings(const OmRlPolicy* policy, const char* file, const OmRlTask* task) {
    OmText text = {0};
    if (!om_rl_policy_is_stated(policy)) {
        printf("note: %s: the settings of its training: not stated\n", file);
        return OM_OK;
    }
    const OmStatus status = om_rl_policy_differ(policy, task, &text);
    if (status >= 0 && text.len)
        fprintf(stderr, "warning: %s was trained with other settings: %s\n", file, text.str);
    om_text_done(&text);
    return status;
}

OmStatus om_cli_rl_policy_task(const OmCliArgs* args, const OmRlPolicy* policy, const char* file,
                               OmRlTask** task) {
    const char *name = om_cli_get(args, "--task"), *own = om_rl_policy_def(policy)->task;
    Settings s = {.n = 0};
    *task = NULL;
    // the evaluation refuses a policy of another task
    if (name && strcmp(name, own) != 0) return om_cli_rl_task(args, task);
    OM_TRY(read_settings(args, "--set", &s));
    OM_TRY(om_rl_policy_task(policy, s.setting, s.n, task));
    return tell_settings(policy, file, *task);
}

OmStatus om_cli_rl_more(const OmCliArgs* args, const char* more, OmRlTask** task) {
    Settings s = {.n = 0};
    *task = NULL;
    if (!om_cli_get(args, more)) return OM_OK;
    OM_TRY(read_settings(args, "--set", &s));
    OM_TRY(read_settings(args, more, &s));
    return om_rl_task_create(om_cli_get(args, "--task"), s.setting, s.n, task);
}

void om_cli_rl_list(void) {
    const OmRlTaskKind* kind;
    for (int i = 0; (kind = om_rl_task_kind(i)) != NULL; ++i)
        printf("%-12s %s\n", kind->name, kind->about);
}
