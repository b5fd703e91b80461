// nn_unet.c: the U-Net of thesis Fig. 3.7b, after Ronneberger et al. 2015, in layers.
//
// Without cropping: the convolutions are padded, so that both ends of a skip connection have the same grid.
// With 32 x 24 x 16 nodes, 3 levels and 128 base channels the bottom has the thesis's 1,024.
#include <string.h>

#include "nn/nn_internal.h"

#define COOKIE 0x554e4554u

OmUnetDef om_unet_default_def(OmNetShape in, int out_channels) {
    return (OmUnetDef){.in = in,
                       .out_channels = out_channels,
                       .nlevel = 3,
                       .base_channels = 16,
                       .activation = OM_RELU,
                       .slope = 0.01f,
                       .ngroup = 8,
                       .cookie = COOKIE};
}

static OmStatus check_def(const OmUnetDef* def) {
    OM_CHECK(def->cookie == COOKIE, OM_INVALID,
             "OmUnetDef is not from om_unet_default_def: start from its result");
    OM_CHECK(def->nlevel >= 1 && def->nlevel <= 6, OM_INVALID,
             "OmUnetDef: nlevel %d is not in 1 to 6", def->nlevel);
    OM_CHECK(def->base_channels >= 1 && def->base_channels <= 1024, OM_INVALID,
             "OmUnetDef: base_channels %d is not in 1 to 1024", def->base_channels);
    OM_CHECK(def->activation >= OM_RELU && def->activation <= OM_SIGMOID, OM_INVALID,
             "OmUnetDef: activation %d is none of relu, leaky_relu, tanh, sigmoid",
             def->activation);
    OM_CHECK(def->norm == 0 || def->norm == OM_LAYER_BATCH_NORM || def->norm == OM_LAYER_GROUP_NORM,
             OM_INVALID, "OmUnetDef: norm is neither 0 nor one of the norm layers");
    const int extent[3] = {def->in.d, def->in.h, def->in.w};
    static const char* const axis[3] = {"depth", "height", "width"};
    int step = def->nlevel == 1 ? 2 : 4;
    for (int k = 0; k < 3; ++k)
        OM_CHECK(extent[k] >= step && extent[k] % step == 0, OM_INVALID,
                 "OmUnetDef: %s %d is no multiple of %d: pad the grid to %d", axis[k], extent[k],
                 step, (extent[k] > 0 ? (extent[k] + step - 1) / step : 1) * step);
    return OM_OK;
}

// Convolution, norm if the definition has one, activation; named "<part>.conv<number>".
static int add_stage(OmNet* net, const OmUnetDef* def, int x, int channels, const char* part,
                     int number) {
    char name[OM_NET_NAME];
    OmNetConv conv = om_net_conv(channels, 3);
    conv.has_bias = def->norm == 0;  // a norm has its own
    snprintf(name, sizeof name, "%s.conv%d", part, number);
    x = om_net_add_conv(net, name, x, conv);
    snprintf(name, sizeof name, "%s.norm%d", part, number);
    if (def->norm == OM_LAYER_BATCH_NORM) x = om_net_add_batch_norm(net, name, x);
    if (def->norm == OM_LAYER_GROUP_NORM) x = om_net_add_group_norm(net, name, x, def->ngroup);
    return om_net_add_activation(net, x, def->activation, def->slope);
}

static int add_stages(OmNet* net, const OmUnetDef* def, int x, int channels, const char* part) {
    x = add_stage(net, def, x, channels, part, 1);
    return add_stage(net, def, x, channels, part, 2);
}

// The factor by which each axis shrinks below a level of this grid; odd axes do not shrink.
static bool find_factor(OmNetShape grid, int factor[3]) {
    const int extent[3] = {grid.d, grid.h, grid.w};
    bool is_any = false;
    for (int k = 0; k < 3; ++k) {
        factor[k] = extent[k] % 2 == 0 ? 2 : 1;
        is_any = is_any || factor[k] == 2;
    }
    return is_any;
}

OmStatus om_unet_create(const OmUnetDef* def, OmNet** net_out) {
    *net_out = NULL;
    OM_TRY(check_def(def));
    OmNet* net = NULL;
    OM_TRY(om_net_create(&net));
    const int zero[3] = {0};
    int skip[6] = {0}, factor[6][3];
    OmNetShape grid = def->in;
    char name[OM_NET_NAME];
    int x = om_net_add_input(net, "input", def->in), channels = def->base_channels;
    for (int k = 0; k < def->nlevel; ++k, channels *= 2) {
        snprintf(name, sizeof name, "enc%d", k);
        x = skip[k] = add_stages(net, def, x, channels, name);
        if (!find_factor(grid, factor[k])) {
            om_net_destroy(net);
            return om_error(OM_INVALID,
                            "OmUnetDef: %d x %d x %d is halved at most %d times, nlevel is %d",
                            def->in.d, def->in.h, def->in.w, k, def->nlevel);
        }
        x = om_net_add_max_pool(net, x, factor[k], factor[k], zero);
        grid.d /= factor[k][0], grid.h /= factor[k][1], grid.w /= factor[k][2];
    }
    x = add_stages(net, def, x, channels, "bottom");
    if (def->dropout != 0) x = om_net_add_dropout(net, x, def->dropout);
    for (int k = def->nlevel - 1; k >= 0; --k) {
        channels /= 2;
        snprintf(name, sizeof name, "dec%d.up", k);
        OmNetConv rise = om_net_conv_strided(channels, 2, 2, 0);
        memcpy(rise.kernel, factor[k], sizeof rise.kernel);
        memcpy(rise.stride, factor[k], sizeof rise.stride);
        int up = om_net_add_conv_up(net, name, x, rise);
        x = om_net_add_concat(net, 2, (int[]){skip[k], up});
        snprintf(name, sizeof name, "dec%d", k);
        x = add_stages(net, def, x, channels, name);
    }
    x = om_net_add_conv(net, "head", x, om_net_conv(def->out_channels, 1));
    if (def->mask) x = om_net_add_mask(net, x, def->mask);
    OmStatus status = om_net_finish(net, x);
    if (status < 0) {
        om_net_destroy(net);
        return status;
    }
    *net_out = net;
    return OM_OK;
}
