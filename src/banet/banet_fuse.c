// banet_fuse.c: attachments from several views.
//
// With independent views and the base rate b, Bayes' rule gives
//
//     logit p = logit b + sum over views v of w_v (logit p_v - logit b)
//
// with w_v = 1. Frames of a grasp are not independent: their ratios are averaged, and the average counts as their
// total weight to a power below 1; the same holds for grasps with another power. The weight of a frame is its
// forgetting times visibility of the place.
#include "omentum/banet_fuse.h"

#include <math.h>
#include <string.h>

#define COOKIE 0xba2e7f05u

OmBanetFuseDef om_banet_fuse_default_def(void) {
    return (OmBanetFuseDef){.base = 0.275,
                            .same = 0,
                            .other = 1,
                            .half_life = 0,
                            .unseen = 0.3,
                            .limit = 4,
                            .cookie = COOKIE};
}

static bool is_share(double value) { return value >= 0 && value <= 1; }

static OmStatus check_views(int nview, const OmBanetView* view, int n) {
    OM_CHECK(nview >= 0 && n > 0, OM_INVALID, "banet: %d views of %d vertices", nview, n);
    for (int k = 0; k < nview; ++k) {
        OM_CHECK(view[k].probability, OM_INVALID, "banet: view %d has no probability", k);
        OM_CHECK(view[k].age >= 0 && isfinite(view[k].age), OM_INVALID,
                 "banet: view %d: age %g s, must be at least 0", k, view[k].age);
        for (int i = 0; i < n; ++i)
            OM_CHECK(is_share(view[k].probability[i]) &&
                         (!view[k].shown || is_share(view[k].shown[i])),
                     OM_INVALID, "banet: view %d: vertex %d is not within 0 to 1", k, i);
    }
    return OM_OK;
}

static OmStatus check_def(const OmBanetFuseDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmBanetFuseDef was not made by om_banet_fuse_default_def");
    OM_CHECK(d->base > 0 && d->base < 1, OM_INVALID,
             "OmBanetFuseDef.base = %g, must be above 0 and below 1", d->base);
    OM_CHECK(is_share(d->same) && is_share(d->other) && is_share(d->unseen), OM_INVALID,
             "OmBanetFuseDef: same %g, other %g, unseen %g must be 0 to 1", d->same, d->other,
             d->unseen);
    OM_CHECK(d->half_life >= 0 && isfinite(d->half_life), OM_INVALID,
             "OmBanetFuseDef.half_life = %g s, must be at least 0", d->half_life);
    OM_CHECK(d->limit > 0 && isfinite(d->limit), OM_INVALID,
             "OmBanetFuseDef.limit = %g, must be above 0", d->limit);
    return OM_OK;
}

// The log-odds of p less those of the base rate; p = 0 and 1 are at the limit.
static double ratio_of(const OmBanetFuseDef* d, double p, double base) {
    if (!(p > 0)) return -d->limit - base;
    if (!(p < 1)) return d->limit - base;
    return fmin(fmax(log(p / (1 - p)), -d->limit), d->limit) - base;
}

static bool is_first_of_grasp(const OmBanetView* view, int k) {
    for (int i = 0; i < k; ++i)
        if (view[i].grasp == view[k].grasp) return false;
    return true;
}

// Ratio of all frames of the grasp of view k at vertex i, and the weight of the grasp.
static double grasp_ratio(const OmBanetFuseDef* d, int nview, const OmBanetView* view, int k, int i,
                          double base, double* weight) {
    double sum = 0, ratio = 0, most = 0;
    for (int j = k; j < nview; ++j) {
        if (view[j].grasp != view[k].grasp) continue;
        double shown = view[j].shown ? view[j].shown[i] : 1;
        double w = d->unseen + (1 - d->unseen) * shown;
        if (d->half_life > 0) w *= exp2(-view[j].age / d->half_life);
        sum += w;
        most = fmax(most, w);
        ratio += w * ratio_of(d, view[j].probability[i], base);
    }
    *weight = most > 0 ? most * pow(sum / most, d->same) : 0;  // n equal frames: w n^same
    return sum > 0 ? ratio / sum : 0;
}

