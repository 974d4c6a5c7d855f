/* A picture's codes and what they stand for. */
#ifndef ARLIGHT_VIDEO_PICTURE_H
#define ARLIGHT_VIDEO_PICTURE_H

#include <stddef.h>

#include "native.h"

/* One axis of a picture: how its pixels read chroma, and how its chroma samples average pixels. */
struct axis {
    int32_t taps;               /* pixels that a chroma sample averages */
    int32_t samples;            /* chroma samples */
    int32_t share;              /* pixels to a chroma sample */
    int32_t inner_pixels[2];    /* first and end of those that no edge is near: what they read repeats by the share */
    int32_t inner_samples[2];   /* the same of chroma samples */
    const int32_t *lower;       /* (pixels) the chroma sample before each */
    const int32_t *upper;       /* (pixels) the one after it */
    const float *weight;        /* (pixels) the weight of the latter */
    const int32_t *tapped;      /* (taps, samples) the pixels that each sample averages */
    const float *tap_weights;   /* (taps) their weights */
};

/* A curve over [0, 1] in even steps. */
struct curve {
    const float *values;        /* (last + 2) the one at 1 stands twice, so that there is one after it */
    float last;                 /* steps */
};

/* What the codes of a picture stand for. R, G, B planes are read like Y', Cb, Cr with an identity for a matrix. */
struct layout {
    int32_t wide;               /* 1: codes have two bytes */
    int32_t subsampled;         /* 1: chroma has fewer samples than luma */
    float black, luma_span;     /* code of 0, and codes per unit, of Y' or grey */
    float neutral, chroma_span; /* the same of Cb and Cr */
    float top;                  /* highest code */
    struct axis columns, rows;
    const float *rgb_from_ycc;  /* (3, 3) */
    const float *ycc_from_rgb;  /* (3, 3) */
    struct curve decode;        /* linear light over R'G'B' */
    struct curve encode;        /* R'G'B' over the square root of linear light */
};

/* Where the codes of a picture are. */
struct picture {
    uint8_t *planes[3];
    int64_t strides[3];         /* bytes from a row to the next */
};

struct box { int32_t x0, y0, x1, y1; };

/* Linear interpolation in a curve; clamps, and takes what is no number for 0. */
INLINE float through(struct curve curve, float position)
{
    float x = position * curve.last;
    x = x > 0.0f ? x : 0.0f;
    x = x < curve.last ? x : curve.last;
    int32_t i = (int32_t)x;
    return curve.values[i] + (curve.values[i + 1] - curve.values[i]) * (x - (float)i);
}

/* Component k of matrix (3, 3) times (a, b, c). */
INLINE float product(const float *matrix, int k, float a, float b, float c)
{
    return matrix[3 * k] * a + matrix[3 * k + 1] * b + matrix[3 * k + 2] * c;
}

/* A row of one plane. */
static inline uint8_t *row_of(const struct picture *picture, int plane, int32_t y)
{
    return picture->planes[plane] + (ptrdiff_t)y * picture->strides[plane];
}

#endif
