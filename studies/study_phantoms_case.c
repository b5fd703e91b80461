// study_phantoms_case.c: phantoms of silicone on the board of thesis 4.3.1: shapes, stitches, grasps, lifts, sites.
//
// From the thesis: circle, clover, rectangle and drop, 6, 6, 5 and 12 mm thick, on a board of 144 x 144 mm with 7 x 7
// holes 18 mm apart; three sets of stitched holes each; three or four grasping points on the free part; flat, or over a
// capsule. Its Fig. 4.5 is not printed. Ours: outlines and sizes, the holes of each set, and the following rules.
//
// - A set has one region or two. Stitches hold what lies within 6 mm of the convex hull of a region's holes. The truth
//   is the vertices of the underside there.
// - Grasps are 7 mm inside the outline, 26 mm or more away from the regions. The first is the farthest one from the
//   regions, each further one the farthest from those before, while it is 25 mm or more away from them: at most four.
// - A lift goes up, and 30 degrees towards the nearest point of the regions. It ends at the last step of 10 mm, 60 mm
//   at most, at which the tip is no farther from that point than 1.1 times the distance before it: the free length.
// - The capsule is half an ellipsoid, 28 mm wide and 10 mm high, under a hole of the board: the one farthest from the
//   regions that is 15 mm inside the outline. The phantom before the lift is the flat one raised by a smooth bump over
//   the capsule that ends where the regions begin, within 34 mm. The raised shape is free of stress, in truth and twin:
//   the thesis warps its twin likewise, but its phantom is bent. In truth, gravity then lays it on the capsule.
//
// Silicones: Ecoflex 00-10 and 00-30, with moduli of the order that tensile tests report for small strain.
#include "studies/study_phantoms_case.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "omentum/tissue_material.h"

#define MM 1e-3
#define DEG (OM_PI / 180)
#define PITCH 0.018   // m, of the holes
#define STITCH 0.006  // m, around the hull of a region's holes
#define INSET 0.007   // m, of grasps
#define AWAY 0.026    // m, of grasps from regions
#define APART 0.025   // m, of grasps from each other
#define NBORDER 180   // candidates for grasps
#define INCLINE (30 * DEG)
#define FREE 1.1           // of the free length
#define CAPSULE_R 0.014    // m
#define CAPSULE_H 0.010    // m
#define CAPSULE_IN 0.015   // m, inside the outline
#define BUMP_H 0.0105      // m
#define BUMP_R 0.034       // m
#define WORLD_EDGE 0.0038  // m: more than twice the vertices of every twin
#define HALF_BOARD 0.060   // m: arms stand beside it
#define SEED 4100
#define SEED_DEV 9100

#define SOFT .young = 40e3, .density = 1040  // Ecoflex 00-10
#define FIRM .young = 70e3, .density = 1070  // Ecoflex 00-30

enum { CIRCLE, CLOVER, RECTANGLE, DROP, ELLIPSE, NOTCH };

const PhantomShape om__phantoms_shape[PHANTOM_NSHAPE + PHANTOM_NDEV] = {
    {"circle", .thickness = 6 * MM, .edge = 5.5 * MM, SOFT},
    {"clover", .thickness = 6 * MM, .edge = 5.5 * MM, FIRM},
    {"rectangle", .thickness = 5 * MM, .edge = 5.8 * MM, SOFT},
    {"drop", .thickness = 12 * MM, .edge = 5.5 * MM, FIRM},
    {"ellipse", .thickness = 6 * MM, .edge = 5.5 * MM, SOFT},
    {"notch", .thickness = 8 * MM, .edge = 5.5 * MM, FIRM},
};

