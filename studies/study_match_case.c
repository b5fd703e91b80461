// study_match_case.c: the cases of the studies of correspondence and of attachments: tables, scenes and sites.
//
// Seeds, places and motions were committed before any method was measured on them; no method is tuned on them.
//
// Grasping points of the attachment cases follow a rule. The candidates are twelve points on the sheet, 8 mm from its
// border: four corners and eight places along the sides, in an order drawn by the layout's seed. A candidate counts if
// its distance from the true attachments is at least 25 mm (12 mm, where fewer than three candidates are that far):
// nearer to them the pull exceeds the force limit of a retraction. The first three that count are taken.
#include "studies/study_match_case.h"

#include <math.h>
#include <string.h>

#include "omentum/tissue.h"

#define DEG (OM_PI / 180)
#define MM 1e-3
#define HALF 0.060   // m, of the sheet's side
#define THICK 0.005  // m

// Fields of a setup: its sheet, where it is held (and where BELIEF_ELSEWHERE has it), and its motion.
#define SHEET(title, n) .name = title, .cells = n, .element = OM_ELEMENT_QUADRATIC, .way = 5 * MM
#define HALF_HELD                                                 \
    .lo = {-0.061, -0.061, -0.001}, .hi = {-0.010, 0.061, 0.001}, \
    .else_lo = {-0.061, 0.010, -0.001}, .else_hi = {0.020, 0.061, 0.001}, .elevation = 70 * DEG
#define QUARTER_HELD                                             \
    .lo = {-0.061, -0.061, -0.001}, .hi = {0.001, 0.001, 0.001}, \
    .else_lo = {-0.061, -0.001, -0.001}, .else_hi = {0.001, 0.061, 0.001}, .elevation = 50 * DEG
#define FOLD(degrees)                                                  \
    .move = {.narm = 2,                                                \
             .arm = {0, 1},                                            \
             .grasp = {{0.052, -0.030, THICK}, {0.052, 0.030, THICK}}, \
             .line = {0.005, 0, 0.0025},                               \
             .axis = {0, -1, 0},                                       \
             .angle = (degrees)*DEG}
#define PULL(mm) \
    .move = {.narm = 1, .arm = {1}, .grasp = {{0.050, 0.045, THICK}}, .shift = {0, 0, (mm)*MM}}
#define CORNER                                                       \
    .move = {.narm = 1,                                              \
             .arm = {1},                                             \
             .grasp = {{0.044, 0.044, THICK}},                       \
             .line = {0.010, 0.010, 0.0025},                         \
             .axis = {0.70710678118654752, -0.70710678118654752, 0}, \
             .angle = 100 * DEG}

const MatchSetup om__match_setup[MATCH_NSETUP] = {
    {SHEET("fold-45", 20), HALF_HELD, FOLD(45)},     {SHEET("fold-90", 20), HALF_HELD, FOLD(90)},
    {SHEET("fold-135", 20), HALF_HELD, FOLD(135)},   {SHEET("corner-100", 20), HALF_HELD, CORNER},
    {SHEET("pull-20", 20), QUARTER_HELD, PULL(20)},  {SHEET("pull-40", 20), QUARTER_HELD, PULL(40)},
    {SHEET("pull-60", 20), QUARTER_HELD, PULL(60)},  {SHEET("quick-135", 12), HALF_HELD, FOLD(135)},
    {SHEET("quick-40", 12), QUARTER_HELD, PULL(40)},
};

enum { F45, F90, F135, C100, P20, P40, P60, QUICK135, QUICK40 };

