// fem_grid_element.c: the compressible neo-Hookean law on the cells of a grid.
//
//     W = mu/2 (F:F - 3) + psi(J),   psi = -mu ln J + lambda/2 (ln J)^2,   P = mu F + psi'(J) cof F
//
// All cells are equal, so the gradients of the shape functions are one table; the eight Gauss points of an element are
// the lanes of a vector. mu = 1. det F is linear in the position of one node, so the energy as a function of that
// position is convex where psi is convex: the sum of |d|^2 and psi of a linear function. The Newton step of a node
// needs the 3 x 3 matrix
//
//     sum of mu |b|^2 I + psi'' (cof F b)(cof F b)^T,   b the gradient of its shape function
//
// and the largest step that keeps det F positive is known exactly. Nodes are relaxed one after the other (vertex block
// descent, Chen et al. 2024, on hexahedra). Below det F = GRID_MIN_VOLUME psi is continued as a parabola, so the steps
// also restore inverted elements.
#include <math.h>
#include <string.h>

#include "base/base_simd.h"
#include "fem/fem_grid_internal.h"

#define NPOINT GRID_POINT
#define KEEP 0.2f  // smallest ratio of det F after a node's step to det F before

typedef struct Mat {  // by rows
    V8 xx, xy, xz, yx, yy, yz, zx, zy, zz;
} Mat;

OM_INLINE Mat load(const float* F) {
    const int n = NPOINT;
    return (Mat){load8(F),         load8(F + n),     load8(F + 2 * n),
                 load8(F + 3 * n), load8(F + 4 * n), load8(F + 5 * n),
                 load8(F + 6 * n), load8(F + 7 * n), load8(F + 8 * n)};
}

OM_INLINE Mat cofactor(Mat f) {
    return (Mat){f.yy * f.zz - f.yz * f.zy, f.yz * f.zx - f.yx * f.zz, f.yx * f.zy - f.yy * f.zx,
                 f.zy * f.xz - f.zz * f.xy, f.zz * f.xx - f.zx * f.xz, f.zx * f.xy - f.zy * f.xx,
                 f.xy * f.yz - f.xz * f.yy, f.xz * f.yx - f.xx * f.yz, f.xx * f.yy - f.xy * f.yx};
}

OM_INLINE V8 dot(Mat a, Mat b) {
    return a.xx * b.xx + a.xy * b.xy + a.xz * b.xz + a.yx * b.yx + a.yy * b.yy + a.yz * b.yz +
           a.zx * b.zx + a.zy * b.zy + a.zz * b.zz;
}

OM_INLINE V8 det(Mat f, Mat cof) { return f.xx * cof.xx + f.xy * cof.xy + f.xz * cof.xz; }

// a + s b
OM_INLINE Mat add(Mat a, V8 s, Mat b) {
    return (Mat){a.xx + s * b.xx, a.xy + s * b.xy, a.xz + s * b.xz,
                 a.yx + s * b.yx, a.yy + s * b.yy, a.yz + s * b.yz,
                 a.zx + s * b.zx, a.zy + s * b.zy, a.zz + s * b.zz};
}

typedef struct Psi {
    V8 first, second;  // derivatives; second >= 0
} Psi;

OM_INLINE Psi find_psi(V8 J, float lambda) {
    I8 is_below = J < GRID_MIN_VOLUME;
    V8 at = select8(is_below, splat8(GRID_MIN_VOLUME), J), over = 1 / at, ln = lambda * log8(at);
    Psi p = {(ln - 1) * over, (1 + lambda - ln) * over * over};
    p.first += p.second * select8(is_below, J - GRID_MIN_VOLUME, splat8(0));
    p.second = select8(p.second > 0, p.second, splat8(0));
    return p;
}

// ---- tables -----------------------------------------------------------------------------------------

