// fem_solid.c: creation of a solid: shape gradients, masses, colours, the matrix pattern.
//
// Elements are coloured greedily in their order so that two of a colour have no common node: a pass over one
// colour may add to nodes and blocks from any thread, and every sum runs in the order of colours for any number
// of workers. Lumped masses are row sums for linear elements; for quadratic ones the diagonal of the consistent
// mass, scaled to the element's (Hinton, Rock and Zienkiewicz 1976), since row sums of corners are negative.
#include "fem/fem_solid.h"

#include <string.h>

#define COOKIE 0x50f7f301u
#define COLOR_WORDS 8  // 64 colours each

OmFemDef om_fem_default_def(const OmFemMesh* mesh, int nmaterial, const OmMaterial* material) {
    return (OmFemDef){.mesh = mesh, .nmaterial = nmaterial, .material = material, .cookie = COOKIE};
}

static OmStatus check_def(const OmFemDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmFemDef was not made by om_fem_default_def");
    OM_CHECK(def->mesh, OM_INVALID, "OmFemDef.mesh is null");
    OM_TRY(om_fem_mesh_validate(def->mesh));
    OM_CHECK(def->nmaterial >= 1 && def->material, OM_INVALID, "OmFemDef.material is missing");
    OM_CHECK(def->nworker >= 0, OM_INVALID, "OmFemDef.nworker = %d, must not be negative",
             def->nworker);
    OM_CHECK(def->locking == OM_LOCKING_NONE ||
                 ((def->locking == OM_NODAL_VOLUME || def->locking == OM_SMOOTHED) &&
                  def->mesh->kind == OM_TET4),
             OM_INVALID, "OmFemDef.locking = %d is not a remedy for elements %s", (int)def->locking,
             om_element_name(def->mesh->kind));
    bool needs_split = def->locking != OM_LOCKING_NONE || def->mesh->kind == OM_HEX8_MEAN;
    for (int k = 0; k < def->nmaterial; ++k) {
        char field[40];
        snprintf(field, sizeof field, "material[%d]", k);
        OM_TRY(om_material_validate(&def->material[k], field));
        OM_CHECK(!def->density || (def->density[k] > 0 && isfinite(def->density[k])), OM_INVALID,
                 "OmFemDef.density[%d] = %g kg/m^3, must be above 0", k, def->density[k]);
        OmLawParam law;
        om__law_init(&def->material[k], &law);
        OM_CHECK(!needs_split || om__law_is_split(&law), OM_INVALID,
                 "%s: law %s has no term in J alone, which %s needs; take another law or element",
                 field, om_law_name(law.law),
                 def->mesh->kind == OM_HEX8_MEAN ? "OM_HEX8_MEAN" : "OmFemDef.locking");
    }
    for (int e = 0; e < def->mesh->nelem; ++e)
        OM_CHECK(def->mesh->elem_material[e] >= 0 && def->mesh->elem_material[e] < def->nmaterial,
                 OM_INVALID, "element %d has material %d, but there are %d", e,
                 def->mesh->elem_material[e], def->nmaterial);
    return OM_OK;
}

// ---- create and destroy -----------------------------------------------------------------------------

static OmStatus copy_def(const OmFemDef* def, OmFemSolid* s) {
    const OmFemMesh* m = def->mesh;
    size_t nnode = (size_t)m->nnode, nelem = (size_t)m->nelem, k = (size_t)m->nelem_node;
    s->mesh = *m;
    s->mesh.x = NULL, s->mesh.elem_node = NULL, s->mesh.elem_material = NULL;
    s->nmaterial = def->nmaterial;
    s->nworker = def->nworker;
    s->locking = def->locking;
    s->is_projected = def->is_projected;
    OM_ALLOC(s->mesh.x, 3 * nnode);
    OM_ALLOC(s->mesh.elem_node, nelem * k);
    OM_ALLOC(s->mesh.elem_material, nelem);
    memcpy(s->mesh.x, m->x, 3 * nnode * sizeof(double));
    memcpy(s->mesh.elem_node, m->elem_node, nelem * k * sizeof(int));
    memcpy(s->mesh.elem_material, m->elem_material, nelem * sizeof(int));
    OM_ALLOC(s->law, def->nmaterial);
    OM_ALLOC(s->density, def->nmaterial);
    for (int n = 0; n < def->nmaterial; ++n) {
        om__law_init(&def->material[n], &s->law[n]);
        s->density[n] = def->density ? def->density[n] : 1000;
    }
    return OM_OK;
}

