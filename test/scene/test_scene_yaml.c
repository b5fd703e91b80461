// The schema reader: values land in SI, and every mistake is named with its line.
#include "omentum/scene_yaml.h"
#include "test_common.h"

#include <time.h>

typedef struct Item {
    char name[8];
    double young;
} Item;

typedef struct Thing {
    double size;
    int count;
    bool is_open;
    int kind;
    OmVec3 at;
    double pair[2];
    Item first;
    Item item[2];
    int nitem;
} Thing;

static const char* const kind_name[] = {"sheet", "organ", NULL};

static const OmYamlField item_field[] = {
    {"name", OM_YAML_STRING, offsetof(Item, name), .size = 8, .is_required = true},
    {"young", OM_YAML_DOUBLE, offsetof(Item, young), .min = 1, .max = 1e6},
};
static void item_default(void* item) { ((Item*)item)->young = 3000; }
static const OmYamlSchema item_schema = {"item", item_field, 2, item_default};
static const OmYamlField field[] = {
    {"size_mm", OM_YAML_DOUBLE, offsetof(Thing, size), .scale = 1e-3},
    {"count", OM_YAML_INT, offsetof(Thing, count), .min = 0, .max = 10},
    {"is_open", OM_YAML_BOOL, offsetof(Thing, is_open)},
    {"kind", OM_YAML_ENUM, offsetof(Thing, kind), .name = kind_name},
    {"at_mm", OM_YAML_VEC3, offsetof(Thing, at), .scale = 1e-3},
    {"pair_mm", OM_YAML_NUMBERS, offsetof(Thing, pair), .min = -5, .max = 5, .scale = 1e-3,
     .capacity = 2},
    {"first", OM_YAML_STRUCT, offsetof(Thing, first), .sub = &item_schema},
    {"items", OM_YAML_LIST, offsetof(Thing, item), .size = sizeof(Item), .sub = &item_schema,
     .count_offset = offsetof(Thing, nitem), .capacity = 2},
};
static const OmYamlSchema schema = {"thing", field, 8, NULL};

static OmStatus parse(const char* text, Thing* t) {
    memset(t, 0, sizeof *t);
    return om_yaml_parse(text, strlen(text), "t.yaml", &schema, t);
}

// Depth costs libyaml the square of it: bombs are refused before they are built.
static void bombs_are_refused(void** state) {
    (void)state;
    static const struct {
        const char* piece;
        int count;
        const char* expected;
    } bomb[] = {{"[", 500000, "more than 32 deep"},
                {"{a: ", 200000, "more than 32 deep"},
                {"- ", 500000, "more than 32 deep"},
                {"? ", 500000, "more than 32 deep"},
                {"- 1\n", 1000000, "more than 1000000 values"}};
    for (size_t i = 0; i < sizeof bomb / sizeof *bomb; ++i) {
        OmText text = {0};
        Thing t;
        for (int k = 0; k < bomb[i].count; ++k)
            assert_ok(om_text_append_raw(&text, bomb[i].piece, strlen(bomb[i].piece)));
        clock_t start = clock();
        memset(&t, 0, sizeof t);
        assert_status(om_yaml_parse(text.str, text.len, "t.yaml", &schema, &t), OM_INVALID);
        assert_non_null(strstr(om_error_message(), bomb[i].expected));
        assert_below((double)(clock() - start) / CLOCKS_PER_SEC, 5);  // minutes without the limit
        om_text_done(&text);
    }
}

// Lists of lists of aliases: a schema is walked, not the document, so they cost nothing.
static void alias_bombs_cost_nothing(void** state) {
    (void)state;
    OmText text = {0};
    Thing t;
    assert_ok(om_text_append(&text, "a0: &a0 [x]\n"));
    for (int k = 1; k < 30; ++k) {
        assert_ok(om_text_append(&text, "a%d: &a%d [", k, k));
        for (int i = 0; i < 10; ++i) assert_ok(om_text_append(&text, "*a%d, ", k - 1));
        assert_ok(om_text_append(&text, "]\n"));
    }
    memset(&t, 0, sizeof t);
    assert_status(om_yaml_parse(text.str, text.len, "t.yaml", &schema, &t), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "unknown key \"a0\""));
    om_text_done(&text);
}

static void names_have_no_control_characters(void** state) {
    (void)state;
    static const char* const hostile[] = {
        "first: {name: \"a\\x1b\"}\n", "first: {name: \"a\\x7f\"}\n", "first: {name: \"a\\nb\"}\n",
        "first: {name: \"\\x85\"}\n"};
    Thing t;
    for (size_t i = 0; i < sizeof hostile / sizeof *hostile; ++i) {
        assert_status(parse(hostile[i], &t), OM_INVALID);
        assert_non_null(strstr(om_error_message(), "t.yaml:1: name: has a control character"));
    }
    assert_status(parse("first: {name: \xff}\n", &t), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "not valid YAML"));
    assert_ok(parse("first: {name: \"\\xe4\"}\n", &t));
    assert_string_equal(t.first.name, "\xc3\xa4");
}