static void fill_gradients(GridElements* t) {
    for (int q = 0; q < NPOINT; ++q)
        for (int a = 0; a < 8; ++a) {
            double square = 0;
            for (int c = 0; c < 3; ++c) {
                double value = 1 / t->grid->grid.spacing;
                for (int k = 0; k < 3; ++k) {
                    double at = 0.5 + (om__grid_corner[q][k] ? 0.5 : -0.5) / sqrt(3.0);
                    int is_high = om__grid_corner[a][k];
                    value *= k == c ? (is_high ? 1 : -1) : (is_high ? at : 1 - at);
                }
                t->grad[a][c][q] = (float)value;
                square += value * value;
            }
            t->square[a][q] = (float)square;
        }
}

static int color_of(const OmFemGrid* g, int node) {
    int p = g->node_point[node], color = 0;
    for (int c = 0; c < 3; ++c) {
        color |= (p % g->grid.dim[c] & 1) << c;
        p /= g->grid.dim[c];
    }
    return color;
}

OmStatus om__grid_check_poisson(double poisson) {
    OM_CHECK(poisson > -1 && poisson < 0.5, OM_INVALID,
             "grid: poisson is %g; must be above -1 and below 0.5", poisson);
    return OM_OK;
}

OmStatus om__grid_elements_init(const OmFemGrid* g, double poisson, GridElements* t) {
    int nnode = g->mesh.nnode, num = 0;
    *t = (GridElements){0};
    OM_TRY(om__grid_check_poisson(poisson));
    *t = (GridElements){.grid = g, .lambda = (float)(2 * poisson / (1 - 2 * poisson))};
    fill_gradients(t);
    OmStatus status = OM_OK;
    OM_CALLOC_DONE(t->use_adr, nnode + 1);
    OM_ALLOC_DONE(t->use, 8 * (size_t)g->mesh.nelem);
    OM_CALLOC_DONE(t->color_adr, 9);
    OM_ALLOC_DONE(t->color_node, nnode);
    for (int k = 0; k < 8 * g->mesh.nelem; ++k) ++t->use_adr[g->mesh.elem_node[k] + 1];
    for (int i = 0; i < nnode; ++i) t->use_adr[i + 1] += t->use_adr[i];
    for (int k = 8 * g->mesh.nelem - 1; k >= 0; --k)  // backwards: each end becomes a beginning
        t->use[--t->use_adr[g->mesh.elem_node[k] + 1]] = k;
    for (int i = 0; i < nnode; ++i) t->use_adr[i] = t->use_adr[i + 1];
    t->use_adr[nnode] = 8 * g->mesh.nelem;
    for (int color = 0; color < 8; ++color) {
        for (int i = 0; i < nnode; ++i)
            if (!g->fixed[i] && color_of(g, i) == color) t->color_node[num++] = i;
        t->color_adr[color + 1] = num;
    }
done:
    if (status < 0) om__grid_elements_done(t);
    return status;
}

void om__grid_elements_done(GridElements* t) {
    om_free(t->use_adr);
    om_free(t->use);
    om_free(t->color_adr);
    om_free(t->color_node);
    *t = (GridElements){0};
}

void om__grid_rest_stiffness(const GridElements* t, double* K) {
    for (int row = 0; row < 24; ++row)
        for (int col = 0; col < 24; ++col) {
            int a = row / 3, i = row % 3, b = col / 3, j = col % 3;
            double sum = 0;
            for (int q = 0; q < NPOINT; ++q) {
                for (int c = 0; c < 3 && i == j; ++c)
                    sum += (double)t->grad[a][c][q] * (double)t->grad[b][c][q];
                sum += (double)t->grad[b][i][q] * (double)t->grad[a][j][q] +
                       (double)t->lambda * (double)t->grad[a][i][q] * (double)t->grad[b][j][q];
            }
            K[24 * row + col] = sum;
        }
}

// ---- elements ---------------------------------------------------------------------------------------

OM_MULTIVERSION void om__grid_gradients(const GridElements* t, const float* u, float start,
                                        float* F, int begin, int end) {
    for (int e = begin; e < end; ++e) {
        const int* node = t->grid->mesh.elem_node + 8 * (size_t)e;
        V8 sum[9];
        for (int k = 0; k < 9; ++k) sum[k] = splat8(k % 4 == 0 ? start : 0);
        for (int a = 0; a < 8; ++a)
            for (int k = 0; k < 9; ++k)
                sum[k] += u[3 * (size_t)node[a] + (size_t)(k / 3)] * load8(t->grad[a][k % 3]);
        for (int k = 0; k < 9; ++k) store8(F + GRID_F * (size_t)e + NPOINT * k, sum[k]);
    }
}

