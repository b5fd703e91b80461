// 12_predict_a_press.c: a trained network predicts how a breast phantom deforms under a probe, in milliseconds.
//
//     12_predict_a_press weights/phantom.safetensors
//
// One file holds weights, grid and the region of trust. The input is the displacement of the nodes under the
// probe, the output that of all nodes; cycles of relaxation then bring it to equilibrium.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

// The highest place that the probe can touch.
static OmVec3 top_of(const OmUmeshGrid* grid) {
    OmVec3 top = om_vec3(0, 0, 0);
    for (int i = 0; i < grid->fem.mesh.nnode; ++i) {
        OmVec3 p = om_load3(grid->surface_x, i);
        if (grid->is_surface[i] && om_dot(p, grid->up) > om_dot(top, grid->up)) top = p;
    }
    return top;
}

static double largest(const float* u, int nnode) {
    double most = 0;
    for (int i = 0; i < nnode; ++i) {
        const float* v = u + 3 * (size_t)i;
        most = fmax(most, om_norm(om_vec3((double)v[0], (double)v[1], (double)v[2])));
    }
    return most;
}

// Press `depth` m along the inward normal at the top. Returns 0 if the answer is trusted and in order.
static int press(const OmUmeshNet* net, OmUmeshPredictor* predictor, double depth,
                 unsigned char* mask, float* u) {
    const OmUmeshGrid* grid = om_umesh_net_grid(net);
    int nnode = grid->fem.mesh.nnode;
    OmUmeshPatch patch = om_umesh_find_place(grid, top_of(grid));
    int nmoved = om_umesh_patch_select(grid, &patch, mask);
    memset(u, 0, 3 * (size_t)nnode * sizeof *u);
    for (int i = 0; i < nnode; ++i) {
        OmVec3 d = om_scale(mask[i] ? -depth : 0, patch.normal);
        u[3 * i] = (float)d.x, u[3 * i + 1] = (float)d.y, u[3 * i + 2] = (float)d.z;
    }
    OmUmeshTrust trust;
    double begin = om_clock_now();
    OmStatus status = om_umesh_predict(predictor, mask, u, &trust);
    double ms = 1e3 * (om_clock_now() - begin);
    if (status != OM_OK) {
        fprintf(stderr, "%s\n", om_error_message());
        return 1;
    }
    OmFemGridReport refined = om_umesh_predictor_refinement(predictor);
    printf(
        "%2.0f mm: %d of %d nodes under the probe, largest displacement %.1f mm, %d cycles of relaxation, least det F "
        "%.2f, %.1f ms, %s\n",
        1e3 * depth, nmoved, nnode, 1e3 * largest(u, nnode), refined.ncycle, refined.min_volume, ms,
        trust.is_inside ? "like the training data" : trust.why);
    return trust.is_inside && refined.min_volume > 0 ? 0 : 1;
}

int main(int argc, char** argv) {
    const char* path = argc > 1 ? argv[1] : "weights/phantom.safetensors";
    OmUmeshNet* net = NULL;
    OmUmeshPredictor* predictor = NULL;
    unsigned char* mask = NULL;
    float* u = NULL;
    int code = 1;
    OmStatus status = om_umesh_net_load(path, &net);
    if (status == OM_OK) status = om_umesh_predictor_create(net, 1, &predictor);
    if (status == OM_OK) {
        size_t nnode = (size_t)om_umesh_net_grid(net)->fem.mesh.nnode;
        mask = om_alloc(nnode, sizeof *mask);
        u = om_alloc(3 * nnode, sizeof *u);
        if (!mask || !u) status = OM_NO_MEMORY;
    }
    if (status == OM_OK)
        code = press(net, predictor, 0.005, mask, u) + press(net, predictor, 0.015, mask, u);
    else
        fprintf(stderr, "%s\n", om_error_message());
    om_free(mask);
    om_free(u);
    om_umesh_predictor_destroy(predictor);
    om_umesh_net_destroy(net);
    return code;
}
