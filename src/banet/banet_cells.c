// banet_cells.c: the cells of a sample that are stored, and their mirror images and quarter turns.
//
// A cell beyond OM_BANET_CLIP voxels outside of the body has the same input in every sample: clipped distance, no
// displacement. All other cells are stored, about 8,000 of 37,000 (48 x 48 x 16). Values are multiples of 1/256 voxel
// (18 um at 300 mm), which compress to half of the size of single precision floats with equal significance.
#include <string.h>

#include "omentum/banet_data.h"

void om_banet_cells_done(OmBanetCells* c) {
    if (!c) return;
    om_free(c->cell);
    om_free(c->value);
    om_free(c->kind);
    *c = (OmBanetCells){0};
}

// ---- from a sample ----------------------------------------------------------------------------------

static OmBanetFacts facts_of(const OmBanetSample* s) {
    OmBanetFacts f = {.index = (int)s->index,
                      .is_camera = s->is_camera,
                      .has_board = s->has_board,
                      .nregion = s->nregion,
                      .nvert = s->mesh.nvert,
                      .ntet = s->mesh.ntet,
                      .nsurface = s->surface.nvert,
                      .nattempt = s->nattempt,
                      .nfail = s->nfail,
                      .young = s->material.young,
                      .poisson = s->material.poisson,
                      .force = om_norm(s->force),
                      .share = s->share,
                      .visible = s->visible,
                      .max_u = s->max_u,
                      .min_volume = s->min_volume,
                      .residual = s->residual,
                      .seconds = s->seconds};
    for (int i = 0; i < s->surface.nvert; ++i) f.nattached += s->attached[i] != 0;
    return f;
}

// Copy the cells near the body. kind: of all cells of the grid.
static OmStatus pack(const float* in, const unsigned char* kind, OmBanetCells* c) {
    const size_t n = om_grid_count(c->grid.dim);
    OmStatus status = OM_OK;
    size_t num = 0;
    for (size_t i = 0; i < n; ++i) num += (double)in[i] < OM_BANET_CLIP;
    OM_ALLOC_DONE(c->cell, num);
    OM_ALLOC_DONE(c->value, OM_BANET_NCHANNEL * num);
    OM_ALLOC_DONE(c->kind, num);
    for (size_t i = 0, at = 0; i < n; ++i) {
        if (!((double)in[i] < OM_BANET_CLIP)) continue;
        c->cell[at] = (int)i;
        c->kind[at] = (unsigned char)(kind[i] | ((double)in[i] < 1 ? OM_BANET_NEAR : 0));
        for (size_t k = 0; k < OM_BANET_NCHANNEL; ++k) {
            double v = rint((double)in[k * n + i] * OM_BANET_UNIT);
            OM_CHECK_DONE(fabs(v) <= INT16_MAX, OM_INVALID,
                          "sample %d: a displacement of %.3g voxels; take a larger side",
                          c->fact.index, (double)in[k * n + i]);
            c->value[k * num + at] = (int16_t)v;
        }
        ++at;
    }
    c->ncell = (int)num;
done:
    return status;
}

OmStatus om_banet_cells_make(const OmBanetSample* s, double side, OmBanetCells* c) {
    OmStatus status = OM_OK;
    float* in = NULL;
    unsigned char* kind = NULL;
    int* vert_cell = NULL;
    *c = (OmBanetCells){.fact = facts_of(s)};
    OM_TRY_DONE(om_banet_grid_fit(&s->surface, side, &c->grid));
    const size_t n = om_grid_count(c->grid.dim);
    OM_ALLOC_DONE(in, OM_BANET_NCHANNEL * n);
    OM_CALLOC_DONE(kind, n);
    OM_ALLOC_DONE(vert_cell, s->surface.nvert);
    OM_TRY_DONE(om_banet_voxelize(&c->grid, &s->surface, s->u, s->seen, in));
    om_banet_find_cells(&c->grid, &s->surface, vert_cell);
    for (int i = 0; i < s->surface.nvert; ++i)
        kind[vert_cell[i]] |= s->attached[i] ? OM_BANET_ATTACHED | OM_BANET_SURFACE  // inside: fit
                                             : OM_BANET_SURFACE;
    OM_TRY_DONE(pack(in, kind, c));
done:
    om_free(in);
    om_free(kind);
    om_free(vert_cell);
    if (status < 0) om_banet_cells_done(c);
    return status;
}

