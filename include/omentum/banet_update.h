/// omentum/banet_update.h: attachments by network and physics (room `banet`, floor 6; thesis 4.2).
///
/// For each acquisition the live correspondence (match_live.h) gives the displacement of the visible surface, and the
/// network the probability of each vertex. The views are fused (banet_fuse.h). The result is the advice of
/// om_match_update_with: it takes the place of a share of the prior of the physics estimate, and its sets are tried in
/// the twin. The estimate is accepted by the rules of om_match_update, so only if the distance of the scans falls.
/// Without a network, or where no correspondence is found, the estimate is that of physics alone.
///
///     OmBanetUpdateDef def = om_banet_update_default_def(match);
///     om_banet_net_load(NULL, &net);                                    // the weights that come along
///     def.net = net;
///     om_banet_updater_create(&def, &updater);
///     om_banet_update(updater, nacquisition, acquisition, NULL, &estimate, &advice);
///     om_banet_advice_done(&advice);
///     om_match_estimate_done(&estimate);
#ifndef OMENTUM_BANET_UPDATE_H
#define OMENTUM_BANET_UPDATE_H

#include "omentum/banet_fuse.h"
#include "omentum/banet_net.h"
#include "omentum/match.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Probability of being attached of the vertices of a surface.
/// @param u            measured displacement of the vertices, m                        (nvert x 3)
/// @param seen         how well each vertex was seen, 0 to 1                               (nvert)
/// @param probability  (nvert)
/// @return OM_OK; an error ends the update
typedef OmStatus (*OmBanetEstimateFn)(void* ctx, const OmSurface* surface, const double* u,
                                      const double* seen, double* probability);

typedef struct OmBanetUpdateDef {  // made by om_banet_update_default_def
    OmMatch* match;                // borrowed until destroy; used in om_banet_update
    const OmBanetNet* net;         // borrowed until destroy; null (default): none
    double side;                   // of its grid, m; default: om_banet_default_side
    // in place of `net`; null (default): none. With neither, the estimate is that of physics alone.
    OmBanetEstimateFn estimate;
    void* estimate_ctx;   // borrowed until destroy
    OmBanetFuseDef fuse;  // of several views
    double threshold;     // of the network's set; default 0: that of greatest expected DSC
    double weight;        // of the network against the random patches, 0 to 1; default 0.7
    // m, a vertex at this distance from the nearest seen one is shown by half; default 15 mm
    double reach;
    // Sets that are tried in the twin besides the most probable one and that of the scans alone, 0 to 4, in this order:
    // the last accepted one, the network's at its threshold, the network's at 0.4 and 2.5 times the odds; default 2
    int ntry;
    // The correspondence goes through the twin that physics alone has corrected, where that is accepted: one more
    // om_match_update, for a twin that has few of its attachments. Default false.
    bool is_corrected;
    // One more set is tried: the last accepted one, corrected where twin and scans contradict each other
    // (OmMatchAdvice.present). Default false; om_retract_run sets it.
    bool tries_last_corrected;
    int nworker;  // threads of the correspondence; default 1
    OmCookie cookie;
} OmBanetUpdateDef;

OM_API OmBanetUpdateDef om_banet_update_default_def(OmMatch* match);
/// Side of the network's grid for a body, m: 0.2 where twice its volume over its area is below 6 mm, else 0.3.
OM_API double om_banet_default_side(const OmSurface* surface);

/// The correspondence and the last accepted attachments. For one thread at a time.
typedef struct OmBanetUpdater OmBanetUpdater;
/// @return OM_OK; OM_INVALID (the message names the field); OM_NO_MEMORY
OM_API OmStatus om_banet_updater_create(const OmBanetUpdateDef* def, OmBanetUpdater** updater);
OM_API void om_banet_updater_destroy(OmBanetUpdater* updater);
/// The twin's attachments from now on. At first they are those of the site, then those of the last accepted estimate.
/// @param attached  nonzero where attached; copied                       (nvert of the mesh)
OM_API void om_banet_updater_set_attached(OmBanetUpdater* updater, const unsigned char* attached);

typedef struct OmBanetAdvice {  // answer of the network; om_banet_advice_done frees
    int nvert;                  // of the mesh
    int nacquisition;
    // by the network from each acquisition; 0: inside, or no correspondence    (nacquisition x nvert)
    double* view;
    double* probability;  // of all views; 0 inside                                     (nvert)
    int nused;            // acquisitions from which the network said something
    char reason[256];     // why not from all; "" if from all, or without a network
    double pairs_ms, network_ms;  // times of correspondence and network, of all acquisitions
    double total_ms;              // of the whole update
} OmBanetAdvice;
OM_API void om_banet_advice_done(OmBanetAdvice* advice);
/// Vertices with a probability of at least `threshold` from every acquisition (thesis 4.4). Acquisitions without
/// correspondence are left out.
/// @param attached  1 or 0; all 0 where no acquisition has a correspondence            (advice->nvert)
/// @return OM_OK; OM_INVALID (threshold); OM_NO_MEMORY
OM_API OmStatus om_banet_advice_intersect(const OmBanetAdvice* advice, double threshold,
                                          unsigned char* attached);

/// Estimate the attachments that explain the scans.
/// @param estimate  null: only the network, without physics
/// @param advice    may be null
/// @return as om_match_update; errors of the network
OM_API OmStatus om_banet_update(OmBanetUpdater* updater, int nacquisition,
                                const OmAcquisition* acquisition, const OmProgress* progress,
                                OmMatchEstimate* estimate, OmBanetAdvice* advice);

#ifdef __cplusplus
}
#endif
#endif
