/* What the stored chroma of half the resolution says: it corrects the chroma expected of each block.
 *
 * Luma shows the stripes; chroma that several pixels share, coarsely quantised, does not. Its mean over a block
 * corrects the expected one always, its swing at the stripes' phase as far as the stream has kept it. How far that is,
 * and by how much chroma is displaced, is read off all blocks together.
 */
#ifndef ARLIGHT_BLOCK_CHROMA_H
#define ARLIGHT_BLOCK_CHROMA_H

#include "block_hue.h"
#include "block_points.h"

#define SWING_NOISE (0.35 / 224.0)  /* error of a chroma swing: codecs quantise it coarsely, and drop the smallest */
#define WEAKEST_SWING (0.7 / 224.0) /* expected swings below this say nothing about what the stream does to chroma */
#define PRIOR_VARIANCE_PX2 1.0
#define PRIOR_SHIFT_PX 0.3          /* how far encoders' chroma is from where their tags put it */
#define STRONGEST_CYCLES 0.2        /* stripes finer than this say nothing about it either [1/px] */
#define FEW_CELLS 16                /* beside a quarter of the pixels' number: more cells say nothing more */
#define LEAST_KEPT 0.3              /* what averaging a cell's pixels must leave of stripes for them to be compared */

/* One block's chroma, complex numbers as cosine and minus sine part. */
typedef struct {
    double frequency_x, frequency_y, kept; /* what averaging over a cell leaves of the stripes */
    double luma[3];                        /* mean, cos, sin */
    double measured[2][3], expected[2][3]; /* Cb and Cr: mean, cos, sin */
    double mean[3];                        /* of all its cells */
    float darkest;                         /* luma of any */
    int patterned;
} Chroma;

/* What the stream does to all chroma. */
typedef struct {
    double variance_px2;   /* of the filter that attenuates it */
    double shift_x, shift_y; /* where it lies [px] */
} Stream;

/* Sum and least of a list. */
static HOT float sum_list(int total, const float *restrict values, float *least)
{
    float sum = 0.0f;
    for (int i = 0; i < total; i++)
        sum += values[i];
    *least = total ? values[0] : 0.0f;
    for (int i = 1; i < total; i++)
        *least = values[i] < *least ? values[i] : *least;
    return sum;
}

/* Sums over the cells of one block: values Cb, Cr and the mean of their luma, as far as chroma is scaled with it. */
static HOT void sum_cells(const Blocks *b, int block, const Grid *grid, int limited, Sums *sums, Chroma *chroma)
{
    int quarter = (int)b->limit / 4, limit = quarter + (quarter < FEW_CELLS ? quarter : FEW_CELLS);
    int total = list_cells(b, block, 0, grid, limit, CELLS);
    float *c = list_of(b, 0, PHASE_LIST), *s = list_of(b, 0, SINE_LIST), *values = b->lists;
    float *luma = list_of(b, 0, LIGHT_LIST);
    turn_all(total, c, s);
    if (limited)
        limit_luma(b->harmonics[block], total, limit_of(b, block), luma, c, s, values + 2 * b->room);
    else
        memcpy(values + 2 * b->room, luma, (size_t)total * sizeof *luma);
    for (int k = PHASE_LIST; k <= LIGHT_LIST; k++)
        clear_rest(list_of(b, 0, k), total);
    for (int k = 0; k < CHANNELS; k++)
        clear_rest(values + k * b->room, total);
    sum_block(b->harmonics[block] > 0, total, c, s, list_of(b, 0, X_LIST), list_of(b, 0, Y_LIST), values, b->room, sums);
    double over = total ? 1.0 / total : 0.0;
    chroma->mean[0] = sum_list(total, luma, &chroma->darkest) * over;
    chroma->mean[1] = sums->right[0][0] * over;
    chroma->mean[2] = sums->right[1][0] * over;
}

