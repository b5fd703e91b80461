// sense_texture.c: solid textures of tissue, organ and steel.
//
// A texture is a periodic volume of voxels that is filled once; a point of a surface reads it by trilinear
// interpolation at its texture coordinates. They are computed from the positions at rest, so the texture moves
// with the material. A fixed rotation is applied to coordinates: a plane through the volume then never repeats exactly.
//
// Fat: one lobule around each of 8^3 random points, the nearest point decides (S. Worley, "A cellular texture basis
// function", SIGGRAPH 1996); septa are where the nearest two points are equally far. Organ: vessels are where
// smooth noise passes zero. All random numbers are functions of (texture, lattice point).
#include "sense/sense_internal.h"

#define N TEXTURE_SIZE
#define NCELL 8      // lobules along a side
#define NLATTICE 24  // lattice points of the finest noise
#define SEED 0x6f6dULL

typedef struct Bake {
    double point[NCELL * NCELL * NCELL][3];             // of lobules, in cells
    double tone[NCELL * NCELL * NCELL];                 // of lobules, -1 to 1
    double lattice[3][NLATTICE * NLATTICE * NLATTICE];  // -1 to 1
} Bake;

// Points lie within one period, moved by little: no division.
static int wrap(int i, int n) {
    while (i < 0) i += n;
    while (i >= n) i -= n;
    return i;
}

static int floor_of(double x) {
    int i = (int)x;
    return i - (i > x);
}

static void fill_random(OmSenseTexture texture, Bake* bake) {
    for (int c = 0; c < NCELL * NCELL * NCELL; ++c) {
        OmRng rng = om_rng_init(SEED + (uint64_t)texture, (uint64_t)c);
        for (int k = 0; k < 3; ++k) bake->point[c][k] = om_rng_uniform(&rng);
        bake->tone[c] = om_rng_range(&rng, -1, 1);
    }
    for (int c = 0; c < NLATTICE * NLATTICE * NLATTICE; ++c) {
        OmRng rng = om_rng_init(SEED + (uint64_t)texture, 1u << 20 | (uint64_t)c);
        for (int k = 0; k < 3; ++k) bake->lattice[k][c] = om_rng_range(&rng, -1, 1);
    }
}

// Smooth periodic noise, -1 to 1, with n values along the period.
static double noise(const double* lattice, int n, const double p[3]) {
    int at[3][2];
    double f[3][2], sum = 0;
    for (int k = 0; k < 3; ++k) {
        double x = p[k] * n;
        const int base = floor_of(x);
        x -= base;
        f[k][1] = x * x * (3 - 2 * x);
        f[k][0] = 1 - f[k][1];
        for (int i = 0; i < 2; ++i) at[k][i] = wrap(base + i, n);
    }
    for (int c = 0; c < 8; ++c) {
        int i = c & 1, j = c >> 1 & 1, k = c >> 2;
        double weight = f[0][i] * f[1][j] * f[2][k];
        sum += weight * lattice[(at[2][k] * n + at[1][j]) * n + at[0][i]];
    }
    return sum;
}

// Distances, in cells, to the nearest and the second nearest point; returns the nearest.
static int find_lobule(const Bake* bake, const double p[3], double* nearest, double* second) {
    int best = 0, base[3], wrapped[3][3];
    double d1 = 9, d2 = 9;
    for (int k = 0; k < 3; ++k) {
        base[k] = floor_of(p[k] * NCELL);
        for (int i = 0; i < 3; ++i) wrapped[k][i] = wrap(base[k] + i - 1, NCELL);
    }
    for (int c = 0; c < 27; ++c) {
        const int of[3] = {c % 3, c / 3 % 3, c / 9};
        const int at[3] = {base[0] + of[0] - 1, base[1] + of[1] - 1, base[2] + of[2] - 1};
        int cell = (wrapped[2][of[2]] * NCELL + wrapped[1][of[1]]) * NCELL + wrapped[0][of[0]];
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            double e = at[k] + bake->point[cell][k] - p[k] * NCELL;
            sum += e * e;
        }
        if (sum < d1) {
            d2 = d1, d1 = sum, best = cell;
        } else if (sum < d2) {
            d2 = sum;
        }
    }
    *nearest = sqrt(d1), *second = sqrt(d2);
    return best;
}

static double ridge(double x, double width) { return 1 / (1 + x * x / (width * width)); }

static void bake_fat(const Bake* bake, const double p[3], float* v) {
    double d1, d2, fine = noise(bake->lattice[0], NLATTICE, p);
    double wide = noise(bake->lattice[1], 5, p), q[3];
    for (int k = 0; k < 3; ++k) q[k] = p[k] + 0.012 * noise(bake->lattice[k], 12, p);
    int lobule = find_lobule(bake, q, &d1, &d2);
    double septum = ridge(d2 - d1, 0.10), vessel = ridge(noise(bake->lattice[2], 4, q), 0.02);
    v[CHANNEL_SHADE] = (float)(1 + 0.15 * bake->tone[lobule] + 0.08 * wide + 0.06 * fine);
    v[CHANNEL_TINT] = (float)fmin(1, 0.75 * septum + 0.6 * vessel * vessel);
    v[CHANNEL_HEIGHT] = (float)(6e-4 * (1 - septum) + 7e-4 * (1 - d1 * d1) + 1.6e-4 * fine);
    v[CHANNEL_WET] = (float)(0.85 + 0.35 * wide);
}

