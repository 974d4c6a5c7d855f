/* What a frame reveals beside the light: how the picture blurs and shifts the stripes, what the glass mirrors.

   All of it enters the rows nearly linearly, so one Gauss-Newton step beside the solution finds it: the solution moves
   along, and what it costs the light's certainty follows from the same equations. */
#ifndef ARLIGHT_FRAME_NUISANCE_H
#define ARLIGHT_FRAME_NUISANCE_H

#include "residuals.h"
#include "shared_unknowns.h"

/* Before a frame has been seen, and how far from it: blur [px^2], sharpness [px^4], lower face, shift [px]. */
static const double USUAL[NUISANCES] = {0.4, 0.0, 1.0, 0.0, 0.0};
static const double PRIOR_SPREAD[NUISANCES] = {1.5, 0.005, 0.5, 0.03, 0.03};
static const double LEAST[NUISANCES] = {0.0, -0.005, 0.0, -0.3, -0.3};
static const double MOST[NUISANCES] = {6.0, 0.01, 1.5, 0.3, 0.3};

/* Normal equations of the nuisance. */
typedef struct {
    double information[NUISANCES][NUISANCES], right[NUISANCES]; /* the light being free */
    double step[NUISANCES];                                     /* of Gauss and Newton */
    double doubt[NUISANCES][NUISANCES]; /* lower triangle whose transpose times it is the covariance after the step */
} Step;

/* Change of four blocks' rows with the nuisance. */
INLINE void slopes_of_rows(const ChannelFit *f, int64_t b, double mean, lanes slopes[NUISANCES][ROWS])
{
    const MeasuredBlocks *m = f->m;
    lanes rows[ROWS], extra = at(f, EXTRA, b), mirrored = at(f, FIELD, b) * load(m->face + b);
    lit_rows(f, b, mean, rows);
    /* only what stands out of the noise can tell how the lower face mirrors it */
    mirrored += extra * extra * extra / larger(extra * extra + at(f, SPREAD, b), splat(1e-30));
    lanes x = 2.0 * PI * load(m->cycles + b), y = 2.0 * PI * load(m->cycles + m->stride + b), square = x * x + y * y;
    for (int r = 0; r < ROWS; r++) {
        rows[r] += at(f, MIRROR + r, b) * extra;
        slopes[2][r] = at(f, FACE + r, b) * mirrored;
    }
    slopes[0][0] = slopes[1][0] = slopes[3][0] = slopes[4][0] = splat(0.0);
    for (int r = 1; r < ROWS; r++) {
        double h = harmonic_of_row(r);
        lanes quarter = r % 2 ? -h * rows[r + 1] : h * rows[r - 1];
        slopes[0][r] = -0.5 * h * h * square * rows[r];
        slopes[1][r] = load(m->fineness + (harmonic_of_row(r) - 1) * m->stride + b) * rows[r];
        slopes[3][r] = x * quarter;
        slopes[4][r] = y * quarter;
    }
}

/* Fills SLOPES and CROSS; leaves the information and the right-hand side as if all else were known. */
static HOT void nuisance_equations(const ChannelFit *f, double mean, Step *s)
{
    lanes information[NUISANCES][NUISANCES], right[NUISANCES];
    for (int k = 0; k < NUISANCES; k++) {
        right[k] = splat(0.0);
        for (int l = 0; l < NUISANCES; l++)
            information[k][l] = splat(0.0);
    }
    for (int64_t b = 0; b < f->m->blocks; b += LANES) {
        lanes slopes[NUISANCES][ROWS], p[PAIRS], weighted[ROWS], missed[ROWS], column[ROWS];
        slopes_of_rows(f, b, mean, slopes);
        UNROLLED for (int i = 0; i < PAIRS; i++)
            p[i] = at(f, PRECISION + i, b);
        load_rows(f, MISSED, b, missed);
        UNROLLED for (int k = 0; k < NUISANCES; k++) {
            put_rows(f, SLOPES + k * ROWS, b, slopes[k]);
            weigh(p, slopes[k], weighted);
            right[k] += product(weighted, missed);
            UNROLLED for (int l = 0; l <= k; l++)
                information[k][l] += product(weighted, slopes[l]);
        }
        UNROLLED for (int c = 0; c <= COLUMNS; c++) {
            load_rows(f, WEIGHTED + c * ROWS, b, column);
            UNROLLED for (int k = 0; k < NUISANCES; k++)
                put(f, CROSS + c * NUISANCES + k, b, product(column, slopes[k]));
        }
    }
    for (int k = 0; k < NUISANCES; k++) {
        s->right[k] = total(right[k]);
        for (int l = 0; l <= k; l++)
            s->information[k][l] = s->information[l][k] = total(information[k][l]);
    }
}

