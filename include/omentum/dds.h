/// omentum/dds.h: a da Vinci Research Kit over DDS (floor 5): a simulated robot, and a robot as a world.
///
/// Topics, types and names are those of ROS 2 and CRTK, so that ROS 2 programs see the arms; ROS is not needed. The
/// simulated robot serves a world to any client. OmWorld over DDS drives whatever answers on the topics: the simulated
/// robot of another process, or a real one. doc/dvrk.md has the table of topics.
///
///     OmDdsRobotDef def = om_dds_robot_default_def(world, &scene, &site);   // one process
///     om_dds_robot_create(&def, &robot);
///     om_dds_robot_run(robot, INFINITY, progress);
///
///     OmDdsWorldDef def = om_dds_world_default_def(&scene);                 // another one
///     om_world_create_dds(&def, &world);
///     om_world_reset(world);                                                // homes the arms
///
/// Links of one process to the same domain share it: destroy the first one last.
#ifndef OMENTUM_DDS_H
#define OMENTUM_DDS_H

#include "omentum/scene.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmDdsDef {
    OmCookie cookie;
    int domain;           // 0 to 232; default 0
    const char* network;  // interface, with multicast; default null: loopback without multicast
    const char* peer;     // address that is asked, without multicast; default null
    // With neither, the environment's CYCLONEDDS_URI is used where it is set.
} OmDdsDef;

OM_API OmDdsDef om_dds_default_def(void);

// ---- the simulated robot ------------------------------------------------------------------------------------------

typedef struct OmDdsRobotDef {
    OmCookie cookie;
    OmDdsDef dds;
    OmWorld* world;  // simulated, at rest, arms parked; borrowed, to be destroyed after the robot
    const OmScene* scene;  // borrowed, with the site
    const OmSite* site;
    // A second world of this scene and site: pictures are taken of it, from snapshots of the first, in another thread;
    // borrowed; default null: arms and tissue wait for each picture. Not used in lock-step
    OmWorld* eyes;
    double rate;          // Hz, of the arms; default 100, 1 to 1000
    double picture_rate;  // Hz; default 30; 0: no pictures
    // Time advances only when a client asks for it (topic omentum/tick); default false: with the wall clock.
    bool is_lock_step;
    // Also serve commands in JSON by UDP on 127.0.0.1 (doc/dvrk.md); default 0: not
    int udp_port;
    // Also send tools and the tissue's surface by OpenIGTLink on TCP, 127.0.0.1, for 3D Slicer; default 0: not
    int igtl_port;
    // Record all that is published to this new file, MCAP as rosbag2 reads it (doc/dvrk.md); borrowed; default null
    const char* record;
    bool has_record_pictures;  // with images and clouds, about 40 MB/s; default false
    // error, warning and status as crtk_msgs/StringStamped, as JHU's simulators; default false: std_msgs/String
    bool has_stamped_strings;
    // of all arms, "NAME:NUMBER"; borrowed; default "PROGRASP_FORCEPS:400093"
    const char* tool_type;
    const char* arm
        [OM_MAX_ARM];  // names, at most 15 letters, digits and _; borrowed; default "PSM1", "PSM2"
    void (*say)(void* ctx, const char* sentence);  // events, in words; default null
    void* say_ctx;
} OmDdsRobotDef;

OM_API OmDdsRobotDef om_dds_robot_default_def(OmWorld* world, const OmScene* scene,
                                              const OmSite* site);

typedef struct OmDdsRobot OmDdsRobot;

/// Arms PSM1 and PSM2 at the world's parked poses, disabled. By the wall clock the arms are served `rate` times a
/// second, whatever time the tissue needs: it steps in a thread of its own, and follows them.
/// @return OM_OK; OM_INVALID (a field of the definition); OM_NO_MEMORY; OM_IO (Cyclone DDS refuses: the message says
///         why)
OM_API OmStatus om_dds_robot_create(const OmDdsRobotDef* def, OmDdsRobot** robot);
OM_API void om_dds_robot_destroy(OmDdsRobot* robot);
/// Serve until `seconds` of the world's time have passed, or progress cancels.
/// @return OM_OK; OM_CANCELLED; OM_IO; errors of om_world_advance and om_world_observe
OM_API OmStatus om_dds_robot_run(OmDdsRobot* robot, double seconds, const OmProgress* progress);

