/* What a solution leaves of the rows, what of it single blocks mirror, and how much each block counts after that. */
#ifndef ARLIGHT_RESIDUALS_H
#define ARLIGHT_RESIDUALS_H

#include "block_equations.h"

#define MEAN_ALIKE 5.0       /* variance of the model's errors, relative to the part of it that leaves a residual */
#define HARMONICS_ALIKE 14.0

/* Rows that light and field predict. */
INLINE void lit_rows(const ChannelFit *f, int64_t b, double mean, lanes *rows)
{
    lanes real = at(f, REAL, b), imaginary = at(f, IMAGINARY, b);
    lanes field = at(f, FIELD, b) * load(f->m->face + b);
    for (int r = 0; r < ROWS; r++)
        rows[r] = at(f, DESIGN + r, b) * mean + at(f, DESIGN + ROWS + r, b) * real +
                  at(f, DESIGN + 2 * ROWS + r, b) * imaginary + at(f, MIRROR + r, b) * field;
}

/* Fills MISSED and EXTRA. `step` is how far the nuisance moves beyond the model's rows; 0 for nowhere. */
static HOT void miss(const ChannelFit *f, double mean, const double *step)
{
    const MeasuredBlocks *m = f->m;
    for (int64_t b = 0; b < m->blocks; b += LANES) {
        lanes missed[ROWS], telling[ROWS];
        lit_rows(f, b, mean, missed);
        UNROLLED for (int r = 0; r < ROWS; r++) {
            missed[r] = load(m->measured + (f->channel * ROWS + r) * m->stride + b) - missed[r];
            for (int k = 0; k < NUISANCES && step; k++)
                missed[r] -= step[k] * at(f, SLOPES + k * ROWS + r, b);
        }
        put_rows(f, MISSED, b, missed);
        load_rows(f, TELLING, b, telling);
        put(f, EXTRA, b, at(f, SPREAD, b) * product(telling, missed));
    }
}

/* Sum of four blocks' squared residuals, relative to their variances, over the usable rows of some. */
INLINE lanes squares(const ChannelFit *f, int64_t b, int from, int to)
{
    lanes extra = at(f, EXTRA, b), trust = at(f, TRUST, b), noise = at(f, NOISE, b), sum = splat(0.0);
    for (int r = from; r < to; r++) {
        int h = harmonic_of_row(r);
        lanes left = at(f, MISSED + r, b) - at(f, MIRROR + r, b) * extra;
        lanes variance = load(f->m->pixels + PAIR[r][r] * f->m->stride + b) * noise;
        variance += at(f, MODEL + h, b) * (f->scale[h > 0] / (h ? HARMONICS_ALIKE : MEAN_ALIKE));
        if (h) {
            variance += at(f, INFERRED + h - 1, b);
            left *= trust;
        }
        sum += left * left / variance * at(f, USABLE + h, b);
    }
    return sum;
}

/* Variance to grant lamps next, a step of expectation and maximisation, and the blocks' next weights: Student-t by all
   of a block's harmonics together, for what hides a part of it spoils them all. */
static HOT void reweigh(const ChannelFit *f)
{
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        lanes extra = at(f, EXTRA, b), granted = f->lamp_freedom * at(f, ORDINARY, b) + extra * extra;
        store(f->lamp + b, (granted + at(f, SPREAD, b)) / (f->lamp_freedom + 1.0));
        lanes count = 2.0 * (at(f, USABLE + 1, b) + at(f, USABLE + 2, b) + at(f, USABLE + 3, b));
        store(f->weight + b, (f->weight_freedom + count) / (f->weight_freedom + squares(f, b, 1, ROWS)));
    }
}

/* Robust chi-square a usable row; nan where there is none. */
static HOT double chi_square(const ChannelFit *f)
{
    lanes sum = splat(0.0), count = splat(0.0);
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        sum += load(f->weight + b) * squares(f, b, 0, ROWS);
        for (int r = 0; r < ROWS; r++)
            count += at(f, USABLE + harmonic_of_row(r), b);
    }
    return total(count) > 0.0 ? total(sum) / total(count) : NAN;
}

#endif
