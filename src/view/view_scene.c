// view_scene.c: the messages of a scene in motion.
//
// Positions are 16 bits in a box around each part: its box at the beginning and REACH on each side, 6 micrometres for a
// sheet of 0.1 m. A part that leaves its box gets a larger one in that frame. A part of which no number changed is left
// out of the frame: an organ that stands still costs nothing.
#include <math.h>
#include <string.h>

#include "view/view_internal.h"

#define COOKIE 0x71e3d0u
#define REACH 0.15  // m
#define STRESS_EVERY \
    6  // live frames: to compute stresses of large meshes takes longer than all else
#define MOST 65535.0

typedef struct Part {
    const char *name, *kind;
    const OmSurface* surface;
    float lo[3], size[3];  // m, of its box
    uint16_t *last, *now;  // (nvert x 3)
    bool has_moved;        // since the scene
} Part;

struct OmView3d {
    OmView3dDef def;
    OmAnatomy* anatomy;
    OmSurface tissue;  // boundary of the body's mesh, where it is now
    int* tissue_vert;  // its vertices in the mesh
    double* stress;    // Pa, of the site's elements; null: none     (ntet)
    double* sum;       // of the elements around a vertex of the mesh (nvert)
    int* count;        //                                             (nvert)
    bool has_contact;  // the engine has forces
    OmText fields;     // of the tissue in frames, when they were computed last
    Part part[VIEW_MAX_PART];
    int npart;
    uint32_t nframe;
    bool wants_stress;  // in the next frame
    // Vertex of another body's site that is nearest to each vertex of the tissue, both at rest; null: not known
    int* nearest;           // (tissue.nvert)
    const OmSite* of_site;  // of that body
};

// ---- bytes --------------------------------------------------------------------------------------------------

static OmStatus put(OmText* t, const void* data, size_t size) {
    return om_text_append_raw(t, data, size);
}

static OmStatus put_u32(OmText* t, uint32_t value) { return put(t, &value, sizeof value); }
static OmStatus put_f64(OmText* t, double value) { return put(t, &value, sizeof value); }

static OmStatus put_f32(OmText* t, double value) {
    const float f = (float)value;
    return put(t, &f, sizeof f);
}

static OmStatus pad(OmText* t, size_t begin) {
    static const char zero[4];
    const size_t over = (t->len - begin) % 4;
    return over ? put(t, zero, 4 - over) : OM_OK;
}

// A message begins with its length, which is known at its end. One that fails leaves nothing in the text.
static OmStatus begin_message(OmText* t, uint32_t kind, size_t* begin) {
    OM_TRY(put_u32(t, 0));
    *begin = t->len;
    return put_u32(t, kind);
}

static OmStatus end_message(OmText* t, size_t begin, OmStatus status) {
    if (status == OM_OK) status = pad(t, begin);
    if (status < 0) {
        t->len = begin - 4;
        return status;
    }
    const uint32_t size = (uint32_t)(t->len - begin);
    memcpy(t->str + begin - 4, &size, sizeof size);
    return OM_OK;
}

// ---- parts --------------------------------------------------------------------------------------------------

static void place_box(Part* p) {
    for (int k = 0; k < 3; ++k) {
        double lo = INFINITY, hi = -INFINITY;
        for (int v = 0; v < p->surface->nvert; ++v) {
            lo = fmin(lo, p->surface->x[3 * v + k]);
            hi = fmax(hi, p->surface->x[3 * v + k]);
        }
        p->lo[k] = (float)(lo - REACH);
        p->size[k] = (float)(hi - lo + 2 * REACH);
    }
}

// False: a vertex is outside of the box.
static bool quantise(Part* p) {
    for (int i = 0; i < 3 * p->surface->nvert; ++i) {
        const double s = (p->surface->x[i] - (double)p->lo[i % 3]) / (double)p->size[i % 3];
        if (!(s >= 0 && s <= 1)) return false;
        p->now[i] = (uint16_t)lround(MOST * s);
    }
    return true;
}

static OmStatus add_part(OmView3d* v, const char* name, const char* kind,
                         const OmSurface* surface) {
    if (!surface || surface->nvert == 0) return OM_OK;
    Part* p = &v->part[v->npart];
    *p = (Part){.name = name, .kind = kind, .surface = surface};
    ++v->npart;  // destroy frees it from here on
    OM_ALLOC(p->last, 3 * (size_t)surface->nvert);
    OM_ALLOC(p->now, 3 * (size_t)surface->nvert);
    place_box(p);
    return OM_OK;
}

