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
static void read_chroma(const Blocks *b, int count, int limited, Chroma *chroma)
{
    Grid grid = grid_of(b, 1);
    for (int at = 0; at < count; at++)
        sum_cells(b, b->order[at], &grid, limited, b->sums + at, chroma + at);
}

/* Brings shared chroma to every pixel: coefficients of each block's colour. */
static void infer_colour(const Blocks *b, int count)
{
    Chroma chroma[count ? count : 1];
    predict_hues(b, count);
    read_chroma(b, count, 1, chroma);
    for (int at = 0, some; at < count; at += some) {
        some = alike(b, at, count);
        fit_cells(b, b->order + at, some, b->sums + at, chroma + at);
    }
    Stream stream = observe_stream(b, count, chroma);
    for (int at = 0; at < count; at++) {
        double correction[2][3];
        b->trust[b->order[at]] = correct(&stream, chroma + at, correction);
        mix_tints(b, b->order[at], chroma + at, correction);
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
    if (over) {
        Sums all;
        sum_block(0, p.total, p.cosine, p.sine, p.x, p.y, p.light, b->room, &all);
        average_look(b, block, &all);
        leave_out(&p, b->room, ceiling);
    }
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
        if (p.total > 0 && p.total == b->gathered[b->order[at]])
            average_look(b, b->order[at], b->sums + at);
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
        fill_fits(&fits, b->sums + at, some, b->harmonics[b->order[at]], 1);
        for (int l = 0; l < some; l++) {
            used[l] = (int)b->sums[at + l].cosine[0];
            memcpy(squares[l], b->sums[at + l].squares, sizeof squares[l]);
        }
        solve_fits(&fits);
        keep_fits(b, &fits, b->order + at, some, used, (const float(*)[CHANNELS])squares);
    }
}

/* Lists of the columns of a fit with cubic shading: the waves, then the place's monomials, even ones less their mean
 * over the window. Returns their number. */
static HOT int list_columns(int harmonics, const Pixels *p, int64_t room, float *columns)
{
    const float *restrict c = p->cosine, *restrict s = p->sine, *restrict x = p->x, *restrict y = p->y;
    int steps = whole_steps(p->total) & -STEP, count = 2 * harmonics + 1;
    for (int i = 0; i < steps; i++)
        columns[i] = i < p->total ? 1.0f : 0.0f;
    for (int k = 1; k <= harmonics; k++) {
        float *restrict cosine = columns + (2 * k - 1) * room, *restrict sine = cosine + room;
        const float *restrict last_c = k > 1 ? cosine - 2 * room : columns, *restrict last_s = k > 1 ? sine - 2 * room : s;
        for (int i = 0; i < steps; i++) {
            cosine[i] = k > 1 ? last_c[i] * c[i] - last_s[i] * s[i] : c[i];
            sine[i] = k > 1 ? last_s[i] * c[i] + last_c[i] * s[i] : s[i];
        }
    }
    float *restrict out = columns + count * room;
    for (int i = 0; i < steps; i++) {
        float u = x[i], v = y[i], third = columns[i] / 3.0f;
        out[i] = u, out[room + i] = v;
        out[2 * room + i] = u * u - third, out[3 * room + i] = u * v, out[4 * room + i] = v * v - third;
        out[5 * room + i] = u * u * u, out[6 * room + i] = u * u * v;
        out[7 * room + i] = u * v * v, out[8 * room + i] = v * v * v;
    }
    return count + 9;
}

/* Products of a list with four others, `room` apart. */
INLINE void multiply(int total, const float *restrict a, const float *restrict b, int64_t room, float products[4])
{
    const float *restrict second = b + room, *restrict third = second + room, *restrict fourth = third + room;
    float sums[4] = {0.0f};
    int steps = (total + STEP - 1) & -STEP;
    for (int i = 0; i < steps; i++) {
        sums[0] += a[i] * b[i];
        sums[1] += a[i] * second[i];
        sums[2] += a[i] * third[i];
        sums[3] += a[i] * fourth[i];
    }
    for (int k = 0; k < 4; k++)
        products[k] = sums[k];
}

/* Products of the columns with each other and with the values, of one fit; lists: columns, then values. */
static HOT void fill_cubic(SmallFits *f, int l, int total, int64_t room, const float *lists, float squares[CHANNELS])
{
    int columns = f->columns, all = columns + CHANNELS;
    for (int i = 0; i < all; i++)
        for (int j = i; j < all; j += 4) {
            float products[4];
            multiply(total, lists + i * room, lists + j * room, room, products);
            for (int k = j; k < j + 4 && k < all; k++) {
                if (k < columns)
                    f->normal[k][i][l] = products[k - j];
                else if (i < columns)
                    f->right[k - columns][i][l] = products[k - j];
                else if (k == i)
                    squares[k - columns] = products[k - j];
            }
        }
}

/* Makes a fit the same as the first. */
static void repeat_fit(SmallFits *f, int l)
{
    for (int i = 0; i < f->columns; i++) {
        for (int j = 0; j <= i; j++)
            f->normal[i][j][l] = f->normal[i][j][0];
        for (int c = 0; c < f->rights; c++)
            f->right[c][i][l] = f->right[c][i][0];
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
    int32_t blocks[FITS];
    for (int l = 0; l < some; l++) {
        blocks[l] = b->order[order[l]];
        Pixels p = usable_pixels(b, order[l], &grid, level, NULL);
        float *lists = list_of(b, LISTS);
        fits.columns = list_columns(b->harmonics[blocks[l]], &p, b->room, lists);
        memcpy(lists + fits.columns * b->room, p.light, (size_t)(CHANNELS * b->room) * sizeof *lists);
        fill_cubic(&fits, l, p.total, b->room, lists, squares[l]);
        used[l] = p.total;
    }
    for (int l = some; l < FITS; l++)
        repeat_fit(&fits, l);
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
    read_chroma(b, count, 0, chroma);
    for (int at = 0; at < count; at++) {
        memcpy(b->mean_code + 3 * b->order[at], chroma[at].mean, sizeof chroma[at].mean);
        b->gathered[b->order[at]] = (int32_t)b->sums[at].cosine[0];
    }
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
    fit_blocks(b, count);
    treat_lamps(b, count, level, uneven);
    finish(b, uneven);
}
