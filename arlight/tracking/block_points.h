/* Lists of a block's pixels: phase and place, and what the planes hold there. */
#ifndef ARLIGHT_BLOCK_POINTS_H
#define ARLIGHT_BLOCK_POINTS_H

#include "block_spans.h"
#include "small_fit.h"

/* Lists of a block's cells: of cos and sin of the phase, the phase itself to begin with, of the place, and of light. */
enum { PHASE_LIST, SINE_LIST, X_LIST, Y_LIST, LIGHT_LIST, KEPT = LIGHT_LIST + CHANNELS };
/* Lists there are: values of codes, those of the blocks that are fitted together, and what fits with a curved shading
 * are made of. */
enum { KEPT_LISTS = CHANNELS, FIT_LISTS = KEPT_LISTS + FITS * KEPT, LISTS = FIT_LISTS + COLUMNS + 3 };

/* Which of the blocks that are fitted together: where its lists are. */
INLINE float *list_of(const Blocks *b, int place, int which)
{
    return b->lists + (KEPT_LISTS + place * KEPT + which) * b->room;
}

/* Room for as many places in the decoding table as a list has, before a fit's columns go there. How far it lies from the
 * lists that are read meanwhile is always the same: at some distances processors confuse what is written with what is
 * read. */
INLINE int32_t *table_places(const Blocks *b)
{
    return (int32_t *)(b->lists + FIT_LISTS * b->room);
}

/* Some neighbours in a list, and their columns. */
typedef float Vector __attribute__((vector_size(4 * STEP), aligned(4), may_alias));
typedef int32_t Columns __attribute__((vector_size(4 * STEP), aligned(4), may_alias));
/* Codes of two bytes, or pairs of one, and pairs of two. */
typedef uint16_t Codes2 __attribute__((vector_size(2 * STEP), aligned(1), may_alias));
typedef uint32_t Pairs2 __attribute__((vector_size(4 * STEP), aligned(1), may_alias));

#define FETCHED_PX 64.0f /* half the size of blocks up to which all of one is brought near: two cache lines a row */

static const Columns EACH = {0, 1, 2, 3, 4, 5, 6, 7};

/* What is read of a block's cells: luma, three planes, or chroma and the mean luma of the pixels that share it. */
enum { LUMA, ALL_PLANES, CELLS };

/* Where cells are read from and listed. */
typedef struct {
    const char *from[CHANNELS]; /* planes */
    int64_t stride[CHANNELS];   /* bytes from row to row of the grid */
    int64_t luma_stride;        /* bytes from row to row of pixels */
    int bytes, across, down;    /* of a code; pixels that share chroma */
    int width, height;          /* cells */
    int together;               /* whether a step can be read at once, but for the last row */
    float left, step;           /* u of the first column, and from one to the next */
    float scale[CHANNELS], offset[CHANNELS]; /* value = scale code - offset */
    float *phase, *x, *y, *values[CHANNELS];
} Reader;

/* Neighbours in a row. */
typedef struct {
    int row, left, count; /* in the plane */
    int at;               /* place in the lists */
    const float *terms;   /* (SURFACES, CUBIC) coefficients of u^k; the cubic one matters for the phase alone */
} Cells;

/* Neighbours' codes. */
INLINE Columns read_codes(const char *from, int bytes)
{
    if (bytes == 2)
        return __builtin_convertvector(*(const Codes2 *)from, Columns);
    /* left to itself the compiler widens so few bytes one by one */
    int32_t a, b;
    memcpy(&a, from, sizeof a);
    memcpy(&b, from + sizeof a, sizeof b);
    return (Columns){a, a, a, a, b, b, b, b} >> (EACH % 4 * 8) & 255;
}

/* Sums of neighbouring pairs of codes. */
INLINE Columns sum_pairs(const char *from, int bytes)
{
    if (bytes == 1) {
        Codes2 pairs = *(const Codes2 *)from;
        return __builtin_convertvector((pairs & 255) + (pairs >> 8), Columns);
    }
    Pairs2 pairs = *(const Pairs2 *)from;
    return (Columns)((pairs & 65535) + (pairs >> 16));
}

