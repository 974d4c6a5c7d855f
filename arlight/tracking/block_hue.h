/* Chroma to expect of a block's pixels, from the stripes that the last estimate predicts: luma times a series. */
#ifndef ARLIGHT_BLOCK_HUE_H
#define ARLIGHT_BLOCK_HUE_H

#include "block_sums.h"

#define PHASES 16
#define LEAST_LUMA 0.25f /* of the limit of luma: what chroma is scaled with at least */
#define DARKEST 0.02f /* encoded luma below which chroma says nothing about hue */

/* cos of multiples of a turn's sixteenth. */
static const float SIXTEENTH[PHASES] = {
    1.0f, 0.92387953f, 0.70710678f, 0.38268343f, 0.0f, -0.38268343f, -0.70710678f, -0.92387953f,
    -1.0f, -0.92387953f, -0.70710678f, -0.38268343f, 0.0f, 0.38268343f, 0.70710678f, 0.92387953f,
};

INLINE float wave(int row, int phase)
{
    int k = (row + 1) / 2;
    return SIXTEENTH[(k * phase + (row % 2 ? 0 : k ? 3 * PHASES / 4 : 0)) % PHASES];
}

typedef float Some __attribute__((vector_size(FITS * sizeof(float)), may_alias)); /* of some blocks, one in each lane */

/* Replaces light by encoded values. */
INLINE void encode(const float *table, float last, int count, float *restrict light)
{
    int32_t places[PHASES * FITS];
    for (int i = 0; i < count; i++) {
        float value = light[i] > 0.0f ? light[i] : 0.0f;
        places[i] = (int32_t)(sqrtf(value < 1.0f ? value : 1.0f) * last + 0.5f);
    }
    for (int i = 0; i < count; i++)
        light[i] = table[places[i]];
}

/* Encoded luma and chroma of the predicted light at each phase. */
static HOT void encode_stripes(const Blocks *b, const Some stripes[ROWS][CHANNELS], Some ycc[3][PHASES])
{
    Some rgb[CHANNELS][PHASES];
    for (int c = 0; c < CHANNELS; c++) {
        for (int phase = 0; phase < PHASES; phase++) {
            Some light = stripes[0][c];
            for (int k = 1; k < ROWS; k++)
                light += stripes[k][c] * wave(k, phase);
            rgb[c][phase] = light;
        }
        encode(b->encoding, (float)(b->entries - 1), PHASES * FITS, (float *)rgb[c]);
    }
    for (int i = 0; i < 3; i++) {
        float red = (float)b->ycc_from_rgb[3 * i], green = (float)b->ycc_from_rgb[3 * i + 1];
        float blue = (float)b->ycc_from_rgb[3 * i + 2];
        for (int phase = 0; phase < PHASES; phase++)
            ycc[i][phase] = red * rgb[0][phase] + green * rgb[1][phase] + blue * rgb[2][phase];
    }
    float *luma = (float *)ycc[0];
    for (int i = 0; i < PHASES * FITS; i++)
        luma[i] = luma[i] > DARKEST ? luma[i] : DARKEST;
}

/* Sums over the phases for the least squares of (luma hue - chroma); brighter phases count more. */
static HOT void sum_phases(Some ycc[3][PHASES], int harmonics, Sums *sums)
{
    Some weight[PHASES];
    for (int phase = 0; phase < PHASES; phase++)
        weight[phase] = ycc[0][phase] * ycc[0][phase];
    for (int k = 0; k <= 2 * harmonics; k++) {
        Some c = weight[0], s = 0.0f * weight[0];
        for (int phase = 1; phase < PHASES; phase++) {
            c += weight[phase] * SIXTEENTH[k * phase % PHASES];
            s += weight[phase] * SIXTEENTH[(k * phase + 3 * PHASES / 4) % PHASES];
        }
        for (int l = 0; l < FITS; l++)
            sums[l].cosine[k] = c[l], sums[l].sine[k] = s[l];
    }
    for (int row = 0; row <= 2 * harmonics; row++) {
        Some blue = 0.0f * weight[0], red = blue;
        for (int phase = 0; phase < PHASES; phase++) {
            Some luma = ycc[0][phase] * wave(row, phase);
            blue += luma * ycc[1][phase];
            red += luma * ycc[2][phase];
        }
        for (int l = 0; l < FITS; l++)
            sums[l].right[0][row] = blue[l], sums[l].right[1][row] = red[l];
    }
}

