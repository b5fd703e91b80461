// cli_umesh_generate.c: omentum umesh generate.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/shape_file.h"
#include "omentum/umesh.h"

static const OmCliOption option[] = {
    {"--output", "-o", "DIR", "folder of the data set; what is finished there is not made again"},
    {"--samples", "-n", "N", "how many (default 1000)"},
    {"--seed", NULL, "N", "sample i is a function of seed and i (default 1)"},
    {"--model", NULL, "PATH",
     "a folder of omentum model, or a closed surface (.stl .obj .ply); default: phantom"},
    {"--unit", NULL, "METRES", "of the surface file (default 0.001)"},
    {"--up", NULL, "DIRECTION",
     "away from what holds the organ: words as \"anterior\", or \"x,y,z\""},
    {"--elements", NULL, "N", "active elements of the grid (default 2174)"},
    {"--spacing", NULL, "MM", "of the grid, instead of a number of elements"},
    {"--points", NULL, "NXxNYxNZ",
     "of the padded grid at least (thesis 32x24x16; default: as few as fit)"},
    {"--law", NULL, "NAME",
     "of elasticity (default neo-hookean; the thesis's: st-venant-kirchhoff)"},
    {"--young", NULL, "PA", "Young's modulus (default: the model's; phantom and surfaces 1800)"},
    {"--poisson", NULL, "NU", "Poisson's ratio (default: the model's; else 0.45)"},
    {"--force", NULL, "N", "largest force (default 0.8)"},
    {"--tilt", NULL, "DEG", "largest angle from the normal (default 45)"},
    {"--press", NULL, "MM", "largest way of the probe, of samples that it moves (default 35)"},
    {"--press-share", NULL, "SHARE", "of these samples, 0 to 1 (default 0.5)"},
    {"--pull-share", NULL, "SHARE", "of samples drawn outwards, 0 to 1 (default 0)"},
    {"--shard", NULL, "N", "samples of a file (default 100)"},
    {"--workers", NULL, "N", "threads (default: one a processor)"},
    {"--quiet", "-q", NULL, "no progress"},
    {"--help", "-h", NULL, "this text"},
};

static void print_help(const OmCliArgs* args) {
    printf(
        "omentum umesh generate: samples of how an organ deforms\n\n"
        "Usage: omentum umesh generate -o DIR [options]\n\n"
        "The organ's surface is immersed in a regular grid of hexahedra. Each sample puts a probe of 50 x 10 mm\n"
        "somewhere on it, loads or moves the nodes under it, and solves for equilibrium (thesis 3.6, Algorithm 2).\n"
        "DIR receives samples_NNNNNN.h5 (HDF5), summary.json and report.html. Stopped and started again, or with\n"
        "a larger N, the command makes what is missing; the files do not depend on the number of threads.\n");
    om_cli_print_options(args);
    printf("\nExamples:\n"
           "  omentum umesh generate -n 1000 -o data/phantom\n"
           "  omentum umesh generate -n 200 --seed 2 -o data/phantom_test\n"
           "  omentum umesh generate --model liver --up anterior --elements 3000 -o data/liver\n");
}

// ---- the organ --------------------------------------------------------------------------------------

typedef struct Source {
    OmPatient patient;
    OmSurface surface;
} Source;

static OmStatus read_model(const OmCliArgs* args, OmUmeshOrganDef* def, Source* source) {
    const char *path = om_cli_get(args, "--model"), *up = om_cli_get(args, "--up");
    double unit = 0.001;
    char extension[16], yaml[1024];
    OM_TRY(om_cli_get_double(args, "--unit", 1e-9, 1e3, &unit));
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
    OM_TRY(om_cli_get_int(args, "--elements", 8, 1000000, &def->nelem));
    OM_TRY(om_cli_get_double(args, "--spacing", 0.01, 1000, &spacing_mm));
    def->spacing = 1e-3 * spacing_mm;
    char rest;
    OM_CHECK(!points ||
                 sscanf(points, "%dx%dx%d%c", &def->dim[0], &def->dim[1], &def->dim[2], &rest) == 3,
             OM_INVALID, "--points %s is not of the form 32x24x16", points);
    return OM_OK;
}

// ---- the data ---------------------------------------------------------------------------------------

