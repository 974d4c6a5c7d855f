/* Blocks that mirror a lamp in the film are fitted once more, with shading of third degree. */
#ifndef ARLIGHT_BLOCK_LAMPS_H
#define ARLIGHT_BLOCK_LAMPS_H

#include "block_usable.h"

#define LAMP_DEVIATION 0.02 /* of a block's pixels from its stripes, relative to the brightest block's mean */

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
        /* of the 0th harmonic: one and nothing */
        const float *restrict last = columns + (k > 1 ? 2 * k - 3 : 0) * room, *restrict last_sine = last + room;
        for (int i = 0; i < steps; i++) {
            cosine[i] = k > 1 ? last[i] * c[i] - last_sine[i] * s[i] : c[i];
            sine[i] = k > 1 ? last_sine[i] * c[i] + last[i] * s[i] : s[i];
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
    return count + CURVED;
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

/* Products of the last CURVED - SLOPED of a fit's columns with all before them, and with light. The other ones follow
 * from sums over the block. */
static HOT void fill_curved(SmallFits *f, int l, int columns, const Pixels *p, int64_t room, const float *lists)
{
    int total = p->total;
    for (int i = columns - (CURVED - SLOPED); i < columns; i++) {
        float products[4];
        for (int j = 0; j <= i; j += 4) {
            multiply(total, lists + i * room, lists + j * room, room, products);
            for (int k = j; k < j + 4 && k <= i; k++)
                f->normal[i][k][l] = products[k - j];
        }
        multiply(total, lists + i * room, p->light, room, products);
        for (int k = 0; k < CHANNELS; k++)
            f->right[k][i][l] = products[k];
    }
}

/* Blocks of one number of harmonics that wait to be fitted together. */
typedef struct {
    SmallFits fits;
    int some;
    int32_t blocks[FITS];
    Sums sums[FITS];
    double brightest; /* of all blocks so far */
} Lamps;

/* Fits the blocks that wait. */
static void fit_lamps(const Blocks *b, Lamps *lamps)
{
    if (lamps->some == 0)
        return;
    fill_fits(&lamps->fits, lamps->sums, lamps->some, b->harmonics[lamps->blocks[0]], CURVED);
    solve_fits(&lamps->fits);
    keep_fits(b, &lamps->fits, lamps->blocks, lamps->some, lamps->sums);
    lamps->some = 0;
}

/* Has a block wait to be fitted with shading of third degree. */
static void add_lamp(const Blocks *b, int block, const Pixels *p, const Sums *sums, Lamps *lamps)
{
    if (lamps->some == FITS || (lamps->some && b->harmonics[block] != b->harmonics[lamps->blocks[0]]))
        fit_lamps(b, lamps);
    float *lists = b->lists + FIT_LISTS * b->room;
    int l = lamps->some++, columns = list_columns(b->harmonics[block], p, b->room, lists);
    fill_curved(&lamps->fits, l, columns, p, b->room, lists);
    lamps->sums[l] = *sums;
    lamps->blocks[l] = block;
}

static double largest_of(const double *values)
{
    return fmax(values[0], fmax(values[1], values[2]));
}

/* Has the blocks wait whose pixels stray from their stripes. What a straight slope leaves is as uneven as the slope. */
static void find_lamps(const Blocks *b, int at, int some, const Pixels *pixels, Lamps *lamps)
{
    const int32_t *order = b->order + at;
    for (int l = 0; l < some; l++)
        lamps->brightest = fmax(lamps->brightest, largest_of(b->values + (int64_t)order[l] * ROWS * CHANNELS));
    double limit = LAMP_DEVIATION * lamps->brightest;
    for (int l = 0; l < some; l++) {
        double *variance = b->variance + (int64_t)order[l] * CHANNELS;
        if (!(largest_of(variance) > limit * limit))
            continue;
        for (int c = 0; c < CHANNELS; c++)
            b->shading[(int64_t)order[l] * CHANNELS + c] += sqrt(variance[c]);
        add_lamp(b, order[l], pixels + l, b->sums + at + l, lamps);
    }
}

#endif
