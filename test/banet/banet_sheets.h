// banet_sheets.h: a data set whose attachments are seen by rule, for trainings of seconds.
#ifndef OMENTUM_TEST_BANET_SHEETS_H
#define OMENTUM_TEST_BANET_SHEETS_H

#include <math.h>

#include "omentum/banet_data.h"
#include "test_common.h"

enum { WIDE = 16, HIGH = 2, BORDER = 6, NSHEET = 48 };

// A sheet of two layers of cells on a grid of 32 x 32 x 16. A disc of the lower layer is attached; displacement grows
// with the distance from it, and a strip is not seen.
static inline void make_sheet(int index, OmBanetCells* cells) {
    OmRng rng = om_rng_init(77, (uint64_t)index);
    const double x = om_rng_range(&rng, 2, WIDE - 2), y = om_rng_range(&rng, 2, WIDE - 2);
    const double radius = om_rng_range(&rng, 3, 6), pull = om_rng_range(&rng, 0.2, 0.5);
    const int hidden = (int)om_rng_below(&rng, WIDE);
    const int num = WIDE * WIDE * HIGH;
    *cells = (OmBanetCells){.grid = {om_pose_identity(), 0.005, {32, 32, 16}}, .ncell = num};
    cells->fact.index = index;
    cells->cell = om_alloc((size_t)num, sizeof *cells->cell);
    cells->value = om_calloc(OM_BANET_NCHANNEL * (size_t)num, sizeof *cells->value);
    cells->kind = om_calloc((size_t)num, 1);
    for (int i = 0; i < num; ++i) {
        const int at[3] = {i % WIDE, i / WIDE % WIDE, i / WIDE / WIDE};
        double d = sqrt((at[0] - x) * (at[0] - x) + (at[1] - y) * (at[1] - y));
        bool is_seen = at[0] != hidden && at[2] == 1;
        cells->cell[i] =
            (int)om_grid_index(cells->grid.dim, at[0] + BORDER, at[1] + BORDER, at[2] + 7);
        cells->kind[i] = OM_BANET_NEAR | OM_BANET_SURFACE;
        if (at[2] == 0 && d < radius) cells->kind[i] |= OM_BANET_ATTACHED;
        cells->value[i] = -OM_BANET_UNIT / 2;
        cells->value[OM_BANET_SEEN * num + i] = is_seen ? OM_BANET_UNIT : 0;
        double u = is_seen ? pull * fmax(0, d - radius) : 0;
        cells->value[OM_BANET_UX * num + i] = (int16_t)lround(0.3 * u * OM_BANET_UNIT);
        cells->value[OM_BANET_UZ * num + i] = (int16_t)lround(u * OM_BANET_UNIT);
    }
}

static inline OmBanetData make_data(void) {
    OmBanetData data = {.nsample = NSHEET,
                        .seed = 77,
                        .hash = 77,
                        .side = 0.32,
                        .generator = "omentum banet 3",
                        .way = "exact",
                        .element = "linear"};
    data.sample = om_calloc(NSHEET, sizeof *data.sample);
    for (int s = 0; s < NSHEET; ++s) make_sheet(s, &data.sample[s]);
    // A sheet that is larger than the grid of small_def.
    data.sample[3].cell[0] = 0;
    return data;
}

#endif
