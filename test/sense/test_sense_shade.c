// test_sense_shade.c: shading of packets against a plain version in double precision, one pixel at a time; textures
// against differences, their period and a constant; textures stick to tissue that moves.
#include "sense/sense_internal.h"
#include "sense_shapes.h"

// ---- a second implementation of sense_shade.c, with its constants -----------------------------------------------

static double clip(double x) { return x > 0 ? x : 0; }

static double ggx(double cosine, double alpha2) {
    double k = cosine * cosine * (alpha2 - 1) + 1;
    return alpha2 / (k * k);
}

typedef struct Pixel {
    OmVec3 n, ray, light;  // unit normal; ray to the hit, m; from the hit to the light, m
    double color[3], gloss, metal, wrap, alpha2, lit;
} Pixel;

static void shade_plainly(const Pixel* p, OmVec3 up, double exposure2, double out[3]) {
    OmVec3 v = om_scale(-1, om_normalize(p->ray)), l = om_normalize(p->light);
    OmVec3 h = om_normalize(om_add(l, v));
    double fall_v = fmin(1.7, exposure2 / om_norm2(p->ray));
    double fall_l = fmin(1.7, exposure2 / om_norm2(p->light));
    double nv = om_dot(p->n, v), nl = om_dot(p->n, l), lh = om_dot(l, h);
    double lit = p->lit > 0 ? 1 : 0.06, matte = 1 - p->metal;
    double spot_l = 0.62 * lit * clip(nl) * fall_l * ggx(clip(om_dot(p->n, h)), p->alpha2) * 0.25 /
                    (lh * lh + 1e-3);
    double spot_v = 0.50 * clip(nv) * fall_v * ggx(clip(nv), p->alpha2) * 0.25;
    double white = 4 * p->gloss * matte * ((0.04 + 0.96 * pow(1 - lh, 5)) * spot_l + 0.04 * spot_v);
    white += p->gloss * matte * 0.05 * pow(1 - clip(nv), 5) * fall_v;
    double sky = 2 * nv * om_dot(p->n, up) - om_dot(v, up);
    double mirror = p->metal * p->gloss *
                    (spot_l + spot_v + fall_v * (0.16 + 0.14 * sky + 0.25 * clip(nv) * clip(nv)));
    double wall = (0.075 + 0.035 * om_dot(p->n, up)) * (0.5 + 0.5 * fall_v);
    for (int k = 0; k < 3; ++k) {
        double w = p->wrap * (k == 0 ? 1 : k == 1 ? 0.6 : 0.4);
        double soft = 0.62 * lit * fall_l * clip((nl + w) / (1 + w)) +
                      0.36 * fall_v * clip((nv + w) / (1 + w));
        out[k] = p->color[k] * (wall + matte * soft + mirror) + white;
    }
}

static OmVec3 random_vector(OmRng* rng) {
    double x = om_rng_normal(rng), y = om_rng_normal(rng), z = om_rng_normal(rng);
    return om_vec3(x, y, z);
}