/* What averaging over a cell leaves of stripes. */
static double kept_by_cells(const Blocks *b, double frequency_x, double frequency_y)
{
    double kept = 1.0;
    for (int k = 0; k < b->shift_x; k++)
        kept *= cos(PI * frequency_x * (1 << k));
    for (int k = 0; k < b->shift_y; k++)
        kept *= cos(PI * frequency_y * (1 << k));
    return kept;
}

/* Chroma that the block's luma, as far as it was fitted, and its hue let expect. */
static void expect(const Blocks *b, int block, Chroma *chroma)
{
    const double *y = chroma->luma;
    for (int k = 0; k < 2; k++) {
        const float *hue = b->hue + (int64_t)block * HUES * HUE + k * HUE;
        double *e = chroma->expected[k];
        e[0] = y[0] * hue[0] + 0.5 * (y[1] * hue[1] + y[2] * hue[2]) + hue[ROWS];
        e[1] = y[0] * hue[1] + y[1] * hue[0] + 0.5 * (y[1] * hue[3] + y[2] * hue[4]);
        e[2] = y[0] * hue[2] + y[2] * hue[0] + 0.5 * (y[1] * hue[4] - y[2] * hue[3]);
    }
}

/* Fits some blocks' cells, of one number of harmonics. */
static void fit_cells(const Blocks *b, const int32_t *order, int some, const Sums *sums, Chroma *chroma)
{
    SmallFits fits;
    fits.rights = 3;
    int harmonics = b->harmonics[order[0]] > 0;
    fill_fits(&fits, sums, some, harmonics, SLOPED);
    solve_fits(&fits);
    for (int l = 0; l < some; l++) {
        Chroma *out = chroma + l;
        out->frequency_x = b->frequency[order[l]];
        out->frequency_y = b->frequency[b->blocks + order[l]];
        out->kept = kept_by_cells(b, out->frequency_x, out->frequency_y);
        out->patterned = (b->flags[order[l]] & PATTERNED) != 0;
        int clear = harmonics && fits.regular[l] > 0.0 && fabs(out->kept) >= LEAST_KEPT;
        for (int k = 0; k < 3; k++) {
            double *of = k < 2 ? out->measured[k] : out->luma;
            of[0] = fits.regular[l] > 0.0 ? fits.solved[k][0][l] : sums[l].right[k][0] / fmax(sums[l].cosine[0], 1.0);
            for (int i = 1; i < 3; i++)
                of[i] = clear ? fits.solved[k][i][l] * (k < 2 ? out->kept : 1.0 / out->kept) : 0.0;
        }
        if (!clear)
            out->kept = 0.0;
        expect(b, order[l], out);
    }
}

/* The stream's filter and displacement, by least squares over the blocks whose stripes are coarse and strong. */
static Stream observe_stream(const Blocks *b, int count, const Chroma *chroma)
{
    double over = 1.0, above = PRIOR_VARIANCE_PX2, dx = b->displacement_px[0], dy = b->displacement_px[1];
    double xx = 1.0 / (PRIOR_SHIFT_PX * PRIOR_SHIFT_PX), xy = 0.0, yy = xx, x = 0.0, y = 0.0;
    for (int i = 0; i < count; i++) {
        const Chroma *a = chroma + i;
        double power = 0.0, real = 0.0, imaginary = 0.0;
        for (int k = 0; k < 2; k++) {
            const double *m = a->measured[k], *e = a->expected[k];
            power += e[1] * e[1] + e[2] * e[2];
            real += m[1] * e[1] + m[2] * e[2];
            imaginary += m[1] * e[2] - m[2] * e[1];
        }
        double squared = a->frequency_x * a->frequency_x + a->frequency_y * a->frequency_y;
        if (!(power > WEAKEST_SWING * WEAKEST_SWING && squared > 0.0 && a->kept != 0.0 &&
              squared < STRONGEST_CYCLES * STRONGEST_CYCLES))
            continue;
        double weight = power / (SWING_NOISE * SWING_NOISE), exponent = 2.0 * PI * PI * squared;
        double ratio = sqrt(real * real + imaginary * imaginary) / power;
        double fall = fmin(fmax(-log(fmax(ratio, 0.05)), 0.0), 3.0);
        above += weight * exponent * fall;
        over += weight * exponent * exponent;
        double wave_x = 2.0 * PI * a->frequency_x, wave_y = 2.0 * PI * a->frequency_y;
        double angle = ratio > 0.25 ? remainder(atan2(imaginary, real) - wave_x * dx - wave_y * dy, 2.0 * PI) : 0.0;
        xx += weight * wave_x * wave_x, xy += weight * wave_x * wave_y, yy += weight * wave_y * wave_y;
        x += weight * wave_x * angle, y += weight * wave_y * angle;
    }
    double determinant = xx * yy - xy * xy;
    return (Stream){above / over, dx + (yy * x - xy * y) / determinant, dy + (xx * y - xy * x) / determinant};
}

