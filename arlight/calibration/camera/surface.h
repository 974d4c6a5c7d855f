/* A quadratic surface through samples, robustly: Tukey's biweight, its scale from the median residual. */
#ifndef ARLIGHT_SURFACE_H
#define ARLIGHT_SURFACE_H

#include "native.h"

enum { TERMS = 6, MOMENTS = 15, ROUNDS = 5, SECTORS = 24 };

static const double tuning = 4.7;               /* residuals beyond so many standard deviations have no say */
static const double smallest_deviation = 0.002; /* relative to the median sample */
static const double settled = 0.005;            /* relative change of that bound from which no round follows */
static const double ridge = 1e-9;               /* of each sample, on the normal equations' diagonal */

/* Samples of ink times a surface. */
typedef struct {
    int count;
    const double *x, *y;  /* (count) places within [-1, 1] */
    const double *ink;    /* (count) reflectances */
    const double *light;  /* (count) ink times the surface, and errors */
    const int *sector;    /* (count) samples of a sector err together */
    double *residual;     /* (count) scratch */
    double *weight;       /* (count) scratch */
    int *bits;            /* (count) scratch */
} Samples;

typedef struct {
    double level;    /* mean of the surface */
    double variance; /* of it, by sectors */
    double kept;     /* share of the samples that had a say */
} Level;

/* Place of the term x^a y^b among 1, x, y, xx, xy, yy, xxx, ... */
static inline int place_of(int a, int b)
{
    return (a + b) * (a + b + 1) / 2 + b;
}

/* Sums of weight ink^2 times all products of two terms, and of weight ink light times the terms. */
static HOT void add_up(const Samples *s, double *restrict squares, double *restrict right)
{
    double m[MOMENTS] = {0}, r[TERMS] = {0};
    const double *restrict xs = s->x, *restrict ys = s->y, *restrict inks = s->ink, *restrict lights = s->light;
    const double *restrict weights = s->weight;
    for (int i = 0; i < s->count; i++) {
        double x = xs[i], y = ys[i], xx = x * x, xy = x * y, yy = y * y;
        double v = weights[i] * inks[i] * lights[i], w = weights[i] * inks[i] * inks[i];
        double wxx = w * xx, wxy = w * xy, wyy = w * yy;
        m[0] += w, m[1] += w * x, m[2] += w * y;
        m[3] += wxx, m[4] += wxy, m[5] += wyy;
        m[6] += wxx * x, m[7] += wxx * y, m[8] += wyy * x, m[9] += wyy * y;
        m[10] += wxx * xx, m[11] += wxx * xy, m[12] += wxx * yy, m[13] += wyy * xy, m[14] += wyy * yy;
        r[0] += v, r[1] += v * x, r[2] += v * y;
        r[3] += v * xx, r[4] += v * xy, r[5] += v * yy;
    }
    for (int k = 0; k < MOMENTS; k++)
        squares[k] = m[k];
    for (int k = 0; k < TERMS; k++)
        right[k] = r[k];
}

/* Cholesky factor of the normal equations, lower, in place of their matrix. */
static void factor_normal(const double *squares, double added, double factor[TERMS][TERMS])
{
    static const int a[TERMS] = {0, 1, 0, 2, 1, 0}, b[TERMS] = {0, 0, 1, 0, 1, 2};
    for (int i = 0; i < TERMS; i++)
        for (int j = 0; j <= i; j++) {
            double sum = squares[place_of(a[i] + a[j], b[i] + b[j])] + (i == j ? added : 0.0);
            for (int k = 0; k < j; k++)
                sum -= factor[i][k] * factor[j][k];
            factor[i][j] = i == j ? sqrt(fmax(sum, 1e-300)) : sum / factor[j][j];
        }
}

static void solve_normal(double factor[TERMS][TERMS], const double *right, double *solution)
{
    for (int i = 0; i < TERMS; i++) {
        double sum = right[i];
        for (int k = 0; k < i; k++)
            sum -= factor[i][k] * solution[k];
        solution[i] = sum / factor[i][i];
    }
    for (int i = TERMS - 1; i >= 0; i--) {
        for (int k = i + 1; k < TERMS; k++)
            solution[i] -= factor[k][i] * solution[k];
        solution[i] /= factor[i][i];
    }
}

static inline double surface_at(const double *c, double x, double y)
{
    return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
}

