// study_methods.c: finite elements, particles and a trained network press over the same lesions.
//
// Finite elements are the contact study's runs by prescribed displacement. Particles are pressed along the same paths
// with the parameters that the calibration study found. The network is evaluated at every step of the path: its
// surface nodes under the probe's face move with the probe. A lesion's contour point moves with the element that
// contains it. Stability is the fraction of the path before a value is not finite or an element is inverted; a
// network continues after that, and its errors count.
#include <float.h>
#include <math.h>
#include <string.h>

#include "omentum/umesh_net.h"
#include "studies/study_cases.h"
#include "studies/study_internal.h"

#define COOKIE 0x57d1ca2bu
#define BAR 0.3e-3  // m, largest difference of the network's error to that of finite elements
#define SECONDS_LESION 2.5  // processor time with a spacing of 8 mm, for the estimate
#define FIT 0.1             // of the phantom's size: largest difference of the network's organ

const char* const om__study_method_by_name[OM_STUDY_NBY] = {"finite_elements", "particles", "umesh",
                                                            "rigid"};
const char* const om__study_method_by_title[OM_STUDY_NBY] = {
    "finite elements, prescribed", "particles, calibrated", "U-Mesh", "rigid"};

OmStudyMethodsDef om_study_methods_default_def(const char* out_dir, const char* weights) {
    OmStudyCalibrationDef particles = om_study_calibration_default_def(out_dir);
    OmStudyMethodsDef def = {.out_dir = out_dir,
                             .weights = weights,
                             .nlesion = 10,
                             .cluster = {0.0096001, 0.0091674, 0.4524},
                             .spacing = particles.spacing,
                             .speed = particles.speed,
                             .settle = particles.settle,
                             .truth_ntet = particles.truth_ntet,
                             .fe_ntet = particles.fe_ntet,
                             .seed = 1,
                             .cookie = COOKIE};
    return def;
}

static OmStatus validate(const OmStudyMethodsDef* def) {
    const StudyRange range[] = {{"nlesion", def->nlesion, 1, 20},
                                {"spacing", def->spacing, 0.002, 0.02},
                                {"speed", def->speed, DBL_MIN, 1},
                                {"settle", def->settle, 0, 10},
                                {"cluster spacing", def->cluster[0], DBL_MIN, 1},
                                {"cluster radius", def->cluster[1], DBL_MIN, 1},
                                {"cluster stiffness", def->cluster[2], 0, 1}};
    OM_TRY(STUDY_CHECK("methods study", def, COOKIE, range));
    OM_CHECK(def->weights, OM_INVALID, "methods study: no weights");
    return OM_OK;
}

bool om__study_methods_count(const StudyMethods* s, int lesion, int depth) {
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        if (s->error[by][lesion][depth] < 0) return false;
    return true;
}

static double median(double* value, int n) {
    if (!n) return 0;
    om_sort_doubles(value, n);
    return value[n / 2];
}

// ---- finite elements and the rigid model --------------------------------------------------------------

static OmStatus score_fe(StudyMethods* s) {
    const Study* study = &s->fit.study;
    double* ms;
    int num = 0;
    OM_ALLOC(ms, OM_STUDY_MAX_LESION * OM_STUDY_MAX_STEP);
    for (int l = 0; l < s->def->nlesion; ++l) {
        const StudyRun* run = om__study_run_at(study, 0, OM_PRESS_PRESCRIBED, l);
        for (int i = 0; i < run->nrecord; ++i) ms[num++] = run->step[i].ms;
        s->stability[OM_STUDY_FE][l] = (double)run->ndone / run->nstep;
        s->stability[OM_STUDY_RIGID][l] = 1;
        // the path was not computed
        s->stability[OM_STUDY_PARTICLES][l] = study->truth[l].ndepth ? 0 : -1;
        for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
            s->error[OM_STUDY_RIGID][l][k] = om__study_contour_error(study, OM_STUDY_NMETHOD, l, k);
            s->error[OM_STUDY_FE][l][k] = om__study_contour_error(study, OM_PRESS_PRESCRIBED, l, k);
        }
    }
    s->ms[OM_STUDY_FE] = median(ms, num);
    om_free(ms);
    return OM_OK;
}

// ---- particles ------------------------------------------------------------------------------------

