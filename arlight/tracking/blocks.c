/* The blocks of one frame: means, and harmonics of their stripes, in linear light. */
#include <string.h>

#include "block_light.h"
#include "block_view.h"

#define BRIGHTEST_STRIPE 1.1   /* light that no stripe reaches, relative to white: brighter is a lamp in the film */
#define LAMP_OVER_AVERAGE 1.5  /* light over its block's mean from which a pixel beyond white shows a lamp */
#define LAMP_DEVIATION 0.02    /* deviation of a block's pixels from its stripes, relative to the brightest block */
#define UNCLIPPED_SHARE 0.35
#define LEAST_SAMPLES 24
#define MOST_WHITES 256

/* Lists the blocks to measure: white ones first, then by harmonics. Returns their number. */
static int put_in_order(const Blocks *b, int *whites)
{
    int count = 0;
    for (int key = -1; key <= HARMONICS; key++) {
        for (int i = 0; i < b->blocks; i++) {
            int white = (b->flags[i] & WHITE) != 0;
            if ((b->flags[i] & WANTED) && b->seen[i] && (white ? key == -1 : key == b->harmonics[i]))
                b->order[count++] = i;
        }
        if (key == -1)
            *whites = count;
    }
    return count;
}

/* Reads the cells of all blocks; chroma: by place in the order. */
static void read_chroma(const Blocks *b, int count, Chroma *chroma)
{
    Grid grid = grid_of(b, 1);
    for (int at = 0; at < count; at++) {
        double mean[3];
        float darkest;
        sum_cells(b, b->order[at], &grid, b->sums + at, mean, &darkest);
        memcpy(b->mean_code + 3 * b->order[at], mean, sizeof mean);
        b->gathered[b->order[at]] = (int32_t)b->sums[at].cosine[0];
        chroma[at].mean_luma = mean[0];
        chroma[at].darkest = darkest;
    }
}

/* Brings shared chroma to every pixel: coefficients of each block's colour. */
static void infer_colour(const Blocks *b, int count)
{
    Chroma chroma[count ? count : 1];
    read_chroma(b, count, chroma);
    predict_hues(b, count);
    for (int at = 0, some; at < count; at += some) {
        some = alike(b, at, count);
        fit_cells(b, b->order + at, some, b->sums + at, chroma + at);
    }
    Stream stream = observe_stream(b, count, chroma);
    for (int at = 0; at < count; at++) {
        double correction[2][3];
        b->trust[b->order[at]] = correct(&stream, chroma + at, correction);
        mix_colour(b, b->order[at], chroma + at, correction);
    }
}

static void sort(float *values, int count)
{
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && values[j] < values[j - 1]; j--) {
            float value = values[j];
            values[j] = values[j - 1];
            values[j - 1] = value;
        }
}

/* Lower quartile of the white blocks' means: some may mirror a lamp themselves. 0 without white blocks. */
static float white_level(const float (*mean)[CHANNELS], int whites, int channel)
{
    float values[MOST_WHITES];
    int count = whites < MOST_WHITES ? whites : MOST_WHITES;
    for (int i = 0; i < count; i++)
        values[i] = mean[i][channel];
    sort(values, count);
    float at = 0.25f * (float)(count - 1);
    int below = (int)at;
    return count == 0 ? 0.0f : values[below] + (at - (float)below) * (values[below + (below + 1 < count)] - values[below]);
}

/* Lists a block's pixels without those that show a lamp. level: of white, 0 where it is not known; mean: of all the
 * pixels, where it is asked for. */
static Pixels usable_pixels(const Blocks *b, int at, const Grid *grid, const float level[CHANNELS], float *mean)
{
    int block = b->order[at], over = 0;
    Pixels p = light_pixels(b, block, grid);
    float ceiling[CHANNELS];
    b->gathered[block] = p.total;
    for (int c = 0; c < CHANNELS; c++) {
        if (mean)
            mean[c] = mean_light(&p, b->room, c);
        int known = level[c] > 0.0f && !(b->flags[block] & WHITE);
        float largest = b->light[p.largest[c]], lifted = (float)BRIGHTEST_STRIPE * level[c];
        /* an evenly bright mirror image, the sky's at grazing view, lifts its block's stripes and hides none */
        if (known && largest > lifted)
            lifted = fmaxf(lifted, (float)LAMP_OVER_AVERAGE * mean_light(&p, b->room, c));
        ceiling[c] = known && lifted < (float)b->clip ? lifted : (float)b->clip;
        over |= largest > ceiling[c];
    }
    if (over)
        leave_out(&p, b->room, ceiling);
    return p;
}

