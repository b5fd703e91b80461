// retract_belief.c: the belief of a robot as files, so that a replay needs no truth to make the twin.
//
// A scene says what the twin believes by its difference from the truth ("0.4 of its attachments"): only the truth's
// side can build the twin's site. So the site itself is written, and the scene without the truth.
#define _GNU_SOURCE  // realpath
#include "retract/retract_belief.h"

#include <stdlib.h>
#include <string.h>

#include "omentum/nn_store.h"

#define KIND "omentum belief"
#define FORMAT 1
#define MAX_FILE ((size_t)4 << 30)  // bytes
#define MAX_COUNT 100000000         // of vertices, elements, nodes
#define MAX_SET 64

// ---- the scene ------------------------------------------------------------------------------------------------------

static void forget_truth(OmScene* s) {
    const OmScene none = om_scene_default();
    s->seed = none.seed;
    s->tissue.world_cells = none.tissue.world_cells;
    s->model = none.model;
    s->attach = none.attach;
    if (s->organ.deforms == OM_IN_TRUTH) s->organ = none.organ;
    if (s->tissue.self_contact == OM_IN_TRUTH) {
        s->tissue.self_contact = none.tissue.self_contact;
        s->tissue.self_thickness = none.tissue.self_thickness;
        s->tissue.self_friction = none.tissue.self_friction;
    }
    s->believed = none.believed;
    s->believed_roi = none.believed_roi;
    s->registration = none.registration;
    s->roi = none.roi;
    s->world = none.world;
}

// Does the folder `full` hold the folder `dir`?
static bool is_parent(const char* full, const char* dir) {
    char above[OM_SCENE_PATH];
    if (!dir || om_path_dir(dir, above, sizeof above) < 0) return false;
    char* parent = realpath(above, NULL);
    const bool is = parent && strcmp(parent, full) == 0;
    free(parent);
    return is;
}

OmStatus om__scene_print_whole(const OmScene* scene, bool has_truth, const char* out_dir,
                               OmText* text) {
    OmScene* copy = om_alloc(1, sizeof *copy);
    if (!copy) return OM_NO_MEMORY;
    *copy = *scene;
    copy->calibrated[0] = '\0';  // its values are in the scene
    if (!has_truth) forget_truth(copy);
    char* full = realpath(scene->data_root[0] ? scene->data_root : ".", NULL);
    if (full && strlen(full) < sizeof copy->data_root) strcpy(copy->data_root, full);
    // record and data may be moved together; the demo writes both under a temporary name
    if (full && is_parent(full, out_dir)) strcpy(copy->data_root, "..");
    free(full);
    OmStatus status = om_scene_print(copy, false, text);
    om_free(copy);
    return status;
}

// ---- the site, in both directions -----------------------------------------------------------------------------------

typedef struct Coder {
    OmStoreWriter* writer;  // null: reads
    OmStoreReader* reader;  // null: writes
} Coder;

static OmStatus code_values(Coder* c, const char* name, OmStoreType type, int n, void* value) {
    if (!c->writer) return om_store_get_value(c->reader, name, type, n, value);
    om_store_value(c->writer, name, type, n, value);
    return OM_OK;
}

static OmStatus code_count(Coder* c, const char* name, int* value, int most) {
    int32_t v = *value;
    OM_TRY(code_values(c, name, OM_STORE_I32, 1, &v));
    OM_CHECK(v >= 0 && v <= most, OM_INVALID, "%s is %d; 0 to %d", name, (int)v, most);
    *value = v;
    return OM_OK;
}

// An array of rows x columns; nothing is stored of an empty one. Reading allocates it.
static OmStatus code_array(Coder* c, const char* name, OmStoreType type, int rows, int columns,
                           void** array) {
    static const size_t size[OM_NSTORE] = {1, 2, 4, 8, 4, 8};
    const int dim[3] = {rows, columns, 0};
    if (rows == 0) return OM_OK;
    if (c->writer) {
        om_store_array(c->writer, name, type, dim, rows, NULL, *array);
        return OM_OK;
    }
    OM_TRY(om_store_check_array(c->reader, name, dim));
    *array = om_alloc((size_t)rows * (size_t)columns, size[type]);
    if (!*array) return OM_NO_MEMORY;
    return om_store_get_array(c->reader, name, type, dim, *array);
}

static OmStatus check_indices(const char* name, const int* index, size_t n, int end) {
    for (size_t i = 0; i < n; ++i)
        OM_CHECK(index[i] >= 0 && index[i] < end, OM_INVALID, "%s holds the index %d; below %d",
                 name, index[i], end);
    return OM_OK;
}

