// record_report_contact.c: the pressure of the tissue on the organ, when the pull was largest.
#include <string.h>

#include "omentum/sense.h"
#include "omentum/shape_closest.h"
#include "record/record_internal.h"

enum { WIDTH = 480, HEIGHT = 400, NBAND = 6 };

#define FOV 0.7         // rad, vertical
#define ON_ORGAN 0.001  // m, from the organ: a vertex farther away is pushed by something else
#define SPREAD \
    0.006  // m, radius over which the force on a vertex is spread: about the edges of the tissue's mesh

OmStatus om__record_contact(OmRecorder* rec, const OmRetractSample* now) {
    if (!rec->def.truth || !om_body_site(rec->shown)->has_organ) return OM_OK;
    ContactRecord* c = &rec->contact;
    if (!(now->force_world > c->pull)) return OM_OK;  // also NaN
    const size_t n = 3 * (size_t)om_body_mesh(rec->shown)->nvert;
    if (!c->force) {
        om_free(c->x);
        OM_ALLOC(c->x, n);
        OM_ALLOC(c->force, n);
    }
    c->pull = now->force_world;
    c->time = now->time;
    memcpy(c->x, om_body_x(rec->shown), n * sizeof *c->x);
    memcpy(c->force, om_body_contact_force(rec->shown), n * sizeof *c->force);
    return OM_OK;
}

void om__record_contact_done(ContactRecord* c) {
    om_free(c->x);
    om_free(c->force);
}

static OmVec3 normal_of(const OmSurface* s, int t) {
    const int* v = s->tri_vert + 3 * (size_t)t;
    OmVec3 a = om_load3(s->x, v[0]);
    return om_cross(om_sub(om_load3(s->x, v[1]), a), om_sub(om_load3(s->x, v[2]), a));
}

static OmVec3 middle_of(const OmSurface* s, int t) {
    const int* v = s->tri_vert + 3 * (size_t)t;
    OmVec3 m = om_add(om_load3(s->x, v[0]), om_load3(s->x, v[1]));
    return om_scale(1.0 / 3, om_add(m, om_load3(s->x, v[2])));
}

// Pressure on each triangle of the organ: what presses along the organ's normal on vertices of the tissue that lie on
// the organ within SPREAD of the triangle's middle, over the disc.
static OmStatus find_pressure(const OmRecorder* rec, const OmSurface* organ, double* pressure,
                              OmVec3* sum) {
    const ContactRecord* c = &rec->contact;
    OmStatus status = OM_OK;
    OmSurface tissue = {0};
    int* vert = NULL;
    OmSurfaceTree* tree = NULL;
    OM_TRY_DONE(om_tet_mesh_boundary(om_body_mesh(rec->shown), &tissue, &vert));
    OM_TRY_DONE(om_surface_tree_create(organ, &tree));
    for (int t = 0; t < organ->ntri; ++t) pressure[t] = 0;
    for (int i = 0; i < tissue.nvert; ++i) {
        OmVec3 f = om_load3(c->force, vert[i]), x = om_load3(c->x, vert[i]);
        OmSurfacePoint q;
        if (om_norm(f) == 0 || !om_surface_tree_find(tree, x, NULL, ON_ORGAN, &q)) continue;
        OmVec3 n = om_normalize(normal_of(organ, q.tri));
        double push = om_dot(f, n);
        if (push <= 0) continue;
        *sum = om_madd(*sum, -push, n);  // on the organ
        for (int t = 0; t < organ->ntri; ++t)
            if (om_norm2(om_sub(middle_of(organ, t), x)) < SPREAD * SPREAD)
                pressure[t] += push / (OM_PI * SPREAD * SPREAD);
    }
done:
    om_surface_tree_destroy(tree);
    om_surface_done(&tissue);
    om_free(vert);
    return status;
}

