// tissue_model.c: checks of definitions, lumped masses.
#include <stdio.h>
#include <string.h>

#include "tissue/tissue_internal.h"

#define TISSUE_COOKIE 0x7155e001u

OmTissueDef om_tissue_default_def(const OmTissueEngine* engine, const OmTetMesh* mesh) {
    OmTissueDef def = {.engine = engine,
                       .mesh = mesh,
                       .material_default = {.young = 3000, .poisson = 0.45},
                       .density = 1000,
                       .rayleigh_mass = 0.1,
                       .gravity = {0, 0, -9.81},
                       .max_newton = 1,
                       .newton_tolerance = 1e-3,
                       .max_work = 20000,
                       .element = engine && engine->has_quadratic ? OM_ELEMENT_QUADRATIC
                                                                  : OM_ELEMENT_LINEAR,
                       .solver = om_solver_default_def(),
                       .cookie = TISSUE_COOKIE};
    return def;
}

const char* om_tissue_element_name(OmTissueElement element) {
    switch (element) {
    case OM_ELEMENT_LINEAR: return "linear";
    case OM_ELEMENT_QUADRATIC: return "quadratic";
    case OM_ELEMENT_SHELL: return "shell";
    case OM_NTISSUE_ELEMENT: break;
    }
    return NULL;
}

static OmStatus check_def(const OmTissueDef* def) {
    OM_CHECK(def->cookie == TISSUE_COOKIE, OM_INVALID,
             "tissue: the definition was not made by om_tissue_default_def");
    OM_CHECK(def->mesh, OM_INVALID, "tissue: mesh is null");
    OM_CHECK(def->nmaterial >= 0 && (def->nmaterial == 0 || def->material), OM_INVALID,
             "tissue: nmaterial is %d but material is null or the count negative", def->nmaterial);
    for (int k = 0; k < def->nmaterial; ++k) {
        char field[32];
        snprintf(field, sizeof field, "tissue: material[%d]", k);
        OM_TRY(om_material_validate(&def->material[k], field));
    }
    if (def->nmaterial == 0)
        OM_TRY(om_material_validate(&def->material_default, "tissue: material_default"));
    for (int k = 0; def->material_density && k < def->nmaterial; ++k)
        OM_CHECK(def->material_density[k] > 0 && def->material_density[k] <= 1e6, OM_INVALID,
                 "tissue: material_density[%d] is %g kg/m^3; it must be above 0 and at most 1e6", k,
                 def->material_density[k]);
    OM_CHECK(def->density > 0 && def->density <= 1e6, OM_INVALID,
             "tissue: density is %g kg/m^3; it must be above 0 and at most 1e6", def->density);
    OM_CHECK(def->rayleigh_mass >= 0 && def->rayleigh_mass <= 1e6, OM_INVALID,
             "tissue: rayleigh_mass is %g 1/s; it must be from 0 to 1e6", def->rayleigh_mass);
    OM_CHECK(def->rayleigh_stiffness >= 0 && def->rayleigh_stiffness <= 1e3, OM_INVALID,
             "tissue: rayleigh_stiffness is %g s; it must be from 0 to 1000",
             def->rayleigh_stiffness);
    OM_CHECK(def->max_newton >= 1 && def->max_newton <= 1000, OM_INVALID,
             "tissue: max_newton is %d; it must be from 1 (one linearisation a step) to 1000",
             def->max_newton);
    OM_CHECK(def->max_work >= 1, OM_INVALID, "tissue: max_work is %d; it must be at least 1",
             def->max_work);
    OM_CHECK(def->newton_tolerance > 0 && def->newton_tolerance < 1, OM_INVALID,
             "tissue: newton_tolerance is %g; it must be in (0, 1)", def->newton_tolerance);
    OM_TRY(om__engine_check(def->engine));
    OM_CHECK((unsigned)def->element < OM_NTISSUE_ELEMENT, OM_INVALID,
             "tissue: element %d is none of the %d kinds", (int)def->element, OM_NTISSUE_ELEMENT);
    OM_CHECK(def->element == OM_ELEMENT_LINEAR || def->engine->has_quadratic, OM_INVALID,
             "tissue: element: engine \"%s\" has no %s elements", def->engine->name,
             om_tissue_element_name(def->element));
    OM_CHECK(
        !def->options || !def->input, OM_INVALID,
        "tissue: options and input are both given; the engine makes its options from the input");
    OM_CHECK(om_is_finite3(def->gravity) && om_norm(def->gravity) <= 1e4, OM_INVALID,
             "tissue: gravity (%g, %g, %g) m/s^2 must be finite and at most 1e4", def->gravity.x,
             def->gravity.y, def->gravity.z);
    OM_CHECK(def->attachment_stiffness >= 0 && def->attachment_stiffness <= OM__MAX_STIFFNESS,
             OM_INVALID,
             "tissue: attachment_stiffness is %g N/m; it must be from 0 (held still) to %g",
             def->attachment_stiffness, OM__MAX_STIFFNESS);
    return OM_OK;
}