const PhantomSet om__phantoms_set[PHANTOM_NSHAPE + PHANTOM_NDEV][PHANTOM_NSET] = {
    {// circle: left border; a bar through the middle; two squares
     {1, {4}, {{{0, 3}, {1, 1}, {1, 5}, {2, 3}}}},
     {1, {2}, {{{3, 1}, {3, 5}}}},
     {2, {4, 4}, {{{1, 4}, {2, 4}, {1, 5}, {2, 5}}, {{4, 1}, {5, 1}, {4, 2}, {5, 2}}}}},
    {// clover: one leaf; a triangle in the middle; two leaves opposite each other
     {1, {5}, {{{0, 3}, {1, 2}, {1, 4}, {2, 2}, {2, 4}}}},
     {1, {3}, {{{2, 3}, {3, 2}, {3, 4}}}},
     {2, {2, 2}, {{{3, 5}, {3, 6}}, {{3, 1}, {3, 0}}}}},
    {// rectangle: a short side; a long side; a corner
     {1, {4}, {{{0, 1}, {1, 1}, {0, 5}, {1, 5}}}},
     {1, {4}, {{{0, 1}, {6, 1}, {0, 2}, {6, 2}}}},
     {1, {3}, {{{0, 1}, {3, 1}, {0, 5}}}}},
    {// drop: round end; tip; a bar across
     {1, {4}, {{{0, 2}, {0, 4}, {1, 1}, {1, 5}}}},
     {1, {3}, {{{4, 2}, {4, 4}, {6, 3}}}},
     {1, {2}, {{{2, 1}, {2, 5}}}}},
    {// ellipse: one end; a square in the middle; two bars
     {1, {4}, {{{1, 2}, {1, 4}, {2, 2}, {2, 4}}}},
     {1, {4}, {{{2, 2}, {3, 2}, {2, 4}, {3, 4}}}},
     {2, {2, 2}, {{{1, 2}, {1, 4}}, {{5, 2}, {5, 4}}}}},
    {// notch: a part of the side opposite the notch; a corner; two corners
     {1, {4}, {{{1, 1}, {3, 1}, {1, 2}, {3, 2}}}},
     {1, {3}, {{{1, 1}, {2, 1}, {1, 3}}}},
     {2, {1, 3}, {{{1, 5}}, {{3, 1}, {5, 1}, {5, 3}}}}},
};

// ---- shapes -------------------------------------------------------------------------------------------------

static double disc(double x, double y, double cx, double cy, double r) {
    return hypot(x - cx, y - cy) - r;
}

static double box(double x, double y, double hx, double hy) {
    double dx = fabs(x) - hx, dy = fabs(y) - hy;
    return hypot(fmax(dx, 0), fmax(dy, 0)) + fmin(fmax(dx, dy), 0);
}

// Four leaves around a middle.
static double clover(double x, double y) {
    double d = disc(x, y, 0, 0, 20 * MM);
    for (int k = 0; k < 4; ++k)
        d = fmin(d,
                 disc(x, y, 30 * MM * cos(k * OM_PI / 2), 30 * MM * sin(k * OM_PI / 2), 29 * MM));
    return d;
}

// The hull of two discs on the x axis: a half plane decides which of the three parts is the nearest one.
static double drop(double x, double y) {
    const double from = -14 * MM, length = 64 * MM, r0 = 44 * MM, r1 = 8 * MM;
    double b = (r0 - r1) / length, a = sqrt(1 - b * b), u = x - from;
    y = fabs(y);
    double k = a * u - b * y;
    if (k < 0) return hypot(u, y) - r0;
    if (k > a * length) return hypot(u - length, y) - r1;
    return a * y + b * u - r0;
}

// A distance to first order.
static double ellipse(double x, double y, double a, double b) {
    double k0 = hypot(x / a, y / b), k1 = hypot(x / (a * a), y / (b * b));
    return k1 > 0 ? k0 * (k0 - 1) / k1 : -b;
}

double om__phantoms_outline(int shape, double x, double y) {
    switch (shape) {
    case CIRCLE: return disc(x, y, 0, 0, 58 * MM);
    case CLOVER: return clover(x, y);
    case RECTANGLE: return box(x, y, 60 * MM, 42 * MM);
    case DROP: return drop(x, y);
    case ELLIPSE: return ellipse(x, y, 58 * MM, 42 * MM);
    default: return fmax(box(x, y, 50 * MM, 50 * MM), -box(x, y - 40 * MM, 12 * MM, 24 * MM));
    }
}

