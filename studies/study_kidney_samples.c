// study_kidney_samples.c: random attachments and loads on the fat over the kidney, found by the network alone.
//
// Samples are those of the training (om_banet_sample_make, way (a): exact displacements of the visible part) with the
// twin's mesh in place of random bodies. Scores and simulations are those of Table 4.1. A file holds the results of
// KIDNEY_CHUNK samples.
#include <string.h>

#include "omentum/banet_fuse.h"
#include "omentum/banet_net.h"
#include "studies/study_kidney_case.h"
#include "studies/study_match_case.h"
#include "studies/study_simulated_internal.h"

#define METHOD 3  // number of the method: results of another one are computed again

OmBanetSampleDef om__kidney_sample_def(const Kidney* s) {
    OmBanetSampleDef def = om_banet_sample_default_def(KIDNEY_SAMPLE_SEED);
    def.way = OM_BANET_EXACT;
    def.body = &s->twin.mesh;
    return def;
}

OmStatus om__kidney_sample_guess(const Kidney* s, SimBody* body) {
    const OmSurface* surface = &body->sample->surface;
    double* probability;
    OM_ALLOC(probability, (size_t)surface->nvert);
    OmStatus status =
        s->estimate(s->estimate_ctx, surface, body->sample->u, body->sample->seen, probability);
    double threshold = 1;
    if (status >= 0)
        status =
            om_banet_choose_threshold(surface->nvert, probability, OM_BANET_NEARLY, &threshold);
    for (int i = 0; i < surface->nvert && status >= 0; ++i)
        body->guess[i] = probability[i] >= threshold;
    om_free(probability);
    return status;
}

// AVE of a guess, m.
static OmStatus move(SimBody* body, KidneySample* r, double* ave) {
    SimMove m = {0};
    OM_TRY(om__sim_body_move(body, &m));
    *ave = m.ave;
    r->nstopped += m.is_stopped;
    return OM_OK;
}

static OmStatus score_sample(const Kidney* s, SimBody* body, KidneySample* r) {
    OM_TRY(om__sim_body_guess(body, OM_STUDY_SIM_ZERO));
    OM_TRY(move(body, r, &r->zero));
    OM_TRY(om__sim_body_guess(body, OM_STUDY_SIM_SAME));
    OM_TRY(move(body, r, &r->same));
    if (!s->estimate) return OM_OK;
    SimScore score;
    OM_TRY(om__kidney_sample_guess(s, body));
    OM_TRY(om__sim_body_score(body, &score));
    r->dsc = score.dsc;
    r->tpr = score.tpr;
    return move(body, r, &r->ave);
}

static OmStatus run_sample(const Kidney* s, int index, KidneySample* r) {
    OmBanetSampleDef def = om__kidney_sample_def(s);
    OmBanetSample sample;
    SimBody body = {0};
    OmStatus status = om_banet_sample_make(&def, index, &sample);
    if (status != OM_OK) return status < 0 ? status : OM_OK;  // no draw: is_made stays false
    r->is_made = true;
    r->input = sample.max_u;
    r->visible = sample.visible;
    r->share = sample.share;
    status = om__sim_body_make(&sample, def.side, &body);
    if (status == OM_OK) status = score_sample(s, &body, r);
    om__sim_body_done(&body);
    om_banet_sample_done(&sample);
    return status < 0 ? om_error_prefix(status, "kidney sample %d", index + 1) : OM_OK;
}

typedef struct Chunk {
    const Kidney* s;
    int first;
    KidneySample* result;  // (KIDNEY_CHUNK)
} Chunk;

static OmStatus run_one(void* ctx, int i) {
    const Chunk* c = ctx;
    return run_sample(c->s, c->first + i, &c->result[i]);
}

static int chunk_size(const Kidney* s, int k) {
    const int left = s->def->nsample - k * KIDNEY_CHUNK;
    return left < KIDNEY_CHUNK ? left : KIDNEY_CHUNK;
}

static OmStatus run_chunk(void* ctx, int k, void* result) {
    Kidney* s = ctx;
    const int n = chunk_size(s, k);
    s->sum.nnew += n;
    Chunk c = {s, k * KIDNEY_CHUNK, result};
    return om__study_each(n, n, s->def->nworker, run_one, &c, NULL, NULL);
}

static OmStatus name_chunk(const void* ctx, int k, char name[64], uint64_t* hash) {
    const Kidney* s = ctx;
    const OmBanetSampleDef sample = om__kidney_sample_def(s);
    const uint64_t def = om_banet_sample_def_hash(&sample);
    const int number[] = {METHOD, k * KIDNEY_CHUNK, chunk_size(s, k)};
    snprintf(name, 64, "samples-%05d%s.bin", k * KIDNEY_CHUNK + 1,
             s->def->is_quick ? "-quick" : "");
    *hash = om_hash(OM_VERSION, strlen(OM_VERSION), OM_HASH_SEED);
    *hash = om_hash(number, sizeof number, *hash);
    *hash = om_hash(&def, sizeof def, *hash);
    *hash = om_hash(&s->net_hash, sizeof s->net_hash, *hash);
    return OM_OK;
}

OmStatus om__kidney_run_samples(Kidney* s) {
    StudyCases c = {.dir = s->def->out_dir,
                    .what = "sets of samples",
                    .n = (s->def->nsample + KIDNEY_CHUNK - 1) / KIDNEY_CHUNK,
                    .nworker = 1,
                    .size = KIDNEY_CHUNK * sizeof *s->sample,
                    .result = s->sample,
                    .ctx = s,
                    .name = name_chunk,
                    .make = run_chunk};
    return om__cases_run(&c, s->progress);
}

OmStatus om__kidney_summarise_samples(Kidney* s) {
    OmStudyKidneySummary* sum = &s->sum;
    StudyColumns c = {0};
    StudySample input;
    for (int i = 0; i < s->def->nsample; ++i) {
        const KidneySample* r = &s->sample[i];
        if (!r->is_made) continue;
        om__columns_add(&c, 3, (double[]){r->same, r->zero, r->input});
        for (int k = 0; k < 3 && s->estimate; ++k)
            om__column_add(&c, 3 + k, k == 0 ? r->dsc : k == 1 ? r->tpr : r->ave);
        sum->nstopped += r->nstopped;
    }
    sum->nsample = c.n[0];
    sum->nfailed = s->def->nsample - sum->nsample;
    OM_TRY(om__columns_end(
        &c, 6, (StudySample*[]){&sum->same, &sum->zero, &input, &sum->dsc, &sum->tpr, &sum->ave}));
    sum->input = input.median;
    return OM_OK;
}