INLINE double cross(const ChannelFit *f, int column, int k, int64_t block)
{
    return plane(f, CROSS + column * NUISANCES + k)[block];
}

/* Eliminates a frequency: of its columns' products with the slopes, and of L_0's. CROSS of the mirror becomes that of
   the blocks' field values. */
static HOT void eliminate_slopes(const ChannelFit *f, int64_t g, double *mean, Step *s)
{
    const int64_t from = f->first[g], n = f->first[g + 1] - from, stride = f->m->stride;
    const double *own = of_frequency(f, g), *mirror = plane(f, GRAM + WITH_MIRROR + 1) + from;
    double column[NUISANCES][2], solved[NUISANCES][2];
    for (int k = NUISANCES; k < WIDE; k++)
        f->carried_light[(2 * g - 1) * WIDE + k] = f->carried_light[2 * g * WIDE + k] = 0.0;
    for (int k = 0; k < NUISANCES; k++) {
        const double *real = plane(f, CROSS + NUISANCES + k) + from, *imaginary = real + NUISANCES * stride;
        double *field = plane(f, CROSS + COLUMNS * NUISANCES + k) + from, x = 0.0, y = 0.0;
        for (int64_t i = 0; i < n; i++) {
            x += real[i];
            y += imaginary[i];
        }
        column[k][0] = f->carried_light[(2 * g - 1) * WIDE + k] = x;
        column[k][1] = f->carried_light[2 * g * WIDE + k] = y;
        solved[k][0] = own[INVERSE] * x + own[INVERSE + 1] * y;
        solved[k][1] = own[INVERSE + 1] * x + own[INVERSE + 2] * y;
        mean[k] -= own[WITH_MEAN] * solved[k][0] + own[WITH_MEAN + 1] * solved[k][1];
        for (int64_t i = 0; i < n; i++)
            field[i] -= mirror[i] * solved[k][0] + mirror[stride + i] * solved[k][1];
        for (int l = 0; l <= k; l++)
            s->information[k][l] -= column[k][0] * solved[l][0] + column[k][1] * solved[l][1];
    }
}

/* Products of the shared unknowns with the slopes, the frequencies eliminated, in `carried`. */
static HOT void shared_slopes(const ChannelFit *f, Step *s)
{
    double mean[NUISANCES] = {0.0};
    for (int64_t i = 0; i < f->m->blocks; i++)
        for (int k = 0; k < NUISANCES; k++)
            mean[k] += cross(f, 0, k, i);
    for (int64_t g = 1; g <= f->frequencies; g++)
        eliminate_slopes(f, g, mean, s);
    for (int64_t j = 0; j < f->width; j += LANES) {
        lanes sum[WIDE];
        for (int k = 0; k < WIDE; k++)
            sum[k] = splat(0.0);
        for (int64_t i = 0; i < f->m->blocks; i++) {
            lanes row = load(f->basis + i * f->row + j);
            for (int k = 0; k < NUISANCES; k++)
                sum[k] += cross(f, COLUMNS, k, i) * row;
        }
        for (int i = 0; i < LANES; i++)
            for (int k = 0; k < WIDE; k++)
                f->carried[(j + i) * WIDE + k] = sum[k][i];
    }
    for (int k = 0; k < NUISANCES; k++)
        f->carried[f->field * WIDE + k] = mean[k];
}

/* How a frequency's coefficients move against the nuisance, given how the shared unknowns do. */
static HOT void carry_frequency(const ChannelFit *f, int64_t g)
{
    const double *own = of_frequency(f, g), *real = plane(f, GRAM + WITH_MIRROR + 1);
    const double *imaginary = plane(f, GRAM + WITH_MIRROR + 2);
    double *x = f->carried_light + (2 * g - 1) * WIDE, *y = x + WIDE;
    lanes left[2] = {load(x), load(y)}, right[2] = {load(x + LANES), load(y + LANES)};
    const double *mean = f->carried + f->field * WIDE;
    for (int k = 0; k < 2; k++) {
        left[k] -= own[WITH_MEAN + k] * load(mean);
        right[k] -= own[WITH_MEAN + k] * load(mean + LANES);
    }
    for (int64_t j = 0; j < f->field; j += LANES) {
        /* products of the frequency's columns with four amplitudes of the field */
        lanes with[2] = {splat(0.0), splat(0.0)};
        for (int64_t i = f->first[g]; i < f->first[g + 1]; i++) {
            lanes row = load(f->basis + i * f->row + j);
            with[0] += real[i] * row;
            with[1] += imaginary[i] * row;
        }
        for (int l = 0; l < LANES && j + l < f->field; l++) {
            lanes a = load(f->carried + (j + l) * WIDE), b = load(f->carried + (j + l) * WIDE + LANES);
            for (int k = 0; k < 2; k++) {
                left[k] -= with[k][l] * a;
                right[k] -= with[k][l] * b;
            }
        }
    }
    store(x, own[INVERSE] * left[0] + own[INVERSE + 1] * left[1]);
    store(y, own[INVERSE + 1] * left[0] + own[INVERSE + 2] * left[1]);
    store(x + LANES, own[INVERSE] * right[0] + own[INVERSE + 1] * right[1]);
    store(y + LANES, own[INVERSE + 1] * right[0] + own[INVERSE + 2] * right[1]);
}

