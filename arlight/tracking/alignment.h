/* What an alignment works on: the markers' templates, memory for the points of each, the picture, and the result. */
#ifndef ARLIGHT_ALIGNMENT_H
#define ARLIGHT_ALIGNMENT_H

#include "native.h"

/* Feature vector of a point: [T, u T, v T, 1 | 6 pose derivatives | dT/d(blur variance) | I], with T the template
 * (0 black, 1 white) and I the picture in linear light. The first four absorb a marker's lighting: gain, its slope, and
 * bias. The pose derivatives are by rotation about the marker's middle, then by translation, in the camera's frame. */
enum { LIGHTING = 4, POSE = 6, BLUR = LIGHTING + POSE, LIGHT, FEATURES };

typedef struct {
    int64_t markers, points, size, positions; /* markers m, points p of each, modules on a side n, positions k */
    const double *camera;                     /* (25) as `lens_of` reads them */
    const double *outline;                    /* (4, 3) the sheet's corners [mm] */
    double radius_mm;                         /* farthest corner of a marker from the sheet's origin */
    double *places;                           /* (m, 6) top left corner, one module right, one module down, x y [mm] */
    const float *black;                       /* (m, n, n) 1 where a module (row, column) is black */
    const float *base, *spread;               /* (k) positions on an axis [modules], and what the blur adds [sigmas] */
    const int32_t *index_u, *index_v;         /* (m, p) which position a point has on each axis */
    double *drawn;                            /* (m, 4) blur drawn: across u, v [modules], variance [px^2], reach [px] */
    float *at;                                /* (m, 2, p) u and v of the points [modules] */
    float *slope;                             /* (m, 2, p) dT/du and dT/dv there */
    float *features;                          /* (m, FEATURES, p) */
    float *scratch;                           /* the larger of (3, p) and 2 k + 7 (n + 1) k + k k */
    float *shrunk;                            /* (height / 2, width / 2) linear light at a coarser level */
    double *coefficients;                     /* (m, LIGHTING) each marker's lighting */
    double *gram;                             /* (m, FEATURES, FEATURES) weighted products, the lighting eliminated */
    double *correlation, *weight;             /* (m) with the picture; in the pose's equations, 0 left out */
    double *pose;                             /* (12) rotation row by row, translation [mm]: the start, then the result */
    double *result;                           /* (3) residual rms, standard deviation of corners, blur [px] */
    const void *codes;                        /* (height, width) luma codes of the picture */
    const float *table;                       /* (entries) linear light of each code */
    int64_t stride, code_bytes, width, height, entries; /* bytes from row to row; bytes a code: 1 or 2 */
} Alignment;

/* The normal equations of all markers together, residuals in units of the markers' gains. */
typedef struct {
    double matrix[POSE][POSE];
    double right[POSE];
    double blur_above, blur_below; /* weighted change of the blur's variance [px^2], and its weight */
    int used;                      /* markers that take part */
} Equations;

#endif
