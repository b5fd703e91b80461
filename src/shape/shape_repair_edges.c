// shape_repair_edges.c: edges of one triangle, of three, and of two that disagree.
//
// A fin or an inner wall is a piece whose edges all have an odd number of triangles, one of them at least three:
// without it they are even. The smallest goes first, as a wall across a body is smaller than the sides it divides.
// Of triangles on the same three vertices one stays. Where as many face either way, an inner wall, none stays, unless
// the edges need one: then they have an odd number of others.
// Holes are loops of half edges that lack an opposite one. Up to 48 vertices they get the triangulation of least area
// (Barequet and Sharir 1995), larger ones a fan around their middle.
#include <stdlib.h>
#include <string.h>

#include "shape/shape_file_internal.h"
#include "shape/shape_repair_internal.h"

#define LOOP_EXACT 48  // the triangulation of least area takes the cube of it

// ---- the table of edges -----------------------------------------------------------------------------------

static int compare_halves(const void* a, const void* b) {
    const OmHalf *p = a, *q = b;
    if (p->hi != q->hi) return p->hi < q->hi ? -1 : 1;
    return p->corner < q->corner ? -1 : p->corner > q->corner;
}

OmStatus om__mend_edges_init(const OmMend* m, OmMendEdges* e) {
    OmStatus status = OM_OK;
    int* start = NULL;
    const int nhalf = 3 * m->ntri;
    *e = (OmMendEdges){0};
    OM_CALLOC_DONE(start, (size_t)m->nvert + 1);
    OM_ALLOC_DONE(e->half, nhalf);
    OM_ALLOC_DONE(e->adr, (size_t)nhalf + 1);
    OM_ALLOC_DONE(e->edge, nhalf);
    // by the smaller vertex, then by the larger one
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < nhalf; i++) {
            int a = m->tri[i], b = m->tri[i % 3 == 2 ? i - 2 : i + 1], lo = a < b ? a : b;
            if (pass == 0)
                start[lo + 1]++;
            else
                e->half[start[lo]++] = (OmHalf){lo, a < b ? b : a, i, a < b};
        }
        if (pass == 0)
            for (int v = 0; v < m->nvert; v++) start[v + 1] += start[v];
    }
    for (int begin = 0, end; begin < nhalf; begin = end) {
        for (end = begin + 1; end < nhalf && e->half[end].lo == e->half[begin].lo;) end++;
        qsort(e->half + begin, (size_t)(end - begin), sizeof *e->half, compare_halves);
    }
    for (int i = 0; i < nhalf; i++) {
        const OmHalf* h = &e->half[i];
        if (i == 0 || h->lo != h[-1].lo || h->hi != h[-1].hi) e->adr[e->nedge++] = i;
        e->edge[h->corner] = e->nedge - 1;
    }
    e->adr[e->nedge] = nhalf;
done:
    om_free(start);
    if (status < 0) om__mend_edges_done(e);
    return status;
}

void om__mend_edges_done(OmMendEdges* e) {
    om_free(e->half);
    om_free(e->adr);
    om_free(e->edge);
    *e = (OmMendEdges){0};
}

int om__edge_excess(const OmMendEdges* e, int i) {
    int sum = 0;
    for (int h = e->adr[i]; h < e->adr[i + 1]; h++) sum += e->half[h].is_forward ? 1 : -1;
    return sum;
}

static bool is_clean(const OmMendEdges* e) {
    for (int i = 0; i < e->nedge; i++)
        if (om__edge_count(e, i) != 2 || om__edge_excess(e, i) != 0) return false;
    return true;
}

// ---- vertices and duplicates --------------------------------------------------------------------------------

