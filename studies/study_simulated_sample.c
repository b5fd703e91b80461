// study_simulated_sample.c: samples of quadratic elements as files, guesses, scores and simulations of one sample.
//
// All (thesis: "all the points belonging to the lowest surface"): our bodies lie in any direction. The lowest surface
// is the side of the thin axis (z of the grid of voxels) away from the pull: vertices whose normal is within 60 degrees
// of it. The robot knows both, and neither tells where the attachments are.
//
// A sample on a board is simulated from the shape that a scan shows, without weight and board, as the thesis does: a
// surgeon knows neither.
#include <math.h>
#include <string.h>

#include "omentum/shape_meshing.h"
#include "studies/study_match_case.h"
#include "studies/study_simulated_internal.h"

#define FACES_DOWN 0.5  // cosine

// ---- files --------------------------------------------------------------------------------------------

typedef struct Head {
    bool has_node;
    OmBanetSample sample;  // counts and facts; its pointers mean nothing
} Head;

enum { NBLOCK = 13 };

typedef struct Block {
    void** data;
    size_t size;
} Block;

// Of linear elements there are no nodes.
static void list_blocks(OmBanetSample* s, bool has_node, Block block[NBLOCK]) {
    size_t n = (size_t)s->mesh.nvert, k = (size_t)s->surface.nvert, d = sizeof(double);
    size_t tet = (size_t)s->mesh.ntet, tri = (size_t)s->surface.ntri, i = sizeof(int);
    const Block list[NBLOCK] = {{(void**)&s->mesh.x, 3 * n * d},
                                {(void**)&s->mesh.tet_vert, 4 * tet * i},
                                {(void**)&s->mesh.tet_label, tet * i},
                                {(void**)&s->node, has_node ? 10 * (tet / 8) * i : 0},
                                {(void**)&s->surface.x, 3 * k * d},
                                {(void**)&s->surface.tri_vert, 3 * tri * i},
                                {(void**)&s->surface_vert, k * i},
                                {(void**)&s->attached, k},
                                {(void**)&s->grasped, k},
                                {(void**)&s->rest, 3 * n * d},
                                {(void**)&s->x, 3 * n * d},
                                {(void**)&s->u, 3 * k * d},
                                {(void**)&s->seen, k * d}};
    memcpy(block, list, sizeof list);
}

OmStatus om__sim_sample_save(const char* dir, const char* name, uint64_t setup,
                             const OmBanetSample* sample) {
    Head head;
    OmBanetSample view = *sample;
    Block block[NBLOCK];
    StudyPart part[1 + NBLOCK] = {{&head, sizeof head}};
    memset(&head, 0, sizeof head);  // what is between the fields is in the file, too
    head.has_node = sample->node != NULL;
    head.sample = *sample;
    list_blocks(&head.sample, head.has_node, block);
    for (int b = 0; b < NBLOCK; ++b) *block[b].data = NULL;
    head.sample.mesh.nset = 0;
    head.sample.mesh.set = NULL;
    list_blocks(&view, head.has_node, block);
    for (int b = 0; b < NBLOCK; ++b) part[1 + b] = (StudyPart){*block[b].data, block[b].size};
    return om__study_save_parts(dir, name, setup, part, 1 + NBLOCK);
}

bool om__sim_sample_load(const char* dir, const char* name, uint64_t setup, OmBanetSample* sample) {
    size_t size, at = sizeof(Head);
    Head head;
    Block block[NBLOCK];
    memset(sample, 0, sizeof *sample);
    char* data = om__study_load_block(dir, name, setup, &size);
    bool is_good = data && size >= at;
    if (is_good) {
        memcpy(&head, data, sizeof head);
        *sample = head.sample;
        list_blocks(sample, head.has_node, block);
    }
    for (int b = 0; b < NBLOCK && is_good; at += block[b++].size) {
        is_good = size - at >= block[b].size;
        if (!is_good || block[b].size == 0) continue;
        *block[b].data = om_alloc(block[b].size, 1);
        is_good = *block[b].data != NULL;
        if (is_good) memcpy(*block[b].data, data + at, block[b].size);
    }
    om_free(data);
    if (!is_good) om_banet_sample_done(sample);
    return is_good;
}

// ---- one body -------------------------------------------------------------------------------------------

OmStatus om__sim_body_make(const OmBanetSample* s, double side, SimBody* b) {
    size_t n = (size_t)s->mesh.nvert, k = (size_t)s->surface.nvert;
    b->sample = s;
    b->side = side;
    OM_TRY(om_banet_grid_fit(&s->surface, side, &b->grid));
    OM_ALLOC(b->cell, k);
    OM_ALLOC(b->area, k);
    OM_ALLOC(b->guess, k);
    OM_ALLOC(b->attached, n);
    OM_ALLOC(b->x, 3 * n);
    OM_ALLOC(b->grasp, k);
    OM_ALLOC(b->goal, 3 * k);
    om_banet_find_cells(&b->grid, &s->surface, b->cell);
    om__attach_areas(&s->surface, b->area);
    for (int i = 0; i < s->surface.nvert; ++i) {
        if (!s->grasped[i]) continue;
        int v = s->surface_vert[i];
        om_store3(b->goal, b->ngrasp, om_load3(s->x, v));
        b->grasp[b->ngrasp++] = v;
    }
    return OM_OK;
}