// One lesion at a time, so that a failed path leaves the errors of the others.
static OmStatus score_particles(StudyMethods* s) {
    const OmStudyMethodsDef* def = s->def;
    double begin = om_clock_now(), steps = 0;
    for (int l = 0; l < def->nlesion; ++l) {
        const StudyTruthResult* t = &s->fit.study.truth[l];
        if (!t->ndepth) continue;
        OmStatus status = om__study_score_particles(&s->fit, l, l + 1, def->cluster,
                                                    s->error[OM_STUDY_PARTICLES]);
        if (status < 0) return status;
        bool is_whole = status == OM_OK;
        for (int k = 0; k < t->ndepth && is_whole; ++k)
            is_whole = isfinite(s->error[OM_STUDY_PARTICLES][l][k]);
        s->stability[OM_STUDY_PARTICLES][l] = is_whole ? 1 : 0;
        steps += (s->fit.contact.depth[t->ndepth - 1] / def->speed + t->ndepth * def->settle) /
                 s->particles.time_step;
    }
    s->ms[OM_STUDY_PARTICLES] = steps > 0 ? 1e3 * (om_clock_now() - begin) / steps : 0;
    return OM_OK;
}

// ---- the network ----------------------------------------------------------------------------------

typedef struct NetPath {  // the network at one lesion
    OmUmeshPredictor* predictor;
    const OmUmeshGrid* grid;
    OmFemSolid* solid;  // elements of the grid
    unsigned char* mask;
    float* u;
    double* x;
    int elem;  // element that contains the contour point
    double weight[8];
} NetPath;

// Is an element inverted at one of its 2 x 2 x 2 points, where finite elements evaluate the law? (Corners are no
// criterion: corners of the elements in the training data are inverted at 15 to 20 mm.)
static bool has_inverted(const NetPath* a) {
    const OmFemMesh* mesh = &a->grid->fem.mesh;
    for (int i = 0; i < 3 * mesh->nnode; ++i) a->x[i] = mesh->x[i] + (double)a->u[i];
    return !(om_fem_eval_volume(a->solid, a->x, NULL) > 0);
}

static OmStatus eval_net(NetPath* a, const OmStudyLesion* lesion, double depth, OmVec3* contour,
                         OmUmeshTrust* trust) {
    OmVec3 move = om_scale(-depth, lesion->normal);
    const double value[3] = {move.x, move.y, move.z};
    for (int i = 0; i < a->grid->fem.mesh.nnode; ++i)
        for (int c = 0; c < 3; ++c) a->u[3 * i + c] = a->mask[i] ? (float)value[c] : 0;
    OM_TRY(om_umesh_predict(a->predictor, a->mask, a->u, trust));
    *contour = om__study_contour(lesion);
    for (int n = 0; n < 8; ++n) {
        const float* u = a->u + 3 * (size_t)a->grid->fem.mesh.elem_node[8 * a->elem + n];
        *contour = om_madd(*contour, a->weight[n], om_vec3(u[0], u[1], u[2]));
    }
    return OM_OK;
}

static OmStatus press_umesh(StudyMethods* s, NetPath* a, int l, double* ms, int* nms) {
    const Study* study = &s->fit.study;
    const OmStudyLesion* lesion = &s->fit.body->lesion[l];
    OmUmeshPatch patch = om_umesh_patch_default(lesion->touch, lesion->normal, lesion->along);
    OmVec3 contour;
    OmUmeshTrust trust;
    double at[3];
    int nstep = om__study_nstep(study->def, l), nwhole = 0;
    bool is_whole = true;
    om_store3(at, 0, om__study_contour(lesion));
    OM_TRY(om_fem_mesh_embed(&a->grid->fem.mesh, 1, at, &a->elem, a->weight));
    OM_CHECK(
        om_umesh_patch_select(a->grid, &patch, a->mask) > 0, OM_INVALID,
        "methods study: the network's surface has no node under the probe over lesion %d; was it "
        "trained on the phantom?",
        l + 1);
    double last = fmin(study->def->depth[OM_STUDY_NDEPTH - 1], lesion->max);
    for (int step = 0; step < nstep; ++step) {
        double begin = om_clock_now();
        OM_TRY(eval_net(a, lesion, last * (step + 1) / nstep, &contour, &trust));
        ms[(*nms)++] = 1e3 * (om_clock_now() - begin);
        is_whole = is_whole && om_is_finite3(contour) && !has_inverted(a);
        nwhole += is_whole;
    }
    s->stability[OM_STUDY_UMESH][l] = (double)nwhole / nstep;
    for (int k = 0; k < study->truth[l].ndepth; ++k) {
        OM_TRY(eval_net(a, lesion, study->def->depth[k], &contour, &trust));
        s->error[OM_STUDY_UMESH][l][k] =
            om_distance(contour, om__study_measured_contour(study->def, &study->truth[l], k));
        s->is_outside[l][k] = !trust.is_inside;
    }
    return OM_OK;
}

