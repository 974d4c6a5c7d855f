/* Robust weighted least squares of one colour channel: weights, blur and solution are refined together. */
#ifndef ARLIGHT_CHANNEL_PASSES_H
#define ARLIGHT_CHANNEL_PASSES_H

#include "channel_fit.h"
#include "error_scale.h"
#include "sheet_match.h"

#define FIRST_SPARKLE 0.02 /* usual deviation of what a block mirrors by itself while nothing is known, relative to
                              white: wide enough that no lamp pulls the solution before it is recognised */

/* Room that a fit needs [planes]. */
EXPORT const int64_t channel_planes = PLANES;

/* Rows that light and all reflections predict, and the reflections. */
static HOT void predict(const ChannelFit *f, double mean)
{
    const int64_t n = f->m->stride;
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        lanes rows[ROWS], extra = at(f, EXTRA, b);
        lit_rows(f, b, mean, rows);
        for (int r = 0; r < ROWS; r++)
            store(f->predicted + (f->channel * ROWS + r) * n + b, rows[r] + at(f, MIRROR + r, b) * extra);
        store(f->reflection + f->channel * n + b, at(f, FIELD, b) * load(f->m->face + b) + extra);
    }
}

/* Turns to a channel; red and blue start from what green found. */
static void turn_to(ChannelFit *f, int64_t channel)
{
    const int64_t n = f->m->stride;
    const double share = f->m->white[channel] / f->m->white[GREEN];
    f->channel = channel;
    f->nuisance = f->nuisances + channel * NUISANCES;
    f->scale = f->scales + 2 * channel;
    f->lamp = f->lamps + channel * n;
    f->weight = f->weights + channel * n;
    if (channel == GREEN)
        return;
    for (int k = 0; k < NUISANCES; k++)
        f->nuisance[k] = f->nuisances[GREEN * NUISANCES + k];
    for (int64_t i = 0; i < n; i++) {
        f->lamp[i] = share * share * f->lamps[GREEN * n + i];
        f->weight[i] = f->weights[GREEN * n + i];
    }
}

/* Lamps and weights of green where nothing is known of them. */
static void forget(ChannelFit *f)
{
    turn_to(f, GREEN);
    const double white = white_of(f), wide = FIRST_SPARKLE * FIRST_SPARKLE * white * white;
    expect_lamps(f);
    for (int64_t i = 0; i < f->m->stride; i++) {
        f->lamp[i] = fmax(plane(f, ORDINARY)[i], wide);
        f->weight[i] = 1.0;
    }
}

/* As in prior.h, for arrays. */
EXPORT double color_spread(int64_t n, const double *colorful, double irradiance, const double *difference,
                           const double *variance, double last)
{
    return next_color_spread(n, colorful, irradiance, difference, variance, 1, last);
}

/* Looks for so many amplitudes of the reflection. */
static void look_for(ChannelFit *f, int64_t amplitudes)
{
    f->field = amplitudes;
    f->width = (amplitudes + 2 + LANES - 1) / LANES * LANES;
}

/* Fits a channel; green comes first. Weights and solution are refined `passes` times, and the nuisance with the last,
   or with each. */
EXPORT void fit_channel(ChannelFit *f, int64_t channel, int64_t passes, int64_t settle)
{
    turn_to(f, channel);
    double *packed = f->packed + f->channel * coefficients(f);
    Step step;
    row_noise(f);
    expect_lamps(f);
    expect_light(f);
    expect_pattern(f);
    for (int64_t pass = 0; pass < passes; pass++) {
        int whole = settle || pass == passes - 1;
        look_for(f, whole && channel == GREEN ? f->modes : f->coarse);
        row_model(f);
        block_equations(f);
        solve_shared(f, packed);
        miss(f, packed[0], 0);
        if (whole)
            step_nuisance(f, packed, &step);
        reweigh(f);
    }
    predict(f, packed[0]);
    f->chi2 = chi_square(f);
    f->unexplained = f->channel == GREEN ? unexplained_share(f) : NAN;
    share_fields(f);
    whiten_fields(f);
    light_covariance(f, packed, &step);
    error_scales(f);
    if (f->channel == GREEN)
        return;
    f->spreads[f->channel] = spread_of_colors(f, packed);
    if (!f->m->whole)
        for (int k = 0; k < 2; k++)
            f->scale[k] = fmax(f->scale[k], 1.0);
}

#endif
