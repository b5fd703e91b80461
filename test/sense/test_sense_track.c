// test_sense_track.c: corners and tracks on pictures of sums of sines, whose motion is known exactly.
#include "omentum/sense_track.h"
#include "test_alloc.h"

enum { W = 160, H = 120, MAX = 300 };

typedef struct Wave {
    double a, fu, fv, phase;  // amplitude, cycles a pixel
} Wave;

// Waves of 8 to 60 pixels, in all directions. The long ones lead over a shift of 12 pixels.
static const Wave wave[] = {{28, 0.013, 0.010, 0.3},  {24, -0.009, 0.016, 1.1},
                            {14, -0.033, 0.051, 2.7}, {12, 0.050, 0.021, 0.9},
                            {12, 0.093, -0.058, 2.0}, {10, 0.017, 0.108, 4.0},
                            {10, -0.112, -0.031, 5.1}};

static double grey_at(double u, double v) {
    double sum = 128;
    for (size_t k = 0; k < sizeof wave / sizeof *wave; ++k)
        sum += wave[k].a * sin(2 * OM_PI * (wave[k].fu * u + wave[k].fv * v) + wave[k].phase);
    return sum;
}

// A motion of the plane: p -> centre + scale turn (p - centre) + shift.
typedef struct Motion {
    double shift[2], turn, scale;
} Motion;

static void move(const Motion* m, double sign, const double in[2], double out[2]) {
    double c = cos(m->turn), s = sin(m->turn), cu = 0.5 * W, cv = 0.5 * H;
    if (sign > 0) {
        double u = in[0] - cu, v = in[1] - cv;
        out[0] = cu + m->scale * (c * u - s * v) + m->shift[0];
        out[1] = cv + m->scale * (s * u + c * v) + m->shift[1];
    } else {
        double u = (in[0] - cu - m->shift[0]) / m->scale, v = (in[1] - cv - m->shift[1]) / m->scale;
        out[0] = cu + c * u + s * v;
        out[1] = cv - s * u + c * v;
    }
}

// The texture after a motion, as an RGB picture: gain x grey + offset, with white noise.
static void draw(const Motion* m, double gain, double offset, double noise, uint64_t seed,
                 OmPicture* p) {
    OmRng rng = om_rng_init(seed, 0);
    assert_ok(om_picture_init(p, W, H, 3));
    for (int i = 0; i < W * H; ++i) {
        double at[2] = {i % W + 0.5, i / W + 0.5}, from[2];
        move(m, -1, at, from);
        double g = gain * grey_at(from[0], from[1]) + offset;
        if (noise > 0) g += noise * om_rng_normal(&rng);
        memset(p->pixel + 3 * i, (int)lround(fmax(0, fmin(255, g))), 3);
    }
}

typedef struct Rig {
    OmTrackDef def;
    OmPicture rgb[2];
    OmTrackPicture picture[2];
    double at[2 * MAX];
    OmTrack track[MAX];
    int n;
} Rig;

static void make(Rig* r) {
    for (int k = 0; k < 2; ++k)
        assert_ok(om_track_picture_init(&r->def, &r->rgb[k], &r->picture[k]));
    assert_ok(om_track_find_corners(&r->def, &r->picture[0], NULL, MAX, r->at, &r->n));
}

static void begin(Rig* r, const Motion* m, double gain, double offset, double noise) {
    const Motion still = {.scale = 1};
    r->def = om_track_default_def();
    if (noise == 0)
        r->def.min_corner = 30;  // the noise of whole grey values moves others by 0.02 px
    draw(&still, 1, 0, noise, 1, &r->rgb[0]);
    draw(m, gain, offset, noise, 2, &r->rgb[1]);
    make(r);
}

static void end(Rig* r) {
    for (int k = 0; k < 2; ++k) {
        om_track_picture_done(&r->picture[k]);
        om_picture_done(&r->rgb[k]);
    }
}

