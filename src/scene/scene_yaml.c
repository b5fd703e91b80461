// scene_yaml.c: read YAML by a table of fields. The only file that uses libyaml.
//
// libyaml builds the document. The reader walks the schema, not the document, so an alias that
// contains itself cannot cause an endless loop. Rejected: libcyaml, whose messages cannot name the
// nearest valid key and whose schema has neither ranges nor units.
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "omentum/scene_yaml.h"

#define MAX_FILE_SIZE (4u << 20)
#define MAX_KEYS 64
#define MAX_DEPTH 32
#define MAX_EVENT 1000000

typedef struct Reader {
    yaml_document_t* doc;
    const char* name;  // of the file
} Reader;

static OmStatus read_mapping(const Reader* r, yaml_node_t* node, const OmYamlSchema* schema,
                             void* out);

static size_t line_of(const yaml_node_t* node) { return node->start_mark.line + 1; }

static const char* scalar_text(const yaml_node_t* node) {
    return (const char*)node->data.scalar.value;
}

// The message for a value of the wrong kind.
static OmStatus wrong_kind(const Reader* r, const yaml_node_t* node, const char* key,
                           const char* want) {
    const char* got = node->type == YAML_SCALAR_NODE     ? scalar_text(node)
                      : node->type == YAML_SEQUENCE_NODE ? "a list"
                                                         : "a mapping";
    return om_error(OM_INVALID, "%s:%zu: %s: \"%.60s\" is not %s", r->name, line_of(node), key, got,
                    want);
}

static OmStatus read_number(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                            double* out) {
    if (node->type != YAML_SCALAR_NODE || node->data.scalar.length == 0) {
        return wrong_kind(r, node, f->key, "a number");
    }
    const char* text = scalar_text(node);
    char* end;
    double v = strtod(text, &end);
    if (*end != 0 || end == text || strpbrk(text, "xXnN"))
        return wrong_kind(r, node, f->key, "a number");
    OM_CHECK(isfinite(v), OM_INVALID, "%s:%zu: %s: %s is too large", r->name, line_of(node), f->key,
             text);
    bool has_range = f->min != 0.0 || f->max != 0.0;
    OM_CHECK(!has_range || (v >= f->min && v <= f->max), OM_INVALID,
             "%s:%zu: %s: %s is outside its range, %g to %g", r->name, line_of(node), f->key, text,
             f->min, f->max);
    *out = v;
    return OM_OK;
}

static OmStatus read_enum(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                          int* out) {
    if (node->type != YAML_SCALAR_NODE) return wrong_kind(r, node, f->key, "a word");
    int count = 0;
    for (; f->name[count]; ++count) {
        if (strcmp(f->name[count], scalar_text(node)) == 0) {
            *out = count;
            return OM_OK;
        }
    }
    char valid[256] = "";
    for (int i = 0; i < count; ++i) {
        size_t used = strlen(valid);
        snprintf(valid + used, sizeof valid - used, "%s%s", i ? ", " : "", f->name[i]);
    }
    return om_error(OM_INVALID, "%s:%zu: %s: \"%.60s\" is none of %s", r->name, line_of(node),
                    f->key, scalar_text(node), valid);
}

static OmStatus read_bool(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                          bool* out) {
    const char* text = node->type == YAML_SCALAR_NODE ? scalar_text(node) : "";
    bool is_true = strcmp(text, "true") == 0 || strcmp(text, "yes") == 0;
    bool is_false = strcmp(text, "false") == 0 || strcmp(text, "no") == 0;
    if (!is_true && !is_false) return wrong_kind(r, node, f->key, "true or false");
    *out = is_true;
    return OM_OK;
}

static OmStatus read_string(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                            char* out) {
    if (node->type != YAML_SCALAR_NODE) return wrong_kind(r, node, f->key, "a text");
    size_t len = node->data.scalar.length;
    OM_CHECK(len < f->size, OM_INVALID, "%s:%zu: %s: %zu letters, at most %zu", r->name,
             line_of(node), f->key, len, f->size - 1);
    OM_CHECK(strlen(scalar_text(node)) == len, OM_INVALID, "%s:%zu: %s: has a zero byte", r->name,
             line_of(node), f->key);
    OM_CHECK(om_text_is_plain(scalar_text(node), len, f->has_lines ? "\n\t" : NULL), OM_INVALID,
             "%s:%zu: %s: has a control character", r->name, line_of(node), f->key);
    memcpy(out, scalar_text(node), len + 1);
    return OM_OK;
}

