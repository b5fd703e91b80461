// rl_retract_survey.c: TE by grasping place, by brute force: grasp, move straight to p_T, measure.
#include <math.h>
#include <string.h>

#include "rl/rl_retract_internal.h"

#define HOLD 25  // steps at p_T before TE is measured: 0.5 s

typedef struct Survey {
    const OmRlTask* task;
    OmRlSurvey* survey;
    OmStatus status[OM_RL_GRID * OM_RL_GRID];
} Survey;

// Put the tip on the fat at rest, grasp, and lift.
static OmStatus lift(const OmRlTask* task, void* state, int i, int j, OmRlSurvey* survey) {
    const OmRlRetract* t = om__rl_retract(task);
    OmRlRetractState* s = state;
    OM_TRY(task->ops->reset(task, state, om_rng_init(1, 0), i * OM_RL_GRID + j));
    const double* flat = om_tissue_mesh(t->tissue)->x;
    int best = 0;
    double least = INFINITY;
    for (int v = 0; v < t->nvert; ++v) {
        double d = hypot(t->fixed_x - flat[3 * (size_t)v] - survey->along[i],
                         flat[3 * (size_t)v + 1] - survey->across[j]);
        if (d < least) least = d, best = v;
    }
    s->now.tip = om_load3(t->rest_x, best);
    s->now.tip.z = fmax(s->now.tip.z, t->def.workspace_lo.z);
    OM_TRY(om__rl_grasp(t, s));
    int nthere = 0;
    for (int k = 0; k < 2000 && nthere < HOLD; ++k) {
        OmVec3 way = om_sub(t->def.target, s->now.tip);
        double move = t->def.move;
        int action[4] = {om__rl_choice_towards(way.x, move), om__rl_choice_towards(way.y, move),
                         om__rl_choice_towards(way.z, move), 1};
        nthere += om_norm(way) <= 2 * move;
        double reward;
        bool is_end;
        OM_TRY(task->ops->step(task, state, action, &reward, &is_end));
    }
    return om__rl_measure(t, s, &survey->exposure[i][j]);
}

static void run_block(void* ctx, int begin, int end, int block) {
    (void)block;
    Survey* survey = ctx;
    void* state = NULL;
    OmStatus status = survey->task->ops->state_create(survey->task, &state);
    for (int k = begin; k < end; ++k)
        survey->status[k] = status != OM_OK ? status
                                            : lift(survey->task, state, k / OM_RL_GRID,
                                                   k % OM_RL_GRID, survey->survey);
    survey->task->ops->state_destroy(survey->task, state);
}

OmStatus om_rl_retract_survey(const OmRlTask* task, int nworker, OmRlSurvey* survey) {
    OM_CHECK(task && task->ops == &om__rl_retract_ops, OM_INVALID,
             "rl retract: the survey needs a task made by om_rl_retract_create, with one variant");
    *survey = (OmRlSurvey){0};
    for (int k = 0; k < OM_RL_GRID; ++k) {
        survey->along[k] = OM__RL_LENGTH * (k + 0.5) / OM_RL_GRID;
        survey->across[k] = OM__RL_LENGTH * ((k + 0.5) / OM_RL_GRID - 0.5);
    }
    Survey s = {.task = task, .survey = survey};
    om_parallel_for(nworker, OM_RL_GRID * OM_RL_GRID, OM_RL_GRID, run_block, &s);
    for (int k = 0; k < OM_RL_GRID * OM_RL_GRID; ++k)
        if (s.status[k] != OM_OK) return s.status[k];
    return OM_OK;
}
