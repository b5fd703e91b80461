// model_check.h: building a model from real data, one line of a table each, and what every model must hold.
#ifndef OMENTUM_TEST_MODEL_CHECK_H
#define OMENTUM_TEST_MODEL_CHECK_H

#include "omentum/scene_model.h"
#include "omentum/shape_file.h"
#include "test_common.h"

static inline void model_table_head(void) {
    printf("%-22s %7s %8s %6s %7s %9s %10s %8s %7s\n", "organ", "edge/mm", "tets", "min/deg",
           "max/deg", "volume/%", "surface/%", "mean/mm", "s");
}

// Volume and extreme dihedral angles (rad) of a mesh, from its vertices: angles between the normals of two faces.
static inline double model_measure(const OmTetMesh* m, double* min, double* max) {
    static const int face[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    double volume = 0;
    *min = OM_PI, *max = 0;
    for (int e = 0; e < m->ntet; e++) {
        OmVec3 x[4], normal[4];
        for (int i = 0; i < 4; i++) x[i] = om_load3(m->x, m->tet_vert[4 * e + i]);
        OmVec3 a = om_sub(x[1], x[0]), b = om_sub(x[2], x[0]), c = om_sub(x[3], x[0]);
        double six = om_dot(om_cross(a, b), c);
        assert_true(six > 0);
        volume += six / 6;
        for (int f = 0; f < 4; f++) {
            OmVec3 o = x[face[f][0]];
            normal[f] = om_normalize(om_cross(om_sub(x[face[f][1]], o), om_sub(x[face[f][2]], o)));
        }
        for (int f = 0; f < 4; f++) {
            for (int g = 0; g < f; g++) {
                double angle = OM_PI - acos(fmax(-1, fmin(1, om_dot(normal[f], normal[g]))));
                *min = fmin(*min, angle);
                *max = fmax(*max, angle);
            }
        }
    }
    return volume;
}

// Volume of the tetrahedra of a file, or inside its closed surface, m^3.
static inline double model_enclosed(const OmModelDef* def) {
    OmSurface s;
    OmTetMesh m;
    double six = 0, min, max;
    if (om_tet_mesh_load_flags(def->input, def->unit, OM_MESH_FLIP, &m) == OM_OK) {
        six = model_measure(&m, &min, &max);
        om_tet_mesh_done(&m);
        return six;
    }
    assert_ok(om_surface_load(def->input, def->unit, &s));
    for (int t = 0; t < s.ntri; t++) {
        const int* v = s.tri_vert + 3 * (size_t)t;
        six += om_dot(om_load3(s.x, v[0]), om_cross(om_load3(s.x, v[1]), om_load3(s.x, v[2])));
    }
    om_surface_done(&s);
    return fabs(six) / 6;
}

// Voxels of the model's labels (all that are not 0 without one), as a volume, m^3; 0 if the file is no volume.
static inline double model_count(const OmModelDef* def) {
    OmVolume v;
    if (!strstr(def->input, ".nii") && !strstr(def->input, ".nhdr")) return 0;
    assert_ok(om_volume_load(def->input, &v));
    size_t n = om_volume_count(&v), count = 0;
    for (size_t i = 0; i < n; i++) {
        double value = om_volume_value(&v, i);
        bool is_in = def->nlabel == 0 && value > 0;
        for (int k = 0; k < def->nlabel; k++) is_in |= value == def->label[k];
        count += is_in;
    }
    double voxel = fabs(om_dot(om_cross(v.grid.axis.cx, v.grid.axis.cy), v.grid.axis.cz));
    om_volume_done(&v);
    return (double)count * voxel;
}

/// The volume within 1 % of the cleaned mask (or of the closed surface that was read), 95 % of the distances in both
/// directions below a third of an edge, the largest below one edge, no lost place unless allowed, the same topology,
/// dihedral angles above 10 degrees, no inverted element. Volumes and angles are measured here; the builder's own
/// report must say the same. The mask and what was left out of it are what the file counts within 1 %. Returns the
/// volume, m^3.
static inline double model_check(const char* name, const OmModelDef* def) {
    OmPatient p;
    OmModelReport r;
    OmStatus status = om_model_build(def, NULL, &p, &r);
    if (status < 0) fail_msg("%s: %s", name, om_error_message());
    const OmMeshQuality* q = &r.quality;
    double surface = r.mask_volume > 0 ? r.surface_volume / r.mask_volume - 1 : 0, min, max;
    double volume = model_measure(&p.mesh, &min, &max), counted = model_count(def);
    const OmShapeFit* f = &r.fit;
    printf("%-22s %7.2f %8d %6.1f %7.1f %9.3f %10.4f %8.3f %7.2f%s mask %.4f of the voxels", name,
           r.edge * 1e3, q->ntet, min * 180 / OM_PI, max * 180 / OM_PI, 100 * r.volume_error,
           100 * surface, r.surface_error_mean * 1e3, r.seconds,
           r.edge < 0.999 * def->edge ? "  finer than asked" : "",
           counted > 0 ? r.mask_volume / counted : 0);
    printf("; 95 %% %.2f, %.2f, largest %.2f, %.2f mm; %s\n", f->to_mesh.p95 * 1e3,
           f->to_solid.p95 * 1e3, f->to_mesh.max * 1e3, f->to_solid.max * 1e3, r.warning);
    assert_true(r.has_fit && (!r.has_loss || def->allow_loss));
    assert_true(om_topology_is_equal(&f->solid, &f->mesh) || strstr(r.warning, "handles and"));
    assert_below(fmax(f->to_mesh.p95, f->to_solid.p95), def->edge / 3);
    assert_below(fmax(f->to_mesh.max, f->to_solid.max), def->edge);
    assert_int_equal(q->ntet, p.mesh.ntet);
    assert_near_rel(q->volume, volume, 1e-9);
    assert_near(q->dihedral_min, min, 1e-6);  // acos of numbers near 1
    assert_near(q->dihedral_max, max, 1e-6);
    double goal = counted > 0 ? r.mask_volume : model_enclosed(def);
    if (counted > 0)  // what was left out is said; holes of the mask are filled
        assert_near((r.mask_volume + r.left_out) / counted, 1, 0.01);
    assert_near(fabs(volume / goal - 1), r.volume_error, 1e-6);
    assert_near(volume / goal, 1, 0.01);
    assert_near(surface, 0, 0.02);
    assert_true(min * 180 / OM_PI > 10);
    assert_ok(om_tet_mesh_validate(&p.mesh));
    om_patient_done(&p);
    return volume;
}

#endif
