// 15_write_an_engine.c: an engine of your own, chosen by its name in a scene.
//
// Every edge of every tetrahedron is a spring, k = E V / l^2; substeps of symplectic Euler are short enough to be
// stable. omentum knows the engine by the table `lattice`. The program lifts a sheet of a scene that names it.
#include <stdio.h>
#include <string.h>

#include "omentum/omentum.h"

#define DAMPING 4.0  // 1/s

static const int edge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

static double stiffness(const OmTissueModel* m, int tet, double rest) {
    return om_engine_material(m, tet)->young * om_engine_volume(m)[tet] / (rest * rest);
}

static OmStatus lattice_create(OmTissueModel* m) {
    const OmTetMesh* mesh = om_tissue_mesh(m);
    double* max_step = om_alloc(1, sizeof *max_step);  // s, data of the model
    om_engine_set_data(m, max_step);                   // lattice_destroy frees it
    double* sum = om_calloc((size_t)mesh->nvert, sizeof *sum);
    OmStatus status = max_step && sum ? OM_OK : OM_NO_MEMORY;
    for (int n = 0; status == OM_OK && n < 6 * mesh->ntet; ++n) {
        const int* v = mesh->tet_vert + 4 * (n / 6);
        int i = v[edge[n % 6][0]], j = v[edge[n % 6][1]];
        double k = stiffness(m, n / 6, om_distance(om_load3(mesh->x, i), om_load3(mesh->x, j)));
        sum[i] += k, sum[j] += k;
    }
    if (status == OM_OK) *max_step = 1;
    for (int i = 0; status == OM_OK && i < mesh->nvert; ++i)  // half of the limit of stability
        *max_step = fmin(*max_step, sqrt(0.5 * om_tissue_mass(m)[i] / sum[i]));
    om_free(sum);
    return status;
}
static void lattice_destroy(OmTissueModel* m) { om_free(om_engine_data(m)); }

static OmStatus lattice_create_work(const OmTissueModel* m, OmTissueWork* w) {
    double* force = om_calloc(3 * (size_t)om_tissue_mesh(m)->nvert, sizeof *force);
    om_engine_set_work_data(w, force);
    return force ? OM_OK : OM_NO_MEMORY;
}
static void lattice_destroy_work(OmTissueWork* w) { om_free(om_engine_work_data(w)); }

// Weight, external forces, damping and springs.
static void add_forces(const OmTissueModel* m, OmTissueState* s, double* force) {
    const OmTetMesh* mesh = om_tissue_mesh(m);
    const double *x = om_engine_x(s), *external = om_tissue_external_force(s);
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 a = om_madd(om_tissue_gravity(m), -DAMPING, om_load3(om_engine_v(s), i));
        om_store3(force, i, om_madd(om_load3(external, i), om_tissue_mass(m)[i], a));
    }
    for (int n = 0; n < 6 * mesh->ntet; ++n) {
        const int* v = mesh->tet_vert + 4 * (n / 6);
        int i = v[edge[n % 6][0]], j = v[edge[n % 6][1]];
        double rest = om_distance(om_load3(mesh->x, i), om_load3(mesh->x, j));
        OmVec3 d = om_sub(om_load3(x, j), om_load3(x, i));
        double k = stiffness(m, n / 6, rest), length = fmax(om_norm(d), 1e-9);
        OmVec3 pull = om_scale(k * (1 - rest / length), d);
        om_store3(force, i, om_add(om_load3(force, i), pull));
        om_store3(force, j, om_sub(om_load3(force, j), pull));
    }
}

// Move p out of the obstacles, and stop its velocity into them; return the force of all that.
static OmVec3 push_out(int nobstacle, OmTissueObstacle* obstacle, double mass_per_h, OmVec3* p,
                       OmVec3* v) {
    OmVec3 force = {0, 0, 0}, n;
    for (int k = 0; k < nobstacle; ++k) {
        OmTissueObstacle* o = &obstacle[k];
        OmVec3 local = om_pose_apply(om_pose_inverse(o->pose_end), *p);
        double gap = o->distance(o->ctx, local, &n) - o->offset;
        if (!(gap < 0)) continue;
        n = om_quat_rotate(o->pose_end.q, n);
        double speed = fmin(0, om_dot(*v, n));
        o->penetration = fmax(o->penetration, -gap);
        *p = om_madd(*p, -gap, n);
        *v = om_madd(*v, -speed, n);
        force = om_madd(force, -speed * mass_per_h, n);
    }
    return force;
}