// Particles: vertices without elements.
static OmStatus check_points(const OmTetMesh* mesh, const OmTissueEngine* engine) {
    OM_CHECK(engine->lump_mass, OM_INVALID,
             "tissue: mesh has no elements, and engine \"%s\" needs them", engine->name);
    OM_CHECK(mesh->nvert > 0, OM_INVALID, "tissue: mesh has no vertices");
    for (int i = 0; i < mesh->nvert; ++i)
        OM_CHECK(om_is_finite3(om_load3(mesh->x, i)), OM_INVALID, "tissue: vertex %d is not finite",
                 i);
    for (int k = 0; k < mesh->nset; ++k)
        for (int n = 0; n < mesh->set[k].nvert; ++n)
            OM_CHECK(mesh->set[k].vert[n] >= 0 && mesh->set[k].vert[n] < mesh->nvert, OM_INVALID,
                     "tissue: set \"%s\" names vertex %d of %d", mesh->set[k].name,
                     mesh->set[k].vert[n], mesh->nvert);
    return OM_OK;
}

static OmStatus check_mesh(const OmTetMesh* mesh, const OmTissueEngine* engine, int nmaterial) {
    if (mesh->ntet == 0) return check_points(mesh, engine);
    OM_TRY(om_tet_mesh_validate(mesh));
    for (int e = 0; nmaterial > 0 && e < mesh->ntet; ++e)
        OM_CHECK(mesh->tet_label[e] >= 0 && mesh->tet_label[e] < nmaterial, OM_INVALID,
                 "tissue: element %d has label %d, but material has %d entries", e,
                 mesh->tet_label[e], nmaterial);
    return OM_OK;
}

// Masses of the nodes of a quadratic tetrahedron over its own: the diagonal of the consistent matrix, scaled (Hinton,
// Rock and Zienkiewicz 1976). Row sums would be negative at the corners.
#define CORNER_MASS (1.0 / 36)
#define MID_MASS (4.0 / 27)

// A quarter of a tetrahedron's mass to each of its vertices; to each of the eight of a shell an eighth of each of its
// six. Of the eight that fill a quadratic element, which are of one size, the first stands for all.
static void add_mass(OmTissueModel* m, int tet, double mass) {
    if (!m->elem_node) {
        for (int k = 0; k < 4; ++k)
            m->mass[m->mesh.tet_vert[4 * (size_t)tet + (size_t)k]] += 0.25 * mass;
        return;
    }
    const int* node = m->elem_node + (size_t)m->nelem_node * (size_t)(tet / m->ntet_per);
    if (m->def.element == OM_ELEMENT_SHELL) {
        for (int k = 0; k < 8; ++k) m->mass[node[k]] += 0.125 * mass;
        return;
    }
    for (int k = 0; k < 10 && tet % 8 == 0; ++k)
        m->mass[node[k]] += 8 * mass * (k < 4 ? CORNER_MASS : MID_MASS);
}

