// contact_skin.c: contact of the tissue's vertices with smooth surfaces that ride on bodies of the mesh.
//
// An organ is meshed coarsely, and its distance field knows its shape to a fraction of a millimetre. The field rides on
// the mesh (shape_skin.h): a vertex of other tissue is mapped to the organ at rest, where the field has its distance
// and normal. The pair is the vertex and the triangle of the organ's boundary that is nearest, so the organ feels the
// opposite force. As a stiff organ hardly moves, contact on it is that on the rigid organ (contact_vertex.c); facets
// of the mesh are not felt, and the mesh may reach into the tissue.
//
// The active set is found as in contact_vertex.c, and so are first guesses: a vertex that was pushed in the last step,
// one that is inside, or would be if nothing else acted and its surface looks at the organ.
#include <string.h>

#include "contact/contact_internal.h"

#define RELEASE 1e-8     // of the model's size: gap at which an active pair is released
#define ACTIVATE 1e-6    // of the model's size: penetration at which a free pair becomes active
#define SAME_GAP 1e-5    // of the model's size: error of a gap that is taken anew
#define SAME_ANGLE 5e-3  // rad, the same of the normal
#define LATE 10          // times these errors from the fifth solve on
#define REACH \
    0.01  // of the model's size, beyond the ways of a step: vertices farther away are ignored

// ---- memory -------------------------------------------------------------------------------------------

// The triangles of the contact that belong to the bodies of a skin.
static OmStatus copy_surface(const OmContact* c, const OmTetMesh* mesh, OmRide* r) {
    OmStatus status = OM_OK;
    int *local = NULL, ntri = 0, nvert = 0;
    OM_ALLOC_DONE(local, c->nvert);
    for (int i = 0; i < c->nvert; ++i) local[i] = -1;
    for (int n = 0; n < 3 * c->ntri; ++n) {
        int i = c->tri_vert[n];
        if (c->skin_of[c->body[i]] != r->index) continue;
        ntri += n % 3 == 0;
        if (local[i] < 0) local[i] = nvert++;
    }
    OM_CHECK_DONE(ntri > 0, OM_INVALID, "contact: skin[%d]: its body has no surface", r->index);
    OM_TRY_DONE(om_surface_init(&r->rest, nvert, ntri));
    OM_ALLOC_DONE(r->vert, nvert);
    for (int i = 0; i < c->nvert; ++i) {
        if (local[i] < 0) continue;
        r->vert[local[i]] = i;
        om_store3(r->rest.x, local[i], om_load3(mesh->x, i));
    }
    ntri = 0;
    for (int n = 0; n < 3 * c->ntri; ++n)
        if (local[c->tri_vert[n]] >= 0) r->rest.tri_vert[ntri++] = local[c->tri_vert[n]];
    for (int t = 0; t < r->rest.ntri; ++t) {  // in the middle of a triangle it is farthest
        const int* v = r->rest.tri_vert + 3 * (size_t)t;
        OmVec3 a = om_load3(r->rest.x, v[0]), b = om_load3(r->rest.x, v[1]),
               d = om_load3(r->rest.x, v[2]), mean = om_scale(1.0 / 3, om_add(a, om_add(b, d)));
        r->off = fmax(r->off, fabs(om_sdf_eval(r->sdf, a, NULL)));
        r->off = fmax(r->off, fabs(om_sdf_eval(r->sdf, mean, NULL)));
    }
done:
    om_free(local);
    return status;
}

// The bodies of a skin are whole, and no other skin's.
static OmStatus claim_bodies(OmContact* c, const OmContactSkin* skin, int ncorner, int k) {
    for (int i = skin->vert_begin; i < skin->vert_end; ++i) {
        int* of = &c->skin_of[c->body[i]];
        OM_CHECK(*of < 0 || *of == k, OM_INVALID,
                 "contact: skin[%d]: vertex %d belongs to a body of skin[%d]", k, i, *of);
        *of = k;
    }
    for (int i = 0; i < ncorner; ++i)
        OM_CHECK(
            (i >= skin->vert_begin && i < skin->vert_end) || c->skin_of[c->body[i]] != k,
            OM_INVALID,
            "contact: skin[%d]: vertices %d to %d are not a whole piece of the mesh: vertex %d "
            "is of the same piece",
            k, skin->vert_begin, skin->vert_end, i);
    return OM_OK;
}

