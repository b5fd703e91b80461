// tissue_force.c: resultant forces on the tissue, energy and momentum.
//
// Each force is computed from its own source: the force of a tool from the rows of A that the tool constrains, the
// force of an attachment from the stresses of its elements (or from its spring), the force of the ground from contact,
// weight from the masses. At rest the sum must be zero, which tests all of them together.
#include <string.h>

#include "tissue/tissue_internal.h"

static bool is_own(const OmTissueModel* m, int i) { return !m->own || m->own[i]; }

// Force of the attachment on vertex i of the tissue, from the elastic force there. At a fixed vertex it balances all
// other forces: elastic force, weight, external force, contact.
static OmVec3 attachment_force(const OmTissueModel* m, const OmTissueState* s, int i,
                               OmVec3 elastic) {
    double k = om__state_stiffness(s)[i];
    if (k > 0) {
        OmVec3 pull = om_sub(om_load3(om__state_array(s, OM__ANCHOR), i),
                             om_load3(om__state_array(s, OM__X), i));
        return om_scale(k, pull);
    }
    if (m->engine->step) return om_load3(om__state_array(s, OM__F_TOOL), i);
    OmVec3 on = om_madd(elastic, m->mass[i], m->def.gravity);
    on = om_add(on, om_load3(om__state_array(s, OM__F_EXT), i));
    on = om_add(on, om_load3(om__state_array(s, OM__F_TOUCH), i));
    return om_scale(-1, on);
}

// The forces of bonds on the vertices of a mask, and their sum over those of `counts`; null: all.
static OmStatus add_bonds_of_held(const OmTissueModel* m, const OmTissueState* s,
                                  const unsigned char* mask, const unsigned char* counts,
                                  double* force, OmVec3* sum) {
    if (m->nbond == 0) return OM_OK;
    double* all = om_calloc(3 * (size_t)m->mesh.nvert, sizeof *all);
    if (!all) return OM_NO_MEMORY;
    om__bonds_add(m, om__state_array(s, OM__X), mask, all);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (!counts || counts[i]) *sum = om_add(*sum, om_load3(all, i));
        if (force) om_store3(force, i, om_add(om_load3(force, i), om_load3(all, i)));
    }
    om_free(all);
    return OM_OK;
}

// Elastic forces on fixed vertices: each of them in `force` (nvert x 3), or, where that is null, the sum over those of
// the tissue itself.
static OmStatus add_elastic_of_held(const OmTissueModel* m, const OmTissueState* s, double* force,
                                    OmVec3* sum) {
    const unsigned char *attached = om__state_attached(s), *mask = attached;
    unsigned char* copy = NULL;
    int nheld = 0, nspring = 0;
    for (int i = 0; i < m->mesh.nvert; ++i) {
        nheld += om__is_held_still(s, i);
        nspring += om__state_stiffness(s)[i] > 0;
    }
    if (nheld == 0 || m->engine->step) return OM_OK;
    if (nspring > 0 || (m->own && !force)) {
        copy = om_alloc((size_t)m->mesh.nvert, 1);
        if (!copy) return OM_NO_MEMORY;
        for (int i = 0; i < m->mesh.nvert; ++i)
            copy[i] = om__is_held_still(s, i) && (force || is_own(m, i));
        mask = copy;
    }
    OmStatus status = m->engine->add_internal_force(m, om__state_array(s, OM__X), mask, force, sum);
    if (status == OM_OK) status = add_bonds_of_held(m, s, mask, NULL, force, sum);
    om_free(copy);
    return status;
}

OmStatus om_tissue_get_forces(const OmTissueModel* m, const OmTissueState* s,
                              OmTissueForces* forces) {
    *forces = (OmTissueForces){0};
    const signed char* by = om__state_held_by(s);
    const double *f_ext = om__state_array(s, OM__F_EXT), *f_tool = om__state_array(s, OM__F_TOOL);
    const double* f_touch = om__state_array(s, OM__F_TOUCH);
    OmVec3 zero = {0, 0, 0}, g = m->def.gravity, sum = zero, elastic = zero;
    double mass = m->own ? 0 : m->total_mass;
    for (int i = 0; i < m->mesh.nvert; ++i) {
        if (!is_own(m, i)) continue;
        if (m->own) mass += m->mass[i];
        forces->external = om_add(forces->external, om_load3(f_ext, i));
        forces->contact = om_add(forces->contact, om_load3(f_touch, i));
        if (by[i] >= 0) {
            OmVec3 f = om_load3(f_tool, i);
            forces->grasp[by[i]] = om_add(forces->grasp[by[i]], f);
            forces->pull[by[i]] = om_madd(om_add(forces->pull[by[i]], f), m->mass[i], g);
        }
        if (om__state_attached(s)[i]) sum = om_add(sum, attachment_force(m, s, i, zero));
    }
    OM_TRY(add_elastic_of_held(m, s, NULL, &elastic));
    forces->attachment = om_sub(sum, elastic);
    forces->weight = om_scale(mass, g);
    // what bonds hold on other bodies is attached, too; between vertices of the tissue they cancel
    return m->own ? add_bonds_of_held(m, s, NULL, m->own, NULL, &forces->attachment) : OM_OK;
}

