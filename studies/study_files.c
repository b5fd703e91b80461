// study_files.c: the study's results for programs: study.json, runs.csv, errors.csv.
#include <math.h>

#include "studies/study_internal.h"

static OmStatus write_text(const Study* s, const char* name, const OmText* text) {
    char path[1024];
    OM_TRY(om__study_path(s->def, path, sizeof path, "%s", name));
    return om_file_write(path, text->str, text->len);
}

static void put_sample(OmJson* json, const char* key, const StudySample* v) {
    om_json_open(json, key, '{');
    om_json_integer(json, "n", v->n);
    if (v->n) {
        om_json_number(json, "mean", v->mean);
        om_json_number(json, "sd", v->sd);
        om_json_number(json, "min", v->min);
        om_json_number(json, "lower_quartile", v->lower);
        om_json_number(json, "median", v->median);
        om_json_number(json, "upper_quartile", v->upper);
        om_json_number(json, "max", v->max);
    }
    om_json_close(json, '}');
}

static void put_settings(OmJson* json, const Study* s) {
    const OmStudyContactDef* d = s->def;
    om_json_open(json, "settings", '{');
    om_json_string(json, "body", d->body->name);
    om_json_string(json, "law", om_law_name(d->material.law));
    om_json_number(json, "young", d->material.young);
    om_json_number(json, "poisson", d->material.poisson);
    om_json_number(json, "density", d->density);
    om_json_number(json, "rayleigh_mass", d->rayleigh_mass);
    om_json_number(json, "speed", d->speed);
    om_json_number(json, "time_step", d->time_step);
    om_json_number(json, "friction", d->friction);
    om_json_number(json, "tolerance", d->tolerance);
    om_json_number(json, "max_penetration", d->max_penetration);
    om_json_integer(json, "contact_triangles", s->surface.ntri);
    om_json_number(json, "lesion_ratio", d->lesion_ratio);
    om_json_number(json, "probe_noise", d->probe_noise);
    om_json_number(json, "pointer_noise", d->pointer_noise);
    om_json_integer(json, "seed", (int64_t)d->seed);
    om_json_integer(json, "workers", om_worker_count(d->nworker));
    om_json_close(json, '}');
}

static void put_lesions(OmJson* json, const Study* s) {
    om_json_open(json, "lesions", '[');
    for (int i = 0; i < s->nlesion; ++i) {
        const OmStudyLesion* l = &s->def->body->lesion[i];
        const StudyTruthResult* t = &s->truth[i];
        double center[3] = {l->center.x, l->center.y, l->center.z};
        double touch[3] = {l->touch.x, l->touch.y, l->touch.z};
        double normal[3] = {l->normal.x, l->normal.y, l->normal.z};
        om_json_open(json, NULL, '{');
        om_json_numbers(json, "center", center, 3);
        om_json_number(json, "radius", l->radius);
        om_json_numbers(json, "touch", touch, 3);
        om_json_numbers(json, "normal", normal, 3);
        om_json_open(json, "truth", '[');
        for (int k = 0; k < t->ndepth; ++k) {
            double p[3] = {t->at[k].fine.x, t->at[k].fine.y, t->at[k].fine.z};
            om_json_open(json, NULL, '{');
            om_json_number(json, "depth", t->at[k].depth);
            om_json_numbers(json, "lesion", p, 3);
            OmVec3 measured = om__study_measured(s->def, t, k);
            double m[3] = {measured.x, measured.y, measured.z};
            om_json_numbers(json, "measured", m, 3);
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
            OmVec3 x = om__study_measured_contour(s->def, &s->truth[i], k);
            OmVec3 at_rest = om__study_contour(l);
            double contour[3] = {x.x, x.y, x.z}, rest[3] = {at_rest.x, at_rest.y, at_rest.z};
            double normal[3] = {l->normal.x, l->normal.y, l->normal.z};
            om_json_open(json, NULL, '{');
            om_json_integer(json, "lesion", i + 1);
            om_json_number(json, "depth", s->truth[i].at[k].depth);
            om_json_numbers(json, "rest", rest, 3);
            om_json_numbers(json, "normal", normal, 3);
            om_json_numbers(json, "contour", contour, 3);
            om_json_close(json, '}');
        }
    }
    om_json_close(json, ']');
}

