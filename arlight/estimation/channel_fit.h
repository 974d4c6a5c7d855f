/* One colour channel's fit: what it is given, what it finds, and the planes it works on. */
#ifndef ARLIGHT_CHANNEL_FIT_H
#define ARLIGHT_CHANNEL_FIT_H

#include "measured_blocks.h"

#define NUISANCES 5 /* blur, sharpness, lower face, shift along x and y */
#define WIDE 8      /* room for them in whole lanes */
#define COLUMNS 3   /* of a block's response: L_0, Re L_n, Im L_n */

typedef struct {
    MeasuredBlocks *m;
    int64_t channel;
    int64_t frequencies;    /* that are fitted, without (0, 0) */
    int64_t modes;          /* amplitudes of the reflection; the second is green's own pattern */
    int64_t coarse;         /* of which so many, the smoothest, suffice to tell lamps and stray blocks, and how the
                               reflection in red and blue strays from green's pattern */
    int64_t row;            /* length of a row of the basis: all amplitudes and two more, in whole lanes */
    int64_t field, width;   /* amplitudes that are looked for at the time, and the same for these */
    int64_t wide;           /* length of a row of coefficients in whole lanes */
    const int32_t *first;   /* (frequencies + 2) first block of each frequency; those without pattern come first */
    const double *spread;   /* (2k - 1) prior deviation of the coefficients for an irradiance of 1; L_0's own */
    const double *colorful; /* (2k - 1) the same of red's and blue's difference from green */
    const double *mean_model;  /* (stride) deviation of the model's error in the means, relative to white */
    double *basis;          /* (stride, row) reflection field of each block, before Fresnel's factor */
    double *basis_planes;   /* (modes, stride) the same, one plane an amplitude */
    const double *rows;     /* (3, 7, stride) response before blur */
    const double *lower;    /* (7, stride) of the lower face */
    double white_per_irradiance;
    double lamp_freedom;    /* of Student's t distribution of lamps */
    double weight_freedom;  /* and of a block's harmonics */
    double weakest;         /* what blur must leave of a harmonic that is used */
    /* what the last frame told of each channel and what this one does; red and blue start from green's nuisance, lamps
       and weights */
    double *nuisances;      /* (3, 5) */
    double *scales;         /* (3, 2) of the model's errors in means and harmonics */
    double *spreads;        /* (3) of the colours about green */
    double *lamps;          /* (3, stride) variance granted to what blocks mirror by themselves */
    double *weights;        /* (3, stride) of the blocks */
    double *nuisance, *scale, *lamp, *weight; /* of this channel */
    double *packed;         /* (3, 2k - 1) coefficients of all channels */
    double *covariance;     /* (3, 2k - 1, 2k - 1) */
    double *reflection;     /* (3, stride) */
    double *predicted;      /* (3, 7, stride) */
    double *planes;         /* (PLANES, stride) see below */
    double *shared;         /* (row, row) equations of the shared unknowns */
    double *stacked;        /* (stride, row) rows whose products they are */
    double *frequency;      /* (frequencies + 1, FREQUENCY) what each frequency's own equations leave */
    double *least;          /* (row) prior precision of the shared unknowns */
    double *expected;       /* (2k - 1) prior mean */
    double *certain;        /* (2k - 1) prior precision */
    double *solution;       /* (row) of the shared unknowns */
    double *carried;        /* (row, 8) change of the shared unknowns with the nuisance */
    double *carried_light;  /* (2k, 8) change of the coefficients */
    double *fields;         /* (row, stride) the blocks' fields, freed of all other shared unknowns */
    double *certainty;      /* (row + 8, wide) rows whose products are the covariance */
    double *products;       /* (wide, wide) */
    double *small;          /* (most blocks of a frequency + 8)^2 */
    double chi2;            /* result: robust chi-square a row */
    double unexplained;     /* result: share of the stripes that the fit does not explain */
} ChannelFit;

/* Numbers of a frequency: inverse of its own 2 x 2 matrix (11, 12, 22), its products with L_0 and with the values. */
enum { INVERSE = 0, WITH_MEAN = 3, WITH_VALUES = 5, FREQUENCY = 8 };

/* Planes of a channel; of several numbers, one plane each. */
enum {
    MODEL = 0,                         /* 4: variance that the model leaves out, of the mean and of the harmonics */
    INFERRED = MODEL + 4,              /* 3: variance of the harmonics that luma stood in for */
    TRUST = INFERRED + 3,              /* share of the harmonics that was seen */
    NOISE = TRUST + 1,                 /* variance of a pixel */
    ORDINARY = NOISE + 1,              /* variance of what a block without lamp mirrors by itself */
    TRANSFER = ORDINARY + 1,           /* 3: what blur leaves of the harmonics */
    USABLE = TRANSFER + 3,             /* 4: whether mean and harmonics count */
    DESIGN = USABLE + 4,               /* 3 x 7: response */
    FACE = DESIGN + COLUMNS * ROWS,    /* 7: what a lower face of 1 mirrors */
    MIRROR = FACE + ROWS,              /* 7: what both faces mirror */
    PRECISION = MIRROR + ROWS,         /* 28: of the rows when a lamp may be mirrored */
    TELLING = PRECISION + PAIRS,       /* 7: how the rows tell of a lamp */
    SPREAD = TELLING + ROWS,           /* variance with which a lamp is told */
    WEIGHTED = SPREAD + 1,             /* 4 x 7: precision times the columns of the response and of the field */
    GRAM = WEIGHTED + 4 * ROWS,        /* 14: products of columns, field and values, see block_equations.h */
    FIELD = GRAM + 14,                 /* reflection, before Fresnel's factor */
    REAL = FIELD + 1,                  /* coefficient of the block's frequency */
    IMAGINARY = REAL + 1,
    MISSED = IMAGINARY + 1,            /* 7: measured less light and field */
    EXTRA = MISSED + ROWS,             /* what a block mirrors by itself */
    SLOPES = EXTRA + 1,                /* 5 x 7: change of the rows with the nuisance */
    CROSS = SLOPES + NUISANCES * ROWS, /* 4 x 5: their products with columns and mirror */
    SHARES = CROSS + 4 * NUISANCES,    /* 2: how Re and Im of the block's frequency move with its field */
    BLOCK = SHARES + 2,                /* 10: covariance of L_0, Re, Im and field */
    PLANES = BLOCK + 10,
};

INLINE double *plane(const ChannelFit *f, int64_t number) { return f->planes + number * f->m->stride; }

INLINE lanes at(const ChannelFit *f, int64_t number, int64_t block) { return load(plane(f, number) + block); }

INLINE void put(const ChannelFit *f, int64_t number, int64_t block, lanes value)
{
    store(plane(f, number) + block, value);
}

INLINE double white_of(const ChannelFit *f) { return f->m->white[f->channel]; }

INLINE int64_t coefficients(const ChannelFit *f) { return 2 * f->frequencies + 1; }

#endif
