// study_files.c: the study's results for programs: study.json, runs.csv, errors.csv.
#include <math.h>

#include "studies/study_internal.h"
#include "studies/study_table.h"

static void put_sample(OmJson* json, const char* key, const StudySample* v) {
    om_json_open(json, key, '{');
    om_json_integer(json, "n", v->n);
    if (v->n)
        om__put(json, "mean %f|sd %f|min %f|lower_quartile %f|median %f|upper_quartile %f|max %f",
                v->mean, v->sd, v->min, v->lower, v->median, v->upper, v->max);
    om_json_close(json, '}');
}

static void put_settings(OmJson* json, const Study* s) {
    const OmStudyContactDef* d = s->def;
    om__put_object(json, "settings",
                   "body %s|law %s|young %f|poisson %f|density %f|rayleigh_mass %f|speed %f|"
                   "time_step %f|friction %f|tolerance %f|max_penetration %f|contact_triangles %d|"
                   "lesion_ratio %f|probe_noise %f|pointer_noise %f|seed %lld|workers %d",
                   d->body->name, om_law_name(d->material.law), d->material.young,
                   d->material.poisson, d->density, d->rayleigh_mass, d->speed, d->time_step,
                   d->friction, d->tolerance, d->max_penetration, s->surface.ntri, d->lesion_ratio,
                   d->probe_noise, d->pointer_noise, (long long)d->seed,
                   om_worker_count(d->nworker));
}

static void put_lesions(OmJson* json, const Study* s) {
    om_json_open(json, "lesions", '[');
    for (int i = 0; i < s->nlesion; ++i) {
        const OmStudyLesion* l = &s->def->body->lesion[i];
        const StudyTruthResult* t = &s->truth[i];
        om_json_open(json, NULL, '{');
        om__put_vec3(json, "center", l->center);
        om_json_number(json, "radius", l->radius);
        om__put_vec3(json, "touch", l->touch);
        om__put_vec3(json, "normal", l->normal);
        om_json_open(json, "truth", '[');
        for (int k = 0; k < t->ndepth; ++k) {
            om_json_open(json, NULL, '{');
            om_json_number(json, "depth", t->at[k].depth);
            om__put_vec3(json, "lesion", t->at[k].fine);
            om__put_vec3(json, "measured", om__study_measured(s->def, t, k));
            om_json_number(json, "force", t->at[k].force);
            om_json_close(json, '}');
        }
        om_json_close(json, ']');
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
}

void om__study_put_contours(OmJson* json, const Study* s) {
    om_json_open(json, "measured", '[');
    for (int i = 0; i < s->nlesion; ++i) {
        for (int k = 0; k < s->truth[i].ndepth; ++k) {
            const OmStudyLesion* l = &s->def->body->lesion[i];
            om_json_open(json, NULL, '{');
            om__put(json, "lesion %d|depth %f", i + 1, s->truth[i].at[k].depth);
            om__put_vec3(json, "rest", om__study_contour(l));
            om__put_vec3(json, "normal", l->normal);
            om__put_vec3(json, "contour", om__study_measured_contour(s->def, &s->truth[i], k));
            om_json_close(json, '}');
        }
    }
    om_json_close(json, ']');
}

static OmStatus write_json(const Study* s, const StudyScore* score) {
    OmText text = {0};
    OmJson json = om__json(&text);
    put_settings(&json, s);
    put_lesions(&json, s);
    om_json_open(&json, "cells", '[');
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < OM_STUDY_NMETHOD; ++m) {
            const StudyCell* c = &score->cell[k][m];
            if (!s->def->has_method[m]) continue;
            om_json_open(&json, NULL, '{');
            om__put(&json, "method %s|elements_wanted %d|elements %d", om__study_method_name[m],
                    s->def->resolution[k], c->ntet);
            put_sample(&json, "stability_percent", &c->stability);
            put_sample(&json, "step_ms", &c->ms);
            put_sample(&json, "error_mm", &c->error);
            om__put(&json, "error_finest_mm %f|meets_bar? %d|why_not %s", c->finest, c->is_met,
                    c->why);
            om_json_close(&json, '}');
        }
    }
    om_json_close(&json, ']');
    om_json_open(&json, "error_by_depth_mm", '[');
    for (int m = 0; m <= OM_STUDY_NMETHOD; ++m) {
        for (int d = 0; d < OM_STUDY_NDEPTH; ++d) {
            om_json_open(&json, NULL, '{');
            om__put(&json, "method %s|depth %f",
                    m < OM_STUDY_NMETHOD ? om__study_method_name[m] : "rigid", s->def->depth[d]);
            put_sample(&json, "error_mm", &score->by_depth[m][d]);
            om_json_close(&json, '}');
        }
    }
    om_json_close(&json, ']');
    put_sample(&json, "truth_refinement_mm", &score->refinement);
    put_sample(&json, "truth_force_refinement_percent", &score->force_check);
    put_sample(&json, "truth_sink_mm", &score->sink);
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

