// test_study_attachments.c: the study on its quick layouts, resumed, cancelled, refused.
#include "banet/banet_net_internal.h"
#include "studies/study_attachments.h"

#include <string.h>

#include "test_files.h"
#include "test_folder.h"

static OmStudyAttachmentsDef quick_def(void) {
    OmStudyAttachmentsDef def = om_study_attachments_default_def(dir);
    def.is_quick = true;
    def.nworker = 1;
    return def;
}

static void assert_same(StudySample a, StudySample b) {
    assert_int_equal(a.n, b.n);
    assert_true(a.lower == b.lower && a.median == b.median && a.upper == b.upper);
}

static void remove_file(const char* name) {
    char path[600];
    assert_ok(om_path_join(dir, name, path, sizeof path));
    if (om_path_exists(path)) assert_ok(om_path_remove(path));
}

static void test_study(void** unused) {
    (void)unused;
    OmStudyAttachmentsDef def = quick_def();
    OmStudyAttachmentsSummary first, again;
    assert_ok(om_study_attachments_run(&def, NULL, &first));
    assert_int_equal(first.nlayout, 3);
    assert_int_equal(first.nnew, 3);
    const OmStudyGuessResult *zero = &first.by[OM_STUDY_ZERO], *same = &first.by[OM_STUDY_SAME];
    assert_true(zero->dsc.median == 0 && same->dsc.median == 1 &&
                first.by[OM_STUDY_ALL].tpr.median == 1);
    // The true attachments on the coarser, stiffer twin leave an error, but a much smaller one than none.
    assert_true(same->ave.median > 0.0001 && same->ave.median < 0.002);
    assert_true(zero->ave.median > 4 * same->ave.median);
    assert_int_equal(zero->ave.n, 9);
    remove_file("layout-03-12.bin");
    remove_file("truth-layout-03-2-12.bin");
    def.nworker = 2;
    assert_ok(om_study_attachments_run(&def, NULL, &again));
    for (int k = 0; k < OM_STUDY_NGUESS; ++k) {
        assert_same(first.by[k].dsc, again.by[k].dsc);
        assert_same(first.by[k].tpr, again.by[k].tpr);
        assert_same(first.by[k].ave, again.by[k].ave);
        assert_same(first.by[k].mve, again.by[k].mve);
    }
    for (int b = 0; b < OM_STUDY_NBIN; ++b)
        assert_int_equal(first.bin_count[b], again.bin_count[b]);
}

// An untrained network as a file. Its answers are poor; the rows are there, and physics is as without it.
static void test_network(void** unused) {
    (void)unused;
    static const BanetLayers layers = {.channel = {16, 16, 16, 16, 16}, .ngroup = 2, .nimage = 1};
    OmStudyAttachmentsDef def = quick_def();
    OmStudyAttachmentsSummary plain, with, again;
    OmBanetNet* net;
    char path[600];
    def.network = "none";
    assert_ok(om_study_attachments_run(&def, NULL, &plain));
    assert_false(plain.has_network || plain.by[OM_STUDY_NETWORK].is_there);
    assert_ok(om__banet_net_create(&layers, &net));
    om_net_init_parameters(net->net, 3, net->param);
    net->threshold = 0.4;
    assert_true(snprintf(path, sizeof path, "%s-net.safetensors", dir) < (int)sizeof path);
    assert_ok(om__banet_net_save(net, path));
    om_banet_net_destroy(net);
    def.network = path;
    assert_ok(om_study_attachments_run(&def, NULL, &with));
    assert_true(with.has_network && with.nnew == 3);  // other weights, other results
    for (int k = 0; k <= OM_STUDY_THREE; ++k) {
        assert_same(plain.by[k].dsc, with.by[k].dsc);
        assert_same(plain.by[k].ave, with.by[k].ave);
    }
    const OmStudyGuessResult *one = &with.by[OM_STUDY_NETWORK], *fused = &with.by[OM_STUDY_FUSION];
    assert_true(one->is_there && one->dsc.n == 9 && fused->dsc.n == 3);
    assert_true(with.by[OM_STUDY_JOINT].dsc.n == 9 && with.by[OM_STUDY_JOINT_THREE].ave.n == 9);
    // An intersection has no vertex more than one view.
    assert_true(with.by[OM_STUDY_CROSSING].tpr.upper <= one->tpr.upper);
    assert_ok(om_study_attachments_run(&def, NULL, &again));
    assert_int_equal(again.nnew, 0);
    for (int k = 0; k < OM_STUDY_NGUESS; ++k) assert_same(with.by[k].dsc, again.by[k].dsc);
    def.network = "no such file";
    assert_status(om_study_attachments_run(&def, NULL, &again), OM_IO);
    assert_ok(om_path_remove(path));
}

static bool say_stop(void* ctx, const char* stage, double done, double total) {
    (void)ctx, (void)stage, (void)done, (void)total;
    return false;
}

static void assert_refused(OmStudyAttachmentsDef def, const char* message) {
    OmStudyAttachmentsSummary sum;
    assert_status(om_study_attachments_run(&def, NULL, &sum), OM_INVALID);
    if (!strstr(om_error_message(), message))
        fail_msg("\"%s\" and not \"%s\"", om_error_message(), message);
}

static void test_nonsense(void** unused) {
    (void)unused;
    OmStudyAttachmentsDef def = quick_def();
    OmStudyAttachmentsSummary sum;
    OmProgress stop = {say_stop, NULL};
    assert_status(om_study_attachments_run(&def, &stop, &sum), OM_CANCELLED);
    def.nworker = -1;
    assert_refused(def, "nworker is -1");
    assert_refused((OmStudyAttachmentsDef){.out_dir = dir}, "not made by its default_def");
    assert_refused(om_study_attachments_default_def(NULL), "no folder");
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_study),
        cmocka_unit_test(test_network),
        cmocka_unit_test(test_nonsense),
    };
    return cmocka_run_group_tests(test, make_dir, remove_dir);
}