static OmStatus lump_mass(OmTissueModel* m) {
    const OmTetMesh* mesh = &m->mesh;
    const double* by_label = m->def.nmaterial > 0 ? m->def.material_density : NULL;
    m->mass = om_calloc((size_t)mesh->nvert, sizeof(double));
    m->volume = om_alloc((size_t)mesh->ntet, sizeof(double));
    if (!m->mass || !m->volume) return OM_NO_MEMORY;
    if (mesh->ntet == 0) OM_TRY(m->engine->lump_mass(m, m->mass));
    for (int e = 0; e < mesh->ntet; ++e) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        OmVec3 o = om_load3(mesh->x, v[0]), a = om_sub(om_load3(mesh->x, v[1]), o),
               b = om_sub(om_load3(mesh->x, v[2]), o), c = om_sub(om_load3(mesh->x, v[3]), o);
        m->volume[e] = om_dot(om_cross(a, b), c) / 6;
        double density = by_label ? by_label[mesh->tet_label[e]] : m->def.density;
        add_mass(m, e, density * m->volume[e]);
        const OmMaterial* material = &m->def.material_default;
        if (m->def.nmaterial > 0) material = &m->def.material[mesh->tet_label[e]];
        double lambda, mu, bulk;
        om_material_lame(material, &lambda, &mu, &bulk);
        m->total_mu += m->volume[e] * mu;
    }
    for (int i = 0; i < mesh->nvert; ++i) {
        OM_CHECK(m->mass[i] > 0, OM_INVALID,
                 "tissue: vertex %d of the mesh has no mass, for no element has it; remove it", i);
        m->total_mass += m->mass[i];
    }
    return OM_OK;
}

static OmStatus find_surface(OmTissueModel* m) {
    if (m->mesh.ntet == 0) {  // any particle may come into contact
        m->nsurface = m->mesh.nvert;
        OM_ALLOC(m->surface_vert, m->nsurface);
        for (int i = 0; i < m->nsurface; ++i) m->surface_vert[i] = i;
    } else {
        OmSurface surface;
        OM_TRY(om_tet_mesh_boundary(&m->mesh, &surface, &m->surface_vert));
        m->nsurface = surface.nvert;
        om_surface_done(&surface);
        om_sort_ints(m->surface_vert, m->nsurface);
    }
    OmVec3 lo = om_load3(m->mesh.x, 0), hi = lo;
    for (int i = 1; i < m->mesh.nvert; ++i) {
        OmVec3 p = om_load3(m->mesh.x, i);
        lo = om_vec3(fmin(lo.x, p.x), fmin(lo.y, p.y), fmin(lo.z, p.z));
        hi = om_vec3(fmax(hi.x, p.x), fmax(hi.y, p.y), fmax(hi.z, p.z));
    }
    m->size = om_norm(om_sub(hi, lo));
    return OM_OK;
}

static OmStatus copy_materials(OmTissueModel* m, const OmTissueDef* def) {
    int n = def->nmaterial > 0 ? def->nmaterial : 1;
    OmMaterial* copy = om_alloc((size_t)n, sizeof *copy);
    if (!copy) return OM_NO_MEMORY;
    if (def->nmaterial > 0)
        memcpy(copy, def->material, (size_t)n * sizeof *copy);
    else
        copy[0] = def->material_default;
    m->def.material = copy;
    return OM_OK;
}

static OmStatus load_options(OmTissueModel* m, const OmEngineInput* input) {
    const OmEngineInput none = {0};
    if (!input) input = &none;
    const OmTissueEngine* e = m->engine;
    OM_CHECK(m->options || !e->needs_file || input->file, OM_INVALID,
             "engine \"%s\" needs a file, and none is given", e->name);
    OM_CHECK(!input->file || e->needs_file, OM_INVALID,
             "engine \"%s\" reads no file, but %s is given", e->name, input->file);
    if (m->options || !e->load) return OM_OK;
    OM_TRY(e->load(input, &m->loaded));
    m->options = m->loaded;
    return OM_OK;
}

