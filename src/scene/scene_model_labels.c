// scene_model_labels.c: the labels of a file, and the choice of those from which a model is built.
//
// A label's number is the value of its voxels, unless segments of several layers have equal values (3D Slicer
// numbers each layer from 1): then segments are numbered from 1 in the order of the file, and the list says so.
// Labels of several layers are joined in one volume; where they overlap, the voxel belongs to the label named
// first. Labels above 2^31 are found by a list beside the table of small ones; a chosen one gets a number that fits.
#include <limits.h>
#include <string.h>
#include <strings.h>

#include "scene/scene_model_internal.h"

enum { LABEL_MAX = 65535, ROW_MAX = 1024, CHOICE_MAX = 20, LAYER_MAX = 256, CHUNK = 4096 };

#define STORED_MAX 9007199254740992.0  // 2^53: a double holds whole numbers up to it
#define WHOLE_MIN 0.3  // share of whole numbers, above 0, from which a map has labels

// ---- the values of a volume ---------------------------------------------------------------------------

typedef struct Tally {  // statistics of one value during the scan of the volume
    int64_t count;
    double sum[3];  // sum of the voxels' indices
    int box[6];
    OmVec3 lo, hi;  // extent of the voxel centres, m
} Tally;

static OmVec3 voxel_centre(const OmVolume* v, double i, double j, double k) {
    return om_voxel_grid_point(&v->grid, om_vec3(i, j, k));
}

// Add voxels [begin, end) of row (j, k) to the value.
static void add_run(const OmVolume* v, Tally* t, int begin, int end, int j, int k) {
    const int first[3] = {begin, j, k}, last[3] = {end - 1, j, k};
    const double n = end - begin;
    OmVec3 a = voxel_centre(v, begin, j, k), b = voxel_centre(v, end - 1, j, k);
    for (int c = 0; c < 3; c++) {
        if (t->count == 0 || first[c] < t->box[c]) t->box[c] = first[c];
        if (t->count == 0 || last[c] > t->box[3 + c]) t->box[3 + c] = last[c];
    }
    t->lo = t->count == 0 ? om_min3(a, b) : om_min3(t->lo, om_min3(a, b));
    t->hi = t->count == 0 ? om_max3(a, b) : om_max3(t->hi, om_max3(a, b));
    t->sum[0] += n * 0.5 * (begin + end - 1);
    t->sum[1] += n * j;
    t->sum[2] += n * k;
    t->count += end - begin;
}

static void fill_row(const OmVolume* v, const Tally* t, double value, OmLabelRow* row) {
    const double n = (double)t->count;
    const OmMat3* a = &v->grid.axis;
    OmVec3 half = om_vec3(0.5 * (fabs(a->cx.x) + fabs(a->cy.x) + fabs(a->cz.x)),
                          0.5 * (fabs(a->cx.y) + fabs(a->cy.y) + fabs(a->cz.y)),
                          0.5 * (fabs(a->cx.z) + fabs(a->cy.z) + fabs(a->cz.z)));
    const int small = value <= INT_MAX ? (int)value : -1;
    *row = (OmLabelRow){.label = small, .value = small, .stored = value, .nvoxel = t->count};
    row->volume = n * fabs(om_mat3_det(v->grid.axis));
    row->lo = om_sub(t->lo, half);
    row->hi = om_add(t->hi, half);
    row->centroid = voxel_centre(v, t->sum[0] / n, t->sum[1] / n, t->sum[2] / n);
    for (int c = 0; c < 3; c++)
        row->is_cut = row->is_cut || t->box[c] == 0 || t->box[3 + c] == v->grid.dim[c] - 1;
}

typedef struct Tallies {
    Tally* small;  // of the values 0 to LABEL_MAX
    Tally large[ROW_MAX];
    double value[ROW_MAX];  // of `large`, in the order in which they were found
    int nlarge, last;
} Tallies;

// The statistics of a whole number above 0; null: there are too many numbers.
static Tally* find_tally(Tallies* t, double f) {
    if (f <= LABEL_MAX) return &t->small[(int)f];
    if (t->last < t->nlarge && t->value[t->last] == f) return &t->large[t->last];
    for (t->last = 0; t->last < t->nlarge; t->last++)
        if (t->value[t->last] == f) return &t->large[t->last];
    if (t->nlarge == ROW_MAX) return NULL;
    t->value[t->nlarge] = f;
    return &t->large[t->nlarge++];
}

