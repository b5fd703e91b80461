// heuristic_chain.c: ChainMail on the edges of a mesh, with relaxation.
//
// Gibson (1997) lets an element move relative to each neighbour within a box: closer by `compress` or farther by
// `stretch` along the link, sideways by `shear`, as fractions of the link's length at rest; axes are those of
// space. Li and Brodlie (2003) extend this to the edges of any mesh. Here, with e the edge at rest, the difference
// of the displacements of its ends is limited along each axis: outwards to stretch |e_c| + shear (|e_a| + |e_b|),
// inwards to compress |e_c| + the same. Every uniform deformation with stretches from 1 - compress to 1 + stretch
// and shears up to `shear` is allowed, and these are the smallest limits that allow it.
//
// Along one axis these limits are bounds u_j - u_i <= up_ij, so they act as distances: with vertex i at u_i, u_j is
// at most u_i + d(i, j), d the shortest path over `up`. The classic propagation from the moved vertex (the vertex
// furthest outside its box first: Schill et al. 1998) is therefore Dijkstra's algorithm from the moved vertices,
// once for the upper and once for the lower bound of each vertex, which is then clamped to this interval.
// Constraints of this kind are closed under minimum and maximum: if all links are within their limits before, they
// are afterwards, exactly, on any mesh. Where two moved vertices are further apart than the links between them
// allow, vertices go to the middle of their bounds. A shape that violates its links (set from outside, or after
// such a conflict) is first replaced by the mean of the largest and the smallest admissible shape that coincide
// with it where possible (McShane's extensions), from all vertices at once.
// Relaxation moves vertices one by one towards the mean displacement of their neighbours, as far as their links
// allow: the energy sum |u_i - u_j|^2 falls, and links stay within their limits.
#include <string.h>

#include "omentum/heuristic.h"
#include "tissue/tissue_internal.h"

#define CHAIN_COOKIE 0xc4a10001u
#define NROUND 8    // rounds of moving vertices out of obstacles
#define DEEP 0.7    // vertices deeper than this fraction of the deepest are moved in the same round
#define KEPT 1e-12  // fraction of the model's size: rounding, not a violated link

typedef struct Link {  // stored with the vertex at one end
    int vert;          // its other end
    double
        // m, by which the other end's displacement may be above [0], below [1] this one's
        max[2][3];
} Link;

typedef struct Chain {  // model->data
    OmChainDef def;
    int* adr;    // first link of each vertex                                            (nvert + 1)
    Link* link;  // both ends of each                                                      (2 edges)
} Chain;

typedef struct ChainWork {  // work->data
    double* u;              // displacements from rest, m                               (nvert x 3)
    double* goal;           // of vertices with a prescribed position
    // upper bound of the displacement along one axis, and the negated lower bound   (nvert)
    double* bound[2];
    unsigned char* is_moved;  // by a tool, an attachment or an obstacle                     (nvert)
    // of Dijkstra's algorithm: vertices, and their positions in the queue  (nvert)
    int *queue, *place;
} ChainWork;

// ---- model --------------------------------------------------------------------------------------------

OmChainDef om_chain_default_def(void) {
    OmChainDef def = {.stretch = 0.1,
                      .compress = 0.1,
                      .shear = 0.1,
                      .relaxation = 1,
                      .sweeps = 10,
                      .cookie = CHAIN_COOKIE};
    return def;
}

static OmStatus check_def(const OmChainDef* def) {
    OM_CHECK(def->cookie == CHAIN_COOKIE, OM_INVALID,
             "chainmail: the definition was not made by om_chain_default_def");
    OM_CHECK(def->stretch >= 0 && def->stretch <= 10, OM_INVALID,
             "chainmail: stretch is %g; it must be from 0 to 10", def->stretch);
    OM_CHECK(def->compress >= 0 && def->compress < 1, OM_INVALID,
             "chainmail: compress is %g; it must be from 0 to below 1", def->compress);
    OM_CHECK(def->shear >= 0 && def->shear <= 10, OM_INVALID,
             "chainmail: shear is %g; it must be from 0 to 10", def->shear);
    OM_CHECK(def->relaxation >= 0 && def->relaxation <= 1, OM_INVALID,
             "chainmail: relaxation is %g; it must be from 0 to 1", def->relaxation);
    OM_CHECK(def->sweeps >= 0 && def->sweeps <= 1000, OM_INVALID,
             "chainmail: sweeps is %d; it must be from 0 to 1000", def->sweeps);
    return OM_OK;
}

