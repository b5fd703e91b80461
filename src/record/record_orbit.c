// record_orbit.c: orbit.png, an animated picture of the end of a run.
//
// The camera stands where the endoscope does, a quarter nearer, and goes once round it on a cone about the point that
// the endoscope looks at: ASIDE about the vertical, ABOVE up and down. It begins above, where what is exposed is seen
// best, and the end meets the begin. The lowest bits of each colour are dropped: that halves the file, and is not seen.
#include "record/record_internal.h"

enum { WIDTH = 400, HEIGHT = 300 };
#define TURN 5.0                    // s, once round
#define NEARER 0.75                 // of the endoscope's distance
#define ASIDE (32 * OM_PI / 180.0)  // rad
#define ABOVE (12 * OM_PI / 180.0)  // rad

// The camera at a share of its way, 0 to 1.
static OmCamera place(const OmRecorder* rec, double share) {
    const OmScene* scene = rec->def.scene;
    const OmSite* site = om_body_site(rec->shown);
    const OmCamera endoscope = om_world_endoscope(scene, site);
    OmCamera camera = om_camera_resize(&endoscope, WIDTH, HEIGHT);
    OmPose* pose = &camera.pose_world_camera;
    const OmVec3 ahead = om_quat_rotate(pose->q, om_vec3(0, 0, 1));
    const OmVec3 right = om_quat_rotate(pose->q, om_vec3(1, 0, 0));
    const OmVec3 up = om_quat_rotate(site->pose_world_field.q, om_vec3(0, 0, 1));
    const OmVec3 target = om_madd(pose->p, scene->endoscope.distance, ahead);
    const double angle = OM_PI + 2 * OM_PI * share;
    const OmQuat turn = om_quat_mul(om_quat_axis_angle(up, ASIDE * sin(angle)),
                                    om_quat_axis_angle(right, -ABOVE * cos(angle)));
    pose->q = om_quat_mul(turn, pose->q);
    pose->p = om_madd(target, -NEARER * scene->endoscope.distance, om_quat_rotate(turn, ahead));
    return camera;
}

static OmStatus take(const OmRecorder* rec, int n, OmPicture* picture) {
    for (int k = 0; k < n; ++k) {
        const OmCamera camera = place(rec, (double)k / n);
        OM_TRY(om_world_render_from(rec->def.world, &camera, &picture[k]));
        for (int i = 0; i < 3 * WIDTH * HEIGHT; ++i)
            picture[k].pixel[i] = (unsigned char)(picture[k].pixel[i] & 0xf8);
    }
    return OM_OK;
}

OmStatus om__record_orbit(const OmRecorder* rec) {
    const int n = rec->def.orbit;
    char path[1200];
    if (n == 0 || !om_world_truth(rec->def.world)) return OM_OK;
    OmStatus status = OM_OK;
    OmText text = {0};
    OmPicture* picture = NULL;
    OM_CALLOC_DONE(picture, (size_t)n);
    OM_TRY_DONE(take(rec, n, picture));
    OM_TRY_DONE(om_picture_encode_apng(picture, n, TURN / n, &text));
    OM_TRY_DONE(om_path_join(rec->folder.path, "orbit.png", path, sizeof path));
    OM_TRY_DONE(om_file_write(path, text.str, text.len));
done:
    for (int k = 0; k < n && picture; ++k) om_picture_done(&picture[k]);
    om_free(picture);
    om_text_done(&text);
    return status;
}