// A line of CSV; every field is a number or a word, except the reason, which is quoted.
static OmStatus write_runs(const Study* s) {
    StudyLines t = {0};
    double* ms;
    OM_ALLOC(ms, OM_STUDY_MAX_STEP);
    om__lines_add(
        &t,
        "method,elements_wanted,elements,lesion,steps,completed,step_ms_median,step_ms_min,"
        "step_ms_max,penetration_max_mm,residual_max,substeps_max,force_end_n,volume_min,reason\n");
    for (int i = 0; i < s->nrun; ++i) {
        const StudyRun* r = &s->run[i];
        double deepest = 0, residual = 0;
        int substeps = 0;
        if (!r->nrecord) continue;
        for (int k = 0; k < r->nrecord; ++k) {
            ms[k] = r->step[k].ms;
            deepest = fmax(deepest, r->step[k].penetration);
            residual = fmax(residual, r->step[k].residual);
            substeps = substeps > r->step[k].substeps ? substeps : r->step[k].substeps;
        }
        StudySample time = om__study_sample(ms, r->nrecord);
        char reason[sizeof r->reason];
        snprintf(reason, sizeof reason, "%s", r->reason);
        for (char* c = reason; *c; ++c)
            if (*c == '"' || *c == '\n') *c = ' ';
        om__lines_add(&t, "%s,%d,%d,%d,%d,%d,%.4f,%.4f,%.4f,%.5f,%.3g,%d,%.5f,%.4f,\"%s\"\n",
                      om__study_method_name[r->method], r->resolution, r->ntet, r->lesion + 1,
                      r->nstep, r->ndone, time.median, time.min, time.max, 1e3 * deepest, residual,
                      substeps, r->step[r->nrecord - 1].force, r->volume_min, reason);
    }
    om_free(ms);
    return om__lines_save(&t, s->def->out_dir, "runs.csv");
}

static OmStatus write_errors(const Study* s) {
    StudyLines t = {0};
    om__lines_add(&t, "method,elements_wanted,elements,lesion,depth_mm,error_mm\n");
    for (int i = 0; i < s->nrun; ++i) {
        const StudyRun* r = &s->run[i];
        // the truth may end before the path: no error there
        int n = r->nreached < s->truth[r->lesion].ndepth ? r->nreached : s->truth[r->lesion].ndepth;
        for (int d = 0; d < n; ++d)
            om__lines_add(&t, "%s,%d,%d,%d,%g,%.5f\n", om__study_method_name[r->method],
                          r->resolution, r->ntet, r->lesion + 1, 1e3 * s->def->depth[d],
                          1e3 * om__study_error(s, r, d));
    }
    return om__lines_save(&t, s->def->out_dir, "errors.csv");
}

OmStatus om__study_write_files(const Study* s, const StudyScore* score) {
    OM_TRY(write_json(s, score));
    OM_TRY(write_runs(s));
    return write_errors(s);
}