/* What to add to a block's expected chroma: mean, cosine and sine part of Cb and Cr; returns the share of the swing
 * that was seen. */
static double correct(const Stream *stream, const Chroma *a, double correction[2][3])
{
    double squared = a->frequency_x * a->frequency_x + a->frequency_y * a->frequency_y;
    double gain = a->kept != 0.0 || squared == 0.0 ? exp(-2.0 * PI * PI * squared * stream->variance_px2) : 0.0;
    double angle = 2.0 * PI * (a->frequency_x * stream->shift_x + a->frequency_y * stream->shift_y);
    double turned_c = cos(angle), turned_s = sin(angle), power = 0.0;
    for (int k = 0; k < 2; k++) {
        const double *m = a->measured[k], *e = a->expected[k];
        power += 0.5 * (m[1] * m[1] + m[2] * m[2] + gain * gain * (e[1] * e[1] + e[2] * e[2]));
    }
    /* a Wiener filter: undo the attenuation as far as the swing stands out of the codec's noise */
    double seen = gain / (gain * gain + SWING_NOISE * SWING_NOISE / fmax(power, 1e-12));
    for (int k = 0; k < 2; k++) {
        const double *m = a->measured[k], *e = a->expected[k];
        correction[k][0] = m[0] - e[0];
        correction[k][1] = a->patterned ? seen * (turned_c * m[1] - turned_s * m[2] - gain * e[1]) : 0.0;
        correction[k][2] = a->patterned ? seen * (turned_c * m[2] + turned_s * m[1] - gain * e[2]) : 0.0;
    }
    return gain * seen;
}

/* What makes a block's encoded RGB of luma and phase. The mean correction grows with luma above the block's darkest:
 * colour differences scale with the light of the stripes. */
static void mix_tints(const Blocks *b, int block, const Chroma *a, double correction[2][3])
{
    double darkest = fmax(fmin(a->darkest, a->luma[0] - sqrt(a->luma[1] * a->luma[1] + a->luma[2] * a->luma[2])), 0.0);
    double over = 1.0 / fmax(a->mean[0] - darkest + DARKEST, DARKEST), base = (DARKEST - darkest) * over;
    const float *hue = b->hue + (int64_t)block * HUES * HUE;
    for (int c = 0; c < CHANNELS; c++) {
        const double *matrix = b->rgb_from_ycc + 3 * c, last = (double)(b->entries - 1);
        double blue = matrix[1] * last, red = matrix[2] * last, mean = blue * correction[0][0] + red * correction[1][0];
        Tint *tint = b->tints + block * CHANNELS + c;
        tint->luma = (float)(matrix[0] * last + mean * over);
        for (int i = 0; i < ROWS; i++)
            tint->series[i] = (float)blue * hue[i] + (float)red * hue[HUE + i];
        tint->level[0] = (float)(mean * base + blue * hue[ROWS] + red * hue[HUE + ROWS]);
        tint->level[1] = (float)(blue * correction[0][1] + red * correction[1][1]);
        tint->level[2] = (float)(blue * correction[0][2] + red * correction[1][2]);
    }
}

#endif