void om__sim_body_done(SimBody* b) {
    om__attach_model_destroy(b->model);
    om_free(b->cell);
    om_free(b->area);
    om_free(b->guess);
    om_free(b->attached);
    om_free(b->x);
    om_free(b->grasp);
    om_free(b->goal);
    memset(b, 0, sizeof *b);
}

static OmStatus find_lowest(SimBody* b) {
    const OmBanetSample* s = b->sample;
    double* normal = om_alloc(3 * (size_t)s->surface.nvert, sizeof *normal);
    if (!normal) return OM_NO_MEMORY;
    om_surface_normals(&s->surface, normal);
    OmVec3 pull = om_vec3(0, 0, 0),
           up = om_quat_rotate(b->grid.pose_world_grid.q, om_vec3(0, 0, 1));
    for (int i = 0; i < b->ngrasp; ++i)
        pull = om_add(pull, om_sub(om_load3(b->goal, i), om_load3(s->mesh.x, b->grasp[i])));
    if (om_dot(pull, up) < 0) up = om_scale(-1, up);
    for (int i = 0; i < s->surface.nvert; ++i)
        b->guess[i] = om_dot(om_load3(normal, i), up) < -FACES_DOWN;
    om_free(normal);
    return OM_OK;
}

OmStatus om__sim_body_guess(SimBody* b, OmStudySimulatedGuess guess) {
    size_t n = (size_t)b->sample->surface.nvert;
    if (guess == OM_STUDY_SIM_ALL) return find_lowest(b);
    if (guess == OM_STUDY_SIM_SAME)
        memcpy(b->guess, b->sample->attached, n);
    else
        memset(b->guess, 0, n);
    return OM_OK;
}

OmStatus om__sim_body_score(const SimBody* b, SimScore* score) {
    const OmBanetSample* s = b->sample;
    om__attach_score(s->surface.nvert, b->area, b->guess, s->attached, &score->dsc_area,
                     &score->tpr_area);
    return om__attach_score_cells(s->surface.nvert, b->cell, b->guess, s->attached, &score->dsc,
                                  &score->tpr);
}

OmStatus om__sim_body_move(SimBody* b, SimMove* move) {
    const OmBanetSample* s = b->sample;
    AttachSolve solve;
    if (!b->model) {
        AttachModelDef def = om__attach_model_default_def(&s->mesh, s->material);
        def.node = s->node;
        OM_TRY(om__attach_model_create(&def, &b->model));
    }
    memset(b->attached, 0, (size_t)s->mesh.nvert);
    for (int i = 0; i < s->surface.nvert; ++i) b->attached[s->surface_vert[i]] = b->guess[i];
    AttachMove how = {b->ngrasp, b->grasp, b->goal, b->attached};
    OM_TRY(om__attach_model_solve(b->model, &how, b->x, &solve));
    om__attach_error(s->mesh.nvert, b->x, s->x, &move->ave, &move->mve);
    move->is_there = 1;
    move->is_stopped = !solve.is_converged;
    move->load = solve.load;
    move->ms = solve.ms;
    return OM_OK;
}

OmStatus om__sim_body_cells(const SimBody* b, const double* probability, SimNet* net) {
    const OmBanetSample* s = b->sample;
    int count = b->grid.dim[0] * b->grid.dim[1] * b->grid.dim[2];  // below 2^24
    int* first = om_alloc((size_t)count, sizeof *first);  // a vertex of each cell, -1: none
    OmStatus status = OM_OK;
    if (!first) return OM_NO_MEMORY;
    for (int c = 0; c < count; ++c) first[c] = -1;
    for (int i = 0; i < s->surface.nvert; ++i)
        if (b->cell[i] >= 0) first[b->cell[i]] = i;
    net->ncell = 0;
    for (int c = 0; c < count; ++c) {
        if (first[c] < 0) continue;
        OM_CHECK_DONE(net->ncell < SIM_MAX_CELL, OM_INVALID, "more than %d cells with a vertex",
                      SIM_MAX_CELL);
        net->probability[net->ncell] = (float)probability[first[c]];
        first[c] = net->ncell++;
    }
    memset(net->is_true, 0, (size_t)net->ncell);
    for (int i = 0; i < s->surface.nvert; ++i)
        if (b->cell[i] >= 0 && s->attached[i]) net->is_true[first[b->cell[i]]] = 1;
done:
    om_free(first);
    return status;
}
