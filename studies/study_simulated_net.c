// study_simulated_net.c: the network of the study of simulated bodies.
#include "omentum/banet_fuse.h"
#include "omentum/banet_net.h"
#include "studies/study_simulated_internal.h"

OmStatus om__sim_net_load(Sim* s) {
    OM_TRY(om_banet_net_find(s->def->weights, NULL, &s->net));
    s->sum.has_net = s->net != NULL;
    if (!s->net) return OM_OK;
    s->net_hash = om_banet_net_hash(s->net);
    return OM_OK;
}

void om__sim_net_destroy(struct OmBanetNet* net) { om_banet_net_destroy(net); }

OmStatus om__sim_net_estimate(const Sim* s, SimBody* body, double* probability) {
    const OmBanetSample* sample = body->sample;
    OM_TRY(om_banet_estimate(s->net, body->side, &sample->surface, sample->u, sample->seen,
                             probability));
    double threshold;
    OM_TRY(
        om_banet_choose_threshold(sample->surface.nvert, probability, OM_BANET_NEARLY, &threshold));
    for (int i = 0; i < sample->surface.nvert; ++i) body->guess[i] = probability[i] >= threshold;
    return OM_OK;
}
