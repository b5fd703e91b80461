// sense_embree.c: scenes of triangles for Embree 3, the only file that includes its header.
//
// Deforming objects are refitted, not rebuilt: vertices move little between frames. The device builds with
// one thread; rays are cast from our loops, eight at a time.
#include <embree3/rtcore.h>
#include <string.h>

#include "sense/sense_internal.h"

struct OmSenseScene {
    RTCDevice device;
    RTCScene scene;
    Object* object;
    int nobject, capacity;
    float* texture[OM_NTEXTURE];  // voxels; null until an object has the texture
    OmVec3 exposure_point;
};

static OmStatus check_device(RTCDevice device, const char* doing) {
    enum RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return OM_OK;
    OmStatus status = error == RTC_ERROR_OUT_OF_MEMORY ? OM_NO_MEMORY : OM_UNAVAILABLE;
    return om_error(status, "ray caster: error %d while %s", (int)error, doing);
}

OmStatus om_sense_scene_create(OmSenseScene** scene) {
    *scene = om_calloc(1, sizeof **scene);
    if (!*scene) return OM_NO_MEMORY;
    (*scene)->device = rtcNewDevice("threads=1,set_affinity=0");
    OmStatus status = OM_OK;
    if (!(*scene)->device) {
        int error = (int)rtcGetDeviceError(NULL);
        status = error == RTC_ERROR_OUT_OF_MEMORY
                     ? om_error(OM_NO_MEMORY, "ray caster: out of memory")
                     : om_error(OM_UNAVAILABLE, "ray caster: no device, error %d", error);
    } else {
        (*scene)->scene = rtcNewScene((*scene)->device);
        rtcSetSceneFlags((*scene)->scene, RTC_SCENE_FLAG_DYNAMIC | RTC_SCENE_FLAG_ROBUST);
        // one tree for each object, which can be refitted; a single tree over all objects would be rebuilt each time
        rtcSetSceneBuildQuality((*scene)->scene, RTC_BUILD_QUALITY_LOW);
        status = check_device((*scene)->device, "making a scene");
    }
    if (status < 0) {
        om_sense_scene_destroy(*scene);
        *scene = NULL;
    }
    return status;
}

void om_sense_scene_destroy(OmSenseScene* scene) {
    if (!scene) return;
    for (int i = 0; i < scene->nobject; ++i) {
        Object* o = &scene->object[i];
        if (o->geometry) rtcReleaseGeometry(o->geometry);
        om_surface_done(&o->surface);
        om_free(o->vert_normal);
        om_free(o->rest);
    }
    for (int i = 0; i < OM_NTEXTURE; ++i) om_free(scene->texture[i]);
    if (scene->scene) rtcReleaseScene(scene->scene);
    if (scene->device) rtcReleaseDevice(scene->device);
    for (int i = 0; i < scene->nobject; ++i) om_free(scene->object[i].buffer);
    om_free(scene->object);
    om_free(scene);
}

static void write_buffer(Object* o) {
    for (int i = 0; i < 3 * o->surface.nvert; ++i) o->buffer[i] = (float)o->surface.x[i];
}

// Unit normals of the vertices: of their triangles, weighted by area.
static void compute_normals(Object* o) {
    float* normal = o->vert_normal;
    if (!normal) return;
    memset(normal, 0, 3 * (size_t)o->surface.nvert * sizeof *normal);
    for (int t = 0; t < o->surface.ntri; ++t) {
        const int* v = &o->surface.tri_vert[3 * t];
        const float *a = &o->buffer[3 * v[0]], *b = &o->buffer[3 * v[1]], *c = &o->buffer[3 * v[2]];
        float e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        float f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        float n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                      e[0] * f[1] - e[1] * f[0]};
        for (int k = 0; k < 9; ++k) normal[3 * v[k / 3] + k % 3] += n[k % 3];
    }
    for (int i = 0; i < o->surface.nvert; ++i) {
        float* n = &normal[3 * i];
        float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        float scale = length > 0 ? 1 / length : 0;
        for (int k = 0; k < 3; ++k) n[k] *= scale;
    }
}