static void bake_organ(const Bake* bake, const double p[3], float* v) {
    double fine = noise(bake->lattice[0], NLATTICE, p), wide = noise(bake->lattice[1], 4, p), q[3];
    for (int k = 0; k < 3; ++k) q[k] = p[k] + 0.03 * noise(bake->lattice[k], 9, p);
    double stem = ridge(noise(bake->lattice[2], 3, q), 0.04);
    double branch = ridge(noise(bake->lattice[1], 7, q), 0.07);
    v[CHANNEL_SHADE] = (float)(1 + 0.12 * wide + 0.07 * fine);
    v[CHANNEL_TINT] = (float)fmin(1, stem + 0.6 * branch * branch);
    v[CHANNEL_HEIGHT] = (float)(1.6e-4 * fine + 4e-4 * wide + 2.4e-4 * stem);
    v[CHANNEL_WET] = (float)(1 + 0.2 * wide);
}

static void bake_steel(const Bake* bake, const double p[3], float* v) {
    double fine = noise(bake->lattice[0], NLATTICE, p), wide = noise(bake->lattice[1], 9, p);
    v[CHANNEL_SHADE] = (float)(1 + 0.05 * fine + 0.03 * wide);
    v[CHANNEL_TINT] = 0;
    v[CHANNEL_HEIGHT] = 0;
    v[CHANNEL_WET] = (float)(1 + 0.2 * fine);
}

OmStatus om__texture_bake(OmSenseTexture texture, float** voxel) {
    *voxel = NULL;
    Bake* bake = om_alloc(1, sizeof *bake);
    float* out = om_alloc((size_t)N * N * N, NCHANNEL * sizeof *out);
    if (!bake || !out) {
        om_free(bake);
        om_free(out);
        return OM_NO_MEMORY;
    }
    fill_random(texture, bake);
    for (int i = 0; i < N * N * N; ++i) {
        const double p[3] = {(i % N + 0.5) / N, (i / N % N + 0.5) / N, (i / (N * N) + 0.5) / N};
        float* v = &out[NCHANNEL * (size_t)i];
        if (texture == OM_TEXTURE_FAT)
            bake_fat(bake, p, v);
        else if (texture == OM_TEXTURE_ORGAN)
            bake_organ(bake, p, v);
        else
            bake_steel(bake, p, v);
    }
    om_free(bake);
    *voxel = out;
    return OM_OK;
}

void om__texture_tint(OmSenseTexture texture, float factor[3]) {
    static const float tint[OM_NTEXTURE][3] = {
        {1, 1, 1}, {0.86f, 0.66f, 0.60f}, {0.50f, 0.30f, 0.34f}, {1, 1, 1}};
    for (int k = 0; k < 3; ++k) factor[k] = tint[texture][k];
}

OmVec3 om__texture_coordinates(OmSenseTexture texture, OmVec3 p) {
    if (texture == OM_TEXTURE_STEEL)  // elongated along z
        return om_vec3(4 * p.x / TEXTURE_PERIOD, 4 * p.y / TEXTURE_PERIOD,
                       0.1 * p.z / TEXTURE_PERIOD);
    const OmQuat turn = {0.83, 0.31, 0.37, 0.275};  // no axis is close to one of the volume
    return om_scale(1 / TEXTURE_PERIOD, om_quat_rotate(om_quat_normalize(turn), p));
}

static inline void mix4(const float* a, const float* b, float t, float* out) {
    for (int c = 0; c < NCHANNEL; ++c) out[c] = a[c] + t * (b[c] - a[c]);
}

void om__texture_sample(const float* voxel, const float t[3], Texel* texel) {
    size_t at[3][2];
    float f[3];
    for (int k = 0; k < 3; ++k) {
        float x = t[k] - floorf(t[k]);
        x = x * N - 0.5f;
        x = x < 0 ? x + N : x;
        int i = (int)x;
        i = i > N - 1 ? N - 1 : i;  // x is N if t is just below 0
        f[k] = x - (float)i;
        at[k][0] = (size_t)i;
        at[k][1] = i + 1 < N ? (size_t)i + 1 : 0;
    }
    const float* corner[8];
    for (int c = 0; c < 8; ++c)
        corner[c] = &voxel[NCHANNEL * ((at[2][c >> 2] * N + at[1][c >> 1 & 1]) * N + at[0][c & 1])];
    float x[4][NCHANNEL], y[2][NCHANNEL];
    for (int c = 0; c < 4; ++c) mix4(corner[2 * c], corner[2 * c + 1], f[0], x[c]);
    for (int c = 0; c < 2; ++c) mix4(x[2 * c], x[2 * c + 1], f[1], y[c]);
    mix4(y[0], y[1], f[2], texel->value);
    const int H = CHANNEL_HEIGHT;
    float dx[4];
    for (int c = 0; c < 4; ++c) dx[c] = corner[2 * c + 1][H] - corner[2 * c][H];
    float dx0 = dx[0] + f[1] * (dx[1] - dx[0]), dx1 = dx[2] + f[1] * (dx[3] - dx[2]);
    float dy0 = x[1][H] - x[0][H], dy1 = x[3][H] - x[2][H];
    texel->slope[0] = N * (dx0 + f[2] * (dx1 - dx0));
    texel->slope[1] = N * (dy0 + f[2] * (dy1 - dy0));
    texel->slope[2] = N * (y[1][H] - y[0][H]);
}
