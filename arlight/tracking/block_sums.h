/* Sums over a block's pixels, and the normal equations that they make. */
#ifndef ARLIGHT_BLOCK_SUMS_H
#define ARLIGHT_BLOCK_SUMS_H

#include "blocks.h"
#include "small_fit.h"

/* How many columns describe a block's shading: x, y, and their powers up to the third. */
enum { FLAT = 0, SLOPED = 2, CURVED = 9 };

/* How many of the blocks from `at` on have one number of harmonics, FITS at most. */
static int alike(const Blocks *b, int at, int count)
{
    int some = 1;
    while (some < FITS && at + some < count && b->harmonics[b->order[at + some]] == b->harmonics[b->order[at]])
        some++;
    return some;
}

/* What geometry alone decides. c, s, x, y: lists of cos and sin of the phase and the place, zero behind the total. */
INLINE void sum_places(int harmonics, int total, const float *restrict c, const float *restrict s,
                              const float *restrict x, const float *restrict y, Sums *sums)
{
    float cosine[2 * HARMONICS + 1] = {0}, sine[2 * HARMONICS + 1] = {0};
    float xc[HARMONICS + 1] = {0}, xs[HARMONICS + 1] = {0}, yc[HARMONICS + 1] = {0}, ys[HARMONICS + 1] = {0};
    float xx = 0.0f, xy = 0.0f, yy = 0.0f;
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        float u = x[i], v = y[i], ck = c[i], sk = s[i];
        xc[0] += u, yc[0] += v;
        xx += u * u, xy += u * v, yy += v * v;
#pragma GCC unroll 6
        for (int k = 1; k <= 2 * harmonics; k++) {
            cosine[k] += ck, sine[k] += sk;
            if (k <= harmonics)
                xc[k] += u * ck, xs[k] += u * sk, yc[k] += v * ck, ys[k] += v * sk;
            float next = ck * c[i] - sk * s[i];
            sk = sk * c[i] + ck * s[i];
            ck = next;
        }
    }
    cosine[0] = (float)total;
    for (int k = 0; k <= 2 * HARMONICS; k++)
        sums->cosine[k] = cosine[k], sums->sine[k] = sine[k];
    for (int k = 0; k <= HARMONICS; k++) {
        sums->x_cosine[k] = xc[k], sums->x_sine[k] = xs[k];
        sums->y_cosine[k] = yc[k], sums->y_sine[k] = ys[k];
    }
    sums->xx = xx, sums->xy = xy, sums->yy = yy;
}

/* One channel's values times the columns. */
INLINE void sum_values(int harmonics, int total, const float *restrict c, const float *restrict s,
                              const float *restrict x, const float *restrict y, const float *restrict values,
                              float right[ROWS + 2], float *squares)
{
    float sum = 0.0f, square = 0.0f, with_x = 0.0f, with_y = 0.0f;
    float cosine[HARMONICS + 1] = {0}, sine[HARMONICS + 1] = {0};
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        float value = values[i], ck = c[i], sk = s[i];
        sum += value, square += value * value, with_x += x[i] * value, with_y += y[i] * value;
#pragma GCC unroll 3
        for (int k = 1; k <= harmonics; k++) {
            cosine[k] += ck * value, sine[k] += sk * value;
            float next = ck * c[i] - sk * s[i];
            sk = sk * c[i] + ck * s[i];
            ck = next;
        }
    }
    right[0] = sum;
    for (int k = 1; k <= HARMONICS; k++)
        right[2 * k - 1] = cosine[k], right[2 * k] = sine[k];
    right[ROWS] = with_x, right[ROWS + 1] = with_y;
    *squares = square;
}

INLINE void sum_all(int harmonics, int total, const float *c, const float *s, const float *x, const float *y,
                           const float *values, int64_t room, Sums *sums)
{
    sum_places(harmonics, total, c, s, x, y, sums);
    for (int k = 0; k < CHANNELS; k++)
        sum_values(harmonics, total, c, s, x, y, values + k * room, sums->right[k], &sums->squares[k]);
}

