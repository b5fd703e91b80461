// fuzz_umesh_net.c: the reader of trained U-Meshes.
// What is read must be able to predict.
#include <math.h>

#include "fuzz_tensors.h"
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define MAX_POINT 512  // of a grid that is asked

static FuzzTensors good;

static void make_good(void) {
    OmUmeshGrid grid;
    OmUmeshNet* net;
    unsigned char active[64] = {0};
    const OmGrid points = {.dim = {4, 4, 4}, .spacing = 0.01};
    active[0] = active[1] = active[4] = active[16] = 1;
    FUZZ_EXPECT(om__umesh_grid_init(&points, om_vec3(0, 0, 1), active, &grid) == OM_OK);
    for (int i = 0; i < grid.fem.mesh.nnode; ++i) {
        om_store3(grid.surface_x, i, om_load3(grid.fem.mesh.x, i));
        grid.fem.fixed[i] = om_load3(grid.fem.mesh.x, i).z < 1e-9;
    }
    FUZZ_EXPECT(om__umesh_grid_find_surface(&grid) == OM_OK);
    FUZZ_EXPECT(om__umesh_net_create(&grid, 0.45, 1, 1, &net) == OM_OK);
    om_net_init_parameters(net->net, 1, net->param);
    net->scale = net->correction = net->second = 0.01;
    net->region.max = net->region.min = net->region.margin = 1;
    const char* path = fuzz_file((const uint8_t*)"", 0, ".safetensors");
    FUZZ_EXPECT(om__umesh_net_save(net, path) == OM_OK);
    om_umesh_net_destroy(net);
    FUZZ_EXPECT(om_umesh_net_load(path, &net) == OM_OK);
    fuzz_tensors_take(path, &good);
    om_umesh_net_destroy(net);
    om_umesh_grid_done(&grid);
}

static void ask(const OmUmeshNet* net) {
    const OmUmeshGrid* g = om_umesh_net_grid(net);
    size_t nnode = (size_t)g->fem.mesh.nnode;
    OmUmeshTrust trust;
    FUZZ_EXPECT(om_fem_mesh_validate(&g->fem.mesh) == OM_OK && net->scale > 0);
    for (int i = 0; i < g->fem.mesh.nnode; ++i)
        FUZZ_EXPECT(g->fem.point_node[g->fem.node_point[i]] == i);
    float* u = om_calloc(3 * nnode, sizeof *u);
    unsigned char* mask = om_calloc(nnode, 1);
    FUZZ_EXPECT(u != NULL && mask != NULL);
    mask[nnode - 1] = 1;
    u[3 * nnode - 1] = -0.001f;
    om_umesh_judge(net, mask, u, &trust);
    FUZZ_EXPECT(trust.is_inside == (trust.score <= 1));
    OmUmeshPredictor* p;
    if (g->fem.npoint <= MAX_POINT && om_umesh_predictor_create(net, 1, &p) == OM_OK) {
        FUZZ_EXPECT(om_umesh_predict(p, mask, u, NULL) == OM_OK);
        om_umesh_predictor_destroy(p);
    }
    om_free(mask);
    om_free(u);
}

static void load(const uint8_t* data, size_t size) {
    OmUmeshNet* net;
    const char* path = fuzz_file(data, size, ".safetensors");
    OmStatus status = om_umesh_net_load(path, &net);
    FUZZ_EXPECT(status <= 0);
    if (status == OM_OK)
        ask(net);
    else
        FUZZ_EXPECT(net == NULL && om_error_message()[0] != '\0');
    om_umesh_net_destroy(net);
    fuzz_file_done(path);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (!good.data) make_good();
    fuzz_tensors_run(&good, data, size, load);
    return 0;
}