static OmStatus read_data(const OmCliArgs* args, OmUmeshDataDef* def) {
    int seed = (int)def->seed;
    double tilt_deg = def->max_tilt * 180 / OM_PI, press_mm = 1e3 * def->max_press;
    const char* law = om_cli_get(args, "--law");
    OM_TRY(om_cli_get_int(args, "--samples", 1, 10000000, &def->nsample));
    OM_TRY(om_cli_get_int(args, "--seed", 0, 2147483647, &seed));
    OM_TRY(om_cli_get_int(args, "--shard", 1, 10000, &def->shard));
    OM_TRY(om_cli_get_int(args, "--workers", 0, OM_MAX_WORKER, &def->nworker));
    OM_TRY(om_cli_get_double(args, "--young", 1e-3, 1e12, &def->material.young));
    OM_TRY(om_cli_get_double(args, "--poisson", 0, 0.499, &def->material.poisson));
    OM_TRY(om_cli_get_double(args, "--force", 0, 1e6, &def->max_force));
    OM_TRY(om_cli_get_double(args, "--tilt", 0, 90, &tilt_deg));
    OM_TRY(om_cli_get_double(args, "--press", 0, 1000, &press_mm));
    OM_TRY(om_cli_get_double(args, "--press-share", 0, 1, &def->press_share));
    OM_TRY(om_cli_get_double(args, "--pull-share", 0, 1, &def->pull_share));
    if (law) OM_TRY(om_law_find(law, &def->material.law));
    def->seed = (uint64_t)seed;
    def->max_tilt = tilt_deg * OM_PI / 180;
    def->max_press = 1e-3 * press_mm;
    return OM_OK;
}

// From corner to corner of its box, m.
static double organ_size(const OmUmeshGrid* g) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    for (int i = 0; i < g->mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->mesh.x, i);
        lo = om_vec3(fmin(lo.x, x.x), fmin(lo.y, x.y), fmin(lo.z, x.z));
        hi = om_vec3(fmax(hi.x, x.x), fmax(hi.y, x.y), fmax(hi.z, x.z));
    }
    return om_distance(lo, hi);
}

static void print_summary(const OmUmeshGrid* g, const OmUmeshSummary* s, const char* dir) {
    printf("%d elements of %.2f mm, %d nodes, in %d x %d x %d points\n", g->mesh.nelem,
           1e3 * g->spacing, g->mesh.nnode, g->dim[0], g->dim[1], g->dim[2]);
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

static OmStatus generate(const OmCliArgs* args, const OmUmeshOrganDef* organ_def) {
    OmUmeshOrgan* organ;
    OmUmeshSummary summary;
    OM_TRY(om_umesh_create_organ(organ_def, &organ));
    OmUmeshDataDef def = om_umesh_default_data_def(organ, om_cli_get(args, "--output"));
    const OmProgress* progress = om_cli_progress(om_cli_get(args, "--quiet") != NULL);
    OmStatus status = read_data(args, &def);
    if (status == OM_OK) status = om_umesh_generate(&def, progress, &summary);
    om_cli_progress_done();
    if (status == OM_OK) print_summary(om_umesh_grid(organ), &summary, def.out_dir);
    om_umesh_destroy_organ(organ);
    return status;
}

static OmStatus check_args(const OmCliArgs* args, OmUmeshOrganDef* organ) {
    int npositional;
    OmUmeshDataDef def = om_umesh_default_data_def(NULL, NULL);
    OM_TRY(om_cli_check(args, 0, &npositional));
    OM_CHECK(om_cli_get(args, "--output"), OM_INVALID, "no output folder is given; add -o DIR");
    OM_TRY(read_grid(args, organ));
    return read_data(args, &def);
}

int om_cli_umesh_generate(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    if (om_cli_get(&args, "--help")) {
        print_help(&args);
        return OM_EXIT_OK;
    }
    OmUmeshOrganDef def = om_umesh_default_organ_def();
    Source source = {0};
    if (check_args(&args, &def) < 0) {
        fprintf(stderr, "omentum umesh: %s\n", om_error_message());
        return OM_EXIT_USAGE;
    }
    const char* const input[] = {om_cli_get(&args, "--model")};
    OmStatus status = om_cli_check_apart(om_cli_get(&args, "--output"), input, 1);
    if (status == OM_OK) status = read_model(&args, &def, &source);
    if (status == OM_OK) status = generate(&args, &def);
    om_patient_done(&source.patient);
    om_surface_done(&source.surface);
    return status == OM_OK ? OM_EXIT_OK : om_cli_fail_kept("umesh", status);
}
