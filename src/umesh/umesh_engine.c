// umesh_engine.c: the network as an engine: tools and obstacles displace surface nodes, the network gives all vertices.
//
// The input of the network is the displacement of surface nodes of its grid. If a tool grasps the mesh vertex that is
// nearest to a surface node, the node moves with that vertex. A node in contact moves with the obstacle. Contacts are
// part of the state, in the obstacle's frame. A network has no forces that could show a separation, so a contact ends
// when the obstacle no longer covers the rest position of the node. Then
//
//     u_grid = net(u_surface),  x = X + sum_a N_a(X) u_grid,a
//
// and prescribed vertices are set to their goals afterwards.
#include <math.h>
#include <string.h>

#include "omentum/tissue_engine.h"
#include "umesh/umesh_internal.h"
#include "umesh/umesh_net_internal.h"

#define TOUCHING 1e-6  // m
#define NROUND 3       // predictions in one step, each with the new contacts of the one before

typedef struct Skin {
    int node;   // of the grid
    int vert;   // of the mesh, nearest to x
    OmVec3 x;   // nearest point of the node on the surface, m
    bool near;  // within a cell of that vertex
} Skin;

typedef struct Learned {  // model->data
    const OmUmeshNet* net;
    int nskin;
    Skin* skin;
    int* elem;       // element of the grid for each vertex                            (nvert)
    double* weight;  // of the element's nodes                                      (nvert x 8)
} Learned;

typedef struct Touch {  // contact of a surface node; the engine's bytes of a state
    double place[3];    // in the obstacle's frame
    int64_t obstacle;   // from 1; 0: none
} Touch;

typedef struct LearnedWork {  // work->data
    OmUmeshPredictor* predictor;
    unsigned char* mask;  //                                                          (nnode)
    float *u, *goal;      // prediction; input at masked nodes, m                 (nnode x 3)
} LearnedWork;

// ---- model ------------------------------------------------------------------------------------------

static void learned_destroy(OmTissueModel* m) {
    Learned* l = om_engine_data(m);
    if (!l) return;
    om_free(l->skin);
    om_free(l->elem);
    om_free(l->weight);
    om_free(l);
    om_engine_set_data(m, NULL);
}

static void find_skin(const OmTissueModel* m, Learned* l) {
    const OmUmeshGrid* g = &l->net->grid;
    const double* x = om_tissue_mesh(m)->x;
    int nsurface;
    const int* surface_vert = om_tissue_surface_vert(m, &nsurface);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        if (!g->is_surface[i]) continue;
        Skin* skin = &l->skin[l->nskin++];
        *skin = (Skin){.node = i, .vert = 0, .x = om_load3(g->surface_x, i)};
        double best = HUGE_VAL;
        for (int k = 0; k < nsurface; ++k) {
            double d = om_distance(om_load3(x, surface_vert[k]), skin->x);
            if (d < best) best = d, skin->vert = surface_vert[k];
        }
        skin->near = best < g->fem.grid.spacing;
    }
}

static OmStatus learned_create(OmTissueModel* m) {
    const OmUmeshNet* net = om_engine_options(m);
    const OmTetMesh* mesh = om_tissue_mesh(m);
    OM_CHECK(net, OM_INVALID, "umesh: no trained network is given (OmTissueDef.options)");
    Learned* l = om_calloc(1, sizeof *l);
    if (!l) return OM_NO_MEMORY;
    om_engine_set_data(m, l);  // destroyed with the model, also if a call below fails
    l->net = net;
    OM_ALLOC(l->skin, net->grid.fem.mesh.nnode);
    OM_ALLOC(l->elem, mesh->nvert);
    OM_ALLOC(l->weight, 8 * (size_t)mesh->nvert);
    OM_TRY(om_fem_mesh_embed(&net->grid.fem.mesh, mesh->nvert, mesh->x, l->elem, l->weight));
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_vec3(0, 0, 0);
        for (int a = 0; a < 8; ++a)
            p = om_madd(p, l->weight[8 * (size_t)i + (size_t)a],
                        om_load3(net->grid.fem.mesh.x,
                                 net->grid.fem.mesh.elem_node[8 * (size_t)l->elem[i] + (size_t)a]));
        double off = om_distance(p, om_load3(mesh->x, i));
        OM_CHECK(
            off < 2 * net->grid.fem.grid.spacing, OM_INVALID,
            "umesh: vertex %d of the mesh is %.3g mm outside of the organ that the network was "
            "trained on",
            i, 1e3 * off);
    }
    find_skin(m, l);
    return OM_OK;
}

