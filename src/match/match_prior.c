// match_prior.c: which sets of attached vertices are probable before and after evidence.
//
// The prior is a bank of random patches of the candidates, as thesis 4.2.1 makes them (om_surface_random_patch:
// geodesic distance from a random vertex, angle of normals, noise), of a random share of 5 to 50 %; every fifth
// hypothesis is the union of two such patches. The bank is made once, from its own seed. Evidence is a log-likelihood
// ratio e_i of "attached" against "free" for each candidate. A hypothesis H has log-likelihood l(H) = sum over its
// vertices of e_i. No hypothesis of some thousands fits the outline of the truth vertex by vertex, so l is divided by
// the smallest temperature >= 1 at which NEFFECTIVE hypotheses share the weight (effective number,
// (sum w)^2 / sum w^2). The weighted mean of the hypotheses is the prior probability of each vertex given the evidence
// elsewhere; its log-odds plus e_i is the result. A belief from outside takes the place of a share of that prior: the
// log-odds of both are mixed.
#include <string.h>

#include "match/match_internal.h"
#include "omentum/shape_meshing.h"

#define MIN_SHARE 0.05
#define MAX_SHARE 0.5
#define TWO_OF 5         // one hypothesis of so many is two patches
#define NEFFECTIVE 40.0  // hypotheses that share the weight
#define LEAST 0.02       // probabilities of the bank stay this far from 0 and 1
#define MAX_TEMPERATURE 1e6
// Log-odds of what is attached in truth over those of the inference: candidates are not independent, and evidence is
// counted more than once. By logistic regression on 80 development truths of `omentum study trust` (60,000 vertices).
#define SLOPE 0.62
#define OFFSET -0.43

typedef struct Bank {  // what all patches share
    const OmMatch* m;
    OmSurface surface;                       // boundary of the site's mesh, without midpoints
    int *surface_vert, *on_surface, *index;  // its vertices; candidate to vertex of it, and back
    double* normal;                          // of the surface's vertices                (nvert x 3)
} Bank;

static OmStatus add_patch(const Bank* bank, double share, uint64_t seed,
                          unsigned char* hypothesis) {
    const OmMatch* m = bank->m;
    OmPatchDef def = om_patch_default_def(share, seed);
    def.normal = bank->normal;
    int *vert, nvert;
    OM_TRY(om_surface_random_patch(&bank->surface, bank->on_surface, m->view.ncandidate, &def,
                                   &vert, &nvert));
    for (int k = 0; k < nvert; ++k) hypothesis[bank->index[vert[k]]] = 1;
    om_free(vert);
    return OM_OK;
}

OmStatus om__match_make_prior(OmMatch* m) {
    int n = m->view.ncandidate, count = m->def.nhypothesis;
    Bank bank = {.m = m};
    OmStatus status = OM_OK;
    OM_TRY_DONE(om_tet_mesh_boundary(&m->def.site->mesh, &bank.surface, &bank.surface_vert));
    OM_ALLOC_DONE(bank.on_surface, n);
    OM_ALLOC_DONE(bank.index, bank.surface.nvert);
    OM_ALLOC_DONE(bank.normal, 3 * (size_t)bank.surface.nvert);
    om_surface_normals(&bank.surface, bank.normal);
    m->hypothesis = om_calloc((size_t)count * (size_t)n, 1);
    OM_CHECK_DONE(m->hypothesis, OM_NO_MEMORY, "out of memory");
    for (int i = 0; i < bank.surface.nvert; ++i) {
        int at = m->candidate_of[bank.surface_vert[i]];
        bank.index[i] = at;
        if (at >= 0) bank.on_surface[at] = i;
    }
    for (int h = 0; h < count; ++h) {
        OmRng rng = om_rng_init(m->def.seed, (uint64_t)h);
        int npatch = h % TWO_OF == TWO_OF - 1 ? 2 : 1;
        double share = om_rng_range(&rng, MIN_SHARE, MAX_SHARE) / npatch;
        for (int k = 0; k < npatch; ++k) {
            uint64_t seed = (uint64_t)om_rng_u32(&rng) << 32 | om_rng_u32(&rng);
            OM_TRY_DONE(add_patch(&bank, share, seed, m->hypothesis + (size_t)h * (size_t)n));
        }
    }
done:
    om_surface_done(&bank.surface);
    om_free(bank.surface_vert);
    om_free(bank.on_surface);
    om_free(bank.index);
    om_free(bank.normal);
    return status;
}

// Weights at a temperature, and their effective number.
static double weigh(int count, const double* l, double best, double temperature, double* w) {
    double sum = 0, square = 0;
    for (int h = 0; h < count; ++h) {
        w[h] = exp((l[h] - best) / temperature);
        sum += w[h];
        square += w[h] * w[h];
    }
    for (int h = 0; h < count; ++h) w[h] /= sum;  // the best has weight 1
    return sum * sum / square;
}

double om__match_logit(double p) {
    p = fmin(fmax(p, LEAST), 1 - LEAST);
    return log(p / (1 - p));
}

OmStatus om__match_infer(const OmMatch* m, const double* evidence, const double* belief,
                         double weight, double* probability) {
    int n = m->view.ncandidate, count = m->def.nhypothesis;
    double *l = NULL, *w = NULL, best = -HUGE_VAL, temperature = 1;
    OmStatus status = OM_OK;
    OM_ALLOC_DONE(l, count + 1);
    OM_ALLOC_DONE(w, count + 1);
    for (int h = 0; h < count; ++h) {
        const unsigned char* in = m->hypothesis + (size_t)h * (size_t)n;
        l[h] = 0;
        for (int i = 0; i < n; ++i) l[h] += in[i] ? evidence[i] : 0;
        best = fmax(best, l[h]);
    }
    double want = fmin(NEFFECTIVE, 0.5 * count);
    while (count > 0 && weigh(count, l, best, temperature, w) < want &&
           temperature < MAX_TEMPERATURE)
        temperature *= 1.25;
    for (int i = 0; i < n; ++i) {
        double p = count > 0 ? 0 : 0.5;
        for (int h = 0; h < count; ++h)
            p += m->hypothesis[(size_t)h * (size_t)n + (size_t)i] ? w[h] : 0;
        double prior = om__match_logit(p);
        if (belief) prior += weight * (om__match_logit(belief[i]) - prior);
        probability[i] = 1 / (1 + exp(-(prior + evidence[i])));
    }
done:
    om_free(l);
    om_free(w);
    return status;
}

void om__match_calibrate(int n, double* probability) {
    for (int i = 0; i < n; ++i) {
        double p = fmin(fmax(probability[i], 1e-6), 1 - 1e-6);
        probability[i] = 1 / (1 + exp(-(SLOPE * log(p / (1 - p)) + OFFSET)));
    }
}

// Sets {p > t}: the t above 0 with the largest expected Dice coefficient 2 sum_S p / (|S| + sum p), by area.
double om__match_choose_level(const OmMatch* m, const double* probability) {
    int n = m->view.ncandidate;
    double all = 0, best = 0, level = 0.5;
    for (int i = 0; i < n; ++i) all += probability[i] * m->area[i];
    for (double t = 0.2; t < 0.605; t += 0.02) {
        double in = 0, area = 0;
        for (int i = 0; i < n; ++i) {
            if (!(probability[i] > t)) continue;
            in += probability[i] * m->area[i];
            area += m->area[i];
        }
        double dice = area > 0 ? 2 * in / (area + all) : 0;
        if (dice > best) {
            best = dice;
            level = t;
        }
    }
    return level;
}
