// study_record.c: a run as a JSON file, written atomically, and read back by the YAML reader (JSON is
// a subset of YAML).
#include <math.h>
#include <string.h>

#include "omentum/scene_yaml.h"
#include "studies/study_internal.h"
#include "studies/study_table.h"

#define COUNT(table) (int)(sizeof(table) / sizeof *(table))

static const OmYamlField step_field[] = {
    {"ms", OM_YAML_DOUBLE, offsetof(StudyStep, ms)},
    {"force", OM_YAML_DOUBLE, offsetof(StudyStep, force)},
    {"penetration", OM_YAML_DOUBLE, offsetof(StudyStep, penetration)},
    {"residual", OM_YAML_DOUBLE, offsetof(StudyStep, residual)},
    {"ncontact", OM_YAML_INT, offsetof(StudyStep, ncontact), 0, 1e9},
    {"substeps", OM_YAML_INT, offsetof(StudyStep, substeps), 0, 1e9},
};
static const OmYamlSchema step_schema = {"step", step_field, COUNT(step_field)};

static const OmYamlField reached_field[] = {
    {"depth", OM_YAML_DOUBLE, offsetof(StudyReached, depth)},
    {"lesion", OM_YAML_VEC3, offsetof(StudyReached, lesion)},
    {"contour", OM_YAML_VEC3, offsetof(StudyReached, contour)},
};
static const OmYamlSchema reached_schema = {"reached", reached_field, COUNT(reached_field)};

// Steps are read into a new block, which becomes run->step.
typedef struct RunFile {
    StudyRun run;
    StudyStep step[OM_STUDY_MAX_STEP];
} RunFile;

static const OmYamlField run_field[] = {
    {"setup", OM_YAML_STRING, offsetof(RunFile, run.setup), .size = sizeof(((StudyRun*)0)->setup)},
    {"method", OM_YAML_ENUM, offsetof(RunFile, run.method), .name = om__study_method_name},
    {"resolution", OM_YAML_INT, offsetof(RunFile, run.resolution), 0, 1e9},
    {"lesion", OM_YAML_INT, offsetof(RunFile, run.lesion), 0, OM_STUDY_MAX_LESION},
    {"ntet", OM_YAML_INT, offsetof(RunFile, run.ntet), 1, 1e9},
    {"nvert", OM_YAML_INT, offsetof(RunFile, run.nvert), 1, 1e9},
    {"nstep", OM_YAML_INT, offsetof(RunFile, run.nstep), 1, OM_STUDY_MAX_STEP},
    {"ndone", OM_YAML_INT, offsetof(RunFile, run.ndone), 0, OM_STUDY_MAX_STEP},
    {"reason", OM_YAML_STRING, offsetof(RunFile, run.reason),
     .size = sizeof(((StudyRun*)0)->reason)},
    {"volume_min", OM_YAML_DOUBLE, offsetof(RunFile, run.volume_min)},
    {"reached", OM_YAML_LIST, offsetof(RunFile, run.reached), .size = sizeof(StudyReached),
     .sub = &reached_schema, .count_offset = offsetof(RunFile, run.nreached),
     .capacity = OM_STUDY_NDEPTH},
    {"step", OM_YAML_LIST, offsetof(RunFile, step), .size = sizeof(StudyStep), .sub = &step_schema,
     .count_offset = offsetof(RunFile, run.nrecord), .capacity = OM_STUDY_MAX_STEP},
};
static const OmYamlSchema run_schema = {"run", run_field, COUNT(run_field)};

