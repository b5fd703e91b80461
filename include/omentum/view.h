/// omentum/view.h: what a person watches in a browser (floor 5): messages of a scene in motion, and a page that plays
/// them.
///
/// A view makes binary messages: the scene once, then a frame whenever something moved. The page draws them from one
/// file that holds everything (om_view_page_save). Nothing is loaded from a network.
///
///     OmView3dDef def = om_view3d_default_def(&scene, body);
///     OmView3d* view;
///     om_view3d_create(&def, &view);
///     om_view3d_add_scene(view, &page.messages);
///     ...                                                   // in each tenth of a second
///     om_view3d_add_frame(view, &now, &page.messages);
///     om_view_page_save(&page, "view.html");
///     om_view3d_destroy(view);
///
/// Messages are little endian: u32 length in bytes, u32 kind, then what the table has, padded to a multiple of 4.
/// Lengths are in m, in the world frame.
///
/// | kind     | content                                                                                          |
/// |----------|--------------------------------------------------------------------------------------------------|
/// | 1 scene  | u32 length of the JSON; the JSON, padded; of each part f32 x (nvert x 3), u32 tri (ntri x 3)     |
/// | 2 frame  | u32 number; f64 time, s; f32 visibility, force, true force, mu, height; u32 warning state; u32 n |
/// |          | of the n parts that moved: u32 part, nvert; f32 lo (3), size (3) of its box; u16 x (nvert x 3),  |
/// |          | 65535 to a size, padded; u32 fields: 1 stress, 2 contact force; of each: f32 largest, Pa or N;   |
/// |          | u8 (nvert), 255 to it, padded                                                                    |
/// | 3 points | u32 OmViewPoints; u32 n; f32 x (n x 3)                                                           |
/// | 4 frame  | as 2, in pages: x and fields are differences from the part's last ones, if the box is the same   |
/// | 5 chance | u32 nvert of the tissue; u8 (nvert), padded: probability of attachment, 255 to 1                 |
///
/// JSON: title, parts (name, kind, nvert, ntri), endoscope (position, quaternion, fov_y_deg, aspect), task (position,
/// quaternion, half_size, has_ground), region (center, radius; of one on an organ), grid, force_threshold_n,
/// visibility.
#ifndef OMENTUM_VIEW_H
#define OMENTUM_VIEW_H

#include "omentum/body.h"
#include "omentum/scan.h"
#include "omentum/world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct OmView3dDef {
    OmCookie cookie;
    const OmScene* scene;  // borrowed, as all below
    OmBody* body;          // whose tissue, organ and region of interest are drawn
    OmWorld* world;        // whose tools are drawn; default null: none
    // A surface that the caller moves, drawn as a tool; one with all vertices in one place is not seen. Default null.
    const OmSurface* probe;
    // frames have the von Mises stress and the force of contact, if the engine has them; default true
    bool has_stress;
    // A frame has every part that moved since the scene, not since the last frame, as a client may miss some, and
    // stress and contact of at most five frames before; default false.
    bool is_live;
} OmView3dDef;

OM_API OmView3dDef om_view3d_default_def(const OmScene* scene, OmBody* body);

typedef struct OmViewNow {      // numbers of a frame; NAN: not known
    double time;                // s
    double visibility;          // of the region of interest, 0 to 1
    double force, force_world;  // N, by the twin, in the truth
    double mu, height;          // m
    int warning;                // state of Alg. 5, 0 to 3
} OmViewNow;

typedef enum OmViewPoints {
    OM_VIEW_BELIEVED,  // attachments
    OM_VIEW_TRUE,      // the same
    OM_VIEW_MEASURED   // by the depth camera
} OmViewPoints;

typedef struct OmView3d OmView3d;
/// @return OM_OK; OM_INVALID (a field); OM_NO_MEMORY
OM_API OmStatus om_view3d_create(const OmView3dDef* def, OmView3d** view);
OM_API void om_view3d_destroy(OmView3d* view);
/// Append the message of the scene: parts and where they are now.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view3d_add_scene(OmView3d* view, OmText* messages);
/// Append a frame: the parts that moved since the last one.
/// @return OM_OK; OM_NO_MEMORY; as om_body_get_measure
OM_API OmStatus om_view3d_add_frame(OmView3d* view, const OmViewNow* now, OmText* messages);
/// Have the stress and contact of this moment in the next live frame.
OM_API void om_view3d_want_stress(OmView3d* view);
/// Append attached vertices of a body as points where they are held: at their rest positions. A twin that learns of an
/// attachment may have dragged its vertex elsewhere.
/// @param attached  as om_body_attached
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view3d_add_points(const OmBody* body, const unsigned char* attached,
                                     OmViewPoints kind, OmText* messages);

#define OM_VIEW_MAX_CLOUD 2000
/// Append points that are measured, at most OM_VIEW_MAX_CLOUD of them, evenly chosen.
/// @param x  m, world frame  (n x 3)
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view3d_add_cloud(int n, const double* x, OmText* messages);
/// Append how likely the tissue is attached, as an estimate on a body of the scene has it. The drawn tissue may have
/// another mesh: each of its vertices gets the value of the nearest one of the body's underside, both at rest, so that
/// one sees from above what lies below.
/// @param probability  0 to 1, of the vertices of the body's site  (nvert)
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view3d_add_chances(OmView3d* view, const OmBody* body, const double* probability,
                                      OmText* messages);

typedef struct OmViewPage {  // a recording; zero-initialise, om_view_page_done frees
    const char* title;       // borrowed, as `story` and `back`
    const char* story;       // lines of JSON as of an audit (record_audit.h); null: none
    const char* back;        // where its link leads, such as "report.html"; null: none
    OmText messages;
    OmText pictures;  // by om_view_page_add_picture
} OmViewPage;

/// Append a picture of the endoscope as JSON: time_s, caption, png (base64).
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view_add_picture(double time, const char* caption, const OmPicture* picture,
                                    OmText* text);
/// Append the depth picture of a scan as JSON, as above with "depth": true, and its camera: white is near. Nothing is
/// appended for a scan without depth or camera.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view_add_depth(double time, const OmScan* scan, OmText* text);
/// A picture of the endoscope at a time of the recording.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view_page_add_picture(OmViewPage* page, double time, const char* caption,
                                         const OmPicture* picture);
/// The same of a depth picture.
/// @return OM_OK; OM_NO_MEMORY
OM_API OmStatus om_view_page_add_depth(OmViewPage* page, double time, const OmScan* scan);
/// Write the page: one file with everything in it, replaced whole.
/// @return OM_OK; OM_INVALID (a message that is not whole); OM_IO; OM_NO_MEMORY
OM_API OmStatus om_view_page_save(const OmViewPage* page, const char* path);
OM_API void om_view_page_done(OmViewPage* page);

#ifdef __cplusplus
}
#endif
#endif
