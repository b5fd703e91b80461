// nn_blocks.c: loops over tensors in blocks of channels, for operations that oneDNN lacks or would
// reorder data for.
//
// bfloat16 is the upper half of a float; it is widened by a shift and narrowed with rounding to nearest, ties
// to even. Each loop is written once, in float, over short rows: a float row is used in place, a bfloat16 row
// is converted in a buffer on the stack. Blocks of the parallel loops are (sample, block of channels) or
// pieces of fixed size, so results do not depend on the number of workers.
#include <string.h>

#include "base/base_multiversion.h"
#include "nn/nn_internal.h"

#define ROW 512  // values at a time

// ---- float and bfloat16 ---------------------------------------------------------------------------------

OM_MULTIVERSION static void widen(const uint16_t* from, int num, float* to) {
    for (int i = 0; i < num; ++i) {
        uint32_t bits = (uint32_t)from[i] << 16;
        memcpy(&to[i], &bits, sizeof bits);
    }
}

OM_MULTIVERSION static void narrow(const float* from, int num, uint16_t* to) {
    for (int i = 0; i < num; ++i) {
        uint32_t bits;
        memcpy(&bits, &from[i], sizeof bits);
        uint32_t rounded = (bits + 0x7fffu + ((bits >> 16) & 1u)) >> 16;
        bool is_nan = (bits & 0x7fffffffu) > 0x7f800000u;
        to[i] = (uint16_t)(is_nan ? (bits >> 16) | 0x40u : rounded);
    }
}

const float* om__blocks_read(const OmBlocks* t, int64_t at, int num, float* buffer) {
    if (t->type == OM_F32) return (const float*)t->data + at;
    widen((const uint16_t*)t->data + at, num, buffer);
    return buffer;
}

float* om__blocks_place(const OmBlocks* t, int64_t at, float* buffer) {
    return t->type == OM_F32 ? (float*)t->data + at : buffer;
}

void om__blocks_write(const OmBlocks* t, int64_t at, int num, const float* value) {
    if (t->type == OM_BF16) narrow(value, num, (uint16_t*)t->data + at);
}

// ---- plain layout to blocks and back ------------------------------------------------------------------

typedef struct PlainLoop {
    const OmBlocks* t;
    const float* from;  // plain, or null
    float* to;          // plain, or null
} PlainLoop;

// Copy one piece of `width` channels of B by cells between blocks and planes. The unused channels
// of a block become zero.
static void gather_block(const PlainLoop* p, int n, int block, int begin, int end) {
    const OmBlocks* t = p->t;
    int B = t->block, c0 = block * B, ncell = (int)om__net_cells(t->shape);
    int width = t->shape.c - c0 < B ? t->shape.c - c0 : B;
    const float* plane = p->from + ((int64_t)n * t->shape.c + c0) * ncell;
    int64_t at = n * om__blocks_stride(t) + (int64_t)block * ncell * B;
    float buffer[ROW];
    int step = ROW / B > 0 ? ROW / B : 1;
    for (int s = begin; s < end; s += step) {
        int num = end - s < step ? end - s : step;
        // blocks wider than the buffer are copied in parts
        for (int first = 0; first < B; first += ROW) {
            int part = B - first < ROW ? B - first : ROW;
            float* row = om__blocks_place(t, at + (int64_t)s * B + first, buffer);
            for (int i = 0; i < num; ++i)
                for (int c = 0; c < part; ++c)
                    row[i * B + c] =
                        first + c < width ? plane[(int64_t)(first + c) * ncell + s + i] : 0;
            om__blocks_write(t, at + (int64_t)s * B + first, num > 1 ? num * B : part, row);
        }
    }
}

