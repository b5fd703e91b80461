// cli_umesh_predict.c: omentum umesh predict: press on the organ and compute its deformation.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli_common.h"
#include "omentum/shape_file.h"
#include "omentum/umesh_net.h"

#define NREPEAT 20     // predictions timed
#define MAX_CYCLE 100  // of the refinement, for fine tolerances

static const OmCliOption option[] = {
    {"--weights", "-w", "FILE", "weights of omentum umesh train",
     "the phantom's, weights/phantom.safetensors"},
    {"--at", NULL, "X,Y,Z", "position of the probe, mm; the nearest surface point is used",
     "the top"},
    {"--press", NULL, "MM", "depth of the probe along the normal", "15", "mm", -200, 200},
    {"--turn", NULL, "DEG", "angle of the probe about the normal", "0", "deg", -360, 360},
    {"--point", NULL, "X,Y,Z", "a point inside, mm: print its displacement; may be repeated"},
    {"--output", "-o", "FILE",
     "the deformed organ, its displacement, and how far nodes are off equilibrium: .vtu or .vtk, opens in ParaView"},
    {"--tolerance", NULL, "MM",
     "refine until the estimated mean distance to equilibrium is below this; 0: the network alone",
     "0.05", "mm", 0, 100},
    {"--linear", NULL, NULL, "refine the linear elastic solution; do not use the network"},
    {"--onnx", NULL, "FILE", "write the network as ONNX too"},
    {"--workers", NULL, "N", "threads", "one per processor", NULL, 0, OM_MAX_WORKER},
};

static const OmCliKey result_key[] = {
    {"prediction_ms", "median of 20"},
    {"nodes", "nodes of the organ's grid"},
    {"cycles", "cycles of the refinement"},
    {"left_mm", "estimated mean distance to equilibrium"},
    {"score", "1 and more: outside the range of the training"},
    {"point.*", "displacement of each --point in mm, by number and axis: point.0.x"},
};

typedef struct Press {
    const OmCliArgs* args;
    const OmUmeshGrid* grid;
    OmUmeshPatch patch;
    double way;  // m
    unsigned char* mask;
    float* u;
    int nmasked;
    double tolerance;  // m; 0: not refined
    OmFemGridReport refined;
} Press;

static OmStatus read_point(const char* text, const char* name, OmVec3* p) {
    double x[3];
    char* end = (char*)(uintptr_t)text;
    for (int c = 0; c < 3; ++c) {
        const char* begin = end;
        x[c] = strtod(begin, &end);
        OM_CHECK(end != begin && isfinite(x[c]) && *end == (c < 2 ? ',' : '\0'), OM_INVALID,
                 "%s is \"%s\"; it must be three numbers, like 10,0,65", name, text);
        ++end;
    }
    *p = om_scale(1e-3, om_vec3(x[0], x[1], x[2]));
    return OM_OK;
}

// The highest point of the surface.
static OmVec3 top_of(const OmUmeshGrid* g) {
    OmVec3 top = om_vec3(0, 0, 0);
    double high = -HUGE_VAL;
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        double h = om_dot(om_load3(g->surface_x, i), g->up);
        if (g->is_surface[i] && h > high) high = h, top = om_load3(g->surface_x, i);
    }
    return top;
}

static OmStatus place_probe(Press* p) {
    const char* at = om_cli_get(p->args, "--at");
    double way = 15, turn = 0;
    OmVec3 place = top_of(p->grid);
    if (at) OM_TRY(read_point(at, "--at", &place));
    OM_TRY(om_cli_double(p->args, "--press", &way));
    OM_TRY(om_cli_double(p->args, "--turn", &turn));
    p->way = 1e-3 * way;
    p->patch = om_umesh_find_place(p->grid, place);
    OmVec3 across = om_cross(p->patch.normal, p->patch.along);
    double angle = turn * OM_PI / 180;
    p->patch.along = om_add(om_scale(cos(angle), p->patch.along), om_scale(sin(angle), across));
    OM_ALLOC(p->mask, p->grid->fem.mesh.nnode);
    OM_ALLOC(p->u, 3 * (size_t)p->grid->fem.mesh.nnode);
    p->nmasked = om_umesh_patch_select(p->grid, &p->patch, p->mask);
    OM_CHECK(p->nmasked > 0, OM_INVALID, "no surface node lies under the probe there; try --turn");
    return OM_OK;
}