OmStatus om_banet_fuse(const OmBanetFuseDef* def, int nview, const OmBanetView* view, int n,
                       double* probability) {
    OM_TRY(check_def(def));
    OM_TRY(check_views(nview, view, n));
    const double base = log(def->base / (1 - def->base));
    for (int i = 0; i < n; ++i) {
        double total = 0, ratio = 0, most = 0;
        for (int k = 0; k < nview; ++k) {
            if (!is_first_of_grasp(view, k)) continue;
            double w, r = grasp_ratio(def, nview, view, k, i, base, &w);
            total += w;
            most = fmax(most, w);
            ratio += w * r;
        }
        // m equal grasps: their mean ratio times w m^other
        double scale = total > 0 ? most * pow(total / most, def->other) / total : 0;
        probability[i] = 1 / (1 + exp(-(base + scale * ratio)));
    }
    return OM_OK;
}

static void intersect(const OmBanetView* view, double threshold, int n, unsigned char* attached) {
    for (int i = 0; i < n; ++i) attached[i] &= view->probability[i] >= threshold;
}

// How many views are newer than view k; of the same age the later one in the list is newer.
static int count_newer(int nview, const OmBanetView* view, int k, bool only_its_grasp) {
    int count = 0;
    for (int j = 0; j < nview; ++j) {
        if (only_its_grasp && view[j].grasp != view[k].grasp) continue;
        count += view[j].age < view[k].age || (view[j].age == view[k].age && j > k);
    }
    return count;
}

OmStatus om_banet_intersect(int nview, const OmBanetView* view, int nlatest, double threshold,
                            int n, unsigned char* attached) {
    OM_TRY(check_views(nview, view, n));
    OM_CHECK(nlatest > 0, OM_INVALID, "banet: the latest %d views, must be at least 1", nlatest);
    memset(attached, nview > 0, (size_t)n);
    for (int k = 0; k < nview; ++k)
        if (count_newer(nview, view, k, false) < nlatest)
            intersect(&view[k], threshold, n, attached);
    return OM_OK;
}

OmStatus om_banet_intersect_grasps(int nview, const OmBanetView* view, double threshold, int n,
                                   unsigned char* attached) {
    OM_TRY(check_views(nview, view, n));
    memset(attached, nview > 0, (size_t)n);
    for (int k = 0; k < nview; ++k)
        if (count_newer(nview, view, k, true) == 0) intersect(&view[k], threshold, n, attached);
    return OM_OK;
}

// Sets end where the probability falls: p ascends, the set has its last k.
static bool is_set(const double* p, int n, int k) { return k == n || p[n - k - 1] < p[n - k]; }

OmStatus om_banet_choose_threshold(int n, const double* probability, double nearly,
                                   double* threshold) {
    double *p, all = 0, sum = 0, best = 0;
    *threshold = 1;
    OM_CHECK(is_share(nearly), OM_INVALID, "banet: nearly = %g, must be 0 to 1", nearly);
    for (int i = 0; i < n; ++i) {
        OM_CHECK(is_share(probability[i]), OM_INVALID,
                 "banet: probability[%d] = %g, must be 0 to 1", i, probability[i]);
        all += probability[i];
    }
    if (!(all > 0)) return OM_OK;
    OM_ALLOC(p, n);
    memcpy(p, probability, (size_t)n * sizeof *p);
    om_sort_doubles(p, n);
    for (int k = 1; k <= n; ++k) {
        sum += p[n - k];
        if (is_set(p, n, k)) best = fmax(best, 2 * sum / (k + all));
    }
    sum = 0;
    for (int k = 1; k <= n && p[n - k] > 0; ++k) {
        sum += p[n - k];
        if (is_set(p, n, k) && 2 * sum / (k + all) >= best - nearly) *threshold = p[n - k];
    }
    om_free(p);
    return OM_OK;
}
