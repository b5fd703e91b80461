// test_view.c: messages of a view, decoded here a second time; the page holds them and nothing that ends a script.
#include <string.h>
#include <zlib.h>

#include "easy_scene.h"
#include "omentum/image.h"
#include "omentum/shape.h"
#include "omentum/view.h"
#include "test_alloc.h"
#include "test_folder.h"

typedef struct Field {
    OmScene scene;
    OmSite site;
    OmBody* body;
    OmView3d* view;
} Field;

static OmStatus open_field(Field* f) {
    *f = (Field){.scene = easy_scene()};
    f->scene.tissue.cells = om_vec3(4, 4, 1);
    OM_TRY(om_site_build(&f->scene, OM_SITE_TWIN, NULL, &f->site));
    OM_TRY(om_body_create(&f->scene, &f->site, 1, &f->body));
    const OmView3dDef def = om_view3d_default_def(&f->scene, f->body);
    return om_view3d_create(&def, &f->view);
}

static void close_field(Field* f) {
    om_view3d_destroy(f->view);
    om_body_destroy(f->body);
    om_site_done(&f->site);
}

// ---- a second reader ----------------------------------------------------------------------------------------

static uint32_t u32(const char* at) {
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}
static float f32(const char* at) {
    float value;
    memcpy(&value, at, sizeof value);
    return value;
}
static double f64(const char* at) {
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

// The k-th message: where its kind stands. Null: there are not so many.
static const char* find_message(const OmText* t, int k, size_t* size) {
    size_t at = 0;
    for (int i = 0; at + 4 <= t->len; ++i) {
        *size = u32(t->str + at);
        assert_true(*size % 4 == 0 && at + 4 + *size <= t->len);
        if (i == k) return t->str + at + 4;
        at += 4 + *size;
    }
    assert_int_equal(at, t->len);
    return NULL;
}

static int nvert_of(const char* json, int part) {
    const char* at = strstr(json, "\"parts\"");
    for (int k = 0; k <= part; ++k) at = strstr(at + 1, "\"nvert\"");
    return atoi(strchr(at, ':') + 1);
}

static int value_of(char c) {
    const char* const digit = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* at = c ? strchr(digit, c) : NULL;
    return at ? (int)(at - digit) : -1;
}

// The bytes between two texts of a page, from base64.
static size_t decode(const char* from, char* bytes) {
    size_t n = 0;
    unsigned bits = 0;
    int nbit = 0;
    for (; value_of(*from) >= 0; ++from) {
        bits = bits << 6 | (unsigned)value_of(*from);
        nbit += 6;
        if (nbit >= 8) bytes[n++] = (char)(bits >> (nbit -= 8));
    }
    return n;
}

// ---- messages -----------------------------------------------------------------------------------------------

static void frames_hold_where_the_tissue_is(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    size_t size;
    const OmViewNow now = {1.25, 0.5, 0.25, NAN, 0.002, 0.01, 2};
    OmSurface surface;
    int* vert;
    assert_ok(open_field(&f));
    assert_ok(om_view3d_add_scene(f.view, &t));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));  // nothing has moved
    OmBodyReport report;
    int nheld;
    const OmPose tip = om_pose_mul(f.site.pose_world_task,
                                   (OmPose){om_vec3(-0.05, -0.05, 0.005), om_pose_identity().q});
    OmPose up = tip;
    up.p = om_add(up.p, om_quat_rotate(f.site.pose_world_task.q, om_vec3(0, 0, 0.03)));
    assert_ok(om_body_grasp(f.body, 0, tip, 0.02, &nheld));
    assert_true(nheld > 0);
    assert_ok(om_body_move(f.body, 0, up));
    for (int i = 0; i < 3; ++i) assert_true(om_body_step(f.body, 0.02, &report) >= 0);
    assert_ok(om_view3d_add_frame(f.view, &now, &t));

    const char* scene = find_message(&t, 0, &size);
    assert_int_equal(u32(scene), 1);
    assert_ok(om_tet_mesh_boundary(om_body_mesh(f.body), &surface, &vert));
    assert_int_equal(nvert_of(scene + 8, 0), surface.nvert);
    const char* x0 = scene + 8 + (u32(scene + 4) + 3) / 4 * 4;
    for (int i = 0; i < surface.nvert; ++i)  // at the beginning
        for (int k = 0; k < 3; ++k)
            assert_near(f32(x0 + 4 * (3 * i + k)), surface.x[3 * i + k], 1e-7);

    const char* still = find_message(&t, 2, &size);
    assert_int_equal(u32(still), 2);
    assert_int_equal(u32(still + 4), 1);
    assert_int_equal(u32(still + 40), 0);

    const char* frame = find_message(&t, 3, &size);
    assert_near(f64(frame + 8), 1.25, 0);
    assert_near(f32(frame + 16), 0.5, 0);
    assert_near(f32(frame + 20), 0.25, 0);
    assert_true(isnan(f32(frame + 24)));
    assert_near(f32(frame + 28), 0.002, 1e-9);
    assert_int_equal(u32(frame + 36), 2);
    assert_int_equal(u32(frame + 40), 1);  // the region of interest has not moved
    assert_int_equal(u32(frame + 44), 0);  // the tissue
    assert_int_equal(u32(frame + 48), surface.nvert);
    const double* x = om_body_x(f.body);
    double most = 0, moved = 0;
    for (int i = 0; i < 3 * surface.nvert; ++i) {
        const double lo = f32(frame + 52 + 4 * (i % 3)), box = f32(frame + 64 + 4 * (i % 3));
        uint16_t q;
        memcpy(&q, frame + 76 + 2 * i, sizeof q);
        const double is = x[3 * vert[i / 3] + i % 3];
        most = fmax(most, fabs(lo + box * q / 65535 - is));
        moved = fmax(moved, fabs(is - surface.x[i]));
    }
    assert_true(moved > 0.01);
    assert_true(most < 1e-5);
    assert_null(find_message(&t, 4, &size));
    om_text_done(&t);
    om_surface_done(&surface);
    om_free(vert);
    close_field(&f);
}