static OmStatus grow_objects(OmSenseScene* scene) {
    if (scene->nobject < scene->capacity) return OM_OK;
    int capacity = scene->capacity ? 2 * scene->capacity : 8;
    Object* grown =
        om_realloc(scene->object, (size_t)scene->nobject, (size_t)capacity, sizeof *grown);
    if (!grown) return OM_NO_MEMORY;
    scene->object = grown;
    scene->capacity = capacity;
    return OM_OK;
}

static OmStatus check_surface(const OmSurface* s) {
    OM_CHECK(s->nvert > 0 && s->ntri > 0, OM_INVALID, "a surface without triangles cannot be seen");
    for (int i = 0; i < 3 * s->ntri; ++i) {
        OM_CHECK(s->tri_vert[i] >= 0 && s->tri_vert[i] < s->nvert, OM_INVALID,
                 "triangle %d names vertex %d of %d", i / 3, s->tri_vert[i], s->nvert);
    }
    for (int i = 0; i < 3 * s->nvert; ++i) {
        OM_CHECK(isfinite(s->x[i]), OM_INVALID, "vertex %d of a surface is not finite", i / 3);
    }
    return OM_OK;
}

static OmStatus prepare_texture(OmSenseScene* scene, OmSenseTexture texture) {
    OM_CHECK(texture >= 0 && texture < OM_NTEXTURE, OM_INVALID, "look: there is no texture %d",
             (int)texture);
    if (texture == OM_TEXTURE_NONE || scene->texture[texture]) return OM_OK;
    return om__texture_bake(texture, &scene->texture[texture]);
}

static void write_rest(Object* o) {
    for (int i = 0; o->rest && i < o->surface.nvert; ++i) {
        OmVec3 t = om__texture_coordinates(o->look.texture, om_load3(o->surface.x, i));
        o->rest[3 * i] = (float)t.x;
        o->rest[3 * i + 1] = (float)t.y;
        o->rest[3 * i + 2] = (float)t.z;
    }
}

static OmVec3 box_middle(const OmSurface* s) {
    OmVec3 lo = om_load3(s->x, 0), hi = lo;
    for (int i = 1; i < s->nvert; ++i) {
        lo = om_min3(lo, om_load3(s->x, i));
        hi = om_max3(hi, om_load3(s->x, i));
    }
    return om_scale(0.5, om_add(lo, hi));
}

OmStatus om_sense_scene_add(OmSenseScene* scene, const OmSurface* surface, const OmSenseLook* look,
                            int* id) {
    *id = -1;
    OM_TRY(check_surface(surface));
    OM_TRY(prepare_texture(scene, look->texture));
    OM_TRY(grow_objects(scene));
    Object o = {.look = *look, .is_shown = true, .is_changed = true};
    OmStatus status = om_surface_init(&o.surface, surface->nvert, surface->ntri);
    if (status < 0) return status;
    size_t nx = 3 * (size_t)surface->nvert;
    memcpy(o.surface.x, surface->x, nx * sizeof(double));
    memcpy(o.surface.tri_vert, surface->tri_vert, 3 * (size_t)surface->ntri * sizeof(int));
    OM_ALLOC_DONE(o.buffer, nx + 4);  // the caster reads 16 bytes at the last vertex
    if (look->is_smooth) OM_ALLOC_DONE(o.vert_normal, nx);
    if (look->texture != OM_TEXTURE_NONE) OM_ALLOC_DONE(o.rest, nx);
    write_buffer(&o);
    compute_normals(&o);
    write_rest(&o);
    RTCGeometry g = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    o.geometry = g;
    rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_REFIT);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, o.buffer, 0,
                               3 * sizeof(float), (size_t)surface->nvert);
    unsigned* index = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(unsigned), (size_t)surface->ntri);
    OM_TRY_DONE(check_device(scene->device, "adding triangles"));
    for (int i = 0; i < 3 * surface->ntri; ++i) index[i] = (unsigned)surface->tri_vert[i];
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(scene->scene, g, (unsigned)scene->nobject);
    OM_TRY_DONE(check_device(scene->device, "adding triangles"));
    if (scene->nobject == 0) scene->exposure_point = box_middle(surface);
    *id = scene->nobject;
    scene->object[scene->nobject++] = o;
    return OM_OK;