/* Lists neighbours in whole steps: what is too much is written over by the next. */
INLINE void list_steps(const Reader *s, const Cells *cells, int what, int bytes, int down)
{
    float *phase = s->phase + cells->at, *x = s->x + cells->at, *y = s->y + cells->at;
    const char *from[CHANNELS];
    for (int plane = 0; plane < (what == LUMA ? 1 : CHANNELS); plane++)
        from[plane] = s->from[plane] + cells->row * s->stride[plane] +
                      cells->left * (what == CELLS && plane == 0 ? 2 * bytes : bytes);
    Vector u = s->left + s->step * __builtin_convertvector(cells->left + EACH, Vector);
    const float *k = cells->terms, forward = s->step * STEP;
    for (int i = 0; i < cells->count; i += STEP, u += forward) {
        *(Vector *)(phase + i) = k[0] + u * (k[1] + u * (k[2] + u * k[3]));
        *(Vector *)(x + i) = k[4] + u * (k[5] + u * k[6]);
        *(Vector *)(y + i) = k[8] + u * (k[9] + u * k[10]);
        for (int plane = 0; plane < (what == LUMA ? 1 : CHANNELS); plane++) {
            int paired = what == CELLS && plane == 0;
            const char *codes = from[plane] + i * bytes * (paired ? 2 : 1);
            Columns read = paired ? sum_pairs(codes, bytes) : read_codes(codes, bytes);
            if (paired && down == 2)
                read += sum_pairs(codes + s->luma_stride, bytes);
            *(Vector *)(s->values[plane] + cells->at + i) =
                s->scale[plane] * __builtin_convertvector(read, Vector) - s->offset[plane];
        }
    }
}

INLINE int code_at(const char *row, int bytes, int64_t column)
{
    return bytes == 1 ? ((const uint8_t *)row)[column] : ((const uint16_t *)row)[column];
}

/* A cell's code, or for CELLS the sum of its pixels' luma. */
static int code_of(const Reader *s, const Cells *cells, int column, int plane, int what)
{
    const char *row = s->from[plane] + cells->row * s->stride[plane];
    if (what != CELLS || plane > 0)
        return code_at(row, s->bytes, column);
    int sum = 0;
    for (int j = 0; j < s->down; j++)
        for (int l = 0; l < s->across; l++)
            sum += code_at(row + j * s->luma_stride, s->bytes, (int64_t)column * s->across + l);
    return sum;
}

/* The same where a whole step would leave the plane, and for cells of other shapes. */
static void list_singly(const Reader *s, const Cells *cells, int what)
{
    const float *k = cells->terms;
    for (int i = 0; i < cells->count; i++) {
        int column = cells->left + i, at = cells->at + i;
        float u = s->left + s->step * (float)column;
        s->phase[at] = k[0] + u * (k[1] + u * (k[2] + u * k[3]));
        s->x[at] = k[4] + u * (k[5] + u * k[6]);
        s->y[at] = k[8] + u * (k[9] + u * k[10]);
        for (int plane = 0; plane < (what == LUMA ? 1 : CHANNELS); plane++)
            s->values[plane][at] = s->scale[plane] * (float)code_of(s, cells, column, plane, what) - s->offset[plane];
    }
}

/* place: as for `list_of`. */
static Reader reader_of(const Blocks *b, int block, int place, int what, const Grid *grid)
{
    int cells = what == CELLS;
    float scale = 1.0f / b->box[2 * b->blocks + block];
    Reader s = {.luma_stride = b->stride[0], .bytes = (int)b->bytes, .across = cells ? (int)grid->step_x : 1,
                .down = cells ? (int)grid->step_y : 1, .width = grid->width, .height = grid->height,
                .left = (grid->first_x - b->box[block]) * scale, .step = grid->step_x * scale,
                .phase = list_of(b, place, PHASE_LIST), .x = list_of(b, place, X_LIST),
                .y = list_of(b, place, Y_LIST)};
    s.together = grid->width >= 2 * STEP && (!cells || (s.across == 2 && s.down <= 2));
    for (int plane = 0; plane < CHANNELS; plane++) {
        int summed = cells && plane == 0;
        s.from[plane] = b->planes[plane];
        s.stride[plane] = b->stride[plane] * (plane == 0 ? s.down : 1);
        s.scale[plane] = (float)b->scale[plane] / (float)(summed ? s.across * s.down : 1);
        s.offset[plane] = (float)(b->offset[plane] * b->scale[plane]);
        s.values[plane] = summed ? list_of(b, place, LIGHT_LIST) : b->lists + (plane - cells) * b->room;
    }
    return s;
}

