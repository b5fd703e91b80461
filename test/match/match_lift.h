// match_lift.h: a sheet lifted at two corners and scanned without noise, for tests of updates. The truth is a finer
// mesh of another stiffness, held where x is below -5 mm; the twin knows of no attachment.
#ifndef OMENTUM_MATCH_LIFT_H
#define OMENTUM_MATCH_LIFT_H

#include "test_common.h"

#include "linear_sheet.h"
#include "omentum/body.h"
#include "omentum/match.h"

#define NCASE 2

typedef struct Rig {
    OmScene scene;
    OmSite twin, truth;
    OmMatch* match;
    const OmMatchView* view;
    OmAcquisition acq[NCASE];
    double* x_twin[NCASE];
} Rig;

// Upper side of a body as a scan: vertices whose normal points up, without noise; the camera looks down from +x.
static inline void scan_body(const OmBody* body, OmScan* scan) {
    const OmSite* site = om_body_site(body);
    const OmMeshSet* top = om_tet_mesh_find_set(&site->mesh, "top");
    assert_int_equal(om_scan_init(top->nvert, 0, scan), OM_OK);
    for (int i = 0; i < top->nvert; ++i)
        om_store3(scan->x, i, om_load3(om_body_x(body), top->vert[i]));
    scan->has_camera = true;
    scan->camera = (OmCamera){.width = 64, .height = 48, .fov = 1, .near_m = 0.05, .far_m = 1};
    scan->camera.pose_world_camera = (OmPose){{0.05, 0, 0.4}, {0, 1, 0, 0}};
}

// A body of the site, lifted by 30 mm at a corner of the side x > 0.
static inline OmBody* lift(const OmScene* scene, const OmSite* site, double side,
                           OmMatchGrasp* grasp) {
    OmBody* body;
    OmBodyReport report;
    int nheld;
    assert_int_equal(om_body_create(scene, site, 1, &body), OM_OK);
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    OmPose from = {om_vec3(0.05, side * 0.05, 0.005), om_quat_identity()}, to = from;
    to.p.z += 0.03;
    *grasp = (OmMatchGrasp){.pose_world_grasp = from, .pose_world_now = to, .radius = 0.012};
    assert_int_equal(om_body_grasp(body, 0, from, 0.012, &nheld), OM_OK);
    for (int k = 1; k <= 60; ++k) {
        assert_int_equal(om_body_move(body, 0, om_pose_lerp(from, to, k / 60.0)), OM_OK);
        assert_true(om_body_step(body, 0.02, &report) >= 0);
    }
    assert_true(om_body_settle(body, 0.02, 1e-3, 3) >= 0);
    return body;
}

// The sites and the two lifts, without `match`.
static inline void make_rig(Rig* rig) {
    memset(rig, 0, sizeof *rig);
    rig->scene = linear_sheet();
    rig->scene.tissue.cells = om_vec3(12, 12, 1);
    rig->scene.attach = (OmSceneAttach){
        .kind = OM_ATTACH_BOX, .lo = {-1, -1, -1}, .hi = {-0.005, 1, 1}, .share_max = 0.5};
    rig->scene.believed.kind = OM_BELIEF_NONE;
    rig->scene.roi.is_random = false;
    rig->scene.roi.center = om_vec3(0.03, 0, 0);
    assert_int_equal(om_site_build(&rig->scene, OM_SITE_TWIN, NULL, &rig->twin), OM_OK);
    assert_int_equal(om_site_build(&rig->scene, OM_SITE_WORLD, NULL, &rig->truth), OM_OK);
    size_t size = 3 * sizeof(double) * (size_t)rig->twin.mesh.nvert;
    for (int k = 0; k < NCASE; ++k) {
        OmAcquisition* a = &rig->acq[k];
        OmBody* body = lift(&rig->scene, &rig->truth, k ? -1 : 1, &a->grasp[0]);
        scan_body(body, &a->scan);
        om_body_destroy(body);
        body = lift(&rig->scene, &rig->twin, k ? -1 : 1, &a->grasp[0]);
        rig->x_twin[k] = malloc(size);
        memcpy(rig->x_twin[k], om_body_x(body), size);
        om_body_destroy(body);
        a->ngrasp = 1;
        a->x_twin = rig->x_twin[k];
    }
}

// A rig of this program's own scans and positions; the sites are shared, made once a program.
static inline void begin(Rig* rig) {
    static Rig shared;
    static bool is_made;
    if (!is_made) make_rig(&shared);
    is_made = true;
    *rig = shared;
    for (int k = 0; k < NCASE; ++k) {
        const OmScan* from = &shared.acq[k].scan;
        OmScan* scan = &rig->acq[k].scan;
        assert_int_equal(om_scan_init(from->npoint, 0, scan), OM_OK);
        memcpy(scan->x, from->x, 3 * sizeof(double) * (size_t)from->npoint);
        scan->has_camera = from->has_camera;
        scan->camera = from->camera;
        size_t size = 3 * sizeof(double) * (size_t)rig->twin.mesh.nvert;
        rig->x_twin[k] = malloc(size);
        memcpy(rig->x_twin[k], shared.x_twin[k], size);
        rig->acq[k].x_twin = rig->x_twin[k];
    }
    OmMatchDef def = om_match_default_def(&rig->scene, &rig->twin);
    def.nhypothesis = 500;
    assert_int_equal(om_match_create(&def, &rig->match), OM_OK);
    rig->view = om_match_view(rig->match);
}

static inline void end(Rig* rig) {
    for (int k = 0; k < NCASE; ++k) {
        om_scan_done(&rig->acq[k].scan);
        free(rig->x_twin[k]);
    }
    om_match_destroy(rig->match);
}

// The truth of the rig on the twin: x <= -5 mm of the underside.
static inline void mark_true(const Rig* rig, unsigned char* attached) {
    memset(attached, 0, (size_t)rig->twin.mesh.nvert);
    for (int i = 0; i < rig->view->ncandidate; ++i) {
        int v = rig->view->candidate[i];
        attached[v] = rig->twin.mesh.x[3 * v] <= -0.005;
    }
}

// Dice coefficient and share of the true attachments that are found; the truth is x < -5 mm.
static inline double score(const Rig* rig, const OmMatchEstimate* e, double* found) {
    int both = 0, truth = 0, guess = 0;
    for (int i = 0; i < rig->view->ncandidate; ++i) {
        int v = rig->view->candidate[i];
        bool is_true = rig->twin.mesh.x[3 * v] <= -0.005;
        both += is_true && e->attached[v];
        truth += is_true;
        guess += e->attached[v];
    }
    *found = (double)both / truth;
    return 2.0 * both / (truth + guess);
}

#endif