/* The stripes of some blocks as the camera sees them, behind its vignetting. */
static void take_stripes(const Blocks *b, const int32_t *order, int some, Some stripes[ROWS][CHANNELS])
{
    for (int l = 0; l < FITS; l++) {
        int block = order[l < some ? l : 0];
        const double *from = b->stripes + (int64_t)block * ROWS * CHANNELS;
        for (int k = 0; k < ROWS; k++)
            for (int c = 0; c < CHANNELS; c++)
                stripes[k][c][l] = (float)from[k * CHANNELS + c] * b->gain[block];
    }
}

/* Twice the predicted luma as a series: pixels that are brighter are not only stripes, and their chroma is not so much
 * stronger; nor are those below a quarter of it so much weaker. */
static HOT void find_limit(const Some luma[PHASES], int harmonics, Some limit[ROWS])
{
    for (int row = 0; row <= 2 * harmonics; row++) {
        Some sum = 0.0f * luma[0];
        for (int phase = 0; phase < PHASES; phase++)
            sum += luma[phase] * wave(row, phase);
        limit[row] = sum * (row ? 4.0f / PHASES : 2.0f / PHASES);
    }
}

/* Hue of some blocks, of one number of harmonics, from the stripes predicted. */
static void predict_hue(const Blocks *b, const int32_t *order, int some, SmallFits *fits)
{
    int harmonics = b->harmonics[order[0]];
    Some stripes[ROWS][CHANNELS], ycc[3][PHASES], limit[ROWS];
    Sums sums[FITS] = {0};
    take_stripes(b, order, some, stripes);
    encode_stripes(b, stripes, ycc);
    sum_phases(ycc, harmonics, sums);
    find_limit((const Some *)ycc[0], harmonics, limit);
    fits->rights = 2;
    fill_fits(fits, sums, FITS, harmonics, FLAT);
    solve_fits(fits);
    for (int l = 0; l < some; l++) {
        float *hue = b->hue + (int64_t)order[l] * HUES * HUE;
        memset(hue, 0, HUES * HUE * sizeof *hue);
        for (int k = 0; k < fits->columns; k++) {
            hue[k] = (float)(fits->solved[0][k][l] * fits->regular[l]);
            hue[HUE + k] = (float)(fits->solved[1][k][l] * fits->regular[l]);
            hue[2 * HUE + k] = limit[k][l];
        }
        hue[2 * HUE + ROWS] = LEAST_LUMA;
    }
}

/* Hue of all blocks; none of blocks of one colour: their own mean is all that is to be known. */
static void predict_hues(const Blocks *b, int count)
{
    SmallFits fits;
    for (int at = 0, some; b->stripes && at < count; at += some) {
        some = alike(b, at, count);
        predict_hue(b, b->order + at, some, &fits);
    }
    for (int at = 0; at < count; at++)
        if (!(b->flags[b->order[at]] & PATTERNED))
            memset(b->hue + (int64_t)b->order[at] * HUES * HUE, 0, 2 * HUE * sizeof(float));
}

/* Luma as far as chroma is scaled with it; limit: series of the most, and the least over it. */
INLINE void limit_series(int harmonics, int total, const float *restrict limit, const float *restrict luma,
                         const float *restrict c, const float *restrict s, float *restrict limited)
{
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        float ck = c[i], sk = s[i], most = limit[0];
#pragma GCC unroll 3
        for (int k = 1; k <= harmonics; k++) {
            most += limit[2 * k - 1] * ck + limit[2 * k] * sk;
            float next = ck * c[i] - sk * s[i];
            sk = sk * c[i] + ck * s[i];
            ck = next;
        }
        most = most > 2.0f * DARKEST ? most : 2.0f * DARKEST;
        float least = limit[ROWS] * most, value = luma[i] > least ? luma[i] : least;
        limited[i] = value < most ? value : most;
    }
}

/* The limit's series of a block, and the least over it. */
INLINE const float *limit_of(const Blocks *b, int block)
{
    return b->hue + ((int64_t)block * HUES + 2) * HUE;
}

INLINE void limit_luma(int harmonics, int total, const float *limit, const float *luma, const float *c, const float *s,
                       float *limited)
{
    if (harmonics == 0)
        limit_series(0, total, limit, luma, c, s, limited);
    else if (harmonics == 1)
        limit_series(1, total, limit, luma, c, s, limited);
    else if (harmonics == 2)
        limit_series(2, total, limit, luma, c, s, limited);
    else
        limit_series(3, total, limit, luma, c, s, limited);
}

#endif