// The k-th message is a frame: the parts that it has, and the most that its tissue is away from the body's.
static uint32_t check_frame(const OmText* t, int k, const Field* f, double* most) {
    size_t size;
    OmSurface surface;
    int* vert;
    const char* m = find_message(t, k, &size);
    assert_int_equal(u32(m), 2);
    *most = 0;
    if (u32(m + 40) == 0) return 0;
    assert_int_equal(u32(m + 44), 0);
    assert_ok(om_tet_mesh_boundary(om_body_mesh(f->body), &surface, &vert));
    for (int i = 0; i < 3 * surface.nvert; ++i) {
        const double lo = f32(m + 52 + 4 * (i % 3)), box = f32(m + 64 + 4 * (i % 3));
        uint16_t q;
        memcpy(&q, m + 76 + 2 * i, sizeof q);
        *most =
            fmax(*most, fabs(lo + box * q / 65535 - om_body_x(f->body)[3 * vert[i / 3] + i % 3]));
    }
    om_surface_done(&surface);
    om_free(vert);
    return u32(m + 40);
}

// A live client that missed a frame has all in the next one; tissue that leaves its box gets a larger one.
static void live_frames_are_whole(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    const OmViewNow now = {0};
    OmBodyReport report;
    double most;
    int nheld;
    assert_ok(open_field(&f));
    om_view3d_destroy(f.view);
    OmView3dDef def = om_view3d_default_def(&f.scene, f.body);
    def.is_live = true;
    assert_ok(om_view3d_create(&def, &f.view));
    assert_ok(om_view3d_add_scene(f.view, &t));
    OmPose tip = om_pose_mul(f.site.pose_world_task,
                             (OmPose){om_vec3(-0.05, -0.05, 0.005), om_pose_identity().q});
    assert_ok(om_body_grasp(f.body, 0, tip, 0.02, &nheld));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    assert_true(check_frame(&t, 1, &f, &most) > 1);      // the first has every part
    assert_int_equal(check_frame(&t, 2, &f, &most), 0);  // nothing has moved yet
    for (int k = 0; k < 60; ++k) {
        tip.p = om_add(tip.p, om_quat_rotate(f.site.pose_world_task.q, om_vec3(0, 0, 0.004)));
        assert_ok(om_body_move(f.body, 0, tip));
        assert_true(om_body_step(f.body, 0.02, &report) >= 0);
    }
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    for (int k = 3; k < 5; ++k) {  // 240 mm higher, and again without a motion
        assert_int_equal(check_frame(&t, k, &f, &most), 1);
        assert_true(most < 1e-5);
    }
    om_text_done(&t);
    close_field(&f);
}

