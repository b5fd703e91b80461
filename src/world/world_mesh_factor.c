// world_mesh_factor.c: how much too stiffly a site's mesh bends.
//
// A linear tetrahedron has one strain, so a layer of them bends only by shear and volume that the tissue does not have.
// On the sheet of the retraction study (12 x 12 x 1 cells, 5 mm, Poisson's ratio 0.45) gravity does 0.13 of the work
// that quadratic elements of the same mesh allow. The spaces of a mesh and of its refinement are nested, so the work of
// the coarse one is never the larger.
//
// Tried: quadratic elements in place of the refinement. Their factor, 0.13, is nearer to the exact solution, but a real
// twin is compared with the tissue of a world whose elements are linear, too, and as fine as one refinement. Averaged
// strains (OmSceneTissue.is_averaged) cost several times a step.
#include <string.h>

#include "omentum/body.h"
#include "omentum/fem.h"

#define SMALL 1e-3   // of gravity
#define HELD "held"  // a set of vertices

// The horizontal axis along which the tissue is longest.
static OmStatus find_axis(const OmSite* site, OmVec3* axis, double* middle) {
    const OmVec3 up = om_quat_rotate(site->pose_world_task.q, om_vec3(0, 0, 1));
    double longest = 0;
    for (int k = 0; k < 2; ++k) {
        OmVec3 a = om_quat_rotate(site->pose_world_task.q, om_vec3(k == 0, k == 1, 0));
        double lo = HUGE_VAL, hi = -HUGE_VAL;
        for (int v = 0; v < site->mesh.nvert; ++v) {
            const double s = om_dot(a, om_load3(site->mesh.x, v));
            lo = fmin(lo, s), hi = fmax(hi, s);
        }
        if (hi - lo <= longest) continue;
        longest = hi - lo;
        *axis = a;
        *middle = 0.5 * (lo + hi);
    }
    OM_CHECK(longest > 0 && om_dot(up, site->gravity) < 0, OM_INVALID,
             "mesh factor: the site has no gravity, or its tissue no extent across it");
    return OM_OK;
}

// Hold the half beyond the middle, as a set that a refinement keeps.
static OmStatus hold_half(const OmSite* site, OmTetMesh* mesh) {
    OmVec3 axis = {0, 0, 0};
    double middle = 0;
    int* vert = NULL;
    int n = 0;
    OM_TRY(find_axis(site, &axis, &middle));
    OM_ALLOC(vert, (size_t)mesh->nvert);
    for (int v = 0; v < mesh->nvert; ++v)
        if (om_dot(axis, om_load3(mesh->x, v)) >= middle) vert[n++] = v;
    OmStatus status = om_tet_mesh_add_set(mesh, HELD, vert, n);
    om_free(vert);
    return status;
}

// Work of gravity on a mesh until it is at rest.
static OmStatus find_work(const OmSite* site, const OmTetMesh* mesh, double* work) {
    const int nmaterial = site->nmaterial > 0 ? site->nmaterial : 1;
    const OmMeshSet* held = om_tet_mesh_find_set(mesh, HELD);
    OmMaterial material[OM_SITE_MATERIALS];
    double density[OM_SITE_MATERIALS];
    OmFemMesh nodes = {0};
    OmFemSolid* solid = NULL;
    unsigned char* fixed = NULL;
    double *x = NULL, *g = NULL, *load = NULL;
    for (int k = 0; k < nmaterial; ++k) {
        const OmSiteMaterial m = om_site_get_material(site, k);
        material[k] = (OmMaterial){.law = OM_LINEAR, .young = m.young, .poisson = m.poisson};
        density[k] = m.density;
    }
    const OmFemLoad weight = {.body = om_scale(SMALL, site->gravity)};
    OmFemLoad all = weight;
    OM_TRY(om_fem_mesh_from_tet(mesh, OM_TET4, &nodes));
    const size_t n = 3 * (size_t)nodes.nnode;
    OmFemDef def = om_fem_default_def(&nodes, nmaterial, material);
    def.density = density;
    def.nworker = 1;
    OmStatus status = om_fem_create(&def, &solid);
    OM_TRY_DONE(status);
    OM_CALLOC_DONE(fixed, n);
    OM_ALLOC_DONE(x, n);
    OM_ALLOC_DONE(g, n);
    OM_ALLOC_DONE(load, n);
    for (int k = 0; k < held->nvert; ++k) memset(fixed + 3 * (size_t)held->vert[k], 1, 3);
    for (int v = 0; v < nodes.nnode; ++v) om_store3(g, v, weight.body);
    memcpy(x, nodes.x, n * sizeof *x);
    all.fixed = fixed;
    OmFemStaticDef how = om_fem_static_default_def(solid);
    OM_TRY_DONE(om_fem_static_solve(solid, &all, &how, x, NULL, NULL));
    om_fem_apply_mass(solid, true, g, load);
    *work = 0;
    for (size_t i = 0; i < n; ++i) *work += load[i] * (x[i] - nodes.x[i]);
done:
    om_free(fixed);
    om_free(x);
    om_free(g);
    om_free(load);
    om_fem_destroy(solid);
    om_fem_mesh_done(&nodes);
    return status;
}

OmStatus om_body_find_mesh_factor(const OmSite* site, double* factor) {
    OmTetMesh mesh = {0};
    double coarse = 0, fine = 0;
    *factor = 1;
    OM_TRY(om_tet_mesh_copy(&site->mesh, &mesh));
    OmStatus status = hold_half(site, &mesh);
    OM_TRY_DONE(status);
    OM_TRY_DONE(find_work(site, &mesh, &coarse));
    OM_TRY_DONE(om_tet_mesh_refine(&mesh));
    OM_TRY_DONE(find_work(site, &mesh, &fine));
    *factor = coarse / fine;
done:
    om_tet_mesh_done(&mesh);
    return status;
}
