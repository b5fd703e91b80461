// rl_retract_settings.c: the settings of the task "retract" as a user writes them.
#include <stddef.h>
#include <string.h>

#include "rl/rl_internal.h"
#include "rl/rl_retract_internal.h"

typedef enum Kind { NUMBER, COUNT, FLAG } Kind;

typedef struct Setting {
    const char* key;
    Kind kind;
    size_t at;  // of the field in the definition
    double unit;
    double lo, hi;  // in units of the setting
} Setting;

#define AT(field) offsetof(OmRlRetractDef, field)
static const Setting table[] = {{"thickness_mm", NUMBER, AT(thickness), 1e-3, 0.5, 20},
                                {"cluster_spacing_mm", NUMBER, AT(cluster_spacing), 1e-3, 3, 50},
                                {"cluster_radius_mm", NUMBER, AT(cluster_radius), 1e-3, 1.5, 50},
                                {"cluster_stiffness", NUMBER, AT(cluster_stiffness), 1, 0, 1},
                                {"self_collision", FLAG, AT(has_self_collision), 1, 0, 1},
                                {"young", NUMBER, AT(young), 1, 10, 1e7},
                                {"poisson", NUMBER, AT(poisson), 1, 0, 0.4999},
                                {"density", NUMBER, AT(density), 1, 1, 1e5},
                                {"kidney_shift_x_mm", NUMBER, AT(kidney_shift.x), 1e-3, -20, 20},
                                {"kidney_shift_y_mm", NUMBER, AT(kidney_shift.y), 1e-3, -20, 20},
                                {"kidney_label", COUNT, AT(kidney_label), 1, 0, 65535},
                                {"tumour_x_mm", NUMBER, AT(tumour_x), 1e-3, -50, 50},
                                {"tumour_y_mm", NUMBER, AT(tumour_y), 1e-3, -50, 50},
                                {"goal_mm", NUMBER, AT(goal_along), 1e-3, 0, 90},
                                {"max_step", COUNT, AT(max_step), 1, 1, 1e9},
                                {"hold", COUNT, AT(hold), 1, 1, 1e6},
                                {"fixed_horizon", FLAG, AT(has_fixed_horizon), 1, 0, 1},
                                {"repeat", COUNT, AT(repeat), 1, 1, 100},
                                {"still", COUNT, AT(still), 1, 0, 1e9},
                                {"gripper", FLAG, AT(has_gripper), 1, 0, 1},
                                {"move_mm", NUMBER, AT(move), 1e-3, 0.01, 5},
                                {"start_height_mm", NUMBER, AT(start_height), 1e-3, 3, 50},
                                {"points", COUNT, AT(npoint), 1, 0, OM_RL_MAX_POINT},
                                {"picture", FLAG, AT(has_picture), 1, 0, 1},
                                {"awake", FLAG, AT(is_awake), 1, 0, 1},
                                {"tip_error_mm", NUMBER, AT(tip_error), 1e-3, 0, 20},
                                {"camera_noise", NUMBER, AT(camera_noise), 1, 0, 100},
                                {"step_cost", NUMBER, AT(step_cost), 1, 0, 1},
                                {"margin_mm", NUMBER, AT(margin), 1e-3, 0, 20},
                                {"slip_n", NUMBER, AT(slip_force), 1, 0, 1000},
                                {"variants", COUNT, AT(nvariant), 1, 1, OM_RL_MAX_VARIANT},
                                {"vary_thickness", NUMBER, AT(vary_thickness), 1, 0, 0.5},
                                {"vary_softness", NUMBER, AT(vary_softness), 1, 0, 0.9},
                                {"vary_kidney_mm", NUMBER, AT(vary_kidney), 1e-3, 0, 20}};
enum { NSETTING = sizeof table / sizeof *table };

