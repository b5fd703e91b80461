// banet_sample.c: one sample of the data: body, attachments, load, equilibrium, view (thesis 4.2.1).
//
// Draw number k of sample i is a function of (seed, i, k) alone; it has two random streams, one for the camera.
// A draw is rejected if the body does not fit its box, if a region of attachments has fewer than three vertices, if the
// solver finds no equilibrium, or if the result is out of range.
#include <string.h>

#include "banet/banet_internal.h"
#include "banet/banet_view_internal.h"

#define COOKIE 0x16ba5a3eu
#define DRAW_SHIFT 40  // bits of the index in the number of a random stream; the draw is above
#define KIND_STREAM ((uint64_t)1 << 63)

const char* om_banet_way_name(OmBanetWay way) {
    static const char* const name[OM_BANET_NWAY] = {"exact", "camera", "mixed"};
    return name[way];
}

OmBanetSampleDef om_banet_sample_default_def(uint64_t seed) {
    return (OmBanetSampleDef){
        .seed = seed,
        .way = OM_BANET_MIXED,
        .side = 0.3,
        .extent = {0.06, 0.2},
        .thickness = {0.007, 0.02},
        .max_dim = {48, 48, 16},
        .share = {0.05, 0.5},
        .visible = {0.1, 1},
        .element = OM_TET10,
        .law = OM_NEO_HOOKEAN,
        .young = {3000, 30000},
        .poisson = {0.4, 0.45},
        .radius = {0.004, 0.01},
        .pull = {0.3, 2.5},
        .min_u = 0.005,
        .max_u = 0.15,
        .tolerance = 1e-4,
        .min_volume = 0.05,
        .max_attempt = 64,
        .cookie = COOKIE,
    };
}

OmStatus om_banet_sample_def_validate(const OmBanetSampleDef* d) {
    OM_CHECK(d->cookie == COOKIE, OM_INVALID,
             "OmBanetSampleDef was not made by om_banet_sample_default_def");
    const struct {
        const char* name;
        double value, min, max;
    } field[] = {
        {"way", d->way, 0, OM_BANET_NWAY - 1},
        {"side", d->side, 0.01, 10},
        {"extent[0]", d->extent[0], 0.001, d->extent[1]},
        {"extent[1]", d->extent[1], d->extent[0], 10},
        {"thickness[0]", d->thickness[0], 0.0001, d->thickness[1]},
        {"thickness[1]", d->thickness[1], d->thickness[0], 10},
        {"max_dim[0]", d->max_dim[0], 16, 512},
        {"max_dim[1]", d->max_dim[1], 16, 512},
        {"max_dim[2]", d->max_dim[2], 16, 512},
        {"share[0]", d->share[0], 1e-3, d->share[1]},
        {"share[1]", d->share[1], d->share[0], 0.9},
        {"visible[0]", d->visible[0], 0, d->visible[1]},
        {"visible[1]", d->visible[1], d->visible[0], 1},
        {"two_share", d->two_share, 0, 1},
        {"board_share", d->board_share, 0, 1},
        {"element", d->element, OM_TET4, OM_TET10},
        {"law", d->law, 0, OM_NLAW - 1},
        {"young[0]", d->young[0], 1, d->young[1]},
        {"young[1]", d->young[1], d->young[0], 1e9},
        {"poisson[0]", d->poisson[0], 0, d->poisson[1]},
        {"poisson[1]", d->poisson[1], d->poisson[0], OM_MAX_POISSON},
        {"radius[0]", d->radius[0], 0, d->radius[1]},
        {"radius[1]", d->radius[1], d->radius[0], 1},
        {"pull[0]", d->pull[0], 0, d->pull[1]},
        {"pull[1]", d->pull[1], d->pull[0], 100},
        {"min_u", d->min_u, 0, d->max_u},
        {"max_u", d->max_u, 1e-6, 100},
        {"tolerance", d->tolerance, 1e-12, 0.01},
        {"min_volume", d->min_volume, 0, 0.99},
        {"max_attempt", d->max_attempt, 1, 1 << 20},
    };
    for (size_t k = 0; k < sizeof field / sizeof *field; ++k)
        OM_CHECK(field[k].value >= field[k].min && field[k].value <= field[k].max, OM_INVALID,
                 "OmBanetSampleDef.%s = %g, must be in %g .. %g", field[k].name, field[k].value,
                 field[k].min, field[k].max);
    if (d->body) OM_TRY(om_tet_mesh_validate(d->body));
    return OM_OK;
}

static uint64_t hash_number(double value, uint64_t hash) {
    return om_hash(&value, sizeof value, hash);
}