const MatchCase om__match_case[] = {
    // motions, all else as good as it gets
    {"fold 45", F45, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"fold 90", F90, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"fold 135", F135, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"corner 100", C100, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"pull 20", P20, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"pull 40", P40, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"pull 60", P60, VIEW_FULL, 1, false, BELIEF_RIGHT},
    // one thing changed, from a fold of 135 degrees
    {"fold 135, 60 % seen", F135, VIEW_FULL, 0.6, false, BELIEF_RIGHT},
    {"fold 135, 40 % seen", F135, VIEW_FULL, 0.4, false, BELIEF_RIGHT},
    {"fold 135, 20 % seen", F135, VIEW_FULL, 0.2, false, BELIEF_RIGHT},
    {"fold 135, no noise", F135, VIEW_EXACT, 1, false, BELIEF_RIGHT},
    {"fold 135, no tool", F135, VIEW_BARE, 1, false, BELIEF_RIGHT},
    {"fold 135, fewer", F135, VIEW_FULL, 1, false, BELIEF_FEWER},
    {"fold 135, more", F135, VIEW_FULL, 1, false, BELIEF_MORE},
    {"fold 135, elsewhere", F135, VIEW_FULL, 1, false, BELIEF_ELSEWHERE},
    {"fold 135, none", F135, VIEW_FULL, 1, false, BELIEF_NONE},
    // one thing changed, from a pull of 40 mm
    {"pull 40, 60 % seen", P40, VIEW_FULL, 0.6, false, BELIEF_RIGHT},
    {"pull 40, 40 % seen", P40, VIEW_FULL, 0.4, false, BELIEF_RIGHT},
    {"pull 40, 20 % seen", P40, VIEW_FULL, 0.2, false, BELIEF_RIGHT},
    {"pull 40, no noise", P40, VIEW_EXACT, 1, false, BELIEF_RIGHT},
    {"pull 40, no tool", P40, VIEW_BARE, 1, false, BELIEF_RIGHT},
    {"pull 40, fewer", P40, VIEW_FULL, 1, false, BELIEF_FEWER},
    {"pull 40, more", P40, VIEW_FULL, 1, false, BELIEF_MORE},
    {"pull 40, elsewhere", P40, VIEW_FULL, 1, false, BELIEF_ELSEWHERE},
    {"pull 40, none", P40, VIEW_FULL, 1, false, BELIEF_NONE},
    // corners of the design
    {"fold 135, 40 % seen, fewer", F135, VIEW_FULL, 0.4, false, BELIEF_FEWER},
    {"fold 135, 20 % seen, none", F135, VIEW_FULL, 0.2, false, BELIEF_NONE},
    {"fold 135, 40 % far, right", F135, VIEW_FULL, 0.4, true, BELIEF_RIGHT},
    {"fold 90, none", F90, VIEW_FULL, 1, false, BELIEF_NONE},
    {"fold 90, 40 % seen, more", F90, VIEW_FULL, 0.4, false, BELIEF_MORE},
    {"fold 45, elsewhere", F45, VIEW_FULL, 1, false, BELIEF_ELSEWHERE},
    {"corner 100, none", C100, VIEW_FULL, 1, false, BELIEF_NONE},
    {"pull 60, 20 % seen, elsewhere", P60, VIEW_FULL, 0.2, false, BELIEF_ELSEWHERE},
    {"pull 60, none", P60, VIEW_FULL, 1, false, BELIEF_NONE},
};
const int om__match_ncase = (int)(sizeof om__match_case / sizeof *om__match_case);

const MatchCase om__match_quick_case[] = {
    {"fold 135", QUICK135, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"fold 135, 40 % seen, none", QUICK135, VIEW_FULL, 0.4, false, BELIEF_NONE},
    {"pull 40", QUICK40, VIEW_FULL, 1, false, BELIEF_RIGHT},
    {"pull 40, no tool, elsewhere", QUICK40, VIEW_BARE, 1, false, BELIEF_ELSEWHERE},
};
const int om__match_nquick = (int)(sizeof om__match_quick_case / sizeof *om__match_quick_case);

const char* const om__match_belief_name[NBELIEF] = {"right", "fewer", "more", "elsewhere", "none"};
const char* const om__match_view_name[NVIEW] = {"noise, tool", "no noise", "no tool"};

