// umesh_report.c: summary.json and report.html of a data set.
#include <string.h>

#include "omentum/report.h"
#include "omentum/sense.h"
#include "umesh/umesh_internal.h"

#define NBIN 20
#define WIDTH 480
#define HEIGHT 360
#define DOT 0.12  // of the spacing: radius of the marks of moved nodes

static OmStatus write_summary(const OmUmeshDataDef* def, const OmUmeshSummary* s,
                              const int bin[NBIN]) {
    char path[1024], hash[20];
    double edge[NBIN + 1], count[NBIN];
    const OmUmeshGrid* g = om_umesh_organ_grid(def->organ);
    OM_TRY(om_path_join(def->out_dir, "summary.json", path, sizeof path));
    for (int k = 0; k <= NBIN; ++k) edge[k] = 1e3 * s->max_u * k / NBIN;
    for (int k = 0; k < NBIN; ++k) count[k] = bin[k];
    OmText text = {0};
    OmJson j = om_json_begin(&text);
    om_json_open(&j, NULL, '{');
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)om__umesh_hash_def(def));
    om_json_string(&j, "hash", hash);
    om_json_integer(&j, "seed", (int64_t)def->seed);
    om_json_integer(&j, "samples", s->nsample);
    om_json_integer(&j, "elements", g->fem.mesh.nelem);
    om_json_integer(&j, "nodes", g->fem.mesh.nnode);
    om_json_numbers(&j, "points",
                    (double[]){g->fem.grid.dim[0], g->fem.grid.dim[1], g->fem.grid.dim[2]}, 3);
    om_json_number(&j, "spacing_mm", 1e3 * g->fem.grid.spacing);
    om_json_string(&j, "law", om_law_name(def->material.law));
    om_json_number(&j, "young_Pa", def->material.young);
    om_json_number(&j, "poisson", def->material.poisson);
    om_json_number(&j, "largest_displacement_mm", 1e3 * s->max_u);
    om_json_number(&j, "mean_of_largest_mm", 1e3 * s->mean_u);
    om_json_number(&j, "largest_force_N", s->max_force);
    om_json_integer(&j, "draws", s->nattempt);
    om_json_integer(&j, "failed_solves", s->nfail);
    om_json_numbers(&j, "histogram_edges_mm", edge, NBIN + 1);
    om_json_numbers(&j, "histogram", count, NBIN);
    om_json_close(&j, '}');
    return om_json_save(&j, path);
}

// ---- pictures ---------------------------------------------------------------------------------------

static OmStatus add_surface(OmSenseScene* scene, const OmSurface* surface,
                            const OmSenseLook* look) {
    int id;
    return om_sense_scene_add(scene, surface, look, &id);
}

// Where the vertices of the organ's surface lie in the grid, for all pictures.
typedef struct Place {
    int* elem;       //                                                   (nvert)
    double* weight;  // of the element's nodes                        (nvert x 8)
} Place;

static void place_done(Place* place) {
    om_free(place->elem);
    om_free(place->weight);
}

static OmStatus place_init(const OmUmeshOrgan* organ, Place* place) {
    const OmSurface* rest = &organ->surface;
    *place = (Place){0};
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(place->elem, rest->nvert);
    OM_ALLOC_DONE(place->weight, 8 * (size_t)rest->nvert);
    OM_TRY_DONE(
        om_fem_mesh_embed(&organ->grid.fem.mesh, rest->nvert, rest->x, place->elem, place->weight));
done:
    if (status < 0) place_done(place);
    return status;
}

// The organ's surface, deformed with the grid.
static OmStatus add_organ(OmSenseScene* scene, const OmUmeshOrgan* organ, const Place* place,
                          const double* u) {
    const OmFemMesh* mesh = &organ->grid.fem.mesh;
    const OmSurface* rest = &organ->surface;
    OmSurface moved;
    OM_TRY(om_surface_init(&moved, rest->nvert, rest->ntri));
    memcpy(moved.tri_vert, rest->tri_vert, 3 * (size_t)rest->ntri * sizeof(int));
    for (int i = 0; i < rest->nvert; ++i) {
        OmVec3 p = om_load3(rest->x, i);
        for (int a = 0; a < 8; ++a)
            p = om_madd(p, place->weight[8 * i + a],
                        om_load3(u, mesh->elem_node[8 * place->elem[i] + a]));
        om_store3(moved.x, i, p);
    }
    OmSenseLook look = {.red = 0.93, .green = 0.74, .blue = 0.66, .gloss = 0.15, .is_smooth = true};
    OmStatus status = add_surface(scene, &moved, &look);
    om_surface_done(&moved);
    return status;
}

