/* The samples of a band of a picture's rows: what is nearest at each, drawn eight side by side. */
#ifndef ARLIGHT_SAMPLES_H
#define ARLIGHT_SAMPLES_H

#include "eight.h"

#include <string.h>

enum { SIDE_BY_SIDE = 8 };

typedef struct {
    float *planes; /* (4, plane) 1 / depth of what is drawn, 0 where nothing is; its red, green, blue, or anything */
    int64_t plane; /* rows * width + SIDE_BY_SIDE at least: samples are written in eights, also the last one */
    int64_t width, height; /* of the picture */
    int64_t top, bottom;   /* the band: from the first row to before the last */
} Samples;

/* Where a sample of the band is in its planes. */
INLINE int64_t place_of(const Samples *s, int64_t row, int64_t column) { return (row - s->top) * s->width + column; }

/* Where `seen` the value replaces what is there. */
INLINE void put_where(EightBits seen, Eight value, float *there)
{
    EightThere *eight = (EightThere *)there;
    *eight = (Eight)((seen & (EightBits)value) | (~seen & (EightBits)*eight));
}

/* Eight samples of planes: the value, radiance / depth and 1 / depth, replaces what is there where it is nearer and
   `outside` is not negative. */
INLINE void put(float *samples, int64_t plane, EightBits outside, const Eight value[4])
{
    Eight before = *(const EightThere *)samples, depth = 1.0f / value[3];
    EightBits seen = (~outside & (EightBits)(before - value[3])) >> 31;
    put_where(seen, value[3], samples);
    for (int c = 0; c < 3; c++)
        put_where(seen, value[c] * depth, samples + (c + 1) * plane);
}

/* Sums of neighbours among sixteen samples in a row. */
INLINE Eight pair_sums(Eight left, Eight right)
{
    const EightBits even = {0, 2, 4, 6, 8, 10, 12, 14}, odd = {1, 3, 5, 7, 9, 11, 13, 15};
    return __builtin_shuffle(left, right, even) + __builtin_shuffle(left, right, odd);
}

/* Eight pixels of two by two samples: the mean of radiance times coverage, and of coverage. */
INLINE void mean_of_eight(const Samples *s, const float *samples, Four *drawn)
{
    Eight sum[4];
    EightBits seen[2][2];
    for (int row = 0; row < 2; row++)
        for (int half = 0; half < 2; half++)
            seen[row][half] = *(const EightThere *)(samples + row * s->width + half * SIDE_BY_SIDE) > 0.0f;
    if (!any(seen[0][0] | seen[0][1] | seen[1][0] | seen[1][1])) {
        memset(drawn, 0, SIDE_BY_SIDE * sizeof *drawn);
        return;
    }
    for (int c = 0; c < 4; c++) {
        Eight column[2];
        for (int half = 0; half < 2; half++) {
            const float *at = samples + c * s->plane + half * SIDE_BY_SIDE;
            Eight above = all(1.0f), below = above;
            if (c > 0)
                above = *(const EightThere *)at, below = *(const EightThere *)(at + s->width);
            column[half] = (Eight)((EightBits)above & seen[0][half]) + (Eight)((EightBits)below & seen[1][half]);
        }
        sum[c] = pair_sums(column[0], column[1]) * 0.25f;
    }
    store_pixels(sum[1], sum[2], sum[3], sum[0], drawn, 1);
}

/* The same of a pixel of `side` by `side`. */
INLINE Four mean_of_one(const Samples *s, const float *samples, int64_t side)
{
    Four sum = {0.0f, 0.0f, 0.0f, 0.0f};
    for (int64_t row = 0; row < side; row++, samples += s->width)
        for (const float *at = samples; at < samples + side; at++)
            if (*at > 0.0f)
                sum += (Four){at[s->plane], at[2 * s->plane], at[3 * s->plane], 1.0f};
    return sum * (1.0f / (float)(side * side));
}

/* The band's pixels of a picture (height / side, width / side, 4). */
INLINE void mean_of_samples(const Samples *s, int64_t side, Four *drawn)
{
    int64_t columns = s->width / side, together = side == 2 ? columns / SIDE_BY_SIDE * SIDE_BY_SIDE : 0;
    drawn += s->top / side * columns;
    for (int64_t row = 0; row < (s->bottom - s->top) / side; row++, drawn += columns) {
        const float *samples = s->planes + row * side * s->width;
        for (int64_t column = 0; column < together; column += SIDE_BY_SIDE)
            mean_of_eight(s, samples + 2 * column, drawn + column);
        for (int64_t column = together; column < columns; column++)
            drawn[column] = mean_of_one(s, samples + side * column, side);
    }
}

#endif
