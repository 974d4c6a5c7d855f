/* Light relative to its own level: values and variances, and the terms in which its covariance is read. */
#ifndef ARLIGHT_RELATIVE_LIGHT_H
#define ARLIGHT_RELATIVE_LIGHT_H

#include "native.h"

/* A covariance in other terms: term i is scale_i times its own error plus slope_i times that of term 0; slope_0 = 0. */
typedef struct {
    double *scale; /* (n) */
    double *slope; /* (n) */
    double *arm;   /* (n) scale times the first row's entry and half of slope times its first */
} Terms;

/* The arms that go with a matrix, from its first row. */
static inline void extend(Terms terms, int n, const double *restrict first)
{
    for (int j = 0; j < n; j++)
        terms.arm[j] = terms.scale[j] * first[j] + 0.5 * terms.slope[j] * first[0];
}

/* Entry (i, j) of a matrix in the new terms: a rank-two update instead of two matrix products. */
static inline double converted(Terms terms, int i, int j, double entry)
{
    return terms.scale[i] * terms.scale[j] * entry + terms.slope[i] * terms.arm[j] + terms.slope[j] * terms.arm[i];
}

/* Below this level [radiance * sr, relative to the exposure] light is not divided by it. */
static const double darkest = 1e-3;

typedef struct {
    int64_t channels;
    int64_t size;
    double *values;   /* (channels, size) */
    double *variance; /* (channels, size) */
    double *scale;    /* (channels, size) the terms of `relative_light.h` */
    double *slope;
    double *arm;
} RelativeLight;

/* Relative coefficients of one channel; complex (k, channels) in, of which the first is real. */
static void take_values(const RelativeLight *light, int channel, const double *coefficients, double exposure)
{
    int size = (int)light->size, stride = 2 * (int)light->channels;
    const double *first = coefficients + 2 * channel;
    double *values = light->values + channel * size;
    double *scale = light->scale + channel * size, *slope = light->slope + channel * size;
    double level = fmax(first[0] / exposure, darkest) * exposure;
    for (int k = 1; 2 * k - 1 < size; k++) {
        values[2 * k - 1] = first[k * stride] / level;
        values[2 * k] = first[k * stride + 1] / level;
    }
    for (int j = 1; j < size; j++) {
        scale[j] = 1.0 / level;
        slope[j] = -values[j] / level;
    }
    values[0] = first[0] / exposure;
    scale[0] = 1.0 / exposure;
    slope[0] = 0.0;
}

static inline Terms terms_of(const RelativeLight *light, int channel)
{
    int64_t at = channel * light->size;
    return (Terms){light->scale + at, light->slope + at, light->arm + at};
}

/* Takes in coefficients (k, channels), complex, with covariance (channels, size, size), and what levels are relative to
   (channels). */
EXPORT void relative_take(const RelativeLight *light, const double *coefficients, const double *covariance,
                 const double *exposure)
{
    int size = (int)light->size;
    for (int c = 0; c < light->channels; c++) {
        take_values(light, c, coefficients, exposure[c]);
        Terms terms = terms_of(light, c);
        const double *matrix = covariance + (int64_t)c * size * size;
        extend(terms, size, matrix);
        for (int j = 0; j < size; j++)
            light->variance[c * size + j] = converted(terms, j, j, matrix[(int64_t)j * size + j]);
    }
}

/* Coefficients of one channel, complex. */
static void give_values(const RelativeLight *light, int channel, double *coefficients, double exposure)
{
    int size = (int)light->size, stride = 2 * (int)light->channels;
    const double *values = light->values + channel * size;
    double *first = coefficients + 2 * channel, level = fmax(values[0], darkest) * exposure;
    first[0] = values[0] * exposure;
    first[1] = 0.0;
    for (int k = 1; 2 * k - 1 < size; k++) {
        first[k * stride] = values[2 * k - 1] * level;
        first[k * stride + 1] = values[2 * k] * level;
    }
}

/* Covariance of one channel that has the light's variances and the correlations of `shape`. */
static HOT void give_covariance(const RelativeLight *light, int channel, const double *restrict shape,
                                double *restrict covariance, double exposure)
{
    int n = (int)light->size, at = channel * n;
    double *restrict scale = light->scale + at, *restrict slope = light->slope + at, *restrict arm = light->arm + at;
    const double *values = light->values + at, *variance = light->variance + at;
    double level = fmax(values[0], darkest) * exposure, spread = sqrt(variance[0] / shape[0]);
    for (int j = 0; j < n; j++) {
        scale[j] = (j > 0 ? level : exposure) * sqrt(variance[j] / shape[(int64_t)j * n + j]);
        slope[j] = j > 0 ? values[j] * exposure : 0.0;
        arm[j] = spread * (scale[j] * shape[j] + 0.5 * slope[j] * spread * shape[0]);
    }
    for (int i = 0; i < n; i++) {
        const double *restrict own = shape + (int64_t)i * n;
        double *restrict row = covariance + (int64_t)i * n;
        for (int j = 0; j < n; j++)
            row[j] = scale[i] * scale[j] * own[j] + slope[i] * arm[j] + slope[j] * arm[i];
    }
}

/* Coefficients (k, channels) under an exposure, and their covariance with the correlations of `shape`; both
   covariances (channels, size, size). */
EXPORT void relative_give(const RelativeLight *light, const double *exposure, const double *shape, double *coefficients,
                 double *covariance)
{
    int64_t square = light->size * light->size;
    for (int c = 0; c < light->channels; c++) {
        give_values(light, c, coefficients, exposure[c]);
        give_covariance(light, c, shape + c * square, covariance + c * square, exposure[c]);
    }
}

#endif