static void move_tissue(OmView3d* v) {
    const double* x = om_body_x(v->def.body);
    for (int k = 0; k < v->tissue.nvert; ++k)
        memcpy(v->tissue.x + 3 * k, x + 3 * v->tissue_vert[k], 3 * sizeof *x);
    om_anatomy_move(v->anatomy, x);
}

static OmStatus add_parts(OmView3d* v) {
    static const char* const tool[OM_MAX_ARM] = {"PSM1", "PSM2"};
    OM_TRY(add_part(v, "tissue", "tissue", &v->tissue));
    const OmSite* site = om_body_site(v->def.body);
    if (site->has_organ) OM_TRY(add_part(v, "organ", "organ", v->anatomy->organ));
    OM_TRY(add_part(v, "region of interest", "region", v->anatomy->roi));
    for (int a = 0; v->def.world && a < OM_MAX_ARM; ++a)
        OM_TRY(add_part(v, tool[a], "tool", om_world_tool(v->def.world, a)));
    if (v->def.probe) OM_TRY(add_part(v, "probe", "probe", v->def.probe));
    return OM_OK;
}

// Memory for stresses; an engine without them has none.
static OmStatus prepare_stress(OmView3d* v) {
    const OmTetMesh* mesh = om_body_mesh(v->def.body);
    if (!v->def.has_stress) return OM_OK;
    v->has_contact = om_engine_capabilities(om_body_engine(v->def.body)) & OM_ENGINE_FORCES;
    if (mesh->ntet == 0) return OM_OK;
    OM_ALLOC(v->stress, (size_t)om_body_site(v->def.body)->mesh.ntet);
    OM_ALLOC(v->sum, (size_t)mesh->nvert);
    OM_ALLOC(v->count, (size_t)mesh->nvert);
    OmStatus status = om_body_get_measure(v->def.body, OM_VON_MISES, v->stress);
    if (status != OM_UNAVAILABLE) return status;
    om_free(v->stress);
    v->stress = NULL;
    return OM_OK;
}

OmView3dDef om_view3d_default_def(const OmScene* scene, OmBody* body) {
    return (OmView3dDef){.cookie = COOKIE, .scene = scene, .body = body, .has_stress = true};
}

OmStatus om_view3d_create(const OmView3dDef* def, OmView3d** view) {
    *view = NULL;
    OM_CHECK(def->cookie == COOKIE, OM_INVALID, "OmView3dDef was not made by default_def");
    OM_CHECK(def->scene && def->body, OM_INVALID, "OmView3dDef has no scene or no body");
    OmView3d* v = om_calloc(1, sizeof *v);
    if (!v) return OM_NO_MEMORY;
    v->def = *def;
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_anatomy_create(def->body, &v->anatomy));
    OM_TRY_DONE(om_tet_mesh_boundary(om_body_mesh(def->body), &v->tissue, &v->tissue_vert));
    move_tissue(v);
    OM_TRY_DONE(add_parts(v));
    status = prepare_stress(v);
done:
    if (status < 0)
        om_view3d_destroy(v);
    else
        *view = v;
    return status;
}

void om_view3d_destroy(OmView3d* v) {
    if (!v) return;
    for (int k = 0; k < v->npart; ++k) {
        om_free(v->part[k].last);
        om_free(v->part[k].now);
    }
    om_anatomy_destroy(v->anatomy);
    om_surface_done(&v->tissue);
    om_free(v->tissue_vert);
    om_free(v->stress);
    om_free(v->sum);
    om_free(v->count);
    om_free(v->nearest);
    om_text_done(&v->fields);
    om_free(v);
}

// ---- the scene ----------------------------------------------------------------------------------------------

static void put_pose(OmJson* json, const char* key, OmPose pose) {
    const double p[3] = {pose.p.x, pose.p.y, pose.p.z};
    const double q[4] = {pose.q.x, pose.q.y, pose.q.z, pose.q.w};
    om_json_open(json, key, '{');
    om_json_numbers(json, "position", p, 3);
    om_json_numbers(json, "quaternion", q, 4);
}