static OmStatus make_gradients(OmFemSolid* s) {
    OmRule rule;
    om__element_rule(s->mesh.kind, false, &rule);
    size_t k = (size_t)s->mesh.nelem_node, np = (size_t)rule.npoint, ne = (size_t)s->mesh.nelem;
    s->npoint = rule.npoint;
    OM_ALLOC(s->grad, ne * np * k * 3);
    OM_ALLOC(s->weight, ne * np);
    OM_ALLOC(s->volume, ne);
    for (size_t e = 0; e < ne; ++e) {
        const int* node = s->mesh.elem_node + e * k;
        s->volume[e] = 0;
        for (size_t q = 0; q < np; ++q) {
            double N[OM_MAX_ELEM_NODE], dN[3 * OM_MAX_ELEM_NODE];
            om__element_shape(s->mesh.kind, rule.xi[q], N, dN);
            OmMat3 inverse, jac = om__element_jacobian((int)k, dN, s->mesh.x, node);
            OM_TRY(om_mat3_inverse(jac, &inverse));
            double* g = s->grad + (e * np + q) * k * 3;
            for (int a = 0; a < (int)k; ++a)
                om_store3(g, a, om_mat3_apply_transposed(inverse, om_load3(dN, a)));
            s->weight[e * np + q] = rule.weight[q] * om_mat3_det(jac);
            s->volume[e] += s->weight[e * np + q];
        }
    }
    return OM_OK;
}

static OmStatus make_masses(OmFemSolid* s) {
    OmRule rule;
    om__element_rule(s->mesh.kind, true, &rule);
    size_t k = (size_t)s->mesh.nelem_node, ne = (size_t)s->mesh.nelem;
    s->elem_mass = om_calloc(ne * k * k, sizeof(double));
    s->mass = om_calloc((size_t)s->mesh.nnode, sizeof(double));
    if (!s->elem_mass || !s->mass) return OM_NO_MEMORY;
    for (size_t e = 0; e < ne; ++e) {
        const int* node = s->mesh.elem_node + e * k;
        double density = s->density[s->mesh.elem_material[e]], total = 0, trace = 0;
        double* m = s->elem_mass + e * k * k;
        for (int q = 0; q < rule.npoint; ++q) {
            double N[OM_MAX_ELEM_NODE], dN[3 * OM_MAX_ELEM_NODE];
            om__element_shape(s->mesh.kind, rule.xi[q], N, dN);
            double w = density * rule.weight[q] *
                       om_mat3_det(om__element_jacobian((int)k, dN, s->mesh.x, node));
            for (size_t a = 0; a < k; ++a)
                for (size_t b = 0; b < k; ++b) m[a * k + b] += w * N[a] * N[b];
            total += w;
        }
        for (size_t a = 0; a < k; ++a) trace += m[a * k + a];
        for (size_t a = 0; a < k; ++a) {
            double row = 0;
            for (size_t b = 0; b < k; ++b) row += m[a * k + b];
            s->mass[node[a]] += k == 10 ? m[a * k + a] * total / trace : row;  // trace > 0
        }
    }
    return OM_OK;
}

static OmStatus list_node_elements(OmFemSolid* s) {
    size_t n = (size_t)s->mesh.nelem * (size_t)s->mesh.nelem_node;
    s->node_adr = om_calloc((size_t)s->mesh.nnode + 2, sizeof(int));
    OM_ALLOC(s->node_elem, n);
    if (!s->node_adr) return OM_NO_MEMORY;
    for (size_t m = 0; m < n; ++m) ++s->node_adr[s->mesh.elem_node[m] + 2];
    for (int i = 0; i < s->mesh.nnode; ++i) s->node_adr[i + 2] += s->node_adr[i + 1];
    for (size_t m = 0; m < n; ++m)
        s->node_elem[s->node_adr[s->mesh.elem_node[m] + 1]++] =
            (int)(m / (size_t)s->mesh.nelem_node);
    return OM_OK;
}