// Add the values of one row, from voxel `first` on.
static void scan_values(const OmVolume* v, const double* value, int first, int n, int j, int k,
                        Tallies* tallies, OmLabelScan* scan) {
    for (int i = 0; i < n;) {
        int begin = i;
        const double f = om__label_value(value[begin]);
        while (i < n && om__label_value(value[i]) == f) i++;
        scan->min = fmin(scan->min, f);
        scan->max = fmax(scan->max, f);
        const bool is_whole = f == floor(f);
        if (f < 0 || f > STORED_MAX) scan->is_intensity = true;
        if (!is_whole) scan->nfraction += i - begin;
        if (f > 0) scan->nabove += i - begin;
        if (!is_whole || !(f > 0) || scan->is_intensity) continue;
        Tally* tally = find_tally(tallies, f);
        if (tally)
            add_run(v, tally, first + begin, first + i, j, k);
        else
            scan->is_intensity = true;
    }
}

static void scan_rows(const OmVolume* v, Tallies* tallies, OmLabelScan* scan) {
    double value[CHUNK];
    size_t n = 0;
    for (int k = 0; k < v->grid.dim[2]; k++) {
        for (int j = 0; j < v->grid.dim[1]; j++, n += (size_t)v->grid.dim[0]) {
            for (int first = 0; first < v->grid.dim[0]; first += CHUNK) {
                int len = v->grid.dim[0] - first < CHUNK ? v->grid.dim[0] - first : CHUNK;
                om_volume_values(v, n + (size_t)first, (size_t)len, value);
                scan_values(v, value, first, len, j, k, tallies, scan);
            }
        }
    }
}

OmStatus om__label_scan(const OmVolume* volume, OmLabelScan* scan) {
    OmStatus status = OM_OK;
    Tallies* t = om_calloc(1, sizeof *t);
    *scan = (OmLabelScan){.min = HUGE_VAL, .max = -HUGE_VAL};
    if (!t) return OM_NO_MEMORY;
    OM_CALLOC_DONE(t->small, LABEL_MAX + 1);
    scan_rows(volume, t, scan);
    for (int l = 1; l <= LABEL_MAX; l++) scan->nrow += t->small[l].count > 0;
    scan->nrow += t->nlarge;
    const double nwhole = (double)(scan->nabove - scan->nfraction);
    scan->is_intensity = scan->is_intensity || scan->nrow > ROW_MAX ||
                         (scan->nfraction > 0 && nwhole < WHOLE_MIN * (double)scan->nabove);
    OM_ALLOC_DONE(scan->row, scan->nrow);
    OM_ALLOC_DONE(scan->box, scan->nrow);
    int n = 0;
    for (int l = 1; l <= LABEL_MAX; l++) {
        if (t->small[l].count == 0) continue;
        fill_row(volume, &t->small[l], l, &scan->row[n]);
        memcpy(scan->box[n++], t->small[l].box, sizeof t->small[l].box);
    }
    for (int l = 0; l < t->nlarge; l++, n++) {  // in ascending order
        int at = n;
        for (; at > 0 && scan->row[at - 1].stored > t->value[l]; at--) {
            scan->row[at] = scan->row[at - 1];
            memcpy(scan->box[at], scan->box[at - 1], sizeof scan->box[at]);
        }
        fill_row(volume, &t->large[l], t->value[l], &scan->row[at]);
        memcpy(scan->box[at], t->large[l].box, sizeof scan->box[at]);
    }
done:
    om_free(t->small);
    om_free(t);
    if (status < 0) om__label_scan_done(scan);
    return status;
}

void om__label_scan_done(OmLabelScan* scan) {
    om_free(scan->row);
    om_free(scan->box);
    memset(scan, 0, sizeof *scan);
}

// ---- segments and their numbers -------------------------------------------------------------------------

static bool are_values_unique(const OmVolumeInfo* info) {
    for (int s = 0; s < info->nsegment; s++) {
        for (int t = 0; t < s; t++)
            if (info->segment[s].value == info->segment[t].value) return false;
    }
    return true;
}

// The number by which a user chooses a segment.
static int segment_label(const OmVolumeInfo* info, bool is_unique, int s) {
    return !info->has_layers || is_unique ? info->segment[s].value : s + 1;
}