// Largest error, px, of the tracks that are not lost; their number. Of a shift by half a wave or more some windows find
// a place that looks alike, more than a pixel away: these are counted apart.
static int worst_of(const Rig* r, const Motion* m, int* nwrong, double* worst) {
    int n = 0;
    *nwrong = 0;
    *worst = 0;
    for (int i = 0; i < r->n; ++i) {
        double want[2];
        move(m, 1, r->at + 2 * i, want);
        if (r->track[i].is_lost) continue;
        double error = hypot(r->track[i].u - want[0], r->track[i].v - want[1]);
        *nwrong += error > 1;
        if (error <= 1) *worst = fmax(*worst, error);
        ++n;
    }
    return n;
}

// Shifts that are no whole pixels, turns and scales; the light changes, too. A window is shifted alone, so a turn by
// 0.05 rad moves its result within it.
static void test_motions(void** state) {
    (void)state;
    static const struct {
        Motion m;
        double gain, offset, limit;
    } row[] = {
        {{{0.25, -0.5}, 0, 1}, 1, 0, 0.05},    {{{0.37, 1.61}, 0, 1}, 1, 0, 0.05},
        {{{-3.3, 2.45}, 0, 1}, 1, 0, 0.05},    {{{11.7, -2.2}, 0, 1}, 1, 0, 0.05},
        {{{-8.4, 8.55}, 0, 1}, 1, 0, 0.05},    {{{1.4, -0.7}, 0.05, 1}, 1, 0, 0.25},
        {{{0.3, 0.2}, 0, 1.05}, 1, 0, 0.25},   {{{-1.2, 0.4}, -0.03, 0.96}, 1, 0, 0.25},
        {{{2.3, -1.6}, 0, 1}, 0.75, 25, 0.05},
    };
    for (size_t k = 0; k < sizeof row / sizeof *row; ++k) {
        Rig r;
        double worst;
        begin(&r, &row[k].m, row[k].gain, row[k].offset, 0);
        assert_true(r.n > 40);
        assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, r.track));
        int nwrong, n = worst_of(&r, &row[k].m, &nwrong, &worst);
        bool is_far = hypot(row[k].m.shift[0], row[k].m.shift[1]) > 6;
        printf("motion %zu: %d of %d corners, worst %.3f px, %d wrong\n", k, n, r.n, worst, nwrong);
        assert_true(n > 0.6 * r.n);
        assert_true(is_far ? nwrong <= 0.02 * n : nwrong == 0);
        assert_below(worst, row[k].limit);
        end(&r);
    }
}

// A guess far from the place of the first picture finds a shift of half the picture.
static void test_guess(void** state) {
    (void)state;
    const Motion m = {{70.3, 0.6}, 0, 1};
    Rig r;
    double guess[2 * MAX], worst;
    begin(&r, &m, 1, 0, 0);
    for (int i = 0; i < r.n; ++i)
        guess[2 * i] = r.at[2 * i] + 68, guess[2 * i + 1] = r.at[2 * i + 1];
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, guess, r.track));
    int nwrong, nfound = worst_of(&r, &m, &nwrong, &worst);
    assert_true(nfound > 0.3 * r.n && nwrong == 0);
    assert_below(worst, 0.05);
    end(&r);
}

// Errors over the covariance are chi-square of two degrees of freedom: mean 2.
static void test_covariance(void** state) {
    (void)state;
    static const double noise[] = {2, 5};
    const Motion m = {{1.35, -0.8}, 0, 1};
    for (int k = 0; k < 2; ++k) {
        Rig r;
        begin(&r, &m, 1, 0, noise[k]);
        r.def.max_back = 2;
        assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, r.track));
        double sum = 0;
        int n = 0, nfar = 0;
        for (int i = 0; i < r.n; ++i) {
            const OmTrack* t = &r.track[i];
            if (t->is_lost) continue;
            double e = t->u - r.at[2 * i] - m.shift[0], f = t->v - r.at[2 * i + 1] - m.shift[1];
            double det = t->covariance[0] * t->covariance[2] - t->covariance[1] * t->covariance[1];
            double chi2 = (t->covariance[2] * e * e - 2 * t->covariance[1] * e * f +
                           t->covariance[0] * f * f) /
                          det;
            sum += chi2, ++n, nfar += chi2 > 9.21;  // 1 % of them are above
        }
        printf("noise %g: %d tracks, mean of chi-square %.2f, %d above 9.21\n", noise[k], n,
               sum / n, nfar);
        assert_true(n > 60);
        assert_near(sum / n, 2, 0.7);
        assert_true(nfar <= 0.06 * n + 1);
        end(&r);
    }
}