OmStatus om__study_save_run(const StudyRun* run, const char* path) {
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om__put(&json,
            "setup %s|method %s|resolution %d|lesion %d|ntet %d|nvert %d|nstep %d|ndone %d|"
            "reason %s|volume_min %f",
            run->setup, om__study_method_name[run->method], run->resolution, run->lesion, run->ntet,
            run->nvert, run->nstep, run->ndone, run->reason, om__finite(run->volume_min));
    om_json_open(&json, "reached", '[');
    for (int i = 0; i < run->nreached; ++i) {
        om_json_open(&json, NULL, '{');
        om_json_number(&json, "depth", run->reached[i].depth);
        om__put_vec3(&json, "lesion", run->reached[i].lesion);
        om__put_vec3(&json, "contour", run->reached[i].contour);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    om_json_open(&json, "step", '[');
    for (int i = 0; i < run->nrecord; ++i) {
        const StudyStep* s = &run->step[i];
        om__put_object(&json, NULL,
                       "ms %f|force %f|penetration %f|residual %f|ncontact %d|substeps %d", s->ms,
                       om__finite(s->force), om__finite(s->penetration), om__finite(s->residual),
                       s->ncontact, s->substeps);
    }
    om_json_close(&json, ']');
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

OmStatus om__study_load_run(const char* path, StudyRun* run) {
    RunFile* file = om_calloc(1, sizeof *file);
    if (!file) return OM_NO_MEMORY;
    OmStatus status = om_yaml_load(path, &run_schema, file);
    if (status == OM_OK && strcmp(file->run.setup, run->setup) != 0)
        status = om_error(OM_INVALID, "%s: a run of another setup", path);
    if (status == OM_OK &&
        (file->run.method != run->method || file->run.resolution != run->resolution ||
         file->run.lesion != run->lesion || file->run.ndone > file->run.nrecord))
        status = om_error(OM_INVALID, "%s: holds another run than its name says", path);
    if (status == OM_OK) {
        StudyStep* step = run->step;
        *run = file->run;
        run->step = step;
        memcpy(step, file->step, (size_t)run->nrecord * sizeof *step);
    }
    om_free(file);
    return status;
}

// ---- truth ----------------------------------------------------------------------------------------

static const OmYamlField depth_field[] = {
    {"depth", OM_YAML_DOUBLE, offsetof(StudyTruthDepth, depth)},
    {"fine", OM_YAML_VEC3, offsetof(StudyTruthDepth, fine)},
    {"coarse", OM_YAML_VEC3, offsetof(StudyTruthDepth, coarse)},
    {"contour", OM_YAML_VEC3, offsetof(StudyTruthDepth, contour)},
    {"force", OM_YAML_DOUBLE, offsetof(StudyTruthDepth, force)},
    {"coarse_force", OM_YAML_DOUBLE, offsetof(StudyTruthDepth, coarse_force)},
    {"sink", OM_YAML_DOUBLE, offsetof(StudyTruthDepth, sink)},
    {"residual", OM_YAML_DOUBLE, offsetof(StudyTruthDepth, residual)},
    {"nnewton", OM_YAML_INT, offsetof(StudyTruthDepth, nnewton), 0, 1e9},
};
static const OmYamlSchema depth_schema = {"depth", depth_field, COUNT(depth_field)};

static const OmYamlField truth_field[] = {
    {"setup", OM_YAML_STRING, offsetof(StudyTruthResult, setup),
     .size = sizeof(((StudyTruthResult*)0)->setup)},
    {"lesion", OM_YAML_INT, offsetof(StudyTruthResult, lesion), 0, OM_STUDY_MAX_LESION},
    {"ntet", OM_YAML_INT, offsetof(StudyTruthResult, ntet), 1, 1e9},
    {"ntet_coarse", OM_YAML_INT, offsetof(StudyTruthResult, ntet_coarse), 1, 1e9},
    {"seconds", OM_YAML_DOUBLE, offsetof(StudyTruthResult, seconds)},
    {"at", OM_YAML_LIST, offsetof(StudyTruthResult, at), .size = sizeof(StudyTruthDepth),
     .sub = &depth_schema, .count_offset = offsetof(StudyTruthResult, ndepth),
     .capacity = OM_STUDY_NDEPTH},
};
static const OmYamlSchema truth_schema = {"truth", truth_field, COUNT(truth_field)};

OmStatus om__study_save_truth(const StudyTruthResult* truth, const char* path) {
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om__put(&json, "setup %s|lesion %d|ntet %d|ntet_coarse %d|seconds %f", truth->setup,
            truth->lesion, truth->ntet, truth->ntet_coarse, truth->seconds);
    om_json_open(&json, "at", '[');
    for (int i = 0; i < truth->ndepth; ++i) {
        const StudyTruthDepth* d = &truth->at[i];
        om_json_open(&json, NULL, '{');
        om_json_number(&json, "depth", d->depth);
        om__put_vec3(&json, "fine", d->fine);
        om__put_vec3(&json, "coarse", d->coarse);
        om__put_vec3(&json, "contour", d->contour);
        om__put(&json, "force %f|coarse_force %f|sink %f|residual %f|nnewton %d",
                om__finite(d->force), om__finite(d->coarse_force), om__finite(d->sink),
                om__finite(d->residual), d->nnewton);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

OmStatus om__study_load_truth(const char* path, StudyTruthResult* truth) {
    StudyTruthResult file = {0};
    OM_TRY(om_yaml_load(path, &truth_schema, &file));
    OM_CHECK(strcmp(file.setup, truth->setup) == 0 && file.lesion == truth->lesion, OM_INVALID,
             "%s: truth of another setup", path);
    *truth = file;
    return OM_OK;
}
