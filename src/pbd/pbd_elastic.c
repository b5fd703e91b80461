// pbd_elastic.c: XPBD on tetrahedra, stable neo-Hookean (Macklin and Mueller 2021, "A constraint-based formulation
// of stable neo-Hookean materials"; the law is OM_STABLE_NEO_HOOKEAN of tissue_material.h).
//
// W = mu/2 (I1 - 3) + (lambda + mu)/2 (J - gamma)^2 + const., gamma = 1 + mu / (lambda + mu), is the energy
// C^2 / (2 alpha) of two constraints: J - gamma with the compliance 1 / ((lambda + mu) V) and sqrt(I1) with 1 /
// (mu V). At rest neither is zero and their forces cancel, so each element solves for both multipliers at once.
//
// Multipliers do not begin a substep at zero, as in the paper, but at the values of the positions at its
// beginning, limited to what an explicit step can bear: equilibrium stays equilibrium for any substep and any
// number of iterations. From zero, elements move before their multipliers converge, which rotates the gradients
// already used: an indentation had 10 % too little force at 20 substeps.
//
// Elements are coloured so that those of one colour have no common vertex: a parallel Gauss-Seidel scheme with
// the same bytes for any number of workers.
#include <string.h>

#include "base/base_multiversion.h"
#include "pbd/pbd_internal.h"

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

#define LANE OM__PBD_LANE
#define MOST 1e200  // a larger multiplier is not used
#define NWORD 8     // of 64 colours: more than elements at a vertex of any practical mesh
// h^2 stiffness / mass of an element up to which it starts with its whole force
#define EXPLICIT 1.0
#define VISCOUS 0.5         // of mu V sum |grad|^2 / m: a sheared block then decays as it should
#define LEAST_STRETCH 1e-6  // sqrt(I1) below which it has no direction

// The first colour that is free at all of the element's vertices; -1 if there is none.
static int free_color(const uint64_t* seen, const int* vert) {
    for (int w = 0; w < NWORD; ++w) {
        uint64_t all = 0;
        for (int a = 0; a < 4; ++a) all |= seen[(size_t)vert[a] * NWORD + (size_t)w];
        if (all == UINT64_MAX) continue;
        int bit = 0;
        while (all >> bit & 1) ++bit;
        return 64 * w + bit;
    }
    return -1;
}

// Colour of each element, and the number of elements of each colour.
static OmStatus color_elements(const OmTetMesh* mesh, int* color, int count[64 * NWORD]) {
    uint64_t* seen = om_calloc((size_t)mesh->nvert * NWORD, sizeof *seen);
    if (!seen) return OM_NO_MEMORY;
    OmStatus status = OM_OK;
    for (int e = 0; e < mesh->ntet; ++e) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        int c = free_color(seen, v);
        OM_CHECK_DONE(c >= 0, OM_INVALID,
                      "pbd: more than %d elements around element %d share its vertices", 64 * NWORD,
                      e);
        color[e] = c;
        ++count[c];
        for (int a = 0; a < 4; ++a)
            seen[(size_t)v[a] * NWORD + (size_t)(c / 64)] |= 1ull << (c % 64);
    }
done:
    om_free(seen);
    return status;
}

static OmStatus make_element(const OmTissueModel* m, int e, OmPbdTet* t) {
    const OmTetMesh* mesh = &m->mesh;
    memcpy(t->vert, mesh->tet_vert + 4 * (size_t)e, sizeof t->vert);
    OmVec3 o = om_load3(mesh->x, t->vert[0]), a = om_sub(om_load3(mesh->x, t->vert[1]), o),
           b = om_sub(om_load3(mesh->x, t->vert[2]), o),
           c = om_sub(om_load3(mesh->x, t->vert[3]), o);
    double inverse = 1 / (6 * m->volume[e]), lambda, mu, bulk;
    om_store3(t->grad, 0, om_scale(inverse, om_cross(b, c)));
    om_store3(t->grad, 1, om_scale(inverse, om_cross(c, a)));
    om_store3(t->grad, 2, om_scale(inverse, om_cross(a, b)));
    for (int k = 0; k < 9; ++k)
        OM_CHECK(isfinite(t->grad[k]) && fabs(t->grad[k]) < 1e15, OM_INVALID,
                 "pbd: element %d is too flat to compute with (volume %g m^3)", e, m->volume[e]);
    const OmMaterial* material = &m->def.material[m->def.nmaterial > 0 ? mesh->tet_label[e] : 0];
    om_material_lame(material, &lambda, &mu, &bulk);
    t->gamma = 1 + mu / (lambda + mu);
    t->volume_compliance = 1 / ((lambda + mu) * m->volume[e]);
    t->shape_compliance = 1 / (mu * m->volume[e]);
    // one rate for all modes: the trace of the shear stiffness over the masses is 4 mu V |grad|^2 / m
    OmVec3 g0 = {0, 0, 0};
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        OmVec3 g = om_load3(t->grad, k);
        sum += om_norm2(g) / m->mass[t->vert[k + 1]];
        g0 = om_sub(g0, g);
    }
    t->viscous_rate = VISCOUS * mu * m->volume[e] * (sum + om_norm2(g0) / m->mass[t->vert[0]]);
    return OM_OK;
}

