// study_file.c: bodies from a mesh file and a list of lesions.
//
// The boundary of the mesh becomes a distance field, from which the study makes its own meshes at every
// resolution. The probe comes from above: the last surface point over a lesion along `up` gives the
// normal, and the probe moves against it. First contact is at the highest surface point under its face.
#include <math.h>
#include <string.h>

#include "omentum/shape_file.h"
#include "studies/study_internal.h"

#define NODE_ALONG_BOX 100  // nodes of the field along the longest side of the body
#define BASE_FRACTION 0.02  // fraction of the height that is attached if the file does not say
#define MAX_LESION_FILE (1 << 20)
#define DEFAULT_RADIUS 0.003
// largest indentation, as a fraction of the tissue thickness under the probe's face
#define MAX_FRACTION 0.6
#define FACE_SAMPLES 21  // samples along the probe's long side, to find the first contact

// ---- attachment -----------------------------------------------------------------------------------

bool om__study_is_attached(const OmStudyBody* body, OmVec3 p, double edge) {
    if (!body->is_file) return p.z < 1e-3 * edge;
    if (!body->nattached) {
        double depth = fmax(BASE_FRACTION * (body->high - body->low), 0.25 * edge);
        return om_dot(body->up, p) < body->low + depth;
    }
    for (int i = 0; i < body->nattached; ++i)
        if (om_distance(p, om_load3(body->attached, i)) < body->attached_reach) return true;
    return false;
}

static OmStatus keep_attached(OmStudyBody* body, const OmTetMesh* mesh, const OmSurface* surface,
                              const int* surface_vert) {
    const OmMeshSet* set = om_tet_mesh_find_set(mesh, "attachment");
    if (!set) return OM_OK;
    unsigned char* in = om_calloc((size_t)mesh->nvert, 1);
    if (!in) return OM_NO_MEMORY;
    for (int i = 0; i < set->nvert; ++i) in[set->vert[i]] = 1;
    double sum = 0;
    for (int i = 0; i < surface->ntri; ++i)
        sum += om_distance(om_load3(surface->x, surface->tri_vert[3 * i]),
                           om_load3(surface->x, surface->tri_vert[3 * i + 1]));
    body->attached_reach = 0.75 * sum / surface->ntri;
    body->attached = om_alloc(3 * (size_t)surface->nvert, sizeof *body->attached);
    for (int i = 0; body->attached && i < surface->nvert; ++i)
        if (in[surface_vert[i]])
            om_store3(body->attached, body->nattached++, om_load3(surface->x, i));
    om_free(in);
    return body->attached ? OM_OK : OM_NO_MEMORY;
}

// ---- the solid ------------------------------------------------------------------------------------

static OmStatus load_solid(OmStudyBody* body, const char* path, double unit) {
    OmTetMesh mesh = {0};
    OmSurface surface = {0};
    int* vert = NULL;
    OmStatus status;
    OM_TRY_DONE(om_tet_mesh_load_flags(path, unit, OM_MESH_FLIP | OM_MESH_DROP_FLAT, &mesh));
    OM_TRY_DONE(om_tet_mesh_boundary(&mesh, &surface, &vert));
    body->lo = body->hi = om_load3(surface.x, 0);
    body->low = body->high = om_dot(body->up, body->lo);
    for (int i = 0; i < surface.nvert; ++i) {
        OmVec3 p = om_load3(surface.x, i);
        body->lo = om_min3(body->lo, p);
        body->hi = om_max3(body->hi, p);
        body->low = fmin(body->low, om_dot(body->up, p));
        body->high = fmax(body->high, om_dot(body->up, p));
    }
    OM_TRY_DONE(keep_attached(body, &mesh, &surface, vert));
    OmVec3 size = om_sub(body->hi, body->lo);
    OmSdfDef def = om_sdf_default_def(fmax(size.x, fmax(size.y, size.z)) / NODE_ALONG_BOX);
    OM_TRY_DONE(om_sdf_from_surface(&surface, &def, &body->sdf));
done:
    om_tet_mesh_done(&mesh);
    om_surface_done(&surface);
    om_free(vert);
    return status;
}

// ---- lesions --------------------------------------------------------------------------------------

// Distance from p along the unit vector d to the point where the ray last leaves the body.
static double last_exit(const OmStudyBody* body, OmVec3 p, OmVec3 d) {
    double step = 0.5 * body->sdf.grid.spacing, end = om_distance(body->lo, body->hi), t = end;
    while (t > 0 && om_study_body_eval(body, om_madd(p, t, d)) > 0) t -= step;
    double in = t, out = t + step;
    for (int k = 0; k < 30; ++k) {
        double mid = 0.5 * (in + out);
        *(om_study_body_eval(body, om_madd(p, mid, d)) > 0 ? &out : &in) = mid;
    }
    return in;
}

// Distance from p, inside, along the unit vector d to the point where the ray first leaves the body.
static double first_exit(const OmStudyBody* body, OmVec3 p, OmVec3 d) {
    double step = 0.5 * body->sdf.grid.spacing, end = om_distance(body->lo, body->hi), t = step;
    while (t < end && om_study_body_eval(body, om_madd(p, t, d)) < 0) t += step;
    return t;
}

