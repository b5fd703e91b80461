// scene_model_over.c: tissue that lies on an organ, both labelled in one volume.
//
// The tissue's mesh is made from its own label (scene_model.c); here come the organ's surface, from the union of its
// labels, the tissue's faces by their distance to it, the attachments where both meet, and the region of interest: the
// part of the organ's surface near the label of the ROI that faces the tissue. Both surfaces come from masks smoothed
// separately, so that they agree within half a voxel; the simulation separates them while the tissue settles.
#include <math.h>
#include <string.h>

#include "scene/scene_model_internal.h"

#define REACH 1.5  // voxels, default of OmOverDef.reach

// The distance field of labels of the same volume; the rest of `body` is freed.
static OmStatus field_of(const OmModelDef* def, const OmVolume* given, const int* label, int nlabel,
                         const OmProgress* progress, OmSdf* sdf, double* voxel) {
    OmModelDef d = *def;
    OmBody body = {0};
    OmModelReport* report = om_calloc(1, sizeof *report);
    if (!report) return OM_NO_MEMORY;
    memcpy(d.label, label, (size_t)nlabel * sizeof *label);
    d.nlabel = nlabel;
    d.nlabel_name = d.npart = 0;
    d.all_labels = d.keep_all = d.keep_holes = false;
    OmStatus status = om__body_load(&d, 0.02 + def->edge, progress, given, &body, report);
    if (status == OM_OK) {
        *sdf = body.sdf;
        *voxel = body.voxel;
        memset(&body.sdf, 0, sizeof body.sdf);
    }
    om__body_done(&body);
    om_free(report);
    return status;
}

// ---- faces of the tissue ----------------------------------------------------------------------------------------

// Boundary vertices: near the organ, else by their normals.
static OmStatus add_faces(const OmOverDef* over, const OmSdf* organ, OmVec3 up, double reach,
                          const OmSurface* surface, const int* surface_vert, OmTetMesh* mesh) {
    static const char* const name[3] = {"underside", "top", "border"};
    OmStatus status = OM_OK;
    int* list = NULL;
    double* normal = NULL;
    OM_ALLOC_DONE(list, (size_t)surface->nvert);
    OM_ALLOC_DONE(normal, 3 * (size_t)surface->nvert);
    om_surface_normals(surface, normal);
    for (int face = 0; face < 3; face++) {
        int n = 0;
        for (int i = 0; i < surface->nvert; i++) {
            bool is_near = om_sdf_eval(organ, om_load3(surface->x, i), NULL) < reach;
            double facing = om_dot(up, om_load3(normal, i));
            int in = is_near && facing < 0.3 ? 0 : facing > 0.3 ? 1 : 2;
            if (in == face) list[n++] = surface_vert[i];
        }
        OM_CHECK_DONE(n > 0 || face == 2, OM_INVALID,
                      "over: no vertex of the tissue %s; is it on the organ's side \"%s\"?",
                      face == 0 ? "meets the organ" : "faces away from it", over->side);
        OM_TRY_DONE(om_tet_mesh_add_set(mesh, name[face], list, n));
    }
done:
    om_free(list);
    om_free(normal);
    return status;
}

static OmStatus add_sets(const OmModelDef* def, const OmSdf* organ, OmVec3 up, double reach,
                         OmTetMesh* mesh) {
    static const OmAttachDef usual = {"underside", "random", 0.3, 1, 0};
    const OmAttachTask task = {def->over.attach, def->over.nattach, &usual, up, false};
    OmStatus status = OM_OK;
    OmSurface surface = {0};
    int* surface_vert = NULL;
    OM_TRY_DONE(om_tet_mesh_boundary(mesh, &surface, &surface_vert));
    OM_TRY_DONE(add_faces(&def->over, organ, up, reach, &surface, surface_vert, mesh));
    OM_TRY_DONE(om__model_attach(&task, mesh, &surface, surface_vert));
done:
    om_surface_done(&surface);
    om_free(surface_vert);
    return status;
}

// ---- the region of interest ---------------------------------------------------------------------------------------

