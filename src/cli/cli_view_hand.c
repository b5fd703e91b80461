// cli_view_hand.c: a hand in the simulation: lines of the page move the tissue, and change what it is made of.
// Its lines are those of view_hand.h.
#include <math.h>
#include <string.h>

#include "cli_view_hand.h"
#include "omentum/view_hand.h"

#define SPEED 0.25        // m/s, of the hand
#define PRESS_SPEED 0.05  // of the ball
#define PRESS_MOST 10.0   // N: a hand that presses harder gives way
#define PRESS_BACK 0.02   // m/s, at which it does
#define FINENESS 0.7      // edge of the contact surface over the ball's radius
#define MIN_TRI 400
#define MAX_TRI 4000
#define THINNEST 0.4  // of the tissue's thickness under the ball
#define SETTLE_SPEED 1e-3
#define SETTLE_TIME 5.0  // s of the tissue's time, at most
#define SETTLE_CHUNK 0.25
#define PATIENCE 4.0   // s on the wall
#define MEAN_STEPS 20  // of step_time

static OmStatus say(Hand* h, const char* words, bool is_error) {
    return om_cli_view_say(h->server, words, is_error);
}

static OmStatus send_line(Hand* h, OmViewChannel channel, OmJson* json, OmText* text) {
    OmStatus status = om_json_end(json);
    if (status == OM_OK) status = om_view_server_publish(h->server, channel, text->str, text->len);
    om_text_done(text);
    return status;
}

// ---- what the page shows ------------------------------------------------------------------------------------

// Engines that need no file but the scene's, as names.
static void put_engines(const Hand* h, OmJson* json) {
    const OmEngineSet* set = h->scene.engines;
    om_json_open(json, "engines", '[');
    for (int k = 0; k < set->nengine; ++k)
        if (!set->engine[k]->needs_file || h->scene.tissue.weights[0])
            om_json_string(json, NULL, set->engine[k]->name);
    om_json_close(json, ']');
}

// Elements that the page offers, the first ones: shells are cells of a sheet.
static int element_count(const OmTissueEngine* engine, const OmSceneTissue* t) {
    if (!engine->has_quadratic) return 1;
    return t->source == OM_SOURCE_SHEET ? OM_NTISSUE_ELEMENT : OM_ELEMENT_QUADRATIC + 1;
}

static OmStatus say_mode(Hand* h) {
    const OmSceneTissue* t = &h->scene.tissue;
    const OmTissueEngine* engine = om_body_engine(h->body);
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "mode", "free");
    om_json_bool(&json, "paused", h->is_paused);
    om_json_number(&json, "radius", h->radius);
    om_json_number(&json, "young", h->young);
    om_json_number(&json, "poisson",
                   t->poisson >= 0 ? t->poisson : om_site_get_material(&h->site, 0).poisson);
    om_json_bool(&json, "can_press", engine->assemble != NULL);
    om_json_string(&json, "engine", engine->name);
    put_engines(h, &json);
    om_json_string(&json, "element",
                   om_tissue_element_name(engine->has_quadratic
                                              ? om_scene_element(&h->scene, OM_SITE_TWIN)
                                              : OM_ELEMENT_LINEAR));
    om_json_open(&json, "elements", '[');
    for (int k = 0; k < element_count(engine, t); ++k)
        om_json_string(&json, NULL, om_tissue_element_name((OmTissueElement)k));
    om_json_close(&json, ']');
    om_json_string(&json, "law", engine->has_law ? om_law_name(t->law) : "");
    om_json_open(&json, "laws", '[');
    for (int k = 0; engine->has_law && k < OM_NLAW; ++k)
        om_json_string(&json, NULL, om_law_name((OmLaw)k));
    om_json_close(&json, ']');
    om_json_close(&json, '}');
    return send_line(h, OM_VIEW_LASTING, &json, &text);
}

OmStatus om__hand_send_rate(Hand* h) {
    const double now = om_clock_now(), passed = now - h->counted;
    if (passed < 0.5) return OM_OK;
    OmText text = {0};
    OmJson json = om_json_begin(&text);
    om_json_open(&json, NULL, '{');
    om_json_open(&json, "rate", '{');
    om_json_number(&json, "steps_per_s", h->nstep / passed);
    om_json_number(&json, "step_ms", 1e3 * h->step_time);
    om_json_number(&json, "time_step_ms", 1e3 * h->scene.task.time_step);
    om_json_integer(&json, "nvert", om_tissue_mesh(om_body_tissue(h->body))->nvert);
    om_json_close(&json, '}');
    om_json_close(&json, '}');
    h->nstep = 0;
    h->counted = now;
    return send_line(h, OM_VIEW_STATUS, &json, &text);
}

