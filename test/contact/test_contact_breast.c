// test_contact_breast.c: a breast pressed between two paddles, against the same breast pressed by another code.
//
// The data (VICTRE, see the README beside them): labels of a breast, and of the same breast after its compression to
// 49.8 mm by FEBio, paddles included. The mesh, its tissues and the paddles come from the labels; the compressed
// tissue is looked at only in the end: where the nipple is, and how much volume is left. Linear tetrahedra of about
// 4 mm, neo-Hookean, nu = 0.49, skin and what is neither gland nor fat taken as fat.
#include "test_rig.h"

#include "omentum/image.h"
#include "omentum/shape_meshing.h"

#define COARSE 4      // voxels of 0.2 mm a side of the volumes that shapes are made from
#define TRAVEL 0.022  // m, of each paddle
#define LABEL_GLAND 29
#define LABEL_NIPPLE 33
#define LABEL_MUSCLE 40
#define LABEL_PADDLE 50

static int label_at(const OmVolume* v, OmVec3 p) {
    int k[3];
    const double place[3] = {p.x, p.y, p.z},
                 origin[3] = {v->grid.origin.x, v->grid.origin.y, v->grid.origin.z};
    for (int c = 0; c < 3; ++c) {
        k[c] = (int)floor((place[c] - origin[c]) / v->grid.axis.cx.x + 0.5);
        if (k[c] < 0 || k[c] >= v->grid.dim[c]) return 0;
    }
    return (int)om_volume_value(v, om_grid_index(v->grid.dim, k[0], k[1], k[2]));
}

static bool is_tissue(int label) { return label != 0 && label != LABEL_PADDLE; }

// Mean place of a label's voxels.
static OmVec3 centroid_of(const OmVolume* v, int label) {
    OmVec3 sum = {0, 0, 0};
    size_t num = 0, at = 0;
    for (int k = 0; k < v->grid.dim[2]; ++k)
        for (int j = 0; j < v->grid.dim[1]; ++j)
            for (int i = 0; i < v->grid.dim[0]; ++i, ++at) {
                if ((int)om_volume_value(v, at) != label) continue;
                sum = om_add(sum, om_vec3(i, j, k));
                ++num;
            }
    assert_true(num > 0);
    return om_madd(v->grid.origin, v->grid.axis.cx.x / (double)num, sum);
}

static double volume_of(const OmVolume* v) {
    size_t num = 0, all = om_volume_count(v);
    for (size_t k = 0; k < all; ++k) num += is_tissue((int)om_volume_value(v, k));
    return (double)num * pow(v->grid.axis.cx.x, 3);
}

// A paddle is a plate of 1 mm: what lies behind it becomes paddle too, so that there is one way out.
static void thicken(OmMask* mask, int side) {
    for (int j = 0; j < mask->grid.dim[1]; ++j)
        for (int i = 0; i < mask->grid.dim[0]; ++i) {
            bool is_behind = false;
            for (int n = 0; n < mask->grid.dim[2]; ++n) {
                int k = side > 0 ? n : mask->grid.dim[2] - 1 - n;
                unsigned char* at = &mask->inside[om_grid_index(mask->grid.dim, i, j, k)];
                is_behind |= *at != 0;
                *at = is_behind;
            }
        }
}

// Distance field of the tissue (side 0), or of the paddle above (1) or below (-1).
static void make_sdf(const OmVolume* v, int side, OmSdf* sdf) {
    OmMask mask;
    double step = COARSE * v->grid.axis.cx.x;
    assert_ok(om_mask_init(&mask, v->grid.dim[0] / COARSE, v->grid.dim[1] / COARSE,
                           v->grid.dim[2] / COARSE));
    mask.grid.axis = om_mat3_diag(om_vec3(step, step, step));
    mask.grid.origin =
        om_madd(v->grid.origin, 0.5 * (COARSE - 1) * v->grid.axis.cx.x, om_vec3(1, 1, 1));
    size_t at = 0;
    for (int k = 0; k < mask.grid.dim[2]; ++k)
        for (int j = 0; j < mask.grid.dim[1]; ++j)
            for (int i = 0; i < mask.grid.dim[0]; ++i, ++at) {
                OmVec3 p = om_madd(mask.grid.origin, step, om_vec3(i, j, k));
                int label = label_at(v, p);
                mask.inside[at] =
                    side == 0 ? is_tissue(label) : label == LABEL_PADDLE && p.z * side > 0;
            }
    if (side != 0) thicken(&mask, side);
    assert_ok(om_mask_crop(&mask, 4));
    if (side == 0) {
        assert_ok(om_mask_keep_parts(&mask, 6, 0, NULL, NULL));
        assert_ok(om_mask_fill_holes(&mask));
    }
    OmSdfDef def = om_sdf_default_def(step);
    def.margin = 0.01;
    assert_ok(om_sdf_from_mask(&mask, &def, sdf));
    om_mask_done(&mask);
}

