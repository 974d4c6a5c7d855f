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
    const int64_t n = f->m->stride, blocks = f->m->blocks, columns = (blocks + 7) / 8 * 8;
    for (int64_t i = 0; i < columns; i++)
        for (int64_t j = 0; j <= f->field; j++)
            f->fields[j * n + i] = i < blocks && j < f->field ? f->field_rows[i * f->width + j] : 0.0;
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
    const int64_t n = f->m->stride;
    for (int64_t k = 0; k <= f->field; k++) {
        double *row = f->certainty + k * f->wide;
        row[0] = k == f->field ? 1.0 / f->shared[k * (f->width + 1)] : 0.0;
        for (int64_t i = coefficients(f); i < f->wide; i++)
            row[i] = 0.0;
    }
    for (int64_t g = 1; g <= f->frequencies; g++) {
        const double *real = plane(f, SHARES), *imaginary = plane(f, SHARES + 1);
        double mean[2];
        share_of_mean(f, g, mean);
        for (int64_t k = 0; k <= f->field; k++) {
            double *row = f->certainty + k * f->wide, x = mean[0] * row[0], y = mean[1] * row[0];
            for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
                x += real[i] * f->fields[k * n + i];
                y += imaginary[i] * f->fields[k * n + i];
            }
            row[2 * g - 1] = x;
            row[2 * g] = y;
        }
    }
}

/* Fills the channel's covariance. */
static HOT void light_covariance(const ChannelFit *f, const double *packed, const Step *s)
{
    const int64_t n = coefficients(f), rows = f->field + 1;
    double *result = f->covariance + f->channel * n * n;
    certainty_of_shared(f);
    for (int64_t i = 0; i < f->wide; i++) {
        int64_t within = i < n;
        for (int k = 0; k < NUISANCES; k++) {
            double sum = 0.0;
            for (int l = 0; l <= k && within; l++)
                sum += s->doubt[k][l] * f->carried_light[i * WIDE + l];
            f->certainty[(rows + k) * f->wide + i] = sum;
        }
        f->certainty[(rows + NUISANCES) * f->wide + i] = within ? GAIN_DOUBT * packed[i] : 0.0;
    }
    for (int64_t i = 0; i < f->wide * f->wide; i++)
        f->products[i] = 0.0;
    add_products(rows + NUISANCES + 1, f->wide, f->certainty, f->wide, 1.0, f->products, f->wide);
    for (int64_t g = 1; g <= f->frequencies; g++) {
        const double *own = of_frequency(f, g);
        double *at_own = f->products + (2 * g - 1) * (f->wide + 1);
        at_own[0] += own[INVERSE];
        at_own[1] += own[INVERSE + 1];
        at_own[f->wide + 1] += own[INVERSE + 2];
    }
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = i; j < n; j++)
            result[i * n + j] = result[j * n + i] = f->products[i * f->wide + j];
}

#endif
