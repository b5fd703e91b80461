// scene_print.c: scenes and their keys as text: a scene with every default, an example, the page of all keys.
#include <string.h>

#include "scene/scene_keys.h"

// A scene that a program made may hold values without effect, which the reader refuses (check_uses).
static void forget_unused(OmScene* s) {
    const OmScene plain = om_scene_default();
    OmSceneBelief* b = &s->believed;
    if (s->tissue.source >= OM_SOURCE_PATIENT) s->attach.kind = OM_ATTACH_SET;
    if (s->attach.kind != OM_ATTACH_BOX) s->attach.lo = s->attach.hi = om_vec3(0, 0, 0);
    if (b->kind != OM_BELIEF_BOX) b->lo = b->hi = om_vec3(0, 0, 0);
    if (b->kind != OM_BELIEF_SAME) {
        b->shift = om_vec3(0, 0, 0);
        b->grow = 0;
        b->ratio = 1;
    }
    if (b->kind != OM_BELIEF_PATCH) {
        b->seed = plain.believed.seed;
        b->share = plain.believed.share;
    }
    if (s->roi.is_random) s->roi.center = om_vec3(0, 0, 0);
}

OmStatus om_scene_print(const OmScene* scene, bool is_commented, OmText* text) {
    OmScene s = *scene;
    s.calibrated[0] = 0;  // the scene already contains its values
    forget_unused(&s);
    OmYamlPrint options = {.group = OM__SCENE_IN(s.tissue.source), .is_commented = is_commented};
    return om_yaml_print(&om__scene_schema, &s, &options, text);
}

OmStatus om_scene_print_example(OmText* text) {
    OmScene s = om_scene_default();
    snprintf(s.name, sizeof s.name, "example");
    OM_TRY(om_text_append(
        text,
        "# A complete scene: the sheet of the thesis (6.4.7), every key with its default. Keys that may\n"
        "# be left out: all but name and source. Keys behind a # are of other sources than sheet.\n"
        "# omentum retract example.yaml -o out/example\n"));
    OmYamlPrint options = {
        .group = OM__SCENE_IN(s.tissue.source), .is_commented = true, .shows_others = true};
    return om_yaml_print(&om__scene_schema, &s, &options, text);
}

OmStatus om_scene_print_keys(OmText* text) {
    OmScene plain = om_scene_default();
    OM_TRY(om_text_append(
        text,
        "# The keys of a scene\n\n"
        "<!-- made by omentum retract --keys; the tables are in src/scene/scene_keys.c -->\n\n"
        "A scene is one YAML file. `omentum retract --example` prints a complete one, `--print-scene SCENE` "
        "a scene with all\ndefaults filled in, `--dry-run SCENE` what a scene would cost. Unknown keys, and "
        "keys that have no effect on the\nscene's source, are refused. Lengths are those of the task frame: "
        "origin at the centre of the tissue's underside,\nz against gravity, the endoscope on the side of -x, "
        "PSM1 on the side of -y.\n\n## Scene\n\n"));
    OM_TRY(om_yaml_print_keys(&om__scene_schema, &plain, om__scene_source_name, text));
    for (int i = 0; i < om__scene_schema.nfield; ++i) {
        const OmYamlField* f = &om__scene_schema.field[i];
        if (f->kind != OM_YAML_STRUCT) continue;
        OM_TRY(om_text_append(text, "\n## `%s:` %s\n\n", f->key, f->help));
        if (f->group) {
            OM_TRY(om_text_append(text, "Of sources"));
            for (int k = 0; om__scene_source_name[k]; ++k)
                if (f->group & (1u << k))
                    OM_TRY(om_text_append(text, " %s", om__scene_source_name[k]));
            OM_TRY(om_text_append(text, " alone.\n\n"));
        }
        OM_TRY(om_yaml_print_keys(f->sub, (const char*)&plain + f->offset,
                                  f->group ? NULL : om__scene_source_name, text));
    }
    return OM_OK;
}
