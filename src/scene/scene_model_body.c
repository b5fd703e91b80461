// scene_model_body.c: from an input file to a cleaned solid and its distance field.
#include <string.h>

#include "scene/scene_model_internal.h"

void om__body_done(OmBody* body) {
    if (!body->is_volume_borrowed) om_volume_done(&body->volume);
    om_mask_done(&body->mask);
    om_tet_mesh_done(&body->mesh);
    om_surface_done(&body->surface);
    om_sdf_done(&body->sdf);
    memset(body, 0, sizeof *body);
}

// ---- unit, space and size ---------------------------------------------------------------------------------

// Unit and space of a mesh or surface file, and the body's size with them.
typedef struct Numbers {
    OmMeshFrame stated, used;
    double length, volume;  // longest side m, m^3
} Numbers;

static double longest_side(const double* x, int nvert) {
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    for (int v = 0; v < nvert; v++) {
        lo = om_min3(lo, om_load3(x, v));
        hi = om_max3(hi, om_load3(x, v));
    }
    OmVec3 size = om_sub(hi, lo);
    return fmax(size.x, fmax(size.y, size.z));
}

// Log assumptions and conversions.
static void note_frame(const OmModelDef* def, const Numbers* n, OmModelReport* report) {
    const bool is_lps = n->used.space == OM_SPACE_LPS;
    const char* name = is_lps ? "LPS" : "RAS";
    if (def->space != OM_SPACE_NONE && n->stated.space != OM_SPACE_NONE &&
        def->space != n->stated.space) {
        om__model_note(report, "the file says that it is %s, and is read as %s, as was told",
                       is_lps ? "RAS" : "LPS", name);
    } else if (n->stated.space == OM_SPACE_NONE && def->space == OM_SPACE_NONE) {
        om__model_note(report,
                       "the file does not say whether it is RAS or LPS: RAS is assumed (--space)");
    } else if (is_lps) {
        om__model_note(report, "positions are turned from LPS, as %s, to RAS: x and y change sign",
                       def->space == OM_SPACE_NONE ? "the file says" : "was told");
    }
    if (n->stated.unit > 0 && def->unit > 0 && n->stated.unit != def->unit) {
        om__model_note(report,
                       "the file says that a unit is %g mm, and is read with %g mm, as was told",
                       n->stated.unit * 1e3, def->unit * 1e3);
    } else if (!(n->stated.unit > 0) && !(def->unit > 0)) {
        om__model_note(report,
                       "the file does not state its unit: millimetres are assumed (--unit)");
    }
}

// In the wrong unit a body is too large or small by a factor of 10 to 1000. The bounds are those of organs,
// with a margin: an adrenal gland has 5 mL and 40 mm, the fat of a trunk 10 litres.
static const double organ_length[2] = {0.010, 0.600}, organ_volume[2] = {1e-7, 2e-2};  // m, m^3

static bool is_plausible(double length, double volume) {
    return length >= organ_length[0] && length <= organ_length[1] && volume >= organ_volume[0] &&
           volume <= organ_volume[1];
}

// The other units in which the body has the size of an organ, as " --unit cm makes it ..."; "" if there is none.
static void list_units(const Numbers* n, char* out, size_t size) {
    static const struct {
        const char* name;
        double unit;
    } table[] = {{"mm", OM_UNIT_MM}, {"cm", OM_UNIT_CM}, {"m", OM_UNIT_M}};
    size_t len = 0;
    out[0] = 0;
    for (int i = 0; i < 3 && len + 1 < size; i++) {
        double f = table[i].unit / n->used.unit, length = f * n->length,
               volume = f * f * f * n->volume;
        if (table[i].unit == n->used.unit || !is_plausible(length, volume)) continue;
        len += (size_t)snprintf(out + len, size - len, "; --unit %s makes it %.4g mm and %.4g mL",
                                table[i].name, length * 1e3, volume * 1e6);
    }
}

