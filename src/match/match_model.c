// match_model.c: the parts that every update of a twin needs, made once.
//
// The elements are those of the twin's body: quadratic ones where the scene has them, on a mesh that has the midpoints
// of edges behind the vertices of the site's, as the body's own mesh has. With linear elements on the site's mesh
// (cells of 12 mm, 5 mm thick) the twin bent too stiffly for any attachments to explain a scan: right acquisitions were
// refused.
#include <string.h>

#include "match/match_internal.h"
#include "omentum/body.h"

#define COOKIE 0x3a7c4e01u
#define FOUNDATION 20.0  // times Young's modulus over the mean edge
#define MAX_HYPOTHESIS 20000

OmMatchDef om_match_default_def(const OmScene* scene, const OmSite* site) {
    return (OmMatchDef){.scene = scene,
                        .site = site,
                        .nhypothesis = 2000,
                        .seed = 1,
                        .moved = 0.0025,
                        .min_seen = 0.1,
                        .min_motion = 0.005,
                        .max_residual = 0.0012,
                        .max_other = 0.08,
                        .max_empty = 0.45,
                        .nworker = 1,
                        .cookie = COOKIE};
}

static bool is_at_least(double value, double least) { return isfinite(value) && value >= least; }

static OmStatus check_def(const OmMatchDef* def) {
    OM_CHECK(def && def->cookie == COOKIE, OM_INVALID,
             "OmMatchDef was not made by om_match_default_def");
    OM_CHECK(def->scene && def->site, OM_INVALID, "OmMatchDef.scene or .site is null");
    OM_CHECK(def->site->role == OM_SITE_TWIN, OM_INVALID,
             "OmMatchDef.site is the truth of a simulated world; the twin's has role OM_SITE_TWIN");
    OM_CHECK(is_at_least(def->foundation, 0) && is_at_least(def->contact, 0), OM_INVALID,
             "OmMatchDef.foundation %g and .contact %g must be at least 0", def->foundation,
             def->contact);
    OM_CHECK(def->nhypothesis >= 0 && def->nhypothesis <= MAX_HYPOTHESIS, OM_INVALID,
             "OmMatchDef.nhypothesis = %d, must be 0 to %d", def->nhypothesis, MAX_HYPOTHESIS);
    OM_CHECK(isfinite(def->moved) && def->moved > 0, OM_INVALID,
             "OmMatchDef.moved = %g m, must be above 0", def->moved);
    OM_CHECK(is_at_least(def->min_seen, 0) && def->min_seen <= 1, OM_INVALID,
             "OmMatchDef.min_seen = %g, must be 0 to 1", def->min_seen);
    OM_CHECK(is_at_least(def->min_motion, 0) && is_at_least(def->max_residual, 0), OM_INVALID,
             "OmMatchDef.min_motion %g and .max_residual %g must be at least 0", def->min_motion,
             def->max_residual);
    OM_CHECK(is_at_least(def->max_other, 0) && is_at_least(def->max_empty, 0), OM_INVALID,
             "OmMatchDef.max_other %g and .max_empty %g must be at least 0", def->max_other,
             def->max_empty);
    OM_CHECK(def->nworker >= 0, OM_INVALID, "OmMatchDef.nworker = %d, must be at least 0",
             def->nworker);
    const OmTetMesh* mesh = &def->site->mesh;
    OM_CHECK(mesh->ntet > 0, OM_INVALID, "match: the twin's mesh has no tetrahedra");
    OM_CHECK(!def->candidate || def->ncandidate > 0, OM_INVALID,
             "OmMatchDef.ncandidate = %d, must be at least 1", def->ncandidate);
    for (int i = 0; def->candidate && i < def->ncandidate; ++i)
        OM_CHECK(def->candidate[i] >= 0 && def->candidate[i] < mesh->nvert, OM_INVALID,
                 "OmMatchDef.candidate[%d] = %d, the mesh has %d vertices", i, def->candidate[i],
                 mesh->nvert);
    return OM_OK;
}

// The mesh with a vertex for each node.
static OmStatus make_mesh(OmMatch* m, bool is_quadratic) {
    int* node = NULL;
    OM_TRY(om_tet_mesh_copy(&m->def.site->mesh, &m->mesh));
    m->ncorner = m->mesh.nvert;
    if (!is_quadratic) return OM_OK;
    const int nelem = m->mesh.ntet;
    OmStatus status = om_tet_mesh_refine_nodes(&m->mesh, &node);
    if (status < 0) return status;
    m->mid_end = om_alloc(2 * (size_t)(m->mesh.nvert - m->ncorner), sizeof *m->mid_end);
    if (m->mid_end) om_tet_mesh_midpoint_ends(nelem, node, m->ncorner, m->mid_end);
    om_free(node);
    return m->mid_end ? OM_OK : OM_NO_MEMORY;
}

