/* What averaging over time leaves: how much of the frames' errors is independent, what means keep of the rest. */
#ifndef ARLIGHT_COMMON_ERROR_H
#define ARLIGHT_COMMON_ERROR_H

#include "relative_light.h"

enum { MOST_MEANS = 2 };

static const double learning_s = 1.0;  /* time over which shares are averaged [s] */
static const double never_shown = 0.2; /* least part of the common error that is left: no change of view shows it */
static const double change_s = 0.15;   /* time over which prediction errors show that the light has changed [s] */
static const double chance = 1.15;     /* prediction errors over the expected ones that mean nothing */

/* An average with fading weights or, at first, over all there is. */
typedef struct {
    double value;
    int64_t count;
} Average;

typedef struct {
    int64_t channels;
    int64_t size;      /* numbers a channel; the first is the level, which is not judged */
    int64_t means;     /* up to MOST_MEANS */
    double *values;    /* (3, channels, size) of the last three frames, in a ring */
    double *variance;  /* (3, channels, size) */
    int64_t seen;      /* frames of this light */
    Average independent;
    Average shown[MOST_MEANS];
    Average lately[MOST_MEANS];
    Average averaged[MOST_MEANS];
} CommonError;

static void add(Average *average, double value, double share)
{
    average->count++;
    average->value += fmax(share, 1.0 / (double)average->count) * (value - average->value);
}

/* Takes a frame into the ring; returns its place there. */
static int64_t push(CommonError *common, const RelativeLight *frame)
{
    int64_t count = common->channels * common->size, slot = common->seen++ % 3;
    for (int64_t j = 0; j < count; j++) {
        common->values[slot * count + j] = frame->values[j];
        common->variance[slot * count + j] = frame->variance[j];
    }
    return slot;
}

/* Mean square of the last frames' second difference over what it is if all of the errors is independent. */
static HOT double bend(const CommonError *common, int64_t slot)
{
    int size = (int)common->size, first = size > 1;
    int64_t count = common->channels * common->size;
    int64_t places[3] = {(slot + 1) % 3 * count, (slot + 2) % 3 * count, slot * count};
    const double *a = common->values + places[0], *b = common->values + places[1], *c = common->values + places[2];
    const double *u = common->variance + places[0], *v = common->variance + places[1];
    const double *w = common->variance + places[2];
    double sum = 0.0;
    for (int k = 0; k < common->channels; k++)
        for (int j = k * size + first; j < (k + 1) * size; j++) {
            double bent = c[j] - 2.0 * b[j] + a[j];
            sum += bent * bent / (u[j] + 4.0 * v[j] + w[j]);
        }
    return sum / (double)(common->channels * (size - first));
}

/* Another light, seen first in a frame. */
EXPORT void common_start(CommonError *common, const RelativeLight *frame)
{
    common->seen = 0;
    push(common, frame);
}

/* Takes in a frame dt [s] after the last: of each mean, the squared distance of the frame from it over the frame's
   variance, and its variance over the frame's if the errors of all frames were independent. */
EXPORT void common_learn(CommonError *common, const RelativeLight *frame, const double *shown, const double *averaged,
                         double dt)
{
    double learning = 1.0 - exp(-dt / learning_s), change = 1.0 - exp(-dt / change_s);
    int64_t slot = push(common, frame);
    /* light that moves steadily has no second difference */
    if (common->seen >= 3)
        add(&common->independent, bend(common, slot), learning);
    for (int m = 0; m < common->means; m++) {
        add(&common->shown[m], shown[m], learning);
        add(&common->lately[m], shown[m], change);
        add(&common->averaged[m], averaged[m], learning);
    }
}

/* Share of a frame's error that is independent of the other frames'. */
EXPORT double common_independent(const CommonError *common)
{
    return fmin(common->independent.value, 1.0);
}

/* Share of a frame's variance that is left in a mean, beside what averaging leaves of the independent share. */
EXPORT double common_left(const CommonError *common, int mean)
{
    double independent = common_independent(common), rest = 1.0 - independent;
    double expected = independent * (1.0 + common->averaged[mean].value);
    double left = fmin(fmax(rest - (common->shown[mean].value - expected), never_shown * rest), rest);
    /* more shown than a frame can err: the mean lags behind the light, or all error bars are too narrow */
    return left + fmax(common->lately[mean].value - chance * (expected + rest - left), 0.0);
}

#endif
