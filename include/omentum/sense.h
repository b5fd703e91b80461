/// omentum/sense.h: pictures and depth of a scene of triangles, by ray casting (floor 3).
///
/// An endoscope gives shaded pictures, a depth camera gives depth with range-dependent noise and
/// partial point clouds with normals, and both respect occlusion. No display and no graphics card.
///
///     OmSenseScene* scene;
///     om_sense_scene_create(&scene);
///     om_sense_scene_add(scene, &tissue, &look, &id);
///     om_sense_scene_update(scene, id, x);            // moved vertices; then
///     om_sense_scene_commit(scene);
///     om_sense_render(scene, &camera, &options, &picture);
#ifndef OMENTUM_SENSE_H
#define OMENTUM_SENSE_H

#include "omentum/image.h"
#include "omentum/shape.h"
#include "omentum/vec.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Intrinsics of a calibrated camera, px, and distortion of Brown and Conrady in the model and order of OpenCV (ROS:
/// "plumb_bob"): k1 k2 p1 p2 k3. All zero: an ideal pinhole of the camera's fov, square pixels, principal point in the
/// middle. The centre of the first pixel is (0.5, 0.5); OpenCV and ROS count it as (0, 0), so that cx and cy are theirs
/// plus 0.5.
typedef struct OmLens {
    double fx, fy;      // focal lengths; both 0: from fov
    double cx, cy;      // principal point; both 0: the middle of the picture
    double k1, k2;      // radial
    double p1, p2, k3;  // tangential; radial
} OmLens;

/// Camera: z forward, x right, y down in its frame.
typedef struct OmCamera {
    OmPose pose_world_camera;
    int width, height;     // pixels, 1 to 8192
    double fov;            // vertical, rad, in (0, pi); not used where lens.fx is given
    double near_m, far_m;  // range of depth along z, m
    OmLens lens;
} OmCamera;

/// A part of a camera's picture.
typedef struct OmWindow {
    int column, row;    // of its first pixel
    int width, height;  // pixels; width 0: the whole picture
} OmWindow;
/// The part of the window that lies in a picture of this size. A window of width 0 is the whole picture; width and
/// height of the outcome are 0 where nothing lies in it.
OM_API OmWindow om_window_clip(OmWindow window, int width, int height);

/// Check all fields. A lens must have a ray for every point of the picture: a distortion that folds it has none.
/// @return OM_OK; OM_INVALID (the message names the field)
OM_API OmStatus om_camera_check(const OmCamera* camera);
/// The camera's lens with focal lengths and principal point written out, also those of an ideal pinhole.
OM_API OmLens om_camera_lens(const OmCamera* camera);
/// The same view at another size: focal lengths and principal point scale with the height.
OM_API OmCamera om_camera_resize(const OmCamera* camera, int width, int height);
/// Pixel coordinates (pixel centres at .5) of a point; false if it is not in front of the camera, or outside of the
/// disc around the axis in which the distortion is one to one.
OM_API bool om_camera_project(const OmCamera* camera, OmVec3 p_world, double* u, double* v);
/// Unit direction in the world of the ray through pixel coordinates (u, v); zero where the lens has none. A camera that
/// om_camera_check accepts has one everywhere in its picture.
OM_API OmVec3 om_camera_ray(const OmCamera* camera, double u, double v);

/// Solid textures. They move with the material: positions at om_sense_scene_add are the texture coordinates.
typedef enum OmSenseTexture {
    OM_TEXTURE_NONE,
    OM_TEXTURE_FAT,    // lobules of 5 mm between septa
    OM_TEXTURE_ORGAN,  // fine mottling and vessels
    OM_TEXTURE_STEEL,  // brushed along z of the positions when added
    OM_NTEXTURE
} OmSenseTexture;

typedef struct OmSenseLook {
    double red, green, blue;  // 0 to 1, linear light
    double gloss;             // strength of highlights, 0 to 1: 1 is wet
    double metal;             // 0 to 1: highlights take the colour, diffuse light vanishes
    // if smooth: cosine below which a corner keeps the triangle's normal; 0: none does
    double crease;
    bool is_smooth;   // normals of vertices, not of triangles
    bool is_checker;  // squares of 10 mm in two shades, for boards
    OmSenseTexture texture;
} OmSenseLook;