OmStatus om__hand_say_material(Hand* h) {
    char text[400], words[600];
    OmSite site = h->site;  // with the modulus of this moment
    site.young *= h->young;
    om_body_describe(&h->scene, &site, text, sizeof text);
    snprintf(words, sizeof words, "%s; %d nodes%s%s", text,
             om_tissue_mesh(om_body_tissue(h->body))->nvert, h->held ? "; " : "",
             h->held ? h->held : "");
    return say(h, words, false);
}

static OmStatus publish(Hand* h, OmViewChannel channel) {
    return om_view_server_publish(h->server, channel, h->message.str, h->message.len);
}

static OmStatus send_scene(Hand* h) {
    OmView3dDef def = om_view3d_default_def(&h->scene, h->body);
    def.is_live = true;
    def.probe = &h->drawn;
    om_view3d_destroy(h->view);
    h->view = NULL;
    OM_TRY(om_view3d_create(&def, &h->view));
    om_view_server_clear(h->server);
    h->message.len = 0;
    OM_TRY(om_view3d_add_scene(h->view, &h->message));
    OM_TRY(publish(h, OM_VIEW_LASTING));
    h->message.len = 0;
    OM_TRY(om_view3d_add_points(h->body, om_body_attached(h->body), OM_VIEW_BELIEVED, &h->message));
    OM_TRY(publish(h, OM_VIEW_LASTING));
    return say_mode(h);
}

OmStatus om__hand_send_frame(Hand* h) {
    OmBodyForces forces = {0};
    OmViewNow now = {.time = h->time,
                     .visibility = NAN,
                     .force = NAN,
                     .force_world = NAN,
                     .mu = NAN,
                     .height = NAN};
    if (h->has_forces) {
        OM_TRY(om_body_get_forces(h->body, &forces));
        now.force = h->is_holding ? om_norm(forces.grasp[0]) : 0;
    }
    if (h->is_pressing) now.force = om_norm(om_press_report(h->press)->force);
    h->message.len = 0;
    OM_TRY(om_view3d_add_frame(h->view, &now, &h->message));
    return publish(h, OM_VIEW_NEWEST);
}

// ---- the probe ------------------------------------------------------------------------------------------------

// Where it is, or in one place of the tissue: not seen.
static void draw_probe(Hand* h) {
    const OmVec3 middle = h->is_pressing ? h->tip : h->site.pose_world_task.p;
    const double r = h->is_pressing ? h->radius : 0;
    for (int i = 0; i < h->drawn.nvert; ++i)
        om_store3(h->drawn.x, i, om_madd(middle, r, om_load3(h->ball.x, i)));
}

static OmStatus make_ball(Hand* h) {
    OmProbeDef def = om_probe_default_def(OM_PROBE_SPHERE);
    OmProbe* unit;
    def.radius = 1;
    OM_TRY(om_probe_create(&def, &unit));
    OmStatus status = om_probe_get_surface(unit, &h->ball);
    if (status == OM_OK) status = om_probe_get_surface(unit, &h->drawn);
    om_probe_destroy(unit);
    if (status == OM_OK) draw_probe(h);
    return status;
}

// The model, or the radius, is another one.
static void forget_probe(Hand* h) {
    if (h->press) (void)om_body_set_press(h->body, NULL);
    om_press_destroy(h->press);
    om_probe_destroy(h->probe);
    h->press = NULL;
    h->probe = NULL;
}

// Triangles of a contact surface that are small beside the ball: it would slip through the gaps of a coarse one.
static OmStatus choose_surface(const Hand* h, int* ntri) {
    const double edge = FINENESS * h->radius;
    OmSurface s = {0};
    OM_TRY(om_tet_mesh_boundary(om_body_mesh(h->body), &s, NULL));
    double area = 0;
    for (int t = 0; t < s.ntri; ++t) {
        const int* v = s.tri_vert + 3 * (size_t)t;
        const OmVec3 a = om_load3(s.x, v[0]), b = om_sub(om_load3(s.x, v[1]), a);
        area += 0.5 * om_norm(om_cross(b, om_sub(om_load3(s.x, v[2]), a)));
    }
    const double num = area / (0.25 * sqrt(3.0) * edge * edge);
    om_surface_done(&s);
    *ntri = (int)fmin(fmax(num, MIN_TRI), MAX_TRI);
    return OM_OK;
}