static OmStatus set_stiffness(OmTissueModel* m, const double* springs) {
    double largest = m->def.attachment_stiffness;
    m->held = om_tet_mesh_find_set(&m->mesh, "attachment");
    OM_ALLOC(m->stiffness, m->mesh.nvert);
    for (int i = 0; i < m->mesh.nvert; ++i) m->stiffness[i] = m->def.attachment_stiffness;
    for (int k = 0; springs && m->held && k < m->held->nvert; ++k) {
        if (m->held->vert[k] >= m->ncorner) break;  // midpoints follow
        OM_CHECK(springs[k] >= 0 && springs[k] <= OM__MAX_STIFFNESS, OM_INVALID,
                 "tissue: attachment_springs[%d] is %g N/m; it must be from 0 (held still) to %g",
                 k, springs[k], OM__MAX_STIFFNESS);
        m->stiffness[m->held->vert[k]] = springs[k];
        largest = fmax(largest, springs[k]);
    }
    m->def.attachment_springs = NULL;  // borrowed until here
    OM_CHECK(largest <= 0 || m->engine->has_springs, OM_UNAVAILABLE,
             "tissue: attachments have a stiffness of %g N/m, but engine \"%s\" has no springs; it "
             "can only hold vertices still (0)",
             largest, m->engine->name);
    return OM_OK;
}

static OmStatus find_ends(OmTissueModel* m) {
    OM_ALLOC(m->mid_end, 2 * (size_t)(m->mesh.nvert - m->ncorner));
    om_tet_mesh_midpoint_ends(m->nelem, m->elem_node, m->ncorner, m->mid_end);
    return OM_OK;
}

static OmStatus find_own(OmTissueModel* m) {
    const int n = m->def.nown;
    OM_CHECK(n >= 0 && n <= m->ncorner, OM_INVALID, "tissue: nown is %d of %d vertices", n,
             m->ncorner);
    if (n == 0 || n == m->ncorner) return OM_OK;
    m->own = om_calloc((size_t)m->mesh.nvert, 1);
    if (!m->own) return OM_NO_MEMORY;
    for (int i = 0; i < m->mesh.nvert; ++i)
        m->own[i] = (i < m->ncorner ? i : m->mid_end[2 * (i - m->ncorner)]) < n;
    return OM_OK;
}

OmStatus om_tissue_make_tet10(const OmTissueModel* m, const double* x, OmTet10Mesh* mesh) {
    *mesh = (OmTet10Mesh){0};
    OM_CHECK(m->nelem_node == 10, OM_UNAVAILABLE,
             "tissue: its elements are of kind %s; ten nodes are wanted",
             om_tissue_element_name(m->def.element));
    OM_TRY(om_tet10_mesh_from_nodes(&m->mesh, m->elem_node, mesh));
    if (x) memcpy(mesh->x, x, 3 * (size_t)mesh->nnode * sizeof *x);
    return OM_OK;
}

void om_tissue_gather_corners(const OmTissueModel* m, const double* of_node, double* of_corner) {
    memmove(of_corner, of_node, 3 * (size_t)m->ncorner * sizeof *of_corner);
    for (int i = m->ncorner; i < m->mesh.nvert; ++i)
        for (int side = 0; side < 2; ++side) {
            int end = m->mid_end[2 * (i - m->ncorner) + side];
            om_store3(of_corner, end, om_madd(om_load3(of_corner, end), 0.5, om_load3(of_node, i)));
        }
}

// The elements of the mesh's copy, and the midpoints that they need.
static OmStatus make_elements(OmTissueModel* m) {
    m->nelem = m->mesh.ntet;
    m->nelem_node = 4;
    m->ntet_per = 1;
    if (m->def.element == OM_ELEMENT_QUADRATIC) {
        m->nelem_node = 10;
        m->ntet_per = 8;
        OM_TRY(om_tet_mesh_refine_nodes(&m->mesh, &m->elem_node));
        return find_ends(m);
    }
    if (m->def.element == OM_ELEMENT_SHELL) {
        m->nelem_node = 8;
        m->ntet_per = 6;
        m->nelem /= 6;
        OM_TRY(om_tet_mesh_find_cells(&m->mesh, &m->elem_node));
        for (int e = 0; e < m->mesh.ntet; ++e)
            OM_CHECK(m->mesh.tet_label[e] == m->mesh.tet_label[e - e % 6], OM_INVALID,
                     "tissue: element: cell %d has tetrahedra of two labels, %d and %d", e / 6,
                     m->mesh.tet_label[e - e % 6], m->mesh.tet_label[e]);
    }
    return OM_OK;
}

