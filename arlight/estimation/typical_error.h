/* The typical covariance of a frame's error: averaged over time, what it makes of innovations, and of error bars. */
#ifndef ARLIGHT_TYPICAL_ERROR_H
#define ARLIGHT_TYPICAL_ERROR_H

#include "cholesky.h"
#include "memory.h"

static const double least_freedom = 1e-3;

typedef struct {
    int64_t channels;
    int64_t size;
    double memory_s;     /* time over which covariances are averaged [s] */
    double weight;       /* sum of the frames' faded weights */
    double *covariance;  /* (channels, size, size) typical covariance of relative light */
    double *diagonal;    /* (channels, size) its diagonal */
    const RelativeLight *frame; /* the last frame */
    int64_t many;        /* memories whose innovations are weighed; the first one's gain is everyone's */
    Memory **memories;   /* (many) */
    double *innovation;  /* (many, channels, size) */
    double *terms;       /* (4, size) scratch */
    float *factor;       /* (stride, stride) scratch: Cholesky factor of one channel's correlations (`cholesky.h`) */
    float *sides;        /* (2, many + 1, stride) scratch */
} TypicalError;

/* One channel's average: keep times the old covariance and add times the frame's. */
static HOT void average_channel(const TypicalError *typical, int channel, const double *restrict frame, double keep,
                                double add)
{
    int n = (int)typical->size;
    Terms terms = terms_of(typical->frame, channel);
    const double *restrict scale = terms.scale, *restrict slope = terms.slope, *restrict arm = terms.arm;
    double *restrict all = typical->covariance + (int64_t)channel * n * n;
    for (int i = 0; i < n; i++) {
        double *restrict row = all + (int64_t)i * n;
        const double *restrict own = frame + (int64_t)i * n;
        double scale_i = add * scale[i], slope_i = add * slope[i], arm_i = add * arm[i];
        for (int j = 0; j < n; j++)
            row[j] = keep * row[j] + (scale_i * scale[j] * own[j] + slope_i * arm[j] + slope[j] * arm_i);
        typical->diagonal[channel * n + i] = row[i];
    }
}

/* Mean of the frame's variances over the typical ones. */
static double uncertainty(const TypicalError *typical)
{
    int count = (int)(typical->channels * typical->size);
    double sum = 0.0;
    for (int j = 0; j < count; j++)
        sum += typical->frame->variance[j] / typical->diagonal[j];
    return sum / count;
}

/* Begins with the frame's covariance (channels, size, size). */
EXPORT void typical_start(TypicalError *typical, const double *covariance)
{
    int64_t square = typical->size * typical->size;
    for (int64_t j = 0; j < typical->channels * square; j++)
        typical->covariance[j] = 0.0;
    for (int c = 0; c < typical->channels; c++)
        average_channel(typical, c, covariance + c * square, 0.0, 1.0);
    typical->weight = 1.0;
}

/* Takes in the frame's covariance (channels, size, size) dt [s] after the last one's; a less certain frame counts
   less. */
EXPORT void typical_average(TypicalError *typical, const double *covariance, double dt)
{
    double faded = typical->weight * exp(-dt / typical->memory_s), weight = 1.0 / uncertainty(typical);
    typical->weight = faded + weight;
    for (int c = 0; c < typical->channels; c++)
        average_channel(typical, c, covariance + c * typical->size * typical->size, faded / typical->weight,
                        weight / typical->weight);
}

/* Mean gain of one channel's shape for values of some variance. */
static double shape_gain(const TypicalError *typical, int channel, const double *variance)
{
    int n = (int)typical->size;
    const double *measured = typical->frame->variance + channel * n;
    double sum = 0.0;
    for (int j = 1; j < n; j++)
        sum += variance[j] / (variance[j] + measured[j]);
    return n > 1 ? sum / (n - 1) : 0.0;
}

/* Factor of one channel's correlations between frame and values: the typical ones by the gain, the frame's by the rest;
   0 where they have none. */
static HOT int factor_channel(const TypicalError *typical, int channel, const double *restrict frame, double gain)
{
    int n = (int)typical->size, stride = row_length(n), at = channel * n;
    Terms terms = terms_of(typical->frame, channel);
    double *restrict scale = typical->terms, *restrict slope = scale + n, *restrict arm = slope + n;
    double *restrict share = arm + n;
    const double *restrict typical_row = typical->covariance + (int64_t)at * n;
    float *restrict row = typical->factor;
    for (int j = 0; j < n; j++) {
        double precision = sqrt((1.0 - gain) / typical->frame->variance[at + j]);
        scale[j] = terms.scale[j] * precision;
        slope[j] = terms.slope[j] * precision;
        arm[j] = terms.arm[j] * precision;
        share[j] = sqrt(gain / typical->diagonal[at + j]);
    }
    for (int i = 0; i < n; i++, frame += n, typical_row += n, row += stride) {
        for (int j = i; j < n; j++)
            row[j] = (float)(scale[i] * scale[j] * frame[j] + slope[i] * arm[j] + slope[j] * arm[i] +
                             share[i] * share[j] * typical_row[j]);
        for (int j = n; j < stride; j++)
            row[j] = 0.0f;
    }
    for (int i = n; i < stride; i++, row += stride)
        for (int j = 0; j < stride; j++)
            row[j] = i == j;
    return factorise(n, typical->factor);
}