// An octahedron at each node of the patch.
static OmStatus add_patch(OmSenseScene* scene, const OmUmeshGrid* g, const unsigned char* mask,
                          int npatch, const double* u) {
    static const int corner[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                     {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    OmSurface dots;
    int n = 0;
    OM_TRY(om_surface_init(&dots, 6 * npatch, 8 * npatch));
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (!mask[i]) continue;
        OmVec3 p = om_add(om_load3(g->fem.mesh.x, i), om_load3(u, i));
        double r = DOT * g->fem.grid.spacing;
        for (int a = 0; a < 6; ++a) {
            double s = a % 2 ? -r : r;
            OmVec3 way = om_vec3(a / 2 == 0 ? s : 0, a / 2 == 1 ? s : 0, a / 2 == 2 ? s : 0);
            om_store3(dots.x, 6 * n + a, om_add(p, way));
        }
        for (int t = 0; t < 8; ++t)
            for (int c = 0; c < 3; ++c) dots.tri_vert[24 * n + 3 * t + c] = 6 * n + corner[t][c];
        ++n;
    }
    OmSenseLook look = {.red = 0.2, .green = 0.3, .blue = 0.6};
    OmStatus status = add_surface(scene, &dots, &look);
    om_surface_done(&dots);
    return status;
}

// A camera above the organ, on the side to which the patch faces.
static OmStatus render(const OmUmeshOrgan* organ, const OmUmeshSample* a, OmSenseScene* scene,
                       int nworker, OmReport* report, const char* caption) {
    OmVec3 lo, hi, up = organ->grid.up;
    om_sdf_bounds(&organ->sdf, &lo, &hi);
    double size = om_distance(lo, hi);
    OmVec3 target = om_lerp(lo, hi, 0.5), side = om_madd(a->patch.normal, 0.6, up);
    if (om_norm(om_cross(side, up)) < 0.3) side = om_add(side, om_orthogonal(up));
    OmVec3 eye = om_madd(target, 1.2 * size, om_normalize(side));
    OmCamera camera = {.pose_world_camera = om_pose_look_at(eye, target, up),
                       .width = WIDTH,
                       .height = HEIGHT,
                       .fov = 40 * OM_PI / 180,
                       .near_m = 0.001,
                       .far_m = 100};
    OmSenseOptions options = om_sense_options_default();
    OmPicture picture = {0};
    options.nworker = nworker;
    OmStatus status = om_sense_scene_commit(scene);
    if (status == OM_OK) status = om_picture_init(&picture, WIDTH, HEIGHT, 3);
    if (status == OM_OK) status = om_sense_render(scene, &camera, &options, &picture);
    if (status == OM_OK) om_report_picture(report, &picture, caption);
    om_picture_done(&picture);
    return status;
}

// A sample is a function of its index, so samples for pictures are solved again.
static OmStatus add_picture(const OmUmeshDataDef* def, OmUmeshSolver* solver, const Place* place,
                            int index, OmReport* report) {
    size_t nnode = (size_t)om_umesh_organ_grid(def->organ)->fem.mesh.nnode;
    unsigned char* mask = NULL;
    double* u = NULL;
    OmSenseScene* scene = NULL;
    OmUmeshSample a;
    char caption[200];
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(mask, nnode);
    OM_ALLOC_DONE(u, 3 * nnode);
    OM_TRY_DONE(om_umesh_sample_make(solver, index, &a, mask, u));
    OM_TRY_DONE(om_sense_scene_create(&scene));
    OM_TRY_DONE(add_organ(scene, def->organ, place, u));
    OM_TRY_DONE(add_patch(scene, om_umesh_organ_grid(def->organ), mask, a.npatch, u));
    snprintf(caption, sizeof caption,
             "Sample %d: %s, %.2f N at %.0f degrees from the normal, largest displacement %.1f mm; "
             "the nodes of the patch are marked",
             index, a.press > 0 ? "moved by the probe" : "loaded", om_norm(a.force),
             fabs(a.tilt) * 180 / OM_PI, 1e3 * a.max_u);
    status = render(def->organ, &a, scene, def->nworker, report, caption);
done:
    om_sense_scene_destroy(scene);
    om_free(mask);
    om_free(u);
    return status;
}

// ---- the page ---------------------------------------------------------------------------------------

static void add_facts(const OmUmeshDataDef* def, const OmUmeshSummary* s, OmReport* report) {
    char value[6][32];
    const char* label[6] = {"samples",
                            "active elements",
                            "mm, largest displacement",
                            "mm, mean of largest",
                            "N, largest resultant",
                            "failed solves, drawn again"};
    const char* pointer[6];
    snprintf(value[0], sizeof value[0], "%d", s->nsample);
    snprintf(value[1], sizeof value[1], "%d", om_umesh_organ_grid(def->organ)->fem.mesh.nelem);
    snprintf(value[2], sizeof value[2], "%.1f", 1e3 * s->max_u);
    snprintf(value[3], sizeof value[3], "%.1f", 1e3 * s->mean_u);
    snprintf(value[4], sizeof value[4], "%.2f", s->max_force);
    snprintf(value[5], sizeof value[5], "%d", s->nfail);
    for (int k = 0; k < 6; ++k) pointer[k] = value[k];
    om_report_facts(report, pointer, label, 6);
}

// What was asked, and what came out.
static void add_verdict(const OmUmeshSummary* s, OmReport* report) {
    char text[320];
    snprintf(text, sizeof text, "%d samples are there, each of them in equilibrium.", s->nsample);
    om_report_verdict(report, text, s->nsample > 0);
    snprintf(
        text, sizeof text,
        "Asked: deformations of an organ under a probe, from which a network learns to predict them. Came out: "
        "%d samples with displacements of up to %.1f mm; %d draws found no equilibrium and were drawn again.",
        s->nsample, 1e3 * s->max_u, s->nfail);
    om_report_paragraph(report, text);
}

static void add_histogram(const OmUmeshSummary* s, const int bin[NBIN], OmReport* report) {
    double x[NBIN + 1], y[NBIN + 1];
    for (int k = 0; k <= NBIN; ++k) {
        x[k] = 1e3 * s->max_u * k / NBIN;
        y[k] = bin[k < NBIN ? k : NBIN - 1];
    }
    OmReportChart chart = {.title = "Largest displacement of a node",
                           .x_label = "mm",
                           .y_label = "samples",
                           .nseries = 1,
                           .series = {{"samples", x, y, NBIN + 1, true}}};
    om_report_chart(report, &chart);
}

static void add_settings(const OmUmeshDataDef* def, OmReport* report) {
    char text[700];
    const OmUmeshGrid* g = om_umesh_organ_grid(def->organ);
    snprintf(
        text, sizeof text,
        "%d nodes in a grid of %d x %d x %d points, %.2f mm apart. Law %s, Young's modulus %g Pa, "
        "Poisson's ratio %g. A force is uniform in 0 to %g N, its angle to the inward normal in "
        "-%.0f to %.0f degrees; %.0f %% of the samples are moved by the probe instead, by up to %.0f "
        "mm, and %.0f %% are drawn outwards. Seed %llu.",
        g->fem.mesh.nnode, g->fem.grid.dim[0], g->fem.grid.dim[1], g->fem.grid.dim[2],
        1e3 * g->fem.grid.spacing, om_law_name(def->material.law), def->material.young,
        def->material.poisson, def->max_force, def->max_tilt * 180 / OM_PI,
        def->max_tilt * 180 / OM_PI, 100 * def->press_share, 1e3 * def->max_press,
        100 * def->pull_share, (unsigned long long)def->seed);
    om_report_paragraph(report, text);
}

OmStatus om__umesh_write_report(const OmUmeshDataDef* def, const OmUmeshSummary* s,
                                const OmUmeshSample* sample, OmUmeshSolver* solver) {
    int bin[NBIN] = {0}, max = 0, press = -1;
    for (int i = 0; i < s->nsample; ++i) {
        int k = s->max_u > 0 ? (int)(NBIN * sample[i].max_u / s->max_u) : 0;
        ++bin[k < NBIN ? k : NBIN - 1];
        if (sample[i].max_u > sample[max].max_u) max = i;
        if (sample[i].press > 0 && (press < 0 || sample[i].press > sample[press].press)) press = i;
    }
    OM_TRY(write_summary(def, s, bin));
    char path[1024];
    OmReport report;
    OM_TRY(om_path_join(def->out_dir, "report.html", path, sizeof path));
    om_report_begin(&report, "U-Mesh data", def->out_dir);
    add_verdict(s, &report);
    add_facts(def, s, &report);
    add_settings(def, &report);
    add_histogram(s, bin, &report);
    if (def->npicture > 0) om_report_heading(&report, "Samples");
    Place place = {0};
    OmStatus status = def->npicture > 0 ? place_init(def->organ, &place) : OM_OK;
    for (int k = 0; k < def->npicture && status == OM_OK; ++k) {  // the extremes, then the first
        int index = k == 0 ? max : k == 1 && press >= 0 ? press : k - 2;
        if (index >= 0 && index < s->nsample)
            status = add_picture(def, solver, &place, index, &report);
    }
    place_done(&place);
    if (status == OM_OK) return om_report_save(&report, path);
    om_report_done(&report);
    return status;
}