// The network's organ must lie in the same place as the phantom.
static OmStatus check_organ(const StudyMethods* s, const OmUmeshGrid* g) {
    const OmStudyBody* body = s->fit.body;
    OmVec3 lo = om_vec3(HUGE_VAL, HUGE_VAL, HUGE_VAL), hi = om_scale(-1, lo);
    for (int i = 0; i < g->fem.mesh.nnode; ++i) {
        OmVec3 x = om_load3(g->fem.mesh.x, i);
        lo = om_vec3(fmin(lo.x, x.x), fmin(lo.y, x.y), fmin(lo.z, x.z));
        hi = om_vec3(fmax(hi.x, x.x), fmax(hi.y, x.y), fmax(hi.z, x.z));
    }
    double size = om_distance(body->lo, body->hi);
    OM_CHECK(om_distance(lo, body->lo) < FIT * size && om_distance(hi, body->hi) < FIT * size,
             OM_INVALID, "%s: its organ is not the phantom of the study", s->def->weights);
    return OM_OK;
}

static void describe(StudyMethods* s, const OmUmeshNet* net) {
    const char* fact[] = {"samples", "epochs", "validation_error_mm", "command"};
    const char* value[4];
    for (int i = 0; i < 4; ++i) {
        value[i] = om_umesh_net_fact(net, fact[i]);
        if (!value[i]) value[i] = "?";
    }
    snprintf(s->training, sizeof s->training,
             "U-Mesh: %d elements, %s samples, %s epochs, validation error %.8s mm (%.300s)",
             om_umesh_net_grid(net)->fem.mesh.nelem, value[0], value[1], value[2], value[3]);
}

static OmStatus score_umesh(StudyMethods* s, const OmUmeshNet* net) {
    OmStatus status = OM_OK;
    NetPath a = {0};
    double* ms = NULL;
    int num = 0;
    a.grid = om_umesh_net_grid(net);
    describe(s, net);
    OM_TRY_DONE(om_umesh_predictor_create(net, s->def->nworker, &a.predictor));
    OM_ALLOC_DONE(a.mask, a.grid->fem.mesh.nnode);
    OM_ALLOC_DONE(a.u, 3 * (size_t)a.grid->fem.mesh.nnode);
    OM_ALLOC_DONE(a.x, 3 * (size_t)a.grid->fem.mesh.nnode);
    // any law: only volumes are computed
    OmMaterial material = {.law = OM_LINEAR, .young = 1, .poisson = 0.45};
    OmFemDef solid = om_fem_default_def(&a.grid->fem.mesh, 1, &material);
    OM_TRY_DONE(om_fem_create(&solid, &a.solid));
    OM_ALLOC_DONE(ms, OM_STUDY_MAX_LESION * OM_STUDY_MAX_STEP);
    for (int l = 0; l < s->def->nlesion; ++l) OM_TRY_DONE(press_umesh(s, &a, l, ms, &num));
    s->ms[OM_STUDY_UMESH] = median(ms, num);
done:
    om_free(ms);
    om_fem_destroy(a.solid);
    om_free(a.x);
    om_free(a.u);
    om_free(a.mask);
    om_umesh_predictor_destroy(a.predictor);
    return status;
}

// ---- the study ------------------------------------------------------------------------------------

