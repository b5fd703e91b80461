// shape_file_msh.c: reading Gmsh's .msh: versions 1, 2 and 4.1, text and binary.
//
// A file is a list of sections $Name ... $EndName; other sections are ignored. Nodes and elements
// have numbers of their own, in any order and with gaps, so nodes are found through a sorted table
// unless they are numbered 1, 2, 3 ... A physical group is a number on elements (version 1, 2: on
// each element; 4.1: on the entity that its block belongs to) and may have a name.
// Text and binary files have the same fields: read_int32, read_size and read_real handle both.
//
// Reference: Gmsh reference manual, "MSH file format", and its legacy versions 1 and 2.
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "shape/shape_file_internal.h"

#define MAX_NODE 125     // of an element
#define MAX_PHYSICAL 64  // largest number of groups read for one entity

typedef struct Node {
    int64_t tag;
    int index;
} Node;

typedef struct Group {  // a named physical group
    int dim, tag, set;
} Group;

typedef struct Belongs {  // entity (dim, tag) is in this physical group
    int dim, entity, physical;
} Belongs;

typedef struct Msh {
    OmScan s;
    OmFileMesh* m;
    int version;  // 1, 2, 4
    bool is_binary, is_swapped, is_sorted, is_dense;
    Node* node;
    int nnode, nodecap;
    Group* group;
    int ngroup, groupcap;
    Belongs* belongs;
    int nbelongs, belongscap;
} Msh;

// The values common to all elements of a block.
typedef struct Kind {
    int type, nnode, dim;
    int64_t label;
    int set[MAX_PHYSICAL], nset;
} Kind;

// ---- fields -----------------------------------------------------------------------------------------

static OmStatus read_integer(Msh* r, OmValueType type, const char* what, int64_t* v) {
    if (!r->is_binary) return om__read_int(&r->s, what, INT64_MIN, INT64_MAX, v);
    const unsigned char* bytes = om__read_bytes(&r->s, what, om__value_size(type));
    if (!bytes) return OM_INVALID;
    *v = om__load_integer(type, bytes, r->is_swapped);
    return OM_OK;
}

static OmStatus read_int32(Msh* r, const char* what, int* v) {
    int64_t wide;
    *v = 0;
    OM_TRY(read_integer(r, OM_VALUE_I32, what, &wide));
    if (wide < INT_MIN || wide > INT_MAX)
        return om__scan_error(&r->s, "%s: %lld is too large", what, (long long)wide);
    *v = (int)wide;
    return OM_OK;
}

static OmStatus read_size(Msh* r, const char* what, int64_t* v) {
    return read_integer(r, OM_VALUE_U64, what, v);
}

static OmStatus read_real(Msh* r, const char* what, double* v) {
    if (!r->is_binary) return om__read_double(&r->s, what, v);
    const unsigned char* bytes = om__read_bytes(&r->s, what, 8);
    if (!bytes) return OM_INVALID;
    *v = om__load_real(OM_VALUE_F64, bytes, r->is_swapped);
    return OM_OK;
}

// A count of items, each of which needs at least `min_text` or `min_binary` bytes of the file.
static OmStatus read_number(Msh* r, const char* what, size_t min_text, size_t min_binary,
                            int64_t* count) {
    OM_TRY(read_size(r, what, count));
    return om__check_count(&r->s, what, *count, r->is_binary ? min_binary : min_text);
}

static int shown(OmWord w) { return w.len < 40 ? (int)w.len : 40; }

static OmStatus expect_end(Msh* r, const char* end) {
    OmWord w = om__read_word(&r->s);
    if (om__is_word(w, end)) return OM_OK;
    if (r->is_binary) {
        return om_error(OM_INVALID, "byte %zu: \"%s\" is wanted", (size_t)(w.str - r->s.start),
                        end);
    }
    return om__scan_error(&r->s, "\"%s\" is wanted, not \"%.*s\"", end, shown(w), w.str);
}

// ---- nodes ------------------------------------------------------------------------------------------

static OmStatus add_node(Msh* r, int64_t tag, const double x[3]) {
    OM_TRY(om__grow(&r->node, &r->nodecap, (int64_t)r->nnode + 1, sizeof *r->node));
    r->is_dense = (r->nnode == 0 || r->is_dense) && tag == r->nnode + 1;
    r->node[r->nnode] = (Node){tag, r->nnode};
    r->nnode++;
    r->is_sorted = false;
    return om__add_vert(r->m, x);
}

