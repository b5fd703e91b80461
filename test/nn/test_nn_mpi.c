// test_nn_mpi.c: R ranks with batches of B against one with batches of R B. Run alone and by mpirun.
#include "omentum/nn_train.h"
#include "test_common.h"

enum { NIN = 5, NOUT = 2, BATCH = 4, NPARAM = 512 };

static OmStatus fill(void* ctx, const OmTrainBatch* b) {
    (void)ctx;
    for (int i = 0; i < b->count; ++i) {
        OmRng rng = om_rng_init(5, (uint64_t)b->sample[i] + (b->is_validation ? 10000 : 0));
        float* in = b->in + i * NIN;
        for (int k = 0; k < NIN; ++k) in[k] = (float)om_rng_normal(&rng);
        b->target[i * NOUT] = in[0] * in[1];
        b->target[i * NOUT + 1] = tanhf(in[2] - in[3] + in[4]);
    }
    return OM_OK;
}

static OmNet* make_net(void) {
    OmNet* net;
    assert_ok(om_net_create(&net));
    int x = om_net_add_input(net, "input", (OmNetShape){NIN, 1, 1, 1});
    x = om_net_add_dense(net, "first", x, 24);
    x = om_net_add_activation(net, x, OM_TANH, 0);
    x = om_net_add_dropout(net, x, 0.1F);  // draws by the sample's place in the whole batch
    assert_ok(om_net_finish(net, om_net_add_dense(net, "second", x, NOUT)));
    assert_true(om_net_parameter_size(net) <= NPARAM);
    return net;
}

static void train(const OmNet* net, int batch, const OmTrainGroup* group, float* param,
                  OmTrainResult* result) {
    OmTrainDef def = om_train_default_def(net, fill, NULL);
    def.ntrain = 200;
    def.nvalid = 31;
    def.nepoch = 10;
    def.batch = batch;
    def.group = group;
    def.nworker = 1;
    om_net_init_parameters(net, 1, param);
    assert_ok(om_train_run(&def, NULL, param, result));
}

static void test_ranks_and_one(void** state) {
    (void)state;
    const char* ranks = getenv("OM_TEST_RANKS");  // set where mpiexec starts so many
    OmTrainGroup group;
    OmStatus status = om_train_group_begin_mpi(&group);
    if (status == OM_UNAVAILABLE) {
        if (ranks) fail_msg("%s ranks are started, and yet: %s", ranks, om_error_message());
        assert_non_null(strstr(om_error_message(), "OM_WITH_MPI"));
        om_train_group_end_mpi(&group);
        return;
    }
    assert_ok(status);
    assert_int_equal(group.size, ranks ? atoi(ranks) : 1);
    OmNet* net = make_net();
    float together[NPARAM] = {0}, alone[NPARAM] = {0}, mean[NPARAM];
    OmTrainResult a, b;
    train(net, BATCH, &group, together, &a);
    train(net, BATCH * group.size, NULL, alone, &b);

    // All ranks end with the same bytes: their mean is what each has, for 2^k of them exactly.
    memcpy(mean, together, sizeof mean);
    assert_ok(group.mean(group.ctx, mean, NPARAM));
    double worst = 0;
    for (int i = 0; i < NPARAM; ++i) {
        assert_near((double)mean[i], (double)together[i], group.size == 2 ? 0 : 1e-6);
        worst = fmax(worst, fabs((double)together[i] - (double)alone[i]));
    }
    print_message("rank %d of %d: weights differ by %.2g at most from one rank's\n", group.rank,
                  group.size, worst);
    // 250 steps at most, whose gradients are summed in another order in float; steps are up to 1e-3 long
    assert_below(worst, 1e-4 * test_tol_scale());
    assert_near_rel(a.best_value, b.best_value, 1e-4);
    om_train_result_done(&a);
    om_train_result_done(&b);
    om_net_destroy(net);
    om_train_group_end_mpi(&group);
    om_train_group_end_mpi(&group);  // does no harm
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_ranks_and_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