typedef enum OmSensePart {
    OM_PART_TISSUE,
    OM_PART_ORGAN,
    OM_PART_ROI,
    OM_PART_HELD,  // attachments
    OM_PART_BOARD,
    OM_PART_TOOL,   // wrist and jaws
    OM_PART_SHAFT,  // of a tool
    OM_NPART
} OmSensePart;
/// The look of a part in the pictures of omentum: colours that differ for colour-blind eyes, too.
OM_API OmSenseLook om_sense_look(OmSensePart part);

/// Colours for segmentation. In a picture of om_sense_render, 98 % or more of the pixels of a part are in its range
/// (test_sense_segment), and no colour is in the ranges of two parts; tools and their shafts share one.
///
/// | part    | hue, degrees | saturation   | value        |
/// |---------|--------------|--------------|--------------|
/// | tissue  | 20 to 62     | 0.22 to 1    | 0.10 to 1    |
/// | organ   | 340 to 20    | 0.22 to 1    | 0.10 to 1    |
/// | ROI     | 280 to 340   | 0.22 to 1    | 0.10 to 1    |
/// | held    | 210 to 280   | 0.22 to 1    | 0.02 to 1    |
/// | board   | 120 to 210   | 0.22 to 1    | 0.10 to 1    |
/// | tool    | any          | 0 to 0.22    | 0.02 to 1    |
/// | nothing | 120 to 210   | 0.22 to 1    | 0 to 0.10    |
typedef struct OmSenseRange {
    // degrees; min belongs to the range, max does not; 340 to 20 is over 0
    double hue_min, hue_max;
    double saturation_min, saturation_max;  // 0 to 1
    double value_min, value_max;            // 0 to 1
} OmSenseRange;
OM_API OmSenseRange om_sense_range(OmSensePart part);
/// Hue (degrees, 0 for grey), saturation and value of a pixel of a picture.
OM_API void om_sense_hsv(const unsigned char rgb[3], double hsv[3]);
/// Whether a colour (hue, saturation, value) is in a range.
OM_API bool om_sense_range_has(const OmSenseRange* range, const double hsv[3]);
/// The part in whose range a pixel's colour is (OM_PART_TOOL for shafts, too); OM_NPART if none.
OM_API OmSensePart om_sense_part_of(const unsigned char rgb[3]);

typedef struct OmSenseScene OmSenseScene;
/// An empty scene.
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree cannot start)
OM_API OmStatus om_sense_scene_create(OmSenseScene** scene);
OM_API void om_sense_scene_destroy(OmSenseScene* scene);
/// Add triangles (copied). `id` counts from 0 in order of adding.
/// @return OM_OK; OM_INVALID (an empty surface); OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_sense_scene_add(OmSenseScene* scene, const OmSurface* surface,
                                   const OmSenseLook* look, int* id);
/// New vertex positions of an object: `x` holds those of all its vertices (nvert x 3), or, when `vert` is not
/// null, vertex i of the object is vert[i] of x.
OM_API void om_sense_scene_update(OmSenseScene* scene, int id, const double* x, const int* vert);
OM_API void om_sense_scene_show(OmSenseScene* scene, int id, bool is_shown);
/// Call this after changes and before rendering.
/// @return OM_OK; OM_NO_MEMORY; OM_UNAVAILABLE (Embree failed)
OM_API OmStatus om_sense_scene_commit(OmSenseScene* scene);

typedef struct OmSenseOptions {
    int samples;      // rays a pixel along each side, 1 to 4: antialiasing
    bool has_shadow;  // one shadow ray a sample
    int nworker;      // 0: one a processor; the picture does not depend on it
    // The part to render; default: the whole picture. Its pixels are those of the whole picture, to the last bit if
    // `column` is a multiple of 8.
    OmWindow window;
} OmSenseOptions;
OM_API OmSenseOptions om_sense_options_default(void);