OmStatus om__skins_create(const OmContactDef* def, const OmTissueModel* m, OmContact* c) {
    if (def->nskin == 0) return OM_OK;
    c->skin = om_calloc((size_t)def->nskin, sizeof *c->skin);
    if (!c->skin) return OM_NO_MEMORY;
    c->nskin = def->nskin;
    for (int k = 0; k < def->nskin; ++k) {
        const OmContactSkin* skin = &def->skin[k];
        OM_CHECK(skin->sdf && skin->vert_begin >= 0 && skin->vert_begin < skin->vert_end &&
                     skin->vert_end <= om_tissue_corner_count(m),
                 OM_INVALID,
                 "contact: skin[%d]: no distance field, or vertices %d to %d of a mesh of %d", k,
                 skin->vert_begin, skin->vert_end, om_tissue_corner_count(m));
        OM_TRY(claim_bodies(c, skin, om_tissue_corner_count(m), k));
        c->skin[k].sdf = skin->sdf;
        c->skin[k].index = k;
    }
    for (int k = 0; k < c->nskin; ++k) OM_TRY(copy_surface(c, om_tissue_mesh(m), &c->skin[k]));
    return OM_OK;
}

void om__skins_destroy(OmContact* c) {
    for (int k = 0; k < c->nskin; ++k) {
        om_surface_done(&c->skin[k].rest);
        om_free(c->skin[k].vert);
    }
    om_free(c->skin);
}

OmStatus om__skins_work_create(const OmContact* c, OmRideWork** work) {
    *work = NULL;
    if (c->nskin == 0) return OM_OK;
    OmStatus status = OM_OK;
    size_t most = 0, npair = 0;
    OmRideWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    for (int k = 0; k < c->nskin; ++k) {
        most = most > (size_t)c->skin[k].rest.nvert ? most : (size_t)c->skin[k].rest.nvert;
        npair += (size_t)c->nsurface;
    }
    OM_ALLOC_DONE(w->x, 3 * (size_t)c->nvert);
    OM_ALLOC_DONE(w->end, 3 * (size_t)c->nvert);
    OM_ALLOC_DONE(w->at, 3 * most);
    OM_ALLOC_DONE(w->fastest, c->nskin);
    OM_ALLOC_DONE(w->displaced, c->nskin);
    OM_ALLOC_DONE(w->pair, npair);
    w->skin = om_calloc((size_t)c->nskin, sizeof(OmSkin*));
    if (!w->skin) {
        status = OM_NO_MEMORY;
        goto done;
    }
    for (int k = 0; k < c->nskin; ++k) OM_TRY_DONE(om_skin_create(&c->skin[k].rest, &w->skin[k]));
    *work = w;
    return OM_OK;
done:
    om__skins_work_destroy(c, w);
    return status;
}

void om__skins_work_destroy(const OmContact* c, OmRideWork* w) {
    if (!w) return;
    for (int k = 0; w->skin && k < c->nskin; ++k) om_skin_destroy(w->skin[k]);
    om_free(w->skin);
    om_free(w->x);
    om_free(w->end);
    om_free(w->at);
    om_free(w->fastest);
    om_free(w->displaced);
    om_free(w->pair);
    om_free(w);
}

// ---- places -------------------------------------------------------------------------------------------

static void move_skins(const OmContact* c, OmRideWork* w, const double* x) {
    for (int k = 0; k < c->nskin; ++k) {
        const OmRide* r = &c->skin[k];
        for (int i = 0; i < r->rest.nvert; ++i) om_store3(w->at, i, om_load3(x, r->vert[i]));
        om_skin_move(w->skin[k], w->at);
    }
}

// The longest way from x to end of a vertex of each boundary, and its farthest displacement from rest.
static void measure_ways(const OmContact* c, OmRideWork* w) {
    for (int k = 0; k < c->nskin; ++k) {
        const OmRide* r = &c->skin[k];
        double far2 = 0, off2 = 0;
        for (int i = 0; i < r->rest.nvert; ++i) {
            OmVec3 x = om_load3(w->x, r->vert[i]);
            far2 = fmax(far2, om_norm2(om_sub(om_load3(w->end, r->vert[i]), x)));
            off2 = fmax(off2, om_norm2(om_sub(x, om_load3(r->rest.x, i))));
        }
        w->displaced[k] = sqrt(off2);
        w->fastest[k] = sqrt(far2);
    }
}

