/* Least squares of blocks that share L_0 and a reflection field but have a frequency of their own.

   The normal matrix is an arrow: 2 x 2 blocks of the frequencies, bordered by what is shared. A frequency is eliminated
   from its few blocks' equations, in terms of L_0 and of these blocks' own field values; what is left is a handful of
   rows of the shared unknowns, whose outer products are summed. Order of the shared unknowns: amplitudes of the field,
   L_0, then the right-hand side. */
#ifndef ARLIGHT_SHARED_UNKNOWNS_H
#define ARLIGHT_SHARED_UNKNOWNS_H

#include "block_equations.h"
#include "symmetric.h"

#define ROUNDING 1e-13 /* what is left of a number after it was taken off, relative to it, counts as nothing */

INLINE double gram(const ChannelFit *f, int64_t number, int64_t block) { return plane(f, GRAM + number)[block]; }

INLINE double *of_frequency(const ChannelFit *f, int64_t g) { return f->frequency + g * FREQUENCY; }

/* Inverts a frequency's own equations and keeps their products with L_0 and with the values. */
INLINE void solve_frequency(const ChannelFit *f, int64_t g)
{
    double *own = of_frequency(f, g), a = f->certain[2 * g - 1], b = 0.0, c = f->certain[2 * g], mean[2] = {0, 0};
    double values[2] = {a * f->expected[2 * g - 1], c * f->expected[2 * g]};
    for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
        a += gram(f, 2, i);
        b += gram(f, 4, i);
        c += gram(f, 5, i);
        mean[0] += gram(f, 1, i);
        mean[1] += gram(f, 3, i);
        values[0] += gram(f, VALUES + 1, i);
        values[1] += gram(f, VALUES + 2, i);
    }
    /* nothing is less certain than before anything was measured, whatever rounding left */
    a = fmax(a, f->certain[2 * g - 1]);
    double share = b / a, rest = 1.0 / fmax(c - share * b, f->certain[2 * g]);
    own[INVERSE] = 1.0 / a + share * share * rest;
    own[INVERSE + 1] = -share * rest;
    own[INVERSE + 2] = rest;
    for (int k = 0; k < 2; k++) {
        own[WITH_MEAN + k] = mean[k];
        own[WITH_VALUES + k] = values[k];
    }
}

/* x' D^-1 y for a frequency's own 2 x 2 matrix D. */
INLINE double through(const double *own, const double *x, const double *y)
{
    return x[0] * (own[INVERSE] * y[0] + own[INVERSE + 1] * y[1]) +
           x[1] * (own[INVERSE + 1] * y[0] + own[INVERSE + 2] * y[1]);
}

/* Equations of some blocks' field values, L_0 and the right-hand side, rows of n + 2, their frequency eliminated. */
INLINE void reduce_group(const ChannelFit *f, int64_t from, int64_t n, const double *own, double *k)
{
    int64_t w = n + 2;
    for (int64_t i = 0; i < w * w; i++)
        k[i] = 0.0;
    for (int64_t i = 0; i < n; i++) {
        k[i * w + i] = gram(f, MIRROR_SQUARE, from + i);
        k[i * w + n] = gram(f, WITH_MIRROR, from + i);
        k[i * w + n + 1] = gram(f, VALUES_MIRROR, from + i);
        k[n * w + n] += gram(f, 0, from + i);
        k[n * w + n + 1] += gram(f, VALUES, from + i);
    }
    if (!own)
        return;
    for (int64_t i = 0; i <= n; i++) {
        double x[2] = {own[WITH_MEAN], own[WITH_MEAN + 1]};
        for (int c = 0; c < 2 && i < n; c++)
            x[c] = gram(f, WITH_MIRROR + 1 + c, from + i);
        for (int64_t j = i; j < n; j++) {
            double y[2] = {gram(f, WITH_MIRROR + 1, from + j), gram(f, WITH_MIRROR + 2, from + j)};
            k[i * w + j] -= through(own, x, y);
        }
        k[i * w + n] -= through(own, x, own + WITH_MEAN);
        k[i * w + n + 1] -= through(own, x, own + WITH_VALUES);
    }
}

/* Replaces a group's equations by the rows of their factor, as far as field values go; where a block says nothing that
   its frequency and the blocks before it do not say, its row is 0. `square` are the equations' diagonal at first. */
INLINE void factorise_group(int64_t n, const double *square, double *k)
{
    int64_t w = n + 2;
    for (int64_t i = 0; i < n; i++) {
        double pivot = k[i * w + i], reciprocal = pivot > ROUNDING * fabs(square[i]) ? 1.0 / sqrt(pivot) : 0.0;
        for (int64_t j = i; j < w; j++)
            k[i * w + j] *= reciprocal;
        for (int64_t j = i + 1; j <= n; j++)
            for (int64_t l = j; l < w; l++)
                k[j * w + l] -= k[i * w + j] * k[i * w + l];
    }
}

/* Writes n rows of the shared unknowns whose outer products are a group's equations. What is left of L_0 alone is added
   to the shared equations at once. */
