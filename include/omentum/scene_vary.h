/// omentum/scene_vary.h: other attachments for a site that was built (floor 4).
///
/// A plan should also succeed where the attachments are not quite those believed. This function makes such a site from
/// a twin's: its region of attachments shrinks or grows by the metric D of thesis (4.1). Nothing of the truth is used.
///
///     OmSite site;
///     om_site_build(&scene, OM_SITE_TWIN, NULL, &site);
///     om_site_scale_attachments(&scene, 1.5, 1, &site);
#ifndef OMENTUM_SCENE_VARY_H
#define OMENTUM_SCENE_VARY_H

#include "omentum/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Attach `ratio` times as many vertices of the underside. Below 1 the attached vertices with the lowest D around the
/// vertex farthest inside the region stay; above 1 free vertices with the lowest D are added, at most all. Their areas
/// and the stiffness of their springs are those of the scene.
/// @param ratio  above 0
/// @param seed   of the shape of the patch in D
/// @param site   in/out: of om_site_build; unchanged where nothing is attached
/// @return OM_OK; OM_INVALID (no vertex would be left, or ratio is not above 0); OM_NO_MEMORY. On an error the site may
///         only be given to om_site_done
OM_API OmStatus om_site_scale_attachments(const OmScene* scene, double ratio, int seed,
                                          OmSite* site);

#ifdef __cplusplus
}
#endif
#endif
