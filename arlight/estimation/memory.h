/* A Kalman filter with fading memory, each number by itself: value, and velocity where it has a trend. */
#ifndef ARLIGHT_MEMORY_H
#define ARLIGHT_MEMORY_H

#include "relative_light.h"

typedef struct {
    int64_t channels;
    int64_t size;      /* numbers a channel; the first is the level, which is not judged */
    double *values;    /* (channels, size) */
    double *velocity;  /* (channels, size) [1/s] */
    double *variance;  /* (channels, size) of the values */
    double *cross;     /* (channels, size) covariance of value and velocity [1/s] */
    double *moving;    /* (channels, size) variance of the velocity [1/s^2] */
    double *corrected; /* (channels, size) variance of the values after the last measurement */
    double memory_s;   /* [s] */
    int64_t trend;     /* whether there is a velocity */
    double growth;     /* of variances since the last measurement */
    double weights;    /* sum of the measurements' faded weights, and of their squares */
    double squared_weights;
    int64_t level_freed; /* whether a level was granted a sudden change */
} Memory;

/* A measurement's distance from the values: means over all but the levels of its square. */
typedef struct {
    double surprise; /* over the variance of the distance */
    double shown;    /* over the measurement's own variance */
    double kept;     /* not of the distance: the corrected variance over the measurement's */
} Judgement;

/* Begins with values and their variance, and squared spreads of velocities [1/s^2], each (channels, size). */
EXPORT void memory_start(Memory *memory, const double *values, const double *variance, const double *squared_rate)
{
    int64_t count = memory->channels * memory->size;
    for (int64_t j = 0; j < count; j++) {
        memory->values[j] = values[j];
        memory->variance[j] = memory->corrected[j] = variance[j];
        memory->velocity[j] = memory->cross[j] = 0.0;
        memory->moving[j] = memory->trend ? squared_rate[j] : 0.0;
    }
    memory->growth = memory->weights = memory->squared_weights = 1.0;
    memory->level_freed = 0;
}

static HOT void carry(const Memory *memory, double dt, double growth, const double *restrict ceiling)
{
    double *restrict values = memory->values, *restrict variance = memory->variance;
    double *restrict cross = memory->cross, *restrict moving = memory->moving;
    const double *restrict velocity = memory->velocity;
    int count = (int)(memory->channels * memory->size);
    for (int j = 0; j < count; j++) {
        double grown = growth * (variance[j] + 2.0 * dt * cross[j] + dt * dt * moving[j]);
        double share = ceiling[j] / (grown > 1e-30 ? grown : 1e-30);
        share = share < 1.0 ? share : 1.0;
        values[j] += dt * velocity[j];
        variance[j] = grown * share;
        cross[j] = growth * share * (cross[j] + dt * moving[j]);
        moving[j] = growth * share * moving[j];
    }
}

/* Carries the state on by dt [s]; its variance grows up to `ceiling` (channels, size) and no further. */
EXPORT void memory_predict(Memory *memory, double dt, const double *ceiling)
{
    double growth = exp(fmin(dt / memory->memory_s, 50.0));
    memory->growth *= growth;
    carry(memory, dt, growth, ceiling);
}

/* Grants a channel's level a sudden change of some variance. */
EXPORT void memory_free_level(Memory *memory, int channel, double variance)
{
    memory->variance[channel * memory->size] += variance;
    memory->level_freed = 1;
}

static HOT void take_in(const Memory *memory, const double *restrict innovation, const double *restrict measured)
{
    double *restrict values = memory->values, *restrict variance = memory->variance;
    double *restrict cross = memory->cross, *restrict moving = memory->moving;
    double *restrict velocity = memory->velocity, *restrict corrected = memory->corrected;
    int count = (int)(memory->channels * memory->size);
    for (int j = 0; j < count; j++) {
        double precision = 1.0 / (variance[j] + measured[j]);
        double gain = variance[j] * precision, velocity_gain = cross[j] * precision;
        values[j] += gain * innovation[j];
        velocity[j] += velocity_gain * innovation[j];
        moving[j] -= velocity_gain * cross[j];
        cross[j] *= measured[j] * precision;
        variance[j] = gain * measured[j];
        corrected[j] = variance[j];
    }
}

/* Takes in a measurement that differs from the values by `innovation` (channels, size). */
EXPORT void memory_correct(Memory *memory, const double *innovation, const RelativeLight *measured)
{
    take_in(memory, innovation, measured->variance);
    memory->weights = memory->weights / memory->growth + 1.0;
    memory->squared_weights = memory->squared_weights / (memory->growth * memory->growth) + 1.0;
    memory->growth = 1.0;
}

/* Compares a measurement with the values. */
EXPORT HOT void memory_judge(const Memory *memory, const RelativeLight *measured, Judgement *judgement)
{
    int size = (int)memory->size, first = size > 1;
    double surprise = 0.0, shown = 0.0, kept = 0.0;
    for (int c = 0; c < memory->channels; c++)
        for (int j = c * size + first; j < (c + 1) * size; j++) {
            double distance = measured->values[j] - memory->values[j], own = 1.0 / measured->variance[j];
            surprise += distance * distance / (measured->variance[j] + memory->variance[j]);
            shown += distance * distance * own;
            kept += memory->corrected[j] * own;
        }
    double share = 1.0 / (double)(memory->channels * (size - first));
    *judgement = (Judgement){surprise * share, shown * share, kept * share};
}

/* Variance after the last measurement over `corrected`, if all errors are independent and nothing changes. */
EXPORT double memory_averaged(const Memory *memory)
{
    double share = memory->squared_weights / memory->weights;
    /* a straight line that fades: 1.25 (1 - fading) R at its end, where `variance` is 2 (1 - fading) R */
    return memory->trend ? fmin(1.25 * share, 1.0) : share;
}

/* Adds a weight of the values to a light, and of the variances that their errors have: of the corrected variance what
   averaging leaves of the independent share of errors, and a share `left` of a typical measurement's. */
EXPORT HOT void memory_tell(const Memory *memory, double weight, double independent, double left,
                            const double *restrict typical, const RelativeLight *light)
{
    int size = (int)memory->size, count = (int)memory->channels * size;
    /* without measurements the light may change */
    double grown = weight * memory->growth, kept = grown * independent * memory_averaged(memory);
    double kept_level = memory->level_freed ? grown * independent : kept;
    left *= grown;
    for (int j = 0; j < count; j++) {
        light->values[j] += weight * memory->values[j];
        light->variance[j] += kept * memory->corrected[j] + left * typical[j];
    }
    for (int j = 0; j < count; j += size)
        light->variance[j] += (kept_level - kept) * memory->corrected[j];
}

#endif
