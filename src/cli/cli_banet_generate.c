// cli_banet_generate.c: omentum banet generate.
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/banet_data.h"

#define MAX_PART 256

static const OmCliOption option[] = {
    OM_CLI_GENERATE("5000"),
    {"--test", NULL, "NAME",
     "a test set: test, test-camera (380 samples), board, two (190); sets number, seed, way and shares"},
    {"--first", NULL, "N", "index of the first sample, a multiple of --shard; for parts of a set",
     "0", NULL, 0, 10000000},
    {"--part", NULL, "DIR",
     "folder with a part of the same set; its files are copied, not made again; may be repeated"},
    {"--way", NULL, "NAME",
     "measured displacement: exact, camera (with the errors of a depth camera and of a wrong model), or mixed",
     "mixed"},
    {"--element", NULL, "NAME",
     "tetrahedra of the bodies: linear, which bend too stiffly, or quadratic", "quadratic"},
    {"--side", NULL, "MM", "side of 64 voxels; 200 for sheets below 6 mm", "300", "mm", 10, 10000},
    {"--board-share", NULL, "SHARE", "fraction of samples that lie on a board, 0 to 1", "0.15",
     NULL, 0, 1},
    {"--two-share", NULL, "SHARE", "fraction of samples with two attached regions, 0 to 1", "0.15",
     NULL, 0, 1},
    {"--shard", NULL, "N", "samples per file", "50", NULL, 1, 10000},
    {"--pictures", NULL, "N", "samples shown in the report", "6", NULL, 0, 1000},
};

static const OmCliKey result_key[] = {
    {"samples", "in the folder"},
    {"new", "samples computed by this run"},
    {"median_displacement_mm", "median over samples of the largest displacement of a vertex"},
    {"largest_displacement_mm", "over the samples"},
    {"bytes", "of the files of samples"},
    {"sample_seconds", "mean time of a new sample, of one thread"},
};

// The definition: that of a test set, or the default.
static OmStatus read_base(const OmCliArgs* args, OmBanetDataDef* def) {
    static const char* const fixed[] = {"--samples", "--seed", "--way", "--board-share",
                                        "--two-share"};
    const char *test = om_cli_get(args, "--test"), *dir = om_cli_get(args, "--output");
    *def = om_banet_data_default_def(1, dir);
    if (!test) return OM_OK;
    for (size_t k = 0; k < sizeof fixed / sizeof *fixed; ++k)
        OM_CHECK(!om_cli_get(args, fixed[k]), OM_INVALID, "--test %s sets %s itself", test,
                 fixed[k]);
    for (int k = 0; k < OM_BANET_NTEST; ++k) {
        if (strcmp(om_banet_test_name((OmBanetTest)k), test) != 0) continue;
        *def = om_banet_data_test_def((OmBanetTest)k, dir);
        return OM_OK;
    }
    return om_error(OM_INVALID, "--test %s: the test sets are test, test-camera, board and two",
                    test);
}

static OmStatus read_element(const OmCliArgs* args, OmElement* element) {
    const char* name = om_cli_get(args, "--element");
    if (!name) return OM_OK;
    bool is_linear = strcmp(name, "linear") == 0;
    OM_CHECK(is_linear || strcmp(name, "quadratic") == 0, OM_INVALID,
             "--element %s: it must be linear or quadratic", name);
    *element = is_linear ? OM_TET4 : OM_TET10;
    return OM_OK;
}

static OmStatus read_def(const OmCliArgs* args, OmBanetDataDef* def) {
    OM_TRY(read_base(args, def));
    const OmCliGenerate shared = {&def->nsample, &def->shard, &def->nworker, &def->sample.seed,
                                  &def->sample.law};
    int way = 0;
    double side_mm = 1e3 * def->sample.side;
    const char* name = om_cli_get(args, "--way");
    OM_TRY(om_cli_read_generate(args, &shared));
    OM_TRY(om_cli_int(args, "--first", &def->first));
    OM_TRY(om_cli_int(args, "--pictures", &def->npicture));
    OM_TRY(om_cli_double(args, "--side", &side_mm));
    OM_TRY(read_element(args, &def->sample.element));
    OM_TRY(om_cli_double(args, "--board-share", &def->sample.board_share));
    OM_TRY(om_cli_double(args, "--two-share", &def->sample.two_share));
    while (name && way < OM_BANET_NWAY && strcmp(om_banet_way_name((OmBanetWay)way), name) != 0)
        ++way;
    OM_CHECK(way < OM_BANET_NWAY, OM_INVALID, "--way %s: it must be exact, camera or mixed", name);
    if (name) def->sample.way = (OmBanetWay)way;
    def->sample.side = 1e-3 * side_mm;
    OM_CHECK(def->first % def->shard == 0 && def->first < def->nsample, OM_INVALID,
             "--first %d must be a multiple of --shard %d and below --samples %d", def->first,
             def->shard, def->nsample);
    return om_banet_sample_def_validate(&def->sample);
}

