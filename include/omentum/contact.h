/// omentum/contact.h: one-sided contact of tissue with still ground and organs (floor 3).
///
/// The ground is a plane, an organ its signed distance field; a vertex is pushed out along the normal and
/// never pulled. Penalties are implicit, as stiff as a multiple of the tissue at each vertex, and the set of
/// pushed vertices is found anew within the step, so that lifted tissue does not stick.
///
///     OmContactDef def = om_contact_default_def();
///     om_contact_def_add_plane(&def, point, normal);
///     OmContact* contact;  om_contact_create(&def, model, &contact);
///     om_contact_step(contact, model, state, ws, 0.02, &report);   // instead of om_tissue_step
#ifndef OMENTUM_CONTACT_H
#define OMENTUM_CONTACT_H

#include "omentum/shape_sdf.h"
#include "omentum/tissue.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_CONTACT_MAX_OBSTACLE 8

typedef struct OmContactObstacle {
    const OmSdf* sdf;  // borrowed until destroy; null: a plane
    OmVec3 point;      // of the plane, m
    OmVec3 normal;     // of the plane, unit, out of the ground
} OmContactObstacle;

typedef struct OmContactDef {  // made by om_contact_default_def
    OmContactObstacle obstacle[OM_CONTACT_MAX_OBSTACLE];
    int nobstacle;
    double stiffness;  // of the penalty over that of the tissue at the vertex; default 10, > 0
    double friction;   // Coulomb's coefficient, 0 to 2; default 0.05 (wet tissue)
    int max_rounds;    // solves a step, 1 to 20; default 6
    uint32_t cookie;
} OmContactDef;

typedef struct OmContactReport {  // of the last step
    OmTissueReport step;
    int ncontact;        // vertices pushed
    double penetration;  // m, the deepest
    OmVec3 force;        // resultant on the tissue, N
    int rounds;          // solves
    bool is_settled;     // the set of pushed vertices no longer changed
} OmContactReport;

typedef struct OmContact OmContact;

OM_API OmContactDef om_contact_default_def(void);
OM_API OmStatus om_contact_def_add_plane(OmContactDef* def, OmVec3 point, OmVec3 normal);
OM_API OmStatus om_contact_def_add_sdf(OmContactDef* def, const OmSdf* sdf);
/// Watches the vertices of the mesh's boundary.
OM_API OmStatus om_contact_create(const OmContactDef* def, const OmTissueModel* model,
                                  OmContact** contact);
OM_API void om_contact_destroy(OmContact* contact);
/// One step of the tissue with contact; as om_tissue_step otherwise.
OM_API OmStatus om_contact_step(OmContact* contact, const OmTissueModel* model,
                                OmTissueState* state, OmTissueWorkspace* ws, double dt,
                                OmContactReport* report);
/// Contact forces of the last step on the vertices, N (nvert x 3).
OM_API const double* om_contact_vertex_force(const OmContact* contact);

#ifdef __cplusplus
}
#endif
#endif
