// scene_model_between.c: values between labels, as interpolation leaves them.
//
// A label map that was resampled with linear interpolation has voxels with values between two labels, along every
// border: 3507.5 between 0 and 7015. No label has this number, so the label loses its rim. Such voxels are counted
// for a note; with a threshold each of them is given to a label by its share.
//
// A value is a label if the volume has a voxel of this value whose six neighbours have it too, or if it is chosen, or
// 0. A voxel of another value v lies between labels a < v < b: those with most voxels among the 125 around it, or,
// where none is there, the next label below or above. Its share of b is (v - a) / (b - a). A whole number between
// labels, from a map of integers, is recognised by the same rule; a number that is a label elsewhere in the volume is
// taken as this label.
#include <string.h>

#include "scene/scene_model_internal.h"

enum { CHUNK = 4096, REAL_MAX = 1024, REACH = 2, NDISTINCT = 8 };

typedef struct Labels {
    int n;
    bool is_full;
    double value[REAL_MAX];  // ascending                                          (n)
} Labels;

// The index of the first label of at least v.
static int lower_bound(const Labels* l, double v) {
    int lo = 0, hi = l->n;
    while (lo < hi) {
        int mid = (lo + hi) / 2;
        if (l->value[mid] < v)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

static bool has_label(const Labels* l, double v) {
    int at = lower_bound(l, v);
    return at < l->n && l->value[at] == v;
}

static void add_label(Labels* l, double v) {
    int at = lower_bound(l, v);
    if (at < l->n && l->value[at] == v) return;
    if (l->n == REAL_MAX) {
        l->is_full = true;
        return;
    }
    memmove(l->value + at + 1, l->value + at, (size_t)(l->n - at) * sizeof *l->value);
    l->value[at] = v;
    l->n++;
}

typedef struct Census {
    int64_t nabove, nfraction, nramp;  // voxels above 0, with fractions, between their neighbours
    Labels whole;                      // whole numbers above 0
    Labels real;                       // labels
    Labels ramp;                       // whole numbers of voxels that lie between their neighbours
    double last;                       // the value added last
} Census;

// ---- counting -------------------------------------------------------------------------------------------

static void count_values(const OmVolume* v, Census* c) {
    const size_t count = om_volume_count(v);
    double value[CHUNK];
    for (size_t first = 0; first < count; first += CHUNK) {
        const size_t n = count - first < CHUNK ? count - first : CHUNK;
        om_volume_values(v, first, n, value);
        for (size_t i = 0; i < n; i++) {
            const double f = om__label_value(value[i]);
            const bool is_fraction = f != floor(f);
            c->nabove += f > 0;
            c->nfraction += is_fraction;
            if (is_fraction || !(f > 0) || f == c->last) continue;
            add_label(&c->whole, f);
            c->last = f;
        }
    }
}

// `side` has the values before and behind along i, j, k; beyond the border of the volume that of the voxel.
typedef void (*NeighbourFn)(Census* c, double value, const double side[6]);

// A label that is as wide as its neighbours.
static void find_core(Census* c, double f, const double side[6]) {
    if (f == c->last || f != floor(f)) return;
    for (int s = 0; s < 6; s++)
        if (side[s] != f) return;
    add_label(&c->real, f);
    c->last = f;
}

static void find_ramp(Census* c, double f, const double side[6]) {
    if (f != floor(f) || has_label(&c->real, f)) return;
    bool is_ramp = false;
    for (int a = 0; a < 3; a++)
        is_ramp = is_ramp || (side[2 * a] < f && f < side[2 * a + 1]) ||
                  (side[2 * a] > f && f > side[2 * a + 1]);
    if (!is_ramp) return;
    c->nramp++;
    add_label(&c->ramp, f);
}

static void read_row(const OmVolume* v, int first, int n, int j, int k, double* out) {
    om_volume_values(v, om_grid_index(v->grid.dim, first, j, k), (size_t)n, out);
    for (int i = 0; i < n; i++) out[i] = om__label_value(out[i]);
}

static void for_neighbours(const OmVolume* v, NeighbourFn fn, Census* c) {
    const int* dim = v->grid.dim;
    double mid[CHUNK + 2], row[4][CHUNK];
    c->last = 0;
    for (int k = 0; k < dim[2]; k++) {
        for (int j = 0; j < dim[1]; j++) {
            for (int first = 0; first < dim[0]; first += CHUNK) {
                const int n = dim[0] - first < CHUNK ? dim[0] - first : CHUNK;
                const int before = first > 0, after = first + n < dim[0];
                read_row(v, first - before, n + before + after, j, k, mid + 1 - before);
                if (!before) mid[0] = mid[1];
                if (!after) mid[n + 1] = mid[n];
                read_row(v, first, n, j > 0 ? j - 1 : j, k, row[0]);
                read_row(v, first, n, j + 1 < dim[1] ? j + 1 : j, k, row[1]);
                read_row(v, first, n, j, k > 0 ? k - 1 : k, row[2]);
                read_row(v, first, n, j, k + 1 < dim[2] ? k + 1 : k, row[3]);
                for (int i = 0; i < n; i++) {
                    if (!(mid[i + 1] > 0)) continue;
                    const double side[6] = {mid[i],    mid[i + 2], row[0][i],
                                            row[1][i], row[2][i],  row[3][i]};
                    fn(c, mid[i + 1], side);
                }
            }
        }
    }
}

static bool is_chosen(const OmBody* body, double v) {
    if (body->nlabel == 0) return v > 0;
    for (int i = 0; i < body->nlabel; i++)
        if (v == body->label[i]) return true;
    return false;
}

// ---- giving voxels to labels ----------------------------------------------------------------------------

// The label of the most voxels around voxel (i, j, k), of the labels [first, end); -1: none is there.
static int most_around(const OmVolume* v, const Labels* l, const int at[3], int first, int end) {
    int best = -1, nbest = 0, count[125], label[125], nlabel = 0;
    for (int n = 0; n < 125; n++) {
        const int p[3] = {at[0] + n % 5 - REACH, at[1] + n / 5 % 5 - REACH, at[2] + n / 25 - REACH};
        const int* d = v->grid.dim;
        if (p[0] < 0 || p[1] < 0 || p[2] < 0 || p[0] >= d[0] || p[1] >= d[1] || p[2] >= d[2])
            continue;
        const double f = om__label_value(om_volume_value(v, om_grid_index(d, p[0], p[1], p[2])));
        const int which = lower_bound(l, f);
        if (which < first || which >= end || l->value[which] != f) continue;
        int s = 0;
        while (s < nlabel && label[s] != which) s++;
        if (s == nlabel) {
            label[nlabel] = which;
            count[nlabel++] = 0;
        }
        if (++count[s] > nbest) {
            nbest = count[s];
            best = which;
        }
    }
    return best;
}

static double label_of(const OmModelDef* def, const OmBody* body, const Labels* l, const int at[3],
                       double f) {
    const int split = lower_bound(l, f);  // labels before it are below f
    if (split == 0) return l->value[0];
    int a = most_around(&body->volume, l, at, 0, split);
    int b = most_around(&body->volume, l, at, split, l->n);
    if (a < 0) a = split - 1;
    if (b < 0) b = split;
    if (b >= l->n) return l->value[a];  // above every label: interpolation overshot
    const double lo = l->value[a], hi = l->value[b], share = (f - lo) / (hi - lo);
    const bool is_lo = is_chosen(body, lo), is_hi = is_chosen(body, hi);
    if (is_hi && !is_lo) return share >= def->threshold ? hi : lo;
    if (is_lo && !is_hi) return 1 - share >= def->threshold ? lo : hi;
    return share >= 0.5 ? hi : lo;
}

// Replace the volume by one of labels.
static OmStatus give_to_labels(const OmModelDef* def, const Labels* l, OmBody* body) {
    const OmVolume* v = &body->volume;
    const int* dim = v->grid.dim;
    int32_t* label;
    OM_ALLOC(label, om_volume_count(v));
    double value[CHUNK];
    size_t n = 0;
    for (int k = 0; k < dim[2]; k++) {
        for (int j = 0; j < dim[1]; j++) {
            for (int i = 0; i < dim[0]; i++, n++) {
                if (i % CHUNK == 0)
                    read_row(v, i, dim[0] - i < CHUNK ? dim[0] - i : CHUNK, j, k, value);
                const double f = value[i % CHUNK];
                const int at[3] = {i, j, k};
                // labels are at most LABEL_MAX or chosen: each fits
                label[n] = (int32_t)(has_label(l, f) ? f : label_of(def, body, l, at, f));
            }
        }
    }
    if (!body->is_volume_borrowed) om_free(body->volume.voxel);
    body->is_volume_borrowed = false;
    body->volume.voxel = label;
    body->volume.type = OM_VOXEL_I32;
    body->volume.slope = 1;
    body->volume.inter = 0;
    return OM_OK;
}

static void keep_labels_that_fit(Labels* l) {
    int n = 0;
    for (int i = 0; i < l->n; i++)
        if (l->value[i] >= 0 && l->value[i] <= 2147483647.0) l->value[n++] = l->value[i];
    l->n = n;
}

static OmStatus resolve(const OmModelDef* def, OmBody* body, Census* c, OmModelReport* report) {
    count_values(&body->volume, c);
    if (c->nabove == 0) return OM_OK;
    if (c->nfraction == 0 && c->whole.n <= NDISTINCT && !(def->threshold > 0)) return OM_OK;
    for_neighbours(&body->volume, find_core, c);
    add_label(&c->real, 0);
    for (int i = 0; i < body->nlabel; i++) add_label(&c->real, body->label[i]);
    for_neighbours(&body->volume, find_ramp, c);
    const bool is_between =
        c->nfraction > 0 || (c->ramp.n >= NDISTINCT && c->nramp > c->nabove / 100);
    const int64_t n = c->nfraction + (c->ramp.n >= NDISTINCT ? c->nramp : 0);
    if (def->threshold > 0) {
        OM_CHECK(!c->real.is_full, OM_INVALID, "%s: threshold: more than %d labels", def->input,
                 REAL_MAX);
        keep_labels_that_fit(&c->real);
        OM_TRY(give_to_labels(def, &c->real, body));
        if (is_between)
            om__model_note(
                report,
                "%lld voxels (%.3g %% of those above 0) had values between labels: each is given "
                "to a label of which it has a share of %g",
                (long long)n, 100 * (double)n / (double)c->nabove, def->threshold);
        return OM_OK;
    }
    if (is_between)
        om__model_note(
            report,
            "%lld voxels (%.3g %% of those above 0) have values between labels and are %s: the "
            "map was probably interpolated after it was segmented (--threshold 0.5 gives each "
            "to the nearer label; better: resample with nearest neighbour)",
            (long long)n, 100 * (double)n / (double)c->nabove,
            body->nlabel ? "left out" : "taken whole");
    return OM_OK;
}

OmStatus om__body_resolve_between(const OmModelDef* def, OmBody* body, OmModelReport* report) {
    Census* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    OmStatus status = resolve(def, body, c, report);
    om_free(c);
    return status;
}