// The segment with this value in this layer, or -1.
static int find_segment(const OmVolumeInfo* info, int layer, int value) {
    for (int s = 0; s < info->nsegment; s++) {
        const OmSegment* g = &info->segment[s];
        if (g->layer == layer && g->value == value) return s;
    }
    return -1;
}

// ---- the list ---------------------------------------------------------------------------------------------

static OmStatus count_parts(const OmVolume* v, const int box[6], OmLabelRow* row) {
    OmMask mask;
    int64_t size = 0;
    OM_TRY(om_mask_init(&mask, box[3] - box[0] + 1, box[4] - box[1] + 1, box[5] - box[2] + 1));
    size_t n = 0;
    for (int k = box[2]; k <= box[5]; k++) {
        for (int j = box[1]; j <= box[4]; j++) {
            for (int i = box[0]; i <= box[3]; i++, n++) {
                size_t at = om_grid_index(v->grid.dim, i, j, k);
                mask.inside[n] = om__label_value(om_volume_value(v, at)) == row->stored;
            }
        }
    }
    OmStatus status = om_mask_list_parts(&mask, 6, &size, 1, &row->npart);
    row->largest = (double)size * fabs(om_mat3_det(v->grid.axis));
    om_mask_done(&mask);
    return status;
}

static OmStatus add_row(OmLabelList* list, const OmLabelRow* row) {
    OmLabelRow* grown =
        om_realloc(list->row, (size_t)list->nrow, (size_t)list->nrow + 1, sizeof *grown);
    if (!grown) return OM_NO_MEMORY;
    list->row = grown;
    grown[list->nrow++] = *row;
    return OM_OK;
}

// Add the rows of one volume of the file; `layer` is -1 if the file has no layers.
static OmStatus list_volume(const OmVolumeInfo* info, int layer, const OmVolume* v,
                            OmLabelList* list) {
    OmLabelScan scan;
    const bool is_unique = are_values_unique(info);
    OM_TRY(om__label_scan(v, &scan));
    OmStatus status = OM_OK;
    list->min = fmin(list->min, scan.min);
    list->max = fmax(list->max, scan.max);
    list->is_intensity = list->is_intensity || scan.is_intensity;
    if (scan.nfraction > 0 && !scan.is_intensity)
        list->between = fmax(list->between, (double)scan.nfraction / (double)scan.nabove);
    list->voxel =
        om_vec3(om_norm(v->grid.axis.cx), om_norm(v->grid.axis.cy), om_norm(v->grid.axis.cz));
    for (int r = 0; r < scan.nrow && !scan.is_intensity && status == OM_OK; r++) {
        OmLabelRow* row = &scan.row[r];
        int s = find_segment(info, layer < 0 ? 0 : layer, row->value);
        row->layer = layer < 0 ? 0 : layer;
        if (s >= 0) memcpy(row->name, info->segment[s].name, sizeof row->name);
        if (s >= 0) row->label = segment_label(info, is_unique, s);
        if (s < 0 && info->has_layers) row->label = -1;
        status = count_parts(v, scan.box[r], row);
        if (status == OM_OK) status = add_row(list, row);
    }
    om__label_scan_done(&scan);
    return status;
}

static OmStatus list_all(const char* path, int volume, const OmVolumeInfo* info,
                         const OmProgress* progress, OmLabelList* list) {
    const bool is_layered = info->has_layers && volume < 0;
    const int nvolume = is_layered ? info->nentry : 1;
    OM_CHECK(nvolume <= LAYER_MAX, OM_INVALID,
             "%s: %d layers; up to %d are listed together: list one with --volume N", path, nvolume,
             LAYER_MAX);
    for (int e = 0; e < nvolume; e++) {
        OmVolume v;
        OM_TRY(om_progress_report(progress, "reading", e, nvolume));
        OM_TRY(is_layered    ? om_volume_load_entry(path, e, &v)
               : volume >= 0 ? om_volume_load_entry(path, volume, &v)
                             : om_volume_load(path, &v));
        OmStatus status =
            list_volume(info, info->has_layers ? (is_layered ? e : volume) : -1, &v, list);
        om_volume_done(&v);
        OM_TRY(status);
    }
    for (int s = 0; s < info->nsegment; s++) {
        bool is_there = false;
        for (int r = 0; r < list->nrow; r++) {
            const OmSegment* g = &info->segment[s];
            is_there = is_there || (list->row[r].value == g->value &&
                                    (!info->has_layers || list->row[r].layer == g->layer));
        }
        list->nempty += !is_there && !list->is_intensity;
    }
    return OM_OK;
}