static Link make_link(const OmTissueModel* m, const OmChainDef* def, int i, int j) {
    Link link = {.vert = j};
    OmVec3 d = om_sub(om_load3(m->mesh.x, j), om_load3(m->mesh.x, i));
    const double e[3] = {d.x, d.y, d.z};
    for (int c = 0; c < 3; ++c) {
        double aside = def->shear * (fabs(e[(c + 1) % 3]) + fabs(e[(c + 2) % 3]));
        double out = def->stretch * fabs(e[c]) + aside, in = def->compress * fabs(e[c]) + aside;
        link.max[0][c] = e[c] >= 0 ? out : in;
        link.max[1][c] = e[c] > 0 ? in : out;
        if (e[c] == 0) link.max[0][c] = link.max[1][c] = aside;
    }
    return link;
}

static void chain_destroy(OmTissueModel* m) {
    Chain* chain = m->data;
    if (!chain) return;
    om_free(chain->adr);
    om_free(chain->link);
    om_free(chain);
    m->data = NULL;
}

static OmStatus chain_create(OmTissueModel* m) {
    OmChainDef def = m->options ? *(const OmChainDef*)m->options : om_chain_default_def();
    OM_TRY(check_def(&def));
    OmBsr A = {0};
    OmStatus status = OM_OK;
    Chain* chain = om_calloc(1, sizeof *chain);
    if (!chain) return OM_NO_MEMORY;
    m->data = chain;  // freed with the model, also after a failure below
    chain->def = def;
    OM_TRY_DONE(om_bsr_create(m->mesh.nvert, m->mesh.ntet, 4, m->mesh.tet_vert, &A));
    OM_ALLOC_DONE(chain->adr, m->mesh.nvert + 1);
    OM_CALLOC_DONE(chain->link, 2 * (size_t)A.nedge);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        // without diagonal blocks, which come first in their rows
        chain->adr[i] = A.row_adr[i] - i;
        for (int k = A.row_adr[i] + 1; k < A.row_adr[i + 1]; ++k)
            chain->link[k - i - 1] = make_link(m, &def, i, A.col[k]);
    }
    chain->adr[m->mesh.nvert] = 2 * A.nedge;
done:
    om_bsr_destroy(&A);
    return status;
}

static void chain_destroy_work(OmTissueWork* w) {
    ChainWork* cw = w->data;
    if (!cw) return;
    om_free(cw->u);
    om_free(cw->goal);
    om_free(cw->bound[0]);
    om_free(cw->bound[1]);
    om_free(cw->is_moved);
    om_free(cw->queue);
    om_free(cw->place);
    om_free(cw);
    w->data = NULL;
}

static OmStatus chain_create_work(const OmTissueModel* m, OmTissueWork* w) {
    ChainWork* cw = om_calloc(1, sizeof *cw);
    if (!cw) return OM_NO_MEMORY;
    w->data = cw;  // freed with the work, also after a failure below
    size_t n = (size_t)m->mesh.nvert;
    cw->u = om_calloc(3 * n, sizeof(double));
    cw->goal = om_calloc(3 * n, sizeof(double));
    cw->bound[0] = om_calloc(n, sizeof(double));
    cw->bound[1] = om_calloc(n, sizeof(double));
    cw->is_moved = om_calloc(n, 1);
    cw->queue = om_calloc(n, sizeof(int));
    cw->place = om_calloc(n, sizeof(int));
    bool is_whole =
        cw->u && cw->goal && cw->bound[0] && cw->bound[1] && cw->is_moved && cw->queue && cw->place;
    return is_whole ? OM_OK : OM_NO_MEMORY;
}

