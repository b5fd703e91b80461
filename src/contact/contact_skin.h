// contact_skin.h: contact of the tissue's vertices with smooth surfaces that ride on bodies of the mesh.
#ifndef OM_CONTACT_SKIN_H
#define OM_CONTACT_SKIN_H

#include "contact/contact_pair.h"
#include "omentum/shape_skin.h"

struct OmContact;

typedef struct OmRide {  // a skin of the contact, constant
    const OmSdf* sdf;
    int index;       // of the skin
    OmSurface rest;  // boundary of its bodies at rest
    int* vert;       // its vertices in the model                               (rest.nvert)
    double off;      // m, farthest that this boundary is from the smooth surface
} OmRide;

typedef struct OmRideWork {
    OmSkin** skin;      //                                                        (nskin)
    double* at;         // positions of one boundary                   (largest nvert x 3)
    double* displaced;  // m, farthest that a vertex of each boundary is from rest (nskin)
    double* fastest;    // m, longest way of the vertices of each boundary        (nskin)
    double *x, *end;    // positions at the ends of the step                      (nvert x 3)
    int npair;
    OmSelfPair* pair;  // first: -1; second: its skin                  (nskin x nsurface)
    OmPairSums sums;
} OmRideWork;

// ---- contact_skin.c; the stages of a step as their siblings in contact_self.h

/// The skins of a definition, into the contact, whose surface and bodies are known.
OmStatus om__skins_create(const OmContactDef* def, const OmTissueModel* model,
                          struct OmContact* contact);
void om__skins_destroy(struct OmContact* contact);
OmStatus om__skins_work_create(const struct OmContact* contact, OmRideWork** work);
void om__skins_work_destroy(const struct OmContact* contact, OmRideWork* work);
void om__skins_find_pairs(struct OmContactWork* cw, const OmTissueModel* model,
                          OmTissueState* state, const OmTissueWork* work, double h);
/// @return how many pairs changed
int om__skins_update_pairs(struct OmContactWork* cw, const OmTissueModel* model,
                           OmTissueState* state, const OmTissueWork* work, double h,
                           bool is_damped);
OmStatus om__skins_report_pairs(struct OmContactWork* cw, OmTissueState* state);

#endif
