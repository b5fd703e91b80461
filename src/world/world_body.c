// world_body.c: soft tissue on its fixed anatomy, used by the twin and by the simulated world.
#include <math.h>
#include <string.h>

#include "omentum/body.h"
#include "omentum/contact_tool.h"
#include "omentum/tissue.h"
#include "world/world_body.h"

enum {
    REST_UNKNOWN,
    REST_KNOWN,
    REST_STALE
};  // stale: attachments have changed since it was measured

typedef struct Rest {  // changes with the state, and is part of a snapshot
    // N, force of the ground before the first grasp, or before the first with the present attachments
    OmVec3 ground;
    int64_t kind;
    // N, weight that the tools carried when attachments changed; of a stale rest
    OmVec3 carried;
} Rest;

struct OmBody {
    const OmBodyModel* model;
    OmTissueState* state;
    OmBodyWork* work;      // the body's own, lent, or null
    OmBodyModel* own;      // the model if the body made it, or null
    OmBodyWork* own_work;  // as above
    Rest rest;
    OmPress* press;           // borrowed, or null
    unsigned char* attached;  // with `bonded` of the model; null without it
    int nworker;              // of `own`
    int nbad;                 // steps that returned OM_NOT_CONVERGED
};

OmStatus om_body_create_shared(const OmBodyModel* model, OmBodyWork* work, OmBody** body) {
    *body = NULL;
    OmBody* b = om_calloc(1, sizeof *b);
    if (!b) return OM_NO_MEMORY;
    b->model = model;
    b->work = work;
    OmStatus status = om_tissue_state_create(model->tissue, &b->state);
    if (status == OM_OK && model->bonded) {
        b->attached = om_alloc((size_t)om_tissue_mesh(model->tissue)->nvert, 1);
        status = b->attached ? OM_OK : OM_NO_MEMORY;
    }
    if (status < 0)
        om_body_destroy(b);
    else
        *body = b;
    return status;
}

OmStatus om_body_create(const OmScene* scene, const OmSite* site, int nworker, OmBody** body) {
    *body = NULL;
    OmBodyModel* model = NULL;
    OmBodyWork* work = NULL;
    OmStatus status = om_body_model_create(scene, site, nworker, &model);
    if (status == OM_OK) status = om_body_work_create(model, &work);
    if (status == OM_OK) status = om_body_create_shared(model, work, body);
    if (status < 0) {
        om_body_work_destroy(work);
        om_body_model_destroy(model);
        return status;
    }
    (*body)->own = model;
    (*body)->own_work = work;
    (*body)->nworker = nworker;
    return status;
}

OmStatus om_body_set_young(OmBody* b, const OmScene* scene, double factor) {
    OM_CHECK(b->own && b->work == b->own_work, OM_INVALID,
             "body: other bodies may share its model, so its modulus is fixed; use om_body_create");
    OM_CHECK(factor > 0 && isfinite(factor), OM_INVALID,
             "body: the factor of Young's modulus is %g; it must be above 0", factor);
    OmBodyModel* model = NULL;
    OmBodyWork* work = NULL;
    OmStatus status = om__body_model_create(scene, b->model->site, b->nworker, factor, &model);
    if (status == OM_OK) status = om_body_work_create(model, &work);
    if (status < 0) {
        om_body_model_destroy(model);
        return status;
    }
    om_body_work_destroy(b->own_work);
    om_body_model_destroy(b->own);
    b->model = b->own = model;
    b->work = b->own_work = work;
    b->press = NULL;
    return OM_OK;
}

void om_body_destroy(OmBody* b) {
    if (!b) return;
    om_tissue_state_destroy(b->state);
    om_free(b->attached);
    om_body_work_destroy(b->own_work);
    om_body_model_destroy(b->own);
    om_free(b);
}

void om_body_set_work(OmBody* b, OmBodyWork* work) { b->work = work; }
void om_body_reset(OmBody* b) {
    om_tissue_state_reset(b->model->tissue, b->state);
    b->rest = (Rest){0};
}

OmStatus om_body_grasp(OmBody* b, int arm, OmPose tip, double radius, int* nheld) {
    const bool is_free = !om_body_is_holding(b, 0) && !om_body_is_holding(b, 1);
    if (b->rest.kind == REST_UNKNOWN || (b->rest.kind == REST_STALE && is_free)) {
        OmTissueForces f;
        OM_TRY(om_tissue_get_forces(b->model->tissue, b->state, &f));
        b->rest = (Rest){.ground = f.contact, .kind = REST_KNOWN};
    }
    return om_tissue_grasp(b->model->tissue, b->state, arm, tip, radius, nheld);
}
OmStatus om_body_move(OmBody* b, int arm, OmPose tip) {
    return om_tissue_move_grasp(b->state, arm, tip);
}
void om_body_release(OmBody* b, int arm) { om_tissue_release(b->state, arm); }