static void put_endoscope(const OmView3d* v, OmJson* json) {
    const OmCamera c = om_world_endoscope(v->def.scene, om_body_site(v->def.body));
    const double fy = om_camera_lens(&c).fy;
    put_pose(json, "endoscope", c.pose_world_camera);
    om_json_number(json, "fov_y_deg", 2 * atan(0.5 * c.height / fy) * 180 / OM_PI);
    om_json_number(json, "aspect", (double)c.width / c.height);
    om_json_close(json, '}');
}

// A region on an organ is whole triangles of it, with a border of spikes: the circle of the same area stands for it.
static void put_region(const OmSite* site, OmJson* json) {
    const OmSurface* s = &site->roi;
    const double center[3] = {site->roi_center.x, site->roi_center.y, site->roi_center.z};
    double area = 0;
    if (!site->has_organ || s->ntri == 0) return;
    for (int t = 0; t < s->ntri; ++t) {
        const int* v = s->tri_vert + 3 * (size_t)t;
        const OmVec3 a = om_load3(s->x, v[0]), b = om_sub(om_load3(s->x, v[1]), a);
        area += 0.5 * om_norm(om_cross(b, om_sub(om_load3(s->x, v[2]), a)));
    }
    om_json_open(json, "region", '{');
    om_json_numbers(json, "center", center, 3);
    om_json_number(json, "radius", sqrt(area / OM_PI));
    om_json_close(json, '}');
}

static OmStatus write_json(const OmView3d* v, OmText* text) {
    const OmSite* site = om_body_site(v->def.body);
    const OmSceneTask* task = &v->def.scene->task;
    const double half[3] = {site->half_size.x, site->half_size.y, site->half_size.z};
    OmJson json = om_json_begin(text);
    om_json_open(&json, NULL, '{');
    om_json_string(&json, "title", v->def.scene->name);
    om_json_open(&json, "parts", '[');
    for (int k = 0; k < v->npart; ++k) {
        om_json_open(&json, NULL, '{');
        om_json_string(&json, "name", v->part[k].name);
        om_json_string(&json, "kind", v->part[k].kind);
        om_json_integer(&json, "nvert", v->part[k].surface->nvert);
        om_json_integer(&json, "ntri", v->part[k].surface->ntri);
        om_json_close(&json, '}');
    }
    om_json_close(&json, ']');
    put_endoscope(v, &json);
    put_pose(&json, "task", site->pose_world_task);
    om_json_numbers(&json, "half_size", half, 3);
    om_json_bool(&json, "has_ground", site->has_ground);
    om_json_close(&json, '}');
    put_region(site, &json);
    om_json_integer(&json, "grid", task->grid);
    om_json_number(&json, "force_threshold_n", task->force_threshold);
    om_json_number(&json, "visibility", task->visibility);
    om_json_close(&json, '}');
    return om_json_end(&json);
}

static OmStatus put_surface(const OmSurface* s, OmText* t) {
    for (int i = 0; i < 3 * s->nvert; ++i) OM_TRY(put_f32(t, s->x[i]));
    return put(t, s->tri_vert, 3 * (size_t)s->ntri * sizeof *s->tri_vert);
}

OmStatus om_view3d_add_scene(OmView3d* v, OmText* messages) {
    size_t begin;
    OmText json = {0};
    OM_TRY(begin_message(messages, VIEW_SCENE, &begin));
    move_tissue(v);
    OmStatus status = write_json(v, &json);
    if (status == OM_OK) status = put_u32(messages, (uint32_t)json.len);
    if (status == OM_OK) status = put(messages, json.str, json.len);
    if (status == OM_OK) status = pad(messages, begin);
    for (int k = 0; status == OM_OK && k < v->npart; ++k)
        status = put_surface(v->part[k].surface, messages);
    om_text_done(&json);
    v->nframe = 0;  // the first frame has every part
    return end_message(messages, begin, status);
}

// ---- frames -------------------------------------------------------------------------------------------------

