// bench_self.c: a step of tissue in contact with itself: a sheet of 100 x 60 x 5 mm, 819 vertices of quadratic
// elements, that is carried over in a half circle and then lies on itself; and fat of 1,936 vertices on a soft body of
// 3,072, at rest and while a tool pulls the fat along the body: by the faces of both meshes, and by a smooth surface
// that rides on the body.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"

#include "omentum/shape_sdf.h"

#define H 0.02

typedef struct Pile {
    OmTissueModel* model;
    OmTissueState* state;
    OmTissueWork* work;
    OmContact* contact;
    OmContactWork* contact_work;
} Pile;

// With a skin the contact is that of `skin`, without that of all surfaces.
static OmStatus make_pile(const OmTetMesh* mesh, OmTissueElement element, const OmContactSkin* skin,
                          const BenchOptions* options, Pile* p) {
    OmTissueDef def = om_tissue_default_def(om_fem_engine(), mesh);
    def.element = element;
    def.solver.nworker = options->nworker;
    OM_TRY(om_tissue_create(&def, &p->model));
    OM_TRY(om_tissue_state_create(p->model, &p->state));
    OM_TRY(om_tissue_work_create(p->model, &p->work));
    OmContactPlane plane = {om_vec3(0, 0, 0), om_vec3(0, 0, 1)};
    OmTissueObstacle board = om_plane_obstacle(&plane);
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 1, contact.obstacle = &board;
    contact.self_contact = !skin;
    contact.self_friction = contact.friction = 0.3;
    contact.nskin = skin != NULL;
    contact.skin = skin;
    OM_TRY(om_contact_create(&contact, p->model, &p->contact));
    return om_contact_work_create(p->contact, &p->contact_work);
}

static void done_pile(Pile* p) {
    om_contact_work_destroy(p->contact_work);
    om_contact_destroy(p->contact);
    om_tissue_work_destroy(p->work);
    om_tissue_state_destroy(p->state);
    om_tissue_destroy(p->model);
}

static OmStatus attach_low(OmTetMesh* mesh, int axis) {
    int* vert = om_alloc((size_t)mesh->nvert, sizeof *vert);
    if (!vert) return OM_NO_MEMORY;
    int num = 0;
    for (int i = 0; i < mesh->nvert; ++i)
        if (mesh->x[3 * i + axis] < 1e-9) vert[num++] = i;
    OmStatus status = om_tet_mesh_add_set(mesh, "attachment", vert, num);
    om_free(vert);
    return status;
}

// The pose of the tool after step n of a phase.
typedef OmPose (*PathFn)(int n);

// Steps of a phase from `begin`; the state at its end replaces `begin`.
static OmStatus measure(const Pile* p, void* begin, PathFn path, int nstep, BenchRow row,
                        const BenchOptions* options) {
    OmStatus status = OM_OK;
    size_t size = om_tissue_state_size(p->model);
    double* time = om_alloc((size_t)options->nrun * (size_t)nstep, sizeof *time);
    if (!time) return OM_NO_MEMORY;
    row.bench = "self";
    row.size = om_tissue_mesh(p->model)->nvert;
    row.nworker = options->nworker;
    row.steps = nstep;
    for (int run = 0; run < options->nrun; ++run) {
        memcpy((void*)p->state, begin, size);
        // the first step of a state that is new to the work looks for crossings, too
        row.iterations = row.solves = row.not_ok = 0;
        for (int n = 0; n < nstep; ++n) {
            OmContactReport report;
            if (path) OM_TRY_DONE(om_tissue_move_grasp(p->state, 0, path(n + 1)));
            double start = bench_now();
            OmStatus one =
                om_contact_step(p->contact_work, p->model, p->state, p->work, H, &report);
            time[run * nstep + n] = bench_now() - start;
            if (one < 0) {
                status = one;
                goto done;
            }
            row.not_ok += 100.0 * (one != OM_OK) / nstep;
            row.iterations += (double)report.tissue.iterations / nstep;
            row.solves += (double)report.nsolve / nstep;
            row.residual = fmax(row.residual, report.tissue.residual);
        }
    }
    row.hash = om_tissue_state_hash(p->state);
    row.compares = BENCH_MEAN;
    memcpy(begin, p->state, size);
    bench_steps(time, options->nrun, nstep, &row);
    status = bench_print(&row);
done:
    om_free(time);
    return status;
}

// ---- the sheet ------------------------------------------------------------------------------------------

#define CARRY 100  // steps of the half circle

static OmPose over(int n) {
    double part = fmin(1, (double)n / CARRY), angle = OM_PI * part, arm = 0.048;
    OmPose tip = {om_vec3(0.05 + arm * cos(angle), 0.03, 0.0025 + arm * sin(angle) + 0.007 * part),
                  om_quat_axis_angle(om_vec3(0, 1, 0), -angle)};
    return tip;
}

