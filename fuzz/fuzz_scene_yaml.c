// fuzz_scene_yaml.c: the settings reader, on a schema with every kind of field.
#include "fuzz_common.h"
#include "omentum/scene_yaml.h"

typedef struct Item {
    char name[8];
    double weight;
} Item;

typedef struct Settings {
    double young;
    int cells, kind, nitem;
    bool is_fixed;
    char file[16];
    OmVec3 size;
    Item best, item[4];
} Settings;

static const char* const kind_name[] = {"sheet", "organ", NULL};
static const OmYamlField item_field[] = {
    {"name", OM_YAML_STRING, offsetof(Item, name), .size = sizeof(((Item*)0)->name),
     .is_required = true},
    {"weight", OM_YAML_DOUBLE, offsetof(Item, weight), .min = 0, .max = 10},
};
static const OmYamlSchema item_schema = {"item", item_field, 2, NULL};
static const OmYamlField field[] = {
    {"young", OM_YAML_DOUBLE, offsetof(Settings, young), .min = 1, .max = 1e9},
    {"cells", OM_YAML_INT, offsetof(Settings, cells), .min = 1, .max = 100},
    {"kind", OM_YAML_ENUM, offsetof(Settings, kind), .name = kind_name},
    {"is_fixed", OM_YAML_BOOL, offsetof(Settings, is_fixed)},
    {"file", OM_YAML_STRING, offsetof(Settings, file), .size = 16},
    {"size_mm", OM_YAML_VEC3, offsetof(Settings, size), .scale = 1e-3},
    {"best", OM_YAML_STRUCT, offsetof(Settings, best), .sub = &item_schema},
    {"items", OM_YAML_LIST, offsetof(Settings, item), .sub = &item_schema, .size = sizeof(Item),
     .count_offset = offsetof(Settings, nitem), .capacity = 4},
};
static const OmYamlSchema schema = {"settings", field, sizeof field / sizeof *field, NULL};

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    Settings s = {.young = 1, .cells = 1};
    OmStatus status = om_yaml_parse((const char*)data, size, "fuzz.yaml", &schema, &s);
    if (status != OM_OK) {
        FUZZ_EXPECT(status < 0 && om_error_message()[0] != '\0');
        return 0;
    }
    // What was accepted keeps its promises.
    FUZZ_EXPECT(s.young >= 1 && s.young <= 1e9);
    FUZZ_EXPECT(s.cells >= 1 && s.cells <= 100);
    FUZZ_EXPECT(s.kind == 0 || s.kind == 1);
    FUZZ_EXPECT(s.nitem >= 0 && s.nitem <= 4);
    FUZZ_EXPECT(memchr(s.file, '\0', sizeof s.file) != NULL);
    for (int i = 0; i < s.nitem; ++i) {
        FUZZ_EXPECT(memchr(s.item[i].name, '\0', sizeof s.item[i].name) != NULL);
        FUZZ_EXPECT(s.item[i].weight >= 0 && s.item[i].weight <= 10);
    }
    return 0;
}
