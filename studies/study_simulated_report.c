// study_simulated_report.c: the study of simulated bodies as report.html, study.json and samples.csv.
#include <math.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "studies/study_hand.h"
#include "studies/study_internal.h"
#include "studies/study_simulated_internal.h"
#include "studies/study_table.h"

#define WIDTH 480
#define HEIGHT 360

// ---- tables -------------------------------------------------------------------------------------------

static void add_outcome(const Sim* s, OmReport* report) {
    if (s->sum.has_net)
        om__report_goals(report, "The network", om__sim_goals(&s->sum));
    else
        om_report_verdict(report, "There are no weights: the rows of the network are left out.",
                          false);
}

static void add_row(const OmStudySimulatedRow* r, const char* title, StudyTable* t) {
    om__table_row(t, "%s|%d", title, r->dsc.n);
    om__table_quartiles(t, 1, "%.2f", r->dsc);
    om__table_quartiles(t, 100, "%.0f", r->tpr);
    om__table_quartiles(t, 1e3, "%.2f", r->ave);
    om__table_quartiles(t, 1e3, "%.1f", r->mve);
    om__table_row(t, "%d of %d", r->nstopped, r->ave.n);
}

// Table 4.1 of one set, beside the thesis's.
static void add_table(const Sim* s, int set, OmReport* report) {
    enum { NROW = SIM_NGUESS + 1 };
    static const char* const thesis[NROW] = {
        "0|0|27.0 (13.4-52.0)", "0.42 (0.31-0.55)|93 (84-100)|6.7 (2.5-12.4)",
        "1|100|0.6 (0.2-1.7)", "0.82 (0.70-0.88)|86 (75-91)|1.1 (0.5-2.1)",
        "0.76 (0.63-0.83)|83 (69-90)|1.2 (0.6-2.4)"};
    StudyTable table = om__table(
        "attachments|samples|DSC|TPR, %|AVE, mm|MVE, mm|stopped|thesis: DSC|TPR, %|AVE, mm");
    int nrow = s->sum.has_net ? NROW : OM_STUDY_SIM_NET;
    for (int row = 0; row < nrow; ++row) {
        bool is_part = row == SIM_NGUESS;
        int guess = is_part ? OM_STUDY_SIM_NET : row;
        add_row(is_part ? &s->sum.hidden[set][guess] : &s->sum.all[set][guess],
                is_part ? "Network, less than half visible" : om__sim_guess_title[guess], &table);
        om__table_row(&table, "%s", set <= OM_STUDY_SIM_CAMERA ? thesis[row] : "||");
    }
    om__report_head(report, "Table 4.1: %s", om__sim_set_title[set]);
    om__table_end(&table, report);
}

static void add_tables(const Sim* s, OmReport* report) {
    for (int set = 0; set < SIM_NSET; ++set) add_table(s, set, report);
    om__report_say(
        report,
        "Median and quartiles. Median input displacement: %.1f mm in Test (a), %.1f mm in Test (b); 38.8 mm "
        "in the thesis. %d samples could not be made and are in no row.",
        1e3 * s->sum.input[OM_STUDY_SIM_EXACT], 1e3 * s->sum.input[OM_STUDY_SIM_CAMERA],
        s->sum.nlost[0] + s->sum.nlost[1] + s->sum.nlost[2] + s->sum.nlost[3]);
}

static void add_calibration(const Sim* s, OmReport* report) {
    const OmStudySimulatedSummary* sum = &s->sum;
    if (!sum->has_net) return;
    const double diagonal[2] = {0, 1};
    OmReportChart chart = {.title = "Are probabilities what they say?",
                           .x_label = "mean probability of 15 bins of equal count",
                           .y_label = "share of the cells that is attached",
                           .nseries = 3};
    for (int set = 0; set <= OM_STUDY_SIM_CAMERA; ++set)
        chart.series[set] = (OmReportSeries){om__sim_set_title[set], sum->bin_said[set],
                                             sum->bin_true[set], OM_STUDY_SIM_NBIN, false};
    chart.series[2] = (OmReportSeries){"perfect", diagonal, diagonal, 2, false};
    om_report_heading(report, "Reliability");
    om_report_chart(report, &chart);
    om__report_say(
        report,
        "Expected calibration error over cells that hold a vertex of the surface: %.3f in Test (a), %.3f in "
        "Test (b), %.3f on a board, %.3f with two regions.",
        sum->ece[0], sum->ece[1], sum->ece[2], sum->ece[3]);
}

