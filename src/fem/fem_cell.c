// fem_cell.c: strains averaged around vertices, against locking.
//
// Linear tetrahedra lock twice: bending costs them shear, and near nu = 0.5 every element has to preserve its own
// volume. Here the law is evaluated at *cells*, a quarter of each element around a vertex (per material, so that
// nothing is averaged across an interface):
//
//     F_c = mean of F_e over the cell's elements, a linear operator on x
//     W   = sum V_c w(F_c)  +  sum V_c U(M M t)_c  +  sum V_e (a mu / 2) |F_e - mean F_c|^2
//
// w is the material's law with lambda at most mu, so cells do not lock in volume. The remaining volumetric term U is
// evaluated at the measure of volume t = det F - 1 (or the trace of the strain, for laws without a term in det F)
// averaged twice more with neighbouring cells, M = D^-1 W. The last term gives stiffness to deformations that cells do
// not represent (Puso and Solberg 2006), the difference between an element and the mean of its four cells. A uniform F
// has the law's own energy on any mesh. Forces are exact derivatives of W.
//
// The matrix of a step is the one of single elements with the whole law, at the mean F of their cells: an upper bound
// of the tangent of W (Jensen). A step is stable, and its error is that of an additional mass h^2 (A - K): of the
// order of the scheme, zero at rest. Blocks of cells would double or treble the rows of the matrix. Tried and
// rejected: the matrix at the elements' own F. For inverted elements, whose rotations are arbitrary, it was no bound,
// and a shaken body diverged.
//
// Compared on a cantilever of 4 cells (nu = 0.3, 0.45, 0.49) and Cook's membrane of 8 (nu = 0.3, 0.45, 0.499), linear
// elasticity, missing deflection in %: plain 22, 41, 71 and 31, 45, 71; nodal volumes 13, 17, 20 and 20, 20,
// 30; edges for shape and nodes for volume 0, 4, 7 and 4, 7, 19; cells with a fifth of the elements' energy and one
// average of all volume -4, 0, 2 and 5, 7, 19; this -8, -7, -4 and 3, 2, 4.
#include <string.h>

#include "fem/fem_internal.h"

static int material_of(const OmTissueModel* m, int e) {
    return m->def.nmaterial > 0 ? m->mesh.tet_label[e] : 0;
}

// Number cells vertex by vertex: tet_cell, vert, material, and the elements of each.
static OmStatus number_cells(const OmTissueModel* m, OmFemCells* c) {
    const OmFem* fem = m->data;
    const OmTetMesh* mesh = &m->mesh;
    size_t n = 4 * (size_t)mesh->ntet;
    OM_ALLOC(c->tet_cell, n);
    OM_ALLOC(c->tet, n);
    OM_ALLOC(c->vert, n);
    OM_ALLOC(c->material, n);
    OM_ALLOC(c->tet_adr, n + 1);
    c->tet_adr[0] = 0;
    int fill = 0;
    for (int i = 0; i < mesh->nvert; ++i) {
        int begin = fem->visit_adr[i], end = fem->visit_adr[i + 1];
        for (int at = begin; at < end; ++at) c->tet_cell[fem->visit[at].corner] = -1;
        for (int first = begin; first < end; ++first) {
            if (c->tet_cell[fem->visit[first].corner] >= 0) continue;
            int material = material_of(m, fem->visit[first].corner / 4);
            for (int at = first; at < end; ++at) {
                int corner = fem->visit[at].corner;
                if (material_of(m, corner / 4) != material) continue;
                c->tet_cell[corner] = c->ncell;
                c->tet[fill++] = corner / 4;
            }
            c->vert[c->ncell] = i;
            c->material[c->ncell] = material;
            c->tet_adr[++c->ncell] = fill;
        }
    }
    return OM_OK;
}

// Entries of cell k to the vertices (or, with `of` tet_cell, the cells) of its elements; mark is -1
// before and after.
static int list_entries(const OmFemCells* c, const int* of, int k, int* mark, int* list) {
    int num = 0;
    for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at) {
        for (int a = 0; a < 4; ++a) {
            int j = of[4 * (size_t)c->tet[at] + (size_t)a];
            if (mark[j] >= 0) continue;
            mark[j] = num;
            list[num++] = j;
        }
    }
    return num;
}

static void clear_marks(int num, const int* list, int* mark) {
    for (int n = 0; n < num; ++n) mark[list[n]] = -1;
}

static OmVec3 corner_gradient(const OmTissueModel* m, int e, int a) {
    const double* g = ((const OmFem*)m->data)->grad + 9 * (size_t)e;
    if (a > 0) return om_load3(g, a - 1);
    return om_scale(-1, om_add(om_add(om_load3(g, 0), om_load3(g, 1)), om_load3(g, 2)));
}