// A byte of stress is the mean over the elements around a vertex, of the largest.
static void stresses_are_shares_of_the_largest(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    size_t size;
    const OmViewNow now = {0};
    OmBodyReport report;
    int nheld, nfull = 0;
    assert_ok(open_field(&f));
    const OmPose tip = om_pose_mul(f.site.pose_world_task,
                                   (OmPose){om_vec3(-0.05, -0.05, 0.005), om_pose_identity().q});
    OmPose up = tip;
    up.p = om_add(up.p, om_quat_rotate(f.site.pose_world_task.q, om_vec3(0, 0, 0.01)));
    assert_ok(om_body_grasp(f.body, 0, tip, 0.02, &nheld));
    assert_ok(om_body_move(f.body, 0, up));
    for (int i = 0; i < 5; ++i) assert_true(om_body_step(f.body, 0.02, &report) >= 0);
    assert_ok(om_view3d_add_scene(f.view, &t));
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    const char* scene = find_message(&t, 0, &size);
    const int nvert = nvert_of(scene + 8, 0);
    const char* stress = find_message(&t, 1, &size) + 76 + (6 * nvert + 3) / 4 * 4;
    assert_int_equal(u32(stress), 3);
    double* value = om_calloc((size_t)f.site.mesh.ntet, sizeof *value);
    double most = 0;
    assert_ok(om_body_get_measure(f.body, OM_VON_MISES, value));
    for (int e = 0; e < f.site.mesh.ntet; ++e) most = fmax(most, value[e]);
    assert_true(f32(stress + 4) > 0 && (double)f32(stress + 4) <= most * (1 + 1e-6));
    for (int i = 0; i < nvert; ++i) nfull += (unsigned char)stress[8 + i] == 255;
    assert_true(nfull >= 1 && nfull < nvert / 4);
    om_free(value);
    om_text_done(&t);
    close_field(&f);
}

// Of a lifted body, and one vertex more, which the arm holds far from where it would be attached.
static void points_are_where_vertices_are_attached(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    OmBodyReport report;
    size_t size;
    int nheld, v = 0;
    assert_ok(open_field(&f));
    const int nvert = f.site.mesh.nvert;
    OmPose tip = om_pose_mul(f.site.pose_world_task,
                             (OmPose){om_vec3(-0.05, -0.05, 0.005), om_pose_identity().q});
    assert_ok(om_body_grasp(f.body, 0, tip, 0.02, &nheld));
    tip.p = om_add(tip.p, om_quat_rotate(f.site.pose_world_task.q, om_vec3(0, 0, 0.03)));
    assert_ok(om_body_move(f.body, 0, tip));
    for (int i = 0; i < 3; ++i) assert_true(om_body_step(f.body, 0.02, &report) >= 0);
    unsigned char* attached = om_calloc((size_t)nvert, 1);
    assert_non_null(attached);
    memcpy(attached, om_body_attached(f.body), (size_t)nvert);
    while (om_body_held_by(f.body)[v] < 0) ++v;
    attached[v] = 1;
    assert_true(om_distance(om_load3(om_body_x(f.body), v), om_load3(f.site.mesh.x, v)) > 0.005);
    uint32_t n = 0;
    assert_ok(om_view3d_add_points(f.body, attached, OM_VIEW_TRUE, &t));
    const char* m = find_message(&t, 0, &size);
    assert_int_equal(u32(m), 3);
    assert_int_equal(u32(m + 4), OM_VIEW_TRUE);
    for (int i = 0; i < nvert; ++i) {
        if (!attached[i]) continue;
        for (int k = 0; k < 3; ++k)
            assert_near(f32(m + 12 + 4 * (3 * n + (uint32_t)k)), f.site.mesh.x[3 * i + k], 1e-7);
        ++n;
    }
    assert_true(n > 1);
    assert_int_equal(u32(m + 8), n);
    om_free(attached);
    om_text_done(&t);
    close_field(&f);
}

