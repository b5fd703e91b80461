// record_report_update.c: what the depth camera taught the twin, for the report of a run.
//
// Attachments lie on the side of the tissue that no camera sees: they are drawn from below, in the rest shape. Those of
// a simulated truth are drawn beside them, for judging.
#include <math.h>
#include <string.h>

#include "omentum/sense.h"
#include "record/record_internal.h"

enum { WIDTH = 480, HEIGHT = 400 };

#define FOV 0.7  // rad, vertical

// ---- pictures of attachments --------------------------------------------------------------------------------

// Triangles whose three vertices are attached, or the others.
static OmStatus add_part(OmSenseScene* scene, const OmSurface* s, const int* vert,
                         const unsigned char* attached, bool is_held) {
    OmSurface part;
    int n = 0, id;
    OM_TRY(om_surface_init(&part, s->nvert, s->ntri));
    memcpy(part.x, s->x, 3 * (size_t)s->nvert * sizeof *s->x);
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = &s->tri_vert[3 * t];
        if ((attached[vert[v[0]]] && attached[vert[v[1]]] && attached[vert[v[2]]]) != is_held)
            continue;
        memcpy(&part.tri_vert[3 * n++], v, 3 * sizeof *v);
    }
    part.ntri = n;
    OmSenseLook look = om_sense_look(is_held ? OM_PART_HELD : OM_PART_TISSUE);
    look.texture = OM_TEXTURE_NONE;
    look.gloss = 0;
    OmStatus status = n > 0 ? om_sense_scene_add(scene, &part, &look, &id) : OM_OK;
    om_surface_done(&part);
    return status;
}

OmStatus om__draw_attached(const OmSite* site, const unsigned char* attached, OmPicture* picture) {
    OmStatus status = OM_OK;
    OmSurface s = {0};
    int* vert = NULL;
    OmSenseScene* scene = NULL;
    *picture = (OmPicture){0};
    OM_TRY_DONE(om_tet_mesh_boundary(&site->mesh, &s, &vert));
    OM_TRY_DONE(om_sense_scene_create(&scene));
    OM_TRY_DONE(add_part(scene, &s, vert, attached, false));
    OM_TRY_DONE(add_part(scene, &s, vert, attached, true));
    OM_TRY_DONE(om_sense_scene_commit(scene));
    // x of the task points right, y down
    const double size = 1.15 * fmax(site->half_size.y, site->half_size.x * HEIGHT / WIDTH);
    OmCamera camera = {.width = WIDTH, .height = HEIGHT, .fov = FOV, .near_m = 1e-3, .far_m = 10};
    camera.pose_world_camera = site->pose_world_task;
    camera.pose_world_camera.p =
        om_pose_apply(site->pose_world_task, om_vec3(0, 0, -size / tan(0.5 * FOV)));
    OM_TRY_DONE(om_picture_init(picture, WIDTH, HEIGHT, 3));
    OmSenseOptions options = om_sense_options_default();
    OM_TRY_DONE(om_sense_render(scene, &camera, &options, picture));
done:
    if (status < 0) {
        om_picture_done(picture);
        *picture = (OmPicture){0};
    }
    om_sense_scene_destroy(scene);
    om_surface_done(&s);
    om_free(vert);
    return status;
}

// The picture is added to the page, and written beside it.
static OmStatus add_picture(OmReport* report, const OmRecorder* rec, const OmPicture* picture,
                            const char* name, const char* caption) {
    char path[1200];
    om_report_picture(report, picture, caption);
    OM_TRY(om_path_join(rec->folder.path, name, path, sizeof path));
    return om_picture_save_png(picture, path);
}

static OmStatus add_pictures(OmReport* report, const OmRecorder* rec) {
    if (!rec->before.pixel) return OM_OK;
    OM_TRY(add_picture(report, rec, &rec->before, "attached_before.png",
                       "Attachments (blue) as the twin believed at the begin, seen from below"));
    OM_TRY(add_picture(report, rec, &rec->after, "attached_after.png",
                       "Attachments of the twin after the last update"));
    if (!rec->def.truth) return OM_OK;
    OmPicture truth;
    OM_TRY(
        om__draw_attached(om_body_site(rec->def.truth), om_body_attached(rec->def.truth), &truth));
    OmStatus status = add_picture(report, rec, &truth, "attached_truth.png",
                                  "Attachments of the simulated truth, which the twin never sees");
    om_picture_done(&truth);
    return status;
}

// ---- the table ----------------------------------------------------------------------------------------------

static OmStatus add_table(OmReport* report, const OmRetractResult* r) {
    enum { NCOL = 7, LEN = 300 };
    static const char* const heading[NCOL] = {
        "time, s",      "acquisitions",           "outcome",      "vertices attached",
        "surface seen", "scan from twin, median", "estimate took"};
    OmStatus status = OM_OK;
    char* text = NULL;
    const char** cell = NULL;
    const int n = r->belief.nupdate;
    OM_ALLOC_DONE(text, (size_t)n * NCOL * LEN);
    OM_ALLOC_DONE(cell, (size_t)n * NCOL);
    for (int i = 0; i < n; ++i) {
        const OmRetractUpdate* u = &r->belief.update[i];
        char(*c)[LEN] = (char(*)[LEN])(text + (size_t)i * NCOL * LEN);
        const bool is_known = u->stage != OM_UPDATE_CANCELLED;
        snprintf(c[0], LEN, "%.1f - %.1f", u->start, u->end);
        snprintf(c[1], LEN, "%d", u->nacquisition);
        snprintf(c[2], LEN, "%s%s%s", om_update_stage_text(u->stage), u->reason[0] ? ": " : "",
                 u->reason);
        snprintf(c[3], LEN, "%d -> %d", u->nattached_before, u->nattached_after);
        snprintf(c[4], LEN, is_known ? "%.0f %%" : "-", 100 * u->seen_share);
        snprintf(c[5], LEN, is_known ? "%.1f -> %.1f mm" : "-", 1e3 * u->before_median,
                 1e3 * u->after_median);
        snprintf(c[6], LEN, is_known ? "%.0f ms" : "-", u->estimate_ms);
        for (int k = 0; k < NCOL; ++k) cell[i * NCOL + k] = c[k];
    }
    om_report_table(report, heading, NCOL, cell, n);
done:
    om_free(text);
    om_free(cell);
    return status;
}

OmStatus om__report_add_updates(OmReport* report, const OmRecorder* rec, const OmRetractResult* r) {
    char text[160];
    if (r->belief.nacquisition == 0) return OM_OK;
    om_report_heading(report, "What the depth camera taught the twin");
    snprintf(text, sizeof text, "%d acquisitions were taken%s. %s", r->belief.nacquisition,
             rec->nacquisition > 0 ? "; the folder acquisitions holds them" : "",
             r->belief.nupdate > 0 ? "" : "The twin's attachments were not corrected.");
    om_report_paragraph(report, text);
    if (r->belief.nupdate > 0) OM_TRY(add_table(report, r));
    return add_pictures(report, rec);
}