static HOT void stack_group(const ChannelFit *f, int64_t from, int64_t n, const double *own, double *rows)
{
    double *k = f->small, *mean = f->shared + f->field * f->width + f->field;
    int64_t w = n + 2;
    reduce_group(f, from, n, own, k);
    factorise_group(n, plane(f, GRAM + MIRROR_SQUARE) + from, k);
    for (int64_t c = 0; c < f->width; c += LANES) {
        const double *fields = f->basis + from * f->row + c;
        for (int64_t i = 0; i < n; i++) {
            lanes sum = k[i * w + i] * load(fields + i * f->row);
            for (int64_t j = i + 1; j < n; j++)
                sum += k[i * w + j] * load(fields + j * f->row);
            store(rows + i * f->width + c, sum);
        }
    }
    for (int64_t i = 0; i < n; i++) {
        rows[i * f->width + f->field] = k[i * w + n];
        rows[i * f->width + f->field + 1] = k[i * w + n + 1];
    }
    mean[0] += k[n * w + n];
    mean[1] += k[n * w + n + 1];
}

/* Prior of the shared unknowns. */
static void start_shared(const ChannelFit *f)
{
    const double white = white_of(f), amplitude = f->m->amplitude[f->channel];
    for (int64_t i = 0; i < f->width * f->width; i++)
        f->shared[i] = 0.0;
    /* the mean reflection and red's and blue's share of green's pattern may be anything up to white */
    for (int64_t i = 0; i < f->field; i++) {
        double deviation = i <= 1 ? white : amplitude;
        f->shared[i * (f->width + 1)] = f->least[i] = 1.0 / (deviation * deviation);
    }
    f->shared[f->field * (f->width + 1)] = f->least[f->field] = f->certain[0];
    f->shared[f->field * (f->width + 1) + 1] = f->certain[0] * f->expected[0];
}

/* Fills FIELD. */
static HOT void field_of_blocks(const ChannelFit *f)
{
    double *field = plane(f, FIELD);
    for (int64_t i = 0; i < f->m->blocks; i++) {
        lanes sum = splat(0.0);
        for (int64_t c = 0; c < f->width; c += LANES)
            sum += load(f->basis + i * f->row + c) * load(f->solution + c);
        field[i] = total(sum);
    }
}

/* Fills REAL and IMAGINARY. */
static void coefficients_of_blocks(const ChannelFit *f, const double *packed)
{
    double *real = plane(f, REAL), *imaginary = plane(f, IMAGINARY);
    for (int64_t g = 0; g <= f->frequencies; g++)
        for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
            real[i] = g ? packed[2 * g - 1] : 0.0;
            imaginary[i] = g ? packed[2 * g] : 0.0;
        }
}

/* Coefficients of the frequencies, given L_0 and the blocks' field. */
static HOT void substitute_frequencies(const ChannelFit *f, double *packed)
{
    const double *field = plane(f, FIELD);
    for (int64_t g = 1; g <= f->frequencies; g++) {
        const double *own = of_frequency(f, g);
        double x = own[WITH_VALUES] - own[WITH_MEAN] * packed[0];
        double y = own[WITH_VALUES + 1] - own[WITH_MEAN + 1] * packed[0];
        for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
            x -= gram(f, WITH_MIRROR + 1, i) * field[i];
            y -= gram(f, WITH_MIRROR + 2, i) * field[i];
        }
        packed[2 * g - 1] = own[INVERSE] * x + own[INVERSE + 1] * y;
        packed[2 * g] = own[INVERSE + 1] * x + own[INVERSE + 2] * y;
    }
}

/* Solves for all unknowns: packed coefficients, `solution`, and the planes FIELD, REAL and IMAGINARY. */
static HOT void solve_shared(const ChannelFit *f, double *packed)
{
    const int64_t pivots = f->field + 1;
    start_shared(f);
    for (int64_t i = f->first[0]; i < f->first[1]; i++)
        stack_group(f, i, 1, 0, f->stacked + i * f->width);
    for (int64_t g = 1; g <= f->frequencies; g++) {
        int64_t from = f->first[g];
        solve_frequency(f, g);
        stack_group(f, from, f->first[g + 1] - from, of_frequency(f, g), f->stacked + from * f->width);
    }
    add_products(f->m->blocks, f->width, f->stacked, f->width, 1.0, f->shared, f->width);
    factorise(pivots, f->width, f->shared, f->width, f->least);
    for (int64_t k = 0; k < f->width; k++)
        f->solution[k] = 0.0;
    for (int64_t k = pivots - 1; k >= 0; k--) {
        const double *row = f->shared + k * f->width;
        lanes sum = splat(0.0);
        for (int64_t j = k / LANES * LANES; j < f->width; j += LANES)
            sum += load(row + j) * load(f->solution + j);
        /* on and left of the diagonal the solution is still 0 */
        f->solution[k] = (row[pivots] - total(sum)) / row[k];
    }
    packed[0] = f->solution[f->field];
    f->solution[f->field] = 0.0;
    field_of_blocks(f);
    substitute_frequencies(f, packed);
    coefficients_of_blocks(f, packed);
}

#endif
