// study_report.c: report.html of the contact study, for a reader who knows the thesis.
#include <math.h>
#include <string.h>

#include "studies/study_internal.h"
#include "studies/study_table.h"

#define NMETHOD OM_STUDY_NMETHOD
#define NDEPTH OM_STUDY_NDEPTH
#define WORD 24

// Table 3.4 of the thesis: mean, median and minimum stability in per cent, of LM, Penalty, PrescrDispl.
typedef struct ThesisRow {
    int ntet;
    int value[NMETHOD][3];
    int lm_max;  // upper end of LM's range; 100 for the others
} ThesisRow;
static const ThesisRow thesis[] = {
    {623, {{100, 100, 93}, {100, 100, 100}, {100, 100, 100}}, 100},
    {1363, {{100, 100, 88}, {100, 100, 90}, {100, 100, 100}}, 100},
    {2539, {{97, 100, 64}, {100, 100, 100}, {100, 100, 100}}, 100},
    {4126, {{99, 100, 84}, {100, 100, 100}, {100, 100, 100}}, 100},
    {7369, {{99, 100, 75}, {100, 100, 92}, {100, 100, 100}}, 100},
    {12861, {{98, 100, 72}, {93, 100, 59}, {100, 100, 100}}, 100},
    {26220, {{96, 100, 60}, {72, 71, 42}, {100, 100, 100}}, 100},
    {105004, {{88, 92, 56}, {87, 100, 52}, {100, 100, 94}}, 100},
    {176506, {{69, 70, 49}, {53, 48, 25}, {98, 100, 80}}, 88},
};

// The thesis's column of a method.
static int thesis_column(int method) {
    return method == OM_PRESS_MULTIPLIERS ? 0 : method == OM_PRESS_PENALTY ? 1 : 2;
}

static const ThesisRow* find_thesis(int ntet) {
    for (size_t i = 0; i < sizeof thesis / sizeof *thesis; ++i)
        if (thesis[i].ntet == ntet) return &thesis[i];
    return NULL;
}

// ---- result -----------------------------------------------------------------------------------------

static void add_outcome(const Study* s, const StudyScore* score, OmReport* report) {
    const OmStudyContactSummary* sum = &score->sum;
    if (sum->ncell_met == sum->ncell)
        om__report_judge(report, true, "All %d combinations of method and mesh meet all criteria.",
                         sum->ncell);
    else
        om__report_judge(
            report, false,
            "%d of %d combinations of method and mesh meet all criteria; the others are listed below.",
            sum->ncell_met, sum->ncell);
    om__report_say(
        report,
        "Criteria: every method completes every path at every resolution, where completed means "
        "full depth reached, no inverted element, residual at most %.0e, no point of the contact surface "
        "deeper than %.1f mm in the probe, sub-steps counted in the time; and from 2,500 elements up an "
        "error at most 0.3 mm above that of the finest mesh.",
        s->def->tolerance, 1e3 * s->def->max_penetration);
    om__report_facts(
        report,
        "paths completed|of the path in the worst run|lesions|triangles of the contact "
        "surface|between the two meshes of the truth (median)",
        "%d of %d|%.0f %%|%d|%d|%.2f mm", sum->ncomplete, sum->nrun, 100 * sum->worst_stability,
        s->nlesion, s->surface.ntri, score->refinement.median);
}

static void add_misses(const Study* s, const StudyScore* score, OmReport* report) {
    StudyTable table = om__table("elements|method|why");
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < NMETHOD; ++m) {
            if (!s->def->has_method[m] || score->cell[k][m].is_met) continue;
            if (table.ncell == 0) om_report_heading(report, "Missed criteria");
            om__table_row(&table, "%d|%s", s->def->resolution[k], om__study_method_title[m]);
            om__table_cell(&table, score->cell[k][m].why);
        }
    }
    om__table_end(&table, report);
}

// ---- charts ---------------------------------------------------------------------------------------

static OmReportBox to_box(const StudySample* v) {
    OmReportBox box = {v->min, v->lower, v->median, v->upper, v->max, v->n};
    return box;
}