static OmStatus read_point(Msh* r, double x[3]) {
    for (int c = 0; c < 3; c++) {
        OM_TRY(read_real(r, "a coordinate", &x[c]));
        OM_CHECK(isfinite(x[c]), OM_INVALID, "node %d: a coordinate is not finite", r->nnode + 1);
    }
    return OM_OK;
}

// Versions 1 and 2: the count is text, also in a binary file.
static OmStatus read_nodes2(Msh* r) {
    int count, tag;
    double x[3];
    OM_TRY(om__read_count(&r->s, "the number of nodes", r->is_binary ? 28 : 8, &count));
    om__skip_line(&r->s);
    for (int i = 0; i < count; i++) {
        OM_TRY(read_int32(r, "the number of a node", &tag));
        OM_TRY(read_point(r, x));
        OM_TRY(add_node(r, tag, x));
    }
    return OM_OK;
}

static OmStatus read_node_block(Msh* r) {
    int dim, entity, is_parametric, first = r->nnode;
    int64_t count, tag;
    double x[3], parameter;
    OM_TRY(read_int32(r, "the dimension of an entity", &dim));
    OM_TRY(read_int32(r, "the number of an entity", &entity));
    OM_TRY(read_int32(r, "the flag of parameters", &is_parametric));
    OM_TRY(read_number(r, "the nodes of a block", 8, 32, &count));
    OM_CHECK(dim >= 0 && dim <= 3 && is_parametric >= 0 && is_parametric <= 1, OM_INVALID,
             "a block of nodes of dimension %d with flag %d", dim, is_parametric);
    for (int64_t i = 0; i < count; i++) {
        OM_TRY(read_size(r, "the number of a node", &tag));
        OM_TRY(add_node(r, tag, (const double[3]){0, 0, 0}));
    }
    for (int64_t i = 0; i < count; i++) {
        OM_TRY(read_point(r, x));
        memcpy(r->m->x + 3 * (size_t)(first + i), x, sizeof x);
        for (int c = 0; is_parametric && c < dim; c++)
            OM_TRY(read_real(r, "a parameter", &parameter));
    }
    return OM_OK;
}

static OmStatus read_nodes4(Msh* r) {
    int64_t nblock, skipped;
    OM_TRY(read_number(r, "the number of blocks", 8, 20, &nblock));
    for (int i = 0; i < 3; i++) OM_TRY(read_size(r, "the number of nodes", &skipped));
    for (int64_t i = 0; i < nblock; i++) OM_TRY(read_node_block(r));
    return OM_OK;
}

static int compare_nodes(const void* a, const void* b) {
    int64_t x = ((const Node*)a)->tag, y = ((const Node*)b)->tag;
    return (x > y) - (x < y);
}

static OmStatus sort_nodes(Msh* r) {
    if (r->is_sorted) return OM_OK;
    OM_CHECK(r->nnode > 0, OM_INVALID, "the elements come before the nodes");
    if (!r->is_dense) {
        qsort(r->node, (size_t)r->nnode, sizeof *r->node, compare_nodes);
        for (int i = 1; i < r->nnode; i++)
            OM_CHECK(r->node[i].tag != r->node[i - 1].tag, OM_INVALID, "node %lld occurs twice",
                     (long long)r->node[i].tag);
    }
    r->is_sorted = true;
    return OM_OK;
}

// The vertex of node `tag`, -1 if there is none.
static int find_node(const Msh* r, int64_t tag) {
    if (r->is_dense) return tag >= 1 && tag <= r->nnode ? (int)(tag - 1) : -1;
    Node key = {tag, 0};
    const Node* n = bsearch(&key, r->node, (size_t)r->nnode, sizeof key, compare_nodes);
    return n ? n->index : -1;
}

// ---- groups -----------------------------------------------------------------------------------------

// $PhysicalNames is text in every file: dimension, number, "name".
static OmStatus read_names(Msh* r) {
    int count;
    OM_TRY(om__read_count(&r->s, "the number of names", 6, &count));
    for (int i = 0; i < count; i++) {
        int64_t dim, tag;
        OM_TRY(om__read_int(&r->s, "the dimension of a group", 0, 3, &dim));
        OM_TRY(om__read_int(&r->s, "the number of a group", INT_MIN, INT_MAX, &tag));
        OmScan before = r->s;
        OmWord name = om__read_line(&r->s);
        if (name.len < 2 || name.str[0] != '"' || name.str[name.len - 1] != '"')
            return om__scan_error(&before, "the name of a group in quotes is wanted");
        int set;
        OmStatus status = om__file_set(r->m, name.str + 1, name.len - 2, &set);
        if (status < 0) return om_error_prefix(status, "line %d", om__scan_line(&before));
        OM_TRY(om__grow(&r->group, &r->groupcap, (int64_t)r->ngroup + 1, sizeof *r->group));
        r->group[r->ngroup++] = (Group){(int)dim, (int)tag, set};
    }
    return OM_OK;
}