static size_t learned_state_size(const OmTissueModel* m) {
    const Learned* l = om_engine_data(m);
    return (size_t)l->nskin * sizeof(Touch);
}

// Positions were set from outside, or the state is new: there are no contacts.
static void learned_sync(const OmTissueModel* m, OmTissueState* s) {
    memset(om_engine_state_data(s), 0, learned_state_size(m));
}

static size_t learned_memory(const OmTissueModel* m, const OmTissueWork* work) {
    const Learned* l = om_engine_data(m);
    size_t nvert = (size_t)om_tissue_mesh(m)->nvert, nnode = (size_t)l->net->grid.fem.mesh.nnode;
    size_t model = sizeof *l + (size_t)l->nskin * sizeof *l->skin +
                   nvert * (sizeof *l->elem + 8 * sizeof *l->weight);
    if (!work) return model;
    const LearnedWork* w = om_engine_work_data(work);
    return model + sizeof *w + nnode * (1 + 6 * sizeof(float)) +
           om__umesh_predictor_memory(w->predictor);
}

// ---- work -------------------------------------------------------------------------------------------

static void learned_destroy_work(OmTissueWork* work) {
    LearnedWork* w = om_engine_work_data(work);
    if (!w) return;
    om_umesh_predictor_destroy(w->predictor);
    om_free(w->mask);
    om_free(w->u);
    om_free(w->goal);
    om_free(w);
    om_engine_set_work_data(work, NULL);
}

static OmStatus learned_create_work(const OmTissueModel* m, OmTissueWork* work) {
    const Learned* l = om_engine_data(m);
    size_t nnode = (size_t)l->net->grid.fem.mesh.nnode;
    LearnedWork* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    om_engine_set_work_data(work, w);
    OM_ALLOC(w->mask, nnode);
    OM_ALLOC(w->u, 3 * nnode);
    OM_ALLOC(w->goal, 3 * nnode);
    return om_umesh_predictor_create(l->net, om_engine_def(m)->solver.nworker, &w->predictor);
}

// ---- displacements of surface nodes -------------------------------------------------------------------

static void put_goal(LearnedWork* w, const Skin* skin, OmVec3 place) {
    OmVec3 u = om_sub(place, skin->x);
    const double value[3] = {u.x, u.y, u.z};
    w->mask[skin->node] = 1;
    for (int c = 0; c < 3; ++c) w->goal[3 * skin->node + c] = (float)value[c];
}

static OmVec3 held_place(const OmTissueState* s, int i) {
    OmVec3 goal = {0, 0, 0};
    om_engine_find_goal(s, i, &goal);
    return goal;
}

// Set the goals of surface nodes that arms grasp; if a grasped patch contains no node, of the node nearest to it.
static void take_held(const OmTissueModel* m, const OmTissueState* s, LearnedWork* w) {
    const Learned* l = om_engine_data(m);
    const signed char* held_by = om_tissue_held_by(s);
    int num[OM_MAX_ARM] = {0};
    for (int k = 0; k < l->nskin; ++k) {
        const Skin* skin = &l->skin[k];
        if (!skin->near || held_by[skin->vert] < 0) continue;
        OmVec3 rest = om_load3(om_tissue_mesh(m)->x, skin->vert);
        put_goal(w, skin, om_add(held_place(s, skin->vert), om_sub(skin->x, rest)));
        ++num[held_by[skin->vert]];
    }
    for (int i = 0; i < om_tissue_mesh(m)->nvert; ++i) {
        int arm = held_by[i];
        if (arm < 0 || num[arm]) continue;
        OmVec3 rest = om_load3(om_tissue_mesh(m)->x, i);
        const Skin* best = NULL;
        for (int k = 0; k < l->nskin; ++k)
            if (!best || om_distance(l->skin[k].x, rest) < om_distance(best->x, rest))
                best = &l->skin[k];
        if (!best) return;
        put_goal(w, best, om_add(held_place(s, i), om_sub(best->x, rest)));
        ++num[arm];
    }
}

