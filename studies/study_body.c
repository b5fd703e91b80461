// study_body.c: bodies as functions, and their meshes with a given number of elements.
//
// The number of elements is proportional to edge^-3 up to surface effects; a secant search in logarithms
// finds the edge in a few meshes. Isosurface stuffing places whole lattice cells, so the last percent cannot
// be chosen.
#include <math.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "studies/study_internal.h"

#define MESH_TOLERANCE 0.01  // relative error of the number of elements
#define MAX_TRY 10

double om_study_body_eval(const OmStudyBody* body, OmVec3 p) {
    if (body->is_file) return om_sdf_eval(&body->sdf, p, NULL);
    return body->is_box ? om__study_eval_box(body, p) : om__study_eval_phantom(body, p);
}

double om__study_shape_fn(void* ctx, OmVec3 p) { return om_study_body_eval(ctx, p); }

const OmStudyLesion* om_study_lesions(const OmStudyBody* body, int* nlesion) {
    *nlesion = body->nlesion;
    return body->lesion;
}

int om_study_count_outside(const OmStudyBody* body) { return body->noutside; }

void om_study_body_destroy(OmStudyBody* body) {
    if (!body) return;
    om_sdf_done(&body->sdf);
    om_free(body->attached);
    om_free(body);
}

// ---- meshes ---------------------------------------------------------------------------------------

// Name the attached vertices of the boundary.
static OmStatus add_attachment(const OmStudyBody* body, double edge, OmTetMesh* mesh) {
    OmSurface surface = {0};
    int *vert = NULL, n = 0;
    OmStatus status = om_tet_mesh_boundary(mesh, &surface, &vert);
    if (status < 0) goto done;
    for (int i = 0; i < surface.nvert; ++i)
        if (om__study_is_attached(body, om_load3(surface.x, i), edge)) vert[n++] = vert[i];
    OM_CHECK_DONE(n > 0, OM_INVALID, "study: no vertex of a mesh of %d elements is attached",
                  mesh->ntet);
    status = om_tet_mesh_add_set(mesh, "attachment", vert, n);
done:
    om_surface_done(&surface);
    om_free(vert);
    return status;
}

static OmStatus mesh_with_edge(const OmStudyBody* body, double edge, int nworker, OmTetMesh* mesh) {
    OmVec3 pad = om_vec3(edge, edge, edge);
    OmStuffDef def = om_stuff_default_def(edge, om__study_shape_fn, (void*)body,
                                          om_sub(body->lo, pad), om_add(body->hi, pad));
    def.nworker = nworker;
    OM_TRY(om_tet_mesh_stuff(&def, mesh));
    OmStatus status = om_tet_mesh_keep_parts(mesh, 0, NULL, NULL);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}

OmStatus om_study_body_mesh(const OmStudyBody* body, int ntet, int nworker, OmTetMesh* mesh) {
    memset(mesh, 0, sizeof *mesh);
    OM_CHECK(ntet >= 100 && ntet <= 2000000, OM_INVALID,
             "study: a mesh of %d elements; 100 to 2000000 are possible", ntet);
    OmVec3 size = om_sub(body->hi, body->lo);
    // a tetrahedron of the lattice has about 0.1 edge^3, and the body fills about half its box
    double log_edge = log(cbrt(0.5 * size.x * size.y * size.z / (0.1 * ntet)));
    double last_edge = 0, last_miss = 0, best = HUGE_VAL, edge = 0;
    for (int k = 0; k < MAX_TRY && best > MESH_TOLERANCE; ++k) {
        OmTetMesh trial;
        OmStatus status = mesh_with_edge(body, exp(log_edge), nworker, &trial);
        if (status < 0) {
            om_tet_mesh_done(mesh);
            return status;
        }
        double miss = log((double)trial.ntet / ntet);
        if (fabs(miss) < best) {
            om_tet_mesh_done(mesh);
            *mesh = trial;
            best = fabs(miss);
            edge = exp(log_edge);
        } else {
            om_tet_mesh_done(&trial);
        }
        double slope =
            k > 0 && log_edge != last_edge ? (miss - last_miss) / (log_edge - last_edge) : -3;
        // the number of elements jumps by whole cells
        if (!(slope < -1.5 && slope > -6)) slope = -3;
        last_edge = log_edge;
        last_miss = miss;
        log_edge -= miss / slope;
    }
    OmStatus status = add_attachment(body, edge, mesh);
    if (status < 0) om_tet_mesh_done(mesh);
    return status;
}