OmStatus om__fem_color(int nnode, int ncell, const int* adr, int k, const int* node,
                       OmColors* out) {
    OmStatus status = OM_OK;
    uint64_t* used = NULL;  // colours of the cells around each node
    int* color = NULL;
    OM_CALLOC_DONE(used, (size_t)nnode * COLOR_WORDS);
    OM_ALLOC_DONE(color, ncell);
    OM_CALLOC_DONE(out->adr, 64 * COLOR_WORDS + 2);
    OM_ALLOC_DONE(out->cell, ncell);
    for (int e = 0; e < ncell; ++e) {
        size_t begin = adr ? (size_t)adr[e] : (size_t)e * (size_t)k;
        size_t end = adr ? (size_t)adr[e + 1] : begin + (size_t)k;
        int c = -1;
        for (size_t w = 0; w < COLOR_WORDS && c < 0; ++w) {
            uint64_t taken = 0;
            for (size_t a = begin; a < end; ++a) taken |= used[(size_t)node[a] * COLOR_WORDS + w];
            for (int bit = 0; bit < 64 && c < 0; ++bit)
                if (!(taken >> bit & 1)) c = 64 * (int)w + bit;
        }
        OM_CHECK_DONE(c >= 0, OM_INVALID, "a node is shared by more than %d elements or patches",
                      64 * COLOR_WORDS);
        for (size_t a = begin; a < end; ++a)
            used[(size_t)node[a] * COLOR_WORDS + (size_t)(c / 64)] |= (uint64_t)1 << (c % 64);
        color[e] = c;
        ++out->adr[c + 2];
        if (c >= out->num) out->num = c + 1;
    }
    for (int c = 0; c < out->num; ++c) out->adr[c + 2] += out->adr[c + 1];
    for (int e = 0; e < ncell; ++e) out->cell[out->adr[color[e] + 1]++] = e;
done:
    om_free(used);
    om_free(color);
    return status;
}

static OmStatus find_blocks(OmFemSolid* s) {
    OmBsr A;
    OM_TRY(om_fem_matrix_create(s, &A));
    size_t k = (size_t)s->mesh.nelem_node;
    OmStatus status = OM_NO_MEMORY;
    s->elem_adr = om_alloc((size_t)s->mesh.nelem * k * k, sizeof(int));
    if (s->elem_adr)
        status = om_bsr_find_elements(&A, s->mesh.nelem, s->mesh.nelem_node, s->mesh.elem_node,
                                      s->elem_adr);
    om_bsr_destroy(&A);
    return status;
}

static OmStatus make_node_volumes(OmFemSolid* s) {
    if (s->locking == OM_LOCKING_NONE) return OM_OK;
    s->node_volume = om_calloc((size_t)s->mesh.nnode, sizeof(double));
    if (!s->node_volume) return OM_NO_MEMORY;
    for (size_t m = 0; m < 4 * (size_t)s->mesh.nelem; ++m)
        s->node_volume[s->mesh.elem_node[m]] += 0.25 * s->volume[m / 4];
    return OM_OK;
}

OmStatus om_fem_create(const OmFemDef* def, OmFemSolid** out) {
    *out = NULL;
    OM_TRY(check_def(def));
    OmStatus status = OM_OK;
    OmFemSolid* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OM_TRY_DONE(copy_def(def, s));
    OM_TRY_DONE(make_gradients(s));
    s->has_octets = om__octet_fits(s);
    OM_TRY_DONE(make_masses(s));
    OM_TRY_DONE(list_node_elements(s));
    OM_TRY_DONE(om__fem_color(s->mesh.nnode, s->mesh.nelem, NULL, s->mesh.nelem_node,
                              s->mesh.elem_node, &s->colors));
    if (s->locking == OM_SMOOTHED) OM_TRY_DONE(om__fem_make_patches(s, &s->patches));
    OM_TRY_DONE(make_node_volumes(s));
    OM_TRY_DONE(om__contact_create(s, def->ncontact, def->contact));
    OM_TRY_DONE(find_blocks(s));
    *out = s;
done:
    if (status < 0) om_fem_destroy(s);
    return status;
}

void om_fem_destroy(OmFemSolid* s) {
    if (!s) return;
    om_fem_mesh_done(&s->mesh);
    om__fem_destroy_patches(&s->patches);
    om__contact_destroy(s);
    void* array[] = {s->law,       s->density,     s->grad,       s->weight,   s->volume,
                     s->mass,      s->elem_adr,    s->colors.adr, s->node_adr, s->elem_mass,
                     s->node_elem, s->colors.cell, s->node_volume};
    for (size_t k = 0; k < sizeof array / sizeof *array; ++k) om_free(array[k]);
    om_free(s);
}