// Elements by colour into lanes.
static OmStatus fill_batches(OmPbdElastic* el) {
    el->batch_adr = om_calloc((size_t)el->ncolor + 1, sizeof *el->batch_adr);
    if (!el->batch_adr) return OM_NO_MEMORY;
    for (int c = 0; c < el->ncolor; ++c)
        el->batch_adr[c + 1] =
            el->batch_adr[c] + (el->color_adr[c + 1] - el->color_adr[c] + LANE - 1) / LANE;
    OM_ALLOC(el->batch, el->batch_adr[el->ncolor]);
    for (int c = 0; c < el->ncolor; ++c)
        for (int n = el->batch_adr[c]; n < el->batch_adr[c + 1]; ++n) {
            OmPbdBatch* b = &el->batch[n];
            int first = el->color_adr[c] + (n - el->batch_adr[c]) * LANE;
            b->num = el->color_adr[c + 1] - first < LANE ? el->color_adr[c + 1] - first : LANE;
            for (int l = 0; l < LANE; ++l) {
                const OmPbdTet* t = &el->tet[first + (l < b->num ? l : b->num - 1)];
                for (int a = 0; a < 4; ++a) b->vert[a][l] = t->vert[a];
                for (int k = 0; k < 9; ++k) b->grad[k][l] = t->grad[k];
                b->gamma[l] = t->gamma;
                b->volume_compliance[l] = t->volume_compliance;
                b->shape_compliance[l] = t->shape_compliance;
                b->viscous_rate[l] = t->viscous_rate;
            }
        }
    return OM_OK;
}

OmStatus om__pbd_make_elastic(const OmTissueModel* m, OmPbdElastic* el) {
    int ntet = m->mesh.ntet, count[64 * NWORD] = {0};
    OM_CHECK(ntet > 0, OM_INVALID,
             "pbd: kinds OM_PBD_ELASTIC and OM_PBD_LENGTHS need a mesh with elements");
    OmStatus status = OM_OK;
    int *color = NULL, *next = NULL;
    OM_ALLOC_DONE(color, ntet);
    OM_ALLOC_DONE(el->tet, ntet);
    OM_CALLOC_DONE(next, 64 * NWORD + 1);
    OM_TRY_DONE(color_elements(&m->mesh, color, count));
    while (el->ncolor < 64 * NWORD && count[el->ncolor] > 0) ++el->ncolor;
    OM_CALLOC_DONE(el->color_adr, (size_t)el->ncolor + 1);
    for (int c = 0; c < el->ncolor; ++c)
        el->color_adr[c + 1] = next[c + 1] = el->color_adr[c] + count[c];
    for (int e = 0; e < ntet; ++e) OM_TRY_DONE(make_element(m, e, &el->tet[next[color[e]]++]));
    el->ntet = ntet;
    OM_TRY_DONE(fill_batches(el));
done:
    om_free(color);
    om_free(next);
    return status;
}

void om__pbd_elastic_done(OmPbdElastic* el) {
    om_free(el->tet);
    om_free(el->color_adr);
    om_free(el->length);
    om_free(el->batch);
    om_free(el->batch_adr);
    *el = (OmPbdElastic){0};
}

