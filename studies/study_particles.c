// study_particles.c: particles pressed by the probe, compared with the truth of a body.
#include <math.h>

#include "omentum/pbd.h"
#include "studies/study_internal.h"

// Build a model with these parameters. It is refused if clusters leave particles out, or are so small that
// neighbours have no particle in common: the body would fall apart.
static OmStatus build(void* ctx, const double* param, int nworker, OmTissueModel** model) {
    const StudyFit* fit = ctx;
    *model = NULL;
    if (param[1] < fmax(0.5 * param[0], fit->def->spacing))
        return om_error(
            OM_UNSAT,
            "clusters of radius %g mm contain only one particle each at a spacing of %g mm",
            1e3 * param[1], 1e3 * fit->def->spacing);
    OmPbdDef pbd = om_pbd_default_def(OM_PBD_CLUSTERS);
    pbd.particle_volume = fit->volume;
    pbd.cluster_spacing = param[0];
    pbd.cluster_radius = param[1];
    pbd.cluster_stiffness = param[2];
    OmTissueDef def = om_tissue_default_def(om_pbd_engine(), &fit->particles);
    def.options = &pbd;
    def.gravity = om_vec3(0, 0, 0);
    def.density = fit->contact.density;
    def.solver.nworker = nworker;
    OmStatus status = om_tissue_create(&def, model);
    return status == OM_INVALID ? OM_UNSAT : status;
}

// The lattice of particles inside the body; its lowest layer is fixed.
OmStatus om__study_make_particles(StudyFit* fit) {
    OmTetMesh* p = &fit->particles;
    OM_TRY(om_pbd_sample_surface(&fit->study.surface, fit->def->spacing, p, &fit->volume));
    double low = HUGE_VAL;
    int n = 0, *fixed = om_alloc((size_t)p->nvert, sizeof *fixed);
    if (!fixed) return OM_NO_MEMORY;
    for (int i = 0; i < p->nvert; ++i) low = fmin(low, om_load3(p->x, i).z);
    for (int i = 0; i < p->nvert; ++i)
        if (om_load3(p->x, i).z < low + 0.5 * fit->def->spacing) fixed[n++] = i;
    OmStatus status = om_tet_mesh_add_set(p, "attachment", fixed, n);
    om_free(fixed);
    return status;
}

static OmVec3 nearest_particle(const OmTetMesh* particles, OmVec3 p) {
    int best = 0;
    for (int i = 1; i < particles->nvert; ++i)
        if (om_distance(om_load3(particles->x, i), p) <
            om_distance(om_load3(particles->x, best), p))
            best = i;
    return om_load3(particles->x, best);
}

int om__study_plan_depths(const StudyFit* fit, const StudyPlan* plan, int i) {
    int n = fit->study.truth[plan->lesion[i]].ndepth - plan->first;
    return n > 0 ? n : 0;
}

OmStatus om__study_make_tissue(StudyFit* fit, const StudyPlan* plan, const double* start,
                               OmCalibrationTissue** tissue) {
    OmCalibrationPath path[OM_STUDY_MAX_LESION] = {0};
    const char* name[OM_STUDY_MAX_LESION];
    double rest[3 * OM_STUDY_MAX_LESION];
    int nseen = 0;
    OmCalibrationTissueDef def = om_calibration_tissue_default_def(build, fit);
    OmCalibrationSeen* seen =
        om_alloc((size_t)(plan->n * OM_STUDY_NDEPTH * plan->nseen), sizeof *seen);
    if (!seen) return OM_NO_MEMORY;
    for (int i = 0; i < plan->n; ++i) {
        int lesion = plan->lesion[i];
        const OmStudyLesion* l = &fit->body->lesion[lesion];
        OmVec3 contour = om__study_contour(l), p = nearest_particle(&fit->particles, contour);
        om_store3(rest, i, p);
        name[i] = fit->name[lesion];
        path[i] = (OmCalibrationPath){.name = fit->name[lesion],
                                      .kind = OM_PATH_PRESS,
                                      .point = l->touch,
                                      .direction = om_scale(-1, l->normal),
                                      .along = l->along,
                                      .probe = fit->study.probe,
                                      .friction = fit->contact.friction,
                                      .speed = fit->def->speed,
                                      .time_step = fit->def->time_step,
                                      .settle = fit->def->settle,
                                      .nlevel = om__study_plan_depths(fit, plan, i),
                                      .level = fit->contact.depth + plan->first};
        for (int k = 0; k < path[i].nlevel; ++k) {
            for (int a = 0; a < plan->nseen; ++a) {
                OmStudyContactDef noise = fit->contact;
                noise.seed += (uint64_t)a;
                OmVec3 x =
                    om__study_measured_contour(&noise, &fit->study.truth[lesion], plan->first + k);
                seen[nseen++] = (OmCalibrationSeen){i, k, i, om_add(p, om_sub(x, contour))};
            }
        }
    }
    def.npath = def.nlandmark = plan->n;
    def.path = path;
    def.landmark = name;
    def.rest = rest;
    def.nobservation = nseen;
    def.observation = seen;
    OmStatus status = om_calibration_tissue_create(&def, start, tissue);
    om_free(seen);
    return status;
}

OmStatus om__study_score_particles(StudyFit* fit, int first, int end, const double* param,
                                   double error[][OM_STUDY_NDEPTH]) {
    int lesion[OM_STUDY_MAX_LESION];
    StudyPlan plan = {.nseen = 1, .lesion = lesion};
    for (int l = first; l < end; ++l)
        if (fit->study.truth[l].ndepth) lesion[plan.n++] = l;
    OM_CHECK(plan.n > 0, OM_INVALID,
             "%s: no lesion has a truth; ask for a finer one (truth_ntet = %d)",
             fit->contact.out_dir, fit->contact.truth_ntet);
    OmCalibrationTissue* tissue;
    double value[OM_STUDY_MAX_LESION * OM_STUDY_NDEPTH];
    OM_TRY(om__study_make_tissue(fit, &plan, param, &tissue));
    OmStatus status = om_calibration_tissue_eval(tissue, param, fit->def->nworker, value);
    om_calibration_tissue_destroy(tissue);
    const double* e = value;
    for (int i = 0; i < plan.n && status == OM_OK; ++i)
        for (int k = 0; k < om__study_plan_depths(fit, &plan, i); ++k) error[lesion[i]][k] = *e++;
    return status;
}