// Merge the vertices of open edges with others of open edges.
static OmStatus merge_open(OmMend* m, const OmMendEdges* e) {
    OmStatus status = OM_OK;
    unsigned char *use = NULL, *keep = NULL;
    int *rep = NULL, nopen = 0;
    OM_CALLOC_DONE(use, m->nvert);
    OM_ALLOC_DONE(rep, m->nvert);
    OM_ALLOC_DONE(keep, m->ntri);
    for (int i = 0; i < e->nedge; i++) {
        if (om__edge_count(e, i) != 1) continue;
        use[e->half[e->adr[i]].lo] = use[e->half[e->adr[i]].hi] = 1;
        nopen++;
    }
    if (nopen == 0) goto done;
    OM_TRY_DONE(om__points_cluster(m->x, m->nvert, use, m->report->merged_most, rep));
    for (int v = 0; v < m->nvert; v++)
        if (rep[v] != v) om__mend_found(m, OM_DEFECT_UNMERGED, 1, om_load3(m->x, v));
    for (int i = 0; i < 3 * m->ntri; i++) m->tri[i] = rep[m->tri[i]];
    for (int t = 0; t < m->ntri; t++) {  // shorter than the tolerance: they vanish without a trace
        const int* v = m->tri + 3 * (size_t)t;
        keep[t] = v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
    }
    om__mend_keep(m, keep);
done:
    om_free(use);
    om_free(rep);
    om_free(keep);
    return status;
}

typedef struct Same {
    int key[3];  // vertices, ascending
    int tri;
} Same;

static int compare_same(const void* a, const void* b) {
    const Same *p = a, *q = b;
    for (int c = 0; c < 3; c++)
        if (p->key[c] != q->key[c]) return p->key[c] < q->key[c] ? -1 : 1;
    return p->tri < q->tri ? -1 : p->tri > q->tri;
}

static bool runs_like(const int* a, const int* b) {
    for (int k = 0; k < 3; k++)
        if (a[0] == b[k]) return a[1] == b[(k + 1) % 3];
    return false;
}

static OmStatus drop_duplicates(OmMend* m, const OmMendEdges* e) {
    OmStatus status = OM_OK;
    Same* same = NULL;
    unsigned char* keep = NULL;
    OM_ALLOC_DONE(same, m->ntri);
    OM_ALLOC_DONE(keep, m->ntri);
    memset(keep, 1, (size_t)m->ntri);
    for (int t = 0; t < m->ntri; t++) {
        same[t].tri = t;
        memcpy(same[t].key, m->tri + 3 * (size_t)t, sizeof same[t].key);
        om_sort_ints(same[t].key, 3);
    }
    qsort(same, (size_t)m->ntri, sizeof *same, compare_same);
    for (int begin = 0, end; begin < m->ntri; begin = end) {
        for (end = begin + 1;
             end < m->ntri && memcmp(same[begin].key, same[end].key, sizeof same[begin].key) == 0;)
            end++;
        const int num = end - begin, first = same[begin].tri;
        if (num == 1) continue;
        int neven = 0, nother = 0, excess = 0;
        for (int c = 0; c < 3; c++) {
            int others = om__edge_count(e, e->edge[3 * first + c]) - num;
            neven += others % 2 == 0;
            nother += others > 0;
        }
        for (int i = begin; i < end; i++)
            excess +=
                runs_like(m->tri + 3 * (size_t)first, m->tri + 3 * (size_t)same[i].tri) ? 1 : -1;
        // two sides of one sheet that stand alone stay: they enclose nothing
        if (num == 2 && excess == 0 && nother == 0) continue;
        const bool none = excess == 0 && neven == 3 && nother > 0;
        int stays = -1;  // one that runs as most do
        for (int i = begin; i < end && !none && stays < 0; i++) {
            bool is_like = runs_like(m->tri + 3 * (size_t)first, m->tri + 3 * (size_t)same[i].tri);
            if (is_like == (excess >= 0)) stays = i;
        }
        for (int i = begin; i < end; i++) {
            if (i == stays) continue;
            keep[same[i].tri] = 0;
            m->nmended++;
            om__mend_found(m, OM_DEFECT_DUPLICATE, 1, om__mend_center(m, same[i].tri));
        }
    }
    om__mend_keep(m, keep);
done:
    om_free(same);
    om_free(keep);
    return status;
}

