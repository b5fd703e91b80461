// test_study_curve.c: the learning curve: which samples are learnt and which are scored, resuming, and the report.
#include "banet/banet_sheets.h"
#include "studies/study_curve.h"
#include "test_folder.h"

enum { NVALID = 6, FEW = 2, MORE = 4 };

static OmStudyCurveDef small_def(const OmBanetData* data, const char* out_dir) {
    OmStudyCurveDef def = om_study_curve_default_def(data, out_dir);
    def.nsize = 2;
    def.size[0] = FEW, def.size[1] = MORE;
    def.nstep = 2;
    def.train.nvalid = NVALID;
    def.train.batch = 2;
    def.train.nworker = 1;
    def.train.nimage = 1;
    def.train.dim[0] = 16, def.train.dim[1] = 32;  // sheets are 16 wide
    for (int k = 0; k < OM_BANET_NLEVEL; ++k) def.train.channel[k] = 16;
    return def;
}

static void test_sizes(void** state) {
    (void)state;
    OmBanetData data = {.nsample = 5000};
    OmStudyCurveDef def = om_study_curve_default_def(&data, "x");
    assert_true(def.nsize == 3 && def.size[0] == 1100 && def.size[1] == 2500 &&
                def.size[2] == 4500);
    assert_int_equal(def.train.nvalid, 500);
    data.nsample = 12000;
    def = om_study_curve_default_def(&data, "x");
    assert_true(def.nsize == 5 && def.size[3] == 10000 && def.size[4] == 11500);
    data.nsample = 100;
    def = om_study_curve_default_def(&data, "x");
    assert_true(def.nsize == 1 && def.size[0] == 90);
    OmStudyCurveSummary s;
    def.size[0] = 91;
    assert_status(om_study_curve_run(&def, NULL, &s), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "91"));
}

// Equal steps; the scores are those of the last samples alone, by weights that only the first ones have changed.
static void test_curve(void** state) {
    (void)state;
    OmBanetData data = make_data(), tail;
    OmStudyCurveSummary s, again;
    OmStudyCurveDef def = small_def(&data, in_dir("curve"));
    assert_ok(om_study_curve_run(&def, NULL, &s));
    assert_int_equal(s.npoint, 2);
    assert_true(s.point[0].nsample == FEW && s.point[0].nepoch == 2);
    assert_true(s.point[1].nsample == MORE && s.point[1].nepoch == 1);
    assert_near(s.gain, s.point[1].dsc - s.point[0].dsc, 1e-12);  // twice as many
    assert_true(s.is_saturated == (s.gain < 0.01));
    OmBanetNet* net;
    OmBanetEval eval;
    assert_ok(om_banet_net_load(in_dir("curve/n000004/weights.safetensors"), &net));
    tail = data;
    tail.sample += NSHEET - NVALID;
    tail.nsample = NVALID;
    assert_ok(om_banet_eval(net, &tail, 0, NVALID, 1, NULL, &eval));
    assert_near(s.point[1].dsc, eval.mean_dsc, 1e-12);
    assert_near(s.point[1].tpr, eval.mean_tpr, 1e-12);
    om_banet_eval_done(&eval);
    assert_ok(om_banet_eval(net, &data, 0, MORE, 1, NULL, &eval));
    assert_near(s.point[1].dsc_trained, eval.mean_dsc, 1e-12);
    om_banet_eval_done(&eval);
    om_banet_net_destroy(net);
    assert_true(om_path_exists(in_dir("curve/report.html")));
    assert_true(om_path_exists(in_dir("curve/study.json")));
    // again: nothing is trained
    assert_ok(om_study_curve_run(&def, NULL, &again));
    assert_true(again.point[1].dsc == s.point[1].dsc);
    om_banet_data_done(&data);
}

// Loss, metric, rate and gradient of each epoch; the time of the last column differs.
static void read_metrics(const char* path, char** text) {
    size_t size;
    assert_ok(om_file_read(path, 1 << 16, text, &size));
    char *to = *text, *comma = NULL;
    for (const char* at = *text; at < *text + size; ++at) {
        if (*at == ',') comma = to;
        if (*at == '\n' && comma) to = comma;
        *to++ = *at;
    }
    *to = 0;
    assert_true(to - *text > 20);
}

// A sample between those of the training and those for validation changes nothing, in no epoch.
static void test_unused(void** state) {
    (void)state;
    double dsc[2];
    char* metrics[2];
    for (int k = 0; k < 2; ++k) {
        OmBanetData data = make_data();
        OmStudyCurveDef def = small_def(&data, in_dir(k ? "changed" : "kept"));
        OmStudyCurveSummary s;
        def.nsize = 1;
        if (k)
            for (int i = MORE; i < NSHEET - NVALID; ++i)
                memset(data.sample[i].kind, 0, (size_t)data.sample[i].ncell);
        assert_ok(om_study_curve_run(&def, NULL, &s));
        assert_true(isnan(s.gain));
        dsc[k] = s.point[0].dsc;
        read_metrics(in_dir(k ? "changed/n000002/metrics.csv" : "kept/n000002/metrics.csv"),
                     &metrics[k]);
        om_banet_data_done(&data);
    }
    assert_true(dsc[0] == dsc[1]);
    assert_string_equal(metrics[0], metrics[1]);
    om_free(metrics[0]);
    om_free(metrics[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sizes),
        cmocka_unit_test(test_curve),
        cmocka_unit_test(test_unused),
    };
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