static void set_way(const Press* p) {
    OmVec3 d = om_scale(-p->way, p->patch.normal);
    const double value[3] = {d.x, d.y, d.z};
    for (int i = 0; i < p->grid->fem.mesh.nnode; ++i)
        for (int c = 0; c < 3; ++c) p->u[3 * i + c] = p->mask[i] ? (float)value[c] : 0;
}

static OmStatus predict(Press* p, const OmUmeshNet* net, int nworker, OmUmeshTrust* trust) {
    OmUmeshPredictor* predictor;
    double ms[NREPEAT];
    OmStatus status = OM_OK;
    double tolerance = 1e3 * OM_UMESH_TOLERANCE;
    OM_TRY(om_cli_double(p->args, "--tolerance", &tolerance));
    OM_TRY(om_umesh_predictor_create(net, nworker, &predictor));
    p->tolerance = 1e-3 * tolerance;
    om_umesh_predictor_set_refinement(predictor, p->tolerance, tolerance > 0 ? MAX_CYCLE : 0);
    om_umesh_predictor_set_linear(predictor, om_cli_get(p->args, "--linear") != NULL);
    for (int k = 0; k < NREPEAT && status >= 0; ++k) {
        set_way(p);
        double begin = om_clock_now();
        status = om_umesh_predict(predictor, p->mask, p->u, trust);
        ms[k] = 1e3 * (om_clock_now() - begin);
    }
    const OmFemGridReport refined = p->refined = om_umesh_predictor_refinement(predictor);
    om_umesh_predictor_destroy(predictor);
    if (status < 0) return status;
    om_sort_doubles(ms, NREPEAT);
    om_cli_figure("prediction_ms", ms[NREPEAT / 2]);
    om_cli_figure("nodes", p->grid->fem.mesh.nnode);
    om_cli_figure("cycles", refined.ncycle);
    if (refined.ncycle > 0) om_cli_figure("left_mm", 1e3 * refined.left);
    printf("probe at (%.1f, %.1f, %.1f) mm, %.1f mm deep; %d surface nodes move with it\n",
           1e3 * p->patch.center.x, 1e3 * p->patch.center.y, 1e3 * p->patch.center.z, 1e3 * p->way,
           p->nmasked);
    printf("a prediction: %.2f ms (median of %d), %d nodes\n", ms[NREPEAT / 2], NREPEAT,
           p->grid->fem.mesh.nnode);
    if (refined.ncycle > 0)
        printf("refined by %d cycles; about %.3f mm remain to equilibrium\n", refined.ncycle,
               1e3 * refined.left);
    else
        printf("not refined\n");
    return OM_OK;
}

static OmStatus print_points(const Press* p) {
    const char* text;
    for (int k = 0; (text = om_cli_get_nth(p->args, "--point", k)); ++k) {
        OmVec3 x, u = om_vec3(0, 0, 0), in = u;
        int elem;
        double weight[8], at[3];
        OM_TRY(read_point(text, "--point", &x));
        om_store3(at, 0, x);
        OM_TRY(om_fem_mesh_embed(&p->grid->fem.mesh, 1, at, &elem, weight));
        for (int a = 0; a < 8; ++a) {
            const float* v = p->u + 3 * (size_t)p->grid->fem.mesh.elem_node[8 * elem + a];
            u = om_madd(u, weight[a], om_vec3(v[0], v[1], v[2]));
            in = om_madd(in, weight[a],
                         om_load3(p->grid->fem.mesh.x, p->grid->fem.mesh.elem_node[8 * elem + a]));
        }
        printf("point (%s) mm moves by (%.2f, %.2f, %.2f), %.2f mm", text, 1e3 * u.x, 1e3 * u.y,
               1e3 * u.z, 1e3 * om_norm(u));
        for (int c = 0; c < 3; ++c) {
            char name[32];
            snprintf(name, sizeof name, "point.%d.%c", k, "xyz"[c]);
            om_cli_figure(name, 1e3 * (c == 0 ? u.x : c == 1 ? u.y : u.z));
        }
        double off = 1e3 * om_distance(in, x);
        if (off > 0.01)
            printf(" - it is %.1f mm outside of the grid, this is the nearest point\n", off);
        else
            printf("\n");
    }
    return OM_OK;
}