// ---- winding ------------------------------------------------------------------------------------------------

OmStatus om__mend_pieces(const OmMend* m, const OmMendEdges* e, int* piece, unsigned char* flip,
                         int* npiece) {
    int* queue;
    *npiece = 0;
    OM_ALLOC(queue, m->ntri);
    for (int t = 0; t < m->ntri; t++) piece[t] = -1;
    for (int seed = 0; seed < m->ntri; seed++) {
        if (piece[seed] >= 0) continue;
        int begin = 0, end = 0;
        piece[seed] = *npiece;
        if (flip) flip[seed] = 0;
        queue[end++] = seed;
        while (begin < end) {
            const int t = queue[begin++];
            for (int c = 0; c < 3; c++) {
                const int i = e->edge[3 * t + c];
                if (om__edge_count(e, i) != 2) continue;
                const OmHalf* h = &e->half[e->adr[i]];
                const OmHalf *mine = h[0].corner / 3 == t ? &h[0] : &h[1],
                             *other = mine == h ? &h[1] : &h[0];
                const int next = other->corner / 3;
                if (piece[next] >= 0) continue;
                piece[next] = *npiece;
                if (flip)
                    flip[next] = (unsigned char)((mine->is_forward == other->is_forward) ^ flip[t]);
                queue[end++] = next;
            }
        }
        ++*npiece;
    }
    om_free(queue);
    return OM_OK;
}

// Turn the smaller share of each piece, so that neighbours agree.
static OmStatus agree(OmMend* m, const OmMendEdges* e) {
    OmStatus status = OM_OK;
    int *piece = NULL, *balance = NULL, npiece;
    unsigned char* flip = NULL;
    OM_ALLOC_DONE(piece, m->ntri);
    OM_ALLOC_DONE(flip, m->ntri);
    OM_TRY_DONE(om__mend_pieces(m, e, piece, flip, &npiece));
    OM_CALLOC_DONE(balance, npiece);
    for (int t = 0; t < m->ntri; t++) balance[piece[t]] += flip[t] ? 1 : -1;
    for (int t = 0; t < m->ntri; t++) {
        if ((flip[t] != 0) == (balance[piece[t]] > 0)) continue;
        om__mend_found(m, OM_DEFECT_WINDING, 1, om__mend_center(m, t));
        om__mend_turn(m, t);
        m->nmended++;
    }
done:
    om_free(piece);
    om_free(flip);
    om_free(balance);
    return status;
}

// ---- fins -----------------------------------------------------------------------------------------------------

typedef struct Rim {  // a half edge of a piece on an edge that has not two triangles
    int piece, edge;
} Rim;

static int compare_rims(const void* a, const void* b) {
    const Rim *p = a, *q = b;
    if (p->piece != q->piece) return p->piece < q->piece ? -1 : 1;
    return p->edge < q->edge ? -1 : p->edge > q->edge;
}

typedef struct Candidate {
    double area;
    int begin, end;  // of the rims
} Candidate;

static int compare_candidates(const void* a, const void* b) {
    const Candidate *p = a, *q = b;
    if (p->area != q->area) return p->area < q->area ? -1 : 1;
    return p->begin < q->begin ? -1 : p->begin > q->begin;
}

// Whether the edges of a piece, some of them of three triangles, are even without it.
static bool is_fin(const Rim* rim, const Candidate* c, const int* count) {
    bool has_three = false;
    for (int i = c->begin, end; i < c->end; i = end) {
        for (end = i + 1; end < c->end && rim[end].edge == rim[i].edge;) end++;
        const int n = count[rim[i].edge];
        if ((n - (end - i)) % 2 != 0) return false;
        has_three = has_three || (n >= 3 && n % 2 == 1);
    }
    return has_three;
}