static void scatter_block(const PlainLoop* p, int n, int block, int begin, int end) {
    const OmBlocks* t = p->t;
    int B = t->block, c0 = block * B, ncell = (int)om__net_cells(t->shape);
    int width = t->shape.c - c0 < B ? t->shape.c - c0 : B;
    float* plane = p->to + ((int64_t)n * t->shape.c + c0) * ncell;
    int64_t at = n * om__blocks_stride(t) + (int64_t)block * ncell * B;
    float buffer[ROW];
    int step = ROW / B > 0 ? ROW / B : 1;
    for (int s = begin; s < end; s += step) {
        int num = end - s < step ? end - s : step;
        for (int first = 0; first < width; first += ROW) {
            int part = width - first < ROW ? width - first : ROW;
            int count = num > 1 ? num * B : part;
            const float* row = om__blocks_read(t, at + (int64_t)s * B + first, count, buffer);
            for (int i = 0; i < num; ++i)
                for (int c = 0; c < part; ++c)
                    plane[(int64_t)(first + c) * ncell + s + i] = row[i * B + c];
        }
    }
}

// Loop index: cells in pieces of CELLS, for each (sample, block).
#define CELLS 2048

static int piece_count(const OmBlocks* t) {
    return om_block_count((int)om__net_cells(t->shape), CELLS);
}

static void plain_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const PlainLoop* p = ctx;
    int npiece = piece_count(p->t), nblock = om__blocks_count(p->t);
    int ncell = (int)om__net_cells(p->t->shape);
    for (int k = begin; k < end; ++k) {
        int piece = k % npiece, b = k / npiece % nblock, n = k / npiece / nblock;
        int first = piece * CELLS, last = ncell - first < CELLS ? ncell : first + CELLS;
        if (p->from)
            gather_block(p, n, b, first, last);
        else
            scatter_block(p, n, b, first, last);
    }
}

void om__blocks_from_plain(int nworker, const float* plain, const OmBlocks* t) {
    PlainLoop loop = {t, plain, NULL};
    int count = t->n * om__blocks_count(t) * piece_count(t);
    om_parallel_for(nworker, count, 4, plain_range, &loop);
}

void om__blocks_to_plain(int nworker, const OmBlocks* t, float* plain) {
    PlainLoop loop = {t, NULL, plain};
    int count = t->n * om__blocks_count(t) * piece_count(t);
    om_parallel_for(nworker, count, 4, plain_range, &loop);
}

// ---- sums -------------------------------------------------------------------------------------------------

typedef struct PairLoop {
    const OmBlocks *x, *y;
    const float* mask;
} PairLoop;

#define PIECE 16384  // values per block of the loop

OM_MULTIVERSION static void add_row(const float* x, int num, const float* old, float* sum) {
    for (int i = 0; i < num; ++i) sum[i] = old[i] + x[i];
}

static void add_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const PairLoop* p = ctx;
    int64_t size = p->x->n * om__blocks_stride(p->x);
    int64_t last = (int64_t)end * PIECE < size ? (int64_t)end * PIECE : size;
    float bx[ROW], by[ROW];
    for (int64_t at = (int64_t)begin * PIECE; at < last; at += ROW) {
        int num = last - at < ROW ? (int)(last - at) : ROW;
        const float* x = om__blocks_read(p->x, at, num, bx);
        const float* old = om__blocks_read(p->y, at, num, by);
        float* sum = om__blocks_place(p->y, at, by);
        add_row(x, num, old, sum);
        om__blocks_write(p->y, at, num, sum);
    }
}

static int count_of_pieces(const OmBlocks* t) {
    return (int)((t->n * om__blocks_stride(t) + PIECE - 1) / PIECE);
}

void om__blocks_add(int nworker, const OmBlocks* x, const OmBlocks* sum) {
    PairLoop loop = {x, sum, NULL};
    om_parallel_for(nworker, count_of_pieces(x), 1, add_range, &loop);
}

// ---- masks --------------------------------------------------------------------------------------------

// Index: (sample, block of channels).
OM_MULTIVERSION static void mask_block(const PairLoop* p, int index) {
    int B = p->x->block, ncell = (int)om__net_cells(p->x->shape);
    int64_t at = (int64_t)index * ncell * B;
    float bx[ROW], by[ROW];
    for (int s = 0; s < ncell; ++s)
        for (int first = 0; first < B; first += ROW) {
            int num = B - first < ROW ? B - first : ROW;
            int64_t here = at + (int64_t)s * B + first;
            const float* x = om__blocks_read(p->x, here, num, bx);
            float* y = om__blocks_place(p->y, here, by);
            for (int c = 0; c < num; ++c) y[c] = p->mask[s] * x[c];
            om__blocks_write(p->y, here, num, y);
        }
}