// Tissue at rest on its board: the forces of contact are those of the body, in 255ths of the largest.
static void contact_is_that_of_the_body(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    size_t size;
    OmSurface surface;
    int* vert;
    const OmViewNow now = {0};
    assert_ok(open_field(&f));
    (void)om_body_settle(f.body, 0.02, 1e-3, 1);
    assert_ok(om_view3d_add_frame(f.view, &now, &t));
    assert_ok(om_tet_mesh_boundary(om_body_mesh(f.body), &surface, &vert));
    const size_t nvert = (size_t)surface.nvert;
    const char* field = find_message(&t, 0, &size) + 76 + (6 * nvert + 3) / 4 * 4;
    assert_int_equal(u32(field), 3);
    const char* contact = field + 8 + (nvert + 3) / 4 * 4;
    double most = 0;
    for (size_t i = 0; i < nvert; ++i)
        most = fmax(most, om_norm(om_load3(om_body_contact_force(f.body), vert[i])));
    assert_true(most > 1e-3);
    assert_near(f32(contact), most, 1e-6 * most);
    for (size_t i = 0; i < nvert; ++i)
        assert_near((unsigned char)contact[4 + i] / 255.0,
                    om_norm(om_load3(om_body_contact_force(f.body), vert[i])) / most, 0.002);
    om_surface_done(&surface);
    om_free(vert);
    om_text_done(&t);
    close_field(&f);
}

// A body of a coarser mesh says how likely a corner of its underside is attached: so it is at that corner of the drawn
// tissue, below and above, and 0 far away. Of a large cloud every second point is kept.
static void chances_and_clouds(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    size_t size;
    OmSite site;
    OmBody* coarse;
    OmSurface surface;
    int* vert;
    assert_ok(open_field(&f));
    OmScene scene = f.scene;
    scene.tissue.cells = om_vec3(3, 3, 1);
    assert_ok(om_site_build(&scene, OM_SITE_TWIN, NULL, &site));
    assert_ok(om_body_create(&scene, &site, 1, &coarse));
    double* chance = om_calloc((size_t)site.mesh.nvert, sizeof *chance);
    const OmVec3 corner = om_load3(site.mesh.x, 0);
    chance[0] = 0.6;
    assert_ok(om_view3d_add_chances(f.view, coarse, chance, &t));
    assert_ok(om_tet_mesh_boundary(om_body_mesh(f.body), &surface, &vert));
    const char* m = find_message(&t, 0, &size);
    assert_int_equal(u32(m), 5);
    assert_int_equal(u32(m + 4), surface.nvert);
    int nlikely = 0;
    for (int i = 0; i < surface.nvert; ++i) {
        const double d = om_distance(om_load3(surface.x, i), corner);
        const int is = (unsigned char)m[8 + i];
        assert_true(is == 0 || is == 153);
        if (d < 1.1 * 2 * f.site.half_size.z) assert_int_equal(is, 153);
        if (d > 0.03) assert_int_equal(is, 0);  // more than half a cell of 40 mm and the thickness
        nlikely += is == 153;
    }
    assert_true(nlikely >= 2);
    enum { N = 2 * OM_VIEW_MAX_CLOUD };
    static double x[3 * N];
    for (int i = 0; i < 3 * N; ++i) x[i] = 1e-3 * i;
    t.len = 0;
    assert_ok(om_view3d_add_cloud(N, x, &t));
    m = find_message(&t, 0, &size);
    assert_int_equal(u32(m + 4), OM_VIEW_MEASURED);
    assert_int_equal(u32(m + 8), OM_VIEW_MAX_CLOUD);
    assert_near(f32(m + 12 + 12 * 7), x[3 * 14], 1e-6);
    t.len = 0;
    assert_ok(om_view3d_add_cloud(0, NULL, &t));
    assert_int_equal(u32(find_message(&t, 0, &size) + 8), 0);
    om_free(chance);
    om_surface_done(&surface);
    om_free(vert);
    om_body_destroy(coarse);
    om_site_done(&site);
    om_text_done(&t);
    close_field(&f);
}

