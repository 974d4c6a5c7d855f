/* Lists of a block's pixels: which rows it has, which of their pixels are used, what the planes hold there. */
#ifndef ARLIGHT_BLOCK_POINTS_H
#define ARLIGHT_BLOCK_POINTS_H

#include "blocks.h"

/* Pixels, or cells of pixels that share their chroma. */
typedef struct {
    float step_x, step_y;   /* size [px] */
    float first_x, first_y; /* middle of the first [px] */
    int width, height;      /* whole cells */
} Grid;

/* The cells of one block. left, count: first and number of each row's; start: of the row in the list. */
typedef struct {
    int first_row, rows;
    int32_t *left, *count;
    int total;    /* cells in the list */
    int sparse;   /* columns of the list's cells stand in `columns`, otherwise they are all of a row's */
} Span;

/* Lists of pixels. */
enum { PHASE_LIST, X_LIST, Y_LIST, CODE_LIST, LISTS = CODE_LIST + CHANNELS };

static inline float *list_of(const Blocks *b, int which)
{
    return b->lists + which * b->room;
}

static inline int whole_steps(int count)
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
    Span span = {first, last - first + 1, b->spans, b->spans + b->height, 0, 0};
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

/* Keeps at most `limit` cells: in each row one at random of every so many, because evenly spaced ones would alias the
 * stripes. The same cells of a picture are always chosen. */
static HOT void thin_out(const Blocks *b, Span *span, int limit)
{
    int32_t *restrict columns = b->places;
    double share = (double)limit / span->total, before = 0.0;
    int at = 0;
    for (int r = 0; r < span->rows; r++) {
        int all = span->count[r], whole = (int)before;
        before += share * all;
        int kept = (int)before - whole;
        float width = kept ? (float)all / (float)kept : 0.0f;
        uint32_t row = (uint32_t)(span->first_row + r) * 73856093u;
        for (int i = 0; i < kept; i++) {
            int from = (int)((float)i * width), to = (int)((float)(i + 1) * width);
            uint32_t chance = (row ^ (uint32_t)(span->left[r] + i) * 19349663u) * 2654435761u;
            int pick = from + (int)((float)(chance >> 8) * 5.9604645e-8f * (float)(to - from));
            columns[at + i] = span->left[r] + (pick < all ? pick : all - 1);
        }
        span->count[r] = kept;
        at += kept;
    }
    span->total = at;
    span->sparse = 1;
}

/* Coefficients of the surfaces' cubics in each row. */
static HOT void expand_rows(const Blocks *b, int block, const Grid *grid, const Span *span)
{
    int64_t n = b->blocks;
    float scale = 1.0f / b->box[3 * n + block];
    float top = ((float)span->first_row * grid->step_y + grid->first_y - b->box[n + block]) * scale;
    float down = grid->step_y * scale;
    for (int k = 0; k < SURFACES * CUBIC; k++) {
        const float *of = b->surfaces + k * CUBIC * n + block;
        float c0 = of[0], c1 = of[n], c2 = of[2 * n], c3 = of[3 * n], *out = b->rows + k * b->height;
        for (int r = 0; r < span->rows; r++) {
            float v = top + down * (float)r;
            out[r] = c0 + v * (c1 + v * (c2 + v * c3));
        }
    }
}

/* Fills the lists of phase, x and y. */
static HOT void list_points(const Blocks *b, int block, const Grid *grid, const Span *span)
{
    expand_rows(b, block, grid, span);
    float scale = 1.0f / b->box[2 * b->blocks + block], across = grid->step_x * scale;
    float left = (grid->first_x - b->box[block]) * scale;
    float *phase = list_of(b, PHASE_LIST), *x = list_of(b, X_LIST), *y = list_of(b, Y_LIST);
    const int32_t *columns = b->places;
    for (int r = 0; r < span->rows; r++) {
        const float *terms = b->rows + r;
        float k[SURFACES * CUBIC];
        for (int i = 0; i < SURFACES * CUBIC; i++)
            k[i] = terms[i * b->height];
        int count = (span->count[r] + STEP - 1) & -STEP;
        float start = left + across * (float)span->left[r];
        for (int i = 0; i < count; i++) {
            float u = span->sparse ? left + across * (float)columns[i] : start + across * (float)i;
            phase[i] = k[0] + u * (k[1] + u * (k[2] + u * k[3]));
            x[i] = k[4] + u * (k[5] + u * (k[6] + u * k[7]));
            y[i] = k[8] + u * (k[9] + u * (k[10] + u * k[11]));
        }
        phase += span->count[r], x += span->count[r], y += span->count[r], columns += span->count[r];
    }
}