static OmStatus code_set(Coder* c, int i, int nvert, OmMeshSet* set) {
    char key[48];
    snprintf(key, sizeof key, "set%d_name", i);
    OM_TRY(code_values(c, key, OM_STORE_U8, OM_SET_NAME, set->name));
    OM_CHECK(memchr(set->name, '\0', OM_SET_NAME), OM_INVALID, "%s does not end", key);
    snprintf(key, sizeof key, "set%d_count", i);
    OM_TRY(code_count(c, key, &set->nvert, nvert));
    snprintf(key, sizeof key, "set%d_vert", i);
    OM_TRY(code_array(c, key, OM_STORE_I32, set->nvert, 1, (void**)&set->vert));
    return check_indices(key, set->vert, (size_t)set->nvert, nvert);
}

static OmStatus code_mesh(Coder* c, OmTetMesh* m) {
    int nset = m->nset;
    OM_TRY(code_count(c, "nvert", &m->nvert, MAX_COUNT));
    OM_TRY(code_count(c, "ntet", &m->ntet, MAX_COUNT));
    OM_TRY(code_count(c, "nset", &nset, MAX_SET));
    OM_TRY(code_array(c, "x", OM_STORE_F64, m->nvert, 3, (void**)&m->x));
    OM_TRY(code_array(c, "tet_vert", OM_STORE_I32, m->ntet, 4, (void**)&m->tet_vert));
    OM_TRY(code_array(c, "tet_label", OM_STORE_I32, m->ntet, 1, (void**)&m->tet_label));
    OM_TRY(check_indices("tet_vert", m->tet_vert, 4 * (size_t)m->ntet, m->nvert));
    if (!c->writer) {
        m->set = om_calloc((size_t)nset + 1, sizeof *m->set);
        if (!m->set) return OM_NO_MEMORY;
        m->nset = nset;
    }
    for (int i = 0; i < nset; ++i) OM_TRY(code_set(c, i, m->nvert, &m->set[i]));
    return OM_OK;
}

static OmStatus code_surface(Coder* c, const char* name, OmSurface* s) {
    char key[48];
    snprintf(key, sizeof key, "%s_nvert", name);
    OM_TRY(code_count(c, key, &s->nvert, MAX_COUNT));
    snprintf(key, sizeof key, "%s_ntri", name);
    OM_TRY(code_count(c, key, &s->ntri, MAX_COUNT));
    snprintf(key, sizeof key, "%s_x", name);
    OM_TRY(code_array(c, key, OM_STORE_F64, s->nvert, 3, (void**)&s->x));
    snprintf(key, sizeof key, "%s_tri", name);
    OM_TRY(code_array(c, key, OM_STORE_I32, s->ntri, 3, (void**)&s->tri_vert));
    return check_indices(key, s->tri_vert, 3 * (size_t)s->ntri, s->nvert);
}

static OmStatus code_organ(Coder* c, OmSite* s) {
    OmSdf* f = &s->organ_sdf;
    int32_t dim[3] = {f->grid.dim[0], f->grid.dim[1], f->grid.dim[2]};
    double at[4] = {f->grid.spacing, f->grid.origin.x, f->grid.origin.y, f->grid.origin.z};
    int has_organ = s->has_organ;
    OM_TRY(code_count(c, "has_organ", &has_organ, 1));
    s->has_organ = has_organ;
    OM_TRY(code_surface(c, "organ", &s->organ));
    OM_TRY(code_surface(c, "roi", &s->roi));
    OM_TRY(code_values(c, "sdf_dim", OM_STORE_I32, 3, dim));
    OM_TRY(code_values(c, "sdf_grid", OM_STORE_F64, 4, at));
    int64_t n = 1;
    for (int k = 0; k < 3; ++k) {
        OM_CHECK(dim[k] >= 0 && dim[k] <= 10000, OM_INVALID, "sdf_dim is %d", (int)dim[k]);
        n *= dim[k];
        f->grid.dim[k] = dim[k];
    }
    OM_CHECK(n <= MAX_COUNT && (n == 0 || at[0] > 0), OM_INVALID, "the organ has %lld nodes",
             (long long)n);
    f->grid.spacing = at[0];
    f->grid.origin = om_load3(at + 1, 0);
    return code_array(c, "sdf", OM_STORE_F32, (int)n, 1, (void**)&f->d);
}

// Poses and numbers of the site, as one array of doubles.
enum { NNUMBER = 28 };

static void put_pose(double* n, OmPose p) {
    om_store3(n, 0, p.p);
    n[3] = p.q.w, n[4] = p.q.x, n[5] = p.q.y, n[6] = p.q.z;
}

static OmPose get_pose(const double* n) {
    return (OmPose){om_load3(n, 0), {.w = n[3], .x = n[4], .y = n[5], .z = n[6]}};
}