done:
    if (o.geometry) rtcReleaseGeometry(o.geometry);
    om_surface_done(&o.surface);
    om_free(o.buffer);
    om_free(o.vert_normal);
    om_free(o.rest);
    return status;
}

void om_sense_scene_update(OmSenseScene* scene, int id, const double* x, const int* vert) {
    OM_ASSERT(id >= 0 && id < scene->nobject);
    Object* o = &scene->object[id];
    for (int i = 0; i < o->surface.nvert; ++i)
        om_store3(o->surface.x, i, om_load3(x, vert ? vert[i] : i));
    o->is_changed = true;
}

void om_sense_scene_show(OmSenseScene* scene, int id, bool is_shown) {
    OM_ASSERT(id >= 0 && id < scene->nobject);
    Object* o = &scene->object[id];
    if (o->is_shown == is_shown) return;
    o->is_shown = is_shown;
    if (is_shown)
        rtcEnableGeometry(o->geometry);
    else
        rtcDisableGeometry(o->geometry);
}

OmStatus om_sense_scene_commit(OmSenseScene* scene) {
    for (int i = 0; i < scene->nobject; ++i) {
        Object* o = &scene->object[i];
        if (!o->is_changed) continue;
        write_buffer(o);
        compute_normals(o);
        rtcUpdateGeometryBuffer(o->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(o->geometry);
        o->is_changed = false;
    }
    rtcCommitScene(scene->scene);
    return check_device(scene->device, "building the scene");
}

const Object* om__object(const OmSenseScene* scene, int id) { return &scene->object[id]; }

const float* om__texture(const OmSenseScene* scene, OmSenseTexture texture) {
    return scene->texture[texture];
}

OmVec3 om__exposure_point(const OmSenseScene* scene) { return scene->exposure_point; }

// ---- casting ----------------------------------------------------------------------------------------------

static void set_ray8(struct RTCRay8* ray, int* valid, const Packet* p) {
    memcpy(ray->org_x, p->ox, sizeof p->ox);
    memcpy(ray->org_y, p->oy, sizeof p->oy);
    memcpy(ray->org_z, p->oz, sizeof p->oz);
    memcpy(ray->dir_x, p->dx, sizeof p->dx);
    memcpy(ray->dir_y, p->dy, sizeof p->dy);
    memcpy(ray->dir_z, p->dz, sizeof p->dz);
    memcpy(ray->tfar, p->far_t, sizeof p->far_t);
    for (int i = 0; i < PACKET; ++i) {
        valid[i] = i < p->n && p->far_t[i] >= 0 ? -1 : 0;
        ray->tnear[i] = 0;
        ray->time[i] = 0;
        ray->mask[i] = ~0u;
        ray->id[i] = 0;
        ray->flags[i] = 0;
    }
}

void om__cast(const OmSenseScene* scene, Packet* p) {
    struct RTCRayHit8 rh;
    int valid[PACKET];
    set_ray8(&rh.ray, valid, p);
    for (int i = 0; i < PACKET; ++i) {
        rh.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        rh.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect8(valid, scene->scene, &context, &rh);
    memcpy(p->t, rh.ray.tfar, sizeof p->t);
    for (int i = 0; i < PACKET; ++i) {
        bool is_hit = rh.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        p->id[i] = is_hit ? (int)rh.hit.geomID[i] : -1;
        p->tri[i] = is_hit ? (int)rh.hit.primID[i] : -1;
        p->u[i] = is_hit ? rh.hit.u[i] : 0;
        p->v[i] = is_hit ? rh.hit.v[i] : 0;
        p->nx[i] = is_hit ? rh.hit.Ng_x[i] : 0;
        p->ny[i] = is_hit ? rh.hit.Ng_y[i] : 0;
        p->nz[i] = is_hit ? rh.hit.Ng_z[i] : 0;
    }
}

void om__cast_shadow(const OmSenseScene* scene, Packet* p) {
    struct RTCRay8 ray;
    int valid[PACKET];
    set_ray8(&ray, valid, p);
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcOccluded8(valid, scene->scene, &context, &ray);
    for (int i = 0; i < PACKET; ++i) p->t[i] = valid[i] && ray.tfar[i] < 0 ? 0.0f : 1.0f;
}