// The nearest pixel of a depth picture is white, one without depth black; the words have its range.
static void a_depth_picture_has_its_camera(void** unused) {
    (void)unused;
    OmText t = {0};
    float depth[4] = {0.2F, 0.3F, 0, 0.25F};
    OmScan scan = {.depth = depth};
    assert_ok(om_view_add_depth(1, &scan, &t));
    assert_int_equal(t.len, 0);  // no camera
    const OmSceneCamera lens = {.distance = 1, .fov = 1, .width = 2, .height = 2};
    const OmPose pose = {om_vec3(1, 2, 3), om_quat_identity()};
    scan.has_camera = true;
    scan.camera = om_scene_camera_place(&lens, pose);
    assert_ok(om_view_add_depth(1.5, &scan, &t));
    assert_non_null(strstr(t.str, "\"caption\":\"depth, 200 mm (white) to 300 mm\""));
    assert_non_null(strstr(t.str, "\"depth\":true,\"position\":[1,2,3]"));
    assert_non_null(strstr(t.str, "\"fov_y_deg\":57.2958,\"aspect\":1}"));
    char png[4000], path[64] = "/tmp/om_depth_XXXXXX";
    const size_t n = decode(strstr(t.str, "\"png\":\"") + 7, png);
    OmPicture picture;
    close(mkstemp(path));
    assert_ok(om_file_write(path, png, n));
    assert_ok(om_picture_load_png(path, &picture));
    const int want[4] = {255, 40, 0, 147};
    for (int i = 0; i < 4; ++i) assert_true(abs(picture.pixel[3 * i] - want[i]) <= 1);
    om_picture_done(&picture);
    remove(path);
    om_text_done(&t);
}

// A surface of the caller's is the last part, and moves with it.
static void a_probe_is_a_part(void** unused) {
    (void)unused;
    Field f;
    OmText t = {0};
    OmView3d* view;
    size_t size;
    const OmViewNow now = {.time = 1};
    double x[9] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0};
    int tri[3] = {0, 1, 2};
    const OmSurface ball = {.x = x, .tri_vert = tri, .nvert = 3, .ntri = 1};
    assert_ok(open_field(&f));
    OmView3dDef def = om_view3d_default_def(&f.scene, f.body);
    def.probe = &ball;
    assert_ok(om_view3d_create(&def, &view));
    assert_ok(om_view3d_add_scene(view, &t));
    assert_ok(om_view3d_add_frame(view, &now, &t));
    x[8] = 0.02;
    assert_ok(om_view3d_add_frame(view, &now, &t));
    const char* json = find_message(&t, 0, &size) + 8;
    const char* at = strstr(json, "\"kind\": \"probe\"");
    assert_non_null(at);
    const char* frame = find_message(&t, 2, &size);
    assert_int_equal(u32(frame + 40), 1);  // it alone has moved
    assert_int_equal(u32(frame + 48), 3);
    uint16_t q;
    memcpy(&q, frame + 76 + 2 * 8, sizeof q);
    assert_near(f32(frame + 60) + f32(frame + 72) * q / 65535, 0.02, 1e-5);
    om_text_done(&t);
    om_view3d_destroy(view);
    close_field(&f);
}