static void fill_gradients(const OmTissueModel* m, OmFemCells* c, int* mark, int* list) {
    for (int k = 0; k < c->ncell; ++k) {
        int num = list_entries(c, m->mesh.tet_vert, k, mark, list), adr = c->adr[k];
        memset(c->grad + 3 * (size_t)adr, 0, 3 * (size_t)num * sizeof(double));
        for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at) {
            int e = c->tet[at];
            double share = 0.25 * m->volume[e] / c->volume[k];  // volumes are positive
            for (int a = 0; a < 4; ++a) {
                int to = adr + mark[m->mesh.tet_vert[4 * (size_t)e + (size_t)a]];
                om_store3(c->grad, to,
                          om_madd(om_load3(c->grad, to), share, corner_gradient(m, e, a)));
            }
        }
        for (int n = 0; n < num; ++n) {
            OmFemEntry* entry = &c->entry[adr + n];
            entry->index = list[n];
            for (int d = 0; d < 3; ++d) entry->g[d] = (float)c->grad[3 * (adr + n) + d];
            ++c->t_adr[list[n] + 1];
        }
        clear_marks(num, list, mark);
    }
}

static void fill_neighbours(const OmTissueModel* m, OmFemCells* c, int* mark, int* list) {
    for (int k = 0; k < c->ncell; ++k) {
        int num = list_entries(c, c->tet_cell, k, mark, list), adr = c->near_adr[k];
        memset(c->weight + adr, 0, (size_t)num * sizeof(double));
        memcpy(c->near + adr, list, (size_t)num * sizeof(int));
        for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at)
            for (int a = 0; a < 4; ++a)
                c->weight[adr + mark[c->tet_cell[4 * (size_t)c->tet[at] + (size_t)a]]] +=
                    m->volume[c->tet[at]] / 16;
        for (int n = adr; n < adr + num; ++n) c->share[n] = (float)(c->weight[n] / c->volume[k]);
        clear_marks(num, list, mark);
    }
}

// Entries by vertex instead of by cell.
static void fill_transpose(const OmTissueModel* m, OmFemCells* c, int* next) {
    for (int i = 0; i < m->mesh.nvert; ++i) {
        c->t_adr[i + 1] += c->t_adr[i];
        next[i] = c->t_adr[i];
    }
    for (int k = 0; k < c->ncell; ++k) {
        for (int at = c->adr[k]; at < c->adr[k + 1]; ++at) {
            int to = next[c->entry[at].index]++;
            c->t_entry[to] = c->entry[at];
            c->t_entry[to].index = k;
            c->t_from[to] = at;
        }
    }
}

static OmStatus make_operators(const OmTissueModel* m, OmFemCells* c) {
    OmStatus status = OM_OK;
    size_t n = (size_t)m->mesh.nvert > (size_t)c->ncell ? (size_t)m->mesh.nvert : (size_t)c->ncell;
    int *mark = NULL, *list = NULL, *next = NULL;
    OM_ALLOC_DONE(mark, n);
    OM_ALLOC_DONE(list, n);
    OM_ALLOC_DONE(next, n);
    OM_CALLOC_DONE(c->volume, (size_t)c->ncell);
    OM_CALLOC_DONE(c->adr, (size_t)c->ncell + 1);
    OM_CALLOC_DONE(c->near_adr, (size_t)c->ncell + 1);
    OM_CALLOC_DONE(c->t_adr, (size_t)m->mesh.nvert + 1);
    for (size_t i = 0; i < n; ++i) mark[i] = -1;
    for (int k = 0; k < c->ncell; ++k) {
        for (int at = c->tet_adr[k]; at < c->tet_adr[k + 1]; ++at)
            c->volume[k] += 0.25 * m->volume[c->tet[at]];
        int num = list_entries(c, m->mesh.tet_vert, k, mark, list);
        clear_marks(num, list, mark);
        c->adr[k + 1] = c->adr[k] + num;
        num = list_entries(c, c->tet_cell, k, mark, list);
        clear_marks(num, list, mark);
        c->near_adr[k + 1] = c->near_adr[k] + num;
    }
    size_t nentry = (size_t)c->adr[c->ncell], nnear = (size_t)c->near_adr[c->ncell];
    OM_ALLOC_DONE(c->entry, nentry);
    OM_ALLOC_DONE(c->grad, 3 * nentry);
    OM_ALLOC_DONE(c->t_entry, nentry);
    OM_ALLOC_DONE(c->t_from, nentry);
    OM_ALLOC_DONE(c->near, nnear);
    OM_ALLOC_DONE(c->weight, nnear);
    OM_ALLOC_DONE(c->share, nnear);
    fill_gradients(m, c, mark, list);
    fill_neighbours(m, c, mark, list);
    fill_transpose(m, c, next);
done:
    om_free(mark);
    om_free(list);
    om_free(next);
    return status;
}

