// fuzz_banet_net.c: the reader of trained BA-Nets.
//
// The input bytes themselves, and then as changes to the file of a good network, eight bytes each: a byte of the
// header, or a value of a tensor. The good file has no checksum, which would refuse all changes. A network that is read
// must predict probabilities.
#include <math.h>

#include "banet/banet_net_internal.h"
#include "fuzz_common.h"

#define CHANGE 8        // bytes of one
#define MAX_SIZE 20000  // weights of a network that predicts

static char* good;
static size_t good_size;

// Without the line "checksum", whose name becomes another one of the same length.
static void make_good(void) {
    const BanetLayers layers = {.channel = {1, 1, 1, 1, 1}, .nimage = 2};
    OmBanetNet* net;
    FUZZ_EXPECT(om__banet_net_create(&layers, &net) == OM_OK);
    om_net_init_parameters(net->net, 1, net->param);
    const char* path = fuzz_file((const uint8_t*)"", 0, ".safetensors");
    FUZZ_EXPECT(om__banet_net_save(net, path) == OM_OK);
    FUZZ_EXPECT(om_file_read(path, 1 << 24, &good, &good_size) == OM_OK);
    om_banet_net_destroy(net);
    FUZZ_EXPECT(om_banet_net_load(path, &net) == OM_OK);
    om_banet_net_destroy(net);
    fuzz_file_done(path);
    bool is_found = false;
    for (size_t i = 8; i + 8 < good_size && !is_found; ++i) {
        is_found = memcmp(good + i, "checksum", 8) == 0;
        if (is_found) good[i] = 'C';
    }
    FUZZ_EXPECT(is_found);
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
    if (status == OM_OK)
        predict(net);
    else
        FUZZ_EXPECT(net == NULL && om_error_message()[0] != '\0');
    om_banet_net_destroy(net);
    fuzz_file_done(path);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (!good) make_good();
    load(data, size);
    uint8_t* file = malloc(good_size);
    FUZZ_EXPECT(file != NULL);
    memcpy(file, good, good_size);
    uint64_t header;
    memcpy(&header, good, sizeof header);
    for (size_t at = 0; at + CHANGE <= size && at < 8 * CHANGE; at += CHANGE) {
        uint16_t place;
        float value;
        memcpy(&place, data + at + 1, sizeof place);
        memcpy(&value, data + at + 4, sizeof value);
        size_t body = 8 + (size_t)header, num = (good_size - body) / sizeof value;
        if (data[at] % 2)
            file[8 + place % (size_t)header] = data[at + 3];
        else
            memcpy(file + body + place % num * sizeof value, &value, sizeof value);
    }
    load(file, good_size);
    free(file);
    return 0;
}
