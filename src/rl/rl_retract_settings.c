// rl_retract_settings.c: the settings of the task "retract" as a user writes them.
#include <stddef.h>
#include <string.h>

#include "rl/rl_internal.h"
#include "rl/rl_retract_internal.h"

typedef enum Kind { NUMBER, COUNT, FLAG } Kind;

typedef struct Field {
    const char* name;  // of the definition, which has these limits too; null: checked elsewhere
    const char* key;   // of the setting; null: there is none
    Kind kind;
    size_t at;  // of the field in the definition
    double unit;
    double lo, hi;  // in units of the setting
} Field;

// clang-format off
#define LIMIT(field, key, unit, lo, hi) {#field, key, NUMBER, offsetof(OmRlRetractDef, field), unit, lo, hi}
#define KEY(kind, field, key, unit, lo, hi) {NULL, key, kind, offsetof(OmRlRetractDef, field), unit, lo, hi}
// clang-format on
static const Field table[] = {
    LIMIT(thickness, "thickness_mm", 1e-3, 0.5, 20),
    LIMIT(cluster_spacing, "cluster_spacing_mm", 1e-3, 3, 50),
    LIMIT(cluster_radius, "cluster_radius_mm", 1e-3, 1.5, 50),
    LIMIT(cluster_stiffness, "cluster_stiffness", 1, 0, 1),
    LIMIT(young, "young", 1, 10, 1e7),
    LIMIT(poisson, "poisson", 1, 0, 0.4999),
    LIMIT(density, "density", 1, 1, 1e5),
    LIMIT(tumour_x, "tumour_x_mm", 1e-3, -50, 50),
    LIMIT(tumour_y, "tumour_y_mm", 1e-3, -50, 50),
    LIMIT(goal_along, "goal_mm", 1e-3, 0, 1e3 * OM__RL_LENGTH),
    LIMIT(move, "move_mm", 1e-3, 0.01, 5),
    LIMIT(start_height, "start_height_mm", 1e-3, 3, 50),
    LIMIT(tip_error, "tip_error_mm", 1e-3, 0, 20),
    LIMIT(camera_noise, "camera_noise", 1, 0, 100),
    LIMIT(slip_force, "slip_n", 1, 0, 1000),
    LIMIT(step_cost, "step_cost", 1, 0, 1),
    LIMIT(margin, "margin_mm", 1e-3, 0, 20),
    LIMIT(vary_thickness, "vary_thickness", 1, 0, 0.5),
    LIMIT(vary_softness, "vary_softness", 1, 0, 0.9),
    LIMIT(vary_kidney, "vary_kidney_mm", 1e-3, 0, 20),
    LIMIT(tumour_radius, NULL, 1e-3, 2, 30),
    LIMIT(time_step, NULL, 1, 1e-4, 0.1),
    LIMIT(grasp_radius, NULL, 1e-3, 1, 20),
    LIMIT(reach, NULL, 1e-3, 0, 20),
    KEY(NUMBER, kidney_shift.x, "kidney_shift_x_mm", 1e-3, -20, 20),
    KEY(NUMBER, kidney_shift.y, "kidney_shift_y_mm", 1e-3, -20, 20),
    KEY(COUNT, kidney_label, "kidney_label", 1, 0, 65535),
    KEY(COUNT, max_step, "max_step", 1, 1, 1e9),
    KEY(COUNT, hold, "hold", 1, 1, 1e6),
    KEY(COUNT, repeat, "repeat", 1, 1, 100),
    KEY(COUNT, still, "still", 1, 0, 1e9),
    KEY(COUNT, npoint, "points", 1, 0, OM_RL_MAX_POINT),
    KEY(COUNT, nvariant, "variants", 1, 1, OM_RL_MAX_VARIANT),
    KEY(FLAG, has_self_collision, "self_collision", 1, 0, 1),
    KEY(FLAG, has_fixed_horizon, "fixed_horizon", 1, 0, 1),
    KEY(FLAG, has_gripper, "gripper", 1, 0, 1),
    KEY(FLAG, has_picture, "picture", 1, 0, 1),
    KEY(FLAG, is_awake, "awake", 1, 0, 1),
};
enum { NFIELD = sizeof table / sizeof *table };

