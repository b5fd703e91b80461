// cli_umesh_generate.c: omentum umesh generate.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli_network.h"
#include "omentum/shape_file.h"
#include "omentum/umesh.h"

static const OmCliOption option[] = {
    OM_CLI_GENERATE("1000"),
    {"--model", NULL, "PATH",
     "a folder of omentum model, or a closed surface (.stl .obj .ply); default: phantom"},
    {"--unit", NULL, "METRES", "unit of the surface file", "0.001", "m", 1e-9, 1e3},
    {"--up", NULL, "DIRECTION",
     "direction away from the attachment: words like \"anterior\", or \"x,y,z\""},
    {"--elements", NULL, "N", "active elements of the grid", "2174", NULL, 8, 1000000},
    {"--spacing", NULL, "MM", "spacing of the grid, instead of a number of elements", NULL, "mm",
     0.01, 1000},
    {"--points", NULL, "NXxNYxNZ",
     "smallest number of points of the padded grid (thesis 32x24x16; default: as few as fit)"},
    {"--young", NULL, "PA", "Young's modulus", "the model's; phantom and surfaces 1800", "Pa", 1e-3,
     1e12},
    {"--poisson", NULL, "NU", "Poisson's ratio", "the model's; else 0.45", NULL, 0, 0.499},
    {"--force", NULL, "N", "largest force", "0.8", "N", 0, 1e6},
    {"--tilt", NULL, "DEG", "largest angle from the normal", "45", "deg", 0, 90},
    {"--press", NULL, "MM", "largest displacement of the probe, in samples with a moving probe",
     "35", "mm", 0, 1000},
    {"--press-share", NULL, "SHARE", "fraction of samples with a moving probe, 0 to 1", "0.5", NULL,
     0, 1},
    {"--pull-share", NULL, "SHARE", "fraction of samples pulled outwards, 0 to 1", "0", NULL, 0, 1},
    {"--shard", NULL, "N", "samples per file", "100", NULL, 1, 10000},
};

static const OmCliKey result_key[] = {
    {"elements", "elements of the grid"},
    {"nodes", "nodes of the grid"},
    {"samples", "in the folder"},
    {"new", "samples computed by this run"},
    {"largest_displacement_mm", "over the samples"},
};

// ---- the organ --------------------------------------------------------------------------------------

typedef struct Source {
    OmPatient patient;
    OmSurface surface;
} Source;

static OmStatus read_model(const OmCliArgs* args, OmUmeshOrganDef* def, Source* source) {
    const char *path = om_cli_get(args, "--model"), *up = om_cli_get(args, "--up");
    double unit = 0.001;
    char extension[16], yaml[1024];
    OM_TRY(om_cli_double(args, "--unit", &unit));
    if (up) OM_TRY(om_model_direction(up, false, &def->up));
    if (!path) return OM_OK;
    om_path_extension(path, extension, sizeof extension);
    bool is_surface = strcmp(extension, "stl") == 0 || strcmp(extension, "obj") == 0 ||
                      strcmp(extension, "ply") == 0;
    if (is_surface) {
        OM_TRY(om_surface_load(path, unit, &source->surface));
        def->surface = &source->surface;
        return OM_OK;
    }
    if (strcmp(extension, "yaml") == 0)
        snprintf(yaml, sizeof yaml, "%s", path);
    else
        OM_TRY(om_path_join(path, "patient.yaml", yaml, sizeof yaml));
    OM_TRY(om_patient_load(yaml, &source->patient));
    def->patient = &source->patient;
    return OM_OK;
}

static OmStatus read_grid(const OmCliArgs* args, OmUmeshOrganDef* def) {
    double spacing_mm = 0;
    const char* points = om_cli_get(args, "--points");
    OM_TRY(om_cli_int(args, "--elements", &def->nelem));
    OM_TRY(om_cli_double(args, "--spacing", &spacing_mm));
    def->spacing = 1e-3 * spacing_mm;
    char rest;
    OM_CHECK(!points ||
                 sscanf(points, "%dx%dx%d%c", &def->dim[0], &def->dim[1], &def->dim[2], &rest) == 3,
             OM_INVALID, "--points %s is not of the form 32x24x16", points);
    return OM_OK;
}

// ---- the data ---------------------------------------------------------------------------------------

static OmStatus read_data(const OmCliArgs* args, OmUmeshDataDef* def) {
    const OmCliGenerate shared = {&def->nsample, &def->shard, &def->nworker, &def->seed,
                                  &def->material.law};
    double tilt_deg = def->max_tilt * 180 / OM_PI, press_mm = 1e3 * def->max_press;
    OM_TRY(om_cli_read_generate(args, &shared));
    OM_TRY(om_cli_double(args, "--young", &def->material.young));
    OM_TRY(om_cli_double(args, "--poisson", &def->material.poisson));
    OM_TRY(om_cli_double(args, "--force", &def->max_force));
    OM_TRY(om_cli_double(args, "--tilt", &tilt_deg));
    OM_TRY(om_cli_double(args, "--press", &press_mm));
    OM_TRY(om_cli_double(args, "--press-share", &def->press_share));
    OM_TRY(om_cli_double(args, "--pull-share", &def->pull_share));
    def->max_tilt = tilt_deg * OM_PI / 180;
    def->max_press = 1e-3 * press_mm;
    return OM_OK;
}

