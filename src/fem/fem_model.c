// fem_model.c: constants of elements, computed at creation, and the engine's table of functions.
#include <string.h>

#include "fem/fem_shell.h"
#include "omentum/fem.h"

const OmMaterial* om__fem_material(const OmTissueModel* model, int e) {
    size_t tet = (size_t)model->ntet_per * (size_t)e;
    return &model->def.material[model->def.nmaterial > 0 ? model->mesh.tet_label[tet] : 0];
}

void om__fem_lame(const OmTissueModel* model, int e, double* lambda, double* mu) {
    double bulk;
    om_material_lame(om__fem_material(model, e), lambda, mu, &bulk);
}

double om__fem_volume(const OmTissueModel* m, int e) {
    if (m->nelem_node == OM__SHELL_NODE) return ((const OmFem*)m->data)->shell[e].volume;
    return m->elem_node ? 8 * m->volume[8 * (size_t)e] : m->volume[e];
}

OmFemFamily om__fem_family(const OmMaterial* m) {
    switch (m->law) {
    case OM_NEO_HOOKEAN: return OM__FAMILY_NEO;
    case OM_STABLE_NEO_HOOKEAN: return OM__FAMILY_STABLE;
    case OM_ST_VENANT_KIRCHHOFF: return OM__FAMILY_VENANT;
    default: return OM__FAMILY_OTHER;
    }
}

// Does the model need stiffness blocks, because an element is not corotational?
static bool find_blocked(const OmTissueModel* m) {
    for (int e = 0; e < m->nelem; ++e)
        if (om__fem_material(m, e)->law != OM_COROTATIONAL) return true;
    return false;
}

// Gradients of the shape functions of vertices 1, 2, 3: the rows of Dm^-1.
static OmStatus make_slopes(const OmTissueModel* m, OmFem* fem) {
    const OmTetMesh* mesh = &m->mesh;
    OM_ALLOC(fem->grad, 9 * (size_t)fem->nelem);
    for (int e = 0; e < fem->nelem; ++e) {
        const int* v = om__elem_node(m) + m->nelem_node * (size_t)e;
        double volume = om__fem_volume(m, e);
        OmVec3 o = om_load3(mesh->x, v[0]), a = om_sub(om_load3(mesh->x, v[1]), o),
               b = om_sub(om_load3(mesh->x, v[2]), o), c = om_sub(om_load3(mesh->x, v[3]), o);
        double* g = fem->grad + 9 * (size_t)e;
        double inv = 1 / (6 * volume);
        om_store3(g, 0, om_scale(inv, om_cross(b, c)));
        om_store3(g, 1, om_scale(inv, om_cross(c, a)));
        om_store3(g, 2, om_scale(inv, om_cross(a, b)));
        for (int k = 0; k < 9; ++k)
            OM_CHECK(isfinite(g[k]) && fabs(g[k]) < 1e15, OM_INVALID,
                     "fem: element %d is too flat to compute with (volume %g m^3)", e, volume);
    }
    return OM_OK;
}

static void fill_batches(const OmTissueModel* m, OmFem* fem) {
    for (int k = 0; k < fem->nbatch * OM__LANE; ++k) {
        OmFemBatch* batch = &fem->batch[k / OM__LANE];
        int l = k % OM__LANE, e = k < fem->nelem ? k : fem->nelem - 1;
        const int* node = om__elem_node(m) + m->nelem_node * (size_t)e;
        double lambda, mu;
        om__fem_lame(m, e, &lambda, &mu);
        for (int a = 0; a < 4; ++a) batch->vert[a][l] = node[a];
        double wide = 0;
        if (fem->mids) {
            OmFemMids* mids = &fem->mids[k / OM__LANE];
            for (int a = 0; a < 6; ++a) mids->vert[a][l] = node[4 + a];
            wide = fmax(lambda / mu - OM__INNER_RATIO, 0);
            mids->wide[l] = (float)wide;
        }
        for (int c = 0; c < 9 && fem->grad; ++c)
            batch->grad[c][l] = (float)fem->grad[9 * (size_t)e + (size_t)c];
        double volume = om__fem_volume(m, e) * (fem->mids ? 0.25 : 1);
        batch->root[l] = k < fem->nelem ? (float)sqrt(volume * mu) : 0.0F;
        batch->ratio[l] = (float)(lambda / mu - wide);
        const OmMaterial* material = om__fem_material(m, e);
        OmFemFamily family = om__fem_family(material);
        if (fem->shell && material->law == OM_COROTATIONAL) family = OM__FAMILY_TURNED;
        if (l == 0) batch->family = family;
        if (batch->family != family) batch->family = OM__FAMILY_OTHER;
        if (k == 0) fem->ratio = batch->ratio[l];
        fem->is_mixed |= batch->ratio[l] != fem->ratio;  // exact: equal inputs give equal floats
    }
}