/// Shaded picture (RGB). Exposure is set for the middle of the object that was added first. `picture` is made by the
/// caller with om_picture_init(width, height, 3), of the size of the camera's picture or of the window.
/// @return OM_OK; OM_INVALID (camera, samples or window out of range, a picture of another size)
OM_API OmStatus om_sense_render(const OmSenseScene* scene, const OmCamera* camera,
                                const OmSenseOptions* options, OmPicture* picture);

/// Depth along z of the camera, m, 0 where nothing is in range; object ids (-1 none) and unit normals towards
/// the camera if their pointers are not null.
/// @return OM_OK; OM_INVALID (a camera out of range)
OM_API OmStatus om_sense_depth(const OmSenseScene* scene, const OmCamera* camera, int nworker,
                               float* depth, int* id, float* normal);

/// As om_sense_depth, with the triangle of the object that each pixel shows in place of its normal (-1 none).
/// @return OM_OK; OM_INVALID (a camera out of range)
OM_API OmStatus om_sense_triangles(const OmSenseScene* scene, const OmCamera* camera, int nworker,
                                   float* depth, int* id, int* tri);

typedef struct OmDepthPicture {  // of a depth camera
    double time;                 // s, of the exposure
    OmCamera camera;             // intrinsics and pose
    // m along the camera's z; 0, NaN or infinite: no return  (height x width); null: not observed
    float* depth;
    OmPicture color;  // RGB of the same pixels; empty: not observed
} OmDepthPicture;

/// Noise of a structured-light or stereo camera: sigma = a + b z^2. Pixels have no depth where the cosine between ray
/// and surface normal is below `min_grazing`, and at random with probability `dropout`.
typedef struct OmDepthNoise {
    double a, b;         // m and 1/m
    double min_grazing;  // 0 to 1
    double dropout;      // 0 to 1
    uint64_t seed;
    int nworker;  // 0: one a processor; the noise does not depend on it
} OmDepthNoise;
/// Similar to a RealSense D435: 0.2 mm, and 1.5 mm more at one metre.
OM_API OmDepthNoise om_depth_noise_default(uint64_t seed);
/// Apply noise in place. Each pixel of each frame (below 2^38) has its own random stream, so any frame can be made
/// alone.
OM_API void om_depth_add_noise(const OmDepthNoise* noise, const OmCamera* camera, uint64_t frame,
                               const float* normal, float* depth);

/// Points of the pixels whose object is `only` (-1: all): positions and normals in the world (n x 3 each,
/// room for width * height; `normal_out` may be null together with `normal`). Returns n. A pixel whose depth is not
/// above 0 or not finite gives no point.
OM_API int om_depth_to_cloud(const OmCamera* camera, const float* depth, const int* id,
                             const float* normal, int only, double* x, double* normal_out);

/// Counts of sample points of a region: seen by the camera, or the reason why not. Each point is counted once:
/// npoint = nseen + naway + noutside + nhidden.
typedef struct OmVisibility {
    int npoint;    // of the region
    int nseen;     // seen
    int naway;     // their normal points away from the camera
    int noutside;  // facing it, outside its picture
    int nhidden;   // in its picture, behind something
} OmVisibility;

/// Objects in `ignore` (a bit each, ids below 64) do not occlude: the region itself. `normal` may be null.
/// @return OM_OK; OM_INVALID (a camera out of range)
OM_API OmStatus om_sense_count_visible(const OmSenseScene* scene, const OmCamera* camera,
                                       const double* x, const double* normal, int npoint,
                                       uint64_t ignore, OmVisibility* visibility);
/// Fraction of all sample points that the camera sees (6.5.2): a point that faces away or lies outside the
/// picture is not seen, and counts in the denominator.
/// @return OM_OK; OM_INVALID (a camera out of range)
OM_API OmStatus om_sense_visibility(const OmSenseScene* scene, const OmCamera* camera,
                                    const double* x, const double* normal, int npoint,
                                    uint64_t ignore, double* share);

#ifdef __cplusplus
}
#endif
#endif
