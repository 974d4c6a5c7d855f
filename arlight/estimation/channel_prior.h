/* What is expected of a channel's light before it is fitted: nothing of green, green's own of red and blue. */
#ifndef ARLIGHT_CHANNEL_PRIOR_H
#define ARLIGHT_CHANNEL_PRIOR_H

#include "channel_fit.h"
#include "prior.h"

#define EXTRA_TO_SHADING 0.5 /* what a block mirrors by itself, relative to how uneven it is: lamps have halos */
#define EVEN 0.005           /* slope that noise and codec give an even block, relative to white */
#define SPARKLE 0.0008       /* usual deviation of what a block mirrors by itself, relative to white */

/* Fills `expected` and `certain`. */
static void expect_light(const ChannelFit *f)
{
    const double white = white_of(f), irradiance = fmax(white / f->white_per_irradiance, DARKEST_IRRADIANCE);
    const double share = white / f->m->white[GREEN];
    const int64_t n = coefficients(f);
    const double *green = f->packed + GREEN * n, *doubt = f->covariance + GREEN * n * n;
    for (int64_t i = 0; i < n; i++) {
        double deviation = i ? f->spread[i] * irradiance : f->spread[0];
        f->expected[i] = 0.0;
        if (f->channel != GREEN) {
            f->expected[i] = share * green[i];
            deviation = i ? f->colorful[i] * irradiance * f->spreads[f->channel] : f->colorful[0];
            f->certain[i] = 1.0 / (deviation * deviation + share * share * doubt[i * (n + 1)]);
        } else
            f->certain[i] = 1.0 / (deviation * deviation);
    }
}

/* How far the light's colours spread, as this frame has it. */
static double spread_of_colors(const ChannelFit *f, const double *packed)
{
    const int64_t n = coefficients(f);
    const double *green = f->packed + GREEN * n;
    const double share = packed[0] / fmax(green[0], 1e-6);
    for (int64_t i = 0; i < n; i++)
        f->expected[i] = packed[i] - share * green[i];
    const double *variance = f->covariance + f->channel * n * n;
    return next_color_spread(n, f->colorful, packed[0], f->expected, variance, n + 1, f->spreads[f->channel]);
}

/* Red and blue have green's whole reflection for a pattern of their field; green has none. */
static void expect_pattern(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    const double *green = f->reflection + GREEN * m->stride;
    double *pattern = f->basis_planes + m->stride, sum = 0.0, squares = 0.0;
    for (int64_t i = 0; i < m->blocks && f->channel != GREEN; i++)
        sum += green[i];
    const double mean = sum / (double)m->blocks;
    for (int64_t i = 0; i < m->blocks && f->channel != GREEN; i++)
        squares += (green[i] - mean) * (green[i] - mean);
    const double scale = 1.0 / fmax(sqrt(squares / (double)m->blocks), 1e-6);
    for (int64_t i = 0; i < m->blocks; i++)
        f->basis[i * f->row + 1] = pattern[i] = f->channel == GREEN ? 0.0 : scale * green[i] / m->face[i];
}

/* Usual variance of what a block mirrors by itself beside the field, a part of the means' errors. */
INLINE double sparkle_of(const ChannelFit *f) { return SPARKLE * SPARKLE * white_of(f) * white_of(f); }

/* Fills ORDINARY: the same with what the block's shading tells of it. */
static HOT void expect_lamps(const ChannelFit *f)
{
    const double white = white_of(f), usual = f->scale[0] * sparkle_of(f);
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        lanes uneven = load(f->m->uneven + f->channel * f->m->stride + b) - EVEN * white;
        uneven = EXTRA_TO_SHADING * larger(uneven, splat(0.0));
        put(f, ORDINARY, b, usual + uneven * uneven);
    }
}

#endif