// A disc of another texture covers a part of the second picture: points below it are lost, the others are not.
static void test_occlusion(void** state) {
    (void)state;
    const Motion m = {{1.3, 0.6}, 0, 1};
    Rig r = {0};
    const Motion still = {.scale = 1};
    r.def = om_track_default_def();
    draw(&still, 1, 0, 0, 1, &r.rgb[0]);
    draw(&m, 1, 0, 0, 2, &r.rgb[1]);
    for (int i = 0; i < W * H; ++i) {
        double u = i % W - 60, v = i / W - 60;
        if (u * u + v * v < 900)
            memset(r.rgb[1].pixel + 3 * i, 40 + 7 * ((i % W / 3 * 31 + i / W / 3 * 57) % 23), 3);
    }
    make(&r);
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, r.track));
    int nbelow = 0, nkept = 0, nout = 0, nlost = 0;
    for (int i = 0; i < r.n; ++i) {
        double far = hypot(r.at[2 * i] + m.shift[0] - 60.5, r.at[2 * i + 1] + m.shift[1] - 60.5);
        double u = r.at[2 * i], v = r.at[2 * i + 1];
        if (far < 25) ++nbelow, nkept += !r.track[i].is_lost;
        if (far > 40 && u > 10 && v > 10 && u < W - 10 && v < H - 10)
            ++nout, nlost += r.track[i].is_lost;
    }
    printf("%d below the disc, %d of them not lost; %d outside, %d lost\n", nbelow, nkept, nout,
           nlost);
    assert_true(nbelow >= 8 && nkept == 0 && nout > 20 && nlost == 0);
    end(&r);
}

// Corners are where a mask allows them, apart from each other and from old ones, strongest first; a picture of one
// grey, and one of stripes, has none.
static void test_corners(void** state) {
    (void)state;
    const Motion still = {.scale = 1};
    Rig r;
    begin(&r, &still, 1, 0, 0);
    unsigned char* mask = calloc(W * H, 1);
    double at[2 * MAX], some[2 * 10];
    int n, nsome;
    for (int i = 0; i < W * H; ++i) mask[i] = i % W < W / 2;
    OmTrackWhere where = {.mask = mask, .nold = r.n / 2, .old = r.at};
    assert_ok(om_track_find_corners(&r.def, &r.picture[0], &where, MAX, at, &n));
    assert_true(n > 5);
    for (int i = 0; i < n; ++i) {
        assert_true(at[2 * i] + r.def.radius < W / 2);
        for (int k = 0; k < i; ++k)
            assert_true(hypot(at[2 * i] - at[2 * k], at[2 * i + 1] - at[2 * k + 1]) >=
                        r.def.spacing);
        for (int k = 0; k < where.nold; ++k)
            assert_true(hypot(at[2 * i] - r.at[2 * k], at[2 * i + 1] - r.at[2 * k + 1]) >=
                        r.def.spacing);
    }
    assert_ok(om_track_find_corners(&r.def, &r.picture[0], NULL, 10, some, &nsome));
    assert_int_equal(nsome, 10);
    assert_memory_equal(some, r.at, sizeof some);
    free(mask);
    for (int turn = 0; turn < 2; ++turn) {
        for (int i = 0; i < W * H; ++i)
            memset(r.rgb[0].pixel + 3 * i, turn ? (int)(128 + 90 * sin(0.4 * (i % W))) : 90, 3);
        om_track_picture_done(&r.picture[0]);
        assert_ok(om_track_picture_init(&r.def, &r.rgb[0], &r.picture[0]));
        assert_ok(om_track_find_corners(&r.def, &r.picture[0], NULL, MAX, at, &n));
        assert_int_equal(n, 0);
    }
    // Points without texture around them are lost.
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, r.track));
    for (int i = 0; i < r.n; ++i) assert_true(r.track[i].is_lost);
    end(&r);
}