const OmFemMesh* om_fem_mesh(const OmFemSolid* solid) { return &solid->mesh; }
const double* om_fem_mass(const OmFemSolid* solid) { return solid->mass; }

// ---- matrix and mass --------------------------------------------------------------------------------

// Pairs of nodes that the energy couples: of an element, of the patch of a node (for nodal volumes), of two sides
// of a contact.
static OmStatus coupled_pairs(const OmFemSolid* s, int** out, int* npair) {
    OmStatus status = OM_OK;
    OmBsr graph;
    bool is_nodal = s->locking != OM_LOCKING_NONE;
    *out = NULL;
    OM_TRY(
        om_bsr_create(s->mesh.nnode, s->mesh.nelem, s->mesh.nelem_node, s->mesh.elem_node, &graph));
    int64_t ntouch = om__contact_pairs(s, NULL), num = is_nodal ? 0 : graph.nedge;
    for (int i = 0; i < s->mesh.nnode && is_nodal; ++i) {
        int64_t n = graph.row_adr[i + 1] - graph.row_adr[i];
        num += n * (n - 1) / 2;
    }
    OM_CHECK_DONE(num + ntouch < INT32_MAX / 2, OM_INVALID, "%s: the mesh is too large",
                  is_nodal ? "OM_NODAL_VOLUME" : "OmFemDef.contact");
    OM_ALLOC_DONE(*out, 2 * (num + ntouch));
    if (!is_nodal) memcpy(*out, graph.edge_vert, 2 * (size_t)num * sizeof(int));
    *npair = is_nodal ? 0 : (int)num;
    for (int i = 0; i < s->mesh.nnode && is_nodal; ++i)
        for (int a = graph.row_adr[i]; a < graph.row_adr[i + 1]; ++a)
            for (int b = graph.row_adr[i]; b < a; ++b, ++*npair) {
                (*out)[2 * *npair] = graph.col[a];
                (*out)[2 * *npair + 1] = graph.col[b];
            }
    *npair += (int)om__contact_pairs(s, *out + 2 * *npair);
done:
    om_bsr_destroy(&graph);
    return status;
}

OmStatus om_fem_matrix_create(const OmFemSolid* s, OmBsr* A) {
    *A = (OmBsr){0};
    OmStatus status;
    if (s->locking != OM_LOCKING_NONE || s->ncontact > 0) {
        int *pair, npair = 0;
        OM_TRY(coupled_pairs(s, &pair, &npair));
        status = om_bsr_create(s->mesh.nnode, npair, 2, pair, A);
        om_free(pair);
    } else {
        status =
            om_bsr_create(s->mesh.nnode, s->mesh.nelem, s->mesh.nelem_node, s->mesh.elem_node, A);
    }
    if (status == OM_OK) status = om_bsr_make_exact(A);
    if (status < 0) om_bsr_destroy(A);
    return status;
}

void om_fem_add_mass(const OmFemSolid* s, double scale, bool is_consistent, OmBsr* A) {
    size_t k = (size_t)s->mesh.nelem_node;
    for (int i = 0; i < s->mesh.nnode && !is_consistent; ++i) {
        double m = scale * s->mass[i];
        om_bsr_add(A, A->row_adr[i], om_mat3_diag(om_vec3(m, m, m)));
    }
    for (size_t n = 0; n < (size_t)s->mesh.nelem * k * k && is_consistent; ++n) {
        double m = scale * s->elem_mass[n];
        om_bsr_add(A, s->elem_adr[n], om_mat3_diag(om_vec3(m, m, m)));
    }
}

void om_fem_apply_mass(const OmFemSolid* s, bool is_consistent, const double* x, double* y) {
    size_t k = (size_t)s->mesh.nelem_node;
    memset(y, 0, 3 * (size_t)s->mesh.nnode * sizeof *y);
    for (int i = 0; i < s->mesh.nnode && !is_consistent; ++i)
        om_store3(y, i, om_scale(s->mass[i], om_load3(x, i)));
    for (size_t e = 0; e < (size_t)s->mesh.nelem && is_consistent; ++e) {
        const int* node = s->mesh.elem_node + e * k;
        const double* m = s->elem_mass + e * k * k;
        for (size_t a = 0; a < k; ++a) {
            OmVec3 sum = om_load3(y, node[a]);
            for (size_t b = 0; b < k; ++b) sum = om_madd(sum, m[a * k + b], om_load3(x, node[b]));
            om_store3(y, node[a], sum);
        }
    }
}
