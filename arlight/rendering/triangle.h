/* The samples that a triangle covers, row by row: those whose centres lie inside, and where two triangles share an edge
   every sample on it belongs to one of them alone. Corners lie on a grid of 1 / SNAP of a sample, and sample (column,
   row) has its centre at just these integers.

   Where an edge crosses a row is a fraction whose denominator is the edge's height in grid steps, so unless it is a whole
   number it is farther than EDGE from one. Rounding is far below that, so the decision is exact. */
#ifndef ARLIGHT_TRIANGLE_H
#define ARLIGHT_TRIANGLE_H

#include <math.h>

#include "bounded.h"

#define SNAP 256.0f
#define EDGE 0x1p-27
#define MOST_SAMPLES 0x1p15f /* corners farther than this from the first sample are not drawn */

typedef struct {
    double left[2], right[2];           /* column where the edges cross the row */
    double left_step[2], right_step[2]; /* its change to the next row */
    int row, end;                       /* the row, and the one after the last */
} Rows;

/* Nearest place of the grid. */
static inline float snapped(float samples)
{
    return rintf(samples * SNAP) * (1.0f / SNAP);
}

/* Smallest integer that is not left of a crossing, within [0, limit]. */
static inline int first_from(double crossing, int limit)
{
    double shifted = crossing - EDGE;
    double kept = shifted > 0.0 ? shifted : 0.0;
    return kept < limit ? (int)ceil(kept) : limit;
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
    rows->left[1] = -INFINITY, rows->right[1] = INFINITY;
    rows->left_step[1] = rows->right_step[1] = 0.0;
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1;
        double rise = (double)y[j] - y[i];
        if (rise == 0.0)
            continue;
        double step = ((double)x[j] - x[i]) / rise;
        double crossing = x[i] + (rows->row - (double)y[i]) * step;
        if (rise < 0.0)
            rows->left[lefts] = crossing, rows->left_step[lefts++] = step;
        else
            rows->right[rights] = crossing, rows->right_step[rights++] = step;
    }
    return 1;
}

/* The row's samples: from `*first` to before `*last`. */
static inline void samples_of_row(const Rows *rows, int width, int *first, int *last)
{
    double left = rows->left[0] > rows->left[1] ? rows->left[0] : rows->left[1];
    double right = rows->right[0] < rows->right[1] ? rows->right[0] : rows->right[1];
    *first = first_from(left, width);
    *last = first_from(right, width);
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