/* What a level is known worse by than the rest of one channel, relative to the frame's variance of it; 0 where that is
   next to nothing. */
static double freedom(const TypicalError *typical, int channel, const double *variance)
{
    int n = (int)typical->size;
    const double *usual = typical->diagonal + channel * n;
    double known = 0.0;
    for (int j = 1; j < n; j++)
        known += variance[j] / usual[j];
    double excess = variance[0] - (n > 1 ? usual[0] * known / (n - 1) : variance[0]);
    double free = excess / typical->frame->variance[channel * n];
    return free > least_freedom ? free : 0.0;
}

/* Takes the shift of a free level out of decorrelated innovations y, in standard deviations; y_0 tells of nothing else
   when the level may be anything. `level` is the first row of the correlations' inverse. */
static double level_shift(const TypicalError *typical, int channel, const double *variance, double free,
                          const float *restrict level, float *restrict y)
{
    int n = (int)typical->size;
    const double *measured = typical->frame->variance + channel * n;
    double both = 0.0;
    for (int j = 1; j < n; j++)
        both += 1.0 + variance[j] / measured[j];
    double shift = y[0] / (level[0] + both / (n - 1) / free);
    for (int j = 0; j < n; j++)
        y[j] -= (float)shift * level[j];
    return shift;
}

/* Right sides of one channel: the innovations of all memories in the frame's standard deviations, and the level's
   place. */
static void set_sides(const TypicalError *typical, int channel)
{
    int n = (int)typical->size, stride = row_length(n), at = channel * n;
    float *restrict side = typical->sides;
    for (int m = 0; m < typical->many; m++, side += stride) {
        const double *restrict values = typical->memories[m]->values + at;
        for (int j = 0; j < n; j++)
            side[j] = (float)((typical->frame->values[at + j] - values[j]) / sqrt(typical->frame->variance[at + j]));
        for (int j = n; j < stride; j++)
            side[j] = 0.0f;
    }
    for (int j = 0; j < stride; j++)
        side[j] = j == 0;
}

/* Innovation of one channel of a memory as each coefficient alone should take it: U' y with y the decorrelated one, U'
   the typical correlations with the frame's variances. */
static HOT void weigh_channel(const TypicalError *typical, int channel, const double *restrict variance,
                              double free, const float *restrict level, float *restrict y,
                              double *restrict innovation)
{
    int n = (int)typical->size, at = channel * n;
    const double *restrict measured = typical->frame->variance + at, *restrict usual = typical->diagonal + at;
    double shift = free > 0.0 ? level_shift(typical, channel, variance, free, level, y) : 0.0;
    double *restrict weight = typical->terms;
    for (int j = 0; j < n; j++)
        weight[j] = y[j] / sqrt(usual[j]);
    const double *restrict row = typical->covariance + (int64_t)at * n;
    for (int i = 0; i < n; i++, row += n) {
        double sum = 0.0;
        for (int j = 0; j < n; j++)
            sum += row[j] * weight[j];
        innovation[i] = sum * sqrt(measured[i] / usual[i]);
    }
    /* the level's own gain is that of a variance with its freedom: what came without it must not be believed more */
    double settled = variance[0] - free * measured[0], all = variance[0];
    double share = settled / (settled + measured[0]) * (all + measured[0]) / all;
    innovation[0] = share * innovation[0] + shift * sqrt(measured[0]) * (all + measured[0]) / all;
}

/* Decorrelates the innovations of one channel with a frame; 0 where the frame has no proper correlations. */
static int decorrelate(const TypicalError *typical, int channel, const double *frame, int any_free)
{
    int n = (int)typical->size, many = (int)typical->many;
    double gain = shape_gain(typical, channel, typical->memories[0]->variance + channel * n);
    if (!factor_channel(typical, channel, frame + (int64_t)channel * n * n, gain))
        return 0;
    set_sides(typical, channel);
    float *scratch = typical->sides + (many + 1) * row_length(n);
    solve(n, typical->factor, many + any_free, typical->sides, scratch);
    return 1;
}

/* Innovations of all memories with a frame of covariance (channels, size, size), correlations and free levels being
   what they are. */
EXPORT void typical_weigh(const TypicalError *typical, const double *frame)
{
    int n = (int)typical->size, stride = row_length(n), many = (int)typical->many, any_free = 0;
    for (int c = 0; c < typical->channels; c++) {
        for (int m = 0; m < many; m++)
            any_free |= freedom(typical, c, typical->memories[m]->variance + c * n) > 0.0;
        int factored = decorrelate(typical, c, frame, any_free);
        for (int m = 0; m < many; m++) {
            double *innovation = typical->innovation + (m * typical->channels + c) * n;
            const double *variance = typical->memories[m]->variance + c * n;
            if (factored)
                weigh_channel(typical, c, variance, freedom(typical, c, variance), typical->sides + many * stride,
                              typical->sides + m * stride, innovation);
            else
                for (int j = 0; j < n; j++)
                    innovation[j] = typical->frame->values[c * n + j] - typical->memories[m]->values[c * n + j];
        }
    }
}

#endif