static void mask_range(void* ctx, int begin, int end, int block) {
    (void)block;
    for (int k = begin; k < end; ++k) mask_block(ctx, k);
}

void om__blocks_mask(int nworker, const OmBlocks* x, const float* mask, const OmBlocks* y) {
    PairLoop loop = {x, y, mask};
    om_parallel_for(nworker, x->n * om__blocks_count(x), 1, mask_range, &loop);
}

// ---- channels -------------------------------------------------------------------------------------------

typedef struct CopyLoop {
    const OmBlocks *from, *to;
    int from_c, to_c, num;
    int chunk;  // channels per block of the loop
} CopyLoop;

static int64_t channel_at(const OmBlocks* t, int n, int c) {
    return n * om__blocks_stride(t) + (int64_t)(c / t->block) * om__net_cells(t->shape) * t->block +
           c % t->block;
}

// Copy `width` neighbouring channels of sample n, which are adjacent in both tensors, cell by cell.
static void copy_lanes(const CopyLoop* p, int n, int offset, int width) {
    size_t size = om__type_size(p->from->type);
    int64_t from = channel_at(p->from, n, p->from_c + offset);
    int64_t to = channel_at(p->to, n, p->to_c + offset);
    int ncell = (int)om__net_cells(p->from->shape);
    const char* x = (const char*)p->from->data + (size_t)from * size;
    char* y = (char*)p->to->data + (size_t)to * size;
    if (p->from->block == width && p->to->block == width) {  // whole blocks are contiguous
        memcpy(y, x, (size_t)ncell * (size_t)width * size);
        return;
    }
    size_t step_x = (size_t)p->from->block * size, step_y = (size_t)p->to->block * size;
    for (int s = 0; s < ncell; ++s) memcpy(y + s * step_y, x + s * step_x, (size_t)width * size);
}

// Clear the unused channels of the last block of `to`, after the last channel was copied into it.
static void clear_filling(const CopyLoop* p, int n) {
    const OmBlocks* t = p->to;
    int width = om__blocks_count(t) * t->block - t->shape.c;
    if (width == 0 || p->to_c + p->num < t->shape.c) return;
    size_t size = om__type_size(t->type);
    char* y = (char*)t->data + (size_t)channel_at(t, n, t->shape.c) * size;
    int64_t ncell = om__net_cells(t->shape);
    for (int64_t s = 0; s < ncell; ++s)
        memset(y + (size_t)s * (size_t)t->block * size, 0, (size_t)width * size);
}

// Index: (sample, chunk of channels), in runs that stay within a block of both.
static void copy_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const CopyLoop* p = ctx;
    int nchunk = om_block_count(p->num, p->chunk);
    for (int k = begin; k < end; ++k) {
        int n = k / nchunk, c = k % nchunk * p->chunk;
        int last = p->num - c < p->chunk ? p->num : c + p->chunk;
        while (c < last) {
            int x = p->from->block - (p->from_c + c) % p->from->block;
            int y = p->to->block - (p->to_c + c) % p->to->block;
            int width = x < y ? x : y;
            width = width < last - c ? width : last - c;
            copy_lanes(p, n, c, width);
            c += width;
        }
        if (last == p->num) clear_filling(p, n);
    }
}

void om__blocks_copy_channels(int nworker, const OmBlocks* from, int from_c, const OmBlocks* to,
                              int to_c, int num) {
    bool is_wide = from->block > 16 || to->block > 16;
    CopyLoop loop = {from, to, from_c, to_c, num, is_wide ? num : 16};
    om_parallel_for(nworker, from->n * om_block_count(num, loop.chunk), 1, copy_range, &loop);
}

