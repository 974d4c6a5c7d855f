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
    int64_t many;        /* memories whose innovations are weighed */
    Memory **memories;   /* (many) */
    double *innovation;  /* (many, channels, size) */
    double *terms;       /* (4, size) scratch */
    float *equation;     /* (size + 4, stride) scratch: one channel's correlations and distances (`cholesky.h`) */
    float *solution;     /* (stride) scratch */
    double *shares;      /* (3, size) scratch */
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

/* What a level is known worse by than the rest of one channel, as a variance; 0 where that is next to nothing. */
static double freedom(const TypicalError *typical, int channel, const double *variance)
{
    int n = (int)typical->size;
    const double *usual = typical->diagonal + channel * n;
    double known = 0.0;
    for (int j = 1; j < n; j++)
        known += variance[j] / usual[j];
    double excess = variance[0] - (n > 1 ? usual[0] * known / (n - 1) : variance[0]);
    return excess > least_freedom * typical->frame->variance[channel * n] ? excess : 0.0;
}

/* Sets what one channel of a memory is known by: `share` times the typical deviation is that of its values, its level's
   without the freedom; `precision` is one over the deviation of their distance from the frame. */
static void set_shares(const TypicalError *typical, int channel, const double *restrict variance, double free,
                       double *restrict share, double *restrict precision)
{
    int n = (int)typical->size, at = channel * n;
    for (int j = 0; j < n; j++) {
        double settled = variance[j] - (j == 0 ? free : 0.0);
        share[j] = sqrt(settled / typical->diagonal[at + j]);
        precision[j] = 1.0 / sqrt(variance[j] + typical->frame->variance[at + j]);
    }
}

/* Sets up the equation whose solution is one channel's distance between frame and memory divided by its covariance, all
   in the distance's own deviations. */
static HOT void set_equation(const TypicalError *typical, int channel, const double *restrict frame, double free,
                             const double *restrict share, const double *restrict precision,
                             const double *restrict distance)
{
    int n = (int)typical->size, stride = row_length(n), at = channel * n;
    Terms terms = terms_of(typical->frame, channel);
    double *restrict scale = typical->terms, *restrict slope = scale + n, *restrict arm = slope + n;
    double *restrict part = arm + n;
    const double *restrict typical_row = typical->covariance + (int64_t)at * n;
    float *restrict row = typical->equation;
    for (int j = 0; j < n; j++) {
        scale[j] = terms.scale[j] * precision[j];
        slope[j] = terms.slope[j] * precision[j];
        arm[j] = terms.arm[j] * precision[j];
        part[j] = share[j] * precision[j];
    }
    for (int i = 0; i < n; i++, frame += n, typical_row += n, row += stride) {
        for (int j = i / WIDE * WIDE; j < n; j++)
            row[j] = (float)(scale[i] * scale[j] * frame[j] + slope[i] * arm[j] + slope[j] * arm[i] +
                             part[i] * part[j] * typical_row[j]);
        row[n] = (float)(distance[i] * precision[i]);
        for (int j = n + 1; j < stride; j++)
            row[j] = 0.0f;
    }
    typical->equation[0] += (float)(free * precision[0] * precision[0]);
}

/* Innovation of one channel as each number alone should take it: what the whole vector takes, P y, over the number's
   own gain. `weight` is y, the distance divided by its covariance, times the shares; `freed` is what the level takes
   beside. */
static HOT void spread_innovation(const TypicalError *typical, int channel, const double *restrict variance,
                                  double freed, const double *restrict share, const double *restrict weight,
                                  double *restrict innovation)
{
    int n = (int)typical->size, at = channel * n;
    const double *restrict row = typical->covariance + (int64_t)at * n;
    for (int i = 0; i < n; i++, row += n) {
        double sum = 0.0;
        for (int j = 0; j < n; j++)
            sum += row[j] * weight[j];
        double taken = share[i] * sum + (i == 0 ? freed : 0.0);
        innovation[i] = taken * (variance[i] + typical->frame->variance[at + i]) / variance[i];
    }
}

/* Innovation of one channel of a memory with a frame; the plain distance where that has no proper covariance. */
static void weigh_channel(const TypicalError *typical, int channel, const double *frame, const Memory *memory,
                          double *restrict innovation)
{
    int n = (int)typical->size, at = channel * n;
    const double *variance = memory->variance + at;
    double *share = typical->shares, *precision = share + n, *weight = precision + n;
    double free = freedom(typical, channel, variance);
    for (int j = 0; j < n; j++)
        innovation[j] = typical->frame->values[at + j] - memory->values[at + j];
    set_shares(typical, channel, variance, free, share, precision);
    set_equation(typical, channel, frame, free, share, precision, innovation);
    if (!factorise(n, typical->equation))
        return;
    substitute(n, typical->equation, typical->solution);
    for (int j = 0; j < n; j++)
        weight[j] = share[j] * typical->solution[j] * precision[j];
    double freed = free * typical->solution[0] * precision[0];
    spread_innovation(typical, channel, variance, freed, share, weight, innovation);
}

/* Innovations of all memories with a frame of covariance (channels, size, size): as the Kalman filter of the whole
   vector has them whose covariance has the memory's variances and the typical correlations. */
EXPORT void typical_weigh(const TypicalError *typical, const double *frame)
{
    int64_t n = typical->size;
    for (int c = 0; c < typical->channels; c++)
        for (int m = 0; m < typical->many; m++)
            weigh_channel(typical, c, frame + c * n * n, typical->memories[m],
                          typical->innovation + (m * typical->channels + c) * n);
}

#endif
