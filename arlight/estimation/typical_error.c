/* The typical covariance of a frame's error: averaged over time, what it makes of innovations, and of error bars. */
#include "cholesky.h"
#include "relative_light.h"

typedef struct {
    int64_t channels;
    int64_t size;
    double *covariance; /* (channels, size, size) typical covariance of relative light */
    double *diagonal;   /* (channels, size) its diagonal */
    double *values;     /* (channels, size) a frame's relative light */
    double *variance;   /* (channels, size) its variances */
    double *scale;      /* (channels, size) the terms in which its covariance is read (`relative_light.h`) */
    double *slope;
    double *arm;
    int64_t *factored;  /* (channels) whether correlations have a factor */
    float *factor;      /* (channels, size, stride) Cholesky factor of correlations (`cholesky.h`) */
    float *level;       /* (channels, stride) first row of the correlations' inverse */
    double *terms;      /* (4, size) scratch */
    float *side;        /* (2, stride) scratch */
} TypicalError;

static Terms terms_of(const TypicalError *typical, int channel)
{
    int64_t at = channel * typical->size;
    return (Terms){typical->scale + at, typical->slope + at, typical->arm + at};
}

/* One channel's average: keep times the old covariance and add times the frame's. */
static HOT void average_channel(const TypicalError *typical, int channel, const double *restrict frame, double keep,
                                double add)
{
    int n = (int)typical->size;
    Terms terms = terms_of(typical, channel);
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

/* Averages a frame's covariance (channels, size, size) into the typical one. */
EXPORT void average(const TypicalError *typical, const double *frame, double keep, double add)
{
    for (int c = 0; c < typical->channels; c++)
        average_channel(typical, c, frame + c * typical->size * typical->size, keep, add);
}

/* Mean of the frame's variances over the typical ones. */
EXPORT double uncertainty(const TypicalError *typical)
{
    int count = (int)(typical->channels * typical->size);
    double sum = 0.0;
    for (int j = 0; j < count; j++)
        sum += typical->variance[j] / typical->diagonal[j];
    return sum / count;
}

/* Mean gain of one channel's shape for values of some variance. */
static double shape_gain(const TypicalError *typical, int channel, const double *variance)
{
    int n = (int)typical->size;
    const double *measured = typical->variance + channel * n;
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
    Terms terms = terms_of(typical, channel);
    double *restrict scale = typical->terms, *restrict slope = scale + n, *restrict arm = slope + n;
    double *restrict share = arm + n;
    const double *restrict typical_row = typical->covariance + (int64_t)at * n;
    float *restrict row = typical->factor + (int64_t)at * stride;
    for (int j = 0; j < n; j++) {
        double precision = sqrt((1.0 - gain) / typical->variance[at + j]);
        scale[j] = terms.scale[j] * precision;
        slope[j] = terms.slope[j] * precision;
        arm[j] = terms.arm[j] * precision;
        share[j] = sqrt(gain / typical->diagonal[at + j]);
    }
    for (int i = 0; i < n; i++, frame += n, typical_row += n, row += stride)
        for (int j = i; j < n; j++)
            row[j] = (float)(scale[i] * scale[j] * frame[j] + slope[i] * arm[j] + slope[j] * arm[i] +
                             share[i] * share[j] * typical_row[j]);
    return factorise(n, typical->factor + (int64_t)at * stride);
}

/* Factors the correlations of a frame of covariance (channels, size, size) and of values with some variance. */
EXPORT void factor(const TypicalError *typical, const double *frame, const double *variance)
{
    int n = (int)typical->size, stride = row_length(n);
    for (int c = 0; c < typical->channels; c++) {
        float *level = typical->level + c * stride;
        for (int j = 0; j < stride; j++)
            level[j] = j == 0;
        double gain = shape_gain(typical, c, variance + c * n);
        typical->factored[c] = factor_channel(typical, c, frame + (int64_t)c * n * n, gain);
        if (typical->factored[c])
            solve(n, typical->factor + (int64_t)c * n * stride, level, typical->side);
    }
}

/* What a level is known worse by than the rest of one channel, relative to the frame's variance of it. */
static double freedom(const TypicalError *typical, int channel, const double *variance)
{
    int n = (int)typical->size;
    const double *usual = typical->diagonal + channel * n;
    double known = 0.0;
    for (int j = 1; j < n; j++)
        known += variance[j] / usual[j];
    double excess = variance[0] - (n > 1 ? usual[0] * known / (n - 1) : variance[0]);
    return fmax(excess, 0.0) / typical->variance[channel * n];
}

/* Takes the shift of a free level out of decorrelated innovations y, in standard deviations; y_0 tells of nothing else
   when the level may be anything. */
static double level_shift(const TypicalError *typical, int channel, const double *variance, double free, float *y)
{
    int n = (int)typical->size;
    if (!(free > 1e-9))
        return 0.0;
    const double *measured = typical->variance + channel * n;
    const float *level = typical->level + channel * row_length(n);
    double both = 0.0;
    for (int j = 1; j < n; j++)
        both += 1.0 + variance[j] / measured[j];
    double shift = y[0] / (level[0] + both / (n - 1) / free);
    for (int j = 0; j < n; j++)
        y[j] -= (float)shift * level[j];
    return shift;
}

/* Innovations of one channel as each coefficient alone should take them: U' T'^-1 innovation, U' and T' the typical
   correlations and those that were factored, with the frame's variances. */
static HOT void weigh_channel(const TypicalError *typical, int channel, const double *restrict values,
                              const double *restrict variance, double *restrict innovation)
{
    int n = (int)typical->size, stride = row_length(n), at = channel * n;
    const double *restrict measured = typical->variance + at, *restrict usual = typical->diagonal + at;
    float *restrict y = typical->side;
    for (int j = 0; j < n; j++)
        y[j] = (float)((typical->values[at + j] - values[j]) / sqrt(measured[j]));
    for (int j = n; j < stride; j++)
        y[j] = 0.0f;
    solve(n, typical->factor + (int64_t)channel * n * stride, y, y + stride);
    double free = freedom(typical, channel, variance), shift = level_shift(typical, channel, variance, free, y);
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

/* Innovations (channels, size) against values with variances, correlations and a free level being what they are. */
EXPORT void weigh(const TypicalError *typical, const double *values, const double *variance, double *innovation)
{
    int n = (int)typical->size;
    for (int c = 0; c < typical->channels; c++) {
        int at = c * n;
        if (typical->factored[c])
            weigh_channel(typical, c, values + at, variance + at, innovation + at);
        else
            for (int j = 0; j < n; j++)
                innovation[at + j] = typical->values[at + j] - values[at + j];
    }
}
