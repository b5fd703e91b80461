// model_check.h: building a model from real data, one line of a table each, and what every model must hold.
#ifndef OMENTUM_TEST_MODEL_CHECK_H
#define OMENTUM_TEST_MODEL_CHECK_H

#include "omentum/scene_model.h"
#include "test_common.h"

static inline void model_table_head(void) {
    printf("%-22s %7s %8s %6s %7s %9s %10s %8s %7s\n", "organ", "edge/mm", "tets", "min/deg",
           "max/deg", "volume/%", "surface/%", "mean/mm", "s");
}

/// Volumes of mesh and surface within 2 % of the cleaned mask (or of the closed surface that was read),
/// dihedral angles above 8 degrees, no inverted element: issue 2. Returns the volume, m^3.
static inline double model_check(const char* name, const OmModelDef* def) {
    OmPatient p;
    OmModelReport r;
    OmStatus status = om_model_build(def, NULL, &p, &r);
    if (status < 0) fail_msg("%s: %s", name, om_error_message());
    const OmMeshQuality* q = &r.quality;
    double surface = r.mask_volume > 0 ? r.surface_volume / r.mask_volume - 1 : 0;
    printf("%-22s %7.2f %8d %6.1f %7.1f %9.3f %10.4f %8.3f %7.2f%s\n", name, r.edge * 1e3, q->ntet,
           q->dihedral_min * 180 / OM_PI, q->dihedral_max * 180 / OM_PI, 100 * r.volume_error,
           100 * surface, r.surface_error_mean * 1e3, r.seconds,
           r.edge < 0.999 * def->edge ? "  finer than asked" : "");
    assert_below(r.volume_error, 0.02);
    assert_below(fabs(surface), 0.02);
    assert_true(q->dihedral_min * 180 / OM_PI > 8);
    assert_ok(om_tet_mesh_validate(&p.mesh));
    om_patient_done(&p);
    return q->volume;
}

#endif