OmVec3 om__phantoms_hole(int column, int row) {
    const double middle = (PHANTOM_NHOLE - 1) / 2.0;
    return om_vec3(PITCH * (column - middle), PITCH * (row - middle), 0);
}

// ---- regions ------------------------------------------------------------------------------------------------

// The point nearest to p of the convex hull of n points of the plane: p itself inside it, else on a line between two.
static OmVec3 hull_nearest(int n, const OmVec3* at, OmVec3 p) {
    OmVec3 best = at[0];
    bool is_inside = true, has_area = false;
    for (int i = 0; i < n; ++i) {
        if (om_distance(p, at[i]) < om_distance(p, best)) best = at[i];
        for (int j = 0; j < n; ++j) {
            if (j == i) continue;
            OmVec3 e = om_sub(at[j], at[i]);
            double t = om_dot(om_sub(p, at[i]), e) / om_norm2(e);  // holes differ
            OmVec3 q = om_madd(at[i], fmax(0, fmin(1, t)), e);
            if (om_distance(p, q) < om_distance(p, best)) best = q;
            // A side of the hull has all points on its left.
            bool is_side = true;
            for (int k = 0; k < n; ++k) {
                double side = om_cross(e, om_sub(at[k], at[i])).z;
                is_side = is_side && side > -1e-12;
                has_area = has_area || side > 1e-12;
            }
            if (is_side && om_cross(e, om_sub(p, at[i])).z < 0) is_inside = false;
        }
    }
    return is_inside && has_area ? p : best;
}

// The nearest point of the hulls of a set.
static OmVec3 nearest_held(const PhantomSet* set, OmVec3 p) {
    OmVec3 best = om_vec3(HUGE_VAL, 0, 0);
    for (int r = 0; r < set->nregion; ++r) {
        OmVec3 at[8] = {{0}};
        for (int i = 0; i < set->nhole[r]; ++i)
            at[i] = om__phantoms_hole(set->hole[r][i][0], set->hole[r][i][1]);
        OmVec3 q = hull_nearest(set->nhole[r], at, p);
        if (om_distance(p, q) < om_distance(p, best)) best = q;
    }
    return best;
}

double om__phantoms_region(const PhantomSet* set, double x, double y) {
    OmVec3 p = om_vec3(x, y, 0);
    return om_distance(p, nearest_held(set, p)) - STITCH;
}

// ---- the case -----------------------------------------------------------------------------------------------

double om__phantoms_height(const PhantomCase* c, double x, double y) {
    if (c->start == PHANTOM_FLAT) return 0;
    double s = hypot(x - c->capsule.x, y - c->capsule.y) / c->reach;  // reach > 0
    return s < 1 ? BUMP_H * (1 - s * s) * (1 - s * s) : 0;
}

static void place_capsule(PhantomCase* c) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    double best = 0;
    for (int k = 0; k < PHANTOM_NHOLE * PHANTOM_NHOLE; ++k) {
        OmVec3 p = om__phantoms_hole(k % PHANTOM_NHOLE, k / PHANTOM_NHOLE);
        double d = om__phantoms_region(set, p.x, p.y);
        if (om__phantoms_outline(c->shape, p.x, p.y) > -CAPSULE_IN || d <= best + 1e-9) continue;
        best = d;
        c->capsule = p;
    }
    c->reach = fmin(BUMP_R, best);
}

// The point of the border in a direction from the origin, moved inside by INSET. Outlines are seen whole from there.
static OmVec3 border_point(int shape, double angle) {
    OmVec3 d = om_vec3(cos(angle), sin(angle), 0);
    double lo = 0, hi = 0.1;
    for (int k = 0; k < 50; ++k) {
        double r = 0.5 * (lo + hi);
        if (om__phantoms_outline(shape, r * d.x, r * d.y) < -INSET)
            lo = r;
        else
            hi = r;
    }
    return om_scale(lo, d);
}

