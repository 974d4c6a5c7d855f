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

INLINE float *list_of(const Blocks *b, int which)
{
    return b->lists + which * b->room;
}

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

/* A row's phase, x and y; k: its cubics; u: of its first cell, or of column 0 where columns are given. */
INLINE void place_row(const float k[SURFACES * CUBIC], float u, float across, const int32_t *restrict columns,
                             int count, float *restrict phase, float *restrict x, float *restrict y)
{
    int steps = (count + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        float at = u + across * (columns ? (float)columns[i] : (float)i);
        phase[i] = k[0] + at * (k[1] + at * (k[2] + at * k[3]));
        x[i] = k[4] + at * (k[5] + at * (k[6] + at * k[7]));
        y[i] = k[8] + at * (k[9] + at * (k[10] + at * k[11]));
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
        float k[SURFACES * CUBIC];
        for (int i = 0; i < SURFACES * CUBIC; i++)
            k[i] = b->rows[i * b->height + r];
        int count = span->count[r];
        if (span->sparse)
            place_row(k, left, across, columns, count, phase, x, y);
        else
            place_row(k, left + across * (float)span->left[r], across, NULL, count, phase, x, y);
        phase += count, x += count, y += count, columns += count;
    }
}

INLINE float code_at(const char *row, int bytes, int64_t column)
{
    return bytes == 1 ? (float)((const uint8_t *)row)[column] : (float)((const uint16_t *)row)[column];
}

/* A row's values of a plane. end: of the plane; what lies before it is read in whole steps, and written over by the
 * next row where it is too much. */
INLINE void read_row(const char *row, int bytes, int left, const int32_t *restrict columns, int count,
                            const char *end, float offset, float scale, float *restrict out)
{
    const char *from = row + (int64_t)left * bytes;
    if (columns)
        for (int i = 0; i < count; i++)
            out[i] = scale * code_at(row, bytes, columns[i]) - offset;
    else if (from + (int64_t)whole_steps(count) * bytes <= end) {
        int steps = (count + STEP - 1) & -STEP;
        for (int i = 0; i < steps; i++)
            out[i] = scale * code_at(from, bytes, i) - offset;
    } else
        for (int i = 0; i < count; i++)
            out[i] = scale * code_at(from, bytes, i) - offset;
}

INLINE void read_plane(const Blocks *b, int plane, int bytes, const Span *span, float *out)
{
    float scale = (float)b->scale[plane], offset = (float)(b->offset[plane] * b->scale[plane]);
    int64_t wide = plane ? (b->width + (1 << b->shift_x) - 1) >> b->shift_x : b->width;
    int64_t high = plane ? (b->height + (1 << b->shift_y) - 1) >> b->shift_y : b->height;
    const char *end = b->planes[plane] + (high - 1) * b->stride[plane] + wide * bytes;
    const char *row = b->planes[plane] + span->first_row * b->stride[plane];
    const int32_t *columns = b->places;
    for (int r = 0; r < span->rows; r++, row += b->stride[plane]) {
        int count = span->count[r];
        read_row(row, bytes, span->left[r], span->sparse ? columns : NULL, count, end, offset, scale, out);
        out += count, columns += count;
    }
}

/* Fills a list with a plane's values at the cells; the plane has the grid's resolution. */
static HOT void list_codes(const Blocks *b, int plane, const Span *span, float *out)
{
    if (b->bytes == 1)
        read_plane(b, plane, 1, span, out);
    else
        read_plane(b, plane, 2, span, out);
}

/* Two codes side by side. */
typedef uint16_t Pair1 __attribute__((aligned(1), may_alias));
typedef uint32_t Pair2 __attribute__((aligned(2), may_alias));

/* Sum of the codes of a cell's part in one row; across: 1, 2 or 4 pixels. */
INLINE int sum_across(const char *row, int bytes, int across, int64_t cell)
{
    if (across == 1)
        return bytes == 1 ? ((const uint8_t *)row)[cell] : ((const uint16_t *)row)[cell];
    int sum = 0;
    for (int k = 0; k < across / 2; k++) {
        int64_t at = across / 2 * cell + k;
        if (bytes == 1)
            sum += (((const Pair1 *)row)[at] & 255) + (((const Pair1 *)row)[at] >> 8);
        else
            sum += (int)(((const Pair2 *)row)[at] & 65535) + (int)(((const Pair2 *)row)[at] >> 16);
    }
    return sum;
}

/* A row's mean luma over cells of pixels. */
INLINE void average_row(const char *row, int64_t stride, int bytes, int across, int down,
                               const int32_t *restrict columns, int count, float offset, float scale,
                               float *restrict out)
{
    for (int i = 0; i < count; i++) {
        int64_t cell = columns ? columns[i] : i;
        int sum = sum_across(row, bytes, across, cell);
        for (int j = 1; j < down; j++)
            sum += sum_across(row + j * stride, bytes, across, cell);
        out[i] = scale * (float)sum - offset;
    }
}

INLINE void average_plane(const Blocks *b, int bytes, int across, int down, const Span *span, float *out)
{
    float scale = (float)b->scale[0] / (float)(across * down), offset = (float)(b->offset[0] * b->scale[0]);
    int64_t stride = b->stride[0];
    const char *row = b->planes[0] + (int64_t)span->first_row * down * stride;
    const int32_t *columns = b->places;
    for (int r = 0; r < span->rows; r++, row += down * stride) {
        int count = span->count[r];
        const char *from = row + (int64_t)span->left[r] * across * bytes;
        if (span->sparse)
            average_row(row, stride, bytes, across, down, columns, count, offset, scale, out);
        else
            average_row(from, stride, bytes, across, down, NULL, count, offset, scale, out);
        out += count, columns += count;
    }
}

/* Fills a list with the mean luma of cells. The usual ones have loops of their own. */
static HOT void list_mean_luma(const Blocks *b, const Span *span, float *out)
{
    int across = 1 << b->shift_x, down = 1 << b->shift_y;
    if (b->bytes == 1 && across == 2 && down == 2)
        average_plane(b, 1, 2, 2, span, out);
    else if (b->bytes == 1)
        average_plane(b, 1, across, down, span, out);
    else if (across == 2 && down == 2)
        average_plane(b, 2, 2, 2, span, out);
    else
        average_plane(b, 2, across, down, span, out);
}

/* Clears what stands behind the list up to a whole step. */
INLINE void clear_rest(float *list, int total)
{
    for (int i = total; i < whole_steps(total); i++)
        list[i] = 0.0f;
}

/* cos and sin of the phase [cycles], to 1e-5, in place of phase and in `sine`. */
INLINE void turn(float cycles, float *cosine, float *sine)
{
    float t = cycles - __builtin_rintf(cycles), square = t * t;
    float twice = t * (6.28316404f + square * (-10.33428559f + square * (5.08379806f - 1.10927239f * square)));
    float half = 0.9999933f + square * (-4.93393801f + square * (4.04128377f - 1.22212693f * square));
    *cosine = 1.0f - 0.5f * twice * twice;
    *sine = twice * half;
}

/* Replaces a list of phases by their cosines, and fills that of sines. */
INLINE void turn_all(int total, float *restrict phase, float *restrict sine)
{
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++)
        turn(phase[i], &phase[i], &sine[i]);
}

#endif
