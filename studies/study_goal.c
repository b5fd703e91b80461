// study_goal.c: the goals of a study.
#include "studies/study_goal.h"

#include "studies/study_table.h"

static bool is_met(const StudyGoal* g) {
    return g->is_most ? g->found <= g->bound : g->found >= g->bound;  // a NaN is neither
}

static int count_met(const StudyGoals* goals) {
    int nmet = 0;
    for (int i = 0; i < goals->n; ++i) nmet += is_met(&goals->goal[i]);
    return nmet;
}

bool om__goals_met(StudyGoals goals) { return count_met(&goals) == goals.n; }

void om__report_goals(OmReport* report, const char* subject, StudyGoals goals) {
    const int nmet = count_met(&goals);
    StudyTable table = om__table("goal|found|bound|thesis|");
    om__report_judge(report, nmet == goals.n, "%s: %d of %d goals are met.", subject, nmet,
                     goals.n);
    for (int i = 0; i < goals.n; ++i) {
        const StudyGoal* g = &goals.goal[i];
        char found[32] = "-", bound[32];
        if (g->found == g->found) snprintf(found, sizeof found, g->format, g->found);
        snprintf(bound, sizeof bound, g->format, g->bound);
        om__table_row(&table, "%s|%s|%s %s|%s|%s", g->what, found,
                      g->is_most ? "at most" : "at least", bound, g->thesis ? g->thesis : "",
                      is_met(g) ? "met" : "missed");
    }
    om__table_end(&table, report);
}
