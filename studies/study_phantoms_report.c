// study_phantoms_report.c: the study of phantoms as report.html, study.json and views.csv.
#include <math.h>
#include <string.h>

#include "studies/study_attach_protocol.h"
#include "studies/study_phantoms_eval.h"
#include "studies/study_table.h"

#define MAP_SIDE 240     // pixels
#define MAP_HALF 0.066   // m
#define MAP_NEAR 0.0045  // m, from a pixel to its vertex, of the usual mesh

// ---- Table 4.2 ------------------------------------------------------------------------------------------------

// The thesis's rows: DSC, TPR, AVE, AVE Same.
static const char* const thesis_row[OM_STUDY_PHANTOM_NROW] = {
    "0.28 (0.16-0.40)|69 (33-93)|3.2 (2.1-5.0)|3.5 (2.4-4.8)",
    "0.40 (0.26-0.46)|63 (49-79)|3.1 (1.8-5.8)|3.0 (2.0-4.7)",
    "0.43 (0.37-0.51)|87 (67-100)|3.7 (2.1-7.3)|4.2 (2.5-6.2)",
    "0.54 (0.42-0.66)|76 (53-90)|3.4 (2.0-5.0)|3.6 (2.4-5.0)",
    "0.41 (0.31-0.48)|73 (49-94)|3.9 (2.2-6.1)|3.8 (2.6-5.4)",
    "0.44 (0.29-0.53)|71 (55-87)|5.0 (2.1-7.4)|4.8 (3.1-5.7)",
    "0.44 (0.37-0.56)|76 (55-90)|3.9 (1.7-7.9)|4.5 (1.9-7.2)",
    "0.41 (0.30-0.50)|82 (60-98)|2.8 (1.8-4.8)|3.1 (2.3-4.8)",
    "0.40 (0.27-0.49)|65 (35-84)|4.1 (2.4-7.2)|3.8 (2.6-5.7)",
    "0.50 (0.23-0.56)|52 (35-60)|7.4 (4.5-9.8)|-",
    "|||",
};

// A table of one way beside the thesis's.
static void add_table(const Phantoms* s, int way, OmReport* report) {
    StudyTable table = om__table(
        "|DSC|TPR, %|AVE, mm|AVE Same, mm|volume, mm|n|refused|thesis: DSC|TPR, %|AVE, mm|AVE Same, mm");
    for (int row = 0; row < OM_STUDY_PHANTOM_NROW; ++row) {
        const OmStudyPhantomResult* r = &s->sum.row[row];
        const OmStudyPhantomScore* w = &r->by[way];
        if (r->n == 0) continue;
        om__table_row(&table, "%s", om__phantoms_row_title[row]);
        om__table_quartiles(&table, 1, "%.2f", w->dsc);
        om__table_quartiles(&table, 100, "%.0f", w->tpr);
        om__table_quartiles(&table, 1e3, "%.1f", w->ave);
        om__table_quartiles(&table, 1e3, "%.1f", r->same.ave);
        om__table_quartiles(&table, 1e3, "%.1f", w->volume);
        om__table_row(&table, "%d|%d|%s", r->n, w->nrefused, thesis_row[row]);
    }
    om__report_head(report, "Table 4.2: %s", om__phantoms_way_title[way]);
    om__table_end(&table, report);
}

static void add_outcome(const Phantoms* s, OmReport* report) {
    const OmStudyPhantomsSummary* sum = &s->sum;
    om__report_goals(report, "Network, fusion and physics together", om__phantoms_goals(sum));
    om__report_say(report, "%d steps of %d lifts; the error at rest is %.1f mm (thesis 4.8 mm).%s",
                   sum->nview, sum->nlift, 1e3 * sum->rest.median,
                   sum->has_network ? "" : " There is no network: only physics is judged below.");
    const OmStudyPhantomsDef* d = s->def;
    int most = d->is_development ? PHANTOM_NDEV : PHANTOM_NSHAPE;
    most *= PHANTOM_NSET * PHANTOM_NSTART;
    if (sum->ncase == most && d->ngrasp == 0 && !d->is_quick && !d->is_development) return;
    om__report_say(report, "Not the study of the thesis: %s%s%d of %d configurations%s.",
                   d->is_development ? "shapes for development, " : "",
                   d->is_quick ? "coarse meshes, " : "", sum->ncase, most,
                   d->ngrasp > 0 || d->is_quick ? ", not all grasps" : "");
}