static double triangle_area(const OmMend* m, int t) {
    const int* v = m->tri + 3 * (size_t)t;
    OmVec3 a = om_load3(m->x, v[0]);
    return 0.5 *
           om_norm(om_cross(om_sub(om_load3(m->x, v[1]), a), om_sub(om_load3(m->x, v[2]), a)));
}

// Drop fins and inner walls; *is_changed tells whether there were any.
static OmStatus drop_fins(OmMend* m, const OmMendEdges* e, bool* is_changed) {
    OmStatus status = OM_OK;
    int *piece = NULL, *count = NULL, npiece, nrim = 0, ncandidate = 0;
    double* area = NULL;
    Rim* rim = NULL;
    Candidate* candidate = NULL;
    unsigned char *keep = NULL, *is_dropped = NULL;
    *is_changed = false;
    for (int i = 0; i < e->nedge; i++)
        if (om__edge_count(e, i) != 2) nrim += om__edge_count(e, i);
    if (nrim == 0) return OM_OK;
    OM_ALLOC_DONE(piece, m->ntri);
    OM_ALLOC_DONE(keep, m->ntri);
    OM_ALLOC_DONE(count, e->nedge);
    OM_ALLOC_DONE(rim, nrim);
    OM_ALLOC_DONE(candidate, nrim);
    OM_TRY_DONE(om__mend_pieces(m, e, piece, NULL, &npiece));
    OM_CALLOC_DONE(area, npiece);
    OM_CALLOC_DONE(is_dropped, npiece);
    for (int t = 0; t < m->ntri; t++) area[piece[t]] += triangle_area(m, t);
    nrim = 0;
    for (int i = 0; i < e->nedge; i++) {
        count[i] = om__edge_count(e, i);
        for (int h = e->adr[i]; count[i] != 2 && h < e->adr[i + 1]; h++)
            rim[nrim++] = (Rim){piece[e->half[h].corner / 3], i};
    }
    qsort(rim, (size_t)nrim, sizeof *rim, compare_rims);
    for (int begin = 0, end; begin < nrim; begin = end) {
        for (end = begin + 1; end < nrim && rim[end].piece == rim[begin].piece;) end++;
        candidate[ncandidate++] = (Candidate){area[rim[begin].piece], begin, end};
    }
    qsort(candidate, (size_t)ncandidate, sizeof *candidate, compare_candidates);
    for (int k = 0; k < ncandidate; k++) {
        const Candidate* c = &candidate[k];
        if (!is_fin(rim, c, count)) continue;
        for (int i = c->begin; i < c->end; i++) count[rim[i].edge]--;
        is_dropped[rim[c->begin].piece] = 1;
        *is_changed = true;
    }
    for (int t = 0; t < m->ntri; t++) {
        keep[t] = !is_dropped[piece[t]];
        if (!keep[t]) om__mend_found(m, OM_DEFECT_FIN, 1, om__mend_center(m, t));
        m->nmended += !keep[t];
    }
    om__mend_keep(m, keep);
done:
    om_free(piece);
    om_free(keep);
    om_free(count);
    om_free(rim);
    om_free(candidate);
    om_free(area);
    om_free(is_dropped);
    return status;
}

// ---- holes --------------------------------------------------------------------------------------------------

static OmStatus add_triangle(OmMend* m, int a, int b, int c) {
    OM_TRY(om__grow(&m->tri, &m->tricap, (int64_t)m->ntri + 1, 3 * sizeof(int)));
    int* v = m->tri + 3 * (size_t)m->ntri++;
    v[0] = a, v[1] = b, v[2] = c;
    m->nmended++;
    return OM_OK;
}

static double area_of(const OmMend* m, int a, int b, int c) {
    OmVec3 p = om_load3(m->x, a);
    return om_norm(om_cross(om_sub(om_load3(m->x, b), p), om_sub(om_load3(m->x, c), p)));
}

