/* The samples that a triangle covers: those whose centres lie inside, and where two triangles share an edge every
   sample on it belongs to one of them alone. Corners lie on a grid of 1 / SNAP of a sample, and sample (column, row)
   has its centre at just these integers. Both ways to tell are exact.

   A small triangle: by the sign of each edge, in whole numbers, for eight samples side by side.

   Any other: row by row. Where an edge crosses a row is a fraction whose denominator is the edge's height in grid
   steps: unless it is a whole number it is farther than EDGE from one while the edge is less than 4096 samples high,
   and the rounding of as many steps is no more than EDGE. */
#ifndef ARLIGHT_TRIANGLE_H
#define ARLIGHT_TRIANGLE_H

#include "samples.h"

enum { SNAP_BITS = 8, SNAP = 1 << SNAP_BITS, SMALL = 24 };

#define FARTHEST 0x1p23f       /* corners farther than this from the first sample, on the grid, are not drawn */
#define ASIDE 0x1p17           /* farther aside than any row reaches */
#define ONE ((int64_t)1 << 32) /* crossings are counted in this part of a sample */
#define EDGE ((int64_t)1 << 11)

typedef struct {
    int32_t x[3], y[3];           /* corners on the grid, clockwise as seen with rows downward */
    int left, right, top, bottom; /* samples of its box, from the first to before the last, inside the picture or not */
} Triangle;

typedef struct {
    int32_t first[3];           /* for each edge, at the box's first sample: negative outside of it */
    int32_t across[3], down[3]; /* its change to the next column and row */
} Edges;

typedef struct {
    int64_t left[2], right[2];           /* column where edges cross the row: inside is right of both, left of both */
    int64_t left_step[2], right_step[2]; /* its change to the next row */
    int row, end;                        /* the row, and the one after the last */
} Rows;

/* First sample that is not before a place of the grid. */
INLINE int sample_from(int32_t place) { return (place + SNAP - 1) >> SNAP_BITS; }

/* Twice the area, in steps of the grid; positive where the corners run clockwise as seen with rows downward. */
INLINE int64_t twice_area(const Triangle *t)
{
    return (int64_t)(t->x[1] - t->x[0]) * (t->y[2] - t->y[0]) - (int64_t)(t->x[2] - t->x[0]) * (t->y[1] - t->y[0]);
}

INLINE int32_t least(const int32_t v[3])
{
    int32_t two = v[0] < v[1] ? v[0] : v[1];
    return two < v[2] ? two : v[2];
}

INLINE int32_t most(const int32_t v[3])
{
    int32_t two = v[0] > v[1] ? v[0] : v[1];
    return two > v[2] ? two : v[2];
}

INLINE void find_box(Triangle *t)
{
    t->left = sample_from(least(t->x)), t->right = sample_from(most(t->x));
    t->top = sample_from(least(t->y)), t->bottom = sample_from(most(t->y));
}

/* Whether whole numbers tell of its edges, and most of its box is not wasted. */
INLINE int is_small(const Triangle *t) { return (t->right - t->left <= SMALL) & (t->bottom - t->top <= SMALL); }

INLINE Edges edges_of(const Triangle *t)
{
    Edges edges;
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1;
        int32_t across = t->x[j] - t->x[i], down = t->y[j] - t->y[i];
        /* of what lies on an edge, left edges and upper ones own it */
        int32_t other = down > 0 || (down == 0 && across < 0);
        edges.first[i] = across * (SNAP * t->top - t->y[i]) - down * (SNAP * t->left - t->x[i]) - other;
        edges.across[i] = -SNAP * down, edges.down[i] = SNAP * across;
    }
    return edges;
}

INLINE int within(int value, int limit) { return value < 0 ? 0 : value > limit ? limit : value; }

INLINE int64_t units(double samples)
{
    double near = samples < ASIDE ? samples : ASIDE;
    return (int64_t)((near > -ASIDE ? near : -ASIDE) * ONE);
}

/* Its rows from `top` to before `bottom`, of a picture of some height. */
INLINE Rows rows_of(const Triangle *t, int top, int bottom, int height)
{
    const double sample = 1.0 / SNAP;
    Rows rows = {.left[1] = INT64_MIN / 2, .right[1] = INT64_MAX / 2};
    rows.row = t->top > top ? t->top : top, rows.end = t->bottom < bottom ? t->bottom : bottom;
    int lefts = 0, rights = 0;
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1;
        int32_t rise = t->y[j] - t->y[i];
        if (rise == 0)
            continue;
        /* told for the edge's own first row: what is so flat that it is cut short at ASIDE meets no other one */
        int own = within(sample_from(rise > 0 ? t->y[i] : t->y[j]), height);
        double slope = (double)(t->x[j] - t->x[i]) / rise;
        int64_t step = units(slope);
        double from = sample * t->x[i] + (own - sample * t->y[i]) * slope;
        int64_t crossing = units(from) + (rows.row - own) * step - EDGE;
        if (rise < 0)
            rows.left[lefts] = crossing, rows.left_step[lefts++] = step;
        else
            rows.right[rights] = crossing, rows.right_step[rights++] = step;
    }
    return rows;
}

/* First sample that is not left of a crossing, within [0, width]. */
INLINE int sample_right_of(int64_t crossing, int width)
{
    int64_t sample = (crossing + (ONE - 1)) >> 32;
    return (int)(sample < 0 ? 0 : sample > width ? width : sample);
}

/* The row's samples: from `*first` to before `*last`. */
INLINE void samples_of_row(const Rows *rows, int width, int *first, int *last)
{
    *first = sample_right_of(rows->left[0] > rows->left[1] ? rows->left[0] : rows->left[1], width);
    *last = sample_right_of(rows->right[0] < rows->right[1] ? rows->right[0] : rows->right[1], width);
}

INLINE void next_row(Rows *rows)
{
    rows->row++;
    for (int i = 0; i < 2; i++) {
        rows->left[i] += rows->left_step[i];
        rows->right[i] += rows->right_step[i];
    }
}

#endif
