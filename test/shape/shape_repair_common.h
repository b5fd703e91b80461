// shape_repair_common.h: surfaces to damage, and what the tests of their repair share.
#ifndef OMENTUM_SHAPE_REPAIR_COMMON_H
#define OMENTUM_SHAPE_REPAIR_COMMON_H

#include "test_alloc.h"

#include "omentum/shape_file.h"
#include "omentum/shape_repair.h"
#include "omentum/shape_sdf.h"

typedef struct Ball {
    OmVec3 center;
    double radius;
} Ball;

typedef struct Balls {  // the union of some of them
    const Ball* ball;
    int nball;
} Balls;

static inline double balls_fn(void* ctx, OmVec3 p) {
    const Balls* b = ctx;
    double d = HUGE_VAL;
    for (int i = 0; i < b->nball; i++)
        d = fmin(d, om_distance(p, b->ball[i].center) - b->ball[i].radius);
    return d;
}

/// The surface of a union of balls, with edges of about `step`.
static inline void make_balls(const Ball* ball, int nball, double step, OmSurface* s) {
    Balls b = {ball, nball};
    OmVec3 lo = om_vec3(1, 1, 1), hi = om_vec3(-1, -1, -1);
    for (int i = 0; i < nball; i++) {
        OmVec3 r = om_vec3(ball[i].radius, ball[i].radius, ball[i].radius);
        lo = om_min3(lo, om_sub(ball[i].center, r));
        hi = om_max3(hi, om_add(ball[i].center, r));
    }
    OmSdf sdf;
    OmSdfDef def = om_sdf_default_def(step);
    def.is_raw = true;
    assert_ok(om_sdf_from_function(balls_fn, &b, lo, hi, &def, &sdf));
    assert_ok(om_surface_from_sdf(&sdf, 0, s));
    om_sdf_done(&sdf);
}

static inline void make_box(OmVec3 lo, OmVec3 hi, int n, OmSurface* s) {
    OmTetMesh mesh;
    assert_ok(om_tet_mesh_box(lo, hi, n, n, n, &mesh));
    assert_ok(om_tet_mesh_boundary(&mesh, s, NULL));
    om_tet_mesh_done(&mesh);
}

/// `a` becomes both surfaces, `b` is freed.
static inline void append(OmSurface* a, OmSurface* b) {
    OmSurface s;
    assert_ok(om_surface_init(&s, a->nvert + b->nvert, a->ntri + b->ntri));
    memcpy(s.x, a->x, 3 * (size_t)a->nvert * sizeof *s.x);
    memcpy(s.x + 3 * (size_t)a->nvert, b->x, 3 * (size_t)b->nvert * sizeof *s.x);
    memcpy(s.tri_vert, a->tri_vert, 3 * (size_t)a->ntri * sizeof(int));
    for (int i = 0; i < 3 * b->ntri; i++) s.tri_vert[3 * a->ntri + i] = b->tri_vert[i] + a->nvert;
    om_surface_done(a);
    om_surface_done(b);
    *a = s;
}

static inline void turn(OmSurface* s, int t) {
    int v = s->tri_vert[3 * t];
    s->tri_vert[3 * t] = s->tri_vert[3 * t + 1];
    s->tri_vert[3 * t + 1] = v;
}

static inline void turn_all(OmSurface* s) {
    for (int t = 0; t < s->ntri; t++) turn(s, t);
}

static inline void add_triangle(OmSurface* s, int a, int b, int c) {
    OmSurface one;
    assert_ok(om_surface_init(&one, 0, 1));
    append(s, &one);
    int* v = s->tri_vert + 3 * (s->ntri - 1);
    v[0] = a, v[1] = b, v[2] = c;
}

static inline void remove_triangle(OmSurface* s, int t) {
    memmove(s->tri_vert + 3 * t, s->tri_vert + 3 * (t + 1),
            3 * (size_t)(s->ntri - t - 1) * sizeof(int));
    s->ntri--;
}

/// Every triangle gets vertices of its own, moved by up to `noise`.
static inline void unmerge(OmSurface* s, double noise, OmRng* rng) {
    OmSurface soup;
    assert_ok(om_surface_init(&soup, 3 * s->ntri, s->ntri));
    for (int i = 0; i < 3 * s->ntri; i++) {
        OmVec3 p = om_load3(s->x, s->tri_vert[i]);
        for (int c = 0; c < 3; c++) ((double*)&p)[c] += om_rng_range(rng, -noise, noise);
        om_store3(soup.x, i, p);
        soup.tri_vert[i] = i;
    }
    om_surface_done(s);
    *s = soup;
}

static inline int count_of(const OmSurfaceRepair* r, OmDefect kind) {
    return r->defect[kind].count;
}

/// No defect but those of the kinds a and b (OM_NDEFECT: none).
static inline void assert_only(const OmSurfaceRepair* r, OmDefect a, OmDefect b) {
    for (int k = 0; k < OM_NDEFECT; k++) {
        char text[320];
        om_surface_repair_words(r, (OmDefect)k, text, sizeof text);
        assert_int_equal(text[0] != 0, count_of(r, (OmDefect)k) > 0);
        if (k != (int)a && k != (int)b && text[0]) fail_msg("%s", text);
    }
}

#endif
