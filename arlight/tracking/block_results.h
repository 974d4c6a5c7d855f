/* What is handed on of each block. */
#ifndef ARLIGHT_BLOCK_RESULTS_H
#define ARLIGHT_BLOCK_RESULTS_H

#include "block_sums.h"

#define UNCLIPPED_SHARE 0.35 /* of a block's pixels, that must be used */
#define LEAST_SAMPLES 24

/* sin x / x, for x below about 1. */
static double sine_over(double x)
{
    double square = x * x;
    return 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
}

/* Mean of exp(-i b) and of the view's cosine over the pixels: the window's expansion, and the pixels' moments. */
static void average_look(const Blocks *b, int block, const Sums *sums)
{
    int64_t n = b->blocks;
    double over = 1.0 / sums->cosine[0], x = sums->x_cosine[0] * over, y = sums->y_cosine[0] * over;
    double xx = sums->xx * over, yy = sums->yy * over, xy = sums->xy * over, mean[2];
    for (int q = 0; q < 2; q++) {
        const float *a = b->look + q * 5 * n + block;
        mean[q] = a[0] + a[n] * x + a[2 * n] * y + a[3 * n] * xx + a[4 * n] * yy;
    }
    double by_x = b->look[n + block], by_y = b->look[2 * n + block];
    double along_x = by_x * sqrt(3.0 * fmax(xx - x * x, 0.0)), along_y = by_y * sqrt(3.0 * fmax(yy - y * y, 0.0));
    double left = sine_over(along_x) * sine_over(along_y);
    left -= by_x * by_y * (xy - x * y);
    b->phasor[2 * block] = left * cos(mean[0]);
    b->phasor[2 * block + 1] = -left * sin(mean[0]);
    b->cosine[block] = mean[1];
}

/* Writes some blocks' fits out. */
static void keep_fits(const Blocks *b, const SmallFits *fits, const int32_t *order, int some, const Sums *sums)
{
    int kept = 1 + 2 * b->harmonics[order[0]];
    for (int l = 0; l < some; l++) {
        int64_t block = order[l];
        int used = (int)sums[l].cosine[0];
        double *values = b->values + block * ROWS * CHANNELS, *covariance = b->covariance + block * ROWS * ROWS;
        memset(values, 0, ROWS * CHANNELS * sizeof *values);
        memset(covariance, 0, ROWS * ROWS * sizeof *covariance);
        memset(b->variance + block * CHANNELS, 0, CHANNELS * sizeof *values);
        b->samples[block] = 0;
        if (used < 2 * fits->columns || fits->regular[l] == 0.0)
            continue;
        b->samples[block] = used;
        for (int c = 0; c < CHANNELS; c++) {
            for (int i = 0; i < kept; i++)
                values[i * CHANNELS + c] = fits->solved[c][i][l];
            double left = sums[l].squares[c] - fits->explained[c][l];
            b->variance[block * CHANNELS + c] = fmax(left, 0.0) / (used - fits->columns);
        }
        for (int i = 0; i < kept; i++)
            for (int j = 0; j <= i; j++)
                covariance[i * ROWS + j] = covariance[j * ROWS + i] = fits->inverse[i][j][l];
    }
}

/* Writes out how steep the shading of some blocks' fits is. */
static void keep_slopes(const Blocks *b, const SmallFits *fits, const int32_t *order, int some)
{
    int x = 1 + 2 * b->harmonics[order[0]];
    for (int l = 0; l < some; l++)
        for (int c = 0; c < CHANNELS && b->samples[order[l]] > 0; c++)
            b->shading[(int64_t)order[l] * CHANNELS + c] = hypot(fits->solved[c][x][l], fits->solved[c][x + 1][l]);
}

/* Everything in units of light without vignetting. */
static void finish(const Blocks *b)
{
    int64_t n = b->blocks;
    for (int64_t i = 0; i < n; i++) {
        /* of blocks that are not seen nothing is known, their gain included */
        double over = b->samples[i] > 0 ? 1.0 / b->gain[i] : 0.0;
        for (int k = 0; k < ROWS * CHANNELS; k++)
            b->values[i * ROWS * CHANNELS + k] *= over;
        for (int c = 0; c < CHANNELS; c++) {
            b->variance[i * CHANNELS + c] *= over * over;
            b->shading[i * CHANNELS + c] *= over;
        }
        b->cycles[2 * i] = b->frequency[i], b->cycles[2 * i + 1] = b->frequency[n + i];
        b->resolved[i] = b->samples[i] > 0 ? b->harmonics[i] : 0;
        b->valid[i] = b->samples[i] >= LEAST_SAMPLES && b->samples[i] >= UNCLIPPED_SHARE * b->gathered[i];
    }
}

/* What blocks that are not seen say. */
static void clear_results(const Blocks *b)
{
    size_t n = (size_t)b->blocks;
    memset(b->values, 0, n * ROWS * CHANNELS * sizeof(double));
    memset(b->covariance, 0, n * ROWS * ROWS * sizeof(double));
    memset(b->variance, 0, n * CHANNELS * sizeof(double));
    memset(b->shading, 0, n * CHANNELS * sizeof(double));
    memset(b->phasor, 0, n * 2 * sizeof(double));
    memset(b->samples, 0, n * sizeof(int64_t));
    memset(b->gathered, 0, n * sizeof(int32_t));
    for (size_t i = 0; i < n; i++)
        b->cosine[i] = b->trust[i] = 1.0;
}

#endif
