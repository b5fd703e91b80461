// 09_two_bodies.c: a firm block presses 5 mm into a soft one; statics of solids, with contact between the two.
//
// The solids of fem.h take any element and law. Two bodies are one mesh; a contact names the faces of each that may
// touch, and is part of the solid's energy, so that nothing else changes: what the upper block is held with is what
// the contact carries and what the ground holds.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "omentum/omentum.h"

static const double travel = 0.005, top = 0.06;  // m

// A soft slab of 100 x 100 x 40 mm (hexahedra, material 0) below a block of 40 x 40 x 20 mm (material 1).
static OmStatus make_bodies(OmFemMesh* mesh) {
    static const int slab_cells[3] = {10, 10, 4},
                     block_cells[3] = {5, 5, 2};  // nodes need not meet
    OmFemMesh slab = {0}, block = {0};
    OmStatus status = om_fem_mesh_box(OM_HEX8_MEAN, om_vec3(-0.05, -0.05, 0),
                                      om_vec3(0.05, 0.05, 0.04), slab_cells, &slab);
    if (status == OM_OK)
        status = om_fem_mesh_box(OM_HEX8_MEAN, om_vec3(-0.02, -0.02, 0.04),
                                 om_vec3(0.02, 0.02, top), block_cells, &block);
    for (int e = 0; e < block.nelem; ++e) block.elem_material[e] = 1;
    if (status == OM_OK) status = om_fem_mesh_join(&slab, &block, mesh);
    om_fem_mesh_done(&slab);
    om_fem_mesh_done(&block);
    return status;
}

// Sort the faces in the plane between the bodies: those of the slab first, then the block's.
static void find_sides(const OmFemMesh* mesh, OmFemFaces* faces, OmFemContact* contact) {
    int k = faces->nface_node, kept = 0;
    for (int side = 0; side < 2; ++side) {
        contact->nface[side] = 0;
        contact->face_node[side] = faces->face_node + kept * k;
        for (int f = kept; f < faces->nface; ++f) {
            int *face = faces->face_node + f * k, *to = faces->face_node + kept * k;
            if (mesh->elem_material[faces->face_elem[f]] != side) continue;
            int is_between = 1;
            for (int a = 0; a < k; ++a)
                is_between = is_between && mesh->x[3 * face[a] + 2] > 0.04 - 1e-9 &&
                             mesh->x[3 * face[a] + 2] < 0.04 + 1e-9;
            if (!is_between) continue;
            for (int a = 0; a < k; ++a) {  // change places
                int node = to[a];
                to[a] = face[a], face[a] = node;
            }
            int elem = faces->face_elem[kept];
            faces->face_elem[kept] = faces->face_elem[f], faces->face_elem[f] = elem;
            ++kept, ++contact->nface[side];
        }
    }
}

// The ground holds the slab, a hand the top of the block, which goes down.
static OmStatus press(const OmFemSolid* solid, double* x, double* reaction) {
    const OmFemMesh* mesh = om_fem_mesh(solid);
    size_t n = 3 * (size_t)mesh->nnode;
    unsigned char* fixed = calloc(n, 1);
    double *goal = calloc(n, sizeof *goal), hand = 0, ground = 0;
    OmStatus status = fixed && goal ? OM_OK : OM_NO_MEMORY;
    for (size_t i = 0; i < n && status == OM_OK; ++i) {
        double z = mesh->x[i / 3 * 3 + 2];
        fixed[i] = z < 1e-9 || z > top - 1e-9;
        if (i % 3 == 2 && z > top - 1e-9) goal[i] = -travel;
    }
    OmFemLoad load = {.fixed = fixed, .goal = goal};
    OmFemStaticDef how = om_fem_static_default_def(solid);
    OmFemReport report;
    OmFemTouch touch;
    memcpy(x, mesh->x, n * sizeof *x);
    if (status == OM_OK) status = om_fem_static_solve(solid, &load, &how, x, reaction, &report);
    if (status == OM_OK) status = om_fem_eval_contact(solid, x, 0, &touch, NULL);
    if (status == OM_OK) {
        for (int i = 0; i < mesh->nnode; ++i)
            *(mesh->x[3 * i + 2] < 1e-9 ? &ground : &hand) += reaction[3 * i + 2];
        printf("%d Newton iterations to %.1e of the loads\n", report.nnewton, report.residual);
        printf("the hand pushes with %.4f N, the slab feels %.4f N, the ground holds %.4f N\n",
               -hand, -touch.force.z, ground);
        printf("%.0f mm2 touch, by %.3f mm too deep; an element keeps %.2f of its volume\n",
               1e6 * touch.area, 1e3 * touch.depth, report.min_volume);
        double miss = fabs(hand + ground) + fabs(ground + touch.force.z);
        if (miss > 1e-6 * ground) status = OM_NOT_CONVERGED;
    }
    free(fixed);
    free(goal);
    return status;
}

int main(void) {
    OmFemMesh mesh = {0};
    OmFemFaces faces = {0};
    OmFemSolid* solid = NULL;
    OmFemContact contact = {.stiffness = 0};  // by the stiffness of the elements
    OmMaterial material[2] = {{.young = 3000, .poisson = 0.49, .law = OM_NEO_HOOKEAN},
                              {.young = 15000, .poisson = 0.49, .law = OM_NEO_HOOKEAN}};
    OmStatus status = make_bodies(&mesh);
    if (status == OM_OK) status = om_fem_mesh_boundary(&mesh, &faces);
    if (status == OM_OK) {
        find_sides(&mesh, &faces, &contact);
        OmFemDef def = om_fem_default_def(&mesh, 2, material);
        def.ncontact = 1;
        def.contact = &contact;
        status = om_fem_create(&def, &solid);
    }
    double* x = malloc(6 * (size_t)(mesh.nnode + 1) * sizeof *x);
    if (!x && status == OM_OK) status = OM_NO_MEMORY;
    if (status == OM_OK) status = press(solid, x, x + 3 * (size_t)mesh.nnode);
    if (status != OM_OK) fprintf(stderr, "%s: %s\n", om_status_text(status), om_error_message());
    free(x);
    om_fem_destroy(solid);
    om_fem_faces_done(&faces);
    om_fem_mesh_done(&mesh);
    return status == OM_OK ? 0 : 1;
}