static size_t chain_get_memory(const OmTissueModel* m, const OmTissueWork* w) {
    const Chain* chain = m->data;
    (void)w;
    size_t n = (size_t)m->mesh.nvert;
    return sizeof *chain + (n + 1) * sizeof(int) + (size_t)chain->adr[n] * sizeof(Link) +
           sizeof(ChainWork) + n * (8 * sizeof(double) + 2 * sizeof(int) + 1);
}

// ---- the links ----------------------------------------------------------------------------------------

// The largest violation of a link's limit, at displacements x from `rest`, or from zero if it is null. Each link is
// visited from both ends: an upper bound from one end is a lower bound from the other.
static double excess_of(const OmTissueModel* m, const double* x, const double* rest) {
    const Chain* chain = m->data;
    double worst = 0;
    for (size_t i = 0; i < (size_t)m->mesh.nvert; ++i) {
        for (int k = chain->adr[i]; k < chain->adr[i + 1]; ++k) {
            const Link* link = &chain->link[k];
            size_t j = (size_t)link->vert;
            for (size_t c = 0; c < 3; ++c) {
                double above = x[3 * j + c] - x[3 * i + c];
                if (rest) above -= rest[3 * j + c] - rest[3 * i + c];
                worst = fmax(worst, above - link->max[0][c]);
            }
        }
    }
    return worst;
}

double om_heuristic_eval_excess(const OmTissueModel* m, const double* x) {
    return m->engine == om_chain_engine() ? excess_of(m, x, m->mesh.x) : 0;
}

// ---- Dijkstra's algorithm -----------------------------------------------------------------------------

typedef struct Queue {  // a heap, the smallest key on top
    int num;
    int *vert, *place;  // place: position in the heap, -1 if not in it
    const double* key;
} Queue;

static void set_at(Queue* q, int at, int i) {
    q->vert[at] = i;
    q->place[i] = at;
}

// Insert into the heap, or move up after its key became smaller.
static void put(Queue* q, int i) {
    int at = q->place[i] >= 0 ? q->place[i] : q->num++;
    while (at > 0 && q->key[i] < q->key[q->vert[(at - 1) / 2]]) {
        set_at(q, at, q->vert[(at - 1) / 2]);
        at = (at - 1) / 2;
    }
    set_at(q, at, i);
}

static int take_least(Queue* q) {
    int min = q->vert[0], i = q->vert[--q->num], at = 0;
    q->place[min] = -1;
    for (int child = 1; child < q->num; child = 2 * at + 1) {
        if (child + 1 < q->num && q->key[q->vert[child + 1]] < q->key[q->vert[child]]) ++child;
        if (!(q->key[q->vert[child]] < q->key[i])) break;
        set_at(q, at, q->vert[child]);
        at = child;
    }
    if (q->num > 0) set_at(q, at, i);
    return min;
}

// The bounds that the vertices in `from` (null: all) at `place` set for every vertex along axis c: side 0 the
// upper bounds, side 1 the lower bounds, negated.
static void spread(const Chain* chain, ChainWork* w, int nvert, const unsigned char* from,
                   const double* place, int c, int side) {
    double *bound = w->bound[side], sign = side == 0 ? 1 : -1;
    Queue q = {.vert = w->queue, .place = w->place, .key = bound};
    for (int i = 0; i < nvert; ++i) {
        q.place[i] = -1;
        bound[i] = INFINITY;
    }
    for (int i = 0; i < nvert; ++i) {
        if (from && !from[i]) continue;
        bound[i] = sign * place[3 * (size_t)i + (size_t)c];
        put(&q, i);
    }
    while (q.num > 0) {
        int i = take_least(&q);
        for (int k = chain->adr[i]; k < chain->adr[i + 1]; ++k) {
            double reach = bound[i] + chain->link[k].max[side][c];
            if (!(reach < bound[chain->link[k].vert])) continue;
            bound[chain->link[k].vert] = reach;
            put(&q, chain->link[k].vert);
        }
    }
}

