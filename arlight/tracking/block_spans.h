/* Which rows a block has in a picture, and which of their pixels are used. */
#ifndef ARLIGHT_BLOCK_SPANS_H
#define ARLIGHT_BLOCK_SPANS_H

#include "blocks.h"

/* Pixels, or cells of pixels that share their chroma. */
typedef struct {
    float step_x, step_y;   /* size [px] */
    float first_x, first_y; /* middle of the first [px] */
    int width, height;      /* whole cells */
} Grid;

/* The cells of one block. left, count: first and number of each row's. */
typedef struct {
    int first_row, rows;
    int32_t *left, *count;
    int total;       /* cells in the list */
    int chosen;      /* of the rows' steps stand in `steps`, by number; -1 for all */
    int32_t *steps;
} Span;

INLINE int whole_steps(int count)
{
    return (count + STEP - 1) & -STEP;
}

static Grid grid_of(const Blocks *b, int shared)
{
    int sx = shared ? (int)b->shift_x : 0, sy = shared ? (int)b->shift_y : 0;
    return (Grid){(float)(1 << sx), (float)(1 << sy), 0.5f * (float)((1 << sx) - 1), 0.5f * (float)((1 << sy) - 1),
                  (int)(b->width >> sx), (int)(b->height >> sy)};
}

/* Where a line of constant y through rows from `top` on, `step` apart, is inside the edges: limits low, high. */
static HOT void cut_rows(const float *edges, int64_t n, int rows, float top, float step, float *restrict low,
                         float *restrict high)
{
    for (int r = 0; r < rows; r++) {
        low[r] = -1e9f;
        high[r] = 1e9f;
    }
    for (int e = 0; e < EDGES; e++, edges += 3 * n) {
        float over = 1.0f / edges[0], along = edges[n], limit = edges[2 * n] - along * top, fall = along * step;
        if (over >= 0.0f)
            for (int r = 0; r < rows; r++) {
                float x = (limit - fall * (float)r) * over;
                high[r] = x < high[r] ? x : high[r];
            }
        else
            for (int r = 0; r < rows; r++) {
                float x = (limit - fall * (float)r) * over;
                low[r] = x > low[r] ? x : low[r];
            }
    }
}

/* Whole columns between limits from the box's middle; returns their number. */
static HOT int round_rows(int rows, float middle, float step, int width, const float *restrict low,
                          const float *restrict high, int32_t *restrict left, int32_t *restrict count)
{
    int total = 0;
    float over = 1.0f / step, most = (float)(width - 1);
    for (int r = 0; r < rows; r++) {
        float from = (low[r] + middle) * over, to = (high[r] + middle) * over;
        from = from > 0.0f ? from : 0.0f;
        from = from < most + 2.0f ? from : most + 2.0f;
        to = to > -1.0f ? to : -1.0f;
        to = to < most ? to : most;
        /* the smallest whole number that is not below, and the largest that is not above */
        int first = (int)from, last = (int)(to + 1.0f) - 1;
        first += (float)first < from;
        int some = last - first + 1;
        left[r] = first;
        count[r] = some > 0 ? some : 0;
        total += count[r];
    }
    return total;
}

/* The rows of a block's usable part. */
static Span span_of(const Blocks *b, int block, const Grid *grid)
{
    int64_t n = b->blocks;
    const float *box = b->box + block;
    float middle = box[n] - grid->first_y, half = box[3 * n];
    int first = (int)ceilf((middle - half) / grid->step_y), last = (int)floorf((middle + half) / grid->step_y);
    first = first > 0 ? first : 0;
    last = last < grid->height - 1 ? last : grid->height - 1;
    Span span = {first, last - first + 1, b->spans, b->spans + b->height, 0, -1, b->steps};
    if (span.rows <= 0) {
        span.rows = 0;
        return span;
    }
    float *low = b->rows, *high = b->rows + b->height;
    cut_rows(b->edges + block, n, span.rows, (float)first * grid->step_y - middle, grid->step_y, low, high);
    span.total = round_rows(span.rows, box[0] - grid->first_x, grid->step_x, grid->width, low, high, span.left,
                            span.count);
    return span;
}

/* A number from 0 to 1 that is always the same for the same place. */
INLINE float chance(uint32_t place)
{
    place = (place ^ (place >> 16)) * 2146121005u;
    place = (place ^ (place >> 15)) * 2221713035u;
    return (float)(place >> 8) * 5.9604645e-8f;
}

/* Keeps at most `limit` cells: a few neighbours at random of every so many, in reading order, because evenly spaced
 * ones would alias the stripes. */
static HOT void thin_out(Span *span, int limit)
{
    int all = 0;
    for (int r = 0; r < span->rows; r++)
        all += whole_steps(span->count[r]) / STEP;
    /* what is chosen may hold more cells than the average: the last ones are then cut */
    int chosen = (int)((double)(limit - STEP / 2) / span->total * all);
    float every = chosen > 0 ? (float)all / (float)chosen : 0.0f;
    for (int i = 0; i < chosen; i++) {
        int from = (int)((float)i * every), to = (int)((float)(i + 1) * every);
        span->steps[i] = from + (int)(chance((uint32_t)i) * (float)(to - from));
    }
    span->chosen = chosen > 0 ? chosen : 0;
    span->total = limit;
}

#endif
