// self_rig.h: meshes of several bodies in contact with each other and with themselves, and what is measured on them.
#ifndef OM_TEST_SELF_RIG_H
#define OM_TEST_SELF_RIG_H

#include "test_rig.h"

#include "omentum/shape_meshing.h"
#include "omentum/shape_repair.h"

static const OmContactPlane self_floor = {{0, 0, 0}, {0, 0, 1}};

/// Append a mesh, which is freed: another body of the same model, whose elements have the next label.
static inline void self_append(OmTetMesh* mesh, OmTetMesh* more) {
    OmTetMesh all;
    int label = 0;
    for (int e = 0; e < mesh->ntet; ++e)
        if (label <= mesh->tet_label[e]) label = mesh->tet_label[e] + 1;
    for (int e = 0; e < more->ntet; ++e) more->tet_label[e] = label;
    assert_ok(om_tet_mesh_join(mesh, more, &all));
    om_tet_mesh_done(mesh);
    om_tet_mesh_done(more);
    *mesh = all;
}

static inline double self_ball_fn(void* ctx, OmVec3 p) { return om_norm(p) - *(double*)ctx; }

/// A ball around `center`.
static inline void self_ball(OmVec3 center, double radius, double edge, OmTetMesh* mesh) {
    double r = 1.2 * radius;
    OmStuffDef def =
        om_stuff_default_def(edge, self_ball_fn, &radius, om_vec3(-r, -r, -r), om_vec3(r, r, r));
    def.nworker = 1;
    assert_ok(om_tet_mesh_stuff(&def, mesh));
    for (int i = 0; i < mesh->nvert; ++i)
        om_store3(mesh->x, i, om_add(center, om_load3(mesh->x, i)));
}

/// A ring around the z axis, of square section.
static inline void self_ring(double radius, double side, int nside, int nround, OmTetMesh* mesh) {
    OmTetMeshWeld weld;
    double w = 0.5 * side;
    assert_ok(om_tet_mesh_box(om_vec3(radius - w, 0, -w), om_vec3(radius + w, 1, w), nside, nround,
                              nside, mesh));
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        double angle = 2 * OM_PI * p.y;
        om_store3(mesh->x, i, om_vec3(p.x * cos(angle), p.x * sin(angle), p.z));
    }
    assert_ok(om_tet_mesh_weld(mesh, 1e-9, &weld));
    assert_int_equal(weld.nvert, (nside + 1) * (nside + 1));
}

/// Attach the vertices for which `is_held` is true; before rig_start.
static inline void self_attach(TestRig* r, bool (*is_held)(OmVec3 p)) {
    int *vert = om_alloc((size_t)r->mesh.nvert, sizeof *vert), num = 0;
    for (int i = 0; i < r->mesh.nvert; ++i)
        if (is_held(om_load3(r->mesh.x, i))) vert[num++] = i;
    assert_ok(om_tet_mesh_add_set(&r->mesh, "attachment", vert, num));
    om_free(vert);
}

/// The definition of a rig whose mesh the caller has made.
static inline void self_default(TestRig* r, OmTissueElement element) {
    r->def = om_tissue_default_def(om_fem_engine(), &r->mesh);
    r->def.element = element;
    r->def.solver.nworker = 1;
    r->def.solver.tolerance = 1e-4;
    r->def.solver.max_iterations = 500;
}

static inline void self_assert_no_crossing(TestRig* r) {
    int num = -1;
    OmVec3 at;
    assert_ok(om_contact_find_crossing(r->cw, r->s, &num, &at));
    if (num)
        fail_msg("%d crossings, the first at (%.1f, %.1f, %.1f) mm", num, 1e3 * at.x, 1e3 * at.y,
                 1e3 * at.z);
}

/// Mean velocity or position of a body, by mass.
static inline OmVec3 self_mean(const TestRig* r, int body, const double* x) {
    OmVec3 sum = {0, 0, 0};
    double mass = 0;
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i) {
        if (om_contact_body_of(r->c, i) != body) continue;
        double m = om_tissue_mass(r->m)[i];
        sum = om_madd(sum, m, om_load3(x, i));
        mass += m;
    }
    return om_scale(1 / mass, sum);
}

static inline double self_mass(const TestRig* r, int body) {
    double mass = 0;
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i)
        if (om_contact_body_of(r->c, i) == body) mass += om_tissue_mass(r->m)[i];
    return mass;
}

/// The body gets the velocity v.
static inline void self_throw(TestRig* r, int body, OmVec3 v) {
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i)
        if (om_contact_body_of(r->c, i) == body) om_store3((double*)om_tissue_v(r->s), i, v);
}

static inline double self_energy(const TestRig* r) {
    OmTissueEnergy e;
    assert_ok(om_tissue_get_energy(r->m, r->s, &e));
    return e.elastic + e.kinetic + e.gravity + e.spring;
}

static inline double self_speed(const TestRig* r) {
    double fastest = 0;
    for (int i = 0; i < om_tissue_mesh(r->m)->nvert; ++i)
        fastest = fmax(fastest, om_norm(om_load3(om_tissue_v(r->s), i)));
    return fastest;
}

#endif