static double way_of(const OmRideWork* w, int i) {
    return om_distance(om_load3(w->end, i), om_load3(w->x, i));
}

typedef struct Near {
    double weight[4], gap;
    int vert[4];
    OmVec3 n;
} Near;

// Vertex i at p against a skin where it is now; false: farther than `far`.
static bool look(const OmContact* c, const OmRideWork* w, int skin, int i, OmVec3 p, double far,
                 Near* near) {
    const OmRide* r = &c->skin[skin];
    OmSkinPlace place;
    if (!om_skin_find(w->skin[skin], p, far + r->off, &place)) return false;
    near->gap = om_skin_eval(&place, r->sdf, c->ring, &near->n);
    near->vert[0] = i;
    near->weight[0] = 1;
    for (int a = 0; a < 3; ++a) {
        near->vert[a + 1] = r->vert[r->rest.tri_vert[3 * (size_t)place.on.tri + (size_t)a]];
        near->weight[a + 1] = -place.on.bary[a];
    }
    return true;
}

// The same of a vertex that is deeper in than it is searched for: a body has moved by no more than its boundary.
static bool look_inside(const OmContact* c, const OmRideWork* w, int skin, int i, OmVec3 p,
                        Near* near) {
    if (om_sdf_eval(c->skin[skin].sdf, p, NULL) > w->displaced[skin]) return false;
    return look(c, w, skin, i, p, INFINITY, near) && near->gap < 0;
}

// Take the place at the end of the last solve for the next one.
static void linearise(const OmRideWork* w, OmSelfPair* p, const Near* near) {
    memcpy(p->vert, near->vert, sizeof p->vert);
    memcpy(p->weight, near->weight, sizeof p->weight);
    p->n = near->n;
    OmVec3 move = om_sub(om__pair_relative(p, w->end), om__pair_relative(p, w->x));
    p->gap = near->gap - om_dot(p->n, move);
}

// ---- stages of a step -----------------------------------------------------------------------------------

void om__skins_find_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                          const OmTissueWork* work, double h) {
    const OmContact* c = cw->contact;
    OmRideWork* w = cw->ride;
    if (!w) return;
    const double *x = om_tissue_x(s), *v = om_tissue_v(s), *force = om_tissue_contact_force(s);
    for (size_t n = 0; n < 3 * (size_t)c->nvert; ++n) {
        w->x[n] = x[n];
        w->end[n] = x[n] + h * v[n];
    }
    w->npair = w->sums.nsolve = w->sums.nactive = 0;
    measure_ways(c, w);
    move_skins(c, w, w->x);
    for (int k = 0; k < c->nskin; ++k)
        for (int n = 0; n < c->nsurface; ++n) {
            int i = c->surface_vert[n];
            if (c->skin_of[c->body[i]] >= 0) continue;
            double far = way_of(w, i) + w->fastest[k] + REACH * c->size;
            Near near;
            OmVec3 at = om_load3(w->x, i);
            if (!look(c, w, k, i, at, far, &near) && !look_inside(c, w, k, i, at, &near)) continue;
            if (near.gap > far) continue;
            OmSelfPair* p = &w->pair[w->npair++];
            *p = (OmSelfPair){.first = -1, .second = k, .apart = near.gap};
            p->vert[0] = i;
            p->goal = fmin(0, near.gap + c->def.recover_speed * h);
            // the last force of a vertex farther away was that of other tissue
            if (near.gap < c->ring) p->push = fmax(0, om_dot(om_load3(force, i), near.n));
            p->is_active = p->push > 0 || near.gap < -ACTIVATE * c->size;
            p->is_dead = !p->is_active && !om__contact_is_facing(cw, x, i, near.n);
        }
    move_skins(c, w, w->end);
    for (int k = 0; k < w->npair; ++k) {
        OmSelfPair* p = &w->pair[k];
        if (p->is_dead) {  // in the first guess alone
            p->is_dead = false;
            continue;
        }
        int i = p->vert[0];
        double far = 2 * (way_of(w, i) + w->fastest[p->second] + REACH * c->size);
        if (p->is_active) far = INFINITY;
        Near near;
        bool is_near = look(c, w, p->second, i, om_load3(w->end, i), far, &near);
        p->is_active = is_near && (p->is_active || near.gap - p->goal < -ACTIVATE * c->size);
        if (!p->is_active) continue;
        linearise(w, p, &near);
        p->k = om__pair_stiffness(m, s, work, p);
        p->is_active = p->k > 0;
        if (!p->is_active) continue;
        ++w->sums.nactive;
        if (c->skin_friction <= 0 || p->push == 0) continue;
        OmVec3 d = om_sub(om__pair_relative(p, w->end), om__pair_relative(p, w->x));
        p->slip = om__pair_tangential(p, d);
        om__pair_begin_friction(p, c->skin_friction, h);
    }
}

