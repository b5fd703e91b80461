// fuzz_scan_csv.c: scans from tables of points: estimated normals, thinning, and the check against a model.
#include "fuzz_common.h"
#include "omentum/scan_file.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    OmScanFileDef def = om_scan_file_default_def();
    def.has_eye = size % 2;
    def.eye = om_vec3(0.1, 0.2, 0.3);
    def.spacing = size % 3 == 0 ? 0.002 : 0;
    const char* path = fuzz_file(data, size, ".csv");
    OmScan scan;
    OmStatus status = om_scan_load(path, &def, &scan, NULL);
    fuzz_file_done(path);
    FUZZ_EXPECT(status <= 0);
    if (status != OM_OK) {
        FUZZ_EXPECT(scan.x == NULL && om_error_message()[0] != '\0');
        return 0;
    }
    FUZZ_EXPECT(scan.npoint > 0 && om_scan_check(&scan) == OM_OK);
    double x[9] = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0};
    int tri[3] = {0, 1, 2};
    const OmSurface model = {3, 1, x, tri};
    OmScanFit fit;
    FUZZ_EXPECT(om_scan_check_model(&scan, &model, 0.1, &fit) <= 0);
    om_scan_done(&scan);
    return 0;
}
