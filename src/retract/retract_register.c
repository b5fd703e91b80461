// retract_register.c: before the operation the model is moved onto the tissue that the depth camera sees at rest.
//
// The registration of a robot is off by a degree or two. Every scan of the operation would show it, and from one degree
// on no estimate is accepted (match_judge.c): the camera's error would count as attachments. At rest all of the
// tissue is seen where the model has it, so that the motion is known best then, and once.
#include "retract/retract_register.h"

#include <string.h>

#include "omentum/world_cloud.h"

#define MAX_TURN (5 * OM_PI / 180)  // rad, of a registration that is mended
#define MAX_SHIFT 0.010             // m

static OmStatus take_scan(OmWorld* world, const OmSite* site, OmScan* scan) {
    OmObservation obs = {0};
    const OmScanDef how = om_scan_default_def(om_site_spacing(site));
    const OmCloudDef space = om_cloud_default_def(world, site);
    const unsigned color = om_world_sources(world) & OM_OBSERVE_COLOR;
    OM_TRY(om_world_observe(world, OM_OBSERVE_DEPTH | color, &obs));
    OmStatus status = om_scan_from_observation(&how, &space, &obs, scan);
    om_observation_done(&obs);
    return status;
}

bool om__retract_registers(const OmScene* scene, const OmWorld* world) {
    return scene->update.is_enabled && scene->update.registers &&
           om_world_sources(world) & OM_OBSERVE_DEPTH;
}

OmStatus om__retract_register(const OmScene* scene, OmWorld* world, OmSite* site,
                              OmMatchVerdict* verdict) {
    memset(verdict, 0, sizeof *verdict);
    if (!om__retract_registers(scene, world)) return OM_OK;
    OmScan scan = {0};
    OmMatch* match = NULL;
    OmMatchDef def = om_match_default_def(scene, site);
    def.nhypothesis = 0;  // nothing is estimated
    OmStatus status = om_match_create(&def, &match);
    if (status >= 0) status = take_scan(world, site, &scan);
    if (status >= 0) status = om_match_register(match, &scan, MAX_TURN, MAX_SHIFT, verdict);
    om_match_destroy(match);
    om_scan_done(&scan);
    OM_TRY(status);
    om_log(OM_LOG_INFO, "registration at rest: chi-square %.2f, %s", verdict->chi2,
           verdict->reason[0] ? verdict->reason : "it fits");
    if (!verdict->is_moved || verdict->cause != OM_MATCH_MOVED) return OM_OK;
    return om_site_move(scene, site, om_pose_inverse(verdict->pose_right_scan));
}