OmStatus om_label_list_load(const char* path, int volume, const OmProgress* progress,
                            OmLabelList* list) {
    OmVolumeInfo info;
    *list = (OmLabelList){.min = HUGE_VAL, .max = -HUGE_VAL};
    OM_TRY(om_volume_load_info(path, &info));
    memcpy(list->dim, info.dim, sizeof list->dim);
    memcpy(list->note, info.note, sizeof list->note);
    list->nentry = info.nentry;
    list->has_layers = info.has_layers;
    OmStatus status = list_all(path, volume, &info, progress, list);
    om_volume_info_done(&info);
    if (status < 0) om_label_list_done(list);
    return status;
}

void om_label_list_done(OmLabelList* list) {
    if (!list) return;
    om_free(list->row);
    memset(list, 0, sizeof *list);
}

// ---- choosing ---------------------------------------------------------------------------------------------

typedef struct Choice {  // a label to mesh
    int segment;         // index in the file's table, -1: the table has no entry
    int layer;
    double value;  // of the voxels
    int label;     // of the elements
} Choice;

typedef struct Chooser {
    const OmModelDef* def;
    const OmVolumeInfo* info;
    bool is_unique;
    Choice choice[OM_MAX_LABEL];
    int nchoice;
    bool has_large;  // a value above 2^31
} Chooser;

static OmStatus choose_segment(Chooser* c, int s) {
    const OmSegment* g = &c->info->segment[s];
    // with one volume, elements have the values of the file
    int label = c->def->volume >= 0 ? g->value : segment_label(c->info, c->is_unique, s);
    for (int i = 0; i < c->nchoice; i++)
        if (c->choice[i].segment == s) return OM_OK;
    OM_CHECK(c->nchoice < OM_MAX_LABEL, OM_INVALID, "label: at most %d", OM_MAX_LABEL);
    c->choice[c->nchoice++] = (Choice){s, g->layer, g->value, label};
    return OM_OK;
}

// "1 liver, 2 vein", of at most CHOICE_MAX segments.
static void name_segments(const OmVolumeInfo* info, char* out, size_t size) {
    const bool is_unique = are_values_unique(info);
    size_t len = 0;
    out[0] = 0;
    for (int s = 0; s < info->nsegment && s < CHOICE_MAX && len + 1 < size; s++) {
        len += (size_t)snprintf(out + len, size - len, "%s%d %.40s", s ? ", " : "",
                                segment_label(info, is_unique, s), info->segment[s].name);
    }
    if (info->nsegment > CHOICE_MAX && len + 1 < size)
        snprintf(out + len, size - len, " and %d more", info->nsegment - CHOICE_MAX);
}

static OmStatus choose_number(Chooser* c, int label);

// A whole number that does not fit the numbers of elements: the element gets the smallest number that is free.
static OmStatus choose_large(Chooser* c, double value) {
    const OmModelDef* def = c->def;
    OM_CHECK(value > 0 && value <= STORED_MAX, OM_INVALID,
             "%s: label %.0f: numbers from 0 to 2^53 are read: renumber the labels of the file",
             def->input, value);
    OM_CHECK(
        !c->info->has_layers && !(def->threshold > 0), OM_INVALID,
        "%s: label %.0f is above 2^31, which excludes layers of segments and a threshold: renumber the "
        "labels of the file",
        def->input, value);
    for (int i = 0; i < c->nchoice; i++)
        if (c->choice[i].value == value) return OM_OK;
    OM_CHECK(c->nchoice < OM_MAX_LABEL, OM_INVALID, "label: at most %d", OM_MAX_LABEL);
    int label = 1;
    for (int i = 0; i < c->nchoice; i++) {
        if (c->choice[i].label != label) continue;
        label++;
        i = -1;  // look at all of them again
    }
    const int layer = def->volume > 0 ? def->volume : 0;
    c->choice[c->nchoice++] = (Choice){-1, layer, value, label};
    c->has_large = true;
    return OM_OK;
}

// A name that is a number: numbers above those of OmModelDef.label are given as names.
static bool is_number(const char* name, double* value) {
    const char *p = name, *end = name + strlen(name);
    return om_number_parse(&p, end, value) && p == end && isfinite(*value) &&
           *value == floor(*value);
}