// The folders of --part, at most `max`.
static OmStatus read_parts(const OmCliArgs* args, const char** part, int max, int* npart) {
    const char* dir;
    for (*npart = 0; (dir = om_cli_get_nth(args, "--part", *npart)) != NULL; part[(*npart)++] = dir)
        OM_CHECK(*npart < max && om_path_exists(dir), OM_INVALID,
                 *npart < max ? "--part %s: there is no such folder"
                              : "--part %s: more than 256 parts",
                 dir);
    return OM_OK;
}

static void print_summary(const OmBanetSummary* s, const char* dir) {
    om_cli_figure("samples", s->nsample);
    om_cli_figure("new", s->nmade);
    om_cli_figure("median_displacement_mm", 1e3 * s->median_u);
    om_cli_figure("largest_displacement_mm", 1e3 * s->max_u);
    om_cli_figure("bytes", (double)s->nbyte);
    om_cli_figure("sample_seconds", s->sample_seconds);
    om_cli_path(dir);
    printf("%d samples (%d new, %.2f s each), %d draws, %d failed solves drawn again\n", s->nsample,
           s->nmade, s->sample_seconds, s->nattempt, s->nfail);
    printf("%d through a camera, %d on a board, %d with two regions\n", s->ncamera, s->nboard,
           s->ntwo);
    printf("largest displacement %.1f mm in the median of samples, at most %.1f mm\n",
           1e3 * s->median_u, 1e3 * s->max_u);
    printf("%.1f MB, %.1f kB a sample; %.0f s\n", 1e-6 * (double)s->nbyte,
           1e-3 * (double)s->nbyte / s->nsample, s->seconds);
    printf("report: %s/report.html\n", dir);
}

int om_cli_banet_generate(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmBanetDataDef def;
    OmBanetSummary summary;
    int npositional;
    const char* part[MAX_PART];
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status == OM_OK && !om_cli_get(&args, "--output"))
        status = om_error(OM_INVALID, "no output folder is given; add -o DIR");
    if (status == OM_OK) status = read_def(&args, &def);
    if (status == OM_OK) status = read_parts(&args, part, MAX_PART, &def.npart);
    if (status < 0) return om_cli_usage("banet");
    def.part = part;
    status = om_cli_check_apart(def.out_dir, part, def.npart);
    if (status == OM_OK)
        status = om_banet_generate(&def, om_cli_progress(om_cli_get(&args, "--quiet") != NULL),
                                   &summary);
    om_cli_progress_done();
    if (status != OM_OK) return om_cli_fail_kept("banet", status);
    print_summary(&summary, def.out_dir);
    return OM_EXIT_OK;
}

const OmCliVerb om_cli_verb_banet_generate = {
    .name = "banet generate",
    .run = om_cli_banet_generate,
    .summary = "make samples of pulled sheets with known attachments, by finite elements",
    .usage = "omentum banet generate -o DIR [options]",
    .about =
        "Each sample is a random sheet of fat, 60 to 200 mm long and below 20 mm thick, attached at 5 to 50 %\n"
        "of its surface and pulled at one place to its equilibrium, and the displacement of the part of\n"
        "its surface that is seen. DIR receives samples_NNNNNN.h5 (HDF5), summary.json and report.html. An\n"
        "interrupted command, or one with a larger N, computes only the missing samples; the files do not\n"
        "depend on the number of threads.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum banet generate -o data/banet\n"
               "  omentum banet generate --test test -o data/banet_test\n"
               "  omentum banet generate -n 500 --seed 7 --way camera -o data/banet_camera",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