/// End the recording: write what is left of it. om_dds_robot_destroy does so, too, and tells no error.
/// @return OM_OK, also where nothing is recorded; OM_NO_MEMORY; OM_IO (the file lacks its last part)
OM_API OmStatus om_dds_robot_end_record(OmDdsRobot* robot);

typedef struct OmDdsReport {
    int64_t ntick;     // advances of the world
    int64_t ncommand;  // commands taken
    int64_t nrefused;  // of them refused
    double time;       // s, of the world
    double wall_time;  // s
    // s between two messages of an arm, by the wall clock; NAN: fewer than two
    double period_median;
    double period_99;       // s, below which 99 % of them lie
    double period_max;      // s
    int64_t nlate;          // periods longer than one and a half
    int64_t npicture;       // sent
    double picture_render;  // s, mean time to render and send one
    int64_t nstep;          // of the tissue
    double tissue_time;     // s of the tissue since the begin, by the wall clock
    double step_max;        // s, the longest step of the tissue, by the wall clock
    // Tissue's time in a second of the arms, by the wall clock; NAN in lock-step, and before the first step
    double pace;
} OmDdsReport;
OM_API OmDdsReport om_dds_robot_report(const OmDdsRobot* robot);

// ---- recorded motion -----------------------------------------------------------------------------------------------

typedef struct OmDdsMotion {  // of an arm's tip; om_dds_motion_done frees
    int n;
    double* time;    // s, of the stamps; grows                    (n)
    OmPose* tip;     // measured pose_frame_tip                    (n)
    double* jaw;     // measured before it, rad; 0 without jaw     (n)
    int* message;    // of ARM/measured_cp in the file, from 1     (n)
    bool has_jaw;    //
    char frame[64];  // of the poses: "world"
} OmDdsMotion;

/// Read the motion of an arm from a recording: topics ARM/measured_cp and ARM/jaw/measured_js of MCAP without
/// compression, as OmDdsRobotDef.record and rosbag2 write it. Of a file without an end the whole chunks are read. A
/// pose that is published again at the same time is left out.
/// @param arm  "PSM1"
/// @return OM_OK; OM_INVALID (the message names file and topic); OM_UNAVAILABLE (compressed, or big endian);
///         OM_NO_MEMORY; OM_IO
OM_API OmStatus om_dds_motion_load(const char* path, const char* arm, OmDdsMotion* motion);
/// The same from memory; `name` stands for the file in messages.
/// @return as om_dds_motion_load, without OM_IO
OM_API OmStatus om_dds_motion_parse(const char* data, size_t size, const char* name,
                                    const char* arm, OmDdsMotion* motion);
OM_API void om_dds_motion_done(OmDdsMotion* motion);

// ---- programs that watch -------------------------------------------------------------------------------------------

typedef struct OmWatch OmWatch;

typedef struct OmWatchTool {
    const char* name;
    OmPose pose;  // pose_world_tool
} OmWatchTool;

/// Serve tools and the surface of a mesh by OpenIGTLink on TCP, 127.0.0.1, for 3D Slicer. One thread.
/// @param mesh  its boundary is copied
/// @return OM_OK; OM_IO (the port is taken); OM_NO_MEMORY
OM_API OmStatus om_watch_create(int port, const OmTetMesh* mesh, OmWatch** watch);
OM_API void om_watch_destroy(OmWatch* watch);
/// Is a message due, and does a program watch? At most 30 times a second of the wall clock.
OM_API bool om_watch_is_due(OmWatch* watch);
/// Send the tools, and with the first and every fifth message the surface. A program that reads slowly misses messages.
/// @param time  s, of the stamps
/// @param x     vertices of the mesh, m
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_watch_send(OmWatch* watch, double time, const OmWatchTool* tool, int ntool,
                              const double* x);

// ---- frames ---------------------------------------------------------------------------------------------------------