// Move all vertices into their bounds, which follow from the moved vertices.
static void drag(const Chain* chain, ChainWork* w, int nvert) {
    for (int c = 0; c < 3; ++c) {
        spread(chain, w, nvert, w->is_moved, w->goal, c, 0);
        spread(chain, w, nvert, w->is_moved, w->goal, c, 1);
        for (int i = 0; i < nvert; ++i) {
            double high = w->bound[0][i], low = -w->bound[1][i];
            double* u = &w->u[3 * (size_t)i + (size_t)c];
            if (w->is_moved[i])
                *u = w->goal[3 * (size_t)i + (size_t)c];
            else if (low > high)  // the moved vertices are too far apart for the links
                *u = 0.5 * low + 0.5 * high;
            else
                *u = fmin(fmax(*u, low), high);
        }
    }
}

// Move to a similar shape with all links within their limits.
static void mend(const Chain* chain, ChainWork* w, int nvert) {
    for (int c = 0; c < 3; ++c) {
        spread(chain, w, nvert, NULL, w->u, c, 0);  // the largest admissible shape below it
        spread(chain, w, nvert, NULL, w->u, c, 1);  // the smallest admissible shape above it
        for (int i = 0; i < nvert; ++i)
            w->u[3 * (size_t)i + (size_t)c] = 0.5 * w->bound[0][i] - 0.5 * w->bound[1][i];
    }
}

// ---- relaxation ---------------------------------------------------------------------------------------

// give: m, tolerance for limits that contradict each other by rounding. Where moved vertices
// violate links, the excess is distributed.
static void relax_vertex(const Chain* chain, ChainWork* w, int i, double give) {
    int num = chain->adr[i + 1] - chain->adr[i];
    for (int c = 0; c < 3; ++c) {
        double mean = 0, low = -INFINITY, high = INFINITY;
        double* u = &w->u[3 * (size_t)i + (size_t)c];
        for (int k = chain->adr[i]; k < chain->adr[i + 1]; ++k) {
            const Link* link = &chain->link[k];
            double other = w->u[3 * (size_t)link->vert + (size_t)c];
            mean += other;
            high = fmin(high, other + link->max[1][c]);
            low = fmax(low, other - link->max[0][c]);
        }
        mean /= num;  // a vertex has mass, so it has elements and links
        double next = *u + chain->def.relaxation * (mean - *u);
        if (low <= high)
            *u = fmin(fmax(next, low), high);
        else if (low > high + give)
            *u = next;
    }
}

// Sweep forward and backward in turn, so that no end of the body always comes first.
static void relax(const Chain* chain, ChainWork* w, int nvert, double give) {
    for (int n = 0; n < chain->def.sweeps; ++n)
        for (int k = 0; k < nvert; ++k) {
            int i = n % 2 == 0 ? k : nvert - 1 - k;
            if (!w->is_moved[i]) relax_vertex(chain, w, i, give);
        }
}

// ---- the step -----------------------------------------------------------------------------------------

static bool is_held(const OmTissueState* s, int i) {
    return om__state_held_by(s)[i] >= 0 || om__state_attached(s)[i];
}

static OmVec3 held_place(const OmTissueState* s, int i) {
    int arm = om__state_held_by(s)[i];
    if (arm < 0) return om_load3(om__state_array(s, OM__ANCHOR), i);
    return om_pose_apply(s->arm[arm].goal, om_load3(om__state_array(s, OM__GRIP), i));
}

static void find_held(const OmTissueModel* m, const OmTissueState* s, ChainWork* w) {
    for (int i = 0; i < m->mesh.nvert; ++i) {
        w->is_moved[i] = is_held(s, i);
        if (!w->is_moved[i]) continue;
        om_store3(w->goal, i, om_sub(held_place(s, i), om_load3(m->mesh.x, i)));
    }
}

static double depth_of(const OmTissueObstacle* o, OmVec3 p, OmVec3* normal) {
    OmVec3 local = om_pose_apply(om_pose_inverse(o->pose_end), p);
    double gap = o->distance(o->ctx, local, normal) - o->offset;
    *normal = om_quat_rotate(o->pose_end.q, *normal);
    return -gap;
}