// The triangles of one band of pressure; band 0 has none.
static OmStatus add_band(OmSenseScene* scene, const OmSurface* organ, const double* pressure,
                         double most, int band) {
    static const double color[NBAND][3] = {{0.25, 0.10, 0.09}, {0.05, 0.05, 0.30},
                                           {0.02, 0.20, 0.35}, {0.03, 0.40, 0.25},
                                           {0.35, 0.60, 0.08}, {0.95, 0.85, 0.05}};
    OmSurface part;
    int n = 0, id;
    OM_TRY(om_surface_init(&part, organ->nvert, organ->ntri));
    memcpy(part.x, organ->x, 3 * (size_t)organ->nvert * sizeof *organ->x);
    for (int t = 0; t < organ->ntri; ++t) {
        int of = pressure[t] > 0 ? 1 + (int)(pressure[t] / most * (NBAND - 1)) : 0;
        if ((of < NBAND ? of : NBAND - 1) != band) continue;
        memcpy(part.tri_vert + 3 * (size_t)n++, organ->tri_vert + 3 * (size_t)t, 3 * sizeof(int));
    }
    part.ntri = n;
    OmSenseLook look = {.red = color[band][0], .green = color[band][1], .blue = color[band][2]};
    OmStatus status = n > 0 ? om_sense_scene_add(scene, &part, &look, &id) : OM_OK;
    om_surface_done(&part);
    return status;
}

// From above, the endoscope's side at the bottom.
static OmStatus draw(const OmSite* site, const OmSurface* organ, const double* pressure,
                     double most, OmPicture* picture) {
    OmSenseScene* scene = NULL;
    OmStatus status = OM_OK;
    *picture = (OmPicture){0};
    OM_TRY_DONE(om_sense_scene_create(&scene));
    for (int band = 0; band < NBAND; ++band)
        OM_TRY_DONE(add_band(scene, organ, pressure, most, band));
    OM_TRY_DONE(om_sense_scene_commit(scene));
    const OmPose task = site->pose_world_task;
    const double far = 1.6 * fmax(site->half_size.x, site->half_size.y) / tan(0.5 * FOV);
    OmCamera camera = {.width = WIDTH, .height = HEIGHT, .fov = FOV, .near_m = 1e-3, .far_m = 10};
    camera.pose_world_camera = om_pose_look_at(om_pose_apply(task, om_vec3(0, 0, far)), task.p,
                                               om_quat_rotate(task.q, om_vec3(1, 0, 0)));
    OM_TRY_DONE(om_picture_init(picture, WIDTH, HEIGHT, 3));
    OmSenseOptions options = om_sense_options_default();
    options.samples = 2;
    OM_TRY_DONE(om_sense_render(scene, &camera, &options, picture));
done:
    if (status < 0) {
        om_picture_done(picture);
        *picture = (OmPicture){0};
    }
    om_sense_scene_destroy(scene);
    return status;
}

OmStatus om__report_add_contact(OmReport* report, const OmRecorder* rec) {
    const ContactRecord* c = &rec->contact;
    if (!c->force) return OM_OK;
    OmStatus status = OM_OK;
    OmPicture picture = {0};
    char text[400];
    double *pressure = NULL, most = 0;
    OmVec3 sum = {0, 0, 0};
    om_anatomy_move(rec->anatomy, c->x);
    const OmSurface* organ = rec->anatomy->organ;
    OM_ALLOC_DONE(pressure, organ->ntri);
    OM_TRY_DONE(find_pressure(rec, organ, pressure, &sum));
    for (int t = 0; t < organ->ntri; ++t) most = fmax(most, pressure[t]);
    if (most == 0) goto done;
    OM_TRY_DONE(draw(om_body_site(rec->shown), organ, pressure, most, &picture));
    om_report_heading(report, "The tissue on the organ");
    snprintf(
        text, sizeof text,
        "Pressure of the tissue on the organ at %.1f s, when the pull in the truth was largest "
        "(%.2f N): from none (red) over blue and green to %.0f Pa (yellow), spread over %.0f mm; "
        "together %.2f N. Seen from above without the tissue, the endoscope's side below.",
        c->time, c->pull, most, 1e3 * SPREAD, om_norm(sum));
    om_report_picture(report, &picture, text);
done:
    om_picture_done(&picture);
    om_free(pressure);
    return status;
}
