// cli_study_learning.c: omentum study learning.
#include <math.h>
#include <string.h>

#include "cli_rl.h"
#include "cli_study.h"
#include "studies/study_learning.h"

enum { MAX_SETTING = 24, KEY = 64 };

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished trainings there are kept"},
    {"--task", "-t", "NAME", "the task", "retract"},
    {"--set", "-s", "KEY=VALUE", "a setting of the task; may be repeated"},
    {"--learners", NULL, "LIST", "of ppo-thesis, ppo, gail, clone", "all"},
    {"--seeds", NULL, "N", "trainings of each learner", "3", NULL, 1, 9},
    {"--steps", "-n", "N", "steps of a training of PPO", "262144", NULL, 1, 2e9},
    {"--varied-steps", NULL, "N", "more steps of PPO with reward (b), with drawn bodies", "327680",
     NULL, 0, 2e9},
    {"--gail-steps", NULL, "N", "steps of a training of GAIL", "32768", NULL, 1, 2e9},
    {"--no-reality", NULL, NULL, "no evaluation in \"reality\""},
    {"--same-task", NULL, NULL, "train in the task of the evaluation, with moves of 0.5 mm"},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"mean.*", "mean score of each learner over the starts"},
    {"least_mean.*", "the same of the seed where it is lowest"},
    {"lowest.*", "lowest score of a start, of any seed"},
    {"reality.*", "mean score in \"reality\""},
};

static OmStatus read_learners(const char* list, OmStudyLearningDef* def) {
    if (!list) return OM_OK;
    memset(def->has, 0, sizeof def->has);
    while (*list) {
        size_t len = strcspn(list, ",");
        int found = -1;
        for (int l = 0; l < OM_NLEARNER; ++l) {
            const char* name = om_study_learner_name((OmStudyLearner)l);
            if (strlen(name) == len && strncmp(name, list, len) == 0) found = l;
        }
        OM_CHECK(found >= 0, OM_INVALID,
                 "--learners: no learner %.*s; give some of ppo-thesis, ppo, gail, clone", (int)len,
                 list);
        def->has[found] = true;
        list += len + (list[len] == ',');
    }
    return OM_OK;
}

static OmStatus read_def(const OmCliArgs* args, OmRlSetting* setting, char (*key)[KEY],
                         OmStudyLearningDef* def) {
    int npositional, nstep = (int)def->nstep, gail_nstep = (int)def->gail_nstep;
    int varied_nstep = (int)def->varied_nstep;
    const bool is_same = om_cli_get(args, "--same-task") != NULL;
    const char* word;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(def->out_dir, OM_INVALID, "no output folder is given; add -o DIR");
    if (om_cli_get(args, "--task")) def->task = om_cli_get(args, "--task");
    for (int n = 0; (word = om_cli_get_nth(args, "--set", n)) != NULL; ++n) {
        const char* equal = strchr(word, '=');
        OM_CHECK(n < MAX_SETTING, OM_INVALID, "more than %d settings", MAX_SETTING);
        OM_CHECK(equal && equal > word && equal - word < KEY, OM_INVALID,
                 "--set %s: write KEY=VALUE", word);
        snprintf(key[n], KEY, "%.*s", (int)(equal - word), word);
        setting[n] = (OmRlSetting){key[n], equal + 1};
        def->nsetting = n + 1;
    }
    def->setting = setting;
    OM_TRY(read_learners(om_cli_get(args, "--learners"), def));
    OM_TRY(om_cli_int(args, "--seeds", &def->nseed));
    OM_TRY(om_cli_int(args, "--steps", &nstep));
    OM_TRY(om_cli_int(args, "--gail-steps", &gail_nstep));
    if (is_same) varied_nstep = 0;
    def->is_same_task = is_same;
    OM_TRY(om_cli_int(args, "--varied-steps", &varied_nstep));
    def->nstep = nstep;
    def->gail_nstep = gail_nstep;
    def->varied_nstep = varied_nstep;
    def->has_reality = om_cli_get(args, "--no-reality") == NULL;
    return om_cli_int(args, "--workers", &def->nworker);
}

static void print_result(const OmStudyLearningSummary* r, const char* dir) {
    char key[48];
    printf("%-12s %7s %7s %7s %7s %7s\n", "", "mean", "lowest", "near", "far", "reality");
    for (int l = 0; l < OM_NLEARNER; ++l) {
        const OmStudyLearning* b = &r->by[l];
        const char* name = om_study_learner_name((OmStudyLearner)l);
        if (!b->is_there) continue;
        snprintf(key, sizeof key, "mean.%s", name);
        om_cli_figure(key, b->mean);
        snprintf(key, sizeof key, "least_mean.%s", name);
        om_cli_figure(key, b->least_mean);
        snprintf(key, sizeof key, "lowest.%s", name);
        om_cli_figure(key, b->lowest);
        snprintf(key, sizeof key, "reality.%s", name);
        om_cli_figure(key, b->reality_mean);
        const double value[] = {b->mean, b->lowest, b->near_third, b->far_third, b->reality_mean};
        printf("%-12s", name);
        for (int i = 0; i < 5; ++i)
            if (isfinite(value[i]))
                printf(" %7.3f", value[i]);
            else
                printf(" %7s", "-");
        printf("\n");
    }
    om_cli_path(dir);
    printf("criteria: %s%s%s\nreport: %s/report.html\n", r->is_met ? "met" : "missed",
           r->missed[0] ? ": " : "", r->missed, dir);
}

int om_cli_study_learning(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmRlSetting setting[MAX_SETTING];
    char key[MAX_SETTING][KEY];
    OmStudyLearningSummary summary;
    OmStudyLearningDef def = om_study_learning_default_def(om_cli_get(&args, "--output"));
    if (read_def(&args, setting, key, &def) < 0) return om_cli_usage("study");
    const OmProgress* progress = om_cli_study_begin(&args);
    OmStatus status = om_study_learning_run(&def, progress, &summary);
    if (status < 0) return om_cli_fail_kept("study", status);
    om_cli_progress_done();
    print_result(&summary, def.out_dir);
    return summary.is_met ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_learning = {
    .name = "study learning",
    .run = om_cli_study_learning,
    .summary = "a policy learns to retract: PPO, GAIL, behaviour cloning",
    .usage = "omentum study learning -o DIR [options]",
    .about =
        "Thesis 5.5 and 5.6, Figs 5.7, 5.8 and 5.10: trainings from several seeds, the exposure from each of\n"
        "7 x 7 starts, and the same in \"reality\": other tissue, thickness, kidney, tip and camera. DIR\n"
        "receives report.html, study.json, and the trainings. Exit code 0: every bound that was measured is\n"
        "met; 1: otherwise.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum study learning -o out/learning\n"
        "  omentum study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 80000 \\\n"
        "      --no-reality -o out/small",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
