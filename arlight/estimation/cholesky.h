/* Cholesky factors of small symmetric matrices in single precision, rows in whole blocks of one vector register. */
#ifndef ARLIGHT_CHOLESKY_H
#define ARLIGHT_CHOLESKY_H

#include "native.h"

#define LANES 16 /* floats of a block */

/* Length of a row [floats]: whole blocks, zero beyond n. */
static inline int row_length(int n)
{
    return (n + LANES - 1) / LANES * LANES;
}

/* x -= factor * y from the block of place `first` on. */
static inline void subtract(int first, int stride, float factor, const float *restrict y, float *restrict x)
{
    for (int b = first / LANES * LANES; b < stride; b += LANES)
        for (int l = b; l < b + LANES; l++)
            x[l] -= factor * y[l];
}

/* Replaces the upper triangle of a matrix (n rows) by R with R'R the matrix, the diagonal by its reciprocal; what lies
   left of it is cleared. Returns 0 where the matrix is not positive definite. */
static HOT int factorise(int n, float *restrict matrix)
{
    int stride = row_length(n);
    for (int k = 0; k < n; k++) {
        float *restrict row = matrix + k * stride;
        if (!(row[k] > 1e-6f))
            return 0;
        float reciprocal = 1.0f / sqrtf(row[k]);
        for (int j = k / LANES * LANES; j < stride; j++)
            row[j] = j > k ? row[j] * reciprocal : 0.0f;
        for (int i = k + 1; i < n; i++)
            subtract(i, stride, row[i], row, matrix + i * stride);
        row[k] = reciprocal;
    }
    return 1;
}

/* Solves R'R x = side in place; `scratch` as long as a row. */
static HOT void solve(int n, const float *restrict factor, float *restrict side, float *restrict scratch)
{
    int stride = row_length(n);
    for (int k = 0; k < n; k++) {
        const float *restrict row = factor + k * stride;
        scratch[k] = side[k] * row[k];
        subtract(k, stride, scratch[k], row, side);
    }
    for (int j = 0; j < stride; j++)
        side[j] = 0.0f;
    for (int k = n - 1; k >= 0; k--) {
        const float *restrict row = factor + k * stride;
        float sum = 0.0f;
        for (int b = k / LANES * LANES; b < stride; b += LANES)
            for (int l = b; l < b + LANES; l++)
                sum += row[l] * side[l];
        side[k] = (scratch[k] - sum) * row[k];
    }
}

#endif
