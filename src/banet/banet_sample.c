// banet_sample.c: one sample of the data: body, attachments, load, equilibrium, view (thesis 4.2.1).
#include "omentum/banet_sample.h"

#define COOKIE 0x16ba5a3eu

OmBanetSampleDef om_banet_sample_default_def(uint64_t seed) {
    return (OmBanetSampleDef){
        .seed = seed,
        .way = OM_BANET_MIXED,
        .side = 0.3,
        .extent = {0.06, 0.2},
        .thickness = {0.005, 0.02},
        .max_dim = {48, 48, 16},
        .share = {0.05, 0.5},
        .visible = {0.1, 1},
        .law = OM_NEO_HOOKEAN,
        .young = {3000, 30000},
        .poisson = {0.4, 0.45},
        .radius = {0.004, 0.01},
        .pull = {0.05, 0.6},
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
        {"share[0]", d->share[0], 0, d->share[1]},
        {"share[1]", d->share[1], d->share[0], 0.9},
        {"visible[0]", d->visible[0], 0, d->visible[1]},
        {"visible[1]", d->visible[1], d->visible[0], 1},
        {"two_share", d->two_share, 0, 1},
        {"board_share", d->board_share, 0, 1},
        {"law", d->law, 0, OM_NLAW - 1},
        {"young[0]", d->young[0], 1, d->young[1]},
        {"young[1]", d->young[1], d->young[0], 1e9},
        {"poisson[0]", d->poisson[0], 0, d->poisson[1]},
        {"poisson[1]", d->poisson[1], d->poisson[0], OM_MAX_POISSON},
        {"radius[0]", d->radius[0], 0, d->radius[1]},
        {"radius[1]", d->radius[1], d->radius[0], 1},
        {"pull[0]", d->pull[0], 1e-6, 10},
        {"pull[1]", d->pull[1], 0, 5},
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

void om_banet_sample_done(OmBanetSample* s) {
    om_tet_mesh_done(&s->mesh);
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

OmStatus om_banet_sample_make(const OmBanetSampleDef* def, int64_t index, OmBanetSample* sample) {
    *sample = (OmBanetSample){0};
    OM_TRY(om_banet_sample_def_validate(def));
    return om_error(OM_UNAVAILABLE, "om_banet_sample_make: sample %lld: bodies are not built in",
                    (long long)index);
}