static double distance_to(const OmTissueObstacle* o, OmPose pose, OmVec3 p, OmVec3* normal) {
    OmVec3 local = om_pose_apply(om_pose_inverse(pose), p);
    double gap = o->distance(o->ctx, local, normal) - o->offset;
    *normal = om_quat_rotate(pose.q, *normal);
    return gap;
}

// Contacts of the last step: either the node moves with the obstacle, or the contact ends.
static void keep_touching(const Learned* l, OmTissueState* s, LearnedWork* w, int nobstacle,
                          const OmTissueObstacle* obstacle) {
    Touch* touch = om_engine_state_data(s);
    for (int k = 0; k < l->nskin; ++k) {
        Touch* t = &touch[k];
        OmVec3 n;
        if (!t->obstacle) continue;
        const OmTissueObstacle* o = t->obstacle <= nobstacle ? &obstacle[t->obstacle - 1] : NULL;
        if (!o || distance_to(o, o->pose_end, l->skin[k].x, &n) > TOUCHING) {
            t->obstacle = 0;
            continue;
        }
        if (!w->mask[l->skin[k].node])
            put_goal(w, &l->skin[k],
                     om_pose_apply(o->pose_end, om_vec3(t->place[0], t->place[1], t->place[2])));
    }
}

// A surface node predicted inside an obstacle gets a contact, at the nearest point of the obstacle's surface.
static bool find_touching(const Learned* l, OmTissueState* s, LearnedWork* w, int nobstacle,
                          const OmTissueObstacle* obstacle) {
    Touch* touch = om_engine_state_data(s);
    bool is_new = false;
    for (int k = 0; k < l->nskin; ++k) {
        const Skin* skin = &l->skin[k];
        if (w->mask[skin->node]) continue;
        const float* u = w->u + 3 * (size_t)skin->node;
        OmVec3 p = om_add(skin->x, om_vec3(u[0], u[1], u[2])), n;
        for (int b = 0; b < nobstacle; ++b) {
            double gap = distance_to(&obstacle[b], obstacle[b].pose_end, p, &n);
            if (!(gap < -TOUCHING)) continue;
            OmVec3 out = om_madd(p, -gap, n);
            OmVec3 place = om_pose_apply(om_pose_inverse(obstacle[b].pose_end), out);
            touch[k] = (Touch){{place.x, place.y, place.z}, b + 1};
            put_goal(w, skin, out);
            is_new = true;
            break;
        }
    }
    return is_new;
}

// ---- the step ---------------------------------------------------------------------------------------

static OmStatus predict(const Learned* l, LearnedWork* w, OmUmeshTrust* trust) {
    size_t nnode = (size_t)l->net->grid.fem.mesh.nnode, num = 0;
    for (size_t i = 0; i < nnode; ++i) num += w->mask[i];
    memset(w->u, 0, 3 * nnode * sizeof *w->u);
    *trust = (OmUmeshTrust){.is_inside = true};
    if (!num) return OM_OK;
    for (size_t i = 0; i < 3 * nnode; ++i)
        if (w->mask[i / 3]) w->u[i] = w->goal[i];
    return om_umesh_predict(w->predictor, w->mask, w->u, trust);
}