// ---- the page -----------------------------------------------------------------------------------------------

static int count(const char* text, const char* word) {
    int n = 0;
    for (; (text = strstr(text, word)); ++text) ++n;
    return n;
}

// Three frames, with a pull between them.
static void pull_a_little(Field* f, OmText* messages) {
    OmViewNow now = {0};
    OmBodyReport report;
    int nheld;
    OmPose tip = om_pose_mul(f->site.pose_world_task,
                             (OmPose){om_vec3(-0.05, -0.05, 0.005), om_pose_identity().q});
    assert_ok(om_body_grasp(f->body, 0, tip, 0.02, &nheld));
    for (int k = 0; k < 3; ++k) {
        now.time = 0.02 * k;
        assert_ok(om_view3d_add_frame(f->view, &now, messages));
        tip.p = om_add(tip.p, om_quat_rotate(f->site.pose_world_task.q, om_vec3(0, 0, 0.003)));
        assert_ok(om_body_move(f->body, 0, tip));
        assert_true(om_body_step(f->body, 0.02, &report) >= 0);
    }
}

// Frames of differences become frames again: only the tissue moves here, and its box stays.
static void add_differences(char* bytes, size_t size) {
    const uint32_t kind = 2;
    char* last = NULL;
    int nframe = 0;
    for (size_t at = 0; at < size; at += 4 + u32(bytes + at)) {
        char* m = bytes + at + 4;
        if (u32(m) != 4) continue;
        memcpy(m, &kind, sizeof kind);
        assert_int_equal(u32(m + 44), 0);
        const size_t nvert = u32(m + 48);
        char* x = m + 76;
        char* field[2];
        field[0] = x + (6 * nvert + 3) / 4 * 4 + 8;
        field[1] = field[0] + (nvert + 3) / 4 * 4 + 4;
        for (size_t i = 0; last && i < 3 * nvert; ++i) {
            uint16_t is, was;
            memcpy(&is, x + 2 * i, 2);
            memcpy(&was, last + 2 * i, 2);
            is = (uint16_t)(is + was);
            memcpy(x + 2 * i, &is, 2);
        }
        for (int k = 0; k < 2; ++k)
            for (size_t i = 0; last && i < nvert; ++i)
                field[k][i] = (char)(field[k][i] + last[field[k] - x + (long)i]);
        last = x;
        ++nframe;
    }
    assert_int_equal(nframe, 3);
}

static void a_page_holds_everything(void** unused) {
    (void)unused;
    char folder[64] = "/tmp/om_view_XXXXXX", path[128];
    OmViewPage page = {.title = "a <b> & c",
                       .story = "{\"words\":\"</script><script>alert(1)\"}\n",
                       .back = "report.html"};
    unsigned char pixel[2 * 2 * 3] = {0};
    const OmPicture picture = {.width = 2, .height = 2, .nchannel = 3, .pixel = pixel};
    Field f;
    char* html;
    size_t size;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/view.html", folder);
    assert_ok(open_field(&f));
    assert_ok(om_view3d_add_scene(f.view, &page.messages));
    pull_a_little(&f, &page.messages);
    assert_ok(om_view_page_add_picture(&page, 0.5, "one \"</script>\"", &picture));
    assert_ok(om_view_page_add_picture(&page, 1.5, "two", &picture));
    assert_ok(om_view_page_save(&page, path));
    assert_ok(om_file_read(path, 10000000, &html, &size));
    assert_int_equal(strlen(html), size);
    assert_int_equal(count(html, "<script"), 5);  // messages, story, pictures, three, the page's
    assert_int_equal(count(html, "</script>"), 5);
    assert_int_equal(count(html, "<title>a &lt;b&gt; &amp; c: omentum</title>"), 1);
    assert_int_equal(count(html, "href=\"report.html\""), 1);
    assert_int_equal(count(html, "\\u003c/script>\\u003cscript>alert(1)"), 1);
    assert_int_equal(count(html, "\"png\":\"iVBOR"), 2);
    assert_int_equal(count(html, "src=\"http") + count(html, "href=\"http"), 0);  // no network
    const char* at = strstr(html, "id=\"messages\"");
    char *packed = om_alloc(size, 1), *bytes = om_alloc(page.messages.len, 1);
    uLongf n = page.messages.len;
    const size_t npacked = decode(strchr(at, '>') + 1, packed);
    assert_int_equal(uncompress((Bytef*)bytes, &n, (Bytef*)packed, npacked), Z_OK);
    assert_int_equal(n, page.messages.len);
    add_differences(bytes, n);
    assert_memory_equal(bytes, page.messages.str, n);
    om_free(packed);
    om_free(bytes);
    om_free(html);
    om_view_page_done(&page);
    close_field(&f);
    assert_ok(om_path_remove(folder));
}

