/// omentum/world_series.h: a recorded series, a folder of pictures and poses (floor 4).
///
/// A series is what cameras and arms of any world measured: `series.yaml` with the camera's intrinsics, and for each
/// frame its time, the camera's pose, the arms, and the names of PNG files beside it: colour with depth of the same
/// pixels, or the left and the right picture of a stereo endoscope. A frame is read as the observation of a world.
///
///     OmSeries series;
///     om_series_load("out/run/series", &series);
///     OmObservation obs = {0};
///     for (int i = 0; i < series.nframe; ++i) om_series_get_frame(&series, i, NULL, &obs);
///     om_observation_done(&obs);
///     om_series_done(&series);
///
/// Recording: om_series_begin(dir, &camera, &series), om_series_append(&series, &obs) after each observation.
#ifndef OMENTUM_WORLD_SERIES_H
#define OMENTUM_WORLD_SERIES_H

#include "omentum/sense_stereo.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_SERIES_FILE 128   // bytes of a file's name
#define OM_SERIES_MAX 10000  // frames

typedef struct OmSeriesFrame {
    double time;                 // s, of the exposure; grows from frame to frame
    OmPose pose_world_camera;    // of the camera, or of the left one
    char color[OM_SERIES_FILE];  // PNG, or "": none
    char depth[OM_SERIES_FILE];  // 16-bit grey PNG in units of depth_unit, 0: no return; "": none
    char right[OM_SERIES_FILE];  // PNG of the right camera; "": none
    int narm;                    //
    OmArmObservation arm[OM_MAX_ARM];  // tip, q, jaw and times; other fields are 0
} OmSeriesFrame;

typedef struct OmSeries {     // om_series_done frees
    char dir[OM_SCENE_PATH];  // the folder
    OmCamera camera;          // intrinsics of all frames; the pose is that of a frame
    bool has_right;           // the right camera of a stereo endoscope
    OmCamera right;           // its pose is in the frame of the left camera
    double depth_unit;        // m a count of a depth picture; default 0.1 mm
    int nframe;               //
    int capacity;             // of frame, while a series is recorded; 0: it was read
    OmSeriesFrame* frame;     // (nframe)
} OmSeries;

/// Read DIR/series.yaml (or the file, if the path ends in .yaml) and check all of it but the pictures. Pixels are
/// counted as OpenCV and ROS do: the centre of the first pixel is (0, 0).
/// @return OM_OK; OM_INVALID (the message names file, line, key and remedy); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_series_load(const char* path, OmSeries* series);
/// The same from memory; `name` stands for the file in messages, `dir` is the folder of the pictures.
/// @return OM_OK; OM_INVALID (the message names file, line, key and remedy); OM_NO_MEMORY
OM_API OmStatus om_series_parse(const char* text, size_t size, const char* name, const char* dir,
                                OmSeries* series);
OM_API void om_series_done(OmSeries* series);

/// Read the pictures of a frame as an observation: `rgbd` has depth and colour. A frame with a right picture gets its
/// depth by om_stereo_depth; one with colour alone gets it in `endoscope`. What the observation held is freed.
/// @param stereo  null: om_stereo_default_def
/// @return OM_OK; OM_INVALID (no such frame, a damaged picture, or one of another size: the message names the file);
///         OM_NO_MEMORY; OM_IO (a picture that is missing)
OM_API OmStatus om_series_get_frame(const OmSeries* series, int i, const OmStereoDef* stereo,
                                    OmObservation* observation);

/// Begin a new series in `dir`, which is made; a series.yaml that is there is refused.
/// @param right  of a stereo endoscope, its pose in the frame of the left camera; null: none
/// @return OM_OK; OM_INVALID (a camera out of range, or `dir` holds a series); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_series_begin(const char* dir, const OmCamera* camera, const OmCamera* right,
                                OmSeries* series);
/// Append what an observation has in `rgbd`, depth and colour, with its arms. Pictures are written first; then
/// series.yaml replaces the old one as a whole, so a killed recorder leaves a series that can be read. Depth beyond
/// 65,535 units is written as no return.
/// @return OM_OK; OM_INVALID (no depth, another camera, a time that does not grow, OM_SERIES_MAX frames, or a value
///         that om_series_load would refuse); OM_NO_MEMORY; OM_IO
OM_API OmStatus om_series_append(OmSeries* series, const OmObservation* observation);
/// Append the two pictures of a stereo endoscope; the left one has the pose `pose_world_camera`. Arms are those of
/// `observation`, which may be null.
/// @return as om_series_append
OM_API OmStatus om_series_append_stereo(OmSeries* series, double time, OmPose pose_world_camera,
                                        const OmPicture* left, const OmPicture* right,
                                        const OmObservation* observation);

#ifdef __cplusplus
}
#endif
#endif
