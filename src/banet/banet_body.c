// banet_body.c: random sheets of fat (thesis 4.2.1), as one function whose zero level is meshed.
//
// The thesis deforms an icosphere, clips it between two planes, twists and bends the mesh, and makes tetrahedra of it.
// Here the same operations are applied to the point where the function is evaluated, in reverse order and inverted in
// closed form: unbend, untwist, then the distance from an ellipsoid with a random outline, clipped by two planes. There
// is no mesh that could fold, and isosurface stuffing (om_tet_mesh_stuff) accepts any function.
//
//     bend: a strip of length s along a direction of the plane and height z over it goes to
//           ((1/k - z) sin(k s), 1/k - (1/k - z) cos(k s)); inverse: angle and radius around (0, 1/k)
//     twist: the cross section at x turns by t x around the x axis; inverse: by -t x
#include "banet/banet_internal.h"

#include "omentum/banet_grid.h"
#include "omentum/shape_meshing.h"

#define EDGE 1.09  // voxels, of inner edges; those of the surface are shorter, the mean is a voxel
#define OUTLINE 0.7    // largest relative amplitude of the noise of the outline
#define ROUGHNESS 0.3  // largest amplitude of the noise of the faces, relative to the thickness
#define MAX_BEND 2.4   // rad, largest angle of a bent body
#define NEAR 3         // noise of the faces is evaluated within so many edges of the surface

typedef struct Body {
    OmVec3 half;       // half-axes of the ellipsoid, m
    double thickness;  // between the planes, m
    double exponent;   // 2: elliptic outline; more: nearer to a rectangle
    double outline, outline_freq;
    double rough, rough_length;  // m
    double bend, bend_cos,
        bend_sin;  // curvature, 1/m, and the direction along which the body is bent
    double twist;  // rad/m
    double reach;  // m, where the noise of the faces is evaluated
    uint64_t seed;
} Body;

static OmVec3 unbend(const Body* b, OmVec3 p) {
    double s = b->bend_cos * p.x + b->bend_sin * p.y, w = -b->bend_sin * p.x + b->bend_cos * p.y;
    if (b->bend != 0) {
        double turn = b->bend > 0 ? 1 : -1, radius = fabs(1 / b->bend), h = radius - turn * p.z;
        double angle = atan2(s, h);
        p.z = turn * (radius - hypot(s, h));
        s = radius * angle;
    }
    return om_vec3(b->bend_cos * s - b->bend_sin * w, b->bend_sin * s + b->bend_cos * w, p.z);
}

static OmVec3 untwist(const Body* b, OmVec3 p) {
    double c = cos(b->twist * p.x), s = sin(b->twist * p.x);
    return om_vec3(p.x, c * p.y + s * p.z, -s * p.y + c * p.z);
}

static double eval_body(void* ctx, OmVec3 p) {
    const Body* b = ctx;
    OmVec3 q = untwist(b, unbend(b, p));
    // ellipsoid: distance along the ray from the centre
    double plane =
        pow(pow(fabs(q.x) / b->half.x, b->exponent) + pow(fabs(q.y) / b->half.y, b->exponent),
            2 / b->exponent);
    double k = sqrt(plane + q.z * q.z / (b->half.z * b->half.z)), length = om_norm(q);
    if (k < 0.2) return fabs(q.z) - 0.5 * b->thickness;
    OmVec3 way = om_vec3(q.x / (b->half.x * k), q.y / (b->half.y * k), q.z / (b->half.z * k));
    double radius = 1 + b->outline * om_noise_perlin(om_scale(b->outline_freq, way), b->seed);
    double d = fmax((k - radius) * length / k, fabs(q.z) - 0.5 * b->thickness);
    if (fabs(d) < b->reach)
        d += b->rough * om_noise_perlin(om_scale(1 / b->rough_length, q), b->seed + 1);
    return d;
}

static double draw_log(OmRng* rng, const double range[2]) {
    return exp(om_rng_range(rng, log(range[0]), log(range[1])));
}