// ---- pictures ---------------------------------------------------------------------------------------------------

// The underside from above: found and true, missed, wrong, free.
static void draw_map(const Phantoms* s, const PhantomResult* r, const unsigned char* attached,
                     OmPicture* map) {
    static const unsigned char color[4][3] = {
        {200, 200, 200}, {230, 120, 20}, {30, 60, 200}, {20, 140, 60}};
    for (int i = 0; i < MAP_SIDE * MAP_SIDE; ++i) {
        double x = MAP_HALF * (2.0 * (i % MAP_SIDE) / (MAP_SIDE - 1) - 1);
        double y = MAP_HALF * (1 - 2.0 * (i / MAP_SIDE) / (MAP_SIDE - 1));
        double best = MAP_NEAR * s->coarse;
        int at = -1;
        for (int k = 0; k < r->nnode; ++k) {
            double d = hypot(x - r->node_x[k][0], y - r->node_x[k][1]);
            if (d < best) best = d, at = k;
        }
        memset(map->pixel + 3 * i, 255, 3);
        if (at >= 0) memcpy(map->pixel + 3 * i, color[2 * r->truth[at] + attached[at]], 3);
    }
}

static OmStatus add_pair(const Phantoms* s, int index, int k, int way, const char* which,
                         OmReport* report) {
    const PhantomResult* r = &s->result[index];
    const PhantomView* v = &r->view[k];
    PhantomTruth t;
    OmPicture map = {0};
    bool is_there;
    char name[64], text[200];
    om__phantoms_name(&s->c[index], name, sizeof name);
    OM_TRY(
        om__phantoms_truth_open(&s->c[index], v->grasp, s->coarse, s->def->out_dir, &is_there, &t));
    OmStatus status = om_picture_init(&map, MAP_SIDE, MAP_SIDE, 3);
    if (status == OM_OK) {
        int width = t.scene.rgbd.width, height = t.scene.rgbd.height;
        OmPicture seen = {width, height, 3, t.color + 3 * (size_t)v->level * t.npixel};
        snprintf(text, sizeof text, "%s: %s, grasp %d, %d mm", which, name, v->grasp + 1,
                 10 * v->level);
        om_report_picture(report, &seen, text);
        draw_map(s, r, v->by[way].attached, &map);
        snprintf(text, sizeof text, "%s: DSC %.2f, TPR %.0f %%, AVE %.1f mm (Same %.1f mm)",
                 om__phantoms_way_title[way], v->by[way].dsc, 100 * v->by[way].tpr,
                 1e3 * v->by[way].ave, 1e3 * v->same_ave);
        om_report_picture(report, &map, text);
    }
    om_picture_done(&map);
    om__phantoms_truth_done(&t);
    return status;
}

// Steps of the best, the median and the worst DSC by one way. Equal ones: the first.
static OmStatus add_pictures(const Phantoms* s, int way, OmReport* report) {
    int n = s->sum.nview, m = 0;
    if (n == 0 || !s->sum.row[OM_STUDY_PHANTOM_TOTAL].by[way].is_there) return OM_OK;
    double *value, *sorted;
    int* at;
    OM_ALLOC(value, n);
    sorted = om_alloc((size_t)n, sizeof *sorted);
    at = om_alloc(2 * (size_t)n, sizeof *at);
    OmStatus status = sorted && at ? OM_OK : OM_NO_MEMORY;
    for (int i = 0; i < s->ncase && status == OM_OK; ++i)
        for (int k = 0; k < s->result[i].nview; ++k) {
            at[2 * m] = i;
            at[2 * m + 1] = k;
            value[m++] = s->result[i].view[k].by[way].dsc;
        }
    if (status == OM_OK) {
        memcpy(sorted, value, (size_t)n * sizeof *value);
        om_sort_doubles(sorted, n);
        om__report_head(report, "Best, median and worst by %s", om__phantoms_way_title[way]);
    }
    static const char* const which[3] = {"best", "median", "worst"};
    const int rank[3] = {n - 1, n / 2, 0};
    for (int p = 0; p < 3 && status == OM_OK; ++p) {
        int k = 0;
        while (value[k] != sorted[rank[p]]) ++k;
        status = add_pair(s, at[2 * k], at[2 * k + 1], way, which[p], report);
    }
    om_free(value);
    om_free(sorted);
    om_free(at);
    return status;
}

