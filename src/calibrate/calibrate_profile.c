// calibrate_profile.c: which parameters the data determine: the cost around the optimum.
//
// Along each parameter, eight points on either side lie at fractions 1/128, 1/64 .. 1 of the distance to
// the bound. The interval in which the cost rises by less than a stated amount follows by interpolation.
// This does not show valleys that are oblique to the axes (stiffness against weight): for each pair of
// parameters the cost is computed at the four corners of their intervals. Where the cost is quadratic and
// rises equally along both axes, it rises at the corners by 2 + 2 rho and 2 - 2 rho times as much, rho the
// correlation of the two.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibrate/calibrate_internal.h"

#define NSIDE (OM_CALIBRATION_NPROFILE / 2)
#define MAX_RHO 0.95
#define MAX_PAIR (OM_CALIBRATION_MAX_PARAM * (OM_CALIBRATION_MAX_PARAM - 1) / 2)

int om__calibrate_profile_count(int nparam) {
    return 2 * NSIDE * nparam + 2 * nparam * (nparam - 1);
}

double om__calibrate_limit(const OmCalibrationDef* def, double min) {
    double scale = fmax(min, def->noise);
    return sqrt(min * min + def->rise * (2 + def->rise) * scale * scale);
}

// ---- along the axes -------------------------------------------------------------------------------

// Coordinate of point m of a profile, m in [-NSIDE, NSIDE].
static double place(double u, int m) {
    double fraction = ldexp(1, abs(m) - NSIDE);
    return m < 0 ? u - fraction * u : m > 0 ? u + fraction * (1 - u) : u;
}

// Coordinate up to which the cost stays below `limit` on one side; `is_open` if it does up to the bound.
static double find_end(const double* cost, double u, int side, double limit, bool* is_open) {
    const double* c = cost + NSIDE;
    for (int m = 1; m <= NSIDE; ++m) {
        double now = c[side * m], before = c[side * (m - 1)];
        if (!(now > limit)) continue;
        double a = place(u, side * (m - 1)), b = place(u, side * m);
        double t = isfinite(now) && now > before ? (limit - before) / (now - before) : 0.5;
        *is_open = false;
        return a + fmin(fmax(t, 0), 1) * (b - a);
    }
    *is_open = true;
    return place(u, side * NSIDE);
}

static OmStatus walk_axes(OmSearch* s, const double* u, double (*cost)[OM_CALIBRATION_NPROFILE]) {
    double point[2 * NSIDE * OM_CALIBRATION_MAX_PARAM * OM_CALIBRATION_MAX_PARAM];
    double centre = s->cost[s->best];
    int count = 0;
    for (int k = 0; k < s->n; ++k) {
        for (int m = -NSIDE; m <= NSIDE; ++m) {
            if (place(u[k], m) == u[k]) continue;  // the middle, or a whole side if u is at a bound
            double* p = point + count++ * s->n;
            memcpy(p, u, (size_t)s->n * sizeof *p);
            p[k] = place(u[k], m);
        }
    }
    int first = s->neval;
    OM_TRY(om__search_batch(s, count, point, NULL));
    for (int k = 0; k < s->n; ++k)
        for (int m = -NSIDE; m <= NSIDE; ++m)
            cost[k][m + NSIDE] = place(u[k], m) == u[k] ? centre : s->cost[first++];
    return OM_OK;
}

// ---- pairs ----------------------------------------------------------------------------------------

// Four corners: ++, --, +-, -+.
static OmStatus walk_pairs(OmSearch* s, const double* u, const double* lo, const double* hi,
                           double centre, OmCalibrationProfile* profile) {
    static const int sign[4][2] = {{1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
    double point[4 * MAX_PAIR * OM_CALIBRATION_MAX_PARAM];
    int count = 0, first = s->neval;
    for (int i = 0; i < s->n; ++i) {
        for (int j = i + 1; j < s->n; ++j) {
            for (int c = 0; c < 4; ++c) {
                double* p = point + count++ * s->n;
                memcpy(p, u, (size_t)s->n * sizeof *p);
                p[i] = sign[c][0] > 0 ? hi[i] : lo[i];
                p[j] = sign[c][1] > 0 ? hi[j] : lo[j];
            }
        }
    }
    OM_TRY(om__search_batch(s, count, point, NULL));
    const double* cost = s->cost + first;
    for (int i = 0; i < s->n; ++i) {
        for (int j = i + 1; j < s->n; ++j, cost += 4) {
            double same = cost[0] + cost[1] - 2 * centre, other = cost[2] + cost[3] - 2 * centre;
            double rho = same + other > 0 && isfinite(same + other)
                             ? (same - other) / (same + other)
                             : 0;  // avoids 0 / 0
            if (fabs(rho) <= MAX_RHO) continue;
            OmCalibrationProfile *a = &profile[i], *b = &profile[j];
            if (fabs(rho) > fabs(a->partner_rho)) a->partner = j, a->partner_rho = rho;
            if (fabs(rho) > fabs(b->partner_rho)) b->partner = i, b->partner_rho = rho;
        }
    }
    return OM_OK;
}

OmStatus om__calibrate_profile(OmSearch* s, double mesh_limit, OmCalibrationProfile* profile) {
    enum { N = OM_CALIBRATION_MAX_PARAM };
    double u[N], lo[N], hi[N], cost[N][OM_CALIBRATION_NPROFILE];
    double centre = s->cost[s->best], limit = om__calibrate_limit(s->def, centre);
    memcpy(u, s->u + (size_t)s->best * (size_t)s->n, (size_t)s->n * sizeof *u);
    om__search_begin(s, "sensitivity", om__calibrate_profile_count(s->n));
    OM_TRY(walk_axes(s, u, cost));
    for (int k = 0; k < s->n; ++k) {
        const OmCalibrationParam* p = &s->def->param[k];
        OmCalibrationProfile* f = &profile[k];
        *f = (OmCalibrationProfile){.partner = -1};
        lo[k] = find_end(cost[k], u[k], -1, limit, &f->is_open_lo);
        hi[k] = find_end(cost[k], u[k], 1, limit, &f->is_open_hi);
        f->lo = om__calibrate_from_unit(p, lo[k]);
        f->hi = om__calibrate_from_unit(p, hi[k]);
        double wide = fmax(limit, mesh_limit);
        bool is_open;
        f->mesh_lo = om__calibrate_from_unit(p, find_end(cost[k], u[k], -1, wide, &is_open));
        f->mesh_hi = om__calibrate_from_unit(p, find_end(cost[k], u[k], 1, wide, &is_open));
        memcpy(f->cost, cost[k], sizeof f->cost);
        for (int m = -NSIDE; m <= NSIDE; ++m)
            f->x[m + NSIDE] = om__calibrate_from_unit(p, place(u[k], m));
    }
    OM_TRY(walk_pairs(s, u, lo, hi, centre, profile));
    for (int k = 0; k < s->n; ++k)
        profile[k].is_determined =
            !profile[k].is_open_lo && !profile[k].is_open_hi && profile[k].partner < 0;
    return OM_OK;
}