static OmStatus unknown_name(const Chooser* c, const char* name) {
    const OmVolumeInfo* info = c->info;
    OM_CHECK(info->nsegment > 0, OM_INVALID,
             "%s: label \"%s\": the file names no labels; choose by number (--list shows them)",
             c->def->input, name);
    const char** candidate = om_alloc((size_t)info->nsegment, sizeof *candidate);
    if (!candidate) return OM_NO_MEMORY;
    for (int s = 0; s < info->nsegment; s++) candidate[s] = info->segment[s].name;
    const char* near = om_nearest_word(name, candidate, info->nsegment);
    char all[600];
    name_segments(info, all, sizeof all);
    om_error(OM_INVALID, "%s: no label is named \"%s\"%s%s%s; the file names %s", c->def->input,
             name, near ? "; did you mean \"" : "", near ? near : "", near ? "\"?" : "", all);
    om_free(candidate);
    return OM_INVALID;
}

static OmStatus choose_name(Chooser* c, const char* name) {
    const OmVolumeInfo* info = c->info;
    int found = -1;
    for (int s = 0; s < info->nsegment; s++) {
        const OmSegment* g = &info->segment[s];
        if (strcasecmp(g->name, name) != 0 && strcasecmp(g->id, name) != 0) continue;
        OM_CHECK(found < 0, OM_INVALID,
                 "%s: two labels are named \"%s\": choose %d or %d by number", c->def->input, name,
                 segment_label(info, c->is_unique, found), segment_label(info, c->is_unique, s));
        found = s;
    }
    if (found >= 0) return choose_segment(c, found);
    double value;
    if (!is_number(name, &value)) return unknown_name(c, name);
    if (fabs(value) <= INT_MAX) return choose_number(c, (int)value);
    return choose_large(c, value);
}

static OmStatus choose_number(Chooser* c, int label) {
    const OmVolumeInfo* info = c->info;
    if (c->def->volume >= 0 || !info->has_layers) {  // a value of the one volume that is read
        const int layer = c->def->volume > 0 ? c->def->volume : 0;
        for (int i = 0; i < c->nchoice; i++)
            if (c->choice[i].value == label) return OM_OK;
        OM_CHECK(c->nchoice < OM_MAX_LABEL, OM_INVALID, "label: at most %d", OM_MAX_LABEL);
        int s = find_segment(info, info->has_layers ? layer : 0, label);
        c->choice[c->nchoice++] = (Choice){s, layer, label, label};
        return OM_OK;
    }
    for (int s = 0; s < info->nsegment; s++)
        if (segment_label(info, c->is_unique, s) == label) return choose_segment(c, s);
    char all[600];
    name_segments(info, all, sizeof all);
    return om_error(OM_INVALID, "%s: no segment has the label %d; the file holds %s", c->def->input,
                    label, all);
}

static OmStatus choose(Chooser* c) {
    const OmModelDef* def = c->def;
    const OmVolumeInfo* info = c->info;
    for (int i = 0; i < def->nlabel; i++) OM_TRY(choose_number(c, def->label[i]));
    for (int i = 0; i < def->nlabel_name; i++) OM_TRY(choose_name(c, def->label_name[i]));
    bool is_layered = info->has_layers && def->volume < 0 && !def->has_window;
    if (c->nchoice > 0 || !is_layered) return OM_OK;
    if (def->all_labels || info->nsegment == 1) {
        for (int s = 0; s < info->nsegment; s++) OM_TRY(choose_segment(c, s));
        return OM_OK;
    }
    char all[600];
    name_segments(info, all, sizeof all);
    return om_error(
        OM_INVALID,
        "%s holds %d segments, %s: choose with --label NAME or N (several: their union; "
        "--label all: every one)",
        def->input, info->nsegment, all);
}

// The chosen labels in words: "liver (label 5), label 9".
static void describe(const Chooser* c, OmModelReport* report) {
    size_t len = 0, size = sizeof report->selected;
    for (int i = 0; i < c->nchoice && len + 1 < size; i++) {
        const Choice* k = &c->choice[i];
        const char* name = k->segment >= 0 ? c->info->segment[k->segment].name : "";
        len += (size_t)snprintf(report->selected + len, size - len,
                                name[0] ? "%s%s (label %d)" : "%s%slabel %d", i ? ", " : "", name,
                                k->label);
    }
}

// ---- loading ----------------------------------------------------------------------------------------------