// Choose the probe's direction over a lesion, the position of first contact, and the largest depth. Rays along
// the normal, on a grid over the face, find the highest point of the body and the attached points below. A thin
// part would bend instead of being compressed, so it is avoided.
static void aim(const OmStudyBody* body, OmStudyLesion* l) {
    OmVec3 above = om_madd(l->center, last_exit(body, l->center, body->up), body->up), slope;
    om_sdf_eval(&body->sdf, above, &slope);
    l->normal = om_dot(slope, body->up) > 0.5 * om_norm(slope) ? om_normalize(slope) : body->up;
    l->along = om__study_across(l->normal, om_vec3(1, 0, 0));
    OmVec3 wide = om_cross(l->normal, l->along), down = om_scale(-1, l->normal);
    double height = -HUGE_VAL, reach = om_distance(body->lo, body->hi),
           edge = body->sdf.grid.spacing;
    double bottom = -first_exit(body, l->center, down);
    for (int i = 0; i < FACE_SAMPLES; ++i) {
        for (int j = -2; j <= 2; ++j) {
            double u = PROBE_LONG * ((double)i / (FACE_SAMPLES - 1) - 0.5), v = PROBE_WIDE * j / 4;
            OmVec3 p = om_add(l->center, om_add(om_scale(u, l->along), om_scale(v, wide)));
            OmVec3 from = om_madd(p, -0.5 * reach, l->normal);
            double t = last_exit(body, from, l->normal) - 0.5 * reach;
            if (t < -0.5 * reach + 1e-9) continue;
            height = fmax(height, t);
            double low = t - edge - first_exit(body, om_madd(p, t - edge, l->normal), down);
            bool is_attached = om__study_is_attached(body, om_madd(p, low, l->normal), 4 * edge);
            if (is_attached) bottom = fmax(bottom, low);
        }
    }
    l->touch = om_madd(l->center, height, l->normal);
    l->max = MAX_FRACTION * (height - bottom);
}

static OmStatus read_lesion(const char** at, const char* end, double unit, OmStudyLesion* l,
                            bool* is_found) {
    double value[4] = {0, 0, 0, DEFAULT_RADIUS / unit};
    int n = 0;
    const char* s = *at;
    while (s < end && *s != '\n' && *s != '#') {
        if (*s == ' ' || *s == '\t' || *s == ',' || *s == '\r') {
            ++s;
            continue;
        }
        double v;
        OM_CHECK(om_number_parse(&s, end, &v) && isfinite(v) && n < 4, OM_INVALID,
                 "\"%.20s\" is not one of x y z [radius]", s);
        value[n++] = v;
    }
    while (s < end && *s != '\n') ++s;
    *at = s < end ? s + 1 : s;
    *is_found = n > 0;
    OM_CHECK(n == 0 || n >= 3, OM_INVALID, "%d numbers; x y z [radius] are wanted", n);
    OM_CHECK(value[3] > 0, OM_INVALID, "a radius of %g; more than 0 is wanted", value[3]);
    memset(l, 0, sizeof *l);
    l->center = om_vec3(unit * value[0], unit * value[1], unit * value[2]);
    l->radius = unit * value[3];
    return OM_OK;
}

static OmStatus add_lesion(OmStudyBody* body, OmStudyLesion* l) {
    if (om_study_body_eval(body, l->center) >= 0) {
        ++body->noutside;
        return OM_OK;
    }
    OM_CHECK(body->nlesion < OM_STUDY_MAX_LESION, OM_INVALID, "more than %d lesions",
             OM_STUDY_MAX_LESION);
    aim(body, l);
    body->lesion[body->nlesion++] = *l;
    return OM_OK;
}

static OmStatus load_lesions(OmStudyBody* body, const char* path, double unit) {
    char* text;
    size_t size;
    OM_TRY(om_file_read(path, MAX_LESION_FILE, &text, &size));
    const char *at = text, *end = text + size;
    OmStatus status = OM_OK;
    for (int line = 1; at < end && status == OM_OK; ++line) {
        OmStudyLesion l;
        bool is_found = false;
        status = read_lesion(&at, end, unit, &l, &is_found);
        if (status == OM_OK && is_found) status = add_lesion(body, &l);
        if (status < 0) om_error_prefix(status, "%s:%d", path, line);
    }
    om_free(text);
    if (status < 0 || body->nlesion > 0) return status;
    OM_CHECK(body->noutside > 0, OM_INVALID, "%s: no lesion; one a line, x y z [radius]", path);
    return om_error(
        OM_INVALID,
        "%s: none of %d lesions is inside the body, which is in (%.1f, %.1f, %.1f)-(%.1f, "
        "%.1f, %.1f) mm; are the units right?",
        path, body->noutside, 1e3 * body->lo.x, 1e3 * body->lo.y, 1e3 * body->lo.z,
        1e3 * body->hi.x, 1e3 * body->hi.y, 1e3 * body->hi.z);
}

OmStatus om_study_body_load(const char* mesh, double unit, const char* lesion, double lesion_unit,
                            OmVec3 up, OmStudyBody** out) {
    *out = NULL;
    OM_CHECK(unit > 0 && isfinite(unit) && lesion_unit > 0 && isfinite(lesion_unit), OM_INVALID,
             "study: units are %g and %g m; above 0 is wanted", unit, lesion_unit);
    OM_CHECK(om_is_finite3(up), OM_INVALID, "study: the direction up is not finite");
    OmStudyBody* body = om_calloc(1, sizeof *body);
    if (!body) return OM_NO_MEMORY;
    const char* name = strrchr(mesh, '/');
    snprintf(body->name, sizeof body->name, "%s", name ? name + 1 : mesh);
    body->is_file = true;
    body->up = om_norm(up) > 0 ? om_normalize(up) : om_vec3(0, 0, 1);
    OmStatus status = load_solid(body, mesh, unit);
    if (status == OM_OK) status = load_lesions(body, lesion, lesion_unit);
    if (status < 0)
        om_study_body_destroy(body);
    else
        *out = body;
    return status < 0 ? status : OM_OK;
}
