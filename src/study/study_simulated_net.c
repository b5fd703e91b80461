// study_simulated_net.c: the network of the study of simulated bodies.
#include <string.h>

#include "omentum/banet_net.h"
#include "study/study_simulated_internal.h"

OmStatus om__sim_net_load(Sim* s) {
    if (s->def->weights && !s->def->weights[0]) return OM_OK;
    OmStatus status = om_banet_net_load(s->def->weights, &s->net);
    if (status == OM_IO && !s->def->weights) return OM_OK;
    OM_TRY(status);
    static const char* const key[] = {"command",        "seed",          "data",
                                      "samples",        "epochs",        "validation_dsc",
                                      "validation_tpr", "validation_ece"};
    s->sum.has_net = true;
    s->sum.threshold = om_banet_net_threshold(s->net);
    s->net_hash = om_hash(&s->sum.threshold, sizeof s->sum.threshold, OM_HASH_SEED);
    for (size_t k = 0; k < sizeof key / sizeof *key; ++k) {
        const char* fact = om_banet_net_fact(s->net, key[k]);
        if (fact) s->net_hash = om_hash(fact, strlen(fact), s->net_hash);
    }
    return OM_OK;
}

void om__sim_net_destroy(struct OmBanetNet* net) { om_banet_net_destroy(net); }

OmStatus om__sim_net_estimate(const Sim* s, SimBody* body, double* probability) {
    const OmBanetSample* sample = body->sample;
    OM_TRY(om_banet_estimate(s->net, body->side, &sample->surface, sample->u, sample->seen,
                             probability));
    for (int i = 0; i < sample->surface.nvert; ++i)
        body->guess[i] = probability[i] >= s->sum.threshold;
    return OM_OK;
}