// Convert indices of the choice to labels, in place if every label fits in one byte.
static OmStatus take_labels(const Chooser* c, unsigned char* place, OmVolume* v) {
    const size_t n = om_volume_count(v);
    int max = 0;
    for (int i = 0; i < c->nchoice; i++) max = c->choice[i].label > max ? c->choice[i].label : max;
    om_free(v->voxel);
    v->voxel = place;
    v->type = OM_VOXEL_U8;
    v->slope = 1;
    v->inter = 0;
    if (max <= 255) {
        for (size_t at = 0; at < n; at++)
            if (place[at]) place[at] = (unsigned char)c->choice[place[at] - 1].label;
        return OM_OK;
    }
    int32_t* label;
    OM_ALLOC(label, n);
    for (size_t at = 0; at < n; at++) label[at] = place[at] ? c->choice[place[at] - 1].label : 0;
    om_free(place);
    v->voxel = label;
    v->type = OM_VOXEL_I32;
    return OM_OK;
}

// The labels of the choice that lie in this layer, as indices of the choice from 1.
static int64_t join_layer(const Chooser* c, int layer, const OmVolume* v, unsigned char* place) {
    const size_t count = om_volume_count(v);
    double value[CHUNK];
    int64_t noverlap = 0;
    for (size_t first = 0; first < count; first += CHUNK) {
        const size_t n = count - first < CHUNK ? count - first : CHUNK;
        unsigned char* to = place + first;
        om_volume_values(v, first, n, value);
        for (int i = 0; i < c->nchoice; i++) {
            if (c->choice[i].layer != layer) continue;
            for (size_t at = 0; at < n; at++) {
                if (om__label_value(value[at]) != c->choice[i].value) continue;
                noverlap += to[at] > 0;
                if (to[at] == 0 || i + 1 < to[at]) to[at] = (unsigned char)(i + 1);
            }
        }
    }
    return noverlap;
}

_Static_assert(OM_MAX_LABEL < 255, "a place in the choice fits in a byte");

// Join the chosen labels of several layers in body->volume.
static OmStatus join_layers(const Chooser* c, OmBody* body, OmModelReport* report) {
    const OmModelDef* def = c->def;
    int64_t noverlap = 0;
    unsigned char* place = NULL;
    OM_CHECK(!(def->threshold > 0), OM_INVALID,
             "%s: threshold: layers of segments have no values between labels", def->input);
    OmStatus status = OM_OK;
    for (int layer = 0; layer < c->info->nentry; layer++) {
        bool is_wanted = false;
        for (int i = 0; i < c->nchoice; i++) is_wanted = is_wanted || c->choice[i].layer == layer;
        if (!is_wanted) continue;
        om_volume_done(&body->volume);
        OM_TRY_DONE(om_volume_load_within(def->input, layer, def->max_volume_size, &body->volume));
        if (!place) OM_CALLOC_DONE(place, om_volume_count(&body->volume));
        noverlap += join_layer(c, layer, &body->volume, place);
    }
    status = take_labels(c, place, &body->volume);
    place = NULL;
    if (status == OM_OK && noverlap > 0) {
        om__model_note(
            report,
            "%lld voxels belong to several of the labels: each counts once, with the label that is "
            "named first",
            (long long)noverlap);
    }
done:
    om_free(place);
    return status;
}

// Replace the voxels by the numbers of the elements.
static OmStatus renumber(const Chooser* c, OmBody* body, OmModelReport* report) {
    OmVolume* v = &body->volume;
    unsigned char* place = om_calloc(om_volume_count(v), 1);
    if (!place) return OM_NO_MEMORY;
    join_layer(c, c->choice[0].layer, v, place);
    bool is_there = false;
    for (size_t n = 0; n < om_volume_count(v) && !is_there; n++) is_there = place[n] > 0;
    if (body->is_volume_borrowed) v->voxel = NULL;
    body->is_volume_borrowed = false;
    OM_TRY(take_labels(c, place, v));
    OM_CHECK(is_there, OM_INVALID, "%s: no voxel has label %.0f%s (--list shows the labels)",
             c->def->input, c->choice[0].value, c->nchoice > 1 ? " or any other of the list" : "");
    for (int i = 0; i < c->nchoice; i++) {
        if (c->choice[i].value <= INT_MAX) continue;
        om__model_note(report,
                       "label %.0f has the number %d in the model, where numbers are below 2^31",
                       c->choice[i].value, c->choice[i].label);
    }
    return OM_OK;
}

