// tissue_material.c: names of laws, checks and conversion of constants.
#include <math.h>
#include <string.h>

#include "omentum/tissue_material.h"

static const char* const law_name[OM_NLAW] = {
    [OM_COROTATIONAL] = "corotational",
    [OM_LINEAR] = "linear",
    [OM_ST_VENANT_KIRCHHOFF] = "st-venant-kirchhoff",
    [OM_NEO_HOOKEAN] = "neo-hookean",
    [OM_STABLE_NEO_HOOKEAN] = "stable-neo-hookean",
    [OM_MOONEY_RIVLIN] = "mooney-rivlin",
    [OM_OGDEN] = "ogden",
    [OM_OGDEN_COUPLED] = "ogden-coupled",
};

const char* om_law_name(OmLaw law) { return (int)law >= 0 && law < OM_NLAW ? law_name[law] : NULL; }

OmStatus om_law_find(const char* name, OmLaw* law) {
    for (int k = 0; name && k < OM_NLAW; ++k) {
        *law = (OmLaw)k;
        if (strcmp(name, law_name[k]) == 0) return OM_OK;
    }
    *law = OM_COROTATIONAL;
    const char* near = name ? om_nearest_word(name, law_name, OM_NLAW) : NULL;
    return om_error(OM_INVALID, "law \"%s\" is not known%s%s%s", name ? name : "(null)",
                    near ? "; did you mean \"" : "", near ? near : "", near ? "\"?" : "");
}

OmStatus om_material_validate(const OmMaterial* m, const char* field) {
    OM_CHECK(m->young > 0 && m->young <= 1e12, OM_INVALID,
             "%s.young is %g Pa; it must be above 0 and at most 1e12", field, m->young);
    OM_CHECK(m->poisson >= 0 && m->poisson <= OM_MAX_POISSON, OM_INVALID,
             "%s.poisson is %g; it must be at least 0 and at most %g", field, m->poisson,
             OM_MAX_POISSON);
    OM_CHECK(om_law_name(m->law), OM_INVALID, "%s.law is %d, which is none of OmLaw", field,
             (int)m->law);
    OM_CHECK((int)m->volumetric >= 0 && m->volumetric < OM_NVOLUMETRIC, OM_INVALID,
             "%s.volumetric is %d, which is none of OmVolumetric", field, (int)m->volumetric);
    OM_CHECK(m->bulk >= 0 && m->bulk <= 1e12, OM_INVALID,
             "%s.bulk is %g Pa; it must be from 0 (of young and poisson) to 1e12", field, m->bulk);
    OM_CHECK(m->c10 >= 0 && m->c01 >= 0 && m->c10 <= 1e12 && m->c01 <= 1e12, OM_INVALID,
             "%s.c10 and .c01 are %g and %g Pa; they must be from 0 to 1e12", field, m->c10,
             m->c01);
    OM_CHECK(m->nterm >= 0 && m->nterm <= OM_MAX_OGDEN, OM_INVALID,
             "%s.nterm is %d; it must be from 0 to %d", field, m->nterm, OM_MAX_OGDEN);
    for (int p = 0; p < m->nterm; ++p)
        OM_CHECK(m->ogden_mu[p] * m->ogden_alpha[p] > 0 && fabs(m->ogden_mu[p]) <= 1e12 &&
                     fabs(m->ogden_alpha[p]) <= 100,
                 OM_INVALID,
                 "%s: term %d of Ogden has mu %g Pa and alpha %g; they must have the same sign, mu "
                 "at most 1e12, alpha at most 100",
                 field, p, m->ogden_mu[p], m->ogden_alpha[p]);
    return OM_OK;
}

void om_material_lame(const OmMaterial* m, double* lambda, double* mu, double* bulk) {
    *mu = m->young / (2 * (1 + m->poisson));
    *bulk = m->young / (3 * (1 - 2 * m->poisson));  // poisson <= OM_MAX_POISSON
    if (m->bulk > 0) *bulk = m->bulk;
    if (m->law == OM_MOONEY_RIVLIN && m->c10 + m->c01 > 0) *mu = 2 * (m->c10 + m->c01);
    if ((m->law == OM_OGDEN || m->law == OM_OGDEN_COUPLED) && m->nterm > 0) {
        *mu = 0;
        for (int p = 0; p < m->nterm; ++p) *mu += 0.5 * m->ogden_mu[p] * m->ogden_alpha[p];
    }
    if (m->law == OM_OGDEN_COUPLED && m->nterm > 0) *bulk += *mu * 2 / 3;
    *lambda = *bulk - *mu * 2 / 3;
}