// Warn about a size that no organ has; without a stated unit, refuse a size that no body has.
static OmStatus check_size(const OmModelDef* def, const Numbers* n, OmModelReport* report) {
    const bool is_stated = def->unit > 0 || n->stated.unit > 0;
    const bool is_absurd = n->length < 0.001 || n->length > 2;
    char units[160];
    list_units(n, units, sizeof units);
    OM_CHECK(
        is_stated || !is_absurd, OM_INVALID,
        "the body is %.4g mm long if a unit of the file is %g mm, as is assumed: state its unit with "
        "--unit%s",
        n->length * 1e3, n->used.unit * 1e3, units);
    if (is_plausible(n->length, n->volume)) return OM_OK;
    om__model_note(
        report,
        "the body is %.4g mm long and has %.4g mL: an organ has %g to %g mm and %g to %g mL. A "
        "unit of the file is taken as %g mm%s%s",
        n->length * 1e3, n->volume * 1e6, organ_length[0] * 1e3, organ_length[1] * 1e3,
        organ_volume[0] * 1e6, organ_volume[1] * 1e6, n->used.unit * 1e3,
        is_stated ? "" : ", which nothing states", units);
    return OM_OK;
}

// ---- voxels ---------------------------------------------------------------------------------------------

#define MAX_PAD 1000  // layers of voxels around an organ for closing
#define CHUNK 4096    // values checked at a time

static bool is_selected(const OmModelDef* def, const OmBody* body, double v) {
    if (body->has_window) return v >= def->window_lo && v <= def->window_hi;
    v = om__label_value(v);
    if (body->nlabel == 0) return v > 0;
    for (int i = 0; i < body->nlabel; i++) {
        if (v == body->label[i]) return true;
    }
    return false;
}

// The labels of a volume, as " 1 2 3 ...", for the message that a label is missing.
static OmStatus list_labels(const OmVolume* volume, char* out, size_t size) {
    OmLabelScan scan;
    OM_TRY(om__label_scan(volume, &scan));
    size_t len = 0;
    out[0] = 0;
    for (int l = 0; l < scan.nrow && len + 16 < size; l++)
        len += (size_t)snprintf(out + len, size - len, " %.0f", scan.row[l].stored);
    om__label_scan_done(&scan);
    return OM_OK;
}

static OmStatus no_voxels(const OmModelDef* def, const OmBody* body) {
    if (body->has_window) {
        return om_error(OM_INVALID, "%s: no voxel lies between %g and %g", def->input,
                        def->window_lo, def->window_hi);
    }
    char labels[256];
    OM_TRY(list_labels(&body->volume, labels, sizeof labels));
    return om_error(OM_INVALID, "%s: no voxel has label %d%s; the volume holds%s", def->input,
                    body->nlabel ? body->label[0] : 1,
                    body->nlabel > 1 ? " or any other of the list" : "",
                    labels[0] ? labels : " no labels");
}

typedef struct Box {  // voxels lo to hi
    int lo[3], hi[3];
} Box;

typedef void (*VoxelFn)(void* ctx, int i, int j, int k);

static void for_selected(const OmModelDef* def, const OmBody* body, VoxelFn fn, void* ctx) {
    const int* dim = body->volume.grid.dim;
    double value[CHUNK];
    size_t row = 0;
    for (int k = 0; k < dim[2]; k++) {
        for (int j = 0; j < dim[1]; j++, row += (size_t)dim[0]) {
            for (int first = 0; first < dim[0]; first += CHUNK) {
                int n = dim[0] - first < CHUNK ? dim[0] - first : CHUNK;
                om_volume_values(&body->volume, row + (size_t)first, (size_t)n, value);
                for (int i = 0; i < n; i++)
                    if (is_selected(def, body, value[i])) fn(ctx, first + i, j, k);
            }
        }
    }
}

static void grow_box(void* ctx, int i, int j, int k) {
    Box* box = ctx;
    const int at[3] = {i, j, k};
    for (int a = 0; a < 3; a++) {
        if (at[a] < box->lo[a]) box->lo[a] = at[a];
        if (at[a] > box->hi[a]) box->hi[a] = at[a];
    }
}

typedef struct Marking {
    const int* dim;  // of the volume
    OmMask* mask;
    int shift[3];  // index in the volume of the mask's voxel (0, 0, 0)
    int64_t count, ncapped;
} Marking;

