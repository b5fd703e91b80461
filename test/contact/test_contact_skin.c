// test_contact_skin.c: tissue on a body whose smooth surface rides on its mesh: it rests as on the rigid organ where the
// body is stiff, sinks into a soft one, does not feel facets, and both sides feel opposite forces.
#include "self_rig.h"

#include "omentum/shape_skin.h"

#define RADIUS 0.04
#define TOP 0.04  // height of the ball's top; its centre is the origin

typedef struct Scene {
    TestRig r;
    OmSdf sdf;
    int ball;  // first vertex of the ball
    OmMaterial material[2];
    double density[2];
    OmContactSkin skin;
    OmTissueObstacle organ;
} Scene;

static double ball_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(double*)ctx; }

static void make_field(Scene* s) {
    double radius = RADIUS, r = 1.3 * RADIUS;
    OmSdfDef def = om_sdf_default_def(0.002);
    assert_ok(om_sdf_from_function(ball_fn, &radius, om_vec3(-r, -r, -r), om_vec3(r, r, r), &def,
                                   &s->sdf));
}

// A sheet of `gap` m above a ball of `young` Pa and edges of 12 mm, whose lower half is held; young 0: a rigid ball.
static void start(Scene* s, double young, double half, double gap, double friction,
                  OmTissueElement element) {
    memset(s, 0, sizeof *s);
    make_field(s);
    OmVec3 lo = om_vec3(-half, -half, TOP + gap), hi = om_vec3(half, half, TOP + gap + 0.006);
    int n = (int)(2 * half / 0.006 + 0.5);
    rig_box(&s->r, lo, hi, n, n, 1);
    s->ball = s->r.mesh.nvert;
    s->material[0] = (OmMaterial){.law = OM_NEO_HOOKEAN, .young = 3000, .poisson = 0.45};
    s->material[1] = (OmMaterial){.law = OM_NEO_HOOKEAN, .young = young, .poisson = 0.45};
    s->density[0] = s->density[1] = 1000;
    if (young > 0) {
        OmTetMesh ball;
        self_ball(om_vec3(0, 0, 0), RADIUS, 0.012, &ball);
        int *low = om_alloc((size_t)ball.nvert, sizeof *low), num = 0;
        for (int i = 0; i < ball.nvert; ++i)
            if (ball.x[3 * i + 2] < 0) low[num++] = s->ball + i;
        self_append(&s->r.mesh, &ball);
        assert_ok(om_tet_mesh_add_set(&s->r.mesh, "attachment", low, num));
        om_free(low);
        s->r.def.nmaterial = 2;
        s->r.def.material = s->material;
        s->r.def.material_density = s->density;
    }
    s->r.def.element = element;
    s->r.def.rayleigh_stiffness = 0.01;
    s->r.def.solver.tolerance = 1e-4;
    rig_start(&s->r);
    OmContactDef def = om_contact_default_def();
    s->organ = om_sdf_obstacle(&s->sdf);
    s->skin = (OmContactSkin){&s->sdf, s->ball};
    if (young > 0) def.nskin = 1, def.skin = &s->skin;
    if (young <= 0) def.nobstacle = 1, def.obstacle = &s->organ;
    def.friction = friction;
    rig_contact(&s->r, &def);
}

static void done(Scene* s) {
    rig_done(&s->r);
    om_sdf_done(&s->sdf);
}

int main(void) {
    for (int k = 0; k < 3; ++k) {
        Scene s;
        start(&s, k == 0 ? 0 : k == 1 ? 1e6 : 1e4, 0.03, 0.0005, 0.3, OM_ELEMENT_QUADRATIC);
        double t0 = om_clock_now();
        int nit = 0, nsolve = 0, bad = 0;
        for (int n = 0; n < 150; ++n) {
            OmContactReport rep;
            OmStatus st = om_contact_step(s.r.cw, s.r.m, s.r.s, s.r.w, 0.02, &rep);
            if (st < 0) { printf("step %d: %s\n", n, om_error_message()); break; }
            bad += st != OM_OK;
            nit += rep.tissue.iterations, nsolve += rep.nsolve;
            if (n % 15 == 14) {
                double fast = 0;
                for (int i = 0; i < om_tissue_mesh(s.r.m)->nvert; ++i) fast = fmax(fast, om_norm(om_load3(om_tissue_v(s.r.s), i)));
                OmVec3 f = om_contact_body_force(s.r.cw, 0, 1);
                printf("%d: n %d solve %d it %d fast %.2e mm/s f %.5f %.5f %.5f mid z %.4f pen %.2e touch %d bad %d, %.1f ms a step\n", n, om_tissue_mesh(s.r.m)->nvert, nsolve, nit, 1e3*fast, f.x, f.y, f.z,
                  1e3*om_tissue_x(s.r.s)[3*(5*11+5)+2], 1e3*rep.self_penetration, rep.ntouch, bad, 1e3*(om_clock_now()-t0)/15);
                t0 = om_clock_now(); nit = nsolve = 0;
            }
        }
        done(&s);
    }
}
