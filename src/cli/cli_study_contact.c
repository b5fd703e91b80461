// cli_study_contact.c: omentum study contact.
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "omentum/shape_file.h"
#include "studies/study.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the study; finished results there are kept"},
    {"--quick", NULL, NULL, "three coarse meshes, two lesions, a coarse truth: under a minute"},
    {"--resolutions", NULL, "N[,N...]", "elements of the meshes", "the thesis's nine"},
    {"--methods", NULL, "NAME[,NAME...]", "penalty, multipliers, prescribed", "all"},
    {"--lesions-used", NULL, "N", "press over the first N lesions only", NULL, NULL, 1,
     OM_STUDY_MAX_LESION},
    {"--mesh", NULL, "FILE", "another body: a tetrahedral mesh (msh, vtk, vtu)"},
    {"--lesions", NULL, "FILE", "its lesions, one a line: x y z [radius]"},
    {"--unit", NULL, "mm|cm|m", "unit of both files", "mm"},
    {"--lesion-unit", NULL, "mm|cm|m", "unit of the lesions", "--unit"},
    {"--up", NULL, "X,Y,Z", "side of the body from which the probe comes", "0,0,1"},
    {"--friction", NULL, "MU", "Coulomb's friction coefficient, of penalty and multipliers", "0",
     NULL, 0, 10},
    {"--contact-triangles", NULL, "N", "triangles of the contact surface", "4000", NULL, 100,
     200000},
    {"--truth", NULL, "N", "elements of the quadratic truth", "35000", NULL, 1000, 1000000},
    OM_CLI_STUDY_OPTIONS,
};

static const OmCliKey result_key[] = {
    {"runs", "presses in all"},
    {"completed", "runs that completed the path"},
    {"cells", "combinations of method and mesh"},
    {"cells_met", "combinations that meet all criteria"},
};

// ---- options --------------------------------------------------------------------------------------

static OmStatus read_resolutions(const char* list, OmStudyContactDef* def) {
    if (!list) return OM_OK;
    const char *at = list, *end = list + strlen(list);
    for (def->nresolution = 0; at < end; ++at) {
        int64_t n;
        OM_CHECK(def->nresolution < OM_STUDY_MAX_RESOLUTION && om_integer_parse(&at, end, &n) &&
                     n > 0 && n <= 2000000 && (at == end || *at == ','),
                 OM_INVALID, "--resolutions: \"%s\" is not a list of up to %d numbers", list,
                 OM_STUDY_MAX_RESOLUTION);
        def->resolution[def->nresolution++] = (int)n;
    }
    return OM_OK;
}

static OmStatus read_methods(const char* list, OmStudyContactDef* def) {
    static const char* const name[] = {"penalty", "multipliers", "prescribed"};
    if (!list) return OM_OK;
    for (int m = 0; m < OM_STUDY_NMETHOD; ++m) def->has_method[m] = false;
    while (*list) {
        size_t n = strcspn(list, ",");
        int found = -1;
        for (int m = 0; m < OM_STUDY_NMETHOD; ++m)
            if (strlen(name[m]) == n && strncmp(name[m], list, n) == 0) found = m;
        OM_CHECK(found >= 0, OM_INVALID,
                 "--methods: \"%.*s\" is none of penalty, multipliers, prescribed", (int)n, list);
        def->has_method[found] = true;
        list += n + (list[n] == ',');
    }
    return OM_OK;
}

static OmStatus read_unit(const char* flag, const char* name, double* unit) {
    if (!name || strcmp(name, "mm") == 0)
        *unit = OM_UNIT_MM;
    else if (strcmp(name, "cm") == 0)
        *unit = OM_UNIT_CM;
    else if (strcmp(name, "m") == 0)
        *unit = OM_UNIT_M;
    else
        return om_error(OM_INVALID, "%s: \"%s\" is none of mm, cm, m", flag, name);
    return OM_OK;
}

static OmStatus read_units(const OmCliArgs* args, double* unit, double* lesion_unit) {
    OM_TRY(read_unit("--unit", om_cli_get(args, "--unit"), unit));
    *lesion_unit = *unit;
    const char* own = om_cli_get(args, "--lesion-unit");
    return own ? read_unit("--lesion-unit", own, lesion_unit) : OM_OK;
}

static OmStatus read_up(const char* text, OmVec3* up) {
    *up = om_vec3(0, 0, 1);
    if (!text) return OM_OK;
    double v[3];
    const char *at = text, *end = text + strlen(text);
    for (int i = 0; i < 3; ++i) {
        OM_CHECK(om_number_parse(&at, end, &v[i]) && (i == 2 ? at == end : *at++ == ','),
                 OM_INVALID, "--up: \"%s\" is not three numbers x,y,z", text);
    }
    *up = om_vec3(v[0], v[1], v[2]);
    OM_CHECK(om_norm(*up) > 0, OM_INVALID, "--up: the direction has length 0");
    return OM_OK;
}

// Few meshes, few lesions, a truth that takes seconds.
static void make_quick(OmStudyContactDef* def) {
    static const int resolution[] = {623, 1363, 2539};
    def->nresolution = 3;
    memcpy(def->resolution, resolution, sizeof resolution);
    def->nlesion = 2;
    def->truth_ntet = 4000;
    def->time_step = 0.05;
}