typedef struct Paddle {
    OmSdf sdf;
    double lift;  // m, up from where the label is
} Paddle;

static double paddle_distance(const void* ctx, OmVec3 p, OmVec3* gradient) {
    const Paddle* paddle = ctx;
    double d = om_sdf_eval(&paddle->sdf, om_sub(p, om_vec3(0, 0, paddle->lift)), gradient);
    double steep = om_norm(*gradient);
    if (!(steep > 1e-6)) return INFINITY;
    *gradient = om_scale(1 / steep, *gradient);
    return d;
}

static double mesh_volume(const OmTetMesh* mesh, const double* x) {
    double sum = 0;
    for (int e = 0; e < mesh->ntet; ++e) {
        const int* v = mesh->tet_vert + 4 * (size_t)e;
        OmVec3 o = om_load3(x, v[0]);
        sum += om_dot(om_cross(om_sub(om_load3(x, v[1]), o), om_sub(om_load3(x, v[2]), o)),
                      om_sub(om_load3(x, v[3]), o)) /
               6;
    }
    return sum;
}

// The mesh of the tissue: label 1 where most of an element is gland, vertices in muscle attached.
static void make_mesh(const OmVolume* v, double edge, OmTetMesh* mesh) {
    OmSdf sdf;
    OmVec3 lo, hi;
    make_sdf(v, 0, &sdf);
    om_sdf_bounds(&sdf, &lo, &hi);
    OmStuffDef def = om_stuff_default_def(edge, om_sdf_shape_fn, &sdf, lo, hi);
    assert_ok(om_tet_mesh_stuff(&def, mesh));
    om_sdf_done(&sdf);
    int* held = om_alloc((size_t)mesh->nvert, sizeof *held);
    int num = 0;
    for (int i = 0; i < mesh->nvert; ++i)
        if (label_at(v, om_load3(mesh->x, i)) == LABEL_MUSCLE) held[num++] = i;
    assert_true(num > 0);
    assert_ok(om_tet_mesh_add_set(mesh, "attachment", held, num));
    om_free(held);
    OmRng rng = om_rng_init(1, 0);
    for (int e = 0; e < mesh->ntet; ++e) {
        int ngland = 0;
        for (int n = 0; n < 16; ++n) {  // uniform in the element, by barycentric spacings
            double w[4], sum = 0;
            for (int a = 0; a < 4; ++a) sum += w[a] = -log(1 - om_rng_uniform(&rng));
            OmVec3 p = {0, 0, 0};
            for (int a = 0; a < 4; ++a)
                p = om_madd(p, w[a] / sum, om_load3(mesh->x, mesh->tet_vert[4 * e + a]));
            ngland += label_at(v, p) == LABEL_GLAND;
        }
        mesh->tet_label[e] = ngland > 8;
    }
}

static void load(const char* name, OmVolume* v) {
    char relative[256];
    snprintf(relative, sizeof relative, "breast_victre/%s", name);
    if (om_volume_load(test_data(relative), v) < 0) fail_msg("%s", om_error_message());
}