// ---- pictures -------------------------------------------------------------------------------------------

// Triangles of which most vertices have this class; class null: all.
static OmStatus add_part(OmSenseScene* scene, const OmSurface* surface, const unsigned char* class,
                         int which, OmSenseLook look) {
    OmSurface part;
    int id;
    OM_TRY(om_surface_init(&part, surface->nvert, surface->ntri));
    memcpy(part.x, surface->x, 3 * (size_t)surface->nvert * sizeof *part.x);
    int n = 0;
    for (int t = 0; t < surface->ntri; ++t) {
        const int* v = surface->tri_vert + 3 * (size_t)t;
        int major = 0;
        if (class) major = class[v[1]] == class[v[2]] ? class[v[1]] : class[v[0]];
        if (major == which) memcpy(part.tri_vert + 3 * (size_t)n++, v, 3 * sizeof *v);
    }
    part.ntri = n;
    OmStatus status = n ? om_sense_scene_add(scene, &part, &look, &id) : OM_OK;
    om_surface_done(&part);
    return status;
}

// The scene from direction `from`, and into the report.
static OmStatus render(int nworker, OmSenseScene* scene, const OmSurface* surface, OmVec3 from,
                       const char* caption, OmReport* report) {
    OmVec3 center = om_vec3(0, 0, 0);
    double radius = 0;
    for (int i = 0; i < surface->nvert; ++i)
        center = om_madd(center, 1.0 / surface->nvert, om_load3(surface->x, i));
    for (int i = 0; i < surface->nvert; ++i)
        radius = fmax(radius, om_distance(center, om_load3(surface->x, i)));
    OmVec3 up = fabs(from.z) < 0.9 ? om_vec3(0, 0, 1) : om_vec3(0, 1, 0);
    const OmCamera camera = {.pose_world_camera =
                                 om_pose_look_at(om_madd(center, 4 * radius, from), center, up),
                             .width = WIDTH,
                             .height = HEIGHT,
                             .fov = 32 * OM_PI / 180,
                             .near_m = 0.01,
                             .far_m = 10};
    return om__report_render(report, scene, &camera, nworker, caption);
}

OmStatus om__sim_add_rest(const SimBody* b, int nworker, const char* caption, OmReport* report) {
    static const OmSenseLook look[4] = {
        {0.75, 0.7, 0.6}, {0.1, 0.25, 0.8}, {0.8, 0.1, 0.08}, {0.1, 0.55, 0.15}};
    const OmSurface* surface = &b->sample->surface;
    int n = surface->nvert;
    OmSenseScene* scene = NULL;
    unsigned char* class = NULL;
    double* normal = NULL;
    OmStatus status;
    OmVec3 from = om_vec3(0, 0, 0);
    OM_ALLOC_DONE(class, n);
    OM_ALLOC_DONE(normal, 3 * n);
    OM_TRY_DONE(om_sense_scene_create(&scene));
    om_surface_normals(surface, normal);
    for (int i = 0; i < n; ++i) {
        class[i] = (unsigned char)((b->sample->attached[i] ? 1 : 0) + (b->guess[i] ? 2 : 0));
        if (b->sample->attached[i]) from = om_madd(from, b->area[i], om_load3(normal, i));
    }
    OmVec3 tilt = om_quat_rotate(b->grid.pose_world_grid.q, om_vec3(0.3, -0.4, 0.2));
    from = om_normalize(om_add(om_norm(from) > 0 ? om_normalize(from) : om_vec3(0, 0, 1), tilt));
    for (int k = 0; k < 4; ++k) OM_TRY_DONE(add_part(scene, surface, class, k, look[k]));
    status = render(nworker, scene, surface, from, caption, report);
done:
    om_sense_scene_destroy(scene);
    om_free(class);
    om_free(normal);
    return status;
}

OmStatus om__sim_add_deformed(const SimBody* b, int nworker, const char* caption,
                              OmReport* report) {
    const OmBanetSample* sample = b->sample;
    const OmSurface* surface = &sample->surface;
    OmSenseScene* scene = NULL;
    OmStatus status;
    OmSurface truth = {0}, moved = {0};
    OM_TRY_DONE(om__hand_surface(surface, sample->surface_vert, sample->x, &truth));
    OM_TRY_DONE(om__hand_surface(surface, sample->surface_vert, b->x, &moved));
    OM_TRY_DONE(om_sense_scene_create(&scene));
    OM_TRY_DONE(add_part(scene, &truth, NULL, 0, (OmSenseLook){0.1, 0.55, 0.15}));
    OM_TRY_DONE(add_part(scene, &moved, NULL, 0, (OmSenseLook){0.85, 0.7, 0.1}));
    OmVec3 side = om_quat_rotate(b->grid.pose_world_grid.q, om_vec3(0.4, -0.8, 0.45));
    status = render(nworker, scene, &truth, om_normalize(side), caption, report);
done:
    om_sense_scene_destroy(scene);
    om_surface_done(&truth);
    om_surface_done(&moved);
    return status;
}