// Write the deformed organ, after untangling.
// @return OM_NOT_CONVERGED: some tetrahedra stay inverted, nothing is written
static OmStatus write_mesh(const Press* p, const OmUmeshNet* net, const char* path) {
    OmTetMesh mesh;
    OmFemGridUntangling untangling;
    char ext[8];
    om_path_extension(path, ext, sizeof ext);
    OM_CHECK(strcmp(ext, "vtu") == 0 || strcmp(ext, "vtk") == 0, OM_INVALID,
             "%s: the format must be .vtu or .vtk", path);
    const size_t nnode = (size_t)p->grid->fem.mesh.nnode;
    OM_TRY(om_fem_grid_make_tet_mesh(&p->grid->fem, &mesh));
    OmStatus status = OM_OK;
    float *u = NULL, *moved = NULL;
    OM_ALLOC_DONE(u, 3 * nnode);
    OM_ALLOC_DONE(moved, nnode);
    memcpy(u, p->u, 3 * nnode * sizeof *u);
    OM_TRY_DONE(om_umesh_untangle(net, p->mask, u, &untangling));
    if (status > 0) {
        om_error(
            status,
            "%s is not written: %d tetrahedra of the prediction are inverted, and no valid shape near it was found; "
            "press less deep, or turn the probe",
            path, untangling.ninverted);
        goto done;
    }
    for (size_t i = 0; i < nnode; ++i) {
        const float *now = u + 3 * i, *before = p->u + 3 * i;
        moved[i] = (float)om_distance(om_vec3(now[0], now[1], now[2]),
                                      om_vec3(before[0], before[1], before[2]));
    }
    for (size_t k = 0; k < 3 * nnode; ++k) mesh.x[k] += (double)u[k];
    const OmMeshArray array[] = {{"displacement", OM_ARRAY_FLOAT, 3, false, u},
                                 {"under_probe", OM_ARRAY_BYTE, 1, false, p->mask},
                                 {"off_equilibrium", OM_ARRAY_FLOAT, 1, false, moved}};
    OM_TRY_DONE(om_tet_mesh_save_format(
        &mesh, path, 1, strcmp(ext, "vtu") == 0 ? OM_MESH_VTU : OM_MESH_VTK, array, 3));
    printf("wrote %s (m)\n", path);
    om_cli_path(path);
    if (untangling.ninverted > 0)
        printf(
            "beside the probe %d of %d tetrahedra are inverted at equilibrium; in the file %d nodes are moved off "
            "equilibrium to untangle them, by up to %.2f mm (mean over all nodes %.3f mm)\n",
            untangling.ninverted, mesh.ntet, untangling.nmoved, 1e3 * untangling.max,
            1e3 * untangling.mean);
done:
    om_free(u);
    om_free(moved);
    om_tet_mesh_done(&mesh);
    return status;
}

// True if the refinement reached its tolerance without an inverted element.
static bool is_refined(const Press* p) {
    const OmFemGridReport* r = &p->refined;
    if (r->ncycle == 0) return true;  // not refined, by choice or because it is impossible
    if (!(r->left < p->tolerance)) {
        printf(
            "NOT at equilibrium: after %d cycles about %.3g mm are left, the tolerance is %.3g\n",
            r->ncycle, 1e3 * r->left, 1e3 * p->tolerance);
        return false;
    }
    if (!(r->min_volume > 0)) {
        printf("NOT valid: an element is inverted at a Gauss point\n");
        return false;
    }
    return true;
}

