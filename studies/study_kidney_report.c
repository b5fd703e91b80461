// study_kidney_report.c: the study of fat over the kidney as report.html, study.json, views.csv and samples.csv.

#include "studies/study_attach_protocol.h"
#include "studies/study_internal.h"
#include "studies/study_kidney_case.h"
#include "studies/study_simulated_internal.h"
#include "studies/study_table.h"

#define MAX_PATH 1024
#define NSAMPLE 600  // of the thesis
#define NRUN 10      // of the whole study

// The way that the outcome is judged by: all three, or physics without a network.
static OmStudyKidneyWay main_way(const Kidney* s) {
    return s->sum.by[OM_STUDY_KIDNEY_ALL].is_there ? OM_STUDY_KIDNEY_ALL : OM_STUDY_KIDNEY_PHYSICS;
}

// ---- report.html --------------------------------------------------------------------------------------

static void add_outcome(const Kidney* s, OmReport* report) {
    om__report_goals(report, "Fat over the kidney", om__kidney_goals(s));
    if (!s->sum.has_network)
        om_report_paragraph(report, "Left out, for there is no network: its rows.");
    const OmStudyKidneyDef* d = s->def;
    if (!d->is_quick && d->nsample == NSAMPLE && d->nrun == NRUN) return;
    om__report_say(report, "Not the study of the thesis: %s%d of %d samples, %d of %d runs.",
                   d->is_quick ? "coarse meshes, one row with two levels, " : "", d->nsample,
                   NSAMPLE, d->nrun, NRUN);
}

// One line for each way.
static void add_ways(const Kidney* s, OmReport* report) {
    StudyTable table = om__table(
        "attachments|mean, mm|worst row, mm|over Zero|volume, mm|DSC|TPR, %|refused|not at rest|ms");
    for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        const OmStudyKidneyTable* t = &s->sum.by[way];
        if (!t->is_there) continue;
        om__table_row(&table, "%s|%.2f|%.2f|%.2f|%.2f|%.2f|%.0f|%d|%d|%.0f",
                      om__kidney_way_title[way], 1e3 * t->mean, 1e3 * t->worst, t->ratio,
                      1e3 * t->volume, t->dsc, 100 * t->tpr, t->nrefused, t->nloose, t->ms);
    }
    om__table_show(&table, report, "Dissection: ways compared", NULL);
    om__report_say(
        report,
        "Rows: %d; views of a run: %d; runs, each with other noise: %d; tetrahedra of the truth: %d. Mean: AVE of "
        "the scan's points at their true material points, less its value at rest, mean over rows; at rest %.2f mm "
        "(thesis 3.62 mm). Volume: all vertices of the twin by their true positions. DSC and TPR: medians over the "
        "underside. After a refused update the twin of its row keeps its last accepted attachments, at first the whole "
        "underside. The network found no correspondence in %d views of all runs. %d lifts of the truth ended early.",
        s->sum.nrow, s->sum.nview, s->def->nrun, s->sum.ntet, 1e3 * s->sum.rest, s->sum.nlost,
        s->sum.nshort);
}

// The last two rows: means and standard deviations over the rows that reached a level.
static void add_level_row(const Kidney* s, const OmStudyKidneyTable* t, bool is_sd,
                          StudyTable* table) {
    om__table_row(table, is_sd ? "Std|" : "Mean|");
    for (int k = 0; k < KIDNEY_NLEVEL; ++k) {
        double value[KIDNEY_NROW];
        int n = 0;
        for (int i = 0; i < s->sum.nrow; ++i)
            if (k < t->row[i].nlevel) value[n++] = 1e3 * t->row[i].ave[k];
        StudySample m = om__study_sample(value, n);
        om__table_row(table, n ? "%.2f" : "-", is_sd ? m.sd : m.mean);
    }
}

// Table 4.3 of one way.
static void add_table(const Kidney* s, int way, OmReport* report) {
    const OmStudyKidneyTable *t = &s->sum.by[way], *zero = &s->sum.by[OM_STUDY_KIDNEY_ZERO];
    StudyTable table = om__table("grasp|state|10 mm|20 mm|30 mm|40 mm|50 mm|Mean|Std|Mean Zero");
    for (int i = 0; i < s->sum.nrow; ++i) {
        const OmStudyKidneyRow* r = &t->row[i];
        om__table_row(&table, "%c|%d", 'A' + r->grasp, r->state + 1);
        for (int k = 0; k < KIDNEY_NLEVEL; ++k)
            om__table_row(&table, k < r->nlevel ? "%.2f" : "-", 1e3 * r->ave[k]);
        om__table_row(&table, "%.2f|%.2f|%.2f", 1e3 * r->mean, 1e3 * r->sd,
                      1e3 * zero->row[i].mean);
    }
    add_level_row(s, t, false, &table);
    om__table_row(&table, "%.2f||%.2f", 1e3 * t->mean, 1e3 * zero->mean);
    add_level_row(s, t, true, &table);
    om__table_row(&table, "||");
    om__table_end(&table, report);
}

