// test_nn_weights.c: the weights of a network on the disk: the same bytes back, and only for the same network.
#include "omentum/nn_file.h"
#include "test_alloc.h"
#include "test_files.h"

static const OmNetShape grid = {3, 4, 4, 8};

typedef struct Choice {  // what makes one network different from another
    int base;
    OmActivation activation;
    OmLayerKind norm;
    float mask;
} Choice;

static OmNet* make_net(Choice c) {
    OmNet* net;
    float mask[4 * 4 * 8];
    for (int i = 0; i < 4 * 4 * 8; ++i) mask[i] = c.mask;
    OmUnetDef def = om_unet_default_def(grid, 3);
    def.nlevel = 1;
    def.base_channels = c.base;
    def.activation = c.activation;
    def.norm = c.norm;
    def.ngroup = 2;
    def.mask = c.mask > 0 ? mask : NULL;
    assert_ok(om_unet_create(&def, &net));
    return net;
}

static const Choice usual = {4, OM_RELU, OM_LAYER_BATCH_NORM, 1};

static void test_round_trip(void** state) {
    (void)state;
    const char* path = temp_path("weights.safetensors");
    OmNet* net = make_net(usual);
    size_t n = om_net_parameter_size(net);
    float* param = om_alloc(n, sizeof *param);
    float* back = om_calloc(n, sizeof *back);
    om_net_init_parameters(net, 1, param);
    const OmTextPair about[] = {{"units", "m"}, {"mean_error_mm", "0.05"}};
    assert_ok(om_net_save(net, param, about, 2, path));
    assert_ok(om_net_load(net, path, back));
    assert_memory_equal(param, back, n * sizeof *param);

    OmTensorFile* file;
    OmText text = {0};
    assert_ok(om_tensor_file_load(path, &file));
    assert_ok(om_net_describe(net, &text));
    assert_int_equal(om_tensor_file_count(file), om_net_parameter_count(net));
    assert_string_equal(om_tensor_file_meta(file, "units"), "m");
    assert_string_equal(om_tensor_file_meta(file, "architecture"), text.str);
    assert_int_equal(strlen(om_tensor_file_meta(file, "network")), 16);
    om_tensor_file_destroy(file);
    om_text_done(&text);

    param[7] = INFINITY;
    assert_status(om_net_save(net, param, NULL, 0, path), OM_INVALID);
    assert_non_null(strstr(om_error_message(), om_net_parameter(net, 0)->name));
    assert_ok(om_net_load(net, path, back));  // what was there is there still
    remove(path);
    om_free(param);
    om_free(back);
    om_net_destroy(net);
}

// Save for one network, load into another: refused, with this in the sentence.
static void refused(Choice saved, Choice loaded, const char* sentence) {
    const char* path = temp_path("other.safetensors");
    OmNet *a = make_net(saved), *b = make_net(loaded);
    float* param = om_alloc(om_net_parameter_size(a) + om_net_parameter_size(b), sizeof *param);
    om_net_init_parameters(a, 1, param);
    assert_ok(om_net_save(a, param, NULL, 0, path));
    assert_status(om_net_load(b, path, param), OM_INVALID);
    if (!strstr(om_error_message(), sentence) || !strstr(om_error_message(), path))
        fail_msg("\"%s\" does not say \"%s\"", om_error_message(), sentence);
    remove(path);
    om_free(param);
    om_net_destroy(a);
    om_net_destroy(b);
}

static void test_other_networks(void** state) {
    (void)state;
    Choice other = usual;
    other.base = 6;
    refused(usual, other, "has the shape [4, 3, 3, 3, 3], [6, 3, 3, 3, 3] is expected");
    other = usual;
    other.norm = 0;
    refused(usual, other, "belongs to another network");
    refused(other, usual, "belongs to another network");
    // The same names and shapes, and yet not the same.
    other = usual;
    other.activation = OM_TANH;
    refused(usual, other, "relu gives");
    other = usual;
    other.mask = 0.5F;
    refused(usual, other, "has the layer");
    other.mask = 0;
    refused(usual, other, "has the layer");
}

// A file that another program wrote says nothing of networks: names and shapes decide.
static void test_foreign_file(void** state) {
    (void)state;
    const char* path = temp_path("foreign.safetensors");
    OmNet* net = make_net(usual);
    size_t n = om_net_parameter_size(net);
    float* param = om_alloc(n, sizeof *param);
    float* back = om_calloc(n, sizeof *back);
    OmTensor tensor[64];
    int count = om_net_parameter_count(net);
    assert_true(count <= 64);
    om_net_init_parameters(net, 2, param);
    for (int i = 0; i < count; ++i) {
        const OmNetParameter* p = om_net_parameter(net, i);
        tensor[count - 1 - i] = (OmTensor){p->name, OM_TENSOR_F32, p->ndim, {0}, param + p->adr};
        for (int k = 0; k < p->ndim; ++k) tensor[count - 1 - i].dim[k] = p->dim[k];
    }
    assert_ok(om_tensor_file_save(tensor, count, NULL, 0, path));
    assert_ok(om_net_load(net, path, back));
    assert_memory_equal(param, back, n * sizeof *param);
    assert_ok(om_tensor_file_save(tensor + 1, count - 1, NULL, 0, path));
    assert_status(om_net_load(net, path, back), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "has no tensor \"head.bias\" of shape [3]"));
    remove(path);
    om_free(param);
    om_free(back);
    om_net_destroy(net);
}

typedef struct Work {
    OmNet* net;
    float* param;
    char path[256];
} Work;

static OmStatus save_and_load(void* ctx) {
    const Work* w = ctx;
    OM_TRY(om_net_save(w->net, w->param, NULL, 0, w->path));
    return om_net_load(w->net, w->path, w->param);
}

static void test_no_memory(void** state) {
    (void)state;
    Work w = {.net = make_net(usual)};
    w.param = om_calloc(om_net_parameter_size(w.net), sizeof *w.param);
    snprintf(w.path, sizeof w.path, "%s", temp_path("memory.safetensors"));
    assert_true(test_failing_allocations(save_and_load, &w, 1) > 5);
    remove(w.path);
    om_free(w.param);
    om_net_destroy(w.net);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_other_networks),
        cmocka_unit_test(test_foreign_file),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