static OmStatus lattice_step(const OmTissueModel* m, OmTissueState* s, OmTissueWork* w, double h,
                             int nobstacle, OmTissueObstacle* obstacle, OmTissueReport* report) {
    double *force = om_engine_work_data(w), *x = om_engine_x(s), *v = om_engine_v(s);
    int nsub = (int)ceil(h / *(const double*)om_engine_data(m));
    double sub = h / nsub;
    for (int k = 0; k < nsub; ++k) {
        add_forces(m, s, force);
        for (int i = 0; i < om_tissue_mesh(m)->nvert; ++i) {
            double mass = om_tissue_mass(m)[i];
            OmVec3 p = om_load3(x, i), f = om_load3(force, i), goal, speed, contact = {0, 0, 0};
            bool is_held = om_engine_find_goal(s, i, &goal);
            if (is_held)  // it reaches its goal in the last substep
                speed = om_scale(1 / (sub * (nsub - k)), om_sub(goal, p));
            else
                speed = om_madd(om_load3(v, i), sub / mass, f);
            p = om_madd(p, sub, speed);
            if (!is_held) contact = push_out(nobstacle, obstacle, mass / sub, &p, &speed);
            om_store3(x, i, p);
            om_store3(v, i, speed);
            om_store3(om_engine_tool_force(s), i, om_scale(is_held ? -1 : 0, f));
            om_store3(om_tissue_contact_force(s), i, contact);
        }
    }
    report->substeps = nsub;
    om_engine_end_step(s, h);
    return OM_OK;
}
static const char* const number[] = {"young", NULL};
static const OmTissueEngine lattice = {.version = OM_ENGINE_VERSION,
                                       .name = "lattice",
                                       .number = number,
                                       .has_forces = true,
                                       .create = lattice_create,
                                       .destroy = lattice_destroy,
                                       .create_work = lattice_create_work,
                                       .destroy_work = lattice_destroy_work,
                                       .step = lattice_step};

int main(void) {
    static const char text[] =
        "name: net\ntissue: {source: sheet, engine: lattice, cells: [9, 9, 1]}\n";
    OmEngineSet engines = om_engine_set_default();
    OmScene scene;
    OmSite site = {0};
    OmBody* body = NULL;
    OmBodyReport report;
    OmBodyForces f;
    OmStatus status = om_engine_set_add(&engines, &lattice);
    if (status == OM_OK) status = om_scene_parse(text, strlen(text), "net", &scene);
    scene.engines = &engines;
    if (status == OM_OK) status = om_site_build(&scene, OM_SITE_TWIN, NULL, &site);
    if (status == OM_OK) status = om_body_create(&scene, &site, 1, &body);
    OmVec3 corner = om_pose_apply(site.pose_world_task, om_vec3(0.05, 0.05, 0.005));
    OmPose tip = {corner, om_quat_identity()};
    if (status == OM_OK) status = om_body_grasp(body, 0, tip, 0.008, NULL);
    for (int k = 1; status == OM_OK && k <= 100; ++k) {
        tip.p.z += 0.0003;
        status = om_body_move(body, 0, tip);
        if (status == OM_OK) status = om_body_step(body, 0.02, &report);
        if (status == OM_OK) status = om_body_get_forces(body, &f);
        if (k % 25 == 0 && status == OM_OK) printf("%4.1f mm: %.3f N\n", 0.3 * k, f.grasp[0].z);
    }
    if (status != OM_OK) fprintf(stderr, "%s\n", om_error_message());
    om_body_destroy(body);
    om_site_done(&site);
    return status == OM_OK ? 0 : 1;
}