static void find_grasps(PhantomCase* c) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    for (c->ngrasp = 0; c->ngrasp < PHANTOM_NGRASP; ++c->ngrasp) {
        double best = 0;
        OmVec3 at = om_vec3(0, 0, 0);
        for (int k = 0; k < NBORDER; ++k) {
            OmVec3 p = border_point(c->shape, k * 2 * OM_PI / NBORDER);
            double away = om__phantoms_region(set, p.x, p.y), d = away;
            if (away < AWAY) continue;
            for (int g = 0; g < c->ngrasp; ++g) {
                double apart = om_distance(p, om_vec3(c->grasp[g].x, c->grasp[g].y, 0));
                d = g == 0 ? apart : fmin(d, apart);
                if (apart < APART) d = 0;
            }
            if (d <= best + 1e-9) continue;
            best = d;
            at = p;
        }
        if (!(best > 0)) return;
        at.z = om__phantoms_shape[c->shape].thickness + om__phantoms_height(c, at.x, at.y);
        c->grasp[c->ngrasp] = at;
    }
}

static void plan_lift(PhantomCase* c, int g) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    OmVec3 from = om_vec3(c->grasp[g].x, c->grasp[g].y, 0);
    OmVec3 way = om_sub(nearest_held(set, from), from);  // AWAY or longer
    c->lift[g] = om_madd(om_vec3(0, 0, 1), tan(INCLINE), om_normalize(way));
    for (int k = 1; k <= PHANTOM_NLEVEL; ++k) {
        OmVec3 tip = om_scale(k * PHANTOM_STEP, c->lift[g]);
        if (om_distance(tip, way) <= FREE * om_norm(way)) c->nlevel[g] = k;
    }
}

PhantomCase om__phantoms_case(int shape, int set, PhantomStart start) {
    PhantomCase c = {.shape = shape, .set = set, .start = start};
    place_capsule(&c);
    find_grasps(&c);
    for (int g = 0; g < c.ngrasp; ++g) plan_lift(&c, g);
    return c;
}

void om__phantoms_name(const PhantomCase* c, char* name, size_t size) {
    snprintf(name, size, "%s-%d-%s", om__phantoms_shape[c->shape].name, c->set + 1,
             c->start == PHANTOM_FLAT ? "flat" : "capsule");
}

uint64_t om__phantoms_seed(const PhantomCase* c, int grasp) {
    bool is_dev = c->shape >= PHANTOM_NSHAPE;
    int k = ((c->shape * PHANTOM_NSET + c->set) * PHANTOM_NSTART + (int)c->start) * PHANTOM_NGRASP;
    return (uint64_t)((is_dev ? SEED_DEV : SEED) + k + grasp);
}

// ---- scene and site -----------------------------------------------------------------------------------------

OmScene om__phantoms_scene(const PhantomCase* c, OmSiteRole role) {
    const PhantomShape* shape = &om__phantoms_shape[c->shape];
    OmScene s = om_scene_default();
    om__phantoms_name(c, s.name, sizeof s.name);
    s.tissue.element = OM_ELEMENT_QUADRATIC;
    s.tissue.young = shape->young;
    s.tissue.density = shape->density;
    s.tissue.size.z = shape->thickness;
    s.rgbd.elevation = 50 * DEG;
    if (role == OM_SITE_TWIN) return s;
    s.tissue.law = OM_MOONEY_RIVLIN;
    s.tissue.poisson = 0.47;
    s.tissue.friction = 0.5;
    s.tissue.rayleigh_mass = 2;  // the world waits for rest at every level
    return s;
}

typedef struct Solid {
    int shape;
    double thickness;
} Solid;

static double solid_fn(void* ctx, OmVec3 p) {
    const Solid* s = ctx;
    double h = 0.5 * s->thickness;
    return fmax(om__phantoms_outline(s->shape, p.x, p.y), fabs(p.z - h) - h);
}

static double capsule_fn(void* ctx, OmVec3 p) {
    const PhantomCase* c = ctx;
    return om_half_ellipsoid_eval(om_vec3(CAPSULE_R, CAPSULE_R, CAPSULE_H), om_sub(p, c->capsule));
}

