/// omentum/scene_yaml.h: settings files read against a schema (room `scene`, floor 4).
///
/// A schema is a table of fields: key, kind, where the value goes, range, and the factor that turns the
/// file's unit (told by the key: `thickness_mm`) into SI. Whatever the table does not know is an error
/// that names file, line, key and the nearest valid key. Fill the struct with defaults, then load.
///
///     static const OmYamlField field[] = {
///         {"young", OM_YAML_DOUBLE, offsetof(Tissue, young), .min = 1, .max = 1e9},
///         {"size_mm", OM_YAML_VEC3, offsetof(Tissue, size), .scale = 1e-3},
///     };
///     static const OmYamlSchema schema = {"tissue", field, 2};
///     Tissue t = {.young = 3000};
///     OmStatus status = om_yaml_load("tissue.yaml", &schema, &t);
#ifndef OMENTUM_SCENE_YAML_H
#define OMENTUM_SCENE_YAML_H

#include "omentum/base.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmYamlKind {
    OM_YAML_DOUBLE,   // double
    OM_YAML_INT,      // int
    OM_YAML_BOOL,     // bool
    OM_YAML_STRING,   // char[size]
    OM_YAML_VEC3,     // OmVec3, a list of three numbers
    OM_YAML_NUMBERS,  // double[capacity], a list of so many numbers
    OM_YAML_ENUM,     // int, the index into `name`
    OM_YAML_STRUCT,   // a mapping read by `sub`
    OM_YAML_LIST  // a list of mappings read by `sub` into an array; its length goes to count_offset
} OmYamlKind;

struct OmYamlSchema;

typedef struct OmYamlField {
    const char* key;
    OmYamlKind kind;
    size_t offset;    // of the member in the struct that is filled
    double min, max;  // inclusive range in the file's unit; both 0: any finite number
    double scale;     // file unit to SI; 0 means 1
    size_t size;      // bytes of a string, or of one list item
    const struct OmYamlSchema* sub;  // of a struct or of list items
    const char* const* name;         // of an enum, ended by null
    size_t count_offset;             // of the int that receives a list's length
    int capacity;                    // most items of a list; count of numbers
    // of a text: line ends and tabs may stand in it; other control characters never
    bool has_lines;
    bool is_required;
    // bits for the schema's owner, who prints the keys of a group; 0: of all groups
    unsigned group;
    const char* unit;  // of the number in the file; null: none
    const char* help;  // its meaning in one line, for people; null: none
} OmYamlField;

typedef struct OmYamlSchema {
    const char* title;  // for messages: "scene", "material"
    const OmYamlField* field;
    int nfield;
    /// Called on each list item before it is read, to set defaults; may be null.
    void (*set_default)(void* item);
    /// Former names of keys: former, present, ..., ended by null; may be null. A former name is an error that tells the
    /// present one.
    const char* const* renamed;
    /// Keys that have gone: key, what stands in for it, ..., ended by null; may be null. Such a key is an error that
    /// gives the reason and says to delete the line.
    const char* const* removed;
    size_t line_offset;  // of an int that receives the line of the mapping; 0: none
} OmYamlSchema;

/// Fill `out` from a file. OM_INVALID names file, line, key and remedy; `out` is then undefined.
/// @return OM_OK; OM_INVALID (the message names line, key and remedy); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_yaml_load(const char* path, const OmYamlSchema* schema, void* out);
/// The same from memory; `name` stands for the file in messages.
/// @return OM_OK; OM_INVALID (the message names line, key and remedy); OM_NO_MEMORY
OM_API OmStatus om_yaml_parse(const char* text, size_t size, const char* name,
                              const OmYamlSchema* schema, void* out);

/// Have both structs the same value in this field (of a struct: in all of its fields)?
OM_API bool om_yaml_is_equal(const OmYamlField* field, const void* a, const void* b);

typedef struct OmYamlPrint {
    unsigned group;     // fields whose group has none of these bits are left out; 0: none is
    bool is_commented;  // unit, range and meaning behind each value
    bool shows_others;  // fields left out are printed as comments
} OmYamlPrint;
/// Append a struct as YAML. Read again by om_yaml_parse, every number that was read from a file has
/// the same bits. A number outside of its
/// range stands for "not given" and becomes a comment.
/// @return OM_OK; OM_INVALID (the schema has a list: those are not printed); OM_NO_MEMORY
OM_API OmStatus om_yaml_print(const OmYamlSchema* schema, const void* value,
                              const OmYamlPrint* options, OmText* text);
/// Append a Markdown table of a schema's keys, without those of its structs: unit, range, default, meaning.
/// @param plain  the struct with its defaults
/// @param group  names of the bits of OmYamlField.group, ended by null; null: no column for them
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_yaml_print_keys(const OmYamlSchema* schema, const void* plain,
                                   const char* const* group, OmText* text);

#ifdef __cplusplus
}
#endif
#endif