static Body draw_body(const OmBanetSampleDef* def, OmRng* rng) {
    double edge = def->side / OM_BANET_SIDE_CELL, size[2],
           height = (def->max_dim[2] - 2 * OM_BANET_MARGIN) * edge;
    Body b = {.reach = NEAR * edge};
    for (int c = 0; c < 2; ++c) size[c] = draw_log(rng, def->extent);
    b.thickness = draw_log(rng, def->thickness);
    b.half = om_vec3(0.5 * fmax(size[0], size[1]), 0.5 * fmin(size[0], size[1]),
                     0.5 * b.thickness * om_rng_range(rng, 2.5, 8));
    b.exponent = om_rng_uniform(rng) < 0.5 ? 2 : om_rng_range(rng, 2, 6);
    b.outline = om_rng_range(rng, 0, OUTLINE);
    b.outline_freq = om_rng_range(rng, 0.7, 2);
    // a face that comes near the other one leaves holes
    double rough = fmin(ROUGHNESS * b.thickness, fmax(0, 0.5 * (b.thickness - edge)));
    b.rough = rough * om_rng_uniform(rng);
    b.rough_length = om_rng_range(rng, 0.06, 0.2) * def->extent[1];
    // the height that bending and twisting add
    double free = fmax(0, height - b.thickness), turn = om_rng_range(rng, 0, OM_PI);
    double rise = free * om_rng_range(rng, 0, 0.8), roll = free * om_rng_range(rng, 0, 0.6);
    double length = 2 * hypot(b.half.x * cos(turn), b.half.y * sin(turn));
    double bend = fmin(8 * rise / (length * length), MAX_BEND / length);
    b.bend = om_rng_uniform(rng) < 0.5 ? bend : -bend;
    b.bend_cos = cos(turn);
    b.bend_sin = sin(turn);
    double angle = 2 * asin(fmin(1, roll / (2 * b.half.y)));
    b.twist = (om_rng_uniform(rng) < 0.5 ? angle : -angle) / (2 * b.half.x);
    b.seed = om_rng_u32(rng) | (uint64_t)om_rng_u32(rng) << 32;
    return b;
}

// The box of the body has at most def->max_dim cells.
static OmStatus check_box(const OmBanetSampleDef* def, const OmTetMesh* mesh, bool* is_good) {
    OmSurface surface;
    OmBanetGrid grid;
    OM_TRY(om_tet_mesh_boundary(mesh, &surface, NULL));
    OmStatus status = om_banet_grid_fit(&surface, def->side, &grid);
    om_surface_done(&surface);
    *is_good = status == OM_OK;
    for (int c = 0; c < 3; ++c) *is_good = *is_good && grid.dim[c] <= def->max_dim[c];
    return status;
}

static OmStatus make_random(const OmBanetSampleDef* def, OmRng* rng, OmTetMesh* mesh,
                            bool* is_good) {
    double edge = EDGE * def->side / OM_BANET_SIDE_CELL;
    Body b = draw_body(def, rng);
    // a body that reaches out of this box is too large for max_dim
    OmVec3 half = om_scale(0.6 * def->side / OM_BANET_SIDE_CELL,
                           om_vec3(def->max_dim[0], def->max_dim[0], def->max_dim[2]));
    if (def->element == OM_TET10) edge *= 2;
    OmStuffDef stuff = om_stuff_default_def(edge, eval_body, &b, om_scale(-1, half), half);
    stuff.nworker = 1;
    OmStatus status = om_tet_mesh_stuff(&stuff, mesh);
    if (status == OM_INVALID) {  // no lattice point is inside
        *is_good = false;
        return OM_OK;
    }
    if (status == OM_OK) status = om_tet_mesh_keep_parts(mesh, 0, NULL, NULL);
    return status;
}

OmStatus om__banet_body(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* s, bool* is_good) {
    *is_good = true;
    if (def->body)
        OM_TRY(om_tet_mesh_copy(def->body, &s->mesh));
    else
        OM_TRY(make_random(def, rng, &s->mesh, is_good));
    if (!*is_good) return OM_OK;
    if (def->element == OM_TET10) OM_TRY(om_tet_mesh_refine_nodes(&s->mesh, &s->node));
    return def->body ? OM_OK : check_box(def, &s->mesh, is_good);
}