// ---- windows ------------------------------------------------------------------------------------------

typedef struct UnfoldLoop {
    const OmBlocks *from, *to;
    const int* kernel;
} UnfoldLoop;

// One row of cells of one block: the windows of a row of `from`, cell by cell along their width.
static void unfold_row(const UnfoldLoop* p, int n, int block, int d, int h) {
    const OmBlocks *x = p->from, *y = p->to;
    const int* K = p->kernel;
    size_t size = om__type_size(y->type), width = (size_t)y->block * size;
    int kd = d % K[0], kh = h % K[1], c0 = block * y->block;
    size_t step_x = (size_t)x->block * size, step_y = (size_t)K[2] * width;
    OmNetShape sx = x->shape, sy = y->shape;
    int64_t row_x = ((int64_t)(d / K[0]) * sx.h + h / K[1]) * sx.w,
            row_y = ((int64_t)d * sy.h + h) * sy.w;
    for (int kw = 0; kw < K[2]; ++kw) {
        int channel = ((kd * K[1] + kh) * K[2] + kw) * sy.c + c0;
        const char* from = (const char*)x->data;
        from += (size_t)(channel_at(x, n, channel) + row_x * x->block) * size;
        char* to = (char*)y->data;
        to += (size_t)(channel_at(y, n, c0) + (row_y + kw) * y->block) * size;
        for (int w = 0; w < sx.w; ++w, from += step_x, to += step_y) {
            if (width == 64)  // sixteen floats
                memcpy(to, from, 64);
            else if (width == 32)  // sixteen bfloat16
                memcpy(to, from, 32);
            else
                memcpy(to, from, width);
        }
    }
}

// Index: (sample, block of channels, slice of depth).
static void unfold_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const UnfoldLoop* p = ctx;
    int depth = p->to->shape.d, nblock = om__blocks_count(p->to);
    for (int k = begin; k < end; ++k)
        for (int h = 0; h < p->to->shape.h; ++h)
            unfold_row(p, k / depth / nblock, k / depth % nblock, k % depth, h);
}

void om__blocks_unfold(int nworker, const OmBlocks* from, const int kernel[3], const OmBlocks* to) {
    UnfoldLoop loop = {from, to, kernel};
    om_parallel_for(nworker, to->n * om__blocks_count(to) * to->shape.d, 4, unfold_range, &loop);
}

// ---- dropout ------------------------------------------------------------------------------------------

typedef struct DropLoop {
    const OmBlocks *x, *y;
    uint64_t seed;
    int64_t first;
    uint32_t threshold;  // a random word below it drops the value
    float scale;
} DropLoop;

// Index: (sample, channel); each has a stream of random words over the cells.
static void drop_range(void* ctx, int begin, int end, int block) {
    (void)block;
    const DropLoop* p = ctx;
    int ncell = (int)om__net_cells(p->x->shape), channels = p->x->shape.c;
    for (int k = begin; k < end; ++k) {
        int n = k / channels, c = k % channels;
        int64_t at = channel_at(p->x, n, c);
        OmRng rng = om_rng_init(p->seed, (uint64_t)((p->first + n) * channels + c));
        for (int s = 0; s < ncell; ++s, at += p->x->block) {
            float bx[1], by[1];
            const float* x = om__blocks_read(p->x, at, 1, bx);
            float* y = om__blocks_place(p->y, at, by);
            *y = om_rng_u32(&rng) < p->threshold ? 0 : p->scale * *x;
            om__blocks_write(p->y, at, 1, y);
        }
    }
}

void om__blocks_dropout(int nworker, const OmBlocks* x, float rate, uint64_t seed, int64_t first,
                        const OmBlocks* y) {
    DropLoop loop = {x, y, seed, first, (uint32_t)((double)rate * 4294967296.0), 1 / (1 - rate)};
    int filled = om__blocks_count(y) * y->block;
    if (filled != y->shape.c) memset(y->data, 0, om__blocks_bytes(y));
    om_parallel_for(nworker, x->n * x->shape.c, 16, drop_range, &loop);
}