// Compare an active pair with the solution; true if it must be solved again.
static bool update_active(const OmContact* c, OmRideWork* w, OmSelfPair* p, double h,
                          bool is_damped) {
    Near near;
    double end = om__pair_gap_at_end(p, w->x, w->end), size = c->size;
    if (end > RELEASE * size ||
        !look(c, w, p->second, p->vert[0], om_load3(w->end, p->vert[0]), INFINITY, &near)) {
        om__pair_release(&w->sums, p);
        return true;
    }
    bool is_changed = om__pair_take_solution(&w->sums, p, c->skin_friction, w->x, w->end, h);
    double allowed = is_damped ? LATE : 1;
    bool is_valid = fabs(near.gap - p->goal - end) <= allowed * SAME_GAP * size &&
                    om_distance(near.n, p->n) <= allowed * SAME_ANGLE;
    if (!is_valid) linearise(w, p, &near);
    w->sums.nslip -= is_changed && !is_valid;  // counted once
    return !is_valid || is_changed;
}

int om__skins_update_pairs(OmContactWork* cw, const OmTissueModel* m, OmTissueState* s,
                           const OmTissueWork* work, double h, bool is_damped) {
    const OmContact* c = cw->contact;
    OmRideWork* w = cw->ride;
    if (!w) return 0;
    const double *v = om_tissue_v(s), *dv = om_tissue_dv(work);
    for (size_t n = 0; n < 3 * (size_t)c->nvert; ++n) w->end[n] = w->x[n] + h * (v[n] + dv[n]);
    measure_ways(c, w);
    move_skins(c, w, w->end);
    int nchange = 0;
    om__pairs_begin_update(&w->sums, w->npair, w->pair, w->x, w->end);
    for (int k = 0; k < w->npair; ++k) {
        OmSelfPair* p = &w->pair[k];
        p->force = om_vec3(0, 0, 0);
        if (p->is_active) {
            nchange += update_active(c, w, p, h, is_damped);
            continue;
        }
        int i = p->vert[0];
        double far = way_of(w, i) + w->fastest[p->second];
        if (p->apart > far) continue;
        Near near;
        if (!look(c, w, p->second, i, om_load3(w->end, i), INFINITY, &near)) continue;
        if (near.gap - p->goal >= -ACTIVATE * c->size) continue;
        linearise(w, p, &near);
        p->k = om__pair_stiffness(m, s, work, p);
        if (p->k == 0) continue;  // all are held: nothing can move
        ++nchange;
        if (!p->is_closed) om__pair_activate(&w->sums, p);
    }
    return om__pairs_count_changes(&w->sums, nchange);
}

OmStatus om__skins_report_pairs(OmContactWork* cw, OmTissueState* s) {
    const OmRideWork* w = cw->ride;
    for (int k = 0; w && k < w->npair; ++k) {
        const OmSelfPair* p = &w->pair[k];
        if (!p->is_active || p->push <= 0) continue;
        Near near = {.gap = 0};
        look(cw->contact, w, p->second, p->vert[0], om_load3(w->end, p->vert[0]), INFINITY, &near);
        OM_TRY(om__pair_report(cw, s, p, 1, w->end, near.gap));
    }
    return OM_OK;
}