static OmStatus add_case(const Sim* s, const SimCase* c, const char* which, OmReport* report) {
    OmBanetSample sample = {0};
    SimBody body = {0};
    SimMove move = {0};
    double* probability = NULL;
    double side = s->sample_def[c->set].side;
    char text[240];
    OmStatus status;
    OM_TRY_DONE(om__sim_sample_get(s, c, &sample));
    OM_TRY_DONE(om__sim_body_make(&sample, side, &body));
    OM_ALLOC_DONE(probability, sample.surface.nvert);
    OM_TRY_DONE(om__sim_net_estimate(s, &body, probability));
    OM_TRY_DONE(om__sim_body_move(&body, &move));
    snprintf(text, sizeof text, "%s: sample %d, %.0f %% visible, DSC %.2f, TPR %.0f %%", which,
             c->index + 1, 100 * c->base.visible, c->net->score.dsc, 100 * c->net->score.tpr);
    OM_TRY_DONE(om__sim_add_rest(&body, s->def->nworker, text, report));
    snprintf(text, sizeof text, "%s: pulled by %.0f mm, AVE %.1f mm, MVE %.1f mm%s", which,
             1e3 * c->base.input, 1e3 * move.ave, 1e3 * move.mve,
             move.is_stopped ? ", stopped on the way" : "");
    status = om__sim_add_deformed(&body, s->def->nworker, text, report);
done:
    om__sim_body_done(&body);
    om_banet_sample_done(&sample);
    om_free(probability);
    return status;
}

// Best, median and worst of a set by DSC.
static OmStatus add_pictures(const Sim* s, int set, OmReport* report) {
    static const char* const which[3] = {"best", "median", "worst"};
    int n = 0;
    int* order = om_alloc((size_t)s->ncase, sizeof *order);
    if (!order) return OM_NO_MEMORY;
    for (int i = 0; i < s->ncase; ++i) {
        const SimCase* c = &s->c[i];
        if (c->set != set || !c->has_net || !c->base.is_made) continue;
        int k = n++;
        for (; k > 0 && s->c[order[k - 1]].net->score.dsc < c->net->score.dsc; --k)
            order[k] = order[k - 1];
        order[k] = i;
    }
    OmStatus status = OM_OK;
    for (int k = 0; k < 3 && n && status >= 0; ++k)
        status = add_case(s, &s->c[order[k * (n - 1) / 2]], which[k], report);
    om_free(order);
    return status;
}

static OmStatus add_gallery(const Sim* s, OmReport* report) {
    if (!s->sum.has_net) return OM_OK;
    for (int set = 0; set < SIM_NSET; ++set) {
        om__report_head(report, "Best, median and worst: %s", om__sim_set_title[set]);
        OM_TRY(add_pictures(s, set, report));
    }
    om_report_paragraph(
        report,
        "At rest, from the side of the attachments: green found and true, blue missed, red wrong. Deformed: "
        "green the truth, yellow the simulation with the attachments of the network.");
    return OM_OK;
}

static void add_method(const Sim* s, OmReport* report) {
    om__report_section(
        report, "How",
        "%d, %d, %d and %d samples of the generator, of seeds that no training and no choice has used%s%s. The "
        "thesis has 380. The first %d of each set are simulated; DSC and TPR are of all. Simulations: "
        "static finite elements of the sample's mesh and law, moved by the true displacement of the grasped "
        "vertices; a simulation that stops before the whole displacement counts with the part that it reached. "
        "All holds the side of the thin axis that is turned away from the pull. DSC and TPR are over the cells "
        "of the network's grid, as in the thesis. Medians: %.0f ms of processor time for an estimate, %.0f ms "
        "for a simulation.",
        s->sum.nsample[0], s->sum.nsample[1], s->sum.nsample[2], s->sum.nsample[3],
        s->def->is_quick ? " (quick: small bodies, another seed)" : "",
        s->def->is_quick || s->def->nsample == 380 ? "" : "; fewer than the whole study has",
        s->nsolve[0], s->sum.net_ms, s->sum.solve_ms);
    om_report_paragraph(
        report,
        "On a board the simulation starts from the shape that a scan would show and knows neither weight nor "
        "board, as in the thesis.");
}