bool om_body_is_holding(const OmBody* b, int arm) { return om_tissue_nheld(b->state, arm) > 0; }

const signed char* om_body_held_by(const OmBody* b) { return om_tissue_held_by(b->state); }

// The attachments of an organ that deforms stay.
static OmStatus set_attachment(OmBody* b, int nvert, const int* vert, const double* anchor,
                               const double* stiffness) {
    const OmSite* site = b->model->site;
    const OmMeshSet* soft = om_tet_mesh_find_set(&site->soft, "attachment");
    if (!soft)
        return om_tissue_set_attachment(b->model->tissue, b->state, nvert, vert, anchor, stiffness);
    const double* rest = om_tissue_mesh(b->model->tissue)->x;
    OM_CHECK(stiffness || site->attach_foundation <= 0, OM_INVALID,
             "body: attachments by area need a stiffness for each vertex");
    OmStatus status = OM_OK;
    int *all = NULL, n = 0;
    double *at = NULL, *spring = NULL;
    OM_CHECK(nvert >= 0 && (nvert == 0 || vert), OM_INVALID,
             "body: %d attachments, or the list is null", nvert);
    OM_ALLOC_DONE(all, nvert + soft->nvert);
    OM_ALLOC_DONE(at, 3 * (size_t)(nvert + soft->nvert));
    OM_ALLOC_DONE(spring, nvert + soft->nvert);
    for (; n < nvert; ++n) {
        OM_CHECK_DONE(vert[n] >= 0 && vert[n] < site->mesh.nvert, OM_INVALID,
                      "body: attachment %d: vertex %d is not one of the tissue's %d", n, vert[n],
                      site->mesh.nvert);
        all[n] = vert[n];
        om_store3(at, n, anchor ? om_load3(anchor, n) : om_load3(rest, vert[n]));
        spring[n] = stiffness ? stiffness[n] : site->attach_stiffness;
    }
    for (int k = 0; k < soft->nvert; ++k, ++n) {
        all[n] = site->mesh.nvert + soft->vert[k];
        om_store3(at, n, om_load3(site->soft.x, soft->vert[k]));
        spring[n] = site->soft_spring[k];
    }
    status = om_tissue_set_attachment(b->model->tissue, b->state, n, all, at, spring);
done:
    om_free(all);
    om_free(at);
    om_free(spring);
    return status;
}

OmStatus om_body_set_attachment(OmBody* b, int nvert, const int* vert, const double* anchor,
                                const double* stiffness) {
    OmTissueForces f;
    if (b->rest.kind == REST_KNOWN) {
        OM_TRY(om_tissue_get_forces(b->model->tissue, b->state, &f));
        b->rest.carried = om_sub(b->rest.ground, f.contact);
    }
    OM_TRY(set_attachment(b, nvert, vert, anchor, stiffness));
    if (b->rest.kind == REST_KNOWN) b->rest.kind = REST_STALE;
    return OM_OK;
}
OmStatus om_body_eval_anchor(const OmBody* b, int nvert, const int* vert, const double* stiffness,
                             double* anchor) {
    return om_tissue_eval_anchor(b->model->tissue, b->state, nvert, vert, stiffness, anchor);
}
const unsigned char* om_body_attached(const OmBody* b) {
    const unsigned char* fixed = om_tissue_attached(b->state);
    if (!b->attached) return fixed;
    memcpy(b->attached, fixed, (size_t)om_tissue_mesh(b->model->tissue)->nvert);
    for (int i = 0; i < b->model->site->mesh.nvert; ++i) b->attached[i] |= b->model->bonded[i];
    return b->attached;
}
const double* om_body_attachment_stiffness(const OmBody* b) {
    return om_tissue_attachment_stiffness(b->state);
}

static OmStatus check_work(const OmBody* b) {
    OM_CHECK(b->work, OM_INVALID, "body: it has no work to step with; see om_body_set_work");
    OM_CHECK(b->work->model == b->model, OM_INVALID,
             "body: its work was made for another model; see om_body_work_create");
    return OM_OK;
}

OmStatus om_body_step(OmBody* b, double dt, OmBodyReport* report) {
    OmContactReport r;
    OM_TRY(check_work(b));
    OmStatus status =
        om_contact_step(b->work->contact, b->model->tissue, b->state, b->work->tissue, dt, &r);
    if (status < 0) return status;
    *report = (OmBodyReport){.iterations = r.tissue.iterations,
                             .residual = r.tissue.residual,
                             .substeps = r.tissue.substeps,
                             .ncontact = r.ncontact,
                             .penetration = fmax(r.penetration, r.self_penetration),
                             .ninverted = r.tissue.ninverted,
                             .energy_gain = r.tissue.energy_gain};
    for (int k = 0; k < r.ntouch; ++k)  // on an organ that deforms
        report->ncontact += r.touch[k].body[0] != r.touch[k].body[1];
    bool is_bad = status > 0 && (r.tissue.ninverted > 0 || !r.is_settled || r.tissue.is_unguarded);
    b->nbad += is_bad;
    return is_bad ? status : OM_OK;
}

