/* A covariance in other terms, where each term is a multiple of its own and of the first: light and relative light. */
#ifndef ARLIGHT_RELATIVE_LIGHT_H
#define ARLIGHT_RELATIVE_LIGHT_H

#include "native.h"

/* Term i is scale_i times its own error plus slope_i times that of term 0; slope_0 = 0. */
typedef struct {
    double *scale; /* (n) */
    double *slope; /* (n) */
    double *arm;   /* (n) scale times the first row's entry and half of slope times its first */
} Terms;

/* The arms that go with a matrix, from its first row. */
static inline void extend(Terms terms, int n, const double *restrict first)
{
    for (int j = 0; j < n; j++)
        terms.arm[j] = terms.scale[j] * first[j] + 0.5 * terms.slope[j] * first[0];
}

/* Entry (i, j) of a matrix in the new terms: a rank-two update instead of two matrix products. */
static inline double converted(Terms terms, int i, int j, double entry)
{
    return terms.scale[i] * terms.scale[j] * entry + terms.slope[i] * terms.arm[j] + terms.slope[j] * terms.arm[i];
}

#endif