static OmStatus add_split(OmMend* m, const int* loop, int split[LOOP_EXACT][LOOP_EXACT], int i,
                          int k) {
    if (k - i < 2) return OM_OK;
    const int j = split[i][k];
    OM_TRY(add_triangle(m, loop[i], loop[j], loop[k]));
    OM_TRY(add_split(m, loop, split, i, j));
    return add_split(m, loop, split, j, k);
}

// The triangulation of least area, over all splits of the polygon i .. k at j.
static OmStatus fill_least(OmMend* m, const int* loop, int n) {
    double best[LOOP_EXACT][LOOP_EXACT];
    int split[LOOP_EXACT][LOOP_EXACT];
    for (int i = 0; i + 1 < n; i++) best[i][i + 1] = 0;
    for (int length = 2; length < n; length++) {
        for (int i = 0; i + length < n; i++) {
            const int k = i + length;
            best[i][k] = HUGE_VAL;
            split[i][k] = i + 1;
            for (int j = i + 1; j < k; j++) {
                double a = best[i][j] + best[j][k] + area_of(m, loop[i], loop[j], loop[k]);
                if (a < best[i][k]) best[i][k] = a, split[i][k] = j;
            }
        }
    }
    return add_split(m, loop, split, 0, n - 1);
}

static OmStatus fill_fan(OmMend* m, const int* loop, int n) {
    OmVec3 sum = om_vec3(0, 0, 0);
    for (int i = 0; i < n; i++) sum = om_add(sum, om_load3(m->x, loop[i]));
    OM_TRY(om__grow(&m->x, &m->vertcap, (int64_t)m->nvert + 1, 3 * sizeof(double)));
    om_store3(m->x, m->nvert++, om_scale(1.0 / n, sum));
    for (int i = 0; i < n; i++) OM_TRY(add_triangle(m, loop[i], loop[(i + 1) % n], m->nvert - 1));
    return OM_OK;
}

typedef struct Holes {
    int nlarge;      // not filled
    double largest;  // m
    OmVec3 largest_place;
    int largest_edges;
} Holes;

static OmStatus fill_loop(OmMend* m, const int* loop, int n, Holes* holes) {
    OmVec3 lo = om_load3(m->x, loop[0]), hi = lo;
    for (int i = 1; i < n; i++) {
        lo = om_min3(lo, om_load3(m->x, loop[i]));
        hi = om_max3(hi, om_load3(m->x, loop[i]));
    }
    const OmVec3 size = om_sub(hi, lo);
    const double across = fmax(size.x, fmax(size.y, size.z));
    if (n < 3) return OM_OK;
    if (m->def->mode != OM_REPAIR_ALL && across > m->def->max_hole * m->diagonal) {
        holes->nlarge++;
        if (across <= holes->largest) return OM_OK;
        holes->largest = across;
        holes->largest_place = om_lerp(lo, hi, 0.5);
        holes->largest_edges = n;
        return OM_OK;
    }
    om__mend_found(m, OM_DEFECT_HOLE, 1, om_lerp(lo, hi, 0.5));
    m->report->hole_largest = fmax(m->report->hole_largest, across);
    return n <= LOOP_EXACT ? fill_least(m, loop, n) : fill_fan(m, loop, n);
}

typedef struct Rims {   // the half edges that are missing, by their first vertex
    int *adr, *to;      // (nvert + 1), (their number)
    int *path, *place;  // the walk, and where a vertex is in it, -1 (nvert)
} Rims;

static OmStatus find_rims(const OmMend* m, const OmMendEdges* e, Rims* r, int* num) {
    OmStatus status = OM_OK;
    *num = 0;
    OM_CALLOC_DONE(r->adr, (size_t)m->nvert + 2);
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < e->nedge; i++) {
            const int excess = om__edge_excess(e, i);
            if (excess != 1 && excess != -1) continue;
            const OmHalf* h = &e->half[e->adr[i]];
            const int from = excess > 0 ? h->hi : h->lo, to = excess > 0 ? h->lo : h->hi;
            if (pass == 0)
                r->adr[from + 2]++, ++*num;
            else
                r->to[r->adr[from + 1]++] = to;
        }
        if (pass == 1) break;
        for (int v = 0; v < m->nvert; v++) r->adr[v + 2] += r->adr[v + 1];
        OM_ALLOC_DONE(r->to, *num + 1);
    }
    OM_ALLOC_DONE(r->path, (size_t)m->nvert + 1);
    OM_ALLOC_DONE(r->place, m->nvert);
