// test_match_register_made.c: a made organ takes the way of real ones (test_match_register_organs), from a volume of
// voxels of 2 mm to meshes and a pose.
#include "match/register_shapes.h"
#include "test_files.h"

enum { NX = 60, NY = 48, NZ = 46 };

// The potato as a volume of one label; its volume in m^3, summed over cells of 1 mm.
static double write_potato(const char* path) {
    static char file[512 + NX * NY * NZ];
    double volume = 0;
    int n = snprintf(file, sizeof file,
                     "NRRD0004\ntype: uchar\ndimension: 3\nspace: RAS\nsizes: %d %d %d\n"
                     "space directions: (2,0,0) (0,2,0) (0,0,2)\nspace origin: (-59,-47,-45)\n"
                     "encoding: raw\n\n",
                     NX, NY, NZ);
    for (int at = 0; at < NX * NY * NZ; ++at) {
        const OmVec3 p = om_vec3(-0.059 + 2e-3 * (at % NX), -0.047 + 2e-3 * (at / NX % NY),
                                 -0.045 + 2e-3 * (at / (NX * NY)));
        file[n++] = potato(NULL, p) < 0;
        for (int c = 0; c < 8; ++c) {
            const OmVec3 half =
                om_vec3(c & 1 ? 5e-4 : -5e-4, c & 2 ? 5e-4 : -5e-4, c & 4 ? 5e-4 : -5e-4);
            volume += potato(NULL, om_add(p, half)) < 0 ? 1e-9 : 0;
        }
    }
    write_bytes(path, file, (size_t)n);
    return volume;
}

static void test_made_organ(void** state) {
    (void)state;
    const char* path = temp_path("potato.nrrd");
    const double volume = write_potato(path);
    const int n = test_count(2, 20);
    int nright = 0;
    OrganCase c;
    case_make(&(Organ){"potato", path, 0, 0.0045}, &c);
    remove(path);
    // both meshes come from voxels of 2 mm, whose steps even out; facets of 4.5 mm cut off more than those of 1.5 mm
    assert_near_rel(om_surface_volume(&c.truth), volume, 2e-3);
    assert_near_rel(om_surface_volume(&c.model), volume, 2e-2);
    for (int k = 0; k < n; ++k) {
        OmScan scan;
        OmPose truth;
        OmRegistration r;
        double angle, shift;
        case_look(&c, 7000 + (uint64_t)k, &scan, &truth);
        OmRegisterDef def = def_near(&scan, truth, 7000 + (uint64_t)k);
        assert_ok(om_scan_register(&def, &c.model, &scan, &r));
        case_error(&r, truth, &angle, &shift);
        const bool is_right = angle <= 0.5 && shift <= 0.5;
        assert_true(is_right || !r.is_reliable);
        nright += is_right;
        if (!is_right) printf("start %d: %.2f degrees, %.2f mm off\n", k, angle, shift);
        om_scan_done(&scan);
    }
    case_done(&c);
    assert_true(nright >= 0.95 * n);  // the bounds of the real organs
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_made_organ)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