// F by columns, the gradients of both constraints at vertices 1, 2, 3 (then 0 is less their sum), and sqrt(I1).
typedef struct Strain {
    OmVec3 volume[4], shape[4];
    double J, stretch;
} Strain;

static inline void strain_of(const OmPbdTet* t, const double* x, Strain* s) {
    OmVec3 o = om_load3(x, t->vert[0]), f[3], cof[3];
    OmVec3 d1 = om_sub(om_load3(x, t->vert[1]), o), d2 = om_sub(om_load3(x, t->vert[2]), o),
           d3 = om_sub(om_load3(x, t->vert[3]), o);
    const double* g = t->grad;
    for (int c = 0; c < 3; ++c)
        f[c] = om_madd(om_madd(om_scale(g[c], d1), g[3 + c], d2), g[6 + c], d3);
    for (int c = 0; c < 3; ++c) cof[c] = om_cross(f[(c + 1) % 3], f[(c + 2) % 3]);
    s->J = om_dot(f[0], cof[0]);
    s->stretch = sqrt(om_norm2(f[0]) + om_norm2(f[1]) + om_norm2(f[2]));
    double inverse = s->stretch > LEAST_STRETCH ? 1 / s->stretch : 0;
    s->volume[0] = s->shape[0] = om_vec3(0, 0, 0);
    for (int a = 0; a < 3; ++a) {
        const double* ga = g + 3 * a;
        s->volume[a + 1] = om_madd(om_madd(om_scale(ga[0], cof[0]), ga[1], cof[1]), ga[2], cof[2]);
        OmVec3 Fg = om_madd(om_madd(om_scale(ga[0], f[0]), ga[1], f[1]), ga[2], f[2]);
        s->shape[a + 1] = om_scale(inverse, Fg);
        s->volume[0] = om_sub(s->volume[0], s->volume[a + 1]);
        s->shape[0] = om_sub(s->shape[0], s->shape[a + 1]);
    }
}

// ---- eight elements at once ----------------------------------------------------------------------------

typedef double Lanes[LANE];

typedef struct Gradients {  // of both constraints at the four vertices, and their values
    Lanes volume[12], shape[12], J, stretch;
} Gradients;

INLINE void find_gradients(const OmPbdBatch* restrict b, const double* restrict x,
                           Gradients* restrict out) {
    Lanes p[12];
    for (int a = 0; a < 4; ++a)
        for (int l = 0; l < LANE; ++l)
            for (int c = 0; c < 3; ++c) p[3 * a + c][l] = x[3 * (size_t)b->vert[a][l] + (size_t)c];
    for (int l = 0; l < LANE; ++l) {
        double f[9], k[9], J = 0, I1 = 0;  // F and its cofactor by columns
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r)
                f[3 * c + r] = b->grad[c][l] * (p[3 + r][l] - p[r][l]) +
                               b->grad[3 + c][l] * (p[6 + r][l] - p[r][l]) +
                               b->grad[6 + c][l] * (p[9 + r][l] - p[r][l]);
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) {
                int c1 = 3 * ((c + 1) % 3), c2 = 3 * ((c + 2) % 3), r1 = (r + 1) % 3,
                    r2 = (r + 2) % 3;
                k[3 * c + r] = f[c1 + r1] * f[c2 + r2] - f[c1 + r2] * f[c2 + r1];
            }
        for (int r = 0; r < 3; ++r) J += f[r] * k[r];
        for (int n = 0; n < 9; ++n) I1 += f[n] * f[n];
        double stretch = sqrt(I1), inverse = stretch > LEAST_STRETCH ? 1 / stretch : 0;
        for (int r = 0; r < 3; ++r) {
            double sum_k = 0, sum_f = 0;
            for (int a = 0; a < 3; ++a) {
                double gk = b->grad[3 * a][l] * k[r] + b->grad[3 * a + 1][l] * k[3 + r] +
                            b->grad[3 * a + 2][l] * k[6 + r];
                double gf = b->grad[3 * a][l] * f[r] + b->grad[3 * a + 1][l] * f[3 + r] +
                            b->grad[3 * a + 2][l] * f[6 + r];
                gf *= inverse;
                out->volume[3 * (a + 1) + r][l] = gk;
                out->shape[3 * (a + 1) + r][l] = gf;
                sum_k += gk, sum_f += gf;
            }
            out->volume[r][l] = -sum_k;
            out->shape[r][l] = -sum_f;
        }
        out->J[l] = J;
        out->stretch[l] = stretch;
    }
}

