// test_cli_view_hand.c: a hand whose body cannot be made again keeps the old body, its numbers and its frames.
#include "cli/cli_view_hand.h"
#include "omentum/heuristic.h"
#include "test_common.h"

// The page's answers, in place of those of cli_view.c.
static char said[600];
static bool is_error;

OmStatus om_cli_view_say(OmViewServer* server, const char* words, bool is_wrong) {
    (void)server;
    snprintf(said, sizeof said, "%s", words);
    is_error = is_wrong;
    return OM_OK;
}

static OmStatus refuse(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                       int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    (void)m, (void)s, (void)w, (void)h, (void)nobstacle, (void)obstacle, (void)report;
    return om_error(OM_INVALID, "stuck: no step");
}

// A hand over a sheet of 6 x 6 cells, with the engines and the scene of `s`.
static void begin(Hand* h, OmCliRetract* s) {
    OmViewServerDef def = om_view_server_default_def();
    *h = (Hand){.s = s};
    s->scene.engines = &s->engines;
    s->scene.tissue.cells = om_vec3(6, 6, 1);
    def.port = 0;
    assert_ok(om_view_server_create(&def, &h->server));
    assert_ok(om__hand_begin(h, NULL));
}

static void end(Hand* h) {
    om__hand_done(h);
    om_view_server_destroy(h->server);
}

// From pbd, without forces, to an engine with forces whose first step fails.
static void an_engine_that_does_not_settle_changes_nothing(void** unused) {
    (void)unused;
    OmTissueEngine stuck = *om_chain_engine();
    stuck.name = "stuck";
    stuck.step = refuse;
    stuck.has_forces = true;
    OmCliRetract s = {.nworker = 1, .scene = om_scene_default()};
    s.engines = om_engine_set_default();
    assert_ok(om_engine_set_add(&s.engines, &stuck));
    strcpy(s.scene.tissue.engine, "pbd");
    Hand h;
    begin(&h, &s);
    for (int k = 0; k < 3; ++k) assert_ok(om__hand_step(&h));
    const double step_time = h.step_time;
    assert_ok(om__hand_obey(&h, "engine stuck"));
    assert_true(is_error);
    assert_non_null(strstr(said, "stuck: no step"));
    assert_string_equal(om_body_engine(h.body)->name, "pbd");
    assert_string_equal(h.scene.tissue.engine, "pbd");
    assert_false(h.has_forces);
    assert_near(h.time, 3 * s.scene.task.time_step, 1e-12);
    assert_true(h.step_time == step_time && step_time > 0);
    assert_ok(om__hand_send_frame(&h));
    assert_ok(om__hand_step(&h));
    assert_ok(om__hand_obey(&h, "engine fem"));
    assert_false(is_error);
    assert_true(h.has_forces);
    assert_true(h.time == 0 && h.step_time == 0);
    assert_ok(om__hand_send_frame(&h));
    end(&h);
}

// A sheet is of shells, which the page may change, and it steps them; of a name that is none it says the others.
static void elements_are_chosen(void** unused) {
    (void)unused;
    OmCliRetract s = {.nworker = 1, .scene = om_scene_default()};
    s.engines = om_engine_set_default();
    Hand h;
    begin(&h, &s);
    assert_int_equal(om_tissue_mesh(om_body_tissue(h.body))->nvert, 7 * 7 * 2);
    assert_ok(om__hand_obey(&h, "element quadratic"));
    assert_int_equal(h.scene.tissue.element, OM_ELEMENT_QUADRATIC);
    assert_true(om_tissue_mesh(om_body_tissue(h.body))->nvert > 7 * 7 * 2);
    assert_ok(om__hand_obey(&h, "element shell"));
    assert_false(is_error);
    assert_int_equal(h.scene.tissue.element, OM_ELEMENT_SHELL);
    assert_int_equal(om_tissue_mesh(om_body_tissue(h.body))->nvert, 7 * 7 * 2);
    for (int k = 0; k < 3; ++k) assert_ok(om__hand_step(&h));
    assert_ok(om__hand_obey(&h, "element plate"));
    assert_true(is_error);
    assert_non_null(strstr(said, "element \"plate\": linear, quadratic or shell"));
    assert_int_equal(h.scene.tissue.element, OM_ELEMENT_SHELL);
    end(&h);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(an_engine_that_does_not_settle_changes_nothing),
        cmocka_unit_test(elements_are_chosen),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