// ---- laws -------------------------------------------------------------------------------------------

bool om__cell_is_volume(const OmMaterial* material) {
    OmLawParam law;
    om__law_init(material, &law);
    return om__law_is_split(&law);
}

// The inner law: the same with a smaller bulk modulus; `wide`: a law with the remaining volumetric term.
static OmStatus split_materials(const OmTissueModel* m, OmFemCells* c) {
    int num = m->def.nmaterial > 0 ? m->def.nmaterial : 1;
    OM_ALLOC(c->inner, (size_t)num);
    OM_ALLOC(c->wide, (size_t)num);
    for (int k = 0; k < num; ++k) {
        double lambda, mu, bulk;
        OmMaterial* inner = &c->inner[k];
        *inner = m->def.material[k];
        om_material_lame(inner, &lambda, &mu, &bulk);
        double excess = fmax(lambda - OM__INNER * mu, 0);
        if (excess > 0) {
            bool has_own = inner->law == OM_OGDEN_COUPLED && inner->nterm > 0;
            inner->bulk = lambda - excess + (has_own ? 0 : mu * 2 / 3);
            c->has_wide = true;
        }
        om__law_init(&m->def.material[k], &c->wide[k]);
        c->wide[k].mu = 0;
        c->wide[k].lambda = c->wide[k].bulk = excess;
    }
    return OM_OK;
}

// Arguments of the pass over batches of cells.
static OmStatus fill_batches(OmFemCells* c) {
    OM_ALLOC(c->stiffness, (size_t)c->ncell);
    OM_ALLOC(c->ratio, (size_t)c->ncell);
    OM_ALLOC(c->family, (size_t)om__cell_batches(c));
    for (int k = 0; k < c->ncell; ++k) {
        double lambda, mu, bulk;
        const OmMaterial* material = &c->inner[c->material[k]];
        om_material_lame(material, &lambda, &mu, &bulk);
        c->stiffness[k] = (float)(c->volume[k] * mu);
        c->ratio[k] = (float)(lambda / mu);
        OmFemFamily family = om__fem_family(material), *of = &c->family[k / OM__LANE];
        *of = k % OM__LANE == 0 || *of == family ? family : OM__FAMILY_OTHER;
    }
    return OM_OK;
}

OmJet om__cell_wide(const OmFemCells* c, int material, double t) {
    const OmLawParam* law = &c->wide[material];
    double k = law->lambda;
    if (!om__law_is_split(law)) return (OmJet){0.5 * k * t * t, k * t, k};
    return om__law_volume(law, 1 + t);
}

// ---- creation ---------------------------------------------------------------------------------------

void om__cells_destroy(OmFemCells* c) {
    if (!c) return;
    om_free(c->vert);
    om_free(c->material);
    om_free(c->volume);
    om_free(c->stiffness);
    om_free(c->ratio);
    om_free(c->family);
    om_free(c->adr);
    om_free(c->entry);
    om_free(c->grad);
    om_free(c->t_adr);
    om_free(c->t_entry);
    om_free(c->t_from);
    om_free(c->tet_cell);
    om_free(c->tet_adr);
    om_free(c->tet);
    om_free(c->near_adr);
    om_free(c->near);
    om_free(c->weight);
    om_free(c->share);
    om_free(c->inner);
    om_free(c->wide);
    om_free(c);
}

OmStatus om__cells_create(const OmTissueModel* m, OmFemCells** cells) {
    *cells = om_calloc(1, sizeof **cells);
    if (!*cells) return OM_NO_MEMORY;
    OM_TRY(number_cells(m, *cells));  // freed with the model, also after a failure here
    OM_TRY(split_materials(m, *cells));
    OM_TRY(make_operators(m, *cells));
    return fill_batches(*cells);
}

size_t om__cells_memory(const OmTissueModel* m, const OmFemCells* c) {
    if (!c) return 0;
    size_t n = (size_t)c->ncell, nentry = (size_t)c->adr[n], nnear = (size_t)c->near_adr[n],
           ntet = (size_t)m->mesh.ntet;
    size_t model = n * (sizeof(double) + 2 * sizeof(int) + 2 * sizeof(float)) +
                   ((size_t)m->mesh.nvert + 1) * sizeof(int) +
                   nentry * (2 * sizeof(OmFemEntry) + 3 * sizeof(double) + sizeof(int)) +
                   ntet * 20 * sizeof(int) + nnear * (sizeof(int) + sizeof(float) + sizeof(double));
    return sizeof *c + model + (n * (OM__CELLED + 6) + 12 * ntet) * sizeof(float);
}
