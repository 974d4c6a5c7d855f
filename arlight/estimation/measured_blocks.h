/* The measurements of a frame's blocks as the fit wants them: one plane a number, blocks of one frequency together. */
#ifndef ARLIGHT_MEASURED_BLOCKS_H
#define ARLIGHT_MEASURED_BLOCKS_H

#include "lanes.h"

#define HARMONICS 3
#define ROWS (2 * HARMONICS + 1) /* mean, then cosine and sine of each harmonic */
#define PAIRS (ROWS * (ROWS + 1) / 2)
#define CHANNELS 3
#define GREEN 1

enum { PATTERN, CLEAR_WHITE, CLEAR_BLACK, BLACK_FILM };

/* Of rows, relative to white; see row_noise.py. */
typedef struct {
    double floor, stray, quiet, noisy, lamp_pixels, swing_model, codec, transfer, faintest, color_spread, least_trust,
        chroma_mean, chroma_swing;
} UsualErrors;

typedef struct {
    int64_t blocks;               /* that are used: the first ones of the sequence */
    int64_t stride;               /* length of a plane: whole lanes */
    const double *values;         /* as measured, block by block: (7, 3) */
    const double *covariance;     /* (7, 7) */
    const double *pixel_variance; /* (3) */
    const double *shading;        /* (3) */
    const int64_t *harmonics;     /* how many were separated */
    const uint8_t *valid;         /* whether it was seen */
    const double *view_phasor;    /* real and imaginary part */
    const double *view_cosine;
    const double *cycles_per_px;  /* (2) */
    const double *color_trust;
    const int64_t *sequence;      /* (blocks) which block of the measurements each is */
    const uint8_t *kind;          /* (stride) PATTERN and so on */
    double index;                 /* of the glass's refraction */
    double *measured;             /* (3, 7, stride) the values; 0 where nothing was seen */
    double *pixels;               /* (28, stride) covariance, lower triangle, of pixels of unit variance */
    double *noise;                /* (3, stride) variance of a pixel */
    double *uneven;               /* (3, stride) shading */
    double *resolved;             /* (stride) harmonics that were separated */
    double *seen;                 /* (stride) 1 where it was seen */
    double *trust;                /* (stride) in the colours of stripes */
    double *phasor;               /* (2, stride) */
    double *cosine;               /* (stride) */
    double *cycles;               /* (2, stride) */
    double *left;                 /* (3, stride) what a pixel's square leaves of each harmonic */
    double *left_log;             /* (3, stride) its logarithm */
    double *fineness;             /* (3, stride) sum of the harmonics' wave numbers' fourth powers [px^-4] */
    double *face;                 /* (stride) how strongly the film mirrors, relative to the mean */
    double *scratch;              /* (stride) */
    double white[CHANNELS];       /* radiance of clear film on white paper */
    double amplitude[CHANNELS];   /* standard deviation of the mirror reflection over the sheet */
    double quiet[CHANNELS];       /* pixel variance of a quiet block */
    UsualErrors usual;
    int64_t whole;                /* whether every pixel's colour was stored */
} MeasuredBlocks;

/* Places in a lower triangle. */
static const uint8_t PAIR[ROWS][ROWS] = {
    {0, 1, 3, 6, 10, 15, 21},  {1, 2, 4, 7, 11, 16, 22},   {3, 4, 5, 8, 12, 17, 23},   {6, 7, 8, 9, 13, 18, 24},
    {10, 11, 12, 13, 14, 19, 25}, {15, 16, 17, 18, 19, 20, 26}, {21, 22, 23, 24, 25, 26, 27},
};

INLINE int harmonic_of_row(int row) { return (row + 1) / 2; }

#endif
