// banet_origin.c: what a network was trained on, as its file states it, compared with its use.
//
// The network reads lengths in voxels. So the side of the grid may differ from that of training as long as bodies have
// about as many voxels: training bodies are 7-20 mm thick, a factor of 3. Beyond a factor of 2 every body is thinner or
// thicker in voxels than most bodies of training. om_banet_default_side gives a thin sheet the smaller grid for the
// same reason.
#include <stdlib.h>
#include <string.h>

#include "banet/banet_net_internal.h"

#define MOST 2.0  // ratio of the sides of use and training, or the reverse
#define GENERATOR_NAME "omentum banet "

static bool is_near(double a, double b) { return fabs(a - b) <= 1e-6 * b; }

void om__banet_generator_name(char name[OM_BANET_ORIGIN]) {
    snprintf(name, OM_BANET_ORIGIN, GENERATOR_NAME "%d", OM_BANET_GENERATOR);
}

OmStatus om__banet_origin_add(const OmBanetData* data, OmFacts* facts) {
    const char* const fact[][2] = {{"generator", data->generator},
                                   {"way", data->way},
                                   {"law", data->law},
                                   {"element", data->element}};
    for (size_t i = 0; i < sizeof fact / sizeof *fact; ++i)
        if (fact[i][1][0]) OM_TRY(om_facts_add(facts, fact[i][0], "%s", fact[i][1]));
    if (!(data->side > 0)) return OM_OK;
    OM_TRY(om_facts_add(facts, "side_m", "%.9g", data->side));
    return om_facts_add(facts, "voxel_m", "%.9g", data->side / OM_BANET_SIDE_CELL);
}

OmStatus om__banet_origin_read(const char* path, OmBanetNet* net) {
    const char* text = om_facts_find(&net->facts, "side_m");
    if (!text) return OM_OK;
    const char* at = text;
    const bool is_good = om_number_parse(&at, text + strlen(text), &net->side) && !*at;
    OM_CHECK(is_good && net->side >= 1e-3 && net->side <= 100, OM_INVALID,
             "%s: side_m is \"%.20s\"; a number from 0.001 to 100", path, text);
    return OM_OK;
}

double om_banet_net_side(const OmBanetNet* net) { return net->side; }

// The number in "omentum banet 1"; 0: another text, or none.
static int generator_of(const char* name) {
    const size_t n = strlen(GENERATOR_NAME);
    return name && strncmp(name, GENERATOR_NAME, n) == 0 ? atoi(name + n) : 0;
}

static OmStatus check_side(const OmBanetNet* net, double side, OmText* note) {
    const double was = net->side, ratio = was > 0 ? side / was : 1;
    if (!(was > 0))
        return om_text_append(note, "side of the grid and voxel of its training: not stated\n");
    OM_CHECK(
        ratio <= MOST * (1 + 1e-6) && ratio * MOST >= 1 - 1e-6, OM_INVALID,
        "BA-Net was trained on voxels of %.3g mm (a grid of %.4g mm) and is used with %.3g mm (%.4g mm): its "
        "probabilities would mean nothing; use a network of samples by omentum banet generate --side %.4g",
        1e3 * was / OM_BANET_SIDE_CELL, 1e3 * was, 1e3 * side / OM_BANET_SIDE_CELL, 1e3 * side,
        1e3 * side);
    const bool is_meant = is_near(was, OM_BANET_WIDE) && is_near(side, OM_BANET_NARROW);
    if (is_near(side, was) || is_meant) return OM_OK;
    return om_text_append(
        note,
        "trained on voxels of %.3g mm (a grid of %.4g mm), used with %.3g mm (%.4g mm): "
        "probabilities are less sure\n",
        1e3 * was / OM_BANET_SIDE_CELL, 1e3 * was, 1e3 * side / OM_BANET_SIDE_CELL, 1e3 * side);
}

static OmStatus check_generator(const OmBanetNet* net, const OmBanetData* data, OmText* note) {
    const char* name = om_facts_find(&net->facts, "generator");
    const int was = generator_of(name), now = data ? generator_of(data->generator) : 0;
    if (!name) return om_text_append(note, "generator of its samples: not stated\n");
    if (was > OM_BANET_GENERATOR)
        return om_text_append(
            note,
            "trained on samples of generator \"%s\"; this program knows " GENERATOR_NAME
            "%d: probabilities are less sure\n",
            name, OM_BANET_GENERATOR);
    if (now > was)
        return om_text_append(
            note,
            "trained on samples of generator \"%s\", used with those of the newer \"%s\": "
            "probabilities are less sure\n",
            name, data->generator);
    return OM_OK;
}

OmStatus om_banet_net_check(const OmBanetNet* net, double side, const OmBanetData* data,
                            OmText* note) {
    const char* element = om_facts_find(&net->facts, "element");
    if (side > 0) OM_TRY(check_side(net, side, note));
    OM_TRY(check_generator(net, data, note));
    if (!element) return om_text_append(note, "element of its tissue: not stated\n");
    if (data && data->element[0] && strcmp(data->element, element) != 0)
        return om_text_append(
            note, "trained on %s elements, used with %s ones: judged on another tissue\n", element,
            data->element);
    return OM_OK;
}

OmStatus om_banet_net_describe(const OmBanetNet* net, OmText* text) {
    static const char* const key[] = {"generator", "way", "law", "element", "data"};
    if (net->side > 0)
        OM_TRY(om_text_append(text, "voxel %.4g mm, side %.4g mm",
                              1e3 * net->side / OM_BANET_SIDE_CELL, 1e3 * net->side));
    else
        OM_TRY(om_text_append(text, "voxel and side not stated"));
    for (size_t i = 0; i < sizeof key / sizeof *key; ++i) {
        const char* value = om_facts_find(&net->facts, key[i]);
        OM_TRY(om_text_append(text, ", %s %s", key[i], value ? value : "not stated"));
    }
    return OM_OK;
}