// Elements of each vertex, ascending, with the places of their vertices in its row of A.
static OmStatus make_visits(const OmTissueModel* m, OmFem* fem) {
    const int *node = om__elem_node(m), per = m->nelem_node;
    int nvert = m->mesh.nvert;
    OmBsr A = {0};
    int *adr = NULL, *fill = NULL;
    OmStatus status = OM_OK;
    size_t n = (size_t)per * (size_t)fem->nelem;
    OM_TRY_DONE(om_bsr_create(nvert, fem->nelem, per, node, &A));
    OM_ALLOC_DONE(adr, (size_t)per * n);
    OM_CALLOC_DONE(fill, (size_t)nvert);
    OM_TRY_DONE(om_bsr_find_elements(&A, fem->nelem, per, node, adr));
    for (size_t k = 0; k < n; ++k) ++fem->visit_adr[node[k] + 1];
    for (int i = 0; i < nvert; ++i) {
        fem->visit_adr[i + 1] += fem->visit_adr[i];
        int row = A.row_adr[i + 1] - A.row_adr[i];
        fem->max_row = row > fem->max_row ? row : fem->max_row;
        OM_CHECK_DONE(row <= 65535, OM_INVALID, "fem: vertex %d has %d neighbours, at most 65535",
                      i, row - 1);
    }
    for (size_t k = 0; k < n; ++k) {
        int i = node[k], at = fem->visit_adr[i] + fill[i]++;
        unsigned short* slot = fem->visit ? fem->visit[at].slot : fem->large_visit[at].slot;
        for (int b = 0; b < per; ++b)
            slot[b] = (unsigned short)(adr[(size_t)per * k + (size_t)b] - A.row_adr[i]);
        if (fem->visit)
            fem->visit[at].corner = (int)k;
        else
            fem->large_visit[at].corner = (int)k;
    }
done:
    om_bsr_destroy(&A);
    om_free(adr);
    om_free(fill);
    return status;
}

static void fem_destroy(OmTissueModel* m) {
    OmFem* fem = m->data;
    if (!fem) return;
    om_free(fem->batch);
    om_free(fem->mids);
    om_free(fem->grad);
    om_free(fem->visit_adr);
    om_free(fem->visit);
    om_free(fem->large_visit);
    om_free(fem->shells);
    om_free(fem->shell);
    om_free(fem);
    m->data = NULL;
}

static OmStatus fem_create(OmTissueModel* m) {
    OM_CHECK(m->mesh.ntet < 1 << 27, OM_INVALID, "fem: %d elements are too many", m->mesh.ntet);
    OmFem* fem = om_calloc(1, sizeof *fem);
    if (!fem) return OM_NO_MEMORY;
    m->data = fem;  // freed with the model, whatever fails below
    bool is_quadratic = m->nelem_node == 10, is_shell = m->nelem_node == OM__SHELL_NODE;
    fem->nelem = m->nelem;
    fem->npoint = is_quadratic ? 5 : 1;
    fem->nbatch = om_block_count(fem->nelem, OM__LANE);
    fem->batch = om_calloc((size_t)fem->nbatch, sizeof *fem->batch);
    fem->visit_adr = om_calloc((size_t)m->mesh.nvert + 1, sizeof *fem->visit_adr);
    if (is_quadratic) fem->mids = om_calloc((size_t)fem->nbatch, sizeof *fem->mids);
    if (!fem->batch || !fem->visit_adr || (is_quadratic && !fem->mids)) return OM_NO_MEMORY;
    if (m->elem_node)
        OM_ALLOC(fem->large_visit, (size_t)m->nelem_node * (size_t)fem->nelem);
    else
        OM_ALLOC(fem->visit, 4 * (size_t)fem->nelem);
    OM_TRY(is_shell ? om__fem_shell_make(m, fem) : make_slopes(m, fem));
    fem->is_blocked = find_blocked(m);
    fill_batches(m, fem);
    return make_visits(m, fem);
}