/* Coefficients of the surfaces' cubics in each row. They are read long after they are written, as is fast. */
INLINE void expand_rows(const Blocks *b, int block, const Grid *grid, const Span *span)
{
    typedef float Terms __attribute__((vector_size(4 * TERMS), aligned(4), may_alias));
    const Terms *of = (const Terms *)(b->surfaces + (int64_t)block * CUBIC * TERMS);
    Terms *rows = (Terms *)b->rows;
    float scale = 1.0f / b->box[3 * b->blocks + block], middle = b->box[b->blocks + block];
    for (int r = 0; r < span->rows; r++) {
        float v = ((float)(span->first_row + r) * grid->step_y + grid->first_y - middle) * scale;
        rows[r] = of[0] + v * (of[1] + v * (of[2] + v * of[3]));
    }
}

/* Lists neighbours. */
INLINE void list_some(const Reader *s, const Cells *cells, int what, int bytes, int down)
{
    /* whole steps may run into the next row of the plane, not beyond the last */
    if (!s->together || (cells->row + 1 == s->height && cells->left + whole_steps(cells->count) > s->width))
        list_singly(s, cells, what);
    else
        list_steps(s, cells, what, bytes, down);
}

/* Lists the cells of all rows, or of those steps of theirs that were chosen. Returns how many there are. */
INLINE int list_rows(const Blocks *b, const Reader *s, const Span *span, int what, int bytes, int down)
{
    Cells cells = {.at = 0};
    for (int r = 0, first = 0, next = 0; r < span->rows; r++) {
        int left = span->left[r], count = span->count[r], steps = whole_steps(count) / STEP;
        cells.row = span->first_row + r, cells.left = left, cells.count = count;
        cells.terms = b->rows + r * TERMS;
        if (span->chosen < 0) {
            list_some(s, &cells, what, bytes, down);
            cells.at += count;
        }
        for (; next < span->chosen && span->steps[next] < first + steps; next++) {
            int passed = (span->steps[next] - first) * STEP, most = span->total - cells.at;
            cells.left = left + passed;
            cells.count = count - passed < STEP ? count - passed : STEP;
            cells.count = cells.count < most ? cells.count : most;
            list_some(s, &cells, what, bytes, down);
            cells.at += cells.count;
        }
        first += steps;
    }
    return cells.at;
}

/* Lists the cells of a block, `limit` at most: phase, x, y and the planes' values; for CELLS those of Cb and Cr, and
 * their mean luma in the list of light. The usual ones have code of their own. Returns how many there are. */
static HOT int list_cells(const Blocks *b, int block, int place, const Grid *grid, int limit, int what)
{
    Span span = span_of(b, block, grid);
    if (span.total > limit)
        thin_out(&span, limit);
    expand_rows(b, block, grid, &span);
    Reader s = reader_of(b, block, place, what, grid);
    if (what == CELLS && s.bytes == 1 && s.down == 2)
        return list_rows(b, &s, &span, CELLS, 1, 2);
    if (what == LUMA && s.bytes == 1)
        return list_rows(b, &s, &span, LUMA, 1, 1);
    return list_rows(b, &s, &span, what, s.bytes, s.down);
}

/* Fetches one plane's part of a box of pixels, given by its middle and half its size. */
INLINE void fetch_rows(const Blocks *b, int plane, const float *box)
{
    float across = plane ? 1.0f / (float)(1 << b->shift_x) : 1.0f, down = plane ? 1.0f / (float)(1 << b->shift_y) : 1.0f;
    int64_t n = b->blocks, left = (int64_t)((box[0] - box[2 * n]) * across) * b->bytes;
    int64_t right = (int64_t)((box[0] + box[2 * n]) * across) * b->bytes;
    int last = (int)((box[n] + box[3 * n]) * down);
    for (int y = (int)((box[n] - box[3 * n]) * down); y <= last; y++) {
        const char *row = b->planes[plane] + y * b->stride[plane];
        __builtin_prefetch(row + left);
        __builtin_prefetch(row + right);
    }
}

/* Has what the first planes hold of a block brought near while others are worked on: a picture that was just decoded
 * lies far from the processor. Of large blocks few pixels are read. */
INLINE void fetch_block(const Blocks *b, int block, int planes)
{
    const float *box = b->box + block;
    if (box[2 * b->blocks] * (float)b->bytes > FETCHED_PX || box[3 * b->blocks] > FETCHED_PX)
        return;
    for (int plane = 0; plane < planes; plane++)
        fetch_rows(b, plane, box);
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