uint64_t om_banet_sample_def_hash(const OmBanetSampleDef* d) {
    const double number[] = {
        d->way,          d->side,       d->extent[0],  d->extent[1],   d->thickness[0],
        d->thickness[1], d->max_dim[0], d->max_dim[1], d->max_dim[2],  d->share[0],
        d->share[1],     d->visible[0], d->visible[1], d->two_share,   d->board_share,
        d->law,          d->young[0],   d->young[1],   d->poisson[0],  d->poisson[1],
        d->radius[0],    d->radius[1],  d->pull[0],    d->pull[1],     d->min_u,
        d->max_u,        d->tolerance,  d->min_volume, d->max_attempt, d->body != NULL};
    uint64_t h = om_hash(&d->seed, sizeof d->seed, OM_HASH_SEED);
    for (size_t k = 0; k < sizeof number / sizeof *number; ++k) h = hash_number(number[k], h);
    // sets of linear elements have the hash that they had before there were others
    if (d->element != OM_TET4) h = hash_number(d->element, h);
    if (d->body) {
        h = om_hash(d->body->x, 3 * (size_t)d->body->nvert * sizeof(double), h);
        h = om_hash(d->body->tet_vert, 4 * (size_t)d->body->ntet * sizeof(int), h);
    }
    return h;
}

void om_banet_sample_done(OmBanetSample* s) {
    om_tet_mesh_done(&s->mesh);
    om_free(s->node);
    om_surface_done(&s->surface);
    om_free(s->surface_vert);
    om_free(s->attached);
    om_free(s->grasped);
    om_free(s->rest);
    om_free(s->x);
    om_free(s->u);
    om_free(s->seen);
    *s = (OmBanetSample){0};
}

// ---- draws ------------------------------------------------------------------------------------------

// What a sample is does not depend on its draw: draws that fail do not change the fractions of the definition.
static void draw_kind(const OmBanetSampleDef* def, int64_t index, OmBanetSample* s) {
    OmRng rng = om_rng_init(def->seed, (uint64_t)index | KIND_STREAM);
    s->index = index;
    s->nregion = om_rng_uniform(&rng) < def->two_share ? 2 : 1;
    s->has_board = om_rng_uniform(&rng) < def->board_share;
    bool is_camera = om_rng_uniform(&rng) < 0.5;
    s->is_camera = def->way == OM_BANET_MIXED ? is_camera : def->way == OM_BANET_CAMERA;
}

// One draw. *is_good: it is a sample.
static OmStatus draw(const OmBanetSampleDef* def, int64_t index, int attempt,
                     const OmProgress* watch, OmBanetSample* s, bool* is_good) {
    uint64_t stream = (uint64_t)index + ((uint64_t)(2 * attempt) << DRAW_SHIFT);
    OmRng rng = om_rng_init(def->seed, stream);
    draw_kind(def, index, s);
    s->nattempt = attempt + 1;
    s->material = (OmMaterial){.law = def->law,
                               .young = om_rng_range(&rng, def->young[0], def->young[1]),
                               .poisson = om_rng_range(&rng, def->poisson[0], def->poisson[1])};
    OM_TRY(om__banet_body(def, &rng, s, is_good));
    if (!*is_good) return OM_OK;
    OM_TRY(om_tet_mesh_boundary(&s->mesh, &s->surface, &s->surface_vert));
    OM_TRY(om__banet_attach(def, &rng, s, is_good));
    if (!*is_good) return OM_OK;
    OM_TRY(om__banet_grasp(def, &rng, s, is_good));
    if (!*is_good) return OM_OK;
    OM_TRY(om__banet_solve(def, watch, s, is_good));
    s->nfail += !*is_good;
    if (!*is_good) return OM_OK;
    OM_ALLOC(s->u, 3 * (size_t)s->surface.nvert);
    OM_ALLOC(s->seen, s->surface.nvert);
    memset(s->u, 0, 3 * (size_t)s->surface.nvert * sizeof *s->u);
    memset(s->seen, 0, (size_t)s->surface.nvert * sizeof *s->seen);
    if (!s->is_camera) return om__banet_see(def, &rng, s);
    OmRng view = om_rng_init(def->seed, stream + ((uint64_t)1 << DRAW_SHIFT));
    OmStatus status = om__banet_view(&view, s);
    *is_good = status == OM_OK;
    return status < 0 ? status : OM_OK;
}

OmStatus om_banet_sample_make(const OmBanetSampleDef* def, int64_t index, OmBanetSample* sample) {
    return om__banet_sample_watched(def, index, NULL, sample);
}

OmStatus om__banet_sample_watched(const OmBanetSampleDef* def, int64_t index,
                                  const OmProgress* watch, OmBanetSample* sample) {
    *sample = (OmBanetSample){0};
    OM_TRY(om_banet_sample_def_validate(def));
    OM_CHECK(index >= 0 && index < (int64_t)1 << DRAW_SHIFT, OM_INVALID,
             "om_banet_sample_make: index %lld is out of range", (long long)index);
    double begin = om_clock_now();
    int nfail = 0;
    for (int attempt = 0; attempt < def->max_attempt; ++attempt) {
        bool is_good = false;
        sample->nfail = nfail;
        OmStatus status = draw(def, index, attempt, watch, sample, &is_good);
        if (status == OM_OK && is_good) {
            sample->seconds = om_clock_now() - begin;
            return OM_OK;
        }
        nfail = sample->nfail;
        om_banet_sample_done(sample);
        if (status < 0) return status;
    }
    return om_error(OM_NOT_CONVERGED, "banet: none of %d draws of sample %lld has an equilibrium",
                    def->max_attempt, (long long)index);
}
