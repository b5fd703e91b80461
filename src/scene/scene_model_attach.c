// scene_model_attach.c: where tissue is held: the farthest part of a face in a direction, a random patch, all of it.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/scene_model_internal.h"

typedef struct Ranked {
    double height;
    int vert;
} Ranked;

static int compare_ranked(const void* a, const void* b) {
    const Ranked *x = a, *y = b;
    if (x->height != y->height) return x->height > y->height ? -1 : 1;
    return x->vert < y->vert ? -1 : x->vert > y->vert;
}

// Mark the vertices of one attachment.
static OmStatus mark_attachment(const OmAttachTask* task, const OmAttachDef* a,
                                const OmTetMesh* mesh, const OmSurface* surface,
                                const int* surface_vert, unsigned char* is_held) {
    OmStatus status = OM_OK;
    int *candidate = NULL, *patch = NULL, npatch = 0;
    Ranked* ranked = NULL;
    const OmMeshSet* face = om_tet_mesh_find_set(mesh, a->face);
    OM_CHECK(face, OM_INVALID,
             "attachment: \"%s\" is no face of the sheet: use border, underside or top", a->face);
    OM_CHECK(face->nvert > 0, OM_INVALID, "attachment: the sheet has no %s", a->face);
    OM_CHECK(a->share > 0 && a->share <= 1, OM_INVALID, "attachment: %g %% is outside 0 to 100 %%",
             a->share * 100);
    if (strcmp(a->direction, "random") == 0) {
        int n = 0;
        OM_ALLOC_DONE(candidate, face->nvert);
        for (int v = 0, i = 0; v < surface->nvert && i < face->nvert; v++) {
            if (surface_vert[v] != face->vert[i]) continue;
            candidate[n++] = v;  // both lists ascend, and the face is a subset of the boundary
            i++;
        }
        OmPatchDef def = om_patch_default_def(a->share, a->seed);
        OM_TRY_DONE(om_surface_random_patch(surface, candidate, n, &def, &patch, &npatch));
        for (int i = 0; i < npatch; i++) is_held[surface_vert[patch[i]]] = 1;
    } else if (a->direction[0] == 0) {
        for (int i = 0; i < face->nvert; i++) is_held[face->vert[i]] = 1;
    } else {
        OmVec3 toward;
        OM_TRY_DONE(om_model_direction(a->direction, task->is_left, &toward));
        toward = om_quat_rotate(om_quat_axis_angle(task->n, a->turn), toward);
        OM_ALLOC_DONE(ranked, face->nvert);
        for (int i = 0; i < face->nvert; i++) {
            OmVec3 x = om_load3(mesh->x, face->vert[i]);
            ranked[i] = (Ranked){om_dot(x, toward), face->vert[i]};
        }
        qsort(ranked, (size_t)face->nvert, sizeof *ranked, compare_ranked);
        int take = (int)fmax(1, floor(a->share * face->nvert + 0.5));
        for (int i = 0; i < take; i++) is_held[ranked[i].vert] = 1;
    }
done:
    om_free(candidate);
    om_free(patch);
    om_free(ranked);
    return status;
}

OmStatus om__model_attach(const OmAttachTask* task, OmTetMesh* mesh, const OmSurface* surface,
                          const int* surface_vert) {
    OmStatus status = OM_OK;
    int *list = NULL, n = 0;
    unsigned char* is_held = om_calloc((size_t)mesh->nvert, 1);
    if (!is_held) return OM_NO_MEMORY;
    for (int i = 0; i < (task->nattach ? task->nattach : 1); i++) {
        const OmAttachDef* a = task->nattach ? &task->attach[i] : task->usual;
        OM_TRY_DONE(mark_attachment(task, a, mesh, surface, surface_vert, is_held));
    }
    OM_ALLOC_DONE(list, mesh->nvert);
    for (int v = 0; v < mesh->nvert; v++) {
        if (is_held[v]) list[n++] = v;
    }
    OM_TRY_DONE(om_tet_mesh_add_set(mesh, "attachment", list, n));
done:
    om_free(list);
    om_free(is_held);
    return status;
}