static void packets_are_shaded_as_pixels(void** state) {
    (void)state;
    OmRng rng = om_rng_init(4, 0);
    for (int round = 0; round < 500; ++round) {
        Pixel pixel[PACKET];
        Packet p = {.n = PACKET}, shadow = {.n = PACKET};
        Surface s;
        OmVec3 up = om_normalize(random_vector(&rng));
        Shading sh = {.up = {(float)up.x, (float)up.y, (float)up.z}, .exposure2 = 0.04f};
        for (int i = 0; i < PACKET; ++i) {
            Pixel* a = &pixel[i];
            a->ray = om_scale(0.2, random_vector(&rng));
            a->light = om_scale(0.2, random_vector(&rng));
            // every fourth normal close to the half vector: in a highlight
            OmVec3 half = om_sub(om_normalize(a->light), om_normalize(a->ray));
            a->n =
                om_normalize(i % 4 ? random_vector(&rng) : om_madd(half, 0.1, random_vector(&rng)));
            if (om_dot(a->n, a->ray) > 0) a->n = om_scale(-1, a->n);
            for (int k = 0; k < 3; ++k) a->color[k] = om_rng_uniform(&rng);
            a->gloss = om_rng_uniform(&rng);
            a->metal = i % 3 ? 0 : 0.85;
            a->wrap = i % 3 ? 0.3 : 0;
            a->alpha2 = i % 3 ? 0.02 : 0.1;
            a->lit = i % 2;
            p.id[i] = 0;
            p.t[i] = 2;  // rays of any length: half of the way
            p.dx[i] = (float)(a->ray.x / 2), p.dy[i] = (float)(a->ray.y / 2),
            p.dz[i] = (float)(a->ray.z / 2);
            shadow.dx[i] = (float)a->light.x, shadow.dy[i] = (float)a->light.y,
            shadow.dz[i] = (float)a->light.z;
            shadow.t[i] = (float)a->lit;
            s.nx[i] = (float)a->n.x, s.ny[i] = (float)a->n.y, s.nz[i] = (float)a->n.z;
            s.red[i] = (float)a->color[0], s.green[i] = (float)a->color[1],
            s.blue[i] = (float)a->color[2];
            s.gloss[i] = (float)a->gloss, s.metal[i] = (float)a->metal;
            s.wrap[i] = (float)a->wrap, s.alpha2[i] = (float)a->alpha2;
        }
        om__shade(&sh, &p, &shadow, &s);
        for (int i = 0; i < PACKET; ++i) {
            double want[3];
            shade_plainly(&pixel[i], up, 0.04, want);
            const float got[3] = {s.red[i], s.green[i], s.blue[i]};
            // float; a highlight of alpha^2 = 0.02 multiplies errors of the cosine by 4 / alpha^2
            for (int k = 0; k < 3; ++k)
                assert_near((double)got[k], want[k], 1e-6 + 2e-4 * fabs(want[k]));
        }
    }
}

// The curve of sRGB, and a shoulder that keeps the ratios of the channels.
static void tone_is_srgb(void** state) {
    (void)state;
    for (int i = 0; i < 4000; ++i) {
        float light[3][PACKET] = {{0}};
        int byte[3][PACKET];
        double max = 0.001 * (i + 4), share[3] = {1, 0.5, 0.2};
        for (int k = 0; k < 3; ++k) light[k][i % PACKET] = (float)(share[k] * max);
        om__shade_tone(light, byte);
        for (int k = 0; k < 3; ++k) {
            double x = share[k] * max / pow(1 + pow(max, 4), 0.25);
            if (x < 0.0031) continue;  // darker than sRGB
            double y = 255 * (1.055 * pow(x, 1 / 2.4) - 0.055);
            assert_near(byte[k][i % PACKET], y, 0.55);  // 0.5 of rounding, 0.02 of the curve
        }
    }
}

// ---- textures -----------------------------------------------------------------------------------------------------

