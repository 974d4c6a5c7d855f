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

static inline float wave(int row, int phase)
{
    int k = (row + 1) / 2;
    return SIXTEENTH[(k * phase + (row % 2 ? 0 : k ? 3 * PHASES / 4 : 0)) % PHASES];
}

typedef float Some[FITS];

/* Harmonics of hue that are told from a block's stripes: those that its pixels' sums hold anyway. */
static inline int hue_harmonics(int harmonics)
{
    return 2 * harmonics < HARMONICS ? 2 * harmonics : HARMONICS;
}

/* Encoded luma and chroma of the predicted light at one phase. */
static HOT void encode_stripes(const Blocks *b, const Some stripes[ROWS][CHANNELS], int phase, Some ycc[3])
{
    float last = (float)(b->entries - 1), matrix[9];
    for (int i = 0; i < 9; i++)
        matrix[i] = (float)b->ycc_from_rgb[i];
    Some encoded[CHANNELS];
    for (int c = 0; c < CHANNELS; c++) {
        int32_t place[FITS];
        EACH_FIT
        {
            float light = stripes[0][c][l];
            for (int k = 1; k < ROWS; k++)
                light += stripes[k][c][l] * wave(k, phase);
            light = light > 0.0f ? light : 0.0f;
            light = light < 1.0f ? light : 1.0f;
            place[l] = (int32_t)(sqrtf(light) * last + 0.5f);
        }
        EACH_FIT encoded[c][l] = b->encoding[place[l]];
    }
    for (int c = 0; c < 3; c++)
        EACH_FIT ycc[c][l] = matrix[3 * c] * encoded[0][l] + matrix[3 * c + 1] * encoded[1][l] +
                             matrix[3 * c + 2] * encoded[2][l];
}

/* Sums over the phases for the least squares of (luma hue - chroma); brighter phases count more. */
static HOT void sum_phases(const Blocks *b, const Some stripes[ROWS][CHANNELS], Some cosine[2 * HARMONICS + 1],
                           Some sine[2 * HARMONICS + 1], Some right[2][ROWS])
{
    for (int phase = 0; phase < PHASES; phase++) {
        Some ycc[3], weight;
        encode_stripes(b, stripes, phase, ycc);
        EACH_FIT
        {
            ycc[0][l] = ycc[0][l] > DARKEST ? ycc[0][l] : DARKEST;
            weight[l] = ycc[0][l] * ycc[0][l];
        }
        for (int k = 0; k <= 2 * HARMONICS; k++) {
            float c = SIXTEENTH[k * phase % PHASES], s = SIXTEENTH[(k * phase + 3 * PHASES / 4) % PHASES];
            EACH_FIT cosine[k][l] += c * weight[l];
            EACH_FIT sine[k][l] += s * weight[l];
        }
        for (int c = 0; c < 2; c++)
            for (int k = 0; k < ROWS; k++) {
                float factor = wave(k, phase);
                EACH_FIT right[c][k][l] += factor * ycc[0][l] * ycc[1 + c][l];
            }
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
static void predict_hue(const Blocks *b, const int32_t *order, int some, int harmonics)
{
    static const Some none[2 * HARMONICS + 1];
    Some stripes[ROWS][CHANNELS], cosine[2 * HARMONICS + 1], sine[2 * HARMONICS + 1], right[2][ROWS];
    memcpy(cosine, none, sizeof cosine);
    memcpy(sine, none, sizeof sine);
    memset(right, 0, sizeof right);
    take_stripes(b, order, some, stripes);
    sum_phases(b, stripes, cosine, sine, right);
    SmallFits fits = {.rights = 2};
    Sums sums;
    memset(&sums, 0, sizeof sums);
    for (int l = 0; l < FITS; l++) {
        for (int k = 0; k <= 2 * HARMONICS; k++)
            sums.cosine[k] = cosine[k][l], sums.sine[k] = sine[k][l];
        for (int c = 0; c < 2; c++)
            for (int k = 0; k < ROWS; k++)
                sums.right[c][k] = right[c][k][l];
        fill_fit(&fits, l, hue_harmonics(harmonics), &sums);
    }
    fits.columns = 2 * hue_harmonics(harmonics) + 1;
    solve_fits(&fits);
    for (int l = 0; l < some; l++)
        for (int c = 0; c < 2; c++) {
            float *hue = b->hue + (c * HUE) * b->blocks + order[l];
            for (int k = 0; k < HUE; k++)
                hue[k * b->blocks] = k < fits.columns ? (float)(fits.solved[c][k][l] * fits.regular[l]) : 0.0f;
        }
}

/* Hue of all blocks; none of blocks of one colour: their own mean is all that is to be known. */
static void predict_hues(const Blocks *b, int count)
{
    for (int at = 0, some; at < count; at += some) {
        int harmonics = b->harmonics[b->order[at]];
        for (some = 1; some < FITS && at + some < count; some++)
            if (b->harmonics[b->order[at + some]] != harmonics)
                break;
        if (b->stripes)
            predict_hue(b, b->order + at, some, harmonics);
    }
    for (int at = 0; at < count; at++) {
        int block = b->order[at];
        if (!(b->flags[block] & PATTERNED))
            for (int k = 0; k < 2 * HUE; k++)
                b->hue[k * b->blocks + block] = 0.0f;
    }
}

#endif