// grad C^T w grad C of both constraints and between them.
INLINE void find_give(const OmPbdBatch* restrict b, const double* restrict give,
                      const Gradients* restrict g, Lanes hh, Lanes dd, Lanes hd) {
    Lanes w[4];
    for (int a = 0; a < 4; ++a)
        for (int l = 0; l < LANE; ++l) w[a][l] = give[b->vert[a][l]];
    for (int l = 0; l < LANE; ++l) {
        double vv = 0, ss = 0, vs = 0;
        for (int n = 0; n < 12; ++n) {
            double v = g->volume[n][l], s = g->shape[n][l];
            vv += w[n / 3][l] * v * v;
            ss += w[n / 3][l] * s * s;
            vs += w[n / 3][l] * v * s;
        }
        hh[l] = vv, dd[l] = ss, hd[l] = vs;
    }
}

// Displacement of vertices by the multipliers: x += w grad C l; for a prescribed vertex it is a reaction.
INLINE void apply_multipliers(const OmPbdStep* s, const OmPbdBatch* b, const Gradients* g,
                              const Lanes lh, const Lanes ld) {
    Lanes d[12];
    for (int n = 0; n < 12; ++n)
        for (int l = 0; l < LANE; ++l) d[n][l] = lh[l] * g->volume[n][l] + ld[l] * g->shape[n][l];
    double per_force = 1 / (s->sub * s->h);
    for (int l = 0; l < b->num; ++l)
        for (int a = 0; a < 4; ++a) {
            int i = b->vert[a][l];
            double give = s->w->give[i], way = give > 0 ? give : -per_force;
            double* to = (give > 0 ? s->x : s->w->hold) + 3 * (size_t)i;
            for (int c = 0; c < 3; ++c) to[c] += way * d[3 * a + c][l];
        }
}

// Initial multipliers: those of the positions at the beginning of the substep, -C sub^2 / alpha, or the
// fraction of them that an explicit step can bear.
OM_MULTIVERSION void om__pbd_start_elements(const OmPbdStep* s, int begin, int end) {
    double sub2 = s->sub * s->sub;
    for (int n = begin; n < end; ++n) {
        const OmPbdBatch* b = &s->pbd->elastic.batch[n];
        Gradients g;
        Lanes hh, dd, hd;
        find_gradients(b, s->w->begin, &g);
        find_give(b, s->w->give, &g, hh, dd, hd);
        double *lh = s->w->lambda + 2 * LANE * (size_t)n, *ld = lh + LANE;
        for (int l = 0; l < LANE; ++l) {
            double kv = sub2 / b->volume_compliance[l], ks = sub2 / b->shape_compliance[l];
            double stiff = hh[l] * kv + dd[l] * ks;
            double part = stiff > EXPLICIT ? EXPLICIT / stiff : 1;
            double h = part * kv * (b->gamma[l] - g.J[l]), d = -part * ks * g.stretch[l];
            bool is_good = fabs(h) < MOST && fabs(d) < MOST;
            lh[l] = is_good ? h : 0;
            ld[l] = is_good ? d : 0;
        }
        apply_multipliers(s, b, &g, lh, ld);
    }
}

// Both multipliers of an element by the 2 x 2 system (W + alpha / sub^2) dl = -C - alpha / sub^2 l.
OM_MULTIVERSION void om__pbd_solve_elements(const OmPbdStep* s, int begin, int end) {
    double per = 1 / (s->sub * s->sub);
    for (int n = begin; n < end; ++n) {
        const OmPbdBatch* b = &s->pbd->elastic.batch[n];
        Gradients g;
        Lanes hh, dd, hd, more_h, more_d;
        find_gradients(b, s->x, &g);
        find_give(b, s->w->give, &g, hh, dd, hd);
        double *lh = s->w->lambda + 2 * LANE * (size_t)n, *ld = lh + LANE;
        for (int l = 0; l < LANE; ++l) {
            double av = b->volume_compliance[l] * per, as = b->shape_compliance[l] * per;
            double rh = b->gamma[l] - g.J[l] - av * lh[l], rd = -g.stretch[l] - as * ld[l];
            double h = hh[l] + av, d = dd[l] + as, det = h * d - hd[l] * hd[l];
            // compliances make it positive, but for overflow
            double inverse = det > 0 ? 1 / det : 0;
            double mh = inverse * (d * rh - hd[l] * rd), md = inverse * (h * rd - hd[l] * rh);
            bool is_good = fabs(mh) < MOST && fabs(md) < MOST;
            more_h[l] = is_good ? mh : 0;
            more_d[l] = is_good ? md : 0;
            lh[l] += more_h[l];
            ld[l] += more_d[l];
        }
        apply_multipliers(s, b, &g, more_h, more_d);
    }
}

