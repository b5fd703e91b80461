// fuzz_banet_net.c: the reader of trained BA-Nets.
// A network that is read must predict probabilities.
#include <math.h>

#include "banet/banet_net_internal.h"
#include "fuzz_tensors.h"

#define MAX_SIZE 20000  // weights of a network that predicts
#define EVERY_PREDICTION \
    4  // a prediction takes twenty times as long as a load: one of four networks, by its hash

static FuzzTensors good;

static void make_good(void) {
    const BanetLayers layers = {.channel = {1, 1, 1, 1, 1}, .nimage = 2};
    OmBanetNet* net;
    FUZZ_EXPECT(om__banet_net_create(&layers, &net) == OM_OK);
    om_net_init_parameters(net->net, 1, net->param);
    const char* path = fuzz_file((const uint8_t*)"", 0, ".safetensors");
    FUZZ_EXPECT(om__banet_net_save(net, path) == OM_OK);
    om_banet_net_destroy(net);
    FUZZ_EXPECT(om_banet_net_load(path, &net) == OM_OK);
    om_banet_net_destroy(net);
    fuzz_tensors_take(path, &good);
}

static void predict(const OmBanetNet* net) {
    const int dim[3] = {16, 16, 16};
    const size_t n = om_grid_count(dim);
    OmBanetPredictor* p;
    FUZZ_EXPECT(net->slope > 0 && net->threshold > 0 && net->threshold < 1);
    if (om_banet_net_size(net) > MAX_SIZE) return;
    if (om_banet_predictor_create(net, dim, 1, &p) != OM_OK) return;
    float* in = om_calloc(OM_BANET_NCHANNEL * n, sizeof *in);
    float* out = om_calloc(n, sizeof *out);
    FUZZ_EXPECT(in != NULL && out != NULL);
    in[OM_BANET_UZ * n + 100] = in[OM_BANET_SEEN * n + 100] = 1;
    OmStatus status = om_banet_predict(p, in, out);
    FUZZ_EXPECT(status <= 0);
    for (size_t i = 0; i < n && status == OM_OK; ++i) FUZZ_EXPECT(out[i] >= 0 && out[i] <= 1);
    om_banet_predictor_destroy(p);
    om_free(in);
    om_free(out);
}

static void load(const uint8_t* data, size_t size) {
    OmBanetNet* net;
    const char* path = fuzz_file(data, size, ".safetensors");
    OmStatus status = om_banet_net_load(path, &net);
    FUZZ_EXPECT(status <= 0);
    const bool is_good = size == good.size && memcmp(data, good.data, size) == 0;
    if (status < 0)
        FUZZ_EXPECT(net == NULL && om_error_message()[0] != '\0');
    else if (is_good || om_hash(data, size, OM_HASH_SEED) % EVERY_PREDICTION == 0)
        predict(net);
    om_banet_net_destroy(net);
    fuzz_file_done(path);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (!good.data) make_good();
    fuzz_tensors_run(&good, data, size, load);
    return 0;
}
