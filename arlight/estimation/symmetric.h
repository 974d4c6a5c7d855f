/* Small symmetric matrices, upper triangles, rows of whole lanes: sums of outer products, factors, substitution. */
#ifndef ARLIGHT_SYMMETRIC_H
#define ARLIGHT_SYMMETRIC_H

#include "lanes.h"

/* c += sign * a' a, for a with `terms` rows of `size` columns; size is a multiple of four. Below the diagonal only the
   tiles on it are right. */
static HOT void add_products(int64_t terms, int64_t size, const double *a, int64_t stride, double sign, double *c,
                             int64_t c_stride)
{
    for (int64_t i = 0; i < size; i += LANES) {
        int64_t j = i;
        for (; j + 2 * LANES <= size; j += 2 * LANES) {
            lanes left[LANES], right[LANES];
            for (int r = 0; r < LANES; r++)
                left[r] = right[r] = splat(0.0);
            for (int64_t k = 0; k < terms; k++) {
                const double *row = a + k * stride;
                lanes x = load(row + j), y = load(row + j + LANES);
                for (int r = 0; r < LANES; r++) {
                    left[r] += row[i + r] * x;
                    right[r] += row[i + r] * y;
                }
            }
            for (int r = 0; r < LANES; r++) {
                double *to = c + (i + r) * c_stride + j;
                store(to, load(to) + sign * left[r]);
                store(to + LANES, load(to + LANES) + sign * right[r]);
            }
        }
        if (j < size) {
            lanes last[LANES];
            for (int r = 0; r < LANES; r++)
                last[r] = splat(0.0);
            for (int64_t k = 0; k < terms; k++) {
                lanes x = load(a + k * stride + j);
                for (int r = 0; r < LANES; r++)
                    last[r] += a[k * stride + i + r] * x;
            }
            for (int r = 0; r < LANES; r++) {
                double *to = c + (i + r) * c_stride + j;
                store(to, load(to) + sign * last[r]);
            }
        }
    }
}

/* Replaces the first `pivots` rows of a positive definite matrix by R with R'R the matrix; columns beyond, such as a
   right-hand side, are substituted. size >= pivots is a multiple of four. Pivots are `least` (pivots) at least, as
   those of a matrix to which a diagonal was added. */
static HOT void factorise(int64_t pivots, int64_t size, double *s, int64_t stride, const double *least)
{
    for (int64_t k = 0; k < pivots; k += LANES) {
        int64_t rows = pivots - k < LANES ? pivots - k : LANES;
        for (int64_t p = 0; p < rows; p++) {
            double *row = s + (k + p) * stride;
            for (int64_t q = 0; q < p; q++) {
                const double *above = s + (k + q) * stride;
                lanes factor = splat(above[k + p]);
                for (int64_t j = k; j < size; j += LANES)
                    store(row + j, load(row + j) - factor * load(above + j));
            }
            lanes reciprocal = splat(1.0 / sqrt(fmax(row[k + p], least[k + p])));
            for (int64_t j = k; j < size; j += LANES)
                store(row + j, load(row + j) * reciprocal);
        }
        int64_t next = k + LANES;
        if (next < size)
            add_products(rows, size - next, s + k * stride + next, stride, -1.0, s + next * (stride + 1), stride);
    }
}

/* Solves R' y = x in place for x with `columns` columns, a multiple of eight. */
static HOT void substitute_forward(int64_t pivots, const double *r, int64_t stride, double *x, int64_t x_stride,
                                   int64_t columns)
{
    for (int64_t c = 0; c < columns; c += 2 * LANES)
        for (int64_t j = 0; j < pivots; j += LANES) {
            int64_t rows = pivots - j < LANES ? pivots - j : LANES;
            lanes left[LANES], right[LANES];
            for (int p = 0; p < LANES; p++) {
                left[p] = p < rows ? load(x + (j + p) * x_stride + c) : splat(0.0);
                right[p] = p < rows ? load(x + (j + p) * x_stride + c + LANES) : splat(0.0);
            }
            for (int64_t k = 0; k < j; k++) {
                lanes a = load(x + k * x_stride + c), b = load(x + k * x_stride + c + LANES);
                for (int p = 0; p < LANES; p++) {
                    left[p] -= r[k * stride + j + p] * a;
                    right[p] -= r[k * stride + j + p] * b;
                }
            }
            for (int p = 0; p < rows; p++) {
                for (int q = 0; q < p; q++) {
                    left[p] -= r[(j + q) * stride + j + p] * left[q];
                    right[p] -= r[(j + q) * stride + j + p] * right[q];
                }
                lanes reciprocal = splat(1.0 / r[(j + p) * stride + j + p]);
                left[p] *= reciprocal;
                right[p] *= reciprocal;
                store(x + (j + p) * x_stride + c, left[p]);
                store(x + (j + p) * x_stride + c + LANES, right[p]);
            }
        }
}

/* Solves R x = y in place for y with eight columns. */
static HOT void substitute_backward(int64_t pivots, const double *r, int64_t stride, double *x)
{
    for (int64_t k = pivots - 1; k >= 0; k--) {
        const double *row = r + k * stride;
        lanes left = load(x + 8 * k), right = load(x + 8 * k + LANES);
        for (int64_t j = k + 1; j < pivots; j++) {
            left -= row[j] * load(x + 8 * j);
            right -= row[j] * load(x + 8 * j + LANES);
        }
        lanes reciprocal = splat(1.0 / row[k]);
        store(x + 8 * k, left * reciprocal);
        store(x + 8 * k + LANES, right * reciprocal);
    }
}

#endif