static OmStatus read_entity(Msh* r, int dim) {
    int tag, physical;
    int64_t count;
    double skipped;
    OM_TRY(read_int32(r, "the number of an entity", &tag));
    for (int i = 0; i < (dim == 0 ? 3 : 6); i++)
        OM_TRY(read_real(r, "the box of an entity", &skipped));
    OM_TRY(read_number(r, "the groups of an entity", 2, 4, &count));
    for (int64_t i = 0; i < count; i++) {
        OM_TRY(read_int32(r, "the group of an entity", &physical));
        OM_TRY(om__grow(&r->belongs, &r->belongscap, (int64_t)r->nbelongs + 1, sizeof *r->belongs));
        r->belongs[r->nbelongs++] = (Belongs){dim, tag, physical};
    }
    if (dim == 0) return OM_OK;
    OM_TRY(read_number(r, "the border of an entity", 2, 4, &count));
    for (int64_t i = 0; i < count; i++) OM_TRY(read_int32(r, "the border of an entity", &tag));
    return OM_OK;
}

static OmStatus read_entities(Msh* r) {
    int64_t count[4];
    for (int dim = 0; dim < 4; dim++)
        OM_TRY(read_number(r, "the number of entities", 10, 36, &count[dim]));
    for (int dim = 0; dim < 4; dim++)
        for (int64_t i = 0; i < count[dim]; i++) OM_TRY(read_entity(r, dim));
    return OM_OK;
}

static void add_group(const Msh* r, Kind* k, int physical) {
    if (k->label == 0) k->label = physical;
    for (int i = 0; i < r->ngroup; i++) {
        const Group* g = &r->group[i];
        if (g->dim == k->dim && g->tag == physical && k->nset < MAX_PHYSICAL)
            k->set[k->nset++] = g->set;
    }
}

// ---- elements ---------------------------------------------------------------------------------------

static OmStatus set_type(Msh* r, int type, Kind* k) {
    static const unsigned char nnode[] = {0,  2,  3,  4,  4, 8, 6,  5,  3,  6, 9,
                                          10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10,
                                          12, 15, 15, 21, 4, 5, 6,  20, 35, 56};
    static const unsigned char dim[] = {0, 1, 2, 2, 3, 3, 3, 3, 1, 2, 2, 3, 3, 3, 3, 0,
                                        2, 3, 3, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 3, 3, 3};
    memset(k, 0, sizeof *k);
    if (type == 92 || type == 93) {  // hexahedra of order 3 and 4
        *k = (Kind){.type = type, .nnode = type == 92 ? 64 : 125, .dim = 3};
        return OM_OK;
    }
    if (type < 1 || type >= (int)sizeof nnode) {
        OM_CHECK(!r->is_binary, OM_INVALID, "elements of type %d are not known", type);
        return om__scan_error(&r->s, "elements of type %d are not known", type);
    }
    *k = (Kind){.type = type, .nnode = nnode[type], .dim = dim[type]};
    return OM_OK;
}

static OmStatus take_element(Msh* r, const Kind* k, int64_t tag, const int64_t* node) {
    static const unsigned char vtk_type[] = {0, 0, 5, 9, 10, 0, 0, 0, 0, 22, 0, 24};
    int vert[MAX_NODE];
    int type = k->type < (int)sizeof vtk_type ? vtk_type[k->type] : 0;
    bool is_tet;
    if (!type && k->nset == 0) return OM_OK;
    for (int i = 0; i < k->nnode; i++) {
        vert[i] = find_node(r, node[i]);
        OM_CHECK(vert[i] >= 0, OM_INVALID, "element %lld names node %lld, which does not exist",
                 (long long)tag, (long long)node[i]);
    }
    for (int s = 0; s < k->nset; s++)
        for (int i = 0; i < k->nnode; i++) OM_TRY(om__add_set_vert(r->m, k->set[s], vert[i]));
    if (type == 24) om__swap_edges_of_msh(vert);
    OM_TRY(om__add_vtk_cell(r->m, type, vert, k->nnode, &is_tet));
    return is_tet && k->label ? om__set_label(r->m, k->label) : OM_OK;
}

// Consecutive elements are mostly in the same groups: the last result is reused.
static OmStatus set_kind(Msh* r, int type, int physical, Kind* k) {
    if (k->nnode > 0 && k->type == type && k->label == physical) return OM_OK;
    OM_TRY(set_type(r, type, k));
    if (physical != 0) add_group(r, k, physical);
    return OM_OK;
}