/* How the solution moves against each nuisance, and the information that this leaves. */
static HOT void carry(const ChannelFit *f, Step *s)
{
    int64_t pivots = f->field + 1;
    shared_slopes(f, s);
    substitute_forward(pivots, f->shared, f->width, f->carried, WIDE, WIDE);
    for (int64_t j = 0; j < pivots; j++)
        for (int k = 0; k < NUISANCES; k++)
            for (int l = 0; l <= k; l++)
                s->information[k][l] -= f->carried[j * WIDE + k] * f->carried[j * WIDE + l];
    substitute_backward(pivots, f->shared, f->width, f->carried);
    for (int k = 0; k < WIDE; k++)
        f->carried_light[k] = f->carried[f->field * WIDE + k];
    for (int64_t g = 1; g <= f->frequencies; g++)
        carry_frequency(f, g);
}

/* Step and doubt, by the factor of the information and the prior's. */
static void gauss_newton(const ChannelFit *f, Step *s)
{
    double factor[NUISANCES][NUISANCES] = {{0.0}}, *inverse = &s->doubt[0][0], moved[NUISANCES];
    double prior[NUISANCES];
    int told = 0;
    for (int k = 0; k < NUISANCES * NUISANCES; k++)
        inverse[k] = 0.0;
    for (int k = 0; k < NUISANCES; k++) {
        told |= s->information[k][k] > 0.0;
        prior[k] = 1.0 / (PRIOR_SPREAD[k] * PRIOR_SPREAD[k]);
        s->step[k] = 0.0;
        for (int l = 0; l <= k; l++) {
            double sum = s->information[k][l] + (k == l ? prior[k] : 0.0);
            for (int i = 0; i < l; i++)
                sum -= factor[k][i] * factor[l][i];
            factor[k][l] = k == l ? sqrt(fmax(sum, prior[k])) : sum / factor[l][l];
        }
    }
    for (int l = 0; l < NUISANCES; l++)
        for (int k = l; k < NUISANCES; k++) {
            double sum = k == l ? 1.0 : 0.0;
            for (int i = l; i < k; i++)
                sum -= factor[k][i] * s->doubt[i][l];
            s->doubt[k][l] = sum / factor[k][k];
        }
    if (!told)
        return;
    for (int k = 0; k < NUISANCES; k++) {
        moved[k] = 0.0;
        for (int l = 0; l <= k; l++) {
            double pull = (USUAL[l] - f->nuisance[l]) * prior[l];
            moved[k] += s->doubt[k][l] * (s->right[l] + pull);
        }
    }
    for (int k = 0; k < NUISANCES; k++) {
        for (int l = k; l < NUISANCES; l++)
            s->step[k] += s->doubt[l][k] * moved[l];
        s->step[k] = fmin(fmax(f->nuisance[k] + s->step[k], LEAST[k]), MOST[k]) - f->nuisance[k];
    }
}

/* Takes the step: nuisance, coefficients, field and residuals move together. */
static HOT void step_nuisance(const ChannelFit *f, double *packed, Step *s)
{
    nuisance_equations(f, packed[0], s);
    carry(f, s);
    gauss_newton(f, s);
    for (int k = 0; k < NUISANCES; k++) {
        f->nuisance[k] += s->step[k];
        for (int64_t j = 0; j < f->field; j++)
            f->solution[j] -= f->carried[j * WIDE + k] * s->step[k];
        for (int64_t j = 0; j < coefficients(f); j++)
            packed[j] -= f->carried_light[j * WIDE + k] * s->step[k];
    }
    field_of_blocks(f);
    coefficients_of_blocks(f, packed);
    miss(f, packed[0], s->step);
}

#endif