// Levels that the truth did not reach, and the reason.
static void add_missing(const Kidney* s, OmReport* report) {
    StudyLines text = {0};
    for (int i = 0; i < s->cases.nstate; ++i) {
        for (int k = 0; k < s->cases.ngrasp; ++k) {
            int g = s->cases.grasp[k];
            const KidneyLift* l = &s->result[i * s->def->nrun].lift[g];
            if (l->nlevel >= s->cases.nlevel) continue;
            om__lines_add(&text, "%c%d: %d levels; %s\n", 'A' + g, s->cases.state[i] + 1, l->nlevel,
                          l->reason);
        }
    }
    om__lines_fold(&text, report, "Missing levels");
}

// Estimates of one way that were refused, run by run.
static void add_refused(const Kidney* s, int way, OmReport* report) {
    StudyLines text = {0};
    char title[96];
    for (int i = 0; i < s->cases.nstate * s->def->nrun; ++i) {
        for (int k = 0; k < s->result[i].nview; ++k) {
            const KidneyView* v = &s->result[i].view[k];
            const KidneyGuess* g = &v->by[way];
            if (!g->is_there || g->is_accepted) continue;
            om__lines_add(&text, "%c%d, %d mm, run %d: %s\n", 'A' + v->grasp,
                          s->cases.state[i / s->def->nrun] + 1, 10 * (v->level + 1),
                          i % s->def->nrun + 1, g->reason);
        }
    }
    snprintf(title, sizeof title, "Refused: %s", om__kidney_way_title[way]);
    om__lines_fold(&text, report, title);
}

// The highest lift of each row, as the depth camera saw it.
static OmStatus add_pictures(const Kidney* s, OmReport* report) {
    om_report_heading(report, "Highest lifts");
    for (int i = 0; i < s->sum.nrow; ++i) {
        const OmStudyKidneyRow* r = &s->sum.by[main_way(s)].row[i];
        OmPicture picture;
        char path[MAX_PATH], caption[96];
        OM_TRY(om__kidney_picture_path(s, r->grasp, r->state, path, sizeof path));
        if (!om_path_exists(path)) continue;
        OM_TRY(om_picture_load_png(path, &picture));
        snprintf(caption, sizeof caption, "%c%d, %d mm: AVE %.1f mm", 'A' + r->grasp, r->state + 1,
                 10 * r->nlevel, 1e3 * r->ave[r->nlevel - 1]);
        om_report_picture(report, &picture, caption);
        om_picture_done(&picture);
    }
    return OM_OK;
}

static OmStatus add_lifts(const Kidney* s, OmReport* report) {
    if (s->def->nrun == 0) return OM_OK;
    add_ways(s, report);
    om__report_head(report, "Table 4.3: %s", om__kidney_way_title[main_way(s)]);
    add_table(s, main_way(s), report);
    om_report_paragraph(
        report, "AVE in mm, mean over the runs, less the error at rest. The thesis's mean of the "
                "rows is 4.01 mm, its worst row 8.81 mm (B2), its Mean Zero 7.3 to 32.0 mm.");
    add_missing(s, report);
    for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way) {
        if (!s->sum.by[way].is_there || way == (int)main_way(s)) continue;
        om_report_begin_fold(report, om__kidney_way_title[way]);
        add_table(s, way, report);
        om_report_end_fold(report);
    }
    OM_TRY(add_pictures(s, report));
    for (int way = OM_STUDY_KIDNEY_NETWORK; way < OM_STUDY_KIDNEY_NWAY; ++way)
        add_refused(s, way, report);
    return OM_OK;
}

// ---- samples --------------------------------------------------------------------------------------------

static void add_samples_table(const Kidney* s, OmReport* report) {
    const OmStudyKidneySummary* m = &s->sum;
    StudyTable table = om__table("attachments|DSC|TPR, %|AVE, mm|thesis: DSC / AVE");
    om__table_row(&table, "network");
    om__table_quartiles(&table, 1, "%.2f", m->dsc);
    om__table_quartiles(&table, 100, "%.0f", m->tpr);
    om__table_quartiles(&table, 1e3, "%.1f", m->ave);
    om__table_row(&table, "0.51 (0.40-0.60) / 1.4 (0.7-3.2)|Same: the true ones|1|100");
    om__table_quartiles(&table, 1e3, "%.1f", m->same);
    om__table_row(&table, "|Zero: none|0|0");
    om__table_quartiles(&table, 1e3, "%.1f", m->zero);
    om__table_row(&table, "%s", "");
    om__table_show(&table, report, "Samples: random attachments and loads, the network alone",
                   NULL);
    om__report_say(
        report,
        "Median and quartiles over %d samples of one geometry, seed %d (the thesis has 600); median of the "
        "largest displacement %.0f mm. DSC and TPR over the cells of the network's grid. %d simulations stopped "
        "before the whole displacement of the grasp, and count with the part that they reached. %d more samples "
        "could not be made, for no draw had an equilibrium, and are in no row.",
        m->nsample, KIDNEY_SAMPLE_SEED, 1e3 * m->input, m->nstopped, m->nfailed);
}