static OmStatus write_report(const Sim* s) {
    OmReport report;
    om_report_begin(&report, "Attachments of simulated bodies",
                    s->def->is_quick ? "BA-Net on random samples, quick"
                                     : "BA-Net on random samples");
    add_outcome(s, &report);
    add_tables(s, &report);
    add_calibration(s, &report);
    OmStatus status = add_gallery(s, &report);
    add_method(s, &report);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json, samples.csv ------------------------------------------------------------------------------

static void put_row(OmJson* json, const char* key, const OmStudySimulatedRow* r) {
    om_json_open(json, key, '{');
    om__put(json, "n %d|simulated %d", r->dsc.n, r->ave.n);
    if (r->dsc.n) {
        om__put_quartiles(json, "dsc", 1, r->dsc);
        om__put_quartiles(json, "tpr", 1, r->tpr);
        om__put_quartiles(json, "dsc_area", 1, r->dsc_area);
        om__put_quartiles(json, "tpr_area", 1, r->tpr_area);
    }
    if (r->ave.n) {
        om__put_quartiles(json, "ave_mm", 1e3, r->ave);
        om__put_quartiles(json, "mve_mm", 1e3, r->mve);
    }
    om_json_integer(json, "stopped", r->nstopped);
    om_json_close(json, '}');
}

static OmStatus write_json(const Sim* s) {
    char key[32];
    const OmStudySimulatedSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json, "is_quick? %d|has_net? %d|is_met? %d|estimate_ms %f|simulation_ms %f",
            s->def->is_quick, sum->has_net, sum->is_met, sum->net_ms, sum->solve_ms);
    for (int set = 0; set < SIM_NSET; ++set) {
        om_json_open(&json, om__sim_set_name[set], '{');
        om__put(&json, "seed %lld|samples %d|lost %d|input_mm %f",
                (long long)s->sample_def[set].seed, sum->nsample[set], sum->nlost[set],
                1e3 * sum->input[set]);
        for (int g = 0; g < SIM_NGUESS; ++g) {
            put_row(&json, om__sim_guess_name[g], &sum->all[set][g]);
            snprintf(key, sizeof key, "%s_hidden", om__sim_guess_name[g]);
            put_row(&json, key, &sum->hidden[set][g]);
        }
        om_json_number(&json, "ece", sum->ece[set]);
        om_json_numbers(&json, "bin_said", sum->bin_said[set], OM_STUDY_SIM_NBIN);
        om_json_numbers(&json, "bin_true", sum->bin_true[set], OM_STUDY_SIM_NBIN);
        om_json_close(&json, '}');
    }
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static OmStatus write_csv(const Sim* s) {
    StudyLines t = {0};
    om__lines_add(
        &t,
        "set,sample,made,camera,regions,vertices,attached,visible,input_mm,guess,dsc,tpr,dsc_area,tpr_area,"
        "simulated,ave_mm,mve_mm,load\n");
    for (int i = 0; i < s->ncase; ++i) {
        const SimCase* c = &s->c[i];
        const SimBase* b = &c->base;
        for (int g = 0; g < SIM_NGUESS; ++g) {
            bool is_net = g == OM_STUDY_SIM_NET;
            if (is_net && !c->has_net) continue;
            const SimScore* score = is_net ? &c->net->score : &b->score[g];
            const SimMove* move = is_net ? &c->net->move : &b->move[g];
            om__lines_add(
                &t, "%s,%d,%d,%d,%d,%d,%.4f,%.4f,%.3f,%s,%.6f,%.6f,%.6f,%.6f,%d,%.5f,%.5f,%.4f\n",
                om__sim_set_name[c->set], c->index + 1, b->is_made, b->is_camera, b->nregion,
                b->nvert, b->share, b->visible, 1e3 * b->input, om__sim_guess_name[g], score->dsc,
                score->tpr, score->dsc_area, score->tpr_area, move->is_there, 1e3 * move->ave,
                1e3 * move->mve, move->load);
        }
    }
    return om__lines_save(&t, s->def->out_dir, "samples.csv");
}

OmStatus om__sim_write(const Sim* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_csv(s));
    return write_report(s);
}