// The mean over the elements around each vertex.
static OmStatus average_stress(OmView3d* v) {
    const OmTetMesh* mesh = om_body_mesh(v->def.body);
    const int nsub = mesh->ntet / om_body_site(v->def.body)->mesh.ntet;
    OM_TRY(om_body_get_measure(v->def.body, OM_VON_MISES, v->stress));
    memset(v->sum, 0, (size_t)mesh->nvert * sizeof *v->sum);
    memset(v->count, 0, (size_t)mesh->nvert * sizeof *v->count);
    for (int k = 0; k < 4 * mesh->ntet; ++k) {
        v->sum[mesh->tet_vert[k]] += v->stress[k / 4 / nsub];
        ++v->count[mesh->tet_vert[k]];
    }
    for (int i = 0; i < mesh->nvert; ++i) v->sum[i] /= v->count[i] ? v->count[i] : 1;
    return OM_OK;
}

// The largest, and shares of it.
static OmStatus put_field(const OmView3d* v, double (*value)(const OmView3d* v, int vert),
                          OmText* t) {
    double most = 0;
    for (int k = 0; k < v->tissue.nvert; ++k) most = fmax(most, value(v, v->tissue_vert[k]));
    OM_TRY(put_f32(t, most));
    for (int k = 0; k < v->tissue.nvert; ++k) {
        const double s = most > 0 ? value(v, v->tissue_vert[k]) / most : 0;
        const unsigned char byte = (unsigned char)lround(255 * s);
        OM_TRY(put(t, &byte, 1));
    }
    return pad(t, 0);
}

static double stress_at(const OmView3d* v, int vert) { return v->sum[vert]; }

static double contact_at(const OmView3d* v, int vert) {
    return om_norm(om_load3(om_body_contact_force(v->def.body), vert));
}

static OmStatus compute_fields(OmView3d* v) {
    OmText* t = &v->fields;
    t->len = 0;
    OM_TRY(put_u32(t, (v->stress ? VIEW_HAS_STRESS : 0) | (v->has_contact ? VIEW_HAS_CONTACT : 0)));
    if (v->stress) OM_TRY(average_stress(v));
    if (v->stress) OM_TRY(put_field(v, stress_at, t));
    return v->has_contact ? put_field(v, contact_at, t) : OM_OK;
}

// Of the tissue, the first part. Live frames repeat the last ones: a slow client sees few of the frames.
static OmStatus put_fields(OmView3d* v, OmText* t) {
    const bool is_due = !v->def.is_live || v->wants_stress || v->nframe % STRESS_EVERY == 0;
    if (is_due || v->fields.len == 0) OM_TRY(compute_fields(v));
    return put(t, v->fields.str, v->fields.len);
}

static OmStatus put_part(OmView3d* v, int k, OmText* t, size_t begin) {
    Part* p = &v->part[k];
    OM_TRY(put_u32(t, (uint32_t)k));
    OM_TRY(put_u32(t, (uint32_t)p->surface->nvert));
    OM_TRY(put(t, p->lo, sizeof p->lo));
    OM_TRY(put(t, p->size, sizeof p->size));
    OM_TRY(put(t, p->now, 3 * (size_t)p->surface->nvert * sizeof *p->now));
    OM_TRY(pad(t, begin));
    return k == 0 ? put_fields(v, t) : put_u32(t, 0);
}

static OmStatus put_frame(OmView3d* v, const OmViewNow* now, OmText* t, size_t begin) {
    const double value[] = {now->visibility, now->force, now->force_world, now->mu, now->height};
    bool has_moved[VIEW_MAX_PART];
    uint32_t nmoved = 0;
    OM_TRY(put_u32(t, v->nframe));
    OM_TRY(put_f64(t, now->time));
    for (size_t i = 0; i < sizeof value / sizeof *value; ++i) OM_TRY(put_f32(t, value[i]));
    OM_TRY(put_u32(t, (uint32_t)now->warning));
    for (int k = 0; k < v->npart; ++k) {
        Part* p = &v->part[k];
        const size_t size = 3 * (size_t)p->surface->nvert * sizeof *p->now;
        if (!quantise(p)) {
            place_box(p);
            OM_CHECK(quantise(p), OM_INVALID, "%s: a position is not a finite number", p->name);
        }
        const bool is_new = memcmp(p->now, p->last, size) != 0;
        p->has_moved |= v->nframe > 0 && is_new;
        has_moved[k] = v->nframe == 0 || (v->def.is_live ? p->has_moved : is_new);
        nmoved += has_moved[k];
    }
    OM_TRY(put_u32(t, nmoved));
    for (int k = 0; k < v->npart; ++k)
        if (has_moved[k]) OM_TRY(put_part(v, k, t, begin));
    return OM_OK;
}