static OmStatus make_probe(Hand* h) {
    if (h->press) return OM_OK;
    OmProbeDef shape = om_probe_default_def(OM_PROBE_SPHERE);
    shape.radius = h->radius;
    OM_TRY(om_probe_create(&shape, &h->probe));
    OmPressDef def = om_press_default_def(h->probe);
    OmStatus status = choose_surface(h, &def.ntri);
    if (status == OM_OK) status = om_press_create(&def, om_body_tissue(h->body), &h->press);
    if (status < 0) forget_probe(h);
    return status;
}

static void let_go(Hand* h) {
    if (h->is_holding) om_body_release(h->body, 0);
    if (h->is_pressing) (void)om_body_set_press(h->body, NULL);
    h->is_holding = h->is_pressing = false;
    draw_probe(h);
}

static OmStatus grasp(Hand* h, OmVec3 at) {
    int nheld;
    const OmPose tip = {at, h->site.pose_world_task.q};
    let_go(h);
    const OmStatus status = om_body_grasp(h->body, 0, tip, h->scene.task.grasp_radius, &nheld);
    if (status == OM_INVALID || (status >= 0 && nheld == 0))
        return say(h, "no free tissue there to grasp", true);
    OM_TRY(status);
    h->is_holding = true;
    h->tip = h->goal = at;
    return OM_OK;
}

// Distance of a point from board and organ, and the direction away from the nearer one.
static double rigid_distance(const Hand* h, OmVec3 p, OmVec3* away) {
    const OmSite* site = &h->site;
    double nearest = INFINITY;
    *away = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
    if (site->has_ground) nearest = om_dot(om_sub(p, site->pose_world_task.p), *away);
    if (site->has_organ && site->soft.nvert == 0) {
        OmVec3 normal;
        const double d = om_sdf_eval(&site->organ_sdf, p, &normal);
        if (d < nearest) nearest = d, *away = om_normalize(normal);
    }
    return nearest;
}

static OmStatus press(Hand* h, OmVec3 at) {
    const OmPose pose = {at, h->site.pose_world_task.q};
    let_go(h);
    OmStatus status =
        om_body_engine(h->body)->assemble
            ? OM_OK
            : om_error(OM_UNAVAILABLE, "engine %s has no contact surface for a probe; choose fem",
                       om_body_engine(h->body)->name);
    if (status == OM_OK) status = make_probe(h);
    if (status == OM_OK) status = om_press_move(h->press, pose);
    if (status == OM_OK) status = om_body_set_press(h->body, h->press);
    if (status == OM_INVALID || status == OM_UNAVAILABLE) return say(h, om_error_message(), true);
    OM_TRY(status);
    OmVec3 away;
    h->is_pressing = true;
    h->tip = h->goal = at;
    h->thickness = fmax(rigid_distance(h, at, &away) - h->radius, 0);
    return OM_OK;
}

// ---- what the tissue is made of -------------------------------------------------------------------------------

// A large body that takes longer than PATIENCE moves on before the eyes of the person.
static OmStatus settle(Hand* h) {
    const double begin = om_clock_now(), step = h->scene.task.time_step;
    OmStatus status = OM_NOT_CONVERGED;
    for (double t = 0; status > 0 && t < SETTLE_TIME && om_clock_now() - begin < PATIENCE;
         t += SETTLE_CHUNK)
        status = om_body_settle(h->body, step, SETTLE_SPEED, SETTLE_CHUNK);
    OM_TRY(status);
    om_free(h->start);
    h->start = om_alloc(om_body_state_size(h->body), 1);
    OM_CHECK(h->start, OM_NO_MEMORY, "out of memory for a snapshot");
    om_body_save(h->body, h->start);
    return OM_OK;
}

static OmStatus reset(Hand* h) {
    let_go(h);
    h->time = 0;
    if (h->young != 1) {
        forget_probe(h);
        OM_TRY(om_body_set_young(h->body, &h->scene, 1));
    }
    h->young = 1;
    om_body_restore(h->body, h->start);
    OM_TRY(say_mode(h));
    return say(h, "back at rest", false);
}

// The model is made again with another modulus; the tissue stays where it is.
static OmStatus set_young(Hand* h, double factor) {
    let_go(h);
    forget_probe(h);
    OM_TRY(om_body_set_young(h->body, &h->scene, factor));
    h->young = factor;
    return om__hand_say_material(h);
}