// Layouts of the sheet, with seeds that no other study uses; 10 to 50 % of the underside held, the last two of each set
// in two regions. The first set was committed before any method. The second one was committed after results on the
// first were known, and before any method was run on it. The third one is for development.
const MatchLayout om__match_layout[MATCH_NSET * MATCH_NLAYOUT] = {
    {{201, 0}, 0.10, 0.040, {{-0.052, -0.052}, {0.020, -0.052}, {-0.052, 0.020}}},
    {{202, 0}, 0.14, 0.040, {{-0.052, 0.052}, {-0.020, -0.052}, {-0.020, 0.052}}},
    {{203, 0}, 0.18, 0.030, {{0.020, 0.052}, {-0.052, 0.052}, {0.052, 0.052}}},
    {{204, 0}, 0.22, 0.040, {{0.020, -0.052}, {0.052, 0.052}, {0.052, 0.020}}},
    {{205, 0}, 0.26, 0.050, {{0.052, 0.020}, {0.020, -0.052}, {-0.020, -0.052}}},
    {{206, 0}, 0.30, 0.040, {{-0.052, 0.052}, {-0.052, 0.020}, {-0.052, -0.052}}},
    {{207, 0}, 0.34, 0.040, {{0.052, 0.052}, {0.020, 0.052}, {-0.020, 0.052}}},
    {{208, 0}, 0.38, 0.030, {{-0.052, -0.020}, {-0.052, -0.052}, {0.020, -0.052}}},
    {{209, 0}, 0.44, 0.050, {{-0.020, 0.052}, {-0.052, 0.020}, {-0.052, 0.052}}},
    {{210, 0}, 0.50, 0.040, {{0.052, -0.052}, {0.052, 0.020}, {0.052, 0.052}}},
    {{211, 213}, 0.10, 0.040, {{0.020, 0.052}, {-0.020, 0.052}, {0.052, 0.020}}},
    {{212, 214}, 0.16, 0.040, {{0.020, -0.052}, {0.052, -0.020}, {0.052, -0.052}}},

    {{301, 0}, 0.10, 0.040, {{-0.052, 0.052}, {-0.020, -0.052}, {0.020, 0.052}}},
    {{302, 0}, 0.14, 0.040, {{-0.052, -0.052}, {0.052, 0.052}, {-0.052, 0.020}}},
    {{303, 0}, 0.18, 0.030, {{0.020, -0.052}, {0.052, 0.052}, {0.052, -0.020}}},
    {{304, 0}, 0.22, 0.040, {{0.052, 0.052}, {0.020, -0.052}, {0.052, -0.052}}},
    {{305, 0}, 0.26, 0.050, {{0.052, -0.020}, {0.020, -0.052}, {0.052, -0.052}}},
    {{306, 0}, 0.30, 0.040, {{-0.052, 0.052}, {-0.020, 0.052}, {-0.052, 0.020}}},
    {{307, 0}, 0.34, 0.040, {{0.020, -0.052}, {0.052, -0.052}, {0.052, -0.020}}},
    {{308, 0}, 0.38, 0.030, {{0.052, -0.052}, {0.052, 0.052}, {0.020, 0.052}}},
    {{309, 0}, 0.44, 0.050, {{-0.020, 0.052}, {-0.052, 0.052}, {-0.052, 0.020}}},
    {{310, 0}, 0.50, 0.040, {{-0.052, 0.020}, {-0.020, 0.052}, {-0.052, 0.052}}},
    {{311, 313}, 0.10, 0.040, {{0.052, -0.052}, {-0.020, -0.052}, {0.020, -0.052}}},
    {{312, 314}, 0.16, 0.040, {{-0.052, 0.052}, {-0.020, 0.052}, {-0.052, -0.020}}},

    {{401, 0}, 0.10, 0.040, {{0.052, 0.020}, {-0.052, -0.020}, {-0.020, -0.052}}},
    {{402, 0}, 0.14, 0.040, {{-0.020, 0.052}, {-0.052, 0.020}, {0.052, 0.052}}},
    {{403, 0}, 0.18, 0.030, {{0.052, -0.052}, {0.052, -0.020}, {-0.052, 0.020}}},
    {{404, 0}, 0.22, 0.040, {{-0.020, 0.052}, {-0.052, 0.052}, {-0.052, 0.020}}},
    {{405, 0}, 0.26, 0.050, {{-0.020, -0.052}, {-0.052, 0.052}, {-0.052, -0.020}}},
    {{406, 0}, 0.30, 0.040, {{0.052, -0.020}, {-0.052, 0.052}, {0.020, 0.052}}},
    {{407, 0}, 0.34, 0.040, {{0.052, 0.052}, {-0.020, 0.052}, {0.020, 0.052}}},
    {{408, 0}, 0.38, 0.030, {{-0.020, 0.052}, {0.020, 0.052}, {0.052, 0.020}}},
    {{409, 0}, 0.44, 0.050, {{-0.052, 0.052}, {0.052, 0.052}, {0.020, -0.052}}},
    {{410, 0}, 0.50, 0.040, {{0.052, -0.052}, {-0.052, -0.052}, {-0.020, -0.052}}},
    {{411, 413}, 0.10, 0.040, {{0.052, -0.020}, {-0.020, -0.052}, {0.052, 0.020}}},
    {{412, 414}, 0.16, 0.040, {{-0.052, 0.020}, {-0.052, -0.052}, {-0.020, -0.052}}},
};

