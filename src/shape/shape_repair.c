// shape_repair.c: closing the surfaces of files, and what is said about it.
//
//   merge -> drop -> duplicates -> winding -> fins -> winding -> holes   (shape_repair_edges.c)
//   -> parts inside out, nested -> open edges                            (shape_repair_parts.c)
//   -> crossings -> volume -> verdict
//
// Each step makes the surface more of a cycle: as many half edges forward as back at every edge. A cycle has integer
// winding numbers everywhere, whatever crosses or lies in whatever, and so it bounds a solid.
#include "omentum/shape_repair.h"

#include <string.h>

#include "shape/shape_repair_internal.h"
#include "shape/shape_winding.h"

enum { REPAIR_COOKIE = 0x3e9a1 };
#define NRAY 251  // rays along each side for volumes of solids that overlap themselves

OmSurfaceRepairDef om_surface_repair_default_def(void) {
    return (OmSurfaceRepairDef){
        .cookie = REPAIR_COOKIE, .merge = 1e-5, .max_hole = 0.1, .max_share = 0.1};
}

static OmStatus check_def(const OmSurfaceRepairDef* def) {
    OM_CHECK(def->cookie == REPAIR_COOKIE, OM_INVALID,
             "OmSurfaceRepairDef was not made by om_surface_repair_default_def");
    OM_CHECK((unsigned)def->mode <= OM_REPAIR_STRICT, OM_INVALID, "repair: mode %d",
             (int)def->mode);
    OM_CHECK(def->merge > 0 && def->merge <= 0.01, OM_INVALID, "repair: merge %g must be 0 to 0.01",
             def->merge);
    OM_CHECK(def->max_hole >= 0 && def->max_hole <= 1, OM_INVALID,
             "repair: max_hole %g must be 0 to 1", def->max_hole);
    OM_CHECK(def->max_share >= 0 && def->max_share <= 1, OM_INVALID,
             "repair: max_share %g must be 0 to 1", def->max_share);
    return OM_OK;
}

// ---- words ----------------------------------------------------------------------------------------------

static const struct {
    const char *one, *many;  // what the surface has
    const char *was, *were;  // and what is done about it
} words[OM_NDEFECT] = {
    [OM_DEFECT_UNMERGED] = {"vertex beside another one on an open edge",
                            "vertices beside others on open edges", "it is merged",
                            "they are merged"},
    [OM_DEFECT_FLAT] = {"triangle that names a vertex twice", "triangles that name a vertex twice",
                        "it is dropped", "they are dropped"},
    [OM_DEFECT_NO_AREA] = {"triangle without area", "triangles without area",
                           "it bounds nothing and stays", "they bound nothing and stay"},
    [OM_DEFECT_DUPLICATE] = {"triangle that occurs again", "triangles that occur again",
                             "it is dropped", "they are dropped"},
    [OM_DEFECT_FIN] = {"triangle of a fin or an inner wall", "triangles of fins or inner walls",
                       "it is dropped", "they are dropped"},
    [OM_DEFECT_WINDING] = {"triangle wound against its neighbours",
                           "triangles wound against their neighbours", "it is turned",
                           "they are turned"},
    [OM_DEFECT_HOLE] = {"hole", "holes", "it is filled", "they are filled"},
    [OM_DEFECT_INSIDE_OUT] = {"part inside out (its triangles face inwards)",
                              "parts inside out (their triangles face inwards)", "it is turned",
                              "they are turned"},
    [OM_DEFECT_NESTED] = {"part within a part that is wound the same way",
                          "parts within parts that are wound the same way",
                          "it counts as filled; a cavity is wound the other way round",
                          "they count as filled; a cavity is wound the other way round"},
    [OM_DEFECT_TOUCHING] = {"edge of four or more triangles", "edges of four or more triangles",
                            "parts touch there and stay", "parts touch there and stay"},
    [OM_DEFECT_CROSSING] = {"pair of triangles that cross", "pairs of triangles that cross",
                            "the body is the union", "the body is the union"},
    [OM_DEFECT_OPEN] = {"edge that is open, or whose triangles disagree on the outside",
                        "edges that are open, or whose triangles disagree on the outside",
                        "inside is where the winding number is above one half",
                        "inside is where the winding number is above one half"},
};

// "3 holes, the first at (1.2, 3.4, 5.6) mm"
static void describe(const OmSurfaceRepair* r, OmDefect kind, char* out, size_t size) {
    const int n = r->defect[kind].count;
    const OmVec3 p = om_scale(1e3, r->defect[kind].first);
    snprintf(out, size, "%d %s, %s(%.4g, %.4g, %.4g) mm", n,
             n == 1 ? words[kind].one : words[kind].many, n == 1 ? "at " : "the first at ", p.x,
             p.y, p.z);
}

