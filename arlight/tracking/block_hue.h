/* Chroma to expect of a block's pixels, from the stripes that the last estimate predicts: luma times a series. */
#ifndef ARLIGHT_BLOCK_HUE_H
#define ARLIGHT_BLOCK_HUE_H

#include "block_sums.h"

#define PHASES 16
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

typedef float Some __attribute__((vector_size(FITS * sizeof(float)))); /* of some blocks, one in each lane */

/* Harmonics of hue that are told from a block's stripes: those that its pixels' sums hold anyway. */
INLINE int hue_harmonics(int harmonics)
{
    return 2 * harmonics < HARMONICS ? 2 * harmonics : HARMONICS;
}

/* Encoded values of light. */
INLINE Some encoded(const float *table, float last, Some light)
{
    Some out;
    for (int l = 0; l < FITS; l++) {
        float value = light[l] > 0.0f ? light[l] : 0.0f;
        out[l] = sqrtf(value < 1.0f ? value : 1.0f) * last + 0.5f;
    }
    for (int l = 0; l < FITS; l++)
        out[l] = table[(int)out[l]];
    return out;
}

/* Encoded luma and chroma of the predicted light at each phase. */
static HOT void encode_stripes(const Blocks *b, const Some stripes[ROWS][CHANNELS], Some ycc[PHASES][3])
{
    float last = (float)(b->entries - 1), matrix[9];
    for (int i = 0; i < 9; i++)
        matrix[i] = (float)b->ycc_from_rgb[i];
    for (int phase = 0; phase < PHASES; phase++) {
        Some rgb[CHANNELS];
        for (int c = 0; c < CHANNELS; c++) {
            rgb[c] = stripes[0][c];
            for (int k = 1; k < ROWS; k++)
                rgb[c] += stripes[k][c] * wave(k, phase);
            rgb[c] = encoded(b->encoding, last, rgb[c]);
        }
        for (int i = 0; i < 3; i++)
            ycc[phase][i] = matrix[3 * i] * rgb[0] + matrix[3 * i + 1] * rgb[1] + matrix[3 * i + 2] * rgb[2];
        for (int l = 0; l < FITS; l++)
            ycc[phase][0][l] = ycc[phase][0][l] > DARKEST ? ycc[phase][0][l] : DARKEST;
    }
}

/* Sums over the phases for the least squares of (luma hue - chroma); brighter phases count more. */
static HOT void sum_phases(Some ycc[PHASES][3], int harmonics, Sums *sums)
{
    Some weight[PHASES];
    for (int phase = 0; phase < PHASES; phase++)
        weight[phase] = ycc[phase][0] * ycc[phase][0];
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
            Some luma = ycc[phase][0] * wave(row, phase);
            blue += luma * ycc[phase][1];
            red += luma * ycc[phase][2];
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

/* Hue of some blocks, of one number of harmonics, from the stripes predicted. */
static void predict_hue(const Blocks *b, const int32_t *order, int some, SmallFits *fits)
{
    int harmonics = hue_harmonics(b->harmonics[order[0]]);
    Some stripes[ROWS][CHANNELS], ycc[PHASES][3];
    Sums sums[FITS] = {0};
    take_stripes(b, order, some, stripes);
    encode_stripes(b, stripes, ycc);
    sum_phases(ycc, harmonics, sums);
    fits->rights = 2;
    for (int l = 0; l < FITS; l++)
        fill_fit(fits, l, harmonics, sums + l);
    fits->columns = 2 * harmonics + 1;
    solve_fits(fits);
    for (int l = 0; l < some; l++)
        for (int c = 0; c < 2; c++) {
            float *hue = b->hue + (c * HUE) * b->blocks + order[l];
            for (int k = 0; k < HUE; k++)
                hue[k * b->blocks] = k < fits->columns ? (float)(fits->solved[c][k][l] * fits->regular[l]) : 0.0f;
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
    for (int at = 0; at < count; at++) {
        int block = b->order[at];
        for (int k = 0; k < 2 * HUE && !(b->flags[block] & PATTERNED); k++)
            b->hue[k * b->blocks + block] = 0.0f;
    }
}

#endif