// ---- report.html ------------------------------------------------------------------------------------------------

static void add_how(OmReport* report) {
    om__report_section(
        report, "How",
        "In place of silicone on a bench stands the simulated world: more than twice the vertices of the twin, "
        "Mooney-Rivlin's law, 0.85 of its stiffness, weight, friction on the board and the capsule, arms in view, "
        "noise of a D435 and of measured tips, and a camera 1 mm away from where the robot believes it. Stitches "
        "hold what lies within 6 mm of the hull of a region's holes; DSC and TPR are over vertices of the twin's "
        "underside. A lift goes 30 degrees from the vertical towards the stitches and ends with the free length, at "
        "60 mm, or at 4 N. The row Grasp has all grasps at the highest step up to 40 mm that each of them reaches.");
    om_report_paragraph(
        report,
        "AVE: the twin, with the grasped vertices moved as the tool moved and the attachments held still, against the "
        "points that the camera saw, less the value at rest. Points are compared with their true material points; the "
        "thesis takes them from its matching. Volume: all vertices of the twin against the truth. A refused estimate "
        "attaches nothing and counts. Same: the true attachments. The weight of the truth holds tissue on the board "
        "that the twin, without weight, lifts; so a set that is larger than the true one can have a smaller AVE and "
        "error of the volume than Same. The twin believes in no attachment before. The "
        "network's correspondence goes through the twin that physics has corrected, so its rows are not without "
        "physics; fused: over the last three steps.");
    om_report_paragraph(
        report,
        "Maps show the underside from above: green found, blue missed, orange wrong, grey free.");
}

// What failed, and counts nevertheless.
static void add_failures(const Phantoms* s, OmReport* report) {
    const OmStudyPhantomsSummary* sum = &s->sum;
    StudyLines text = {0};
    char name[64];
    om__report_section(
        report, "What failed",
        "Lifts that ended before the free length: %d of %d. Steps without correspondence, of which the network "
        "says nothing: %d of %d. Simulations with an estimate that stopped before the whole lift, and count with "
        "the part that they reached: %d.",
        sum->nshort, sum->nlift, sum->has_network ? sum->nlost : 0, sum->nview, sum->nloose);
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        om__phantoms_name(&s->c[i], name, sizeof name);
        for (int g = 0; g < s->c[i].ngrasp; ++g)
            if (r->nlevel[g] < s->c[i].nlevel[g])
                om__lines_add(&text, "%s, grasp %d: %d of %d levels; %.1f N at the next\n", name,
                              g + 1, r->nlevel[g], s->c[i].nlevel[g], r->end_force[g]);
    }
    om__lines_fold(&text, report, "Lifts that ended early");
    text = (StudyLines){0};
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        om__phantoms_name(&s->c[i], name, sizeof name);
        for (int k = 0; k < OM_STUDY_PHANTOM_NWAY * r->nview; ++k) {
            const PhantomView* v = &r->view[k / OM_STUDY_PHANTOM_NWAY];
            const PhantomEstimate* e = &v->by[k % OM_STUDY_PHANTOM_NWAY];
            if (e->is_there && !e->is_accepted)
                om__lines_add(&text, "%s, grasp %d, %d mm, %s: %s\n", name, v->grasp + 1,
                              10 * v->level, om__phantoms_way_title[k % OM_STUDY_PHANTOM_NWAY],
                              e->reason);
        }
    }
    om__lines_fold(&text, report, "Refused estimates");
}

static OmStatus write_report(const Phantoms* s) {
    OmReport report;
    om_report_begin(&report, "Attachments of phantoms", "Table 4.2 in simulation");
    add_outcome(s, &report);
    for (int w = OM_STUDY_PHANTOM_NWAY - 1; w >= 0; --w)
        if (s->sum.row[OM_STUDY_PHANTOM_TOTAL].by[w].is_there) add_table(s, w, &report);
    OmStatus status = OM_OK;
    for (int w = OM_STUDY_PHANTOM_NWAY - 1; w >= 0 && status == OM_OK; --w)
        status = add_pictures(s, w, &report);
    add_failures(s, &report);
    add_how(&report);
    return om__report_end(&report, s->def->out_dir, status);
}

