/// omentum/match_adopt.h: a body takes over new attachments without a jump (room `match`, floor 5).
///
/// An estimate attaches vertices that are away from their rest positions, and frees others that carry force. Taken at
/// once, both would jolt the twin. An adoption changes nothing in its first instant: every attached vertex gets an
/// anchor that keeps its present force (om_body_eval_anchor). Then the anchors travel to the rest positions, and the
/// springs of freed vertices fade, within a stated time.
///
///     om_match_adoption_create(mesh->nvert, &adoption);
///     om_match_adoption_begin(adoption, body, estimate.attached, estimate.stiffness, 0.5);
///     for (;;) {
///         om_match_adoption_step(adoption, body, dt);  // nothing when no adoption is under way
///         om_body_step(body, dt, &report);
///     }
///     om_match_adoption_destroy(adoption);
#ifndef OMENTUM_MATCH_ADOPT_H
#define OMENTUM_MATCH_ADOPT_H

#include "omentum/body.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OM_MATCH_ADOPT_TIME 0.5  // s, usual time of an adoption

/// What is under way for one body. It changes with the body, and is part of a run's state.
typedef struct OmMatchAdoption OmMatchAdoption;

/// @param nvert  vertices of the body's mesh
/// @return OM_OK; OM_INVALID (no vertices); OM_NO_MEMORY
OM_API OmStatus om_match_adoption_create(int nvert, OmMatchAdoption** adoption);
OM_API void om_match_adoption_destroy(OmMatchAdoption* adoption);
/// Begin to adopt attachments, between two steps of the body. It replaces an adoption that is under way: forces go on
/// from their present values. Engines without springs hold vertices still at
/// anchors that travel; freed vertices are then free at once.
/// @param attached   nonzero where a vertex is to be attached at its rest position  (nvert)
/// @param stiffness  N/m of the spring of each of them, 0: held still; null: all held still  (nvert)
/// @param seconds    until the anchors arrive, above 0
/// @return OM_OK; OM_INVALID (an argument; body and adoption unchanged); errors of om_body_eval_anchor and
///         om_body_set_attachment
OM_API OmStatus om_match_adoption_begin(OmMatchAdoption* adoption, OmBody* body,
                                        const unsigned char* attached, const double* stiffness,
                                        double seconds);
/// Move the anchors by `dt` seconds, before each step of the body. A vertex that is to be held still is fixed
/// where it is after 0.6 of the time, and its anchor travels on; if an arm grasps it then, it keeps its spring.
/// @return OM_OK, also if no adoption is under way; OM_INVALID (dt below 0 or not finite); errors of
///         om_body_set_attachment
OM_API OmStatus om_match_adoption_step(OmMatchAdoption* adoption, OmBody* body, double dt);
OM_API bool om_match_adoption_is_active(const OmMatchAdoption* adoption);
/// Set `attached` to the attachments at the end of an adoption that is under way; unchanged otherwise.
/// @param attached  0 or 1  (nvert)
OM_API void om_match_adoption_get_goal(const OmMatchAdoption* adoption, unsigned char* attached);
/// Stop an adoption where it is: anchors and springs stay at their present values.
OM_API void om_match_adoption_cancel(OmMatchAdoption* adoption);
/// Snapshots: a block of om_match_adoption_state_size bytes, beside that of the body.
OM_API size_t om_match_adoption_state_size(const OmMatchAdoption* adoption);
OM_API void om_match_adoption_save(const OmMatchAdoption* adoption, void* block);
OM_API void om_match_adoption_restore(OmMatchAdoption* adoption, const void* block);
OM_API uint64_t om_match_adoption_hash(const OmMatchAdoption* adoption);

#ifdef __cplusplus
}
#endif
#endif
