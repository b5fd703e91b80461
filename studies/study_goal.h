// study_goal.h: the goals of a study: one list judges them and shows them, beside the thesis's values.
#ifndef OMENTUM_STUDY_GOAL_H
#define OMENTUM_STUDY_GOAL_H

#include "omentum/report.h"

// A value that was not measured is NaN: its goal is missed.
typedef struct StudyGoal {
    const char* what;     // "median DSC of single views"
    const char* format;   // of both numbers: "%.2f", "%.0f %%"
    double found, bound;  // in the unit of the format
    bool is_most;         // `found` is at most `bound`; else at least
    const char* thesis;   // its value; null: none
} StudyGoal;

typedef struct StudyGoals {
    int n;
    StudyGoal goal[10];
} StudyGoals;

bool om__goals_met(StudyGoals goals);
// A verdict on `subject`, and a row for each goal.
void om__report_goals(OmReport* report, const char* subject, StudyGoals goals);

#endif