// ---- internal friction ---------------------------------------------------------------------------------

// After each substep, element by element, velocities move a fraction of the distance to the rigid motion with the
// momentum of the element's vertices. This is an orthogonal projection in the masses: it dissipates energy and
// conserves momentum for any deformation. Prescribed vertices take their part as a reaction. The fraction is that
// of a viscous shear stress; one pass a substep damps long waves up to a viscosity of about edge^2 density / sub.
//
// Where no time of friction is given, it acts on the change of velocities since the step began, as long as energy
// falls: like implicit Euler it damps changes within two steps, and does not act on a steady motion. Without it a cube
// that is dropped bounces for seconds and comes to rest far aside (doc/notes/pbd.md). Rejected: viscous constraints on
// the rate of the Green strain (strongly stretched elements lock, and forces at the end of the substep make a spin
// grow); colours in alternating order (no better).
typedef struct Motion {
    Lanes x[12], mass[4];  // at the vertices
    // velocity, relative to the rigid part, and the rest of it; out: v, the change
    Lanes v[12], old[12];
} Motion;

INLINE void fit_motion(Motion* m, Lanes part) {
    for (int l = 0; l < LANE; ++l) {
        double total = 0, c[3] = {0, 0, 0}, u[3] = {0, 0, 0}, L[3] = {0, 0, 0};
        double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
        for (int a = 0; a < 4; ++a) {
            total += m->mass[a][l];
            for (int k = 0; k < 3; ++k) {
                c[k] += m->mass[a][l] * m->x[3 * a + k][l];
                u[k] += m->mass[a][l] * m->v[3 * a + k][l];
            }
        }
        double inverse = 1 / total;  // masses are above 0
        for (int k = 0; k < 3; ++k) c[k] *= inverse, u[k] *= inverse;
        for (int a = 0; a < 4; ++a) {
            double w = m->mass[a][l], x = m->x[3 * a][l] - c[0], y = m->x[3 * a + 1][l] - c[1],
                   z = m->x[3 * a + 2][l] - c[2];
            double p = m->v[3 * a][l], q = m->v[3 * a + 1][l], s = m->v[3 * a + 2][l];
            L[0] += w * (y * s - z * q), L[1] += w * (z * p - x * s), L[2] += w * (x * q - y * p);
            xx += w * x * x, yy += w * y * y, zz += w * z * z;
            xy += w * x * y, xz += w * x * z, yz += w * y * z;
        }
        // inertia [[yy + zz, -xy, -xz], ...] by its cofactors; singular where all vertices are on a line
        double A = yy + zz, B = xx + zz, C = xx + yy;
        double aa = B * C - yz * yz, ab = xz * yz + xy * C, ac = xy * yz + xz * B;
        double bb = A * C - xz * xz, bc = xy * xz + A * yz, cc = A * B - xy * xy;
        double det = A * aa - xy * ab - xz * ac, size = A + B + C;
        bool is_good = det > 1e-9 * size * size * size;
        double d = is_good ? 1 / det : 0;
        double wx = d * (aa * L[0] + ab * L[1] + ac * L[2]);
        double wy = d * (ab * L[0] + bb * L[1] + bc * L[2]);
        double wz = d * (ac * L[0] + bc * L[1] + cc * L[2]);
        double loss = 0, norm = 0;
        for (int a = 0; a < 4; ++a) {
            double x = m->x[3 * a][l] - c[0], y = m->x[3 * a + 1][l] - c[1],
                   z = m->x[3 * a + 2][l] - c[2], mass = m->mass[a][l];
            double p = m->v[3 * a][l], q = m->v[3 * a + 1][l], s = m->v[3 * a + 2][l];
            double dp = u[0] + wy * z - wz * y - p, dq = u[1] + wz * x - wx * z - q,
                   ds = u[2] + wx * y - wy * x - s;
            loss -= mass * (dp * (p + m->old[3 * a][l]) + dq * (q + m->old[3 * a + 1][l]) +
                            ds * (s + m->old[3 * a + 2][l]));
            norm += mass * (dp * dp + dq * dq + ds * ds);
            m->v[3 * a][l] = dp, m->v[3 * a + 1][l] = dq, m->v[3 * a + 2][l] = ds;
        }
        // limited to the fraction at which energy still falls
        double max = loss > 0 ? loss : 0, share = part[l] * norm;
        double num = share < max ? share : max;
        part[l] = is_good && norm > 1e-300 ? num / norm : 0;
    }
}