static OmStatus read_nodes_of(Msh* r, OmValueType type, int count, int64_t* node) {
    for (int i = 0; i < count; i++)
        OM_TRY(read_integer(r, type, "the node of an element", &node[i]));
    return OM_OK;
}

// number, type, and: (1) group, entity, number of nodes (2) number of tags, tags; then the nodes
static OmStatus read_text_element(Msh* r, Kind* k) {
    int64_t node[MAX_NODE], ntag = 2;
    int tag, type, nnode = 0, physical = 0, skipped;
    OM_TRY(read_int32(r, "the number of an element", &tag));
    OM_TRY(read_int32(r, "the type of an element", &type));
    if (r->version == 2) OM_TRY(read_number(r, "the number of tags", 2, 4, &ntag));
    for (int64_t i = 0; i < ntag; i++)
        OM_TRY(read_int32(r, "the tag of an element", i == 0 ? &physical : &skipped));
    if (r->version == 1) OM_TRY(read_int32(r, "the number of nodes", &nnode));
    OM_TRY(set_kind(r, type, physical, k));
    if (r->version == 1 && nnode != k->nnode)
        return om__scan_error(&r->s, "element %d of type %d has %d nodes, %d are wanted", tag, type,
                              nnode, k->nnode);
    OM_TRY(read_nodes_of(r, OM_VALUE_I32, k->nnode, node));
    return take_element(r, k, tag, node);
}

// Version 2, binary: blocks of one type each, their headers type, number, tags of each.
static OmStatus read_binary_block(Msh* r, int64_t left, int64_t* count) {
    int type, num, ntag, tag, physical, skipped;
    int64_t node[MAX_NODE];
    Kind k = {0};
    OM_TRY(read_int32(r, "the type of a block", &type));
    OM_TRY(read_int32(r, "the elements of a block", &num));
    OM_TRY(read_int32(r, "the tags of a block", &ntag));
    OM_CHECK(num > 0 && num <= left && ntag >= 0, OM_INVALID,
             "a block of %d elements with %d tags, %lld elements are left", num, ntag,
             (long long)left);
    for (int i = 0; i < num; i++) {
        physical = 0;
        OM_TRY(read_int32(r, "the number of an element", &tag));
        for (int t = 0; t < ntag; t++)
            OM_TRY(read_int32(r, "the tag of an element", t == 0 ? &physical : &skipped));
        OM_TRY(set_kind(r, type, physical, &k));
        OM_TRY(read_nodes_of(r, OM_VALUE_I32, k.nnode, node));
        OM_TRY(take_element(r, &k, tag, node));
    }
    *count = num;
    return OM_OK;
}

static OmStatus read_elements2(Msh* r) {
    int count;
    Kind k = {0};
    OM_TRY(sort_nodes(r));
    OM_TRY(om__read_count(&r->s, "the number of elements", 8, &count));
    om__skip_line(&r->s);
    for (int64_t i = 0, n = 1; i < count; i += n) {
        if (r->is_binary)
            OM_TRY(read_binary_block(r, count - i, &n));
        else
            OM_TRY(read_text_element(r, &k));
    }
    return OM_OK;
}

static OmStatus read_element_block(Msh* r) {
    int dim, entity, type;
    int64_t count, tag, node[MAX_NODE];
    Kind k;
    OM_TRY(read_int32(r, "the dimension of an entity", &dim));
    OM_TRY(read_int32(r, "the number of an entity", &entity));
    OM_TRY(read_int32(r, "the type of a block", &type));
    OM_TRY(read_number(r, "the elements of a block", 4, 16, &count));
    OM_TRY(set_type(r, type, &k));
    for (int i = 0; i < r->nbelongs; i++) {
        const Belongs* b = &r->belongs[i];
        if (b->dim == k.dim && b->entity == entity) add_group(r, &k, b->physical);
    }
    for (int64_t i = 0; i < count; i++) {
        OM_TRY(read_size(r, "the number of an element", &tag));
        OM_TRY(read_nodes_of(r, OM_VALUE_U64, k.nnode, node));
        OM_TRY(take_element(r, &k, tag, node));
    }
    return OM_OK;
}

static OmStatus read_elements4(Msh* r) {
    int64_t nblock, skipped;
    OM_TRY(sort_nodes(r));
    OM_TRY(read_number(r, "the number of blocks", 8, 20, &nblock));
    for (int i = 0; i < 3; i++) OM_TRY(read_size(r, "the number of elements", &skipped));
    for (int64_t i = 0; i < nblock; i++) OM_TRY(read_element_block(r));
    return OM_OK;
}

