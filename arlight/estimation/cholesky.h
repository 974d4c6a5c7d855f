/* A symmetric equation in single precision, by Cholesky's factor, rows in whole vector registers. */
#ifndef ARLIGHT_CHOLESKY_H
#define ARLIGHT_CHOLESKY_H

#include "native.h"

enum { WIDE = 16, PANEL = 4 }; /* floats of a vector; rows that are eliminated together */

typedef float wide __attribute__((vector_size(64), aligned(4), may_alias));

/* Length of a row [floats] of n unknowns and the right side, in whole vectors. */
static inline int row_length(int n)
{
    return (n + WIDE) / WIDE * WIDE;
}

/* Takes off some rows from k on, from their diagonal on, what the rows above explain of them. */
INLINE void reduce_panel(int k, int rows, int stride, float *matrix)
{
    float *panel = matrix + k * stride;
    for (int j = k / WIDE * WIDE; j < stride; j += WIDE) {
        wide sum[PANEL] = {{0.0f}};
        for (const float *row = matrix; row < panel; row += stride)
            for (int p = 0; p < PANEL; p++)
                sum[p] += row[k + p] * *(const wide *)(row + j);
        for (int p = 0; p < rows; p++)
            *(wide *)(panel + p * stride + j) -= sum[p];
    }
}

/* Replaces the first n rows of (matrix | right side), of which all from the diagonal on counts, by (R | y) with R'R the
   matrix and R'y the right side, the diagonal by its reciprocal. What stands left of the diagonal in its vector is
   lost, and has to be finite. Returns 0 where the matrix is not positive definite. */
static HOT int factorise(int n, float *matrix)
{
    int stride = row_length(n);
    for (int k = 0; k < n; k += PANEL) {
        int rows = n - k < PANEL ? n - k : PANEL;
        reduce_panel(k, rows, stride, matrix);
        for (int p = k; p < k + rows; p++) {
            float *row = matrix + p * stride;
            for (int q = k; q < p; q++) {
                const float *above = matrix + q * stride;
                float factor = above[p];
                for (int j = k / WIDE * WIDE; j < stride; j += WIDE)
                    *(wide *)(row + j) -= factor * *(const wide *)(above + j);
            }
            if (!(row[p] > 1e-6f))
                return 0;
            float reciprocal = 1.0f / sqrtf(row[p]);
            for (int j = k / WIDE * WIDE; j < stride; j += WIDE)
                *(wide *)(row + j) *= reciprocal;
            row[p] = reciprocal;
        }
    }
    return 1;
}

/* Solves R x = y of what `factorise` leaves; x has room for a row. */
static HOT void substitute(int n, const float *matrix, float *x)
{
    int stride = row_length(n);
    for (int j = 0; j < stride; j++)
        x[j] = j == n ? -1.0f : 0.0f;
    for (int k = (n - 1) / PANEL * PANEL; k >= 0; k -= PANEL) {
        int rows = n - k < PANEL ? n - k : PANEL;
        float left[PANEL];
        /* of all that is solved, and the right side; what stands left of that meets zeros */
        for (int p = 0; p < rows; p++) {
            const float *row = matrix + (k + p) * stride;
            wide products = {0.0f};
            for (int j = k / WIDE * WIDE; j < stride; j += WIDE)
                products += *(const wide *)(row + j) * *(const wide *)(x + j);
            left[p] = 0.0f;
            for (int l = 0; l < WIDE; l++)
                left[p] += products[l];
        }
        for (int p = rows - 1; p >= 0; p--) {
            const float *row = matrix + (k + p) * stride + k;
            for (int q = p + 1; q < rows; q++)
                left[p] += row[q] * x[k + q];
            x[k + p] = -left[p] * row[p];
        }
    }
}

#endif