OM_MULTIVERSION void om__pbd_calm_elements(const OmPbdStep* s, int begin, int end) {
    for (int n = begin; n < end; ++n) {
        const OmPbdBatch* b = &s->pbd->elastic.batch[n];
        Motion m;
        Lanes part;
        for (int a = 0; a < 4; ++a)
            for (int l = 0; l < LANE; ++l) {
                size_t i = (size_t)b->vert[a][l];
                m.mass[a][l] = s->m->mass[i];
                for (size_t k = 0; k < 3; ++k) {
                    m.x[3 * a + (int)k][l] = s->x[3 * i + k];
                    double old = s->is_viscous ? 0 : s->w->v_begin[3 * i + k];
                    m.v[3 * a + (int)k][l] = s->v[3 * i + k] - old;
                    m.old[3 * a + (int)k][l] = old;
                }
            }
        for (int l = 0; l < LANE; ++l) {
            double rate = s->calm * b->viscous_rate[l];
            part[l] = rate / (1 + rate);
        }
        fit_motion(&m, part);
        for (int l = 0; l < b->num; ++l)
            for (int a = 0; a < 4; ++a) {
                int i = b->vert[a][l];
                bool is_free = s->w->give[i] > 0;
                double* to = (is_free ? s->v : s->w->hold) + 3 * (size_t)i;
                double way = is_free ? part[l] : -part[l] * m.mass[a][l] / s->h;
                for (int k = 0; k < 3; ++k) to[k] += way * m.v[3 * a + k][l];
            }
    }
}

// ---- forces and energy at given positions, for om_tissue_get_* ------------------------------------------

// Forces of the elements at x: -dW/dx, from the constraints' own multipliers -C / alpha.
OmStatus om__pbd_add_internal_force(const OmTissueModel* m, const double* x,
                                    const unsigned char* mask, double* force, OmVec3* sum) {
    const OmPbd* pbd = m->data;
    for (int e = 0; e < pbd->elastic.ntet; ++e) {
        const OmPbdTet* t = &pbd->elastic.tet[e];
        Strain g;
        strain_of(t, x, &g);
        double lh = -(g.J - t->gamma) / t->volume_compliance, ld = -g.stretch / t->shape_compliance;
        for (int a = 0; a < 4; ++a) {
            int i = t->vert[a];
            if (mask && !mask[i]) continue;
            OmVec3 f = om_madd(om_scale(lh, g.volume[a]), ld, g.shape[a]);
            *sum = om_add(*sum, f);
            if (force) om_store3(force, i, om_add(om_load3(force, i), f));
        }
    }
    return OM_OK;
}

OmStatus om__pbd_get_energy(const OmTissueModel* m, const double* x, double* energy) {
    const OmPbd* pbd = m->data;
    *energy = 0;
    for (int e = 0; e < pbd->elastic.ntet; ++e) {
        const OmPbdTet* t = &pbd->elastic.tet[e];
        Strain g;
        strain_of(t, x, &g);
        double C = g.J - t->gamma, C0 = 1 - t->gamma;
        *energy += 0.5 * (C * C - C0 * C0) / t->volume_compliance +
                   0.5 * (g.stretch * g.stretch - 3) / t->shape_compliance;
    }
    return OM_OK;
}