// ---- scenes and sites ---------------------------------------------------------------------------------

MatchSetup om__match_layout_setup(int layout, int grasp, int cells) {
    const MatchLayout* l = &om__match_layout[layout];
    MatchSetup s = {.cells = cells,
                    .element = OM_ELEMENT_QUADRATIC,
                    .layout = {l->layout[0], l->layout[1]},
                    .share = l->share,
                    .elevation = 50 * DEG};
    const double* at = l->grasp[grasp];
    s.move = (MatchMove){
        .narm = 1, .arm = {at[1] > 0}, .grasp = {{at[0], at[1], THICK}}, .shift = {0, 0, l->lift}};
    snprintf(s.name, sizeof s.name, "layout-%02d-%d-%d", layout + 1, grasp + 1, cells);
    return s;
}

OmScene om__match_make_scene(const MatchSetup* setup, MatchBelief belief) {
    OmScene s = om_scene_default();
    s.tissue.law = OM_STABLE_NEO_HOOKEAN;
    s.tissue.element = setup->element;
    snprintf(s.name, sizeof s.name, "%s", setup->name);
    double n = setup->cells, fine = floor(1.5 * n);
    s.seed = setup->layout[0] ? setup->layout[0] : 1;
    s.tissue.cells = om_vec3(n, n, 1);
    s.tissue.world_cells = om_vec3(fine, fine, setup->element == OM_ELEMENT_LINEAR ? 2 : 1);
    s.rgbd.elevation = setup->elevation;
    s.attach.share_min = s.attach.share_max = setup->share;
    if (!setup->layout[0]) {
        s.attach.kind = OM_ATTACH_BOX;
        s.attach.share_min = 0.1, s.attach.share_max = 0.5;
        s.attach.lo = setup->lo;
        s.attach.hi = setup->hi;
    }
    if (belief == BELIEF_FEWER) s.believed.grow = -15 * MM;
    if (belief == BELIEF_MORE) s.believed.grow = 15 * MM;
    if (belief == BELIEF_NONE) s.believed.kind = OM_BELIEF_NONE;
    if (belief == BELIEF_ELSEWHERE) {
        s.believed.kind = OM_BELIEF_BOX;
        s.believed.lo = setup->else_lo;
        s.believed.hi = setup->else_hi;
    }
    return s;
}

// Add the second patch to the first. Both sites have the same mesh.
static OmStatus add_patch(const OmSite* second, OmSite* site) {
    const OmMeshSet* a = om_tet_mesh_find_set(&site->mesh, "attachment");
    const OmMeshSet* b = om_tet_mesh_find_set(&second->mesh, "attachment");
    int* both;
    OM_ALLOC(both, (size_t)(a->nvert + b->nvert));
    memcpy(both, a->vert, (size_t)a->nvert * sizeof *both);
    memcpy(both + a->nvert, b->vert, (size_t)b->nvert * sizeof *both);
    OmStatus status = om_tet_mesh_add_set(&site->mesh, "attachment", both, a->nvert + b->nvert);
    om_free(both);
    // Areas and springs are those of an elastic foundation, which no setup has.
    om_free(site->attach_area);
    om_free(site->attach_spring);
    site->attach_area = site->attach_spring = NULL;
    return status;
}

OmStatus om__match_build_site(const MatchSetup* setup, MatchBelief belief, OmSiteRole role,
                              OmScene* scene, OmSite* site) {
    *scene = om__match_make_scene(setup, belief);
    OM_TRY(om_site_build(scene, role, NULL, site));
    bool is_true = role == OM_SITE_WORLD || belief == BELIEF_RIGHT;
    if (!setup->layout[1] || !is_true) return OM_OK;
    OmScene other = *scene;
    OmSite second = {0};
    other.seed = setup->layout[1];
    OmStatus status = om_site_build(&other, role, NULL, &second);
    if (status == OM_OK) status = add_patch(&second, site);
    om_site_done(&second);
    if (status < 0) om_site_done(site);
    return status;
}

OmVec3 om__match_tip(const MatchMove* move, int k, double share) {
    OmVec3 arm = om_sub(move->grasp[k], move->line);
    OmQuat turn = om_quat_axis_angle(move->axis, share * move->angle);
    OmVec3 p = move->angle != 0 ? om_add(move->line, om_quat_rotate(turn, arm)) : move->grasp[k];
    return om_madd(p, share, move->shift);
}