void om__study_summarise_methods(StudyMethods* s) {
    OmStudyMethodsSummary* sum = &s->sum;
    bool is_stable = true;
    sum->worst_gap = -HUGE_VAL;
    for (int by = 0; by < OM_STUDY_NBY; ++by) {
        OmStudyMethodResult* r = &sum->by[by];
        double total = 0;
        int n = 0;
        r->ms = s->ms[by];
        int npressed = 0;
        for (int l = 0; l < s->def->nlesion; ++l) {
            if (s->stability[by][l] < 0) continue;
            r->stability += s->stability[by][l];
            ++npressed;
        }
        r->stability /= npressed ? npressed : 1;
        is_stable = is_stable && r->stability > 1 - 1e-12;
        for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
            for (int l = 0; l < s->def->nlesion; ++l) {
                if (!om__study_methods_count(s, l, k)) continue;
                r->error[k] += s->error[by][l][k];
                ++r->ndepth[k];
                if (by == OM_STUDY_UMESH) sum->noutside += s->is_outside[l][k];
            }
            total += r->error[k];
            n += r->ndepth[k];
            r->error[k] /= r->ndepth[k] ? r->ndepth[k] : 1;
        }
        r->mean = n ? total / n : 0;
        sum->ncount = n;
    }
    for (int k = 0; k < OM_STUDY_NDEPTH; ++k) {
        if (!sum->by[OM_STUDY_FE].ndepth[k]) continue;
        sum->gap[k] = sum->by[OM_STUDY_UMESH].error[k] - sum->by[OM_STUDY_FE].error[k];
        sum->worst_gap = fmax(sum->worst_gap, sum->gap[k]);
    }
    if (!sum->ncount) sum->worst_gap = 0;
    sum->is_met = sum->ncount > 0 && sum->worst_gap <= BAR && is_stable;
}

static OmStatus open_fit(StudyMethods* s, const OmUmeshNet* net, const OmProgress* progress) {
    const OmStudyMethodsDef* def = s->def;
    OmStudyContactDef* c = &s->fit.contact;
    s->particles = om_study_calibration_default_def(def->out_dir);
    s->particles.spacing = def->spacing;
    s->particles.speed = def->speed;
    s->particles.settle = def->settle;
    s->particles.nworker = def->nworker;
    s->fit.def = &s->particles;
    OM_TRY(om_study_body_create_phantom(def->nlesion, 1, &s->fit.body));
    OM_TRY(check_organ(s, om_umesh_net_grid(net)));  // check before the truth, which takes minutes
    *c = om_study_contact_default_def(s->fit.body, def->truth_dir ? def->truth_dir : def->out_dir);
    c->nresolution = 1;
    c->resolution[0] = def->fe_ntet;
    c->truth_ntet = def->truth_ntet;
    c->seed = def->seed;
    c->nworker = def->nworker;
    for (int m = 0; m < OM_STUDY_NMETHOD; ++m) c->has_method[m] = m == OM_PRESS_PRESCRIBED;
    for (int l = 0; l < s->fit.body->nlesion; ++l)
        snprintf(s->fit.name[l], sizeof s->fit.name[l], "lesion %d", l + 1);
    OM_TRY(om__study_open(c, progress, &s->fit.study));
    return om__study_make_particles(&s->fit);
}

OmStatus om_study_methods_run(const OmStudyMethodsDef* def, const OmProgress* progress,
                              OmStudyMethodsSummary* summary) {
    *summary = (OmStudyMethodsSummary){0};
    OM_TRY(validate(def));
    StudyMethods* s = om_calloc(1, sizeof *s);
    if (!s) return OM_NO_MEMORY;
    OmStatus status;
    OmUmeshNet* net = NULL;
    OmFolder folder = {0};
    s->def = def;
    for (int by = 0; by < OM_STUDY_NBY; ++by)
        for (int l = 0; l < OM_STUDY_MAX_LESION; ++l)
            for (int k = 0; k < OM_STUDY_NDEPTH; ++k) s->error[by][l][k] = -1;
    const StudyWork work = {"lesions for particles and U-Mesh", def->nlesion,
                            SECONDS_LESION * pow(0.008 / def->spacing, 3), true};
    OM_TRY_DONE(om__study_estimate_tell(&work, 1, def->nworker, progress));
    OM_TRY_DONE(om_umesh_net_load(def->weights, &net));
    OM_TRY_DONE(om_folder_open(def->out_dir, "methods study", &folder));
    OM_TRY_DONE(open_fit(s, net, progress));
    OM_TRY_DONE(score_fe(s));
    OM_TRY_DONE(score_umesh(s, net));
    OM_TRY_DONE(score_particles(s));
    om__study_summarise_methods(s);
    OM_TRY_DONE(om__study_report_methods(s));
    *summary = s->sum;
done:
    om__study_close(&s->fit.study);
    om_tet_mesh_done(&s->fit.particles);
    om_study_body_destroy(s->fit.body);
    om_umesh_net_destroy(net);
    om_folder_end(&folder);
    om_free(s);
    return status;
}
