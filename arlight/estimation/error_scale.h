/* How large the model's errors are in a frame, told by the residuals: variance components by restricted likelihood.

   The errors of a row are the pixels' noise, which is known, and a scale times a usual variance for what model and
   codec leave out, with one scale for the means and one for the harmonics. A step of the minorise-maximise iteration
   raises the likelihood of the residuals, of which the fit has taken its share; repeated frame by frame it converges.

   Source: Zhou, Hu, Zhou, Lange, "MM algorithms for variance components models", 2019, section 2, for residuals. */
#ifndef ARLIGHT_ERROR_SCALE_H
#define ARLIGHT_ERROR_SCALE_H

#include "channel_prior.h"
#include "light_covariance.h"

#define LEAST_SCALE 0.003
#define MOST_SCALE 10.0
#define ROBUST_MEAN 1.06      /* what robust weights make of the squared residuals when all is as expected */
#define ROBUST_HARMONICS 0.91
#define JUDGED_TRUST 0.5      /* from which a row of red or blue was seen rather than inferred */

/* Places in BLOCK: covariance of L_0, Re, Im and the field (00, 01, 11, 02, 12, 22, 03, 13, 23, 33). */
enum { WITH_FIELD = 6, FIELD_VARIANCE = 9, ENTRIES = 10 };

/* Sums over the rows of one kind. */
typedef struct {
    lanes due, found, freedom;
} Judged;

/* Covariance of one frequency's blocks' unknowns, given `between`, that of their fields. */
INLINE void group_covariance(const ChannelFit *f, int64_t g, const double *between, int64_t stride)
{
    const int64_t from = f->first[g], blocks = f->first[g + 1] - from;
    const double *own = of_frequency(f, g), *last = f->fields + f->field * f->m->stride;
    const double root_mean = 1.0 / f->shared[f->field * (f->width + 1)];
    const double *shares[2] = {plane(f, SHARES) + from, plane(f, SHARES + 1) + from};
    double mean[2], with_mean[2], square[3] = {own[INVERSE], own[INVERSE + 1], own[INVERSE + 2]};
    share_of_mean(f, g, mean);
    for (int k = 0; k < 2; k++)
        with_mean[k] = mean[k] * root_mean * root_mean;
    for (int64_t i = 0; i < blocks; i++) {
        for (int k = 0; k < 2; k++)
            with_mean[k] += shares[k][i] * last[from + i] * root_mean;
    }
    for (int64_t i = 0; i < blocks; i++) {
        double with_field[2] = {mean[0] * last[from + i] * root_mean, mean[1] * last[from + i] * root_mean};
        for (int64_t j = 0; j < blocks; j++)
            for (int k = 0; k < 2; k++)
                with_field[k] += shares[k][j] * between[i < j ? i * stride + j : j * stride + i];
        for (int k = 0; k < 2; k++)
            plane(f, BLOCK + WITH_FIELD + 1 + k)[from + i] = with_field[k];
        square[0] += shares[0][i] * with_field[0];
        square[1] += shares[0][i] * with_field[1];
        square[2] += shares[1][i] * with_field[1];
    }
    square[0] += mean[0] * with_mean[0];
    square[1] += mean[0] * with_mean[1];
    square[2] += mean[1] * with_mean[1];
    const double entries[] = {with_mean[0], square[0], with_mean[1], square[1], square[2]};
    for (int64_t i = 0; i < blocks; i++)
        for (int k = 0; k < 5; k++)
            plane(f, BLOCK + 1 + k)[from + i] = entries[k];
}