OmStatus om_body_set_press(OmBody* b, OmPress* press) {
    OM_CHECK(b->own && b->work == b->own_work, OM_INVALID,
             "body: other bodies may share its work, so it has no probe; use om_body_create");
    OM_CHECK(!press || !om_tissue_moves_itself(b->model->tissue), OM_UNAVAILABLE,
             "body: engine %s has no contact surface for a probe; take fem",
             om_body_engine(b)->name);
    b->press = press;
    om_contact_work_set_presses(b->work->contact, press ? 1 : 0, &b->press);
    return OM_OK;
}

int om_body_nbad(const OmBody* b) { return b->nbad; }

OmStatus om_body_settle(OmBody* b, double dt, double speed, double seconds) {
    OM_TRY(check_work(b));
    return om_contact_settle(b->work->contact, b->model->tissue, b->state, b->work->tissue, dt,
                             speed, seconds);
}

const double* om_body_x(const OmBody* b) { return om_tissue_x(b->state); }
const OmTissueEngine* om_body_engine(const OmBody* b) { return om_tissue_engine(b->model->tissue); }
const OmTissueModel* om_body_tissue(const OmBody* b) { return b->model->tissue; }
const OmBodyModel* om__body_model(const OmBody* b) { return b->model; }
const OmTetMesh* om_body_mesh(const OmBody* b) { return &b->model->shown; }

// Edges of the tissue come before those of the organ: their ends have smaller numbers.
int om_body_node_count(const OmBody* b) {
    const int ncorner = om_tissue_corner_count(b->model->tissue);
    const OmTetMesh* mesh = &b->model->shown;
    int n = b->model->site->mesh.nvert;
    for (size_t k = 0; k < 4 * (size_t)mesh->ntet; ++k)
        if (mesh->tet_vert[k] >= ncorner) {
            int node = mesh->tet_vert[k] - ncorner + b->model->site->mesh.nvert;
            n = node >= n ? node + 1 : n;
        }
    return n + b->model->nmid;
}

// Index of a node in om_body_x, not of a midpoint of shells.
static int vertex_of(const OmBody* b, int node) {
    const int nvert = b->model->site->mesh.nvert;
    return node < nvert ? node : node - nvert + om_tissue_corner_count(b->model->tissue);
}

// The arm that holds a midpoint of shells: all of it, or one end where it is within `radius` of the tip.
static bool is_mid_held(const OmBody* b, int mid, int arm, OmVec3 tip, double radius) {
    const signed char* by = om_body_held_by(b);
    const int* end = b->model->mid_end + 2 * mid;
    const OmVec3 p = om_load3(om_body_x(b), end[0]), q = om_load3(om_body_x(b), end[1]);
    if (!(radius < HUGE_VAL)) return by[end[0]] == arm && by[end[1]] == arm;
    return (by[end[0]] == arm || by[end[1]] == arm) &&
           om_distance(om_scale(0.5, om_add(p, q)), tip) <= radius;
}

static int find_shell_nodes(const OmBody* b, int arm, OmVec3 tip, double radius, int* node) {
    const int nvert = b->model->site->mesh.nvert;
    int n = 0;
    for (int v = 0; v < nvert; ++v)
        if (om_body_held_by(b)[v] == arm && om_distance(om_load3(om_body_x(b), v), tip) <= radius)
            node[n++] = v;
    for (int k = 0; k < b->model->nmid; ++k)
        if (is_mid_held(b, k, arm, tip, radius)) node[n++] = nvert + k;
    return n;
}

int om_body_find_held_nodes(const OmBody* b, int arm, OmVec3 tip, double radius, int* node) {
    int n = 0;
    if (b->model->mid_end) {
        n = find_shell_nodes(b, arm, tip, radius, node);
        return n > 0 ? n : find_shell_nodes(b, arm, tip, HUGE_VAL, node);
    }
    for (int v = 0; v < om_body_node_count(b); ++v)
        if (om_body_held_by(b)[vertex_of(b, v)] == arm) node[n++] = v;
    return n;
}

