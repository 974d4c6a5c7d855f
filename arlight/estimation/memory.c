/* A Kalman filter with fading memory, each number by itself: value, and velocity where it has a trend. */
#include "native.h"

typedef struct {
    int64_t channels;
    int64_t size;      /* numbers a channel; the first is the level, which is not judged */
    double *values;    /* (channels, size) */
    double *velocity;  /* (channels, size) [1/s] */
    double *variance;  /* (channels, size) of the values */
    double *cross;     /* (channels, size) covariance of value and velocity [1/s] */
    double *moving;    /* (channels, size) variance of the velocity [1/s^2] */
    double *corrected; /* (channels, size) variance of the values after the last measurement */
} Memory;

/* Carries the state on by dt [s]; what is known fades by `growth`, its variance up to `ceiling` (channels, size). */
EXPORT HOT void predict(const Memory *memory, double dt, double growth, const double *restrict ceiling)
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

/* Takes in measurements that differ from the values by `innovation`, of some variance (both (channels, size)). */
EXPORT HOT void correct(const Memory *memory, const double *restrict innovation, const double *restrict measured)
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

/* Means of a measurement's squared distance from the values: over the variance of the difference, over its own; and of
   the last corrected variance over its own. */
EXPORT HOT void judge(const Memory *memory, const double *restrict measured, const double *restrict variance,
                      double *restrict means)
{
    int size = (int)memory->size, first = size > 1;
    double surprise = 0.0, shown = 0.0, kept = 0.0;
    for (int c = 0; c < memory->channels; c++)
        for (int j = c * size + first; j < (c + 1) * size; j++) {
            double distance = measured[j] - memory->values[j], own = 1.0 / variance[j];
            surprise += distance * distance / (variance[j] + memory->variance[j]);
            shown += distance * distance * own;
            kept += memory->corrected[j] * own;
        }
    double share = 1.0 / (double)(memory->channels * (size - first));
    means[0] = surprise * share;
    means[1] = shown * share;
    means[2] = kept * share;
}

/* Adds `weight` times the values to a light (channels, size), and to its variance `kept` times the corrected variance,
   `kept_level` times that of the levels, and `left` times another one. */
EXPORT HOT void tell(const Memory *memory, double weight, double kept, double kept_level, double left,
                     const double *restrict typical, double *restrict values, double *restrict variance)
{
    int size = (int)memory->size, count = (int)memory->channels * size;
    for (int j = 0; j < count; j++) {
        values[j] += weight * memory->values[j];
        variance[j] += kept * memory->corrected[j] + left * typical[j];
    }
    for (int j = 0; j < count; j += size)
        variance[j] += (kept_level - kept) * memory->corrected[j];
}