static void add_errors(const Study* s, const StudyScore* score, OmReport* report) {
    char name[OM_STUDY_MAX_RESOLUTION][WORD];
    const char* group[OM_STUDY_MAX_RESOLUTION];
    OmReportBox box[OM_STUDY_MAX_RESOLUTION * NMETHOD];
    OmReportChart chart = {.title = "Localisation error by mesh (thesis, Fig. 3.9)",
                           .x_label = "elements",
                           .y_label = "mm, distance to the measured lesion",
                           .nseries = NMETHOD,
                           .has_range = true,
                           .ngroup = s->def->nresolution,
                           .group = group,
                           .box = box};
    for (int k = 0; k < s->def->nresolution; ++k) {
        snprintf(name[k], WORD, "%d", s->def->resolution[k]);
        group[k] = name[k];
        for (int m = 0; m < NMETHOD; ++m) box[k * NMETHOD + m] = to_box(&score->cell[k][m].error);
    }
    for (int m = 0; m < NMETHOD; ++m) chart.series[m].name = om__study_method_title[m];
    om_report_heading(report, "Where the methods say the lesion is");
    om_report_chart(report, &chart);
    om_report_paragraph(
        report, "All lesions and all deformations that every method completed on that mesh. "
                "Boxes: quartiles and median; whiskers: all values.");
}

static void add_depths(const Study* s, const StudyScore* score, OmReport* report) {
    const char* name[NMETHOD + 1] = {[NMETHOD] = "rigid model"};
    double mean[NMETHOD + 1][NDEPTH];
    for (int m = 0; m <= NMETHOD; ++m) {
        if (m < NMETHOD) name[m] = om__study_method_title[m];
        for (int d = 0; d < NDEPTH; ++d) {
            const StudySample* v = &score->by_depth[m][d];
            mean[m][d] = v->n ? v->mean : (double)NAN;
        }
    }
    om__report_depths(report, "Mean error by deformation (thesis, Fig. 3.11)", NMETHOD + 1, name,
                      s->def->depth, mean);
    StudyTable table = om__study_depth_table("mean +- standard deviation, mm", s->def->depth, "");
    for (int m = 0; m <= NMETHOD; ++m) {
        om__table_cell(&table, name[m]);
        for (int d = 0; d < NDEPTH; ++d) {
            const StudySample* v = &score->by_depth[m][d];
            om__table_row(&table, v->n ? "%.2f +- %.2f" : "-", v->mean, v->sd);
        }
    }
    om__table_end(&table, report);
}

static void add_times(const Study* s, const StudyScore* score, OmReport* report) {
    double ntet[NMETHOD][OM_STUDY_MAX_RESOLUTION], ms[NMETHOD][OM_STUDY_MAX_RESOLUTION];
    OmReportChart chart = {.title = "Time of a step, median (thesis, Fig. 3.10)",
                           .x_label = "elements",
                           .y_label = "ms",
                           .nseries = NMETHOD,
                           .has_limit = true,
                           .limit = 1e3 * s->def->time_step,
                           .limit_name = "real time",
                           .limit2 = 40,
                           .limit2_name = "25 frames a second",
                           .is_log_x = true,
                           .is_log_y = true};
    StudyTable table = om__table("elements|method|median, ms|least, ms|largest, ms");
    for (int m = 0; m < NMETHOD; ++m) {
        for (int k = 0; k < s->def->nresolution; ++k) {
            const StudyCell* c = &score->cell[k][m];
            ntet[m][k] = c->ntet;
            ms[m][k] = c->ms.median;
        }
        chart.series[m] =
            (OmReportSeries){om__study_method_title[m], ntet[m], ms[m], s->def->nresolution, false};
    }
    for (int k = 0; k < s->def->nresolution; ++k) {
        for (int m = 0; m < NMETHOD; ++m) {
            const StudyCell* c = &score->cell[k][m];
            if (!c->ms.n) continue;
            om__table_row(&table, "%d|%s|%.2f|%.2f|%.2f", c->ntet, om__study_method_title[m],
                          c->ms.median, c->ms.min, c->ms.max);
        }
    }
    om_report_heading(report, "What a step costs");
    om_report_chart(report, &chart);
    om__table_end(&table, report);
}