void om_body_get_nodes(const OmBody* b, double* x) {
    const int n = om_body_node_count(b), nvert = b->model->site->mesh.nvert;
    const double* now = om_body_x(b);
    const int* end = b->model->mid_end;
    memcpy(x, now, 3 * (size_t)nvert * sizeof *x);
    if (!end)
        memcpy(x + 3 * (size_t)nvert, now + 3 * (size_t)vertex_of(b, nvert),
               3 * (size_t)(n - nvert) * sizeof *x);
    for (int k = 0; end && k < b->model->nmid; ++k)
        om_store3(x, nvert + k,
                  om_scale(0.5, om_add(om_load3(x, end[2 * k]), om_load3(x, end[2 * k + 1]))));
}

const OmSite* om_body_site(const OmBody* b) { return b->model->site; }
uint64_t om_body_hash(const OmBody* b) { return om_tissue_state_hash(b->state); }

// Weight that the tools carry. Attachments that hold tissue against the ground press on it by forces that say nothing
// of weight: 10 N on a sheet of 0.7 N. So where attachments have changed since the ground's force was measured, the
// weight carried at that time counts, and the ground is measured again before the next grasp.
static OmVec3 find_carried(const OmBody* b, const OmTissueForces* f) {
    return b->rest.kind == REST_STALE ? b->rest.carried : om_sub(b->rest.ground, f->contact);
}

// Tools carry the weight that the ground no longer carries, two tools half of it each; pull is the grasp without it.
OmStatus om_body_get_forces(OmBody* b, OmBodyForces* forces) {
    OmTissueForces f;
    OM_TRY(om_tissue_get_forces(b->model->tissue, b->state, &f));
    OmVec3 carried = find_carried(b, &f);
    bool is_shared = om_body_is_holding(b, 0) && om_body_is_holding(b, 1);
    for (int a = 0; a < OM_MAX_ARM; ++a) {
        forces->grasp[a] = f.grasp[a];
        forces->pull[a] = om_vec3(0, 0, 0);
        if (om_body_is_holding(b, a))
            forces->pull[a] = om_madd(f.grasp[a], is_shared ? -0.5 : -1.0, carried);
    }
    forces->attachment = f.attachment;
    forces->contact = f.contact;
    forces->weight = f.weight;
    return OM_OK;
}

const double* om_body_contact_force(const OmBody* b) { return om_tissue_contact_force(b->state); }

// Forces of `get` on the vertices of the site; the model may have midpoints and an organ as well.
static OmStatus
get_corner_forces(OmBody* b, OmStatus (*get)(const OmTissueModel*, const OmTissueState*, double*),
                  double* force) {
    const OmTissueModel* m = b->model->tissue;
    const int nvert = om_tissue_mesh(m)->nvert, ncorner = b->model->site->mesh.nvert;
    if (nvert == ncorner) return get(m, b->state, force);
    double* all = om_alloc(3 * (size_t)nvert, sizeof *all);
    if (!all) return OM_NO_MEMORY;
    OmStatus status = get(m, b->state, all);
    if (status >= 0) {
        om_tissue_gather_corners(m, all, all);
        memcpy(force, all, 3 * (size_t)ncorner * sizeof *force);
    }
    om_free(all);
    return status;
}

OmStatus om_body_get_vertex_forces(OmBody* b, double* force) {
    return get_corner_forces(b, om_tissue_get_holding_force, force);
}

OmStatus om_body_get_attachment_force(OmBody* b, double* force) {
    return get_corner_forces(b, om_tissue_get_attachment_force, force);
}

OmStatus om_body_get_measure(const OmBody* b, OmTissueMeasure measure, double* value) {
    const OmTissueModel* m = b->model->tissue;
    const int ntet = b->model->site->mesh.ntet, nsub = b->model->nsub,
              nall = om_tissue_mesh(m)->ntet;
    if (nall == ntet) return om_tissue_get_measure(m, b->state, measure, value);
    // quadratic: the mean of the parts of a tetrahedron, which are of one size
    double* part = om_alloc((size_t)nall, sizeof *part);
    if (!part) return OM_NO_MEMORY;
    OmStatus status = om_tissue_get_measure(m, b->state, measure, part);
    for (int e = 0; status >= 0 && e < ntet; ++e) {
        value[e] = 0;
        for (int k = 0; k < nsub; ++k) value[e] += part[nsub * e + k] / nsub;
    }
    om_free(part);
    return status;
}

size_t om_body_state_size(const OmBody* b) {
    return om_tissue_state_size(b->model->tissue) + sizeof(Rest);
}
void om_body_save(const OmBody* b, void* block) {
    size_t size = om_tissue_state_size(b->model->tissue);
    memcpy(block, b->state, size);
    memcpy((char*)block + size, &b->rest, sizeof b->rest);
}
void om_body_restore(OmBody* b, const void* block) {
    size_t size = om_tissue_state_size(b->model->tissue);
    memcpy(b->state, block, size);
    memcpy(&b->rest, (const char*)block + size, sizeof b->rest);
}