// ---- the file ---------------------------------------------------------------------------------------

static OmStatus read_format(Msh* r) {
    double version;
    int64_t is_binary, size;
    OM_TRY(om__read_double(&r->s, "the version", &version));
    OM_TRY(om__read_int(&r->s, "the file type", 0, 1, &is_binary));
    OM_TRY(om__read_int(&r->s, "the size of a number", 1, 64, &size));
    r->version = version >= 2 && version < 3 ? 2 : fabs(version - 4.1) < 1e-9 ? 4 : 0;
    OM_CHECK(r->version, OM_INVALID, "version %g of the format is not read; save it as 4.1 or 2.2",
             version);
    OM_CHECK(size == 8 || !is_binary, OM_INVALID, "numbers of %lld bytes, 8 are read",
             (long long)size);
    r->is_binary = is_binary;
    if (r->is_binary) {
        om__skip_line(&r->s);
        const unsigned char* one = om__read_bytes(&r->s, "the order of bytes", 4);
        if (!one) return OM_INVALID;
        r->is_swapped = om__load_integer(OM_VALUE_I32, one, false) != 1;
        OM_CHECK(om__load_integer(OM_VALUE_I32, one, r->is_swapped) == 1, OM_INVALID,
                 "the order of bytes is not known: the number one is missing");
    }
    return OM_OK;
}

// Skip to the end of an unused section.
static OmStatus skip_section(Msh* r, OmWord name) {
    char end[72];
    OM_CHECK(name.len > 1 && name.len < 60, OM_INVALID, "a section \"%.*s\"", shown(name),
             name.str);
    int len = snprintf(end, sizeof end, "$End%.*s", (int)name.len - 1, name.str + 1);
    for (; om__scan_left(&r->s) >= (size_t)len; r->s.p++) {
        if (*r->s.p != '$' || memcmp(r->s.p, end, (size_t)len) != 0) continue;
        r->s.p += len;
        return OM_OK;
    }
    return om_error(OM_INVALID, "section %.*s has no end: the file is cut short", shown(name),
                    name.str);
}

typedef struct Section {
    const char *name, *end;
    int version;  // 0: any
    bool is_line_skipped;
    OmStatus (*read)(Msh*);
} Section;

static const Section section[] = {
    {"$MeshFormat", "$EndMeshFormat", 0, false, read_format},
    {"$PhysicalNames", "$EndPhysicalNames", 0, false, read_names},
    {"$NOD", "$ENDNOD", 1, false, read_nodes2},
    {"$ELM", "$ENDELM", 1, false, read_elements2},
    {"$Nodes", "$EndNodes", 2, false, read_nodes2},
    {"$Elements", "$EndElements", 2, false, read_elements2},
    {"$Entities", "$EndEntities", 4, true, read_entities},
    {"$Nodes", "$EndNodes", 4, true, read_nodes4},
    {"$Elements", "$EndElements", 4, true, read_elements4},
};

static OmStatus read_section(Msh* r, OmWord name) {
    if (om__is_word(name, "$NOD") && r->version == 0) r->version = 1;
    OM_CHECK(r->version || om__is_word(name, "$MeshFormat") || om__is_word(name, "$Comments"),
             OM_INVALID, "this is no Gmsh file: it does not begin with $MeshFormat or $NOD");
    for (size_t i = 0; i < sizeof section / sizeof section[0]; i++) {
        const Section* k = &section[i];
        if (!om__is_word(name, k->name) || (k->version && k->version != r->version)) continue;
        if (k->is_line_skipped) om__skip_line(&r->s);
        OmStatus status = k->read(r);
        if (status == OM_OK) status = expect_end(r, k->end);
        return status < 0 ? om_error_prefix(status, "%s", k->name) : status;
    }
    return skip_section(r, name);
}

OmStatus om__parse_msh(const char* data, size_t size, OmFileMesh* m) {
    Msh r = {.s = om__scan(data, size), .m = m};
    OmStatus status = OM_OK;
    while (status == OM_OK) {
        OmWord name = om__read_word(&r.s);
        if (name.len == 0) break;
        if (name.str[0] != '$')
            status = om_error(OM_INVALID, "line %d: a section is wanted, not \"%.*s\"",
                              om__scan_line(&r.s), shown(name), name.str);
        else
            status = read_section(&r, name);
    }
    if (status == OM_OK && r.version == 0)
        status = om_error(OM_INVALID, "this is no Gmsh file: it is empty");
    om_free(r.node);
    om_free(r.group);
    om_free(r.belongs);
    return status;
}