// Boundary, its shares of area, mean edge.
static OmStatus make_surface(OmMatch* m) {
    const OmTetMesh* mesh = &m->mesh;
    OM_TRY(om_tet_mesh_boundary(mesh, &m->surface, &m->surface_vert));
    OM_ALLOC(m->surface_of, mesh->nvert);
    OM_ALLOC(m->spring, mesh->nvert);
    m->vert_area = om_calloc((size_t)mesh->nvert, sizeof *m->vert_area);
    if (!m->vert_area) return OM_NO_MEMORY;
    for (int v = 0; v < mesh->nvert; ++v) m->surface_of[v] = -1;
    for (int i = 0; i < m->surface.nvert; ++i) m->surface_of[m->surface_vert[i]] = i;
    double length = 0;
    for (int t = 0; t < m->surface.ntri; ++t) {
        const int* v = m->surface.tri_vert + 3 * (size_t)t;
        OmVec3 p[3];
        for (int k = 0; k < 3; ++k) p[k] = om_load3(m->surface.x, v[k]);
        double area = 0.5 * om_norm(om_cross(om_sub(p[1], p[0]), om_sub(p[2], p[0])));
        for (int k = 0; k < 3; ++k) {
            m->vert_area[m->surface_vert[v[k]]] += area / 3;
            length += om_distance(p[k], p[(k + 1) % 3]);
        }
    }
    m->view.edge = length / (3.0 * m->surface.ntri);  // a mesh with tetrahedra has a boundary
    return OM_OK;
}

// A midpoint on the surface gives half of its area to each end of its edge: the areas of candidates.
static void gather_area(const OmMatch* m, double* area) {
    memcpy(area, m->vert_area, (size_t)m->ncorner * sizeof *area);
    for (int i = m->ncorner; i < m->mesh.nvert; ++i)
        for (int side = 0; side < 2; ++side)
            area[m->mid_end[2 * (i - m->ncorner) + side]] += 0.5 * m->vert_area[i];
}

// Candidates, ascending, without repeats, on the surface.
static OmStatus make_candidates(OmMatch* m) {
    const OmTetMesh* mesh = &m->def.site->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(mesh, "underside");
    unsigned char* is_in = om_calloc((size_t)mesh->nvert, 1);
    if (!is_in) return OM_NO_MEMORY;
    int n = 0;
    if (m->def.candidate)
        for (int i = 0; i < m->def.ncandidate; ++i) is_in[m->def.candidate[i]] = 1;
    else if (under && under->nvert > 0)
        for (int i = 0; i < under->nvert; ++i) is_in[under->vert[i]] = 1;
    else
        memset(is_in, 1, (size_t)mesh->nvert);
    for (int v = 0; v < mesh->nvert; ++v) n += is_in[v] &= v < m->ncorner && m->surface_of[v] >= 0;
    OmStatus status = OM_OK;
    OM_CHECK_DONE(n > 0, OM_INVALID, "match: no vertex of the surface may be attached");
    OM_ALLOC_DONE(m->candidate, n);
    OM_ALLOC_DONE(m->area, n);
    OM_ALLOC_DONE(m->candidate_of, m->ncorner);
    gather_area(m, m->spring);
    n = 0;
    for (int v = 0; v < m->ncorner; ++v) {
        m->candidate_of[v] = is_in[v] ? n : -1;
        if (!is_in[v]) continue;
        m->candidate[n] = v;
        m->area[n++] = m->spring[v];
    }
    m->view.ncandidate = n;
done:
    om_free(is_in);
    return status;
}