OM_MULTIVERSION void om__grid_element_forces(const GridElements* t, const float* F, float* force,
                                             int begin, int end) {
    for (int e = begin; e < end; ++e) {
        Mat f = load(F + GRID_F * (size_t)e), cof = cofactor(f);
        Mat p = add(f, find_psi(det(f, cof), t->lambda).first, cof);
        for (int a = 0; a < 8; ++a) {
            float* to = force + 24 * (size_t)e + 3 * (size_t)a;
            V8 x = load8(t->grad[a][0]), y = load8(t->grad[a][1]), z = load8(t->grad[a][2]);
            to[0] = sum8(p.xx * x + p.xy * y + p.xz * z);
            to[1] = sum8(p.yx * x + p.yy * y + p.yz * z);
            to[2] = sum8(p.zx * x + p.zy * y + p.zz * z);
        }
    }
}

void om__grid_node_forces(const GridElements* t, const unsigned char* mask, const float* force,
                          float* residual, int begin, int end) {
    for (int n = begin; n < end; ++n) {
        float* to = residual + 3 * (size_t)n;
        to[0] = to[1] = to[2] = 0;
        if (mask[n] || t->grid->fixed[n]) continue;
        for (int k = t->use_adr[n]; k < t->use_adr[n + 1]; ++k)
            for (int i = 0; i < 3; ++i) to[i] -= force[3 * (size_t)t->use[k] + (size_t)i];
    }
}

OM_MULTIVERSION void om__grid_curvature(const GridDirection* w, float lambda, int begin, int end,
                                        double sum[3]) {
    V8 dd = splat8(0), ds = splat8(0), ss = splat8(0);
    for (int e = begin; e < end; ++e) {
        const size_t at = GRID_F * (size_t)e;
        Mat f = load(w->F + at), d = load(w->D + at);
        Mat s = add(f, splat8(-1), load(w->before + at));
        Mat cof = cofactor(f);
        Psi psi = find_psi(det(f, cof), lambda);
        V8 by_d = dot(cof, d), by_s = dot(cof, s);
        // the second variation of det F by a and b is F : (cof(a + b) - cof a - cof b)
        V8 half_dd = dot(f, cofactor(d)), half_ss = dot(f, cofactor(s));
        V8 both = dot(f, cofactor(add(d, splat8(1), s))) - half_dd - half_ss;
        dd += dot(d, d) + psi.second * by_d * by_d + 2 * psi.first * half_dd;
        ds += dot(d, s) + psi.second * by_d * by_s + psi.first * both;
        ss += dot(s, s) + psi.second * by_s * by_s + 2 * psi.first * half_ss;
    }
    sum[0] = (double)sum8(dd);
    sum[1] = (double)sum8(ds);
    sum[2] = (double)sum8(ss);
}

OM_MULTIVERSION double om__grid_slope(const GridDirection* w, float lambda, float length,
                                      float keep, int begin, int end, bool* is_valid) {
    V8 slope = splat8(0);
    I8 is_crushed = {0};
    for (int e = begin; e < end; ++e) {
        const size_t at = GRID_F * (size_t)e;
        const Mat f = load(w->F + at), none = {0};
        Mat along = add(none, splat8(w->scale[0]), load(w->D + at));
        if (w->scale[1] != 0)
            along = add(along, splat8(w->scale[1]), add(f, splat8(-1), load(w->before + at)));
        Mat moved = add(f, splat8(length), along), cof = cofactor(moved);
        V8 old = det(f, cofactor(f)), J = det(moved, cof);
        slope += dot(moved, along) + find_psi(J, lambda).first * dot(cof, along);
        is_crushed |= (old > 0) & (J < keep * old);
    }
    *is_valid = true;
    for (int q = 0; q < NPOINT; ++q) *is_valid = *is_valid && !is_crushed[q];
    return (double)sum8(slope);
}