// Messages that are not whole are no page: cut anywhere in the last frame, also where its length says so.
static void a_page_refuses_broken_messages(void** unused) {
    (void)unused;
    Field f;
    OmViewPage page = {.title = "x"};
    size_t size;
    assert_ok(open_field(&f));
    assert_ok(om_view3d_add_scene(f.view, &page.messages));
    pull_a_little(&f, &page.messages);
    const size_t whole = page.messages.len;
    const char* frame = find_message(&page.messages, 3, &size);
    const size_t begin = (size_t)(frame - page.messages.str) - 4;
    assert_int_equal(u32(frame + 40), 1);
    for (size_t cut = 4; cut < size; cut += cut < 100 ? 4 : 404) {
        const uint32_t length = (uint32_t)(size - cut);
        page.messages.len = whole - cut;
        assert_status(om_view_page_save(&page, "/dev/null/no"), OM_INVALID);
        memcpy(page.messages.str + begin, &length, sizeof length);
        assert_status(om_view_page_save(&page, "/dev/null/no"), OM_INVALID);
        const uint32_t right = (uint32_t)size;
        memcpy(page.messages.str + begin, &right, sizeof right);
    }
    om_view_page_done(&page);
    close_field(&f);
}

static OmStatus make_page(void* ctx) {
    Field* f = ctx;
    OmView3dDef def = om_view3d_default_def(&f->scene, f->body);
    OmViewPage page = {.title = "x"};
    OmView3d* view;
    const OmViewNow now = {0};
    OM_TRY(om_view3d_create(&def, &view));
    OmStatus status = om_view3d_add_scene(view, &page.messages);
    if (status == OM_OK) status = om_view3d_add_frame(view, &now, &page.messages);
    if (status == OM_OK)
        status = om_view3d_add_points(f->body, om_body_attached(f->body), OM_VIEW_BELIEVED,
                                      &page.messages);
    if (status == OM_OK) status = om_view_page_save(&page, "/dev/null/no");
    if (status == OM_IO) status = OM_OK;
    om_view_page_done(&page);
    om_view3d_destroy(view);
    return status;
}

static void failing_allocations_leak_nothing(void** unused) {
    (void)unused;
    Field f;
    assert_ok(open_field(&f));
    assert_true(test_failing_allocations(make_page, &f, test_stride(3)) > 5);
    close_field(&f);
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(frames_hold_where_the_tissue_is),
        cmocka_unit_test(live_frames_are_whole),
        cmocka_unit_test(stresses_are_shares_of_the_largest),
        cmocka_unit_test(points_are_where_vertices_are_attached),
        cmocka_unit_test(contact_is_that_of_the_body),
        cmocka_unit_test(chances_and_clouds),
        cmocka_unit_test(a_depth_picture_has_its_camera),
        cmocka_unit_test(a_probe_is_a_part),
        cmocka_unit_test(a_page_holds_everything),
        cmocka_unit_test(a_page_refuses_broken_messages),
        cmocka_unit_test(failing_allocations_leak_nothing),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
