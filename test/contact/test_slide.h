// test_slide.h: a probe pressed into a block and slid there and back.
#ifndef OMENTUM_TEST_SLIDE_H
#define OMENTUM_TEST_SLIDE_H

#include "test_press_rig.h"

typedef struct Slide {
    const char* name;
    OmProbeShape shape;
    OmPressMethod method;
    double rounding;  // m, of a box
    double friction, depth, h;
    bool is_fine;    // points on a grid of 2 mm in place of 1,004 triangles
    int max_newton;  // of the tissue
    bool has_faces;  // contact of faces, among `cells`
    int cells[3];    // 0: 16 x 13 x 7
} Slide;

typedef struct Slid {
    // mean force along the way over mean force up, there and back, at the same places
    double aside[2];
    double held[2];  // the same ratio where it turned back and was held: before and after
    double bound;    // the largest tangential force of a point over friction times its normal force
    double nsolve, nsubstep;
} Slid;

static inline void start(PressRig* p, const Slide* slide) {
    const int* n = slide->cells;
    make_block(p, n[0] ? n[0] : 16, n[0] ? n[1] : 13, n[0] ? n[2] : 7);
    p->r.def.max_newton = slide->max_newton;
    rig_start(&p->r);
    OmProbeDef shape = om_probe_default_def(slide->shape);
    if (slide->rounding > 0) shape.rounding = slide->rounding;
    assert_ok(om_probe_create(&shape, &p->probe));
    OmPressDef def = om_press_default_def(p->probe);
    def.method = slide->method;
    def.friction = slide->friction;
    def.has_face_contact = slide->has_faces;
    OmSurface top = {0};
    if (slide->is_fine) {
        make_top(&top);
        def.surface = &top;
    }
    assert_ok(om_press_create(&def, p->r.m, &p->press));
    om_surface_done(&top);
}

// Of all points that carry a thousandth of the largest force or more, by the normals that the report has.
static inline double find_bound(const OmPressReport* r, double friction) {
    double worst = 0, max = 0;
    for (int k = 0; k < r->ncontact; ++k) max = fmax(max, om_norm(om_load3(r->push, k)));
    for (int k = 0; k < r->ncontact; ++k) {
        OmVec3 f = om_load3(r->push, k), n = om_load3(r->normal, k);
        double up = om_dot(f, n);
        if (up > 1e-3 * max) worst = fmax(worst, om_norm(om_madd(f, -up, n)) / (friction * up));
    }
    return worst;
}

static inline OmPressReport go(PressRig* p, double x, double z, double h) {
    OmPressReport report;
    OmPose pose = {om_vec3(x, 0.05, z), om_quat_identity()};
    OmStatus status = om_press_step(p->press, p->r.m, p->r.s, p->r.w, pose, h, &report);
    if (status != OM_OK) fail_msg("x = %.5f: %s", x, om_error_message());
    assert_true(report.is_settled);
    return report;
}

// Down, 15 mm there in steps of 1 mm, held, 15 mm back.
static inline Slid run(const Slide* slide) {
    enum { NSTEP = 15 };
    PressRig p;
    start(&p, slide);
    Slid out = {.bound = 0};
    double top = slide->shape == OM_PROBE_SPHERE ? 0.075 : 0.05, x = 0.0525, up[2] = {0};
    OmPose above = {om_vec3(x, 0.05, top), om_quat_identity()};
    OmPressReport r = {0};
    assert_ok(om_press_place(p.press, p.r.m, p.r.s, above));
    for (int k = 0; k < 6; ++k) go(&p, x, top - slide->depth / 6 * (k + 1), slide->h);
    for (int k = 0; k < 10; ++k) go(&p, x, top - slide->depth, slide->h);
    for (int way = 0; way < 2; ++way) {
        for (int k = 0; k < NSTEP; ++k) {
            x += way ? -0.001 : 0.001;
            r = go(&p, x, top - slide->depth, slide->h);
            out.nsolve += 0.5 * r.nsolve / NSTEP;
            out.nsubstep += 0.5 * r.tissue.substeps / NSTEP;
            if (slide->friction > 0) out.bound = fmax(out.bound, find_bound(&r, slide->friction));
            int place = way ? NSTEP - 2 - k : k;  // the first millimetres turn the lean around
            if (place < 3 || place > NSTEP - 4) continue;
            out.aside[way] += r.force.x;
            up[way] += r.force.z;
        }
        if (way > 0) continue;
        out.held[0] = r.force.x / r.force.z;
        for (int k = 0; k < 50; ++k) r = go(&p, x, top - slide->depth, slide->h);
        out.held[1] = r.force.x / r.force.z;
    }
    for (int way = 0; way < 2; ++way) out.aside[way] /= up[way];
    printf("%s: aside %.4f there, %.4f back; held %.4f, then %.4f; bound %.3f; %.1f solves, %.2f "
           "substeps a step\n",
           slide->name, out.aside[0], out.aside[1], out.held[0], out.held[1], out.bound, out.nsolve,
           out.nsubstep);
    done(&p);
    return out;
}

#endif