static void mark_voxel(void* ctx, int i, int j, int k) {
    Marking* m = ctx;
    const int* shift = m->shift;
    m->mask->inside[om_grid_index(m->mask->grid.dim, i - shift[0], j - shift[1], k - shift[2])] = 1;
    m->count++;
    m->ncapped += i == 0 || j == 0 || k == 0 || i == m->dim[0] - 1 || j == m->dim[1] - 1 ||
                  k == m->dim[2] - 1;
}

// The mask of the selected voxels with `pad` empty layers around its bounding box.
static OmStatus select_voxels(const OmModelDef* def, int pad, OmBody* body, OmModelReport* report) {
    const OmVolume* volume = &body->volume;
    Box box = {{volume->grid.dim[0], volume->grid.dim[1], volume->grid.dim[2]}, {-1, -1, -1}};
    for_selected(def, body, grow_box, &box);
    if (box.hi[0] < 0) return no_voxels(def, body);
    Marking marking = {.dim = volume->grid.dim, .mask = &body->mask};
    int dim[3], *shift = marking.shift;
    for (int a = 0; a < 3; a++) {
        dim[a] = box.hi[a] - box.lo[a] + 1 + 2 * pad;
        shift[a] = box.lo[a] - pad;
    }
    memcpy(body->shift, shift, sizeof body->shift);
    OM_TRY(om_mask_init(&body->mask, dim[0], dim[1], dim[2]));
    OmVec3 corner = om_vec3(shift[0], shift[1], shift[2]);
    body->mask.grid.axis = volume->grid.axis;
    body->mask.grid.origin = om_voxel_grid_point(&volume->grid, corner);
    for_selected(def, body, mark_voxel, &marking);
    report->ncapped = marking.ncapped < 2147483647 ? (int)marking.ncapped : 2147483647;
    report->nvoxel = marking.count;
    report->label_volume = om_mask_volume(&body->mask);
    report->voxel = om_vec3(om_norm(volume->grid.axis.cx), om_norm(volume->grid.axis.cy),
                            om_norm(volume->grid.axis.cz));
    return OM_OK;
}

// Choose the connected parts to keep, and log the removed ones.
static OmStatus keep_parts(const OmModelDef* def, OmMask* m, OmModelReport* report) {
    int64_t size[OM_MAX_PART];
    const double voxel = fabs(om_mat3_det(m->grid.axis)), before = om_mask_volume(m);
    OM_TRY(om_mask_list_parts(m, def->connectivity, size, OM_MAX_PART, &report->npart_mask));
    if (def->npart > 0) {
        OM_TRY(om_mask_choose_parts(m, def->connectivity, def->part, def->npart));
        for (int k = 0; k < def->npart; k++) {
            bool is_new = true;
            for (int e = 0; e < k; e++) is_new = is_new && def->part[e] != def->part[k];
            report->npart_kept += is_new;
        }
    } else {
        OM_TRY(om_mask_keep_parts(m, def->connectivity, def->keep_all ? def->min_share : 0,
                                  &report->npart_kept, NULL));
    }
    const int nshown = report->npart_mask < OM_MAX_PART ? report->npart_mask : OM_MAX_PART;
    for (int i = 0; i < nshown; i++) {
        report->part_volume[i] = voxel * (double)size[i];
        report->part_is_kept[i] =
            i == 0 || (def->keep_all && report->part_volume[i] >= def->min_share * before);
        if (def->npart == 0) continue;
        report->part_is_kept[i] = false;
        for (int k = 0; k < def->npart; k++) report->part_is_kept[i] |= def->part[k] == i + 1;
    }
    report->left_out = before - om_mask_volume(m);
    if (!(report->left_out > 0)) return OM_OK;
    char list[160] = "";
    size_t len = 0;
    int nnamed = 0;
    for (int i = 0; i < nshown && nnamed < 3; i++) {
        if (report->part_is_kept[i]) continue;
        nnamed++;
        len += (size_t)snprintf(list + len, sizeof list - len, "%spart %d of %.4g mL",
                                len ? ", " : "", i + 1, report->part_volume[i] * 1e6);
    }
    const int nleft = report->npart_mask - report->npart_kept;
    if (nleft > nnamed && len < sizeof list)
        snprintf(list + len, sizeof list - len, " and %d smaller", nleft - nnamed);
    om__model_note(report,
                   "%.4g mL (%.2g %%) of the label are left out: it has %d parts, and %d %s kept; "
                   "left out %s %s (--all-parts or --part N keeps them)",
                   report->left_out * 1e6, 100 * report->left_out / report->label_volume,
                   report->npart_mask, report->npart_kept, report->npart_kept == 1 ? "is" : "are",
                   nleft == 1 ? "is" : "are", list);
    return OM_OK;
}