// `is_good`: at equilibrium, written if requested, and within the range of the training.
static OmStatus run(const OmCliArgs* args, int nworker, bool* is_good) {
    OmUmeshNet* net;
    OmUmeshTrust trust;
    const char *out = om_cli_get(args, "--output"), *onnx = om_cli_get(args, "--onnx");
    char weights[1024];
    OM_TRY(om_cli_weights_path(args, weights, sizeof weights));
    const char* const input[] = {weights, onnx};
    OM_TRY(om_cli_check_apart(out, input, 2));
    OM_TRY(om_cli_check_apart(onnx, input, 1));
    if (out) OM_TRY(om_file_check_ours(out, "under_probe"));
    if (onnx) OM_TRY(om_file_check_ours(onnx, "omentum"));
    om_cli_clean_beside(out);
    om_cli_clean_beside(onnx);
    OM_TRY(om_umesh_net_load(weights, &net));
    Press p = {.args = args, .grid = om_umesh_net_grid(net)};
    OmStatus status;
    OM_TRY_DONE(place_probe(&p));
    OM_TRY_DONE(predict(&p, net, nworker, &trust));
    OM_TRY_DONE(print_points(&p));
    if (onnx) OM_TRY_DONE(om_umesh_net_save_onnx(net, onnx));
    bool is_valid = is_refined(&p);
    if (out && !is_valid) printf("%s is not written\n", out);
    if (out && is_valid) {
        OM_TRY_DONE(write_mesh(&p, net, out));
        is_valid = status == OM_OK;
        if (!is_valid) fprintf(stderr, "omentum umesh: %s\n", om_error_message());
    }
    *is_good = is_valid && trust.is_inside;
    om_cli_figure("score", trust.score);
    if (!trust.is_inside) om_cli_reason(trust.why);
    if (trust.is_inside)
        printf("within the range of the training (%.2f of the limit)\n", trust.score);
    else
        printf("OUTSIDE the range of the training: %s\n", trust.why);
done:
    om_free(p.mask);
    om_free(p.u);
    om_umesh_net_destroy(net);
    return status;
}

int om_cli_umesh_predict(int argc, char** argv) {
    OmCliArgs args = {option, sizeof option / sizeof *option, argc, argv};
    int npositional, nworker = 0;
    bool is_good = false;
    OmStatus status = om_cli_check(&args, 0, &npositional);
    if (status >= 0) status = om_cli_int(&args, "--workers", &nworker);
    if (status < 0) return om_cli_usage("umesh");
    status = run(&args, nworker, &is_good);
    if (status < 0) return om_cli_fail("umesh", status);
    return is_good ? OM_EXIT_OK : OM_EXIT_FAILED;
}

const OmCliVerb om_cli_verb_umesh_predict = {
    .name = "umesh predict",
    .run = om_cli_umesh_predict,
    .summary = "press on the organ and compute its deformation",
    .usage = "omentum umesh predict [-w WEIGHTS] [options]",
    .about =
        "Presses a probe of 50 x 10 mm along the surface normal. Prints the time, whether the input is\n"
        "within the range of the training, and the displacements of points inside. Exit code 0: the input\n"
        "is within the range; 1: do not trust the answer, because the input is outside that range,\n"
        "equilibrium was not reached, or an element is inverted. The file of -o has no inverted\n"
        "tetrahedron, or is not written.",
    .option = option,
    .noption = sizeof option / sizeof *option,
    .example =
        "  omentum umesh predict --press 20 --point 0,0,50\n"
        "  omentum umesh predict --press 30 --tolerance 0.001\n"
        "  omentum umesh predict -w out/umesh/weights.safetensors --at 20,0,70 -o pressed.vtu",
    .key = result_key,
    .nkey = sizeof result_key / sizeof *result_key,
};
