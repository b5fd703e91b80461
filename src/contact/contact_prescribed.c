// contact_prescribed.c: the area under the probe at first touch moves as the probe does (thesis 3.4.3).
//
// Each point of the area is held by a spring to its place in the probe's frame, a hundred times stiffer than what
// resists moving it alone: from a formulation point of view a penalty without detection. Points rather than
// vertices of the volume, so that the area is the same on every mesh. One solve a step.
#include "contact/contact_press_internal.h"

#define STIFF 100  // times what resists moving a point alone

OmStatus om__press_prescribed(void* ctx, const OmTissueModel* m, OmTissueState* s, OmTissueWork* w,
                              double h, OmTissueReport* report) {
    OmPress* p = ctx;
    om__press_path(p, s, h);
    om_tissue_clear_forces(w);
    p->ntouch = 0;
    for (int k = 0; k < p->narea; ++k) {
        OmTouch* t = &p->touch[p->ntouch++];
        *t = (OmTouch){.point = p->area[k], .is_active = true};
        t->x = om__press_point(p, om_tissue_x(s), t->point);
        t->k =
            p->def.stiffness > 0 ? p->def.stiffness : STIFF * om__press_stiffness(p, w, t->point);
        t->slip = om_sub(om_pose_apply(p->to, om_load3(p->grip, k)), t->x);
        OmMat3 K = om_mat3_scale(t->k, om_mat3_identity());
        OM_TRY(om__press_add_force(p, w, t->point, om_scale(t->k, t->slip), K));
    }
    OmStatus status = om_tissue_solve_step(m, s, w, report);
    if (status < 0) return status;
    ++p->report.nsolve;
    for (int k = 0; k < p->ntouch; ++k) {
        OmTouch* t = &p->touch[k];
        t->force = om_scale(t->k, om_sub(t->slip, om__press_move(p, s, w, t->point, h)));
    }
    p->report.is_settled = true;
    return status;
}