static void values_land_in_si(void** state) {
    (void)state;
    Thing t;
    assert_ok(parse("# a comment\nsize_mm: 12.5\ncount: 3\nis_open: true\nkind: organ\n"
                    "at_mm: [1, 2, -3e1]\npair_mm: [-2.5, 4]\nfirst: {name: fat}\n"
                    "items:\n  - name: a\n    young: 5\n  - {name: b}\n",
                    &t));
    assert_near(t.size, 0.0125, 1e-18);
    assert_int_equal(t.count, 3);
    assert_true(t.is_open);
    assert_int_equal(t.kind, 1);
    assert_near(om_distance(t.at, om_vec3(0.001, 0.002, -0.03)), 0, 1e-17);
    assert_near(t.pair[0], -0.0025, 1e-18);
    assert_near(t.pair[1], 0.004, 1e-18);
    assert_string_equal(t.first.name, "fat");
    assert_int_equal(t.nitem, 2);
    assert_near(t.item[0].young, 5, 0);
    assert_near(t.item[1].young, 3000, 0);
}

static void mistakes_are_named(void** state) {
    (void)state;
    static const struct {
        const char* text;
        const char* message;
    } bad[] = {
        {"size_mm: 1\ncuont: 3\n",
         "t.yaml:2: thing: unknown key \"cuont\"; did you mean \"count\"?"},
        {"zzzzzzz: 3\n", "t.yaml:1: thing: unknown key \"zzzzzzz\"; valid keys: size_mm, count"},
        {"pair_mm: 3\n", "t.yaml:1: pair_mm: \"3\" is not a list of 2 numbers"},
        {"pair_mm: [3]\n", "t.yaml:1: pair_mm: has 1 numbers, 2 are wanted"},
        {"pair_mm: [3, 6]\n", "t.yaml:1: pair_mm: 6 is outside its range, -5 to 5"},
        {"count: 11\n", "t.yaml:1: count: 11 is outside its range, 0 to 10"},
        {"count: 1.5\n", "t.yaml:1: count: 1.5 is not a whole number"},
        {"size_mm: abc\n", "t.yaml:1: size_mm: \"abc\" is not a number"},
        {"size_mm: nan\n", "t.yaml:1: size_mm: \"nan\" is not a number"},
        {"size_mm: 1e999\n", "t.yaml:1: size_mm: 1e999 is too large"},
        {"size_mm: [1]\n", "t.yaml:1: size_mm: \"a list\" is not a number"},
        {"size_mm:\n", "t.yaml:1: size_mm: \"\" is not a number"},
        {"kind: shet\n", "t.yaml:1: kind: \"shet\" is none of sheet, organ"},
        {"is_open: 3\n", "t.yaml:1: is_open: \"3\" is not true or false"},
        {"at_mm: [1, 2]\n", "t.yaml:1: at_mm: has 2 numbers, 3 are wanted"},
        {"first: {young: 3}\n", "t.yaml:1: item: \"name\" is missing"},
        {"first: {name: much_too_long}\n", "t.yaml:1: name: 13 letters, at most 7"},
        {"items: [{name: a}, {name: b}, {name: c}]\n", "t.yaml:1: items: has 3 items, at most 2"},
        {"count: 1\ncount: 2\n", "t.yaml:2: thing: \"count\" is given twice"},
        {"count: [1\nsize_mm: 3\n", "not valid YAML"},
        {"- a\n- b\n", "t.yaml:1: thing: \"a list\" is not a mapping of keys"},
        {"", "t.yaml: is empty; a thing is wanted"},
        {"first: &a\n  name: *a\n", "is not a text"},
        {"? [a]\n: 3\n", "is not a key"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        Thing t;
        assert_status(parse(bad[i].text, &t), OM_INVALID);
        if (!strstr(om_error_message(), bad[i].message)) {
            fail_msg("case %zu: got \"%s\", want \"%s\"", i, om_error_message(), bad[i].message);
        }
    }
    Thing t;
    assert_status(om_yaml_load("no/such.yaml", &schema, &t), OM_IO);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bombs_are_refused),
        cmocka_unit_test(alias_bombs_cost_nothing),
        cmocka_unit_test(names_have_no_control_characters),
        cmocka_unit_test(values_land_in_si),
        cmocka_unit_test(mistakes_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