// ---- into a grid ------------------------------------------------------------------------------------

// Turn (x, y) by quarter turns about (0, 0).
static void turn(int nturn, int* x, int* y) {
    for (int k = 0; k < (nturn & 3); ++k) {
        const int old = *x;
        *x = -*y;
        *y = old;
    }
}

bool om_banet_cell_turn(const int from[3], const int to[3], const int shift[3], int symmetry,
                        const int at[3], int out[3]) {
    int p[3], size[3] = {from[0], from[1], from[2]};
    for (int c = 0; c < 3; ++c) p[c] = 2 * at[c] - (from[c] - 1);  // halves, from the middle
    turn(symmetry, &p[0], &p[1]);
    if (symmetry & 4) p[0] = -p[0];
    if (symmetry & 8) p[2] = -p[2];
    if (symmetry & 1) size[0] = from[1], size[1] = from[0];
    for (int c = 0; c < 3; ++c)
        out[c] = (p[c] + size[c] - 1) / 2 + (to[c] - size[c]) / 2 + (shift ? shift[c] : 0);
    return om_grid_has(to, out[0], out[1], out[2]);
}

OmStatus om_banet_cells_expand(const OmBanetCells* cells, const int dim[3], const int shift[3],
                               int symmetry, float* in, float* target, float* weight) {
    const size_t n = om_grid_count(dim), num = (size_t)cells->ncell;
    for (size_t i = 0; i < n; ++i) in[i] = (float)OM_BANET_CLIP;
    memset(in + n, 0, (OM_BANET_NCHANNEL - 1) * n * sizeof *in);
    if (target) memset(target, 0, n * sizeof *target);
    if (weight) memset(weight, 0, n * sizeof *weight);
    for (size_t i = 0; i < num; ++i) {
        int at[3], to[3];
        om_grid_unpack(cells->grid.dim, (size_t)cells->cell[i], at);
        OM_CHECK(om_banet_cell_turn(cells->grid.dim, dim, shift, symmetry, at, to), OM_INVALID,
                 "sample %d: its %d x %d x %d cells do not fit into %d x %d x %d",
                 cells->fact.index, cells->grid.dim[0], cells->grid.dim[1], cells->grid.dim[2],
                 dim[0], dim[1], dim[2]);
        float* cell = in + om_grid_index(dim, to[0], to[1], to[2]);
        const int16_t* v = cells->value + i;
        int u[3] = {v[num * OM_BANET_UX], v[num * OM_BANET_UY], v[num * OM_BANET_UZ]};
        turn(symmetry, &u[0], &u[1]);
        if (symmetry & 4) u[0] = -u[0];
        if (symmetry & 8) u[2] = -u[2];
        cell[0] = (float)v[0] / OM_BANET_UNIT;
        for (size_t c = 0; c < 3; ++c) cell[(OM_BANET_UX + c) * n] = (float)u[c] / OM_BANET_UNIT;
        cell[OM_BANET_SEEN * n] = (float)v[num * OM_BANET_SEEN] / OM_BANET_UNIT;
        const size_t to_cell = (size_t)(cell - in);
        if (target) target[to_cell] = cells->kind[i] & OM_BANET_ATTACHED ? 1 : 0;
        if (weight) weight[to_cell] = cells->kind[i] & OM_BANET_NEAR ? 1 : 0;
    }
    return OM_OK;
}