// Floats an element leaves for the second pass.
static size_t left_size(const OmFem* fem) {
    if (fem->mids) return OM__QUADRATIC;
    if (fem->shells) return OM__SHELL;
    return fem->is_blocked ? OM__BLOCKED : OM__TURNED;
}

static void fem_destroy_work(OmTissueWork* w) {
    OmFemWork* fw = w->data;
    if (!fw) return;
    om_free(fw->turned);
    om_free(fw->corner);
    om_free(fw->row);
    om_free(fw);
    w->data = NULL;
}

static OmStatus fem_create_work(const OmTissueModel* m, OmTissueWork* w) {
    const OmFem* fem = m->data;
    OmFemWork* fw = om_calloc(1, sizeof *fw);
    if (!fw) return OM_NO_MEMORY;
    w->data = fw;  // freed with the work, whatever fails below
    fw->nworker = m->def.solver.nworker;
    fw->row_size = (size_t)fem->max_row * 24 + 16;
    fw->turned = om_calloc((size_t)fem->nbatch * OM__LANE, left_size(fem) * sizeof(float));
    fw->row = om_calloc((size_t)om_worker_count(fw->nworker) * fw->row_size, sizeof(float));
    if (!fw->turned || !fw->row) return OM_NO_MEMORY;
    // Any step may need Newton's method: it has its memory from the start.
    OM_ALLOC(fw->corner, 3 * (size_t)m->nelem_node * (size_t)m->nelem);
    return OM_OK;
}

static size_t fem_get_memory(const OmTissueModel* m, const OmTissueWork* w) {
    const OmFem* fem = m->data;
    const OmFemWork* fw = w->data;
    size_t nelem = (size_t)fem->nelem, nbatch = (size_t)fem->nbatch;
    size_t visit =
        (size_t)m->nelem_node * (fem->visit ? sizeof *fem->visit : sizeof *fem->large_visit);
    return sizeof *fem + nbatch * sizeof *fem->batch +
           nelem * (fem->shell ? sizeof *fem->shell : 9 * sizeof(double)) +
           (fem->mids ? nbatch * sizeof *fem->mids : 0) +
           (fem->shells ? nbatch * sizeof *fem->shells : 0) +
           ((size_t)m->mesh.nvert + 1) * sizeof(int) + nelem * visit + sizeof *fw +
           nelem * 3 * (size_t)m->nelem_node * sizeof(double) +
           nbatch * OM__LANE * left_size(fem) * sizeof(float) +
           (size_t)om_worker_count(fw->nworker) * fw->row_size * sizeof(float);
}

static const char* const number[] = {"young", "poisson", "rayleigh_mass", "rayleigh_stiffness",
                                     NULL};
static const OmTissueEngine engine = {
    .version = OM_ENGINE_VERSION,
    .name = "fem",
    .summary = "finite elements",
    .number = number,
    .has_law = true,
    .has_quadratic = true,
    .has_springs = true,
    .create = fem_create,
    .destroy = fem_destroy,
    .create_work = fem_create_work,
    .destroy_work = fem_destroy_work,
    .assemble = om__fem_assemble,
    .add_internal_force = om__fem_add_internal_force,
    .get_measure = om__fem_get_measure,
    .eval_balance = om__fem_eval_balance,
    .get_energy = om__fem_get_energy,
    .check = om__fem_check,
    .get_memory = fem_get_memory,
};

const OmTissueEngine* om_fem_engine(void) { return &engine; }