void om_surface_repair_words(const OmSurfaceRepair* r, OmDefect kind, char* out, size_t size) {
    if (size > 0) out[0] = 0;
    if (size == 0 || (unsigned)kind >= OM_NDEFECT || r->defect[kind].count == 0) return;
    char what[192], more[96] = "";
    describe(r, kind, what, sizeof what);
    if (kind == OM_DEFECT_HOLE)
        snprintf(more, sizeof more, ", the largest %.3g mm across", r->hole_largest * 1e3);
    if (kind == OM_DEFECT_CROSSING && r->overlap > 0)
        snprintf(more, sizeof more, "; %.4g mL in more than one part count once", r->overlap * 1e6);
    if (kind == OM_DEFECT_CROSSING && r->negative > 1e-3 * r->volume)
        snprintf(more, sizeof more, "; %.4g mL where the surface is folded inside out are left out",
                 r->negative * 1e6);
    snprintf(out, size, "the surface has %s: %s%s", what,
             r->defect[kind].count == 1 ? words[kind].was : words[kind].were, more);
}

void om__mend_found(OmMend* m, OmDefect kind, int count, OmVec3 place) {
    if (count > 0 && m->report->defect[kind].count == 0) m->report->defect[kind].first = place;
    m->report->defect[kind].count += count;
}

// ---- dropping ------------------------------------------------------------------------------------------

OmVec3 om__mend_center(const OmMend* m, int t) {
    const int* v = m->tri + 3 * (size_t)t;
    OmVec3 sum = om_add(om_load3(m->x, v[0]), om_load3(m->x, v[1]));
    return om_scale(1.0 / 3, om_add(sum, om_load3(m->x, v[2])));
}

void om__mend_keep(OmMend* m, const unsigned char* keep) {
    int n = 0;
    for (int t = 0; t < m->ntri; t++)
        if (keep[t]) memmove(m->tri + 3 * (size_t)n++, m->tri + 3 * (size_t)t, 3 * sizeof(int));
    m->ntri = n;
}

// Triangles that name a vertex twice are dropped; those of three vertices on a line stay: their edges may be needed.
static OmStatus drop_flat(OmMend* m) {
    unsigned char* keep;
    OM_ALLOC(keep, m->ntri);
    for (int t = 0; t < m->ntri; t++) {
        const int* v = m->tri + 3 * (size_t)t;
        keep[t] = v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
        if (!keep[t]) om__mend_found(m, OM_DEFECT_FLAT, 1, om__mend_center(m, t));
        m->nmended += !keep[t];
    }
    om__mend_keep(m, keep);
    om_free(keep);
    OM_CHECK(m->ntri > 0, OM_INVALID, "all triangles of the surface name a vertex twice");
    return OM_OK;
}

static void count_no_area(OmMend* m) {
    for (int t = 0; t < m->ntri; t++) {
        const int* v = m->tri + 3 * (size_t)t;
        OmVec3 a = om_load3(m->x, v[0]), b = om_load3(m->x, v[1]), c = om_load3(m->x, v[2]);
        double longest = fmax(om_distance(a, b), fmax(om_distance(b, c), om_distance(c, a)));
        double area = om_norm(om_cross(om_sub(b, a), om_sub(c, a)));
        // positions of an STL have 24 bits: heights below a millionth of the longest edge are rounding
        if (area <= 1e-6 * longest * longest) om__mend_found(m, OM_DEFECT_NO_AREA, 1, a);
    }
}

// ---- the whole -----------------------------------------------------------------------------------------

static OmStatus take_surface(const OmSurface* s, OmMend* m) {
    OmStatus status = OM_OK;
    OM_CHECK(s->ntri > 0, OM_INVALID, "the surface has no triangles");
    for (int i = 0; i < 3 * s->ntri; i++)
        OM_CHECK(s->tri_vert[i] >= 0 && s->tri_vert[i] < s->nvert, OM_INVALID,
                 "triangle %d names vertex %d of a surface of %d", i / 3, s->tri_vert[i], s->nvert);
    OmVec3 lo = om_load3(s->x, s->tri_vert[0]), hi = lo;
    for (int i = 0; i < 3 * s->ntri; i++) {
        OmVec3 p = om_load3(s->x, s->tri_vert[i]);
        OM_CHECK(om_is_finite3(p), OM_INVALID,
                 "vertex %d of the surface has a coordinate that is not finite", s->tri_vert[i]);
        lo = om_min3(lo, p);
        hi = om_max3(hi, p);
    }
    m->diagonal = om_distance(lo, hi);
    // products of nine lengths must neither over- nor underflow
    OM_CHECK(m->diagonal > 1e-9 && om_norm(lo) < 1e9 && om_norm(hi) < 1e9, OM_INVALID,
             "all triangles of the surface are one point, or farther apart than any body");
    m->nvert = m->vertcap = s->nvert;
    m->ntri = m->tricap = s->ntri;
    OM_ALLOC_DONE(m->x, 3 * (size_t)s->nvert);
    OM_ALLOC_DONE(m->tri, 3 * (size_t)s->ntri);
    memcpy(m->x, s->x, 3 * (size_t)s->nvert * sizeof *s->x);
    memcpy(m->tri, s->tri_vert, 3 * (size_t)s->ntri * sizeof *s->tri_vert);
done:
    return status;
}