OM_MULTIVERSION void om__grid_advance(const GridDirection* w, float length, int begin, int end) {
    const float by_d = length * w->scale[0], by_before = length * w->scale[1];
    for (size_t i = GRID_F * (size_t)begin; i < GRID_F * (size_t)end; i += NPOINT) {
        V8 f = load8(w->F + i), old = load8(w->before + i);
        store8(w->before + i, f);
        store8(w->F + i, f + by_d * load8(w->D + i) + by_before * (f - old));
    }
}

OM_MULTIVERSION void om__grid_find_strained(const float* F, float limit, unsigned char* is_strained,
                                            int begin, int end) {
    for (int e = begin; e < end; ++e) {
        Mat f = load(F + GRID_F * (size_t)e);
        f.xx -= 1, f.yy -= 1, f.zz -= 1;
        is_strained[e] = sum8(dot(f, f)) >= NPOINT * limit * limit;
    }
}

float om__grid_min_volume(const float* F, int begin, int end) {
    V8 min = splat8(INFINITY);
    for (int e = begin; e < end; ++e) {
        Mat f = load(F + GRID_F * (size_t)e);
        V8 J = det(f, cofactor(f));
        min = select8(J < min, J, min);
    }
    float all_min = min[0];
    for (int q = 1; q < NPOINT; ++q) all_min = min[q] < all_min ? min[q] : all_min;
    return all_min;
}

// ---- nodes ------------------------------------------------------------------------------------------

typedef struct
    Corner {  // det F of one element of a node, and its derivative by the node's position
    V8 J, x, y, z;
} Corner;

// Gradient and second derivative (xx, yy, zz, xy, xz, yz) of the energy by the position of a node.
OM_INLINE void eval_node(const GridElements* t, int node, const float* F, Corner* corner,
                         float gradient[3], float H[6]) {
    V8 g[3] = {{0}}, h[6] = {{0}};
    for (int k = t->use_adr[node]; k < t->use_adr[node + 1]; ++k) {
        const int a = t->use[k] % 8;
        V8 bx = load8(t->grad[a][0]), by = load8(t->grad[a][1]), bz = load8(t->grad[a][2]);
        Mat f = load(F + GRID_F * (size_t)(t->use[k] / 8)), cof = cofactor(f);
        V8 J = det(f, cof), square = load8(t->square[a]);
        Psi psi = find_psi(J, t->lambda);
        V8 x = cof.xx * bx + cof.xy * by + cof.xz * bz;
        V8 y = cof.yx * bx + cof.yy * by + cof.yz * bz;
        V8 z = cof.zx * bx + cof.zy * by + cof.zz * bz;
        V8 px = psi.second * x, py = psi.second * y;
        *corner++ = (Corner){J, x, y, z};
        g[0] += f.xx * bx + f.xy * by + f.xz * bz + psi.first * x;
        g[1] += f.yx * bx + f.yy * by + f.yz * bz + psi.first * y;
        g[2] += f.zx * bx + f.zy * by + f.zz * bz + psi.first * z;
        h[0] += square + px * x;
        h[1] += square + py * y;
        h[2] += square + psi.second * z * z;
        h[3] += px * y;
        h[4] += px * z;
        h[5] += py * z;
    }
    for (int i = 0; i < 3; ++i) gradient[i] = sum8(g[i]);
    for (int i = 0; i < 6; ++i) H[i] = sum8(h[i]);
}

// step = -H^-1 gradient; H is positive definite. In double, for its determinant is of the order of (1/m)^6.
OM_INLINE void solve(const float H[6], const float gradient[3], float step[3]) {
    const double a = (double)H[0], b = (double)H[1], c = (double)H[2];
    const double ab = (double)H[3], ac = (double)H[4], bc = (double)H[5];
    const double x = (double)gradient[0], y = (double)gradient[1], z = (double)gradient[2];
    const double xx = b * c - bc * bc, xy = ac * bc - ab * c, xz = ab * bc - ac * b;
    const double yy = a * c - ac * ac, yz = ab * ac - a * bc, zz = a * b - ab * ab;
    const double over = -1 / (a * xx + ab * xy + ac * xz);
    step[0] = (float)(over * (xx * x + xy * y + xz * z));
    step[1] = (float)(over * (xy * x + yy * y + yz * z));
    step[2] = (float)(over * (xz * x + yz * y + zz * z));
}