static OmStatus code_numbers(Coder* c, OmSite* s) {
    double n[NNUMBER] = {s->attach_stiffness, s->attach_foundation, s->young, s->density,
                         s->poisson};
    put_pose(n + 5, s->pose_world_task);
    put_pose(n + 12, s->pose_world_field);
    om_store3(n + 19, 0, s->half_size);
    om_store3(n + 22, 0, s->roi_center);
    om_store3(n + 25, 0, s->gravity);
    OM_TRY(code_values(c, "numbers", OM_STORE_F64, NNUMBER, n));
    s->attach_stiffness = n[0], s->attach_foundation = n[1];
    s->young = n[2], s->density = n[3], s->poisson = n[4];
    s->pose_world_task = get_pose(n + 5);
    s->pose_world_field = get_pose(n + 12);
    s->half_size = om_load3(n + 19, 0);
    s->roi_center = om_load3(n + 22, 0);
    s->gravity = om_load3(n + 25, 0);
    return OM_OK;
}

static OmStatus code_materials(Coder* c, OmSite* s) {
    OM_TRY(code_count(c, "nmaterial", &s->nmaterial, OM_SITE_MATERIALS));
    for (int i = 0; i < s->nmaterial; ++i) {
        OmSiteMaterial* m = &s->material[i];
        char key[48];
        double n[3] = {m->young, m->poisson, m->density};
        snprintf(key, sizeof key, "material%d_name", i);
        OM_TRY(code_values(c, key, OM_STORE_U8, (int)sizeof m->name, m->name));
        OM_CHECK(memchr(m->name, '\0', sizeof m->name), OM_INVALID, "%s does not end", key);
        snprintf(key, sizeof key, "material%d", i);
        OM_TRY(code_values(c, key, OM_STORE_F64, 3, n));
        m->young = n[0], m->poisson = n[1], m->density = n[2];
    }
    return OM_OK;
}

static OmStatus code_site(Coder* c, OmSite* s) {
    int has_ground = s->has_ground, narea = 0, nspring = 0;
    const OmMeshSet* held = c->writer ? om_tet_mesh_find_set(&s->mesh, "attachment") : NULL;
    if (held && s->attach_area) narea = held->nvert;
    if (held && s->attach_spring) nspring = held->nvert;
    OM_TRY(code_count(c, "has_ground", &has_ground, 1));
    s->has_ground = has_ground;
    OM_TRY(code_mesh(c, &s->mesh));
    OM_TRY(code_numbers(c, s));
    OM_TRY(code_organ(c, s));
    OM_TRY(code_count(c, "narea", &narea, s->mesh.nvert));
    OM_TRY(code_count(c, "nspring", &nspring, s->mesh.nvert));
    OM_TRY(code_array(c, "attach_area", OM_STORE_F64, narea, 1, (void**)&s->attach_area));
    OM_TRY(code_array(c, "attach_spring", OM_STORE_F64, nspring, 1, (void**)&s->attach_spring));
    if (!c->writer) {
        held = om_tet_mesh_find_set(&s->mesh, "attachment");
        const int n = held ? held->nvert : 0;
        OM_CHECK((narea == 0 || narea == n) && (nspring == 0 || nspring == n), OM_INVALID,
                 "%d attached vertices have %d areas and %d springs", n, narea, nspring);
    }
    OM_TRY(code_count(c, "nroi", &s->nroi, MAX_COUNT));
    OM_TRY(code_array(c, "roi_points", OM_STORE_F64, s->nroi, 3, (void**)&s->roi_x));
    OM_TRY(code_array(c, "roi_normals", OM_STORE_F64, s->nroi, 3, (void**)&s->roi_n));
    return code_materials(c, s);
}

OmStatus om__belief_save(const OmSite* site, const char* path) {
    Coder c = {.writer = NULL};
    OmSite copy = *site;  // its arrays are only read
    OM_TRY(om_store_begin(KIND, FORMAT, &c.writer));
    OmStatus status = code_site(&c, &copy);
    if (status == OM_OK) return om_store_save(c.writer, path);
    om_store_abort(c.writer);
    return status;
}

OmStatus om__belief_load(const char* path, OmSite* site) {
    Coder c = {.writer = NULL};
    char* data = NULL;
    size_t size;
    memset(site, 0, sizeof *site);
    OM_TRY(om_file_read(path, MAX_FILE, &data, &size));
    OmStatus status = om_store_open(data, size, KIND, FORMAT, path, &c.reader);
    if (status == OM_OK) {
        status = code_site(&c, site);
        if (status < 0) om_error_prefix(status, "%s", path);
        om_store_close(c.reader);
    }
    om_free(data);
    site->role = OM_SITE_TWIN;
    if (status < 0) om_site_done(site);
    return status;
}