// A body as the scene says, at rest; null where that fails.
static OmStatus make_body(Hand* h) {
    OM_TRY(om_body_create(&h->scene, &h->site, h->s->nworker, &h->body));
    h->has_forces = om_engine_capabilities(om_body_engine(h->body)) & OM_ENGINE_FORCES;
    h->time = h->step_time = 0;
    OmStatus status = settle(h);
    if (status == OM_OK && h->young != 1) status = om_body_set_young(h->body, &h->scene, h->young);
    if (status == OM_OK) return OM_OK;
    om_body_destroy(h->body);
    h->body = NULL;
    return status;
}

typedef struct Made {  // a body with what belongs to it
    OmScene scene;
    OmBody* body;
    void* start;
    bool has_forces;
    double time, step_time;
} Made;

// The body is made again as the scene says; the one before stays where that fails.
static OmStatus make_again(Hand* h, const OmScene* scene) {
    const Made old = {h->scene, h->body, h->start, h->has_forces, h->time, h->step_time};
    let_go(h);
    forget_probe(h);
    OM_TRY(say(h, "the body is made again", false));
    h->scene = *scene;
    h->start = NULL;
    om_site_set_numbers(scene, &h->site);
    const OmStatus status = make_body(h);
    if (status < 0) {
        om_free(h->start);
        h->scene = old.scene;
        h->body = old.body;
        h->start = old.start;
        h->has_forces = old.has_forces;
        h->time = old.time;
        h->step_time = old.step_time;
        om_site_set_numbers(&h->scene, &h->site);
        OM_CHECK(status != OM_NO_MEMORY, status, "%s", om_error_message());
        OM_TRY(say(h, om_error_message(), true));
        return say_mode(h);
    }
    om_free(old.start);
    om_view3d_destroy(h->view);  // it draws the body before
    h->view = NULL;
    om_body_destroy(old.body);
    OM_TRY(send_scene(h));
    return om__hand_say_material(h);
}

static OmStatus set_poisson(Hand* h, double value) {
    OmScene scene = h->scene;
    scene.tissue.poisson = value;
    return make_again(h, &scene);
}

static OmStatus set_name(Hand* h, OmHandVerb verb, const char* name) {
    OmScene scene = h->scene;
    OmSceneTissue* t = &scene.tissue;
    const OmTissueEngine* engine;
    OmStatus status = OM_OK;
    if (verb == OM_HAND_LAW) status = om_law_find(name, &t->law);
    if (verb == OM_HAND_ELEMENT) {
        int k = 0;
        while (k < OM_NTISSUE_ELEMENT && strcmp(name, om_tissue_element_name((OmTissueElement)k)))
            ++k;
        if (k == OM_NTISSUE_ELEMENT)
            status = om_error(OM_INVALID, "element \"%s\": linear, quadratic or shell", name);
        else
            t->element = (OmTissueElement)k;
    }
    if (verb == OM_HAND_ENGINE) {
        status = om_engine_set_find(scene.engines, name, &engine);
        if (status == OM_OK) snprintf(t->engine, sizeof t->engine, "%s", name);
    }
    return status < 0 ? say(h, om_error_message(), true) : make_again(h, &scene);
}

// ---- lines ----------------------------------------------------------------------------------------------------

static OmStatus set_paused(Hand* h, bool is_paused) {
    h->is_paused = is_paused;
    OM_TRY(say_mode(h));
    return say(h, is_paused ? "paused" : "the tissue moves", false);
}

static OmStatus set_radius(Hand* h, double radius) {
    let_go(h);
    forget_probe(h);
    h->radius = radius;
    char words[80];
    snprintf(words, sizeof words, "the probe is a ball of %.3g mm radius", 1e3 * radius);
    OM_TRY(say_mode(h));
    return say(h, words, false);
}

OmStatus om__hand_obey(Hand* h, const char* text) {
    OmHandLine l;
    if (om_hand_line_parse(text, &l) < 0) return say(h, om_error_message(), true);
    switch (l.verb) {
    case OM_HAND_GRASP: return grasp(h, l.at);
    case OM_HAND_PRESS: return press(h, l.at);
    case OM_HAND_MOVE: h->goal = l.at; return OM_OK;
    case OM_HAND_RELEASE: let_go(h); return OM_OK;
    case OM_HAND_PAUSE: return set_paused(h, true);
    case OM_HAND_GO: return set_paused(h, false);
    case OM_HAND_STEP: h->is_paused = h->has_step = true; return say_mode(h);
    case OM_HAND_RESET: return reset(h);
    case OM_HAND_YOUNG: return set_young(h, l.value);
    case OM_HAND_POISSON: return set_poisson(h, l.value);
    case OM_HAND_PROBE: return set_radius(h, l.value);
    case OM_HAND_LAW:
    case OM_HAND_ELEMENT:
    case OM_HAND_ENGINE: return set_name(h, l.verb, l.name);
    case OM_HAND_NVERB: break;
    }
    return OM_OK;
}