static OmStatus bench_fold(const BenchOptions* options) {
    OmTetMesh mesh;
    Pile p = {0};
    void* begin = NULL;
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.1, 0.06, 0.005), 10, 6, 1, &mesh));
    OmStatus status = OM_OK;
    OM_TRY_DONE(attach_low(&mesh, 0));
    OM_TRY_DONE(make_pile(&mesh, OM_ELEMENT_QUADRATIC, NULL, options, &p));
    begin = om_alloc(1, om_tissue_state_size(p.model));
    if (!begin) {
        status = OM_NO_MEMORY;
        goto done;
    }
    OM_TRY_DONE(om_tissue_grasp(p.model, p.state, 0, over(0), 0.007, NULL));
    memcpy(begin, p.state, om_tissue_state_size(p.model));
    BenchRow row = {.scene = "sheet 10x6x1, quadratic", .work = "folding", .goal_ms = 3};
    OM_TRY_DONE(measure(&p, begin, over, CARRY, row, options));
    memcpy((void*)p.state, begin, om_tissue_state_size(p.model));
    om_tissue_release(p.state, 0);
    memcpy(begin, p.state, om_tissue_state_size(p.model));
    row.work = "released on itself";
    OM_TRY_DONE(measure(&p, begin, NULL, 50, row, options));
    row.work = "at rest on itself";
    OM_TRY_DONE(measure(&p, begin, NULL, 50, row, options));
done:
    om_free(begin);
    done_pile(&p);
    om_tet_mesh_done(&mesh);
    return status;
}

// ---- fat on a body --------------------------------------------------------------------------------------

static OmStatus append_mesh(OmTetMesh* mesh, const OmTetMesh* more) {
    OmTetMesh all;
    OM_TRY(om_tet_mesh_init(&all, mesh->nvert + more->nvert, mesh->ntet + more->ntet));
    memcpy(all.x, mesh->x, 3 * (size_t)mesh->nvert * sizeof(double));
    memcpy(all.x + 3 * (size_t)mesh->nvert, more->x, 3 * (size_t)more->nvert * sizeof(double));
    memcpy(all.tet_vert, mesh->tet_vert, 4 * (size_t)mesh->ntet * sizeof(int));
    for (int k = 0; k < 4 * more->ntet; ++k)
        all.tet_vert[4 * mesh->ntet + k] = more->tet_vert[k] + mesh->nvert;
    om_tet_mesh_done(mesh);
    *mesh = all;
    return OM_OK;
}

static OmPose along(int n) {
    OmPose tip = {om_vec3(0.06 + 0.0003 * n, 0.03, 0.0395 + 0.0001 * n), om_quat_identity()};
    return tip;
}

// Of the body of 60 x 60 x 30 mm.
static double block_fn(void* ctx, OmVec3 p) {
    (void)ctx;
    OmVec3 d = om_sub(p, om_vec3(0.03, 0.03, 0.015));
    double x = fabs(d.x) - 0.03, y = fabs(d.y) - 0.03, z = fabs(d.z) - 0.015;
    OmVec3 out = om_vec3(fmax(x, 0), fmax(y, 0), fmax(z, 0));
    return om_norm(out) + fmin(0, fmax(x, fmax(y, z)));
}

static OmStatus bench_fat(bool has_skin, const BenchOptions* options) {
    OmTetMesh mesh, fat;
    OmSdf sdf = {0};
    Pile p = {0};
    void* begin = NULL;
    OM_TRY(om_tet_mesh_box(om_vec3(0, 0, 0), om_vec3(0.06, 0.06, 0.03), 15, 15, 11, &mesh));
    OmStatus status = om_tet_mesh_box(om_vec3(0.001, 0.001, 0.0305), om_vec3(0.06, 0.06, 0.0395),
                                      21, 21, 3, &fat);
    if (status == OM_OK) {
        status = append_mesh(&mesh, &fat);
        om_tet_mesh_done(&fat);
    }
    OM_TRY_DONE(status);
    OM_TRY_DONE(attach_low(&mesh, 2));
    OmSdfDef field = om_sdf_default_def(0.002);
    OM_TRY_DONE(om_sdf_from_function(block_fn, NULL, om_vec3(-0.01, -0.01, -0.01),
                                     om_vec3(0.07, 0.07, 0.04), &field, &sdf));
    OmContactSkin skin = {&sdf, 0, 16 * 16 * 12};
    OM_TRY_DONE(make_pile(&mesh, OM_ELEMENT_LINEAR, has_skin ? &skin : NULL, options, &p));
    begin = om_alloc(1, om_tissue_state_size(p.model));
    if (!begin) {
        status = OM_NO_MEMORY;
        goto done;
    }
    memcpy(begin, p.state, om_tissue_state_size(p.model));
    BenchRow row = {.scene = has_skin ? "fat 21x21x3 on a skin of 15x15x11"
                                      : "fat 21x21x3 on a body 15x15x11",
                    .work = "coming to rest",
                    .goal_ms = 16.7};
    OM_TRY_DONE(measure(&p, begin, NULL, 50, row, options));
    row.work = "at rest";
    OM_TRY_DONE(measure(&p, begin, NULL, 30, row, options));
    memcpy((void*)p.state, begin, om_tissue_state_size(p.model));
    OM_TRY_DONE(om_tissue_grasp(p.model, p.state, 0, along(0), 0.006, NULL));
    memcpy(begin, p.state, om_tissue_state_size(p.model));
    row.work = "pulled by a tool";
    OM_TRY_DONE(measure(&p, begin, along, 50, row, options));
done:
    om_free(begin);
    om_sdf_done(&sdf);
    done_pile(&p);
    om_tet_mesh_done(&mesh);
    return status;
}

OmStatus bench_self(const BenchOptions* options) {
    OM_TRY(bench_fold(options));
    OM_TRY(bench_fat(false, options));
    return bench_fat(true, options);
}