// A list of `want` numbers, in SI.
static OmStatus read_numbers(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                             int want, double* out) {
    char kind[40];
    snprintf(kind, sizeof kind, "a list of %d numbers", want);
    if (node->type != YAML_SEQUENCE_NODE) return wrong_kind(r, node, f->key, kind);
    yaml_node_item_t* item = node->data.sequence.items.start;
    long count = node->data.sequence.items.top - item;
    OM_CHECK(count == want, OM_INVALID, "%s:%zu: %s: has %ld numbers, %d are wanted", r->name,
             line_of(node), f->key, count, want);
    for (int i = 0; i < want; ++i) {
        OM_TRY(read_number(r, yaml_document_get_node(r->doc, item[i]), f, &out[i]));
        out[i] *= f->scale != 0.0 ? f->scale : 1.0;
    }
    return OM_OK;
}

static OmStatus read_vec3(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                          OmVec3* out) {
    double v[3];
    OM_TRY(read_numbers(r, node, f, 3, v));
    *out = om_vec3(v[0], v[1], v[2]);
    return OM_OK;
}

static OmStatus read_list(const Reader* r, const yaml_node_t* node, const OmYamlField* f,
                          void* out) {
    if (node->type != YAML_SEQUENCE_NODE) return wrong_kind(r, node, f->key, "a list");
    yaml_node_item_t* item = node->data.sequence.items.start;
    long count = node->data.sequence.items.top - item;
    OM_CHECK(count <= f->capacity, OM_INVALID, "%s:%zu: %s: has %ld items, at most %d", r->name,
             line_of(node), f->key, count, f->capacity);
    for (long i = 0; i < count; ++i) {
        char* target = (char*)out + f->offset + (size_t)i * f->size;
        memset(target, 0, f->size);
        if (f->sub->set_default) f->sub->set_default(target);
        OM_TRY(read_mapping(r, yaml_document_get_node(r->doc, item[i]), f->sub, target));
    }
    memcpy((char*)out + f->count_offset, &(int){(int)count}, sizeof(int));
    return OM_OK;
}

static OmStatus read_field(const Reader* r, yaml_node_t* node, const OmYamlField* f, void* out) {
    void* target = (char*)out + f->offset;
    double number;
    switch (f->kind) {
    case OM_YAML_DOUBLE:
        OM_TRY(read_number(r, node, f, &number));
        *(double*)target = number * (f->scale != 0.0 ? f->scale : 1.0);
        return OM_OK;
    case OM_YAML_INT:
        OM_TRY(read_number(r, node, f, &number));
        OM_CHECK(number == floor(number) && fabs(number) <= 2147483647.0, OM_INVALID,
                 "%s:%zu: %s: %s is not a whole number", r->name, line_of(node), f->key,
                 scalar_text(node));
        *(int*)target = (int)number;
        return OM_OK;
    case OM_YAML_BOOL: return read_bool(r, node, f, target);
    case OM_YAML_STRING: return read_string(r, node, f, target);
    case OM_YAML_VEC3: return read_vec3(r, node, f, target);
    case OM_YAML_NUMBERS: return read_numbers(r, node, f, f->capacity, target);
    case OM_YAML_ENUM: return read_enum(r, node, f, target);
    case OM_YAML_STRUCT: return read_mapping(r, node, f->sub, target);
    case OM_YAML_LIST: return read_list(r, node, f, out);
    }
    return OM_OK;
}

static OmStatus unknown_key(const Reader* r, const yaml_node_t* key, const OmYamlSchema* schema) {
    for (const char* const* old = schema->renamed; old && *old; old += 2)
        OM_CHECK(strcmp(old[0], scalar_text(key)) != 0, OM_INVALID,
                 "%s:%zu: %s: key \"%s\" is now \"%s\"", r->name, line_of(key), schema->title,
                 old[0], old[1]);
    for (const char* const* old = schema->removed; old && *old; old += 2)
        OM_CHECK(strcmp(old[0], scalar_text(key)) != 0, OM_INVALID,
                 "%s:%zu: %s: %s is gone: %s; delete the line", r->name, line_of(key),
                 schema->title, old[0], old[1]);
    const char* word[MAX_KEYS];
    for (int i = 0; i < schema->nfield; ++i) word[i] = schema->field[i].key;
    const char* nearest = om_nearest_word(scalar_text(key), word, schema->nfield);
    if (nearest) {
        return om_error(OM_INVALID, "%s:%zu: %s: unknown key \"%.60s\"; did you mean \"%s\"?",
                        r->name, line_of(key), schema->title, scalar_text(key), nearest);
    }
    char valid[512] = "";
    for (int i = 0; i < schema->nfield; ++i) {
        size_t used = strlen(valid);
        snprintf(valid + used, sizeof valid - used, "%s%s", i ? ", " : "", word[i]);
    }
    return om_error(OM_INVALID, "%s:%zu: %s: unknown key \"%.60s\"; valid keys: %s", r->name,
                    line_of(key), schema->title, scalar_text(key), valid);
}