/* Median of |values|, to a thousandth of it: the bits of floats, which rise with them, are counted in bins whose width
   doubles every octave. `bits` (count) is scratch. */
static HOT double median_magnitude(int count, const double *restrict values, int *restrict bits)
{
    enum { SHIFT = 17, TOP = 16 * 64 - 1 }; /* 64 bins an octave, 16 octaves below the largest */
    int bins[TOP + 1] = {0}, largest = 0;
    union { float value; int bits; } number;
    for (int i = 0; i < count; i++) {
        number.value = (float)fabs(values[i]);
        bits[i] = number.bits >> SHIFT;
        largest = largest > bits[i] ? largest : bits[i];
    }
    int base = largest > TOP ? largest - TOP : 0, bin = TOP + 1, above = 0, rank = count - count / 2;
    for (int i = 0; i < count; i++)
        bins[bits[i] > base ? bits[i] - base : 0]++;
    while (bin > 0 && above < rank)
        above += bins[--bin];
    number.bits = (base + bin) << SHIFT;
    double low = number.value;
    number.bits += 1 << SHIFT;
    return low + (number.value - low) * (above - rank + 0.5) / (bins[bin] > 0 ? bins[bin] : 1);
}

/* What the samples differ from a surface by. */
static HOT void differ(const Samples *s, const double *c, double *restrict residual)
{
    for (int i = 0; i < s->count; i++) {
        double x = s->x[i], y = s->y[i];
        double value = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
        residual[i] = s->light[i] - s->ink[i] * value;
    }
}

/* Biweights of residuals; returns how many are not zero. */
static HOT int weigh(const Samples *s, double bound, double *restrict weight)
{
    int kept = 0;
    double scale = 1.0 / bound;
    for (int i = 0; i < s->count; i++) {
        double ratio = s->residual[i] * scale, inside = 1.0 - ratio * ratio;
        inside = inside > 0.0 ? inside : 0.0;
        weight[i] = inside * inside;
        kept += inside > 0.0;
    }
    return kept;
}

/* How many sectors have samples. */
static int sectors_of(const Samples *s)
{
    unsigned seen = 0;
    for (int i = 0; i < s->count; i++)
        seen |= 1u << s->sector[i];
    return __builtin_popcount(seen);
}

/* Variance of the mean of a surface, a linear function of the samples: texture, codec and light that is not as smooth
   as the surface make the samples of a part err together. */
static HOT double variance_by_sectors(const Samples *s, const double *gain)
{
    double parts[SECTORS] = {0}, squares = 0.0;
    int counted = sectors_of(s);
    for (int i = 0; i < s->count; i++) {
        double x = s->x[i], y = s->y[i];
        double value = gain[0] + gain[1] * x + gain[2] * y + gain[3] * x * x + gain[4] * x * y + gain[5] * y * y;
        parts[s->sector[i]] += value * s->ink[i] * s->weight[i] * s->residual[i];
    }
    for (int k = 0; k < SECTORS; k++)
        squares += parts[k] * parts[k];
    return squares * counted / (counted > TERMS + 1 ? counted - TERMS : 1);
}

/* Level of a surface through samples, `mean` being the means of its terms where it is asked for. */
static Level level_of(const Samples *s, const double *mean)
{
    double squares[MOMENTS], right[TERMS], factor[TERMS][TERMS], surface[TERMS], gain[TERMS];
    double least = fmax(smallest_deviation * median_magnitude(s->count, s->light, s->bits), 1e-6);
    double bound = 0.0, last = INFINITY;
    int kept = 0;
    for (int i = 0; i < s->count; i++)
        s->weight[i] = 1.0;
    for (int round = 0; round < ROUNDS && !(fabs(bound - last) < settled * bound); round++) {
        add_up(s, squares, right);
        factor_normal(squares, ridge * s->count, factor);
        solve_normal(factor, right, surface);
        differ(s, surface, s->residual);
        last = bound;
        bound = tuning * fmax(1.4826 * median_magnitude(s->count, s->residual, s->bits), least);
        kept = weigh(s, bound, s->weight);
    }
    solve_normal(factor, mean, gain);
    double level = 0.0;
    for (int k = 0; k < TERMS; k++)
        level += mean[k] * surface[k];
    return (Level){level, variance_by_sectors(s, gain), (double)kept / s->count};
}

#endif