// ---- study.json, views.csv -----------------------------------------------------------------------------------

static void put_score(OmJson* json, const char* key, const OmStudyPhantomScore* score,
                      bool has_overlap) {
    if (!score->is_there) return;
    om_json_open(json, key, '{');
    if (has_overlap) {
        om__put_quartiles(json, "dsc", 1, score->dsc);
        om__put_quartiles(json, "tpr", 1, score->tpr);
        om_json_integer(json, "refused", score->nrefused);
    }
    om__put_quartiles(json, "ave_mm", 1e3, score->ave);
    om__put_quartiles(json, "volume_mm", 1e3, score->volume);
    om_json_close(json, '}');
}

static OmStatus write_json(const Phantoms* s) {
    const OmStudyPhantomsSummary* sum = &s->sum;
    OmText text = {0};
    OmJson json = om__json(&text);
    om__put(&json,
            "is_met? %d|has_network? %d|is_development? %d|is_quick? %d|configurations %d|"
            "lifts %d|steps %d|lost %d|loose %d|lifts_ended_early %d",
            sum->is_met, sum->has_network, s->def->is_development, s->def->is_quick, sum->ncase,
            sum->nlift, sum->nview, sum->nlost, sum->nloose, sum->nshort);
    om__put_quartiles(&json, "rest_mm", 1e3, sum->rest);
    om_json_open(&json, "rows", '{');
    for (int row = 0; row < OM_STUDY_PHANTOM_NROW; ++row) {
        const OmStudyPhantomResult* r = &sum->row[row];
        if (r->n == 0) continue;
        om_json_open(&json, om__phantoms_row_name[row], '{');
        om_json_integer(&json, "n", r->n);
        put_score(&json, "same", &r->same, false);
        for (int w = 0; w < OM_STUDY_PHANTOM_NWAY; ++w)
            put_score(&json, om__phantoms_way_name[w], &r->by[w], true);
        om_json_close(&json, '}');
    }
    om_json_close(&json, '}');
    return om__study_save_json(s->def->out_dir, &json, OM_OK);
}

static void add_line(StudyLines* t, const char* name, const PhantomView* v, const char* way,
                     const PhantomEstimate* e) {
    om__lines_add(t, "%s,%d,%d,%d,%.3f,%.3f,%.3f,%.3f,%s,%d,%.4f,%.4f,%.3f,%.3f\n", name,
                  v->grasp + 1, 10 * v->level, v->npoint, v->seen, v->force, 1e3 * v->same_ave,
                  1e3 * v->zero_ave, way, e->is_accepted, e->dsc, e->tpr, 1e3 * e->ave,
                  1e3 * e->volume);
}

static OmStatus write_csv(const Phantoms* s) {
    char name[64];
    StudyLines t = {0};
    om__lines_add(
        &t,
        "configuration,grasp,lift_mm,points,facing,force_n,same_ave_mm,zero_ave_mm,way,accepted,dsc,tpr,"
        "ave_mm,volume_mm\n");
    for (int i = 0; i < s->ncase; ++i) {
        const PhantomResult* r = &s->result[i];
        om__phantoms_name(&s->c[i], name, sizeof name);
        for (int k = 0; k < r->nview; ++k)
            for (int w = 0; w < OM_STUDY_PHANTOM_NWAY; ++w)
                if (r->view[k].by[w].is_there)
                    add_line(&t, name, &r->view[k], om__phantoms_way_name[w], &r->view[k].by[w]);
        PhantomView all = {.grasp = -1,
                           .level = r->joint_level,
                           .same_ave = r->joint_same_ave};  // grasp 0: all grasps
        for (int w = 0; w < OM_STUDY_PHANTOM_NWAY; ++w)
            if (r->joint[w].is_there)
                add_line(&t, name, &all, om__phantoms_way_name[w], &r->joint[w]);
    }
    return om__lines_save(&t, s->def->out_dir, "views.csv");
}

OmStatus om__phantoms_write(const Phantoms* s) {
    OM_TRY(write_json(s));
    OM_TRY(write_csv(s));
    return write_report(s);
}