done:
    return status;
}

// Walk along missing half edges and fill each loop as it closes.
static OmStatus walk(OmMend* m, Rims* r, int* used, int nvert, Holes* holes) {
    for (int v = 0; v < nvert; v++) r->place[v] = -1;
    for (int start = 0; start < nvert; start++) {
        int n = 0, at = start;
        r->path[n] = start;
        r->place[start] = n++;
        while (used[at] < r->adr[at + 1]) {
            const int next = r->to[used[at]++];
            if (r->place[next] < 0) {
                r->place[next] = n;
                r->path[n++] = next;
            } else {
                const int from = r->place[next];
                OM_TRY(fill_loop(m, r->path + from, n - from, holes));
                for (int i = from + 1; i < n; i++) r->place[r->path[i]] = -1;
                n = from + 1;
            }
            at = next;
        }
        for (int i = 0; i < n; i++) r->place[r->path[i]] = -1;
    }
    return OM_OK;
}

static OmStatus fill_holes(OmMend* m, const OmMendEdges* e) {
    OmStatus status = OM_OK;
    Rims r = {0};
    Holes holes = {0};
    int *used = NULL, num;
    const int nvert = m->nvert;
    OM_TRY_DONE(find_rims(m, e, &r, &num));
    if (num == 0) goto done;
    OM_ALLOC_DONE(used, nvert);
    for (int v = 0; v < nvert; v++) used[v] = r.adr[v];
    OM_TRY_DONE(walk(m, &r, used, nvert, &holes));
    const OmVec3 p = om_scale(1e3, holes.largest_place);
    OM_CHECK_DONE(
        holes.nlarge == 0, OM_INVALID,
        "the surface is open: %d hole%s larger than %.3g mm (%.0f %% of the body), the "
        "largest %.3g mm across, of %d edges, around (%.4g, %.4g, %.4g) mm; close it where "
        "the surface was made, or fill it flat (--repair)",
        holes.nlarge, holes.nlarge == 1 ? "" : "s", 1e3 * m->def->max_hole * m->diagonal,
        100 * m->def->max_hole, 1e3 * holes.largest, holes.largest_edges, p.x, p.y, p.z);
done:
    om_free(r.adr);
    om_free(r.to);
    om_free(r.path);
    om_free(r.place);
    om_free(used);
    return status;
}

// ---- all steps ------------------------------------------------------------------------------------------------

typedef OmStatus StepFn(OmMend* m, const OmMendEdges* e);

static OmStatus run_step(OmMend* m, StepFn* step) {
    OmMendEdges e;
    OM_TRY(om__mend_edges_init(m, &e));
    OmStatus status = step(m, &e);
    om__mend_edges_done(&e);
    return status;
}

OmStatus om__mend_edges(OmMend* m) {
    OmMendEdges e;
    bool is_changed = false;
    OM_TRY(om__mend_edges_init(m, &e));
    const bool is_done = is_clean(&e);
    OmStatus status = is_done ? OM_OK : merge_open(m, &e);
    om__mend_edges_done(&e);
    if (status < 0 || is_done) return status;
    OM_TRY(run_step(m, drop_duplicates));
    if (m->ntri == 0) return OM_OK;
    OM_TRY(run_step(m, agree));
    OM_TRY(om__mend_edges_init(m, &e));
    status = drop_fins(m, &e, &is_changed);
    om__mend_edges_done(&e);
    if (status < 0 || m->ntri == 0) return status;
    if (is_changed) OM_TRY(run_step(m, agree));
    return run_step(m, fill_holes);
}
