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

/* Blocks of one number of harmonics that wait to be fitted together. */
typedef struct {
    SmallFits fits;
    int some, used[FITS]; /* pixels of each */
    int32_t blocks[FITS];
    float squares[FITS][CHANNELS];
    double brightest; /* of all blocks so far */
} Lamps;

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

/* Fits the blocks that wait. */
static void fit_lamps(const Blocks *b, Lamps *lamps)
{
    if (lamps->some == 0)
        return;
    for (int l = lamps->some; l < FITS; l++)
        repeat_fit(&lamps->fits, l);
    solve_fits(&lamps->fits);
    keep_fits(b, &lamps->fits, lamps->blocks, lamps->some, lamps->used, (const float(*)[CHANNELS])lamps->squares);
    lamps->some = 0;
}

/* Has a block wait to be fitted with shading of third degree. */
static void add_lamp(const Blocks *b, int block, const Pixels *p, Lamps *lamps)
{
    if (lamps->some == FITS || (lamps->some && b->harmonics[block] != b->harmonics[lamps->blocks[0]]))
        fit_lamps(b, lamps);
    float *lists = b->lists + FIT_LISTS * b->room;
    int l = lamps->some++, columns = list_columns(b->harmonics[block], p, b->room, lists);
    memcpy(lists + columns * b->room, p->light, (size_t)(CHANNELS * b->room) * sizeof *lists);
    lamps->fits.columns = columns, lamps->fits.rights = CHANNELS;
    fill_cubic(&lamps->fits, l, p->total, b->room, lists, lamps->squares[l]);
    lamps->used[l] = p->total;
    lamps->blocks[l] = block;
}

static double largest_of(const double *values)
{
    return fmax(values[0], fmax(values[1], values[2]));
}

/* Has the blocks wait whose pixels stray from their stripes. What a straight slope leaves is as uneven as the slope. */
static void find_lamps(const Blocks *b, const int32_t *order, int some, const Pixels *pixels, Lamps *lamps)
{
    for (int l = 0; l < some; l++)
        lamps->brightest = fmax(lamps->brightest, largest_of(b->values + (int64_t)order[l] * ROWS * CHANNELS));
    double limit = LAMP_DEVIATION * lamps->brightest;
    for (int l = 0; l < some; l++) {
        double *variance = b->variance + (int64_t)order[l] * CHANNELS;
        if (!(largest_of(variance) > limit * limit))
            continue;
        for (int c = 0; c < CHANNELS; c++)
            b->shading[(int64_t)order[l] * CHANNELS + c] += sqrt(variance[c]);
        add_lamp(b, order[l], pixels + l, lamps);
    }
}

#endif