#define OM_DDS_MAX_FRAME 16
typedef struct OmDdsFrame {  // where a frame of the robot is
    char name[64];           // as in headers of messages: "PSM1_base", "ECM"
    OmPose pose_world_frame;
    int npoint;       // that it was found from
    double rms, max;  // m, of their residuals
} OmDdsFrame;

/// The frame that maps points touched by the robot onto the same points in the world, with the least squared residuals
/// (Arun, Huang & Blostein 1987).
/// @param x_frame  in the robot's frame, m   (n x 3)
/// @param x_world  in the world, m           (n x 3)
/// @param worst    index of the point with the largest residual
/// @return OM_OK; OM_INVALID (fewer than 4 points, one that is not finite, points within 5 mm of one line)
OM_API OmStatus om_dds_frame_fit(const double* x_frame, const double* x_world, int n,
                                 OmDdsFrame* frame, int* worst);
/// Read a file of frames, JSON, as omentum register writes it.
/// @return OM_OK; OM_INVALID (the message names the file and the field; more than OM_DDS_MAX_FRAME); OM_NO_MEMORY;
///         OM_IO
OM_API OmStatus om_dds_frames_load(const char* path, OmDdsFrame frame[OM_DDS_MAX_FRAME],
                                   int* nframe);
/// The same from memory; `name` stands for the file in messages.
/// @return as om_dds_frames_load, without OM_IO
OM_API OmStatus om_dds_frames_parse(const char* text, size_t size, const char* name,
                                    OmDdsFrame frame[OM_DDS_MAX_FRAME], int* nframe);
/// Write it whole.
/// @return OM_OK; OM_NO_MEMORY; OM_IO
OM_API OmStatus om_dds_frames_save(const OmDdsFrame* frame, int nframe, const char* path);

// ---- a robot as a world ----------------------------------------------------------------------------------------

typedef struct OmDdsWorldDef {
    OmCookie cookie;
    OmDdsDef dds;
    const OmScene* scene;  // arms, cameras; borrowed
    // Files of the dVRK (om_psm_load_instrument, om_psm_load_arm) for all arms; default null: by tool_type, which must
    // be a ProGrasp or a large needle driver, on a Classic arm
    const char *instrument_file, *arm_file;
    const OmDdsFrame* frame;  // before those of tf_static; borrowed   (nframe)
    int nframe;               // default 0
    double wait;              // s that the robot may take to answer; default 5
    double stale;             // s without a measured pose after which motion stops; default 0.1
    double max_speed;         // m/s, of commands; default 0.25
    double max_jump;          // m between two measured poses of an arm; default 0.02
    const OmSite* site;  // where the tissue is; borrowed; default null: tips may be sent anywhere
    double reach;        // m around the tissue that a tip may be sent to; default 0.15
    const char* arm
        [OM_MAX_ARM];  // names, at most 39 letters, digits, _ and /; borrowed; default "PSM1", "PSM2"
    // What the names of both cameras' topics begin with, as those of arms: endoscope/camera_info, depth/points; default
    // "endoscope", "depth"
    const char *endoscope, *depth;
} OmDdsWorldDef;

OM_API OmDdsWorldDef om_dds_world_default_def(const OmScene* scene);

/// A world behind the topics of a robot. It observes the depth camera's PointCloud2, or its depth image (without
/// colour) where there are no points, and the endoscope's picture where there is one; it knows no truth. Each advance
/// sends one goal of the straight motion by servo_cp. With a robot in lock-step the world's time stands still between
/// two advances (OmWorld.waits).
///
/// Motion stops, with an error that every later call repeats: a measured pose older than `stale`, or further than
/// `max_jump` from the last one; an arm that is not enabled and homed any more, or reports an error; a robot that is
/// gone.
/// @return OM_OK; OM_INVALID (a field); OM_UNAVAILABLE (a topic without an answer: the message names it and remedies);
///         OM_NO_MEMORY; OM_IO
OM_API OmStatus om_world_create_dds(const OmDdsWorldDef* def, OmWorld** world);

#ifdef __cplusplus
}
#endif
#endif