static inline void read_codes(const Blocks *b, int plane, int bytes, const Span *span, float *restrict out)
{
    float offset = (float)b->offset[plane], scale = (float)b->scale[plane];
    int64_t wide = plane ? (b->width + (1 << b->shift_x) - 1) >> b->shift_x : b->width;
    int64_t high = plane ? (b->height + (1 << b->shift_y) - 1) >> b->shift_y : b->height;
    const char *end = b->planes[plane] + (high - 1) * b->stride[plane] + wide * bytes;
    const int32_t *columns = b->places;
    for (int r = 0; r < span->rows; r++) {
        const char *row = b->planes[plane] + (span->first_row + r) * b->stride[plane];
        const char *from = row + (int64_t)span->left[r] * bytes;
        int count = span->count[r];
        if (span->sparse) {
            for (int i = 0; i < count; i++)
                out[i] = ((float)(bytes == 1 ? ((const uint8_t *)row)[columns[i]] : ((const uint16_t *)row)[columns[i]]) -
                          offset) * scale;
            columns += count;
        } else {
            /* whole steps; what is too much is written over by the next row */
            int some = count && from + whole_steps(count) * bytes <= end ? whole_steps(count) : count;
            for (int i = 0; i < some; i++)
                out[i] = ((float)(bytes == 1 ? ((const uint8_t *)from)[i] : ((const uint16_t *)from)[i]) - offset) * scale;
        }
        out += count;
    }
}

/* Fills a list with a plane's values at the cells; the plane has the grid's resolution. */
static HOT void list_codes(const Blocks *b, int plane, const Span *span, float *out)
{
    if (b->bytes == 1)
        read_codes(b, plane, 1, span, out);
    else
        read_codes(b, plane, 2, span, out);
}

static inline void read_luma(const Blocks *b, int bytes, const Span *span, float *restrict out)
{
    int across = 1 << b->shift_x, down = 1 << b->shift_y;
    float offset = (float)b->offset[0], scale = (float)b->scale[0] / (float)(across * down);
    const int32_t *columns = b->places;
    for (int r = 0; r < span->rows; r++) {
        int count = span->count[r];
        for (int i = 0; i < count; i++)
            out[i] = -offset * (float)(across * down);
        for (int j = 0; j < down; j++) {
            const char *row = b->planes[0] + (((int64_t)(span->first_row + r) << b->shift_y) + j) * b->stride[0];
            for (int k = 0; k < across; k++)
                for (int i = 0; i < count; i++) {
                    int column = (span->sparse ? columns[i] : span->left[r] + i) * across + k;
                    out[i] += (float)(bytes == 1 ? ((const uint8_t *)row)[column] : ((const uint16_t *)row)[column]);
                }
        }
        for (int i = 0; i < count; i++)
            out[i] *= scale;
        out += count, columns += count;
    }
}

/* Fills a list with the mean luma of cells. */
static HOT void list_mean_luma(const Blocks *b, const Span *span, float *out)
{
    if (b->bytes == 1)
        read_luma(b, 1, span, out);
    else
        read_luma(b, 2, span, out);
}

/* Clears what stands behind the list up to a whole step. */
static inline void clear_rest(float *list, int total)
{
    for (int i = total; i < whole_steps(total); i++)
        list[i] = 0.0f;
}

/* cos and sin of the phase [cycles], to 1e-5, in place of phase and in `sine`. */
static inline void turn(float cycles, float *cosine, float *sine)
{
    float t = cycles - __builtin_rintf(cycles), square = t * t;
    float twice = t * (6.28316404f + square * (-10.33428559f + square * (5.08379806f - 1.10927239f * square)));
    float half = 0.9999933f + square * (-4.93393801f + square * (4.04128377f - 1.22212693f * square));
    *cosine = 1.0f - 0.5f * twice * twice;
    *sine = twice * half;
}

#endif