// Between the paddles, which travel for 150 steps and stay for 100: then it must be still, and outside of them.
static void compress(double edge, double most_off) {
    OmVolume before, after;
    load("p_1.nhdr", &before);
    load("pc_1.nhdr", &after);
    TestRig r;
    memset(&r, 0, sizeof r);
    make_mesh(&before, edge, &r.mesh);
    Paddle paddle[2] = {{.lift = TRAVEL}, {.lift = -TRAVEL}};
    make_sdf(&after, 1, &paddle[0].sdf);
    make_sdf(&after, -1, &paddle[1].sdf);
    OmVec3 nipple = centroid_of(&before, LABEL_NIPPLE), goal = centroid_of(&after, LABEL_NIPPLE);
    double expected = volume_of(&after) / volume_of(&before);
    om_volume_done(&before);
    om_volume_done(&after);
    OmMaterial material[2] = {{.young = 5000, .poisson = 0.49, .law = OM_NEO_HOOKEAN},
                              {.young = 15000, .poisson = 0.49, .law = OM_NEO_HOOKEAN}};
    r.def = om_tissue_default_def(om_fem_engine(), &r.mesh);
    r.def.element = OM_ELEMENT_LINEAR;
    r.def.nmaterial = 2;
    r.def.material = material;
    r.def.gravity = om_vec3(0, 0, 0);
    r.def.rayleigh_mass = 2;
    rig_start(&r);
    OmTissueObstacle field[2] = {om_field_obstacle(paddle_distance, &paddle[0]),
                                 om_field_obstacle(paddle_distance, &paddle[1])};
    OmContactDef contact = om_contact_default_def();
    contact.nobstacle = 2;
    contact.obstacle = field;
    contact.max_iterations = 6;
    rig_contact(&r, &contact);
    OmEmbedding at;
    double place[3], deepest = 0;
    int nsub = 0;
    om_store3(place, 0, nipple);
    assert_ok(om_tissue_embed(r.m, 1, place, &at));
    const int nmove = 150, nrest = 100;
    for (int n = 1; n <= nmove + nrest; ++n) {
        double left = TRAVEL * fmax(0, 1 - (double)n / nmove);
        paddle[0].lift = left;
        paddle[1].lift = -left;
        OmContactReport report;
        if (om_contact_step(r.cw, r.m, r.s, r.w, 0.02, &report) < 0)
            fail_msg("%s", om_error_message());
        nsub += report.tissue.substeps;
        deepest = n == nmove + nrest ? report.penetration : deepest;
        if (n % 25 == 0) {
            om_embedding_eval(&at, om_tissue_x(r.s), place);
            printf("%4d: %d contacts, %.3g N, nipple at (%.2f, %.2f, %.2f) mm, %d solves\n", n,
                   report.ncontact, om_norm(report.force), 1e3 * place[0], 1e3 * place[1],
                   1e3 * place[2], report.nsolve);
        }
    }
    om_embedding_eval(&at, om_tissue_x(r.s), place);
    double off = om_norm(om_sub(om_load3(place, 0), goal));
    double ratio = mesh_volume(&r.mesh, om_tissue_x(r.s)) / mesh_volume(&r.mesh, r.mesh.x);
    printf(
        "%d elements: nipple (%.2f, %.2f, %.2f), FEBio (%.2f, %.2f, %.2f) mm: %.2f mm off; moved by "
        "%.1f mm; volume %.4f of what it was, FEBio %.4f; %d substeps, penetration %.3f mm\n",
        r.mesh.ntet, 1e3 * place[0], 1e3 * place[1], 1e3 * place[2], 1e3 * goal.x, 1e3 * goal.y,
        1e3 * goal.z, 1e3 * off, 1e3 * om_norm(om_sub(goal, nipple)), ratio, expected, nsub,
        1e3 * deepest);
    double fastest = 0;
    for (int i = 0; i < r.mesh.nvert; ++i)
        fastest = fmax(fastest, om_norm(om_load3(om_tissue_v(r.s), i)));
    printf("after 2 s at rest %.3g mm/s, in by %.3g um\n", 1e3 * fastest, 1e6 * deepest);
    assert_below(fastest, 1e-3);
    assert_below(deepest, 1e-5);
    assert_below(off, most_off);
    assert_near(ratio, expected, 0.01);
    om_embedding_done(&at);
    om_sdf_done(&paddle[0].sdf);
    om_sdf_done(&paddle[1].sdf);
    rig_done(&r);
}

static void test_compression(void** context) {
    (void)context;
    compress(0.004, 0.003);
}

// Coarse tissue on plates of 0.8 mm cells moved at 0.1 m/s, 1.4 mm inside, when planes were laid once a step.
static void test_coarse_comes_to_rest(void** context) {
    (void)context;
    compress(0.009, 0.004);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_compression),
                                       cmocka_unit_test(test_coarse_comes_to_rest)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