static OmStatus read_mapping(const Reader* r, yaml_node_t* node, const OmYamlSchema* schema,
                             void* out) {
    OM_ASSERT(schema->nfield <= MAX_KEYS);
    if (node->type != YAML_MAPPING_NODE)
        return wrong_kind(r, node, schema->title, "a mapping of keys");
    if (schema->line_offset)
        memcpy((char*)out + schema->line_offset, &(int){(int)line_of(node)}, sizeof(int));
    bool is_seen[MAX_KEYS] = {false};
    for (yaml_node_pair_t* p = node->data.mapping.pairs.start; p < node->data.mapping.pairs.top;
         ++p) {
        yaml_node_t* key = yaml_document_get_node(r->doc, p->key);
        if (key->type != YAML_SCALAR_NODE) return wrong_kind(r, key, schema->title, "a key");
        int i = 0;
        while (i < schema->nfield && strcmp(schema->field[i].key, scalar_text(key)) != 0) ++i;
        if (i == schema->nfield) return unknown_key(r, key, schema);
        OM_CHECK(!is_seen[i], OM_INVALID, "%s:%zu: %s: \"%s\" is given twice", r->name,
                 line_of(key), schema->title, schema->field[i].key);
        is_seen[i] = true;
        OM_TRY(read_field(r, yaml_document_get_node(r->doc, p->value), &schema->field[i], out));
    }
    for (int i = 0; i < schema->nfield; ++i) {
        OM_CHECK(is_seen[i] || !schema->field[i].is_required, OM_INVALID,
                 "%s:%zu: %s: \"%s\" is missing", r->name, line_of(node), schema->title,
                 schema->field[i].key);
    }
    return OM_OK;
}

static OmStatus not_yaml(const yaml_parser_t* parser, const char* name) {
    if (parser->error == YAML_MEMORY_ERROR)
        return om_error(OM_NO_MEMORY, "%s: out of memory", name);
    // libyaml gives the byte here, not the line
    bool is_bytes = parser->error == YAML_READER_ERROR;
    if (is_bytes)
        return om_error(OM_INVALID, "%s: byte %zu: not valid YAML: %s", name,
                        parser->problem_offset, parser->problem);
    return om_error(OM_INVALID, "%s:%zu: not valid YAML: %s", name, parser->problem_mark.line + 1,
                    parser->problem ? parser->problem : "unreadable");
}

// libyaml's time grows as the square of the depth, and its memory by 100 bytes a value: 2 MB of "[" took minutes.
// So the events of the first document are counted before it is built; schemas are neither as deep nor as long.
static OmStatus check_shape(const char* text, size_t size, const char* name) {
    yaml_parser_t parser;
    OM_CHECK(yaml_parser_initialize(&parser), OM_NO_MEMORY, "%s: out of memory", name);
    yaml_parser_set_input_string(&parser, (const unsigned char*)text, size);
    OmStatus status = OM_OK;
    int depth = 0, count = 0;
    for (bool is_done = false; !is_done && status == OM_OK;) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            status = not_yaml(&parser, name);
            break;
        }
        yaml_event_type_t type = event.type;
        size_t line = event.start_mark.line + 1;
        yaml_event_delete(&event);
        is_done = type == YAML_DOCUMENT_END_EVENT || type == YAML_STREAM_END_EVENT;
        if (type == YAML_SEQUENCE_START_EVENT || type == YAML_MAPPING_START_EVENT) ++depth;
        if (type == YAML_SEQUENCE_END_EVENT || type == YAML_MAPPING_END_EVENT) --depth;
        if (depth > MAX_DEPTH)
            status = om_error(OM_INVALID,
                              "%s:%zu: lists and mappings inside each other more than %d "
                              "deep",
                              name, line, MAX_DEPTH);
        if (++count > MAX_EVENT)
            status = om_error(OM_INVALID, "%s:%zu: more than %d values", name, line, MAX_EVENT);
    }
    yaml_parser_delete(&parser);
    return status;
}

OmStatus om_yaml_parse(const char* text, size_t size, const char* name, const OmYamlSchema* schema,
                       void* out) {
    OM_TRY(check_shape(text, size, name));
    yaml_parser_t parser;
    OM_CHECK(yaml_parser_initialize(&parser), OM_NO_MEMORY, "%s: out of memory", name);
    yaml_parser_set_input_string(&parser, (const unsigned char*)text, size);
    yaml_document_t doc;
    OmStatus status;
    if (!yaml_parser_load(&parser, &doc)) {
        status = not_yaml(&parser, name);
        yaml_parser_delete(&parser);
        return status;
    }
    Reader r = {&doc, name};
    yaml_node_t* root = yaml_document_get_root_node(&doc);
    status = root ? read_mapping(&r, root, schema, out)
                  : om_error(OM_INVALID, "%s: is empty; a %s is wanted", name, schema->title);
    yaml_document_delete(&doc);
    yaml_parser_delete(&parser);
    return status;
}

OmStatus om_yaml_load(const char* path, const OmYamlSchema* schema, void* out) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_FILE_SIZE, &text, &size));
    OmStatus status = om_yaml_parse(text, size, path, schema, out);
    om_free(text);
    return status;
}