// The depth of a free vertex in obstacles, and the nearest position outside them.
static double find_way_out(const OmTissueModel* m, const ChainWork* w, int i, int nobstacle,
                           const OmTissueObstacle* obstacle, OmVec3* out) {
    OmVec3 p = om_add(om_load3(m->mesh.x, i), om_load3(w->u, i)), n;
    double deepest = 0;
    for (int k = 0; k < nobstacle; ++k) {
        double depth = depth_of(&obstacle[k], p, &n);
        if (!(depth > 0)) continue;
        p = om_madd(p, depth, n);
        deepest = fmax(deepest, depth);
    }
    *out = p;
    return deepest;
}

// Move the vertices that are deepest in obstacles outside; they drag the others along, which may suffice for
// these. If not, continue with the next deepest. Then repair violated links.
static void push_out(const OmTissueModel* m, const OmTissueState* s, ChainWork* w, int nobstacle,
                     const OmTissueObstacle* obstacle) {
    const Chain* chain = m->data;
    int nvert = m->mesh.nvert;
    OmVec3 out;
    for (int round = 0; round < NROUND; ++round) {
        double deepest = 0;
        for (int i = 0; i < nvert; ++i)
            if (!w->is_moved[i])
                deepest = fmax(deepest, find_way_out(m, w, i, nobstacle, obstacle, &out));
        if (!(deepest > KEPT * m->size)) break;
        for (int i = 0; i < nvert; ++i) {
            if (w->is_moved[i]) continue;
            double depth = find_way_out(m, w, i, nobstacle, obstacle, &out);
            if (depth < DEEP * deepest) continue;
            w->is_moved[i] = 1;
            om_store3(w->goal, i, om_sub(out, om_load3(m->mesh.x, i)));
        }
        drag(chain, w, nvert);
    }
    if (excess_of(m, w->u, NULL) <= KEPT * m->size) return;
    mend(chain, w, nvert);
    find_held(m, s, w);
    drag(chain, w, nvert);
}

static void write_state(const OmTissueModel* m, OmTissueState* s, const ChainWork* w, double h) {
    double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 p = om_add(om_load3(m->mesh.x, i), om_load3(w->u, i));
        if (is_held(s, i)) p = held_place(s, i);  // exactly, without rounding
        om_store3(v, i, om_scale(1 / h, om_sub(p, om_load3(x, i))));
        om_store3(x, i, p);
    }
    for (int a = 0; a < OM_MAX_ARM; ++a) s->arm[a].pose = s->arm[a].goal;
    s->time += h;
}

static OmStatus chain_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* work, double h,
                           int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    const Chain* chain = m->data;
    ChainWork* w = work->data;
    int nvert = m->mesh.nvert;
    const double* x = om__state_array(s, OM__X);
    for (size_t n = 0; n < 3 * (size_t)nvert; ++n) w->u[n] = x[n] - m->mesh.x[n];
    if (excess_of(m, w->u, NULL) > KEPT * m->size) mend(chain, w, nvert);
    find_held(m, s, w);
    drag(chain, w, nvert);
    relax(chain, w, nvert, KEPT * m->size);
    push_out(m, s, w, nobstacle, obstacle);
    double sum = 0;  // not finite if any entry is not
    for (size_t n = 0; n < 3 * (size_t)nvert; ++n) sum += fabs(w->u[n]) / h;
    OM_CHECK(isfinite(sum), OM_INVALID, "chainmail: the step has no finite outcome");
    write_state(m, s, w, h);
    for (int k = 0; k < nobstacle; ++k) {
        for (int i = 0; i < nvert; ++i) {
            OmVec3 n;
            double depth = depth_of(&obstacle[k], om_load3(x, i), &n);
            obstacle[k].penetration = fmax(obstacle[k].penetration, depth);
            obstacle[k].ncontact += depth > -KEPT * m->size;
        }
    }
    report->substeps = 1;
    return OM_OK;
}

static const OmTissueEngine engine = {
    .version = OM_ENGINE_VERSION,
    .name = "chainmail",
    .summary = "ChainMail, without law or modulus",
    .create = chain_create,
    .destroy = chain_destroy,
    .create_work = chain_create_work,
    .destroy_work = chain_destroy_work,
    .step = chain_step,
    .get_memory = chain_get_memory,
};

const OmTissueEngine* om_chain_engine(void) { return &engine; }
