/* What measuring the blocks of a frame works on: the sheet, the picture, memory for each step, and the result. */
#ifndef ARLIGHT_BLOCKS_H
#define ARLIGHT_BLOCKS_H

#include <string.h>

#include "native.h"

#define STEP 8 /* pixels are worked on in multiples of these; lists of them have room for as many more */

enum { HARMONICS = 3, ROWS = 2 * HARMONICS + 1, CHANNELS = 3 };
enum { PATTERNED = 1, WHITE = 2, WANTED = 4 };    /* flags of a block */
enum { EDGES = 8, CUBIC = 4 };                    /* of the usable window; coefficients of a cubic */
enum { PHASE, X, Y, SURFACES, TERMS = 16 };       /* the film pattern's phase [cycles], the place in the window */
enum { HUES = 3, HUE = ROWS + 1 };                /* series along the stripes of chroma over luma, and a constant */

/* One encoded channel of a block, in places of the decoding table: of luma, of limited luma along the stripes, and a
 * constant, cos and sin. */
typedef struct {
    float luma, series[ROWS], level[3];
} Tint;

/* Sums over one block's pixels: what normal equations with harmonics and linear shading are made of. */
typedef struct {
    float cosine[2 * HARMONICS + 1], sine[2 * HARMONICS + 1]; /* of multiples of the phase; of the 0th: the count */
    float x_cosine[HARMONICS + 1], x_sine[HARMONICS + 1];     /* times x */
    float y_cosine[HARMONICS + 1], y_sine[HARMONICS + 1];     /* times y */
    float xx, xy, yy;
    float right[CHANNELS][ROWS + 2]; /* values times 1, cos 1, sin 1, ..., x, y */
    float squares[CHANNELS];
} Sums;

typedef struct {
    int64_t blocks;                   /* n, whole LANES; those that are too many are not wanted */
    int64_t width, height;            /* of the picture [px] */
    const double *lens;               /* (25) as `lens_of` reads them */
    const double *upright;            /* (9) inverse of the sensor's tilt, row by row */
    int64_t rounds;                   /* of undoing the lens's distortion */
    double vignetting[3], half_diagonal_px;
    const float *sheet;               /* (6, n) centre x, y, half the side [mm]; pattern u, v [1/mm], phase [1] there */
    uint8_t *flags;                   /* (n) */
    double reach_mm, glass_mm, index; /* how far light strays below the film; the glass */
    const double *pose;               /* (12) rotation row by row, translation [mm] */
    double edge_px;                   /* to keep from a block's border */

    int32_t *seen;      /* (n) the block lies in the picture, in front of the camera */
    int32_t *harmonics; /* (n) that the pixels can separate */
    float *frequency;   /* (2, n) of the pattern in the picture, x and y [1/px] */
    float *margin;      /* (2, n) to keep from the block's border, along x and y [mm] */
    float *gain;        /* (n) vignetting in the block's middle */
    float *box;         /* (4, n) middle x, y and half the size x, y of the part in the picture [px] */
    float *edges;       /* (EDGES, 3, n) a, b, c: a x + b y <= c inside, from the box's middle [px] */
    float *surfaces;    /* (n, CUBIC, TERMS) by power of v: coefficients of u^k; u, v from -1 to 1 over the box */
    float *look;        /* (2, 5, n) the view's phase 2 pi f.D, and cosine: value, slopes, half second slopes */

    int64_t limit;         /* pixels a block at most */
    int64_t room;          /* floats of a list */
    int32_t *order;        /* (n) blocks to be measured: white ones first, then by harmonics */
    int32_t *spans;        /* (2, height) first pixel of a row, and how many */
    float *rows;           /* (height, TERMS) coefficients in each row; also limits (2, height) */
    int32_t *steps;        /* (room) that were chosen of a block's */
    float *lists;          /* (LISTS, room) */
    float *hue;            /* (n, HUES, HUE) of Cb and Cr; most luma that chroma is scaled with, and least over most */
    Tint *tints;           /* (n, CHANNELS) */
    double *mean_code;     /* (n, 3) mean luma and chroma where chroma is shared */
    Sums *sums;            /* (n) by place in the order */
    int32_t *gathered;     /* (n) */

    const char *planes[3];
    int64_t stride[3];               /* bytes from row to row */
    int64_t bytes, shift_x, shift_y; /* of a code; log2 of the pixels that share chroma */
    double offset[3], scale[3];      /* value = (code - offset) scale */
    double rgb_from_ycc[9], ycc_from_rgb[9];
    double displacement_px[2];       /* where shared chroma lies from the middle of its pixels */
    const float *light;              /* (entries) of encoded values from 0 to 1 */
    const float *encoding;           /* (entries) encoded values over the root of light from 0 to 1 */
    int64_t entries;
    double clip;                     /* light from which a pixel counts as clipped */
    const double *stripes;           /* (n, ROWS, CHANNELS) light to expect; NULL where `hue` says it */

    double *values;     /* (n, ROWS, CHANNELS) */
    double *covariance; /* (n, ROWS, ROWS) of the values for pixels of unit variance */
    double *variance;   /* (n, CHANNELS) of a pixel about the fit */
    double *shading;    /* (n, CHANNELS) */
    double *cycles;     /* (n, 2) frequency once more */
    double *phasor;     /* (n, 2) */
    double *cosine;     /* (n) */
    double *trust;      /* (n) */
    int64_t *resolved;  /* (n) harmonics that were separated */
    int64_t *samples;   /* (n) pixels that were used */
    uint8_t *valid;     /* (n) */
} Blocks;

#endif