// ---- steps ----------------------------------------------------------------------------------------------------

static OmVec3 approach(OmVec3 from, OmVec3 goal, double most) {
    const OmVec3 way = om_sub(goal, from);
    const double left = om_norm(way);
    return left <= most ? goal : om_madd(from, most / left, way);
}

// Tissue between the ball and a board cannot give way: the ball keeps THINNEST of the thickness that it found, and a
// hand that presses too hard gives way. Else forces would grow without limit, and steps take a second.
static OmVec3 press_further(const Hand* h, double dt) {
    const OmVec3 force = om_press_report(h->press)->force;
    const double most = om_norm(force);
    if (most > PRESS_MOST) return om_madd(h->tip, PRESS_BACK * dt / most, force);
    OmVec3 away, next = approach(h->tip, h->goal, PRESS_SPEED * dt);
    const double left = rigid_distance(h, next, &away) - h->radius - THINNEST * h->thickness;
    return left < 0 ? om_madd(next, fmin(-left, PRESS_SPEED * dt), away) : next;
}

static OmStatus move_tip(Hand* h, double dt) {
    h->tip = h->is_pressing ? press_further(h, dt) : approach(h->tip, h->goal, SPEED * dt);
    const OmPose pose = {h->tip, h->site.pose_world_task.q};
    if (!h->is_pressing) return om_body_move(h->body, 0, pose);
    draw_probe(h);
    return om_press_move(h->press, pose);
}

// A step that fails leaves the tissue where it is: a person may ask for what cannot be.
static OmStatus give_up(Hand* h) {
    char words[600];
    const bool was_free = !h->is_holding && !h->is_pressing;
    snprintf(words, sizeof words, "%s: %s", was_free ? "paused" : "let go", om_error_message());
    let_go(h);
    if (was_free) {
        h->is_paused = true;
        OM_TRY(say_mode(h));
    }
    return say(h, words, true);
}

OmStatus om__hand_step(Hand* h) {
    const double dt = h->scene.task.time_step, begin = om_clock_now();
    OmBodyReport report;
    h->has_step = false;
    if (h->is_holding || h->is_pressing) OM_TRY(move_tip(h, dt));
    const OmStatus status = om_body_step(h->body, dt, &report);
    if (status == OM_INVALID || status == OM_UNSAT) return give_up(h);
    OM_TRY(status);
    h->time += dt;
    const double took = om_clock_now() - begin;
    h->step_time += (took - h->step_time) / (h->step_time > 0 ? MEAN_STEPS : 1);
    ++h->nstep;
    return OM_OK;
}

// ---- begin and end --------------------------------------------------------------------------------------------

OmStatus om__hand_begin(Hand* h, const OmProgress* progress) {
    bool holds_lowest = false;
    h->scene = h->s->scene;
    h->young = 1;
    h->counted = om_clock_now();
    if (h->s->has_scene) {
        OM_TRY(om_site_build_tissue(&h->scene, progress, &h->site, &holds_lowest));
        h->held = holds_lowest ? "its lowest layer is held, as the file says nothing of attachments"
                               : "it is held at its attachments";
    } else {
        OM_TRY(om_site_build(&h->scene, OM_SITE_TWIN, progress, &h->site));
    }
    const OmVec3 half = h->site.half_size;
    h->radius = fmin(fmax(0.2 * fmin(half.x, half.y), 0.004), 0.05);
    OM_TRY(make_ball(h));
    OM_TRY(make_body(h));
    char line[OM_VIEW_MAX_LINE + 1];
    while (om_view_server_next(h->server, line, sizeof line)) {
    }  // they were of an earlier scene
    return send_scene(h);
}

void om__hand_done(Hand* h) {
    om_view3d_destroy(h->view);
    om_text_done(&h->message);
    if (h->body) forget_probe(h);
    om_surface_done(&h->ball);
    om_surface_done(&h->drawn);
    om_free(h->start);
    om_body_destroy(h->body);
    om_site_done(&h->site);
}