// Settings whose value is a word.
static OmStatus use_word(const OmRlSetting* s, OmRlRetractDef* def, bool* is_used) {
    static const char* const reward[] = {"thesis", "exposure"};
    static const char* const tissue[] = {"clusters", "thesis", "elements"};
    *is_used = true;
    if (strcmp(s->key, "reward") == 0) {
        for (int k = 0; k < 2; ++k)
            if (strcmp(s->value, reward[k]) == 0) {
                def->reward = (OmRlReward)k;
                return OM_OK;
            }
        return om_error(OM_INVALID, "task retract: reward is \"%s\"; it must be thesis or exposure",
                        s->value);
    }
    if (strcmp(s->key, "tissue") == 0) {
        int k = 0;
        while (k < 3 && strcmp(s->value, tissue[k]) != 0) ++k;
        OM_CHECK(k < 3, OM_INVALID,
                 "task retract: tissue is \"%s\"; it must be clusters, thesis or elements",
                 s->value);
        def->tissue = k == 2 ? OM_RL_ELEMENTS : OM_RL_CLUSTERS;
        if (k == 1)  // 5.4.1
            def->cluster_spacing = 0.0127, def->cluster_radius = 0.0095,
            def->cluster_stiffness = 0.361;
        return OM_OK;
    }
    if (strcmp(s->key, "picture_side") == 0) {
        double side;
        OM_TRY(om__rl_setting_number("retract", s, 8, 1024, &side));
        OM_CHECK(side == (int)side, OM_INVALID,
                 "task retract: picture_side is \"%s\"; it must be a whole number", s->value);
        def->picture_width = def->picture_height = (int)side;
        return OM_OK;
    }
    if (strcmp(s->key, "kidney") == 0) {
        def->kidney_file = s->value;
        return OM_OK;
    }
    if (strcmp(s->key, "instrument") == 0) {
        def->instrument_file = s->value;
        return OM_OK;
    }
    if (strcmp(s->key, "world") == 0) {
        OM_CHECK(strcmp(s->value, "training") == 0 || strcmp(s->value, "reality") == 0, OM_INVALID,
                 "task retract: world is \"%s\"; it must be training or reality", s->value);
        if (s->value[0] == 'r') om__rl_retract_use_reality(def);
        return OM_OK;
    }
    *is_used = false;
    return OM_OK;
}

static OmStatus use_setting(const OmRlSetting* s, OmRlRetractDef* def) {
    const char* known[NSETTING + 7];
    bool is_used;
    OM_TRY(use_word(s, def, &is_used));
    if (is_used) return OM_OK;
    for (int k = 0; k < NSETTING; ++k) {
        const Setting* e = &table[k];
        if (strcmp(s->key, e->key) != 0) continue;
        double v;
        OM_TRY(om__rl_setting_number("retract", s, e->lo, e->hi, &v));
        char* field = (char*)def + e->at;
        int count = (int)v;
        bool flag = v != 0;
        OM_CHECK(e->kind == NUMBER || v == count, OM_INVALID,
                 "task retract: %s is \"%s\"; it must be a whole number", s->key, s->value);
        v *= e->unit;
        if (e->kind == NUMBER) memcpy(field, &v, sizeof v);
        if (e->kind == COUNT) memcpy(field, &count, sizeof count);
        if (e->kind == FLAG) memcpy(field, &flag, sizeof flag);
        return OM_OK;
    }
    for (int k = 0; k < NSETTING; ++k) known[k] = table[k].key;
    known[NSETTING] = "reward", known[NSETTING + 1] = "tissue", known[NSETTING + 2] = "world";
    known[NSETTING + 3] = "instrument", known[NSETTING + 4] = "picture_side";
    known[NSETTING + 5] = "kidney", known[NSETTING + 6] = NULL;
    return om__rl_setting_unknown("retract", s, known);
}

OmStatus om__rl_retract_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    *task = NULL;
    OmRlRetractDef def = om_rl_retract_default_def();
    for (int k = 0; k < nsetting; ++k) OM_TRY(use_setting(&setting[k], &def));
    return om_rl_retract_create(&def, task);
}