OmStatus om_tissue_create(const OmTissueDef* def, OmTissueModel** model) {
    *model = NULL;
    OM_CHECK(def, OM_INVALID, "tissue: the definition is null");
    OM_TRY(check_def(def));
    OM_TRY(check_mesh(def->mesh, def->engine, def->nmaterial));
    OmTissueModel* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    m->def = *def;
    m->def.material = NULL;
    m->def.options = NULL;  // m->options
    m->def.input = NULL;
    m->engine = def->engine;
    m->options = def->options;
    OM_TRY_DONE(om_tet_mesh_copy(def->mesh, &m->mesh));
    m->ncorner = m->mesh.nvert;
    OM_TRY_DONE(make_elements(m));
    m->def.mesh = &m->mesh;
    OM_TRY_DONE(find_own(m));
    OM_TRY_DONE(set_stiffness(m, def->attachment_springs));
    OM_TRY_DONE(om__bonds_copy(def, m));
    OM_TRY_DONE(copy_materials(m, def));
    OM_TRY_DONE(load_options(m, def->input));
    OM_TRY_DONE(lump_mass(m));
    m->def.material_density = NULL;  // borrowed until here
    OM_TRY_DONE(find_surface(m));
    OM_TRY_DONE(m->engine->create(m));
    *model = m;
    return OM_OK;
done:
    om_tissue_destroy(m);
    return status;
}

void om_tissue_destroy(OmTissueModel* m) {
    if (!m) return;
    m->engine->destroy(m);
    if (m->loaded) m->engine->unload(m->loaded);
    om_free((void*)(uintptr_t)m->def.material);
    om_free(m->elem_node);
    om_free(m->mid_end);
    om_free(m->own);
    om_free(m->bond);
    om_free(m->mass);
    om_free(m->volume);
    om_free(m->surface_vert);
    om_free(m->stiffness);
    om_tet_mesh_done(&m->mesh);
    om_free(m);
}

const OmTetMesh* om_tissue_mesh(const OmTissueModel* m) { return &m->mesh; }
int om_tissue_corner_count(const OmTissueModel* m) { return m->ncorner; }
const double* om_tissue_mass(const OmTissueModel* m) { return m->mass; }
bool om_tissue_moves_itself(const OmTissueModel* m) { return m->engine->step != NULL; }
const OmTissueEngine* om_tissue_engine(const OmTissueModel* m) { return m->engine; }
OmVec3 om_tissue_gravity(const OmTissueModel* m) { return m->def.gravity; }

const int* om_tissue_surface_vert(const OmTissueModel* m, int* nvert) {
    *nvert = m->nsurface;
    return m->surface_vert;
}

size_t om_tissue_memory(const OmTissueModel* m, const OmTissueWork* w) {
    size_t nvert = (size_t)m->mesh.nvert, ntet = (size_t)m->mesh.ntet;
    size_t mesh = nvert * 3 * sizeof(double) + ntet * 5 * sizeof(int);
    if (m->elem_node)
        mesh += ((size_t)m->nelem_node * (size_t)m->nelem + 2 * (nvert - (size_t)m->ncorner)) *
                sizeof(int);
    size_t model = sizeof *m + mesh + 2 * nvert * sizeof(double) + ntet * sizeof(double) +
                   (size_t)m->nsurface * sizeof(int);
    size_t state = om_tissue_state_size(m);
    size_t vertex = 2 * sizeof(char) + 3 + 27 * sizeof(double) + sizeof(int) + sizeof(OmVec3) +
                    sizeof(OmMat3) + 9 * sizeof(float);
    size_t work = sizeof *w + state + nvert * vertex;
    if (w->A.value)
        work +=
            ((size_t)w->A.nvert + 1 + (size_t)w->A.nblock + 4 * (size_t)w->A.nedge) * sizeof(int) +
            (size_t)w->A.nblock * 9 * sizeof(float);
    work += (size_t)w->max_point * (sizeof *w->point + 16 * sizeof *w->undo);
    work += (size_t)w->max_tie * sizeof *w->tie + (w->ties ? om_ties_memory(w->ties) : 0);
    if (w->solver) work += om_solver_memory(w->solver);
    return model + state + work + (m->engine->get_memory ? m->engine->get_memory(m, w) : 0);
}