typedef struct Presence {
    const OmBody* body;
    bool is_there[OM_MAX_LABEL];  // a voxel of this label was kept
    bool has_voxel[OM_MAX_LABEL];
} Presence;

static void look_for_label(void* ctx, int i, int j, int k) {
    Presence* p = ctx;
    const OmBody* b = p->body;
    size_t at = om_grid_index(b->volume.grid.dim, i, j, k);
    size_t in_mask =
        om_grid_index(b->mask.grid.dim, i - b->shift[0], j - b->shift[1], k - b->shift[2]);
    const double value = om__label_value(om_volume_value(&b->volume, at));
    for (int l = 0; l < b->nlabel; l++) {
        if (value != b->label[l]) continue;
        p->has_voxel[l] = true;
        p->is_there[l] = p->is_there[l] || b->mask.inside[in_mask];
    }
}

// Warn about selected labels of which no part was kept.
static void note_lost_labels(const OmModelDef* def, const OmBody* body, OmModelReport* report) {
    Presence p = {.body = body};
    if (body->nlabel < 2 || !(report->left_out > 0)) return;
    for_selected(def, body, look_for_label, &p);
    for (int l = 0; l < body->nlabel; l++) {
        if (p.is_there[l] || !p.has_voxel[l]) continue;
        om__model_note(report,
                       "label %d%s%s is left out as a whole: it does not touch the part kept",
                       body->label[l], body->label_name[l][0] ? " " : "", body->label_name[l]);
    }
}

static OmStatus clean_mask(const OmModelDef* def, OmBody* body, OmModelReport* report) {
    OmMask* m = &body->mask;
    body->voxel = cbrt(fabs(om_mat3_det(m->grid.axis)));
    OM_TRY(om_mask_close(m, def->close_radius));
    OM_TRY(keep_parts(def, m, report));
    note_lost_labels(def, body, report);
    const double kept = om_mask_volume(m);
    if (!def->keep_holes) OM_TRY(om_mask_fill_holes(m));
    OM_TRY(om_mask_crop(m, 1));
    body->volume_ref = report->mask_volume = om_mask_volume(m);
    report->filled = report->mask_volume - kept;
    if (report->filled > 0.001 * report->label_volume) {
        om__model_note(
            report, "holes of %.4g mL (%.2g %% of the label) are filled (--keep-holes leaves them)",
            report->filled * 1e6, 100 * report->filled / report->label_volume);
    }
    return OM_OK;
}

// The longest side of a cropped mask, without its empty layer.
static double mask_length(const OmMask* m) {
    const OmMat3* a = &m->grid.axis;
    const double ni = m->grid.dim[0] - 2, nj = m->grid.dim[1] - 2, nk = m->grid.dim[2] - 2;
    double x = ni * fabs(a->cx.x) + nj * fabs(a->cy.x) + nk * fabs(a->cz.x);
    double y = ni * fabs(a->cx.y) + nj * fabs(a->cy.y) + nk * fabs(a->cz.y);
    double z = ni * fabs(a->cx.z) + nj * fabs(a->cy.z) + nk * fabs(a->cz.z);
    return fmax(x, fmax(y, z));
}

