// world_body.h: fields of a body's model and work; private to room world.
#ifndef OM_WORLD_BODY_H
#define OM_WORLD_BODY_H

#include "omentum/body.h"
#include "omentum/contact.h"

struct OmBodyModel {
    const OmSite* site;
    OmTissueModel* tissue;
    OmContact* contact;
    OmTetMesh shown;  // om_body_mesh; its arrays are those of `tissue`
    // vertices that springs hold on the organ; null: none                       (nvert)
    unsigned char* bonded;
    int* mid_end;  // of shells: the ends of each edge of the mesh           (nmid x 2)
    int nmid;
    int nsub;  // tetrahedra of `tissue` for each of the site's
};

struct OmBodyWork {
    const OmBodyModel* model;
    OmTissueWork* tissue;
    OmContactWork* contact;
};

// A model whose Young's modulus is `factor` times that of the site.
OmStatus om__body_model_create(const OmScene* scene, const OmSite* site, int nworker, double factor,
                               OmBodyModel** model);

const OmBodyModel* om__body_model(const OmBody* body);

#endif
