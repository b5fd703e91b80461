/// omentum/match_acquisition.h: files of acquisitions: a cloud, its camera, the tools (room `match`, floor 5).
///
/// An acquisition is what an update of the twin needs from one moment: a scan, and the pose of each tool when its jaw
/// closed and now. Its file is YAML and names the file of a cloud, or a frame of a recorded series of pictures
/// (world_series.h); om_acquisition_print_example shows every key. Positions are millimetres in the world, RAS for a
/// patient.
///
///     OmAcquisitionFile file;
///     OmAcquisition acquisition;
///     om_acquisition_load("lift.yaml", &site, &file, &acquisition);
///     if (file.registered != OM_REGISTERED_YES) ... om_scan_register, om_acquisition_move ...
///     om_acquisition_done(&acquisition);
#ifndef OMENTUM_MATCH_ACQUISITION_H
#define OMENTUM_MATCH_ACQUISITION_H

#include "omentum/match.h"
#include "omentum/shape_file.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum OmRegistered {  // is the cloud in the frame of the model?
    OM_REGISTERED_YES,
    OM_REGISTERED_ROUGHLY,  // up to 30 degrees and 30 mm off
    OM_REGISTERED_NO        // in any frame
} OmRegistered;

typedef struct OmAcquisitionFile {  // the keys of a file, in SI
    char path[512];                 // of the file, for messages
    char cloud[512];                // relative to the folder of the file; "": a frame of a series
    char series[512];               // the same; "": none
    char rest[512];                 // cloud of the tissue before the tools moved it; "": none
    int frame_index;                // of the series, from 0
    int rest_frame;  // of the series; -1 (default): the first grasp_frame, when the jaw closed; none: no such tool
    int grasp_frame[OM_MAX_ARM];  // frame in which the jaw closed; -1: `grasp` has the poses
    OmMeshFrame frame;            // of the cloud; zero: as the cloud says, else millimetres and RAS
    int registered;               // OmRegistered; default OM_REGISTERED_YES
    double time;                  // s; default 0
    double noise;                 // m, of a point along its ray; default 0: not known
    bool has_camera;
    OmCamera camera;
    int ngrasp;
    OmMatchGrasp grasp[OM_MAX_ARM];  // nvert is 0
} OmAcquisitionFile;

/// Read the keys from memory; `name` stands for the file in messages.
/// @return OM_OK; OM_INVALID (the message names line, key and remedy); OM_NO_MEMORY
OM_API OmStatus om_acquisition_parse(const char* text, size_t size, const char* name,
                                     OmAcquisitionFile* file);
/// Read a file, and its cloud or pictures. Pictures become a scan by om_scan_from_observation.
/// @param site  of role OM_SITE_TWIN, to find the tissue in pictures; null: files with a series are refused
/// @param file  may be null
/// @return OM_OK; OM_INVALID (the message names file, line and key); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_acquisition_load(const char* path, const OmSite* site, OmAcquisitionFile* file,
                                    OmAcquisition* acquisition);
/// Write `path`, and the clouds beside it as .ply. Vertices of a grasp and `x_twin` are not written.
/// @return OM_OK; OM_INVALID (a path that does not end in .yaml, or is too long); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_acquisition_save(const OmAcquisition* acquisition, const char* path);
/// Free what om_acquisition_load made: the scan and the scan at rest.
OM_API void om_acquisition_done(OmAcquisition* acquisition);
/// Move scan, camera, tools and owned_rest to another frame; `x_twin` stays, and a borrowed `rest`.
OM_API void om_acquisition_move(OmAcquisition* acquisition, OmPose pose_new_old);
/// Append a complete file with the meaning of every key.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_acquisition_print_example(OmText* text);

#ifdef __cplusplus
}
#endif
#endif