// No choice was given: take the label of a volume with only one; otherwise, or for intensities, take none.
static OmStatus choose_only_label(const Chooser* c, OmBody* body, OmModelReport* report) {
    const OmModelDef* def = c->def;
    OmLabelScan scan;
    OM_TRY(om__label_scan(&body->volume, &scan));
    OmStatus status = OM_OK;
    if (scan.is_intensity) {
        status = om_error(OM_INVALID,
                          "%s holds intensities of %g to %g, no labels: choose with --window LO,HI",
                          def->input, scan.min, scan.max);
    } else if (scan.nrow > 1) {
        char all[600];
        size_t len = 0;
        for (int r = 0; r < scan.nrow && r < CHOICE_MAX && len + 1 < sizeof all; r++) {
            int s = find_segment(c->info, c->info->has_layers ? def->volume : 0, scan.row[r].value);
            len += (size_t)snprintf(all + len, sizeof all - len, "%s%.0f%s%.40s", r ? ", " : "",
                                    scan.row[r].stored, s >= 0 ? " " : "",
                                    s >= 0 ? c->info->segment[s].name : "");
        }
        if (scan.nrow > CHOICE_MAX && len + 1 < sizeof all)
            snprintf(all + len, sizeof all - len, " and %d more", scan.nrow - CHOICE_MAX);
        status = om_error(OM_INVALID,
                          "%s holds %d labels, %s: choose with --label N%s (several: their union; "
                          "--label all: every one)",
                          def->input, scan.nrow, all, c->info->nsegment ? " or NAME" : "");
    } else if (scan.nfraction > 0) {
        status = om_error(
            OM_INVALID,
            "%s: %.2g %% of the voxels above 0 have values between whole numbers: choose with "
            "--label %.0f --threshold 0.5 if it was a map of labels that was interpolated, "
            "or with --window LO,HI",
            def->input, 100 * (double)scan.nfraction / (double)scan.nabove,
            scan.nrow ? scan.row[0].stored : 1);
    } else if (scan.nrow == 1 && scan.row[0].value < 0) {
        status = om_error(OM_INVALID, "%s holds one label, %.0f: choose it with --label %.0f",
                          def->input, scan.row[0].stored, scan.row[0].stored);
    } else if (scan.nrow == 0) {
        status = om_error(OM_INVALID,
                          "%s holds no label, every voxel is 0: are its segments filled, and were "
                          "they exported with it?",
                          def->input);
    } else if (scan.nrow == 1) {
        body->label[body->nlabel++] = scan.row[0].value;
        int s = find_segment(c->info, c->info->has_layers ? def->volume : 0, scan.row[0].value);
        const char* name = s >= 0 ? c->info->segment[s].name : "";
        snprintf(report->selected, sizeof report->selected,
                 name[0] ? "%s (label %d)" : "%slabel %d", name, scan.row[0].value);
    }
    om__label_scan_done(&scan);
    return status;
}

// Warn about chosen labels without voxels, if other chosen labels have voxels.
static OmStatus note_missing(const Chooser* c, OmBody* body, OmModelReport* report) {
    OmLabelScan scan;
    if (body->nlabel < 2) return OM_OK;  // if the only one is missing, that is an error
    OM_TRY(om__label_scan(&body->volume, &scan));
    for (int i = 0; i < body->nlabel; i++) {
        bool is_there = body->label[i] <= 0 || scan.is_intensity;
        for (int r = 0; r < scan.nrow; r++)
            is_there = is_there || scan.row[r].value == body->label[i];
        int s = c->choice[i].segment;
        if (is_there) continue;
        om__model_note(report, "label %d%s%s has no voxel", body->label[i], s >= 0 ? " " : "",
                       s >= 0 ? c->info->segment[s].name : "");
    }
    om__label_scan_done(&scan);
    return OM_OK;
}