// Diagonal of its bounding box, m.
static double organ_size(const OmUmeshGrid* g) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->fem.mesh.x, i);
        lo = om_vec3(fmin(lo.x, x.x), fmin(lo.y, x.y), fmin(lo.z, x.z));
        hi = om_vec3(fmax(hi.x, x.x), fmax(hi.y, x.y), fmax(hi.z, x.z));
    }
    return om_distance(lo, hi);
}

static void print_summary(const OmUmeshGrid* g, const OmUmeshSummary* s, const char* dir) {
    om_cli_figure("elements", g->fem.mesh.nelem);
    om_cli_figure("nodes", g->fem.mesh.nnode);
    om_cli_figure("samples", s->nsample);
    om_cli_figure("new", s->nmade);
    om_cli_figure("largest_displacement_mm", 1e3 * s->max_u);
    om_cli_path(dir);
    printf("%d elements of %.2f mm, %d nodes, in %d x %d x %d points\n", g->fem.mesh.nelem,
           1e3 * g->fem.grid.spacing, g->fem.mesh.nnode, g->fem.grid.dim[0], g->fem.grid.dim[1],
           g->fem.grid.dim[2]);
    printf("%d samples (%d new, %.2f s a solve), %d failed solves drawn again\n", s->nsample,
           s->nmade, s->solve_seconds, s->nfail);
    printf("largest displacement %.1f mm, %.1f mm in the mean of samples; %.0f s\n", 1e3 * s->max_u,
           1e3 * s->mean_u, s->seconds);
    printf("report: %s/report.html\n", dir);
    if (s->max_u > 0.5 * organ_size(g))
        fprintf(
            stderr,
            "warning: displacements reach %.0f %% of the organ's size; is it held where it should be? --force N "
            "makes them smaller\n",
            100 * s->max_u / organ_size(g));
}

// Time of one processor, measured on grids of 2,000 to 40,000 elements of the phantom.
#define SAMPLE_SECONDS 1.5e-4  // for an element of a sample
#define SAID_FROM 1800.0       // s
#define MAX_SECONDS 3e7        // a year

// Log the duration if it is long; refuse more than a year.
static OmStatus say_estimate(const OmUmeshDataDef* def, int nelem) {
    double seconds = SAMPLE_SECONDS * nelem * def->nsample / om_worker_count(def->nworker);
    OM_CHECK(
        seconds < MAX_SECONDS, OM_INVALID,
        "%d samples of %d elements would take about %.2g days, at most %.0f are begun: take "
        "fewer --samples or --elements, or make parts of the data on several machines by --seed",
        def->nsample, nelem, seconds / 86400, MAX_SECONDS / 86400);
    if (seconds > SAID_FROM)
        fprintf(stderr,
                "omentum umesh: %d samples of %d elements take about %.2g hours; what is finished "
                "stays after Ctrl-C\n",
                def->nsample, nelem, seconds / 3600);
    return OM_OK;
}

static OmStatus generate(const OmCliArgs* args, const OmUmeshOrganDef* organ_def) {
    OmUmeshOrgan* organ;
    OmUmeshSummary summary;
    OM_TRY(om_umesh_organ_create(organ_def, &organ));
    OmUmeshDataDef def = om_umesh_data_default_def(organ, om_cli_get(args, "--output"));
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OmStatus status = read_data(args, &def);
    if (status == OM_OK) status = say_estimate(&def, om_umesh_organ_grid(organ)->fem.mesh.nelem);
    if (status == OM_OK) status = om_umesh_generate(&def, progress, &summary);
    om_cli_progress_done();
    if (status == OM_OK) print_summary(om_umesh_organ_grid(organ), &summary, def.out_dir);
    om_umesh_organ_destroy(organ);
    return status;
}

static OmStatus check_args(const OmCliArgs* args, OmUmeshOrganDef* organ) {
    int npositional;
    OmUmeshDataDef def = om_umesh_data_default_def(NULL, NULL);
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(om_cli_get(args, "--output"), OM_INVALID, "no output folder is given; add -o DIR");
    OM_TRY(read_grid(args, organ));
    return read_data(args, &def);
}

int om_cli_umesh_generate(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    Source source = {0};
    if (check_args(&args, &def) < 0) return om_cli_usage("umesh");
    const char* const input[] = {om_cli_get(&args, "--model")};
    OmStatus status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 1);
    if (status == OM_OK) status = read_model(&args, &def, &source);
    if (status == OM_OK) status = generate(&args, &def);
    om_patient_done(&source.patient);
    om_surface_done(&source.surface);
    return status == OM_OK ? OM_EXIT_OK : om_cli_fail_kept("umesh", status);
}

const OmCliVerb om_cli_verb_umesh_generate = {
    .name = "umesh generate",
    .run = om_cli_umesh_generate,
    .summary = "make samples of how an organ deforms, by finite elements",
    .usage = "omentum umesh generate -o DIR [options]",
    .about =
        "Immerses the organ's surface in a regular grid of hexahedra. Each sample puts a probe of 50 x 10\n"
        "mm at a random place of the surface, loads or moves the nodes under it, and solves for\n"
        "equilibrium. DIR receives samples_NNNNNN.h5 (HDF5), summary.json and report.html. An interrupted\n"
        "command, or one with a larger N, computes only the missing samples; the files do not depend on the\n"
        "number of threads.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example = "  omentum umesh generate -n 1000 -o data/phantom\n"
               "  omentum umesh generate -n 200 --seed 2 -o data/phantom_test\n"
               "  omentum umesh generate --model liver --up anterior --elements 3000 -o data/liver",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