static void write_state(const OmTissueModel* m, OmTissueState* s, const LearnedWork* w, double h) {
    const Learned* l = om_engine_data(m);
    const OmTetMesh* mesh = om_tissue_mesh(m);
    double *x = om_engine_x(s), *v = om_engine_v(s);
    for (int i = 0; i < mesh->nvert; ++i) {
        const int* node = l->net->grid.fem.mesh.elem_node + 8 * (size_t)l->elem[i];
        OmVec3 p = om_load3(om_tissue_mesh(m)->x, i);
        for (int a = 0; a < 8; ++a) {
            const float* u = w->u + 3 * (size_t)node[a];
            p = om_madd(p, l->weight[8 * (size_t)i + (size_t)a], om_vec3(u[0], u[1], u[2]));
        }
        om_engine_find_goal(s, i, &p);
        om_store3(v, i, om_scale(1 / h, om_sub(p, om_load3(x, i))));
        om_store3(x, i, p);
    }
    om_engine_end_step(s, h);
}

static void report_contacts(const Learned* l, const OmTissueState* s, const LearnedWork* w,
                            int nobstacle, OmTissueObstacle* obstacle) {
    const Touch* touch = om_engine_state_data(s);
    for (int k = 0; k < l->nskin; ++k) {
        const float* u = w->u + 3 * (size_t)l->skin[k].node;
        OmVec3 p = om_add(l->skin[k].x, om_vec3(u[0], u[1], u[2])), n;
        if (touch[k].obstacle) ++obstacle[touch[k].obstacle - 1].ncontact;
        for (int b = 0; b < nobstacle; ++b) {
            double gap = distance_to(&obstacle[b], obstacle[b].pose_end, p, &n);
            obstacle[b].penetration = fmax(obstacle[b].penetration, -gap);
        }
    }
}

// Predict and add contacts, until there are no new contacts.
static OmStatus settle(const OmTissueModel* m, OmTissueState* s, LearnedWork* w, int nobstacle,
                       const OmTissueObstacle* obstacle, OmUmeshTrust* trust) {
    const Learned* l = om_engine_data(m);
    memset(w->mask, 0, (size_t)l->net->grid.fem.mesh.nnode);
    take_held(m, s, w);
    keep_touching(l, s, w, nobstacle, obstacle);
    OM_TRY(predict(l, w, trust));
    for (int round = 0; round < NROUND; ++round) {
        if (!find_touching(l, s, w, nobstacle, obstacle)) break;
        OM_TRY(predict(l, w, trust));
    }
    return OM_OK;
}

static OmStatus learned_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* work, double h,
                             int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    const Learned* l = om_engine_data(m);
    LearnedWork* w = om_engine_work_data(work);
    OmUmeshTrust trust;
    om_engine_save_state(s, work);
    OmStatus status = settle(m, s, w, nobstacle, obstacle, &trust);
    if (status < 0) {
        om_engine_restore_state(s, work);
        return status;
    }
    write_state(m, s, w, h);
    report_contacts(l, s, w, nobstacle, obstacle);
    report->substeps = 1;
    report->residual = trust.score;
    report->is_unguarded = !trust.is_inside;
    if (trust.is_inside) return OM_OK;
    return om_error(OM_NOT_CONVERGED, "umesh: outside of what was trained: %s", trust.why);
}

static OmStatus learned_load(const OmEngineInput* input, void** options) {
    OmUmeshNet* net;
    OM_TRY(om_umesh_net_load(input->file, &net));
    *options = net;
    return OM_OK;
}
static void learned_unload(void* options) { om_umesh_net_destroy(options); }

static const OmTissueEngine engine = {
    .version = OM_ENGINE_VERSION,
    .name = "umesh",
    .summary = "a trained network (U-Mesh), with the material of its training",
    .needs_file = true,
    .load = learned_load,
    .unload = learned_unload,
    .create = learned_create,
    .destroy = learned_destroy,
    .create_work = learned_create_work,
    .destroy_work = learned_destroy_work,
    .step = learned_step,
    .get_state_size = learned_state_size,
    .sync_state = learned_sync,
    .get_memory = learned_memory,
};

const OmTissueEngine* om_umesh_engine(void) { return &engine; }
