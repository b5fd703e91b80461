/// omentum/belief_monitor.h: does the twin still agree with the tissue that the depth camera sees? (floor 7; thesis
/// 6.4.5)
///
/// A frame compares the depth picture with the twin, seen by a simulated camera at the same pose behind the measured
/// tools. Its distance is the median, over about 1,000 measured points on the tissue, of the distance to the closest
/// point of the twin's visible surface. The mean distance of the frames before a grasp, the rest, has errors of
/// registration and sensor; mu is the distance less the rest. mu gives the warning state:
///
/// | state | mu             | the loop                                                |
/// |-------|----------------|---------------------------------------------------------|
/// | 0     | up to 2 mm     | continues                                               |
/// | 1     | up to 4 mm     | halves its speed; attachments are estimated again       |
/// | 2     | up to 6 mm     | stops and plans again; attachments are estimated again  |
/// | 3     | above          | stops; a person decides                                 |
///
/// The state rises at once. It falls where mu is below the state's lower limit less a hysteresis.
///
///     OmMonitorDef def = om_monitor_default_def(&scene, world, &twin_site);
///     OmMonitor* monitor;
///     om_monitor_create(&def, &monitor);
///     if (om_monitor_is_due(monitor, time)) {              // 30 Hz
///         om_world_observe(world, om_monitor_sources(monitor, world), &obs);
///         om_monitor_frame(monitor, &obs, om_body_x(twin), is_holding, &frame);
///     }
///     om_monitor_destroy(monitor);
#ifndef OMENTUM_BELIEF_MONITOR_H
#define OMENTUM_BELIEF_MONITOR_H

#include "omentum/scene.h"
#include "omentum/world_cloud.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmMonitorDef {
    OmCookie cookie;          // set by om_monitor_default_def
    OmSceneMonitor settings;  // limits, hysteresis, rate, number of points
    // Tools, fixed anatomy and reach. Where a picture has colour, `clearance` is not used.
    OmCloudDef space;     // its arms are copied, its site is borrowed
    bool use_color;       // default true; a picture without colour is segmented by space alone
    OmSenseRange tissue;  // colours of the tissue; default om_sense_range(OM_PART_TISSUE)
    // Of the twin's positions: om_tissue_mesh of its model. Null, the default: that of the site. Borrowed until create.
    const OmTetMesh* mesh;
    int nray;        // of the simulated camera, 256 to 2^20; default 4096
    double max_age;  // s, above 0: an older picture is stale; default 0.2
} OmMonitorDef;

/// @param world  its arms; null: none is known
/// @param site   of the twin; borrowed
OM_API OmMonitorDef om_monitor_default_def(const OmScene* scene, const OmWorld* world,
                                           const OmSite* site);

typedef struct OmMonitorFrame {
    double time;      // s, of the observation
    double age;       // s, from the exposure of the depth picture to the observation
    double distance;  // m, median of the closest distances
    double rest;      // m, mean distance of the frames before the last grasp; 0 without such frames
    double mu;        // m, distance less rest
    // m, exceeded by a part of the tissue, part_share of the points: the lift of the twin where the picture shows
    // tissue that lies still since before the grasp, or the distance of moved tissue from a twin that lies still
    double part;
    int npoint;  // measured points on the tissue
    int nrest;   // frames in `rest`
    int state;   // warning state, 0 to 3; 0 while no tissue is held
    // The picture was older than max_age. As in a blind frame, rest and state are unchanged, and the distance is that
    // of the last good frame (0: there was none).
    bool is_stale;
    // Fewer than OM_MONITOR_MIN_POINT points, the twin is out of sight, or a tool's pose is not a number.
    bool is_blind;
    int nstale, nblind;  // frames so far since the last reset
    double unseen;       // s since the last frame that was neither, or since the first one
} OmMonitorFrame;

#define OM_MONITOR_MIN_POINT 50

typedef struct OmMonitor OmMonitor;
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_monitor_create(const OmMonitorDef* def, OmMonitor** monitor);
OM_API void om_monitor_destroy(OmMonitor* monitor);
/// Of its definition; valid as long as the monitor.
OM_API const OmSceneMonitor* om_monitor_settings(const OmMonitor* monitor);
/// Before a new operation: nothing has been grasped, no frame has been seen.
OM_API void om_monitor_reset(OmMonitor* monitor);
/// What a frame needs of a world: OM_OBSERVE_DEPTH, and OM_OBSERVE_COLOR where the world has it and the definition uses
/// it.
OM_API unsigned om_monitor_sources(const OmMonitor* monitor, const OmWorld* world);
/// Whether a frame is due: none was taken since the last multiple of the frame period, by the world's clock.
/// @param time  s, OmObservation.time
OM_API bool om_monitor_is_due(const OmMonitor* monitor, double time);
/// Compare an observation with depth with the twin at the same time. While tissue is held the rest is fixed; after
/// a release it is measured anew.
/// @param x_twin      vertex positions of the twin's mesh, m (nvert x 3)
/// @param is_holding  whether an arm holds tissue
/// @return OM_OK; OM_INVALID (no depth, a colour picture of another size, a position that is not finite: nothing is
///         changed); OM_NO_MEMORY or OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_monitor_frame(OmMonitor* monitor, const OmObservation* observation,
                                 const double* x_twin, bool is_holding, OmMonitorFrame* frame);
/// The state after `state` where mu is measured: Alg. 5 with hysteresis.
OM_API int om_monitor_next_state(const OmSceneMonitor* settings, int state, double mu);
/// The same by OmMonitorFrame.part: 0 to 2, with part_limit of the settings; 0 where parts are not watched.
/// @param part  m, less its value before the present grasp
OM_API int om_monitor_next_part_state(const OmSceneMonitor* settings, int state, double part);

#ifdef __cplusplus
}
#endif
#endif