// Refuse what is not to be mended.
static OmStatus judge(const OmMend* m) {
    const OmSurfaceRepair* r = m->report;
    char what[192];
    for (int k = 0; k < OM_NDEFECT; k++) {
        if (r->defect[k].count == 0) continue;
        describe(r, (OmDefect)k, what, sizeof what);
        OM_CHECK(m->def->mode != OM_REPAIR_STRICT, OM_INVALID,
                 "the surface has %s; without --strict it is mended where the meaning is clear",
                 what);
        OM_CHECK(
            k != OM_DEFECT_OPEN || m->def->mode == OM_REPAIR_ALL, OM_INVALID,
            "the surface does not bound a volume: it has %s; --repair takes the winding number "
            "there",
            what);
    }
    OM_CHECK(
        m->def->mode == OM_REPAIR_ALL || r->share <= m->def->max_share, OM_INVALID,
        "%.0f %% of the triangles of the surface had to be dropped, turned or added, more than "
        "%.0f %%: the file may not be what it seems; --repair mends it nevertheless",
        100 * r->share, 100 * m->def->max_share);
    OM_CHECK(r->volume > 0, OM_INVALID, "the surface encloses nothing: it is flat or open");
    return OM_OK;
}

static OmStatus measure(const OmMend* m) {
    OmSurfaceRepair* r = m->report;
    OmSolidMeasure solid;
    const OmSurface s = {m->nvert, m->ntri, m->x, m->tri};
    r->volume = om_surface_volume(&s);
    // parts may overlap without crossing edges, where faces lie on each other
    if (r->npart == 1 && r->defect[OM_DEFECT_CROSSING].count == 0 &&
        r->defect[OM_DEFECT_OPEN].count == 0)
        return OM_OK;
    OM_TRY(om__surface_measure(&s, NRAY, &solid));
    r->overlap = solid.overlap;
    r->negative = solid.negative;
    // the sum over the triangles has each place as often as its winding number says, without the error of the rays
    if (r->defect[OM_DEFECT_OPEN].count == 0)
        r->volume += solid.negative - solid.overlap;
    else
        r->volume = solid.volume;
    return OM_OK;
}

static OmStatus mend(OmMend* m) {
    OM_TRY(drop_flat(m));
    OM_TRY(om__mend_edges(m));
    OM_CHECK(m->ntri > 0, OM_INVALID, "nothing is left of the surface");
    OM_TRY(om__mend_parts(m));
    count_no_area(m);
    OM_TRY(om__mend_crossings(m));
    return measure(m);
}

// Copy without the vertices that no triangle uses.
static OmStatus give_surface(const OmMend* m, OmSurface* out) {
    OmStatus status = OM_OK;
    int *map = NULL, n = 0;
    OM_ALLOC_DONE(map, m->nvert);
    for (int i = 0; i < m->nvert; i++) map[i] = -1;
    for (int i = 0; i < 3 * m->ntri; i++) map[m->tri[i]] = 0;
    for (int i = 0; i < m->nvert; i++)
        if (map[i] == 0) map[i] = n++;
    OM_TRY_DONE(om_surface_init(out, n, m->ntri));
    for (int i = 0; i < m->nvert; i++)
        if (map[i] >= 0) om_store3(out->x, map[i], om_load3(m->x, i));
    for (int i = 0; i < 3 * m->ntri; i++) out->tri_vert[i] = map[m->tri[i]];
done:
    om_free(map);
    return status;
}

OmStatus om_surface_repair(const OmSurfaceRepairDef* def, OmSurface* surface,
                           OmSurfaceRepair* report) {
    OmStatus status = OM_OK;
    OmSurfaceRepair local;
    OmSurface out = {0};
    if (!report) report = &local;
    *report = (OmSurfaceRepair){0};
    OmMend m = {.def = def, .report = report};
    OM_TRY(check_def(def));
    OM_TRY_DONE(take_surface(surface, &m));
    report->merged_most = def->merge * m.diagonal;
    OM_TRY_DONE(mend(&m));
    report->share = (double)m.nmended / surface->ntri;
    OM_TRY_DONE(judge(&m));
    OM_TRY_DONE(give_surface(&m, &out));
    om_surface_done(surface);
    *surface = out;
done:
    om_free(m.x);
    om_free(m.tri);
    return status;
}
