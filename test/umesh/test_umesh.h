// test_umesh.h: small organs and sets of samples that cost milliseconds.
#ifndef OMENTUM_TEST_UMESH_H
#define OMENTUM_TEST_UMESH_H

#include "omentum/umesh.h"
#include "test_common.h"

/// The phantom in about `nelem` elements.
static inline OmUmeshOrgan* make_organ(int nelem) {
    OmUmeshOrganDef def = om_umesh_organ_default_def();
    def.nelem = nelem;
    def.multiple = 4;
    def.dim[0] = def.dim[1] = def.dim[2] = 0;
    OmUmeshOrgan* organ;
    assert_ok(om_umesh_organ_create(&def, &organ));
    return organ;
}

/// A patch that finds nodes in so coarse a grid, small loads.
static inline OmUmeshDataDef small_def(const OmUmeshOrgan* organ, const char* dir) {
    OmUmeshDataDef def = om_umesh_data_default_def(organ, dir);
    def.patch_size[1] = 0.03;
    def.patch_size[2] = 0.02;
    def.max_press = 0.01;
    def.max_force = 0.3;
    def.nsample = 6;
    def.shard = 4;
    def.npicture = 0;
    return def;
}

#endif
