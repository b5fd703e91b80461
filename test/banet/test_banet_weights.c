// test_banet_weights.c: the weights that come along find attachments, and a larger grid does not change what they find.
//
// The first samples of the test set (a) are made again. Without a trained network the mean DSC is near that of the best
// constant answer, in which all cells are attached. Fails without weights/banet.safetensors.
#include "omentum/banet_fuse.h"
#include "omentum/banet_net.h"
#include "test_common.h"

#define NSAMPLE test_count(2, 10)
#define MARGIN 16

static OmBanetData make_data(void) {
    OmBanetSampleDef def = om_banet_data_test_def(OM_BANET_TEST_EXACT, "").sample;
    OmBanetData data = {.nsample = NSAMPLE, .seed = def.seed, .side = def.side};
    data.sample = om_calloc((size_t)data.nsample, sizeof *data.sample);
    for (int s = 0; s < data.nsample; ++s) {
        OmBanetSample sample;
        // a quick run takes two samples that cost little
        static const int quick[2] = {3, 7};
        assert_ok(om_banet_sample_make(&def, test_is_slow() ? s : quick[s], &sample));
        assert_ok(om_banet_cells_make(&sample, def.side, &data.sample[s]));
        om_banet_sample_done(&sample);
    }
    return data;
}

static double dsc_of(int nboth, int nfound, int ntrue) {
    return nfound + ntrue > 0 ? 2.0 * nboth / (nfound + ntrue) : 1;
}

// The DSC where every cell counts as attached.
static double constant_dsc(const OmBanetData* data) {
    double sum = 0;
    for (int s = 0; s < data->nsample; ++s) {
        int ntrue = 0, nall = 0;
        for (int i = 0; i < data->sample[s].ncell; ++i) {
            nall += (data->sample[s].kind[i] & OM_BANET_SURFACE) != 0;
            ntrue += (data->sample[s].kind[i] & OM_BANET_ATTACHED) != 0;
        }
        sum += dsc_of(ntrue, nall, ntrue) / data->nsample;
    }
    return sum;
}

// The DSC on a grid with `margin` more cells behind the body along each axis.
static double dsc_with_margin(const OmBanetNet* net, const OmBanetCells* cells, int margin) {
    const int* from = cells->grid.dim;
    const int dim[3] = {from[0] + margin, from[1] + margin, from[2] + margin};
    const int shift[3] = {-margin / 2, -margin / 2, -margin / 2};
    const size_t n = om_grid_count(dim);
    OmBanetPredictor* p;
    float* in = om_alloc(OM_BANET_NCHANNEL * n, sizeof *in);
    float* out = om_alloc(n, sizeof *out);
    double *probability = om_alloc((size_t)cells->ncell, sizeof *probability), threshold;
    unsigned char* truth = om_alloc((size_t)cells->ncell, 1);
    int num = 0, nboth = 0, nfound = 0, ntrue = 0;
    assert_ok(om_banet_predictor_create(net, dim, 1, &p));
    assert_ok(om_banet_cells_expand(cells, dim, shift, 0, in, NULL, NULL));
    assert_ok(om_banet_predict(p, in, out));
    for (int i = 0; i < cells->ncell; ++i) {
        int at[3], to[3];
        if (!(cells->kind[i] & OM_BANET_SURFACE)) continue;
        om_grid_unpack(from, (size_t)cells->cell[i], at);
        assert_true(om_banet_cell_turn(from, dim, shift, 0, at, to));
        probability[num] = (double)out[om_grid_index(dim, to[0], to[1], to[2])];
        truth[num++] = (cells->kind[i] & OM_BANET_ATTACHED) != 0;
    }
    assert_ok(om_banet_choose_threshold(num, probability, OM_BANET_NEARLY, &threshold));
    for (int i = 0; i < num; ++i) {
        nboth += truth[i] && probability[i] >= threshold;
        nfound += probability[i] >= threshold;
        ntrue += truth[i];
    }
    om_free(probability);
    om_free(truth);
    om_banet_predictor_destroy(p);
    om_free(in);
    om_free(out);
    return dsc_of(nboth, nfound, ntrue);
}

static void test_it_finds_attachments(void** state) {
    const OmBanetData* data = *state;
    static const char* const fact[] = {"command", "seed",           "data",          "samples",
                                       "epochs",  "validation_dsc", "validation_tpr"};
    OmBanetNet* net;
    OmBanetEval e;
    assert_ok(om_banet_net_load(NULL, &net));
    for (size_t i = 0; i < sizeof fact / sizeof *fact; ++i)
        assert_non_null(om_banet_net_fact(net, fact[i]));
    assert_true(4 * om_banet_net_size(net) <= 12000000);
    // what the file states is what the hash of its samples' definition proves
    OmBanetDataDef def = om_banet_data_default_def(1, "none");
    char hash[24];
    snprintf(hash, sizeof hash, "%016llx",
             (unsigned long long)om_banet_sample_def_hash(&def.sample));
    assert_string_equal(om_banet_net_fact(net, "data"), hash);
    assert_string_equal(om_banet_net_fact(net, "element"), "quadratic");
    assert_string_equal(om_banet_net_fact(net, "law"), om_law_name(def.sample.law));
    assert_string_equal(om_banet_net_fact(net, "way"), om_banet_way_name(def.sample.way));
    assert_near(om_banet_net_side(net), def.sample.side, 0);
    assert_near(atof(om_banet_net_fact(net, "voxel_m")), def.sample.side / 64, 1e-12);
    OmText note = {0};
    assert_ok(om_banet_net_check(net, 0.3, NULL, &note));
    assert_int_equal(note.len, 0);
    assert_ok(om_banet_eval(net, data, 0, data->nsample, 1, NULL, &e));
    // Half of the way from the constant answer to what the file says of its validation samples.
    const double constant = constant_dsc(data),
                 claimed = atof(om_banet_net_fact(net, "validation_dsc"));
    assert_true(claimed > constant);
    assert_true(e.mean_dsc > 0.5 * (constant + claimed));
    om_banet_eval_done(&e);
    om_banet_net_destroy(net);
}

static void test_margin(void** state) {
    const OmBanetData* data = *state;
    OmBanetNet* net;
    double sum[2] = {0};
    assert_ok(om_banet_net_load(NULL, &net));
    for (int s = 0; s < data->nsample; ++s)
        for (int k = 0; k < 2; ++k)
            sum[k] += dsc_with_margin(net, &data->sample[s], k * MARGIN) / data->nsample;
    assert_near(sum[1], sum[0], 0.005);
    om_banet_net_destroy(net);
}

static int begin(void** state) {
    static OmBanetData data;
    data = make_data();
    *state = &data;
    return 0;
}

static int end(void** state) {
    om_banet_data_done(*state);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_it_finds_attachments),
        cmocka_unit_test(test_margin),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
