// 10_train_a_network.c: a network learns a function of two numbers, is saved, loaded and asked.
//
// A training needs a network and a function that fills a batch with inputs and targets; here both are drawn on
// the spot, from the sample's own stream, so that there is no data set to keep. With `dir` set in the definition the
// training leaves a checkpoint and continues from it. The same network as ONNX: om_net_save_onnx.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

static float wave(float x, float y) { return sinf(3 * x) * y; }

static void draw(uint64_t sample, float* in) {
    OmRng rng = om_rng_init(7, sample);
    in[0] = (float)om_rng_range(&rng, -1, 1);
    in[1] = (float)om_rng_range(&rng, -1, 1);
}

static OmStatus fill(void* ctx, const OmTrainBatch* batch) {
    (void)ctx;
    for (int i = 0; i < batch->count; ++i) {
        float* in = batch->in + 2 * i;
        // Validation has samples of its own.
        draw((uint64_t)batch->sample[i] + (batch->is_validation ? 1000000 : 0), in);
        batch->target[i] = wave(in[0], in[1]);
    }
    return OM_OK;
}

static OmStatus make_net(OmNet** net) {
    OmStatus status = om_net_create(net);
    if (status != OM_OK) return status;
    int x = om_net_add_input(*net, "input", (OmNetShape){2, 1, 1, 1});
    x = om_net_add_dense(*net, "first", x, 32);
    x = om_net_add_activation(*net, x, OM_TANH, 0);
    x = om_net_add_dense(*net, "second", x, 32);
    x = om_net_add_activation(*net, x, OM_TANH, 0);
    x = om_net_add_dense(*net, "third", x, 1);
    return om_net_finish(*net, x);
}

// From random weights to a file.
static OmStatus train(const OmNet* net, float* param, const char* path) {
    OmTrainDef def = om_train_default_def(net, fill, NULL);
    OmTrainResult result;
    def.ntrain = 1000;
    def.nvalid = 200;
    def.batch = 20;
    def.nepoch = 40;
    def.schedule = om_schedule_one_cycle(1e-2);
    om_net_init_parameters(net, 1, param);
    OmStatus status = om_train_run(&def, NULL, param, &result);
    if (status != OM_OK) return status;
    printf("epoch %d of %d was the best: mean square error %.2g, from %.2g after the first\n",
           result.best_epoch, result.nepoch, result.best_value, result.epoch[0].valid);
    om_train_result_done(&result);
    OmTextPair about[] = {{"learnt", "sin(3 x) y for x and y in [-1, 1]"}};
    return om_net_save(net, param, about, 1, path);
}

// From the file to an answer.
static OmStatus predict(const OmNet* net, float* param, const char* path) {
    OmNetRun* run = NULL;
    OmNetRunDef def = om_net_run_default_def(1);
    float in[2] = {0.3F, -0.5F}, out = 0;
    OmStatus status = om_net_load(net, path, param);
    if (status == OM_OK) status = om_net_run_create(net, &def, &run);
    if (status == OM_OK) status = om_net_run_set_parameters(run, param);
    if (status == OM_OK) status = om_net_run_forward(run, in, &out);
    om_net_run_destroy(run);
    if (status != OM_OK) return status;
    float truth = wave(in[0], in[1]);
    printf("sin(3 x %.1f) x %.1f is %.4f, the network says %.4f\n", (double)in[0], (double)in[1],
           (double)truth, (double)out);
    return fabsf(out - truth) < 0.02F ? OM_OK : OM_NOT_CONVERGED;
}

int main(void) {
    const char* path = "wave.safetensors";
    OmNet* net = NULL;
    float* param = NULL;
    OmStatus status = make_net(&net);
    if (status == OM_OK) param = om_alloc(om_net_parameter_size(net), sizeof *param);
    if (status == OM_OK && !param) status = OM_NO_MEMORY;
    if (status == OM_OK) status = train(net, param, path);
    if (status == OM_OK) memset(param, 0, om_net_parameter_size(net) * sizeof *param);
    if (status == OM_OK) status = predict(net, param, path);
    if (status != OM_OK) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    om_free(param);
    om_net_destroy(net);
    return status == OM_OK ? 0 : 1;
}
