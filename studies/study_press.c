// study_press.c: one experiment: the probe is pressed over one lesion, step by step, until the last depth
// or the first step that misses a criterion.
//
// Criteria of a step: its residual is below the tolerance, no element is inverted, and no point of the
// contact surface is deeper in the probe than allowed. The time of a step includes its sub-steps. Only
// om_press_step is timed, not checks and records.
#include <math.h>
#include <string.h>

#include "omentum/fem.h"
#include "omentum/tissue.h"
#include "studies/study_internal.h"

const char* const om__study_method_name[OM_STUDY_NMETHOD + 1] = {"penalty", "multipliers",
                                                                 "prescribed", NULL};
const char* const om__study_method_title[OM_STUDY_NMETHOD] = {"Penalty", "LM", "PrescrDispl"};

int om__study_nstep(const OmStudyContactDef* def, int lesion) {
    double last = def->depth[OM_STUDY_NDEPTH - 1];
    if (lesion >= 0) last = fmin(last, def->body->lesion[lesion].max);
    return (int)ceil(last / (def->speed * def->time_step) - 1e-9);
}

OmPose om__study_probe_pose(const OmStudyLesion* l, double depth) {
    OmMat3 r = om_mat3_cols(l->along, om_cross(l->normal, l->along), l->normal);
    OmPose pose = {om_madd(l->touch, -depth, l->normal), om_quat_from_mat3(r)};
    return pose;
}

OmStatus om__study_stage_create(const OmStudyContactDef* def, const OmTetMesh* mesh,
                                StudyStage* stage) {
    stage->def = def;
    OmTissueDef tissue = om_tissue_default_def(om_fem_engine(), mesh);
    tissue.element = OM_ELEMENT_LINEAR;  // solids, which do not bend
    tissue.material_default = def->material;
    tissue.density = def->density;
    tissue.rayleigh_mass = def->rayleigh_mass;
    tissue.gravity = om_vec3(0, 0, 0);
    tissue.solver.tolerance = def->tolerance;
    tissue.solver.max_iterations = def->max_iterations;
    tissue.solver.nworker = def->nworker;
    OM_TRY(om_tissue_create(&tissue, &stage->model));
    OM_TRY(om_tissue_state_create(stage->model, &stage->state));
    return om_tissue_work_create(stage->model, &stage->work);
}

void om__study_stage_done(StudyStage* stage) {
    om_tissue_work_destroy(stage->work);
    om_tissue_state_destroy(stage->state);
    om_tissue_destroy(stage->model);
    stage->work = NULL;
    stage->state = NULL;
    stage->model = NULL;
}

// Check the criteria of a step; writes the reason if it misses one.
static OmStatus check_step(const StudyStage* stage, const OmPressReport* report, double* volume,
                           StudyRun* run) {
    const OmStudyContactDef* def = stage->def;
    int ntet = om_tissue_mesh(stage->model)->ntet, ninverted = 0;
    OM_TRY(om_tissue_get_measure(stage->model, stage->state, OM_VOLUME_RATIO, volume));
    double min = HUGE_VAL;
    for (int e = 0; e < ntet; ++e) {
        ninverted += !(volume[e] > 0);
        if (volume[e] < min) min = volume[e];
    }
    run->volume_min = fmin(run->volume_min, min);
    double residual = fmax(report->tissue.residual, report->tissue.newton_residual);
    if (ninverted)
        snprintf(run->reason, sizeof run->reason, "%d inverted elements", ninverted);
    else if (!(residual <= def->tolerance * (1 + 1e-6)))
        snprintf(run->reason, sizeof run->reason, "residual %.2g", residual);
    else if (!(report->penetration <= def->max_penetration))
        snprintf(run->reason, sizeof run->reason, "penetration %.2f mm", 1e3 * report->penetration);
    return OM_OK;
}

static OmStatus take_step(StudyStage* stage, OmPress* press, const OmStudyLesion* lesion, int k,
                          double* volume, StudyRun* run) {
    const OmStudyContactDef* def = stage->def;
    double last = fmin(def->depth[OM_STUDY_NDEPTH - 1], lesion->max);
    OmPose pose = om__study_probe_pose(lesion, fmin(last, (k + 1) * def->speed * def->time_step));
    OmPressReport report = {0};
    double begin = om_clock_now();
    OmStatus status = om_press_step(press, stage->model, stage->state, stage->work, pose,
                                    def->time_step, &report);
    StudyStep* step = &run->step[run->nrecord++];
    step->ms = 1e3 * (om_clock_now() - begin);
    if (status == OM_INVALID) {  // the method gave up and states the reason: a result
        snprintf(run->reason, sizeof run->reason, "%s", om_error_message());
        return OM_OK;
    }
    if (status < 0) return status;
    step->force = om_dot(report.force, lesion->normal);
    step->penetration = report.penetration;
    step->residual = report.tissue.residual;
    step->ncontact = report.ncontact;
    step->substeps = report.tissue.substeps;
    return check_step(stage, &report, volume, run);
}

static void record_depths(const OmStudyContactDef* def, double max, const OmEmbedding* embedding,
                          const OmTissueState* state, StudyRun* run) {
    double depth = fmin(run->ndone * def->speed * def->time_step, max);
    while (run->nreached < OM_STUDY_NDEPTH && depth > def->depth[run->nreached] - 1e-9) {
        double p[6];
        om_embedding_eval(embedding, om_tissue_x(state), p);
        run->reached[run->nreached].depth = def->depth[run->nreached];
        run->reached[run->nreached].contour = om_load3(p, 1);
        run->reached[run->nreached++].lesion = om_load3(p, 0);
    }
}

OmStatus om__study_press(StudyStage* stage, StudyRun* run) {
    const OmStudyContactDef* def = stage->def;
    int nlesion;
    const OmStudyLesion* lesion = om_study_lesions(def->body, &nlesion) + run->lesion;
    const OmTetMesh* mesh = om_tissue_mesh(stage->model);
    OmEmbedding embedding = {0};
    OmPress* press = NULL;
    double *volume = NULL, point[6];
    OmStatus status;
    run->ntet = mesh->ntet;
    run->nvert = mesh->nvert;
    run->nstep = om__study_nstep(def, run->lesion);
    run->ndone = run->nreached = run->nrecord = 0;
    run->volume_min = 1;
    run->reason[0] = 0;
    om_store3(point, 0, lesion->center);
    om_store3(point, 1, om__study_contour(lesion));
    om_tissue_state_reset(stage->model, stage->state);
    OM_ALLOC_DONE(volume, mesh->ntet);
    OM_TRY_DONE(om_tissue_embed(stage->model, 2, point, &embedding));
    OmPressDef press_def = om_press_default_def(stage->probe);
    press_def.method = (OmPressMethod)run->method;
    press_def.surface = stage->surface;
    press_def.friction = run->method == OM_PRESS_PRESCRIBED ? 0 : def->friction;
    OM_TRY_DONE(om_press_create(&press_def, stage->model, &press));
    OM_TRY_DONE(om_press_place(press, stage->model, stage->state, om__study_probe_pose(lesion, 0)));
    while (run->ndone < run->nstep) {
        OM_TRY_DONE(take_step(stage, press, lesion, run->ndone, volume, run));
        if (run->reason[0]) break;
        run->ndone++;
        record_depths(def, lesion->max, &embedding, stage->state, run);
    }
    status = OM_OK;
done:
    om_press_destroy(press);
    om_embedding_done(&embedding);
    om_free(volume);
    return status;
}
