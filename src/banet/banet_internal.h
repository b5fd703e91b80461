// banet_internal.h: functions and types that the files of this room share.
#ifndef OMENTUM_BANET_INTERNAL_H
#define OMENTUM_BANET_INTERNAL_H

#include "omentum/banet_sample.h"

// ---- banet_body.c -----------------------------------------------------------------------------------

// A random body at rest: mesh and node of the sample. *is_good: its box has at most def->max_dim cells.
OmStatus om__banet_body(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample,
                        bool* is_good);

// ---- banet_load.c -----------------------------------------------------------------------------------

// Surface, attachments, grasp and force of a sample with a mesh. *is_good: all could be placed.
OmStatus om__banet_attach(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample,
                          bool* is_good);
OmStatus om__banet_grasp(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample,
                         bool* is_good);
// Equilibrium of the sample: x, max_u, min_volume, residual; on a board also mesh.x and rest. *is_good: found. `watch`
// is called at every iteration; may be null.
OmStatus om__banet_solve(const OmBanetSampleDef* def, const OmProgress* watch,
                         OmBanetSample* sample, bool* is_good);
// om_banet_sample_make with a listener that can cancel it.
OmStatus om__banet_sample_watched(const OmBanetSampleDef* def, int64_t index,
                                  const OmProgress* watch, OmBanetSample* sample);
// Visible part by (4.1) of the deformed surface, its exact displacement: u, seen, visible.
OmStatus om__banet_see(const OmBanetSampleDef* def, OmRng* rng, OmBanetSample* sample);

#endif