// A sample as in Fig. 4.10, made again.
static OmStatus add_sample(const Kidney* s, int index, const char* which, OmReport* report) {
    OmBanetSampleDef def = om__kidney_sample_def(s);
    const KidneySample* r = &s->sample[index];
    OmBanetSample sample = {0};
    SimBody body = {0};
    SimMove move;
    char text[200];
    OmStatus status;
    OM_TRY_DONE(om_banet_sample_make(&def, index, &sample));
    OM_TRY_DONE(om__sim_body_make(&sample, def.side, &body));
    OM_TRY_DONE(om__kidney_sample_guess(s, &body));
    snprintf(text, sizeof text, "%s: sample %d, %.0f %% visible, DSC %.2f", which, index + 1,
             100 * r->visible, r->dsc);
    OM_TRY_DONE(om__sim_add_rest(&body, s->def->nworker, text, report));
    OM_TRY_DONE(om__sim_body_move(&body, &move));
    snprintf(text, sizeof text, "%s: pulled by %.0f mm, AVE %.1f mm", which, 1e3 * r->input,
             1e3 * r->ave);
    status = om__sim_add_deformed(&body, s->def->nworker, text, report);
done:
    om__sim_body_done(&body);
    om_banet_sample_done(&sample);
    return status;
}

// Best, median and worst sample by AVE.
static OmStatus add_gallery(const Kidney* s, OmReport* report) {
    static const char* const which[3] = {"best", "median", "worst"};
    int n = 0;
    int* order = om_alloc((size_t)s->def->nsample, sizeof *order);
    if (!order) return OM_NO_MEMORY;
    for (int i = 0; i < s->def->nsample; ++i) {
        if (!s->sample[i].is_made) continue;
        int k = n++;
        for (; k > 0 && s->sample[order[k - 1]].ave > s->sample[i].ave; --k)
            order[k] = order[k - 1];
        order[k] = i;
    }
    OmStatus status = OM_OK;
    for (int k = 0; k < 3 && n && status >= 0; ++k) {
        bool is_shown = k > 0 && k * (n - 1) / 2 == (k - 1) * (n - 1) / 2;  // of one or two samples
        if (!is_shown) status = add_sample(s, order[k * (n - 1) / 2], which[k], report);
    }
    om_free(order);
    if (status == OM_OK)
        om_report_paragraph(
            report, "At rest: green found and true, blue missed, red wrong. Deformed: green the "
                    "truth, yellow the simulation with the attachments of the network.");
    return status;
}

static OmStatus add_samples(const Kidney* s, OmReport* report) {
    if (s->def->nsample == 0) return OM_OK;
    add_samples_table(s, report);
    return s->estimate ? add_gallery(s, report) : OM_OK;
}