// Sets "underside" and "top" of the flat mesh, and the truth's "attachment" where `is_held`.
static OmStatus name_sets(const PhantomCase* c, bool is_held, OmTetMesh* mesh) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    double t = om__phantoms_shape[c->shape].thickness;
    int *list, n[3] = {0};
    size_t most = (size_t)mesh->nvert;
    OM_ALLOC(list, 3 * most);
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        bool is_under = p.z < 0.02 * t;
        if (is_under) list[n[0]++] = i;
        if (p.z > 0.98 * t) list[most + (size_t)n[1]++] = i;
        if (is_under && is_held && om__phantoms_region(set, p.x, p.y) <= 0)
            list[2 * most + (size_t)n[2]++] = i;
    }
    static const char* const name[3] = {"underside", "top", "attachment"};
    OmStatus status = OM_OK;
    for (int k = 0; k < 3 && status == OM_OK; ++k)
        status = om_tet_mesh_add_set(mesh, name[k], list + (size_t)k * most, n[k]);
    om_free(list);
    return status;
}

static OmStatus make_mesh(const PhantomCase* c, double edge, bool is_held, OmTetMesh* mesh) {
    Solid solid = {c->shape, om__phantoms_shape[c->shape].thickness};
    const double r = 0.072;
    OmStuffDef def = om_stuff_default_def(edge, solid_fn, &solid, om_vec3(-r, -r, -0.004),
                                          om_vec3(r, r, solid.thickness + 0.004));
    OM_TRY(om_tet_mesh_stuff(&def, mesh));
    OM_TRY(name_sets(c, is_held, mesh));
    // A shear: volumes stay.
    for (int i = 0; i < mesh->nvert; ++i) {
        OmVec3 p = om_load3(mesh->x, i);
        p.z += om__phantoms_height(c, p.x, p.y);
        om_store3(mesh->x, i, p);
    }
    return om_tet_mesh_validate(mesh);
}

static OmStatus make_capsule(const PhantomCase* c, OmSite* site) {
    PhantomCase copy = *c;
    OmSdfDef def = om_sdf_default_def(0.001);
    def.margin = 0.01;
    OmVec3 r = om_vec3(CAPSULE_R + 0.002, CAPSULE_R + 0.002, 0.002);
    OmVec3 top = om_vec3(r.x, r.y, CAPSULE_H + 0.002);
    site->has_organ = true;
    OM_TRY(om_sdf_from_function(capsule_fn, &copy, om_sub(c->capsule, r), om_add(c->capsule, top),
                                &def, &site->organ_sdf));
    return om_surface_from_sdf(&site->organ_sdf, 0, &site->organ);
}

OmStatus om__phantoms_site(const PhantomCase* c, OmSiteRole role, double coarse,
                           const OmScene* scene, OmSite* site) {
    double edge = coarse * (role == OM_SITE_WORLD ? WORLD_EDGE : om__phantoms_shape[c->shape].edge);
    memset(site, 0, sizeof *site);
    site->role = role;
    site->pose_world_task = site->pose_world_field = om_pose_identity();
    site->half_size = om_vec3(HALF_BOARD, HALF_BOARD, 0.5 * om__phantoms_shape[c->shape].thickness);
    site->has_ground = true;
    site->gravity = om_vec3(0, 0, -scene->tissue.gravity);
    OmStatus status = make_mesh(c, edge, role == OM_SITE_WORLD, &site->mesh);
    if (status == OM_OK && c->start == PHANTOM_CAPSULE) status = make_capsule(c, site);
    om_site_set_numbers(scene, site);
    if (status < 0) om_site_done(site);
    return status;
}

void om__phantoms_held(const PhantomCase* c, const OmSite* site, unsigned char* attached) {
    const PhantomSet* set = &om__phantoms_set[c->shape][c->set];
    const OmMeshSet* under = om_tet_mesh_find_set(&site->mesh, "underside");
    memset(attached, 0, (size_t)site->mesh.nvert);
    for (int i = 0; i < under->nvert; ++i) {
        OmVec3 p = om_load3(site->mesh.x, under->vert[i]);
        attached[under->vert[i]] = om__phantoms_region(set, p.x, p.y) <= 0;
    }
}