OmStatus om__rl_retract_check_numbers(const OmRlRetractDef* def) {
    for (int k = 0; k < NFIELD; ++k) {
        const Field* e = &table[k];
        double v;
        if (!e->name) continue;
        memcpy(&v, (const char*)def + e->at, sizeof v);
        const double lo = e->unit * e->lo, hi = e->unit * e->hi;
        OM_CHECK(v >= lo && v <= hi, OM_INVALID, "rl retract: %s is %g; it must be from %g to %g",
                 e->name, v, lo, hi);
    }
    return OM_OK;
}

static const char* const reward_name[] = {"thesis", "exposure"};
static const char* const tissue_name[] = {"clusters", "thesis", "elements"};

// Settings whose value is a word.
static OmStatus use_word(const OmRlSetting* s, OmRlRetractDef* def, bool* is_used) {
    *is_used = true;
    if (strcmp(s->key, "reward") == 0) {
        for (int k = 0; k < 2; ++k)
            if (strcmp(s->value, reward_name[k]) == 0) {
                def->reward = (OmRlReward)k;
                return OM_OK;
            }
        return om_error(OM_INVALID, "task retract: reward is \"%s\"; it must be thesis or exposure",
                        s->value);
    }
    if (strcmp(s->key, "tissue") == 0) {
        int k = 0;
        while (k < 3 && strcmp(s->value, tissue_name[k]) != 0) ++k;
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
    const char* known[NFIELD + 7];
    int nknown = 0;
    bool is_used;
    OM_TRY(use_word(s, def, &is_used));
    if (is_used) return OM_OK;
    for (int k = 0; k < NFIELD; ++k) {
        const Field* e = &table[k];
        if (!e->key || strcmp(s->key, e->key) != 0) continue;
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
    for (int k = 0; k < NFIELD; ++k)
        if (table[k].key) known[nknown++] = table[k].key;
    known[nknown++] = "reward", known[nknown++] = "tissue", known[nknown++] = "world";
    known[nknown++] = "instrument", known[nknown++] = "picture_side", known[nknown++] = "kidney";
    known[nknown] = NULL;
    return om__rl_setting_unknown("retract", s, known);
}

// A short number that the reader turns into v.
static void print_number(double v, double unit, char out[32]) {
    for (int digits = 6; digits <= 17; ++digits) {
        double back;
        snprintf(out, 32, "%.*g", digits, v / unit);
        const char* at = out;
        if (om_number_parse(&at, out + strlen(out), &back) && back * unit == v) return;
    }
}

void om__rl_retract_print(const OmRlRetractDef* def, OmRlTask* task) {
    char* text = task->values;
    const size_t size = sizeof task->values;
    char value[32];
    text[0] = '\0';
    // the keys fit; a long path does not, and is left out
    (void)om__rl_settings_add(text, size, "tissue",
                              tissue_name[def->tissue == OM_RL_ELEMENTS ? 2 : 0]);
    (void)om__rl_settings_add(text, size, "reward", reward_name[def->reward]);
    for (int k = 0; k < NFIELD; ++k) {
        const Field* e = &table[k];
        const char* field = (const char*)def + e->at;
        if (!e->key) continue;
        if (e->kind == NUMBER)
            print_number(*(const double*)(const void*)field, e->unit, value);
        else
            snprintf(value, sizeof value, "%d",
                     e->kind == FLAG ? *(const bool*)field : *(const int*)(const void*)field);
        (void)om__rl_settings_add(text, size, e->key, value);
    }
    snprintf(value, sizeof value, "%d", def->picture_width);
    if (def->has_picture) (void)om__rl_settings_add(text, size, "picture_side", value);
    if (def->kidney_file) (void)om__rl_settings_add(text, size, "kidney", def->kidney_file);
    if (def->instrument_file)
        (void)om__rl_settings_add(text, size, "instrument", def->instrument_file);
}

OmStatus om__rl_retract_create(const OmRlSetting* setting, int nsetting, OmRlTask** task) {
    *task = NULL;
    OmRlRetractDef def = om_rl_retract_default_def();
    for (int k = 0; k < nsetting; ++k) OM_TRY(use_setting(&setting[k], &def));
    return om_rl_retract_create(&def, task);
}