static OmStatus load_voxels(const OmModelDef* def, const OmVolume* given, OmBody* body,
                            OmModelReport* report) {
    OM_TRY(om__body_load_labels(def, given, body, report));
    body->has_volume = true;
    const OmVolume* v = &body->volume;
    OmVec3 half =
        om_scale(0.5, om_vec3(v->grid.dim[0] - 1, v->grid.dim[1] - 1, v->grid.dim[2] - 1));
    body->center_image = om_voxel_grid_point(&v->grid, half);
    const double h[3] = {om_norm(v->grid.axis.cx), om_norm(v->grid.axis.cy),
                         om_norm(v->grid.axis.cz)};
    double smallest = fmin(h[0], fmin(h[1], h[2]));
    OM_CHECK(smallest > 0, OM_INVALID, "%s: a voxel has no size", def->input);
    double pad = 1 + ceil(def->close_radius / smallest);
    OM_CHECK(pad <= MAX_PAD, OM_INVALID,
             "%s: closing by %g mm takes %g voxels of %g mm around the organ, at most %d: close by "
             "less",
             def->input, def->close_radius * 1e3, pad, smallest * 1e3, MAX_PAD);
    OM_TRY(select_voxels(def, (int)pad, body, report));
    OM_TRY(clean_mask(def, body, report));
    Numbers n = {.stated = {body->unit_stated, OM_SPACE_RAS}, .volume = report->mask_volume};
    n.used = om_mesh_frame_join((OmMeshFrame){def->unit, OM_SPACE_NONE}, n.stated);
    n.length = mask_length(&body->mask);
    OmStatus status = check_size(def, &n, report);
    return status < 0 ? om_error_prefix(status, "%s", def->input) : OM_OK;
}

// Distance of the level set from the faces between inside and outside voxels, in voxels.
static double face_distance(const OmBody* body) {
    const OmMask* m = &body->mask;
    size_t stride[3];
    om_grid_stride(m->grid.dim, stride);
    double sum = 0;
    int64_t count = 0;
    size_t n = 0;
    for (int k = 0; k < m->grid.dim[2]; k++) {
        for (int j = 0; j < m->grid.dim[1]; j++) {
            for (int i = 0; i < m->grid.dim[0]; i++, n++) {
                const int at[3] = {i, j, k};
                for (int a = 0; a < 3; a++) {
                    if (at[a] + 1 >= m->grid.dim[a] || m->inside[n] == m->inside[n + stride[a]])
                        continue;
                    OmVec3 p = om_vec3(i + (a == 0 ? 0.5 : 0), j + (a == 1 ? 0.5 : 0),
                                       k + (a == 2 ? 0.5 : 0));
                    p = om_voxel_grid_point(&m->grid, p);
                    sum += fabs(om_sdf_eval(&body->sdf, p, NULL));
                    count++;
                }
            }
        }
    }
    return count ? sum / (double)count / body->voxel : 0;
}

// The label of the selected voxel nearest to p, searched within two voxels; `otherwise` if there is none.
static int nearest_label(const OmModelDef* def, const OmBody* body, const OmMat3* inverse, OmVec3 p,
                         int otherwise) {
    const OmVolume* v = &body->volume;
    OmVec3 q = om_mat3_apply(*inverse, om_sub(p, v->grid.origin));
    const double at[3] = {floor(q.x + 0.5), floor(q.y + 0.5), floor(q.z + 0.5)};
    // the voxel that holds p, where it has a label, bounds the distance of those worth a look
    double best = HUGE_VAL, most = HUGE_VAL;
    int label = otherwise;
    for (int k = -1; k < 125; k++) {
        const int n = k < 0 ? 62 : k;
        double c[3] = {at[0] + n % 5 - 2, at[1] + n / 5 % 5 - 2, at[2] + n / 25 - 2};
        bool is_in = c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < v->grid.dim[0] &&
                     c[1] < v->grid.dim[1] && c[2] < v->grid.dim[2];
        if (!is_in) continue;
        double d = om_norm2(om_mat3_apply(v->grid.axis, om_sub(om_vec3(c[0], c[1], c[2]), q)));
        if (d >= best || d > most) continue;
        double value =
            om_volume_value(v, om_grid_index(v->grid.dim, (int)c[0], (int)c[1], (int)c[2]));
        if (!is_selected(def, body, value) || fabs(value) >= 2147483647.0) continue;
        if (k < 0) {
            most = d;
            continue;
        }
        best = d;
        label = (int)om__label_value(value);
    }
    return label;
}