/* Sums over the usable pixels of every block; level: of white. */
static void sum_blocks(const Blocks *b, int whites, int count, float level[CHANNELS])
{
    Grid grid = grid_of(b, 0);
    float mean[MOST_WHITES][CHANNELS];
    int known = 0;
    for (int c = 0; c < CHANNELS; c++)
        level[c] = 0.0f;
    for (int at = 0; at < count; at++) {
        if (at == whites)
            for (int c = 0; c < CHANNELS; c++)
                level[c] = white_level((const float(*)[CHANNELS])mean, known, c);
        int white = at < whites && known < MOST_WHITES;
        Pixels p = usable_pixels(b, at, &grid, level, white ? mean[known] : NULL);
        sum_block(b->harmonics[b->order[at]], p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, b->sums + at);
        known += white && b->gathered[b->order[at]] >= LEAST_SAMPLES;
    }
}

/* Writes some blocks' fits out. used: pixels of each; squares: of their values. */
static void keep_fits(const Blocks *b, const SmallFits *fits, const int32_t *order, int some, const int *used,
                      const float (*squares)[CHANNELS])
{
    int kept = 1 + 2 * b->harmonics[order[0]];
    for (int l = 0; l < some; l++) {
        int64_t block = order[l];
        double *values = b->values + block * ROWS * CHANNELS, *covariance = b->covariance + block * ROWS * ROWS;
        memset(values, 0, ROWS * CHANNELS * sizeof *values);
        memset(covariance, 0, ROWS * ROWS * sizeof *covariance);
        memset(b->variance + block * CHANNELS, 0, CHANNELS * sizeof *values);
        b->samples[block] = 0;
        if (used[l] < 2 * fits->columns || fits->regular[l] == 0.0)
            continue;
        b->samples[block] = used[l];
        for (int c = 0; c < CHANNELS; c++) {
            for (int i = 0; i < kept; i++)
                values[i * CHANNELS + c] = fits->solved[c][i][l];
            double left = squares[l][c] - fits->explained[c][l];
            b->variance[block * CHANNELS + c] = fmax(left, 0.0) / (used[l] - fits->columns);
            b->shading[block * CHANNELS + c] = hypot(fits->solved[c][kept][l], fits->solved[c][kept + 1][l]);
        }
        for (int i = 0; i < kept; i++)
            for (int j = 0; j <= i; j++)
                covariance[i * ROWS + j] = covariance[j * ROWS + i] = fits->inverse[i][j][l];
    }
}

static void fit_blocks(const Blocks *b, int count)
{
    SmallFits fits;
    fits.rights = CHANNELS;
    for (int at = 0, some; at < count; at += some) {
        int used[FITS];
        float squares[FITS][CHANNELS];
        some = alike(b, at, count);
        for (int l = 0; l < FITS; l++) {
            const Sums *sums = b->sums + at + (l < some ? l : 0);
            fill_fit(&fits, l, b->harmonics[b->order[at]], sums);
            used[l] = (int)sums->cosine[0];
            memcpy(squares[l], sums->squares, sizeof squares[l]);
        }
        solve_fits(&fits);
        keep_fits(b, &fits, b->order + at, some, used, (const float(*)[CHANNELS])squares);
    }
}

/* Cubic shading: the columns' products, of one fit. The place's monomials come after the waves. */
static HOT void fill_cubic(SmallFits *f, int l, int harmonics, Pixels *p, int64_t room, float *columns, float squares[CHANNELS])
{
    int waves = 2 * harmonics + 1, count = waves + 9, steps = whole_steps(p->total);
    f->columns = count;
    for (int i = 0; i < steps; i++) {
        float x = p->x[i], y = p->y[i], there = i < p->total ? 1.0f : 0.0f, c = p->cosine[i], s = p->sine[i];
        float *at = columns + i, ck = c, sk = s;
        *at = there, at += room;
        for (int k = 1; k <= harmonics; k++) {
            *at = ck, at += room;
            *at = sk, at += room;
            float next = ck * c - sk * s;
            sk = sk * c + ck * s;
            ck = next;
        }
        float term[9] = {x, y, (x * x - 1.0f / 3.0f) * there, x * y, (y * y - 1.0f / 3.0f) * there, x * x * x, x * x * y, x * y * y, y * y * y};
        for (int k = 0; k < 9; k++, at += room)
            *at = term[k];
    }
    for (int a = 0; a < count; a++) {
        const float *left = columns + a * room;
        for (int k = 0; k <= a + CHANNELS; k++) {
            const float *right = k <= a ? columns + k * room : p->light + (k - a - 1) * room;
            float sum = 0.0f;
            for (int i = 0; i < steps; i++)
                sum += left[i] * right[i];
            *(k <= a ? &f->normal[a][k][l] : &f->right[k - a - 1][a][l]) = sum;
        }
    }
    for (int c = 0; c < CHANNELS; c++) {
        const float *light = p->light + c * room;
        float sum = 0.0f;
        for (int i = 0; i < steps; i++)
            sum += light[i] * light[i];
        squares[c] = sum;
    }
}