static OmStatus write_report(const Kidney* s) {
    OmReport report;
    om_report_begin(&report, "Fat over the kidney",
                    s->def->is_quick ? "thesis 4.5, quick" : "thesis 4.5");
    add_outcome(s, &report);
    OmStatus status = add_samples(s, &report);
    if (status == OM_OK) status = add_lifts(s, &report);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json ---------------------------------------------------------------------------------------

static void put_table(const Kidney* s, int way, OmJson* json) {
    const OmStudyKidneyTable* t = &s->sum.by[way];
    om_json_open(json, om__kidney_way_name[way], '{');
    om__put(json,
            "mean_mm %f|worst_row_mm %f|over_zero %f|volume_mm %f|dsc %f|tpr %f|refused %d|"
            "not_at_rest %d|processor_ms %f",
            1e3 * t->mean, 1e3 * t->worst, t->ratio, 1e3 * t->volume, t->dsc, t->tpr, t->nrefused,
            t->nloose, t->ms);
    om_json_open(json, "rows", '[');
    for (int i = 0; i < s->sum.nrow; ++i) {
        const OmStudyKidneyRow* r = &t->row[i];
        double ave[KIDNEY_NLEVEL];
        char name[16];
        snprintf(name, sizeof name, "%c%d", 'A' + r->grasp, r->state + 1);
        for (int k = 0; k < r->nlevel; ++k) ave[k] = 1e3 * r->ave[k];
        om_json_open(json, NULL, '{');
        om_json_string(json, "row", name);
        om_json_numbers(json, "ave_mm", ave, r->nlevel);
        om__put(json, "mean_mm %f|std_mm %f", 1e3 * r->mean, 1e3 * r->sd);
        om_json_close(json, '}');
    }
    om_json_close(json, ']');
    om_json_close(json, '}');
}

static void put_samples(const Kidney* s, OmJson* json) {
    const OmStudyKidneySummary* m = &s->sum;
    om_json_open(json, "samples", '{');
    om__put(json, "n %d|not_made %d|seed %d|stopped %d|input_mm %f", m->nsample, m->nfailed,
            KIDNEY_SAMPLE_SEED, m->nstopped, 1e3 * m->input);
    if (m->dsc.n > 0) {
        om__put_quartiles(json, "dsc", 1, m->dsc);
        om__put_quartiles(json, "tpr", 1, m->tpr);
        om__put_quartiles(json, "ave_mm", 1e3, m->ave);
    }
    om__put_quartiles(json, "ave_same_mm", 1e3, m->same);
    om__put_quartiles(json, "ave_zero_mm", 1e3, m->zero);
    om_json_close(json, '}');
}

static OmStatus write_json(const Kidney* s) {
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "quick? %d|network? %d|met? %d", s->def->is_quick, s->sum.has_network,
            s->sum.is_met);
    if (s->def->nsample > 0) put_samples(s, &json);
    if (s->def->nrun > 0) {
        om_json_open(&json, "dissection", '{');
        om__put(
            &json,
            "runs %d|views %d|tetrahedra_of_the_truth %d|missing_levels %d|lifts_ended_early %d|"
            "correspondence_lost %d|rest_mm %f",
            s->def->nrun, s->sum.nview, s->sum.ntet, s->sum.nmissing, s->sum.nshort, s->sum.nlost,
            1e3 * s->sum.rest);
        for (int way = 0; way < OM_STUDY_KIDNEY_NWAY; ++way)
            if (s->sum.by[way].is_there) put_table(s, way, &json);
        om_json_close(&json, '}');
    }
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

// ---- views.csv, samples.csv -----------------------------------------------------------------------------

static OmStatus write_views(const Kidney* s) {
    StudyLines t = {0};
    om__lines_add(
        &t,
        "state,run,rest_mm,grasp,lift_mm,attachments,error_mm,volume_mm,dsc,tpr,accepted,not_at_rest\n");
    for (int i = 0; i < s->cases.nstate * s->def->nrun; ++i) {
        const KidneyResult* r = &s->result[i];
        for (int k = 0; k < r->nview * OM_STUDY_KIDNEY_NWAY; ++k) {
            const KidneyView* v = &r->view[k / OM_STUDY_KIDNEY_NWAY];
            const KidneyGuess* g = &v->by[k % OM_STUDY_KIDNEY_NWAY];
            if (!g->is_there) continue;
            om__lines_add(&t, "%d,%d,%.5f,%c,%d,%s,%.5f,%.5f,%.5f,%.5f,%d,%d\n",
                          s->cases.state[i / s->def->nrun] + 1, i % s->def->nrun + 1, 1e3 * r->rest,
                          'A' + v->grasp, 10 * (v->level + 1),
                          om__kidney_way_name[k % OM_STUDY_KIDNEY_NWAY], 1e3 * g->ave,
                          1e3 * g->volume, g->dsc, g->tpr, g->is_accepted, g->is_loose);
        }
    }
    return om__lines_save(&t, s->def->out_dir, "views.csv");
}

static OmStatus write_samples(const Kidney* s) {
    StudyLines text = {0};
    om__lines_add(&text, "sample,made,input_mm,visible,attached,dsc,tpr,ave_mm,ave_same_mm,"
                         "ave_zero_mm,stopped\n");
    for (int i = 0; i < s->def->nsample; ++i) {
        const KidneySample* r = &s->sample[i];
        om__lines_add(&text, "%d,%d,%.3f,%.4f,%.4f,%.6f,%.6f,%.5f,%.5f,%.5f,%d\n", i + 1,
                      r->is_made, 1e3 * r->input, r->visible, r->share, r->dsc, r->tpr,
                      1e3 * r->ave, 1e3 * r->same, 1e3 * r->zero, r->nstopped);
    }
    return om__lines_save(&text, s->def->out_dir, "samples.csv");
}

OmStatus om__kidney_write(const Kidney* s) {
    OM_TRY(write_report(s));
    if (s->def->nrun > 0) OM_TRY(write_views(s));
    if (s->def->nsample > 0) OM_TRY(write_samples(s));
    return write_json(s);
}