static void textures_are_periodic_and_constant(void** state) {
    (void)state;
    static const uint64_t hash[OM_NTEXTURE] = {0, 0x5e6900358f9e275, 0x86f279908bc290f6,
                                               0x6bd7187aa29e5343};
    for (int texture = OM_TEXTURE_FAT; texture < OM_NTEXTURE; ++texture) {
        float* voxel;
        assert_ok(om__texture_bake(texture, &voxel));
        const size_t n = (size_t)TEXTURE_SIZE * TEXTURE_SIZE * TEXTURE_SIZE;
        // only + - * / and sqrt: the same bits everywhere
        assert_int_equal(om_hash(voxel, n * NCHANNEL * sizeof *voxel, OM_HASH_SEED), hash[texture]);
        double mean = 0;
        for (size_t i = 0; i < n; ++i) {
            const float* v = &voxel[NCHANNEL * i];
            assert_true(v[CHANNEL_SHADE] > 0.6f && v[CHANNEL_SHADE] < 1.4f);
            assert_true(v[CHANNEL_TINT] >= 0 && v[CHANNEL_TINT] <= 1);
            assert_true(v[CHANNEL_WET] > 0);
            mean += (double)v[CHANNEL_SHADE] / (double)n;
        }
        assert_near(mean, 1, 0.03);  // a texture does not make an object brighter
        OmRng rng = om_rng_init(9, (uint64_t)texture);
        for (int i = 0; i < 1000; ++i) {
            const float e = 1.0f / 1024;  // of exact sums
            float t[3], far[3];
            Texel a, b, lo, hi;
            // inside of a voxel, where the interpolation has one polynomial
            for (int k = 0; k < 3; ++k) {
                double cell = om_rng_below(&rng, TEXTURE_SIZE) + 0.5 + om_rng_range(&rng, 0.2, 0.8);
                t[k] = (float)(floor(cell / TEXTURE_SIZE * 4096) / 4096);
                far[k] = t[k] - 7;
            }
            om__texture_sample(voxel, t, &a);
            om__texture_sample(voxel, far, &b);
            for (int c = 0; c < NCHANNEL; ++c)
                assert_near((double)a.value[c], (double)b.value[c], 1e-5);
            for (int k = 0; k < 3; ++k) {
                float at = t[k];
                t[k] = at - e, om__texture_sample(voxel, t, &lo);
                t[k] = at + e, om__texture_sample(voxel, t, &hi);
                t[k] = at;
                double slope =
                    ((double)hi.value[CHANNEL_HEIGHT] - (double)lo.value[CHANNEL_HEIGHT]) /
                    (2 * (double)e);
                assert_near((double)a.slope[k], slope, 2e-6 + 1e-3 * fabs(slope));
            }
        }
        om_free(voxel);
    }
}

static void draw(OmSenseScene* scene, OmPose motion, OmPicture* picture) {
    OmCamera c = look_down(64, 48);
    c.pose_world_camera = om_pose_mul(motion, c.pose_world_camera);
    OmSenseOptions options = om_sense_options_default();
    assert_ok(om_sense_scene_commit(scene));
    assert_ok(om_picture_init(picture, 64, 48, 3));
    assert_ok(om_sense_render(scene, &c, &options, picture));
}

// A textured sheet that turns together with the camera gives the same picture; if the sheet slides alone, the texture
// slides with it. The turn is about the middle of the sheet, for which the exposure is set.
static void textures_stick_to_the_material(void** state) {
    (void)state;
    OmPose turn = {{0, 0, 0}, om_quat_axis_angle(om_vec3(0.6, 0.8, 0), 1.3)};
    for (int texture = OM_TEXTURE_FAT; texture < OM_NTEXTURE; ++texture) {
        OmSurface rest = make_square(-0.1, 0.1, 0.1, 0), now = make_square(-0.1, 0.1, 0.1, 0);
        OmSenseLook look = om_sense_look(OM_PART_TISSUE);
        look.texture = texture;
        OmSenseScene* scene;
        OmPicture still, slid, turned;
        int id, nslid = 0, nturned = 0;
        assert_ok(om_sense_scene_create(&scene));
        assert_ok(om_sense_scene_add(scene, &rest, &look, &id));
        draw(scene, om_pose_identity(), &still);
        for (int i = 0; i < 4; ++i) now.x[3 * i] = rest.x[3 * i] + 0.005;
        om_sense_scene_update(scene, id, now.x, NULL);
        draw(scene, om_pose_identity(), &slid);
        for (int i = 0; i < 4; ++i) om_store3(now.x, i, om_pose_apply(turn, om_load3(rest.x, i)));
        om_sense_scene_update(scene, id, now.x, NULL);
        draw(scene, turn, &turned);
        for (int i = 0; i < 64 * 48 * 3; ++i) {
            nslid += abs(still.pixel[i] - slid.pixel[i]) > 1;
            nturned += abs(still.pixel[i] - turned.pixel[i]) > 1;  // rounding
        }
        assert_true(nslid > 64 * 48 * 3 / 10);
        assert_true(nturned < 64 * 48 * 3 / 200);
        om_picture_done(&still);
        om_picture_done(&slid);
        om_picture_done(&turned);
        om_surface_done(&rest);
        om_surface_done(&now);
        om_sense_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(packets_are_shaded_as_pixels),
        cmocka_unit_test(tone_is_srgb),
        cmocka_unit_test(textures_are_periodic_and_constant),
        cmocka_unit_test(textures_stick_to_the_material),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