/* Blocks that mirror a lamp in the film are fitted once more with a shading of third degree. */
static void fit_lamps(const Blocks *b, const int32_t *order, int some, const float level[CHANNELS])
{
    SmallFits fits;
    fits.rights = CHANNELS;
    Grid grid = grid_of(b, 0);
    int used[FITS];
    float squares[FITS][CHANNELS];
    for (int l = 0; l < FITS; l++) {
        int at = l < some ? l : 0;
        Pixels p = usable_pixels(b, order[at], &grid, level, NULL);
        fill_cubic(&fits, l, b->harmonics[b->order[order[at]]], &p, b->room, list_of(b, 12), squares[l]);
        used[l] = p.total;
    }
    int32_t blocks[FITS];
    for (int l = 0; l < some; l++)
        blocks[l] = b->order[order[l]];
    solve_fits(&fits);
    keep_fits(b, &fits, blocks, some, used, (const float(*)[CHANNELS])squares);
}

static double largest_of(const double *values)
{
    return fmax(values[0], fmax(values[1], values[2]));
}

/* Refits the blocks whose pixels stray from their stripes. What a straight slope leaves is as uneven as the slope. */
static void treat_lamps(const Blocks *b, int count, const float level[CHANNELS], double *uneven)
{
    double brightest = 1e-6;
    for (int at = 0; at < count; at++)
        brightest = fmax(brightest, largest_of(b->values + (int64_t)b->order[at] * ROWS * CHANNELS));
    double limit = LAMP_DEVIATION * brightest;
    int32_t lamps[FITS];
    int some = 0;
    memcpy(uneven, b->shading, (size_t)b->blocks * CHANNELS * sizeof *uneven);
    for (int at = 0; at <= count; at++) {
        int lamp = at < count && largest_of(b->variance + (int64_t)b->order[at] * CHANNELS) > limit * limit;
        int full = some && (at == count || some == FITS || (lamp && b->harmonics[b->order[at]] != b->harmonics[b->order[lamps[0]]]));
        if (full) {
            fit_lamps(b, lamps, some, level);
            some = 0;
        }
        if (!lamp)
            continue;
        int64_t block = b->order[at];
        for (int c = 0; c < CHANNELS; c++)
            uneven[block * CHANNELS + c] += sqrt(b->variance[block * CHANNELS + c]);
        lamps[some++] = at;
    }
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
    double left = (fabs(along_x) > 1e-4 ? sin(along_x) / along_x : 1.0) * (fabs(along_y) > 1e-4 ? sin(along_y) / along_y : 1.0);
    left -= by_x * by_y * (xy - x * y);
    b->phasor[2 * block] = left * cos(mean[0]);
    b->phasor[2 * block + 1] = -left * sin(mean[0]);
    b->cosine[block] = mean[1];
}

/* Everything in units of light without vignetting. */
static void finish(const Blocks *b, const double *uneven)
{
    int64_t n = b->blocks;
    for (int64_t i = 0; i < n; i++) {
        double over = 1.0 / b->gain[i];
        for (int k = 0; k < ROWS * CHANNELS; k++)
            b->values[i * ROWS * CHANNELS + k] *= over;
        for (int c = 0; c < CHANNELS; c++) {
            b->variance[i * CHANNELS + c] *= over * over;
            b->shading[i * CHANNELS + c] = uneven[i * CHANNELS + c] * over;
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

/* Mean codes of all blocks where chroma is shared, and how many cells they are of. */
EXPORT void survey_blocks(const Blocks *b)
{
    int whites;
    clear_results(b);
    view_blocks(b);
    int count = put_in_order(b, &whites);
    Chroma chroma[count ? count : 1];
    read_chroma(b, count, chroma);
}

EXPORT void measure_blocks(const Blocks *b)
{
    int whites;
    float level[CHANNELS];
    double uneven[b->blocks * CHANNELS];
    clear_results(b);
    view_blocks(b);
    int count = put_in_order(b, &whites);
    if (b->shift_x > 0 || b->shift_y > 0)
        infer_colour(b, count);
    sum_blocks(b, whites, count, level);
    for (int at = 0; at < count; at++)
        if (b->sums[at].cosine[0] > 0.0f)
            average_look(b, b->order[at], b->sums + at);
    fit_blocks(b, count);
    treat_lamps(b, count, level, uneven);
    finish(b, uneven);
}