/* Fills BLOCK. */
static HOT void block_covariances(const ChannelFit *f)
{
    const int64_t n = f->m->stride;
    const double root_mean = 1.0 / f->shared[f->field * (f->width + 1)];
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        lanes square = splat(0.0);
        for (int64_t k = 0; k <= f->field; k++) {
            lanes x = load(f->fields + k * n + b);
            square += x * x;
        }
        for (int k = 1; k < ENTRIES; k++)
            put(f, BLOCK + k, b, splat(0.0));
        put(f, BLOCK, b, splat(root_mean * root_mean));
        put(f, BLOCK + WITH_FIELD, b, root_mean * load(f->fields + f->field * n + b));
        put(f, BLOCK + FIELD_VARIANCE, b, square);
    }
    for (int64_t g = 1; g <= f->frequencies; g++) {
        int64_t size = (f->first[g + 1] - f->first[g] + LANES - 1) / LANES * LANES;
        for (int64_t i = 0; i < size * size; i++)
            f->small[i] = 0.0;
        add_products(f->field + 1, size, f->fields + f->first[g], n, 1.0, f->small, size);
        group_covariance(f, g, f->small, size);
    }
}

/* What of a row's precision the fit leaves. */
INLINE lanes precision_left(const ChannelFit *f, int64_t b, int r, const lanes *covariance)
{
    lanes left = at(f, PRECISION + PAIR[r][r], b), column[COLUMNS + 1];
    UNROLLED for (int k = 0, pair = 0; k <= COLUMNS; k++) {
        column[k] = at(f, WEIGHTED + k * ROWS + r, b);
        for (int l = 0; l <= k; l++, pair++)
            left -= (k == l ? 1.0 : 2.0) * covariance[pair] * column[k] * column[l];
    }
    return left;
}

static double next_scale(double old, const Judged *sums, double robust)
{
    double due = total(sums->due), freedom = total(sums->freedom);
    if (!(due > 0.0))
        return old;
    /* what chance may add to the residuals is not taken for an error of the model */
    double chance = 1.0 + sqrt(2.0 / (freedom + 1.0));
    return fmin(fmax(old * sqrt(total(sums->found) / (due * robust * chance)), LEAST_SCALE), MOST_SCALE);
}

/* One step; the next scales replace those that the fit had. */
static HOT void error_scales(const ChannelFit *f)
{
    const MeasuredBlocks *m = f->m;
    const double sparkle = sparkle_of(f);
    Judged sums[2] = {{splat(0.0), splat(0.0), splat(0.0)}, {splat(0.0), splat(0.0), splat(0.0)}};
    block_covariances(f);
    for (int64_t b = 0; b < m->blocks; b += LANES) {
        lanes covariance[ENTRIES], p[PAIRS], missed[ROWS], pull[ROWS], trust = at(f, TRUST, b);
        for (int k = 0; k < ENTRIES; k++)
            covariance[k] = at(f, BLOCK + k, b);
        UNROLLED for (int k = 0; k < PAIRS; k++)
            p[k] = at(f, PRECISION + k, b);
        load_rows(f, MISSED, b, missed);
        weigh(p, missed, pull);
        UNROLLED for (int r = 0; r < ROWS; r++) {
            int h = harmonic_of_row(r);
            lanes model = at(f, MODEL + h, b), own = load(m->pixels + PAIR[r][r] * m->stride + b) * at(f, NOISE, b);
            if (h) {
                own = (own + at(f, INFERRED + h - 1, b)) / (trust * trust);
                model /= trust * trust;
            } else {
                own += at(f, ORDINARY, b) - f->scale[0] * sparkle;
                model += sparkle;
            }
            model *= f->scale[h > 0];
            lanes all = own + model, share = model / larger(all, splat(1e-300));
            lanes judged = at(f, USABLE + h, b) * (h ? indicator(trust > JUDGED_TRUST) : splat(1.0));
            /* of the total only a part leaves a residual */
            lanes expected = precision_left(f, b, r, covariance) * (own + model / (h ? HARMONICS_ALIKE : MEAN_ALIKE));
            Judged *sum = sums + (h > 0);
            sum->due += judged * share * expected;
            sum->found += judged * share * pull[r] * pull[r] * all;
            sum->freedom += judged * expected;
        }
    }
    f->scale[0] = next_scale(f->scale[0], sums, ROBUST_MEAN);
    f->scale[1] = next_scale(f->scale[1], sums + 1, ROBUST_HARMONICS);
}

#endif