static void add_stability(const Study* s, const StudyScore* score, OmReport* report) {
    char heading[160] = "elements";
    for (int m = 0; m < NMETHOD; ++m) {
        size_t n = strlen(heading);
        snprintf(heading + n, sizeof heading - n, "|%s|thesis", om__study_method_title[m]);
    }
    StudyTable table = om__table(heading);
    for (int k = 0; k < s->def->nresolution; ++k) {
        const ThesisRow* row = find_thesis(s->def->resolution[k]);
        om__table_row(&table, "%d", s->def->resolution[k]);
        for (int m = 0; m < NMETHOD; ++m) {
            const StudySample* v = &score->cell[k][m].stability;
            const int* t = row ? row->value[thesis_column(m)] : NULL;
            om__table_row(&table, v->n ? "%.0f, %.0f, %.0f-%.0f" : "-", v->mean, v->median, v->min,
                          v->max);
            if (t)
                om__table_row(&table, "%d, %d, %d-%d", t[0], t[1], t[2],
                              thesis_column(m) == 0 ? row->lm_max : 100);
            else
                om__table_cell(&table, "-");
        }
    }
    om__report_section(report, "How far they come",
                       "Share of the path completed, in per cent: mean, median, and range over the "
                       "lesions; beside it the thesis's (Table 3.4).");
    om__table_end(&table, report);
}

// Force against depth over the first lesion, on the mesh nearest to the thesis's 4,126.
static void add_forces(const Study* s, OmReport* report) {
    int k = 0;
    for (int i = 1; i < s->def->nresolution; ++i)
        if (fabs(log(s->def->resolution[i] / 4126.0)) < fabs(log(s->def->resolution[k] / 4126.0)))
            k = i;
    double* x = om_alloc((NMETHOD + 1) * OM_STUDY_MAX_STEP * 2, sizeof *x);
    if (!x) return;
    char title[96];
    snprintf(title, sizeof title, "Force on the probe over lesion 1, about %d elements",
             s->def->resolution[k]);
    OmReportChart chart = {.title = title,
                           .x_label = "probe displacement, mm",
                           .y_label = "N, along the probe's path",
                           .nseries = NMETHOD + 1,
                           .has_range = true};
    for (int m = 0; m < NMETHOD; ++m) {
        const StudyRun* run = om__study_run_at(s, k, m, 0);
        double *depth = x + 2 * m * OM_STUDY_MAX_STEP, *force = depth + OM_STUDY_MAX_STEP;
        for (int i = 0; i < run->ndone; ++i) {
            depth[i] = 1e3 * (i + 1) * s->def->speed * s->def->time_step;
            force[i] = run->step[i].force;
        }
        chart.series[m] =
            (OmReportSeries){om__study_method_title[m], depth, force, run->ndone, false};
    }
    double *depth = x + 2 * NMETHOD * OM_STUDY_MAX_STEP, *force = depth + OM_STUDY_MAX_STEP;
    depth[0] = force[0] = 0;
    int ndepth = s->truth[0].ndepth;
    for (int d = 0; d < ndepth; ++d) {
        depth[d + 1] = 1e3 * s->truth[0].at[d].depth;
        force[d + 1] = s->truth[0].at[d].force;
    }
    chart.series[NMETHOD] = (OmReportSeries){"truth", depth, force, ndepth + 1, false};
    om_report_heading(report, "Force");
    om_report_chart(report, &chart);
    om_free(x);
}

// ---- assumptions --------------------------------------------------------------------------------

static void add_truth(const Study* s, const StudyScore* score, OmReport* report) {
    om__report_section(
        report, "What the methods are measured against",
        "Truth is another model: %d quadratic tetrahedra in double precision, lesions %.1f times as stiff "
        "as the tissue, static equilibrium, and a contact integrated over the faces, without friction, "
        "in which the mean gap, weighted by the pressure, is %.3f mm (median). The same on %d quadratic "
        "tetrahedra puts the lesions %.2f mm away (median; upper quartile %.2f, largest %.2f mm) and its "
        "force differs by %.1f %% (median): this is the check by refinement; the finer one errs less.",
        s->truth[0].ntet, s->def->lesion_ratio, score->sink.median, s->truth[0].ntet_coarse,
        score->refinement.median, score->refinement.upper, score->refinement.max,
        score->force_check.median);
    om__report_say(
        report,
        "What the tracking would have measured is truth and noise: %.2f mm for the registration by the "
        "pointer, one draw a lesion, and %.2f mm for the calibration of the probe, one draw a deformation, "
        "the spreads that the thesis gives (3.3.1), as standard deviations of the whole vector; seed %llu. "
        "So no error can be below about %.1f mm on average.",
        1e3 * s->def->pointer_noise, 1e3 * s->def->probe_noise, (unsigned long long)s->def->seed,
        0.92e3 * hypot(s->def->pointer_noise, s->def->probe_noise));
}

