/* Rows of codes as lines of numbers, and lines averaged at chroma samples. */
#ifndef ARLIGHT_VIDEO_LINES_H
#define ARLIGHT_VIDEO_LINES_H

#include <string.h>

#include "codes.h"
#include "picture.h"

/* Floats that a line of scratch memory is longer than the region is wide: what chroma at its edges averages. */
#define LINE_MARGIN 16

/* A part of a row of codes as numbers: out = (code - zero) * scale. */
static HOT void read_codes(const uint8_t *row, int32_t wide, int32_t first, int32_t count, float zero, float scale,
                           float *restrict out)
{
    if (wide) {
        const uint16_t *codes = (const uint16_t *)row + first;
        for (int32_t i = 0; i < count; i++)
            out[i] = ((float)codes[i] - zero) * scale;
    } else {
        const uint8_t *codes = row + first;
        for (int32_t i = 0; i < count; i++)
            out[i] = ((float)codes[i] - zero) * scale;
    }
}

/* Where a colour's component, a row of a matrix times Y'CbCr, lies in a curve: whole steps, and the share of the next
   one; clamped, and 0 for what is no number. */
static HOT void locate_component(struct curve curve, const float *matrix_row, float *const *ycc, int32_t count,
                                 int32_t *restrict step, float *restrict share)
{
    const float *luma = ycc[0], *cb = ycc[1], *cr = ycc[2];
    float a = matrix_row[0] * curve.last, b = matrix_row[1] * curve.last, c = matrix_row[2] * curve.last;
    for (int32_t i = 0; i < count; i++) {
        float x = a * luma[i] + b * cb[i] + c * cr[i];
        x = x > 0.0f ? x : 0.0f;
        x = x < curve.last ? x : curve.last;
        step[i] = (int32_t)x;
        share[i] = x - (float)step[i];
    }
}

/* Looks up places in a curve. Not compiled for more than the plainest processor: entries are loaded one by one anyhow,
   and put together faster for short registers. */
static void look_up(struct curve curve, const int32_t *restrict step, const float *restrict share, int32_t count,
                    float *restrict out)
{
    for (int32_t i = 0; i < count; i++) {
        float before = curve.values[step[i]];
        out[i] = before + (curve.values[step[i] + 1] - before) * share[i];
    }
}

/* Adds a weighted line to a sum. */
static HOT void add_line(float *restrict sum, const float *restrict line, float weight, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        sum[i] += weight * line[i];
}

INLINE int32_t clamped(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value < high ? value : high;
}

/* Adds every share-th entry of a weighted line to a sum. */
static HOT void add_every(float *restrict sum, const float *restrict line, float weight, int32_t share, int32_t count)
{
    if (share == 1)
        for (int32_t i = 0; i < count; i++)
            sum[i] += weight * line[i];
    else if (share == 2)
        for (int32_t i = 0; i < count; i++)
            sum[i] += weight * line[2 * i];
    else
        for (int32_t i = 0; i < count; i++)
            sum[i] += weight * line[share * i];
}

/* Chroma samples first <= c < end as weighted means of a line of pixels that begins at pixel `start`. */
static inline void average_columns(const struct axis *columns, const float *line, int32_t start, int32_t first,
                                   int32_t end, float *restrict out)
{
    int32_t from = clamped(columns->inner_samples[0], first, end);
    int32_t to = clamped(columns->inner_samples[1], from, end);
    memset(out, 0, (size_t)(end - first) * sizeof(float));
    for (int32_t t = 0; t < columns->taps; t++) {
        const int32_t *pixels = columns->tapped + (ptrdiff_t)t * columns->samples;
        float weight = columns->tap_weights[t];
        for (int32_t c = first; c < from; c++)
            out[c - first] += weight * line[pixels[c] - start];
        if (from < to)
            add_every(out + (from - first), line + (pixels[from] - start), weight, columns->share, to - from);
        for (int32_t c = to; c < end; c++)
            out[c - first] += weight * line[pixels[c] - start];
    }
}

#endif