static OmStatus make_solids(const OmMatch* m, OmFemSolid** solid, OmFemSolid** projected) {
    const OmSite* site = m->def.site;
    OmFemMesh mesh;
    OmBodyParts parts;
    OmTissueDef tissue;
    OM_TRY(om_body_make_tissue_def(m->def.scene, site, &parts, &tissue));
    // its midpoints have the numbers of those of m->mesh: edges in the order of their ends
    OM_TRY(om_fem_mesh_from_tet(&site->mesh, m->mid_end ? OM_TET10 : OM_TET4, &mesh));
    int n = tissue.nmaterial > 0 ? tissue.nmaterial : 1;
    for (int e = 0; e < mesh.nelem && tissue.nmaterial == 0; ++e) mesh.elem_material[e] = 0;
    OmFemDef def = om_fem_default_def(
        &mesh, n, tissue.nmaterial > 0 ? tissue.material : &tissue.material_default);
    def.density = tissue.material_density ? tissue.material_density : &tissue.density;
    def.nworker = m->def.nworker;
    OmStatus status = om_fem_create(&def, solid);
    def.is_projected = true;
    if (status >= 0) status = om_fem_create(&def, projected);
    om_fem_mesh_done(&mesh);
    return status;
}

static OmStatus make_solver(OmMatch* m) {
    const OmTetMesh* mesh = &m->mesh;
    OM_TRY(om_fem_matrix_create(m->solid, &m->A));
    OmSolverDef def = om_solver_default_def();
    def.preconditioner = OM_CHOLESKY;
    def.nworker = m->def.nworker;
    OM_TRY(om_solver_create(&def, &m->A, NULL, &m->solver));
    size_t n = 3 * (size_t)mesh->nvert;
    OM_ALLOC(m->r, n);
    OM_ALLOC(m->dx, n);
    OM_ALLOC(m->y, n);
    OM_ALLOC(m->held.vert, mesh->nvert);
    OM_ALLOC(m->held.goal, n);
    return OM_OK;
}

// Are the elements quadratic? In place of shells they are: they bend as shells do, on the same vertices.
static OmStatus find_element(const OmMatch* m, bool* is_quadratic) {
    OmBodyParts parts;
    OmTissueDef tissue;
    OM_TRY(om_body_make_tissue_def(m->def.scene, m->def.site, &parts, &tissue));
    *is_quadratic = tissue.element != OM_ELEMENT_LINEAR;
    return OM_OK;
}

static OmStatus make(OmMatch* m) {
    bool is_quadratic = false;
    OM_TRY(find_element(m, &is_quadratic));
    OM_TRY(make_mesh(m, is_quadratic));
    OM_TRY(make_surface(m));
    OM_TRY(make_candidates(m));
    OM_TRY(make_solids(m, &m->solid, &m->projected));
    OM_TRY(make_solver(m));
    double young = om_site_get_material(m->def.site, 0).young;
    if (m->def.foundation == 0) m->def.foundation = FOUNDATION * young / m->view.edge;
    if (m->def.contact == 0) m->def.contact = m->def.foundation;
    m->hold = OM__MATCH_HOLD * young * m->view.edge;
    m->view.mesh = &m->mesh;
    m->view.ncorner = m->ncorner;
    m->view.mid_end = m->mid_end;
    m->view.surface = &m->surface;
    m->view.surface_vert = m->surface_vert;
    m->view.surface_of = m->surface_of;
    m->view.candidate = m->candidate;
    m->view.area = m->area;
    m->view.foundation = m->def.foundation;
    return om__match_make_prior(m);
}

OmStatus om_match_create(const OmMatchDef* def, OmMatch** match) {
    *match = NULL;
    OM_TRY(check_def(def));
    OmMatch* m = om_calloc(1, sizeof *m);
    if (!m) return OM_NO_MEMORY;
    m->def = *def;
    OmStatus status = make(m);
    m->def.candidate = NULL;
    if (status < 0)
        om_match_destroy(m);
    else
        *match = m;
    return status < 0 ? status : OM_OK;
}

void om_match_destroy(OmMatch* m) {
    if (!m) return;
    om_tet_mesh_done(&m->mesh);
    om_free(m->mid_end);
    om_free(m->candidate_of);
    om_free(m->spring);
    om_free(m->x_rest);
    om_surface_done(&m->surface);
    om_free(m->surface_vert);
    om_free(m->surface_of);
    om_free(m->candidate);
    om_free(m->area);
    om_free(m->vert_area);
    om_fem_destroy(m->solid);
    om_fem_destroy(m->projected);
    om_bsr_destroy(&m->A);
    om_solver_destroy(m->solver);
    om_free(m->held.vert);
    om_free(m->held.goal);
    om_free(m->r);
    om_free(m->dx);
    om_free(m->y);
    om_free(m->hypothesis);
    om_free(m);
}

const OmMatchView* om_match_view(const OmMatch* match) { return &match->view; }