// Where the header of a volume states no unit or orientation, the definition's are used.
static OmStatus place_volume(const Chooser* c, OmBody* body, OmModelReport* report) {
    const OmModelDef* def = c->def;
    OmVolume* v = &body->volume;
    OM_CHECK(def->space == OM_SPACE_NONE || !c->info->has_space, OM_INVALID,
             "%s: the header says how the voxels lie in the patient: leave out --space",
             def->input);
    if (def->unit > 0) {
        const double stated = c->info->unit > 0 ? c->info->unit : OM_UNIT_MM;
        v->grid.axis = om_mat3_scale(def->unit / stated, v->grid.axis);
        v->grid.origin = om_scale(def->unit / stated, v->grid.origin);
    }
    if (def->unit > 0 && c->info->unit > 0 && def->unit != c->info->unit) {
        om__model_note(report,
                       "the header says that a unit is %g mm, and is read with %g mm, as was told",
                       c->info->unit * 1e3, def->unit * 1e3);
    }
    if (c->info->note[0]) om__model_note(report, "%s", c->info->note);
    if (c->info->has_space) return OM_OK;
    if (def->space == OM_SPACE_LPS) {
        const OmMat3 turn = om_mat3_diag(om_vec3(-1, -1, 1));
        v->grid.axis = om_mat3_mul(turn, v->grid.axis);
        v->grid.origin = om_mat3_apply(turn, v->grid.origin);
    }
    om__model_note(
        report,
        "the header does not say how the voxels lie in the patient: its axes are taken as %s, "
        "so left and right are %s",
        def->space == OM_SPACE_LPS ? "left, posterior, superior (LPS)"
                                   : "right, anterior, superior (RAS)",
        def->space == OM_SPACE_NONE ? "a guess (--space)" : "as was told");
    return OM_OK;
}

static OmStatus load_chosen(Chooser* c, const OmVolume* given, OmBody* body,
                            OmModelReport* report) {
    const OmModelDef* def = c->def;
    OM_TRY(choose(c));
    int layer = def->volume;
    bool is_one_layer = true;
    if (c->info->has_layers && def->volume < 0 && c->nchoice > 0) {
        layer = c->choice[0].layer;
        for (int i = 0; i < c->nchoice; i++)
            is_one_layer = is_one_layer && c->choice[i].layer == layer;
    }
    for (int i = 0; i < c->nchoice; i++) {
        const Choice* k = &c->choice[i];
        OM_CHECK(def->volume < 0 || k->layer == def->volume, OM_INVALID,
                 "%s: label \"%s\" lies in volume %d, not in volume %d", def->input,
                 k->segment >= 0 ? c->info->segment[k->segment].name : "", k->layer, def->volume);
    }
    if (given) {
        body->volume = *given;
        body->is_volume_borrowed = true;
    } else if (!is_one_layer ||
               (c->info->has_layers && !c->is_unique && c->nchoice > 0 && layer != def->volume)) {
        OM_TRY(join_layers(c, body, report));
    } else {
        OM_TRY(om_volume_load_within(def->input, layer >= 0 ? layer : -1, def->max_volume_size,
                                     &body->volume));
    }
    body->unit_stated = given ? OM_UNIT_M : c->info->unit;
    if (!given) OM_TRY(place_volume(c, body, report));
    body->has_window = def->has_window;
    for (int i = 0; i < c->nchoice; i++) {
        const int s = c->choice[i].segment;
        if (s >= 0)
            memcpy(body->label_name[body->nlabel], c->info->segment[s].name, OM_SEGMENT_NAME);
        body->label[body->nlabel++] = c->choice[i].label;
    }
    if (c->has_large) OM_TRY(renumber(c, body, report));
    describe(c, report);
    if (!def->has_window && !c->has_large) OM_TRY(om__body_resolve_between(def, body, report));
    if (def->has_window) {
        snprintf(report->selected, sizeof report->selected, "values from %g to %g", def->window_lo,
                 def->window_hi);
        return OM_OK;
    }
    if (c->nchoice > 0) return note_missing(c, body, report);
    if (def->all_labels) {
        snprintf(report->selected, sizeof report->selected, "every value above 0");
        return OM_OK;
    }
    return choose_only_label(c, body, report);
}

OmStatus om__body_load_labels(const OmModelDef* def, const OmVolume* given, OmBody* body,
                              OmModelReport* report) {
    OmVolumeInfo info = {.nentry = 1};
    Chooser* c = om_calloc(1, sizeof *c);
    if (!c) return OM_NO_MEMORY;
    OmStatus status = given ? OM_OK : om_volume_load_info(def->input, &info);
    if (status == OM_OK) {
        c->def = def;
        c->info = &info;
        c->is_unique = are_values_unique(&info);
        status = load_chosen(c, given, body, report);
    }
    om_volume_info_done(&info);
    om_free(c);
    return status;
}
