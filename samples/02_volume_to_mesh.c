// 02_volume_to_mesh.c: from a label map to a tetrahedral mesh and what can be said of it.
//
//     02_volume_to_mesh [labels.nii.gz [label]]      without arguments, of an ellipsoid made here
//
// The steps of `omentum model`, one by one: voxels, mask, distance field, mesh, quality, file. Writes
// 02_volume_to_mesh.vtu, which ParaView opens.
#include <stdio.h>
#include <stdlib.h>

#include "omentum/omentum.h"

#define DEG (180 / 3.14159265358979323846)

// A label map as a scanner would give it: anisotropic voxels, an ellipsoid of 60 x 40 x 50 mm.
static OmStatus make_volume(OmVolume* volume) {
    const OmVec3 step = om_vec3(0.0015, 0.0015, 0.003), radius = om_vec3(0.030, 0.020, 0.025);
    OmStatus status = om_volume_init(volume, 48, 36, 24);
    if (status != OM_OK) return status;
    volume->grid.axis = om_mat3_diag(step);
    volume->grid.origin = om_vec3(-0.0355, -0.0265, -0.0345);
    for (int k = 0, n = 0; k < 24; ++k)
        for (int j = 0; j < 36; ++j)
            for (int i = 0; i < 48; ++i, ++n) {
                OmVec3 p = om_voxel_grid_point(&volume->grid, om_vec3(i, j, k));
                OmVec3 q = om_vec3(p.x / radius.x, p.y / radius.y, p.z / radius.z);
                ((float*)volume->voxel)[n] = om_dot(q, q) < 1 ? 1.0f : 0.0f;
            }
    return OM_OK;
}

// The voxels of one label, its largest part without holes, with air around it.
static OmStatus make_mask(const OmVolume* volume, int label, OmMask* mask) {
    OmStatus status =
        om_mask_init(mask, volume->grid.dim[0], volume->grid.dim[1], volume->grid.dim[2]);
    if (status != OM_OK) return status;
    mask->grid.axis = volume->grid.axis;
    mask->grid.origin = volume->grid.origin;
    int count = volume->grid.dim[0] * volume->grid.dim[1] * volume->grid.dim[2];
    for (int n = 0; n < count; ++n) mask->inside[n] = om_volume_value(volume, (size_t)n) == label;
    status = om_mask_crop(mask, 4);
    if (status == OM_OK) status = om_mask_keep_parts(mask, 6, 0, NULL, NULL);
    if (status == OM_OK) status = om_mask_fill_holes(mask);
    return status;
}

static OmStatus make_mesh(const OmMask* mask, OmTetMesh* mesh) {
    OmSdf sdf = {0};
    OmSdfDef sdf_def = om_sdf_default_def(0.0015);
    OmStatus status = om_sdf_from_mask(mask, &sdf_def, &sdf);
    if (status != OM_OK) return status;
    OmVec3 lo, hi;
    om_sdf_bounds(&sdf, &lo, &hi);
    OmStuffDef def = om_stuff_default_def(0.004, om_sdf_shape_fn, &sdf, lo, hi);
    status = om_tet_mesh_stuff(&def, mesh);
    om_sdf_done(&sdf);
    return status;
}

static void print_quality(const OmMask* mask, const OmMeshQuality* q) {
    double voxels = om_mask_volume(mask);
    printf("voxels    %.2f ml\n", 1e6 * voxels);
    printf("mesh      %.2f ml (%+.2f %%), %d vertices, %d tetrahedra in %d part(s)\n",
           1e6 * q->volume, 100 * (q->volume / voxels - 1), q->nvert, q->ntet, q->npart);
    printf("dihedral  %.1f to %.1f degrees\n", q->dihedral_min * DEG, q->dihedral_max * DEG);
    printf("edges     %.2f mm on average\n", 1e3 * q->edge_mean);
}

int main(int argc, char** argv) {
    OmVolume volume = {0};
    OmMask mask = {0};
    OmTetMesh mesh = {0};
    OmMeshQuality quality;
    OmStatus status = argc > 1 ? om_volume_load(argv[1], &volume) : make_volume(&volume);
    if (status == OM_OK) status = make_mask(&volume, argc > 2 ? atoi(argv[2]) : 1, &mask);
    if (status == OM_OK) status = make_mesh(&mask, &mesh);
    if (status == OM_OK) status = om_tet_mesh_quality(&mesh, &quality);
    if (status == OM_OK) status = om_tet_mesh_save(&mesh, "02_volume_to_mesh.vtu", OM_UNIT_M);
    if (status == OM_OK)
        print_quality(&mask, &quality);
    else
        fprintf(stderr, "%s\n", om_error_message());
    om_tet_mesh_done(&mesh);
    om_mask_done(&mask);
    om_volume_done(&volume);
    return status == OM_OK ? 0 : 1;
}