OmStatus om_tissue_get_internal_force(const OmTissueModel* m, const OmTissueState* s,
                                      double* force) {
    OmVec3 sum = {0, 0, 0};
    OM_CHECK(m->engine->add_internal_force, OM_UNAVAILABLE,
             "tissue: engine \"%s\" has no internal forces", m->engine->name);
    memset(force, 0, 3 * (size_t)m->mesh.nvert * sizeof(double));
    OM_TRY(m->engine->add_internal_force(m, om__state_array(s, OM__X), NULL, force, &sum));
    om__bonds_add(m, om__state_array(s, OM__X), NULL, force);
    return OM_OK;
}

OmStatus om_tissue_get_attachment_force(const OmTissueModel* m, const OmTissueState* s,
                                        double* force) {
    OmVec3 zero = {0, 0, 0}, sum = zero;
    memset(force, 0, 3 * (size_t)m->mesh.nvert * sizeof(double));
    OM_TRY(add_elastic_of_held(m, s, force, &sum));
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 f = zero;
        if (om__state_attached(s)[i]) f = attachment_force(m, s, i, om_load3(force, i));
        om_store3(force, i, f);
    }
    return OM_OK;
}

OmStatus om_tissue_get_holding_force(const OmTissueModel* m, const OmTissueState* s,
                                     double* force) {
    OM_TRY(om_tissue_get_attachment_force(m, s, force));
    const double* f_tool = om__state_array(s, OM__F_TOOL);
    const double* f_touch = om__state_array(s, OM__F_TOUCH);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 f = om_load3(f_touch, i);
        if (om__state_held_by(s)[i] >= 0) f = om_add(f, om_load3(f_tool, i));
        om_store3(force, i, om_add(f, om_load3(force, i)));
    }
    return OM_OK;
}

OmStatus om_tissue_get_measure(const OmTissueModel* m, const OmTissueState* s,
                               OmTissueMeasure measure, double* value) {
    OM_CHECK(measure >= OM_VON_MISES && measure <= OM_ENERGY_DENSITY, OM_INVALID,
             "tissue: measure %d is not known", (int)measure);
    OM_CHECK(m->engine->get_measure, OM_UNAVAILABLE, "tissue: engine \"%s\" has no stresses",
             m->engine->name);
    return m->engine->get_measure(m, om__state_array(s, OM__X), measure, value);
}

OmStatus om_tissue_get_energy(const OmTissueModel* m, const OmTissueState* s,
                              OmTissueEnergy* energy) {
    *energy = (OmTissueEnergy){0};
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    const double* anchor = om__state_array(s, OM__ANCHOR);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 p = om_load3(x, i);
        energy->kinetic += 0.5 * m->mass[i] * om_norm2(om_load3(v, i));
        energy->gravity -= m->mass[i] * om_dot(m->def.gravity, p);
        double k = om__state_stiffness(s)[i];
        if (k > 0) energy->spring += 0.5 * k * om_norm2(om_sub(p, om_load3(anchor, i)));
    }
    energy->spring += om__bonds_add(m, x, NULL, NULL);
    return m->engine->get_energy ? m->engine->get_energy(m, x, &energy->elastic) : OM_OK;
}

void om_tissue_get_momentum(const OmTissueModel* m, const OmTissueState* s, OmVec3* linear,
                            OmVec3* angular) {
    OmVec3 p = {0, 0, 0}, l = p;
    const double *x = om__state_array(s, OM__X), *v = om__state_array(s, OM__V);
    for (int i = 0; i < m->mesh.nvert; ++i) {
        OmVec3 mv = om_scale(m->mass[i], om_load3(v, i));
        p = om_add(p, mv);
        l = om_add(l, om_cross(om_load3(x, i), mv));
    }
    if (linear) *linear = p;
    if (angular) *angular = l;
}
