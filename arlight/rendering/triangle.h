/* The samples that a triangle covers, row by row: those whose centres lie inside, and where two triangles share an edge
   every sample on it belongs to one of them alone. Corners lie on a grid of 1 / SNAP of a sample, and sample (column,
   row) has its centre at just these integers.

   Where an edge crosses a row is a fraction whose denominator is the edge's height in grid steps: unless it is a whole
   number it is farther than EDGE from one while the edge is less than 4096 samples high, and the rounding of as many
   steps is no more than EDGE. So the decision is exact. */
#ifndef ARLIGHT_TRIANGLE_H
#define ARLIGHT_TRIANGLE_H

#include <math.h>
#include <stdint.h>

#include "bounded.h"

#define SNAP 256.0f
#define MOST_SAMPLES 0x1p15f   /* corners farther than this from the first sample are not drawn */
#define ASIDE 0x1p17           /* farther aside than any row reaches */
#define ONE ((int64_t)1 << 32) /* crossings are counted in this part of a sample */
#define EDGE ((int64_t)1 << 11)

typedef struct {
    int64_t left[2], right[2];           /* column where edges cross the row: inside is right of both, left of both */
    int64_t left_step[2], right_step[2]; /* its change to the next row */
    int row, end;                        /* the row, and the one after the last */
} Rows;

/* Nearest place of the grid. */
static inline float snapped(float samples)
{
    return rintf(samples * SNAP) * (1.0f / SNAP);
}

/* Smallest integer that is not below a value, within [0, limit]. */
static inline int first_from(float value, int limit)
{
    float kept = greater(value, 0.0f);
    return kept < (float)limit ? (int)ceilf(kept) : limit;
}

static inline int64_t units(double samples)
{
    double near = samples < ASIDE ? samples : ASIDE;
    return (int64_t)((near > -ASIDE ? near : -ASIDE) * ONE);
}

/* Start at the first row; the corners must run so that `twice_area` is positive. False where no row is met. */
static inline int begin_rows(Rows *rows, const float x[3], const float y[3], int height)
{
    float top = lesser(y[0], lesser(y[1], y[2])), bottom = greater(y[0], greater(y[1], y[2]));
    rows->row = first_from(top, height);
    rows->end = first_from(bottom, height);
    if (rows->row >= rows->end)
        return 0;
    int lefts = 0, rights = 0;
    rows->left[1] = INT64_MIN / 2, rows->right[1] = INT64_MAX / 2;
    rows->left_step[1] = rows->right_step[1] = 0;
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1;
        double rise = (double)y[j] - y[i];
        if (rise == 0.0)
            continue;
        /* told for the edge's own first row: what is so flat that it is cut short at ASIDE meets no other one */
        int own = first_from(lesser(y[i], y[j]), height);
        double slope = ((double)x[j] - x[i]) / rise;
        int64_t step = units(slope);
        int64_t crossing = units(x[i] + (own - (double)y[i]) * slope) + (rows->row - own) * step - EDGE;
        if (rise < 0.0)
            rows->left[lefts] = crossing, rows->left_step[lefts++] = step;
        else
            rows->right[rights] = crossing, rows->right_step[rights++] = step;
    }
    return 1;
}

/* First sample that is not left of a crossing, within [0, width]. */
static inline int sample_from(int64_t crossing, int width)
{
    int64_t sample = (crossing + (ONE - 1)) >> 32;
    return (int)(sample < 0 ? 0 : sample > width ? width : sample);
}

/* The row's samples: from `*first` to before `*last`. */
static inline void samples_of_row(const Rows *rows, int width, int *first, int *last)
{
    *first = sample_from(rows->left[0] > rows->left[1] ? rows->left[0] : rows->left[1], width);
    *last = sample_from(rows->right[0] < rows->right[1] ? rows->right[0] : rows->right[1], width);
}

static inline void next_row(Rows *rows)
{
    rows->row++;
    for (int i = 0; i < 2; i++) {
        rows->left[i] += rows->left_step[i];
        rows->right[i] += rows->right_step[i];
    }
}

/* Twice the area; positive where the corners run clockwise as seen with rows downward. */
static inline float twice_area(const float x[3], const float y[3])
{
    return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
}

#endif