static void add_assumptions(const Study* s, OmReport* report) {
    const OmStudyContactDef* d = s->def;
    om_report_heading(report, "Assumptions");
    const OmStudyBody* body = d->body;
    char own[320];
    int nshort = 0;
    for (int l = 0; l < s->nlesion; ++l) nshort += om__study_nstep(d, l) < om__study_nstep(d, -1);
    snprintf(
        own, sizeof own,
        "Body: %s, %s; %d of the lesions in its file are outside and left out. Over %d of %d lesions the "
        "path ends where the probe has gone through 0.6 of the tissue under its face.",
        body->name, body->nattached ? "attached where its file says" : "attached at its low end",
        body->noutside, nshort, s->nlesion);
    om_report_paragraph(
        report,
        body->is_file
            ? own
            : "Body: a phantom. The thesis prints no dimension of its own; ours is half an ellipsoid of 150 x 120 x "
              "72 mm on an attached flat base, lesions of 5-10 mm between 10 and 35 mm deep.");
    om__report_say(
        report,
        "Probe: a rigid "
        "box, face %.0f x %.0f mm, edges rounded by %.0f mm (a choice: a sharp edge has unbounded "
        "pressure), pressed along the inward normal at the surface point over the lesion, from first contact, "
        "at %.3g m/s (the thesis prints m/s^2).",
        1e3 * PROBE_LONG, 1e3 * PROBE_WIDE, 1e3 * PROBE_ROUNDING, d->speed);
    om__report_say(
        report,
        "Tissue of the models: homogeneous, %s, Young's modulus %.0f Pa and Poisson's ratio %.3g (not "
        "given in the thesis), %.0f kg/m^3, lumped masses, Rayleigh damping %.3g 1/s on mass, no gravity; "
        "linear tetrahedra. Implicit Euler, time step %.0f ms, one linearisation a step, further Newton "
        "iterations and sub-steps only where one fails. Linear systems to a relative residual of %.0e. "
        "Contact surface of %d triangles for every mesh; the thesis's 1,004 have edges as long as the "
        "probe is wide. Friction %.2f. Penalty stiffness automatic. %d workers.",
        om_law_name(d->material.law), d->material.young, d->material.poisson, d->density,
        d->rayleigh_mass, 1e3 * d->time_step, d->tolerance, s->surface.ntri, d->friction,
        om_worker_count(d->nworker));
    om_report_paragraph(
        report,
        "PrescrDispl moves the points under the probe at first contact with it, as the thesis "
        "does: they neither slide nor separate, whereas the truth has no friction. study.json, "
        "runs.csv and errors.csv hold the numbers of this page; runs/ holds every step.");
}

OmStatus om__study_write_report(const Study* s, const StudyScore* score) {
    char subtitle[160];
    snprintf(subtitle, sizeof subtitle, "%s, %d lesions, %d meshes, three methods",
             s->def->body->name, s->nlesion, s->def->nresolution);
    OmReport report;
    om_report_begin(&report, "A probe pressed on a breast: contact by three methods", subtitle);
    add_outcome(s, score, &report);
    OmStatus status = om__study_add_pictures(s, &report);
    add_misses(s, score, &report);
    add_stability(s, score, &report);
    add_errors(s, score, &report);
    add_depths(s, score, &report);
    add_times(s, score, &report);
    add_forces(s, &report);
    add_truth(s, score, &report);
    add_assumptions(s, &report);
    return om__report_end(&report, s->def->out_dir, status);
}