void om__body_label_elements(const OmModelDef* def, const OmBody* body, OmTetMesh* mesh) {
    OmMat3 inverse;
    if (!body->has_volume || def->has_window) return;  // intensities are not labels
    if (om_mat3_inverse(body->volume.grid.axis, &inverse) < 0) return;
    for (int e = 0; e < mesh->ntet; e++) {
        OmVec3 sum = om_vec3(0, 0, 0);
        for (int c = 0; c < 4; c++) {
            sum = om_add(sum, om_load3(mesh->x, mesh->tet_vert[4 * (size_t)e + (size_t)c]));
        }
        mesh->tet_label[e] = nearest_label(def, body, &inverse, om_scale(0.25, sum),
                                           body->nlabel ? body->label[0] : 1);
    }
}

// ---- meshes and surfaces ------------------------------------------------------------------------------------

// The field must resolve elements of the definition's edge length. For a volume mesh, which is not
// remeshed, the field only measures the boundary.
static OmStatus mesh_field(const OmTetMesh* mesh, bool is_measure, OmSdfDef def, OmSdf* sdf) {
    OmMeshQuality quality;
    OmSurface surface;
    OM_TRY(om_tet_mesh_quality(mesh, &quality));
    def.spacing = is_measure ? 0.4 * quality.edge_mean : fmin(def.spacing, 0.4 * quality.edge_mean);
    if (is_measure) def.margin = 3 * def.spacing;
    OM_TRY(om_tet_mesh_boundary(mesh, &surface, NULL));
    OmStatus status = om_sdf_from_surface(&surface, &def, sdf);
    om_surface_done(&surface);
    return status;
}

// What was changed in a volume mesh, or a refusal.
static OmStatus note_reading(const OmModelDef* def, const OmMeshReading* r, OmModelReport* report) {
    const bool is_strict = def->repair == OM_REPAIR_STRICT;
    OM_CHECK(!is_strict || r->nflat == 0, OM_INVALID, "%d tetrahedra are flat", r->nflat);
    if (r->nturned > 0)
        om__model_note(report,
                       "%d tetrahedr%s inside out (vertices 2 to 4 run clockwise seen from the "
                       "first), the first is number %d: turned by exchanging two vertices",
                       r->nturned, r->nturned == 1 ? "on is" : "a are", r->first_turned);
    if (r->nflat > 0)
        om__model_note(report, "%d tetrahedr%s without volume: dropped", r->nflat,
                       r->nflat == 1 ? "on is" : "a are");
    if (r->nmid > 0)
        om__model_note(report,
                       "the tetrahedra have ten nodes: the nodes on their edges are dropped, they "
                       "are up to %.3g mm off the middle of their edge",
                       r->mid_most * 1e3);
    return OM_OK;
}

static OmStatus weld_cracks(const OmModelDef* def, OmTetMesh* mesh, OmModelReport* report) {
    OmTetMeshWeld w;
    OmTetMesh trial;
    if (!def->keep_cracks && def->repair != OM_REPAIR_STRICT) {
        OM_TRY(om_tet_mesh_weld(mesh, 0, &w));
    } else {
        OM_TRY(om_tet_mesh_copy(mesh, &trial));
        OmStatus status = om_tet_mesh_weld(&trial, 0, &w);
        om_tet_mesh_done(&trial);
        OM_TRY(status);
    }
    if (w.nface == 0) return OM_OK;
    const OmVec3 p = om_scale(1e3, w.first);
    OM_CHECK(
        def->keep_cracks || def->repair != OM_REPAIR_STRICT, OM_INVALID,
        "%d pairs of faces lie on each other and have their own vertices: the mesh is cracked, "
        "first at (%.4g, %.4g, %.4g) mm; without --strict they are welded, --keep-cracks "
        "leaves them",
        w.nface, p.x, p.y, p.z);
    if (def->keep_cracks)
        om__model_note(report,
                       "%d pairs of faces lie on each other and stay apart, the first at (%.4g, "
                       "%.4g, %.4g) mm: the mesh is cracked there, as was told",
                       w.nface, p.x, p.y, p.z);
    else
        om__model_note(
            report,
            "%d pairs of faces lay on each other with vertices of their own, the first "
            "at (%.4g, %.4g, %.4g) mm: %d vertices are welded (--keep-cracks leaves them)",
            w.nface, p.x, p.y, p.z, w.nvert);
    return OM_OK;
}