static OmStatus write_json(const Study* s, const StudyScore* score) {
    char path[1024];
    OM_TRY(om__study_path(s->def, path, sizeof path, "study.json"));
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    put_settings(&json, s);
    put_lesions(&json, s);
    om_json_open(&json, "cells", '[');
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < OM_STUDY_NMETHOD; ++m) {
            const StudyCell* c = &score->cell[k][m];
            if (!s->def->has_method[m]) continue;
            om_json_open(&json, NULL, '{');
            om_json_string(&json, "method", om__study_method_name[m]);
            om_json_integer(&json, "elements_wanted", s->def->resolution[k]);
            om_json_integer(&json, "elements", c->ntet);
            put_sample(&json, "stability_percent", &c->stability);
            put_sample(&json, "step_ms", &c->ms);
            put_sample(&json, "error_mm", &c->error);
            om_json_number(&json, "error_finest_mm", c->finest);
            om_json_bool(&json, "meets_bar", c->is_met);
            om_json_string(&json, "why_not", c->why);
            om_json_close(&json, '}');
        }
    }
    om_json_close(&json, ']');
    om_json_open(&json, "error_by_depth_mm", '[');
    for (int m = 0; m <= OM_STUDY_NMETHOD; ++m) {
        for (int d = 0; d < OM_STUDY_NDEPTH; ++d) {
            om_json_open(&json, NULL, '{');
            om_json_string(&json, "method",
                           m < OM_STUDY_NMETHOD ? om__study_method_name[m] : "rigid");
            om_json_number(&json, "depth", s->def->depth[d]);
            put_sample(&json, "error_mm", &score->by_depth[m][d]);
            om_json_close(&json, '}');
        }
    }
    om_json_close(&json, ']');
    put_sample(&json, "truth_refinement_mm", &score->refinement);
    put_sample(&json, "truth_force_refinement_percent", &score->force_check);
    put_sample(&json, "truth_sink_mm", &score->sink);
    om_json_close(&json, '}');
    return om_json_save(&json, path);
}

// A line of CSV; every field is a number or a word, except the reason, which is quoted.
static OmStatus write_runs(const Study* s) {
    OmText t = {0};
    OmStatus status = om_text_append(
        &t,
        "method,elements_wanted,elements,lesion,steps,completed,step_ms_median,step_ms_min,"
        "step_ms_max,penetration_max_mm,residual_max,substeps_max,force_end_n,volume_min,reason\n");
    double* ms = om_alloc(OM_STUDY_MAX_STEP, sizeof *ms);
    if (!ms) status = OM_NO_MEMORY;
    for (int i = 0; i < s->nrun && status == OM_OK; ++i) {
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
        status = om_text_append(
            &t, "%s,%d,%d,%d,%d,%d,%.4f,%.4f,%.4f,%.5f,%.3g,%d,%.5f,%.4f,\"%s\"\n",
            om__study_method_name[r->method], r->resolution, r->ntet, r->lesion + 1, r->nstep,
            r->ndone, time.median, time.min, time.max, 1e3 * deepest, residual, substeps,
            r->step[r->nrecord - 1].force, r->volume_min, reason);
    }
    if (status == OM_OK) status = write_text(s, "runs.csv", &t);
    om_free(ms);
    om_text_done(&t);
    return status;
}

static OmStatus write_errors(const Study* s) {
    OmText t = {0};
    OmStatus status =
        om_text_append(&t, "method,elements_wanted,elements,lesion,depth_mm,error_mm\n");
    for (int i = 0; i < s->nrun && status == OM_OK; ++i) {
        const StudyRun* r = &s->run[i];
        // the truth may end before the path: no error there
        int n = r->nreached < s->truth[r->lesion].ndepth ? r->nreached : s->truth[r->lesion].ndepth;
        for (int d = 0; d < n && status == OM_OK; ++d)
            status = om_text_append(&t, "%s,%d,%d,%d,%g,%.5f\n", om__study_method_name[r->method],
                                    r->resolution, r->ntet, r->lesion + 1, 1e3 * s->def->depth[d],
                                    1e3 * om__study_error(s, r, d));
    }
    if (status == OM_OK) status = write_text(s, "errors.csv", &t);
    om_text_done(&t);
    return status;
}

OmStatus om__study_write_files(const Study* s, const StudyScore* score) {
    OM_TRY(write_json(s, score));
    OM_TRY(write_runs(s));
    return write_errors(s);
}
