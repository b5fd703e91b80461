// world_anatomy.c: organ and ROI of a site where the vertices of a body are.
#include <string.h>

#include "omentum/shape_skin.h"
#include "world/world_body.h"

typedef struct Anatomy {
    OmAnatomy head;
    const OmSite* site;
    OmSkin* skin;      // the boundary of the organ's mesh; null: the organ is rigid
    int nskin, *vert;  // its vertices in the model                               (nskin)
    double* at;        // their positions                                         (nskin x 3)
    OmSurface organ, roi;
    double *roi_x, *roi_n;
    OmSkinPlace *of_organ, *of_roi, *of_point;  // places of the three at rest
} Anatomy;

void om_anatomy_destroy(OmAnatomy* anatomy) {
    Anatomy* a = (Anatomy*)anatomy;
    if (!a) return;
    om_skin_destroy(a->skin);
    om_free(a->vert);
    om_free(a->at);
    om_surface_done(&a->organ);
    om_surface_done(&a->roi);
    om_free(a->roi_x);
    om_free(a->roi_n);
    om_free(a->of_organ);
    om_free(a->of_roi);
    om_free(a->of_point);
    om_free(a);
}

static OmStatus make_skin(const OmBodyModel* model, Anatomy* a) {
    const OmTetMesh* all = om_tissue_mesh(model->tissue);
    OmTetMesh organ = *all;
    OmSurface boundary;
    organ.tet_vert += 4 * (size_t)model->shown.ntet;
    organ.tet_label += model->shown.ntet;
    organ.ntet -= model->shown.ntet;
    OM_TRY(om_tet_mesh_boundary(&organ, &boundary, &a->vert));
    a->nskin = boundary.nvert;
    OmStatus status = om_skin_create(&boundary, &a->skin);
    om_surface_done(&boundary);
    if (status == OM_OK) OM_ALLOC(a->at, 3 * (size_t)a->nskin);
    return status;
}

static OmStatus copy_surface(const OmSkin* skin, const OmSurface* from, OmSurface* to,
                             OmSkinPlace** place) {
    OM_TRY(om_surface_init(to, from->nvert, from->ntri));
    if (from->ntri > 0)
        memcpy(to->tri_vert, from->tri_vert, 3 * (size_t)from->ntri * sizeof *to->tri_vert);
    OM_ALLOC(*place, from->nvert);
    for (int i = 0; i < from->nvert; ++i) om_skin_bind(skin, om_load3(from->x, i), &(*place)[i]);
    return OM_OK;
}

OmStatus om_anatomy_create(const OmBody* body, OmAnatomy** anatomy) {
    *anatomy = NULL;
    OmStatus status = OM_OK;
    const OmSite* site = om_body_site(body);
    Anatomy* a = om_calloc(1, sizeof *a);
    if (!a) return OM_NO_MEMORY;
    a->site = site;
    a->head = (OmAnatomy){&site->organ, &site->roi, site->roi_x, site->roi_n, false};
    if (site->soft.nvert > 0) {
        OM_TRY_DONE(make_skin(om__body_model(body), a));
        OM_TRY_DONE(copy_surface(a->skin, &site->organ, &a->organ, &a->of_organ));
        OM_TRY_DONE(copy_surface(a->skin, &site->roi, &a->roi, &a->of_roi));
        OM_ALLOC_DONE(a->roi_x, 3 * (size_t)site->nroi);
        OM_ALLOC_DONE(a->roi_n, 3 * (size_t)site->nroi);
        OM_ALLOC_DONE(a->of_point, site->nroi);
        for (int i = 0; i < site->nroi; ++i)
            om_skin_bind(a->skin, om_load3(site->roi_x, i), &a->of_point[i]);
        a->head = (OmAnatomy){&a->organ, &a->roi, a->roi_x, a->roi_n, true};
        om_anatomy_move(&a->head, om_tissue_mesh(om_body_tissue(body))->x);
    }
    *anatomy = &a->head;
    return OM_OK;
done:
    om_anatomy_destroy(&a->head);
    return status;
}

static void put_surface(const OmSkin* skin, const OmSkinPlace* place, OmSurface* to) {
    for (int i = 0; i < to->nvert; ++i) om_store3(to->x, i, om_skin_put(skin, &place[i], NULL));
}

// A normal turns as those of the skin: by the inverse transpose of the map.
static OmVec3 turn_normal(OmMat3 F, OmVec3 n) {
    OmMat3 back;
    if (om_mat3_inverse(F, &back) < 0) return n;
    return om_normalize(om_mat3_apply_transposed(back, n));
}

void om_anatomy_move(OmAnatomy* anatomy, const double* x) {
    Anatomy* a = (Anatomy*)anatomy;
    if (!a->skin) return;
    for (int i = 0; i < a->nskin; ++i) om_store3(a->at, i, om_load3(x, a->vert[i]));
    om_skin_move(a->skin, a->at);
    put_surface(a->skin, a->of_organ, &a->organ);
    put_surface(a->skin, a->of_roi, &a->roi);
    for (int i = 0; i < a->site->nroi; ++i) {
        OmMat3 F;
        om_store3(a->roi_x, i, om_skin_put(a->skin, &a->of_point[i], &F));
        om_store3(a->roi_n, i, turn_normal(F, om_load3(a->site->roi_n, i)));
    }
}