OmStatus om_model_load_mesh(const OmModelDef* def, OmTetMesh* mesh, OmMeshFrame* stated,
                            OmModelReport* report) {
    OmMeshReading reading;
    unsigned flags = OM_MESH_FLIP | OM_MESH_DROP_FLAT | OM_MESH_STRAIGHTEN;
    if (def->repair == OM_REPAIR_STRICT) flags = 0;
    OM_TRY(om_tet_mesh_load_reading(def->input, (OmMeshFrame){def->unit, def->space}, flags, mesh,
                                    &reading));
    *stated = reading.stated;
    OmStatus status = note_reading(def, &reading, report);
    if (status == OM_OK) status = weld_cracks(def, mesh, report);
    if (status < 0) om_tet_mesh_done(mesh);
    return status < 0 ? om_error_prefix(status, "%s", def->input) : OM_OK;
}

static OmStatus use_mesh(const OmModelDef* def, OmMeshFrame stated, const OmSdfDef* sdf_def,
                         OmBody* body, OmModelReport* report) {
    Numbers n = {.stated = stated};
    body->has_mesh = !def->remesh;
    body->volume_ref = n.volume = om_tet_mesh_volume(&body->mesh);
    n.used = om_mesh_frame_join((OmMeshFrame){def->unit, def->space}, n.stated);
    n.length = longest_side(body->mesh.x, body->mesh.nvert);
    note_frame(def, &n, report);
    OM_TRY(check_size(def, &n, report));
    const bool is_measure = body->has_mesh && !(def->sheet.thickness > 0);
    return mesh_field(&body->mesh, is_measure, *sdf_def, &body->sdf);
}

static OmStatus load_mesh(const OmModelDef* def, const OmSdfDef* sdf_def, OmBody* body,
                          OmModelReport* report) {
    OmMeshFrame stated;
    OM_TRY(om_model_load_mesh(def, &body->mesh, &stated, report));
    OmStatus status = use_mesh(def, stated, sdf_def, body, report);
    return status < 0 ? om_error_prefix(status, "%s", def->input) : OM_OK;
}

static OmStatus surface_field(const OmModelDef* def, const OmSurface* surface, const Numbers* n,
                              const OmSdfDef* sdf_def, OmBody* body) {
    body->volume_ref = n->volume;
    OmStatus status = om_sdf_from_surface(surface, sdf_def, &body->sdf);
    if (status != OM_INVALID || is_plausible(n->length, n->volume) || def->unit > 0) return status;
    char why[512], units[160];  // too small for the edge because the unit is wrong
    snprintf(why, sizeof why, "%s", om_error_message());
    list_units(n, units, sizeof units);
    return om_error(OM_INVALID, "%s; the body is %.4g mm long if a unit of the file is %g mm%s",
                    why, n->length * 1e3, n->used.unit * 1e3, units);
}

// Mend a surface and say what was done.
static OmStatus mend_surface(const OmModelDef* def, OmSurface* surface, double* volume,
                             bool* is_folded, OmModelReport* report) {
    OmSurfaceRepair r;
    OmSurfaceRepairDef repair = om_surface_repair_default_def();
    repair.mode = def->repair;
    OM_TRY(om_surface_repair(&repair, surface, &r));
    for (int k = 0; k < OM_NDEFECT; k++) {
        char text[320];
        om_surface_repair_words(&r, (OmDefect)k, text, sizeof text);
        if (text[0]) om__model_note(report, "%s", text);
    }
    *volume = r.volume;
    *is_folded = r.negative > 0 || r.defect[OM_DEFECT_OPEN].count > 0;
    return OM_OK;
}