/* All sums of one block; values: CHANNELS lists, `room` apart. */
static HOT void sum_block(int harmonics, int total, const float *c, const float *s, const float *x, const float *y,
                          const float *values, int64_t room, Sums *sums)
{
    if (harmonics == 0)
        sum_all(0, total, c, s, x, y, values, room, sums);
    else if (harmonics == 1)
        sum_all(1, total, c, s, x, y, values, room, sums);
    else if (harmonics == 2)
        sum_all(2, total, c, s, x, y, values, room, sums);
    else
        sum_all(3, total, c, s, x, y, values, room, sums);
}

/* One of the sums of some blocks; fits that are too many repeat the first. field: as in the first block's sums. */
INLINE Fits gather_sums(const Sums *sums, int some, const float *field)
{
    Fits out;
    int64_t offset = field - (const float *)sums;
    for (int l = 0; l < FITS; l++)
        out[l] = ((const float *)(sums + (l < some ? l : 0)))[offset];
    return out;
}

/* Products of waves are sums of two others. */
INLINE void fill_waves(SmallFits *f, const Sums *sums, int some, int harmonics)
{
    Fits c[2 * HARMONICS + 1] = {gather_sums(sums, some, sums->cosine)}, s[2 * HARMONICS + 1] = {0.0 * c[0]};
    Fits(*normal)[COLUMNS] = f->normal;
    for (int k = 1; k <= 2 * harmonics; k++) {
        c[k] = gather_sums(sums, some, sums->cosine + k);
        s[k] = gather_sums(sums, some, sums->sine + k);
    }
    normal[0][0] = c[0];
    for (int i = 1; i <= harmonics; i++) {
        normal[2 * i - 1][0] = c[i];
        normal[2 * i][0] = s[i];
        for (int j = 1; j <= i; j++) {
            normal[2 * i - 1][2 * j - 1] = 0.5 * (c[i - j] + c[i + j]);
            normal[2 * i][2 * j] = 0.5 * (c[i - j] - c[i + j]);
            normal[2 * i][2 * j - 1] = 0.5 * (s[i + j] + s[i - j]);
            if (j < i)
                normal[2 * i - 1][2 * j] = 0.5 * (s[i + j] - s[i - j]);
        }
    }
}

INLINE void fill_shading(SmallFits *f, const Sums *sums, int some, int harmonics)
{
    int waves = 2 * harmonics + 1;
    Fits *x = f->normal[waves], *y = f->normal[waves + 1];
    x[0] = gather_sums(sums, some, sums->x_cosine);
    y[0] = gather_sums(sums, some, sums->y_cosine);
    for (int k = 1; k <= harmonics; k++) {
        x[2 * k - 1] = gather_sums(sums, some, sums->x_cosine + k);
        y[2 * k - 1] = gather_sums(sums, some, sums->y_cosine + k);
        x[2 * k] = gather_sums(sums, some, sums->x_sine + k);
        y[2 * k] = gather_sums(sums, some, sums->y_sine + k);
    }
    x[waves] = gather_sums(sums, some, &sums->xx);
    y[waves] = gather_sums(sums, some, &sums->xy);
    y[waves + 1] = gather_sums(sums, some, &sums->yy);
    for (int k = 0; k < f->rights; k++)
        for (int i = 0; i < 2; i++)
            f->right[k][waves + i] = gather_sums(sums, some, sums->right[k] + ROWS + i);
}

/* Normal equations of some blocks' sums: columns 1, cos 1, sin 1, ..., then x, y unless the shading is FLAT. What is
 * CURVED is filled by itself. */
static HOT void fill_fits(SmallFits *f, const Sums *sums, int some, int harmonics, int shading)
{
    int waves = 2 * harmonics + 1;
    f->columns = waves + shading;
    fill_waves(f, sums, some, harmonics);
    for (int k = 0; k < f->rights; k++)
        for (int i = 0; i < waves; i++)
            f->right[k][i] = gather_sums(sums, some, sums->right[k] + i);
    if (shading != FLAT)
        fill_shading(f, sums, some, harmonics);
}

#endif
