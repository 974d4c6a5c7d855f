/* Quantiles without sorting. */
#ifndef ARLIGHT_QUANTILE_H
#define ARLIGHT_QUANTILE_H

#include <stdint.h>

/* Moves the k-th smallest of n values to its place, smaller ones before it. */
static inline double select_smallest(double *x, int64_t n, int64_t k)
{
    int64_t low = 0, high = n - 1;
    while (low < high) {
        double pivot = x[(low + high) / 2];
        int64_t i = low, j = high;
        while (i <= j) {
            while (x[i] < pivot)
                i++;
            while (x[j] > pivot)
                j--;
            if (i <= j) {
                double other = x[i];
                x[i++] = x[j];
                x[j--] = other;
            }
        }
        if (k <= j)
            high = j;
        else if (k >= i)
            low = i;
        else
            break;
    }
    return x[k];
}

/* Quantile with linear interpolation of n >= 1 values, which change places. */
static inline double quantile(double *x, int64_t n, double share)
{
    double place = share * (double)(n - 1);
    int64_t k = (int64_t)place;
    double lower = select_smallest(x, n, k), upper = lower;
    if (k + 1 < n) {
        upper = x[k + 1];
        for (int64_t i = k + 2; i < n; i++)
            upper = x[i] < upper ? x[i] : upper;
    }
    return lower + (place - (double)k) * (upper - lower);
}

#endif
