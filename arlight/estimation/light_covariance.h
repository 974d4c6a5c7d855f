/* How certain a channel's coefficients are: the frequencies' own certainty, what the shared unknowns and the nuisance
   take of it, and what scales the whole measurement. */
#ifndef ARLIGHT_LIGHT_COVARIANCE_H
#define ARLIGHT_LIGHT_COVARIANCE_H

#include "frame_nuisance.h"

#define GAIN_DOUBT 0.01 /* relative error of all that a sheet measures: of the paper's reflectance, the film's and the
                           glass's transmittance */

/* Fills `fields`: every block's field and, in the row beyond, L_0, whitened by the shared unknowns' factor, so that
   products of columns are covariances. */
static HOT void whiten_fields(const ChannelFit *f)
{
    const int64_t n = f->m->stride, columns = (f->m->blocks + 2 * LANES - 1) / (2 * LANES) * (2 * LANES);
    for (int64_t j = 0; j <= f->field; j++)
        for (int64_t b = 0; b < columns; b += LANES)
            store(f->fields + j * n + b, j < f->field ? load(f->basis_planes + j * n + b) : splat(0.0));
    substitute_forward(f->field + 1, f->shared, f->width, f->fields, n, columns);
}

/* Fills SHARES: minus the inverse of a frequency's own matrix times its products with its blocks' fields. */
static void share_fields(const ChannelFit *f)
{
    for (int64_t g = 1; g <= f->frequencies; g++) {
        const double *own = of_frequency(f, g);
        for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
            double x = gram(f, WITH_MIRROR + 1, i), y = gram(f, WITH_MIRROR + 2, i);
            plane(f, SHARES)[i] = -own[INVERSE] * x - own[INVERSE + 1] * y;
            plane(f, SHARES + 1)[i] = -own[INVERSE + 1] * x - own[INVERSE + 2] * y;
        }
    }
}

/* The same of L_0. */
INLINE void share_of_mean(const ChannelFit *f, int64_t g, double *share)
{
    const double *own = of_frequency(f, g);
    share[0] = -own[INVERSE] * own[WITH_MEAN] - own[INVERSE + 1] * own[WITH_MEAN + 1];
    share[1] = -own[INVERSE + 1] * own[WITH_MEAN] - own[INVERSE + 2] * own[WITH_MEAN + 1];
}

/* Rows of `certainty` from the shared unknowns; the row of L_0 alone comes last. */
static HOT void certainty_of_shared(const ChannelFit *f)
{
    const int64_t n = f->m->stride, wide = f->wide;
    const double *real = plane(f, SHARES), *imaginary = plane(f, SHARES + 1);
    double *last = f->certainty + f->field * wide;
    for (int64_t k = 0; k <= f->field; k++) {
        f->certainty[k * wide] = 0.0;
        for (int64_t i = coefficients(f); i < wide; i++)
            f->certainty[k * wide + i] = 0.0;
    }
    for (int64_t g = 1; g <= f->frequencies; g++) {
        double *to = f->certainty + 2 * g - 1;
        for (int64_t k = 0; k <= f->field; k++) {
            const double *fields = f->fields + k * n;
            double x = 0.0, y = 0.0;
            for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
                x += real[i] * fields[i];
                y += imaginary[i] * fields[i];
            }
            to[k * wide] = x;
            to[k * wide + 1] = y;
        }
    }
    last[0] = 1.0 / f->shared[f->field * (f->width + 1)];
    for (int64_t g = 1; g <= f->frequencies; g++) {
        double mean[2];
        share_of_mean(f, g, mean);
        last[2 * g - 1] += mean[0] * last[0];
        last[2 * g] += mean[1] * last[0];
    }
}

/* Rows of `certainty` from the nuisance and from what scales all; returns how many rows there are together. */
static HOT int64_t certainty_beside(const ChannelFit *f, const double *packed, const Step *s)
{
    const int64_t n = coefficients(f);
    double *rows = f->certainty + (f->field + 1) * f->wide;
    for (int64_t i = 0; i < (NUISANCES + 1) * f->wide; i++)
        rows[i] = 0.0;
    for (int64_t i = 0; i < n; i++) {
        const double *moved = f->carried_light + i * WIDE;
        for (int k = 0; k < NUISANCES; k++) {
            double sum = 0.0;
            for (int l = 0; l <= k; l++)
                sum += s->doubt[k][l] * moved[l];
            rows[k * f->wide + i] = sum;
        }
        rows[NUISANCES * f->wide + i] = GAIN_DOUBT * packed[i];
    }
    return f->field + 1 + NUISANCES + 1;
}

/* Writes a symmetric matrix (n, n) from its upper tiles of four by four. */
static HOT void unfold(int64_t n, const double *upper, int64_t stride, double *whole)
{
    for (int64_t i = 0; i < n; i += LANES)
        for (int64_t j = i; j < n; j += LANES) {
            int64_t rows = n - i < LANES ? n - i : LANES, columns = n - j < LANES ? n - j : LANES;
            lanes tile[LANES];
            for (int r = 0; r < LANES; r++)
                tile[r] = load(upper + (i + r) * stride + j);
            if (rows == LANES && columns == LANES) {
                for (int r = 0; r < LANES; r++)
                    store(whole + (i + r) * n + j, tile[r]);
                transpose(tile);
                for (int r = 0; r < LANES; r++)
                    store(whole + (j + r) * n + i, tile[r]);
                continue;
            }
            for (int64_t r = 0; r < rows; r++)
                for (int64_t c = 0; c < columns; c++)
                    whole[(i + r) * n + j + c] = whole[(j + c) * n + i + r] = tile[r][c];
        }
}

/* Fills the channel's covariance. */
static HOT void light_covariance(const ChannelFit *f, const double *packed, const Step *s)
{
    const int64_t n = coefficients(f);
    certainty_of_shared(f);
    int64_t rows = certainty_beside(f, packed, s);
    for (int64_t i = 0; i < f->wide * f->wide; i++)
        f->products[i] = 0.0;
    add_products(rows, f->wide, f->certainty, f->wide, 1.0, f->products, f->wide);
    for (int64_t g = 1; g <= f->frequencies; g++) {
        const double *own = of_frequency(f, g);
        double *at_own = f->products + (2 * g - 1) * (f->wide + 1);
        at_own[0] += own[INVERSE];
        at_own[1] += own[INVERSE + 1];
        at_own[f->wide] += own[INVERSE + 1];
        at_own[f->wide + 1] += own[INVERSE + 2];
    }
    unfold(n, f->products, f->wide, f->covariance + f->channel * n * n);
}

#endif