static OmStatus load_surface(const OmModelDef* def, const OmSdfDef* sdf_def, OmBody* body,
                             OmModelReport* report) {
    OmSurface surface;
    Numbers n = {0};
    const OmMeshFrame given = {def->unit, def->space};
    OM_TRY(om_surface_load_frame(def->input, given, OM_MESH_KEEP_DEGENERATE, &surface, &n.stated));
    n.used = om_mesh_frame_join(given, n.stated);
    n.length = longest_side(surface.x, surface.nvert);
    note_frame(def, &n, report);
    OmStatus status = mend_surface(def, &surface, &n.volume, &body->is_folded, report);
    if (status == OM_OK) status = check_size(def, &n, report);
    if (status == OM_OK) status = surface_field(def, &surface, &n, sdf_def, body);
    body->surface = surface;
    return status < 0 ? om_error_prefix(status, "%s", def->input) : OM_OK;
}

static bool is_one_of(const char* word, const char* const* list) {
    for (; *list; list++) {
        if (strcmp(word, *list) == 0) return true;
    }
    return false;
}

static OmVec3 sdf_centroid(const OmSdf* sdf) {
    OmVec3 sum = om_vec3(0, 0, 0);
    double count = 0;
    size_t n = 0;
    for (int k = 0; k < sdf->grid.dim[2]; k++) {
        for (int j = 0; j < sdf->grid.dim[1]; j++) {
            for (int i = 0; i < sdf->grid.dim[0]; i++, n++) {
                if (sdf->d[n] >= 0) continue;
                sum = om_add(sum, om_vec3(i, j, k));
                count++;
            }
        }
    }
    if (count == 0) return sdf->grid.origin;
    return om_madd(sdf->grid.origin, sdf->grid.spacing / count, sum);
}

OmStatus om__body_load(const OmModelDef* def, double margin, const OmProgress* progress,
                       const OmVolume* given, OmBody* body, OmModelReport* report) {
    static const char* const volume_ext[] = {"nii", "nii.gz", "hdr", "img", "nrrd", "nhdr", NULL};
    static const char* const mesh_ext[] = {"msh", "vtk", "vtu", NULL};
    static const char* const surface_ext[] = {"stl", "obj", "ply", "off", NULL};
    char ext[16];
    memset(body, 0, sizeof *body);
    OM_CHECK(given || om_path_exists(def->input), OM_IO, "%s: no such file", def->input);
    if (!given) OM_TRY(om_volume_refuse_dicom(def->input));
    om_path_extension(def->input, ext, sizeof ext);
    OM_TRY(om_progress_report(progress, "reading", 0, 1));
    OmSdfDef sdf_def = om_sdf_default_def(0.5 * def->edge);
    sdf_def.margin = margin + 2 * sdf_def.spacing;
    if (given || is_one_of(ext, volume_ext)) {
        OM_TRY(load_voxels(def, given, body, report));
        // a grid finer than a third of a voxel holds no more information
        sdf_def.spacing = fmax(sdf_def.spacing, body->voxel / 3);
        sdf_def.smooth = def->smooth;
        OM_TRY(om_progress_report(progress, "distance field", 0, 1));
        OmStatus status = om_sdf_from_mask(&body->mask, &sdf_def, &body->sdf);
        if (status == OM_INVALID && report->npart_mask > 1) {
            return om_error_prefix(status, "%s: the largest of %d parts has %.3g mL", def->input,
                                   report->npart_mask, report->part_volume[0] * 1e6);
        }
        if (status == OM_INVALID) {
            return om_error_prefix(status, "%s: the body is %.3g mm long and an edge %.3g mm",
                                   def->input, mask_length(&body->mask) * 1e3, def->edge * 1e3);
        }
        if (status < 0) return om_error_prefix(status, "%s", def->input);
        report->surface_error_voxel = face_distance(body);
    } else if (is_one_of(ext, mesh_ext)) {
        OM_TRY(load_mesh(def, &sdf_def, body, report));
    } else if (is_one_of(ext, surface_ext)) {
        OM_TRY(load_surface(def, &sdf_def, body, report));
    } else {
        return om_error(
            OM_INVALID,
            "%s: its name ends in none of .nii, .nii.gz, .hdr, .img, .nrrd, .nhdr (volumes), "
            ".msh, .vtk, .vtu (meshes), .stl, .obj, .ply, .off (surfaces)",
            def->input);
    }
    body->centroid = sdf_centroid(&body->sdf);
    if (!body->has_volume) body->center_image = om_vec3(0, 0, 0);
    return OM_OK;
}