// The strength of a corner against its definition, summed pixel by pixel: x^2 + y^2 has the gradient (2 x, 2 y).
static void test_strength(void** state) {
    (void)state;
    OmTrackDef def = om_track_default_def();
    OmPicture p;
    OmTrackPicture t;
    double at[2], r2 = 0;
    int n, r = def.radius;
    assert_ok(om_picture_init(&p, 31, 31, 1));
    for (int i = 0; i < 31 * 31; ++i) {
        int x = i % 31 - 15, y = i / 31 - 15;
        p.pixel[i] = (unsigned char)(x * x + y * y > 240 ? 240 : x * x + y * y);
    }
    assert_ok(om_track_picture_init(&def, &p, &t));
    for (int x = -r; x <= r; ++x) r2 += 4.0 * x * x / (2 * r + 1);
    unsigned char* mask = calloc(31 * 31, 1);
    for (int i = 0; i < 31 * 31; ++i)
        mask[i] = abs(i % 31 - 15) <= r + 3 && abs(i / 31 - 15) <= r + 3;
    OmTrackWhere where = {.mask = mask};
    def.min_corner = 0.999 * r2;
    assert_ok(om_track_find_corners(&def, &t, &where, 1, at, &n));
    assert_int_equal(n, 1);
    def.min_corner = 1.001 * r2;
    assert_ok(om_track_find_corners(&def, &t, &where, 1, at, &n));
    assert_int_equal(n, 0);
    free(mask);
    om_track_picture_done(&t);
    om_picture_done(&p);
}

static void test_workers(void** state) {
    (void)state;
    const Motion m = {{2.2, -1.1}, 0.02, 1.01};
    Rig r;
    OmTrack again[MAX];
    begin(&r, &m, 1, 0, 1);
    memset(again, 0, sizeof again);
    memset(r.track, 0, sizeof r.track);
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, r.track));
    r.def.nworker = 3;
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], r.n, r.at, NULL, again));
    assert_memory_equal(again, r.track, sizeof again);
    end(&r);
}

static OmStatus make_and_find(void* ctx) {
    Rig* r = ctx;
    OmTrackPicture p;
    OM_TRY(om_track_picture_init(&r->def, &r->rgb[0], &p));
    OmStatus status = om_track_find_corners(&r->def, &p, NULL, MAX, r->at, &r->n);
    om_track_picture_done(&p);
    return status;
}

static void test_bad_input_and_memory(void** state) {
    (void)state;
    const Motion still = {.scale = 1};
    Rig r;
    OmTrackPicture p;
    begin(&r, &still, 1, 0, 0);
    assert_true(test_failing_allocations(make_and_find, &r, 1) == 4);
    OmTrackDef def = r.def;
    def.radius = 1;
    assert_status(om_track_picture_init(&def, &r.rgb[0], &p), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "radius 1"));
    def = (OmTrackDef){0};
    assert_status(om_track_picture_init(&def, &r.rgb[0], &p), OM_INVALID);
    OmPicture small;
    assert_ok(om_picture_init(&small, 8, 60, 3));
    assert_status(om_track_picture_init(&r.def, &small, &p), OM_INVALID);
    assert_non_null(strstr(om_error_message(), "8 x 60"));
    om_picture_done(&small);
    assert_ok(om_picture_init(&small, 60, 60, 1));
    assert_ok(om_track_picture_init(&r.def, &small, &p));
    assert_status(om_track_follow(&r.def, &r.picture[0], &p, 1, r.at, NULL, r.track), OM_INVALID);
    om_track_picture_done(&p);
    om_picture_done(&small);
    r.at[0] = (double)NAN;  // a place that is no number, and one outside, are lost
    r.at[2] = -50, r.at[3] = 4000;
    assert_ok(om_track_follow(&r.def, &r.picture[0], &r.picture[1], 2, r.at, NULL, r.track));
    assert_true(r.track[0].is_lost && r.track[1].is_lost);
    end(&r);
    om_track_picture_done(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_motions),    cmocka_unit_test(test_guess),
        cmocka_unit_test(test_covariance), cmocka_unit_test(test_occlusion),
        cmocka_unit_test(test_corners),    cmocka_unit_test(test_strength),
        cmocka_unit_test(test_workers),    cmocka_unit_test(test_bad_input_and_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
