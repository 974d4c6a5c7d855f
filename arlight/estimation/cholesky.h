/* Cholesky factors of small symmetric matrices in single precision, rows in whole vector registers. */
#ifndef ARLIGHT_CHOLESKY_H
#define ARLIGHT_CHOLESKY_H

#include "native.h"

enum { LANES = 16, PANEL = 4 }; /* floats of a block; rows that are eliminated together */

/* Length of a row [floats], and number of rows: whole blocks. What lies beyond n is the unit matrix. */
static inline int row_length(int n)
{
    return (n + LANES - 1) / LANES * LANES;
}

/* x -= factors * rows (PANEL of them) from the block of place `first` on. */
static inline void subtract_panel(int first, int stride, const float *factors, const float *restrict rows,
                                  float *restrict x)
{
    float a = factors[0], b = factors[stride], c = factors[2 * stride], d = factors[3 * stride];
    for (int block = first / LANES * LANES; block < stride; block += LANES)
        for (int l = block; l < block + LANES; l++)
            x[l] -= a * rows[l] + b * rows[stride + l] + c * rows[2 * stride + l] + d * rows[3 * stride + l];
}

/* x -= factor * y from the block of place `first` on. */
static inline void subtract(int first, int stride, float factor, const float *restrict y, float *restrict x)
{
    for (int block = first / LANES * LANES; block < stride; block += LANES)
        for (int l = block; l < block + LANES; l++)
            x[l] -= factor * y[l];
}

/* Replaces the upper triangle of a matrix by R with R'R the matrix, the diagonal by its reciprocal; what lies left of
   it is cleared within its block. Returns 0 where the matrix is not positive definite. */
static HOT int factorise(int n, float *restrict matrix)
{
    int stride = row_length(n);
    for (int k = 0; k < n; k += PANEL) {
        float *panel = matrix + k * stride;
        for (int p = k; p < k + PANEL; p++) {
            float *restrict row = matrix + p * stride;
            for (int q = k; q < p; q++)
                subtract(k, stride, matrix[q * stride + p], matrix + q * stride, row);
            if (!(row[p] > 1e-6f))
                return 0;
            float reciprocal = 1.0f / sqrtf(row[p]);
            for (int j = p / LANES * LANES; j < stride; j++)
                row[j] = j > p ? row[j] * reciprocal : 0.0f;
            /* stands here while the panel's rows are subtracted from one another and from those below */
            row[p] = reciprocal;
        }
        for (int i = k + PANEL; i < n; i++)
            subtract_panel(i, stride, panel + i, panel, matrix + i * stride);
    }
    return 1;
}

/* Solves R'R x = side for several right sides (many, stride), in place; `scratch` is as large. */
static HOT void solve(int n, const float *restrict factor, int many, float *restrict sides, float *restrict scratch)
{
    int stride = row_length(n);
    for (int k = 0; k < n; k++) {
        const float *restrict row = factor + k * stride;
        for (int m = 0; m < many; m++) {
            float solved = sides[m * stride + k] * row[k];
            subtract(k, stride, solved, row, sides + m * stride);
            scratch[m * stride + k] = solved;
        }
    }
    for (int j = 0; j < many * stride; j++)
        sides[j] = 0.0f;
    for (int k = n - 1; k >= 0; k--) {
        const float *restrict row = factor + k * stride;
        for (int m = 0; m < many; m++) {
            float sum = 0.0f;
            for (int block = k / LANES * LANES; block < stride; block += LANES)
                for (int l = block; l < block + LANES; l++)
                    sum += row[l] * sides[m * stride + l];
            sides[m * stride + k] = (scratch[m * stride + k] - sum) * row[k];
        }
    }
}

#endif