// The largest fraction of the step, up to 1, after which every positive det F keeps the ratio KEEP.
OM_INLINE float limit_step(const Corner* corner, int num, const float step[3]) {
    V8 max = splat8(1);  // loss of det F over the allowed loss
    for (const Corner* c = corner; c < corner + num; ++c) {
        V8 loss = -(step[0] * c->x + step[1] * c->y + step[2] * c->z);
        V8 over = loss / ((1 - KEEP) * c->J);
        max = select8((c->J > 0) & (over > max), over, max);
    }
    float worst = 1;
    for (int q = 0; q < NPOINT; ++q) worst = max[q] > worst ? max[q] : worst;
    return 1 / worst;
}

void om__grid_find_skipped(const GridElements* t, const unsigned char* mask,
                           const unsigned char* is_strained, unsigned char* is_skipped, int begin,
                           int end) {
    for (int n = begin; n < end; ++n) {
        bool is_any = false;
        for (int k = t->use_adr[n]; k < t->use_adr[n + 1]; ++k)
            is_any = is_any || is_strained[t->use[k] / 8];
        is_skipped[n] = mask[n] || !is_any;
    }
}

OM_MULTIVERSION void om__grid_relax(const GridElements* t, const unsigned char* is_skipped,
                                    float* F, float* u, int begin, int end) {
    for (int at = begin; at < end; ++at) {
        const int node = t->color_node[at];
        Corner corner[8];
        float gradient[3], H[6], step[3];
        if (is_skipped[node]) continue;
        eval_node(t, node, F, corner, gradient, H);
        solve(H, gradient, step);
        const float fraction = limit_step(corner, t->use_adr[node + 1] - t->use_adr[node], step);
        for (int i = 0; i < 3; ++i) {
            step[i] *= fraction;
            u[3 * (size_t)node + (size_t)i] += step[i];
        }
        for (int k = t->use_adr[node]; k < t->use_adr[node + 1]; ++k) {
            float* to = F + GRID_F * (size_t)(t->use[k] / 8);
            const int a = t->use[k] % 8;
            for (int i = 0; i < 9; ++i)
                store8(to + NPOINT * i,
                       load8(to + NPOINT * i) + step[i / 3] * load8(t->grad[a][i % 3]));
        }
    }
}

// ---- a single node -----------------------------------------------------------------------------------

OM_MULTIVERSION void om__grid_node_eval(const GridElements* t, int node, const float* F,
                                        float gradient[3], float H[6]) {
    Corner corner[8];
    eval_node(t, node, F, corner, gradient, H);
}

OM_MULTIVERSION float om__grid_node_step(const GridElements* t, int node, const float* F,
                                         const float gradient[3], const float H[6], float step[3]) {
    Corner corner[8];
    float unused[3], unused_H[6];
    eval_node(t, node, F, corner, unused, unused_H);
    solve(H, gradient, step);
    return limit_step(corner, t->use_adr[node + 1] - t->use_adr[node], step);
}

OM_MULTIVERSION void om__grid_node_move(const GridElements* t, int node, const float step[3],
                                        float* F, float* u) {
    for (int i = 0; i < 3; ++i) u[3 * (size_t)node + (size_t)i] += step[i];
    for (int k = t->use_adr[node]; k < t->use_adr[node + 1]; ++k) {
        float* to = F + GRID_F * (size_t)(t->use[k] / 8);
        const int a = t->use[k] % 8;
        for (int i = 0; i < 9; ++i)
            store8(to + NPOINT * i,
                   load8(to + NPOINT * i) + step[i / 3] * load8(t->grad[a][i % 3]));
    }
}
