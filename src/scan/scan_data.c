// scan_data.c: a scan as data: memory and checks.
#include <math.h>
#include <string.h>

#include "omentum/scan.h"

#define NORMAL_TOLERANCE 1e-3  // of the length of a normal: files store float

OmStatus om_scan_init(int npoint, int ntri, OmScan* scan) {
    memset(scan, 0, sizeof *scan);
    OmStatus status = OM_OK;
    OM_CHECK(npoint >= 0 && ntri >= 0, OM_INVALID, "a scan of %d points and %d triangles", npoint,
             ntri);
    OM_CALLOC_DONE(scan->x, 3 * (size_t)npoint);
    OM_CALLOC_DONE(scan->normal, 3 * (size_t)npoint);
    OM_CALLOC_DONE(scan->tri_vert, 3 * (size_t)ntri);
    scan->npoint = npoint;
    scan->ntri = ntri;
done:
    if (status < 0) om_scan_done(scan);
    return status;
}

void om_scan_done(OmScan* scan) {
    if (!scan) return;
    om_free(scan->x);
    om_free(scan->normal);
    om_free(scan->tri_vert);
    om_free(scan->pixel);
    om_free(scan->depth);
    memset(scan, 0, sizeof *scan);
}

static OmStatus check_point(const OmScan* scan, int i) {
    const double* x = scan->x + 3 * (size_t)i;
    OM_CHECK(isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]), OM_INVALID,
             "point %d of the scan is (%g, %g, %g); a position is finite", i, x[0], x[1], x[2]);
    double length = om_norm(om_load3(scan->normal, i));
    OM_CHECK(length == 0 || fabs(length - 1) < NORMAL_TOLERANCE, OM_INVALID,
             "the normal of point %d of the scan has length %g; 1, or 0 if it is not known", i,
             length);
    return OM_OK;
}

OmStatus om_scan_check(const OmScan* scan) {
    OM_CHECK(scan->npoint >= 0 && scan->ntri >= 0, OM_INVALID,
             "a scan of %d points and %d triangles", scan->npoint, scan->ntri);
    for (int i = 0; i < scan->npoint; ++i) OM_TRY(check_point(scan, i));
    for (int t = 0; t < scan->ntri; ++t)
        for (int k = 0; k < 3; ++k) {
            int i = scan->tri_vert[3 * (size_t)t + (size_t)k];
            OM_CHECK(i >= 0 && i < scan->npoint, OM_INVALID,
                     "triangle %d of the scan has point %d; it has points 0 to %d", t, i,
                     scan->npoint - 1);
        }
    OM_CHECK(scan->noise >= 0 && isfinite(scan->noise), OM_INVALID,
             "the noise of the scan is %g m; 0 or more", scan->noise);
    return OM_OK;
}