static OmStatus read_def(const OmCliArgs* args, OmStudyContactDef* def) {
    if (om_cli_get(args, "--quick")) make_quick(def);
    OM_TRY(read_resolutions(om_cli_get(args, "--resolutions"), def));
    OM_TRY(read_methods(om_cli_get(args, "--methods"), def));
    OM_TRY(om_cli_int(args, "--lesions-used", &def->nlesion));
    OM_TRY(om_cli_double(args, "--friction", &def->friction));
    OM_TRY(om_cli_int(args, "--contact-triangles", &def->contact_ntri));
    OM_TRY(om_cli_int(args, "--truth", &def->truth_ntet));
    return om_cli_int(args, "--workers", &def->nworker);
}

// ---- the verb -------------------------------------------------------------------------------------

static void print_result(const OmStudyContactSummary* r, const char* dir) {
    om_cli_figure("runs", r->nrun);
    om_cli_figure("completed", r->ncomplete);
    om_cli_figure("cells", r->ncell);
    om_cli_figure("cells_met", r->ncell_met);
    om_cli_path(dir);
    printf("%d runs (%d new): %d completed the path; the worst reached %.0f %%\n", r->nrun, r->nnew,
           r->ncomplete, 100 * r->worst_stability);
    printf("all criteria are met by %d of %d combinations of method and mesh\n", r->ncell_met,
           r->ncell);
    printf("report: %s/report.html\n", dir);
}

static OmStatus get_body(const OmCliArgs* args, OmStudyBody** body) {
    const char *mesh = om_cli_get(args, "--mesh"), *lesions = om_cli_get(args, "--lesions");
    if (!mesh) return om_study_body_create_phantom(10, 1, body);
    double unit = OM_UNIT_MM, lesion_unit = OM_UNIT_MM;
    OmVec3 up;
    OM_TRY(read_units(args, &unit, &lesion_unit));
    OM_TRY(read_up(om_cli_get(args, "--up"), &up));
    OM_TRY(om_study_body_load(mesh, unit, lesions, lesion_unit, up, body));
    int n = om_study_count_outside(*body);
    if (n > 0)
        fprintf(stderr, "note: %d %s %s outside the body and left out\n", n,
                n == 1 ? "lesion" : "lesions", n == 1 ? "is" : "are");
    return OM_OK;
}

// Check every word before anything is loaded.
static OmStatus check_args(const OmCliArgs* args) {
    int npositional;
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(om_cli_get(args, "--output"), OM_INVALID, "no output folder is given; add -o DIR");
    OM_CHECK(!om_cli_get(args, "--mesh") == !om_cli_get(args, "--lesions"), OM_INVALID,
             "--mesh and --lesions go together");
    OmStudyContactDef trial = om_study_contact_default_def(NULL, NULL);
    double unit = OM_UNIT_MM, lesion_unit = OM_UNIT_MM;
    OmVec3 up;
    OM_TRY(read_units(args, &unit, &lesion_unit));
    OM_TRY(read_up(om_cli_get(args, "--up"), &up));
    return read_def(args, &trial);
}

int om_cli_study_contact(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    if (check_args(&args) < 0) return om_cli_usage("study");
    OmStudyBody* body = NULL;
    OmStudyContactSummary summary;
    const char* const input[] = {om_cli_get(&args, "--mesh"), om_cli_get(&args, "--lesions")};
    OmStatus status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 2);
    if (status == OM_OK) status = get_body(&args, &body);
    OmStudyContactDef def = om_study_contact_default_def(body, om_cli_get(&args, "--output"));
    const OmProgress* progress = om_cli_study_begin(&args);
    if (status == OM_OK) status = read_def(&args, &def);
    if (status == OM_OK) status = om_study_contact_run(&def, progress, &summary);
    om_study_body_destroy(body);
    if (status < 0) return om_cli_fail_kept("study", status);
    om_cli_progress_done();
    print_result(&summary, def.out_dir);
    return summary.ncell_met == summary.ncell ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_study_contact = {
    .name = "study contact",
    .run = om_cli_study_contact,
    .summary = "compare three contact methods of a probe pressed on a breast",
    .usage = "omentum study contact -o DIR [options]",
    .about =
        "The study of thesis 3.3, 3.4 and 3.7: a 50 x 10 mm probe is pressed 30 mm over each lesion of a\n"
        "breast phantom, by penalty, Lagrange multipliers and prescribed displacement, on nine meshes. DIR\n"
        "receives report.html, study.json, runs.csv, errors.csv, and a file for every run. After an\n"
        "interruption the same command continues the study. Exit code 0: every path met all criteria; 1: a\n"
        "combination of method and mesh missed one, and the report names it.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum study contact --quick -o out/quick\n"
        "  omentum study contact --resolutions 623,2539,7369,26220 -o out/contact\n"
        "  omentum study contact -o out/contact\n"
        "  omentum study contact --mesh breast/tissue.vtu --unit m --lesions sites.txt --lesion-unit mm -o out/breast",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
