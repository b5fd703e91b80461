// 20_touching_bodies.c: fat lies on a soft organ, which holds it at one end; a tool peels the other end off.
//
// Bodies are pieces of one mesh, so that one model, one state and one step serve all of them. They touch by
// self_contact, and bonds, springs between the two, stand for the tissue that holds one on the other.
#include <stdio.h>

#include "omentum/omentum.h"

#define TIME_STEP 0.02

enum { MAX_VERT = 200 };

typedef struct Field {  // everything that has to be destroyed
    OmTetMesh organ, fat, mesh;
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
    int nbond;
} Field;

static void field_done(Field* f) {
    om_contact_work_destroy(f->contact_work);
    om_contact_destroy(f->contact);
    om_tissue_work_destroy(f->work);
    om_tissue_state_destroy(f->state);
    om_tissue_destroy(f->model);
    om_tet_mesh_done(&f->mesh);
    om_tet_mesh_done(&f->fat);
    om_tet_mesh_done(&f->organ);
}

// An organ of 60 x 40 x 20 mm, label 1, that stands on the ground, and 5 mm of fat, label 0, half a millimetre above
// it.
static OmStatus make_mesh(Field* f) {
    int held[MAX_VERT], nheld = 0;
    OmStatus status =
        om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.04, 0.02), 6, 4, 2, &f->organ);
    if (status == OM_OK)
        status = om_tet_mesh_box(om_vec3(0.005, 0.005, 0.0205), om_vec3(0.055, 0.035, 0.0255), 5, 3,
                                 1, &f->fat);
    if (status != OM_OK) return status;
    for (int i = 0; i < f->organ.nvert && nheld < MAX_VERT; ++i)
        if (om_load3(f->organ.x, i).z < 1e-9) held[nheld++] = i;
    for (int t = 0; t < f->organ.ntet; ++t) f->organ.tet_label[t] = 1;
    status = om_tet_mesh_add_set(&f->organ, "attachment", held, nheld);
    return status == OM_OK ? om_tet_mesh_join(&f->fat, &f->organ, &f->mesh) : status;
}

static OmStatus make_field(Field* f) {
    OmTissueBond bond[MAX_VERT];
    int bonded[MAX_VERT];
    OmStatus status = make_mesh(f);
    if (status != OM_OK) return status;
    // a fascia holds the fat's underside from x = 5 to 15 mm
    for (int i = 0; i < f->fat.nvert && f->nbond < MAX_VERT; ++i) {
        OmVec3 x = om_load3(f->fat.x, i);
        if (x.x < 0.0151 && x.z < 0.0206) bonded[f->nbond++] = i;
    }
    status = om_tissue_make_bonds(&f->mesh, f->nbond, bonded, f->fat.ntet, f->mesh.ntet, 20, bond);
    if (status != OM_OK) return status;
    OmMaterial material[2] = {{.law = OM_NEO_HOOKEAN, .young = 3000, .poisson = 0.45},
                              {.law = OM_NEO_HOOKEAN, .young = 10000, .poisson = 0.45}};
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), &f->mesh);
    def.nmaterial = 2, def.material = material;
    def.nbond = f->nbond, def.bond = bond;  // copied
    def.solver.nworker = 1;
    status = om_tissue_create(&def, &f->model);
    if (status == OM_OK) status = om_tissue_state_create(f->model, &f->state);
    if (status == OM_OK) status = om_tissue_work_create(f->model, &f->work);
    OmContactDef touch = om_contact_default_def();
    touch.self_contact = true;
    touch.self_friction = 0.2;
    if (status == OM_OK) status = om_contact_create(&touch, f->model, &f->contact);
    return status == OM_OK ? om_contact_work_create(f->contact, &f->contact_work) : status;
}

// Pull of all bonds on the fat, N.
static OmVec3 pull_of_bonds(const Field* f) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int k = 0; k < f->nbond; ++k)
        sum = om_add(sum, om_tissue_bond_force(f->model, f->state, k));
    return sum;
}

int main(void) {
    Field f = {0};
    OmStatus status = make_field(&f);
    // the fat comes to rest on the organ: body 0 is the fat, whose vertices come first
    if (status == OM_OK)
        status = om_contact_settle(f.contact_work, f.model, f.state, f.work, TIME_STEP, 1e-3, 2);
    if (status == OM_OK)
        printf("at rest the organ carries the fat with %.4f N\n",
               om_contact_body_force(f.contact_work, 0, 1).z);
    OmPose tip = {om_vec3(0.055, 0.02, 0.0255), om_quat_identity()};
    int nheld;
    if (status == OM_OK) status = om_tissue_grasp(f.model, f.state, 0, tip, 0.0052, &nheld);
    for (int step = 0; status == OM_OK && step < 60; ++step) {
        tip.p = om_add(tip.p, om_vec3(-0.0001, 0, 0.0003));  // up and back, 16 mm/s
        status = om_tissue_move_grasp(f.state, 0, tip);
        if (status == OM_OK)
            status = om_contact_step(f.contact_work, f.model, f.state, f.work, TIME_STEP, NULL);
    }
    OmTissueForces force;
    if (status == OM_OK) status = om_tissue_get_forces(f.model, f.state, &force);
    if (status == OM_OK) {
        OmVec3 bonds = pull_of_bonds(&f), push = om_contact_body_force(f.contact_work, 0, 1);
        printf("lifted: the tool pulls with %.4f N, the bonds with (%.4f, %.4f, %.4f) N, the organ "
               "pushes with %.4f N\n",
               om_norm(force.pull[0]), bonds.x, bonds.y, bonds.z, push.z);
    } else {
        fprintf(stderr, "%s\n", om_error_message());
    }
    field_done(&f);
    return status == OM_OK ? 0 : 1;
}