// Triangles of the organ near the ROI's label that face the tissue, their mean centre and its distance to the farthest.
static OmStatus mark_roi(const OmSdf* roi, OmVec3 up, double reach, OmPatient* p,
                         unsigned char* is_used) {
    const OmSurface* s = &p->organ;
    OmVec3 sum = om_vec3(0, 0, 0);
    double area = 0, most = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int t = 0; t < s->ntri; t++) {
            const int* v = &s->tri_vert[3 * (size_t)t];
            OmVec3 a = om_load3(s->x, v[0]), b = om_load3(s->x, v[1]), c = om_load3(s->x, v[2]);
            OmVec3 center = om_scale(1.0 / 3, om_add(a, om_add(b, c)));
            OmVec3 n = om_cross(om_sub(b, a), om_sub(c, a));
            if (pass == 1) {
                if (is_used[t]) most = fmax(most, om_distance(center, p->roi_center));
                continue;
            }
            if (om_dot(n, up) < 0.3 * om_norm(n) || om_sdf_eval(roi, center, NULL) > reach)
                continue;
            is_used[t] = 1;
            sum = om_madd(sum, om_norm(n), center);
            area += om_norm(n);
        }
        OM_CHECK(area > 0, OM_INVALID, "over: the label of the ROI is not on the organ's surface");
        if (pass == 0) p->roi_center = om_scale(1 / area, sum);  // area > 0
    }
    p->roi_radius = most;
    return OM_OK;
}

static OmStatus add_roi(const OmModelDef* def, const OmSdf* roi, OmVec3 up, double reach,
                        OmPatient* p) {
    const OmOverDef* over = &def->over;
    OmStatus status = OM_OK;
    unsigned char* is_used = NULL;
    OM_CHECK(over->nroi > 0 && over->nroi <= 100000, OM_INVALID,
             "over: %d points of the ROI; 1 to 100000", over->nroi);
    OM_CALLOC_DONE(is_used, (size_t)p->organ.ntri);
    OM_TRY_DONE(mark_roi(roi, up, reach, p, is_used));
    OM_ALLOC_DONE(p->roi_point, 3 * (size_t)over->nroi);
    OM_ALLOC_DONE(p->roi_normal, 3 * (size_t)over->nroi);
    OmRng rng = om_rng_init(1, 0);
    OM_TRY_DONE(
        om_surface_sample(&p->organ, is_used, over->nroi, &rng, p->roi_point, p->roi_normal));
    p->nroi = over->nroi;
done:
    om_free(is_used);
    return status;
}

// ---- all of it --------------------------------------------------------------------------------------------------

OmStatus om__over_build(const OmModelDef* def, const OmVolume* given, const OmProgress* progress,
                        OmPatient* patient, OmModelReport* report) {
    const OmOverDef* over = &def->over;
    OmStatus status = OM_OK;
    OmSdf organ = {0}, roi = {0};
    double voxel = 0;
    OM_CHECK(report->nvoxel > 0, OM_INVALID,
             "over: the input is not a volume, and only a volume has labels of an organ below");
    OM_CHECK(over->nattach >= 0 && over->nattach <= OM_MAX_ATTACH, OM_INVALID,
             "%d attachments; at most %d", over->nattach, OM_MAX_ATTACH);
    OM_CHECK(over->reach >= 0 && over->reach <= 0.05, OM_INVALID,
             "over: reach %g mm is outside 0 to 50 mm", 1e3 * over->reach);
    status = om_model_direction(over->side, false, &patient->up);
    if (status < 0) return om_error_prefix(status, "over: side");
    OM_TRY_DONE(field_of(def, given, over->label, over->nlabel, progress, &organ, &voxel));
    const double reach = over->reach > 0 ? over->reach : REACH * voxel;
    OM_TRY_DONE(om_surface_from_sdf(&organ, 0, &patient->organ));
    patient->organ_spacing = organ.grid.spacing;
    report->surface_volume = om_surface_volume(&patient->organ);
    OM_TRY_DONE(add_sets(def, &organ, patient->up, reach, &patient->mesh));
    if (over->roi >= 0) {
        OM_TRY_DONE(field_of(def, given, &over->roi, 1, progress, &roi, &voxel));
        OM_TRY_DONE(add_roi(def, &roi, patient->up, reach, patient));
    }
done:
    om_sdf_done(&organ);
    om_sdf_done(&roi);
    return status;
}