OmStatus om_view3d_add_frame(OmView3d* v, const OmViewNow* now, OmText* messages) {
    size_t begin;
    OM_TRY(begin_message(messages, VIEW_FRAME, &begin));
    move_tissue(v);
    OM_TRY(end_message(messages, begin, put_frame(v, now, messages, begin)));
    for (int k = 0; k < v->npart; ++k) {
        uint16_t* last = v->part[k].last;
        v->part[k].last = v->part[k].now;
        v->part[k].now = last;
    }
    ++v->nframe;
    v->wants_stress = false;
    return OM_OK;
}

void om_view3d_want_stress(OmView3d* v) { v->wants_stress = true; }

OmStatus om_view3d_add_points(const OmBody* body, const unsigned char* attached, OmViewPoints kind,
                              OmText* messages) {
    const double* x = om_body_site(body)->mesh.x;
    const int nvert = om_body_site(body)->mesh.nvert;
    uint32_t n = 0;
    size_t begin;
    for (int i = 0; i < nvert; ++i) n += attached[i] != 0;
    OM_TRY(begin_message(messages, VIEW_POINTS, &begin));
    OmStatus status = put_u32(messages, (uint32_t)kind);
    if (status == OM_OK) status = put_u32(messages, n);
    for (int i = 0; status == OM_OK && i < 3 * nvert; ++i)
        if (attached[i / 3]) status = put_f32(messages, x[i]);
    return end_message(messages, begin, status);
}

OmStatus om_view3d_add_cloud(int n, const double* x, OmText* messages) {
    const int num = n < OM_VIEW_MAX_CLOUD ? n : OM_VIEW_MAX_CLOUD;
    size_t begin;
    OM_TRY(begin_message(messages, VIEW_POINTS, &begin));
    OmStatus status = put_u32(messages, OM_VIEW_MEASURED);
    if (status == OM_OK) status = put_u32(messages, (uint32_t)num);
    for (int i = 0; status == OM_OK && i < 3 * num; ++i)
        status = put_f32(messages, x[3 * ((int64_t)(i / 3) * n / num) + i % 3]);
    return end_message(messages, begin, status);
}

// ---- chances of attachment ------------------------------------------------------------------------------------

// Of two bodies of one scene in the same world frame; a few thousand vertices each, once.
static OmStatus find_nearest(OmView3d* v, const OmBody* body) {
    const OmTetMesh *own = om_tissue_mesh(om_body_tissue(v->def.body)),
                    *other = &om_body_site(body)->mesh;
    const OmMeshSet* under = om_tet_mesh_find_set(other, "underside");
    if (v->of_site == om_body_site(body)) return OM_OK;
    om_free(v->nearest);
    v->of_site = NULL;
    OM_ALLOC(v->nearest, (size_t)v->tissue.nvert);
    for (int k = 0; k < v->tissue.nvert; ++k) {
        const OmVec3 at = om_load3(own->x, v->tissue_vert[k]);
        double best = INFINITY;
        for (int i = 0; i < (under ? under->nvert : other->nvert); ++i) {
            const int vert = under ? under->vert[i] : i;
            const double d = om_norm2(om_sub(om_load3(other->x, vert), at));
            if (d < best) best = d, v->nearest[k] = vert;
        }
    }
    v->of_site = om_body_site(body);
    return OM_OK;
}

static OmStatus put_chances(const OmView3d* v, const double* probability, OmText* t) {
    OM_TRY(put_u32(t, (uint32_t)v->tissue.nvert));
    for (int k = 0; k < v->tissue.nvert; ++k) {
        const double p = fmin(fmax(probability[v->nearest[k]], 0), 1);
        const unsigned char byte = (unsigned char)lround(255 * p);
        OM_TRY(put(t, &byte, 1));
    }
    return OM_OK;
}

OmStatus om_view3d_add_chances(OmView3d* v, const OmBody* body, const double* probability,
                               OmText* messages) {
    size_t begin;
    OM_TRY(find_nearest(v, body));
    OM_TRY(begin_message(messages, VIEW_CHANCES, &begin));
    return end_message(messages, begin, put_chances(v, probability, messages));
}
