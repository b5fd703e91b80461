// dds_watch.c: when to send what to programs that watch.
#include "omentum/dds.h"

#include <math.h>

#include "dds/dds_igtl.h"
#include "dds/dds_udp.h"

#define SHOW_RATE 30.0       // Hz, of tools
enum { SURFACE_EVERY = 5 };  // of these a surface

struct OmWatch {
    Stream* stream;
    OmText shown;    // the last message
    OmSurface skin;  // its vertices are skin_vert of the mesh
    int* skin_vert;
    double next;  // s of the wall clock
    int nshown;
};

OmStatus om_watch_create(int port, const OmTetMesh* mesh, OmWatch** watch) {
    *watch = NULL;
    OmWatch* w = om_calloc(1, sizeof *w);
    if (!w) return OM_NO_MEMORY;
    OmStatus status = om__stream_open(port, &w->stream);
    if (status == OM_OK) status = om_tet_mesh_boundary(mesh, &w->skin, &w->skin_vert);
    if (status < 0)
        om_watch_destroy(w);
    else
        *watch = w;
    return status;
}

void om_watch_destroy(OmWatch* watch) {
    if (!watch) return;
    om__stream_close(watch->stream);
    om_text_done(&watch->shown);
    om_surface_done(&watch->skin);
    om_free(watch->skin_vert);
    om_free(watch);
}

bool om_watch_is_due(OmWatch* watch) {
    const double now = om_clock_now();
    if (now < watch->next) return false;
    watch->next = fmax(watch->next + 1 / SHOW_RATE, now);
    return om__stream_count(watch->stream) > 0;
}

OmStatus om_watch_send(OmWatch* watch, double time, const OmWatchTool* tool, int ntool,
                       const double* x) {
    OmWatch* w = watch;
    w->shown.len = 0;
    for (int i = 0; i < ntool; ++i)
        OM_TRY(om__igtl_transform(tool[i].name, time, tool[i].pose, &w->shown));
    if (w->skin.ntri > 0 && w->nshown++ % SURFACE_EVERY == 0)
        OM_TRY(om__igtl_surface("Tissue", time, &w->skin, x, w->skin_vert, &w->shown));
    return om__stream_send(w->stream, w->shown.str, w->shown.len);
}
